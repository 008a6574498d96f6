//! A gantry: both sides must stand on their stops, square within the tolerance.
//!
//! The crossbeam couples the sides. Where one is on its stop and the other still goes on, the beam racks and holds the other
//! with its own stiffness, which is less than a stop's: a side that presses against the beam must not be taken for one that
//! presses on its stop.

use super::*;

/// Of the stiffer side's stiffness: a side below that is held by the beam. Stops that differ three times in stiffness differ
/// less here, since the drives are in series with them.
const OF_THE_STIFFER: f64 = 0.5;
/// Of the tolerance: sides that have gone apart by that much before both stood have racked.
const RACKED: f64 = 0.1;

impl Homing {
    /// Way to the stop of motor 1 minus that of motor 2.
    pub(super) fn skew(&self) -> f64 {
        if self.plan.motors == 2 { self.touches[0].contact() - self.touches[1].contact() } else { 0.0 }
    }

    /// How far apart the two sides have gone since the start.
    #[inline(always)]
    pub(super) fn apart(&self) -> f64 {
        self.sides[0].travel(&self.plan) - self.sides[1].travel(&self.plan)
    }

    /// Under way: ends where the sides have gone too far apart.
    #[inline(always)]
    pub(super) fn check_square(&mut self) {
        let apart = self.apart();
        if apart.abs() > self.plan.square {
            self.askew(apart);
        }
    }

    /// Keeps how far apart the two sides stand where both press.
    pub(super) fn keep_apart(&mut self) {
        self.pressed_apart = if self.plan.motors == 2 { self.apart() } else { 0.0 };
    }

    #[cold]
    fn askew(&mut self, apart: f64) {
        self.leave(self.out_of_square(apart));
    }

    fn out_of_square(&self, apart: f64) -> Fault {
        let (code, field, high) = (GIB_ERR_HOMING_SQUARE, "square_tolerance_mm\0", self.plan.square);
        Fault { code, field, value: apart, low: -high, high }
    }

    /// What a touch found wrong, which is the racked beam where one side is held by it.
    pub(super) fn or_racked(&self, fault: Fault) -> Fault {
        let held = match fault.code {
            GIB_ERR_HOMING_SHAPE | GIB_ERR_HOMING_NOISE | GIB_ERR_HOMING_TIGHT_SPOT | GIB_ERR_HOMING_SOFT_STOP => true,
            GIB_ERR_HOMING_TORQUE_STUCK => self.alive(), // the beam pulls the side toward the stop
            _ => false,
        };
        let racked = self.pressed_apart.abs() > RACKED * self.plan.square;
        if held && racked { self.out_of_square(self.pressed_apart) } else { fault }
    }

    /// Whether both sides stood on their stops, and square.
    pub(super) fn squared(&self) -> Result<(), Fault> {
        if self.plan.motors < 2 {
            return Ok(());
        }
        let skew = self.skew();
        if skew.abs() > self.plan.square {
            return Err(self.out_of_square(skew));
        }
        let [first, second] = [&self.touches[0], &self.touches[1]].map(|touches| touches.stiffness());
        let (soft, stiff) = (first.min(second), first.max(second));
        if soft < OF_THE_STIFFER * stiff {
            let (code, field) = (GIB_ERR_HOMING_SQUARE, "stiffness_nm_mm\0");
            let [value, low, high] = [soft, OF_THE_STIFFER * stiff, stiff].map(|k| k * self.plan.torque_nm);
            return Err(Fault { code, field, value, low, high });
        }
        Ok(())
    }
}
