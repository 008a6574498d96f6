//! Where the torque–position line of a touch starts: the contact point.
//!
//! Sliding toward the stop the torque is a level T₀ (friction, gravity). From contact on it rises with the
//! stiffness of drive and stop in series, k in N·m/mm, while friction stays what it was:
//!
//! ```text
//! T(x) = T₀                 x < xc
//! T(x) = T₀ + k·(x − xc)    x ≥ xc          xc = x̄ − (T̄ − T₀)/k
//! ```
//!
//! xc needs neither the torque limit nor k to be known, so neither moves the home position. First every split of the
//! blocks into a level and a line is tried, least squares decides (Hudson's two-phase regression); then level and line
//! are fitted anew without the blocks near the corner, where the axis still brakes and J·a disturbs the torque, and
//! near the limit, where the drive cuts it off. Both are chosen by position, never by the noisy torque.
//!
//! Blocks are looked at once, a group of them at a time. Sums up to the start of every group are kept, of which two and
//! a few blocks give those of any part. What scatters about a level or a line can only grow with the blocks in it: so a
//! group is passed over in which no split can be better than the best so far, and the search, which begins at the limit,
//! ends where the line alone scatters more than that. Work is cut into slices, so that a cycle's share is bounded.

use super::trace::{BLOCKS, Frame, GROUP, Trace};
use crate::error::Fault;
use contact::{FEWEST, Parts, SURE, lacks};
use sums::{Start, Steps, Sums};

mod contact;
mod sums;
#[cfg(test)]
mod tests;

pub use contact::Contact;

/// Blocks in a group.
const SIZE: u32 = GROUP as u32;
/// Groups that a trace takes up: its first block is anywhere in one.
const GROUPS: usize = BLOCKS / GROUP + 1;
/// Blocks at which a split is tried in a cycle, and groups passed over. Sums are taken of one group a cycle.
const TRIED: u32 = 4;
const PASSED: u32 = 16;
/// Blocks for which the axis rests a cycle, three times over: there is more time than work. With less rest random gantries are found
/// worse, and a tight spot may be named a soft stop.
const RESTED: u32 = 8;
/// Part of the line that is used: from the share of the rise where impact is over to the one where limiting is near. On
/// random axes the contact found with 0.13 lies 0.15 µm off in the mean, with 0.2 nothing.
const LINE_FROM: f64 = 0.2;
const LINE_TO: f64 = 0.95;
/// The level ends this share of the line's length before the corner.
const LEVEL_GAP: f64 = 0.1;
/// Where the parts end, as shares of the line's length from the corner: the level, nothing, both halves of the line.
const ENDS: [f64; 4] = [-LEVEL_GAP, LINE_FROM, 0.5 * (LINE_FROM + LINE_TO), LINE_TO];

#[derive(Debug, Clone, Copy, PartialEq)]
enum Stage {
    /// Ends when the first block of the window is found.
    Window,
    /// Ends when all torques are summed or the threshold is met.
    Torques,
    /// Ends when the ways of all groups are summed that may hold the corner, from the last on.
    Ways,
    /// Ends when every split is tried that may be the best.
    Split,
    /// Ends when the ends of level and line are found.
    Ends,
    /// Ends with the contact point or the want of it.
    Solve,
    /// Ends when the first quarter is summed, where there is no contact point.
    Early,
    /// Ends when the axis has rested, and with the next start.
    Ready,
}

/// A place between two blocks: sums and steps up to it, and steps up to the block behind it.
#[derive(Debug, Clone, Copy, Default)]
struct Mark {
    sums: Sums,
    steps: Steps,
    across: Steps,
}

/// The best split so far: squares that it leaves about level and line, and where its line starts.
#[derive(Debug, Clone, Copy)]
struct Best {
    left: f64,
    corner: f64,
}

impl Best {
    /// Tries the split of what lies from `first` to `past` at `at`: squares about level and line.
    #[inline(always)]
    fn try_split(&mut self, first: &Sums, at: &Sums, past: &Sums) -> [f64; 2] {
        let (level, line) = (at.since(first), past.since(at));
        let ((slope, about_line), about_level) = (line.line(), level.scatter());
        let left = about_level + about_line;
        if left < self.left && slope > 0.0 && level.n >= FEWEST && line.n >= FEWEST {
            self.left = left;
            self.corner = line.x / line.n - (line.t / line.n - level.t / level.n) / slope;
        }
        [about_level, about_line]
    }
}

