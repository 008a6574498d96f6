//! A disturbance periodic in time, not in position: amplitude·sin(2π·f·t + phase); pumps, fans, neighbours.

use super::*;
use crate::diagnosis::many::sines_and_cosines;

/// Parameter: periods over the recording. Coefficients: sine and cosine.
pub static LAW: Law = Law {
    cause: Cause::ExternalVibration,
    scales: &[Scale::Linear(3.0, 1e9, 0.02)],
    starts: |frame, rest| periods::along_time(frame, rest.torque),
    manner: Manner { starts_from_rest: true, ..PLAIN },
    terms: Terms::ByRows(|frame, shapes| {
        each(shapes, |shape| {
            let per_second = shape[0] / duration(frame);
            let turns: Vec<f64> = (0..frame.x.len()).map(|i| per_second * frame.seconds(i)).collect();
            let (sine, cosine) = sines_and_cosines(&turns);
            let (sine, cosine) = (frame.judged_instants(&sine), frame.judged_instants(&cosine));
            Term { fixed: None, regressors: vec![Trace::torque(sine), Trace::torque(cosine)] }
        })
    }),
    effect: |frame, shape, c| {
        let [sine, cosine] = c.try_into().ok()?;
        let frequency_hz = shape.first()? / duration(frame);
        Some(Effect::ExternalVibration { frequency_hz, amplitude: f64::hypot(sine, cosine) })
    },
    confused_with: &[Cause::Cogging, Cause::DriveCompliance],
    sentence: |effect, axis| match effect {
        Effect::ExternalVibration { frequency_hz, amplitude } => format!(
            "A disturbance of ±{} {} beats at {} Hz whatever the axis does: look for a pump, a fan or a neighbouring machine.",
            say(*amplitude),
            unit(axis),
            say(*frequency_hz)
        ),
        _ => String::new(),
    },
};

fn duration(frame: &Frame) -> f64 {
    frame.columns.time_s.last().map_or(1.0, |end| end - frame.columns.time_s[0])
}
