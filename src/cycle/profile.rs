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
    /// Where the move ends, in mm.
    pub goal: f64,
    /// Largest speed in mm per cycle, positive.
    pub speed_max: f64,
    /// Largest change of speed in mm per cycle², positive.
    pub acceleration: f64,
}

impl Profile {
    /// At rest at `position`.
    #[must_use]
    pub fn at_rest(position: f64, acceleration: f64) -> Profile {
        Profile { position, speed: 0.0, goal: position, speed_max: acceleration, acceleration }
    }

    /// Sets a new goal and speed bound; the present speed is kept.
    pub fn go(&mut self, goal: f64, speed_max: f64) {
        self.goal = goal;
        self.speed_max = speed_max;
    }

    /// Makes the place where the axis can come to rest soonest the new goal.
    pub fn stop(&mut self) {
        self.goal = self.position + self.speed * self.speed.abs() / (2.0 * self.acceleration);
    }

    /// Advances by one cycle. Returns true once the goal is reached and the axis commanded to rest.
    #[inline(always)]
    pub fn step(&mut self) -> bool {
        let a = self.acceleration;
        let left = self.goal - self.position;
        // Braking by a each cycle takes v + (v − a) + … = v·(v + a)/(2a); the largest v that still stops in time.
        let stops = (0.25 * a * a + 2.0 * a * left.abs()).sqrt() - 0.5 * a;
        let wanted = stops.min(self.speed_max).copysign(left);
        if left.abs() <= a && self.speed.abs() <= 1.5 * a {
            self.position = self.goal;
            self.speed = 0.0;
            return true;
        }
        let speed = wanted.max(self.speed - a).min(self.speed + a);
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
