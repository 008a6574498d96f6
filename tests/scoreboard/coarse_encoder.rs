//! Fast rows of a coarse encoder: what a table behind a spring needs of its motor is lost in what the grid makes of the acceleration,
//! and a simulated table swings by the grid alone. Such a spring is found all the same, and one that is believed is not doubted for its
//! swing.

use crate::board::rig::Scale;
use crate::generated::{
    Rig, ServoGains, Truth, rig, said, said_believing, said_of_slow_ways, said_without_its_servo, set_apart,
};
use serde_json::json;
use std::f64::consts::TAU;

const RESONANCE_HZ: f64 = 92.0;
const TABLE: [f64; 2] = [0.58, 0.3];
const DAMPING: f64 = 0.04;

/// Four rows a millisecond, half a micrometre a step.
fn coarse() -> Rig {
    let servo = ServoGains {
        period: 2.5e-4,
        position_gain: 12.0,
        velocity_gain: 0.16,
        integral_time: Some(0.05),
        feedforward: 0.9,
        lag: 0.0,
        ..rig().servo
    };
    Rig { servo, encoder_step: 5e-4, ..rig() }
}

/// The spring.
fn spring(truth: &mut Truth) {
    set_apart(truth, 0.0, RESONANCE_HZ, TABLE, DAMPING);
}

#[test]
fn a_spring_that_swings_by_the_grid_is_found() {
    for seed in [1, 2] {
        let (verdict, findings) = said([&coarse(), &coarse()], seed, spring);
        println!("seed {seed}: {verdict} {findings:?}");
        let [(cause, hz)] = findings.as_slice() else { panic!("{verdict}: {findings:?}") };
        assert!(cause == "drive_compliance" && (hz / RESONANCE_HZ - 1.0).abs() < 0.1, "{cause} {hz}");
    }
}

#[test]
fn a_spring_that_is_believed_is_not_doubted_for_swinging_by_the_grid() {
    let rig = coarse();
    let [inertia_share, friction_share] = TABLE;
    let reduced = rig.inertia * inertia_share * (1.0 - inertia_share);
    let stiffness_n_um = (TAU * RESONANCE_HZ).powi(2) * reduced / (rig.unit * 1e-3).powi(2) * 1e-6;
    let parameters = json!({
        "resonance_hz": RESONANCE_HZ, "stiffness_n_um": stiffness_n_um, "table_inertia_share": inertia_share,
        "table_friction_share": friction_share, "damping_ratio": DAMPING
    });
    let effect = json!({ "cause": "drive_compliance", "parameters": parameters });
    for seed in [3, 4] {
        let (verdict, findings) = said_believing(vec![effect.clone()], [&rig, &rig], seed, spring);
        println!("seed {seed}: {verdict} {findings:?}");
        assert_eq!((verdict.as_str(), findings.as_slice()), ("no_discrepancy", &[][..]), "seed {seed}");
    }
}

/// A stiff servo gives a third of the friction for each step of its encoder: beside that noise a resting axis seems to weigh little, and
/// yet it rests for hundreds of rows that are all off by the same.
#[test]
fn rests_between_slow_ways_say_nothing() {
    let servo = ServoGains { position_gain: 40.0, velocity_gain: 0.53, integral_time: Some(0.02), ..rig().servo };
    let stiff = Rig { servo, torque_noise: 0.03, torque_step: 0.005, ..rig() };
    for seed in [5, 6] {
        let (verdict, findings) = said_of_slow_ways([&stiff, &stiff], seed, |_| ());
        assert_eq!((verdict.as_str(), findings.as_slice()), ("no_discrepancy", &[][..]), "seed {seed}");
        let (verdict, findings) = said_of_slow_ways([&stiff, &stiff], seed, |truth| truth.inertia *= 1.1);
        println!("seed {seed}: {verdict} {findings:?}");
        let [(cause, inertia)] = findings.as_slice() else { panic!("{verdict}: {findings:?}") };
        assert!(cause == "inertia_mismatch" && (inertia / 0.00308 - 1.0).abs() < 0.01, "{cause} {inertia}");
    }
}

/// The mean of many steps either way tells less than one of them.
#[test]
fn a_scale_tells_a_clearance_of_two_steps_of_the_encoder() {
    let rig = Rig { encoder_step: 1e-3, table: Some(Scale { step: 7e-4, noise: 3e-4, zero: 0.1 }), ..rig() };
    let clearance = |truth: &mut Truth| set_apart(truth, 1.9e-3, 700.0, [0.45, 0.4], 0.3);
    let rigs = [&rig, &rig];
    for (verdict, findings) in [said(rigs, 6, clearance), said_without_its_servo(rigs, 6, clearance)] {
        println!("{verdict} {findings:?}");
        let [(cause, um)] = findings.as_slice() else { panic!("{verdict}: {findings:?}") };
        assert!(cause == "backlash" && (um / 1.9 - 1.0).abs() < 0.2, "{cause} {um}");
    }
    for (verdict, findings) in [said(rigs, 7, |_| {}), said_without_its_servo(rigs, 7, |_| {})] {
        assert!(verdict == "no_discrepancy" && findings.is_empty(), "{verdict}: {findings:?}");
    }
}
