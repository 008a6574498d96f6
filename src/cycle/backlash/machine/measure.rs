//! The measuring states: what happens in a cycle of each, and what comes after it.

use super::*;
use crate::cycle::backlash::{curve, verdict};

/// Share of sliding at which the wind-up has certainly begun, and one further up: their distance scales the probe.
const RISE_LOW: f64 = 0.5;
const RISE_HIGH: f64 = 0.65;
/// Points of the curve, and share of the way, without growth after which the table is sliding.
const STALL_POINTS: f64 = 15.0;
const STALL_SHARE: f64 = 0.4;

/// Bins that the peak rule sees in one cycle.
const PEAK_SLICE: usize = 16;

impl Watch {
    /// Begins a scan between the sliding levels; `noise` is the standard deviation of one sample, `gain` the share
    /// of a new sample in the smoothed one.
    fn new(before: f64, after: f64, noise: f64, gain: f64) -> Watch {
        let per_half = 2.0 / (after - before);
        Watch {
            middle: 0.5 * (before + after),
            per_half,
            smooth: -1.0,
            gain,
            // White noise of std σ has σ·√(gain/2) left after the smoothing; twice that is growth, not chance.
            margin: 2.0 * noise * per_half * (0.5 * gain).sqrt(),
            highest: -1.0,
            ..Watch::default()
        }
    }

    #[inline(always)]
    fn add(&mut self, travel: f64, torque: f64) {
        self.smooth += self.gain * ((torque - self.middle) * self.per_half - self.smooth);
        if self.smooth > self.highest + self.margin {
            self.highest = self.smooth;
            self.highest_at = travel;
            if self.high_at == 0.0 && self.smooth > RISE_HIGH {
                self.high_at = travel;
            }
        }
    }
}

impl Probe {
    /// Twice the motor's friction and its variance: the distance of two parallel lines, torque against way, one for
    /// each sense. Parallel, since the drive's stiffness is the same both ways; lines, since the motor does not
    /// pass all places equally fast.
    fn difference(&self) -> (f64, f64) {
        let (b, f) = (&self.back, &self.forth);
        let spread = |m: &Moments| m.ss - m.s * m.s / m.n;
        let with_way = |m: &Moments| m.st - m.s * m.t / m.n;
        let slope = (with_way(b) + with_way(f)) / (spread(b) + spread(f));
        let apart = f.s / f.n - b.s / b.n;
        let twice = f.t / f.n - b.t / b.n - slope * apart;
        let rest = |m: &Moments| m.tt - m.t * m.t / m.n - slope * with_way(m);
        let noise = (rest(b) + rest(f)).max(0.0) / (b.n + f.n - 3.0);
        (twice, noise * (1.0 / b.n + 1.0 / f.n + apart * apart / (spread(b) + spread(f))))
    }
}

impl Backlash {
    /// One cycle of the present state.
    #[inline(always)]
    pub(super) fn advance(&mut self, input: &BacklashInput) {
        match self.phase {
            Phase::Scan => self.scan(input),
            Phase::SlideBack | Phase::SlideIn => self.slide(input),
            Phase::ProbeBack | Phase::ProbeForth => self.probe(input),
            Phase::Unwind { forth } => {
                if self.profile.step() {
                    self.probe_on(input, forth);
                }
            }
            Phase::Approach => {
                if self.profile.step() {
                    self.slide_back();
                }
            }
            Phase::Settle => {
                if self.left == 1 {
                    self.turn(input);
                }
            }
            Phase::EvaluatePeak { bin } => self.evaluate_peak(bin),
            Phase::EvaluateFit => {
                if self.fit.advance(&self.curves[self.sense_index()]) {
                    self.conclude();
                }
            }
            Phase::Begin => self.begin(input),
            Phase::Clear => {
                if self.confirmed(input) {
                    self.next_reversal();
                }
            }
            Phase::Write { then } => {
                if self.confirmed(input) {
                    self.written(input, then);
                }
            }
            Phase::Stopping => {
                if self.profile.step() {
                    self.restore();
                }
            }
            Phase::Restore => {
                if self.confirmed(input) {
                    self.changed = false;
                    self.fail();
                }
            }
            Phase::Idle | Phase::Done | Phase::Failed => {}
        }
    }

