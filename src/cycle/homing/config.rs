//! What the caller asks for. [`super::plan`] checks it and derives the constants of a cycle.

/// Home position from the start of the torque–position line (default).
pub const GIB_HOMING_LINE: i32 = 0;
/// Home position where the torque limit was reached, as published. Depends on limit, speed and stiffness.
pub const GIB_HOMING_THRESHOLD: i32 = 1;

/// Clear the deviation by request: the kernel drops the undone way and acknowledges (default, as published).
pub const GIB_HOMING_CLEAR_DEVIATION: i32 = 0;
/// Clear the deviation without the kernel: the command jumps to the actual position (instant lag reduction).
pub const GIB_HOMING_INSTANT_LAG_REDUCTION: i32 = 1;

/// Positions in mm (default).
pub const GIB_POSITION_MM: i32 = 0;
/// Positions in degrees: read every `mm` of this family as degree, every `um` as a thousandth of a degree.
pub const GIB_POSITION_DEG: i32 = 1;

/// How to home. Zero in a field means its default; fields marked "required" have none.
///
/// The names are those of PLCopen's MC_HomeOnBlock and its vendors. Positions are motor positions in load units.
/// Torque fields are in N·m whatever `torque_unit` says.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct HomingConfig {
    /// Size of this struct as the caller knows it: `sizeof(gib_homing_config)`. Required.
    pub struct_size: u32,
    /// Toward the stop: +1 or -1. Required.
    pub direction: i32,
    /// 1: one motor (default). 2: a gantry, each motor with a stop of its own.
    pub motors: i32,
    /// `GIB_HOMING_LINE` (default) or `GIB_HOMING_THRESHOLD`: which is the home position. Both are reported.
    pub method: i32,
    /// `GIB_POSITION_MM` (default) or `GIB_POSITION_DEG`.
    pub position_unit: i32,
    /// Unit of the torque input: `GIB_TORQUE_NM` (default) or `GIB_TORQUE_PERMILLE` of `rated_torque_nm`.
    pub torque_unit: i32,
    /// 1: the drive's torque is negative toward positive positions (torque polarity inverted). 0 (default): not.
    pub torque_inverted: i32,
    /// `GIB_HOMING_CLEAR_DEVIATION` (default) or `GIB_HOMING_INSTANT_LAG_REDUCTION`.
    pub lag_reduction: i32,
    /// Touches that are measured, 1 to 10 (default 3), after a first one that only finds the stop.
    pub touches: i32,
    /// Requests that the kernel carries out without acknowledging: a sum of `GIB_HOMING_REQUEST_…` (default 0: it
    /// acknowledges all).
    pub unacknowledged: u32,
    /// Servo period, 0.00005 to 0.02 s. Required.
    pub cycle_s: f64,
    /// Speed on the way to the stop, 0.01 to 100 mm/s (default 1).
    pub approach_speed_mm_s: f64,
    /// Speed of the measured touches, 0.01 mm/s to the approach speed (default: the approach speed, at most 1; down to a
    /// quarter of that where the torque would rise to the limit within 25 ms).
    pub touch_speed_mm_s: f64,
    /// Largest commanded acceleration, 0.1 to 10000 mm/s² (default 50).
    pub acceleration_mm_s2: f64,
    /// Torque limit that the drive shall have in force until homing ends, 1e-6 to 1e6 N·m. Required.
    pub torque_limit_nm: f64,
    /// The torque counts as limiting within this of the limit, and beyond the limit by this it is a fault, N·m;
    /// 1 to 30 % of the limit (default 10 %).
    pub torque_tolerance_nm: f64,
    /// The axis stands when slower than this, 1e-6 mm/s to the approach speed (default a fifth of the touch speed, 0.05 at least, no more than
    /// the approach speed).
    pub detection_velocity_mm_s: f64,
    /// Time for which the torque must be limiting and the axis stand, 8 cycles to 5 s (default 0.1, 8 cycles at least).
    pub detection_time_s: f64,
    /// Smallest way from the start to the stop, 0 (default) to `distance_max_mm`: a stop before it is a fault.
    pub distance_min_mm: f64,
    /// Largest way that the axis may go toward the stop from where it stands at the start, 0.001 to 100000 mm. Required.
    pub distance_max_mm: f64,
    /// Time for the whole homing, a cycle to 100000 s (default: what its ways take, twice, and 10 s, as far as that is
    /// allowed).
    pub time_limit_s: f64,
    /// Largest |target - position|, 0.001 to 100 mm (default 1 mm and the way of 0.1 s).
    pub lag_limit_mm: f64,
    /// Coordinate of the place where the axis stands when homed, -1e6 to 1e6 mm (default 0).
    pub set_position_mm: f64,
    /// Way from the contact point to that place, away from the stop, 0 (default) to 1000 mm. There the axis must come within a tenth of
    /// `press_max_mm` of its command, or without torque within half of its way, in ten detection times, else `GIB_ERR_LAG`.
    pub zero_offset_mm: f64,
    /// Speed of that move, 0.01 to 500 mm/s (default: the approach speed).
    pub zero_offset_speed_mm_s: f64,
    /// Way back from the stop between touches, 0.05 to 100 mm (default 1). More than twice the lost motion. At the start the axis must
    /// stand further from the stop than that, else `GIB_ERR_HOMING_ON_STOP`.
    pub retract_mm: f64,
    /// Largest way from contact to the torque limit, 0.0001 mm to 0.4 of the retraction (default): more is a soft stop.
    pub press_max_mm: f64,
    /// Touches may differ by this, 0.1 to 1000 µm (default 5), besides their own uncertainty.
    pub touch_tolerance_um: f64,
    /// Gantry: largest difference of the two sides, 0.001 to 100 mm (default 0.2).
    pub square_tolerance_mm: f64,
    /// Time within which a request must be acknowledged, 2 cycles to 60 s (default 1).
    pub ack_timeout_s: f64,
    /// Rated torque, 1e-6 to 1e6 N·m. Required for `GIB_TORQUE_PERMILLE`.
    pub rated_torque_nm: f64,
}

impl HomingConfig {
    /// Size of the struct in the first published ABI.
    pub const FIRST_SIZE: usize = 208;
}
