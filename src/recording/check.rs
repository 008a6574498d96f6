//! Checks a recording's columns once, right after reading: refuses what cannot be used, repairs what can be and says so.

use std::fmt;

use super::{Column, Hole, Name, Recording, RecordingError, Sampling, Signal, Unit, file_row};

/// What kind of irregularity was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum IssueKind {
    /// Rows repeat a time stamp; the first of each is kept.
    RepeatedTime,
    /// Rows are missing.
    Gap,
    /// The time step varies by more than 5 %.
    IrregularSampling,
    /// Cells are empty, NaN or infinite.
    NotFinite,
    /// A counter or angle wrapped; the column has been made continuous.
    Wrap,
    /// A position jumps by an amount no motion explains and no known wrap either.
    Jump,
    /// Single rows stand far off both neighbours.
    Outlier,
    /// Values are far beyond what the machine can do.
    Implausible,
    /// A signal of the format comes in a unit it cannot have; the column is ignored.
    WrongUnit,
    /// A column outside the format; it is ignored.
    UnknownColumn,
}

/// Something found in a recording and worked around.
#[derive(Debug, Clone, PartialEq)]
pub struct Issue {
    /// What kind of thing.
    pub kind: IssueKind,
    /// First row of the file concerned (1 is the header), where there is one.
    pub row: Option<usize>,
    /// Column concerned, where there is one.
    pub column: Option<String>,
    /// How often it happens.
    pub count: usize,
    /// What was found and what gib does about it.
    pub message: String,
}

impl fmt::Display for Issue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(column) = &self.column {
            write!(f, "{column}: ")?;
        }
        write!(f, "{}", self.message)?;
        match self.row {
            Some(row) if self.count > 1 => write!(f, " ({} times, first at row {row})", self.count),
            Some(row) => write!(f, " (row {row})"),
            None => Ok(()),
        }
    }
}

/// Checks and repairs; see the module.
pub(super) fn checked(file: &str, mut time_s: Vec<f64>, mut columns: Vec<Column>) -> Result<Recording, RecordingError> {
    same_length(file, &time_s, &columns)?;
    distinct(file, &columns)?;
    ordered(file, &time_s)?;
    let mut issues = Vec::new();
    let mut repeats = Vec::new();
    issues.extend(drop_repeats(file, &mut time_s, &mut columns, &mut repeats)?);
    if time_s.len() < 2 {
        let found = match (time_s.is_empty(), issues.is_empty()) {
            (true, _) => "no rows of data; expected at least two",
            (false, true) => "only one row of data; expected at least two",
            (false, false) => "the same time in all its rows; expected times that rise",
        };
        return Err(RecordingError::new(file, format!("has {found}")));
    }
    let (sampling, holes) = Sampling::of(&time_s);
    issues.extend(timing(&time_s, &sampling, &holes));
    for column in &mut columns {
        issues.extend(name(column));
        issues.extend(not_finite(column));
        issues.extend(spikes(column));
        if column.label.as_ref().is_some_and(|label| label.signal.is_measured_position()) {
            issues.extend(breaks(column));
        }
    }
    Ok(Recording { file: file.to_owned(), time_s: time_s.into(), columns, repeats, sampling, holes, issues })
}

fn same_length(file: &str, time_s: &[f64], columns: &[Column]) -> Result<(), RecordingError> {
    match columns.iter().find(|column| column.values.len() != time_s.len()) {
        None => Ok(()),
        Some(column) => Err(RecordingError::new(
            file,
            format!("has {} values; expected {}, as many as time_s", column.values.len(), time_s.len()),
        )
        .in_column(&column.name)),
    }
}

fn distinct(file: &str, columns: &[Column]) -> Result<(), RecordingError> {
    for (i, column) in columns.iter().enumerate() {
        let same_meaning = |other: &&Column| match (&other.label, &column.label) {
            (Some(a), Some(b)) => a.channel == b.channel && a.signal == b.signal,
            _ => false,
        };
        if columns[..i].iter().any(|other| other.name == column.name) {
            return Err(
                RecordingError::new(file, format!("the column {} stands in the header twice", column.name)).at_row(1)
            );
        }
        if let Some(other) = columns[..i].iter().find(same_meaning) {
            let message = format!("{} and {} are the same signal; keep one of them", other.name, column.name);
            return Err(RecordingError::new(file, message).at_row(1));
        }
    }
    Ok(())
}

