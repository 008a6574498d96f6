//! What crosses the boundary in every servo cycle. These structs are frozen for an ABI major.

/// Nothing is varied; the command is the speed asked for.
pub const GIB_SPEED_VARIATION_IDLE: i32 = 0;
/// The speed varies.
pub const GIB_SPEED_VARIATION_RUNNING: i32 = 1;
/// The speed goes back to its mean.
pub const GIB_SPEED_VARIATION_STOPPING: i32 = 2;
/// Ended as asked for, at the mean speed.
pub const GIB_SPEED_VARIATION_DONE: i32 = 3;
/// Ended with an error; kept until the next start.
pub const GIB_SPEED_VARIATION_FAILED: i32 = 4;

/// Input flag: end the variation; the speed goes back to its mean as it is asked for by then, then `GIB_DONE`.
pub const GIB_SPEED_VARIATION_STOP: u32 = 8;

/// What the kernel asks for in a cycle. Values may change in any cycle; a change takes effect within 20 cycles.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct SpeedVariationInput {
    /// Mean spindle speed, rpm, with override; within the configuration's limits and in its sense, else
    /// GIB_ERR_SPEED_VARIATION_SPEED ends the variation. Where nothing is varied: the speed asked for, of either sense, or 0.
    pub speed_rpm: f64,
    /// Amplitude as a share of the mean speed, up to 0.999; 0: as configured.
    pub amplitude_ratio: f64,
    /// Period, 0.02 s and 8 cycles to 600 s; 0: as configured.
    pub period_s: f64,
    /// Torque that cutting uses now, 0 to 1e6 N·m; the configuration's holds where that is more.
    pub cutting_nm: f64,
    /// `GIB_INPUT_FAULT`, `GIB_INPUT_ABORT`, `GIB_SPEED_VARIATION_STOP`; other bits must be 0.
    pub flags: u32,
    /// Zero.
    pub reserved: u32,
}

/// What gib asks of the kernel in a cycle. Always written, and safe, also when the call returns an error.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct SpeedVariationOutput {
    /// Commanded spindle speed, rpm.
    pub speed_command_rpm: f64,
    /// Torque that the commanded change of speed takes, J·ω', N·m: feed-forward for the drive.
    pub torque_nm: f64,
    /// Amplitude in effect: the one asked for, or the largest possible one where that is less; 0 until the first is worked
    /// out.
    pub amplitude_ratio: f64,
    /// Largest amplitude possible at the period, speed and cutting torque in effect.
    pub amplitude_limit_ratio: f64,
    /// Shortest period that the motor can do at the amplitude asked for and the speed and cutting torque in effect, s; 0: none.
    pub period_limit_s: f64,
    /// What the step returned: `GIB_OK`, `GIB_BUSY`, `GIB_DONE` or the first error.
    pub status: i32,
    /// One of the `GIB_SPEED_VARIATION_…` phases.
    pub phase: i32,
    /// Message number: 0, the error, or why the amplitude in effect is less than asked for.
    pub message: i32,
    /// Zero.
    pub reserved: i32,
}
