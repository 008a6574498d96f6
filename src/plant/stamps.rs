//! When the rows of a recording were taken, by their time stamps and by the motion.

use super::motion::FEWEST_ROWS;
use std::borrow::Cow;

/// Whether rows are equidistant to a share of their period.
#[must_use]
pub fn are_even(time_s: &[f64], share: f64) -> bool {
    on_a_grid(time_s, |row| row, share)
}

/// Whether rows lie on an even grid, each at its place, to a share of its period.
fn on_a_grid(time_s: &[f64], place: impl Fn(usize) -> usize, share: f64) -> bool {
    let (Some(first), Some(last)) = (time_s.first(), time_s.last()) else { return true };
    let period = (last - first) / place(time_s.len() - 1).max(1) as f64;
    time_s.iter().enumerate().all(|(i, t)| (t - first - place(i) as f64 * period).abs() <= share * period)
}

/// When the rows of one stretch were taken, s. A time that is written when a row is stored may scatter, while a servo takes rows
/// evenly; another recorder takes them when it says. The motion tells: at the right times it is smoother, each row nearer to
/// the cubic through its neighbours. Where that makes no difference, rows are even: the line of least squares through times.
#[must_use]
pub fn times_of_rows<'t>(time_s: &'t [f64], position: &[f64]) -> Cow<'t, [f64]> {
    match times_on_a_grid(time_s, |row| row, position) {
        Some(times) => times,
        None => Cow::Borrowed(time_s),
    }
}

/// The same of rows of which some are missing, each with its place among all, from 0; `None` where they were taken as stamped.
#[must_use]
pub fn times_on_a_grid<'t>(
    time_s: &'t [f64],
    place: impl Fn(usize) -> usize,
    position: &[f64],
) -> Option<Cow<'t, [f64]>> {
    let n = time_s.len();
    if on_a_grid(time_s, &place, 1e-3) {
        return Some(Cow::Borrowed(time_s));
    }
    if n < FEWEST_ROWS {
        return None;
    }
    let (mut stamped, mut even) = (0.0, 0.0);
    for (i, (t, x)) in time_s.windows(5).zip(position.windows(5)).enumerate() {
        if place(i + 4) == place(i) + 4 {
            stamped += beside_cubic([t[0], t[1], t[2], t[3], t[4]], x).powi(2);
            even += beside_cubic([0.0, 1.0, 2.0, 3.0, 4.0], x).powi(2);
        }
    }
    if stamped < even {
        return None;
    }
    let places = || (0..n).map(|row| place(row) as f64);
    let middle = places().sum::<f64>() / n as f64;
    let mean = time_s.iter().map(|t| t - time_s[0]).sum::<f64>() / n as f64;
    let along: f64 = places().zip(time_s).map(|(at, t)| (at - middle) * (t - time_s[0])).sum();
    let period = along / places().map(|at| (at - middle).powi(2)).sum::<f64>();
    Some(places().map(|at| time_s[0] + mean + (at - middle) * period).collect())
}

/// How far the middle one of five rows is from the cubic through the others.
fn beside_cubic(t: [f64; 5], x: &[f64]) -> f64 {
    let weight = |k: usize| -> f64 {
        [0, 1, 3, 4]
            .into_iter()
            .filter(|&other| other != k)
            .map(|other| (t[2] - t[other]) / (t[k] - t[other]))
            .product()
    };
    x[2] - [0, 1, 3, 4].into_iter().map(|k| weight(k) * x[k]).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::super::noise::uniform_noise as noise;
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn the_motion_tells_when_rows_were_taken() {
        let scatter = noise(5000);
        let even: Vec<f64> = (0..5000).map(|i| i as f64 * 1e-3).collect();
        for share in [0.004, 0.03, 0.3] {
            let written: Vec<f64> = even.iter().zip(&scatter).map(|(t, e)| t + share * 1e-3 * e).collect();
            let swing = |times: &[f64]| -> Vec<f64> { times.iter().map(|t| 10.0 * (TAU * 1.5 * t).sin()).collect() };
            assert_eq!(*times_of_rows(&written, &swing(&written)), *written);
            let found = times_of_rows(&written, &swing(&even));
            assert!(are_even(&found, 1e-9) && found.iter().zip(&even).all(|(f, t)| (f - t).abs() < share * 1e-4));
            // At rest nobody can tell, and nothing depends on it.
            assert!(are_even(&times_of_rows(&written, &[3.0; 5000]), 1e-9));
        }
    }

    #[test]
    fn rows_with_holes_between_them_lie_on_one_grid() {
        let kept: Vec<usize> = (0..5000).filter(|i| i % 500 != 250).collect();
        let written: Vec<f64> =
            noise(kept.len()).iter().zip(&kept).map(|(e, i)| 1e-3 * (*i as f64 + 0.1 * e)).collect();
        let swing: Vec<f64> = kept.iter().map(|i| 10.0 * (TAU * 1.5e-3 * *i as f64).sin()).collect();
        let found = times_on_a_grid(&written, |row| kept[row], &swing).unwrap();
        assert!(found.iter().zip(&kept).all(|(t, i)| (t - 1e-3 * *i as f64).abs() < 1e-5));
    }
}
