//! `gib lost-motion`: what a reversal loses, from a recording.

use std::fmt::Write;
use std::path::PathBuf;

use clap::Args;
use gib::analysis::lost_motion::Value;
use gib::analysis::lost_motion::from_positions::{LostMotion, Stretch, measure};
use gib::recording::{Recording, Signal};
use gib::report::lost_motion::{Display, picture};
use serde_json::{Map, Value as Json, json};

use super::table::Table;
use super::{Answer, Result};

/// Measures the lost motion of an axis: what a reversal of the motor does not bring to the table
///
/// Compares motor and table position at the same place on the way there and back, wherever both move steadily. Record slow
/// motion (about 1 mm/s) there and back over at least ten times the lost motion, several times. Lost motion is given with its
/// expanded uncertainty (k = 2, about 95 %): in µm for lengths, in degrees for angles.
///
/// Ends with 1 when the lost motion is not larger than its uncertainty.
#[derive(Args)]
pub struct LostMotionCommand {
    /// The recording: CSV with <axis>.position and <axis>.table_position
    recording: PathBuf,
    /// Axis letter, where the recording holds several
    #[arg(long, value_name = "LETTER")]
    axis: Option<String>,
    /// Answer as JSON
    #[arg(long)]
    json: bool,
    /// Write a picture of motor − table along the stroke
    #[arg(long, value_name = "OUT.svg")]
    plot: Option<PathBuf>,
    /// Compare with this lost motion, measured otherwise (linear axis), in µm
    #[arg(long, value_name = "V", conflicts_with = "measured_deg")]
    measured_um: Option<f64>,
    /// Compare with this lost motion, measured otherwise (rotary axis), in degrees
    #[arg(long, value_name = "V")]
    measured_deg: Option<f64>,
}

impl LostMotionCommand {
    /// Measures and tells.
    pub fn run(&self) -> Result {
        let recording = Recording::open(&self.recording)?;
        let axis = self.axis(&recording)?;
        let found = measure(&recording, &axis).map_err(|why| format!("{}: axis {axis}: {why}", recording.file))?;
        let measured = self.measured(&found)?;
        if let Some(path) = &self.plot {
            std::fs::write(path, picture(&found)?)
                .map_err(|why| format!("{}: cannot be written: {why}", path.display()))?;
        }
        let text = if self.json {
            serde_json::to_string_pretty(&as_json(&found, measured))? + "\n"
        } else {
            text(&recording.file, &found, measured)
        };
        Ok(Answer { text, good: found.significant })
    }

    fn axis(&self, recording: &Recording) -> std::result::Result<String, String> {
        let axes: Vec<&str> =
            recording.channels().into_iter().filter(|c| recording.get(c, Signal::Position).is_some()).collect();
        match (&self.axis, axes.as_slice()) {
            (Some(axis), _) => Ok(axis.clone()),
            (None, [one]) => Ok((*one).to_owned()),
            (None, []) => Err(format!("{}: has no column <axis>.position_<unit>", recording.file)),
            (None, several) => {
                Err(format!("{}: has the axes {}; choose one with --axis", recording.file, several.join(", ")))
            }
        }
    }

    /// The value to compare with, in µm or degrees as the axis asks for.
    fn measured(&self, found: &LostMotion) -> std::result::Result<Option<f64>, String> {
        let (given, other, flag) = if found.unit == "mm" {
            (self.measured_um, self.measured_deg, "--measured-um")
        } else {
            (self.measured_deg, self.measured_um, "--measured-deg")
        };
        match (given, other) {
            (_, Some(_)) => Err(format!("axis {} moves in {}; compare with {flag}", found.channel, found.unit)),
            (Some(value), _) if !value.is_finite() => Err(format!("{flag} is {value}; expected a number")),
            (given, None) => Ok(given),
        }
    }
}

fn text(file: &str, found: &LostMotion, measured: Option<f64>) -> String {
    let display = Display::of(found);
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
        let _ = writeln!(text, "  {}", comparison(found, &display, measured));
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

fn comparison(found: &LostMotion, display: &Display, measured: f64) -> String {
    let difference = display.factor * found.lost_motion.value - measured;
    let within = difference.abs() <= display.factor * found.lost_motion.uncertainty;
    format!(
        "measured otherwise {measured} {0}: this is {1:+.2$} {0} from it, {3} its uncertainty",
        display.unit,
        difference,
        display.decimals,
        if within { "within" } else { "beyond" }
    )
}

/// Keys end in their unit: `lost_motion_um` and `position_mm`, or `lost_motion_deg` and `position_deg`.
fn as_json(found: &LostMotion, measured: Option<f64>) -> Json {
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
