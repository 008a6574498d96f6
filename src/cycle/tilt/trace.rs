//! The blocks of a path that count: where they are, how deep the cut was, and how far the tool had cut before.

use super::load::Mean;
use super::plan::Plan;

/// Blocks that a path can have.
pub const BLOCKS: usize = 2048;

/// Times its feed that no tool moves in the cut: an override stays below twice.
const JUMP: f64 = 5.0;

/// One block.
#[derive(Debug, Clone, Copy, Default)]
pub struct Block {
    /// Position from the start of the path, mm.
    pub x: f64,
    /// As `x`.
    pub y: f64,
    /// Depth, mm; when teaching, the load.
    pub value: f64,
    /// Load by which one unit of `value` shows: residuals are judged as loads, where the noise is.
    pub gain: f64,
    /// Load that it was read from.
    pub load: f64,
    /// Cut so far, m.
    pub cut: f64,
    /// Way from the start of its pass, mm.
    pub along: f64,
    /// Residual in load, written by the fit.
    pub residual: f64,
}

/// Blocks that were not taken, by reason.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Counts {
    /// Spindle speed or feed of another condition.
    pub off_condition: u32,
    /// Load outside the table.
    pub outside: u32,
    /// Samples on too few phases of the current.
    pub aliased: u32,
}

/// The blocks of one path.
#[derive(Debug, Clone)]
pub struct Trace {
    blocks: [Block; BLOCKS],
    used: usize,
    /// First block of the present pass.
    pass: usize,
    origin: [f64; 2],
    cut: f64,
    along: f64,
    last: Option<([f64; 2], f64)>,
    /// Load of the last block that counted, how many have had that of the one before, and whether at more loads than one.
    load: f64,
    repeated: u32,
    rest: Option<f64>,
    grid: bool,
    /// Blocks at a speed that no tool in the cut has.
    jumped: u32,
    /// Way in the present pass behind which its blocks do not count, once it has ended.
    exit: Option<f64>,
    /// What was left out.
    pub counts: Counts,
}

impl Default for Trace {
    fn default() -> Trace {
        Trace {
            blocks: [Block { x: 0.0, y: 0.0, value: 0.0, gain: 0.0, load: 0.0, cut: 0.0, along: 0.0, residual: 0.0 };
                BLOCKS],
            used: 0,
            pass: 0,
            origin: [0.0; 2],
            cut: 0.0,
            along: 0.0,
            last: None,
            load: 0.0,
            repeated: 0,
            rest: None,
            grid: false,
            jumped: 0,
            exit: None,
            counts: Counts::default(),
        }
    }
}

impl Trace {
    /// Forgets what was there; a path begins at `origin` (x y, mm). The blocks themselves are left to be written over.
    pub fn clear(&mut self, origin: [f64; 2]) {
        self.used = 0;
        self.pass = 0;
        self.origin = origin;
        self.cut = 0.0;
        self.exit = None;
        (self.load, self.repeated, self.jumped) = (f64::INFINITY, 0, 0);
        (self.rest, self.grid) = (None, false);
        self.counts = Counts::default();
        self.begin_pass();
    }

    /// A pass begins.
    pub fn begin_pass(&mut self) {
        while self.leave() {}
        self.pass = self.used;
        self.along = 0.0;
        self.last = None;
    }

    /// A pass has ended.
    pub fn end_pass(&mut self, plan: &Plan) {
        // The last block of a pass is half a block long beyond its middle, and one more was not finished.
        self.exit = Some(self.along - plan.entry);
    }

    /// Takes out some blocks in which the tool left the cut; true when there may be more.
    pub fn leave(&mut self) -> bool {
        const SLICE: usize = 16;
        let Some(exit) = self.exit else { return false };
        for _ in 0..SLICE {
            let last = self.blocks().last().is_some_and(|block| block.along > exit);
            if !last || self.used <= self.pass {
                self.exit = None;
                return false;
            }
            self.used -= 1;
        }
        true
    }

    /// Takes a block that was measured; false when it does not count.
    pub fn take(&mut self, plan: &Plan, mean: &Mean, teach: bool) -> bool {
        let [x, y] = mean.position;
        let way = self.last.map_or(0.0, |([u, v], _)| ((x - u) * (x - u) + (y - v) * (y - v)).sqrt());
        let time = self.last.map_or(f64::INFINITY, |(_, cycles)| 0.5 * (cycles + mean.cycles));
        // The first block of a pass has no way of its own: only its spindle speed is looked at.
        let feed = if time.is_finite() { way / time } else { 0.5 * (plan.feed[0] + plan.feed[1]) };
        self.cut += 1e-3 * way;
        self.along += way;
        self.last = Some((mean.position, mean.cycles));
        if self.along < plan.entry {
            return false;
        }
        self.jumped += u32::from(feed > JUMP * plan.feed[1]);
        let within = |value: f64, [low, high]: [f64; 2]| value >= low && value <= high;
        if !(within(mean.speed, plan.speed) && within(feed, plan.feed)) {
            self.counts.off_condition += 1;
            if !plan.flag {
                return false;
            }
        }
        if mean.aliased {
            self.counts.aliased += 1;
            return false;
        }
        if same(mean.load, self.load) {
            self.repeated += 1;
            self.grid |= self.rest.is_some_and(|rest| !same(mean.load, rest));
            self.rest = Some(mean.load);
        }
        self.load = mean.load;
        let read = if teach { Some((mean.load, 1.0)) } else { plan.inverse.curved(mean.load) };
        let Some((value, gain)) = read else {
            self.counts.outside += 1;
            return false;
        };
        let (x, y) = (x - self.origin[0], y - self.origin[1]);
        let block = Block { x, y, value, gain, load: mean.load, cut: self.cut, along: self.along, residual: 0.0 };
        let Some(place) = self.blocks.get_mut(self.used) else { return false };
        *place = block;
        self.used += 1;
        true
    }

