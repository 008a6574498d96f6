//! The state machine of homing on a dead stop: one call per servo cycle.
//!
//! ```text
//! Idle → Begin → Limit → Touch → Retract → Evaluate → Touch → … → Touch → Clear → Evaluate → Offset → Set → Done
//!          any state ──fault, abort, deadline, refusal──▶ leave: Stopping → Unload (→ Relieve) → Restore → Failed
//! ```
//!
//! `leave` is the one door out: it brakes, takes the pressure off the stop, and gives the old torque limit back, in
//! that order, so that the limit is never raised on a pressed axis. Every state but Idle, Done and Failed has a
//! deadline in cycles, and the time limit ends whatever goes on.

use super::fit::Fit;
use super::io::*;
use super::plan::Plan;
use super::side::{Side, Touch};
use super::verdict::{HomingReport, HomingSide, Touches};
use crate::cycle::backlash::io::{GIB_INPUT_ABORT, flagged};
use crate::error::*;

mod gantry;
mod quick;
#[cfg(test)]
mod quick_tests;
mod resting;
mod sequence;
#[cfg(test)]
mod set_tests;
mod way_out;

/// Where the machine is. Each comment says what ends the state.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Phase {
    /// Ends with `start`.
    Idle,
    /// Ends with its first cycle, which tells where the axis stands and which torque limit is in force.
    Begin,
    /// Ends when the kernel confirms the torque limit.
    Limit,
    /// Ends when every motor has pressed for the detection time.
    Touch,
    /// Ends when every motor is back.
    Retract,
    /// Ends when the kernel confirms that the deviation is cleared.
    Clear,
    /// Ends when the touch is evaluated.
    Evaluate,
    /// Ends at the zero offset.
    Offset,
    /// Ends when the kernel confirms the position and the old torque limit.
    Set,
    /// Ends when the commanded speed is 0.
    Stopping,
    /// Ends when the axis has gone back from the stop, or did not.
    Unload,
    /// Ends when the torque is off an axis that something holds.
    Relieve,
    /// Ends when the kernel confirms the old torque limit.
    Restore,
    /// Ends with the next `start`.
    Done,
    /// Ends with the next `start`.
    Failed,
}

/// Homing of one axis, of one motor or two: plain data, no pointers.
#[derive(Debug, Clone)]
pub struct Homing {
    plan: Plan,
    phase: Phase,
    /// All that is to be done is to move or to press: most cycles are like the one before.
    quick: bool,
    usual: quick::Usual,
    /// The next cycles may be usual ones of an axis that rests, and how many.
    at_rest: bool,
    rests_on: i32,
    /// First fault of this run.
    fault: Fault,
    /// What the evaluation of the touch found wrong.
    suspect: Fault,
    /// Cycles since the start, when the present state must have ended, and when all must.
    now: u32,
    deadline: u32,
    end: u32,
    /// Number of the present touch; 0 only finds the stop.
    touch: u32,
    /// Motor whose touch is evaluated; `plan.motors` when all are.
    fitting: usize,
    fit: Fit,
    touches: [Touches; 2],
    /// On the way out: the commands have come to rest.
    stopped: bool,
    /// Torque limit in force at the start.
    old_limit: f64,
    /// The limit in force as it was told last, in bits, which differ where a number is none.
    in_force: u64,
    /// True while the drive runs with a limit that gib has changed and not put right.
    changed: bool,
    /// The kernel has been asked to set the position: what it tells may have the shift added.
    placing: bool,
    output: HomingOutput,
    sides: [Side; 2],
}

impl Default for Homing {
    fn default() -> Homing {
        Homing {
            plan: Plan::REST,
            phase: Phase::Idle,
            quick: false,
            usual: quick::Usual::default(),
            at_rest: false,
            rests_on: 0,
            fault: Fault::NONE,
            suspect: Fault::NONE,
            now: 0,
            deadline: 0,
            end: 0,
            touch: 0,
            fitting: 0,
            fit: Fit::default(),
            touches: [Touches::default(); 2],
            stopped: false,
            old_limit: 0.0,
            in_force: 0,
            changed: false,
            placing: false,
            output: HomingOutput::default(),
            sides: [Side::default(), Side::default()],
        }
    }
}

