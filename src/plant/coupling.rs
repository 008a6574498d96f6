//! What passes between motor and table: a spring with damping, dead within the clearance.
//!
//! τ = k·(δ − c/2) + d·δ̇ beyond +c/2, mirrored beyond −c/2, nothing between; flanks push and never pull, so damping
//! cannot turn the sign. Without clearance it is the plain spring. δ = motor − table in the motor's coordinate.
//!
//! A motor that moves as measured is no wall. Flanks that meet swing faster than rows follow, and the motor gives way between
//! the rows: by z, with z̈ = −(τ − τ̄)/J₁ − 2·ζ·Ω·ż − Ω²·z, τ̄' = Ω·(τ − τ̄). What is slower than Ω is in the rows already.
//! Behind a wall the flanks would throw the table back too fast and too often: the two masses swing at √(k/J₁ + k/J₂), a table
//! before a wall at √(k/J₂) and with less damping.

use crate::machine::TwoMasses;
use std::ops::{Add, Mul, Sub};

/// Torque on the table (and against the motor) at a wind-up and its rate.
#[must_use]
#[inline]
pub fn transmitted(masses: &TwoMasses, wind: f64, rate: f64) -> f64 {
    if masses.clearance == 0.0 {
        return masses.stiffness * wind + masses.damping * rate;
    }
    let beyond = wind.abs() - 0.5 * masses.clearance;
    if beyond <= 0.0 {
        return 0.0;
    }
    let outward = rate * wind.signum();
    (masses.stiffness * beyond + masses.damping * outward).max(0.0).copysign(wind)
}

/// How a motor between the rows gives way to the flanks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Giving {
    /// Seconds times Ω, and times Ω².
    corner: f64,
    square: f64,
    /// What damping leaves of the speed in a step.
    kept: f64,
    h: f64,
}

/// Ω times the time between two rows: a path through rows follows what swings slower. On 80 random clearances what the true
/// machine leaves is least from 1.5 to 2.5, and clearances fitted with a larger one are less biased.
const CORNER: f64 = 2.5;

impl Giving {
    /// In steps of `h` between rows that are so far apart, s.
    #[must_use]
    pub fn new(row_period_s: f64, h: f64) -> Self {
        let corner = (CORNER / row_period_s).min(1.0 / h);
        Self { corner: h * corner, square: h * corner * corner, kept: 1.0 / (1.0 + 1.4 * h * corner), h }
    }

    /// z, ż and τ̄ after a step in which the link carries `torque`; `mobility` is the step over the motor's inertia. Of one motor, or of
    /// several side by side.
    #[must_use]
    #[inline(always)]
    pub fn step<T>(&self, [z, speed, answered]: [T; 3], torque: T, mobility: T) -> [T; 3]
    where
        T: Copy + Add<Output = T> + Sub<Output = T> + Mul<Output = T> + Mul<f64, Output = T>,
    {
        let beyond = torque - answered;
        let speed = (speed - mobility * beyond - z * self.square) * self.kept;
        [z + speed * self.h, speed, answered + beyond * self.corner]
    }
}

/// How many times longer the steps may be in which flanks are calm: 0.4 radians of the swing that there is none of.
pub const LONGER: f64 = 6.0;
/// Force of a swing of flanks over what they carry up to which they are calm.
pub const CALM: f64 = 0.02;
/// The same behind a motor that moves as measured: they follow what that trembles by as well, which longer steps make no worse.
pub const CALM_BEHIND_MEASURED: f64 = 0.1;

/// What some steps have shown of flanks. They swing fast, but hardly ever: a table that leans on one of them, slides one way and swings
/// no more goes with its motor, and is as exact in far longer steps. Steps in which that ends are made once more, short.
#[derive(Debug, Clone, Copy)]
pub struct Leaning {
    /// Flank and way of the first step.
    first: Option<[i8; 2]>,
    /// Whether all others had the same.
    alike: bool,
    /// Largest speed of motor against table.
    apart: f64,
    /// Of what they carried.
    sum: f64,
    steps: f64,
}

