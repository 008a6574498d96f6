//! The state machine of a lost-motion measurement: one call per servo cycle.
//!
//! ```text
//! Idle → Begin → Clear → for each reversal (Approach → SlideBack → SlideIn → CreepIn → Settle → Scan → Unwind → ProbeBack → Unwind →
//!                                   ProbeForth → Rest → Evaluate) → Write → Done
//!          any state ──fault, abort, deadline, refusal──▶ leave: Stopping → Restore → Failed
//! ```
//!
//! `leave` is the one door out. Every state but Idle, Done and Failed has a deadline in cycles, set when the
//! state is entered; when it runs out the machine leaves. In Failed the restoring request stays on the output, so
//! that a kernel which comes back late still sees it.

use super::curve::Curve;
use super::fit::Fit;
use super::fitted::Levels;
use super::io::*;
use super::peak::Peak;
use super::plan::Plan;
use super::verdict::{BacklashReport, Estimates, Sense};
use crate::cycle::level::Level;
use crate::cycle::profile::Profile;
use crate::error::*;

mod door;
mod measure;
mod quick;
mod readings;
#[cfg(test)]
mod tests;

use readings::{Probe, Watch};

/// Where the machine is. Each comment says what ends the state.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Phase {
    /// Ends with `start`.
    Idle,
    /// Ends with its first cycle, which tells where the axis stands and which amount is in force.
    Begin,
    /// Ends when the kernel confirms amount 0 and reversal acceleration off.
    Clear,
    /// Ends at the reference position.
    Approach,
    /// Ends `run_in` behind the reference.
    SlideBack,
    /// Ends a creep before the reference.
    SlideIn,
    /// Ends at the reference: so slowly that neither the table's inertia nor the servo's overshoot releases the wind-up.
    CreepIn,
    /// Ends when the rest is over.
    Settle,
    /// Ends when the torque no longer grows.
    Scan,
    /// Ends when the command is back where the motor is: the servo's lag must not drive the motor on after a turn.
    Unwind { forth: bool },
    /// Ends when the motor has gone `depth` back.
    ProbeBack,
    /// Ends when the motor has come forth again.
    ProbeForth,
    /// Ends when the command stands.
    Rest,
    /// Ends when the peak rule has seen bin `bin` and all after it.
    EvaluatePeak { bin: usize },
    /// Ends when the fit stands.
    EvaluateFit,
    /// Ends with its cycle: the reversal is judged, and the next one or the end follows.
    Conclude,
    /// Ends when the kernel confirms the amount asked for and reversal acceleration back.
    Write { then: After },
    /// Ends when the commanded speed is 0.
    Stopping,
    /// Ends when the kernel confirms the old amount and reversal acceleration back.
    Restore,
    /// Ends with the next `start`.
    Done,
    /// Ends with the next `start`.
    Failed,
}

/// What follows a confirmed write.
#[derive(Debug, Clone, Copy, PartialEq)]
enum After {
    Done,
    Idle,
}

/// What an operator asked for between measurements.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Wish {
    /// Write the amount that was in force before the last written one.
    RestoreOld,
    /// Take the compensation out and refuse measurements.
    Disable,
    /// Put the compensation back and allow measurements.
    Enable,
}

/// A lost-motion measurement of one axis: plain data, no pointers.
#[derive(Debug, Clone)]
pub struct Backlash {
    plan: Plan,
    phase: Phase,
    enabled: bool,
    wish: Option<Wish>,
    /// First fault of this run.
    fault: Fault,
    /// Cycles left to the present state.
    left: u32,
    /// Cycles left to the present motor step.
    hold: u32,
    /// Number of the present reversal, from 0.
    reversal: u32,
    /// Which of the two senses it belongs to.
    index: usize,
    references: [f64; 2],
    /// Sense of the scan, ±1.
    sense: f64,
    /// Measured and commanded position where the present scan turned.
    turn: f64,
    turn_command: f64,
    /// Furthest that the motor came before the scan, in the sense of the scan: the lowest.
    furthest: f64,
    /// The table broke away in the old sense during the scan, and the curve was begun anew where the motor turned.
    slipped: bool,
    profile: Profile,
    last_position: f64,
    smallest_change: f64,
    before: Level,
    after: Level,
    watch: Watch,
    probe: Probe,
    peak: Peak,
    levels: Levels,
    senses: [Sense; 2],
    /// Amount that the door restores.
    fallback_um: f64,
    /// Amount that the last written one replaced; `None` before a write.
    old_um: Option<f64>,
    written_um: Option<f64>,
    parked_um: f64,
    active_um: f64,
    /// True while the kernel runs with something that gib changed and has not put right.
    changed: bool,
    estimates: Estimates,
    output: BacklashOutput,
    curves: [Curve; 2],
    fit: Fit,
}

