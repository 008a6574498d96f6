//! Rows that lie on one even grid, with the holes that may be bridged: a lost row, an empty cell.
//!
//! Behind a motor that moves as measured a table is simulated, and friction builds up over a way; both go on where a row is
//! missing, as the motion does. So a hole of few rows is filled in by what lies beside it, and only the rows near to it are not
//! judged.

use super::stamps::times_on_a_grid;
use crate::recording::{Column, Recording};
use std::ops::Range;

/// The longest hole in a motion that is bridged, rows.
pub const LONGEST_IN_MOTION: usize = 3;
/// The same in another column while the motion is known, s.
pub const LONGEST_BESIDE_S: f64 = 0.1;

/// Rows of a recording in one stretch, without a hole between them that is not bridged.
#[derive(Debug, PartialEq)]
pub struct Stretch {
    /// Whole runs of rows, with how many are missing before each.
    pub runs: Vec<(usize, Range<usize>)>,
}

impl Stretch {
    fn end(&self) -> usize {
        self.runs.last().map_or(0, |(_, run)| run.end)
    }

    /// Rows of the recording, in order.
    pub fn rows(&self) -> impl Iterator<Item = usize> {
        self.runs.iter().flat_map(|(_, run)| run.clone())
    }

    /// The place of each row on the grid, from 0.
    #[must_use]
    pub fn places(&self) -> Vec<usize> {
        let mut next = 0;
        let mut places = Vec::new();
        for (missing, run) in &self.runs {
            next += missing;
            places.extend(next..next + run.len());
            next += run.len();
        }
        places
    }

    /// When its rows were taken; `None` where they lie on no grid.
    #[must_use]
    pub fn times(&self, time_s: &[f64], position: &[f64]) -> Option<Vec<f64>> {
        if let [(_, run)] = self.runs.as_slice() {
            let times = times_on_a_grid(&time_s[run.clone()], |row| row, &position[run.clone()]);
            return times.map(|times| times.into_owned());
        }
        let (places, of) = (self.places(), |values: &[f64]| self.rows().map(|row| values[row]).collect::<Vec<_>>());
        times_on_a_grid(&of(time_s), |row| places[row], &of(position)).map(|times| times.into_owned())
    }

    /// Its runs, each for itself.
    pub fn alone(self) -> impl Iterator<Item = Self> {
        self.runs.into_iter().map(|(_, run)| Self { runs: vec![(0, run)] })
    }
}

/// Runs of rows with a position, joined where so few are missing between them that the motion is known all the same.
#[must_use]
pub fn joined(recording: &Recording, position: &Column, runs: Vec<Range<usize>>) -> Vec<Stretch> {
    let missing_between = |before: usize, after: usize| -> Option<usize> {
        let empty = |row: usize| !position.values[row].is_finite();
        let jumps = position.breaks.iter().any(|row| (before..=after).contains(row));
        if after - before > LONGEST_IN_MOTION || jumps || !(before..after).all(empty) {
            return None;
        }
        let from = recording.holes.partition_point(|hole| hole.row < before);
        let holes = recording.holes[from..].iter().take_while(|hole| hole.row <= after);
        let lost = holes.map(|hole| (hole.missing > 0).then_some(hole.missing)).sum::<Option<usize>>()?;
        let missing = after - before + lost;
        (1..=LONGEST_IN_MOTION).contains(&missing).then_some(missing)
    };
    let mut out: Vec<Stretch> = Vec::new();
    for run in runs {
        match out.last_mut().and_then(|last| Some((missing_between(last.end(), run.start)?, last))) {
            Some((missing, last)) => last.runs.push((missing, run)),
            None => out.push(Stretch { runs: vec![(0, run)] }),
        }
    }
    out
}

/// Runs cut where a column that is needed beside the motion is empty for long.
#[must_use]
pub fn without_long_holes(runs: Vec<Range<usize>>, beside: &[&Column], period_s: f64) -> Vec<Range<usize>> {
    let longest = (LONGEST_BESIDE_S / period_s) as usize;
    let whole = |row: usize| beside.iter().all(|column| column.values[row].is_finite());
    let mut out = Vec::new();
    for run in runs {
        // From the first whole row to the last one before a long hole.
        let mut open: Option<Range<usize>> = None;
        for row in run.filter(|row| whole(*row)) {
            match &mut open {
                Some(part) if row - part.end <= longest => part.end = row + 1,
                _ => out.extend(open.replace(row..row + 1)),
            }
        }
        out.extend(open);
    }
    out.retain(|run| run.len() >= 2);
    out
}

/// Fills in what is no number by a straight line between what lies beside it.
pub fn fill_straight(values: &mut [f64]) {
    for hole in holes(values) {
        fill_straight_in(values, hole);
    }
}

