//! Learning, one call per servo cycle.
//!
//! ```text
//! Idle → Settle → Measure → Analyse → Update → Synthesise → [Smooth →] Blend → Settle …
//!                              └─ within the tolerance ─▶ Done
//! a deviation that grows, too many updates ──▶ back to the best correction by the same way, then Failed, which keeps it
//! fault, abort, a wild deviation ──▶ leave: Stopping (fades out) → Failed
//! ```
//!
//! The command is target + presence · correction(θ). Nothing it does is a jump: a correction is replaced by blending over a
//! revolution, the presence fades, and the sum changes by a bounded step a cycle. Whatever happens there is a command.

mod evaluate;
mod held;
mod out;
mod quick;
mod watch;

use super::config::GIB_LEARNING_HARMONICS;
use super::io::*;
use super::lines::Line;
use super::plan::Plan;
use super::points::{Bin, Cell, ENTRIES, Place, Table, Weight};
use crate::cycle::backlash::io::flagged;
use crate::cycle::turns::{fold, folded};
use crate::cycle::vibration::harmonic::Harmonics;
use crate::error::*;
use quick::Usual;
use watch::{KEPT, Watch};

/// Where the machine is. Each comment says what ends the state; those that wait have `wait_s` as their deadline.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Phase {
    /// Ends with `start`.
    Idle,
    /// Ends when the machine has settled for the revolutions asked for, and the points are empty.
    Settle,
    /// Ends with the last whole revolution.
    Measure,
    /// Ends with the last point.
    Analyse,
    /// Ends with the last harmonic, or point.
    Update,
    /// Ends with the last point.
    Synthesise,
    /// Ends with the last point: slopes of a correction that has no harmonics.
    Smooth,
    /// Ends after a revolution.
    Blend,
    /// Ends with the next `start`, or an abort.
    Done,
    /// Ends when the correction has faded out.
    Stopping,
    /// Ends with the next `start`.
    Failed,
}

/// Share of a cycle's turn in the speed that says whether the spindle turns.
const SPEED_SHARE: f64 = 0.05;
/// A deviation that is no deviation but the lack of a position, mm.
const NOWHERE: f64 = 1e12;
/// Points that a cycle empties.
const EMPTIED: usize = 8;
/// Added and taken away, this leaves nothing that could become subnormal.
const FLUSH: f64 = 1e-12;

/// Learning of one axis: plain data, no pointers.
#[derive(Debug, Clone)]
pub struct Learning {
    plan: Plan,
    phase: Phase,
    fault: Fault,
    /// Angle of the last cycle, and filtered turns per cycle.
    angle: f64,
    rate: f64,
    /// An angle has been read.
    known: bool,
    /// The cycles that are all alike.
    usual: Usual,
    /// Turns and cycles in this phase; point or harmonic that is worked on.
    progress: f64,
    cycles: u64,
    at: usize,
    /// Cycles in which learning waited.
    waited: u64,
    /// Part of the correction that is in force.
    presence: f64,
    /// Part of the table that comes that is in force. At 1 that table is copied to the other, with all of it in force.
    blend: f64,
    /// Correction and command put out last.
    correction: f64,
    command: f64,
    reasons: u32,
    /// The table that comes is the last one; then the fault, if any, is told.
    last_update: bool,
    grown: u32,
    /// The last measurement cannot be compared with one before; it is the best so far.
    fresh: bool,
    better: bool,
    /// Speed of the last measurement, turns per cycle; and how the present one differs from it.
    speed: f64,
    watch: Watch,
    report: LearningReport,
    /// Sums of an analysis.
    turns: f64,
    squares: f64,
    spectrum: Harmonics,
    steep: Harmonics,
    lines: [Line; GIB_LEARNING_HARMONICS],
    /// Deviation at each point in the last analysis, µm; and the best correction, for the method without harmonics.
    seen: [f32; ENTRIES],
    best: [f32; ENTRIES],
    bins: [Bin; ENTRIES],
    weights: [Weight; ENTRIES],
    /// The table in force, and the one that comes; and the most that either changes from a point to the next, µm.
    force: Table,
    coming: Table,
    steepest: f64,
    steepest_coming: f64,
}

