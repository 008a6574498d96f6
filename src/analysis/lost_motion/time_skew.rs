//! How much later the table position was taken than the motor position of the same row.
//!
//! A table read τ late makes D = motor − table larger by v·τ, which turns its sign with the direction: at 10 mm/s, 1 ms
//! looks like 20 µm of lost motion. But speed changes where nothing is lost, and shows τ there:
//!
//! - along one sweep once the table moves, mostly where the axis brakes for the next reversal: `D = f(x) + τ·v + β·a`, with f a
//!   cubic spline of the position x, τ in s and β (wind-up by acceleration) in s²;
//! - from place to place and from reversal to reversal: `lost motion seen = L± + τ·(|v before| + |v after|)`, with one level
//!   for each sense of reversal.
//!
//! Both are joined with what is known beforehand: the two columns belong to one row, so that τ is zero give or take one
//! sample period. Whatever else grows with speed, such as wind-up by viscous friction, goes into τ too, and should: lost
//! motion is defined for slow motion.

use nalgebra::{DMatrix, DVector};

use super::pair::{Place, by_place};
use super::sweeps::Sample;
use crate::analysis::statistics::{correlated_mean, quantile, student_95};

/// The delay of the table, and how well it is known.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Skew {
    /// τ, s.
    pub delay_s: f64,
    /// Standard error of τ, s.
    pub error_s: f64,
}

impl Skew {
    /// The part of a sample's difference that its speed makes.
    pub fn of(&self, sample: &Sample) -> f64 {
        self.delay_s * sample.speed
    }

    /// What is known once `seen` is added to what was known beforehand.
    pub fn and(self, seen: Option<Skew>) -> Skew {
        let Some(seen) = seen else { return self };
        let (known, new) = (self.error_s.powi(-2), seen.error_s.powi(-2));
        Skew {
            delay_s: (known * self.delay_s + new * seen.delay_s) / (known + new),
            error_s: (known + new).sqrt().recip(),
        }
    }

    /// The mean of estimates by their errors. Sweeps over the same stretch err alike, so that their mean is no better than one of
    /// them; where they disagree by more than their errors, these were too small and grow by Birge's ratio.
    pub fn join(estimates: &[Skew]) -> Option<Skew> {
        let weight: f64 = estimates.iter().map(|e| e.error_s.powi(-2)).sum();
        let delay_s = estimates.iter().map(|e| e.delay_s * e.error_s.powi(-2)).sum::<f64>() / weight;
        let misfit: f64 = estimates.iter().map(|e| ((e.delay_s - delay_s) / e.error_s).powi(2)).sum();
        let n = estimates.len().max(2) as f64;
        let birge = (misfit / (n - 1.0)).max(1.0);
        let error_s = (birge / weight * estimates.len() as f64).sqrt();
        (delay_s.is_finite() && error_s.is_finite()).then_some(Skew { delay_s, error_s })
    }
}

/// Speeds must differ by this share of their median before they show anything of a delay.
const LEAST_CHANGE: f64 = 0.3;

/// The delay from places of reversals, each with its sense: the least-squares slope over speed within each sense. Its error is
/// that of the mean of the scores place by place, which respects that neighbouring places err alike. The lost motion must
/// not be corrected for a delay yet.
pub(super) fn from_places(reversals: &[(i8, Vec<Place>)], resolution: f64) -> Option<Skew> {
    let all: Vec<f64> = reversals.iter().flat_map(|(_, places)| places.iter().map(|p| p.speed_sum)).collect();
    let change = quantile(&all, 0.9)? - quantile(&all, 0.1)?;
    if change < LEAST_CHANGE * quantile(&all, 0.5)? {
        return None;
    }
    let centre = |sense: i8, of: fn(&Place) -> f64| {
        let places = || reversals.iter().filter(move |(s, _)| *s == sense).flat_map(|(_, places)| places);
        places().map(of).sum::<f64>() / places().count().max(1) as f64
    };
    let speeds = [centre(-1, |p| p.speed_sum), centre(1, |p| p.speed_sum)];
    let levels = [centre(-1, |p| p.lost_motion), centre(1, |p| p.lost_motion)];
    let about = |sense: i8, place: &Place| {
        let i = usize::from(sense > 0);
        (place.speed_sum - speeds[i], place.lost_motion - levels[i])
    };
    let places =
        || reversals.iter().flat_map(|(sense, places)| places.iter().map(|place| (place, about(*sense, place))));
    let spread: f64 = places().map(|(_, (v, _))| v * v).sum();
    let delay_s = places().map(|(_, (v, d))| v * d).sum::<f64>() / spread;
    let scores: Vec<(f64, f64)> = places().map(|(place, (v, d))| (place.position, v * (d - delay_s * v))).collect();
    // What errs at a place errs there in every reversal, so places are counted once however often they are visited.
    let sums: Vec<f64> = by_place(&scores).iter().map(|values| values.iter().sum()).collect();
    let score = correlated_mean(&sums)?;
    let error_s = sums.len() as f64 * score.error / spread * student_95(score.freedom) / 1.96;
    let error_s = error_s.max(resolution / 12f64.sqrt() / spread.sqrt());
    (error_s.is_finite() && error_s > 0.0).then_some(Skew { delay_s, error_s })
}

