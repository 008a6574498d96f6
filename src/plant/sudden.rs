//! What happens too suddenly for the measured motion to tell it: friction that turns round, an axis that sticks for some rows, a
//! ripple above the cut-off of the motion.
//!
//! The closed loop knows it, as far as it moves as the axis did. The torque I that its own motion needs, known no better than the
//! measured one, lacks the same:
//!
//! T = (1 − w)·I(x) + w·(T_loop + (1 − u)·(I(x) − I(x_loop))).
//!
//! w is one where the loop moves as the axis did to a tenth of the way gone within the filter's reach, so that what is sudden comes at the
//! right moment, or to what the position tells; u is one in the latter case only, where the two motions are the same for all that is known,
//! and near standstill the measured one would turn the friction round by its noise. Where the loop moves otherwise both are nothing.
//! Within its friction an axis may stand a little elsewhere: it is how both move there that counts, not where.

use super::observed::Observed;
use super::predict::{TorquePrediction, torque_of};
use crate::machine::Axis;
use std::ops::Range;

/// Deviations of the position that are no difference of two motions.
const DEVIATIONS: f64 = 3.0;
/// Share of the way within the filter's reach by which the motions may differ: one is early or late by that share of the time.
const SHARE_OF_WAY: f64 = 0.1;

/// Puts what is sudden on a predicted torque column, by the position and the torque column of the closed loop.
pub(super) fn add(torque: &mut TorquePrediction, axis: &Axis, observed: &Observed, position: &[f64], of_loop: &[f64]) {
    let needed = torque_of(axis, &torque.physics, &observed.moving_along(position));
    for run in &observed.runs {
        let rows = run.clone().zip(Alike::new(observed, position, run.clone()));
        for (row, (w, u)) in rows {
            let (own, of_loop, needed) = (torque.torque[row], of_loop[row], needed[row]);
            let fused = own + w * (of_loop - needed + u * (needed - own));
            if fused.is_finite() {
                torque.torque[row] = fused;
            }
        }
    }
}

/// How much alike axis and loop move about each row of a run: w and u.
struct Alike<'o> {
    observed: &'o Observed,
    position: &'o [f64],
    run: Range<usize>,
    row: usize,
    /// Rows to either side that the filter reaches.
    around: usize,
    /// Rows of the window; sum and squares of what lies between both motions there beyond what did at first, and the way gone.
    window: Range<usize>,
    at_first: f64,
    sum: f64,
    squares: f64,
    way: f64,
}

impl<'o> Alike<'o> {
    fn new(observed: &'o Observed, position: &'o [f64], run: Range<usize>) -> Self {
        let around = (0.5 / (observed.motion.cutoff_hz * observed.period_s)).ceil() as usize;
        let (row, window) = (run.start, run.start..run.start);
        let mut alike =
            Self { observed, position, run, row, around, window, at_first: 0.0, sum: 0.0, squares: 0.0, way: 0.0 };
        alike.at_first = alike.between(row);
        alike
    }

    /// What lies between both motions.
    fn between(&self, row: usize) -> f64 {
        self.observed.motion.position[row] - self.position[row]
    }

    /// Takes a row into the window, or out of it.
    fn count(&mut self, row: usize, sign: f64) {
        let x = &self.observed.motion.position;
        let between = self.between(row) - self.at_first;
        self.sum += sign * between;
        self.squares += sign * between * between;
        self.way += if row > self.run.start { sign * (x[row] - x[row - 1]).abs() } else { 0.0 };
    }
}

impl Iterator for Alike<'_> {
    type Item = (f64, f64);

    fn next(&mut self) -> Option<(f64, f64)> {
        if self.row >= self.run.end {
            return None;
        }
        let end = (self.row + self.around + 1).min(self.run.end);
        while self.window.end < end {
            self.count(self.window.end, 1.0);
            self.window.end += 1;
        }
        while self.window.start + self.around < self.row {
            self.count(self.window.start, -1.0);
            self.window.start += 1;
        }
        self.row += 1;
        let rows = self.window.len() as f64;
        let apart = (self.squares / rows - (self.sum / rows).powi(2)).max(0.0).sqrt();
        let told = DEVIATIONS * self.observed.motion.resolution;
        let alike = |within: f64| if apart > 0.0 { 1.0 / (1.0 + (apart / within).powi(2)) } else { 1.0 };
        Some((alike(told.max(SHARE_OF_WAY * self.way)), alike(told)))
    }
}
