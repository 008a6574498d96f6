//! The configuration of a calibration, checked once and turned into the constants of a cycle.

use super::config::CalibrationConfig;
use super::table::GIB_CALIBRATION_POINTS;
use crate::error::{Fault, in_range};
use core::f64::consts::TAU;

/// Blocks into which a measurement is cut; their scatter gives the uncertainty.
pub const BLOCKS: u32 = 8;

/// Part of the acceleration that the swinging itself may take; a bent change of its amplitude takes 0.8 % at most.
const SWINGING: f64 = 0.99;

/// One frequency of the list.
#[derive(Debug, Clone, Copy, Default)]
pub struct Tone {
    /// Frequency in the list, and after rounding to whole periods in whole cycles, Hz.
    pub listed: f64,
    /// See `listed`.
    pub frequency: f64,
    /// Periods in a block, and its cycles.
    pub periods: u32,
    /// See `periods`.
    pub cycles: u32,
    /// Largest amplitude that stroke, speed and acceleration allow, mm.
    pub amplitude: f64,
    /// Largest change of the amplitude in a cycle, mm, and of that change in the next, mm.
    pub slope: f64,
    /// See `slope`.
    pub bend: f64,
}

impl Tone {
    /// rad/s.
    #[must_use]
    pub fn omega(&self) -> f64 {
        TAU * self.frequency
    }
}

/// A validated configuration. Torque in the unit of the input, lengths in mm and µm.
#[derive(Debug, Clone, Copy)]
pub struct Plan {
    /// Gains as published.
    pub published: bool,
    /// Another experiment beside those there are.
    pub add: bool,
    /// Frequencies in `tones`.
    pub count: usize,
    /// The frequencies.
    pub tones: [Tone; GIB_CALIBRATION_POINTS],
    /// Servo period, s.
    pub cycle: f64,
    /// Its reciprocal, 1/s.
    pub cycles_per_s: f64,
    /// Largest way from the start, with what the servo overshoots.
    pub travel: f64,
    /// Torque never to be exceeded, and the one to choose the amplitude for.
    pub torque_bound: f64,
    /// See `torque_bound`.
    pub torque_wanted: f64,
    /// Full scale: acceleration in m/s², ball bar in µm.
    pub saturation: [f64; 3],
    /// Standard deviation that a gain has before anything is measured.
    pub tolerance: f64,
    /// Largest |target − position|.
    pub lag: f64,
}

impl Plan {
    /// What holds before the first start.
    pub const REST: Plan = Plan {
        published: false,
        add: false,
        count: 0,
        tones: [Tone { listed: 0.0, frequency: 0.0, periods: 1, cycles: 1, amplitude: 0.0, slope: 0.0, bend: 0.0 };
            GIB_CALIBRATION_POINTS],
        cycle: 1e-3,
        cycles_per_s: 1e3,
        travel: 0.0,
        torque_bound: 0.0,
        torque_wanted: 0.0,
        saturation: [0.0; 3],
        tolerance: 0.1,
        lag: 0.0,
    };

