//! What the rows of the torque column say about the torque between them.
//!
//! A second difference of positions is the mean of the acceleration over one row to either side, weighted by a triangle. The
//! same mean of the torque is taken, from its rows before, at and after the middle.
//!
//! - Rows that are servo cycles: the output u steps at a row and the motor follows with its time constant τ, so that between
//!   two rows T(u·Ts) = T₀ + (T₁ − T₀)·(1 − e^(−r·u))/(1 − e^(−r)), r = Ts/τ. The weights are the integrals of that under the
//!   triangle; they are not even, which is how late the column is by sampling.
//! - Other rows: what is smooth between them has (1, 10, 1)/12, exact to the fourth order (Numerov), and is late by what
//!   [`Lateness`] says.
//! - Without a servo nobody knows what the drive puts into a row: the torque at its instant, as the cycle before has left it,
//!   or that of the cycle that begins. A torque that is held over a cycle is half a row late in the one and half a row early
//!   in the other; a motor with a lag lies between. So much is a property of the rows, and no dead time.

use super::frame::Columns;
use crate::machine::Axis;
use crate::plant::lateness::Lateness;

/// The triangular mean of what is smooth between rows.
pub const NUMEROV: [f64; 3] = [1.0 / 12.0, 10.0 / 12.0, 1.0 / 12.0];

/// How the torque column was sampled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sampling {
    /// Weights of the rows before, at and after in the triangular mean.
    pub weights: [f64; 3],
    /// How late the column is beyond what the weights hold, s.
    pub shift_s: f64,
    /// What is known of that.
    pub timing: Timing,
}

/// What is known of how late a torque column is by its sampling.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Timing {
    /// All: what is late beyond it is a dead time.
    Known,
    /// Nothing: it may be late or early by this much, s.
    Within(f64),
    /// Nothing, and what was found of it has been taken off.
    Aligned,
}

impl Sampling {
    /// That of an axis's columns.
    #[must_use]
    pub fn of(axis: &Axis, columns: &Columns) -> Self {
        let recorded = columns.recorded_period_s;
        let whole = (columns.period_s / recorded - 1.0).abs() < 1e-9;
        match &axis.servo {
            Some(servo) if whole && (recorded / servo.period_s - 1.0).abs() < 0.01 => {
                let weights = of_cycles(servo.period_s, servo.torque_time_constant_s);
                Self { weights, shift_s: 0.0, timing: Timing::Known }
            }
            Some(_) => {
                let shift_s = Lateness::of(axis, recorded).by_sampling_s;
                Self { weights: NUMEROV, shift_s, timing: Timing::Known }
            }
            None => Self { weights: NUMEROV, shift_s: 0.0, timing: Timing::Within(0.5 * recorded) },
        }
    }

    /// The same of a column that was found to be late by so much more, s, in whatever way its rows were sampled.
    #[must_use]
    pub fn aligned(self, late_s: f64) -> Self {
        Self { shift_s: self.shift_s + late_s, timing: Timing::Aligned, ..self }
    }

    /// Standard deviation of a dead time by what is not known of the sampling, s: anywhere within the limits alike.
    #[must_use]
    pub fn deviation_s(&self) -> f64 {
        if let Timing::Within(most_s) = self.timing { most_s / 3f64.sqrt() } else { 0.0 }
    }
}

/// Weights of rows that are servo cycles.
fn of_cycles(period_s: f64, time_constant_s: f64) -> [f64; 3] {
    let r = period_s / time_constant_s;
    // A motor this slow goes along a straight line; the integrals would lose their digits. Without a lag it steps.
    let [before, after] = match r {
        r if r < 0.02 => [1.0 / 6.0; 2],
        r if r > 500.0 => [0.0, 0.5],
        r => {
            let (left, gone) = ((-r).exp(), -(-r).exp_m1());
            let falling = (r - gone) / (r * r);
            let rising = (gone - r * left) / (r * r);
            [0.5 - (0.5 - rising) / gone, (0.5 - falling) / gone]
        }
    };
    [before, 1.0 - before - after, after]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_go_from_the_step_to_the_straight_line_and_have_the_known_shift() {
        let near = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 3e-3);
        assert!(near(of_cycles(1e-3, 0.0), [0.0, 0.5, 0.5]) && near(of_cycles(1e-3, 2.1e-6), [0.0, 0.5, 0.5]));
        assert!(near(of_cycles(1e-3, 0.2), [1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0]));
        for lag in [2e-4, 5e-4, 1e-3, 4e-3] {
            let [before, _, after] = of_cycles(1e-3, lag);
            let shift = 1e-3 / (1.0 - (-1e-3f64 / lag).exp()) - 0.5e-3 - lag;
            assert!(((after - before) * 1e-3 - shift).abs() < 1e-12, "{lag}");
        }
    }

    /// Against the integral itself, in small steps.
    #[test]
    fn weights_are_the_mean_of_the_torque_that_the_servo_makes() {
        let (period, lag) = (1e-3, 6e-4);
        let asked = [0.3, -1.2];
        let torque = |t: f64, before: f64, asked: f64| asked + (before - asked) * (-t / lag).exp();
        let rows = [0.7, torque(period, 0.7, asked[0]), torque(period, torque(period, 0.7, asked[0]), asked[1])];
        let n = 20_000;
        let mean: f64 = (0..2 * n)
            .map(|i| {
                let u = (f64::from(i) + 0.5) / f64::from(n);
                let way = if u < 1.0 {
                    torque(u * period, rows[0], asked[0])
                } else {
                    torque((u - 1.0) * period, rows[1], asked[1])
                };
                way * (1.0 - (u - 1.0).abs()) / f64::from(n)
            })
            .sum();
        let weighted: f64 = of_cycles(period, lag).iter().zip(rows).map(|(w, t)| w * t).sum();
        assert!((mean - weighted).abs() < 1e-6, "{mean} {weighted}");
    }
}
