//! Speed and acceleration from a measured position, without shifting it in time.
//!
//! A Butterworth low-pass of order n run forward and backward has the gain 1/(1 + (f/fc)²ⁿ) and no phase. Where the
//! signal's spectrum falls as f⁻²ⁿ into a white noise floor and meets it at fc, this is Wiener's filter S/(S + N), the
//! one of least mean-square error for the position and for every derivative of it. So fc is read from the spectrum: the
//! frequency at which motion and noise are equal. (Wiener 1949; Gustafsson, *Determining the initial states in
//! forward-backward filtering*, 1996.)

use super::between::cubic_at;
use super::cutoff::noise_crossing_hz;
use super::linear::rms;
use super::stamps::are_even;
use std::borrow::Cow;
use std::f64::consts::{PI, TAU};
use std::ops::Range;

/// Motion of one axis at the rows of its recording, in load units (mm; degree for rotary).
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    /// Position with the noise above the cut-off taken off; NaN in rows outside the stretches.
    pub position: Vec<f64>,
    /// Where motion and noise are equal, Hz.
    pub cutoff_hz: f64,
    /// RMS of what was taken off: what the position cannot tell.
    pub resolution: f64,
    pieces: Vec<Piece>,
}

/// A stretch of rows, and how its speed and acceleration are had.
#[derive(Debug, Clone, PartialEq)]
struct Piece {
    rows: Range<usize>,
    slopes: Slopes,
}

#[derive(Debug, Clone, PartialEq)]
enum Slopes {
    /// Rows are even: both are differences of the position, which goes on so before and after them. Long recordings have no room
    /// for more.
    Even { period: f64, before: [f64; 2], after: [f64; 2] },
    /// Read off between the rows of an even grid.
    Uneven { velocity: Vec<f64>, acceleration: Vec<f64> },
}

/// Fewest rows from which an acceleration is estimated.
pub const FEWEST_ROWS: usize = 16;

impl Motion {
    /// Speed at a row, per second; NaN outside the stretches.
    #[inline]
    #[must_use]
    pub fn velocity(&self, row: usize) -> f64 {
        self.slope(row, first_derivative, |velocity, _| velocity)
    }

    /// Acceleration at a row, per second squared; NaN outside the stretches.
    #[inline]
    #[must_use]
    pub fn acceleration(&self, row: usize) -> f64 {
        self.slope(row, second_derivative, |_, acceleration| acceleration)
    }

    /// The speed at each row.
    pub fn velocities(&self) -> impl Iterator<Item = f64> {
        (0..self.position.len()).map(|row| self.velocity(row))
    }

    #[inline]
    fn slope(
        &self,
        row: usize,
        of_neighbours: fn([f64; 5], f64) -> f64,
        of_stored: for<'v> fn(&'v [f64], &'v [f64]) -> &'v [f64],
    ) -> f64 {
        let Some(piece) = self.pieces.get(self.pieces.partition_point(|piece| piece.rows.end <= row)) else {
            return f64::NAN;
        };
        let Some(place) = row.checked_sub(piece.rows.start) else { return f64::NAN };
        let (period, before, after) = match &piece.slopes {
            Slopes::Even { period, before, after } => (period, before, after),
            Slopes::Uneven { velocity, acceleration } => return of_stored(velocity, acceleration)[place],
        };
        let x = &self.position[piece.rows.clone()];
        let neighbours = match x.get(place.wrapping_sub(2)..place + 3) {
            Some(&[a, b, c, d, e]) => [a, b, c, d, e],
            _ => [0, 1, 2, 3, 4].map(|k| match (place + k).checked_sub(2) {
                None => before[place + k],
                Some(at) => x.get(at).copied().unwrap_or_else(|| after[at - x.len()]),
            }),
        };
        of_neighbours(neighbours, *period)
    }

    /// Speed below which an axis cannot be told from one that stands, load units/s: thrice what the position leaves open, at
    /// the fastest it is known, and never nothing. Dry friction at rest is not a function of the motion.
    #[must_use]
    pub fn standing_speed(&self) -> f64 {
        let typical = rms(self.velocities().filter(|v| v.is_finite()));
        (3.0 * TAU * self.cutoff_hz * self.resolution).max(1e-6 * typical)
    }

    /// Motion of a whole stretch of rows: times strictly increasing, positions finite. Irregular times are resampled to
    /// their mean period, filtered, and read back at the rows. `None` for fewer than [`FEWEST_ROWS`] rows.
    #[must_use]
    pub fn estimate(time_s: &[f64], position: &[f64]) -> Option<Motion> {
        Self::with_cutoff(time_s, position, None)
    }

