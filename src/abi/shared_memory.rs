//! Shared memory in this process' address space, as words that readers elsewhere may look at at any time.

use crate::error::{Fault, GIB_ERR_MEMORY};
use core::sync::atomic::AtomicU64;
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

    /// Takes the mapping away and closes the file.
    pub fn unmap(self) {
        // SAFETY: mapped and opened by `map`, and given back once, since this takes self.
        unsafe {
            let _ = munmap(self.start.cast_mut().cast(), 8 * self.words);
            drop(File::from_raw_fd(self.file));
        }
    }
}
