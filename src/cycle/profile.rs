//! Command generator with bounded speed and acceleration for one axis.
//!
//! The speed toward the goal is the largest `v` with `v ≤ v_max` and `v·(v + a) ≤ 2·a·d` (d: distance left), reached
//! at no more than `a` per second, so that a move neither overshoots its goal nor leaves its bounds, and a new
//! goal, speed or a stop may be given at any cycle without a jump in speed.

/// The commanded position and speed of one axis. Lengths in mm, time in servo cycles.
#[derive(Debug, Clone, Copy, Default)]
pub struct Profile {
    /// Commanded position in mm.
    pub position: f64,
    /// Commanded speed in mm per cycle, signed.
    pub speed: f64,
    goal: f64,
    speed_max: f64,
    acceleration: f64,
    /// How far from the goal the long middle of the move ends.
    braking: f64,
}

impl Profile {
    /// At rest at `position` (mm), with the largest change of speed, mm per cycle², positive.
    #[must_use]
    pub fn at_rest(position: f64, acceleration: f64) -> Profile {
        let mut profile = Profile { position, acceleration, ..Profile::default() };
        profile.go(position, acceleration);
        profile
    }

    /// Sets a new goal (mm) and the largest speed (mm per cycle, positive); the present speed is kept.
    pub fn go(&mut self, goal: f64, speed_max: f64) {
        self.goal = goal;
        self.speed_max = speed_max;
        self.braking = speed_max * (speed_max + self.acceleration) / (2.0 * self.acceleration) + 2.0 * speed_max;
    }

    /// Makes the place where the axis can come to rest soonest the new goal.
    pub fn stop(&mut self) {
        let way = self.speed * self.speed.abs() / (2.0 * self.acceleration);
        self.go(self.position + way, self.speed.abs() + self.acceleration);
    }

    /// Comes to rest here and now; for an axis that is no longer under command, or one at a creep.
    pub fn halt(&mut self) {
        self.speed = 0.0;
        self.goal = self.position;
    }

    /// Where the present move ends, mm.
    #[inline(always)]
    #[must_use]
    pub fn goal(&self) -> f64 {
        self.goal
    }

    /// Way left to the goal, mm, signed.
    #[inline(always)]
    #[must_use]
    pub fn left(&self) -> f64 {
        self.goal - self.position
    }

    /// The largest speed of the present move, mm per cycle.
    #[inline(always)]
    #[must_use]
    pub fn speed_max(&self) -> f64 {
        self.speed_max
    }

    /// How far from the goal braking may begin, mm.
    #[inline(always)]
    #[must_use]
    pub fn braking(&self) -> f64 {
        self.braking
    }

    /// Whether the next cycle is one at constant speed, with the goal further than braking takes.
    #[inline(always)]
    #[must_use]
    pub fn cruises(&self) -> bool {
        self.speed.abs() == self.speed_max && self.left() * self.speed > self.braking * self.speed_max
    }

    /// A cycle at constant speed; only right when `cruises`.
    #[inline(always)]
    pub fn cruise_on(&mut self) {
        self.position += self.speed;
    }

    /// The same as [`Profile::step`] so far from the goal that it neither arrives nor could be carried past it.
    #[inline(always)]
    pub fn step_under_way(&mut self) {
        self.speed = self.towards_goal();
        self.position += self.speed;
    }

    /// The speed toward the goal from which it still stops in time.
    #[inline(always)]
    fn towards_goal(&self) -> f64 {
        let (a, left) = (self.acceleration, self.left());
        // Braking by a each cycle takes v + (v − a) + … = v·(v + a)/(2a); the largest v that still stops in time.
        let stops = (0.25 * a * a + 2.0 * a * left.abs()).sqrt() - 0.5 * a;
        let wanted = lower(stops, self.speed_max).copysign(left);
        lower(higher(wanted, self.speed - a), self.speed + a)
    }

    /// Advances by one cycle. Returns true once the goal is reached and the axis commanded to rest.
    pub fn step(&mut self) -> bool {
        let a = self.acceleration;
        let left = self.left();
        if left.abs() <= a && self.speed.abs() <= 1.5 * a {
            self.position = self.goal;
            self.speed = 0.0;
            return true;
        }
        let speed = self.towards_goal();
        // Between whole multiples of a the sum above is short by up to a/8, which must not carry past the goal.
        let past = speed * left > left * left;
        self.speed = if past { left } else { speed };
        self.position += self.speed;
        false
    }

    /// Cycles that `step` may need for the present goal, bounded from above.
    #[must_use]
    pub fn cycles_bound(&self) -> f64 {
        let left = (self.goal - self.position).abs();
        // A wrong-way speed is first brought to rest, and its way walked back.
        left / self.speed_max + 4.0 * (self.speed_max + self.speed.abs()) / self.acceleration + 16.0
    }
}

/// The lower of two numbers, neither NaN: one instruction, where `f64::min` takes seven.
#[inline(always)]
#[must_use]
pub fn lower(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// The higher of two numbers, neither NaN.
#[inline(always)]
#[must_use]
pub fn higher(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Bounds and diligence: never faster, never harder, never past the goal, and there in time.
        #[test]
        fn keeps_its_bounds_and_arrives(goal in -50.0..50.0f64, v in 1e-5..0.05f64, a in 1e-6..1e-2f64) {
            let mut p = Profile::at_rest(0.0, a);
            p.go(goal, v);
            let bound = p.cycles_bound() as usize;
            let mut cycles = 0;
            loop {
                let before = p.speed;
                let arrived = p.step();
                prop_assert!(p.speed.abs() <= v + 1e-15, "speed {} of {v}", p.speed);
                prop_assert!((p.speed - before).abs() <= 1.5 * a + 1e-15, "jerks {} of {a}", p.speed - before);
                prop_assert!(p.position.abs() <= goal.abs() + 1e-9, "overshoot: {} of {}", p.position, goal);
                cycles += 1;
                if arrived { break; }
                prop_assert!(cycles <= bound, "not there after {cycles} cycles");
            }
            prop_assert_eq!(p.position, goal);
        }

        /// A stop at any cycle comes to rest within the bound and within the braking distance.
        #[test]
        fn stops_from_any_cycle(v in 1e-4..0.05f64, a in 1e-5..1e-2f64, at in 1usize..400) {
            let mut p = Profile::at_rest(0.0, a);
            p.go(100.0, v);
            for _ in 0..at { p.step(); }
            let (from, speed) = (p.position, p.speed);
            p.stop();
            let bound = p.cycles_bound() as usize;
            let mut cycles = 0;
            while !p.step() { cycles += 1; prop_assert!(cycles <= bound); }
            prop_assert!(p.position - from <= speed * speed / (2.0 * a) + speed + a + 1e-9);
        }
    }
}
