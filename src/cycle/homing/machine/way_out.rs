//! The way out: what a cycle does once `leave` has begun it, whatever the input says.

use super::*;
use crate::cycle::profile::{higher, lower};

impl Homing {
    /// The way out begins in the cycle of its fault: a command that stood still for one would jerk twice. One that has gone on
    /// already in this cycle brakes from the next.
    #[cold]
    pub(super) fn set_off(&mut self) {
        for (side, last) in self.sides.iter_mut().zip(self.output.target_position_mm).take(self.plan.motors) {
            if side.profile.position == last {
                side.profile.step();
            }
        }
    }

    /// A cycle on the way out: it ends whatever the input says, without a move where position or drive are not to be
    /// trusted, or the axis flies.
    pub(super) fn exit(&mut self, input: &HomingInput) {
        self.now += 1;
        let mut trusted = input.flags & !GIB_INPUT_ABORT == 0;
        for (i, side) in self.sides.iter_mut().enumerate().take(self.plan.motors) {
            let (position, torque) = (input.position_mm[i], input.torque[i]);
            if side.trusted(&self.plan, position, torque) {
                trusted &= !side.flung(&self.plan, position);
                // The bound is broken already, or need not be: a reading that no drive can give must not look like a load.
                let (low, high) = (self.plan.bound_below, self.plan.bound);
                side.sense(&self.plan, position, lower(higher(torque, low), high));
            } else {
                trusted = false;
            }
        }
        if !trusted && self.output.stop_drive == 0 {
            self.stop_drive();
        } else if self.now >= self.deadline {
            self.overdue_exit();
        } else {
            match self.phase {
                Phase::Restore => self.restoring(input),
                Phase::Stopping if self.stopped => self.unload(),
                Phase::Stopping => self.stopped = self.arrived(),
                Phase::Unload => self.unloading(),
                _ => self.relieving(),
            }
        }
        self.command();
    }

    /// A cycle without an input: it cannot be told any more whether the axis follows. What is under way brakes from this cycle on; on the
    /// way out a move goes on to its end, and what needs a reading waits for one, until its deadline.
    #[cold]
    pub fn miss(&mut self) {
        if !self.busy() {
            return;
        }
        self.end_usual();
        self.now += 1;
        let begins = self.phase == Phase::Begin;
        match self.phase {
            Phase::Stopping | Phase::Unload | Phase::Relieve | Phase::Restore if self.now >= self.deadline => {
                self.overdue_exit();
            }
            Phase::Stopping if !self.stopped => self.stopped = self.arrived(),
            Phase::Unload => {
                self.arrived();
            }
            Phase::Stopping | Phase::Relieve | Phase::Restore => {}
            _ => {
                self.leave(Fault { field: "input\0", ..Fault::of(GIB_ERR_NULL) });
                if self.phase == Phase::Stopping {
                    self.set_off();
                }
            }
        }
        // Before the first input it is not known where the axis stands.
        if !begins {
            self.command();
        }
    }

    #[cold]
    fn overdue_exit(&mut self) {
        match self.phase {
            Phase::Restore => self.give_up(),
            Phase::Unload if self.hears() => {
                self.sides.iter_mut().for_each(Side::start_relief);
                self.enter(Phase::Relieve, f64::from(self.plan.ack_timeout));
            }
            // Nobody can tell when the torque is off.
            _ => self.stop_drive(),
        }
    }

    /// No command can be trusted to make the axis safe: the torque is to be taken off it.
    #[cold]
    pub(super) fn stop_drive(&mut self) {
        self.output.stop_drive = 1;
        self.sides.iter_mut().for_each(|side| side.clear_lag(&self.plan));
        if self.phase != Phase::Restore {
            self.restore();
        }
    }

    /// Waits, with no torque on the axis: one that comes back, as of a servo on an encoder that stands, is taken off before the drive
    /// may give more.
    fn restoring(&mut self, input: &HomingInput) {
        let plan = &self.plan;
        let loaded = self.sides.iter().take(plan.motors).any(|side| side.filtered.abs() > plan.release);
        if loaded && self.output.stop_drive == 0 {
            self.stop_drive();
        } else if self.confirmed(input) {
            self.changed = false;
            self.fail();
        }
    }

    /// Whether the torque tells anything.
    fn hears(&self) -> bool {
        match self.fault.code {
            GIB_ERR_HOMING_TORQUE_STUCK => self.alive(),
            code => code != GIB_ERR_HOMING_TORQUE_SIGN,
        }
    }

    /// Whether every torque reading changes.
    pub(super) fn alive(&self) -> bool {
        self.sides.iter().take(self.plan.motors).all(|side| side.alive(&self.plan))
    }

    /// One cycle off the stop. Ends where the command ends, the axis has followed, and nothing holds it.
    fn unloading(&mut self) {
        let (plan, hears) = (self.plan, self.hears());
        let stands = |side: &Side| match self.fault.code {
            // On a tight spot the encoder rightly stands, until the axis has left it.
            GIB_ERR_HOMING_TIGHT_SPOT => side.frozen_off_spot(&plan),
            // A motor that is pressed may stand until its torque has run down; one that pulls at its limit has come, or is held.
            _ if hears && side.filtered > -plan.release => side.frozen_on_way_out(&plan),
            _ => side.frozen_on_way_out(&plan) || side.left_behind(&plan),
        };
        if self.sides.iter().take(plan.motors).any(stands) {
            return self.stop_drive();
        }
        let back = self.arrived();
        // A reading that stands at the limit may tell of a motor that does.
        let quiet = |side: &Side| side.light(&plan) || (!hears && side.filtered.abs() <= plan.release);
        let free = |side: &Side| side.settled(&plan) && quiet(side);
        if back && self.sides.iter().take(plan.motors).all(free) {
            self.restore();
        }
    }

    /// The axis did not follow, something holds it: the servo must not go on pulling once it has its full torque.
    fn relieving(&mut self) {
        let mut all = true;
        for side in self.sides.iter_mut().take(self.plan.motors) {
            all &= side.relieve(&self.plan);
        }
        if all {
            self.restore();
        }
    }

    /// Advances the commands; true when all have arrived.
    fn arrived(&mut self) -> bool {
        let mut all = true;
        for side in self.sides.iter_mut().take(self.plan.motors) {
            all &= side.profile.step();
        }
        all
    }
}
