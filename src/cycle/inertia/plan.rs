//! The configuration of a measurement, checked once and turned into the constants of a cycle.

use super::blocks::{BLOCKS, Gate};
use super::config::InertiaConfig;
use super::fit::Question;
use crate::error::{Fault, in_range};

/// A validated configuration with every constant of a cycle derived. Speeds in rpm, time in cycles, torque in the unit
/// of the input.
#[derive(Debug, Clone, Copy)]
pub struct Plan {
    /// Only listen.
    pub listen: bool,
    /// Times up and down.
    pub ramps: u32,
    /// Speeds at which the ramps begin and end.
    pub speeds: [f64; 2],
    /// Largest change of speed, rpm per cycle.
    pub acceleration: f64,
    /// Cycles of the first ramp, the third and so on, and of those between them, which are gentler.
    pub ramp: u32,
    /// See `ramp`.
    pub gentle: u32,
    /// Cycles at constant speed.
    pub hold: u32,
    /// Cycles to listen.
    pub listen_cycles: u32,
    /// Which samples count.
    pub gate: Gate,
    /// Samples in a block.
    pub block: u32,
    /// Servo period, s.
    pub cycle_s: f64,
    /// N·m per unit of the torque input.
    pub torque_nm: f64,
    /// Largest |torque| allowed, in the unit of the input.
    pub torque_bound: f64,
    /// Largest |command − speed| allowed, rpm.
    pub lag_limit: f64,
    /// What the fit needs to know.
    pub question: Question,
}

/// Blocks that a ramp is cut into where the room allows it: enough to see scatter, long enough to calm it.
const BLOCKS_PER_RAMP: u32 = 24;
/// Fewest where it does not: with fewer, the corners of the ramps cannot be told from noise. Of more ramps than have room then
/// the first count.
const FEWEST_PER_RAMP: u32 = 8;
/// Acceleration of every second ramp, as a share of the first's: a motor that saturates looks like another inertia at one
/// acceleration, and at two it does not.
const GENTLER: f64 = 0.6;
/// Blocks that a whole measurement is planned to fill; the rest is room for what starts late.
const PLANNED: u32 = BLOCKS as u32 * 4 / 5;

impl Plan {
    /// What holds before the first start.
    #[must_use]
    pub fn rest() -> Plan {
        Plan {
            listen: true,
            ramps: 1,
            speeds: [0.0, 0.0],
            acceleration: 1.0,
            ramp: 1,
            gentle: 1,
            hold: 1,
            listen_cycles: 1,
            gate: Gate { standstill: 1.0, base: f64::MAX, saturation: f64::MAX, takeup: 1 },
            block: 4,
            cycle_s: 1e-3,
            torque_nm: 1.0,
            torque_bound: f64::MAX,
            lag_limit: f64::MAX,
            question: Question::PLAIN,
        }
    }

    /// Checks every field and derives the constants of a cycle.
    ///
    /// # Errors
    /// `GIB_ERR_CONFIG` with the field, its value and the range allowed.
    pub fn new(c: &InertiaConfig) -> Result<Plan, Fault> {
        let or = |value: f64, default: f64| if value == 0.0 { default } else { value };
        let cycle = in_range("cycle_s\0", c.cycle_s, 5e-5, 0.02)?;
        let cycles = |seconds: f64| (seconds / cycle + 0.5) as u32;
        in_range("reserved\0", f64::from(c.reserved), 0.0, 0.0)?;
        let listen = in_range("mode\0", f64::from(c.mode), 0.0, 1.0)? != 0.0;
        let torque_nm = torque_unit(c)?;
        let takeup = in_range("takeup_s\0", or(c.takeup_s, 0.1), 0.0, 5.0)?;
        let standstill = in_range("standstill_rpm\0", or(c.standstill_rpm, 1.0), 0.0, 1000.0)?;
        let base = in_range("base_speed_rpm\0", or(c.base_speed_rpm, f64::MAX), 0.0, f64::MAX)?;
        let saturation = in_range("saturation_nm\0", or(c.saturation_nm, f64::MAX), 0.0, f64::MAX)?;
        let bound = in_range("torque_bound_nm\0", or(c.torque_bound_nm, f64::MAX), 0.0, f64::MAX)?;
        let own = in_range("own_inertia_kg_m2\0", c.own_inertia_kg_m2, 0.0, 1e6)?;
        let own_uncertainty = in_range("own_uncertainty_kg_m2\0", c.own_uncertainty_kg_m2, 0.0, 1e6)?;
        let target = in_range("target_ratio\0", or(c.target_ratio, 0.05), 0.001, 0.25)?;
        let process_step = in_range("process_step\0", f64::from(c.process_step), 0.0, 9999.0)?;
        let unit = |nm: f64| if nm == f64::MAX { nm } else { nm / torque_nm };
        let mut plan = Plan {
            listen,
            gate: Gate { standstill, base, saturation: unit(saturation), takeup: cycles(takeup) },
            cycle_s: cycle,
            torque_nm,
            torque_bound: unit(bound),
            question: Question {
                sample_s: cycle,
                torque_step: 0.0,
                speed_step: 0.0,
                target,
                own: [own, own_uncertainty],
                process_step: process_step as i32,
            },
            ..Plan::rest()
        };
        if listen {
            let shortest = cycle * 4.0 * BLOCKS as f64 / 8.0;
            plan.listen_cycles = cycles(in_range("listen_s\0", c.listen_s, shortest, 3600.0)?);
            // The steps of a counted speed are as large as what a few samples change by: sixteen calm them, where that leaves 128
            // blocks. In a long time they get longer as they come: it may end early.
            plan.block = (plan.listen_cycles / 128).clamp(4, 16);
        } else {
            in_range("listen_s\0", c.listen_s, 0.0, 3600.0)?;
            plan.add_ramps(c, takeup)?;
        }
        Ok(plan)
    }

