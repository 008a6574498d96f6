//! Torque that was added to the servo's own: disturbance pulses, an excitation, a feed-forward that the machine file lacks.
//!
//! A recording holds what the servo makes its torque of, command and encoder. What the torque column holds beyond the law of
//! the servo, d = T − u (u delayed by the motor's time constant), somebody added, and a closed loop that is to repeat the
//! recording needs it as much as the command. Noise must not be taken for it: only rows that stand out of it count, and only
//! where the law holds in the others, so that d is white there.

use super::closed_loop::command_of_cycles;
use super::linear::rms;
use super::observed::Observed;
use super::servo::ServoLoop;
use super::simulate::speed_of;
use crate::machine::{Axis, Servo};

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

/// What was added, by a recording with one row a servo cycle and no gap; `None` where nothing was, or nobody can know.
#[must_use]
pub fn added(axis: &Axis, observed: &Observed) -> Option<Added> {
    let (servo, command) = (axis.servo.as_ref()?, observed.command.as_ref()?);
    let (measured, rows) = (&observed.torque, observed.time_s.len());
    let known = |values: &[f64]| values.iter().all(|value| value.is_finite());
    let row_a_cycle =
        (observed.period_s / servo.period_s - 1.0).abs() < 1e-3 && observed.runs.first() == Some(&(0..rows));
    if !row_a_cycle || !known(command) || !known(measured) {
        return None;
    }
    let own = own_torque(axis, servo, observed, command);
    let inner = FARTHEST..rows.saturating_sub(FARTHEST + 1);
    let some = || inner.clone().step_by(rows.div_ceil(ENOUGH));

    // The column belongs to the cycle where it comes closest to the servo's law.
    let difference = |late: usize, cycle: usize| measured[cycle + late - FARTHEST] - own[cycle];
    let level_and_spread = |late: usize| {
        let level = median(some().map(|cycle| difference(late, cycle)).collect())?;
        Some((late, level, median(some().map(|cycle| (difference(late, cycle) - level).abs()).collect())?))
    };
    let (late, level, spread) = (0..=2 * FARTHEST).filter_map(level_and_spread).min_by(|a, b| a.2.total_cmp(&b.2))?;
    let change = median(some().map(|cycle| (difference(late, cycle + 1) - difference(late, cycle)).abs()).collect())?;
    let (noise, worth) = (STANDS_OUT * spread / NORMAL_MEDIAN, WORTH * rms(measured.iter().copied()));
    // White noise changes by √2 of itself from cycle to cycle, what a wrong law leaves by less than itself.
    if noise > worth && change < spread {
        return None;
    }
    let mut beyond = vec![0.0; rows];
    for cycle in inner {
        let d = difference(late, cycle) - level;
        beyond[cycle] = if d.abs() > noise.max(worth) { d } else { 0.0 };
    }
    let begins = |pair: &&[f64]| pair[0] == 0.0 && pair[1] != 0.0;
    let pulses = beyond.windows(2).filter(begins).count();
    let largest = beyond.iter().fold(0.0, |largest: f64, d| largest.max(d.abs()));
    (pulses > 0).then(|| Added { torque: asked_for(servo, &beyond), pulses, largest })
}

/// The motor's torque at the start of each cycle by the servo's law alone, from the recorded command and encoder.
fn own_torque(axis: &Axis, servo: &Servo, observed: &Observed, command: &[f64]) -> Vec<f64> {
    let scale = axis.drive.motor_per_load();
    let command = command_of_cycles(&observed.time_s, command, servo.period_s, command.len());
    let (rest, velocity) = (rest_of_a_cycle(servo), observed.motion.velocity[0]);
    let mut torque = observed.torque[0];
    let start = observed.position[0] * scale;
    let mut control = ServoLoop::new(*servo, axis.base.torque_limit, start, velocity * scale, torque);
    let cycle = |(cycle, position): (usize, &f64)| {
        let at_start = torque;
        let speed = speed_of(&command, cycle) / servo.period_s;
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
