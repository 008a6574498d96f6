/*
 * gib.h - the layer between an NC kernel and the metal.
 *
 * Generated from the Rust sources by `make header`; do not edit. MIT OR Apache-2.0.
 *
 * FAMILIES AND THEIR LIFE
 *   Each function of the machine is one family: gib_backlash_..., and so on. An axis or a spindle is one instance.
 *   Two instances share nothing; there is no global state.
 *
 *     memory     gib_<family>_new / _free, or _size and _init_in for memory of your own (machine and diagnosis own
 *                memory of theirs: _new alone)
 *     _start     setup: takes the configuration; the rising edge of PLCopen's Execute
 *     _step      once per servo cycle: measured values in, commands out; returns GIB_BUSY until it returns
 *                GIB_DONE or an error. Done, aborted and error exclude one another
 *     _result    reads what was found
 *     _abort     ends at the next step, by the door that restores whatever was changed
 *     _last_error  code, field, value and bounds of the first error, which is kept until the next start
 *
 * STATUS
 *   int32_t: GIB_OK is 0, progress is positive, an error is negative. Numbers never change.
 *   gib_status_text explains each. Enums cross as int32_t and are range-checked.
 *
 * UNITS
 *   The unit is in the name: _mm _um _mm_s _nm _nm_mm _rpm _s _cycles _deg _ratio. One unit a quantity.
 *   Time is counted in servo cycles; gib reads no clock.
 *
 * MEMORY
 *   Memory of your own is as large as _size says, aligned to 16 bytes, and may be moved between calls with memcpy:
 *   a state holds no pointer into itself. Whatever you pass in stays yours and is not kept after the call.
 *   Texts that gib returns are static: never free them.
 *
 * GROWTH
 *   A configuration starts with uint32_t struct_size: set it to sizeof. Zero the rest first; zero in a field that
 *   was added later means the old behaviour. Structs that cross in every cycle are frozen within an ABI major.
 *
 * THREADS
 *   Each comment ends in tags: [thread: setup|cycle|any] [real-time: yes|no] [state: ...].
 *   cycle: the real-time thread, between two steps. setup: a thread that may wait, while no other uses the instance.
 *   One instance is used by one thread at a time; different instances may be used by different threads.
 *
 * REAL TIME
 *   A function tagged [real-time: yes] allocates nothing, locks nothing, makes no system call, has no unbounded
 *   loop and cannot panic. In the others a panic ends at the boundary and is returned as GIB_ERR_INTERNAL.
 *
 * SAFE OUTPUTS
 *   Given a valid output pointer, a step always writes a safe command, also when it returns an error. NaN or
 *   infinity in is an error and never NaN out. NULL is always checked.
 *
 * WRITES THAT THE KERNEL PERFORMS
 *   gib never writes a parameter of the NC. A step's output asks for it; the next input acknowledges it. What is
 *   not acknowledged in time is asked back, and the function ends with an error.
 *
 * LOADING
 *   Link with `pkg-config --cflags --libs gib`, or dlopen "libgib.so.0" and look up "gib_api" alone.
 */

#ifndef GIB_H
#define GIB_H

#include <stddef.h>
#include <stdint.h>

/**
 * The call did what it says; nothing more is to be expected from it.
 */
#define GIB_OK 0

/**
 * The function is running: call its `_step` again in the next servo cycle.
 */
#define GIB_BUSY 1

/**
 * The function has ended well and its result can be read.
 */
#define GIB_DONE 2

/**
 * A required pointer is NULL.
 */
#define GIB_ERR_NULL (-1)

/**
 * The memory behind the handle was never initialised, or was freed.
 */
#define GIB_ERR_HANDLE (-2)

/**
 * A configuration value is out of range; `_last_error` names the field, the value and the bound.
 */
#define GIB_ERR_CONFIG (-3)

/**
 * `struct_size` is shorter than the first published size, or an unknown tail is not zero.
 */
#define GIB_ERR_STRUCT_SIZE (-4)

/**
 * The call is not legal in the present state (see the function's `[state: …]`).
 */
#define GIB_ERR_STATE (-5)

/**
 * The caller aborted. What was changed has been restored, but where the message is GIB_ERR_RESTORE_UNCONFIRMED.
 */
#define GIB_ERR_ABORTED (-6)

/**
 * An internal fault was caught at the boundary. Please report it.
 */
#define GIB_ERR_INTERNAL (-7)

/**
 * Memory could not be had, or the memory given is too small or misaligned.
 */
#define GIB_ERR_MEMORY (-8)

/**
 * The caller's buffer is too small; the needed size has been written.
 */
#define GIB_ERR_BUFFER (-9)

/**
 * An input of this cycle is NaN or infinite.
 */
#define GIB_ERR_NON_FINITE (-10)

/**
 * The kernel reported a drive fault.
 */
#define GIB_ERR_DRIVE_FAULT (-11)

/**
 * A parameter write was not acknowledged in time; the old values were requested again.
 */
#define GIB_ERR_ACK_TIMEOUT (-12)

/**
 * The torque bound of the configuration was exceeded.
 */
#define GIB_ERR_TORQUE_BOUND (-13)

/**
 * The travel bound of the configuration was exceeded.
 */
#define GIB_ERR_TRAVEL_BOUND (-14)

/**
 * A state did not end before its deadline.
 */
#define GIB_ERR_DEADLINE (-15)

/**
 * The restore of the old values was not acknowledged: the machine may run with changed parameters.
 */
#define GIB_ERR_RESTORE_UNCONFIRMED (-16)

/**
 * The function is switched off.
 */
#define GIB_ERR_DISABLED (-17)

/**
 * A file could not be read or written.
 */
#define GIB_ERR_IO (-18)

/**
 * A file or text does not have the format it should have.
 */
#define GIB_ERR_FORMAT (-19)

/**
 * This library cannot serve the ABI version asked for.
 */
#define GIB_ERR_VERSION (-20)

/**
 * The axis does not follow its command: following error beyond the limit, or an encoder that stands still.
 */
#define GIB_ERR_LAG (-21)

/**
 * The torque never rose after the reversal: no end of the lost motion was seen.
 */
#define GIB_ERR_BACKLASH_NO_RISE (-100)

/**
 * The table had not broken away when the detection limit was reached.
 */
#define GIB_ERR_BACKLASH_LIMIT (-101)

/**
 * The stiffness line is lost in the torque noise: the value would mean nothing.
 */
#define GIB_ERR_BACKLASH_NOISE (-102)

/**
 * The two directions disagree by more than their uncertainties allow.
 */
#define GIB_ERR_BACKLASH_DIRECTIONS (-103)

/**
 * The lost motion is smaller than the encoder or the noise can resolve.
 */
#define GIB_ERR_BACKLASH_RESOLUTION (-104)

/**
 * The torque curve has not the shape of a release, a clearance and a wind-up; also where the table has slipped, so that the release
 * is not on it.
 */
#define GIB_ERR_BACKLASH_SHAPE (-105)

/**
 * The share of friction on the motor side could not be told from the wind-up.
 */
#define GIB_ERR_BACKLASH_MOTOR_FRICTION (-106)

/**
 * The torque falls where it should rise: its sign does not agree with the position's.
 */
#define GIB_ERR_BACKLASH_TORQUE_SIGN (-107)

/**
 * The program's head holds no such value: it must be measured.
 */
#define GIB_ERR_PROGRAM_ABSENT (-900)

/**
 * An INA statement in the head is not a finite positive number; field `line` names its line.
 */
#define GIB_ERR_PROGRAM_VALUE (-901)

/**
 * A value stands twice in the head; `low` and `high` are the two lines.
 */
#define GIB_ERR_PROGRAM_DUPLICATE (-902)

/**
 * The program is a symbolic link, through which nothing is written.
 */
#define GIB_ERR_PROGRAM_LINK (-903)

/**
 * The path names a folder, a device or a pipe.
 */
#define GIB_ERR_PROGRAM_NOT_A_FILE (-904)

/**
 * Another writer did not finish in time.
 */
#define GIB_ERR_PROGRAM_BUSY (-905)

/**
 * Another program changes the file all the time; nothing was written.
 */
#define GIB_ERR_PROGRAM_CHANGED (-906)

/**
 * The program's owner could not be kept; nothing was written.
 */
#define GIB_ERR_PROGRAM_OWNER (-907)

/**
 * The axis stood on the stop when homing began, or closer than the retraction.
 */
#define GIB_ERR_HOMING_ON_STOP (-200)

/**
 * A stop was met before the smallest distance.
 */
#define GIB_ERR_HOMING_EARLY (-201)

/**
 * The largest distance was gone and no stop met.
 */
#define GIB_ERR_HOMING_NO_STOP (-202)

/**
 * Homing took longer than its time limit.
 */
#define GIB_ERR_HOMING_TIME_LIMIT (-203)

/**
 * The touches disagree: chips before the stop, a tight spot, or a slipping encoder.
 */
#define GIB_ERR_HOMING_TOUCHES (-204)

/**
 * The torque rises over a longer way than a dead stop allows.
 */
#define GIB_ERR_HOMING_SOFT_STOP (-205)

/**
 * What was pressed on also holds the axis on the way back: a tight spot, not a stop.
 */
#define GIB_ERR_HOMING_TIGHT_SPOT (-206)

/**
 * The torque against position is not a level and then a line.
 */
#define GIB_ERR_HOMING_SHAPE (-207)

/**
 * The torque is too noisy for the tolerance of the touches.
 */
#define GIB_ERR_HOMING_NOISE (-208)

/**
 * The axis stands against its command and the torque reading does not change: the torque sensor is stuck.
 */
#define GIB_ERR_HOMING_TORQUE_STUCK (-209)

/**
 * The axis stands and the torque points away from the stop: the torque's sign is inverted.
 */
#define GIB_ERR_HOMING_TORQUE_SIGN (-210)

/**
 * The encoder stands still while torque or command say that the motor moves, or it jumps.
 */
#define GIB_ERR_HOMING_ENCODER (-211)

/**
 * Gantry: the two sides are further apart than the square tolerance.
 */
#define GIB_ERR_HOMING_SQUARE (-212)

/**
 * The torque limit in force is no longer the one that homing asked for.
 */
#define GIB_ERR_HOMING_LIMIT (-213)

/**
 * The motion does not determine the inertia; the report says which ramp would.
 */
#define GIB_ERR_INERTIA_EXCITATION (-300)

/**
 * Too little of the motion can be used: standing still, take-up, weakened field or saturation all along.
 */
#define GIB_ERR_INERTIA_FEW (-301)

/**
 * The torque falls where the spindle speeds up: its sign does not agree with the speed's.
 */
#define GIB_ERR_INERTIA_SIGN (-302)

/**
 * The inertia found is not above the machine's own: nothing is left for the workpiece.
 */
#define GIB_ERR_INERTIA_OWN (-303)

/**
 * Torque and acceleration do not belong together all along: the torque was stuck, dead, turned round or changed on the way.
 */
#define GIB_ERR_INERTIA_TORQUE (-304)

/**
 * The variation asked for needs more power than the motor has; `_last_error` says what is possible.
 */
#define GIB_ERR_SPEED_VARIATION_POWER (-400)

/**
 * The variation asked for needs more torque than the motor has; `_last_error` says what is possible.
 */
#define GIB_ERR_SPEED_VARIATION_TORQUE (-401)

/**
 * The variation asked for leaves the speeds allowed; `_last_error` says what is possible.
 */
#define GIB_ERR_SPEED_VARIATION_SPEED (-402)

/**
 * Friction and cutting leave the motor nothing to vary the speed with.
 */
#define GIB_ERR_SPEED_VARIATION_NONE (-403)

/**
 * Another living process records under this name.
 */
#define GIB_ERR_RECORDER_IN_USE (-1000)

/**
 * The name belongs to shared memory that is no recorder's, or to another user's.
 */
#define GIB_ERR_RECORDER_FOREIGN (-1001)

/**
 * The name of a column is misspelled, has a unit that its signal cannot have, or stands twice: `value` is its number, without a
 * range. Or there is not one name a channel: `value` is how many there are, and the range how many there are to be.
 */
#define GIB_ERR_RECORDER_COLUMN (-1002)

/**
 * A step gave another number of values than there are channels; no row was written.
 */
#define GIB_ERR_RECORDER_COUNT (-1003)

/**
 * The seat's or the bearing's acceleration is no number; the plain scale is in force.
 */
#define GIB_ERR_VIBRATION_NOT_A_NUMBER (-600)

/**
 * An acceleration is stuck; the plain scale is in force.
 */
#define GIB_ERR_VIBRATION_STUCK (-601)

/**
 * An accelerometer is at its full scale; the plain scale is in force.
 */
#define GIB_ERR_VIBRATION_SATURATED (-602)

/**
 * An acceleration or displacement is implausible; the plain scale is in force.
 */
#define GIB_ERR_VIBRATION_IMPLAUSIBLE (-603)

/**
 * The spindle's angle is no number or jumps; the plain scale is in force.
 */
#define GIB_ERR_VIBRATION_ANGLE (-604)

/**
 * At a frequency no amplitude that stroke and torque allow moves the machine above the noise of the sensors.
 */
#define GIB_ERR_CALIBRATION_SIGNAL (-700)

/**
 * A sensor is stuck: its reading never changes while the axis swings.
 */
#define GIB_ERR_CALIBRATION_STUCK (-701)

/**
 * An accelerometer or the ball bar is at its full scale.
 */
#define GIB_ERR_CALIBRATION_SATURATED (-702)

/**
 * The two displacements are too near to opposite phase for the published formula.
 */
#define GIB_ERR_CALIBRATION_CONDITION (-703)

/**
 * An experiment cannot be added: there are eight, or its frequencies are not those of the first.
 */
#define GIB_ERR_CALIBRATION_ADD (-704)

/**
 * A gain is beyond three times `tolerance_ratio` from 1, or beyond 0.1 to 10: a sensor is dead, or its unit or sign is wrong.
 */
#define GIB_ERR_CALIBRATION_GAIN (-705)

/**
 * The load table is too short, full, or does not rise with the depth beyond its uncertainty.
 */
#define GIB_ERR_TILT_TABLE (-500)

/**
 * The cut is of another machining condition than the load table, or a rotary axis stands elsewhere than in the first cut.
 */
#define GIB_ERR_TILT_CONDITION (-501)

/**
 * Too few readings of the load along the path.
 */
#define GIB_ERR_TILT_DATA (-502)

/**
 * The load lies outside the table.
 */
#define GIB_ERR_TILT_RANGE (-503)

/**
 * The offsets that undo the tilt are larger than allowed.
 */
#define GIB_ERR_TILT_SIZE (-504)

/**
 * The depth along the path is no line or plane: too many outliers.
 */
#define GIB_ERR_TILT_SHAPE (-505)

/**
 * The samples of the current fall on too few of its phases for a true RMS.
 */
#define GIB_ERR_TILT_ALIAS (-506)

/**
 * The machine has no axis of that name, or shares none with the recording.
 */
#define GIB_ERR_DIAGNOSIS_AXIS (-1200)

/**
 * The second recording cannot serve to measure the gain.
 */
#define GIB_ERR_DIAGNOSIS_HOLDOUT (-1201)

/**
 * The deviation grew; the best correction is in force again.
 */
#define GIB_ERR_LEARNING_GROWS (-800)

/**
 * The tolerance was not reached within the updates allowed; the best correction is in force.
 */
#define GIB_ERR_LEARNING_UPDATES (-801)

/**
 * The deviation of a cycle was beyond its bound; the correction was taken out.
 */
#define GIB_ERR_LEARNING_DEVIATION (-802)

/**
 * The spindle's angle is no number or jumps; learning waits.
 */
#define GIB_ERR_LEARNING_ANGLE (-803)

/**
 * The detected position is no number; learning waits.
 */
#define GIB_ERR_LEARNING_DETECTED (-804)

/**
 * Slow-feed mode (default): the motor is fed slowly and the torque read in every cycle. The more accurate one.
 */
#define GIB_BACKLASH_SLOW_FEED 0

/**
 * Step mode, as published: the motor is stepped and the torque read at the end of each dwell.
 */
#define GIB_BACKLASH_STEP 1

/**
 * Whole-curve fit (default).
 */
#define GIB_BACKLASH_FIT 0

/**
 * The published peak rule: rise, rise, fall of |torque|. Reads low; see the manual.
 */
#define GIB_BACKLASH_PEAK 1

/**
 * Torque inputs in N·m.
 */
#define GIB_TORQUE_NM 0

/**
 * Torque inputs in ‰ of the rated torque.
 */
#define GIB_TORQUE_PERMILLE 1

/**
 * The axis stands; gib asks for nothing.
 */
#define GIB_BACKLASH_IDLE 0

/**
 * Waits until the compensation amount is 0 and reversal acceleration off.
 */
#define GIB_BACKLASH_CLEAR 1

/**
 * Moves to the next reference position.
 */
#define GIB_BACKLASH_APPROACH 2

/**
 * Slides back from the reference: sliding torque of the coming scan's sense.
 */
#define GIB_BACKLASH_SLIDE_BACK 3

/**
 * Slides to the reference: sliding torque before the reversal.
 */
#define GIB_BACKLASH_SLIDE_IN 4

/**
 * Rests before the reversal.
 */
#define GIB_BACKLASH_SETTLE 5

/**
 * Reversed: steps or feeds slowly and records the torque curve.
 */
#define GIB_BACKLASH_SCAN 6

/**
 * Goes a few µm back and forth while the table sticks: friction on the motor's side.
 */
#define GIB_BACKLASH_PROBE 7

/**
 * Stands while the curve is evaluated in slices.
 */
#define GIB_BACKLASH_EVALUATE 8

/**
 * Waits until the new amount is in force and reversal acceleration back.
 */
#define GIB_BACKLASH_WRITE 9

/**
 * Brakes before everything changed is restored.
 */
#define GIB_BACKLASH_STOPPING 10

/**
 * Waits until the old amount is in force and reversal acceleration back.
 */
#define GIB_BACKLASH_RESTORE 11

/**
 * Ended well.
 */
#define GIB_BACKLASH_DONE 12

/**
 * Ended with an error; kept until the next start.
 */
#define GIB_BACKLASH_FAILED 13

/**
 * Input flag: the drive is faulted, or not under the kernel's control.
 */
#define GIB_INPUT_FAULT 1

/**
 * Input flag: abort, as `gib_backlash_abort` does.
 */
#define GIB_INPUT_ABORT 2

/**
 * Complex gains by least squares over all experiments (default).
 */
#define GIB_CALIBRATION_LEAST_SQUARES 0

/**
 * Gains from the last experiment alone, as published, with the signs put right; phases stay 0.
 */
#define GIB_CALIBRATION_PUBLISHED 1

/**
 * Nothing is asked for.
 */
#define GIB_CALIBRATION_IDLE 0

/**
 * The amplitude rises.
 */
#define GIB_CALIBRATION_RISE 1

/**
 * Torque and signals are looked at, to find the largest amplitude allowed.
 */
#define GIB_CALIBRATION_PROBE 2

/**
 * Amplitude and phase are measured.
 */
#define GIB_CALIBRATION_MEASURE 3

/**
 * The amplitude falls, before the next frequency.
 */
#define GIB_CALIBRATION_FALL 4

/**
 * The axis stands at its start while the gains are computed, a frequency a cycle.
 */
#define GIB_CALIBRATION_EVALUATE 5

/**
 * The amplitude falls, to end with an error.
 */
#define GIB_CALIBRATION_STOPPING 6

/**
 * Ended well.
 */
#define GIB_CALIBRATION_DONE 7

/**
 * Ended with an error; kept until the next start.
 */
#define GIB_CALIBRATION_FAILED 8

/**
 * Most frequencies in a calibration.
 */
#define GIB_CALIBRATION_POINTS 32

/**
 * Home position from the start of the torque–position line (default).
 */
#define GIB_HOMING_LINE 0

/**
 * Home position where the torque limit was reached, as published. Depends on limit, speed and stiffness.
 */
#define GIB_HOMING_THRESHOLD 1

/**
 * Clear the deviation by request: the kernel drops the undone way and acknowledges (default, as published).
 */
#define GIB_HOMING_CLEAR_DEVIATION 0

/**
 * Clear the deviation without the kernel: the command jumps to the actual position (instant lag reduction).
 */
#define GIB_HOMING_INSTANT_LAG_REDUCTION 1

/**
 * Positions in mm (default).
 */
#define GIB_POSITION_MM 0

/**
 * Positions in degrees: read every `mm` of this family as degree, every `um` as a thousandth of a degree.
 */
#define GIB_POSITION_DEG 1

/**
 * The axis stands; gib asks for nothing.
 */
#define GIB_HOMING_IDLE 0

/**
 * Waits until the torque limit is in force.
 */
#define GIB_HOMING_LIMIT 1

/**
 * Moves to the stop and presses.
 */
#define GIB_HOMING_TOUCH 2

/**
 * Goes back between two touches.
 */
#define GIB_HOMING_RETRACT 3

/**
 * Waits until the deviation is cleared.
 */
#define GIB_HOMING_CLEAR 4

/**
 * Stands while a touch is evaluated in slices.
 */
#define GIB_HOMING_EVALUATE 5

/**
 * Moves off the stop by the zero offset.
 */
#define GIB_HOMING_OFFSET 6

/**
 * Waits until the position is set and the old torque limit in force.
 */
#define GIB_HOMING_SET 7

/**
 * Brakes before everything changed is restored.
 */
#define GIB_HOMING_STOPPING 8

/**
 * Takes the pressure off the stop.
 */
#define GIB_HOMING_UNLOAD 9

/**
 * Waits until the old torque limit is in force.
 */
#define GIB_HOMING_RESTORE 10

/**
 * Ended well.
 */
#define GIB_HOMING_DONE 11

/**
 * Ended with an error; kept until the next start.
 */
#define GIB_HOMING_FAILED 12

/**
 * Event: the way to the stop begins.
 */
#define GIB_HOMING_EVENT_APPROACH 1

/**
 * Event: the torque has risen to the limit, something is touched.
 */
#define GIB_HOMING_EVENT_CONTACT 2

/**
 * Event: torque limiting; the axis stood under it for the detection time.
 */
#define GIB_HOMING_EVENT_LIMITING 4

/**
 * Event: the kernel is asked to clear the deviation.
 */
#define GIB_HOMING_EVENT_CLEAR_REQUESTED 8

/**
 * Event: the kernel has acknowledged it.
 */
#define GIB_HOMING_EVENT_CLEAR_ACKNOWLEDGED 16

/**
 * Event: the command is where the axis is.
 */
#define GIB_HOMING_EVENT_CLEARED 32

/**
 * Event: the zero-offset move begins.
 */
#define GIB_HOMING_EVENT_OFFSET 64

/**
 * Event: homed.
 */
#define GIB_HOMING_EVENT_HOMED 128

/**
 * Request: put `torque_limit` in force in the drive.
 */
#define GIB_HOMING_REQUEST_TORQUE_LIMIT 1

/**
 * Request: drop the undone way, so that the kernel's command is the actual position.
 */
#define GIB_HOMING_REQUEST_CLEAR_DEVIATION 2

/**
 * Request: add `shift_mm` to the encoder's position: it becomes the machine coordinate.
 */
#define GIB_HOMING_REQUEST_SET_POSITION 4

/**
 * gib commands the spindle speed: up, hold, down, hold, `ramps` times (default).
 */
#define GIB_INERTIA_RAMP 0

/**
 * The kernel turns the spindle as it likes; gib listens for `listen_s`, or until `GIB_INERTIA_FINISH`.
 */
#define GIB_INERTIA_LISTEN 1

/**
 * Torque inputs in amperes, times `torque_constant_nm_a`.
 */
#define GIB_TORQUE_AMPERE 2

/**
 * Nothing is going on; the command follows the speed.
 */
#define GIB_INERTIA_IDLE 0

/**
 * Goes to the speed at which the ramps begin.
 */
#define GIB_INERTIA_APPROACH 1

/**
 * Accelerates.
 */
#define GIB_INERTIA_UP 2

/**
 * Holds the upper speed.
 */
#define GIB_INERTIA_HOLD_HIGH 3

/**
 * Brakes.
 */
#define GIB_INERTIA_DOWN 4

/**
 * Holds the lower speed.
 */
#define GIB_INERTIA_HOLD_LOW 5

/**
 * Listens while the kernel turns the spindle.
 */
#define GIB_INERTIA_LISTENING 6

/**
 * Goes back to the speed at which it was started.
 */
#define GIB_INERTIA_RETURN 7

/**
 * Ended; the result can be read.
 */
#define GIB_INERTIA_DONE 8

/**
 * Ended with an error; kept until the next start.
 */
#define GIB_INERTIA_FAILED 9

/**
 * Input flag: listening has lasted long enough; evaluate what was gathered.
 */
#define GIB_INERTIA_FINISH 4

/**
 * Harmonics of the deviation, each by the machine's measured answer (default).
 */
#define GIB_LEARNING_FILTERED 0

/**
 * The deviation itself, point by point with a phase lead, as published.
 */
#define GIB_LEARNING_PUBLISHED 1

/**
 * Most points of a revolution.
 */
#define GIB_LEARNING_POINTS 1024

/**
 * Most harmonics that are learnt.
 */
#define GIB_LEARNING_HARMONICS 16

/**
 * Not started: the command is the target.
 */
#define GIB_LEARNING_IDLE 0

/**
 * The spindle does not turn, or no position is detected; the correction is out or on its way.
 */
#define GIB_LEARNING_WAITING 1

/**
 * The machine settles after a change.
 */
#define GIB_LEARNING_SETTLE 2

/**
 * The deviation is measured over whole revolutions.
 */
#define GIB_LEARNING_MEASURE 3

/**
 * The next correction is computed, a point or a harmonic a cycle.
 */
#define GIB_LEARNING_EVALUATE 4

/**
 * The new correction replaces the old one, over a revolution.
 */
#define GIB_LEARNING_BLEND 5

/**
 * Within the tolerance; the correction stays in force.
 */
#define GIB_LEARNING_DONE 6

/**
 * The correction fades out, to end with an error.
 */
#define GIB_LEARNING_STOPPING 7

/**
 * Ended with an error, kept until the next start. The best correction stays in force after `GIB_ERR_LEARNING_GROWS` and
 * `GIB_ERR_LEARNING_UPDATES`, none after any other.
 */
#define GIB_LEARNING_FAILED 8

/**
 * Reason: the spindle does not turn, or too slowly.
 */
#define GIB_LEARNING_NO_ROTATION 1

/**
 * Reason: the spindle's angle is no number or jumps.
 */
#define GIB_LEARNING_BAD_ANGLE 2

/**
 * Reason: the detected position is no number.
 */
#define GIB_LEARNING_NOT_DETECTED 4

/**
 * Reason: the correction is kept, and the spindle turns at another speed than that at which it was learnt, by more than
 * `speed_tolerance_ratio` over eight times `revolutions`: what is left is more than it was. By more than half of that speed, or
 * the other way round, it would do harm, and is out until the speed is back.
 */
#define GIB_LEARNING_SPEED_CHANGED 8

/**
 * No step gives this reason: of a correction at its bound `correction_um` of the report is `correction_max_um`.
 */
#define GIB_LEARNING_LIMITED 16

/**
 * The speed rises and falls at a constant rate (default).
 */
#define GIB_SPEED_VARIATION_TRIANGLE 0

/**
 * The speed swings as a sine.
 */
#define GIB_SPEED_VARIATION_SINE 1

