//! One wave in place of several. Where an axis works at two places far from each other, ripples of many periods fit both, each with
//! another number of waves between the places; beside a cause that is not found yet the wrong one may come first, and others then take
//! what it leaves.

use super::{Search, is_physical, price};
use crate::diagnosis::fit::{Fit, Part, figure};
use crate::diagnosis::progress::Stopped;
use crate::machine::Cause;

/// Periods over the stroke, or the recording, about those of the ones that were found: so far to either side, as a share, and in such steps.
const ABOUT: f64 = 0.3;
const STEP: f64 = 0.3;
/// Most of them.
const MOST: usize = 400;
/// How many are refined, and in how many steps.
const BEST: usize = 3;
const STEPS: usize = 8;

/// A set with one ripple in place of several of its cause, where that costs less.
///
/// # Errors
/// [`Stopped`] when the watch's caller said so.
pub fn fewer(search: &Search, mut fit: Fit) -> Result<Fit, Stopped> {
    let Search { bench, watch, .. } = search;
    for law in search.laws {
        let is_wave = |part: &&Part| part.law.cause == law.cause;
        let may_be_one = law.cause.row().repeatable && law.cause != Cause::PositionDependentFriction;
        if !may_be_one || fit.parts.iter().filter(is_wave).count() < 2 {
            continue;
        }
        // The largest is nearest to what is there.
        let empty = bench.fit(Vec::new());
        let left = |part: &&Part| figure(&bench.joined(&empty, part));
        let waves = fit.parts.iter().filter(is_wave);
        let Some(largest) = waves.min_by(|a, b| left(a).total_cmp(&left(b))) else { continue };
        let others = bench.fit(fit.parts.iter().filter(|part| !is_wave(part)).cloned().collect());
        let periods = |i: usize| largest.shape[0] * (1.0 - ABOUT) + STEP * i as f64;
        let tried = (0..MOST).map(periods).take_while(|periods| *periods < largest.shape[0] * (1.0 + ABOUT));
        let shapes = tried.map(|periods| [&[periods], &largest.shape[1..]].concat()).collect();
        let mut rated: Vec<(f64, Part)> =
            bench.parts(law, shapes).into_iter().map(|part| (figure(&bench.joined(&others, &part)), part)).collect();
        rated.sort_by(|a, b| a.0.total_cmp(&b.0));
        rated.truncate(BEST);
        let refined = |(_, part): &(f64, Part)| {
            let parts = others.parts.iter().cloned().chain([part.clone()]).collect();
            bench.refine(bench.fit(parts), 0, STEPS)
        };
        let one = watch.each(&rated, (0.9, 0.9), super::FITTING, refined)?;
        let sound = one.into_iter().filter(|one| is_physical(bench, one));
        fit = sound.fold(fit, |fit, one| if price(&one) < price(&fit) { one } else { fit });
    }
    Ok(fit)
}
