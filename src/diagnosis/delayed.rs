//! Whether a torque column is late. A servo answers the noise of its encoder, so that the torque and the acceleration that is read off the
//! same encoder share what is fast and none of the machine's, and the torque moved up or down a little goes better with it. What moves the
//! axis is slow, and late by the same time through a low-pass of four times the width, which leaves hardly anything of that noise.

use super::fit::{Bench, Fit};
use super::frame::Frame;
use super::known::Known;
use super::quiet::wider;
use super::uncertainty;
use crate::machine::{Axis, Cause};

/// Deviations between what the two say from which on they contradict each other.
const APART: f64 = 3.0;
/// Share of a delay below which the wider one does not bear it out.
const BORNE_OUT: f64 = 0.5;
/// Most steps of a fit, of the delay alone and of all that stays.
const STEPS: usize = 4;
/// Rows that the wider low-pass must keep: one in so many.
const FEWER_ROWS: usize = 16;

/// A set of causes without a delay that is none; `None` where there is no such. `kept` is what of the axis is believed.
#[must_use]
pub fn left_out(bench: &Bench, kept: &Axis, fit: &Fit) -> Option<Fit> {
    let at = fit.parts.iter().position(|part| part.law.cause == Cause::DeadTime).filter(|_| fit.table().is_none())?;
    let frame = bench.frame;
    let width = wider(frame);
    let wide = Frame::new(frame.axis, frame.columns, Some(2 * width + 1));
    if wide.kept.len() < frame.kept.len() / FEWER_ROWS {
        return None;
    }
    let on_wide = Bench::new(&wide, &Known::of(kept, &wide));
    let order = (0..fit.parts.len()).filter(|i| *i != at).chain([at]);
    let parts = order.flat_map(|i| on_wide.parts(fit.parts[i].law, vec![fit.parts[i].shape.clone()])).collect();
    let there = on_wide.refine(on_wide.fit(parts), fit.parts.len() - 1, STEPS);
    let delay = |bench: &Bench, fit: &Fit, at: usize| {
        let (effect, deviations) = uncertainty::effects(bench, fit, None).swap_remove(at)?;
        Some((*effect.values().first()?, *deviations.first()?))
    };
    let (here, sure) = delay(bench, fit, at)?;
    let (far, unsure) = delay(&on_wide, &there, fit.parts.len() - 1)?;
    let contradicts = (here - far).abs() > APART * sure.hypot(unsure) && (far / here) < BORNE_OUT;
    contradicts.then(|| bench.refine(bench.without(fit, at), 0, STEPS))
}
