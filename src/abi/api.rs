//! The table of all functions, for kernels that load gib with `dlopen` and want to look up one symbol only.
//!
//! Only ever append: a kernel compiled against a shorter table keeps its offsets, and tells from `struct_size`
//! what a library has. A function is one line in the struct and one in the table; the compiler compares the
//! signatures, and `tests/header.rs` fails when an exported function is not here.

use super::{GIB_ABI_VERSION, gib_abi_version, gib_status_text, gib_version};
use core::ffi::c_char;

/// All functions of the library, each named as in this header without its `gib_`.
///
/// Get it from `gib_api`. A member whose offset is not below `struct_size` is not in this library.
#[repr(C)]
pub struct GibApiTable {
    /// Size of the table that this library has, in bytes.
    pub struct_size: u32,
    /// Zero.
    pub reserved: u32,

    /// See gib_abi_version.
    pub abi_version: extern "C" fn() -> u32,
    /// See gib_version.
    pub version: extern "C" fn() -> *const c_char,
    /// See gib_status_text.
    pub status_text: extern "C" fn(status: i32) -> *const c_char,
}

static API: GibApiTable = GibApiTable {
    struct_size: size_of::<GibApiTable>() as u32,
    reserved: 0,

    abi_version: gib_abi_version,
    version: gib_version,
    status_text: gib_status_text,
};

/// The table of all functions, so that `dlsym` needs one name: "gib_api".
///
/// @param version pass `GIB_ABI_VERSION`.
/// @return a table that lives as long as the library is loaded and is never freed; NULL when this library cannot serve
/// that version, because its major differs or its minor is older.
///
/// [thread: any] [real-time: yes] [state: any]
#[unsafe(no_mangle)]
pub extern "C" fn gib_api(version: u32) -> *const GibApiTable {
    if serves(GIB_ABI_VERSION, version) { &raw const API } else { core::ptr::null() }
}

/// Whether a library of version `have` serves a caller of version `wanted`: same major, minor not older.
fn serves(have: u32, wanted: u32) -> bool {
    have >> 16 == wanted >> 16 && wanted & 0xffff <= have & 0xffff
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn table_is_served_for_this_major_and_older_minors_only() {
        assert!(core::ptr::eq(gib_api(GIB_ABI_VERSION), &raw const API));
        assert!(gib_api(GIB_ABI_VERSION + 1).is_null());
        assert!(gib_api(GIB_ABI_VERSION + 0x1_0000).is_null());
        assert!(serves(0x2_0005, 0x2_0003) && !serves(0x2_0005, 0x2_0006) && !serves(0x2_0005, 0x1_0005));
    }
}
