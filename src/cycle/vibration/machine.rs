//! The correction, one call per servo cycle.
//!
//! ```text
//! Idle → Running ──fault, abort──▶ leave: Stopping (fades out) → Failed
//! ```
//!
//! While running the correction is blended in when spindle and sensors have been good for a whole revolution, and out when
//! they are not: nothing it does is a jump. A bad sensor is not read; its last harmonics go on turning until the
//! correction has faded out. In every other state, and whatever happens, the position is the plain scale.

mod follow;
#[cfg(test)]
mod offset_tests;
mod out;
mod quick;
mod renew;

use super::harmonic::{Harmonics, PAIRS, Trackers, grow};
use super::integrate::Integrator;
use super::io::*;
use super::known::Known;
use super::plan::Plan;
use super::sensor::Sensors;
use super::spindle::{Spindle, Wheel};
use crate::cycle::backlash::io::flagged;
use crate::error::*;
use renew::Renewal;

/// Where the machine is. Each comment says what ends the state.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Phase {
    /// Ends with `start`.
    Idle,
    /// Ends with an abort or a fault; it commands nothing and waits for nothing, so it has no deadline.
    Running,
    /// Ends when the correction has faded out, after `fade_s` at most.
    Stopping,
    /// Ends with the next `start`.
    Failed,
}

/// Pairs of harmonics that are enough for most; else all are computed.
const FEW: usize = PAIRS / 2;
/// Reasons that a sensor or the angle gives: the harmonics must be learnt anew.
const BAD: u32 = !(GIB_VIBRATION_NO_REVOLUTION | GIB_VIBRATION_NO_ROTATION);
/// A second slide that is nowhere, mm: a number that is no position.
const NOWHERE: f64 = 1e9;
/// Turns of readings far off the harmonics after which they are no longer believed.
const SURPRISE: f32 = 0.5;

/// The correction of one slide: plain data, no pointers.
#[derive(Debug, Clone)]
pub struct Vibration {
    plan: Plan,
    phase: Phase,
    fault: Fault,
    /// Turns since the harmonics had to be learnt anew.
    progress: f64,
    /// Progress at which the present revolution ends; for the harmonics only the first has an end.
    revolution: f64,
    blend: f64,
    /// Position put out last, and the correction in it.
    position: f64,
    correction: f64,
    /// What is left of a correction that ended at once, µm, and by how much it shrinks in a cycle.
    leaving: f64,
    leaves: f64,
    /// Pairs of harmonics of the cycles that are all alike, see [`quick`]; 0 while they are not.
    usual: usize,
    renewal: Renewal,
    /// Share of a revolution's news that enters a harmonic while the speed is steady.
    part: f32,
    /// Relative change of speed in a revolution, averaged over one.
    swing: f64,
    /// What the displacements have grown by since the harmonics stood, see [`Spindle::growth`].
    growth: f32,
    degraded: u64,
    seen: u32,
    spindle: Spindle,
    sensors: Sensors,
    /// Accelerations of seat and bearing.
    trackers: Trackers,
    /// The second slide's position, µm from where it stood first, and a signal that is not there.
    slide: Trackers,
    /// What is known of each pair of harmonics of seat and bearing beside its value.
    known: [[Known; PAIRS]; 2],
    /// Displacement of seat and bearing, µm, for the speed for which the harmonics stand.
    displacement: [Harmonics; 2],
    integrators: [Integrator; 2],
    /// Sum of the second slide's positions in the revolution that is integrated, µm, and of how many cycles.
    slid: [f64; 2],
    /// Last good displacement by integration, µm: what fades out.
    held: [f64; 2],
}

impl Default for Vibration {
    fn default() -> Vibration {
        Vibration {
            plan: Plan::REST,
            phase: Phase::Idle,
            fault: Fault::NONE,
            progress: 0.0,
            revolution: 1.0,
            blend: 0.0,
            position: 0.0,
            correction: 0.0,
            leaving: 0.0,
            leaves: 0.0,
            usual: 0,
            renewal: Renewal::default(),
            part: 0.0,
            swing: 0.0,
            growth: 1.0,
            degraded: 0,
            seen: 0,
            spindle: Spindle::default(),
            sensors: Sensors::default(),
            trackers: Trackers::default(),
            slide: Trackers::default(),
            known: [[Known::default(); PAIRS]; 2],
            displacement: [Harmonics::default(); 2],
            integrators: [Integrator::default(); 2],
            slid: [0.0; 2],
            held: [0.0; 2],
        }
    }
}

