//! Family `vibration`: tool position corrected for vibration, as seen from C.

use super::guard::{CONFIG, TABLE, guarded, instance, instance_mut, kept, placed, versioned};
use super::types::GibErrorDetail;
use crate::cycle::calibration::table::CalibrationTable;
use crate::cycle::vibration::config::VibrationConfig;
use crate::cycle::vibration::io::{GIB_VIBRATION_FAILED, VibrationInput, VibrationOutput, VibrationReport};
use crate::cycle::vibration::machine::Vibration;
use crate::cycle::vibration::plan::Plan;
use crate::error::{Fault, GIB_ERR_HANDLE, GIB_ERR_NULL, GIB_OK};
use core::ffi::c_void;

/// Marks memory that holds an instance; its absence tells memory that never did, or does no more.
const ALIVE: u32 = 0x6769_7601;

/// The corrected position of one tool slide. Opaque; its size is `gib_vibration_size()`.
#[repr(C, align(16))]
pub struct GibVibration {
    alive: u32,
    last: Fault,
    machine: Vibration,
}

impl super::guard::Instance for GibVibration {
    fn alive(&self) -> bool {
        self.alive == ALIVE
    }
    fn new() -> GibVibration {
        GibVibration { alive: ALIVE, last: Fault::NONE, machine: Vibration::default() }
    }
    fn bury(&mut self) {
        self.alive = 0;
    }
}

/// Bytes that an instance needs in memory of your own, to be aligned to 16.
///
/// @return the size in bytes, about 6 KiB.
///
/// [thread: any] [real-time: yes] [state: any]
#[unsafe(no_mangle)]
pub extern "C" fn gib_vibration_size() -> usize {
    size_of::<GibVibration>()
}

/// Makes an idle instance in memory of your own. There is nothing to free; zero or reuse the memory when done.
///
/// @param memory at least `gib_vibration_size()` bytes, aligned to 16; stays yours.
/// @param size bytes at `memory`.
/// @param out receives the handle; NULL on error.
/// @return GIB_OK; GIB_ERR_NULL; GIB_ERR_MEMORY when too small or misaligned.
///
/// [thread: setup] [real-time: no] [state: none]
///
/// # Safety
/// `memory` is NULL or points to `size` writable bytes; `out` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_vibration_init_in(memory: *mut c_void, size: usize, out: *mut *mut GibVibration) -> i32 {
    // SAFETY: the caller's promise is `placed`'s.
    guarded(|| unsafe { placed(memory, size, out) })
}

/// Makes an idle instance in memory that gib allocates.
///
/// @return the handle, to be given to `gib_vibration_free`; NULL when there is no memory.
///
/// [thread: setup] [real-time: no] [state: none]
#[unsafe(no_mangle)]
pub extern "C" fn gib_vibration_new() -> *mut GibVibration {
    super::guard::allocated()
}

/// Frees an instance made by `gib_vibration_new`. NULL is allowed and does nothing.
///
/// @param handle an instance from `gib_vibration_new`, never one from `gib_vibration_init_in`.
///
/// [thread: setup] [real-time: no] [state: not busy]
///
/// # Safety
/// `handle` is NULL or came from `gib_vibration_new` and was not freed before.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_vibration_free(handle: *mut GibVibration) {
    // SAFETY: the caller's promise is `release`'s.
    unsafe { super::guard::release(handle) }
}

/// Checks the configuration and begins to correct the position, with the next step.
///
/// The correction comes in by itself once the spindle has turned a whole revolution with good sensors, at a speed that changed by
/// less than a quarter meanwhile.
///
/// @param handle the instance.
/// @param config how to correct; copied. Set `struct_size`, zero the rest, then set what you want.
/// @param table gains and phases from `gib_calibration_result`; copied. NULL: both accelerometers are believed as they are.
/// @return GIB_OK; GIB_ERR_CONFIG (gib_vibration_last_error names the field, of configuration or table, and its range),
/// GIB_ERR_STRUCT_SIZE of either, GIB_ERR_STATE while busy, GIB_ERR_NULL, GIB_ERR_HANDLE.
///
/// [thread: setup, or cycle between steps] [real-time: yes] [state: not busy]
///
/// # Safety
/// `handle` is NULL or an instance; `config` and `table` are each NULL or point to their `struct_size` readable bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_vibration_start(
    handle: *mut GibVibration,
    config: *const VibrationConfig,
    table: *const CalibrationTable,
) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let handle = unsafe { instance_mut(handle) }?;
        // SAFETY: the caller's promise; the config is plain numbers.
        let config = unsafe { versioned(CONFIG, config, VibrationConfig::FIRST_SIZE) };
        // SAFETY: the caller's promise; the table is plain numbers.
        let read = || unsafe { versioned(TABLE, table, CalibrationTable::FIRST_SIZE) };
        let table = if table.is_null() { Ok(None) } else { read().map(Some) };
        let plan = config.and_then(|config| Plan::new(&config, table?.as_ref()));
        let outcome = handle.machine.start(plan);
        Ok(kept(&mut handle.last, outcome))
    })
}

