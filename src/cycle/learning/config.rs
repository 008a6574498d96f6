//! What the caller asks for. [`super::plan`] checks it and derives the constants of a cycle.

/// Harmonics of the deviation, each by the machine's measured answer (default).
pub const GIB_LEARNING_FILTERED: i32 = 0;
/// The deviation itself, point by point with a phase lead, as published.
pub const GIB_LEARNING_PUBLISHED: i32 = 1;

/// Most points of a revolution.
pub const GIB_LEARNING_POINTS: usize = 1024;
/// Most harmonics that are learnt.
pub const GIB_LEARNING_HARMONICS: usize = 16;

/// How to learn. Zero in a field means its default; fields marked "required" have none.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct LearningConfig {
    /// Size of this struct as the caller knows it: `sizeof(gib_learning_config)`. Required.
    pub struct_size: u32,
    /// `GIB_LEARNING_FILTERED` (default) or `GIB_LEARNING_PUBLISHED`.
    pub method: i32,
    /// Points of a revolution, an even number from 16 to 1024 (default 256), at least four a harmonic. For the published method no more than a
    /// revolution has cycles: a point that no cycle met takes the deviation of the one before it.
    pub points: i32,
    /// Harmonics of a revolution that are learnt, 1 to 16 (default 8); only for `GIB_LEARNING_FILTERED`.
    pub harmonics: i32,
    /// Revolutions over which the deviation is averaged, 1 to 64 (default 2).
    pub revolutions: i32,
    /// Revolutions that the machine is given to settle after a change, 1 to 64 (default 2).
    pub settle_revolutions: i32,
    /// Updates at most, 1 to 10000 (default 100).
    pub updates: i32,
    /// 1: begin from the correction that this instance holds, learnt before or loaded, of as many points; refused without one. 0 (default): from none.
    pub resume: i32,
    /// Servo period, 0.00005 to 0.02 s. Required.
    pub cycle_s: f64,
    /// Phase lead Δθ at the present speed, 0 to 90 degrees (default 0).
    pub lead_deg: f64,
    /// Lag of the servo, for a lead that grows with speed, 0 to 0.1 s (default 0). Both leads add.
    pub lag_s: f64,
    /// Share γ of what is wrong that an update takes away, 0.05 to 1 (default 0.7; 1 for the published method).
    pub gain_ratio: f64,
    /// Deviation at which learning is done, root mean square over a revolution, 0.001 to 1000 µm. Required.
    pub tolerance_um: f64,
    /// Largest correction, 0.1 to 100000 µm. Required.
    pub correction_max_um: f64,
    /// Fastest change of the correction, 0.001 to 10000 mm/s (default 100).
    pub correction_speed_mm_s: f64,
    /// Deviation of a single cycle beyond which the correction is taken back at once, up to 1000000 µm (default 1000).
    pub deviation_max_um: f64,
    /// Growth of the deviation over its best beyond which an update has failed, 1.01 to 10 (default 1.2).
    pub growth_ratio: f64,
    /// Slowest speed at which the spindle counts as turning, 1 to 10000 rpm (default 30).
    pub speed_min_rpm: f64,
    /// Relative change of speed beyond which deviations are no longer compared, 0.001 to 0.5 (default 0.02); of a correction that is
    /// kept it is told, by `GIB_LEARNING_SPEED_CHANGED`.
    pub speed_tolerance_ratio: f64,
    /// Time over which the correction comes and goes, 0.001 to 10 s (default 0.1).
    pub fade_s: f64,
    /// Longest time to wait for the spindle to turn and for a position to be detected, 0.1 to 100000 s (default 60).
    pub wait_s: f64,
}

impl LearningConfig {
    /// Size of the struct in the first published ABI.
    pub const FIRST_SIZE: usize = 136;
}
