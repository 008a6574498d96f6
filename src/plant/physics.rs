//! What an axis's belief and effects say in numbers: the torques the motor must deliver at a place, speed and time.
//!
//! T = J·α + Tv·ω + A·|ω| + F + T0 + slope·(x − x0) + C·v·|v| + Σ a·sin(2π·x/p + φ) + Σ a·sin(2π·f·t + φ)
//!
//! with the friction level |F| ≤ Tc + Ts·exp(−(v/vs)²) + Σ peak·exp(−((x − c)/w)²) + drop·exp(−t/τ). Motor quantities
//! (J, ω, torques) are in the drive's own unit, x and v in load units (mm, mm/s; degrees on a rotary axis), t in s from
//! the recording's first row.

use super::friction::{BristleLaw, Friction};
use crate::machine::{Axis, Effect, TwoMasses};
use std::f64::consts::TAU;

/// Least share of the current beyond a motor's limit that must be delivered for the current to be told from the torque.
pub const LEAST_SLOPE: f64 = 0.02;

/// Change of a speed in a step, in those at which friction differs, that bends its friction; and from where on hardly any is left to differ.
const LEAST_BEND: f64 = 0.01;
const STRAIGHT: f64 = 10.0;

/// A sine in position or time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ripple {
    /// Torque in the drive's own unit; µm for a position error.
    pub amplitude: f64,
    /// Radians per load unit or per second.
    pub wave: f64,
    /// Radians.
    pub phase: f64,
}

impl Ripple {
    /// The value at a position or time.
    #[must_use]
    pub fn at(&self, x: f64) -> f64 {
        self.amplitude * (self.wave * x + self.phase).sin()
    }
}

/// A place along the stroke where friction differs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Spot {
    centre: f64,
    pub(super) peak: f64,
    pub(super) per_width: f64,
    /// Half of the exponent of the distance.
    pub(super) half_steepness: f64,
}

/// Friction that differs at low speed.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Stribeck {
    torque: f64,
    per_velocity: f64,
    /// Half of the exponent of the speed.
    half_exponent: f64,
}

impl Stribeck {
    /// The square of how many of its speeds a speed is.
    #[inline(always)]
    fn square(&self, v: f64) -> f64 {
        (v * self.per_velocity).powi(2)
    }
}

impl Spot {
    /// The square of how many widths a place is from its centre.
    #[inline(always)]
    pub(super) fn square(&self, x: f64) -> f64 {
        ((x - self.centre) * self.per_width).powi(2)
    }
}

/// From here on e^−x is less than a rounding of what it is added to; it is dear.
pub(super) const GONE: f64 = 40.0;

/// e^−xⁿ, where it is not gone.
#[inline]
fn fading(x: f64, n: f64) -> f64 {
    let power = if n == 1.0 { x } else { x.powf(n) };
    if power < GONE { (-power).exp() } else { 0.0 }
}

/// The numbers of an axis, ready for evaluation.
#[derive(Debug, Clone, PartialEq)]
pub struct Physics {
    /// Motor coordinate per load unit.
    pub motor_per_load: f64,
    /// J of motor and table together.
    pub inertia: f64,
    /// Motor and table, where something is between them.
    pub two_masses: Option<TwoMasses>,
    /// Bristle displacement at full Coulomb friction in the motor's coordinate, where friction builds over a displacement.
    pub presliding: Option<f64>,
    /// By what law.
    pub(super) bristle_law: BristleLaw,
    /// How late the torque column is, s.
    pub delay_s: f64,
    /// Torque ripple over the motor's position, in the order of the effects.
    pub cogging: Vec<Ripple>,
    /// Disturbances over time, in the order of the effects.
    pub vibration: Vec<Ripple>,
    /// Table against encoder: amplitude in µm, in the order of the effects.
    pub table_error: Vec<Ripple>,
    /// Table against encoder: share of the travel.
    pub table_scale: f64,
    /// Where the table's scale stands when the encoder says zero, load units: the two are homed apart.
    pub table_zero: f64,
    coulomb: f64,
    viscous: f64,
    asymmetry: f64,
    constant: f64,
    stribeck: Option<Stribeck>,
    pub(super) spots: Vec<Spot>,
    /// Drop, rate, and what is left of it when it counts as gone.
    drift: Option<(f64, f64, f64)>,
    cable: Option<(f64, f64)>,
    drag: f64,
    saturation: Option<(f64, f64)>,
}

