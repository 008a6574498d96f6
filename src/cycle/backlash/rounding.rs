//! How far the table itself gives way before it slides: presliding, told from the drive's spring by its rounding.
//!
//! Before break-away the table moves by µm, as its friction builds up. That travel is in series with the drive and makes the
//! curve's stiffness too low, though (motor − table) does not change by it. But a spring stays straight and presliding
//! bends, the more the nearer to sliding. With u the share of the way from sliding before to sliding after, the
//! motor's travel from a kink is
//!
//! ```text
//!   s = (τ − c)/k + q·(h(u) − h(u0)),   h(u) = 4·(1 − (1 − u)^¼),   u = (τ − before − 2·motor)/D
//! ```
//!
//! which is Dahl's friction dF/dz ~ (1 − F)^n after a reversal, by Masing's rule, with n = ¾: q is D over the stiffness of the
//! table's contact. The exponent of a table is not known: from 0.4 (a build-up that ends soon) up to any (one that hardly
//! does) the truth departs from this middle by up to [`UNTOLD`] of what is taken off, to either side. A presliding that does
//! not bend before it slides looks like the drive's spring in every respect, and nothing here finds it.
//!
//! The fit starts from the straight one of [`super::fit`] and takes its steps after Gauss and Newton, a few bins a slice.

use super::cholesky::Cholesky;
use super::curve::Curve;
use super::fitted::Levels;
use crate::cycle::level::inflation;

/// The straight fit: kinks, torque across the clearance, stiffness.
#[derive(Debug, Clone, Copy, Default)]
pub struct Line {
    /// First kink, mm.
    pub s1: f64,
    /// Second kink, mm.
    pub s2: f64,
    /// Torque between them.
    pub c: f64,
    /// Stiffness.
    pub k: f64,
}

/// What rounding says of the lost motion.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Rounded {
    /// Lost motion of the rounded curve, mm.
    pub lost_motion: f64,
    /// Its variance, mm².
    pub variance: f64,
    /// The part of it that the curve leaves, without the levels' own.
    pub fit_variance: f64,
    /// Part of it that is clearance, mm.
    pub clearance: f64,
    /// Stiffness of the drive.
    pub stiffness: f64,
    /// Torque across the clearance and its standard error; `None` where chance may be all that there is of a clearance.
    pub level: Option<(f64, f64)>,
}

/// Parameters: c, k, s1, s2, q.
const PARAMETERS: usize = 5;
/// Bins in one slice of a pass.
const SLICE: usize = 3;
/// Passes over the curve.
const PASSES: u32 = 8;
/// Share of the way to sliding beyond which the bend goes on straight.
const STRAIGHT: f64 = 0.95;
/// How far the truth may be from the rounded value, as a share of what rounding takes off, for any exponent from 0.4.
pub const UNTOLD: f64 = 1.0;
/// Standard errors that a clearance is long where chance does not explain it, nor the little that a table bends otherwise.
const SHOWS: f64 = 5.0;
/// Largest correlation of neighbouring bins that is reckoned with.
pub const TOGETHER: f64 = 0.9;

type Row = [f64; PARAMETERS];

/// Sums of one pass over the curve.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    matrix: [Row; PARAMETERS],
    right: Row,
    squares: f64,
    differences: f64,
    count: f64,
    last: f64,
    /// Torque of the model at the bin before.
    torque: f64,
}

/// The fit in progress.
#[derive(Debug, Clone, Default)]
pub struct Rounding {
    levels: Levels,
    change: f64,
    least: f64,
    largest: f64,
    /// The kinks have come together, so that the curve does not tell the level between them: it stays as it is, as their distance does.
    tied: bool,
    /// The release is not on the curve: the way that the motor had come back before it; else `None`.
    returned: Option<f64>,
    first: usize,
    end: usize,
    bin: usize,
    passes: u32,
    trial: Row,
    step: Row,
    sums: Sums,
    best: Row,
    best_sums: Sums,
    found: Option<Rounded>,
}

/// h(u) and its slope.
#[inline(always)]
fn bend(u: f64) -> (f64, f64) {
    let inner = u.clamp(-1.0, STRAIGHT);
    let left = 1.0 - inner;
    let fourth = left.sqrt().sqrt();
    let slope = fourth / left;
    (4.0 * (1.0 - fourth) + (u - inner) * slope, slope)
}

impl Rounding {
    /// Begins with the straight fit over the bins `first..end`; `width` is that of a bin, mm. `returned` (mm) tells that the curve begins
    /// beyond the release, so far from where the motor turned.
    pub fn start(&mut self, line: Line, levels: Levels, first: usize, end: usize, width: f64, returned: Option<f64>) {
        self.returned = returned;
        self.levels = levels;
        self.change = levels.spring_change();
        self.tied = false;
        (self.first, self.end) = (first, end);
        self.least = 0.1 * line.k;
        self.largest = 0.5 * (end - first) as f64 * width;
        self.trial = [line.c, line.k, line.s1, line.s2, 0.0];
        self.passes = 0;
        self.found = None;
        self.best_sums.squares = f64::INFINITY;
        self.pass();
    }

