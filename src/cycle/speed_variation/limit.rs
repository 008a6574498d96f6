//! Which amplitude a motor can do in a period, and which period it needs for an amplitude.
//!
//! Torque and power are largest at the top of a triangle, S(1 + q), where the rise ends:
//!
//! ```text
//! (4JqS/R + Tc + Tcut + B·S(1+q))·S(1+q) ≤ P      a quadratic in q
//!  4JqS/R + Tc + Tcut + B·S(1+q)         ≤ T      linear in q
//! ```
//!
//! A sine needs them nowhere in particular. Where its power is largest, at sin φ = x/q, the derivative of power by φ is 0,
//! which leaves one equation for x = (ω − S)/S, of amplitude and of period each; [`Balance`] has both.

use core::f64::consts::{PI, TAU};

/// The shape of the variation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wave {
    /// Constant rate up and down.
    Triangle,
    /// Sine.
    Sine,
}

/// What stands in the way of more.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Limit {
    /// The motor's power.
    Power,
    /// Its torque.
    Torque,
    /// The lowest or highest speed allowed.
    Speed,
    /// Friction and cutting use all there is.
    Nothing,
}

/// A spindle with its motor and what is used already. SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motor {
    /// All that turns, kg·m².
    pub inertia: f64,
    /// Largest power, W.
    pub power: f64,
    /// Largest torque, N·m.
    pub torque: f64,
    /// Lowest and highest speed, rad/s.
    pub speeds: [f64; 2],
    /// Coulomb friction and cutting, N·m.
    pub used: f64,
    /// Viscous friction, N·m·s/rad.
    pub viscous: f64,
}

/// Golden sections of the phase: to 10⁻⁴ of a quarter turn; a maximum is flat, so its value is good to 10⁻⁸.
const SECTIONS: u32 = 20;

/// Rounds, of two steps each, that find the moments of a sine.
pub const POWER_ROUNDS: u8 = 3;
/// See `POWER_ROUNDS`.
pub const SLOPE_ROUNDS: u8 = 2;

impl Motor {
    /// Torque left to accelerate with at a speed above 0, N·m; negative where there is none.
    #[inline(always)]
    #[must_use]
    pub fn left(&self, speed: f64) -> f64 {
        let by_power = self.power / speed;
        let most = if by_power < self.torque { by_power } else { self.torque };
        most - self.used - self.viscous * speed
    }

    /// Highest speed, rad/s, at which there is `torque` (N·m) and more left to accelerate with; 0 where there is none.
    #[must_use]
    pub fn fastest(&self, torque: f64) -> f64 {
        // (level + B·ω)·ω = P and level + B·ω = T
        let level = torque + self.used;
        let root = level + (level * level + 4.0 * self.viscous * self.power).sqrt();
        let by_power = if root > 0.0 { 2.0 * self.power / root } else { f64::MAX };
        let spare = self.torque - level;
        let by_torque = if self.viscous > 0.0 { spare / self.viscous } else { f64::MAX };
        if spare >= 0.0 { by_power.min(by_torque) } else { 0.0 }
    }

    /// Largest amplitude at a mean speed (rad/s, above 0) and a period (s, above 0), and what limits it.
    #[must_use]
    pub fn amplitude(&self, wave: Wave, mean: f64, period: f64) -> (f64, Limit) {
        let moment = match wave {
            Wave::Triangle => 0.0,
            Wave::Sine => found(POWER_ROUNDS, |x| self.power_moment(mean, period, x)),
        };
        self.amplitude_at(wave, mean, period, moment)
    }

    /// The same where the moment of a sine's largest power is known.
    #[must_use]
    pub fn amplitude_at(&self, wave: Wave, mean: f64, period: f64, moment: f64) -> (f64, Limit) {
        if self.left(mean) <= 0.0 || mean <= self.speeds[0] || mean >= self.speeds[1] {
            let out = mean <= self.speeds[0] || mean >= self.speeds[1];
            return (0.0, if out { Limit::Speed } else { Limit::Nothing });
        }
        let by_speed = self.by_speed(mean);
        let (by_power, by_torque) = match wave {
            Wave::Triangle => self.triangle(mean, period),
            Wave::Sine => self.sine(mean, period, moment),
        };
        let power = (by_power, Limit::Power);
        let torque = (by_torque, Limit::Torque);
        let least = if torque.0 < power.0 { torque } else { power };
        if by_speed <= least.0 { (by_speed, Limit::Speed) } else { least }
    }