impl Default for Learning {
    fn default() -> Learning {
        Learning {
            plan: Plan::REST,
            phase: Phase::Idle,
            fault: Fault::NONE,
            angle: 0.0,
            rate: 0.0,
            known: false,
            usual: Usual::NONE,
            progress: 0.0,
            cycles: 0,
            at: 0,
            waited: 0,
            presence: 0.0,
            blend: 0.0,
            correction: 0.0,
            command: 0.0,
            reasons: 0,
            last_update: false,
            grown: 0,
            fresh: true,
            better: false,
            speed: 0.0,
            watch: Watch::NEAR,
            report: LearningReport::default(),
            turns: 0.0,
            squares: 0.0,
            spectrum: Harmonics::default(),
            steep: Harmonics::default(),
            lines: [Line::default(); GIB_LEARNING_HARMONICS],
            seen: [0.0; ENTRIES],
            best: [0.0; ENTRIES],
            bins: [Bin::default(); ENTRIES],
            weights: [Weight::default(); ENTRIES],
            force: [Cell::default(); ENTRIES],
            coming: [Cell::default(); ENTRIES],
            steepest: 0.0,
            steepest_coming: 0.0,
        }
    }
}

impl Learning {
    /// Begins to learn, with the next step.
    ///
    /// # Errors
    /// `GIB_ERR_STATE` while busy, `GIB_ERR_CONFIG` with the field; `resume` needs a correction of as many points.
    pub fn start(&mut self, plan: Result<Plan, Fault>) -> Result<(), Fault> {
        if self.busy() {
            return Err(Fault::of(GIB_ERR_STATE));
        }
        let plan = plan?;
        self.settle_usual();
        let held = f64::from(self.report.points);
        if plan.resume && held == 0.0 {
            return Err(Fault { field: "resume\0", value: 1.0, ..Fault::of(GIB_ERR_CONFIG) });
        }
        if plan.resume && held != plan.scale {
            return Err(Fault { code: GIB_ERR_CONFIG, field: "points\0", value: plan.scale, low: held, high: held });
        }
        if plan.resume {
            self.force = *self.held();
            self.steepest = self.steepest.max(self.steepest_coming);
        } else {
            (self.force, self.steepest) = ([Cell::default(); ENTRIES], 0.0);
            self.best = [0.0; ENTRIES];
            self.lines = [Line::default(); GIB_LEARNING_HARMONICS];
            (self.seen, self.bins) = ([0.0; ENTRIES], [Bin::default(); ENTRIES]);
            self.report.correction_um = 0.0;
        }
        self.plan = plan;
        self.blend = 0.0;
        self.fault = Fault::NONE;
        (self.known, self.rate, self.speed) = (false, 0.0, 0.0);
        (self.waited, self.grown, self.last_update, self.fresh) = (0, 0, false, true);
        let correction_um = self.report.correction_um;
        self.report = LearningReport { points: plan.points as i32, correction_um, ..LearningReport::default() };
        if plan.resume {
            self.take_up();
        }
        self.enter(Phase::Settle);
        Ok(())
    }

    /// Takes the correction out, and fails with `GIB_ERR_ABORTED`. Nothing when there is none and nothing runs.
    pub fn abort(&mut self) {
        if self.busy() || self.holds() {
            self.leave(Fault::of(GIB_ERR_ABORTED));
        }
    }

    /// True from `start` until Done or Failed.
    #[must_use]
    pub fn busy(&self) -> bool {
        !matches!(self.phase, Phase::Idle | Phase::Done | Phase::Failed)
    }

    /// Whether a correction stays in force though nothing is learnt any more.
    #[must_use]
    pub fn holds(&self) -> bool {
        let kept = matches!(self.fault.code, GIB_ERR_LEARNING_GROWS | GIB_ERR_LEARNING_UPDATES);
        self.phase == Phase::Done || (self.phase == Phase::Failed && kept)
    }

    /// First fault of the present run.
    #[must_use]
    pub fn fault(&self) -> Fault {
        self.fault
    }

    /// Command put out last, mm.
    #[must_use]
    pub fn command(&self) -> f64 {
        self.command
    }

    /// How far it has come.
    #[must_use]
    pub fn report(&self) -> LearningReport {
        LearningReport { status: self.status(), ..self.report }
    }

    /// One servo cycle; returns the status.
    #[inline(always)]
    pub fn step(&mut self, input: &LearningInput, output: &mut LearningOutput) -> i32 {
        if let Some(status) = self.quick(input, output) {
            return status;
        }
        if self.phase == Phase::Idle && self.idle(input, output) {
            return GIB_OK;
        }
        if let Some(status) = self.quick_steep(input, output) {
            return status;
        }
        self.careful(input, output)
    }

