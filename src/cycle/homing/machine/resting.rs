//! The usual cycles of an axis that rests while its touch is evaluated: within bounds in which nothing can be wrong with it, see
//! [`Side::see_rest`], they sense what [`Homing::step`] would, and do their slice of the work.

use super::*;

impl Homing {
    /// Whether the next cycles may be usual ones of an axis that rests.
    #[inline(always)]
    #[must_use]
    pub fn rests(&self) -> bool {
        self.at_rest
    }

    /// Says for how many cycles more that may be, after a cycle that was put out.
    pub(super) fn see_rest(&mut self) {
        let plan = &self.plan;
        let left = self.deadline.saturating_sub(self.now.saturating_add(2)).min(self.fit.rests());
        if self.fitting >= plan.motors || self.output.new_events != 0 || left == 0 {
            return;
        }
        let (now, pressed) = (self.now, self.touch >= plan.touches);
        let mut sides = self.sides.iter_mut().zip(&self.touches).take(plan.motors);
        self.at_rest = sides.all(|(side, touches)| side.see_rest(plan, now, pressed.then(|| touches.press(plan))));
        self.rests_on = left.min(i32::MAX as u32) as i32;
    }

    /// Ends that: the sides catch up.
    #[inline(always)]
    pub(super) fn end_rest(&mut self) {
        if self.at_rest {
            self.sides.iter_mut().take(self.plan.motors).for_each(|side| side.end_rest(self.now));
            self.at_rest = false;
        }
    }

    /// One servo cycle if it is a usual one of an axis of that many motors that rests; else nothing is done, and [`Homing::step`] must
    /// follow. The work of it is left to [`Homing::work_at_rest`], where [`Homing::works`].
    #[inline(always)]
    pub fn quick_at_rest<const MOTORS: usize>(&mut self, input: &HomingInput) -> bool {
        let odd = u64::from(input.flags) | (input.torque_limit.to_bits() ^ self.in_force);
        self.rests_on -= 1;
        if self.rests_on < 0 || odd != 0 {
            return false;
        }
        let plan = &self.plan;
        let filtered: [f64; MOTORS] = core::array::from_fn(|i| self.sides[i].filter(plan, input.torque[i]));
        if (0..MOTORS).any(|i| !self.sides[i].rests(input.position_mm[i], filtered[i])) {
            return false;
        }
        self.now += 1;
        self.fit.count();
        for (i, filtered) in filtered.into_iter().enumerate() {
            self.sides[i].take_in_at_rest(plan, self.now, [input.position_mm[i], input.torque[i]], filtered);
        }
        true
    }

    /// Whether such a cycle has work to do.
    #[inline(always)]
    #[must_use]
    pub fn works(&self) -> bool {
        self.fit.works()
    }

    /// A slice of the work.
    pub fn work_at_rest(&mut self) {
        if self.fit.work(&self.sides[self.fitting & 1].trace) {
            self.fitted_side();
            self.rests_on = 0;
        }
        let rest = self.fit.rests().min(i32::MAX as u32) as i32;
        self.rests_on = self.rests_on.min(rest);
    }
}
