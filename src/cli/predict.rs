//! `gib predict`: what a machine file says a recording should look like, row by row.

use std::fmt::Write as _;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use clap::Args;
use gib::machine::Axis;
use gib::plant::added::Added;
use gib::plant::closed_loop::predict;
use gib::plant::linear;
use gib::plant::observed::Observed;
use gib::plant::servo::CommandSpeed;
use gib::recording::{Recording, Signal};
use serde_json::{Map, Value, json};

use super::{Answer, Result, machine_file};

/// Predicts the torque and, with a servo block, the closed-loop position of a recording
///
/// Writes time_s, then for each axis that machine and recording share: measured, predicted and residual torque (force for
/// linear drives), measured and simulated position. Rows in which the motion is not known (gaps) stay empty.
#[derive(Args)]
pub struct Predict {
    /// The machine file, with or without effects
    #[arg(long)]
    machine: PathBuf,
    /// The recording, CSV
    #[arg(long)]
    recording: PathBuf,
    /// Where the prediction is written, CSV
    #[arg(long)]
    out: PathBuf,
    /// Answer as JSON
    #[arg(long)]
    json: bool,
}

impl Predict {
    /// Predicts and writes.
    pub fn run(&self) -> Result {
        let machine = machine_file::load(&self.machine)?;
        let mut recording = Recording::open(&self.recording)?;
        let shared: Vec<&Axis> =
            machine.axes.iter().filter(|axis| recording.get(&axis.name, Signal::Position).is_some()).collect();
        if shared.is_empty() {
            let names: Vec<&str> = machine.axes.iter().map(|axis| axis.name.as_str()).collect();
            let file = self.recording.display();
            return Err(format!("{file}: no position column of an axis of the machine ({})", names.join(", ")).into());
        }
        let axes: Vec<Predicted> =
            shared.iter().map(|axis| Predicted::of(axis, &mut recording)).collect::<std::result::Result<_, _>>()?;
        write(&self.out, &recording.time_s, &axes)?;
        if self.json {
            let figures: Map<String, Value> = axes.iter().map(|p| (p.axis.name.clone(), p.figures().json())).collect();
            return Ok(Answer::good(format!("{:#}\n", Value::Object(figures))));
        }
        let mut text = String::new();
        axes.iter().for_each(|predicted| predicted.figures().text(predicted, &mut text));
        let _ = writeln!(text, "{} rows written to {}", recording.rows(), self.out.display());
        Ok(Answer::good(text))
    }
}

/// One axis, measured and predicted.
struct Predicted<'a> {
    axis: &'a Axis,
    observed: Observed,
    torque: Vec<f64>,
    phases_unknown: usize,
    position: Option<Vec<f64>>,
    added: Option<Added>,
    command_speed: CommandSpeed,
}

impl<'a> Predicted<'a> {
    fn of(axis: &'a Axis, recording: &mut Recording) -> std::result::Result<Self, Box<dyn std::error::Error>> {
        let observed = Observed::taken(recording, axis)?;
        let prediction = predict(axis, &observed)?;
        let position = prediction.closed_loop.map(|replayed| replayed.position);
        let (torque, phases_unknown) = (prediction.torque.torque, prediction.torque.phases_unknown);
        let (added, command_speed) = (prediction.added, prediction.command_speed);
        Ok(Self { axis, observed, torque, phases_unknown, position, added, command_speed })
    }

    fn residual(&self) -> impl Iterator<Item = f64> {
        self.observed.torque.iter().zip(&self.torque).map(|(measured, predicted)| measured - predicted)
    }

    fn figures(&self) -> Figures {
        let standing = self.observed.motion.standing_speed();
        let moving = self.residual().zip(&self.observed.motion.velocity).filter(|(_, v)| v.abs() > standing);
        let measured = &self.observed.position;
        Figures {
            torque: rms(self.observed.torque.iter().copied()),
            residual: rms(self.residual()),
            moving: rms(moving.map(|(residual, _)| residual)),
            position_um: self.position.as_ref().map(|p| 1e3 * rms(p.iter().zip(measured).map(|(p, m)| m - p))),
            added: self.added.as_ref().map_or((0, 0.0), |added| (added.pulses, added.largest)),
            command_speed: self.command_speed,
            cutoff_hz: self.observed.motion.cutoff_hz,
        }
    }
}

/// RMS figures of one axis.
struct Figures {
    torque: f64,
    residual: f64,
    moving: f64,
    position_um: Option<f64>,
    /// Pulses of torque that were added to the servo's, and the largest.
    added: (usize, f64),
    command_speed: CommandSpeed,
    cutoff_hz: f64,
}