    /// Amplitude at which the lowest or the highest speed allowed is met; not below 0.
    #[must_use]
    pub fn by_speed(&self, mean: f64) -> f64 {
        (self.speeds[1] / mean - 1.0).min(1.0 - self.speeds[0] / mean).max(0.0)
    }

    fn triangle(&self, mean: f64, period: f64) -> (f64, f64) {
        let a = 4.0 * self.inertia * mean / period;
        let steep = a + self.viscous * mean;
        // steep·x² + (used − a)·x − P/S = 0 with x = 1 + q.
        let half = 0.5 * (a - self.used);
        let root = (half * half + steep * self.power / mean).sqrt();
        let by_power = (half + root) / steep - 1.0;
        (by_power, (self.torque - self.used - self.viscous * mean) / steep)
    }

    /// Where a sine that takes all power does so, as a share of the mean speed above it: a round nearer than `from`.
    #[must_use]
    pub fn power_moment(&self, mean: f64, period: f64, from: Option<f64>) -> f64 {
        let (balance, a) = (Balance::of(self, mean), TAU * self.inertia * mean / period);
        balance.nearer(a, balance.nearer(a, from.unwrap_or_else(|| balance.guess(a))))
    }

    /// Where a sine of this amplitude is steepest for what power leaves, as a share of the mean speed above it: a round nearer
    /// than `from`.
    #[must_use]
    pub fn slope_moment(&self, mean: f64, amplitude: f64, from: Option<f64>) -> f64 {
        Balance::of(self, mean).nearer_slope(amplitude, from)
    }

    fn sine(&self, mean: f64, period: f64, moment: f64) -> (f64, f64) {
        let (balance, a) = (Balance::of(self, mean), TAU * self.inertia * mean / period);
        let steep = (a * a + balance.viscous * balance.viscous).sqrt();
        (balance.amplitude(a, moment), (self.torque - balance.used - balance.viscous) / steep)
    }

    /// Shortest period (s) for an amplitude at a mean speed (rad/s); what stands in the way where none is long enough.
    ///
    /// # Errors
    /// The limit that no period overcomes.
    pub fn period(&self, wave: Wave, mean: f64, amplitude: f64) -> Result<f64, Limit> {
        let moment = match wave {
            Wave::Triangle => 0.0,
            Wave::Sine => found(SLOPE_ROUNDS, |x| self.slope_moment(mean, amplitude, x)),
        };
        self.period_at(wave, mean, amplitude, moment)
    }

    /// The same where the moment at which a sine is steepest is known.
    ///
    /// # Errors
    /// As [`Motor::period`].
    pub fn period_at(&self, wave: Wave, mean: f64, amplitude: f64, moment: f64) -> Result<f64, Limit> {
        let top = mean * (1.0 + amplitude);
        if top > self.speeds[1] || mean * (1.0 - amplitude) < self.speeds[0] {
            return Err(Limit::Speed);
        }
        if self.left(top) <= 0.0 {
            return Err(Limit::Nothing);
        }
        let swing = self.inertia * mean * amplitude;
        Ok(match wave {
            Wave::Triangle => 4.0 * swing / self.left(top),
            Wave::Sine => {
                let balance = Balance::of(self, mean);
                // cos φ / (T − used − viscous·(1 + q·sin φ)) is largest where its derivative by φ is 0.
                let (level, swing_of_it) = (self.torque - balance.used - balance.viscous, amplitude * balance.viscous);
                let by_torque = 1.0 / (level * level - swing_of_it * swing_of_it).sqrt();
                TAU * swing * by_torque.max(balance.slope(amplitude, moment))
            }
        })
    }

    /// Torque and power at the worst moment of a variation, N·m and W.
    #[must_use]
    pub fn demand(&self, wave: Wave, mean: f64, amplitude: f64, period: f64) -> (f64, f64) {
        let top = mean * (1.0 + amplitude);
        let at = |acceleration: f64, speed: f64| self.inertia * acceleration + self.used + self.viscous * speed;
        match wave {
            Wave::Triangle => {
                let torque = at(4.0 * amplitude * mean / period, top);
                (torque, torque * top)
            }
            Wave::Sine => {
                let rate = TAU * amplitude * mean / period;
                let speed = |sin: f64| mean * (1.0 + amplitude * sin);
                let torque = highest(|cos, sin| at(rate * cos, speed(sin)));
                (torque, highest(|cos, sin| at(rate * cos, speed(sin)) * speed(sin)))
            }
        }
    }

