//! Family `inertia`: inertia and friction of a spindle from torque and speed, as seen from C.

use super::guard::{CONFIG, guarded, instance, instance_mut, kept, placed, versioned};
use super::types::GibErrorDetail;
use crate::cycle::inertia::config::InertiaConfig;
use crate::cycle::inertia::io::{GIB_INERTIA_FAILED, InertiaInput, InertiaOutput};
use crate::cycle::inertia::machine::Inertia;
use crate::cycle::inertia::plan::Plan;
use crate::cycle::inertia::report::InertiaReport;
use crate::error::{Fault, GIB_ERR_HANDLE, GIB_ERR_NULL, GIB_OK};
use core::ffi::c_void;

/// Marks memory that holds an instance; its absence tells memory that never did, or does no more.
const ALIVE: u64 = 0x6769_625f_696e_0001;

/// An inertia measurement of one spindle. Opaque; its size is `gib_inertia_size()`.
#[repr(C, align(16))]
pub struct GibInertia {
    alive: u64,
    last: Fault,
    machine: Inertia,
}

impl super::guard::Instance for GibInertia {
    fn alive(&self) -> bool {
        self.alive == ALIVE
    }
    fn new() -> GibInertia {
        GibInertia { alive: ALIVE, last: Fault::NONE, machine: Inertia::default() }
    }
    fn bury(&mut self) {
        self.alive = 0;
    }
}

/// Bytes that an instance needs in memory of your own, to be aligned to 16.
///
/// @return the size in bytes, about 30 KiB.
///
/// [thread: any] [real-time: yes] [state: any]
#[unsafe(no_mangle)]
pub extern "C" fn gib_inertia_size() -> usize {
    size_of::<GibInertia>()
}

/// Makes an idle instance in memory of your own. There is nothing to free; zero or reuse the memory when done.
///
/// @param memory at least `gib_inertia_size()` bytes, aligned to 16; stays yours.
/// @param size bytes at `memory`.
/// @param out receives the handle; NULL on error.
/// @return GIB_OK; GIB_ERR_NULL; GIB_ERR_MEMORY when too small or misaligned.
///
/// [thread: setup] [real-time: no] [state: none]
///
/// # Safety
/// `memory` is NULL or points to `size` writable bytes; `out` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_inertia_init_in(memory: *mut c_void, size: usize, out: *mut *mut GibInertia) -> i32 {
    // SAFETY: the caller's promise is `placed`'s.
    guarded(|| unsafe { placed(memory, size, out) })
}

/// Makes an idle instance in memory that gib allocates.
///
/// @return the handle, to be given to `gib_inertia_free`; NULL when there is no memory.
///
/// [thread: setup] [real-time: no] [state: none]
#[unsafe(no_mangle)]
pub extern "C" fn gib_inertia_new() -> *mut GibInertia {
    super::guard::allocated()
}

/// Frees an instance made by `gib_inertia_new`. NULL is allowed and does nothing.
///
/// @param handle an instance from `gib_inertia_new`, never one from `gib_inertia_init_in`.
///
/// [thread: setup] [real-time: no] [state: not busy]
///
/// # Safety
/// `handle` is NULL or came from `gib_inertia_new` and was not freed before.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_inertia_free(handle: *mut GibInertia) {
    // SAFETY: the caller's promise is `release`'s.
    unsafe { super::guard::release(handle) }
}

/// Checks the configuration and arms a measurement, which begins with the next step.
///
/// The rising edge of PLCopen's Execute. Clears the previous result and error. Where the part program's head already
/// holds `INA` (`gib_program_get`), measuring is to be skipped, as published.
///
/// @param handle the instance.
/// @param config what to measure; copied. Set `struct_size`, zero the rest, then set what you want.
/// @return GIB_OK; GIB_ERR_CONFIG (gib_inertia_last_error names the field and its range), GIB_ERR_STRUCT_SIZE,
/// GIB_ERR_STATE while busy, GIB_ERR_NULL, GIB_ERR_HANDLE.
///
/// [thread: setup, or cycle between steps] [real-time: yes] [state: not busy]
///
/// # Safety
/// `handle` is NULL or an instance; `config` is NULL or points to its `struct_size` readable bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_inertia_start(handle: *mut GibInertia, config: *const InertiaConfig) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let handle = unsafe { instance_mut(handle) }?;
        // SAFETY: the caller's promise; the config is plain numbers.
        let config = unsafe { versioned(CONFIG, config, InertiaConfig::FIRST_SIZE) };
        let outcome = handle.machine.start(config.and_then(|config| Plan::new(&config)));
        Ok(kept(&mut handle.last, outcome))
    })
}

