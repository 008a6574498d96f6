//! Torque that was added to the servo's own: disturbance pulses, an excitation, a feed-forward that the machine file lacks.
//!
//! A recording holds what the servo makes its torque of, command and encoder. What the torque column holds beyond the law of
//! the servo, d = T − u (u delayed by the motor's time constant), somebody added, and a closed loop that is to repeat the
//! recording needs it as much as the command. Noise must not be taken for it: only rows that stand out of it count, and only
//! where the law holds in the others, so that d is white there.

use super::closed_loop::command_of_cycles;
use super::linear::rms;
use super::observed::Observed;
use super::servo::{CommandSpeed, ServoLoop};
use crate::machine::{Axis, Servo};
use std::ops::Range;

/// What was added to the servo's torque.
#[derive(Debug, Clone, PartialEq)]
pub struct Added {
    /// Drive's own unit, one value a servo cycle; zero where nothing stood out of the noise.
    pub torque: Vec<f64>,
    /// Stretches of cycles in which something was added.
    pub pulses: usize,
    /// The largest amount.
    pub largest: f64,
}

/// Deviations of its noise by which a row stands out: normal noise does not in a hundred million rows.
const STANDS_OUT: f64 = 6.0;
/// The share of the torque's own RMS below which it does not matter what was added, nor whether the law is a little wrong.
const WORTH: f64 = 0.01;
/// Cycles by which the torque column may be early or late.
const FARTHEST: usize = 4;
/// Rows that a median is taken of.
const ENOUGH: usize = 1 << 14;
/// The median of the absolute value of normal noise, in deviations.
const NORMAL_MEDIAN: f64 = 0.6745;

/// Contiguous blocks over which another speed of the command must come closer, and its mean gain over the deviation of that.
const BLOCKS: usize = 24;
const SURELY: f64 = 4.0;

/// What the control may take for the speed of its command, by a recording with one row a servo cycle and no gap: what brings the
/// servo's law surely closest to the torque column, whatever the machine does.
#[must_use]
pub fn command_speed(axis: &Axis, observed: &Observed) -> CommandSpeed {
    if !axis.servo.as_ref().is_some_and(|servo| servo.velocity_feedforward != 0.0) {
        return CommandSpeed::Central;
    }
    let law = |speed: &CommandSpeed| Some((*speed, ByLaw::of(axis, observed, *speed)?));
    let laws: Vec<(CommandSpeed, ByLaw)> = CommandSpeed::ALL.iter().filter_map(law).collect();
    // What was added in a few cycles counts no more than noise does at its largest.
    let spread = laws.iter().map(|(_, law)| law.spread).fold(f64::INFINITY, f64::min);
    let most = STANDS_OUT * spread / NORMAL_MEDIAN;
    let squares = |law: &ByLaw| -> Vec<f64> {
        let square = |cycle: &usize| (law.difference(*cycle) - law.level).clamp(-most, most).powi(2);
        let cycles: Vec<usize> = law.inner().collect();
        cycles.chunks(cycles.len().div_ceil(BLOCKS).max(1)).map(|block| block.iter().map(square).sum()).collect()
    };
    let mut sized = laws.iter().map(|(speed, law)| (*speed, squares(law)));
    let Some((_, usual)) = sized.next() else { return CommandSpeed::Central };
    let gained = |(speed, own): (CommandSpeed, Vec<f64>)| {
        let gains: Vec<f64> = usual.iter().zip(own).map(|(usual, own)| usual - own).collect();
        let n = gains.len() as f64;
        let mean = gains.iter().sum::<f64>() / n;
        let variance = gains.iter().map(|gain| (gain - mean).powi(2)).sum::<f64>() / (n - 1.0);
        (mean > SURELY * (variance / n).sqrt()).then_some((speed, mean))
    };
    let best = sized.filter_map(gained).max_by(|a, b| a.1.total_cmp(&b.1));
    best.map_or(CommandSpeed::Central, |(speed, _)| speed)
}

/// What was added, by a recording with one row a servo cycle and no gap; `None` where nothing was, or nobody can know.
#[must_use]
pub fn added(axis: &Axis, observed: &Observed, speed: CommandSpeed) -> Option<Added> {
    let law = ByLaw::of(axis, observed, speed)?;
    let change = median(law.some().map(|cycle| (law.difference(cycle + 1) - law.difference(cycle)).abs()).collect())?;
    let (noise, worth) = (STANDS_OUT * law.spread / NORMAL_MEDIAN, WORTH * rms(law.measured.iter().copied()));
    // White noise changes by √2 of itself from cycle to cycle, what a wrong law leaves by less than itself.
    if noise > worth && change < law.spread {
        return None;
    }
    let mut beyond = vec![0.0; law.measured.len()];
    for cycle in law.inner() {
        let d = law.difference(cycle) - law.level;
        beyond[cycle] = if d.abs() > noise.max(worth) { d } else { 0.0 };
    }
    let begins = |pair: &&[f64]| pair[0] == 0.0 && pair[1] != 0.0;
    let pulses = beyond.windows(2).filter(begins).count();
    let largest = beyond.iter().fold(0.0, |largest: f64, d| largest.max(d.abs()));
    let servo = axis.servo.as_ref().filter(|_| pulses > 0)?;
    Some(Added { torque: asked_for(servo, &beyond), pulses, largest })
}

