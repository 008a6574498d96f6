//! What crosses the boundary in every servo cycle. These structs are frozen for an ABI major.

/// Not started: the command is the target.
pub const GIB_LEARNING_IDLE: i32 = 0;
/// The spindle does not turn, or no position is detected; the correction is out or on its way.
pub const GIB_LEARNING_WAITING: i32 = 1;
/// The machine settles after a change.
pub const GIB_LEARNING_SETTLE: i32 = 2;
/// The deviation is measured over whole revolutions.
pub const GIB_LEARNING_MEASURE: i32 = 3;
/// The next correction is computed, a point or a harmonic a cycle.
pub const GIB_LEARNING_EVALUATE: i32 = 4;
/// The new correction replaces the old one, over a revolution.
pub const GIB_LEARNING_BLEND: i32 = 5;
/// Within the tolerance; the correction stays in force.
pub const GIB_LEARNING_DONE: i32 = 6;
/// The correction fades out, to end with an error.
pub const GIB_LEARNING_STOPPING: i32 = 7;
/// Ended with an error, kept until the next start. The best correction stays in force after `GIB_ERR_LEARNING_GROWS` and
/// `GIB_ERR_LEARNING_UPDATES`, none after any other.
pub const GIB_LEARNING_FAILED: i32 = 8;

/// Reason: the spindle does not turn, or too slowly.
pub const GIB_LEARNING_NO_ROTATION: u32 = 1;
/// Reason: the spindle's angle is no number or jumps.
pub const GIB_LEARNING_BAD_ANGLE: u32 = 2;
/// Reason: the detected position is no number.
pub const GIB_LEARNING_NOT_DETECTED: u32 = 4;
/// Reason: the correction is kept, and the spindle turns at another speed than that at which it was learnt, by more than
/// `speed_tolerance_ratio` over eight times `revolutions`: what is left is more than it was. By more than half of that speed, or
/// the other way round, it would do harm, and is out until the speed is back.
pub const GIB_LEARNING_SPEED_CHANGED: u32 = 8;
/// No step gives this reason: of a correction at its bound `correction_um` of the report is `correction_max_um`.
pub const GIB_LEARNING_LIMITED: u32 = 16;

/// What the kernel tells gib in a cycle, all of the same instant.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct LearningInput {
    /// Where the tool is to be now, mm.
    pub target_mm: f64,
    /// Where it was detected now, mm: the corrected position of family `vibration`, or a scale.
    pub detected_mm: f64,
    /// Spindle angle, degrees; wrapped anywhere or not at all.
    pub angle_deg: f64,
    /// `GIB_INPUT_ABORT`, `GIB_INPUT_FAULT`; other bits must be 0, else `GIB_ERR_CONFIG`. All fade the correction out.
    pub flags: u32,
    /// Zero.
    pub reserved: u32,
}

/// What gib gives back in a cycle. Always written, and finite, also when the call returns an error.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct LearningOutput {
    /// What to command in place of the target, mm.
    pub command_mm: f64,
    /// The correction in it, µm.
    pub correction_um: f64,
    /// What the step returned: `GIB_OK` idle, `GIB_BUSY`, `GIB_DONE`, or the first error.
    pub status: i32,
    /// One of the `GIB_LEARNING_…` phases.
    pub phase: i32,
    /// 0, or the status to tell the operator about; its text is `gib_status_text`.
    pub message: i32,
    /// A sum of `GIB_LEARNING_…` reasons why learning waits or is held back, else 0.
    pub reasons: u32,
}

/// How far learning has come. Deviations are root mean squares over a revolution.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct LearningReport {
    /// Deviation before the first update, µm.
    pub first_um: f64,
    /// Deviation of the last measurement, µm.
    pub last_um: f64,
    /// Smallest so far, µm, at the present speed.
    pub best_um: f64,
    /// Largest |deviation| at a point in the last measurement, µm.
    pub peak_um: f64,
    /// Largest |correction| in force, µm.
    pub correction_um: f64,
    /// Speed of the last measurement, signed, rpm.
    pub speed_rpm: f64,
    /// Updates so far.
    pub updates: i32,
    /// Updates that were taken back because the deviation grew.
    pub rejected: i32,
    /// Points of a revolution.
    pub points: i32,
    /// `GIB_OK` before a start, `GIB_BUSY`, `GIB_DONE`, or the first error.
    pub status: i32,
}

/// One point of the revolution.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct LearningPoint {
    /// Spindle angle, -180 to 180 degrees.
    pub angle_deg: f64,
    /// Where the tool is to be, mm.
    pub target_mm: f64,
    /// What is commanded, mm.
    pub command_mm: f64,
    /// Where the tool was detected in the last measurement, its mean, mm; the target where it was not.
    pub detected_mm: f64,
}
