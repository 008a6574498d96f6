//! Family `speed_variation`: spindle speed variation within the motor's limits, as seen from C.

use super::guard::{CONFIG, guarded, instance, instance_mut, kept, placed, versioned};
use super::types::GibErrorDetail;
use crate::cycle::speed_variation::config::{SpeedVariationConfig, SpeedVariationLimits};
use crate::cycle::speed_variation::io::{GIB_SPEED_VARIATION_FAILED, SpeedVariationInput, SpeedVariationOutput};
use crate::cycle::speed_variation::machine::SpeedVariation;
use crate::cycle::speed_variation::plan::Plan;
use crate::error::{Fault, GIB_ERR_HANDLE, GIB_ERR_NULL, GIB_OK};
use core::ffi::c_void;

/// Marks memory that holds an instance; its absence tells memory that never did, or does no more.
const ALIVE: u32 = 0x6769_7376;

/// A speed variation of one spindle. Opaque; its size is `gib_speed_variation_size()`.
#[repr(C, align(16))]
pub struct GibSpeedVariation {
    alive: u32,
    last: Fault,
    machine: SpeedVariation,
}

impl super::guard::Instance for GibSpeedVariation {
    fn alive(&self) -> bool {
        self.alive == ALIVE
    }
    fn new() -> GibSpeedVariation {
        GibSpeedVariation { alive: ALIVE, last: Fault::NONE, machine: SpeedVariation::default() }
    }
    fn bury(&mut self) {
        self.alive = 0;
    }
}

/// Bytes that an instance needs in memory of your own, to be aligned to 16.
///
/// @return the size in bytes, below 1 KiB.
///
/// [thread: any] [real-time: yes] [state: any]
#[unsafe(no_mangle)]
pub extern "C" fn gib_speed_variation_size() -> usize {
    size_of::<GibSpeedVariation>()
}

/// Makes an idle instance in memory of your own. There is nothing to free; zero or reuse the memory when done.
///
/// @param memory at least `gib_speed_variation_size()` bytes, aligned to 16; stays yours.
/// @param size bytes at `memory`.
/// @param out receives the handle; NULL on error.
/// @return GIB_OK; GIB_ERR_NULL; GIB_ERR_MEMORY when too small or misaligned.
///
/// [thread: setup] [real-time: no] [state: none]
///
/// # Safety
/// `memory` is NULL or points to `size` writable bytes; `out` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_speed_variation_init_in(
    memory: *mut c_void,
    size: usize,
    out: *mut *mut GibSpeedVariation,
) -> i32 {
    // SAFETY: the caller's promise is `placed`'s.
    guarded(|| unsafe { placed(memory, size, out) })
}

/// Makes an idle instance in memory that gib allocates.
///
/// @return the handle, to be given to `gib_speed_variation_free`; NULL when there is no memory.
///
/// [thread: setup] [real-time: no] [state: none]
#[unsafe(no_mangle)]
pub extern "C" fn gib_speed_variation_new() -> *mut GibSpeedVariation {
    super::guard::allocated()
}

/// Frees an instance made by `gib_speed_variation_new`. NULL is allowed and does nothing.
///
/// @param handle an instance from `gib_speed_variation_new`, never one from `gib_speed_variation_init_in`.
///
/// [thread: setup] [real-time: no] [state: not busy]
///
/// # Safety
/// `handle` is NULL or came from `gib_speed_variation_new` and was not freed before.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_speed_variation_free(handle: *mut GibSpeedVariation) {
    // SAFETY: the caller's promise is `release`'s.
    unsafe { super::guard::release(handle) }
}