impl Default for Backlash {
    fn default() -> Backlash {
        Backlash {
            plan: Plan::REST,
            phase: Phase::Idle,
            enabled: true,
            wish: None,
            fault: Fault::NONE,
            left: 0,
            hold: 0,
            reversal: 0,
            index: 0,
            references: [0.0; 2],
            sense: 1.0,
            turn: 0.0,
            turn_command: 0.0,
            furthest: f64::INFINITY,
            slipped: false,
            profile: Profile::default(),
            last_position: 0.0,
            smallest_change: f64::INFINITY,
            before: Level::default(),
            after: Level::default(),
            watch: Watch::default(),
            probe: Probe::default(),
            peak: Peak::default(),
            levels: Levels::default(),
            senses: [Sense::default(); 2],
            fallback_um: 0.0,
            old_um: None,
            written_um: None,
            parked_um: 0.0,
            active_um: 0.0,
            changed: false,
            estimates: Estimates::default(),
            output: BacklashOutput::default(),
            curves: [Curve::default(), Curve::default()],
            fit: Fit::default(),
        }
    }
}

impl Backlash {
    /// Arms a measurement; it begins with the next step.
    ///
    /// # Errors
    /// `GIB_ERR_STATE` while busy, `GIB_ERR_DISABLED`, `GIB_ERR_RESTORE_UNCONFIRMED` while a restore is owed,
    /// `GIB_ERR_CONFIG` with the field.
    pub fn start(&mut self, plan: Result<Plan, Fault>) -> Result<(), Fault> {
        if self.busy() || self.wish.is_some() {
            return Err(Fault::of(GIB_ERR_STATE));
        }
        if !self.enabled {
            return Err(Fault::of(GIB_ERR_DISABLED));
        }
        if self.changed {
            return Err(Fault::of(GIB_ERR_RESTORE_UNCONFIRMED));
        }
        self.plan = plan?;
        self.fault = Fault::NONE;
        self.senses = [Sense::default(); 2];
        self.estimates = Estimates::default();
        self.written_um = None;
        self.curves.iter_mut().for_each(|curve| curve.start(self.plan.bin));
        self.smallest_change = f64::INFINITY;
        self.reversal = 0;
        self.output.message = 0;
        self.output.progress_ratio = 0.0;
        self.enter(Phase::Begin, 2.0);
        Ok(())
    }

    /// Asks for something between measurements; carried out from the next step on.
    ///
    /// # Errors
    /// `GIB_ERR_STATE` when the present state does not allow it.
    pub fn wish(&mut self, wish: Wish) -> Result<(), Fault> {
        let allowed = match wish {
            Wish::RestoreOld => !self.busy() && self.wish.is_none() && self.enabled && self.old_um.is_some(),
            Wish::Disable => self.enabled,
            Wish::Enable => !self.enabled && !self.busy() && self.wish.is_none(),
        };
        if !allowed {
            return Err(Fault::of(GIB_ERR_STATE));
        }
        if wish == Wish::Disable && self.busy() {
            self.leave(Fault::of(GIB_ERR_DISABLED));
        }
        self.enabled = wish != Wish::Disable;
        self.wish = Some(wish);
        Ok(())
    }

    /// Aborts a running measurement: brake, restore, fail with `GIB_ERR_ABORTED`. Nothing when not busy.
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
    pub fn output(&self) -> &BacklashOutput {
        &self.output
    }

    /// First fault of the present run.
    #[must_use]
    pub fn fault(&self) -> Fault {
        self.fault
    }

