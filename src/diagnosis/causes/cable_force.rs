//! A force proportional to position, slope·(x − zero): cable chain, spring, bellows.

use super::*;

/// Choice: zero at position zero (one coefficient), or anywhere on the stroke (slope and constant).
pub static LAW: Law = Law {
    cause: Cause::CableForce,
    scales: &[Scale::Choice],
    starts: |_, _| vec![vec![0.0], vec![1.0]],
    manner: PLAIN,
    terms: Terms::ByRows(|frame, shapes| {
        each(shapes, |shape| {
            let line = Trace::torque(frame.kept.iter().map(|&i| frame.x[i]).collect());
            let level = Trace::torque(vec![1.0; frame.kept.len()]);
            Term { fixed: None, regressors: if shape[0] > 0.5 { vec![line, level] } else { vec![line] } }
        })
    }),
    effect: |frame, _, c| {
        let slope = *c.first()?;
        let zero_mm = c.get(1).map_or(0.0, |level| -level / slope);
        let (low, high) = frame.stroke();
        let room = high - low;
        // A zero farther off than a stroke is a constant torque of its own, not the cable's.
        (zero_mm == 0.0 || (zero_mm > low - room && zero_mm < high + room))
            .then_some(Effect::CableForce { slope, zero_mm })
    },
    confused_with: &[Cause::ConstantTorque, Cause::PositionDependentFriction],
    sentence: |effect, axis| match effect {
        Effect::CableForce { slope, .. } => format!(
            "The torque changes by {} {} per {} along the stroke, both ways alike: cable chain, spring or bellows pulls.",
            say(*slope),
            unit(axis),
            load(axis)
        ),
        _ => String::new(),
    },
};
