//! The viscous slope differs by direction: slope·(1 ± a), so the rest is asymmetry·|ω|.

use super::*;

/// Trace |ω|.
pub static LAW: Law = Law {
    cause: Cause::DirectionDependentFriction,
    scales: &[],
    starts: one_start,
    manner: PLAIN,
    terms: Terms::ByRows(|frame, shapes| {
        each(shapes, |_| Term::torque(frame.judged_by(|i| (frame.v[i] * frame.unit).abs())))
    }),
    effect: |_, _, c| Some(Effect::DirectionDependentFriction { asymmetry: *c.first()? }),
    confused_with: &[Cause::ConstantTorque, Cause::QuadraticDrag],
    sentence: |effect, axis| match effect {
        Effect::DirectionDependentFriction { asymmetry } => format!(
            "Friction rises faster with speed in {} direction than in the other, by {} {} each way from the mean.",
            if *asymmetry > 0.0 { "plus" } else { "minus" },
            say(asymmetry.abs()),
            if axis.drive.is_linear() { "N·s/m" } else { "N·m·s" }
        ),
        _ => String::new(),
    },
};
