//! The steps between the states: what begins, what a pressed axis leads to, how it ends well and how it ends ill.

use super::*;
use crate::cycle::profile::higher;

/// Cycles after which the filtered torque of an axis at rest is its own.
const HELD: u32 = 24;
/// Times as long as after other moves that the axis may take to come to the zero offset: homed is homed where it is, and an integrator
/// overcomes friction slowly.
const SETTLES: f64 = 2.5;

impl Homing {
    /// One cycle of the other states under way.
    #[inline(always)]
    pub(super) fn advance(&mut self, input: &HomingInput) {
        match self.phase {
            Phase::Begin => self.begin(input),
            Phase::Limit => {
                if self.confirmed(input) {
                    self.event(GIB_HOMING_EVENT_APPROACH);
                    self.start_touch();
                }
            }
            Phase::Retract => {
                if self.follow() {
                    self.enter_evaluate();
                }
            }
            Phase::Clear => {
                if let Some(fault) = self.astray() {
                    self.leave(fault);
                } else if self.confirmed(input) {
                    self.event(GIB_HOMING_EVENT_CLEAR_ACKNOWLEDGED);
                    self.cleared();
                }
            }
            Phase::Evaluate => {
                if let Some(fault) = self.astray() {
                    self.leave(fault);
                } else if self.fitted() {
                    self.evaluated();
                }
            }
            Phase::Offset => {
                // Homed is homed where the axis is, not where its command is.
                if let Some(fault) = self.never_comes() {
                    self.leave(fault);
                } else if self.follow() && self.sides.iter().take(self.plan.motors).all(|side| side.came(&self.plan)) {
                    self.set();
                }
            }
            Phase::Set => {
                if let Some(fault) = self.astray() {
                    self.leave(fault);
                } else if self.confirmed(input) {
                    self.changed = false;
                    self.event(GIB_HOMING_EVENT_HOMED);
                    self.enter(Phase::Done, 0.0);
                }
            }
            _ => {}
        }
    }

    /// Advances the commands with an eye on encoder and torque; true when all have arrived.
    #[inline(always)]
    fn follow(&mut self) -> bool {
        let mut all = true;
        for side in self.sides.iter_mut().take(self.plan.motors) {
            match side.follow(&self.plan) {
                Touch::Going => all = false,
                Touch::Arrived => {}
                odd => {
                    self.untouched(odd);
                    return false;
                }
            }
        }
        all
    }

    /// The command has ended, the axis has not come, and the servo winds up on an encoder that stands.
    #[inline(always)]
    fn never_comes(&self) -> Option<Fault> {
        let stands = |side: &&Side| side.profile.speed == 0.0 && side.frozen_on_way_out(&self.plan);
        self.sides.iter().take(self.plan.motors).find(stands).map(|side| side.broken_sensor(&self.plan))
    }

    /// What an axis that is to stand does instead, if anything. Off the stop, a servo whose encoder fails winds up and runs away;
    /// pressed, what it presses on may give way.
    #[inline(never)]
    fn astray(&self) -> Option<Fault> {
        let mut sides = self.sides.iter().zip(&self.touches).take(self.plan.motors);
        if self.touch >= self.plan.touches && self.phase != Phase::Set {
            sides.find_map(|(side, touches)| side.gives_way(&self.plan, touches.press(&self.plan)))
        } else {
            sides.find_map(|(side, touches)| side.wound_up(&self.plan, touches))
        }
    }

    /// One slice of the evaluation of the last touch; true when it is done for all motors.
    #[inline(always)]
    fn fitted(&mut self) -> bool {
        if self.fitting >= self.plan.motors.min(2) {
            return true;
        }
        if self.fit.slice(&self.sides[self.fitting & 1].trace) {
            self.fitted_side();
        }
        false
    }

