//! Status numbers and their texts, and the one error type every room returns.
//!
//! Numbers never change once published: 0 is ok, positive is progress, negative is an error.
//! Each family owns a block of one hundred, so that a number alone names the family.

/// The call did what it says; nothing more is to be expected from it.
pub const GIB_OK: i32 = 0;
/// The function is running: call its `_step` again in the next servo cycle.
pub const GIB_BUSY: i32 = 1;
/// The function has ended well and its result can be read.
pub const GIB_DONE: i32 = 2;

/// A required pointer is NULL.
pub const GIB_ERR_NULL: i32 = -1;
/// The memory behind the handle was never initialised, or was freed.
pub const GIB_ERR_HANDLE: i32 = -2;
/// A configuration value is out of range; `_last_error` names the field, the value and the bound.
pub const GIB_ERR_CONFIG: i32 = -3;
/// `struct_size` is shorter than the first published size, or an unknown tail is not zero.
pub const GIB_ERR_STRUCT_SIZE: i32 = -4;
/// The call is not legal in the present state (see the function's `[state: …]`).
pub const GIB_ERR_STATE: i32 = -5;
/// The caller aborted. What was changed has been restored, but where the message is GIB_ERR_RESTORE_UNCONFIRMED.
pub const GIB_ERR_ABORTED: i32 = -6;
/// An internal fault was caught at the boundary. Please report it.
pub const GIB_ERR_INTERNAL: i32 = -7;
/// Memory could not be had, or the memory given is too small or misaligned.
pub const GIB_ERR_MEMORY: i32 = -8;
/// The caller's buffer is too small; the needed size has been written.
pub const GIB_ERR_BUFFER: i32 = -9;
/// An input of this cycle is NaN or infinite.
pub const GIB_ERR_NON_FINITE: i32 = -10;
/// The kernel reported a drive fault.
pub const GIB_ERR_DRIVE_FAULT: i32 = -11;
/// A parameter write was not acknowledged in time; the old values were requested again.
pub const GIB_ERR_ACK_TIMEOUT: i32 = -12;
/// The torque bound of the configuration was exceeded.
pub const GIB_ERR_TORQUE_BOUND: i32 = -13;
/// The travel bound of the configuration was exceeded.
pub const GIB_ERR_TRAVEL_BOUND: i32 = -14;
/// A state did not end before its deadline.
pub const GIB_ERR_DEADLINE: i32 = -15;
/// The restore of the old values was not acknowledged: the machine may run with changed parameters.
pub const GIB_ERR_RESTORE_UNCONFIRMED: i32 = -16;
/// The function is switched off.
pub const GIB_ERR_DISABLED: i32 = -17;
/// A file could not be read or written.
pub const GIB_ERR_IO: i32 = -18;
/// A file or text does not have the format it should have.
pub const GIB_ERR_FORMAT: i32 = -19;
/// This library cannot serve the ABI version asked for.
pub const GIB_ERR_VERSION: i32 = -20;
/// The axis does not follow its command: following error beyond the limit, or an encoder that stands still.
pub const GIB_ERR_LAG: i32 = -21;

/// The torque never rose after the reversal: no end of the lost motion was seen.
pub const GIB_ERR_BACKLASH_NO_RISE: i32 = -100;
/// The table had not broken away when the detection limit was reached.
pub const GIB_ERR_BACKLASH_LIMIT: i32 = -101;
/// The stiffness line is lost in the torque noise: the value would mean nothing.
pub const GIB_ERR_BACKLASH_NOISE: i32 = -102;
/// The two directions disagree by more than their uncertainties allow.
pub const GIB_ERR_BACKLASH_DIRECTIONS: i32 = -103;
/// The lost motion is smaller than the encoder or the noise can resolve.
pub const GIB_ERR_BACKLASH_RESOLUTION: i32 = -104;
/// The torque curve has not the shape of a release, a clearance and a wind-up; also where the table has slipped, so that the release
/// is not on it.
pub const GIB_ERR_BACKLASH_SHAPE: i32 = -105;
/// The share of friction on the motor side could not be told from the wind-up.
pub const GIB_ERR_BACKLASH_MOTOR_FRICTION: i32 = -106;
/// The torque falls where it should rise: its sign does not agree with the position's.
pub const GIB_ERR_BACKLASH_TORQUE_SIGN: i32 = -107;

