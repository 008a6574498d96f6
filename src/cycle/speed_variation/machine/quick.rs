//! The cheap cycle: the middle of a slope, where nothing ends and the motor has enough.
//!
//! A triangle's slope has the same change in every cycle, and what the motor has left shrinks with speed alone: how many
//! cycles can go by unwatched is known when the slope begins. A sine's change differs from cycle to cycle; there the motor is
//! asked each time, without a division, and only what it has not enough for is left to `go`.

use super::*;

impl SpeedVariation {
    /// Does this cycle if it is a quiet one in which the motor has enough, with the output in `output`; else returns false,
    /// and [`turn`](Self::turn) must follow. The count is taken down in any case, which costs less than to look first;
    /// `turn` gives it back.
    #[inline(always)]
    pub fn quick(&mut self, input: &SpeedVariationInput) -> bool {
        self.quiet -= 1;
        if self.quiet < 0 || !self.same(input) {
            return false;
        }
        match self.plan.wave {
            Wave::Triangle => self.speed += self.steady,
            Wave::Sine => {
                let (phasor, swing) = (self.turned(), self.swing + self.steady);
                let target = self.now.asked[0] + swing * phasor[1];
                let change = target - self.speed;
                let faster = if target > self.speed { target } else { self.speed };
                let [power, torque, used, viscous] = self.in_changes;
                let needs = change.abs() + used + viscous * faster;
                if !(needs <= torque && needs * faster <= power) {
                    return false;
                }
                (self.phasor, self.swing, self.speed) = (phasor, swing, target);
                self.output.torque_nm = change * self.to_torque;
            }
        }
        self.output.speed_command_rpm = self.speed * self.to_rpm;
        true
    }

    /// Whether an input wants what the last one did. Nothing equals what is no number.
    #[inline(always)]
    pub(super) fn same(&self, input: &SpeedVariationInput) -> bool {
        let ([a, b], [c, d]) = (pairs(input), self.seen);
        let equal = |k: usize| (a.0[k] == c.0[k]) & (b.0[k] == d.0[k]);
        equal(0) & equal(1) && input.flags == 0
    }

    /// Grants the cycles that are like this one, in which the speed went by `change`.
    pub(super) fn grant(&mut self, change: f64) {
        (self.quiet, self.steady) = match self.plan.wave {
            _ if self.piece != Piece::Nothing => (0, 0.0),
            Wave::Triangle => (self.slope_left(change), change),
            Wave::Sine => {
                let (missing, rate) = (self.now.swing - self.swing, self.now.swing_rate);
                if missing == 0.0 {
                    (i32::MAX, 0.0)
                } else if missing >= rate {
                    ((missing / rate) as i32, rate)
                } else {
                    (0, 0.0)
                }
            }
        };
    }

    /// Cycles in which a triangle goes on at its rate, neither turned at a corner nor held by the motor; one of them is kept
    /// back for rounding.
    fn slope_left(&self, change: f64) -> i32 {
        let Setting { corners: [low, high], free: [rise, brake], rate, .. } = self.now;
        // In the sense it goes on in: a corner met exactly has turned it, though the change was still the old one.
        let steady = ((if self.rising { change } else { -change }) - rate).abs() <= 1e-9 * rate;
        let way = match self.rising {
            _ if !steady => 0.0,
            true => high.min(rise) - self.speed,
            false if self.speed <= brake => self.speed - low,
            false => 0.0,
        };
        ((way / rate) as i32).saturating_sub(1).max(0)
    }
}
