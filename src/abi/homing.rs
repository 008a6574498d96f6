//! Family `homing`: homing on a dead stop by torque limit, as seen from C.

use super::guard::{CONFIG, Instance, guarded, instance, instance_mut, kept, placed, versioned};
use super::types::GibErrorDetail;
use crate::cycle::homing::config::HomingConfig;
use crate::cycle::homing::io::{GIB_HOMING_FAILED, HomingInput, HomingOutput};
use crate::cycle::homing::machine::Homing;
use crate::cycle::homing::plan::Plan;
use crate::cycle::homing::verdict::HomingReport;
use crate::error::{Fault, GIB_ERR_HANDLE, GIB_ERR_NULL, GIB_OK};
use core::ffi::c_void;

/// Marks memory that holds an instance; its absence tells memory that never did, or does no more.
const ALIVE: u32 = 0x6769_6821;
/// The same for an instance at work on two motors.
const BOTH: u32 = 0x6769_6822;
/// The same for an instance that has nothing to do but to follow the axis.
const QUIET: u32 = 0x6769_6823;
/// The same for an instance whose motor rests while a touch is evaluated.
const RESTING: u32 = 0x6769_6824;
/// The same of two motors.
const RESTING_BOTH: u32 = 0x6769_6825;

/// Homing of one axis, of one motor or two. Opaque; its size is `gib_homing_size()`.
#[repr(C, align(16))]
pub struct GibHoming {
    alive: u32,
    last: Fault,
    machine: Homing,
}

impl Instance for GibHoming {
    fn alive(&self) -> bool {
        [ALIVE, BOTH, QUIET, RESTING, RESTING_BOTH].contains(&self.alive)
    }
    fn new() -> GibHoming {
        GibHoming { alive: QUIET, last: Fault::NONE, machine: Homing::default() }
    }
    fn bury(&mut self) {
        self.alive = 0;
    }
}

impl GibHoming {
    /// Renews the mark after the machine may have changed.
    #[inline(always)]
    fn mark(&mut self) {
        self.alive = match () {
            () if self.machine.quiet() => QUIET,
            () if self.machine.rests() && self.machine.gantry() => RESTING_BOTH,
            () if self.machine.rests() => RESTING,
            () if self.machine.gantry() => BOTH,
            () => ALIVE,
        };
    }
}

/// Runs a call that can be refused, and keeps the reason for `_last_error`.
fn refusable(handle: &mut GibHoming, call: impl FnOnce(&mut Homing) -> Result<(), Fault>) -> i32 {
    let outcome = call(&mut handle.machine);
    handle.mark();
    kept(&mut handle.last, outcome)
}

/// Bytes that an instance needs in memory of your own, to be aligned to 16.
///
/// @return the size in bytes, about 78 KiB.
///
/// [thread: any] [real-time: yes] [state: any]
#[unsafe(no_mangle)]
pub extern "C" fn gib_homing_size() -> usize {
    size_of::<GibHoming>()
}

/// Makes an idle instance in memory of your own. There is nothing to free; zero or reuse the memory when done.
///
/// @param memory at least `gib_homing_size()` bytes, aligned to 16; stays yours.
/// @param size bytes at `memory`.
/// @param out receives the handle; NULL on error.
/// @return GIB_OK; GIB_ERR_NULL; GIB_ERR_MEMORY when too small or misaligned.
///
/// [thread: setup] [real-time: no] [state: none]
///
/// # Safety
/// `memory` is NULL or points to `size` writable bytes; `out` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_homing_init_in(memory: *mut c_void, size: usize, out: *mut *mut GibHoming) -> i32 {
    // SAFETY: the caller's promise is `placed`'s.
    guarded(|| unsafe { placed(memory, size, out) })
}

