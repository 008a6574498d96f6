//! The blocks of a measurement in bounded room, also where nobody knows how long it will be.
//!
//! Blocks begin short. When the room is full, each new block has the oldest two that follow one another joined to one of twice
//! the length; when all are, new ones are made as long, and so on: there is one join a block, and the room stays at
//! least half full. Of two halves of N samples with means m, slopes s and weighted means w (see [`super::blocks`]) the whole of
//! M = 2N has exactly what its samples would have given, with P(N) = N(N²−1)/12 = Σψ = Σu²:
//!
//! ```text
//! s = (P(N)·(s₁ + s₂) + N²/2·(m₂ − m₁)) / P(M)
//! w = (P(N)·(w₁ + w₂) + N³/4·(m₁ + m₂) + P(N)·N/2·(s₁ − s₂)) / P(M)
//! ```

use super::blocks::{BLOCKS, Block};

/// A signal over a block: mean, slope a sample, weighted mean.
#[derive(Debug, Clone, Copy, Default)]
pub struct Course {
    /// See above.
    pub mean: f64,
    /// See above.
    pub slope: f64,
    /// See above.
    pub weighted: f64,
}

/// A block that can be joined to its neighbour.
#[derive(Debug, Clone, Copy, Default)]
pub struct Whole {
    /// N·m.
    pub torque: Course,
    /// rad/s.
    pub speed: Course,
    /// It begins with the sample after the last one of the block before.
    pub follows: bool,
}

impl Course {
    /// Of two halves of `n` samples each.
    fn joined(self, next: Course, n: f64) -> Course {
        let whole = 2.0 * n * (4.0 * n * n - 1.0) / 12.0;
        let (half, square) = (n * (n * n - 1.0) / 12.0 / whole, 0.5 * n * n / whole);
        let weighted = half * (self.weighted + next.weighted + 0.5 * n * (self.slope - next.slope));
        Course {
            mean: 0.5 * (self.mean + next.mean),
            slope: half * (self.slope + next.slope) + square * (next.mean - self.mean),
            weighted: weighted + 0.5 * n * square * (self.mean + next.mean),
        }
    }
}

impl Whole {
    fn joined(self, next: Whole, n: f64) -> Whole {
        let (torque, speed) = (self.torque.joined(next.torque, n), self.speed.joined(next.speed, n));
        Whole { torque, speed, follows: self.follows }
    }

    fn block(&self, cycle_s: f64) -> Block {
        Block { torque: self.torque.weighted, speed: self.speed.weighted, acceleration: self.speed.slope / cycle_s }
    }
}

/// No place.
const NONE: u16 = u16::MAX;

/// Blocks in order of time: those before `at` are joined already, of twice the length of the others.
#[derive(Debug, Clone, Copy)]
pub struct Kept {
    /// Joins blocks where the room is full; else later ones are not kept.
    joins: bool,
    wholes: [Whole; BLOCKS],
    /// The place of the block after each; a place that is free.
    after: [u16; BLOCKS],
    spare: u16,
    used: u16,
    first: u16,
    last: u16,
    at: u16,
    before: u16,
    /// The block before the next one is not kept.
    broken: bool,
}

impl Kept {
    /// Nothing yet.
    #[must_use]
    pub fn new(joins: bool) -> Kept {
        Kept {
            joins,
            wholes: [Whole::default(); BLOCKS],
            after: [NONE; BLOCKS],
            spare: NONE,
            used: 0,
            first: NONE,
            last: NONE,
            at: NONE,
            before: NONE,
            broken: false,
        }
    }

    fn whole(&self, place: u16) -> Whole {
        self.wholes.get(usize::from(place)).copied().unwrap_or_default()
    }

    fn after(&self, place: u16) -> u16 {
        self.after.get(usize::from(place)).copied().unwrap_or(NONE)
    }

    fn put(&mut self, place: u16, whole: Whole) {
        if let Some(there) = self.wholes.get_mut(usize::from(place)) {
            *there = whole;
        }
    }

    /// `next` comes after `place`; of no place: it is the first.
    fn link(&mut self, place: u16, next: u16) {
        match self.after.get_mut(usize::from(place)) {
            Some(there) => *there = next,
            None => self.first = next,
        }
    }

    /// Keeps a block of `length` samples. True where later ones are to be twice as long.
    pub fn add(&mut self, whole: Whole, length: u32) -> bool {
        let whole = Whole { follows: whole.follows && !self.broken, ..whole };
        self.broken = false;
        let room = usize::from(self.used) < BLOCKS || self.spare != NONE;
        if !room && (!self.joins || self.make_room(whole, f64::from(length))) {
            return self.joins;
        }
        let place = if self.spare == NONE { self.used } else { self.spare };
        self.used += u16::from(self.spare == NONE);
        self.spare = NONE;
        self.put(place, whole);
        self.link(place, NONE);
        self.link(self.last, place);
        if self.at == NONE {
            (self.at, self.before) = (place, self.last);
        }
        self.last = place;
        false
    }