    /// Largest amplitude as published, Q = 4500·P·R/(2·S²·J) % with S in rpm.
    #[must_use]
    pub fn published_amplitude(&self, mean: f64, period: f64) -> f64 {
        let rpm = crate::units::rpm_from_rad_s(mean);
        45.0 * self.power * period / (2.0 * rpm * rpm * self.inertia)
    }

    /// Shortest period as published, s.
    #[must_use]
    pub fn published_period(&self, mean: f64, amplitude: f64) -> f64 {
        amplitude / self.published_amplitude(mean, 1.0)
    }

    /// An amplitude and the shortest period for it that break up the regeneration of chatter at `chatter_hz` (`None`:
    /// not known); the period is 0 where the motor can do none.
    ///
    /// Chatter cuts k = f·60/n waves in a revolution. It regenerates as long as each meets the one before it in the
    /// same phase; a swing of ±q sweeps that phase through 2·q·k turns, so q = 1/(2k) is the least that leaves none
    /// out. Below a twentieth the drive's own inaccuracy is as large; above three tenths the cutting speed suffers.
    /// A period is not below five revolutions: what changes within one is only waviness.
    #[must_use]
    pub fn recommended(&self, wave: Wave, mean: f64, chatter_hz: Option<f64>) -> (f64, f64) {
        let wanted = match chatter_hz {
            Some(frequency) => (0.5 * mean / (TAU * frequency)).clamp(0.05, 0.3),
            None => 0.1,
        };
        let five_revolutions = 5.0 * TAU / mean;
        // The motor may be able to do the amplitude only in a very long period, or not at all: half of it then.
        let mut amplitude = wanted;
        for _ in 0..6 {
            if let Ok(period) = self.period(wave, mean, amplitude)
                && period <= 60.0
            {
                return (amplitude, period.max(five_revolutions));
            }
            amplitude *= 0.5;
        }
        (0.0, 0.0)
    }
}

/// A motor's torques at the mean speed, N·m: what its power makes, what is used, and viscous friction. At the speed
/// S·w, w = 1 + x, it has power/w − used − viscous·w left to accelerate with.
struct Balance {
    power: f64,
    used: f64,
    viscous: f64,
}

impl Balance {
    fn of(motor: &Motor, mean: f64) -> Balance {
        Balance { power: motor.power / mean, used: motor.used, viscous: motor.viscous * mean }
    }

    /// Amplitude of the sine that takes all power at its worst moment; 1 or more where any may be had.
    ///
    /// With acceleration a·q·cos φ the worst moment has a·tan φ = viscous + power/w², so that
    ///
    /// ```text
    /// a²·x·w³/(viscous·w² + power) + used·w + viscous·w² − power = 0
    /// ```
    ///
    /// which rises and bends upward with x: Newton's way from the right never passes the root.
    fn amplitude(&self, a: f64, x: f64) -> f64 {
        let w = 1.0 + x;
        let tangent = self.viscous + self.power / (w * w);
        x * (tangent * tangent + a * a).sqrt() / tangent
    }

    /// On the right of that root.
    fn guess(&self, a: f64) -> f64 {
        let Balance { power, used, viscous } = *self;
        ((power - used - viscous) / (a * a / (viscous + power) + used + 2.0 * viscous)).min(1.0)
    }

    /// A step of Newton's toward it.
    fn nearer(&self, a: f64, x: f64) -> f64 {
        let Balance { power, used, viscous } = *self;
        let w = 1.0 + x;
        let below = viscous * w * w + power;
        let h = a * a * w / below;
        let value = h * w * w * x + used * w + viscous * w * w - power;
        let slope = h * (w * (4.0 * w - 3.0) - 2.0 * viscous * w * w * w * x / below) + used + 2.0 * viscous * w;
        (x - value / slope).min(1.0)
    }

