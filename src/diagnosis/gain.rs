//! What the extended machine is worth on rows it was not fitted to.

use super::fit::{Bench, Fit};
use super::select::held_out;
use crate::machine::Axis;
use crate::plant::closed_loop::replay;
use crate::plant::observed::Observed;
use crate::plant::predict::predict_torque;
use crate::recording::Recording;

/// RMS before and after, on rows that were not fitted.
#[derive(Debug, Clone, PartialEq)]
pub struct Gain {
    /// `torque` or `force`, `position`, `table_position`.
    pub channel: &'static str,
    /// RMS of the belief's residual.
    pub before: f64,
    /// RMS of the extended machine's.
    pub after: f64,
    /// 95 % interval of before over after.
    pub ci95: [f64; 2],
}

/// The gains of an extended axis: on the hold-out as `gib predict` predicts it, else torque on held-out blocks of the same
/// recording.
#[must_use]
pub fn gains(
    axis: &Axis,
    extended: &Axis,
    holdout: Option<&Recording>,
    bench: &Bench,
    empty: &Fit,
    fit: &Fit,
) -> Vec<Gain> {
    if let Some(holdout) = holdout {
        if let Some(gains) = on_holdout(axis, extended, holdout) {
            return gains;
        }
    }
    let (before, after) = (held_out(bench, empty), held_out(bench, fit));
    let sizes: Vec<f64> = bench.frame.blocks.windows(2).map(|w| (w[1] - w[0]) as f64).collect();
    let (before_rms, after_rms, ci95) = ratio_of(&before, &after, &sizes);
    let floor = bench.floors[0];
    vec![Gain { channel: axis.drive.torque_word(), before: floor * before_rms, after: floor * after_rms, ci95 }]
}

/// Errors of one machine on a recording: torque, closed-loop position, table position; NaN where not predicted.
struct Errors {
    torque: Vec<f64>,
    position: Option<Vec<f64>>,
    table: Option<Vec<f64>>,
}

fn on_holdout(axis: &Axis, extended: &Axis, holdout: &Recording) -> Option<Vec<Gain>> {
    let observed = Observed::of(holdout, axis).ok()?;
    let (before, after) = (errors(axis, &observed)?, errors(extended, &observed)?);
    let mut gains = vec![gain(axis.drive.torque_word(), &before.torque, &after.torque)?];
    if let (Some(before), Some(after)) = (&before.position, &after.position) {
        gains.extend(gain("position", before, after));
    }
    if let (Some(before), Some(after)) = (&before.table, &after.table) {
        gains.extend(gain("table_position", before, after));
    }
    Some(gains)
}

fn errors(axis: &Axis, observed: &Observed) -> Option<Errors> {
    let prediction = predict_torque(axis, observed).ok()?;
    let less =
        |measured: &[f64], model: &[f64]| -> Vec<f64> { measured.iter().zip(model).map(|(m, p)| m - p).collect() };
    // A closed loop that cannot be replayed (no servo, no command) is no reason to withhold the torque.
    let replayed = replay(axis, observed, &prediction).ok().flatten();
    Some(Errors {
        torque: less(&observed.torque, &prediction.torque),
        position: replayed.as_ref().map(|r| less(&observed.position, &r.position)),
        table: replayed.as_ref().zip(observed.table_position.as_ref()).map(|(r, t)| less(t, &r.table_position)),
    })
}

/// RMS before and after over rows where both are known, with the interval over contiguous blocks.
fn gain(channel: &'static str, before: &[f64], after: &[f64]) -> Option<Gain> {
    let pairs: Vec<(f64, f64)> =
        before.iter().zip(after).filter(|(b, a)| b.is_finite() && a.is_finite()).map(|(b, a)| (b * b, a * a)).collect();
    if pairs.len() < 10 * BLOCKS {
        return None;
    }
    let blocks: Vec<&[(f64, f64)]> = pairs.chunks(pairs.len().div_ceil(BLOCKS)).collect();
    let sum = |pick: fn(&(f64, f64)) -> f64| -> Vec<f64> { blocks.iter().map(|b| b.iter().map(pick).sum()).collect() };
    let sizes: Vec<f64> = blocks.iter().map(|b| b.len() as f64).collect();
    let (before, after, ci95) = ratio_of(&sum(|p| p.0), &sum(|p| p.1), &sizes);
    Some(Gain { channel, before, after, ci95 })
}

/// Contiguous blocks of a hold-out.
const BLOCKS: usize = 24;

/// RMS before, RMS after, and the 95 % interval of their ratio over blocks: jackknife of ln(ratio), blocks left out in turn.
#[must_use]
pub fn ratio_of(before: &[f64], after: &[f64], sizes: &[f64]) -> (f64, f64, [f64; 2]) {
    let total = |v: &[f64]| v.iter().sum::<f64>();
    let (b, a, n) = (total(before), total(after), total(sizes));
    let log = |b: f64, a: f64| 0.5 * (b.max(1e-300) / a.max(1e-300)).ln();
    let centre = log(b, a);
    let count = before.len() as f64;
    let left_out: Vec<f64> = before.iter().zip(after).map(|(x, y)| log(b - x, a - y)).collect();
    let mean = total(&left_out) / count;
    let variance = (count - 1.0) / count * left_out.iter().map(|l| (l - mean).powi(2)).sum::<f64>();
    let half = 2.07 * variance.sqrt();
    ((b / n).sqrt(), (a / n).sqrt(), [(centre - half).exp(), (centre + half).exp()])
}
