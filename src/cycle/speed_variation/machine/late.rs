//! The deadlines: of a rise to the upper corner, and of the way back to the mean speed. A fall has none: there friction helps, and
//! a motor that has enough to rise has enough to brake.

use super::*;
use crate::cycle::profile::{higher, lower};

/// What no way back may take longer than, s, beside the second that every one has: as long as the longest period.
const LONGEST_S: f64 = 600.0;

impl SpeedVariation {
    /// The deadline of a rise: a corner that the motor has not reached in twice the time is where the speed is by then.
    #[inline(never)]
    pub(super) fn stay_behind(&mut self, by: f64) {
        let [low, high] = self.now.corners;
        // Toward a corner that was moved it goes at the motor's own pace, as it does until a change is worked out.
        let on_its_way = self.rising && self.speed > low && self.piece == Piece::Nothing;
        self.behind = if on_its_way { self.behind + by } else { 0.0 };
        if self.behind > high - low {
            self.now.corners[1] = self.speed;
            self.output.amplitude_ratio = higher(self.speed / self.mean() - 1.0, 0.0);
            self.output.amplitude_limit_ratio = self.output.amplitude_ratio;
            self.output.message = GIB_ERR_SPEED_VARIATION_NONE;
            (self.rising, self.behind) = (false, 0.0);
        }
    }

    /// Cycles that the way back may take under the present load: twice those that it takes the motor, and a second. For a
    /// motor that has nothing left they are those of one that has enough.
    pub(super) fn time_for_the_way(&self) -> u32 {
        // What the motor has left shrinks with speed: at the fastest it is the least of the way.
        let (mean, speed) = (self.mean(), self.speed);
        let (fastest, help) = if mean > speed { (mean, 0.0) } else { (speed, self.brake_help) };
        let has = self.per_nm * (self.motor.left(fastest) + help);
        let pace = if has > 0.0 { lower(has, self.back) } else { self.back };
        let seconds = lower(2.0 * self.way / pace * self.plan.cycle_s, LONGEST_S) + 1.0;
        (seconds / self.plan.cycle_s) as u32
    }

    /// Gives the way back the time that it needs under a load that has changed. By the slowest pace on the way, not anew from each
    /// change on: else a load that comes and goes would put the end off for ever.
    pub(super) fn give_time(&mut self) {
        let deadline = self.time_for_the_way().max(self.deadline);
        self.patience += deadline - self.deadline;
        self.deadline = deadline;
    }

    /// Takes a share of its power from the motor, without telling what was worked out for it.
    #[cfg(test)]
    pub(in crate::cycle::speed_variation) fn lose(&mut self, share: f64) {
        self.motor.power *= 1.0 - share;
        self.in_changes[0] *= 1.0 - share;
        self.now.free[0] = 0.0;
        self.look_anew();
    }
}
