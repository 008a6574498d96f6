//! The digital position servo of a machine file, cycle by cycle.
//!
//! v = (x[i] − x[i−1])/Ts, or of the mean of two samples; e = Kp·(command − x) + ff·dcommand/dt − v; u = Kv·(e + I), limited;
//! I += e·Ts/Ti only while not limited. Speeds in the motor's coordinate per second, u in the drive's own unit.

use crate::machine::{Servo, VelocityEstimate};

/// What a control takes for dcommand/dt.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum CommandSpeed {
    /// Over the cycles before and after: an interpolator that knows its own speed tells that of the present instant.
    #[default]
    Central,
    /// Over the cycle before: half a cycle late.
    Backward,
    /// Over the cycle after: half a cycle early.
    Forward,
}

impl CommandSpeed {
    /// All of them.
    pub const ALL: [CommandSpeed; 3] = [CommandSpeed::Central, CommandSpeed::Backward, CommandSpeed::Forward];

    /// The difference's name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            CommandSpeed::Central => "central",
            CommandSpeed::Backward => "backward",
            CommandSpeed::Forward => "forward",
        }
    }

    /// Travel per cycle of a command between its neighbours; at the ends that of the one neighbour there is.
    #[must_use]
    fn travel(self, before: Option<f64>, now: f64, after: Option<f64>) -> f64 {
        match (self, before, after) {
            (CommandSpeed::Central, Some(before), Some(after)) => (after - before) / 2.0,
            (CommandSpeed::Forward, _, Some(after)) | (_, None, Some(after)) => after - now,
            (_, Some(before), _) => now - before,
            (_, None, None) => 0.0,
        }
    }

    /// The positions of a command, each with its travel per cycle.
    pub fn along(self, mut command: impl Iterator<Item = f64>) -> impl Iterator<Item = (f64, f64)> {
        let (mut before, mut next) = (None, command.next());
        std::iter::from_fn(move || {
            let now = next?;
            next = command.next();
            let travel = self.travel(before, now, next);
            before = Some(now);
            Some((now, travel))
        })
    }
}

/// By how much two clocks of quartz differ at most.
const CLOCKS: f64 = 1e-4;

/// A servo by the clock that stamped a recording: where rows are a whole number of cycles apart as far as two clocks agree, they are
/// cycles, and the stamps say how long one takes.
#[must_use]
pub fn by_clock(servo: Servo, row_s: f64) -> Servo {
    let cycles = row_s / servo.period_s;
    let same = cycles >= 0.5 && (cycles / cycles.round() - 1.0).abs() < CLOCKS;
    if same { Servo { period_s: row_s / cycles.round(), ..servo } } else { servo }
}

/// A servo and what it remembers between cycles. Positions in the motor's coordinate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ServoLoop {
    servo: Servo,
    torque_limit: f64,
    /// ∫e dt/Ti, a speed.
    integral: f64,
    last: [f64; 2],
}

impl ServoLoop {
    /// A servo that has been following an axis at `position` and constant `velocity`, holding it with `torque`.
    #[must_use]
    pub fn new(servo: Servo, torque_limit: f64, position: f64, velocity: f64, torque: f64) -> ServoLoop {
        let travel = velocity * servo.period_s;
        let integral = match servo.velocity_integral_time_s {
            Some(_) if servo.velocity_gain > 0.0 => torque / servo.velocity_gain,
            _ => 0.0,
        };
        let last = [position - travel, position - 2.0 * travel];
        ServoLoop { servo, torque_limit, integral, last }
    }

