//! The configuration of learning, checked once and turned into the constants of a cycle.

use super::config::{GIB_LEARNING_HARMONICS, GIB_LEARNING_POINTS, LearningConfig};
use crate::error::{Fault, GIB_ERR_CONFIG, in_range};

/// A validated configuration with every constant of a cycle derived.
#[derive(Debug, Clone, Copy)]
pub struct Plan {
    /// Point by point instead of by harmonics.
    pub published: bool,
    /// Begins from the correction held.
    pub resume: bool,
    /// Points of a revolution, also as a number, and half of them.
    pub points: usize,
    /// See `points`.
    pub scale: f64,
    /// Points in a degree.
    pub points_per_deg: f64,
    /// Harmonics, and pairs of them.
    pub harmonics: usize,
    /// See `harmonics`.
    pub pairs: usize,
    /// Turns to measure over, and to settle for.
    pub measure: f64,
    /// See `measure`.
    pub settle: f64,
    /// Updates at most.
    pub updates: u32,
    /// Servo period, s.
    pub cycle: f64,
    /// Phase lead in turns, and turns more for each turn per cycle.
    pub lead: f64,
    /// See `lead`.
    pub lag: f64,
    /// γ.
    pub gain: f64,
    /// µm.
    pub tolerance: f64,
    /// Largest correction, µm, and its largest change in a cycle.
    pub most: f64,
    /// See `most`.
    pub slope: f64,
    /// Largest deviation of a cycle, mm.
    pub deviation: f64,
    /// Growth that fails.
    pub growth: f64,
    /// Turns per cycle from which the spindle turns.
    pub rate_min: f64,
    /// Largest turn in a cycle.
    pub turn_max: f64,
    /// Relative.
    pub speed_tolerance: f64,
    /// Change of the presence in a cycle.
    pub fade: f64,
    /// Cycles.
    pub wait: u64,
}

impl Plan {
    /// What holds before the first start: the command is the target.
    pub const REST: Plan = Plan {
        published: false,
        resume: false,
        points: 16,
        scale: 16.0,
        points_per_deg: 16.0 / 360.0,
        harmonics: 1,
        pairs: 1,
        measure: 1.0,
        settle: 1.0,
        updates: 0,
        cycle: 1e-3,
        lead: 0.0,
        lag: 0.0,
        gain: 0.0,
        tolerance: 0.0,
        most: 0.0,
        slope: 0.0,
        deviation: 0.0,
        growth: 1.0,
        rate_min: 1.0,
        turn_max: 0.0,
        speed_tolerance: 0.0,
        fade: 1.0,
        wait: 0,
    };

