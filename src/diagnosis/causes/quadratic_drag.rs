//! Torque that grows with the square of speed: C·v·|v| with v in m/s at the load; covers, oil and air that are pushed.

use super::*;

/// Trace v·|v|.
pub static LAW: Law = Law {
    cause: Cause::QuadraticDrag,
    scales: &[],
    starts: one_start,
    manner: PLAIN,
    terms: Terms::ByRows(|frame, shapes| {
        each(shapes, |_| Term::torque(frame.judged_by(|i| 1e-6 * frame.v[i] * frame.v[i].abs())))
    }),
    effect: |_, _, c| Some(Effect::QuadraticDrag { drag: *c.first()? }),
    confused_with: &[Cause::ViscousFrictionMismatch],
    sentence: |effect, axis| match effect {
        Effect::QuadraticDrag { drag } => format!(
            "At speed the torque {} with the square of speed, by {} {} at 1 m/s: covers, wipers or coolant in the way.",
            if *drag > 0.0 { "grows" } else { "falls" },
            say(drag.abs()),
            unit(axis)
        ),
        _ => String::new(),
    },
};
