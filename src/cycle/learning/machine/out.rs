//! What ends learning from without, and its last cycles.

use super::*;
use crate::cycle::backlash::io::{GIB_INPUT_ABORT, GIB_INPUT_FAULT, unknown_flags};

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

/// The fault that an input's flags tell.
#[cold]
pub fn flagged(flags: u32) -> Fault {
    if flags & GIB_INPUT_ABORT != 0 {
        Fault::of(GIB_ERR_ABORTED)
    } else if flags & GIB_INPUT_FAULT != 0 {
        Fault::of(GIB_ERR_DRIVE_FAULT)
    } else {
        unknown_flags(flags)
    }
}