    /// Checks every field and derives the constants of a cycle.
    ///
    /// # Errors
    /// `GIB_ERR_CONFIG` with the field, its value and the range allowed.
    pub fn new(config: &LearningConfig) -> Result<Plan, Fault> {
        let or = |value: f64, default: f64| if value == 0.0 { default } else { value };
        let whole = |field, value: i32, default: f64, low, high| in_range(field, or(value.into(), default), low, high);
        let c = config;
        let cycle = in_range("cycle_s\0", c.cycle_s, 5e-5, 0.02)?;
        let harmonics = whole("harmonics\0", c.harmonics, 8.0, 1.0, GIB_LEARNING_HARMONICS as f64)?;
        let published = whole("method\0", c.method, 0.0, 0.0, 1.0)? != 0.0;
        let fewest = if published { 16.0 } else { f64::max(16.0, 4.0 * harmonics) };
        let points = whole("points\0", c.points, 256.0, fewest, GIB_LEARNING_POINTS as f64)?;
        if points as u32 & 1 != 0 {
            // Odd, within the range: bounds of 0 say that no range is what it misses.
            return Err(Fault { field: "points\0", value: points, ..Fault::of(GIB_ERR_CONFIG) });
        }
        let most = in_range("correction_max_um\0", c.correction_max_um, 0.1, 1e5)?;
        let speed = in_range("correction_speed_mm_s\0", or(c.correction_speed_mm_s, 100.0), 1e-3, 1e4)?;
        let slow = in_range("speed_min_rpm\0", or(c.speed_min_rpm, 30.0), 1.0, 1e4)?;
        Ok(Plan {
            published,
            resume: whole("resume\0", c.resume, 0.0, 0.0, 1.0)? != 0.0,
            points: points as usize,
            scale: points,
            points_per_deg: points / 360.0,
            harmonics: harmonics as usize,
            pairs: (harmonics as usize).div_ceil(2),
            measure: whole("revolutions\0", c.revolutions, 2.0, 1.0, 64.0)?,
            settle: whole("settle_revolutions\0", c.settle_revolutions, 2.0, 1.0, 64.0)?,
            updates: whole("updates\0", c.updates, 100.0, 1.0, 1e4)? as u32,
            cycle,
            lead: in_range("lead_deg\0", c.lead_deg, 0.0, 90.0)? / 360.0,
            lag: in_range("lag_s\0", c.lag_s, 0.0, 0.1)? / cycle,
            gain: in_range("gain_ratio\0", or(c.gain_ratio, if published { 1.0 } else { 0.7 }), 0.05, 1.0)?,
            tolerance: in_range("tolerance_um\0", c.tolerance_um, 1e-3, 1e3)?,
            most,
            slope: 1e3 * speed * cycle,
            deviation: 1e-3 * in_range("deviation_max_um\0", or(c.deviation_max_um, 1e3), c.tolerance_um, 1e6)?,
            growth: in_range("growth_ratio\0", or(c.growth_ratio, 1.2), 1.01, 10.0)?,
            rate_min: slow / 60.0 * cycle,
            turn_max: 0.25,
            speed_tolerance: in_range("speed_tolerance_ratio\0", or(c.speed_tolerance_ratio, 0.02), 1e-3, 0.5)?,
            fade: (cycle / in_range("fade_s\0", or(c.fade_s, 0.1), 1e-3, 10.0)?).min(1.0),
            wait: (in_range("wait_s\0", or(c.wait_s, 60.0), 0.1, 1e5)? / cycle) as u64,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn valid() -> LearningConfig {
        LearningConfig {
            struct_size: size_of::<LearningConfig>() as u32,
            cycle_s: 0.0005,
            tolerance_um: 0.5,
            correction_max_um: 50.0,
            ..LearningConfig::default()
        }
    }

    #[test]
    fn size_is_the_published_one() {
        assert_eq!(size_of::<LearningConfig>(), LearningConfig::FIRST_SIZE);
    }

    #[test]
    fn zero_means_default_and_what_is_wrong_is_named() {
        let plan = Plan::new(&valid()).unwrap();
        assert!(plan.points == 256 && plan.harmonics == 8 && plan.gain == 0.7 && plan.wait == 120_000);
        for (config, field) in [
            (LearningConfig { cycle_s: 0.0, ..valid() }, "cycle_s\0"),
            (LearningConfig { points: 15, ..valid() }, "points\0"),
            (LearningConfig { points: 1025, ..valid() }, "points\0"),
            (LearningConfig { points: 101, ..valid() }, "points\0"),
            (LearningConfig { points: 32, harmonics: 9, ..valid() }, "points\0"),
            (LearningConfig { harmonics: 17, ..valid() }, "harmonics\0"),
            (LearningConfig { method: 2, ..valid() }, "method\0"),
            (LearningConfig { resume: -1, ..valid() }, "resume\0"),
            (LearningConfig { tolerance_um: 0.0, ..valid() }, "tolerance_um\0"),
            (LearningConfig { correction_max_um: f64::NAN, ..valid() }, "correction_max_um\0"),
            (LearningConfig { gain_ratio: 1.1, ..valid() }, "gain_ratio\0"),
            (LearningConfig { lead_deg: -1.0, ..valid() }, "lead_deg\0"),
            (LearningConfig { growth_ratio: 1.0, ..valid() }, "growth_ratio\0"),
            (LearningConfig { updates: -5, ..valid() }, "updates\0"),
        ] {
            assert_eq!(Plan::new(&config).unwrap_err().field, field);
        }
    }
}