/**
 * Limits keep torque and power within the motor's at every moment (default).
 */
#define GIB_SPEED_VARIATION_EXACT 0

/**
 * Limits as published: the power at the mean speed only, nothing for friction and cutting. The motor is asked for up
 * to (1 + amplitude) times its power. For comparison. The bounds of speed are kept.
 */
#define GIB_SPEED_VARIATION_PUBLISHED 1

/**
 * Nothing is varied; the command is the speed asked for.
 */
#define GIB_SPEED_VARIATION_IDLE 0

/**
 * The speed varies.
 */
#define GIB_SPEED_VARIATION_RUNNING 1

/**
 * The speed goes back to its mean.
 */
#define GIB_SPEED_VARIATION_STOPPING 2

/**
 * Ended as asked for, at the mean speed.
 */
#define GIB_SPEED_VARIATION_DONE 3

/**
 * Ended with an error; kept until the next start.
 */
#define GIB_SPEED_VARIATION_FAILED 4

/**
 * Input flag: end the variation; the speed goes back to its mean as it is asked for by then, then `GIB_DONE`.
 */
#define GIB_SPEED_VARIATION_STOP 8

/**
 * Measure, warn, compensate (default).
 */
#define GIB_TILT_COMPENSATE 0

/**
 * Measure and report only.
 */
#define GIB_TILT_MEASURE_ONLY 1

/**
 * A cut of known depth: its mean load becomes a row of a table.
 */
#define GIB_TILT_TEACH 2

/**
 * Plane through the whole path (default).
 */
#define GIB_TILT_FIT 0

/**
 * Two points of the path, as published. Carries the whole noise and wear of two readings.
 */
#define GIB_TILT_TWO_POINT 1

/**
 * `load` is the rectified current of a motor phase, A: true RMS over whole electrical periods (default).
 */
#define GIB_TILT_AC_CURRENT 0

/**
 * `load` is a DC load signal, %: its mean.
 */
#define GIB_TILT_DC_LOAD 1

/**
 * Refuse another machining condition than the table's (default).
 */
#define GIB_TILT_REFUSE 0

/**
 * Go on under another condition and say so in the report's `flagged`.
 */
#define GIB_TILT_FLAG 1

/**
 * No rotary axis.
 */
#define GIB_TILT_AXIS_NONE 0

/**
 * Rotary axis A, about X.
 */
#define GIB_TILT_AXIS_A 1

/**
 * Rotary axis B, about Y.
 */
#define GIB_TILT_AXIS_B 2

/**
 * Rotary axis C, about Z.
 */
#define GIB_TILT_AXIS_C 3

/**
 * Nothing is measured and no offset is in force.
 */
#define GIB_TILT_IDLE 0

/**
 * Reads the load along the path.
 */
#define GIB_TILT_MEASURING 1

/**
 * Evaluates the path in slices.
 */
#define GIB_TILT_EVALUATE 2

/**
 * Warns that offsets are to come, and waits for the acknowledgement.
 */
#define GIB_TILT_WARNING 3

/**
 * Brings the offsets in.
 */
#define GIB_TILT_RAMP_ON 4

/**
 * The offsets are in force.
 */
#define GIB_TILT_ACTIVE 5

/**
 * Takes the offsets out.
 */
#define GIB_TILT_RAMP_OFF 6

/**
 * Ended well, no offset in force.
 */
#define GIB_TILT_DONE 7

/**
 * Ended with an error, no offset in force; kept until the next start.
 */
#define GIB_TILT_FAILED 8

/**
 * Input flag: the tool is in the cut, at feed. One stretch with it is one pass.
 */
#define GIB_TILT_INPUT_CUTTING 4

/**
 * Input flag: the path to be measured is finished.
 */
#define GIB_TILT_INPUT_END 8

/**
 * Input flag: take the offsets out; the family then ends well. In answer to the warning it declines them; in the
 * middle of measuring it is an abort, `GIB_ERR_ABORTED`.
 */
#define GIB_TILT_INPUT_OFF 16

/**
 * Rows that a table can hold.
 */
#define GIB_TILT_ROWS 32

/**
 * Not decided yet.
 */
#define GIB_TILT_UNDECIDED 0

/**
 * Within the band that is left alone.
 */
#define GIB_TILT_IN_BAND 1

/**
 * Not larger than its uncertainty: nothing is done.
 */
#define GIB_TILT_NOT_SIGNIFICANT 2

/**
 * A tilt that is to be compensated.
 */
#define GIB_TILT_SIGNIFICANT 3

/**
 * A cut of known depth was read.
 */
#define GIB_TILT_TAUGHT 4

/**
 * The operator took the compensation off at the warning.
 */
#define GIB_TILT_DECLINED 5

/**
 * The workpiece is tilted about x (rotary axis A): the slope is along y.
 */
#define GIB_TILT_ABOUT_X 1

/**
 * The workpiece is tilted about y (rotary axis B): the slope is along x.
 */
#define GIB_TILT_ABOUT_Y 2

/**
 * The path was one oblique line, which cannot tell the two apart: cut in a second direction.
 */
#define GIB_TILT_ABOUT_EITHER 4

/**
 * Harmonics of the spindle's turn, each divided by −ω² (default).
 */
#define GIB_VIBRATION_HARMONIC 0

/**
 * Integrated twice, closed once a revolution, as published.
 */
#define GIB_VIBRATION_INTEGRATE 1

/**
 * Most harmonics that are tracked.
 */
#define GIB_VIBRATION_HARMONICS 16

/**
 * The accelerometer on the seat, the fixed part of the tool slide.
 */
#define GIB_VIBRATION_SEAT 0

/**
 * The accelerometer on the spindle bearing.
 */
#define GIB_VIBRATION_BEARING 1

/**
 * Not started: the position is the plain scale.
 */
#define GIB_VIBRATION_IDLE 0

/**
 * No whole revolution yet, or no rotation: the correction is absent or on its way out.
 */
#define GIB_VIBRATION_WAITING 1

/**
 * The position is corrected; `blend_ratio` says whether fully.
 */
#define GIB_VIBRATION_CORRECTING 2

/**
 * A sensor is bad: the correction fades to the plain scale, and comes back after a good revolution.
 */
#define GIB_VIBRATION_DEGRADED 3

/**
 * Aborted: the correction fades out.
 */
#define GIB_VIBRATION_STOPPING 4

/**
 * Ended with an error; the position is the plain scale until the next start, once the correction has faded.
 */
#define GIB_VIBRATION_FAILED 5

/**
 * Reason: no whole revolution since the start or since the last fault.
 */
#define GIB_VIBRATION_NO_REVOLUTION 1

/**
 * Reason: the spindle does not turn, or too slowly.
 */
#define GIB_VIBRATION_NO_ROTATION 2

/**
 * Reason: the spindle's angle is no number or jumps.
 */
#define GIB_VIBRATION_BAD_ANGLE 4

/**
 * Reason: the seat's acceleration is no number. The bearing's is this, shifted left by 8; so for all below.
 */
#define GIB_VIBRATION_NOT_A_NUMBER 65536

/**
 * Reason: the acceleration is stuck: the same to the last digit for a quarter of a revolution.
 */
#define GIB_VIBRATION_STUCK 131072

/**
 * Reason: the acceleration is at its full scale.
 */
#define GIB_VIBRATION_SATURATED 262144

/**
 * Reason: acceleration or displacement beyond the largest plausible one.
 */
#define GIB_VIBRATION_IMPLAUSIBLE 524288

/**
 * Version of this interface: major · 65536 + minor.
 *
 * Within one major, functions, struct tails and status numbers are added and nothing is changed or taken away;
 * each addition raises the minor. The major is also the number at the end of `libgib.so.0`.
 */
#define GIB_ABI_VERSION 1

/**
 * The machine does what the simulation believes.
 */
#define GIB_DIAGNOSIS_NO_DISCREPANCY 0

/**
 * The named causes explain the discrepancy down to the noise.
 */
#define GIB_DIAGNOSIS_EXPLAINED 1

/**
 * The named causes explain most of the discrepancy.
 */
#define GIB_DIAGNOSIS_PARTLY_EXPLAINED 2

/**
 * The simulation is wrong, and no known cause fits.
 */
#define GIB_DIAGNOSIS_UNKNOWN_CAUSE 3

/**
 * The recording does not suffice; the JSON says what is missing.
 */
#define GIB_DIAGNOSIS_INSUFFICIENT_DATA 4

/**
 * Spell a new value as the program's own dialect is recognised.
 */
#define GIB_PROGRAM_DIALECT_DETECT 0

/**
 * Spell a new value as LinuxCNC's parameter `#<_ina>=0.5`.
 */
#define GIB_PROGRAM_DIALECT_LINUXCNC 1

/**
 * Spell a new value as the OSP variable `INA=0.5`; steps 1 to 9 only.
 */
#define GIB_PROGRAM_DIALECT_OKUMA 2

/**
 * Spell a new value as the comment `(INA=0.5)`.
 */
#define GIB_PROGRAM_DIALECT_ISO 3

/**
 * Bytes that hold every text of `gib_program_last_error_text`, with its NUL.
 */
#define GIB_PROGRAM_TEXT_SIZE 512

/**
 * A lost-motion measurement of one axis. Opaque; its size is `gib_backlash_size()`.
 */
typedef struct gib_backlash gib_backlash;

/**
 * A calibration of two accelerometers. Opaque; its size is `gib_calibration_size()`.
 */
typedef struct gib_calibration gib_calibration;

/**
 * A diagnosis of one axis. Opaque; it owns memory of its own, so that it comes from `gib_diagnosis_new` alone.
 */
typedef struct gib_diagnosis gib_diagnosis;

/**
 * Homing of one axis, of one motor or two. Opaque; its size is `gib_homing_size()`.
 */
typedef struct gib_homing gib_homing;

/**
 * An inertia measurement of one spindle. Opaque; its size is `gib_inertia_size()`.
 */
typedef struct gib_inertia gib_inertia;

/**
 * The learnt command of one axis. Opaque; its size is `gib_learning_size()`.
 */
typedef struct gib_learning gib_learning;

/**
 * A machine file in memory. Opaque; it owns memory of its own, so that it comes from `gib_machine_new` alone.
 */
typedef struct gib_machine gib_machine;

/**
 * Reads and writes part programs, and keeps why the last call failed. Opaque; its size is `gib_program_size()`.
 */
typedef struct gib_program gib_program;

/**
 * A recorder. Opaque; its size is `gib_recorder_size()`.
 */
typedef struct gib_recorder gib_recorder;

/**
 * A speed variation of one spindle. Opaque; its size is `gib_speed_variation_size()`.
 */
typedef struct gib_speed_variation gib_speed_variation;

/**
 * Tilt of one workpiece. Opaque; its size is `gib_tilt_size()`.
 */
typedef struct gib_tilt gib_tilt;

/**
 * The corrected position of one tool slide. Opaque; its size is `gib_vibration_size()`.
 */
typedef struct gib_vibration gib_vibration;

/**
 * What to measure and within which bounds. Zero in a field means its default; fields marked "required" have none.
 *
 * Positions are motor positions in load units (mm). Torque fields are in N·m whatever `torque_unit` says.
 */
typedef struct gib_backlash_config {
    /**
     * Size of this struct as the caller knows it: `sizeof(gib_backlash_config)`. Required.
     */
    uint32_t struct_size;
    /**
     * `GIB_BACKLASH_SLOW_FEED` (default) or `GIB_BACKLASH_STEP`.
     */
    int32_t mode;
    /**
     * `GIB_BACKLASH_FIT` (default) or `GIB_BACKLASH_PEAK`: which estimate is written. Both are reported.
     */
    int32_t method;
    /**
     * Sense of the motion before the first reversal: +1 (default) or -1.
     */
    int32_t first_direction;
    /**
     * 0: measure the reversals of both senses (default). 1: only the first; refused under a constant load of half to all of
     * what the table's friction holds, where only the other sense tells whether the table creeps through a clearance.
     */
    int32_t one_direction;
    /**
     * Reversals measured in each sense, 1 to 20 (default 3).
     */
    int32_t repeats;
    /**
     * Unit of the torque input: `GIB_TORQUE_NM` (default) or `GIB_TORQUE_PERMILLE` of `rated_torque_nm`.
     */
    int32_t torque_unit;
    /**
     * 0: write the compensation when the result is trustworthy (default). 1: only measure.
     */
    int32_t measure_only;
    /**
     * 0: both reversals are at the position where the axis stands at start (default). 1: at the `reference_…` fields.
     */
    int32_t references_given;
    /**
     * Must be 0.
     */
    int32_t reserved;
    /**
     * Servo period, 0.00005 to 0.02 s. Required.
     */
    double cycle_s;
    /**
     * Motor step, and travel between two points of the peak rule, 0.1 to 50 µm (default 1).
     */
    double step_um;
    /**
     * Time a step is held, 2 cycles to 1 s (default 0.02). The torque is read in its last quarter.
     */
    double dwell_s;
    /**
     * Speed of the slow feed, and of the last 0.1 mm of motor travel to each reversal, 0.001 to 5 mm/s (default 0.1).
     */
    double feed_mm_s;
    /**
     * Rest before each reversal, one cycle to 10 s (default 0.2); no less than 65 cycles are taken.
     */
    double settle_s;
    /**
     * Reversal position of the first sense, mm.
     */
    double reference_1_mm;
    /**
     * Reversal position of the second sense, mm.
     */
    double reference_2_mm;
    /**
     * Travel after a reversal within which the table must move, ten times `step_um` to 5000 µm (default 500).
     */
    double detection_limit_um;
    /**
     * Speed of moves between references, 0.1 to 500 mm/s (default 5).
     */
    double approach_speed_mm_s;
    /**
     * Speed at which the sliding torque is read, 0.05 to 20 mm/s (default 1): the lost motion is that of this speed.
     */
    double slide_speed_mm_s;
    /**
     * Travel over which the sliding torque is read, 0.1 to 100 mm and no less than 48 cycles at `slide_speed_mm_s` take (default 1, or
     * that).
     */
    double slide_mm;
    /**
     * Largest commanded acceleration, 0.1 to 10000 mm/s² (default 50). In the cycle in which a move ends it may be one and a half times
     * that; GIB_INPUT_FAULT stops the command at once, and the steps of `GIB_BACKLASH_STEP` are jumps of the position.
     */
    double acceleration_mm_s2;
    /**
     * Lowest motor position allowed, mm, from -1e6. Required, with `travel_max_mm`.
     */
    double travel_min_mm;
    /**
     * Highest motor position allowed, mm, above the lowest and up to 1e6. Required.
     */
    double travel_max_mm;
    /**
     * Largest |torque| allowed, 1e-6 to 1e6 N·m. Required.
     */
    double torque_bound_nm;
    /**
     * Rated torque, 1e-6 to 1e6 N·m. Required for `GIB_TORQUE_PERMILLE`.
     */
    double rated_torque_nm;
    /**
     * Largest |target - position| allowed, 0.001 to 100 mm (default 0.5).
     */
    double lag_limit_mm;
    /**
     * Time within which a request must be acknowledged, 2 cycles to 60 s (default 1).
     */
    double ack_timeout_s;
    /**
     * Smallest change of the compensation amount that the kernel can store, 0.0001 to 100 µm (default 1). An amount asked for counts as
     * in force within half of it: the kernel shall round to the nearest amount that it can store.
     */
    double compensation_resolution_um;
    /**
     * Largest amount that may be written, up to 5000 µm (default: the detection limit).
     */
    double compensation_max_um;
    /**
     * Resolution of the motor encoder, up to 100 µm (default: measured as the smallest change seen).
     */
    double encoder_um;
} gib_backlash_config;
/**
 * Size of the struct in the first published ABI.
 */
#define gib_backlash_config_FIRST_SIZE 208

/**
 * What the kernel tells gib in a cycle.
 */
typedef struct gib_backlash_input {
    /**
     * Motor position in load units, mm, without any compensation in it.
     */
    double position_mm;
    /**
     * Motor torque, positive toward positive positions, in the unit that the configuration names.
     */
    double torque;
    /**
     * Compensation amount in force in the kernel now, µm.
     */
    double compensation_um;
    /**
     * `request_id` of the last request that the kernel has carried out; 0 before the first.
     */
    uint32_t acknowledged_id;
    /**
     * `GIB_INPUT_FAULT`, `GIB_INPUT_ABORT`; other bits must be 0, else `GIB_ERR_CONFIG`.
     */
    uint32_t flags;
} gib_backlash_input;

/**
 * What gib asks of the kernel in a cycle. Always written, and safe, also when the call returns an error.
 */
typedef struct gib_backlash_output {
    /**
     * Commanded motor position, mm. To be followed while `owns_motion` is 1.
     */
    double target_position_mm;
    /**
     * Commanded speed, mm/s, signed.
     */
    double target_speed_mm_s;
    /**
     * Compensation amount that the kernel shall put in force, µm. Valid once `request_id` is not 0.
     */
    double compensation_um;
    /**
     * Way left in the present move, mm.
     */
    double remaining_mm;
    /**
     * Share of the measurement done, 0 to 1.
     */
    double progress_ratio;
    /**
     * What the step returned: `GIB_OK`, `GIB_BUSY`, `GIB_DONE` or the first error.
     */
    int32_t status;
    /**
     * One of the `GIB_BACKLASH_…` phases.
     */
    int32_t phase;
    /**
     * Message number: 0, or the error to tell the operator about; its text is `gib_status_text`.
     */
    int32_t message;
    /**
     * 1 while gib commands the axis, else 0.
     */
    int32_t owns_motion;
    /**
     * 1: the kernel shall keep reversal acceleration off. 0: as it is configured there.
     */
    int32_t reversal_acceleration_off;
    /**
     * Number of the request above: when it changes, put `compensation_um` and `reversal_acceleration_off` in
     * force, then give the number back in `acknowledged_id`. 0: no request was made yet.
     */
    uint32_t request_id;
} gib_backlash_output;

/**
 * Lost motion of one sense, or the mean of both. Lost motion is estimated from torque: it is not the reversal
 * value of ISO 230-2. Lengths in µm; uncertainties are expanded, k = 2.
 */
typedef struct gib_backlash_estimate {
    /**
     * Lost motion between steady motion at `slide_speed_mm_s` one way and the other: clearance + 2·Ts/k, with the table's sliding torque Ts
     * of that speed. Where friction goes by speed (viscous, Stribeck), set the speed that matters: at another the wind-up is another.
     */
    double lost_motion_um;
    /**
     * Its expanded uncertainty, k = 2. It holds what the table's presliding may be: where its bend shows, all that was taken
     * off once more, since how it bends is not known; where none shows, what noise may hide. A table whose friction gives way along
     * a straight line until it slides looks like the drive's spring: nothing here finds that. Nor does it hold cogging or another ripple of
     * the motor's torque with a period of 0.03 to 0.1 mm and 5 % of the friction or more, which bends the slopes alike in every repeat.
     */
    double uncertainty_um;
    /**
     * Part of it that is clearance.
     */
    double clearance_um;
    /**
     * Part of it that is elastic wind-up, 2·Ts/k.
     */
    double windup_um;
    /**
     * Lost motion at standstill, clearance + (|TA+| + |TA-|)/k: what a laser at rest sees.
     */
    double standstill_um;
    /**
     * Standard deviation over the repeats; 0 with one repeat.
     */
    double spread_um;
    /**
     * What the published peak rule reads on the same curves; 0 where it found no peak.
     */
    double peak_um;
    /**
     * Stiffness of the drive at the motor, N·m/mm, and its standard uncertainty.
     */
    double stiffness_nm_mm;
    /**
     * Standard uncertainty of the stiffness, N·m/mm.
     */
    double stiffness_error_nm_mm;
    /**
     * Sliding friction, half the change of torque between the two senses, N·m.
     */
    double sliding_nm;
    /**
     * Part of it that acts on the motor's side and winds nothing up, N·m.
     */
    double motor_friction_nm;
    /**
     * Standard deviation of one torque sample about the fitted curve, N·m.
     */
    double noise_nm;
    /**
     * Reversals measured.
     */
    int32_t reversals;
    /**
     * Reversals in which the peak rule found a peak.
     */
    int32_t peaks;
    /**
     * Motor steps (points of the curve) taken in all.
     */
    int32_t steps;
    /**
     * Reversals whose residuals show structure: the curve is not quite the model's.
     */
    int32_t structured;
} gib_backlash_estimate;

/**
 * What a measurement found and what became of it.
 */
typedef struct gib_backlash_report {
    /**
     * After motion in the first direction, then in the other; all zero where not measured.
     */
    struct gib_backlash_estimate each[2];
    /**
     * Mean of both; the first alone with `one_direction`, and for as long as the other was not measured.
     */
    struct gib_backlash_estimate mean;
    /**
     * Amount in force when the measurement began, µm.
     */
    double old_value_um;
    /**
     * Amount that gib asked the kernel to put in force, µm, not rounded to `compensation_resolution_um`; 0 when none was written.
     */
    double value_written_um;
    /**
     * Amount that the kernel reported in force at the last confirmed request, µm: within half a `compensation_resolution_um` of what was
     * asked for.
     */
    double value_active_um;
    /**
     * `GIB_DONE`, `GIB_BUSY`, `GIB_OK` before a start, or the first error, also once an operator's wish was carried out since.
     */
    int32_t status;
    /**
     * `GIB_BACKLASH_FIT` or `GIB_BACKLASH_PEAK`: which estimate is written.
     */
    int32_t method;
    /**
     * `GIB_BACKLASH_SLOW_FEED` or `GIB_BACKLASH_STEP`.
     */
    int32_t mode;
    /**
     * 1 when a new amount was written and confirmed.
     */
    int32_t written;
    /**
     * 1 while a restore is owed that the kernel has not confirmed.
     */
    int32_t restore_owed;
    /**
     * Travel of the table itself before it slides that showed in the rounding of the curves and was taken off the lost
     * motion, in ‰ of the mean's lost motion; 0 where none shows beyond chance, and always with `GIB_BACKLASH_STEP`, where a table that
     * creeps looks the same: there the uncertainty holds it.
     */
    int32_t presliding_permille;
} gib_backlash_report;

/**
 * The estimate beside a value measured otherwise.
 */
typedef struct gib_backlash_comparison {
    /**
     * Estimate minus measured value, µm, moving: clearance + 2·Ts/k.
     */
    double difference_um;
    /**
     * Standstill estimate minus measured value, µm: what fits a measurement at rest.
     */
    double standstill_difference_um;
    /**
     * Expanded uncertainty of the difference, k = 2, µm.
     */
    double uncertainty_um;
    /**
     * |difference| ÷ its uncertainty (the En number): 1 or less means the two agree.
     */
    double en_ratio;
} gib_backlash_comparison;

/**
 * The first error of an instance, in full.
 */
typedef struct gib_error_detail {
    /**
     * One of the `GIB_ERR_…` numbers, or `GIB_OK` when nothing went wrong.
     */
    int32_t code;
    /**
     * Zero.
     */
    int32_t reserved;
    /**
     * Name of the field or input at fault; empty when no single one is. Static text, never NULL.
     */
    const char *field;
    /**
     * The value found.
     */
    double value;
    /**
     * Smallest value allowed. Where no range applies both bounds are 0: of a number that is odd, or a text of a fit length that is
     * spelled wrong, whose `value` is then the place of its first wrong character, from 1.
     */
    double low;
    /**
     * Largest value allowed.
     */
    double high;
} gib_error_detail;

/**
 * How to calibrate. Zero in a field means its default; fields marked "required" have none.
 *
 * The axis swings about the place where it stands. Torque fields are in N·m whatever `torque_unit` says.
 */
typedef struct gib_calibration_config {
    /**
     * Size of this struct as the caller knows it: `sizeof(gib_calibration_config)`. Required.
     */
    uint32_t struct_size;
    /**
     * `GIB_CALIBRATION_LEAST_SQUARES` (default) or `GIB_CALIBRATION_PUBLISHED`.
     */
    int32_t method;
    /**
     * 1: one more experiment, at the same frequencies, beside those that this instance holds. 0 (default): the first.
     */
    int32_t add;
    /**
     * Frequencies in the list, 1 to 32. Required.
     */
    int32_t frequencies;
    /**
     * Unit of the torque input: `GIB_TORQUE_NM` (default) or `GIB_TORQUE_PERMILLE` of `rated_torque_nm`.
     */
    int32_t torque_unit;
    /**
     * Zero.
     */
    int32_t reserved;
    /**
     * The frequencies, rising by 1 % at least, 0.5 Hz to a tenth of the cycle frequency. Each is moved by less than half a percent, so
     * that whole periods take whole cycles. Required.
     */
    double frequency_hz[GIB_CALIBRATION_POINTS];
    /**
     * Servo period, 0.00005 to 0.02 s. Required.
     */
    double cycle_s;
    /**
     * Largest amplitude, 0.001 to 1000 mm to either side. Required.
     */
    double stroke_mm;
    /**
     * Largest speed, 0.1 to 10000 mm/s (default 100).
     */
    double speed_mm_s;
    /**
     * Largest acceleration, 1 to 1000000 mm/s² (default 5000).
     */
    double acceleration_mm_s2;
    /**
     * Torque that must never be exceeded, 1e-6 to 1e6 N·m. Required.
     */
    double torque_bound_nm;
    /**
     * Part of it that the amplitude is chosen for, 0.05 to 0.9 (default 0.6).
     */
    double torque_share_ratio;
    /**
     * Rated torque, N·m. Required for `GIB_TORQUE_PERMILLE`.
     */
    double rated_torque_nm;
    /**
     * Full scale of the accelerometers, 0.1 to 10000 m/s². Required.
     */
    double acceleration_range_m_s2;
    /**
     * Full scale of the ball bar, 1 to 1000000 µm (default 1000).
     */
    double ball_bar_range_um;
    /**
     * What the accelerometers' makers promise of their gain, as a standard deviation, 0.001 to 1 (default 0.1). A gain that is off
     * by more than three of it is refused. It is taken of the complex gain, along and across: where the experiments do not tell a
     * phase (see `condition_ratio`) it is believed to be 0 within 4 degrees for 0.1, one standard deviation. A sensor that may come
     * late by more needs more: a cycle is 18 degrees at a twentieth of the cycle frequency, which takes 0.3.
     */
    double tolerance_ratio;
    /**
     * Time of measuring at each frequency, 0.1 to 1000 s (default 4), rounded up to 32 periods at least.
     */
    double measure_s;
    /**
     * Time in which the amplitude goes up or down, 0.01 to 10 s (default 0.5), five periods at least; turned round on its way up, a
     * quarter more.
     */
    double ramp_s;
    /**
     * Largest |target - position|, 0.0001 to 100 mm (default the stroke).
     */
    double lag_limit_mm;
} gib_calibration_config;
/**
 * Size of the struct in the first published ABI.
 */
#define gib_calibration_config_FIRST_SIZE 384

/**
 * What the kernel tells gib in a cycle, all of the same instant.
 */
typedef struct gib_calibration_input {
    /**
     * Position of the driven axis, mm.
     */
    double position_mm;
    /**
     * Its motor torque, in the unit of the configuration.
     */
    double torque;
    /**
     * Ball bar between the accelerometers, seat minus bearing, µm.
     */
    double ball_bar_um;
    /**
     * Acceleration of seat and bearing, m/s².
     */
    double acceleration_m_s2[2];
    /**
     * `GIB_INPUT_FAULT`, `GIB_INPUT_ABORT`; other bits must be 0, else `GIB_ERR_CONFIG`.
     */
    uint32_t flags;
    /**
     * Zero.
     */
    uint32_t reserved;
} gib_calibration_input;

