//! The last part of a touch: torque against way, as means over blocks of cycles in a ring of fixed size.

/// Blocks that a trace holds; a power of two.
pub const BLOCKS: usize = 2048;

/// A block that never fills.
const PAUSED: u32 = u32::MAX;

/// Torque against way, oldest block first.
#[derive(Debug, Clone)]
pub struct Trace {
    /// Blocks written since the start.
    written: u32,
    /// Share of a sample in its block's mean.
    share: f64,
    length: u32,
    /// Cycles after which a block is full: `length`, or `PAUSED`.
    full: u32,
    in_block: u32,
    position: f64,
    torque: f64,
    origin: f64,
    sense: f64,
    torque_sense: f64,
    /// Position and torque as read.
    blocks: [[f64; 2]; BLOCKS],
}

impl Default for Trace {
    fn default() -> Trace {
        Trace {
            written: 0,
            share: 1.0,
            length: 1,
            full: PAUSED,
            in_block: 0,
            position: 0.0,
            torque: 0.0,
            origin: 0.0,
            sense: 1.0,
            torque_sense: 1.0,
            blocks: [[0.0; 2]; BLOCKS],
        }
    }
}

impl Trace {
    /// Starts anew with blocks of `length` cycles, at least 1. Ways count from `origin` in the sense `sense` (±1); the
    /// torque is positive in that sense once multiplied with `torque_sense` (±1).
    pub fn start(&mut self, length: u32, origin: f64, sense: f64, torque_sense: f64) {
        (self.origin, self.sense, self.torque_sense) = (origin, sense, torque_sense);
        self.length = length.max(1);
        self.full = self.length;
        self.share = 1.0 / f64::from(self.length);
        self.written = 0;
        self.in_block = 0;
        self.position = 0.0;
        self.torque = 0.0;
    }

    /// Keeps what is there until the next start or `resume`, whatever is added.
    pub fn pause(&mut self) {
        self.full = PAUSED;
        self.in_block = 0;
    }

    /// Goes on after a pause, with a new block.
    pub fn resume(&mut self) {
        self.full = self.length;
        self.in_block = 0;
        self.position = 0.0;
        self.torque = 0.0;
    }

    /// Whether nothing is kept now.
    #[must_use]
    pub fn paused(&self) -> bool {
        self.full == PAUSED
    }

    /// Whether every cycle is a block here and there, of the same place.
    #[must_use]
    pub fn even_with(&self, other: &Trace) -> bool {
        self.full == 1 && other.full == 1 && self.written == other.written
    }

    /// Adds the position (mm) and torque of a cycle, as they were read; false when paused.
    #[inline(always)]
    pub fn add(&mut self, position: f64, torque: f64) -> bool {
        if self.full == 1 {
            self.put([position, torque]);
            return true;
        }
        if self.full == PAUSED {
            return false;
        }
        self.position += position;
        self.torque += torque;
        self.in_block += 1;
        if self.in_block >= self.full {
            self.put([self.position * self.share, self.torque * self.share]);
            self.in_block = 0;
            self.position = 0.0;
            self.torque = 0.0;
        }
        true
    }

    /// Adds a block of one cycle's position (mm) and torque, as they were read; its place.
    #[inline(always)]
    pub fn put(&mut self, block: [f64; 2]) -> usize {
        let place = self.written as usize & (BLOCKS - 1);
        self.put_at(place, block);
        place
    }

    /// Adds a block whose place is known.
    #[inline(always)]
    pub fn put_at(&mut self, place: usize, block: [f64; 2]) {
        self.blocks[place & (BLOCKS - 1)] = block;
        self.written = self.written.wrapping_add(1);
    }

    /// Standard deviation of one sample about the line through its neighbours, over the last 32 blocks.
    #[must_use]
    pub fn noise(&self) -> f64 {
        const LAST: u32 = 32;
        let (to, mut squares) = (self.len(), 0.0);
        for i in to.saturating_sub(LAST) + 2..to {
            let bend = self.block(i).1 - 2.0 * self.block(i - 1).1 + self.block(i - 2).1;
            squares += bend * bend;
        }
        // Of white noise, 1 + 4 + 1 times its square.
        (squares / (6.0 * f64::from(LAST - 2)) * f64::from(self.length)).sqrt()
    }

    /// Whether the last `blocks` blocks, at least 2, all hold the very same torque, which no live sensor gives.
    #[must_use]
    pub fn stuck(&self, blocks: u32) -> bool {
        let to = self.len();
        to >= blocks && (to - blocks + 1..to).all(|i| self.block(i).1 == self.block(i - 1).1)
    }

    /// Blocks held.
    #[must_use]
    pub fn len(&self) -> u32 {
        self.written.min(BLOCKS as u32)
    }

    /// True before the first whole block.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.written == 0
    }

    /// Way at the last block, mm; 0 before the first.
    #[must_use]
    pub fn last_way(&self) -> f64 {
        if self.is_empty() { 0.0 } else { self.block(self.len().wrapping_sub(1)).0 }
    }

    /// Way (mm) and torque of block `i`, 0 is the oldest held; any `i` is safe to ask for.
    #[must_use]
    #[inline(always)]
    pub fn block(&self, i: u32) -> (f64, f64) {
        let place = (self.written.wrapping_sub(self.len()).wrapping_add(i)) as usize & (BLOCKS - 1);
        let [position, torque] = self.blocks[place];
        (self.sense * (position - self.origin), self.torque_sense * torque)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_are_means_and_the_oldest_goes_first() {
        let mut trace = Trace::default();
        trace.start(2, 0.0, 1.0, 1.0);
        (0..7).for_each(|i| assert!(trace.add(f64::from(i), 1.0)));
        assert_eq!((trace.len(), trace.block(0), trace.block(2)), (3, (0.5, 1.0), (4.5, 1.0)));
        trace.start(1, 5.0, -1.0, -1.0);
        (0..BLOCKS + 3).for_each(|i| assert!(trace.add(5.0 - i as f64, -1.0)));
        assert_eq!((trace.len(), trace.block(0)), (BLOCKS as u32, (3.0, 1.0)));
        assert_eq!(trace.block(BLOCKS as u32 - 1), ((BLOCKS + 2) as f64, 1.0));
        assert!(trace.stuck(100) && !Trace::default().stuck(100));
        trace.pause();
        (0..10).for_each(|_| assert!(!trace.add(0.0, 1.0)));
        assert_eq!(trace.last_way(), (BLOCKS + 2) as f64);
        trace.resume();
        assert!(trace.add(0.0, 1.0));
        assert_eq!(trace.last_way(), 5.0);
    }
}
