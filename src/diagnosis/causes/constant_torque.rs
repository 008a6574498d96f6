//! A constant torque: weight, counterbalance, or a Coulomb level that differs by direction, which is the same term.

use super::*;

/// Trace 1; the coefficient is the difference of the constants.
pub static LAW: Law = Law {
    cause: Cause::ConstantTorque,
    scales: &[],
    starts: one_start,
    manner: PLAIN,
    terms: Terms::ByRows(|frame, shapes| each(shapes, |_| Term::torque(vec![1.0; frame.kept.len()]))),
    effect: |frame, _, c| Some(Effect::ConstantTorque { torque: frame.belief.constant + c.first()? }),
    confused_with: &[Cause::CableForce, Cause::DirectionDependentFriction],
    sentence: |effect, axis| match effect {
        Effect::ConstantTorque { torque } => format!(
            "One direction takes {} {} more than the other at every speed (constant part {}, not {}): weight, counterbalance, or friction that differs by direction.",
            say(2.0 * (torque - axis.belief().constant).abs()),
            unit(axis),
            say(*torque),
            say(axis.belief().constant)
        ),
        _ => String::new(),
    },
};