/// A fit under way. Blocks are numbered from the start of the group that holds the oldest.
#[derive(Debug, Clone)]
pub struct Fit {
    stage: Stage,
    /// Cycles so far, and those for which the axis rests.
    cycles: u32,
    rest: u32,
    /// Next block, group or end.
    at: u32,
    /// First block, one past the last before the limit, and its group.
    begin: u32,
    end: u32,
    last: u32,
    /// First group whose ways are summed.
    lowest: u32,
    /// Ways before this are not looked at: after a reversal the torque first takes up the lost motion.
    from: f64,
    window: f64,
    threshold: f64,
    frame: Frame,
    /// At `begin`, `end`, and at the end of each part.
    first: Mark,
    past: Sums,
    ends: [Mark; 4],
    /// Of ways and torques in the first quarter of the window.
    early: Sums,
    /// Up to where splits are tried.
    running: Sums,
    /// What the line that begins at the group after the one at hand scatters.
    behind: f64,
    best: Best,
    /// Length of its line.
    length: f64,
    parts: Parts,
    found: Result<Contact, Fault>,
    /// Up to the start of each group; what the best split within it leaves at least.
    groups: [Start; GROUPS + 1],
    within: [f64; GROUPS + 1],
}

impl Default for Fit {
    fn default() -> Fit {
        Fit {
            stage: Stage::Ready,
            cycles: 0,
            rest: 0,
            at: 0,
            begin: 0,
            end: 0,
            last: 0,
            lowest: 0,
            from: 0.0,
            window: 0.0,
            threshold: 0.0,
            frame: Frame::default(),
            first: Mark::default(),
            past: Sums::default(),
            ends: [Mark::default(); 4],
            early: Sums::default(),
            running: Sums::default(),
            behind: 0.0,
            best: Best { left: f64::INFINITY, corner: 0.0 },
            length: 0.0,
            parts: Parts::default(),
            found: Err(lacks("blocks\0", 0.0, FEWEST)),
            groups: [Start::default(); GROUPS + 1],
            within: [0.0; GROUPS + 1],
        }
    }
}

/// Place of a group among [`GROUPS`].
fn place(group: u32) -> usize {
    (group as usize).min(GROUPS - 1)
}

impl Fit {
    /// Begins: blocks at ways of `from` mm and up to `window` mm more count, up to where the torque reaches `threshold`.
    pub fn start(&mut self, from: f64, window: f64, threshold: f64) {
        (self.from, self.window, self.threshold) = (from, window, threshold);
        self.stage = Stage::Window;
        self.early = Sums::default();
        (self.cycles, self.rest) = (0, 0);
    }

    /// Cycles that a fit takes at most.
    #[must_use]
    pub fn slices_bound() -> u32 {
        let groups = GROUPS as u32;
        let rest = 3 * (BLOCKS as u32).div_ceil(RESTED);
        rest + 3 * groups + groups * SIZE.div_ceil(TRIED) + groups.div_ceil(PASSED) + 10
    }

    /// The contact, once ready.
    ///
    /// # Errors
    /// `GIB_ERR_HOMING_SHAPE` with what is missing where the trace has not the shape of a level and a line.
    pub fn found(&self) -> Result<Contact, Fault> {
        self.found
    }

    /// Where no contact was found: the slope of the torque in the first quarter of the window before it reaches the threshold, where a dead
    /// stop shows its level, and the largest that is none: half the pace that would bring it to the limit at the window's end, or chance.
    /// `None` where it is no more than that.
    #[must_use]
    pub fn rises_early(&self) -> Option<[f64; 2]> {
        let early = &self.early;
        let (slope, about) = early.line();
        let error = (about / (early.n - 2.0).max(1.0) / early.spread().0).sqrt();
        let pace = (self.threshold - early.t / early.n) / self.window;
        let most = (3.0 * error).max(0.5 * pace);
        (early.n >= FEWEST && error.is_finite() && slope > most).then_some([slope, most])
    }

    /// One cycle: counts it and does a slice of the work; true when ready.
    pub fn slice(&mut self, trace: &Trace) -> bool {
        self.count();
        self.work(trace)
    }

    /// Counts a cycle.
    #[inline(always)]
    pub fn count(&mut self) {
        self.cycles += 1;
    }

    /// Whether a counted cycle has work left, beside resting.
    #[inline(always)]
    #[must_use]
    pub fn works(&self) -> bool {
        self.stage != Stage::Ready
    }

    /// Cycles of rest before the one that ends it; no end while there is work left.
    #[must_use]
    pub fn rests(&self) -> u32 {
        if self.works() { u32::MAX } else { self.rest.saturating_sub(self.cycles + 1) }
    }

