//! What crosses the boundary in every servo cycle. These structs are frozen for an ABI major.

/// Nothing is measured and no offset is in force.
pub const GIB_TILT_IDLE: i32 = 0;
/// Reads the load along the path.
pub const GIB_TILT_MEASURING: i32 = 1;
/// Evaluates the path in slices.
pub const GIB_TILT_EVALUATE: i32 = 2;
/// Warns that offsets are to come, and waits for the acknowledgement.
pub const GIB_TILT_WARNING: i32 = 3;
/// Brings the offsets in.
pub const GIB_TILT_RAMP_ON: i32 = 4;
/// The offsets are in force.
pub const GIB_TILT_ACTIVE: i32 = 5;
/// Takes the offsets out.
pub const GIB_TILT_RAMP_OFF: i32 = 6;
/// Ended well, no offset in force.
pub const GIB_TILT_DONE: i32 = 7;
/// Ended with an error, no offset in force; kept until the next start.
pub const GIB_TILT_FAILED: i32 = 8;

/// Input flag: the tool is in the cut, at feed. One stretch with it is one pass.
pub const GIB_TILT_INPUT_CUTTING: u32 = 4;
/// Input flag: the path to be measured is finished.
pub const GIB_TILT_INPUT_END: u32 = 8;
/// Input flag: take the offsets out; the family then ends well. In answer to the warning it declines them; in the
/// middle of measuring it is an abort, `GIB_ERR_ABORTED`.
pub const GIB_TILT_INPUT_OFF: u32 = 16;

/// What the kernel tells gib in a cycle.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct TiltInput {
    /// Commanded position x y z of the tool tip in machine coordinates, without gib's offsets, mm.
    pub position_mm: [f64; 3],
    /// Commanded angles a b c without gib's offsets, °; 0 for an axis that is not there. One that is configured stays within 0.01
    /// of the first cut until the offsets are out again: `GIB_ERR_TILT_CONDITION` in later cuts and until the offsets are in.
    pub rotary_deg: [f64; 3],
    /// Spindle load: current of one phase, rectified or not, A; or DC load, %.
    pub load: f64,
    /// Spindle speed, min⁻¹; the sign does not matter.
    pub speed_rpm: f64,
    /// `request_id` of the last warning that the operator has accepted; 0 before the first.
    pub acknowledged_id: u32,
    /// `GIB_INPUT_FAULT`, `GIB_INPUT_ABORT`, `GIB_TILT_INPUT_…`; other bits must be 0.
    pub flags: u32,
}

/// What gib asks of the kernel in a cycle. Always written, and safe, also when the call returns an error.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct TiltOutput {
    /// Add to the commanded x y z, mm.
    pub offset_mm: [f64; 3],
    /// Add to the commanded a b c, °.
    pub offset_deg: [f64; 3],
    /// What the step returned: `GIB_OK`, `GIB_BUSY`, `GIB_DONE` or the first error.
    pub status: i32,
    /// One of the `GIB_TILT_…` phases.
    pub phase: i32,
    /// Message number: 0, or the error to tell the operator about; its text is `gib_status_text`.
    pub message: i32,
    /// 1: the operator is to be warned that offsets are to come, and to accept it.
    pub warning: i32,
    /// Number of the present warning, to be given back in `acknowledged_id`; 0: none was given yet.
    pub request_id: u32,
    /// 1: the position asks for more than the largest offset, which is put out instead.
    pub limited: i32,
}
