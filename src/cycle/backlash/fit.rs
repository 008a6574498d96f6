//! Lost motion from a torque curve, by a fit that runs in bounded slices.
//!
//! After a reversal the motor's torque τ, positive in the sense of the motion, follows its travel s as
//!
//! ```text
//!   τ(s) = c + k·g(s),   g(s) = min(s − s1, 0) + max(s − s2, 0)
//! ```
//!
//! the wind-up is released with the drive's stiffness k (N·m/mm), the clearance s1…s2 is crossed at the level c,
//! then the drive winds up the other way until the table slides. With `before` and `after` the torque of steady
//! sliding before and after the reversal, and `motor` the friction on the motor's side (which turns its sign at
//! the reversal but winds nothing up), the spring's torque changes by D = after − before − 2·motor, so that
//!
//! ```text
//!   lost motion = clearance + 2·Ts/k = (s2 − s1) + D/k
//! ```
//!
//! Nothing here uses the torque at standstill, which is partly released, nor the break-away, which is above the
//! sliding torque: only slopes, the two kinks and sliding levels count (CN103561904 takes the break-away peak).
//!
//! Where the curve begins too late for its release, `unseen` counts from where the motor turned.
//!
//! Kinks are searched on a grid and refined by Gauss–Newton; running sums make each trial independent of the
//! curve's length. The stretch used ends below the sliding level, at the largest share of the wind-up whose
//! residuals show no structure, since near sliding the curve is rounded by creep and break-away.

use super::cholesky::Cholesky;
use super::curve::{BINS, Curve, Moments};
use super::fitted::{Fitted, Levels};
use super::rounding::{Line, Rounding, TOGETHER};
use crate::cycle::level::inflation;

mod unseen;

use unseen::Unseen;

/// Shares of the wind-up tried, largest first.
const SHARES: [f64; 3] = [0.65, 0.5, 0.35];
/// Share up to which a rounded curve is followed: the bend shows most near to sliding.
const ROUNDED: f64 = 0.8;
/// All of these.
const MARKS: [f64; 4] = [SHARES[0], SHARES[1], SHARES[2], ROUNDED];
/// Grid points for each kink.
const GRID: usize = 24;
/// Trials in one slice of the search.
const TRIALS: usize = 2;
/// Bins in one slice of a pass over the curve.
const SLICE: usize = 8;
/// Gauss–Newton steps.
const STEPS: u32 = 16;
/// Fewest bins on each slope: with less the kink beside it means nothing.
const FEWEST_BINS: f64 = 3.0;
/// First bins left out: the motor's friction turns its sign there.
const SKIP: f64 = 2.0;

/// One trial: kinks, the linear parameters that go with them and the sum of squares left.
#[derive(Debug, Clone, Copy)]
struct Trial {
    s1: f64,
    s2: f64,
    c: f64,
    k: f64,
    sse: f64,
}

const NO_TRIAL: Trial = Trial { s1: 0.0, s2: 0.0, c: 0.0, k: 0.0, sse: f64::INFINITY };

/// What the next slice does.
#[derive(Debug, Clone, Copy)]
enum Stage {
    /// Running sums up to a bin; ends with the curve.
    Sum { bin: usize },
    /// Trial number `next` of the kink grid; ends with the grid.
    Search { next: usize },
    /// Gauss–Newton: finds a step; ends after `STEPS`.
    Refine { step: u32 },
    /// Gauss–Newton: tries the step; ends after `STEPS`, or when a step brings nothing.
    Try { step: u32, ds1: f64, ds2: f64 },
    /// Residuals against their neighbours; ends with the stretch.
    Residuals { bin: usize, last: f64, count: f64, squares: f64, differences: f64 },
    /// Weighs the residuals; ends at once.
    Judge { count: f64, squares: f64, differences: f64 },
    /// The rounded curve; ends with `Rounding`.
    Round,
    /// The result stands.
    Done,
}

/// The fit in progress.
#[derive(Debug, Clone)]
pub struct Fit {
    stage: Stage,
    levels: Levels,
    turned: f64,
    share: usize,
    first: usize,
    end: usize,
    /// One past the bin at which the smoothed curve last passed each share on its way to sliding; `usize::MAX`: not.
    ends: [usize; MARKS.len()],
    /// The same on the way that it is on.
    passed: [usize; MARKS.len()],
    smooth: f64,
    highest: f64,
    best: Trial,
    chosen: Option<Fitted>,
    line: Line,
    rounding: Rounding,
    /// By how much the motor had come back from its furthest point when the curve began, mm; `None`: not known.
    returned: Option<f64>,
    /// The release is not on the curve: there is no first kink.
    unseen: Option<Unseen>,
    sums: [Moments; BINS + 1],
}

