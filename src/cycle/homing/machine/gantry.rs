//! A gantry: both sides must stand on their stops, square within the tolerance.
//!
//! The crossbeam couples the sides. Where one is on its stop and the other still goes on, the beam racks and holds the other
//! with its own stiffness, which is less than a stop's: a side that presses against the beam must not be taken for one that
//! presses on its stop.

use super::*;
use crate::cycle::profile::{higher, lower};

/// Of the stiffer side's stiffness: a side below that is held by the beam. Stops that differ three times in stiffness differ
/// less here, since the drives are in series with them.
const OF_THE_STIFFER: f64 = 0.5;
/// Of a side's friction, at most, that is its motor's. A drive that gives less than that pulls its table back instead of pushing it: it
/// turns over to the other end of its clearance on the stop, which nothing tells the width of.
const MOTORS: f64 = 0.3;

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

    #[cold]
    fn askew(&mut self, apart: f64) {
        self.leave(self.out_of_square(apart));
    }

    fn out_of_square(&self, apart: f64) -> Fault {
        let (code, field, high) = (GIB_ERR_HOMING_SQUARE, "square_tolerance_mm\0", self.plan.square);
        Fault { code, field, value: apart, low: -high, high }
    }

    /// Whether both sides stood on their stops, and square.
    pub(super) fn squared(&self) -> Result<(), Fault> {
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
        self.pushed()
    }

    /// Whether every side was pushed onto its stop, not pulled there by the beam. Friction is the mean of both sides: what the beam does
    /// to the way back of one it does to that of the other in the opposite sense.
    fn pushed(&self) -> Result<(), Fault> {
        let [first, second] = &self.touches;
        let least = 0.5 * MOTORS * (first.friction() + second.friction());
        let level = first.level().min(second.level());
        let [value, low, high] = [level, least, self.plan.limit].map(|torque| torque * self.plan.torque_nm);
        let (code, field) = (GIB_ERR_HOMING_SQUARE, "sliding_nm\0");
        if level < least { Err(Fault { code, field, value, low, high }) } else { Ok(()) }
    }

    /// What moves the sides on the way back, where it is the beam: half of what their torques differ by. Neither goes then as its own
    /// friction lets it, and nothing is told of what was pressed on.
    pub(super) fn racked_back(&self) -> Option<Fault> {
        const OF_FRICTION: f64 = 0.5;
        let [first, second] = &self.sides;
        let (beam, most) =
            (0.5 * (first.sliding - second.sliding), 0.5 * OF_FRICTION * (first.sliding + second.sliding).abs());
        let [value, high] = [beam, most].map(|torque| torque * self.plan.torque_nm);
        let racked = self.plan.motors == 2 && beam.is_finite() && beam.abs() > most;
        racked.then_some(Fault { code: GIB_ERR_HOMING_SQUARE, field: "beam_nm\0", value, low: -high, high })
    }

    /// Takes into account what the beam does where one side touches before the other: while it stands and the other goes on by `late`, the
    /// beam's force grows, which is neither level nor line. It makes the later side seem to touch earlier and the earlier one later, by
    /// no more than that force over the stiffness.
    pub(super) fn reckon_beam(&mut self) {
        let late = self.touches[1].run_up() - self.touches[0].run_up();
        let force = self.beam(late) * late;
        self.touches[0].lean(-force);
        self.touches[1].lean(force);
    }

    /// The beam's stiffness at most: what the sides' torques have gone apart by since they were racked, over how far apart their tables
    /// went then, which is that of their motors less what the drives were wound up by: no more than if all that gives way were the
    /// drives. Where that is all of the way, or the first touch told nothing, the largest with which a side is not held.
    fn beam(&self, late: f64) -> f64 {
        let [first, second] = &self.touches;
        let soft = first.stiffness().min(second.stiffness());
        let most = OF_THE_STIFFER * soft;
        let (Some(one), Some(other)) = (first.racked_by(), second.racked_by()) else { return most };
        let apart = self.skew() + late;
        let tables = apart - (one - other) / soft;
        if tables * apart > 0.0 { lower(higher(0.5 * (one - other) / tables, 0.0), most) } else { most }
    }
}