/// Intervals of the spline at most, and rows for each at least. Encoder errors bend over the stroke, braking is over in a
/// small part of it: the finer the spline, the less of them is mistaken for a delay.
const MOST_INTERVALS: usize = 32;
const ROWS_PER_INTERVAL: usize = 12;
/// Below this share of the top speed the table may stick while the motor still creeps: that is no delay.
const LEAST_SPEED: f64 = 0.3;
/// The fewest rows a sweep must have for a fit.
const FEWEST_ROWS: usize = 60;

/// The delay from one sweep, from where the table moves on. `speed_noise` is the standard deviation of the noise in the speeds,
/// `resolution` the step of the differences: residuals below it are luck, not knowledge.
pub(super) fn from_sweep(samples: &[Sample], speed_noise: f64, resolution: f64) -> Option<Skew> {
    let top = samples.iter().map(|s| s.speed.abs()).fold(0.0, f64::max);
    let fast: Vec<Sample> = samples.iter().filter(|s| s.speed.abs() > LEAST_SPEED * top).copied().collect();
    let samples = fast.as_slice();
    let first = samples.first().filter(|_| samples.len() >= FEWEST_ROWS)?;
    let (low, high) =
        samples.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), s| (l.min(s.motor), h.max(s.motor)));
    let speed = samples.iter().map(|s| s.speed.abs()).fold(0.0, f64::max);
    let accel = samples.iter().map(|s| s.accel.abs()).fold(0.0, f64::max);
    if high <= low || speed <= 0.0 || accel <= 0.0 {
        return None;
    }
    let intervals = (samples.len() / ROWS_PER_INTERVAL).min(MOST_INTERVALS);
    let (d, a) = (intervals + 3, intervals + 4);
    // Speed and acceleration scaled to one, so that the normal matrix is well conditioned whatever the units.
    let row = |s: &Sample| -> [(usize, f64); 6] {
        let (at, [b0, b1, b2, b3]) = spline((s.motor - low) / (high - low) * intervals as f64, intervals);
        [(at, b0), (at + 1, b1), (at + 2, b2), (at + 3, b3), (d, s.speed / speed), (a, s.accel / accel)]
    };
    let mut normal = DMatrix::<f64>::zeros(a + 1, a + 1);
    let mut right = DVector::<f64>::zeros(a + 1);
    for sample in samples {
        let terms = row(sample);
        for (i, x) in terms {
            right[i] += x * (sample.difference - first.difference);
            terms.iter().for_each(|(j, y)| normal[(i, *j)] += x * y);
        }
    }
    // A trace of ridge holds spline pieces that no row falls into.
    let ridge = 1e-9 * samples.len() as f64;
    (0..=a).for_each(|i| normal[(i, i)] += ridge);
    let inverse = normal.cholesky()?.inverse();
    // Noise in a regressor draws its coefficient toward zero and makes it look certain: what is mostly noise says nothing.
    let noise_share = samples.len() as f64 * (speed_noise / speed).powi(2) * inverse[(d, d)];
    if noise_share > 0.3 {
        return None;
    }
    let solution = &inverse * right;
    let residual =
        |s: &Sample| s.difference - first.difference - row(s).iter().map(|(i, x)| x * solution[*i]).sum::<f64>();
    // What each row adds to the slope. Speed changes in few rows, where the axis brakes: their residuals are what counts, and
    // neighbours move together. A residual below the step of the differences is luck.
    let floor = resolution / 12f64.sqrt();
    let influence = |s: &Sample| {
        let leverage: f64 = row(s).iter().map(|(i, x)| inverse[(d, *i)] * x).sum();
        let left = residual(s);
        leverage * left.signum() * left.abs().max(floor)
    };
    let influences: Vec<f64> = samples.iter().map(influence).collect();
    let mean = correlated_mean(&influences)?;
    let error = samples.len() as f64 * mean.error * student_95(mean.freedom) / 1.96;
    let signal = speed * (1.0 - noise_share);
    let estimate = Skew { delay_s: solution[d] / signal, error_s: error / signal };
    (estimate.delay_s.is_finite() && estimate.error_s > 0.0).then_some(estimate)
}

/// The four cubic B-splines that are not zero at `at` (0 to `intervals`), and the number of the first.
fn spline(at: f64, intervals: usize) -> (usize, [f64; 4]) {
    let first = (at.max(0.0) as usize).min(intervals - 1);
    let u = at - first as f64;
    let (u2, u3) = (u * u, u * u * u);
    let bases = [(1.0 - u).powi(3), 3.0 * u3 - 6.0 * u2 + 4.0, -3.0 * u3 + 3.0 * u2 + 3.0 * u + 1.0, u3];
    (first, bases.map(|basis| basis / 6.0))
}
