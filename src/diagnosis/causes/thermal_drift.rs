//! Friction decays as the machine warms: drop·exp(−t/τ)·sign(v), t from the first row.

use super::*;

/// Parameter: τ as a share of the recording. The coefficient is the drop.
pub static LAW: Law = Law {
    cause: Cause::ThermalDrift,
    scales: &[Scale::Log(0.02, 3.0)],
    starts: |_, _| log_spaced(0.04, 2.0, 9).map(|share| vec![share]).collect(),
    manner: PLAIN,
    terms: |frame, shapes| {
        each(shapes, |shape| {
            let (begin, per) = (frame.columns.time_s[0], 1.0 / (shape[0] * duration(frame)));
            Term::torque(frame.fading(&frame.columns.time_s, move |time_s| (time_s - begin) * per))
        })
    },
    effect: |frame, shape, c| {
        let (drop, time_constant_s) = (*c.first()?, shape.first()? * duration(frame));
        (drop.abs() < 3.0 * frame.belief.coulomb).then_some(Effect::ThermalDrift { drop, time_constant_s })
    },
    confused_with: &[Cause::CoulombFrictionMismatch, Cause::ViscousFrictionMismatch],
    sentence: |effect, axis| match effect {
        Effect::ThermalDrift { drop, time_constant_s } => format!(
            "Friction {} by {} {} while the machine runs in, with a time constant of {} s: warm up before measuring or cutting.",
            if *drop > 0.0 { "falls" } else { "rises" },
            say(drop.abs()),
            unit(axis),
            say(*time_constant_s)
        ),
        _ => String::new(),
    },
};

fn duration(frame: &Frame) -> f64 {
    frame.columns.time_s.last().map_or(1.0, |end| end - frame.columns.time_s[0])
}
