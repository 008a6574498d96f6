//! The measuring states: what happens in a cycle of each, and what comes after it.

use super::*;
use crate::cycle::backlash::plan::CREEP;
use crate::cycle::backlash::{curve, verdict};

/// Bins that the peak rule sees in one cycle.
const PEAK_SLICE: usize = 8;

impl Backlash {
    /// One cycle of the present state.
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
            Phase::CreepIn => self.creep(input),
            Phase::Rest => {
                if self.profile.step() {
                    self.probed();
                }
            }
            Phase::Settle => self.settle(input),
            Phase::EvaluatePeak { bin } => self.evaluate_peak(bin),
            Phase::EvaluateFit => {
                if self.fit.advance(&self.curves[self.index & 1]) {
                    self.enter(Phase::Conclude, 1.0);
                }
            }
            Phase::Conclude => self.conclude(),
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
            Phase::Stopping => self.brake(),
            Phase::Restore => {
                if self.confirmed(input) {
                    self.changed = false;
                    self.fail();
                }
            }
            Phase::Idle | Phase::Done | Phase::Failed => {}
        }
    }

    fn begin(&mut self, input: &BacklashInput) {
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
        let index = usize::from(self.plan.senses == 2 && self.reversal % 2 == 1);
        self.index = index;
        let before = if index == 0 { self.plan.first_sense } else { -self.plan.first_sense };
        self.sense = -before;
        let goal = self.references[index & 1];
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
        let goal = self.references[self.index & 1] + self.sense * self.plan.run_in();
        self.move_to(Phase::SlideBack, goal, self.plan.slide_speed);
    }

    /// Slides at constant speed; the last stretch before braking is the sliding level.
    fn slide(&mut self, input: &BacklashInput) {
        let arrived = self.profile.step();
        self.read_level(input);
        if arrived {
            self.end_slide();
        }
    }

    #[inline(always)]
    pub(super) fn read_level(&mut self, input: &BacklashInput) {
        if self.profile.left().abs() <= self.plan.level_from && self.profile.speed.abs() >= self.plan.slide_speed {
            let torque = self.sense * input.torque;
            if self.phase == Phase::SlideBack { self.after.add(torque) } else { self.before.add(torque) }
        }
    }

    #[cold]
    fn end_slide(&mut self) {
        if self.phase == Phase::SlideBack {
            let goal = self.references[self.index & 1] + self.sense * CREEP;
            self.move_to(Phase::SlideIn, goal, self.plan.slide_speed);
        } else {
            self.furthest = f64::INFINITY;
            self.slipped = false;
            self.move_to(Phase::CreepIn, self.references[self.index & 1], self.plan.feed.min(self.plan.slide_speed));
        }
    }

    /// The drive is wound up again, so slowly that it stays so at the turn.
    fn creep(&mut self, input: &BacklashInput) {
        let arrived = self.profile.step();
        self.see_furthest(input);
        if arrived {
            let bin = self.plan.bin;
            self.curve_mut().start(bin);
            self.enter(Phase::Settle, f64::from(self.plan.settle));
        }
    }

    /// At rest the position dithers by the encoder's grid, if at all.
    fn settle(&mut self, input: &BacklashInput) {
        self.see_change(input);
        self.see_furthest(input);
        // The curve is emptied while there is time: the last slices in the last cycles, the first one in the last.
        let slice = self.left.saturating_sub(1);
        self.curve_mut().clear(slice);
        if self.left == 1 {
            self.turn(input);
        }
    }

    /// Keeps the motor's furthest point before the scan: a servo that overshoots comes back from it, and may release the wind-up, before the
    /// scan begins.
    #[inline(always)]
    pub(super) fn see_furthest(&mut self, input: &BacklashInput) {
        self.furthest = self.furthest.min(self.sense * input.position_mm);
    }

    /// Keeps the smallest change of position seen between two cycles: the encoder's grid, once the axis creeps.
    #[inline(always)]
    pub(super) fn see_change(&mut self, input: &BacklashInput) {
        let change = (input.position_mm - self.last_position).abs();
        self.last_position = input.position_mm;
        if change > 0.0 && change < self.smallest_change {
            self.smallest_change = change;
        }
    }

    /// The rest before a reversal is over: checks the sliding levels and turns.
    fn turn(&mut self, input: &BacklashInput) {
        let change = self.after.mean() - self.before.mean();
        let error = (self.after.variance_of_mean() + self.before.variance_of_mean()).sqrt();
        const SIGMAS: f64 = 5.0;
        let (field, nm) = ("sliding_change_nm\0", self.plan.torque_nm);
        if change.abs() <= SIGMAS * error || error.is_infinite() {
            let (code, value, low) = (GIB_ERR_BACKLASH_NOISE, change.abs() * nm, SIGMAS * error * nm);
            return self.leave(Fault { code, field, value, low, high: f64::MAX });
        }
        if change < 0.0 {
            let (code, value) = (GIB_ERR_BACKLASH_TORQUE_SIGN, change * nm);
            return self.leave(Fault { code, field, value, low: 0.0, high: f64::MAX });
        }
        let samples = f64::from(self.after.batches().max(1)) * f64::from(self.plan.batch);
        let noise = (self.after.variance_of_mean() * samples).sqrt();
        self.watch = Watch::new(self.before.mean(), self.after.mean(), noise, self.plan.watch_gain, self.plan.limit);
        self.turn = input.position_mm;
        self.turn_command = self.profile.position;
        self.hold = self.plan.dwell;
        if self.plan.slow_feed {
            let goal = self.turn_command + self.sense * (self.plan.limit + self.plan.lag_limit);
            self.move_to(Phase::Scan, goal, self.plan.feed);
        } else {
            let steps = (self.plan.limit + self.plan.lag_limit) / self.plan.step + 2.0;
            self.enter(Phase::Scan, steps * f64::from(self.plan.dwell));
        }
    }

    /// One cycle of stepping or feeding away from the reversal.
    fn scan(&mut self, input: &BacklashInput) {
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
        let travel = self.sense * (input.position_mm - self.turn);
        if travel < -self.plan.stands() {
            return self.go_on(input);
        }
        let torque = self.sense * input.torque;
        self.curve_mut().add(travel, torque);
        self.watch.add(travel, torque, &self.plan);
        if over || (travel >= self.watch.end && self.watch.slides(travel, &self.plan)) {
            self.end_scan(input, travel);
        }
    }

    /// The motor still goes on in the old sense: a table that stuck has broken away in it, driven by what the servo had summed up. The
    /// curve begins anew where the motor turns.
    #[cold]
    fn go_on(&mut self, input: &BacklashInput) {
        let bin = self.plan.bin;
        let curve = self.curve_mut();
        let used = curve.used();
        // The new sense had no time yet for more than a cycle may empty.
        curve.clear(0);
        curve.start(bin);
        if used > curve::CLEAR_BINS {
            let (code, high) = (GIB_ERR_BACKLASH_SHAPE, 1e3 * bin * curve::CLEAR_BINS as f64);
            let value = 1e3 * bin * used as f64;
            return self.leave(Fault { code, field: "travel_before_slip_um\0", value, low: 0.0, high });
        }
        self.turn = input.position_mm;
        self.furthest = self.sense * self.turn;
        self.slipped = true;
        self.watch.again(self.plan.limit);
    }

    /// The curve of the present sense.
    #[inline(always)]
    pub(super) fn curve_mut(&mut self) -> &mut Curve {
        let [first, second] = &mut self.curves;
        if self.index == 0 { first } else { second }
    }

    /// The table slides, or the limit is reached before it did.
    #[cold]
    fn end_scan(&mut self, input: &BacklashInput, travel: f64) {
        let (found, low, limit) = (self.watch.highest, self.watch.low, self.plan.limit);
        let slides = travel < limit || (self.watch.highest_at < limit && travel >= self.watch.end);
        if found > low && slides {
            return self.probe_back(input);
        }
        self.leave(if found > low {
            let (code, high) = (GIB_ERR_BACKLASH_LIMIT, 1e3 * limit);
            Fault { code, field: "travel_um\0", value: 1e3 * travel, low: 0.0, high }
        } else {
            Fault { code: GIB_ERR_BACKLASH_NO_RISE, field: "torque_share\0", value: found, low, high: f64::MAX }
        });
    }

    /// Sliding is reached: will go back by a share of the way, where the table still sticks.
    #[cold]
    fn probe_back(&mut self, input: &BacklashInput) {
        let reached = self.sense * (input.position_mm - self.turn);
        let high_at = if self.watch.high_at > 0.0 { self.watch.high_at } else { reached };
        // A quarter of the way so far ends in the wind-up or in the clearance, where the table sticks.
        let depth = (0.25 * high_at).max(2.0 * self.plan.step);
        self.probe = Probe::new(depth, high_at);
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
                let field = "probe_way_mm\0";
                return self.leave(Fault {
                    code: GIB_ERR_BACKLASH_MOTOR_FRICTION,
                    field,
                    value: back,
                    low: 0.0,
                    high: deepest,
                });
            }
            let goal = self.profile.position + self.sense * self.probe_way();
            self.move_to(Phase::ProbeForth, goal, self.probe_feed());
        } else {
            self.probe.turn = input.position_mm;
            let goal = self.profile.position - self.sense * self.probe_way();
            self.move_to(Phase::ProbeBack, goal, self.probe_feed());
        }
    }

    /// Furthest that the command goes for the motor to go its depth: a slow servo trails by many times that, a stuck motor by any.
    fn probe_way(&self) -> f64 {
        const TRAILS: f64 = 25.0;
        self.plan.limit.min(self.plan.lag_limit).min(TRAILS * self.probe.depth)
    }

    /// Speed of the probe, mm per cycle. A servo that integrates trails a motor that winds a spring by about the way of one
    /// integral time, and as its command is brought back the motor springs forth by as much: the probe's way must take longer.
    fn probe_feed(&self) -> f64 {
        const WAY_S: f64 = 0.5;
        self.plan.feed.min(self.probe.depth / (WAY_S * self.plan.cycles_per_s))
    }

    /// One cycle of the probe. Friction on the motor's side is half the difference of the torque both ways at the
    /// same place.
    fn probe(&mut self, input: &BacklashInput) {
        let over = self.profile.step();
        self.see_change(input);
        let forth = self.phase == Phase::ProbeForth;
        let back = self.sense * (self.probe.turn - input.position_mm);
        self.probe.add(back, forth, self.sense * input.torque);
        let ended = self.probe.ended(back, forth);
        if ended || over {
            self.end_probe(input, back, over && !ended);
        }
    }

    #[cold]
    fn end_probe(&mut self, input: &BacklashInput, back: f64, over: bool) {
        if over {
            // Back it did not get to its depth, or forth not near to where it turned.
            let forth = self.phase == Phase::ProbeForth;
            let (low, high) = if forth { (0.0, self.probe.near) } else { (self.probe.depth, f64::MAX) };
            let (code, field) = (GIB_ERR_BACKLASH_MOTOR_FRICTION, "probe_way_mm\0");
            self.leave(Fault { code, field, value: back, low, high });
        } else if self.phase == Phase::ProbeBack {
            self.unwind(input, true);
        } else {
            self.profile.stop();
            let bound = self.profile.cycles_bound();
            self.enter(Phase::Rest, bound);
        }
    }

    /// All of one reversal is recorded.
    #[cold]
    fn probed(&mut self) {
        let (twice, twice_variance) = self.probe.difference();
        let motor = (0.5 * twice).max(0.0);
        if let Err(fault) = self.probe.check(twice, twice_variance, [self.before.mean(), self.after.mean()]) {
            return self.leave(fault);
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
        let curve = &self.curves[self.index & 1];
        for bin in bin..bin + PEAK_SLICE {
            if let Some((n, travel, torque)) = curve.point(bin) {
                self.peak.add(n, travel, torque);
            }
        }
        if bin + PEAK_SLICE >= curve.used() {
            // Where the table has slipped, nothing but the curve tells how far the drive is wound.
            let returned = Some(self.returned()).filter(|_| !self.slipped);
            self.fit.start(self.levels, 0.0, returned);
            self.enter(Phase::EvaluateFit, f64::from(Fit::slices_bound()));
        } else {
            self.phase = Phase::EvaluatePeak { bin: bin + PEAK_SLICE };
        }
    }

    /// The motor's way from its furthest point to where the curve begins, mm.
    fn returned(&self) -> f64 {
        (self.sense * self.turn - self.furthest).max(0.0)
    }

    /// One reversal is evaluated: next one, or the end.
    #[cold]
    fn conclude(&mut self) {
        let index = self.index;
        let sound = verdict::check_reversal(self.fit.result(), self.plan.torque_nm).and_then(|fitted| {
            verdict::check_release(&fitted, &self.levels, self.returned(), self.slipped, self.plan.bin)?;
            verdict::check_motor(&fitted, &self.levels, self.plan.torque_nm)?;
            verdict::check_load(&self.plan, &self.levels).map(|()| fitted)
        });
        let fitted = match sound {
            Ok(fitted) => fitted,
            Err(fault) => return self.leave(fault),
        };
        let steps = self.curves[index & 1].used() as f64 * self.plan.bin / self.plan.step;
        self.senses[index & 1].add(&fitted, &self.levels, self.peak.found(), steps);
        self.reversal += 1;
        let all = self.plan.senses * self.plan.repeats;
        self.output.progress_ratio = f64::from(self.reversal) / f64::from(all);
        let encoder = if self.plan.encoder > 0.0 { self.plan.encoder } else { self.smallest_change };
        let encoder = if encoder.is_finite() { encoder } else { 0.0 };
        self.estimates = verdict::estimates(&self.plan, encoder, &self.senses);
        if self.reversal < all {
            return self.next_reversal();
        }
        let (each, mean) = (&self.estimates.each, &self.estimates.mean);
        let amount = if self.plan.use_peak { mean.peak_um } else { mean.lost_motion_um };
        if let Err(fault) = verdict::check_result(&self.plan, encoder, each, mean, amount) {
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