/// Makes an idle instance in memory that gib allocates.
///
/// @return the handle, to be given to `gib_homing_free`; NULL when there is no memory.
///
/// [thread: setup] [real-time: no] [state: none]
#[unsafe(no_mangle)]
pub extern "C" fn gib_homing_new() -> *mut GibHoming {
    super::guard::allocated()
}

/// Frees an instance made by `gib_homing_new`. NULL is allowed and does nothing.
///
/// Abort a running homing and step it to its end first: memory that is gone can restore nothing.
///
/// @param handle an instance from `gib_homing_new`, never one from `gib_homing_init_in`.
///
/// [thread: setup] [real-time: no] [state: not busy]
///
/// # Safety
/// `handle` is NULL or came from `gib_homing_new` and was not freed before.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_homing_free(handle: *mut GibHoming) {
    // SAFETY: the caller's promise is `release`'s.
    unsafe { super::guard::release(handle) }
}

/// Checks the configuration and arms a homing, which begins with the next step.
///
/// The rising edge of PLCopen's Execute. Clears the previous result and error. The old torque limit is read from
/// `torque_limit` of the first step's input.
///
/// @param handle the instance.
/// @param config how to home; copied. Set `struct_size`, zero the rest, then set what you want.
/// @return GIB_OK; GIB_ERR_CONFIG (gib_homing_last_error names the field and its range), GIB_ERR_STRUCT_SIZE,
/// GIB_ERR_STATE while busy, GIB_ERR_RESTORE_UNCONFIRMED while the old torque limit is still owed,
/// GIB_ERR_NULL, GIB_ERR_HANDLE.
///
/// [thread: setup, or cycle between steps] [real-time: yes] [state: not busy]
///
/// # Safety
/// `handle` is NULL or an instance; `config` is NULL or points to its `struct_size` readable bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_homing_start(handle: *mut GibHoming, config: *const HomingConfig) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let handle = unsafe { instance_mut(handle) }?;
        // SAFETY: the caller's promise; the config is plain numbers.
        let config = unsafe { versioned(CONFIG, config, HomingConfig::FIRST_SIZE) };
        Ok(refusable(handle, |machine| machine.start(config.and_then(|config| Plan::new(&config)))))
    })
}

/// One servo cycle. Call it in every cycle, also when idle: requests are made and restored through it.
///
/// While `owns_motion` is 1, follow `target_position_mm` and report each motor's position and torque of the same
/// instant. When `request_id` changes, carry out `requests`, then report the number in `acknowledged_id`, and in
/// `torque_limit` the limit in force. Take the torque off the motors while `stop_drive` is 1: that is at once where the torque is more
/// than the limit allows (GIB_ERR_TORQUE_BOUND), since a drive that does not keep to it would press on while it brakes.
///
/// A fault is named in `message` in the cycle in which it is found. From that cycle on gib brakes from the speed commanded last, no
/// harder than `acceleration_mm_s2`, unless it stops the drive; then it goes back from what is pressed on, and gives the
/// old torque limit back; while that goes on the status is GIB_BUSY, and only then the error. It takes at most, in seconds:
/// 5·(speed + approach speed) ÷ acceleration, (lag limit + `press_max_mm`) ÷ approach speed, four detection times and twice
/// `ack_timeout_s`, together.
///
/// @param handle the instance.
/// @param input measured values of this cycle.
/// @param output commands for this cycle; always written when not NULL.
/// @return GIB_OK when idle, GIB_BUSY, GIB_DONE, or the first error, which is kept until the next start:
/// GIB_ERR_ABORTED, GIB_ERR_NON_FINITE, GIB_ERR_DRIVE_FAULT, GIB_ERR_ACK_TIMEOUT, GIB_ERR_TORQUE_BOUND,
/// GIB_ERR_TRAVEL_BOUND, GIB_ERR_DEADLINE, GIB_ERR_LAG, GIB_ERR_HOMING_...;
/// GIB_ERR_CONFIG (unknown `flags`); and GIB_ERR_NULL, GIB_ERR_HANDLE of this call. Where `input` is NULL a homing under way ends as
/// by any other fault: it brakes from this cycle on, what needs a reading waits for one, and GIB_ERR_NULL is kept. Where `output` is
/// NULL nothing is done.
///
/// [thread: cycle] [real-time: yes] [state: any]
///
/// # Safety
/// `handle` is NULL or an instance; `input` is NULL or readable; `output` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_homing_step(
    handle: *mut GibHoming,
    input: *const HomingInput,
    output: *mut HomingOutput,
) -> i32 {
    if handle.is_null() || input.is_null() || output.is_null() {
        // SAFETY: the caller promises each is NULL or valid.
        return unsafe { misused(handle.as_mut(), input.as_ref(), output.as_mut()) };
    }
    // SAFETY: as above, and none is NULL.
    let (handle, input, output) = unsafe { (&mut *handle, &*input, &mut *output) };
    // The cheap cycles, in which an axis spends its life.
    match handle.alive {
        ALIVE if handle.machine.quick(input) => {}
        ALIVE => return step_unlike(handle, input, output),
        BOTH => return step_both(handle, input, output),
        QUIET if placed_well(input) => {
            *output = *handle.machine.output();
            output.target_position_mm = input.position_mm;
            return output.status;
        }
        _ => return step_from_rest(handle, input, output),
    }
    *output = *handle.machine.output();
    output.status
}

