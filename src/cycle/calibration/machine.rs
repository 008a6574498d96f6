//! The state machine of a calibration: one call per servo cycle.
//!
//! ```text
//! Idle → Begin → [Rise → Probe]… → Rise → Measure → Fall → (next frequency) … → Evaluate → Done
//!          any state ──fault, abort──▶ leave: Stopping → Failed
//! ```
//!
//! The command is start + a·sin φ. Only the amplitude a is ever changed, with bounded speed and acceleration of its own, so every way out, by the
//! one door `leave`, lets a fall to nothing and ends where the axis stood. Each moving state lasts a number of cycles that
//! is known when it is entered; that is its deadline.

mod danger;

use super::detect::Detector;
use super::io::*;
use super::plan::{BLOCKS, Plan};
use super::solve::{Complex, Experiment, Gains, least_squares, published};
use super::table::{CalibrationPoint, CalibrationTable, GIB_CALIBRATION_POINTS};
use crate::cycle::profile::Profile;
use crate::cycle::turns::{cos_sin, fold};
use crate::error::*;
use danger::stops;

/// Most experiments that one instance holds.
pub const GIB_CALIBRATION_EXPERIMENTS: usize = 8;

/// Where the machine is. Each comment says what ends the state.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Phase {
    /// Ends with `start`.
    Idle,
    /// Ends with its first cycle, which tells where the axis stands.
    Begin,
    /// Ends when the amplitude is reached and the machine has swung in for a block.
    Rise,
    /// Ends with a block, from which the next amplitude follows.
    Probe,
    /// Ends with the last block.
    Measure,
    /// Ends at amplitude 0.
    Fall,
    /// Ends with the last frequency.
    Evaluate,
    /// Ends at amplitude 0.
    Stopping,
    /// Ends with the next `start`.
    Done,
    /// Ends with the next `start`.
    Failed,
}

/// First amplitude, as part of the largest that stroke, speed and acceleration allow.
const FIRST: f64 = 0.1;
/// Largest growth from one probe to the next: friction and resonance are not proportional.
const GROWTH_MAX: f64 = 3.0;
/// Growth that is not worth another probe.
const GROWTH_MIN: f64 = 1.15;
/// Probes at one frequency, at most.
const PROBES: u32 = 8;
/// Part of a sensor's range that is used.
const USED: f64 = 0.7;
/// Standard deviations that a gain may be off what its makers promise.
const PROMISED: f64 = 3.0;
/// A displacement below this many standard deviations shows nothing.
const SIGNAL: f64 = 5.0;
/// Magnification beyond which the published formula is refused: 1° of phase would be a sixth of a gain.
const CONDITION_MAX: f64 = 10.0;

/// A calibration: plain data, no pointers.
#[derive(Debug, Clone)]
pub struct Calibration {
    plan: Plan,
    phase: Phase,
    fault: Fault,
    /// Position at the start, mm.
    start: f64,
    /// Present frequency.
    point: usize,
    amplitude: Profile,
    /// The amplitude that was chosen is the one to measure with.
    chosen: bool,
    probes: u32,
    /// Cycles of the present block, and of its phase.
    cycle: u32,
    phase_turns: f64,
    /// cos and sin of that phase: what is read next answers what was commanded last.
    wheel: (f64, f64),
    block: u32,
    /// Seat, bearing, ball bar, torque.
    detectors: [Detector; 4],
    output: CalibrationOutput,
    /// Whole experiments so far; the present one is kept behind them.
    count: usize,
    experiments: [[Experiment; GIB_CALIBRATION_EXPERIMENTS]; GIB_CALIBRATION_POINTS],
    table: CalibrationTable,
}

impl Default for Calibration {
    fn default() -> Calibration {
        Calibration {
            plan: Plan::REST,
            phase: Phase::Idle,
            fault: Fault::NONE,
            start: 0.0,
            point: 0,
            amplitude: Profile::default(),
            chosen: false,
            probes: 0,
            cycle: 0,
            phase_turns: 0.0,
            wheel: (1.0, 0.0),
            block: 0,
            detectors: [Detector::default(); 4],
            output: CalibrationOutput::default(),
            count: 0,
            experiments: [[Experiment::default(); GIB_CALIBRATION_EXPERIMENTS]; GIB_CALIBRATION_POINTS],
            table: CalibrationTable::default(),
        }
    }
}

