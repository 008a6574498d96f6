//! What a fit of a curve starts from, and what it finds.

use super::rounding::Rounded;

/// What is known of a reversal besides its curve. Torques in the curve's unit and sense.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Levels {
    /// Sliding torque before the reversal, in the new sense: negative for a healthy axis.
    pub before: f64,
    /// Sliding torque after the reversal: positive.
    pub after: f64,
    /// Friction on the motor's side, at least 0.
    pub motor: f64,
    /// Variance of D = after − before − 2·motor.
    pub variance: f64,
}

impl Levels {
    /// The change of the spring's torque between sliding one way and the other.
    #[must_use]
    pub fn spring_change(&self) -> f64 {
        self.after - self.before - 2.0 * self.motor
    }
}

/// The fitted curve and what follows from it. Lengths in mm, torques in the curve's unit.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Fitted {
    /// Lost motion.
    pub lost_motion: f64,
    /// Its variance, mm².
    pub variance: f64,
    /// Clearance s2 − s1.
    pub clearance: f64,
    /// Elastic wind-up D/k.
    pub windup: f64,
    /// Travel from the reversal to the clearance: the wind-up that was still held at standstill.
    pub held: f64,
    /// Stiffness k.
    pub stiffness: f64,
    /// Standard error of k.
    pub stiffness_error: f64,
    /// Torque across the clearance.
    pub level: f64,
    /// Its standard error.
    pub level_error: f64,
    /// Standard deviation of one torque sample about the fitted curve.
    pub noise: f64,
    /// Share of the wind-up, from the clearance up, that was used.
    pub share: f64,
    /// Standard deviation of the lost motion from what the drive was wound at the turn, mm, the same in every repeat; 0 where the release
    /// is on the curve.
    pub turn_error: f64,
    /// True when residuals show structure at every share: the curve has not the expected shape.
    pub structured: bool,
    /// The same curve with the table's presliding; `None` where that cannot be told.
    pub rounded: Option<Rounded>,
}

impl Fitted {
    /// How far the drive was wound at the end of sliding, from which the release begins, mm; `None` where a load that no friction holds
    /// never lets the spring go slack. `bin`: of the curve, mm.
    #[must_use]
    pub fn wound(&self, levels: &Levels, bin: f64) -> Option<f64> {
        let (middle, change) = (0.5 * (levels.before + levels.after), levels.spring_change());
        if middle.abs() > 0.5 * change {
            return None;
        }
        // One straight line does not tell whether the middle is a load or the sensor's zero: the one that leaves less counts.
        let slack = if self.clearance < bin { levels.motor + middle.min(0.0) } else { self.level };
        Some(((slack - levels.before - 2.0 * levels.motor) / self.stiffness).max(0.0))
    }

    /// What the curve says where the table does not give way before it slides.
    #[must_use]
    pub fn straight(&self) -> Rounded {
        let Fitted { lost_motion, variance, clearance, stiffness, .. } = *self;
        Rounded { lost_motion, variance, fit_variance: variance, clearance, stiffness, level: None }
    }

    /// What the curve says, with the table's presliding taken off where it is `told` and can be.
    #[must_use]
    pub fn curve(&self, told: bool) -> Rounded {
        self.rounded.filter(|_| told).unwrap_or(self.straight())
    }
}