    fn add_ramps(&mut self, c: &InertiaConfig, takeup: f64) -> Result<(), Fault> {
        let or = |value: f64, default: f64| if value == 0.0 { default } else { value };
        let cycle = self.cycle_s;
        let high = in_range("speed_high_rpm\0", c.speed_high_rpm, -2e5, 2e5)?;
        let top = in_range("speed_high_rpm\0", high.abs(), 10.0 * self.gate.standstill, 2e5)?;
        let low = in_range("speed_low_rpm\0", or(c.speed_low_rpm, 0.1 * top), self.gate.standstill, 0.9 * top)?;
        in_range("base_speed_rpm\0", self.gate.base, low, f64::MAX)?;
        // In a ramp must remain, beside the take-up, room for four blocks.
        let shortest = (2.0 * takeup).max(takeup + 16.0 * cycle);
        let steepest = (top - low) / shortest;
        let acceleration =
            in_range("acceleration_rpm_s\0", c.acceleration_rpm_s, (top - low) / 600.0, steepest.min(1e7))?;
        let hold = in_range("hold_s\0", or(c.hold_s, 0.3), cycle, 60.0)?;
        self.ramps = in_range("ramps\0", or(f64::from(c.ramps), 2.0), 1.0, 50.0)? as u32;
        self.lag_limit = in_range("lag_limit_rpm\0", or(c.lag_limit_rpm, 0.25 * top), 1e-3, 4e5)?;
        self.speeds = if high < 0.0 { [-low, -top] } else { [low, top] };
        self.acceleration = acceleration * cycle;
        self.ramp = self.cycles_between(low, top);
        self.gentle = (f64::from(self.ramp) / GENTLER) as u32;
        self.hold = (hold / cycle + 0.5) as u32;
        let roomy = (self.gathering() / PLANNED).min(self.ramp / FEWEST_PER_RAMP);
        self.block = (self.ramp / BLOCKS_PER_RAMP).max(roomy).max(4);
        Ok(())
    }

    /// Cycles of a ramp between two speeds, rpm; at least 1. Rounded up, so that none is steeper than asked for.
    #[must_use]
    pub fn cycles_between(&self, from: f64, to: f64) -> u32 {
        // A whole number of cycles may come out a rounding error above itself.
        const TRIFLE: f64 = 1e-6;
        (((to - from).abs() / self.acceleration - TRIFLE).ceil() as u32).max(1)
    }

    /// Cycles that the ramp of this number (from 0) takes up, and down again.
    #[must_use]
    pub fn cycles_of(&self, ramp: u32) -> u32 {
        if ramp.is_multiple_of(2) { self.ramp } else { self.gentle }
    }

    /// Cycles in which ramps and holds are gathered.
    #[must_use]
    pub fn gathering(&self) -> u32 {
        let one = |ramp| 2 * u64::from(self.cycles_of(ramp)) + 2 * u64::from(self.hold);
        let all = u64::from(self.hold) + (0..self.ramps).map(one).sum::<u64>();
        u32::try_from(all).unwrap_or(u32::MAX)
    }
}

