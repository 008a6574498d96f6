//! Friction decays as the machine warms: drop·(exp(−t/τ) − w)/(1 − w)·sign(v), w = exp(−u/τ), t from the first row. As a rule all of it
//! goes at last, u = ∞. Of a drift that is slower than the recording is long nobody knows how it ends, hardly more than that friction
//! falls along a line: then it counts from what friction is at the end of the recording, u = its duration.

use super::*;

/// Parameters: τ and u as shares of the recording. The coefficient is the drop.
pub static LAW: Law = Law {
    cause: Cause::ThermalDrift,
    scales: &[Scale::Log(0.02, SLOWEST), Scale::Choice],
    starts: |_, _| {
        let to_the_last = log_spaced(0.04, 2.0, 9).map(|share| vec![share, AT_LAST]);
        to_the_last.chain([vec![SLOWEST, 1.0]]).collect()
    },
    manner: PLAIN,
    terms: Terms::ByRows(|frame, shapes| {
        let dry = frame.judged(&frame.direction);
        each(shapes, |shape| {
            let (begin, per) = (frame.columns.time_s[0], 1.0 / (shape[0] * duration(frame)));
            let fading = frame.fading(&frame.columns.time_s, move |time_s| (time_s - begin) * per);
            let left = (-shape[1] / shape[0]).exp();
            Term::torque(fading.iter().zip(&dry).map(|(fading, dry)| (fading - left * dry) / (1.0 - left)).collect())
        })
    }),
    effect: |frame, shape, c| {
        let [time_constant_s, until_s] = [*shape.first()?, *shape.get(1)?].map(|share| share * duration(frame));
        let drop = *c.first()?;
        let until_s = if shape[1] < AT_LAST { until_s } else { NEVER_S };
        (drop.abs() < 3.0 * frame.belief.coulomb).then_some(Effect::ThermalDrift { drop, time_constant_s, until_s })
    },
    confused_with: &[Cause::CoulombFrictionMismatch, Cause::ViscousFrictionMismatch],
    sentence: |effect, axis| match effect {
        Effect::ThermalDrift { drop, time_constant_s, until_s } => {
            let (falls, size, unit) = (if *drop > 0.0 { "falls" } else { "rises" }, say(drop.abs()), unit(axis));
            if *until_s < NEVER_S {
                return format!(
                    "Friction {falls} by {size} {unit} in {} s while the machine runs in, and goes on: record longer to see where \
                     it ends, and warm up before measuring or cutting.",
                    say(*until_s)
                );
            }
            format!(
                "Friction {falls} by {size} {unit} while the machine runs in, with a time constant of {} s: warm up before measuring or \
                 cutting.",
                say(*time_constant_s)
            )
        }
        _ => String::new(),
    },
};

/// The longest time constant that is told from a straight line, in recordings.
pub const SLOWEST: f64 = 3.0;
/// So many recordings are for ever.
const AT_LAST: f64 = 1e6;
/// What a machine file takes for ever, s.
const NEVER_S: f64 = 1e9;

fn duration(frame: &Frame) -> f64 {
    frame.columns.time_s.last().map_or(1.0, |end| end - frame.columns.time_s[0])
}
