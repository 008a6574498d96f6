//! One axis under its servo, through its sensors: a commanded motion in, a recording out.
//!
//! Each servo cycle: encoder and scale are read and the row is logged with the motor's torque of that instant, the servo
//! computes its torque, and the body runs on under it to the next cycle. Where the motor has no lag its torque jumps at
//! that instant, and the row holds what it was before: the servo answers to the row.

use super::axis::Body;
use super::coupling::longest_step_s;
use super::noise::Noise;
use super::physics::{Physics, Ripple};
use super::servo::{CommandSpeed, ServoLoop};
use crate::machine::{Axis, Drive, Servo};
use std::collections::VecDeque;
use std::f64::consts::TAU;

/// Sensors of the recording. All zero: ideal ones. The servo reads the same encoder as the row.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Sensors {
    /// Step of encoder and scale, µm (0.001 degree).
    pub grid_um: f64,
    /// Normal noise of encoder and scale before the grid, µm.
    pub noise_um: f64,
    /// How old the encoder's and the scale's value is when it is read, s.
    pub delay_s: f64,
    /// The encoder's scale error, µm per m.
    pub scale_um_m: f64,
    /// Amplitude of the encoder's once-per-motor-revolution error, µm.
    pub eccentricity_um: f64,
    /// Normal noise of the logged torque, drive's own unit.
    pub torque_noise: f64,
    /// Step of the logged torque.
    pub torque_grid: f64,
}

/// State in which the simulation begins, load units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Start {
    /// Position of the motor.
    pub position: f64,
    /// Speed of motor and table.
    pub velocity: f64,
    /// Torque that the servo holds.
    pub torque: f64,
}

/// What a simulation does besides the machine file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setup {
    /// Longest plant step, s; a servo cycle is divided into whole steps, and a stiff drive makes them finer where it swings.
    pub step_s: f64,
    /// Longest one where nothing is sudden: a motion that slides on or rests, flanks that do not swing. Shorter than the others: none.
    pub smooth_step_s: f64,
    /// How many times longer the steps are than either asks for; of a spring's no more than twice.
    pub coarser: f64,
    /// Sensors.
    pub sensors: Sensors,
    /// Of the noise and of the phases of periodic effects.
    pub seed: u64,
    /// Start; `None` begins at rest at the first command.
    pub start: Option<Start>,
    /// What the control takes for the speed of its command.
    pub command_speed: CommandSpeed,
}

impl Default for Setup {
    fn default() -> Setup {
        Setup {
            step_s: 25e-6,
            smooth_step_s: 0.0,
            coarser: 1.0,
            sensors: Sensors::default(),
            seed: 0,
            start: None,
            command_speed: CommandSpeed::default(),
        }
    }
}

/// A simulated recording: one value a servo cycle, load units and the drive's own unit.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Trace {
    /// From zero.
    pub time_s: Vec<f64>,
    /// As given.
    pub command: Vec<f64>,
    /// Motor encoder.
    pub position: Vec<f64>,
    /// Scale at the table.
    pub table_position: Vec<f64>,
    /// What the drive says the motor delivers.
    pub torque: Vec<f64>,
}

/// Simulates an axis along a command (load units, one value a servo cycle); phases of periodic effects come from the seed.
///
/// # Errors
/// The axis has no servo, a setting is out of range, or the effects contradict the inertia; the sentence says which.
pub fn simulate(axis: &Axis, command: &[f64], setup: &Setup) -> Result<Trace, String> {
    simulate_watched(axis, command, setup, &mut |_| ())
}

/// Cycles after which it is told again how far a simulation is.
const TOLD_EVERY: usize = 128;

/// The same; `watch` is told from time to time what share of the cycles is done.
///
/// # Errors
/// As [`simulate`].
pub fn simulate_watched(
    axis: &Axis,
    command: &[f64],
    setup: &Setup,
    watch: &mut dyn FnMut(f64),
) -> Result<Trace, String> {
    let mut physics = Physics::of(axis)?;
    let mut noise = Noise::new(setup.seed);
    let ripples = physics.cogging.iter_mut().chain(&mut physics.vibration).chain(&mut physics.table_error);
    ripples.for_each(|ripple| ripple.phase = TAU * noise.uniform());
    if let Some(row) = command.iter().position(|x| !x.is_finite()) {
        return Err(format!("the command of cycle {row} is not a finite number"));
    }
    let room = || Vec::with_capacity(command.len());
    let mut trace = Trace { position: room(), table_position: room(), torque: room(), ..Trace::default() };
    let cycles = command.iter().enumerate().map(|(cycle, at)| {
        if cycle % TOLD_EVERY == 0 {
            watch(cycle as f64 / command.len() as f64);
        }
        *at
    });
    simulate_cycles(axis, physics, cycles, &[], setup, &mut noise, &mut trace)?;
    let Sensors { torque_noise, torque_grid, .. } = setup.sensors;
    trace.torque.iter_mut().for_each(|torque| *torque = on_grid(*torque + noise.normal(torque_noise), torque_grid));
    let period_s = axis.servo.map_or(0.0, |servo| servo.period_s);
    trace.time_s = (0..command.len()).map(|cycle| cycle as f64 * period_s).collect();
    trace.command = command.to_vec();
    Ok(trace)
}

