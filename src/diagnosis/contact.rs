//! How hard the flanks of a clearance meet is hardly to be seen in rows that are no faster than they swing, and the sum of
//! squares has a minimum at almost every hardness, each with a width and shares of its own. So the fit is made from hard to
//! soft, and how far those lie apart that leave about as much is a part of the uncertainty. What hardness the machine is given is
//! what predicts its torque best: an impact that is hard and comes a row too late errs twice.

use super::causes::loose_spring;
use super::fit::{Bench, Fit, Part};
use super::gain::HeldOut;
use super::judge::{Excess, LITTLE_LEFT};
use super::progress::{Stopped, Watch};
use super::select::{Selection, is_physical};
use crate::machine::Cause;

/// How hard flanks meet where a fit begins, Hz; what takes longest is begun first.
const FROM_HARD_TO_SOFT: [f64; 5] = [900.0, 650.0, 450.0, 300.0, 200.0];
/// Most steps of a fit.
const STEPS: usize = 5;
/// Squares over the least up to which a fit counts as alike.
const ALIKE: f64 = 1.1;
/// The same of the table's alone, twice the amplitude, where the torque leaves much and the table is known to so many floors.
const OF_TABLE: f64 = 4.0;
const KNOWN: f64 = 1.0 + LITTLE_LEFT;

/// The selection with the best of these fits and the contact that predicts best, and the fits that are about as good.
///
/// # Errors
/// [`Stopped`] when the watch's caller said so.
pub fn settled(bench: &Bench, held_out: &HeldOut, found: Selection, watch: &Watch) -> Result<Selection, Stopped> {
    let hard = |part: &Part| part.law.cause == Cause::Backlash && !loose_spring::is(part);
    let Some(at) = found.fit.parts.iter().position(hard) else { return Ok(found) };
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
    let mut fits = watch.each(&FROM_HARD_TO_SOFT, (0.9, 0.91), stage, |&hz| {
        bench.refine_roughly(with_contact(&found.fit, hz), 0, STEPS)
    })?;
    fits.retain(|fit| is_physical(bench, fit));
    fits.push(found.fit);
    fits.sort_by(|a, b| a.squares().total_cmp(&b.squares()));
    let best = fits.remove(0);
    fits.retain(|fit| fit.squares() <= ALIKE * best.squares());
    // Where the best leaves little more than noise, so must what is taken in its place. Nor may a table that is
    // known be lost for the sake of the torque.
    let rattles = Excess::of(bench, &best, &best).largest() > LITTLE_LEFT;
    let of_table = |fit: &Fit| fit.channels().get(1).copied().unwrap_or(0.0);
    let is_alike = |fit: &Fit| match rattles {
        true => of_table(&best) > KNOWN || of_table(fit) <= OF_TABLE * of_table(&best),
        false => fit.squares() <= ALIKE * best.squares(),
    };
    let mut taken = watch.each(&FROM_HARD_TO_SOFT, (0.91, 0.92), stage, |&hz| with_contact(&best, hz))?;
    taken.retain(is_alike);
    taken.push(best);
    let errors = if taken.len() > 1 { held_out.torque_errors(&taken, stage)? } else { vec![None] };
    let errors: Vec<f64> = errors.into_iter().map(|error| error.unwrap_or(f64::INFINITY)).collect();
    let least = (0..taken.len()).rev().min_by(|&a, &b| errors[a].total_cmp(&errors[b])).unwrap_or(0);
    Ok(Selection { fit: taken.swap_remove(least), alike: fits, ..found })
}
