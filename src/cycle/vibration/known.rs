//! What is known of one harmonic's displacement beside its value: how strong it is, how much of it noise explains, and how
//! fast it may be followed.
//!
//! ```text
//! share s of the news in a revolution:   drift leaves (D/2s)²·P, noise leaves N·s;   least of both near s = D·√(P/N)
//! displacement believed:                 X·(P − m·N·s)/P
//! ```
//!
//! P: mean square of the displacement, N: what noise leaves in an average over one revolution, D: what part of itself the
//! amplitude drifts by in a revolution, from the change of speed. A strong harmonic follows fast, a weak one is averaged
//! long. µm, µm².

use crate::cycle::lanes::{Lanes, flushed, paired};

/// A harmonic counts in full when its power is far above what noise leaves in it. The power is averaged twice as long
/// as the harmonic itself, so that noise alone seldom exceeds its own mean by this.
const NOISE_MARGIN: f32 = 1.5;
/// Power above which a harmonic that has just come is believed at once, in powers of its noise.
const SUDDEN: f32 = 10.0;

/// Largest share of a revolution's news: with more, what changes at one harmonic is seen at all others.
const MOST: f32 = 1.5;

/// Powers and averages below this are none, long before they could be subnormal.
const FLUSH: f32 = 1e-10;

/// Two harmonics of one sensor: x and y of each.
#[derive(Debug, Clone, Copy, Default)]
pub struct Known {
    /// Mean square, with its noise, in both lanes of a harmonic.
    power: Lanes,
    /// The displacement averaged once more.
    slow: Lanes,
    /// The displacement put ahead of its lag.
    now: Lanes,
}

impl Known {
    /// Makes the displacement larger by a factor, for good.
    pub fn grow(&mut self, growth: f32) {
        let factor = Lanes::splat(growth);
        self.slow *= factor;
        self.now *= factor;
        self.power *= factor * factor;
    }

    /// Mean square of the displacement at both harmonics.
    #[inline(always)]
    #[must_use]
    pub fn strength(&self) -> f32 {
        let [a, _, b, _] = self.power.to_array();
        a + b
    }

    /// Takes up a displacement that averaged `news` of itself since the last time, and puts it ahead of its lag: what lags
    /// behind a ramp by one average lags by two after another (Brown's double smoothing). `ahead`: up to 1, which is all of it.
    #[inline(always)]
    pub fn look(&mut self, now: Lanes, news: Lanes, ahead: Lanes) {
        let news = news.fast_min(Lanes::ONE);
        let lag = now - self.slow;
        self.slow = flushed(self.slow + news * lag, FLUSH);
        self.now = now + ahead.fast_max(Lanes::ZERO).fast_min(Lanes::ONE) * lag;
        let square = paired(self.now * self.now);
        self.power = flushed(self.power + Lanes::splat(0.5) * news * (square - self.power), FLUSH);
    }

    /// The displacement, less what a noise of some mean square explains.
    #[inline(always)]
    #[must_use]
    pub fn believed(&mut self, noise: Lanes) -> Lanes {
        let square = paired(self.now * self.now);
        let sudden = square.simd_gt(self.power + Lanes::splat(SUDDEN) * noise);
        self.power = sudden.bitselect(square, self.power);
        // Where there is no power there is nothing left of it either; the smallest one keeps the quotient finite.
        let left = (self.power - Lanes::splat(NOISE_MARGIN) * noise).fast_max(Lanes::ZERO);
        left / self.power.fast_max(Lanes::splat(1e-30)) * self.now
    }

    /// Share of a revolution's news to let in from now on, from `least` on.
    #[inline(always)]
    #[must_use]
    pub fn share(&self, drift: f32, noise: Lanes, least: f32) -> Lanes {
        // N below any sensor's keeps the quotient finite.
        let best = Lanes::splat(drift) * (self.power / (noise + Lanes::splat(1e-12))).sqrt();
        best.fast_max(Lanes::splat(least)).fast_min(Lanes::splat(MOST))
    }
}
