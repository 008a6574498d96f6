//! What is to blame when a motor's readings break a bound or contradict each other.
//!
//! A standing encoder, a torque that says nothing or the wrong thing, an axis that something holds and a command that
//! nobody follows look alike in one cycle; they differ in what the torque did meanwhile.

use super::*;
use crate::cycle::homing::verdict::Touches;

/// Change of torque, as a share of the limit, that no standing encoder explains: a stop gives way by some counts of
/// the encoder. After a turn, friction on the motor's side may hold the motor while its torque changes sense.
pub const RIGID: f64 = 0.3;
/// The same after a turn.
pub const RIGID_AFTER_TURN: f64 = 0.8;
/// Share of the retraction after which a turn is over.
pub const UNDER_WAY: f64 = 0.04;
/// Share of the limit beyond which a torque that changes to its opposite while the encoder stands has changed its sign.
const FLIPPED: f64 = 0.2;
/// Share of a reading's noise that is left in the filtered torque: √(GAIN/(2 − GAIN)).
const FILTERED: f64 = 0.26;
/// Mean of |x₀ − 2x₁ + x₂| for white noise of standard deviation 1: √6·√(2/π).
const BENT: f64 = 1.954;
/// Cycles within which an axis that was moving shows some motion.
const ALIVE: u32 = 8;

impl Side {
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

    /// The axis does not follow, which is `otherwise` unless the torque says more: the torque sensor's fault if it says that nothing holds the axis, a tight spot if it
    /// is held on the way back.
    pub fn contradiction(&self, plan: &Plan, otherwise: Fault) -> Fault {
        if self.back(plan) && self.filtered < -0.5 * plan.threshold {
            let (code, field) = (GIB_ERR_HOMING_TIGHT_SPOT, "torque\0");
            return Fault { code, field, value: self.filtered, low: -0.5 * plan.threshold, high: plan.limit };
        }
        self.torque_fault(plan).unwrap_or(otherwise)
    }

    /// What is to blame for a touch or move that is [`Touch::Broken`].
    #[cold]
    pub fn broken_sensor(&self, plan: &Plan) -> Fault {
        // A torque that jumped and stands since.
        if self.stuck(plan) || self.same >= 1 {
            return self.name_stuck(plan, 0);
        }
        if self.loaded && self.position == self.start {
            let (field, low, high) = ("distance_min_mm\0", plan.retract, plan.distance[1]);
            return Fault { code: GIB_ERR_HOMING_ON_STOP, field, value: 0.0, low, high };
        }
        if self.drowns(plan) {
            return self.name_noise(plan);
        }
        // A servo whose encoder stands winds its torque up in the sense of the command; a command that does not reach
        // the servo leaves it as it is.
        let sense = if self.back(plan) { -1.0 } else { 1.0 };
        let along = |torque: f64| sense * plan.torque_sense * torque;
        if along(self.free[0]) > FLIPPED * plan.limit && along(self.reading) < -FLIPPED * plan.limit {
            let (code, low) = (GIB_ERR_HOMING_TORQUE_SIGN, -FLIPPED * plan.limit);
            return Fault { code, field: "torque\0", value: along(self.reading), low, high: plan.limit };
        }
        let wound = sense * (self.filtered - self.free[1]) > 0.05 * plan.limit + 4.0 * FILTERED * self.noise();
        let code = if wound { GIB_ERR_HOMING_ENCODER } else { GIB_ERR_LAG };
        self.torque_fault(plan).unwrap_or(Fault { code, ..self.name_rigid(plan) })
    }

    /// What says that the encoder should not stand, see [`Side::rigid`]: the torque, or for how long it does.
    fn name_rigid(&self, plan: &Plan) -> Fault {
        let (share, patience) = self.rigid_by(plan);
        let most = share * plan.limit;
        let fault = |field, value, low, high| Fault { code: GIB_ERR_HOMING_ENCODER, field, value, low, high };
        if self.changed_by(most) {
            fault("torque\0", self.reading, self.free[0] - most, self.free[0] + most)
        } else if self.never_moved(plan) {
            fault("torque\0", self.filtered, -plan.threshold, plan.threshold)
        } else {
            fault("position_same_cycles\0", f64::from(self.frozen), 0.0, f64::from(patience))
        }
    }

