//! Torque that was added to the servo's own: disturbance pulses, an excitation, a feed-forward that the machine file lacks.
//!
//! A recording holds what the servo makes its torque of, command and encoder. What the torque column holds beyond the law of
//! the servo, d = T − u (u delayed by the motor's time constant), somebody added, and a closed loop that is to repeat the
//! recording needs it as much as the command. Noise must not be taken for it: only rows that stand out of it count, and only
//! where the law holds in the others, so that d is white there.

use super::linear::rms;
use super::observed::Observed;
use super::servo::{CommandSpeed, ServoLoop};
use super::stretches::LONGEST_IN_MOTION;
use crate::machine::{Axis, Servo};
use std::ops::Range;

/// What was added to the servo's torque.
#[derive(Debug, Clone, PartialEq)]
pub struct Added {
    /// Drive's own unit, one value a servo cycle; zero where nothing stood out of the noise.
    pub torque: Vec<f64>,
    /// What they are to be told by.
    pub pulses: Pulses,
}

/// What a reader is told of torque that was added.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pulses {
    /// Stretches of cycles in which something was added.
    pub count: usize,
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

/// Contiguous blocks over which another speed of the command must come closer, and its mean gain over the deviation of that. Most of
/// the gain lies in the few blocks with the rapids, so that the ratio is never far from ±3 even where there is no doubt, and noise of
/// the torque brings it down; who takes the other speed lets the position confirm it, which tells the two apart by far.
const BLOCKS: usize = 24;
const LIKELY: f64 = 1.0;

/// What a recording says of the servo by its law alone: the same of every machine with that drive and servo.
#[derive(Debug)]
pub struct ByServo {
    pub(super) speed: CommandSpeed,
    /// What was added to the servo's torque by the usual speed, and by the one that it seems to take where that is another.
    pub(super) added: [Option<Added>; 2],
    /// Torque that the servo held in the first row, see [`ByLaw::held_at_start`].
    pub(super) held_at_start: Option<f64>,
}

impl ByServo {
    /// That of a recording with one row a servo cycle and no gap; of others nothing is known.
    #[must_use]
    pub fn of(axis: &Axis, observed: &Observed) -> Self {
        let laws = laws(axis, observed);
        let speed = command_speed(&laws);
        let by = |speed| laws.iter().find(|law| law.speed == speed).and_then(ByLaw::added);
        let other = (speed != CommandSpeed::Central).then(|| by(speed)).flatten();
        let held_at_start = laws.iter().find(|law| law.speed == speed).and_then(ByLaw::held_at_start);
        Self { speed, added: [by(CommandSpeed::Central), other], held_at_start }
    }
}

/// What was added, by a recording with one row a servo cycle and no gap; `None` where nothing was, or nobody can know.
#[must_use]
pub fn added(axis: &Axis, observed: &Observed, speed: CommandSpeed) -> Option<Added> {
    ByLaw::of(axis, observed, speed)?.added()
}

/// The servo's law by what the control may take for the speed of its command, the usual one first.
fn laws<'o>(axis: &'o Axis, observed: &'o Observed) -> Vec<ByLaw<'o>> {
    let fed_forward = axis.servo.as_ref().is_some_and(|servo| servo.velocity_feedforward != 0.0);
    let speeds = CommandSpeed::ALL.into_iter().take(if fed_forward { CommandSpeed::ALL.len() } else { 1 });
    speeds.filter_map(|speed| ByLaw::of(axis, observed, speed)).collect()
}

/// What the control takes for the speed of its command: what brings the servo's law most likely closest to the torque column,
/// whatever the machine does.
fn command_speed(laws: &[ByLaw]) -> CommandSpeed {
    let [usual, others @ ..] = laws else { return CommandSpeed::Central };
    if others.is_empty() {
        return CommandSpeed::Central;
    }
    // What was added in a few cycles counts no more than noise does at its largest.
    let spread = laws.iter().map(|law| law.spread).fold(f64::INFINITY, f64::min);
    let most = STANDS_OUT * spread / NORMAL_MEDIAN;
    let usual = usual.squares(most);
    let gained = |law: &ByLaw| {
        let gains: Vec<f64> = usual.iter().zip(law.squares(most)).map(|(usual, own)| usual - own).collect();
        let n = gains.len() as f64;
        let mean = gains.iter().sum::<f64>() / n;
        let variance = gains.iter().map(|gain| (gain - mean).powi(2)).sum::<f64>() / (n - 1.0);
        (mean > LIKELY * (variance / n).sqrt()).then_some((law.speed, mean))
    };
    let best = others.iter().filter_map(gained).max_by(|a, b| a.1.total_cmp(&b.1));
    best.map_or(CommandSpeed::Central, |(speed, _)| speed)
}

