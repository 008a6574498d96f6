//! The correction that an instance holds: read out, put in from elsewhere, and taken up again.

use super::*;
use crate::cycle::calibration::solve::Complex;
use crate::cycle::learning::points::{angle, close};
use crate::cycle::vibration::harmonic::PAIRS;
use crate::cycle::vibration::spindle::Wheel;

impl Learning {
    /// The correction in the command put out last, µm.
    #[cold]
    pub fn correction(&mut self) -> f64 {
        // Usual cycles do not keep it.
        self.settle_usual();
        self.correction
    }

    /// Points of the revolution; none before the first start or `install`.
    #[must_use]
    pub fn count(&self) -> usize {
        self.report.points.max(0) as usize
    }

    /// A point of the revolution, `i` below `count`.
    #[must_use]
    pub fn point(&self, i: usize) -> LearningPoint {
        let cell = self.held().get(i).copied().unwrap_or_default();
        let seen = self.seen.get(i).copied().unwrap_or(0.0);
        let target = self.bins.get(i).map_or(0.0, |bin| bin.target);
        LearningPoint {
            angle_deg: 360.0 * angle(i, self.count().max(1)),
            target_mm: target,
            command_mm: target + 1e-3 * cell.value,
            detected_mm: target - 1e-3 * f64::from(seen),
        }
    }

    /// Takes a whole revolution from elsewhere, at most 1024 points, in the order of `point`; not while busy.
    pub fn install(&mut self, points: impl ExactSizeIterator<Item = LearningPoint>) {
        let count = points.len().min(ENTRIES);
        self.settle_usual();
        // A correction that was in force leaves the command by bounded steps, so its speed stays, too.
        let (plan, angle, command, correction) = (self.plan, self.angle, self.command, self.correction);
        *self = Learning { plan, angle, command, correction, ..Learning::default() };
        self.report.points = count as i32;
        let table = &mut self.force;
        for (i, point) in points.take(count).enumerate() {
            let value = 1e3 * (point.command_mm - point.target_mm);
            table[i].value = (value + 1e-10) - 1e-10;
            self.best[i] = table[i].value as f32;
            self.bins[i].target = point.target_mm;
            self.seen[i] = (1e3 * (point.target_mm - point.detected_mm)) as f32;
            self.report.correction_um = self.report.correction_um.max(value.abs());
        }
        for i in 0..count {
            let (before, after) = (if i == 0 { count - 1 } else { i - 1 }, if i + 1 == count { 0 } else { i + 1 });
            let (before, after) = (table[before].value, table[after].value);
            table[i].slope = 0.5 * (after - before);
            self.steepest = self.steepest.max((after - table[i].value).abs());
        }
        close(table, count);
    }

    /// The correction in force.
    pub(super) fn held(&self) -> &Table {
        if self.blend == 1.0 { &self.coming } else { &self.force }
    }

    /// The harmonics of the correction in force, from which the next trials start.
    pub(super) fn take_up(&mut self) {
        let points = self.plan.points;
        // An evaluation that an abort cut short has left this unfinished, and what it says is how far usual cycles may trust the table.
        self.report.correction_um = self.force.iter().take(points).fold(0.0, |most, cell| cell.value.abs().max(most));
        let mut sums = Harmonics::default();
        for (i, cell) in self.force.iter().enumerate().take(points) {
            sums.gather(&Wheel::at(angle(i, points), PAIRS), PAIRS, cell.value as f32);
        }
        let scale = 2.0 / self.plan.scale;
        for (i, line) in self.lines.iter_mut().enumerate() {
            let [a, b] = sums.get(i);
            line.trial = Complex(scale * f64::from(a), -scale * f64::from(b));
        }
    }
}
