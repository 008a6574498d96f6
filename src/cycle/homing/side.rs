//! One motor on its way to the stop: what it is commanded, and whether it presses, stands, or cannot be trusted.
//!
//! Acceleration torque, a tight spot and noise are not a stop: the filtered torque must be at the limit while the
//! position stays within a small way for the whole detection time.

use super::plan::{Plan, STUCK_BLOCKS};
use super::trace::Trace;
use crate::cycle::profile::{Profile, higher, lower};
use crate::error::*;

/// Share of a new sample in the filtered torque: eight cycles.
pub const GAIN: f64 = 0.125;
/// Change of torque, as a share of the limit, that no standing encoder explains: a stop gives way by some counts of
/// the encoder. After a turn, friction on the motor's side may hold the motor while its torque changes sense.
const RIGID: f64 = 0.3;
const RIGID_AFTER_TURN: f64 = 0.8;
/// Share of the limit at which the torque counts as off, and how steeply the command answers to more.
const RELIEVED: f64 = 0.2;
const RELIEF: f64 = 5.0;

/// How a touch stands after a cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Touch {
    /// On the way.
    Going,
    /// The torque is at the limit.
    Held,
    /// It has been for the detection time, at a stand.
    Pressed,
    /// The command is at its goal and nothing was touched.
    Arrived,
    /// The sensors contradict each other.
    Broken,
}

/// One motor: plain data.
#[derive(Debug, Clone, Default)]
pub struct Side {
    /// The command.
    pub profile: Profile,
    /// Cycles for which the command surely goes on at its speed, far from any bound of way and time; the lag about
    /// which they count as usual, and by how much it may differ.
    cruise: i32,
    granted: u32,
    usual_lag: f64,
    lag_band: f64,
    /// The same for a cycle that is not at constant speed, and the filtered torque within which it counts as usual.
    slow: u32,
    low: f64,
    high: f64,
    /// Where homing began, mm.
    pub start: f64,
    /// Where the present touch began, mm.
    pub origin: f64,
    /// Where the present move began, mm.
    from: f64,
    /// Last measured position, mm.
    pub position: f64,
    /// Torque toward the stop, filtered.
    pub filtered: f64,
    /// Lowest of it on the way back, and the last while it slid back steadily.
    lowest: f64,
    sliding: f64,
    /// The torque as it was read last.
    reading: f64,
    /// Cycles since the position changed, how many are too many, and the torque when it last changed.
    frozen: u32,
    frozen_limit: u32,
    free: [f64; 2],
    /// Torque at which `held` changes.
    trip: f64,
    held: bool,
    /// Something was pressed on and has not been left since.
    pressing: bool,
    anchor: f64,
    standing: u32,
    /// Torque against way of the present touch.
    pub trace: Trace,
}

impl Side {
    /// The axis stands at `position`.
    pub fn begin(&mut self, plan: &Plan, position: f64) {
        self.profile = Profile::at_rest(position, plan.acceleration);
        self.start = position;
        self.position = position;
        self.filtered = 0.0;
    }

    /// Way gone toward the stop since the start.
    #[must_use]
    pub fn travel(&self, plan: &Plan) -> f64 {
        plan.sense * (self.position - self.start)
    }

    /// Begins a touch at `speed` (mm per cycle) that ends `reach` from the start at the latest.
    pub fn start_touch(&mut self, plan: &Plan, speed: f64, reach: f64) {
        self.origin = self.position;
        self.from = self.position;
        self.profile.go(self.start + plan.sense * reach, speed);
        self.trace.start(plan.block(speed), self.position, plan.sense, plan.torque_sense);
        self.frozen = 0;
        self.frozen_limit = plan.frozen(speed);
        self.free = [self.reading, self.filtered];
        self.held = false;
        self.pressing = false;
        self.trip = plan.threshold;
        self.standing = 0;
    }

    /// Whether this cycle's readings are within all bounds.
    #[inline(always)]
    pub fn safe(&self, plan: &Plan, position: f64, torque: f64) -> bool {
        (self.profile.position - position).abs() <= plan.lag_limit
            && (position - self.position).abs() <= plan.jump
            && plan.sense * (position - self.start) <= plan.distance[1]
            && torque.is_finite()
            && self.filtered.abs() <= plan.bound
    }