impl Homing {
    /// Arms a homing; it begins with the next step.
    ///
    /// # Errors
    /// `GIB_ERR_STATE` while busy, `GIB_ERR_RESTORE_UNCONFIRMED` while the old torque limit is owed,
    /// `GIB_ERR_CONFIG` with the field.
    pub fn start(&mut self, plan: Result<Plan, Fault>) -> Result<(), Fault> {
        if self.busy() {
            return Err(Fault::of(GIB_ERR_STATE));
        }
        if self.changed {
            return Err(Fault::of(GIB_ERR_RESTORE_UNCONFIRMED));
        }
        self.plan = plan?;
        self.fault = Fault::NONE;
        self.suspect = Fault::NONE;
        self.now = 0;
        self.end = self.plan.time_limit;
        self.touch = 0;
        self.touches = [Touches::default(); 2];
        self.output.message = 0;
        self.output.events = 0;
        self.output.new_events = 0;
        self.output.shift_mm = [0.0; 2];
        self.output.stop_drive = 0;
        self.in_force = 0;
        self.placing = false;
        self.enter(Phase::Begin, 2.0);
        Ok(())
    }

    /// Aborts: brake, unload, restore, fail with `GIB_ERR_ABORTED`. Nothing when not busy.
    pub fn abort(&mut self) {
        if self.busy() {
            self.leave(Fault::of(GIB_ERR_ABORTED));
        }
    }

    /// True from `start` until Done or Failed.
    #[must_use]
    pub fn busy(&self) -> bool {
        !matches!(self.phase, Phase::Idle | Phase::Done | Phase::Failed)
    }

    /// What the last step put out.
    #[must_use]
    pub fn output(&self) -> &HomingOutput {
        &self.output
    }

    /// First fault of the present run.
    #[must_use]
    pub fn fault(&self) -> Fault {
        self.fault
    }

    /// Cycles since the start.
    #[inline(always)]
    fn cycles(&self) -> u32 {
        self.now.saturating_add(self.usual.gone()).saturating_add(self.sides[0].quick_cycles())
    }

    /// Whether both motors of a gantry are to be stepped.
    #[inline(always)]
    #[must_use]
    pub fn gantry(&self) -> bool {
        self.plan.motors == 2
    }

    /// True when a step does nothing but follow the axis: nothing is under way, owed or news.
    #[inline(always)]
    #[must_use]
    pub fn quiet(&self) -> bool {
        !self.busy() && !self.changed && self.output.new_events == 0
    }

    /// What was found so far, and what became of it.
    #[must_use]
    pub fn report(&self) -> HomingReport {
        let mut side = [HomingSide::default(); 2];
        for i in 0..self.plan.motors.min(2) {
            side[i] = self.touches[i].report(&self.plan, self.sides[i].start, self.output.shift_mm[i]);
        }
        HomingReport {
            side,
            skew_mm: self.skew(),
            old_torque_limit: self.old_limit,
            status: self.output.status,
            method: i32::from(self.plan.use_threshold),
            touches: self.touches[0].count(),
            cycles: self.cycles().min(i32::MAX as u32) as i32,
            restore_owed: i32::from(self.changed && self.phase == Phase::Failed),
            reserved: 0,
        }
    }

    /// One servo cycle of a single motor if it is like the one before, which most are; when it is not, [`Homing::quick_slow`] must follow.
    #[inline(always)]
    pub fn quick(&mut self, input: &HomingInput) -> bool {
        let ([side, _], target) = (&mut self.sides, self.output.target_position_mm[0]);
        let odd = u64::from(input.flags) | (input.torque_limit.to_bits() ^ self.in_force);
        let done = side.quick(&self.plan, target, [input.position_mm[0], input.torque[0]], odd);
        if done {
            self.output.target_position_mm[0] = target + side.profile.speed;
        }
        done
    }

