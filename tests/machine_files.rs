//! Machine files: what is read is written, what is written fits the schema, and what is wrong is said with its path.

#[path = "common/schema.rs"]
mod schema;

use gib::machine::{CAUSES, Drive, Effect, Machine, VelocityEstimate};
use proptest::prelude::*;
use serde_json::{Value, json};

fn machine_schema() -> Value {
    serde_json::from_str(include_str!("../schema/machine.schema.json")).unwrap()
}

fn rig(drive: &str) -> Value {
    let mut axis = match drive {
        "linear" => {
            json!({ "mass_kg": 95.0, "coulomb_friction_n": 20.0, "viscous_friction_n_s_m": 200.0, "constant_force_n": -3.0, "force_limit_n": 350.0 })
        }
        _ => {
            json!({ "inertia_kg_m2": 0.0028, "coulomb_friction_nm": 0.9, "viscous_friction_nm_s": 0.008, "constant_torque_nm": 0.1,
                     "torque_limit_nm": 16.0, "motor_pole_pairs": 4 })
        }
    };
    match drive {
        "ball_screw" => axis["lead_mm"] = json!(10.0),
        "rotary" => axis["ratio"] = json!(90.0),
        _ => {}
    }
    let gain = if drive == "linear" { "velocity_gain_n_s_m" } else { "velocity_gain_nm_s" };
    axis["name"] = json!("x");
    axis["drive"] = json!(drive);
    axis["servo"] = json!({ "period_s": 0.001, "position_gain_1_s": 40.0, gain: 0.5, "velocity_integral_time_s": 0.02,
        "velocity_feedforward": 1.0, "torque_time_constant_s": 0.0005, "velocity_estimate": "two_sample_mean" });
    json!({ "schema": "gib.machine/1", "name": "rig", "axes": [axis] })
}

/// The error of a ball-screw rig that was changed.
fn refused(change: impl FnOnce(&mut Value)) -> String {
    let mut file = rig("ball_screw");
    change(&mut file);
    Machine::parse(&file.to_string()).expect_err("must be refused").to_string()
}

#[test]
fn every_drive_survives_the_way_through_the_file() {
    for drive in ["ball_screw", "linear", "rotary"] {
        let machine = Machine::parse(&rig(drive).to_string()).unwrap();
        assert!(machine.ignored_keys.is_empty(), "{:?}", machine.ignored_keys);
        let axis = machine.axis("x").unwrap();
        assert_eq!((axis.drive.name(), axis.drive.is_linear()), (drive, drive == "linear"));
        assert_eq!(axis.servo.unwrap().velocity_estimate, VelocityEstimate::TwoSampleMean);
        let written = machine.to_json();
        assert_eq!(schema::violations(&machine_schema(), &written), Vec::<String>::new());
        assert_eq!(Machine::parse(&written.to_string()).unwrap(), machine);
    }
}

#[test]
fn the_example_of_the_format_reads_as_it_says() {
    let text = r#"{ "schema": "gib.machine/1", "name": "rig", "axes": [ {
        "name": "x", "drive": "ball_screw", "lead_mm": 10.0, "motor_pole_pairs": 4,
        "inertia_kg_m2": 0.0028, "coulomb_friction_nm": 0.9, "viscous_friction_nm_s": 0.008, "constant_torque_nm": 0.0,
        "torque_limit_nm": 16.0,
        "servo": { "period_s": 0.001, "position_gain_1_s": 40.0, "velocity_gain_nm_s": 0.528, "velocity_integral_time_s": 0.02,
                   "velocity_feedforward": 1.0, "torque_time_constant_s": 0.0005 } } ] }"#;
    let axis = &Machine::parse(text).unwrap().axes[0];
    assert_eq!(axis.drive, Drive::BallScrew { lead_mm: 10.0 });
    assert_eq!((axis.base.inertia, axis.base.coulomb, axis.base.torque_limit), (0.0028, 0.9, 16.0));
    let servo = axis.servo.unwrap();
    assert_eq!((servo.velocity_gain, servo.velocity_integral_time_s), (0.528, Some(0.02)));
    assert_eq!(servo.velocity_estimate, VelocityEstimate::BackwardDifference);
}

#[test]
fn keys_left_out_mean_no_integral_no_lag_no_feedforward() {
    let mut file = rig("ball_screw");
    file["axes"][0]["servo"] = json!({ "period_s": 0.001, "position_gain_1_s": 40.0, "velocity_gain_nm_s": 0.5 });
    file["axes"][0].as_object_mut().unwrap().remove("torque_limit_nm");
    let axis = Machine::parse(&file.to_string()).unwrap().axes[0].clone();
    let servo = axis.servo.unwrap();
    assert_eq!(
        (servo.velocity_integral_time_s, servo.torque_time_constant_s, servo.velocity_feedforward),
        (None, 0.0, 0.0)
    );
    assert_eq!(axis.base.torque_limit, f64::INFINITY);
}

