//! The torques of [`Physics`] at places, speeds and times that follow each other closely, as the steps of a simulation do.
//!
//! Sines and exponentials are what such a step takes most of its time for, since it waits for them. So each is worked out
//! ahead, where the next step will be if it goes on as the last did, while that one is made; from there to where it is the first
//! terms of a series will do, to the last digit but one. Ahead it is a longer series from a place where it is known.

use super::physics::{Physics, Ripple, Spot, is_gone};

/// Ways up to which the long series are as exact as numbers are: radians of a sine, exponent of an exponential.
const CLOSE_SINE: f64 = 0.25;
const CLOSE_FADE: f64 = 0.0625;
/// The same of the short one.
const AT_HAND: f64 = 1e-4;

/// 1/n!.
const WHOLE: [f64; 12] = {
    let mut terms = [1.0; 12];
    let mut n = 1;
    while n < 12 {
        terms[n] = terms[n - 1] / n as f64;
        n += 1;
    }
    terms
};
/// The series of cosine and of sine over its angle, in squares.
const EVEN: [f64; 6] = [WHOLE[0], -WHOLE[2], WHOLE[4], -WHOLE[6], WHOLE[8], -WHOLE[10]];
const ODD: [f64; 6] = [WHOLE[1], -WHOLE[3], WHOLE[5], -WHOLE[7], WHOLE[9], -WHOLE[11]];

/// The first terms of a function's series about where it is looked for next.
#[derive(Debug, Clone)]
struct Ahead {
    last: f64,
    about: f64,
    terms: [f64; 4],
    /// How far the terms reach.
    reach: f64,
}

impl Default for Ahead {
    fn default() -> Self {
        Self::new(AT_HAND)
    }
}

impl Ahead {
    fn new(reach: f64) -> Self {
        Self { last: 0.0, about: f64::INFINITY, terms: [0.0; 4], reach }
    }

    #[inline(always)]
    fn at(&mut self, x: f64, mut terms_about: impl FnMut(f64) -> [f64; 4]) -> f64 {
        let d = x - self.about;
        let value = if d.abs() < self.reach {
            let [value, slope, bend, twist] = self.terms;
            (value + d * slope) + d * d * (bend + d * twist)
        } else {
            terms_about(x)[0]
        };
        self.about = x + (x - self.last);
        self.last = x;
        self.terms = terms_about(self.about);
        value
    }
}

/// A ripple near where it is known.
#[derive(Debug, Clone)]
struct Wave {
    ripple: Ripple,
    at: f64,
    sine: f64,
    cosine: f64,
}

impl Wave {
    fn new(ripple: &Ripple) -> Self {
        Self { ripple: *ripple, at: f64::INFINITY, sine: 0.0, cosine: 0.0 }
    }

    /// The terms of its series about a place.
    #[inline(always)]
    fn terms(&mut self, x: f64) -> [f64; 4] {
        let Ripple { amplitude, wave, phase } = self.ripple;
        let mut d = wave * (x - self.at);
        if !(d.abs() < CLOSE_SINE) {
            (self.at, [self.sine, self.cosine], d) = (x, known(wave * x + phase), 0.0);
        }
        let s = d * d;
        let s2 = s * s;
        let even = |k: usize| EVEN[k] + EVEN[k + 1] * s;
        let odd = |k: usize| ODD[k] + ODD[k + 1] * s;
        let by_cosine = even(0) + s2 * (even(2) + s2 * even(4));
        let by_sine = d * (odd(0) + s2 * (odd(2) + s2 * odd(4)));
        let value = amplitude * (self.sine * by_cosine + self.cosine * by_sine);
        let slope = amplitude * wave * (self.cosine * by_cosine - self.sine * by_sine);
        let bend = -0.5 * wave * wave;
        [value, slope, bend * value, bend / 3.0 * slope]
    }
}

#[cold]
fn known(angle: f64) -> [f64; 2] {
    let (sine, cosine) = angle.sin_cos();
    [sine, cosine]
}

/// e^−x near where it is known.
#[derive(Debug, Clone)]
struct Fading {
    at: f64,
    value: f64,
}

impl Default for Fading {
    fn default() -> Self {
        Self { at: f64::INFINITY, value: 0.0 }
    }
}

impl Fading {
    #[inline(always)]
    fn at(&mut self, x: f64) -> f64 {
        if is_gone(x) { 0.0 } else { self.terms(x)[0] }
    }

    /// The terms of its series about a place.
    #[inline(always)]
    fn terms(&mut self, x: f64) -> [f64; 4] {
        let mut d = self.at - x;
        if !(d.abs() < CLOSE_FADE) {
            (self.at, self.value, d) = (x, faded(x), 0.0);
        }
        let s = d * d;
        let pair = |k: usize| WHOLE[k] + WHOLE[k + 1] * d;
        let value = self.value * (pair(0) + s * (pair(2) + s * (pair(4) + s * (pair(6) + s * WHOLE[8]))));
        [value, -value, 0.5 * value, -1.0 / 6.0 * value]
    }
}

#[cold]
fn faded(x: f64) -> f64 {
    (-x).exp()
}

/// What of an axis's torques is dear, and where it is known. What goes with time alone waits for no step.
#[derive(Debug, Clone, Default)]
pub struct Nearby {
    cogging: Vec<(Wave, Ahead)>,
    vibration: Vec<Wave>,
    spots: Vec<(Spot, Fading, Ahead)>,
    stribeck: (Fading, Ahead),
    drift: Fading,
}

impl Nearby {
    /// Nothing is known yet.
    #[must_use]
    pub fn new(physics: &Physics) -> Self {
        let ahead = |ripple: &Ripple| Ahead::new(AT_HAND / ripple.wave.abs());
        let spot = |spot: &Spot| (*spot, Fading::default(), Ahead::default());
        Self {
            cogging: physics.cogging.iter().map(|ripple| (Wave::new(ripple), ahead(ripple))).collect(),
            vibration: physics.vibration.iter().map(Wave::new).collect(),
            spots: physics.spots.iter().map(spot).collect(),
            ..Self::default()
        }
    }

    /// [`Physics::friction_level`].
    #[inline(always)]
    pub fn friction_level(&mut self, physics: &Physics, x: f64, v: f64, t: f64) -> f64 {
        let looked_up = |fading: &mut Fading, ahead: &mut Ahead, u: f64| {
            if is_gone(u) { 0.0 } else { ahead.at(u, |u| fading.terms(u)) }
        };
        let ((fading, ahead), drift) = (&mut self.stribeck, &mut self.drift);
        let with_speed = |u: f64| looked_up(fading, ahead, u);
        let spots = self.spots.iter_mut().map(|(spot, f, a)| spot.peak * looked_up(f, a, spot.widths(x)));
        physics.level(v, t, with_speed, spots, |u| drift.at(u))
    }

    /// [`Physics::load`].
    #[inline(always)]
    pub fn load(&mut self, physics: &Physics, x: f64, v: f64, t: f64) -> f64 {
        physics.load_with(x, v, self.vibration.iter_mut().map(|wave| wave.terms(t)[0]))
    }

    /// [`Physics::cogging_torque`].
    #[inline(always)]
    pub fn cogging_torque(&mut self, x: f64) -> f64 {
        self.cogging.iter_mut().map(|(wave, ahead)| ahead.at(x, |x| wave.terms(x))).sum()
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
