//! What in a cycle's input must end the run.

use super::quick::{HUGE, sound};
use super::*;

/// Angle within which a commanded angle is the same, °: less than the tilts that can be told.
const SAME_DEG: f64 = 0.01;

impl Tilt {
    /// `GIB_ERR_TILT_CONDITION` where a rotary axis of the configuration stands elsewhere than in the first cut: offsets are for a
    /// workpiece that lies as it did there. Asked in later cuts, when the warning is accepted and while offsets come in; in every
    /// cycle after that it would be too dear.
    pub(super) fn turned(&self, input: &TiltInput) -> Option<Fault> {
        for axis in self.plan.rotary.iter().filter(|axis| axis.axis != GIB_TILT_AXIS_NONE) {
            let letter = (axis.axis - 1).clamp(0, 2) as usize;
            let (Some(value), Some(was)) = (input.rotary_deg.get(letter), self.angles.get(letter)) else { continue };
            if !((value - was).abs() <= SAME_DEG) {
                let (low, high) = (was - SAME_DEG, was + SAME_DEG);
                return Some(Fault { code: GIB_ERR_TILT_CONDITION, field: "rotary_deg\0", value: *value, low, high });
            }
        }
        None
    }
}

/// What in this cycle's input must end the run.
pub(super) fn danger(input: &TiltInput) -> Option<Fault> {
    const KNOWN: u32 = GIB_TILT_INPUT_CUTTING | GIB_TILT_INPUT_END | GIB_TILT_INPUT_OFF;
    if input.flags & GIB_INPUT_ABORT != 0 {
        return Some(Fault::of(GIB_ERR_ABORTED));
    }
    if input.flags & GIB_INPUT_FAULT != 0 {
        return Some(Fault { code: GIB_ERR_DRIVE_FAULT, value: f64::from(input.flags), ..Fault::NONE });
    }
    if input.flags & !KNOWN != 0 {
        let (value, high) = (f64::from(input.flags), f64::from(KNOWN));
        return Some(Fault { code: GIB_ERR_CONFIG, field: "flags\0", value, low: 0.0, high });
    }
    if sound(input) {
        return None;
    }
    let [x, y, z] = input.position_mm;
    let [a, b, c] = input.rotary_deg;
    for (field, value) in [
        ("position_mm\0", x),
        ("position_mm\0", y),
        ("position_mm\0", z),
        ("rotary_deg\0", a),
        ("rotary_deg\0", b),
        ("rotary_deg\0", c),
        ("load\0", input.load),
        ("speed_rpm\0", input.speed_rpm),
    ] {
        // Well below what all eight together may be, so that one is named whenever they are too much.
        if !(value.abs() < 0.3 * HUGE) {
            return Some(Fault { code: GIB_ERR_NON_FINITE, field, value, low: -0.3 * HUGE, high: 0.3 * HUGE });
        }
    }
    None
}
