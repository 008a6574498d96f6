//! A ball screw under a servo, recorded by the scoreboard's generator, which shares no code with the product, and diagnosed.

use crate::board::moves::{self, Segment};
use crate::board::random::Random;
use crate::board::record;
pub use crate::board::rig::{Drive, Rig, ServoGains};
use crate::board::rough::Rough;
use crate::board::truth::Coupling;
pub use crate::board::truth::Truth;
use serde_json::Value;
use std::f64::consts::TAU;
use std::path::Path;

/// A ball screw of 10 mm under a servo of its own, with an encoder on a grid of 1 µm and a torque that is known well.
pub fn rig() -> Rig {
    let servo = ServoGains {
        period: 1e-3,
        position_gain: 25.0,
        velocity_gain: 0.45,
        integral_time: Some(0.04),
        feedforward: 1.0,
        lag: 5e-4,
        two_sample_mean: false,
    };
    Rig {
        drive: Drive::BallScrew,
        gearing: 10.0,
        unit: 10.0 / TAU,
        inertia: 0.0028,
        coulomb: 0.9,
        viscous: 0.008,
        constant: 0.0,
        limit: 16.0,
        servo,
        encoder_step: 1e-3,
        torque_noise: 0.01,
        torque_step: 0.0,
        table: None,
        column: ("mm", 1.0, 6),
        rough: Rough::NONE,
        ..Rig::draw(&mut Random::new(1, 1), 10.0)
    }
}

/// A table behind a spring, or behind flanks as hard with a clearance (load units) between them, that swings at so many Hz; its share of
/// inertia and friction, and how the swing is damped.
pub fn set_apart(
    truth: &mut Truth,
    clearance: f64,
    hz: f64,
    [inertia_share, friction_share]: [f64; 2],
    damping_ratio: f64,
) {
    let omega = TAU * hz;
    let stiffness = omega * omega * truth.inertia * inertia_share * (1.0 - inertia_share);
    let damping = 2.0 * damping_ratio * stiffness / omega;
    truth.coupling =
        Some(Coupling { stiffness, damping, clearance: clearance / truth.unit, inertia_share, friction_share });
}

/// What is said of a rig as believed by a recording of another with something changed: verdict and named causes with their first value.
pub fn said([believed, rig]: [&Rig; 2], seed: u64, change: impl Fn(&mut Truth)) -> (String, Vec<(String, f64)>) {
    said_believing(Vec::new(), [believed, rig], seed, change)
}

/// The same where effects are believed as well.
pub fn said_believing(
    effects: Vec<Value>,
    [believed, rig]: [&Rig; 2],
    seed: u64,
    change: impl Fn(&mut Truth),
) -> (String, Vec<(String, f64)>) {
    let mut random = Random::new(seed, 7);
    said_along(fast_ways(&mut random), effects, [believed, rig], random, change)
}

/// Fast ways between a few places, with a short rest after each.
pub fn fast_ways(random: &mut Random) -> (Vec<Segment>, f64) {
    let mut segments = Vec::new();
    for (to, speed) in
        [(150.0, 200.0), (20.0, 60.0), (90.0, 250.0), (10.0, 120.0), (60.0, 20.0), (180.0, 240.0)].repeat(3)
    {
        segments.push(Segment::Move { to: to + random.uniform(-5.0, 5.0), speed, acceleration: 2500.0 });
        segments.push(Segment::Dwell { time: 0.1 });
    }
    (segments, 30.0)
}

/// What is said by slow ways, see [`slow_ways`].
pub fn said_of_slow_ways(rigs: [&Rig; 2], seed: u64, change: impl Fn(&mut Truth)) -> (String, Vec<(String, f64)>) {
    let mut random = Random::new(seed, 8);
    said_along(slow_ways(&mut random), Vec::new(), rigs, random, change)
}