/// Whether the positions are numbers.
#[inline(always)]
#[expect(clippy::eq_op, reason = "NaN for NaN and infinity, in the fewest instructions")]
fn placed_well(input: &HomingInput) -> bool {
    let [first, second] = input.position_mm;
    let sum = first + second;
    !(sum - sum).is_nan()
}

/// A cycle at work on two motors. `extern "C"` as below.
#[inline(never)]
extern "C" fn step_both(handle: &mut GibHoming, input: &HomingInput, output: &mut HomingOutput) -> i32 {
    if !handle.machine.quick_both(input, output) {
        return both_unlike(handle, input, output);
    }
    output.status
}

/// One that is not like the one before.
#[inline(never)]
extern "C" fn both_unlike(handle: &mut GibHoming, input: &HomingInput, output: &mut HomingOutput) -> i32 {
    if !handle.machine.quick_both_slow(input, output) {
        return step_whole(handle, input, output);
    }
    output.status
}

/// A cycle of an axis that rests while its touch is evaluated.
#[inline(never)]
extern "C" fn step_at_rest<const MOTORS: usize>(
    handle: &mut GibHoming,
    input: &HomingInput,
    output: &mut HomingOutput,
) -> i32 {
    if !handle.machine.quick_at_rest::<MOTORS>(input) {
        return step_whole(handle, input, output);
    }
    if handle.machine.works() {
        return work_at_rest(handle, output);
    }
    *output = *handle.machine.output();
    output.status
}

/// What is to be done in one.
#[inline(never)]
extern "C" fn work_at_rest(handle: &mut GibHoming, output: &mut HomingOutput) -> i32 {
    handle.machine.work_at_rest();
    *output = *handle.machine.output();
    output.status
}

/// A cycle of which nothing is usual.
#[inline(never)]
extern "C" fn step_whole(handle: &mut GibHoming, input: &HomingInput, output: &mut HomingOutput) -> i32 {
    handle.machine.step(input);
    handle.mark();
    *output = *handle.machine.output();
    output.status
}

/// A cycle at work that is not like the one before. `extern "C"`: it cannot unwind, so that it is called by a jump.
#[inline(never)]
extern "C" fn step_unlike(handle: &mut GibHoming, input: &HomingInput, output: &mut HomingOutput) -> i32 {
    if !handle.machine.quick_slow(input) {
        return step_whole(handle, input, output);
    }
    *output = *handle.machine.output();
    output.status
}

