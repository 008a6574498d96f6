//! The configuration, checked once and turned into the constants of a cycle.

use super::config::*;
use super::follow::Bounds;
use super::table::{Inverse, TiltTable};
use super::trace::BLOCKS;
use crate::error::{Fault, in_range};

/// A validated configuration with every constant of a cycle derived. Lengths in mm, angles in °, time in cycles.
#[derive(Debug, Clone, Copy)]
pub struct Plan {
    /// `GIB_TILT_COMPENSATE`, `_MEASURE_ONLY` or `_TEACH`.
    pub purpose: i32,
    /// The two points rule, else the fit.
    pub two_point: bool,
    /// Another condition is only flagged.
    pub flag: bool,
    /// How the condition of the configuration differs from the table's.
    pub differs: bool,
    /// The kernel keeps the tool at the workpiece.
    pub tool_centre_point: bool,
    /// Rotary axes.
    pub rotary: [TiltRotary; 2],
    /// 1 for a current: its square is averaged; else 0.
    pub squared: f64,
    /// 1 for a DC load, else 0.
    pub plain: f64,
    /// Turns of the electrical angle a cycle and min⁻¹; 0 for a DC load.
    pub turns_per_rpm: f64,
    /// Share of a block a cycle, for a DC load.
    pub turns_per_cycle: f64,
    /// Least length of a block, cycles.
    pub block_cycles: f64,
    /// Cycles in the cut at most.
    pub time_limit: u32,
    /// Spindle speeds that belong to the condition, min⁻¹.
    pub speed: [f64; 2],
    /// Feeds that belong to the condition, mm per cycle.
    pub feed: [f64; 2],
    /// Way at the ends of a pass that does not count.
    pub entry: f64,
    /// Expected wear, share of the depth per m of cut.
    pub wear: f64,
    /// Tilt that is left alone.
    pub band_deg: f64,
    /// Change of load that is left alone.
    pub band_load: f64,
    /// Depth to be cut; 0: that at the start.
    pub nominal_depth: f64,
    /// Bounds of x, y and z, per cycle.
    pub linear: Bounds,
    /// Bounds of a, b and c, per cycle.
    pub angular: Bounds,
    /// Cycles within which the warning must be acknowledged.
    pub ack_timeout: u32,
    /// The load table.
    pub inverse: Inverse,
}

impl Plan {
    /// What holds before the first start.
    pub const REST: Plan = Plan {
        purpose: GIB_TILT_MEASURE_ONLY,
        two_point: false,
        flag: false,
        differs: false,
        tool_centre_point: false,
        rotary: [TiltRotary { axis: 0, turns_tool: 0, sense: 1, reserved: 0, pivot_mm: [0.0; 3] }; 2],
        squared: 0.0,
        plain: 1.0,
        turns_per_rpm: 0.0,
        turns_per_cycle: 0.01,
        block_cycles: 100.0,
        time_limit: 0,
        speed: [0.0; 2],
        feed: [0.0; 2],
        entry: 0.0,
        wear: 0.01,
        band_deg: 0.0,
        band_load: 0.0,
        nominal_depth: 0.0,
        linear: Bounds { speed: 1e-3, acceleration: 1e-6, most: 0.0 },
        angular: Bounds { speed: 1e-3, acceleration: 1e-6, most: 0.0 },
        ack_timeout: 0,
        inverse: Inverse::REST,
    };

