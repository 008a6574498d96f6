//! Short recordings with noise of a current that was filtered over many rows: few of their rows are independent, by chance it goes with a
//! place or a time, and it is no cause. What jumps between levels, under the same noise, is one, and not known.

use gib::diagnosis::{Diagnosis, Excerpt, Verdict, diagnose};
use gib::machine::{Axis, Cause, Machine};
use gib::recording::{Column, Recording};
use std::f64::consts::TAU;

const MACHINE: &str = r#"{"schema":"gib.machine/1","name":"t","axes":[{"name":"x","drive":"ball_screw","lead_mm":10,
  "inertia_kg_m2":0.003,"coulomb_friction_nm":0.9,"viscous_friction_nm_s":0.008,"constant_torque_nm":0.1}]}"#;
/// Rows a second, their number, and the noise, N·m, of which so much is left after a row.
const ROWS_A_SECOND: f64 = 250.0;
const ROWS: u32 = 3000;
const NOISE: f64 = 0.05;
const KEPT: f64 = 0.8;

fn judged(seed: u64, extra: impl Fn(f64, f64) -> f64) -> Diagnosis {
    let mut state = seed;
    let mut uniform = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let (w1, w2, unit) = (TAU * 0.21, TAU * 0.57, TAU / 10.0);
    let [mut time, mut position, mut torque] = [Vec::new(), Vec::new(), Vec::new()];
    let mut noise = 0.0;
    for row in 0..ROWS {
        let t = f64::from(row) / ROWS_A_SECOND;
        let x = 100.0 + 60.0 * (w1 * t).sin() + 12.0 * (w2 * t).sin();
        let v = 60.0 * w1 * (w1 * t).cos() + 12.0 * w2 * (w2 * t).cos();
        let a = -60.0 * w1 * w1 * (w1 * t).sin() - 12.0 * w2 * w2 * (w2 * t).sin();
        noise = KEPT * noise + NOISE * (1.0 - KEPT * KEPT).sqrt() * 12f64.sqrt() * uniform();
        time.push(t);
        position.push((x * 1e4).round() * 1e-4);
        torque.push(0.003 * a * unit + 0.008 * v * unit + 0.9 * v.signum() + 0.1 + extra(t, v) + noise);
    }
    let columns = vec![Column::new("x.position_mm", position), Column::new("x.torque_nm", torque)];
    let recording = Recording::from_columns("t", time, columns).unwrap();
    let axis: Axis = Machine::parse(MACHINE).unwrap().axes.remove(0);
    diagnose(&axis, &Excerpt::of(&recording, &axis), None, &|_, _| true).unwrap()
}

#[test]
fn coloured_noise_is_no_discrepancy() {
    let doubted: Vec<u64> =
        (1..=12).filter(|seed| judged(*seed, |_, _| 0.0).verdict != Verdict::NoDiscrepancy).collect();
    assert!(doubted.is_empty(), "{doubted:?}");
}

#[test]
fn what_jumps_under_it_is_unknown_and_a_cause_is_all_that_is_found() {
    let level = |t: f64| if (t * 1.37).sin() + (t * 3.83).sin() > 0.2 { 1.5 * NOISE } else { -1.5 * NOISE };
    for seed in 21..25 {
        let d = judged(seed, |t, _| level(t));
        assert_eq!(d.verdict, Verdict::UnknownCause, "{seed}: {:?}", d.findings);
        let d = judged(seed, |_, v| 0.1 * v.signum());
        let named: Vec<Cause> = d.findings.iter().map(|f| f.effect.cause()).collect();
        assert_eq!((d.verdict, named), (Verdict::Explained, vec![Cause::CoulombFrictionMismatch]), "{seed}");
    }
}
