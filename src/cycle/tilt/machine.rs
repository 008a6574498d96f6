//! The state machine of tilt: one call per servo cycle.
//!
//! ```text
//! Idle → Measuring → Evaluate → Warning → RampOn → Active → RampOff → Done
//!                       └────── in the band, not significant, taught ─────▶ Done
//!          any state ──fault, abort, deadline, refusal──▶ leave: RampOff → Failed
//! ```
//!
//! `leave` is the one door out: it takes every offset out within the bounds of speed and acceleration. Until the operator
//! has accepted the warning no offset is put out. Offsets in force end by `GIB_TILT_INPUT_OFF`, an abort or a fault.

mod danger;
mod quick;

use super::config::*;
use super::fit::Fit;
use super::follow::Follower;
use super::io::*;
use super::kinematics::{ITERATIONS, Offsets, Search};
use super::load::Collector;
use super::plan::Plan;
use super::trace::Trace;
use super::verdict::*;
use crate::cycle::backlash::io::{GIB_INPUT_ABORT, GIB_INPUT_FAULT};
use crate::error::*;
use danger::danger;
use quick::Usual;
use wide::f64x2;

/// Where the machine is. Each comment says what ends the state.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Phase {
    /// Ends with `start`.
    Idle,
    /// Ends with `GIB_TILT_INPUT_END`, or when the time in the cut or out of it is used up.
    Measuring,
    /// Ends when all slices are done.
    Evaluate(Work),
    /// Ends when the operator accepts, declines, or does not answer in time.
    Warning,
    /// Ends when every offset has met its target, or did not in time.
    RampOn,
    /// Ends with `GIB_TILT_INPUT_OFF`, an abort or a fault.
    Active,
    /// Ends when every offset is 0, which the bounds of the offsets make certain.
    RampOff,
    /// Ends with the next `start`.
    Done,
    /// Ends with the next `start`.
    Failed,
}

/// What a slice of the evaluation does.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Work {
    Fit,
    Judge,
    Search(u32),
    Conclude,
}

/// Tilt of one workpiece: plain data, no pointers.
#[derive(Debug, Clone)]
pub struct Tilt {
    plan: Plan,
    phase: Phase,
    /// First fault of this run.
    fault: Fault,
    /// Cycles left in the cut, out of it, and in the present state.
    cut_left: u32,
    air_left: u32,
    left: u32,
    /// What the cycles are that are all alike, and for how many more they can be, of how many.
    usual: Usual,
    /// Z follows the path, and all other offsets rest.
    following: bool,
    /// Largest z offset and largest step of a usual cycle; largest sum of an input, and largest change of a step.
    bounds: [f64x2; 2],
    alike: u32,
    granted: u32,
    /// The tool is in the cut, and `block` under way.
    cutting: bool,
    /// Something was cut: `start` holds where the path began, and the angles a b c there.
    begun: bool,
    start: [f64; 3],
    angles: [f64; 3],
    block: Collector,
    fit: Fit,
    search: Search,
    /// Offsets to be put out; z's is a plane over machine coordinates: constant, along x, along y.
    offsets: Offsets,
    plane: [f64; 3],
    /// x y z a b c.
    followers: [Follower; 6],
    /// All but z rest on their targets.
    others_rest: bool,
    /// So they do, z is met and not limited.
    settled: bool,
    report: TiltReport,
    output: TiltOutput,
    trace: Trace,
}

impl Default for Tilt {
    fn default() -> Tilt {
        Tilt {
            plan: Plan::REST,
            phase: Phase::Idle,
            fault: Fault::NONE,
            cut_left: 0,
            air_left: 0,
            left: 0,
            usual: Usual::Rest,
            following: false,
            bounds: [f64x2::ZERO; 2],
            alike: 0,
            granted: 0,
            cutting: false,
            begun: false,
            start: [0.0; 3],
            angles: [0.0; 3],
            block: Collector::default(),
            fit: Fit::REST,
            search: Search::REST,
            offsets: Offsets::default(),
            plane: [0.0; 3],
            followers: [Follower::default(); 6],
            others_rest: false,
            settled: false,
            report: TiltReport::default(),
            output: TiltOutput::default(),
            trace: Trace::default(),
        }
    }
}

