//! The state machine of a measurement: ramps commanded by gib, or listening. The result is fitted off the cycle.

use super::blocks::{Block, Gather};
use super::io::*;
use super::plan::Plan;
use super::report::InertiaReport;
use crate::cycle::backlash::io::{GIB_INPUT_ABORT, GIB_INPUT_FAULT};
use crate::error::{
    Fault, GIB_BUSY, GIB_DONE, GIB_ERR_ABORTED, GIB_ERR_DRIVE_FAULT, GIB_ERR_LAG, GIB_ERR_NON_FINITE, GIB_ERR_STATE,
    GIB_ERR_TORQUE_BOUND, GIB_OK,
};

/// Where the measurement is. Every state but the resting ones ends after its own number of cycles.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Phase {
    /// At rest; ends with a start.
    Idle,
    /// Waits for the first input, which says how fast the spindle turns; ends at once.
    Begin,
    /// To the lower speed; ends when it is commanded.
    Approach,
    /// Holds the lower speed before the ramp `.0` (from 0), or after the last; ends after the hold time.
    HoldLow(u32),
    /// Accelerates; ends when the upper speed is commanded.
    Up(u32),
    /// Holds the upper speed; ends after the hold time.
    HoldHigh(u32),
    /// Brakes; ends when the lower speed is commanded.
    Down(u32),
    /// Listens; ends after the listening time, or when told to finish.
    Listening,
    /// Back to the speed at start, also after a fault; ends when it is commanded.
    Return,
    /// Ended well; ends with a start.
    Done,
    /// Ended with an error; ends with a start.
    Failed,
}

/// An inertia measurement of one spindle: plain data, no pointers.
#[derive(Debug, Clone)]
pub struct Inertia {
    plan: Plan,
    phase: Phase,
    /// First fault of this run.
    fault: Fault,
    /// Cycles left to the present state.
    left: u32,
    /// Change of the command in a cycle, rpm.
    change: f64,
    command: f64,
    /// Limits of this state: a torque and a following error beyond them are faults.
    torque_bound: f64,
    lag_limit: f64,
    start_speed: f64,
    progress: f64,
    progress_step: f64,
    gather: Gather,
    output: InertiaOutput,
}

impl Default for Inertia {
    fn default() -> Inertia {
        Inertia {
            plan: Plan::rest(),
            phase: Phase::Idle,
            fault: Fault::NONE,
            left: 0,
            change: 0.0,
            command: 0.0,
            torque_bound: f64::MAX,
            lag_limit: f64::MAX,
            start_speed: 0.0,
            progress: 0.0,
            progress_step: 0.0,
            gather: Gather::default(),
            output: InertiaOutput::default(),
        }
    }
}

impl Inertia {
    /// Arms a measurement; it begins with the next step.
    ///
    /// # Errors
    /// `GIB_ERR_STATE` while busy, `GIB_ERR_CONFIG` with the field.
    pub fn start(&mut self, plan: Result<Plan, Fault>) -> Result<(), Fault> {
        if self.busy() {
            return Err(Fault::of(GIB_ERR_STATE));
        }
        let plan = plan?;
        self.plan = plan;
        self.fault = Fault::NONE;
        self.gather = Gather::new(plan.gate, plan.block, plan.cycle_s, plan.torque_nm);
        let cycles = if plan.listen { plan.listen_cycles } else { plan.gathering() };
        self.progress = 0.0;
        self.progress_step = 1.0 / f64::from(cycles.max(1));
        self.output.message = 0;
        self.enter(Phase::Begin);
        Ok(())
    }

    /// Aborts a running measurement: back to the speed at start, then `GIB_ERR_ABORTED`. Nothing when not busy.
    pub fn abort(&mut self) {
        if self.busy() {
            self.leave(Fault::of(GIB_ERR_ABORTED), self.command);
        }
    }

    /// True from `start` until Done or Failed.
    #[must_use]
    pub fn busy(&self) -> bool {
        !matches!(self.phase, Phase::Idle | Phase::Done | Phase::Failed)
    }

    /// What the last step put out.
    #[must_use]
    pub fn output(&self) -> &InertiaOutput {
        &self.output
    }

    /// First fault of the present run.
    #[must_use]
    pub fn fault(&self) -> Fault {
        self.fault
    }

