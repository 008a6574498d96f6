//! Splits an axis into motor and table where an effect puts something between them.
//!
//! Elastic drive: two free masses on a spring swing at ω² = k·(1/J₁ + 1/J₂). With J₁ + J₂ = J known this is
//! J₁·J₂ = k·J/ω², so J₁,₂ = J/2·(1 ± √(1 − 4k/(J·ω²))); the table is taken as the lighter one.
//! (Two-mass drive, e.g. Groß/Hamann/Wiegärtner, *Electrical Feed Drives in Automation*, ch. 4.)

use super::{Axis, Effect};
use std::f64::consts::TAU;

/// An axis as motor and table, everything in the motor's coordinate and the drive's own unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TwoMasses {
    /// Inertia or mass on the motor's side.
    pub motor_inertia: f64,
    /// Inertia or mass on the table's side.
    pub table_inertia: f64,
    /// N·m/rad or N/m.
    pub stiffness: f64,
    /// N·m·s/rad or N·s/m, while in contact.
    pub damping: f64,
    /// Full dead zone, rad or m.
    pub clearance: f64,
    /// Share of all friction that acts on the table.
    pub table_friction_share: f64,
}

impl TwoMasses {
    /// What the motor must hold of a torque of angular frequency ω that shakes the table as it slides, as a share of it, and by what angle
    /// that is late, rad: the table swings under it, (k + icω)/(k − J₂ω² + i(c + φ·Tv)·ω), by the slope Tv of all viscous friction.
    #[must_use]
    pub fn passes(&self, omega: f64, viscous: f64) -> (f64, f64) {
        let damped = self.damping * omega;
        let slowed = damped + self.table_friction_share * viscous * omega;
        let swings = self.stiffness - self.table_inertia * omega * omega;
        let share = self.stiffness.hypot(damped) / swings.hypot(slowed).max(1e-300);
        (share, slowed.atan2(swings) - damped.atan2(self.stiffness))
    }
}

impl Axis {
    /// Motor and table, where an effect (backlash, drive compliance) sets them apart; `None` for a rigid axis.
    ///
    /// # Errors
    /// Resonance and stiffness do not fit the inertia: the sentence says which frequency would.
    pub fn two_masses(&self) -> Result<Option<TwoMasses>, String> {
        let inertia = self.belief().inertia;
        let mut backlash = None;
        let mut compliance = None;
        for effect in &self.effects {
            match *effect {
                Effect::Backlash { .. } => backlash = Some(effect),
                Effect::DriveCompliance { .. } => compliance = Some(effect),
                _ => {}
            }
        }
        let clearance = match backlash {
            Some(Effect::Backlash { width_um, .. }) => width_um * self.drive.motor_per_um(),
            _ => 0.0,
        };
        if let Some(&Effect::DriveCompliance {
            resonance_hz,
            stiffness_n_um,
            table_inertia_share,
            table_friction_share,
            damping_ratio,
        }) = compliance
        {
            let omega = TAU * resonance_hz;
            let stiffness = self.drive.motor_stiffness(stiffness_n_um);
            let root = 1.0 - 4.0 * stiffness / (inertia * omega * omega);
            // A hair below zero is rounding of equal masses, whose frequency has four digits or more.
            if root < -1e-3 {
                let least = (4.0 * stiffness / inertia).sqrt() / TAU;
                return Err(format!(
                    "drive_compliance: resonance_hz {:.4} is too low for {stiffness_n_um} N/µm and the axis's inertia; \
                     two masses that make up this inertia swing at {least:.4} Hz or more",
                    omega / TAU
                ));
            }
            let apart = root.max(0.0).sqrt() * if table_inertia_share > 0.5 { 1.0 } else { -1.0 };
            let table_inertia = 0.5 * inertia * (1.0 + apart);
            let motor_inertia = inertia - table_inertia;
            let damping = 2.0 * damping_ratio * stiffness / omega;
            return Ok(Some(TwoMasses {
                motor_inertia,
                table_inertia,
                stiffness,
                damping,
                clearance,
                table_friction_share,
            }));
        }
        let Some(&Effect::Backlash {
            table_inertia_share,
            table_friction_share,
            contact_hz,
            contact_damping_ratio,
            ..
        }) = backlash
        else {
            return Ok(None);
        };
        let table_inertia = table_inertia_share * inertia;
        let motor_inertia = inertia - table_inertia;
        let omega = TAU * contact_hz;
        let stiffness = omega * omega * motor_inertia * table_inertia / inertia;
        let damping = 2.0 * contact_damping_ratio * stiffness / omega;
        Ok(Some(TwoMasses { motor_inertia, table_inertia, stiffness, damping, clearance, table_friction_share }))
    }
}

