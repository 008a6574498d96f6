//! A motor that saturates, in the hardest of all moves or in most, and a torque column that is not of the instant of its position.

use crate::generated::{rig, said, said_believing};
use serde_json::json;

const DELAY_MS: f64 = -0.4;

/// What is said of a motor that saturates beyond a limit, and whether the column is early by what is named, within a twentieth.
fn check((verdict, findings): (String, Vec<(String, f64)>), limit: f64, named: usize) {
    println!("limit {limit}: {verdict} {findings:?}");
    let value = |cause: &str| findings.iter().find(|(found, _)| found == cause).map(|(_, value)| *value);
    let ms = value("dead_time").unwrap_or(0.0);
    let nm = value("torque_saturation").unwrap_or(limit);
    assert!(findings.len() == named && verdict == "explained", "limit {limit}: {verdict} {findings:?}");
    assert!((ms / DELAY_MS - 1.0).abs() < 0.05 && (nm / limit - 1.0).abs() < 0.02, "limit {limit}: {ms} ms, {nm} N·m");
}

#[test]
fn a_column_that_is_early_is_found_beside_a_motor_that_saturates() {
    for (seed, limit) in [(1, 6.5), (2, 6.5), (3, 5.0), (4, 4.0), (5, 3.0)] {
        let found = said([&rig(), &rig()], seed, |truth| {
            truth.saturation = Some((limit, 0.3));
            truth.delay = 1e-3 * DELAY_MS;
        });
        check(found, limit, 2);
    }
}

#[test]
fn a_column_that_is_early_is_found_beside_a_motor_that_is_known_to_saturate() {
    for (seed, limit) in [(1, 5.0), (2, 3.0)] {
        let believed = json!({"cause": "torque_saturation", "parameters": {"limit_nm": limit, "slope_ratio": 0.3}});
        let found = said_believing(vec![believed], [&rig(), &rig()], seed, |truth| {
            truth.saturation = Some((limit, 0.3));
            truth.delay = 1e-3 * DELAY_MS;
        });
        check(found, limit, 1);
    }
}
