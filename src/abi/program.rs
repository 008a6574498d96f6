//! Family `program`: INA, the load inertia in kg·m², in the head of a part program, as seen from C.

use super::guard::{guarded, instance, instance_mut, placed};
use super::text::{copy_out, path_of};
use super::types::GibErrorDetail;
use crate::error::{Fault, GIB_ERR_CONFIG, GIB_ERR_NULL, GIB_ERR_PROGRAM_ABSENT, GIB_OK};
use crate::program::{self, Dialect, Error, Scope};
use core::ffi::{c_char, c_void};
use std::path::Path;

/// Spell a new value as the program's own dialect is recognised.
pub const GIB_PROGRAM_DIALECT_DETECT: i32 = 0;
/// Spell a new value as LinuxCNC's parameter `#<_ina>=0.5`.
pub const GIB_PROGRAM_DIALECT_LINUXCNC: i32 = 1;
/// Spell a new value as the OSP variable `INA=0.5`; steps 1 to 9 only.
pub const GIB_PROGRAM_DIALECT_OKUMA: i32 = 2;
/// Spell a new value as the comment `(INA=0.5)`.
pub const GIB_PROGRAM_DIALECT_ISO: i32 = 3;

/// Bytes that hold every text of `gib_program_last_error_text`, with its NUL.
pub const GIB_PROGRAM_TEXT_SIZE: usize = 512;

/// Marks memory that holds an instance; its absence tells memory that never did, or does no more.
const ALIVE: u64 = 0x6769_625f_7072_0001;

/// Reads and writes part programs, and keeps why the last call failed. Opaque; its size is `gib_program_size()`.
#[repr(C, align(16))]
pub struct GibProgram {
    alive: u64,
    last: Fault,
    /// The sentence of the last error, NUL-terminated.
    text: [u8; GIB_PROGRAM_TEXT_SIZE],
}

impl super::guard::Instance for GibProgram {
    fn alive(&self) -> bool {
        self.alive == ALIVE
    }
    fn new() -> GibProgram {
        GibProgram { alive: ALIVE, last: Fault::NONE, text: [0; GIB_PROGRAM_TEXT_SIZE] }
    }
    fn bury(&mut self) {
        self.alive = 0;
    }
}

/// Why a call failed: in numbers, and as a sentence where there is one.
struct Refusal(Fault, Option<String>);

impl From<Error> for Refusal {
    fn from(error: Error) -> Refusal {
        // Without the path: the caller knows it, and a long one would leave no room for the reason.
        Refusal(error.fault(), Some(error.problem.to_string()))
    }
}

impl From<Fault> for Refusal {
    fn from(fault: Fault) -> Refusal {
        Refusal(fault, None)
    }
}

impl GibProgram {
    /// Runs a call and keeps why it failed.
    fn keep(&mut self, call: impl FnOnce() -> Result<(), Refusal>) -> i32 {
        let Refusal(fault, text) = call().err().unwrap_or(Refusal(Fault::NONE, None));
        let text = text.unwrap_or_else(|| crate::error::status_text(fault.code).trim_end_matches('\0').to_owned());
        self.last = fault;
        self.text.fill(0);
        let mut end = text.len().min(GIB_PROGRAM_TEXT_SIZE - 1);
        while !text.is_char_boundary(end) {
            end -= 1;
        }
        for (place, byte) in self.text.iter_mut().zip(text.bytes().take(end)) {
            *place = byte;
        }
        fault.code
    }
}

/// The path and the scope that a caller names.
///
/// # Safety
/// `path` is NULL or NUL-terminated.
unsafe fn named<'a>(path: *const c_char, step: u32) -> Result<(&'a Path, Scope), Refusal> {
    // SAFETY: the caller's promise.
    let path = unsafe { path_of(path) }.map_err(Fault::of)?;
    let (value, high) = (f64::from(step), f64::from(Scope::LAST_STEP));
    let refused = Fault { code: GIB_ERR_CONFIG, field: "step\0", value, low: 0.0, high };
    Ok((path, Scope::from_number(step).ok_or(refused)?))
}

fn dialect(number: i32) -> Result<Option<Dialect>, Fault> {
    match number {
        GIB_PROGRAM_DIALECT_DETECT => Ok(None),
        GIB_PROGRAM_DIALECT_LINUXCNC => Ok(Some(Dialect::LinuxCnc)),
        GIB_PROGRAM_DIALECT_OKUMA => Ok(Some(Dialect::Okuma)),
        GIB_PROGRAM_DIALECT_ISO => Ok(Some(Dialect::Iso)),
        other => Err(Fault { code: GIB_ERR_CONFIG, field: "dialect\0", value: f64::from(other), low: 0.0, high: 3.0 }),
    }
}