    /// One cycle: the torque that is asked for until the next one, from command, commanded speed and encoder.
    #[inline]
    pub fn cycle(&mut self, command: f64, command_speed: f64, position: f64) -> f64 {
        let servo = &self.servo;
        let rate = 1.0 / servo.period_s;
        let velocity = match servo.velocity_estimate {
            VelocityEstimate::BackwardDifference => (position - self.last[0]) * rate,
            VelocityEstimate::TwoSampleMean => (position - self.last[1]) * 0.5 * rate,
        };
        let feedforward = servo.velocity_feedforward * command_speed;
        let error = servo.position_gain_1_s * (command - position) + feedforward - velocity;
        let asked = servo.velocity_gain * (error + self.integral);
        let torque = asked.clamp(-self.torque_limit, self.torque_limit);
        if let (Some(time), true) = (servo.velocity_integral_time_s, torque == asked) {
            self.integral += error * servo.period_s / time;
        }
        self.last = [position, self.last[0]];
        torque
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SERVO: Servo = Servo {
        period_s: 0.001,
        position_gain_1_s: 40.0,
        velocity_gain: 0.5,
        velocity_integral_time_s: Some(0.02),
        velocity_feedforward: 1.0,
        torque_time_constant_s: 0.0,
        velocity_estimate: VelocityEstimate::BackwardDifference,
    };

    /// Two cycles worked out by hand from the format's equations.
    #[test]
    fn two_cycles_by_hand() {
        let mut servo = ServoLoop::new(SERVO, 100.0, 0.0, 0.0, 0.0);
        // v = 0, e = 40·0.1 + 100 = 104, u = 52.
        assert!((servo.cycle(0.1, 100.0, 0.0) - 52.0).abs() < 1e-12);
        // v = 20, e = 40·0.08 + 0 − 20 = −16.8, I = 104·0.001/0.02 = 5.2, u = 0.5·(−11.6).
        assert!((servo.cycle(0.1, 0.0, 0.02) + 5.8).abs() < 1e-12);
        // The same rows with the two-sample mean: v = (0.02 − 0)/0.002 = 10, e = −6.8, u = 0.5·(−1.6).
        let mut servo =
            ServoLoop::new(Servo { velocity_estimate: VelocityEstimate::TwoSampleMean, ..SERVO }, 100.0, 0.0, 0.0, 0.0);
        servo.cycle(0.1, 100.0, 0.0);
        assert!((servo.cycle(0.1, 0.0, 0.02) + 0.8).abs() < 1e-12);
    }

    #[test]
    fn the_speed_of_a_command_is_that_of_its_neighbours() {
        let command = [0.0, 1.0, 4.0, 9.0];
        let speeds = |kind: CommandSpeed| kind.along(command.into_iter()).map(|(_, speed)| speed).collect::<Vec<_>>();
        assert_eq!(speeds(CommandSpeed::Central), [1.0, 2.0, 4.0, 5.0]);
        assert_eq!(speeds(CommandSpeed::Backward), [1.0, 1.0, 3.0, 5.0]);
        assert_eq!(speeds(CommandSpeed::Forward), [1.0, 3.0, 5.0, 5.0]);
        assert!(CommandSpeed::ALL.into_iter().all(|kind| kind.along([7.0].into_iter()).eq([(7.0, 0.0)])));
    }

    #[test]
    fn the_integral_waits_while_the_torque_is_limited() {
        let mut servo = ServoLoop::new(SERVO, 2.0, 0.0, 0.0, 0.0);
        for _ in 0..1000 {
            assert!((servo.cycle(1.0, 0.0, 0.0) - 2.0).abs() < 1e-12);
        }
        // Back on the command, nothing has been wound up: the torque is that of the speed alone.
        servo.cycle(1.0, 0.0, 1.0);
        assert!(servo.cycle(1.0, 0.0, 1.0).abs() < 1e-12);
    }

    #[test]
    fn it_takes_over_a_moving_axis_without_a_jump() {
        // On the command at 3 /s, the command at the same speed: the torque it holds goes on.
        let mut servo = ServoLoop::new(SERVO, 100.0, 1.0, 3.0, 0.7);
        assert!((servo.cycle(1.0, 3.0, 1.0) - 0.7).abs() < 1e-9);
        assert!((servo.cycle(1.003, 3.0, 1.003) - 0.7).abs() < 1e-9);
    }
}
