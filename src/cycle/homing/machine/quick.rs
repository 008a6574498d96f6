//! The usual cycles of a gantry, which are like the one before: nothing begins, ends, breaks a bound or is news. Both motors at
//! once, one a lane. Those of a single motor are in `side/quick.rs`.
//!
//! They do what [`Homing::step`] would do and keep every check of [`Side::safe`]. A cycle that breaks a bound is left to that
//! step, before anything is changed. Most cycles are at constant speed ([`Homing::quick_both`]), where ways and times cannot end and
//! a lag that stays in its band is within all bounds. In the others a command speeds up or brakes, a motor sticks, or stands
//! pressed ([`Homing::quick_both_slow`]).

use super::*;
use crate::cycle::homing::side::{Caught, GAIN, RIGID, RIGID_AFTER_TURN, UNDER_WAY};
use wide::f64x2;

/// What usual cycles need of the motors, one a lane, lent by the sides.
#[derive(Debug, Clone, Copy, Default)]
pub struct Usual {
    /// Cycles that may still be at constant speed, and after these; of how many.
    cruise: i32,
    slow: u32,
    granted: u32,
    /// Every motor stands pressed and its command has ended.
    stands: bool,
    /// The first cycles, in which every command speeds up, by `rate`; and the cycles at constant speed after those.
    speeding: u32,
    rate: f64x2,
    then: u32,
    encoders: Encoders,
    /// Every cycle is a block of the traces, of the same place; none are kept.
    even: bool,
    paused: bool,
    /// Speed of the command, which is in the output.
    speed: f64x2,
    /// Last readings.
    position: f64x2,
    reading: f64x2,
    /// Filtered torque less the middle of its band, as other torques here in multiples of `share`, which a reading has in it:
    /// that saves to multiply. What a reading lacks for the middle.
    filtered: f64x2,
    share: f64x2,
    drift: f64x2,
    middle: f64x2,
    band: f64x2,
    /// The lowest of it, in the units of the sides.
    lowest: f64x2,
    /// Torque readings that have changed in the slow cycles, and where.
    alive: f64x2,
    changed_at: f64x2,
    /// The lag about which cycles at constant speed count as usual, and by how much it may differ: between two such lags the
    /// position changes by no more than a jump, nor goes beyond the end. Of motors that stand, how far from their anchors.
    lag: f64x2,
    lag_band: f64x2,
    /// On the way back: the last of it at constant speed.
    sliding: f64x2,
    rest: Rest,
}

/// What the encoders did in the last cycle.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
enum Encoders {
    /// None stood, and no motor is pressed.
    Move,
    /// All stood, and no motor is pressed.
    Stand,
    /// Anything else.
    #[default]
    Mixed,
}

/// What cycles that are not at constant speed need beside that.
#[derive(Debug, Clone, Copy, Default)]
struct Rest {
    /// All bits set for a motor that stands pressed, and for one whose command goes on.
    held: f64x2,
    goes: f64x2,
    /// As in [`Plan`] and in [`Side`], its profile included.
    lag_limit: f64x2,
    jump: f64x2,
    distance: f64x2,
    acceleration: f64x2,
    /// Twice that, the square of half of it and half of it: what braking needs.
    braking_by: [f64x2; 3],
    start: f64x2,
    anchor: f64x2,
    standing_way: f64x2,
    goal: f64x2,
    speed_max: f64x2,
    braking: f64x2,
    /// What stood when the position changed last, and since when it does not.
    free: f64x2,
    free_reading: f64x2,
    frozen: f64x2,
    frozen_limit: f64x2,
    /// By how much the filtered torque may have changed since.
    unmoved: f64x2,
    /// Where the move began and the way on which it turns; change of the filtered torque meanwhile and after it that clears an
    /// encoder that stands.
    from: f64x2,
    turn: f64x2,
    turning: f64x2,
    under_way: f64x2,
    /// Change of lag at constant speed within which the position changes by no more than a jump.
    half_jump: f64x2,
    sense: f64x2,
    /// Largest difference of the ways gone.
    apart: f64x2,
}

fn lanes(of: impl FnMut(usize) -> f64) -> f64x2 {
    f64x2::new(core::array::from_fn(of))
}

fn all(bits: f64x2) -> bool {
    bits.to_bitmask() == 3
}

