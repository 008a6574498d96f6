//! An effect of the belief that is there with other numbers than believed. What is believed may be off by as much as no law holds
//! more exactly; but where the same law with other numbers leaves much less than the believed ones do, it is these that are wrong.
//! The effect is then looked for as if nothing were known of it, and what is found takes its place.

use super::belief;
use super::fit::Bench;
use super::frame::Frame;
use super::judge::{TOLERABLE_EXCESS, rms};
use super::known::{Known, has_phase, numbers};
use super::select::is_physical;
use crate::machine::{Axis, Cause, Effect};

/// Most steps of a fit.
const STEPS: usize = 8;
/// What other numbers leave at most of what the believed ones do, in amplitude.
const MOST_LEFT: f64 = 0.5;
/// The same of a ripple: what is left beside one is a ripple of the same period, and not another.
const MOST_LEFT_OF_RIPPLE: f64 = 0.96;

/// The axis without the effect that other numbers put right; `bench` is with all that is believed of it. `None` where that leaves
/// little more than noise, or no other numbers of one of its effects help.
#[must_use]
pub fn without_misjudged(axis: &Axis, frame: &Frame, bench: &Bench) -> Option<Axis> {
    let believed = bench.rest(&bench.fit(Vec::new()));
    let above = |c: usize| (rms(&believed[c]) / frame.floor(&believed[c], c == 0)).powi(2) - 1.0 > TOLERABLE_EXCESS;
    let channels: Vec<usize> = (0..2).filter(|&c| !believed[c].is_empty() && above(c)).collect();
    if channels.is_empty() {
        return None;
    }
    let left = (0..axis.effects.len()).filter(|&i| is_by_itself(axis, &axis.effects[i])).filter_map(|i| {
        let mut others = axis.effects.clone();
        let effect = others.remove(i);
        let without = axis.with_effects(others);
        let (law, shape) = numbers(axis, frame, &effect)?;
        let other = Bench::new(frame, &Known::of(&without, frame));
        let fit = other.refine_roughly(other.fit(other.parts(law, vec![shape])), 0, STEPS);
        let rest = other.rest(&fit);
        let left = channels.iter().map(|&c| rms(&rest[c]) / rms(&believed[c])).fold(f64::INFINITY, f64::min);
        let most_left = if has_phase(&effect) { MOST_LEFT_OF_RIPPLE } else { MOST_LEFT };
        (is_physical(&other, &fit) && left < most_left).then_some((left, without))
    });
    left.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, without)| without)
}

/// Whether an effect is not found beside what is believed of it: there is one of it, or two side by side imitate anything, as two
/// ripples of one period do.
fn is_by_itself(axis: &Axis, effect: &Effect) -> bool {
    !belief::may_be_found(axis, effect.cause())
        || effect.cause() == Cause::PositionDependentFriction
        || has_phase(effect)
}

/// The axis without the ripples that were found again, with a period that the recording does not tell from the believed one; `None`
/// where there are none.
#[must_use]
pub fn without_found_again(axis: &Axis, frame: &Frame, found: &[Effect]) -> Option<Axis> {
    let turns = |effect: &Effect| numbers(axis, frame, effect).filter(|_| has_phase(effect)).map(|(_, shape)| shape[0]);
    let again = |believed: &Effect| {
        let same = |found: &&Effect| found.cause() == believed.cause();
        let beats = |found: &Effect| Some((turns(found)? - turns(believed)?).abs());
        found.iter().filter(same).filter_map(beats).any(|beats| beats < 1.0)
    };
    let others: Vec<Effect> = axis.effects.iter().copied().filter(|effect| !again(effect)).collect();
    (others.len() < axis.effects.len()).then(|| axis.with_effects(others))
}
