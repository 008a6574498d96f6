//! The configuration of a homing, checked once and turned into the constants of a cycle.

use super::config::HomingConfig;
use crate::error::{Fault, in_range};

/// A validated configuration with every constant of a cycle derived. Ways in mm, time in cycles, torque in the unit of
/// the input and positive toward the stop.
#[derive(Debug, Clone, Copy)]
pub struct Plan {
    /// Toward the stop, ±1.
    pub sense: f64,
    /// Sign that makes a torque positive toward the stop.
    pub torque_sense: f64,
    /// Motors, 1 or 2.
    pub motors: usize,
    /// Home is where the limit was reached, else where the line starts.
    pub use_threshold: bool,
    /// Ask the kernel to clear the deviation.
    pub clear_by_request: bool,
    /// Measured touches.
    pub touches: u32,
    /// Requests that need an acknowledgement.
    pub acknowledged: u32,
    /// Speeds, mm per cycle.
    pub approach: f64,
    /// Speed of measured touches, mm per cycle, and whether it was left to gib.
    pub touch: f64,
    /// See `touch`.
    pub may_slow: bool,
    /// Speed of the zero-offset move, mm per cycle.
    pub offset_speed: f64,
    /// Largest change of speed, mm per cycle².
    pub acceleration: f64,
    /// Torque limit.
    pub limit: f64,
    /// From here on the torque is limiting.
    pub threshold: f64,
    /// Below here it no longer is.
    pub release: f64,
    /// Largest filtered torque allowed.
    pub bound: f64,
    /// Its negative, and the part of a reading that enters the filtered torque: for the quick cycle.
    pub bound_below: f64,
    /// Share of a reading in the filtered torque, with the sign that makes it positive toward the stop.
    pub torque_share: f64,
    /// Largest change of position in a cycle that the present move can explain, see [`Plan::moves_at`].
    pub jump: f64,
    /// N·m per unit of the torque input.
    pub torque_nm: f64,
    /// Way within which an axis stands, in `detection` cycles.
    pub standing_way: f64,
    /// Cycles of torque limiting at a stand.
    pub detection: u32,
    /// Cycles at a stand after which the command no longer goes on.
    pub hold: u32,
    /// Smallest and largest way to the stop.
    pub distance: [f64; 2],
    /// Cycles for the whole homing.
    pub time_limit: u32,
    /// Largest |target − position|.
    pub lag_limit: f64,
    /// Coordinate when homed.
    pub set_position: f64,
    /// Way off the stop to there.
    pub offset: f64,
    /// Way back between touches.
    pub retract: f64,
    /// Longest way from contact to the limit.
    pub press_max: f64,
    /// Largest difference of touches.
    pub tolerance: f64,
    /// Largest difference of the sides of a gantry.
    pub square: f64,
    /// Cycles within which a request must be acknowledged.
    pub ack_timeout: u32,
    /// Servo cycles in a second.
    pub cycles_per_s: f64,
}

/// Blocks of a touch in which a torque reading that never changes is stuck.
pub const STUCK_BLOCKS: u32 = 100;
/// Time that the line of a touch shall take, s: while the impact still swings, nothing can be read off it.
pub const LINE_S: f64 = 0.025;
/// Blocks that a touch's level and line shall take up in its trace.
const TRACE_BLOCKS: f64 = 1200.0;

impl Plan {
    /// What holds before the first start.
    pub const REST: Plan = Plan {
        sense: 1.0,
        torque_sense: 1.0,
        motors: 1,
        use_threshold: false,
        clear_by_request: true,
        touches: 1,
        acknowledged: 0,
        approach: 1e-3,
        touch: 1e-3,
        may_slow: false,
        offset_speed: 1e-3,
        acceleration: 1e-5,
        limit: 0.0,
        threshold: 0.0,
        release: 0.0,
        bound: 0.0,
        bound_below: 0.0,
        torque_share: 0.0,
        jump: 0.0,
        torque_nm: 1.0,
        standing_way: 0.0,
        detection: 100,
        hold: 25,
        distance: [0.0, 0.0],
        time_limit: 0,
        lag_limit: 0.0,
        set_position: 0.0,
        offset: 0.0,
        retract: 1.0,
        press_max: 0.4,
        tolerance: 0.005,
        square: 0.2,
        ack_timeout: 1000,
        cycles_per_s: 1000.0,
    };

