//! What the position tells of how friction builds up. After one reversal elements that slip one after the other go as a bristle of twice
//! their displacement does, and the torque hardly tells them apart; where a servo moves to and fro within that displacement, a bristle
//! creeps away and elements return, and its loop comes to rest elsewhere.

use super::{OWN_STEPS, place};
use crate::diagnosis::causes::law;
use crate::diagnosis::causes::presliding_friction::{BRISTLE, ELEMENTS_AS_BRISTLE, OF_ANY_EXPONENT};
use crate::diagnosis::fit::{Bench, Fit};
use crate::diagnosis::gain::{Errors, HeldOut};
use crate::diagnosis::missed::{LEAST_EXPLAINED, NOTHING, Over, is_much, mean, strength};
use crate::diagnosis::progress::{Stopped, Watch};
use crate::diagnosis::select::is_physical;
use crate::machine::Cause;

/// Squares of the torque over those of the one that was found up to which it does not tell another formulation from that.
const ALIKE: f64 = 1.2;
/// Mean over scatter of what another formulation gains in each block, times √blocks, from which on it is the one.
const SURELY: f64 = 3.0;
/// What elements of another exponent must gain beyond usual ones, as a share of what is missed.
const MORE: f64 = 0.05;

/// The causes of a fit with elements in place of its bristle, or the other way round, and what their machine errs by, where the loop surely
/// misses the measured position by much less with them.
///
/// # Errors
/// [`Stopped`] when the watch's caller said so.
pub fn told(
    bench: &Bench,
    held_out: &HeldOut,
    (fit, errors): (&Fit, &Errors),
    watch: &Watch,
) -> Result<Option<(Fit, Errors)>, Stopped> {
    let Some(at) = place(fit) else { return Ok(None) };
    let before = held_out.missed(errors).filter(|before| is_much(before));
    let Some(before) = before else { return Ok(None) };
    let mut others = fit.parts.clone();
    let shape = others.remove(at).shape;
    let (displacement, [exponent, kind]) =
        if shape[2..] == BRISTLE[1..] { (0.5 * shape[0], ELEMENTS_AS_BRISTLE) } else { (2.0 * shape[0], BRISTLE) };
    let laws = [law(Cause::PreslidingFriction), &OF_ANY_EXPONENT];
    let tried = watch.each(&laws, (0.92, 0.92), super::STAGE, |law| {
        let parts = others.iter().cloned().chain(bench.parts(law, vec![vec![displacement, exponent, kind]])).collect();
        let own = bench.refine_roughly(bench.fit(parts), others.len(), OWN_STEPS);
        Some(own).filter(|own| own.squares() < ALIKE * fit.squares() && is_physical(bench, own))
    })?;
    // A formulation that is right but for a thousandth of its displacement may miss by many steps of a fine encoder, and another one by
    // a few less.
    let enough = LEAST_EXPLAINED * (mean(&before, Over::All) - NOTHING);
    let mut best: Option<(f64, Fit, Errors)> = None;
    for own in tried.into_iter().flatten() {
        let Some(its) = held_out.errors(&own)? else { continue };
        let Some(after) = held_out.missed(&its) else { continue };
        let gained: Vec<f64> = before.iter().zip(&after).map(|(before, after)| before - after).collect();
        let gain = mean(&gained, Over::All);
        let least = best.as_ref().map_or(enough, |(gain, ..)| gain + MORE * mean(&before, Over::All));
        if gain > least && strength(&gained, &before, Over::All) > SURELY {
            best = Some((gain, own, its));
        }
    }
    Ok(best.map(|(_, fit, errors)| (fit, errors)))
}