impl Default for Leaning {
    fn default() -> Self {
        Self { first: None, alike: true, apart: 0.0, sum: 0.0, steps: 0.0 }
    }
}

impl Leaning {
    /// A step in which the flanks carried `torque` while they went at `rate` against each other and the table from one speed to another.
    #[inline(always)]
    pub fn add(&mut self, torque: f64, rate: f64, [speed, next]: [f64; 2]) {
        let sign = |value: f64| i8::from(value > 0.0) - i8::from(value < 0.0);
        let here = [sign(torque), sign(next)];
        self.alike &= *self.first.get_or_insert(here) == here && sign(speed) == here[1];
        self.apart = self.apart.max(rate.abs());
        self.sum += torque;
        self.steps += 1.0;
    }

    /// Mean of what they carried.
    #[must_use]
    pub fn mean(&self) -> f64 {
        self.sum / self.steps
    }

    /// Whether they were calm, by the largest share of what they carry that a swing may have; `inertia` is what swings on them.
    #[must_use]
    pub fn is_calm(&self, most: f64, masses: &TwoMasses, inertia: f64) -> bool {
        let swing = (masses.stiffness * inertia).sqrt() * self.apart;
        let mean = self.mean();
        self.alike && (mean == 0.0 || swing <= most * mean.abs())
    }
}

/// Longest step at which the explicit spring is well resolved: a fifteenth of a radian of its fastest swing.
#[must_use]
pub fn longest_step_s(masses: &TwoMasses, lightest_inertia: f64) -> f64 {
    let spring = (masses.stiffness / lightest_inertia).sqrt();
    let damper = masses.damping / lightest_inertia;
    (1.0 / 15.0) / spring.max(damper)
}

#[cfg(test)]
mod tests {
    use super::*;

    const MASSES: TwoMasses = TwoMasses {
        motor_inertia: 1.0,
        table_inertia: 1.0,
        stiffness: 100.0,
        damping: 3.0,
        clearance: 0.2,
        table_friction_share: 0.5,
    };

    #[test]
    fn flanks_are_calm_that_lean_one_way_and_hardly_swing() {
        let after = |steps: &[(f64, f64, [f64; 2])]| {
            let mut leaning = Leaning::default();
            steps.iter().for_each(|&(torque, rate, speeds)| leaning.add(torque, rate, speeds));
            leaning.is_calm(CALM, &MASSES, 1.0)
        };
        // A swing of 0.001 is a force of 0.01.
        assert!(after(&[(1.0, 0.001, [2.0, 2.0]), (1.1, -0.001, [2.0, 2.1])]));
        assert!(!after(&[(1.0, 0.001, [2.0, 2.0]), (1.1, -0.003, [2.0, 2.1])]), "it swings");
        assert!(!after(&[(1.0, 0.001, [2.0, 2.0]), (0.0, 0.001, [2.0, 2.0])]), "it leaves its flank");
        assert!(!after(&[(1.0, 0.001, [2.0, 2.0]), (1.0, 0.001, [2.0, 0.0])]), "it comes to rest");
        assert!(after(&[(0.0, 1.0, [2.0, 2.0]), (0.0, 1.0, [2.0, 2.0])]), "it touches neither");
    }

    #[test]
    fn flanks_push_and_never_pull() {
        assert_eq!(transmitted(&MASSES, 0.09, 5.0), 0.0);
        assert!((transmitted(&MASSES, 0.15, 0.0) - 5.0).abs() < 1e-12);
        assert!((transmitted(&MASSES, -0.15, -1.0) + 8.0).abs() < 1e-12);
        assert_eq!(transmitted(&MASSES, 0.15, -50.0), 0.0, "a leaving flank does not pull");
        let spring = TwoMasses { clearance: 0.0, ..MASSES };
        assert!((transmitted(&spring, 0.1, -50.0) + 140.0).abs() < 1e-12, "a shaft does");
    }
}
