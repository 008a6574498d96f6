//! Takes an axis's columns out of a recording: converted to the drive's units, in stretches of whole, equidistant rows.

use super::frame::Columns;
use crate::analysis::statistics;
use crate::machine::Axis;
use crate::plant::observed::Observed;
use crate::plant::stamps::are_even;
use crate::plant::stretches::{Stretch, fill_between, fill_smooth, fill_straight, holes, joined, without_long_holes};
use crate::recording::{Column, Recording, RecordingError, Signal, Unit};
use std::ops::Range;

/// Most rows that are worked on; of longer recordings, evenly spread stretches.
const MOST_ROWS: usize = 480_000;
/// Stretches that a longer recording is cut to.
pub(super) const PIECES: usize = 48;
/// Rows are averaged until there are no more than this many a second: the friction, ripple and resonance of a machine tool's
/// axis lie well below half of it, and what is above it is the current loop's.
const ROWS_A_SECOND: f64 = 1000.0;

/// A column and the factor that brings it to the unit of the model.
struct Source<'a> {
    values: &'a [f64],
    factor: f64,
}

#[cfg(test)]
impl Columns {
    /// Rows every millisecond in one stretch, all of them known, by a position and a torque alone.
    pub fn every_millisecond(position: Vec<f64>, torque: Vec<f64>) -> Columns {
        Columns {
            time_s: (0..position.len()).map(|row| row as f64 * 1e-3).collect(),
            known: vec![true; position.len()],
            stretches: std::iter::once(0..position.len()).collect(),
            position,
            torque,
            command: None,
            table: None,
            torque_step: 0.0,
            position_grid: 0.0,
            table_grid: 0.0,
            period_s: 1e-3,
            recorded_period_s: 1e-3,
            left_out: 0,
        }
    }
}

