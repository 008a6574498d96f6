//! The cycles of a single motor that are like the one before, in a few instructions. Which may come is looked ahead to in the
//! steps between. Those of a gantry are in `machine/quick.rs`: lanes cost one motor more than they save.

use super::blame::RIGID;
use super::*;

impl Side {
    /// One cycle in a few instructions, for one that is like the one before: at constant speed, encoder and torque
    /// alive, all within bounds. False when it is not: [`Side::quick_slow`] must follow. The bounds are those of [`Side::safe`];
    /// those of way and time are in `cruise`, those of lag and jump in `lag_band`. `target`: the command's position, which it leaves to be
    /// advanced.
    #[inline(always)]
    pub fn quick(&mut self, plan: &Plan, target: f64, [position, torque]: [f64; 2], odd: u64) -> bool {
        let filtered = self.filter(plan, torque);
        let lag = target - position;
        // Counted down first: that takes the fewest instructions. Written so that a NaN is not usual.
        self.cruise -= 1;
        let usual = self.cruise >= 0
            && (lag - self.usual_lag).abs() <= self.lag_band
            && position != self.position
            && odd == 0
            && filtered > plan.bound_below
            && !(filtered >= self.trip);
        if usual {
            self.add(position, torque, filtered);
        }
        usual
    }

    /// The same where the command speeds up or brakes, the motor sticks, or it stands pressed. Comes after a
    /// [`Side::quick`] that was false, and takes back what that has counted.
    #[inline(always)]
    pub fn quick_slow(&mut self, plan: &Plan, position: f64, torque: f64, odd: u64) -> bool {
        self.cruise += 1;
        let filtered = self.filter(plan, torque);
        // Bounds of the filtered torque leave out what is no number.
        if odd != 0 || !self.near(plan, position) {
            return false;
        }
        if self.cruise > 0 {
            return self.quick_lag(plan, position, torque, filtered);
        }
        if self.slow == 0 || !(filtered > self.low) || !(filtered < self.high) || !self.stays(plan, position) {
            return false;
        }
        self.slow -= 1;
        self.watch(position, torque);
        self.add(position, torque, filtered);
        if self.rate != 0.0 {
            self.profile.speed += self.rate;
            self.profile.cruise_on();
        } else if self.goes_on(plan) {
            self.profile.step_under_way();
        }
        true
    }

    /// Whether a motor goes on as it did: pressed at its place, moving or standing.
    #[inline(always)]
    fn stays(&self, plan: &Plan, position: f64) -> bool {
        if self.held {
            (position - self.anchor).abs() <= plan.standing_way
        } else {
            (position != self.position) != (self.frozen > 0)
        }
    }

    /// The same where the command goes on at its speed and only the lag has left its band: it counts as usual from now on,
    /// where it is within all bounds.
    #[inline(always)]
    fn quick_lag(&mut self, plan: &Plan, position: f64, torque: f64, filtered: f64) -> bool {
        let usual = filtered > plan.bound_below && filtered < self.trip && position != self.position;
        if usual {
            self.cruise -= 1;
            self.add(position, torque, filtered);
            self.centre(plan, self.profile.position - position);
            self.profile.cruise_on();
        }
        usual
    }

    /// Makes `lag`, that of this cycle, the usual one. Between two lags of the band about it the position changes by no more
    /// than a jump, nor goes beyond the end.
    #[inline(always)]
    fn centre(&mut self, plan: &Plan, lag: f64) {
        self.usual_lag = lag;
        let to_limit = lower(plan.lag_limit - lag.abs(), plan.distance[1] - self.travel(plan));
        self.lag_band = lower(0.5 * (plan.jump - self.profile.speed_max()), to_limit);
    }

    /// The filtered torque with a reading more.
    #[inline(always)]
    #[must_use]
    pub fn filter(&self, plan: &Plan, torque: f64) -> f64 {
        (1.0 - GAIN) * self.filtered + plan.torque_share * torque
    }

    #[inline(always)]
    fn add(&mut self, position: f64, torque: f64, filtered: f64) {
        self.filtered = filtered;
        self.reading = torque;
        self.position = position;
        // A trace is kept of touches, the lowest torque of the way back.
        if !self.trace.add(position, torque) {
            self.lowest = lower(filtered, self.lowest);
        }
    }

    /// Cycles that went by in [`Side::quick`] and [`Side::quick_slow`] since the last [`Side::grant`].
    #[inline(always)]
    #[must_use]
    pub fn quick_cycles(&self) -> u32 {
        self.granted - self.cruise as u32 - self.slow
    }

