//! The plant against closed forms and laws, and the prediction against what the plant was told.

use gib::machine::{Axis, Effect, Machine};
use gib::plant::axis::Body;
use gib::plant::moves::{Moves, Reach};
use gib::plant::observed::Observed;
use gib::plant::physics::Physics;
use gib::plant::predict::predict_torque;
use gib::plant::simulate::{Sensors, Setup, Trace, simulate};
use std::f64::consts::TAU;

const RIG: &str = r#"{ "schema": "gib.machine/1", "name": "rig", "axes": [ {
    "name": "x", "drive": "ball_screw", "lead_mm": 10.0, "inertia_kg_m2": 0.0028, "coulomb_friction_nm": 0.9,
    "viscous_friction_nm_s": 0.008, "torque_limit_nm": 16.0,
    "servo": { "period_s": 0.001, "position_gain_1_s": 40.0, "velocity_gain_nm_s": 0.528, "velocity_integral_time_s": 0.02,
               "velocity_feedforward": 1.0, "torque_time_constant_s": 0.0005 } } ] }"#;
const REACH: Reach = Reach { start: 20.0, stroke: 200.0, speed: 250.0, acceleration: 2500.0 };
const NOISY: Sensors = Sensors {
    grid_um: 0.01,
    noise_um: 0.02,
    delay_s: 0.0,
    scale_um_m: 0.0,
    eccentricity_um: 0.0,
    torque_noise: 0.01,
    torque_grid: 0.001,
};

fn rig(effects: &[Effect]) -> Axis {
    Machine::parse(RIG).unwrap().axes[0].with_effects(effects.to_vec())
}

fn frictionless(effects: &[Effect]) -> Axis {
    let mut axis = rig(effects);
    (axis.base.coulomb, axis.base.viscous) = (0.0, 0.0);
    axis
}

fn run(axis: &Axis, set: &str, setup: &Setup) -> Trace {
    let command = Moves::built_in(set, &REACH).unwrap().command(axis.servo.unwrap().period_s);
    simulate(axis, &command, setup).unwrap()
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, n) = values.filter(|v| v.is_finite()).fold((0.0, 0.0), |(sum, n), v| (sum + v * v, n + 1.0));
    (sum / n).sqrt()
}

#[test]
fn constant_torque_accelerates_as_the_closed_form_says() {
    // J·dω/dt + Tv·ω = T − Tc.
    let physics = Physics::of(&rig(&[])).unwrap();
    let mut body = Body::new(physics, [25e-6; 3], 0.0, [0.0; 2], 0.0);
    for ms in 1..=400 {
        body.advance(1.5, 40);
        let t = f64::from(ms) * 1e-3;
        let exact = (1.5 - 0.9) / 0.008 * (1.0 - (-0.008 * t / 0.0028).exp());
        assert!((body.motor_velocity() / exact - 1.0).abs() < 1e-6, "{t}");
    }
}

#[test]
fn motor_torque_follows_with_its_time_constant() {
    let mut body = Body::new(Physics::of(&frictionless(&[])).unwrap(), [25e-6; 3], 0.5e-3, [0.0; 2], 0.0);
    body.advance(2.0, 40);
    assert!((body.torque() - 2.0 * (1.0 - (-2.0_f64).exp())).abs() < 1e-12);
    // The impulse that has reached the inertia: ∫T dt = 2·(t − τ·(1 − e^(−t/τ))).
    let impulse = 2.0 * (1e-3 - 0.5e-3 * (1.0 - (-2.0_f64).exp()));
    assert!((body.motor_velocity() * 0.0028 / impulse - 1.0).abs() < 1e-9);
}

