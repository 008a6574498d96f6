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
//! Work is cut into slices of [`SLICE`] blocks, so that a cycle's share is bounded.

use super::trace::{BLOCKS, Trace};
use crate::cycle::level::inflation;
use crate::error::{Fault, GIB_ERR_HOMING_SHAPE};

/// Blocks looked at in a cycle.
const SLICE: u32 = 8;
/// Fewest blocks in a level or a line.
const FEWEST: f64 = 6.0;
/// Standard errors by which a slope must be above zero.
const SURE: f64 = 5.0;
/// Part of the line that is used: from the share of the rise where impact is over to the one where limiting is near. On
/// random axes the contact found with 0.13 lies 0.15 µm off in the mean, with 0.2 nothing.
const LINE_FROM: f64 = 0.2;
const LINE_TO: f64 = 0.95;
const LINE_HALF: f64 = 0.5 * (LINE_FROM + LINE_TO);
/// The level ends this share of the line's length before the corner.
const LEVEL_GAP: f64 = 0.1;

/// Sums over blocks: number, ways x, torques t and their products.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    n: f64,
    x: f64,
    t: f64,
    xx: f64,
    xt: f64,
    tt: f64,
}

impl Sums {
    #[inline(always)]
    fn add(&mut self, weight: f64, (x, t): (f64, f64)) {
        self.n += weight;
        self.x += weight * x;
        self.t += weight * t;
        self.xx += weight * x * x;
        self.xt += weight * x * t;
        self.tt += weight * t * t;
    }

    /// Both together.
    fn and(&self, other: &Sums) -> Sums {
        let [a, b] = [self, other];
        Sums { n: a.n + b.n, x: a.x + b.x, t: a.t + b.t, xx: a.xx + b.xx, xt: a.xt + b.xt, tt: a.tt + b.tt }
    }

    /// Squares of t about its mean.
    fn scatter(&self) -> f64 {
        (self.tt - self.t * self.t / self.n).max(0.0)
    }

    /// Squares of x about its mean, and products.
    fn spread(&self) -> (f64, f64) {
        (self.xx - self.x * self.x / self.n, self.xt - self.x * self.t / self.n)
    }

    /// Slope of the least-squares line and squares about it; slope 0 where x does not vary.
    fn line(&self) -> (f64, f64) {
        let (sxx, sxt) = self.spread();
        if sxx <= 0.0 {
            return (0.0, self.scatter());
        }
        let slope = sxt / sxx;
        (slope, (self.scatter() - slope * sxt).max(0.0))
    }
}

/// What a touch shows. Ways in mm from the touch's start, torque in the unit of the input, variances of one value.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Contact {
    /// Way to the contact point.
    pub way: f64,
    /// Its variance, mm².
    pub variance: f64,
    /// Torque before contact.
    pub level: f64,
    /// Slope of the line: stiffness of drive and stop in series.
    pub stiffness: f64,
    /// Standard error of the slope.
    pub stiffness_error: f64,
    /// Standard deviation of a block about level and line.
    pub noise: f64,
    /// By how much later the line starts as its upper half has it than as its lower half has it, and the variance of that: a stop that
    /// stiffens with the force, or an impact that is over late, bends the line.
    pub bend: f64,
    /// See `bend`.
    pub bend_variance: f64,
    /// Way that a torque which swings before contact, as of an axis that sticks and slips, may hide.
    pub swing: f64,
    /// Way from contact to where the torque limit was reached.
    pub press: f64,
    /// Way at which the plain threshold was reached.
    pub threshold_way: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Stage {
    /// Ends when all blocks are summed or the threshold is met.
    Gather,
    /// Ends when every split is tried.
    Scan,
    /// Ends when level and line are summed anew.
    Refine,
    /// Ends with the next start.
    Ready,
}

/// A fit under way.
#[derive(Debug, Clone, Copy)]
pub struct Fit {
    stage: Stage,
    /// Next block.
    at: u32,
    /// One past the last block before the limit.
    end: u32,
    /// Ways before this are not looked at: after a reversal the torque first takes up the lost motion.
    from: f64,
    threshold: f64,
    over: u32,
    first: f64,
    last: f64,
    window: f64,
    early: Sums,
    level: Sums,
    line: Sums,
    /// Lower half of the line.
    low: Sums,
    /// From block to block of the line, and its last block.
    steps: Sums,
    before: Option<(f64, f64)>,
    /// Squares from block to block of the level, and its last block.
    level_steps: f64,
    level_before: Option<(f64, f64)>,
    least: f64,
    split: Contact,
    found: Result<Contact, Fault>,
}

