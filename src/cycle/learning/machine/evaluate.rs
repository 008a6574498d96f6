//! From a measured revolution to the next correction, a point or a harmonic a cycle.

use super::*;
use crate::cycle::calibration::solve::Complex;
use crate::cycle::learning::points::{angle, close};
use crate::cycle::turns::{cos_sin, fold};
use crate::cycle::vibration::spindle::Wheel;
use core::f64::consts::TAU;

/// Updates that may grow in a row: by harmonics a trial teaches what the next one needs.
const GROWN_MAX: u32 = 3;
/// Points turned below which nothing was measured.
const TURNS_MIN: f64 = 1e-3;

impl Learning {
    /// At the end of a measurement: the speed at which it was made.
    pub(super) fn speed_seen(&mut self) {
        let speed = (self.progress / self.cycles.max(1) as f64).copysign(self.rate);
        // What was best at another speed is no measure any more.
        if (speed - self.speed).abs() > self.plan.speed_tolerance * speed.abs() {
            self.fresh = true;
            self.speed = speed;
        }
        self.report.speed_rpm = 60.0 * speed / self.plan.cycle;
        (self.turns, self.squares, self.report.peak_um) = (0.0, 0.0, 0.0);
        self.spectrum = Harmonics::default();
    }

    /// One slice.
    pub(super) fn evaluate(&mut self) {
        let (i, points) = (self.at, self.plan.points);
        self.at += 1;
        match self.phase {
            Phase::Analyse if i < points => self.analyse(i),
            Phase::Analyse => self.decide(),
            Phase::Update if self.plan.published && i < points => self.update_point(i),
            Phase::Update if self.plan.published => self.enter(Phase::Smooth),
            Phase::Update if i < self.plan.harmonics => self.update_line(i),
            Phase::Update => self.bound(),
            Phase::Synthesise if i < points => self.synthesise(i),
            Phase::Smooth if i < points => self.smooth(i),
            _ => {
                close(&mut self.coming, points);
                self.fresh = false;
                self.enter(Phase::Blend);
            }
        }
    }

    fn analyse(&mut self, i: usize) {
        if i == 0 {
            self.join_half_turn();
        }
        let entry = i & (ENTRIES - 1);
        let (deviation, weight) = (1e3 * self.bins[entry].deviation, self.weights[entry].whole());
        let met = weight > 0.0;
        let before = self.seen.get(i.wrapping_sub(1)).copied().unwrap_or(0.0);
        let seen = if met { (deviation / weight) as f32 } else { before };
        if let Some(point) = self.seen.get_mut(i) {
            *point = seen;
        }
        if met {
            self.turns += weight;
            self.squares += f64::from(seen) * deviation;
            self.report.peak_um = self.report.peak_um.max(seen.abs().into());
        }
        if !self.plan.published {
            let wheel = Wheel::at(angle(i, self.plan.points), self.plan.pairs);
            self.spectrum.gather(&wheel, self.plan.pairs, deviation as f32);
        }
    }

    /// Half a turn has two entries.
    fn join_half_turn(&mut self) {
        let last = self.plan.points & (ENTRIES - 1);
        let (bin, weight) = (self.bins[last], self.weights[last]);
        if last == 0 || weight.whole() == 0.0 {
            return;
        }
        let first = &mut self.bins[0];
        *first = Bin { deviation: first.deviation + bin.deviation, target: bin.target };
        let first = &mut self.weights[0];
        *first = Weight { sum: first.sum + weight.sum, steady: first.steady + weight.steady };
    }

    /// All points are seen: within the tolerance, better, or worse.
    fn decide(&mut self) {
        let rms = (self.squares / self.turns.max(TURNS_MIN)).max(0.0).sqrt();
        let report = &mut self.report;
        report.last_um = rms;
        if report.updates == 0 {
            report.first_um = rms;
        }
        let grown = !self.fresh && rms > self.plan.growth * report.best_um;
        self.grown = if grown { self.grown + 1 } else { 0 };
        report.rejected += i32::from(grown);
        self.better = self.fresh || rms < report.best_um;
        if self.better {
            report.best_um = rms;
        }
        if rms <= self.plan.tolerance {
            return self.enter(Phase::Done);
        }
        let most = if self.plan.published { 1 } else { GROWN_MAX };
        let code = if self.grown >= most {
            GIB_ERR_LEARNING_GROWS
        } else if report.updates as u32 >= self.plan.updates {
            GIB_ERR_LEARNING_UPDATES
        } else {
            GIB_OK
        };
        if code == GIB_OK {
            report.updates += 1;
        } else {
            self.fault = Fault { code, field: "tolerance_um\0", value: rms, low: 0.0, high: self.plan.tolerance };
            self.last_update = true;
        }
        report.correction_um = 0.0;
        self.enter(Phase::Update);
    }

