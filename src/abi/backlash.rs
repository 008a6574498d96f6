//! Family `backlash`: lost motion of one axis from motor torque, as seen from C.

use super::guard::{CONFIG, Instance, guarded, instance, instance_mut, kept, placed, versioned};
use super::types::GibErrorDetail;
use crate::cycle::backlash::config::BacklashConfig;
use crate::cycle::backlash::io::{BacklashInput, BacklashOutput, GIB_BACKLASH_FAILED};
use crate::cycle::backlash::machine::{Backlash, Wish};
use crate::cycle::backlash::plan::Plan;
use crate::cycle::backlash::verdict::{BacklashComparison, BacklashReport};
use crate::error::{Fault, GIB_ERR_BUFFER, GIB_ERR_CONFIG, GIB_ERR_HANDLE, GIB_ERR_NULL, GIB_OK};
use core::ffi::c_void;

/// Marks memory that holds an instance; its absence tells memory that never did, or does no more.
const ALIVE: u64 = 0x6769_625f_626c_0001;
/// The same, and nothing is under way, so that a step has only to say "stay".
const QUIET: u64 = 0x6769_625f_626c_0002;

/// A lost-motion measurement of one axis. Opaque; its size is `gib_backlash_size()`.
#[repr(C, align(16))]
pub struct GibBacklash {
    alive: u64,
    last: Fault,
    machine: Backlash,
}

impl Instance for GibBacklash {
    fn alive(&self) -> bool {
        self.alive == ALIVE || self.alive == QUIET
    }
    fn new() -> GibBacklash {
        GibBacklash { alive: QUIET, last: Fault::NONE, machine: Backlash::default() }
    }
    fn bury(&mut self) {
        self.alive = 0;
    }
}

impl GibBacklash {
    /// Renews the mark after the machine may have changed.
    #[inline(always)]
    fn mark(&mut self) {
        self.alive = if self.machine.quiet() { QUIET } else { ALIVE };
    }
}

/// Runs a call that can be refused, and keeps the reason for `_last_error`.
fn refusable(handle: &mut GibBacklash, call: impl FnOnce(&mut Backlash) -> Result<(), Fault>) -> i32 {
    let outcome = call(&mut handle.machine);
    handle.mark();
    kept(&mut handle.last, outcome)
}

/// Bytes that an instance needs in memory of your own, to be aligned to 16.
///
/// @return the size in bytes, about 107 KiB.
///
/// [thread: any] [real-time: yes] [state: any]
#[unsafe(no_mangle)]
pub extern "C" fn gib_backlash_size() -> usize {
    size_of::<GibBacklash>()
}

/// Makes an idle instance in memory of your own. There is nothing to free; zero or reuse the memory when done.
///
/// @param memory at least `gib_backlash_size()` bytes, aligned to 16; stays yours.
/// @param size bytes at `memory`.
/// @param out receives the handle; NULL on error.
/// @return GIB_OK; GIB_ERR_NULL; GIB_ERR_MEMORY when too small or misaligned.
///
/// [thread: setup] [real-time: no] [state: none]
///
/// # Safety
/// `memory` is NULL or points to `size` writable bytes; `out` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_backlash_init_in(memory: *mut c_void, size: usize, out: *mut *mut GibBacklash) -> i32 {
    // SAFETY: the caller's promise is `placed`'s.
    guarded(|| unsafe { placed(memory, size, out) })
}

/// Makes an idle instance in memory that gib allocates.
///
/// @return the handle, to be given to `gib_backlash_free`; NULL when there is no memory.
///
/// [thread: setup] [real-time: no] [state: none]
#[unsafe(no_mangle)]
pub extern "C" fn gib_backlash_new() -> *mut GibBacklash {
    super::guard::allocated()
}

/// Frees an instance made by `gib_backlash_new`. NULL is allowed and does nothing.
///
/// Abort a running measurement and step it to its end first: memory that is gone can restore nothing.
///
/// @param handle an instance from `gib_backlash_new`, never one from `gib_backlash_init_in`.
///
/// [thread: setup] [real-time: no] [state: not busy]
///
/// # Safety
/// `handle` is NULL or came from `gib_backlash_new` and was not freed before.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_backlash_free(handle: *mut GibBacklash) {
    // SAFETY: the caller's promise is `release`'s.
    unsafe { super::guard::release(handle) }
}

