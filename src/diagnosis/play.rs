//! A spring that has play. A search that knows springs and clearances finds the one of them that does more, and what the other does is
//! left or is made good by what has no part in it. So where much is left beside either, both together are tried in its place.
//!
//! The swing and the impacts make the sum of squares rugged: the two are approached on sums over shorter and shorter times. Sums over many
//! swings tell what is lost at a reversal, and only shorter ones how much of that is play, how the table swings and how heavy it is.

use super::causes::{Law, Resistance, law, loose_spring, table_side};
use super::fit::{Bench, Fit, Part};
use super::judge::{Excess, LITTLE_LEFT};
use super::many::dot;
use super::progress::{Stopped, Watch};
use super::select::{LEAST_GAIN, is_physical, price};
use super::valleys;
use crate::machine::Cause;
use std::sync::Arc;

/// Times over which rows are summed, s, how far apart the points of a slope are, in steps of each scale, and most moves: few where many
/// are under way.
const STAGES: [(f64, f64, usize); 3] = [(0.05, 12.0, 6), (0.02, 8.0, 3), (0.006, 4.0, 6)];
/// Swings of the table that are carried on from each of the finer stages.
const CARRIED_ON: [usize; 2] = [5, 2];
/// Most steps of a fit by itself, with all the others, and further ones of the best: its numbers lean on each other.
const STEPS: [usize; 3] = [6, 4, 16];
/// Frequency of contact, Hz, below which flanks that leave little may be a spring with play: hard ones are found at twice that and more.
const SOFT_HZ: f64 = 300.0;
/// Share of its squares that a spring must come down to with a little play for more to be tried, and of those that a set leaves on the
/// first sums where that cannot be asked of friction that builds up.
const LESS: f64 = 0.97;
/// Excess over the noise floor (in variance) above which a spring leaves twice the noise.
const MUCH_LEFT: f64 = 3.0;
/// How hard flanks meet that both are compared with, Hz.
const HARD_HZ: [f64; 3] = [900.0, 450.0, 220.0];
/// What is said meanwhile.
const STAGE: &str = "looking for play in a spring";

