//! Family `tilt`: tilt of the workpiece plane from spindle load, as seen from C.

use super::guard::{CONFIG, TABLE, guarded, instance, instance_mut, kept, placed, versioned};
use super::types::GibErrorDetail;
use crate::cycle::tilt::config::{GIB_TILT_TEACH, TiltConfig};
use crate::cycle::tilt::io::{GIB_TILT_FAILED, TiltInput, TiltOutput};
use crate::cycle::tilt::machine::Tilt;
use crate::cycle::tilt::plan::Plan;
use crate::cycle::tilt::table::{Inverse, TiltTable, TiltTwoPointResult, two_point};
use crate::cycle::tilt::verdict::TiltReport;
use crate::error::{Fault, GIB_ERR_HANDLE, GIB_ERR_NULL, GIB_OK};
use crate::machine::load_table;
use core::ffi::{CStr, c_char, c_void};
use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt;
use std::path::Path;

/// Marks memory that holds an instance; its absence tells memory that never did, or does no more.
const ALIVE: u32 = 0x6769_7401;

/// Tilt of one workpiece. Opaque; its size is `gib_tilt_size()`.
#[repr(C, align(16))]
pub struct GibTilt {
    alive: u32,
    last: Fault,
    machine: Tilt,
}

impl super::guard::Instance for GibTilt {
    fn alive(&self) -> bool {
        self.alive == ALIVE
    }
    fn new() -> GibTilt {
        GibTilt { alive: ALIVE, last: Fault::NONE, machine: Tilt::default() }
    }
    fn bury(&mut self) {
        self.alive = 0;
    }
}

/// Runs a call that can be refused, and keeps the reason for `_last_error`.
fn refusable(handle: &mut GibTilt, call: impl FnOnce(&mut Tilt) -> Result<(), Fault>) -> i32 {
    kept(&mut handle.last, call(&mut handle.machine))
}

/// Bytes that an instance needs in memory of your own, to be aligned to 16.
///
/// @return the size in bytes, about 131 KiB.
///
/// [thread: any] [real-time: yes] [state: any]
#[unsafe(no_mangle)]
pub extern "C" fn gib_tilt_size() -> usize {
    size_of::<GibTilt>()
}

/// Makes an idle instance in memory of your own. There is nothing to free; zero or reuse the memory when done.
///
/// @param memory at least `gib_tilt_size()` bytes, aligned to 16; stays yours.
/// @param size bytes at `memory`.
/// @param out receives the handle; NULL on error.
/// @return GIB_OK; GIB_ERR_NULL; GIB_ERR_MEMORY when too small or misaligned.
///
/// [thread: setup] [real-time: no] [state: none]
///
/// # Safety
/// `memory` is NULL or points to `size` writable bytes; `out` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_tilt_init_in(memory: *mut c_void, size: usize, out: *mut *mut GibTilt) -> i32 {
    // SAFETY: the caller's promise is `placed`'s.
    guarded(|| unsafe { placed(memory, size, out) })
}

/// Makes an idle instance in memory that gib allocates.
///
/// @return the handle, to be given to `gib_tilt_free`; NULL when there is no memory.
///
/// [thread: setup] [real-time: no] [state: none]
#[unsafe(no_mangle)]
pub extern "C" fn gib_tilt_new() -> *mut GibTilt {
    super::guard::allocated()
}

/// Frees an instance made by `gib_tilt_new`. NULL is allowed and does nothing.
///
/// Take offsets that are in force out first: memory that is gone can ramp nothing.
///
/// @param handle an instance from `gib_tilt_new`, never one from `gib_tilt_init_in`.
///
/// [thread: setup] [real-time: no] [state: not busy]
///
/// # Safety
/// `handle` is NULL or came from `gib_tilt_new` and was not freed before.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_tilt_free(handle: *mut GibTilt) {
    // SAFETY: the caller's promise is `release`'s.
    unsafe { super::guard::release(handle) }
}

