//! The last cycles of learning.

use super::*;

impl Learning {
    /// A cycle of fading out without a target to put it on.
    fn fade_out(&mut self) {
        self.presence = (self.presence - self.plan.fade).max(0.0);
        self.correction -= self.correction.max(-self.plan.slope).min(self.plan.slope);
        self.end_of_stopping();
    }

    pub(super) fn end_of_stopping(&mut self) {
        if self.phase == Phase::Stopping && self.presence == 0.0 && self.correction == 0.0 {
            self.enter(Phase::Failed);
        }
    }

    /// The target itself is no number: the last command, and an error that is kept.
    #[cold]
    pub(super) fn blind(&mut self, value: f64) {
        if !self.busy() && !self.holds() {
            return;
        }
        if self.phase != Phase::Stopping {
            let (low, high) = (f64::MIN, f64::MAX);
            self.leave(Fault { code: GIB_ERR_NON_FINITE, field: "target_mm\0", value, low, high });
        }
        self.fade_out();
    }
}
