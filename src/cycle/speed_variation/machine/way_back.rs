//! The way back to the mean speed, on which every variation ends: as asked for, or by a fault.

use super::*;
use crate::cycle::profile::{higher, lower};

impl SpeedVariation {
    /// One cycle back toward the mean, with what cutting leaves now, whatever else is wrong with the input.
    pub(super) fn go_back(&mut self, input: &SpeedVariationInput) {
        let cutting = input.cutting_nm;
        if cutting != self.asked[3] && (0.0..=MOST_CUTTING).contains(&cutting) {
            self.asked[3] = cutting;
            self.load(cutting);
            self.give_time();
        }
        // What was granted and has not gone by is left, too.
        self.patience = (self.patience + self.quiet as u32).saturating_sub(1);
        let (mean, before) = (self.mean(), self.speed);
        self.go(lower(higher(mean - before, -self.back), self.back));
        let missing = mean - self.speed;
        let there = missing.abs() <= 1e-9 * mean;
        self.grant_back(missing, self.speed - before);
        if !there && self.patience == 0 && self.fault == Fault::NONE {
            self.fault = Fault::of(GIB_ERR_SPEED_VARIATION_NONE);
            self.output.message = GIB_ERR_SPEED_VARIATION_NONE;
        }
        if there || self.patience == 0 {
            self.output.torque_nm = 0.0;
            self.enter(if self.fault == Fault::NONE { Phase::Done } else { Phase::Failed });
        }
    }

    /// Grants the cycles that are like this one, in which the speed went by `change` and after which that much is missing.
    fn grant_back(&mut self, missing: f64, change: f64) {
        let steady = (change.abs() - self.back).abs() <= 1e-9 * self.back && missing.abs() > 2.0 * self.back;
        let fastest = higher(self.speed, self.mean());
        // What the motor has left shrinks with speed: enough at the fastest is enough all the way.
        let cycles = if steady && self.has(change, fastest) { (missing.abs() / self.back) as u32 - 1 } else { 0 };
        let cycles = cycles.min(self.patience.saturating_sub(1)).min(i32::MAX as u32);
        self.patience -= cycles;
        (self.quiet, self.steady) = (cycles as i32, change);
    }

    /// Sets out for the mean, at the variation's own rate but not slower than a tenth of it in a second.
    pub(super) fn set_out(&mut self) {
        const SLOWEST_1_S: f64 = 0.1;
        self.back = self.now.rate.max(SLOWEST_1_S * self.mean() * self.plan.cycle_s);
        self.way = (self.mean() - self.speed).abs();
        self.deadline = self.time_for_the_way();
        self.patience = self.deadline;
        self.slope = true;
        self.enter(Phase::Stopping);
    }

    /// The one door out: keeps the first fault and goes back to the mean speed; with a faulted drive it just ends.
    #[cold]
    pub(super) fn leave(&mut self, fault: Fault) {
        if self.fault == Fault::NONE {
            self.fault = fault;
            self.output.message = fault.code;
        }
        // An input that is wrong is looked at in every cycle: its load may change meanwhile, and change back.
        self.seen = NOTHING_SEEN;
        match self.phase {
            Phase::Running if fault.code != GIB_ERR_DRIVE_FAULT => self.set_out(),
            Phase::Stopping if fault.code != GIB_ERR_DRIVE_FAULT => {} // on the way already
            _ => {
                self.output.torque_nm = 0.0;
                self.enter(Phase::Failed);
            }
        }
    }
}
