//! From the harmonics of the accelerations to those of the displacements: divided by −ω², calibrated, and less what noise
//! explains. A slice of a pair of harmonics a cycle, so that every cycle costs about the same. All of them for the speed for
//! which the harmonics stand.

use super::*;
use crate::cycle::lanes::{Lanes, flushed, swapped};
use crate::cycle::vibration::harmonic::FLUSH;
use wide::f64x2;

/// Drift of an amplitude in a revolution per relative change of speed in it, beside what inertia forces do: a middle between a
/// machine without resonances, 0, and one at a resonance of 4 % damping, 12.
const SWING: f32 = 1.5;
/// Part of a displacement's news that is shown at once.
const AT_ONCE: f32 = 0.8;
/// How many times as much of the largest correction's fade may be shown at once in usual cycles, in few of which anything is.
const SELDOM: f32 = 2.0;

/// Relative change of speed in a revolution up to which displacements change slowly.
const STEADY: f64 = 1e-3;

/// Turns that may go by from one slice to the next: all eight pairs, with the strongest in between, are 64.
const ROUND: f64 = 0.08;

/// Relative change of speed up to which factors hold.
const FACTORS_HOLD: f64 = 0.02;

/// Factors of a pair at a speed. Lanes: x and y of one harmonic, x and y of the other.
#[derive(Debug, Clone, Copy, Default)]
struct Factors {
    /// Turns per cycle that they hold for.
    rate: f64,
    /// Displacement over acceleration of seat and bearing, a complex number: µm per m/s².
    re: [Lanes; 2],
    im: [Lanes; 2],
    /// Mean square displacement per variance of the acceleration.
    noise: Lanes,
    /// 1 for a harmonic that is tracked at this speed, else 0; and for one whose displacement counts.
    kept: Lanes,
    used: Lanes,
}

/// What renewal keeps. Which slice is due follows from the count of cycles, so that nothing of the past stays in it.
#[derive(Debug, Clone, Copy, Default)]
pub struct Renewal {
    /// Cycles since the start, and those between two slices: 3 or 7.
    count: u32,
    between: u32,
    factors: [Factors; PAIRS],
    /// Progress at which each pair of either sensor was looked at last; and at which any was.
    seen: [[f64; PAIRS]; 2],
    last: f64,
    /// Turns per cycle when averages were kept last.
    pub rate: f64,
    /// The pair with the largest displacements, and their mean square.
    strongest: usize,
    strength: f32,
}

impl Renewal {
    /// Remembers the strongest pair.
    #[inline(always)]
    fn compare(&mut self, pair: usize, strength: f32) {
        if pair == self.strongest || strength > self.strength {
            (self.strongest, self.strength) = (pair, strength);
        }
    }

    /// What is known grows by `growth`, that of accelerations by its square.
    pub fn grow(&mut self, growth: f32) {
        let (growth, shrink) = (Lanes::splat(growth * growth), Lanes::splat(1.0 / growth));
        for factors in &mut self.factors {
            factors.re.iter_mut().chain(&mut factors.im).for_each(|factor| *factor *= shrink);
            factors.noise *= growth;
        }
    }
}

impl Vibration {
    /// A whole pair. What is put out of it changes no faster than the largest correction fades.
    pub(super) fn renew_pair(&mut self) {
        self.renewal.count = self.renewal.count.wrapping_add(1);
        let pair = self.renewal.count as usize & (self.plan.pairs.wrapping_sub(1) & (PAIRS - 1));
        if self.stale(pair) {
            self.find_factors(pair);
        }
        // While little of it is put out it may come at once.
        let most = self.plan.displacement_step / (self.blend + self.plan.fade) as f32;
        self.look_at(GIB_VIBRATION_SEAT, pair);
        self.believe(GIB_VIBRATION_SEAT, pair, most);
        self.look_at(GIB_VIBRATION_BEARING, pair);
        self.believe(GIB_VIBRATION_BEARING, pair, most);
        self.keep_average();
    }

    /// One cycle of some looks whether the sensors live, and renews a slice of a pair.
    #[inline(always)]
    pub(super) fn renew_slice<const N: usize>(&mut self, readings: f64x2) {
        let count = self.renewal.count.wrapping_add(1);
        self.renewal.count = count;
        if count & self.renewal.between != 0 {
            return;
        }
        let slice = count >> self.renewal.between.trailing_ones();
        if self.sensors.repeats(readings) {
            self.usual = 0;
        }
        let pair = self.due::<N>(slice >> 2);
        match slice & 3 {
            0 => self.look_at(GIB_VIBRATION_SEAT, pair),
            1 => self.believe(GIB_VIBRATION_SEAT, pair, SELDOM * self.plan.displacement_step),
            2 => self.look_at(GIB_VIBRATION_BEARING, pair),
            _ => {
                self.believe(GIB_VIBRATION_BEARING, pair, SELDOM * self.plan.displacement_step);
                self.keep_average();
                self.renewal.compare(pair, self.known[0][pair].strength() + self.known[1][pair].strength());
                let next = self.due::<N>((slice >> 2).wrapping_add(1));
                if self.stale(next) {
                    self.find_factors(next);
                }
            }
        }
    }

    /// The pair that is renewed at a turn: one after another, and the strongest in between, which changes most.
    #[inline(always)]
    fn due<const N: usize>(&self, turn: u32) -> usize {
        let (one, strongest) = (turn as usize >> 1, self.renewal.strongest);
        (if turn & 1 == 0 { one } else { strongest }) & (N - 1)
    }