    fn pass(&mut self) {
        self.bin = self.first;
        self.sums = Sums { torque: self.levels.before, ..Sums::default() };
    }

    /// Does one bounded slice of the work. Returns true once the result stands.
    pub fn advance(&mut self, curve: &Curve) -> bool {
        if self.bin < self.end {
            let to = (self.bin + SLICE).min(self.end);
            for bin in self.bin..to {
                if let Some((n, s, torque)) = curve.point(bin) {
                    self.add(n, s, torque);
                }
            }
            self.bin = to;
            return false;
        }
        self.passed()
    }

    /// Largest number of slices that it may take.
    #[must_use]
    pub const fn slices_bound(bins: usize) -> u32 {
        PASSES * (bins / SLICE + 3) as u32
    }

    /// The result; `None` where the curve cannot tell.
    #[must_use]
    pub fn result(&self) -> Option<Rounded> {
        self.found
    }

    fn share(&self, torque: f64) -> f64 {
        (torque - self.levels.before - 2.0 * self.levels.motor) / self.change
    }

    /// Adds a bin: model and its gradient there.
    #[inline(always)]
    fn add(&mut self, n: f64, s: f64, torque: f64) {
        let [c, k, s1, s2, q] = self.trial;
        let release = s < s1 && self.returned.is_none();
        let (mut model, mut gradient) = (c, [1.0, 0.0, 0.0, 0.0, 0.0]);
        if release || s > s2 {
            let (h0, slope0) = bend(self.share(c));
            let way = if release { s - s1 } else { s - s2 };
            // The torque rises from bin to bin, so that two steps from the last one suffice.
            model = if release { self.sums.torque.min(c) } else { self.sums.torque.max(c) };
            let (mut apart, mut slope) = (0.0, 1.0);
            for _ in 0..3 {
                let (h, bent) = bend(self.share(model));
                apart = h - h0;
                slope = 1.0 / k + q * bent / self.change;
                model -= ((model - c) / k + q * apart - way) / slope;
            }
            self.sums.torque = model;
            let kink = -1.0 / slope;
            gradient =
                [(1.0 / k + q * slope0 / self.change) / slope, (model - c) / (k * k) / slope, 0.0, 0.0, -apart / slope];
            gradient[if release { 2 } else { 3 }] = kink;
        }
        let residual = torque - model;
        let sums = &mut self.sums;
        for (i, row) in sums.matrix.iter_mut().enumerate() {
            let weighted = n * gradient[i];
            sums.right[i] += weighted * residual;
            for (cell, g) in row.iter_mut().zip(gradient).take(i + 1) {
                *cell += weighted * g;
            }
        }
        let residual = n.sqrt() * residual;
        if sums.count > 0.0 {
            sums.differences += (residual - sums.last) * (residual - sums.last);
        }
        sums.squares += residual * residual;
        sums.count += 1.0;
        sums.last = residual;
    }

    /// A pass has ended: the next step, or the result.
    fn passed(&mut self) -> bool {
        let gain = self.best_sums.squares - self.sums.squares;
        let better = gain > 0.0;
        let over = self.passes + 1 >= PASSES || (better && gain < 1e-4 * self.sums.squares);
        self.passes += 1;
        if better {
            self.best = self.trial;
            self.best_sums = self.sums;
        } else if !self.best_sums.squares.is_finite() {
            return true;
        }
        if over {
            self.derive();
            return true;
        }
        if better {
            match self.solvable() {
                Some(system) => self.step = system.solve(self.sums.right),
                None => return true,
            }
        } else {
            self.step.iter_mut().for_each(|step| *step *= 0.5);
        }
        self.advance_parameters();
        self.pass();
        false
    }

    fn advance_parameters(&mut self) {
        let mut next = self.best;
        for (value, step) in next.iter_mut().zip(self.step) {
            *value += step;
        }
        let largest = self.largest;
        next[1] = next[1].max(self.least);
        for i in 2..4 {
            next[i] = self.best[i] + (next[i] - self.best[i]).max(-largest).min(largest);
        }
        if next[2] > next[3] {
            let meet = 0.5 * (next[2] + next[3]);
            (next[2], next[3]) = (meet, meet);
        }
        // Bent the other way the curve must still rise.
        let bent = 0.8 * (1.0 - STRAIGHT) * self.change / next[1];
        next[4] = next[4].max(-bent);
        self.trial = next;
    }

    /// The normal equations, with the kinks tied together where they have come together. Not before: to the straight fit a bend looks
    /// like a short clearance, and what is tied to that is wrong by as much.
    fn solvable(&mut self) -> Option<Cholesky<PARAMETERS>> {
        let system = self.system();
        if system.is_some() || self.tied {
            return system;
        }
        self.tied = true;
        self.system()
    }