#[test]
fn two_masses_swing_at_their_resonance_and_keep_momentum_and_energy() {
    let compliance = Effect::DriveCompliance {
        resonance_hz: 80.0,
        stiffness_n_um: 60.0,
        table_inertia_share: 0.5,
        table_friction_share: 0.5,
        damping_ratio: 0.0,
    };
    let axis = frictionless(&[compliance]);
    let masses = axis.two_masses().unwrap().unwrap();
    let mut body = Body::new(Physics::of(&axis).unwrap(), [25e-6; 3], 0.0, [0.0; 2], 0.0);
    body.advance(5.0, 40);
    let momentum = 5.0 * 1e-3;
    let (mut speeds, mut wind) = (Vec::new(), Vec::new());
    for _ in 0..40_000 {
        body.advance(0.0, 1);
        speeds.push(body.motor_velocity());
        wind.push(body.motor_position() - body.table_position());
    }
    // The table's speed from its momentum; the energy then has one value.
    let energy = |i: usize| {
        let table = (momentum - masses.motor_inertia * speeds[i]) / masses.table_inertia;
        0.5 * (masses.motor_inertia * speeds[i].powi(2)
            + masses.table_inertia * table * table
            + masses.stiffness * wind[i].powi(2))
    };
    let start = energy(0);
    assert!((0..wind.len()).all(|i| (energy(i) / start - 1.0).abs() < 0.02), "energy drifts");
    assert!((energy(39_000) / energy(0) - 1.0).abs() < 0.02);
    let crossings = wind.windows(2).filter(|w| w[0] < 0.0 && w[1] >= 0.0).count();
    let hz = crossings as f64;
    assert!((hz - 80.0).abs() <= 1.0, "{hz} swings in a second");
}

#[test]
fn an_axis_within_its_friction_stands_still_to_the_last_bit() {
    let mut body = Body::new(Physics::of(&rig(&[])).unwrap(), [25e-6; 3], 0.0005, [1.25, 0.0], 0.0);
    for torque in [0.89, -0.89, 0.5, -0.1] {
        body.advance(torque, 4000);
        assert_eq!((body.motor_position(), body.motor_velocity()), (1.25, 0.0));
    }
}

/// Flanks that swing at 1500 Hz take steps of 7 µs, and while they are calm 25 µs do, beside friction that builds up as well: what differs
/// from steps of 1 µs all the time is that they meet a part of a step sooner or later.
#[test]
fn calm_flanks_do_as_well_in_longer_steps() {
    let backlash = Effect::Backlash {
        width_um: 50.0,
        table_inertia_share: 0.4,
        table_friction_share: 0.6,
        contact_hz: 1500.0,
        contact_damping_ratio: 0.3,
    };
    let building_up = |exponent, maxwell_slip| Effect::PreslidingFriction {
        displacement_um: 12.0,
        exponent,
        maxwell_slip,
        micro_damping_s: 0.0,
    };
    let beside = [[backlash, building_up(0.7, 0.0)], [backlash, building_up(0.5, 1.0)]];
    let cases = [
        ("reversals", &[backlash][..], 20e-6),
        ("test", &[backlash], 20e-6),
        ("test", &beside[0], 30e-6),
        ("test", &beside[1], 30e-6),
    ];
    for (moves, effects, most) in cases {
        let [long, short] =
            [25e-6, 1e-6].map(|step_s| run(&rig(effects), moves, &Setup { step_s, ..Setup::default() }));
        let apart = |a: &[f64], b: &[f64]| rms(a.iter().zip(b).map(|(a, b)| a - b));
        let motor = apart(&long.position, &short.position);
        let table = apart(&long.table_position, &short.table_position);
        assert!(motor < 15e-6 && table < most, "{motor} and {table} mm in {moves} of {effects:?}");
    }
}

