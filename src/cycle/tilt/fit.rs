//! A line or plane through the blocks of a path, with the tool's wear beside it.
//!
//! Apparent depth = d·(1 + w·s) with d = d₀ + gᵤ·u + gᵥ·v, u and v along and across the main direction of the path (mm), s
//! the length cut so far (m), and w the wear: a worn edge adds force in proportion to its length in the cut. So d is the
//! depth as the tool of the start would see it. The product w·d is linear again with the d of the pass before. Each block weighs as its load would: residual · dL/dd. First least absolute deviations, by reweighting, which a
//! quarter of false blocks does not move; then Tukey's biweight at 4.685 σ, σ from the median of the residuals, so that
//! entry, exit and chips end with no weight (Holland and Welsch 1977; variance after Huber 1981, 7.6).
//!
//! The wear w is fitted where the passes can tell it from tilt: where at least a tenth of the variance of s is not explained
//! by position, as after a reversed or repeated pass; 0 ± ten times what the configuration expects then counts as one more
//! measurement. Where not, w = 0 is assumed with the standard uncertainty that the configuration expects. Residuals that follow each other widen the uncertainty by (1 + ρ)/(1 − ρ), ρ their correlation; few blocks
//! widen it as Student's t does. The unknowns take their part of both: of n residuals of least absolute deviations as many are 0
//! as there are unknowns, so the median is that of the others, and their correlation comes out too low by unknowns/n.
//!
//! All of it goes on in slices, so that no cycle is long.

mod read;

use super::normal::{Factors, Square};
use super::trace::Block;

/// Blocks in a slice.
const SLICE: usize = 12;
/// Blocks needed.
pub const FEWEST: usize = 12;
/// Passes of least absolute deviations, and of the biweight with its first and with its second scale.
const PASSES: [u32; 3] = [8, 13, 18];
/// Share of the mean absolute residual below which blocks weigh no more.
const NEAREST: f64 = 0.1;
/// Tukey's constant.
const TUKEY: f64 = 4.685;
/// Normal σ for a median of absolute residuals of 1.
const SIGMA_OF_MEDIAN: f64 = 1.4826;
/// A path narrower than this part of its length is a line.
const NARROW: f64 = 0.03;
/// Share of the variance of the cut length that position must leave unexplained.
const SEPARABLE: f64 = 0.1;
/// Times what is expected that the wear may well be where it is told from tilt: on a short path an entry may look like more.
const BEYOND: f64 = 10.0;
/// Student's t over 2 where the normal distribution has 2, by powers of 1/freedom: (z² + 1)/4 and (5z⁴ + 16z² + 3)/96 at z = 2.
const STUDENT: [f64; 2] = [1.25, 1.53];
/// Halvings that find a median.
const HALVINGS: u32 = 26;

/// What the next slice does.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Stage {
    /// Ends after all blocks: where they are.
    Moments,
    /// Ends after all blocks: weighted sums with the present weights.
    Weigh,
    /// Ends after `HALVINGS` passes: the median of the absolute residuals.
    Median,
    /// Ends with the next `begin`.
    Done,
}

