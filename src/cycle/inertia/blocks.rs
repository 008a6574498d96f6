//! Gathers samples of torque and speed into blocks, a few instructions a sample.
//!
//! The torque balance is multiplied by a weight ψ that vanishes at both ends of a block and integrated: by parts the
//! acceleration becomes ∫ψ·ω' = −∫ψ'·ω, so that nothing is differentiated (method of modulating functions; Shinbrot
//! 1957). With the parabola ψ = ((N²−1)/4 − u²)/2, u = i − (N−1)/2, the acceleration is exactly the slope of the
//! least-squares line through the speeds, and weighted means of torque and speed go with it:
//!
//! ```text
//! ω' = Σu·ω / (Σψ·Δt),   T̄ = Σψ·T / Σψ,   ω̄ = Σψ·ω / Σψ,   Σψ = Σu² = N(N²−1)/12
//! ```
//!
//! A cycle only adds: S₁ is the sum of the samples x, S₂ the sum of S₁, S₃ that of S₂. When the block is full,
//!
//! ```text
//! 2·Σψ·x = (N+2)·S₂ − (N+1)/2·S₁ − 2·S₃,   Σu·x = (N+1)/2·S₁ − S₂
//! ```
//!
//! Before, a wild sample gives way to the median of itself and its neighbours: one that is further from it than all but one
//! in sixteen are, by much (after Hampel). Samples that say nothing about inertia
//! end a block without trace: standing still, take-up, field weakening, saturation.

use super::kept::{Course, Kept, Whole};

/// Blocks that a measurement can hold.
pub const BLOCKS: usize = 512;

/// A speed or torque beyond this, in the unit of the input, is no measurement; its square would not be finite for long.
const BEYOND: f64 = 1e12;

/// One equation of the torque balance.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Block {
    /// Weighted mean torque, N·m.
    pub torque: f64,
    /// Weighted mean speed, rad/s.
    pub speed: f64,
    /// Acceleration, rad/s².
    pub acceleration: f64,
}

/// Which samples count, in the units of the input.
#[derive(Debug, Clone, Copy)]
pub struct Gate {
    /// Lowest |speed|, rpm.
    pub standstill: f64,
    /// Highest |speed|, rpm.
    pub base: f64,
    /// Highest |torque|.
    pub saturation: f64,
    /// Samples left out after standing still or a torque that changed its sense.
    pub takeup: u32,
}

/// Speed (rpm) and torque (unit of the input) of one instant, treated alike, side by side: aligned, so that a processor
/// works on both at once.
#[derive(Debug, Clone, Copy, Default)]
#[repr(align(16))]
struct Sample([f64; 2]);

/// Samples on their way into blocks.
#[derive(Debug, Clone, Copy)]
pub struct Gather {
    calm: Calm,
    /// Smallest and largest |sample| that counts; the smallest speed that does while it gathers.
    least: Sample,
    standstill: f64,
    most: Sample,
    takeup: u32,
    /// Running sums S₁, S₂, S₃.
    sums: [Sample; 3],
    /// Samples to the end of the block, or of what is left out.
    run: u32,
    /// True while samples are left out.
    skips: bool,
    length: u32,
    /// What makes S₁ a mean in rad/s and N·m, and what makes Σu·x and Σψ·x a slope and a mean in these.
    mean: [f64; 2],
    weighted: [f64; 2],
    cycle_s: f64,
    torque_nm: f64,
    last_torque: f64,
    /// The block under way began where the last one kept ended.
    follows: bool,
    kept: Kept,
}

/// Both signals on their way past the wild samples.
#[derive(Debug, Clone, Copy)]
struct Calm {
    before: Sample,
    middle: Sample,
    /// Distance from the median of three that one sample in sixteen exceeds, followed by steps up and down, which a wild
    /// sample moves no further than any other; and what it does not fall below.
    usual: Sample,
    least: Sample,
    /// Smallest step seen between two samples.
    grid: Sample,
}

/// A sample so many times the usual distance from the median is wild: some 5 standard deviations of normal noise.
const WILD: f64 = 3.0;