    /// What says that the torque reading is stuck, see [`Side::stuck`]: the way gone under it, or for how many cycles it stands where
    /// `high` may be.
    pub fn name_stuck(&self, plan: &Plan, high: u32) -> Fault {
        let fault = |field, value, high| Fault { code: GIB_ERR_HOMING_TORQUE_STUCK, field, value, low: 0.0, high };
        let (way, most) = ((self.position - self.changed_at).abs(), 0.25 * plan.retract);
        if way > most {
            fault("torque_same_mm\0", way, most)
        } else if self.same > high {
            fault("torque_same_cycles\0", f64::from(self.same), f64::from(high))
        } else {
            fault("torque_same_blocks\0", f64::from(STUCK_BLOCKS), f64::from(STUCK_BLOCKS - 1))
        }
    }

    /// Whether noise may pass for a torque that tells of a standing encoder.
    fn drowns(&self, plan: &Plan) -> bool {
        3.0 * self.noise() > RIGID * plan.limit
    }

    fn name_noise(&self, plan: &Plan) -> Fault {
        let [value, high] = [self.noise(), RIGID * plan.limit / 3.0].map(|torque| torque * plan.torque_nm);
        Fault { code: GIB_ERR_HOMING_NOISE, field: "noise_nm\0", value, low: 0.0, high }
    }

    /// What is wrong with the torque of an axis that stands against its command, if anything.
    fn torque_fault(&self, plan: &Plan) -> Option<Fault> {
        let (value, low) = (lower(self.filtered, plan.torque_sense * self.reading), -0.5 * plan.threshold);
        if self.stuck(plan) {
            Some(self.name_stuck(plan, 0))
        } else if value < low && !self.back(plan) {
            Some(Fault { code: GIB_ERR_HOMING_TORQUE_SIGN, field: "torque\0", value, low, high: plan.limit })
        } else {
            None
        }
    }

    /// Whether the torque reading has not changed by one digit for long, or on a way that the axis has gone under it.
    #[must_use]
    pub fn stuck(&self, plan: &Plan) -> bool {
        self.trace.stuck(STUCK_BLOCKS) || (self.position - self.changed_at).abs() > 0.25 * plan.retract
    }

    /// Standard deviation of a reading: what the touch showed, or what has come since.
    fn noise(&self) -> f64 {
        self.trace.noise().max(self.rough / BENT)
    }

    /// Whether the command leads away from the stop.
    fn back(&self, plan: &Plan) -> bool {
        plan.sense * (self.profile.position + self.profile.left() - self.position) < 0.0
    }

    /// Whether the torque tolerance is less than three standard deviations of the filtered torque.
    fn noisy(&self, plan: &Plan) -> bool {
        3.0 * FILTERED * self.noise() > plan.bound - plan.limit
    }

    /// The encoder stands. Whether it should not: the command has gone on for long, or the torque has changed as on
    /// something infinitely rigid. Both the reading and its filtered value must say so: one is noisy, one is late.
    #[must_use]
    pub fn rigid(&self, plan: &Plan) -> bool {
        let (share, patience) = self.rigid_by(plan);
        let changed = self.changed_by(share * plan.limit);
        let long = self.frozen > patience && self.filtered.abs() < plan.release;
        self.never_moved(plan) || changed || long
    }

    /// Whether the torque is at the limit before a touch has moved the axis at all.
    fn never_moved(&self, plan: &Plan) -> bool {
        let touches = self.from == self.origin;
        touches && self.position == self.origin && self.filtered >= plan.threshold
    }

    /// Share of the limit by which the torque may change, and cycles, while the encoder stands.
    fn rigid_by(&self, plan: &Plan) -> (f64, u32) {
        let under_way = (self.position - self.from).abs() > UNDER_WAY * plan.retract;
        if under_way { (RIGID, self.frozen_limit) } else { (RIGID_AFTER_TURN, 3 * self.frozen_limit) }
    }

