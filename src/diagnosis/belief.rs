//! What of a belief stays open to be found, and how what is found joins it.

use crate::machine::{Axis, Cause, Effect, TwoMasses};
use std::f64::consts::TAU;

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

/// Whether table and encoder are believed to go apart.
#[must_use]
pub fn parts_table(axis: &Axis) -> bool {
    use Cause::{Backlash, DriveCompliance, ScrewPeriodicError, ScrewPitchError};
    axis.effects.iter().any(|e| [Backlash, DriveCompliance, ScrewPeriodicError, ScrewPitchError].contains(&e.cause()))
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

/// What was found together, in the words of an axis that has all of it. What lies between motor and table was simulated with the
/// table's share of the believed inertia, and what inertia was found beside it is the motor's; friction that builds up after a
/// reversal was fitted as that of the Coulomb level alone.
pub fn reconcile<'e>(axis: &Axis, found: impl Iterator<Item = &'e mut Effect>) {
    let mut found: Vec<&mut Effect> = found.collect();
    let inertia = found.iter().find_map(|e| match **e {
        Effect::InertiaMismatch { inertia } => Some(inertia),
        _ => None,
    });
    if let Some(inertia) = inertia {
        found.iter_mut().for_each(|e| **e = on_inertia(axis, **e, inertia));
    }
    let coulomb = found.iter().find_map(|e| match **e {
        Effect::CoulombFrictionMismatch { torque } => Some(torque),
        _ => None,
    });
    let stribeck = found.iter().find_map(|e| match **e {
        Effect::StribeckFriction { torque, .. } => Some(torque),
        _ => None,
    });
    if let Some(torque) = stribeck {
        let coulomb = coulomb.unwrap_or_else(|| axis.belief().coulomb);
        found.iter_mut().for_each(|e| **e = of_level(**e, coulomb, torque));
    }
}

/// The same with the standard deviations of the parameters, which grow as the parameters do.
pub fn reconcile_sure<'e>(axis: &Axis, found: impl Iterator<Item = (&'e mut Effect, &'e mut Vec<f64>)>) {
    let mut found: Vec<(&mut Effect, &mut Vec<f64>)> = found.collect();
    let before: Vec<Vec<f64>> = found.iter().map(|(effect, _)| effect.values()).collect();
    reconcile(axis, found.iter_mut().map(|(effect, _)| &mut **effect));
    for ((effect, deviations), before) in found.into_iter().zip(before) {
        let grown = effect.values().into_iter().zip(before).map(|(now, before)| (now / before).abs());
        deviations.iter_mut().zip(grown).filter(|(_, by)| by.is_finite()).for_each(|(std, by)| *std *= by);
    }
}

/// Friction builds up to the level at rest, which is higher by what comes with low speed: over as much more of the way, at the
/// same stiffness.
fn of_level(effect: Effect, coulomb: f64, more: f64) -> Effect {
    match effect {
        Effect::PreslidingFriction { displacement_um, exponent, maxwell_slip, micro_damping_s }
            if coulomb > 0.0 && coulomb + more > 0.0 =>
        {
            let displacement_um = displacement_um * coulomb / (coulomb + more);
            Effect::PreslidingFriction { displacement_um, exponent, maxwell_slip, micro_damping_s }
        }
        other => other,
    }
}