/// The torque column beside the servo's law. The law's own torque is worked out whenever it is asked for: long recordings have no
/// room for it.
struct ByLaw<'o> {
    axis: &'o Axis,
    servo: &'o Servo,
    observed: &'o Observed,
    command: &'o [f64],
    speed: CommandSpeed,
    /// The column belongs to the cycle where it comes closest: cycles later than the earliest it may be.
    late: usize,
    /// Median of the difference, and of how far it is from there.
    level: f64,
    spread: f64,
    /// Median of how far it goes in a cycle.
    change: f64,
}

impl<'o> ByLaw<'o> {
    /// `None` where rows are not cycles without a gap, or no command was recorded.
    fn of(axis: &'o Axis, observed: &'o Observed, speed: CommandSpeed) -> Option<Self> {
        let (servo, command) = (axis.servo.as_ref()?, observed.command.as_deref()?);
        if !observed.is_a_row_a_cycle(servo) || !command.iter().all(|x| x.is_finite()) {
            return None;
        }
        let law = Self { axis, servo, observed, command, speed, late: 0, level: 0.0, spread: 0.0, change: 0.0 };
        // Enough cycles for a median: which, its own torque, and that of the next.
        let mut some: Vec<(usize, [f64; 2])> = Vec::new();
        let mut wanted = law.inner().step_by(observed.time_s.len().div_ceil(ENOUGH).max(1)).peekable();
        for (cycle, own) in law.own_torque().enumerate() {
            if let Some((_, own_torques)) = some.last_mut().filter(|(last, _)| last + 1 == cycle) {
                own_torques[1] = own;
            }
            if wanted.next_if_eq(&cycle).is_some() {
                some.push((cycle, [own, f64::NAN]));
            }
        }
        let at = |late: usize| {
            let difference = |(cycle, [own, _]): &(usize, [f64; 2])| law.measured(late, *cycle) - own;
            let level = median(some.iter().map(difference))?;
            Some((late, level, median(some.iter().map(|cycle| (difference(cycle) - level).abs()))?))
        };
        let (late, level, spread) = (0..=2 * FARTHEST).filter_map(at).min_by(|a, b| a.2.total_cmp(&b.2))?;
        let goes = |(cycle, [own, next]): &(usize, [f64; 2])| {
            ((law.measured(late, cycle + 1) - next) - (law.measured(late, *cycle) - own)).abs()
        };
        let change = median(some.iter().map(goes))?;
        Some(Self { late, level, spread, change, ..law })
    }

    /// The torque column where it belongs to a cycle.
    fn measured(&self, late: usize, cycle: usize) -> f64 {
        self.observed.torque[cycle + late - FARTHEST]
    }

    /// Cycles for which the column has a row wherever it belongs, and the one after has, too.
    fn inner(&self) -> Range<usize> {
        FARTHEST..self.observed.torque.len().saturating_sub(FARTHEST + 1)
    }

    /// How far the column is from its usual difference to the law, in those cycles where it is known.
    fn beyond(&self) -> impl Iterator<Item = (usize, f64)> {
        let inner = self.inner();
        let own = self.own_torque().enumerate().take(inner.end).skip(inner.start);
        own.map(|(cycle, own)| (cycle, self.measured(self.late, cycle) - own - self.level))
            .filter(|(_, d)| d.is_finite())
    }

    /// Sums of the squares of that over contiguous blocks, none larger than `most`.
    fn squares(&self, most: f64) -> Vec<f64> {
        let (first, block) = (self.inner().start, self.inner().len().div_ceil(BLOCKS).max(1));
        let mut sums = vec![0.0; self.inner().len().div_ceil(block)];
        for (cycle, beyond) in self.beyond() {
            sums[(cycle - first) / block] += beyond.clamp(-most, most).powi(2);
        }
        sums
    }

