//! What a servo makes of a coarse encoder's noise hides what is slow: a quieter look finds it, and finds nothing where nothing is. The
//! recordings are those of the scoreboard's generator, which shares no code with the product.

#[path = "../examples/scoreboard/board/mod.rs"]
#[allow(dead_code)]
mod board;

use board::moves::{self, Segment};
use board::random::Random;
use board::record;
use board::rig::{Drive, Rig, ServoGains};
use board::rough::Rough;
use board::truth::Truth;
use serde_json::Value;

/// A ball screw of 10 mm under a servo of its own, with an encoder on a grid of 1 µm and a torque that is known well.
fn rig() -> Rig {
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
        unit: 10.0 / std::f64::consts::TAU,
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

/// What is said of the rig as believed by a recording of it with something changed: verdict and named causes with their first value.
fn said(seed: u64, change: impl Fn(&mut Truth)) -> (String, Vec<(String, f64)>) {
    let rig = rig();
    let mut truth = Truth::of(&rig);
    change(&mut truth);
    let mut random = Random::new(seed, 7);
    let mut segments = Vec::new();
    for (to, speed) in
        [(150.0, 200.0), (20.0, 60.0), (90.0, 250.0), (10.0, 120.0), (60.0, 20.0), (180.0, 240.0)].repeat(3)
    {
        segments.push(Segment::Move { to: to + random.uniform(-5.0, 5.0), speed, acceleration: 2500.0 });
        segments.push(Segment::Dwell { time: 0.1 });
    }
    let command = moves::sample(10.0, &segments, rig.servo.period, 30.0, 0.02);
    let run = record::run(&rig, &truth, &command, 1e-5, &mut random);
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    run.write(&rig, &at("run.csv")).unwrap();
    std::fs::write(at("machine.json"), rig.machine_file("rig", Vec::new()).to_string()).unwrap();
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

/// Each is a thousandth of what the belief has, or of its friction: one look alone says that there is no discrepancy.
#[test]
fn what_the_encoders_noise_hides_is_found() {
    let alone = |seed, cause: &str, [believed, true_value]: [f64; 2], change: &dyn Fn(&mut Truth)| {
        let (verdict, findings) = said(seed, change);
        println!("seed {seed}: {verdict} {findings:?}");
        assert_eq!(verdict, "explained");
        let [(name, found)] = findings.as_slice() else { panic!("{findings:?}") };
        let off = (found - true_value).abs() / (true_value - believed).abs();
        assert!(name == cause && off < 0.2, "{name} {found}: off by {off}");
    };
    alone(1, "inertia_mismatch", [0.0028, 0.0028028], &|truth| truth.inertia = 0.0028028);
    alone(2, "coulomb_friction_mismatch", [0.9, 0.901], &|truth| truth.coulomb = 0.901);
    alone(3, "constant_torque", [0.0, 0.0012], &|truth| truth.constant = 0.0012);
}

#[test]
fn a_machine_as_believed_is_told_as_such_in_that_noise() {
    for seed in [11, 12] {
        let (verdict, findings) = said(seed, |_| ());
        assert_eq!((verdict.as_str(), findings.as_slice()), ("no_discrepancy", &[][..]), "seed {seed}");
    }
}