/// One servo cycle. Call it in every cycle, also when idle: the position is then the plain scale.
///
/// `position_mm` is what to use in place of the scale, for the position loop's feedback or for learning the command. It
/// never jumps on account of a sensor; `blend_ratio`, `reasons` and `message` say how far it is corrected and why not.
///
/// @param handle the instance.
/// @param input measured values of this cycle, all of the same instant.
/// @param output the position; always written when not NULL.
/// @return GIB_OK when idle, GIB_BUSY, or the first error, which is kept until the next start: GIB_ERR_ABORTED,
/// GIB_ERR_DRIVE_FAULT, GIB_ERR_CONFIG (unknown `flags`), GIB_ERR_NON_FINITE when the scale is no number (the last position is repeated in such a cycle, and the correction fades);
/// and GIB_ERR_NULL, GIB_ERR_HANDLE of this call. Where `input` is NULL the last position is repeated, and `correction_um` is what is
/// in it.
///
/// [thread: cycle] [real-time: yes] [state: any]
///
/// # Safety
/// `handle` is NULL or an instance; `input` is NULL or readable; `output` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_vibration_step(
    handle: *mut GibVibration,
    input: *const VibrationInput,
    output: *mut VibrationOutput,
) -> i32 {
    // SAFETY: the caller promises each is NULL or valid.
    let (handle, input, output) = unsafe { (handle.as_mut(), input.as_ref(), output.as_mut()) };
    match (handle, input, output) {
        (Some(handle), Some(input), Some(output)) if handle.alive == ALIVE => handle.machine.step(input, output),
        (handle, input, output) => misused(handle, input, output),
    }
}

/// A step without an instance, an input or an output: the plain scale, as far as there is one, else the last position with the
/// correction in it.
#[cold]
fn misused(
    handle: Option<&mut GibVibration>,
    input: Option<&VibrationInput>,
    output: Option<&mut VibrationOutput>,
) -> i32 {
    let living = handle.as_ref().filter(|handle| handle.alive == ALIVE);
    let status = if handle.is_some() && living.is_none() { GIB_ERR_HANDLE } else { GIB_ERR_NULL };
    let scale = input.map(|input| input.scale_mm).filter(|scale| scale.is_finite());
    let last = living.map(|handle| (handle.machine.position(), handle.machine.correction()));
    if let Some(output) = output {
        let (position_mm, correction_um) = scale.map(|scale| (scale, 0.0)).or(last).unwrap_or_default();
        *output = VibrationOutput {
            position_mm,
            correction_um,
            status,
            message: status,
            phase: GIB_VIBRATION_FAILED,
            ..VibrationOutput::default()
        };
    }
    status
}

/// Ends the correction: it fades out within `fade_s`, then the plain scale is in force and steps return GIB_ERR_ABORTED.
/// Does nothing when not busy. To abort from another thread set `GIB_INPUT_ABORT` in the input.
///
/// @param handle the instance.
/// @return GIB_OK; GIB_ERR_NULL, GIB_ERR_HANDLE.
///
/// [thread: cycle] [real-time: yes] [state: any]
///
/// # Safety
/// `handle` is NULL or an instance.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_vibration_abort(handle: *mut GibVibration) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        unsafe { instance_mut(handle) }?.machine.abort();
        Ok(GIB_OK)
    })
}

/// Reads what is known of the vibration now: harmonics, noise, offsets, how long the correction was out.
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
pub unsafe extern "C" fn gib_vibration_result(handle: *const GibVibration, report: *mut VibrationReport) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let handle = unsafe { instance(handle) }?;
        // SAFETY: the caller's promise.
        let report = unsafe { report.as_mut() }.ok_or(GIB_ERR_NULL)?;
        *report = handle.machine.report();
        Ok(GIB_OK)
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
pub unsafe extern "C" fn gib_vibration_last_error(handle: *const GibVibration, detail: *mut GibErrorDetail) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let (handle, detail) = unsafe { (instance(handle)?, detail.as_mut().ok_or(GIB_ERR_NULL)?) };
        let fault = if handle.last == Fault::NONE { handle.machine.fault() } else { handle.last };
        *detail = fault.into();
        Ok(GIB_OK)
    })
}
