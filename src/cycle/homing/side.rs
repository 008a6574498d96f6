//! One motor on its way to the stop: what it is commanded, and whether it presses, stands, or cannot be trusted.
//!
//! Acceleration torque, a tight spot and noise are not a stop: the filtered torque must be at the limit while the
//! position stays within a small way for the whole detection time.

use super::plan::{Plan, STUCK_BLOCKS};
use super::trace::Trace;
use crate::cycle::profile::{Profile, higher, lower};
use crate::error::*;

mod ahead;
mod blame;
mod quick;

pub use ahead::{Ahead, Caught};
pub use blame::{RIGID, RIGID_AFTER_TURN, UNDER_WAY};

/// Share of a new sample in the filtered torque: eight cycles.
pub const GAIN: f64 = 0.125;
/// The same for how much its changes differ.
pub const ROUGH_GAIN: f64 = 1.0 / 16.0;
/// Share of the limit at which the torque counts as off, and how steeply the command answers to more.
const RELIEVED: f64 = 0.2;
/// Share of the torque at which it counts as limiting that is too much to be left on.
const LIGHT: f64 = 0.4;
const RELIEF: f64 = 5.0;
/// Share of the bound beyond which a torque reading counts as that.
const BEYOND: f64 = 3.0 / GAIN;

/// How a touch stands after a cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Touch {
    /// On the way.
    Going,
    /// The torque is at the limit.
    Held,
    /// It has been for the detection time, at a stand.
    Pressed,
    /// The command is at its goal, the axis stands, and nothing was touched.
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
    /// All of them are at constant speed, on the way back or to the zero offset.
    slides: bool,
    /// In none of them anybody looks whether the torque changes; what it was before, and filtered.
    listens_not: bool,
    heard_first: [f64; 2],
    /// The same for a cycle that is not at constant speed, and the filtered torque within which it counts as usual.
    slow: u32,
    low: f64,
    high: f64,
    /// Change of the command's speed in each of them, where that is always the same; else 0.
    rate: f64,
    /// Of one that rests, the cycles in which position and torque reading changed last.
    moved: u32,
    heard: u32,
    /// Where homing began, mm.
    pub start: f64,
    /// Where the present touch began, mm.
    pub origin: f64,
    /// Where the present move began, mm.
    pub(super) from: f64,
    /// Last measured position, mm.
    pub position: f64,
    /// Torque toward the stop, filtered.
    pub filtered: f64,
    /// Lowest of it on the way back.
    pub(super) lowest: f64,
    /// The last of it while it slid back steadily.
    pub sliding: f64,
    /// The torque as it was read last, for how many cycles, where the axis was when it last changed, its last change and
    /// the mean of how much that differs from the one before.
    pub(super) reading: f64,
    pub(super) same: u32,
    pub(super) changed_at: f64,
    pub(super) change: f64,
    pub(super) rough: f64,
    /// Cycles since the position changed, how many are too many, and the torque when it last changed.
    pub(super) frozen: u32,
    pub(super) frozen_limit: u32,
    pub(super) free: [f64; 2],
    /// Torque at which `held` changes.
    trip: f64,
    pub(super) held: bool,
    /// The torque was at the limit before the touch had begun.
    loaded: bool,
    /// It was moving when it began to brake on the way out.
    moving: bool,
    /// Something was pressed on and has not been left since.
    pressing: bool,
    pub(super) anchor: f64,
    standing: u32,
    /// Torque toward the stop with which the axis is free.
    holds: f64,
    /// Of the speed with which torque is taken off, and the last of it.
    relief: f64,
    relieving: f64,
    /// Torque against way of the present touch.
    pub trace: Trace,
}

impl Side {
    /// The axis stands at `position`.
    pub fn begin(&mut self, plan: &Plan, position: f64) {
        self.profile = Profile::at_rest(position, plan.acceleration);
        self.start = position;
        self.position = position;
        self.changed_at = position;
        self.filtered = 0.0;
        self.holds = 0.0;
        self.rough = 0.0;
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
        self.loaded = plan.torque_sense * self.reading >= plan.threshold;
        self.held = false;
        self.pressing = false;
        self.trip = plan.threshold;
        self.standing = 0;
    }

    /// Whether this cycle's readings are within all bounds.
    #[inline(always)]
    pub fn safe(&self, plan: &Plan, position: f64, torque: f64) -> bool {
        self.near(plan, position) && torque.is_finite() && self.filtered.abs() <= plan.bound
    }