    /// What was found so far, and what became of it.
    #[must_use]
    pub fn report(&self) -> BacklashReport {
        let written = self.phase == Phase::Done && self.written_um.is_some();
        // What an operator asked for afterwards does not make a run that failed a good one.
        let failed = self.phase == Phase::Idle && self.fault != Fault::NONE;
        BacklashReport {
            each: self.estimates.each,
            mean: self.estimates.mean,
            old_value_um: self.old_um.filter(|_| written).unwrap_or(self.fallback_um),
            value_written_um: self.written_um.unwrap_or(0.0),
            value_active_um: self.active_um,
            status: if failed { self.fault.code } else { self.output.status },
            method: i32::from(self.plan.use_peak),
            mode: i32::from(!self.plan.slow_feed),
            written: i32::from(written),
            restore_owed: i32::from(self.changed && self.phase == Phase::Failed),
            presliding_permille: self.estimates.presliding_permille,
        }
    }

    /// Points of the last torque curve of a sense: travel in µm, torque in N·m. `None` for a sense beyond 1.
    pub fn curve(&self, sense: usize) -> Option<impl Iterator<Item = (f64, f64)> + Clone> {
        let curve = self.curves.get(sense)?;
        let nm = self.plan.torque_nm;
        Some((0..curve.used()).filter_map(move |bin| curve.point(bin).map(|(_, s, t)| (s * 1e3, t * nm))))
    }

    /// True when nothing is under way: no measurement, no wish, no restore owed. A step may then be answered with
    /// `rest_at` alone.
    #[must_use]
    pub fn quiet(&self) -> bool {
        !self.busy() && self.wish.is_none() && !self.changed
    }

    /// A cycle in which nothing is under way: the axis stays where it is (mm, finite).
    #[inline(always)]
    pub fn rest_at(&mut self, position_mm: f64) -> &BacklashOutput {
        self.output.target_position_mm = position_mm;
        &self.output
    }

    /// One servo cycle.
    pub fn step(&mut self, input: &BacklashInput) -> &BacklashOutput {
        if !self.busy() {
            if input.position_mm.is_finite() {
                self.output.target_position_mm = input.position_mm;
            }
            if !self.quiet() {
                self.between(input);
            }
            return &self.output;
        }
        let first = self.phase == Phase::Begin;
        if first {
            // Also a run that ends in its first cycle leaves the axis where it is.
            let here = if input.position_mm.is_finite() { input.position_mm } else { self.output.target_position_mm };
            self.profile = Profile::at_rest(here, self.plan.acceleration);
        }
        let danger = if (self.safe(input) && !first) || self.regardless() { None } else { self.danger(input) };
        if let Some(fault) = danger {
            self.leave(fault);
            self.set_off();
        } else if self.left == 0 {
            self.overdue(input);
            self.set_off();
        } else {
            self.left -= 1;
            self.advance(input);
        }
        self.put_out();
        &self.output
    }

    /// Braking, restoring and what an operator asked for go on whatever the axis does.
    fn regardless(&self) -> bool {
        matches!(self.phase, Phase::Stopping | Phase::Restore | Phase::Write { then: After::Idle })
    }

    #[inline(always)]
    fn put_out(&mut self) {
        self.output.target_position_mm = self.profile.position;
        self.output.target_speed_mm_s = self.profile.speed * self.plan.cycles_per_s;
        self.output.remaining_mm = self.profile.left().abs();
    }

    /// Whether this cycle's input allows the measurement to go on. An axis that follows its command within the lag
    /// limit is within its travel too, see [`Plan::check_reach`].
    #[inline(always)]
    fn safe(&self, input: &BacklashInput) -> bool {
        // Comparisons with NaN are false, and `x * 0` is NaN for what is not finite.
        let lag = self.profile.position - input.position_mm;
        input.flags == 0
            && input.torque.abs() <= self.plan.torque_bound
            && lag.abs() + input.compensation_um * 0.0 <= self.plan.lag_limit
    }

    /// Between measurements: carries out wishes, and waits for a restore that is still owed.
    #[cold]
    fn between(&mut self, input: &BacklashInput) {
        if self.changed {
            if self.confirmed(input) {
                self.changed = false;
                self.output.message = self.fault.code;
            }
            return;
        }
        if !(input.position_mm.is_finite() && input.compensation_um.is_finite()) {
            return;
        }
        self.profile = Profile::at_rest(input.position_mm, self.plan.acceleration);
        self.fallback_um = input.compensation_um;
        let amount = match self.wish.take() {
            Some(Wish::RestoreOld) => self.old_um.unwrap_or(input.compensation_um),
            Some(Wish::Disable) => {
                self.parked_um = input.compensation_um;
                0.0
            }
            _ => self.parked_um,
        };
        self.request(amount, false);
        self.enter(Phase::Write { then: After::Idle }, f64::from(self.plan.ack_timeout));
    }

