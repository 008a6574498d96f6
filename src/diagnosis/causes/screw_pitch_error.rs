//! Table and encoder differ in scale: table = encoder·(1 + scale·10⁻⁶).

use super::*;

/// Trace x in table − encoder; the coefficient is 10⁻⁶ of the scale.
pub static LAW: Law = Law {
    cause: Cause::ScrewPitchError,
    scales: &[],
    starts: |_, rest| if rest.table.is_empty() { Vec::new() } else { vec![Vec::new()] },
    manner: PLAIN,
    terms: Terms::ByRows(|frame, shapes| {
        each(shapes, |_| Term {
            fixed: None,
            regressors: vec![Trace::table(frame.kept.iter().map(|&i| 1e-6 * frame.x[i]).collect())],
        })
    }),
    effect: |_, _, c| Some(Effect::ScrewPitchError { scale_um_m: *c.first()? }),
    confused_with: &[Cause::ScrewPeriodicError],
    sentence: |effect, _| match effect {
        Effect::ScrewPitchError { scale_um_m } => format!(
            "The table travels {} µm {} per metre than the encoder says: screw pitch, temperature or scale factor.",
            say(scale_um_m.abs()),
            if *scale_um_m > 0.0 { "more" } else { "less" }
        ),
        _ => String::new(),
    },
};