impl Calibration {
    /// Arms a calibration; it begins with the next step.
    ///
    /// # Errors
    /// `GIB_ERR_STATE` while busy, `GIB_ERR_CONFIG` with the field, `GIB_ERR_CALIBRATION_ADD`.
    pub fn start(&mut self, plan: Result<Plan, Fault>) -> Result<(), Fault> {
        if self.busy() {
            return Err(Fault::of(GIB_ERR_STATE));
        }
        let plan = plan?;
        if plan.add {
            let (value, high) = (self.count as f64, (GIB_CALIBRATION_EXPERIMENTS - 1) as f64);
            if self.count == 0 || value > high || !plan.same_tones(&self.plan) {
                return Err(Fault { code: GIB_ERR_CALIBRATION_ADD, field: "add\0", value, low: 1.0, high });
            }
        } else {
            self.count = 0;
        }
        self.plan = plan;
        self.fault = Fault::NONE;
        // What a run before has found is no result of this one.
        self.table.count = 0;
        self.point = 0;
        self.phase_turns = 0.0;
        self.output = CalibrationOutput { target_position_mm: self.output.target_position_mm, ..Default::default() };
        self.enter(Phase::Begin);
        Ok(())
    }

    /// Aborts: the amplitude falls to nothing, then it fails with `GIB_ERR_ABORTED`. Nothing when not busy.
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
    pub fn output(&self) -> &CalibrationOutput {
        &self.output
    }

    /// First fault of the present run.
    #[must_use]
    pub fn fault(&self) -> Fault {
        self.fault
    }

    /// Gains and phases, where there are any: after Done, or `install`.
    #[must_use]
    pub fn table(&self) -> Option<&CalibrationTable> {
        Some(&self.table).filter(|table| table.count > 0 && !self.busy())
    }

    /// Takes a table from elsewhere, in place of the experiments; for one that is not busy.
    pub fn install(&mut self, table: CalibrationTable) {
        self.table = table;
        self.count = 0;
    }

    /// One servo cycle.
    pub fn step(&mut self, input: &CalibrationInput) {
        if !self.busy() {
            if input.position_mm.is_finite() && self.output.stop_drive == 0 {
                self.output.target_position_mm = input.position_mm;
            }
            return;
        }
        self.work(input);
    }

    /// A cycle of a calibration; out of line, since an idle one should not pay for its registers.
    #[inline(never)]
    fn work(&mut self, input: &CalibrationInput) {
        if self.phase == Phase::Begin && input.position_mm.is_finite() {
            self.start = input.position_mm;
            self.output.target_position_mm = input.position_mm;
        }
        // The way out begins in this very cycle: a command that stood still for one would jerk.
        if let Some(fault) = self.danger(input) {
            self.leave(fault);
        }
        self.advance(input);
        if self.busy() {
            self.command();
        }
    }

    /// The state's own work.
    #[inline(always)]
    fn advance(&mut self, input: &CalibrationInput) {
        match self.phase {
            Phase::Probe | Phase::Measure => self.read(input),
            Phase::Rise | Phase::Fall | Phase::Stopping => self.swing(),
            Phase::Begin => self.tune(),
            Phase::Evaluate => self.evaluate(),
            Phase::Idle | Phase::Done | Phase::Failed => {}
        }
    }

    /// Takes up the present frequency.
    fn tune(&mut self) {
        self.probes = 0;
        self.chosen = false;
        (self.cycle, self.phase_turns) = (0, 0.0);
        self.amplitude = Profile::at_rest(0.0, self.plan.tone(self.point).bend);
        self.rise(FIRST * self.plan.tone(self.point).amplitude);
    }

    /// Goes to another amplitude, and stays there for a block before it is looked at.
    fn rise(&mut self, amplitude: f64) {
        self.change_to(amplitude);
        self.block = 0;
        self.enter(Phase::Rise);
    }

    fn change_to(&mut self, amplitude: f64) {
        let slope = self.plan.tone(self.point).slope;
        self.amplitude.go(amplitude, slope);
    }

    /// A cycle in which nothing is read.
    fn swing(&mut self) {
        let arrived = self.amplitude.step();
        let whole = self.turn();
        match self.phase {
            // A whole block at the new amplitude lets what the ramp has set swinging die away.
            Phase::Rise if arrived && whole => {
                self.block += 1;
                if self.block == 2 {
                    self.block = 0;
                    self.enter(if self.chosen { Phase::Measure } else { Phase::Probe });
                }
            }
            Phase::Fall if arrived => self.next(),
            Phase::Stopping if arrived => {
                self.output.target_position_mm = self.start;
                self.fail();
            }
            _ => {}
        }
    }

    /// The command's phase goes on; true when a block ends, at phase 0.
    #[inline(always)]
    fn turn(&mut self) -> bool {
        let tone = self.plan.tone(self.point);
        self.cycle += 1;
        let ended = self.cycle >= tone.cycles;
        if ended {
            self.cycle = 0;
        }
        self.phase_turns = fold(f64::from(self.cycle) * f64::from(tone.periods) / f64::from(tone.cycles));
        ended
    }

