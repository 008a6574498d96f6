//! Conversions between the units a field speaks and the ones gib computes in. One unit a quantity.

/// Micrometres in a millimetre.
pub const UM_PER_MM: f64 = 1000.0;

/// Revolutions per minute to radians per second.
#[must_use]
pub fn rad_s_from_rpm(rpm: f64) -> f64 {
    rpm * (core::f64::consts::TAU / 60.0)
}

/// Radians per second to revolutions per minute.
#[must_use]
pub fn rpm_from_rad_s(rad_s: f64) -> f64 {
    rad_s * (60.0 / core::f64::consts::TAU)
}

/// Torque in N·m from a share of the rated torque in per mille.
#[must_use]
pub fn nm_from_permille(permille: f64, rated_nm: f64) -> f64 {
    permille * 1e-3 * rated_nm
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rpm_and_back() {
        assert!((rad_s_from_rpm(60.0) - core::f64::consts::TAU).abs() < 1e-12);
        assert!((rpm_from_rad_s(rad_s_from_rpm(1234.5)) - 1234.5).abs() < 1e-9);
        assert!((nm_from_permille(250.0, 8.0) - 2.0).abs() < 1e-12);
    }
}