#[test]
fn a_clearance_is_crossed_without_torque_on_the_table() {
    let backlash = Effect::Backlash {
        width_um: 50.0,
        table_inertia_share: 0.5,
        table_friction_share: 0.5,
        contact_hz: 400.0,
        contact_damping_ratio: 0.3,
    };
    let trace = run(&rig(&[backlash]), "reversals", &Setup::default());
    // In steady slow motion one way and the other, motor − table differs by clearance + 2·Ts/k.
    let masses = rig(&[backlash]).two_masses().unwrap().unwrap();
    let speed: Vec<f64> = trace.position.windows(2).map(|w| (w[1] - w[0]) / 1e-3).collect();
    let side = |sign: f64| {
        let rows: Vec<usize> = (0..speed.len()).filter(|&i| (sign * speed[i] - 2.5).abs() < 0.02).collect();
        rows.iter().map(|&i| trace.position[i] - trace.table_position[i]).sum::<f64>() / rows.len() as f64
    };
    let per_um = TAU / 10.0 / 1000.0;
    let sliding = 0.5 * (0.9 + 0.008 * 2.5 * TAU / 10.0);
    let expected = 50.0 + 2.0 * sliding / masses.stiffness / per_um;
    let lost = 1000.0 * (side(1.0) - side(-1.0));
    assert!((lost - expected).abs() < 0.1, "{lost} µm, expected {expected}");
}

/// Halving the step at least halves the error, with everything in it that is not smooth.
#[test]
fn the_plant_converges_with_its_step() {
    let effects = [
        Effect::Backlash {
            width_um: 20.0,
            table_inertia_share: 0.4,
            table_friction_share: 0.6,
            contact_hz: 400.0,
            contact_damping_ratio: 0.3,
        },
        Effect::PreslidingFriction { displacement_um: 8.0, exponent: 1.0, maxwell_slip: 0.0, micro_damping_s: 0.0 },
        Effect::StribeckFriction { torque: 0.3, velocity_mm_s: 4.0, exponent: 2.0 },
    ];
    for effects in [&effects[..0], &effects[1..], &effects[..]] {
        let at = |step_s| run(&rig(effects), "reversals", &Setup { step_s, ..Setup::default() }).position;
        let fine = at(1e-6);
        let error = |step_s| 1000.0 * rms(at(step_s).iter().zip(&fine).map(|(a, b)| a - b));
        let (coarse, middle) = (error(25e-6), error(6.25e-6));
        println!("{} effects: 25 µs {coarse:.5} µm, 6.25 µs {middle:.5} µm", effects.len());
        assert!(coarse < 0.05 && middle < 0.5 * coarse + 1e-6, "{coarse} µm, {middle} µm");
    }
}

/// Steps of half a millisecond where nothing is sudden are as exact as those of 25 µs all the way.
#[test]
fn longer_steps_are_none_the_worse() {
    let spring = |resonance_hz| Effect::DriveCompliance {
        resonance_hz,
        stiffness_n_um: 10.0,
        table_inertia_share: 0.5,
        table_friction_share: 0.5,
        damping_ratio: 0.02,
    };
    let slow = Effect::StribeckFriction { torque: 0.4, velocity_mm_s: 3.0, exponent: 1.2 };
    let spot = Effect::PositionDependentFriction { centre_mm: 90.0, peak: 0.5, width_mm: 6.0, steepness: 8.0 };
    let building_up = |exponent, maxwell_slip, micro_damping_s| Effect::PreslidingFriction {
        displacement_um: 10.0,
        exponent,
        maxwell_slip,
        micro_damping_s,
    };
    let cases = [
        vec![],
        vec![slow],
        vec![slow, spot, Effect::DirectionDependentFriction { asymmetry: 0.003 }],
        vec![Effect::QuadraticDrag { drag: 2.0 }, Effect::TorqueSaturation { limit: 4.0, slope_ratio: 0.5 }],
        vec![
            Effect::Cogging { amplitude: 0.2, period_mm: 2.5 },
            Effect::ExternalVibration { frequency_hz: 37.0, amplitude: 0.2 },
        ],
        vec![building_up(1.0, 0.0, 0.0)],
        vec![building_up(1.0, 0.0, 0.001), slow],
        vec![building_up(0.7, 0.0, 0.0), spot],
        vec![building_up(0.5, 1.0, 0.0)],
        vec![spring(60.0), slow],
        vec![spring(60.0), building_up(1.0, 0.0, 0.0)],
    ];
    for effects in cases {
        let at = |setup: Setup| run(&rig(&effects), "test", &setup).position;
        let exact = at(Setup { step_s: 2e-6, ..Setup::default() });
        let error = |setup: Setup| 1000.0 * rms(at(setup).iter().zip(&exact).map(|(a, b)| a - b));
        let (usual, long) = (error(Setup::default()), error(Setup { smooth_step_s: 500e-6, ..Setup::default() }));
        println!("{effects:?}: 25 µs {usual:.5} µm, longer {long:.5} µm");
        assert!(long < 1.2 * usual.max(0.01), "{effects:?}: {long} µm, {usual} µm");
    }
}

