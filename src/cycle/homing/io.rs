//! What crosses the boundary in every servo cycle. These structs are frozen for an ABI major.

/// The axis stands; gib asks for nothing.
pub const GIB_HOMING_IDLE: i32 = 0;
/// Waits until the torque limit is in force.
pub const GIB_HOMING_LIMIT: i32 = 1;
/// Moves to the stop and presses.
pub const GIB_HOMING_TOUCH: i32 = 2;
/// Goes back between two touches.
pub const GIB_HOMING_RETRACT: i32 = 3;
/// Waits until the deviation is cleared.
pub const GIB_HOMING_CLEAR: i32 = 4;
/// Stands while a touch is evaluated in slices.
pub const GIB_HOMING_EVALUATE: i32 = 5;
/// Moves off the stop by the zero offset.
pub const GIB_HOMING_OFFSET: i32 = 6;
/// Waits until the position is set and the old torque limit in force.
pub const GIB_HOMING_SET: i32 = 7;
/// Brakes before everything changed is restored.
pub const GIB_HOMING_STOPPING: i32 = 8;
/// Takes the pressure off the stop.
pub const GIB_HOMING_UNLOAD: i32 = 9;
/// Waits until the old torque limit is in force.
pub const GIB_HOMING_RESTORE: i32 = 10;
/// Ended well.
pub const GIB_HOMING_DONE: i32 = 11;
/// Ended with an error; kept until the next start.
pub const GIB_HOMING_FAILED: i32 = 12;

/// Event: the way to the stop begins.
pub const GIB_HOMING_EVENT_APPROACH: u32 = 1;
/// Event: the torque has risen to the limit, something is touched.
pub const GIB_HOMING_EVENT_CONTACT: u32 = 2;
/// Event: torque limiting; the axis stood under it for the detection time.
pub const GIB_HOMING_EVENT_LIMITING: u32 = 4;
/// Event: the kernel is asked to clear the deviation.
pub const GIB_HOMING_EVENT_CLEAR_REQUESTED: u32 = 8;
/// Event: the kernel has acknowledged it.
pub const GIB_HOMING_EVENT_CLEAR_ACKNOWLEDGED: u32 = 16;
/// Event: the command is where the axis is.
pub const GIB_HOMING_EVENT_CLEARED: u32 = 32;
/// Event: the zero-offset move begins.
pub const GIB_HOMING_EVENT_OFFSET: u32 = 64;
/// Event: homed.
pub const GIB_HOMING_EVENT_HOMED: u32 = 128;

/// Request: put `torque_limit` in force in the drive.
pub const GIB_HOMING_REQUEST_TORQUE_LIMIT: u32 = 1;
/// Request: drop the undone way, so that the kernel's command is the actual position.
pub const GIB_HOMING_REQUEST_CLEAR_DEVIATION: u32 = 2;
/// Request: add `shift_mm` to the encoder's position: it becomes the machine coordinate.
pub const GIB_HOMING_REQUEST_SET_POSITION: u32 = 4;

/// What the kernel tells gib in a cycle. Arrays: motor 1, motor 2; the second only matters for a gantry.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct HomingInput {
    /// Motor position in load units, mm, in the coordinate of the start; from the request to set the position on, in any cycle either in
    /// that or with `shift_mm` added.
    pub position_mm: [f64; 2],
    /// Motor torque, positive toward positive positions unless `torque_inverted`, in the unit of the configuration.
    pub torque: [f64; 2],
    /// Torque limit in force in the drive now, in the unit of `torque`. From the acknowledgement of its request to the next
    /// such request it must stay within 1 % of what was asked for, else `GIB_ERR_HOMING_LIMIT`; where that request is
    /// `unacknowledged`, any finite number will do.
    pub torque_limit: f64,
    /// `request_id` of the last request that the kernel has carried out; 0 before the first.
    pub acknowledged_id: u32,
    /// `GIB_INPUT_FAULT` (also after a following-error trip), `GIB_INPUT_ABORT`; other bits must be 0, else `GIB_ERR_CONFIG`.
    pub flags: u32,
}

/// What gib asks of the kernel in a cycle. Always written, and safe, also when the call returns an error.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct HomingOutput {
    /// Commanded motor positions, mm, in the coordinate of the start. To be followed while `owns_motion` is 1, in that coordinate also
    /// when `shift_mm` has been added to the positions told: the axis does not move by being told where it is.
    pub target_position_mm: [f64; 2],
    /// Commanded speeds, mm/s, signed.
    pub target_speed_mm_s: [f64; 2],
    /// To add to each encoder position to have machine coordinates, mm. Valid with the request to set the position.
    pub shift_mm: [f64; 2],
    /// Torque limit that the drive shall have, in the unit of the input. Valid once `request_id` is not 0.
    pub torque_limit: f64,
    /// What the step returned: `GIB_OK`, `GIB_BUSY`, `GIB_DONE` or the first error.
    pub status: i32,
    /// One of the `GIB_HOMING_…` phases.
    pub phase: i32,
    /// Message number: 0, or the error to tell the operator about, from the cycle on in which it is found; its text is
    /// `gib_status_text`. `GIB_ERR_RESTORE_UNCONFIRMED` after an end without the old torque limit, which is then still asked for.
    pub message: i32,
    /// 1 while gib commands the axis, else 0.
    pub owns_motion: i32,
    /// `GIB_HOMING_EVENT_…` that happened so far in this homing; each happens once, in the order of the numbers. With
    /// `GIB_HOMING_INSTANT_LAG_REDUCTION` no clearing is requested nor acknowledged.
    pub events: u32,
    /// Those of this cycle.
    pub new_events: u32,
    /// `GIB_HOMING_REQUEST_…` that the present request asks for.
    pub requests: u32,
    /// Number of the present request: when it changes, carry out `requests`, then give the number back in
    /// `acknowledged_id`. 0: no request was made yet.
    pub request_id: u32,
    /// 1: position, torque or drive cannot be trusted; take the torque off all motors and brake them, until the next start. What is
    /// commanded no longer counts then; requests still do.
    pub stop_drive: i32,
    /// Zero.
    pub reserved: i32,
}