/**
 * What gib asks of the kernel in a cycle. Always written, and safe, also when the call returns an error.
 */
typedef struct gib_calibration_output {
    /**
     * Commanded position, mm. To be followed while `owns_motion` is 1.
     */
    double target_position_mm;
    /**
     * Commanded speed, mm/s, signed.
     */
    double target_speed_mm_s;
    /**
     * Present frequency, Hz; after GIB_ERR_CALIBRATION_GAIN or _CONDITION the one whose gain was refused, and `point` its number.
     */
    double frequency_hz;
    /**
     * Present amplitude, mm.
     */
    double amplitude_mm;
    /**
     * What the step returned: `GIB_OK`, `GIB_BUSY`, `GIB_DONE` or the first error.
     */
    int32_t status;
    /**
     * One of the `GIB_CALIBRATION_…` phases.
     */
    int32_t phase;
    /**
     * 0, or the error to tell the operator about; its text is `gib_status_text`.
     */
    int32_t message;
    /**
     * 1 while gib commands the axis, else 0.
     */
    int32_t owns_motion;
    /**
     * 1: position or drive cannot be trusted; take the torque off the motor and brake it, until the next start.
     */
    int32_t stop_drive;
    /**
     * Present frequency in the list, counted from 0.
     */
    int32_t point;
} gib_calibration_output;

/**
 * Both accelerometers at one frequency; arrays: seat, bearing.
 */
typedef struct gib_calibration_point {
    /**
     * Frequency, Hz.
     */
    double frequency_hz;
    /**
     * True displacement over the one from the accelerometer, 0.1 to 10.
     */
    double gain_ratio[2];
    /**
     * Phase of the true displacement ahead of the one from the accelerometer, -180 to 180 degrees.
     */
    double phase_deg[2];
    /**
     * Expanded uncertainty of the gain, k = 2.
     */
    double gain_uncertainty_ratio[2];
    /**
     * Expanded uncertainty of the phase, k = 2, degrees. As far as it rests on `tolerance_ratio` it holds for a sensor that
     * comes no later than that allows.
     */
    double phase_uncertainty_deg[2];
    /**
     * How much an error of the measured displacements is magnified in the gains: 1 is best; beyond 100 the two cannot be
     * told apart and only their difference is known.
     */
    double condition_ratio;
    /**
     * What gains and phases leave of the measured relative displacement, root mean square, µm.
     */
    double residual_um;
    /**
     * Amplitude of the command in the last experiment, mm.
     */
    double amplitude_mm;
    /**
     * Experiments that the point rests on.
     */
    double experiments;
} gib_calibration_point;

/**
 * A calibration: what to give to `gib_vibration_start`.
 */
typedef struct gib_calibration_table {
    /**
     * Size of this struct as the caller knows it: `sizeof(gib_calibration_table)`.
     */
    uint32_t struct_size;
    /**
     * Points that hold something, in order of rising frequency, 1 to 32.
     */
    uint32_t count;
    /**
     * The points.
     */
    struct gib_calibration_point point[GIB_CALIBRATION_POINTS];
} gib_calibration_table;
/**
 * Size of the struct in the first published ABI.
 */
#define gib_calibration_table_FIRST_SIZE 3336

/**
 * What is to be diagnosed. Zero it, set `struct_size`, then `machine` and `recording`.
 */
typedef struct gib_diagnosis_config {
    /**
     * `sizeof(gib_diagnosis_config)`.
     */
    uint32_t struct_size;
    /**
     * Zero.
     */
    uint32_t reserved;
    /**
     * What the simulation believes; is copied.
     */
    const struct gib_machine *machine;
    /**
     * Path of the recording, NUL-terminated.
     */
    const char *recording;
    /**
     * Path of a second recording, not used for fitting, on which the gain is measured; NULL or "" for none: then it
     * is measured on blocks of the first that are held out.
     */
    const char *holdout;
    /**
     * Name of the axis; NULL or "" for the first that machine and recording share.
     */
    const char *axis;
} gib_diagnosis_config;

/**
 * Told how far a diagnosis is; answers 0 to go on, anything else to stop.
 *
 * It is called from threads that gib starts for the work, one call at a time; it must return, and may call
 * gib_diagnosis_abort and no other function of that instance.
 *
 * @param user what was given to gib_diagnosis_run.
 * @param share of the work that is done, 0 to 1, never falling.
 * @param stage what is being done, in a few words; valid during the call.
 */
typedef int32_t (*gib_diagnosis_progress)(void *user, double share, const char *stage);

/**
 * What a diagnosis came to; the JSON has all of it.
 */
typedef struct gib_diagnosis_report {
    /**
     * `GIB_DIAGNOSIS_…`.
     */
    int32_t verdict;
    /**
     * Number of causes named.
     */
    uint32_t findings;
    /**
     * RMS of measured minus predicted torque on rows that were not fitted, unfiltered, as believed; N·m, or N for a linear
     * drive; 0 where not judged.
     */
    double residual_before;
    /**
     * The same with what was found.
     */
    double residual_after;
    /**
     * Noise floor of that residual below the frequency up to which it is judged, in the same unit.
     */
    double noise;
} gib_diagnosis_report;

/**
 * How to home. Zero in a field means its default; fields marked "required" have none.
 *
 * The names are those of PLCopen's MC_HomeOnBlock and its vendors. Positions are motor positions in load units.
 * Torque fields are in N·m whatever `torque_unit` says.
 */
typedef struct gib_homing_config {
    /**
     * Size of this struct as the caller knows it: `sizeof(gib_homing_config)`. Required.
     */
    uint32_t struct_size;
    /**
     * Toward the stop: +1 or -1. Required.
     */
    int32_t direction;
    /**
     * 1: one motor (default). 2: a gantry, each motor with a stop of its own.
     */
    int32_t motors;
    /**
     * `GIB_HOMING_LINE` (default) or `GIB_HOMING_THRESHOLD`: which is the home position. Both are reported.
     */
    int32_t method;
    /**
     * `GIB_POSITION_MM` (default) or `GIB_POSITION_DEG`.
     */
    int32_t position_unit;
    /**
     * Unit of the torque input: `GIB_TORQUE_NM` (default) or `GIB_TORQUE_PERMILLE` of `rated_torque_nm`.
     */
    int32_t torque_unit;
    /**
     * 1: the drive's torque is negative toward positive positions (torque polarity inverted). 0 (default): not.
     */
    int32_t torque_inverted;
    /**
     * `GIB_HOMING_CLEAR_DEVIATION` (default) or `GIB_HOMING_INSTANT_LAG_REDUCTION`.
     */
    int32_t lag_reduction;
    /**
     * Touches that are measured, 1 to 10 (default 3), after a first one that only finds the stop.
     */
    int32_t touches;
    /**
     * Requests that the kernel carries out without acknowledging: a sum of `GIB_HOMING_REQUEST_…` (default 0: it
     * acknowledges all).
     */
    uint32_t unacknowledged;
    /**
     * Servo period, 0.00005 to 0.02 s. Required.
     */
    double cycle_s;
    /**
     * Speed on the way to the stop, 0.01 to 100 mm/s (default 1).
     */
    double approach_speed_mm_s;
    /**
     * Speed of the measured touches, 0.01 mm/s to the approach speed (default: the approach speed, at most 1; down to a
     * quarter of that where the torque would rise to the limit within 25 ms).
     */
    double touch_speed_mm_s;
    /**
     * Largest commanded acceleration, 0.1 to 10000 mm/s² (default 50).
     */
    double acceleration_mm_s2;
    /**
     * Torque limit that the drive shall have in force until homing ends, 1e-6 to 1e6 N·m. Required.
     */
    double torque_limit_nm;
    /**
     * The torque counts as limiting within this of the limit, and beyond the limit by this it is a fault, N·m;
     * 1 to 30 % of the limit (default 10 %).
     */
    double torque_tolerance_nm;
    /**
     * The axis stands when slower than this, 1e-6 mm/s to the approach speed (default a fifth of the touch speed, 0.05 at least, no more than
     * the approach speed).
     */
    double detection_velocity_mm_s;
    /**
     * Time for which the torque must be limiting and the axis stand, 8 cycles to 5 s (default 0.1, 8 cycles at least).
     */
    double detection_time_s;
    /**
     * Smallest way from the start to the stop, 0 (default) to `distance_max_mm`: a stop before it is a fault.
     */
    double distance_min_mm;
    /**
     * Largest way that the axis may go toward the stop from where it stands at the start, 0.001 to 100000 mm. Required.
     */
    double distance_max_mm;
    /**
     * Time for the whole homing, a cycle to 100000 s (default: what its ways take, twice, and 10 s, as far as that is
     * allowed).
     */
    double time_limit_s;
    /**
     * Largest |target - position|, 0.001 to 100 mm (default 1 mm and the way of 0.1 s).
     */
    double lag_limit_mm;
    /**
     * Coordinate of the place where the axis stands when homed, -1e6 to 1e6 mm (default 0).
     */
    double set_position_mm;
    /**
     * Way from the contact point to that place, away from the stop, 0 (default) to 1000 mm. There the axis must come within a tenth of
     * `press_max_mm` of its command, or without torque within half of its way, in ten detection times, else `GIB_ERR_LAG`.
     */
    double zero_offset_mm;
    /**
     * Speed of that move, 0.01 to 500 mm/s (default: the approach speed).
     */
    double zero_offset_speed_mm_s;
    /**
     * Way back from the stop between touches, 0.05 to 100 mm (default 1). More than twice the lost motion. At the start the axis must
     * stand further from the stop than that, else `GIB_ERR_HOMING_ON_STOP`.
     */
    double retract_mm;
    /**
     * Largest way from contact to the torque limit, 0.0001 mm to 0.4 of the retraction (default): more is a soft stop.
     */
    double press_max_mm;
    /**
     * Touches may differ by this, 0.1 to 1000 µm (default 5), besides their own uncertainty.
     */
    double touch_tolerance_um;
    /**
     * Gantry: largest difference of the two sides, 0.001 to 100 mm (default 0.2).
     */
    double square_tolerance_mm;
    /**
     * Time within which a request must be acknowledged, 2 cycles to 60 s (default 1).
     */
    double ack_timeout_s;
    /**
     * Rated torque, 1e-6 to 1e6 N·m. Required for `GIB_TORQUE_PERMILLE`.
     */
    double rated_torque_nm;
} gib_homing_config;
/**
 * Size of the struct in the first published ABI.
 */
#define gib_homing_config_FIRST_SIZE 208

/**
 * What the kernel tells gib in a cycle. Arrays: motor 1, motor 2; the second only matters for a gantry.
 */
typedef struct gib_homing_input {
    /**
     * Motor position in load units, mm, in the coordinate of the start; from the request to set the position on, in any cycle either in
     * that or with `shift_mm` added.
     */
    double position_mm[2];
    /**
     * Motor torque, positive toward positive positions unless `torque_inverted`, in the unit of the configuration.
     */
    double torque[2];
    /**
     * Torque limit in force in the drive now, in the unit of `torque`. From the acknowledgement of its request to the next
     * such request it must stay within 1 % of what was asked for, else `GIB_ERR_HOMING_LIMIT`; where that request is
     * `unacknowledged`, any finite number will do.
     */
    double torque_limit;
    /**
     * `request_id` of the last request that the kernel has carried out; 0 before the first.
     */
    uint32_t acknowledged_id;
    /**
     * `GIB_INPUT_FAULT` (also after a following-error trip), `GIB_INPUT_ABORT`; other bits must be 0, else `GIB_ERR_CONFIG`.
     */
    uint32_t flags;
} gib_homing_input;

/**
 * What gib asks of the kernel in a cycle. Always written, and safe, also when the call returns an error.
 */
typedef struct gib_homing_output {
    /**
     * Commanded motor positions, mm, in the coordinate of the start. To be followed while `owns_motion` is 1, in that coordinate also
     * when `shift_mm` has been added to the positions told: the axis does not move by being told where it is.
     */
    double target_position_mm[2];
    /**
     * Commanded speeds, mm/s, signed.
     */
    double target_speed_mm_s[2];
    /**
     * To add to each encoder position to have machine coordinates, mm. Valid with the request to set the position.
     */
    double shift_mm[2];
    /**
     * Torque limit that the drive shall have, in the unit of the input. Valid once `request_id` is not 0.
     */
    double torque_limit;
    /**
     * What the step returned: `GIB_OK`, `GIB_BUSY`, `GIB_DONE` or the first error.
     */
    int32_t status;
    /**
     * One of the `GIB_HOMING_…` phases.
     */
    int32_t phase;
    /**
     * Message number: 0, or the error to tell the operator about, from the cycle on in which it is found; its text is
     * `gib_status_text`. `GIB_ERR_RESTORE_UNCONFIRMED` after an end without the old torque limit, which is then still asked for.
     */
    int32_t message;
    /**
     * 1 while gib commands the axis, else 0.
     */
    int32_t owns_motion;
    /**
     * `GIB_HOMING_EVENT_…` that happened so far in this homing; each happens once, in the order of the numbers. With
     * `GIB_HOMING_INSTANT_LAG_REDUCTION` no clearing is requested nor acknowledged.
     */
    uint32_t events;
    /**
     * Those of this cycle.
     */
    uint32_t new_events;
    /**
     * `GIB_HOMING_REQUEST_…` that the present request asks for.
     */
    uint32_t requests;
    /**
     * Number of the present request: when it changes, carry out `requests`, then give the number back in
     * `acknowledged_id`. 0: no request was made yet.
     */
    uint32_t request_id;
    /**
     * 1: position, torque or drive cannot be trusted; take the torque off all motors and brake them, until the next start. What is
     * commanded no longer counts then; requests still do.
     */
    int32_t stop_drive;
    /**
     * Zero.
     */
    int32_t reserved;
} gib_homing_output;

/**
 * What a homing found on one motor. Lengths in mm and µm, torque in N·m.
 */
typedef struct gib_homing_side {
    /**
     * Contact point, mean of the measured touches, in the coordinate of the start, mm.
     */
    double contact_mm;
    /**
     * Its expanded uncertainty, k = 2, µm; what it holds and what not is told in docs/homing.md.
     */
    double uncertainty_um;
    /**
     * Largest minus smallest contact point of the measured touches, µm.
     */
    double spread_um;
    /**
     * Where the plain threshold puts the stop, mean of the measured touches, mm.
     */
    double threshold_mm;
    /**
     * Way from the contact point to the torque limit, µm.
     */
    double press_um;
    /**
     * Stiffness of drive and stop in series, N·m/mm.
     */
    double stiffness_nm_mm;
    /**
     * Torque before contact, toward the stop, N·m.
     */
    double sliding_nm;
    /**
     * Standard deviation of the torque about level and line, N·m.
     */
    double noise_nm;
    /**
     * Add this to the encoder's position to have the machine coordinate, mm.
     */
    double shift_mm;
} gib_homing_side;

/**
 * What a homing found and what became of it.
 */
typedef struct gib_homing_report {
    /**
     * Motor 1, motor 2; the second is all zero without a gantry.
     */
    struct gib_homing_side side[2];
    /**
     * Gantry: way to the stop of motor 1 minus that of motor 2, mm.
     */
    double skew_mm;
    /**
     * Torque limit in force when homing began, in the unit of the input.
     */
    double old_torque_limit;
    /**
     * `GIB_DONE`, `GIB_BUSY`, `GIB_OK` before a start, or the first error.
     */
    int32_t status;
    /**
     * `GIB_HOMING_LINE` or `GIB_HOMING_THRESHOLD`.
     */
    int32_t method;
    /**
     * Touches measured so far.
     */
    int32_t touches;
    /**
     * Cycles since the start.
     */
    int32_t cycles;
    /**
     * 1 while the kernel owes the restored torque limit.
     */
    int32_t restore_owed;
    /**
     * Zero.
     */
    int32_t reserved;
} gib_homing_report;

/**
 * What to measure and within which bounds. Zero in a field means its default; fields marked "required" have none.
 *
 * Torque fields are in N·m whatever `torque_unit` says; all are at the spindle.
 */
typedef struct gib_inertia_config {
    /**
     * Size of this struct as the caller knows it: `sizeof(gib_inertia_config)`. Required.
     */
    uint32_t struct_size;
    /**
     * `GIB_INERTIA_RAMP` (default) or `GIB_INERTIA_LISTEN`.
     */
    int32_t mode;
    /**
     * Unit of the torque input: `GIB_TORQUE_NM` (default), `GIB_TORQUE_PERMILLE` of `rated_torque_nm`, or
     * `GIB_TORQUE_AMPERE` times `torque_constant_nm_a`.
     */
    int32_t torque_unit;
    /**
     * Times up and down, 1 to 50 (default 2; of 1 the report says `one_acceleration`). There is room for some 20 short ramps up and down; of more, the first count.
     */
    int32_t ramps;
    /**
     * Process step that the value will belong to, 0 for the whole program, to 9999. Given back in the report.
     */
    int32_t process_step;
    /**
     * Must be 0.
     */
    int32_t reserved;
    /**
     * Servo period, 0.00005 to 0.02 s. Required.
     */
    double cycle_s;
    /**
     * Speed at which the ramps begin, rpm, without a sign: `standstill_rpm` to 0.9 of |`speed_high_rpm`| (default a tenth of it).
     */
    double speed_low_rpm;
    /**
     * Speed at which the ramps end, rpm, ten times `standstill_rpm` to 200000. Required for ramps. Negative: turns the other way.
     */
    double speed_high_rpm;
    /**
     * Acceleration of the ramps, rpm/s; every second one has 0.6 of it, so that a motor that saturates is not taken for another
     * inertia. A ramp must take at most 600 s, and at least twice `takeup_s` and 16 cycles more than it. Required for ramps.
     */
    double acceleration_rpm_s;
    /**
     * Time at constant speed after each ramp, a cycle to 60 s (default 0.3).
     */
    double hold_s;
    /**
     * Time after each change of acceleration or sense that is left out: take-up of belts and gears, and the
     * drive's own transients, up to 5 s (default 0.1).
     */
    double takeup_s;
    /**
     * Longest time to listen, 256 cycles to 3600 s. Required for `GIB_INERTIA_LISTEN`, where `GIB_INERTIA_FINISH` may end it at any
     * moment; not used by `GIB_INERTIA_RAMP`, 0 to 3600 s.
     */
    double listen_s;
    /**
     * Speed below which the spindle counts as standing, rpm, up to 1000 (default 1).
     */
    double standstill_rpm;
    /**
     * Speed above which the field is weakened, so that current × constant is not the torque; what is faster is left
     * out, rpm (default: none known).
     */
    double base_speed_rpm;
    /**
     * Torque above which the motor saturates, so that it delivers less than reported; what is above is left out,
     * N·m (default: none known).
     */
    double saturation_nm;
    /**
     * Largest |torque| allowed, N·m (default: not watched).
     */
    double torque_bound_nm;
    /**
     * Largest |command - speed| allowed, 0.001 to 400000 rpm (default: a quarter of `speed_high_rpm`).
     */
    double lag_limit_rpm;
    /**
     * Rated torque, 1e-6 to 1e6 N·m. Required for `GIB_TORQUE_PERMILLE`.
     */
    double rated_torque_nm;
    /**
     * Torque constant, 1e-9 to 1e6 N·m/A. Required for `GIB_TORQUE_AMPERE`.
     */
    double torque_constant_nm_a;
    /**
     * The machine's own inertia (spindle, rotor, chuck), kg·m²; taken off, so that the value belongs to the workpiece
     * and travels to another machine (default 0: nothing is taken off).
     */
    double own_inertia_kg_m2;
    /**
     * Its expanded uncertainty (k = 2), 0 (default) to 1e6 kg·m².
     */
    double own_uncertainty_kg_m2;
    /**
     * Expanded uncertainty wanted, as a share of the total inertia, 0.001 to 0.25 (default 0.05). The report says
     * which ramp would reach it.
     */
    double target_ratio;
} gib_inertia_config;
/**
 * Size of the struct in the first published ABI.
 */
#define gib_inertia_config_FIRST_SIZE 160

/**
 * What the kernel tells gib in a cycle.
 */
typedef struct gib_inertia_input {
    /**
     * Spindle speed, rpm, signed.
     */
    double speed_rpm;
    /**
     * Motor torque of the same instant, positive toward positive speed, in the unit that the configuration names.
     */
    double torque;
    /**
     * `GIB_INPUT_FAULT`, `GIB_INPUT_ABORT`, `GIB_INERTIA_FINISH`; other bits must be 0.
     */
    uint32_t flags;
    /**
     * Zero.
     */
    uint32_t reserved;
} gib_inertia_input;

/**
 * What gib asks of the kernel in a cycle. Always written, and safe, also when the call returns an error.
 */
typedef struct gib_inertia_output {
    /**
     * Commanded spindle speed, rpm. To be followed while `owns_motion` is 1.
     */
    double speed_command_rpm;
    /**
     * Share of the measurement done, 0 to 1.
     */
    double progress_ratio;
    /**
     * What the step returned: `GIB_OK`, `GIB_BUSY`, `GIB_DONE` or the first error.
     */
    int32_t status;
    /**
     * One of the `GIB_INERTIA_…` phases.
     */
    int32_t phase;
    /**
     * Message number: 0, or the error to tell the operator about; its text is `gib_status_text`.
     */
    int32_t message;
    /**
     * 1 while gib commands the spindle, else 0.
     */
    int32_t owns_motion;
} gib_inertia_output;

/**
 * Inertia and friction of a spindle. Uncertainties are expanded: the interval holds the truth in 95 of 100 cases.
 */
typedef struct gib_inertia_report {
    /**
     * All that turns, kg·m².
     */
    double total_kg_m2;
    /**
     * Its expanded uncertainty, kg·m².
     */
    double total_uncertainty_kg_m2;
    /**
     * Total minus the machine's own: the workpiece's, what `INA` holds. Equal to the total where no own one is given.
     */
    double workpiece_kg_m2;
    /**
     * Its expanded uncertainty, kg·m².
     */
    double workpiece_uncertainty_kg_m2;
    /**
     * Coulomb friction, N·m. Holds a constant torque too where the spindle turned one way only.
     */
    double coulomb_nm;
    /**
     * Its expanded uncertainty, N·m.
     */
    double coulomb_uncertainty_nm;
    /**
     * Viscous friction, N·m·s/rad.
     */
    double viscous_nm_s;
    /**
     * Its expanded uncertainty, N·m·s/rad.
     */
    double viscous_uncertainty_nm_s;
    /**
     * Constant torque, N·m; 0 where the spindle turned one way only.
     */
    double constant_nm;
    /**
     * What torque over acceleration alone would say, kg·m²: friction counted as inertia.
     */
    double naive_kg_m2;
    /**
     * Standard deviation of a block's torque about the fit, N·m.
     */
    double scatter_nm;
    /**
     * Speed above which torque and motion no longer agree (field weakening), rpm; 0: none found.
     */
    double weakening_rpm;
    /**
     * Torque above which torque and motion no longer agree (saturation), N·m; 0: none found.
     */
    double saturation_nm;
    /**
     * The ramp that would reach the uncertainty wanted: its lower speed, rpm.
     */
    double ramp_low_rpm;
    /**
     * Its upper speed, rpm.
     */
    double ramp_high_rpm;
    /**
     * Its acceleration, rpm/s.
     */
    double ramp_acceleration_rpm_s;
    /**
     * Torque that it takes at its upper speed, N·m; 0: not known.
     */
    double ramp_torque_nm;
    /**
     * How often it goes up and down.
     */
    int32_t ramp_times;
    /**
     * `GIB_OK`, or why the inertia cannot be used: `GIB_ERR_INERTIA_…`.
     */
    int32_t verdict;
    /**
     * 1 when the uncertainty wanted was reached.
     */
    int32_t target_reached;
    /**
     * 1 when the spindle both sped up and slowed down: only then is inertia independent of friction.
     */
    int32_t both_ways;
    /**
     * Blocks that the result rests on.
     */
    int32_t blocks_used;
    /**
     * Blocks dropped as outliers.
     */
    int32_t blocks_dropped;
    /**
     * Blocks left out as weakened or saturated.
     */
    int32_t blocks_left_out;
    /**
     * Process step that the value belongs to, as configured.
     */
    int32_t process_step;
    /**
     * 1 when all ramps have one acceleration: a motor that saturates, and reports more torque than it delivers, then cannot be told
     * from another inertia. Say `saturation_nm`, or ramp at two accelerations, one at most two thirds of the other, as
     * `GIB_INERTIA_RAMP` does from two ramps on.
     */
    int32_t one_acceleration;
    /**
     * Zero.
     */
    int32_t reserved;
} gib_inertia_report;

/**
 * What to vary, by which motor. Zero in a field means its default; fields marked "required" have none.
 */
typedef struct gib_speed_variation_config {
    /**
     * Size of this struct as the caller knows it: `sizeof(gib_speed_variation_config)`. Required.
     */
    uint32_t struct_size;
    /**
     * `GIB_SPEED_VARIATION_TRIANGLE` (default) or `GIB_SPEED_VARIATION_SINE`.
     */
    int32_t waveform;
    /**
     * `GIB_SPEED_VARIATION_EXACT` (default) or `GIB_SPEED_VARIATION_PUBLISHED`.
     */
    int32_t formula;
    /**
     * Must be 0.
     */
    int32_t reserved;
    /**
     * Servo period, 0.00005 to 0.02 s. Required to start.
     */
    double cycle_s;
    /**
     * Mean spindle speed, rpm, |speed| from `speed_min_rpm` (0.001 at least) to `speed_max_rpm`; negative turns the other way.
     * Required.
     */
    double speed_rpm;
    /**
     * Amplitude as a share of the mean speed, 0.000001 to 0.999 (0.1 is ±10 %). Required to start.
     */
    double amplitude_ratio;
    /**
     * Period of the variation, 0.02 s and 8 cycles to 600 s. Required to start.
     */
    double period_s;
    /**
     * Inertia of workpiece and chuck, 1e-9 to 1e6 kg·m²: measured, or `INA` from the program's head. Required.
     */
    double inertia_kg_m2;
    /**
     * The machine's own inertia (spindle, rotor), 0 (default) to 1e6 kg·m², added to it.
     */
    double own_inertia_kg_m2;
    /**
     * Largest power of the motor, 0.001 to 1e9 W. Required.
     */
    double power_w;
    /**
     * Largest torque of the motor at the spindle, N·m, from 1e-6 (default: only the power limits).
     */
    double torque_nm;
    /**
     * Highest speed allowed, 0.001 to 200000 rpm (default 200000).
     */
    double speed_max_rpm;
    /**
     * Lowest speed allowed, 0 (default) to `speed_max_rpm`, rpm.
     */
    double speed_min_rpm;
    /**
     * Coulomb friction of the spindle, 0 (default) to 1e6 N·m.
     */
    double coulomb_nm;
    /**
     * Viscous friction of the spindle, 0 (default) to 1e6 N·m·s/rad.
     */
    double viscous_nm_s;
    /**
     * Torque that cutting uses, 0 (default) to 1e6 N·m.
     */
    double cutting_nm;
    /**
     * Share of torque and power to keep back, 0 (default) to 0.9.
     */
    double reserve_ratio;
    /**
     * Frequency of the chatter to be broken up, up to 100000 Hz; for the recommended values only (default: not known).
     */
    double chatter_hz;
} gib_speed_variation_config;
/**
 * Size of the struct in the first published ABI.
 */
