//! `machine.json`: what the simulation believes about a machine, and the effects that extend the belief.
//!
//! Base belief of an axis, in the drive's own unit (motor shaft rad and N·m for ball screw and rotary, m and N for linear):
//!
//! T = J·α + Tv·ω + Tc·sign(ω) + T0
//!
//! Each [`Effect`] adds to it or replaces one of its values; [`Axis::belief`] is the base file with the replacements
//! done. Load units are mm, on a rotary axis degrees.

pub mod calibration;
mod cause;
mod json;
pub mod learning;
pub mod load_table;
mod read;
mod two_masses;
mod whole;
mod write;

pub use cause::{CAUSES, Cause, CauseRow, Effect, Parameter};
pub use read::Error;
pub use two_masses::TwoMasses;

use crate::units::UM_PER_MM;

/// A machine file.
#[derive(Debug, Clone, PartialEq)]
pub struct Machine {
    /// Free text.
    pub name: String,
    /// At least one axis, each name once.
    pub axes: Vec<Axis>,
    /// Keys of the file that have no meaning here, as JSON paths: ignored, but worth saying, since one may be a slip.
    pub ignored_keys: Vec<String>,
}

/// One axis: base belief, servo and effects.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// The axis letter, lower case, as in the channels of a recording.
    pub name: String,
    /// How motor motion becomes load motion.
    pub drive: Drive,
    /// Pole pairs of the motor, where known: where cogging is to be expected.
    pub motor_pole_pairs: Option<u32>,
    /// The base values.
    pub base: Belief,
    /// The servo, where the file has one; without it there is no closed loop to simulate.
    pub servo: Option<Servo>,
    /// What extends the base.
    pub effects: Vec<Effect>,
}

/// The numbers of the base model, in the drive's own unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Belief {
    /// J: kg·m² at the motor, kg for linear. Positive.
    pub inertia: f64,
    /// Tc: N·m or N.
    pub coulomb: f64,
    /// Tv: N·m·s/rad or N·s/m.
    pub viscous: f64,
    /// T0: N·m or N, the torque that holds the axis still against gravity.
    pub constant: f64,
    /// Largest torque the servo commands; infinite where the file has none.
    pub torque_limit: f64,
}

/// How the motor drives the load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Drive {
    /// Rotating motor on a screw.
    BallScrew {
        /// Travel per motor revolution.
        lead_mm: f64,
    },
    /// Linear motor: motor and load are one.
    Linear,
    /// Rotating motor on a rotary table.
    Rotary {
        /// Motor revolutions per revolution of the load.
        ratio: f64,
    },
}

/// The digital position servo (files.md "The servo that a machine file describes, exactly").
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Servo {
    /// Cycle.
    pub period_s: f64,
    /// Kp.
    pub position_gain_1_s: f64,
    /// Kv: N·m·s at the motor, N·s/m for linear.
    pub velocity_gain: f64,
    /// Ti; `None` means no integral.
    pub velocity_integral_time_s: Option<f64>,
    /// Share of the commanded velocity that is fed forward.
    pub velocity_feedforward: f64,
    /// First-order lag of the motor's torque; zero means none.
    pub torque_time_constant_s: f64,
    /// How velocity is made from position.
    pub velocity_estimate: VelocityEstimate,
}

/// How the servo makes velocity from the encoder.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum VelocityEstimate {
    /// (x[i] − x[i−1])/Ts.
    BackwardDifference,
    /// Backward difference of the mean of two samples: (x[i] − x[i−2])/(2·Ts).
    TwoSampleMean,
}

impl Drive {
    /// Motor coordinate (rad; m for linear) per load unit (mm; degree for rotary).
    #[must_use]
    pub fn motor_per_load(self) -> f64 {
        use std::f64::consts::TAU;
        match self {
            Drive::BallScrew { lead_mm } => TAU / lead_mm,
            Drive::Linear => 1e-3,
            Drive::Rotary { ratio } => ratio * TAU / 360.0,
        }
    }

    /// Motor travel per µm (0.001 degree for rotary) of the load.
    #[must_use]
    pub fn motor_per_um(self) -> f64 {
        self.motor_per_load() / UM_PER_MM
    }

    /// Stiffness in the motor's coordinate (N·m/rad; N/m for linear) of one in N/µm at the load.
    ///
    /// A force F at the load is the motor torque F·(load travel per motor travel); for a rotary load the torque is in
    /// N·m and one "µm" is 0.001 degree.
    #[must_use]
    pub fn motor_stiffness(self, stiffness_n_um: f64) -> f64 {
        let per_um = self.motor_per_um();
        match self {
            // Force in N times travel in m per motor unit, 1 µm = 1e-6 m.
            Drive::BallScrew { .. } | Drive::Linear => stiffness_n_um * 1e-6 / (per_um * per_um),
            Drive::Rotary { ratio } => stiffness_n_um / (ratio * per_um),
        }
    }

