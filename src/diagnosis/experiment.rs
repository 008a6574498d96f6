//! Where a residual lives, and which move would tell two causes apart.

use super::fit::{Bench, Fit};
use super::frame::Frame;
use crate::machine::Cause;
use serde_json::{Value, json};

/// Groups along a coordinate.
const GROUPS: usize = 40;

/// Share of the torque residual's variance that a mean by group explains, for each coordinate, adjusted for the number of
/// groups, largest first.
#[must_use]
pub fn lives_in(bench: &Bench, fit: &Fit) -> Vec<(&'static str, f64)> {
    let [rest, _] = bench.rest(fit);
    let frame = bench.frame;
    let rows = &frame.kept;
    let coordinate = |name: &'static str, value: &dyn Fn(usize) -> f64| (name, share(&rest, rows, value));
    let since = since_reversal(frame);
    let mut list = vec![
        coordinate("position", &|k| frame.x[rows[k]]),
        coordinate("velocity", &|k| frame.v[rows[k]]),
        coordinate("direction", &|k| frame.v[rows[k]].signum()),
        coordinate("acceleration", &|k| frame.acceleration[k]),
        coordinate("time", &|k| frame.seconds(rows[k])),
        coordinate("distance since reversal", &|k| since[rows[k]].max(1e-9).ln()),
        ("frequency", lines(bench, &rest)),
    ];
    list.sort_by(|a, b| b.1.total_cmp(&a.1));
    list
}

/// A sentence on what is left.
#[must_use]
pub fn describe(lives_in: &[(&'static str, f64)], excess: f64) -> String {
    let strong: Vec<String> = lives_in
        .iter()
        .filter(|(_, share)| *share > 0.05)
        .take(3)
        .map(|(name, share)| format!("{name} ({:.0} % of its variance)", 100.0 * share))
        .collect();
    match (excess > 0.5, strong.is_empty()) {
        (false, _) => "white".to_owned(),
        (true, true) => "above the noise floor, but tied to no coordinate".to_owned(),
        (true, false) => format!("lives in {}", strong.join(", ")),
    }
}

fn share(rest: &[f64], rows: &[usize], value: &dyn Fn(usize) -> f64) -> f64 {
    let values: Vec<f64> = (0..rows.len()).map(value).collect();
    let low = values.iter().copied().fold(f64::MAX, f64::min);
    let high = values.iter().copied().fold(f64::MIN, f64::max);
    if !(high > low) {
        return 0.0;
    }
    let (mut sums, mut counts) = (vec![0.0; GROUPS], vec![0.0; GROUPS]);
    for (v, r) in values.iter().zip(rest) {
        let at = (((v - low) / (high - low) * GROUPS as f64) as usize).min(GROUPS - 1);
        sums[at] += r;
        counts[at] += 1.0;
    }
    let n = rest.len() as f64;
    let mean = rest.iter().sum::<f64>() / n;
    let total: f64 = rest.iter().map(|r| (r - mean).powi(2)).sum();
    let between: f64 = sums.iter().zip(&counts).filter(|c| *c.1 > 0.0).map(|(s, c)| c * (s / c - mean).powi(2)).sum();
    let used = counts.iter().filter(|c| **c > 0.0).count() as f64;
    (1.0 - (1.0 - between / total.max(1e-300)) * (n - 1.0) / (n - used).max(1.0)).clamp(0.0, 1.0)
}

/// Travel since the last change of direction, every row.
fn since_reversal(frame: &Frame) -> Vec<f64> {
    let mut out = vec![0.0; frame.x.len()];
    for s in &frame.columns.stretches {
        let mut from = frame.x[s.start];
        let mut way = 0.0;
        for i in s.clone() {
            let direction = frame.direction[i].round();
            if direction != 0.0 && direction != way {
                (way, from) = (direction, frame.x[i]);
            }
            out[i] = (frame.x[i] - from).abs();
        }
    }
    out
}

/// Share of the variance in the strongest line in time, less what noise would put there.
fn lines(bench: &Bench, rest: &[f64]) -> f64 {
    let frame = bench.frame;
    let starts = super::causes::periods::along_time(frame, rest);
    let n = rest.len() as f64;
    let total: f64 = rest.iter().map(|r| r * r).sum();
    let duration = frame.seconds(frame.x.len() - 1);
    let of = |cycles: f64| {
        let omega = std::f64::consts::TAU * cycles / duration;
        let (c, s) = frame.kept.iter().zip(rest).fold((0.0, 0.0), |(c, s), (&i, r)| {
            let (sine, cosine) = (omega * frame.seconds(i)).sin_cos();
            (c + r * cosine, s + r * sine)
        });
        2.0 * (c * c + s * s) / n / total.max(1e-300)
    };
    let best = starts.iter().filter_map(|s| s.first()).map(|&cycles| of(cycles)).fold(0.0, f64::max);
    (best - 2.0 * n.ln() / n).clamp(0.0, 1.0)
}

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
