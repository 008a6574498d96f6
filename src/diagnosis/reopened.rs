//! An effect of the belief that is there with other numbers than believed. What is believed may be off by as much as no law holds
//! more exactly; but where the same law with other numbers leaves much less than the believed ones do, it is these that are wrong.
//! The effect is then looked for as if nothing were known of it, and what is found takes its place.

use super::belief;
use super::causes::{LAWS, Law, law, loose_spring, position_dependent_friction};
use super::fit::{Bench, Fit};
use super::frame::Frame;
use super::judge::{TOLERABLE_EXCESS, rms};
use super::known::{Known, has_phase, numbers};
use super::left::Left;
use super::progress::{Stopped, Watch};
use super::select::{Search, is_physical};
use super::verdict::Diagnosis;
use crate::machine::{Axis, Cause, Effect};

/// Most steps of a fit.
const STEPS: usize = 8;
/// Excess over the noise floor (in variance) that causes may leave: a floor that is read off a thousand rows is known better.
const LITTLE_LEFT_BY_CAUSES: f64 = 0.2;
/// What other numbers leave at most of what was left above the noise floor, in amplitude. What is simulated never has its impacts quite right.
const MOST_LEFT: f64 = 0.5;
/// The same of what is worked out by rows: of three machines with coloured noise, of which the floor does not see all, the right ones left
/// 0.55 to 0.6.
const MOST_LEFT_BY_ROWS: f64 = 0.65;
/// The same of a ripple: what is left beside one is a ripple of the same period, and not another.
const MOST_LEFT_OF_RIPPLE: f64 = 0.96;

/// The axis without the effect that other numbers put right; `found` is what was found on `bench`, beside all that is believed of it.
/// `None` where that leaves little more than noise, or no other numbers of one of its effects leave less by far.
///
/// # Errors
/// [`Stopped`] when the watch's caller said so.
pub fn without_misjudged(
    axis: &Axis,
    bench: &Bench,
    found: &Diagnosis,
    watch: &Watch,
) -> Result<Option<Axis>, Stopped> {
    let frame = bench.frame;
    let excess = |rms: f64, noise: f64| (rms.powi(2) - noise.powi(2)).max(0.0);
    let least = if found.findings.is_empty() { TOLERABLE_EXCESS } else { LITTLE_LEFT_BY_CAUSES };
    let unexplained = [Some(&found.unexplained.torque), found.unexplained.table.as_ref()];
    let above =
        |left: &Left| Some(excess(left.rms, left.noise_rms)).filter(|all| *all > least * left.noise_rms.powi(2));
    let all = unexplained.map(|left| left.and_then(above));
    let mut best: (f64, Option<Axis>) = (1.0, None);
    let suspects = if all.iter().any(Option::is_some) { suspects(axis, frame) } else { Vec::new() };
    for Suspect { without, believed: (law, shape), laws, most_left } in suspects {
        let other = Bench::new(frame, &Known::of(&without, frame));
        let near = other.refine_roughly(other.fit(other.parts(law, vec![shape])), 0, STEPS);
        let far = Search::new(&other, &laws, watch)?.from_belief()?.fit;
        let share_left = |fit: &Fit| {
            let above = |(c, rest): (usize, &Vec<f64>)| Some(excess(rms(rest), frame.floor(rest, c == 0)) / all[c]?);
            other.rest(fit).iter().enumerate().filter_map(above).fold(f64::INFINITY, f64::min).sqrt()
        };
        let physical = [near, far].into_iter().filter(|fit| is_physical(&other, fit));
        let left = physical.map(|fit| share_left(&fit)).fold(f64::INFINITY, f64::min);
        if left < most_left.min(best.0) {
            best = (left, Some(without));
        }
    }
    Ok(best.1)
}

/// What of a belief may be there with other numbers.
struct Suspect {
    /// The axis without it.
    without: Axis,
    /// Its law, with the believed numbers.
    believed: (&'static Law, Vec<f64>),
    /// By what it would be found.
    laws: Vec<&'static Law>,
    /// What other numbers must come down to, as a share in amplitude.
    most_left: f64,
}

/// Each effect by itself, but a spring and its play together: those are simulated as one.
fn suspects(axis: &Axis, frame: &Frame) -> Vec<Suspect> {
    let is_of_one = |effect: &Effect| law(effect.cause()).is_simulated();
    let loose_spring = || {
        let without = axis.with_effects(axis.effects.iter().copied().filter(|effect| !is_of_one(effect)).collect());
        let shape = loose_spring::shape_of(frame, &axis.two_masses().ok()??);
        let laws = LAWS.iter().copied().filter(|law| law.is_simulated()).collect();
        Some(Suspect { without, believed: (&loose_spring::LAW, shape), laws, most_left: MOST_LEFT })
    };
    let both = axis.effects.iter().filter(|effect| is_of_one(effect)).count() > 1;
    let by_itself = |(i, effect): (usize, &Effect)| {
        let believed = numbers(axis, frame, effect).filter(|_| is_by_itself(axis, effect))?;
        let mut others = axis.effects.clone();
        others.remove(i);
        let most_left = match effect {
            effect if has_phase(effect) => MOST_LEFT_OF_RIPPLE,
            effect if is_of_one(effect) => MOST_LEFT,
            _ => MOST_LEFT_BY_ROWS,
        };
        Some(Suspect { without: axis.with_effects(others), laws: vec![believed.0], believed, most_left })
    };
    let alone = axis.effects.iter().enumerate().filter(|(_, effect)| !(both && is_of_one(effect)));
    alone.filter_map(by_itself).chain(both.then(loose_spring).flatten()).collect()
}

/// Whether an effect is not found beside what is believed of it: there is one of it, or two side by side imitate anything, as two
/// ripples of one period do.
fn is_by_itself(axis: &Axis, effect: &Effect) -> bool {
    !belief::may_be_found(axis, effect.cause())
        || effect.cause() == Cause::PositionDependentFriction
        || has_phase(effect)
}

/// The axis without what was found again: ripples with a period that the recording does not tell from the believed one, and tight spots
/// in the place of a believed one, of which another height was believed; `None` where there are none.
#[must_use]
pub fn without_found_again(axis: &Axis, frame: &Frame, found: &[Effect]) -> Option<Axis> {
    let shape = |effect: &Effect| numbers(axis, frame, effect).map(|(_, shape)| shape);
    let alike = |believed: &Effect, found: &Effect| {
        let (Some(believed_shape), Some(shape)) = (shape(believed), shape(found)) else { return false };
        match believed.cause() {
            Cause::PositionDependentFriction => position_dependent_friction::is_same_place(&believed_shape, &shape),
            _ => has_phase(believed) && has_phase(found) && (shape[0] - believed_shape[0]).abs() < 1.0,
        }
    };
    let again =
        |believed: &Effect| found.iter().any(|found| found.cause() == believed.cause() && alike(believed, found));
    let others: Vec<Effect> = axis.effects.iter().copied().filter(|effect| !again(effect)).collect();
    (others.len() < axis.effects.len()).then(|| axis.with_effects(others))
}
