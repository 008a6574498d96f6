//! The spindle's angle: how far it turned, how fast, and cos kθ, sin kθ of every harmonic.
//!
//! cos and sin of the measured angle come from a polynomial, those of its multiples from products:
//! e^(j(k+4)θ) = e^(jkθ)·e^(j4θ). Nothing is carried from cycle to cycle, so nothing drifts, and every cycle costs the same.

use super::harmonic::{Lanes, VECTORS};
use super::plan::Plan;
use crate::cycle::turns::{cos_sin, fold};

/// Largest relative change of speed in a cycle that the harmonics follow.
const CHANGE_MAX: f64 = 0.02;

/// cos kθ and sin kθ for k = 1 to 16.
#[derive(Debug, Clone, Copy, Default)]
pub struct Wheel {
    /// cos kθ.
    pub cos: [Lanes; VECTORS],
    /// sin kθ.
    pub sin: [Lanes; VECTORS],
}

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
    /// Relative change of `rate` in this cycle.
    pub change: f64,
    /// Angles read so far, up to 2: the first two give the speed to start from.
    known: u32,
}

impl Spindle {
    /// Takes the angle of a cycle, in degrees; returns false when it is no number or jumps, and turns on as before.
    #[inline(always)]
    pub fn read(&mut self, plan: &Plan, angle_deg: f64) -> bool {
        let angle = fold(angle_deg * (1.0 / 360.0));
        let turned = if self.known > 0 { fold(angle - self.angle) } else { 0.0 };
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
        let before = self.rate;
        let faster = plan.speed_share * (self.turned - before);
        // Flushes what decays towards zero before it is subnormal.
        self.rate = (before + faster + 1e-12) - 1e-12;
        let relative = faster / if before.abs() > plan.rate_min { before } else { 1.0 };
        self.change = if relative.abs() < CHANGE_MAX { relative } else { 0.0 };
        good
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

    /// cos and sin of the angle's multiples; `vectors` times four of them.
    #[inline(always)]
    #[must_use]
    pub fn wheel(&self, vectors: usize) -> Wheel {
        Wheel::at(fold(self.angle + self.jumped), vectors)
    }
}

impl Wheel {
    /// cos and sin of the multiples of an angle of −0.5 to 0.5 turns; `vectors` times four of them.
    #[inline(always)]
    #[must_use]
    pub fn at(turns: f64, vectors: usize) -> Wheel {
        let (cos, sin) = cos_sin(turns);
        let (cos, sin) = (cos as f32, sin as f32);
        let (cos2, sin2) = (cos * cos - sin * sin, 2.0 * sin * cos);
        let (cos3, sin3) = (cos2 * cos - sin2 * sin, sin2 * cos + cos2 * sin);
        let (cos4, sin4) = (cos2 * cos2 - sin2 * sin2, 2.0 * sin2 * cos2);
        let mut wheel = Wheel::default();
        let (mut c, mut s) = (Lanes([cos, cos2, cos3, cos4]), Lanes([sin, sin2, sin3, sin4]));
        let (turn_cos, turn_sin) = (Lanes([cos4; 4]), Lanes([sin4; 4]));
        for (to_cos, to_sin) in wheel.cos.iter_mut().zip(&mut wheel.sin).take(vectors) {
            (*to_cos, *to_sin) = (c, s);
            (c, s) = (c.times(turn_cos).minus(s.times(turn_sin)), s.times(turn_cos).plus(c.times(turn_sin)));
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
            let wheel = spindle.wheel(VECTORS);
            for k in 0..16 {
                let angle = core::f64::consts::TAU * spindle.angle * (k + 1) as f64;
                let (c, s) = (wheel.cos[k / 4].0[k % 4], wheel.sin[k / 4].0[k % 4]);
                let error = (f64::from(c) - angle.cos()).abs().max((f64::from(s) - angle.sin()).abs());
                assert!(error < 1e-5, "harmonic {} at {i}: {error:e}", k + 1);
            }
        }
    }
}
