//! What in a cycle's input must end a calibration, and what leaves the axis beyond command.

use super::{Calibration, Phase};
use crate::cycle::backlash::io::flagged;
use crate::cycle::calibration::io::CalibrationInput;
use crate::error::*;

/// Name of the input without which the axis is lost.
const POSITION: &str = "position_mm\0";

impl Calibration {
    /// A cycle without an input: it cannot be told any more whether the axis follows, so the amplitude falls, from this cycle on.
    #[cold]
    pub fn miss(&mut self) {
        if !self.busy() {
            return;
        }
        self.leave(Fault { field: "input\0", ..Fault::of(GIB_ERR_NULL) });
        if self.busy() {
            self.swing();
            self.command();
        }
    }

    /// Anything in this cycle's input that must end the calibration. On the way out only what stops the drive does.
    #[inline(always)]
    pub(super) fn danger(&self, input: &CalibrationInput) -> Option<Fault> {
        let [a1, a2] = input.acceleration_m_s2;
        let [s1, s2, s3] = self.plan.saturation;
        let off = input.position_mm - self.start;
        // Each comparison is false for what is no number.
        let safe = input.flags == 0
            && (off.abs() <= self.plan.travel)
            && ((input.position_mm - self.output.target_position_mm).abs() <= self.plan.lag)
            && (input.torque.abs() <= self.plan.torque_bound)
            && (a1.abs() < s1)
            && (a2.abs() < s2)
            && (input.ball_bar_um.abs() < s3);
        if safe { None } else { self.name_danger(input).filter(|f| self.phase != Phase::Stopping || stops(f)) }
    }

    #[cold]
    fn name_danger(&self, input: &CalibrationInput) -> Option<Fault> {
        if input.flags != 0 {
            return Some(flagged(input.flags));
        }
        let [a1, a2] = input.acceleration_m_s2;
        let off = input.position_mm - self.start;
        let lag = input.position_mm - self.output.target_position_mm;
        let [s1, s2, s3] = self.plan.saturation;
        let bound = self.plan.torque_bound;
        [
            (GIB_ERR_TRAVEL_BOUND, POSITION, off, self.plan.travel),
            (GIB_ERR_LAG, POSITION, lag, self.plan.lag),
            (GIB_ERR_TORQUE_BOUND, "torque\0", input.torque, bound),
            (GIB_ERR_CALIBRATION_SATURATED, "acceleration_m_s2[0]\0", a1, s1),
            (GIB_ERR_CALIBRATION_SATURATED, "acceleration_m_s2[1]\0", a2, s2),
            (GIB_ERR_CALIBRATION_SATURATED, "ball_bar_um\0", input.ball_bar_um, s3),
        ]
        .into_iter()
        .find(|(_, _, value, most)| !(value.abs() <= *most))
        .map(|(code, field, value, most)| {
            let code = if value.is_finite() { code } else { GIB_ERR_NON_FINITE };
            Fault { code, field, value, low: -most, high: most }
        })
    }
}

/// Faults after which the axis cannot be brought back under command.
pub(super) fn stops(fault: &Fault) -> bool {
    let lost = fault.code == GIB_ERR_NON_FINITE && fault.field == POSITION;
    lost || matches!(fault.code, GIB_ERR_DRIVE_FAULT | GIB_ERR_LAG | GIB_ERR_TRAVEL_BOUND)
}