impl Default for Calm {
    fn default() -> Calm {
        let [none, least, grid] = [0.0, 1e-6, f64::MAX].map(|value| Sample([value; 2]));
        Calm { before: none, middle: none, usual: least, least, grid }
    }
}

impl Calm {
    /// Looks whether the last two samples are one step of a coarse grid apart. A signal that stands on the grid but for a step
    /// here and there is not wild: the steps are where it goes.
    fn watch_grid(&mut self) {
        const ROUNDING: f64 = 1e-6;
        for k in 0..2 {
            let (a, b) = (self.before.0[k], self.middle.0[k]);
            let step = (a - b).abs();
            if step > ROUNDING * (a.abs() + b.abs()) && step < self.grid.0[k] {
                self.grid.0[k] = step;
                self.least.0[k] = step * 1.01 / WILD;
            }
        }
    }

    /// The sample before `next`, or the median in its place where it is wild.
    #[inline(always)]
    fn pass(&mut self, next: Sample) -> Sample {
        const DOWN: f64 = 1.0 / (1.0 + 1.0 / 64.0);
        const UP: f64 = 1.262; // DOWN to the power of -15
        let mut passed = Sample::default();
        for k in 0..2 {
            let (a, b, c, usual) = (self.before.0[k], self.middle.0[k], next.0[k], self.usual.0[k]);
            let (low, high) = if a < b { (a, b) } else { (b, a) };
            let below = if c < high { c } else { high };
            let median = if low > below { low } else { below };
            let away = (b - median).abs();
            passed.0[k] = if away > WILD * usual { median } else { b };
            let followed = usual * if away > usual { UP } else { DOWN };
            self.usual.0[k] = if followed > self.least.0[k] { followed } else { self.least.0[k] };
        }
        self.before = self.middle;
        self.middle = next;
        passed
    }
}

impl Default for Gather {
    fn default() -> Gather {
        Gather::new(Gate { standstill: 0.0, base: f64::MAX, saturation: f64::MAX, takeup: 0 }, 4, 1e-3, 1.0, false)
    }
}

impl Gather {
    /// Empty, for blocks of `length` samples (at least 4), one every `cycle_s`, `torque_nm` N·m per unit of the input. Where more
    /// come than there is room for, they get longer, or with `joins` false later ones are left out.
    #[must_use]
    pub fn new(gate: Gate, length: u32, cycle_s: f64, torque_nm: f64, joins: bool) -> Gather {
        let mut gather = Gather {
            calm: Calm::default(),
            standstill: gate.standstill,
            least: Sample([gate.standstill, 0.0]),
            most: Sample([gate.base.min(BEYOND), gate.saturation.min(BEYOND)]),
            takeup: gate.takeup,
            sums: [Sample::default(); 3],
            run: gate.takeup.max(2), // the median is full after two samples
            skips: true,
            length: 4,
            mean: [0.0; 2],
            weighted: [0.0; 2],
            cycle_s,
            torque_nm,
            last_torque: 0.0,
            follows: false,
            kept: Kept::new(joins),
        };
        gather.make_long(length.max(4));
        gather
    }

    /// Blocks that begin from now on are of so many samples.
    fn make_long(&mut self, length: u32) {
        let n = f64::from(length);
        let weights = n * (n * n - 1.0) / 12.0;
        let units = [crate::units::rad_s_from_rpm(1.0), self.torque_nm];
        (self.length, self.mean, self.weighted) =
            (length, units.map(|unit| unit / n), units.map(|unit| unit / weights));
    }

    /// The blocks gathered, all of one length, how many, and that length in samples. Not for the cycle.
    #[must_use]
    pub fn blocks(&self) -> ([Block; BLOCKS], usize, u32) {
        self.kept.all(self.length, self.cycle_s)
    }

    /// Smallest step seen between two torques, N·m; 0 where none was.
    #[must_use]
    pub fn torque_step(&self) -> f64 {
        let step = self.calm.grid.0[1];
        if step < f64::MAX { step * self.torque_nm } else { 0.0 }
    }

