//! The vocabulary of causes: what a simulation can get wrong, under the names and keys of the file format.
//!
//! One table makes the names, the keys, the ranges and the typed [`Effect`]; diagnosis, simulation, prediction and the
//! machine file all read it, so that a cause cannot mean two things.
//!
//! Sign and unit: every torque is the one the motor must deliver, in the drive's own unit (N·m at the motor shaft for
//! ball screw and rotary, N for linear). `mm` is the load's unit: on a rotary axis read 1 mm as 1 degree, 1 µm as
//! 0.001 degree and 1 m as 1000 degrees, as controls do.

use std::fmt;

/// One parameter of a cause.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameter {
    /// Key in the files for ball-screw and rotary drives.
    pub key: &'static str,
    /// Key in the files for linear drives.
    pub linear_key: &'static str,
    /// Another spelling that is understood when a linear machine is read, never written.
    pub linear_alias: &'static str,
    /// Smallest value allowed.
    pub low: f64,
    /// Largest value allowed.
    pub high: f64,
    /// The value of a key that is left out; `None` where the key is required.
    pub default: Option<f64>,
}

/// One row of the vocabulary.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CauseRow {
    /// The cause.
    pub cause: Cause,
    /// Its name in the files.
    pub name: &'static str,
    /// What it is, in one line.
    pub meaning: &'static str,
    /// Whether one axis may carry it more than once (several harmonics, several tight spots).
    pub repeatable: bool,
    /// Its parameters, in the order of the fields of [`Effect`].
    pub parameters: &'static [Parameter],
}

macro_rules! default_of {
    () => {
        None
    };
    ($value:expr) => {
        Some($value)
    };
}