impl Figures {
    fn json(&self) -> Value {
        json!({ "torque_rms": self.torque, "residual_torque_rms": self.residual, "residual_torque_rms_moving": self.moving,
            "residual_position_rms_um": self.position_um, "added_torque_pulses": self.added.0,
            "added_torque_largest": self.added.1, "command_speed": self.command_speed.name(), "motion_cutoff_hz": self.cutoff_hz })
    }

    fn text(&self, predicted: &Predicted<'_>, text: &mut String) {
        let drive = predicted.axis.drive;
        let unit = if drive.is_linear() { "N" } else { "N·m" };
        let word = drive.torque_word();
        let (name, Figures { torque, residual, moving, cutoff_hz, .. }) = (&predicted.axis.name, self);
        let _ = writeln!(text, "axis {name}\n  {word} measured              {torque:10.4} {unit} RMS");
        let _ = writeln!(text, "  {word} not predicted         {residual:10.4} {unit} RMS, while moving {moving:.4}");
        match self.position_um {
            Some(um) if drive.is_rotary() => {
                _ = writeln!(text, "  position not predicted       {um:10.4} 0.001 deg RMS, closed loop")
            }
            Some(um) => _ = writeln!(text, "  position not predicted       {um:10.4} µm RMS, closed loop"),
            None => text.push_str("  position not predicted: needs a servo block and a position_command column\n"),
        }
        if let (pulses @ 1.., largest) = self.added {
            let _ = writeln!(
                text,
                "  {pulses} pulses of {word}, the largest {largest:.4} {unit}, are in the recording beyond what the servo's law makes of \
                 it;\n  the closed loop was given them"
            );
        }
        if self.command_speed != CommandSpeed::Central {
            let _ = writeln!(
                text,
                "  the control takes the {} difference of its command for its speed, as the recorded {word} says",
                self.command_speed.name()
            );
        }
        let _ = writeln!(text, "  speed and acceleration up to {cutoff_hz:10.1} Hz, where motion meets noise");
        let ripples = predicted
            .axis
            .effects
            .iter()
            .filter(|e| matches!(e.cause().name(), "cogging" | "external_vibration"))
            .count();
        if ripples > 0 {
            text.push_str("  phases of periodic terms were estimated from the first quarter of the rows\n");
        }
        if predicted.phases_unknown > 0 {
            let _ = writeln!(
                text,
                "  {} of them left out: the first quarter shows less than half a period",
                predicted.phases_unknown
            );
        }
    }
}

/// RMS of the finite values.
fn rms(values: impl Iterator<Item = f64>) -> f64 {
    linear::rms(values.filter(|v| v.is_finite()))
}

fn write(file: &Path, time_s: &[f64], axes: &[Predicted<'_>]) -> io::Result<()> {
    let named = |e: io::Error| io::Error::new(e.kind(), format!("{}: {e}", file.display()));
    let mut out = BufWriter::new(File::create(file).map_err(named)?);
    write_rows(&mut out, time_s, axes).and_then(|()| out.flush()).map_err(named)
}

fn write_rows(out: &mut impl Write, time_s: &[f64], axes: &[Predicted<'_>]) -> io::Result<()> {
    write!(out, "time_s")?;
    for predicted in axes {
        let (name, drive) = (&predicted.axis.name, predicted.axis.drive);
        let (word, unit, load) = (drive.torque_word(), drive.torque_unit(), drive.load_unit());
        write!(
            out,
            ",{name}.{word}_{unit},{name}.predicted_{word}_{unit},{name}.residual_{word}_{unit},{name}.position_{load}"
        )?;
        if predicted.position.is_some() {
            write!(out, ",{name}.predicted_position_{load}")?;
        }
    }
    writeln!(out)?;
    for (row, time) in time_s.iter().enumerate() {
        write!(out, "{time}")?;
        for predicted in axes {
            let (measured, torque) = (predicted.observed.torque[row], predicted.torque[row]);
            cell(out, measured, None)?;
            cell(out, torque, Some(9))?;
            cell(out, measured - torque, Some(9))?;
            cell(out, predicted.observed.position[row], None)?;
            if let Some(position) = &predicted.position {
                cell(out, position[row], Some(9))?;
            }
        }
        writeln!(out)?;
    }
    Ok(())
}

/// One cell: as short as it reads back exactly, or with so many decimals; empty for no value.
fn cell(out: &mut impl Write, value: f64, decimals: Option<usize>) -> io::Result<()> {
    match decimals {
        _ if !value.is_finite() => write!(out, ","),
        Some(decimals) => write!(out, ",{value:.decimals$}"),
        None => write!(out, ",{value}"),
    }
}