impl Default for Fit {
    fn default() -> Fit {
        Fit {
            stage: Stage::Done,
            levels: Levels::default(),
            turned: 0.0,
            share: 0,
            first: 0,
            end: 0,
            ends: [0; MARKS.len()],
            passed: [0; MARKS.len()],
            smooth: 0.0,
            highest: 0.0,
            best: NO_TRIAL,
            chosen: None,
            line: Line::default(),
            rounding: Rounding::default(),
            returned: None,
            unseen: None,
            sums: [Moments::default(); BINS + 1],
        }
    }
}

impl Fit {
    /// Begins the fit of a curve whose levels are known. The rounded curve leaves out the share `turned` of the way to the first kink,
    /// where the curve's bins are so fine that the motor's friction has not turned round in the first two. `returned` (mm, at least 0): the motor's way from its furthest point to where
    /// the curve begins, `None` where that is not known.
    pub fn start(&mut self, levels: Levels, turned: f64, returned: Option<f64>) {
        self.levels = levels;
        self.returned = returned;
        self.unseen = None;
        self.turned = turned;
        self.share = 0;
        self.first = 0;
        self.ends = [usize::MAX; MARKS.len()];
        self.passed = self.ends;
        self.smooth = levels.before;
        self.highest = f64::NEG_INFINITY;
        self.chosen = None;
        self.stage = Stage::Sum { bin: 0 };
    }

    /// Does one bounded slice of the work. Returns true once the result stands.
    pub fn advance(&mut self, curve: &Curve) -> bool {
        match self.stage {
            Stage::Sum { bin } => self.sum(curve, bin),
            Stage::Search { next } => self.search(curve, next),
            Stage::Refine { step } => self.refine(curve, step),
            Stage::Try { step, ds1, ds2 } => self.try_step(curve, step, ds1, ds2),
            Stage::Judge { count, squares, differences } => self.stage = self.judge(curve, count, squares, differences),
            Stage::Residuals { bin, last, count, squares, differences } => {
                self.residuals(curve, bin, last, count, squares, differences);
            }
            Stage::Round => self.round(curve),
            Stage::Done => return true,
        }
        matches!(self.stage, Stage::Done)
    }

    /// The result; `None` when the curve is too short for a fit or no rise is in it.
    #[must_use]
    pub fn result(&self) -> Option<&Fitted> {
        self.chosen.as_ref()
    }

    /// Largest number of slices that a fit may take.
    #[must_use]
    pub const fn slices_bound() -> u32 {
        let passes = 2 * (BINS / SLICE + 2) + GRID * GRID / TRIALS + 2 + 2 * STEPS as usize + 4;
        // A second time where the release turns out not to be on the curve.
        (2 * passes * SHARES.len()) as u32 + Rounding::slices_bound(BINS)
    }

    fn running(&self, bins: usize) -> &Moments {
        &self.sums[bins.min(BINS)]
    }

    /// Running sums, and where the smoothed curve passes each share of the wind-up. Where the motor runs into a clearance it
    /// may pass some for a moment.
    fn sum(&mut self, curve: &Curve, from: usize) {
        const SMOOTHING: f64 = 0.3; // about three bins
        const LAG: usize = 2; // (1 − 0.3)/0.3: so late does the smoothed curve pass a share
        const SLIDING: f64 = 0.85; // from there on a reading may fall again: the table sticks and slips
        let to = (from + SLICE).min(curve.used());
        // The rise starts at the motor's friction, and at more where the middle of the levels is a torque sensor's zero
        // and not a load; it ends at sliding. A load that the table's friction does not hold never lets the spring go slack:
        // there is no clearance in the curve, and half of the change is the rise.
        let middle = 0.5 * (self.levels.before + self.levels.after);
        let hangs = -middle > 0.5 * self.levels.spring_change();
        let from_level = self.levels.motor + if hangs { middle } else { middle.max(0.0) };
        let rise = self.levels.after - from_level;
        for bin in from..to {
            let mut sums = *self.running(bin);
            if bin == 0 {
                sums = Moments::default();
            }
            if let Some((n, s, t)) = curve.point(bin) {
                sums = sums.with(n, s, t);
                self.smooth += SMOOTHING * (t - self.smooth);
                let share = (self.smooth - from_level) / rise;
                for (passed, wanted) in self.passed.iter_mut().zip(MARKS) {
                    *passed = if share >= wanted { (*passed).min((bin + 1).saturating_sub(LAG)) } else { usize::MAX };
                }
                if share > self.highest && self.highest < SLIDING {
                    self.highest = share;
                    self.ends = self.passed;
                }
            }
            self.sums[(bin + 1).min(BINS)] = sums;
        }
        self.stage = if to < curve.used() {
            Stage::Sum { bin: to }
        } else {
            self.first = SKIP as usize;
            self.next_share(curve, 0)
        };
    }

