//! The torques of [`Physics`] at places, speeds and times that follow each other closely, as the steps of a simulation do.
//!
//! Sines, powers and exponentials are what such a step takes most of its time for, since it waits for them. So each is known at a place,
//! and a series about that does for many steps, to the last digits; where it no longer reaches, the next place lies ahead.

use super::physics::{GONE, Physics, Ripple, Spot};
use super::power::Power;

/// Up to where the series below are as exact as numbers are, to a few roundings: radians of a sine, exponent of an exponential.
const CLOSE: f64 = 0.1;
/// How far ahead the next place lies.
const AHEAD: f64 = 0.95 * CLOSE;

/// 1/n!.
const WHOLE: [f64; 8] = {
    let mut terms = [1.0; 8];
    let mut n = 1;
    while n < 8 {
        terms[n] = terms[n - 1] / n as f64;
        n += 1;
    }
    terms
};

/// A ripple near where it is known.
#[derive(Debug, Clone)]
struct Wave {
    ripple: Ripple,
    at: f64,
    /// Its value there, and a quarter of a period on.
    sine: f64,
    cosine: f64,
}

impl Wave {
    fn new(ripple: &Ripple) -> Self {
        Self { ripple: *ripple, at: f64::INFINITY, sine: 0.0, cosine: 0.0 }
    }

    #[inline(always)]
    fn at(&mut self, x: f64) -> f64 {
        let mut d = self.ripple.wave * (x - self.at);
        if !(d.abs() < CLOSE) {
            d = self.looked_up(x, d);
        }
        let s = d * d;
        let even = (1.0 - WHOLE[2] * s) + s * s * (WHOLE[4] - WHOLE[6] * s);
        let odd = (1.0 - WHOLE[3] * s) + s * s * (WHOLE[5] - WHOLE[7] * s);
        self.sine * even + self.cosine * (d * odd)
    }

    /// Looks it up ahead of a place, for one that goes on as it came; how far behind the place lies.
    #[cold]
    fn looked_up(&mut self, x: f64, d: f64) -> f64 {
        let Ripple { amplitude, wave, phase } = self.ripple;
        self.at = x + AHEAD.copysign(d) / wave;
        let (sine, cosine) = (wave * self.at + phase).sin_cos();
        (self.sine, self.cosine) = (amplitude * sine, amplitude * cosine);
        wave * (x - self.at)
    }
}

/// e^−xⁿ near where it is known.
#[derive(Debug, Clone)]
struct Fading {
    n: f64,
    /// From where on nothing is left of it.
    gone: f64,
    power: Power,
    at: f64,
    value: f64,
}

impl Fading {
    fn new(n: f64) -> Self {
        Self { n, gone: GONE.powf(1.0 / n), power: Power::default(), at: f64::INFINITY, value: 0.0 }
    }

    #[inline(always)]
    fn at(&mut self, x: f64) -> f64 {
        if !(x < self.gone) {
            return 0.0;
        }
        let x = self.power.at(x, self.n);
        let mut d = self.at - x;
        if !(d.abs() < CLOSE) {
            d = self.looked_up(x, d);
        }
        let s = d * d;
        let pair = |k: usize| WHOLE[k] + WHOLE[k + 1] * d;
        self.value * ((pair(0) + s * pair(2)) + s * s * (pair(4) + s * pair(6)))
    }

    /// Looks it up ahead of a place, for one that goes on as it came; how far behind the place lies.
    #[cold]
    fn looked_up(&mut self, x: f64, d: f64) -> f64 {
        self.at = x - AHEAD.copysign(d);
        self.value = (-self.at).exp();
        self.at - x
    }
}

/// What of an axis's torques is dear, and where it is known.
#[derive(Debug, Clone)]
pub struct Nearby {
    cogging: Vec<Wave>,
    vibration: Vec<Wave>,
    spots: Vec<(Spot, Fading)>,
    stribeck: Fading,
    drift: Fading,
}

