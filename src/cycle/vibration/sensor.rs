//! Whether an accelerometer can be believed.
//!
//! A reading is bad when it is no number, at full scale, or beyond what is plausible. A sensor is stuck when its reading
//! stays the same to the last digit while the spindle turns by a quarter and for sixteen cycles.

use super::io::*;
use super::plan::Plan;

/// Part of a revolution, and cycles, through which a living sensor does not repeat itself.
const STUCK_TURNS: f64 = 0.25;
const STUCK_CYCLES: u32 = 16;

/// The last reading of an accelerometer, and for how long it was the same.
#[derive(Debug, Clone, Copy, Default)]
pub struct Sensor {
    last: f64,
    turns: f64,
    cycles: u32,
}

impl Sensor {
    /// Looks at a reading, in m/s², after `turned` turns of the spindle; 0, or the reason against it.
    #[inline(always)]
    pub fn check(&mut self, plan: &Plan, reading: f64, turned: f64) -> u32 {
        if reading != self.last && reading.abs() <= plan.acceleration_max {
            self.last = reading;
            self.turns = 0.0;
            self.cycles = 0;
            return 0;
        }
        self.doubt(plan, reading, turned)
    }

    fn doubt(&mut self, plan: &Plan, reading: f64, turned: f64) -> u32 {
        if !reading.is_finite() {
            return GIB_VIBRATION_NOT_A_NUMBER;
        }
        if reading.abs() >= plan.saturation {
            return GIB_VIBRATION_SATURATED;
        }
        if reading.abs() > plan.acceleration_max {
            return GIB_VIBRATION_IMPLAUSIBLE;
        }
        if reading == self.last {
            self.turns += turned.abs();
            self.cycles = self.cycles.saturating_add(1);
        }
        if self.turns > STUCK_TURNS && self.cycles > STUCK_CYCLES { GIB_VIBRATION_STUCK } else { 0 }
    }
}