/// One servo cycle: gathers speed and torque, and commands the ramps while `owns_motion` is 1.
///
/// @param handle the instance.
/// @param input measured values of this cycle.
/// @param output command for this cycle; always written when not NULL.
/// @return GIB_OK when idle, GIB_BUSY, GIB_DONE, or the first error, which is kept until the next start:
/// GIB_ERR_ABORTED, GIB_ERR_NON_FINITE, GIB_ERR_DRIVE_FAULT, GIB_ERR_TORQUE_BOUND, GIB_ERR_LAG, GIB_ERR_CONFIG for
/// unknown flags; and GIB_ERR_NULL, GIB_ERR_HANDLE of this call. After a fault the command goes back to the speed at
/// start, no faster than the ramps; after a drive fault gib just lets go.
///
/// [thread: cycle] [real-time: yes] [state: any]
///
/// # Safety
/// `handle` is NULL or an instance; `input` is NULL or readable; `output` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_inertia_step(
    handle: *mut GibInertia,
    input: *const InertiaInput,
    output: *mut InertiaOutput,
) -> i32 {
    if handle.is_null() || input.is_null() || output.is_null() {
        // SAFETY: the caller promises each is NULL or valid.
        return unsafe { misused(handle.as_ref(), input.as_ref(), output.as_mut()) };
    }
    // SAFETY: as above, and none is NULL.
    let (handle, input, output) = unsafe { (&mut *handle, &*input, &mut *output) };
    if handle.alive == ALIVE && handle.machine.quick(input) {
        let now = handle.machine.output();
        *output = InertiaOutput { speed_command_rpm: now.speed_command_rpm, ..*now };
        return output.status;
    }
    step_in_full(handle, input, output)
}

/// A cycle that is not a cheap one. `extern "C"`: it cannot unwind, so that it is called by a jump and the cheap cycle saves
/// no registers.
#[inline(never)]
extern "C" fn step_in_full(handle: &mut GibInertia, input: &InertiaInput, output: &mut InertiaOutput) -> i32 {
    if handle.alive != ALIVE {
        return misused(Some(handle), Some(input), Some(output));
    }
    handle.machine.turn(input);
    *output = *handle.machine.output();
    output.status
}

/// A step without an instance, an input or an output: the speed asked for is the present one.
#[cold]
fn misused(handle: Option<&GibInertia>, input: Option<&InertiaInput>, output: Option<&mut InertiaOutput>) -> i32 {
    let status = match &handle {
        Some(handle) if handle.alive != ALIVE => GIB_ERR_HANDLE,
        _ => GIB_ERR_NULL,
    };
    let speed = input.map_or(0.0, |input| input.speed_rpm);
    if let Some(output) = output {
        *output = match handle {
            Some(handle) if handle.alive == ALIVE => *handle.machine.output(),
            _ => InertiaOutput {
                speed_command_rpm: if speed.is_finite() { speed } else { 0.0 },
                phase: GIB_INERTIA_FAILED,
                ..InertiaOutput::default()
            },
        };
        output.owns_motion = 0;
        output.status = status;
        output.message = status;
    }
    status
}

/// Aborts a running measurement: the next steps go back to the speed at start and end with GIB_ERR_ABORTED. Does
/// nothing when not busy. To abort from another thread set `GIB_INPUT_ABORT` in the input.
///
/// @param handle the instance.
/// @return GIB_OK; GIB_ERR_NULL, GIB_ERR_HANDLE.
///
/// [thread: cycle] [real-time: yes] [state: any]
///
/// # Safety
/// `handle` is NULL or an instance.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_inertia_abort(handle: *mut GibInertia) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        unsafe { instance_mut(handle) }?.machine.abort();
        Ok(GIB_OK)
    })
}

/// Fits what was gathered, off the cycle: takes 10 to 150 ms.
///
/// The report is written also when the value cannot be used; it then says which ramp would do.
///
/// @param handle the instance, after GIB_DONE.
/// @param report receives inertia, friction, uncertainties and the ramp that would do better.
/// @return GIB_OK; GIB_ERR_STATE before GIB_DONE; GIB_ERR_INERTIA_EXCITATION, GIB_ERR_INERTIA_FEW,
/// GIB_ERR_INERTIA_SIGN, GIB_ERR_INERTIA_OWN, GIB_ERR_INERTIA_TORQUE when the value cannot be used; GIB_ERR_NULL, GIB_ERR_HANDLE.
///
/// [thread: setup] [real-time: no] [state: after GIB_DONE]
///
/// # Safety
/// `handle` is NULL or an instance; `report` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_inertia_result(handle: *mut GibInertia, report: *mut InertiaReport) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let (handle, report) = unsafe { (instance_mut(handle)?, report.as_mut().ok_or(GIB_ERR_NULL)?) };
        let outcome = handle.machine.report().and_then(|(found, verdict)| {
            *report = found;
            verdict
        });
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
pub unsafe extern "C" fn gib_inertia_last_error(handle: *const GibInertia, detail: *mut GibErrorDetail) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let (handle, detail) = unsafe { (instance(handle)?, detail.as_mut().ok_or(GIB_ERR_NULL)?) };
        let fault = if handle.last == Fault::NONE { handle.machine.fault() } else { handle.last };
        *detail = fault.into();
        Ok(GIB_OK)
    })
}