fn ordered(file: &str, time_s: &[f64]) -> Result<(), RecordingError> {
    let at =
        |row: usize, message: String| Err(RecordingError::new(file, message).at_row(file_row(row)).in_column("time_s"));
    if let Some(row) = time_s.iter().position(|t| !t.is_finite()) {
        return at(row, "is empty or not a finite number; every row needs its time".into());
    }
    match time_s.windows(2).position(|pair| pair[1] < pair[0]) {
        None => Ok(()),
        Some(row) => at(
            row + 1,
            format!("runs backward, from {} to {} s; rows must be in time order", time_s[row], time_s[row + 1]),
        ),
    }
}

/// Keeps the first row of each time stamp. Few repeats are a recorder's stutter; many, with different values, mean that the
/// time column is too coarse to say when anything happened.
fn drop_repeats(
    file: &str,
    time_s: &mut Vec<f64>,
    columns: &mut [Column],
    after: &mut Vec<usize>,
) -> Result<Option<Issue>, RecordingError> {
    let repeats: Vec<usize> = (1..time_s.len()).filter(|&row| time_s[row] == time_s[row - 1]).collect();
    let Some(&first) = repeats.first() else { return Ok(None) };
    let differs =
        |&&row: &&usize| columns.iter().any(|column| column.values[row].to_bits() != column.values[row - 1].to_bits());
    let different = repeats.iter().filter(differs).count();
    if different > 10.max(time_s.len() / 100) {
        let message = format!(
            "repeats in {different} of {} rows that differ in their values: its resolution is too coarse; write more decimals",
            time_s.len()
        );
        return Err(RecordingError::new(file, message).at_row(file_row(first)).in_column("time_s"));
    }
    let keep: Vec<bool> = (0..time_s.len()).map(|row| repeats.binary_search(&row).is_err()).collect();
    let retain = |values: &mut Vec<f64>| {
        let mut flags = keep.iter();
        values.retain(|_| *flags.next().unwrap_or(&true));
    };
    *after = repeats.iter().enumerate().map(|(before, row)| row - before - 1).collect();
    retain(time_s);
    columns.iter_mut().for_each(|column| retain(&mut column.values));
    Ok(Some(Issue {
        kind: IssueKind::RepeatedTime,
        row: Some(file_row(first)),
        column: Some("time_s".into()),
        count: repeats.len(),
        message: format!("repeats a time stamp, with different values in {different}; the first row of each is kept"),
    }))
}

fn timing(time_s: &[f64], sampling: &Sampling, holes: &[Hole]) -> Vec<Issue> {
    let mut issues = Vec::new();
    if let Some(&Hole { row: first, missing }) = holes.first() {
        let by_time = (time_s[first] - time_s[first - 1]) / sampling.period_s - 1.0;
        let missing = if missing > 0 { missing as f64 } else { by_time };
        issues.push(Issue {
            kind: IssueKind::Gap,
            row: Some(file_row(first)),
            column: Some("time_s".into()),
            count: sampling.gaps,
            message: format!("rows are missing: {missing:.0} of them before {} s", time_s[first]),
        });
    }
    if !sampling.regular {
        issues.push(Issue {
            kind: IssueKind::IrregularSampling,
            row: None,
            column: Some("time_s".into()),
            count: 1,
            message: format!(
                "the sampling is irregular: period {:.6} ms, jitter {:.6} ms RMS, {:.6} ms at most",
                1e3 * sampling.period_s,
                1e3 * sampling.jitter_s,
                1e3 * sampling.jitter_max_s
            ),
        });
    }
    issues
}

fn name(column: &Column) -> Option<Issue> {
    let issue =
        |kind, message| Some(Issue { kind, row: Some(1), column: Some(column.name.clone()), count: 1, message });
    match Name::parse(&column.name) {
        Name::Known(_) => None,
        Name::Unknown => {
            issue(IssueKind::UnknownColumn, "is not a column of the format; it is kept and ignored".into())
        }
        Name::WrongUnit { signal, unit } => {
            let units: Vec<&str> = signal.units().iter().map(|unit| unit.suffix()).collect();
            let found = if unit.is_empty() { "no unit".to_owned() } else { format!("the unit {unit:?}") };
            let message =
                format!("has {found}; {} comes in {}; the column is ignored", signal.name(), units.join(", "));
            issue(IssueKind::WrongUnit, message)
        }
    }
}

