//! What becomes of sets of causes that were fitted beyond physical bounds.

use super::fit::{Bench, Fit, Part, figure};
use super::means;
use super::select::{is_within_bounds, price, refined};

/// Least gain of a cause that has strayed beyond physical bounds for it to be put right: a third of what is left. What strays and
/// explains less has found nothing of its own: of 71 springs that did one came back within bounds, and would not have been carried on.
const LEAST_PUT_RIGHT: f64 = 0.4;

/// Whether a set that has strayed matters beside the best that has not: bounds only take away, so that one that explains less
/// without them does not come first within them.
#[must_use]
pub fn matters(strayed: &Fit, best: Option<&Fit>) -> bool {
    best.is_none_or(|best| price(strayed) < price(best))
}

/// What a set with a cause more becomes that was fitted beyond physical bounds: without those of before that the new one has made
/// needless, or with the new one from other starts where it is itself what has strayed; `None` where neither is to be expected
/// to help.
#[must_use]
pub fn put_right(bench: &Bench, set: &Fit, fit: &Fit) -> Option<Fit> {
    let sound: Vec<usize> = (0..fit.parts.len()).filter(|i| is_within_bounds(bench, fit, *i)).collect();
    let new = fit.parts.len().checked_sub(1)?;
    if sound.len() > new {
        return None; // all are, but a ripple is there twice
    }
    if sound.contains(&new) {
        return Some(bench.refine_roughly(bench.fit(sound.iter().map(|i| fit.parts[*i].clone()).collect()), 0, 2));
    }
    if price(fit) > price(set) - LEAST_PUT_RIGHT {
        return None;
    }
    let Part { law, shape, .. } = &fit.parts[new];
    let starts = bench.parts(law, (law.manner.restarts)(shape)).into_iter();
    let starts = starts.map(|part| (figure(&bench.joined(set, &part)), part));
    let (_, part) = starts.min_by(|a, b| a.0.total_cmp(&b.0))?;
    let again = refined(bench, set, part, set.squares());
    if is_within_bounds(bench, &again, new) { Some(again) } else { means::told(bench, set, &again.parts[new]) }
}
