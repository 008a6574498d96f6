//! What an elastic drive still swings after a stretch of rows has begun.

use super::{BLOCKS, Frame, grids};
use crate::machine::{Axis, TwoMasses};

/// Time constants until a free swing has come to a hundredth and a half of its size.
const FREE_SWINGS: f64 = 4.2;
/// Most of a stretch that is given up for it.
const MOST_OF_STRETCH: f64 = 0.25;

impl Frame<'_> {
    /// The same rows without what an elastic drive still swings after a stretch has begun: which way it was wound up then, nobody knows.
    /// Its table swings freely until damping has taken that off, or for a quarter of the stretch. All of them where the axis has no such drive.
    #[must_use]
    pub fn after_first_swings(self, axis: &Axis) -> Self {
        match axis.two_masses() {
            Ok(Some(masses)) if !(masses.clearance > 0.0) => self.without_swings_of(&masses),
            _ => self,
        }
    }

    fn without_swings_of(mut self, masses: &TwoMasses) -> Self {
        let swinging_s = FREE_SWINGS * 2.0 * masses.table_inertia / masses.damping.max(1e-300);
        let stretches = self.columns.stretches.iter().map(|s| (s.start, s.len()));
        let ends: Vec<(usize, usize)> = stretches
            .filter_map(|(start, rows)| {
                let first = *self.kept.get(self.kept.partition_point(|&row| row < start))?;
                let swinging = (swinging_s / self.columns.period_s).min(MOST_OF_STRETCH * rows as f64) as usize;
                Some((start, first + swinging))
            })
            .collect();
        let settled = |row: usize| {
            let stretch = ends.partition_point(|&(start, _)| start <= row);
            stretch.checked_sub(1).and_then(|s| ends.get(s)).is_none_or(|&(_, end)| row >= end)
        };
        let judged: Vec<usize> = (0..self.kept.len()).filter(|&k| settled(self.kept[k])).collect();
        let chosen = |values: &[f64]| judged.iter().map(|&k| values[k]).collect::<Vec<f64>>();
        (self.weights, self.acceleration, self.speed) =
            (chosen(&self.weights), chosen(&self.acceleration), chosen(&self.speed));
        self.kept = judged.iter().map(|&k| self.kept[k]).collect();
        self.blocks = (0..=BLOCKS).map(|b| b * self.kept.len() / BLOCKS).collect();
        self.unseen = grids::unseen_by_floor(&self);
        self.grids_in_table = grids::in_table(&self);
        self
    }
}
