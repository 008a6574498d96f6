//! Sums over neighbouring blocks, of which two taken at two places give what lies between them.
//!
//! Whole groups are summed two blocks at a time, the torques of all of them and the ways only where a line may be.

use crate::cycle::homing::trace::{Frame, GROUP, Group};
use crate::cycle::profile::higher;
use wide::f64x2;

/// Number, ways x, torques t and their products.
#[derive(Debug, Clone, Copy, Default)]
pub struct Sums {
    pub n: f64,
    pub t: f64,
    pub tt: f64,
    pub x: f64,
    xx: f64,
    xt: f64,
}

/// The same of the steps to a block from the one before it.
#[derive(Debug, Clone, Copy, Default)]
pub struct Steps {
    tt: f64,
    xx: f64,
    xt: f64,
}

impl Steps {
    #[inline(always)]
    pub fn add(&mut self, frame: &Frame, [before, block]: [[f64; 2]; 2]) {
        let [x, t] = [block[0] - before[0], block[1] - before[1]];
        self.xx += x * x;
        self.xt += frame.sense * frame.torque_sense * x * t;
        self.tt += t * t;
    }

    /// What came since `from`.
    #[inline(always)]
    pub fn since(&self, from: &Steps) -> Steps {
        Steps { tt: self.tt - from.tt, xx: self.xx - from.xx, xt: self.xt - from.xt }
    }

    /// Squares of the steps about a line of that slope.
    pub fn about(&self, slope: f64) -> f64 {
        (self.tt - 2.0 * slope * self.xt + slope * slope * self.xx).max(0.0)
    }
}

/// Sums and steps up to the start of a group.
#[derive(Debug, Clone, Copy, Default)]
pub struct Start {
    pub sums: Sums,
    pub steps: Steps,
}

/// The first lane in both.
#[inline(always)]
fn both(lanes: f64x2) -> f64x2 {
    f64x2::splat(lanes.to_array()[0])
}

impl Start {
    /// After `n` blocks of which nothing counts.
    #[must_use]
    pub fn after(n: u32) -> Start {
        Start { sums: Sums { n: f64::from(n), ..Sums::default() }, ..Start::default() }
    }

    /// Takes over the torques from the group `before`, with those of its own; the square of the largest of them.
    #[inline(always)]
    pub fn torques_after(&mut self, frame: &Frame, group: Group, before: &Start) -> f64 {
        let [mut t, mut tt, mut steps, mut most] = [f64x2::ZERO; 4];
        let mut last = group.before[1];
        for [[_, one], [_, other]] in group.blocks.as_chunks::<2>().0 {
            let torque = f64x2::new([*one, *other]);
            let step = torque - f64x2::new([last, *one]);
            last = *other;
            let square = torque * torque;
            t += torque;
            tt += square;
            most = most.fast_max(square);
            steps += step * step;
        }
        let [one, other] = most.to_array();
        self.sums.n = before.sums.n + GROUP as f64;
        self.sums.t = before.sums.t + frame.torque_sense * t.reduce_add();
        self.sums.tt = before.sums.tt + tt.reduce_add();
        self.steps.tt = before.steps.tt + steps.reduce_add();
        higher(one, other)
    }

    /// Begins the sums of ways here.
    pub fn no_ways(&mut self) {
        let (Sums { n, t, tt, .. }, Steps { tt: step_tt, .. }) = (self.sums, self.steps);
        self.sums = Sums { n, t, tt, ..Sums::default() };
        self.steps = Steps { tt: step_tt, ..Steps::default() };
    }

    /// Takes over the ways from the `next` group, without those of its own.
    #[inline(always)]
    pub fn ways_before(&mut self, frame: &Frame, group: Group, next: &Start) {
        let own = Start::of_blocks(frame, group, GROUP);
        self.sums.x = next.sums.x - own.sums.x;
        self.sums.xx = next.sums.xx - own.sums.xx;
        self.sums.xt = next.sums.xt - own.sums.xt;
        self.steps.xx = next.steps.xx - own.steps.xx;
        self.steps.xt = next.steps.xt - own.steps.xt;
    }

    /// These and the first `n` blocks of a group more.
    #[inline(always)]
    pub fn and_blocks(&self, frame: &Frame, group: Group, n: usize) -> Start {
        let more = Start::of_blocks(frame, group, n);
        let ([a, b], [c, d]) = ([&self.sums, &more.sums], [&self.steps, &more.steps]);
        let sums = Sums { n: a.n + b.n, t: a.t + b.t, tt: a.tt + b.tt, x: a.x + b.x, xx: a.xx + b.xx, xt: a.xt + b.xt };
        Start { sums, steps: Steps { tt: c.tt + d.tt, xx: c.xx + d.xx, xt: c.xt + d.xt } }
    }

    /// The first `n` blocks of a group, way and torque of each side by side.
    #[inline(always)]
    fn of_blocks(frame: &Frame, group: Group, n: usize) -> Start {
        let origin = f64x2::new([frame.origin, 0.0]);
        let [mut sum, mut squares, mut products, mut step_squares, mut step_products] = [f64x2::ZERO; 5];
        let mut last = f64x2::new(group.before);
        for block in group.blocks.iter().take(n) {
            let block = f64x2::new(*block);
            let (at, step) = (block - origin, block - last);
            last = block;
            sum += at;
            squares += at * at;
            products += at * both(at);
            step_squares += step * step;
            step_products += step * both(step);
        }
        let ([x, t], [_, tt], [xx, xt]) = (sum.to_array(), squares.to_array(), products.to_array());
        let ([_, step_tt], [step_xx, step_xt]) = (step_squares.to_array(), step_products.to_array());
        let toward = frame.sense * frame.torque_sense;
        let sums = Sums { n: n as f64, t: frame.torque_sense * t, tt, x: frame.sense * x, xx, xt: toward * xt };
        Start { sums, steps: Steps { tt: step_tt, xx: step_xx, xt: toward * step_xt } }
    }
}

impl Sums {
    #[inline(always)]
    pub fn add(&mut self, (x, t): (f64, f64)) {
        self.n += 1.0;
        self.x += x;
        self.t += t;
        self.xx += x * x;
        self.xt += x * t;
        self.tt += t * t;
    }

    /// What came since `from`.
    #[inline(always)]
    pub fn since(&self, from: &Sums) -> Sums {
        let [a, b] = [self, from];
        Sums { n: a.n - b.n, t: a.t - b.t, tt: a.tt - b.tt, x: a.x - b.x, xx: a.xx - b.xx, xt: a.xt - b.xt }
    }

    /// Squares of t about its mean.
    #[inline(always)]
    pub fn scatter(&self) -> f64 {
        higher(self.tt - self.t * self.t / self.n, 0.0)
    }

    /// Squares of x about its mean, and products.
    #[inline(always)]
    pub fn spread(&self) -> (f64, f64) {
        (self.xx - self.x * self.x / self.n, self.xt - self.x * self.t / self.n)
    }

    /// Slope of the least-squares line and squares about it; slope 0 where x does not vary.
    #[inline(always)]
    pub fn line(&self) -> (f64, f64) {
        let (sxx, sxt) = self.spread();
        if sxx <= 0.0 {
            return (0.0, self.scatter());
        }
        let slope = sxt / sxx;
        (slope, higher(self.scatter() - slope * sxt, 0.0))
    }
}