impl Physics {
    /// The numbers of an axis; every ripple has phase zero until one is set.
    ///
    /// # Errors
    /// Effects that do not fit the inertia, as [`Axis::two_masses`].
    pub fn of(axis: &Axis) -> Result<Physics, String> {
        let belief = axis.belief();
        let mut p = Physics {
            motor_per_load: axis.drive.motor_per_load(),
            inertia: belief.inertia,
            two_masses: axis.two_masses()?,
            presliding: None,
            bristle_law: BristleLaw::default(),
            delay_s: 0.0,
            cogging: Vec::new(),
            vibration: Vec::new(),
            table_error: Vec::new(),
            table_scale: 0.0,
            table_zero: 0.0,
            coulomb: belief.coulomb,
            viscous: belief.viscous,
            asymmetry: 0.0,
            constant: belief.constant,
            stribeck: None,
            spots: Vec::new(),
            drift: None,
            cable: None,
            drag: 0.0,
            saturation: None,
        };
        let ripple = |amplitude, wave| Ripple { amplitude, wave, phase: 0.0 };
        for effect in &axis.effects {
            match *effect {
                // Done in the belief or in the two masses.
                Effect::InertiaMismatch { .. }
                | Effect::CoulombFrictionMismatch { .. }
                | Effect::ViscousFrictionMismatch { .. }
                | Effect::ConstantTorque { .. }
                | Effect::Backlash { .. }
                | Effect::DriveCompliance { .. } => {}
                Effect::DirectionDependentFriction { asymmetry } => p.asymmetry = asymmetry,
                Effect::StribeckFriction { torque, velocity_mm_s, exponent } => {
                    let (per_velocity, half_exponent) = (1.0 / velocity_mm_s, 0.5 * exponent);
                    p.stribeck = Some(Stribeck { torque, per_velocity, half_exponent });
                }
                Effect::PreslidingFriction { displacement_um, exponent, maxwell_slip, micro_damping_s } => {
                    p.presliding = Some(displacement_um * axis.drive.motor_per_um());
                    p.bristle_law = BristleLaw { exponent, of_elements: maxwell_slip > 0.5, micro_damping_s };
                }
                Effect::Cogging { amplitude, period_mm } => p.cogging.push(ripple(amplitude, TAU / period_mm)),
                Effect::PositionDependentFriction { centre_mm, peak, width_mm, steepness } => {
                    let (per_width, half_steepness) = (1.0 / width_mm, 0.5 * steepness);
                    p.spots.push(Spot { centre: centre_mm, peak, per_width, half_steepness });
                }
                Effect::CableForce { slope, zero_mm } => p.cable = Some((slope, zero_mm)),
                // v in m/s is 1e-3 of v in mm/s.
                Effect::QuadraticDrag { drag } => p.drag = drag * 1e-6,
                Effect::ThermalDrift { drop, time_constant_s, until_s } => {
                    let left = (-until_s / time_constant_s).exp();
                    let all = drop / (1.0 - left);
                    p.drift = Some((all, 1.0 / time_constant_s, all * left));
                }
                Effect::DeadTime { delay_ms } => p.delay_s = delay_ms * 1e-3,
                Effect::ExternalVibration { frequency_hz, amplitude } => {
                    p.vibration.push(ripple(amplitude, TAU * frequency_hz));
                }
                Effect::TorqueSaturation { limit, slope_ratio } => p.saturation = Some((limit, slope_ratio)),
                Effect::ScrewPitchError { scale_um_m } => p.table_scale = scale_um_m * 1e-6,
                Effect::ScrewPeriodicError { amplitude_um, period_mm } => {
                    p.table_error.push(ripple(amplitude_um, TAU / period_mm));
                }
            }
        }
        Ok(p)
    }

