//! The state machine of a measurement: ramps commanded by gib, or listening. The result is fitted off the cycle.

use super::blocks::Gather;
use super::fit::Question;
use super::io::*;
use super::plan::Plan;
use super::report::InertiaReport;
use crate::cycle::backlash::io::{GIB_INPUT_ABORT, GIB_INPUT_FAULT};
use crate::error::{
    Fault, GIB_BUSY, GIB_DONE, GIB_ERR_ABORTED, GIB_ERR_CONFIG, GIB_ERR_DRIVE_FAULT, GIB_ERR_LAG, GIB_ERR_NON_FINITE,
    GIB_ERR_STATE, GIB_ERR_TORQUE_BOUND, GIB_OK,
};

/// Fastest |speed| at which a measurement may be started, rpm: as fast as its ramps may be.
const FASTEST_START: f64 = 2e5;

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
    /// Cycles left to the present state, but for those that are quiet.
    left: u32,
    /// Cycles in which nothing ends, granted and left of that: they need only the [`quick`](Self::quick) look.
    granted: i32,
    quiet: i32,
    /// Largest following error and torque in this state; what is beyond is a fault.
    limits: [f64; 2],
    /// Change of command (rpm) and progress in a cycle.
    change: [f64; 2],
    start_speed: f64,
    progress_step: f64,
    /// Holds the command too.
    output: InertiaOutput,
    gather: Gather,
}