    /// Whether the torque has changed by more than that since the encoder stands.
    fn changed_by(&self, most: f64) -> bool {
        (self.reading - self.free[0]).abs() > most && (self.filtered - self.free[1]).abs() > 0.5 * most
    }

    /// What is wrong where the axis stands back from a touch, if anything: a torque that has changed, and goes beyond what moved
    /// the axis before, does not leave its encoder as it is.
    #[inline(always)]
    #[must_use]
    pub fn wound_up(&self, plan: &Plan, touches: &Touches) -> Option<Fault> {
        if self.frozen < ALIVE || !self.changed_by(RIGID * plan.limit) {
            None
        } else {
            self.name_wound_up(plan, touches)
        }
    }

    #[cold]
    fn name_wound_up(&self, plan: &Plan, touches: &Touches) -> Option<Fault> {
        // Friction at rest may be half as much again as sliding, and as noise.
        let friction = if touches.count() > 0 { touches.friction() } else { self.sliding.abs() };
        let margin = 0.5 * friction + 0.1 * plan.limit + 4.0 * FILTERED * self.noise();
        let low = if self.sliding.is_finite() { self.sliding - margin } else { -plan.release };
        let high = if touches.count() > 0 { touches.level() + margin } else { plan.release };
        let torque = lower(self.filtered.abs(), self.reading.abs()).copysign(self.filtered);
        if (low..=high).contains(&torque) {
            return None;
        }
        let (low, high) = (low * plan.torque_sense, high * plan.torque_sense);
        let (code, field, value) = (GIB_ERR_HOMING_ENCODER, "torque\0", torque * plan.torque_sense);
        let odd = Fault { code, field, value, low: low.min(high), high: low.max(high) };
        Some(if self.drowns(plan) { self.name_noise(plan) } else { odd })
    }

    /// What is wrong where a motor stands pressed after its deviation was cleared, if anything: something is pressed on, but at a place
    /// where nothing was touched before.
    #[must_use]
    pub fn pressed_elsewhere(&self, plan: &Plan, touches: &Touches) -> Option<Fault> {
        let (back, press) = (plan.sense * (self.anchor - self.position), touches.press(plan));
        // Friction at rest may be half as much again as sliding.
        let free = touches.level() + 0.5 * touches.friction() + LIGHT * plan.threshold;
        let elsewhere = self.filtered >= lower(free, plan.threshold) && back > press + plan.standing_way;
        let fault = Fault { field: "position_mm\0", value: back, ..Fault::of(GIB_ERR_HOMING_ENCODER) };
        elsewhere.then_some(Fault { low: 0.0, high: press, ..fault })
    }

    /// What the way back tells, if anything is wrong with what was pressed on. `level`: torque before contact; `racked`: what explains a
    /// torque on the way back of a gantry better. Nothing is said of a way back too short to slide steadily.
    #[must_use]
    pub fn held_back(&self, plan: &Plan, level: f64, racked: impl Fn() -> Option<Fault>) -> Option<Fault> {
        let fault = |code, field, value, low, high| Some(Fault { code, field, value, low, high });
        // A stop pushes the axis back; a tight spot takes as much torque above what sliding takes both ways.
        let noiseless = self.sliding - 0.5 * (plan.threshold - level);
        let low = if self.lowest < noiseless { noiseless - 4.0 * FILTERED * self.noise() } else { noiseless };
        let (behind, most) = (self.profile.position - self.position, 0.5 * plan.retract);
        let (stayed, pulls) = (-plan.sense * behind > most, self.lowest <= -0.5 * plan.threshold);
        let held = self.sliding.max(self.filtered);
        if stayed && !pulls {
            fault(GIB_ERR_LAG, "position_mm\0", behind, -most, most)
        } else if held >= plan.release {
            // Away from the stop, and still at the limit toward it.
            racked().or(fault(GIB_ERR_HOMING_TORQUE_STUCK, "torque\0", held, -plan.limit, plan.release))
        } else if !(stayed || self.lowest < low) {
            None
        } else if self.stuck(plan) && !pulls {
            // A torque that pulls hard now pushed before: it is alive, though it stands at the drive's limit without noise.
            Some(self.name_stuck(plan, 0))
        } else if stayed {
            fault(GIB_ERR_HOMING_TIGHT_SPOT, "position_mm\0", behind, -most, most)
        } else {
            racked().or(fault(GIB_ERR_HOMING_TIGHT_SPOT, "torque\0", self.lowest, low, plan.limit))
        }
    }

