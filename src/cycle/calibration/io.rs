//! What crosses the boundary in every servo cycle. These structs are frozen for an ABI major.

/// Nothing is asked for.
pub const GIB_CALIBRATION_IDLE: i32 = 0;
/// The amplitude rises.
pub const GIB_CALIBRATION_RISE: i32 = 1;
/// Torque and signals are looked at, to find the largest amplitude allowed.
pub const GIB_CALIBRATION_PROBE: i32 = 2;
/// Amplitude and phase are measured.
pub const GIB_CALIBRATION_MEASURE: i32 = 3;
/// The amplitude falls, before the next frequency.
pub const GIB_CALIBRATION_FALL: i32 = 4;
/// The axis stands at its start while the gains are computed, a frequency a cycle.
pub const GIB_CALIBRATION_EVALUATE: i32 = 5;
/// The amplitude falls, to end with an error.
pub const GIB_CALIBRATION_STOPPING: i32 = 6;
/// Ended well.
pub const GIB_CALIBRATION_DONE: i32 = 7;
/// Ended with an error; kept until the next start.
pub const GIB_CALIBRATION_FAILED: i32 = 8;

/// What the kernel tells gib in a cycle, all of the same instant.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct CalibrationInput {
    /// Position of the driven axis, mm.
    pub position_mm: f64,
    /// Its motor torque, in the unit of the configuration.
    pub torque: f64,
    /// Ball bar between the accelerometers, seat minus bearing, µm.
    pub ball_bar_um: f64,
    /// Acceleration of seat and bearing, m/s².
    pub acceleration_m_s2: [f64; 2],
    /// `GIB_INPUT_FAULT`, `GIB_INPUT_ABORT`; other bits must be 0, else `GIB_ERR_CONFIG`.
    pub flags: u32,
    /// Zero.
    pub reserved: u32,
}

/// What gib asks of the kernel in a cycle. Always written, and safe, also when the call returns an error.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct CalibrationOutput {
    /// Commanded position, mm. To be followed while `owns_motion` is 1.
    pub target_position_mm: f64,
    /// Commanded speed, mm/s, signed.
    pub target_speed_mm_s: f64,
    /// Present frequency, Hz; after GIB_ERR_CALIBRATION_GAIN or _CONDITION the one whose gain was refused, and `point` its number.
    pub frequency_hz: f64,
    /// Present amplitude, mm.
    pub amplitude_mm: f64,
    /// What the step returned: `GIB_OK`, `GIB_BUSY`, `GIB_DONE` or the first error.
    pub status: i32,
    /// One of the `GIB_CALIBRATION_…` phases.
    pub phase: i32,
    /// 0, or the error to tell the operator about; its text is `gib_status_text`.
    pub message: i32,
    /// 1 while gib commands the axis, else 0.
    pub owns_motion: i32,
    /// 1: position or drive cannot be trusted; take the torque off the motor and brake it, until the next start.
    pub stop_drive: i32,
    /// Present frequency in the list, counted from 0.
    pub point: i32,
}
