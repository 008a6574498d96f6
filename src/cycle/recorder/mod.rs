//! Family `recorder`: chosen channels of every servo cycle, put where a program without real time can take them.
//!
//! One writer, in the cycle; any number of readers, each with a place of its own, none of which the writer knows of. The
//! writer never waits: it goes round a ring and overwrites the oldest row. A reader that is too slow loses oldest rows, and
//! can tell how many.
//!
//! - [`layout`]: what stands where in the shared memory; versioned.
//! - [`writer`]: one row a cycle, and why no reader ever takes a torn one.

pub mod layout;
pub mod writer;
