//! What the caller asks for. [`super::plan`] checks it and derives the constants of a cycle.

use super::table::GIB_CALIBRATION_POINTS;

/// Complex gains by least squares over all experiments (default).
pub const GIB_CALIBRATION_LEAST_SQUARES: i32 = 0;
/// Gains from the last experiment alone, as published, with the signs put right; phases stay 0.
pub const GIB_CALIBRATION_PUBLISHED: i32 = 1;

/// How to calibrate. Zero in a field means its default; fields marked "required" have none.
///
/// The axis swings about the place where it stands. Torque fields are in N·m whatever `torque_unit` says.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct CalibrationConfig {
    /// Size of this struct as the caller knows it: `sizeof(gib_calibration_config)`. Required.
    pub struct_size: u32,
    /// `GIB_CALIBRATION_LEAST_SQUARES` (default) or `GIB_CALIBRATION_PUBLISHED`.
    pub method: i32,
    /// 1: one more experiment, at the same frequencies, beside those that this instance holds. 0 (default): the first.
    pub add: i32,
    /// Frequencies in the list, 1 to 32. Required.
    pub frequencies: i32,
    /// Unit of the torque input: `GIB_TORQUE_NM` (default) or `GIB_TORQUE_PERMILLE` of `rated_torque_nm`.
    pub torque_unit: i32,
    /// Zero.
    pub reserved: i32,
    /// The frequencies, rising by 1 % at least, 0.5 Hz to a tenth of the cycle frequency. Each is moved by less than half a percent, so
    /// that whole periods take whole cycles. Required.
    pub frequency_hz: [f64; GIB_CALIBRATION_POINTS],
    /// Servo period, 0.00005 to 0.02 s. Required.
    pub cycle_s: f64,
    /// Largest amplitude, 0.001 to 1000 mm to either side. Required.
    pub stroke_mm: f64,
    /// Largest speed, 0.1 to 10000 mm/s (default 100).
    pub speed_mm_s: f64,
    /// Largest acceleration, 1 to 1000000 mm/s² (default 5000).
    pub acceleration_mm_s2: f64,
    /// Torque that must never be exceeded, 1e-6 to 1e6 N·m. Required.
    pub torque_bound_nm: f64,
    /// Part of it that the amplitude is chosen for, 0.05 to 0.9 (default 0.6).
    pub torque_share_ratio: f64,
    /// Rated torque, N·m. Required for `GIB_TORQUE_PERMILLE`.
    pub rated_torque_nm: f64,
    /// Full scale of the accelerometers, 0.1 to 10000 m/s². Required.
    pub acceleration_range_m_s2: f64,
    /// Full scale of the ball bar, 1 to 1000000 µm (default 1000).
    pub ball_bar_range_um: f64,
    /// What the accelerometers' makers promise of their gain, as a standard deviation, 0.001 to 1 (default 0.1). A gain that is off
    /// by more than three of it is refused. It is taken of the complex gain, along and across: where the experiments do not tell a
    /// phase (see `condition_ratio`) it is believed to be 0 within 4 degrees for 0.1, one standard deviation. A sensor that may come
    /// late by more needs more: a cycle is 18 degrees at a twentieth of the cycle frequency, which takes 0.3.
    pub tolerance_ratio: f64,
    /// Time of measuring at each frequency, 0.1 to 1000 s (default 4), rounded up to 32 periods at least.
    pub measure_s: f64,
    /// Time in which the amplitude goes up or down, 0.01 to 10 s (default 0.5), five periods at least; turned round on its way up, a
    /// quarter more.
    pub ramp_s: f64,
    /// Largest |target - position|, 0.0001 to 100 mm (default the stroke).
    pub lag_limit_mm: f64,
}

impl CalibrationConfig {
    /// Size of the struct in the first published ABI.
    pub const FIRST_SIZE: usize = 384;
}