/// The program's head holds no such value: it must be measured.
pub const GIB_ERR_PROGRAM_ABSENT: i32 = -900;
/// An INA statement in the head is not a finite positive number; field `line` names its line.
pub const GIB_ERR_PROGRAM_VALUE: i32 = -901;
/// A value stands twice in the head; `low` and `high` are the two lines.
pub const GIB_ERR_PROGRAM_DUPLICATE: i32 = -902;
/// The program is a symbolic link, through which nothing is written.
pub const GIB_ERR_PROGRAM_LINK: i32 = -903;
/// The path names a folder, a device or a pipe.
pub const GIB_ERR_PROGRAM_NOT_A_FILE: i32 = -904;
/// Another writer did not finish in time.
pub const GIB_ERR_PROGRAM_BUSY: i32 = -905;
/// Another program changes the file all the time; nothing was written.
pub const GIB_ERR_PROGRAM_CHANGED: i32 = -906;
/// The program's owner could not be kept; nothing was written.
pub const GIB_ERR_PROGRAM_OWNER: i32 = -907;

/// The axis stood on the stop when homing began, or closer than the retraction.
pub const GIB_ERR_HOMING_ON_STOP: i32 = -200;
/// A stop was met before the smallest distance.
pub const GIB_ERR_HOMING_EARLY: i32 = -201;
/// The largest distance was gone and no stop met.
pub const GIB_ERR_HOMING_NO_STOP: i32 = -202;
/// Homing took longer than its time limit.
pub const GIB_ERR_HOMING_TIME_LIMIT: i32 = -203;
/// The touches disagree: chips before the stop, a tight spot, or a slipping encoder.
pub const GIB_ERR_HOMING_TOUCHES: i32 = -204;
/// The torque rises over a longer way than a dead stop allows.
pub const GIB_ERR_HOMING_SOFT_STOP: i32 = -205;
/// What was pressed on also holds the axis on the way back: a tight spot, not a stop.
pub const GIB_ERR_HOMING_TIGHT_SPOT: i32 = -206;
/// The torque against position is not a level and then a line.
pub const GIB_ERR_HOMING_SHAPE: i32 = -207;
/// The torque is too noisy for the tolerance of the touches.
pub const GIB_ERR_HOMING_NOISE: i32 = -208;
/// The axis stands against its command and the torque reading does not change: the torque sensor is stuck.
pub const GIB_ERR_HOMING_TORQUE_STUCK: i32 = -209;
/// The axis stands and the torque points away from the stop: the torque's sign is inverted.
pub const GIB_ERR_HOMING_TORQUE_SIGN: i32 = -210;
/// The encoder stands still while torque or command say that the motor moves, or it jumps.
pub const GIB_ERR_HOMING_ENCODER: i32 = -211;
/// Gantry: the two sides are further apart than the square tolerance.
pub const GIB_ERR_HOMING_SQUARE: i32 = -212;
/// The torque limit in force is no longer the one that homing asked for.
pub const GIB_ERR_HOMING_LIMIT: i32 = -213;

/// The motion does not determine the inertia; the report says which ramp would.
pub const GIB_ERR_INERTIA_EXCITATION: i32 = -300;
/// Too little of the motion can be used: standing still, take-up, weakened field or saturation all along.
pub const GIB_ERR_INERTIA_FEW: i32 = -301;
/// The torque falls where the spindle speeds up: its sign does not agree with the speed's.
pub const GIB_ERR_INERTIA_SIGN: i32 = -302;
/// The inertia found is not above the machine's own: nothing is left for the workpiece.
pub const GIB_ERR_INERTIA_OWN: i32 = -303;
/// Torque and acceleration do not belong together all along: the torque was stuck, dead, turned round or changed on the way.
pub const GIB_ERR_INERTIA_TORQUE: i32 = -304;

