//! Family `calibration`: accelerometers against a ball bar, as seen from C.

use super::guard::{CONFIG, guarded, instance, instance_mut, kept, placed, versioned};
use super::text::path_of;
use super::types::GibErrorDetail;
use crate::cycle::calibration::config::CalibrationConfig;
use crate::cycle::calibration::io::{CalibrationInput, CalibrationOutput, GIB_CALIBRATION_FAILED};
use crate::cycle::calibration::machine::Calibration;
use crate::cycle::calibration::plan::Plan;
use crate::cycle::calibration::table::CalibrationTable;
use crate::error::{Fault, GIB_ERR_HANDLE, GIB_ERR_NULL, GIB_ERR_STATE, GIB_ERR_STRUCT_SIZE, GIB_OK};
use crate::machine::calibration;
use core::ffi::{c_char, c_void};

/// Marks memory that holds an instance; its absence tells memory that never did, or does no more.
const ALIVE: u64 = 0x6769_625f_6361_0001;

/// A calibration of two accelerometers. Opaque; its size is `gib_calibration_size()`.
#[repr(C, align(16))]
pub struct GibCalibration {
    alive: u64,
    last: Fault,
    machine: Calibration,
}

impl super::guard::Instance for GibCalibration {
    fn alive(&self) -> bool {
        self.alive == ALIVE
    }
    fn new() -> GibCalibration {
        GibCalibration { alive: ALIVE, last: Fault::NONE, machine: Calibration::default() }
    }
    fn bury(&mut self) {
        self.alive = 0;
    }
}

/// Bytes that an instance needs in memory of your own, to be aligned to 16.
///
/// @return the size in bytes, about 22 KiB.
///
/// [thread: any] [real-time: yes] [state: any]
#[unsafe(no_mangle)]
pub extern "C" fn gib_calibration_size() -> usize {
    size_of::<GibCalibration>()
}

/// Makes an idle instance in memory of your own. There is nothing to free; zero or reuse the memory when done.
///
/// @param memory at least `gib_calibration_size()` bytes, aligned to 16; stays yours.
/// @param size bytes at `memory`.
/// @param out receives the handle; NULL on error.
/// @return GIB_OK; GIB_ERR_NULL; GIB_ERR_MEMORY when too small or misaligned.
///
/// [thread: setup] [real-time: no] [state: none]
///
/// # Safety
/// `memory` is NULL or points to `size` writable bytes; `out` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_calibration_init_in(
    memory: *mut c_void,
    size: usize,
    out: *mut *mut GibCalibration,
) -> i32 {
    // SAFETY: the caller's promise is `placed`'s.
    guarded(|| unsafe { placed(memory, size, out) })
}

/// Makes an idle instance in memory that gib allocates.
///
/// @return the handle, to be given to `gib_calibration_free`; NULL when there is no memory.
///
/// [thread: setup] [real-time: no] [state: none]
#[unsafe(no_mangle)]
pub extern "C" fn gib_calibration_new() -> *mut GibCalibration {
    super::guard::allocated()
}

/// Frees an instance made by `gib_calibration_new`. NULL is allowed and does nothing.
///
/// @param handle an instance from `gib_calibration_new`, never one from `gib_calibration_init_in`.
///
/// [thread: setup] [real-time: no] [state: not busy]
///
/// # Safety
/// `handle` is NULL or came from `gib_calibration_new` and was not freed before.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_calibration_free(handle: *mut GibCalibration) {
    // SAFETY: the caller's promise is `release`'s.
    unsafe { super::guard::release(handle) }
}

