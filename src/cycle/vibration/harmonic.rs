//! Harmonics of two signals over the spindle's angle, tracked cycle by cycle.
//!
//! ```text
//! e = y − offset − Σk (ak·cos kθ + bk·sin kθ)     offset += µ·e     ak += 2µ·e·cos kθ     bk += 2µ·e·sin kθ
//! ```
//!
//! (Widrow's adaptive noise canceller, 1975; each harmonic is a notch of width µ.) µ is the part of a revolution that a
//! cycle turns, over the revolutions averaged, so it is the spindle's angle that counts and not time. White noise of
//! variance σ² leaves µσ² in each coefficient. The coefficients stand for one speed: where the spindle turns by another, what they
//! say grows as inertia forces do: force ∝ Ω², displacement ∝ Ω² = g, acceleration ∝ Ω⁴ = g².

use super::spindle::Wheel;
use crate::cycle::lanes::{Lanes, flushed, sums};

/// Pairs of harmonics: all sixteen.
pub const PAIRS: usize = 8;
/// Adding and taking away this leaves nothing of a coefficient below 1e-17, long before it could be subnormal.
pub const FLUSH: f32 = 1e-10;
/// A deviation beyond this many standard deviations counts as this many: a blow on the machine is not its vibration.
const CLIP: f32 = 5.0;
/// Of the variance of the first revolution, what is left at least: of few readings its harmonics explain more than there is.
const LEFT: f32 = 0.01;
/// Smallest variance.
const FLOOR: f32 = 1e-12;

/// Coefficients of cos kθ and sin kθ, two harmonics in each: cos, sin, cos, sin.
#[derive(Debug, Clone, Copy, Default)]
pub struct Harmonics(pub [Lanes; PAIRS]);

impl Harmonics {
    /// What is to be summed over the lanes for the value at the wheel's angle.
    #[inline(always)]
    fn parts(&self, wheel: &Wheel, pairs: usize) -> Lanes {
        let mut products =
            self.0.iter().zip(&wheel.0).take(pairs).map(|(coefficients, phases)| *coefficients * *phases);
        let first = products.next().unwrap_or(Lanes::ZERO);
        products.fold(first, |sum, product| sum + product)
    }

    /// The value at the wheel's angle.
    #[inline(always)]
    #[must_use]
    pub fn value(&self, wheel: &Wheel, pairs: usize) -> f32 {
        let [a, b, c, d] = self.parts(wheel, pairs).to_array();
        (a + c) + (b + d)
    }

    /// Coefficients of a harmonic, counted from 0.
    #[inline(always)]
    #[must_use]
    pub fn get(&self, harmonic: usize) -> [f32; 2] {
        let [a, b, c, d] = self.0[(harmonic >> 1) & (PAIRS - 1)].to_array();
        if harmonic & 1 == 0 { [a, b] } else { [c, d] }
    }

    /// Sets them.
    #[inline(always)]
    pub fn set(&mut self, harmonic: usize, [cos, sin]: [f32; 2]) {
        let pair = &mut self.0[(harmonic >> 1) & (PAIRS - 1)];
        let [a, b, c, d] = pair.to_array();
        *pair = Lanes::new(if harmonic & 1 == 0 { [cos, sin, c, d] } else { [a, b, cos, sin] });
    }

    /// Adds a value at the wheel's angle: Fourier's sums.
    #[inline(always)]
    pub fn gather(&mut self, wheel: &Wheel, pairs: usize, value: f32) {
        let value = Lanes::splat(value);
        for (coefficients, phases) in self.0.iter_mut().zip(&wheel.0).take(pairs) {
            *coefficients = flushed(*coefficients + value * *phases, FLUSH);
        }
    }

    /// Moves each coefficient by `step` times its share. Not flushed: whoever looks at a pair does that.
    #[inline(always)]
    fn learn(&mut self, wheel: &Wheel, pairs: usize, step: f32, shares: &[Lanes; PAIRS]) {
        let step = Lanes::splat(step);
        for ((coefficients, phases), share) in self.0.iter_mut().zip(&wheel.0).zip(shares).take(pairs) {
            *coefficients += *share * step * *phases;
        }
    }
}

/// Two signals, each as its offset and its harmonics.
#[derive(Debug, Clone, Copy, Default)]
pub struct Trackers {
    /// The harmonics, in the signals' unit.
    pub harmonics: [Harmonics; 2],
    /// Share of a revolution's news that enters each harmonic.
    pub shares: [[Lanes; PAIRS]; 2],
    /// What stays when they are gone; drifts are followed.
    pub offset: [f64; 2],
    /// Mean of the first revolution so far, above the offset, and of its square.
    mean: [f64; 2],
    square: [f64; 2],
    /// Squares of the largest deviations that are believed in full; then of two values that are bounded beside them.
    pub bounds: Lanes,
    /// Turns for which a signal was not what the harmonics said, less those for which it was.
    pub surprise: [f32; 2],
}

impl Trackers {
    /// Of values that are bounded by `most` in size beside them.
    #[must_use]
    pub fn bounding(most: f32) -> Trackers {
        Trackers { bounds: Lanes::new([0.0, 0.0, most * most, most * most]), ..Trackers::default() }
    }