/// Checks the configuration and arms a measurement, which begins with the next step.
///
/// The rising edge of PLCopen's Execute. Clears the previous result and error. The old compensation amount is read
/// from `compensation_um` of the first step's input.
///
/// @param handle the instance.
/// @param config what to measure; copied. Set `struct_size`, zero the rest, then set what you want.
/// @return GIB_OK; GIB_ERR_CONFIG (gib_backlash_last_error names the field and its range), GIB_ERR_STRUCT_SIZE,
/// GIB_ERR_STATE while busy, GIB_ERR_DISABLED, GIB_ERR_RESTORE_UNCONFIRMED while a restore is still owed,
/// GIB_ERR_NULL, GIB_ERR_HANDLE.
///
/// [thread: setup, or cycle between steps] [real-time: yes] [state: not busy]
///
/// # Safety
/// `handle` is NULL or an instance; `config` is NULL or points to its `struct_size` readable bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_backlash_start(handle: *mut GibBacklash, config: *const BacklashConfig) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let handle = unsafe { instance_mut(handle) }?;
        // SAFETY: the caller's promise; the config is plain numbers.
        let config = unsafe { versioned(CONFIG, config, BacklashConfig::FIRST_SIZE) };
        Ok(refusable(handle, |machine| machine.start(config.and_then(|config| Plan::new(&config)))))
    })
}

/// One servo cycle. Call it in every cycle, also when idle: requests are made and restored through it.
///
/// While `owns_motion` is 1, follow `target_position_mm` and report the motor's position and torque of the same
/// instant. When `request_id` changes, put `compensation_um` and `reversal_acceleration_off` in force and report the
/// number in `acknowledged_id` and the amount in force in `compensation_um`, within half a `compensation_resolution_um` of the one asked for.
///
/// A fault is named in `message` in the cycle in which it is found. In that cycle the command already brakes from its own last
/// speed, no harder than `acceleration_mm_s2`, whatever is measured; with GIB_INPUT_FAULT, when the axis follows no command, it stays
/// where it is. Then everything changed is restored; while that goes on the status is GIB_BUSY, and only then the error.
///
/// @param handle the instance.
/// @param input measured values of this cycle.
/// @param output commands for this cycle; always written when not NULL.
/// @return GIB_OK when idle, GIB_BUSY, GIB_DONE, or the first error, which is kept until the next start; carrying out
/// `gib_backlash_restore` or `_enable` takes its place, and `gib_backlash_last_error` and the report still tell it:
/// GIB_ERR_ABORTED, GIB_ERR_NON_FINITE, GIB_ERR_DRIVE_FAULT, GIB_ERR_ACK_TIMEOUT, GIB_ERR_TORQUE_BOUND,
/// GIB_ERR_TRAVEL_BOUND, GIB_ERR_DEADLINE, GIB_ERR_LAG, GIB_ERR_CONFIG, GIB_ERR_DISABLED, GIB_ERR_BACKLASH_...;
/// and GIB_ERR_NULL, GIB_ERR_HANDLE of this call. GIB_ERR_CONFIG is also that of unknown `flags`. Where `input` is NULL a measurement
/// under way ends as by any other fault: it brakes from this cycle on, and GIB_ERR_NULL is kept. Where `output` is NULL nothing is done.
///
/// [thread: cycle] [real-time: yes] [state: any]
///
/// # Safety
/// `handle` is NULL or an instance; `input` is NULL or readable; `output` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_backlash_step(
    handle: *mut GibBacklash,
    input: *const BacklashInput,
    output: *mut BacklashOutput,
) -> i32 {
    if handle.is_null() || input.is_null() || output.is_null() {
        // SAFETY: the caller promises each is NULL or valid.
        return unsafe { misused(handle, input, output) };
    }
    // SAFETY: as above, and none is NULL.
    let (handle, input, output) = unsafe { (&mut *handle, &*input, &mut *output) };
    // The cheap cycle, in which an axis spends its life. `x * 0` is NaN for NaN and infinity.
    if handle.alive == QUIET && !(input.position_mm * 0.0).is_nan() {
        *output = *handle.machine.rest_at(input.position_mm);
        return handle.machine.output().status;
    }
    step(handle, input, output)
}