/// Checks the configuration and arms a calibration, which begins with the next step.
///
/// The axis swings about where it stands, at one frequency after the other. With `add` the experiment joins those that
/// this instance holds: change the workpiece's mass or the place in between, so that seat and bearing swing otherwise.
///
/// @param handle the instance.
/// @param config how to calibrate; copied. Set `struct_size`, zero the rest, then set what you want.
/// @return GIB_OK; GIB_ERR_CONFIG (gib_calibration_last_error names the field and its range), GIB_ERR_STRUCT_SIZE,
/// GIB_ERR_STATE while busy, GIB_ERR_CALIBRATION_ADD, GIB_ERR_NULL, GIB_ERR_HANDLE.
///
/// [thread: setup, or cycle between steps] [real-time: yes] [state: not busy]
///
/// # Safety
/// `handle` is NULL or an instance; `config` is NULL or points to its `struct_size` readable bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_calibration_start(handle: *mut GibCalibration, config: *const CalibrationConfig) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let handle = unsafe { instance_mut(handle) }?;
        // SAFETY: the caller's promise; the config is plain numbers.
        let config = unsafe { versioned(CONFIG, config, CalibrationConfig::FIRST_SIZE) };
        let outcome = handle.machine.start(config.and_then(|config| Plan::new(&config)));
        Ok(kept(&mut handle.last, outcome))
    })
}

/// One servo cycle. Call it in every cycle, also when idle.
///
/// While `owns_motion` is 1, follow `target_position_mm`. Whatever ends it, the amplitude falls to nothing first and the
/// axis is where it stood, except after a drive fault, or when position or lag cannot be trusted: then nothing is
/// commanded any more, and `stop_drive` says when to take the torque off.
///
/// @param handle the instance.
/// @param input measured values of this cycle, all of the same instant.
/// @param output commands for this cycle; always written when not NULL.
/// @return GIB_OK when idle, GIB_BUSY, GIB_DONE, or the first error, which is kept until the next start:
/// GIB_ERR_ABORTED, GIB_ERR_NON_FINITE, GIB_ERR_DRIVE_FAULT, GIB_ERR_TORQUE_BOUND, GIB_ERR_TRAVEL_BOUND, GIB_ERR_LAG,
/// GIB_ERR_CALIBRATION_..., GIB_ERR_CONFIG (unknown `flags`); and GIB_ERR_NULL, GIB_ERR_HANDLE of this call. Where `input` is NULL a
/// calibration under way ends as by any other fault: the amplitude falls from this cycle on, steps return GIB_BUSY meanwhile, then
/// GIB_ERR_NULL. Where `output` is NULL nothing is done.
///
/// [thread: cycle] [real-time: yes] [state: any]
///
/// # Safety
/// `handle` is NULL or an instance; `input` is NULL or readable; `output` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_calibration_step(
    handle: *mut GibCalibration,
    input: *const CalibrationInput,
    output: *mut CalibrationOutput,
) -> i32 {
    // SAFETY: the caller promises each is NULL or valid.
    let (handle, input, output) = unsafe { (handle.as_mut(), input.as_ref(), output.as_mut()) };
    match (handle, input, output) {
        (Some(handle), Some(input), Some(output)) if handle.alive == ALIVE => {
            handle.machine.step(input);
            *output = *handle.machine.output();
            output.status
        }
        (handle, input, output) => misused(handle, input, output),
    }
}

/// A step without an instance, an input or an output. Without an input what is under way ends; without an output, which is how
/// the axis is commanded, nothing is done.
#[cold]
fn misused(
    handle: Option<&mut GibCalibration>,
    input: Option<&CalibrationInput>,
    output: Option<&mut CalibrationOutput>,
) -> i32 {
    let dead = handle.as_ref().is_some_and(|handle| handle.alive != ALIVE);
    let living = handle.filter(|_| !dead);
    let status = if dead { GIB_ERR_HANDLE } else { GIB_ERR_NULL };
    let place = input.map(|input| input.position_mm).filter(|position| position.is_finite()).unwrap_or(0.0);
    let stand = CalibrationOutput { target_position_mm: place, phase: GIB_CALIBRATION_FAILED, ..Default::default() };
    if let Some(output) = output {
        *output = living.map_or(stand, |handle| {
            if input.is_none() {
                handle.machine.miss();
            }
            *handle.machine.output()
        });
        output.status = status;
        output.message = status;
    }
    status
}

/// Ends a running calibration: the amplitude falls to nothing, then steps return GIB_ERR_ABORTED. Does nothing when not
/// busy. To abort from another thread set `GIB_INPUT_ABORT` in the input.
///
/// @param handle the instance.
/// @return GIB_OK; GIB_ERR_NULL, GIB_ERR_HANDLE.
///
/// [thread: cycle] [real-time: yes] [state: any]
///
/// # Safety
/// `handle` is NULL or an instance.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_calibration_abort(handle: *mut GibCalibration) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        unsafe { instance_mut(handle) }?.machine.abort();
        Ok(GIB_OK)
    })
}

