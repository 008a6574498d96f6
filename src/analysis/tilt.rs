//! Tilt of a workpiece, and rows of a load table, from recordings of cuts.
//!
//! The same state machine as on the cycle (`cycle::tilt`), fed row by row; a row counts as in the cut where the feed along the
//! path is that of the condition.

use std::fmt;

use crate::cycle::tilt::config::{
    GIB_TILT_AC_CURRENT, GIB_TILT_DC_LOAD, GIB_TILT_FLAG, GIB_TILT_MEASURE_ONLY, GIB_TILT_TEACH, TiltConfig,
};
use crate::cycle::tilt::io::{GIB_TILT_INPUT_CUTTING, GIB_TILT_INPUT_END, TiltInput, TiltOutput};
use crate::cycle::tilt::machine::Tilt;
use crate::cycle::tilt::plan::Plan;
use crate::cycle::tilt::table::{TiltCondition, TiltTable};
use crate::cycle::tilt::verdict::TiltReport;
use crate::error::{Fault, GIB_ERR_TILT_ALIAS, GIB_ERR_TILT_RANGE, status_text};
use crate::recording::{Column, Recording, RecordingError, Signal, Unit};

/// What is known beside the recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Condition of the cut; speed and feed are compared with the recording's.
    pub condition: TiltCondition,
    /// `GIB_TILT_AC_CURRENT` (column `spindle.current_a`) or `GIB_TILT_DC_LOAD` (`spindle.load_percent`).
    pub signal: i32,
    /// Pole pairs of the spindle motor, for a current.
    pub pole_pairs: i32,
    /// Way left out at both ends of a pass, mm.
    pub entry_mm: f64,
    /// Share by which speed and feed may differ from the condition.
    pub tolerance: f64,
    /// Go on under another condition, and say so.
    pub flag: bool,
}

/// Why a recording gives no tilt or row.
#[derive(Debug)]
pub enum Error {
    /// The recording has not what is needed.
    Recording(RecordingError),
    /// What the family refused it for.
    Refused(Fault),
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let fault = match self {
            Error::Recording(error) => return error.fmt(f),
            Error::Refused(fault) => fault,
        };
        write!(f, "{}", status_text(fault.code).trim_end_matches('\0'))?;
        let Fault { code, value, high, .. } = *fault;
        match fault.field.trim_end_matches('\0') {
            "" => Ok(()),
            "off_condition" => write!(
                f,
                ": {value} stretches of 0.1 s in the cut have its feed and another speed, or the speed sways; {high} may. \
                 Give the cut's own speed and feed, or a wider --tolerance"
            ),
            "load" if code == GIB_ERR_TILT_RANGE => {
                write!(f, ": {value} stretches of 0.1 s; {high} may. Teach shallower and deeper cuts")
            }
            "speed_rpm" if code == GIB_ERR_TILT_ALIAS => {
                write!(f, ": {value} stretches of 0.1 s; {high} may. Record a load in percent, or cut at another speed")
            }
            "blocks" => write!(
                f,
                ": {value} stretches of 0.1 s in the cut, {} are needed. A row counts where the feed is the condition's: check \
                 speed, feed and --entry",
                fault.low
            ),
            field => write!(f, ": {field} is {:.6}, allowed from {:.6} to {:.6}", fault.value, fault.low, fault.high),
        }
    }
}

impl std::error::Error for Error {}

impl From<RecordingError> for Error {
    fn from(error: RecordingError) -> Error {
        Error::Recording(error)
    }
}

/// A cut of known depth: its mean load, to be added to a table.
///
/// # Errors
/// A missing column, or what the family refuses the cut for.
pub fn taught(recording: &Recording, options: &Options) -> Result<TiltReport, Error> {
    run(recording, options, None)
}

/// The tilt of the plane that was cut.
///
/// # Errors
/// A missing column, another condition than the table's, or what the family refuses the cut for.
pub fn measured(recording: &Recording, options: &Options, table: &TiltTable) -> Result<TiltReport, Error> {
    run(recording, options, Some(table))
}