impl Default for Fit {
    fn default() -> Fit {
        Fit {
            stage: Stage::Ready,
            at: 0,
            end: 0,
            from: 0.0,
            threshold: 0.0,
            over: 0,
            first: 0.0,
            last: 0.0,
            window: 0.0,
            early: Sums::default(),
            level: Sums::default(),
            line: Sums::default(),
            low: Sums::default(),
            steps: Sums::default(),
            before: None,
            level_steps: 0.0,
            level_before: None,
            least: f64::INFINITY,
            split: Contact::default(),
            found: Err(Fault::of(GIB_ERR_HOMING_SHAPE)),
        }
    }
}

/// Where a line of that slope through the middle of its blocks leaves the level, and the variance of that.
fn start_of(line: &Sums, level: f64, slope: f64, scatter: f64) -> (f64, f64) {
    let mean = line.x / line.n;
    let way = mean - (line.t / line.n - level) / slope;
    (way, scatter * (1.0 / line.n + (mean - way) * (mean - way) / line.spread().0) / (slope * slope))
}

impl Fit {
    /// Begins: blocks at ways of `from` mm and up to `window` mm more count, up to where the torque reaches `threshold`.
    pub fn start(&mut self, from: f64, window: f64, threshold: f64) {
        *self = Fit { stage: Stage::Gather, from, window, threshold, first: f64::INFINITY, ..Fit::default() };
    }

    /// Cycles that a fit takes at most.
    #[must_use]
    pub fn slices_bound() -> u32 {
        3 * (BLOCKS as u32 / SLICE + 2)
    }

    /// The contact, once ready.
    ///
    /// # Errors
    /// `GIB_ERR_HOMING_SHAPE` with what is missing where the trace has not the shape of a level and a line.
    pub fn found(&self) -> Result<Contact, Fault> {
        self.found
    }

    /// The slope of the torque in the first quarter of the window, where a dead stop shows its level, and the largest that is none: half
    /// the pace that would bring it to the limit at the window's end, or chance. `None` where it is no more than that.
    #[must_use]
    pub fn rises_early(&self) -> Option<[f64; 2]> {
        let early = &self.early;
        let (slope, about) = early.line();
        let error = (about / (early.n - 2.0).max(1.0) / early.spread().0).sqrt();
        let pace = (self.threshold - early.t / early.n) / self.window;
        let most = (3.0 * error).max(0.5 * pace);
        (early.n >= FEWEST && error.is_finite() && slope > most).then_some([slope, most])
    }

    /// One slice; true when ready.
    pub fn slice(&mut self, trace: &Trace) -> bool {
        let to = (self.at + SLICE).min(if self.stage == Stage::Gather { trace.len() } else { self.end });
        for i in self.at..to {
            let block = trace.block(i);
            if block.0 >= self.from {
                match self.stage {
                    Stage::Gather => self.gather(i, block),
                    Stage::Scan => self.scan(block),
                    Stage::Refine => self.refine(block),
                    Stage::Ready => {}
                }
            }
        }
        let whole = self.at + SLICE >= if self.stage == Stage::Gather { trace.len() } else { self.end };
        self.at = to;
        if whole {
            self.next_stage(trace.len());
        }
        self.stage == Stage::Ready
    }

    /// Sums blocks up to two in a row beyond the threshold: one alone may be noise.
    #[inline(always)]
    fn gather(&mut self, i: u32, block: (f64, f64)) {
        if self.end > 0 {
            return;
        }
        self.over = if block.1 >= self.threshold { self.over + 1 } else { 0 };
        self.line.add(1.0, block);
        if block.0 < self.from + 0.25 * self.window {
            self.early.add(1.0, block);
        }
        self.first = self.first.min(block.0);
        self.last = block.0;
        if self.over == 2 {
            self.end = i.saturating_sub(1).max(1);
            self.line.add(-1.0, block);
        }
    }

