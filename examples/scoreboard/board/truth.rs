//! The machine as it is: the belief of `rig.rs` and what was hidden in it, in one set of parameters.
//!
//! Motor coordinates (see `rig.rs`); positions of effects in load units. Every torque is what the motor must deliver:
//!
//! τ = J·α + Tv·ω + A·|ω| + F(x, ω, t)·sign ω + T0 + slope·(x − zero) + C·v·|v| + cogging(x) + vibration(t)
//!
//! with F = Tc ± direction + Ts·exp(−|v/vs|ⁿ) + spot(x) + drop·exp(−t/τ), never below a twentieth of Tc.

use super::outside::Outside;
use super::rig::Rig;
use std::f64::consts::TAU;

/// Amplitude, wavelength (load units) or frequency (Hz), phase (rad).
#[derive(Clone, Copy, Debug, Default)]
pub struct Sine {
    pub amplitude: f64,
    pub period: f64,
    pub phase: f64,
}

impl Sine {
    pub fn at(&self, x: f64) -> f64 {
        if self.amplitude == 0.0 { 0.0 } else { self.amplitude * (TAU * x / self.period + self.phase).sin() }
    }
}

/// What joins the motor to the table when the drive is not rigid, at the motor.
#[derive(Clone, Copy, Debug)]
pub struct Coupling {
    pub stiffness: f64,
    pub damping: f64,
    /// Full width of the clearance, units of q.
    pub clearance: f64,
    /// Share of the inertia, and of the friction, on the table's side.
    pub inertia_share: f64,
    pub friction_share: f64,
}

#[derive(Clone, Debug)]
pub struct Truth {
    pub unit: f64,
    pub inertia: f64,
    pub coulomb: f64,
    pub viscous: f64,
    pub constant: f64,
    /// Half the difference of the Coulomb levels of the two directions.
    pub coulomb_by_direction: f64,
    pub asymmetry: f64,
    /// Torque, and speed in load units/s.
    pub stribeck: (f64, f64, f64),
    /// Dry friction is F·tanh(ω/this) where not 0.
    pub regularised: f64,
    /// Displacement in units of q; 0: set-valued Coulomb friction.
    pub presliding: f64,
    /// Damping ratio of the bristle on the inertia (LuGre's σ1); 0: Dahl.
    pub bristle_damping: f64,
    pub coupling: Option<Coupling>,
    pub cogging: Sine,
    /// Centre, peak, width (to 1/e) of a tight spot, and the exponent of its form.
    pub spot: (f64, f64, f64, f64),
    /// Slope per load unit, and the position of no force.
    pub cable: (f64, f64),
    /// Torque per (m/s)², 1 m = 1000 load units.
    pub drag: f64,
    /// Torque at the start, time constant in s.
    pub drift: (f64, f64),
    /// Period in s.
    pub vibration: Sine,
    /// Level, and delivered share beyond it.
    pub saturation: Option<(f64, f64)>,
    /// s; positive: the torque column is late.
    pub delay: f64,
    /// Table − encoder: scale (1), and periodic (load units).
    pub pitch: f64,
    pub pitch_wave: Sine,
    pub outside: Option<Outside>,
}

impl Truth {
    /// The machine that is exactly as believed.
    pub fn of(rig: &Rig) -> Self {
        let mut truth = Self {
            unit: rig.unit,
            inertia: rig.inertia,
            coulomb: rig.coulomb,
            viscous: rig.viscous,
            constant: rig.constant,
            coulomb_by_direction: 0.0,
            asymmetry: 0.0,
            stribeck: (0.0, 1.0, 2.0),
            regularised: 0.0,
            presliding: 0.0,
            bristle_damping: 0.0,
            coupling: None,
            cogging: Sine::default(),
            spot: (0.0, 0.0, 1.0, 2.0),
            cable: (0.0, 0.0),
            drag: 0.0,
            drift: (0.0, 1.0),
            vibration: Sine::default(),
            saturation: None,
            delay: 0.0,
            pitch: 0.0,
            pitch_wave: Sine::default(),
            outside: None,
        };
        rig.rough.apply(&mut truth);
        truth
    }

    /// Level F of the dry friction of the whole axis, sliding in `direction` at speed `w`.
    pub fn dry(&self, t: f64, q: f64, w: f64, direction: f64) -> f64 {
        let mut level = self.coulomb + self.coulomb_by_direction * direction;
        if self.stribeck.0 != 0.0 {
            level += self.stribeck.0 * (-(w * self.unit / self.stribeck.1).abs().powf(self.stribeck.2)).exp();
        }
        if self.spot.1 != 0.0 {
            level += self.spot.1 * (-((q * self.unit - self.spot.0) / self.spot.2).abs().powf(self.spot.3)).exp();
        }
        if self.drift.0 != 0.0 {
            level += self.drift.0 * (-t / self.drift.1).exp();
        }
        if let Some(o) = &self.outside {
            level += o.dry(t, w * self.unit);
        }
        level.max(0.05 * self.coulomb)
    }

    /// Resisting torque that is smooth in speed and belongs to friction: split with it between motor and table.
    pub fn slope(&self, w: f64) -> f64 {
        self.viscous * w + self.asymmetry * w.abs()
    }

    /// Torque that acts at the motor: ripple.
    pub fn at_motor(&self, q: f64) -> f64 {
        self.cogging.at(q * self.unit)
    }

    /// Torque that acts at the table: weight, cables, drag, vibration, what has no name.
    pub fn at_table(&self, t: f64, q: f64, w: f64) -> f64 {
        let x = q * self.unit;
        let mut torque = self.constant + self.cable.0 * (x - self.cable.1) + self.vibration.at(t);
        if self.drag != 0.0 {
            let v = w * self.unit * 1e-3;
            torque += self.drag * v * v.abs();
        }
        if let Some(o) = &self.outside {
            torque += o.torque(t, x, w * self.unit);
        }
        torque
    }

    /// What the motor delivers when its current says `torque`.
    pub fn delivered(&self, torque: f64) -> f64 {
        match self.saturation {
            Some((level, slope)) if torque.abs() > level => torque.signum() * (level + slope * (torque.abs() - level)),
            _ => torque,
        }
    }

    /// Where the table's scale stands when the table is at `x`, load units.
    pub fn scale_reads(&self, x: f64) -> f64 {
        x * (1.0 + self.pitch) + self.pitch_wave.at(x)
    }
}
