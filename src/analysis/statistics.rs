//! Robust statistics of one sampled signal: noise, grid, hold. None of them is moved by a few wild values.

/// Standard deviation of a normal distribution over its median absolute deviation.
const STD_PER_MAD: f64 = 1.482_602_218_505_602;

/// The most values looked at for a grid; more would only take time.
const GRID_SAMPLE: usize = 20_000;

/// The median; `None` without finite values.
#[must_use]
pub fn median(values: &[f64]) -> Option<f64> {
    quantile(values, 0.5)
}

/// The quantile `share` (0 to 1) by nearest rank; `None` without finite values.
#[must_use]
pub fn quantile(values: &[f64], share: f64) -> Option<f64> {
    let mut finite: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    if finite.is_empty() {
        return None;
    }
    let rank = ((finite.len() - 1) as f64 * share.clamp(0.0, 1.0)).round() as usize;
    Some(*finite.select_nth_unstable_by(rank, f64::total_cmp).1)
}

/// Standard deviation of a sample; 0 for fewer than two values.
pub fn deviation(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0)).sqrt()
}

/// Mean of a sample over what that may be off by: over the standard deviation, times √n; 0 of fewer than two values, which say nothing of
/// that.
#[must_use]
pub fn strength(values: &[f64]) -> f64 {
    if values.len() < 2 {
        return 0.0;
    }
    let n = values.len() as f64;
    values.iter().sum::<f64>() / n * n.sqrt() / deviation(values).max(1e-300)
}

/// Standard deviation of white noise on a smooth signal, in the signal's unit: the fourth difference removes what a cubic
/// follows within five rows, and white noise of standard deviation s leaves it with s·√70.
/// (von Neumann's mean square successive difference, one order higher, with a median in place of the mean.)
#[must_use]
pub fn white_noise(values: &[f64]) -> Option<f64> {
    let fourth: Vec<f64> =
        values.windows(5).map(|v| (v[0] - 4.0 * v[1] + 6.0 * v[2] - 4.0 * v[3] + v[4]).abs()).collect();
    Some(STD_PER_MAD * median(&fourth)? / 70f64.sqrt())
}

/// The step all values are multiples of, in the signal's unit: an encoder's grid, or the last printed decimal; `None` for
/// values that show no grid.
#[must_use]
pub fn grid(values: &[f64]) -> Option<f64> {
    let stride = (values.len() / GRID_SAMPLE).max(1);
    let mut sorted: Vec<f64> = values.iter().copied().step_by(stride).filter(|value| value.is_finite()).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let span = sorted.first()?.abs().max(sorted.last()?.abs());
    let steps: Vec<f64> = sorted.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 1e-12 * span).collect();
    if steps.len() < 4 {
        return None;
    }
    let mut step = steps.iter().copied().fold(f64::INFINITY, f64::min);
    // Small multiples fix the step to a few per cent, larger ones then to the last digit.
    for most in [1.5, 4.5, 20.5, 100.5] {
        let near = steps.iter().filter(|s| **s < most * step);
        let (sum, count) = near.fold((0.0, 0.0), |(sum, count), s| (sum + s, count + (s / step).round()));
        step = sum / count;
    }
    let fits = |s: &&f64| (*s / step - (*s / step).round()).abs() < 0.15;
    let close: Vec<&f64> = steps.iter().filter(|s| **s < 20.0 * step).collect();
    let fitting = close.iter().filter(|s| fits(s)).count();
    (close.len() >= 4 && fitting * 20 >= close.len() * 19).then_some(step)
}

/// What a sensor itself is off by, by its readings: the more of white noise and the rounding to its grid, 1 σ, their unit; 0 where neither
/// shows.
#[must_use]
pub fn reading_error(values: &[f64]) -> f64 {
    white_noise(values).unwrap_or(0.0).max(grid(values).unwrap_or(0.0) / 12f64.sqrt())
}

/// Rows for which a moving signal keeps each value: 1 when every row is fresh, n when it is updated every n rows (a slower
/// fieldbus, or a zero-order hold). Steps of one grid are ignored: they are slow motion, not a hold.
#[must_use]
pub fn hold_rows(values: &[f64], grid: f64) -> usize {
    let mut lengths = Vec::new();
    let mut last = 0;
    let mut last_was_large = false;
    for row in 1..values.len() {
        let step = (values[row] - values[row - 1]).abs();
        if step > 0.0 {
            let large = step > 2.5 * grid;
            if large && last_was_large {
                lengths.push((row - last) as f64);
            }
            (last, last_was_large) = (row, large);
        }
    }
    if lengths.len() < 10 {
        return 1;
    }
    median(&lengths).map_or(1, |rows| rows as usize)
}

/// A mean with what is needed to bound it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mean {
    /// The mean.
    pub value: f64,
    /// Its standard error, with neighbours that move together counted once.
    pub error: f64,
    /// Degrees of freedom behind that error.
    pub freedom: f64,
}

/// The fewest independent values a correlated stretch is taken to hold: a trend, however long, has hardly more to say.
const FEWEST_INDEPENDENT: f64 = 3.0;