    /// The normal equations. Tied, width and level of the clearance stand.
    fn system(&self) -> Option<Cholesky<PARAMETERS>> {
        let mut matrix = self.best_sums.matrix;
        if self.returned.is_some() {
            // No bin lies before the first kink, and the level is that of the beginning.
            matrix[2][2] = 1.0;
            if self.tied {
                matrix[3][3] += 1e3 * matrix[3][3];
            }
        } else if self.tied {
            let stiff = 1e3 * (matrix[2][2] + matrix[3][3]);
            matrix[2][2] += stiff;
            matrix[3][3] += stiff;
            matrix[3][2] -= stiff;
            matrix[0][0] += 1e3 * matrix[0][0];
        }
        Cholesky::new(matrix)
    }

    fn derive(&mut self) {
        let [c, k, s1, s2, q] = self.best;
        let Some(system) = self.solvable() else { return };
        let sums = &self.best_sums;
        let ratio = if sums.squares > 0.0 { sums.differences / sums.squares } else { 2.0 };
        let noise = sums.squares / (sums.count - PARAMETERS as f64).max(1.0);
        let scale = noise * inflation(ratio, TOGETHER);
        let windup = self.change / k;
        let (mut lost_motion, mut gradient) = (s2 - s1 + windup, [0.0, -windup / k, -1.0, 1.0, 0.0]);
        if let Some(returned) = self.returned {
            // From the turn on the table gave way too, by q·h up to where the spring was slack.
            let (h0, slope0) = bend(self.share(c));
            let wound = (self.levels.after - c) / k;
            lost_motion = (returned + s2 + wound - q * h0).max(windup);
            gradient = [-1.0 / k - q * slope0 / self.change, -wound / k, 0.0, 1.0, -h0];
        }
        let fit_variance = scale * system.inverse_form(gradient);
        let variance = fit_variance + self.levels.variance / (k * k);
        let clearance = lost_motion - windup;
        let error = |gradient: Row| (scale * system.inverse_form(gradient)).max(0.0).sqrt();
        let shows = self.returned.is_none() && !self.tied && clearance > SHOWS * error([0.0, 0.0, -1.0, 1.0, 0.0]);
        let level = shows.then(|| (c, error([1.0, 0.0, 0.0, 0.0, 0.0])));
        let sound = lost_motion.is_finite() && variance.is_finite() && variance >= 0.0;
        self.found = sound.then_some(Rounded { lost_motion, variance, fit_variance, clearance, stiffness: k, level });
    }
}

#[cfg(test)]
mod tests {
    use crate::cycle::backlash::curve::Curve;
    use crate::cycle::backlash::fit::Fit;
    use crate::cycle::backlash::fitted::{Fitted, Levels};

    const STIFFNESS: f64 = 45.0;
    const CHANGE: f64 = 2.2;

    /// What a fit finds on an axis without a clearance under a `load`, whose table gives way by `slips` (mm) until the last of its
    /// contacts slips. Before the last one slip the others, after ways that lie evenly up to that: a share x of it builds
    /// up the share x − x·ln x of sliding.
    fn found(slips: f64, load: f64, noise: f64) -> Fitted {
        let levels = Levels { before: load - 0.5 * CHANGE, after: load + 0.5 * CHANGE, motor: 0.0, variance: 1e-8 };
        let built = |x: f64| x - x * x.max(1e-12).ln();
        let mut curve = Curve::default();
        curve.start(0.0005);
        let mut x = 0.0_f64;
        for i in 0..6000_u32 {
            let s = f64::from(i) * 1e-5;
            while x < 1.0 && CHANGE * built(x) / STIFFNESS + 2.0 * slips * x < s {
                x += 1e-5;
            }
            let chance = f64::from(i * 7919 % 101) / 50.0 - 1.0;
            curve.add(s, levels.before + CHANGE * built(x.min(1.0)) + noise * chance);
        }
        let mut fit = Box::<Fit>::default();
        fit.start(levels, 0.0, Some(0.0));
        while !fit.advance(&curve) {}
        *fit.result().expect("a rise")
    }

    #[test]
    fn a_bend_that_looks_like_a_short_clearance_is_told() {
        let truth = CHANGE / STIFFNESS;
        let mut looks_like_one = 0;
        for slips in [0.001, 0.002, 0.004, 0.0065] {
            for load in [-0.3, -0.15, 0.0, 0.1, 0.3] {
                for noise in [0.001, 0.01, 0.04] {
                    let fitted = found(slips, load, noise);
                    looks_like_one += u32::from(fitted.clearance > 0.001);
                    let told = fitted.rounded.expect("a rounded curve").lost_motion;
                    let taken = fitted.lost_motion - told;
                    assert!((told - truth).abs() < 0.5 * taken, "{slips} {load} {noise}: {taken} from {fitted:?}");
                }
            }
        }
        assert!(looks_like_one > 0);
    }
}