    /// Checks every field and derives the constants of a cycle.
    ///
    /// # Errors
    /// `GIB_ERR_CONFIG` with the field, its value and the range allowed.
    pub fn new(config: &HomingConfig) -> Result<Plan, Fault> {
        let or = |value: f64, default: f64| if value == 0.0 { default } else { value };
        let whole = |field, value: i32, low, high| in_range(field, f64::from(value), low, high);
        let c = config;
        let cycle = in_range("cycle_s\0", c.cycle_s, 5e-5, 0.02)?;
        let cycles = |seconds: f64| (seconds / cycle + 0.5) as u32;
        // ±1: zero would be allowed by a range from −1 to 1.
        let sense =
            in_range("direction\0", f64::from(c.direction.unsigned_abs()), 1.0, 1.0)? * f64::from(c.direction.signum());
        let inverted = whole("torque_inverted\0", c.torque_inverted, 0.0, 1.0)? != 0.0;
        whole("position_unit\0", c.position_unit, 0.0, 1.0)?;
        let permille = whole("torque_unit\0", c.torque_unit, 0.0, 1.0)? != 0.0;
        let rated = in_range("rated_torque_nm\0", c.rated_torque_nm, if permille { 1e-6 } else { 0.0 }, 1e6)?;
        let torque_nm = if permille { rated * 1e-3 } else { 1.0 };
        let limit_nm = in_range("torque_limit_nm\0", c.torque_limit_nm, 1e-6, 1e6)?;
        let (least, most) = (0.01 * limit_nm, 0.3 * limit_nm);
        let tolerance_nm = in_range("torque_tolerance_nm\0", or(c.torque_tolerance_nm, 0.1 * limit_nm), least, most)?;
        let approach = in_range("approach_speed_mm_s\0", or(c.approach_speed_mm_s, 1.0), 0.01, 100.0)?;
        let touch = in_range("touch_speed_mm_s\0", or(c.touch_speed_mm_s, approach.min(1.0)), 0.01, approach)?;
        let slow = or(c.detection_velocity_mm_s, (0.2 * touch).max(0.05).min(approach));
        let slow = in_range("detection_velocity_mm_s\0", slow, 1e-6, approach)?;
        let detection_s =
            in_range("detection_time_s\0", or(c.detection_time_s, (8.0 * cycle).max(0.1)), 8.0 * cycle, 5.0)?;
        let far = in_range("distance_max_mm\0", c.distance_max_mm, 1e-3, 1e5)?;
        let offset = in_range("zero_offset_mm\0", c.zero_offset_mm, 0.0, 1000.0)?;
        let offset_speed = or(c.zero_offset_speed_mm_s, approach);
        let offset_speed = in_range("zero_offset_speed_mm_s\0", offset_speed, 0.01, 500.0)?;
        let retract = in_range("retract_mm\0", or(c.retract_mm, 1.0), 0.05, 100.0)?;
        let touches = if c.touches == 0 { 3.0 } else { whole("touches\0", c.touches, 1.0, 10.0)? };
        let motion = far / approach + (touches + 1.0) * (2.0 * retract / touch + detection_s) + offset / offset_speed;
        let time = in_range("time_limit_s\0", or(c.time_limit_s, (2.0 * motion + 10.0).min(1e5)), cycle, 1e5)?;
        let lag = in_range("lag_limit_mm\0", or(c.lag_limit_mm, 1.0 + 0.1 * approach), 1e-3, 100.0)?;
        let acceleration = in_range("acceleration_mm_s2\0", or(c.acceleration_mm_s2, 50.0), 0.1, 10000.0)?;
        let timeout = in_range("ack_timeout_s\0", or(c.ack_timeout_s, 1.0), 2.0 * cycle, 60.0)?;
        Ok(Plan {
            sense,
            torque_sense: if inverted { -sense } else { sense },
            motors: if c.motors == 0 { 1 } else { whole("motors\0", c.motors, 1.0, 2.0)? as usize },
            use_threshold: whole("method\0", c.method, 0.0, 1.0)? != 0.0,
            clear_by_request: whole("lag_reduction\0", c.lag_reduction, 0.0, 1.0)? == 0.0,
            touches: touches as u32,
            acknowledged: !(in_range("unacknowledged\0", f64::from(c.unacknowledged), 0.0, 7.0)? as u32),
            approach: approach * cycle,
            touch: touch * cycle,
            may_slow: c.touch_speed_mm_s == 0.0,
            offset_speed: offset_speed * cycle,
            acceleration: acceleration * cycle * cycle,
            limit: limit_nm / torque_nm,
            threshold: (limit_nm - tolerance_nm) / torque_nm,
            release: (limit_nm - 2.0 * tolerance_nm) / torque_nm,
            bound: (limit_nm + tolerance_nm) / torque_nm,
            bound_below: -(limit_nm + tolerance_nm) / torque_nm,
            torque_share: super::side::GAIN * if inverted { -sense } else { sense },
            jump: 0.0,
            torque_nm,
            standing_way: slow * detection_s,
            detection: cycles(detection_s),
            hold: cycles(0.25 * detection_s).max(2),
            distance: [in_range("distance_min_mm\0", c.distance_min_mm, 0.0, far)?, far],
            time_limit: cycles(time),
            lag_limit: lag,
            set_position: in_range("set_position_mm\0", c.set_position_mm, -1e6, 1e6)?,
            offset,
            retract,
            press_max: in_range("press_max_mm\0", or(c.press_max_mm, 0.4 * retract), 1e-4, 0.4 * retract)?,
            tolerance: in_range("touch_tolerance_um\0", or(c.touch_tolerance_um, 5.0), 0.1, 1000.0)? * 1e-3,
            square: in_range("square_tolerance_mm\0", or(c.square_tolerance_mm, 0.2), 1e-3, 100.0)?,
            ack_timeout: cycles(timeout),
            cycles_per_s: 1.0 / cycle,
        })
    }

