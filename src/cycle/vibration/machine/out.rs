//! What is put out: the scale and as much of the correction as is in force, in every state and whatever came in.

use super::*;

impl Vibration {
    /// Blends, and writes the output.
    pub(super) fn put_out(&mut self, plain: f64, displacement: [f64; 2], reasons: u32, output: &mut VibrationOutput) {
        let wanted = reasons == 0 && self.phase == Phase::Running;
        let blend = self.blend + if wanted { self.plan.fade } else { -self.plan.fade };
        self.blend = if blend > 1.0 {
            1.0
        } else if blend > 0.0 {
            blend
        } else {
            0.0
        };
        let relative = self.relative(displacement);
        let left = if self.leaving == 0.0 { 0.0 } else { self.part() };
        let correction = self.blend * relative + left;
        self.position = plain + 1e-3 * correction;
        self.correction = correction;
        self.seen |= reasons;
        *output = VibrationOutput {
            position_mm: self.position,
            correction_um: correction,
            displacement_um: displacement,
            relative_um: relative,
            speed_rpm: self.spindle.rate * self.plan.to_rpm,
            blend_ratio: self.blend,
            status: GIB_BUSY,
            phase: GIB_VIBRATION_CORRECTING,
            message: 0,
            reasons,
        };
        if !wanted {
            self.explain(output);
        }
    }

    /// Seat minus bearing, no further than both may be.
    fn relative(&self, [seat, bearing]: [f64; 2]) -> f64 {
        let (relative, most) = (seat - bearing, 2.0 * self.plan.displacement_max);
        if relative > most {
            most
        } else if relative < -most {
            -most
        } else {
            relative
        }
    }

    /// What is left in this cycle of a correction that ended at once.
    #[cold]
    fn part(&mut self) -> f64 {
        let left = self.leaving.abs() - self.leaves;
        self.leaving = if left > 0.0 { left.copysign(self.leaving) } else { 0.0 };
        self.leaving
    }

    /// Says why there is no correction.
    fn explain(&mut self, output: &mut VibrationOutput) {
        let bad = output.reasons & BAD;
        self.degraded += u64::from(bad != 0);
        output.message = message(bad);
        output.phase = if bad != 0 { GIB_VIBRATION_DEGRADED } else { GIB_VIBRATION_WAITING };
        if self.phase == Phase::Stopping {
            output.phase = GIB_VIBRATION_STOPPING;
            output.message = self.fault.code;
            if self.blend == 0.0 {
                self.phase = Phase::Failed;
                output.phase = GIB_VIBRATION_FAILED;
                output.status = self.fault.code;
            }
        }
    }

    /// Idle or Failed: the plain scale, once the correction has gone.
    pub(super) fn rest(&mut self, plain: f64, output: &mut VibrationOutput) {
        let correction_um = self.part();
        self.position = plain + 1e-3 * correction_um;
        self.correction = correction_um;
        let failed = self.phase == Phase::Failed;
        *output = VibrationOutput {
            position_mm: self.position,
            correction_um,
            status: self.fault.code,
            message: self.fault.code,
            phase: if failed { GIB_VIBRATION_FAILED } else { GIB_VIBRATION_IDLE },
            ..VibrationOutput::default()
        };
    }

    /// The scale itself is no number: the last position, and an error that is kept.
    #[cold]
    pub(super) fn blind(&mut self, input: &VibrationInput, output: &mut VibrationOutput) {
        if self.busy() {
            let field = if input.scale_mm.is_finite() { "second_slide_mm\0" } else { "scale_mm\0" };
            self.fault = Fault { code: GIB_ERR_NON_FINITE, field, ..Fault::NONE };
            self.phase = Phase::Failed;
            // The correction is still in the position, and goes from it as it does after any fault.
            let relative = self.relative(self.known_now());
            self.leaving += self.blend * relative;
            self.leaves = self.leaves.max(relative.abs() * self.plan.fade);
            self.blend = 0.0;
        }
        let position = self.position;
        self.rest(position, output);
        (self.position, output.position_mm) = (position, position);
        output.status = GIB_ERR_NON_FINITE;
        output.message = GIB_ERR_NON_FINITE;
    }

    /// Displacements of seat and bearing at the last angle.
    fn known_now(&self) -> [f64; 2] {
        if self.plan.integrate {
            return self.held;
        }
        let wheel = self.spindle.wheel(PAIRS);
        let [seat, bearing] = &self.displacement;
        [(self.growth * seat.value(&wheel, PAIRS)).into(), (self.growth * bearing.value(&wheel, PAIRS)).into()]
    }
}
