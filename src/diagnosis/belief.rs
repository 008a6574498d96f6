//! What the belief already explains is taken off the recording before anything is looked for, and what is found joins it.
//!
//! Base values of the belief (inertia, friction, constant torque) are regressors of the balance; its other effects are
//! predicted by the simulation itself, T(belief) − T(base alone), so that a machine file explains in a diagnosis just what
//! it explains in `gib predict`.

use super::frame::Columns;
use crate::machine::{Axis, Cause, Effect};
use crate::plant::predict::predict_torque;

/// Whether an effect of the belief is one of its base values or its timing, which the balance itself takes care of.
fn in_the_balance(effect: &Effect) -> bool {
    matches!(
        effect.cause(),
        Cause::InertiaMismatch
            | Cause::CoulombFrictionMismatch
            | Cause::ViscousFrictionMismatch
            | Cause::ConstantTorque
            | Cause::DeadTime
    )
}

/// The axis with its belief as base values and nothing else but the timing.
#[must_use]
pub fn base_alone(axis: &Axis) -> Axis {
    let timing = axis.effects.iter().copied().filter(|e| e.cause() == Cause::DeadTime).collect();
    Axis { base: axis.belief(), ..axis.with_effects(timing) }
}

/// Takes off the columns what the effects of the belief add to its base values.
///
/// # Errors
/// The effects contradict the inertia, as [`Axis::two_masses`].
pub fn take_off(axis: &Axis, columns: &mut Columns) -> Result<(), String> {
    if axis.effects.iter().all(in_the_balance) {
        return Ok(());
    }
    let Some(observed) = columns.observed() else { return Ok(()) };
    let (all, base) = (predict_torque(axis, &observed)?, predict_torque(&base_alone(axis), &observed)?);
    for ((measured, all), base) in columns.torque.iter_mut().zip(&all.torque).zip(&base.torque) {
        let known = all - base;
        *measured -= if known.is_finite() { known } else { 0.0 };
    }
    if let Some(table) = &mut columns.table {
        for (i, (table, x)) in table.iter_mut().zip(&columns.position).enumerate() {
            let lag = all.table_lag.as_ref().map_or(0.0, |lag| lag[i]);
            let known = all.physics.table_of(*x) - x - all.physics.table_zero + lag;
            *table -= if known.is_finite() { known } else { 0.0 };
        }
    }
    Ok(())
}

/// Whether a cause can be found beside what the belief has of it: it may be there more than once, replaces the believed
/// value, or adds to it.
#[must_use]
pub fn may_be_found(axis: &Axis, cause: Cause) -> bool {
    let there = || axis.effects.iter().any(|e| e.cause() == cause);
    let adds = matches!(
        cause,
        Cause::DirectionDependentFriction | Cause::CableForce | Cause::QuadraticDrag | Cause::ScrewPitchError
    );
    cause.row().repeatable || adds || !there() || axis.effects.iter().any(|e| e.cause() == cause && in_the_balance(e))
}

/// A found effect together with what the belief has of the same cause, where they add up.
#[must_use]
pub fn together(axis: &Axis, found: Effect) -> Effect {
    use Effect::*;
    let believed = axis.effects.iter().find(|e| e.cause() == found.cause());
    match (found, believed.copied()) {
        (DirectionDependentFriction { asymmetry }, Some(DirectionDependentFriction { asymmetry: more })) => {
            DirectionDependentFriction { asymmetry: asymmetry + more }
        }
        (QuadraticDrag { drag }, Some(QuadraticDrag { drag: more })) => QuadraticDrag { drag: drag + more },
        (ScrewPitchError { scale_um_m }, Some(ScrewPitchError { scale_um_m: more })) => {
            ScrewPitchError { scale_um_m: scale_um_m + more }
        }
        (DeadTime { delay_ms }, Some(DeadTime { delay_ms: more })) => DeadTime { delay_ms: delay_ms + more },
        (CableForce { slope, zero_mm }, Some(CableForce { slope: more, zero_mm: zero })) if slope + more != 0.0 => {
            CableForce { slope: slope + more, zero_mm: (slope * zero_mm + more * zero) / (slope + more) }
        }
        _ => found,
    }
}

/// The axis with found effects (as [`together`] gives them) in place of what it had of them.
#[must_use]
pub fn extended(axis: &Axis, found: &[Effect]) -> Axis {
    let replaced = |e: &Effect| found.iter().any(|f| f.cause() == e.cause() && !f.cause().row().repeatable);
    let mut effects: Vec<Effect> = axis.effects.iter().copied().filter(|e| !replaced(e)).collect();
    effects.extend(found);
    axis.with_effects(effects)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::Machine;

    fn axis() -> Axis {
        let text = r#"{"schema":"gib.machine/1","name":"t","axes":[{"name":"x","drive":"ball_screw","lead_mm":10,
            "inertia_kg_m2":0.003,"effects":[{"cause":"inertia_mismatch","parameters":{"inertia_kg_m2":0.004}},
            {"cause":"cogging","parameters":{"amplitude_nm":0.1,"period_mm":2.5}},
            {"cause":"cable_force","parameters":{"slope_nm_mm":0.002,"zero_mm":100}},
            {"cause":"dead_time","parameters":{"delay_ms":1.5}}]}]}"#;
        Machine::parse(text).unwrap().axes.remove(0)
    }

    #[test]
    fn found_effects_replace_add_up_or_stand_beside_what_was_believed() {
        let axis = axis();
        let found = [
            Effect::InertiaMismatch { inertia: 0.005 },
            Effect::Cogging { amplitude: 0.05, period_mm: 10.0 },
            Effect::CableForce { slope: 0.002, zero_mm: 0.0 },
            Effect::DeadTime { delay_ms: -0.5 },
        ]
        .map(|e| together(&axis, e));
        assert_eq!(found[2], Effect::CableForce { slope: 0.004, zero_mm: 50.0 });
        assert_eq!(found[3], Effect::DeadTime { delay_ms: 1.0 });
        let extended = extended(&axis, &found);
        assert_eq!((extended.effects.len(), extended.belief().inertia), (5, 0.005));
    }

    #[test]
    fn the_base_alone_has_the_believed_values_and_the_timing() {
        let base = base_alone(&axis());
        assert_eq!((base.base.inertia, base.effects.len()), (0.004, 1));
        assert!(may_be_found(&axis(), Cause::Cogging) && may_be_found(&axis(), Cause::DeadTime));
    }
}
