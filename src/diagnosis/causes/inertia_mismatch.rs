//! Inertia or mass differs from the belief: the rest grows with acceleration, ΔJ·α (N·m = kg·m²·rad/s²).

use super::*;

/// Trace α; the coefficient is the difference of the inertias.
pub static LAW: Law = Law {
    cause: Cause::InertiaMismatch,
    scales: &[],
    starts: one_start,
    manner: PLAIN,
    terms: Terms::ByRows(|frame, shapes| each(shapes, |_| Term::torque(frame.acceleration.clone()))),
    effect: |frame, _, c| {
        let inertia = frame.belief.inertia + c.first()?;
        (inertia > 0.1 * frame.belief.inertia).then_some(Effect::InertiaMismatch { inertia })
    },
    confused_with: &[Cause::DriveCompliance, Cause::DeadTime],
    sentence: |effect, axis| match effect {
        Effect::InertiaMismatch { inertia } => format!(
            "Speeding up and braking take {} % {} torque than believed: what moves weighs {} {}, not {}.",
            say(100.0 * (inertia / axis.belief().inertia - 1.0).abs()),
            if *inertia > axis.belief().inertia { "more" } else { "less" },
            say(*inertia),
            if axis.drive.is_linear() { "kg" } else { "kg·m² at the motor" },
            say(axis.belief().inertia)
        ),
        _ => String::new(),
    },
};