fn not_finite(column: &mut Column) -> Option<Issue> {
    let ignored = column.label.is_none();
    let mut count = 0;
    let mut first = None;
    for (row, value) in column.values.iter_mut().enumerate() {
        if !value.is_finite() {
            *value = f64::NAN;
            count += 1;
            first = first.or(Some(file_row(row)));
        }
    }
    (count > 0 && !ignored).then(|| Issue {
        kind: IssueKind::NotFinite,
        row: first,
        column: Some(column.name.clone()),
        count,
        message: "is empty or not a finite number; such rows are left out".into(),
    })
}

/// A torque that is so many times larger than in nearly all rows, and than in the rows beside it, is none.
const SPIKE: f64 = 100.0;
/// Values that tell how large a torque usually is.
const ENOUGH: usize = 100_000;

/// Leaves out single rows in which a torque or force is out of all proportion: a cell that was spoilt on its way into the file.
fn spikes(column: &mut Column) -> Option<Issue> {
    let signal = column.label.as_ref()?.signal;
    if !matches!(signal, Signal::Torque | Signal::Force) || column.values.len() < 16 {
        return None;
    }
    let hop = column.values.len() / ENOUGH + 1;
    let mut sizes: Vec<f64> = column.values.iter().step_by(hop).map(|v| v.abs()).filter(|v| v.is_finite()).collect();
    let most = sizes.len() * 99 / 100;
    if sizes.is_empty() {
        return None;
    }
    let usual = *sizes.select_nth_unstable_by(most, f64::total_cmp).1;
    let size = |row: usize| column.values.get(row).map_or(0.0, |v| v.abs());
    let is_spike =
        |row: &usize| usual > 0.0 && size(*row) > SPIKE * usual.max(size(row.wrapping_sub(1))).max(size(row + 1));
    let spikes: Vec<usize> = (0..column.values.len()).filter(is_spike).collect();
    let &row = spikes.first()?;
    let message = format!("is {}, far beyond all other rows; the row is left out", shown(column.values[row]));
    spikes.iter().for_each(|row| column.values[*row] = f64::NAN);
    Some(issue_at(column, IssueKind::Outlier, row, spikes.len(), message))
}

/// A number that may be of any size.
fn shown(value: f64) -> String {
    if (1e-3..1e9).contains(&value.abs()) { format!("{value}") } else { format!("{value:e}") }
}

/// Finds jumps and outliers of a measured position. A mass cannot jump: a step many times larger than both its neighbours is
/// the counter's doing. Jumps of a full turn, or of one power of two of counts, are undone; others break the recording.
fn breaks(column: &mut Column) -> Vec<Issue> {
    let values = &column.values;
    let mut steps: Vec<f64> =
        values.windows(2).map(|pair| (pair[1] - pair[0]).abs()).filter(|step| step.is_finite()).collect();
    if steps.len() < 16 {
        return Vec::new();
    }
    let at = steps.len() * 99 / 100;
    let usual = *steps.select_nth_unstable_by(at, f64::total_cmp).1;
    let (low, high) =
        values.iter().filter(|v| v.is_finite()).fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(*v), h.max(*v)));
    let range = high - low;

    let step = |row: usize| if row == 0 || row >= values.len() { 0.0 } else { values[row] - values[row - 1] };
    let around = |row: usize, next: usize| step(row - 1).abs().max(step(next).abs());
    let turn = full_turn(column, range);
    let mut jumps = Vec::new();
    let mut outliers = Vec::new();
    for row in 1..values.len() {
        let size = step(row).abs();
        let wraps =
            turn.is_some_and(|turn| size > 0.5 * turn && turn - size <= 3.0 * around(row, row + 1).max(1e-3 * turn));
        let sudden = size > 20.0 * around(row, row + 1) && size > 20.0 * usual && size > 0.4 * range;
        let returns =
            size > 20.0 * around(row, row + 2) && size > 20.0 * usual && (step(row) + step(row + 1)).abs() < 0.1 * size;
        if returns {
            outliers.push(row);
        } else if (wraps || sudden) && outliers.last() != Some(&(row - 1)) {
            jumps.push((row, step(row)));
        }
    }
    let modulus = turn.filter(|_| !jumps.is_empty()).or_else(|| counter_modulus(&jumps, smallest_step(values)));
    let mut issues = Vec::new();
    if let (Some(modulus), Some(first)) = (modulus, jumps.first()) {
        issues.push(issue_at(
            column,
            IssueKind::Wrap,
            first.0,
            jumps.len(),
            format!("wraps by {modulus}; it has been made continuous"),
        ));
        unwrap(&mut column.values, &jumps, modulus);
        jumps.clear();
    } else if let Some(&(row, by)) = jumps.first() {
        issues.push(issue_at(
            column,
            IssueKind::Jump,
            row,
            jumps.len(),
            format!("jumps by {by:.6}, which no motion explains; no analysis reaches across it"),
        ));
    }
    if let Some(&row) = outliers.first() {
        issues.push(issue_at(
            column,
            IssueKind::Outlier,
            row,
            outliers.len(),
            "stands far off both neighbours; the row is left out".into(),
        ));
    }
    column.breaks = jumps.iter().map(|jump| jump.0).collect();
    outliers.iter().for_each(|row| column.values[*row] = f64::NAN);
    issues
}

