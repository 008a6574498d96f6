//! The spindle's angle: how far it turned, how fast, and cos kθ, sin kθ of every harmonic.
//!
//! cos and sin of the measured angle and its double come from a polynomial, those of further multiples from products:
//! e^(j(k+2)θ) = e^(jkθ)·e^(j2θ). Nothing is carried from cycle to cycle, so nothing drifts, and every cycle costs the same.

use super::harmonic::PAIRS;
use super::plan::Plan;
use crate::cycle::lanes::{Lanes, swapped};
use crate::cycle::turns::{fold, folded};
use wide::f64x2;

/// Largest relative change of speed at once that the harmonics follow.
const CHANGE_MAX: f64 = 0.02;
/// Smallest: amplitudes are then within 0.2 % of what they should be, and what an encoder's grid does to the speed is none.
const CHANGE_MIN: f64 = 1.0 / 2048.0;

/// cos kθ and sin kθ for k = 1 to 16, two multiples in each: cos, sin, cos, sin.
#[derive(Debug, Clone, Copy, Default)]
pub struct Wheel(pub [Lanes; PAIRS]);

/// Angle and speed of the spindle.
#[derive(Debug, Clone, Copy, Default)]
pub struct Spindle {
    /// Angle read in this cycle in turns, −0.5 to 0.5.
    angle: f64,
    /// What jumps of the encoder have added to it: the harmonics turn on as if there had been none.
    jumped: f64,
    /// Filtered turns per cycle, signed.
    pub rate: f64,
    /// Turns in this cycle.
    pub turned: f64,
    /// The rate for which the harmonics stand.
    stand: f64,
    /// How far it may be from the present one, and how large any position may be.
    pub bounds: f64x2,
    /// Angles read so far, up to 2: the first two give the speed to start from.
    known: u32,
}

/// What a usual cycle reads.
#[derive(Debug, Clone, Copy)]
pub struct Turn {
    angle: f64,
    rate: f64,
    /// Turns in this cycle, without their sign.
    pub turned: f64,
    /// How far the speed is from the one known, and the position that came along, without their signs.
    pub bounded: f64x2,
}

impl Spindle {
    /// Takes the angle of a cycle, in degrees; returns false when it is no number or jumps, and turns on as before.
    #[inline(always)]
    pub fn read(&mut self, plan: &Plan, angle_deg: f64) -> bool {
        let angle = fold(angle_deg * (1.0 / 360.0));
        // 0 in the first cycle, and no number where the angle is none.
        let turned = if self.known > 0 { fold(angle - self.angle) } else { 0.0 * angle };
        let good = turned.abs() <= plan.turn_max;
        if good {
            self.angle = angle;
            self.turned = turned;
            if self.known < 2 {
                self.known += 1;
                self.rate = turned;
            }
        } else {
            self.lost(angle);
        }
        // Flushes what decays towards zero before it is subnormal.
        self.rate = (self.rate + plan.speed_share * (self.turned - self.rate) + 1e-12) - 1e-12;
        good
    }

    /// The rate for which the harmonics stand.
    #[inline(always)]
    #[must_use]
    pub fn stand(&self) -> f64 {
        self.stand
    }

    /// Whether the next cycle can be a usual one: steady in speed, no turn near the largest.
    #[must_use]
    pub fn steady(&self, plan: &Plan) -> bool {
        let [band, _] = self.bounds.to_array();
        self.stand.abs() + 2.0 * band / plan.speed_share <= plan.turn_max
    }

    /// Reads the angle of a usual cycle. It goes on from the last at the speed known if its `bounded` is within `bounds`.
    #[inline(always)]
    #[must_use]
    pub fn usual(&self, plan: &Plan, angle_deg: f64, scale: f64) -> Turn {
        let angle = folded(angle_deg * (1.0 / 360.0));
        let turned = folded(angle - self.angle);
        let rate = self.rate + plan.speed_share * (turned - self.rate);
        Turn { angle, rate, turned: turned.abs(), bounded: f64x2::new([rate - self.stand, scale]).abs() }
    }

    /// cos and sin of the multiples of an angle that was read.
    #[inline(always)]
    #[must_use]
    pub fn wheel_of(&self, turn: &Turn, pairs: usize) -> Wheel {
        Wheel::at(turn.angle + self.jumped, pairs)
    }

