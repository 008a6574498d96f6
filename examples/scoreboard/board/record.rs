//! The servo that a machine file describes, closed around the true machine, and the row it logs every cycle.
//!
//! Per cycle of Ts: the encoder is read and the row is logged (position and torque of this instant, command of this
//! cycle), then v = (x[i] − x[i−1])/Ts (or of the mean of two samples), e = Kp·(command − x) + ff·dcommand/dt − v,
//! u = Kv·(e + I) within the limit, I += e·Ts/Ti unless limited; u is held for the cycle. dcommand/dt is the speed that
//! the interpolator has at this instant.

use super::integrate::Machine;
use super::moves::Command;
use super::random::Random;
use super::rig::{Rig, ServoGains};
use super::truth::Truth;
use std::io::{BufWriter, Write};
use std::path::Path;

/// What was logged, and what only the generator knows.
pub struct Recording {
    pub period: f64,
    pub command: Vec<f64>,
    /// Load units, on the encoder's grid.
    pub position: Vec<f64>,
    /// Load units, where the rig has a scale.
    pub table: Option<Vec<f64>>,
    /// With noise.
    pub torque: Vec<f64>,
    /// The part of the noise-free logged torque that the belief, given the true motion, leaves unexplained.
    pub unexplained: Vec<f64>,
    /// Noise-free table − motor, load units.
    pub table_error: Vec<f64>,
    /// Noise-free torque as logged.
    pub clean_torque: Vec<f64>,
    /// True motor position, load units.
    pub true_position: Vec<f64>,
    /// The servo asked for more than the limit in this many cycles.
    pub limited: usize,
}

/// The controller, in motor units.
pub struct Servo {
    gains: ServoGains,
    limit: f64,
    integral: f64,
    before: [f64; 2],
}

impl Servo {
    pub fn new(gains: ServoGains, limit: f64, x: f64) -> Self {
        Self { gains, limit, integral: 0.0, before: [x; 2] }
    }

    /// One cycle: torque to hold until the next, and whether it is limited.
    pub fn cycle(&mut self, command: f64, rate: f64, x: f64) -> (f64, bool) {
        let g = &self.gains;
        let v = if g.two_sample_mean { 0.5 * (x - self.before[1]) } else { x - self.before[0] } / g.period;
        let e = g.position_gain * (command - x) + g.feedforward * rate - v;
        let asked = g.velocity_gain * (e + self.integral);
        let limited = asked.abs() > self.limit;
        if let (Some(ti), false) = (g.integral_time, limited) {
            self.integral += e * g.period / ti;
        }
        self.before = [x, self.before[0]];
        (asked.clamp(-self.limit, self.limit), limited)
    }
}

fn on_grid(x: f64, step: f64) -> f64 {
    if step > 0.0 { (x / step).round() * step } else { x }
}

