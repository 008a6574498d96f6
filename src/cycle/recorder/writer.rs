//! One row a cycle into the ring, without waiting for anybody.
//!
//! Why no reader takes a torn row: row n goes into the slot of row n − capacity, and the head says n from before the
//! first of its words until after the last. A reader copies rows, then looks at the head again: of a head h every row
//! from h − capacity + 1 on was whole while it was copied. The two fences make it hold on processors that reorder.

use super::layout::{ENDED, HEADER_WORDS, STATE, Shape};
use core::sync::atomic::{AtomicU64, Ordering, fence};

/// The constants of a cycle.
#[derive(Debug, Clone, Copy)]
pub struct Plan {
    /// Values in a row.
    pub channels: u32,
    row_words: usize,
    /// Words of header and ring.
    pub words: usize,
    /// Cycles without a row after one with.
    pause: u32,
}

impl Plan {
    /// Records nothing.
    pub const REST: Plan = Plan { channels: 0, row_words: 1, words: 0, pause: 0 };

    /// The constants of a ring of this shape.
    #[must_use]
    pub const fn new(shape: &Shape) -> Plan {
        Plan {
            channels: shape.channels as u32,
            row_words: shape.row_words(),
            words: shape.words(),
            pause: shape.every.saturating_sub(1),
        }
    }
}

/// Where the writer is.
#[derive(Debug, Clone, Copy)]
pub struct State {
    /// Rows written.
    pub rows: u64,
    /// First word of the next row.
    place: usize,
    /// Cycles until the next row.
    wait: u32,
}

impl State {
    /// Before the first row.
    pub const START: State = State { rows: 0, place: HEADER_WORDS, wait: 0 };
}

/// One servo cycle. When a row is due, `row` gets its first word's place and its number and writes it, then `head` gets the
/// rows written so far and stores them with release.
#[inline(always)]
pub fn step(plan: &Plan, state: &mut State, row: impl FnOnce(usize, u64), head: impl FnOnce(u64)) {
    // All is read before the fence: what is behind one, the compiler must read again.
    let State { rows, place, wait } = *state;
    if wait > 0 {
        state.wait = wait - 1;
        return;
    }
    let end = place + plan.row_words;
    *state = State { rows: rows + 1, place: if end < plan.words { end } else { HEADER_WORDS }, wait: plan.pause };
    // The head that the last row wrote is seen before any word of this one, and this one before its head.
    fence(Ordering::Release);
    row(place, rows);
    head(rows + 1);
}

/// Tells the readers that no row will come any more.
pub fn end(ring: &[AtomicU64]) {
    if let Some(state) = ring.get(STATE) {
        state.store(ENDED, Ordering::Release);
    }
}

#[cfg(test)]
mod tests {
    use super::super::layout::HEAD;
    use super::*;

    /// One cycle into a ring in plain memory.
    fn record(plan: &Plan, state: &mut State, ring: &[AtomicU64], values: &[f64]) {
        let row = |place: usize, number: u64| {
            ring[place].store(number, Ordering::Relaxed);
            for (word, value) in ring[place + 1..].iter().zip(values) {
                word.store(value.to_bits(), Ordering::Relaxed);
            }
        };
        step(plan, state, row, |rows| ring[HEAD].store(rows, Ordering::Release));
    }

    fn ring(shape: &Shape) -> Vec<AtomicU64> {
        let ring: Vec<AtomicU64> = (0..shape.words()).map(|_| AtomicU64::new(0)).collect();
        shape.write(&ring, b"rig", b"x.position_mm");
        ring
    }

    #[test]
    fn rows_stand_in_their_slots_and_the_oldest_goes_first() {
        for channels in 1..=9 {
            let shape = Shape::new(channels, 16, 1, 0.001).unwrap();
            let (ring, plan, mut state) = (ring(&shape), Plan::new(&shape), State::START);
            for n in 0..40_u32 {
                let values: Vec<f64> = (0..channels).map(|c| f64::from(100 * n + c)).collect();
                record(&plan, &mut state, &ring, &values);
            }
            assert_eq!(ring[HEAD].load(Ordering::Relaxed), 40);
            for n in 24..40_u32 {
                let row = HEADER_WORDS + (n as usize % 16) * shape.row_words();
                assert_eq!(ring[row].load(Ordering::Relaxed), u64::from(n));
                for c in 0..channels {
                    let value = f64::from_bits(ring[row + 1 + c as usize].load(Ordering::Relaxed));
                    assert_eq!(value, f64::from(100 * n + c));
                }
            }
        }
    }

    #[test]
    fn every_third_cycle() {
        let shape = Shape::new(1, 16, 3, 0.001).unwrap();
        let (ring, plan, mut state) = (ring(&shape), Plan::new(&shape), State::START);
        (0..10).for_each(|n| record(&plan, &mut state, &ring, &[f64::from(n)]));
        assert_eq!(state.rows, 4);
        let second = f64::from_bits(ring[HEADER_WORDS + 2 + 1].load(Ordering::Relaxed));
        assert_eq!(second, 3.0);
    }

    #[test]
    fn bounds_are_named() {
        let refused = |channels, capacity, every, cycle_s| {
            Shape::new(channels, capacity, every, cycle_s).unwrap_err().field.trim_end_matches('\0')
        };
        assert_eq!(refused(0, 0, 0, 0.001), "channels");
        assert_eq!(refused(65, 0, 0, 0.001), "channels");
        assert_eq!(refused(1, 15, 0, 0.001), "capacity_rows");
        assert_eq!(refused(64, 1 << 24, 0, 0.001), "capacity_rows");
        assert_eq!(refused(1, 0, 2_000_000, 0.001), "every_cycles");
        assert_eq!(refused(1, 0, 1, f64::NAN), "cycle_s");
        assert_eq!(Shape::new(24, 0, 0, 1.0 / 32000.0).unwrap().capacity, 128_000);
    }
}
