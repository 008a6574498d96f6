//! Takes an axis's columns out of a recording: converted to the drive's units, in stretches of whole, equidistant rows.

use super::frame::Columns;
use crate::machine::Axis;
use crate::recording::{Recording, RecordingError, Signal, Unit};
use std::ops::Range;

/// Most rows that are worked on; of longer recordings, evenly spread stretches.
const MOST_ROWS: usize = 1_000_000;
/// Stretches that a longer recording is cut to.
const PIECES: usize = 50;

impl Columns {
    /// The columns of an axis.
    ///
    /// # Errors
    /// Position or torque (force) is missing or in a wrong unit.
    pub fn of(recording: &Recording, axis: &Axis) -> Result<Columns, RecordingError> {
        let load = if axis.drive.is_rotary() { Unit::Deg } else { Unit::Mm };
        let (torque_signal, torque_unit) =
            if axis.drive.is_linear() { (Signal::Force, Unit::N) } else { (Signal::Torque, Unit::Nm) };
        let convert = |signal: Signal, unit: Unit| {
            let column = recording.column(&axis.name, signal)?;
            column.to(unit).ok_or_else(|| {
                let message = format!("must be in {} or a unit that converts to it", unit.suffix());
                RecordingError::new(&recording.file, message).in_column(&column.name)
            })
        };
        let position = convert(Signal::Position, load)?;
        let torque = convert(torque_signal, torque_unit)?;
        let optional = |signal: Signal| recording.get(&axis.name, signal).map(|_| convert(signal, load)).transpose();
        let table = optional(Signal::TablePosition)?;
        let command = optional(Signal::PositionCommand)?;
        let mut whole =
            vec![recording.column(&axis.name, Signal::Position)?, recording.column(&axis.name, torque_signal)?];
        whole.extend(recording.get(&axis.name, Signal::TablePosition));
        let runs = spread(recording.runs(&whole));
        let period_s = recording.sampling.period_s;
        let mut out = Columns {
            time_s: Vec::new(),
            position: Vec::new(),
            torque: Vec::new(),
            command: command.as_ref().map(|_| Vec::new()),
            table: table.as_ref().map(|_| Vec::new()),
            stretches: Vec::new(),
            period_s,
        };
        for run in runs {
            let start = out.time_s.len();
            let times = &recording.time_s[run.clone()];
            let even = if recording.sampling.regular { None } else { Some(even_times(times, period_s)) };
            let take = |values: &[f64]| match &even {
                None => values[run.clone()].to_vec(),
                Some(wanted) => interpolate(times, &values[run.clone()], wanted),
            };
            out.position.extend(take(&position));
            out.torque.extend(take(&torque));
            if let (Some(to), Some(from)) = (&mut out.table, &table) {
                to.extend(take(from));
            }
            if let (Some(to), Some(from)) = (&mut out.command, &command) {
                to.extend(take(from));
            }
            out.time_s.extend(even.clone().unwrap_or_else(|| times.to_vec()));
            out.stretches.push(start..out.time_s.len());
        }
        Ok(out)
    }
}

/// All runs, or evenly spread pieces of them where they are too long together.
fn spread(runs: Vec<Range<usize>>) -> Vec<Range<usize>> {
    let total: usize = runs.iter().map(ExactSizeIterator::len).sum();
    if total <= MOST_ROWS {
        return runs;
    }
    let (piece, hop) = (MOST_ROWS / PIECES, total / PIECES);
    let mut out = Vec::new();
    for run in runs {
        let mut at = run.start;
        while at < run.end {
            out.push(at..(at + piece).min(run.end));
            at += hop;
        }
    }
    out
}

fn even_times(times: &[f64], period_s: f64) -> Vec<f64> {
    let (Some(first), Some(last)) = (times.first(), times.last()) else { return Vec::new() };
    let count = ((last - first) / period_s).floor() as usize + 1;
    (0..count).map(|i| first + i as f64 * period_s).collect()
}

fn interpolate(times: &[f64], values: &[f64], wanted: &[f64]) -> Vec<f64> {
    let mut row = 0;
    wanted
        .iter()
        .map(|&t| {
            while row + 2 < times.len() && times[row + 1] < t {
                row += 1;
            }
            let next = (row + 1).min(times.len() - 1);
            let span = times[next] - times[row];
            let share = if span > 0.0 { ((t - times[row]) / span).clamp(0.0, 1.0) } else { 0.0 };
            values[row] + share * (values[next] - values[row])
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_recordings_are_cut_to_evenly_spread_pieces() {
        let runs = spread(vec![0..14_400_000]);
        let total: usize = runs.iter().map(ExactSizeIterator::len).sum();
        assert!(total <= MOST_ROWS + MOST_ROWS / PIECES && total > MOST_ROWS * 9 / 10, "{total}");
        assert!(runs.first().is_some_and(|r| r.start == 0) && runs.last().is_some_and(|r| r.end > 14_000_000));
        assert_eq!(spread(vec![0..10, 20..30]), vec![0..10, 20..30]);
    }
}