    /// Averages and floors that no single pair has.
    #[inline(always)]
    fn keep_average(&mut self) {
        let now = &mut self.renewal;
        // First in a hurry, then by the average over the revolutions asked for.
        let hurry = 2.0 / self.progress as f32;
        self.part = if hurry > self.plan.share_min { hurry } else { self.plan.share_min };
        // Averaged over a revolution.
        let turned = self.progress - now.last;
        let change = self.spindle.change_since(now.rate);
        (now.last, now.rate) = (self.progress, self.spindle.speed());
        let part = if turned > 0.0 && turned < 1.0 { turned } else { 1.0 };
        self.swing = (self.swing + change - self.swing * part + 1e-12) - 1e-12;
        // Few cycles make a turn of a fast spindle: it must not go on for many while all pairs are renewed.
        let most = if self.swing.abs() < STEADY { 7 } else { 3 };
        let turning = self.spindle.rate.abs();
        let fits = [7, 3, 1].into_iter().find(|between| f64::from(between + 1) * turning <= ROUND);
        now.between = fits.map_or(0, |fits: u32| fits.min(most));
        self.trackers.keep_floor();
    }

    /// Whether the factors of a pair are those of another speed.
    #[inline(always)]
    fn stale(&self, pair: usize) -> bool {
        let (factors, rate) = (&self.renewal.factors[pair], self.spindle.speed());
        (factors.rate - rate).abs() > FACTORS_HOLD * rate.abs()
    }

    /// Factors of a pair at the present speed.
    #[inline(always)]
    fn find_factors(&mut self, pair: usize) {
        let (plan, at) = (&self.plan, self.spindle.speed());
        let turning = at.abs();
        let first = 2 * pair as i32 + 1;
        let number = Lanes::new([first as f32, first as f32, (first + 1) as f32, (first + 1) as f32]);
        let rate = number * Lanes::splat(turning as f32);
        // Where the spindle does not turn nothing counts, which the caller sees to.
        let slow = rate.simd_lt(Lanes::splat(plan.tracked[0]));
        let fast = rate.simd_ge(Lanes::splat(plan.tracked[1])) | number.simd_gt(Lanes::splat(plan.harmonics as f32));
        let left_out = slow | fast;
        // Displacement ∝ Ω², acceleration ∝ Ω⁴: by which the latter is too small, the former is to be divided less.
        let growth = Lanes::splat(self.spindle.growth());
        let to_um = left_out.bitselect(Lanes::ZERO, Lanes::splat(plan.to_um) * growth / (rate * rate));
        let noise = to_um / (growth * growth);
        let [a, b, c, d] = plan.gain(f64::from(first) * turning).to_array();
        let [e, f, g, h] = plan.gain(f64::from(first + 1) * turning).to_array();
        let sense = Lanes::splat(if at < 0.0 { -1.0 } else { 1.0 }) * to_um;
        self.renewal.factors[pair] = Factors {
            rate: at,
            re: [Lanes::new([a, a, e, e]) * to_um, Lanes::new([c, c, g, g]) * to_um],
            im: [Lanes::new([b, -b, f, -f]) * sense, Lanes::new([d, -d, h, -h]) * sense],
            noise: Lanes::splat(2.0 * turning as f32) * noise * noise,
            kept: (fast & !slow).bitselect(Lanes::ZERO, Lanes::ONE),
            used: left_out.bitselect(Lanes::ZERO, Lanes::ONE),
        };
    }

    /// Displacements of a pair of one sensor, with their averages.
    #[inline(always)]
    fn look_at(&mut self, n: usize, pair: usize) {
        let now = &self.renewal.factors[pair];
        let (re, im, kept, used) = (now.re[n], now.im[n], now.kept, now.used);
        let tracked = &mut self.trackers.harmonics[n].0[pair];
        *tracked = flushed(*tracked, FLUSH) * kept;
        let mut way = re * *tracked + im * swapped(*tracked);
        if n == GIB_VIBRATION_SEAT && self.plan.second_slide {
            let slide = &mut self.slide.harmonics[0].0[pair];
            *slide = flushed(*slide, FLUSH) * kept;
            self.slide.shares[n][pair] = kept;
            way -= *slide * used * Lanes::splat(1.0 / self.growth);
        }
        let share = self.trackers.shares[n][pair];
        let seen = &mut self.renewal.seen[n][pair];
        let turned = (self.progress - *seen) as f32;
        *seen = self.progress;
        // Less than none has turned where all has begun anew.
        let news = share * Lanes::splat(if turned > 0.0 { turned } else { 1.0 }) * used;
        self.known[n][pair].look(way, news, share - Lanes::splat(self.part));
    }

    /// How much of them is believed, and how fast they are followed from now on. Not shown at once, so that the correction
    /// does not jump where they change fast, nor more than by `most`, µm.
    #[inline(always)]
    fn believe(&mut self, n: usize, pair: usize, most: f32) {
        let now = &self.renewal.factors[pair];
        let (noise, used, kept) = (now.noise, now.used, now.kept);
        let variance = self.trackers.variance()[n];
        let (share, known) = (&mut self.trackers.shares[n][pair], &mut self.known[n][pair]);
        let noise = noise * Lanes::splat(variance);
        let (now, shown) = (known.believed(noise * *share) * used, &mut self.displacement[n].0[pair]);
        let change = Lanes::splat(AT_ONCE) * (now - *shown);
        let [a, b, c, d] = (change * change).to_array();
        let square = (a + b) + (c + d);
        let part = if square > most * most { most / square.sqrt() } else { 1.0 };
        *shown = flushed(*shown + Lanes::splat(part) * change, FLUSH);
        let drift = SWING * self.swing.abs() as f32;
        // What is left out learns nothing: it would take from a harmonic that looks the same in the samples.
        *share = (*share + (known.share(drift, noise, self.part) - *share) * used) * kept;
    }
}
