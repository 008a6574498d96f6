//! Harmonics of one signal over the spindle's angle, tracked cycle by cycle.
//!
//! ```text
//! e = y − offset − Σk (ak·cos kθ + bk·sin kθ)     offset += µ·e     ak += 2µ·e·cos kθ     bk += 2µ·e·sin kθ
//! ```
//!
//! (Widrow's adaptive noise canceller, 1975; each harmonic is a notch of width µ.) µ is the part of a revolution that a
//! cycle turns, over the revolutions averaged, so it is the spindle's angle that counts and not time. White noise of
//! variance σ² leaves µσ² in each coefficient. Between cycles the coefficients of an acceleration grow with the fourth
//! power of speed, as what inertia forces do: force ∝ Ω², displacement ∝ Ω², acceleration ∝ Ω⁴.

use super::spindle::Wheel;

/// Vectors of four that hold all harmonics.
pub const VECTORS: usize = 4;
/// Adding and taking away this leaves nothing below 1e-17, long before it could be subnormal.
const FLUSH: f32 = 1e-10;
/// A deviation beyond this many standard deviations counts as this many: a blow on the machine is not its vibration.
const CLIP: f32 = 5.0;

/// All of the news.
const ALL: [Lanes; VECTORS] = [Lanes([1.0; 4]); VECTORS];

/// Four numbers that one instruction handles.
#[derive(Debug, Clone, Copy, Default)]
#[repr(align(16))]
pub struct Lanes(pub [f32; 4]);

impl Lanes {
    #[inline(always)]
    fn with(self, other: Lanes, f: impl Fn(f32, f32) -> f32) -> Lanes {
        let ([a, b, c, d], [e, g, h, i]) = (self.0, other.0);
        Lanes([f(a, e), f(b, g), f(c, h), f(d, i)])
    }

    /// Lane by lane.
    #[inline(always)]
    #[must_use]
    pub fn plus(self, other: Lanes) -> Lanes {
        self.with(other, |a, b| a + b)
    }

    /// Lane by lane.
    #[inline(always)]
    #[must_use]
    pub fn minus(self, other: Lanes) -> Lanes {
        self.with(other, |a, b| a - b)
    }

    /// Lane by lane.
    #[inline(always)]
    #[must_use]
    pub fn times(self, other: Lanes) -> Lanes {
        self.with(other, |a, b| a * b)
    }

    #[inline(always)]
    fn sum(self) -> f32 {
        let [a, b, c, d] = self.0;
        (a + c) + (b + d)
    }
}

/// Coefficients of cos kθ and sin kθ.
#[derive(Debug, Clone, Copy, Default)]
pub struct Harmonics {
    cos: [Lanes; VECTORS],
    sin: [Lanes; VECTORS],
}

impl Harmonics {
    /// The value at the wheel's angle.
    #[inline(always)]
    #[must_use]
    pub fn value(&self, wheel: &Wheel, vectors: usize) -> f32 {
        let mut sum = Lanes::default();
        for (((a, b), c), s) in self.cos.iter().zip(&self.sin).zip(&wheel.cos).zip(&wheel.sin).take(vectors) {
            sum = sum.plus(a.times(*c)).plus(b.times(*s));
        }
        sum.sum()
    }

    /// Coefficients of a harmonic, counted from 0.
    #[inline(always)]
    #[must_use]
    pub fn get(&self, harmonic: usize) -> [f32; 2] {
        let (vector, lane) = ((harmonic >> 2) & 3, harmonic & 3);
        [self.cos[vector].0[lane], self.sin[vector].0[lane]]
    }

    /// Sets them.
    #[inline(always)]
    pub fn set(&mut self, harmonic: usize, [cos, sin]: [f32; 2]) {
        let (vector, lane) = ((harmonic >> 2) & 3, harmonic & 3);
        self.cos[vector].0[lane] = cos;
        self.sin[vector].0[lane] = sin;
    }

