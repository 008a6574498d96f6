//! What an encoder makes of itself under its servo is no cause. Recordings of a rigid axis that is as believed, by an integrator of their
//! own, behind coarse and noisy encoders: at steady feeds readings beat with the rows, and a servo answers their noise.

#[path = "support/random.rs"]
mod random;

use gib::diagnosis::{Diagnosis, Excerpt, Verdict, diagnose};
use gib::machine::{Axis, Cause, Machine};
use gib::plant::moves::{Moves, Reach};
use gib::plant::simulate::{Sensors, Setup, simulate};
use gib::recording::{Column, Recording};
use random::Random;
use std::f64::consts::TAU;

/// A ball screw of 10 mm under a servo of this period.
fn axis(period_s: f64) -> Axis {
    let servo = if period_s < 5e-4 {
        r#""position_gain_1_s":80,"velocity_gain_nm_s":0.9,"velocity_integral_time_s":0.01,"torque_time_constant_s":0.0002"#
    } else {
        r#""position_gain_1_s":40,"velocity_gain_nm_s":0.528,"velocity_integral_time_s":0.02,"torque_time_constant_s":0.0005"#
    };
    let text = format!(
        r#"{{"schema":"gib.machine/1","name":"t","axes":[{{"name":"x","drive":"ball_screw","lead_mm":10,"inertia_kg_m2":0.0028,
        "coulomb_friction_nm":0.9,"viscous_friction_nm_s":0.008,"constant_torque_nm":0,"torque_limit_nm":16,
        "servo":{{"period_s":{period_s},"velocity_feedforward":1,{servo}}}}}]}}"#
    );
    Machine::parse(&text).unwrap().axes.remove(0)
}

/// How a recording is made.
#[derive(Clone, Copy)]
struct Rig {
    /// Servo period, and every how many cycles a row is written.
    period_s: f64,
    every: usize,
    seconds: f64,
    /// Top speed of strokes over 200 mm; the others are a half, a quarter, a tenth and a twentieth of it.
    speed: f64,
    grid_um: f64,
    noise_um: f64,
    torque_noise: f64,
    /// A torque that nobody told, by time.
    extra: fn(f64) -> f64,
    /// The displacement over which friction builds up, µm; 0 at once.
    yields_um: f64,
}

const RIG: Rig = Rig {
    period_s: 1e-3,
    every: 1,
    seconds: 40.0,
    speed: 200.0,
    grid_um: 0.1,
    noise_um: 0.0,
    torque_noise: 0.02,
    extra: |_| 0.0,
    yields_um: 0.0,
};

/// Place at each cycle of strokes to and fro.
fn command(rig: &Rig) -> Vec<f64> {
    const STROKE: f64 = 200.0;
    const ACCELERATION: f64 = 2000.0;
    let mut places = vec![0.0; (0.6 / rig.period_s) as usize];
    let mut stroke = 0;
    while (places.len() as f64) < rig.seconds / rig.period_s {
        let speed = rig.speed * [1.0, 0.5, 0.25, 0.1, 0.05][stroke / 2 % 5];
        let (rise, all) = (speed / ACCELERATION, STROKE / speed + speed / ACCELERATION);
        let (mut cycle, back) = (1, stroke % 2 == 1);
        while cycle as f64 * rig.period_s < all {
            let t = cycle as f64 * rig.period_s;
            let near = |t: f64| if t < rise { 0.5 * ACCELERATION * t * t } else { speed * (t - 0.5 * rise) };
            let gone = if t < all - rise { near(t) } else { STROKE - near(all - t) };
            places.push(if back { STROKE - gone } else { gone });
            cycle += 1;
        }
        let end = if back { 0.0 } else { STROKE };
        places.extend(std::iter::repeat_n(end, (0.2 / rig.period_s) as usize));
        stroke += 1;
    }
    places
}