    #[cold]
    pub(super) fn fitted_side(&mut self) {
        let i = self.fitting & 1;
        let side = &self.sides[i];
        let offset = self.plan.sense * (side.origin - side.start);
        if let Err(fault) = self.touches[i].add(&self.plan, self.touch, &self.fit, offset) {
            self.suspect = if self.suspect == Fault::NONE { fault } else { self.suspect };
        }
        self.fitting += 1;
        if self.fitting < self.plan.motors {
            self.evaluate(self.fitting);
        }
    }

    /// Begins the evaluation of a motor's last touch.
    fn evaluate(&mut self, motor: usize) {
        self.fitting = motor;
        let window = self.plan.window();
        self.fit.start(self.sides[motor & 1].trace.last_way() - window, window, self.plan.threshold);
    }

    /// Standing: evaluates the touch of every motor.
    #[cold]
    fn enter_evaluate(&mut self) {
        self.evaluate(0);
        self.enter(Phase::Evaluate, 2.0 * f64::from(Fit::slices_bound()));
    }

    /// The touch is evaluated. Back from it: was it a stop, which pushes the axis back, or a tight spot, which holds it
    /// both ways? That explains more than what the evaluation found.
    #[cold]
    fn evaluated(&mut self) {
        let plan = self.plan;
        let back = self.touch < plan.touches;
        for i in 0..if back { plan.motors.min(2) } else { 0 } {
            let sliding = self.sides[i].sliding;
            self.touches[i].slid_back(sliding);
            self.sides[i].holds(&plan, sliding);
            let level = self.touches[i].level();
            if let Some(fault) = self.sides[i].held_back(&plan, level, || self.racked_back()) {
                return self.leave(fault);
            }
        }
        if self.suspect != Fault::NONE {
            return self.leave(self.suspect);
        }
        let mut sides = self.sides.iter().zip(&self.touches).take(plan.motors);
        let elsewhere = |side: &Side, touches: &Touches| {
            let pressed = if back { None } else { side.pressed_elsewhere(&plan, touches) };
            pressed.or_else(|| side.ended_elsewhere(&plan, touches, side.end()))
        };
        if let Some(fault) = sides.find_map(|(side, touches)| elsewhere(side, touches)) {
            return self.leave(fault);
        }
        if back {
            if self.touch == 0 {
                let press = self.touches.iter().take(plan.motors).map(Touches::first_press);
                self.plan.slow_down(press.fold(f64::INFINITY, f64::min));
            }
            self.touch += 1;
            self.start_touch();
        } else {
            self.conclude();
        }
    }

    #[cold]
    fn begin(&mut self, input: &HomingInput) {
        self.plan.moves_at(self.plan.approach);
        for (side, position) in self.sides.iter_mut().zip(input.position_mm) {
            side.begin(&self.plan, position);
        }
        self.old_limit = input.torque_limit;
        self.changed = true;
        self.request(GIB_HOMING_REQUEST_TORQUE_LIMIT, self.plan.limit);
        self.enter(Phase::Limit, f64::from(self.plan.ack_timeout));
    }

    /// Begins the next touch. All but the first end soon behind the stop found before.
    #[cold]
    fn start_touch(&mut self) {
        let speed = if self.touch == 0 { self.plan.approach } else { self.plan.touch };
        self.plan.moves_at(speed);
        let plan = &self.plan;
        for side in self.sides.iter_mut().take(plan.motors) {
            let beyond = side.travel(plan) + plan.retract + plan.press_max + plan.lag_limit;
            let reach = if self.touch == 0 { plan.reach() } else { beyond.min(plan.reach()) };
            side.start_touch(plan, speed, reach);
            if self.touch == 0 && self.now >= HELD {
                side.holds(plan, side.filtered);
            }
        }
        self.enter(Phase::Touch, f64::from(u32::MAX));
    }