/// Checks the configuration and arms a variation, which begins with the next step at the mean speed: start it when the spindle
/// is there.
///
/// What the motor cannot do is refused: gib_speed_variation_last_error then names `amplitude_ratio` with the largest
/// possible one as upper bound.
///
/// @param handle the instance.
/// @param config what to vary, by which motor; copied. Set `struct_size`, zero the rest, then set what you want.
/// @return GIB_OK; GIB_ERR_SPEED_VARIATION_POWER, _TORQUE, _SPEED, _NONE; GIB_ERR_CONFIG, GIB_ERR_STRUCT_SIZE,
/// GIB_ERR_STATE while busy, GIB_ERR_NULL, GIB_ERR_HANDLE.
///
/// [thread: setup, or cycle between steps] [real-time: yes] [state: not busy]
///
/// # Safety
/// `handle` is NULL or an instance; `config` is NULL or points to its `struct_size` readable bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_speed_variation_start(
    handle: *mut GibSpeedVariation,
    config: *const SpeedVariationConfig,
) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let handle = unsafe { instance_mut(handle) }?;
        // SAFETY: the caller's promise; the config is plain numbers.
        let config = unsafe { versioned(CONFIG, config, SpeedVariationConfig::FIRST_SIZE) };
        let outcome = handle.machine.start(config.and_then(|config| Plan::to_start(&config)));
        Ok(kept(&mut handle.last, outcome))
    })
}

/// One servo cycle: the speed command.
///
/// It begins and ends at the mean speed without a jump, wherever that has gone meanwhile: on the way back, too, it may change in
/// any cycle. Mean speed, amplitude, period and cutting torque may change in
/// any cycle; torque, power and speed stay within the motor's. Where more is asked for than it can do, the amplitude
/// is cut to what it can, and `message` says why. What a change leads to is worked out over the cycles that follow, a piece in
/// each: it takes effect within 20 cycles, and until then the variation goes on as before. Cutting torque counts at once.
///
/// A fault is named in `message` in its cycle; the speed then goes back to its mean as after GIB_SPEED_VARIATION_STOP, with status
/// GIB_BUSY, and only then the error is returned. A speed of 0, too low or of the other sense (a spindle stop, a reversal) leads it
/// to the lowest speed allowed, one that is too high or no number nowhere else.
///
/// Idle, done or failed, the command is `speed_rpm` passed through: ramps are the kernel's again. Only where a variation ends at
/// another speed than is asked for in that cycle does gib lead the command there first, through 0 where it turns the other way, within
/// what the motor can do; done once they are equal, at once with GIB_INPUT_FAULT. After a first start a speed beyond
/// `speed_max_rpm` in either sense is not passed through, and one that is no number never: the command stays. After a drive fault, and after any fault in the first step, gib lets go at once: that
/// step commands the speed asked for or, where that is no number, the last one within the limits, else the configuration's mean.
///
/// @param handle the instance.
/// @param input what is asked for in this cycle.
/// @param output command for this cycle; always written when not NULL.
/// @return GIB_OK when idle, GIB_BUSY, GIB_DONE after `GIB_SPEED_VARIATION_STOP`, or the first error, which is kept
/// until the next start: GIB_ERR_ABORTED, GIB_ERR_NON_FINITE, GIB_ERR_DRIVE_FAULT, GIB_ERR_CONFIG,
/// GIB_ERR_SPEED_VARIATION_SPEED, GIB_ERR_SPEED_VARIATION_NONE where the motor cannot do the way back, also after a stop; and GIB_ERR_NULL, GIB_ERR_HANDLE of this call.
///
/// [thread: cycle] [real-time: yes] [state: any]
///
/// # Safety
/// `handle` is NULL or an instance; `input` is NULL or readable; `output` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_speed_variation_step(
    handle: *mut GibSpeedVariation,
    input: *const SpeedVariationInput,
    output: *mut SpeedVariationOutput,
) -> i32 {
    if handle.is_null() || input.is_null() || output.is_null() {
        // SAFETY: the caller promises each is NULL or valid.
        return unsafe { misused(handle.as_ref(), input.as_ref(), output.as_mut()) };
    }
    // SAFETY: as above, and none is NULL.
    let (handle, input, output) = unsafe { (&mut *handle, &*input, &mut *output) };
    if handle.alive == ALIVE && handle.machine.quick(input) {
        *output = *handle.machine.output();
        return output.status;
    }
    step_in_full(handle, input, output)
}

/// A cycle that is not a cheap one. `extern "C"`: it cannot unwind, so that it is called by a jump and the cheap cycle saves
/// no registers.
#[inline(never)]
extern "C" fn step_in_full(
    handle: &mut GibSpeedVariation,
    input: &SpeedVariationInput,
    output: &mut SpeedVariationOutput,
) -> i32 {
    if handle.alive != ALIVE {
        return misused(Some(handle), Some(input), Some(output));
    }
    handle.machine.turn(input);
    *output = *handle.machine.output();
    output.status
}