fn on_inertia(axis: &Axis, effect: Effect, inertia: f64) -> Effect {
    let Ok(Some(m)) = axis.with_effects(vec![effect]).two_masses() else { return effect };
    let motor = inertia - m.table_inertia;
    if !(motor > 0.0) {
        return effect;
    }
    let omega = (m.stiffness * (1.0 / motor + 1.0 / m.table_inertia)).sqrt();
    match effect {
        Effect::DriveCompliance { stiffness_n_um, table_friction_share, .. } => Effect::DriveCompliance {
            resonance_hz: omega / TAU,
            stiffness_n_um,
            table_inertia_share: m.table_inertia / inertia,
            table_friction_share,
            damping_ratio: 0.5 * m.damping * omega / m.stiffness,
        },
        Effect::Backlash { width_um, table_friction_share, contact_damping_ratio, .. } => Effect::Backlash {
            width_um,
            table_inertia_share: m.table_inertia / inertia,
            table_friction_share,
            contact_hz: omega / TAU,
            contact_damping_ratio,
        },
        other => other,
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

/// The axis without effects of these causes.
#[must_use]
pub fn without(axis: &Axis, causes: &[Cause]) -> Axis {
    axis.with_effects(axis.effects.iter().copied().filter(|effect| !causes.contains(&effect.cause())).collect())
}

/// The axis with effects as a fit on the axis `fitted` found them.
#[must_use]
pub fn with_found(axis: &Axis, fitted: &Axis, found: Vec<Effect>) -> Axis {
    let mut effects: Vec<Effect> = found.into_iter().map(|effect| together(axis, effect)).collect();
    reconcile(fitted, effects.iter_mut());
    let whole = extended(axis, &effects);
    effects.iter_mut().for_each(|effect| at_the_table(&whole, effect, &mut []));
    extended(axis, &effects)
}

/// How much larger the motor of an axis feels an effect than that is: a vibration shakes the table, which swings under it.
#[must_use]
pub fn felt(axis: &Axis, effect: &Effect) -> f64 {
    let Effect::ExternalVibration { frequency_hz, .. } = effect else { return 1.0 };
    let through = |masses: TwoMasses| masses.passes(TAU * frequency_hz, axis.belief().viscous).0;
    axis.two_masses().ok().flatten().map_or(1.0, through)
}

/// Turns a vibration that was fitted as what the motor of an axis feels into how it shakes the table, with its deviations if there are any.
pub fn at_the_table(axis: &Axis, effect: &mut Effect, deviations: &mut [f64]) {
    let felt = felt(axis, effect);
    if let Effect::ExternalVibration { amplitude, .. } = effect {
        *amplitude /= felt;
        // The frequency is what it is.
        deviations.iter_mut().skip(1).for_each(|deviation| *deviation /= felt);
    }
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
    fn an_elastic_drive_keeps_its_spring_and_table_when_the_motor_is_heavier() {
        let axis = Axis { effects: Vec::new(), ..axis() };
        let masses = |axis: &Axis, effects: Vec<Effect>| axis.with_effects(effects).two_masses().unwrap().unwrap();
        let spring = Effect::DriveCompliance {
            resonance_hz: 60.0,
            stiffness_n_um: 30.0,
            table_inertia_share: 0.5,
            table_friction_share: 0.7,
            damping_ratio: 0.05,
        };
        let (before, heavier) = (masses(&axis, vec![spring]), Effect::InertiaMismatch { inertia: 0.004 });
        let after = masses(&axis, vec![heavier, on_inertia(&axis, spring, 0.004)]);
        for (a, b) in [
            (before.stiffness, after.stiffness),
            (before.table_inertia, after.table_inertia),
            (before.damping, after.damping),
            (before.motor_inertia + 0.001, after.motor_inertia),
        ] {
            assert!((a / b - 1.0).abs() < 1e-9, "{before:?} {after:?}");
        }
    }

    #[test]
    fn a_vibration_is_felt_as_the_table_swings_under_it() {
        let axis = Axis { effects: Vec::new(), ..axis() };
        // The table by itself swings at 60·√(1 − 0.5) = 42.4 Hz.
        let spring = Effect::DriveCompliance {
            resonance_hz: 60.0,
            stiffness_n_um: 0.5 * 0.5 * 0.003 * (TAU * 60.0).powi(2) / axis.drive.motor_stiffness(1.0),
            table_inertia_share: 0.5,
            table_friction_share: 0.5,
            damping_ratio: 1e-6,
        };
        let found = [18.0, 36.0, 85.0].map(|frequency_hz| {
            let vibration = Effect::ExternalVibration { frequency_hz, amplitude: 0.1 };
            let axis = with_found(&axis, &axis, vec![vibration, spring]);
            let Effect::ExternalVibration { amplitude, .. } = axis.effects[0] else { panic!() };
            amplitude / 0.1
        });
        for (found, right) in found.iter().zip([0.82, 0.28, 3.014]) {
            assert!((found / right - 1.0).abs() < 1e-3, "{found} {right}");
        }
    }

    #[test]
    fn friction_builds_up_to_the_level_at_rest() {
        let presliding = |displacement_um| Effect::PreslidingFriction {
            displacement_um,
            exponent: 1.0,
            maxwell_slip: 0.0,
            micro_damping_s: 0.0,
        };
        let axis = Axis { effects: Vec::new(), ..axis() };
        let mut found = [
            Effect::CoulombFrictionMismatch { torque: 0.9 },
            Effect::StribeckFriction { torque: 0.3, velocity_mm_s: 5.0, exponent: 2.0 },
            presliding(66.0),
        ];
        reconcile(&axis, found.iter_mut());
        assert_eq!(found[2], presliding(66.0 * 0.9 / (0.9 + 0.3)));
        assert_eq!(found[0], Effect::CoulombFrictionMismatch { torque: 0.9 });
    }

    #[test]
    fn the_base_alone_has_the_believed_values_and_the_timing() {
        let base = base_alone(&axis());
        assert_eq!((base.base.inertia, base.effects.len()), (0.004, 1));
        assert!(may_be_found(&axis(), Cause::Cogging) && may_be_found(&axis(), Cause::DeadTime));
    }
}
