//! What a torque column on a coarse grid does not tell.
//!
//! Where noise does not carry a reading over the steps of its grid, it stands, or goes to and fro between two steps, while the
//! torque is anywhere within them, and a mean of such readings is no nearer: off by anything up to half a step, evenly. Second
//! differences see nothing of it, and over speed or along the stroke it looks like a law. Where the torque passes step after step,
//! the errors of the rows within a filter have nothing in common and average out. Noise σ on a grid q takes e^(−2π²·σ²/q²) off the
//! error of a mean (Widrow and Kollár 2008), and on steps that stand anywhere 2σ/(√π·q) of neighbouring readings are apart by it.

use super::Frame;
use std::collections::HashMap;
use std::f64::consts::PI;

/// Variance, in units of its mean squared, of the square of an error that is spread evenly.
const SPREAD_OF_SQUARE: f64 = 0.8;
/// How many deviations above what it is on average the mean square of few such errors is allowed for.
const SURELY: f64 = 2.0;

/// How the readings about a row go over the steps of their grid.
struct Steps {
    /// Share of the variance of a reading's error that the filter leaves beyond what it leaves of white noise.
    left: f64,
    /// Share of neighbouring readings that are a step apart by noise.
    apart: f64,
}

impl Frame<'_> {
    /// By how much the torque may be off at each judged row because its grid is coarse, drive's own unit: a standard deviation; zeros
    /// where it is not. A recording of few speeds stands on few steps, whose errors may all be large.
    #[must_use]
    pub fn coarse_torque(&self) -> Vec<f64> {
        let (step, torque) = (self.columns.torque_step, &self.columns.torque);
        if !(step > 0.0) {
            return vec![0.0; self.kept.len()];
        }
        let rows: Vec<Steps> = self.kept.iter().map(|&row| self.steps(row, step)).collect();
        let all = rows.iter().map(|row| row.left).sum::<f64>().max(1e-300);
        let mut shares: HashMap<i64, f64> = HashMap::new();
        for (&row, steps) in self.kept.iter().zip(&rows) {
            *shares.entry((torque[row] / step).round() as i64).or_default() += steps.left / all;
        }
        let one_over_steps: f64 = shares.values().map(|share| share * share).sum();
        let noise = 0.5 * PI.sqrt() * rows.iter().map(|row| row.apart).sum::<f64>() / rows.len().max(1) as f64;
        let left_by_noise = (-4.0 * (PI * noise).powi(2)).exp();
        let square = step * step / 12.0 * left_by_noise * (1.0 + SURELY * (SPREAD_OF_SQUARE * one_over_steps).sqrt());
        rows.iter().map(|row| (square * row.left).sqrt()).collect()
    }

    fn steps(&self, row: usize, step: f64) -> Steps {
        let kernel = &self.torque_kernel;
        let window =
            row.checked_sub(kernel.len() / 2).and_then(|from| self.columns.torque.get(from..from + kernel.len()));
        let window = window.unwrap_or_default();
        // Readings that have stayed within one step are off together.
        let (mut left, mut together, mut low, mut high) = (0.0, 0.0, f64::INFINITY, f64::NEG_INFINITY);
        for (&reading, weight) in window.iter().zip(kernel) {
            (low, high) = (low.min(reading), high.max(reading));
            if high - low > 1.5 * step {
                (together, low, high) = (0.0, reading, reading);
            }
            // (s + w)² − s² − w² of a sum s that a weight w joins.
            left += 2.0 * together * weight;
            together += weight;
        }
        // What goes up and comes down again is noise. Means of so many readings differ by as much less.
        let (mut up, mut down) = (0.0, 0.0);
        for apart in window.windows(2).map(|pair| (pair[1] - pair[0]) / step).filter(|apart| apart.abs() < 1.5) {
            *if apart > 0.0 { &mut up } else { &mut down } += apart * apart;
        }
        let apart = 2.0 * f64::min(up, down) * self.columns.rows_in_one() / window.len().max(1) as f64;
        Steps { left: left.max(0.0), apart }
    }
}
