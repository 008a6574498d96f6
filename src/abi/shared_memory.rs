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

    /// Writes a row: its number, then its values. For the cycle: without a check.
    ///
    /// # Safety
    /// `place + 1 + values.len()` is not above the words of the mapping.
    #[inline(always)]
    pub unsafe fn put_row(&self, place: usize, number: u64, values: &[f64]) {
        // SAFETY: inside the mapping by the caller's promise, which outlives the call and which this process never reads.
        // Another process copies while this writes, and sees by the head which of what it has copied was whole.
        unsafe {
            let row = self.start.cast_mut().cast::<u64>().add(place);
            row.write(number);
            let mut cell = row.add(1).cast::<f64>();
            let (fours, rest) = values.as_chunks::<4>();
            for four in fours {
                cell.cast::<[f64; 4]>().write(*four);
                cell = cell.add(4);
            }
            for value in rest {
                cell.write(*value);
                cell = cell.add(1);
            }
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