/// Checks configuration and table, and arms a measurement, which begins when the tool is in the cut.
///
/// The rising edge of PLCopen's Execute. Clears the previous result and error.
///
/// @param handle the instance.
/// @param config how to measure and compensate; copied. Set `struct_size`, zero the rest, then set what you want.
/// @param table the load table; copied. Not looked at, and may be NULL, when teaching.
/// @return GIB_OK; GIB_ERR_CONFIG (gib_tilt_last_error names the field and its range), GIB_ERR_STRUCT_SIZE,
/// GIB_ERR_TILT_TABLE for a table that is too short or does not rise, GIB_ERR_TILT_CONDITION for a table of another
/// condition, GIB_ERR_STATE while busy, GIB_ERR_NULL, GIB_ERR_HANDLE.
///
/// [thread: setup] [real-time: no] [state: not busy]
///
/// # Safety
/// `handle` is NULL or an instance; `config` and `table` are NULL or point to their `struct_size` readable bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_tilt_start(
    handle: *mut GibTilt,
    config: *const TiltConfig,
    table: *const TiltTable,
) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let handle = unsafe { instance_mut(handle) }?;
        // SAFETY: the caller's promise; config and table are plain numbers.
        let config = unsafe { versioned(CONFIG, config, TiltConfig::FIRST_SIZE) };
        let plan = config.and_then(|config| match config.purpose {
            GIB_TILT_TEACH => Plan::new(&config),
            _ => {
                // SAFETY: as above.
                let table = unsafe { versioned(TABLE, table, TiltTable::FIRST_SIZE) }?;
                Plan::new(&config)?.with_table(&config, &table)
            }
        });
        Ok(refusable(handle, |machine| machine.start(plan)))
    })
}

/// One servo cycle. Call it in every cycle, also when idle: offsets are brought in, kept and taken out through it.
///
/// Give commanded coordinates without gib's offsets, and add `offset_mm` and `offset_deg` to them. Set
/// `GIB_TILT_INPUT_CUTTING` while the tool cuts at feed, and `GIB_TILT_INPUT_END` when the path is finished. When
/// `warning` is 1, warn the operator; give `request_id` back in `acknowledged_id` to have the offsets brought in, set
/// `GIB_TILT_INPUT_OFF` to decline. The same flag takes offsets out that are in force.
///
/// @param handle the instance.
/// @param input values of this cycle.
/// @param output offsets for this cycle; always written when not NULL.
/// @return GIB_OK when idle, GIB_BUSY, GIB_DONE, or the first error, which is kept until the next start:
/// GIB_ERR_ABORTED, GIB_ERR_NON_FINITE, GIB_ERR_DRIVE_FAULT, GIB_ERR_CONFIG for an unknown flag, GIB_ERR_ACK_TIMEOUT,
/// GIB_ERR_DEADLINE, GIB_ERR_TILT_...; and GIB_ERR_NULL, GIB_ERR_HANDLE of this call.
///
/// [thread: cycle] [real-time: yes] [state: any]
///
/// # Safety
/// `handle` is NULL or an instance; `input` is NULL or readable; `output` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_tilt_step(handle: *mut GibTilt, input: *const TiltInput, output: *mut TiltOutput) -> i32 {
    // SAFETY: the caller promises each is NULL or valid.
    let (handle, input, output) = unsafe { (handle.as_mut(), input.as_ref(), output.as_mut()) };
    match (handle, input, output) {
        (Some(handle), Some(input), Some(output)) if handle.alive == ALIVE => handle.machine.step(input, output),
        (handle, input, output) => misused(handle, input, output),
    }
}

/// A step without an instance, an input or an output: offsets stay as they are, or are 0 where there is no instance.
#[cold]
fn misused(handle: Option<&mut GibTilt>, _: Option<&TiltInput>, output: Option<&mut TiltOutput>) -> i32 {
    let status = match &handle {
        Some(handle) if handle.alive != ALIVE => GIB_ERR_HANDLE,
        _ => GIB_ERR_NULL,
    };
    if let Some(output) = output {
        *output = match handle {
            Some(handle) if handle.alive == ALIVE => *handle.machine.output(),
            _ => TiltOutput { phase: GIB_TILT_FAILED, ..TiltOutput::default() },
        };
        output.status = status;
        output.message = status;
    }
    status
}