    /// Sets up the search for the next share that the curve reaches.
    fn next_share(&mut self, curve: &Curve, from: usize) -> Stage {
        for share in from..SHARES.len() {
            let end = self.ends[share].min(curve.used());
            let reached = self.ends[share] != usize::MAX;
            let bins = self.running(end).since(self.running(self.first)).bins;
            if reached && end > self.first && bins >= 2.0 * FEWEST_BINS {
                self.share = share;
                self.end = end;
                self.best = NO_TRIAL;
                return Stage::Search { next: 0 };
            }
        }
        self.round_off(curve)
    }

    /// The stretch before `s`, as a number of bins between `first` and `end`.
    fn bins_before(&self, curve: &Curve, s: f64) -> usize {
        let bin = (s * curve.bins_per_mm() + 0.5).max(0.0) as usize;
        let below = matches!(curve.point(bin), Some((_, mean, _)) if mean < s);
        (bin + usize::from(below)).max(self.first).min(self.end)
    }

    /// Sums before the first kink, after the second, and in all.
    fn parts(&self, curve: &Curve, s1: f64, s2: f64) -> (Moments, Moments, Moments) {
        let start = self.running(self.first);
        let all = self.running(self.end).since(start);
        let release = match self.unseen {
            None => self.running(self.bins_before(curve, s1)).since(start),
            Some(_) => Moments::default(),
        };
        let windup = self.running(self.end).since(self.running(self.bins_before(curve, s2)));
        (release, windup, all)
    }

    /// Best c and k for given kinks.
    fn trial(&self, curve: &Curve, s1: f64, s2: f64) -> Trial {
        let (a, b, all) = self.parts(curve, s1, s2);
        let before = if self.unseen.is_some() { all.bins - b.bins } else { a.bins };
        if s2 > s1 && before.min(b.bins) < FEWEST_BINS {
            return NO_TRIAL;
        }
        let g = (a.s - s1 * a.n) + (b.s - s2 * b.n);
        let gg = (a.ss - 2.0 * s1 * a.s + s1 * s1 * a.n) + (b.ss - 2.0 * s2 * b.s + s2 * s2 * b.n);
        let gt = (a.st - s1 * a.t) + (b.st - s2 * b.t);
        let det = all.n * gg - g * g;
        if det <= 0.0 {
            return NO_TRIAL;
        }
        let k = (all.n * gt - g * all.t) / det;
        let c = (all.t - k * g) / all.n;
        let sse = (all.tt - c * all.t - k * gt).max(0.0);
        if k > 0.0 { Trial { s1, s2, c, k, sse } } else { NO_TRIAL }
    }

    fn search(&mut self, curve: &Curve, from: usize) {
        let low = self.first as f64 * curve.width_mm();
        let step = (self.end as f64 * curve.width_mm() - low) / GRID as f64;
        let trials = if self.unseen.is_some() { GRID } else { GRID * GRID };
        let mut next = from;
        for _ in 0..TRIALS {
            let (i, j) = (next / GRID, next % GRID);
            if j >= i {
                let trial = self.trial(curve, low + i as f64 * step, low + j as f64 * step);
                if trial.sse < self.best.sse {
                    self.best = trial;
                }
            }
            next += 1;
        }
        self.stage = if next < trials {
            Stage::Search { next }
        } else if self.best.sse.is_finite() {
            Stage::Refine { step: 0 }
        } else {
            self.next_share(curve, self.share + 1)
        };
    }

