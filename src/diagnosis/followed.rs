//! Torque that is tied to no coordinate, and that the axis follows all the same.
//!
//! Noise of a current sensor moves nothing. What acts on the axis does: the loop of the belief then misses the measured position, and
//! what is left of the torque is what the servo made of that miss, a sum of it, of its speed and of its integral.

use super::fit::{Bench, Fit};
use crate::analysis::statistics::reading_error;

/// Share of the variance of what is left that goes with the miss from which on the axis follows it.
const FOLLOWS: f64 = 0.1;
/// Least miss in units of what the encoder itself is off by: the encoder's noise, which is in both, is then a smaller share of it.
const LEAST_MISS: f64 = 3.2;
/// How long the integral remembers, s: as long as usual servos do.
const REMEMBERS_S: f64 = 0.1;

/// What is said of a rest that the axis follows.
pub const SAYS: &str = "what is left of the torque goes with no coordinate, and is no noise of its sensor: the axis follows it, and the closed loop misses the measured position by what it does";

/// Whether the axis follows what is left of the torque by a fit without a cause; `error` is measured less replayed position at
/// `time_s`, load units.
#[must_use]
pub fn is_followed(bench: &Bench, empty: &Fit, time_s: &[f64], error: &[f64], position: &[f64]) -> bool {
    let frame = bench.frame;
    let miss = at_rows(&frame.columns.time_s, frame.columns.period_s, time_s, error);
    let judged = frame.kept.iter().map(|&row| miss[row]);
    let mean_square = judged.map(|miss| miss * miss).sum::<f64>() / frame.kept.len().max(1) as f64;
    if !(mean_square.sqrt() > LEAST_MISS * reading_error(position)) {
        return false;
    }
    let (mut speed, mut integral) = (vec![0.0; miss.len()], vec![0.0; miss.len()]);
    let kept = (-frame.columns.period_s / REMEMBERS_S).exp();
    for stretch in &frame.columns.stretches {
        for i in stretch.clone().skip(1) {
            speed[i] = miss[(i + 1).min(stretch.end - 1)] - miss[i - 1];
            integral[i] = kept * integral[i - 1] + miss[i];
        }
    }
    let taken = bench.taken_by([miss, speed, integral].map(|values| frame.judged(&values)).into());
    taken > FOLLOWS * empty.residual[..bench.rows].iter().map(|rest| rest * rest).sum::<f64>()
}

/// The mean of values at `time_s` over each row of a period about its own time; 0 where none is known.
fn at_rows(rows_s: &[f64], period_s: f64, time_s: &[f64], values: &[f64]) -> Vec<f64> {
    let mut next = 0;
    let of_row = |&row: &f64| {
        let (mut sum, mut count) = (0.0, 0.0);
        while next < time_s.len() && time_s[next] < row + 0.5 * period_s {
            if time_s[next] >= row - 0.5 * period_s && values[next].is_finite() {
                sum += values[next];
                count += 1.0;
            }
            next += 1;
        }
        if count > 0.0 { sum / count } else { 0.0 }
    };
    rows_s.iter().map(of_row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_told_by_the_rows_that_they_lie_in() {
        let time: Vec<f64> = (0..12).map(|i| 0.25 * f64::from(i)).collect();
        let values: Vec<f64> = (0..12).map(|i| if i == 5 { f64::NAN } else { f64::from(i) }).collect();
        // Rows of four, of which the last two lie beyond what is known, or nearly.
        let means = at_rows(&[0.375, 1.375, 2.375, 9.0], 1.0, &time, &values);
        assert_eq!(means, [1.5, (4.0 + 6.0 + 7.0) / 3.0, 9.5, 0.0]);
    }
}
