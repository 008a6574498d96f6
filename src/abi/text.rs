//! Texts that cross the border: paths in, sentences and JSON out.

use crate::error::{GIB_ERR_BUFFER, GIB_ERR_FORMAT, GIB_ERR_NULL, GIB_OK};
use core::ffi::{CStr, c_char};
use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt;
use std::path::Path;

/// The path that a caller names.
///
/// # Safety
/// `path` is NULL or NUL-terminated, and lives as long as the result is used.
///
/// # Errors
/// `GIB_ERR_NULL`.
pub unsafe fn path_of<'a>(path: *const c_char) -> Result<&'a Path, i32> {
    if path.is_null() {
        return Err(GIB_ERR_NULL);
    }
    // SAFETY: not NULL, NUL-terminated by the caller's promise.
    Ok(Path::new(OsStr::from_bytes(unsafe { CStr::from_ptr(path) }.to_bytes())))
}

/// As [`path_of`]; NULL and the empty text mean none.
///
/// # Safety
/// As [`path_of`].
pub unsafe fn path_if_any<'a>(path: *const c_char) -> Option<&'a Path> {
    // SAFETY: the caller's promise.
    unsafe { path_of(path) }.ok().filter(|path| !path.as_os_str().is_empty())
}

/// A text that may be left out: NULL and the empty text mean none.
///
/// # Safety
/// `text` is NULL or NUL-terminated, and lives as long as the result is used.
///
/// # Errors
/// `GIB_ERR_FORMAT` for what is not UTF-8.
pub unsafe fn text_if_any<'a>(text: *const c_char) -> Result<Option<&'a str>, i32> {
    if text.is_null() {
        return Ok(None);
    }
    // SAFETY: not NULL, NUL-terminated by the caller's promise.
    let text = unsafe { CStr::from_ptr(text) }.to_str().map_err(|_| GIB_ERR_FORMAT)?;
    Ok((!text.is_empty()).then_some(text))
}

/// Gives `source` and a NUL to the caller's buffer; where it does not fit, as much of it as does, cut between characters.
/// `needed`, where it is not NULL, receives the bytes for all of it with its NUL.
///
/// # Safety
/// `text` is NULL or points to `size` writable bytes; `needed` is NULL or writable.
///
/// # Errors
/// `GIB_ERR_BUFFER` when it does not fit; `GIB_ERR_NULL` when there is no buffer and nobody asks for the size.
pub unsafe fn copy_out(source: &str, text: *mut c_char, size: usize, needed: *mut usize) -> Result<i32, i32> {
    if !needed.is_null() {
        // SAFETY: not NULL, so writable.
        unsafe { needed.write(source.len() + 1) };
    }
    if text.is_null() {
        return Err(if needed.is_null() { GIB_ERR_NULL } else { GIB_ERR_BUFFER });
    }
    let Some(room) = size.checked_sub(1) else { return Err(GIB_ERR_BUFFER) };
    let mut fits = source.len().min(room);
    while !source.is_char_boundary(fits) {
        fits -= 1;
    }
    // SAFETY: fits < size, so the text and its NUL stay within the caller's buffer; fits ≤ the source's length.
    unsafe {
        core::ptr::copy_nonoverlapping(source.as_ptr(), text.cast(), fits);
        text.add(fits).write(0);
    }
    if fits == source.len() { Ok(GIB_OK) } else { Err(GIB_ERR_BUFFER) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_fit_is_cut_between_characters_and_the_size_is_told() {
        let mut buffer = [7u8; 6];
        let mut needed = 0;
        // SAFETY: the buffer is as large as said.
        let status = unsafe { copy_out("aµm°C", buffer.as_mut_ptr().cast(), 6, &raw mut needed) };
        assert_eq!((status, needed, &buffer), (Err(GIB_ERR_BUFFER), 8, b"a\xc2\xb5m\0\x07"));
        // SAFETY: no buffer is allowed.
        let status = unsafe { copy_out("abc", core::ptr::null_mut(), 0, &raw mut needed) };
        assert_eq!((status, needed), (Err(GIB_ERR_BUFFER), 4));
        // SAFETY: the buffer is as large as said.
        let status = unsafe { copy_out("abc", buffer.as_mut_ptr().cast(), 4, core::ptr::null_mut()) };
        assert_eq!((status, &buffer[..4]), (Ok(GIB_OK), b"abc\0".as_slice()));
    }
}
