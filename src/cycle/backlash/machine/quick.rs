//! The cheap cycle: the long middle of a move, where speed is constant and nothing ends.
//!
//! It does what `step` would do, without a call, so that nine cycles of ten cost about a hundred instructions; in
//! every other cycle it touches nothing and leaves the work to `step`.

use super::*;

impl Backlash {
    /// Does this cycle if it is a cheap one; else returns false with nothing changed. The output is in `output`.
    #[inline(always)]
    pub fn quick(&mut self, input: &BacklashInput) -> bool {
        if self.left == 0 || !self.safe(input) {
            return false;
        }
        let done = match self.phase {
            Phase::Scan => self.quick_scan(input),
            _ if !self.profile.cruises() => false,
            Phase::ProbeBack => self.quick_probe(input, false),
            Phase::ProbeForth => self.quick_probe(input, true),
            Phase::SlideBack | Phase::SlideIn => {
                self.read_level(input);
                true
            }
            Phase::Approach => true,
            Phase::CreepIn => {
                self.see_furthest(input);
                true
            }
            _ => false,
        };
        if done {
            self.left -= 1;
            self.profile.cruise_on();
            self.put_out();
        }
        done
    }

    #[inline(always)]
    fn quick_scan(&mut self, input: &BacklashInput) -> bool {
        let travel = self.sense * (input.position_mm - self.turn);
        let torque = self.sense * input.torque;
        let smooth = self.watch.next(torque);
        if smooth > self.watch.news || travel >= self.watch.end || travel < -self.plan.stands() {
            return false;
        }
        if self.plan.slow_feed {
            if !self.profile.cruises() {
                return false;
            }
        } else {
            // Between two steps the command stands; its speed is 0.
            if self.hold <= 1 {
                return false;
            }
            self.hold -= 1;
            if self.hold > self.plan.read_from {
                return true;
            }
        }
        self.watch.smooth = smooth;
        self.curve_mut().add(travel, torque);
        true
    }

    #[inline(always)]
    fn quick_probe(&mut self, input: &BacklashInput, forth: bool) -> bool {
        let back = self.sense * (self.probe.turn - input.position_mm);
        if self.probe.ended(back, forth) {
            return false;
        }
        self.see_change(input);
        self.probe.add(back, forth, self.sense * input.torque);
        true
    }
}
