//! The spindle's angle: how far it turned, how fast, and cos kθ, sin kθ of every harmonic.
//!
//! cos and sin of the measured angle and its double come from a polynomial, those of further multiples from products:
//! e^(j(k+2)θ) = e^(jkθ)·e^(j2θ). Nothing is carried from cycle to cycle, so nothing drifts, and every cycle costs the same.

use super::harmonic::PAIRS;
use super::plan::Plan;
use crate::cycle::lanes::{Lanes, swapped};
use crate::cycle::turns::{fold, folded};
use wide::f64x2;

/// Largest change of speed at once that is the spindle's own, relative to the one for which the harmonics stand.
const LEAP: f64 = 0.02;
/// Leaps are forgotten when so much of half the rate is left of them.
const LEAP_GONE: f64 = 1e-3;
/// How far the speed may be from that one, relative to it: a speed varied by 10 % stays within for good.
const BAND: f64 = 0.25;

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
    /// Part of the rate that leaps have brought: a glitch of the encoder, its grid, a cycle that came late. The filter forgets them, and
    /// so does this; were a leap left out and its way back counted, what grows with the speed would grow with every leap.
    leap: f64,
    /// The rate for which the harmonics stand, and its inverse.
    stand: f64,
    per_stand: f64,
    /// How far the present one may be from it; and a cycle's turn from the rate.
    pub bounds: f64x2,
    /// Angles read so far, up to 2: the first two give the speed to start from.
    known: u32,
    /// The last turn was one back, and not believed.
    doubted: bool,
}

/// What a usual cycle reads.
#[derive(Debug, Clone, Copy)]
pub struct Turn {
    angle: f64,
    rate: f64,
    /// Turns in this cycle, without their sign.
    pub turned: f64,
    /// How far the speed is from the one for which the harmonics stand, and this turn from the speed, without their signs.
    pub bounded: f64x2,
    /// As [`Spindle::growth`].
    pub growth: f32,
}

impl Spindle {
    /// Takes the angle of a cycle, in degrees; returns false when it is no number or jumps, and turns on as before.
    #[inline(always)]
    pub fn read(&mut self, plan: &Plan, angle_deg: f64) -> bool {
        let angle = fold(angle_deg * (1.0 / 360.0));
        // 0 in the first cycle, and no number where the angle is none.
        let turned = if self.known > 0 { fold(angle - self.angle) } else { 0.0 * angle };
        // Twice in a row it is the rate that is wrong, as after an angle that was.
        self.doubted = !self.doubted && self.turns_back(plan, turned);
        let good = turned.abs() <= plan.turn_max && !self.doubted;
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
        let rate = (self.rate + plan.speed_share * (self.turned - self.rate) + 1e-12) - 1e-12;
        self.see_leap(plan, rate);
        self.rate = rate;
        good
    }

    /// Whether this turn alone would take more than half off the rate of a spindle that turns: none does. It is what is left of whole turns
    /// where cycles are missing. A filter of few cycles follows a single turn, so that only one the other way round is told.
    #[inline(always)]
    fn turns_back(&self, plan: &Plan, turned: f64) -> bool {
        let rate = self.rate.abs();
        let slower = (self.rate - turned) * if self.rate < 0.0 { -plan.speed_share } else { plan.speed_share };
        rate >= plan.rate_min && slower > 0.5 * rate && slower > plan.speed_share * 2.0 * rate
    }

    /// A rate that comes: what leapt is no speed, and is forgotten as the filter does. No more than half of the rate, so that there is
    /// always a speed of the same sign.
    #[inline(always)]
    fn see_leap(&mut self, plan: &Plan, rate: f64) {
        // Before harmonics stand for a speed there is nothing to leap from.
        if self.stand == 0.0 {
            return;
        }
        let change = rate - self.rate;
        let most = 0.5 * rate.abs();
        self.leap -= plan.speed_share * self.leap;
        if change.abs() > LEAP * self.stand.abs() {
            self.leap += change;
        } else if self.leap.abs() < LEAP_GONE * most {
            self.leap = 0.0;
        }
        self.leap = self.leap.max(-most).min(most);
    }