    /// Which bound is broken.
    #[cold]
    pub fn name_danger(&self, plan: &Plan, position: f64, torque: f64) -> Fault {
        let fault = |code, field, value, low, high| Fault { code, field, value, low, high };
        for (field, value) in [("position_mm\0", position), ("torque\0", torque)] {
            if !value.is_finite() {
                return fault(GIB_ERR_NON_FINITE, field, value, f64::MIN, f64::MAX);
            }
        }
        let lag = self.profile.position - position;
        if self.filtered.abs() > plan.bound {
            // A bound three standard deviations off was broken by the sensor, not by the drive.
            let code = if self.noisy(plan) { GIB_ERR_HOMING_NOISE } else { GIB_ERR_TORQUE_BOUND };
            fault(code, "torque\0", torque, -plan.bound, plan.bound)
        } else if (position - self.position).abs() > plan.jump {
            fault(GIB_ERR_HOMING_ENCODER, "position_mm\0", position - self.position, -plan.jump, plan.jump)
        } else if lag.abs() > plan.lag_limit {
            self.contradiction(plan, fault(GIB_ERR_LAG, "position_mm\0", lag, -plan.lag_limit, plan.lag_limit))
        } else {
            let way = plan.sense * (position - self.start);
            fault(GIB_ERR_TRAVEL_BOUND, "position_mm\0", way, 0.0, plan.distance[1])
        }
    }

    /// The axis does not follow: the torque sensor's fault if it says that nothing holds the axis, a tight spot if it
    /// is held on the way back.
    fn contradiction(&self, plan: &Plan, otherwise: Fault) -> Fault {
        if self.back(plan) && self.filtered < -0.5 * plan.threshold {
            let (code, field) = (GIB_ERR_HOMING_TIGHT_SPOT, "torque\0");
            return Fault { code, field, value: self.filtered, low: 0.0, high: plan.limit };
        }
        self.torque_fault(plan).unwrap_or(otherwise)
    }

    /// Which sensor is to blame for a touch or move that is [`Touch::Broken`].
    #[cold]
    pub fn broken_sensor(&self, plan: &Plan) -> Fault {
        if 3.0 * self.trace.noise() > RIGID * plan.limit {
            return Fault { value: self.reading, field: "torque\0", ..Fault::of(GIB_ERR_HOMING_NOISE) };
        }
        let encoder = Fault { field: "position_mm\0", value: self.position, ..Fault::of(GIB_ERR_HOMING_ENCODER) };
        self.torque_fault(plan).unwrap_or(encoder)
    }

    /// What is wrong with the torque of an axis that stands against its command, if anything.
    fn torque_fault(&self, plan: &Plan) -> Option<Fault> {
        let fault = |code, field, value| Some(Fault { code, field, value, low: 0.0, high: plan.limit });
        if self.trace.stuck(STUCK_BLOCKS) {
            fault(GIB_ERR_HOMING_TORQUE_STUCK, "torque\0", self.reading)
        } else if self.filtered < -0.5 * plan.threshold && !self.back(plan) {
            fault(GIB_ERR_HOMING_TORQUE_SIGN, "torque_inverted\0", self.filtered)
        } else {
            None
        }
    }

    /// Whether the command leads away from the stop.
    fn back(&self, plan: &Plan) -> bool {
        plan.sense * (self.profile.position + self.profile.left() - self.position) < 0.0
    }

    /// Whether the torque tolerance is less than three standard deviations of a reading.
    fn noisy(&self, plan: &Plan) -> bool {
        3.0 * self.trace.noise() > plan.bound - plan.limit
    }

    /// Takes in a cycle's readings.
    #[inline(always)]
    pub fn sense(&mut self, plan: &Plan, position: f64, torque: f64) {
        if self.frozen == 0 {
            self.free = [self.reading, self.filtered];
        }
        self.filtered += GAIN * (plan.torque_sense * torque - self.filtered);
        self.reading = torque;
        if position == self.position {
            self.frozen = self.frozen.saturating_add(1);
        } else {
            self.frozen = 0;
        }
        self.position = position;
    }

