//! Lost rows and empty cells of a recording, bridged: a row is put in for each that is lost, and filled in by those beside it.

use super::stretches::{LONGEST_BESIDE_S, Stretch, fill_between, fill_straight, holes, joined};
use crate::recording::{Column, Recording};
use std::ops::Range;
use std::sync::Arc;

/// Rows in a row whose position is filled in.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Filled {
    /// Which, all counted.
    pub rows: Range<usize>,
    /// Whether they stand in the recording, without a position; else they are not there at all.
    pub recorded: bool,
}

/// Where the rows of a recording go among those that are put in.
pub struct Bridges {
    /// Before which row of the recording how many are put in, in order.
    put_in: Vec<(usize, usize)>,
    /// Stretches of rows without a hole that is not bridged, all counted.
    pub runs: Vec<Range<usize>>,
    /// Rows that are filled in, in order.
    pub filled: Vec<Filled>,
    /// When all of them were taken, s; those of the recording where nothing is bridged.
    pub time_s: Arc<Vec<f64>>,
}

impl Bridges {
    /// Over the holes in a position.
    #[must_use]
    pub fn over(recording: &Recording, position: &Column) -> Self {
        let time_s = Arc::clone(&recording.time_s);
        let mut bridges = Self { put_in: Vec::new(), runs: Vec::new(), filled: Vec::new(), time_s };
        let mut dated = Vec::new();
        for stretch in joined(recording, position, recording.runs(&[position])) {
            let times = (stretch.runs.len() > 1).then(|| stretch.times(&recording.time_s, &position.values)).flatten();
            match times {
                Some(times) => dated.push((bridges.bridge(recording, &stretch), times)),
                // Rows that lie as they are stamped are on no grid, and nothing reaches across a hole.
                None => stretch.runs.iter().for_each(|(_, run)| {
                    let before = bridges.count();
                    bridges.runs.push(run.start + before..run.end + before);
                }),
            }
        }
        if !bridges.filled.is_empty() {
            let mut time_s = recording.time_s.to_vec();
            bridges.make_room(&mut time_s);
            for (runs, times) in dated {
                let all = runs[0].start..runs[runs.len() - 1].end;
                time_s[all.clone()].fill(f64::NAN);
                runs.into_iter().flatten().zip(times).for_each(|(row, t)| time_s[row] = t);
                fill_straight(&mut time_s[all]);
            }
            bridges.time_s = time_s.into();
        }
        bridges
    }

    /// Rows that are put in so far.
    fn count(&self) -> usize {
        self.put_in.iter().map(|(_, count)| count).sum()
    }

    /// Makes one run of a stretch; where its whole runs go.
    fn bridge(&mut self, recording: &Recording, stretch: &Stretch) -> Vec<Range<usize>> {
        let mut before = self.count();
        let mut whole: Vec<Range<usize>> = Vec::with_capacity(stretch.runs.len());
        let mut row = stretch.runs[0].1.start;
        for (_, run) in &stretch.runs {
            let from = recording.holes.partition_point(|hole| hole.row < row);
            let lost = recording.holes[from..].iter().take_while(|hole| hole.row <= run.start);
            for hole in lost.filter(|_| !whole.is_empty()) {
                self.fill(row + before..hole.row + before, true);
                self.put_in.push((hole.row, hole.missing));
                self.fill(hole.row + before..hole.row + before + hole.missing, false);
                before += hole.missing;
                row = hole.row;
            }
            self.fill(row + before..run.start + before, true);
            whole.push(run.start + before..run.end + before);
            row = run.end;
        }
        self.runs.push(whole[0].start..row + before);
        whole
    }

    fn fill(&mut self, rows: Range<usize>, recorded: bool) {
        if !rows.is_empty() {
            self.filled.push(Filled { rows, recorded });
        }
    }

    /// Makes room in a column of the recording for the rows that are put in.
    pub fn make_room(&self, values: &mut Vec<f64>) {
        let mut end = values.len();
        let mut to = end + self.count();
        values.reserve_exact(to - end);
        values.resize(to, f64::NAN);
        for &(row, count) in self.put_in.iter().rev() {
            let moved = to - (end - row);
            values.copy_within(row..end, moved);
            values[moved - count..moved].fill(f64::NAN);
            (end, to) = (row, moved - count);
        }
    }

