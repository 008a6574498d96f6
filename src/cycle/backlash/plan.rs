//! The configuration of a measurement, checked once and turned into the constants of a cycle.

use super::config::BacklashConfig;
use super::curve::{BINS, CLEAR_SLICES};
use crate::error::{Fault, in_range};

/// A validated configuration with every constant of a cycle derived. Lengths in mm, time in cycles, torque in the
/// unit of the input.
#[derive(Debug, Clone, Copy)]
pub struct Plan {
    /// Feed slowly, else step.
    pub slow_feed: bool,
    /// Write the peak rule's reading, else the fit's.
    pub use_peak: bool,
    /// Write nothing.
    pub measure_only: bool,
    /// Sense of the motion before the first reversal, ±1.
    pub first_sense: f64,
    /// Senses to measure: 1 or 2.
    pub senses: u32,
    /// Reversals a sense.
    pub repeats: u32,
    /// Reversal positions; `None`: where the axis stands at start.
    pub references: Option<[f64; 2]>,
    /// Servo period, s.
    pub cycle_s: f64,
    /// Motor step, mm.
    pub step: f64,
    /// Width of a bin of the torque curve, mm.
    pub bin: f64,
    /// Cycles that a step is held.
    pub dwell: u32,
    /// Cycles of rest before a reversal.
    pub settle: u32,
    /// Slow feed, mm per cycle.
    pub feed: f64,
    /// Speed between references, mm per cycle.
    pub approach_speed: f64,
    /// Speed at which sliding is read, mm per cycle.
    pub slide_speed: f64,
    /// Way over which sliding is read, mm.
    pub slide: f64,
    /// Largest change of speed, mm per cycle².
    pub acceleration: f64,
    /// Detection limit, mm.
    pub limit: f64,
    /// Lowest and highest position allowed, mm.
    pub travel: [f64; 2],
    /// Largest |torque| allowed, in the unit of the input.
    pub torque_bound: f64,
    /// N·m per unit of the torque input.
    pub torque_nm: f64,
    /// Largest following error allowed, mm.
    pub lag_limit: f64,
    /// Cycles within which a request must be acknowledged.
    pub ack_timeout: u32,
    /// Largest difference between amount asked for and in force, µm.
    pub compensation_tolerance_um: f64,
    /// Largest amount that may be written, µm.
    pub compensation_max_um: f64,
    /// Encoder grid, mm; 0: measured.
    pub encoder: f64,
    /// Samples in a batch of the sliding level.
    pub batch: u32,
    /// Way before the end of a slide from which its level is read: the stretch itself and the braking.
    pub level_from: f64,
    /// Cycles left of a dwell from which the torque is read.
    pub read_from: u32,
    /// Share of a new sample in the smoothed torque: about three points of the curve.
    pub watch_gain: f64,
    /// Servo cycles in a second.
    pub cycles_per_s: f64,
}

/// Batches that a sliding level is cut into.
const LEVEL_BATCHES: f64 = 12.0;

/// Way of the creep to the reversal, mm. A stop from the slide takes back what the servo overshoots, and the table's inertia unwinds
/// the drive; both go by the speed, and are a tenth or less from the slow feed. The way takes up again what the stop before it released.
pub const CREEP: f64 = 0.1;

impl Plan {
    /// What holds before the first start.
    pub const REST: Plan = Plan {
        slow_feed: false,
        use_peak: false,
        measure_only: true,
        first_sense: 1.0,
        senses: 1,
        repeats: 1,
        references: None,
        cycle_s: 0.001,
        step: 0.001,
        bin: 0.001,
        dwell: 20,
        settle: 1,
        feed: 1e-4,
        approach_speed: 1e-3,
        slide_speed: 1e-3,
        slide: 1.0,
        acceleration: 1e-5,
        limit: 0.5,
        travel: [0.0, 0.0],
        torque_bound: 0.0,
        torque_nm: 1.0,
        lag_limit: 0.0,
        ack_timeout: 1000,
        compensation_tolerance_um: 1.0,
        compensation_max_um: 0.0,
        encoder: 0.0,
        batch: 1,
        level_from: 0.0,
        read_from: 0,
        watch_gain: 0.1,
        cycles_per_s: 1000.0,
    };

