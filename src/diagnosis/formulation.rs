//! How friction builds up after a reversal is formulated in more than one way: by a bristle (Dahl, LuGre), by a bristle of another
//! exponent, which goes on stiff and slips late (elasto-plastic), by elements that slip one after the other (Maxwell slip). What a
//! displacement is worth depends on it. The search knows one bristle and one spread of elements; here the exponents are refined, and
//! another formulation than the plain bristle is taken where it is known to be better.

pub mod by_position;

use super::causes::presliding_friction::{BRISTLE, ELEMENTS, ELEMENTS_AS_BRISTLE, OF_ANY_EXPONENT};
use super::causes::{Law, law};
use super::fit::{Bench, Fit, Part};
use super::progress::{Stopped, Watch};
use super::select::{LEAST_GAIN, LEAST_STRENGTH, Selection, is_physical, is_within_bounds, price};
use super::shrink::shrink;
use super::uncertainty;
use super::verdict::block_t;
use crate::machine::{Cause, Effect};

/// Most steps of a fit by itself, and with all the others.
const OWN_STEPS: usize = 5;
const STEPS: usize = 8;
/// Squares over the least up to which a fit by itself is refined with the others.
const WITHIN_REACH: f64 = 1.3;
/// Displacements over that of the other kind at which a kind is tried.
const APART: [f64; 3] = [0.7, 1.0, 1.4];
/// Gain from which on another formulation is refined in any case: what a cause must gain.
const MUCH: f64 = LEAST_GAIN;
/// Below this mean over scatter of what one fit gains over another in each block they are alike.
const ALIKE: f64 = 2.0;

/// What is said while it is done.
const STAGE: &str = "comparing how friction builds up";

/// A set with that of the two kinds that the search knows which suits it: friction that seems to build up by elements while it is the
/// only cause is often a bristle beside others.
#[must_use]
pub fn suited(bench: &Bench, fit: Fit, most: usize) -> Fit {
    let Some(at) = place(&fit).filter(|at| fit.parts.len() > 1 && !is_another(&fit.parts[*at])) else { return fit };
    let Part { law, shape, .. } = &fit.parts[at];
    let kind = if shape[1..] == BRISTLE { ELEMENTS } else { BRISTLE };
    let stiffnesses = APART.map(|apart| vec![shape[0] * apart, kind[0], kind[1]]);
    let with = |own: Part| {
        let mut parts = fit.parts.clone();
        parts[at] = own;
        bench.fit(parts)
    };
    let others = bench.parts(law, stiffnesses.into()).into_iter().map(with);
    match others.min_by(|a, b| a.squares().total_cmp(&b.squares())) {
        Some(other) if other.squares() < WITHIN_REACH * fit.squares() => {
            let other = bench.refine_roughly(other, 0, most);
            if other.squares() < fit.squares() { other } else { fit }
        }
        _ => fit,
    }
}

