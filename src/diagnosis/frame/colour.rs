//! Coloured noise: a current that was filtered before it was recorded has noise that goes on for some rows.
//!
//! Noise of the first order, x(t) = ρ·x(t − 1) + white, goes through the low-pass as the sum over all pairs of its weights tells. Its
//! differences over a few judged rows then are to all of it as that ρ has it, and nothing of it is left over longer times. What is smooth
//! (a law that is not in the model) differs by the square of the distance, and goes on: no ρ has both.

use super::Frame;

/// Judged rows over which differences are looked at.
const APART: [usize; 6] = [1, 2, 3, 5, 8, 13];
/// Correlations from row to row that are tried: this many, evenly up to the last.
const TRIED: usize = 20;
const MOST: f64 = 0.95;
/// By what share mean squares of differences may be off besides what chance makes, as deviations of it.
const OFF: f64 = 0.1;
const SURE: f64 = 2.0;
/// Independent rows below which what is slow cannot be told from what wanders.
const FEWEST: f64 = 120.0;
/// Fewest pairs of rows that say anything.
const LEAST_PAIRS: f64 = 50.0;
/// How far correlations are added up, in judged rows.
const FAR: usize = 200;

impl Frame<'_> {
    /// How many of the judged rows are independent where these values of theirs are noise of the first order; `None` where they are not.
    #[must_use]
    pub fn independent_rows(&self, values: &[f64]) -> Option<f64> {
        let count = values.len() as f64;
        let all = values.iter().map(|value| value * value).sum::<f64>() / count;
        if !(all > 0.0) {
            return None;
        }
        // Of pairs so far apart in judged rows: the sum of squared differences, and how many are so many rows apart.
        let of_pairs = |m: usize| {
            let mut pairs = (0.0, vec![0.0; 2 * m * self.apart[0] + 1]);
            for (kept, values) in self.kept.windows(m + 1).zip(values.windows(m + 1)) {
                if let Some(count) = pairs.1.get_mut(kept[m] - kept[0]) {
                    *count += 1.0;
                    pairs.0 += (values[m] - values[0]).powi(2);
                }
            }
            pairs
        };
        let mut distances: Vec<(f64, Vec<f64>)> = APART.into_iter().map(of_pairs).collect();
        distances.retain(|(_, counts)| counts.iter().sum::<f64>() >= LEAST_PAIRS);
        let longest = distances.iter().map(|(_, counts)| counts.len()).max()?;
        let tried = (0..TRIED).map(|i| MOST * i as f64 / (TRIED - 1) as f64);
        let of = |rho: f64| {
            let left = self.correlations(rho, longest.max(FAR * self.apart[0]));
            let together: f64 = (1..=FAR).map(|m| left[m * self.apart[0]]).sum();
            let independent = count / (1.0 + 2.0 * together.max(0.0));
            let off = |(measured, counts): &(f64, Vec<f64>)| {
                let told = counts.iter().zip(&left).map(|(count, left)| 2.0 * all * count * (1.0 - left)).sum::<f64>();
                (measured / told.max(1e-300)).ln().abs()
            };
            (distances.iter().map(off).fold(0.0, f64::max), independent)
        };
        let (off, independent) = tried.map(of).min_by(|a, b| a.0.total_cmp(&b.0))?;
        let many = independent > FEWEST;
        (many && off < OFF + SURE * (2.0 / independent).sqrt()).then_some(independent)
    }

    /// Correlation over so many rows and fewer of noise of the first order as it is on the judged rows.
    fn correlations(&self, rho: f64, longest: usize) -> Vec<f64> {
        let kernel = &self.torque_kernel;
        let powers: Vec<f64> = (0..2 * kernel.len()).map(|rows| rho.powi(rows as i32)).collect();
        let product = |lag: usize| kernel.iter().zip(kernel.iter().skip(lag)).map(|(a, b)| a * b).sum::<f64>();
        let own: Vec<f64> = (0..kernel.len()).map(product).collect();
        let at = |rows: usize| -> f64 {
            let earlier = |(lag, own): (usize, &f64)| own * (powers[rows + lag] + powers[rows.abs_diff(lag)]);
            own[0] * powers[rows] + own.iter().enumerate().skip(1).map(earlier).sum::<f64>()
        };
        let none = at(0).max(1e-300);
        let mut left: Vec<f64> = (0..kernel.len()).map(|rows| at(rows) / none).collect();
        // Beyond the filter only what the noise itself keeps goes on.
        let last = left[kernel.len() - 1];
        left.extend((1..).take((longest + 1).saturating_sub(kernel.len())).map(|rows| last * rho.powi(rows)));
        left
    }
}