/// How far apart the two are, in both lanes.
#[inline(always)]
fn apart(ways: f64x2) -> f64x2 {
    let [first, second] = ways.to_array();
    (ways - f64x2::new([second, first])).abs()
}

fn mask(mut of: impl FnMut(usize) -> bool) -> f64x2 {
    lanes(|i| f64::from_bits(if of(i) { u64::MAX } else { 0 }))
}

impl Usual {
    /// Cycles that went by since they were granted.
    #[inline(always)]
    pub fn gone(&self) -> u32 {
        self.granted - self.cruise as u32 - self.slow
    }

    /// Grants no more.
    #[inline(always)]
    pub fn end(&mut self) {
        (self.cruise, self.slow, self.granted) = (0, 0, 0);
    }

    #[inline(always)]
    fn filter(&self, torque: f64x2) -> f64x2 {
        self.filtered * (1.0 - GAIN) + (torque - self.drift)
    }

    /// Takes a cycle's readings in. A trace is kept of touches, of the way back the lowest torque and that of the last cycle
    /// at constant speed, `sliding`.
    #[inline(always)]
    fn take_in(&mut self, position: f64x2, torque: f64x2, filtered: f64x2, sliding: f64x2, sides: &mut [Side; 2]) {
        (self.position, self.reading, self.filtered) = (position, torque, filtered);
        if self.even {
            let [one, other] = f64x2::transpose([position, torque]);
            let place = sides[0].trace.put(one.to_array());
            sides[1].trace.put_at(place, other.to_array());
        } else if self.paused {
            self.lowest = (filtered * self.share).fast_min(self.lowest);
            self.sliding = sliding;
        } else {
            let [[p, q], [t, u]] = [position.to_array(), torque.to_array()];
            sides[0].trace.add(p, t);
            sides[1].trace.add(q, u);
        }
    }

    /// Where the readings are as they are at constant speed. What is no number is in no band.
    #[inline(always)]
    fn like(&self, position: f64x2, filtered: f64x2, target: f64x2) -> f64x2 {
        (target - position - self.lag).abs().simd_le(self.lag_band)
            & filtered.abs().simd_le(self.band)
            & position.simd_ne(self.position)
    }

    /// Takes note of which torque readings are alive, as [`Side::sense`].
    #[inline(always)]
    fn watch(&mut self, position: f64x2, torque: f64x2) {
        let changed = torque.simd_ne(self.reading);
        self.alive |= changed;
        self.changed_at = changed.bitselect(position, self.changed_at);
    }

    /// Where the readings keep every bound.
    #[inline(always)]
    fn bounded(&self, position: f64x2, filtered: f64x2, target: f64x2) -> f64x2 {
        let rest = &self.rest;
        let way = (position - rest.start) * rest.sense;
        apart(way).simd_le(rest.apart)
            & (target - position).abs().simd_le(rest.lag_limit)
            & (position - self.position).abs().simd_le(rest.jump)
            & way.simd_le(rest.distance)
            & filtered.abs().simd_le(self.band)
    }

    /// Where not all go on moving, counts for how many cycles encoders stand, as [`Side::sense`]; false, and nothing is counted,
    /// where one that does may be at fault, see [`Side::rigid`], or a press ends.
    #[inline(always)]
    fn moves_or_stands(&mut self, position: f64x2, torque: f64x2, filtered: f64x2) -> bool {
        if self.encoders == Encoders::Move && all(position.simd_ne(self.position)) {
            return true;
        }
        // As long as all move nobody looks whether the torque changes from one cycle to the next.
        self.watch(position, torque);
        let rest = &mut self.rest;
        let moved = rest.frozen.simd_eq(f64x2::ZERO);
        let frozen = (rest.frozen + 1.0) & position.simd_eq(self.position) & !rest.held;
        let (free, free_reading) =
            (moved.bitselect(self.filtered, rest.free), moved.bitselect(self.reading, rest.free_reading));
        let most = (position - rest.from).abs().simd_gt(rest.turn).bitselect(rest.under_way, rest.turning);
        let patient = frozen.simd_le(rest.frozen_limit) & (filtered - free).abs().simd_le(most);
        if !all((patient | frozen.simd_eq(f64x2::ZERO)) & (!rest.held | rest.presses(position))) {
            return false;
        }
        (rest.frozen, rest.free, rest.free_reading, rest.unmoved) = (frozen, free, free_reading, most);
        self.encoders = match (frozen.simd_eq(f64x2::ZERO) | rest.held).to_bitmask() {
            0 => Encoders::Stand,
            3 if !rest.held.any() => Encoders::Move,
            _ => Encoders::Mixed,
        };
        true
    }