    /// A cycle of a block: this input answers the command of the phase that was put out last.
    #[inline(always)]
    fn read(&mut self, input: &CalibrationInput) {
        let (cos, sin) = self.wheel;
        let [a1, a2] = input.acceleration_m_s2;
        let begins = self.cycle == 0 && self.block == 0;
        for (detector, reading) in self.detectors.iter_mut().zip([a1, a2, input.ball_bar_um, input.torque]) {
            if begins {
                detector.begin(reading);
            }
            detector.read(reading, cos, sin);
        }
        if self.turn() {
            self.end_block();
        }
    }

    fn end_block(&mut self) {
        if self.detectors.iter().take(3).any(Detector::stuck) {
            return self.refuse(GIB_ERR_CALIBRATION_STUCK, "frequency_hz\0");
        }
        if self.phase == Phase::Probe {
            return self.choose();
        }
        let n = f64::from(self.plan.tone(self.point).cycles);
        for detector in &mut self.detectors {
            detector.close(n, self.block);
        }
        self.block += 1;
        if self.block == BLOCKS {
            self.keep();
        }
    }

    /// From what an amplitude takes of torque and sensors to the next one.
    fn choose(&mut self) {
        let plan = &self.plan;
        let [s1, s2, s3] = plan.saturation;
        let most = [USED * s1, USED * s2, USED * s3, plan.torque_wanted];
        let used = self.detectors.iter().zip(most).map(|(d, most)| d.peak() / most).fold(1e-3, f64::max);
        let (now, most) = (self.amplitude.position, plan.tone(self.point).amplitude);
        let amplitude = (now * (1.0 / used).min(GROWTH_MAX)).min(most);
        self.probes += 1;
        // Too much already is brought down at once; a little more is not worth a probe.
        self.chosen = amplitude < now * GROWTH_MIN || self.probes >= PROBES;
        self.rise(amplitude);
    }

    /// Keeps what was measured.
    fn keep(&mut self) {
        let tone = *self.plan.tone(self.point);
        let to_um = -1e6 / (tone.omega() * tone.omega());
        let [seat, bearing, bar] = [0, 1, 2].map(|i| self.detectors[i].amplitude(&tone, self.plan.cycle));
        let (seat_um, bearing_um) = (seat.value.scaled(to_um), bearing.value.scaled(to_um));
        let [v1, v2] = [seat, bearing].map(|a| a.variance * to_um * to_um);
        let shows = |value: Complex, variance: f64| value.square() > SIGNAL * SIGNAL * variance;
        if !shows(seat_um, v1) && !shows(bearing_um, v2) {
            return self.refuse(GIB_ERR_CALIBRATION_SIGNAL, "frequency_hz\0");
        }
        let experiment = Experiment {
            seat: seat_um,
            bearing: bearing_um,
            relative: bar.value,
            variance: v1 + v2 + bar.variance,
            amplitude: self.amplitude.position,
        };
        let place = self.count & (GIB_CALIBRATION_EXPERIMENTS - 1);
        self.experiments[self.point & (GIB_CALIBRATION_POINTS - 1)][place] = experiment;
        self.change_to(0.0);
        self.enter(Phase::Fall);
    }

    /// The next frequency, or the evaluation.
    fn next(&mut self) {
        self.point += 1;
        if self.point < self.plan.count {
            self.tune();
        } else {
            self.point = 0;
            self.table.count = 0;
            self.enter(Phase::Evaluate);
        }
    }

    /// One frequency a cycle; then one cycle for each entry of the table that holds none.
    fn evaluate(&mut self) {
        let i = self.point & (GIB_CALIBRATION_POINTS - 1);
        self.point += 1;
        if i < self.plan.count {
            self.find_gains(i);
        } else {
            self.table.point[i] = CalibrationPoint::default();
        }
        if self.phase == Phase::Evaluate && self.point == GIB_CALIBRATION_POINTS {
            self.table.count = self.plan.count as u32;
            self.count += 1;
            self.point = 0;
            self.enter(Phase::Done);
        }
    }