    /// How far the machine lags behind its command at the present speed, turns.
    fn lead(&self) -> f64 {
        self.plan.lead.copysign(self.speed) + self.plan.lag * self.speed
    }

    /// Published: each point by the deviation that it led to.
    fn update_point(&mut self, i: usize) {
        let points = self.plan.points.max(1) as i64;
        // Whole turns of lead change nothing; what is left is half a turn at most, so that one turn back or forth suffices.
        let lead = (fold(self.lead()) * self.plan.scale + 0.5).floor() as i64;
        let led = i as i64 + lead;
        let led = if led < 0 { led + points } else { led };
        let led = if led >= points { led - points } else { led };
        let seen = usize::try_from(led).ok().and_then(|led| self.seen.get(led)).copied().unwrap_or(0.0);
        let now = self.force[i & (ENTRIES - 1)].value as f32;
        let Some(best) = self.best.get_mut(i) else { return };
        if self.better {
            *best = now;
        }
        let most = self.plan.most as f32;
        let next = if self.last_update { *best } else { now + self.plan.gain as f32 * seen };
        let next = next.max(-most).min(most);
        let next = bounded(next, self.plan.most);
        self.report.correction_um = self.report.correction_um.max(next.abs());
        self.coming[i & (ENTRIES - 1)].value = next;
    }

    /// By harmonics: see [`crate::cycle::learning`].
    fn update_line(&mut self, i: usize) {
        let [a, b] = self.spectrum.get(i);
        let scale = 2.0 / self.turns.max(TURNS_MIN);
        let left = Complex(scale * f64::from(a), -scale * f64::from(b));
        let (cos, sin) = cos_sin(fold((i + 1) as f64 * self.lead()));
        let Some(line) = self.lines.get_mut(i) else { return };
        if self.fresh {
            // Believed beforehand as much as one trial of half the tolerance.
            line.begin(left, Complex(cos, -sin), 0.25 * self.plan.tolerance * self.plan.tolerance);
        } else {
            line.measured(left);
        }
        line.next(if self.last_update { 0.0 } else { self.plan.gain });
    }

    /// All harmonics together within the bound: the sum of their sizes is at least the peak.
    fn bound(&mut self) {
        let lines = self.lines.iter_mut().take(self.plan.harmonics);
        let sum: f64 = lines.map(|line| line.trial.size()).sum();
        let part = if sum > self.plan.most { self.plan.most / sum } else { 1.0 };
        let turn = TAU / self.plan.scale;
        self.steepest_coming = 0.0;
        (self.spectrum, self.steep) = (Harmonics::default(), Harmonics::default());
        for (i, line) in self.lines.iter_mut().take(self.plan.harmonics).enumerate() {
            line.trial = line.trial.scaled(part);
            self.steepest_coming += (i + 1) as f64 * turn * line.trial.size();
            let (a, b) = (line.trial.0 as f32, -line.trial.1 as f32);
            let k = ((i + 1) as f64 * turn) as f32;
            self.spectrum.set(i, [a, b]);
            self.steep.set(i, [k * b, -k * a]);
        }
        self.enter(Phase::Synthesise);
    }

    fn synthesise(&mut self, i: usize) {
        let pairs = self.plan.pairs;
        let wheel = Wheel::at(angle(i, self.plan.points), pairs);
        let (value, slope) = (self.spectrum.value(&wheel, pairs), self.steep.value(&wheel, pairs));
        let value = bounded(value, self.plan.most);
        self.report.correction_um = self.report.correction_um.max(value.abs());
        self.coming[i & (ENTRIES - 1)] = Cell { value, slope: clean(slope) };
    }

    /// Slope of a correction that is only known at its points.
    fn smooth(&mut self, i: usize) {
        let last = self.plan.points.saturating_sub(1);
        let at = |i: usize| self.coming[i & (ENTRIES - 1)].value;
        let before = at(if i == 0 { last } else { i - 1 });
        let after = at(if i >= last { 0 } else { i + 1 });
        let step = (after - at(i)).abs();
        self.steepest_coming = if i == 0 { step } else { self.steepest_coming.max(step) };
        self.coming[i & (ENTRIES - 1)].slope = (0.5 * (after - before) + 1e-10) - 1e-10;
    }
}

/// Without digits that could become subnormal.
fn clean(value: f32) -> f64 {
    f64::from((value + 1e-10) - 1e-10)
}

/// The same within the largest correction, which sums in single precision may miss by their rounding.
fn bounded(value: f32, most: f64) -> f64 {
    clean(value).max(-most).min(most)
}