/// The variation asked for needs more power than the motor has; `_last_error` says what is possible.
pub const GIB_ERR_SPEED_VARIATION_POWER: i32 = -400;
/// The variation asked for needs more torque than the motor has; `_last_error` says what is possible.
pub const GIB_ERR_SPEED_VARIATION_TORQUE: i32 = -401;
/// The variation asked for leaves the speeds allowed; `_last_error` says what is possible.
pub const GIB_ERR_SPEED_VARIATION_SPEED: i32 = -402;
/// Friction and cutting leave the motor nothing to vary the speed with.
pub const GIB_ERR_SPEED_VARIATION_NONE: i32 = -403;
/// Another living process records under this name.
pub const GIB_ERR_RECORDER_IN_USE: i32 = -1000;
/// The name belongs to shared memory that is no recorder's, or to another user's.
pub const GIB_ERR_RECORDER_FOREIGN: i32 = -1001;
/// The name of a column is misspelled, has a unit that its signal cannot have, or stands twice: `value` is its number, without a
/// range. Or there is not one name a channel: `value` is how many there are, and the range how many there are to be.
pub const GIB_ERR_RECORDER_COLUMN: i32 = -1002;
/// A step gave another number of values than there are channels; no row was written.
pub const GIB_ERR_RECORDER_COUNT: i32 = -1003;
/// The seat's or the bearing's acceleration is no number; the plain scale is in force.
pub const GIB_ERR_VIBRATION_NOT_A_NUMBER: i32 = -600;
/// An acceleration is stuck; the plain scale is in force.
pub const GIB_ERR_VIBRATION_STUCK: i32 = -601;
/// An accelerometer is at its full scale; the plain scale is in force.
pub const GIB_ERR_VIBRATION_SATURATED: i32 = -602;
/// An acceleration or displacement is implausible; the plain scale is in force.
pub const GIB_ERR_VIBRATION_IMPLAUSIBLE: i32 = -603;
/// The spindle's angle is no number or jumps; the plain scale is in force.
pub const GIB_ERR_VIBRATION_ANGLE: i32 = -604;

/// At a frequency no amplitude that stroke and torque allow moves the machine above the noise of the sensors.
pub const GIB_ERR_CALIBRATION_SIGNAL: i32 = -700;
/// A sensor is stuck: its reading never changes while the axis swings.
pub const GIB_ERR_CALIBRATION_STUCK: i32 = -701;
/// An accelerometer or the ball bar is at its full scale.
pub const GIB_ERR_CALIBRATION_SATURATED: i32 = -702;
/// The two displacements are too near to opposite phase for the published formula.
pub const GIB_ERR_CALIBRATION_CONDITION: i32 = -703;
/// An experiment cannot be added: there are eight, or its frequencies are not those of the first.
pub const GIB_ERR_CALIBRATION_ADD: i32 = -704;
/// A gain is beyond three times `tolerance_ratio` from 1, or beyond 0.1 to 10: a sensor is dead, or its unit or sign is wrong.
pub const GIB_ERR_CALIBRATION_GAIN: i32 = -705;
/// The load table is too short, full, or does not rise with the depth beyond its uncertainty.
pub const GIB_ERR_TILT_TABLE: i32 = -500;
/// The cut is of another machining condition than the load table, or a rotary axis stands elsewhere than in the first cut.
pub const GIB_ERR_TILT_CONDITION: i32 = -501;
/// Too few readings of the load along the path.
pub const GIB_ERR_TILT_DATA: i32 = -502;
/// The load lies outside the table.
pub const GIB_ERR_TILT_RANGE: i32 = -503;
/// The offsets that undo the tilt are larger than allowed.
pub const GIB_ERR_TILT_SIZE: i32 = -504;
/// The depth along the path is no line or plane: too many outliers.
pub const GIB_ERR_TILT_SHAPE: i32 = -505;
/// The samples of the current fall on too few of its phases for a true RMS.
pub const GIB_ERR_TILT_ALIAS: i32 = -506;

/// The machine has no axis of that name, or shares none with the recording.
pub const GIB_ERR_DIAGNOSIS_AXIS: i32 = -1200;
/// The second recording cannot serve to measure the gain.
pub const GIB_ERR_DIAGNOSIS_HOLDOUT: i32 = -1201;