/// The fit, or the same with both in the place of its spring or clearance, where both are among these laws: what is believed is not
/// found again.
///
/// # Errors
/// [`Stopped`] when the watch's caller said so.
pub fn added(bench: &Bench, laws: &[&'static Law], fit: Fit, watch: &Watch) -> Result<Fit, Stopped> {
    let may_be_both = laws.iter().filter(|law| law.is_simulated()).count() > 1;
    let left = Excess::of(bench, &fit, &fit).largest();
    let open = |part: &Part| left > LITTLE_LEFT || left.ln_1p() > LEAST_GAIN && is_soft(part);
    let table = fit.table().map(|at| &fit.parts[at]).filter(|part| may_be_both && !loose_spring::is(part));
    if !table.is_some_and(open) {
        return Ok(fit);
    }
    // Friction that builds up may have stood in for the spring of a clearance.
    let stands_in = fit.parts.iter().position(|part| part.law.manner.turns_table);
    let without = stands_in.map(|i| bench.without(&fit, i));
    let mut best: Option<Fit> = None;
    for set in [Some(&fit), without.as_ref()].into_iter().flatten() {
        let found = in_its_place(bench, &fit, set, watch)?;
        best = best.into_iter().chain(found).min_by(|a, b| price(a).total_cmp(&price(b)));
    }
    let Some(both) = best.map(|best| bench.refine(best, 0, STEPS[2])).filter(|best| is_sound(bench, best)) else {
        return Ok(fit);
    };
    let both = valleys::settled(bench, laws, both, watch)?;
    // Hard flanks that a coarse recording smears look soft.
    let hard = watch.each(&HARD_HZ, (0.9, 0.9), STAGE, |hz| with_hard_flanks(bench, &both, *hz))?;
    let one = hard.into_iter().flatten().chain([fit]).min_by(|a, b| price(a).total_cmp(&price(b)));
    // Both are a cause more.
    Ok(one.filter(|one| price(one) - LEAST_GAIN <= price(&both)).unwrap_or(both))
}

/// The same with flanks that meet so hard in the place of the spring.
fn with_hard_flanks(bench: &Bench, both: &Fit, hz: f64) -> Option<Fit> {
    let at = both.table()?;
    let shape = loose_spring::with_hard_flanks(&both.parts[at].shape, hz)?;
    let others: Vec<Part> = bench.without(both, at).parts;
    let own = bench.parts_under(law(Cause::Backlash), vec![shape], &bench.resistance_of(both));
    let start = bench.fit(others.iter().cloned().chain(own).collect());
    let fit = bench.refine(bench.refine_roughly(start, others.len(), STEPS[0]), 0, STEPS[1]);
    is_sound(bench, &fit).then_some(fit)
}

/// Whether a table is behind a spring, or behind flanks that meet as if they were one.
fn is_soft(part: &Part) -> bool {
    part.law.cause == Cause::DriveCompliance || part.shape.last().is_some_and(|contact_hz| *contact_hz < SOFT_HZ)
}

fn is_sound(bench: &Bench, fit: &Fit) -> bool {
    fit.squares().is_finite() && is_physical(bench, fit)
}

/// A spring with play in the place of the spring or clearance of a set, which is what was found or a part of it.
fn in_its_place(bench: &Bench, found: &Fit, set: &Fit, watch: &Watch) -> Result<Option<Fit>, Stopped> {
    let table = set.table().map(|at| &set.parts[at]);
    let effect = table.and_then(|part| part.law.effect(bench.frame, &part.shape, &[]));
    let Some(masses) = table_side::split(bench.frame, effect) else { return Ok(None) };
    let others: Vec<Part> = set.parts.iter().filter(|part| !part.law.is_simulated()).cloned().collect();
    let (beside, resistance) = (bench.fit(others.clone()), bench.resistance_of(set));
    let with = |own: Part| bench.fit(others.iter().cloned().chain([own]).collect());
    // A spring that has play leaves less with a little of it, once its other numbers have made room for that.
    let whole = set.parts.len() == found.parts.len();
    // One that leaves much has gone far astray by what the play does, and no little of it helps.
    let astray = Excess::of(bench, found, found).largest() > MUCH_LEFT;
    let little = loose_spring::with_little_play(bench.frame, &masses).filter(|_| whole && !astray);
    // Tables beside friction that builds up take long, and leave much for other reasons.
    let in_doubt = little.is_none() && found.parts.iter().any(|part| part.law.manner.turns_table);
    if let Some(little) = little {
        let starts = bench.parts_under(&loose_spring::LAW, little, &resistance).into_iter().map(with);
        let Some(start) = starts.min_by(|a, b| a.squares().total_cmp(&b.squares())) else { return Ok(None) };
        let enough = LESS * set.squares();
        if bench.refine_towards(start, others.len(), STEPS[1], enough).squares() > enough {
            return Ok(None);
        }
    }
    let [first, finer @ ..] = STAGES.map(|(seconds, steps, moves)| (bench.smoothed(seconds), (steps, moves)));
    let approached =
        |(sums, moves): &(Bench, _), law, shapes| approached((sums, *moves), &beside, (law, shapes), &resistance);
    let starts = loose_spring::starts(bench.frame, &masses);
    let lost =
        watch.each(&starts, (0.9, 0.9), STAGE, |shapes| approached(&first, &loose_spring::LOST, shapes.clone()))?;
    let Some((left, lost)) = lost.into_iter().flatten().min_by(|a, b| a.0.total_cmp(&b.0)) else { return Ok(None) };
    if in_doubt && left > LESS * first.0.again(found).squares() {
        return Ok(None);
    }
    let mut there = loose_spring::losing(bench.frame, &lost);
    for (stage, carried_on) in finer.iter().zip(CARRIED_ON) {
        let moved = |shape: &Vec<f64>| approached(stage, &loose_spring::LAW, vec![shape.clone()]);
        let mut nearer: Vec<_> = watch.each(&there, (0.9, 0.9), STAGE, moved)?.into_iter().flatten().collect();
        nearer.sort_by(|a, b| a.0.total_cmp(&b.0));
        there = nearer.into_iter().take(carried_on).map(|(_, shape)| shape).collect();
    }
    let fits = watch.each(&there, (0.9, 0.9), STAGE, |shape| {
        let start = with(bench.parts_under(&loose_spring::LAW, vec![shape.clone()], &resistance).swap_remove(0));
        bench.refine(bench.refine_roughly(start, others.len(), STEPS[0]), 0, STEPS[1])
    })?;
    Ok(fits.into_iter().filter(|fit| is_sound(bench, fit)).min_by(|a, b| price(a).total_cmp(&price(b))))
}

/// Squares that are left, and where the best of some starts leads on sums.
fn approached(
    (sums, (steps, most)): (&Bench, (f64, usize)),
    beside: &Fit,
    (law, shapes): (&'static Law, Vec<Vec<f64>>),
    resistance: &Arc<Resistance>,
) -> Option<(f64, Vec<f64>)> {
    let there = sums.again(beside);
    let squares = |part: &Part| {
        let left = sums.left_beside(&there, part);
        dot(&left, &left)
    };
    let parts = sums.parts_under(law, shapes, resistance).into_iter();
    let rated = parts.map(|part| (squares(&part), part)).filter(|(squares, _)| squares.is_finite());
    let (_, nearest) = rated.min_by(|a, b| a.0.total_cmp(&b.0))?;
    let part = sums.approached(&there, nearest, steps, most);
    Some((squares(&part), part.shape))
}
