//! From blocks to inertia and friction, with uncertainty, or why they cannot be had and which ramp would give them.
//!
//! Off the cycle. Beside the robust fit three things are found in the blocks themselves: the noise of the
//! acceleration, a speed above which torque and motion no longer agree (field weakening: the drive reports current ×
//! constant, the motor delivers ω_b/ω of it), and a torque above which they no longer agree (saturation).

use super::blocks::{BLOCKS, Block};
use super::doubt::{doubt, stuck};
use super::robust::{Limit, Regression, Rows, Terms};
use super::stretches::rests_on_one;
use crate::error::{Fault, GIB_ERR_INERTIA_EXCITATION, GIB_ERR_INERTIA_FEW, GIB_ERR_INERTIA_SIGN};

/// What the fit needs to know beside the blocks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Question {
    /// Time between samples, s.
    pub sample_s: f64,
    /// Smallest step of the torque, N·m; 0: not known.
    pub torque_step: f64,
    /// Smallest step of the speed, rad/s; 0: not known.
    pub speed_step: f64,
    /// Expanded uncertainty wanted, as a share of the inertia.
    pub target: f64,
    /// The machine's own inertia and its expanded uncertainty, kg·m².
    pub own: [f64; 2],
    /// Process step that the value belongs to.
    pub process_step: i32,
}

impl Question {
    /// Of a machine without inertia of its own, sampled every millisecond by sensors without a step; to 5 %.
    pub const PLAIN: Self =
        Self { sample_s: 1e-3, torque_step: 0.0, speed_step: 0.0, target: 0.05, own: [0.0; 2], process_step: 0 };
}

/// A value and its expanded uncertainty (95 %).
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Value {
    /// The value.
    pub value: f64,
    /// Half the width of the interval that holds the truth in 95 of 100 cases.
    pub uncertainty: f64,
}

/// A ramp that would reach the uncertainty wanted: up and down again between two speeds.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Ramp {
    /// Lower and upper speed, rad/s.
    pub speeds: [f64; 2],
    /// Acceleration, rad/s².
    pub acceleration: f64,
    /// Times up and down.
    pub times: f64,
    /// Torque it takes at the upper speed, N·m.
    pub torque: f64,
}

/// The balance that the blocks obey.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Balance {
    /// J, kg·m².
    pub inertia: Value,
    /// Tc, N·m.
    pub coulomb: Value,
    /// B, N·m·s/rad.
    pub viscous: Value,
    /// T0, N·m; zero where the spindle turned one way only, since then it is part of Tc.
    pub constant: Value,
    /// What T/ω' alone would say, kg·m²: mean |torque| over mean |acceleration| while accelerating.
    pub naive: f64,
    /// Standard deviation of a block's torque about the fit, N·m.
    pub scatter: f64,
    /// Blocks that the result rests on, dropped as outliers, and left out as weakened or saturated.
    pub used: usize,
    /// Dropped as outliers.
    pub dropped: usize,
    /// Left out as weakened or saturated.
    pub left_out: usize,
    /// Speed above which torque and motion disagree, rad/s; 0: none found.
    pub weakening: f64,
    /// Torque above which torque and motion disagree, N·m; 0: none found.
    pub saturation: f64,
    /// True where there is acceleration as well as braking.
    pub both_ways: bool,
    /// True where all ramps have one acceleration, so that saturation cannot be told from inertia.
    pub one_acceleration: bool,
    /// The ramp that would reach the uncertainty wanted.
    pub ramp: Ramp,
}

/// Blocks without which no scatter can be judged.
const FEWEST: usize = 12;
/// Expanded uncertainty, as a share of the inertia, beyond which it cannot be called measured: a third.
const WORST: f64 = 0.33;
/// Where a tenth of what is left of the acceleration is noise, taking it off is no longer a small correction.
const NOISY: f64 = 0.1;
/// By how many standard deviations torque must exceed motion beyond a threshold for field weakening or saturation. The best of
/// some dozens of thresholds exceeds 3.6 by chance once in a hundred times (Andrews 1993); 5.5 leaves room for ripple, whose
/// residuals are neither normal nor independent.
const EVIDENCE: f64 = 5.5;
/// That number squared, as a share of the blocks: ripple that keeps step with the ramps looks the same in each, so that more
/// ramps make it clearer without making it a limit.
const SHARE: f64 = 0.5;
/// Rise of the summed squares over the variance that is chance (χ² with one degree of freedom, 68 %).
const NEAR: f64 = 1.0;
/// Thresholds tried, in equal ratios of 3 %.
const STEPS: usize = 32;
/// The lowest of them, as a share of the largest value seen.
const LOWEST: f64 = 0.35;
/// An acceleration below this share of the largest is a hold or a corner, not a ramp.
pub(super) const HOLD: f64 = 0.3;
/// Neighbours whose accelerations differ by less than this share of the largest are of one level.
pub(super) const LEVEL: f64 = 0.2;
/// Share of a block's variance that the parabola's weights add to that of a plain mean (6/5).
const PARABOLA: f64 = 1.2;