    /// Turns per cycle without leaps, signed.
    #[inline(always)]
    #[must_use]
    pub fn speed(&self) -> f64 {
        self.rate - self.leap
    }

    /// Harmonics that can be followed at this speed. One beyond looks like one below in the samples, and would share what that one is.
    #[must_use]
    pub fn followed(&self, plan: &Plan) -> usize {
        let most = f64::from(plan.tracked[1]) / self.rate.abs().max(1e-6);
        plan.harmonics.min(most as usize)
    }

    /// Whether leaps are forgotten.
    #[must_use]
    pub fn calm(&self) -> bool {
        self.leap == 0.0
    }

    /// How a displacement has grown since the harmonics stood, with the square of the speed.
    #[inline(always)]
    #[must_use]
    pub fn growth(&self) -> f32 {
        let ratio = (self.speed() * self.per_stand) as f32;
        ratio * ratio
    }

    /// Change of the speed since it was `rate`, relative to the one for which the harmonics stand.
    #[inline(always)]
    #[must_use]
    pub fn change_since(&self, rate: f64) -> f64 {
        (self.speed() - rate) * self.per_stand
    }

    /// The harmonics stand for the present speed from now on.
    pub fn settle(&mut self, plan: &Plan) {
        // Where it does not turn, nothing is learnt that could grow.
        let speed = self.speed();
        (self.stand, self.per_stand) = (speed, if speed == 0.0 { 0.0 } else { 1.0 / speed });
        let stand = self.stand.abs();
        let band = (BAND * stand).min(0.5 * (plan.turn_max - stand));
        let leap = (LEAP * stand / plan.speed_share).min(plan.turn_max - stand - band);
        self.bounds = f64x2::new([band, leap]);
    }

    /// Whether the speed is far from the one for which the harmonics stand.
    #[must_use]
    pub fn far(&self) -> bool {
        let [band, _] = self.bounds.to_array();
        (self.speed() - self.stand).abs() > band
    }

    /// Reads the angle of a usual cycle, which it is if its `bounded` is within `bounds`: the turn is then no larger than the
    /// largest. What is `none` is 0, or no number where something else is none.
    #[inline(always)]
    #[must_use]
    pub fn usual(&self, plan: &Plan, angle_deg: f64, none: f64) -> Turn {
        let angle = folded(angle_deg * (1.0 / 360.0));
        let turned = folded(angle - self.angle);
        let ahead = turned - self.rate;
        let rate = self.rate + plan.speed_share * ahead;
        let ratio = (rate * self.per_stand) as f32;
        let bounded = f64x2::new([rate - self.stand, ahead + none]).abs();
        Turn { angle, rate, turned: turned.abs(), bounded, growth: ratio * ratio }
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

    /// After an angle that ran the wrong way the rate is wrong, and the turns that are right look like turns back.
    #[test]
    fn a_rate_that_is_wrong_does_not_keep_the_angle_out() {
        let config = crate::cycle::vibration::config::VibrationConfig {
            struct_size: 104,
            cycle_s: 0.001,
            acceleration_range_m_s2: 50.0,
            speed_filter_s: 0.001,
            ..Default::default()
        };
        let plan = Plan::new(&config, None).unwrap();
        let (mut spindle, mut angle_deg, mut bad) = (Spindle::default(), 0.0, 0);
        for cycle in 0..200 {
            angle_deg += if (100..115).contains(&cycle) { -6.5 } else { 6.0 };
            bad += u32::from(!spindle.read(&plan, angle_deg));
        }
        assert!(bad <= 4, "{bad} cycles");
        assert!((spindle.rate - 6.0 / 360.0).abs() < 1e-6, "{}", spindle.rate);
    }
}