    fn find_gains(&mut self, i: usize) {
        let experiments = self.experiments[i].get(..=self.count).unwrap_or(&self.experiments[i]);
        let last = experiments.last().copied().unwrap_or_default();
        let found =
            if self.plan.published { published(&last) } else { least_squares(experiments, self.plan.tolerance) };
        if self.plan.published && found.condition > CONDITION_MAX {
            let (code, high) = (GIB_ERR_CALIBRATION_CONDITION, CONDITION_MAX);
            // What is put out beside it says at which frequency.
            self.point = i;
            return self.leave(Fault { code, field: "condition_ratio\0", value: found.condition, low: 1.0, high });
        }
        // A dead sensor leaves the whole ball bar to the other, whose gain then is none that its makers promised.
        let most = PROMISED * self.plan.tolerance;
        let (low, high) = ((1.0 - most).max(0.1), (1.0 + most).min(10.0));
        let sound = |g: &Complex, spread: f64| g.0 > 0.0 && g.size() + spread > low && g.size() - spread < high;
        let spreads = found.variance.map(|v| 2.0 * (0.5 * v).sqrt());
        for ((bad, spread), field) in found.gain.iter().zip(spreads).zip(["gain_ratio[0]\0", "gain_ratio[1]\0"]) {
            if !sound(bad, spread) {
                self.point = i;
                let (code, value) = (GIB_ERR_CALIBRATION_GAIN, bad.size().copysign(bad.0));
                return self.leave(Fault { code, field, value, low, high });
            }
        }
        let used = if self.plan.published { 1.0 } else { experiments.len() as f64 };
        self.table.point[i] = point(self.plan.tone(i).frequency, &found, last.amplitude, used);
    }

    /// A measurement that is worth nothing, with the frequency at which it is.
    fn refuse(&mut self, code: i32, field: &'static str) {
        let value = self.plan.tone(self.point).frequency;
        self.leave(Fault { code, field, value, ..Fault::NONE });
    }

    /// The one door out.
    fn leave(&mut self, fault: Fault) {
        if self.phase != Phase::Stopping {
            self.fault = fault;
        }
        self.output.message = self.fault.code;
        if stops(&fault) || self.phase == Phase::Begin {
            // Where the axis is or whether it obeys is not known: nothing is commanded any more.
            self.output.stop_drive = i32::from(stops(&fault) && fault.code != GIB_ERR_DRIVE_FAULT);
            return self.fail();
        }
        self.change_to(0.0);
        self.enter(Phase::Stopping);
    }

    fn fail(&mut self) {
        self.amplitude = Profile::default();
        self.enter(Phase::Failed);
        self.output.status = self.fault.code;
    }

    /// Puts the command out.
    #[inline(always)]
    fn command(&mut self) {
        // Evaluation goes on behind the last frequency.
        let point = self.point.min(self.plan.count.saturating_sub(1));
        let tone = self.plan.tone(point);
        self.wheel = cos_sin(self.phase_turns);
        let (cos, sin) = self.wheel;
        let Profile { position: amplitude, speed: slope, .. } = self.amplitude;
        self.output.target_position_mm = self.start + amplitude * sin;
        self.output.target_speed_mm_s = amplitude * tone.omega() * cos + slope * self.plan.cycles_per_s * sin;
        self.output.frequency_hz = tone.frequency;
        self.output.amplitude_mm = amplitude;
        self.output.point = point as i32;
    }

    fn enter(&mut self, phase: Phase) {
        self.phase = phase;
        let output = &mut self.output;
        output.phase = match phase {
            Phase::Idle => GIB_CALIBRATION_IDLE,
            Phase::Begin | Phase::Rise => GIB_CALIBRATION_RISE,
            Phase::Probe => GIB_CALIBRATION_PROBE,
            Phase::Measure => GIB_CALIBRATION_MEASURE,
            Phase::Fall => GIB_CALIBRATION_FALL,
            Phase::Evaluate => GIB_CALIBRATION_EVALUATE,
            Phase::Stopping => GIB_CALIBRATION_STOPPING,
            Phase::Done => GIB_CALIBRATION_DONE,
            Phase::Failed => GIB_CALIBRATION_FAILED,
        };
        let resting = matches!(phase, Phase::Idle | Phase::Done | Phase::Failed);
        output.owns_motion = i32::from(!resting && phase != Phase::Begin);
        output.status = match phase {
            Phase::Idle => GIB_OK,
            Phase::Done => GIB_DONE,
            _ => GIB_BUSY,
        };
        if resting {
            output.target_speed_mm_s = 0.0;
            output.amplitude_mm = 0.0;
        }
    }
}

/// The table's entry.
fn point(frequency_hz: f64, found: &Gains, amplitude_mm: f64, experiments: f64) -> CalibrationPoint {
    // Half of a complex variance is in each direction: along the gain, and across it.
    let spread = [0, 1].map(|i| 2.0 * (0.5 * found.variance[i & 1]).sqrt());
    let size = found.gain.map(Complex::size);
    CalibrationPoint {
        frequency_hz,
        gain_ratio: size,
        phase_deg: found.gain.map(|g| g.phase().to_degrees()),
        gain_uncertainty_ratio: spread,
        phase_uncertainty_deg: [0, 1].map(|i| (spread[i & 1] / size[i & 1].max(0.1)).min(3.1).to_degrees()),
        condition_ratio: found.condition,
        residual_um: found.residual,
        amplitude_mm,
        experiments,
    }
}
