//! Linear regression on blocks that a few wrong ones do not move.
//!
//! Starts at least squares, goes by least absolute values to Tukey's biweight, drops what lies further out than chance
//! explains and ends at least squares on the rest (reweighted least squares; Rousseeuw & Leroy 1987). The acceleration
//! is itself measured: its noise variance is taken off the normal matrix, else inertia would read low (errors in
//! variables; Fuller 1987). The covariance allows for residuals that scatter unequally and hang together (Newey & West
//! 1987), since torque ripple does both.

use super::blocks::{BLOCKS, Block};
use nalgebra::{SMatrix, SVector};

/// Terms of the balance: acceleration, speed, sense, constant, and the torque in excess beyond a limit.
const TERMS: usize = 5;
/// One number for each term.
pub type Terms = SVector<f64, TERMS>;
type Square = SMatrix<f64, TERMS, TERMS>;
/// Which term is the constant one, and which the excess; both are there only where asked for.
const CONSTANT: usize = 3;
const EXCESS: usize = 4;
/// Residuals beyond this many standard deviations are not chance: 1 in 15 000 if they are normal.
const FAR: f64 = 4.0;
/// Standard deviation of a normal distribution over its median absolute deviation.
const STD_PER_MAD: f64 = 1.482_602_218_505_602;
/// Tukey's constant for 95 % efficiency on normal residuals.
const BIWEIGHT: f64 = 4.685;
const ITERATIONS: usize = 12;
/// Variance of a change that is not worth another iteration, as a share of the variance.
const TRIFLE: f64 = 1e-4;

/// A speed and a torque from which on a drive may report more torque than its motor delivers.
#[derive(Debug, Clone, Copy)]
pub struct Limit {
    /// |ω|, rad/s.
    pub speed: f64,
    /// |T|, N·m, of the balance `terms`: what is measured holds noise, and to choose by that would favour one sign of it.
    pub torque: f64,
    /// That balance.
    pub terms: Terms,
}

impl Limit {
    /// No limit, of a balance.
    #[must_use]
    pub fn none(terms: Terms) -> Limit {
        Limit { speed: f64::MAX, torque: f64::MAX, terms }
    }

    /// How far a motion is beyond the limit, as a share of it; 0 within. Beside it the torque of the balance.
    fn beyond(&self, motion: &Terms) -> (f64, f64) {
        let torque = self.terms.dot(motion);
        ((motion[1].abs() / self.speed).max(torque.abs() / self.torque).max(1.0) - 1.0, torque)
    }
}

/// What the blocks are regressed on, and which of them count.
#[derive(Debug, Clone, Copy)]
pub struct Rows<'a> {
    /// The blocks in order of time.
    pub blocks: &'a [Block],
    /// True where the spindle turned both ways, so that a constant torque can be told from Coulomb friction.
    pub both_senses: bool,
    /// Variance of the acceleration's noise, (rad/s²)².
    pub noise: f64,
    /// What is beyond does not count.
    pub trusted: Limit,
    /// Beyond this an excess of torque is fitted too, in proportion to torque and to how far beyond: 1 is what a drive shows
    /// that reports current × constant.
    pub suspected: Option<Limit>,
}

/// A fitted balance.
#[derive(Debug, Clone, Copy)]
pub struct Regression {
    /// J, B, Tc, T0, excess.
    pub terms: Terms,
    /// Their variances.
    pub variance: Terms,
    /// What these would be if each block's torque varied by 1 for itself.
    pub inverse: Terms,
    /// Standard deviation of a block's torque about the fit, N·m.
    pub scatter: f64,
    /// Blocks that the result rests on.
    pub used: usize,
    /// Blocks dropped as outliers.
    pub dropped: usize,
    /// Most of them that followed one another.
    pub in_a_row: usize,
    /// Lags over blocks of that covariance.
    pub lag_share: f64,
    /// Share of the acceleration's variance, free of the other terms, that is noise.
    pub noise_share: f64,
}

