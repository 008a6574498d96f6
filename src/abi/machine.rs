//! Family `machine`: what a simulation believes about a machine, as JSON, as seen from C.

use super::guard::{Instance, guarded, instance, instance_mut};
use super::last_error::{LastError, Refused};
use super::text::{copy_out, path_of};
use crate::error::{GIB_ERR_FORMAT, GIB_ERR_IO, GIB_ERR_NULL, GIB_ERR_STATE, GIB_OK};
use crate::machine::Machine;
use core::ffi::c_char;
use std::path::Path;

/// Marks memory that holds an instance.
const ALIVE: u64 = 0x6769_625f_6d61_0001;

/// A machine file in memory. Opaque; it owns memory of its own, so that it comes from `gib_machine_new` alone.
pub struct GibMachine {
    alive: u64,
    /// The machine that was read last.
    pub(super) machine: Option<Machine>,
    last: LastError,
}

impl Instance for GibMachine {
    fn alive(&self) -> bool {
        self.alive == ALIVE
    }
    fn new() -> GibMachine {
        GibMachine { alive: ALIVE, machine: None, last: LastError::default() }
    }
    fn bury(&mut self) {
        self.alive = 0;
    }
}

/// `GIB_ERR_IO` for a file that cannot be opened, else `GIB_ERR_FORMAT`.
pub(super) fn file_status(file: &Path) -> i32 {
    if std::fs::File::open(file).is_ok_and(|file| file.metadata().is_ok_and(|m| m.is_file())) {
        GIB_ERR_FORMAT
    } else {
        GIB_ERR_IO
    }
}

impl GibMachine {
    /// Keeps the machine, or why there is none.
    fn keep(&mut self, read: Result<Machine, Refused>) -> Result<i32, i32> {
        let kept = read.map(|machine| {
            self.machine = Some(machine);
            GIB_OK
        });
        self.last.of(kept)
    }

    /// The machine that was read.
    fn read(&self) -> Result<&Machine, Refused> {
        self.machine.as_ref().ok_or_else(|| Refused(GIB_ERR_STATE, "no machine was read into this handle".into()))
    }
}

/// Makes an empty instance.
///
/// @return the handle, to be given to `gib_machine_free`; NULL when there is no memory.
///
/// [thread: setup] [real-time: no] [state: none]
#[unsafe(no_mangle)]
pub extern "C" fn gib_machine_new() -> *mut GibMachine {
    super::guard::allocated()
}

/// Frees an instance. NULL is allowed and does nothing.
///
/// @param handle an instance from `gib_machine_new`, in use by no call.
///
/// [thread: setup] [real-time: no] [state: any]
///
/// # Safety
/// `handle` is NULL or came from `gib_machine_new` and was not freed before.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_machine_free(handle: *mut GibMachine) {
    // SAFETY: the caller's promise is `release`'s.
    unsafe { super::guard::release(handle) }
}

/// Reads a machine from JSON with schema "gib.machine/1", with or without `effects`.
///
/// @param handle the instance; what it held is replaced, or kept when the text cannot be used.
/// @param json the text, UTF-8; stays yours.
/// @param length bytes at `json`, without a NUL if there is one.
/// @return GIB_OK; GIB_ERR_FORMAT, and gib_machine_last_error_text names the path in the JSON, the value found and what
/// is allowed; GIB_ERR_NULL, GIB_ERR_HANDLE, GIB_ERR_INTERNAL.
///
/// [thread: setup] [real-time: no] [state: any]
///
/// # Safety
/// `handle` is NULL or an instance; `json` is NULL or points to `length` readable bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_machine_read(handle: *mut GibMachine, json: *const c_char, length: usize) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let handle = unsafe { instance_mut(handle) }?;
        if json.is_null() || length > isize::MAX as usize {
            return handle.keep(Err(GIB_ERR_NULL.into()));
        }
        // SAFETY: not NULL, `length` readable bytes by the caller's promise.
        let bytes = unsafe { core::slice::from_raw_parts(json.cast::<u8>(), length) };
        let text = core::str::from_utf8(bytes).map_err(|why| format!("not UTF-8: {why}"));
        let read = text.and_then(|text| Machine::parse(text).map_err(|why| why.to_string()));
        handle.keep(read.map_err(|why| Refused(GIB_ERR_FORMAT, why)))
    })
}

/// Reads a machine file.
///
/// @param handle the instance; what it held is replaced, or kept when the file cannot be used.
/// @param path NUL-terminated; stays yours.
/// @return GIB_OK; GIB_ERR_IO, GIB_ERR_FORMAT (gib_machine_last_error_text says where and why), GIB_ERR_NULL,
/// GIB_ERR_HANDLE, GIB_ERR_INTERNAL.
///
/// [thread: setup] [real-time: no] [state: any]
///
/// # Safety
/// `handle` is NULL or an instance; `path` is NULL or NUL-terminated.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_machine_load(handle: *mut GibMachine, path: *const c_char) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let (handle, path) = unsafe { (instance_mut(handle)?, path_of(path)) };
        let load = |path| Machine::load(path).map_err(|why| Refused(file_status(path), why.to_string()));
        handle.keep(path.map_err(Refused::from).and_then(load))
    })
}

