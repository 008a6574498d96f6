//! A tight spot along the stroke: peak·exp(−((x − centre)/width)²)·sign(v), the same resistance both ways.

use super::*;

/// Parameters: centre and width as shares of the stroke. The coefficient is the peak.
pub static LAW: Law = Law {
    cause: Cause::PositionDependentFriction,
    scales: &[Scale::Linear(-0.1, 1.1, 5e-3), Scale::Log(0.01, 0.5)],
    starts: |_, _| {
        [(0.03, 24), (0.07, 14), (0.15, 8)]
            .into_iter()
            .flat_map(|(width, count)| (0..count).map(move |i| vec![(f64::from(i) + 0.5) / f64::from(count), width]))
            .collect()
    },
    restarts: NO_RESTARTS,
    starts_from_rest: false,
    approached: false,
    simulated: false,
    terms: |frame, shapes| {
        each(shapes, |shape| {
            let (centre, width) = place(frame, shape);
            let per = 1.0 / width;
            Term::torque(frame.fading(&frame.x, move |x| ((x - centre) * per).powi(2)))
        })
    },
    effect: |frame, shape, c| {
        let (centre_mm, width_mm) = place(frame, shape);
        let peak = *c.first()?;
        (peak > -1.2 * frame.belief.coulomb).then_some(Effect::PositionDependentFriction { centre_mm, peak, width_mm })
    },
    confused_with: &[Cause::Cogging, Cause::CoulombFrictionMismatch, Cause::CableForce],
    sentence: |effect, axis| match effect {
        Effect::PositionDependentFriction { centre_mm, peak, width_mm } => format!(
            "Around {} {} (±{}) friction is {} {} {} in both directions: look at the guideway there.",
            say(*centre_mm),
            load(axis),
            say(*width_mm),
            say(peak.abs()),
            unit(axis),
            if *peak > 0.0 { "higher" } else { "lower" }
        ),
        _ => String::new(),
    },
};

fn place(frame: &Frame, shape: &[f64]) -> (f64, f64) {
    let (low, high) = frame.stroke();
    (low + shape[0] * (high - low), shape[1] * (high - low))
}
