//! `gib predict`: what a machine file says a recording should look like, row by row.

use std::fmt::Write as _;
use std::io::{self, Write};
use std::path::PathBuf;

use clap::Args;
use gib::machine::Axis;
use gib::plant::added::Pulses;
use gib::plant::closed_loop::predict_motor;
use gib::plant::linear;
use gib::plant::observed::Observed;
use gib::plant::plausible::plausible;
use gib::plant::servo::CommandSpeed;
use gib::recording::{Column, Issue, IssueKind, Recording, Signal};
use serde_json::{Map, Value, json};

use super::meter::Clock;
use super::outputs::Outputs;
use super::{Answer, Result, machine_file};

/// Predicts the torque and, with a servo block, the closed-loop position of a recording
///
/// Writes time_s, then for each axis that machine and recording share: measured, predicted and residual torque (force for
/// linear drives), measured and simulated position. Over a few lost rows the motion goes on; rows in which it is not known, or that
/// repeat the time of the one before, stay empty.
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

/// Of what is amiss with a recording, what a reader of its prediction must know.
const LEFT_OUT: [IssueKind; 3] = [IssueKind::NotFinite, IssueKind::Outlier, IssueKind::Implausible];

impl Predict {
    /// Predicts and writes.
    pub fn run(&self) -> Result {
        let inputs = [("--machine", Some(&*self.machine)), ("--recording", Some(&*self.recording))];
        let mut outputs = Outputs::beside(&inputs);
        outputs.add("--out", Some(&self.out))?;
        let clock = Clock::new("reading");
        let machine = machine_file::load(&self.machine)?;
        let mut recording = Recording::open(&self.recording)?;
        let shared: Vec<&Axis> =
            machine.axes.iter().filter(|axis| recording.get(&axis.name, Signal::Position).is_some()).collect();
        if shared.is_empty() {
            let names: Vec<&str> = machine.axes.iter().map(|axis| axis.name.as_str()).collect();
            let file = self.recording.display();
            return Err(format!("{file}: no position column of an axis of the machine ({})", names.join(", ")).into());
        }
        shared.iter().try_for_each(|axis| plausible(&mut recording, axis))?;
        // Long recordings have no room for what is not used.
        recording.columns.retain(|column| shared.iter().any(|axis| is_used(column, axis)));
        let axes: Vec<Predicted> = shared
            .iter()
            .map(|axis| {
                clock.stage(format!("predicting axis {}", axis.name));
                Predicted::of(axis, &mut recording)
            })
            .collect::<std::result::Result<_, _>>()?;
        clock.stage("writing");
        outputs.write("--out", |out| write_rows(out, &recording, &axes))?;
        outputs.commit()?;
        drop(clock);
        if self.json {
            let figures: Map<String, Value> = axes.iter().map(|p| (p.axis.name.clone(), p.figures().json())).collect();
            return Ok(Answer::good(format!("{:#}\n", Value::Object(figures))));
        }
        let mut text = String::new();
        axes.iter().for_each(|predicted| predicted.figures().text(predicted, &mut text));
        let concerns = |column: &str| shared.iter().any(|axis| column.split('.').next() == Some(&axis.name));
        let left_out = |issue: &&Issue| LEFT_OUT.contains(&issue.kind) && issue.column.as_deref().is_some_and(concerns);
        for issue in recording.issues.iter().filter(left_out) {
            let _ = writeln!(text, "{issue}");
        }
        let repeats = recording.repeats.len();
        let rows = recording.rows() + repeats;
        if repeats > 0 {
            let _ =
                writeln!(text, "{repeats} rows repeat the time of the one before; all but their time is left empty");
        }
        let _ = writeln!(text, "{rows} rows written to {}", self.out.display());
        Ok(Answer::good(text))
    }
}

/// Whether an axis is predicted by a column: its table counts where it does not go with the motor.
fn is_used(column: &Column, axis: &Axis) -> bool {
    column.label.as_ref().is_none_or(|label| {
        let elastic = || axis.two_masses().is_ok_and(|masses| masses.is_some());
        label.channel == axis.name && (label.signal != Signal::TablePosition || elastic())
    })
}

