//! The cycles of a single motor that are like the one before, in a few instructions. Which may come is looked ahead to in the
//! steps between. Those of a gantry are in `machine/quick.rs`: lanes cost one motor more than they save.

use super::blame::RIGID;
use super::*;

impl Side {
    /// One cycle in a few instructions, for one that is like the one before: at constant speed, encoder and torque
    /// alive, all within bounds. False when it is not: [`Side::quick_slow`] must follow. The bounds are those of [`Side::safe`];
    /// those of way and time are in `cruise`, those of lag and jump in `lag_band`.
    #[inline(always)]
    pub fn quick(&mut self, plan: &Plan, position: f64, torque: f64, odd: u64) -> bool {
        let filtered = (1.0 - GAIN) * self.filtered + plan.torque_share * torque;
        let lag = self.profile.position - position;
        // Counted down first: that takes the fewest instructions. Written so that a NaN is not usual.
        self.cruise -= 1;
        let usual = self.cruise >= 0
            && (lag - self.usual_lag).abs() <= self.lag_band
            && position != self.position
            && odd == 0
            && filtered > plan.bound_below
            && !(filtered >= self.trip);
        if usual {
            self.take_in(position, torque, filtered);
            self.profile.cruise_on();
        }
        usual
    }

    /// The same where the command speeds up or brakes, the motor sticks, or it stands pressed. Comes after a
    /// [`Side::quick`] that was false, and takes back what that has counted.
    #[inline(always)]
    pub fn quick_slow(&mut self, plan: &Plan, position: f64, torque: f64, odd: u64) -> bool {
        self.cruise += 1;
        let filtered = (1.0 - GAIN) * self.filtered + plan.torque_share * torque;
        if self.cruise > 0 {
            return self.quick_lag(plan, position, torque, filtered, odd);
        }
        let goes_on = if self.held {
            (position - self.anchor).abs() <= plan.standing_way
        } else {
            (position != self.position) != (self.frozen > 0)
        };
        let usual = self.slow != 0
            && odd == 0
            && self.safe(plan, position, torque)
            && filtered > self.low
            && filtered < self.high
            && goes_on;
        if !usual {
            return false;
        }
        self.slow -= 1;
        self.watch(position, torque);
        self.take_in(position, torque, filtered);
        if !self.held || self.standing < plan.hold {
            self.profile.step();
        }
        true
    }

    /// The same where the command goes on at its speed and only the lag has left its band: it counts as usual from now on,
    /// where it is within all bounds.
    #[inline(always)]
    fn quick_lag(&mut self, plan: &Plan, position: f64, torque: f64, filtered: f64, odd: u64) -> bool {
        let usual = odd == 0
            && self.safe(plan, position, torque)
            && filtered > plan.bound_below
            && filtered < self.trip
            && position != self.position;
        if usual {
            self.cruise -= 1;
            self.take_in(position, torque, filtered);
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

    #[inline(always)]
    fn take_in(&mut self, position: f64, torque: f64, filtered: f64) {
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
    pub fn look_no_further(&mut self) {
        let gone = self.quick_cycles();
        if self.held {
            self.standing += gone;
        } else if self.frozen > 0 {
            self.frozen += gone;
        }
        (self.cruise, self.slow, self.granted) = (0, 0, 0);
    }

    /// Counts the cycles for which [`Side::quick`] or [`Side::quick_slow`] may go on, at most `left`; after a cycle's
    /// step of the command. The last of a move is left to the other steps.
    #[inline(always)]
    pub fn grant(&mut self, plan: &Plan, left: u32) {
        let p = &self.profile;
        let (way, speed) = (p.left().abs(), p.speed_max());
        if p.cruises() && !self.held && self.frozen == 0 {
            // The axis may lead its command by the largest lag.
            let to_end = plan.distance[1] - plan.sense * (p.position - self.start);
            let away = p.speed * plan.sense < 0.0;
            let free = lower(way - p.braking() - 2.0 * speed, if away { way } else { to_end - plan.lag_limit });
            let lag = p.position - p.speed - self.position;
            self.centre(plan, lag);
            self.granted = ((free / speed) as u32).min(left).min(i32::MAX as u32);
            self.cruise = self.granted as i32;
            return;
        }
        (self.low, self.high) = (plan.bound_below, self.trip);
        self.granted = ((way / speed - 4.0 - 2.0 * plan.acceleration / speed) as u32).min(left);
        // Once the command has its speed the cycles are cheaper.
        let lacks = speed - p.speed.copysign(p.speed * p.left());
        if way > p.braking() && lacks > 0.0 {
            self.granted = self.granted.min((lacks / plan.acceleration) as u32);
        }
        if self.held {
            (self.low, self.high) = (plan.release, plan.bound);
            let next = if self.standing < plan.hold { plan.hold } else { plan.detection };
            let reads_on = u32::from(self.reads_on(plan));
            self.granted = reads_on * next.saturating_sub(self.standing + 1).min(left);
        } else if self.frozen > 0 {
            // Within this no encoder is at fault, see `rigid`.
            let most = 0.5 * RIGID * plan.limit;
            self.low = higher(self.low, self.free[1] - most);
            self.high = lower(self.high, self.free[1] + most);
            self.granted = self.granted.min(self.frozen_limit.saturating_sub(self.frozen));
        }
        self.slow = self.granted;
    }
}