    /// Largest cos φ / (what power leaves at φ) of a sine of this amplitude, 1/(N·m); power leaves some at its top.
    ///
    /// Its moment is the one root within (0, q) of a cubic that bends upward, then downward: from the bend Newton's way never
    /// passes it.
    fn slope(&self, amplitude: f64, x: f64) -> f64 {
        let Balance { power, used, viscous } = *self;
        let sin = (x / amplitude).clamp(0.0, 1.0);
        let w = 1.0 + amplitude * sin;
        (1.0 - sin * sin).sqrt() / (power / w - used - viscous * w)
    }

    /// Two steps of Newton's toward that moment, from the bend where none was made yet.
    fn nearer_slope(&self, amplitude: f64, from: Option<f64>) -> f64 {
        let Balance { power, used, viscous } = *self;
        let (level, square) = (used + viscous, amplitude * amplitude);
        let (c2, c1) = (2.0 * (power - level) - square * viscous, power - level - 2.0 * square * viscous);
        let c0 = -square * (power + viscous);
        let bend = || if level > 0.0 { c2 / (3.0 * level) } else { amplitude }.max(0.0).min(amplitude);
        let mut x = from.unwrap_or_else(bend);
        for _ in 0..2 {
            x -= (((c2 - level * x) * x + c1) * x + c0) / ((2.0 * c2 - 3.0 * level * x) * x + c1);
        }
        x
    }
}

/// What so many rounds lead to.
fn found(rounds: u8, round: impl Fn(Option<f64>) -> f64) -> f64 {
    let mut x = None;
    for _ in 0..rounds {
        x = Some(round(x));
    }
    x.unwrap_or(0.0)
}

/// The highest value over the rising quarter of a swing of a function of (cos φ, sin φ) with one maximum there.
fn highest(value: impl Fn(f64, f64) -> f64) -> f64 {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    // t = tan(φ/2) runs from 0 to 1 and needs no sine.
    let at = |t: f64| {
        let d = 1.0 / (1.0 + t * t);
        value((1.0 - t * t) * d, 2.0 * t * d)
    };
    let (mut low, mut high) = (0.0, 1.0);
    let (mut a, mut b) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
    let (mut fa, mut fb) = (at(a), at(b));
    for _ in 0..SECTIONS {
        if fa > fb {
            (high, b, fb) = (b, a, fa);
            a = high - GOLDEN * (high - low);
            fa = at(a);
        } else {
            (low, a, fa) = (a, b, fb);
            b = low + GOLDEN * (high - low);
            fb = at(b);
        }
    }
    // A maximum at either end is approached but never met.
    fa.max(fb).max(at(0.0)).max(at(1.0))
}