fn issue_at(column: &Column, kind: IssueKind, row: usize, count: usize, message: String) -> Issue {
    Issue { kind, row: Some(file_row(row)), column: Some(column.name.clone()), count, message }
}

/// A full turn in the column's unit, when it is an angle that stays within one turn.
fn full_turn(column: &Column, range: f64) -> Option<f64> {
    let turn = match column.label.as_ref()?.unit {
        Unit::Deg => 360.0,
        Unit::Rad => std::f64::consts::TAU,
        _ => return None,
    };
    (range <= turn * 1.001).then_some(turn)
}

/// The modulus that explains all jumps: one size, a power of two of counts (8 bits at least).
fn counter_modulus(jumps: &[(usize, f64)], count: f64) -> Option<f64> {
    let size = jumps.iter().map(|jump| jump.1.abs()).fold(0.0, f64::max);
    let one_size = jumps.iter().all(|jump| jump.1.abs() > 0.995 * size);
    if jumps.is_empty() || !one_size || count <= 0.0 {
        return None;
    }
    let bits = (size / count).log2().round();
    let modulus = count * bits.exp2();
    ((size / modulus - 1.0).abs() < 2e-3 && bits >= 8.0).then_some(modulus)
}

/// The smallest step between two rows: the count of an encoder, where the recording resolves it.
fn smallest_step(values: &[f64]) -> f64 {
    let span = values.iter().filter(|v| v.is_finite()).fold(0.0f64, |most, v| most.max(v.abs()));
    let steps = values.windows(2).map(|pair| (pair[1] - pair[0]).abs());
    steps.filter(|step| *step > 1e-9 * span).fold(f64::INFINITY, f64::min)
}