    /// Fills in the position, the command where it was not recorded, and a table that goes with the motor.
    pub fn fill_in(
        &self,
        position: &mut [f64],
        command: Option<&mut Vec<f64>>,
        table: Option<&mut Vec<f64>>,
        period_s: f64,
    ) {
        let mut open: Vec<Range<usize>> = Vec::new();
        for Filled { rows, .. } in &self.filled {
            match open.last_mut() {
                Some(last) if last.end == rows.start => last.end = rows.end,
                _ => open.push(rows.clone()),
            }
        }
        fill_between(position, &open, 0.0);
        if let Some(command) = command {
            let lost = self.filled.iter().filter(|filled| !filled.recorded).map(|filled| filled.rows.clone());
            fill_between(command, &lost.collect::<Vec<_>>(), 0.0);
        }
        let longest = (LONGEST_BESIDE_S / period_s) as usize;
        if let Some(table) = table {
            for run in &self.runs {
                for hole in holes(&table[run.clone()]).into_iter().filter(|hole| hole.len() <= longest) {
                    if hole.start == 0 || hole.end == run.len() {
                        continue;
                    }
                    let rows = run.start + hole.start..run.start + hole.end;
                    let apart = |row: usize| table[row] - position[row];
                    let (first, last) = (apart(rows.start - 1), apart(rows.end));
                    let step = (last - first) / (rows.len() + 1) as f64;
                    for (k, row) in rows.enumerate() {
                        table[row] = position[row] + first + step * (k + 1) as f64;
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn swing(i: usize) -> f64 {
        5.0 * (3e-3 * i as f64).sin()
    }

    #[test]
    fn each_row_comes_to_its_place_and_what_is_missing_is_filled_in() {
        // Lost alone, in groups that are and are not bridged, beside an empty cell, and before and after one.
        let lost = [100, 101, 700, 900, 901, 902, 903, 1200, 1201, 1400, 1402];
        let empty = [500, 699, 1401, 2000];
        let kept: Vec<usize> = (0..3000).filter(|i| !lost.contains(i)).collect();
        let time: Vec<f64> = kept.iter().map(|i| 1e-3 * *i as f64).collect();
        let of = |hole: &[usize]| kept.iter().map(|i| if hole.contains(i) { f64::NAN } else { swing(*i) }).collect();
        let columns = vec![Column::new("x.position_mm", of(&empty)), Column::new("x.table_position_mm", of(&[600]))];
        let recording = Recording::from_columns("run.csv", time, columns).unwrap();
        let bridges = Bridges::over(&recording, &recording.columns[0]);
        assert_eq!(bridges.runs, [0..900, 900..2996], "the group of four alone is a hole");
        // All rows but that group, in their places.
        let place = |row: usize| if row < 900 { row } else { row + 4 };
        assert_eq!(bridges.time_s.len(), 2996);
        for (row, t) in bridges.time_s.iter().enumerate() {
            assert!((t - 1e-3 * place(row) as f64).abs() < 1e-9, "{row}");
        }
        let filled: Vec<(usize, bool)> =
            bridges.filled.iter().flat_map(|f| f.rows.clone().map(|row| (place(row), f.recorded))).collect();
        let mut expected: Vec<(usize, bool)> =
            lost.iter().map(|i| (*i, false)).chain(empty.map(|i| (i, true))).collect();
        expected.retain(|(i, _)| !(900..904).contains(i));
        expected.sort_unstable();
        assert_eq!(filled, expected);
        let mut columns = recording.columns.into_iter().map(|column| column.values);
        let (mut position, mut table) = (columns.next().unwrap(), columns.next().unwrap());
        let mut command: Vec<f64> = kept.iter().map(|i| swing(*i)).collect();
        [&mut position, &mut table, &mut command].into_iter().for_each(|column| bridges.make_room(column));
        bridges.fill_in(&mut position, Some(&mut command), Some(&mut table), 1e-3);
        for (row, values) in position.iter().zip(&table).zip(&command).enumerate() {
            let ((x, table), command) = values;
            let all_near = [x, table, command].into_iter().all(|value| (value - swing(place(row))).abs() < 1e-9);
            assert!(all_near, "{row}: {values:?}");
        }
    }

    #[test]
    fn a_whole_recording_is_left_as_it_is() {
        let time: Vec<f64> = (0..100).map(|i| 1e-3 * f64::from(i)).collect();
        let position = Column::new("x.position_mm", (0..100).map(swing).collect());
        let recording = Recording::from_columns("run.csv", time, vec![position]).unwrap();
        let bridges = Bridges::over(&recording, &recording.columns[0]);
        assert!(Arc::ptr_eq(&bridges.time_s, &recording.time_s) && bridges.filled.is_empty());
        assert_eq!(bridges.runs, [0..100]);
    }
}