/// The deviation grew; the best correction is in force again.
pub const GIB_ERR_LEARNING_GROWS: i32 = -800;
/// The tolerance was not reached within the updates allowed; the best correction is in force.
pub const GIB_ERR_LEARNING_UPDATES: i32 = -801;
/// The deviation of a cycle was beyond its bound; the correction was taken out.
pub const GIB_ERR_LEARNING_DEVIATION: i32 = -802;
/// The spindle's angle is no number or jumps; learning waits.
pub const GIB_ERR_LEARNING_ANGLE: i32 = -803;
/// The detected position is no number; learning waits.
pub const GIB_ERR_LEARNING_DETECTED: i32 = -804;

/// Every status and the sentence that explains it.
const TEXTS: &[(i32, &str)] = &[
    (GIB_OK, "ok\0"),
    (GIB_BUSY, "busy: call the step again in the next servo cycle\0"),
    (GIB_DONE, "done: the result can be read\0"),
    (GIB_ERR_NULL, "a required pointer is NULL\0"),
    (GIB_ERR_HANDLE, "the handle was never initialised, or was freed\0"),
    (GIB_ERR_CONFIG, "a configuration value is out of range\0"),
    (GIB_ERR_STRUCT_SIZE, "struct_size is too short, or an unknown tail is not zero\0"),
    (GIB_ERR_STATE, "this call is not legal in the present state\0"),
    (GIB_ERR_ABORTED, "aborted by the caller\0"),
    (GIB_ERR_INTERNAL, "internal fault, caught at the boundary\0"),
    (GIB_ERR_MEMORY, "no memory, or the memory given is too small or misaligned\0"),
    (GIB_ERR_BUFFER, "the buffer is too small\0"),
    (GIB_ERR_NON_FINITE, "an input of this cycle is not a finite number\0"),
    (GIB_ERR_DRIVE_FAULT, "the kernel reported a drive fault\0"),
    (GIB_ERR_ACK_TIMEOUT, "a parameter write was not acknowledged in time\0"),
    (GIB_ERR_TORQUE_BOUND, "the torque bound was exceeded\0"),
    (GIB_ERR_TRAVEL_BOUND, "the travel bound was exceeded\0"),
    (GIB_ERR_DEADLINE, "a state did not end before its deadline\0"),
    (GIB_ERR_RESTORE_UNCONFIRMED, "the restore was not acknowledged: parameters may still be changed\0"),
    (GIB_ERR_DISABLED, "the function is switched off\0"),
    (GIB_ERR_IO, "a file could not be read or written\0"),
    (GIB_ERR_FORMAT, "the text does not have the expected format\0"),
    (GIB_ERR_VERSION, "this library cannot serve that ABI version\0"),
    (GIB_ERR_LAG, "the axis does not follow its command\0"),
    (GIB_ERR_BACKLASH_NO_RISE, "the torque never rose after the reversal\0"),
    (GIB_ERR_BACKLASH_LIMIT, "the detection limit was reached before the table broke away\0"),
    (GIB_ERR_BACKLASH_NOISE, "the stiffness line is lost in the torque noise\0"),
    (GIB_ERR_BACKLASH_DIRECTIONS, "the two directions disagree beyond their uncertainties\0"),
    (GIB_ERR_BACKLASH_RESOLUTION, "the lost motion is below what encoder and noise resolve\0"),
    (GIB_ERR_BACKLASH_SHAPE, "the torque curve is not a release, a clearance and a wind-up\0"),
    (GIB_ERR_BACKLASH_MOTOR_FRICTION, "motor-side friction could not be told from the wind-up\0"),
    (GIB_ERR_BACKLASH_TORQUE_SIGN, "torque and position have opposite signs\0"),
    (GIB_ERR_PROGRAM_ABSENT, "the program's head holds no such value: it must be measured\0"),
    (GIB_ERR_PROGRAM_VALUE, "an INA statement is not a finite positive number\0"),
    (GIB_ERR_PROGRAM_DUPLICATE, "an INA value stands twice in the program's head\0"),
    (GIB_ERR_PROGRAM_LINK, "the program is a symbolic link: nothing is written through it\0"),
    (GIB_ERR_PROGRAM_NOT_A_FILE, "the path does not name a file\0"),
    (GIB_ERR_PROGRAM_BUSY, "another writer of the program did not finish in time\0"),
    (GIB_ERR_PROGRAM_CHANGED, "another program changes the file all the time; nothing was written\0"),
    (GIB_ERR_PROGRAM_OWNER, "the program's owner could not be kept; nothing was written\0"),
    (GIB_ERR_HOMING_ON_STOP, "the axis stood on the stop, or too close to it, when homing began\0"),
    (GIB_ERR_HOMING_EARLY, "a stop was met before the smallest distance\0"),
    (GIB_ERR_HOMING_NO_STOP, "the largest distance was gone and no stop met\0"),
    (GIB_ERR_HOMING_TIME_LIMIT, "homing took longer than its time limit\0"),
    (GIB_ERR_HOMING_TOUCHES, "the touches disagree: chips, a tight spot or a slipping encoder\0"),
    (GIB_ERR_HOMING_SOFT_STOP, "the torque rises over a longer way than a dead stop allows\0"),
    (GIB_ERR_HOMING_TIGHT_SPOT, "what was pressed on holds the axis both ways: a tight spot\0"),
    (GIB_ERR_HOMING_SHAPE, "torque against position is not a level and then a line\0"),
    (GIB_ERR_HOMING_NOISE, "the torque is too noisy for the tolerance of the touches\0"),
    (GIB_ERR_HOMING_TORQUE_STUCK, "the torque reading is stuck\0"),
    (GIB_ERR_HOMING_TORQUE_SIGN, "the torque's sign is inverted\0"),
    (GIB_ERR_HOMING_ENCODER, "the encoder stands still or jumps\0"),
    (GIB_ERR_HOMING_SQUARE, "the two sides of the gantry are not square\0"),
    (GIB_ERR_HOMING_LIMIT, "the torque limit in force is no longer the one that homing asked for\0"),
    (GIB_ERR_INERTIA_EXCITATION, "the motion does not determine the inertia\0"),
    (GIB_ERR_INERTIA_FEW, "too little of the motion can be used for the inertia\0"),
    (GIB_ERR_INERTIA_SIGN, "torque and speed have opposite signs\0"),
    (GIB_ERR_INERTIA_OWN, "the inertia found is not above the machine's own\0"),
    (GIB_ERR_INERTIA_TORQUE, "torque and acceleration do not belong together all along\0"),
    (GIB_ERR_SPEED_VARIATION_POWER, "the speed variation needs more power than the motor has\0"),
    (GIB_ERR_SPEED_VARIATION_TORQUE, "the speed variation needs more torque than the motor has\0"),
    (GIB_ERR_SPEED_VARIATION_SPEED, "the speed variation leaves the speeds allowed\0"),
    (GIB_ERR_SPEED_VARIATION_NONE, "friction and cutting leave the motor nothing to vary the speed with\0"),
    (GIB_ERR_RECORDER_IN_USE, "another living process records under this name\0"),
    (GIB_ERR_RECORDER_FOREIGN, "the name belongs to shared memory that is no recorder's, or to another user\0"),
    (
        GIB_ERR_RECORDER_COLUMN,
        "the name of a column is misspelled, in a wrong unit, or stands twice, or there is not one a channel\0",
    ),
    (GIB_ERR_RECORDER_COUNT, "a step gave another number of values than there are channels\0"),
    (GIB_ERR_VIBRATION_NOT_A_NUMBER, "an acceleration is no number; the plain scale is in force\0"),
    (GIB_ERR_VIBRATION_STUCK, "an acceleration is stuck; the plain scale is in force\0"),
    (GIB_ERR_VIBRATION_SATURATED, "an accelerometer is at its full scale; the plain scale is in force\0"),
    (GIB_ERR_VIBRATION_IMPLAUSIBLE, "an acceleration or displacement is implausible; the plain scale is in force\0"),
    (GIB_ERR_VIBRATION_ANGLE, "the spindle's angle is no number or jumps; the plain scale is in force\0"),
    (GIB_ERR_CALIBRATION_SIGNAL, "no allowed amplitude moves the machine above the noise of its sensors\0"),
    (GIB_ERR_CALIBRATION_STUCK, "a sensor's reading never changes while the axis swings\0"),
    (GIB_ERR_CALIBRATION_SATURATED, "an accelerometer or the ball bar is at its full scale\0"),
    (GIB_ERR_CALIBRATION_CONDITION, "the displacements are too near to opposite phase for the published formula\0"),
    (GIB_ERR_CALIBRATION_ADD, "the experiment cannot be added: too many, or other frequencies\0"),
    (
        GIB_ERR_CALIBRATION_GAIN,
        "a gain is beyond what its makers promise: a sensor is dead, or its unit or sign is wrong\0",
    ),
    (GIB_ERR_TILT_TABLE, "the load table is too short, full, or does not rise with the depth\0"),
    (GIB_ERR_TILT_CONDITION, "another machining condition than the load table's, or a rotary axis that was turned\0"),
    (GIB_ERR_TILT_DATA, "too few readings of the load along the path\0"),
    (GIB_ERR_TILT_RANGE, "the load lies outside the table\0"),
    (GIB_ERR_TILT_SIZE, "the offsets that undo the tilt are larger than allowed\0"),
    (GIB_ERR_TILT_SHAPE, "the depth along the path is no line or plane\0"),
    (GIB_ERR_TILT_ALIAS, "the samples of the current fall on too few of its phases\0"),
    (GIB_ERR_DIAGNOSIS_AXIS, "the machine has no such axis, or shares none with the recording\0"),
    (GIB_ERR_DIAGNOSIS_HOLDOUT, "the second recording cannot serve to measure the gain\0"),
    (GIB_ERR_LEARNING_GROWS, "the deviation grew; the best correction is in force again\0"),
    (GIB_ERR_LEARNING_UPDATES, "the tolerance was not reached; the best correction is in force\0"),
    (GIB_ERR_LEARNING_DEVIATION, "the deviation is beyond its bound; the correction was taken out\0"),
    (GIB_ERR_LEARNING_ANGLE, "the spindle's angle is no number or jumps; learning waits\0"),
    (GIB_ERR_LEARNING_DETECTED, "the detected position is no number; learning waits\0"),
];

