//! What the caller asks for. [`super::plan`] checks it and derives the constants of a cycle.

/// Slow-feed mode (default): the motor is fed slowly and the torque read in every cycle. The more accurate one.
pub const GIB_BACKLASH_SLOW_FEED: i32 = 0;
/// Step mode, as published: the motor is stepped and the torque read at the end of each dwell.
pub const GIB_BACKLASH_STEP: i32 = 1;

/// Whole-curve fit (default).
pub const GIB_BACKLASH_FIT: i32 = 0;
/// The published peak rule: rise, rise, fall of |torque|. Reads low; see the manual.
pub const GIB_BACKLASH_PEAK: i32 = 1;

/// Torque inputs in N·m.
pub const GIB_TORQUE_NM: i32 = 0;
/// Torque inputs in ‰ of the rated torque.
pub const GIB_TORQUE_PERMILLE: i32 = 1;

/// What to measure and within which bounds. Zero in a field means its default; fields marked "required" have none.
///
/// Positions are motor positions in load units (mm). Torque fields are in N·m whatever `torque_unit` says.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct BacklashConfig {
    /// Size of this struct as the caller knows it: `sizeof(gib_backlash_config)`. Required.
    pub struct_size: u32,
    /// `GIB_BACKLASH_SLOW_FEED` (default) or `GIB_BACKLASH_STEP`.
    pub mode: i32,
    /// `GIB_BACKLASH_FIT` (default) or `GIB_BACKLASH_PEAK`: which estimate is written. Both are reported.
    pub method: i32,
    /// Sense of the motion before the first reversal: +1 (default) or -1.
    pub first_direction: i32,
    /// 0: measure the reversals of both senses (default). 1: only the first; refused under a constant load of half to all of
    /// what the table's friction holds, where only the other sense tells whether the table creeps through a clearance.
    pub one_direction: i32,
    /// Reversals measured in each sense, 1 to 20 (default 3).
    pub repeats: i32,
    /// Unit of the torque input: `GIB_TORQUE_NM` (default) or `GIB_TORQUE_PERMILLE` of `rated_torque_nm`.
    pub torque_unit: i32,
    /// 0: write the compensation when the result is trustworthy (default). 1: only measure.
    pub measure_only: i32,
    /// 0: both reversals are at the position where the axis stands at start (default). 1: at the `reference_…` fields.
    pub references_given: i32,
    /// Must be 0.
    pub reserved: i32,
    /// Servo period, 0.00005 to 0.02 s. Required.
    pub cycle_s: f64,
    /// Motor step, and travel between two points of the peak rule, 0.1 to 50 µm (default 1).
    pub step_um: f64,
    /// Time a step is held, 2 cycles to 1 s (default 0.02). The torque is read in its last quarter.
    pub dwell_s: f64,
    /// Speed of the slow feed, and of the last 0.1 mm of motor travel to each reversal, 0.001 to 5 mm/s (default 0.1).
    pub feed_mm_s: f64,
    /// Rest before each reversal, one cycle to 10 s (default 0.2); no less than 65 cycles are taken.
    pub settle_s: f64,
    /// Reversal position of the first sense, mm.
    pub reference_1_mm: f64,
    /// Reversal position of the second sense, mm.
    pub reference_2_mm: f64,
    /// Travel after a reversal within which the table must move, ten times `step_um` to 5000 µm (default 500).
    pub detection_limit_um: f64,
    /// Speed of moves between references, 0.1 to 500 mm/s (default 5).
    pub approach_speed_mm_s: f64,
    /// Speed at which the sliding torque is read, 0.05 to 20 mm/s (default 1): the lost motion is that of this speed.
    pub slide_speed_mm_s: f64,
    /// Travel over which the sliding torque is read, 0.1 to 100 mm and no less than 48 cycles at `slide_speed_mm_s` take (default 1, or
    /// that).
    pub slide_mm: f64,
    /// Largest commanded acceleration, 0.1 to 10000 mm/s² (default 50). In the cycle in which a move ends it may be one and a half times
    /// that; GIB_INPUT_FAULT stops the command at once, and the steps of `GIB_BACKLASH_STEP` are jumps of the position.
    pub acceleration_mm_s2: f64,
    /// Lowest motor position allowed, mm, from -1e6. Required, with `travel_max_mm`.
    pub travel_min_mm: f64,
    /// Highest motor position allowed, mm, above the lowest and up to 1e6. Required.
    pub travel_max_mm: f64,
    /// Largest |torque| allowed, 1e-6 to 1e6 N·m. Required.
    pub torque_bound_nm: f64,
    /// Rated torque, 1e-6 to 1e6 N·m. Required for `GIB_TORQUE_PERMILLE`.
    pub rated_torque_nm: f64,
    /// Largest |target - position| allowed, 0.001 to 100 mm (default 0.5).
    pub lag_limit_mm: f64,
    /// Time within which a request must be acknowledged, 2 cycles to 60 s (default 1).
    pub ack_timeout_s: f64,
    /// Smallest change of the compensation amount that the kernel can store, 0.0001 to 100 µm (default 1). An amount asked for counts as
    /// in force within half of it: the kernel shall round to the nearest amount that it can store.
    pub compensation_resolution_um: f64,
    /// Largest amount that may be written, up to 5000 µm (default: the detection limit).
    pub compensation_max_um: f64,
    /// Resolution of the motor encoder, up to 100 µm (default: measured as the smallest change seen).
    pub encoder_um: f64,
}

impl BacklashConfig {
    /// Size of the struct in the first published ABI.
    pub const FIRST_SIZE: usize = 208;
}