    /// Largest dry friction at a position, speed (load units) and time; never negative.
    #[must_use]
    #[inline]
    pub fn friction_level(&self, x: f64, v: f64, t: f64) -> f64 {
        let spots = self.spots.iter().map(|spot| spot.peak * fading(spot.square(x), spot.half_steepness)).sum();
        self.level(v, t, fading, spots, |t| fading(t, 1.0))
    }

    /// That level at many places and speeds, and the time of each; `fade` makes e^−squareⁿ of squares, n being half of an exponent, as exactly as its
    /// caller needs.
    #[must_use]
    pub fn friction_levels(
        &self,
        x: &[f64],
        v: &[f64],
        t: impl Fn(usize) -> f64,
        fade: impl Fn(&mut [f64], f64),
    ) -> Vec<f64> {
        let mut levels = vec![self.coulomb; v.len()];
        let mut add = |mut squares: Vec<f64>, n: f64, size: f64, less: f64| {
            fade(&mut squares, n);
            levels.iter_mut().zip(&squares).for_each(|(level, share)| *level += size * share - less);
        };
        if let Some(stribeck) = self.stribeck {
            add(v.iter().map(|v| stribeck.square(*v)).collect(), stribeck.half_exponent, stribeck.torque, 0.0);
        }
        for spot in &self.spots {
            add(x.iter().map(|x| spot.square(*x)).collect(), spot.half_steepness, spot.peak, 0.0);
        }
        if let Some((drop, per_time, left)) = self.drift {
            add((0..v.len()).map(|row| t(row) * per_time).collect(), 1.0, drop, left);
        }
        levels.iter_mut().for_each(|level| *level = level.max(0.0));
        levels
    }

    /// That level by what fades with speed, what tight spots add, and what fades with time.
    #[inline(always)]
    pub(super) fn level(
        &self,
        v: f64,
        t: f64,
        with_speed: impl FnOnce(f64, f64) -> f64,
        spots: f64,
        with_time: impl FnOnce(f64) -> f64,
    ) -> f64 {
        let mut level = self.coulomb + spots;
        if let Some(stribeck) = &self.stribeck {
            level += stribeck.torque * with_speed(stribeck.square(v), stribeck.half_exponent);
        }
        if let Some((drop, per_time, left)) = self.drift {
            level += drop * with_time(t * per_time) - left;
        }
        level.max(0.0)
    }

    /// Dry friction per bristle displacement, where friction builds over one.
    #[must_use]
    pub fn bristle_stiffness(&self) -> Option<f64> {
        // Without Coulomb friction the level at rest stands for it.
        let level = if self.coulomb > 0.0 { self.coulomb } else { self.friction_level(0.0, 0.0, 0.0) };
        self.presliding.map(|displacement| level / displacement)
    }

    /// Dry friction of a body that has a share of it, at rest.
    #[must_use]
    pub fn bristle(&self, share: f64) -> Friction {
        Friction::new(share * self.bristle_stiffness().unwrap_or(0.0), self.bristle_law)
    }

    /// Friction that grows with speed; `w` in the motor's coordinate.
    #[must_use]
    #[inline]
    pub fn slope_friction(&self, w: f64) -> f64 {
        self.slope_at(w) * w
    }

    /// Slope of that friction at a speed; `w` in the motor's coordinate.
    #[must_use]
    #[inline]
    pub fn slope_at(&self, w: f64) -> f64 {
        // Nothing waits for the speed where the slope is the same both ways.
        if self.asymmetry == 0.0 { self.viscous } else { self.viscous + self.asymmetry * w.signum() }
    }

    /// Tc alone.
    #[must_use]
    pub fn coulomb(&self) -> f64 {
        self.coulomb
    }

    /// T0 alone.
    #[must_use]
    pub fn constant_torque(&self) -> f64 {
        self.constant
    }

    /// Torque of the load that needs no motion of the axis's own: gravity, cable, drag, vibration.
    #[must_use]
    #[inline]
    pub fn load(&self, x: f64, v: f64, t: f64) -> f64 {
        self.still_load(x, v) + self.vibration.iter().map(|ripple| ripple.at(t)).sum::<f64>()
    }

