//! Coloured noise: a current that was filtered before it was recorded has noise that goes on for some rows.
//!
//! Noise of the first order, x(t) = ρ·x(t − 1) + white, goes through the low-pass as the sum over all pairs of its weights tells. Its
//! differences over a few judged rows then are to all of it as that ρ has it, and nothing of it is left over longer times. What is smooth
//! (a law that is not in the model) differs by the square of the distance, and goes on: no ρ has both.

use super::{Frame, norm};

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
        let mut distances = Vec::new();
        for m in APART {
            let mut pairs: Vec<(usize, f64)> = Vec::new();
            for k in 0..values.len().saturating_sub(m) {
                let rows = self.kept[k + m] - self.kept[k];
                if rows <= 2 * m * self.apart[0] {
                    pairs.push((rows, (values[k + m] - values[k]).powi(2)));
                }
            }
            if pairs.len() >= LEAST_PAIRS {
                distances.push(pairs);
            }
        }
        let longest = distances.iter().flatten().map(|(rows, _)| *rows).max()?;
        let tried = (0..TRIED).map(|i| MOST * i as f64 / (TRIED - 1) as f64);
        let of = |rho: f64| {
            let left = self.correlations(rho, longest.max(FAR * self.apart[0]));
            let together: f64 = (1..=FAR).map(|m| left[m * self.apart[0]]).sum();
            let independent = count / (1.0 + 2.0 * together.max(0.0));
            let off = |pairs: &Vec<(usize, f64)>| {
                let measured = pairs.iter().map(|(_, square)| square).sum::<f64>();
                let told = pairs.iter().map(|(rows, _)| 2.0 * all * (1.0 - left[*rows])).sum::<f64>();
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
        let product = |lag: usize| kernel.iter().zip(kernel.iter().skip(lag)).map(|(a, b)| a * b).sum::<f64>();
        let own: Vec<f64> = (0..kernel.len()).map(product).collect();
        let at = |rows: usize| -> f64 {
            let power = |lag: i64| rho.powi((rows as i64 + lag).unsigned_abs().min(4000) as i32);
            let both = |(lag, own): (usize, &f64)| {
                own * (power(lag as i64) + if lag > 0 { power(-(lag as i64)) } else { 0.0 })
            };
            own.iter().enumerate().map(both).sum()
        };
        let none = at(0).max(1e-300 * norm(kernel));
        (0..=longest).map(|rows| at(rows) / none).collect()
    }
}

/// Fewest pairs of rows that say anything.
const LEAST_PAIRS: usize = 50;
