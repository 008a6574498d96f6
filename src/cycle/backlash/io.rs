//! What crosses the boundary in every servo cycle. These structs are frozen for an ABI major.

use crate::error::{Fault, GIB_ERR_ABORTED, GIB_ERR_CONFIG, GIB_ERR_DRIVE_FAULT};

/// The axis stands; gib asks for nothing.
pub const GIB_BACKLASH_IDLE: i32 = 0;
/// Waits until the compensation amount is 0 and reversal acceleration off.
pub const GIB_BACKLASH_CLEAR: i32 = 1;
/// Moves to the next reference position.
pub const GIB_BACKLASH_APPROACH: i32 = 2;
/// Slides back from the reference: sliding torque of the coming scan's sense.
pub const GIB_BACKLASH_SLIDE_BACK: i32 = 3;
/// Slides to the reference: sliding torque before the reversal.
pub const GIB_BACKLASH_SLIDE_IN: i32 = 4;
/// Rests before the reversal.
pub const GIB_BACKLASH_SETTLE: i32 = 5;
/// Reversed: steps or feeds slowly and records the torque curve.
pub const GIB_BACKLASH_SCAN: i32 = 6;
/// Goes a few µm back and forth while the table sticks: friction on the motor's side.
pub const GIB_BACKLASH_PROBE: i32 = 7;
/// Stands while the curve is evaluated in slices.
pub const GIB_BACKLASH_EVALUATE: i32 = 8;
/// Waits until the new amount is in force and reversal acceleration back.
pub const GIB_BACKLASH_WRITE: i32 = 9;
/// Brakes before everything changed is restored.
pub const GIB_BACKLASH_STOPPING: i32 = 10;
/// Waits until the old amount is in force and reversal acceleration back.
pub const GIB_BACKLASH_RESTORE: i32 = 11;
/// Ended well.
pub const GIB_BACKLASH_DONE: i32 = 12;
/// Ended with an error; kept until the next start.
pub const GIB_BACKLASH_FAILED: i32 = 13;

/// Input flag: the drive is faulted, or not under the kernel's control.
pub const GIB_INPUT_FAULT: u32 = 1;
/// Input flag: abort, as `gib_backlash_abort` does.
pub const GIB_INPUT_ABORT: u32 = 2;

/// The fault that flags tell where there are any. What says neither means something that this library does not know.
#[cold]
#[must_use]
pub fn flagged(flags: u32) -> Fault {
    if flags & GIB_INPUT_ABORT != 0 {
        return Fault::of(GIB_ERR_ABORTED);
    }
    if flags & GIB_INPUT_FAULT != 0 {
        return Fault::of(GIB_ERR_DRIVE_FAULT);
    }
    let (value, high) = (f64::from(flags), f64::from(GIB_INPUT_FAULT | GIB_INPUT_ABORT));
    Fault { code: GIB_ERR_CONFIG, field: "flags\0", value, low: 0.0, high }
}

/// What the kernel tells gib in a cycle.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct BacklashInput {
    /// Motor position in load units, mm, without any compensation in it.
    pub position_mm: f64,
    /// Motor torque, positive toward positive positions, in the unit that the configuration names.
    pub torque: f64,
    /// Compensation amount in force in the kernel now, µm.
    pub compensation_um: f64,
    /// `request_id` of the last request that the kernel has carried out; 0 before the first.
    pub acknowledged_id: u32,
    /// `GIB_INPUT_FAULT`, `GIB_INPUT_ABORT`; other bits must be 0, else `GIB_ERR_CONFIG`.
    pub flags: u32,
}

/// What gib asks of the kernel in a cycle. Always written, and safe, also when the call returns an error.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct BacklashOutput {
    /// Commanded motor position, mm. To be followed while `owns_motion` is 1.
    pub target_position_mm: f64,
    /// Commanded speed, mm/s, signed.
    pub target_speed_mm_s: f64,
    /// Compensation amount that the kernel shall put in force, µm. Valid once `request_id` is not 0.
    pub compensation_um: f64,
    /// Way left in the present move, mm.
    pub remaining_mm: f64,
    /// Share of the measurement done, 0 to 1.
    pub progress_ratio: f64,
    /// What the step returned: `GIB_OK`, `GIB_BUSY`, `GIB_DONE` or the first error.
    pub status: i32,
    /// One of the `GIB_BACKLASH_…` phases.
    pub phase: i32,
    /// Message number: 0, or the error to tell the operator about; its text is `gib_status_text`.
    pub message: i32,
    /// 1 while gib commands the axis, else 0.
    pub owns_motion: i32,
    /// 1: the kernel shall keep reversal acceleration off. 0: as it is configured there.
    pub reversal_acceleration_off: i32,
    /// Number of the request above: when it changes, put `compensation_um` and `reversal_acceleration_off` in
    /// force, then give the number back in `acknowledged_id`. 0: no request was made yet.
    pub request_id: u32,
}