#[test]
fn a_seed_repeats_and_another_one_differs() {
    let axis = rig(&[Effect::Cogging { amplitude: 0.2, period_mm: 2.5 }]);
    let at = |seed| run(&axis, "sweep", &Setup { seed, sensors: NOISY, ..Setup::default() });
    assert_eq!(at(3), at(3));
    assert_ne!(at(3).torque, at(4).torque);
}

#[test]
fn dead_time_of_whole_cycles_shifts_the_torque_by_rows() {
    let plain = run(&rig(&[]), "sweep", &Setup::default());
    for (delay_ms, rows) in [(2.0, 2_i32), (-3.0, -3)] {
        let late = run(&rig(&[Effect::DeadTime { delay_ms }]), "sweep", &Setup::default());
        assert_eq!(late.position, plain.position);
        for i in 10..late.torque.len() - 10 {
            let source = (i as i32 - rows) as usize;
            assert!((late.torque[i] - plain.torque[source]).abs() < 1e-9, "{delay_ms} ms, row {i}");
        }
    }
}

#[test]
fn sensors_do_what_they_say() {
    let axis = rig(&[]);
    let sensors = Sensors { grid_um: 5.0, ..Sensors::default() };
    let coarse = run(&axis, "strokes", &Setup { sensors, ..Setup::default() });
    assert!(coarse.position.iter().all(|x| (x / 0.005 - (x / 0.005).round()).abs() < 1e-6));
    // An encoder that reads 100 µm per m too much, and is eccentric by 6 µm: the servo follows it, the table shows it.
    let sensors = Sensors { scale_um_m: 100.0, eccentricity_um: 6.0, ..Sensors::default() };
    let wrong = run(&axis, "strokes", &Setup { sensors, ..Setup::default() });
    for (read, table) in wrong.position.iter().zip(&wrong.table_position) {
        let expected = table * (1.0 + 1e-4) + 0.006 * (TAU * table / 10.0).sin();
        assert!((read - expected).abs() < 1e-9);
    }
    // A scale that shows the position of 5 ms ago is behind by 5 ms of travel against one that does not.
    let sensors = Sensors { delay_s: 0.002, ..Sensors::default() };
    let late = run(&axis, "strokes", &Setup { sensors, ..Setup::default() });
    let lag = late.command.iter().zip(&late.table_position).map(|(c, x)| (c - x).abs()).fold(0.0, f64::max);
    assert!(lag > 0.02, "{lag} mm");
}

