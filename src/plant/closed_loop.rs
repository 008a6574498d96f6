//! The closed loop replayed: the recorded command through servo and model, at ideal sensors.
//!
//! Starts in the state that the recording shows in its first row; after that nothing measured enters but the command, the torque
//! that was added to the servo's, where there was such, and which of three differences the control takes for the command's speed.

use super::added::{Added, ByServo, Pulses, median};
use super::at_rows::{AtRows, Between, ROUNDED, Reader, command_of_cycles};
use super::lateness::Lateness;
use super::noise::Noise;
use super::observed::Observed;
use super::physics::{Physics, Ripple};
use super::predict::{TorquePrediction, predict_torque, rows_for_phases, standing};
use super::servo::{CommandSpeed, by_clock};
use super::simulate::{Sensors, Setup, Start, simulate_cycles, steps_per_cycle};
use super::sudden;
use crate::machine::{Axis, Servo};
use std::borrow::Cow;
use std::ops::Range;

/// Longest plant step of a replay where nothing is sudden, s. A replay in steps of 25 µs alone differs by a few nm, most of it about reversals
/// and none of it better.
const SMOOTH_STEP_S: f64 = 500e-6;

/// A replayed recording, one value a row, load units.
#[derive(Debug, Clone, PartialEq)]
pub struct ClosedLoop {
    /// Motor encoder.
    pub position: Vec<f64>,
    /// Table, with the errors of the screw; `None` where the recording has none to compare it with.
    pub table_position: Option<Vec<f64>>,
}

/// Everything that a machine file says about a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    /// Torque from the measured motion; what is too sudden for that, and at rest, by the closed loop, where there is one.
    pub torque: TorquePrediction,
    /// The closed loop; `None` without a servo or a recorded command.
    pub closed_loop: Option<ClosedLoop>,
    /// What was added to the servo's torque; the closed loop has it too.
    pub added: Option<Pulses>,
    /// What the control takes for the speed of its command, by the recorded torque.
    pub command_speed: CommandSpeed,
}

/// Predicts a recording: what `gib predict` writes and what the gain of a diagnosis is measured by.
///
/// # Errors
/// As [`predict_torque`], and a servo period that does not suit the recording.
pub fn predict(axis: &Axis, observed: &Observed) -> Result<Prediction, String> {
    predict_by(axis, observed, &ByServo::of(axis, observed), 1.0)
}

/// The same without the simulated table. The recorded one is dropped once its torque is known: long recordings have no room
/// for what is not written.
///
/// # Errors
/// As [`predict`].
pub fn predict_motor(axis: &Axis, observed: &mut Observed) -> Result<Prediction, String> {
    let torque = predict_torque(axis, observed)?;
    observed.table_position = None;
    replayed(axis, observed, torque, &ByServo::of(axis, observed), 1.0)
}

/// [`predict`] by what is known of the servo, in plant steps so many times longer than usual.
///
/// # Errors
/// As [`predict`].
pub fn predict_by(axis: &Axis, observed: &Observed, servo: &ByServo, coarser: f64) -> Result<Prediction, String> {
    replayed(axis, observed, predict_torque(axis, observed)?, servo, coarser)
}

