//! `gib lost-motion`: what a reversal loses, from a recording.

mod positions;
mod torque;

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use gib::analysis::lost_motion::{Value, from_positions, from_torque};
use gib::machine::Axis;
use gib::recording::{Recording, Signal};
use gib::report::lost_motion::{Display, picture, torque_picture};

use super::outputs::Outputs;
use super::{Answer, Result, machine_file};

/// Measures the lost motion of an axis: what a reversal of the motor does not bring to the table
///
/// With a scale on the table: compares motor and table position at the same place on the way there and back, wherever both move
/// steadily. Record slow motion (about 1 mm/s) there and back over at least ten times the lost motion, several times.
///
/// With torque (or force) alone: fits the torque curve of each slow reversal, as the control does: release, clearance, wind-up.
/// That value is lost motion estimated from torque, never the reversal value of ISO 230-2; compare it with a measured one
/// (--measured-um) where you can.
///
/// Lost motion is given with its expanded uncertainty (k = 2, about 95 %): in µm for lengths, in degrees for angles. Ends with 1
/// when it is not larger than its uncertainty, or for torque not at least three times as large.
#[derive(Args)]
pub struct LostMotionCommand {
    /// The recording: CSV with <axis>.position and either <axis>.table_position or <axis>.torque
    recording: PathBuf,
    /// Axis letter, where the recording holds several
    #[arg(long, value_name = "LETTER")]
    axis: Option<String>,
    /// What to measure from; two positions where the recording has them
    #[arg(long)]
    method: Option<Method>,
    /// Machine file: its inertia and viscous friction are taken off the torque
    #[arg(long, value_name = "M")]
    machine: Option<PathBuf>,
    /// Answer as JSON
    #[arg(long)]
    json: bool,
    /// Write a picture: motor − table along the stroke, or torque against travel
    #[arg(long, value_name = "OUT.svg")]
    plot: Option<PathBuf>,
    /// Compare with this lost motion, measured otherwise (linear axis), in µm
    #[arg(long, value_name = "V", conflicts_with = "measured_deg")]
    measured_um: Option<f64>,
    /// Compare with this lost motion, measured otherwise (rotary axis), in degrees
    #[arg(long, value_name = "V")]
    measured_deg: Option<f64>,
}

/// What to measure lost motion from.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Method {
    /// Motor and table position
    Positions,
    /// Motor position and torque
    Torque,
}

impl LostMotionCommand {
    /// Measures and tells.
    pub fn run(&self) -> Result {
        let inputs = [("<RECORDING>", Some(&*self.recording)), ("--machine", self.machine.as_deref())];
        let mut outputs = Outputs::beside(&inputs);
        outputs.add("--plot", self.plot.as_deref())?;
        let recording = Recording::open(&self.recording)?;
        let axis = super::axis(&recording, self.axis.as_deref())?;
        let model = self.model(&axis)?;
        let refused = |why| format!("{}: axis {axis}: {why}", recording.file);
        let both = recording.get(&axis, Signal::TablePosition).is_some();
        let method = self.method.unwrap_or(if both { Method::Positions } else { Method::Torque });
        let (text, json, svg, good) = match method {
            Method::Positions => {
                let found = from_positions::measure(&recording, &axis).map_err(refused)?;
                let measured = self.measured(&axis, found.unit)?;
                let json = positions::as_json(&found, measured);
                (positions::text(&recording.file, &found, measured), json, picture(&found), found.significant)
            }
            Method::Torque => {
                let found = from_torque::estimate(&recording, &axis, model.as_ref()).map_err(refused)?;
                let measured = self.measured(&axis, found.unit)?;
                let json = torque::as_json(&found, measured);
                (torque::text(&recording.file, &found, measured), json, torque_picture(&found), found.trustworthy)
            }
        };
        if self.plot.is_some() {
            outputs.picture("--plot", &svg?)?;
        }
        let text = if self.json { serde_json::to_string_pretty(&json)? + "\n" } else { text };
        Ok(Answer { text, good })
    }

    fn model(&self, axis: &str) -> std::result::Result<Option<Axis>, String> {
        let Some(path) = &self.machine else { return Ok(None) };
        let machine = machine_file::load(path).map_err(|why| why.to_string())?;
        let found = machine.axis(axis).cloned();
        found.map(Some).ok_or_else(|| format!("{}: has no axis {axis}", path.display()))
    }

    /// The value to compare with, in µm or degrees as the axis asks for.
    fn measured(&self, axis: &str, unit: &str) -> std::result::Result<Option<f64>, String> {
        let (given, other, flag) = if unit == "mm" {
            (self.measured_um, self.measured_deg, "--measured-um")
        } else {
            (self.measured_deg, self.measured_um, "--measured-deg")
        };
        match (given, other) {
            (_, Some(_)) => Err(format!("axis {axis} moves in {unit}; compare with {flag}")),
            (Some(value), _) if !value.is_finite() => Err(format!("{flag} is {value}; expected a number")),
            (given, None) => Ok(given),
        }
    }
}

/// How a value stands beside one measured otherwise.
fn compare(found: &Value, display: &Display, measured: f64) -> String {
    let difference = display.factor * found.value - measured;
    let within = difference.abs() <= display.factor * found.uncertainty;
    format!(
        "measured otherwise {measured} {0}: this is {1:+.2$} {0} from it, {3} its uncertainty",
        display.unit,
        difference,
        display.decimals,
        if within { "within" } else { "beyond" }
    )
}
