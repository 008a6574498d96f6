//! Writes a machine file: the base keys, the servo and the effects, as [`Machine::parse`] reads them.

use super::{Axis, Drive, Effect, Machine, Servo, VelocityEstimate};
use serde_json::{Map, Value, json};
use std::path::Path;

impl Machine {
    /// The machine as the file's JSON. Keys that were ignored when it was read are not written.
    #[must_use]
    pub fn to_json(&self) -> Value {
        let axes: Vec<Value> = self.axes.iter().map(axis_json).collect();
        json!({ "schema": "gib.machine/1", "name": self.name, "axes": axes })
    }

    /// Writes the machine file, whole or not at all.
    ///
    /// # Errors
    /// The system's, with the file's name.
    pub fn save(&self, file: &Path) -> std::io::Result<()> {
        let text = format!("{:#}\n", self.to_json());
        super::whole::replace(file, &text)
            .map_err(|e| std::io::Error::new(e.kind(), format!("{}: {e}", file.display())))
    }
}

fn axis_json(axis: &Axis) -> Value {
    let mut map = Map::new();
    map.insert("name".into(), json!(axis.name));
    map.insert("drive".into(), json!(axis.drive.name()));
    match axis.drive {
        Drive::BallScrew { lead_mm } => _ = map.insert("lead_mm".into(), json!(lead_mm)),
        Drive::Rotary { ratio } => _ = map.insert("ratio".into(), json!(ratio)),
        Drive::Linear => {}
    }
    if let Some(pairs) = axis.motor_pole_pairs {
        map.insert("motor_pole_pairs".into(), json!(pairs));
    }
    let linear = axis.drive.is_linear();
    let key = |rotating: &'static str, linear_key: &'static str| if linear { linear_key } else { rotating };
    let base = axis.base;
    for (key, value) in [
        (key("inertia_kg_m2", "mass_kg"), base.inertia),
        (key("coulomb_friction_nm", "coulomb_friction_n"), base.coulomb),
        (key("viscous_friction_nm_s", "viscous_friction_n_s_m"), base.viscous),
        (key("constant_torque_nm", "constant_force_n"), base.constant),
        (key("torque_limit_nm", "force_limit_n"), base.torque_limit),
    ] {
        // No limit is said by leaving the key out.
        if value.is_finite() {
            map.insert(key.into(), json!(value));
        }
    }
    if let Some(servo) = &axis.servo {
        map.insert("servo".into(), servo_json(servo, linear));
    }
    if !axis.effects.is_empty() {
        map.insert("effects".into(), axis.effects.iter().map(|effect| effect_json(effect, linear)).collect());
    }
    Value::Object(map)
}

fn servo_json(servo: &Servo, linear: bool) -> Value {
    let mut map = Map::new();
    map.insert("period_s".into(), json!(servo.period_s));
    map.insert("position_gain_1_s".into(), json!(servo.position_gain_1_s));
    let velocity_gain = if linear { "velocity_gain_n_s_m" } else { "velocity_gain_nm_s" };
    map.insert(velocity_gain.into(), json!(servo.velocity_gain));
    if let Some(time) = servo.velocity_integral_time_s {
        map.insert("velocity_integral_time_s".into(), json!(time));
    }
    map.insert("velocity_feedforward".into(), json!(servo.velocity_feedforward));
    map.insert("torque_time_constant_s".into(), json!(servo.torque_time_constant_s));
    if servo.velocity_estimate == VelocityEstimate::TwoSampleMean {
        map.insert("velocity_estimate".into(), json!("two_sample_mean"));
    }
    Value::Object(map)
}

fn effect_json(effect: &Effect, linear: bool) -> Value {
    let parameters: Map<String, Value> = effect.keyed_values(linear).map(|(k, v)| (k.to_owned(), json!(v))).collect();
    json!({ "cause": effect.cause().name(), "parameters": parameters })
}