macro_rules! vocabulary {
    ($( $(#[$doc:meta])* $variant:ident $name:literal $repeatable:ident $meaning:literal {
        $( $(#[$field_doc:meta])* $field:ident : $key:literal, $linear:literal, $alias:literal, $low:expr, $high:expr $(, = $default:expr)? ;)*
    } )*) => {
        /// The name of a cause.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum Cause { $( $(#[$doc])* $variant, )* }

        /// A cause with its parameters, in the drive's own unit: what an entry of `effects` says.
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub enum Effect { $( $(#[$doc])* $variant { $( $(#[$field_doc])* $field: f64, )* }, )* }

        /// The vocabulary, in the order of the file format's table.
        pub static CAUSES: &[CauseRow] = &[ $( CauseRow {
            cause: Cause::$variant, name: $name, meaning: $meaning, repeatable: vocabulary!(@flag $repeatable),
            parameters: &[ $( Parameter { key: $key, linear_key: $linear, linear_alias: $alias, low: $low, high: $high,
                default: default_of!($($default)?) }, )* ],
        }, )* ];

        impl Effect {
            /// The cause this effect is of.
            #[must_use]
            pub fn cause(&self) -> Cause {
                match self { $( Effect::$variant { .. } => Cause::$variant, )* }
            }

            /// The parameters' values, in the order of the cause's [`CauseRow::parameters`].
            #[must_use]
            pub fn values(&self) -> Vec<f64> {
                match *self { $( Effect::$variant { $( $field, )* } => vec![ $( $field, )* ], )* }
            }

            /// The effect of a cause from values in the order of [`CauseRow::parameters`]; trailing values that are
            /// missing take their defaults, and `None` comes back when a required one is missing or there are too many.
            #[must_use]
            pub fn from_values(cause: Cause, values: &[f64]) -> Option<Effect> {
                let parameters = cause.row().parameters;
                if values.len() > parameters.len() {
                    return None;
                }
                let mut next = parameters.iter().enumerate().map(|(i, p)| values.get(i).copied().or(p.default));
                match cause { $( Cause::$variant => Some(Effect::$variant { $( $field: next.next()??, )* }), )* }
            }
        }
    };
    (@flag once) => { false };
    (@flag many) => { true };
}

const HUGE: f64 = 1e9;
const TINY: f64 = 1e-12;

vocabulary! {
    /// The inertia (mass) is this instead of the base file's.
    InertiaMismatch "inertia_mismatch" once "inertia or mass differs from the belief" {
        /// kg·m² at the motor, kg for linear: replaces the base value.
        inertia: "inertia_kg_m2", "mass_kg", "inertia_kg_m2", TINY, HUGE;
    }
    /// The Coulomb friction is this instead of the base file's.
    CoulombFrictionMismatch "coulomb_friction_mismatch" once "Coulomb friction differs from the belief" {
        /// N·m or N: replaces the base value.
        torque: "coulomb_friction_nm", "coulomb_friction_n", "", 0.0, HUGE;
    }
    /// The viscous slope is this instead of the base file's.
    ViscousFrictionMismatch "viscous_friction_mismatch" once "viscous slope differs from the belief" {
        /// N·m·s/rad or N·s/m: replaces the base value.
        slope: "viscous_friction_nm_s", "viscous_friction_n_s", "viscous_friction_n_s_m", -HUGE, HUGE;
    }
    /// The constant torque is this instead of the base file's.
    ConstantTorque "constant_torque" once "gravity, counterbalance, or a Coulomb level that differs by direction" {
        /// N·m or N: replaces the base value.
        torque: "constant_torque_nm", "constant_torque_n", "constant_force_n", -HUGE, HUGE;
    }
    /// asymmetry·|ω|: the slope is larger by this one way and smaller by it the other way.
    DirectionDependentFriction "direction_dependent_friction" once "viscous slope differs by direction" {
        /// N·m·s/rad or N·s/m, added to the slope at positive speed and taken off it at negative speed.
        asymmetry: "asymmetry_nm_s", "asymmetry_n_s", "asymmetry_n_s_m", -HUGE, HUGE;
    }
    /// Ts·exp(−(v/vs)²)·sign(v); a negative Ts is a dip.
    StribeckFriction "stribeck_friction" once "extra friction at low speed" {
        /// Ts in N·m or N.
        torque: "stribeck_torque_nm", "stribeck_torque_n", "stribeck_force_n", -HUGE, HUGE;
        /// vs at the load.
        velocity_mm_s: "stribeck_velocity_mm_s", "stribeck_velocity_mm_s", "", TINY, HUGE;
        /// n: Gaussian with 2, exponential with 1.
        exponent: "stribeck_exponent", "stribeck_exponent", "", 0.1, 20.0, = 2.0;
    }
    /// Friction builds over a displacement after a reversal (Dahl, LuGre).
    PreslidingFriction "presliding_friction" once "friction builds over a displacement after reversal" {
        /// Coulomb force ÷ bristle stiffness, at the load.
        displacement_um: "presliding_um", "presliding_um", "", TINY, HUGE;
        /// How the stiffness falls on the way to the full level, as a power of what is left of it: 1 is the bristle of Dahl and LuGre.
        exponent: "exponent", "exponent", "", 0.0, 4.0, = 1.0;
        /// 1: not a bristle but elements that slip one after the other (Maxwell slip). The stiffness is then that of all of them
        /// together; an exponent of ½ is that of elements that break away evenly spread.
        maxwell_slip: "maxwell_slip", "maxwell_slip", "", 0.0, 1.0, = 0.0;
        /// Damping of the bristle ÷ its stiffness (micro-damping of LuGre), s.
        micro_damping_s: "micro_damping_s", "micro_damping_s", "", 0.0, 1.0, = 0.0;
    }
    /// Dead zone between motor and table.
    Backlash "backlash" once "dead zone between motor and table" {
        /// Full width, at the load.
        width_um: "backlash_um", "backlash_um", "", 0.0, HUGE;
        /// Share of the inertia that is on the table's side; drive_compliance overrules it.
        table_inertia_share: "table_inertia_share", "table_inertia_share", "", 0.01, 0.99, = 0.5;
        /// Share of Coulomb, viscous and the other friction that is on the table's side.
        table_friction_share: "table_friction_share", "table_friction_share", "", 0.0, 1.0, = 0.5;
        /// How stiff the flanks meet: the frequency of motor against table while they touch, Hz; drive_compliance overrules it.
        contact_hz: "contact_hz", "contact_hz", "", 1.0, 1e5, = 700.0;
        /// Damping ratio of that; drive_compliance overrules it.
        contact_damping_ratio: "contact_damping_ratio", "contact_damping_ratio", "", 0.0, 10.0, = 0.3;
    }
    /// Elastic drive. The frequency is that of the two free masses, √(k·(1/J₁+1/J₂))/2π: with the stiffness it gives both masses,
    /// but not which of them is the table.
    DriveCompliance "drive_compliance" once "elastic drive: resonance between motor and table" {
        /// Resonance of motor against table, Hz.
        resonance_hz: "resonance_hz", "resonance_hz", "", TINY, HUGE;
        /// Stiffness between motor and table, at the table.
        stiffness_n_um: "stiffness_n_um", "stiffness_n_um", "", TINY, HUGE;
        /// Share of the inertia on the table's side: above a half the table is the heavier mass, else the lighter one; the share
        /// itself follows from resonance and stiffness.
        table_inertia_share: "table_inertia_share", "table_inertia_share", "", 0.0, 1.0, = 0.5;
        /// Share of Coulomb, viscous and the other friction that is on the table's side.
        table_friction_share: "table_friction_share", "table_friction_share", "", 0.0, 1.0, = 0.5;
        /// Damping ratio of that resonance.
        damping_ratio: "damping_ratio", "damping_ratio", "", 0.0, 10.0, = 0.05;
    }
    /// amplitude·sin(2π·x/period + own phase).
    Cogging "cogging" many "torque ripple periodic in motor position" {
        /// N·m or N.
        amplitude: "amplitude_nm", "amplitude_n", "", 0.0, HUGE;
        /// At the load.
        period_mm: "period_mm", "period_mm", "", TINY, HUGE;
    }
    /// peak·exp(−|(x − centre)/width|ⁿ)·sign(v): n = 2 is a bell, a larger one a stretch with steep ends.
    PositionDependentFriction "position_dependent_friction" many "a tight spot or a change of friction along the stroke" {
        /// Where the spot is.
        centre_mm: "centre_mm", "centre_mm", "", -HUGE, HUGE;
        /// Extra friction there, N·m or N.
        peak: "peak_nm", "peak_n", "", -HUGE, HUGE;
        /// Distance from the centre at which 1/e of the peak is left.
        width_mm: "width_mm", "width_mm", "", TINY, HUGE, = 20.0;
        /// n, how steeply the friction changes at the ends.
        steepness: "steepness", "steepness", "", 0.5, 200.0, = 2.0;
    }
    /// slope·(x − zero).
    CableForce "cable_force" once "force proportional to position" {
        /// N·m/mm or N/mm.
        slope: "slope_nm_mm", "slope_n_mm", "", -HUGE, HUGE;
        /// Position at which the force is zero.
        zero_mm: "zero_mm", "zero_mm", "", -HUGE, HUGE, = 0.0;
    }
    /// C·v·|v|, v in m/s at the load.
    QuadraticDrag "quadratic_drag" once "torque that grows with the square of speed" {
        /// N·m·s²/m² or N·s²/m².
        drag: "drag_nm_s2_m2", "drag_n_s2_m2", "", -HUGE, HUGE;
    }
    /// drop·(exp(−t/τ) − w)/(1 − w)·sign(v) with w = exp(−until/τ), t from the recording's first row: what is gone at last, or at
    /// a time before.
    ThermalDrift "thermal_drift" once "friction decays as the machine warms" {
        /// Friction that has gone once warm, N·m or N.
        drop: "drop_nm", "drop_n", "", -HUGE, HUGE;
        /// τ.
        time_constant_s: "time_constant_s", "time_constant_s", "", TINY, HUGE;
        /// When that has gone, s; the friction goes on falling. At last, as a rule.
        until_s: "until_s", "until_s", "", TINY, HUGE, = HUGE;
    }
    /// The torque column is late against the position column by this much (early where negative).
    DeadTime "dead_time" once "torque and position columns are not of one instant" {
        /// Torque logged at t is that of t − delay.
        delay_ms: "delay_ms", "delay_ms", "", -1000.0, 1000.0;
    }
    /// amplitude·sin(2π·f·t + own phase).
    ExternalVibration "external_vibration" many "a disturbance periodic in time, not in position" {
        /// Hz.
        frequency_hz: "frequency_hz", "frequency_hz", "", TINY, HUGE;
        /// N·m or N.
        amplitude: "amplitude_nm", "amplitude_n", "", 0.0, HUGE;
    }
    /// Up to the limit the motor delivers what its current says, above it only `slope_ratio` of the excess.
    TorqueSaturation "torque_saturation" once "beyond a level the motor delivers less torque than its current says" {
        /// N·m or N, both directions.
        limit: "limit_nm", "limit_n", "", TINY, HUGE;
        /// Delivered share of what the current says beyond the limit.
        slope_ratio: "slope_ratio", "slope_ratio", "", 0.0, 1.0, = 0.5;
    }
    /// table = encoder·(1 + scale·10⁻⁶).
    ScrewPitchError "screw_pitch_error" once "table and encoder differ in scale" {
        /// µm per m of travel.
        scale_um_m: "scale_um_m", "scale_um_m", "", -1e5, 1e5;
    }
    /// table = encoder + amplitude·sin(2π·x/period + own phase).
    ScrewPeriodicError "screw_periodic_error" many "table and encoder differ periodically with the screw" {
        /// µm.
        amplitude_um: "amplitude_um", "amplitude_um", "", 0.0, HUGE;
        /// At the load.
        period_mm: "period_mm", "period_mm", "", TINY, HUGE;
    }
}

impl Parameter {
    /// The key under which the parameter stands in a file of a machine with such a drive.
    #[must_use]
    pub fn key_for(&self, linear: bool) -> &'static str {
        if linear { self.linear_key } else { self.key }
    }
}

impl Cause {
    /// The cause of that name in the files.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Cause> {
        CAUSES.iter().find(|row| row.name == name).map(|row| row.cause)
    }

    /// The cause's row of the vocabulary.
    #[must_use]
    pub fn row(self) -> &'static CauseRow {
        // The table is written by the macro that writes the enum, in the same order.
        &CAUSES[self as usize]
    }

    /// The cause's name in the files.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.row().name
    }
}

impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl Effect {
    /// Keys and values as a file of such a drive has them, optional parameters included.
    pub fn keyed_values(&self, linear: bool) -> impl Iterator<Item = (&'static str, f64)> {
        self.cause().row().parameters.iter().map(move |p| p.key_for(linear)).zip(self.values())
    }

    /// Whether a machine file may hold it: every value is a number within the range of its key.
    #[must_use]
    pub fn is_allowed(&self) -> bool {
        self.cause().row().parameters.iter().zip(self.values()).all(|(p, value)| (p.low..=p.high).contains(&value))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The table of the file format, written out a second time by hand: a slip in either shows.
    const CONTRACT: &[(&str, &[&str])] = &[
        ("inertia_mismatch", &["inertia_kg_m2"]),
        ("coulomb_friction_mismatch", &["coulomb_friction_nm"]),
        ("viscous_friction_mismatch", &["viscous_friction_nm_s"]),
        ("constant_torque", &["constant_torque_nm"]),
        ("direction_dependent_friction", &["asymmetry_nm_s"]),
        ("stribeck_friction", &["stribeck_torque_nm", "stribeck_velocity_mm_s"]),
        ("presliding_friction", &["presliding_um"]),
        ("backlash", &["backlash_um"]),
        ("drive_compliance", &["resonance_hz", "stiffness_n_um"]),
        ("cogging", &["amplitude_nm", "period_mm"]),
        ("position_dependent_friction", &["centre_mm", "peak_nm"]),
        ("cable_force", &["slope_nm_mm"]),
        ("quadratic_drag", &["drag_nm_s2_m2"]),
        ("thermal_drift", &["drop_nm", "time_constant_s"]),
        ("dead_time", &["delay_ms"]),
        ("external_vibration", &["frequency_hz", "amplitude_nm"]),
        ("torque_saturation", &["limit_nm"]),
        ("screw_pitch_error", &["scale_um_m"]),
        ("screw_periodic_error", &["amplitude_um", "period_mm"]),
    ];

    #[test]
    fn names_and_required_keys_are_the_contract_s() {
        assert_eq!(CAUSES.len(), CONTRACT.len());
        for (row, (name, keys)) in CAUSES.iter().zip(CONTRACT) {
            let required: Vec<_> = row.parameters.iter().filter(|p| p.default.is_none()).map(|p| p.key).collect();
            assert_eq!((row.name, required.as_slice()), (*name, *keys));
            assert_eq!(row.cause.row(), row, "order of table and enum");
            assert_eq!(Cause::from_name(name), Some(row.cause));
        }
    }

    #[test]
    fn linear_keys_say_n_where_the_others_say_nm() {
        for parameter in CAUSES.iter().flat_map(|row| row.parameters) {
            if parameter.key != "inertia_kg_m2" {
                assert_eq!(parameter.linear_key, parameter.key.replace("_nm", "_n"));
            }
        }
    }

    #[test]
    fn values_and_effect_are_one() {
        for row in CAUSES {
            let values: Vec<f64> = (1..=row.parameters.len()).map(|i| i as f64 * 0.1).collect();
            let effect = Effect::from_values(row.cause, &values).unwrap();
            assert_eq!((effect.cause(), effect.values()), (row.cause, values.clone()));
            assert!(Effect::from_values(row.cause, &[]).is_none(), "every cause has a required parameter");
        }
        let spot = Effect::from_values(Cause::PositionDependentFriction, &[1.0, 2.0]).unwrap();
        assert_eq!(
            spot,
            Effect::PositionDependentFriction { centre_mm: 1.0, peak: 2.0, width_mm: 20.0, steepness: 2.0 }
        );
    }

    #[test]
    fn what_a_file_may_hold_ends_at_the_range_of_each_key() {
        for (scale_um_m, allowed) in [(1e5, true), (-1e5, true), (-1.1e5, false), (f64::NAN, false)] {
            assert_eq!(Effect::ScrewPitchError { scale_um_m }.is_allowed(), allowed, "{scale_um_m}");
        }
    }
}