    /// Begins anew from two first readings; harmonics from the one counted `asked` on are never learnt.
    pub fn begin(&mut self, readings: [f64; 2], asked: usize) {
        let share = |i: usize| if i < asked { 1.0 } else { 0.0 };
        let all = core::array::from_fn(|i| Lanes::new([2 * i, 2 * i, 2 * i + 1, 2 * i + 1].map(share)));
        *self = Trackers { offset: readings, shares: [all; 2], bounds: self.bounds, ..Trackers::default() };
        self.set_variance([0.0; 2]);
    }

    /// A reading of the first revolution, of which it takes up `part`: Fourier's integrals, term by term.
    pub fn first(&mut self, wheel: &Wheel, pairs: usize, readings: [f64; 2], part: f64) {
        for (n, reading) in readings.into_iter().enumerate() {
            let above = reading - self.offset[n];
            let left = part * above;
            self.mean[n] += left;
            self.square[n] += left * above;
            let asked = 2.0 * left as f32;
            self.harmonics[n].learn(wheel, pairs, asked, &self.shares[n]);
        }
    }

    /// The first revolution is whole. What its harmonics leave of it is noise, and some of them may be.
    pub fn known(&mut self) {
        let variance = |n: usize| {
            let all = (self.square[n] - self.mean[n] * self.mean[n]) as f32;
            let power = self.harmonics[n].0.iter().fold(Lanes::ZERO, |sum, pair| sum + *pair * *pair);
            let [a, b, c, d] = power.to_array();
            let left = all - 0.5 * ((a + b) + (c + d));
            if left > LEFT * all { left } else { LEFT * all }
        };
        self.set_variance([variance(0), variance(1)]);
        for n in 0..2 {
            self.offset[n] += self.mean[n];
            (self.mean[n], self.square[n]) = (0.0, 0.0);
        }
        self.keep_floor();
    }

    /// Variance of what is left of each signal.
    #[inline(always)]
    #[must_use]
    pub fn variance(&self) -> [f32; 2] {
        let [a, b, ..] = self.bounds.to_array();
        [a / (CLIP * CLIP), b / (CLIP * CLIP)]
    }

    fn set_variance(&mut self, variance: [f32; 2]) {
        let ([a, b], [.., c, d]) = (variance.map(|x| CLIP * CLIP * x), self.bounds.to_array());
        self.bounds = Lanes::new([a, b, c, d]);
    }

    /// What the harmonics leave of two readings, then what two others say at the wheel's angle, with their signs turned; the
    /// others have grown by `growth`, these by its square.
    #[inline(always)]
    #[must_use]
    pub fn left(&self, wheel: &Wheel, pairs: usize, readings: [f64; 2], others: &[Harmonics; 2], growth: f32) -> Lanes {
        let [a, b] = &self.harmonics;
        let [c, d] = others;
        let (first, second) = (readings[0] - self.offset[0], readings[1] - self.offset[1]);
        let others = [c.parts(wheel, pairs), d.parts(wheel, pairs)];
        let known = sums([a.parts(wheel, pairs), b.parts(wheel, pairs)], others);
        let square = growth * growth;
        Lanes::new([first as f32, second as f32, 0.0, 0.0]) - known * Lanes::new([square, square, growth, growth])
    }

    /// Deviations with those beyond belief cut down, after `turned` turns; `hurry`: how many times as fast the variance learns as it does
    /// in the long run. What is beyond belief makes it grow no faster for that.
    pub fn believed(&mut self, left: Lanes, turned: f32, hurry: f32) -> Lanes {
        let counts = (1.0 + (CLIP * CLIP - 1.0) / hurry) / (CLIP * CLIP);
        let (mut believed, most) = (left.to_array(), self.bounds.to_array());
        for n in 0..2 {
            let calmer = self.surprise[n] - turned;
            self.surprise[n] = if calmer > 0.0 { calmer } else { 0.0 };
            let square = believed[n] * believed[n];
            if square > most[n] {
                believed[n] *= (counts * most[n] / square).sqrt();
                self.surprise[n] += 2.0 * turned;
            }
        }
        Lanes::new(believed)
    }

    /// Takes up what was left: `share` is µ, `turning` the part of a turn that each harmonic takes its own share of, over the
    /// square of its `growth`.
    #[inline(always)]
    pub fn learn(&mut self, wheel: &Wheel, pairs: usize, left: Lanes, [share, turning]: [f32; 2], growth: f32) {
        let shares = Lanes::new([share, share, 0.0, 0.0]);
        self.bounds += shares * (left * left * Lanes::splat(CLIP * CLIP) - self.bounds);
        let [a, b, ..] = (shares * left).to_array();
        self.offset[0] += f64::from(a);
        self.offset[1] += f64::from(b);
        let [a, b, ..] = (Lanes::splat((turning + turning) / (growth * growth)) * left).to_array();
        for (n, step) in [a, b].into_iter().enumerate() {
            self.harmonics[n].learn(wheel, pairs, step, &self.shares[n]);
        }
    }

    /// Lets no variance fall below one that a noiseless signal could leave again.
    #[inline(always)]
    pub fn keep_floor(&mut self) {
        self.bounds = self.bounds.fast_max(Lanes::splat(CLIP * CLIP * FLOOR));
    }
}

/// Makes harmonics larger by a factor, for good.
pub fn grow(harmonics: &mut [Harmonics; 2], pairs: usize, factor: f32) {
    for one in harmonics {
        one.0.iter_mut().take(pairs).for_each(|pair| *pair *= Lanes::splat(factor));
    }
}