    /// The same for a cycle that is not at constant speed; false when it is unlike too, and nothing is done.
    #[inline(always)]
    pub fn quick_slow(&mut self, input: &HomingInput) -> bool {
        let [side, _] = &mut self.sides;
        side.profile.position = self.output.target_position_mm[0];
        let odd = u64::from(input.flags) | (input.torque_limit.to_bits() ^ self.in_force);
        let done = side.quick_slow(&self.plan, input.position_mm[0], input.torque[0], odd);
        if done {
            self.output.target_position_mm[0] = side.profile.position;
            self.output.target_speed_mm_s[0] = side.profile.speed * self.plan.cycles_per_s;
        }
        done
    }

    /// One servo cycle that is neither [`Homing::quick`] nor [`Homing::quick_slow`].
    pub fn step(&mut self, input: &HomingInput) {
        let (was_quick, caught_up) = (self.quick, self.end_usual());
        self.output.new_events = 0;
        match self.phase {
            Phase::Idle | Phase::Done | Phase::Failed => self.rest(input),
            _ if self.placing => self.place(input),
            Phase::Stopping | Phase::Unload | Phase::Relieve | Phase::Restore => self.exit(input),
            _ => self.work(input),
        }
        // Not in a cycle that has much to do anyway.
        if was_quick && self.quick && self.output.new_events == 0 && !caught_up {
            self.see_usual(self.deadline.saturating_sub(self.now + 2));
        } else if self.phase == Phase::Evaluate {
            self.see_rest();
        }
    }

    /// Ends what was granted: the sides catch up, if cycles went by.
    #[inline(always)]
    fn end_usual(&mut self) -> bool {
        self.end_rest();
        let single = self.sides[0].quick_cycles();
        if single > 0 {
            self.now = self.now.saturating_add(single);
            self.sides[0].profile.position = self.output.target_position_mm[0];
        }
        self.sides[0].look_no_further(&self.plan);
        let went = self.usual.gone() > 0;
        if went {
            self.catch_up();
        }
        self.usual.end();
        went
    }

    fn catch_up(&mut self) {
        for (i, side) in self.sides.iter_mut().enumerate().take(self.plan.motors) {
            side.catch_up(&self.plan, &self.usual.caught(i, self.output.target_position_mm[i & 1]));
        }
        self.now = self.now.saturating_add(self.usual.gone());
    }

    /// Idle, Done, Failed: follows the axis, and waits for a restore that is still owed.
    #[inline(always)]
    fn rest(&mut self, input: &HomingInput) {
        for (target, position) in self.output.target_position_mm.iter_mut().zip(input.position_mm) {
            if position.is_finite() {
                *target = position;
            }
        }
        if self.changed && self.confirmed(input) {
            self.changed = false;
            self.output.message = self.fault.code;
        }
    }

    /// A cycle under way.
    #[inline(always)]
    fn work(&mut self, input: &HomingInput) {
        self.now += 1;
        if let Some(fault) = self.danger(input) {
            self.leave(fault);
        } else if let Some(fault) = self.lost_limit(input.torque_limit) {
            self.leave_by(fault, false);
        } else if self.now >= self.deadline {
            self.overdue();
        } else {
            for (i, side) in self.sides.iter_mut().enumerate().take(self.plan.motors) {
                side.sense(&self.plan, input.position_mm[i], input.torque[i]);
            }
            if self.phase == Phase::Touch { self.touch() } else { self.advance(input) }
        }
        if self.phase == Phase::Stopping {
            self.set_off();
        }
        self.command();
    }

    /// What is wrong with the torque limit in force, as the kernel tells it, if anything. Once asked for it must stay.
    #[inline(always)]
    fn lost_limit(&mut self, told: f64) -> Option<Fault> {
        let same = self.in_force == told.to_bits();
        self.in_force = told.to_bits();
        if same { None } else { self.name_lost_limit(told) }
    }

