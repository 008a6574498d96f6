//! Types that every family shares.

use crate::error::Fault;
use core::ffi::c_char;

/// The first error of an instance, in full.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct GibErrorDetail {
    /// One of the `GIB_ERR_…` numbers, or `GIB_OK` when nothing went wrong.
    pub code: i32,
    /// Zero.
    pub reserved: i32,
    /// Name of the field or input at fault; empty when no single one is. Static text, never NULL.
    pub field: *const c_char,
    /// The value found.
    pub value: f64,
    /// Smallest value allowed. Where no range applies both bounds are 0: of a number that is odd, or a text of a fit length that is
    /// spelled wrong, whose `value` is then the place of its first wrong character, from 1.
    pub low: f64,
    /// Largest value allowed.
    pub high: f64,
}

impl From<Fault> for GibErrorDetail {
    fn from(fault: Fault) -> GibErrorDetail {
        let Fault { code, field, value, low, high } = fault;
        GibErrorDetail { code, reserved: 0, field: field.as_ptr().cast(), value, low, high }
    }
}
