//! Whether a recording can be one of the machine at all: values that no drive gives, and columns that seem to be in another unit
//! than their name says, which would otherwise be taken for what the simulation gets wrong.

use crate::machine::Axis;
use crate::recording::{Issue, IssueKind, Recording, Signal, Unit, file_row};

/// No motor delivers so many times the limit that its machine file gives it, be that wrong or exceeded for a moment.
const BEYOND_LIMIT: f64 = 10.0;
/// Share of the rows from which on the column is taken to be of another unit.
const MANY: f64 = 0.01;
/// Servo cycles from one row to the next from which on the time is taken to be of another unit.
const CYCLES: f64 = 500.0;
/// What a position may be in another unit by: µm or m for mm, m for µm; degrees for radians.
const FACTORS: [f64; 6] = [1e-6, 1e-3, 1e3, 1e6, std::f64::consts::PI / 180.0, 180.0 / std::f64::consts::PI];
/// Share by which a position may depart from such a factor; that of the command is 1.
const ABOUT: f64 = 0.2;

/// Leaves out the torque (force) of rows in which it is far beyond the limit, and says so in the recording's issues.
///
/// # Errors
/// Time, position or torque seem to be in another unit than their column says; the sentence names both sides.
pub fn plausible(recording: &mut Recording, axis: &Axis) -> Result<(), String> {
    time(recording, axis)?;
    position(recording, axis)?;
    torque(recording, axis)
}

fn time(recording: &Recording, axis: &Axis) -> Result<(), String> {
    let (Some(servo), period_s) = (axis.servo, recording.sampling.period_s) else { return Ok(()) };
    if period_s < CYCLES * servo.period_s {
        return Ok(());
    }
    Err(format!(
        "{}, column time_s: its rows are {period_s} s apart, the servo cycle of axis {} is {} s: is the time in another unit? \
         It must be in seconds",
        recording.file, axis.name, servo.period_s
    ))
}

/// Against the command, which it follows: their slope is 1, and where it is a factor of units one of them is in another unit.
fn position(recording: &Recording, axis: &Axis) -> Result<(), String> {
    let unit = if axis.drive.is_rotary() { Unit::Deg } else { Unit::Mm };
    let column = |signal| recording.get(&axis.name, signal).and_then(|column| Some((column, column.to(unit)?)));
    let (Some((command, asked)), Some((position, is))) = (column(Signal::PositionCommand), column(Signal::Position))
    else {
        return Ok(());
    };
    let pairs = || asked.iter().zip(is.iter()).filter(|(asked, is)| asked.is_finite() && is.is_finite());
    let count = pairs().count().max(1) as f64;
    let mean = |of: fn((&f64, &f64)) -> f64| pairs().map(of).sum::<f64>() / count;
    let (mean_asked, mean_is) = (mean(|(asked, _)| *asked), mean(|(_, is)| *is));
    let (mut both, mut of_asked, mut of_is) = (0.0, 0.0, 0.0);
    for (asked, is) in pairs() {
        let (asked, is) = (asked - mean_asked, is - mean_is);
        both += asked * is;
        of_asked += asked * asked;
        of_is += is * is;
    }
    let slope = both / of_asked;
    let follows = both > 0.9 * (of_asked * of_is).sqrt();
    if !(follows && FACTORS.iter().any(|factor| (slope / factor - 1.0).abs() < ABOUT)) {
        return Ok(());
    }
    Err(format!(
        "{}: {} moves by {slope:.3e} of what {} asks for: is one of them in another unit than its name says?",
        recording.file, position.name, command.name
    ))
}