    /// One cycle in a few instructions, for one that is like the one before: at constant speed, encoder and torque
    /// alive, all within bounds. False when it is not; nothing has changed then. The bounds are those of [`Side::safe`];
    /// those of way and time are in `cruise`, those of lag and jump in `lag_band`.
    #[inline(always)]
    pub fn quick(&mut self, plan: &Plan, position: f64, torque: f64) -> bool {
        let filtered = (1.0 - GAIN) * self.filtered + plan.torque_share * torque;
        let lag = self.profile.position - position;
        // Written so that a NaN is not usual.
        // Counted down first: that takes the fewest instructions.
        self.cruise -= 1;
        let usual = self.cruise >= 0
            && (lag - self.usual_lag).abs() <= self.lag_band
            && position != self.position
            && filtered > plan.bound_below
            && filtered < self.trip;
        if !usual {
            self.cruise += 1;
            return false;
        }
        self.take_in(position, torque, filtered);
        self.profile.cruise_on();
        true
    }

    /// The same where the command speeds up or brakes, the motor sticks, or it stands pressed.
    #[inline(always)]
    pub fn quick_slow(&mut self, plan: &Plan, position: f64, torque: f64) -> bool {
        let filtered = (1.0 - GAIN) * self.filtered + plan.torque_share * torque;
        let goes_on = if self.held {
            (position - self.anchor).abs() <= plan.standing_way
        } else {
            (position != self.position) != (self.frozen > 0)
        };
        let usual = self.slow != 0
            && self.safe(plan, position, torque)
            && filtered > self.low
            && filtered < self.high
            && goes_on;
        if !usual {
            return false;
        }
        self.slow -= 1;
        self.take_in(position, torque, filtered);
        if !self.held || self.standing < plan.hold {
            self.profile.step();
        }
        true
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

    /// Cycles that went by in [`Side::quick`] and [`Side::quick_slow`] since the last [`Side::look_ahead`].
    #[inline(always)]
    #[must_use]
    pub fn quick_cycles(&self) -> u32 {
        self.granted - self.cruise as u32 - self.slow
    }

    /// Ends what [`Side::look_ahead`] has granted.
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
    pub fn look_ahead(&mut self, plan: &Plan, left: u32) {
        let p = &self.profile;
        let (way, speed) = (p.left().abs(), p.speed_max());
        if p.cruises() && !self.held && self.frozen == 0 {
            // The axis may lead its command by the largest lag.
            let to_end = plan.distance[1] - plan.sense * (p.position - self.start);
            let away = p.speed * plan.sense < 0.0;
            let free = lower(way - p.braking() - 2.0 * speed, if away { way } else { to_end - plan.lag_limit });
            // Between two lags of the band the position changes by no more than a jump, nor goes beyond the end.
            self.usual_lag = p.position - p.speed - self.position;
            let to_limit = lower(plan.lag_limit - self.usual_lag.abs(), plan.distance[1] - self.travel(plan));
            self.lag_band = lower(0.5 * (plan.jump - speed), to_limit);
            self.granted = ((free / speed) as u32).min(left).min(i32::MAX as u32);
            self.cruise = self.granted as i32;
            return;
        }
        (self.low, self.high) = (plan.bound_below, self.trip);
        self.granted = ((way / speed - 4.0 - 2.0 * plan.acceleration / speed) as u32).min(left);
        if self.held {
            (self.low, self.high) = (plan.release, plan.bound);
            self.frozen = 0;
            let next = if self.standing < plan.hold { plan.hold } else { plan.detection };
            self.granted = next.saturating_sub(self.standing + 1).min(left);
        } else if self.frozen > 0 {
            // Within this no encoder is at fault, see `rigid`.
            let most = 0.5 * RIGID * plan.limit;
            self.low = higher(self.low, self.free[1] - most);
            self.high = lower(self.high, self.free[1] + most);
            self.granted = self.granted.min(self.frozen_limit.saturating_sub(self.frozen));
        }
        self.slow = self.granted;
    }

    /// One cycle of a touch, after [`Side::sense`].
    #[inline(always)]
    pub fn touch(&mut self, plan: &Plan) -> Touch {
        if self.frozen > 0 && self.rigid(plan) {
            return Touch::Broken;
        }
        if self.filtered >= self.trip {
            return self.press(plan);
        }
        if self.held {
            self.held = false;
            self.pressing = false;
            self.trip = plan.threshold;
            self.trace.resume();
        }
        self.trace.add(self.position, self.reading);
        if self.profile.step() { Touch::Arrived } else { Touch::Going }
    }

    /// The encoder stands. Whether it should not: the command has gone on for long, or the torque has changed as on
    /// something infinitely rigid. Both the reading and its filtered value must say so: one is noisy, one is late.
    #[must_use]
    pub fn rigid(&self, plan: &Plan) -> bool {
        let under_way = (self.position - self.from).abs() > 0.25 * plan.retract;
        let never_moved = self.position == self.start && self.filtered >= plan.threshold;
        let share = if under_way { RIGID } else { RIGID_AFTER_TURN };
        let most = share * plan.limit;
        let changed = (self.reading - self.free[0]).abs() > most && (self.filtered - self.free[1]).abs() > 0.5 * most;
        let long = under_way && self.frozen > self.frozen_limit && self.filtered.abs() < plan.release;
        never_moved || changed || long
    }

    /// The torque is at the limit. The command goes on until the axis stands, so that an acceleration at the limit is
    /// not broken off.
    #[cold]
    fn press(&mut self, plan: &Plan) -> Touch {
        if !self.held {
            self.held = true;
            self.pressing = true;
            self.trace.pause();
            self.trip = plan.release;
            self.anchor = self.position;
            self.standing = 0;
        }
        self.standing += 1;
        if (self.position - self.anchor).abs() > plan.standing_way {
            self.anchor = self.position;
            self.standing = 0;
        }
        if self.standing < plan.hold {
            self.profile.step();
        } else {
            self.profile.speed = 0.0;
        }
        if self.standing >= plan.detection { Touch::Pressed } else { Touch::Held }
    }

    /// Begins a move to `goal` and returns the cycles that it takes at most. The trace stays that of the touch before.
    pub fn go(&mut self, plan: &Plan, goal: f64, speed: f64) -> f64 {
        self.trace.pause();
        self.profile.go(goal, speed);
        self.trip = plan.bound;
        self.held = false;
        self.lowest = self.filtered;
        self.sliding = f64::NEG_INFINITY;
        self.from = self.position;
        self.frozen = 0;
        self.free = [self.reading, self.filtered];
        self.profile.cycles_bound()
    }

    /// One cycle of a move, after [`Side::sense`]: arrived, going, or broken.
    #[inline(always)]
    pub fn follow(&mut self, plan: &Plan) -> Touch {
        self.lowest = lower(self.lowest, self.filtered);
        if self.frozen > 0 && self.profile.speed != 0.0 && self.rigid(plan) {
            return Touch::Broken;
        }
        if self.profile.cruises() {
            self.sliding = self.filtered;
        }
        if self.profile.step() { Touch::Arrived } else { Touch::Going }
    }

    /// One cycle of taking the torque off a motor that does not move: the command goes against the torque, the faster
    /// the more there is, so that the servo's integral runs down. True when the torque is off.
    pub fn relieve(&mut self, plan: &Plan) -> bool {
        let off = self.filtered.abs() <= RELIEVED * plan.limit;
        let speed = -plan.sense * plan.approach * (RELIEF * self.filtered / plan.limit).clamp(-1.0, 1.0);
        self.profile = Profile::at_rest(self.profile.position + speed, plan.acceleration);
        self.standing = if off { self.standing + 1 } else { 0 };
        self.standing >= plan.hold
    }

    /// The axis is where its command is, nearly.
    #[must_use]
    pub fn settled(&self, plan: &Plan) -> bool {
        (self.profile.position - self.position).abs() <= 0.1 * plan.press_max
    }

    /// Whether the axis was held where its way back began as it was on its way in: a tight spot takes as much torque
    /// above what sliding takes both ways, or does not let go at all. `level`: torque before contact. Nothing is said of
    /// a way back too short to slide steadily.
    #[must_use]
    pub fn held_back(&self, plan: &Plan, level: f64) -> Option<Fault> {
        let (above, high) = (self.sliding - self.lowest, 0.5 * (plan.threshold - level));
        let stayed = plan.sense * (self.position - self.profile.position) > 0.5 * plan.retract;
        let fault = Fault { code: GIB_ERR_HOMING_TIGHT_SPOT, field: "torque\0", value: -self.lowest, low: 0.0, high };
        (above > high || stayed).then_some(fault)
    }

    /// Whether something is pressed on.
    #[must_use]
    pub fn pressing(&self) -> bool {
        self.pressing
    }

    /// Drops the undone way: the command is where the axis is.
    pub fn clear_lag(&mut self, plan: &Plan) {
        self.profile = Profile::at_rest(self.position, plan.acceleration);
    }
}