/// Fits the balance. The balance comes back also when it cannot be used, with as much as is known.
///
/// # Errors
/// In the second place: `GIB_ERR_INERTIA_FEW`, `GIB_ERR_INERTIA_EXCITATION`, `GIB_ERR_INERTIA_SIGN`,
/// `GIB_ERR_INERTIA_TORQUE`.
pub fn fit(blocks: &[Block], length: u32, question: &Question) -> (Balance, Result<(), Fault>) {
    let mut balance = Balance { both_ways: both_ways(blocks), naive: naive(blocks), ..Balance::default() };
    balance.one_acceleration = one_acceleration(blocks);
    if blocks.len() < FEWEST {
        let (value, low) = (blocks.len() as f64, FEWEST as f64);
        let fault = Fault { code: GIB_ERR_INERTIA_FEW, field: "blocks\0", value, low, high: BLOCKS as f64 };
        return (balance, Err(fault));
    }
    let mut kept = [Block::default(); BLOCKS];
    let count = without_lone(blocks, &mut kept);
    let plain = rows(kept.get(..count).unwrap_or(&[]));
    let noise = plain.noise.max(counting_noise(length, question));
    let whole = Rows { noise, ..plain }.with_noise_that_torque_denies();
    let rounding = rounding(&whole, length, question);
    let (rows, weakening, saturation) = trustworthy(whole, rounding.sqrt());
    balance.weakening = weakening;
    balance.saturation = saturation;
    balance.left_out = blocks.len() - rows.blocks.iter().filter(|b| rows.counts(b)).count();
    let Some(found) = rows.fit() else {
        balance.ramp = blind_ramp(blocks);
        let drowned = Rows { noise: 0.0, ..rows }.fit().is_some();
        let excitation = if drowned { noisy(1.0) } else { Fault::of(GIB_ERR_INERTIA_EXCITATION) };
        return (balance, Err(stuck(blocks).unwrap_or(excitation)));
    };
    let steep = quantile(blocks, 0.98, |b| b.acceleration.abs());
    fill(&mut balance, &found, rounding, steep, &rests_on_one(&rows, &found));
    balance.ramp = ramp(&rows, &balance, length, question);
    let verdict = match doubt(blocks, &rows, &found, &balance) {
        Some(fault) => Err(fault),
        None => judge(&balance, &found),
    };
    (balance, verdict)
}

fn judge(balance: &Balance, found: &Regression) -> Result<(), Fault> {
    let Value { value, uncertainty } = balance.inertia;
    let excitation =
        |value, high| Fault { code: GIB_ERR_INERTIA_EXCITATION, field: "uncertainty_ratio\0", value, low: 0.0, high };
    if value < 0.0 && value + uncertainty < 0.0 {
        let field = "torque\0";
        return Err(Fault { code: GIB_ERR_INERTIA_SIGN, field, value, low: 0.0, high: f64::MAX });
    }
    if found.noise_share > NOISY {
        return Err(noisy(found.noise_share));
    }
    let ratio = uncertainty / value.abs();
    if !(value > 0.0 && ratio <= WORST) {
        return Err(excitation(ratio, WORST));
    }
    Ok(())
}

/// Of the acceleration's variance this share is noise.
fn noisy(share: f64) -> Fault {
    let (code, field) = (GIB_ERR_INERTIA_EXCITATION, "acceleration_noise_ratio\0");
    Fault { code, field, value: share, low: 0.0, high: NOISY }
}

fn rows(blocks: &[Block]) -> Rows<'_> {
    let forward = blocks.iter().filter(|b| b.speed > 0.0).count();
    let fewer = forward.min(blocks.len() - forward);
    Rows {
        blocks,
        both_senses: fewer >= FEWEST / 2,
        noise: acceleration_noise(blocks),
        trusted: Limit::none(Terms::zeros()),
        suspected: None,
    }
}