fn run(recording: &Recording, options: &Options, table: Option<&TiltTable>) -> Result<TiltReport, Error> {
    let rows = Rows::of(recording, options)?;
    let config = TiltConfig {
        struct_size: size_of::<TiltConfig>() as u32,
        purpose: if table.is_some() { GIB_TILT_MEASURE_ONLY } else { GIB_TILT_TEACH },
        signal: options.signal,
        other_condition: if options.flag { GIB_TILT_FLAG } else { 0 },
        pole_pairs: options.pole_pairs,
        cycle_s: recording.sampling.period_s,
        condition: options.condition,
        condition_tolerance_ratio: options.tolerance,
        entry_mm: options.entry_mm,
        time_limit_s: (recording.sampling.duration_s + 1.0).clamp(1.0, 20000.0),
        block_s: (16.0 * recording.sampling.period_s).max(0.1),
        ..TiltConfig::default()
    };
    let plan = Plan::new(&config).and_then(|plan| match table {
        Some(table) => plan.with_table(&config, table),
        None => Ok(plan),
    });
    let mut tilt = Box::new(Tilt::default());
    tilt.start(plan).map_err(Error::Refused)?;
    let mut output = TiltOutput::default();
    let mut step = |input: &TiltInput| {
        tilt.step(input, &mut output);
        tilt.busy()
    };
    let mut last = TiltInput::default();
    for row in 0..recording.rows() {
        last = rows.input(row);
        if !step(&last) {
            break;
        }
    }
    last.flags = GIB_TILT_INPUT_END;
    while step(&last) {}
    if tilt.output().status < 0 { Err(Error::Refused(tilt.fault())) } else { Ok(tilt.report()) }
}

/// The columns of a recording as inputs of a cycle.
struct Rows<'a> {
    x: Vec<f64>,
    y: Vec<f64>,
    load: std::borrow::Cow<'a, [f64]>,
    rpm: std::borrow::Cow<'a, [f64]>,
    cutting: Vec<bool>,
}

