//! The usual cycle: all goes on as before, the correction in force is kept, and while measuring a point is read.
//!
//! It does what `careful` would do, without asking for all that can happen. After any other cycle that one says for how many
//! cycles more nothing ends, whether the correction could change too fast meanwhile, and what is put off until then: angles less
//! whole turns, the measured speed, what has turned. A reading weighs 1, for the speed is steady.

use super::*;
use wide::f64x2;

/// How far, relative, the turn of a usual cycle may be from that at the speed known.
const PACE: f64 = 0.1;
/// How much faster than that the spindle may be over all of them.
const DRIFT: f64 = 0.02;
/// Most cycles in a row.
const MOST: f64 = 1e6;

/// What a usual cycle is now.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// There is none.
    None,
    /// The correction is in force.
    Kept,
    /// And the deviation is measured.
    Measured,
    /// As `Kept`, of a correction so steep for this speed that each cycle asks how much it changes.
    SteepKept,
    /// As `Measured`, in the same way.
    SteepMeasured,
}

/// What a usual cycle needs. Angles in points behind the first, not wrapped.
#[derive(Debug, Clone, Copy)]
pub struct Usual {
    kind: Kind,
    /// Cycles more that can be usual, of how many.
    left: u32,
    granted: u32,
    /// Where the next cycle is to find the angle: a pace on from this one's; and this for the first usual cycle.
    next: f64,
    first: f64,
    /// Turn in a cycle at the speed known.
    pace: f64,
    /// What is to be taken off an angle read.
    base: f64,
    /// Largest differences: of the angle from where it is to be found, of the detected position from its target, mm.
    bounds: f64x2,
    /// What is put out beside the command.
    told: LearningOutput,
}

impl Usual {
    /// No usual cycles.
    pub const NONE: Usual = Usual {
        kind: Kind::None,
        left: 0,
        granted: 0,
        next: 0.0,
        first: 0.0,
        pace: 0.0,
        base: 0.0,
        bounds: f64x2::ZERO,
        told: LearningOutput {
            command_mm: 0.0,
            correction_um: 0.0,
            status: GIB_OK,
            phase: GIB_LEARNING_IDLE,
            message: GIB_OK,
            reasons: 0,
        },
    };
}

impl Learning {
    /// Says for how many cycles more nothing ends, after one that was put out.
    pub(super) fn see_usual(&mut self, input: &LearningInput, output: &LearningOutput) {
        let fastest = self.rate.abs() * (1.0 + PACE);
        let steady = self.rate.abs() * (1.0 - PACE) > self.plan.rate_min && fastest <= self.plan.turn_max;
        let rate = self.rate.abs() * (1.0 + DRIFT);
        let cycles = match self.phase {
            Phase::Settle if self.at > self.plan.points => (self.plan.settle - self.progress) / rate - 1.0,
            Phase::Measure => (self.plan.measure - self.progress) / rate - 1.0,
            Phase::Done => (KEPT * self.plan.measure - self.progress) / rate - 1.0,
            _ => 0.0,
        };
        let at = (self.angle + 0.5) * self.plan.scale;
        // From a cell's line to the next one's it is at most two steps from point to point.
        let change = (3.0 * fastest * self.plan.scale + 2.0) * self.steepest;
        let behind = (Place::at(at).read(&self.force) - self.correction).abs();
        // Half a point beyond any it is still within its bound, which a usual cycle does not look at.
        let within = self.report.correction_um + 0.5 * self.steepest <= self.plan.most;
        if !(steady
            && within
            && behind <= self.plan.slope
            && self.reasons == 0
            && self.presence == 1.0
            && self.blend == 0.0
            && cycles >= 1.0)
        {
            return;
        }
        let (pace, granted) = (self.rate * self.plan.scale, cycles.min(MOST) as u32);
        self.usual = Usual {
            kind: match (self.phase == Phase::Measure, change + behind > self.plan.slope) {
                (false, false) => Kind::Kept,
                (true, false) => Kind::Measured,
                (false, true) => Kind::SteepKept,
                (true, true) => Kind::SteepMeasured,
            },
            left: granted,
            granted,
            next: at + pace,
            first: at + pace,
            pace,
            base: input.angle_deg * self.plan.points_per_deg - at,
            bounds: f64x2::new([PACE * pace.abs(), self.plan.deviation]),
            told: *output,
        };
    }