/// The fit of one path; plain data.
#[derive(Debug, Clone, Copy)]
pub struct Fit {
    stage: Stage,
    next: usize,
    pass: u32,
    /// Wear that is expected, 1/m.
    wear_prior: f64,
    /// Sums over position: 1, x, y, s, xx, xy, yy; and of the values.
    moments: [f64; 8],
    bounds: [[f64; 2]; 2],
    /// Mean of x, y and s.
    pub centre: [f64; 3],
    /// Main direction of the path.
    pub along: [f64; 2],
    /// The path is a plane's, not a line's.
    pub planar: bool,
    /// Wear was told from tilt.
    pub separable: bool,
    normal: Square,
    right: [f64; 4],
    /// d₀, gᵤ, gᵥ, w.
    pub beta: [f64; 4],
    /// Sums for the weights' scale and variance: |ρ|, n, weight, ψ, ψ², ψ′, ψψ₋₁.
    sums: [f64; 7],
    last: f64,
    scale: f64,
    /// Variance of a block, in load, as it bears on a slope: widened by correlation.
    noise: f64,
    /// Bounds of the median, blocks below their middle, and how often they were halved.
    median: [f64; 2],
    below: usize,
    halvings: u32,
    /// Covariance of `beta`.
    pub covariance: Square,
    /// Standard deviation of a block, in load.
    pub deviation: f64,
    /// Blocks without weight.
    pub rejected: u32,
    /// Most of them in a row, and those in the present row.
    pub in_a_row: u32,
    row: u32,
    /// For the two points: the first block, and the block of the first pass that is farthest from it.
    pub ends: [Block; 2],
    /// Square of their distance; below 0 without blocks.
    apart: f64,
    /// Way in the first pass so far; infinite behind it.
    first_pass: f64,
}

impl Fit {
    /// Nothing fitted yet.
    pub const REST: Fit = Fit {
        stage: Stage::Done,
        next: 0,
        pass: 0,
        wear_prior: 0.0,
        moments: [0.0; 8],
        bounds: [[f64::MAX, f64::MIN]; 2],
        centre: [0.0; 3],
        along: [1.0, 0.0],
        planar: false,
        separable: false,
        normal: [[0.0; 4]; 4],
        right: [0.0; 4],
        beta: [0.0; 4],
        sums: [0.0; 7],
        last: 0.0,
        scale: 0.0,
        noise: 0.0,
        median: [0.0; 2],
        below: 0,
        halvings: 0,
        covariance: [[0.0; 4]; 4],
        deviation: 0.0,
        rejected: 0,
        in_a_row: 0,
        row: 0,
        ends: [Block { x: 0.0, y: 0.0, value: 0.0, gain: 0.0, load: 0.0, cut: 0.0, along: 0.0, residual: 0.0 }; 2],
        apart: -1.0,
        first_pass: 0.0,
    };

    /// Begins a fit; `wear` is the expected wear (k = 1), 1/m.
    pub fn begin(&mut self, wear: f64) {
        *self = Fit { stage: Stage::Moments, wear_prior: wear, ..Fit::REST };
    }

    /// A slice of the work. True when all is done; with fewer than `FEWEST` blocks the result means nothing.
    pub fn step(&mut self, blocks: &mut [Block]) -> bool {
        let end = (self.next + SLICE).min(blocks.len());
        let slice = blocks.get_mut(self.next..end).unwrap_or(&mut []);
        match self.stage {
            Stage::Moments => slice.iter().for_each(|block| self.place(block)),
            Stage::Weigh => slice.iter_mut().for_each(|block| self.weigh(block)),
            Stage::Median => self.below += slice.iter().filter(|b| b.residual.abs() <= self.middle()).count(),
            Stage::Done => return true,
        }
        self.next = end;
        if end == blocks.len() {
            self.next = 0;
            match self.stage {
                Stage::Moments => self.placed(),
                Stage::Weigh => self.weighed(),
                Stage::Median => self.halve(blocks.len()),
                Stage::Done => {}
            }
        }
        self.stage == Stage::Done
    }

    fn place(&mut self, b: &Block) {
        for (sum, value) in
            self.moments.iter_mut().zip([1.0, b.x, b.y, b.cut, b.x * b.x, b.x * b.y, b.y * b.y, b.value])
        {
            *sum += value;
        }
        for (bounds, value) in self.bounds.iter_mut().zip([b.x, b.y]) {
            *bounds = [bounds[0].min(value), bounds[1].max(value)];
        }
    }