/// One axis, measured and predicted.
struct Predicted<'a> {
    axis: &'a Axis,
    observed: Observed,
    torque: Vec<f64>,
    phases_unknown: usize,
    position: Option<Vec<f64>>,
    added: Option<Pulses>,
    command_speed: CommandSpeed,
}

impl<'a> Predicted<'a> {
    fn of(axis: &'a Axis, recording: &mut Recording) -> std::result::Result<Self, Box<dyn std::error::Error>> {
        let mut observed = Observed::taken(recording, axis)?;
        let prediction = predict_motor(axis, &mut observed)?;
        let position = prediction.closed_loop.map(|replayed| replayed.position);
        let (torque, phases_unknown) = (prediction.torque.torque, prediction.torque.phases_unknown);
        let (added, command_speed) = (prediction.added, prediction.command_speed);
        Ok(Self { axis, observed, torque, phases_unknown, position, added, command_speed })
    }

    /// The rows of the recording, without those that were put in between.
    fn rows(&self) -> impl Iterator<Item = Row> {
        self.observed.recorded().map(|(at, known)| {
            let position = if known { self.observed.position[at] } else { f64::NAN };
            Row { at, position }
        })
    }

    fn residual(&self) -> impl Iterator<Item = f64> {
        self.observed.torque.iter().zip(&self.torque).map(|(measured, predicted)| measured - predicted)
    }

    fn figures(&self) -> Figures {
        let standing = self.observed.motion.standing_speed();
        let moving = self.residual().zip(self.observed.motion.velocities()).filter(|(_, v)| v.abs() > standing);
        Figures {
            torque: rms(self.observed.torque.iter().copied()),
            residual: rms(self.residual()),
            moving: rms(moving.map(|(residual, _)| residual)),
            position_um: self.position.as_ref().map(|p| 1e3 * rms(self.rows().map(|row| row.position - p[row.at]))),
            added: self.added.map_or((0, 0.0), |added| (added.count, added.largest)),
            command_speed: self.command_speed,
            cutoff_hz: self.observed.motion.cutoff_hz,
        }
    }
}

/// A row of the recording.
struct Row {
    /// Its place among all rows, with those that were put in between.
    at: usize,
    /// As measured; NaN where it is not.
    position: f64,
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
            text.push_str(
                "  phases of periodic terms were estimated from the first quarter of the rows, or of those in motion\n",
            );
        }
        if predicted.phases_unknown > 0 {
            let _ = writeln!(
                text,
                "  {} of them left out: that quarter shows less than half a period",
                predicted.phases_unknown
            );
        }
    }
}

/// RMS of the finite values.
fn rms(values: impl Iterator<Item = f64>) -> f64 {
    linear::rms(values.filter(|v| v.is_finite()))
}

fn write_rows(out: &mut impl Write, recording: &Recording, axes: &[Predicted<'_>]) -> io::Result<()> {
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
    let mut rows: Vec<_> = axes.iter().map(Predicted::rows).collect();
    let cells: usize = axes.iter().map(|predicted| 4 + usize::from(predicted.position.is_some())).sum();
    let mut repeats = recording.repeats.iter().peekable();
    for (at, time) in recording.time_s.iter().enumerate() {
        write!(out, "{time}")?;
        for (predicted, rows) in axes.iter().zip(&mut rows) {
            let Some(row) = rows.next() else { continue };
            let (measured, torque) = (predicted.observed.torque[row.at], predicted.torque[row.at]);
            cell(out, measured, None)?;
            cell(out, torque, Some(9))?;
            cell(out, measured - torque, Some(9))?;
            cell(out, row.position, None)?;
            if let Some(position) = &predicted.position {
                cell(out, position[row.at], Some(9))?;
            }
        }
        writeln!(out)?;
        // As many rows as were read, so that the two files can be laid side by side.
        while repeats.next_if(|row| **row == at).is_some() {
            writeln!(out, "{time}{}", ",".repeat(cells))?;
        }
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