    /// Ends what [`Side::grant`] has granted.
    #[inline(always)]
    pub fn look_no_further(&mut self, plan: &Plan) {
        let gone = self.quick_cycles();
        self.sliding = if self.slides && gone > 0 { self.filtered } else { self.sliding };
        if self.listens_not {
            let (first, last) = (self.heard_first, self.heard_now(plan));
            self.hear_again(gone, first, last);
        }
        self.quieten();
        if self.held {
            self.standing += gone;
        } else if self.frozen > 0 {
            self.frozen += gone;
        }
        (self.cruise, self.slow, self.granted, self.listens_not) = (0, 0, 0, false);
    }

    /// Counts the cycles for which [`Side::quick`] or [`Side::quick_slow`] may go on, at most `left`; after a cycle's
    /// step of the command. The last of a move is left to the other steps.
    #[inline(always)]
    pub fn grant(&mut self, plan: &Plan, left: u32) {
        if self.arrives(plan) {
            return;
        }
        let ahead = self.look_ahead(plan);
        let cruises = !self.held && self.profile.cruises();
        self.slides = cruises && self.trace.paused();
        self.listens_not = cruises && self.frozen == 0;
        self.heard_first = self.heard_now(plan);
        if self.listens_not {
            self.centre(plan, self.profile.position - self.profile.speed - self.position);
            self.granted = ahead.cruise.min(left).min(i32::MAX as u32);
            self.cruise = self.granted as i32;
            return;
        }
        (self.low, self.high, self.rate) = (higher(ahead.low, plan.bound_below), ahead.high, ahead.rate);
        // What comes once the command has its speed, or is to brake, is granted anew.
        let alike = match () {
            () if cruises => ahead.cruise,
            () if ahead.rate != 0.0 => ahead.speeding,
            () => ahead.cycles,
        };
        self.granted = ahead.cycles.min(alike).min(left);
        if self.frozen > 0 && !self.held {
            // Within this no encoder is at fault, see `rigid`.
            let most = 0.5 * RIGID * plan.limit;
            self.low = higher(self.low, self.free[1] - most);
            self.high = lower(self.high, self.free[1] + most);
            self.granted = self.granted.min(self.frozen_limit.saturating_sub(self.frozen));
        }
        self.slow = self.granted;
    }

    /// Bounds within which nothing is wrong with a motor that rests, however it goes there: those of [`Side::safe`], and those of
    /// [`Side::wound_up`] or, where its deviation was cleared while it was pressed, of [`Side::gives_way`], with the way `press`. Whether it is
    /// within them now.
    pub fn see_rest(&mut self, plan: &Plan, now: u32, press: Option<f64>) -> bool {
        (self.moved, self.heard) = (now.wrapping_sub(self.frozen), now.wrapping_sub(self.same));
        if self.frozen == 0 {
            self.free = [self.reading, self.filtered];
        }
        self.centre(plan, self.profile.position - self.position);
        (self.low, self.high) = (-plan.bound, plan.bound);
        if let Some(press) = press {
            let left = press + plan.standing_way - plan.sense * (self.position - self.anchor);
            self.lag_band = lower(self.lag_band, left);
        } else {
            // Any two torques within it differ by too little to wind an encoder up that stands, or has stood.
            let most = 0.5 * RIGID * plan.limit;
            let band = lower(0.5 * most, most - (self.filtered - self.free[1]).abs());
            self.low = higher(self.low, self.filtered - band);
            self.high = lower(self.high, self.filtered + band);
        }
        self.lag_band >= 0.0 && self.filtered > self.low && self.filtered < self.high
    }

    /// Whether readings are still within these bounds. What is no number is not.
    #[inline(always)]
    #[must_use]
    pub fn rests(&self, position: f64, filtered: f64) -> bool {
        let near = || (self.profile.position - position - self.usual_lag).abs() <= self.lag_band;
        (position == self.position || near()) && filtered > self.low && filtered < self.high
    }

    /// Takes in readings that are, in cycle `now`.
    #[inline(always)]
    pub fn take_in_at_rest(&mut self, plan: &Plan, now: u32, [position, torque]: [f64; 2], filtered: f64) {
        self.bend(plan, torque);
        if position != self.position {
            (self.position, self.moved, self.free) = (position, now, [torque, filtered]);
        }
        if torque != self.reading {
            (self.reading, self.heard, self.changed_at) = (torque, now, position);
        }
        self.filtered = filtered;
    }

    /// Ends the rest in cycle `now`.
    pub fn end_rest(&mut self, now: u32) {
        (self.frozen, self.same) = (now.wrapping_sub(self.moved), now.wrapping_sub(self.heard));
    }
}