    /// What in this cycle's input must end a measurement.
    fn danger(&self, input: &BacklashInput) -> Option<Fault> {
        let plan = &self.plan;
        let fault = |code, field, value, low, high| Some(Fault { code, field, value, low, high });
        let finite = |field, value: f64| fault(GIB_ERR_NON_FINITE, field, value, f64::MIN, f64::MAX);
        if input.flags != 0 {
            return Some(flagged(input.flags));
        }
        if !input.position_mm.is_finite() {
            return finite("position_mm\0", input.position_mm);
        }
        if !input.torque.is_finite() {
            return finite("torque\0", input.torque);
        }
        if !input.compensation_um.is_finite() {
            return finite("compensation_um\0", input.compensation_um);
        }
        if input.torque.abs() > plan.torque_bound {
            return fault(GIB_ERR_TORQUE_BOUND, "torque\0", input.torque, -plan.torque_bound, plan.torque_bound);
        }
        if !(plan.travel[0]..=plan.travel[1]).contains(&input.position_mm) {
            let position = input.position_mm;
            return fault(GIB_ERR_TRAVEL_BOUND, "position_mm\0", position, plan.travel[0], plan.travel[1]);
        }
        let lag = self.profile.position - input.position_mm;
        if lag.abs() <= plan.lag_limit {
            return None;
        }
        fault(GIB_ERR_LAG, "lag_mm\0", lag, -plan.lag_limit, plan.lag_limit)
    }

    /// Asks the kernel for a compensation amount and for reversal acceleration off, or as configured.
    fn request(&mut self, amount_um: f64, reversal_off: bool) {
        self.output.compensation_um = amount_um;
        self.output.reversal_acceleration_off = i32::from(reversal_off);
        self.output.request_id = self.output.request_id.wrapping_add(1).max(1);
        self.changed = true;
    }

    /// True when the kernel has carried out the present request and runs with the amount asked for.
    #[inline(always)]
    fn confirmed(&self, input: &BacklashInput) -> bool {
        input.acknowledged_id == self.output.request_id
            && (input.compensation_um - self.output.compensation_um).abs() <= self.plan.compensation_tolerance_um
    }

    /// Goes to a state that must end within `cycles`.
    fn enter(&mut self, phase: Phase, cycles: f64) {
        self.phase = phase;
        self.left = cycles as u32;
        self.output.phase = match phase {
            Phase::Idle => GIB_BACKLASH_IDLE,
            Phase::Begin | Phase::Clear => GIB_BACKLASH_CLEAR,
            Phase::Approach => GIB_BACKLASH_APPROACH,
            Phase::SlideBack => GIB_BACKLASH_SLIDE_BACK,
            Phase::SlideIn | Phase::CreepIn => GIB_BACKLASH_SLIDE_IN,
            Phase::Settle => GIB_BACKLASH_SETTLE,
            Phase::Scan => GIB_BACKLASH_SCAN,
            Phase::Unwind { .. } | Phase::ProbeBack | Phase::ProbeForth | Phase::Rest => GIB_BACKLASH_PROBE,
            Phase::EvaluatePeak { .. } | Phase::EvaluateFit | Phase::Conclude => GIB_BACKLASH_EVALUATE,
            Phase::Write { .. } => GIB_BACKLASH_WRITE,
            Phase::Stopping => GIB_BACKLASH_STOPPING,
            Phase::Restore => GIB_BACKLASH_RESTORE,
            Phase::Done => GIB_BACKLASH_DONE,
            Phase::Failed => GIB_BACKLASH_FAILED,
        };
        let resting = matches!(phase, Phase::Idle | Phase::Done | Phase::Failed);
        self.output.owns_motion =
            i32::from(!resting && !matches!(phase, Phase::Begin | Phase::Write { then: After::Idle }));
        self.output.target_speed_mm_s = 0.0;
        self.output.status = match phase {
            Phase::Idle => GIB_OK,
            Phase::Done => GIB_DONE,
            _ => GIB_BUSY,
        };
    }
}