    /// Whether the drive's own unit is the newton.
    #[must_use]
    pub fn is_linear(self) -> bool {
        self == Drive::Linear
    }

    /// Whether the load turns, so that its unit is the degree.
    #[must_use]
    pub fn is_rotary(self) -> bool {
        matches!(self, Drive::Rotary { .. })
    }

    /// The drive's name in the file.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Drive::BallScrew { .. } => "ball_screw",
            Drive::Linear => "linear",
            Drive::Rotary { .. } => "rotary",
        }
    }

    /// `torque` or `force`: the word in column and channel names.
    #[must_use]
    pub fn torque_word(self) -> &'static str {
        if self.is_linear() { "force" } else { "torque" }
    }

    /// `nm` or `n`: the unit in column names and keys.
    #[must_use]
    pub fn torque_unit(self) -> &'static str {
        if self.is_linear() { "n" } else { "nm" }
    }

    /// `mm` or `deg`: the load's unit in column names.
    #[must_use]
    pub fn load_unit(self) -> &'static str {
        if self.is_rotary() { "deg" } else { "mm" }
    }
}

impl Machine {
    /// The axis of that name.
    #[must_use]
    pub fn axis(&self, name: &str) -> Option<&Axis> {
        self.axes.iter().find(|axis| axis.name == name)
    }
}

impl Axis {
    /// The base values with those effects done that replace one of them.
    #[must_use]
    pub fn belief(&self) -> Belief {
        let mut belief = self.base;
        for effect in &self.effects {
            match *effect {
                Effect::InertiaMismatch { inertia } => belief.inertia = inertia,
                Effect::CoulombFrictionMismatch { torque } => belief.coulomb = torque,
                Effect::ViscousFrictionMismatch { slope } => belief.viscous = slope,
                Effect::ConstantTorque { torque } => belief.constant = torque,
                _ => {}
            }
        }
        belief
    }

    /// The same axis with these effects in place of its own.
    #[must_use]
    pub fn with_effects(&self, effects: Vec<Effect>) -> Axis {
        Axis { effects, ..self.clone() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn motor_travel_of_each_drive() {
        use std::f64::consts::TAU;
        assert!((Drive::BallScrew { lead_mm: 10.0 }.motor_per_load() * 10.0 - TAU).abs() < 1e-12);
        assert!((Drive::Linear.motor_per_load() * 1000.0 - 1.0).abs() < 1e-12);
        assert!((Drive::Rotary { ratio: 90.0 }.motor_per_load() * 4.0 - TAU).abs() < 1e-12);
    }

    #[test]
    fn stiffness_keeps_its_energy() {
        // 100 N/µm wound by 3 µm stores ½·k·x²; the same wind-up in motor coordinates must store as much.
        let energy_j = 0.5 * 100.0 * 3.0 * 3.0 * 1e-6;
        for drive in [Drive::BallScrew { lead_mm: 10.0 }, Drive::Linear] {
            let motor = 3.0 * drive.motor_per_um();
            assert!((0.5 * drive.motor_stiffness(100.0) * motor * motor / energy_j - 1.0).abs() < 1e-12);
        }
        // Rotary: 2 N·m per 0.001 degree, wound by 0.003 degree.
        let rotary = Drive::Rotary { ratio: 36.0 };
        let (motor, load) = (3.0 * rotary.motor_per_um(), 0.003_f64.to_radians());
        let energy_j = 0.5 * (2.0 / 0.001_f64.to_radians()) * load * load;
        assert!((0.5 * rotary.motor_stiffness(2.0) * motor * motor / energy_j - 1.0).abs() < 1e-12);
    }

    #[test]
    fn mismatches_replace_and_others_leave_the_belief() {
        let base = Belief { inertia: 1.0, coulomb: 2.0, viscous: 3.0, constant: 4.0, torque_limit: 5.0 };
        let axis = Axis {
            name: "x".into(),
            drive: Drive::Linear,
            motor_pole_pairs: None,
            base,
            servo: None,
            effects: vec![
                Effect::InertiaMismatch { inertia: 1.5 },
                Effect::ConstantTorque { torque: -4.0 },
                Effect::Cogging { amplitude: 9.0, period_mm: 2.5 },
            ],
        };
        assert_eq!(axis.belief(), Belief { inertia: 1.5, constant: -4.0, ..base });
    }
}
