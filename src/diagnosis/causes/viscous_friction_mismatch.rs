//! The viscous slope differs from the belief: the rest grows in proportion to speed, both ways alike, ΔTv·ω.

use super::*;

/// Trace ω; the coefficient is the difference of the slopes.
pub static LAW: Law = Law {
    cause: Cause::ViscousFrictionMismatch,
    scales: &[],
    starts: one_start,
    manner: PLAIN,
    terms: Terms::ByRows(|frame, shapes| each(shapes, |_| Term::torque(frame.speed.clone()))),
    effect: |frame, _, c| {
        let change = *c.first()?;
        let slope = frame.belief.viscous + change;
        // None at all may be found a little below it; friction that falls with speed is another law.
        (slope >= -0.02 * change.abs()).then_some(Effect::ViscousFrictionMismatch { slope: slope.max(0.0) })
    },
    confused_with: &[Cause::QuadraticDrag, Cause::DirectionDependentFriction],
    sentence: |effect, axis| match effect {
        Effect::ViscousFrictionMismatch { slope } => format!(
            "Friction rises with speed by {} {}, not {}: oil or grease is {} than believed.",
            say(*slope),
            if axis.drive.is_linear() { "N·s/m" } else { "N·m·s" },
            say(axis.belief().viscous),
            if *slope > axis.belief().viscous { "stiffer" } else { "thinner" }
        ),
        _ => String::new(),
    },
};
