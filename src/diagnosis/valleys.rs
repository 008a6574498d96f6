//! What lies between motor and table has several valleys. A drive winds up as far under half of the friction with half of the
//! stiffness, and flanks that are soft and have hardly any play are a spring: a fit goes down to the bottom of the valley in which
//! it began. Once the other causes are known the next ones are looked into.

use super::causes::Law;
use super::fit::{Bench, Fit};
use super::judge::{Excess, LITTLE_LEFT};
use super::progress::{Stopped, Watch};
use super::select::{is_physical, price};
use crate::machine::Cause;

/// Most steps of a fit by itself, and with all the others.
const STEPS: [usize; 2] = [6, 4];
/// Of the starts of a spring in place of a clearance one in so many is tried, where nothing shakes it.
const EVERY: usize = 3;

/// The fit, or the same causes in a better valley of what is simulated.
///
/// # Errors
/// [`Stopped`] when the watch's caller said so.
pub fn settled(bench: &Bench, laws: &[&'static Law], fit: Fit, watch: &Watch) -> Result<Fit, Stopped> {
    let Some(at) = fit.table() else { return Ok(fit) };
    if Excess::of(bench, &fit, &fit).largest() <= LITTLE_LEFT {
        return Ok(fit);
    }
    let part = &fit.parts[at];
    let beside = bench.without(&fit, at);
    let others = &beside.parts;
    // A table that is shaken near its own frequency seems to have another, or flanks, as long as nobody knows that it is.
    let shaken = others.iter().any(|part| part.law.is_shaking());
    let imitated = part.law.cause == Cause::Backlash || shaken && part.law.cause == Cause::DriveCompliance;
    let spring = laws.iter().filter(|law| law.cause == Cause::DriveCompliance && imitated);
    let every = if shaken { 1 } else { EVERY };
    let as_spring = spring.map(|&law| (law, bench.starts(law, &beside).into_iter().step_by(every).collect()));
    let tried: Vec<(&'static Law, Vec<Vec<f64>>)> =
        as_spring.chain([(part.law, (part.law.manner.valleys)(&part.shape))]).collect();
    let resistance = bench.resistance_of(&fit);
    let found = watch.each(&tried, (0.9, 0.9), "looking into other valleys", |(law, shapes)| {
        let with = |own| bench.fit(others.iter().cloned().chain([own]).collect());
        let starts = bench.parts_under(law, shapes.clone(), &resistance).into_iter().map(with);
        let start = starts.min_by(|a, b| price(a).total_cmp(&price(b)))?;
        let there = bench.refine_roughly(start, others.len(), STEPS[0]);
        Some(bench.refine(there, 0, STEPS[1])).filter(|fit| is_physical(bench, fit))
    })?;
    Ok(found.into_iter().flatten().chain([fit]).min_by(|a, b| price(a).total_cmp(&price(b))).unwrap_or(beside))
}