    /// Ends the usual cycles, and does what they have put off.
    pub(super) fn settle_usual(&mut self) {
        let usual = &mut self.usual;
        let done = usual.granted - usual.left;
        (usual.kind, usual.left, usual.granted) = (Kind::None, 0, 0);
        if done > 0 {
            let at = usual.next - usual.pace;
            self.angle = fold(at / self.plan.scale - 0.5);
            self.progress += (usual.next - usual.first).abs() / self.plan.scale;
            self.cycles += u64::from(done);
            // By the angle less whole turns: the last cycle may have been before one that was taken off since.
            self.correction = Place::of(self.angle, self.plan.scale).read(&self.force);
        }
    }

    /// Does this cycle if it is a usual one, and returns its status; else none with nothing changed.
    #[inline(always)]
    pub(super) fn quick(&mut self, input: &LearningInput, output: &mut LearningOutput) -> Option<i32> {
        match self.usual.kind {
            Kind::Measured => self.quick_as::<true, false>(input, output),
            Kind::Kept => self.quick_as::<false, false>(input, output),
            _ => None,
        }
    }

    /// The same where the correction is steep; apart, so that the others need not ask.
    #[inline(always)]
    pub(super) fn quick_steep(&mut self, input: &LearningInput, output: &mut LearningOutput) -> Option<i32> {
        match self.usual.kind {
            Kind::SteepMeasured => self.quick_as::<true, true>(input, output),
            Kind::SteepKept => self.quick_as::<false, true>(input, output),
            _ => None,
        }
    }

    #[inline(always)]
    fn quick_as<const MEASURED: bool, const STEEP: bool>(
        &mut self,
        input: &LearningInput,
        output: &mut LearningOutput,
    ) -> Option<i32> {
        let usual = &mut self.usual;
        let at = input.angle_deg * self.plan.points_per_deg - usual.base;
        let place = Place::at(at);
        let deviation = input.target_mm - input.detected_mm;
        // Comparisons with what is no number are false.
        let well = f64x2::new([at - usual.next, deviation]).abs().simd_le(usual.bounds);
        if well.to_bitmask().wrapping_sub(3) | input.flags != 0 || place.entry > self.plan.points {
            return None;
        }
        let correction = place.read(&self.force);
        if STEEP {
            if (correction - self.correction).abs() > self.plan.slope {
                return None;
            }
            self.correction = correction;
        }
        let mut told = LearningOutput { status: GIB_BUSY, phase: GIB_LEARNING_MEASURE, ..LearningOutput::default() };
        if MEASURED {
            let entry = place.entry & (ENTRIES - 1);
            let bin = &mut self.bins[entry];
            bin.deviation += deviation;
            bin.target = input.target_mm;
            let reads = &mut self.weights[entry].steady;
            *reads = reads.wrapping_add(1);
        } else {
            told = usual.told;
        }
        usual.next = at + usual.pace;
        usual.left -= 1;
        if usual.left == 0 {
            usual.kind = Kind::None;
        }
        self.command = input.target_mm + 1e-3 * correction;
        *output = LearningOutput { command_mm: self.command, correction_um: correction, ..told };
        Some(told.status)
    }

    /// Where a whole turn has gone by, or the angle read begins anew, the usual cycles go on with other numbers; false when
    /// there are none.
    pub(super) fn turn_over(&mut self, angle_deg: f64) -> bool {
        let (usual, turn) = (&mut self.usual, self.plan.scale);
        let whole = |points: f64| points - turn * folded(points / turn);
        let jump = whole(angle_deg * self.plan.points_per_deg - usual.base - usual.next);
        let past = whole(usual.next - 0.5 * turn);
        if jump.abs() < f64::MAX {
            usual.base += jump + past;
            usual.next -= past;
            usual.first -= past;
        }
        usual.left > 0
    }

    /// Idle as long as it has never been started: the command is the target. False when that is no number.
    #[inline(always)]
    pub(super) fn idle(&mut self, input: &LearningInput, output: &mut LearningOutput) -> bool {
        let sound = input.target_mm.abs() <= f64::MAX && self.correction == 0.0;
        if sound {
            self.command = input.target_mm;
            *output = LearningOutput { command_mm: input.target_mm, ..LearningOutput::default() };
        }
        sound
    }
}