impl Regression {
    /// By how many standard deviations the drive reports more torque beyond the suspected limit than the motor delivers.
    #[must_use]
    pub fn excess(&self) -> f64 {
        self.terms[EXCESS] / self.variance[EXCESS].max(f64::MIN_POSITIVE).sqrt()
    }
}

/// The normal equations of least squares, summed up.
#[derive(Debug, Clone, Copy, Default)]
pub struct Sums {
    normal: Square,
    right: Terms,
    squares: f64,
    weight: f64,
}

impl Sums {
    fn add(&mut self, row: Terms, torque: f64, weight: f64) {
        self.normal += weight * row * row.transpose();
        self.right += weight * torque * row;
        self.squares += weight * torque * torque;
        self.weight += weight;
    }

    /// Of these and the others together.
    #[must_use]
    pub fn and(mut self, other: &Sums) -> Sums {
        self.normal += other.normal;
        self.right += other.right;
        self.squares += other.squares;
        self.weight += other.weight;
        self
    }

    /// Inverse of the normal matrix and the solution, `noise` being the variance of the acceleration's noise.
    fn solve(&self, noise: f64) -> Option<(Square, Terms)> {
        let mut normal = self.normal;
        normal[(0, 0)] -= self.weight * noise;
        // A term that is not asked for, or that no block tells of, is nought.
        for term in CONSTANT..TERMS {
            normal[(term, term)] += f64::from(u8::from(normal[(term, term)] == 0.0));
        }
        let inverse = inverse(&normal)?;
        Some((inverse, inverse * self.right))
    }

    /// The solution, the diagonal of that inverse, and the variance of a residual.
    #[must_use]
    pub fn plain(&self, noise: f64) -> Option<(Terms, Terms, f64)> {
        let (inverse, terms) = self.solve(noise)?;
        let squares = self.squares - 2.0 * self.right.dot(&terms) + terms.dot(&(self.normal * terms));
        Some((terms, inverse.diagonal(), squares.max(0.0) / (self.weight - TERMS as f64).max(1.0)))
    }
}