#define gib_speed_variation_config_FIRST_SIZE 136

/**
 * What the kernel asks for in a cycle. Values may change in any cycle; a change takes effect within 20 cycles.
 */
typedef struct gib_speed_variation_input {
    /**
     * Mean spindle speed, rpm, with override; within the configuration's limits and in its sense, else
     * GIB_ERR_SPEED_VARIATION_SPEED ends the variation. Where nothing is varied: the speed asked for, of either sense, or 0.
     */
    double speed_rpm;
    /**
     * Amplitude as a share of the mean speed, up to 0.999; 0: as configured.
     */
    double amplitude_ratio;
    /**
     * Period, 0.02 s and 8 cycles to 600 s; 0: as configured.
     */
    double period_s;
    /**
     * Torque that cutting uses now, 0 to 1e6 N·m; the configuration's holds where that is more.
     */
    double cutting_nm;
    /**
     * `GIB_INPUT_FAULT`, `GIB_INPUT_ABORT`, `GIB_SPEED_VARIATION_STOP`; other bits must be 0.
     */
    uint32_t flags;
    /**
     * Zero.
     */
    uint32_t reserved;
} gib_speed_variation_input;

/**
 * What gib asks of the kernel in a cycle. Always written, and safe, also when the call returns an error.
 */
typedef struct gib_speed_variation_output {
    /**
     * Commanded spindle speed, rpm.
     */
    double speed_command_rpm;
    /**
     * Torque that the commanded change of speed takes, J·ω', N·m: feed-forward for the drive.
     */
    double torque_nm;
    /**
     * Amplitude in effect: the one asked for, or the largest possible one where that is less; 0 until the first is worked
     * out.
     */
    double amplitude_ratio;
    /**
     * Largest amplitude possible at the period, speed and cutting torque in effect.
     */
    double amplitude_limit_ratio;
    /**
     * Shortest period that the motor can do at the amplitude asked for and the speed and cutting torque in effect, s; 0: none.
     */
    double period_limit_s;
    /**
     * What the step returned: `GIB_OK`, `GIB_BUSY`, `GIB_DONE` or the first error.
     */
    int32_t status;
    /**
     * One of the `GIB_SPEED_VARIATION_…` phases.
     */
    int32_t phase;
    /**
     * Message number: 0, the error, or why the amplitude in effect is less than asked for.
     */
    int32_t message;
    /**
     * Zero.
     */
    int32_t reserved;
} gib_speed_variation_output;

/**
 * What is possible, and what is recommended.
 */
typedef struct gib_speed_variation_limits {
    /**
     * Largest amplitude for the period given; 0: none, or no period was given.
     */
    double amplitude_ratio;
    /**
     * Shortest period for the amplitude given that the motor can do, s; 0: none does, or no amplitude was given. It may be
     * shorter than a start takes, which is 0.02 s and 8 cycles.
     */
    double period_s;
    /**
     * Largest amplitude for the period, as published.
     */
    double published_amplitude_ratio;
    /**
     * Shortest period for the amplitude, as published, s.
     */
    double published_period_s;
    /**
     * Power that the published amplitude would take at the top of its swing, friction and cutting included, W.
     */
    double published_power_w;
    /**
     * Recommended amplitude: sweeps the chatter's regeneration through one wave, or 10 % where the chatter's
     * frequency is not given.
     */
    double recommended_amplitude_ratio;
    /**
     * Recommended period: the shortest for it that the motor can do and a start takes, but not below five revolutions, s;
     * 0: none.
     */
    double recommended_period_s;
    /**
     * Power at the top of the swing of the amplitude and period given, W; 0: not both were given.
     */
    double power_w;
    /**
     * Torque at the top of that swing, N·m.
     */
    double torque_nm;
    /**
     * What limits the amplitude: `GIB_ERR_SPEED_VARIATION_POWER`, `_TORQUE`, `_SPEED` or `_NONE`; 0 without a period.
     */
    int32_t limited_by;
    /**
     * Zero.
     */
    int32_t reserved;
} gib_speed_variation_limits;

/**
 * What to record, under which name. Zero in a field means its default; fields marked "required" have none.
 */
typedef struct gib_recorder_config {
    /**
     * Size of this struct as the caller knows it: `sizeof(gib_recorder_config)`. Required.
     */
    uint32_t struct_size;
    /**
     * Values in every row, 1 to 64. Required.
     */
    uint32_t channels;
    /**
     * Rows in the ring, 16 to what makes 1 GiB (default: four seconds of rows). A reader that is away longer loses rows.
     */
    uint32_t capacity_rows;
    /**
     * Servo cycles from row to row, 1 to 1000000 (default 1).
     */
    uint32_t every_cycles;
    /**
     * Permissions of the shared memory, to read and write alone, from 0600 (default: who records may read) to 0666.
     */
    uint32_t mode;
    /**
     * Zero.
     */
    uint32_t reserved;
    /**
     * Servo period, 0.000001 to 1 s. Required.
     */
    double cycle_s;
    /**
     * Name under which `gib record` finds it: 1 to 40 letters, digits, `-`, `_`, `.`. Copied. Required.
     */
    const char *name;
    /**
     * Name of the machine, which every recording carries: 1 to 40 letters, digits, `-`, `_`. Copied. Required.
     */
    const char *machine;
    /**
     * Names of the columns, one a channel, separated by commas: "x.position_mm,x.torque_nm". At most 3775 bytes. A
     * signal of the recording format must have a unit that it can have; other names are recorded as they are.
     * Copied. Required.
     */
    const char *columns;
} gib_recorder_config;

/**
 * What a recorder has done.
 */
typedef struct gib_recorder_report {
    /**
     * Rows written since the start.
     */
    uint64_t rows;
    /**
     * Bytes of shared memory.
     */
    uint64_t bytes;
    /**
     * Rows in the ring.
     */
    uint32_t capacity_rows;
    /**
     * Values in a row.
     */
    uint32_t channels;
    /**
     * 1: the memory is locked and never paged out. 0: the system refused the lock (RLIMIT_MEMLOCK); the pages are there
     * all the same, and only a machine short of memory can take them away.
     */
    int32_t locked;
    /**
     * What the last step returned.
     */
    int32_t status;
} gib_recorder_report;

/**
 * How the position is to be corrected. Zero in a field means its default; fields marked "required" have none.
 */
typedef struct gib_vibration_config {
    /**
     * Size of this struct as the caller knows it: `sizeof(gib_vibration_config)`. Required.
     */
    uint32_t struct_size;
    /**
     * `GIB_VIBRATION_HARMONIC` (default) or `GIB_VIBRATION_INTEGRATE`.
     */
    int32_t method;
    /**
     * Harmonics of a revolution that are tracked, 1 to 16 (default 8). The workpiece's form and twice its corners should
     * be among them. Those above 0.4 of the sampling frequency are left out while the spindle is that fast.
     */
    int32_t harmonics;
    /**
     * 1: a second slide (XM) carries the slide; its encoder is in the input. 0 (default): none.
     */
    int32_t second_slide;
    /**
     * Harmonic at which `GIB_VIBRATION_INTEGRATE` takes gain and phase of the calibration, 1 to 16 (default 1).
     */
    int32_t main_harmonic;
    /**
     * Zero.
     */
    int32_t reserved;
    /**
     * Servo period, 0.00005 to 0.02 s. Required.
     */
    double cycle_s;
    /**
     * Full scale of the accelerometers, 0.1 to 10000 m/s²: a reading there is saturated. Required.
     */
    double acceleration_range_m_s2;
    /**
     * Largest plausible acceleration, up to the range (default).
     */
    double acceleration_max_m_s2;
    /**
     * Largest plausible displacement of seat or bearing, 0.1 to 10000 µm (default 100): more is a bad sensor.
     */
    double displacement_max_um;
    /**
     * Slowest speed at which the spindle counts as turning, 1 to 10000 rpm (default 30).
     */
    double speed_min_rpm;
    /**
     * Fastest speed that the spindle's encoder can show, up to a quarter turn a cycle (default 10000, or that).
     */
    double speed_max_rpm;
    /**
     * Lowest frequency at which an acceleration is worth a displacement, 0.1 to 1000 Hz (default 1).
     */
    double frequency_min_hz;
    /**
     * Revolutions over which the harmonics are averaged while the speed is steady, 1 to 1000 (default 16).
     */
    double averaging_revolutions;
    /**
     * Time over which the correction comes and goes, 0.001 to 10 s (default 0.1).
     */
    double fade_s;
    /**
     * Time constant of the measured speed, one cycle to 1 s (default 0.02).
     */
    double speed_filter_s;
} gib_vibration_config;
/**
 * Size of the struct in the first published ABI.
 */
#define gib_vibration_config_FIRST_SIZE 104

/**
 * What the kernel tells gib in a cycle, all of the same instant.
 */
typedef struct gib_vibration_input {
    /**
     * X linear scale: tool slide against its seat, mm.
     */
    double scale_mm;
    /**
     * Encoder of the second slide (XM), mm; only looked at with `second_slide`. Beyond 1e9 mm it counts as no number.
     */
    double second_slide_mm;
    /**
     * Spindle angle, degrees; wrapped anywhere or not at all.
     */
    double angle_deg;
    /**
     * Acceleration of seat and bearing, m/s², positive as the scale is.
     */
    double acceleration_m_s2[2];
    /**
     * `GIB_INPUT_ABORT`, `GIB_INPUT_FAULT`; other bits must be 0, else `GIB_ERR_CONFIG`. All fade the correction out.
     */
    uint32_t flags;
    /**
     * Zero.
     */
    uint32_t reserved;
} gib_vibration_input;

/**
 * What gib gives back in a cycle. Always written, and finite, also when the call returns an error.
 */
typedef struct gib_vibration_output {
    /**
     * Where the tool is against the workpiece: scale, second slide, and correction, mm.
     */
    double position_mm;
    /**
     * The correction that is in `position_mm`, µm.
     */
    double correction_um;
    /**
     * Displacement of seat and bearing, µm; the second slide's own motion is not in it.
     */
    double displacement_um[2];
    /**
     * Their difference, seat minus bearing, µm.
     */
    double relative_um;
    /**
     * Measured spindle speed, signed, rpm.
     */
    double speed_rpm;
    /**
     * How much of the relative displacement is in the position: 0, plain scale, to 1.
     */
    double blend_ratio;
    /**
     * What the step returned: `GIB_OK` idle, `GIB_BUSY`, or the first error.
     */
    int32_t status;
    /**
     * One of the `GIB_VIBRATION_…` phases.
     */
    int32_t phase;
    /**
     * 0, or the status to tell the operator about; its text is `gib_status_text`.
     */
    int32_t message;
    /**
     * Why the plain scale is in force, or on its way: a sum of `GIB_VIBRATION_…` reasons, 0 when the correction is.
     */
    uint32_t reasons;
} gib_vibration_output;

/**
 * What is known of the vibration. Amplitudes are those of `A·cos(kθ − phase)`.
 */
typedef struct gib_vibration_report {
    /**
     * Amplitude of the relative displacement at each harmonic from 1 on, µm; method harmonic only.
     */
    double amplitude_um[GIB_VIBRATION_HARMONICS];
    /**
     * Its phase at spindle angle 0, degrees.
     */
    double phase_deg[GIB_VIBRATION_HARMONICS];
    /**
     * Offset of each accelerometer, m/s².
     */
    double offset_m_s2[2];
    /**
     * What the harmonics leave of each acceleration, standard deviation, m/s²; method harmonic only.
     */
    double noise_m_s2[2];
    /**
     * Measured spindle speed, signed, rpm.
     */
    double speed_rpm;
    /**
     * Revolutions since the last time that the correction had to begin anew.
     */
    double revolutions;
    /**
     * Cycles since the start that the spindle turned and a bad sensor kept the correction out.
     */
    uint64_t degraded_cycles;
    /**
     * Every reason since the start.
     */
    uint32_t reasons_seen;
    /**
     * `GIB_BUSY`, `GIB_OK` before a start, or the first error.
     */
    int32_t status;
    /**
     * `GIB_VIBRATION_HARMONIC` or `GIB_VIBRATION_INTEGRATE`.
     */
    int32_t method;
    /**
     * Zero.
     */
    int32_t reserved;
} gib_vibration_report;

/**
 * A machining condition. A table holds for one only.
 */
typedef struct gib_tilt_condition {
    /**
     * Number of the tool, any.
     */
    uint32_t tool_id;
    /**
     * Number of the material, any.
     */
    uint32_t material_id;
    /**
     * Spindle speed, 1 to 1000000 min⁻¹.
     */
    double speed_rpm;
    /**
     * Feed along the path, 0.1 to 1000000 mm/min.
     */
    double feed_mm_min;
} gib_tilt_condition;

/**
 * One rotary axis of a machine with four or five axes.
 */
typedef struct gib_tilt_rotary {
    /**
     * `GIB_TILT_AXIS_…`; none (default) leaves the tilt to z.
     */
    int32_t axis;
    /**
     * 0: the axis turns the workpiece (default). 1: it turns the tool.
     */
    int32_t turns_tool;
    /**
     * +1 (0 means +1): a positive command turns what it carries by the right hand about the machine's axis. -1: the other way.
     */
    int32_t sense;
    /**
     * Zero.
     */
    int32_t reserved;
    /**
     * A point on the axis of rotation at the angles of the measurement, mm: in machine coordinates where it turns the
     * workpiece, from the tool tip where it turns the tool.
     */
    double pivot_mm[3];
} gib_tilt_rotary;

/**
 * How to measure and compensate. Zero in a field means its default; fields marked "required" have none.
 */
typedef struct gib_tilt_config {
    /**
     * Size of this struct as the caller knows it: `sizeof(gib_tilt_config)`. Required.
     */
    uint32_t struct_size;
    /**
     * `GIB_TILT_COMPENSATE` (default), `GIB_TILT_MEASURE_ONLY` or `GIB_TILT_TEACH`.
     */
    int32_t purpose;
    /**
     * `GIB_TILT_FIT` (default) or `GIB_TILT_TWO_POINT`. Both are reported.
     */
    int32_t method;
    /**
     * `GIB_TILT_AC_CURRENT` (default) or `GIB_TILT_DC_LOAD`; must be the table's.
     */
    int32_t signal;
    /**
     * Another condition than the table's: `GIB_TILT_REFUSE` (default) or `GIB_TILT_FLAG`.
     */
    int32_t other_condition;
    /**
     * Pole pairs of the spindle motor, times the ratio of its gear when it has one, 1 to 100. Required for a current.
     */
    int32_t pole_pairs;
    /**
     * 1: the kernel keeps the tool at the workpiece when rotary axes turn (tool centre point control, RTCP), so that
     * x y z get no pivot's offset. 0 (default): gib adds it.
     */
    int32_t tool_centre_point;
    /**
     * Zero.
     */
    int32_t reserved;
    /**
     * Servo period, 0.00005 to 0.02 s. Required.
     */
    double cycle_s;
    /**
     * Condition of this cut; compared with the table's. Required.
     */
    struct gib_tilt_condition condition;
    /**
     * Speed and feed may differ from the condition by this, 0.001 to 0.5 (default 0.05).
     */
    double condition_tolerance_ratio;
    /**
     * Length of path at both ends of every pass that does not count, since the tool enters or leaves there, 0 to 1000 mm
     * (default 0: the weights alone reject it). The tool's diameter is a good choice.
     */
    double entry_mm;
    /**
     * Time over which load is averaged before it is turned into depth, 8 cycles to 10 s (default 0.1, or 8 cycles where
     * these are longer; longer where the time limit needs it, see there).
     */
    double block_s;
    /**
     * Longest time in the cut, 1 to 20000 s (default 200). Beyond 2000 blocks, blocks get longer.
     */
    double time_limit_s;
    /**
     * Expected wear (k = 1): share by which the apparent depth grows in a metre of cut, 0.00001 to 10 (default 0.01).
     * Where the passes cannot tell wear from tilt it enters the uncertainty; where they can, ten times it is one more measurement.
     */
    double wear_ratio_m;
    /**
     * A tilt up to this is left alone, 0 to 45° (default 0).
     */
    double band_deg;
    /**
     * A change of load along the path up to this is left alone, in the unit of the load (default 0).
     */
    double band_load;
    /**
     * Depth that the path shall cut everywhere, mm. 0 (default): the depth at the start of the path.
     */
    double nominal_depth_mm;
    /**
     * Largest offset of x, y and z, 0.001 to 100 mm (default 5).
     */
    double offset_max_mm;
    /**
     * Largest offset of a, b and c, 0.001 to 45° (default 5).
     */
    double offset_max_deg;
    /**
     * Largest speed of an offset, 0.001 to 1000 mm/s (default 20). It bounds the ramps, and z while the path goes on.
     */
    double offset_speed_mm_s;
    /**
     * Largest acceleration of an offset, 0.01 to 100000 mm/s² (default 100).
     */
    double offset_acceleration_mm_s2;
    /**
     * Largest speed of an angular offset, 0.0001 to 1000 °/s (default 1).
     */
    double offset_speed_deg_s;
    /**
     * Largest acceleration of an angular offset, 0.001 to 100000 °/s² (default 10).
     */
    double offset_acceleration_deg_s2;
    /**
     * Time within which the warning must be acknowledged, 2 cycles to 3600 s (default 60).
     */
    double ack_timeout_s;
    /**
     * Rotary axes, the one nearest the machine's bed first; the second is carried by it when both turn the same side.
     */
    struct gib_tilt_rotary rotary[2];
} gib_tilt_config;
/**
 * Size of the struct in the first published ABI.
 */
#define gib_tilt_config_FIRST_SIZE 264

/**
 * Load by depth of cut under one condition, in the order of depth. Plain numbers: fill it by hand, by
 * `gib_tilt_table_add` or from a file.
 */
typedef struct gib_tilt_table {
    /**
     * Size of this struct as the caller knows it: `sizeof(gib_tilt_table)`. Required.
     */
    uint32_t struct_size;
    /**
     * Rows in use, up to `GIB_TILT_ROWS`; a measurement needs 2.
     */
    uint32_t rows;
    /**
     * The condition under which the rows were cut.
     */
    struct gib_tilt_condition condition;
    /**
     * `GIB_TILT_AC_CURRENT` or `GIB_TILT_DC_LOAD`: what the loads are.
     */
    int32_t signal;
    /**
     * Zero.
     */
    int32_t reserved;
    /**
     * Depth of cut of each row, mm, rising.
     */
    double depth_mm[GIB_TILT_ROWS];
    /**
     * Load of each row, rising.
     */
    double load[GIB_TILT_ROWS];
    /**
     * Standard uncertainty of each load; 0: not known, taken as exact.
     */
    double load_std[GIB_TILT_ROWS];
    /**
     * Cuts that each row is the mean of.
     */
    uint32_t cuts[GIB_TILT_ROWS];
} gib_tilt_table;
/**
 * Size of the struct in the first published ABI.
 */
#define gib_tilt_table_FIRST_SIZE 936

/**
 * What the kernel tells gib in a cycle.
 */
typedef struct gib_tilt_input {
    /**
     * Commanded position x y z of the tool tip in machine coordinates, without gib's offsets, mm.
     */
    double position_mm[3];
    /**
     * Commanded angles a b c without gib's offsets, °; 0 for an axis that is not there. One that is configured stays within 0.01
     * of the first cut until the offsets are out again: `GIB_ERR_TILT_CONDITION` in later cuts and until the offsets are in.
     */
    double rotary_deg[3];
    /**
     * Spindle load: current of one phase, rectified or not, A; or DC load, %.
     */
    double load;
    /**
     * Spindle speed, min⁻¹; the sign does not matter.
     */
    double speed_rpm;
    /**
     * `request_id` of the last warning that the operator has accepted; 0 before the first.
     */
    uint32_t acknowledged_id;
    /**
     * `GIB_INPUT_FAULT`, `GIB_INPUT_ABORT`, `GIB_TILT_INPUT_…`; other bits must be 0.
     */
    uint32_t flags;
} gib_tilt_input;

/**
 * What gib asks of the kernel in a cycle. Always written, and safe, also when the call returns an error.
 */
typedef struct gib_tilt_output {
    /**
     * Add to the commanded x y z, mm.
     */
    double offset_mm[3];
    /**
     * Add to the commanded a b c, °.
     */
    double offset_deg[3];
    /**
     * What the step returned: `GIB_OK`, `GIB_BUSY`, `GIB_DONE` or the first error.
     */
    int32_t status;
    /**
     * One of the `GIB_TILT_…` phases.
     */
    int32_t phase;
    /**
     * Message number: 0, or the error to tell the operator about; its text is `gib_status_text`.
     */
    int32_t message;
    /**
     * 1: the operator is to be warned that offsets are to come, and to accept it.
     */
    int32_t warning;
    /**
     * Number of the present warning, to be given back in `acknowledged_id`; 0: none was given yet.
     */
    uint32_t request_id;
    /**
     * 1: the position asks for more than the largest offset, which is put out instead.
     */
    int32_t limited;
} gib_tilt_output;

/**
 * What was found. Angles in °; uncertainties are expanded, k = 2.
 */
typedef struct gib_tilt_report {
    /**
     * Angle between the workpiece's plane and the path's, 0 or above.
     */
    double tilt_deg;
    /**
     * Its uncertainty.
     */
    double uncertainty_deg;
    /**
     * Tilt about x by the right hand; the surface rises along +y.
     */
    double about_x_deg;
    /**
     * Its uncertainty; 90 where the path cannot tell.
     */
    double about_x_uncertainty_deg;
    /**
     * Tilt about y by the right hand; the surface falls along +x.
     */
    double about_y_deg;
    /**
     * Its uncertainty; 90 where the path cannot tell.
     */
    double about_y_uncertainty_deg;
    /**
     * Slope of the surface along x, mm/mm.
     */
    double slope_x_ratio;
    /**
     * Slope of the surface along y, mm/mm.
     */
    double slope_y_ratio;
    /**
     * Direction of the path, or of its longer side, from +x toward +y, -90 to 90.
     */
    double path_deg;
    /**
     * Depth at the middle of the path as the tool of its start would see it, mm; 0 when teaching.
     */
    double depth_mm;
    /**
     * Load at the middle of the first pass; when teaching, of the path at the start's wear: the row to be added.
     */
    double load;
    /**
     * Standard uncertainty of that load.
     */
    double load_std;
    /**
     * Wear: share by which the apparent depth grows in a metre of cut; 0 where not told apart from tilt.
     */
    double wear_ratio_m;
    /**
     * Its uncertainty.
     */
    double wear_uncertainty_ratio_m;
    /**
     * The published rule on the first pass, its start and the point farthest from it: depths, mm; 0 outside the table.
     */
    double two_point_depth_mm[2];
    /**
     * The published rule's tilt.
     */
    double two_point_deg;
    /**
     * Scatter of a block about the plane, in load.
     */
    double scatter_load;
    /**
     * Offsets x y z at the start of the path, mm; 0 unless the tilt is to be compensated.
     */
    double offset_mm[3];
    /**
     * Offsets a b c.
     */
    double offset_deg[3];
    /**
     * Slope that z follows along x and y, mm/mm: all of the tilt, or what no rotary axis reaches.
     */
    double z_slope_ratio[2];
    /**
     * `GIB_TILT_IN_BAND` and so on.
     */
    int32_t decision;
    /**
     * Sum of `GIB_TILT_ABOUT_…`: the axes about which the tilt is beyond its uncertainty.
     */
    int32_t axes;
    /**
     * Sum of `GIB_TILT_ABOUT_…`: the axes that the directions of the path can tell.
     */
    int32_t axes_seen;
    /**
     * 1: wear was told from tilt by reversed or repeated passes. 0: its expected amount is in the uncertainty.
     */
    int32_t wear_separated;
    /**
     * 1: cut under another condition than the table's.
     */
    int32_t flagged;
    /**
     * `GIB_TILT_FIT` or `GIB_TILT_TWO_POINT`.
     */
    int32_t method;
    /**
     * Status of the step that ended the run, or of the last one.
     */
    int32_t status;
    /**
     * Blocks that were fitted.
     */
    uint32_t blocks;
    /**
     * Of these, without weight: entry, exit, chips.
     */
    uint32_t rejected;
    /**
     * Blocks left out: spindle speed or feed of another condition.
     */
    uint32_t off_condition;
    /**
     * Blocks left out: load outside the table.
     */
    uint32_t outside_table;
    /**
     * Blocks left out: samples on too few phases of the current.
     */
    uint32_t aliased;
} gib_tilt_report;

/**
 * What the published rule makes of two points of a path.
 */
typedef struct gib_tilt_two_point_result {
    /**
     * Depth of cut at each point, mm.
     */
    double depth_mm[2];
    /**
     * atan(|difference of depth| ÷ |distance|), °.
     */
    double tilt_deg;
    /**
     * Difference of depth ÷ distance, signed along rising position, mm/mm.
     */
    double slope;
} gib_tilt_two_point_result;

/**
 * How to learn. Zero in a field means its default; fields marked "required" have none.
 */
typedef struct gib_learning_config {
    /**
     * Size of this struct as the caller knows it: `sizeof(gib_learning_config)`. Required.
     */
    uint32_t struct_size;
    /**
     * `GIB_LEARNING_FILTERED` (default) or `GIB_LEARNING_PUBLISHED`.
     */
    int32_t method;
    /**
     * Points of a revolution, an even number from 16 to 1024 (default 256), at least four a harmonic. For the published method no more than a
     * revolution has cycles: a point that no cycle met takes the deviation of the one before it.
     */
    int32_t points;
    /**
     * Harmonics of a revolution that are learnt, 1 to 16 (default 8); only for `GIB_LEARNING_FILTERED`.
     */
    int32_t harmonics;
    /**
     * Revolutions over which the deviation is averaged, 1 to 64 (default 2).
     */
    int32_t revolutions;
    /**
     * Revolutions that the machine is given to settle after a change, 1 to 64 (default 2).
     */
    int32_t settle_revolutions;
    /**
     * Updates at most, 1 to 10000 (default 100).
     */
    int32_t updates;
    /**
     * 1: begin from the correction that this instance holds, learnt before or loaded, of as many points; refused without one. 0 (default): from none.
     */
    int32_t resume;
    /**
     * Servo period, 0.00005 to 0.02 s. Required.
     */
    double cycle_s;
    /**
     * Phase lead Δθ at the present speed, 0 to 90 degrees (default 0).
     */
    double lead_deg;
    /**
     * Lag of the servo, for a lead that grows with speed, 0 to 0.1 s (default 0). Both leads add.
     */
    double lag_s;
    /**
     * Share γ of what is wrong that an update takes away, 0.05 to 1 (default 0.7; 1 for the published method).
     */
    double gain_ratio;
    /**
     * Deviation at which learning is done, root mean square over a revolution, 0.001 to 1000 µm. Required.
     */
    double tolerance_um;
    /**
     * Largest correction, 0.1 to 100000 µm. Required.
     */
    double correction_max_um;
    /**
     * Fastest change of the correction, 0.001 to 10000 mm/s (default 100).
     */
    double correction_speed_mm_s;
    /**
     * Deviation of a single cycle beyond which the correction is taken back at once, up to 1000000 µm (default 1000).
     */
    double deviation_max_um;
    /**
     * Growth of the deviation over its best beyond which an update has failed, 1.01 to 10 (default 1.2).
     */
    double growth_ratio;
    /**
     * Slowest speed at which the spindle counts as turning, 1 to 10000 rpm (default 30).
     */
    double speed_min_rpm;
    /**
     * Relative change of speed beyond which deviations are no longer compared, 0.001 to 0.5 (default 0.02); of a correction that is
     * kept it is told, by `GIB_LEARNING_SPEED_CHANGED`.
     */
    double speed_tolerance_ratio;
    /**
     * Time over which the correction comes and goes, 0.001 to 10 s (default 0.1).
     */
    double fade_s;
    /**
     * Longest time to wait for the spindle to turn and for a position to be detected, 0.1 to 100000 s (default 60).
     */
    double wait_s;
} gib_learning_config;
/**
 * Size of the struct in the first published ABI.
 */
