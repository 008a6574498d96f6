//! Coulomb friction differs from the belief: a step at every reversal, the same at every speed, ΔTc·sign(ω).

use super::*;

/// Trace sign(ω); the coefficient is the difference of the levels.
pub static LAW: Law = Law {
    cause: Cause::CoulombFrictionMismatch,
    scales: &[],
    starts: one_start,
    manner: PLAIN,
    terms: Terms::ByRows(|frame, shapes| each(shapes, |_| Term::torque(frame.judged(&frame.direction)))),
    effect: |frame, _, c| {
        let torque = frame.belief.coulomb + c.first()?;
        (torque >= 0.0).then_some(Effect::CoulombFrictionMismatch { torque })
    },
    confused_with: &[Cause::StribeckFriction, Cause::ThermalDrift, Cause::PositionDependentFriction],
    sentence: |effect, axis| match effect {
        Effect::CoulombFrictionMismatch { torque } => format!(
            "Dry friction is {} {} at every speed and position, not {}: look at guideway preload, wipers and lubrication.",
            say(*torque),
            unit(axis),
            say(axis.belief().coulomb)
        ),
        _ => String::new(),
    },
};