    /// Smallest step seen between two speeds, rad/s; 0 where none was.
    #[must_use]
    pub fn speed_step(&self) -> f64 {
        let step = self.calm.grid.0[0];
        if step < f64::MAX { crate::units::rad_s_from_rpm(step) } else { 0.0 }
    }

    /// Leaves the next `samples` out and begins a new block after them.
    pub fn leave_out(&mut self, samples: u32) {
        self.skips = samples > 0;
        self.run = if self.skips { samples } else { self.length };
        self.sums = [Sample::default(); 3];
        self.follows = false;
    }

    /// Gathers from here on, after `samples` that are left out.
    pub fn resume(&mut self, samples: u32) {
        self.least.0[0] = self.standstill;
        self.leave_out(samples);
    }

    /// Gathers nothing until it is resumed. A spindle that stands meanwhile is no reason to look closer.
    pub fn pause(&mut self) {
        self.least.0[0] = 0.0;
        self.leave_out(u32::MAX);
    }

    /// Samples that may be [taken](Self::take) before one must be [added](Self::add).
    #[inline]
    #[must_use]
    pub fn quiet(&self) -> u32 {
        self.run.saturating_sub(1)
    }

    /// Counts samples that were taken.
    #[inline]
    pub fn count(&mut self, taken: u32) {
        self.run = self.run.saturating_sub(taken);
    }

    /// Takes a sample in, without counting it; both are finite. False with nothing changed where it must be added.
    ///
    /// What is left out is summed up too, and thrown away: that costs less than to ask.
    #[inline(always)]
    pub fn take(&mut self, speed_rpm: f64, torque: f64) -> bool {
        let mut calm = self.calm;
        let passed = calm.pass(Sample([speed_rpm, torque]));
        let size = passed.0.map(f64::abs);
        let counts = |k: usize| (size[k] >= self.least.0[k]) & (size[k] <= self.most.0[k]);
        if !(counts(0) & counts(1)) {
            return false;
        }
        self.calm = calm;
        let mut next = passed;
        for sum in &mut self.sums {
            *sum = Sample([sum.0[0] + next.0[0], sum.0[1] + next.0[1]]);
            next = *sum;
        }
        true
    }

    /// Adds a sample; both are finite.
    #[inline]
    pub fn add(&mut self, speed_rpm: f64, torque: f64) {
        if !self.take(speed_rpm, torque) {
            self.refuse(Sample([speed_rpm, torque]));
            return;
        }
        self.run = self.run.saturating_sub(1);
        if self.run == 0 {
            self.close();
        }
    }

    /// A sample that says nothing about inertia.
    fn refuse(&mut self, sample: Sample) {
        let stands = self.calm.pass(sample).0[0].abs() < self.least.0[0];
        let takeup = if stands { self.takeup.max(1) } else { 0 };
        let left = if self.skips { self.run.saturating_sub(1) } else { 0 };
        self.leave_out(left.max(takeup));
    }