    /// Motion of stretches of rows, all with the cut-off that they show together: in one alone the axis may stand, or creep over
    /// its grid. NaN in rows outside them. `None` where the longest is too short; shorter ones stay NaN.
    #[must_use]
    pub fn of_stretches(time_s: &[f64], position: &[f64], stretches: &[Range<usize>]) -> Option<Motion> {
        let longest = stretches.iter().max_by_key(|s| s.len()).filter(|s| s.len() >= FEWEST_ROWS)?;
        let period_s = (time_s[longest.end - 1] - time_s[longest.start]) / (longest.len() - 1) as f64;
        let pieces: Vec<&[f64]> = stretches.iter().map(|s| &position[s.clone()]).collect();
        Some(Self::up_to(noise_crossing_hz(&pieces, period_s), time_s, position, stretches))
    }

    /// Motion of stretches of rows up to a cut-off, Hz; of one that is too short nothing is known.
    fn up_to(cutoff_hz: f64, time_s: &[f64], position: &[f64], stretches: &[Range<usize>]) -> Motion {
        // A motion of all rows is taken as it is: long recordings have no room for a copy.
        let whole = stretches.iter().any(|stretch| stretch.len() == position.len());
        let nothing = if whole { Vec::new() } else { vec![f64::NAN; position.len()] };
        let mut motion = Motion { position: nothing, cutoff_hz, resolution: 0.0, pieces: Vec::new() };
        let (mut square, mut rows) = (0.0, 0);
        for s in stretches {
            let Some(part) = Self::with_cutoff(&time_s[s.clone()], &position[s.clone()], Some(cutoff_hz)) else {
                continue;
            };
            square += part.resolution * part.resolution * s.len() as f64;
            rows += s.len();
            motion.pieces.extend(part.pieces.into_iter().map(|piece| Piece { rows: s.clone(), ..piece }));
            if whole {
                motion.position = part.position;
            } else {
                motion.position[s.clone()].copy_from_slice(&part.position);
            }
        }
        motion.resolution = (square / rows.max(1) as f64).sqrt();
        motion
    }

    /// Motion of other positions in the same stretches, through the same cut-off: as far as this one is known.
    #[must_use]
    pub fn like_this(&self, time_s: &[f64], position: &[f64]) -> Motion {
        let stretches: Vec<Range<usize>> = self.pieces.iter().map(|piece| piece.rows.clone()).collect();
        Self { resolution: self.resolution, ..Self::up_to(self.cutoff_hz, time_s, position, &stretches) }
    }

    /// The same with a given cut-off, for instance that of the whole recording for one short stretch of it.
    #[must_use]
    pub fn with_cutoff(time_s: &[f64], position: &[f64], cutoff_hz: Option<f64>) -> Option<Motion> {
        let n = time_s.len();
        if n < FEWEST_ROWS || position.len() != n {
            return None;
        }
        let start = time_s[0];
        let period = (time_s[n - 1] - start) / (n - 1) as f64;
        let regular = are_even(time_s, 0.02);
        let grid = if regular { Cow::Borrowed(position) } else { Cow::Owned(resample(time_s, position, period)) };
        let cutoff_hz = cutoff_hz.unwrap_or_else(|| noise_crossing_hz(&[&grid], period)).min(0.4 / period);
        let (mut x, pad) = low_passed(grid.into_owned(), period, cutoff_hz);
        let (smooth, slopes) = if regular {
            let (before, after) = ([x[pad - 2], x[pad - 1]], [x[pad + n], x[pad + n + 1]]);
            x.truncate(pad + n);
            x.drain(..pad);
            (x, Slopes::Even { period, before, after })
        } else {
            let of = |derivative: fn([f64; 5], f64) -> f64| -> Vec<f64> {
                let on_grid: Vec<f64> = x[pad - 2..pad + n + 2]
                    .windows(5)
                    .map(|x| derivative([x[0], x[1], x[2], x[3], x[4]], period))
                    .collect();
                time_s.iter().map(|t| cubic_at(&on_grid, (t - start) / period)).collect()
            };
            (of(|x, _| x[2]), Slopes::Uneven { velocity: of(first_derivative), acceleration: of(second_derivative) })
        };
        let square: f64 = position.iter().zip(&smooth).map(|(raw, s)| (raw - s) * (raw - s)).sum();
        let pieces = vec![Piece { rows: 0..n, slopes }];
        Some(Motion { position: smooth, cutoff_hz, resolution: (square / n as f64).sqrt(), pieces })
    }
}

/// Central differences of fourth order.
#[inline]
fn first_derivative(x: [f64; 5], period: f64) -> f64 {
    (8.0 * (x[3] - x[1]) - (x[4] - x[0])) / (12.0 * period)
}

