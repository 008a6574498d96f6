//! What the extended machine is worth on rows it was not fitted to.

use super::fit::{Bench, Fit};
use super::select::held_out;
use crate::machine::Axis;
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

/// The gains of an extended axis: on the hold-out, else on held-out blocks.
#[must_use]
pub fn gains(
    axis: &Axis,
    _extended: &Axis,
    _recording: &Recording,
    _holdout: Option<&Recording>,
    bench: &Bench,
    empty: &Fit,
    fit: &Fit,
) -> Vec<Gain> {
    let (before, after) = (held_out(bench, empty), held_out(bench, fit));
    let sizes: Vec<f64> = bench.frame.blocks.windows(2).map(|w| (w[1] - w[0]) as f64).collect();
    let (before_rms, after_rms, ci95) = ratio_of(&before, &after, &sizes);
    let floor = bench.floors[0];
    vec![Gain { channel: axis.drive.torque_word(), before: floor * before_rms, after: floor * after_rms, ci95 }]
}

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