/// Copies the blocks but those whose acceleration stands alone: half of the largest away from both neighbours. A ramp
/// has several blocks, and the corner of one lies between its neighbours; what stands alone is a wrong speed, and as a
/// lever it would outweigh all others.
fn without_lone(blocks: &[Block], kept: &mut [Block; BLOCKS]) -> usize {
    let far = 0.5 * quantile(blocks, 0.95, |b| b.acceleration.abs());
    let noise = 8.0 * acceleration_noise(blocks).sqrt();
    let far = far.max(noise);
    let mut n = 0;
    for (i, block) in blocks.iter().enumerate() {
        let beside = |j: Option<usize>| j.and_then(|j| blocks.get(j)).map_or(block.acceleration, |b| b.acceleration);
        let (before, after) = (block.acceleration - beside(i.checked_sub(1)), block.acceleration - beside(Some(i + 1)));
        let alone = before.abs().min(after.abs()) > far && before * after > 0.0;
        if let (false, Some(place)) = (alone, kept.get_mut(n)) {
            *place = *block;
            n += 1;
        }
    }
    n
}

/// Variance of the noise of the acceleration, from its second difference over neighbouring blocks, whose variance is
/// six times as large; by the median, and where ramps are only a few blocks long without their corners.
fn acceleration_noise(blocks: &[Block]) -> f64 {
    const STD_PER_MAD: f64 = 1.482_602_218_505_602;
    let corner = 0.3 * quantile(blocks, 0.98, |b| b.acceleration.abs());
    let triples = || {
        blocks.windows(3).filter_map(|triple| match triple {
            [a, b, c] => Some([a.acceleration, b.acceleration, c.acceleration]),
            _ => None,
        })
    };
    let smooth = |[a, b, c]: &[f64; 3]| a.max(*b).max(*c) - a.min(*b).min(*c) <= corner;
    // Where nothing but noise is seen, hardly any three are close to each other: then all count.
    let all = 4 * triples().filter(smooth).count() < triples().count();
    let mut curvature = [0.0; BLOCKS];
    let mut n = 0;
    for ([a, b, c], place) in triples().filter(|triple| all || smooth(triple)).zip(curvature.iter_mut()) {
        *place = (a - 2.0 * b + c).abs();
        n += 1;
    }
    let Some(seen) = curvature.get_mut(..n).filter(|seen| !seen.is_empty()) else { return 0.0 };
    let middle = *seen.select_nth_unstable_by(n / 2, f64::total_cmp).1;
    (STD_PER_MAD * middle).powi(2) / 6.0
}

/// Variance of a block's acceleration where the speed is the difference of an encoder's counts. A position is off by e, even
/// within a count, and Σu·(eᵢ − eᵢ₋₁) = (N−1)/2·(e at the end + e before the first) − Σe. Neighbours share an e, so that what they
/// differ by tells only a third of it.
fn counting_noise(length: u32, question: &Question) -> f64 {
    let n = f64::from(length);
    let weights = n * (n * n - 1.0) / 12.0;
    let even = question.speed_step * question.speed_step / 12.0;
    even * (0.5 * (n - 1.0) + 1.0) * (n - 1.0) / (weights * question.sample_s).powi(2)
}

/// Leaves out what field weakening and saturation spoil, one after the other, where they are clear beyond chance.
/// `rounding`: standard deviation of a level of the torque by its steps; what that explains is no limit.
fn trustworthy(whole: Rows, rounding: f64) -> (Rows, f64, f64) {
    const ROUNDED: f64 = 2.0;
    const MARGIN: f64 = 0.94; // two of the thresholds tried
    let mut rows = whole;
    let (mut weakening, mut saturation) = (0.0, 0.0);
    let rounded = rows.fit().is_some_and(|plain| plain.scatter <= ROUNDED * rounding);
    for _ in 0..2 {
        let Some(limit) = limit(&rows).filter(|_| !rounded) else { break };
        if limit.speed < f64::MAX {
            weakening = limit.speed;
            rows.trusted.speed = MARGIN * weakening;
        } else {
            saturation = limit.torque;
            rows.trusted = Limit { torque: MARGIN * saturation, terms: limit.terms, ..rows.trusted };
        }
    }
    (rows, weakening, saturation)
}

/// The speed or torque from which on torque exceeds motion, with the balance within it; none where it could be chance.
fn limit(rows: &Rows) -> Option<Limit> {
    let plain = rows.fit()?;
    let found = clearest(rows, &plain, plain.terms)?;
    // Once more from what was found, since the plain balance is spoilt by what is sought.
    clearest(rows, &plain, found.terms)
}