/// A step without an instance, an input or an output: the speed asked for is the last one.
#[cold]
fn misused(
    handle: Option<&GibSpeedVariation>,
    input: Option<&SpeedVariationInput>,
    output: Option<&mut SpeedVariationOutput>,
) -> i32 {
    let status = match &handle {
        Some(handle) if handle.alive != ALIVE => GIB_ERR_HANDLE,
        _ => GIB_ERR_NULL,
    };
    let speed = input.map_or(0.0, |input| input.speed_rpm);
    if let Some(output) = output {
        *output = match handle {
            Some(handle) if handle.alive == ALIVE => *handle.machine.output(),
            _ => SpeedVariationOutput {
                speed_command_rpm: if speed.is_finite() { speed } else { 0.0 },
                phase: GIB_SPEED_VARIATION_FAILED,
                ..SpeedVariationOutput::default()
            },
        };
        output.torque_nm = 0.0;
        output.status = status;
        output.message = status;
    }
    status
}

/// Aborts a running variation: the next steps go back to the mean speed and end with GIB_ERR_ABORTED. Does nothing
/// when not busy. To end well set `GIB_SPEED_VARIATION_STOP` in the input instead.
///
/// @param handle the instance.
/// @return GIB_OK; GIB_ERR_NULL, GIB_ERR_HANDLE.
///
/// [thread: cycle] [real-time: yes] [state: any]
///
/// # Safety
/// `handle` is NULL or an instance.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_speed_variation_abort(handle: *mut GibSpeedVariation) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        unsafe { instance_mut(handle) }?.machine.abort();
        Ok(GIB_OK)
    })
}

/// What is possible and recommended for the variation that was started last.
///
/// @param handle the instance.
/// @param limits receives it.
/// @return GIB_OK; GIB_ERR_STATE before the first start; GIB_ERR_NULL, GIB_ERR_HANDLE.
///
/// [thread: setup, or cycle] [real-time: yes] [state: after a start]
///
/// # Safety
/// `handle` is NULL or an instance; `limits` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_speed_variation_result(
    handle: *mut GibSpeedVariation,
    limits: *mut SpeedVariationLimits,
) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let (handle, limits) = unsafe { (instance_mut(handle)?, limits.as_mut().ok_or(GIB_ERR_NULL)?) };
        let outcome = handle.machine.limits().map(|found| *limits = found);
        Ok(kept(&mut handle.last, outcome))
    })
}

/// What a motor can do: largest amplitude for a period, shortest period for an amplitude, as published and exact, and
/// what is recommended. Needs no instance; call it for each point of a chart.
///
/// @param config speed, inertia and motor; `amplitude_ratio` or `period_s` or both; `cycle_s` may stay 0.
/// @param limits receives it; zeros on error.
/// @return GIB_OK; GIB_ERR_CONFIG, GIB_ERR_STRUCT_SIZE, GIB_ERR_NULL.
///
/// [thread: any] [real-time: yes] [state: none]
///
/// # Safety
/// `config` is NULL or points to its `struct_size` readable bytes; `limits` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_speed_variation_possible(
    config: *const SpeedVariationConfig,
    limits: *mut SpeedVariationLimits,
) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let limits = unsafe { limits.as_mut() }.ok_or(GIB_ERR_NULL)?;
        *limits = SpeedVariationLimits::default();
        // SAFETY: the caller's promise; the config is plain numbers.
        let config = unsafe { versioned(CONFIG, config, SpeedVariationConfig::FIRST_SIZE) };
        let plan = config.and_then(|config| Plan::new(&config)).map_err(|fault| fault.code)?;
        *limits = plan.limits();
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
pub unsafe extern "C" fn gib_speed_variation_last_error(
    handle: *const GibSpeedVariation,
    detail: *mut GibErrorDetail,
) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let (handle, detail) = unsafe { (instance(handle)?, detail.as_mut().ok_or(GIB_ERR_NULL)?) };
        let fault = if handle.last == Fault::NONE { handle.machine.fault() } else { handle.last };
        *detail = fault.into();
        Ok(GIB_OK)
    })
}
