//! An offset that follows its target with bounded speed and acceleration.
//!
//! The target may jump (offsets switched on or off) or move (z along the path). It is met in the first cycle in which a
//! step onto it keeps both bounds; until then the offset closes in with the speed of the target and what can still be
//! braked over the distance e: v·(v + a) ≤ 2·a·e. By the same law it never moves outward faster than it can stop within the
//! largest offset: a target that rests there, or that turns round before it, is not overshot beyond.

use crate::cycle::profile::{higher, lower};

/// Largest step and largest change of step, in the unit of the offset, per cycle and per cycle²; and the largest offset.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Largest step a cycle.
    pub speed: f64,
    /// Largest change of the step a cycle.
    pub acceleration: f64,
    /// Largest offset, either way.
    pub most: f64,
}

impl Bounds {
    /// Largest step from which the offset stops within a way, when braked over a step less a each cycle. Whole cycles take up to a/8
    /// more than the law above; a step of a or less stops at once.
    #[must_use]
    pub fn stops(&self, way: f64) -> f64 {
        let a = self.acceleration;
        if way <= a { higher(way, 0.0) } else { self.closes(way - 0.125 * a) }
    }

    /// Way that braking from such a step takes at most, when the step itself is made already.
    #[must_use]
    pub fn braking(&self, step: f64) -> f64 {
        let a = self.acceleration;
        if step > a { 0.5 * step * (step - a) / a + 0.125 * a } else { 0.0 }
    }

    /// Step by the law above.
    fn closes(&self, way: f64) -> f64 {
        let a = self.acceleration;
        (0.25 * a * a + 2.0 * a * way).sqrt() - 0.5 * a
    }
}

/// One offset.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Follower {
    /// The offset now.
    pub value: f64,
    /// Its last step.
    pub rate: f64,
    /// Target of the cycle before.
    target: f64,
}

impl Follower {
    /// Steps onto the target when that keeps the bounds; else false, and nothing is changed.
    fn meets(&mut self, target: f64, bounds: &Bounds) -> bool {
        let [step, change] = self.onto(target);
        let size = step.abs();
        let within = size <= bounds.speed && change.abs() <= bounds.acceleration;
        // Where it lands it must be able to stop.
        let meets = within && target.abs() + bounds.braking(size) <= bounds.most;
        if meets {
            self.land(target, step);
            self.meant();
        }
        meets
    }

    /// The step onto a target, and how it differs from the last one.
    #[inline(always)]
    #[must_use]
    pub fn onto(&self, target: f64) -> [f64; 2] {
        let step = target - self.value;
        [step, step - self.rate]
    }

    /// Makes that step. Before any other than such steps, [`Follower::meant`] is to be told.
    #[inline(always)]
    pub fn land(&mut self, target: f64, step: f64) {
        (self.value, self.rate) = (target, step);
    }

    /// The last step went onto its target.
    #[inline(always)]
    pub fn meant(&mut self) {
        self.target = self.value;
    }

    /// One cycle toward a finite target. True when the offset is there.
    #[inline(always)]
    pub fn step(&mut self, target: f64, bounds: &Bounds) -> bool {
        if self.meets(target, bounds) {
            return true;
        }
        let (v, a) = (bounds.speed, bounds.acceleration);
        let (left, own) = (target - self.value, target - self.target);
        // A jump of the target is no motion to go along with.
        let own = if own.abs() <= v { own } else { 0.0 };
        let wanted = own + bounds.closes((left - own).abs()).copysign(left - own);
        let room = bounds.most - self.value * 1f64.copysign(wanted);
        let wanted = lower(wanted.abs(), lower(bounds.stops(room), v)).copysign(wanted);
        self.rate = lower(higher(wanted, self.rate - a), self.rate + a);
        self.value += self.rate;
        self.target = target;
        false
    }

    /// At rest on the target of the last step.
    #[must_use]
    pub fn rests(&self) -> bool {
        self.rate == 0.0 && self.value == self.target
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Bounds hold whatever the target does, and a target that rests is reached in time.
        #[test]
        fn keeps_its_bounds_and_arrives(
            goals in prop::collection::vec(-5.0..5.0f64, 1..6),
            v in 1e-4..0.05f64, a in 1e-6..1e-3f64, slope in -1e-3..1e-3f64, change in 1usize..300,
        ) {
            let bounds = Bounds { speed: v, acceleration: a, most: 1e3 };
            let mut f = Follower::default();
            let follow = |f: &mut Follower, target: f64| -> Result<bool, TestCaseError> {
                let before = *f;
                let there = f.step(target, &bounds);
                prop_assert!(f.rate.abs() <= v * 1.000001, "speed {} of {v}", f.rate);
                prop_assert!((f.rate - before.rate).abs() <= a * 1.000001, "change {} of {a}", f.rate - before.rate);
                prop_assert!((f.value - before.value - f.rate).abs() < 1e-12);
                Ok(there)
            };
            for goal in &goals {
                for i in 0..change {
                    follow(&mut f, goal + slope * i as f64)?;
                }
            }
            let goal = goals[0];
            let bound = ((goal - f.value).abs() / v + 8.0 * v / a + 2.0 * (40.0 / a).sqrt() + 50.0) as usize;
            let mut cycles = 0;
            while !(follow(&mut f, goal)? && f.rests()) {
                cycles += 1;
                prop_assert!(cycles <= bound, "not there after {cycles}: {f:?}");
            }
        }

        /// The largest offset is kept, whatever a target within it does, and is reached.
        #[test]
        fn keeps_the_largest_offset(
            goals in prop::collection::vec(-1.0..1.0f64, 1..40), most in 1e-4..5.0f64,
            v in 1e-4..0.5f64, a in 1e-6..0.5f64, slope in -2e-2..2e-2f64, change in 1usize..60,
        ) {
            let bounds = Bounds { speed: v, acceleration: a, most };
            let mut f = Follower::default();
            for goal in &goals {
                for i in 0..change {
                    let before = f;
                    f.step((most * goal + slope * i as f64).max(-most).min(most), &bounds);
                    prop_assert!(f.value.abs() <= most * (1.0 + 1e-12), "{} of {most}", f.value);
                    prop_assert!(f.rate.abs() <= v * 1.000001 && (f.rate - before.rate).abs() <= a * 1.000001);
                }
            }
            let bound = (2.0 * most / v + 8.0 * v.min((2.0 * a * most).sqrt()) / a + 2.0 * (40.0 * most / a).sqrt() + 50.0) as usize;
            let mut cycles = 0;
            while !(f.step(most, &bounds) && f.rests()) {
                cycles += 1;
                prop_assert!(cycles <= bound, "not there after {cycles}: {f:?}");
            }
        }

        /// A target in slow motion is met, and then followed without lag.
        #[test]
        fn meets_a_moving_target(speed in -0.004..0.004f64, a in 1e-5..1e-3f64) {
            let bounds = Bounds { speed: 0.01, acceleration: a, most: 1e3 };
            let mut f = Follower::default();
            let mut met = 0;
            for i in 0..20000 {
                met = if f.step(1.0 + speed * i as f64, &bounds) { met + 1 } else { 0 };
            }
            prop_assert!(met > 100, "met only for {met} cycles");
        }
    }
}
