//! The configuration of a correction, checked once and turned into the constants of a cycle.

use super::config::{GIB_VIBRATION_HARMONICS, VibrationConfig};
use crate::cycle::calibration::table::CalibrationTable;
use crate::cycle::lanes::Lanes;
use crate::error::{Fault, in_range};
use wide::f64x2;

/// Cells of the grid on which the calibration's gains are laid out.
const CELLS: usize = 128;
/// Adding this rounds a number to a whole one, which then stands in the lowest bits.
const ROUNDING: f64 = 1.5 * (1u64 << 52) as f64;
/// Samples that a period of the highest tracked harmonic has at least: 1/0.4.
const NYQUIST: f64 = 0.4;

/// A validated configuration with every constant of a cycle derived. Rates in turns per cycle.
#[derive(Debug, Clone, Copy)]
pub struct Plan {
    /// Integrated twice instead of tracked.
    pub integrate: bool,
    /// The input has a second slide.
    pub second_slide: bool,
    /// Harmonics tracked.
    pub harmonics: usize,
    /// Pairs of harmonics that are computed: four or eight.
    pub pairs: usize,
    /// Servo period, s.
    pub cycle: f64,
    /// Share of a cycle's turn in the filtered speed.
    pub speed_share: f64,
    /// Rate from which the spindle turns.
    pub rate_min: f64,
    /// Largest turn in a cycle.
    pub turn_max: f64,
    /// Acceleration at which a sensor is saturated, and the largest plausible one of either, m/s².
    pub saturation: f64,
    /// See `saturation`.
    pub acceleration_max: f64x2,
    /// Largest plausible displacement, µm.
    pub displacement_max: f64,
    /// By how much the largest correction fades in a cycle, µm.
    pub displacement_step: f32,
    /// Rates of harmonics between which an acceleration is worth a displacement.
    pub tracked: [f32; 2],
    /// Change of the blend in a cycle.
    pub fade: f64,
    /// Part of a turn's news that enters the harmonics once they are known.
    pub share_min: f32,
    /// Largest share, at which the tracker is well stable.
    pub share_max: f32,
    /// Displacement in µm is acceleration times this over (harmonic · rate)².
    pub to_um: f32,
    /// rpm per turn per cycle.
    pub to_rpm: f64,
    /// Harmonic at which the published method is corrected.
    pub main: f64,
    /// Cells per turn per cycle.
    cells: f64,
    /// Complex gains over frequency: seat, bearing.
    gains: [Lanes; CELLS + 1],
}

impl Plan {
    /// What holds before the first start: nothing is corrected.
    pub const REST: Plan = Plan {
        integrate: false,
        second_slide: false,
        harmonics: 0,
        pairs: 0,
        cycle: 1e-3,
        speed_share: 1.0,
        rate_min: 1.0,
        turn_max: 0.0,
        saturation: 0.0,
        acceleration_max: f64x2::ZERO,
        displacement_max: 0.0,
        displacement_step: 0.0,
        tracked: [1.0, 0.0],
        fade: 1.0,
        share_min: 0.0,
        share_max: 0.0,
        to_um: 0.0,
        to_rpm: 0.0,
        main: 1.0,
        cells: 0.0,
        gains: [Lanes::new([1.0, 0.0, 1.0, 0.0]); CELLS + 1],
    };

    /// Checks every field and derives the constants of a cycle; without a table both sensors are believed as they are.
    ///
    /// # Errors
    /// `GIB_ERR_CONFIG` with the field, its value and the range allowed.
    pub fn new(config: &VibrationConfig, table: Option<&CalibrationTable>) -> Result<Plan, Fault> {
        let or = |value: f64, default: f64| if value == 0.0 { default } else { value };
        let whole = |field, value: i32, low, high| in_range(field, f64::from(value), low, high);
        let c = config;
        let cycle = in_range("cycle_s\0", c.cycle_s, 5e-5, 0.02)?;
        let most = GIB_VIBRATION_HARMONICS as f64;
        let harmonics = if c.harmonics == 0 { 8.0 } else { whole("harmonics\0", c.harmonics, 1.0, most)? };
        let main = if c.main_harmonic == 0 { 1.0 } else { whole("main_harmonic\0", c.main_harmonic, 1.0, most)? };
        let range = in_range("acceleration_range_m_s2\0", c.acceleration_range_m_s2, 0.1, 1e4)?;
        let plausible = or(c.acceleration_max_m_s2, range);
        let slow = in_range("speed_min_rpm\0", or(c.speed_min_rpm, 30.0), 1.0, 1e4)?;
        let quarter = 15.0 / cycle;
        let fast = in_range("speed_max_rpm\0", or(c.speed_max_rpm, quarter.min(1e4)), slow, quarter)?;
        let low = in_range("frequency_min_hz\0", or(c.frequency_min_hz, 1.0), 0.1, 1000.0)?;
        let averaging = in_range("averaging_revolutions\0", or(c.averaging_revolutions, 16.0), 1.0, 1000.0)?;
        let fade = in_range("fade_s\0", or(c.fade_s, 0.1), 0.001, 10.0)?;
        let filter = in_range("speed_filter_s\0", or(c.speed_filter_s, cycle.max(0.02)), cycle, 1.0)?;
        let fade = (cycle / fade).min(1.0);
        let displacement_max = in_range("displacement_max_um\0", or(c.displacement_max_um, 100.0), 0.1, 1e4)?;
        let mut plan = Plan {
            integrate: whole("method\0", c.method, 0.0, 1.0)? != 0.0,
            second_slide: whole("second_slide\0", c.second_slide, 0.0, 1.0)? != 0.0,
            harmonics: harmonics as usize,
            pairs: if harmonics > 8.0 { 8 } else { 4 },
            cycle,
            speed_share: cycle / filter,
            rate_min: slow / 60.0 * cycle,
            // A quarter more than the fastest: the encoder's grid, and a cycle that comes late.
            turn_max: (1.25 * fast / 60.0 * cycle).min(0.3),
            // One part in a thousand below full scale: the last step of a 16 bit converter, and its offset.
            saturation: 0.999 * range,
            acceleration_max: f64x2::splat(
                in_range("acceleration_max_m_s2\0", plausible, 1e-3, range)?.min(0.998 * range),
            ),
            displacement_max,
            displacement_step: (2.0 * displacement_max * fade) as f32,
            tracked: [(low * cycle) as f32, NYQUIST as f32],
            fade,
            share_min: (1.0 / averaging) as f32,
            share_max: (1.0 / (2.0 * harmonics + 2.0)) as f32,
            to_um: (-1e6 * (cycle / core::f64::consts::TAU).powi(2)) as f32,
            to_rpm: 60.0 / cycle,
            main,
            cells: 0.0,
            gains: Plan::REST.gains,
        };
        if let Some(table) = table {
            table.check()?;
            // Nothing is tracked beyond: cells up there would leave fewer for what is.
            let last = table.points().last().map_or(1.0, |point| point.frequency_hz).min(NYQUIST / cycle);
            plan.cells = CELLS as f64 / (last * cycle);
            for (i, gain) in plan.gains.iter_mut().enumerate() {
                let [[a, b], [c, d]] = table.gains(last * i as f64 / CELLS as f64);
                *gain = Lanes::new([a, b, c, d].map(|x| x as f32));
            }
        }
        Ok(plan)
    }