    /// Moves a block from the line to the level and rates the split.
    #[inline(always)]
    fn scan(&mut self, block: (f64, f64)) {
        self.line.add(-1.0, block);
        self.level.add(1.0, block);
        if self.level.n < FEWEST || self.line.n < FEWEST {
            return;
        }
        let (slope, about_line) = self.line.line();
        let about = self.level.scatter() + about_line;
        if about < self.least && slope > 0.0 {
            let level = self.level.t / self.level.n;
            let way = self.line.x / self.line.n - (self.line.t / self.line.n - level) / slope;
            self.least = about;
            self.split = Contact { way, level, stiffness: slope, ..Contact::default() };
        }
    }

    /// Sums what is surely level and what is surely line.
    #[inline(always)]
    fn refine(&mut self, block: (f64, f64)) {
        let along = block.0 - self.split.way;
        let length = self.split.press;
        if along < -LEVEL_GAP * length {
            self.level.add(1.0, block);
            if let Some((_, t)) = self.level_before {
                self.level_steps += (block.1 - t) * (block.1 - t);
            }
            self.level_before = Some(block);
        } else if along >= LINE_FROM * length && along <= LINE_TO * length {
            let half = if along < LINE_HALF * length { &mut self.low } else { &mut self.line };
            half.add(1.0, block);
            if let Some((x, t)) = self.before {
                self.steps.add(1.0, (block.0 - x, block.1 - t));
            }
            self.before = Some(block);
        }
    }

    #[cold]
    fn next_stage(&mut self, blocks: u32) {
        self.at = 0;
        self.stage = match self.stage {
            Stage::Gather => {
                self.end = if self.end > 0 { self.end } else { blocks };
                Stage::Scan
            }
            Stage::Scan if self.least.is_finite() => {
                self.split.press = self.last - self.split.way;
                self.level = Sums::default();
                self.line = Sums::default();
                Stage::Refine
            }
            Stage::Scan if self.level.n >= 2.0 * FEWEST => {
                self.found = Err(lacks("line_clear_ratio\0", 0.0, SURE));
                Stage::Ready
            }
            Stage::Scan => {
                self.found = Err(lacks("blocks\0", self.level.n, 2.0 * FEWEST));
                Stage::Ready
            }
            Stage::Ready => Stage::Ready,
            Stage::Refine => {
                self.found = self.solve();
                Stage::Ready
            }
        };
    }

    /// Squares of the steps from block to block about a line of that slope.
    fn block_to_block(&self, slope: f64) -> f64 {
        let s = &self.steps;
        (s.tt - 2.0 * slope * s.xt + slope * slope * s.xx).max(0.0)
    }

    /// By how much the line's variance exceeds that of independent blocks: an axis that swings or sticks and slips on the
    /// stop scatters about its line, but not from block to block.
    fn hanging_together(&self, slope: f64, about_line: f64) -> f64 {
        const MOST: f64 = 0.7;
        inflation(self.block_to_block(slope) / about_line.max(f64::MIN_POSITIVE), MOST)
    }

    /// Peak of the torque's swing before contact: what the level scatters more than its noise from block to block, beyond chance.
    fn swing(&self) -> f64 {
        const PEAK: f64 = 1.5;
        let n = self.level.n;
        let noise = self.level_steps / (2.0 * (n - 1.0));
        let beyond = self.level.scatter() / (n - 1.0) - (1.0 + 3.0 * (3.0 / n).sqrt()) * noise;
        PEAK * beyond.max(0.0).sqrt()
    }

    /// Where the two halves of the line start, one less the other, and what of its variance is chance: the noise from block to
    /// block. Nothing where a half is too short.
    fn bend(&self, level: f64, slope: f64) -> (f64, f64) {
        /// Of the whole line's slope; a half that is flatter, as by chance, starts nowhere.
        const FLATTEST: f64 = 0.2;
        let chance = 0.5 * self.block_to_block(slope) / self.steps.n;
        let [low, high] = [&self.low, &self.line].map(|half| {
            let own = half.line().0.max(FLATTEST * slope);
            start_of(half, level, own, chance)
        });
        let bend = (high.0 - low.0, high.1 + low.1);
        if self.low.n >= 3.0 && self.line.n >= 3.0 && bend.1.is_finite() { bend } else { (0.0, 0.0) }
    }