/// A cycle in which something is under way. `extern "C"`: it cannot unwind, so that it is called by a jump.
#[inline(never)]
extern "C" fn step(handle: &mut GibBacklash, input: &BacklashInput, output: &mut BacklashOutput) -> i32 {
    if handle.alive == ALIVE && handle.machine.quick(input) {
        *output = *handle.machine.output();
        return handle.machine.output().status;
    }
    step_in_full(handle, input, output)
}

/// Any cycle, or one of no living instance.
#[inline(never)]
extern "C" fn step_in_full(handle: &mut GibBacklash, input: &BacklashInput, output: &mut BacklashOutput) -> i32 {
    if !handle.alive() {
        // SAFETY: all three are references.
        return unsafe { misused(handle, input, output) };
    }
    *output = *handle.machine.step(input);
    handle.mark();
    output.status
}

/// A step without an instance, an input or an output. Without an input what is under way ends; without an output, which is how
/// the axis is commanded, nothing is done.
///
/// # Safety
/// Each is NULL or valid.
#[cold]
unsafe extern "C" fn misused(
    handle: *mut GibBacklash,
    input: *const BacklashInput,
    output: *mut BacklashOutput,
) -> i32 {
    // SAFETY: the caller's promise.
    let (handle, input, output) = unsafe { (handle.as_mut(), input.as_ref(), output.as_mut()) };
    let status = match &handle {
        Some(handle) if !handle.alive() => GIB_ERR_HANDLE,
        _ => GIB_ERR_NULL,
    };
    let position = input.map_or(0.0, |input| input.position_mm);
    if let Some(output) = output {
        *output = match handle {
            Some(handle) if handle.alive() => {
                if input.is_none() {
                    handle.machine.miss();
                    handle.mark();
                }
                *handle.machine.output()
            }
            _ => BacklashOutput {
                target_position_mm: if position.is_finite() { position } else { 0.0 },
                phase: GIB_BACKLASH_FAILED,
                ..BacklashOutput::default()
            },
        };
        output.status = status;
        output.message = status;
    }
    status
}

/// Aborts a running measurement: the next steps brake, restore the old amount and reversal acceleration, and end
/// with GIB_ERR_ABORTED. Does nothing when not busy. To abort from another thread set `GIB_INPUT_ABORT` in the input.
///
/// @param handle the instance.
/// @return GIB_OK; GIB_ERR_NULL, GIB_ERR_HANDLE.
///
/// [thread: cycle] [real-time: yes] [state: any]
///
/// # Safety
/// `handle` is NULL or an instance.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_backlash_abort(handle: *mut GibBacklash) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let handle = unsafe { instance_mut(handle) }?;
        handle.machine.abort();
        handle.mark();
        Ok(GIB_OK)
    })
}

/// Asks for the amount that was in force before the last written one: the operator's "restore original".
/// Keep stepping until the status is GIB_OK again.
///
/// @param handle the instance.
/// @return GIB_OK; GIB_ERR_STATE while busy, switched off, or when nothing was written; GIB_ERR_NULL, GIB_ERR_HANDLE.
///
/// [thread: cycle] [real-time: yes] [state: not busy]
///
/// # Safety
/// `handle` is NULL or an instance.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_backlash_restore(handle: *mut GibBacklash) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        Ok(refusable(unsafe { instance_mut(handle) }?, |machine| machine.wish(Wish::RestoreOld)))
    })
}

/// Switches automatic measuring and compensation on or off. Off: a running measurement is aborted and restored, then
/// the compensation amount is taken out (0) and starts are refused. On: the amount comes back, starts are allowed.
///
/// @param handle the instance.
/// @param on 1 or 0.
/// @return GIB_OK; GIB_ERR_STATE when it is so already or the last switching is not yet confirmed; GIB_ERR_CONFIG
/// for another value of `on`; GIB_ERR_NULL, GIB_ERR_HANDLE.
///
/// [thread: cycle] [real-time: yes] [state: any]
///
/// # Safety
/// `handle` is NULL or an instance.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_backlash_enable(handle: *mut GibBacklash, on: i32) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let handle = unsafe { instance_mut(handle) }?;
        Ok(refusable(handle, |machine| match on {
            0 => machine.wish(Wish::Disable),
            1 => machine.wish(Wish::Enable),
            _ => Err(Fault { code: GIB_ERR_CONFIG, field: "on\0", value: f64::from(on), low: 0.0, high: 1.0 }),
        }))
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
pub unsafe extern "C" fn gib_backlash_result(handle: *const GibBacklash, report: *mut BacklashReport) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let handle = unsafe { instance(handle) }?;
        // SAFETY: the caller's promise.
        let report = unsafe { report.as_mut() }.ok_or(GIB_ERR_NULL)?;
        *report = handle.machine.report();
        Ok(GIB_OK)
    })
}