    /// Whether the position is within all bounds.
    #[inline(always)]
    fn near(&self, plan: &Plan, position: f64) -> bool {
        (position - self.position).abs() <= plan.jump && self.placed(plan, position)
    }

    /// The same, but for a jump that a motor makes whose torque is taken off while it is pressed: drive and stop, which give
    /// way by `press` until the torque is limiting, push it back from its anchor by no more than three times that.
    #[must_use]
    pub fn springs_back(&self, plan: &Plan, position: f64, torque: f64, press: f64) -> bool {
        let back = plan.sense * (self.anchor - position);
        (-plan.jump..=3.0 * press + plan.jump).contains(&back)
            && self.placed(plan, position)
            && torque.is_finite()
            && self.filtered.abs() <= plan.bound
    }

    #[inline(always)]
    fn placed(&self, plan: &Plan, position: f64) -> bool {
        (self.profile.position - position).abs() <= plan.lag_limit
            && plan.sense * (position - self.start) <= plan.distance[1]
    }

    /// Takes in a cycle's readings. What no drive can give counts as so much that it breaks the bound in one cycle, and no more:
    /// the filter must not hold it for long, nor overflow.
    #[inline(always)]
    pub fn sense(&mut self, plan: &Plan, position: f64, torque: f64) {
        let most = BEYOND * plan.bound;
        let torque = lower(higher(torque, -most), most);
        if self.frozen == 0 {
            self.free = [self.reading, self.filtered];
        }
        self.filtered += GAIN * (plan.torque_sense * torque - self.filtered);
        self.hear(plan, position, torque);
        if position == self.position {
            self.frozen = self.frozen.saturating_add(1);
        } else {
            self.frozen = 0;
        }
        self.position = position;
    }

    /// Takes note of whether the torque reading is alive, and how noisy.
    #[inline(always)]
    fn hear(&mut self, plan: &Plan, position: f64, torque: f64) {
        self.bend(plan, torque);
        self.watch(position, torque);
        self.reading = torque;
    }

    /// Takes note of how noisy the torque reading is.
    #[inline(always)]
    fn bend(&mut self, plan: &Plan, torque: f64) {
        let change = torque - self.reading;
        let bend = change - self.change;
        // One jump is no noise.
        self.rough += ROUGH_GAIN * (lower(bend.abs(), 0.5 * plan.limit) - self.rough);
        self.change = change;
    }

