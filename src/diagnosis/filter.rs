//! The one low-pass through which both sides of the torque balance go.
//!
//! A product of three moving means of `width` rows each (a quadratic B-spline, close to a Gauss curve) has no phase and a
//! short support, so that what happens at one reversal does not leak far. Measured torque and every regressor are filtered
//! alike; a linear model is then as true of the filtered columns as of the raw ones (regressor filtering, e.g. Gautier,
//! *Dynamic identification of robots with power model*, 1997).

use std::ops::Range;

/// A low-pass of odd width over stretches of equidistant rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LowPass {
    /// Rows of each of the three moving means, odd.
    pub width: usize,
}

impl LowPass {
    /// Of the least width at which the noise of second differences, seen through the inertia, is no louder than the torque's own: a
    /// wider filter would be quieter and hide what is fast, a narrower one would bias the inertia.
    #[must_use]
    pub fn fitting(bend_noise: f64, torque_noise: f64) -> Self {
        let quiet = |filter: &Self| {
            let kernel = filter.kernel();
            bend_noise * norm(&convolve(&kernel, &[1.0, -2.0, 1.0])) <= torque_noise * norm(&kernel)
        };
        (1..40).map(|half| Self { width: 2 * half + 1 }).find(quiet).unwrap_or(Self { width: 81 })
    }

    /// Rows on each side that a filtered row depends on.
    #[must_use]
    pub fn reach(self) -> usize {
        3 * (self.width / 2)
    }

    /// Filters each stretch by itself; beyond its ends the end values are held.
    #[must_use]
    pub fn run(self, values: &[f64], stretches: &[Range<usize>]) -> Vec<f64> {
        let mut out = values.to_vec();
        let mut scratch = Vec::new();
        for stretch in stretches {
            for _ in 0..3 {
                mean(&mut out[stretch.clone()], self.width, &mut scratch);
            }
        }
        out
    }

    /// The weights of a filtered row, the middle one at index [`LowPass::reach`].
    #[must_use]
    pub fn kernel(self) -> Vec<f64> {
        let mut kernel = vec![1.0];
        for _ in 0..3 {
            kernel = convolve(&kernel, &vec![1.0 / self.width as f64; self.width]);
        }
        kernel
    }
}

/// Moving mean of odd width in place.
fn mean(values: &mut [f64], width: usize, scratch: &mut Vec<f64>) {
    let (n, half) = (values.len(), width / 2);
    if half == 0 || n == 0 {
        return;
    }
    scratch.clear();
    scratch.extend_from_slice(values);
    let (first, last) = (scratch[0], scratch[n - 1]);
    let at = |i: isize| if i < 0 { first } else { scratch.get(i as usize).copied().unwrap_or(last) };
    // Summed about the first value, so that a long sum of a far position loses no digits.
    let mut sum: f64 = (-(half as isize)..=half as isize).map(|k| at(k) - first).sum();
    for (i, value) in values.iter_mut().enumerate() {
        *value = first + sum / width as f64;
        let i = i as isize;
        sum += at(i + half as isize + 1) - at(i - half as isize);
    }
}

/// A weighted mean of three rows inside each stretch; its end rows stay as they are.
#[must_use]
pub fn of_three(values: &[f64], weights: [f64; 3], stretches: &[Range<usize>]) -> Vec<f64> {
    let mut out = values.to_vec();
    for stretch in stretches {
        for i in stretch.start + 1..stretch.end.saturating_sub(1) {
            out[i] = weights[0] * values[i - 1] + weights[1] * values[i] + weights[2] * values[i + 1];
        }
    }
    out
}

/// Full discrete convolution.
#[must_use]
pub fn convolve(a: &[f64], b: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; a.len() + b.len() - 1];
    for (i, x) in a.iter().enumerate() {
        for (j, y) in b.iter().enumerate() {
            out[i + j] += x * y;
        }
    }
    out
}

/// Euclidean norm of a convolution kernel: by how much it scales the deviation of white noise.
#[must_use]
pub fn norm(kernel: &[f64]) -> f64 {
    kernel.iter().map(|w| w * w).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_running_sum_is_the_convolution_and_keeps_the_mean_of_a_line() {
        let low_pass = LowPass { width: 5 };
        let values: Vec<f64> = (0..60).map(|i| 1e3 + f64::from(i * i % 17)).collect();
        let filtered = low_pass.run(&values, std::slice::from_ref(&(0..60)));
        let (kernel, reach) = (low_pass.kernel(), low_pass.reach());
        for i in reach..60 - reach {
            let by_hand: f64 = kernel.iter().enumerate().map(|(k, w)| w * values[i + k - reach]).sum();
            assert!((filtered[i] - by_hand).abs() < 1e-9);
        }
        let line: Vec<f64> = (0..60).map(|i| 3.0 - 0.5 * f64::from(i)).collect();
        let same = low_pass.run(&line, std::slice::from_ref(&(0..60)));
        assert!((reach..60 - reach).all(|i| (same[i] - line[i]).abs() < 1e-12));
    }

    #[test]
    fn stretches_do_not_mix() {
        let values: Vec<f64> = (0..40).map(|i| if i < 20 { 1.0 } else { 9.0 }).collect();
        assert_eq!(LowPass { width: 3 }.run(&values, &[0..20, 20..40]), values);
    }
}