/// Prediction with the true effects leaves what it leaves on an axis without effects; without them it leaves much more.
#[test]
fn every_cause_of_torque_is_predicted() {
    let clean = residual(&rig(&[]), &rig(&[]), 11);
    let causes = [
        Effect::InertiaMismatch { inertia: 0.0034 },
        Effect::CoulombFrictionMismatch { torque: 1.2 },
        Effect::ViscousFrictionMismatch { slope: 0.014 },
        Effect::ConstantTorque { torque: 0.4 },
        Effect::DirectionDependentFriction { asymmetry: 0.003 },
        Effect::StribeckFriction { torque: 0.6, velocity_mm_s: 20.0, exponent: 2.0 },
        Effect::PreslidingFriction { displacement_um: 400.0, exponent: 1.0, maxwell_slip: 0.0, micro_damping_s: 0.0 },
        Effect::DriveCompliance {
            resonance_hz: 32.0,
            stiffness_n_um: 10.0,
            table_inertia_share: 0.5,
            table_friction_share: 0.5,
            damping_ratio: 0.05,
        },
        Effect::Cogging { amplitude: 0.15, period_mm: 2.5 },
        Effect::PositionDependentFriction { centre_mm: 110.0, peak: 0.5, width_mm: 25.0, steepness: 2.0 },
        Effect::CableForce { slope: 0.004, zero_mm: 100.0 },
        Effect::QuadraticDrag { drag: 8.0 },
        Effect::ThermalDrift { drop: 0.4, time_constant_s: 25.0, until_s: 1e9 },
        Effect::DeadTime { delay_ms: 4.0 },
        Effect::ExternalVibration { frequency_hz: 7.3, amplitude: 0.12 },
        Effect::TorqueSaturation { limit: 1.5, slope_ratio: 0.5 },
    ];
    println!("clean {clean:.4}");
    let mut failed = Vec::new();
    for cause in causes {
        let truth = rig(&[cause]);
        let (with, without) = (residual(&truth, &truth, 11), residual(&rig(&[]), &truth, 11));
        println!("{:30} with {with:.4} without {without:.4}", cause.cause().name());
        if !(with < 1.4 * clean && without > 1.8 * with) {
            failed.push(cause.cause());
        }
    }
    assert!(failed.is_empty(), "{failed:?}");
}

/// A clearance is predicted from the scale as well as anything; without one the table's impacts can only be simulated, and
/// the prediction is still far better than a rigid one.
#[test]
fn a_clearance_is_predicted_with_and_without_a_scale() {
    let clean = residual(&rig(&[]), &rig(&[]), 11);
    let truth = rig(&[Effect::Backlash {
        width_um: 60.0,
        table_inertia_share: 0.4,
        table_friction_share: 0.6,
        contact_hz: 400.0,
        contact_damping_ratio: 0.3,
    }]);
    let rigid = residual(&rig(&[]), &truth, 11);
    let (encoder, scale) = (residual(&truth, &truth, 11), residual_of(&truth, &truth, 11, true));
    println!("clearance: clean {clean:.4}, rigid {rigid:.4}, encoder alone {encoder:.4}, with scale {scale:.4}");
    assert!(scale < 3.0 * clean && encoder < 0.4 * rigid && rigid > 5.0 * scale);
}

/// RMS residual of the torque while the axis moves, predicted as `belief` on a recording of `truth`.
fn residual(belief: &Axis, truth: &Axis, seed: u64) -> f64 {
    residual_of(belief, truth, seed, false)
}

fn residual_of(belief: &Axis, truth: &Axis, seed: u64, scale: bool) -> f64 {
    let trace = run(truth, "test", &Setup { seed, sensors: NOISY, ..Setup::default() });
    let runs = std::iter::once(0..trace.time_s.len()).collect();
    let table = scale.then_some(trace.table_position);
    let observed =
        Observed::from_columns(trace.time_s, trace.position, trace.torque, Some(trace.command), table, runs).unwrap();
    let predicted = predict_torque(belief, &observed).unwrap().torque;
    // Ten rows before and after a standstill are left out too: a late torque is that of another row.
    let moving = |i: &usize| (i - 10..i + 10).all(|k| observed.motion.velocity(k).abs() > 0.4);
    rms((10..predicted.len() - 10).filter(moving).map(|i| observed.torque[i] - predicted[i]))
}