    /// Adds a value at the wheel's angle: Fourier's sums.
    #[inline(always)]
    pub fn gather(&mut self, wheel: &Wheel, vectors: usize, value: f32) {
        self.learn(wheel, vectors, value, &ALL, 1.0);
    }

    /// Moves each coefficient by `step` times its share, after growing all by `growth`.
    #[inline(always)]
    fn learn(&mut self, wheel: &Wheel, vectors: usize, step: f32, shares: &[Lanes; VECTORS], growth: f32) {
        let (step, growth, flush) = (Lanes([step; 4]), Lanes([growth; 4]), Lanes([FLUSH; 4]));
        let phases = wheel.cos.iter().zip(&wheel.sin).zip(shares);
        for ((a, b), ((c, s), share)) in self.cos.iter_mut().zip(&mut self.sin).zip(phases).take(vectors) {
            let step = step.times(*share);
            *a = a.times(growth).plus(step.times(*c)).plus(flush).minus(flush);
            *b = b.times(growth).plus(step.times(*s)).plus(flush).minus(flush);
        }
    }
}

/// A signal as its offset and its harmonics.
#[derive(Debug, Clone, Copy, Default)]
pub struct Tracker {
    /// The harmonics, in the signal's unit.
    pub harmonics: Harmonics,
    /// Share of a revolution's news that enters each harmonic.
    shares: [Lanes; VECTORS],
    /// What stays when they are gone; drifts are followed.
    pub offset: f64,
    /// Mean of the first revolution so far, above the offset.
    mean: f64,
    /// Variance of what is left.
    pub variance: f32,
    /// Turns for which the signal was not what the harmonics said, less those for which it was.
    pub surprise: f32,
}

impl Tracker {
    /// Share of a harmonic, counted from 0.
    #[inline(always)]
    #[must_use]
    pub fn share(&self, harmonic: usize) -> f32 {
        self.shares[(harmonic >> 2) & 3].0[harmonic & 3]
    }

    /// Sets it.
    #[inline(always)]
    pub fn set_share(&mut self, harmonic: usize, share: f32) {
        self.shares[(harmonic >> 2) & 3].0[harmonic & 3] = share;
    }

    /// Begins anew from a first reading.
    pub fn begin(&mut self, reading: f64) {
        *self = Tracker { offset: reading, shares: ALL, ..Tracker::default() };
    }

    /// A reading of the first revolution, of which it takes up `part`: Fourier's integrals, term by term.
    #[inline(always)]
    pub fn first(&mut self, wheel: &Wheel, vectors: usize, reading: f64, part: f64) {
        let left = part * (reading - self.offset);
        self.mean += left;
        self.harmonics.gather(wheel, vectors, 2.0 * left as f32);
    }

    /// The first revolution is whole.
    pub fn known(&mut self) {
        self.offset += self.mean;
        self.mean = 0.0;
    }

    /// A later reading. `share` is µ, `turning` the part of a turn that each harmonic takes its own share of; `growth` what
    /// the harmonics grow by until the next one; `turned` is `turning`, or 0 as long as the variance is not known.
    #[inline(always)]
    pub fn read(
        &mut self,
        wheel: &Wheel,
        vectors: usize,
        reading: f64,
        [share, turning]: [f32; 2],
        growth: f32,
        turned: f32,
    ) {
        let left = (reading - self.offset) as f32 - self.harmonics.value(wheel, vectors);
        let mut left = (left + FLUSH) - FLUSH;
        let most = CLIP * CLIP * self.variance;
        let mut square = left * left;
        let calmer = self.surprise - turned;
        self.surprise = if calmer > 0.0 { calmer } else { 0.0 };
        if square > most && turned > 0.0 {
            left *= (most / square).sqrt();
            square = most;
            self.surprise += 2.0 * turned;
        }
        // The floor keeps a noiseless signal from a variance that it could never leave.
        self.variance += share * (square - self.variance) + 1e-12 * share;
        self.offset += f64::from(share * left);
        self.harmonics.learn(wheel, vectors, 2.0 * turning * left, &self.shares, growth);
    }
}
