//! What a recording holds and what it suffices for.

use serde::Serialize;

use super::motion::Motion;
use super::statistics::{grid, hold_rows, white_noise};
use crate::recording::{Column, Recording, Signal, Unit};

/// A column in numbers, in the column's unit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ColumnFacts {
    /// Header name.
    pub name: String,
    /// Unit suffix of the header; `None` outside the format.
    pub unit: Option<&'static str>,
    /// Smallest and largest value; `None` when no value is finite.
    pub min: Option<f64>,
    /// See `min`.
    pub max: Option<f64>,
    /// Standard deviation of white noise on the signal.
    pub noise: Option<f64>,
    /// Step all values are multiples of; `None` when there is none.
    pub grid: Option<f64>,
    /// Rows for which the moving signal keeps each value.
    pub hold_rows: usize,
    /// Cells that are empty or not finite.
    pub missing: usize,
}

/// How a position moved, in its unit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ChannelMotion {
    /// Axis letter or `spindle`.
    pub channel: String,
    /// The column the motion was read from.
    pub column: String,
    /// Unit suffix of that column.
    pub unit: &'static str,
    /// The motion.
    #[serde(flatten)]
    pub motion: Motion,
}

/// Whether the recording serves one analysis of one channel.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Suitability {
    /// Axis letter or `spindle`.
    pub channel: String,
    /// The analysis.
    pub analysis: &'static str,
    /// True when everything it needs is there.
    pub sufficient: bool,
    /// What is missing or too little; empty when sufficient.
    pub missing: Vec<String>,
}

/// Everything `gib inspect` says.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Inspection {
    /// The file.
    pub file: String,
    /// Number of rows.
    pub rows: usize,
    /// Time of the first row, s.
    pub start_s: f64,
    /// Last time minus first, s.
    pub duration_s: f64,
    /// Sample period, s.
    pub period_s: f64,
    /// RMS jitter of the period, s.
    pub jitter_s: f64,
    /// Largest deviation from the period, s.
    pub jitter_max_s: f64,
    /// Gaps in time.
    pub gaps: usize,
    /// Every column of the file but the time.
    pub columns: Vec<ColumnFacts>,
    /// Every channel with a position.
    pub motions: Vec<ChannelMotion>,
    /// What each channel suffices for.
    pub analyses: Vec<Suitability>,
    /// What was found and worked around.
    pub issues: Vec<String>,
}

impl Inspection {
    /// Looks at a recording.
    #[must_use]
    pub fn of(recording: &Recording) -> Self {
        let mut sampling = recording.sampling;
        // Below this, jitter is the rounding of the time itself.
        let clock = |jitter_s: f64| if jitter_s < 1e-9 * sampling.period_s { 0.0 } else { jitter_s };
        (sampling.jitter_s, sampling.jitter_max_s) = (clock(sampling.jitter_s), clock(sampling.jitter_max_s));
        let motions: Vec<ChannelMotion> =
            recording.channels().into_iter().filter_map(|channel| motion(recording, channel)).collect();
        let analyses = recording
            .channels()
            .into_iter()
            .flat_map(|channel| suitability(recording, channel, motions.iter().find(|m| m.channel == channel)))
            .collect();
        Self {
            file: recording.file.clone(),
            rows: recording.rows(),
            start_s: sampling.start_s,
            duration_s: sampling.duration_s,
            period_s: sampling.period_s,
            jitter_s: sampling.jitter_s,
            jitter_max_s: sampling.jitter_max_s,
            gaps: sampling.gaps,
            columns: recording.columns.iter().map(facts).collect(),
            motions,
            analyses,
            issues: recording.issues.iter().map(ToString::to_string).collect(),
        }
    }
}

fn facts(column: &Column) -> ColumnFacts {
    let finite: Vec<f64> = column.values.iter().copied().filter(|value| value.is_finite()).collect();
    let grid = grid(&finite);
    ColumnFacts {
        name: column.name.clone(),
        unit: column.label.as_ref().map(|label| label.unit.suffix()),
        min: finite.iter().copied().reduce(f64::min),
        max: finite.iter().copied().reduce(f64::max),
        noise: white_noise(&finite),
        grid,
        hold_rows: hold_rows(&finite, grid.unwrap_or(0.0)),
        missing: column.values.len() - finite.len(),
    }
}