/// A cycle of an instance that has nothing to do, whose motors rest, or of no living one. `extern "C"` as above.
#[inline(never)]
extern "C" fn step_from_rest(handle: &mut GibHoming, input: &HomingInput, output: &mut HomingOutput) -> i32 {
    match handle.alive {
        RESTING => return step_at_rest::<1>(handle, input, output),
        RESTING_BOTH => return step_at_rest::<2>(handle, input, output),
        _ => {}
    }
    if !handle.alive() {
        return misused(Some(handle), Some(input), Some(output));
    }
    step_whole(handle, input, output)
}

/// A step without an instance, an input or an output. Without an input what is under way ends; without an output, which is how
/// the axis is commanded, nothing is done.
#[cold]
fn misused(handle: Option<&mut GibHoming>, input: Option<&HomingInput>, output: Option<&mut HomingOutput>) -> i32 {
    let dead = handle.as_ref().is_some_and(|handle| !handle.alive());
    let living = handle.filter(|_| !dead);
    let status = if dead { GIB_ERR_HANDLE } else { GIB_ERR_NULL };
    let place = |position: f64| if position.is_finite() { position } else { 0.0 };
    let target_position_mm = input.map_or([0.0; 2], |input| input.position_mm.map(place));
    if let Some(output) = output {
        *output = match living {
            Some(handle) => {
                if input.is_none() {
                    handle.machine.miss();
                    handle.mark();
                }
                *handle.machine.output()
            }
            None => HomingOutput { target_position_mm, phase: GIB_HOMING_FAILED, ..HomingOutput::default() },
        };
        output.new_events = 0;
        output.status = status;
        output.message = status;
    }
    status
}

/// Aborts a running homing: the next steps brake, take the pressure off the stop, restore the old torque limit, and
/// end with GIB_ERR_ABORTED. Does nothing when not busy. To abort from another thread set `GIB_INPUT_ABORT` in the input.
///
/// @param handle the instance.
/// @return GIB_OK; GIB_ERR_NULL, GIB_ERR_HANDLE.
///
/// [thread: cycle] [real-time: yes] [state: any]
///
/// # Safety
/// `handle` is NULL or an instance.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_homing_abort(handle: *mut GibHoming) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let handle = unsafe { instance_mut(handle) }?;
        handle.machine.abort();
        handle.mark();
        Ok(GIB_OK)
    })
}

/// Reads what was found: complete after GIB_DONE, else what is known so far.
///
/// @param handle the instance.
/// @param report receives it.
/// @return GIB_OK; GIB_ERR_NULL, GIB_ERR_HANDLE.
///
/// [thread: cycle] [real-time: yes] [state: any]
///
/// # Safety
/// `handle` is NULL or an instance; `report` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_homing_result(handle: *const GibHoming, report: *mut HomingReport) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let handle = unsafe { instance(handle) }?;
        // SAFETY: the caller's promise.
        let report = unsafe { report.as_mut() }.ok_or(GIB_ERR_NULL)?;
        *report = handle.machine.report();
        Ok(GIB_OK)
    })
}

/// The first error of the present run, or why the last start was refused: code, field, value and bounds. A start refused
/// with GIB_ERR_STATE, while a homing runs, changes nothing here.
///
/// @param handle the instance.
/// @param detail receives it; its `code` is GIB_OK when nothing went wrong.
/// @return GIB_OK; GIB_ERR_NULL, GIB_ERR_HANDLE.
///
/// [thread: cycle] [real-time: yes] [state: any]
///
/// # Safety
/// `handle` is NULL or an instance; `detail` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_homing_last_error(handle: *const GibHoming, detail: *mut GibErrorDetail) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let (handle, detail) = unsafe { (instance(handle)?, detail.as_mut().ok_or(GIB_ERR_NULL)?) };
        let fault = if handle.last == Fault::NONE { handle.machine.fault() } else { handle.last };
        *detail = fault.into();
        Ok(GIB_OK)
    })
}