    /// Joins two blocks, or gives up one that has nothing to be joined to. True where all are of twice the length now, with the
    /// `new` one in them where it can be.
    fn make_room(&mut self, new: Whole, n: f64) -> bool {
        let (one, other) = (self.at, self.after(self.at));
        if other == NONE {
            if new.follows {
                self.put(one, self.whole(one).joined(new, n));
            } else {
                self.link(self.before, NONE);
                (self.last, self.spare, self.broken) = (self.before, one, true);
            }
            (self.at, self.before) = (self.first, NONE);
            return true;
        }
        if self.whole(other).follows {
            self.put(one, self.whole(one).joined(self.whole(other), n));
            self.link(one, self.after(other));
            self.last = if self.last == other { one } else { self.last };
            (self.spare, self.before) = (other, one);
            self.at = self.after(one);
        } else {
            self.link(self.before, other);
            (self.spare, self.at) = (one, other);
        }
        false
    }

    /// All blocks of one length, how many, and that length; `length` is that of new ones. Not for the cycle: it joins what is not
    /// joined yet.
    #[must_use]
    pub fn all(&self, length: u32, cycle_s: f64) -> ([Block; BLOCKS], usize, u32) {
        let (mut blocks, mut count) = ([Block::default(); BLOCKS], 0);
        let mut place = self.first;
        let mut keep = |whole: Whole| {
            if let Some(there) = blocks.get_mut(count) {
                *there = whole.block(cycle_s);
                count += 1;
            }
        };
        let halfway = self.before != NONE;
        let mut joined = halfway;
        for _ in 0..BLOCKS {
            joined &= place != self.at;
            let next = self.after(place);
            match () {
                () if place == NONE => break,
                () if joined || !halfway => keep(self.whole(place)),
                () if next != NONE && self.whole(next).follows => {
                    keep(self.whole(place).joined(self.whole(next), f64::from(length)));
                    place = next;
                }
                () => {}
            }
            place = self.after(place);
        }
        (blocks, count, if halfway { 2 * length } else { length })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A block of `length` samples of a motion that bends, from sample `from` on.
    fn block(from: u32, length: u32, follows: bool) -> Whole {
        let n = f64::from(length);
        let course = |x: &dyn Fn(f64) -> f64| {
            let (mut mean, mut slope, mut weighted, mut weights) = (0.0, 0.0, 0.0, 0.0);
            for i in 0..length {
                let u = f64::from(i) - 0.5 * (n - 1.0);
                let psi = 0.5 * (0.25 * (n * n - 1.0) - u * u);
                let value = x(f64::from(from + i));
                mean += value / n;
                slope += u * value;
                weighted += psi * value;
                weights += psi;
            }
            Course { mean, slope: slope / weights, weighted: weighted / weights }
        };
        Whole {
            torque: course(&|t| 3.0 + (0.01 * t).cos()),
            speed: course(&|t| 50.0 + 9.0 * (0.003 * t).sin()),
            follows,
        }
    }

    #[test]
    fn two_halves_give_what_the_whole_gives() {
        for n in [4, 5, 16, 101] {
            let (joined, whole) =
                (block(7, n, true).joined(block(7 + n, n, true), f64::from(n)), block(7, 2 * n, true));
            for (a, b) in [(joined.torque, whole.torque), (joined.speed, whole.speed)] {
                let off = (a.mean - b.mean).abs() + (a.slope - b.slope).abs() + (a.weighted - b.weighted).abs();
                assert!(off < 1e-11, "{n}: {a:?} {b:?}");
            }
        }
    }

    /// However many come, and wherever the row of them is broken: all are of one length, in order, and fill half of the room.
    #[test]
    fn the_room_stays_half_full_of_blocks_of_one_length() {
        for (gap, least) in [(u32::MAX, BLOCKS / 2), (37, BLOCKS / 4), (5, 16)] {
            let (mut kept, mut length, mut from) = (Kept::new(true), 4, 0);
            for count in 1..6000 {
                let broken = count % gap == 0;
                from += if broken { 3 } else { 0 };
                let whole = block(from, length, !broken);
                from += length;
                length *= if kept.add(whole, length) { 2 } else { 1 };
                if count % 97 != 0 {
                    continue;
                }
                let (blocks, used, of) = kept.all(length, 1.0);
                let blocks = &blocks[..used];
                assert!(used >= least.min(count as usize / 4), "{gap} {count}: {used} of {of} samples");
                // A straight part of the motion tells the time at which each block lies.
                let mut expected = (0..=from).map(|at| block(at, of, true).block(1.0));
                if from < 12_000 {
                    for found in blocks {
                        let near = |other: &Block| {
                            (other.speed - found.speed).abs() + (other.torque - found.torque).abs() < 1e-9
                        };
                        assert!(
                            expected.any(|other| near(&other)),
                            "{gap} {count}: {found:?} is none of {of} samples, or out of order"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn without_joins_the_first_are_kept() {
        let mut kept = Kept::new(false);
        assert!((0..2000).all(|i| !kept.add(block(4 * i, 4, true), 4)));
        let (blocks, used, length) = kept.all(4, 1.0);
        assert!((used, length) == (BLOCKS, 4) && blocks[511] == block(4 * 511, 4, true).block(1.0));
    }
}