    /// A touch that ended without a stop.
    #[cold]
    pub(super) fn untouched(&mut self, odd: Touch) {
        let plan = self.plan;
        let mut fault = Fault::NONE;
        for side in self.sides.iter().take(plan.motors) {
            let first = odd == Touch::Broken && fault == Fault::NONE && (side.rigid(&plan) || side.stuck(&plan));
            fault = if first { side.broken_sensor(&plan) } else { fault };
        }
        if fault == Fault::NONE {
            // All of it is gone; the stop must lie where the command goes.
            let (code, field) = (GIB_ERR_HOMING_NO_STOP, "distance_max_mm\0");
            fault = Fault { code, field, value: plan.distance[1], low: plan.distance[0], high: plan.reach() };
        }
        if fault.code == GIB_ERR_HOMING_NO_STOP && self.touch > 0 {
            // It was there the first time.
            fault = self.gone_beyond().unwrap_or(Fault { code: GIB_ERR_HOMING_TOUCHES, ..fault });
        }
        self.leave(fault);
    }

    /// By how much a motor has gone beyond where its first touch ended.
    fn gone_beyond(&self) -> Option<Fault> {
        let beyond = |(side, touches): (&Side, &Touches)| side.ended_elsewhere(&self.plan, touches, side.position);
        self.sides.iter().zip(&self.touches).take(self.plan.motors).find_map(beyond)
    }

    /// Every motor has pressed for the detection time.
    #[cold]
    pub(super) fn pressed(&mut self) {
        let plan = self.plan;
        if self.touch == 0 {
            let way = self.sides.iter().take(plan.motors).map(|side| side.travel(&plan)).fold(f64::INFINITY, f64::min);
            let early = |code, low| Fault { code, field: "distance_min_mm\0", value: way, low, high: plan.distance[1] };
            if let Some(side) = self.sides.iter().take(plan.motors).find(|side| side.stuck_high(&plan)) {
                return self.leave(side.name_stuck(&plan, plan.hold - 1));
            }
            if way < plan.retract {
                return self.leave(early(GIB_ERR_HOMING_ON_STOP, plan.retract));
            }
            if way < plan.distance[0] {
                return self.leave(early(GIB_ERR_HOMING_EARLY, plan.distance[0]));
            }
            self.event(GIB_HOMING_EVENT_LIMITING);
            self.touches.iter_mut().zip(&self.sides).for_each(|(touches, side)| touches.first_end = side.end());
        } else if let Some(fault) = self.sides.iter().take(plan.motors).find_map(|side| side.pressed_at_once(&plan)) {
            return self.leave(fault);
        }
        if self.touch < plan.touches {
            let mut bound = 0f64;
            for side in self.sides.iter_mut().take(plan.motors) {
                bound = bound.max(side.go(&plan, side.position - plan.sense * plan.retract, plan.back()));
            }
            return self.enter(Phase::Retract, bound);
        }
        // The command and the request to drop the undone way come in one cycle: to the kernel it is no motion.
        self.sides.iter_mut().take(plan.motors).for_each(|side| side.clear_lag(&plan));
        if plan.clear_by_request {
            self.event(GIB_HOMING_EVENT_CLEAR_REQUESTED);
            self.request(GIB_HOMING_REQUEST_CLEAR_DEVIATION, plan.limit);
            self.enter(Phase::Clear, f64::from(plan.ack_timeout));
        } else {
            self.cleared();
        }
    }

    /// The undone way is dropped: the command is where the axis is.
    #[cold]
    fn cleared(&mut self) {
        self.event(GIB_HOMING_EVENT_CLEARED);
        self.enter_evaluate();
    }

    /// All touches are evaluated: do they agree, and where is home?
    #[cold]
    fn conclude(&mut self) {
        self.plan.moves_at(self.plan.offset_speed.max(self.plan.touch));
        let plan = self.plan;
        // A side that the beam holds or pulls says more than that its touches disagree.
        if plan.motors == 2 {
            if let Err(fault) = self.squared() {
                return self.leave(fault);
            }
        }
        for i in 0..plan.motors.min(2) {
            if let Err(fault) = self.touches[i].agree(&plan) {
                return self.leave(fault);
            }
        }
        if plan.motors == 2 {
            self.reckon_beam();
        }
        let mut bound = 0f64;
        for i in 0..plan.motors.min(2) {
            let way = if plan.use_threshold { self.touches[i].threshold() } else { self.touches[i].contact() };
            let home = self.sides[i].start + plan.sense * (way - plan.offset);
            self.output.shift_mm[i] = plan.set_position - home;
            bound = bound.max(self.sides[i].go(&plan, home, plan.offset_speed));
        }
        self.event(GIB_HOMING_EVENT_OFFSET);
        self.enter(Phase::Offset, bound + SETTLES * plan.settling());
    }