    #[cold]
    fn name_lost_limit(&self, told: f64) -> Option<Fault> {
        let fault = |code, low, high| Some(Fault { code, field: "torque_limit\0", value: told, low, high });
        let changes = matches!(self.phase, Phase::Begin | Phase::Limit | Phase::Set);
        if !told.is_finite() {
            fault(GIB_ERR_NON_FINITE, f64::MIN, f64::MAX)
        } else if changes || self.plan.acknowledged & GIB_HOMING_REQUEST_TORQUE_LIMIT == 0 || self.limited(told) {
            None
        } else {
            fault(GIB_ERR_HOMING_LIMIT, 0.99 * self.plan.limit, 1.01 * self.plan.limit)
        }
    }

    /// Puts the commands out.
    #[inline(always)]
    fn command(&mut self) {
        for (i, side) in self.sides.iter().enumerate().take(self.plan.motors) {
            self.output.target_position_mm[i] = side.profile.position;
            self.output.target_speed_mm_s[i] = side.profile.speed * self.plan.cycles_per_s;
        }
    }

    /// Anything in this cycle's input that must end homing.
    #[inline(always)]
    fn danger(&self, input: &HomingInput) -> Option<Fault> {
        let mut safe = input.flags == 0;
        for (i, side) in self.sides.iter().enumerate().take(self.plan.motors) {
            safe &= side.safe(&self.plan, input.position_mm[i], input.torque[i]);
        }
        if safe { None } else { self.name_danger(input) }
    }

    #[cold]
    fn name_danger(&self, input: &HomingInput) -> Option<Fault> {
        if input.flags != 0 {
            return Some(flagged(input.flags));
        }
        for (i, side) in self.sides.iter().enumerate().take(self.plan.motors) {
            let (position, torque) = (input.position_mm[i], input.torque[i]);
            let finite = position.is_finite() && torque.is_finite();
            // Before the first cycle there is no command to lag behind.
            // The deviation of a pressed motor is dropped, and its torque with it.
            let sprung = matches!(self.phase, Phase::Clear | Phase::Evaluate)
                && self.touch >= self.plan.touches
                && side.springs_back(&self.plan, position, torque, self.touches[i & 1].press(&self.plan));
            let placed = finite && (self.phase == Phase::Begin || sprung);
            if !placed && !side.safe(&self.plan, position, torque) {
                return Some(side.name_danger(&self.plan, position, torque));
            }
        }
        None
    }

    /// A deadline has passed.
    #[cold]
    fn overdue(&mut self) {
        if self.now >= self.end {
            let [value, high] = [self.now.saturating_add(1), self.end].map(|n| f64::from(n) / self.plan.cycles_per_s);
            let (code, field) = (GIB_ERR_HOMING_TIME_LIMIT, "time_limit_s\0");
            return self.leave(Fault { code, field, value, low: 0.0, high });
        }
        match self.phase {
            Phase::Limit | Phase::Clear | Phase::Set => {
                let (value, low) = (f64::from(self.output.request_id), f64::from(self.output.request_id));
                self.leave(Fault { code: GIB_ERR_ACK_TIMEOUT, field: "acknowledged_id\0", value, low, high: low });
            }
            Phase::Offset => {
                // The command has long ended.
                let late = |side: &&Side| side.profile.speed != 0.0 || !side.came(&self.plan);
                let behind = self.sides.iter().take(self.plan.motors).find(late).unwrap_or(&self.sides[0]);
                self.leave(behind.contradiction(&self.plan, behind.never_came(&self.plan)));
            }
            _ => self.leave(Fault { code: GIB_ERR_DEADLINE, field: "phase\0", ..Fault::NONE }),
        }
    }

    /// One cycle of a touch.
    #[inline(always)]
    fn touch(&mut self) {
        let (mut held, mut pressed) = (0, 0);
        for side in self.sides.iter_mut().take(self.plan.motors) {
            match side.touch(&self.plan) {
                Touch::Going => {}
                Touch::Held => held += 1,
                Touch::Pressed => pressed += 1,
                odd => return self.untouched(odd),
            }
        }
        if self.plan.motors == 2 {
            self.check_square();
        }
        if held + pressed > 0 && self.phase == Phase::Touch {
            self.event(GIB_HOMING_EVENT_CONTACT);
            if pressed == self.plan.motors {
                self.pressed();
            }
        }
    }
}