/// The torque column beside the servo's law.
struct ByLaw<'o> {
    measured: &'o [f64],
    /// The motor's torque at the start of each cycle by the law alone.
    own: Vec<f64>,
    /// The column belongs to the cycle where it comes closest: cycles later than the earliest it may be.
    late: usize,
    /// Median of the difference, and of how far it is from there.
    level: f64,
    spread: f64,
}

impl<'o> ByLaw<'o> {
    /// `None` where rows are not cycles without a gap, or something was not recorded.
    fn of(axis: &Axis, observed: &'o Observed, speed: CommandSpeed) -> Option<Self> {
        let (servo, command) = (axis.servo.as_ref()?, observed.command.as_ref()?);
        let (measured, rows) = (observed.torque.as_slice(), observed.time_s.len());
        let known = |values: &[f64]| values.iter().all(|value| value.is_finite());
        let row_a_cycle =
            (observed.period_s / servo.period_s - 1.0).abs() < 1e-3 && observed.runs.first() == Some(&(0..rows));
        if !row_a_cycle || !known(command) || !known(measured) {
            return None;
        }
        let own = own_torque(axis, servo, observed, command, speed);
        let law = Self { measured, own, late: 0, level: 0.0, spread: 0.0 };
        let at = |late: usize| {
            let difference = |cycle| law.difference_at(late, cycle);
            let level = median(law.some().map(difference).collect())?;
            Some((late, level, median(law.some().map(|cycle| (difference(cycle) - level).abs()).collect())?))
        };
        let (late, level, spread) = (0..=2 * FARTHEST).filter_map(at).min_by(|a, b| a.2.total_cmp(&b.2))?;
        Some(Self { late, level, spread, ..law })
    }

    fn difference(&self, cycle: usize) -> f64 {
        self.difference_at(self.late, cycle)
    }

    fn difference_at(&self, late: usize, cycle: usize) -> f64 {
        self.measured[cycle + late - FARTHEST] - self.own[cycle]
    }

    /// Cycles for which the column has a row wherever it belongs, and the one after has, too.
    fn inner(&self) -> Range<usize> {
        FARTHEST..self.measured.len().saturating_sub(FARTHEST + 1)
    }

    /// Enough of them for a median.
    fn some(&self) -> impl Iterator<Item = usize> {
        self.inner().step_by(self.measured.len().div_ceil(ENOUGH).max(1))
    }
}

/// The motor's torque at the start of each cycle by the servo's law alone, from the recorded command and encoder.
fn own_torque(axis: &Axis, servo: &Servo, observed: &Observed, command: &[f64], speed: CommandSpeed) -> Vec<f64> {
    let scale = axis.drive.motor_per_load();
    let command = command_of_cycles(&observed.time_s, command, servo.period_s, command.len());
    let (rest, velocity) = (rest_of_a_cycle(servo), observed.motion.velocity[0]);
    let mut torque = observed.torque[0];
    let start = observed.position[0] * scale;
    let mut control = ServoLoop::new(*servo, axis.base.torque_limit, start, velocity * scale, torque);
    let cycle = |(cycle, position): (usize, &f64)| {
        let at_start = torque;
        let speed = speed.of(&command, cycle) / servo.period_s;
        let asked = control.cycle(command[cycle] * scale, speed * scale, position * scale);
        torque = asked + (torque - asked) * rest;
        at_start
    };
    observed.position.iter().enumerate().map(cycle).collect()
}

/// What the servo must be asked for beside its own, so that the motor's torque at the start of each cycle is `beyond` more.
fn asked_for(servo: &Servo, beyond: &[f64]) -> Vec<f64> {
    let rest = rest_of_a_cycle(servo);
    let next = beyond.iter().skip(1).chain(std::iter::once(&0.0));
    beyond.iter().zip(next).map(|(now, next)| (next - now * rest) / (1.0 - rest)).collect()
}

/// What is left after a cycle of a difference between the motor's torque and what it is asked for.
fn rest_of_a_cycle(servo: &Servo) -> f64 {
    if servo.torque_time_constant_s > 0.0 { (-servo.period_s / servo.torque_time_constant_s).exp() } else { 0.0 }
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}