/// Bytes that an instance needs in memory of your own, to be aligned to 16.
///
/// @return the size in bytes, below 1 KiB.
///
/// [thread: any] [real-time: yes] [state: any]
#[unsafe(no_mangle)]
pub extern "C" fn gib_program_size() -> usize {
    size_of::<GibProgram>()
}

/// Makes an instance in memory of your own. There is nothing to free; zero or reuse the memory when done.
///
/// @param memory at least `gib_program_size()` bytes, aligned to 16; stays yours.
/// @param size bytes at `memory`.
/// @param out receives the handle; NULL on error.
/// @return GIB_OK; GIB_ERR_NULL; GIB_ERR_MEMORY when too small or misaligned.
///
/// [thread: setup] [real-time: no] [state: none]
///
/// # Safety
/// `memory` is NULL or points to `size` writable bytes; `out` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_program_init_in(memory: *mut c_void, size: usize, out: *mut *mut GibProgram) -> i32 {
    // SAFETY: the caller's promise is `placed`'s.
    guarded(|| unsafe { placed(memory, size, out) })
}

/// Makes an instance in memory that gib allocates.
///
/// @return the handle, to be given to `gib_program_free`; NULL when there is no memory.
///
/// [thread: setup] [real-time: no] [state: none]
#[unsafe(no_mangle)]
pub extern "C" fn gib_program_new() -> *mut GibProgram {
    super::guard::allocated()
}

/// Frees an instance made by `gib_program_new`. NULL is allowed and does nothing.
///
/// @param handle an instance from `gib_program_new`, never one from `gib_program_init_in`.
///
/// [thread: setup] [real-time: no] [state: any]
///
/// # Safety
/// `handle` is NULL or came from `gib_program_new` and was not freed before.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_program_free(handle: *mut GibProgram) {
    // SAFETY: the caller's promise is `release`'s.
    unsafe { super::guard::release(handle) }
}

/// Reads INA from the head of a part program: when it is there, measuring is skipped.
///
/// All spellings are read: `#<_ina>=0.5`, `INA=0.5`, `(INA=0.5)`; for step 2 `INA2`. No more than the head is read;
/// a symbolic link is followed. The head must be sound as a whole, also where it speaks of other steps.
///
/// @param handle the instance.
/// @param path the program, NUL-terminated, in the file system's encoding.
/// @param step process step 1 to 9999; 0 for the whole program. A step without a value of its own is absent, also
/// where the whole program has one.
/// @param inertia_kg_m2 receives the inertia, kg·m², finite and above 0; 0 on any error.
/// @return GIB_OK; GIB_ERR_PROGRAM_ABSENT when it must be measured; GIB_ERR_PROGRAM_VALUE, GIB_ERR_PROGRAM_DUPLICATE,
/// GIB_ERR_PROGRAM_NOT_A_FILE, GIB_ERR_FORMAT for NUL bytes or UTF-16, GIB_ERR_IO, GIB_ERR_CONFIG for another step,
/// GIB_ERR_NULL, GIB_ERR_HANDLE, GIB_ERR_INTERNAL.
///
/// [thread: setup] [real-time: no] [state: any]
///
/// # Safety
/// `handle` is NULL or an instance; `path` is NULL or NUL-terminated; `inertia_kg_m2` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_program_get(
    handle: *mut GibProgram,
    path: *const c_char,
    step: u32,
    inertia_kg_m2: *mut f64,
) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let inertia_kg_m2 = unsafe { inertia_kg_m2.as_mut() };
        let inertia_kg_m2 = inertia_kg_m2.map(|value| {
            *value = 0.0;
            value
        });
        // SAFETY: the caller's promise.
        let handle = unsafe { instance_mut(handle) }?;
        Ok(handle.keep(|| {
            let value = inertia_kg_m2.ok_or(Fault::of(GIB_ERR_NULL))?;
            // SAFETY: the caller's promise.
            let (path, scope) = unsafe { named(path, step) }?;
            *value = program::get(path, scope)?.ok_or(Fault::of(GIB_ERR_PROGRAM_ABSENT))?.inertia_kg_m2;
            Ok(())
        }))
    })
}

