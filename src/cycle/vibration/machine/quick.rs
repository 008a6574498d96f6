//! The usual cycle: fully corrected, spindle and sensors as before.
//!
//! It does what [`Vibration::careful`] would do, without asking for all that can happen: after any other cycle that one says
//! whether the next can be usual, and the comparisons here whether it is.

use super::*;
use crate::cycle::lanes::within;
use wide::f64x2;

impl Vibration {
    /// Says whether the next cycle can be a usual one.
    pub(super) fn see_usual(&mut self) {
        let calm =
            self.trackers.surprise == [0.0; 2] && self.sensors.live() && self.spindle.calm() && self.leaving == 0.0;
        let known = self.revolution == f64::INFINITY && self.progress > 3.0;
        let simple = !self.plan.integrate && !self.plan.second_slide;
        let full = self.phase == Phase::Running && self.blend == 1.0;
        self.usual = if calm && known && simple && full { self.plan.pairs } else { 0 };
    }

    /// Does this cycle if it is a usual one; else returns false with nothing changed.
    #[inline(always)]
    pub(super) fn quick<const N: usize>(&mut self, input: &VibrationInput, output: &mut VibrationOutput) -> bool {
        let readings = f64x2::new(input.acceleration_m_s2);
        let turn = self.spindle.usual(&self.plan, input.angle_deg, 0.0 * input.scale_mm);
        // Comparisons with what is no number are false.
        let well = Sensors::plausible(&self.plan, readings) & turn.bounded.simd_le(self.spindle.bounds);
        if well.to_bitmask().wrapping_sub(3) | input.flags != 0 {
            return false;
        }
        let wheel = self.spindle.wheel_of(&turn, N);
        let left = self.trackers.left(&wheel, N, input.acceleration_m_s2, &self.displacement, turn.growth);
        if !within(left * left, self.trackers.bounds) {
            return false;
        }
        self.spindle.take(&turn);
        self.growth = turn.growth;
        self.progress += turn.turned;
        self.renew_slice::<N>(readings);
        let turning = self.turning(turn.turned);
        self.trackers.learn(&wheel, N, left, [turning * self.part, turning], turn.growth);
        let [.., seat, bearing] = left.to_array();
        let [seat, bearing] = [-f64::from(seat), -f64::from(bearing)];
        let relative = seat - bearing;
        self.position = input.scale_mm + 1e-3 * relative;
        self.correction = relative;
        *output = VibrationOutput {
            position_mm: self.position,
            correction_um: relative,
            displacement_um: [seat, bearing],
            relative_um: relative,
            speed_rpm: self.spindle.rate * self.plan.to_rpm,
            blend_ratio: 1.0,
            status: GIB_BUSY,
            phase: GIB_VIBRATION_CORRECTING,
            message: 0,
            reasons: 0,
        };
        true
    }

    /// Idle as long as it has never been started: the plain scale. False when that is no number.
    #[inline(always)]
    pub(super) fn idle(&mut self, input: &VibrationInput, output: &mut VibrationOutput) -> bool {
        let sound = input.scale_mm.abs() <= f64::MAX;
        if sound {
            self.position = input.scale_mm;
            *output = VibrationOutput { position_mm: input.scale_mm, ..VibrationOutput::default() };
        }
        sound
    }
}
