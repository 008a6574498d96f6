//! How long plant steps are, and how much longer they may be where nothing is sudden.

use super::coupling::{LONGER, longest_step_s};
use super::physics::Physics;

/// Radians of a swing on bristles to a step, which damps it by half as much.
const BRISTLE_RAD: f64 = 1.0 / 120.0;

/// Radians of a ripple to a step, whose mean is then a six hundredth less than its middle.
const RIPPLE_RAD: f64 = 0.2;

/// How much of the longest step that resolves a spring is as exact as the usual one where the spring swings on and on.
const SWINGS_ON: f64 = 0.4;

/// A plant step, s.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pace {
    pub step_s: f64,
    /// Rest and mean over a step of a first-order lag.
    lag: (f64, f64),
    /// Way that what is left of the lag adds to that of its mean, per torque and inertia, s².
    lag_way: f64,
}

impl Pace {
    pub fn new(step_s: f64, time_constant_s: f64) -> Self {
        let ratio = step_s / time_constant_s;
        let lag = if time_constant_s > 0.0 { ((-ratio).exp(), -(-ratio).exp_m1() / ratio) } else { (0.0, 0.0) };
        let way = time_constant_s * (step_s - time_constant_s * (1.0 - lag.0)) - 0.5 * step_s * step_s * lag.1;
        Self { step_s, lag, lag_way: way }
    }

    /// Mean over a step of a torque that follows what is asked for, and the way that it adds to that of its mean, per inertia.
    #[inline(always)]
    pub fn follow(&self, torque: &mut f64, asked: f64) -> [f64; 2] {
        let excess = *torque - asked;
        *torque = asked + excess * self.lag.0;
        [asked + excess * self.lag.1, excess * self.lag_way]
    }
}

/// Steps that are longer where nothing is sudden.
#[derive(Debug, Clone, Copy)]
pub(super) struct Long {
    /// The longest, s, and the longest while friction builds up.
    longest_s: [f64; 2],
    /// Longest way in a step, motor's coordinate.
    way: f64,
    /// The pace of the last ones.
    last: Pace,
}

impl Long {
    /// No longer than `longest_s`, nor than `usual_s` while friction builds up, of bodies of these inertias and shares of the friction;
    /// `None` where they are no longer than the usual pace.
    pub fn new(physics: &Physics, [usual_s, longest_s]: [f64; 2], bodies: &[(f64, f64)], pace: Pace) -> Option<Self> {
        let smooth_s = longest_s.min(physics.longest_smooth_step_s());
        let building_s = smooth_s.min(usual_s).min(physics.longest_step_of_bristles_s(bodies));
        let long = Self { longest_s: [smooth_s, building_s], way: physics.longest_smooth_way(), last: pace };
        (smooth_s > pace.step_s).then_some(long)
    }

    /// The longest, s.
    pub fn longest_s(&self) -> f64 {
        self.longest_s[0]
    }

    /// How few of them a span of time takes at a speed.
    pub fn fewest(&self, span_s: f64, speed: f64, builds_up: bool) -> usize {
        let of_way = span_s * speed.abs() / self.way;
        (span_s / self.longest_s[usize::from(builds_up)]).max(of_way).ceil() as usize
    }

    /// The pace of such a step.
    pub fn pace(&mut self, step_s: f64, time_constant_s: f64) -> Pace {
        if self.last.step_s != step_s {
            self.last = Pace::new(step_s, time_constant_s);
        }
        self.last
    }
}

impl Physics {
    /// Longest step in which nothing swings that acts on a smooth motion, s, but for friction that builds up.
    #[must_use]
    pub fn longest_smooth_step_s(&self) -> f64 {
        let link = self.two_masses.map_or(f64::INFINITY, |masses| {
            let step_s = longest_step_s(&masses, masses.motor_inertia.min(masses.table_inertia));
            if masses.clearance > 0.0 { LONGER * step_s } else { SWINGS_ON * step_s }
        });
        self.vibration.iter().map(|ripple| RIPPLE_RAD / ripple.wave).fold(link, f64::min)
    }

    /// Longest way in such a step, motor's coordinate.
    #[must_use]
    pub fn longest_smooth_way(&self) -> f64 {
        let ripples = self.cogging.iter().map(|ripple| 1.0 / ripple.wave);
        let spots = self.spots.iter().map(|spot| 0.5 / (spot.per_width * spot.half_steepness));
        RIPPLE_RAD * self.motor_per_load * ripples.chain(spots).fold(f64::INFINITY, f64::min)
    }

    /// Longest step of bodies of these inertias and shares of the friction where it builds up over a way, s: it has a swing of its own.
    #[must_use]
    pub fn longest_step_of_bristles_s(&self, bodies: &[(f64, f64)]) -> f64 {
        let stiffness = self.bristle_stiffness().unwrap_or(0.0);
        let square = bodies.iter().map(|(inertia, share)| share * stiffness / inertia).fold(0.0, f64::max);
        BRISTLE_RAD / square.sqrt().max(square * self.bristle_law.micro_damping_s)
    }
}