    /// Torque that the servo held in the first row: what its integral had come to by then is between the law and the torque column
    /// ever after, so that all rows tell it. `None` of a servo that keeps no integral.
    fn held_at_start(&self) -> Option<f64> {
        self.servo.velocity_integral_time_s?;
        Some(self.observed.torque.first()? + self.level).filter(|torque| torque.is_finite())
    }

    /// What was added by this law; `None` where nothing was, or where it may be the law that is wrong.
    fn added(&self) -> Option<Added> {
        let measured = &self.observed.torque;
        let (noise, worth) = (
            STANDS_OUT * self.spread / NORMAL_MEDIAN,
            WORTH * rms(measured.iter().copied().filter(|torque| torque.is_finite())),
        );
        // White noise changes by √2 of itself from cycle to cycle, what a wrong law leaves by less than itself.
        if noise > worth && self.change < self.spread {
            return None;
        }
        let hidden = LONGEST_IN_MOTION + remembered(self.servo);
        // Zeros that stay so take no memory.
        let mut torque = vec![0.0; measured.len()];
        let (mut pulses, mut before) = (Pulses { count: 0, largest: 0.0 }, (0, 0.0));
        for (cycle, d) in self.beyond() {
            let beyond = if d.abs() > noise.max(worth) { d } else { 0.0 };
            if beyond != 0.0 {
                torque[cycle] = beyond;
                pulses.count += usize::from(before.1 == 0.0);
                pulses.largest = pulses.largest.max(beyond.abs());
            }
            if before.1 != 0.0 && beyond != 0.0 && cycle - before.0 <= hidden {
                // A pulse goes on over the cycles that lost rows hide.
                let step = (beyond - before.1) / (cycle - before.0) as f64;
                (before.0 + 1..cycle).for_each(|row| torque[row] = before.1 + step * (row - before.0) as f64);
            }
            before = (cycle, beyond);
        }
        if pulses.count == 0 {
            return None;
        }
        ask_for(self.servo, &mut torque);
        Some(Added { torque, pulses })
    }

    /// The motor's torque at the start of each cycle by the servo's law alone, from the recorded command and encoder; NaN where
    /// it goes back to an encoder that was not recorded but filled in, as the torque beside it was not recorded.
    fn own_torque(&self) -> impl Iterator<Item = f64> {
        let (servo, observed) = (*self.servo, self.observed);
        let scale = self.axis.drive.motor_per_load();
        let command = self.command.iter().copied();
        let (rest, velocity) = (rest_of_a_cycle(&servo), observed.motion.velocity(0));
        let remembered = remembered(&servo);
        let mut torque = observed.torque[0];
        let start = observed.position[0] * scale;
        let mut control = ServoLoop::new(servo, self.axis.base.torque_limit, start, velocity * scale, torque);
        let mut unknown = 0_usize;
        let rows = self.speed.along(command).zip(observed.position.iter().zip(&observed.torque));
        rows.map(move |((command, travel), (position, measured))| {
            unknown = if measured.is_finite() { unknown.saturating_sub(1) } else { remembered };
            let at_start = if unknown > 0 { f64::NAN } else { torque };
            let asked = control.cycle(command * scale, travel / servo.period_s * scale, position * scale);
            torque = asked + (torque - asked) * rest;
            at_start
        })
    }
}

/// Makes of what the motor's torque is to be more at the start of each cycle what the servo must be asked for beside its own.
fn ask_for(servo: &Servo, beyond: &mut [f64]) {
    let rest = rest_of_a_cycle(servo);
    for cycle in 0..beyond.len() {
        let (now, next) = (beyond[cycle], beyond.get(cycle + 1).copied().unwrap_or(0.0));
        let asked = (next - now * rest) / (1.0 - rest);
        if asked != 0.0 || now != 0.0 {
            beyond[cycle] = asked;
        }
    }
}

/// Cycles for which an encoder that was filled in is in the motor's torque: those of its speed, and until a hundredth of that is
/// left by the lag.
fn remembered(servo: &Servo) -> usize {
    4 + (0.01f64.ln() / rest_of_a_cycle(servo).max(1e-9).ln()).min(1e3) as usize
}

/// What is left after a cycle of a difference between the motor's torque and what it is asked for.
fn rest_of_a_cycle(servo: &Servo) -> f64 {
    if servo.torque_time_constant_s > 0.0 { (-servo.period_s / servo.torque_time_constant_s).exp() } else { 0.0 }
}

/// Of those that are known.
pub(super) fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.filter(|value| value.is_finite()).collect();
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}