fn torque(recording: &mut Recording, axis: &Axis) -> Result<(), String> {
    let (signal, unit) = if axis.drive.is_linear() { (Signal::Force, Unit::N) } else { (Signal::Torque, Unit::Nm) };
    let (limit, word, unit) = (axis.base.torque_limit, axis.drive.torque_word(), unit.suffix());
    let most = BEYOND_LIMIT * limit;
    let rows = recording.rows();
    let of_axis = |label: &crate::recording::Label| label.channel == axis.name && label.signal == signal;
    let Some(column) = recording.columns.iter_mut().find(|column| column.label.as_ref().is_some_and(of_axis)) else {
        return Ok(());
    };
    let beyond: Vec<usize> = (0..rows).filter(|row| column.values[*row].abs() > most).collect();
    let Some(&first) = beyond.first() else { return Ok(()) };
    let found = column.values[first];
    let row = file_row(first);
    if beyond.len() as f64 > MANY * rows as f64 {
        return Err(format!(
            "{}, row {row}, column {}: {} of {rows} rows are more than {BEYOND_LIMIT} times the {word} limit of {limit} {unit} \
             that the machine file gives axis {}, here {found:.6}: is the column in another unit than its name says, or the limit wrong?",
            recording.file,
            column.name,
            beyond.len(),
            axis.name
        ));
    }
    let message = format!(
        "is {found:.6}, more than {BEYOND_LIMIT} times the {word} limit of {limit} {unit} of axis {}; the row is left out",
        axis.name
    );
    beyond.iter().for_each(|row| column.values[*row] = f64::NAN);
    let (column, count) = (Some(column.name.clone()), beyond.len());
    recording.issues.push(Issue { kind: IssueKind::Implausible, row: Some(row), column, count, message });
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::Machine;
    use crate::recording::Column;

    fn axis() -> Axis {
        let text = r#"{"schema":"gib.machine/1","axes":[{"name":"x","drive":"ball_screw","lead_mm":10,"inertia_kg_m2":0.003,
            "torque_limit_nm":16,"servo":{"period_s":0.001,"position_gain_1_s":40,"velocity_gain_nm_s":0.5}}]}"#;
        Machine::parse(text).unwrap().axes[0].clone()
    }

    /// A sine with this row period, position and torque as these factors make them.
    fn checked(period_s: f64, of_position: f64, torque: impl Fn(usize) -> f64) -> Result<Recording, String> {
        let rows = 0..2000;
        let command: Vec<f64> = rows.clone().map(|i| 50.0 + 40.0 * (0.01 * i as f64).sin()).collect();
        let position = rows.clone().map(|i| of_position * (50.0 + 39.0 * (0.01 * i as f64 - 0.2).sin())).collect();
        let columns = vec![
            Column::new("x.position_command_mm", command),
            Column::new("x.position_mm", position),
            Column::new("x.torque_nm", rows.clone().map(torque).collect()),
        ];
        let time_s = rows.map(|i| i as f64 * period_s).collect();
        let mut recording = Recording::from_columns("r.csv", time_s, columns).unwrap();
        plausible(&mut recording, &axis()).map(|()| recording)
    }

    #[test]
    fn what_is_of_another_unit_is_said_to_be_so() {
        let usual = |i: usize| (0.01 * i as f64).cos();
        assert_eq!(checked(0.001, 1.0, usual).unwrap().issues, []);
        assert_eq!(checked(0.1, 0.5, usual).unwrap().issues, []);
        for (found, told) in [
            (checked(1.0, 1.0, usual), ["time_s", "1 s apart", "0.001 s"]),
            (checked(1e6, 1.0, usual), ["time_s", "1000000 s apart", "0.001 s"]),
            (checked(0.001, 0.001, usual), ["x.position_mm", "x.position_command_mm", "unit"]),
            (checked(0.001, 1000.0, usual), ["x.position_mm", "x.position_command_mm", "unit"]),
            (checked(0.001, 1.0, |i| 1000.0 * usual(i)), ["x.torque_nm", "16 nm", "unit"]),
        ] {
            let why = found.unwrap_err();
            assert!(told.iter().all(|part| why.contains(part)), "{why}");
        }
    }

    #[test]
    fn rows_beyond_what_a_motor_can_are_left_out_and_named() {
        let recording = checked(0.001, 1.0, |i| if (700..703).contains(&i) { -500.0 } else { 15.0 }).unwrap();
        let said = recording.issues[0].to_string();
        assert!(said.contains("x.torque_nm") && said.contains("3 times, first at row 702"), "{said}");
        let values = &recording.columns[2].values;
        assert!(values[699] == 15.0 && values[700..703].iter().all(|v| v.is_nan()) && values[703] == 15.0);
    }
}