impl Vibration {
    /// Begins to correct, with the next step.
    ///
    /// # Errors
    /// `GIB_ERR_STATE` while busy, `GIB_ERR_CONFIG` with the field.
    pub fn start(&mut self, plan: Result<Plan, Fault>) -> Result<(), Fault> {
        if self.busy() {
            return Err(Fault::of(GIB_ERR_STATE));
        }
        let plan = plan?;
        let Vibration { position, correction, leaving, leaves, .. } = *self;
        *self =
            Vibration { plan, phase: Phase::Running, position, correction, leaving, leaves, ..Vibration::default() };
        self.trackers = Trackers::bounding(self.plan.displacement_max as f32);
        Ok(())
    }

    /// Fades the correction out and fails with `GIB_ERR_ABORTED`. Nothing when not busy.
    pub fn abort(&mut self) {
        if self.phase == Phase::Running {
            self.leave(Fault::of(GIB_ERR_ABORTED));
        }
    }

    /// True from `start` until Failed.
    #[must_use]
    pub fn busy(&self) -> bool {
        matches!(self.phase, Phase::Running | Phase::Stopping)
    }

    /// First fault of the present run.
    #[must_use]
    pub fn fault(&self) -> Fault {
        self.fault
    }

    /// Position put out last, mm.
    #[must_use]
    pub fn position(&self) -> f64 {
        self.position
    }

    /// The correction in it, µm.
    #[must_use]
    pub fn correction(&self) -> f64 {
        self.correction
    }

    /// One servo cycle; returns the status.
    #[inline(always)]
    pub fn step(&mut self, input: &VibrationInput, output: &mut VibrationOutput) -> i32 {
        let usual = self.usual;
        // The status as a number of each way, so that nothing is left to do after `careful`.
        match usual {
            FEW if self.quick::<FEW>(input, output) => GIB_BUSY,
            PAIRS if self.quick::<PAIRS>(input, output) => GIB_BUSY,
            0 if self.phase == Phase::Idle && self.idle(input, output) => GIB_OK,
            _ => self.careful(input, output),
        }
    }

    /// Any cycle, with all that can happen in one.
    #[inline(never)]
    fn careful(&mut self, input: &VibrationInput, output: &mut VibrationOutput) -> i32 {
        self.any(input, output);
        output.status
    }

    #[inline(always)]
    fn any(&mut self, input: &VibrationInput, output: &mut VibrationOutput) {
        self.usual = 0;
        let plain = if self.plan.second_slide { input.scale_mm + input.second_slide_mm } else { input.scale_mm };
        let encoder = if self.plan.second_slide { input.second_slide_mm } else { 0.0 };
        if !(plain.is_finite() && encoder.abs() < NOWHERE) {
            return self.blind(input, output);
        }
        if !self.busy() {
            return self.rest(plain, output);
        }
        if input.flags != 0 {
            self.flagged(input.flags);
        }
        let turns = self.spindle.read(&self.plan, input.angle_deg);
        let reasons = self.look(input, turns);
        let [seat, bearing] =
            if self.plan.integrate { self.integrated(input, reasons) } else { self.tracked(input, reasons) };
        let reasons = reasons | self.implausible([seat, bearing]);
        self.put_out(plain, [seat, bearing], reasons, output);
        self.see_usual();
    }

    /// Why the correction cannot be in force, as far as spindle and sensors are concerned.
    fn look(&mut self, input: &VibrationInput, turns: bool) -> u32 {
        let turned = self.spindle.turned;
        let mut reasons = self.sensors.check(&self.plan, input.acceleration_m_s2, turned);
        if !turns {
            reasons |= GIB_VIBRATION_BAD_ANGLE;
        }
        if self.spindle.rate.abs() < self.plan.rate_min {
            reasons |= GIB_VIBRATION_NO_ROTATION;
        }
        if reasons != 0 {
            self.progress = 0.0;
            self.revolution = 1.0;
        }
        if self.progress == 0.0 && self.blend == 0.0 {
            self.spindle.forget_jumps();
        }
        // What was known goes first, and then is learnt anew: were it learnt meanwhile, the correction would jump from one to the other.
        if reasons == 0 && (self.progress > 0.0 || self.blend == 0.0) {
            self.progress += turned.abs();
        }
        // A first revolution of a spindle that runs up tells of no speed, and would grow with the speed from there.
        if self.progress >= 1.0 && self.revolution == 1.0 && !self.plan.integrate && self.spindle.far() {
            self.progress = 0.0;
        }
        if self.progress < 1.0 { reasons | GIB_VIBRATION_NO_REVOLUTION } else { reasons }
    }

