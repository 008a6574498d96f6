//! What a true machine file leaves of a torque that it was not simulated by.

use crate::board::moves::Segment;
use crate::board::random::Random;
use crate::board::truth::Sine;
use crate::generated::{Rig, fast_ways, predicted, rig, slow_ways};
use serde_json::json;

/// Torque that is not predicted while the axis moves, over the noise of its sensor.
fn left_while_moving(figures: &serde_json::Value, rig: &Rig) -> f64 {
    figures["residual_torque_rms_moving"].as_f64().unwrap() / rig.torque_noise
}

/// An encoder so fine that what the servo makes of its steps is less than the noise of the torque.
fn fine() -> Rig {
    Rig { encoder_step: 1e-4, torque_noise: 0.03, ..rig() }
}

/// Friction that turns round and an axis that sticks for some rows are too sudden for the motion to tell; the closed loop knows them.
#[test]
fn what_turns_round_and_sticks_is_predicted_to_the_noise() {
    for seed in [51, 52] {
        let left = left_while_moving(&predicted(slow_ways, Vec::new(), &fine(), seed, |_| {}), &fine());
        println!("seed {seed}: {left:.2} of the noise");
        assert!((0.9..1.15).contains(&left), "{left}");
    }
}

/// Of the closed loop's torque as well the delay counts once.
#[test]
fn a_late_or_early_torque_column_is_predicted_as_well() {
    for (seed, delay_ms) in [(53, 2.0), (54, 1.4), (55, -1.7)] {
        let late = json!({"cause": "dead_time", "parameters": {"delay_ms": delay_ms}});
        let figures = predicted(fast_ways, vec![late], &fine(), seed, |truth| truth.delay = 1e-3 * delay_ms);
        let left = left_while_moving(&figures, &fine());
        println!("seed {seed}, {delay_ms} ms: {left:.2} of the noise");
        assert!((0.9..1.15).contains(&left), "{left}");
    }
}

/// A recording that begins with a rest for more than its first quarter.
fn after_a_rest(random: &mut Random) -> (Vec<Segment>, f64) {
    let (ways, _) = fast_ways(random);
    let rest = Segment::Dwell { time: 12.0 };
    ([rest].into_iter().chain(ways).collect(), 30.0)
}

/// What is said of a machine that is shaken so much, along such ways.
fn shaken(ways: fn(&mut Random) -> (Vec<Segment>, f64), amplitude: f64, seed: u64, phase: f64) -> serde_json::Value {
    let parameters = json!({"frequency_hz": 17.0, "amplitude_nm": amplitude});
    let shakes = json!({"cause": "external_vibration", "parameters": parameters});
    predicted(ways, vec![shakes], &fine(), seed, |truth| {
        truth.vibration = Sine { amplitude, period: 1.0 / 17.0, phase };
    })
}

/// A resting axis tells nothing of a vibration's phase: it is taken from where the axis moves.
#[test]
fn the_phase_of_a_vibration_is_had_from_motion() {
    for (seed, phase) in [(56, 0.4), (57, 2.9)] {
        let left = left_while_moving(&shaken(after_a_rest, 0.15, seed, phase), &fine());
        println!("seed {seed}: {left:.2} of the noise");
        assert!((0.9..1.2).contains(&left), "{left}");
    }
}

/// A recording whose first quarter is one slow way there and back, on which nothing moves but what the vibration makes of it.
fn after_a_slow_way(random: &mut Random) -> (Vec<Segment>, f64) {
    let (ways, _) = fast_ways(random);
    let slow = [63.0, 60.0].map(|to| Segment::Move { to, speed: 0.5, acceleration: 1000.0 });
    (slow.into_iter().chain(ways).collect(), 30.0)
}

/// At a steady speed what moves is the vibration's own answer: a base value that is wrong by several times itself would explain it as well.
#[test]
fn a_vibration_keeps_its_phase_where_nothing_else_moves() {
    for (seed, phase) in [(58, 0.4), (59, 2.9)] {
        let figures = shaken(after_a_slow_way, 0.03, seed, phase);
        let position_um = figures["residual_position_rms_um"].as_f64().unwrap();
        let left = left_while_moving(&figures, &fine());
        println!("seed {seed}: {left:.2} of the noise, position {position_um:.2} um");
        assert!((0.9..1.35).contains(&left) && position_um < 0.8, "{left} {position_um}");
    }
}