/// Runs the true machine under its servo along `command` (load units, one per cycle) with a plant step of at most `step` s.
pub fn run(rig: &Rig, truth: &Truth, command: &Command, step: f64, noise: &mut Random) -> Recording {
    let period = rig.servo.period;
    let steps = (period / step).ceil() as usize;
    let h = period / steps as f64;
    let machine = Machine::new(truth, rig.servo.lag);
    let mut motion = machine.at_rest(command.position[0] / rig.unit);
    // The torque column is the torque of `delay` ago: whole rows, and steps within a row. A torque that is early is
    // logged that much later in the run, and moved up by as many rows.
    let shift = (truth.delay / h).round() as i64;
    let (rows_late, phase) = (shift.div_euclid(steps as i64), shift.rem_euclid(steps as i64) as usize);
    // Step of a cycle at which the torque is caught: at the row itself, or `phase` steps before the next row.
    let catch = if phase == 0 { 0 } else { steps - phase };

    let rows = command.position.len();
    let mut out = Recording {
        period,
        command: command.position.clone(),
        position: Vec::with_capacity(rows),
        table: rig.table.map(|_| Vec::with_capacity(rows)),
        torque: Vec::new(),
        unexplained: Vec::with_capacity(rows),
        table_error: Vec::with_capacity(rows),
        clean_torque: Vec::new(),
        true_position: Vec::with_capacity(rows),
        limited: 0,
    };
    let start = on_grid(command.position[0], rig.encoder_step) / rig.unit;
    let mut servo = Servo::new(rig.servo, rig.limit, start);
    // Below this speed the sign of the motion cannot be seen on the encoder.
    let still = 0.5 * rig.encoder_step / period / rig.unit;
    let mut caught = Vec::with_capacity(rows);
    let mut believed = Vec::with_capacity(rows);
    for (&c, &rate) in command.position.iter().zip(&command.speed) {
        let x = motion.q[0] * rig.unit;
        let noisy = if rig.rough.encoder_noise > 0.0 { x + rig.rough.encoder_noise * noise.normal() } else { x };
        let seen = on_grid(noisy, rig.encoder_step);
        out.position.push(seen);
        out.true_position.push(x);
        let table_at = truth.scale_reads(machine.table(&motion) * rig.unit);
        out.table_error.push(table_at - x);
        if let (Some(column), Some(scale)) = (&mut out.table, rig.table) {
            column.push(on_grid(table_at + scale.zero + scale.noise * noise.normal(), scale.step));
        }
        let a = machine.motor_acceleration(&motion);
        let without_dry = rig.inertia * a + rig.viscous * motion.w[0] + rig.constant;
        believed.push((without_dry, if motion.w[0].abs() > still { motion.w[0].signum() } else { 0.0 }));
        let (u, limited) = servo.cycle(c / rig.unit, rate / rig.unit, seen / rig.unit);
        out.limited += usize::from(limited);
        let u = (u + rig.rough.pulse(motion.t)).clamp(-rig.limit, rig.limit);
        for k in 0..steps {
            if k == catch {
                caught.push(motion.torque);
            }
            machine.step(&mut motion, u, h);
        }
    }
    // caught[i] is of step `catch` of cycle i; the torque of row i − delay is that of cycle i − rows_late − (phase > 0).
    let back = rows_late + i64::from(phase > 0);
    for (i, &(without_dry, sign)) in believed.iter().enumerate() {
        let from = (i as i64 - back).clamp(0, rows as i64 - 1) as usize;
        out.clean_torque.push(caught[from]);
        let rest = caught[from] - without_dry;
        // At rest friction takes any value up to its level: only what is beyond that is unexplained.
        let left = if sign == 0.0 { rest - rest.clamp(-rig.coulomb, rig.coulomb) } else { rest - sign * rig.coulomb };
        out.unexplained.push(left);
        out.torque.push(on_grid(caught[from] + rig.torque_noise * noise.normal(), rig.torque_step));
    }
    out.thinned(rig.every)
}

impl Recording {
    /// What a recorder keeps that takes one cycle in `every`.
    fn thinned(mut self, every: usize) -> Self {
        let keep = |column: &mut Vec<f64>| *column = column.iter().step_by(every).copied().collect();
        let columns = [
            &mut self.command,
            &mut self.position,
            &mut self.torque,
            &mut self.unexplained,
            &mut self.table_error,
            &mut self.clean_torque,
            &mut self.true_position,
        ];
        columns.into_iter().chain(self.table.as_mut()).for_each(keep);
        self.period *= every as f64;
        self
    }

    /// Rows in which the true speed keeps its sign and is above `least` (load units/s) for five rows either side.
    pub fn moves(&self, least: f64) -> Vec<bool> {
        let way = least * self.period;
        let step = |i: usize| self.true_position[i + 1] - self.true_position[i];
        let last = self.true_position.len().saturating_sub(1);
        (0..=last)
            .map(|i| {
                let around = i.saturating_sub(5)..(i + 5).min(last);
                around.clone().all(|j| step(j) > way) || around.clone().all(|j| step(j) < -way)
            })
            .collect()
    }

    /// Writes the recording in the exchange format.
    pub fn write(&self, rig: &Rig, path: &Path) -> std::io::Result<()> {
        let mut file = BufWriter::new(std::fs::File::create(path)?);
        let (unit, factor, decimals) = rig.column;
        write!(file, "time_s,x.position_command_{unit},x.position_{unit}")?;
        if self.table.is_some() {
            write!(file, ",x.table_position_{unit}")?;
        }
        writeln!(file, ",x.{}", if rig.linear() { "force_n" } else { "torque_nm" })?;
        for i in 0..self.command.len() {
            write!(file, "{:.7}", i as f64 * self.period)?;
            let table = self.table.as_ref().map(|t| t[i]);
            for x in [self.command[i], self.position[i]].into_iter().chain(table) {
                write!(file, ",{:.decimals$}", x * factor)?;
            }
            writeln!(file, ",{:.6}", self.torque[i])?;
        }
        file.flush()
    }
}