    /// Normal matrix of (c, k, s1, s2) and the right side that the kinks still see.
    fn normal(&self, curve: &Curve, t: &Trial) -> ([[f64; 4]; 4], [f64; 4]) {
        let (a, b, all) = self.parts(curve, t.s1, t.s2);
        let (ga, gb) = (a.s - t.s1 * a.n, b.s - t.s2 * b.n);
        let gga = a.ss - 2.0 * t.s1 * a.s + t.s1 * t.s1 * a.n;
        let ggb = b.ss - 2.0 * t.s2 * b.s + t.s2 * t.s2 * b.n;
        let k = t.k;
        let no_kink = if self.unseen.is_some() { 1.0 } else { 0.0 };
        let matrix = [
            [all.n, ga + gb, -k * a.n, -k * b.n],
            [ga + gb, gga + ggb, -k * ga, -k * gb],
            [-k * a.n, -k * ga, k * k * a.n + no_kink, 0.0],
            [-k * b.n, -k * gb, 0.0, k * k * b.n],
        ];
        let right = [0.0, 0.0, -k * (a.t - t.c * a.n - k * ga), -k * (b.t - t.c * b.n - k * gb)];
        (matrix, right)
    }

    /// Where Gauss–Newton would put the kinks.
    fn refine(&mut self, curve: &Curve, step: u32) {
        let t = self.best;
        let (matrix, right) = self.normal(curve, &t);
        self.stage = match Cholesky::new(matrix) {
            Some(system) if step < STEPS => {
                let d = system.solve(right);
                let largest = 0.1 * (self.end - self.first) as f64 * curve.width_mm();
                let bounded = |way: f64| way.max(-largest).min(largest);
                Stage::Try { step, ds1: bounded(d[2]), ds2: bounded(d[3]) }
            }
            _ => FIRST_RESIDUAL,
        };
    }

    /// Takes the step if it makes the fit better, else half of it, and so on.
    fn try_step(&mut self, curve: &Curve, step: u32, ds1: f64, ds2: f64) {
        let t = self.best;
        let (s1, s2) = (t.s1 + ds1, t.s2 + ds2);
        let meet = 0.5 * (s1 + s2);
        let trial = if s1 <= s2 { self.trial(curve, s1, s2) } else { self.trial(curve, meet, meet) };
        let gain = t.sse - trial.sse;
        if gain > 0.0 {
            self.best = trial;
        }
        self.stage = if gain > 1e-9 * t.sse {
            Stage::Refine { step: step + 1 }
        } else if gain < 0.0 && step + 1 < STEPS {
            Stage::Try { step: step + 1, ds1: 0.5 * ds1, ds2: 0.5 * ds2 }
        } else {
            FIRST_RESIDUAL
        };
    }

    /// Compares each residual with its neighbour (von Neumann's ratio): 2 for white noise, less for structure.
    fn residuals(&mut self, curve: &Curve, from: usize, last: f64, count: f64, squares: f64, differences: f64) {
        let (mut last, mut count, mut squares, mut differences) = (last, count, squares, differences);
        let from = from.max(self.first);
        let to = (from + SLICE).min(self.end);
        let t = self.best;
        for bin in from..to {
            if let Some((n, s, torque)) = curve.point(bin) {
                let fitted = t.c + t.k * ((s - t.s1).min(0.0) + (s - t.s2).max(0.0));
                let residual = n.sqrt() * (torque - fitted);
                if count > 0.0 {
                    differences += (residual - last) * (residual - last);
                }
                squares += residual * residual;
                count += 1.0;
                last = residual;
            }
        }
        self.stage = if to < self.end {
            Stage::Residuals { bin: to, last, count, squares, differences }
        } else {
            Stage::Judge { count, squares, differences }
        };
    }