/// Slow ways there and back about one place, with a rest after each, and two fast ones.
pub fn slow_ways(random: &mut Random) -> (Vec<Segment>, f64) {
    let mut segments = Vec::new();
    for (way, speed) in
        [(20.0, 120.0), (0.5, 0.5), (0.5, 0.5), (0.6, 1.2), (0.9, 1.2), (1.5, 3.0), (5.0, 8.0), (8.0, 25.0)]
    {
        for to in [60.0 + way, 60.0 - way] {
            segments.push(Segment::Move { to: to + random.uniform(-0.05, 0.05), speed, acceleration: 1000.0 });
            segments.push(Segment::Dwell { time: 0.4 });
        }
    }
    (segments, 40.0)
}

/// What `gib predict` says of such ways by a machine file with these effects.
pub fn predicted(
    ways: fn(&mut Random) -> (Vec<Segment>, f64),
    effects: Vec<Value>,
    rig: &Rig,
    seed: u64,
    change: impl Fn(&mut Truth),
) -> Value {
    let mut random = Random::new(seed, 9);
    let folder = recorded(ways(&mut random), effects, [rig, rig], random, change);
    let at = |name: &str| folder.path().join(name);
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_gib"));
    command.args(["predict", "--json", "--machine"]).arg(at("machine.json")).arg("--recording").arg(at("run.csv"));
    let output = command.arg("--out").arg(at("predicted.csv")).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice::<Value>(&output.stdout).unwrap()["x"].clone()
}

/// A folder with `run.csv` and `machine.json`: a rig's recording of segments, cut off at a time, s, and what is believed of it.
fn recorded(
    (segments, time): (Vec<Segment>, f64),
    effects: Vec<Value>,
    [believed, rig]: [&Rig; 2],
    mut random: Random,
    change: impl Fn(&mut Truth),
) -> tempfile::TempDir {
    let mut truth = Truth::of(rig);
    change(&mut truth);
    let command = moves::sample(10.0, &segments, rig.servo.period, time, 0.02);
    let run = record::run(rig, &truth, &command, 1e-5, &mut random);
    let folder = tempfile::tempdir().unwrap();
    run.write(rig, &folder.path().join("run.csv")).unwrap();
    std::fs::write(folder.path().join("machine.json"), believed.machine_file("rig", effects).to_string()).unwrap();
    folder
}

/// What is said after segments, cut off at a time, s.
fn said_along(
    segments: (Vec<Segment>, f64),
    effects: Vec<Value>,
    rigs: [&Rig; 2],
    random: Random,
    change: impl Fn(&mut Truth),
) -> (String, Vec<(String, f64)>) {
    said_in(recorded(segments, effects, rigs, random, change).path())
}

/// What is said of a rig as believed whose servo nobody knows.
pub fn said_without_its_servo(rigs: [&Rig; 2], seed: u64, change: impl Fn(&mut Truth)) -> (String, Vec<(String, f64)>) {
    let mut random = Random::new(seed, 7);
    let folder = recorded(fast_ways(&mut random), Vec::new(), rigs, random, change);
    let file = folder.path().join("machine.json");
    let mut machine: Value = serde_json::from_str(&std::fs::read_to_string(&file).unwrap()).unwrap();
    machine["axes"][0].as_object_mut().unwrap().remove("servo").unwrap();
    std::fs::write(file, machine.to_string()).unwrap();
    said_in(folder.path())
}

/// What is said of what lies in a folder.
fn said_in(folder: &Path) -> (String, Vec<(String, f64)>) {
    let at = |name: &str| folder.join(name);
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_gib"));
    command.arg("diagnose").arg("--machine").arg(at("machine.json")).arg("--recording").arg(at("run.csv"));
    let output = command.arg("--json").arg(at("said.json")).output().unwrap();
    assert!(output.status.code().is_some_and(|code| code < 2), "{}", String::from_utf8_lossy(&output.stderr));
    let said: Value = serde_json::from_str(&std::fs::read_to_string(at("said.json")).unwrap()).unwrap();
    let finding = |finding: &Value| {
        let first = finding["parameters"].as_object().unwrap().values().next().unwrap();
        (finding["cause"].as_str().unwrap().to_owned(), first["value"].as_f64().unwrap())
    };
    let findings = said["findings"].as_array().unwrap().iter().map(finding).collect();
    (said["verdict"].as_str().unwrap().to_owned(), findings)
}
