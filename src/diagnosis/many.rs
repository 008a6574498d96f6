//! Arithmetic on many numbers at once. A diagnosis is little but sums over rows, and a processor that takes four at a time is
//! done in a third of the time.

use std::f64::consts::{FRAC_1_SQRT_2, LN_2, LOG2_E, TAU};
use std::ops::{Add, Mul, Sub};
use wide::f64x2;

/// Runs a loop with the widest registers that this processor has. Each number comes out the same on every processor: only how
/// many are worked out at once differs.
#[inline(always)]
pub fn widest<R>(work: impl FnOnce() -> R) -> R {
    pulp::Arch::new().dispatch(work)
}

/// Scalar product.
#[must_use]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    widest(
        #[inline(always)]
        || product(a, b),
    )
}

/// Sum of the squares of the differences.
#[must_use]
pub fn apart(a: &[f64], b: &[f64]) -> f64 {
    widest(
        #[inline(always)]
        || {
            let (mut sums, a8, b8) = ([0.0; 8], a.chunks_exact(8), b.chunks_exact(8));
            let rest: f64 = a8.remainder().iter().zip(b8.remainder()).map(|(x, y)| (x - y) * (x - y)).sum();
            for (x, y) in a8.zip(b8) {
                for k in 0..8 {
                    sums[k] += (x[k] - y[k]) * (x[k] - y[k]);
                }
            }
            sums.iter().sum::<f64>() + rest
        },
    )
}

/// [`dot`] within [`widest`].
#[inline(always)]
#[must_use]
pub fn product(a: &[f64], b: &[f64]) -> f64 {
    let (mut sums, a8, b8) = ([0.0; 8], a.chunks_exact(8), b.chunks_exact(8));
    let rest: f64 = a8.remainder().iter().zip(b8.remainder()).map(|(x, y)| x * y).sum();
    for (x, y) in a8.zip(b8) {
        for k in 0..8 {
            sums[k] += x[k] * y[k];
        }
    }
    sums.iter().sum::<f64>() + rest
}

/// Adds a multiple of a column to another.
pub fn add(to: &mut [f64], factor: f64, column: &[f64]) {
    widest(
        #[inline(always)]
        || to.iter_mut().zip(column).for_each(|(to, c)| *to += factor * c),
    );
}

/// Sums of the values from each place on by the weights of a kernel; 0 where they end before it does.
#[must_use]
pub fn weighted_sums(values: &[f64], kernel: &[f64], places: impl ExactSizeIterator<Item = usize>) -> Vec<f64> {
    let mut sums = vec![0.0; places.len()];
    let of_each = sums.iter_mut().zip(places);
    widest(
        #[inline(always)]
        || match kernel.len() {
            0..=8 => of_length::<8>(values, kernel, of_each),
            9..=12 => of_length::<12>(values, kernel, of_each),
            13..=16 => of_length::<16>(values, kernel, of_each),
            17..=24 => of_length::<24>(values, kernel, of_each),
            _ => of_each.for_each(|(sum, from)| *sum = weighted_sum(values, kernel, from)),
        },
    );
    sums
}

#[inline(always)]
fn weighted_sum(values: &[f64], kernel: &[f64], from: usize) -> f64 {
    values.get(from..from + kernel.len()).map_or(0.0, |window| product(window, kernel))
}

/// By a kernel that zeros make so long: a length that is known beforehand takes no loop.
#[inline(always)]
fn of_length<'s, const K: usize>(
    values: &[f64],
    kernel: &[f64],
    sums_and_places: impl Iterator<Item = (&'s mut f64, usize)>,
) {
    let mut weights = [0.0; K];
    weights[..kernel.len()].copy_from_slice(kernel);
    for (sum, from) in sums_and_places {
        *sum = match values.get(from..).and_then(<[f64]>::first_chunk::<K>) {
            Some(window) => {
                let mut four = [0.0; 4];
                for k in 0..K {
                    four[k % 4] += weights[k] * window[k];
                }
                (four[0] + four[2]) + (four[1] + four[3])
            }
            None => weighted_sum(values, kernel, from),
        };
    }
}

