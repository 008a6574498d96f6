//! A motor that saturates in the hardest of all moves, and a torque column that is not of the instant of its position.

use crate::generated::{rig, said};

#[test]
fn a_column_that_is_early_is_found_beside_a_motor_that_saturates_in_few_rows() {
    for seed in [1, 2] {
        let (verdict, findings) = said([&rig(), &rig()], seed, |truth| {
            truth.saturation = Some((6.5, 0.3));
            truth.delay = -4e-4;
        });
        println!("seed {seed}: {verdict} {findings:?}");
        let value = |cause: &str| findings.iter().find(|(found, _)| found == cause).map(|(_, value)| *value);
        let (Some(ms), Some(nm), 2) = (value("dead_time"), value("torque_saturation"), findings.len()) else {
            panic!("seed {seed}: {verdict} {findings:?}")
        };
        assert!((ms / -0.4 - 1.0).abs() < 0.05 && (nm / 6.5 - 1.0).abs() < 0.02, "seed {seed}: {ms} ms, {nm} N·m");
    }
}