#define gib_learning_config_FIRST_SIZE 136

/**
 * What the kernel tells gib in a cycle, all of the same instant.
 */
typedef struct gib_learning_input {
    /**
     * Where the tool is to be now, mm.
     */
    double target_mm;
    /**
     * Where it was detected now, mm: the corrected position of family `vibration`, or a scale.
     */
    double detected_mm;
    /**
     * Spindle angle, degrees; wrapped anywhere or not at all.
     */
    double angle_deg;
    /**
     * `GIB_INPUT_ABORT`, `GIB_INPUT_FAULT`; other bits must be 0, else `GIB_ERR_CONFIG`. All fade the correction out.
     */
    uint32_t flags;
    /**
     * Zero.
     */
    uint32_t reserved;
} gib_learning_input;

/**
 * What gib gives back in a cycle. Always written, and finite, also when the call returns an error.
 */
typedef struct gib_learning_output {
    /**
     * What to command in place of the target, mm.
     */
    double command_mm;
    /**
     * The correction in it, µm.
     */
    double correction_um;
    /**
     * What the step returned: `GIB_OK` idle, `GIB_BUSY`, `GIB_DONE`, or the first error.
     */
    int32_t status;
    /**
     * One of the `GIB_LEARNING_…` phases.
     */
    int32_t phase;
    /**
     * 0, or the status to tell the operator about; its text is `gib_status_text`.
     */
    int32_t message;
    /**
     * A sum of `GIB_LEARNING_…` reasons why learning waits or is held back, else 0.
     */
    uint32_t reasons;
} gib_learning_output;

/**
 * How far learning has come. Deviations are root mean squares over a revolution.
 */
typedef struct gib_learning_report {
    /**
     * Deviation before the first update, µm.
     */
    double first_um;
    /**
     * Deviation of the last measurement, µm.
     */
    double last_um;
    /**
     * Smallest so far, µm, at the present speed.
     */
    double best_um;
    /**
     * Largest |deviation| at a point in the last measurement, µm.
     */
    double peak_um;
    /**
     * Largest |correction| in force, µm.
     */
    double correction_um;
    /**
     * Speed of the last measurement, signed, rpm.
     */
    double speed_rpm;
    /**
     * Updates so far.
     */
    int32_t updates;
    /**
     * Updates that were taken back because the deviation grew.
     */
    int32_t rejected;
    /**
     * Points of a revolution.
     */
    int32_t points;
    /**
     * `GIB_OK` before a start, `GIB_BUSY`, `GIB_DONE`, or the first error.
     */
    int32_t status;
} gib_learning_report;

/**
 * One point of the revolution.
 */
typedef struct gib_learning_point {
    /**
     * Spindle angle, -180 to 180 degrees.
     */
    double angle_deg;
    /**
     * Where the tool is to be, mm.
     */
    double target_mm;
    /**
     * What is commanded, mm.
     */
    double command_mm;
    /**
     * Where the tool was detected in the last measurement, its mean, mm; the target where it was not.
     */
    double detected_mm;
} gib_learning_point;

/**
 * All functions of the library, each named as in this header without its `gib_`.
 *
 * Get it from `gib_api`. A member whose offset is not below `struct_size` is not in this library.
 */
typedef struct gib_api_table {
    /**
     * Size of the table that this library has, in bytes.
     */
    uint32_t struct_size;
    /**
     * Zero.
     */
    uint32_t reserved;
    /**
     * See gib_abi_version.
     */
    uint32_t (*abi_version)(void);
    /**
     * See gib_version.
     */
    const char *(*version)(void);
    /**
     * See gib_status_text.
     */
    const char *(*status_text)(int32_t status);
    /**
     * See gib_backlash_size.
     */
    uintptr_t (*backlash_size)(void);
    /**
     * See gib_backlash_init_in.
     */
    int32_t (*backlash_init_in)(void *memory, uintptr_t size, struct gib_backlash **out);
    /**
     * See gib_backlash_new.
     */
    struct gib_backlash *(*backlash_new)(void);
    /**
     * See gib_backlash_free.
     */
    void (*backlash_free)(struct gib_backlash *handle);
    /**
     * See gib_backlash_start.
     */
    int32_t (*backlash_start)(struct gib_backlash *handle, const struct gib_backlash_config *config);
    /**
     * See gib_backlash_step.
     */
    int32_t (*backlash_step)(struct gib_backlash *handle,
                             const struct gib_backlash_input *input,
                             struct gib_backlash_output *output);
    /**
     * See gib_backlash_abort.
     */
    int32_t (*backlash_abort)(struct gib_backlash *handle);
    /**
     * See gib_backlash_restore.
     */
    int32_t (*backlash_restore)(struct gib_backlash *handle);
    /**
     * See gib_backlash_enable.
     */
    int32_t (*backlash_enable)(struct gib_backlash *handle, int32_t on);
    /**
     * See gib_backlash_result.
     */
    int32_t (*backlash_result)(const struct gib_backlash *handle, struct gib_backlash_report *report);
    /**
     * See gib_backlash_curve.
     */
    int32_t (*backlash_curve)(const struct gib_backlash *handle,
                              int32_t sense,
                              double *travel_um,
                              double *torque_nm,
                              uintptr_t capacity,
                              uintptr_t *count);
    /**
     * See gib_backlash_compare.
     */
    int32_t (*backlash_compare)(struct gib_backlash *handle,
                                double measured_um,
                                double uncertainty_um,
                                struct gib_backlash_comparison *comparison);
    /**
     * See gib_backlash_last_error.
     */
    int32_t (*backlash_last_error)(const struct gib_backlash *handle, struct gib_error_detail *detail);
    /**
     * See gib_program_size.
     */
    uintptr_t (*program_size)(void);
    /**
     * See gib_program_init_in.
     */
    int32_t (*program_init_in)(void *memory, uintptr_t size, struct gib_program **out);
    /**
     * See gib_program_new.
     */
    struct gib_program *(*program_new)(void);
    /**
     * See gib_program_free.
     */
    void (*program_free)(struct gib_program *handle);
    /**
     * See gib_program_get.
     */
    int32_t (*program_get)(struct gib_program *handle, const char *path, uint32_t step, double *inertia_kg_m2);
    /**
     * See gib_program_set.
     */
    int32_t (*program_set)(struct gib_program *handle,
                           const char *path,
                           uint32_t step,
                           double inertia_kg_m2,
                           int32_t dialect);
    /**
     * See gib_program_remove.
     */
    int32_t (*program_remove)(struct gib_program *handle, const char *path, uint32_t step);
    /**
     * See gib_program_last_error.
     */
    int32_t (*program_last_error)(const struct gib_program *handle, struct gib_error_detail *detail);
    /**
     * See gib_program_last_error_text.
     */
    int32_t (*program_last_error_text)(const struct gib_program *handle, char *text, uintptr_t size);
    /**
     * See gib_homing_size.
     */
    uintptr_t (*homing_size)(void);
    /**
     * See gib_homing_init_in.
     */
    int32_t (*homing_init_in)(void *memory, uintptr_t size, struct gib_homing **out);
    /**
     * See gib_homing_new.
     */
    struct gib_homing *(*homing_new)(void);
    /**
     * See gib_homing_free.
     */
    void (*homing_free)(struct gib_homing *handle);
    /**
     * See gib_homing_start.
     */
    int32_t (*homing_start)(struct gib_homing *handle, const struct gib_homing_config *config);
    /**
     * See gib_homing_step.
     */
    int32_t (*homing_step)(struct gib_homing *handle,
                           const struct gib_homing_input *input,
                           struct gib_homing_output *output);
    /**
     * See gib_homing_abort.
     */
    int32_t (*homing_abort)(struct gib_homing *handle);
    /**
     * See gib_homing_result.
     */
    int32_t (*homing_result)(const struct gib_homing *handle, struct gib_homing_report *report);
    /**
     * See gib_homing_last_error.
     */
    int32_t (*homing_last_error)(const struct gib_homing *handle, struct gib_error_detail *detail);
    /**
     * See gib_inertia_size.
     */
    uintptr_t (*inertia_size)(void);
    /**
     * See gib_inertia_init_in.
     */
    int32_t (*inertia_init_in)(void *memory, uintptr_t size, struct gib_inertia **out);
    /**
     * See gib_inertia_new.
     */
    struct gib_inertia *(*inertia_new)(void);
    /**
     * See gib_inertia_free.
     */
    void (*inertia_free)(struct gib_inertia *handle);
    /**
     * See gib_inertia_start.
     */
    int32_t (*inertia_start)(struct gib_inertia *handle, const struct gib_inertia_config *config);
    /**
     * See gib_inertia_step.
     */
    int32_t (*inertia_step)(struct gib_inertia *handle,
                            const struct gib_inertia_input *input,
                            struct gib_inertia_output *output);
    /**
     * See gib_inertia_abort.
     */
    int32_t (*inertia_abort)(struct gib_inertia *handle);
    /**
     * See gib_inertia_result.
     */
    int32_t (*inertia_result)(struct gib_inertia *handle, struct gib_inertia_report *report);
    /**
     * See gib_inertia_last_error.
     */
    int32_t (*inertia_last_error)(const struct gib_inertia *handle, struct gib_error_detail *detail);
    /**
     * See gib_speed_variation_size.
     */
    uintptr_t (*speed_variation_size)(void);
    /**
     * See gib_speed_variation_init_in.
     */
    int32_t (*speed_variation_init_in)(void *memory, uintptr_t size, struct gib_speed_variation **out);
    /**
     * See gib_speed_variation_new.
     */
    struct gib_speed_variation *(*speed_variation_new)(void);
    /**
     * See gib_speed_variation_free.
     */
    void (*speed_variation_free)(struct gib_speed_variation *handle);
    /**
     * See gib_speed_variation_start.
     */
    int32_t (*speed_variation_start)(struct gib_speed_variation *handle,
                                     const struct gib_speed_variation_config *config);
    /**
     * See gib_speed_variation_step.
     */
    int32_t (*speed_variation_step)(struct gib_speed_variation *handle,
                                    const struct gib_speed_variation_input *input,
                                    struct gib_speed_variation_output *output);
    /**
     * See gib_speed_variation_abort.
     */
    int32_t (*speed_variation_abort)(struct gib_speed_variation *handle);
    /**
     * See gib_speed_variation_result.
     */
    int32_t (*speed_variation_result)(struct gib_speed_variation *handle,
                                      struct gib_speed_variation_limits *limits);
    /**
     * See gib_speed_variation_possible.
     */
    int32_t (*speed_variation_possible)(const struct gib_speed_variation_config *config,
                                        struct gib_speed_variation_limits *limits);
    /**
     * See gib_speed_variation_last_error.
     */
    int32_t (*speed_variation_last_error)(const struct gib_speed_variation *handle,
                                          struct gib_error_detail *detail);
    /**
     * See gib_recorder_size.
     */
    uintptr_t (*recorder_size)(void);
    /**
     * See gib_recorder_init_in.
     */
    int32_t (*recorder_init_in)(void *memory, uintptr_t size, struct gib_recorder **out);
    /**
     * See gib_recorder_new.
     */
    struct gib_recorder *(*recorder_new)(void);
    /**
     * See gib_recorder_free.
     */
    void (*recorder_free)(struct gib_recorder *handle);
    /**
     * See gib_recorder_start.
     */
    int32_t (*recorder_start)(struct gib_recorder *handle, const struct gib_recorder_config *config);
    /**
     * See gib_recorder_step.
     */
    int32_t (*recorder_step)(struct gib_recorder *handle, const double *values, uint32_t count);
    /**
     * See gib_recorder_abort.
     */
    int32_t (*recorder_abort)(struct gib_recorder *handle);
    /**
     * See gib_recorder_close.
     */
    int32_t (*recorder_close)(struct gib_recorder *handle);
    /**
     * See gib_recorder_result.
     */
    int32_t (*recorder_result)(const struct gib_recorder *handle, struct gib_recorder_report *report);
    /**
     * See gib_recorder_last_error.
     */
    int32_t (*recorder_last_error)(const struct gib_recorder *handle, struct gib_error_detail *detail);
    /**
     * See gib_vibration_size.
     */
    uintptr_t (*vibration_size)(void);
    /**
     * See gib_vibration_init_in.
     */
    int32_t (*vibration_init_in)(void *memory, uintptr_t size, struct gib_vibration **out);
    /**
     * See gib_vibration_new.
     */
    struct gib_vibration *(*vibration_new)(void);
    /**
     * See gib_vibration_free.
     */
    void (*vibration_free)(struct gib_vibration *handle);
    /**
     * See gib_vibration_start.
     */
    int32_t (*vibration_start)(struct gib_vibration *handle,
                               const struct gib_vibration_config *config,
                               const struct gib_calibration_table *table);
    /**
     * See gib_vibration_step.
     */
    int32_t (*vibration_step)(struct gib_vibration *handle,
                              const struct gib_vibration_input *input,
                              struct gib_vibration_output *output);
    /**
     * See gib_vibration_abort.
     */
    int32_t (*vibration_abort)(struct gib_vibration *handle);
    /**
     * See gib_vibration_result.
     */
    int32_t (*vibration_result)(const struct gib_vibration *handle, struct gib_vibration_report *report);
    /**
     * See gib_vibration_last_error.
     */
    int32_t (*vibration_last_error)(const struct gib_vibration *handle, struct gib_error_detail *detail);
    /**
     * See gib_calibration_size.
     */
    uintptr_t (*calibration_size)(void);
    /**
     * See gib_calibration_init_in.
     */
    int32_t (*calibration_init_in)(void *memory, uintptr_t size, struct gib_calibration **out);
    /**
     * See gib_calibration_new.
     */
    struct gib_calibration *(*calibration_new)(void);
    /**
     * See gib_calibration_free.
     */
    void (*calibration_free)(struct gib_calibration *handle);
    /**
     * See gib_calibration_start.
     */
    int32_t (*calibration_start)(struct gib_calibration *handle, const struct gib_calibration_config *config);
    /**
     * See gib_calibration_step.
     */
    int32_t (*calibration_step)(struct gib_calibration *handle,
                                const struct gib_calibration_input *input,
                                struct gib_calibration_output *output);
    /**
     * See gib_calibration_abort.
     */
    int32_t (*calibration_abort)(struct gib_calibration *handle);
    /**
     * See gib_calibration_result.
     */
    int32_t (*calibration_result)(const struct gib_calibration *handle, struct gib_calibration_table *table);
    /**
     * See gib_calibration_save.
     */
    int32_t (*calibration_save)(struct gib_calibration *handle, const char *path);
    /**
     * See gib_calibration_load.
     */
    int32_t (*calibration_load)(struct gib_calibration *handle, const char *path);
    /**
     * See gib_calibration_last_error.
     */
    int32_t (*calibration_last_error)(const struct gib_calibration *handle, struct gib_error_detail *detail);
    /**
     * See gib_tilt_size.
     */
    uintptr_t (*tilt_size)(void);
    /**
     * See gib_tilt_init_in.
     */
    int32_t (*tilt_init_in)(void *memory, uintptr_t size, struct gib_tilt **out);
    /**
     * See gib_tilt_new.
     */
    struct gib_tilt *(*tilt_new)(void);
    /**
     * See gib_tilt_free.
     */
    void (*tilt_free)(struct gib_tilt *handle);
    /**
     * See gib_tilt_start.
     */
    int32_t (*tilt_start)(struct gib_tilt *handle,
                          const struct gib_tilt_config *config,
                          const struct gib_tilt_table *table);
    /**
     * See gib_tilt_step.
     */
    int32_t (*tilt_step)(struct gib_tilt *handle,
                         const struct gib_tilt_input *input,
                         struct gib_tilt_output *output);
    /**
     * See gib_tilt_abort.
     */
    int32_t (*tilt_abort)(struct gib_tilt *handle);
    /**
     * See gib_tilt_result.
     */
    int32_t (*tilt_result)(const struct gib_tilt *handle, struct gib_tilt_report *report);
    /**
     * See gib_tilt_last_error.
     */
    int32_t (*tilt_last_error)(const struct gib_tilt *handle, struct gib_error_detail *detail);
    /**
     * See gib_tilt_table_add.
     */
    int32_t (*tilt_table_add)(struct gib_tilt_table *table,
                              double depth_mm,
                              double load,
                              double load_std,
                              struct gib_error_detail *detail);
    /**
     * See gib_tilt_table_check.
     */
    int32_t (*tilt_table_check)(const struct gib_tilt_table *table, struct gib_error_detail *detail);
    /**
     * See gib_tilt_table_save.
     */
    int32_t (*tilt_table_save)(const struct gib_tilt_table *table,
                               const char *path,
                               struct gib_error_detail *detail);
    /**
     * See gib_tilt_table_load.
     */
    int32_t (*tilt_table_load)(struct gib_tilt_table *table, const char *path, struct gib_error_detail *detail);
    /**
     * See gib_tilt_two_point.
     */
    int32_t (*tilt_two_point)(const struct gib_tilt_table *table,
                              const double *position_mm,
                              const double *load,
                              struct gib_tilt_two_point_result *result,
                              struct gib_error_detail *detail);
    /**
     * See gib_machine_new.
     */
    struct gib_machine *(*machine_new)(void);
    /**
     * See gib_machine_free.
     */
    void (*machine_free)(struct gib_machine *handle);
    /**
     * See gib_machine_read.
     */
    int32_t (*machine_read)(struct gib_machine *handle, const char *json, uintptr_t length);
    /**
     * See gib_machine_load.
     */
    int32_t (*machine_load)(struct gib_machine *handle, const char *path);
    /**
     * See gib_machine_save.
     */
    int32_t (*machine_save)(struct gib_machine *handle, const char *path);
    /**
     * See gib_machine_result.
     */
    int32_t (*machine_result)(const struct gib_machine *handle, char *json, uintptr_t size, uintptr_t *needed);
    /**
     * See gib_machine_ignored_keys.
     */
    int32_t (*machine_ignored_keys)(const struct gib_machine *handle,
                                    char *text,
                                    uintptr_t size,
                                    uintptr_t *needed);
    /**
     * See gib_machine_last_error_text.
     */
    int32_t (*machine_last_error_text)(const struct gib_machine *handle, char *text, uintptr_t size);
    /**
     * See gib_diagnosis_new.
     */
    struct gib_diagnosis *(*diagnosis_new)(void);
    /**
     * See gib_diagnosis_free.
     */
    void (*diagnosis_free)(struct gib_diagnosis *handle);
    /**
     * See gib_diagnosis_start.
     */
    int32_t (*diagnosis_start)(struct gib_diagnosis *handle, const struct gib_diagnosis_config *config);
    /**
     * See gib_diagnosis_run.
     */
    int32_t (*diagnosis_run)(struct gib_diagnosis *handle, gib_diagnosis_progress progress, void *user);
    /**
     * See gib_diagnosis_abort.
     */
    int32_t (*diagnosis_abort)(struct gib_diagnosis *handle);
    /**
     * See gib_diagnosis_result.
     */
    int32_t (*diagnosis_result)(const struct gib_diagnosis *handle, struct gib_diagnosis_report *report);
    /**
     * See gib_diagnosis_json.
     */
    int32_t (*diagnosis_json)(const struct gib_diagnosis *handle,
                              char *json,
                              uintptr_t size,
                              uintptr_t *needed);
    /**
     * See gib_diagnosis_machine.
     */
    int32_t (*diagnosis_machine)(const struct gib_diagnosis *handle, struct gib_machine *machine);
    /**
     * See gib_diagnosis_last_error_text.
     */
    int32_t (*diagnosis_last_error_text)(const struct gib_diagnosis *handle, char *text, uintptr_t size);
    /**
     * See gib_learning_size.
     */
    uintptr_t (*learning_size)(void);
    /**
     * See gib_learning_init_in.
     */
    int32_t (*learning_init_in)(void *memory, uintptr_t size, struct gib_learning **out);
    /**
     * See gib_learning_new.
     */
    struct gib_learning *(*learning_new)(void);
    /**
     * See gib_learning_free.
     */
    void (*learning_free)(struct gib_learning *handle);
    /**
     * See gib_learning_start.
     */
    int32_t (*learning_start)(struct gib_learning *handle, const struct gib_learning_config *config);
    /**
     * See gib_learning_step.
     */
    int32_t (*learning_step)(struct gib_learning *handle,
                             const struct gib_learning_input *input,
                             struct gib_learning_output *output);
    /**
     * See gib_learning_abort.
     */
    int32_t (*learning_abort)(struct gib_learning *handle);
    /**
     * See gib_learning_result.
     */
    int32_t (*learning_result)(const struct gib_learning *handle, struct gib_learning_report *report);
    /**
     * See gib_learning_points.
     */
    int32_t (*learning_points)(const struct gib_learning *handle,
                               struct gib_learning_point *points,
                               uintptr_t capacity,
                               uintptr_t *count);
    /**
     * See gib_learning_save.
     */
    int32_t (*learning_save)(struct gib_learning *handle, const char *path);
    /**
     * See gib_learning_load.
     */
    int32_t (*learning_load)(struct gib_learning *handle, const char *path);
    /**
     * See gib_learning_last_error.
     */
    int32_t (*learning_last_error)(const struct gib_learning *handle, struct gib_error_detail *detail);
    /**
     * See gib_recorder_step_from.
     */
    int32_t (*recorder_step_from)(struct gib_recorder *handle, const double *const *sources, uint32_t count);
} gib_api_table;