    /// Blocks within a pass that were reached by a jump.
    #[must_use]
    pub fn jumped(&self) -> u32 {
        self.jumped
    }

    /// Blocks that had exactly the load of the one before.
    #[must_use]
    pub fn repeated(&self) -> u32 {
        self.repeated
    }

    /// Whether they were so at more loads than one, as those of a coarse grid are and those of a sensor that is stuck are not.
    #[must_use]
    pub fn on_grid(&self) -> bool {
        self.grid
    }

    /// The blocks that count.
    #[must_use]
    pub fn blocks(&self) -> &[Block] {
        self.blocks.get(..self.used).unwrap_or(&[])
    }

    /// The same, for the fit to note its residuals.
    pub fn blocks_mut(&mut self) -> &mut [Block] {
        self.blocks.get_mut(..self.used).unwrap_or(&mut [])
    }

    /// Where the path began, x y in mm.
    #[must_use]
    pub fn origin(&self) -> [f64; 2] {
        self.origin
    }
}

/// Whether two means are of one constant, whose sums differ by their rounding.
fn same(load: f64, other: f64) -> bool {
    (load - other).abs() <= 1e-9 * load
}

#[cfg(test)]
mod tests {
    use super::super::plan::tests::valid;
    use super::*;

    fn plan(entry_mm: f64) -> Plan {
        Plan::new(&super::super::config::TiltConfig { entry_mm, ..valid() }).unwrap()
    }

    /// 5 mm/s: half a millimetre a block of 0.1 s.
    fn mean(i: usize) -> Mean {
        Mean { load: 20.0, position: [0.5 * i as f64, 0.0], speed: 2000.0, cycles: 100.0, aliased: false }
    }

    #[test]
    fn the_ends_of_a_pass_do_not_count() {
        let (plan, mut trace) = (plan(5.0), Box::new(Trace::default()));
        trace.clear([0.0; 2]);
        for pass in 0..2 {
            (0..100).for_each(|i| _ = trace.take(&plan, &mean(if pass == 0 { i } else { 99 - i }), true));
            trace.end_pass(&plan);
            trace.begin_pass();
        }
        // 49.5 mm a pass, 5 mm off at each end.
        assert_eq!(trace.blocks().len(), 2 * 80, "{:?}", trace.counts);
        assert!(trace.blocks().iter().all(|b| b.x >= 4.9 && b.x <= 44.6));
        assert!((trace.blocks().last().unwrap().cut - 0.094).abs() < 1e-9);
    }

    #[test]
    fn blocks_of_another_condition_or_phase_are_counted_apart() {
        let (plan, mut trace) = (plan(0.0), Box::new(Trace::default()));
        trace.clear([0.0; 2]);
        trace.take(&plan, &mean(0), true);
        assert!(!trace.take(&plan, &Mean { speed: 1500.0, ..mean(1) }, true));
        assert!(!trace.take(&plan, &Mean { cycles: 50.0, ..mean(2) }, true));
        assert!(!trace.take(&plan, &Mean { aliased: true, cycles: 150.0, ..mean(3) }, true));
        assert!(!trace.take(&plan, &Mean { speed: f64::NAN, ..mean(4) }, true));
        assert_eq!(trace.counts, Counts { off_condition: 3, outside: 0, aliased: 1 });
    }

    /// On a grid it rests at several values; a sensor that is stuck, or at its limit, rests at one.
    #[test]
    fn a_load_that_rests_is_known() {
        let rests = |load: fn(usize) -> f64| {
            let (plan, mut trace) = (plan(0.0), Box::new(Trace::default()));
            trace.clear([0.0; 2]);
            (0..40).for_each(|i| _ = trace.take(&plan, &Mean { load: load(i), ..mean(i) }, true));
            (trace.repeated(), trace.on_grid())
        };
        assert_eq!(rests(|i| 20.0 + 0.01 * (i as f64).sin()), (0, false));
        assert_eq!(rests(|i| 20.0 + 0.01 * (i.min(25) as f64).sin()), (14, false));
        assert_eq!(rests(|i| 20.0 + (i / 10) as f64), (36, true));
    }
}
