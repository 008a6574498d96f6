//! The one door between C and Rust: catches panics, checks pointers and `struct_size`.

use crate::error::{
    Fault, GIB_ERR_HANDLE, GIB_ERR_INTERNAL, GIB_ERR_MEMORY, GIB_ERR_NULL, GIB_ERR_STATE, GIB_ERR_STRUCT_SIZE, GIB_OK,
};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Runs setup-side code; a panic becomes `GIB_ERR_INTERNAL`. Never used under a `_step`, which cannot panic.
pub fn guarded(call: impl FnOnce() -> Result<i32, i32>) -> i32 {
    match catch_unwind(AssertUnwindSafe(call)) {
        Ok(Ok(status) | Err(status)) => status,
        Err(_) => GIB_ERR_INTERNAL,
    }
}

/// A versioned struct's name as a parameter, and that of its size, for `_last_error`.
pub type Named = [&'static str; 2];
/// A configuration.
pub const CONFIG: Named = ["config\0", "struct_size\0"];
/// A table beside it.
pub const TABLE: Named = ["table\0", "table.struct_size\0"];

/// Reads a caller's versioned struct, which starts with `uint32_t struct_size`.
///
/// A shorter struct (an older caller) is accepted down to `first_size`: the fields it lacks become zero, which
/// means the old behaviour. A longer one (a newer caller) is accepted only when its unknown tail is all zero.
///
/// # Safety
/// `pointer` is NULL or points to `struct_size` readable bytes; `T` is a `repr(C)` struct of plain numbers for
/// which all-zero is a valid value.
///
/// # Errors
/// `GIB_ERR_NULL`, `GIB_ERR_STRUCT_SIZE` with the sizes that are read.
pub unsafe fn versioned<T: Copy>(name: Named, pointer: *const T, first_size: usize) -> Result<T, Fault> {
    const LARGEST: usize = 4096; // a struct_size beyond this is garbage, not a newer caller
    let [parameter, field] = name;
    if pointer.is_null() {
        return Err(Fault { field: parameter, ..Fault::of(GIB_ERR_NULL) });
    }
    let bytes = pointer.cast::<u8>();
    // SAFETY: the caller promises `struct_size` readable bytes, and the size itself is the first four of them.
    let size = unsafe { pointer.cast::<u32>().read_unaligned() } as usize;
    let (value, low, high) = (size as f64, first_size as f64, size_of::<T>() as f64);
    let refused = Fault { code: GIB_ERR_STRUCT_SIZE, field, value, low, high };
    if size < first_size || size > LARGEST {
        return Err(refused);
    }
    let known = size.min(size_of::<T>());
    for i in known..size {
        // SAFETY: i < struct_size.
        if unsafe { *bytes.add(i) } != 0 {
            return Err(refused);
        }
    }
    let mut value = core::mem::MaybeUninit::<T>::zeroed();
    // SAFETY: `known` bytes are readable and fit in T; all-zero is a valid T.
    unsafe {
        core::ptr::copy_nonoverlapping(bytes, value.as_mut_ptr().cast::<u8>(), known);
        Ok(value.assume_init())
    }
}

/// Keeps the reason of a refusal for `_last_error`; that a call comes at the wrong time must not hide why the run failed.
pub fn kept(last: &mut Fault, outcome: Result<(), Fault>) -> i32 {
    let fault = outcome.err().unwrap_or(Fault::NONE);
    if fault.code != GIB_ERR_STATE {
        *last = fault;
    }
    fault.code
}

/// A type that C holds by an opaque handle.
pub trait Instance: Sized {
    /// Whether this memory carries the mark of a living instance.
    fn alive(&self) -> bool;
    /// An idle instance.
    fn new() -> Self;
    /// Takes the mark away, so that a later call is refused instead of trusted.
    fn bury(&mut self);
}

/// The instance behind a handle.
///
/// # Safety
/// `handle` is NULL or points to readable memory of the type's size and alignment.
///
/// # Errors
/// `GIB_ERR_NULL`, `GIB_ERR_HANDLE`.
pub unsafe fn instance<'a, T: Instance>(handle: *const T) -> Result<&'a T, i32> {
    // SAFETY: the caller's promise.
    let instance = unsafe { handle.as_ref() }.ok_or(GIB_ERR_NULL)?;
    if instance.alive() { Ok(instance) } else { Err(GIB_ERR_HANDLE) }
}

/// The instance behind a handle, to be changed.
///
/// # Safety
/// As [`instance`], and nothing else uses it during the call.
///
/// # Errors
/// `GIB_ERR_NULL`, `GIB_ERR_HANDLE`.
pub unsafe fn instance_mut<'a, T: Instance>(handle: *mut T) -> Result<&'a mut T, i32> {
    // SAFETY: the caller's promise.
    let instance = unsafe { handle.as_mut() }.ok_or(GIB_ERR_NULL)?;
    if instance.alive() { Ok(instance) } else { Err(GIB_ERR_HANDLE) }
}

/// Makes an instance in the caller's memory.
///
/// # Safety
/// `memory` is NULL or `size` writable bytes; `out` is NULL or writable.
///
/// # Errors
/// `GIB_ERR_NULL`, `GIB_ERR_MEMORY`.
pub unsafe fn placed<T: Instance>(memory: *mut core::ffi::c_void, size: usize, out: *mut *mut T) -> Result<i32, i32> {
    if out.is_null() {
        return Err(GIB_ERR_NULL);
    }
    // SAFETY: not NULL, so writable.
    unsafe { out.write(core::ptr::null_mut()) };
    if memory.is_null() {
        return Err(GIB_ERR_NULL);
    }
    let place = memory.cast::<T>();
    if size < size_of::<T>() || !place.is_aligned() {
        return Err(GIB_ERR_MEMORY);
    }
    // SAFETY: large enough, aligned, writable by the caller's promise.
    unsafe {
        place.write(T::new());
        out.write(place);
    }
    Ok(GIB_OK)
}

/// Makes an instance in memory from the allocator; NULL when there is none.
pub fn allocated<T: Instance>() -> *mut T {
    let layout = std::alloc::Layout::new::<T>();
    let mut handle = core::ptr::null_mut();
    // SAFETY: the layout of an instance is not empty.
    let memory = unsafe { std::alloc::alloc(layout) };
    // SAFETY: memory of that layout, or NULL, which `placed` refuses.
    let status = guarded(|| unsafe { placed(memory.cast(), layout.size(), &raw mut handle) });
    if status != GIB_OK && !memory.is_null() {
        // SAFETY: allocated above with this layout and not handed out.
        unsafe { std::alloc::dealloc(memory, layout) };
    }
    handle
}

/// Frees an instance from [`allocated`].
///
/// # Safety
/// `handle` is NULL or came from `allocated` and was not released before.
pub unsafe fn release<T: Instance>(handle: *mut T) {
    // SAFETY: the caller's promise.
    if let Ok(instance) = unsafe { instance_mut(handle) } {
        instance.bury();
        // SAFETY: a live instance, dropped once; `allocated` used this layout.
        unsafe {
            core::ptr::drop_in_place(handle);
            std::alloc::dealloc(handle.cast(), std::alloc::Layout::new::<T>());
        }
    }
}