/// Root mean square about the mean.
pub fn spread(values: &[f64]) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
    rms(&values.iter().map(|v| v - mean).collect::<Vec<_>>())
}

pub fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::moves;

    fn rig(seed: u64) -> Rig {
        Rig { every: 1, ..Rig::draw(&mut Random::new(seed, 9), 10.0) }
    }

    fn command(rig: &Rig) -> Command {
        let (start, segments) = moves::draw(&mut Random::new(4, 4), &rig.reach, rig.duration, 0.3);
        moves::sample(start, &segments, rig.servo.period, rig.duration, rig.smoothing)
    }

    #[test]
    fn the_servo_does_the_sums_of_the_contract() {
        let gains = ServoGains {
            period: 0.001,
            position_gain: 40.0,
            velocity_gain: 0.5,
            integral_time: Some(0.02),
            feedforward: 1.0,
            lag: 0.0,
            two_sample_mean: false,
        };
        let mut servo = Servo::new(gains, 16.0, 0.0);
        // v = 0, e = 40·0.01 + 10 = 10.4, u = 0.5·10.4 = 5.2; I = 10.4·0.001/0.02 = 0.52
        assert!((servo.cycle(0.01, 10.0, 0.0).0 - 5.2).abs() < 1e-12);
        // v = 4, e = 40·(0.02 − 0.004) + 10 − 4 = 6.64, u = 0.5·(6.64 + 0.52) = 3.58; I = 0.852
        assert!((servo.cycle(0.02, 10.0, 0.004).0 - 3.58).abs() < 1e-12);
        // Limited: e = 40·0.996 + 980 − 0 = 1019.84, u > 16, and I stays 0.852.
        assert_eq!(servo.cycle(1.0, 980.0, 0.004), (16.0, true));
        // Limited the other way by e = −996; then at rest on the command only I is left.
        assert_eq!(servo.cycle(0.004, -996.0, 0.004), (-16.0, true));
        assert!((servo.cycle(0.004, 0.0, 0.004).0 - 0.5 * 0.852).abs() < 1e-12);
        // Mean of two samples: v = (x[i] − x[i−2])/(2·Ts) = (0.004 − 0)/0.002 = 2 in the second cycle.
        let mut servo = Servo::new(ServoGains { two_sample_mean: true, integral_time: None, ..gains }, 16.0, 0.0);
        servo.cycle(0.0, 0.0, 0.0);
        assert!((servo.cycle(0.0, 0.0, 0.004).0 - 0.5 * (-0.16 - 2.0)).abs() < 1e-12);
    }

    #[test]
    fn a_machine_as_believed_leaves_nothing_unexplained() {
        for seed in 0..12 {
            let rig = rig(seed);
            let r = run(&rig, &Truth::of(&rig), &command(&rig), 1e-5, &mut Random::new(1, 1));
            let left = rms(&r.unexplained);
            assert!(left < 0.02 * rig.torque_floor(), "seed {seed}: {left} of {}", rig.torque_floor());
            // Diligence: something moved and the torque was of the order of the friction.
            assert!(rms(&r.clean_torque) > 0.3 * rig.coulomb, "seed {seed}");
            assert!(rms(&r.table_error) == 0.0);
        }
    }

    #[test]
    fn the_logged_noise_and_grid_are_those_of_the_rig() {
        let rig = Rig { torque_step: 0.0, ..rig(5) };
        let r = run(&rig, &Truth::of(&rig), &command(&rig), 2e-5, &mut Random::new(1, 1));
        let noise: Vec<f64> = r.torque.iter().zip(&r.clean_torque).map(|(a, b)| a - b).collect();
        assert!((rms(&noise) / rig.torque_noise - 1.0).abs() < 0.03, "{}", rms(&noise) / rig.torque_noise);
        for (seen, x) in r.position.iter().zip(&r.true_position) {
            assert!((seen - x).abs() <= 0.501 * rig.encoder_step);
            assert!((seen / rig.encoder_step - (seen / rig.encoder_step).round()).abs() < 1e-3);
        }
    }

    #[test]
    fn a_finer_step_changes_less_than_the_noise() {
        for seed in 0..6 {
            let rig = rig(seed);
            let c = command(&rig);
            let at = |step| run(&rig, &Truth::of(&rig), &c, step, &mut Random::new(1, 1)).clean_torque;
            let (coarse, fine) = (at(1e-5), at(2.5e-6));
            let change: Vec<f64> = coarse.iter().zip(&fine).map(|(a, b)| a - b).collect();
            // The grid of the encoder makes two runs part within its own noise, which the floor holds.
            assert!(rms(&change) < 0.35 * rig.torque_floor(), "seed {seed}: {}", rms(&change) / rig.torque_floor());
        }
    }

    #[test]
    fn a_late_torque_column_is_the_same_torque_later() {
        let rig = rig(2);
        let c = command(&rig);
        let at = |delay: f64| {
            let truth = Truth { delay, ..Truth::of(&rig) };
            run(&rig, &truth, &c, 1e-5, &mut Random::new(1, 1))
        };
        let (now, late, early) = (at(0.0), at(3.0 * rig.servo.period), at(-2.0 * rig.servo.period));
        assert_eq!(now.position, late.position);
        for i in 10..now.command.len() - 10 {
            assert_eq!(late.clean_torque[i], now.clean_torque[i - 3]);
            assert_eq!(early.clean_torque[i], now.clean_torque[i + 2]);
        }
        // Half a row late lies between: the lag of the current loop is exponential inside a cycle.
        let half = at(0.5 * rig.servo.period);
        let between = |i: usize| {
            let (a, b) = (now.clean_torque[i - 1], now.clean_torque[i]);
            (half.clean_torque[i] - a) * (half.clean_torque[i] - b) <= 1e-9
        };
        let share = (1..now.command.len()).filter(|&i| between(i)).count() as f64 / now.command.len() as f64;
        assert!(share > 0.999, "{share}");
        let quarter_early = at(-0.25 * rig.servo.period);
        let forward = |i: usize| {
            let (a, b) = (now.clean_torque[i], now.clean_torque[i + 1]);
            (quarter_early.clean_torque[i] - a) * (quarter_early.clean_torque[i] - b) <= 1e-9
        };
        let share = (0..now.command.len() - 1).filter(|&i| forward(i)).count() as f64 / now.command.len() as f64;
        assert!(share > 0.998, "{share}");
    }

    #[test]
    fn at_constant_speed_the_axis_lags_as_the_loop_says() {
        for seed in 0..8 {
            let rig = rig(seed);
            let speed = 0.1 * rig.reach.speed;
            let there = [moves::Segment::Move { to: 4.0 * speed, speed, acceleration: rig.reach.acceleration }];
            let command = moves::sample(0.0, &there, rig.servo.period, 3.5, 0.0);
            let r = run(&rig, &Truth::of(&rig), &command, 1e-5, &mut Random::new(1, 1));
            // Kp·lag + ff·ω − ω + I = T/Kv with T = Tv·ω + Tc + T0, all of it from I where there is one.
            let s = &rig.servo;
            let w = speed / rig.unit;
            let torque = rig.viscous * w + rig.coulomb + rig.constant;
            let asked = if s.integral_time.is_some() { 0.0 } else { torque / s.velocity_gain };
            let expected = (asked + (1.0 - s.feedforward) * w) / s.position_gain * rig.unit;
            let rows = (3.0 / s.period) as usize..(3.4 / s.period) as usize;
            let mean = rows.clone().map(|i| r.command[i] - r.position[i]).sum::<f64>() / rows.len() as f64;
            assert!(
                (mean - expected).abs() < 0.01 * expected.abs() + 2.0 * rig.encoder_step,
                "seed {seed}: {mean} for {expected}"
            );
            let held = rows.clone().map(|i| r.clean_torque[i]).sum::<f64>() / rows.len() as f64;
            assert!((held / torque - 1.0).abs() < 0.01, "seed {seed}: {held} for {torque}");
        }
    }
}
