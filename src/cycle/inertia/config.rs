//! What the caller asks for. [`super::plan`] checks it and derives the constants of a cycle.

/// gib commands the spindle speed: up, hold, down, hold, `ramps` times (default).
pub const GIB_INERTIA_RAMP: i32 = 0;
/// The kernel turns the spindle as it likes; gib listens for `listen_s`, or until `GIB_INERTIA_FINISH`.
pub const GIB_INERTIA_LISTEN: i32 = 1;
/// Torque inputs in amperes, times `torque_constant_nm_a`.
pub const GIB_TORQUE_AMPERE: i32 = 2;

/// What to measure and within which bounds. Zero in a field means its default; fields marked "required" have none.
///
/// Torque fields are in N·m whatever `torque_unit` says; all are at the spindle.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct InertiaConfig {
    /// Size of this struct as the caller knows it: `sizeof(gib_inertia_config)`. Required.
    pub struct_size: u32,
    /// `GIB_INERTIA_RAMP` (default) or `GIB_INERTIA_LISTEN`.
    pub mode: i32,
    /// Unit of the torque input: `GIB_TORQUE_NM` (default), `GIB_TORQUE_PERMILLE` of `rated_torque_nm`, or
    /// `GIB_TORQUE_AMPERE` times `torque_constant_nm_a`.
    pub torque_unit: i32,
    /// Times up and down, 1 to 50 (default 2; of 1 the report says `one_acceleration`). There is room for some 20 short ramps up and down; of more, the first count.
    pub ramps: i32,
    /// Process step that the value will belong to, 0 for the whole program, to 9999. Given back in the report.
    pub process_step: i32,
    /// Must be 0.
    pub reserved: i32,
    /// Servo period, 0.00005 to 0.02 s. Required.
    pub cycle_s: f64,
    /// Speed at which the ramps begin, rpm, without a sign: `standstill_rpm` to 0.9 of |`speed_high_rpm`| (default a tenth of it).
    pub speed_low_rpm: f64,
    /// Speed at which the ramps end, rpm, ten times `standstill_rpm` to 200000. Required for ramps. Negative: turns the other way.
    pub speed_high_rpm: f64,
    /// Acceleration of the ramps, rpm/s; every second one has 0.6 of it, so that a motor that saturates is not taken for another
    /// inertia. A ramp must take at most 600 s, and at least twice `takeup_s` and 16 cycles more than it. Required for ramps.
    pub acceleration_rpm_s: f64,
    /// Time at constant speed after each ramp, a cycle to 60 s (default 0.3).
    pub hold_s: f64,
    /// Time after each change of acceleration or sense that is left out: take-up of belts and gears, and the
    /// drive's own transients, up to 5 s (default 0.1).
    pub takeup_s: f64,
    /// Longest time to listen, 256 cycles to 3600 s. Required for `GIB_INERTIA_LISTEN`, where `GIB_INERTIA_FINISH` may end it at any
    /// moment; not used by `GIB_INERTIA_RAMP`, 0 to 3600 s.
    pub listen_s: f64,
    /// Speed below which the spindle counts as standing, rpm, up to 1000 (default 1).
    pub standstill_rpm: f64,
    /// Speed above which the field is weakened, so that current × constant is not the torque; what is faster is left
    /// out, rpm (default: none known).
    pub base_speed_rpm: f64,
    /// Torque above which the motor saturates, so that it delivers less than reported; what is above is left out,
    /// N·m (default: none known).
    pub saturation_nm: f64,
    /// Largest |torque| allowed, N·m (default: not watched).
    pub torque_bound_nm: f64,
    /// Largest |command - speed| allowed, 0.001 to 400000 rpm (default: a quarter of `speed_high_rpm`).
    pub lag_limit_rpm: f64,
    /// Rated torque, 1e-6 to 1e6 N·m. Required for `GIB_TORQUE_PERMILLE`.
    pub rated_torque_nm: f64,
    /// Torque constant, 1e-9 to 1e6 N·m/A. Required for `GIB_TORQUE_AMPERE`.
    pub torque_constant_nm_a: f64,
    /// The machine's own inertia (spindle, rotor, chuck), kg·m²; taken off, so that the value belongs to the workpiece
    /// and travels to another machine (default 0: nothing is taken off).
    pub own_inertia_kg_m2: f64,
    /// Its expanded uncertainty (k = 2), 0 (default) to 1e6 kg·m².
    pub own_uncertainty_kg_m2: f64,
    /// Expanded uncertainty wanted, as a share of the total inertia, 0.001 to 0.25 (default 0.05). The report says
    /// which ramp would reach it.
    pub target_ratio: f64,
}

impl InertiaConfig {
    /// Size of the struct in the first published ABI.
    pub const FIRST_SIZE: usize = 160;
}
