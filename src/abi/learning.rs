//! Family `learning`: a command that is learnt from revolution to revolution, as seen from C.

use super::guard::{CONFIG, guarded, instance, instance_mut, kept, placed, versioned};
use super::text::path_of;
use super::types::GibErrorDetail;
use crate::cycle::learning::config::LearningConfig;
use crate::cycle::learning::io::{GIB_LEARNING_FAILED, LearningInput, LearningOutput, LearningPoint, LearningReport};
use crate::cycle::learning::machine::Learning;
use crate::cycle::learning::plan::Plan;
use crate::error::{Fault, GIB_ERR_BUFFER, GIB_ERR_HANDLE, GIB_ERR_NULL, GIB_ERR_STATE, GIB_OK};
use crate::machine::learning;
use core::ffi::{c_char, c_void};

/// Marks memory that holds an instance; its absence tells memory that never did, or does no more.
const ALIVE: u32 = 0x6769_6c01;

/// The learnt command of one axis. Opaque; its size is `gib_learning_size()`.
#[repr(C, align(16))]
pub struct GibLearning {
    alive: u32,
    last: Fault,
    machine: Learning,
}

impl super::guard::Instance for GibLearning {
    fn alive(&self) -> bool {
        self.alive == ALIVE
    }
    fn new() -> GibLearning {
        GibLearning { alive: ALIVE, last: Fault::NONE, machine: Learning::default() }
    }
    fn bury(&mut self) {
        self.alive = 0;
    }
}

/// Bytes that an instance needs in memory of your own, to be aligned to 16.
///
/// @return the size in bytes, about 66 KiB.
///
/// [thread: any] [real-time: yes] [state: any]
#[unsafe(no_mangle)]
pub extern "C" fn gib_learning_size() -> usize {
    size_of::<GibLearning>()
}

/// Makes an idle instance in memory of your own. There is nothing to free; zero or reuse the memory when done.
///
/// @param memory at least `gib_learning_size()` bytes, aligned to 16; stays yours.
/// @param size bytes at `memory`.
/// @param out receives the handle; NULL on error.
/// @return GIB_OK; GIB_ERR_NULL; GIB_ERR_MEMORY when too small or misaligned.
///
/// [thread: setup] [real-time: no] [state: none]
///
/// # Safety
/// `memory` is NULL or points to `size` writable bytes; `out` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_learning_init_in(memory: *mut c_void, size: usize, out: *mut *mut GibLearning) -> i32 {
    // SAFETY: the caller's promise is `placed`'s.
    guarded(|| unsafe { placed(memory, size, out) })
}

/// Makes an idle instance in memory that gib allocates.
///
/// @return the handle, to be given to `gib_learning_free`; NULL when there is no memory.
///
/// [thread: setup] [real-time: no] [state: none]
#[unsafe(no_mangle)]
pub extern "C" fn gib_learning_new() -> *mut GibLearning {
    super::guard::allocated()
}

/// Frees an instance made by `gib_learning_new`. NULL is allowed and does nothing.
///
/// @param handle an instance from `gib_learning_new`, never one from `gib_learning_init_in`.
///
/// [thread: setup] [real-time: no] [state: not busy]
///
/// # Safety
/// `handle` is NULL or came from `gib_learning_new` and was not freed before.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_learning_free(handle: *mut GibLearning) {
    // SAFETY: the caller's promise is `release`'s.
    unsafe { super::guard::release(handle) }
}

/// Checks the configuration and begins to learn, with the next step.
///
/// The correction starts from none, or with `resume` from the one that this instance holds.
///
/// @param handle the instance.
/// @param config how to learn; copied. Set `struct_size`, zero the rest, then set what you want.
/// @return GIB_OK; GIB_ERR_CONFIG (gib_learning_last_error names the field and its range; with `resume` also `points`, when
/// the correction held has another number of them), GIB_ERR_STRUCT_SIZE, GIB_ERR_STATE while busy, GIB_ERR_NULL,
/// GIB_ERR_HANDLE.
///
/// [thread: setup, or cycle between steps] [real-time: yes] [state: not busy]
///
/// # Safety
/// `handle` is NULL or an instance; `config` is NULL or points to its `struct_size` readable bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_learning_start(handle: *mut GibLearning, config: *const LearningConfig) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let handle = unsafe { instance_mut(handle) }?;
        // SAFETY: the caller's promise; the config is plain numbers.
        let config = unsafe { versioned(CONFIG, config, LearningConfig::FIRST_SIZE) };
        let outcome = handle.machine.start(config.and_then(|config| Plan::new(&config)));
        Ok(kept(&mut handle.last, outcome))
    })
}