    /// Accepts this share when its residuals are white, else goes on to a smaller one.
    fn judge(&mut self, curve: &Curve, count: f64, squares: f64, differences: f64) -> Stage {
        const PARAMETERS: f64 = 4.0;
        const SIGMAS: f64 = 3.0;
        let ratio = if squares > 0.0 { differences / squares } else { 2.0 };
        // Under white noise the ratio has mean 2 and standard deviation 2/√n.
        let structured = ratio < 2.0 - SIGMAS * 2.0 / count.sqrt();
        let inflation = inflation(ratio, TOGETHER);
        let noise = squares / (count - PARAMETERS).max(1.0);
        if self.unseen.is_none() && self.best.s2 - self.best.s1 < curve.width_mm() {
            // One straight line: only its slope is known, and the kink lies where the spring's torque passes zero.
            let (t, zero) = (self.best, 0.5 * (self.levels.before + self.levels.after) + self.levels.motor);
            let middle = 0.5 * (t.s1 + t.s2) + (zero - t.c) / t.k;
            self.best = Trial { s1: middle, s2: middle, c: zero, ..t };
        }
        let fitted = match self.unseen {
            None => self.derive(curve, noise, inflation, structured),
            Some(unseen) => self.derive_unseen(curve, noise * inflation, unseen, structured, noise),
        };
        let better = match (&self.chosen, &fitted) {
            (_, None) => false,
            (None, Some(_)) => true,
            (Some(old), Some(new)) => !new.structured || new.variance < old.variance,
        };
        if better {
            self.chosen = fitted;
            let Trial { s1, s2, c, k, .. } = self.best;
            self.line = Line { s1, s2, c, k };
        }
        if structured { self.next_share(curve, self.share + 1) } else { self.round_off(curve) }
    }

    /// Sets up the rounded fit over the largest share that the curve reaches.
    fn round_off(&mut self, curve: &Curve) -> Stage {
        if let (None, Some(unseen)) = (self.unseen, self.find_unseen(curve)) {
            return self.begin_unseen(curve, unseen);
        }
        let end = self.ends.iter().filter(|end| **end != usize::MAX).max();
        let (Some(_), Some(end)) = (&self.chosen, end) else { return Stage::Done };
        let (width, end) = (curve.width_mm(), (*end).min(curve.used()));
        // The motor's own friction gives way too as it turns round, and would bend the beginning alike.
        let turned = (self.turned * self.line.s1.max(0.0) * curve.bins_per_mm()) as usize;
        self.rounding.start(
            self.line,
            self.levels,
            self.first.max(turned).min(end),
            end,
            width,
            self.unseen.map(|u| u.returned),
        );
        Stage::Round
    }

    fn round(&mut self, curve: &Curve) {
        if self.rounding.advance(curve) {
            if let Some(fitted) = &mut self.chosen {
                fitted.rounded = self.rounding.result();
            }
            self.stage = Stage::Done;
        }
    }

    /// Lost motion and its variance from the fitted kinks, slope and levels.
    fn derive(&self, curve: &Curve, noise: f64, inflation: f64, structured: bool) -> Option<Fitted> {
        let (t, change) = (self.best, self.levels.spring_change());
        // Kinks that meet leave their distance open: its uncertainty is that of kinks a tenth of the stretch apart.
        let apart = 0.5 * (0.1 * (self.end - self.first) as f64 * curve.width_mm() - (t.s2 - t.s1)).max(0.0);
        let wider = |down: f64, up: f64| Trial { s1: t.s1 - down * apart, s2: t.s2 + up * apart, ..t };
        let (before, after, _) = self.parts(curve, t.s1 - apart, t.s2 + apart);
        let (matrix, _) = self.normal(
            curve,
            &match () {
                () if before.bins < FEWEST_BINS => wider(0.0, 2.0),
                () if after.bins < FEWEST_BINS => wider(2.0, 0.0),
                () => wider(1.0, 1.0),
            },
        );
        let scale = noise * inflation;
        // d(lost motion)/d(c, k, s1, s2); the levels come from other samples.
        let gradient = [0.0, -change / (t.k * t.k), -1.0, 1.0];
        let system = Cholesky::new(matrix)?;
        let fit_variance = scale * system.inverse_form(gradient);
        let k_variance = scale * system.inverse_form([0.0, 1.0, 0.0, 0.0]);
        let level_variance = scale * system.inverse_form([1.0, 0.0, 0.0, 0.0]);
        let windup = change / t.k;
        let clearance = t.s2 - t.s1;
        let variance = fit_variance + self.levels.variance / (t.k * t.k);
        (variance.is_finite() && variance >= 0.0).then_some(Fitted {
            lost_motion: clearance + windup,
            variance,
            clearance,
            windup,
            held: t.s1,
            stiffness: t.k,
            stiffness_error: k_variance.max(0.0).sqrt(),
            level: t.c,
            level_error: level_variance.max(0.0).sqrt(),
            noise: noise.sqrt(),
            share: SHARES[self.share.min(SHARES.len() - 1)],
            structured,
            turn_error: 0.0,
            rounded: None,
        })
    }
}

const FIRST_RESIDUAL: Stage = Stage::Residuals { bin: 0, last: 0.0, count: 0.0, squares: 0.0, differences: 0.0 };