    /// Off the stop: the coordinate is set and the old torque limit given back.
    #[cold]
    fn set(&mut self) {
        self.placing = true;
        self.request(GIB_HOMING_REQUEST_TORQUE_LIMIT | GIB_HOMING_REQUEST_SET_POSITION, self.old_limit);
        self.enter(Phase::Set, f64::from(self.plan.ack_timeout));
    }

    /// A cycle from the request to set the position on. Kernels add the shift at once or with their answer, or not at all; the axis has
    /// not moved by it, and is where it was last, nearly, with the shift taken off or without.
    #[cold]
    pub(super) fn place(&mut self, input: &HomingInput) {
        let mut input = *input;
        for ((told, shift), side) in input.position_mm.iter_mut().zip(self.output.shift_mm).zip(&self.sides) {
            let unshifted = *told - shift;
            if (unshifted - side.position).abs() < (*told - side.position).abs() {
                *told = unshifted;
            }
        }
        if self.phase == Phase::Set { self.work(&input) } else { self.exit(&input) }
    }

    /// Leaves for a fault: without a position to trust no move is safe, a faulted drive makes none, and one that gives more torque than
    /// it was told to is not to brake on what it presses on.
    #[cold]
    pub(super) fn leave(&mut self, fault: Fault) {
        // Flags that are not known (GIB_ERR_CONFIG) may say that the drive does not obey.
        let blind =
            [GIB_ERR_HOMING_ENCODER, GIB_ERR_DRIVE_FAULT, GIB_ERR_NON_FINITE, GIB_ERR_TORQUE_BOUND, GIB_ERR_CONFIG];
        self.leave_by(fault, blind.contains(&fault.code));
    }

    /// The one door out: keeps the first fault, brakes, unloads, restores, fails. `blind`: without a move.
    #[cold]
    pub(super) fn leave_by(&mut self, fault: Fault, blind: bool) {
        if matches!(self.phase, Phase::Stopping | Phase::Unload | Phase::Relieve | Phase::Restore) {
            return; // on the way out already
        }
        self.end_usual(); // an abort comes between two cycles
        self.fault = fault;
        self.output.message = fault.code;
        if blind {
            return self.stop_drive();
        }
        self.output.stop_drive = 0;
        if matches!(self.phase, Phase::Begin | Phase::Limit) {
            self.sides.iter_mut().for_each(|side| side.clear_lag(&self.plan));
            return self.restore();
        }
        let mut bound = 0f64;
        for side in self.sides.iter_mut().take(self.plan.motors) {
            bound = bound.max(side.brake());
        }
        self.stopped = false;
        self.enter(Phase::Stopping, bound);
    }

    /// Standing: goes back from whatever was pressed on, by the way that pressing may have wound up.
    #[cold]
    pub(super) fn unload(&mut self) {
        self.plan.moves_at(self.plan.approach.max(self.plan.offset_speed));
        let plan = self.plan;
        let mut bound = 0f64;
        if self.sides.iter().take(plan.motors).any(Side::dead) {
            return self.stop_drive();
        }
        // A gantry goes back with both motors, whichever is loaded: one alone would rack the beam.
        let behind = |side: &Side| plan.sense * (side.profile.position - side.position) > 0.1 * plan.press_max;
        let loaded = self.sides.iter().take(plan.motors).any(|side| side.pressing(&plan) || behind(side));
        let way = if loaded { plan.sense * plan.press_max } else { 0.0 };
        for side in self.sides.iter_mut().take(plan.motors) {
            // A command that stays ahead would wind the servo up against what it touches while the restore is waited for.
            // An axis that was flung beyond the largest way is brought back into it.
            let beyond = plan.sense * higher(side.travel(&plan) - plan.sense * way - plan.distance[1], 0.0);
            bound = bound.max(side.go(&plan, side.position - way - beyond, plan.approach));
            side.frozen_limit = plan.frozen(plan.approach);
        }
        self.enter(Phase::Unload, bound + plan.settling());
    }