/// One servo cycle. Call it in every cycle, also when idle: the command is then the target.
///
/// Command `command_mm` in place of the target. It follows the target at once; the correction in it changes by a bounded
/// step a cycle whatever happens. After GIB_DONE the correction stays in force for as long as you call; an abort takes it out. It is
/// right for the speed and the sense at which it was learnt: at another speed `reasons` says GIB_LEARNING_SPEED_CHANGED, and beyond half
/// to one and a half times that speed, or the other way round, it fades out, to come back with the speed.
///
/// @param handle the instance.
/// @param input target, detected position and angle of this cycle, all of the same instant.
/// @param output the command; always written when not NULL.
/// @return GIB_OK when idle, GIB_BUSY, GIB_DONE, or the first error, which is kept until the next start:
/// GIB_ERR_LEARNING_GROWS and GIB_ERR_LEARNING_UPDATES with the best correction in force; GIB_ERR_LEARNING_DEVIATION,
/// GIB_ERR_ABORTED, GIB_ERR_DRIVE_FAULT, GIB_ERR_DEADLINE (the spindle did not turn, or nothing was detected, for `wait_s`)
/// GIB_ERR_CONFIG (unknown `flags`) and GIB_ERR_NON_FINITE (the target is no number: the last command is repeated meanwhile) with none; and GIB_ERR_NULL,
/// GIB_ERR_HANDLE of this call. Where `input` is NULL the last command is repeated, and `correction_um` is what is in it.
///
/// [thread: cycle] [real-time: yes] [state: any]
///
/// # Safety
/// `handle` is NULL or an instance; `input` is NULL or readable; `output` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_learning_step(
    handle: *mut GibLearning,
    input: *const LearningInput,
    output: *mut LearningOutput,
) -> i32 {
    // SAFETY: the caller promises each is NULL or valid.
    let (handle, input, output) = unsafe { (handle.as_mut(), input.as_ref(), output.as_mut()) };
    match (handle, input, output) {
        (Some(handle), Some(input), Some(output)) if handle.alive == ALIVE => handle.machine.step(input, output),
        (handle, input, output) => misused(handle, input, output),
    }
}

/// A step without an instance, an input or an output: the target, as far as there is one, else the last command with the
/// correction in it.
#[cold]
fn misused(
    handle: Option<&mut GibLearning>,
    input: Option<&LearningInput>,
    output: Option<&mut LearningOutput>,
) -> i32 {
    let dead = handle.as_ref().is_some_and(|handle| handle.alive != ALIVE);
    let status = if dead { GIB_ERR_HANDLE } else { GIB_ERR_NULL };
    let target = input.map(|input| input.target_mm).filter(|target| target.is_finite());
    let last = handle.filter(|_| !dead).map(|handle| (handle.machine.command(), handle.machine.correction()));
    if let Some(output) = output {
        let (command_mm, correction_um) = target.map(|target| (target, 0.0)).or(last).unwrap_or_default();
        *output = LearningOutput {
            command_mm,
            correction_um,
            status,
            message: status,
            phase: GIB_LEARNING_FAILED,
            ..LearningOutput::default()
        };
    }
    status
}

/// Ends learning: the correction fades out within `fade_s`, then steps return GIB_ERR_ABORTED. After GIB_DONE it takes out the
/// correction that was kept. Does nothing else. To abort from another thread set `GIB_INPUT_ABORT` in the input.
///
/// @param handle the instance.
/// @return GIB_OK; GIB_ERR_NULL, GIB_ERR_HANDLE.
///
/// [thread: cycle] [real-time: yes] [state: any]
///
/// # Safety
/// `handle` is NULL or an instance.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_learning_abort(handle: *mut GibLearning) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        unsafe { instance_mut(handle) }?.machine.abort();
        Ok(GIB_OK)
    })
}