fn fill_straight_in(values: &mut [f64], hole: Range<usize>) {
    let before = hole.start.checked_sub(1).map(|row| values[row]);
    let (first, last) = match (before, values.get(hole.end).copied()) {
        (Some(before), Some(after)) => (before, after),
        (Some(one), None) | (None, Some(one)) => (one, one),
        (None, None) => return,
    };
    let step = (last - first) / (hole.len() + 1) as f64;
    for (k, row) in hole.enumerate() {
        values[row] = first + step * (k + 1) as f64;
    }
}

/// Fills in what is no number by the cubic through the two numbers on either side, on a grid where there is one.
pub fn fill_smooth(values: &mut [f64], grid: f64) {
    let holes = holes(values);
    fill_between(values, &holes, grid);
}

/// The same in these rows alone, which are in order.
pub fn fill_between(values: &mut [f64], holes: &[Range<usize>], grid: f64) {
    for hole in holes {
        fill_straight_in(values, hole.clone());
    }
    for hole in holes {
        let filled = |row: usize| {
            holes.get(holes.partition_point(|hole| hole.end <= row)).is_some_and(|hole| hole.contains(&row))
        };
        let known = |row: &usize| values[*row].is_finite() && !filled(*row);
        let before = (0..hole.start).rev().filter(known).take(2);
        let nodes: Vec<usize> = before.chain((hole.end..values.len()).filter(known).take(2)).collect();
        if nodes.len() < 4 {
            continue;
        }
        for row in hole.clone() {
            let weight = |node: usize| -> f64 {
                let others = nodes.iter().filter(|other| **other != node);
                others.map(|&other| (row as f64 - other as f64) / (node as f64 - other as f64)).product()
            };
            let smooth: f64 = nodes.iter().map(|&node| weight(node) * values[node]).sum();
            values[row] = if grid > 0.0 { (smooth / grid).round() * grid } else { smooth };
        }
    }
}

/// Where a column holds no numbers.
#[must_use]
pub fn holes(values: &[f64]) -> Vec<Range<usize>> {
    let mut holes: Vec<Range<usize>> = Vec::new();
    for row in (0..values.len()).filter(|row| !values[*row].is_finite()) {
        match holes.last_mut() {
            Some(hole) if hole.end == row => hole.end += 1,
            _ => holes.push(row..row + 1),
        }
    }
    holes
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A motion at 1 kHz whose rows and cells are missing as said.
    fn recording(lost: &[usize], empty: &[usize]) -> Recording {
        let rows: Vec<usize> = (0..3000).filter(|i| !lost.contains(i)).collect();
        let time = rows.iter().map(|i| 1e-3 * *i as f64).collect();
        let cell = |i: &usize| if empty.contains(i) { f64::NAN } else { 5.0 * (3e-3 * *i as f64).sin() };
        let position = Column::new("x.position_mm", rows.iter().map(cell).collect());
        Recording::from_columns("run.csv", time, vec![position]).unwrap()
    }

    #[test]
    fn few_missing_rows_part_nothing_and_each_row_keeps_its_place() {
        let recording = recording(&[100, 101, 900, 901, 902, 903], &[500, 2000]);
        let position = &recording.columns[0];
        let stretches = joined(&recording, position, recording.runs(&[position]));
        assert_eq!(stretches.len(), 2, "{stretches:?}");
        for (stretch, first) in stretches.iter().zip([0, 904]) {
            let times = stretch.times(&recording.time_s, &position.values).unwrap();
            for (t, place) in times.iter().zip(stretch.places()) {
                assert!((t - 1e-3 * (first + place) as f64).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn what_is_filled_in_lies_on_the_curve_and_on_the_grid() {
        let curve = |i: usize| 1e-3 * (2.0 * (0.02 * i as f64).sin() * 1e3).round();
        let mut values: Vec<f64> = (0..400).map(curve).collect();
        for hole in [50, 51, 52, 200] {
            values[hole] = f64::NAN;
        }
        fill_smooth(&mut values, 1e-3);
        for i in 0..400 {
            assert!(
                (values[i] - curve(i)).abs() < 1.6e-3 && (values[i] * 1e3 - (values[i] * 1e3).round()).abs() < 1e-6
            );
        }
        let mut ends = [f64::NAN, 1.0, f64::NAN, 3.0, f64::NAN];
        fill_straight(&mut ends);
        assert_eq!(ends, [1.0, 1.0, 2.0, 3.0, 3.0]);
    }

    #[test]
    fn a_long_hole_beside_a_motion_parts_it() {
        let torque = |i: usize| if (100..300).contains(&i) || (500..520).contains(&i) { f64::NAN } else { 1.0 };
        let column = Column::new("x.torque_nm", (0..1000).map(torque).collect());
        let parts = without_long_holes(vec![Range { start: 0, end: 1000 }], &[&column], 1e-3);
        assert_eq!(parts, [0..100, 300..1000]);
    }
}
