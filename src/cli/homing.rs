//! `gib homing`: where a dead stop was met, from a recording.

use std::path::PathBuf;

use clap::Args;
use gib::analysis::homing::{Found, Options, contacts};
use gib::recording::Recording;
use gib::report::homing::picture;
use serde_json::json;

use super::outputs::Outputs;
use super::table::Table;
use super::{Answer, Result};

/// Finds the contact point of a homing on a dead stop in a recording of it
///
/// Before contact the torque is a level, from contact on a line: the contact point is where the line starts, whatever torque
/// limit, speed and stiffness are. Record motor position and torque at servo rate while the axis is pressed on the stop, once or
/// several times, at 1 mm/s or less. Beside it stands the plain threshold, where the torque reaches the limit.
///
/// Lengths are given in mm and µm with their expanded uncertainty (k = 2, about 95 %), angles in degrees and thousandths.
/// Ends with 1 when not all touches show a contact point.
#[derive(Args)]
pub struct HomingCommand {
    /// The recording: CSV with <axis>.position and <axis>.torque (or force)
    recording: PathBuf,
    /// Axis letter, where the recording holds several
    #[arg(long, value_name = "LETTER")]
    axis: Option<String>,
    /// Toward the stop; the sense of the largest torque unless given
    #[arg(long, value_name = "+1|-1", allow_hyphen_values = true, value_parser = direction)]
    direction: Option<i8>,
    /// Torque limit, N·m or N; what the axis presses with unless given
    #[arg(long, value_name = "NM")]
    limit: Option<f64>,
    /// Answer as JSON
    #[arg(long)]
    json: bool,
    /// Write a picture: torque against position at the stop
    #[arg(long, value_name = "OUT.svg")]
    plot: Option<PathBuf>,
}

fn direction(text: &str) -> std::result::Result<i8, String> {
    match text {
        "+1" | "1" | "+" => Ok(1),
        "-1" | "-" => Ok(-1),
        _ => Err("+1 or -1".into()),
    }
}

impl HomingCommand {
    /// Measures and tells.
    pub fn run(&self) -> Result {
        if let Some(limit) = self.limit.filter(|limit| !(*limit > 0.0 && limit.is_finite())) {
            return Err(format!("--limit is {limit}; expected a number above 0").into());
        }
        let mut outputs = Outputs::beside(&[("<RECORDING>", Some(&*self.recording))]);
        outputs.add("--plot", self.plot.as_deref())?;
        let recording = Recording::open(&self.recording)?;
        let channel = super::axis(&recording, self.axis.as_deref())?;
        let options = Options { channel, direction: self.direction, limit: self.limit };
        let found = contacts(&recording, &options)
            .map_err(|why| format!("{}: axis {}: {why}", recording.file, options.channel))?;
        if self.plot.is_some() {
            outputs.picture("--plot", &picture(&found)?)?;
        }
        let text = if self.json { as_json(&found)? } else { text(&recording.file, &found) };
        Ok(Answer { text, good: found.touches.iter().all(|touch| touch.contact.is_ok()) })
    }
}

fn text(file: &str, found: &Found) -> String {
    let (unit, fine) = if found.unit == "mm" { ("mm", "µm") } else { ("°", "°/1000") };
    let effort = if found.effort_unit == "nm" { "N·m" } else { "N" };
    let mean = &found.mean;
    let mut table = Table::new(["row", "time s", &format!("speed {unit}/s"), &format!("contact {unit}"), "remark"], 0);
    for touch in &found.touches {
        table.row([
            touch.row.to_string(),
            format!("{:.3}", touch.time_s),
            format!("{:.3}", touch.speed),
            touch.contact.map_or_else(|_| "-".to_owned(), |contact| format!("{contact:.4}")),
            touch.contact.err().unwrap_or_default().to_owned(),
        ]);
    }
    format!(
        "{file}, axis {}: contact at {:.4} {unit} ± {:.2} {fine} (k = 2), spread {:.2} {fine}\n  the plain threshold is \
         {:.1} {fine} further; torque limit {:.3} {effort}, sliding {:.3} {effort}, stiffness {:.1} {effort}/{unit}\n\n\
         Touches\n{}",
        found.channel.to_uppercase(),
        mean.contact_mm,
        mean.uncertainty_um,
        mean.spread_um,
        1e3 * found.direction * (mean.threshold_mm - mean.contact_mm),
        found.limit,
        mean.sliding_nm,
        mean.stiffness_nm_mm,
        table.text()
    )
}

/// Keys end in their unit.
fn as_json(found: &Found) -> std::result::Result<String, serde_json::Error> {
    let (at, effort) = (found.unit, found.effort_unit);
    let (fine, per) = if at == "mm" { ("um", 1.0) } else { ("deg", 1e-3) };
    let mean = &found.mean;
    let touches: Vec<_> = found
        .touches
        .iter()
        .map(|touch| {
            json!({
                "row": touch.row,
                "time_s": touch.time_s,
                format!("speed_{at}_s"): touch.speed,
                format!("contact_{at}"): touch.contact.ok(),
                "unused": touch.contact.err(),
            })
        })
        .collect();
    let root = json!({
        "schema": "gib.homing/1",
        "axis": found.channel,
        "direction": found.direction,
        "coverage_factor": 2,
        format!("contact_{at}"): mean.contact_mm,
        format!("uncertainty_{fine}"): per * mean.uncertainty_um,
        format!("spread_{fine}"): per * mean.spread_um,
        format!("threshold_{at}"): mean.threshold_mm,
        format!("press_{fine}"): per * mean.press_um,
        format!("stiffness_{effort}_{at}"): mean.stiffness_nm_mm,
        format!("sliding_{effort}"): mean.sliding_nm,
        format!("noise_{effort}"): mean.noise_nm,
        format!("torque_limit_{effort}"): found.limit,
        "touches": touches,
    });
    Ok(serde_json::to_string_pretty(&root)? + "\n")
}
