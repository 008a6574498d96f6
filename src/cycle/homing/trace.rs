//! The last part of a touch: torque against way, as means over blocks of cycles in a ring of fixed size.

/// Blocks that a trace holds; a power of two.
pub const BLOCKS: usize = 2048;

/// Blocks that are summed at once, and such groups in the ring.
pub const GROUP: usize = 16;
const GROUPS: usize = BLOCKS / GROUP;

/// A block that never fills.
const PAUSED: u32 = u32::MAX;

/// Blocks side by side in memory, position and torque as read, and the block before them.
#[derive(Debug, Clone, Copy)]
#[expect(missing_docs, reason = "told above")]
pub struct Group<'a> {
    pub before: [f64; 2],
    pub blocks: &'a [[f64; 2]; GROUP],
}

/// How positions and torques as read become ways from a place and torques toward the stop.
#[derive(Debug, Clone, Copy, Default)]
pub struct Frame {
    /// Position from which ways count, mm.
    pub origin: f64,
    /// ±1: ways grow toward the stop.
    pub sense: f64,
    /// The same of torques.
    pub torque_sense: f64,
}

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
    /// Whether that is after every cycle. A cycle at constant speed asks this first, in the fewest instructions.
    even: bool,
    in_block: u32,
    position: f64,
    torque: f64,
    frame: Frame,
    /// Position and torque as read.
    blocks: [[f64; 2]; BLOCKS],
}

impl Group<'_> {
    /// Block `i`, and before it the one that was before.
    #[must_use]
    #[inline(always)]
    pub fn pair(&self, i: u32) -> [[f64; 2]; 2] {
        let i = i as usize % GROUP;
        [if i == 0 { self.before } else { self.blocks[(i - 1) % GROUP] }, self.blocks[i]]
    }
}

impl Frame {
    /// Way and torque of a block.
    #[must_use]
    #[inline(always)]
    pub fn of(&self, [position, torque]: [f64; 2]) -> (f64, f64) {
        (self.sense * (position - self.origin), self.torque_sense * torque)
    }
}

impl Default for Trace {
    fn default() -> Trace {
        Trace {
            written: 0,
            share: 1.0,
            length: 1,
            full: PAUSED,
            even: false,
            in_block: 0,
            position: 0.0,
            torque: 0.0,
            frame: Frame { origin: 0.0, sense: 1.0, torque_sense: 1.0 },
            blocks: [[0.0; 2]; BLOCKS],
        }
    }
}

impl Trace {
    /// Starts anew with blocks of `length` cycles, at least 1. Ways count from `origin` in the sense `sense` (±1); the
    /// torque is positive in that sense once multiplied with `torque_sense` (±1).
    pub fn start(&mut self, length: u32, origin: f64, sense: f64, torque_sense: f64) {
        self.frame = Frame { origin, sense, torque_sense };
        self.length = length.max(1);
        (self.full, self.even) = (self.length, self.length == 1);
        self.share = 1.0 / f64::from(self.length);
        self.written = 0;
        self.in_block = 0;
        self.position = 0.0;
        self.torque = 0.0;
    }

    /// Keeps what is there until the next start or `resume`, whatever is added.
    pub fn pause(&mut self) {
        (self.full, self.even) = (PAUSED, false);
        self.in_block = 0;
    }

    /// Goes on after a pause, with a new block.
    pub fn resume(&mut self) {
        (self.full, self.even) = (self.length, self.length == 1);
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
        self.even && other.even && self.written == other.written
    }

    /// Adds the position (mm) and torque of a cycle, as they were read; false when paused.
    #[inline(always)]
    pub fn add(&mut self, position: f64, torque: f64) -> bool {
        if self.even {
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
        let from = to.saturating_sub(LAST);
        let torque = |i| self.block(i).1;
        let (mut last, mut before) = (torque(from + 1), torque(from));
        for i in from + 2..to {
            let now = torque(i);
            let bend = now - 2.0 * last + before;
            squares += bend * bend;
            (last, before) = (now, last);
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
        self.frame.of(self.blocks[self.oldest().wrapping_add(i) as usize & (BLOCKS - 1)])
    }

    /// How many blocks were written before the oldest held.
    #[inline(always)]
    fn oldest(&self) -> u32 {
        self.written.wrapping_sub(self.len())
    }

    /// Blocks of group 0 before the oldest held: these and those after the last are none of this touch.
    #[must_use]
    #[inline(always)]
    pub fn lead(&self) -> u32 {
        self.oldest() % GROUP as u32
    }

    /// Way and torque of block `i` in `frame`, counted from the start of group 0.
    #[must_use]
    #[inline(always)]
    pub fn in_frame(&self, frame: &Frame, i: u32) -> (f64, f64) {
        let start = self.oldest() & !(GROUP as u32 - 1);
        frame.of(self.blocks[start.wrapping_add(i) as usize % BLOCKS])
    }

    /// Group `i`, that of the oldest block is 0; any `i` is safe to ask for.
    #[must_use]
    #[inline(always)]
    pub fn group(&self, i: u32) -> Group<'_> {
        let place = (self.oldest() / GROUP as u32).wrapping_add(i) as usize % GROUPS;
        let (groups, _) = self.blocks.as_chunks::<GROUP>();
        Group { before: self.blocks[(GROUP * place).wrapping_sub(1) % BLOCKS], blocks: &groups[place] }
    }

    /// The frame whose ways count from the last block.
    #[must_use]
    pub fn frame_at_end(&self) -> Frame {
        let last = self.written.wrapping_sub(1) as usize % BLOCKS;
        Frame { origin: self.blocks[last][0], ..self.frame }
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