fn replayed(
    axis: &Axis,
    observed: &Observed,
    mut torque: TorquePrediction,
    servo: &ByServo,
    coarser: f64,
) -> Result<Prediction, String> {
    let whole = Part { coarser, ..Part::whole(observed) };
    let rest = later(rows_at_rest(observed), torque.physics.delay_s / observed.period_s, observed.time_s.len());
    let begun = Begun::of(axis, observed, &mut torque, servo, whole)?;
    let replay = |speed, added| Replay::felt(axis, observed, &torque, speed, added, whole);
    let mut best = replay(CommandSpeed::Central, servo.added[0].as_ref())?;
    if servo.speed != CommandSpeed::Central {
        let other = replay(servo.speed, servo.added[1].as_ref())?;
        // A servo that is another one in truth may seem to take another speed, and does not repeat the position by it.
        if let (Some(of_other), Some(of_best)) = (&other, &best) {
            if of_other.error(observed) < of_best.error(observed) {
                best = other;
            }
        }
    }
    let Some(Replay { command_speed, replayed, alone, torque: mut of_loop, added }) = best else {
        let command_speed = CommandSpeed::Central;
        return Ok(Prediction { torque, closed_loop: None, added: None, command_speed });
    };
    // The predicted torque knows nothing of what the torque column told of the beginning.
    let mut position = Cow::Borrowed(alone.as_ref().unwrap_or(&replayed.position));
    if let Some(Begun { position: by_itself, torque }) = begun {
        position.to_mut()[..by_itself.len()].copy_from_slice(&by_itself);
        of_loop[..torque.len()].copy_from_slice(&torque);
    }
    sudden::add(&mut torque, axis, observed, &position, &of_loop);
    drop(position);
    for row in rest.into_iter().flatten() {
        torque.torque[row] = of_loop[row];
    }
    Ok(Prediction { torque, closed_loop: Some(replayed), added: added.map(|added| added.pulses), command_speed })
}

/// In what manner a recording is replayed: what a prediction found in it beside the machine's numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Manner {
    command_speed: CommandSpeed,
    /// Whether the axis felt what was added to the servo's torque.
    felt: bool,
    at_start: f64,
    /// Of each ripple, cogging before vibrations; of those that are left out none.
    phases: Vec<Option<f64>>,
}

impl Prediction {
    /// The manner of this prediction's closed loop; `None` where there is none.
    #[must_use]
    pub fn manner(&self) -> Option<Manner> {
        self.closed_loop.as_ref()?;
        let Physics { cogging, vibration, .. } = &self.torque.physics;
        let phase = |ripple: &Ripple| (ripple.amplitude != 0.0).then_some(ripple.phase);
        Some(Manner {
            command_speed: self.command_speed,
            felt: self.added.is_some(),
            at_start: self.torque.at_start,
            phases: cogging.iter().chain(vibration).map(phase).collect(),
        })
    }
}

impl Manner {
    /// Number of ripples that have a phase.
    #[must_use]
    pub fn ripples(&self) -> usize {
        self.phases.iter().flatten().count()
    }

    /// The position of a recording's first rows, replayed by another machine with as many ripples; each that has a phase is turned
    /// by some radians. `servo` is what the prediction knew of the servo.
    ///
    /// # Errors
    /// As [`predict`].
    pub fn replayed(
        &self,
        axis: &Axis,
        (observed, servo): (&Observed, &ByServo),
        part: Part,
        turned: &[f64],
    ) -> Result<Option<Vec<f64>>, String> {
        Ok(self.recorded(axis, (observed, servo), part, turned, &[])?.map(|[position, _]| position))
    }

    /// The same with the torque of some rows.
    ///
    /// # Errors
    /// As [`predict`].
    pub fn recorded(
        &self,
        axis: &Axis,
        (observed, servo): (&Observed, &ByServo),
        part: Part,
        turned: &[f64],
        torque_of: &[Range<usize>],
    ) -> Result<Option<[Vec<f64>; 2]>, String> {
        let mut physics = Physics::of(axis)?;
        let mut turned = turned.iter();
        for (ripple, phase) in physics.cogging.iter_mut().chain(&mut physics.vibration).zip(&self.phases) {
            match phase {
                Some(phase) => ripple.phase = phase + turned.next().unwrap_or(&0.0),
                None => ripple.amplitude = 0.0,
            }
        }
        let torque = TorquePrediction { torque: Vec::new(), at_start: self.at_start, physics, phases_unknown: 0 };
        let by = usize::from(self.command_speed != CommandSpeed::Central);
        let added = servo.added[by].as_ref().filter(|_| self.felt).map_or(&[][..], |added| &added.torque);
        let part = Part { table: false, ..part };
        let replayed = replay(axis, observed, &torque, torque_of, added, self.command_speed, part)?;
        Ok(replayed.map(|(replayed, torque)| [replayed.position, torque]))
    }
}

