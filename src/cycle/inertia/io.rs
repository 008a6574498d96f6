//! What crosses the boundary in every servo cycle. These structs are frozen for an ABI major.

/// Nothing is going on; the command follows the speed.
pub const GIB_INERTIA_IDLE: i32 = 0;
/// Goes to the speed at which the ramps begin.
pub const GIB_INERTIA_APPROACH: i32 = 1;
/// Accelerates.
pub const GIB_INERTIA_UP: i32 = 2;
/// Holds the upper speed.
pub const GIB_INERTIA_HOLD_HIGH: i32 = 3;
/// Brakes.
pub const GIB_INERTIA_DOWN: i32 = 4;
/// Holds the lower speed.
pub const GIB_INERTIA_HOLD_LOW: i32 = 5;
/// Listens while the kernel turns the spindle.
pub const GIB_INERTIA_LISTENING: i32 = 6;
/// Goes back to the speed at which it was started.
pub const GIB_INERTIA_RETURN: i32 = 7;
/// Ended; the result can be read.
pub const GIB_INERTIA_DONE: i32 = 8;
/// Ended with an error; kept until the next start.
pub const GIB_INERTIA_FAILED: i32 = 9;

/// Input flag: listening has lasted long enough; evaluate what was gathered.
pub const GIB_INERTIA_FINISH: u32 = 4;

/// What the kernel tells gib in a cycle.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct InertiaInput {
    /// Spindle speed, rpm, signed.
    pub speed_rpm: f64,
    /// Motor torque of the same instant, positive toward positive speed, in the unit that the configuration names.
    pub torque: f64,
    /// `GIB_INPUT_FAULT`, `GIB_INPUT_ABORT`, `GIB_INERTIA_FINISH`; other bits must be 0.
    pub flags: u32,
    /// Zero.
    pub reserved: u32,
}

/// What gib asks of the kernel in a cycle. Always written, and safe, also when the call returns an error.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct InertiaOutput {
    /// Commanded spindle speed, rpm. To be followed while `owns_motion` is 1.
    pub speed_command_rpm: f64,
    /// Share of the measurement done, 0 to 1.
    pub progress_ratio: f64,
    /// What the step returned: `GIB_OK`, `GIB_BUSY`, `GIB_DONE` or the first error.
    pub status: i32,
    /// One of the `GIB_INERTIA_…` phases.
    pub phase: i32,
    /// Message number: 0, or the error to tell the operator about; its text is `gib_status_text`.
    pub message: i32,
    /// 1 while gib commands the spindle, else 0.
    pub owns_motion: i32,
}