    /// Which of the two senses the present reversal belongs to.
    fn sense_index(&self) -> usize {
        usize::from(self.plan.senses == 2 && self.reversal % 2 == 1)
    }

    fn begin(&mut self, input: &BacklashInput) {
        self.profile = Profile::at_rest(input.position_mm, self.plan.acceleration);
        self.fallback_um = input.compensation_um;
        self.references = self.plan.references.unwrap_or([input.position_mm; 2]);
        if let Err(fault) = self.plan.check_reach(self.references) {
            return self.leave(fault);
        }
        self.request(0.0, true);
        self.enter(Phase::Clear, f64::from(self.plan.ack_timeout));
    }

    /// To the reference position of the next reversal.
    fn next_reversal(&mut self) {
        let index = self.sense_index();
        let before = if index == 0 { self.plan.first_sense } else { -self.plan.first_sense };
        self.sense = -before;
        let goal = self.references[index];
        self.move_to(Phase::Approach, goal, self.plan.approach_speed);
    }

    /// Starts a move whose deadline follows from its length.
    fn move_to(&mut self, phase: Phase, goal: f64, speed: f64) {
        self.profile.go(goal, speed);
        let bound = self.profile.cycles_bound();
        self.enter(phase, bound);
    }

    fn slide_back(&mut self) {
        self.after = Level::new(self.plan.batch);
        self.before = Level::new(self.plan.batch);
        let goal = self.references[self.sense_index()] + self.sense * self.plan.run_in();
        self.move_to(Phase::SlideBack, goal, self.plan.slide_speed);
    }

    /// Slides at constant speed; the last stretch before braking is the sliding level.
    #[inline(always)]
    fn slide(&mut self, input: &BacklashInput) {
        let arrived = self.profile.step();
        let left = (self.profile.goal - self.profile.position).abs();
        if left <= self.plan.level_from && self.profile.speed.abs() >= self.plan.slide_speed {
            let torque = self.sense * input.torque;
            if self.phase == Phase::SlideBack { self.after.add(torque) } else { self.before.add(torque) }
        }
        if arrived {
            if self.phase == Phase::SlideBack {
                let goal = self.references[self.sense_index()];
                self.move_to(Phase::SlideIn, goal, self.plan.slide_speed);
            } else {
                self.enter(Phase::Settle, f64::from(self.plan.settle) + 1.0);
            }
        }
    }

    /// The rest before a reversal is over: checks the sliding levels and turns.
    fn turn(&mut self, input: &BacklashInput) {
        let change = self.after.mean() - self.before.mean();
        let error = (self.after.variance_of_mean() + self.before.variance_of_mean()).sqrt();
        const SIGMAS: f64 = 5.0;
        if change.abs() <= SIGMAS * error || error.is_infinite() {
            let fault = Fault {
                code: GIB_ERR_BACKLASH_NOISE,
                field: "torque\0",
                value: change,
                low: SIGMAS * error,
                high: f64::MAX,
            };
            return self.leave(fault);
        }
        if change < 0.0 {
            return self.leave(Fault {
                code: GIB_ERR_BACKLASH_TORQUE_SIGN,
                field: "torque\0",
                value: change,
                low: 0.0,
                high: f64::MAX,
            });
        }
        let samples = f64::from(self.after.batches().max(1)) * f64::from(self.plan.batch);
        let noise = (self.after.variance_of_mean() * samples).sqrt();
        self.watch = Watch::new(self.before.mean(), self.after.mean(), noise, self.plan.watch_gain);
        self.turn = input.position_mm;
        self.turn_command = self.profile.position;
        self.hold = self.plan.dwell;
        let index = self.sense_index();
        self.curves[index].start(self.plan.bin);
        if self.plan.slow_feed {
            let goal = self.turn_command + self.sense * (self.plan.limit + self.plan.lag_limit);
            self.move_to(Phase::Scan, goal, self.plan.feed);
        } else {
            let steps = (self.plan.limit + self.plan.lag_limit) / self.plan.step + 2.0;
            self.enter(Phase::Scan, steps * f64::from(self.plan.dwell));
        }
    }