    /// Last part of the door: gives the old torque limit back if it was changed.
    pub(super) fn restore(&mut self) {
        if self.changed {
            self.request(GIB_HOMING_REQUEST_TORQUE_LIMIT, self.old_limit);
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

    /// Asks the kernel for something; `limit` is the torque limit that shall be in force from then on.
    fn request(&mut self, requests: u32, limit: f64) {
        self.output.requests = requests;
        self.output.torque_limit = limit;
        self.output.request_id = self.output.request_id.wrapping_add(1).max(1);
    }

    /// True when the kernel has carried out the present request and the drive has the torque limit asked for. What
    /// needs no acknowledgement counts as carried out.
    #[inline(always)]
    pub(super) fn confirmed(&self, input: &HomingInput) -> bool {
        let wanted = self.output.requests & self.plan.acknowledged;
        let limits = wanted & GIB_HOMING_REQUEST_TORQUE_LIMIT != 0;
        wanted == 0
            || (input.acknowledged_id == self.output.request_id && (!limits || self.limited(input.torque_limit)))
    }

    /// Whether the limit in force is the one asked for, within a hundredth.
    #[inline(always)]
    pub(super) fn limited(&self, told: f64) -> bool {
        (told - self.output.torque_limit).abs() <= 0.01 * self.output.torque_limit.abs()
    }

    /// Tells an event, once.
    pub(super) fn event(&mut self, event: u32) {
        self.output.new_events |= event & !self.output.events;
        self.output.events |= event;
    }

    /// Goes to a state that must end within `cycles`, and within the time limit unless it is on the way out.
    pub(super) fn enter(&mut self, phase: Phase, cycles: f64) {
        self.phase = phase;
        self.quick = matches!(phase, Phase::Touch | Phase::Retract | Phase::Offset);
        let out = matches!(phase, Phase::Stopping | Phase::Unload | Phase::Relieve | Phase::Restore);
        let last = if out { u32::MAX } else { self.end };
        self.deadline = self.now.saturating_add((cycles + 1.0) as u32).min(last);
        self.output.phase = match phase {
            Phase::Idle => GIB_HOMING_IDLE,
            Phase::Begin | Phase::Limit => GIB_HOMING_LIMIT,
            Phase::Touch => GIB_HOMING_TOUCH,
            Phase::Retract => GIB_HOMING_RETRACT,
            Phase::Clear => GIB_HOMING_CLEAR,
            Phase::Evaluate => GIB_HOMING_EVALUATE,
            Phase::Offset => GIB_HOMING_OFFSET,
            Phase::Set => GIB_HOMING_SET,
            Phase::Stopping => GIB_HOMING_STOPPING,
            Phase::Unload | Phase::Relieve => GIB_HOMING_UNLOAD,
            Phase::Restore => GIB_HOMING_RESTORE,
            Phase::Done => GIB_HOMING_DONE,
            Phase::Failed => GIB_HOMING_FAILED,
        };
        let resting = matches!(phase, Phase::Idle | Phase::Done | Phase::Failed);
        self.output.owns_motion = i32::from(!resting && phase != Phase::Begin);
        if resting {
            self.output.target_speed_mm_s = [0.0; 2];
        }
        self.output.status = match phase {
            Phase::Idle => GIB_OK,
            Phase::Done => GIB_DONE,
            _ => GIB_BUSY,
        };
    }
}
