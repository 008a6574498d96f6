//! The usual cycle: all goes on as before, the correction in force is kept, and while measuring a point is read.
//!
//! It does what `careful` would do, without asking for all that can happen. After any other cycle that one says for how many
//! cycles more nothing ends, and what is put off until then: angles less whole turns, the measured speed, what has turned.

use super::*;

/// How far, relative, the turn of a usual cycle may be from that at the speed known.
const PACE: f64 = 0.25;
/// Most cycles in a row.
const MOST: f64 = 1e6;

/// What a usual cycle needs. Angles in points behind the first, not wrapped.
#[derive(Debug, Clone, Copy)]
pub struct Usual {
    /// Cycles more that can be usual, of how many.
    left: u32,
    granted: u32,
    /// Angle of the last cycle, and of that before the first usual one.
    at: f64,
    from: f64,
    /// What is to be taken off an angle read.
    base: f64,
    /// Turn in a cycle at the speed known, and how far it may be from that.
    pace: f64,
    band: f64,
    /// What is put out.
    status: i32,
    phase: i32,
}

impl Usual {
    /// No usual cycles.
    pub const NONE: Usual = Usual {
        left: 0,
        granted: 0,
        at: 0.0,
        from: 0.0,
        base: 0.0,
        pace: 0.0,
        band: 0.0,
        status: GIB_OK,
        phase: GIB_LEARNING_IDLE,
    };

    /// What a usual cycle returns.
    #[inline(always)]
    #[must_use]
    pub fn status(&self) -> i32 {
        self.status
    }
}

impl Learning {
    /// Says for how many cycles more nothing ends, after one that was put out.
    pub(super) fn see_usual(&mut self, input: &LearningInput, output: &LearningOutput) {
        let rate = self.rate.abs() * (1.0 + PACE);
        let steady = self.rate.abs() * (1.0 - PACE) > self.plan.rate_min && rate <= self.plan.turn_max;
        let cycles = match self.phase {
            Phase::Settle if self.at > self.plan.points => (self.plan.settle - self.progress) / rate - 1.0,
            Phase::Measure => (self.plan.measure - self.progress) / rate - 1.0,
            Phase::Done => MOST,
            _ => 0.0,
        };
        if !(steady && self.reasons == 0 && self.presence == 1.0 && cycles >= 1.0) {
            return;
        }
        let at = (self.angle + 0.5) * self.plan.scale;
        let (pace, granted) = (self.rate * self.plan.scale, cycles.min(MOST) as u32);
        self.usual = Usual {
            left: granted,
            granted,
            at,
            from: at,
            base: input.angle_deg * self.plan.points_per_deg - at,
            pace,
            band: PACE * pace.abs(),
            status: output.status,
            phase: output.phase,
        };
    }

    /// Ends the usual cycles, and does what they have put off.
    pub(super) fn settle_usual(&mut self) {
        let done = self.usual.granted - self.usual.left;
        if done > 0 {
            self.angle = fold(self.usual.at / self.plan.scale - 0.5);
            self.progress += (self.usual.at - self.usual.from).abs() / self.plan.scale;
            self.cycles += u64::from(done);
        }
        (self.usual.left, self.usual.granted) = (0, 0);
    }

    /// Does this cycle if it is a usual one; else returns false with nothing changed.
    #[inline(always)]
    pub(super) fn quick(&mut self, input: &LearningInput, output: &mut LearningOutput) -> bool {
        let usual = &mut self.usual;
        if usual.left == 0 || input.flags != 0 {
            return false;
        }
        let at = input.angle_deg * self.plan.points_per_deg - usual.base;
        let place = Place::at(at);
        let left = (1e3 * (input.target_mm - input.detected_mm)) as f32;
        // Each comparison is false for what is no number.
        let steady = (at - usual.at - usual.pace).abs() <= usual.band;
        if !(steady && place.entry <= self.plan.points && left.abs() <= self.plan.deviation) {
            return false;
        }
        let (Some(cell), Some(bin)) = (self.tables[self.front & 1].get(place.entry), self.bins.get_mut(place.entry))
        else {
            return false;
        };
        let correction = cell.value + place.beyond * cell.slope;
        if !((correction - self.correction).abs() <= self.plan.slope) {
            return false;
        }
        if usual.phase == GIB_LEARNING_MEASURE {
            bin.add((at - usual.at).abs() as f32, left, input.target_mm);
        }
        usual.at = at;
        usual.left -= 1;
        self.correction = correction;
        self.command = input.target_mm + 1e-3 * f64::from(correction);
        *output = LearningOutput {
            command_mm: self.command,
            correction_um: correction.into(),
            status: usual.status,
            phase: usual.phase,
            message: GIB_OK,
            reasons: 0,
        };
        true
    }

    /// Idle as long as it has never been started: the command is the target. False when that is no number.
    #[inline(always)]
    pub(super) fn idle(&mut self, input: &LearningInput, output: &mut LearningOutput) -> bool {
        let sound = input.target_mm.abs() <= f64::MAX;
        if sound {
            self.command = input.target_mm;
            *output = LearningOutput { command_mm: input.target_mm, ..LearningOutput::default() };
        }
        sound
    }
}
