//! Which moves would tell two causes apart.

use super::frame::Frame;
use crate::machine::Cause;
use serde_json::{Value, json};

/// The move list (`gib.moves/1`) that would tell two causes apart, within the stroke and speed of the recording, and why.
#[must_use]
pub fn telling(frame: &Frame, a: Cause, b: Cause) -> (Value, String) {
    use Cause::*;
    let (low, high) = frame.stroke();
    let stroke = high - low;
    let top = frame.top_speed();
    let brisk = 0.7 * frame.acceleration.iter().fold(1e-3, |m: f64, a| m.max(a.abs())) / frame.unit;
    let middle = 0.5 * (low + high);
    let round = |x: f64| (x * 1000.0).round() / 1000.0;
    let go = |to: f64, speed: f64| json!({ "to_mm": round(to), "speed_mm_s": round(speed.max(1e-3)), "acceleration_mm_s2": round(brisk) });
    let is = |x: Cause| a == x || b == x;
    let (why, moves): (String, Vec<Value>) = if is(Cogging) || is(ExternalVibration) {
        let speeds = [0.1, 0.17, 0.31].map(|s| s * top);
        let why =
            "the same way at three speeds: a ripple of position keeps its period in mm, a vibration its frequency";
        (why.into(), speeds.iter().flat_map(|&s| [go(high, s), go(low, s)]).collect())
    } else if is(Backlash) || is(PreslidingFriction) || is(DriveCompliance) {
        let why = "reversals in one place at three slow speeds: clearance is crossed without friction, pre-sliding rises from the first micrometre, wind-up follows the torque";
        let speeds = [0.002, 0.01, 0.05].map(|s| s * top);
        let reach = (0.05 * stroke).min(5.0);
        (
            why.into(),
            speeds
                .iter()
                .flat_map(|&s| [go(middle + reach, s), go(middle, s), go(middle + reach, s), go(middle, s)])
                .collect(),
        )
    } else if is(CableForce) || is(PositionDependentFriction) {
        let why = "slowly over the whole stroke, both ways: a pull keeps its sign, friction turns with the direction";
        (why.into(), vec![go(low, 0.1 * top), go(high, 0.1 * top), go(low, 0.1 * top)])
    } else if is(ThermalDrift) {
        let why = "the same stroke for half an hour: what decays with time leaves, what belongs to the machine stays";
        (why.into(), (0..12).flat_map(|_| [go(high, 0.5 * top), go(low, 0.5 * top)]).collect())
    } else if is(InertiaMismatch) || is(DeadTime) || is(TorqueSaturation) {
        let why = "rapids at three accelerations: inertia scales with acceleration, a delay with its change, saturation sets in at a level";
        (why.into(), [0.3, 0.6, 1.0].iter().flat_map(|s| [go(high, s * top), go(low, s * top)]).collect())
    } else {
        let why =
            "sweeps both ways at speeds spread evenly in ratio: each law of friction has its own curve over speed";
        let speeds = [0.01, 0.03, 0.1, 0.3, 1.0].map(|s| s * top);
        (why.into(), speeds.iter().flat_map(|&s| [go(high, s), go(low, s)]).collect())
    };
    let moves = json!({ "schema": crate::plant::moves::SCHEMA, "axis": frame.axis.name, "start_mm": round(low),
        "moves": moves });
    (moves, why)
}