/// Who takes what a simulation gives: long ones have no room for what is not needed.
pub trait Rows {
    /// What encoder and scale read at the start of the next cycle.
    fn positions(&mut self, motor: f64, table: f64);
    /// What the log says of the torque, for one cycle after the other; some cycles later than the positions where it is early.
    fn torque(&mut self, torque: f64);
}

impl Rows for Trace {
    fn positions(&mut self, motor: f64, table: f64) {
        self.position.push(motor);
        self.table_position.push(table);
    }

    fn torque(&mut self, torque: f64) {
        self.torque.push(torque);
    }
}

/// The same with phases given, and with torque that is added to the servo's in each cycle (empty for none), of a command that is
/// finite; the torque has neither noise nor grid.
///
/// # Errors
/// As [`simulate`].
pub fn simulate_cycles(
    axis: &Axis,
    physics: Physics,
    command: impl Iterator<Item = f64>,
    added: &[f64],
    setup: &Setup,
    noise: &mut Noise,
    rows: &mut impl Rows,
) -> Result<(), String> {
    let servo =
        axis.servo.ok_or("the machine file gives this axis no servo, so that no closed loop can be simulated")?;
    let mut command = command.peekable();
    let Some(&first) = command.peek() else { return Ok(()) };
    let steps = steps_per_cycle(&physics, &servo, setup)?;
    let step_s = servo.period_s / steps as f64;
    let start = setup.start.unwrap_or(Start { position: first, velocity: 0.0, torque: physics.load(first, 0.0, 0.0) });
    let scale = physics.motor_per_load;
    let encoder = Encoder::new(axis.drive, &setup.sensors)?;
    let mut log = TorqueLog::new(servo, physics.delay_s, start.torque);
    let table = physics.clone();
    let (position, velocity) = (start.position * scale, start.velocity * scale);
    let usual_s = setup.coarser * setup.step_s;
    let steps_s = [step_s, usual_s, usual_s.max(setup.smooth_step_s)];
    let mut body = Body::new(physics, steps_s, servo.torque_time_constant_s, [position, velocity], start.torque);
    let mut control = ServoLoop::new(servo, axis.base.torque_limit, position, velocity, start.torque);

    // The value read is that of `late` cycles and `fine` steps ago.
    let age = (setup.sensors.delay_s / step_s).round() as usize;
    let (late, fine) = (age.div_ceil(steps), (steps - age % steps) % steps);
    let mut seen = vec![(body.motor_position(), body.table_position()); late];
    for (cycle, (target, travel)) in setup.command_speed.along(command).enumerate() {
        let now = (body.motor_position(), body.table_position());
        let (motor, table_motor) = if late == 0 { now } else { seen[cycle % late] };
        let read = encoder.read(motor / scale, noise);
        rows.positions(read, encoder.digitise(table.table_of(table_motor / scale), noise));
        let own = control.cycle(target * scale, travel / servo.period_s * scale, read * scale);
        let limit = axis.base.torque_limit;
        let asked = added.get(cycle).map_or(own, |added| (own + added).clamp(-limit, limit));
        log.add(asked, body.torque());
        while let Some(torque) = log.next() {
            rows.torque(torque);
        }
        body.advance(asked, fine);
        if late > 0 {
            seen[cycle % late] = (body.motor_position(), body.table_position());
        }
        body.advance(asked, steps - fine);
    }
    log.end().for_each(|torque| rows.torque(torque));
    Ok(())
}

/// How many times longer than usual the steps may be in which a spring swings.
const COARSEST_SWING: f64 = 2.0;