impl Columns {
    /// The columns of an axis.
    ///
    /// # Errors
    /// Position or torque (force) is missing or in a wrong unit.
    pub fn of(recording: &Recording, axis: &Axis) -> Result<Columns, RecordingError> {
        let load = if axis.drive.is_rotary() { Unit::Deg } else { Unit::Mm };
        let (torque_signal, torque_unit) =
            if axis.drive.is_linear() { (Signal::Force, Unit::N) } else { (Signal::Torque, Unit::Nm) };
        let convert = |column: &'_ Column, unit: Unit| {
            let factor = column.label.as_ref().and_then(|label| label.unit.factor_to(unit));
            factor.ok_or_else(|| {
                let message = format!("must be in {} or a unit that converts to it", unit.suffix());
                RecordingError::new(&recording.file, message).in_column(&column.name)
            })
        };
        let source = |signal: Signal, unit: Unit| {
            let column = recording.column(&axis.name, signal)?;
            if !column.values.iter().any(|value| value.is_finite()) {
                let message = "holds no number in any row, and this analysis needs it";
                return Err(RecordingError::new(&recording.file, message).in_column(&column.name));
            }
            Ok::<_, RecordingError>(Source { values: &column.values, factor: convert(column, unit)? })
        };
        let held = |signal| {
            recording.get(&axis.name, signal).filter(|column| column.values.iter().any(|value| value.is_finite()))
        };
        let optional = |signal| held(signal).map(|_| source(signal, load)).transpose();
        let position = source(Signal::Position, load)?;
        let torque = source(torque_signal, torque_unit)?;
        let (table, command) = (optional(Signal::TablePosition)?, optional(Signal::PositionCommand)?);
        let mut beside = vec![recording.column(&axis.name, torque_signal)?];
        beside.extend(held(Signal::TablePosition));
        let encoder = recording.column(&axis.name, Signal::Position)?;
        let runs = without_long_holes(recording.runs(&[encoder]), &beside, recording.sampling.period_s);
        let rows: usize = runs.iter().map(ExactSizeIterator::len).sum();
        let runs = spread(runs);
        let period_s = recording.sampling.period_s;
        let judged: usize = runs.iter().map(ExactSizeIterator::len).sum();
        let mut out = Columns {
            time_s: Vec::with_capacity(judged),
            position: Vec::with_capacity(judged),
            torque: Vec::with_capacity(judged),
            command: command.as_ref().map(|_| Vec::with_capacity(judged)),
            table: table.as_ref().map(|_| Vec::with_capacity(judged)),
            known: Vec::with_capacity(judged),
            stretches: Vec::new(),
            torque_step: 0.0,
            position_grid: 0.0,
            table_grid: 0.0,
            period_s,
            recorded_period_s: period_s,
            left_out: rows - judged,
        };
        let mut take = |stretch: &Stretch, times: &[f64], on_grid: bool| {
            let start = out.time_s.len();
            let grid = if on_grid { None } else { Some(even_times(times, period_s)) };
            let (rows, places) = (stretch.rows().collect::<Vec<_>>(), stretch.places());
            let count = grid.as_ref().map_or_else(|| places.last().map_or(0, |last| last + 1), Vec::len);
            let take = |to: &mut Vec<f64>, from: &dyn Fn(usize) -> f64| match &grid {
                Some(wanted) => {
                    let values: Vec<f64> = rows.iter().map(|&row| from(row)).collect();
                    to.extend(interpolate(times, &values, wanted));
                }
                None => {
                    to.resize(start + count, f64::NAN);
                    rows.iter().zip(&places).for_each(|(row, place)| to[start + place] = from(*row));
                }
            };
            take(&mut out.position, &|row| position.values[row] * position.factor);
            take(&mut out.torque, &|row| torque.values[row] * torque.factor);
            if let (Some(to), Some(from)) = (&mut out.table, &table) {
                take(to, &|row| from.values[row] * from.factor);
            }
            if let (Some(to), Some(from)) = (&mut out.command, &command) {
                take(to, &|row| from.values[row] * from.factor);
            }
            match grid {
                Some(even) => out.time_s.extend(even),
                None => {
                    out.time_s.resize(start + count, f64::NAN);
                    times.iter().zip(&places).for_each(|(t, place)| out.time_s[start + place] = *t);
                    fill_straight(&mut out.time_s[start..]);
                }
            }
            out.stretches.push(start..out.time_s.len());
        };
        for stretch in joined(recording, encoder, runs) {
            let stamped = |stretch: &Stretch| stretch.rows().map(|row| recording.time_s[row]).collect::<Vec<_>>();
            match stretch.times(&recording.time_s, &encoder.values) {
                Some(times) => take(&stretch, &times, true),
                // Rows that lie as they are stamped are read off between them, and nothing reaches across a hole.
                None => stretch.alone().for_each(|run| {
                    let times = stamped(&run);
                    take(&run, &times, are_even(&times, 0.02));
                }),
            }
        }
        out.torque_step = undithered_step(&out.torque);
        out.position_grid = statistics::grid(&out.position).unwrap_or(0.0);
        out.table_grid = out.table.as_deref().and_then(statistics::grid).unwrap_or(0.0);
        out.fill_holes();
        Ok(out)
    }

    /// Fills in what is missing, and remembers where.
    fn fill_holes(&mut self) {
        let finite = |values: &[f64], row: usize| values[row].is_finite();
        let whole = |row: usize| {
            let table = self.table.as_deref().is_none_or(|table| finite(table, row));
            table && finite(&self.position, row) && finite(&self.torque, row)
        };
        self.known = (0..self.time_s.len()).map(whole).collect();
        if self.known.iter().all(|known| *known) {
            return;
        }
        let torque_grid = statistics::grid(&self.torque).unwrap_or(0.0);
        for s in self.stretches.clone() {
            if self.known[s.clone()].iter().all(|known| *known) {
                continue;
            }
            let apart = self.table.as_ref().map(|table| {
                let mut apart: Vec<f64> = s.clone().map(|row| table[row] - self.position[row]).collect();
                fill_straight(&mut apart);
                apart
            });
            if let Some(command) = &mut self.command {
                fill_between(&mut command[s.clone()], &holes(&self.position[s.clone()]), 0.0);
            }
            fill_smooth(&mut self.position[s.clone()], self.position_grid);
            fill_straight(&mut self.torque[s.clone()]);
            for (row, apart) in s.clone().zip(apart.into_iter().flatten()) {
                if let Some(table) = self.table.as_mut().filter(|table| !table[row].is_finite()) {
                    table[row] = on(self.position[row] + apart, self.table_grid);
                }
            }
            for row in s.filter(|row| !self.known[*row]) {
                self.torque[row] = on(self.torque[row], torque_grid);
            }
        }
    }

    /// The same columns as the simulation sees a recording; `None` where no stretch is long enough for a motion. Without the command
    /// where rows were left out: no loop can be replayed where what the axis did in between is not at hand.
    #[must_use]
    pub fn observed(&self) -> Option<Observed> {
        let mut copy = Columns::clone(self);
        let rows = copy.torque.iter_mut().zip(&self.known);
        rows.filter(|(_, known)| !**known).for_each(|(torque, _)| *torque = f64::NAN);
        let command = copy.command.filter(|_| self.left_out == 0);
        Observed::from_columns(copy.time_s, copy.position, copy.torque, command, copy.table, copy.stretches)
    }

    /// The first rows, with another position and torque and nothing beside them.
    #[must_use]
    pub fn with_motion(&self, position: Vec<f64>, torque: Vec<f64>) -> Columns {
        let rows = position.len();
        let within = |s: &Range<usize>| s.start.min(rows)..s.end.min(rows);
        Columns {
            time_s: self.time_s[..rows].to_vec(),
            known: self.known[..rows].to_vec(),
            stretches: self.stretches.iter().map(within).filter(|s| !s.is_empty()).collect(),
            position,
            torque,
            command: None,
            table: None,
            ..*self
        }
    }

    /// Of how many recorded rows one is the mean; its error is the mean of theirs.
    #[must_use]
    pub fn rows_in_one(&self) -> f64 {
        (self.period_s / self.recorded_period_s).round().max(1.0)
    }

    /// The columns without those of a table scale that repeats the encoder row by row: as little as a control without a scale
    /// says of it that writes its encoder twice.
    #[must_use]
    pub fn without_repeated_scale(mut self) -> Columns {
        self.table.take_if(|table| *table == self.position);
        self
    }

    /// The columns with so many rows averaged to one that no more than a thousand a second are left.
    #[must_use]
    pub fn thinned(self) -> Columns {
        let many = (1.0 / (ROWS_A_SECOND * self.period_s) + 0.01).floor() as usize;
        if many < 2 {
            return self;
        }
        let mut stretches = Vec::new();
        let mut end = 0;
        // The last piece of a long recording may be shorter than one mean.
        for s in self.stretches.iter().filter(|s| s.len() >= many) {
            stretches.push(end..end + s.len() / many);
            end += s.len() / many;
        }
        let mean = |values: &[f64]| -> Vec<f64> {
            let of = |s: &Range<usize>| {
                let whole = values[s.clone()].chunks_exact(many);
                // About the first value, so that a far position loses no digits.
                whole.map(|c| c[0] + c.iter().map(|v| v - c[0]).sum::<f64>() / many as f64).collect::<Vec<f64>>()
            };
            self.stretches.iter().flat_map(of).collect()
        };
        let whole = |s: &Range<usize>| {
            self.known[s.clone()].chunks_exact(many).map(|c| c.iter().all(|known| *known)).collect::<Vec<_>>()
        };
        Columns {
            known: self.stretches.iter().flat_map(whole).collect(),
            time_s: mean(&self.time_s),
            position: mean(&self.position),
            torque: mean(&self.torque),
            command: self.command.as_deref().map(mean),
            table: self.table.as_deref().map(mean),
            stretches,
            period_s: self.period_s * many as f64,
            ..self
        }
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

/// The grid of a column whose noise does not carry it over its steps; 0 where it does, or there is no grid.
fn undithered_step(values: &[f64]) -> f64 {
    let grid = statistics::grid(values).unwrap_or(0.0);
    let noise = statistics::white_noise(values).unwrap_or(0.0);
    // A mean of many readings is off by a hundredth of the step at most from noise of half a step on.
    if noise < 0.5 * grid { grid } else { 0.0 }
}

/// The nearest value on a grid, where there is one.
fn on(value: f64, grid: f64) -> f64 {
    if grid > 0.0 { (value / grid).round() * grid } else { value }
}

fn even_times(times: &[f64], period_s: f64) -> Vec<f64> {
    let (Some(first), Some(last)) = (times.first(), times.last()) else { return Vec::new() };
    let count = ((last - first) / period_s).floor() as usize + 1;
    (0..count).map(|i| first + i as f64 * period_s).collect()
}

fn interpolate<'a>(times: &'a [f64], values: &'a [f64], wanted: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
    let mut row = 0;
    wanted.iter().map(move |&t| {
        while row + 2 < times.len() && times[row + 1] < t {
            row += 1;
        }
        let next = (row + 1).min(times.len() - 1);
        let span = times[next] - times[row];
        let share = if span > 0.0 { ((t - times[row]) / span).clamp(0.0, 1.0) } else { 0.0 };
        values[row] + share * (values[next] - values[row])
    })
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

    #[test]
    fn a_grid_counts_where_no_noise_carries_the_torque_over_it() {
        // As printed: six decimals of a step that has more; slow, so that most rows stand on one step.
        let with_noise = |size: f64| -> Vec<f64> {
            let hashed = |i: usize| ((i * 7919 + 13) * i % 10_007) as f64 / 10_007.0 - 0.5;
            let torque = |i: usize| 3.0 * (i as f64 * 1e-3).sin() + size * hashed(i);
            (0..20_000).map(|i| ((torque(i) * 12.0).round() / 12.0 * 1e6).round() / 1e6).collect()
        };
        let step = undithered_step(&with_noise(0.0));
        assert!((step * 12.0 - 1.0).abs() < 1e-3, "{step}");
        assert_eq!(undithered_step(&with_noise(0.3)), 0.0);
    }

    #[test]
    fn no_loop_is_replayed_across_rows_that_were_left_out() {
        let rows: Vec<f64> = (0..4000).map(|i| f64::from(i) * 1e-3).collect();
        let whole = Columns {
            command: Some(rows.clone()),
            stretches: vec![0..2000, 2000..4000],
            ..Columns::every_millisecond(rows.clone(), rows)
        };
        assert!(whole.observed().unwrap().command.is_some());
        assert!(Columns { left_out: 1, ..whole }.observed().unwrap().command.is_none());
    }

    #[test]
    fn fast_rows_are_averaged_in_time_and_value_alike() {
        let rows: Vec<f64> = (0..1003).map(f64::from).collect();
        let columns = Columns {
            time_s: rows.iter().map(|i| i * 2.5e-4).collect(),
            position: rows.iter().map(|i| 1e3 + i * 0.5).collect(),
            torque: rows.clone(),
            known: (0..1003).map(|row| row != 402).collect(),
            command: None,
            table: None,
            stretches: vec![0..402, 402..1000, 1000..1003],
            torque_step: 0.0,
            position_grid: 0.0,
            table_grid: 0.0,
            period_s: 2.5e-4,
            recorded_period_s: 2.5e-4,
            left_out: 0,
        };
        let thin = columns.thinned();
        assert_eq!((thin.stretches.clone(), thin.period_s, thin.torque.len()), (vec![0..100, 100..249], 1e-3, 249));
        assert_eq!(thin.known.iter().position(|known| !known), Some(100));
        for ((t, x), torque) in thin.time_s.iter().zip(&thin.position).zip(&thin.torque) {
            assert!((t / 2.5e-4 - torque).abs() < 1e-9 && ((x - 1e3) / 0.5 - torque).abs() < 1e-9);
        }
    }
}