    /// The blocks gathered, for a graph.
    #[must_use]
    pub fn blocks(&self) -> &[Block] {
        self.gather.blocks()
    }

    /// Fits what was gathered. Off the cycle: takes a millisecond or so.
    ///
    /// # Errors
    /// `GIB_ERR_STATE` unless done; in the second place why the value cannot be used.
    pub fn report(&self) -> Result<(InertiaReport, Result<(), Fault>), Fault> {
        if self.phase != Phase::Done {
            return Err(Fault::of(GIB_ERR_STATE));
        }
        Ok(InertiaReport::of(self.gather.blocks(), self.gather.length(), &self.plan.question))
    }

    /// One servo cycle.
    #[inline]
    pub fn step(&mut self, input: &InertiaInput) -> &InertiaOutput {
        let (speed, torque) = (input.speed_rpm, input.torque);
        let safe = input.flags == 0
            && torque.abs() <= self.torque_bound
            && (self.command - speed).abs() <= self.lag_limit
            && self.left != 0;
        if safe {
            self.left -= 1;
            self.gather.add(speed, torque);
            self.command += self.change;
            self.progress += self.progress_step;
            self.output.speed_command_rpm = self.command;
            self.output.progress_ratio = self.progress;
        } else {
            self.turn(input);
        }
        &self.output
    }

    /// Every cycle that is not one like the last: resting, the end of a state, danger.
    #[inline(never)]
    fn turn(&mut self, input: &InertiaInput) {
        let speed = input.speed_rpm;
        if !self.busy() {
            if speed.is_finite() {
                self.output.speed_command_rpm = speed;
            }
            return;
        }
        if self.phase == Phase::Begin && speed.is_finite() {
            self.command = speed;
        }
        if self.phase == Phase::Return {
            self.go_on_returning(input);
        } else if let Some(fault) = self.danger(input) {
            self.leave(fault, speed);
        } else {
            self.next(speed);
        }
        self.output.speed_command_rpm = self.command;
        self.output.progress_ratio = self.progress.min(1.0);
    }

    /// Anything in this cycle's input that must end a measurement.
    fn danger(&self, input: &InertiaInput) -> Option<Fault> {
        let fault = |code, field, value, low, high| Some(Fault { code, field, value, low, high });
        let bound = self.torque_bound;
        let allowed = if self.phase == Phase::Listening { GIB_INERTIA_FINISH } else { 0 };
        match input.flags & !allowed {
            0 => {}
            flags if flags & GIB_INPUT_ABORT != 0 => return Some(Fault::of(GIB_ERR_ABORTED)),
            _ => return Some(Fault::of(GIB_ERR_DRIVE_FAULT)),
        }
        for (field, value) in [("speed_rpm\0", input.speed_rpm), ("torque\0", input.torque)] {
            if !value.is_finite() {
                return fault(GIB_ERR_NON_FINITE, field, value, f64::MIN, f64::MAX);
            }
        }
        if input.torque.abs() > bound {
            return fault(GIB_ERR_TORQUE_BOUND, "torque\0", input.torque, -bound, bound);
        }
        let lag = self.command - input.speed_rpm;
        let owned = !matches!(self.phase, Phase::Begin | Phase::Listening);
        if owned && lag.abs() > self.plan.lag_limit {
            return fault(GIB_ERR_LAG, "speed_rpm\0", lag, -self.plan.lag_limit, self.plan.lag_limit);
        }
        None
    }

    /// A state has ended as it should.
    fn next(&mut self, speed: f64) {
        match self.phase {
            Phase::Begin => {
                self.start_speed = speed;
                self.enter(if self.plan.listen { Phase::Listening } else { Phase::Approach });
            }
            Phase::Approach => self.enter(Phase::HoldLow(0)),
            Phase::HoldLow(ramp) if ramp < self.plan.ramps => self.enter(Phase::Up(ramp)),
            Phase::HoldLow(_) => self.enter(Phase::Return),
            Phase::Up(ramp) => self.enter(Phase::HoldHigh(ramp)),
            Phase::HoldHigh(ramp) => self.enter(Phase::Down(ramp)),
            Phase::Down(ramp) => self.enter(Phase::HoldLow(ramp + 1)),
            Phase::Listening | Phase::Return => self.finish(),
            Phase::Idle | Phase::Done | Phase::Failed => {}
        }
    }

