//! How hard the flanks of a clearance meet is hardly to be seen in rows that are no faster than they swing, and the sum of
//! squares has a minimum at almost every hardness, each with a width and shares of its own. So the fit is made from soft to
//! hard, and how far those lie apart that leave about as much is a part of the uncertainty. What hardness the machine is given is
//! what predicts its torque best: an impact that is hard and comes a row too late errs twice.

use super::fit::{Bench, Fit};
use super::gain::HeldOut;
use super::judge::{Excess, LITTLE_LEFT};
use super::progress::{Stopped, Watch};
use super::select::{Selection, is_physical};
use crate::machine::Cause;

/// How hard flanks meet where a fit begins, Hz.
const FROM_SOFT_TO_HARD: [f64; 5] = [200.0, 300.0, 450.0, 650.0, 900.0];
/// Most steps of a fit.
const STEPS: usize = 5;
/// Squares over the least up to which a fit counts as alike.
const ALIKE: f64 = 1.1;

/// The selection with the best of these fits and the contact that predicts best, and the fits that are about as good.
///
/// # Errors
/// [`Stopped`] when the watch's caller said so.
pub fn settled(bench: &Bench, held_out: &HeldOut, found: Selection, watch: &Watch) -> Result<Selection, Stopped> {
    let Some(at) = found.fit.parts.iter().position(|part| part.law.cause == Cause::Backlash) else { return Ok(found) };
    let with_contact = |fit: &Fit, hz: f64| {
        let mut parts = fit.parts.clone();
        let mut shape = parts[at].shape.clone();
        if let Some(contact_hz) = shape.last_mut() {
            *contact_hz = hz;
        }
        parts[at] = bench.parts_like(&parts[at], vec![shape]).swap_remove(0);
        bench.fit(parts)
    };
    let stage = "letting the flanks meet softer and harder";
    let mut fits = watch.each(&FROM_SOFT_TO_HARD, (0.9, 0.91), stage, |&hz| {
        bench.refine_roughly(with_contact(&found.fit, hz), 0, STEPS)
    })?;
    fits.retain(|fit| is_physical(bench, fit));
    fits.push(found.fit);
    fits.sort_by(|a, b| a.squares().total_cmp(&b.squares()));
    let best = fits.remove(0);
    fits.retain(|fit| fit.squares() <= ALIKE * best.squares());
    // Where the best leaves little more than noise, so must what is taken in its place.
    let rattles = Excess::of(bench, &best, &best).largest() > LITTLE_LEFT;
    let itself_and_others: Vec<Option<f64>> = std::iter::once(None).chain(FROM_SOFT_TO_HARD.map(Some)).collect();
    let predicted = watch.each(&itself_and_others, (0.91, 0.92), stage, |hz| {
        let fit = hz.map_or_else(|| best.clone(), |hz| with_contact(&best, hz));
        let may_be_taken = hz.is_none() || rattles || fit.squares() <= ALIKE * best.squares();
        (if may_be_taken { held_out.torque_error(&fit) } else { None }, fit)
    })?;
    // Where a scale tells the table's motion, all predict alike, and the fit stays as it is.
    let error = |(error, _): &(Option<f64>, Fit)| error.unwrap_or(f64::INFINITY);
    let better = predicted.into_iter().reduce(|best, next| if error(&next) < error(&best) { next } else { best });
    let fit = better.map_or(best, |(_, fit)| fit);
    Ok(Selection { fit, alike: fits, ..found })
}
