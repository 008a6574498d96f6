//! The same equations of few of their rows: enough to see how much a law explains, in a fraction of the time.

use super::beside::orthonormalised;
use super::smoothed::unit;
use super::{Bench, Fit, Part, dot};
use crate::diagnosis::frame::Frame;

impl Bench<'_, '_> {
    /// These equations of one judged row in so many, on the frame of those ([`Frame::few`]).
    #[must_use]
    pub fn of_few<'g, 'b>(&self, frame: &'g Frame<'b>, every: usize) -> Bench<'g, 'b> {
        let few = |column: &[f64]| few(column, self.rows, every);
        let (measured, doubt, certain) = (few(&self.measured), few(&self.doubt), few(&self.certain));
        let free = orthonormalised(self.free.iter().map(|column| unit(few(column))).collect());
        let (floors, resistance) = (self.floors, self.resistance.clone());
        let rows = frame.kept.len();
        Bench { frame, measured, floors, doubt, certain, rows, free, resistance, windows: Vec::new() }
    }
}

impl Part {
    /// The same of equations of one row in so many.
    #[must_use]
    pub fn of_few(&self, rows: usize, every: usize) -> Self {
        self.on_others(|column| few(column, rows, every))
    }
}

impl Fit {
    /// What is left in one row of so many, summed over the squares.
    #[must_use]
    pub fn squares_of_few(&self, every: usize) -> f64 {
        let left = few(&self.residual, self.rows, every);
        dot(&left, &left)
    }
}

/// One row in so many of each channel of a stacked column.
fn few(column: &[f64], rows: usize, every: usize) -> Vec<f64> {
    column.chunks(rows.max(1)).flat_map(|channel| channel.iter().step_by(every).copied()).collect()
}