#ifdef __cplusplus
extern "C" {
#endif /* __cplusplus */

/**
 * Version of the interface that the loaded library serves; compare it with `GIB_ABI_VERSION` of the header.
 *
 * @return major · 65536 + minor. The library fits when the majors are equal and its minor is not below the header's.
 *
 * [thread: any] [real-time: yes] [state: any]
 */
uint32_t gib_abi_version(void);

/**
 * Version of the library as text, for a log or an about box.
 *
 * @return static text such as "0.1.0", NUL-terminated; never NULL, never freed.
 *
 * [thread: any] [real-time: yes] [state: any]
 */
const char *gib_version(void);

/**
 * The sentence that explains a status.
 *
 * @param status any value that a gib function returned.
 * @return static text, NUL-terminated; never NULL, never freed; for an unknown number a text that says so.
 *
 * [thread: any] [real-time: yes] [state: any]
 */
const char *gib_status_text(int32_t status);

/**
 * Bytes that an instance needs in memory of your own, to be aligned to 16.
 *
 * @return the size in bytes, about 107 KiB.
 *
 * [thread: any] [real-time: yes] [state: any]
 */
uintptr_t gib_backlash_size(void);

/**
 * Makes an idle instance in memory of your own. There is nothing to free; zero or reuse the memory when done.
 *
 * @param memory at least `gib_backlash_size()` bytes, aligned to 16; stays yours.
 * @param size bytes at `memory`.
 * @param out receives the handle; NULL on error.
 * @return GIB_OK; GIB_ERR_NULL; GIB_ERR_MEMORY when too small or misaligned.
 *
 * [thread: setup] [real-time: no] [state: none]
 *
 * # Safety
 * `memory` is NULL or points to `size` writable bytes; `out` is NULL or writable.
 */
int32_t gib_backlash_init_in(void *memory, uintptr_t size, struct gib_backlash **out);

/**
 * Makes an idle instance in memory that gib allocates.
 *
 * @return the handle, to be given to `gib_backlash_free`; NULL when there is no memory.
 *
 * [thread: setup] [real-time: no] [state: none]
 */
struct gib_backlash *gib_backlash_new(void);

/**
 * Frees an instance made by `gib_backlash_new`. NULL is allowed and does nothing.
 *
 * Abort a running measurement and step it to its end first: memory that is gone can restore nothing.
 *
 * @param handle an instance from `gib_backlash_new`, never one from `gib_backlash_init_in`.
 *
 * [thread: setup] [real-time: no] [state: not busy]
 *
 * # Safety
 * `handle` is NULL or came from `gib_backlash_new` and was not freed before.
 */
void gib_backlash_free(struct gib_backlash *handle);

/**
 * Checks the configuration and arms a measurement, which begins with the next step.
 *
 * The rising edge of PLCopen's Execute. Clears the previous result and error. The old compensation amount is read
 * from `compensation_um` of the first step's input.
 *
 * @param handle the instance.
 * @param config what to measure; copied. Set `struct_size`, zero the rest, then set what you want.
 * @return GIB_OK; GIB_ERR_CONFIG (gib_backlash_last_error names the field and its range), GIB_ERR_STRUCT_SIZE,
 * GIB_ERR_STATE while busy, GIB_ERR_DISABLED, GIB_ERR_RESTORE_UNCONFIRMED while a restore is still owed,
 * GIB_ERR_NULL, GIB_ERR_HANDLE.
 *
 * [thread: setup, or cycle between steps] [real-time: yes] [state: not busy]
 *
 * # Safety
 * `handle` is NULL or an instance; `config` is NULL or points to its `struct_size` readable bytes.
 */
int32_t gib_backlash_start(struct gib_backlash *handle,
                           const struct gib_backlash_config *config);

/**
 * One servo cycle. Call it in every cycle, also when idle: requests are made and restored through it.
 *
 * While `owns_motion` is 1, follow `target_position_mm` and report the motor's position and torque of the same
 * instant. When `request_id` changes, put `compensation_um` and `reversal_acceleration_off` in force and report the
 * number in `acknowledged_id` and the amount in force in `compensation_um`, within half a `compensation_resolution_um` of the one asked for.
 *
 * A fault is named in `message` in the cycle in which it is found. In that cycle the command already brakes from its own last
 * speed, no harder than `acceleration_mm_s2`, whatever is measured; with GIB_INPUT_FAULT, when the axis follows no command, it stays
 * where it is. Then everything changed is restored; while that goes on the status is GIB_BUSY, and only then the error.
 *
 * @param handle the instance.
 * @param input measured values of this cycle.
 * @param output commands for this cycle; always written when not NULL.
 * @return GIB_OK when idle, GIB_BUSY, GIB_DONE, or the first error, which is kept until the next start; carrying out
 * `gib_backlash_restore` or `_enable` takes its place, and `gib_backlash_last_error` and the report still tell it:
 * GIB_ERR_ABORTED, GIB_ERR_NON_FINITE, GIB_ERR_DRIVE_FAULT, GIB_ERR_ACK_TIMEOUT, GIB_ERR_TORQUE_BOUND,
 * GIB_ERR_TRAVEL_BOUND, GIB_ERR_DEADLINE, GIB_ERR_LAG, GIB_ERR_CONFIG, GIB_ERR_DISABLED, GIB_ERR_BACKLASH_...;
 * and GIB_ERR_NULL, GIB_ERR_HANDLE of this call. GIB_ERR_CONFIG is also that of unknown `flags`. Where `input` is NULL a measurement
 * under way ends as by any other fault: it brakes from this cycle on, and GIB_ERR_NULL is kept. Where `output` is NULL nothing is done.
 *
 * [thread: cycle] [real-time: yes] [state: any]
 *
 * # Safety
 * `handle` is NULL or an instance; `input` is NULL or readable; `output` is NULL or writable.
 */
int32_t gib_backlash_step(struct gib_backlash *handle,
                          const struct gib_backlash_input *input,
                          struct gib_backlash_output *output);

/**
 * Aborts a running measurement: the next steps brake, restore the old amount and reversal acceleration, and end
 * with GIB_ERR_ABORTED. Does nothing when not busy. To abort from another thread set `GIB_INPUT_ABORT` in the input.
 *
 * @param handle the instance.
 * @return GIB_OK; GIB_ERR_NULL, GIB_ERR_HANDLE.
 *
 * [thread: cycle] [real-time: yes] [state: any]
 *
 * # Safety
 * `handle` is NULL or an instance.
 */
int32_t gib_backlash_abort(struct gib_backlash *handle);

/**
 * Asks for the amount that was in force before the last written one: the operator's "restore original".
 * Keep stepping until the status is GIB_OK again.
 *
 * @param handle the instance.
 * @return GIB_OK; GIB_ERR_STATE while busy, switched off, or when nothing was written; GIB_ERR_NULL, GIB_ERR_HANDLE.
 *
 * [thread: cycle] [real-time: yes] [state: not busy]
 *
 * # Safety
 * `handle` is NULL or an instance.
 */
int32_t gib_backlash_restore(struct gib_backlash *handle);

/**
 * Switches automatic measuring and compensation on or off. Off: a running measurement is aborted and restored, then
 * the compensation amount is taken out (0) and starts are refused. On: the amount comes back, starts are allowed.
 *
 * @param handle the instance.
 * @param on 1 or 0.
 * @return GIB_OK; GIB_ERR_STATE when it is so already or the last switching is not yet confirmed; GIB_ERR_CONFIG
 * for another value of `on`; GIB_ERR_NULL, GIB_ERR_HANDLE.
 *
 * [thread: cycle] [real-time: yes] [state: any]
 *
 * # Safety
 * `handle` is NULL or an instance.
 */
int32_t gib_backlash_enable(struct gib_backlash *handle,
                            int32_t on);

/**
 * Reads what was found: complete after GIB_DONE, else what is known so far.
 *
 * @param handle the instance.
 * @param report receives it.
 * @return GIB_OK; GIB_ERR_NULL, GIB_ERR_HANDLE.
 *
 * [thread: cycle] [real-time: yes] [state: any]
 *
 * # Safety
 * `handle` is NULL or an instance; `report` is NULL or writable.
 */
int32_t gib_backlash_result(const struct gib_backlash *handle, struct gib_backlash_report *report);

/**
 * Reads the torque curve of the last reversal of a sense, for a graph.
 *
 * @param handle the instance.
 * @param sense 0: after motion in the first direction; 1: after motion in the other.
 * @param travel_um receives the motor's travel since the reversal, µm, rising.
 * @param torque_nm receives the torque, N·m, positive in the sense of the scan.
 * @param capacity points that both arrays can hold; 1024 always suffices.
 * @param count receives the number of points written, or needed when GIB_ERR_BUFFER is returned.
 * @return GIB_OK; GIB_ERR_BUFFER; GIB_ERR_CONFIG for another sense; GIB_ERR_NULL, GIB_ERR_HANDLE.
 *
 * [thread: cycle] [real-time: no] [state: any]
 *
 * # Safety
 * `handle` is NULL or an instance; the arrays are NULL or hold `capacity` numbers; `count` is NULL or writable.
 */
int32_t gib_backlash_curve(const struct gib_backlash *handle,
                           int32_t sense,
                           double *travel_um,
                           double *torque_nm,
                           uintptr_t capacity,
                           uintptr_t *count);

/**
 * Compares the estimate with a value measured otherwise, for instance the reversal value of ISO 230-2.
 *
 * The two are not the same quantity: ISO 230-2 measures positions at standstill, see `standstill_um`.
 *
 * @param handle the instance, after a result.
 * @param measured_um the measured value, µm.
 * @param uncertainty_um its expanded uncertainty (k = 2), µm, 0 or more.
 * @param comparison receives the differences.
 * @return GIB_OK; GIB_ERR_STATE before a result; GIB_ERR_CONFIG for values that are not finite or negative;
 * GIB_ERR_NULL, GIB_ERR_HANDLE.
 *
 * [thread: cycle] [real-time: yes] [state: after a result]
 *
 * # Safety
 * `handle` is NULL or an instance; `comparison` is NULL or writable.
 */
int32_t gib_backlash_compare(struct gib_backlash *handle,
                             double measured_um,
                             double uncertainty_um,
                             struct gib_backlash_comparison *comparison);

/**
 * The first error of the present run, kept until the next start, or why the last call was refused: code, field, value and the
 * bounds that it lies outside of. The field is one of the configuration or of the input, or says what was found (`_ratio`, `_share`
 * and others by their unit). A call refused with GIB_ERR_STATE changes nothing here.
 *
 * @param handle the instance.
 * @param detail receives it; its `code` is GIB_OK when nothing went wrong.
 * @return GIB_OK; GIB_ERR_NULL, GIB_ERR_HANDLE.
 *
 * [thread: cycle] [real-time: yes] [state: any]
 *
 * # Safety
 * `handle` is NULL or an instance; `detail` is NULL or writable.
 */
int32_t gib_backlash_last_error(const struct gib_backlash *handle,
                                struct gib_error_detail *detail);

/**
 * Bytes that an instance needs in memory of your own, to be aligned to 16.
 *
 * @return the size in bytes, about 22 KiB.
 *
 * [thread: any] [real-time: yes] [state: any]
 */
uintptr_t gib_calibration_size(void);

/**
 * Makes an idle instance in memory of your own. There is nothing to free; zero or reuse the memory when done.
 *
 * @param memory at least `gib_calibration_size()` bytes, aligned to 16; stays yours.
 * @param size bytes at `memory`.
 * @param out receives the handle; NULL on error.
 * @return GIB_OK; GIB_ERR_NULL; GIB_ERR_MEMORY when too small or misaligned.
 *
 * [thread: setup] [real-time: no] [state: none]
 *
 * # Safety
 * `memory` is NULL or points to `size` writable bytes; `out` is NULL or writable.
 */
int32_t gib_calibration_init_in(void *memory, uintptr_t size, struct gib_calibration **out);

/**
 * Makes an idle instance in memory that gib allocates.
 *
 * @return the handle, to be given to `gib_calibration_free`; NULL when there is no memory.
 *
 * [thread: setup] [real-time: no] [state: none]
 */
struct gib_calibration *gib_calibration_new(void);

/**
 * Frees an instance made by `gib_calibration_new`. NULL is allowed and does nothing.
 *
 * @param handle an instance from `gib_calibration_new`, never one from `gib_calibration_init_in`.
 *
 * [thread: setup] [real-time: no] [state: not busy]
 *
 * # Safety
 * `handle` is NULL or came from `gib_calibration_new` and was not freed before.
 */
void gib_calibration_free(struct gib_calibration *handle);

/**
 * Checks the configuration and arms a calibration, which begins with the next step.
 *
 * The axis swings about where it stands, at one frequency after the other. With `add` the experiment joins those that
 * this instance holds: change the workpiece's mass or the place in between, so that seat and bearing swing otherwise.
 *
 * @param handle the instance.
 * @param config how to calibrate; copied. Set `struct_size`, zero the rest, then set what you want.
 * @return GIB_OK; GIB_ERR_CONFIG (gib_calibration_last_error names the field and its range), GIB_ERR_STRUCT_SIZE,
 * GIB_ERR_STATE while busy, GIB_ERR_CALIBRATION_ADD, GIB_ERR_NULL, GIB_ERR_HANDLE.
 *
 * [thread: setup, or cycle between steps] [real-time: yes] [state: not busy]
 *
 * # Safety
 * `handle` is NULL or an instance; `config` is NULL or points to its `struct_size` readable bytes.
 */
int32_t gib_calibration_start(struct gib_calibration *handle,
                              const struct gib_calibration_config *config);

/**
 * One servo cycle. Call it in every cycle, also when idle.
 *
 * While `owns_motion` is 1, follow `target_position_mm`. Whatever ends it, the amplitude falls to nothing first and the
 * axis is where it stood, except after a drive fault, or when position or lag cannot be trusted: then nothing is
 * commanded any more, and `stop_drive` says when to take the torque off.
 *
 * @param handle the instance.
 * @param input measured values of this cycle, all of the same instant.
 * @param output commands for this cycle; always written when not NULL.
 * @return GIB_OK when idle, GIB_BUSY, GIB_DONE, or the first error, which is kept until the next start:
 * GIB_ERR_ABORTED, GIB_ERR_NON_FINITE, GIB_ERR_DRIVE_FAULT, GIB_ERR_TORQUE_BOUND, GIB_ERR_TRAVEL_BOUND, GIB_ERR_LAG,
 * GIB_ERR_CALIBRATION_..., GIB_ERR_CONFIG (unknown `flags`); and GIB_ERR_NULL, GIB_ERR_HANDLE of this call. Where `input` is NULL a
 * calibration under way ends as by any other fault: the amplitude falls from this cycle on, steps return GIB_BUSY meanwhile, then
 * GIB_ERR_NULL. Where `output` is NULL nothing is done.
 *
 * [thread: cycle] [real-time: yes] [state: any]
 *
 * # Safety
 * `handle` is NULL or an instance; `input` is NULL or readable; `output` is NULL or writable.
 */
int32_t gib_calibration_step(struct gib_calibration *handle,
                             const struct gib_calibration_input *input,
                             struct gib_calibration_output *output);

/**
 * Ends a running calibration: the amplitude falls to nothing, then steps return GIB_ERR_ABORTED. Does nothing when not
 * busy. To abort from another thread set `GIB_INPUT_ABORT` in the input.
 *
 * @param handle the instance.
 * @return GIB_OK; GIB_ERR_NULL, GIB_ERR_HANDLE.
 *
 * [thread: cycle] [real-time: yes] [state: any]
 *
 * # Safety
 * `handle` is NULL or an instance.
 */
int32_t gib_calibration_abort(struct gib_calibration *handle);

/**
 * Reads gains and phases over frequency, with their uncertainty and condition: after GIB_DONE, or after a load.
 *
 * @param handle the instance.
 * @param table receives it; set its `struct_size` first.
 * @return GIB_OK; GIB_ERR_STATE when there is none, GIB_ERR_STRUCT_SIZE when `table` is too small, GIB_ERR_NULL,
 * GIB_ERR_HANDLE.
 *
 * [thread: cycle] [real-time: yes] [state: not busy]
 *
 * # Safety
 * `handle` is NULL or an instance; `table` is NULL or points to its `struct_size` writable bytes.
 */
int32_t gib_calibration_result(const struct gib_calibration *handle,
                               struct gib_calibration_table *table);

/**
 * Writes gains and phases to a file, JSON with schema "gib.calibration/1". An old file is replaced whole or not at all.
 *
 * @param handle the instance.
 * @param path NUL-terminated; stays yours.
 * @return GIB_OK; GIB_ERR_STATE when there is no table, GIB_ERR_IO, GIB_ERR_NULL, GIB_ERR_HANDLE.
 *
 * [thread: setup] [real-time: no] [state: not busy]
 *
 * # Safety
 * `handle` is NULL or an instance; `path` is NULL or NUL-terminated.
 */
int32_t gib_calibration_save(struct gib_calibration *handle,
                             const char *path);

/**
 * Reads gains and phases from a file that `gib_calibration_save` wrote; `gib_calibration_result` then gives them.
 *
 * @param handle the instance; what it held is replaced, or kept when the file cannot be used.
 * @param path NUL-terminated; stays yours.
 * @return GIB_OK; GIB_ERR_IO, GIB_ERR_FORMAT (gib_calibration_last_error names the key, or gives the line as `value`),
 * GIB_ERR_CONFIG with the key that is out of range, GIB_ERR_STATE while busy, GIB_ERR_NULL, GIB_ERR_HANDLE.
 *
 * [thread: setup] [real-time: no] [state: not busy]
 *
 * # Safety
 * `handle` is NULL or an instance; `path` is NULL or NUL-terminated.
 */
int32_t gib_calibration_load(struct gib_calibration *handle,
                             const char *path);

/**
 * The first error of the present run, or why the last call was refused: code, field, value and bounds. A call refused with
 * GIB_ERR_STATE changes nothing here.
 *
 * @param handle the instance.
 * @param detail receives it; its `code` is GIB_OK when nothing went wrong.
 * @return GIB_OK; GIB_ERR_NULL, GIB_ERR_HANDLE.
 *
 * [thread: cycle] [real-time: yes] [state: any]
 *
 * # Safety
 * `handle` is NULL or an instance; `detail` is NULL or writable.
 */
int32_t gib_calibration_last_error(const struct gib_calibration *handle,
                                   struct gib_error_detail *detail);

/**
 * Makes an empty instance.
 *
 * @return the handle, to be given to `gib_diagnosis_free`; NULL when there is no memory.
 *
 * [thread: setup] [real-time: no] [state: none]
 */
struct gib_diagnosis *gib_diagnosis_new(void);

/**
 * Frees an instance. NULL is allowed and does nothing.
 *
 * @param handle an instance from `gib_diagnosis_new`, in use by no call.
 *
 * [thread: setup] [real-time: no] [state: not busy]
 *
 * # Safety
 * `handle` is NULL or came from `gib_diagnosis_new` and was not freed before.
 */
void gib_diagnosis_free(struct gib_diagnosis *handle);

/**
 * Takes the configuration and reads the recordings; `gib_diagnosis_run` then does the work.
 *
 * Recordings are read here, on the calling thread: never call it from a servo thread.
 *
 * @param handle the instance; an earlier result is forgotten.
 * @param config what to diagnose; nothing of it is kept.
 * @return GIB_OK; GIB_ERR_IO or GIB_ERR_FORMAT for a recording (gib_diagnosis_last_error_text names file, row and
 * column), GIB_ERR_DIAGNOSIS_AXIS, GIB_ERR_DIAGNOSIS_HOLDOUT, GIB_ERR_STRUCT_SIZE; GIB_ERR_STATE when no machine was
 * read or another thread works; GIB_ERR_NULL, GIB_ERR_HANDLE, GIB_ERR_INTERNAL.
 *
 * [thread: setup] [real-time: no] [state: not busy]
 *
 * # Safety
 * `handle` is NULL or an instance; `config` is NULL or points to `struct_size` bytes whose pointers are NULL or as
 * said there.
 */
int32_t gib_diagnosis_start(struct gib_diagnosis *handle,
                            const struct gib_diagnosis_config *config);

/**
 * Does the whole work, and returns when it is done or stopped: seconds for a minute of recording. It starts threads
 * of its own for the time of the call, with the scheduling of the calling thread: never call it from a servo thread.
 *
 * @param handle the instance.
 * @param progress told how far the work is, ten times a second or more; may be NULL.
 * @param user given to `progress`.
 * @return GIB_DONE; GIB_ERR_ABORTED; GIB_ERR_STATE before `gib_diagnosis_start` or while another thread works;
 * GIB_ERR_NULL, GIB_ERR_HANDLE, GIB_ERR_INTERNAL.
 *
 * [thread: setup] [real-time: no] [state: started]
 *
 * # Safety
 * `handle` is NULL or an instance; `progress` is NULL or a function that may be called with `user` from other threads
 * until this call returns.
 */
int32_t gib_diagnosis_run(struct gib_diagnosis *handle,
                          gib_diagnosis_progress progress,
                          void *user);

/**
 * Stops a diagnosis that another thread works at: its `gib_diagnosis_run` returns GIB_ERR_ABORTED soon.
 *
 * @param handle the instance.
 * @return GIB_OK, also when nothing is running; GIB_ERR_NULL, GIB_ERR_HANDLE.
 *
 * [thread: any] [real-time: yes] [state: any]
 *
 * # Safety
 * `handle` is NULL or an instance.
 */
int32_t gib_diagnosis_abort(struct gib_diagnosis *handle);

/**
 * What the diagnosis came to, in numbers.
 *
 * @param handle the instance.
 * @param report receives it; zeroed on an error.
 * @return GIB_OK; GIB_ERR_STATE before a `gib_diagnosis_run` is done, or while another thread works; GIB_ERR_NULL,
 * GIB_ERR_HANDLE, GIB_ERR_INTERNAL.
 *
 * [thread: setup] [real-time: no] [state: done]
 *
 * # Safety
 * `handle` is NULL or an instance; `report` is NULL or writable.
 */
int32_t gib_diagnosis_result(const struct gib_diagnosis *handle,
                             struct gib_diagnosis_report *report);

/**
 * The diagnosis as JSON with schema "gib.diagnosis/1".
 *
 * Ask for the size first: `gib_diagnosis_json(handle, NULL, 0, &needed)` returns GIB_ERR_BUFFER and sets `needed`.
 *
 * @param handle the instance.
 * @param json receives the text, UTF-8, with its NUL; NULL to ask for the size alone.
 * @param size bytes at `json`.
 * @param needed receives the bytes for all of it with its NUL; may be NULL.
 * @return GIB_OK; GIB_ERR_BUFFER when `size` is too small; GIB_ERR_STATE before a `gib_diagnosis_run` is done, or while
 * another thread works; GIB_ERR_NULL, GIB_ERR_HANDLE, GIB_ERR_INTERNAL.
 *
 * [thread: setup] [real-time: no] [state: done]
 *
 * # Safety
 * `handle` is NULL or an instance; `json` is NULL or points to `size` writable bytes; `needed` is NULL or writable.
 */
int32_t gib_diagnosis_json(const struct gib_diagnosis *handle,
                           char *json,
                           uintptr_t size,
                           uintptr_t *needed);

/**
 * Puts the machine with what was found into a machine handle, to be saved, or to be diagnosed again.
 *
 * @param handle the instance.
 * @param machine receives it; may be the one that the diagnosis was started with.
 * @return GIB_OK; GIB_ERR_STATE before a `gib_diagnosis_run` is done, or while another thread works; GIB_ERR_NULL,
 * GIB_ERR_HANDLE, GIB_ERR_INTERNAL.
 *
 * [thread: setup] [real-time: no] [state: done]
 *
 * # Safety
 * `handle` and `machine` are NULL or instances.
 */
int32_t gib_diagnosis_machine(const struct gib_diagnosis *handle,
                              struct gib_machine *machine);

/**
 * Why the last call failed, as a sentence that names file, row and column, what was found and what is allowed. Each
 * call of this family on the handle but gib_diagnosis_abort forgets the sentence of the one before and leaves its own if
 * it fails; a call that is refused because of the handle itself, or because another thread works, leaves none.
 *
 * @param handle the instance.
 * @param text receives the sentence, UTF-8, with its NUL; empty when the last call did its work.
 * @param size bytes at `text`; a longer sentence is cut.
 * @return GIB_OK; GIB_ERR_BUFFER when the sentence was cut; GIB_ERR_STATE while another thread works; GIB_ERR_NULL,
 * GIB_ERR_HANDLE.
 *
 * [thread: setup] [real-time: no] [state: any]
 *
 * # Safety
 * `handle` is NULL or an instance; `text` is NULL or points to `size` writable bytes.
 */
int32_t gib_diagnosis_last_error_text(const struct gib_diagnosis *handle,
                                      char *text,
                                      uintptr_t size);

/**
 * The table of all functions, so that `dlsym` needs one name: "gib_api".
 *
 * @param version pass `GIB_ABI_VERSION`.
 * @return a table that lives as long as the library is loaded and is never freed; NULL when this library cannot serve
 * that version, because its major differs or its minor is older.
 *
 * [thread: any] [real-time: yes] [state: any]
 */
const struct gib_api_table *gib_api(uint32_t version);

/**
 * Bytes that an instance needs in memory of your own, to be aligned to 16.
 *
 * @return the size in bytes, about 78 KiB.
 *
 * [thread: any] [real-time: yes] [state: any]
 */
uintptr_t gib_homing_size(void);

/**
 * Makes an idle instance in memory of your own. There is nothing to free; zero or reuse the memory when done.
 *
 * @param memory at least `gib_homing_size()` bytes, aligned to 16; stays yours.
 * @param size bytes at `memory`.
 * @param out receives the handle; NULL on error.
 * @return GIB_OK; GIB_ERR_NULL; GIB_ERR_MEMORY when too small or misaligned.
 *
 * [thread: setup] [real-time: no] [state: none]
 *
 * # Safety
 * `memory` is NULL or points to `size` writable bytes; `out` is NULL or writable.
 */
int32_t gib_homing_init_in(void *memory, uintptr_t size, struct gib_homing **out);

/**
 * Makes an idle instance in memory that gib allocates.
 *
 * @return the handle, to be given to `gib_homing_free`; NULL when there is no memory.
 *
 * [thread: setup] [real-time: no] [state: none]
 */
struct gib_homing *gib_homing_new(void);

/**
 * Frees an instance made by `gib_homing_new`. NULL is allowed and does nothing.
 *
 * Abort a running homing and step it to its end first: memory that is gone can restore nothing.
 *
 * @param handle an instance from `gib_homing_new`, never one from `gib_homing_init_in`.
 *
 * [thread: setup] [real-time: no] [state: not busy]
 *
 * # Safety
 * `handle` is NULL or came from `gib_homing_new` and was not freed before.
 */
void gib_homing_free(struct gib_homing *handle);

/**
 * Checks the configuration and arms a homing, which begins with the next step.
 *
 * The rising edge of PLCopen's Execute. Clears the previous result and error. The old torque limit is read from
 * `torque_limit` of the first step's input.
 *
 * @param handle the instance.
 * @param config how to home; copied. Set `struct_size`, zero the rest, then set what you want.
 * @return GIB_OK; GIB_ERR_CONFIG (gib_homing_last_error names the field and its range), GIB_ERR_STRUCT_SIZE,
 * GIB_ERR_STATE while busy, GIB_ERR_RESTORE_UNCONFIRMED while the old torque limit is still owed,
 * GIB_ERR_NULL, GIB_ERR_HANDLE.
 *
 * [thread: setup, or cycle between steps] [real-time: yes] [state: not busy]
 *
 * # Safety
 * `handle` is NULL or an instance; `config` is NULL or points to its `struct_size` readable bytes.
 */
int32_t gib_homing_start(struct gib_homing *handle,
                         const struct gib_homing_config *config);

/**
 * One servo cycle. Call it in every cycle, also when idle: requests are made and restored through it.
 *
 * While `owns_motion` is 1, follow `target_position_mm` and report each motor's position and torque of the same
 * instant. When `request_id` changes, carry out `requests`, then report the number in `acknowledged_id`, and in
 * `torque_limit` the limit in force. Take the torque off the motors while `stop_drive` is 1: that is at once where the torque is more
 * than the limit allows (GIB_ERR_TORQUE_BOUND), since a drive that does not keep to it would press on while it brakes.
 *
 * A fault is named in `message` in the cycle in which it is found. From that cycle on gib brakes from the speed commanded last, no
 * harder than `acceleration_mm_s2`, unless it stops the drive; then it goes back from what is pressed on, and gives the
 * old torque limit back; while that goes on the status is GIB_BUSY, and only then the error. It takes at most, in seconds:
 * 5·(speed + approach speed) ÷ acceleration, (lag limit + `press_max_mm`) ÷ approach speed, four detection times and twice
 * `ack_timeout_s`, together.
 *
 * @param handle the instance.
 * @param input measured values of this cycle.
 * @param output commands for this cycle; always written when not NULL.
 * @return GIB_OK when idle, GIB_BUSY, GIB_DONE, or the first error, which is kept until the next start:
 * GIB_ERR_ABORTED, GIB_ERR_NON_FINITE, GIB_ERR_DRIVE_FAULT, GIB_ERR_ACK_TIMEOUT, GIB_ERR_TORQUE_BOUND,
 * GIB_ERR_TRAVEL_BOUND, GIB_ERR_DEADLINE, GIB_ERR_LAG, GIB_ERR_HOMING_...;
 * GIB_ERR_CONFIG (unknown `flags`); and GIB_ERR_NULL, GIB_ERR_HANDLE of this call. Where `input` is NULL a homing under way ends as
 * by any other fault: it brakes from this cycle on, what needs a reading waits for one, and GIB_ERR_NULL is kept. Where `output` is
 * NULL nothing is done.
 *
 * [thread: cycle] [real-time: yes] [state: any]
 *
 * # Safety
 * `handle` is NULL or an instance; `input` is NULL or readable; `output` is NULL or writable.
 */
int32_t gib_homing_step(struct gib_homing *handle,
                        const struct gib_homing_input *input,
                        struct gib_homing_output *output);

/**
 * Aborts a running homing: the next steps brake, take the pressure off the stop, restore the old torque limit, and
 * end with GIB_ERR_ABORTED. Does nothing when not busy. To abort from another thread set `GIB_INPUT_ABORT` in the input.
 *
 * @param handle the instance.
 * @return GIB_OK; GIB_ERR_NULL, GIB_ERR_HANDLE.
 *
 * [thread: cycle] [real-time: yes] [state: any]
 *
 * # Safety
 * `handle` is NULL or an instance.
 */
int32_t gib_homing_abort(struct gib_homing *handle);

/**
 * Reads what was found: complete after GIB_DONE, else what is known so far.
 *
 * @param handle the instance.
 * @param report receives it.
 * @return GIB_OK; GIB_ERR_NULL, GIB_ERR_HANDLE.
 *
 * [thread: cycle] [real-time: yes] [state: any]
 *
 * # Safety
 * `handle` is NULL or an instance; `report` is NULL or writable.
 */
int32_t gib_homing_result(const struct gib_homing *handle, struct gib_homing_report *report);

/**
 * The first error of the present run, or why the last start was refused: code, field, value and bounds. A start refused
 * with GIB_ERR_STATE, while a homing runs, changes nothing here.
 *
 * @param handle the instance.
 * @param detail receives it; its `code` is GIB_OK when nothing went wrong.
 * @return GIB_OK; GIB_ERR_NULL, GIB_ERR_HANDLE.
 *
 * [thread: cycle] [real-time: yes] [state: any]
 *
 * # Safety
 * `handle` is NULL or an instance; `detail` is NULL or writable.
 */
int32_t gib_homing_last_error(const struct gib_homing *handle,
                              struct gib_error_detail *detail);

/**
 * Bytes that an instance needs in memory of your own, to be aligned to 16.
 *
 * @return the size in bytes, about 30 KiB.
 *
 * [thread: any] [real-time: yes] [state: any]
 */
uintptr_t gib_inertia_size(void);

/**
 * Makes an idle instance in memory of your own. There is nothing to free; zero or reuse the memory when done.
 *
 * @param memory at least `gib_inertia_size()` bytes, aligned to 16; stays yours.
 * @param size bytes at `memory`.
 * @param out receives the handle; NULL on error.
 * @return GIB_OK; GIB_ERR_NULL; GIB_ERR_MEMORY when too small or misaligned.
 *
 * [thread: setup] [real-time: no] [state: none]
 *
 * # Safety
 * `memory` is NULL or points to `size` writable bytes; `out` is NULL or writable.
 */
int32_t gib_inertia_init_in(void *memory, uintptr_t size, struct gib_inertia **out);

/**
 * Makes an idle instance in memory that gib allocates.
 *
 * @return the handle, to be given to `gib_inertia_free`; NULL when there is no memory.
 *
 * [thread: setup] [real-time: no] [state: none]
 */
struct gib_inertia *gib_inertia_new(void);

/**
 * Frees an instance made by `gib_inertia_new`. NULL is allowed and does nothing.
 *
 * @param handle an instance from `gib_inertia_new`, never one from `gib_inertia_init_in`.
 *
 * [thread: setup] [real-time: no] [state: not busy]
 *
 * # Safety
 * `handle` is NULL or came from `gib_inertia_new` and was not freed before.
 */
void gib_inertia_free(struct gib_inertia *handle);

/**
 * Checks the configuration and arms a measurement, which begins with the next step.
 *
 * The rising edge of PLCopen's Execute. Clears the previous result and error. Where the part program's head already
 * holds `INA` (`gib_program_get`), measuring is to be skipped, as published.
 *
 * @param handle the instance.
 * @param config what to measure; copied. Set `struct_size`, zero the rest, then set what you want.
 * @return GIB_OK; GIB_ERR_CONFIG (gib_inertia_last_error names the field and its range), GIB_ERR_STRUCT_SIZE,
 * GIB_ERR_STATE while busy, GIB_ERR_NULL, GIB_ERR_HANDLE.
 *
 * [thread: setup, or cycle between steps] [real-time: yes] [state: not busy]
 *
 * # Safety
 * `handle` is NULL or an instance; `config` is NULL or points to its `struct_size` readable bytes.
 */
int32_t gib_inertia_start(struct gib_inertia *handle,
                          const struct gib_inertia_config *config);

/**
 * One servo cycle: gathers speed and torque, and commands the ramps while `owns_motion` is 1.
 *
 * @param handle the instance.
 * @param input measured values of this cycle.
 * @param output command for this cycle; always written when not NULL.
 * @return GIB_OK when idle, GIB_BUSY, GIB_DONE, or the first error, which is kept until the next start:
 * GIB_ERR_ABORTED, GIB_ERR_NON_FINITE, GIB_ERR_DRIVE_FAULT, GIB_ERR_TORQUE_BOUND, GIB_ERR_LAG, GIB_ERR_CONFIG for
 * unknown flags; and GIB_ERR_NULL, GIB_ERR_HANDLE of this call. After a fault the command goes back to the speed at
 * start, no faster than the ramps; after a drive fault gib just lets go.
 *
 * [thread: cycle] [real-time: yes] [state: any]
 *
 * # Safety
 * `handle` is NULL or an instance; `input` is NULL or readable; `output` is NULL or writable.
 */
int32_t gib_inertia_step(struct gib_inertia *handle,
                         const struct gib_inertia_input *input,
                         struct gib_inertia_output *output);

/**
 * Aborts a running measurement: the next steps go back to the speed at start and end with GIB_ERR_ABORTED. Does
 * nothing when not busy. To abort from another thread set `GIB_INPUT_ABORT` in the input.
 *
 * @param handle the instance.
 * @return GIB_OK; GIB_ERR_NULL, GIB_ERR_HANDLE.
 *
 * [thread: cycle] [real-time: yes] [state: any]
 *
 * # Safety
 * `handle` is NULL or an instance.
 */
int32_t gib_inertia_abort(struct gib_inertia *handle);

/**
 * Fits what was gathered, off the cycle: takes 10 to 150 ms.
 *
 * The report is written also when the value cannot be used; it then says which ramp would do.
 *
 * @param handle the instance, after GIB_DONE.
 * @param report receives inertia, friction, uncertainties and the ramp that would do better.
 * @return GIB_OK; GIB_ERR_STATE before GIB_DONE; GIB_ERR_INERTIA_EXCITATION, GIB_ERR_INERTIA_FEW,
 * GIB_ERR_INERTIA_SIGN, GIB_ERR_INERTIA_OWN, GIB_ERR_INERTIA_TORQUE when the value cannot be used; GIB_ERR_NULL, GIB_ERR_HANDLE.
 *
 * [thread: setup] [real-time: no] [state: after GIB_DONE]
 *
 * # Safety
 * `handle` is NULL or an instance; `report` is NULL or writable.
 */
int32_t gib_inertia_result(struct gib_inertia *handle,
                           struct gib_inertia_report *report);

/**
 * The first error of the present run, or why the last call was refused: code, field, value and bounds. A call refused with
 * GIB_ERR_STATE changes nothing here.
 *
 * @param handle the instance.
 * @param detail receives it; its `code` is GIB_OK when nothing went wrong.
 * @return GIB_OK; GIB_ERR_NULL, GIB_ERR_HANDLE.
 *
 * [thread: cycle] [real-time: yes] [state: any]
 *
 * # Safety
 * `handle` is NULL or an instance; `detail` is NULL or writable.
 */
int32_t gib_inertia_last_error(const struct gib_inertia *handle,
                               struct gib_error_detail *detail);

/**
 * Bytes that an instance needs in memory of your own, to be aligned to 16.
 *
 * @return the size in bytes, about 66 KiB.
 *
 * [thread: any] [real-time: yes] [state: any]
 */
uintptr_t gib_learning_size(void);

/**
 * Makes an idle instance in memory of your own. There is nothing to free; zero or reuse the memory when done.
 *
 * @param memory at least `gib_learning_size()` bytes, aligned to 16; stays yours.
 * @param size bytes at `memory`.
 * @param out receives the handle; NULL on error.
 * @return GIB_OK; GIB_ERR_NULL; GIB_ERR_MEMORY when too small or misaligned.
 *
 * [thread: setup] [real-time: no] [state: none]
 *
 * # Safety
 * `memory` is NULL or points to `size` writable bytes; `out` is NULL or writable.
 */
int32_t gib_learning_init_in(void *memory, uintptr_t size, struct gib_learning **out);

/**
 * Makes an idle instance in memory that gib allocates.
 *
 * @return the handle, to be given to `gib_learning_free`; NULL when there is no memory.
 *
 * [thread: setup] [real-time: no] [state: none]
 */
struct gib_learning *gib_learning_new(void);

/**
 * Frees an instance made by `gib_learning_new`. NULL is allowed and does nothing.
 *
 * @param handle an instance from `gib_learning_new`, never one from `gib_learning_init_in`.
 *
 * [thread: setup] [real-time: no] [state: not busy]
 *
 * # Safety
 * `handle` is NULL or came from `gib_learning_new` and was not freed before.
 */
void gib_learning_free(struct gib_learning *handle);

/**
 * Checks the configuration and begins to learn, with the next step.
 *
 * The correction starts from none, or with `resume` from the one that this instance holds.
 *
 * @param handle the instance.
 * @param config how to learn; copied. Set `struct_size`, zero the rest, then set what you want.
 * @return GIB_OK; GIB_ERR_CONFIG (gib_learning_last_error names the field and its range; with `resume` also `points`, when
 * the correction held has another number of them), GIB_ERR_STRUCT_SIZE, GIB_ERR_STATE while busy, GIB_ERR_NULL,
 * GIB_ERR_HANDLE.
 *
 * [thread: setup, or cycle between steps] [real-time: yes] [state: not busy]
 *
 * # Safety
 * `handle` is NULL or an instance; `config` is NULL or points to its `struct_size` readable bytes.
 */
int32_t gib_learning_start(struct gib_learning *handle,
                           const struct gib_learning_config *config);

/**
 * One servo cycle. Call it in every cycle, also when idle: the command is then the target.
 *
 * Command `command_mm` in place of the target. It follows the target at once; the correction in it changes by a bounded
 * step a cycle whatever happens. After GIB_DONE the correction stays in force for as long as you call; an abort takes it out. It is
 * right for the speed and the sense at which it was learnt: at another speed `reasons` says GIB_LEARNING_SPEED_CHANGED, and beyond half
 * to one and a half times that speed, or the other way round, it fades out, to come back with the speed.
 *
 * @param handle the instance.
 * @param input target, detected position and angle of this cycle, all of the same instant.
 * @param output the command; always written when not NULL.
 * @return GIB_OK when idle, GIB_BUSY, GIB_DONE, or the first error, which is kept until the next start:
 * GIB_ERR_LEARNING_GROWS and GIB_ERR_LEARNING_UPDATES with the best correction in force; GIB_ERR_LEARNING_DEVIATION,
 * GIB_ERR_ABORTED, GIB_ERR_DRIVE_FAULT, GIB_ERR_DEADLINE (the spindle did not turn, or nothing was detected, for `wait_s`)
 * GIB_ERR_CONFIG (unknown `flags`) and GIB_ERR_NON_FINITE (the target is no number: the last command is repeated meanwhile) with none; and GIB_ERR_NULL,
 * GIB_ERR_HANDLE of this call. Where `input` is NULL the last command is repeated, and `correction_um` is what is in it.
 *
 * [thread: cycle] [real-time: yes] [state: any]
 *
 * # Safety
 * `handle` is NULL or an instance; `input` is NULL or readable; `output` is NULL or writable.
 */
int32_t gib_learning_step(struct gib_learning *handle,
                          const struct gib_learning_input *input,
                          struct gib_learning_output *output);

/**
 * Ends learning: the correction fades out within `fade_s`, then steps return GIB_ERR_ABORTED. After GIB_DONE it takes out the
 * correction that was kept. Does nothing else. To abort from another thread set `GIB_INPUT_ABORT` in the input.
 *
 * @param handle the instance.
 * @return GIB_OK; GIB_ERR_NULL, GIB_ERR_HANDLE.
 *
 * [thread: cycle] [real-time: yes] [state: any]
 *
 * # Safety
 * `handle` is NULL or an instance.
 */
int32_t gib_learning_abort(struct gib_learning *handle);

/**
 * Reads how far learning has come: deviations before, now and at best, updates, the speed.
 *
 * @param handle the instance.
 * @param report receives it.
 * @return GIB_OK; GIB_ERR_NULL, GIB_ERR_HANDLE.
 *
 * [thread: cycle] [real-time: yes] [state: any]
 *
 * # Safety
 * `handle` is NULL or an instance; `report` is NULL or writable.
 */
int32_t gib_learning_result(const struct gib_learning *handle, struct gib_learning_report *report);

/**
 * Reads target, command and detected position over the spindle's angle.
 *
 * @param handle the instance.
 * @param points receives them, from -180 degrees on; NULL with `capacity` 0 to learn the count, by GIB_ERR_BUFFER unless it is 0.
 * @param capacity points that fit at `points`.
 * @param count receives how many there are.
 * @return GIB_OK; GIB_ERR_BUFFER when there are more than fit, GIB_ERR_NULL, GIB_ERR_HANDLE.
 *
 * [thread: cycle] [real-time: no] [state: any]
 *
 * # Safety
 * `handle` is NULL or an instance; `points` is NULL or points to `capacity` writable points; `count` is NULL or writable.
 */
int32_t gib_learning_points(const struct gib_learning *handle,
                            struct gib_learning_point *points,
                            uintptr_t capacity,
                            uintptr_t *count);

/**
 * Writes target, command and detected position over the angle to a file, JSON with schema "gib.learning/1". An old file is
 * replaced whole or not at all.
 *
 * @param handle the instance.
 * @param path NUL-terminated; stays yours.
 * @return GIB_OK; GIB_ERR_STATE while busy or when nothing was ever learnt or loaded, GIB_ERR_IO, GIB_ERR_NULL,
 * GIB_ERR_HANDLE.
 *
 * [thread: setup] [real-time: no] [state: not busy]
 *
 * # Safety
 * `handle` is NULL or an instance; `path` is NULL or NUL-terminated.
 */
int32_t gib_learning_save(struct gib_learning *handle,
                          const char *path);

/**
 * Reads a learnt command from a file that `gib_learning_save` wrote; a start with `resume` takes it up.
 *
 * @param handle the instance; what it held is replaced, or kept when the file cannot be used.
 * @param path NUL-terminated; stays yours.
 * @return GIB_OK; GIB_ERR_IO, GIB_ERR_FORMAT (gib_learning_last_error names the key, with the point as `value`, or gives the
 * line), GIB_ERR_STATE while busy, GIB_ERR_NULL, GIB_ERR_HANDLE.
 *
 * [thread: setup] [real-time: no] [state: not busy]
 *
 * # Safety
 * `handle` is NULL or an instance; `path` is NULL or NUL-terminated.
 */
int32_t gib_learning_load(struct gib_learning *handle,
                          const char *path);

/**
 * The first error of the present run, or why the last call was refused: code, field, value and bounds. A call refused with
 * GIB_ERR_STATE changes nothing here.
 *
 * @param handle the instance.
 * @param detail receives it; its `code` is GIB_OK when nothing went wrong.
 * @return GIB_OK; GIB_ERR_NULL, GIB_ERR_HANDLE.
 *
 * [thread: cycle] [real-time: yes] [state: any]
 *
 * # Safety
 * `handle` is NULL or an instance; `detail` is NULL or writable.
 */
int32_t gib_learning_last_error(const struct gib_learning *handle,
                                struct gib_error_detail *detail);

/**
 * Makes an empty instance.
 *
 * @return the handle, to be given to `gib_machine_free`; NULL when there is no memory.
 *
 * [thread: setup] [real-time: no] [state: none]
 */
struct gib_machine *gib_machine_new(void);

/**
 * Frees an instance. NULL is allowed and does nothing.
 *
 * @param handle an instance from `gib_machine_new`, in use by no call.
 *
 * [thread: setup] [real-time: no] [state: any]
 *
 * # Safety
 * `handle` is NULL or came from `gib_machine_new` and was not freed before.
 */
void gib_machine_free(struct gib_machine *handle);

/**
 * Reads a machine from JSON with schema "gib.machine/1", with or without `effects`.
 *
 * @param handle the instance; what it held is replaced, or kept when the text cannot be used.
 * @param json the text, UTF-8; stays yours.
 * @param length bytes at `json`, without a NUL if there is one.
 * @return GIB_OK; GIB_ERR_FORMAT, and gib_machine_last_error_text names the path in the JSON, the value found and what
 * is allowed; GIB_ERR_NULL, GIB_ERR_HANDLE, GIB_ERR_INTERNAL.
 *
 * [thread: setup] [real-time: no] [state: any]
 *
 * # Safety
 * `handle` is NULL or an instance; `json` is NULL or points to `length` readable bytes.
 */
int32_t gib_machine_read(struct gib_machine *handle,
                         const char *json,
                         uintptr_t length);

/**
 * Reads a machine file.
 *
 * @param handle the instance; what it held is replaced, or kept when the file cannot be used.
 * @param path NUL-terminated; stays yours.
 * @return GIB_OK; GIB_ERR_IO, GIB_ERR_FORMAT (gib_machine_last_error_text says where and why), GIB_ERR_NULL,
 * GIB_ERR_HANDLE, GIB_ERR_INTERNAL.
 *
 * [thread: setup] [real-time: no] [state: any]
 *
 * # Safety
 * `handle` is NULL or an instance; `path` is NULL or NUL-terminated.
 */
int32_t gib_machine_load(struct gib_machine *handle, const char *path);

/**
 * Writes the machine file.
 *
 * @param handle the instance.
 * @param path NUL-terminated; stays yours. A file of that name is replaced.
 * @return GIB_OK; GIB_ERR_IO; GIB_ERR_STATE when no machine was read; GIB_ERR_NULL, GIB_ERR_HANDLE, GIB_ERR_INTERNAL.
 *
 * [thread: setup] [real-time: no] [state: a machine was read]
 *
 * # Safety
 * `handle` is NULL or an instance; `path` is NULL or NUL-terminated.
 */
int32_t gib_machine_save(struct gib_machine *handle,
                         const char *path);

/**
 * The machine as JSON with schema "gib.machine/1".
 *
 * Ask for the size first: `gib_machine_result(handle, NULL, 0, &needed)` returns GIB_ERR_BUFFER and sets `needed`.
 *
 * @param handle the instance.
 * @param json receives the text, UTF-8, with its NUL; NULL to ask for the size alone.
 * @param size bytes at `json`.
 * @param needed receives the bytes for all of it with its NUL; may be NULL.
 * @return GIB_OK; GIB_ERR_BUFFER when `size` is too small; GIB_ERR_STATE when no machine was read; GIB_ERR_NULL,
 * GIB_ERR_HANDLE, GIB_ERR_INTERNAL.
 *
 * [thread: setup] [real-time: no] [state: a machine was read]
 *
 * # Safety
 * `handle` is NULL or an instance; `json` is NULL or points to `size` writable bytes; `needed` is NULL or writable.
 */
int32_t gib_machine_result(const struct gib_machine *handle,
                           char *json,
                           uintptr_t size,
                           uintptr_t *needed);

/**
 * Keys of the file that have no meaning here, a line each, as paths in the JSON: ignored, but one may be a slip.
 *
 * @param handle the instance.
 * @param text receives the lines with a NUL; empty when every key has a meaning. NULL to ask for the size alone.
 * @param size bytes at `text`.
 * @param needed receives the bytes for all of it with its NUL; may be NULL.
 * @return as gib_machine_result.
 *
 * [thread: setup] [real-time: no] [state: a machine was read]
 *
 * # Safety
 * `handle` is NULL or an instance; `text` is NULL or points to `size` writable bytes; `needed` is NULL or writable.
 */
int32_t gib_machine_ignored_keys(const struct gib_machine *handle,
                                 char *text,
                                 uintptr_t size,
                                 uintptr_t *needed);

/**
 * Why the last call failed, as a sentence that names the file or the path in the JSON, what was found and what is
 * allowed. Each call of this family on the handle forgets the sentence of the one before and leaves its own if it
 * fails; a call that is refused with GIB_ERR_NULL or GIB_ERR_HANDLE because of the handle itself has nowhere to leave one.
 *
 * @param handle the instance.
 * @param text receives the sentence, UTF-8, with its NUL; empty when the last call did its work.
 * @param size bytes at `text`; a longer sentence is cut.
 * @return GIB_OK; GIB_ERR_BUFFER when the sentence was cut; GIB_ERR_NULL, GIB_ERR_HANDLE.
 *
 * [thread: setup] [real-time: no] [state: any]
 *
 * # Safety
 * `handle` is NULL or an instance; `text` is NULL or points to `size` writable bytes.
 */
int32_t gib_machine_last_error_text(const struct gib_machine *handle,
                                    char *text,
                                    uintptr_t size);

/**
 * Bytes that an instance needs in memory of your own, to be aligned to 16.
 *
 * @return the size in bytes, below 1 KiB.
 *
 * [thread: any] [real-time: yes] [state: any]
 */
uintptr_t gib_program_size(void);

/**
 * Makes an instance in memory of your own. There is nothing to free; zero or reuse the memory when done.
 *
 * @param memory at least `gib_program_size()` bytes, aligned to 16; stays yours.
 * @param size bytes at `memory`.
 * @param out receives the handle; NULL on error.
 * @return GIB_OK; GIB_ERR_NULL; GIB_ERR_MEMORY when too small or misaligned.
 *
 * [thread: setup] [real-time: no] [state: none]
 *
 * # Safety
 * `memory` is NULL or points to `size` writable bytes; `out` is NULL or writable.
 */
int32_t gib_program_init_in(void *memory, uintptr_t size, struct gib_program **out);

/**
 * Makes an instance in memory that gib allocates.
 *
 * @return the handle, to be given to `gib_program_free`; NULL when there is no memory.
 *
 * [thread: setup] [real-time: no] [state: none]
 */
struct gib_program *gib_program_new(void);

/**
 * Frees an instance made by `gib_program_new`. NULL is allowed and does nothing.
 *
 * @param handle an instance from `gib_program_new`, never one from `gib_program_init_in`.
 *
 * [thread: setup] [real-time: no] [state: any]
 *
 * # Safety
 * `handle` is NULL or came from `gib_program_new` and was not freed before.
 */
void gib_program_free(struct gib_program *handle);

/**
 * Reads INA from the head of a part program: when it is there, measuring is skipped.
 *
 * All spellings are read: `#<_ina>=0.5`, `INA=0.5`, `(INA=0.5)`; for step 2 `INA2`. No more than the head is read;
 * a symbolic link is followed. The head must be sound as a whole, also where it speaks of other steps.
 *
 * @param handle the instance.
 * @param path the program, NUL-terminated, in the file system's encoding.
 * @param step process step 1 to 9999; 0 for the whole program. A step without a value of its own is absent, also
 * where the whole program has one.
 * @param inertia_kg_m2 receives the inertia, kg·m², finite and above 0; 0 on any error.
 * @return GIB_OK; GIB_ERR_PROGRAM_ABSENT when it must be measured; GIB_ERR_PROGRAM_VALUE, GIB_ERR_PROGRAM_DUPLICATE,
 * GIB_ERR_PROGRAM_NOT_A_FILE, GIB_ERR_FORMAT for NUL bytes or UTF-16, GIB_ERR_IO, GIB_ERR_CONFIG for another step,
 * GIB_ERR_NULL, GIB_ERR_HANDLE, GIB_ERR_INTERNAL.
 *
 * [thread: setup] [real-time: no] [state: any]
 *
 * # Safety
 * `handle` is NULL or an instance; `path` is NULL or NUL-terminated; `inertia_kg_m2` is NULL or writable.
 */
int32_t gib_program_get(struct gib_program *handle,
                        const char *path,
                        uint32_t step,
                        double *inertia_kg_m2);

/**
 * Writes INA into the head of a part program; no other byte changes. Touches nothing when the value is there.
 *
 * The program is replaced whole or not at all, also when the power fails, with its owner, group, mode and access list.
 * Waits for another writer for 60 s at most.
 *
 * @param handle the instance.
 * @param path the program, NUL-terminated, in the file system's encoding; not a symbolic link.
 * @param step process step 1 to 9999; 0 for the whole program.
 * @param inertia_kg_m2 the inertia, 1e-9 to 1e9 kg·m².
 * @param dialect GIB_PROGRAM_DIALECT_...: how a new value is spelled; one that is there keeps its spelling.
 * @return GIB_OK; GIB_ERR_CONFIG for a step, inertia or dialect out of range; GIB_ERR_PROGRAM_VALUE,
 * GIB_ERR_PROGRAM_DUPLICATE, GIB_ERR_PROGRAM_LINK, GIB_ERR_PROGRAM_NOT_A_FILE, GIB_ERR_PROGRAM_BUSY,
 * GIB_ERR_PROGRAM_CHANGED, GIB_ERR_PROGRAM_OWNER, GIB_ERR_FORMAT for NUL bytes or UTF-16, GIB_ERR_IO,
 * GIB_ERR_NULL, GIB_ERR_HANDLE, GIB_ERR_INTERNAL.
 *
 * [thread: setup] [real-time: no] [state: any]
 *
 * # Safety
 * `handle` is NULL or an instance; `path` is NULL or NUL-terminated.
 */
int32_t gib_program_set(struct gib_program *handle,
                        const char *path,
                        uint32_t step,
                        double inertia_kg_m2,
                        int32_t dialect);

/**
 * Removes INA from the head of a part program: the line when nothing else stands on it, else only the statement.
 *
 * What is not there is as good as removed. The program is replaced as by gib_program_set.
 *
 * @param handle the instance.
 * @param path the program, NUL-terminated, in the file system's encoding; not a symbolic link.
 * @param step process step 1 to 9999; 0 for the whole program.
 * @return as gib_program_set.
 *
 * [thread: setup] [real-time: no] [state: any]
 *
 * # Safety
 * `handle` is NULL or an instance; `path` is NULL or NUL-terminated.
 */
int32_t gib_program_remove(struct gib_program *handle,
                           const char *path,
                           uint32_t step);

/**
 * Why the last call failed: code, field, value and bounds.
 *
 * Field `line` has the line of the program as value; for GIB_ERR_PROGRAM_DUPLICATE `low` and `high` are the two lines.
 *
 * @param handle the instance.
 * @param detail receives it; its `code` is GIB_OK when the last call did its work.
 * @return GIB_OK; GIB_ERR_NULL, GIB_ERR_HANDLE.
 *
 * [thread: setup] [real-time: yes] [state: any]
 *
 * # Safety
 * `handle` is NULL or an instance; `detail` is NULL or writable.
 */
int32_t gib_program_last_error(const struct gib_program *handle,
                               struct gib_error_detail *detail);

/**
 * Why the last call failed, as a sentence for the operator that quotes the line at fault, UTF-8.
 *
 * @param handle the instance.
 * @param text receives the sentence and its NUL.
 * @param size bytes at `text`; GIB_PROGRAM_TEXT_SIZE always suffices.
 * @return GIB_OK; GIB_ERR_BUFFER when `size` is too small (then as much as fits is written); GIB_ERR_NULL,
 * GIB_ERR_HANDLE.
 *
 * [thread: setup] [real-time: no] [state: any]
 *
 * # Safety
 * `handle` is NULL or an instance; `text` is NULL or points to `size` writable bytes.
 */
int32_t gib_program_last_error_text(const struct gib_program *handle, char *text, uintptr_t size);

/**
 * Bytes that an instance needs in memory of your own, to be aligned to 16.
 *
 * @return the size in bytes, below 1 KiB; the ring is not in it.
 *
 * [thread: any] [real-time: yes] [state: any]
 */
uintptr_t gib_recorder_size(void);

/**
 * Makes an instance at rest in memory of your own. Call gib_recorder_close before the memory is used for anything else.
 *
 * @param memory at least `gib_recorder_size()` bytes, aligned to 16; stays yours.
 * @param size bytes at `memory`.
 * @param out receives the handle; NULL on error.
 * @return GIB_OK; GIB_ERR_NULL; GIB_ERR_MEMORY when too small or misaligned.
 *
 * [thread: setup] [real-time: no] [state: none]
 *
 * # Safety
 * `memory` is NULL or points to `size` writable bytes; `out` is NULL or writable.
 */
int32_t gib_recorder_init_in(void *memory,
                             uintptr_t size,
                             struct gib_recorder **out);

/**
 * Makes an instance at rest in memory that gib allocates.
 *
 * @return the handle, to be given to `gib_recorder_free`; NULL when there is no memory.
 *
 * [thread: setup] [real-time: no] [state: none]
 */
struct gib_recorder *gib_recorder_new(void);

/**
 * Closes and frees an instance made by `gib_recorder_new`. NULL is allowed and does nothing.
 *
 * @param handle an instance from `gib_recorder_new`, never one from `gib_recorder_init_in`.
 *
 * [thread: setup] [real-time: no] [state: no step runs]
 *
 * # Safety
 * `handle` is NULL or came from `gib_recorder_new` and was not freed before.
 */
void gib_recorder_free(struct gib_recorder *handle);

/**
 * Makes the shared memory, touches and locks all of it, and begins to record with the next step.
 *
 * The memory is `/dev/shm/gib-<name>`. What a process that died left under this name is cleared away; a living one keeps it.
 *
 * @param handle the instance.
 * @param config what to record; copied. Set `struct_size`, zero the rest, then set what you want.
 * @return GIB_OK; GIB_ERR_CONFIG and GIB_ERR_RECORDER_COLUMN (gib_recorder_last_error names the field and its range, or
 * the number of the column), GIB_ERR_RECORDER_IN_USE, GIB_ERR_RECORDER_FOREIGN, GIB_ERR_MEMORY when there is not that much
 * shared memory, GIB_ERR_IO, GIB_ERR_STRUCT_SIZE, GIB_ERR_STATE unless closed, GIB_ERR_NULL, GIB_ERR_HANDLE.
 *
 * [thread: setup] [real-time: no] [state: closed]
 *
 * # Safety
 * `handle` is NULL or an instance; `config` is NULL or points to its `struct_size` readable bytes, and its texts are
 * NULL or NUL-terminated.
 */
int32_t gib_recorder_start(struct gib_recorder *handle,
                           const struct gib_recorder_config *config);

/**
 * One servo cycle: writes a row when one is due. Never waits for a reader.
 *
 * @param handle the instance.
 * @param values one number a channel, in the order of the columns. A NaN or an infinity is recorded as an empty cell.
 * @param count numbers at `values`; must be `channels`.
 * @return GIB_BUSY while recording; GIB_OK at rest; GIB_ERR_ABORTED after gib_recorder_abort; GIB_ERR_RECORDER_COUNT,
 * GIB_ERR_NULL, GIB_ERR_HANDLE of this call, which wrote no row.
 *
 * [thread: cycle] [real-time: yes] [state: any]
 *
 * # Safety
 * `handle` is NULL or an instance; `values` is NULL or points to `count` readable numbers.
 */
int32_t gib_recorder_step(struct gib_recorder *handle,
                          const double *values,
                          uint32_t count);

/**
 * One servo cycle, as `gib_recorder_step`, of values that lie scattered: each is read from its own address, once, when a row
 * is due. Saves a kernel that keeps its signals in places of their own, such as LinuxCNC's pins, to gather them first.
 *
 * @param handle the instance.
 * @param sources where the number of each channel lies now, in the order of the columns. A NaN or an infinity is recorded as
 * an empty cell, and so is a NULL among them. Read during this call only.
 * @param count addresses at `sources`; must be `channels`.
 * @return as `gib_recorder_step`.
 *
 * [thread: cycle] [real-time: yes] [state: any]
 *
 * # Safety
 * `handle` is NULL or an instance; `sources` is NULL or points to `count` addresses, each NULL or of a readable number.
 */
int32_t gib_recorder_step_from(struct gib_recorder *handle,
                               const double *const *sources,
                               uint32_t count);

/**
 * Ends the recording: no row is written any more, and readers end by themselves once they have all. Does nothing at rest.
 *
 * The shared memory stays until gib_recorder_close, which setup calls.
 *
 * @param handle the instance.
 * @return GIB_OK; GIB_ERR_NULL, GIB_ERR_HANDLE.
 *
 * [thread: cycle] [real-time: yes] [state: any]
 *
 * # Safety
 * `handle` is NULL or an instance.
 */
int32_t gib_recorder_abort(struct gib_recorder *handle);

/**
 * Ends the recording and gives the shared memory back. Readers that have it open read it to its end.
 *
 * @param handle the instance.
 * @return GIB_OK, also at rest; GIB_ERR_NULL, GIB_ERR_HANDLE.
 *
 * [thread: setup] [real-time: no] [state: no step runs]
 *
 * # Safety
 * `handle` is NULL or an instance.
 */
int32_t gib_recorder_close(struct gib_recorder *handle);

/**
 * Reads what the recorder has done.
 *
 * @param handle the instance.
 * @param report receives it.
 * @return GIB_OK; GIB_ERR_NULL, GIB_ERR_HANDLE.
 *
 * [thread: cycle] [real-time: yes] [state: any]
 *
 * # Safety
 * `handle` is NULL or an instance; `report` is NULL or writable.
 */
int32_t gib_recorder_result(const struct gib_recorder *handle, struct gib_recorder_report *report);

/**
 * Why the last start was refused: code, field, value and bounds.
 *
 * @param handle the instance.
 * @param detail receives it; its `code` is GIB_OK when nothing went wrong.
 * @return GIB_OK; GIB_ERR_NULL, GIB_ERR_HANDLE.
 *
 * [thread: any] [real-time: yes] [state: any]
 *
 * # Safety
 * `handle` is NULL or an instance; `detail` is NULL or writable.
 */
int32_t gib_recorder_last_error(const struct gib_recorder *handle, struct gib_error_detail *detail);

/**
 * Bytes that an instance needs in memory of your own, to be aligned to 16.
 *
 * @return the size in bytes, below 1 KiB.
 *
 * [thread: any] [real-time: yes] [state: any]
 */
uintptr_t gib_speed_variation_size(void);

/**
 * Makes an idle instance in memory of your own. There is nothing to free; zero or reuse the memory when done.
 *
 * @param memory at least `gib_speed_variation_size()` bytes, aligned to 16; stays yours.
 * @param size bytes at `memory`.
 * @param out receives the handle; NULL on error.
 * @return GIB_OK; GIB_ERR_NULL; GIB_ERR_MEMORY when too small or misaligned.
 *
 * [thread: setup] [real-time: no] [state: none]
 *
 * # Safety
 * `memory` is NULL or points to `size` writable bytes; `out` is NULL or writable.
 */
int32_t gib_speed_variation_init_in(void *memory, uintptr_t size, struct gib_speed_variation **out);

/**
 * Makes an idle instance in memory that gib allocates.
 *
 * @return the handle, to be given to `gib_speed_variation_free`; NULL when there is no memory.
 *
 * [thread: setup] [real-time: no] [state: none]
 */
struct gib_speed_variation *gib_speed_variation_new(void);

/**
 * Frees an instance made by `gib_speed_variation_new`. NULL is allowed and does nothing.
 *
 * @param handle an instance from `gib_speed_variation_new`, never one from `gib_speed_variation_init_in`.
 *
 * [thread: setup] [real-time: no] [state: not busy]
 *
 * # Safety
 * `handle` is NULL or came from `gib_speed_variation_new` and was not freed before.
 */
void gib_speed_variation_free(struct gib_speed_variation *handle);

/**
 * Checks the configuration and arms a variation, which begins with the next step at the mean speed: start it when the spindle
 * is there.
 *
 * What the motor cannot do is refused: gib_speed_variation_last_error then names `amplitude_ratio` with the largest
 * possible one as upper bound.
 *
 * @param handle the instance.
 * @param config what to vary, by which motor; copied. Set `struct_size`, zero the rest, then set what you want.
 * @return GIB_OK; GIB_ERR_SPEED_VARIATION_POWER, _TORQUE, _SPEED, _NONE; GIB_ERR_CONFIG, GIB_ERR_STRUCT_SIZE,
 * GIB_ERR_STATE while busy, GIB_ERR_NULL, GIB_ERR_HANDLE.
 *
 * [thread: setup, or cycle between steps] [real-time: yes] [state: not busy]
 *
 * # Safety
 * `handle` is NULL or an instance; `config` is NULL or points to its `struct_size` readable bytes.
 */
int32_t gib_speed_variation_start(struct gib_speed_variation *handle,
                                  const struct gib_speed_variation_config *config);

/**
 * One servo cycle: the speed command.
 *
 * It begins and ends at the mean speed without a jump, wherever that has gone meanwhile: on the way back, too, it may change in
 * any cycle. Mean speed, amplitude, period and cutting torque may change in
 * any cycle; torque, power and speed stay within the motor's. Where more is asked for than it can do, the amplitude
 * is cut to what it can, and `message` says why. What a change leads to is worked out over the cycles that follow, a piece in
 * each: it takes effect within 20 cycles, and until then the variation goes on as before. Cutting torque counts at once.
 *
 * A fault is named in `message` in its cycle; the speed then goes back to its mean as after GIB_SPEED_VARIATION_STOP, with status
 * GIB_BUSY, and only then the error is returned. A speed of 0, too low or of the other sense (a spindle stop, a reversal) leads it
 * to the lowest speed allowed, one that is too high or no number nowhere else.
 *
 * Idle, done or failed, the command is `speed_rpm` passed through: ramps are the kernel's again. Only where a variation ends at
 * another speed than is asked for in that cycle does gib lead the command there first, through 0 where it turns the other way, within
 * what the motor can do; done once they are equal, at once with GIB_INPUT_FAULT. After a first start a speed beyond
 * `speed_max_rpm` in either sense is not passed through, and one that is no number never: the command stays. After a drive fault, and after any fault in the first step, gib lets go at once: that
 * step commands the speed asked for or, where that is no number, the last one within the limits, else the configuration's mean.
 *
 * @param handle the instance.
 * @param input what is asked for in this cycle.
 * @param output command for this cycle; always written when not NULL.
 * @return GIB_OK when idle, GIB_BUSY, GIB_DONE after `GIB_SPEED_VARIATION_STOP`, or the first error, which is kept
 * until the next start: GIB_ERR_ABORTED, GIB_ERR_NON_FINITE, GIB_ERR_DRIVE_FAULT, GIB_ERR_CONFIG,
 * GIB_ERR_SPEED_VARIATION_SPEED, GIB_ERR_SPEED_VARIATION_NONE where the motor cannot do the way back, also after a stop; and GIB_ERR_NULL, GIB_ERR_HANDLE of this call.
 *
 * [thread: cycle] [real-time: yes] [state: any]
 *
 * # Safety
 * `handle` is NULL or an instance; `input` is NULL or readable; `output` is NULL or writable.
 */
int32_t gib_speed_variation_step(struct gib_speed_variation *handle,
                                 const struct gib_speed_variation_input *input,
                                 struct gib_speed_variation_output *output);

/**
 * Aborts a running variation: the next steps go back to the mean speed and end with GIB_ERR_ABORTED. Does nothing
 * when not busy. To end well set `GIB_SPEED_VARIATION_STOP` in the input instead.
 *
 * @param handle the instance.
 * @return GIB_OK; GIB_ERR_NULL, GIB_ERR_HANDLE.
 *
 * [thread: cycle] [real-time: yes] [state: any]
 *
 * # Safety
 * `handle` is NULL or an instance.
 */
int32_t gib_speed_variation_abort(struct gib_speed_variation *handle);

/**
 * What is possible and recommended for the variation that was started last.
 *
 * @param handle the instance.
 * @param limits receives it.
 * @return GIB_OK; GIB_ERR_STATE before the first start; GIB_ERR_NULL, GIB_ERR_HANDLE.
 *
 * [thread: setup, or cycle] [real-time: yes] [state: after a start]
 *
 * # Safety
 * `handle` is NULL or an instance; `limits` is NULL or writable.
 */
int32_t gib_speed_variation_result(struct gib_speed_variation *handle,
                                   struct gib_speed_variation_limits *limits);

/**
 * What a motor can do: largest amplitude for a period, shortest period for an amplitude, as published and exact, and
 * what is recommended. Needs no instance; call it for each point of a chart.
 *
 * @param config speed, inertia and motor; `amplitude_ratio` or `period_s` or both; `cycle_s` may stay 0.
 * @param limits receives it; zeros on error.
 * @return GIB_OK; GIB_ERR_CONFIG, GIB_ERR_STRUCT_SIZE, GIB_ERR_NULL.
 *
 * [thread: any] [real-time: yes] [state: none]
 *
 * # Safety
 * `config` is NULL or points to its `struct_size` readable bytes; `limits` is NULL or writable.
 */
int32_t gib_speed_variation_possible(const struct gib_speed_variation_config *config,
                                     struct gib_speed_variation_limits *limits);

/**
 * The first error of the present run, or why the last call was refused: code, field, value and bounds. A call refused with
 * GIB_ERR_STATE changes nothing here.
 *
 * @param handle the instance.
 * @param detail receives it; its `code` is GIB_OK when nothing went wrong.
 * @return GIB_OK; GIB_ERR_NULL, GIB_ERR_HANDLE.
 *
 * [thread: cycle] [real-time: yes] [state: any]
 *
 * # Safety
 * `handle` is NULL or an instance; `detail` is NULL or writable.
 */
int32_t gib_speed_variation_last_error(const struct gib_speed_variation *handle,
                                       struct gib_error_detail *detail);

/**
 * Bytes that an instance needs in memory of your own, to be aligned to 16.
 *
 * @return the size in bytes, about 131 KiB.
 *
 * [thread: any] [real-time: yes] [state: any]
 */
uintptr_t gib_tilt_size(void);

/**
 * Makes an idle instance in memory of your own. There is nothing to free; zero or reuse the memory when done.
 *
 * @param memory at least `gib_tilt_size()` bytes, aligned to 16; stays yours.
 * @param size bytes at `memory`.
 * @param out receives the handle; NULL on error.
 * @return GIB_OK; GIB_ERR_NULL; GIB_ERR_MEMORY when too small or misaligned.
 *
 * [thread: setup] [real-time: no] [state: none]
 *
 * # Safety
 * `memory` is NULL or points to `size` writable bytes; `out` is NULL or writable.
 */
int32_t gib_tilt_init_in(void *memory, uintptr_t size, struct gib_tilt **out);

/**
 * Makes an idle instance in memory that gib allocates.
 *
 * @return the handle, to be given to `gib_tilt_free`; NULL when there is no memory.
 *
 * [thread: setup] [real-time: no] [state: none]
 */
struct gib_tilt *gib_tilt_new(void);

/**
 * Frees an instance made by `gib_tilt_new`. NULL is allowed and does nothing.
 *
 * Take offsets that are in force out first: memory that is gone can ramp nothing.
 *
 * @param handle an instance from `gib_tilt_new`, never one from `gib_tilt_init_in`.
 *
 * [thread: setup] [real-time: no] [state: not busy]
 *
 * # Safety
 * `handle` is NULL or came from `gib_tilt_new` and was not freed before.
 */
void gib_tilt_free(struct gib_tilt *handle);

/**
 * Checks configuration and table, and arms a measurement, which begins when the tool is in the cut.
 *
 * The rising edge of PLCopen's Execute. Clears the previous result and error.
 *
 * @param handle the instance.
 * @param config how to measure and compensate; copied. Set `struct_size`, zero the rest, then set what you want.
 * @param table the load table; copied. Not looked at, and may be NULL, when teaching.
 * @return GIB_OK; GIB_ERR_CONFIG (gib_tilt_last_error names the field and its range), GIB_ERR_STRUCT_SIZE,
 * GIB_ERR_TILT_TABLE for a table that is too short or does not rise, GIB_ERR_TILT_CONDITION for a table of another
 * condition, GIB_ERR_STATE while busy, GIB_ERR_NULL, GIB_ERR_HANDLE.
 *
 * [thread: setup] [real-time: no] [state: not busy]
 *
 * # Safety
 * `handle` is NULL or an instance; `config` and `table` are NULL or point to their `struct_size` readable bytes.
 */
int32_t gib_tilt_start(struct gib_tilt *handle,
                       const struct gib_tilt_config *config,
                       const struct gib_tilt_table *table);

/**
 * One servo cycle. Call it in every cycle, also when idle: offsets are brought in, kept and taken out through it.
 *
 * Give commanded coordinates without gib's offsets, and add `offset_mm` and `offset_deg` to them. Set
 * `GIB_TILT_INPUT_CUTTING` while the tool cuts at feed, and `GIB_TILT_INPUT_END` when the path is finished. When
 * `warning` is 1, warn the operator; give `request_id` back in `acknowledged_id` to have the offsets brought in, set
 * `GIB_TILT_INPUT_OFF` to decline. The same flag takes offsets out that are in force.
 *
 * @param handle the instance.
 * @param input values of this cycle.
 * @param output offsets for this cycle; always written when not NULL.
 * @return GIB_OK when idle, GIB_BUSY, GIB_DONE, or the first error, which is kept until the next start:
 * GIB_ERR_ABORTED, GIB_ERR_NON_FINITE, GIB_ERR_DRIVE_FAULT, GIB_ERR_CONFIG for an unknown flag, GIB_ERR_ACK_TIMEOUT,
 * GIB_ERR_DEADLINE, GIB_ERR_TILT_...; and GIB_ERR_NULL, GIB_ERR_HANDLE of this call.
 *
 * [thread: cycle] [real-time: yes] [state: any]
 *
 * # Safety
 * `handle` is NULL or an instance; `input` is NULL or readable; `output` is NULL or writable.
 */
int32_t gib_tilt_step(struct gib_tilt *handle,
                      const struct gib_tilt_input *input,
                      struct gib_tilt_output *output);

/**
 * Aborts: the next steps take the offsets out within their bounds of speed and acceleration, and end with
 * GIB_ERR_ABORTED. Does nothing when not busy. To abort from another thread set `GIB_INPUT_ABORT` in the input.
 *
 * @param handle the instance.
 * @return GIB_OK; GIB_ERR_NULL, GIB_ERR_HANDLE.
 *
 * [thread: cycle] [real-time: yes] [state: any]
 *
 * # Safety
 * `handle` is NULL or an instance.
 */
int32_t gib_tilt_abort(struct gib_tilt *handle);

/**
 * Reads what was found: complete after GIB_DONE, else what is known so far.
 *
 * @param handle the instance.
 * @param report receives it.
 * @return GIB_OK; GIB_ERR_NULL, GIB_ERR_HANDLE.
 *
 * [thread: cycle] [real-time: yes] [state: any]
 *
 * # Safety
 * `handle` is NULL or an instance; `report` is NULL or writable.
 */
int32_t gib_tilt_result(const struct gib_tilt *handle, struct gib_tilt_report *report);

/**
 * The first error of the present run, or why the last call was refused: code, field, value and bounds. A call refused with
 * GIB_ERR_STATE changes nothing here.
 *
 * @param handle the instance.
 * @param detail receives it; its `code` is GIB_OK when nothing went wrong.
 * @return GIB_OK; GIB_ERR_NULL, GIB_ERR_HANDLE.
 *
 * [thread: cycle] [real-time: yes] [state: any]
 *
 * # Safety
 * `handle` is NULL or an instance; `detail` is NULL or writable.
 */
int32_t gib_tilt_last_error(const struct gib_tilt *handle,
                            struct gib_error_detail *detail);

/**
 * Adds a cut to a table: a new row in the order of depth, or a further cut of a depth that is there.
 *
 * @param table the table; its `struct_size` and `condition` are set.
 * @param depth_mm depth of the cut, 0 to 1000 mm.
 * @param load mean load of the cut, 0 to 1e9: the `load` of a report after teaching, or any other mean.
 * @param load_std its standard uncertainty; 0: taken as exact.
 * @param detail receives what was wrong; may be NULL.
 * @return GIB_OK; GIB_ERR_CONFIG, GIB_ERR_TILT_TABLE when all rows are used, GIB_ERR_STRUCT_SIZE, GIB_ERR_NULL.
 *
 * [thread: setup] [real-time: no] [state: none]
 *
 * # Safety
 * `table` is NULL or points to a whole `gib_tilt_table`; `detail` is NULL or writable.
 */
int32_t gib_tilt_table_add(struct gib_tilt_table *table,
                           double depth_mm,
                           double load,
                           double load_std,
                           struct gib_error_detail *detail);

/**
 * Checks that a table can be measured with: two rows at least, depths and loads finite and rising, and the loads of
 * neighbouring rows further apart than twice their uncertainties.
 *
 * @param table the table.
 * @param detail receives what was wrong: the column, the value, and what it must be above; may be NULL.
 * @return GIB_OK; GIB_ERR_TILT_TABLE, GIB_ERR_CONFIG, GIB_ERR_STRUCT_SIZE, GIB_ERR_NULL.
 *
 * [thread: setup] [real-time: no] [state: none]
 *
 * # Safety
 * `table` is NULL or points to its `struct_size` readable bytes; `detail` is NULL or writable.
 */
int32_t gib_tilt_table_check(const struct gib_tilt_table *table,
                             struct gib_error_detail *detail);

/**
 * Writes a table to a file, JSON `gib.tilt_table/1`, with its condition; whole or not at all.
 *
 * @param table the table; one that gib_tilt_table_check refuses is not written.
 * @param path the file, NUL-terminated; replaced when it is there, with its owner and mode kept.
 * @param detail receives what was wrong; may be NULL.
 * @return GIB_OK; GIB_ERR_IO, and as gib_tilt_table_check.
 *
 * [thread: setup] [real-time: no] [state: none]
 *
 * # Safety
 * `table` is NULL or points to its `struct_size` readable bytes; `path` is NULL or NUL-terminated; `detail` is NULL or
 * writable.
 */
int32_t gib_tilt_table_save(const struct gib_tilt_table *table,
                            const char *path,
                            struct gib_error_detail *detail);

/**
 * Reads a table from a file. The condition comes with it; gib_tilt_start compares it with that of the cut.
 *
 * @param table receives the table; unchanged on any error. Its `struct_size` is set by the caller.
 * @param path the file, NUL-terminated.
 * @param detail receives what was wrong; `field` is "line" where the text is not JSON or not UTF-8; may be NULL.
 * @return GIB_OK; GIB_ERR_IO, GIB_ERR_FORMAT, and as gib_tilt_table_check.
 *
 * [thread: setup] [real-time: no] [state: none]
 *
 * # Safety
 * `table` is NULL or points to a whole `gib_tilt_table`; `path` is NULL or NUL-terminated; `detail` is NULL or writable.
 */
int32_t gib_tilt_table_load(struct gib_tilt_table *table,
                            const char *path,
                            struct gib_error_detail *detail);

/**
 * The published rule by itself: depths by straight interpolation at two positions, and the angle between.
 *
 * @param table the load table.
 * @param position_mm two positions along the path, mm, at least 1 µm apart.
 * @param load the load at each.
 * @param result receives depths, angle and slope.
 * @param detail receives what was wrong; may be NULL.
 * @return GIB_OK; GIB_ERR_TILT_RANGE for a load outside the table, GIB_ERR_CONFIG, and as gib_tilt_table_check.
 *
 * [thread: any] [real-time: no] [state: none]
 *
 * # Safety
 * `table` is NULL or points to its `struct_size` readable bytes; `position_mm` and `load` are NULL or two numbers each;
 * `result` and `detail` are NULL or writable.
 */
int32_t gib_tilt_two_point(const struct gib_tilt_table *table,
                           const double *position_mm,
                           const double *load,
                           struct gib_tilt_two_point_result *result,
                           struct gib_error_detail *detail);

/**
 * Bytes that an instance needs in memory of your own, to be aligned to 16.
 *
 * @return the size in bytes, about 6 KiB.
 *
 * [thread: any] [real-time: yes] [state: any]
 */
uintptr_t gib_vibration_size(void);

/**
 * Makes an idle instance in memory of your own. There is nothing to free; zero or reuse the memory when done.
 *
 * @param memory at least `gib_vibration_size()` bytes, aligned to 16; stays yours.
 * @param size bytes at `memory`.
 * @param out receives the handle; NULL on error.
 * @return GIB_OK; GIB_ERR_NULL; GIB_ERR_MEMORY when too small or misaligned.
 *
 * [thread: setup] [real-time: no] [state: none]
 *
 * # Safety
 * `memory` is NULL or points to `size` writable bytes; `out` is NULL or writable.
 */
int32_t gib_vibration_init_in(void *memory, uintptr_t size, struct gib_vibration **out);

/**
 * Makes an idle instance in memory that gib allocates.
 *
 * @return the handle, to be given to `gib_vibration_free`; NULL when there is no memory.
 *
 * [thread: setup] [real-time: no] [state: none]
 */
struct gib_vibration *gib_vibration_new(void);

/**
 * Frees an instance made by `gib_vibration_new`. NULL is allowed and does nothing.
 *
 * @param handle an instance from `gib_vibration_new`, never one from `gib_vibration_init_in`.
 *
 * [thread: setup] [real-time: no] [state: not busy]
 *
 * # Safety
 * `handle` is NULL or came from `gib_vibration_new` and was not freed before.
 */
void gib_vibration_free(struct gib_vibration *handle);

/**
 * Checks the configuration and begins to correct the position, with the next step.
 *
 * The correction comes in by itself once the spindle has turned a whole revolution with good sensors, at a speed that changed by
 * less than a quarter meanwhile.
 *
 * @param handle the instance.
 * @param config how to correct; copied. Set `struct_size`, zero the rest, then set what you want.
 * @param table gains and phases from `gib_calibration_result`; copied. NULL: both accelerometers are believed as they are.
 * @return GIB_OK; GIB_ERR_CONFIG (gib_vibration_last_error names the field, of configuration or table, and its range),
 * GIB_ERR_STRUCT_SIZE of either, GIB_ERR_STATE while busy, GIB_ERR_NULL, GIB_ERR_HANDLE.
 *
 * [thread: setup, or cycle between steps] [real-time: yes] [state: not busy]
 *
 * # Safety
 * `handle` is NULL or an instance; `config` and `table` are each NULL or point to their `struct_size` readable bytes.
 */
int32_t gib_vibration_start(struct gib_vibration *handle,
                            const struct gib_vibration_config *config,
                            const struct gib_calibration_table *table);

/**
 * One servo cycle. Call it in every cycle, also when idle: the position is then the plain scale.
 *
 * `position_mm` is what to use in place of the scale, for the position loop's feedback or for learning the command. It
 * never jumps on account of a sensor; `blend_ratio`, `reasons` and `message` say how far it is corrected and why not.
 *
 * @param handle the instance.
 * @param input measured values of this cycle, all of the same instant.
 * @param output the position; always written when not NULL.
 * @return GIB_OK when idle, GIB_BUSY, or the first error, which is kept until the next start: GIB_ERR_ABORTED,
 * GIB_ERR_DRIVE_FAULT, GIB_ERR_CONFIG (unknown `flags`), GIB_ERR_NON_FINITE when the scale is no number (the last position is repeated in such a cycle, and the correction fades);
 * and GIB_ERR_NULL, GIB_ERR_HANDLE of this call. Where `input` is NULL the last position is repeated, and `correction_um` is what is
 * in it.
 *
 * [thread: cycle] [real-time: yes] [state: any]
 *
 * # Safety
 * `handle` is NULL or an instance; `input` is NULL or readable; `output` is NULL or writable.
 */
int32_t gib_vibration_step(struct gib_vibration *handle,
                           const struct gib_vibration_input *input,
                           struct gib_vibration_output *output);

/**
 * Ends the correction: it fades out within `fade_s`, then the plain scale is in force and steps return GIB_ERR_ABORTED.
 * Does nothing when not busy. To abort from another thread set `GIB_INPUT_ABORT` in the input.
 *
 * @param handle the instance.
 * @return GIB_OK; GIB_ERR_NULL, GIB_ERR_HANDLE.
 *
 * [thread: cycle] [real-time: yes] [state: any]
 *
 * # Safety
 * `handle` is NULL or an instance.
 */
int32_t gib_vibration_abort(struct gib_vibration *handle);

/**
 * Reads what is known of the vibration now: harmonics, noise, offsets, how long the correction was out.
 *
 * @param handle the instance.
 * @param report receives it.
 * @return GIB_OK; GIB_ERR_NULL, GIB_ERR_HANDLE.
 *
 * [thread: cycle] [real-time: yes] [state: any]
 *
 * # Safety
 * `handle` is NULL or an instance; `report` is NULL or writable.
 */
int32_t gib_vibration_result(const struct gib_vibration *handle, struct gib_vibration_report *report);

/**
 * The first error of the present run, or why the last call was refused: code, field, value and bounds. A call refused with
 * GIB_ERR_STATE changes nothing here.
 *
 * @param handle the instance.
 * @param detail receives it; its `code` is GIB_OK when nothing went wrong.
 * @return GIB_OK; GIB_ERR_NULL, GIB_ERR_HANDLE.
 *
 * [thread: cycle] [real-time: yes] [state: any]
 *
 * # Safety
 * `handle` is NULL or an instance; `detail` is NULL or writable.
 */
int32_t gib_vibration_last_error(const struct gib_vibration *handle,
                                 struct gib_error_detail *detail);

#ifdef __cplusplus
} /* extern "C" */
#endif /* __cplusplus */

#endif  /* GIB_H */