/// How much of a recording is replayed, how finely, and through what sensors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Part {
    /// The first so many rows.
    pub rows: usize,
    /// How many times longer the plant steps are than usual.
    pub coarser: f64,
    /// What servo and rows read.
    pub sensors: Sensors,
    /// Whether the table is told, where the recording has one.
    pub table: bool,
}

impl Part {
    /// All of a recording as usual, through ideal sensors.
    #[must_use]
    pub fn whole(observed: &Observed) -> Self {
        Self { rows: observed.time_s.len(), coarser: 1.0, sensors: Sensors::default(), table: true }
    }

    /// As many rows as a number of plant steps suffices for that are so many times longer than usual.
    #[must_use]
    pub fn of_steps(axis: &Axis, observed: &Observed, most: usize, coarser: f64) -> Self {
        let whole = Self { coarser, ..Self::whole(observed) };
        let setup = Setup { coarser, ..Setup::default() };
        let step_s = Physics::of(axis)
            .ok()
            .zip(axis.servo)
            .and_then(|(physics, servo)| Some(servo.period_s / steps_per_cycle(&physics, &servo, &setup).ok()? as f64));
        let rows = step_s.map_or(0.0, |step_s| most as f64 * step_s / observed.period_s);
        Self { rows: whole.rows.min(rows as usize), ..whole }
    }
}

/// Times of the servo, 1/Kp and Ti, for which the axis has moved when nothing is left of how its servo began.
const FORGOTTEN: f64 = 8.0;

/// The first rows by what the machine itself says of its beginning, where the servo began otherwise.
struct Begun {
    position: Vec<f64>,
    torque: Vec<f64>,
}

impl Begun {
    /// Lets the servo begin with the torque that it held by the recorded one, if the position is then repeated better: an axis at rest
    /// may be held by any torque up to its friction. What is predicted of the torque knows nothing of that.
    fn of(
        axis: &Axis,
        observed: &Observed,
        torque: &mut TorquePrediction,
        servo: &ByServo,
        whole: Part,
    ) -> Result<Option<Self>, String> {
        let (Some(held), Some(law)) = (servo.held_at_start, &axis.servo) else { return Ok(None) };
        let rows = rows_of_the_beginning(law, observed);
        let part = Part { rows, table: false, ..whole };
        let first = [0..rows];
        let begins = |torque: &TorquePrediction, rows: &[Range<usize>]| {
            replay(axis, observed, torque, rows, &[], servo.speed, part)
        };
        let by_itself = begins(torque, &first)?;
        let itself = std::mem::replace(&mut torque.at_start, held);
        let (Some((alone, of_rows)), Some((with, _))) = (by_itself, begins(torque, &[])?) else { return Ok(None) };
        if error_of(observed, &with) < error_of(observed, &alone) {
            return Ok(Some(Self { position: alone.position, torque: of_rows }));
        }
        torque.at_start = itself;
        Ok(None)
    }
}

/// Rows until nothing is left of how a servo and what is behind it began; all, if the axis never moves for as long.
#[must_use]
pub fn rows_of_the_beginning(servo: &Servo, observed: &Observed) -> usize {
    let times = servo.position_gain_1_s.recip() + servo.velocity_integral_time_s.unwrap_or(0.0);
    let seconds = FORGOTTEN * times;
    let slow = observed.motion.standing_speed();
    let moving = observed.motion.velocities().enumerate().filter(|(_, v)| v.abs() > slow);
    let mut moving = moving.skip((seconds / observed.period_s).ceil() as usize);
    moving.next().map_or(observed.time_s.len(), |(row, _)| row)
}

