//! What the caller asks for. [`super::plan`] checks it and derives the constants of a cycle.

/// Harmonics of the spindle's turn, each divided by −ω² (default).
pub const GIB_VIBRATION_HARMONIC: i32 = 0;
/// Integrated twice, closed once a revolution, as published.
pub const GIB_VIBRATION_INTEGRATE: i32 = 1;

/// Most harmonics that are tracked.
pub const GIB_VIBRATION_HARMONICS: usize = 16;

/// How the position is to be corrected. Zero in a field means its default; fields marked "required" have none.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct VibrationConfig {
    /// Size of this struct as the caller knows it: `sizeof(gib_vibration_config)`. Required.
    pub struct_size: u32,
    /// `GIB_VIBRATION_HARMONIC` (default) or `GIB_VIBRATION_INTEGRATE`.
    pub method: i32,
    /// Harmonics of a revolution that are tracked, 1 to 16 (default 8). The workpiece's form and twice its corners should
    /// be among them. Those above 0.4 of the sampling frequency are left out while the spindle is that fast.
    pub harmonics: i32,
    /// 1: a second slide (XM) carries the slide; its encoder is in the input. 0 (default): none.
    pub second_slide: i32,
    /// Harmonic at which `GIB_VIBRATION_INTEGRATE` takes gain and phase of the calibration, 1 to 16 (default 1).
    pub main_harmonic: i32,
    /// Zero.
    pub reserved: i32,
    /// Servo period, 0.00005 to 0.02 s. Required.
    pub cycle_s: f64,
    /// Full scale of the accelerometers, 0.1 to 10000 m/s²: a reading there is saturated. Required.
    pub acceleration_range_m_s2: f64,
    /// Largest plausible acceleration, up to the range (default).
    pub acceleration_max_m_s2: f64,
    /// Largest plausible displacement of seat or bearing, 0.1 to 10000 µm (default 100): more is a bad sensor.
    pub displacement_max_um: f64,
    /// Slowest speed at which the spindle counts as turning, 1 to 10000 rpm (default 30).
    pub speed_min_rpm: f64,
    /// Fastest speed that the spindle's encoder can show, up to a quarter turn a cycle (default 10000, or that).
    pub speed_max_rpm: f64,
    /// Lowest frequency at which an acceleration is worth a displacement, 0.1 to 1000 Hz (default 1).
    pub frequency_min_hz: f64,
    /// Revolutions over which the harmonics are averaged while the speed is steady, 1 to 1000 (default 16).
    pub averaging_revolutions: f64,
    /// Time over which the correction comes and goes, 0.001 to 10 s (default 0.1).
    pub fade_s: f64,
    /// Time constant of the measured speed, one cycle to 1 s (default 0.02).
    pub speed_filter_s: f64,
}

impl VibrationConfig {
    /// Size of the struct in the first published ABI.
    pub const FIRST_SIZE: usize = 104;
}