#[test]
fn what_is_wrong_is_named_with_its_path() {
    type Case<'a> = (&'a dyn Fn(&mut Value), &'a [&'a str]);
    let cases: &[Case<'_>] = &[
        (&|f| f["schema"] = json!("gib.machine/9"), &["schema", "gib.machine/9", "gib.machine/1"]),
        (&|f| f["axes"] = json!([]), &["axes", "at least one"]),
        (&|f| f["axes"][0]["name"] = json!("X1"), &["axes[0].name", "X1", "a to z"]),
        (&|f| f["axes"][0]["drive"] = json!("belt"), &["axes[0].drive", "belt", "ball_screw"]),
        (&|f| f["axes"][0]["lead_mm"] = json!(-5.0), &["axes[0].lead_mm", "-5", "above 0"]),
        (&|f| f["axes"][0]["lead_mm"] = json!(1e12), &["axes[0].lead_mm: 1e12 is", "above 0, at most 1e9"]),
        (&|f| f["axes"][0]["lead_mm"] = json!(1e-320), &["axes[0].lead_mm: 1e-320 is", "above 0"]),
        (&|f| f["axes"][0]["lead_mm"] = json!("ten"), &["axes[0].lead_mm", "a number", "a text"]),
        (&|f| f["axes"][0]["inertia_kg_m2"] = Value::Null, &["axes[0].inertia_kg_m2", "missing", "above 0"]),
        (&|f| f["axes"][0]["coulomb_friction_nm"] = json!(-0.1), &["axes[0].coulomb_friction_nm", "0 or more"]),
        (&|f| f["axes"][0]["servo"]["period_s"] = json!(0.0), &["axes[0].servo.period_s", "from 0.000001 to 1"]),
        (&|f| f["axes"][0]["servo"]["velocity_estimate"] = json!("kalman"), &["velocity_estimate", "two_sample_mean"]),
        (
            &|f| f["axes"][0]["effects"] = json!([{"cause": "gremlins", "parameters": {}}]),
            &["axes[0].effects[0].cause", "gremlins", "stribeck_friction", "screw_periodic_error"],
        ),
        (
            &|f| f["axes"][0]["effects"] = json!([{"cause": "cogging", "parameters": {"amplitude_nm": 0.1}}]),
            &["axes[0].effects[0].parameters.period_mm", "missing", "above 0"],
        ),
        (
            &|f| f["axes"][0]["effects"] = json!([{"cause": "backlash", "parameters": {"backlash_um": 1}}, {"cause": "backlash", "parameters": {"backlash_um": 2}}]),
            &["axes[0].effects[1]", "backlash", "twice"],
        ),
        (
            &|f| f["axes"][0]["effects"] = json!([{"cause": "stribeck_friction", "parameters": {"stribeck_torque_nm": -5, "stribeck_velocity_mm_s": 5}}]),
            &["axes[0].effects[0].parameters.stribeck_torque_nm", "-5 takes", "0.9", "-0.9 or more"],
        ),
        (
            &|f| {
                f["axes"][0]["effects"] =
                    json!([{"cause": "drive_compliance", "parameters": {"resonance_hz": 1, "stiffness_n_um": 100}}])
            },
            &["axes[0].effects", "too low", "Hz or more"],
        ),
    ];
    for (change, words) in cases {
        let error = refused(change);
        assert!(words.iter().all(|word| error.contains(word)), "{words:?} in: {error}");
    }
    assert!(Machine::parse("{ \"schema\": ").unwrap_err().to_string().contains("line 1"));
    let twice = rig("ball_screw").to_string().replacen("\"lead_mm\"", "\"lead_mm\":5,\"lead_mm\"", 1);
    let why = Machine::parse(&twice).unwrap_err().to_string();
    assert!(why.starts_with("axes[0].lead_mm is there twice"), "{why}");
}

#[test]
fn keys_without_a_meaning_are_told_not_refused() {
    let mut file = rig("ball_screw");
    file["axes"][0]["coulomb_frictoin_nm"] = json!(1.0);
    file["axes"][0]["servo"]["comment"] = json!("tuned on a Monday");
    let machine = Machine::parse(&file.to_string()).unwrap();
    assert_eq!(machine.ignored_keys, ["axes[0].servo.comment", "axes[0].coulomb_frictoin_nm"]);
}

#[test]
fn the_schema_check_can_fail() {
    let schema = machine_schema();
    for (path, value) in
        [("drive", json!("belt")), ("name", json!("xy")), ("lead_mm", json!(0.0)), ("motor_pole_pairs", json!(1.5))]
    {
        let mut file = rig("ball_screw");
        file["axes"][0][path] = value;
        assert_eq!(schema::violations(&schema, &file).len(), 1, "{path}");
    }
}

proptest! {
    /// Any effect with any values within its bounds is read back as written, on any drive.
    #[test]
    fn effects_survive_the_way_through_the_file(row in 0..CAUSES.len(), share in prop::array::uniform4(0.01..1.0_f64), drive in 0..3_usize) {
        let row = &CAUSES[row];
        // Within any parameter's bounds; a resonance far above what the stiffness needs.
        let values: Vec<f64> = row.parameters.iter().zip(share).map(|(p, s)| match p.key {
            "resonance_hz" => 5e8 * s,
            _ => p.low.max(-50.0) + s * (p.high.min(50.0) - p.low.max(-50.0)),
        }).collect();
        let effect = Effect::from_values(row.cause, &values).unwrap();
        let mut machine = Machine::parse(&rig(["ball_screw", "linear", "rotary"][drive]).to_string()).unwrap();
        // More than any dip takes away.
        machine.axes[0].base.coulomb = 50.0;
        machine.axes[0].effects.push(effect);
        let written = machine.to_json();
        prop_assert_eq!(schema::violations(&machine_schema(), &written), Vec::<String>::new());
        prop_assert_eq!(Machine::parse(&written.to_string()).unwrap(), machine);
    }
}