    /// Whether all encoders stand on and every bound is kept; counts it. Ways and what they bound are what they were.
    #[inline(always)]
    fn stands_on(&mut self, position: f64x2, filtered: f64x2, target: f64x2) -> bool {
        let rest = &mut self.rest;
        let frozen = rest.frozen + 1.0;
        let fine = position.simd_eq(self.position)
            & (target - position).abs().simd_le(rest.lag_limit)
            & filtered.abs().simd_le(self.band)
            & (filtered - rest.free).abs().simd_le(rest.unmoved)
            & frozen.simd_le(rest.frozen_limit);
        if all(fine) {
            rest.frozen = frozen;
        }
        all(fine)
    }

    /// The last of the cycles that speed up brings the commands to their speed, the others by `rate` nearer.
    #[inline(always)]
    fn speed_up(&mut self, target: f64x2) {
        if self.speeding > 0 {
            self.speed += self.rate;
        } else {
            self.speed = self.rest.speed(target, self.speed);
            (self.cruise, self.slow, self.then) = (self.then as i32, self.slow - self.then, 0);
        }
    }

    /// Filtered torque of the last cycle at constant speed, which may be this one.
    #[inline(always)]
    fn slid(&self, filtered: f64x2, target: f64x2) -> f64x2 {
        self.rest.cruises(target, self.speed).bitselect(filtered, self.sliding)
    }

    /// Puts the usual lags about this cycle's. While an encoder stands no lag is: that is not for [`Homing::quick_both`].
    #[inline(always)]
    fn centre(&mut self, lag: f64x2, position: f64x2) {
        let rest = &self.rest;
        let way = (position - rest.start) * rest.sense;
        // At the same speed the sides go apart as far as both their lags change.
        let room = (rest.apart - apart(way)) * 0.5;
        let to_limit = (rest.lag_limit - lag.abs()).fast_min(rest.distance - way);
        self.lag = lag;
        self.lag_band = to_limit.fast_min(rest.half_jump).fast_min(room) | !rest.frozen.simd_eq(f64x2::ZERO);
    }

    /// All stand pressed: near their anchors, within the way of a standing axis, they are within all bounds.
    fn stand(&mut self, target: f64x2) {
        self.stands = true;
        self.centre(target - self.rest.anchor, self.rest.anchor);
        self.lag_band = self.lag_band.fast_min(self.rest.standing_way);
    }

    /// What has become of motor `i`, whose command is at `target`.
    pub fn caught(&self, i: usize, target: f64) -> Caught {
        let of = |lanes: f64x2| lanes.to_array()[i & 1];
        let torque = |lanes: f64x2| of(lanes * self.share + self.middle);
        Caught {
            cycles: self.gone(),
            alive: of(self.alive).to_bits() != 0,
            changed_at: of(self.changed_at),
            frozen: of(self.rest.frozen) as u32,
            position: of(self.position),
            reading: of(self.reading),
            filtered: torque(self.filtered),
            lowest: of(self.lowest + self.middle),
            sliding: torque(self.sliding),
            free: [of(self.rest.free_reading), torque(self.rest.free)],
            target,
            speed: of(self.speed),
        }
    }
}

impl Rest {
    /// Whether a motor that is pressed stands, as [`Side::press`].
    #[inline(always)]
    fn presses(&self, position: f64x2) -> f64x2 {
        (position - self.anchor).abs().simd_le(self.standing_way)
    }

    /// Which commands are at constant speed, as [`crate::cycle::profile::Profile::cruises`].
    #[inline(always)]
    fn cruises(&self, target: f64x2, speed: f64x2) -> f64x2 {
        speed.abs().simd_eq(self.speed_max) & ((self.goal - target) * speed).simd_gt(self.braking * self.speed_max)
    }

    /// Speed of the commands that go on, as [`crate::cycle::profile::Profile::step`] so far from the goal that it cannot
    /// carry past it.
    #[inline(always)]
    fn speed(&self, target: f64x2, speed: f64x2) -> f64x2 {
        let (a, left, [twice, square, half]) = (self.acceleration, self.goal - target, self.braking_by);
        let stops = (left.abs() * twice + square).sqrt() - half;
        let wanted = stops.fast_min(self.speed_max) | (left & f64x2::splat(-0.0));
        wanted.fast_max(speed - a).fast_min(speed + a) & self.goes
    }
}

