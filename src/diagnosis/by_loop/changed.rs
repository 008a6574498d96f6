//! An effect about reversals that the belief has with other numbers than the machine. The torque may hide that, as it hides such an effect
//! that nobody believes; the loop is asked about this one cause, in the place of the believed one.

use super::trial::starts;
use super::{Missed, Replays, answered, told};
use crate::diagnosis::belief;
use crate::diagnosis::causes::law;
use crate::diagnosis::excerpt::Excerpt;
use crate::diagnosis::frame::Frame;
use crate::diagnosis::progress::{Stopped, Watch};
use crate::diagnosis::select::LEAST_STRENGTH;
use crate::diagnosis::verdict::{Diagnosis, Finding};
use crate::machine::{Axis, Effect};

/// Share of its first number from which on an effect is another one than is believed: the loop is keener than a law holds.
const ANOTHER: f64 = 0.1;

/// An answer with the numbers that the loop gives the one such effect of the belief, where those are others and do much better.
///
/// # Errors
/// [`Stopped`] when the watch's caller said so.
pub(super) fn corrected(
    axis: &Axis,
    (replays, holdout): (&Replays, Option<&Excerpt>),
    frame: &Frame,
    (found, believed, missed): (Diagnosis, &Effect, &Missed),
    watch: &Watch,
) -> Result<Diagnosis, Stopped> {
    let cause = believed.cause();
    let without = belief::without(&found.extended, &[cause]);
    let base = belief::base_alone(&without);
    let frame = &frame.believing(&base);
    let trials = starts(frame, law(cause));
    let told = told(trials, replays, frame, (missed, [&found.extended, &without]), watch)?;
    let Some((_, told)) = told.filter(|(_, told)| is_another(&told.finding, believed)) else { return Ok(found) };
    Ok(answered(axis, holdout, frame, (replays, &without), (found.clone(), told), watch)?.unwrap_or(found))
}

/// Whether a finding is not what is believed, and surely so.
fn is_another(found: &Finding, believed: &Effect) -> bool {
    let [now, before] = [&found.effect, believed].map(|effect| effect.values()[0]);
    let apart = (now - before).abs();
    apart > ANOTHER * before.abs() && apart > LEAST_STRENGTH * found.deviations[0]
}

#[cfg(test)]
mod tests {
    use super::super::tests::{answer_beside, clearance, recorded, rig};
    use super::*;

    /// What the loop finds of a rig with one effect that is believed to be another; `None` where it stays with the belief.
    fn found_by_loop(hidden: Effect, believed: Effect) -> Option<Finding> {
        let mut answer = answer_beside(&rig().with_effects(vec![believed]), &[], &recorded(&[hidden], 0.05));
        assert!(answer.findings.len() <= 1 && answer.extended.effects.len() == 1, "{:?}", answer.findings);
        answer.findings.pop().inspect(|finding| assert_eq!(answer.extended.effects, [finding.effect]))
    }

    fn builds_up(displacement_um: f64) -> Effect {
        Effect::PreslidingFriction { displacement_um, exponent: 1.0, maxwell_slip: 0.0, micro_damping_s: 0.0 }
    }

    #[test]
    fn numbers_that_are_not_as_believed_are_put_right() {
        for (hidden, believed) in
            [(clearance(5.0), clearance(8.0)), (clearance(6.0), clearance(3.0)), (builds_up(9.0), builds_up(5.0))]
        {
            let Some(found) = found_by_loop(hidden, believed) else { panic!("{believed:?} stays") };
            let [now, truth] = [found.effect, hidden].map(|effect| effect.values()[0]);
            assert!((now / truth - 1.0).abs() < 0.05, "{now} ± {} of {truth}", found.deviations[0]);
            assert!((now - truth).abs() < 3.0 * found.deviations[0] + 0.01 * truth, "{now} ± {}", found.deviations[0]);
        }
    }

    #[test]
    fn a_belief_that_is_right_or_nearly_so_stays() {
        for (hidden, believed) in
            [(clearance(5.0), clearance(5.0)), (clearance(5.0), clearance(5.2)), (builds_up(9.0), builds_up(9.3))]
        {
            let found = found_by_loop(hidden, believed);
            assert!(found.is_none(), "{found:?}");
        }
    }
}