    /// Takes it for the present one.
    #[inline(always)]
    pub fn take(&mut self, turn: &Turn) {
        (self.angle, self.rate) = (turn.angle, turn.rate);
    }

    /// The harmonics stand for the present rate; returns its relative change if they are to follow that, else 0.
    pub fn change(&mut self, plan: &Plan) -> f64 {
        let change = self.rate - self.stand;
        let [band, _] = self.bounds.to_array();
        if change.abs() <= band {
            return 0.0;
        }
        let relative = if self.stand.abs() > plan.rate_min { change / self.stand } else { 0.0 };
        self.stand = self.rate;
        self.bounds = f64x2::new([CHANGE_MIN * self.stand.abs(), f64::MAX]);
        if relative.abs() < CHANGE_MAX { relative } else { 0.0 }
    }

    /// Turns on at the last speed. A jump is taken as the place from which to go on; what is no number is not.
    #[cold]
    fn lost(&mut self, angle: f64) {
        self.turned = self.rate;
        let on = self.angle + self.rate;
        let next = if angle.is_finite() { angle } else { fold(on) };
        self.jumped = fold(self.jumped + on - next);
        self.angle = next;
    }

    /// The encoder's zero counts again: nothing turns on any more.
    #[inline(always)]
    pub fn forget_jumps(&mut self) {
        self.jumped = 0.0;
    }

    /// cos and sin of the angle's multiples; `pairs` times two of them.
    #[inline(always)]
    #[must_use]
    pub fn wheel(&self, pairs: usize) -> Wheel {
        Wheel::at(self.angle + self.jumped, pairs)
    }
}

/// −sin 2πz = z·P(z²) for −1/4 ≤ z ≤ 1/4, error below 1e-8: by Chebyshev's nodes.
const SINE: [f32; 5] = [-core::f32::consts::TAU, 41.341_68, -81.602_48, 76.581_17, -39.759_827];

impl Wheel {
    /// cos and sin of the multiples of an angle of −1 to 1 turns; `pairs` times two of them.
    #[inline(always)]
    #[must_use]
    pub fn at(turns: f64, pairs: usize) -> Wheel {
        // Adding and taking away this rounds to whole numbers.
        let rounding = Lanes::splat(1.5 * (1u32 << 23) as f32);
        // sin 2πx = cos 2π(x − 1/4), and cos 2πx = −sin 2π(|x| − 1/4) for half a turn either way.
        let x = Lanes::splat(turns as f32) * Lanes::new([1.0, 1.0, 2.0, 2.0]) - Lanes::new([0.0, 0.25, 0.0, 0.25]);
        let z = (x - ((x + rounding) - rounding)).abs() - Lanes::splat(0.25);
        let y = z * z;
        let [a, b, c, d, e] = SINE;
        let mut now = Lanes::splat(e);
        for coefficient in [d, c, b, a] {
            now = now * y + Lanes::splat(coefficient);
        }
        now *= z;
        let [_, _, cos, sin] = now.to_array();
        let (turn_cos, turn_sin) = (Lanes::splat(cos), Lanes::splat(sin) * Lanes::new([-1.0, 1.0, -1.0, 1.0]));
        let mut wheel = Wheel::default();
        for pair in wheel.0.iter_mut().take(pairs) {
            *pair = now;
            now = now * turn_cos + swapped(now) * turn_sin;
        }
        wheel
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_multiple_is_right_at_every_angle() {
        for i in -2000..=2000 {
            let spindle = Spindle { angle: f64::from(i) / 4000.0, ..Spindle::default() };
            let wheel = spindle.wheel(PAIRS);
            for k in 0..16 {
                let angle = core::f64::consts::TAU * spindle.angle * (k + 1) as f64;
                let (c, s) = (wheel.0[k / 2].to_array()[2 * (k % 2)], wheel.0[k / 2].to_array()[2 * (k % 2) + 1]);
                let error = (f64::from(c) - angle.cos()).abs().max((f64::from(s) - angle.sin()).abs());
                assert!(error < 1e-5, "harmonic {} at {i}: {error:e}", k + 1);
            }
        }
    }
}
