//! The closed loop replayed: the recorded command through servo and model, at ideal sensors.
//!
//! Starts in the state that the recording shows in its first row; after that nothing measured enters but the command, the torque
//! that was added to the servo's, where there was such, and which of three differences the control takes for the command's speed.

use super::added::{Added, added, command_speed};
use super::motion::cubic_at;
use super::noise::Noise;
use super::observed::Observed;
use super::predict::{TorquePrediction, predict_torque};
use super::servo::CommandSpeed;
use super::simulate::{Setup, Start, simulate_physics};
use crate::machine::Axis;

/// A replayed recording, one value a row, load units.
#[derive(Debug, Clone, PartialEq)]
pub struct ClosedLoop {
    /// Motor encoder.
    pub position: Vec<f64>,
    /// Table, with the errors of the screw.
    pub table_position: Vec<f64>,
    /// Drive's own unit.
    pub torque: Vec<f64>,
}

/// Everything that a machine file says about a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    /// Torque from the measured motion; at rest that of the closed loop, where there is one.
    pub torque: TorquePrediction,
    /// The closed loop; `None` without a servo or a recorded command.
    pub closed_loop: Option<ClosedLoop>,
    /// What was added to the servo's torque; the closed loop has it too.
    pub added: Option<Added>,
    /// What the control takes for the speed of its command, by the recorded torque.
    pub command_speed: CommandSpeed,
}

/// Predicts a recording: what `gib predict` writes and what the gain of a diagnosis is measured by.
///
/// # Errors
/// As [`predict_torque`] and [`replay`].
pub fn predict(axis: &Axis, observed: &Observed) -> Result<Prediction, String> {
    predict_by(axis, observed, &ByServo::of(axis, observed))
}

/// What a recording says of the servo by its law alone: the same of every machine with that drive and servo.
#[derive(Debug)]
pub struct ByServo {
    speed: CommandSpeed,
    /// What was added to the servo's torque by the usual speed, and by the one that it seems to take where that is another.
    added: [Option<Added>; 2],
}

impl ByServo {
    /// That of a recording.
    #[must_use]
    pub fn of(axis: &Axis, observed: &Observed) -> Self {
        let speed = command_speed(axis, observed);
        let other = (speed != CommandSpeed::Central).then(|| added(axis, observed, speed)).flatten();
        Self { speed, added: [added(axis, observed, CommandSpeed::Central), other] }
    }
}

/// [`predict`] by what is known of the servo.
///
/// # Errors
/// As [`predict_torque`] and [`replay`].
pub fn predict_by(axis: &Axis, observed: &Observed, servo: &ByServo) -> Result<Prediction, String> {
    let mut torque = predict_torque(axis, observed)?;
    let mut best = Replays::of(axis, observed, &torque, CommandSpeed::Central, servo.added[0].as_ref())?;
    let speed = servo.speed;
    if speed != CommandSpeed::Central {
        let other = Replays::of(axis, observed, &torque, speed, servo.added[1].as_ref())?;
        // A servo that is another one in truth may seem to take another speed, and does not repeat the position by it.
        if other.error(observed) < best.error(observed) {
            best = other;
        }
    }
    let Replays { command_speed, alone, given } = best;
    if let Some(replayed) = &alone {
        fill_rest(&mut torque, observed, replayed);
    }
    let (closed_loop, added) = given.map_or((alone, None), |(added, replayed)| (Some(replayed), Some(added)));
    Ok(Prediction { torque, closed_loop, added, command_speed })
}

/// A recording replayed at one speed of the command.
struct Replays {
    command_speed: CommandSpeed,
    /// By the servo alone.
    alone: Option<ClosedLoop>,
    /// With what was added to the servo's torque, where that repeats the position better: what only the torque sensor saw, the
    /// axis did not feel.
    given: Option<(Added, ClosedLoop)>,
}

impl Replays {
    fn of(
        axis: &Axis,
        observed: &Observed,
        torque: &TorquePrediction,
        command_speed: CommandSpeed,
        added: Option<&Added>,
    ) -> Result<Self, String> {
        let alone = replay(axis, observed, torque, &[], command_speed)?;
        let mut given = None;
        if let (Some(alone), Some(added)) = (&alone, added) {
            let with = replay(axis, observed, torque, &added.torque, command_speed)?;
            let felt = |with: &ClosedLoop| error_of(observed, with) < error_of(observed, alone);
            given = with.filter(felt).map(|with| (added.clone(), with));
        }
        Ok(Self { command_speed, alone, given })
    }

    fn error(&self, observed: &Observed) -> f64 {
        let best = self.given.as_ref().map(|(_, replayed)| replayed).or(self.alone.as_ref());
        best.map_or(f64::INFINITY, |replayed| error_of(observed, replayed))
    }
}

/// Sum of the squared errors of the replayed position.
fn error_of(observed: &Observed, replayed: &ClosedLoop) -> f64 {
    let rows = replayed.position.iter().zip(&observed.position);
    rows.map(|(replayed, measured)| (replayed - measured).powi(2)).filter(|square| square.is_finite()).sum()
}

