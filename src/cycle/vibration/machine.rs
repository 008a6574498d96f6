//! The correction, one call per servo cycle.
//!
//! ```text
//! Idle → Running ──fault, abort──▶ leave: Stopping (fades out) → Failed
//! ```
//!
//! While running the correction is blended in when spindle and sensors have been good for a whole revolution, and out when
//! they are not: nothing it does is a jump. A bad sensor is not read; its last harmonics go on turning until the
//! correction has faded out. In every other state, and whatever happens, the position is the plain scale.

use super::config::GIB_VIBRATION_HARMONICS;
use super::harmonic::{Harmonics, Tracker};
use super::integrate::Integrator;
use super::io::*;
use super::known::Known;
use super::plan::Plan;
use super::sensor::Sensor;
use super::spindle::{Spindle, Wheel};
use crate::cycle::backlash::io::GIB_INPUT_ABORT;
use crate::error::*;

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

/// Reasons that a sensor or the angle gives: the harmonics must be learnt anew.
const BAD: u32 = !(GIB_VIBRATION_NO_REVOLUTION | GIB_VIBRATION_NO_ROTATION);
/// Drift of an amplitude in a revolution per relative change of speed in it, beside what inertia forces do: a middle between a
/// machine without resonances, 0, and one at a resonance of 4 % damping, 12.
const SWING: f32 = 2.5;
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
    /// Position put out last.
    position: f64,
    /// Harmonic whose displacement is renewed in this cycle, counted from 0.
    next: usize,
    /// Share of a revolution's news that enters a harmonic while the speed is steady.
    part: f32,
    /// Relative change of speed in a revolution, averaged over one.
    swing: f64,
    degraded: u64,
    seen: u32,
    spindle: Spindle,
    sensors: [Sensor; 2],
    trackers: [Tracker; 2],
    /// The second slide's position, µm from where it stood first.
    slide: Tracker,
    /// What is known of each harmonic of seat and bearing beside its value.
    known: [[Known; GIB_VIBRATION_HARMONICS]; 2],
    /// Displacement of seat and bearing, µm.
    displacement: [Harmonics; 2],
    integrators: [Integrator; 2],
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
            next: 0,
            part: 0.0,
            swing: 0.0,
            degraded: 0,
            seen: 0,
            spindle: Spindle::default(),
            sensors: [Sensor::default(); 2],
            trackers: [Tracker::default(); 2],
            slide: Tracker::default(),
            known: [[Known::default(); GIB_VIBRATION_HARMONICS]; 2],
            displacement: [Harmonics::default(); 2],
            integrators: [Integrator::default(); 2],
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
        *self = Vibration { plan: plan?, phase: Phase::Running, position: self.position, ..Vibration::default() };
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

    /// One servo cycle.
    #[inline(always)]
    pub fn step(&mut self, input: &VibrationInput, output: &mut VibrationOutput) {
        let plain = if self.plan.second_slide { input.scale_mm + input.second_slide_mm } else { input.scale_mm };
        if !plain.is_finite() {
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
    }

    /// Why the correction cannot be in force, as far as spindle and sensors are concerned.
    #[inline(always)]
    fn look(&mut self, input: &VibrationInput, turns: bool) -> u32 {
        let [a1, a2] = input.acceleration_m_s2;
        let turned = self.spindle.turned;
        let [seat, bearing] = &mut self.sensors;
        let mut reasons = seat.check(&self.plan, a1, turned) | bearing.check(&self.plan, a2, turned) << 8;
        if !turns {
            reasons |= GIB_VIBRATION_BAD_ANGLE;
        }
        if self.spindle.rate.abs() < self.plan.rate_min {
            reasons |= GIB_VIBRATION_NO_ROTATION;
        }
        if reasons != 0 {
            self.progress = 0.0;
            self.revolution = 1.0;
            if self.blend == 0.0 {
                self.spindle.forget_jumps();
            }
        } else {
            self.progress += turned.abs();
        }
        if self.progress < 1.0 { reasons | GIB_VIBRATION_NO_REVOLUTION } else { reasons }
    }

    /// Displacements by harmonics, µm.
    #[inline(always)]
    fn tracked(&mut self, input: &VibrationInput, reasons: u32) -> [f64; 2] {
        let vectors = self.plan.vectors;
        let wheel = self.spindle.wheel(vectors);
        if self.phase != Phase::Running {
            // What fades out is what was known.
        } else if reasons == 0 {
            self.learn(input, &wheel);
            self.renew();
        } else if reasons == GIB_VIBRATION_NO_REVOLUTION {
            self.learn_first(input, &wheel);
        }
        let [seat, bearing] = &self.displacement;
        [seat.value(&wheel, vectors).into(), bearing.value(&wheel, vectors).into()]
    }

    /// Both accelerations and the second slide, with their readings.
    #[inline(always)]
    fn signals(&mut self, input: &VibrationInput) -> impl Iterator<Item = (&mut Tracker, f64)> {
        let [a1, a2] = input.acceleration_m_s2;
        let all = self.trackers.iter_mut().chain([&mut self.slide]).zip([a1, a2, 1e3 * input.second_slide_mm]);
        all.take(if self.plan.second_slide { 3 } else { 2 })
    }

    /// The first revolution, from which the harmonics start.
    fn learn_first(&mut self, input: &VibrationInput, wheel: &Wheel) {
        let (vectors, part) = (self.plan.vectors, self.spindle.turned.abs());
        let begins = self.progress <= part;
        for (tracker, reading) in self.signals(input) {
            if begins {
                tracker.begin(reading);
            }
            tracker.first(wheel, vectors, reading, part);
        }
    }

    /// The rest of the first revolution, at the cycle that ends it.
    #[cold]
    fn end_first(&mut self, input: &VibrationInput, wheel: &Wheel) {
        self.revolution = f64::INFINITY;
        let (vectors, part) = (self.plan.vectors, 1.0 - (self.progress - self.spindle.turned.abs()));
        for (tracker, reading) in self.signals(input) {
            tracker.first(wheel, vectors, reading, part);
            tracker.known();
        }
    }

    /// Follows the harmonics from then on.
    #[inline(always)]
    fn learn(&mut self, input: &VibrationInput, wheel: &Wheel) {
        if self.revolution == 1.0 {
            return self.end_first(input, wheel);
        }
        let plan = &self.plan;
        // First in a hurry, then by the average over the revolutions asked for.
        let settled = self.progress * plan.share_min >= 2.0;
        let turning = self.spindle.turned.abs();
        self.swing += self.spindle.change - turning * self.swing;
        let part = if settled { plan.share_min } else { 2.0 / self.progress };
        self.part = part as f32;
        let turning = if turning < plan.share_max { turning } else { plan.share_max } as f32;
        let share = turning * self.part;
        let growth = (1.0 + 4.0 * self.spindle.change) as f32;
        let turned = if self.progress > 3.0 { turning } else { 0.0 };
        for (tracker, reading) in self.trackers.iter_mut().zip(input.acceleration_m_s2) {
            tracker.read(wheel, plan.vectors, reading, [share, turning], growth, turned);
        }
        if plan.second_slide {
            self.slide.read(wheel, plan.vectors, 1e3 * input.second_slide_mm, [share, turning], 1.0, turned);
        }
    }

    /// Renews the displacements of one harmonic: divided by −ω², calibrated, and less what noise explains.
    #[inline(always)]
    fn renew(&mut self) {
        let plan = &self.plan;
        let i = self.next;
        self.next = if i + 1 < 4 * plan.vectors { i + 1 } else { 0 };
        let turning = self.spindle.rate.abs();
        let rate = (i + 1) as f64 * turning;
        let slow = (rate as f32) < plan.tracked[0] || turning < plan.rate_min;
        if slow || rate as f32 >= plan.tracked[1] || i >= plan.harmonics {
            return self.leave_out(i, slow);
        }
        let to_um = plan.to_um / (rate * rate) as f32;
        let gain = plan.gain(rate).0;
        let sense = if self.spindle.rate < 0.0 { -1.0 } else { 1.0 };
        let drift = SWING * self.swing.abs() as f32;
        let place = i & (GIB_VIBRATION_HARMONICS - 1);
        for (n, [re, im]) in [[gain[0], sense * gain[1]], [gain[2], sense * gain[3]]].into_iter().enumerate() {
            let tracker = &mut self.trackers[n];
            let [a, b] = tracker.harmonics.get(i);
            let (mut x, mut y) = (to_um * (re * a + im * b), to_um * (re * b - im * a));
            if n == GIB_VIBRATION_SEAT && plan.second_slide {
                let [a, b] = self.slide.harmonics.get(i);
                (x, y) = (x - a, y - b);
            }
            // What noise leaves in an average over one revolution, and what of the news was let in.
            let noise = 2.0 * to_um * to_um * turning as f32 * tracker.variance;
            let share = tracker.share(i);
            let seen = &mut self.known[n][place];
            let [x, y] = seen.look([x, y], turning as f32 * share * (4 * plan.vectors) as f32, share - self.part);
            self.displacement[n].set(i, seen.believed([x, y], noise * share));
            tracker.set_share(i, seen.share(drift, noise, self.part));
        }
    }

    /// A harmonic that is not asked for, or too slow or too fast for the sensors, has no displacement.
    fn leave_out(&mut self, i: usize, slow: bool) {
        for displacement in &mut self.displacement {
            displacement.set(i, [0.0; 2]);
        }
        if !slow {
            for tracker in self.trackers.iter_mut().chain([&mut self.slide]) {
                tracker.harmonics.set(i, [0.0; 2]);
            }
        }
    }

    /// Displacements by integration, µm.
    fn integrated(&mut self, input: &VibrationInput, reasons: u32) -> [f64; 2] {
        if reasons & !GIB_VIBRATION_NO_REVOLUTION != 0 {
            self.integrators.iter_mut().for_each(Integrator::restart);
            return self.held;
        }
        if self.progress >= self.revolution {
            let late = self.plan.cycle * (self.progress - self.revolution) / self.spindle.turned.abs();
            self.revolution += 1.0;
            self.integrators.iter_mut().for_each(|integrator| integrator.close(late));
            self.slide.offset = 1e3 * input.second_slide_mm;
        }
        let rate = self.plan.main * self.spindle.rate;
        let gain = self.plan.gain(rate.abs()).0.map(f64::from);
        // j·x of a sinusoid is its velocity over ω.
        let per_omega = self.plan.cycle / (core::f64::consts::TAU * rate);
        let mut out = [0.0; 2];
        for (n, integrator) in self.integrators.iter_mut().enumerate() {
            let [way, speed] = integrator.read(input.acceleration_m_s2[n], self.plan.cycle);
            let mut way = 1e6 * way;
            if n == GIB_VIBRATION_SEAT && self.plan.second_slide {
                way -= 1e3 * input.second_slide_mm - self.slide.offset;
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
    #[inline(always)]
    fn implausible(&mut self, displacement: [f64; 2]) -> u32 {
        let most = self.plan.displacement_max;
        let [seat, bearing] =
            [0, 1].map(|i: usize| displacement[i].abs() > most || self.trackers[i].surprise > SURPRISE);
        if !(seat || bearing) || self.progress < 1.0 {
            return 0;
        }
        self.progress = 0.0;
        self.revolution = 1.0;
        let reason = |bad| if bad { GIB_VIBRATION_IMPLAUSIBLE } else { 0 };
        reason(seat) | reason(bearing) << 8 | GIB_VIBRATION_NO_REVOLUTION
    }

    /// Blends, and writes the output.
    #[inline(always)]
    fn put_out(&mut self, plain: f64, displacement: [f64; 2], reasons: u32, output: &mut VibrationOutput) {
        let wanted = reasons == 0 && self.phase == Phase::Running;
        let blend = self.blend + if wanted { self.plan.fade } else { -self.plan.fade };
        self.blend = if blend > 1.0 {
            1.0
        } else if blend > 0.0 {
            blend
        } else {
            0.0
        };
        let most = 2.0 * self.plan.displacement_max;
        let relative = displacement[0] - displacement[1];
        let relative = if relative > most {
            most
        } else if relative < -most {
            -most
        } else {
            relative
        };
        let correction = self.blend * relative;
        self.position = plain + 1e-3 * correction;
        self.seen |= reasons;
        *output = VibrationOutput {
            position_mm: self.position,
            correction_um: correction,
            displacement_um: displacement,
            relative_um: relative,
            speed_rpm: self.spindle.rate * self.plan.to_rpm,
            blend_ratio: self.blend,
            status: GIB_BUSY,
            phase: GIB_VIBRATION_CORRECTING,
            message: 0,
            reasons,
        };
        if !wanted {
            self.explain(output);
        }
    }

    /// Says why there is no correction.
    fn explain(&mut self, output: &mut VibrationOutput) {
        let bad = output.reasons & BAD;
        self.degraded += u64::from(bad != 0);
        output.message = message(bad);
        output.phase = if bad != 0 { GIB_VIBRATION_DEGRADED } else { GIB_VIBRATION_WAITING };
        if self.phase == Phase::Stopping {
            output.phase = GIB_VIBRATION_STOPPING;
            output.message = self.fault.code;
            if self.blend == 0.0 {
                self.phase = Phase::Failed;
                output.phase = GIB_VIBRATION_FAILED;
                output.status = self.fault.code;
            }
        }
    }

    /// Idle or Failed: the plain scale.
    fn rest(&mut self, plain: f64, output: &mut VibrationOutput) {
        self.position = plain;
        let failed = self.phase == Phase::Failed;
        *output = VibrationOutput {
            position_mm: plain,
            status: self.fault.code,
            message: self.fault.code,
            phase: if failed { GIB_VIBRATION_FAILED } else { GIB_VIBRATION_IDLE },
            ..VibrationOutput::default()
        };
    }

    /// The scale itself is no number: the last position, and an error that is kept.
    #[cold]
    fn blind(&mut self, input: &VibrationInput, output: &mut VibrationOutput) {
        if self.busy() {
            let field = if input.scale_mm.is_finite() { "second_slide_mm\0" } else { "scale_mm\0" };
            self.fault = Fault { code: GIB_ERR_NON_FINITE, field, ..Fault::NONE };
            self.phase = Phase::Failed;
            self.blend = 0.0;
        }
        let position = self.position;
        self.rest(position, output);
        output.status = GIB_ERR_NON_FINITE;
        output.message = GIB_ERR_NON_FINITE;
    }

    #[cold]
    fn flagged(&mut self, flags: u32) {
        if self.phase == Phase::Running {
            let aborted = flags & GIB_INPUT_ABORT != 0;
            self.leave(Fault::of(if aborted { GIB_ERR_ABORTED } else { GIB_ERR_DRIVE_FAULT }));
        }
    }

    /// The one door out.
    fn leave(&mut self, fault: Fault) {
        self.fault = fault;
        self.phase = Phase::Stopping;
    }

    /// What is known of the vibration.
    #[must_use]
    pub fn report(&self) -> VibrationReport {
        let mut report = VibrationReport {
            offset_m_s2: self.trackers.map(|t| t.offset),
            noise_m_s2: self.trackers.map(|t| f64::from(t.variance).sqrt()),
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
            let (x, y) = (f64::from(a - c), f64::from(b - d));
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
