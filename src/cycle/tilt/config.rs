//! What the caller asks for. [`super::plan`] checks it and derives the constants of a cycle.

use super::table::TiltCondition;

/// Measure, warn, compensate (default).
pub const GIB_TILT_COMPENSATE: i32 = 0;
/// Measure and report only.
pub const GIB_TILT_MEASURE_ONLY: i32 = 1;
/// A cut of known depth: its mean load becomes a row of a table.
pub const GIB_TILT_TEACH: i32 = 2;

/// Plane through the whole path (default).
pub const GIB_TILT_FIT: i32 = 0;
/// Two points of the path, as published. Carries the whole noise and wear of two readings.
pub const GIB_TILT_TWO_POINT: i32 = 1;

/// `load` is the rectified current of a motor phase, A: true RMS over whole electrical periods (default).
pub const GIB_TILT_AC_CURRENT: i32 = 0;
/// `load` is a DC load signal, %: its mean.
pub const GIB_TILT_DC_LOAD: i32 = 1;

/// Refuse another machining condition than the table's (default).
pub const GIB_TILT_REFUSE: i32 = 0;
/// Go on under another condition and say so in the report's `flagged`.
pub const GIB_TILT_FLAG: i32 = 1;

/// No rotary axis.
pub const GIB_TILT_AXIS_NONE: i32 = 0;
/// Rotary axis A, about X.
pub const GIB_TILT_AXIS_A: i32 = 1;
/// Rotary axis B, about Y.
pub const GIB_TILT_AXIS_B: i32 = 2;
/// Rotary axis C, about Z.
pub const GIB_TILT_AXIS_C: i32 = 3;

/// One rotary axis of a machine with four or five axes.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct TiltRotary {
    /// `GIB_TILT_AXIS_…`; none (default) leaves the tilt to z.
    pub axis: i32,
    /// 0: the axis turns the workpiece (default). 1: it turns the tool.
    pub turns_tool: i32,
    /// +1 (0 means +1): a positive command turns what it carries by the right hand about the machine's axis. -1: the other way.
    pub sense: i32,
    /// Zero.
    pub reserved: i32,
    /// A point on the axis of rotation at the angles of the measurement, mm: in machine coordinates where it turns the
    /// workpiece, from the tool tip where it turns the tool.
    pub pivot_mm: [f64; 3],
}

/// How to measure and compensate. Zero in a field means its default; fields marked "required" have none.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct TiltConfig {
    /// Size of this struct as the caller knows it: `sizeof(gib_tilt_config)`. Required.
    pub struct_size: u32,
    /// `GIB_TILT_COMPENSATE` (default), `GIB_TILT_MEASURE_ONLY` or `GIB_TILT_TEACH`.
    pub purpose: i32,
    /// `GIB_TILT_FIT` (default) or `GIB_TILT_TWO_POINT`. Both are reported.
    pub method: i32,
    /// `GIB_TILT_AC_CURRENT` (default) or `GIB_TILT_DC_LOAD`; must be the table's.
    pub signal: i32,
    /// Another condition than the table's: `GIB_TILT_REFUSE` (default) or `GIB_TILT_FLAG`.
    pub other_condition: i32,
    /// Pole pairs of the spindle motor, times the ratio of its gear when it has one, 1 to 100. Required for a current.
    pub pole_pairs: i32,
    /// 1: the kernel keeps the tool at the workpiece when rotary axes turn (tool centre point control, RTCP), so that
    /// x y z get no pivot's offset. 0 (default): gib adds it.
    pub tool_centre_point: i32,
    /// Zero.
    pub reserved: i32,
    /// Servo period, 0.00005 to 0.02 s. Required.
    pub cycle_s: f64,
    /// Condition of this cut; compared with the table's. Required.
    pub condition: TiltCondition,
    /// Speed and feed may differ from the condition by this, 0.001 to 0.5 (default 0.05).
    pub condition_tolerance_ratio: f64,
    /// Length of path at both ends of every pass that does not count, since the tool enters or leaves there, 0 to 1000 mm
    /// (default 0: the weights alone reject it). The tool's diameter is a good choice.
    pub entry_mm: f64,
    /// Time over which load is averaged before it is turned into depth, 8 cycles to 10 s (default 0.1, or 8 cycles where
    /// these are longer; longer where the time limit needs it, see there).
    pub block_s: f64,
    /// Longest time in the cut, 1 to 20000 s (default 200). Beyond 2000 blocks, blocks get longer.
    pub time_limit_s: f64,
    /// Expected wear (k = 1): share by which the apparent depth grows in a metre of cut, 0.00001 to 10 (default 0.01).
    /// Where the passes cannot tell wear from tilt it enters the uncertainty; where they can, ten times it is one more measurement.
    pub wear_ratio_m: f64,
    /// A tilt up to this is left alone, 0 to 45° (default 0).
    pub band_deg: f64,
    /// A change of load along the path up to this is left alone, in the unit of the load (default 0).
    pub band_load: f64,
    /// Depth that the path shall cut everywhere, mm. 0 (default): the depth at the start of the path.
    pub nominal_depth_mm: f64,
    /// Largest offset of x, y and z, 0.001 to 100 mm (default 5).
    pub offset_max_mm: f64,
    /// Largest offset of a, b and c, 0.001 to 45° (default 5).
    pub offset_max_deg: f64,
    /// Largest speed of an offset, 0.001 to 1000 mm/s (default 20). It bounds the ramps, and z while the path goes on.
    pub offset_speed_mm_s: f64,
    /// Largest acceleration of an offset, 0.01 to 100000 mm/s² (default 100).
    pub offset_acceleration_mm_s2: f64,
    /// Largest speed of an angular offset, 0.0001 to 1000 °/s (default 1).
    pub offset_speed_deg_s: f64,
    /// Largest acceleration of an angular offset, 0.001 to 100000 °/s² (default 10).
    pub offset_acceleration_deg_s2: f64,
    /// Time within which the warning must be acknowledged, 2 cycles to 3600 s (default 60).
    pub ack_timeout_s: f64,
    /// Rotary axes, the one nearest the machine's bed first; the second is carried by it when both turn the same side.
    pub rotary: [TiltRotary; 2],
}

impl TiltConfig {
    /// Size of the struct in the first published ABI.
    pub const FIRST_SIZE: usize = 264;
}