    /// The one door out: keeps the first fault and goes back to the speed at start, from the speed now.
    #[cold]
    fn leave(&mut self, fault: Fault, speed: f64) {
        if self.phase == Phase::Return {
            return; // on the way out already
        }
        let owned = !matches!(self.phase, Phase::Begin | Phase::Listening);
        self.fault = fault;
        self.output.message = fault.code;
        if owned && fault.code != GIB_ERR_DRIVE_FAULT {
            if speed.is_finite() && fault.code == GIB_ERR_LAG {
                self.command = speed; // what did not follow is not asked for at once again
            }
            self.enter(Phase::Return);
        } else {
            self.finish();
        }
    }

    /// Return goes on whatever is measured; only a faulted drive ends it at once.
    fn go_on_returning(&mut self, input: &InertiaInput) {
        if self.left == 0 || input.flags & GIB_INPUT_FAULT != 0 {
            if self.left > 0 && self.fault == Fault::NONE {
                self.fault = Fault::of(GIB_ERR_DRIVE_FAULT);
                self.output.message = GIB_ERR_DRIVE_FAULT;
            }
            self.finish();
        } else {
            self.left -= 1;
            self.command += self.change;
        }
    }

    fn finish(&mut self) {
        self.enter(if self.fault == Fault::NONE { Phase::Done } else { Phase::Failed });
    }

    /// Goes to a state and sets its command, duration and limits.
    fn enter(&mut self, phase: Phase) {
        self.phase = phase;
        let [low, high] = self.plan.speeds;
        let plan = self.plan;
        // Rounded up, so that no ramp is steeper than asked for.
        let cycles_to = |goal: f64| ((goal - self.command).abs() / plan.acceleration).ceil().max(1.0) as u32;
        let (goal, left) = match phase {
            Phase::Idle | Phase::Begin | Phase::Done | Phase::Failed => (self.command, 0),
            Phase::Approach => (low, cycles_to(low)),
            Phase::HoldLow(_) => (low, plan.hold),
            Phase::Up(_) => (high, cycles_to(high)),
            Phase::HoldHigh(_) => (high, plan.hold),
            Phase::Down(_) => (low, cycles_to(low)),
            Phase::Listening => (self.command, plan.listen_cycles),
            Phase::Return => (self.start_speed, cycles_to(self.start_speed)),
        };
        let moving = !matches!(phase, Phase::Listening) && left > 0;
        self.change = if moving { (goal - self.command) / f64::from(left) } else { 0.0 };
        self.left = left;
        // What is gathered on the way to the first ramp and back is not asked for.
        let gathers = !matches!(phase, Phase::Begin | Phase::Approach | Phase::Return);
        self.gather.leave_out(if gathers { plan.gate.takeup } else { u32::MAX });
        // On the way back nothing is watched; a negative bound sends every cycle through `turn`.
        self.torque_bound = if phase == Phase::Return { -1.0 } else { plan.torque_bound };
        self.lag_limit = if phase == Phase::Listening { f64::MAX } else { plan.lag_limit };
        self.output.status = match phase {
            Phase::Idle => GIB_OK,
            Phase::Done => GIB_DONE,
            Phase::Failed => self.fault.code,
            _ => GIB_BUSY,
        };
        self.output.phase = match phase {
            Phase::Idle => GIB_INERTIA_IDLE,
            Phase::Begin | Phase::Approach => GIB_INERTIA_APPROACH,
            Phase::HoldLow(_) => GIB_INERTIA_HOLD_LOW,
            Phase::Up(_) => GIB_INERTIA_UP,
            Phase::HoldHigh(_) => GIB_INERTIA_HOLD_HIGH,
            Phase::Down(_) => GIB_INERTIA_DOWN,
            Phase::Listening => GIB_INERTIA_LISTENING,
            Phase::Return => GIB_INERTIA_RETURN,
            Phase::Done => GIB_INERTIA_DONE,
            Phase::Failed => GIB_INERTIA_FAILED,
        };
        let owns = self.busy() && !matches!(phase, Phase::Begin | Phase::Listening);
        self.output.owns_motion = i32::from(owns);
    }
}