/// N·m per unit of the torque input.
fn torque_unit(c: &InertiaConfig) -> Result<f64, Fault> {
    let unit = in_range("torque_unit\0", f64::from(c.torque_unit), 0.0, 2.0)? as u32;
    let rated = in_range("rated_torque_nm\0", c.rated_torque_nm, if unit == 1 { 1e-6 } else { 0.0 }, 1e6)?;
    let constant = in_range("torque_constant_nm_a\0", c.torque_constant_nm_a, if unit == 2 { 1e-9 } else { 0.0 }, 1e6)?;
    Ok(match unit {
        0 => 1.0,
        1 => crate::units::nm_from_permille(1.0, rated),
        _ => constant,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cycle::inertia::config::{GIB_INERTIA_LISTEN, GIB_TORQUE_AMPERE};

    fn valid() -> InertiaConfig {
        InertiaConfig {
            struct_size: size_of::<InertiaConfig>() as u32,
            cycle_s: 0.001,
            speed_high_rpm: 2000.0,
            acceleration_rpm_s: 1500.0,
            ..InertiaConfig::default()
        }
    }

    #[test]
    fn size_is_the_published_one() {
        assert_eq!(size_of::<InertiaConfig>(), InertiaConfig::FIRST_SIZE);
    }

    #[test]
    fn zero_means_default_and_required_fields_are_named() {
        let plan = Plan::new(&valid()).unwrap();
        assert!(plan.ramps == 2 && plan.ramp == 1200 && plan.speeds == [200.0, 2000.0] && plan.block == 50);
        let field = |config: InertiaConfig| Plan::new(&config).unwrap_err().field;
        assert_eq!(field(InertiaConfig { cycle_s: 0.0, ..valid() }), "cycle_s\0");
        assert_eq!(field(InertiaConfig { speed_high_rpm: 0.0, ..valid() }), "speed_high_rpm\0");
        assert_eq!(field(InertiaConfig { acceleration_rpm_s: 0.0, ..valid() }), "acceleration_rpm_s\0");
        assert_eq!(field(InertiaConfig { acceleration_rpm_s: 1e5, ..valid() }), "acceleration_rpm_s\0");
        assert_eq!(field(InertiaConfig { torque_unit: GIB_TORQUE_AMPERE, ..valid() }), "torque_constant_nm_a\0");
        assert_eq!(field(InertiaConfig { mode: GIB_INERTIA_LISTEN, ..valid() }), "listen_s\0");
        assert_eq!(field(InertiaConfig { speed_high_rpm: f64::NAN, ..valid() }), "speed_high_rpm\0");
        for listen_s in [f64::NAN, f64::INFINITY, -1.0] {
            assert_eq!(field(InertiaConfig { listen_s, ..valid() }), "listen_s\0", "also where gib ramps");
        }
        assert_eq!(field(InertiaConfig { own_inertia_kg_m2: -1.0, ..valid() }), "own_inertia_kg_m2\0");
    }

    #[test]
    fn a_short_time_to_listen_is_cut_into_blocks_that_calm_a_counted_speed() {
        for (listen_s, block) in [(0.3, 4), (1.0, 7), (2.5, 16), (6.0, 16), (60.0, 16), (3600.0, 16)] {
            let config = InertiaConfig { mode: GIB_INERTIA_LISTEN, listen_s, ..valid() };
            assert_eq!(Plan::new(&config).unwrap().block, block, "{listen_s} s");
        }
    }

    #[test]
    fn every_measurement_fits_into_its_blocks_or_has_enough_of_each_ramp() {
        for (high, acceleration, ramps) in [(2000.0, 1500.0, 2), (12000.0, 25.0, 50), (300.0, 1000.0, 50)] {
            let config = InertiaConfig { speed_high_rpm: high, acceleration_rpm_s: acceleration, ramps, ..valid() };
            let plan = Plan::new(&config).unwrap();
            let (blocks, in_ramp) = (plan.gathering() / plan.block, plan.ramp / plan.block);
            assert!(blocks <= BLOCKS as u32 || in_ramp == FEWEST_PER_RAMP, "{plan:?}");
            assert!(in_ramp >= FEWEST_PER_RAMP, "{plan:?}");
        }
    }
}
