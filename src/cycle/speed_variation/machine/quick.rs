//! The cheap cycle: the middle of a slope, where nothing ends and the motor has enough.
//!
//! A slope, of a triangle or back to the mean, has the same change in every cycle, and what the motor has left shrinks with speed
//! alone: how many cycles can go by unwatched is known when the slope begins. A sine's change differs from cycle to cycle; there the motor is
//! asked each time, without a division, and only what it has not enough for is left to `go`.

use super::*;

impl SpeedVariation {
    /// Does this cycle if it is a quiet one in which the motor has enough, with the output in `output`; else returns false,
    /// and [`turn`](Self::turn) must follow. The count is taken down in any case, which costs less than to look first;
    /// `turn` gives it back.
    #[inline(always)]
    pub fn quick(&mut self, input: &SpeedVariationInput) -> bool {
        self.quiet -= 1;
        self.quiet >= 0 && self.same(input) && self.steadily()
    }

    /// A cycle that was granted; false, and nothing is done, where the motor has not enough for a sine's.
    #[inline(always)]
    pub(super) fn steadily(&mut self) -> bool {
        if self.slope {
            self.speed += self.steady;
        } else {
            let (phasor, swing) = (self.turned(), self.swing + self.steady);
            let target = self.now.asked[0] + swing * phasor[1];
            let change = target - self.speed;
            let faster = if target > self.speed { target } else { self.speed };
            if !self.has(change, faster) {
                return false;
            }
            (self.phasor, self.swing, self.speed) = (phasor, swing, target);
            self.output.torque_nm = change * self.to_torque;
        }
        self.output.speed_command_rpm = self.speed * self.to_rpm;
        true
    }

    /// Whether an input wants what the last one did. Nothing equals what is no number.
    #[inline(always)]
    pub(super) fn same(&self, input: &SpeedVariationInput) -> bool {
        let ([a, b], [c, d]) = (pairs(input), self.seen);
        let equal = |k: usize| (a.0[k] == c.0[k]) & (b.0[k] == d.0[k]);
        equal(0) & equal(1) && input.flags == self.flags
    }

    /// Grants the cycles that are like this one, in which the speed went by `change`.
    pub(super) fn grant(&mut self, change: f64) {
        let (missing, rate) = (self.now.swing - self.swing, self.now.swing_rate);
        let (cycles, steady) = match () {
            () if self.slope => (self.slope_left(change), change),
            () if missing == 0.0 => (i32::MAX, 0.0),
            () if missing >= rate => ((missing / rate) as i32, rate),
            () => (0, 0.0),
        };
        self.steady = steady;
        // As long as something is worked out no cycle needs but the quick look.
        (self.quiet, self.meanwhile) = if self.piece == Piece::Nothing { (cycles, 0) } else { (0, cycles) };
    }

    /// Cycles in which a triangle goes on at its rate, neither turned at a corner nor held by the motor; one of them is kept
    /// back for rounding. None under a heavier load than that for which it was worked out what the motor has enough for.
    fn slope_left(&self, change: f64) -> i32 {
        let Setting { corners: [low, high], free: [rise, brake], rate, asked: [.., cutting], .. } = self.now;
        // In the sense it goes on in: a corner met exactly has turned it, though the change was still the old one.
        let steady = ((if self.rising { change } else { -change }) - rate).abs() <= 1e-9 * rate;
        let way = match self.rising {
            _ if !steady || self.asked[3] > cutting => 0.0,
            true => high.min(rise) - self.speed,
            false if self.speed <= brake => self.speed - low,
            false => 0.0,
        };
        ((way / rate) as i32).saturating_sub(1).max(0)
    }

    /// Whether the motor has enough for a change in a cycle at a speed, and at lower ones, without friction's help. What is no
    /// number is not enough.
    #[inline(always)]
    pub(super) fn has(&self, change: f64, speed: f64) -> bool {
        let [power, torque, used, viscous] = self.in_changes;
        let needs = change.abs() + used + viscous * speed;
        needs <= torque && needs * speed <= power
    }
}