impl Nearby {
    /// Nothing is known yet.
    #[must_use]
    pub fn new(physics: &Physics) -> Self {
        Self {
            cogging: physics.cogging.iter().map(Wave::new).collect(),
            vibration: physics.vibration.iter().map(Wave::new).collect(),
            spots: physics.spots.iter().map(|spot| (*spot, Fading::new(spot.half_steepness))).collect(),
            stribeck: Fading::new(physics.half_exponent_of_speed()),
            drift: Fading::new(1.0),
        }
    }

    /// [`Physics::friction_level`].
    #[inline(always)]
    pub fn friction_level(&mut self, physics: &Physics, x: f64, v: f64, t: f64) -> f64 {
        let (stribeck, drift) = (&mut self.stribeck, &mut self.drift);
        let mut spots = 0.0;
        for (spot, fading) in &mut self.spots {
            spots += spot.peak * fading.at(spot.square(x));
        }
        physics.level(v, t, |square, _| stribeck.at(square), spots, |time| drift.at(time))
    }

    /// [`Physics::load`].
    #[inline(always)]
    pub fn load(&mut self, physics: &Physics, x: f64, v: f64, t: f64) -> f64 {
        let mut torque = physics.still_load(x, v);
        for wave in &mut self.vibration {
            torque += wave.at(t);
        }
        torque
    }

    /// [`Physics::cogging_torque`].
    #[inline(always)]
    pub fn cogging_torque(&mut self, x: f64) -> f64 {
        let mut torque = 0.0;
        for wave in &mut self.cogging {
            torque += wave.at(x);
        }
        torque
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::Machine;

    /// Along a way with rests, slow and fast stretches and jumps, against the functions themselves.
    #[test]
    fn nearby_is_as_exact_as_numbers_are() {
        let text = r#"{"schema":"gib.machine/1","name":"t","axes":[{"name":"x","drive":"ball_screw","lead_mm":10,"inertia_kg_m2":0.003,
            "coulomb_friction_nm":0.5,"viscous_friction_nm_s":0.01,"constant_torque_nm":0.2,"effects":[
            {"cause":"stribeck_friction","parameters":{"stribeck_torque_nm":0.3,"stribeck_velocity_mm_s":5}},
            {"cause":"position_dependent_friction","parameters":{"centre_mm":100,"peak_nm":0.3,"width_mm":7}},
            {"cause":"position_dependent_friction","parameters":{"centre_mm":40,"peak_nm":0.3,"width_mm":9,"steepness":6}},
            {"cause":"thermal_drift","parameters":{"drop_nm":0.3,"time_constant_s":20}},
            {"cause":"cable_force","parameters":{"slope_nm_mm":0.001}},
            {"cause":"quadratic_drag","parameters":{"drag_nm_s2_m2":2}},
            {"cause":"cogging","parameters":{"amplitude_nm":0.1,"period_mm":2.5}},
            {"cause":"cogging","parameters":{"amplitude_nm":0.2,"period_mm":0.4}},
            {"cause":"external_vibration","parameters":{"amplitude_nm":0.1,"frequency_hz":25}}]}]}"#;
        let mut physics = Physics::of(&Machine::parse(text).unwrap().axes[0]).unwrap();
        physics.cogging.iter_mut().for_each(|ripple| ripple.phase = 0.7);
        let mut nearby = Nearby::new(&physics);
        let (mut x, mut largest) = (60.0, 0.0f64);
        for step in 0..200_000 {
            let t = 25e-6 * f64::from(step);
            let v = 400.0 * (1.3 * t).sin().powi(3) + if step % 5000 == 0 { 50.0 } else { 0.0 };
            x += 25e-6 * v;
            for (near, own) in [
                (nearby.friction_level(&physics, x, v, t), physics.friction_level(x, v, t)),
                (nearby.load(&physics, x, v, t), physics.load(x, v, t)),
                (nearby.cogging_torque(x), physics.cogging_torque(x)),
            ] {
                largest = largest.max((near - own).abs());
            }
        }
        // An angle of some thousand radians is itself no more exact.
        assert!(largest < 1e-12 && largest > 0.0, "{largest}");
    }
}