/// Factor between the exact limit at the mean speed and the printed one: 3600/(16·π²) = 22.797 for 22.5.
pub const PRINT_FACTOR: f64 = 22.5 * 16.0 * PI * PI / 3600.0;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::rad_s_from_rpm;
    use proptest::prelude::*;

    /// The example of the source: J 0.5, S 1000, P 10 kW.
    fn example() -> Motor {
        Motor { inertia: 0.5, power: 1e4, torque: 1e9, speeds: [0.0, 1e4], used: 0.0, viscous: 0.0 }
    }

    /// By hand: print 0.90, which draws 1.88 times the power; right 0.578; the print is 1.3 % low at the mean speed.
    #[test]
    fn the_published_example() {
        let (motor, mean) = (example(), rad_s_from_rpm(1000.0));
        let published = motor.published_amplitude(mean, 2.0);
        assert!((published - 0.9).abs() < 1e-12);
        let (_, power) = motor.demand(Wave::Triangle, mean, published, 2.0);
        assert!((power / 1e4 - 1.876).abs() < 1e-3, "{power}");
        let (exact, limit) = motor.amplitude(Wave::Triangle, mean, 2.0);
        assert!((exact - 0.578).abs() < 5e-4 && limit == Limit::Power, "{exact}");
        assert!((exact * (1.0 + exact) - 22.797 * 1e4 * 2.0 / (1e6 * 0.5)).abs() < 1e-3);
        assert!((PRINT_FACTOR - 0.987).abs() < 1e-3);
        assert!((motor.published_period(mean, 0.9) - 2.0).abs() < 1e-12);
    }

    #[test]
    fn friction_and_cutting_that_use_all_leave_nothing() {
        let motor = Motor { used: 200.0, ..example() };
        let mean = rad_s_from_rpm(1000.0);
        assert_eq!(motor.amplitude(Wave::Triangle, mean, 2.0), (0.0, Limit::Nothing));
        assert_eq!(motor.period(Wave::Sine, mean, 0.1), Err(Limit::Nothing));
        let narrow = Motor { speeds: [90.0, 110.0], ..example() };
        let (q, limit) = narrow.amplitude(Wave::Sine, mean, 10.0);
        assert!((q - (110.0 / mean - 1.0)).abs() < 1e-12 && limit == Limit::Speed);
        assert_eq!(narrow.period(Wave::Triangle, mean, 0.2), Err(Limit::Speed));
    }

    #[test]
    fn recommended_is_within_the_limits_and_sweeps_the_phase_once() {
        let (motor, mean) = (example(), rad_s_from_rpm(1000.0));
        for wave in [Wave::Triangle, Wave::Sine] {
            for (hz, q) in [(Some(100.0), 1.0 / 12.0), (Some(20.0), 0.3), (Some(900.0), 0.05), (None, 0.1)] {
                let (amplitude, period) = motor.recommended(wave, mean, hz);
                assert!((amplitude - q).abs() < 1e-12 && period >= 0.3 - 1e-12, "{amplitude} {period}");
                assert!(motor.demand(wave, mean, amplitude, period).1 <= motor.power * (1.0 + 1e-9));
            }
        }
    }

    proptest! {
        /// At the limit the motor gives all it has, and not more, in some respect; and the period for that amplitude
        /// is the period it was for.
        #[test]
        fn a_limit_is_exhausted_and_not_exceeded(
            inertia in 0.01..5.0f64, rpm in 100.0..6000.0f64, power in 500.0..50_000.0f64, period in 0.1..20.0f64,
            torque_share in 1.05..20.0f64, used in 0.0..0.6f64, viscous in 0.0..0.3f64, sine: bool,
        ) {
            let mean = rad_s_from_rpm(rpm);
            let at_mean = power / mean;
            let motor = Motor {
                inertia, power, torque: at_mean * torque_share, speeds: [0.0, 1.9 * mean], used: used * at_mean,
                viscous: viscous * at_mean / mean,
            };
            let wave = if sine { Wave::Sine } else { Wave::Triangle };
            let (q, limit) = motor.amplitude(wave, mean, period);
            prop_assert!(q > 0.0 && q <= 0.9 + 1e-9);
            // Judged by a plain scan over the phase, not by the formula that made the limit.
            let (mut torque, mut watts) = (0.0f64, 0.0f64);
            for i in 0..=20_000 {
                let phase = 0.5 * PI * f64::from(i) / 20_000.0;
                let (speed, acceleration) = if sine {
                    (mean * (1.0 + q * phase.sin()), TAU / period * q * mean * phase.cos())
                } else {
                    (mean * (1.0 + q * f64::from(i) / 20_000.0), 4.0 * q * mean / period)
                };
                let now = inertia * acceleration + motor.used + motor.viscous * speed;
                torque = torque.max(now);
                watts = watts.max(now * speed);
            }
            prop_assert!(torque <= motor.torque * (1.0 + 1e-6) && watts <= power * (1.0 + 1e-6), "{torque} {watts}");
            let some = 0.3 * (motor.power / mean).min(motor.torque);
            let fastest = motor.fastest(some);
            prop_assert!(motor.left(fastest) >= some - 1e-9 * at_mean || fastest == 0.0);
            prop_assert!(motor.left(fastest * 1.001 + 1e-9) < some, "it is the highest");
            let full = match limit {
                Limit::Power => watts / power,
                Limit::Torque => torque / motor.torque,
                _ => q / 0.9,
            };
            prop_assert!(full > 1.0 - 1e-6, "{limit:?} {full}");
            if limit != Limit::Speed {
                let back = motor.period(wave, mean, q).unwrap();
                // Compared in amplitude: where friction takes nearly all at the top, a hair of it is a lot of period.
                let again = motor.amplitude(wave, mean, back).0;
                prop_assert!((again / q - 1.0).abs() < 1e-5, "{back} {period}: {again} {q}");
            }
            let demand = motor.demand(wave, mean, q, period);
            prop_assert!((demand.1 / watts - 1.0).abs() < 1e-6 && (demand.0 / torque - 1.0).abs() < 1e-6);
        }
    }
}
