//! The one door between C and Rust: catches panics, checks pointers and `struct_size`.

use crate::error::{GIB_ERR_INTERNAL, GIB_ERR_NULL, GIB_ERR_STRUCT_SIZE};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Runs setup-side code; a panic becomes `GIB_ERR_INTERNAL`. Never used under a `_step`, which cannot panic.
pub fn guarded(call: impl FnOnce() -> Result<i32, i32>) -> i32 {
    match catch_unwind(AssertUnwindSafe(call)) {
        Ok(Ok(status) | Err(status)) => status,
        Err(_) => GIB_ERR_INTERNAL,
    }
}

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
/// `GIB_ERR_NULL`, `GIB_ERR_STRUCT_SIZE`.
pub unsafe fn versioned<T: Copy>(pointer: *const T, first_size: usize) -> Result<T, i32> {
    const LARGEST: usize = 4096; // a struct_size beyond this is garbage, not a newer caller
    if pointer.is_null() {
        return Err(GIB_ERR_NULL);
    }
    let bytes = pointer.cast::<u8>();
    // SAFETY: the caller promises `struct_size` readable bytes, and the size itself is the first four of them.
    let size = unsafe { pointer.cast::<u32>().read_unaligned() } as usize;
    if size < first_size || size > LARGEST {
        return Err(GIB_ERR_STRUCT_SIZE);
    }
    let known = size.min(size_of::<T>());
    for i in known..size {
        // SAFETY: i < struct_size.
        if unsafe { *bytes.add(i) } != 0 {
            return Err(GIB_ERR_STRUCT_SIZE);
        }
    }
    let mut value = core::mem::MaybeUninit::<T>::zeroed();
    // SAFETY: `known` bytes are readable and fit in T; all-zero is a valid T.
    unsafe {
        core::ptr::copy_nonoverlapping(bytes, value.as_mut_ptr().cast::<u8>(), known);
        Ok(value.assume_init())
    }
}