/// [`sine_cosine`] of each.
pub fn sines_and_cosines(turns: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let (mut sines, mut cosines) = (vec![0.0; turns.len()], vec![0.0; turns.len()]);
    widest(
        #[inline(always)]
        || {
            for (turns, (sine, cosine)) in turns.iter().zip(sines.iter_mut().zip(&mut cosines)) {
                (*sine, *cosine) = sine_cosine(*turns);
            }
        },
    );
    (sines, cosines)
}

/// Sine and cosine of so many turns, to 1e-7. The library's are exact to the last bit and take several times as long, and
/// waves of every period at every row are what a search for ripples is made of.
#[inline(always)]
pub fn sine_cosine(turns: f64) -> (f64, f64) {
    let rest = turns - turns.round_ties_even();
    // sin over a quarter turn either side of zero by its series; beyond it the sine comes back the same way.
    let sine = |quarter: f64| {
        let a = TAU * quarter;
        let s = a * a;
        let tail = 1.0 / 362_880.0 + s * (-1.0 / 39_916_800.0 + s / 6_227_020_800.0);
        a * (1.0 + s * (-1.0 / 6.0 + s * (1.0 / 120.0 + s * (-1.0 / 5040.0 + s * tail))))
    };
    let folded = if rest.abs() > 0.25 { 0.5f64.copysign(rest) - rest } else { rest };
    (sine(folded), sine(0.25 - rest.abs()))
}

/// One number, or several that one instruction handles.
pub trait Numbers: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {
    /// All the same.
    fn splat(value: f64) -> Self;

    /// Each or a bound, whichever is smaller.
    fn at_most(self, bound: f64) -> Self;

    /// 2ⁿ by the whole number n in the last bits of each.
    fn power_of_last_bits(self) -> Self;
}

impl Numbers for f64 {
    #[inline(always)]
    fn splat(value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn at_most(self, bound: f64) -> Self {
        if self < bound { self } else { bound }
    }

    #[inline(always)]
    fn power_of_last_bits(self) -> Self {
        f64::from_bits((self.to_bits() << 52).wrapping_add(1.0f64.to_bits()))
    }
}

impl Numbers for f64x2 {
    #[inline(always)]
    fn splat(value: f64) -> Self {
        f64x2::splat(value)
    }

    #[inline(always)]
    fn at_most(self, bound: f64) -> Self {
        self.fast_min(f64x2::splat(bound))
    }

