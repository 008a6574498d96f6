//! How late the torque column is against the torque that the motion asks for: by its sampling, and by a logging delay.
//!
//! The servo's output u steps at the start of a cycle Ts and the motor follows with its time constant τ, so that inside a cycle
//! T(f·Ts) = u + (T(0) − u)·e^(−r·f), r = Ts/τ. A torque that is caught there is a mean of those at both ends of the cycle:
//! at a logging delay of n + f cycles a row holds (1 − w)·T₋ₙ + w·T₋ₙ₋₁ with w = (e^(−r·(1−f)) − e^(−r))/(1 − e^(−r)).
//! To the second order that is T later by n + w cycles, and flattened by w·(1 − w)/2 of its second difference.

use crate::machine::{Axis, Servo};

/// Timing of the torque column of one recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lateness {
    /// Late by sampling alone, s.
    pub by_sampling_s: f64,
    /// Servo cycle in s and Ts/τ (0 where no time constant is known), where rows are cycles or every so many of them.
    cycle: Option<(f64, f64)>,
}

impl Lateness {
    /// That of rows of this period.
    ///
    /// When the servo's output steps at a row, the rows show 1 − e^(−k·Ts/τ) from there on, a step that is centred
    /// Ts/(1 − e^(−Ts/τ)) − Ts/2 later; the torque itself is centred τ later, and that is what the motion shows. The
    /// difference is half a cycle without a lag, and goes to nothing where the motor is slow. It holds for rows that are
    /// cycles, or every so many cycles; faster rows, or rows of another clock, meet the torque at all phases of the cycle and
    /// are late by nothing.
    #[must_use]
    pub fn of(axis: &Axis, row_period_s: f64) -> Self {
        let none = Self { by_sampling_s: 0.0, cycle: None };
        let Some(servo) = &axis.servo else { return none };
        let (period, lag) = (servo.period_s, servo.torque_time_constant_s);
        let cycles = row_period_s / period;
        if cycles < 0.99 || (cycles - cycles.round()).abs() > 0.01 {
            return none;
        }
        let rate = Self::rate(servo);
        let seen = if rate > 0.0 { period / (1.0 - (-rate).exp()) } else { period };
        Self { by_sampling_s: seen - 0.5 * period - lag, cycle: Some((period, rate)) }
    }

    /// Ts/τ of a servo; 0 where no time constant is known.
    pub(super) fn rate(servo: &Servo) -> f64 {
        if servo.torque_time_constant_s > 0.0 { servo.period_s / servo.torque_time_constant_s } else { 0.0 }
    }

    /// How much later the column is by a logging delay, s.
    #[must_use]
    pub fn of_delay(&self, delay_s: f64) -> f64 {
        let Some((period, rate)) = self.cycle else { return delay_s };
        let (whole, part) = split(delay_s / period);
        period * (whole + share_of_earlier(rate, part))
    }

    /// The logging delay by which the column is so much later, s; the inverse of [`Lateness::of_delay`], but of whole cycles
    /// where torque goes in steps and the rest of a cycle would not be seen.
    #[must_use]
    pub fn delay_of(&self, late_s: f64) -> f64 {
        let Some((period, rate)) = self.cycle else { return late_s };
        let (whole, part) = split(late_s / period);
        period * (whole + place(rate, part))
    }

    /// By which share of its second derivative in time a column that is so much later by a delay is flattened, s².
    #[must_use]
    pub fn flattened_s2(&self, late_s: f64) -> f64 {
        let Some((period, _)) = self.cycle else { return 0.0 };
        let (_, part) = split(late_s / period);
        0.5 * part * (1.0 - part) * period * period
    }
}

/// Whole cycles and the rest, to a millionth, so that a delay of whole cycles is one.
fn split(cycles: f64) -> (f64, f64) {
    let cycles = (cycles * 1e6).round() / 1e6;
    (cycles.floor(), cycles - cycles.floor())
}

/// Ts/τ below which torque goes along a straight line from cycle to cycle; the exponentials would lose their digits. It also
/// stands for a time constant that is not known: what lies between the rows is open then.
const STRAIGHT: f64 = 1e-3;

/// Ts/τ above which torque goes in steps, and the share of a step up to which nobody can say whether a column is late by whole
/// cycles or by nearly one more: within its step the torque stands. Logs are late by whole cycles as a rule.
const STEPS: f64 = 4.0;
const UNSEEN: f64 = 0.03;

/// The share w of the earlier end of the cycle in a torque caught a part f of a cycle before its later end.
pub(super) fn share_of_earlier(rate: f64, part: f64) -> f64 {
    if rate < STRAIGHT {
        return part;
    }
    ((-rate * (1.0 - part)).exp() - (-rate).exp()) / -(-rate).exp_m1()
}

/// The part f of a cycle at which the earlier end has the share w.
fn place(rate: f64, share: f64) -> f64 {
    if rate < STRAIGHT || rate > STEPS && share < UNSEEN {
        return share;
    }
    1.0 + (share + (1.0 - share) * (-rate).exp()).ln() / rate
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(rate: f64) -> Lateness {
        Lateness { by_sampling_s: 0.0, cycle: Some((1e-3, rate)) }
    }

    #[test]
    fn delay_and_lateness_are_inverse_and_agree_at_whole_cycles() {
        for rate in [0.0, 1e-4, 0.3, 2.0, 20.0] {
            for k in -30..30 {
                let late = 1e-4 * f64::from(k);
                // A millionth of a cycle, to which both are rounded, is up to Ts/τ as much of the other.
                assert!((at(rate).of_delay(at(rate).delay_of(late)) - late).abs() < 2e-8, "{rate} {late}");
            }
            assert_eq!([-2.0, 0.0, 3.0].map(|n| at(rate).of_delay(1e-3 * n)), [-2e-3, 0.0, 3e-3]);
        }
    }

    #[test]
    fn where_torque_goes_in_steps_a_delay_is_of_whole_cycles() {
        // A fiftieth of a cycle is what noise leaves open, not four fifths of the next.
        assert!((at(20.0).delay_of(2.02e-3) - 2.02e-3).abs() < 1e-9);
        assert!((at(20.0).delay_of(2.10e-3) - 2.88e-3).abs() < 1e-5);
        assert!((at(2.0).delay_of(2.02e-3) - 2.06e-3).abs() < 1e-5);
    }

    /// A motor's torque in small steps of time, caught where the delay says.
    #[test]
    fn a_caught_torque_is_the_mean_of_the_ends_of_its_cycle() {
        let (rate, delay) = (1.7_f64, 2.3);
        let asked = |cycle: usize| (0.4 * cycle as f64).sin();
        let mut starts = vec![0.0];
        for cycle in 0..20 {
            let torque: f64 = starts[cycle];
            starts.push(asked(cycle) + (torque - asked(cycle)) * (-rate).exp());
        }
        let caught = |row: usize| {
            let place = row as f64 - delay;
            let cycle = place as usize;
            asked(cycle) + (starts[cycle] - asked(cycle)) * (-rate * place.fract()).exp()
        };
        let w = share_of_earlier(rate, 0.3);
        for row in 5..20 {
            assert!((caught(row) - (1.0 - w) * starts[row - 2] - w * starts[row - 3]).abs() < 1e-12);
        }
        let late = at(rate).of_delay(1e-3 * delay);
        assert!((late - 1e-3 * (2.0 + w)).abs() < 1e-12 && late < 1e-3 * delay);
        assert!((at(rate).flattened_s2(late) - 0.5e-6 * w * (1.0 - w)).abs() < 1e-12);
    }
}
