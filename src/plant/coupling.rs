//! What passes between motor and table: a spring with damping, dead within the clearance.
//!
//! τ = k·(δ − c/2) + d·δ̇ beyond +c/2, mirrored beyond −c/2, nothing between; flanks push and never pull, so damping
//! cannot turn the sign. Without clearance it is the plain spring. δ = motor − table in the motor's coordinate.

use crate::machine::TwoMasses;

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
    fn flanks_push_and_never_pull() {
        assert_eq!(transmitted(&MASSES, 0.09, 5.0), 0.0);
        assert!((transmitted(&MASSES, 0.15, 0.0) - 5.0).abs() < 1e-12);
        assert!((transmitted(&MASSES, -0.15, -1.0) + 8.0).abs() < 1e-12);
        assert_eq!(transmitted(&MASSES, 0.15, -50.0), 0.0, "a leaving flank does not pull");
        let spring = TwoMasses { clearance: 0.0, ..MASSES };
        assert!((transmitted(&spring, 0.1, -50.0) + 140.0).abs() < 1e-12, "a shaft does");
    }
}