    /// Any cycle, with all that can happen in one.
    #[inline(never)]
    fn careful(&mut self, input: &LearningInput, output: &mut LearningOutput) -> i32 {
        if self.turn_over(input.angle_deg) {
            if let Some(status) = self.quick(input, output).or_else(|| self.quick_steep(input, output)) {
                return status;
            }
        }
        self.settle_usual();
        self.any(input);
        *output = LearningOutput {
            command_mm: self.command,
            correction_um: self.correction,
            status: GIB_BUSY,
            phase: GIB_LEARNING_MEASURE,
            message: GIB_OK,
            reasons: self.reasons,
        };
        if self.phase != Phase::Measure {
            self.explain(output);
        }
        self.see_usual(input, output);
        output.status
    }

    fn any(&mut self, input: &LearningInput) {
        if !input.target_mm.is_finite() {
            return self.blind(input.target_mm);
        }
        if !self.busy() && !self.holds() {
            // What a load has left of a correction that was kept.
            self.correction -= self.correction.max(-self.plan.slope).min(self.plan.slope);
            self.presence = 0.0;
            self.command = input.target_mm + 1e-3 * self.correction;
            return;
        }
        if input.flags != 0 && self.phase != Phase::Stopping {
            self.leave(flagged(input.flags));
        }
        let turned = self.turn(input.angle_deg);
        let left = input.target_mm - input.detected_mm;
        self.judge(left);
        if self.busy() && self.phase != Phase::Stopping {
            self.wait_or_work(turned, left, input.target_mm);
        } else if self.phase != Phase::Stopping {
            self.watch(turned);
        }
        self.put_out(input.target_mm);
    }

    /// Follows the spindle; an angle that cannot be is named, and the spindle taken to turn on as before.
    fn turn(&mut self, angle_deg: f64) -> f64 {
        let angle = fold(angle_deg * (1.0 / 360.0));
        // 0 in the first cycle, and no number where the angle is none.
        let turned = if self.known { fold(angle - self.angle) } else { 0.0 * angle };
        self.reasons = 0;
        if turned.abs() <= self.plan.turn_max {
            self.known = true;
            self.angle = angle;
            self.rate = (self.rate + SPEED_SHARE * (turned - self.rate) + FLUSH) - FLUSH;
            return turned;
        }
        self.reasons = GIB_LEARNING_BAD_ANGLE;
        self.angle = if angle.is_finite() { angle } else { fold(self.angle + self.rate) };
        self.rate
    }

    /// Whether spindle and detected position will do in this cycle.
    fn judge(&mut self, left: f64) {
        if self.rate.abs() < self.plan.rate_min {
            self.reasons |= GIB_LEARNING_NO_ROTATION;
        }
        if !(left.abs() < NOWHERE) {
            self.reasons |= GIB_LEARNING_NOT_DETECTED;
        } else if left.abs() > self.plan.deviation && self.phase != Phase::Stopping {
            let (value, most) = (1e3 * left, 1e3 * self.plan.deviation);
            let code = GIB_ERR_LEARNING_DEVIATION;
            self.leave(Fault { code, field: "detected_mm\0", value, low: -most, high: most });
        }
    }

    /// The state's own work; what was measured beside a bad input is worth nothing.
    fn wait_or_work(&mut self, turned: f64, left: f64, target: f64) {
        if self.reasons != 0 {
            self.waited += 1;
            if self.waited > self.plan.wait {
                return self.leave(Fault::of(GIB_ERR_DEADLINE));
            }
            if matches!(self.phase, Phase::Settle | Phase::Measure) {
                self.enter(Phase::Settle);
            }
        } else {
            self.waited = 0;
        }
        match self.phase {
            Phase::Settle if self.reasons == 0 => self.settle(turned),
            Phase::Measure => self.measure(turned, left, target),
            Phase::Blend => self.blend(turned),
            Phase::Analyse | Phase::Update | Phase::Synthesise | Phase::Smooth => self.evaluate(),
            _ => {}
        }
    }

    fn settle(&mut self, turned: f64) {
        for _ in 0..EMPTIED {
            self.empty(self.at & (ENTRIES - 1));
            self.at = (self.at + 1).min(self.plan.points + 1);
        }
        if self.at > self.plan.points && self.blend == 1.0 {
            (self.blend, self.steepest) = (0.0, self.steepest_coming);
        }
        self.progress += turned.abs();
        // The correction must be there in full before what it does is measured.
        if self.progress >= self.plan.settle && self.at > self.plan.points && self.presence == 1.0 {
            self.enter(Phase::Measure);
        }
    }

