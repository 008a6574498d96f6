//! A rotary table behind a worm of 120 turns: what is little of a degree is much of a turn of the motor.

use crate::board::rig::{Drive, Scale};
use crate::generated::{Rig, rig, said, set_apart};
use std::f64::consts::TAU;

const RATIO: f64 = 120.0;

#[test]
fn a_clearance_of_less_than_a_thousandth_of_a_degree_is_found_behind_a_worm() {
    let worm = Rig {
        drive: Drive::Rotary,
        gearing: RATIO,
        unit: 360.0 / TAU / RATIO,
        inertia: 0.001,
        viscous: 0.002,
        encoder_step: 1e-5,
        table: Some(Scale { step: 5e-5, noise: 1e-5, zero: 0.0 }),
        column: ("deg", 1.0, 8),
        ..rig()
    };
    const WIDTH_DEG: f64 = 0.7e-3;
    for seed in [41, 42] {
        let clearance = |truth: &mut _| set_apart(truth, WIDTH_DEG, 500.0, [0.55, 0.6], 0.3);
        let (verdict, findings) = said([&worm, &worm], seed, clearance);
        println!("seed {seed}: {verdict} {findings:?}");
        let [(cause, width)] = findings.as_slice() else { panic!("{verdict}: {findings:?}") };
        assert!(cause == "backlash" && (width / (1e3 * WIDTH_DEG) - 1.0).abs() < 0.1, "{cause} {width}");
    }
}