    #[inline(always)]
    fn power_of_last_bits(self) -> Self {
        f64x2::new(self.to_array().map(f64::power_of_last_bits))
    }
}

/// e^−x for x from 0 on, to 1e-9; the library's are exact to the last bit and take several times as long.
#[inline(always)]
pub fn decay<T: Numbers>(x: T) -> T {
    two_to(x.at_most(700.0) * T::splat(-LOG2_E))
}

/// A power of each, from 0 on, to 1e-8; of what is less than 1e-300 that of 1e-300.
pub fn to_the_power(values: &mut [f64], exponent: f64) {
    widest(
        #[inline(always)]
        || {
            for value in values.iter_mut() {
                let below = (exponent * binary_logarithm(*value)).at_most(1000.0);
                *value = two_to(if below > -1000.0 { below } else { -1000.0 });
            }
        },
    );
}

/// 2^y for y within ±1020.
#[inline(always)]
fn two_to<T: Numbers>(y: T) -> T {
    /// Added to a number, it leaves the nearest whole one in the last bits.
    const WHOLE: f64 = 6_755_399_441_055_744.0;
    // 2ⁿ·eʳ with r within half of ln 2.
    let n = y + T::splat(WHOLE);
    let r = (y - (n - T::splat(WHOLE))) * T::splat(LN_2);
    let factorials = [1.0 / 5040.0, 1.0 / 720.0, 1.0 / 120.0, 1.0 / 24.0, 1.0 / 6.0, 0.5, 1.0, 1.0];
    let series = factorials.into_iter().fold(T::splat(1.0 / 40_320.0), |sum, term| T::splat(term) + r * sum);
    n.power_of_last_bits() * series
}

/// log₂ x of a number from 1e-300 on, to 1e-10.
#[inline(always)]
fn binary_logarithm(x: f64) -> f64 {
    /// 2⁵², in whose last bits whole numbers stand.
    const WHOLE: f64 = 4_503_599_627_370_496.0;
    const ROOT_OF_HALF: u64 = FRAC_1_SQRT_2.to_bits();
    let bits = (if x > 1e-300 { x } else { 1e-300 }).to_bits();
    // x = 2ᵏ·m with m from √½ to √2.
    let biased = (bits + (1.0f64.to_bits() - ROOT_OF_HALF)) >> 52;
    let m = f64::from_bits(bits.wrapping_sub(biased.wrapping_sub(1023) << 52));
    let k = f64::from_bits(biased | WHOLE.to_bits()) - (WHOLE + 1023.0);
    // ln m = 2·artanh s.
    let s = (m - 1.0) / (m + 1.0);
    let q = s * s;
    let tail = 1.0 / 7.0 + q * (1.0 / 9.0 + q * (1.0 / 11.0 + q / 13.0));
    k + 2.0 * LOG2_E * s * (1.0 + q * (1.0 / 3.0 + q * (1.0 / 5.0 + q * tail)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sines_of_turns_are_those_of_the_library() {
        for i in -4000..4000 {
            let turns = f64::from(i) * 1.7e-3;
            let ((sine, cosine), (s, c)) = (sine_cosine(turns), (TAU * turns).sin_cos());
            assert!((sine - s).abs() < 1e-7 && (cosine - c).abs() < 1e-7, "{turns}");
        }
    }

    #[test]
    fn decays_are_those_of_the_library() {
        for i in 0..8000 {
            let x = f64::from(i) * 0.01;
            assert!((decay(x) / (-x).exp() - 1.0).abs() < 1e-9, "{x}");
        }
        assert!(decay(1e9) < 1e-300 && decay(f64::INFINITY) < 1e-300 && decay(0.0) == 1.0);
    }

    #[test]
    fn powers_are_those_of_the_library() {
        for exponent in [0.03, 0.2, 0.7, 1.3, 4.0, 30.0] {
            let values: Vec<f64> = (-400..400).map(|i| (f64::from(i) * 0.05).exp()).collect();
            let mut powers = values.clone();
            to_the_power(&mut powers, exponent);
            assert!(powers.iter().zip(&values).all(|(p, x)| (p / x.powf(exponent) - 1.0).abs() < 1e-8), "{exponent}");
        }
        let mut ends = [0.0, 1e-310, 1.0, 1e200, f64::INFINITY];
        to_the_power(&mut ends, 5.0);
        assert!(ends[0] < 1e-299 && ends[1] < 1e-299 && ends[2] == 1.0 && ends[3] > 1e300 && ends[4] > 1e300);
    }

    #[test]
    fn sums_by_kernels_of_any_length_reach_the_last_value() {
        let values: Vec<f64> = (0..60).map(|i| f64::from(i * i % 17)).collect();
        for length in 1..30 {
            let kernel: Vec<f64> = (0..length).map(|k| f64::from(k as u32 % 5)).collect();
            let sums = weighted_sums(&values, &kernel, 0..60);
            let sum = |from: usize| values[from..].iter().zip(&kernel).map(|(value, weight)| value * weight).sum();
            let whole = |from: usize| if from + length > values.len() { 0.0 } else { sum(from) };
            assert!(sums.iter().enumerate().all(|(from, sum)| *sum == whole(from)), "{length}");
        }
    }

    #[test]
    fn columns_of_any_length_multiply_and_add() {
        for rows in 0..40 {
            let (a, b): (Vec<f64>, Vec<f64>) = (0..rows).map(|i| (f64::from(i), f64::from(i * i))).unzip();
            let sum: f64 = a.iter().zip(&b).map(|(a, b)| a * b).sum();
            assert_eq!(dot(&a, &b), sum);
            assert_eq!(apart(&a, &b), a.iter().zip(&b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>());
            let mut to = a.clone();
            add(&mut to, -2.0, &b);
            assert!(to.iter().zip(&a).zip(&b).all(|((to, a), b)| *to == a - 2.0 * b));
        }
    }
}