/// Reads how far learning has come: deviations before, now and at best, updates, the speed.
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
pub unsafe extern "C" fn gib_learning_result(handle: *const GibLearning, report: *mut LearningReport) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let handle = unsafe { instance(handle) }?;
        // SAFETY: the caller's promise.
        let report = unsafe { report.as_mut() }.ok_or(GIB_ERR_NULL)?;
        *report = handle.machine.report();
        Ok(GIB_OK)
    })
}

/// Reads target, command and detected position over the spindle's angle.
///
/// @param handle the instance.
/// @param points receives them, from -180 degrees on; NULL with `capacity` 0 to learn the count, by GIB_ERR_BUFFER unless it is 0.
/// @param capacity points that fit at `points`.
/// @param count receives how many there are.
/// @return GIB_OK; GIB_ERR_BUFFER when there are more than fit, GIB_ERR_NULL, GIB_ERR_HANDLE.
///
/// [thread: cycle] [real-time: no] [state: any]
///
/// # Safety
/// `handle` is NULL or an instance; `points` is NULL or points to `capacity` writable points; `count` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_learning_points(
    handle: *const GibLearning,
    points: *mut LearningPoint,
    capacity: usize,
    count: *mut usize,
) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let (handle, count) = unsafe { (instance(handle)?, count.as_mut().ok_or(GIB_ERR_NULL)?) };
        *count = handle.machine.count();
        if *count > capacity {
            return Err(GIB_ERR_BUFFER);
        }
        if points.is_null() {
            return if *count == 0 { Ok(GIB_OK) } else { Err(GIB_ERR_NULL) };
        }
        for i in 0..*count {
            // SAFETY: i < count ≤ capacity.
            unsafe { points.add(i).write(handle.machine.point(i)) };
        }
        Ok(GIB_OK)
    })
}

/// Writes target, command and detected position over the angle to a file, JSON with schema "gib.learning/1". An old file is
/// replaced whole or not at all.
///
/// @param handle the instance.
/// @param path NUL-terminated; stays yours.
/// @return GIB_OK; GIB_ERR_STATE while busy or when nothing was ever learnt or loaded, GIB_ERR_IO, GIB_ERR_NULL,
/// GIB_ERR_HANDLE.
///
/// [thread: setup] [real-time: no] [state: not busy]
///
/// # Safety
/// `handle` is NULL or an instance; `path` is NULL or NUL-terminated.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_learning_save(handle: *mut GibLearning, path: *const c_char) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let (handle, path) = unsafe { (instance_mut(handle)?, path_of(path)?) };
        let machine = &handle.machine;
        let saved = if machine.busy() || machine.count() == 0 {
            Err(Fault::of(GIB_ERR_STATE))
        } else {
            let points: Vec<LearningPoint> = (0..machine.count()).map(|i| machine.point(i)).collect();
            learning::save(&points, machine.report().speed_rpm, path)
        };
        Ok(kept(&mut handle.last, saved))
    })
}

/// Reads a learnt command from a file that `gib_learning_save` wrote; a start with `resume` takes it up.
///
/// @param handle the instance; what it held is replaced, or kept when the file cannot be used.
/// @param path NUL-terminated; stays yours.
/// @return GIB_OK; GIB_ERR_IO, GIB_ERR_FORMAT (gib_learning_last_error names the key, with the point as `value`, or gives the
/// line), GIB_ERR_STATE while busy, GIB_ERR_NULL, GIB_ERR_HANDLE.
///
/// [thread: setup] [real-time: no] [state: not busy]
///
/// # Safety
/// `handle` is NULL or an instance; `path` is NULL or NUL-terminated.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_learning_load(handle: *mut GibLearning, path: *const c_char) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let (handle, path) = unsafe { (instance_mut(handle)?, path_of(path)?) };
        let read = if handle.machine.busy() { Err(Fault::of(GIB_ERR_STATE)) } else { learning::load(path) };
        let outcome = read.map(|points| handle.machine.install(points.into_iter()));
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
pub unsafe extern "C" fn gib_learning_last_error(handle: *const GibLearning, detail: *mut GibErrorDetail) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let (handle, detail) = unsafe { (instance(handle)?, detail.as_mut().ok_or(GIB_ERR_NULL)?) };
        let fault = if handle.last == Fault::NONE { handle.machine.fault() } else { handle.last };
        *detail = fault.into();
        Ok(GIB_OK)
    })
}