/// Aborts: the next steps take the offsets out within their bounds of speed and acceleration, and end with
/// GIB_ERR_ABORTED. Does nothing when not busy. To abort from another thread set `GIB_INPUT_ABORT` in the input.
///
/// @param handle the instance.
/// @return GIB_OK; GIB_ERR_NULL, GIB_ERR_HANDLE.
///
/// [thread: cycle] [real-time: yes] [state: any]
///
/// # Safety
/// `handle` is NULL or an instance.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_tilt_abort(handle: *mut GibTilt) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        unsafe { instance_mut(handle) }?.machine.abort();
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
pub unsafe extern "C" fn gib_tilt_result(handle: *const GibTilt, report: *mut TiltReport) -> i32 {
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
pub unsafe extern "C" fn gib_tilt_last_error(handle: *const GibTilt, detail: *mut GibErrorDetail) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let (handle, detail) = unsafe { (instance(handle)?, detail.as_mut().ok_or(GIB_ERR_NULL)?) };
        let fault = if handle.last == Fault::NONE { handle.machine.fault() } else { handle.last };
        *detail = fault.into();
        Ok(GIB_OK)
    })
}

/// Runs a call on a table that needs no instance; tells why it was refused.
///
/// # Safety
/// `detail` is NULL or writable.
unsafe fn told(detail: *mut GibErrorDetail, call: impl FnOnce() -> Result<(), Fault>) -> i32 {
    guarded(|| {
        let fault = call().err().unwrap_or(Fault::NONE);
        // SAFETY: the caller's promise.
        if let Some(detail) = unsafe { detail.as_mut() } {
            *detail = fault.into();
        }
        Ok(fault.code)
    })
}

/// The caller's path.
///
/// # Safety
/// `path` is NULL or NUL-terminated.
unsafe fn named<'a>(path: *const c_char) -> Result<&'a Path, Fault> {
    if path.is_null() {
        return Err(Fault::of(GIB_ERR_NULL));
    }
    // SAFETY: not NULL, NUL-terminated by the caller's promise.
    Ok(Path::new(OsStr::from_bytes(unsafe { CStr::from_ptr(path) }.to_bytes())))
}

/// Adds a cut to a table: a new row in the order of depth, or a further cut of a depth that is there.
///
/// @param table the table; its `struct_size` and `condition` are set.
/// @param depth_mm depth of the cut, 0 to 1000 mm.
/// @param load mean load of the cut, 0 to 1e9: the `load` of a report after teaching, or any other mean.
/// @param load_std its standard uncertainty; 0: taken as exact.
/// @param detail receives what was wrong; may be NULL.
/// @return GIB_OK; GIB_ERR_CONFIG, GIB_ERR_TILT_TABLE when all rows are used, GIB_ERR_STRUCT_SIZE, GIB_ERR_NULL.
///
/// [thread: setup] [real-time: no] [state: none]
///
/// # Safety
/// `table` is NULL or points to a whole `gib_tilt_table`; `detail` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_tilt_table_add(
    table: *mut TiltTable,
    depth_mm: f64,
    load: f64,
    load_std: f64,
    detail: *mut GibErrorDetail,
) -> i32 {
    let add = || {
        // SAFETY: the caller's promise.
        let mut copy = unsafe { versioned(TABLE, table, TiltTable::FIRST_SIZE) }?;
        copy.add(depth_mm, load, load_std)?;
        // SAFETY: not NULL, or `versioned` had refused it.
        unsafe { table.write(copy) };
        Ok(())
    };
    // SAFETY: the caller's promise is `told`'s.
    unsafe { told(detail, add) }
}

/// Checks that a table can be measured with: two rows at least, depths and loads finite and rising, and the loads of
/// neighbouring rows further apart than twice their uncertainties.
///
/// @param table the table.
/// @param detail receives what was wrong: the column, the value, and what it must be above; may be NULL.
/// @return GIB_OK; GIB_ERR_TILT_TABLE, GIB_ERR_CONFIG, GIB_ERR_STRUCT_SIZE, GIB_ERR_NULL.
///
/// [thread: setup] [real-time: no] [state: none]
///
/// # Safety
/// `table` is NULL or points to its `struct_size` readable bytes; `detail` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_tilt_table_check(table: *const TiltTable, detail: *mut GibErrorDetail) -> i32 {
    // SAFETY: the caller's promise.
    unsafe { told(detail, || versioned(TABLE, table, TiltTable::FIRST_SIZE)?.check()) }
}

