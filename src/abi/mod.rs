//! The C surface: guard, types, one file a family; nothing but translation. The only room with `unsafe`.
//!
//! `include/gib.h` is generated from the files of this room, from `error.rs` and from the `repr(C)` types of the
//! cycle room: their comments are the C programmer's manual. `make header` writes it anew.
//!
//! To add a family: one file here, one block of pointers in `api.rs` and one of functions in `entry.rs`.

pub mod api;
pub mod backlash;
pub mod calibration;
pub mod diagnosis;
pub mod entry;
pub mod guard;
pub mod homing;
pub mod inertia;
pub mod last_error;
pub mod learning;
pub mod machine;
pub mod program;
pub mod recorder;
pub mod shared_memory;
pub mod speed_variation;
pub mod text;
pub mod tilt;
pub mod types;
pub mod vibration;

use crate::error::status_text;
use core::ffi::c_char;

/// Version of this interface: major · 65536 + minor.
///
/// Within one major, functions, struct tails and status numbers are added and nothing is changed or taken away;
/// each addition raises the minor. The major is also the number at the end of `libgib.so.0`.
pub const GIB_ABI_VERSION: u32 = 0x0000_0001;

/// Version of the interface that the loaded library serves; compare it with `GIB_ABI_VERSION` of the header.
///
/// @return major · 65536 + minor. The library fits when the majors are equal and its minor is not below the header's.
///
/// [thread: any] [real-time: yes] [state: any]
#[unsafe(no_mangle)]
pub extern "C" fn gib_abi_version() -> u32 {
    GIB_ABI_VERSION
}

/// Version of the library as text, for a log or an about box.
///
/// @return static text such as "0.1.0", NUL-terminated; never NULL, never freed.
///
/// [thread: any] [real-time: yes] [state: any]
#[unsafe(no_mangle)]
pub extern "C" fn gib_version() -> *const c_char {
    concat!(env!("CARGO_PKG_VERSION"), "\0").as_ptr().cast()
}

/// The sentence that explains a status.
///
/// @param status any value that a gib function returned.
/// @return static text, NUL-terminated; never NULL, never freed; for an unknown number a text that says so.
///
/// [thread: any] [real-time: yes] [state: any]
#[unsafe(no_mangle)]
pub extern "C" fn gib_status_text(status: i32) -> *const c_char {
    status_text(status).as_ptr().cast()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::{GIB_ERR_NULL, GIB_OK};
    use core::ffi::CStr;

    fn text(pointer: *const c_char) -> &'static str {
        // SAFETY: the functions under test promise static, NUL-terminated text.
        unsafe { CStr::from_ptr(pointer) }.to_str().unwrap()
    }

    #[test]
    fn texts_are_c_strings() {
        assert_eq!(text(gib_version()), env!("CARGO_PKG_VERSION"));
        assert_eq!(text(gib_status_text(GIB_OK)), "ok");
        assert!(text(gib_status_text(GIB_ERR_NULL)).contains("NULL"));
        assert!(text(gib_status_text(i32::MIN)).contains("unknown"));
    }
}