/// The selection with friction that builds up by the law that it follows, and without what only stood in for that.
///
/// # Errors
/// [`Stopped`] when the watch's caller said so.
pub fn settled(bench: &Bench, found: Selection, watch: &Watch) -> Result<Selection, Stopped> {
    let Some(at) = place(&found.fit) else { return Ok(found) };
    // What is tried is refined by itself first: that is enough to see whether it is worth more.
    let mut parts = found.fit.parts.clone();
    let sought = parts.remove(at);
    let (last, stiffness) = (parts.len(), sought.shape[0]);
    let with = |law: &'static Law, [exponent, kind]: [f64; 2], stiffness: f64| {
        let shape = vec![stiffness, exponent, kind];
        let own = bench.parts(law, vec![shape]);
        bench.refine_roughly(bench.fit(parts.iter().cloned().chain(own).collect()), last, OWN_STEPS)
    };
    let is_plain = sought.shape[1..] == BRISTLE;
    let any = &OF_ANY_EXPONENT;
    let plain_law = law(Cause::PreslidingFriction);
    let kinds = [
        (any, BRISTLE, stiffness),
        (any, ELEMENTS, stiffness),
        (any, ELEMENTS_AS_BRISTLE, 0.5 * stiffness),
        (plain_law, BRISTLE, stiffness),
    ];
    // Elements that were found have gone from their start as far as they would.
    let tried = if is_plain { &kinds[..3] } else { &[kinds[0], kinds[1], kinds[3]] };
    let mut fits = watch.each(tried, (0.9, 0.9), STAGE, |&(law, kind, stiffness)| with(law, kind, stiffness))?;
    let plain = if is_plain { found.fit.clone() } else { fits.remove(2) };
    fits.sort_by(|a, b| a.squares().total_cmp(&b.squares()));
    fits.truncate(2);
    let Ok([best, other]) = <[Fit; 2]>::try_from(fits) else { return Ok(found) };
    // Beside what only stands in for it an exponent is not sure before all are refined.
    let much_less = price(&best) < price(&plain) - MUCH;
    if much_less || price(&best) < price(&plain) && is_surely_another(bench, &best, &plain) {
        let alike = other.squares() <= WITHIN_REACH * best.squares();
        let near: Vec<Fit> = std::iter::once(best).chain(alike.then_some(other)).collect();
        let refined = |fit: &Fit| sound(bench, bench.refine(fit.clone(), 0, STEPS));
        let mut fits: Vec<Fit> = watch.each(&near, (0.9, 0.9), STAGE, refined)?.into_iter().flatten().collect();
        fits.sort_by(|a, b| a.squares().total_cmp(&b.squares()));
        if fits.first().is_some_and(|fit| price(fit) < price(&plain) && is_surely_another(bench, fit, &plain)) {
            let fit = fits.remove(0);
            fits.retain(|other| block_t(bench, other, &fit) < ALIKE);
            return without_substitutes(bench, Selection { fit, alike: fits, ..found }, watch);
        }
    }
    let fit = if is_plain { plain } else { bench.refine(plain, 0, STEPS) };
    Ok(if is_physical(bench, &fit) { Selection { fit, ..found } } else { found })
}

/// Where friction that builds up is among the parts.
fn place(fit: &Fit) -> Option<usize> {
    fit.parts.iter().position(|part| part.law.cause == Cause::PreslidingFriction)
}

/// Whether a part is friction that builds up in another way than a plain bristle, as was found here.
#[must_use]
pub fn is_another(part: &Part) -> bool {
    std::ptr::eq(part.law, &OF_ANY_EXPONENT)
}

/// A fit, if need be without the parts that have left their bounds; `None` where that does not help.
fn sound(bench: &Bench, fit: Fit) -> Option<Fit> {
    if is_physical(bench, &fit) {
        return Some(fit);
    }
    let within = (0..fit.parts.len()).filter(|&i| is_within_bounds(bench, &fit, i));
    let fit = bench.refine(bench.fit(within.map(|i| fit.parts[i].clone()).collect()), 0, STEPS);
    Some(fit).filter(|fit| is_physical(bench, fit))
}

/// The selection without causes that only stood in for what the law did not have.
fn without_substitutes(bench: &Bench, found: Selection, watch: &Watch) -> Result<Selection, Stopped> {
    if found.fit.parts.len() == 1 {
        return Ok(found);
    }
    let fit = shrink(bench, found.fit, watch)?;
    let left: Vec<Cause> = fit.parts.iter().map(|part| part.law.cause).collect();
    let of_the_same = |other: Fit| {
        let parts = other.parts.into_iter().filter(|part| left.contains(&part.law.cause)).collect::<Vec<_>>();
        (parts.len() == left.len()).then(|| bench.fit(parts))
    };
    let alike = found.alike.into_iter().filter_map(of_the_same).collect();
    Ok(Selection { fit, alike, rivals: found.rivals })
}

/// Whether friction surely builds up in another way than by the plain bristle: by its exponent or, since elements of the same
/// exponent differ from a bristle only before they have all slipped, by what it leaves less in the blocks.
fn is_surely_another(bench: &Bench, fit: &Fit, plain: &Fit) -> bool {
    let Some(at) = place(fit) else { return false };
    let by_exponent = match uncertainty::effects(bench, fit, None).swap_remove(at) {
        Some((Effect::PreslidingFriction { exponent, .. }, deviations)) => {
            (exponent - BRISTLE[0]).abs() > LEAST_STRENGTH * deviations[1]
        }
        _ => false,
    };
    by_exponent || fit.parts[at].shape[2..] == ELEMENTS[1..] && block_t(bench, plain, fit) > LEAST_STRENGTH
}