impl Rows<'_> {
    /// Acceleration, speed, sense and constant of a block.
    fn motion(&self, block: &Block) -> Terms {
        let constant = if self.both_senses { 1.0 } else { 0.0 };
        Terms::new(block.acceleration, block.speed, block.speed.signum(), constant, 0.0)
    }

    /// The regressors of a block.
    #[must_use]
    pub fn row(&self, block: &Block) -> Terms {
        let mut row = self.motion(block);
        if let Some(limit) = &self.suspected {
            let (share, torque) = limit.beyond(&row);
            row[EXCESS] = share * torque;
        }
        row
    }

    /// Whether a block is within what is trusted.
    #[must_use]
    pub fn counts(&self, block: &Block) -> bool {
        self.trusted.beyond(&self.motion(block)).0 <= 0.0
    }

    /// Noise of the acceleration is no motion, so torque contradicts it by J times as much: what torque follows is motion, as of a
    /// drive that chases the steps of a coarse speed, and must not be taken off.
    #[must_use]
    pub fn with_noise_that_torque_denies(self) -> Self {
        let most = self.fit().map_or(f64::MAX, |found| (found.scatter / found.terms[0]).powi(2));
        Rows { noise: self.noise.min(most), ..self }
    }

    /// What is left of a block's torque beside the balance `terms`.
    #[must_use]
    pub fn off(&self, terms: &Terms, block: &Block) -> f64 {
        block.torque - terms.dot(&self.row(block))
    }

    /// Stretches of two and more blocks that count and have one acceleration, within `apart`.
    pub fn levels(&self, apart: f64) -> impl Iterator<Item = &[Block]> {
        let near = move |a: &Block, b: &Block| (a.acceleration - b.acceleration).abs() <= apart;
        let level = move |a: &Block, b: &Block| near(a, b) && self.counts(a) && self.counts(b);
        self.blocks.chunk_by(level).filter(|blocks| blocks.len() > 1)
    }

    /// Standard deviation of a block's torque by what neighbours of one level differ: noise, whatever else is wrong. Where in a level
    /// something happens, that counts once. 0 where there are none.
    #[must_use]
    pub fn noise_of_neighbours(&self, terms: &Terms, apart: f64) -> f64 {
        let mut differences = [0.0; BLOCKS];
        let mut n = 0;
        let pairs = self.levels(apart).flat_map(|blocks| blocks.iter().zip(blocks.iter().skip(1)));
        for ((a, b), place) in pairs.zip(differences.iter_mut()) {
            *place = (self.off(terms, a) - self.off(terms, b)).abs();
            n += 1;
        }
        let Some(seen) = differences.get_mut(..n).filter(|seen| !seen.is_empty()) else { return 0.0 };
        STD_PER_MAD * *seen.select_nth_unstable_by(n / 2, f64::total_cmp).1 / core::f64::consts::SQRT_2
    }

    fn unknowns(&self) -> usize {
        CONSTANT + usize::from(self.both_senses) + usize::from(self.suspected.is_some())
    }

    /// Residuals of the blocks that count.
    fn residuals(&self, terms: &Terms, out: &mut [f64; BLOCKS]) -> usize {
        let mut n = 0;
        for (block, place) in self.blocks.iter().filter(|b| self.counts(b)).zip(out.iter_mut()) {
            *place = self.off(terms, block);
            n += 1;
        }
        n
    }

    /// Inverse of the normal matrix and the solution under weights by residual.
    fn solve(&self, weight: impl Fn(&Block) -> f64) -> Option<(Square, Terms)> {
        let mut sums = Sums::default();
        for block in self.blocks.iter().filter(|b| self.counts(b)) {
            sums.add(self.row(block), block.torque, weight(block));
        }
        sums.solve(self.noise)
    }

    /// The robust fit; `None` when the blocks do not determine the terms.
    #[must_use]
    pub fn fit(&self) -> Option<Regression> {
        let (terms, far, n) = self.settled()?;
        self.finish(|block| self.off(&terms, block).abs() <= far, n)
    }

    /// Least squares over the blocks that the [robust fit](Self::fit) keeps, by stretches of equal length in time.
    #[must_use]
    pub fn in_stretches<const N: usize>(&self) -> Option<[Sums; N]> {
        let (terms, far, _) = self.settled()?;
        let kept = || self.blocks.iter().filter(|b| self.counts(b) && self.off(&terms, b).abs() <= far);
        let (mut stretches, count) = ([Sums::default(); N], kept().count());
        for (i, block) in kept().enumerate() {
            if let Some(stretch) = stretches.get_mut(i * N / count) {
                stretch.add(self.row(block), block.torque, 1.0);
            }
        }
        Some(stretches)
    }

    /// Terms that wrong blocks do not move, how far a residual may be from them, and how many blocks there are.
    fn settled(&self) -> Option<(Terms, f64, usize)> {
        let (_, mut terms) = self.solve(|_| 1.0)?;
        let mut residuals = [0.0; BLOCKS];
        for weight in [absolute_values, biweight] {
            for _ in 0..ITERATIONS {
                let n = self.residuals(&terms, &mut residuals);
                if n <= self.unknowns() {
                    return None;
                }
                let scale = self.scale(&mut residuals, n);
                let (inverse, next) = self.solve(|block| weight(self.off(&terms, block).abs() / scale))?;
                let settled =
                    (0..TERMS).all(|i| (next[i] - terms[i]).powi(2) <= TRIFLE * scale * scale * inverse[(i, i)]);
                terms = next;
                if settled {
                    break;
                }
            }
        }
        let n = self.residuals(&terms, &mut residuals);
        Some((terms, FAR * self.scale(&mut residuals, n), n))
    }

    /// Robust standard deviation of the first `n` residuals, which are reordered; never zero.
    fn scale(&self, residuals: &mut [f64; BLOCKS], n: usize) -> f64 {
        let Some(seen) = residuals.get_mut(..n) else { return f64::MIN_POSITIVE };
        seen.iter_mut().for_each(|r| *r = r.abs());
        // The fit makes as many residuals small as it has unknowns.
        let rank = ((n + self.unknowns()) / 2).min(n.saturating_sub(1));
        let middle = if n > 0 { *seen.select_nth_unstable_by(rank, f64::total_cmp).1 } else { 0.0 };
        (STD_PER_MAD * middle).max(1e-12)
    }

    /// Least squares on the blocks that `near` lets through.
    fn finish(&self, near: impl Fn(&Block) -> bool, n: usize) -> Option<Regression> {
        let (inverse, terms) = self.solve(|block| if near(block) { 1.0 } else { 0.0 })?;
        let residual = |block: &Block| self.off(&terms, block);
        let counted = || self.blocks.iter().filter(|b| self.counts(b) && near(b));
        let used = counted().count();
        let freedom = used.checked_sub(self.unknowns()).filter(|f| *f > 0)? as f64;
        let squares: f64 = counted().map(|b| residual(b) * residual(b)).sum();
        let scatter = (squares / freedom).sqrt();
        // Half the lag window that Newey and West give for this many blocks, at least two neighbours.
        let lags = ((4.0 * (used as f64 / 100.0).powf(2.0 / 9.0)) as usize).max(2);
        let mut meat = Square::zeros();
        let mut past = [Terms::zeros(); 16];
        for (i, block) in counted().enumerate() {
            let score = residual(block) * self.row(block);
            meat += score * score.transpose();
            for lag in 1..=lags.min(i).min(past.len() - 1) {
                let weight = 1.0 - lag as f64 / (lags as f64 + 1.0);
                let cross = score * past[(i - lag) % past.len()].transpose();
                meat += weight * (cross + cross.transpose());
            }
            past[i % past.len()] = score;
        }
        let sandwich = inverse * meat * inverse * (used as f64 / freedom);
        // A short record can make the sandwich too lucky; it is never believed below plain least squares.
        let variance = sandwich.diagonal().sup(&(inverse.diagonal() * (squares / freedom)));
        let free = 1.0 / (inverse[(0, 0)] * used as f64);
        let noise_share = self.noise / (self.noise + free);
        let lag_share = (lags + 1) as f64 / used as f64;
        let in_a_row = longest(self.blocks.iter().filter(|b| self.counts(b)).map(|b| !near(b)));
        Some(Regression {
            terms,
            variance,
            inverse: inverse.diagonal(),
            scatter,
            used,
            dropped: n - used,
            in_a_row,
            lag_share,
            noise_share,
        })
    }
}