/// Reads gains and phases over frequency, with their uncertainty and condition: after GIB_DONE, or after a load.
///
/// @param handle the instance.
/// @param table receives it; set its `struct_size` first.
/// @return GIB_OK; GIB_ERR_STATE when there is none, GIB_ERR_STRUCT_SIZE when `table` is too small, GIB_ERR_NULL,
/// GIB_ERR_HANDLE.
///
/// [thread: cycle] [real-time: yes] [state: not busy]
///
/// # Safety
/// `handle` is NULL or an instance; `table` is NULL or points to its `struct_size` writable bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_calibration_result(handle: *const GibCalibration, table: *mut CalibrationTable) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let handle = unsafe { instance(handle) }?;
        if table.is_null() {
            return Err(GIB_ERR_NULL);
        }
        // SAFETY: not NULL; the caller promises at least the first four bytes, and as many as they say.
        if unsafe { table.cast::<u32>().read_unaligned() } as usize >= size_of::<CalibrationTable>() {
            let known = handle.machine.table().ok_or(GIB_ERR_STATE)?;
            // SAFETY: as large as it says.
            unsafe { table.write_unaligned(*known) };
            return Ok(GIB_OK);
        }
        Err(GIB_ERR_STRUCT_SIZE)
    })
}

/// Writes gains and phases to a file, JSON with schema "gib.calibration/1". An old file is replaced whole or not at all.
///
/// @param handle the instance.
/// @param path NUL-terminated; stays yours.
/// @return GIB_OK; GIB_ERR_STATE when there is no table, GIB_ERR_IO, GIB_ERR_NULL, GIB_ERR_HANDLE.
///
/// [thread: setup] [real-time: no] [state: not busy]
///
/// # Safety
/// `handle` is NULL or an instance; `path` is NULL or NUL-terminated.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_calibration_save(handle: *mut GibCalibration, path: *const c_char) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let (handle, path) = unsafe { (instance_mut(handle)?, path_of(path)?) };
        let known = handle.machine.table().ok_or(Fault::of(GIB_ERR_STATE));
        let outcome = known.and_then(|table| calibration::save(table, path));
        Ok(kept(&mut handle.last, outcome))
    })
}

/// Reads gains and phases from a file that `gib_calibration_save` wrote; `gib_calibration_result` then gives them.
///
/// @param handle the instance; what it held is replaced, or kept when the file cannot be used.
/// @param path NUL-terminated; stays yours.
/// @return GIB_OK; GIB_ERR_IO, GIB_ERR_FORMAT (gib_calibration_last_error names the key, or gives the line as `value`),
/// GIB_ERR_CONFIG with the key that is out of range, GIB_ERR_STATE while busy, GIB_ERR_NULL, GIB_ERR_HANDLE.
///
/// [thread: setup] [real-time: no] [state: not busy]
///
/// # Safety
/// `handle` is NULL or an instance; `path` is NULL or NUL-terminated.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_calibration_load(handle: *mut GibCalibration, path: *const c_char) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let (handle, path) = unsafe { (instance_mut(handle)?, path_of(path)?) };
        let read = if handle.machine.busy() { Err(Fault::of(GIB_ERR_STATE)) } else { calibration::load(path) };
        let outcome = read.map(|table| handle.machine.install(table));
        Ok(kept(&mut handle.last, outcome))
    })
}

/// The first error of the present run, or why the last call was refused: code, field, value and bounds. A call refused with
/// GIB_ERR_STATE changes nothing here.
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
pub unsafe extern "C" fn gib_calibration_last_error(handle: *const GibCalibration, detail: *mut GibErrorDetail) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let (handle, detail) = unsafe { (instance(handle)?, detail.as_mut().ok_or(GIB_ERR_NULL)?) };
        let fault = if handle.last == Fault::NONE { handle.machine.fault() } else { handle.last };
        *detail = fault.into();
        Ok(GIB_OK)
    })
}
