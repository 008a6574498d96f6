//! Whether an accelerometer can be believed.
//!
//! A reading is bad when it is no number, at full scale, or beyond what is plausible. A sensor is stuck when its reading
//! stays the same to the last digit while the spindle turns by a quarter and for sixteen cycles.

use super::io::*;
use super::plan::Plan;
use wide::f64x2;

/// Part of a revolution, and cycles, through which a living sensor does not repeat itself.
const STUCK_TURNS: f64 = 0.25;
const STUCK_CYCLES: u32 = 16;

/// The last readings of seat and bearing, and for how long they were the same.
#[derive(Debug, Clone, Copy, Default)]
pub struct Sensors {
    last: f64x2,
    turns: [f64; 2],
    cycles: [u32; 2],
}

impl Sensors {
    /// Looks at readings, in m/s², after `turned` turns of the spindle; 0, or the reasons against them.
    pub fn check(&mut self, plan: &Plan, readings: [f64; 2], turned: f64) -> u32 {
        let now = f64x2::new(readings);
        let good = (now.simd_ne(self.last) & Sensors::plausible(plan, now)).to_bitmask();
        let mut last = self.last.to_array();
        let mut reasons = 0;
        for n in 0..2 {
            if good & 1 << n != 0 {
                (last[n], self.turns[n], self.cycles[n]) = (readings[n], 0.0, 0);
            } else {
                if readings[n] == last[n] {
                    self.turns[n] += turned.abs();
                    self.cycles[n] = self.cycles[n].saturating_add(1);
                }
                reasons |= self.doubt(plan, n, readings[n]) << (8 * n);
            }
        }
        self.last = f64x2::new(last);
        reasons
    }

    /// Which of two readings are plausible.
    #[inline(always)]
    #[must_use]
    pub fn plausible(plan: &Plan, readings: f64x2) -> f64x2 {
        readings.abs().simd_le(plan.acceleration_max)
    }

    /// Takes up readings, some cycles after the last; returns whether either is the same, which a living sensor seldom says.
    #[inline(always)]
    pub fn repeats(&mut self, readings: f64x2) -> bool {
        let same = readings.simd_eq(self.last).to_bitmask() != 0;
        self.last = readings;
        same
    }

    /// Whether the last readings were others than those before.
    #[must_use]
    pub fn live(&self) -> bool {
        self.cycles == [0; 2]
    }

    fn doubt(&self, plan: &Plan, n: usize, reading: f64) -> u32 {
        let [most, _] = plan.acceleration_max.to_array();
        if !reading.is_finite() {
            return GIB_VIBRATION_NOT_A_NUMBER;
        }
        if reading.abs() >= plan.saturation {
            return GIB_VIBRATION_SATURATED;
        }
        if reading.abs() > most {
            return GIB_VIBRATION_IMPLAUSIBLE;
        }
        if self.turns[n] > STUCK_TURNS && self.cycles[n] > STUCK_CYCLES { GIB_VIBRATION_STUCK } else { 0 }
    }
}
