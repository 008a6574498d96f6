//! The noise floor of what is judged.

use super::{Frame, SCALES_HOLD, norm};
use crate::analysis::statistics::median;

/// Groups of rows by weight, each with a noise of its own.
const GROUPS: usize = 4;

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
        let groups = self.groups_by_weight();
        let at_spacing = |m: usize| {
            let gain = (6.0 - 8.0 * correlation(m * stride) + 2.0 * correlation(2 * m * stride)).max(1e-6).sqrt();
            let mut seconds = [(); GROUPS].map(|()| Vec::new());
            for k in m..values.len().saturating_sub(m) {
                if self.kept[k + m] - self.kept[k - m] == 2 * m * stride {
                    seconds[groups[k]].push((values[k - m] - 2.0 * values[k] + values[k + m]).abs());
                }
            }
            let count = seconds.iter().map(Vec::len).sum::<usize>() as f64;
            let square = |own: &Vec<f64>| Some((own.len() as f64 / count, median(own)?.powi(2)));
            let squares: Vec<(f64, f64)> = seconds.iter().filter_map(square).collect();
            // A torque that stands still on its grid in most rows of a group says nothing of its noise there.
            let square = if squares.iter().any(|(_, square)| *square == 0.0) {
                median(&seconds.concat())?.powi(2)
            } else {
                squares.iter().map(|(share, square)| share * square).sum()
            };
            (count > 0.0).then(|| 1.482_602 * f64::sqrt(square) / gain)
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

    /// To which of some groups, as many rows in each, a judged row belongs by its weight: weighed rows are louder the more they count, where
    /// the weights mind errors that are not there.
    fn groups_by_weight(&self) -> Vec<usize> {
        let mut order: Vec<usize> = (0..self.kept.len()).collect();
        order.sort_by(|&a, &b| self.weights[a].total_cmp(&self.weights[b]));
        let mut groups = vec![0; order.len()];
        order.iter().enumerate().for_each(|(place, &row)| groups[row] = place * GROUPS / order.len());
        groups
    }
}