    /// The work of a counted cycle; true when ready.
    pub fn work(&mut self, trace: &Trace) -> bool {
        match self.stage {
            Stage::Window => self.find_window(trace),
            Stage::Torques => self.sum_torques(trace),
            Stage::Ways => self.sum_ways(trace),
            Stage::Split => self.split(trace),
            Stage::Ends => self.find_end(trace),
            Stage::Solve => self.solve(),
            Stage::Early => self.sum_early(trace),
            Stage::Ready => {}
        }
        self.stage == Stage::Ready && self.cycles >= self.rest
    }

    /// First block from `from` on, before `to`, that has gone `way` mm from the frame's origin.
    fn first_at(&self, trace: &Trace, way: f64, mut from: u32, mut to: u32) -> u32 {
        while from < to {
            let middle = (from + to) / 2;
            let short = trace.in_frame(&self.frame, middle).0 < way;
            (from, to) = if short { (middle + 1, to) } else { (from, middle) };
        }
        from
    }

    /// Sums up to block `i`.
    fn mark(&self, trace: &Trace, i: u32) -> Mark {
        let g = (i / SIZE).min(self.last);
        let group = trace.group(g);
        let n = i.saturating_sub(SIZE * g).min(SIZE);
        let Start { sums, steps } = self.groups[place(g)].and_blocks(&self.frame, group, n as usize);
        let mut across = steps;
        across.add(&self.frame, group.pair(i));
        Mark { sums, steps, across }
    }

    fn find_window(&mut self, trace: &Trace) {
        let to = trace.lead() + trace.len();
        self.frame = trace.frame_at_end();
        self.parts.end = trace.last_way();
        self.begin = self.first_at(trace, self.from - self.parts.end, trace.lead(), to);
        (self.at, self.last) = (self.begin / SIZE, (to.max(1) - 1) / SIZE);
        self.groups[place(self.at)] = Start::after(self.at * SIZE);
        self.first = self.mark(trace, self.begin);
        self.stage = Stage::Torques;
    }

    /// Sums torques up to two in a row beyond the threshold: one alone may be noise.
    fn sum_torques(&mut self, trace: &Trace) {
        let to = trace.lead() + trace.len();
        if SIZE * self.at >= to {
            return self.limited(trace, [to; 3]);
        }
        let at = place(self.at);
        let before = self.groups[at];
        let most = self.groups[at + 1].torques_after(&self.frame, trace.group(self.at), &before);
        self.at += 1;
        if most >= self.threshold * self.threshold {
            self.look_for_limit(trace, to);
        }
    }

    #[cold]
    fn look_for_limit(&mut self, trace: &Trace, to: u32) {
        let from = self.begin.max(SIZE * (self.at - 1));
        let over = |i| trace.in_frame(&self.frame, i).1 >= self.threshold;
        let mut before = from > self.begin && over(from - 1);
        for i in from..to.min(SIZE * self.at) {
            let now = over(i);
            if before && now {
                return self.limited(trace, [i - 1, i, i + 1]);
            }
            before = now;
        }
    }

    /// What counts ends before block `end`; when splits are tried the line goes on to `past`, the first block beyond the threshold, and
    /// where the threshold counts as reached is before `seen`.
    #[cold]
    fn limited(&mut self, trace: &Trace, [end, past, seen]: [u32; 3]) {
        (self.end, self.last) = (end, past.saturating_sub(1) / SIZE);
        let held = |to: u32| (to - trace.lead()).div_ceil(RESTED);
        self.rest = held(trace.lead() + trace.len()) + 2 * held(end);
        let way = |i| trace.in_frame(&self.frame, i).0;
        (self.parts.first, self.parts.last) = (way(self.begin), way(seen.wrapping_sub(1)));
        self.parts.threshold = self.threshold;
        if end <= self.begin {
            return self.fails(lacks("blocks\0", 0.0, 2.0 * FEWEST));
        }
        self.groups[place(self.last)].no_ways();
        self.past = self.mark(trace, past).sums;
        self.behind = 0.0;
        self.at = self.last;
        self.lowest = self.last;
        self.best = Best { left: f64::INFINITY, corner: 0.0 };
        self.stage = Stage::Ways;
    }

