//! What the position tells of sets of causes that the torque does not tell apart. A small clearance, a spring and friction that builds up act
//! in the same few rows about a reversal, which the low-pass smears alike; a loop that is replayed with the wrong one of them misses the
//! measured position by more.

use super::fit::{Bench, Fit};
use super::gain::{Errors, HeldOut};
use super::missed::{Over, strength};
use super::progress::{Stopped, Watch};
use super::select::{Selection, is_physical, price};
use super::verdict::block_t;

/// Below this mean over scatter of what one set gains over another in each block, times √blocks, and this difference in their figures the
/// torque does not tell them apart.
const ALIKE: f64 = 2.0;
const NEAR: f64 = 0.02;
/// Mean over scatter of what a set gains in each block of the position, times √blocks, from which on that tells them apart.
const SURELY: f64 = 3.0;
/// Most steps of the fit of a rival, which the search refines but roughly.
const STEPS: usize = 8;

/// Whether the torque does not tell a set from another that leaves less.
#[must_use]
pub fn is_alike(bench: &Bench, rival: &Fit, fit: &Fit) -> bool {
    block_t(bench, rival, fit) < ALIKE && rival.figure() - fit.figure() < NEAR
}

/// The selection with the set that the position tells, of those which the torque does not tell apart, and what its machine errs by; rivals
/// that it surely refutes are none.
///
/// # Errors
/// [`Stopped`] when the watch's caller said so.
pub fn settled(
    bench: &Bench,
    held_out: &HeldOut,
    (mut found, mut errors): (Selection, Option<Errors>),
    watch: &Watch,
) -> Result<(Selection, Option<Errors>), Stopped> {
    let missed = |errors: &Errors| held_out.missed(errors);
    let (alike, mut others): (Vec<Fit>, Vec<Fit>) =
        std::mem::take(&mut found.rivals).into_iter().partition(|rival| is_alike(bench, rival, &found.fit));
    for rival in alike {
        watch.at(0.92, "asking the position which of two causes it is")?;
        let refined = bench.refine(rival.clone(), 0, STEPS);
        let rival = if is_physical(bench, &refined) { refined } else { rival };
        let its = if is_physical(bench, &rival) { held_out.errors(&rival)? } else { None };
        let (Some(before), Some(after)) = (errors.as_ref().and_then(missed), its.as_ref().and_then(missed)) else {
            others.push(rival);
            continue;
        };
        let gained: Vec<f64> = before.iter().zip(&after).map(|(before, after)| before - after).collect();
        let lost: Vec<f64> = gained.iter().map(|gained| -gained).collect();
        if strength(&gained, &before, Over::All) > SURELY && price(&rival) < price(&found.fit) + NEAR {
            (found.fit, found.alike, errors) = (rival, Vec::new(), its);
        } else if strength(&lost, &after, Over::All) <= SURELY {
            others.push(rival);
        }
    }
    found.rivals = others;
    Ok((found, errors))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::belief;
    use crate::diagnosis::by_loop::tests::{recorded, rig};
    use crate::diagnosis::causes::law;
    use crate::diagnosis::frame::Frame;
    use crate::diagnosis::known::Known;
    use crate::diagnosis::whole::Whole;
    use crate::machine::{Axis, Cause, Effect};

    const CLEARANCE: Effect = Effect::Backlash {
        width_um: 5.0,
        table_inertia_share: 0.4,
        table_friction_share: 0.6,
        contact_hz: 600.0,
        contact_damping_ratio: 0.3,
    };

    /// The cause that is settled for, and its rivals, where the torque of the rig with that clearance does not tell which of two it is.
    fn told(first: Cause, axis: &Axis) -> (Cause, Vec<Cause>) {
        let excerpt = recorded(&[CLEARANCE], 0.05);
        let whole = excerpt.columns.as_ref().unwrap();
        let (base, thinned) = (belief::base_alone(axis), whole.clone().thinned());
        let frame = Frame::new(&base, &thinned, None);
        let bench = Bench::new(&frame, &Known::of(axis, &frame));
        let (watch, whole) = (Watch::new(&|_, _| true), Whole::new(axis, whole));
        let held_out = HeldOut::new([axis, axis], &whole, &bench, &watch);
        let one = |cause: Cause| {
            let shape = match cause {
                Cause::Backlash => vec![5.0, 0.4, 0.6, 600.0],
                _ => vec![2.0, 1.0, 0.0],
            };
            bench.refine(bench.fit(bench.parts(law(cause), vec![shape])), 0, STEPS)
        };
        let other = if first == Cause::Backlash { Cause::PreslidingFriction } else { Cause::Backlash };
        let (fit, rivals) = (one(first), vec![one(other)]);
        assert!(is_alike(&bench, &rivals[0], &fit), "{} {}", rivals[0].figure(), fit.figure());
        let errors = held_out.errors(&fit).unwrap();
        let found = Selection { fit, rivals, alike: Vec::new() };
        let (found, _) = settled(&bench, &held_out, (found, errors), &watch).unwrap();
        let cause = |fit: &Fit| fit.parts[0].law.cause;
        (cause(&found.fit), found.rivals.iter().map(cause).collect())
    }

    #[test]
    fn the_position_tells_what_the_torque_does_not() {
        for first in [Cause::Backlash, Cause::PreslidingFriction] {
            assert_eq!(told(first, &rig()).0, Cause::Backlash, "{first:?}");
        }
        // Without a servo nothing can be replayed: both may be.
        let blind = Axis { servo: None, ..rig() };
        assert_eq!(told(Cause::Backlash, &blind), (Cause::Backlash, vec![Cause::PreslidingFriction]));
    }
}
