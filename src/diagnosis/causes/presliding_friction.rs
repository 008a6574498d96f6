//! Friction builds over a displacement after a reversal (Dahl 1968): dz/dx = (1 − z·sign(v))/d, friction = Tc·z, with
//! d = Coulomb force ÷ bristle stiffness at the load. Driven by the measured position, so no speed has to be known.

use super::*;

/// Trace z − sign(v); its coefficient is the friction level that builds up.
pub static LAW: Law = Law {
    cause: Cause::PreslidingFriction,
    scales: &[Scale::Log(0.05, 2000.0)],
    starts: |frame, _| {
        let least = (3.0 * frame.grid).max(3e-4) * 1e3;
        log_spaced(least, (least * 10.0).max(500.0), 14).map(|d| vec![d]).collect()
    },
    restarts: NO_RESTARTS,
    starts_from_rest: false,
    approached: false,
    simulated: false,
    terms: |frame, shapes| {
        each(shapes, |shape| {
            let state = build_up(frame, shape[0] * 1e-3);
            Term::torque(frame.judged_by(|i| state[i] - frame.direction[i]))
        })
    },
    effect: |frame, shape, c| {
        let level = *c.first()?;
        let sound = level > 0.4 * frame.belief.coulomb && level < 2.5 * frame.belief.coulomb;
        sound.then_some(Effect::PreslidingFriction { displacement_um: *shape.first()? })
    },
    confused_with: &[Cause::Backlash, Cause::DriveCompliance, Cause::StribeckFriction],
    sentence: |effect, axis| match effect {
        Effect::PreslidingFriction { displacement_um } => format!(
            "After each reversal friction builds up over about {} {} instead of at once, as preloaded guides and seals do.",
            say(*displacement_um),
            micro(axis)
        ),
        _ => String::new(),
    },
};

/// Dahl's state −1…1 at every row, solved exactly over each step; unknown at the start and taken as zero.
fn build_up(frame: &Frame, distance: f64) -> Vec<f64> {
    let x = &frame.columns.position;
    let mut state = vec![0.0; x.len()];
    for s in &frame.columns.stretches {
        let mut z = 0.0;
        for i in s.start + 1..s.end {
            let step = x[i] - x[i - 1];
            if step != 0.0 {
                z = step.signum() - (step.signum() - z) * (-step.abs() / distance).exp();
            }
            state[i] = z;
        }
    }
    state
}