/// Of all limits tried, with the excess of torque reckoned by the balance `terms`, the one that leaves the least unexplained.
fn clearest(rows: &Rows, plain: &Regression, terms: Terms) -> Option<Limit> {
    let none = Limit::none(terms);
    let fastest = rows.blocks.iter().map(|b| b.speed.abs()).fold(0.0, f64::max).min(rows.trusted.speed);
    let strongest = quantile(rows.blocks, 0.98, |b| b.torque.abs()).min(rows.trusted.torque);
    let mut tried = [(none, *plain); 1 + 2 * STEPS];
    for (i, place) in tried.iter_mut().skip(1).enumerate() {
        let share = LOWEST.powf(1.0 - (i / 2) as f64 / STEPS as f64);
        let mut limit = if i % 2 == 0 {
            Limit { speed: share * fastest, ..none }
        } else {
            Limit { torque: share * strongest, ..none }
        };
        for _ in 0..2 {
            let Some(found) = (Rows { suspected: Some(limit), ..*rows }).fit() else { break };
            limit.terms = found.terms;
            *place = (limit, found);
        }
    }
    // The noise is the least scatter that leaves nearly all blocks in; an outlier counts as four times that.
    let all = plain.used + plain.dropped;
    let fair = |fit: &Regression| if 5 * fit.dropped <= all { fit.scatter } else { f64::INFINITY };
    let noise = tried.iter().map(|(_, fit)| fair(fit)).fold(f64::INFINITY, f64::min).min(plain.scatter).max(1e-12);
    let loss = |fit: &Regression| fit.used as f64 * (fit.scatter / noise).powi(2) + 16.0 * fit.dropped as f64;
    let (limit, best) = tried.iter().min_by(|a, b| loss(&a.1).total_cmp(&loss(&b.1)))?;
    let clear = EVIDENCE.max((SHARE * best.used as f64).sqrt());
    if best.excess() < clear {
        return None;
    }
    // Of those of its kind that do as well but for chance, the one that leaves most blocks in.
    let same = |other: &Limit| (other.speed < f64::MAX) == (limit.speed < f64::MAX);
    let as_well = |fit: &Regression| loss(fit) < loss(best) + NEAR && fit.excess() > clear;
    tried.iter().rev().find(|(other, fit)| same(other) && as_well(fit)).map(|(limit, _)| *limit)
}

/// The quantile `share` of a quantity over the blocks.
pub(super) fn quantile(blocks: &[Block], share: f64, of: impl Fn(&Block) -> f64) -> f64 {
    let mut values = [0.0; BLOCKS];
    blocks.iter().zip(values.iter_mut()).for_each(|(block, place)| *place = of(block));
    let n = blocks.len().min(BLOCKS);
    let Some(seen) = values.get_mut(..n).filter(|seen| !seen.is_empty()) else { return 0.0 };
    *seen.select_nth_unstable_by(((n - 1) as f64 * share) as usize, f64::total_cmp).1
}

/// Whether at least a tenth of the blocks speeds up and another tenth slows down, by more than noise.
fn both_ways(blocks: &[Block]) -> bool {
    let clear = HOLD * quantile(blocks, 0.98, |b| b.acceleration.abs());
    let share = |sign: f64| blocks.iter().filter(|b| sign * b.acceleration * b.speed.signum() > clear).count();
    10 * share(1.0) >= blocks.len() && 10 * share(-1.0) >= blocks.len()
}

/// Whether saturation cannot be excluded: a motor that delivers less than its current says takes up T = J·a + s·sign a + …
/// beyond a limit, and where |a| is one number, s·sign a is (s/|a|)·a, an inertia. Ramps whose accelerations differ by half
/// tell them apart.
fn one_acceleration(blocks: &[Block]) -> bool {
    const DIFFERENT: f64 = 1.5;
    let clear = HOLD * quantile(blocks, 0.98, |b| b.acceleration.abs());
    let mut ramps = [Block::default(); BLOCKS];
    let mut n = 0;
    for (block, place) in blocks.iter().filter(|b| b.acceleration.abs() > clear).zip(ramps.iter_mut()) {
        *place = *block;
        n += 1;
    }
    let at = |share| quantile(ramps.get(..n).unwrap_or(&[]), share, |b| b.acceleration.abs());
    at(0.9) < DIFFERENT * at(0.1)
}