    /// Contact point and its variance from the refined sums, or why the curve is not a level and a line.
    fn solve(&self) -> Result<Contact, Fault> {
        let (level, line) = (&self.level, &self.low.and(&self.line));
        let outside = |way| Err(Fault { high: self.last, ..lacks("contact_mm\0", way, self.first) });
        if !(self.split.press > 0.0) {
            return outside(self.split.way);
        }
        let fewer = level.n.min(line.n);
        if fewer < FEWEST {
            return Err(lacks("blocks\0", fewer, FEWEST));
        }
        let torque = level.t / level.n;
        let (slope, about_line) = line.line();
        let (sxx, _) = line.spread();
        let scatter = (level.scatter() + about_line) / (level.n + line.n - 3.0);
        let slope_error = (about_line / (line.n - 2.0) / sxx).sqrt();
        // Not `<=`: a slope that is no number is no slope.
        if !(slope > SURE * slope_error) {
            let clear = slope / slope_error;
            return Err(lacks("line_clear_ratio\0", if clear.is_finite() { clear } else { 0.0 }, SURE));
        }
        let scatter_line = about_line / (line.n - 2.0) * self.hanging_together(slope, about_line);
        let (way, of_line) = start_of(line, torque, slope, scatter_line);
        let of_level = level.scatter() / (level.n - 1.0) / level.n / (slope * slope);
        let (bend, bend_variance) = self.bend(torque, slope);
        let contact = Contact {
            way,
            variance: of_level + of_line,
            level: torque,
            stiffness: slope,
            stiffness_error: slope_error,
            bend,
            bend_variance,
            noise: scatter.sqrt(),
            swing: self.swing() / slope,
            press: (self.threshold - torque) / slope,
            threshold_way: self.last,
        };
        let seen = way > self.first && way < self.last;
        if seen { Ok(contact) } else { outside(way) }
    }
}

/// What a level or a line has too little of.
fn lacks(field: &'static str, value: f64, low: f64) -> Fault {
    Fault { code: GIB_ERR_HOMING_SHAPE, field, value, low, high: f64::MAX }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A clean touch: level, line with stiffness `k` from `corner` on, cut off at `limit`.
    fn touch(level: f64, k: f64, corner: f64, limit: f64, noise: impl Fn(u32) -> f64) -> Trace {
        let mut trace = Trace::default();
        trace.start(1, 0.0, 1.0, 1.0);
        for i in 0..1500 {
            let way = 0.0005 * f64::from(i);
            let torque = (level + k * (way - corner).max(0.0)).min(limit);
            trace.add(way, torque + noise(i));
            if torque >= limit {
                break;
            }
        }
        trace
    }

    fn fitted(trace: &Trace, threshold: f64) -> Option<Contact> {
        let mut fit = Fit::default();
        fit.start(0.1, 0.6, threshold);
        let mut slices = 0;
        while !fit.slice(trace) {
            slices += 1;
            assert!(slices < Fit::slices_bound());
        }
        fit.found().ok()
    }

    proptest! {
        /// Without noise the corner is found whatever level, stiffness and limit are.
        #[test]
        fn corner_of_a_clean_touch(level in -2.0..3.0f64, k in 20.0..300.0f64, corner in 0.2..0.4f64, limit in 4.5..9.0f64) {
            let contact = fitted(&touch(level, k, corner, limit, |_| 0.0), 0.9 * limit).unwrap();
            prop_assert!((contact.way - corner).abs() < 2e-5, "{} of {corner}", contact.way);
            prop_assert!((contact.stiffness / k - 1.0).abs() < 1e-3 && (contact.level - level).abs() < 1e-4);
        }
    }

    #[test]
    fn no_stop_is_no_contact() {
        let hash = |i: u32| f64::from(i.wrapping_mul(2_654_435_761) >> 16) / 65536.0 - 0.5;
        assert_eq!(fitted(&touch(2.0, 0.0, 0.3, 9.0, hash), 8.0), None);
        assert_eq!(fitted(&Trace::default(), 8.0), None);
    }

    #[test]
    fn a_falling_line_is_no_contact() {
        assert_eq!(fitted(&touch(2.0, -60.0, 0.3, 9.0, |i| 1e-3 * f64::from(i % 3)), 8.0), None);
    }
}
