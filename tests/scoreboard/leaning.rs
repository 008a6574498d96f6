//! A load beyond the friction of the table keeps flanks together where the axis turns, and they part where it brakes: as long as nobody
//! knows of the load a clearance seems to be crossed at each turn.

use crate::board::rig::Scale;
use crate::generated::{Rig, Truth, rig, said, said_without_its_servo, set_apart};

#[test]
fn a_clearance_is_found_together_with_the_load_that_leans_on_it() {
    let scale = |step: f64| Some(Scale { step, noise: 0.2 * step, zero: 0.1 });
    for (seed, load, table) in [(1, 0.7, None), (2, -0.8, scale(1e-3)), (3, 0.7, scale(5e-5))] {
        let rig = Rig { table, ..rig() };
        let (verdict, findings) = said([&rig, &rig], seed, |truth| {
            truth.constant += load;
            set_apart(truth, 0.05, 700.0, [0.47, 0.4], 0.3);
        });
        println!("seed {seed}: {verdict} {findings:?}");
        let value = |cause: &str| findings.iter().find(|(found, _)| found == cause).map(|(_, value)| *value);
        let (Some(um), Some(nm), 2) = (value("backlash"), value("constant_torque"), findings.len()) else {
            panic!("seed {seed}: {verdict} {findings:?}")
        };
        assert!((um / 50.0 - 1.0).abs() < 0.2 && (nm / load - 1.0).abs() < 0.05, "seed {seed}: {um} µm, {nm} N·m");
    }
}

/// Where a load is believed that is about the friction of the table, the flank that it rests on goes with its speed and its share of the
/// friction: no start of a clearance has that right.
#[test]
fn a_clearance_is_found_under_a_load_that_is_known() {
    for (seed, load, friction_share) in [(4, 0.36, 0.42), (5, -0.6, 0.45)] {
        let rig = Rig { constant: load, table: Some(Scale { step: 1e-3, noise: 2e-4, zero: 0.1 }), ..rig() };
        let clearance = |truth: &mut Truth| set_apart(truth, 0.03, 700.0, [0.35, friction_share], 0.3);
        let rigs = [&rig, &rig];
        for (verdict, findings) in [said(rigs, seed, clearance), said_without_its_servo(rigs, seed, clearance)] {
            println!("seed {seed}: {verdict} {findings:?}");
            let [(cause, um)] = findings.as_slice() else { panic!("seed {seed}: {verdict} {findings:?}") };
            assert!(cause == "backlash" && (um / 30.0 - 1.0).abs() < 0.1, "seed {seed}: {cause} {um}");
        }
    }
}