    /// Checks every field and derives the constants of a cycle. The table comes with [`Plan::with_table`].
    ///
    /// # Errors
    /// `GIB_ERR_CONFIG` with the field, its value and the range allowed.
    pub fn new(config: &TiltConfig) -> Result<Plan, Fault> {
        let or = |value: f64, default: f64| if value == 0.0 { default } else { value };
        let whole = |field, value: i32, low, high| in_range(field, f64::from(value), low, high).map(|v| v as i32);
        let c = config;
        let cycle = in_range("cycle_s\0", c.cycle_s, 5e-5, 0.02)?;
        let cycles = |seconds: f64| (seconds / cycle + 0.5) as u32;
        c.condition.check()?;
        let direct = whole("signal\0", c.signal, 0.0, 1.0)? == GIB_TILT_DC_LOAD;
        let pairs = if direct { 0 } else { whole("pole_pairs\0", c.pole_pairs, 1.0, 100.0)? };
        let block_s = in_range("block_s\0", or(c.block_s, (8.0 * cycle).max(0.1)), 8.0 * cycle, 10.0)?;
        let time_limit_s = in_range("time_limit_s\0", or(c.time_limit_s, 200.0), 1.0, 20000.0)?;
        // A margin of blocks: whole periods make them a little longer or shorter.
        let block_cycles = (block_s.max(time_limit_s / (0.97 * BLOCKS as f64)) / cycle).ceil();
        let tolerance = or(c.condition_tolerance_ratio, 0.05);
        let tolerance = in_range("condition_tolerance_ratio\0", tolerance, 0.001, 0.5)?;
        let around = |value: f64| [value * (1.0 - tolerance), value * (1.0 + tolerance)];
        let most_mm = in_range("offset_max_mm\0", or(c.offset_max_mm, 5.0), 0.001, 100.0)?;
        let most_deg = in_range("offset_max_deg\0", or(c.offset_max_deg, 5.0), 0.001, 45.0)?;
        let mm_s = in_range("offset_speed_mm_s\0", or(c.offset_speed_mm_s, 20.0), 0.001, 1000.0)?;
        let mm_s2 = in_range("offset_acceleration_mm_s2\0", or(c.offset_acceleration_mm_s2, 100.0), 0.01, 1e5)?;
        let deg_s = in_range("offset_speed_deg_s\0", or(c.offset_speed_deg_s, 1.0), 1e-4, 1000.0)?;
        let deg_s2 = in_range("offset_acceleration_deg_s2\0", or(c.offset_acceleration_deg_s2, 10.0), 0.001, 1e5)?;
        let mut rotary = c.rotary;
        rotary.iter_mut().try_for_each(checked)?;
        if rotary[0].axis != GIB_TILT_AXIS_NONE && rotary[0].axis == rotary[1].axis {
            return Err(in_range("rotary.axis\0", f64::from(rotary[1].axis), 0.0, 0.0).err().unwrap_or(Fault::NONE));
        }
        Ok(Plan {
            purpose: whole("purpose\0", c.purpose, 0.0, 2.0)?,
            two_point: whole("method\0", c.method, 0.0, 1.0)? == GIB_TILT_TWO_POINT,
            flag: whole("other_condition\0", c.other_condition, 0.0, 1.0)? == GIB_TILT_FLAG,
            differs: false,
            tool_centre_point: whole("tool_centre_point\0", c.tool_centre_point, 0.0, 1.0)? == 1,
            rotary,
            squared: if direct { 0.0 } else { 1.0 },
            plain: if direct { 1.0 } else { 0.0 },
            turns_per_rpm: f64::from(pairs) * cycle / 60.0,
            turns_per_cycle: if direct { 1.0 / block_cycles } else { 0.0 },
            block_cycles,
            time_limit: cycles(time_limit_s),
            speed: around(c.condition.speed_rpm),
            feed: around(c.condition.feed_mm_min * cycle / 60.0),
            entry: in_range("entry_mm\0", c.entry_mm, 0.0, 1000.0)?,
            wear: in_range("wear_ratio_m\0", or(c.wear_ratio_m, 0.01), 1e-5, 10.0)?,
            band_deg: in_range("band_deg\0", c.band_deg, 0.0, 45.0)?,
            band_load: in_range("band_load\0", c.band_load, 0.0, 1e9)?,
            nominal_depth: in_range("nominal_depth_mm\0", c.nominal_depth_mm, 0.0, 1000.0)?,
            linear: Bounds { speed: mm_s * cycle, acceleration: mm_s2 * cycle * cycle, most: most_mm },
            angular: Bounds { speed: deg_s * cycle, acceleration: deg_s2 * cycle * cycle, most: most_deg },
            ack_timeout: cycles(in_range("ack_timeout_s\0", or(c.ack_timeout_s, 60.0), 2.0 * cycle, 3600.0)?),
            inverse: Inverse::REST,
        })
    }

    /// The plan with its load table, which must hold for the condition of the configuration; teaching needs none.
    ///
    /// # Errors
    /// `GIB_ERR_TILT_TABLE` for a table that is none, `GIB_ERR_TILT_CONDITION` for another condition than the table's.
    pub fn with_table(mut self, config: &TiltConfig, table: &TiltTable) -> Result<Plan, Fault> {
        self.inverse = Inverse::new(table)?;
        // A current is no load in %: no policy can make one of the other.
        let (signal, wanted) = (f64::from(config.signal), f64::from(table.signal));
        if config.signal != table.signal {
            let code = crate::error::GIB_ERR_TILT_CONDITION;
            return Err(Fault { code, field: "signal\0", value: signal, low: wanted, high: wanted });
        }
        let tolerance = 0.5 * (self.speed[1] - self.speed[0]) / config.condition.speed_rpm;
        match config.condition.differs_from(&table.condition, tolerance) {
            Some(fault) if !self.flag => Err(fault),
            other => Ok(Plan { differs: other.is_some(), ..self }),
        }
    }
}