    /// One cycle of stepping or feeding away from the reversal.
    #[inline(always)]
    fn scan(&mut self, input: &BacklashInput) {
        let travel = self.sense * (input.position_mm - self.turn);
        let torque = self.sense * input.torque;
        let change = (input.position_mm - self.last_position).abs();
        self.last_position = input.position_mm;
        if change > 0.0 && change < self.smallest_change {
            self.smallest_change = change;
        }
        let mut over = false;
        if self.plan.slow_feed {
            over = self.profile.step();
        } else {
            self.hold -= 1;
            if self.hold == 0 {
                self.hold = self.plan.dwell;
                self.profile.position += self.sense * self.plan.step;
                over = (self.profile.position - self.turn_command).abs() >= self.plan.limit + self.plan.lag_limit;
            }
            if self.hold > self.plan.read_from {
                return;
            }
        }
        self.curves[usize::from(self.plan.senses == 2) & (self.reversal & 1) as usize].add(travel, torque);
        self.watch.add(travel, torque);
        let stalled = (STALL_POINTS * self.plan.step).max(STALL_SHARE * self.watch.highest_at);
        if self.watch.highest > RISE_LOW && travel > self.watch.highest_at + stalled {
            self.probe_back(input);
        } else if over || travel >= self.plan.limit {
            let code = if self.watch.highest < RISE_LOW { GIB_ERR_BACKLASH_NO_RISE } else { GIB_ERR_BACKLASH_LIMIT };
            let found = self.watch.highest;
            self.leave(Fault { code, field: "detection_limit_um\0", value: found, low: RISE_LOW, high: 1.0 });
        }
    }

    /// Sliding is reached: will go back by a share of the way, where the table still sticks.
    #[cold]
    fn probe_back(&mut self, input: &BacklashInput) {
        let high_at = if self.watch.high_at > 0.0 { self.watch.high_at } else { self.watch.highest_at };
        // A quarter of the way so far ends in the wind-up or in the clearance, where the table sticks.
        let depth = (0.25 * high_at).max(2.0 * self.plan.step);
        self.probe = Probe { depth, deepest: high_at, ..Probe::default() };
        self.unwind(input, false);
    }

    /// Brings the command to where the motor is.
    fn unwind(&mut self, input: &BacklashInput, forth: bool) {
        self.move_to(Phase::Unwind { forth }, input.position_mm, self.plan.slide_speed);
    }

    /// The command has been brought back: goes on with the next way of the probe.
    #[cold]
    fn probe_on(&mut self, input: &BacklashInput, forth: bool) {
        let back = self.sense * (self.probe.turn - input.position_mm);
        if forth {
            let deepest = self.probe.deepest;
            if back > deepest {
                let field = "position_mm\0";
                return self.leave(Fault {
                    code: GIB_ERR_BACKLASH_MOTOR_FRICTION,
                    field,
                    value: back,
                    low: 0.0,
                    high: deepest,
                });
            }
            let goal = self.turn_command + self.sense * self.plan.reach();
            self.move_to(Phase::ProbeForth, goal, self.plan.feed);
        } else {
            self.probe.turn = input.position_mm;
            let goal = self.turn_command - self.sense * self.plan.limit.min(self.plan.lag_limit);
            self.move_to(Phase::ProbeBack, goal, self.plan.feed);
        }
    }

    /// One cycle of the probe. Friction on the motor's side is half the difference of the torque both ways at the
    /// same place; the first and last quarter of the way, where the motor turns, are left out.
    #[inline(always)]
    fn probe(&mut self, input: &BacklashInput) {
        let over = self.profile.step();
        let back = self.sense * (self.probe.turn - input.position_mm);
        let depth = self.probe.depth;
        let inside = back > 0.25 * depth && back < 0.75 * depth;
        let torque = self.sense * input.torque;
        if self.phase == Phase::ProbeBack {
            if inside {
                self.probe.back = self.probe.back.with(1.0, back, torque);
            }
            if back >= depth {
                return self.unwind(input, true);
            }
        } else {
            if inside {
                self.probe.forth = self.probe.forth.with(1.0, back, torque);
            }
            if back <= 0.1 * depth {
                return self.probed();
            }
        }
        if over {
            self.leave(Fault {
                code: GIB_ERR_BACKLASH_MOTOR_FRICTION,
                field: "position_mm\0",
                value: back,
                low: 0.0,
                high: depth,
            });
        }
    }