/// The text of a status, NUL-terminated and static; for an unknown number a text that says so.
#[must_use]
pub fn status_text(status: i32) -> &'static str {
    TEXTS.iter().find(|(number, _)| *number == status).map_or("unknown status number\0", |(_, text)| text)
}

/// What went wrong with one named value: enough for a caller to say it without a manual.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fault {
    /// One of the `GIB_ERR_…` numbers.
    pub code: i32,
    /// Name of the field or input at fault, NUL-terminated; `"\0"` where no single one is.
    pub field: &'static str,
    /// The value found.
    pub value: f64,
    /// The smallest value allowed.
    pub low: f64,
    /// The largest value allowed.
    pub high: f64,
}

impl Fault {
    /// No fault.
    pub const NONE: Fault = Fault { code: GIB_OK, field: "\0", value: 0.0, low: 0.0, high: 0.0 };

    /// A fault that no single field explains.
    #[must_use]
    pub const fn of(code: i32) -> Fault {
        Fault { code, ..Fault::NONE }
    }
}

/// Checks that a configuration value is finite and within `[low, high]`.
///
/// # Errors
/// `GIB_ERR_CONFIG` with the field's name, the value and the bounds.
pub fn in_range(field: &'static str, value: f64, low: f64, high: f64) -> Result<f64, Fault> {
    if value >= low && value <= high { Ok(value) } else { Err(Fault { code: GIB_ERR_CONFIG, field, value, low, high }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_unique_and_texts_end_in_nul() {
        for (i, (number, text)) in TEXTS.iter().enumerate() {
            assert!(TEXTS[i + 1..].iter().all(|(other, _)| other != number), "{number} twice");
            assert!(text.ends_with('\0') && text.matches('\0').count() == 1, "{text:?}");
        }
    }

    #[test]
    fn not_a_number_is_out_of_every_range() {
        assert_eq!(in_range("a\0", f64::NAN, -1.0, 1.0).unwrap_err().field, "a\0");
        assert!(in_range("a\0", f64::INFINITY, -1.0, f64::MAX).is_err());
        assert_eq!(in_range("a\0", 1.0, 1.0, 1.0), Ok(1.0));
    }
}