    /// Cycles in a block of the trace of a touch at `speed` (mm per cycle): level and line fit into the ring.
    #[must_use]
    pub fn block(&self, speed: f64) -> u32 {
        (self.window() / (TRACE_BLOCKS * speed)).ceil() as u32
    }

    /// The axis moves at `speed` (mm per cycle) from now on; where it springs, some times as fast.
    pub fn moves_at(&mut self, speed: f64) {
        self.jump = 0.01 + 10.0 * speed;
    }

    /// Makes the measured touches slow enough for a line of `press` mm, down to a quarter of their speed.
    pub fn slow_down(&mut self, press: f64) {
        if self.may_slow && press > 0.0 {
            let slow = press / (LINE_S * self.cycles_per_s);
            self.touch = slow.max(0.25 * self.touch).min(self.touch);
        }
    }

    /// Speed of the way back, mm per cycle: as gentle as a touch, and half of it is gone at a steady speed.
    #[must_use]
    pub fn back(&self) -> f64 {
        self.touch.min((0.5 * self.acceleration * self.retract).sqrt())
    }

    /// Cycles that the encoder may stand while the command goes on at `speed` (mm per cycle) and no limit is reached: a
    /// tenth of the retraction, far more than friction or a grid explain.
    #[must_use]
    pub fn frozen(&self, speed: f64) -> u32 {
        (0.1 * self.retract / speed).max(20.0) as u32
    }

    /// Cycles that the axis may take to come to where its command has ended.
    #[must_use]
    pub fn settling(&self) -> f64 {
        4.0 * f64::from(self.detection)
    }

    /// Furthest that the command goes toward the stop: short of the largest distance by what a servo overshoots.
    #[must_use]
    pub fn reach(&self) -> f64 {
        self.distance[1] - (0.05f64).min(0.05 * self.distance[1])
    }

    /// Way before the end of a touch from which its trace is evaluated. What comes before takes up lost motion.
    #[must_use]
    pub fn window(&self) -> f64 {
        0.6 * self.retract
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cycle::backlash::config::GIB_TORQUE_PERMILLE;

    fn valid() -> HomingConfig {
        HomingConfig {
            struct_size: size_of::<HomingConfig>() as u32,
            direction: -1,
            cycle_s: 0.001,
            torque_limit_nm: 5.0,
            distance_max_mm: 100.0,
            ..HomingConfig::default()
        }
    }

    #[test]
    fn size_is_the_published_one() {
        assert_eq!(size_of::<HomingConfig>(), HomingConfig::FIRST_SIZE);
    }

    #[test]
    fn zero_means_default_and_required_fields_are_named() {
        let plan = Plan::new(&valid()).unwrap();
        assert!(plan.sense == -1.0 && plan.motors == 1 && plan.touches == 3 && plan.threshold == 4.5);
        for (config, field) in [
            (HomingConfig { direction: 0, ..valid() }, "direction\0"),
            (HomingConfig { torque_limit_nm: 0.0, ..valid() }, "torque_limit_nm\0"),
            (HomingConfig { distance_max_mm: 0.0, ..valid() }, "distance_max_mm\0"),
            (HomingConfig { cycle_s: 0.0, ..valid() }, "cycle_s\0"),
            (HomingConfig { torque_unit: GIB_TORQUE_PERMILLE, ..valid() }, "rated_torque_nm\0"),
            (HomingConfig { distance_min_mm: 101.0, ..valid() }, "distance_min_mm\0"),
            (HomingConfig { zero_offset_mm: -1.0, ..valid() }, "zero_offset_mm\0"),
            (HomingConfig { touch_speed_mm_s: f64::NAN, ..valid() }, "touch_speed_mm_s\0"),
            (HomingConfig { motors: 3, ..valid() }, "motors\0"),
        ] {
            assert_eq!(Plan::new(&config).unwrap_err().field, field);
        }
    }
}