impl Homing {
    /// Says for how many cycles more all goes on, at most `left`; after a cycle that was put out.
    pub(super) fn see_usual(&mut self, left: u32) {
        // What has broken its bound is named in the next cycle, which must not be a usual one.
        if self.sides.iter().take(self.plan.motors).any(|side| side.filtered.abs() > self.plan.bound) {
            return;
        }
        if self.plan.motors == 2 {
            self.see_both(left);
        } else {
            self.sides[0].grant(&self.plan, left);
        }
    }

    fn see_both(&mut self, left: u32) {
        let (plan, sides) = (&self.plan, &self.sides);
        if sides.iter().any(|side| side.arrives(plan)) {
            return;
        }
        let ahead = [&sides[0], &sides[1]].map(|side| side.look_ahead(plan));
        let least = |of: [u32; 2]| of[0].min(of[1]).min(left).min(i32::MAX as u32);
        // They speed up together, lest the sides go apart, or not as one.
        let [rate, other] = ahead.map(|side| side.rate);
        let alike = rate == other && (rate == 0.0 || sides[0].profile.speed == sides[1].profile.speed);
        let speeding = if alike && rate != 0.0 { least(ahead.map(|side| side.speeding)) + 1 } else { 0 };
        let cycles = least(ahead.map(|side| if alike { side.cycles } else { side.cycles.min(side.speeding.max(1)) }));
        if cycles == 0 {
            return;
        }
        let cruise = least(ahead.map(|side| if alike { side.cruise } else { 0 })).min(cycles.saturating_sub(speeding));
        let (cruise, then) = if speeding > 0 { (0, cruise) } else { (cruise, 0) };
        let square = if self.phase == Phase::Touch { plan.square } else { f64::INFINITY };
        let per_share = 1.0 / plan.torque_share;
        let middle = lanes(|i| 0.5 * (ahead[i].low + ahead[i].high));
        let traces = [&sides[0].trace, &sides[1].trace];
        self.usual = Usual {
            cruise: cruise as i32,
            slow: cycles - cruise,
            granted: cycles,
            speeding,
            rate: lanes(|i| ahead[i].rate),
            then,
            encoders: Encoders::Mixed,
            even: traces[0].even_with(traces[1]),
            paused: traces.iter().all(|trace| trace.paused()),
            speed: lanes(|i| sides[i].profile.speed),
            position: lanes(|i| sides[i].position),
            reading: lanes(|i| sides[i].reading),
            filtered: (lanes(|i| sides[i].filtered) - middle) * per_share,
            lowest: lanes(|i| sides[i].lowest) - middle,
            sliding: (lanes(|i| sides[i].sliding) - middle) * per_share,
            share: f64x2::splat(plan.torque_share),
            drift: middle * GAIN * per_share,
            middle,
            band: lanes(|i| 0.5 * (ahead[i].high - ahead[i].low) * per_share.abs()),
            stands: false,
            alive: f64x2::ZERO,
            changed_at: lanes(|i| sides[i].position),
            lag: f64x2::ZERO,
            lag_band: f64x2::ZERO,
            rest: Rest {
                held: mask(|i| sides[i].held),
                goes: mask(|i| sides[i].goes_on(plan)),
                start: lanes(|i| sides[i].start),
                anchor: lanes(|i| sides[i].anchor),
                frozen: lanes(|i| f64::from(sides[i].frozen)),
                unmoved: f64x2::ZERO,
                frozen_limit: lanes(|i| f64::from(sides[i].frozen_limit)),
                goal: lanes(|i| sides[i].profile.goal()),
                speed_max: lanes(|i| sides[i].profile.speed_max()),
                braking: lanes(|i| sides[i].profile.braking()),
                free: (lanes(|i| sides[i].free[1]) - middle) * per_share,
                free_reading: lanes(|i| sides[i].free[0]),
                lag_limit: f64x2::splat(plan.lag_limit),
                jump: f64x2::splat(plan.jump),
                distance: f64x2::splat(plan.distance[1]),
                acceleration: f64x2::splat(plan.acceleration),
                braking_by: [2.0, 0.25 * plan.acceleration, 0.5].map(|of| f64x2::splat(of * plan.acceleration)),
                standing_way: f64x2::splat(plan.standing_way),
                from: lanes(|i| sides[i].from),
                turn: f64x2::splat(UNDER_WAY * plan.retract),
                turning: f64x2::splat(0.5 * RIGID_AFTER_TURN * plan.limit * per_share.abs()),
                under_way: f64x2::splat(0.5 * RIGID * plan.limit * per_share.abs()),
                half_jump: lanes(|i| 0.5 * (plan.jump - sides[i].profile.speed_max())),
                sense: f64x2::splat(plan.sense),
                apart: f64x2::splat(square),
            },
        };
        let stands = |side: &Side| side.held && !side.goes_on(plan);
        let target = lanes(|i| sides[i].profile.position);
        if sides.iter().all(stands) {
            self.usual.stand(target);
        } else {
            self.usual.centre(target - self.usual.speed - self.usual.position, self.usual.position);
        }
    }

