//! The recorder's shared memory, seen from outside the cycle: made for a writer, and read while it is written.
//!
//! It is a file of its own in shared memory, `/dev/shm/gib-<name>`; what stands in it says [`crate::cycle::recorder::layout`].
//! The writer holds a lock on it for its life, which the system takes away when it dies: so a reader tells a writer that
//! pauses from one that is gone, and a new writer clears away what a dead one left.

mod create;
mod read;

pub use create::{Created, Wanted, create, remove};
pub use read::{Batch, Ring, rings};

use std::path::PathBuf;

/// Most characters of a recorder's name.
pub const NAME_MOST: usize = 40;

/// Whether a recorder may have this name: letters, digits, `-`, `_`, `.`, not at the start.
#[must_use]
pub fn is_name(name: &str) -> bool {
    let fit = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
    (1..=NAME_MOST).contains(&name.len()) && name.chars().all(fit) && !name.starts_with('.')
}

/// Where the shared memory of this name stands.
fn path(name: &str) -> PathBuf {
    PathBuf::from(format!("/dev/shm/gib-{name}"))
}
