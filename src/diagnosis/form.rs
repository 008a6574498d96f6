//! Of what form the laws of a set are: the usual one, unless another leaves clearly less. A number more to fit makes all others
//! less sure, and a set without it is not worse by what filters and grids make of a law.

use super::causes::Scale;
use super::fit::{Bench, Fit};
use super::select::{LEAST_GAIN, is_within_bounds, price};
use std::ops::Range;

/// Least gain of another form.
const LEAST_OF_FORM: f64 = 0.25 * LEAST_GAIN;
/// How far off the usual form a search for another begins.
const BESIDE: f64 = 1.02;

/// A set with some of its parts of the form that the rows show; these parts and those after them are refined so often.
#[must_use]
pub fn settled(bench: &Bench, mut fit: Fit, parts: Range<usize>, most: usize) -> Fit {
    let first = parts.start;
    for part in parts {
        for (index, scale) in fit.parts[part].law.scales.iter().enumerate() {
            let Scale::Form(.., usual) = *scale else { continue };
            let is_usual = fit.parts[part].shape[index] == usual;
            if is_usual && leaves_nothing(bench, &fit) {
                continue;
            }
            let other = of_form(bench, &fit, (part, index), if is_usual { usual * BESIDE } else { usual });
            let other = bench.refine_roughly(other, first, most);
            let (as_usual, free) = if is_usual { (&fit, &other) } else { (&other, &fit) };
            let shown = price(free) < price(as_usual) - LEAST_OF_FORM && is_within_bounds(bench, free, part);
            if shown == is_usual {
                fit = other;
            }
        }
    }
    fit
}

/// Whether no form of a law can gain anything: what is left is the noise floor.
fn leaves_nothing(bench: &Bench, fit: &Fit) -> bool {
    let above: f64 = bench.channels(&fit.residual).iter().map(|square| square.max(1.0).ln()).sum();
    above < LEAST_OF_FORM
}

fn of_form(bench: &Bench, fit: &Fit, (part, index): (usize, usize), value: f64) -> Fit {
    let mut parts = fit.parts.clone();
    let mut shape = parts[part].shape.clone();
    shape[index] = value;
    parts[part] = bench.parts_like(&parts[part], vec![shape]).swap_remove(0);
    bench.fit(parts)
}