    /// Checks every field and derives the constants of a cycle.
    ///
    /// # Errors
    /// `GIB_ERR_CONFIG` with the field, its value and the range allowed.
    pub fn new(config: &BacklashConfig) -> Result<Plan, Fault> {
        let or = |value: f64, default: f64| if value == 0.0 { default } else { value };
        let flag = |field, value: i32| in_range(field, f64::from(value), 0.0, 1.0).map(|v| v != 0.0);
        let c = config;
        let cycle = in_range("cycle_s\0", c.cycle_s, 5e-5, 0.02)?;
        let cycles = |seconds: f64| (seconds / cycle + 0.5) as u32;
        let step_um = in_range("step_um\0", or(c.step_um, 1.0), 0.1, 50.0)?;
        let limit_um = in_range("detection_limit_um\0", or(c.detection_limit_um, 500.0), 10.0 * step_um, 5000.0)?;
        let first_direction = in_range("first_direction\0", f64::from(c.first_direction), -1.0, 1.0)?;
        let slide_speed = in_range("slide_speed_mm_s\0", or(c.slide_speed_mm_s, 1.0), 0.05, 20.0)?;
        let shortest_slide = (0.1f64).max(slide_speed * cycle * 4.0 * LEVEL_BATCHES);
        let slide = in_range("slide_mm\0", or(c.slide_mm, shortest_slide.max(1.0)), shortest_slide, 100.0)?;
        let approach = in_range("approach_speed_mm_s\0", or(c.approach_speed_mm_s, 5.0), 0.1, 500.0)?;
        let acceleration = in_range("acceleration_mm_s2\0", or(c.acceleration_mm_s2, 50.0), 0.1, 10000.0)?;
        let low = in_range("travel_min_mm\0", c.travel_min_mm, -1e6, 1e6)?;
        let high = in_range("travel_max_mm\0", c.travel_max_mm, low + f64::MIN_POSITIVE, 1e6)?;
        let permille = flag("torque_unit\0", c.torque_unit)?;
        let lowest_rated = if permille { 1e-6 } else { 0.0 };
        let rated = in_range("rated_torque_nm\0", c.rated_torque_nm, lowest_rated, 1e6)?;
        let torque_nm = if permille { rated * 1e-3 } else { 1.0 };
        let bound_nm = in_range("torque_bound_nm\0", c.torque_bound_nm, 1e-6, 1e6)?;
        let repeats = in_range("repeats\0", if c.repeats == 0 { 3.0 } else { f64::from(c.repeats) }, 1.0, 20.0)?;
        let resolution = in_range("compensation_resolution_um\0", or(c.compensation_resolution_um, 1.0), 1e-4, 100.0)?;
        in_range("reserved\0", f64::from(c.reserved), 0.0, 0.0)?;
        let limit = limit_um * 1e-3;
        let mut plan = Plan {
            slow_feed: !flag("mode\0", c.mode)?,
            use_peak: flag("method\0", c.method)?,
            measure_only: flag("measure_only\0", c.measure_only)?,
            first_sense: if first_direction < 0.0 { -1.0 } else { 1.0 },
            senses: if flag("one_direction\0", c.one_direction)? { 1 } else { 2 },
            repeats: repeats as u32,
            references: if flag("references_given\0", c.references_given)? {
                Some([
                    in_range("reference_1_mm\0", c.reference_1_mm, low, high)?,
                    in_range("reference_2_mm\0", c.reference_2_mm, low, high)?,
                ])
            } else {
                None
            },
            cycle_s: cycle,
            step: step_um * 1e-3,
            // Finer than half a step, or half a micrometre, the curve would show how the motor's own friction turns round and how its
            // servo swings.
            bin: (limit / (BINS - 1) as f64).max(0.5e-3 * step_um.min(1.0)),
            dwell: cycles(in_range("dwell_s\0", or(c.dwell_s, 0.02f64.max(2.0 * cycle)), 2.0 * cycle, 1.0)?),
            settle: cycles(in_range("settle_s\0", or(c.settle_s, 0.2), cycle, 10.0)?).max(CLEAR_SLICES + 1),
            feed: in_range("feed_mm_s\0", or(c.feed_mm_s, 0.1), 0.001, 5.0)? * cycle,
            approach_speed: approach * cycle,
            slide_speed: slide_speed * cycle,
            slide,
            acceleration: acceleration * cycle * cycle,
            limit,
            travel: [low, high],
            torque_bound: bound_nm / torque_nm,
            torque_nm,
            lag_limit: in_range("lag_limit_mm\0", or(c.lag_limit_mm, 0.5), 1e-3, 100.0)?,
            ack_timeout: cycles(in_range("ack_timeout_s\0", or(c.ack_timeout_s, 1.0), 2.0 * cycle, 60.0)?),
            // What rounding takes or adds, and the last digit of a kernel that rounds between two amounts.
            compensation_tolerance_um: 0.500_001 * resolution,
            compensation_max_um: in_range("compensation_max_um\0", or(c.compensation_max_um, limit_um), 0.0, 5000.0)?,
            encoder: in_range("encoder_um\0", c.encoder_um, 0.0, 100.0)? * 1e-3,
            batch: (slide / (slide_speed * cycle) / LEVEL_BATCHES) as u32,
            cycles_per_s: 1.0 / cycle,
            ..Plan::REST
        };
        let braking = 0.5 * plan.slide_speed * plan.slide_speed / plan.acceleration + 2.0 * plan.slide_speed;
        plan.level_from = plan.slide + braking;
        plan.read_from = plan.dwell / 4;
        let samples = if plan.slow_feed { plan.step / plan.feed } else { f64::from(plan.read_from) };
        plan.watch_gain = 1.0 / (3.0 * samples).max(1.0);
        if let Some(references) = plan.references {
            plan.check_reach(references)?;
        }
        Ok(plan)
    }