/// Writes INA into the head of a part program; no other byte changes. Touches nothing when the value is there.
///
/// The program is replaced whole or not at all, also when the power fails, with its owner, group, mode and access list.
/// Waits for another writer for 60 s at most.
///
/// @param handle the instance.
/// @param path the program, NUL-terminated, in the file system's encoding; not a symbolic link.
/// @param step process step 1 to 9999; 0 for the whole program.
/// @param inertia_kg_m2 the inertia, 1e-9 to 1e9 kg·m².
/// @param dialect GIB_PROGRAM_DIALECT_...: how a new value is spelled; one that is there keeps its spelling.
/// @return GIB_OK; GIB_ERR_CONFIG for a step, inertia or dialect out of range; GIB_ERR_PROGRAM_VALUE,
/// GIB_ERR_PROGRAM_DUPLICATE, GIB_ERR_PROGRAM_LINK, GIB_ERR_PROGRAM_NOT_A_FILE, GIB_ERR_PROGRAM_BUSY,
/// GIB_ERR_PROGRAM_CHANGED, GIB_ERR_PROGRAM_OWNER, GIB_ERR_FORMAT for NUL bytes or UTF-16, GIB_ERR_IO,
/// GIB_ERR_NULL, GIB_ERR_HANDLE, GIB_ERR_INTERNAL.
///
/// [thread: setup] [real-time: no] [state: any]
///
/// # Safety
/// `handle` is NULL or an instance; `path` is NULL or NUL-terminated.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_program_set(
    handle: *mut GibProgram,
    path: *const c_char,
    step: u32,
    inertia_kg_m2: f64,
    dialect: i32,
) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let handle = unsafe { instance_mut(handle) }?;
        Ok(handle.keep(|| {
            // SAFETY: the caller's promise.
            let (path, scope) = unsafe { named(path, step) }?;
            program::set(path, scope, inertia_kg_m2, self::dialect(dialect)?)?;
            Ok(())
        }))
    })
}

/// Removes INA from the head of a part program: the line when nothing else stands on it, else only the statement.
///
/// What is not there is as good as removed. The program is replaced as by gib_program_set.
///
/// @param handle the instance.
/// @param path the program, NUL-terminated, in the file system's encoding; not a symbolic link.
/// @param step process step 1 to 9999; 0 for the whole program.
/// @return as gib_program_set.
///
/// [thread: setup] [real-time: no] [state: any]
///
/// # Safety
/// `handle` is NULL or an instance; `path` is NULL or NUL-terminated.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_program_remove(handle: *mut GibProgram, path: *const c_char, step: u32) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let handle = unsafe { instance_mut(handle) }?;
        Ok(handle.keep(|| {
            // SAFETY: the caller's promise.
            let (path, scope) = unsafe { named(path, step) }?;
            program::remove(path, scope)?;
            Ok(())
        }))
    })
}

/// Why the last call failed: code, field, value and bounds.
///
/// Field `line` has the line of the program as value; for GIB_ERR_PROGRAM_DUPLICATE `low` and `high` are the two lines.
///
/// @param handle the instance.
/// @param detail receives it; its `code` is GIB_OK when the last call did its work.
/// @return GIB_OK; GIB_ERR_NULL, GIB_ERR_HANDLE.
///
/// [thread: setup] [real-time: yes] [state: any]
///
/// # Safety
/// `handle` is NULL or an instance; `detail` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_program_last_error(handle: *const GibProgram, detail: *mut GibErrorDetail) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let (handle, detail) = unsafe { (instance(handle)?, detail.as_mut().ok_or(GIB_ERR_NULL)?) };
        *detail = handle.last.into();
        Ok(GIB_OK)
    })
}

/// Why the last call failed, as a sentence for the operator that quotes the line at fault, UTF-8.
///
/// @param handle the instance.
/// @param text receives the sentence and its NUL.
/// @param size bytes at `text`; GIB_PROGRAM_TEXT_SIZE always suffices.
/// @return GIB_OK; GIB_ERR_BUFFER when `size` is too small (then as much as fits is written); GIB_ERR_NULL,
/// GIB_ERR_HANDLE.
///
/// [thread: setup] [real-time: no] [state: any]
///
/// # Safety
/// `handle` is NULL or an instance; `text` is NULL or points to `size` writable bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_program_last_error_text(handle: *const GibProgram, text: *mut c_char, size: usize) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let handle = unsafe { instance(handle) }?;
        let length = handle.text.iter().position(|byte| *byte == 0).unwrap_or(0);
        let sentence = core::str::from_utf8(&handle.text[..length]).unwrap_or_default();
        // SAFETY: the caller's promise.
        unsafe { copy_out(sentence, text, size, core::ptr::null_mut()) }
    })
}