#[cfg(test)]
mod tests {
    use super::super::Machine;
    use super::*;

    fn axis(effects: &str) -> Result<Axis, String> {
        let text = format!(
            r#"{{"schema":"gib.machine/1","name":"t","axes":[{{"name":"x","drive":"ball_screw","lead_mm":10,"inertia_kg_m2":0.003,"effects":[{effects}]}}]}}"#
        );
        Machine::parse(&text).map(|m| m.axes[0].clone()).map_err(|e| e.to_string())
    }

    #[test]
    fn masses_swing_at_the_resonance_asked_for() {
        let effect = r#"{"cause":"drive_compliance","parameters":{"resonance_hz":90,"stiffness_n_um":80}}"#;
        let m = axis(effect).unwrap().two_masses().unwrap().unwrap();
        let hz = (m.stiffness * (1.0 / m.motor_inertia + 1.0 / m.table_inertia)).sqrt() / TAU;
        assert!((hz - 90.0).abs() < 1e-9, "{hz}");
        assert!((m.motor_inertia + m.table_inertia - 0.003).abs() < 1e-15 && m.table_inertia < m.motor_inertia);
        // Damping ratio of the relative motion: d·(1/J1 + 1/J2)/(2ω).
        let ratio = m.damping * (1.0 / m.motor_inertia + 1.0 / m.table_inertia) / (2.0 * TAU * 90.0);
        assert!((ratio - 0.05).abs() < 1e-9, "{ratio}");
    }

    #[test]
    fn the_table_is_the_heavier_mass_where_its_share_says_so() {
        let share = |told: &str| {
            let effect = format!(
                r#"{{"cause":"drive_compliance","parameters":{{"resonance_hz":90,"stiffness_n_um":80{told}}}}}"#
            );
            axis(&effect).unwrap().two_masses().unwrap().unwrap().table_inertia / 0.003
        };
        let light = share("");
        assert!(light < 0.5 && share(r#","table_inertia_share":0.5"#) == light);
        assert!((share(r#","table_inertia_share":0.6"#) - (1.0 - light)).abs() < 1e-12);
    }

    #[test]
    fn equal_masses_may_be_rounded() {
        let at = |hz: f64| {
            axis(&format!(r#"{{"cause":"drive_compliance","parameters":{{"resonance_hz":{hz},"stiffness_n_um":80}}}}"#))
        };
        let equal = (4.0 * axis("").unwrap().drive.motor_stiffness(80.0) / 0.003).sqrt() / TAU;
        let masses = at((equal * 1e3).floor() / 1e3).unwrap().two_masses().unwrap().unwrap();
        assert!((masses.table_inertia / masses.motor_inertia - 1.0).abs() < 1e-9 && at(0.99 * equal).is_err());
    }

    #[test]
    fn impossible_pair_is_refused_with_the_frequency_that_would_do() {
        let effect = r#"{"cause":"drive_compliance","parameters":{"resonance_hz":5,"stiffness_n_um":80}}"#;
        let error = axis(effect).unwrap_err();
        assert!(error.contains("too low") && error.contains("Hz or more"), "{error}");
    }

    #[test]
    fn a_rigid_axis_has_one_mass() {
        let effect = r#"{"cause":"cogging","parameters":{"amplitude_nm":0.1,"period_mm":2.5}}"#;
        assert_eq!(axis(effect).unwrap().two_masses(), Ok(None));
    }
}
