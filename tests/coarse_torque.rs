//! A torque column on a coarse grid, with too little noise to carry it over the steps: what is less than the steps make is no
//! discrepancy, and what is more is found without what follows the steps.

use gib::diagnosis::{Diagnosis, Excerpt, Verdict, diagnose};
use gib::machine::{Axis, Cause, Effect, Machine};
use gib::plant::moves::{Moves, Reach};
use gib::plant::simulate::{Sensors, Setup, simulate};
use gib::recording::{Column, Recording};

/// What is believed of the rig of the demonstration.
const RIG: &str = include_str!("../examples/machines/believed.json");

fn rig(effects: &[Effect]) -> Axis {
    Machine::parse(RIG).unwrap().axes[0].with_effects(effects.to_vec())
}

/// What the rig without effects is told by a recording with them; torque grid and noise in N·m.
fn judged(effects: &[Effect], torque_grid: f64, torque_noise: f64, seed: u64) -> Diagnosis {
    let (truth, belief) = (rig(effects), rig(&[]));
    let reach = Reach { start: 20.0, stroke: 200.0, speed: 250.0, acceleration: 2500.0 };
    let command = Moves::built_in("test", &reach).unwrap().command(1e-3);
    let sensors = Sensors { grid_um: 0.05, torque_noise, torque_grid, ..Sensors::default() };
    let trace = simulate(&truth, &command, &Setup { seed, sensors, ..Setup::default() }).unwrap();
    let columns = vec![
        Column::new("x.position_command_mm", trace.command),
        Column::new("x.position_mm", trace.position),
        Column::new("x.torque_nm", trace.torque),
    ];
    let recording = Recording::from_columns("simulated", trace.time_s, columns).unwrap();
    diagnose(&belief, &Excerpt::of(&recording, &belief), None, &|_, _| true).unwrap()
}

/// A machine as believed is told as such on any grid, and as much noise is told as its steps make.
#[test]
fn the_steps_of_a_torque_grid_are_no_discrepancy() {
    for (seed, grid, noise) in [(1, 0.05, 0.002), (2, 0.2, 0.002), (3, 0.4, 0.002), (4, 0.2, 0.02), (5, 0.2, 0.04)] {
        let d = judged(&[], grid, noise, seed);
        assert_eq!(d.verdict, Verdict::NoDiscrepancy, "{grid} {noise}: {:?} {:?}", d.findings, d.unexplained);
        let told = d.unexplained.torque.noise_rms;
        assert!(told > 0.4 * grid / 12f64.sqrt() && told < 1.5 * (grid / 12f64.sqrt()).hypot(noise), "{grid}: {told}");
    }
}

/// What is larger than the steps is found by itself, as exactly as many steps tell it.
#[test]
fn what_is_more_than_a_torque_grid_makes_is_found_alone() {
    let cases = [
        Effect::InertiaMismatch { inertia: 0.0034 },
        Effect::ViscousFrictionMismatch { slope: 0.012 },
        Effect::StribeckFriction { torque: 0.5, velocity_mm_s: 6.0, exponent: 2.0 },
        Effect::ThermalDrift { drop: 0.4, time_constant_s: 8.0, until_s: 1e9 },
        Effect::DeadTime { delay_ms: 4.0 },
    ];
    for (seed, effect) in cases.into_iter().enumerate() {
        let d = judged(&[effect], 0.2, 0.002, 11 + seed as u64);
        let named: Vec<Cause> = d.findings.iter().map(|f| f.effect.cause()).collect();
        assert_eq!((d.verdict, named), (Verdict::Explained, vec![effect.cause()]), "{:?}", d.notes);
        let (found, truth) = (d.findings[0].effect.values()[0], effect.values()[0]);
        assert!((found / truth - 1.0).abs() < 0.02, "{effect:?}: {found}");
    }
}