    /// That torque without vibration.
    #[inline(always)]
    pub(super) fn still_load(&self, x: f64, v: f64) -> f64 {
        let mut torque = self.constant;
        if self.drag != 0.0 {
            torque += self.drag * v * v.abs();
        }
        if let Some((slope, zero)) = self.cable {
            torque += slope * (x - zero);
        }
        torque
    }

    /// Ripple of the motor at its position (load units).
    #[must_use]
    #[inline]
    pub fn cogging_torque(&self, x: f64) -> f64 {
        self.cogging.iter().map(|ripple| ripple.at(x)).sum()
    }

    /// Table position at an ideal one (load units): zero, pitch and periodic error of the screw.
    #[must_use]
    pub fn table_of(&self, x: f64) -> f64 {
        x * (1.0 + self.table_scale)
            + self.table_zero
            + 1e-3 * self.table_error.iter().map(|ripple| ripple.at(x)).sum::<f64>()
    }

    /// What the motor delivers when its current says `torque`.
    #[must_use]
    #[inline]
    pub fn delivered(&self, torque: f64) -> f64 {
        match self.saturation {
            Some((limit, slope)) if torque.abs() > limit => torque.signum() * (limit + slope * (torque.abs() - limit)),
            _ => torque,
        }
    }

    /// Half of the exponent of the speed by which friction differs where it is low.
    pub(super) fn half_exponent_of_speed(&self) -> f64 {
        self.stribeck.map_or(1.0, |stribeck| stribeck.half_exponent)
    }

    /// Whether friction differs at a speed that changes so much in a step from what it is at the middle; load units.
    #[inline(always)]
    pub(super) fn bends(&self, v: f64, change: f64) -> bool {
        self.stribeck.is_some_and(|Stribeck { per_velocity, .. }| {
            (change * per_velocity).abs() > LEAST_BEND && (v * per_velocity).abs() < STRAIGHT
        })
    }

    /// Whether a torque is beyond the limit that the motor delivers in full, and to which side.
    #[must_use]
    pub fn saturates(&self, torque: f64) -> Option<bool> {
        self.saturation.filter(|(limit, _)| torque.abs() > *limit).map(|_| torque > 0.0)
    }

    /// What the current says when the motor delivers `torque`; a motor that delivers nothing beyond its limit cannot say
    /// how far beyond it was driven, and the limit stands.
    #[must_use]
    pub fn indicated(&self, torque: f64) -> f64 {
        match self.saturation {
            Some((limit, slope)) if torque.abs() > limit => {
                let excess = if slope > LEAST_SLOPE { (torque.abs() - limit) / slope } else { 0.0 };
                torque.signum() * (limit + excess)
            }
            _ => torque,
        }
    }