impl Default for Inertia {
    fn default() -> Inertia {
        Inertia {
            plan: Plan::rest(),
            phase: Phase::Idle,
            fault: Fault::NONE,
            left: 0,
            granted: 0,
            quiet: 0,
            limits: [f64::MAX; 2],
            change: [0.0; 2],
            start_speed: 0.0,
            progress_step: 0.0,
            output: InertiaOutput::default(),
            gather: Gather::default(),
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
        self.gather = Gather::new(plan.gate, plan.block, plan.cycle_s, plan.torque_nm, plan.listen);
        let cycles = if plan.listen { plan.listen_cycles } else { plan.gathering() };
        self.progress_step = (1.0 - 1e-9) / f64::from(cycles.max(1)); // never above 1 by rounding
        self.output.progress_ratio = 0.0;
        self.output.message = 0;
        self.enter(Phase::Begin);
        Ok(())
    }

    /// Aborts a running measurement: back to the speed at start, then `GIB_ERR_ABORTED`. Nothing when not busy.
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
    pub fn output(&self) -> &InertiaOutput {
        &self.output
    }

    /// First fault of the present run.
    #[must_use]
    pub fn fault(&self) -> Fault {
        self.fault
    }

    /// Fits what was gathered. Off the cycle: takes 10 to 150 ms.
    ///
    /// # Errors
    /// `GIB_ERR_STATE` unless done; in the second place why the value cannot be used.
    pub fn report(&self) -> Result<(InertiaReport, Result<(), Fault>), Fault> {
        if self.phase != Phase::Done {
            return Err(Fault::of(GIB_ERR_STATE));
        }
        let (torque_step, speed_step) = (self.gather.torque_step(), self.gather.speed_step());
        let question = Question { torque_step, speed_step, ..self.plan.question };
        let (blocks, used, length) = self.gather.blocks();
        Ok(InertiaReport::of(blocks.get(..used).unwrap_or(&[]), length, &question))
    }

    /// One servo cycle.
    #[inline]
    pub fn step(&mut self, input: &InertiaInput) -> &InertiaOutput {
        if !self.quick(input) {
            self.turn(input);
        }
        &self.output
    }

    /// Does this cycle if it is one like the last, with the output in `output`; else returns false, and [`turn`](Self::turn)
    /// must follow. The count is taken down in any case, which costs less than to look first; `turn` gives it back.
    #[inline(always)]
    pub fn quick(&mut self, input: &InertiaInput) -> bool {
        self.quiet -= 1;
        if self.quiet < 0 || input.flags != 0 {
            return false;
        }
        let off = [self.output.speed_command_rpm - input.speed_rpm, 0.0 - input.torque].map(f64::abs);
        let within = (off[0] <= self.limits[0]) & (off[1] <= self.limits[1]);
        if !within || !self.gather.take(input.speed_rpm, input.torque) {
            return false;
        }
        self.go_on();
        true
    }

    #[inline(always)]
    fn go_on(&mut self) {
        let [command, progress] = self.change;
        self.output.speed_command_rpm += command;
        self.output.progress_ratio += progress;
    }

    /// A cycle that [`quick`](Self::quick) declined: resting, the end of a block or a state, danger.
    #[inline(never)]
    pub fn turn(&mut self, input: &InertiaInput) {
        let speed = input.speed_rpm;
        self.quiet += 1;
        self.settle();
        match self.phase {
            Phase::Idle | Phase::Done | Phase::Failed => {
                if speed.is_finite() {
                    self.output.speed_command_rpm = speed;
                }
                return;
            }
            Phase::Return => {
                self.go_on_returning(input);
                return self.grant();
            }
            Phase::Begin if speed.is_finite() => self.output.speed_command_rpm = speed,
            _ => {}
        }
        if let Some(fault) = self.danger(input) {
            self.leave(fault);
        } else if self.left == 0 || input.flags != 0 {
            self.next(speed);
        } else {
            self.left -= 1;
            self.gather.add(speed, input.torque);
            self.go_on();
        }
        self.grant();
    }

    /// Takes the quiet cycles that have passed off what is left of state and block.
    #[inline(always)]
    fn settle(&mut self) {
        let passed = self.granted.abs_diff(self.quiet);
        self.left = self.left.saturating_sub(passed);
        self.gather.count(passed);
        (self.granted, self.quiet) = (0, 0);
    }

    /// Grants the quiet cycles until state or block ends.
    #[inline(always)]
    fn grant(&mut self) {
        let quiet = if self.busy() { self.left.min(self.gather.quiet()) } else { 0 };
        self.granted = i32::try_from(quiet).unwrap_or(i32::MAX);
        self.quiet = self.granted;
    }

    /// Anything in this cycle's input that must end a measurement.
    fn danger(&self, input: &InertiaInput) -> Option<Fault> {
        let fault = |code, field, value, low, high| Some(Fault { code, field, value, low, high });
        let [lag_limit, bound] = self.limits;
        let allowed = if self.phase == Phase::Listening { GIB_INERTIA_FINISH } else { 0 };
        match input.flags & !allowed {
            0 => {}
            flags if flags & GIB_INPUT_FAULT != 0 => return Some(Fault::of(GIB_ERR_DRIVE_FAULT)),
            flags if flags & GIB_INPUT_ABORT != 0 => return Some(Fault::of(GIB_ERR_ABORTED)),
            flags => return fault(GIB_ERR_CONFIG, "flags\0", f64::from(flags), 0.0, f64::from(allowed)),
        }
        for (field, value) in [("speed_rpm\0", input.speed_rpm), ("torque\0", input.torque)] {
            if !value.is_finite() {
                return fault(GIB_ERR_NON_FINITE, field, value, f64::MIN, f64::MAX);
            }
        }
        if input.torque.abs() > bound {
            return fault(GIB_ERR_TORQUE_BOUND, "torque\0", input.torque, -bound, bound);
        }
        if self.phase == Phase::Begin && !self.plan.listen && input.speed_rpm.abs() > FASTEST_START {
            return fault(GIB_ERR_LAG, "speed_rpm\0", input.speed_rpm, -FASTEST_START, FASTEST_START);
        }
        let lag = self.output.speed_command_rpm - input.speed_rpm;
        if lag.abs() > lag_limit {
            return fault(GIB_ERR_LAG, "speed_rpm\0", lag, -lag_limit, lag_limit);
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

    /// The one door out: keeps the first fault and goes back to the speed at start, from the speed commanded now and no
    /// faster than the ramps; with a faulted drive, or where gib commands nothing, it just ends.
    #[cold]
    fn leave(&mut self, fault: Fault) {
        if self.fault == Fault::NONE {
            self.fault = fault;
            self.output.message = fault.code;
        }
        match self.phase {
            Phase::Begin | Phase::Listening => self.finish(),
            _ if fault.code == GIB_ERR_DRIVE_FAULT => self.finish(),
            Phase::Return => {} // on the way already
            _ => self.enter(Phase::Return),
        }
    }

    /// Return goes on whatever is measured, but remembers a fault; only a faulted drive ends it at once.
    fn go_on_returning(&mut self, input: &InertiaInput) {
        if let Some(fault) = self.danger(input) {
            self.leave(fault);
        }
        if self.phase != Phase::Return {
            return;
        }
        if self.left == 0 {
            self.finish();
        } else {
            self.left -= 1;
            self.go_on();
        }
    }

    fn finish(&mut self) {
        self.enter(if self.fault == Fault::NONE { Phase::Done } else { Phase::Failed });
    }

    /// Goes to a state and sets its command, duration and limits.
    fn enter(&mut self, phase: Phase) {
        self.settle();
        self.phase = phase;
        let plan = &self.plan;
        let ([low, high], command) = (plan.speeds, self.output.speed_command_rpm);
        let (goal, left) = match phase {
            Phase::Idle | Phase::Begin | Phase::Done | Phase::Failed => (command, 0),
            Phase::Approach => (low, plan.cycles_between(low, command)),
            Phase::HoldLow(_) => (low, plan.hold),
            Phase::Up(ramp) => (high, plan.cycles_of(ramp)),
            Phase::HoldHigh(_) => (high, plan.hold),
            Phase::Down(ramp) => (low, plan.cycles_of(ramp)),
            Phase::Listening => (command, plan.listen_cycles),
            Phase::Return => (self.start_speed, plan.cycles_between(self.start_speed, command)),
        };
        // What is gathered on the way to the first ramp and back is not asked for.
        let gathers = !matches!(phase, Phase::Begin | Phase::Approach | Phase::Return);
        if gathers {
            self.gather.resume(plan.gate.takeup);
        } else {
            self.gather.pause();
        }
        let change = if left > 0 { (goal - command) / f64::from(left) } else { 0.0 };
        self.change = [change, if gathers { self.progress_step } else { 0.0 }];
        self.left = left;
        let follows = !matches!(phase, Phase::Begin | Phase::Listening);
        self.limits = [if follows { plan.lag_limit } else { f64::MAX }, plan.torque_bound];
        if phase == Phase::Done {
            self.output.progress_ratio = 1.0;
        }
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