    /// The main direction: the larger axis of the ellipse of the positions.
    fn placed(&mut self) {
        let [n, x, y, s, xx, xy, yy, value] = self.moments;
        let n = n.max(1.0);
        self.centre = [x / n, y / n, s / n];
        self.beta[0] = value / n;
        let (xx, xy, yy) = (xx / n - x * x / (n * n), xy / n - x * y / (n * n), yy / n - y * y / (n * n));
        let half = 0.5 * (xx - yy);
        let root = (half * half + xy * xy).sqrt();
        let large = 0.5 * (xx + yy) + root;
        let small = 0.5 * (xx + yy) - root;
        // The eigenvector from whichever row does not cancel.
        let (p, q) = if half >= 0.0 { (half + root, xy) } else { (xy.abs(), (root - half).copysign(xy)) };
        let length = (p * p + q * q).sqrt();
        self.along = if length > 0.0 { [p / length, q / length] } else { [1.0, 0.0] };
        self.planar = small > NARROW * NARROW * large;
        self.stage = Stage::Weigh;
    }

    /// 1, u, v, s·d of a block, d by the plane so far.
    #[inline(always)]
    fn basis(&self, b: &Block) -> [f64; 4] {
        let (x, y) = (b.x - self.centre[0], b.y - self.centre[1]);
        let [c, s] = self.along;
        let (u, v) = (c * x + s * y, if self.planar { c * y - s * x } else { 0.0 });
        // Where wear looks like tilt, the bend that the product makes is no evidence: a bent table makes it too.
        let worn = if self.separable { b.cut } else { self.centre[2] };
        [1.0, u, v, b.cut * self.beta[0] + worn * (self.beta[1] * u + self.beta[2] * v)]
    }

    fn weigh(&mut self, block: &mut Block) {
        let row = self.basis(block);
        let beta = self.beta;
        let value = beta[0] * row[0] + beta[1] * row[1] + beta[2] * row[2] + beta[3] * row[3];
        let r = (block.value - value) * block.gain;
        block.residual = r;
        let weight = match self.pass {
            0 => {
                self.ends(block);
                1.0
            }
            pass if pass <= PASSES[0] => 1.0 / r.abs().max(self.scale),
            _ => {
                let t = r / (TUKEY * self.scale);
                let inside = (1.0 - t * t).max(0.0);
                let psi = inside * inside * r;
                let counts = if inside > 0.0 { 1.0 } else { 0.0 };
                self.rejected += u32::from(inside == 0.0);
                self.row = if inside == 0.0 { self.row + 1 } else { 0 };
                self.in_a_row = self.in_a_row.max(self.row);
                let slope = counts * inside * (1.0 - 5.0 * t * t);
                let news = [0.0, counts, inside * inside, psi, psi * psi, slope, psi * self.last];
                self.sums.iter_mut().zip(news).for_each(|(sum, value)| *sum += value);
                self.last = psi;
                inside * inside
            }
        };
        self.sums[0] += r.abs();
        let weight = weight * block.gain * block.gain;
        for i in 0..4 {
            let part = weight * row[i];
            for j in 0..=i {
                self.normal[i][j] += part * row[j];
            }
            self.right[i] += part * block.value;
        }
    }

    fn ends(&mut self, block: &Block) {
        // A pass begins with less way than the one before has ended with.
        self.first_pass = if block.along >= self.first_pass { block.along } else { f64::INFINITY };
        if self.apart < 0.0 {
            (self.ends, self.apart) = ([*block; 2], 0.0);
        }
        let (x, y) = (block.x - self.ends[0].x, block.y - self.ends[0].y);
        if self.first_pass < f64::INFINITY && x * x + y * y > self.apart {
            (self.ends[1], self.apart) = (*block, x * x + y * y);
        }
    }