    /// Displacements by harmonics, µm.
    fn tracked(&mut self, input: &VibrationInput, reasons: u32) -> [f64; 2] {
        if self.plan.pairs == FEW {
            self.tracked_by::<FEW>(input, reasons)
        } else {
            self.tracked_by::<PAIRS>(input, reasons)
        }
    }

    fn tracked_by<const N: usize>(&mut self, input: &VibrationInput, reasons: u32) -> [f64; 2] {
        let wheel = self.spindle.wheel(N);
        if self.phase == Phase::Running && reasons == 0 {
            self.learn::<N>(input, &wheel);
            self.renew_pair();
        } else {
            // What does not learn does not follow the speed either: what fades out is what was known.
            if self.phase == Phase::Running && reasons == GIB_VIBRATION_NO_REVOLUTION && self.progress > 0.0 {
                self.learn_first::<N>(input, &wheel);
            }
        }
        let [seat, bearing] = &self.displacement;
        [(self.growth * seat.value(&wheel, N)).into(), (self.growth * bearing.value(&wheel, N)).into()]
    }

    /// Both accelerations and, where there is one, the second slide, with their readings.
    fn signals(&mut self, input: &VibrationInput) -> impl Iterator<Item = (&mut Trackers, [f64; 2])> {
        let all =
            [(&mut self.trackers, input.acceleration_m_s2), (&mut self.slide, [1e3 * input.second_slide_mm, 0.0])];
        all.into_iter().take(if self.plan.second_slide { 2 } else { 1 })
    }

    /// The first revolution, from which the harmonics start.
    fn learn_first<const N: usize>(&mut self, input: &VibrationInput, wheel: &Wheel) {
        let (asked, part) = (self.spindle.followed(&self.plan), self.spindle.turned.abs());
        let begins = self.progress <= part;
        if begins {
            // What was known before has gone from the position, and is worth nothing; so are factors for what once stood.
            grow(&mut self.displacement, self.plan.pairs, self.growth);
            (self.known, self.renewal, self.growth) = (Default::default(), Renewal::default(), 1.0);
            self.spindle.settle(&self.plan);
        }
        for (trackers, readings) in self.signals(input) {
            if begins {
                trackers.begin(readings, asked);
            }
            trackers.first(wheel, N, readings, part);
        }
    }

    /// The rest of the first revolution, at the cycle that ends it.
    #[cold]
    fn end_first<const N: usize>(&mut self, input: &VibrationInput, wheel: &Wheel) {
        self.revolution = f64::INFINITY;
        self.displacement = Default::default();
        (self.growth, self.swing, self.part) = (1.0, 0.0, 1.0);
        self.renewal.rate = self.spindle.speed();
        self.spindle.settle(&self.plan);
        let part = 1.0 - (self.progress - self.spindle.turned.abs());
        for (trackers, readings) in self.signals(input) {
            trackers.first(wheel, N, readings, part);
            trackers.known();
        }
    }

    /// Follows the harmonics from then on.
    fn learn<const N: usize>(&mut self, input: &VibrationInput, wheel: &Wheel) {
        if self.revolution == 1.0 {
            return self.end_first::<N>(input, wheel);
        }
        self.follow();
        let turning = self.turning(self.spindle.turned);
        let shares = [turning * self.part, turning];
        let (displacement, hurry, mut growth) = (self.displacement, self.part / self.plan.share_min, self.growth);
        for (trackers, readings) in self.signals(input) {
            let left = trackers.left(wheel, N, readings, &displacement, growth);
            let left = trackers.believed(left, turning, hurry);
            trackers.learn(wheel, N, left, shares, growth);
            // The second slide moves by command, however fast the spindle turns.
            growth = 1.0;
        }
    }

    /// Part of a turn that a cycle counts for: no more than the trackers can bear.
    #[inline(always)]
    fn turning(&self, turned: f64) -> f32 {
        let (turning, most) = (turned.abs() as f32, self.plan.share_max);
        if turning < most { turning } else { most }
    }

