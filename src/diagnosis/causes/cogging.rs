//! Torque ripple periodic in motor position: amplitude·sin(2π·x/period + phase), slots, poles and their harmonics. The
//! encoder's zero moves between recordings, so the phase belongs to each recording.

use super::*;

/// Parameter: periods over the stroke of this recording. Coefficients: sine and cosine.
pub static LAW: Law = Law {
    cause: Cause::Cogging,
    scales: &[Scale::Linear(1.0, 1e6, 0.02)],
    starts: |frame, rest| periods::along_stroke(frame, rest.torque),
    manner: Manner { starts_from_rest: true, ..PLAIN },
    terms: Terms::ByRows(|frame, shapes| {
        each(shapes, |shape| {
            let (sine, cosine) = periods::waves(frame, shape[0]);
            let (sine, cosine) = (frame.judged_instants(&sine), frame.judged_instants(&cosine));
            Term { fixed: None, regressors: vec![Trace::torque(sine), Trace::torque(cosine)] }
        })
    }),
    effect: |frame, shape, c| {
        let (amplitude, period_mm) = periods::ripple(frame, *shape.first()?, c.try_into().ok()?)?;
        Some(Effect::Cogging { amplitude, period_mm })
    },
    confused_with: &[Cause::ExternalVibration, Cause::PositionDependentFriction],
    sentence: |effect, axis| match effect {
        Effect::Cogging { amplitude, period_mm } => format!(
            "The torque ripples by ±{} {} every {} {} of travel, wherever and however fast the axis moves: {}.",
            say(*amplitude),
            unit(axis),
            say(*period_mm),
            load(axis),
            periods::origin(axis, *period_mm)
        ),
        _ => String::new(),
    },
};