#[inline]
fn second_derivative(x: [f64; 5], period: f64) -> f64 {
    (16.0 * (x[3] + x[1]) - (x[4] + x[0]) - 30.0 * x[2]) / (12.0 * period * period)
}

/// Linear interpolation onto a regular grid of as many rows over the same time.
fn resample(time_s: &[f64], values: &[f64], period: f64) -> Vec<f64> {
    let mut row = 0;
    (0..time_s.len())
        .map(|i| {
            let t = time_s[0] + i as f64 * period;
            while row + 2 < time_s.len() && time_s[row + 1] < t {
                row += 1;
            }
            let share = (t - time_s[row]) / (time_s[row + 1] - time_s[row]);
            values[row] + share * (values[row + 1] - values[row])
        })
        .collect()
}

/// The share of a sine that a zero-phase cut-off leaves: a Butterworth filter of fourth order there and back.
#[must_use]
pub fn passed(hz: f64, cutoff_hz: f64) -> f64 {
    1.0 / (1.0 + (hz / cutoff_hz).powi(8))
}

/// A regular series without what lies above a cut-off, unshifted: the band in which a [`Motion`] is known.
#[must_use]
pub fn smoothed(values: Vec<f64>, period: f64, cutoff_hz: f64) -> Vec<f64> {
    let n = values.len();
    if n < FEWEST_ROWS {
        return values;
    }
    let (mut x, pad) = low_passed(values, period, cutoff_hz);
    x.truncate(pad + n);
    x.drain(..pad);
    x
}

/// Smoothed series with some rows before and after it, and how many there are before it.
fn low_passed(values: Vec<f64>, period: f64, cutoff_hz: f64) -> (Vec<f64>, usize) {
    let n = values.len();
    // Six periods of the cut-off: the filter has forgotten its start by then.
    let pad = ((6.0 / (cutoff_hz * period)) as usize).clamp(4, n - 1);
    // Beyond its ends the series goes on by point reflection, which keeps the speed but would turn the acceleration over:
    // twice the bend there is put on top. Value and bend come from a parabola through two periods of the cut-off.
    let window = ((2.0 / (cutoff_hz * period)) as usize).clamp(8, n);
    let head = parabola(&values[..window]);
    let turned: Vec<f64> = values[n - window..].iter().rev().copied().collect();
    let tail = parabola(&turned);
    let beyond = |(value, bend): (f64, f64), k: usize, mirror: f64| 2.0 * value - mirror + bend * (k * k) as f64;
    let before: Vec<f64> = (1..=pad).rev().map(|k| beyond(head, k, values[k])).collect();
    let after: Vec<f64> = (1..=pad).map(|k| beyond(tail, k, values[n - 1 - k])).collect();
    let mut x = values;
    x.reserve_exact(2 * pad);
    x.extend(after);
    x.splice(0..0, before);
    for section in Section::butterworth4(cutoff_hz * period) {
        section.run(&mut x);
        x.reverse();
        section.run(&mut x);
        x.reverse();
    }
    (x, pad)
}

/// Value and second derivative (per row squared) at the first row of the parabola nearest to the values.
fn parabola(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let place = |i: usize| 2.0 * i as f64 / (n - 1.0) - 1.0;
    let places = || (0..values.len()).map(place);
    let square = places().map(|s| s * s).sum::<f64>() / n;
    // Orthogonal on the rows: 1, s, s² − mean s².
    let part = |shape: &dyn Fn(f64) -> f64| {
        let (dot, norm) = places()
            .zip(values)
            .fold((0.0, 0.0), |(dot, norm), (s, x)| (dot + shape(s) * x, norm + shape(s) * shape(s)));
        dot / norm
    };
    let (level, slope, bend) = (part(&|_| 1.0), part(&|s| s), part(&|s| s * s - square));
    let per_row = 2.0 / (n - 1.0);
    (level - slope + bend * (1.0 - square), 2.0 * bend * per_row * per_row)
}

/// Second-order low-pass section, unity gain at rest.
struct Section {
    b0: f64,
    a1: f64,
    a2: f64,
}

impl Section {
    /// The two sections of a fourth-order Butterworth low-pass by the bilinear transform; `cutoff` in cycles per sample.
    fn butterworth4(cutoff: f64) -> [Section; 2] {
        let w = (PI * cutoff.clamp(1e-6, 0.49)).tan();
        [PI / 8.0, 3.0 * PI / 8.0].map(|angle| {
            let damping = 2.0 * angle.cos();
            let norm = 1.0 / (1.0 + damping * w + w * w);
            Section { b0: w * w * norm, a1: 2.0 * (w * w - 1.0) * norm, a2: (1.0 - damping * w + w * w) * norm }
        })
    }