/// Writes a table to a file, JSON `gib.tilt_table/1`, with its condition; whole or not at all.
///
/// @param table the table; one that gib_tilt_table_check refuses is not written.
/// @param path the file, NUL-terminated; replaced when it is there, with its owner and mode kept.
/// @param detail receives what was wrong; may be NULL.
/// @return GIB_OK; GIB_ERR_IO, and as gib_tilt_table_check.
///
/// [thread: setup] [real-time: no] [state: none]
///
/// # Safety
/// `table` is NULL or points to its `struct_size` readable bytes; `path` is NULL or NUL-terminated; `detail` is NULL or
/// writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_tilt_table_save(
    table: *const TiltTable,
    path: *const c_char,
    detail: *mut GibErrorDetail,
) -> i32 {
    let save = || {
        // SAFETY: the caller's promise.
        let (table, path) = unsafe { (versioned(TABLE, table, TiltTable::FIRST_SIZE)?, named(path)?) };
        load_table::save(&table, path).map_err(|error| error.fault)
    };
    // SAFETY: the caller's promise is `told`'s.
    unsafe { told(detail, save) }
}

/// Reads a table from a file. The condition comes with it; gib_tilt_start compares it with that of the cut.
///
/// @param table receives the table; unchanged on any error. Its `struct_size` is set by the caller.
/// @param path the file, NUL-terminated.
/// @param detail receives what was wrong; `field` is "line" where the text is not JSON or not UTF-8; may be NULL.
/// @return GIB_OK; GIB_ERR_IO, GIB_ERR_FORMAT, and as gib_tilt_table_check.
///
/// [thread: setup] [real-time: no] [state: none]
///
/// # Safety
/// `table` is NULL or points to a whole `gib_tilt_table`; `path` is NULL or NUL-terminated; `detail` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_tilt_table_load(
    table: *mut TiltTable,
    path: *const c_char,
    detail: *mut GibErrorDetail,
) -> i32 {
    let load = || {
        // SAFETY: the caller's promise.
        let (_, path) = unsafe { (versioned(TABLE, table, TiltTable::FIRST_SIZE)?, named(path)?) };
        let read = load_table::load(path).map_err(|error| error.fault)?;
        // SAFETY: not NULL, or `versioned` had refused it.
        unsafe { table.write(read) };
        Ok(())
    };
    // SAFETY: the caller's promise is `told`'s.
    unsafe { told(detail, load) }
}

/// The published rule by itself: depths by straight interpolation at two positions, and the angle between.
///
/// @param table the load table.
/// @param position_mm two positions along the path, mm, at least 1 µm apart.
/// @param load the load at each.
/// @param result receives depths, angle and slope.
/// @param detail receives what was wrong; may be NULL.
/// @return GIB_OK; GIB_ERR_TILT_RANGE for a load outside the table, GIB_ERR_CONFIG, and as gib_tilt_table_check.
///
/// [thread: any] [real-time: no] [state: none]
///
/// # Safety
/// `table` is NULL or points to its `struct_size` readable bytes; `position_mm` and `load` are NULL or two numbers each;
/// `result` and `detail` are NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_tilt_two_point(
    table: *const TiltTable,
    position_mm: *const f64,
    load: *const f64,
    result: *mut TiltTwoPointResult,
    detail: *mut GibErrorDetail,
) -> i32 {
    let rule = || {
        let null = Fault::of(GIB_ERR_NULL);
        // SAFETY: the caller's promise.
        let (table, position, load, result) = unsafe {
            let table = versioned(TABLE, table, TiltTable::FIRST_SIZE)?;
            let pair = |numbers: *const f64| numbers.cast::<[f64; 2]>().as_ref().ok_or(null);
            (table, pair(position_mm)?, pair(load)?, result.as_mut().ok_or(null)?)
        };
        *result = two_point(&Inverse::new(&table)?, *position, *load)?;
        Ok(())
    };
    // SAFETY: the caller's promise is `told`'s.
    unsafe { told(detail, rule) }
}