    /// Displacements by integration, µm.
    fn integrated(&mut self, input: &VibrationInput, reasons: u32) -> [f64; 2] {
        // Also while what was known goes.
        if reasons & !GIB_VIBRATION_NO_REVOLUTION != 0 || self.progress == 0.0 {
            self.integrators.iter_mut().for_each(Integrator::restart);
            self.slid = [0.0; 2];
            return self.held;
        }
        if self.progress >= self.revolution {
            let late = self.plan.cycle * (self.progress - self.revolution) / self.spindle.turned.abs();
            self.revolution += 1.0;
            self.integrators.iter_mut().for_each(|integrator| integrator.close(late));
            // What is integrated has no mean either.
            let [sum, cycles] = self.slid;
            (self.slide.offset[0], self.slid) = (if cycles > 0.0 { sum / cycles } else { sum }, [0.0; 2]);
        }
        self.slid = [self.slid[0] + 1e3 * input.second_slide_mm, self.slid[1] + 1.0];
        let rate = self.plan.main * self.spindle.rate;
        let gain = self.plan.gain(rate.abs()).to_array().map(f64::from);
        // j·x of a sinusoid is its velocity over ω.
        let per_omega = self.plan.cycle / (core::f64::consts::TAU * rate);
        let mut out = [0.0; 2];
        for (n, integrator) in self.integrators.iter_mut().enumerate() {
            let [way, speed] = integrator.read(input.acceleration_m_s2[n], self.plan.cycle);
            let mut way = 1e6 * way;
            if n == GIB_VIBRATION_SEAT && self.plan.second_slide {
                way -= 1e3 * input.second_slide_mm - self.slide.offset[0];
            }
            let [re, im] = [gain[2 * n], gain[2 * n + 1]];
            out[n] = re * way + im * 1e6 * speed * per_omega;
        }
        if reasons == 0 {
            self.held = out;
        }
        self.held
    }

    /// A displacement that no machine has, or an acceleration that is suddenly another: it is learnt anew.
    fn implausible(&mut self, displacement: [f64; 2]) -> u32 {
        let most = self.plan.displacement_max;
        let [seat, bearing] =
            [0, 1].map(|i: usize| displacement[i].abs() > most || self.trackers.surprise[i] > SURPRISE);
        if !(seat || bearing) || self.progress < 1.0 {
            return 0;
        }
        self.progress = 0.0;
        self.revolution = 1.0;
        // What was integrated ends in the middle of a revolution: closed as a whole one it would give offsets as wrong again.
        self.integrators.iter_mut().for_each(Integrator::restart);
        let reason = |bad| if bad { GIB_VIBRATION_IMPLAUSIBLE } else { 0 };
        reason(seat) | reason(bearing) << 8 | GIB_VIBRATION_NO_REVOLUTION
    }

    #[cold]
    fn flagged(&mut self, flags: u32) {
        if self.phase == Phase::Running {
            self.leave(flagged(flags));
        }
    }

    /// The one door out.
    fn leave(&mut self, fault: Fault) {
        self.fault = fault;
        self.phase = Phase::Stopping;
        self.usual = 0;
    }

    /// What is known of the vibration.
    #[must_use]
    pub fn report(&self) -> VibrationReport {
        let mut report = VibrationReport {
            offset_m_s2: self.trackers.offset,
            noise_m_s2: self.trackers.variance().map(|v| f64::from(v).sqrt()),
            speed_rpm: self.spindle.rate * self.plan.to_rpm,
            revolutions: self.progress,
            degraded_cycles: self.degraded,
            reasons_seen: self.seen,
            status: if self.busy() { GIB_BUSY } else { self.fault.code },
            method: i32::from(self.plan.integrate),
            ..VibrationReport::default()
        };
        if self.plan.integrate {
            report.offset_m_s2 = self.integrators.map(|i| i.offset);
            return report;
        }
        let [seat, bearing] = &self.displacement;
        for (i, (amplitude, phase)) in report.amplitude_um.iter_mut().zip(&mut report.phase_deg).enumerate() {
            let ([a, b], [c, d]) = (seat.get(i), bearing.get(i));
            let (x, y) = (f64::from(self.growth * (a - c)), f64::from(self.growth * (b - d)));
            (*amplitude, *phase) = (x.hypot(y), y.atan2(x).to_degrees());
        }
        report
    }
}

/// The status that explains the first of some reasons.
fn message(reasons: u32) -> i32 {
    let sensor = (reasons | reasons >> 8) & 0x00ff_0000;
    if reasons & GIB_VIBRATION_BAD_ANGLE != 0 {
        GIB_ERR_VIBRATION_ANGLE
    } else if sensor & GIB_VIBRATION_NOT_A_NUMBER != 0 {
        GIB_ERR_VIBRATION_NOT_A_NUMBER
    } else if sensor & GIB_VIBRATION_STUCK != 0 {
        GIB_ERR_VIBRATION_STUCK
    } else if sensor & GIB_VIBRATION_SATURATED != 0 {
        GIB_ERR_VIBRATION_SATURATED
    } else if sensor != 0 {
        GIB_ERR_VIBRATION_IMPLAUSIBLE
    } else {
        GIB_OK
    }
}