/// The motion of a channel, from the best position it has, in the unit of its column.
fn motion(recording: &Recording, channel: &str) -> Option<ChannelMotion> {
    let column = [Signal::Position, Signal::TablePosition, Signal::PositionCommand, Signal::Angle]
        .into_iter()
        .find_map(|signal| recording.get(channel, signal))?;
    let rows = || column.values.iter().zip(recording.time_s.iter()).filter(|(value, _)| value.is_finite());
    let position: Vec<f64> = rows().map(|(value, _)| *value).collect();
    let time_s: Vec<f64> = rows().map(|(_, time)| *time).collect();
    Some(ChannelMotion {
        channel: channel.to_owned(),
        column: column.name.clone(),
        unit: column.label.as_ref().map_or("", |label| label.unit.suffix()),
        motion: Motion::of(&time_s, &position),
    })
}

fn suitability(recording: &Recording, channel: &str, motion: Option<&ChannelMotion>) -> Vec<Suitability> {
    let has = |signal| recording.get(channel, signal).is_some();
    let need = |signal: Signal| {
        (!has(signal)).then(|| {
            let position = motion.filter(|_| signal.units().contains(&Unit::Mm)).map(|m| m.unit);
            let unit = position.or_else(|| signal.units().first().map(|unit| unit.suffix())).unwrap_or("");
            format!("column {channel}.{}_{unit}", signal.name())
        })
    };
    let effort = || {
        (!has(Signal::Torque) && !has(Signal::Force))
            .then(|| format!("column {channel}.torque_nm or {channel}.force_n"))
    };
    let reversals = |least: usize| {
        let found = motion.map_or(0, |m| m.motion.reversals);
        (found < least).then(|| format!("{least} reversals, {found} found"))
    };
    let one = |analysis, missing: Vec<Option<String>>| {
        let missing: Vec<String> = missing.into_iter().flatten().collect();
        Suitability { channel: channel.to_owned(), analysis, sufficient: missing.is_empty(), missing }
    };
    if has(Signal::Speed) || has(Signal::Angle) {
        let effort = [Signal::Torque, Signal::TorqueCommand, Signal::Current, Signal::Load];
        let torque = if effort.into_iter().any(has) { None } else { need(Signal::Torque) };
        return vec![one("inertia and friction of the spindle", vec![need(Signal::Speed), torque])];
    }
    if motion.is_none() {
        return Vec::new();
    }
    vec![
        one("lost motion from two positions", vec![need(Signal::Position), need(Signal::TablePosition), reversals(1)]),
        one("lost motion estimated from torque", vec![need(Signal::Position), effort(), reversals(1)]),
        one("diagnosis of torque", vec![need(Signal::Position), effort()]),
        one("diagnosis of the closed loop", vec![need(Signal::PositionCommand), need(Signal::Position)]),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn says_what_is_there_and_what_is_missing() {
        let rows = 4000;
        let time: Vec<f64> = (0..rows).map(|i| f64::from(i) * 1e-3).collect();
        let position = |i: i32| (10.0 * (f64::from(i) * 0.005).sin() / 1e-3).round() * 1e-3;
        let columns = vec![
            Column::new("x.position_mm", (0..rows).map(position).collect()),
            Column::new("x.torque_nm", (0..rows).map(|i| (f64::from(i) * 0.005).cos().signum()).collect()),
        ];
        let inspection = Inspection::of(&Recording::from_columns("r.csv", time, columns).unwrap());
        let motion = inspection.motions[0].motion;
        assert_eq!(motion.reversals, 6);
        assert!((motion.speed_max - 50.0).abs() < 0.5 && (motion.stroke - 20.0).abs() < 2e-3, "{motion:?}");
        assert!((inspection.columns[0].grid.unwrap() - 1e-3).abs() < 1e-9);
        let by_name = |name: &str| inspection.analyses.iter().find(|a| a.analysis == name).unwrap();
        assert!(by_name("lost motion estimated from torque").sufficient);
        assert_eq!(by_name("lost motion from two positions").missing, ["column x.table_position_mm"]);
    }
}