    /// A pass over all blocks has ended: solve, and go on to the next.
    fn weighed(&mut self) {
        let n = self.moments[0].max(1.0);
        if self.pass == 0 {
            let total = self.normal[3][3] - self.normal[3][0] * self.normal[3][0] / self.normal[0][0].max(1e-300);
            let left = self.factors().pivots[3];
            self.separable = total > 0.0 && left > SEPARABLE * total;
        }
        let robust = self.pass > PASSES[0];
        let last = self.pass == PASSES[2];
        // What is expected of the wear, as if it had been measured; before there is a scale, that there is none.
        let expected = if self.separable { BEYOND * self.wear_prior } else { self.wear_prior };
        self.normal[3][3] += match robust {
            true => self.noise / (expected * expected),
            // Of absolute deviations, whose mean is to be had from the bound of the weights.
            false if self.separable => self.scale / (NEAREST * expected * expected),
            false => 1e30,
        };
        let factors = self.factors();
        if robust {
            self.scatter();
        }
        if last {
            return self.conclude(&factors);
        }
        self.beta = factors.solve(&self.right);
        self.pass += 1;
        let mean = self.sums[0] / n;
        // Residuals of the beta before; a part of them bounds the weights of the nearest blocks.
        self.scale = if self.pass <= PASSES[0] { floor(NEAREST * mean, self.beta[0]) } else { self.scale };
        if self.pass == PASSES[0] + 1 || self.pass == PASSES[1] + 1 {
            self.median = [0.0, self.sums[0]];
            self.below = 0;
            self.stage = Stage::Median;
        }
        self.forget();
    }

    /// Of the unknowns d₀, gᵤ, gᵥ, w; across a line there is none.
    fn factors(&self) -> Factors {
        Factors::new(&self.normal, [true, true, self.planar, true])
    }

    fn forget(&mut self) {
        self.normal = [[0.0; 4]; 4];
        self.right = [0.0; 4];
        self.sums = [0.0; 7];
        self.last = 0.0;
        (self.rejected, self.in_a_row, self.row) = (0, 0, 0);
    }

    fn middle(&self) -> f64 {
        0.5 * (self.median[0] + self.median[1])
    }

    fn halve(&mut self, blocks: usize) {
        let middle = self.middle();
        self.median[usize::from(2 * self.below >= blocks + self.unknowns() as usize)] = middle;
        self.below = 0;
        self.halvings += 1;
        if self.halvings == HALVINGS {
            self.halvings = 0;
            self.scale = floor(SIGMA_OF_MEDIAN * self.median[1], self.beta[0]);
            self.noise = self.scale * self.scale;
            self.stage = Stage::Weigh;
        }
    }

    fn unknowns(&self) -> u32 {
        2 + u32::from(self.planar) + u32::from(self.separable)
    }

    /// What the residuals of the pass say of the noise.
    fn scatter(&mut self) {
        let [_, n, weights, psi, psi2, slope, lag] = self.sums;
        let unknowns = f64::from(self.unknowns());
        let freedom = (n - unknowns).max(1.0);
        let slope = (slope / n.max(1.0)).max(0.1);
        let mean = psi / n.max(1.0);
        let variance = (psi2 - n * mean * mean).max(0.0) / freedom / (slope * slope);
        let follow = if psi2 > 0.0 { (lag / psi2 + unknowns / n.max(1.0)).clamp(0.0, 0.95) } else { 0.0 };
        self.deviation = variance.sqrt();
        let few = 1.0 + STUDENT[0] / freedom + STUDENT[1] / (freedom * freedom);
        // The normal matrix carries the weights.
        self.noise = few * few * variance * (1.0 + follow) / (1.0 - follow) * weights / n.max(1.0);
    }

    /// Covariance of the unknowns by the last pass.
    fn conclude(&mut self, factors: &Factors) {
        for i in 0..4 {
            let mut unit = [0.0; 4];
            unit[i] = 1.0;
            let column = factors.solve(&unit);
            for j in 0..4 {
                self.covariance[j][i] = column[j] * self.noise;
            }
        }
        self.stage = Stage::Done;
    }
}

/// Keeps a scale off zero where the blocks have no noise.
fn floor(scale: f64, level: f64) -> f64 {
    scale.max(1e-9 * level.abs()).max(1e-12)
}

#[cfg(test)]
mod tests;
