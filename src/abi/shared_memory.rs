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

    /// Writes a row: its number, then the values, which `write` puts where it is told. For the cycle: without a check.
    ///
    /// # Safety
    /// From `place` on there is room in the mapping for the number and for what `write` writes.
    #[inline(always)]
    pub unsafe fn put_row(&self, place: usize, number: u64, write: impl FnOnce(*mut f64)) {
        // SAFETY: inside the mapping by the caller's promise, which outlives the call and which this process never reads.
        // Another process copies while this writes, and sees by the head which of what it has copied was whole.
        unsafe {
            let row = self.start.cast_mut().cast::<u64>().add(place);
            row.write(number);
            write(row.add(1).cast::<f64>());
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

/// Copies values in pieces of a fixed size, each a few instructions without a loop: so many channels are not worth more.
///
/// # Safety
/// `from` can be read and `to` written for `count` values, and nobody else in this process uses `to`.
#[inline(always)]
pub unsafe fn copy(from: *const f64, count: usize, to: *mut f64) {
    // SAFETY: each piece is within the values and their room, since the pieces add up to `count`.
    unsafe {
        let (mut from, mut to, mut left) = (from, to, count);
        while left >= 16 {
            piece::<16>(&mut from, &mut to);
            left -= 16;
        }
        if left & 8 != 0 {
            piece::<8>(&mut from, &mut to);
        }
        if left & 4 != 0 {
            piece::<4>(&mut from, &mut to);
        }
        if left & 2 != 0 {
            piece::<2>(&mut from, &mut to);
        }
        if left & 1 != 0 {
            piece::<1>(&mut from, &mut to);
        }
    }
}

/// Copies `N` values and goes on behind them.
///
/// # Safety
/// `from` can be read and `to` written that far.
#[inline(always)]
unsafe fn piece<const N: usize>(from: &mut *const f64, to: &mut *mut f64) {
    // SAFETY: the caller's promise.
    unsafe {
        to.cast::<[f64; N]>().write(from.cast::<[f64; N]>().read());
        (*from, *to) = (from.add(N), to.add(N));
    }
}

/// What a channel without an address has: no number, an empty cell.
static NONE: f64 = f64::NAN;

/// Copies values from an address each, in pieces as [`copy`].
///
/// # Safety
/// Each of the `count` addresses at `from` is NULL or can be read, and `to` written; nobody else in this process uses `to`.
#[inline(always)]
pub unsafe fn gather(from: *const *const f64, count: usize, to: *mut f64) {
    // SAFETY: each place is below `count`, since the pieces add up to it.
    unsafe {
        let mut at = 0;
        while count - at >= 16 {
            gathered::<16>(from, to, &mut at);
        }
        if count & 8 != 0 {
            gathered::<8>(from, to, &mut at);
        }
        if count & 4 != 0 {
            gathered::<4>(from, to, &mut at);
        }
        if count & 2 != 0 {
            gathered::<2>(from, to, &mut at);
        }
        if count & 1 != 0 {
            gathered::<1>(from, to, &mut at);
        }
    }
}

/// Copies `N` values from their addresses and goes on behind them. Each is read once, for others may write there meanwhile.
///
/// # Safety
/// As [`gather`], from `at` on.
#[inline(always)]
unsafe fn gathered<const N: usize>(from: *const *const f64, to: *mut f64, at: &mut usize) {
    // SAFETY: the caller's promise.
    unsafe {
        let values: [f64; N] = core::array::from_fn(|i| {
            let place = from.add(*at + i).read();
            // An address is chosen and read once: no branch a channel.
            let place = if place.is_null() { &raw const NONE } else { place };
            place.read_volatile()
        });
        to.add(*at).cast::<[f64; N]>().write(values);
    }
    *at += N;
}