/// Whole plant steps in a servo cycle.
///
/// # Errors
/// The step is out of range, or the drive so stiff that there would be over a million.
pub(super) fn steps_per_cycle(physics: &Physics, servo: &Servo, setup: &Setup) -> Result<usize, String> {
    let Setup { step_s, coarser, .. } = *setup;
    if !(step_s >= 1e-8 && step_s <= 1.0) {
        return Err(format!("the plant step of {step_s} s is out of range; give one from 1e-8 s to 1 s"));
    }
    let spring = physics
        .two_masses
        .map_or(f64::INFINITY, |masses| longest_step_s(&masses, masses.motor_inertia.min(masses.table_inertia)));
    let step_s = (coarser * step_s).min(coarser.min(COARSEST_SWING) * spring);
    let steps = (servo.period_s / step_s - 1e-9).ceil().max(1.0);
    if steps > 1e6 {
        return Err("the drive is so stiff against its inertia that a cycle would take over a million steps".into());
    }
    Ok(steps as usize)
}

/// Encoder on the motor, with its errors; also the grid and noise of the scale.
struct Encoder {
    scale: f64,
    eccentricity: Ripple,
    grid: f64,
    noise: f64,
}

impl Encoder {
    fn new(drive: Drive, sensors: &Sensors) -> Result<Encoder, String> {
        let revolution = match drive {
            Drive::BallScrew { lead_mm } => lead_mm,
            Drive::Rotary { ratio } => 360.0 / ratio,
            Drive::Linear if sensors.eccentricity_um != 0.0 => {
                return Err("a linear drive's encoder does not turn and has no eccentricity; leave it out".into());
            }
            Drive::Linear => f64::INFINITY,
        };
        let eccentricity = Ripple { amplitude: 1e-3 * sensors.eccentricity_um, wave: TAU / revolution, phase: 0.0 };
        let values = [sensors.grid_um, sensors.noise_um, sensors.delay_s, sensors.torque_noise, sensors.torque_grid];
        if values.iter().any(|value| !(*value >= 0.0 && value.is_finite())) || sensors.delay_s > 1.0 {
            return Err("grid, noise and delay of the sensors must be 0 or more, the delay at most 1 s".into());
        }
        let scale = 1.0 + 1e-6 * sensors.scale_um_m;
        Ok(Encoder { scale, eccentricity, grid: 1e-3 * sensors.grid_um, noise: 1e-3 * sensors.noise_um })
    }

    fn read(&self, x: f64, noise: &mut Noise) -> f64 {
        let off = if self.eccentricity.amplitude == 0.0 { 0.0 } else { self.eccentricity.at(x) };
        self.digitise(x * self.scale + off, noise)
    }

    fn digitise(&self, x: f64, noise: &mut Noise) -> f64 {
        on_grid(x + noise.normal(self.noise), self.grid)
    }
}

fn on_grid(x: f64, grid: f64) -> f64 {
    if grid > 0.0 { (x / grid).round() * grid } else { x }
}

/// The torque column: what the current said `delay_s` before the row (after it where negative).
struct TorqueLog {
    servo: Servo,
    delay_s: f64,
    start: f64,
    /// Cycles so far, and rows that have been said.
    cycles: usize,
    rows: usize,
    /// Of each of the last cycles what was asked for and the motor's torque at its start: as far back as the next row needs.
    last: VecDeque<(f64, f64)>,
}

impl TorqueLog {
    fn new(servo: Servo, delay_s: f64, start: f64) -> Self {
        Self { servo, delay_s, start, cycles: 0, rows: 0, last: VecDeque::new() }
    }

    fn add(&mut self, asked: f64, begin: f64) {
        self.cycles += 1;
        self.last.push_back((asked, begin));
    }

    /// The torque of the next row, once it is known.
    fn next(&mut self) -> Option<f64> {
        if self.rows == self.cycles {
            return None;
        }
        let period = self.servo.period_s;
        // Rounded to a millionth of a cycle, so that a delay of whole cycles meets their starts.
        let place = ((self.rows as f64 - self.delay_s / period) * 1e6).round() / 1e6;
        if place < 0.0 {
            self.rows += 1;
            return Some(self.start);
        }
        let back = self.cycles.checked_sub(place as usize).filter(|back| *back > 0)?;
        while self.last.len() > back {
            self.last.pop_front();
        }
        let (asked, begin) = *self.last.front()?;
        let since = place.fract() * period;
        let lag = self.servo.torque_time_constant_s;
        let left = match (lag > 0.0, since > 0.0) {
            (true, _) => (-since / lag).exp(),
            (false, true) => 0.0,
            (false, false) => 1.0,
        };
        self.rows += 1;
        Some(asked + (begin - asked) * left)
    }

    /// The torque of the rows that are left when no more cycles come: what was asked for last.
    fn end(self) -> impl Iterator<Item = f64> {
        let asked = self.last.back().map_or(self.start, |(asked, _)| *asked);
        std::iter::repeat_n(asked, self.cycles - self.rows)
    }
}