    /// All of one reversal is recorded.
    #[cold]
    fn probed(&mut self) {
        self.profile.goal = self.profile.position;
        self.profile.speed = 0.0;
        let (twice, twice_variance) = self.probe.difference();
        let change = self.after.mean() - self.before.mean();
        let motor = (0.5 * twice).max(0.0);
        // More than half of the friction on the motor's side leaves too little wind-up to see; and a probe that
        // cannot say is no probe.
        const LARGEST_SHARE: f64 = 0.55;
        const WORST_ERROR: f64 = 0.1;
        let share = 2.0 * motor / change;
        if !(share <= LARGEST_SHARE && twice_variance >= 0.0 && twice_variance.sqrt() <= WORST_ERROR * change) {
            return self.leave(Fault {
                code: GIB_ERR_BACKLASH_MOTOR_FRICTION,
                field: "torque\0",
                value: share,
                low: 0.0,
                high: LARGEST_SHARE,
            });
        }
        self.levels = Levels {
            before: self.before.mean(),
            after: self.after.mean(),
            motor,
            variance: self.before.variance_of_mean() + self.after.variance_of_mean() + twice_variance,
        };
        self.peak = Peak::new(0.5 * self.after.mean(), self.plan.step);
        self.enter(Phase::EvaluatePeak { bin: 0 }, 1.0 + curve::BINS as f64 / PEAK_SLICE as f64);
    }

    fn evaluate_peak(&mut self, bin: usize) {
        let curve = &self.curves[self.sense_index()];
        for bin in bin..bin + PEAK_SLICE {
            if let Some((n, travel, torque)) = curve.point(bin) {
                self.peak.add(n, travel, torque);
            }
        }
        if bin + PEAK_SLICE >= curve.used() {
            self.fit.start(self.levels);
            self.enter(Phase::EvaluateFit, f64::from(Fit::slices_bound()));
        } else {
            self.phase = Phase::EvaluatePeak { bin: bin + PEAK_SLICE };
        }
    }

    /// One reversal is evaluated: next one, or the end.
    #[cold]
    fn conclude(&mut self) {
        let index = self.sense_index();
        let fitted = match verdict::check_reversal(self.fit.result()) {
            Ok(fitted) => fitted,
            Err(fault) => return self.leave(fault),
        };
        let steps = self.curves[index].used() as f64 * self.plan.bin / self.plan.step;
        self.senses[index].add(&fitted, &self.levels, self.peak.found(), steps);
        self.reversal += 1;
        let all = self.plan.senses * self.plan.repeats;
        self.output.progress_ratio = f64::from(self.reversal) / f64::from(all);
        let encoder = if self.plan.encoder > 0.0 { self.plan.encoder } else { self.smallest_change };
        let encoder = if encoder.is_finite() { encoder } else { 0.0 };
        (self.estimates, self.mean) = verdict::estimates(&self.plan, encoder, &self.senses);
        if self.reversal < all {
            return self.next_reversal();
        }
        let amount = if self.plan.use_peak { self.mean.peak_um } else { self.mean.lost_motion_um };
        if let Err(fault) = verdict::check_result(&self.plan, encoder, &self.estimates, &self.mean, amount) {
            return self.leave(fault);
        }
        if self.plan.measure_only {
            self.request(self.fallback_um, false);
        } else {
            self.written_um = Some(amount);
            self.request(amount, false);
        }
        self.enter(Phase::Write { then: After::Done }, f64::from(self.plan.ack_timeout));
    }

    /// The kernel runs with the amount asked for.
    fn written(&mut self, input: &BacklashInput, then: After) {
        self.changed = false;
        self.active_um = input.compensation_um;
        match then {
            After::Done => {
                if self.written_um.is_some() {
                    self.old_um = Some(self.fallback_um);
                }
                self.enter(Phase::Done, 0.0);
            }
            After::Idle => {
                self.enter(Phase::Idle, 0.0);
            }
        }
    }
}
