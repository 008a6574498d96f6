//! The rig of the demonstration, recorded and judged.

use gib::diagnosis::{Diagnosis, Excerpt, diagnose};
use gib::machine::{Axis, Cause, Effect, Machine};
use gib::plant::moves::{Moves, Reach};
use gib::plant::simulate::{Sensors, Setup, simulate};
use gib::recording::{Column, Recording};

/// What is believed of the rig of the demonstration.
pub const RIG: &str = include_str!("../../examples/machines/believed.json");

/// The rig with effects.
pub fn rig(effects: &[Effect]) -> Axis {
    Machine::parse(RIG).unwrap().axes[0].with_effects(effects.to_vec())
}

/// The sensors of a good drive.
pub fn good(torque_noise: f64) -> Sensors {
    Sensors { grid_um: 0.05, torque_noise, torque_grid: 0.001, ..Sensors::default() }
}

/// A recording of these moves, with the sensors of a good drive and more noise of the torque.
pub fn recorded(truth: &Axis, moves: &Moves, seed: u64) -> Recording {
    recorded_by(truth, moves, seed, good(0.03), false)
}

/// A recording of these moves by these sensors, with a scale on the table or without.
pub fn recorded_by(truth: &Axis, moves: &Moves, seed: u64, sensors: Sensors, scale: bool) -> Recording {
    let command = moves.command(truth.servo.unwrap().period_s);
    let trace = simulate(truth, &command, &Setup { seed, sensors, ..Setup::default() }).unwrap();
    let mut columns = vec![
        Column::new("x.position_command_mm", trace.command),
        Column::new("x.position_mm", trace.position),
        Column::new("x.torque_nm", trace.torque),
    ];
    if scale {
        columns.push(Column::new("x.table_position_mm", trace.table_position));
    }
    Recording::from_columns("simulated", trace.time_s, columns).unwrap()
}

/// Moves that tell all of its causes.
pub fn test_moves() -> Moves {
    Moves::built_in("test", &Reach { start: 20.0, stroke: 200.0, speed: 250.0, acceleration: 2500.0 }).unwrap()
}

/// What a recording says of an axis.
pub fn judged(axis: &Axis, recording: &Recording) -> Diagnosis {
    diagnose(axis, &Excerpt::of(recording, axis), None, &|_, _| true).unwrap()
}

/// The causes that were named.
pub fn named(d: &Diagnosis) -> Vec<Cause> {
    d.findings.iter().map(|f| f.effect.cause()).collect()
}