fn checked(axis: &mut TiltRotary) -> Result<(), Fault> {
    in_range("rotary.axis\0", f64::from(axis.axis), 0.0, 3.0)?;
    in_range("rotary.turns_tool\0", f64::from(axis.turns_tool), 0.0, 1.0)?;
    in_range("rotary.sense\0", f64::from(axis.sense), -1.0, 1.0)?;
    axis.sense = if axis.sense == 0 { 1 } else { axis.sense };
    axis.pivot_mm.iter().try_for_each(|p| in_range("rotary.pivot_mm\0", *p, -1e5, 1e5).map(drop))
}

#[cfg(test)]
pub(crate) mod tests {
    use super::super::table::TiltCondition;
    use super::*;

    pub(crate) fn valid() -> TiltConfig {
        TiltConfig {
            struct_size: size_of::<TiltConfig>() as u32,
            cycle_s: 0.001,
            pole_pairs: 2,
            condition: TiltCondition { tool_id: 3, material_id: 7, speed_rpm: 2000.0, feed_mm_min: 300.0 },
            ..TiltConfig::default()
        }
    }

    #[test]
    fn size_is_the_published_one() {
        assert_eq!(size_of::<TiltConfig>(), TiltConfig::FIRST_SIZE);
    }

    #[test]
    fn zero_means_default_and_bad_fields_are_named() {
        let plan = Plan::new(&valid()).unwrap();
        assert!(plan.block_cycles >= 100.0 && plan.linear.most == 5.0 && plan.rotary[0].sense == 1);
        let a = TiltRotary { axis: GIB_TILT_AXIS_A, ..TiltRotary::default() };
        let slow = TiltCondition { speed_rpm: f64::NAN, ..valid().condition };
        for (config, field) in [
            (TiltConfig { cycle_s: 0.0, ..valid() }, "cycle_s\0"),
            (TiltConfig { pole_pairs: 0, ..valid() }, "pole_pairs\0"),
            (TiltConfig { condition: slow, ..valid() }, "condition.speed_rpm\0"),
            (TiltConfig { method: 2, ..valid() }, "method\0"),
            (TiltConfig { purpose: -1, ..valid() }, "purpose\0"),
            (TiltConfig { rotary: [a; 2], ..valid() }, "rotary.axis\0"),
            (TiltConfig { rotary: [TiltRotary { axis: 4, ..a }; 2], ..valid() }, "rotary.axis\0"),
            (TiltConfig { rotary: [TiltRotary { pivot_mm: [f64::NAN; 3], ..a }; 2], ..valid() }, "rotary.pivot_mm\0"),
            (TiltConfig { offset_max_mm: -1.0, ..valid() }, "offset_max_mm\0"),
        ] {
            assert_eq!(Plan::new(&config).unwrap_err().field, field);
        }
        assert!(Plan::new(&TiltConfig { signal: GIB_TILT_DC_LOAD, pole_pairs: 0, ..valid() }).is_ok());
        for cycle_s in [5e-5, 0.0126, 0.02] {
            let plan = Plan::new(&TiltConfig { cycle_s, time_limit_s: 1.0, ..valid() }).unwrap();
            assert_eq!(plan.block_cycles, (0.1 / cycle_s).ceil().max(8.0), "{cycle_s}");
        }
    }

    #[test]
    fn a_table_of_another_condition_is_refused_or_flagged() {
        let mut table = TiltTable { condition: valid().condition, ..TiltTable::default() };
        table.add(1.0, 10.0, 0.0).unwrap();
        table.add(2.0, 15.0, 0.0).unwrap();
        let plan = |config: &TiltConfig| Plan::new(config).unwrap().with_table(config, &table);
        assert!(!plan(&valid()).unwrap().differs);
        let c = valid().condition;
        for (condition, field) in [
            (TiltCondition { tool_id: 4, ..c }, "condition.tool_id\0"),
            (TiltCondition { material_id: 8, ..c }, "condition.material_id\0"),
            (TiltCondition { speed_rpm: 2200.0, ..c }, "condition.speed_rpm\0"),
            (TiltCondition { feed_mm_min: 250.0, ..c }, "condition.feed_mm_min\0"),
        ] {
            let other = TiltConfig { condition, ..valid() };
            assert_eq!(plan(&other).unwrap_err().field, field);
            assert!(plan(&TiltConfig { other_condition: GIB_TILT_FLAG, ..other }).unwrap().differs);
        }
        let direct = TiltConfig { signal: GIB_TILT_DC_LOAD, other_condition: GIB_TILT_FLAG, ..valid() };
        assert_eq!(plan(&direct).unwrap_err().field, "signal\0");
    }
}