impl Tilt {
    /// Arms a measurement; it begins when the tool is in the cut.
    ///
    /// # Errors
    /// `GIB_ERR_STATE` while busy, else what the plan was refused for.
    pub fn start(&mut self, plan: Result<Plan, Fault>) -> Result<(), Fault> {
        if self.busy() {
            return Err(Fault::of(GIB_ERR_STATE));
        }
        self.plan = plan?;
        self.fault = Fault::NONE;
        (self.cut_left, self.air_left) = (self.plan.time_limit, self.plan.time_limit);
        (self.cutting, self.begun, self.settled, self.others_rest) = (false, false, false, false);
        (self.alike, self.granted) = (0, 0);
        self.trace.clear([0.0; 2]);
        self.fit = Fit::REST;
        self.report = TiltReport::default();
        self.followers = [Follower::default(); 6];
        self.output = TiltOutput { request_id: self.output.request_id, ..TiltOutput::default() };
        self.enter(Phase::Measuring);
        Ok(())
    }

    /// Aborts: takes the offsets out, then fails with `GIB_ERR_ABORTED`. Nothing when not busy.
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
    pub fn output(&self) -> &TiltOutput {
        &self.output
    }

    /// First fault of the present run.
    #[must_use]
    pub fn fault(&self) -> Fault {
        self.fault
    }

    /// What was found.
    #[must_use]
    pub fn report(&self) -> TiltReport {
        TiltReport { status: self.output.status, ..self.report }
    }

    /// A cycle in which anything can happen.
    fn any(&mut self, input: &TiltInput) {
        if !self.busy() {
            return;
        }
        // The door leads on to a ramp that begins in this very cycle: an offset that stood still for one would jerk.
        if let Some(fault) = danger(input) {
            self.leave(fault);
        }
        match self.phase {
            Phase::Measuring => self.measure(input),
            Phase::Evaluate(work) => self.evaluate(work),
            Phase::Warning => self.warn(input),
            Phase::RampOn => self.ramp_on(input),
            Phase::Active => self.follow(input),
            Phase::RampOff => self.ramp_off(),
            Phase::Idle | Phase::Done | Phase::Failed => {}
        }
    }

    /// A cycle of the path in which a block or a pass begins or ends, or the tool is out of the cut.
    fn measure(&mut self, input: &TiltInput) {
        self.trace.leave();
        let cutting = input.flags & GIB_TILT_INPUT_CUTTING != 0;
        if let Some(fault) = if cutting && self.begun { self.turned(input) } else { None } {
            return self.leave(fault);
        }
        if cutting && !self.cutting {
            self.begin_pass(input);
        } else if cutting {
            if !self.block.quick(&self.plan, input) {
                if let Some(mean) = self.block.close(&self.plan, input) {
                    self.trace.take(&self.plan, &mean, self.plan.purpose == GIB_TILT_TEACH);
                }
            }
        } else if self.cutting {
            self.trace.end_pass(&self.plan);
        }
        self.cutting = cutting;
        let left = if cutting { &mut self.cut_left } else { &mut self.air_left };
        let over = *left == 0;
        *left = left.saturating_sub(1);
        if input.flags & GIB_TILT_INPUT_OFF != 0 {
            self.leave(Fault::of(GIB_ERR_ABORTED));
        } else if input.flags & GIB_TILT_INPUT_END != 0 {
            if cutting {
                self.trace.end_pass(&self.plan);
            }
            self.enter(Phase::Evaluate(Work::Fit));
            self.fit.begin(self.plan.wear);
        } else if over {
            self.leave(Fault { code: GIB_ERR_DEADLINE, field: "time_limit_s\0", ..Fault::NONE });
        }
    }

    fn begin_pass(&mut self, input: &TiltInput) {
        if self.begun {
            self.trace.begin_pass();
        } else {
            let [x, y, _] = input.position_mm;
            self.trace.clear([x, y]);
            self.start = input.position_mm;
            self.angles = input.rotary_deg;
            self.begun = true;
        }
        self.block = Collector::begin(&self.plan, input, 1.0);
    }

    /// A slice of the evaluation.
    fn evaluate(&mut self, work: Work) {
        if self.trace.leave() {
            return;
        }
        match work {
            Work::Fit => {
                if self.fit.step(self.trace.blocks_mut()) {
                    self.phase = Phase::Evaluate(Work::Judge);
                }
            }
            Work::Judge => self.judge(),
            Work::Search(left) => {
                self.search.step();
                self.phase = Phase::Evaluate(if left > 1 { Work::Search(left - 1) } else { Work::Conclude });
            }
            Work::Conclude => self.conclude(),
        }
    }

