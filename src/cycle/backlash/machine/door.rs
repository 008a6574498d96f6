//! The one door out of a measurement: brake, restore what was changed, fail with the first error.

use super::*;

impl Backlash {
    /// A deadline has passed.
    #[cold]
    pub(super) fn overdue(&mut self, input: &BacklashInput) {
        match self.phase {
            Phase::Restore => self.give_up(),
            Phase::Stopping => self.restore(),
            Phase::Clear | Phase::Write { .. } => {
                self.leave(self.unconfirmed(input));
            }
            _ => self.leave(Fault { code: GIB_ERR_DEADLINE, field: "phase\0", ..Fault::NONE }),
        }
    }

    /// What of the present request the kernel has not confirmed: its number, or else the amount.
    fn unconfirmed(&self, input: &BacklashInput) -> Fault {
        let (answered, asked) = (f64::from(input.acknowledged_id), f64::from(self.output.request_id));
        let (amount, wide) = (self.output.compensation_um, self.plan.compensation_tolerance_um);
        let (field, value, low, high) = if answered == asked {
            ("compensation_um\0", input.compensation_um, amount - wide, amount + wide)
        } else {
            ("acknowledged_id\0", answered, asked, asked)
        };
        Fault { code: GIB_ERR_ACK_TIMEOUT, field, value, low, high }
    }

    /// The one door out of a measurement: keeps the first fault, brakes, restores, fails. A faulted drive follows no command: it
    /// is held where it is.
    #[cold]
    pub(super) fn leave(&mut self, fault: Fault) {
        if matches!(self.phase, Phase::Stopping | Phase::Restore) {
            return; // on the way out already
        }
        self.fault = fault;
        self.output.message = fault.code;
        if self.profile.speed != 0.0 && fault.code != GIB_ERR_DRIVE_FAULT {
            self.profile.stop();
            let bound = self.profile.cycles_bound();
            self.enter(Phase::Stopping, bound);
        } else {
            self.restore();
        }
    }

    /// The way out begins in the cycle of its fault: a command that stood still for one would jerk twice.
    #[cold]
    pub(super) fn set_off(&mut self) {
        if self.phase == Phase::Stopping {
            self.brake();
        }
    }

    /// A cycle without an input: it cannot be told any more whether the axis follows. What is under way brakes from this cycle on; a
    /// way out goes on without what an input confirms.
    #[cold]
    pub fn miss(&mut self) {
        const NOTHING: BacklashInput = BacklashInput {
            position_mm: f64::NAN,
            torque: f64::NAN,
            compensation_um: f64::NAN,
            acknowledged_id: 0,
            flags: 0,
        };
        if !self.busy() {
            return;
        }
        let begins = self.phase == Phase::Begin;
        if !self.regardless() {
            self.leave(Fault { field: "input\0", ..Fault::of(GIB_ERR_NULL) });
            self.set_off();
        } else if self.left == 0 {
            self.overdue(&NOTHING);
        } else {
            self.left -= 1;
            self.advance(&NOTHING);
        }
        // Before the first input it is not known where the axis stands.
        if !begins {
            self.put_out();
        }
    }

    /// One cycle of braking.
    pub(super) fn brake(&mut self) {
        if self.profile.step() {
            self.restore();
        }
    }

    /// Second half of the door: asks for the old amount if anything was changed.
    pub(super) fn restore(&mut self) {
        self.profile.halt();
        if self.changed {
            self.request(self.fallback_um, false);
            self.enter(Phase::Restore, f64::from(self.plan.ack_timeout));
        } else {
            self.fail();
        }
    }

    /// The restore was not confirmed in time. The request stays on the output.
    pub(super) fn give_up(&mut self) {
        self.fail();
        self.output.message = GIB_ERR_RESTORE_UNCONFIRMED;
    }

    pub(super) fn fail(&mut self) {
        self.enter(Phase::Failed, 0.0);
        self.output.status = self.fault.code;
    }
}
