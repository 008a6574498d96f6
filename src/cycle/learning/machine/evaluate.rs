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
                close(&mut self.tables[(self.front ^ 1) & 1], points);
                self.fresh = false;
                self.enter(Phase::Blend);
            }
        }
    }

    fn analyse(&mut self, i: usize) {
        if i == 0 {
            self.join_half_turn();
        }
        let Some(bin) = self.bins.get(i).copied() else { return };
        let met = bin.weight > 0.0;
        let before = self.seen.get(i.wrapping_sub(1)).copied().unwrap_or(0.0);
        let seen = if met { bin.deviation / bin.weight } else { before };
        if let Some(point) = self.seen.get_mut(i) {
            *point = seen;
        }
        if met {
            self.turns += f64::from(bin.weight);
            self.squares += f64::from(seen) * f64::from(bin.deviation);
            self.report.peak_um = self.report.peak_um.max(seen.abs().into());
        }
        if !self.plan.published {
            let wheel = Wheel::at(angle(i, self.plan.points), self.plan.pairs);
            self.spectrum.gather(&wheel, self.plan.pairs, bin.deviation);
        }
    }

    /// Half a turn has two entries.
    fn join_half_turn(&mut self) {
        let last = self.bins.get(self.plan.points).copied().unwrap_or_default();
        let first = &mut self.bins[0];
        first.weight += last.weight;
        first.deviation += last.deviation;
        if last.weight > 0.0 {
            first.target = last.target;
        }
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
        let now = self.tables[self.front & 1].get(i).map_or(0.0, |cell| cell.value);
        let Some(best) = self.best.get_mut(i) else { return };
        if self.better {
            *best = now;
        }
        let most = self.plan.most;
        let next = if self.last_update { *best } else { now + self.plan.gain as f32 * seen };
        let next = next.max(-most).min(most);
        self.report.correction_um = self.report.correction_um.max(next.abs().into());
        if let Some(cell) = self.tables[(self.front ^ 1) & 1].get_mut(i) {
            cell.value = (next + 1e-10) - 1e-10;
        }
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
        let part = if sum > self.plan.most.into() { f64::from(self.plan.most) / sum } else { 1.0 };
        let turn = TAU / self.plan.scale;
        (self.spectrum, self.steep) = (Harmonics::default(), Harmonics::default());
        for (i, line) in self.lines.iter_mut().take(self.plan.harmonics).enumerate() {
            line.trial = line.trial.scaled(part);
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
        self.report.correction_um = self.report.correction_um.max(value.abs().into());
        if let Some(cell) = self.tables[(self.front ^ 1) & 1].get_mut(i) {
            *cell = Cell { value: (value + 1e-10) - 1e-10, slope: (slope + 1e-10) - 1e-10 };
        }
    }

    /// Slope of a correction that is only known at its points.
    fn smooth(&mut self, i: usize) {
        let last = self.plan.points.saturating_sub(1);
        let table = &mut self.tables[(self.front ^ 1) & 1];
        let at = |i: usize| table.get(i).map_or(0.0, |cell| cell.value);
        let before = at(if i == 0 { last } else { i - 1 });
        let after = at(if i >= last { 0 } else { i + 1 });
        if let Some(cell) = table.get_mut(i) {
            cell.slope = (0.5 * (after - before) + 1e-10) - 1e-10;
        }
    }
}
