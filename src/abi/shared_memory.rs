//! Shared memory in this process' address space, as words that readers elsewhere may look at at any time.

use crate::error::{Fault, GIB_ERR_MEMORY};
use core::sync::atomic::{AtomicU64, Ordering};
use rustix::mm::{MapFlags, ProtFlags, mlock, mmap, munmap};
use std::fs::File;
use std::os::fd::{FromRawFd, IntoRawFd, RawFd};

/// A mapping. It stays where it is when the instance that holds it is moved. Dropping it does nothing: see `unmap`.
pub struct SharedMemory {
    start: *const AtomicU64,
    words: usize,
    /// Kept open for its lock, which says that the writer lives.
    file: RawFd,
    /// Never paged out.
    pub locked: bool,
}

impl SharedMemory {
    /// Maps the file's first `words` words, with every page in place.
    ///
    /// # Errors
    /// `GIB_ERR_MEMORY`.
    pub fn map(file: File, words: usize) -> Result<SharedMemory, Fault> {
        let (bytes, rights) = (8 * words, ProtFlags::READ | ProtFlags::WRITE);
        // SAFETY: a fresh mapping, nothing is there yet.
        let start =
            unsafe { mmap(core::ptr::null_mut(), bytes, rights, MapFlags::SHARED | MapFlags::POPULATE, &file, 0) }
                .map_err(|_| Fault { field: "capacity_rows\0", ..Fault::of(GIB_ERR_MEMORY) })?;
        for page in (0..bytes).step_by(4096) {
            // A write, so that the first one in the cycle does not enter the system to get the right to.
            // SAFETY: inside the mapping, which nobody else knows yet; the file is all zero.
            unsafe { start.cast::<u8>().add(page).write_volatile(0) };
        }
        // SAFETY: the mapping that was just made.
        let locked = unsafe { mlock(start, bytes) }.is_ok();
        Ok(SharedMemory { start: start.cast(), words, file: file.into_raw_fd(), locked })
    }

    /// All words.
    #[inline(always)]
    pub fn words(&self) -> &[AtomicU64] {
        // SAFETY: mapped from `map` until `unmap`, which takes self; pages are aligned; atomics may be shared.
        unsafe { core::slice::from_raw_parts(self.start, self.words) }
    }

    /// Writes a row: its number, then `count` values, each of which `value` knows. For the cycle: without a check.
    ///
    /// # Safety
    /// `place + 1 + count` is not above the words of the mapping.
    #[inline(always)]
    pub unsafe fn put_row(&self, place: usize, number: u64, count: usize, value: impl Fn(usize) -> f64) {
        // SAFETY: inside the mapping by the caller's promise, which outlives the call and which this process never reads.
        // Another process copies while this writes, and sees by the head which of what it has copied was whole.
        unsafe {
            let row = self.start.cast_mut().cast::<u64>().add(place);
            row.write(number);
            write(count, value, row.add(1).cast::<f64>());
        }
    }

    /// Stores a word so that whoever sees it sees all that was written before. For the cycle: without a check.
    ///
    /// # Safety
    /// `at` is below the words of the mapping.
    #[inline(always)]
    pub unsafe fn release(&self, at: usize, value: u64) {
        // SAFETY: inside the mapping by the caller's promise; atomics may be shared.
        unsafe { &*self.start.add(at) }.store(value, Ordering::Release);
    }

    /// Takes the mapping away and closes the file.
    pub fn unmap(self) {
        // SAFETY: mapped and opened by `map`, and given back once, since this takes self.
        unsafe {
            let _ = munmap(self.start.cast_mut().cast(), 8 * self.words);
            drop(File::from_raw_fd(self.file));
        }
    }
}

/// Writes values in pieces of a fixed size, each a few instructions without a loop: so many channels are not worth more.
///
/// # Safety
/// `to` has room for `count` values, and nobody else in this process uses it.
#[inline(always)]
unsafe fn write(count: usize, value: impl Fn(usize) -> f64, to: *mut f64) {
    // SAFETY: each piece is within the room, since the pieces add up to `count`.
    unsafe {
        let mut at = 0;
        while count - at >= 16 {
            at = piece::<16>(at, &value, to);
        }
        if count & 8 != 0 {
            at = piece::<8>(at, &value, to);
        }
        if count & 4 != 0 {
            at = piece::<4>(at, &value, to);
        }
        if count & 2 != 0 {
            at = piece::<2>(at, &value, to);
        }
        if count & 1 != 0 {
            piece::<1>(at, &value, to);
        }
    }
}

/// Writes `N` values from the one at `at` on; the place behind them.
///
/// # Safety
/// `to` can be written that far.
#[inline(always)]
unsafe fn piece<const N: usize>(at: usize, value: &impl Fn(usize) -> f64, to: *mut f64) -> usize {
    let values: [f64; N] = core::array::from_fn(|i| value(at + i));
    // SAFETY: the caller's promise.
    unsafe { to.add(at).cast::<[f64; N]>().write(values) };
    at + N
}
