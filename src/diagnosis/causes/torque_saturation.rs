//! Beyond a level the motor delivers less than its current says: the measured (current) torque is larger than the motion
//! explains by (1 − r)·(|T| − limit) beyond the limit, r the share of the excess that is delivered.

use super::*;

/// Parameter: the limit as a share of the largest measured torque. The coefficient is 1 − r.
///
/// The trace is made of the measured torque: a limit within friction and load would, with other numbers of the belief, explain any torque by
/// itself, and is not among the effects of this law.
pub static LAW: Law = with_effect(|frame, shape, c| {
    let at_rest = frame.belief.coulomb + frame.belief.constant.abs();
    (shape[0] * peak(frame) > 1.3 * at_rest).then(|| effect(frame, shape, c)).flatten()
});

/// The same with any limit, for a belief that is right otherwise.
pub static AT_ANY_LEVEL: Law = with_effect(effect);

const fn with_effect(effect: fn(&Frame, &[f64], &[f64]) -> Option<Effect>) -> Law {
    Law {
        cause: Cause::TorqueSaturation,
        scales: &[Scale::Log(0.1, 0.98)],
        starts: |_, _| (0..10).map(|i| vec![0.12 * 1.25f64.powi(i)]).collect(),
        manner: PLAIN,
        terms: Terms::ByRows(|frame, shapes| {
            each(shapes, |shape| Term::torque(frame.aligned(&beyond(frame, shape[0] * peak(frame)), 0.0)))
        }),
        effect,
        confused_with: &[Cause::InertiaMismatch, Cause::QuadraticDrag],
        sentence: |effect, axis| match effect {
            Effect::TorqueSaturation { limit, slope_ratio } => format!(
                "Above {} {} the motor delivers only {} % of what its current adds: magnetic saturation, hot magnets or a wrong torque constant at high current.",
                say(*limit),
                unit(axis),
                say(100.0 * slope_ratio)
            ),
            _ => String::new(),
        },
    }
}

/// The measured torque beyond a limit, at every row.
pub(super) fn beyond(frame: &Frame, limit: f64) -> Vec<f64> {
    frame.columns.torque.iter().map(|t| t.signum() * (t.abs() - limit).max(0.0)).collect()
}

fn effect(frame: &Frame, shape: &[f64], c: &[f64]) -> Option<Effect> {
    let slope_ratio = 1.0 - c.first()?;
    let sound = (-0.15..0.9).contains(&slope_ratio);
    sound.then(|| Effect::TorqueSaturation { limit: shape[0] * peak(frame), slope_ratio: slope_ratio.max(0.0) })
}

fn peak(frame: &Frame) -> f64 {
    frame.columns.torque.iter().fold(0.0, |m: f64, t| m.max(t.abs()))
}