/// Writes the machine file.
///
/// @param handle the instance.
/// @param path NUL-terminated; stays yours. A file of that name is replaced.
/// @return GIB_OK; GIB_ERR_IO; GIB_ERR_STATE when no machine was read; GIB_ERR_NULL, GIB_ERR_HANDLE, GIB_ERR_INTERNAL.
///
/// [thread: setup] [real-time: no] [state: a machine was read]
///
/// # Safety
/// `handle` is NULL or an instance; `path` is NULL or NUL-terminated.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_machine_save(handle: *mut GibMachine, path: *const c_char) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let (handle, path) = unsafe { (instance_mut(handle)?, path_of(path)) };
        let save = |path| {
            let saved = handle.read()?.save(path);
            saved.map(|()| GIB_OK).map_err(|why| Refused(GIB_ERR_IO, why.to_string()))
        };
        handle.last.of(path.map_err(Refused::from).and_then(save))
    })
}

/// The machine as JSON with schema "gib.machine/1".
///
/// Ask for the size first: `gib_machine_result(handle, NULL, 0, &needed)` returns GIB_ERR_BUFFER and sets `needed`.
///
/// @param handle the instance.
/// @param json receives the text, UTF-8, with its NUL; NULL to ask for the size alone.
/// @param size bytes at `json`.
/// @param needed receives the bytes for all of it with its NUL; may be NULL.
/// @return GIB_OK; GIB_ERR_BUFFER when `size` is too small; GIB_ERR_STATE when no machine was read; GIB_ERR_NULL,
/// GIB_ERR_HANDLE, GIB_ERR_INTERNAL.
///
/// [thread: setup] [real-time: no] [state: a machine was read]
///
/// # Safety
/// `handle` is NULL or an instance; `json` is NULL or points to `size` writable bytes; `needed` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_machine_result(
    handle: *const GibMachine,
    json: *mut c_char,
    size: usize,
    needed: *mut usize,
) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let handle = unsafe { instance(handle) }?;
        let text = handle.read().map(|machine| format!("{:#}\n", machine.to_json()));
        // SAFETY: the caller's promise.
        let copied = text.and_then(|text| unsafe { copy_out(&text, json, size, needed) }.map_err(Refused::from));
        handle.last.of(copied)
    })
}

/// Keys of the file that have no meaning here, a line each, as paths in the JSON: ignored, but one may be a slip.
///
/// @param handle the instance.
/// @param text receives the lines with a NUL; empty when every key has a meaning. NULL to ask for the size alone.
/// @param size bytes at `text`.
/// @param needed receives the bytes for all of it with its NUL; may be NULL.
/// @return as gib_machine_result.
///
/// [thread: setup] [real-time: no] [state: a machine was read]
///
/// # Safety
/// `handle` is NULL or an instance; `text` is NULL or points to `size` writable bytes; `needed` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_machine_ignored_keys(
    handle: *const GibMachine,
    text: *mut c_char,
    size: usize,
    needed: *mut usize,
) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let handle = unsafe { instance(handle) }?;
        let keys = handle.read().map(|machine| machine.ignored_keys.join("\n"));
        // SAFETY: the caller's promise.
        let copied = keys.and_then(|keys| unsafe { copy_out(&keys, text, size, needed) }.map_err(Refused::from));
        handle.last.of(copied)
    })
}

/// Why the last call failed, as a sentence that names the file or the path in the JSON, what was found and what is
/// allowed. Each call of this family on the handle forgets the sentence of the one before and leaves its own if it
/// fails; a call that is refused with GIB_ERR_NULL or GIB_ERR_HANDLE because of the handle itself has nowhere to leave one.
///
/// @param handle the instance.
/// @param text receives the sentence, UTF-8, with its NUL; empty when the last call did its work.
/// @param size bytes at `text`; a longer sentence is cut.
/// @return GIB_OK; GIB_ERR_BUFFER when the sentence was cut; GIB_ERR_NULL, GIB_ERR_HANDLE.
///
/// [thread: setup] [real-time: no] [state: any]
///
/// # Safety
/// `handle` is NULL or an instance; `text` is NULL or points to `size` writable bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_machine_last_error_text(handle: *const GibMachine, text: *mut c_char, size: usize) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        unsafe { copy_out(&instance(handle)?.last.sentence(), text, size, core::ptr::null_mut()) }
    })
}
