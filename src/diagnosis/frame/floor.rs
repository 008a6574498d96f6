//! The noise floor of what is judged.

use super::{Frame, SCALES_HOLD, norm};
use crate::analysis::statistics::median;

impl Frame<'_> {
    /// Noise floor of a filtered column at the judged rows, in its unit: what white noise through the filter would be,
    /// judged by second differences, in which slow structure is gone, and what the encoder's grid makes beyond that. `averaged`
    /// says that the column is torque, which went through the three-point mean as well.
    #[must_use]
    pub fn floor(&self, values: &[f64], averaged: bool) -> f64 {
        let stride = self.kept.windows(2).map(|w| w[1] - w[0]).min().unwrap_or(1);
        let kernel = if averaged { &self.torque_kernel } else { &self.low_pass_kernel };
        let correlation = |lag: usize| {
            kernel.iter().zip(kernel.iter().skip(lag)).map(|(a, b)| a * b).sum::<f64>() / norm(kernel).powi(2)
        };
        let at_spacing = |m: usize| {
            let gain = (6.0 - 8.0 * correlation(m * stride) + 2.0 * correlation(2 * m * stride)).max(1e-6).sqrt();
            let seconds: Vec<f64> = (m..values.len().saturating_sub(m))
                .filter(|&k| self.kept[k + m] - self.kept[k - m] == 2 * m * stride)
                .map(|k| (values[k - m] - 2.0 * values[k] + values[k + m]).abs())
                .collect();
            median(&seconds).map(|median| 1.482_602 * median / gain)
        };
        // Noise of the encoder's grid alternates from row to row and looks large at the least spacing, structure at wide
        // ones: the smallest estimate is the one least spoilt.
        let estimates = [1, 2, 3, 5, 8].into_iter().filter_map(at_spacing).filter(|e| *e > 0.0);
        let noise = estimates.fold(f64::INFINITY, f64::min).clamp(1e-12, 1e12);
        if averaged {
            return noise.hypot(self.unseen);
        }
        noise.max(self.grids_in_table).max(SCALES_HOLD * (self.stroke.1 - self.stroke.0))
    }
}