    /// Whether nothing but base values and the two masses act: no term that needs position or time.
    #[must_use]
    pub fn is_plain(&self) -> bool {
        self.asymmetry == 0.0
            && self.stribeck.is_none()
            && self.spots.is_empty()
            && self.drift.is_none()
            && self.cable.is_none()
            && self.drag == 0.0
            && self.cogging.is_empty()
            && self.vibration.is_empty()
            && self.saturation.is_none()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::Machine;

    fn physics(effects: &str) -> Physics {
        let text = format!(
            r#"{{"schema":"gib.machine/1","name":"t","axes":[{{"name":"x","drive":"ball_screw","lead_mm":10,"inertia_kg_m2":0.003,
               "coulomb_friction_nm":0.5,"viscous_friction_nm_s":0.01,"constant_torque_nm":0.2,"effects":[{effects}]}}]}}"#
        );
        Physics::of(&Machine::parse(&text).unwrap().axes[0]).unwrap()
    }

    #[test]
    fn every_term_is_what_the_format_says() {
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} is not {b}");
        let e = (-1.0_f64).exp();
        let p = physics(
            r#"{"cause":"stribeck_friction","parameters":{"stribeck_torque_nm":0.3,"stribeck_velocity_mm_s":5}}"#,
        );
        near(p.friction_level(0.0, -5.0, 0.0), 0.5 + 0.3 * e);
        let p = physics(
            r#"{"cause":"position_dependent_friction","parameters":{"centre_mm":100,"peak_nm":0.3,"width_mm":7}}"#,
        );
        near(p.friction_level(93.0, 1.0, 0.0), 0.5 + 0.3 * e);
        let p = physics(r#"{"cause":"thermal_drift","parameters":{"drop_nm":0.3,"time_constant_s":20}}"#);
        near(p.friction_level(0.0, 1.0, 20.0), 0.5 + 0.3 * e);
        let p = physics(r#"{"cause":"thermal_drift","parameters":{"drop_nm":0.3,"time_constant_s":20,"until_s":20}}"#);
        near(p.friction_level(0.0, 1.0, 0.0), 0.5 + 0.3);
        near(p.friction_level(0.0, 1.0, 20.0), 0.5);
        let p = physics(r#"{"cause":"direction_dependent_friction","parameters":{"asymmetry_nm_s":0.004}}"#);
        near(p.slope_friction(10.0), 0.14);
        near(p.slope_friction(-10.0), -0.06);
        let p = physics(r#"{"cause":"cable_force","parameters":{"slope_nm_mm":0.001}}"#);
        near(p.load(50.0, 0.0, 0.0), 0.25);
        let p = physics(r#"{"cause":"quadratic_drag","parameters":{"drag_nm_s2_m2":2}}"#);
        near(p.load(0.0, -500.0, 0.0), 0.2 - 0.5);
        let p = physics(r#"{"cause":"cogging","parameters":{"amplitude_nm":0.1,"period_mm":2.5}}"#);
        near(p.cogging_torque(0.625), 0.1);
        let p = physics(r#"{"cause":"external_vibration","parameters":{"amplitude_nm":0.1,"frequency_hz":25}}"#);
        near(p.load(0.0, 0.0, 0.01), 0.3);
        let p = physics(r#"{"cause":"screw_pitch_error","parameters":{"scale_um_m":50}}"#);
        near(p.table_of(200.0), 200.01);
        let p = physics(r#"{"cause":"screw_periodic_error","parameters":{"amplitude_um":4,"period_mm":10}}"#);
        near(p.table_of(2.5), 2.504);
    }

    #[test]
    fn many_levels_are_those_of_each() {
        let p = physics(
            r#"{"cause":"stribeck_friction","parameters":{"stribeck_torque_nm":-0.54,"stribeck_velocity_mm_s":5,"stribeck_exponent":1.4}},
               {"cause":"position_dependent_friction","parameters":{"centre_mm":100,"peak_nm":0.3,"width_mm":7,"steepness":8}},
               {"cause":"thermal_drift","parameters":{"drop_nm":0.3,"time_constant_s":20,"until_s":200}}"#,
        );
        let rows: Vec<f64> = (0..200).map(f64::from).collect();
        let of = |scale: f64, zero: f64| rows.iter().map(|row| scale * row - zero).collect::<Vec<f64>>();
        let (x, v, t) = (of(1.0, 0.0), of(0.3, 20.0), of(1.1, 0.0));
        let levels =
            p.friction_levels(&x, &v, |i| t[i], |squares, n| squares.iter_mut().for_each(|s| *s = (-s.powf(n)).exp()));
        for i in 0..rows.len() {
            let own = p.friction_level(x[i], v[i], t[i]);
            assert!((levels[i] - own).abs() < 1e-12, "row {i}: {} is not {own}", levels[i]);
        }
    }

    #[test]
    fn a_dip_never_turns_friction_into_a_drive() {
        let p = physics(
            r#"{"cause":"stribeck_friction","parameters":{"stribeck_torque_nm":-0.52,"stribeck_velocity_mm_s":5}}"#,
        );
        assert_eq!(p.friction_level(0.0, 0.0, 0.0), 0.0);
    }

    #[test]
    fn saturation_and_its_inverse_agree() {
        let p = physics(r#"{"cause":"torque_saturation","parameters":{"limit_nm":4,"slope_ratio":0.25}}"#);
        assert_eq!((p.delivered(3.0), p.delivered(-8.0)), (3.0, -5.0));
        for torque in [-9.0, -4.0, 0.0, 2.0, 6.5] {
            assert!((p.indicated(p.delivered(torque)) - torque).abs() < 1e-12);
        }
    }
}
