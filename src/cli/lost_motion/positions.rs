//! What `gib lost-motion` says of two positions.

use std::fmt::Write;

use gib::analysis::lost_motion::Value;
use gib::analysis::lost_motion::from_positions::{LostMotion, Stretch};
use gib::report::lost_motion::Display;
use serde_json::{Map, Value as Json, json};

use super::compare;
use crate::cli::table::Table;

/// One screen for people.
pub fn text(file: &str, found: &LostMotion, measured: Option<f64>) -> String {
    let display = Display::new(found.unit, found.lost_motion.uncertainty);
    let shown = |value: &Value| format!("{} ± {}", display.number(value.value), display.number(value.uncertainty));
    let place = |position: f64| format!("{position:.3}");
    let mut text = String::new();
    let used = found.reversals.iter().filter(|r| r.lost_motion.is_some()).count();
    let _ = writeln!(
        text,
        "{file}, axis {}: lost motion {} {} (k = 2)\n  from motor and table position at {used} of {} reversals",
        found.channel.to_uppercase(),
        shown(&found.lost_motion),
        display.unit,
        found.reversals.len()
    );
    if !found.significant {
        text += "  This is not larger than its uncertainty: no lost motion is shown.\n";
    }
    if let Some(spread) = found.spread {
        let _ = writeln!(text, "  spread from reversal to reversal {} {}", display.number(spread), display.unit);
    }
    let _ = writeln!(
        text,
        "  table read {:.2} ± {:.2} ms after the motor; corrected, and makes {} {} of the uncertainty",
        1e3 * found.table_delay_s.value,
        1e3 * found.table_delay_s.uncertainty,
        display.number(found.uncertainty_from_delay),
        display.unit
    );
    if let Some(measured) = measured {
        let _ = writeln!(text, "  {}", compare(&found.lost_motion, &display, measured));
    }

    let mut table = Table::new(["row", "time s", "at", "turns to", "speed", "lost motion", "remark"], 0);
    for reversal in &found.reversals {
        table.row([
            reversal.row.to_string(),
            format!("{:.3}", reversal.time_s),
            place(reversal.position),
            if reversal.direction > 0 { "+".into() } else { "−".into() },
            format!("{:.3}", reversal.speed),
            reversal.lost_motion.as_ref().map_or("-".into(), shown),
            reversal.unused.unwrap_or_default().to_owned(),
        ]);
    }
    let _ =
        writeln!(text, "\nReversals (positions in {0}, speeds in {0}/s, lost motion in {1})", found.unit, display.unit);
    text += &table.text();

    let mut table = Table::new(["from", "to", "lost motion", "reversals"], 0);
    for stretch in &found.stretches {
        table.row([place(stretch.from), place(stretch.to), shown(&stretch.lost_motion), stretch.reversals.to_string()]);
    }
    let _ = writeln!(text, "\nAlong the stroke (positions in {}, lost motion in {})", found.unit, display.unit);
    text + &table.text()
}

/// Keys end in their unit: `lost_motion_um` and `position_mm`, or `lost_motion_deg` and `position_deg`.
pub fn as_json(found: &LostMotion, measured: Option<f64>) -> Json {
    let (factor, unit) = if found.unit == "mm" { (1e3, "um") } else { (1.0, "deg") };
    let at = found.unit;
    let put = |object: &mut Map<String, Json>, value: &Value| {
        object.insert(format!("lost_motion_{unit}"), json!(factor * value.value));
        object.insert(format!("uncertainty_{unit}"), json!(factor * value.uncertainty));
    };
    let stretch = |stretch: &Stretch| {
        let mut object = Map::new();
        object.insert(format!("from_{at}"), json!(stretch.from));
        object.insert(format!("to_{at}"), json!(stretch.to));
        put(&mut object, &stretch.lost_motion);
        object.insert("reversals".into(), json!(stretch.reversals));
        Json::Object(object)
    };
    let mut root = Map::new();
    root.insert("schema".into(), json!("gib.lost_motion/1"));
    root.insert("axis".into(), json!(found.channel));
    root.insert("method".into(), json!("two_positions"));
    root.insert("coverage_factor".into(), json!(2));
    put(&mut root, &found.lost_motion);
    root.insert("significant".into(), json!(found.significant));
    root.insert(format!("spread_{unit}"), json!(found.spread.map(|spread| factor * spread)));
    root.insert("table_delay_s".into(), json!(found.table_delay_s.value));
    root.insert("table_delay_uncertainty_s".into(), json!(found.table_delay_s.uncertainty));
    root.insert(format!("uncertainty_from_delay_{unit}"), json!(factor * found.uncertainty_from_delay));
    if let Some(measured) = measured {
        root.insert(format!("measured_{unit}"), json!(measured));
        root.insert(format!("difference_{unit}"), json!(factor * found.lost_motion.value - measured));
    }
    let reversals = found.reversals.iter().map(|reversal| {
        let mut object = Map::new();
        object.insert("row".into(), json!(reversal.row));
        object.insert("time_s".into(), json!(reversal.time_s));
        object.insert(format!("position_{at}"), json!(reversal.position));
        object.insert("direction".into(), json!(reversal.direction));
        object.insert(format!("speed_{at}_s"), json!(reversal.speed));
        match &reversal.lost_motion {
            Some(value) => put(&mut object, value),
            None => {
                object.insert("unused".into(), json!(reversal.unused));
            }
        }
        object.insert("places".into(), json!(reversal.places));
        Json::Object(object)
    });
    root.insert("reversals".into(), reversals.collect());
    root.insert("largest".into(), found.largest.as_ref().map_or(Json::Null, stretch));
    root.insert("along_the_stroke".into(), found.stretches.iter().map(stretch).collect());
    Json::Object(root)
}