impl<'a> Rows<'a> {
    fn of(recording: &'a Recording, options: &Options) -> Result<Rows<'a>, RecordingError> {
        let (signal, unit) = match options.signal {
            GIB_TILT_AC_CURRENT => (Signal::Current, Unit::A),
            _ => (Signal::Load, Unit::Percent),
        };
        let mut columns = vec![recording.column("spindle", signal)?, recording.column("spindle", Signal::Speed)?];
        let [load, rpm] = [(signal, unit), (Signal::Speed, Unit::Rpm)].map(|(s, u)| recording.need("spindle", s, u));
        let mut axis = |channel: &str| -> Result<Option<Vec<f64>>, RecordingError> {
            let signals = [Signal::PositionCommand, Signal::Position];
            let Some(signal) = signals.into_iter().find(|s| recording.get(channel, *s).is_some()) else {
                return Ok(None);
            };
            columns.push(recording.column(channel, signal)?);
            Ok(Some(recording.need(channel, signal, Unit::Mm)?.into_owned()))
        };
        let (x, y) = (axis("x")?, axis("y")?);
        if x.is_none() && y.is_none() {
            // The error names what is missing.
            recording.column("x", Signal::Position)?;
        }
        let still = || vec![0.0; recording.rows()];
        let (x, y) = (x.unwrap_or_else(still), y.unwrap_or_else(still));
        let cutting = at_feed(recording, &columns, &x, &y, options);
        Ok(Rows { x, y, load: load?, rpm: rpm?, cutting })
    }

    fn input(&self, row: usize) -> TiltInput {
        TiltInput {
            position_mm: [self.x[row], self.y[row], 0.0],
            load: self.load[row],
            speed_rpm: self.rpm[row],
            flags: if self.cutting[row] { GIB_TILT_INPUT_CUTTING } else { 0 },
            ..TiltInput::default()
        }
    }
}

/// The rows at which the path goes on at the condition's feed, over a tenth of a second; not across gaps and jumps.
fn at_feed(recording: &Recording, columns: &[&Column], x: &[f64], y: &[f64], options: &Options) -> Vec<bool> {
    let mut cutting = vec![false; recording.rows()];
    let half = ((0.05 / recording.sampling.period_s).round() as usize).max(1);
    let feed = options.condition.feed_mm_min / 60.0;
    for run in recording.runs(columns) {
        for row in run.clone() {
            let (from, to) = (row.saturating_sub(half).max(run.start), (row + half).min(run.end - 1));
            let way = f64::hypot(x[to] - x[from], y[to] - y[from]);
            let speed = way / (recording.time_s[to] - recording.time_s[from]);
            cutting[row] = (speed - feed).abs() <= options.tolerance * feed;
        }
    }
    cutting
}

/// The signal that a recording has: a DC load before a current.
///
/// # Errors
/// Neither is there; the message names the load's column.
pub fn signal_of(recording: &Recording) -> Result<i32, RecordingError> {
    if recording.get("spindle", Signal::Load).is_none() && recording.get("spindle", Signal::Current).is_some() {
        return Ok(GIB_TILT_AC_CURRENT);
    }
    recording.column("spindle", Signal::Load).map(|_| GIB_TILT_DC_LOAD)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rapid to the start, then passes forth and back over 80 mm at 5 mm/s and 10 mm apart; load 30 + 8·√depth, grid 0.01.
    fn recorded(depth: impl Fn(f64, f64) -> f64, seed: u64) -> Recording {
        let (mut time, mut columns, mut random) = (Vec::new(), [const { Vec::new() }; 4], seed);
        let mut row = |x: f64, y: f64, load: f64| {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let noise = (random >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
            time.push(0.002 * time.len() as f64);
            let load = ((load * (1.0 + 0.03 * noise)) * 100.0).round() / 100.0;
            columns.iter_mut().zip([x, y, load, 2000.0]).for_each(|(column, value)| column.push(value));
        };
        (0..50).for_each(|i| row(-2.0 * f64::from(i), 0.0, 5.0));
        for pass in 0..6 {
            let y = 10.0 * f64::from(if pass < 3 { pass } else { 5 - pass });
            for i in 0..=8000 {
                let way = 0.01 * f64::from(i);
                let x = if pass % 2 == 0 { way } else { 80.0 - way };
                row(x, y, 30.0 + 8.0 * depth(x, y).sqrt());
            }
            (0..100).for_each(|_| row(if pass % 2 == 0 { 80.0 } else { 0.0 }, y, 5.0));
        }
        let names = ["x.position_mm", "y.position_mm", "spindle.load_percent", "spindle.speed_rpm"];
        let columns = names.iter().zip(columns).map(|(name, values)| Column::new(name, values)).collect();
        Recording::from_columns("cut.csv", time, columns).unwrap()
    }

    fn options() -> Options {
        let condition = TiltCondition { tool_id: 1, material_id: 2, speed_rpm: 2000.0, feed_mm_min: 300.0 };
        let signal = GIB_TILT_DC_LOAD;
        Options { condition, signal, pole_pairs: 0, entry_mm: 2.0, tolerance: 0.05, flag: false }
    }

    #[test]
    fn taught_from_cuts_and_measured_from_another() {
        let mut table = TiltTable { condition: options().condition, signal: GIB_TILT_DC_LOAD, ..TiltTable::default() };
        for i in 1..=8 {
            let depth = 0.5 * f64::from(i);
            let cut = taught(&recorded(|_, _| depth, u64::from(i as u32)), &options()).unwrap();
            assert!((cut.load - (30.0 + 8.0 * depth.sqrt())).abs() < 0.02, "{cut:?}");
            table.add(depth, cut.load, cut.load_std).unwrap();
        }
        let tilt = measured(&recorded(|x, y| 2.0 + 0.01 * x - 0.02 * y, 99), &options(), &table).unwrap();
        let truth = [-0.02f64.atan().to_degrees(), -0.01f64.atan().to_degrees()];
        assert!((tilt.about_x_deg - truth[0]).abs() < 0.05 * truth[0].abs(), "{tilt:?}");
        assert!((tilt.about_y_deg - truth[1]).abs() < 0.05 * truth[1].abs(), "{tilt:?}");
        assert!(tilt.uncertainty_deg < 0.1 && tilt.blocks > 300, "{tilt:?}");
        // Another speed than the table's, or another feed than was cut.
        let other = |speed_rpm, feed_mm_min| {
            let condition = TiltCondition { speed_rpm, feed_mm_min, ..options().condition };
            measured(&recorded(|_, _| 2.0, 5), &Options { condition, ..options() }, &table)
        };
        assert!(matches!(other(2500.0, 300.0), Err(Error::Refused(f)) if f.field == "condition.speed_rpm\0"));
        let said = other(2000.0, 200.0).unwrap_err().to_string();
        assert!(said.contains("condition"), "{said}");
    }

    #[test]
    fn what_is_missing_is_named() {
        let mut recording = recorded(|_, _| 2.0, 3);
        recording.columns.retain(|column| !column.name.starts_with("spindle.speed"));
        assert!(taught(&recording, &options()).unwrap_err().to_string().contains("spindle.speed_rpm"));
        recording.columns.retain(|column| column.name.starts_with("spindle"));
        assert_eq!(signal_of(&recording).unwrap(), GIB_TILT_DC_LOAD);
        recording.columns.push(Column::new("spindle.speed_rpm", vec![2000.0; recording.rows()]));
        assert!(taught(&recording, &options()).unwrap_err().to_string().contains("x.position"));
        recording.columns.clear();
        assert!(signal_of(&recording).unwrap_err().to_string().contains("spindle.load_percent"));
    }
}