    /// Way of a slide: take-up of the lost motion and of the servo's lag, the stretch where the level is read, and room to reach the speed
    /// and to brake, and the creep to the reversal.
    #[must_use]
    pub fn run_in(&self) -> f64 {
        CREEP + self.slide + self.limit + self.lag_limit + 2.0 * self.slide_speed * self.slide_speed / self.acceleration
    }

    /// How far a motor that stands may be off the place where it was read, mm: no more than the curve leaves out at its begin.
    #[inline(always)]
    #[must_use]
    pub fn stands(&self) -> f64 {
        2.0 * self.bin
    }

    /// Furthest that a command goes from the reversal during scan and probe.
    #[must_use]
    pub fn reach(&self) -> f64 {
        1.5 * self.limit + self.lag_limit
    }

    /// Checks that all motion about the references stays within the travel allowed.
    ///
    /// # Errors
    /// `GIB_ERR_CONFIG` naming the reference and where it may be.
    pub fn check_reach(&self, references: [f64; 2]) -> Result<(), Fault> {
        // A reversal at r after motion in sense a uses the way from r − a·run_in to r, and the scan goes back. With
        // the following error beyond it, no axis that follows its command can leave the travel allowed.
        let (before, past) = (self.run_in().max(self.reach()) + self.lag_limit, self.lag_limit);
        for (i, field) in ["reference_1_mm\0", "reference_2_mm\0"].into_iter().enumerate().take(self.senses as usize) {
            let sense = if i == 0 { self.first_sense } else { -self.first_sense };
            let (low, high) = if sense > 0.0 { (before, past) } else { (past, before) };
            in_range(field, references[i], self.travel[0] + low, self.travel[1] - high)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cycle::backlash::config::GIB_TORQUE_PERMILLE;

    fn valid() -> BacklashConfig {
        BacklashConfig {
            struct_size: size_of::<BacklashConfig>() as u32,
            cycle_s: 0.001,
            travel_max_mm: 100.0,
            torque_bound_nm: 10.0,
            ..BacklashConfig::default()
        }
    }

    #[test]
    fn size_is_the_published_one() {
        assert_eq!(size_of::<BacklashConfig>(), BacklashConfig::FIRST_SIZE);
    }

    #[test]
    fn zero_means_default_and_required_fields_are_named() {
        let plan = Plan::new(&valid()).unwrap();
        assert!((plan.step - 0.001).abs() < 1e-15 && plan.repeats == 3 && plan.dwell == 20);
        let missing = BacklashConfig { torque_bound_nm: 0.0, ..valid() };
        assert_eq!(Plan::new(&missing).unwrap_err().field, "torque_bound_nm\0");
        let permille = BacklashConfig { torque_unit: GIB_TORQUE_PERMILLE, ..valid() };
        assert_eq!(Plan::new(&permille).unwrap_err().field, "rated_torque_nm\0");
    }

    #[test]
    fn no_default_is_refused() {
        for cycle_s in [5e-5, 0.001, 0.02] {
            for slide_speed_mm_s in [0.05, 1.0, 20.0] {
                for step_um in [0.1, 50.0] {
                    let plan = Plan::new(&BacklashConfig { cycle_s, slide_speed_mm_s, step_um, ..valid() });
                    assert!(
                        plan.is_ok_and(|plan| plan.batch >= 4),
                        "{cycle_s} s, {slide_speed_mm_s} mm/s, {step_um} µm"
                    );
                }
            }
        }
    }

    #[test]
    fn a_reference_too_close_to_the_end_is_refused() {
        let near = BacklashConfig { references_given: 1, reference_1_mm: 0.5, reference_2_mm: 50.0, ..valid() };
        assert_eq!(Plan::new(&near).unwrap_err().field, "reference_1_mm\0");
        let fine = BacklashConfig { reference_1_mm: 50.0, ..near };
        assert!(Plan::new(&fine).is_ok());
    }

    #[test]
    fn not_a_number_is_refused_by_name() {
        for (config, field) in [
            (BacklashConfig { feed_mm_s: f64::NAN, ..valid() }, "feed_mm_s\0"),
            (BacklashConfig { travel_min_mm: f64::NAN, ..valid() }, "travel_min_mm\0"),
            (BacklashConfig { encoder_um: f64::INFINITY, ..valid() }, "encoder_um\0"),
        ] {
            assert_eq!(Plan::new(&config).unwrap_err().field, field);
        }
    }
}
