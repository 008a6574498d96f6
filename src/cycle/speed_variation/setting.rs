//! What the cycles of a variation go by: all that follows from mean speed, amplitude, period and load.
//!
//! It is worked out a piece a cycle, so that a change costs no cycle much; meanwhile the setting before goes on.

use super::limit::{Limit, Motor, POWER_ROUNDS, SLOPE_ROUNDS};
use super::plan::Plan;
use crate::cycle::turns::cos_sin;

/// What the kernel asks for: mean speed (rad/s), amplitude (share of it), period (s), cutting torque (N·m).
pub type Asked = [f64; 4];

/// The piece that is due.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Piece {
    /// A round toward the moment of a sine's largest power; ends in its cycle, as the others do. How many are left after it.
    Power(u8),
    /// Largest amplitude.
    Amplitude,
    /// A round toward the moment at which a sine is steepest for the motor. How many are left after it.
    Slope(u8),
    /// Shortest period.
    Period,
    /// Corner speeds and rates.
    Corners,
    /// Speeds up to which the motor has enough, and the turn of a sine's phasor.
    Rest,
    /// All is there, for the cycles to go by.
    Whole,
    /// Nothing is due; ends with a change of what is asked for.
    Nothing,
}

/// Speeds in rad/s, positive in the sense of rotation.
#[derive(Debug, Clone, Copy)]
pub struct Setting {
    /// What it is for.
    pub asked: Asked,
    /// The moment of a sine that is being found.
    moment: Option<f64>,
    /// Amplitude in effect, and the largest and what limits it.
    pub granted: f64,
    /// See `granted`.
    pub possible: f64,
    /// See `granted`.
    pub limit: Limit,
    /// Shortest period, s; 0: none.
    pub shortest: f64,
    /// Corner speeds of a triangle, its change of speed in a cycle, and the highest speeds at which the motor can rise and brake
    /// at that rate.
    pub corners: [f64; 2],
    /// See `corners`.
    pub rate: f64,
    /// See `corners`.
    pub free: [f64; 2],
    /// A sine's swing, its change in a cycle, and cosine and sine of half the angle that its phasor turns in a cycle.
    pub swing: f64,
    /// See `swing`.
    pub swing_rate: f64,
    /// See `swing`.
    pub half: [f64; 2],
}

impl Setting {
    /// Standing at a mean speed (rad/s).
    #[must_use]
    pub fn still(mean: f64) -> Setting {
        Setting {
            asked: [mean, 0.0, 0.0, 0.0],
            moment: None,
            granted: 0.0,
            possible: 0.0,
            limit: Limit::Nothing,
            shortest: 0.0,
            corners: [mean; 2],
            rate: 0.0,
            free: [0.0; 2],
            swing: 0.0,
            swing_rate: 0.0,
            half: [1.0, 0.0],
        }
    }

    /// Begins anew; returns the first piece.
    pub fn begin(&mut self, plan: &Plan, asked: Asked) -> Piece {
        (self.asked, self.moment) = (asked, None);
        if plan.in_rounds() { Piece::Power(POWER_ROUNDS - 1) } else { Piece::Amplitude }
    }

    /// Works out one piece; returns the next.
    pub fn work(&mut self, plan: &Plan, piece: Piece) -> Piece {
        let [mean, amplitude, period, cutting] = self.asked;
        let motor = plan.motor_cutting(cutting);
        match piece {
            Piece::Power(left) => {
                self.moment = Some(motor.power_moment(mean, period, self.moment));
                if left > 0 { Piece::Power(left - 1) } else { Piece::Amplitude }
            }
            Piece::Amplitude => {
                (self.possible, self.limit) = plan.possible(&motor, mean, period, self.moment.unwrap_or(0.0));
                self.granted = amplitude.min(self.possible);
                self.moment = None;
                if plan.in_rounds() { Piece::Slope(SLOPE_ROUNDS - 1) } else { Piece::Period }
            }
            Piece::Slope(left) => {
                self.moment = Some(motor.slope_moment(mean, amplitude, self.moment));
                if left > 0 { Piece::Slope(left - 1) } else { Piece::Period }
            }
            Piece::Period => {
                self.shortest = plan.shortest(&motor, mean, amplitude, self.moment.unwrap_or(0.0));
                Piece::Corners
            }
            Piece::Corners => {
                let granted = self.granted;
                self.corners = [mean * (1.0 - granted), mean * (1.0 + granted)];
                self.swing = granted * mean;
                self.swing_rate = self.swing * plan.cycle_s / period;
                self.rate = corner_rate(plan, &motor, self.corners[0]).min(4.0 * self.swing_rate);
                Piece::Rest
            }
            Piece::Rest => {
                let (driving, torque) = (plan.driving(motor), self.rate / plan.change_per_nm());
                self.free = [0.0, plan.brake_help(motor.used)].map(|help| driving.fastest(torque - help));
                let (_, sin) = cos_sin(0.5 * plan.cycle_s / period);
                self.half = [(1.0 - sin * sin).sqrt(), sin];
                Piece::Whole
            }
            Piece::Whole | Piece::Nothing => Piece::Nothing,
        }
    }
}

/// Largest change in a cycle whose overshoot behind the lower corner the motor's power still allows. Of a swing of more
/// than 2 % it bounds nothing: the power is used up at the top.
fn corner_rate(plan: &Plan, motor: &Motor, low: f64) -> f64 {
    const OVERSHOOT: f64 = 0.042;
    let Motor { power, used, viscous, .. } = plan.driving(*motor);
    let left = power / low - used - viscous * low;
    left.max(0.0) * plan.change_per_nm() / (1.0 + OVERSHOOT)
}