/// A recording replayed at one speed of the command.
struct Replay<'s> {
    command_speed: CommandSpeed,
    replayed: ClosedLoop,
    /// The position by the servo alone, where that is another.
    alone: Option<Vec<f64>>,
    /// The torque column by the servo alone.
    torque: Vec<f64>,
    /// What was added to the servo's torque, where that repeats the position better: what only the torque sensor saw, the axis
    /// did not feel.
    added: Option<&'s Added>,
}

impl<'s> Replay<'s> {
    /// `None` where the axis has no servo or the recording no command.
    fn felt(
        axis: &Axis,
        observed: &Observed,
        torque: &TorquePrediction,
        command_speed: CommandSpeed,
        added: Option<&'s Added>,
        whole: Part,
    ) -> Result<Option<Self>, String> {
        let all = [0..observed.time_s.len()];
        let Some((replayed, torque_alone)) = replay(axis, observed, torque, &all, &[], command_speed, whole)? else {
            return Ok(None);
        };
        let mut felt = Self { command_speed, replayed, alone: None, torque: torque_alone, added: None };
        if let Some(added) = added {
            if let Some((with, _)) = replay(axis, observed, torque, &[], &added.torque, command_speed, whole)? {
                if error_of(observed, &with) < felt.error(observed) {
                    felt.alone = Some(std::mem::replace(&mut felt.replayed, with).position);
                    felt.added = Some(added);
                }
            }
        }
        Ok(Some(felt))
    }

    fn error(&self, observed: &Observed) -> f64 {
        error_of(observed, &self.replayed)
    }
}

/// Sum of the squared errors of the replayed position.
fn error_of(observed: &Observed, replayed: &ClosedLoop) -> f64 {
    let rows = replayed.position.iter().zip(&observed.position);
    rows.map(|(replayed, measured)| (replayed - measured).powi(2)).filter(|square| square.is_finite()).sum()
}

/// Simulates the recorded command under the axis's servo; `prediction` gives the numbers and the phases of its ripples, `added`
/// what is added to the servo's torque in each cycle (empty for nothing). Beside the motion the torque in some rows.
///
/// `None` where the axis has no servo or the recording no command.
///
/// # Errors
/// The simulation's, or a servo period that does not suit the recording.
fn replay(
    axis: &Axis,
    observed: &Observed,
    prediction: &TorquePrediction,
    torque_of: &[Range<usize>],
    added: &[f64],
    command_speed: CommandSpeed,
    part: Part,
) -> Result<Option<(ClosedLoop, Vec<f64>)>, String> {
    let (Some(servo), Some(command)) = (axis.servo, &observed.command) else { return Ok(None) };
    let servo = by_clock(servo, observed.period_s);
    let axis = &Axis { servo: Some(servo), ..axis.clone() };
    let time = &observed.time_s[..part.rows];
    let (Some(&begin), Some(&end)) = (time.first(), time.last()) else { return Ok(None) };
    let cycles = ((end - begin) / servo.period_s).round() as usize + 1;
    if cycles > 1000 * time.len() {
        return Err(format!(
            "servo.period_s {} is too short for a recording of {} rows over {} s",
            servo.period_s,
            time.len(),
            end - begin
        ));
    }
    let mut command = command_of_cycles(time, &command[..part.rows], servo.period_s, cycles).peekable();
    let finite = |value: f64| Some(value).filter(|value| value.is_finite());
    let velocity = finite(observed.motion.velocity(0)).unwrap_or(0.0);
    let measured = observed.position.first().copied().and_then(finite);
    let position = measured.or(command.peek().copied()).unwrap_or(0.0);
    let torque = finite(prediction.at_start).unwrap_or(0.0);
    let start = Start { position, velocity, torque };
    let Part { coarser, sensors, .. } = part;
    let setup =
        Setup { smooth_step_s: SMOOTH_STEP_S, coarser, sensors, start: Some(start), command_speed, ..Setup::default() };
    // The rows of a recording made once a servo cycle are the cycles themselves.
    let place = |row: usize| {
        let exact = (time[row] - begin) / servo.period_s;
        if (exact - exact.round()).abs() <= ROUNDED { exact.round() } else { exact }
    };
    // The torque column shows what was there a delay before, read between cycles as the rest of a prediction takes it.
    let late = prediction.physics.delay_s / servo.period_s;
    let shown = |row: usize| (place(row) - late).clamp(0.0, (cycles - 1) as f64);
    let with_table = part.table && observed.table_position.is_some();
    let lagging = Between::Lagging(Lateness::rate(&servo));
    let count = torque_of.iter().map(Range::len).sum();
    let mut rows = AtRows {
        motor: Reader::new(cycles, time.len(), (0..time.len()).map(place), Between::Smooth),
        table: with_table.then(|| Reader::new(cycles, time.len(), (0..time.len()).map(place), Between::Smooth)),
        torque: Reader::new(cycles, count, torque_of.iter().cloned().flatten().map(shown), lagging),
    };
    let mut physics = prediction.physics.clone();
    physics.delay_s = 0.0;
    simulate_cycles(axis, physics, command, added, &setup, &mut Noise::new(0), &mut rows)?;
    let table_position = rows.table.map(|table| at_the_scales_zero(table.values, observed));
    Ok(Some((ClosedLoop { position: rows.motor.values, table_position }, rows.torque.values)))
}

