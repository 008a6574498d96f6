//! What crosses the boundary in every servo cycle. These structs are frozen for an ABI major.

use super::config::GIB_VIBRATION_HARMONICS;

/// The accelerometer on the seat, the fixed part of the tool slide.
pub const GIB_VIBRATION_SEAT: usize = 0;
/// The accelerometer on the spindle bearing.
pub const GIB_VIBRATION_BEARING: usize = 1;

/// Not started: the position is the plain scale.
pub const GIB_VIBRATION_IDLE: i32 = 0;
/// No whole revolution yet, or no rotation: the correction is absent or on its way out.
pub const GIB_VIBRATION_WAITING: i32 = 1;
/// The position is corrected; `blend_ratio` says whether fully.
pub const GIB_VIBRATION_CORRECTING: i32 = 2;
/// A sensor is bad: the correction fades to the plain scale, and comes back after a good revolution.
pub const GIB_VIBRATION_DEGRADED: i32 = 3;
/// Aborted: the correction fades out.
pub const GIB_VIBRATION_STOPPING: i32 = 4;
/// Ended with an error; the position is the plain scale until the next start, once the correction has faded.
pub const GIB_VIBRATION_FAILED: i32 = 5;

/// Reason: no whole revolution since the start or since the last fault.
pub const GIB_VIBRATION_NO_REVOLUTION: u32 = 1;
/// Reason: the spindle does not turn, or too slowly.
pub const GIB_VIBRATION_NO_ROTATION: u32 = 2;
/// Reason: the spindle's angle is no number or jumps.
pub const GIB_VIBRATION_BAD_ANGLE: u32 = 4;
/// Reason: the seat's acceleration is no number. The bearing's is this, shifted left by 8; so for all below.
pub const GIB_VIBRATION_NOT_A_NUMBER: u32 = 0x0001_0000;
/// Reason: the acceleration is stuck: the same to the last digit for a quarter of a revolution.
pub const GIB_VIBRATION_STUCK: u32 = 0x0002_0000;
/// Reason: the acceleration is at its full scale.
pub const GIB_VIBRATION_SATURATED: u32 = 0x0004_0000;
/// Reason: acceleration or displacement beyond the largest plausible one.
pub const GIB_VIBRATION_IMPLAUSIBLE: u32 = 0x0008_0000;

/// What the kernel tells gib in a cycle, all of the same instant.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct VibrationInput {
    /// X linear scale: tool slide against its seat, mm.
    pub scale_mm: f64,
    /// Encoder of the second slide (XM), mm; only looked at with `second_slide`. Beyond 1e9 mm it counts as no number.
    pub second_slide_mm: f64,
    /// Spindle angle, degrees; wrapped anywhere or not at all.
    pub angle_deg: f64,
    /// Acceleration of seat and bearing, m/s², positive as the scale is.
    pub acceleration_m_s2: [f64; 2],
    /// `GIB_INPUT_ABORT`, `GIB_INPUT_FAULT`; other bits must be 0, else `GIB_ERR_CONFIG`. All fade the correction out.
    pub flags: u32,
    /// Zero.
    pub reserved: u32,
}

/// What gib gives back in a cycle. Always written, and finite, also when the call returns an error.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct VibrationOutput {
    /// Where the tool is against the workpiece: scale, second slide, and correction, mm.
    pub position_mm: f64,
    /// The correction that is in `position_mm`, µm.
    pub correction_um: f64,
    /// Displacement of seat and bearing, µm; the second slide's own motion is not in it.
    pub displacement_um: [f64; 2],
    /// Their difference, seat minus bearing, µm.
    pub relative_um: f64,
    /// Measured spindle speed, signed, rpm.
    pub speed_rpm: f64,
    /// How much of the relative displacement is in the position: 0, plain scale, to 1.
    pub blend_ratio: f64,
    /// What the step returned: `GIB_OK` idle, `GIB_BUSY`, or the first error.
    pub status: i32,
    /// One of the `GIB_VIBRATION_…` phases.
    pub phase: i32,
    /// 0, or the status to tell the operator about; its text is `gib_status_text`.
    pub message: i32,
    /// Why the plain scale is in force, or on its way: a sum of `GIB_VIBRATION_…` reasons, 0 when the correction is.
    pub reasons: u32,
}

/// What is known of the vibration. Amplitudes are those of `A·cos(kθ − phase)`.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct VibrationReport {
    /// Amplitude of the relative displacement at each harmonic from 1 on, µm; method harmonic only.
    pub amplitude_um: [f64; GIB_VIBRATION_HARMONICS],
    /// Its phase at spindle angle 0, degrees.
    pub phase_deg: [f64; GIB_VIBRATION_HARMONICS],
    /// Offset of each accelerometer, m/s².
    pub offset_m_s2: [f64; 2],
    /// What the harmonics leave of each acceleration, standard deviation, m/s²; method harmonic only.
    pub noise_m_s2: [f64; 2],
    /// Measured spindle speed, signed, rpm.
    pub speed_rpm: f64,
    /// Revolutions since the last time that the correction had to begin anew.
    pub revolutions: f64,
    /// Cycles since the start that the spindle turned and a bad sensor kept the correction out.
    pub degraded_cycles: u64,
    /// Every reason since the start.
    pub reasons_seen: u32,
    /// `GIB_BUSY`, `GIB_OK` before a start, or the first error.
    pub status: i32,
    /// `GIB_VIBRATION_HARMONIC` or `GIB_VIBRATION_INTEGRATE`.
    pub method: i32,
    /// Zero.
    pub reserved: i32,
}