    fn judge(&mut self) {
        if let Err(fault) = trusted(&self.plan, &self.trace, &self.fit) {
            self.report = counted(&self.trace, &self.fit);
            return self.leave(fault);
        }
        if self.plan.purpose == GIB_TILT_TEACH {
            self.report = taught(&self.trace, &self.fit);
            return self.enter(Phase::Done);
        }
        self.report = report(&self.plan, &self.trace, &self.fit);
        if self.plan.purpose != GIB_TILT_COMPENSATE || self.report.decision != GIB_TILT_SIGNIFICANT {
            return self.enter(Phase::Done);
        }
        let slope = [self.report.slope_x_ratio, self.report.slope_y_ratio];
        self.search = Search::new(&self.plan.rotary, &self.angles, slope);
        self.phase = Phase::Evaluate(Work::Search(ITERATIONS));
    }

    /// The offsets, if they are within their bounds everywhere on the path; then the warning.
    fn conclude(&mut self) {
        let depth = self.fit.at(0.0, 0.0);
        let [x, y, z] = self.start;
        self.offsets = self.search.offsets(&[x, y, z + depth], self.plan.tool_centre_point);
        if self.plan.nominal_depth > 0.0 {
            self.offsets.linear[2] += depth - self.plan.nominal_depth;
        }
        let [gx, gy] = self.offsets.slope;
        self.plane = [self.offsets.linear[2] - gx * x - gy * y, gx, gy];
        let [[x0, x1], [y0, y1]] = self.fit.extent();
        let z = |x: f64, y: f64| (self.offsets.linear[2] + gx * x + gy * y).abs();
        let largest = z(x0, y0).max(z(x0, y1)).max(z(x1, y0)).max(z(x1, y1));
        let [a, b, c] = self.offsets.angular.map(f64::abs);
        let size = |field, value: f64, high: f64| Fault { code: GIB_ERR_TILT_SIZE, field, value, low: -high, high };
        let linear = largest.max(self.offsets.linear[0].abs()).max(self.offsets.linear[1].abs());
        let angular = a.max(b).max(c);
        if !(linear <= self.plan.linear.most) {
            return self.leave(size("offset_max_mm\0", linear, self.plan.linear.most));
        }
        if !(angular <= self.plan.angular.most) {
            return self.leave(size("offset_max_deg\0", angular, self.plan.angular.most));
        }
        self.report.offset_mm = self.offsets.linear;
        self.report.offset_deg = self.offsets.angular;
        self.report.z_slope_ratio = self.offsets.slope;
        self.output.request_id = self.output.request_id.wrapping_add(1).max(1);
        self.output.warning = 1;
        self.left = self.plan.ack_timeout;
        self.enter(Phase::Warning);
    }

    fn warn(&mut self, input: &TiltInput) {
        if input.flags & GIB_TILT_INPUT_OFF != 0 {
            self.report.decision = GIB_TILT_DECLINED;
            self.enter(Phase::Done);
        } else if input.acknowledged_id == self.output.request_id {
            if let Some(fault) = self.turned(input) {
                return self.leave(fault);
            }
            let time = |bounds: &super::follow::Bounds| {
                bounds.most / bounds.speed
                    + 4.0 * bounds.speed / bounds.acceleration
                    + 4.0 * (bounds.most / bounds.acceleration).sqrt()
            };
            // Four times what a ramp to the largest offsets takes while z's target moves with the path.
            let ramp = time(&self.plan.linear).max(time(&self.plan.angular));
            self.left = (4.0 * ramp + 100.0) as u32;
            self.enter(Phase::RampOn);
        } else if self.left == 0 {
            let wanted = f64::from(self.output.request_id);
            let value = f64::from(input.acknowledged_id);
            let field = "acknowledged_id\0";
            self.leave(Fault { code: GIB_ERR_ACK_TIMEOUT, field, value, low: wanted, high: wanted });
        } else {
            self.left -= 1;
        }
    }

    /// Where z's offset belongs at a position; kept out of the subnormal numbers.
    #[inline(always)]
    fn z_target(&self, input: &TiltInput) -> f64 {
        let [at, gx, gy] = self.plane;
        (at + gx * input.position_mm[0] + gy * input.position_mm[1] + 1e-3) - 1e-3
    }

