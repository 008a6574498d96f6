//! The noise floor of what is judged.

use super::{Frame, SCALES_HOLD, norm};
use crate::analysis::statistics::median;
use rayon::prelude::*;

impl Frame<'_> {
    /// What white noise of the torque of deviation 1 in each row is at the judged rows.
    #[must_use]
    pub fn of_white_noise(&self) -> f64 {
        norm(&self.torque_kernel)
    }

    /// Noise floor of a filtered column at the judged rows, in its unit: what white noise through the filter would be,
    /// judged by second differences, in which slow structure is gone, and what the encoder's grid makes beyond that. `averaged`
    /// says that the column is torque, which went through the three-point mean as well.
    #[must_use]
    pub fn floor(&self, values: &[f64], averaged: bool) -> f64 {
        let kernel = if averaged { &self.torque_kernel } else { &self.low_pass_kernel };
        let product = |lag: usize| kernel.iter().zip(kernel.iter().skip(lag)).map(|(a, b)| a * b).sum::<f64>();
        let correlations: Vec<f64> = (0..kernel.len()).map(|lag| product(lag) / norm(kernel).powi(2)).collect();
        let correlation = |lag: usize| correlations.get(lag).copied().unwrap_or(0.0);
        let at_spacing = |m: usize| {
            let second = |k: usize| {
                let [before, after] = [self.kept[k] - self.kept[k - m], self.kept[k + m] - self.kept[k]];
                if before + after > 2 * m * self.apart[0] {
                    return None;
                }
                // A row beside the line between two others.
                let near = after as f64 / (before + after) as f64;
                let far = 1.0 - near;
                let [to_near, to_far, through] = [before, after, before + after].map(correlation);
                let own = 1.0 + near * near + far * far;
                let gain = own - 2.0 * (near * to_near + far * to_far) + 2.0 * near * far * through;
                Some((values[k] - near * values[k - m] - far * values[k + m]).abs() / gain.max(1e-6).sqrt())
            };
            let seconds: Vec<f64> = (m..values.len().saturating_sub(m)).filter_map(second).collect();
            median(&seconds).map(|median| 1.482_602 * median)
        };
        // Noise of the encoder's grid alternates from row to row and looks large at the least spacing, structure at wide
        // ones: the smallest estimate is the one least spoilt.
        let estimates = [1, 2, 3, 5, 8].into_par_iter().filter_map(at_spacing).filter(|e| *e > 0.0);
        let noise = estimates.reduce(|| f64::INFINITY, f64::min).clamp(1e-12, 1e12);
        if averaged {
            return noise.hypot(self.unseen);
        }
        noise.max(self.grids_in_table).max(SCALES_HOLD * (self.stroke.1 - self.stroke.0))
    }
}
