//! How long a motor's cycles will be like the one before, and what tells that they are not.

use super::*;

/// What can be said of a motor's next cycles.
#[derive(Debug, Clone, Copy)]
pub struct Ahead {
    /// Cycles in which it meets no end of a way or time, and of them those, the first, with a command at constant speed.
    pub cycles: u32,
    /// See `cycles`.
    pub cruise: u32,
    /// Cycles before those, of which each changes the command's speed by `rate`; one more brings it to its speed.
    pub speeding: u32,
    /// See `speeding`.
    pub rate: f64,
    /// Lowest filtered torque of usual cycles.
    pub low: f64,
    /// Highest.
    pub high: f64,
}

/// What usual cycles have made of a motor: cycles gone by, and the fields of [`Side`] and its profile that they change.
#[derive(Debug, Clone, Copy)]
#[expect(missing_docs, reason = "named as in Side")]
pub struct Caught {
    pub cycles: u32,
    pub alive: bool,
    pub changed_at: f64,
    pub frozen: u32,
    pub position: f64,
    pub reading: f64,
    pub filtered: f64,
    pub lowest: f64,
    pub sliding: f64,
    pub free: [f64; 2],
    pub target: f64,
    pub speed: f64,
}

/// Cycles at the end of a move that are left to the other steps: there the command might go past its goal, or arrives.
const LAST: f64 = 2.0;

impl Side {
    /// Looks ahead, after a cycle's step of the command.
    #[must_use]
    pub fn look_ahead(&self, plan: &Plan) -> Ahead {
        let p = &self.profile;
        let (way, speed) = (p.left().abs(), p.speed_max());
        // Of the way that is left at the largest speed and then braking, or braking all the way.
        let to_brake = speed / plan.acceleration;
        let to_goal = if 2.0 * way > speed * to_brake {
            way / speed + 0.5 * to_brake
        } else {
            (2.0 * way / plan.acceleration).sqrt()
        };
        let (low, high) = (-self.trip, self.trip);
        let ahead = Ahead { cycles: (to_goal - LAST) as u32, cruise: 0, speeding: 0, rate: 0.0, low, high };
        if self.held {
            let next = match self.standing {
                standing if standing < plan.hold => plan.hold,
                standing if standing < plan.detection => plan.detection,
                _ => u32::MAX, // the other motor is waited for
            };
            let to_next = next.saturating_sub(self.standing + 1);
            let cycles = if self.goes_on(plan) { to_next.min(ahead.cycles) } else { to_next };
            let cycles = if self.reads_on(plan) { cycles } else { 0 };
            return Ahead { cycles, low: plan.release, high: plan.bound, ..ahead };
        }
        // The axis may lead its command by the largest lag.
        let to_end = plan.distance[1] - plan.sense * (p.position - self.start) - plan.lag_limit;
        let away = p.left() * plan.sense < 0.0;
        let free = lower(way, if away { way } else { to_end });
        // A cycle's rounding must not count as a cycle.
        let cruise = |before: f64| (lower(way - before - p.braking(), free - before) / speed - 1e-6) as u32;
        if p.cruises() {
            return Ahead { cruise: cruise(0.0), ..ahead };
        }
        // On the way that speeding up takes, no longer than braking, it need not brake.
        let to_speed = (speed - p.speed.copysign(p.speed * p.left())) / plan.acceleration;
        if free > 2.0 * p.braking() && p.speed.abs() <= speed && to_speed >= 1.0 {
            let rate = plan.acceleration.copysign(p.left());
            let cycles = (to_goal - LAST + 0.5 * to_speed * to_speed / to_brake) as u32;
            return Ahead { cycles, cruise: cruise(p.braking()), speeding: to_speed as u32, rate, ..ahead };
        }
        // While it speeds up, until it has; the rest may then be at constant speed.
        let speeds_up = way > p.braking();
        Ahead { cycles: if speeds_up { ahead.cycles.min(to_speed as u32) } else { ahead.cycles }, ..ahead }
    }

    /// Whether the command goes on, but nears its goal so that none of the cycles left is usual.
    #[must_use]
    pub fn arrives(&self, plan: &Plan) -> bool {
        self.goes_on(plan) && self.profile.left().abs() < 0.5 * (LAST + 1.0) * (LAST + 1.0) * plan.acceleration
    }

    /// Takes over what usual cycles have made of it.
    pub fn catch_up(&mut self, plan: &Plan, caught: &Caught) {
        let first = self.heard_now(plan);
        if self.held {
            self.standing += caught.cycles;
        }
        self.frozen = caught.frozen;
        self.position = caught.position;
        (self.reading, self.filtered) = (caught.reading, caught.filtered);
        if caught.alive {
            (self.same, self.changed_at) = (0, caught.changed_at);
        } else {
            self.hear_again(caught.cycles, first, self.heard_now(plan));
        }
        self.quieten();
        self.lowest = caught.lowest;
        self.sliding = caught.sliding;
        self.free = caught.free;
        self.profile.position = caught.target;
        self.profile.speed = caught.speed;
    }

    /// The torque as it was read last and as it is filtered, in the same sense.
    #[inline(always)]
    pub(super) fn heard_now(&self, plan: &Plan) -> [f64; 2] {
        [plan.torque_sense * self.reading, self.filtered]
    }

    /// Takes note of whether the torque reading is alive, after that many cycles in which nobody did: of one that stands the filtered
    /// torque comes near.
    pub(super) fn hear_again(&mut self, cycles: u32, first: [f64; 2], [reading, filtered]: [f64; 2]) {
        // How much nearer, for sure.
        let far = match cycles {
            0..64 => f64::INFINITY,
            64..256 => 2e-4,
            _ => 1e-14,
        };
        let near = far * (first[1] - reading).abs() + 1e-9 * reading.abs();
        if reading == first[0] && !((filtered - reading).abs() > near) {
            self.same = self.same.saturating_add(cycles);
        } else {
            (self.same, self.changed_at) = (0, self.position);
        }
    }

    /// A torque that has not changed for long has no noise.
    pub(super) fn quieten(&mut self) {
        if self.same >= 64 {
            (self.rough, self.change) = (0.0, 0.0);
        }
    }

    /// Whether a torque that no longer changed would, within the way of a standing axis, not be taken for a stuck one.
    pub(super) fn reads_on(&self, plan: &Plan) -> bool {
        (self.anchor - self.changed_at).abs() + plan.standing_way <= 0.25 * plan.retract
    }

    /// Whether the command goes on: it ends where the motor stands pressed.
    #[must_use]
    pub fn goes_on(&self, plan: &Plan) -> bool {
        !self.held || self.standing < plan.hold
    }
}
