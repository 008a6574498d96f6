//! What `gib lost-motion` says of torque.

use std::fmt::Write;

use gib::analysis::lost_motion::Value;
use gib::analysis::lost_motion::from_torque::{Estimate, MotorFriction, TorqueLostMotion};
use gib::report::lost_motion::Display;
use serde_json::{Map, Value as Json, json};

use super::compare;
use crate::cli::table::Table;

/// One screen for people.
pub fn text(file: &str, found: &TorqueLostMotion, measured: Option<f64>) -> String {
    let display = Display::new(found.unit, found.mean.lost_motion.uncertainty);
    let shown = |value: &Value| format!("{} ± {}", display.number(value.value), display.number(value.uncertainty));
    let effort = if found.effort_unit == "nm" { "N·m" } else { "N" };
    let mean = &found.mean;
    let used = found.reversals.iter().filter(|r| r.result.is_ok()).count();
    let mut text = String::new();
    let _ = writeln!(
        text,
        "{file}, axis {}: lost motion estimated from torque {} {unit} (k = 2)\n  from {used} of {} reversals; \
         clearance {} {unit}, elastic wind-up {} {unit}",
        found.channel.to_uppercase(),
        shown(&mean.lost_motion),
        found.reversals.len(),
        display.number(mean.clearance),
        display.number(mean.windup),
        unit = display.unit,
    );
    if found.presliding > 0.0 {
        let _ = writeln!(
            text,
            "  the table itself gives way by about {} {} before it slides: taken off, and as much held in the uncertainty",
            display.number(found.presliding),
            display.unit
        );
    }
    if !found.trustworthy {
        text += "  The uncertainty is more than a third of the value: do not compensate with it.\n";
    }
    if let Some(spread) = found.spread {
        let _ = writeln!(text, "  spread from reversal to reversal {} {}", display.number(spread), display.unit);
    }
    let _ = writeln!(
        text,
        "  sliding friction {:.3} {effort}, of it on the motor's side {:.3} {effort} ({}); stiffness {:.4} {effort}/{}",
        mean.sliding,
        mean.motor_friction,
        evidence(found.motor_friction),
        mean.stiffness / display.factor,
        display.unit
    );
    if let Some(measured) = measured {
        let _ = writeln!(text, "  {}", compare(&mean.lost_motion, &display, measured));
    }

    let mut table = Table::new(["row", "time s", "at", "turns to", "lost motion", "clearance", "wind-up", "remark"], 0);
    for reversal in &found.reversals {
        let cell = |of: &dyn Fn(&Estimate) -> String| reversal.result.as_ref().map_or_else(|_| "-".to_owned(), of);
        table.row([
            reversal.row.to_string(),
            format!("{:.3}", reversal.time_s),
            format!("{:.3}", reversal.position),
            if reversal.direction > 0 { "+".into() } else { "−".into() },
            cell(&|e| shown(&e.lost_motion)),
            cell(&|e| display.number(e.clearance)),
            cell(&|e| display.number(e.windup)),
            reversal.result.as_ref().err().cloned().unwrap_or_default(),
        ]);
    }
    let _ = writeln!(text, "\nReversals (positions in {}, lost motion in {})", found.unit, display.unit);
    text + &table.text()
}

fn evidence(source: MotorFriction) -> &'static str {
    match source {
        MotorFriction::Probe => "seen where the motor goes back and forth while the table sticks",
        MotorFriction::Clearance => "seen as the level across the clearance",
        MotorFriction::Assumed => "not seen: 20 ± 20 % of it assumed",
    }
}

/// Keys end in their unit: `lost_motion_um` or `lost_motion_deg`, `sliding_friction_nm` or `_n`.
pub fn as_json(found: &TorqueLostMotion, measured: Option<f64>) -> Json {
    let (factor, unit) = if found.unit == "mm" { (1e3, "um") } else { (1.0, "deg") };
    let (at, effort) = (found.unit, found.effort_unit);
    let put = |object: &mut Map<String, Json>, estimate: &Estimate| {
        object.insert(format!("lost_motion_{unit}"), json!(factor * estimate.lost_motion.value));
        object.insert(format!("uncertainty_{unit}"), json!(factor * estimate.lost_motion.uncertainty));
        object.insert(format!("clearance_{unit}"), json!(factor * estimate.clearance));
        object.insert(format!("windup_{unit}"), json!(factor * estimate.windup));
        object.insert(format!("stiffness_{effort}_{at}"), json!(estimate.stiffness));
        object.insert(format!("sliding_friction_{effort}"), json!(estimate.sliding));
        object.insert(format!("motor_friction_{effort}"), json!(estimate.motor_friction));
    };
    let mut root = Map::new();
    root.insert("schema".into(), json!("gib.lost_motion/1"));
    root.insert("axis".into(), json!(found.channel));
    root.insert("method".into(), json!("torque"));
    root.insert("quantity".into(), json!("lost motion estimated from torque"));
    root.insert("coverage_factor".into(), json!(2));
    put(&mut root, &found.mean);
    root.insert("trustworthy".into(), json!(found.trustworthy));
    root.insert(format!("presliding_{unit}"), json!(factor * found.presliding));
    root.insert(format!("spread_{unit}"), json!(found.spread.map(|spread| factor * spread)));
    let source = match found.motor_friction {
        MotorFriction::Probe => "probe",
        MotorFriction::Clearance => "clearance",
        MotorFriction::Assumed => "assumed",
    };
    root.insert("motor_friction_from".into(), json!(source));
    if let Some(measured) = measured {
        root.insert(format!("measured_{unit}"), json!(measured));
        root.insert(format!("difference_{unit}"), json!(factor * found.mean.lost_motion.value - measured));
    }
    let reversals = found.reversals.iter().map(|reversal| {
        let mut object = Map::new();
        object.insert("row".into(), json!(reversal.row));
        object.insert("time_s".into(), json!(reversal.time_s));
        object.insert(format!("position_{at}"), json!(reversal.position));
        object.insert("direction".into(), json!(reversal.direction));
        match &reversal.result {
            Ok(estimate) => put(&mut object, estimate),
            Err(why) => {
                object.insert("unused".into(), json!(why));
            }
        }
        Json::Object(object)
    });
    root.insert("reversals".into(), reversals.collect());
    Json::Object(root)
}