    /// Takes note of whether the torque reading is alive.
    #[inline(always)]
    fn watch(&mut self, position: f64, torque: f64) {
        if torque == self.reading {
            self.same = self.same.saturating_add(1);
        } else {
            self.same = 0;
            self.changed_at = position;
        }
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
            self.standing = 0;
            self.trip = plan.threshold;
            self.trace.resume();
        }
        self.trace.add(self.position, self.reading);
        if self.profile.step() { self.comes(plan) } else { Touch::Going }
    }

    /// The command is at its goal. The axis lags behind it, by much under a soft servo, and may meet the stop on the way that is left.
    #[cold]
    fn comes(&mut self, plan: &Plan) -> Touch {
        self.stand(plan);
        // At the end of its way it rests.
        self.frozen = 0;
        if self.standing >= plan.detection { Touch::Arrived } else { Touch::Going }
    }

    /// Counts the cycles for which it stands.
    fn stand(&mut self, plan: &Plan) {
        self.standing += 1;
        if (self.position - self.anchor).abs() > plan.standing_way {
            self.anchor = self.position;
            self.standing = 0;
        }
    }

    /// The torque is at the limit. The command goes on until the axis stands, so that an acceleration at the limit is
    /// not broken off.
    #[cold]
    fn press(&mut self, plan: &Plan) -> Touch {
        if !self.held {
            self.held = true;
            self.pressing = true;
            self.changed_at = self.position;
            self.trace.pause();
            self.trip = plan.release;
            self.anchor = self.position;
            self.standing = 0;
        }
        self.stand(plan);
        // Under its limit an encoder may stand.
        self.frozen = 0;
        if self.goes_on(plan) {
            self.profile.step();
        } else {
            self.profile.speed = 0.0;
        }
        if (self.position - self.changed_at).abs() > 0.25 * plan.retract {
            return Touch::Broken; // a torque at the limit, to the last digit, under which the axis goes on
        }
        if self.standing >= plan.detection { Touch::Pressed } else { Touch::Held }
    }

    /// Where the last touch has ended.
    #[must_use]
    pub fn end(&self) -> f64 {
        self.anchor
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
        if self.frozen_in_move(plan) {
            return Touch::Broken;
        }
        if self.profile.cruises() {
            self.sliding = self.filtered;
        }
        if self.profile.step() { Touch::Arrived } else { Touch::Going }
    }

    /// One cycle of taking the torque off a motor that does not move: the command goes against the torque, the faster
    /// the more there is, so that the servo's integral runs down. True when the torque is off, but for what holds the axis, and
    /// the command is where the axis is.
    pub fn relieve(&mut self, plan: &Plan) -> bool {
        let (load, now) = (self.filtered - self.holds, plan.torque_sense * self.reading - self.holds);
        let off = load.abs() <= RELIEVED * plan.limit && now.abs() <= LIGHT * plan.threshold && self.settled(plan);
        if load.abs() > 0.5 * RELIEVED * plan.limit {
            // A torque that the command has turned round was answered too fast for this servo.
            self.relief *= if load * self.relieving < 0.0 { 0.5 } else { 1.0 };
            self.relieving = load;
        }
        let speed = -self.relief * plan.approach * (RELIEF * load / plan.limit).clamp(-1.0, 1.0);
        // A torque that pulls off the stop may lead the command toward it, but not beyond the largest way.
        let left = plan.reach() - plan.sense * (self.profile.position - self.start);
        let toward = lower(speed, higher(left, 0.0));
        self.profile = Profile::at_rest(self.profile.position + plan.sense * toward, plan.acceleration);
        self.standing = if off { self.standing + 1 } else { 0 };
        self.standing >= plan.hold
    }

    /// The axis is where its command is, nearly.
    #[must_use]
    pub fn settled(&self, plan: &Plan) -> bool {
        (self.profile.position - self.position).abs() <= 0.1 * plan.press_max
    }

    /// Begins to take the torque off.
    pub fn start_relief(&mut self) {
        (self.relief, self.relieving, self.standing) = (1.0, 0.0, 0);
    }

    /// Begins to brake on the way out; returns the cycles that it takes at most.
    pub fn brake(&mut self) -> f64 {
        self.moving = self.profile.speed != 0.0 && self.frozen == 0;
        self.from = self.position;
        self.profile.stop();
        self.profile.cycles_bound()
    }

    /// On the way out: whether these readings are worth to be followed.
    #[must_use]
    pub fn trusted(&self, plan: &Plan, position: f64, torque: f64) -> bool {
        position.is_finite() && torque.is_finite() && (position - self.position).abs() <= plan.jump
    }

    /// Whether the axis flies on beyond the largest way, faster than it is moved, as when a stop breaks away under torque.
    #[must_use]
    pub fn flung(&self, plan: &Plan, position: f64) -> bool {
        let (beyond, speed) = (plan.sense * (position - self.start) - plan.distance[1], position - self.position);
        beyond > 0.25 * plan.press_max && plan.sense * speed > plan.approach.max(plan.offset_speed)
    }

    /// The axis has gone with its command: nearly all the way, or most of it when nothing holds it, which a servo without
    /// integral leaves.
    #[must_use]
    pub fn came(&self, plan: &Plan) -> bool {
        let way = (self.profile.position - self.from).abs();
        self.settled(plan) || (self.light(plan) && (self.profile.position - self.position).abs() <= 0.5 * way)
    }

    /// The fault of an axis that has not.
    #[must_use]
    pub fn never_came(&self, plan: &Plan) -> Fault {
        let (value, high) = (self.profile.position - self.position, 0.1 * plan.press_max);
        Fault { code: GIB_ERR_LAG, field: "position_mm\0", value, low: -high, high }
    }

    /// Whether something is pressed on, or torque enough is on for it to be.
    #[must_use]
    pub fn pressing(&self, plan: &Plan) -> bool {
        self.pressing || !self.light(plan)
    }

    /// Whether no more torque is on than may be left on, beside what holds the axis.
    #[must_use]
    pub fn light(&self, plan: &Plan) -> bool {
        (self.filtered - self.holds).abs() <= LIGHT * plan.threshold
    }

    /// Takes note of the torque that holds or moves the axis where nothing is touched: an axis with gravity needs it on the way out.
    pub fn holds(&mut self, plan: &Plan, torque: f64) {
        if torque.is_finite() {
            self.holds = lower(higher(torque, -0.5 * plan.threshold), 0.5 * plan.threshold);
        }
    }

    /// Drops the undone way: the command is where the axis is.
    pub fn clear_lag(&mut self, plan: &Plan) {
        self.profile = Profile::at_rest(self.position, plan.acceleration);
    }
}