/// Reads the torque curve of the last reversal of a sense, for a graph.
///
/// @param handle the instance.
/// @param sense 0: after motion in the first direction; 1: after motion in the other.
/// @param travel_um receives the motor's travel since the reversal, µm, rising.
/// @param torque_nm receives the torque, N·m, positive in the sense of the scan.
/// @param capacity points that both arrays can hold; 1024 always suffices.
/// @param count receives the number of points written, or needed when GIB_ERR_BUFFER is returned.
/// @return GIB_OK; GIB_ERR_BUFFER; GIB_ERR_CONFIG for another sense; GIB_ERR_NULL, GIB_ERR_HANDLE.
///
/// [thread: cycle] [real-time: no] [state: any]
///
/// # Safety
/// `handle` is NULL or an instance; the arrays are NULL or hold `capacity` numbers; `count` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_backlash_curve(
    handle: *const GibBacklash,
    sense: i32,
    travel_um: *mut f64,
    torque_nm: *mut f64,
    capacity: usize,
    count: *mut usize,
) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let (handle, count) = unsafe { (instance(handle)?, count.as_mut().ok_or(GIB_ERR_NULL)?) };
        let points = usize::try_from(sense).ok().and_then(|sense| handle.machine.curve(sense)).ok_or(GIB_ERR_CONFIG)?;
        *count = points.clone().count();
        if *count > capacity {
            return Err(GIB_ERR_BUFFER);
        }
        if travel_um.is_null() || torque_nm.is_null() {
            return Err(GIB_ERR_NULL);
        }
        for (i, (travel, torque)) in points.enumerate() {
            // SAFETY: i < count ≤ capacity.
            unsafe {
                travel_um.add(i).write(travel);
                torque_nm.add(i).write(torque);
            }
        }
        Ok(GIB_OK)
    })
}

/// Compares the estimate with a value measured otherwise, for instance the reversal value of ISO 230-2.
///
/// The two are not the same quantity: ISO 230-2 measures positions at standstill, see `standstill_um`.
///
/// @param handle the instance, after a result.
/// @param measured_um the measured value, µm.
/// @param uncertainty_um its expanded uncertainty (k = 2), µm, 0 or more.
/// @param comparison receives the differences.
/// @return GIB_OK; GIB_ERR_STATE before a result; GIB_ERR_CONFIG for values that are not finite or negative;
/// GIB_ERR_NULL, GIB_ERR_HANDLE.
///
/// [thread: cycle] [real-time: yes] [state: after a result]
///
/// # Safety
/// `handle` is NULL or an instance; `comparison` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_backlash_compare(
    handle: *mut GibBacklash,
    measured_um: f64,
    uncertainty_um: f64,
    comparison: *mut BacklashComparison,
) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let (handle, comparison) = unsafe { (instance_mut(handle)?, comparison.as_mut().ok_or(GIB_ERR_NULL)?) };
        Ok(refusable(handle, |machine| {
            *comparison = machine.report().compare(measured_um, uncertainty_um)?;
            Ok(())
        }))
    })
}

/// The first error of the present run, kept until the next start, or why the last call was refused: code, field, value and the
/// bounds that it lies outside of. The field is one of the configuration or of the input, or says what was found (`_ratio`, `_share`
/// and others by their unit). A call refused with GIB_ERR_STATE changes nothing here.
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
pub unsafe extern "C" fn gib_backlash_last_error(handle: *const GibBacklash, detail: *mut GibErrorDetail) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let (handle, detail) = unsafe { (instance(handle)?, detail.as_mut().ok_or(GIB_ERR_NULL)?) };
        let fault = if handle.last == Fault::NONE { handle.machine.fault() } else { handle.last };
        *detail = fault.into();
        Ok(GIB_OK)
    })
}