    /// One servo cycle if it is a usual one at constant speed; else [`Homing::quick_both_slow`] must follow.
    #[inline(always)]
    pub fn quick_both(&mut self, input: &HomingInput, output: &mut HomingOutput) -> bool {
        let u = &mut self.usual;
        // Counted down first: that takes the fewest instructions.
        u.cruise -= 1;
        if u.cruise < 0 || input.torque_limit.to_bits() != self.in_force {
            return false;
        }
        let (position, torque) = (f64x2::new(input.position_mm), f64x2::new(input.torque));
        let target = f64x2::new(self.output.target_position_mm);
        // The middle of the band is zero at constant speed.
        let filtered = u.filtered * (1.0 - GAIN) + torque;
        // Takes an instruction less than the mask's complement.
        if u.like(position, filtered, target).to_bitmask().wrapping_sub(3) | input.flags != 0 {
            return false;
        }
        u.take_in(position, torque, filtered, filtered, &mut self.sides);
        let target = (target + u.speed).to_array();
        self.output.target_position_mm = target;
        *output = HomingOutput { target_position_mm: target, ..self.output };
        true
    }

    /// The same for a cycle that is not at constant speed; false when it is unlike too, and nothing is done. Comes after a
    /// [`Homing::quick_both`] that was false, and takes back what that has counted.
    #[inline(always)]
    pub fn quick_both_slow(&mut self, input: &HomingInput, output: &mut HomingOutput) -> bool {
        let u = &mut self.usual;
        u.cruise += 1;
        if u.cruise as u32 + u.slow == 0 || input.flags != 0 || input.torque_limit.to_bits() != self.in_force {
            return false;
        }
        let (position, torque) = (f64x2::new(input.position_mm), f64x2::new(input.torque));
        let filtered = u.filter(torque);
        let target = f64x2::new(self.output.target_position_mm);
        if u.stands {
            if !all((position - u.rest.anchor).abs().simd_le(u.lag_band) & filtered.abs().simd_le(u.band)) {
                return false;
            }
            u.slow -= 1;
            u.watch(position, torque);
            (u.position, u.reading, u.filtered) = (position, torque, filtered);
            *output = self.output;
            return true;
        }
        let stands = u.encoders == Encoders::Stand && u.stands_on(position, filtered, target);
        let like = !stands && u.speeding > 0 && all(u.like(position, filtered, target));
        if !stands && !like {
            if !all(u.bounded(position, filtered, target)) || !u.moves_or_stands(position, torque, filtered) {
                return false;
            }
            // It may be that nothing but the lag has left its band.
            if u.cruise > 0 || u.speeding > 0 {
                u.centre(target - position, position);
            }
        }
        if u.cruise > 0 {
            u.cruise -= 1;
            u.take_in(position, torque, filtered, filtered, &mut self.sides);
        } else if u.speeding > 0 {
            (u.slow, u.speeding) = (u.slow - 1, u.speeding - 1);
            u.take_in(position, torque, filtered, u.sliding, &mut self.sides);
            u.speed_up(target);
        } else {
            u.slow -= 1;
            u.take_in(position, torque, filtered, u.slid(filtered, target), &mut self.sides);
            u.speed = u.rest.speed(target, u.speed);
        }
        self.output.target_speed_mm_s = (u.speed * self.plan.cycles_per_s).to_array();
        let target = (target + u.speed).to_array();
        self.output.target_position_mm = target;
        *output = HomingOutput { target_position_mm: target, ..self.output };
        true
    }
}