/// Length of the longest run of `true`.
fn longest(flags: impl Iterator<Item = bool>) -> usize {
    let run = |(run, most): (usize, usize), flag| if flag { (run + 1, most.max(run + 1)) } else { (0, most) };
    flags.fold((0, 0), run).1
}

/// Weight of a residual, given in standard deviations, under which least squares become least absolute values.
fn absolute_values(residual: f64) -> f64 {
    1.0 / residual.max(0.1)
}

/// Tukey's weight.
fn biweight(residual: f64) -> f64 {
    (1.0 - (residual / BIWEIGHT).powi(2)).max(0.0).powi(2)
}

/// Inverse of a symmetric positive definite matrix, scaled first; `None` when it is as good as singular.
fn inverse(normal: &Square) -> Option<Square> {
    const SINGULAR: f64 = 1e-10;
    let diagonal = normal.diagonal();
    if !diagonal.iter().all(|d| *d > 0.0 && d.is_finite()) {
        return None;
    }
    let scale = Square::from_diagonal(&diagonal.map(|d| 1.0 / d.sqrt()));
    let cholesky = (scale * normal * scale).cholesky()?;
    let smallest = cholesky.l().diagonal().min();
    (smallest * smallest > SINGULAR).then(|| scale * cholesky.inverse() * scale)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(blocks: &[Block]) -> Rows<'_> {
        Rows { blocks, both_senses: false, noise: 0.0, trusted: Limit::none(Terms::zeros()), suspected: None }
    }

    fn exact(j: f64, b: f64, tc: f64) -> Vec<Block> {
        let block = |i: i32| {
            let (speed, acceleration) = (50.0 + f64::from(i % 40), if i % 80 < 40 { 60.0 } else { -60.0 });
            Block { torque: j * acceleration + b * speed + tc, speed, acceleration }
        };
        (0..160).map(block).collect()
    }

    #[test]
    fn exact_blocks_give_exact_terms() {
        let blocks = exact(0.3, 0.02, 4.0);
        let fit = rows(&blocks).fit().unwrap();
        assert!((fit.terms - Terms::new(0.3, 0.02, 4.0, 0.0, 0.0)).norm() < 1e-9, "{:?}", fit.terms);
        assert!(fit.scatter < 1e-9 && fit.dropped == 0);
    }

    #[test]
    fn a_quarter_of_wrong_blocks_is_dropped() {
        let mut blocks = exact(0.3, 0.02, 4.0);
        for (i, block) in blocks.iter_mut().enumerate() {
            block.torque += 0.05 * (i as f64 * 2.7).sin(); // so that the scale is not zero
            if i % 4 == 1 {
                block.torque += 30.0 + i as f64;
            }
        }
        let fit = rows(&blocks).fit().unwrap();
        assert!((fit.terms[0] - 0.3).abs() < 1e-3, "{:?}", fit.terms);
        assert_eq!(fit.dropped, 40);
    }

    #[test]
    fn one_ramp_at_one_torque_determines_nothing() {
        // ω' = a − b·ω is what constant torque gives: the three terms lie in one plane.
        let block = |i: i32| {
            let acceleration = 60.0 * (-f64::from(i) * 0.05).exp();
            Block { torque: 5.0, speed: 100.0 - acceleration, acceleration }
        };
        let blocks: Vec<Block> = (0..60).map(block).collect();
        assert!(rows(&blocks).fit().is_none());
    }

    /// Motion that goes to and fro from block to block looks like noise, but torque goes with it.
    #[test]
    fn motion_that_torque_follows_is_no_noise() {
        let mut blocks: Vec<Block> = exact(0.3, 0.02, 4.0);
        for (i, block) in blocks.iter_mut().enumerate() {
            let motion = if i % 2 == 0 { 6.0 } else { -6.0 };
            block.acceleration += motion;
            block.torque += 0.3 * motion + 0.05 * (i as f64 * 2.7).sin();
        }
        let taken = Rows { noise: 2.7 * 36.0, ..rows(&blocks) }; // what a second difference makes of it
        assert!(taken.fit().unwrap().terms[0] > 0.3 * 1.02);
        let fit = taken.with_noise_that_torque_denies().fit().unwrap();
        assert!((fit.terms[0] - 0.3).abs() < 0.3 * 0.002, "{:?}", fit.terms);
    }

    #[test]
    fn noise_of_the_acceleration_does_not_make_inertia_small() {
        let mut state = 5u64;
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        let mut blocks: Vec<Block> = (0..3).flat_map(|_| exact(0.3, 0.02, 4.0)).collect();
        let width = 60.0; // uniform noise of ±30 on ±60
        blocks.iter_mut().for_each(|b| b.acceleration += width * uniform());
        let noise = width * width / 12.0;
        let plain = rows(&blocks).fit().unwrap();
        let right = Rows { noise, ..rows(&blocks) }.fit().unwrap();
        assert!(plain.terms[0] < 0.3 * 0.95, "{:?}", plain.terms);
        assert!((right.terms[0] - 0.3).abs() < 0.3 * 0.02, "{:?}", right.terms);
    }
}