/// T/ω' where the spindle clearly speeds up.
fn naive(blocks: &[Block]) -> f64 {
    let clear = HOLD * quantile(blocks, 0.98, |b| b.acceleration.abs());
    let (torque, acceleration) = blocks
        .iter()
        .filter(|b| b.acceleration * b.speed.signum() > clear)
        .fold((0.0, 0.0), |sum, b| (sum.0 + b.torque.abs(), sum.1 + b.acceleration.abs()));
    if acceleration > 0.0 { torque / acceleration } else { 0.0 }
}

/// Student's 97.5 % quantile (Cornish and Fisher's expansion about the normal one).
fn student(freedom: f64) -> f64 {
    const Z: f64 = 1.959_964;
    let f = freedom.max(2.0);
    Z + (Z.powi(3) + Z) / (4.0 * f) + (5.0 * Z.powi(5) + 16.0 * Z.powi(3) + 3.0 * Z) / (96.0 * f * f)
}

/// By how much wider an interval must be since its covariance rests on few stretches of time: the 97.5 % quantile for
/// Bartlett's window of `share` of the blocks over the normal one (Kiefer and Vogelsang 2005).
fn few_stretches(share: f64) -> f64 {
    (1.96 + 2.9694 * share + 0.416 * share.powi(2) - 0.5324 * share.powi(3)) / 1.96
}

/// Variance (N²m²) by which the steps of a coarse torque are off as long as a level of it lasts: in all its samples alike, but
/// for what noise spreads over the steps (Gaussian dither; Wannamaker 2000). A step of a tenth of the torque and more was a wild
/// sample.
fn rounding(rows: &Rows, length: u32, question: &Question) -> f64 {
    const WILD: f64 = 0.1;
    let strongest = quantile(rows.blocks, 0.98, |b| b.torque.abs());
    let step = if question.torque_step < WILD * strongest { question.torque_step } else { 0.0 };
    let apart = LEVEL * quantile(rows.blocks, 0.98, |b| b.acceleration.abs());
    let Some(found) = rows.fit().filter(|_| step > 0.0) else { return 0.0 };
    let noise = rows.noise_of_neighbours(&found.terms, apart) * (f64::from(length) / PARABOLA).sqrt();
    let left = (-2.0 * (core::f64::consts::PI * noise / step).powi(2)).exp();
    (step * left).powi(2) / 12.0
}

/// `rounding`: variance of a level of the torque. Inertia and friction rest on two such at least, up and down. `lone`: what rests
/// on one stretch of the run.
fn fill(balance: &mut Balance, found: &Regression, rounding: f64, steep: f64, lone: &Terms) {
    let t = student(found.used as f64 - 4.0) * few_stretches(found.lag_share);
    let value = |i: usize, also: f64| Value {
        value: found.terms[i],
        uncertainty: t * (found.variance[i].max(0.0) + also).sqrt() + lone[i],
    };
    balance.inertia = value(0, 0.5 * rounding / (steep * steep).max(f64::MIN_POSITIVE));
    balance.viscous = value(1, 0.0);
    balance.coulomb = value(2, 0.5 * rounding);
    balance.constant = value(3, 0.0);
    balance.scatter = found.scatter;
    balance.used = found.used;
    balance.dropped = found.dropped;
}

/// The ramp that would reach the target. Up and down between ω₁ and ω₂ at ±a makes acceleration independent of
/// friction, so that var J = S/(2·times·(ω₂ − ω₁)·a), S: density of the torque noise, N²m²·s.
fn ramp(rows: &Rows, balance: &Balance, length: u32, question: &Question) -> Ramp {
    const TIMES: f64 = 2.0;
    let top = quantile(rows.blocks, 0.98, |b| b.speed.abs()).min(rows.trusted.speed);
    let span = 0.9 * top;
    let density = balance.scatter.powi(2) * f64::from(length) * question.sample_s / PARABOLA;
    let inertia = balance.inertia.value.abs().max(1e-3 * balance.inertia.uncertainty);
    // Twice as sure as wanted: the noise is itself only estimated, and ripple hangs together longer than a block.
    let wanted = question.target * inertia / (2.0 * student(100.0));
    let needed = density / (2.0 * span * wanted * wanted);
    // No slower than a quarter of what was seen, no faster than the torque seen allows.
    let seen = quantile(rows.blocks, 0.98, |b| b.acceleration.abs());
    let friction = (balance.coulomb.value + balance.viscous.value * top).max(0.0);
    let strongest = quantile(rows.blocks, 0.98, |b| b.torque.abs()).min(rows.trusted.torque);
    let fastest = ((strongest - friction) / inertia).max(seen);
    let acceleration = (needed / TIMES).max(0.25 * seen).min(fastest);
    let times = (needed / acceleration).ceil().max(TIMES);
    Ramp { speeds: [top - span, top], acceleration, times, torque: friction + inertia * acceleration }
}