    /// Whether the encoder stands in a move, and should not.
    #[inline(always)]
    #[must_use]
    pub fn frozen_in_move(&self, plan: &Plan) -> bool {
        self.frozen > 0 && self.profile.speed != 0.0 && self.rigid(plan)
    }

    /// The same on the way out, and where the command has ended but the axis has not come: the servo winds up.
    #[must_use]
    pub fn frozen_on_way_out(&self, plan: &Plan) -> bool {
        self.frozen_in_move(plan)
            || (!self.settled(plan) && self.frozen >= ALIVE && self.changed_by(RIGID_AFTER_TURN * plan.limit))
    }

    /// The same of an axis that was held, and moved since.
    #[must_use]
    pub fn frozen_off_spot(&self, plan: &Plan) -> bool {
        let under_way = (self.position - self.from).abs() > UNDER_WAY * plan.retract;
        under_way && !self.settled(plan) && self.frozen >= ALIVE && self.changed_by(RIGID * plan.limit)
    }

    /// The same where the torque cannot say so: the command has left the axis.
    #[must_use]
    pub fn left_behind(&self, plan: &Plan) -> bool {
        self.frozen > self.frozen_limit && (self.profile.position - self.position).abs() > 0.1 * plan.retract
    }

    /// Whether the torque reading changes.
    #[must_use]
    pub fn alive(&self, plan: &Plan) -> bool {
        self.same < plan.hold
    }

    /// Whether a torque that stands at the limit is none: it did before the touch began.
    #[must_use]
    pub fn stuck_high(&self, plan: &Plan) -> bool {
        self.loaded && self.same >= plan.hold
    }

    /// What is wrong with a measured touch that ends too close to where it began: there the axis was free before.
    #[must_use]
    pub fn pressed_at_once(&self, plan: &Plan) -> Option<Fault> {
        let (way, field, low) = ((self.position - self.origin).abs(), "retract_mm\0", 0.5 * plan.retract);
        // A torque that changed until the axis stood is alive, though it stands at the drive's limit without noise.
        let on = (self.position - self.changed_at).abs() > plan.standing_way;
        let code = match () {
            () if self.same >= plan.hold && on => GIB_ERR_HOMING_TORQUE_STUCK,
            () if way < 0.1 * low => GIB_ERR_HOMING_ENCODER,
            () => GIB_ERR_HOMING_TOUCHES,
        };
        (way < low).then_some(Fault { code, field, value: way, low, high: plan.retract })
    }

    /// What is wrong with a measured touch that ends, at `end`, elsewhere than the first did, by more than all of the way that a stop
    /// gives under the limit: it was no stop, one time or the other.
    #[must_use]
    pub fn ended_elsewhere(&self, plan: &Plan, touches: &Touches, end: f64) -> Option<Fault> {
        let (way, high) = ((end - touches.first_end).abs(), touches.press(plan) + plan.standing_way);
        let fault = Fault { field: "position_mm\0", value: way, ..Fault::of(GIB_ERR_HOMING_TOUCHES) };
        (way > high).then_some(Fault { low: 0.0, high, ..fault })
    }

    /// What is wrong where a motor that was pressed goes on toward the stop, if anything: what it pressed on gives way. `press`: way
    /// from contact to the limit.
    #[must_use]
    pub fn gives_way(&self, plan: &Plan, press: f64) -> Option<Fault> {
        let (way, high) = (plan.sense * (self.position - self.anchor), press + plan.standing_way);
        let fault = Fault { field: "position_mm\0", value: way, ..Fault::of(GIB_ERR_HOMING_TOUCHES) };
        (way > high).then_some(Fault { low: 0.0, high, ..fault })
    }

    /// On the way out: an axis that was moving when it began to brake has not moved since.
    #[must_use]
    pub fn dead(&self) -> bool {
        self.moving && self.position == self.from && self.frozen >= ALIVE
    }
}