/// A simulated table by the zero of its scale, which nobody knows: half way between those of either way in the rows for phases, where
/// what a load winds up is none of it and an impact that comes a row early or late weighs little.
pub(super) fn at_the_scales_zero(mut simulated: Vec<f64>, observed: &Observed) -> Vec<f64> {
    let (motion, standing) = (&observed.motion, standing(&observed.motion));
    let zero = |way: f64| {
        let pairs = observed.table_position.iter().flatten().zip(&simulated).zip(motion.velocities());
        let rows = pairs.take(rows_for_phases(motion)).filter(|(_, v)| way * v > standing);
        median(rows.map(|((measured, simulated), _)| measured - simulated))
    };
    let zeros = [zero(1.0), zero(-1.0)].into_iter().flatten();
    let (count, sum) = zeros.fold((0.0, 0.0), |(count, sum), zero| (count + 1.0, sum + zero));
    if count > 0.0 {
        simulated.iter_mut().for_each(|table| *table += sum / count);
    }
    simulated
}

/// Rows at rest, whose torque is that of the replay; a torque column that is late shows it as much later.
///
/// What dry friction holds at rest is not in the motion: it is what the servo has come to by then, which the replay
/// knows. At rest means less travel within a period of the motion's cut-off than reversing friction takes.
fn rows_at_rest(observed: &Observed) -> Vec<Range<usize>> {
    let motion = &observed.motion;
    let slow = 10.0 * motion.resolution * motion.cutoff_hz;
    let around = (0.5 / (motion.cutoff_hz * observed.period_s)).ceil() as usize;
    let mut rest: Vec<Range<usize>> = Vec::new();
    // Rows in a row that are slow, up to and with this one.
    let mut length = 0;
    for (i, v) in motion.velocities().enumerate() {
        length = if v.abs() < slow { length + 1 } else { 0 };
        if length > 2 * around {
            match rest.last_mut() {
                Some(last) if last.end == i => last.end = i + 1,
                _ => rest.push(i - 2 * around..i + 1),
            }
        }
    }
    rest
}

/// Rows so many rows later, among all of a recording.
fn later(rows: Vec<Range<usize>>, by: f64, all: usize) -> Vec<Range<usize>> {
    let by = by.round() as isize;
    let moved = |row: usize| row.saturating_add_signed(by).min(all);
    rows.into_iter().map(|rows| moved(rows.start)..moved(rows.end)).filter(|rows| !rows.is_empty()).collect()
}