fn unwrap(values: &mut [f64], jumps: &[(usize, f64)], modulus: f64) {
    let mut offset = 0.0;
    let mut jumps = jumps.iter().peekable();
    for (row, value) in values.iter_mut().enumerate() {
        if let Some((_, by)) = jumps.next_if(|jump| jump.0 == row) {
            offset -= modulus * by.signum();
        }
        *value += offset;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn recording(name: &str, values: Vec<f64>) -> Recording {
        let time = (0..values.len()).map(|i| i as f64 * 1e-3).collect();
        Recording::from_columns("r.csv", time, vec![Column::new(name, values)]).unwrap()
    }

    fn kinds(recording: &Recording) -> Vec<IssueKind> {
        recording.issues.iter().map(|issue| issue.kind).collect()
    }

    fn largest_step(values: &[f64]) -> f64 {
        values.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn a_spindle_angle_that_wraps_becomes_continuous_both_ways() {
        for (name, turn) in [("spindle.angle_deg", 360.0), ("spindle.angle_rad", std::f64::consts::TAU)] {
            // Up to 0.1 turn a row, forward then back.
            let turns = |i: i32| 0.1 * f64::from(if i < 500 { i } else { 1000 - i });
            let wrapped = recording(name, (0..1000).map(|i| turn * turns(i).rem_euclid(1.0)).collect());
            assert_eq!(kinds(&wrapped), [IssueKind::Wrap], "{name}");
            assert!(largest_step(&wrapped.columns[0].values) < 0.11 * turn, "{name}");
        }
    }

    #[test]
    fn a_sixteen_bit_counter_is_unwrapped_and_an_odd_jump_breaks_the_run() {
        let wave = |i: i32| (f64::from(i) * 3e-3).sin() * 50_000.0;
        let counter = |i: i32| (wave(i).round() as i32 as i16) as f64 * 1e-3;
        let wrapped = recording("x.position_mm", (0..5000).map(counter).collect());
        assert_eq!(kinds(&wrapped), [IssueKind::Wrap]);
        assert!(largest_step(&wrapped.columns[0].values) < 0.16);

        let odd = recording(
            "x.position_mm",
            (0..1000).map(|i| (0.001 * f64::from(i)) + if i > 600 { 31.4 } else { 0.0 }).collect(),
        );
        assert_eq!(kinds(&odd), [IssueKind::Jump]);
        assert_eq!(odd.runs(&[&odd.columns[0]]), [0..601, 601..1000]);
    }

    #[test]
    fn honest_motion_is_left_alone() {
        // A reversal, a standstill, a quantised creep and a coarse command step are no jumps.
        let creep =
            recording("x.position_mm", (0..4000).map(|i| (0.000_01 * f64::from(i) / 0.001).round() * 0.001).collect());
        assert_eq!(kinds(&creep), []);
        let start_stop =
            recording("x.position_mm", (0..2000).map(|i| f64::from((i - 1000).clamp(0, 300)) * 0.01).collect());
        assert_eq!(kinds(&start_stop), []);
        let command = recording("x.position_command_mm", (0..100).map(|i| if i < 50 { 0.0 } else { 10.0 }).collect());
        assert_eq!(kinds(&command), []);
    }

    #[test]
    fn an_outlier_and_a_missing_value_split_the_runs() {
        let mut values: Vec<f64> = (0..1000).map(|i| 0.01 * f64::from(i)).collect();
        values[300] = 500.0;
        values[700] = f64::NAN;
        let recording = recording("x.position_mm", values);
        assert_eq!(kinds(&recording), [IssueKind::NotFinite, IssueKind::Outlier]);
        let runs = recording.runs(&[&recording.columns[0]]);
        assert!(runs.iter().all(|run| !run.contains(&300) && !run.contains(&700)), "{runs:?}");
        assert_eq!(runs.iter().map(std::ops::Range::len).sum::<usize>(), 998);
        let refused = recording.need("x", crate::recording::Signal::Position, Unit::Mm).unwrap_err().to_string();
        assert!(refused.contains("row 302") && refused.contains("x.position_mm"), "{refused}");
    }

    #[test]
    fn a_spoilt_torque_is_left_out_and_a_sudden_one_is_not() {
        let sudden = |i: usize| if (300..310).contains(&i) { 40.0 } else { 0.05 * (i % 7) as f64 };
        let torque: Vec<f64> = (0..1000).map(sudden).collect();
        assert_eq!(kinds(&recording("x.torque_nm", torque.clone())), []);
        for spoilt in [5000.0, -1e300] {
            let mut torque = torque.clone();
            torque[700] = spoilt;
            let recording = recording("x.torque_nm", torque);
            let said = recording.issues[0].to_string();
            assert!(said.contains("row 702") && said.contains(&shown(spoilt)), "{said}");
            assert!(recording.issues.len() == 1 && recording.columns[0].values[700].is_nan());
        }
    }

    #[test]
    fn repeated_rows_are_dropped_and_a_coarse_clock_is_refused() {
        let mut time: Vec<f64> = (0..1000).map(|i| f64::from(i) * 1e-3).collect();
        time[500] = time[499];
        let values: Vec<f64> = (0..1000).map(f64::from).collect();
        let columns = vec![Column::new("x.position_mm", values.clone())];
        let recording = Recording::from_columns("r.csv", time, columns).unwrap();
        assert_eq!((recording.rows(), &recording.repeats[..]), (999, [499].as_slice()));
        assert_eq!(kinds(&recording)[0], IssueKind::RepeatedTime);

        let coarse = (0..1000).map(|i| (f64::from(i) * 0.25).floor() * 1e-3).collect();
        let refused = Recording::from_columns("r.csv", coarse, vec![Column::new("x.position_mm", values)]).unwrap_err();
        assert!(refused.to_string().contains("too coarse"), "{refused}");
    }

    #[test]
    fn a_wrong_unit_is_reported_and_the_need_for_it_says_what_is_there() {
        let recording = recording("x.position_inch", vec![0.0, 1.0]);
        assert_eq!(kinds(&recording), [IssueKind::WrongUnit]);
        let message = recording.column("x", crate::recording::Signal::Position).unwrap_err().to_string();
        assert!(message.contains("x.position_mm") && message.contains("x.position_inch"), "{message}");
    }
}