    /// Nothing is measured at a point, and a new table's cell is in force.
    fn empty(&mut self, entry: usize) {
        (self.bins[entry], self.weights[entry]) = (Bin::default(), Weight::default());
        if self.blend == 1.0 {
            self.force[entry] = self.coming[entry];
        }
    }

    fn measure(&mut self, turned: f64, left: f64, target: f64) {
        let entry = Place::of(self.angle, self.plan.scale).entry & (ENTRIES - 1);
        // A spindle that turns has a rate, which is not 0.
        let weight = (turned / self.rate).abs() as f32;
        let bin = &mut self.bins[entry];
        bin.deviation += f64::from(weight) * left;
        bin.target = target;
        self.weights[entry].sum += weight;
        self.progress += turned.abs();
        self.cycles += 1;
        if self.progress >= self.plan.measure {
            self.speed_seen();
            self.enter(Phase::Analyse);
        }
    }

    fn blend(&mut self, turned: f64) {
        self.progress += turned.abs();
        self.blend = self.progress.min(1.0);
        if self.blend == 1.0 {
            if self.last_update {
                return self.enter(Phase::Failed);
            }
            self.enter(Phase::Settle);
        }
    }

    /// Command of a cycle: the correction at this angle, as far as it is present, by a bounded step from the last.
    fn put_out(&mut self, target: f64) {
        let away = self.reasons & (GIB_LEARNING_NO_ROTATION | GIB_LEARNING_BAD_ANGLE) != 0;
        let wanted = self.phase != Phase::Stopping && !away && !self.watch.far;
        let presence = self.presence + if wanted { self.plan.fade } else { -self.plan.fade };
        self.presence = presence.clamp(0.0, 1.0);
        let place = Place::of(self.angle, self.plan.scale);
        let (now, next) = (place.read(&self.force), place.read(&self.coming));
        // From point to point it goes along tangents, which reach beyond the points' own bound.
        let whole = (now + self.blend * (next - now)).max(-self.plan.most).min(self.plan.most);
        let correction = self.presence * whole;
        let most = self.plan.slope;
        self.correction += (correction - self.correction).max(-most).min(most);
        self.correction = (self.correction + 1e-10) - 1e-10;
        self.command = target + 1e-3 * self.correction;
        self.end_of_stopping();
    }

    /// The one door out.
    fn leave(&mut self, fault: Fault) {
        self.fault = fault;
        self.enter(Phase::Stopping);
    }

    fn enter(&mut self, phase: Phase) {
        self.settle_usual();
        self.phase = phase;
        (self.progress, self.cycles, self.at) = (0.0, 0, 0);
        self.watch = Watch::NEAR;
    }

    fn status(&self) -> i32 {
        match self.phase {
            Phase::Idle => GIB_OK,
            Phase::Done => GIB_DONE,
            Phase::Failed => self.fault.code,
            _ => GIB_BUSY,
        }
    }

    /// What the output says in a phase that is not the usual one.
    #[inline(never)]
    fn explain(&self, output: &mut LearningOutput) {
        // One match for both: a second one would leave the arms that the first has taken as traps.
        (output.status, output.phase) = match self.phase {
            Phase::Idle => (GIB_OK, GIB_LEARNING_IDLE),
            Phase::Settle if self.reasons != 0 => (GIB_BUSY, GIB_LEARNING_WAITING),
            Phase::Settle => (GIB_BUSY, GIB_LEARNING_SETTLE),
            Phase::Measure => (GIB_BUSY, GIB_LEARNING_MEASURE),
            Phase::Analyse | Phase::Update | Phase::Synthesise | Phase::Smooth => (GIB_BUSY, GIB_LEARNING_EVALUATE),
            Phase::Blend => (GIB_BUSY, GIB_LEARNING_BLEND),
            Phase::Done => (GIB_DONE, GIB_LEARNING_DONE),
            Phase::Stopping => (GIB_BUSY, GIB_LEARNING_STOPPING),
            Phase::Failed => (self.fault.code, GIB_LEARNING_FAILED),
        };
        output.message = if output.phase == GIB_LEARNING_STOPPING || output.phase == GIB_LEARNING_FAILED {
            self.fault.code
        } else if self.reasons & GIB_LEARNING_BAD_ANGLE != 0 {
            GIB_ERR_LEARNING_ANGLE
        } else if self.reasons & GIB_LEARNING_NOT_DETECTED != 0 {
            GIB_ERR_LEARNING_DETECTED
        } else {
            GIB_OK
        };
    }
}
