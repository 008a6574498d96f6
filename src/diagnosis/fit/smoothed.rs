//! The same equations under a running sum over time: what acts in instants counts by its impulse, not by the instant.
//!
//! What is left are Σ rows / √(how many), over all judged rows within half the time to either side, so that white noise keeps its
//! size. An impact that a law puts some milliseconds off its place is then a small error where it was two large ones, and the
//! sum of squares falls towards the right parameters from afar (graduated optimisation, Blake and Zisserman 1987).

use super::beside::orthonormalised;
use super::{Bench, Fit, Part, dot, project};
use rayon::prelude::*;
use std::ops::Range;

/// Shares of a step that are tried.
const SHARES: [f64; 8] = [1.0, 0.7, 0.5, 0.35, 0.2, 0.1, 0.05, 0.02];
/// Share of the squares that a move must take off for another as far to be made.
const LEAST_STEP: f64 = 0.01;

impl Bench<'_, '_> {
    /// These equations, the judged rows within this time, s, summed to one, four times in it.
    #[must_use]
    pub fn smoothed(&self, seconds: f64) -> Self {
        let kept = &self.frame.kept;
        let reach = (0.5 * seconds / self.frame.columns.period_s) as usize;
        let (mut first, mut end) = (0, 0);
        let mut windows: Vec<Range<usize>> = Vec::new();
        let mut next = 0;
        for &row in kept {
            while kept[first] + reach < row {
                first += 1;
            }
            while end < kept.len() && kept[end] <= row + reach {
                end += 1;
            }
            if row >= next {
                windows.push(first..end);
                next = row + (reach / 2).max(1);
            }
        }
        let sum = |column: &[f64]| summed(column.to_vec(), kept.len(), &windows);
        let (measured, doubt) = (sum(&self.measured), sum(&self.doubt));
        let free = orthonormalised(self.free.iter().map(|column| unit(sum(column))).collect());
        let (certain, resistance) = (self.certain.clone(), self.resistance.clone());
        Self { measured, doubt, certain, free, resistance, rows: windows.len(), windows, ..*self }
    }

    /// Whether several rows are summed to one.
    #[must_use]
    pub fn is_of_means(&self) -> bool {
        !self.windows.is_empty()
    }

    /// A set of causes fitted on other equations of the same rows, on these.
    #[must_use]
    pub fn again(&self, set: &Fit) -> Fit {
        let sum = |column: &[f64]| summed(column.to_vec(), self.frame.kept.len(), &self.windows);
        self.fit(set.parts.iter().map(|part| part.on_others(sum)).collect())
    }

    /// What is left when a part without coefficients joins a set.
    #[must_use]
    pub fn left_beside(&self, set: &Fit, part: &Part) -> Vec<f64> {
        let mut left = set.residual.clone();
        if let Some(fixed) = &part.fixed {
            left.iter_mut().zip(fixed.iter()).for_each(|(left, f)| *left -= f);
        }
        for direction in &set.basis {
            let along = dot(direction, &left);
            left.iter_mut().zip(direction).for_each(|(left, d)| *left -= along * d);
        }
        left
    }

    /// Moves the non-linear parameters of a part without coefficients downhill beside a set: to either side of each by so many
    /// steps of its scale, or along what these suggest together, whichever is best; by half as many where none is.
    #[must_use]
    pub fn approached(&self, set: &Fit, mut part: Part, mut steps: f64, most: usize) -> Part {
        let mut left = self.left_beside(set, &part);
        let least = 0.15 * steps;
        for _ in 0..most {
            let sides = self.sides(&part, steps);
            let slopes: Vec<_> = sides.iter().filter_map(|side| self.slope(0, &[], side)).collect();
            let columns: Vec<&[f64]> = slopes.iter().map(|s| s.column.as_slice()).collect();
            let together = project(&columns, &set.basis, &left);
            let along = |share: &f64| {
                let mut shape = part.shape.clone();
                for (slope, step) in slopes.iter().zip(&together) {
                    shape[slope.index] = part.law.scales[slope.index].moved(shape[slope.index], share * step);
                }
                shape
            };
            let tried = self.parts_like(&part, SHARES.iter().map(along).collect());
            let tried = sides.into_iter().flat_map(|side| [side.up, side.down]).chain(tried);
            let rated = |part: Part| {
                let left = self.left_beside(set, &part);
                (dot(&left, &left), left, part)
            };
            let tried: Vec<_> = tried.collect::<Vec<_>>().into_par_iter().map(rated).collect();
            let Some((squares, there, best)) = tried.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)) else { break };
            let gained = 1.0 - squares / dot(&left, &left);
            if gained > 0.0 {
                (left, part) = (there, best);
            }
            if gained < LEAST_STEP {
                steps *= 0.5;
            }
            if steps < least {
                break;
            }
        }
        part
    }
}

/// Σ rows / √(how many) over each row's window, torque and table alike; as it is where there are no windows.
pub(super) fn summed(column: Vec<f64>, rows: usize, windows: &[Range<usize>]) -> Vec<f64> {
    if windows.is_empty() {
        return column;
    }
    let (torque, table) = column.split_at(rows.min(column.len()));
    let channel = |values: &[f64]| {
        let mut before = vec![0.0; values.len() + 1];
        for (i, value) in values.iter().enumerate() {
            before[i + 1] = before[i] + value;
        }
        let mean = |w: &Range<usize>| (before[w.end] - before[w.start]) / (w.len().max(1) as f64).sqrt();
        if values.is_empty() { Vec::new() } else { windows.iter().map(mean).collect::<Vec<f64>>() }
    };
    let mut out = channel(torque);
    out.extend(channel(table));
    out
}

/// A column of unit length.
pub(super) fn unit(mut column: Vec<f64>) -> Vec<f64> {
    let length = dot(&column, &column).sqrt().max(1e-300);
    column.iter_mut().for_each(|c| *c /= length);
    column
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_keeps_its_size_and_a_misplaced_impact_nearly_vanishes() {
        let rows = 20_000;
        let windows: Vec<Range<usize>> = (0..rows).map(|i: usize| i.saturating_sub(20)..(i + 21).min(rows)).collect();
        // A linear congruence (Knuth) is noise enough.
        let mut state = 1u64;
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        let noise: Vec<f64> = (0..rows).map(|_| uniform()).collect();
        let squares = |column: &[f64]| dot(column, column);
        let kept = squares(&summed(noise.clone(), rows, &windows)) / squares(&noise);
        assert!((0.85..1.15).contains(&kept), "{kept}");
        // The same impact in two places, three rows apart: twice its squares as it is, a seventh of them in sums.
        let mut apart = vec![0.0; rows];
        (apart[10_000], apart[10_003]) = (1.0, -1.0);
        let left = squares(&summed(apart, rows, &windows));
        assert!((0.14..0.15).contains(&left), "{left}");
    }

    #[test]
    fn torque_and_table_are_summed_alike_and_apart() {
        let windows = [0..2, 1..3];
        let sums = summed(vec![1.0, 2.0, 3.0, 10.0, 20.0, 30.0], 3, &windows);
        let whole: Vec<f64> = sums.iter().map(|sum| (sum * 2f64.sqrt()).round()).collect();
        assert_eq!(whole, [3.0, 5.0, 30.0, 50.0]);
        assert_eq!(summed(vec![1.0, 2.0], 2, &[]), [1.0, 2.0]);
    }
}