    /// Complex gains of seat and bearing at a rate, turns per cycle: real, imaginary, real, imaginary.
    #[inline(always)]
    #[must_use]
    pub fn gain(&self, rate: f64) -> Lanes {
        let place = rate * self.cells;
        let last = CELLS as f64 - 0.25;
        let inside = if place < last { place } else { last };
        // The cell whose middle is nearest; `as usize` would look for overflows first.
        let cell = (inside - 0.5 + ROUNDING).to_bits() as usize & (2 * CELLS - 1);
        let part = (place - f64::from(cell as i32)) as f32;
        let part = if part < 1.0 { part } else { 1.0 };
        match (self.gains.get(cell), self.gains.get(cell + 1)) {
            (Some(from), Some(to)) => *from + (*to - *from) * Lanes::splat(part),
            _ => Lanes::new([1.0, 0.0, 1.0, 0.0]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn valid() -> VibrationConfig {
        VibrationConfig {
            struct_size: size_of::<VibrationConfig>() as u32,
            cycle_s: 0.0005,
            acceleration_range_m_s2: 20.0,
            ..VibrationConfig::default()
        }
    }

    #[test]
    fn size_is_the_published_one() {
        assert_eq!(size_of::<VibrationConfig>(), VibrationConfig::FIRST_SIZE);
    }

    #[test]
    fn zero_means_default_and_what_is_wrong_is_named() {
        let plan = Plan::new(&valid(), None).unwrap();
        assert!(plan.harmonics == 8 && plan.pairs == 4 && !plan.integrate && plan.share_min == 0.0625);
        for (config, field) in [
            (VibrationConfig { cycle_s: 0.0, ..valid() }, "cycle_s\0"),
            (VibrationConfig { acceleration_range_m_s2: 0.0, ..valid() }, "acceleration_range_m_s2\0"),
            (VibrationConfig { acceleration_max_m_s2: 21.0, ..valid() }, "acceleration_max_m_s2\0"),
            (VibrationConfig { harmonics: 17, ..valid() }, "harmonics\0"),
            (VibrationConfig { harmonics: -1, ..valid() }, "harmonics\0"),
            (VibrationConfig { method: 2, ..valid() }, "method\0"),
            (VibrationConfig { second_slide: 2, ..valid() }, "second_slide\0"),
            (VibrationConfig { main_harmonic: 17, ..valid() }, "main_harmonic\0"),
            (VibrationConfig { speed_max_rpm: 20.0, ..valid() }, "speed_max_rpm\0"),
            (VibrationConfig { displacement_max_um: f64::NAN, ..valid() }, "displacement_max_um\0"),
            (VibrationConfig { fade_s: -1.0, ..valid() }, "fade_s\0"),
        ] {
            assert_eq!(Plan::new(&config, None).unwrap_err().field, field);
        }
        assert_eq!(Plan::new(&valid(), Some(&CalibrationTable::default())).unwrap_err().field, "count\0");
    }

    #[test]
    fn the_grid_follows_the_table() {
        let mut table = CalibrationTable { count: 3, ..CalibrationTable::default() };
        for (i, point) in table.point.iter_mut().take(3).enumerate() {
            point.frequency_hz = 20.0 * (i + 1) as f64;
            point.gain_ratio = [1.0 + 0.1 * i as f64, 0.9];
            point.phase_deg = [5.0 * i as f64, -3.0];
        }
        let plan = Plan::new(&valid(), Some(&table)).unwrap();
        for f in [0.0, 7.0, 20.0, 31.3, 47.0, 60.0, 61.0, 900.0] {
            let [[a, b], [c, d]] = table.gains(f);
            let found = plan.gain(f * 0.0005).to_array().map(f64::from);
            for (x, y) in found.iter().zip([a, b, c, d]) {
                assert!((x - y).abs() < 5e-4, "{f} Hz: {found:?}");
            }
        }
    }
}
