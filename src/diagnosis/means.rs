//! Springs by means over some swings. Behind a motor that is known to a step of its encoder a simulated table swings at its own frequency
//! by that step alone, and what it would need for that is no torque of the machine: the rows then tell a spring that is damped as none
//! is, of a table that weighs nothing. Means over some periods of that frequency have none of the swing, and all of what the table's
//! windup does below it.

use super::causes::drive_compliance::BY_MEANS;
use super::fit::{Bench, Fit, Part, figure};
use super::judge::{Excess, LITTLE_LEFT};
use super::select::is_within_bounds;
use crate::machine::Cause;

/// Periods of the swing that a mean is taken over.
const PERIODS: f64 = 3.0;
/// Most steps of the fit of a spring to means, and of all causes with it to the rows.
const STEPS: [usize; 2] = [8, 2];

/// A set with the spring that means tell, in the place of one that the rows tell wrong; `None` where no scale shows that the table
/// goes otherwise than the motor, and where the spring does not halve that.
#[must_use]
pub fn told(bench: &Bench, set: &Fit, strayed: &Part) -> Option<Fit> {
    if strayed.law.cause != Cause::DriveCompliance || !scale_shows_more(bench, set) {
        return None;
    }
    let means = over_swings(bench, strayed);
    let there = means.again(set);
    let starts = means.parts(&BY_MEANS, (BY_MEANS.manner.restarts)(&strayed.shape)).into_iter();
    let starts = starts.map(|part| (figure(&means.joined(&there, &part)), part));
    let (_, part) = starts.min_by(|a, b| a.0.total_cmp(&b.0))?;
    let parts = there.parts.iter().cloned().chain([part]).collect();
    let fit = on_rows(bench, &means.refine_roughly(means.fit(parts), 0, STEPS[0]));
    let new = set.parts.len();
    (is_within_bounds(bench, &fit, new) && fit.halves(set)).then_some(fit)
}

/// The causes of a fit with the spring that means tell, if it has left its bounds; without one if means tell it and the scale shows
/// more than that: a spring that is wound up by what it carries is all that they know.
#[must_use]
pub fn settled(bench: &Bench, fit: Fit) -> Fit {
    let without = |fit: &Fit, at| bench.refine_roughly(bench.without(fit, at), 0, STEPS[1]);
    let strayed = fit.table().filter(|at| !is_within_bounds(bench, &fit, *at));
    let fit = strayed.and_then(|at| told(bench, &without(&fit, at), &fit.parts[at])).unwrap_or(fit);
    match fit.table().filter(|at| fit.parts[*at].law.manner.told_by_means) {
        Some(at) if scale_shows_more(bench, &fit) => without(&fit, at),
        _ => fit,
    }
}

/// Whether the table goes otherwise than a set says, beyond the noise of its scale.
fn scale_shows_more(bench: &Bench, fit: &Fit) -> bool {
    Excess::of(bench, fit, fit).of_channel(1) > LITTLE_LEFT
}

/// A set whose spring was told by means, by means beside all its causes.
#[must_use]
pub fn told_again(bench: &Bench, fit: Fit) -> Fit {
    let Some(spring) = fit.table().map(|at| &fit.parts[at]).filter(|part| part.law.manner.told_by_means) else {
        return fit;
    };
    let means = over_swings(bench, spring);
    on_rows(bench, &means.refine_roughly(means.again(&fit), 0, STEPS[0]))
}

fn over_swings<'f, 'a>(bench: &Bench<'f, 'a>, spring: &Part) -> Bench<'f, 'a> {
    bench.smoothed(spring.shape.first().map_or(0.0, |own_hz| PERIODS / own_hz))
}

/// The causes of a set that was fitted to means, fitted to the rows.
fn on_rows(bench: &Bench, fit: &Fit) -> Fit {
    let resistance = bench.resistance_of(fit);
    let part = |part: &Part| bench.parts_under(part.law, vec![part.shape.clone()], &resistance).swap_remove(0);
    bench.refine_roughly(bench.fit(fit.parts.iter().map(part).collect()), 0, STEPS[1])
}