    /// Moves every offset toward its target; true when all are there.
    fn toward(&mut self, linear: [f64; 3], angular: [f64; 3]) -> bool {
        let mut there = true;
        let targets = linear.into_iter().chain(angular);
        for (i, (follower, target)) in self.followers.iter_mut().zip(targets).enumerate() {
            let bounds = if i < 3 { &self.plan.linear } else { &self.plan.angular };
            there &= follower.step(target, bounds);
        }
        let [x, y, z, a, b, c] = self.followers.map(|follower| follower.value);
        self.output.offset_mm = [x, y, z];
        self.output.offset_deg = [a, b, c];
        there
    }

    /// A cycle with offsets in force that is not a quick one.
    fn bring_in(&mut self, input: &TiltInput) -> bool {
        let most = self.plan.linear.most;
        let wanted = self.z_target(input);
        let z = wanted.max(-most).min(most);
        let [x, y, _] = self.offsets.linear;
        self.output.limited = i32::from(z != wanted);
        if self.others_rest && self.phase == Phase::Active {
            let there = self.followers[2].step(z, &self.plan.linear);
            self.output.offset_mm[2] = self.followers[2].value;
            self.settled = there && z == wanted;
            return there;
        }
        let there = self.toward([x, y, z], self.offsets.angular);
        let rest = self.followers.iter().enumerate().all(|(i, follower)| i == 2 || follower.rests());
        self.others_rest = there && rest;
        self.settled = there && rest && z == wanted;
        there && rest
    }

    fn ramp_on(&mut self, input: &TiltInput) {
        if input.flags & GIB_TILT_INPUT_OFF != 0 {
            return self.take_out();
        }
        if let Some(fault) = self.turned(input) {
            self.leave(fault);
            if self.phase == Phase::RampOff {
                self.ramp_off();
            }
            return;
        }
        if self.bring_in(input) {
            self.enter(Phase::Active);
        } else if self.left == 0 {
            self.leave(Fault { code: GIB_ERR_DEADLINE, field: "offset_speed_mm_s\0", ..Fault::NONE });
        } else {
            self.left -= 1;
        }
    }

    fn follow(&mut self, input: &TiltInput) {
        if input.flags & GIB_TILT_INPUT_OFF != 0 {
            self.take_out();
        } else {
            self.bring_in(input);
        }
    }

    /// The offsets are no longer wanted.
    fn take_out(&mut self) {
        self.enter(Phase::RampOff);
        self.ramp_off();
    }

    fn ramp_off(&mut self) {
        self.output.limited = 0;
        if self.toward([0.0; 3], [0.0; 3]) && self.followers.iter().all(Follower::rests) {
            self.enter(if self.fault == Fault::NONE { Phase::Done } else { Phase::Failed });
        }
    }

    /// The one door out: offsets in force are taken out within their bounds.
    fn leave(&mut self, fault: Fault) {
        if self.fault == Fault::NONE {
            self.fault = fault;
        }
        self.output.message = self.fault.code;
        let clear = self.followers.iter().all(|follower| follower.value == 0.0 && follower.rate == 0.0);
        self.enter(if clear { Phase::Failed } else { Phase::RampOff });
    }

    fn enter(&mut self, phase: Phase) {
        self.unfollow();
        (self.phase, self.usual) = (phase, Usual::None);
        self.output.warning = i32::from(phase == Phase::Warning);
        self.output.phase = match phase {
            Phase::Idle => GIB_TILT_IDLE,
            Phase::Measuring => GIB_TILT_MEASURING,
            Phase::Evaluate(_) => GIB_TILT_EVALUATE,
            Phase::Warning => GIB_TILT_WARNING,
            Phase::RampOn => GIB_TILT_RAMP_ON,
            Phase::Active => GIB_TILT_ACTIVE,
            Phase::RampOff => GIB_TILT_RAMP_OFF,
            Phase::Done => GIB_TILT_DONE,
            Phase::Failed => GIB_TILT_FAILED,
        };
        self.output.status = match phase {
            Phase::Idle => GIB_OK,
            Phase::Done => GIB_DONE,
            Phase::Failed => self.fault.code,
            _ => GIB_BUSY,
        };
    }
}
