//! Extra friction at low speed: Ts·exp(−|v/vs|ⁿ)·sign(v) (Stribeck 1902; Armstrong-Hélouvry 1991), n = 2 unless the recording says
//! otherwise (Bo and Pavelescu 1982 found 0.5 to 1). A dip where negative.

use super::*;

/// The usual exponent.
const GAUSSIAN: f64 = 2.0;

/// Parameters: vs in load units/s, and n. The coefficient is Ts.
pub static LAW: Law = Law {
    cause: Cause::StribeckFriction,
    scales: &[Scale::Log(1e-4, 1e4), Scale::Form(0.4, 8.0, GAUSSIAN)],
    starts: |frame, _| {
        let top = frame.top_speed();
        log_spaced(2e-3 * top, 0.4 * top, 12).map(|v| vec![v, GAUSSIAN]).collect()
    },
    manner: PLAIN,
    terms: Terms::ByRows(|frame, shapes| {
        each(shapes, |shape| {
            let per = 1.0 / shape[0];
            Term::torque(frame.fading_by(&frame.v, shape[1], move |v| v * per))
        })
    }),
    effect: |frame, shape, c| {
        let (torque, velocity_mm_s, exponent) = (*c.first()?, shape[0], shape[1]);
        let sound = torque > -1.2 * frame.belief.coulomb && velocity_mm_s < 0.6 * frame.top_speed();
        sound.then_some(Effect::StribeckFriction { torque, velocity_mm_s, exponent })
    },
    confused_with: &[Cause::CoulombFrictionMismatch, Cause::PreslidingFriction],
    sentence: |effect, axis| match effect {
        Effect::StribeckFriction { torque, velocity_mm_s, .. } => format!(
            "Below about {} {}/s friction {} by {} {}: {}.",
            say(*velocity_mm_s),
            load(axis),
            if *torque > 0.0 { "rises" } else { "falls" },
            say(torque.abs()),
            unit(axis),
            if *torque > 0.0 {
                "the film of oil breaks down, stick-slip threatens slow feeds"
            } else {
                "the axis runs easier when slow"
            }
        ),
        _ => String::new(),
    },
};