    /// Sums the ways of the group before those that are, and tries the split at its start.
    fn sum_ways(&mut self, trace: &Trace) {
        let (g, at) = (self.at, place(self.at));
        if g < self.last {
            self.sum_group(trace, g);
        }
        self.lowest = g;
        self.within[at] = self.behind;
        let inside = SIZE * g > self.begin;
        if inside {
            let [level, line] = self.best.try_split(&self.first.sums, &self.groups[at].sums, &self.past);
            self.within[at] += level;
            self.behind = line;
        }
        if inside && self.behind <= self.best.left {
            self.at = g - 1;
        } else {
            (self.at, self.stage) = (SIZE * g, Stage::Split);
        }
    }

    /// Sums the ways of group `g`, which ends where those begin that are summed.
    fn sum_group(&mut self, trace: &Trace, g: u32) {
        let (at, group) = (place(g), trace.group(g));
        let next = self.groups[at + 1];
        self.groups[at].ways_before(&self.frame, group, &next);
    }

    /// Whether the ways are summed from block `i` on; sums those of one group more where they are not.
    fn reaches(&mut self, trace: &Trace, i: u32) -> bool {
        let all = i / SIZE >= self.lowest;
        if !all {
            self.lowest -= 1;
            self.sum_group(trace, self.lowest);
        }
        all
    }

    /// Tries some splits within a group, where one may be the best.
    fn split(&mut self, trace: &Trace) {
        let mut g = self.at / SIZE;
        if self.at.is_multiple_of(SIZE) {
            let to = (g + PASSED).min(self.last + 1);
            while g < to && self.within[place(g)] >= self.best.left {
                g += 1;
            }
            self.at = g * SIZE;
            if g > self.last {
                return self.splits_tried();
            }
            if g == to {
                return;
            }
            self.running = self.groups[place(g)].sums;
        }
        let (mut running, mut best) = (self.running, self.best);
        for i in self.at..(self.at + TRIED).min(self.end) {
            running.add(trace.in_frame(&self.frame, i));
            best.try_split(&self.first.sums, &running, &self.past);
        }
        (self.running, self.best) = (running, best);
        self.at += TRIED;
    }

    #[cold]
    fn splits_tried(&mut self) {
        let n = f64::from(self.end - self.begin);
        self.length = self.parts.last - self.best.corner;
        if self.best.left.is_infinite() {
            let enough = n >= 2.0 * FEWEST;
            let clear = lacks("line_clear_ratio\0", 0.0, SURE);
            self.fails(if enough { clear } else { lacks("blocks\0", n, 2.0 * FEWEST) });
        } else if !(self.length > 0.0) {
            self.fails(self.parts.outside(self.best.corner));
        } else {
            (self.at, self.stage) = (0, Stage::Ends);
        }
    }

    /// Finds where a part ends.
    fn find_end(&mut self, trace: &Trace) {
        let at = self.at as usize % ENDS.len();
        let way = self.best.corner + ENDS[at] * self.length;
        let i = self.first_at(trace, way, self.begin, self.end);
        // Where the torque jumps, level and line meet before the split. Of the level no ways are needed.
        if at > 0 && !self.reaches(trace, i) {
            return;
        }
        self.ends[at] = self.mark(trace, i);
        self.at += 1;
        if self.at as usize == ENDS.len() {
            self.stage = Stage::Solve;
        }
    }

    #[cold]
    fn solve(&mut self) {
        let ([level_end, from, half, to], parts) = (&self.ends, &mut self.parts);
        (parts.level, parts.line) = (level_end.sums.since(&self.first.sums), to.sums.since(&from.sums));
        parts.level_steps = level_end.steps.since(&self.first.across);
        parts.line_steps = to.steps.since(&from.across);
        parts.halves = [half.sums.since(&from.sums), to.sums.since(&half.sums)];
        match self.parts.solve() {
            Ok(contact) => (self.found, self.stage) = (Ok(contact), Stage::Ready),
            Err(fault) => self.fails(fault),
        }
    }

    /// There is no contact point. Does the torque rise where it should not yet?
    #[cold]
    fn fails(&mut self, fault: Fault) {
        self.found = Err(fault);
        self.stage = if self.end > self.begin { Stage::Early } else { Stage::Ready };
    }

    /// Sums the ways of one group more, or of the first quarter.
    fn sum_early(&mut self, trace: &Trace) {
        if !self.reaches(trace, self.begin) {
            return;
        }
        let quarter = self.from + 0.25 * self.window - self.parts.end;
        let to = self.mark(trace, self.first_at(trace, quarter, self.begin, self.end));
        self.early = to.sums.since(&self.mark(trace, self.begin).sums);
        self.stage = Stage::Ready;
    }
}