/// Simulates the recorded command under the axis's servo; `prediction` gives the numbers and the phases of its ripples, `added`
/// what is added to the servo's torque in each cycle (empty for nothing).
///
/// `None` where the axis has no servo or the recording no command.
///
/// # Errors
/// The simulation's, or a servo period that does not suit the recording.
fn replay(
    axis: &Axis,
    observed: &Observed,
    prediction: &TorquePrediction,
    added: &[f64],
    command_speed: CommandSpeed,
) -> Result<Option<ClosedLoop>, String> {
    let (Some(servo), Some(command)) = (&axis.servo, &observed.command) else { return Ok(None) };
    let time = &observed.time_s;
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
    let command = command_of_cycles(time, command, servo.period_s, cycles);
    let finite = |value: f64| Some(value).filter(|value| value.is_finite());
    let at_start = |values: &[f64]| values.first().copied().and_then(finite);
    let velocity = at_start(&observed.motion.velocity).unwrap_or(0.0);
    let position = at_start(&observed.position).unwrap_or(command[0]);
    let torque = finite(prediction.at_start).unwrap_or(0.0);
    let start = Start { position, velocity, torque };
    let setup = Setup { start: Some(start), command_speed, ..Setup::default() };
    let trace = simulate_physics(axis, prediction.physics.clone(), &command, added, &setup, Noise::new(0))?;
    // The rows of a recording made once a servo cycle are the cycles themselves.
    let rows = |values: Vec<f64>| {
        let place = |t: &f64| {
            let exact = (t - begin) / servo.period_s;
            if (exact - exact.round()).abs() < 0.02 { exact.round() } else { exact }
        };
        time.iter().map(|t| cubic_at(&values, place(t))).collect()
    };
    Ok(Some(ClosedLoop {
        position: rows(trace.position),
        table_position: rows(trace.table_position),
        torque: rows(trace.torque),
    }))
}

/// Takes the torque of rows at rest from the replay.
///
/// What dry friction holds at rest is not in the motion: it is what the servo has come to by then, which the replay
/// knows. At rest means less travel within a period of the motion's cut-off than reversing friction takes.
fn fill_rest(prediction: &mut TorquePrediction, observed: &Observed, replayed: &ClosedLoop) {
    let motion = &observed.motion;
    let slow = 10.0 * motion.resolution * motion.cutoff_hz;
    let around = (0.5 / (motion.cutoff_hz * observed.period_s)).ceil() as usize;
    // Rows in a row that are slow, up to and with this one.
    let mut length = 0;
    for i in 0..motion.velocity.len() {
        length = if motion.velocity[i].abs() < slow { length + 1 } else { 0 };
        if length > 2 * around {
            prediction.torque[i - around] = replayed.torque[i - around];
        }
    }
}

/// The command at the start of each servo cycle: interpolated between rows, held over rows without one.
#[must_use]
pub fn command_of_cycles(time_s: &[f64], command: &[f64], period: f64, cycles: usize) -> Vec<f64> {
    let known = time_s.iter().zip(command).filter(|(_, x)| x.is_finite());
    let mut rows = known.map(|(t, x)| (t - time_s[0], *x));
    let Some((mut now, first)) = rows.next().map(|row| (row, row.1)) else { return vec![0.0; cycles] };
    let mut next = rows.next();
    (0..cycles)
        .map(|cycle| {
            let t = cycle as f64 * period;
            while let Some(row) = next.filter(|row| row.0 <= t + 1e-3 * period) {
                (now, next) = (row, rows.next());
            }
            let (t0, x0) = now;
            // Times are written rounded: a thousandth of a cycle is none.
            if (t - t0).abs() <= 1e-3 * period {
                return x0;
            }
            match next {
                Some((t1, x1)) if t >= t0 => x0 + (x1 - x0) * (t - t0) / (t1 - t0),
                Some(_) => first,
                None => x0,
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_of_a_cycle_is_that_of_its_row() {
        let time: Vec<f64> = (0..100).map(|i| f64::from(i) * 1e-3).collect();
        let command: Vec<f64> = time.iter().map(|t| t * t).collect();
        assert_eq!(command_of_cycles(&time, &command, 1e-3, 100), command);
        // Four cycles a row: between the rows a straight line.
        let fine = command_of_cycles(&time, &command, 0.25e-3, 397);
        assert_eq!(fine.len(), 397);
        for (cycle, x) in fine.iter().enumerate() {
            let t = cycle as f64 * 0.25e-3;
            assert!((x - t * t).abs() < 0.26e-6, "{cycle}");
        }
    }

    #[test]
    fn a_row_without_a_command_is_bridged() {
        let time = [0.0, 1.0, 2.0, 3.0];
        assert_eq!(command_of_cycles(&time, &[f64::NAN, 1.0, f64::NAN, 3.0], 1.0, 4), [1.0, 1.0, 2.0, 3.0]);
    }
}