/// The recording of an axis that is as believed, but for the rig's torque and its friction.
fn recorded(rig: &Rig, seed: u64) -> Recording {
    let servo = axis(rig.period_s).servo.unwrap();
    let (inertia, coulomb, viscous, mm) = (0.0028, 0.9, 0.008, 10.0 / TAU);
    let mut random = Random(seed);
    let substeps = (rig.period_s / 2e-5).round() as usize;
    let h = rig.period_s / substeps as f64;
    let (mut angle, mut speed, mut torque, mut integral, mut bristle) = (0.0f64, 0.0f64, 0.0f64, 0.0f64, 0.0f64);
    let (mut read_before, mut command_before) = (0.0, 0.0);
    let [mut time, mut commands, mut position, mut torques] = [const { Vec::new() }; 4];
    let offset = 0.37 * rig.grid_um * 1e-3;
    for (cycle, command) in command(rig).into_iter().enumerate() {
        let grid = rig.grid_um * 1e-3;
        let read = ((angle * mm + offset + 1e-3 * rig.noise_um * random.normal()) / grid).round() * grid;
        let wanted = servo.position_gain_1_s * (command - read) / mm
            + servo.velocity_feedforward * (command - command_before) / rig.period_s / mm;
        let error = wanted - (read - read_before) / rig.period_s / mm;
        (read_before, command_before) = (read, command);
        integral += error * rig.period_s / servo.velocity_integral_time_s.unwrap();
        let asked = (servo.velocity_gain * (error + integral)).clamp(-16.0, 16.0);
        if cycle % rig.every == 0 {
            time.push(cycle as f64 * rig.period_s);
            commands.push(command);
            position.push(read);
            torques.push(((torque + rig.torque_noise * random.normal()) / 0.01).round() * 0.01);
        }
        for step in 0..substeps {
            torque += (asked - torque) * h / servo.torque_time_constant_s;
            let t = cycle as f64 * rig.period_s + step as f64 * h;
            let free = torque + (rig.extra)(t) - viscous * speed;
            if rig.yields_um > 0.0 {
                let way = 1e-3 * rig.yields_um / mm;
                let end = (1.0 - (-(speed * h).abs() / way).exp()) * (speed.signum() - bristle);
                bristle += end;
                speed += h / inertia * (free - coulomb * bristle);
            } else {
                let moved = speed + h / inertia * (free - coulomb * speed.signum());
                let sticks = speed == 0.0 || moved * speed < 0.0;
                speed = match sticks {
                    true if free.abs() <= coulomb => 0.0,
                    true => h / inertia * (free - coulomb * free.signum()),
                    false => moved,
                };
            }
            angle += h * speed;
        }
    }
    let columns = vec![
        Column::new("x.position_command_mm", commands),
        Column::new("x.position_mm", position),
        Column::new("x.torque_nm", torques),
    ];
    Recording::from_columns("strokes", time, columns).unwrap()
}

fn judged(rig: &Rig, seed: u64, axis: &Axis) -> Diagnosis {
    let excerpt = Excerpt::of(&recorded(rig, seed), axis);
    let d = diagnose(axis, &excerpt, None, &|_, _| true).unwrap();
    println!("seed {seed}: {:?} {:?} {:?}", d.verdict, named(&d), d.notes);
    d
}

fn named(d: &Diagnosis) -> Vec<Cause> {
    d.findings.iter().map(|finding| finding.effect.cause()).collect()
}

/// Rows of a faster servo, of which every cycle is one, at feeds that beat with its grid.
const BEATS: [Rig; 2] = [
    Rig { period_s: 2.5e-4, seconds: 15.0, speed: 215.77, grid_um: 1.0, ..RIG },
    Rig { period_s: 2.5e-4, seconds: 15.0, speed: 163.36, grid_um: 0.2, ..RIG },
];

#[test]
fn what_readings_beat_is_no_vibration() {
    for rig in BEATS {
        let d = judged(&rig, 1, &axis(rig.period_s));
        assert_eq!(d.verdict, Verdict::NoDiscrepancy);
        assert!(d.notes.iter().any(|note| note.contains("in a recording of this machine without it")));
    }
    let rig = Rig { grid_um: 0.1, extra: |t| 0.1 * (TAU * 57.0 * t).sin(), ..BEATS[0] };
    let d = judged(&rig, 1, &axis(rig.period_s));
    assert_eq!((d.verdict, named(&d)), (Verdict::Explained, vec![Cause::ExternalVibration]));
}

#[test]
fn what_a_servo_that_nobody_knows_makes_of_noise_is_no_friction_that_builds_up() {
    for speed in [200.0, 163.36] {
        let noisy = Rig { noise_um: 0.3, grid_um: 0.02, speed, ..RIG };
        let d = judged(&noisy, 1, &Axis { servo: None, ..axis(RIG.period_s) });
        assert_eq!(d.verdict, Verdict::NoDiscrepancy);
    }
    let yielding = Rig { yields_um: 6.0, noise_um: 0.3, grid_um: 0.02, ..RIG };
    let d = judged(&yielding, 1, &axis(RIG.period_s));
    assert_eq!((d.verdict, named(&d)), (Verdict::Explained, vec![Cause::PreslidingFriction]));
}

/// Of a servo of 4 kHz every fourth cycle is recorded: what it does between the rows beats with them.
#[test]
fn a_row_in_four_cycles_is_no_discrepancy() {
    let axis = axis(2.5e-4);
    let reach = Reach { start: 20.0, stroke: 200.0, speed: 250.0, acceleration: 2500.0 };
    let commands = Moves::built_in("reversals", &reach).unwrap().command(2.5e-4);
    for grid_um in [0.1, 0.5] {
        let sensors = Sensors { grid_um, torque_noise: 0.03, torque_grid: 0.01, ..Sensors::default() };
        let trace = simulate(&axis, &commands, &Setup { seed: 1, sensors, ..Setup::default() }).unwrap();
        let fourth = |values: &[f64]| values.iter().copied().step_by(4).collect::<Vec<f64>>();
        let columns = vec![
            Column::new("x.position_command_mm", fourth(&commands)),
            Column::new("x.position_mm", fourth(&trace.position)),
            Column::new("x.torque_nm", fourth(&trace.torque)),
        ];
        let recording = Recording::from_columns("every fourth", fourth(&trace.time_s), columns).unwrap();
        let d = diagnose(&axis, &Excerpt::of(&recording, &axis), None, &|_, _| true).unwrap();
        assert_eq!(d.verdict, Verdict::NoDiscrepancy, "{grid_um} µm: {:?}", d.notes);
    }
}
