//! What the caller asks for. [`super::plan`] checks it and derives the constants of a cycle.

/// The speed rises and falls at a constant rate (default).
pub const GIB_SPEED_VARIATION_TRIANGLE: i32 = 0;
/// The speed swings as a sine.
pub const GIB_SPEED_VARIATION_SINE: i32 = 1;
/// Limits keep torque and power within the motor's at every moment (default).
pub const GIB_SPEED_VARIATION_EXACT: i32 = 0;
/// Limits as published: the power at the mean speed only, nothing for friction and cutting. The motor is asked for up
/// to (1 + amplitude) times its power. For comparison. The bounds of speed are kept.
pub const GIB_SPEED_VARIATION_PUBLISHED: i32 = 1;

/// What to vary, by which motor. Zero in a field means its default; fields marked "required" have none.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct SpeedVariationConfig {
    /// Size of this struct as the caller knows it: `sizeof(gib_speed_variation_config)`. Required.
    pub struct_size: u32,
    /// `GIB_SPEED_VARIATION_TRIANGLE` (default) or `GIB_SPEED_VARIATION_SINE`.
    pub waveform: i32,
    /// `GIB_SPEED_VARIATION_EXACT` (default) or `GIB_SPEED_VARIATION_PUBLISHED`.
    pub formula: i32,
    /// Must be 0.
    pub reserved: i32,
    /// Servo period, 0.00005 to 0.02 s. Required to start.
    pub cycle_s: f64,
    /// Mean spindle speed, rpm, |speed| from `speed_min_rpm` (0.001 at least) to `speed_max_rpm`; negative turns the other way.
    /// Required.
    pub speed_rpm: f64,
    /// Amplitude as a share of the mean speed, 0.000001 to 0.999 (0.1 is ±10 %). Required to start.
    pub amplitude_ratio: f64,
    /// Period of the variation, 0.02 s and 8 cycles to 600 s. Required to start.
    pub period_s: f64,
    /// Inertia of workpiece and chuck, 1e-9 to 1e6 kg·m²: measured, or `INA` from the program's head. Required.
    pub inertia_kg_m2: f64,
    /// The machine's own inertia (spindle, rotor), 0 (default) to 1e6 kg·m², added to it.
    pub own_inertia_kg_m2: f64,
    /// Largest power of the motor, 0.001 to 1e9 W. Required.
    pub power_w: f64,
    /// Largest torque of the motor at the spindle, N·m, from 1e-6 (default: only the power limits).
    pub torque_nm: f64,
    /// Highest speed allowed, 0.001 to 200000 rpm (default 200000).
    pub speed_max_rpm: f64,
    /// Lowest speed allowed, 0 (default) to `speed_max_rpm`, rpm.
    pub speed_min_rpm: f64,
    /// Coulomb friction of the spindle, 0 (default) to 1e6 N·m.
    pub coulomb_nm: f64,
    /// Viscous friction of the spindle, 0 (default) to 1e6 N·m·s/rad.
    pub viscous_nm_s: f64,
    /// Torque that cutting uses, 0 (default) to 1e6 N·m.
    pub cutting_nm: f64,
    /// Share of torque and power to keep back, 0 (default) to 0.9.
    pub reserve_ratio: f64,
    /// Frequency of the chatter to be broken up, up to 100000 Hz; for the recommended values only (default: not known).
    pub chatter_hz: f64,
}

impl SpeedVariationConfig {
    /// Size of the struct in the first published ABI.
    pub const FIRST_SIZE: usize = 136;
}

/// What is possible, and what is recommended.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct SpeedVariationLimits {
    /// Largest amplitude for the period given; 0: none, or no period was given.
    pub amplitude_ratio: f64,
    /// Shortest period for the amplitude given that the motor can do, s; 0: none does, or no amplitude was given. It may be
    /// shorter than a start takes, which is 0.02 s and 8 cycles.
    pub period_s: f64,
    /// Largest amplitude for the period, as published.
    pub published_amplitude_ratio: f64,
    /// Shortest period for the amplitude, as published, s.
    pub published_period_s: f64,
    /// Power that the published amplitude would take at the top of its swing, friction and cutting included, W.
    pub published_power_w: f64,
    /// Recommended amplitude: sweeps the chatter's regeneration through one wave, or 10 % where the chatter's
    /// frequency is not given.
    pub recommended_amplitude_ratio: f64,
    /// Recommended period: the shortest for it that the motor can do and a start takes, but not below five revolutions, s;
    /// 0: none.
    pub recommended_period_s: f64,
    /// Power at the top of the swing of the amplitude and period given, W; 0: not both were given.
    pub power_w: f64,
    /// Torque at the top of that swing, N·m.
    pub torque_nm: f64,
    /// What limits the amplitude: `GIB_ERR_SPEED_VARIATION_POWER`, `_TORQUE`, `_SPEED` or `_NONE`; 0 without a period.
    pub limited_by: i32,
    /// Zero.
    pub reserved: i32,
}
