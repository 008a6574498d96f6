//! The shared memory of a recorder: a header of 4096 bytes, then a ring of rows. All of it in words of 64 bits.
//!
//! A row is its number, counted from 0, then one value a channel (an IEEE 754 double). Row n stands in slot
//! n mod `capacity`, and was taken in servo cycle n·`every`, that is at n·`every`·`cycle_s` seconds.
//!
//! | word | content |
//! |---|---|
//! | 0 | "gib-ring" in ASCII |
//! | 1 | version of this layout, 1 |
//! | 2 | words of the header, 512 |
//! | 3 | channels |
//! | 4 | capacity, rows |
//! | 5 | `every`: servo cycles from row to row |
//! | 6 | `cycle_s`: servo period in s, a double |
//! | 7 | state: 0 being made, 1 recording, 2 ended |
//! | 16 | head: rows written since the start |
//! | 32 to 39 | name of the machine, text padded with zeros |
//! | 40 to 511 | names of the columns, separated by commas, text padded with zeros |

use crate::error::{Fault, in_range};
use core::sync::atomic::{AtomicU64, Ordering};

/// The first eight bytes.
pub const MAGIC: u64 = u64::from_ne_bytes(*b"gib-ring");
/// Version of the layout.
pub const VERSION: u64 = 1;
/// Words before the ring.
pub const HEADER_WORDS: usize = 512;
/// Bytes for the machine's name.
pub const MACHINE_BYTES: usize = 64;
/// Bytes for the names of the columns.
pub const COLUMNS_BYTES: usize = 8 * (HEADER_WORDS - COLUMNS);

/// Most channels of a recorder.
pub const GIB_RECORDER_CHANNELS_MAX: u32 = 64;

/// Word of the state.
pub const STATE: usize = 7;
/// Word of the head, in a cache line of its own: readers look at it all the time.
pub const HEAD: usize = 16;
const MACHINE: usize = 32;
const COLUMNS: usize = 40;

/// State: the header is being written.
pub const MAKING: u64 = 0;
/// State: rows come in.
pub const RECORDING: u64 = 1;
/// State: no row will come any more.
pub const ENDED: u64 = 2;

/// The numbers of a ring, checked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shape {
    /// Values in a row.
    pub channels: usize,
    /// Rows in the ring.
    pub capacity: usize,
    /// Servo cycles from row to row.
    pub every: u32,
    /// Servo period, s.
    pub cycle_s: f64,
}

impl Shape {
    /// Checks the numbers. A `capacity` of 0 is four seconds of rows, an `every` of 0 is 1.
    ///
    /// # Errors
    /// `GIB_ERR_CONFIG` with the field, its value and its range.
    pub fn new(channels: u32, capacity: u32, every: u32, cycle_s: f64) -> Result<Shape, Fault> {
        const BYTES_MOST: f64 = 1024.0 * 1024.0 * 1024.0;
        let cycle_s = in_range("cycle_s\0", cycle_s, 1e-6, 1.0)?;
        in_range("channels\0", f64::from(channels), 1.0, f64::from(GIB_RECORDER_CHANNELS_MAX))?;
        in_range("every_cycles\0", f64::from(every), 0.0, 1e6)?;
        let every = every.max(1);
        let four_s = (4.0 / (cycle_s * f64::from(every))) as u32;
        let capacity = if capacity == 0 { four_s.max(64) } else { capacity };
        let most = (BYTES_MOST / f64::from(8 * (channels + 1))) as u32;
        in_range("capacity_rows\0", f64::from(capacity), 16.0, f64::from(most))?;
        Ok(Shape { channels: channels as usize, capacity: capacity as usize, every, cycle_s })
    }

    /// Words of a row.
    #[must_use]
    pub const fn row_words(&self) -> usize {
        1 + self.channels
    }

    /// Words of header and ring.
    #[must_use]
    pub const fn words(&self) -> usize {
        HEADER_WORDS + self.capacity * self.row_words()
    }

    /// Seconds from row to row.
    #[must_use]
    pub fn row_s(&self) -> f64 {
        self.cycle_s * f64::from(self.every)
    }

    /// Writes the header; `machine` and `columns` are cut to their room. Readers trust it from the state on, which is set last.
    pub fn write(&self, ring: &[AtomicU64], machine: &[u8], columns: &[u8]) {
        let put = |at: usize, value: u64| {
            if let Some(word) = ring.get(at) {
                word.store(value, Ordering::Relaxed);
            }
        };
        put(STATE, MAKING);
        let numbers = [
            MAGIC,
            VERSION,
            HEADER_WORDS as u64,
            self.channels as u64,
            self.capacity as u64,
            u64::from(self.every),
            self.cycle_s.to_bits(),
        ];
        numbers.into_iter().enumerate().for_each(|(at, value)| put(at, value));
        put(HEAD, 0);
        let text = |at: usize, room: usize, bytes: &[u8]| {
            for (i, chunk) in bytes.get(..room.min(bytes.len())).unwrap_or(&[]).chunks(8).enumerate() {
                let mut word = [0; 8];
                word.iter_mut().zip(chunk).for_each(|(place, byte)| *place = *byte);
                put(at + i, u64::from_ne_bytes(word));
            }
        };
        text(MACHINE, MACHINE_BYTES, machine);
        text(COLUMNS, COLUMNS_BYTES, columns);
        if let Some(state) = ring.get(STATE) {
            state.store(RECORDING, Ordering::Release);
        }
    }

    /// The shape that a header declares; None when it is no header of this layout.
    #[must_use]
    pub fn read(header: &[u64; HEADER_WORDS]) -> Option<Shape> {
        let [magic, version, words, channels, capacity, every, cycle, ..] = *header;
        if magic != MAGIC || version != VERSION || words != HEADER_WORDS as u64 || capacity == 0 || every == 0 {
            return None;
        }
        let small = |value: u64| u32::try_from(value).ok();
        Shape::new(small(channels)?, small(capacity)?, small(every)?, f64::from_bits(cycle)).ok()
    }
}

/// The bytes of the machine's name in a header, with their padding.
#[must_use]
pub fn machine_words(header: &[u64; HEADER_WORDS]) -> &[u64] {
    header.get(MACHINE..COLUMNS).unwrap_or(&[])
}

/// The bytes of the names of the columns in a header, with their padding.
#[must_use]
pub fn column_words(header: &[u64; HEADER_WORDS]) -> &[u64] {
    header.get(COLUMNS..).unwrap_or(&[])
}