    /// Checks every field and derives the constants of a cycle.
    ///
    /// # Errors
    /// `GIB_ERR_CONFIG` with the field, its value and the range allowed.
    pub fn new(config: &CalibrationConfig) -> Result<Plan, Fault> {
        let or = |value: f64, default: f64| if value == 0.0 { default } else { value };
        let whole = |field, value: i32, low, high| in_range(field, f64::from(value), low, high);
        let c = config;
        let cycle = in_range("cycle_s\0", c.cycle_s, 5e-5, 0.02)?;
        let count = whole("frequencies\0", c.frequencies, 1.0, GIB_CALIBRATION_POINTS as f64)? as usize;
        let permille = whole("torque_unit\0", c.torque_unit, 0.0, 1.0)? != 0.0;
        let rated = in_range("rated_torque_nm\0", c.rated_torque_nm, if permille { 1e-6 } else { 0.0 }, 1e6)?;
        let torque_nm = if permille { rated * 1e-3 } else { 1.0 };
        let bound = in_range("torque_bound_nm\0", c.torque_bound_nm, 1e-6, 1e6)? / torque_nm;
        let share = in_range("torque_share_ratio\0", or(c.torque_share_ratio, 0.6), 0.05, 0.9)?;
        let stroke = in_range("stroke_mm\0", c.stroke_mm, 0.001, 1000.0)?;
        let speed = in_range("speed_mm_s\0", or(c.speed_mm_s, 100.0), 0.1, 1e4)?;
        let hard = in_range("acceleration_mm_s2\0", or(c.acceleration_mm_s2, 5000.0), 1.0, 1e6)?;
        let range = in_range("acceleration_range_m_s2\0", c.acceleration_range_m_s2, 0.1, 1e4)?;
        let bar = in_range("ball_bar_range_um\0", or(c.ball_bar_range_um, 1000.0), 1.0, 1e6)?;
        let measure = in_range("measure_s\0", or(c.measure_s, 4.0), 0.1, 1000.0)?;
        let ramp = in_range("ramp_s\0", or(c.ramp_s, 0.5), 0.01, 10.0)?;
        let mut tones = Plan::REST.tones;
        let mut low = 0.5;
        for (tone, listed) in tones.iter_mut().zip(c.frequency_hz).take(count) {
            let listed = in_range("frequency_hz\0", listed, low, 0.1 / cycle)?;
            low = listed * 1.01;
            let periods = (measure * listed / f64::from(BLOCKS)).ceil().max(4.0);
            let cycles = (periods / (listed * cycle) + 0.5).floor();
            let frequency = periods / (cycles * cycle);
            let omega = TAU * frequency;
            let amplitude = stroke.min(speed / omega).min(SWINGING * hard / (omega * omega));
            // A quarter of the ramp each to get going and to come to rest, and it takes the time that it is to take.
            let rise = ramp.max(5.0 / frequency) / cycle;
            let slope = 4.0 / 3.0 * amplitude / rise;
            *tone = Tone {
                listed,
                frequency,
                periods: periods as u32,
                cycles: cycles as u32,
                amplitude,
                slope,
                bend: slope / (0.25 * rise),
            };
        }
        Ok(Plan {
            published: whole("method\0", c.method, 0.0, 1.0)? != 0.0,
            add: whole("add\0", c.add, 0.0, 1.0)? != 0.0,
            count,
            tones,
            cycle,
            cycles_per_s: 1.0 / cycle,
            travel: 1.2 * stroke + 0.1,
            torque_bound: bound,
            torque_wanted: share * bound,
            saturation: [0.999 * range, 0.999 * range, 0.999 * bar],
            tolerance: in_range("tolerance_ratio\0", or(c.tolerance_ratio, 0.1), 0.001, 1.0)?,
            lag: in_range("lag_limit_mm\0", or(c.lag_limit_mm, stroke.min(100.0)), 1e-4, 100.0)?,
        })
    }

    /// The tone of a point; the first where there is none.
    #[inline(always)]
    #[must_use]
    pub fn tone(&self, point: usize) -> &Tone {
        &self.tones[point & (GIB_CALIBRATION_POINTS - 1)]
    }

    /// Whether the frequencies are those of another plan.
    #[must_use]
    pub fn same_tones(&self, other: &Plan) -> bool {
        self.count == other.count && self.tones.iter().zip(&other.tones).all(|(a, b)| a.frequency == b.frequency)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    pub fn valid() -> CalibrationConfig {
        let mut config = CalibrationConfig {
            struct_size: size_of::<CalibrationConfig>() as u32,
            frequencies: 2,
            cycle_s: 0.0005,
            stroke_mm: 2.0,
            torque_bound_nm: 10.0,
            acceleration_range_m_s2: 20.0,
            ..CalibrationConfig::default()
        };
        config.frequency_hz[0] = 10.0;
        config.frequency_hz[1] = 33.3;
        config
    }

    #[test]
    fn size_is_the_published_one() {
        assert_eq!(size_of::<CalibrationConfig>(), CalibrationConfig::FIRST_SIZE);
    }

    #[test]
    fn whole_periods_take_whole_cycles_near_the_frequency_listed() {
        let plan = Plan::new(&valid()).unwrap();
        for tone in plan.tones.iter().take(2) {
            let periods = tone.frequency * f64::from(tone.cycles) * plan.cycle;
            assert!(
                (periods - f64::from(tone.periods)).abs() < 1e-9 && (tone.frequency / tone.listed - 1.0).abs() < 5e-3
            );
            let omega = tone.omega();
            assert!(
                tone.amplitude <= 2.0 && tone.amplitude * omega <= 100.0 && tone.amplitude * omega * omega <= 5000.001
            );
        }
    }

    #[test]
    fn what_is_wrong_is_named() {
        let refused = |change: &dyn Fn(&mut CalibrationConfig)| {
            let mut config = valid();
            change(&mut config);
            Plan::new(&config).unwrap_err().field
        };
        assert_eq!(refused(&|c| c.frequencies = 0), "frequencies\0");
        assert_eq!(refused(&|c| c.frequencies = 33), "frequencies\0");
        assert_eq!(refused(&|c| c.frequency_hz[1] = 10.0), "frequency_hz\0");
        assert_eq!(refused(&|c| c.frequency_hz[1] = 201.0), "frequency_hz\0");
        assert_eq!(refused(&|c| c.stroke_mm = 0.0), "stroke_mm\0");
        assert_eq!(refused(&|c| c.torque_bound_nm = f64::NAN), "torque_bound_nm\0");
        assert_eq!(refused(&|c| c.torque_unit = 1), "rated_torque_nm\0");
        assert_eq!(refused(&|c| c.method = 2), "method\0");
        assert_eq!(refused(&|c| c.add = -1), "add\0");
        assert_eq!(refused(&|c| c.measure_s = 0.05), "measure_s\0");
    }
}