    fn close(&mut self) {
        self.calm.watch_grid();
        if self.skips {
            self.leave_out(0);
            return;
        }
        let n = f64::from(self.length);
        let [first, second, third] = self.sums.map(|sum| sum.0);
        let course = |k: usize| Course {
            mean: first[k] * self.mean[k],
            slope: (0.5 * (n + 1.0) * first[k] - second[k]) * self.weighted[k],
            weighted: ((n + 2.0) * second[k] - 0.5 * (n + 1.0) * first[k] - 2.0 * third[k]) * 0.5 * self.weighted[k],
        };
        let whole = Whole { speed: course(0), torque: course(1), follows: self.follows };
        let torque = whole.torque.weighted;
        let same_sense = torque * self.last_torque >= 0.0;
        self.last_torque = torque;
        if same_sense && self.kept.add(whole, self.length) {
            self.make_long(self.length.saturating_mul(2));
        }
        // Belts and gears change flank: what follows accelerates less than the torque says.
        self.leave_out(if same_sense { 0 } else { self.takeup });
        self.follows = same_sense;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::{rad_s_from_rpm, rpm_from_rad_s};

    fn blocks(gather: &Gather) -> Vec<Block> {
        let (blocks, used, _) = gather.blocks();
        blocks[..used].to_vec()
    }

    fn gate() -> Gate {
        Gate { standstill: 1.0, base: 5000.0, saturation: 40.0, takeup: 10 }
    }

    #[test]
    fn a_ramp_is_its_slope_and_a_wild_sample_leaves_no_trace() {
        let mut gather = Gather::new(gate(), 20, 1e-3, 0.5, false);
        for i in 0..500 {
            let (speed, torque) = (100.0 + 30.0 * f64::from(i) * 1e-3, 8.0);
            let wild = i % 50 == 7;
            gather.add(if wild { 4000.0 } else { speed }, if wild { -39.0 } else { torque });
        }
        assert!(blocks(&gather).len() >= 20);
        for block in blocks(&gather) {
            assert!((block.acceleration - rad_s_from_rpm(30.0)).abs() < 0.05 * rad_s_from_rpm(30.0), "{block:?}");
            assert!((block.torque - 4.0).abs() < 1e-9);
        }
    }

    /// A speed that is the difference of an encoder's counts stands on one step of its grid and goes to the next now and then: these
    /// are where it goes, not wild.
    #[test]
    fn steps_of_a_coarse_grid_are_kept() {
        const STEP: f64 = 14.6;
        let mut gather = Gather::new(gate(), 1000, 1e-3, 1.0, false);
        let counts = |t: f64| (t * (100.0 + 0.5 * 30.0 * t) / (STEP * 1e-3)).floor();
        for i in 0..60_000 {
            let t = f64::from(i) * 1e-3;
            gather.add(STEP * (counts(t) - counts(t - 1e-3)), 8.0);
        }
        let mean = |of: fn(&Block) -> f64| blocks(&gather).iter().map(of).sum::<f64>() / blocks(&gather).len() as f64;
        assert!((mean(|b| b.acceleration) / rad_s_from_rpm(30.0) - 1.0).abs() < 2e-3, "{}", mean(|b| b.acceleration));
        let scatter = mean(|b| (b.acceleration - rad_s_from_rpm(30.0)).powi(2)).sqrt();
        assert!(scatter < 0.01 * rad_s_from_rpm(30.0), "{scatter}");
    }

    /// The weighted equation holds within a block whatever the motion: T = J·ω' + B·ω with any smooth ω.
    #[test]
    fn balance_holds_for_curved_motion() {
        let (j, b) = (0.006, 0.001);
        let mut gather = Gather::new(gate(), 60, 1e-3, 1.0, false);
        for i in 0..3000 {
            let t = f64::from(i) * 1e-3;
            let omega = 100.0 + 40.0 * (9.0 * t).sin();
            gather.add(rpm_from_rad_s(omega), 30.0 + j * 360.0 * (9.0 * t).cos() + b * omega);
        }
        for block in blocks(&gather) {
            let expected = 30.0 + j * block.acceleration + b * block.speed;
            assert!((block.torque - expected).abs() < 1e-3, "{block:?} {expected}");
        }
        assert!(blocks(&gather).len() > 40);
    }

    #[test]
    fn standstill_weakening_and_saturation_leave_nothing() {
        for (speed, torque) in [(0.5, 5.0), (6000.0, 5.0), (100.0, 45.0)] {
            let mut gather = Gather::new(gate(), 8, 1e-3, 1.0, false);
            (0..400).for_each(|_| gather.add(speed, torque));
            assert!(blocks(&gather).is_empty(), "{speed} {torque}");
        }
    }

    #[test]
    fn take_up_after_a_change_of_flank_is_left_out() {
        let mut gather = Gather::new(gate(), 10, 1e-3, 1.0, false);
        for i in 0..200 {
            gather.add(1000.0, if i < 100 { 5.0 } else { -5.0 });
        }
        assert!(blocks(&gather).iter().filter(|b| b.torque > 0.0).count() >= 8);
        let after = blocks(&gather).iter().filter(|b| b.torque < 0.0).count();
        assert!((6..=8).contains(&after), "{after}");
    }
}