    /// Filters in place, as if the first value had stood for ever.
    fn run(&self, values: &mut [f64]) {
        let offset = values.first().copied().unwrap_or(0.0);
        let (mut s1, mut s2) = (0.0, 0.0);
        for value in values {
            let x = *value - offset;
            let y = self.b0 * x + s1;
            s1 = 2.0 * self.b0 * x - self.a1 * y + s2;
            s2 = self.b0 * x - self.a2 * y;
            *value = y + offset;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::noise::uniform_noise as noise;
    use super::*;

    #[test]
    fn a_sine_keeps_phase_and_its_derivatives_are_exact_to_the_filter_s_gain() {
        let (hz, n) = (3.0, 4000);
        let time: Vec<f64> = (0..n).map(|i| f64::from(i) * 1e-3).collect();
        let position: Vec<f64> = time.iter().map(|t| 50.0 * (TAU * hz * t).sin()).collect();
        let motion = Motion::with_cutoff(&time, &position, Some(60.0)).unwrap();
        let w = TAU * hz;
        for i in 300..3700 {
            let t = time[i];
            assert!((motion.velocity(i) / (50.0 * w) - (w * t).cos()).abs() < 1e-4);
            assert!((motion.acceleration(i) / (50.0 * w * w) + (w * t).sin()).abs() < 1e-4);
        }
    }

    #[test]
    fn a_recording_may_begin_and_end_in_full_acceleration() {
        let time: Vec<f64> = (0..2000).map(|i| f64::from(i) * 1e-3).collect();
        let position: Vec<f64> = time.iter().map(|t| 7.0 - 30.0 * t + 400.0 * t * t).collect();
        let motion = Motion::with_cutoff(&time, &position, Some(60.0)).unwrap();
        for (row, t) in time.iter().enumerate() {
            let (v, a) = (motion.velocity(row), motion.acceleration(row));
            assert!((v - (800.0 * t - 30.0)).abs() < 0.5 && (a - 800.0).abs() < 8.0, "{t}: {v}, {a}");
        }
    }

    #[test]
    fn half_the_amplitude_is_left_at_the_cutoff() {
        let time: Vec<f64> = (0..4000).map(|i| f64::from(i) * 1e-3).collect();
        let position: Vec<f64> = time.iter().map(|t| (TAU * 40.0 * t).sin()).collect();
        let motion = Motion::with_cutoff(&time, &position, Some(40.0)).unwrap();
        let left = motion.position[500..3500].iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        assert!((left - 0.5).abs() < 0.01, "{left}");
    }

    #[test]
    fn irregular_rows_give_the_same_motion() {
        let jitter = noise(5000);
        let time: Vec<f64> = (0..5000).map(|i| (i as f64 + 0.2 * jitter[i]) * 1e-3).collect();
        let position: Vec<f64> = time.iter().map(|t| 10.0 * (TAU * 1.5 * t).sin()).collect();
        let motion = Motion::with_cutoff(&time, &position, Some(30.0)).unwrap();
        let w = TAU * 1.5;
        let error = rms((400..4600).map(|i| motion.acceleration(i) + 10.0 * w * w * (w * time[i]).sin()));
        assert!(error < 0.01 * 10.0 * w * w, "{error}");
    }

    #[test]
    fn too_few_rows_are_refused() {
        assert!(Motion::estimate(&[0.0; 3], &[0.0; 3]).is_none());
    }

    #[test]
    fn stretches_share_one_cut_off_wherever_the_axis_stands_in_the_longest() {
        // Swinging at 5 Hz with noise; the longest stretch is one in which it stands.
        let (n, period) = (40_000, 1e-3);
        let noise = noise(n);
        let time: Vec<f64> = (0..n).map(|i| i as f64 * period).collect();
        let swing = |i: usize| 20.0 * (TAU * 5.0 * time[i]).sin() + 1e-4 * noise[i];
        let moving: Vec<f64> = (0..n).map(swing).collect();
        let whole = Motion::estimate(&time, &moving).unwrap().cutoff_hz;
        let stands = 10_000..22_000;
        let some: Vec<f64> = (0..n).map(|i| if stands.contains(&i) { 1e-4 * noise[i] } else { moving[i] }).collect();
        let stretches = [0..9_900, stands, 22_100..31_000, 31_200..n];
        let cut = Motion::of_stretches(&time, &some, &stretches).unwrap().cutoff_hz;
        assert!(cut > 0.8 * whole && cut < 1.1 * whole, "{cut} Hz, the whole {whole} Hz");
    }
}
