//! Torque and position columns are not of one instant: the torque logged at t is that of t − delay. Looks like friction at
//! constant acceleration and like inertia at reversals, so it is tried with the others from the start.

use super::torque_saturation::beyond;
use super::*;
use crate::diagnosis::many::add;
use crate::diagnosis::sampling::Timing;

/// Parameter: by how much later the column is, in ms, which between whole cycles is not the delay ([`crate::plant::lateness`]).
/// The trace is what the motor delivers by the measured torque less the same moved up; it has no coefficient.
pub static LAW: Law = Law {
    cause: Cause::DeadTime,
    scales: &[Scale::Linear(-50.0, 50.0, 0.05)],
    starts: |frame, _| {
        if frame.sampling.timing == Timing::Aligned {
            return Vec::new();
        }
        let h = frame.columns.period_s * 1e3;
        let step = (0.5 * h).max(0.2);
        let count = (f64::max(8.0, 4.0 * h) / step).round() as i32;
        (-count..=count).filter(|i| *i != 0).map(|i| vec![f64::from(i) * step]).collect()
    },
    manner: PLAIN,
    terms: Terms::Delivered(|frame, saturation, shapes| {
        let beyond = saturation.map(|(limit, slope_ratio)| (beyond(frame, limit), 1.0 - slope_ratio));
        let delivered = |late_s: f64| {
            let mut torque = frame.torque(late_s);
            if let Some((beyond, lost)) = &beyond {
                add(&mut torque, -lost, &frame.aligned(beyond, late_s));
            }
            torque
        };
        let unmoved = delivered(0.0);
        each(shapes, |shape| {
            let moved = delivered(1e-3 * shape[0]);
            let fixed = unmoved.iter().zip(moved).map(|(a, b)| a - b).collect();
            Term { fixed: Some(Trace::torque(fixed)), regressors: Vec::new() }
        })
    }),
    effect: |frame, shape, _| {
        let late_s = |more_ms: f64| frame.lateness.delay_of(frame.believed_late_s + 1e-3 * more_ms);
        Some(Effect::DeadTime { delay_ms: 1e3 * (late_s(*shape.first()?) - late_s(0.0)) })
    },
    confused_with: &[Cause::InertiaMismatch, Cause::ViscousFrictionMismatch],
    sentence: |effect, _| match effect {
        Effect::DeadTime { delay_ms } => format!(
            "The torque column is {} ms {} against the position column: a logging delay, not the machine.",
            say(delay_ms.abs()),
            if *delay_ms > 0.0 { "late" } else { "early" }
        ),
        _ => String::new(),
    },
};