/// The mean of values in order, with a standard error that respects their autocorrelation (initial positive sequence,
/// Geyer 1992): n values with integrated autocorrelation time τ count as n/τ. `None` for fewer than two values.
#[must_use]
pub fn correlated_mean(values: &[f64]) -> Option<Mean> {
    let n = values.len() as f64;
    if values.len() < 2 {
        return None;
    }
    let value = values.iter().sum::<f64>() / n;
    let covariance = |lag: usize| {
        values.iter().zip(values.iter().skip(lag)).map(|(a, b)| (a - value) * (b - value)).sum::<f64>() / n
    };
    let variance = covariance(0);
    if variance <= 0.0 {
        return Some(Mean { value, error: 0.0, freedom: n - 1.0 });
    }
    let mut time = 1.0;
    for lag in (1..values.len() / 2).step_by(2) {
        let pair = covariance(lag) + covariance(lag + 1);
        if pair <= 0.0 {
            break;
        }
        time += 2.0 * pair / variance;
    }
    let independent = (n / time).clamp(FEWEST_INDEPENDENT.min(n), n);
    // The sample's own mean has taken one of the independent values.
    let error = (variance / (independent - 1.0)).sqrt();
    Some(Mean { value, error, freedom: independent - 1.0 })
}

/// Half-width of the central 95 % of Student's t distribution, in standard errors; `freedom` at least 1.
/// (Exact up to 10 degrees of freedom, interpolated in 1/freedom between; Cornish and Fisher's expansion above.)
#[must_use]
pub fn student_95(freedom: f64) -> f64 {
    const EXACT: [f64; 10] = [12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228];
    let freedom = freedom.max(1.0);
    let below = freedom.floor();
    let at = |n: f64| EXACT.get(n as usize - 1).copied().unwrap_or_else(|| expansion(n));
    let share = (1.0 / below - 1.0 / freedom) / (1.0 / below - 1.0 / (below + 1.0));
    at(below) + share * (at(below + 1.0) - at(below))
}

fn expansion(freedom: f64) -> f64 {
    const Z: f64 = 1.959_964;
    Z + (Z.powi(3) + Z) / (4.0 * freedom) + (5.0 * Z.powi(5) + 16.0 * Z.powi(3) + 3.0 * Z) / (96.0 * freedom.powi(2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mean_is_as_strong_as_its_scatter_and_number_make_it() {
        // Mean 2, deviation 1, of four.
        let around = (1.5f64).sqrt() / 2f64.sqrt();
        let values = [2.0 - around, 2.0 + around, 2.0 - around, 2.0 + around];
        assert!((strength(&values) - 4.0).abs() < 1e-12, "{}", strength(&values));
    }

    /// Numerical Recipes' `ranqd1`-like generator, good enough for noise; the seed is the argument.
    fn noise(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed;
        move || {
            let mut uniform = || {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (state >> 11) as f64 / (1u64 << 53) as f64
            };
            (0..12).map(|_| uniform()).sum::<f64>() - 6.0
        }
    }

    #[test]
    fn noise_is_told_from_motion() {
        let mut normal = noise(7);
        let values: Vec<f64> = (0..5000).map(|i| 100.0 * (f64::from(i) * 0.01).sin() + 0.02 * normal()).collect();
        let found = white_noise(&values).unwrap();
        assert!((0.0185..0.0215).contains(&found), "{found}");
        let clean: Vec<f64> = (0..5000).map(|i| 100.0 * (f64::from(i) * 0.001).sin()).collect();
        assert!(white_noise(&clean).unwrap() < 1e-9);
    }

    #[test]
    fn grids_are_found_also_when_printed_on_another_grid() {
        for (step, printed) in [(0.05e-3, 1e-6), (1e-3, 1e-7), (10.0 / 131_072.0, 1e-7), (360.0 / 8192.0, 1e-5)] {
            let value = |i: i32| {
                let x: f64 = 3.0 * (f64::from(i) * 0.002).sin();
                (x / step).round() * step
            };
            let values: Vec<f64> = (0..8000).map(|i| (value(i) / printed).round() * printed).collect();
            let found = grid(&values).unwrap();
            assert!((found / step - 1.0).abs() < 0.01, "{found} for {step}");
        }
        let mut normal = noise(3);
        let smooth: Vec<f64> = (0..5000).map(|_| normal()).collect();
        assert_eq!(grid(&smooth), None);
    }

    #[test]
    fn a_hold_is_counted_and_slow_motion_is_none() {
        let ramp: Vec<f64> = (0..1000).map(|i| f64::from(i / 4) * 0.01).collect();
        assert_eq!(hold_rows(&ramp, 1e-4), 4);
        let slow: Vec<f64> = (0..1000).map(|i| (f64::from(i) * 0.2).floor() * 1e-4).collect();
        assert_eq!(hold_rows(&slow, 1e-4), 1);
    }

    #[test]
    fn the_error_of_a_mean_respects_correlation() {
        // First-order autoregression with coefficient 0.9: the mean of 400 scatters by 1/(1 − 0.9)/√400 = 0.5.
        let mut normal = noise(11);
        let (mut covered, mut errors) = (0, 0.0);
        for _ in 0..400 {
            let mut x = 0.0;
            let values: Vec<f64> = (0..450)
                .map(|_| {
                    x = 0.9 * x + normal();
                    x
                })
                .skip(50)
                .collect();
            let mean = correlated_mean(&values).unwrap();
            errors += mean.error / 400.0;
            covered += usize::from(mean.value.abs() < student_95(mean.freedom) * mean.error);
        }
        assert!((0.35..0.65).contains(&errors), "{errors}");
        assert!((350..=396).contains(&covered), "{covered} of 400 within 95 %");
    }

    #[test]
    fn student_agrees_with_the_tables() {
        for (freedom, t) in [(1.0, 12.706), (4.0, 2.776), (12.0, 2.179), (30.0, 2.042), (1000.0, 1.962)] {
            assert!((student_95(freedom) - t).abs() < 2e-3, "{freedom}");
        }
        assert!(student_95(2.5) < 4.303 && student_95(2.5) > 3.182);
    }
}
