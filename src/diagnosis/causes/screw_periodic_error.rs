//! Table and encoder differ periodically with the screw: table = encoder + amplitude·sin(2π·x/period + phase).

use super::*;

/// Parameter: periods over the stroke. Coefficients: sine and cosine, load units.
pub static LAW: Law = Law {
    cause: Cause::ScrewPeriodicError,
    scales: &[Scale::Linear(1.0, 1e6, 0.02)],
    starts: |frame, rest| if rest.table.is_empty() { Vec::new() } else { periods::along_stroke(frame, rest.table) },
    manner: Manner { starts_from_rest: true, ..PLAIN },
    terms: Terms::ByRows(|frame, shapes| {
        each(shapes, |shape| {
            let (sine, cosine) = periods::waves(frame, shape[0]);
            let (sine, cosine) = (frame.low_passed(&sine), frame.low_passed(&cosine));
            Term { fixed: None, regressors: vec![Trace::table(sine), Trace::table(cosine)] }
        })
    }),
    effect: |frame, shape, c| {
        let (amplitude, period_mm) = periods::ripple(frame, *shape.first()?, c.try_into().ok()?)?;
        Some(Effect::ScrewPeriodicError { amplitude_um: 1e3 * amplitude, period_mm })
    },
    confused_with: &[Cause::ScrewPitchError],
    sentence: |effect, axis| match effect {
        Effect::ScrewPeriodicError { amplitude_um, period_mm } => format!(
            "The table swings about the encoder by ±{} {} every {} {} of travel: the screw or its encoder runs out of true.",
            say(*amplitude_um),
            micro(axis),
            say(*period_mm),
            load(axis)
        ),
        _ => String::new(),
    },
};