/// The ramp to propose when nothing is known: over the speeds seen, in two seconds.
fn blind_ramp(blocks: &[Block]) -> Ramp {
    let top = quantile(blocks, 0.98, |b| b.speed.abs());
    Ramp { speeds: [0.1 * top, top], acceleration: 0.45 * top, times: 2.0, torque: 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Trapezoids with J 0.3, B 0.02, Tc 4 and a scatter of 0.05.
    fn trapezoids() -> Vec<Block> {
        let block = |i: i32| {
            let acceleration = match i % 40 {
                0..15 => 60.0,
                20..35 => -60.0,
                _ => 0.0,
            };
            let speed = 30.0 + 4.0 * f64::from((i % 40).min(40 - i % 40));
            let noise = 0.05 * (f64::from(i) * 2.7).sin();
            Block { torque: 0.3 * acceleration + 0.02 * speed + 4.0 + noise, speed, acceleration }
        };
        (0..160).map(block).collect()
    }

    #[test]
    fn wrong_speeds_are_no_levers() {
        let mut blocks = trapezoids();
        for i in [7, 50, 90, 131] {
            blocks[i].acceleration = 4000.0;
        }
        let (balance, verdict) = fit(&blocks, 20, &Question::PLAIN);
        assert_eq!(verdict, Ok(()));
        assert!((balance.inertia.value - 0.3).abs() < 2e-3 && balance.left_out == 4, "{balance:?}");
    }

    #[test]
    fn saturation_is_found_and_left_out_and_none_is_made_up() {
        let (clean, _) = fit(&trapezoids(), 20, &Question::PLAIN);
        assert!(clean.saturation == 0.0 && clean.weakening == 0.0 && clean.both_ways, "{clean:?}");
        let mut blocks = trapezoids();
        let limit = 15.0;
        blocks.iter_mut().filter(|b| b.torque > limit).for_each(|b| b.torque += 0.8 * (b.torque - limit));
        let (balance, verdict) = fit(&blocks, 20, &Question::PLAIN);
        assert_eq!(verdict, Ok(()));
        assert!((balance.inertia.value - 0.3).abs() < 3e-3, "{balance:?}");
    }

    /// Without noise a coarse torque reads the same wrong value as long as a level lasts.
    #[test]
    fn the_steps_of_a_coarse_torque_are_in_the_uncertainty_but_where_noise_spreads_over_them() {
        let level = |i: usize| [18.35, 0.3, -17.9, 0.3][i / 10 % 4];
        let block = |i: usize| Block {
            torque: f64::round(level(i)) + 0.01 * (i as f64 * 2.7).sin(),
            speed: 60.0 + (i % 10) as f64,
            acceleration: [60.0, 0.0, -60.0, 0.0][i / 10 % 4],
        };
        let blocks: Vec<Block> = (0..160).map(block).collect();
        let found = |torque_step| fit(&blocks, 20, &Question { torque_step, ..Question::PLAIN }).0.inertia;
        let truth = 0.5 * (18.35 + 17.9) / 60.0;
        let (blind, fair) = (found(0.0), found(1.0));
        assert!((blind.value - truth).abs() > blind.uncertainty && (fair.value - truth).abs() < fair.uncertainty);
        assert!((found(0.02).uncertainty - blind.uncertainty).abs() < 0.1 * blind.uncertainty);
        assert_eq!(found(500.0), blind, "a wild sample is no step");
    }

    #[test]
    fn few_blocks_and_wrong_signs_are_refused_by_name() {
        let code = |blocks: &[Block]| fit(blocks, 20, &Question::PLAIN).1.unwrap_err().code;
        assert_eq!(code(&trapezoids()[..11]), GIB_ERR_INERTIA_FEW);
        let mut turned = trapezoids();
        turned.iter_mut().for_each(|b| b.torque = -b.torque);
        assert_eq!(code(&turned), GIB_ERR_INERTIA_SIGN);
        let mut steady = trapezoids();
        steady.iter_mut().for_each(|b| b.acceleration = 0.0);
        assert_eq!(code(&steady), GIB_ERR_INERTIA_EXCITATION);
    }
}
