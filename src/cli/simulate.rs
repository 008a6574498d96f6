//! `gib simulate`: an axis along a motion, as a recording.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use clap::Args;
use gib::machine::Axis;
use gib::plant::moves::{BUILT_IN, Moves, Reach};
use gib::plant::simulate::{Sensors, Setup, Trace, simulate_watched};
use gib::recording::{Recording, Signal, Unit};

use super::meter::{Clock, Meter};
use super::outputs::Outputs;
use super::{Answer, Result, machine_file};

/// Some five hours at 4 kHz, and 4 GB.
const MOST_CYCLES: f64 = 7e7;

/// Simulates an axis under its servo and writes what a recorder would have seen
///
/// The same seed gives the same file. Lengths are mm, on a rotary axis degrees.
#[derive(Args)]
pub struct Simulate {
    /// The machine file, with or without effects
    #[arg(long)]
    machine: PathBuf,
    /// The motion: test, reversals, strokes or sweep, a list of moves (.json), or a trajectory (.csv with <axis>.position_command_<unit>)
    #[arg(long)]
    moves: String,
    /// Where the recording is written, CSV
    #[arg(long)]
    out: PathBuf,
    /// Do the moves so many times over (not a trajectory)
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    repeat: u32,
    /// Seed of the noise and of the phases of periodic effects
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// The axis; the machine's first where left out
    #[arg(long)]
    axis: Option<String>,
    /// Longest plant step in µs
    #[arg(long, default_value_t = 25.0)]
    step_us: f64,
    /// Built-in moves: where the stroke begins
    #[arg(long, default_value_t = 0.0)]
    start_mm: f64,
    /// Built-in moves: length of the stroke
    #[arg(long, default_value_t = 200.0)]
    stroke_mm: f64,
    /// Built-in moves: top speed
    #[arg(long, default_value_t = 200.0)]
    speed_mm_s: f64,
    /// Built-in moves: acceleration; where left out, 2000, or what half the torque limit gives if that is less
    #[arg(long)]
    acceleration_mm_s2: Option<f64>,
    /// Step of encoder and scale
    #[arg(long, default_value_t = 0.0)]
    grid_um: f64,
    /// Noise of encoder and scale, standard deviation
    #[arg(long, default_value_t = 0.0)]
    noise_um: f64,
    /// Age of the encoder's and the scale's value when it is read
    #[arg(long, default_value_t = 0.0)]
    sensor_delay_ms: f64,
    /// Scale error of the encoder, µm per m
    #[arg(long, default_value_t = 0.0)]
    scale_um_m: f64,
    /// Eccentricity of the encoder: amplitude once a motor revolution
    #[arg(long, default_value_t = 0.0)]
    eccentricity_um: f64,
    /// Noise of the torque column, standard deviation, N·m (N for linear drives)
    #[arg(long, default_value_t = 0.0)]
    torque_noise: f64,
    /// Step of the torque column, N·m (N for linear drives)
    #[arg(long, default_value_t = 0.0)]
    torque_grid: f64,
}

impl Simulate {
    /// Simulates and writes.
    pub fn run(&self) -> Result {
        let moves = Some(Path::new(&self.moves)).filter(|file| file.extension().is_some());
        let mut outputs = Outputs::beside(&[("--machine", Some(&*self.machine)), ("--moves", moves)]);
        outputs.add("--out", Some(&self.out))?;
        let machine = machine_file::load(&self.machine)?;
        let axis = match &self.axis {
            None => machine.axes.first(),
            Some(name) => machine.axis(name),
        };
        let axis = axis.ok_or_else(|| {
            let names: Vec<&str> = machine.axes.iter().map(|axis| axis.name.as_str()).collect();
            format!("{}: no such axis; it has {}", self.machine.display(), names.join(", "))
        })?;
        let command = self.command(axis)?;
        let setup = Setup {
            step_s: 1e-6 * self.step_us,
            seed: self.seed,
            sensors: Sensors {
                grid_um: self.grid_um,
                noise_um: self.noise_um,
                delay_s: 1e-3 * self.sensor_delay_ms,
                scale_um_m: self.scale_um_m,
                eccentricity_um: self.eccentricity_um,
                torque_noise: self.torque_noise,
                torque_grid: self.torque_grid,
            },
            ..Setup::default()
        };
        let meter = Meter::new(false);
        let trace = simulate_watched(axis, &command, &setup, &mut |share| meter.show(share, "simulating"))?;
        drop(meter);
        let clock = Clock::new("writing");
        outputs.write("--out", |out| write_rows(out, axis, &trace))?;
        outputs.commit()?;
        drop(clock);
        let seconds = trace.time_s.last().copied().unwrap_or(0.0);
        Ok(Answer::good(format!("{} rows over {seconds:.3} s written to {}\n", command.len(), self.out.display())))
    }

    /// The commanded position of every servo cycle.
    fn command(&self, axis: &Axis) -> std::result::Result<Vec<f64>, Box<dyn std::error::Error>> {
        let period_s = axis.servo.ok_or("the machine file gives this axis no servo; simulate needs one")?.period_s;
        let file = Path::new(&self.moves);
        let extension = file.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
        match extension.as_str() {
            "csv" => trajectory(file, axis, period_s),
            "json" => {
                let text = std::fs::read_to_string(file).map_err(|e| format!("{}: {e}", file.display()))?;
                let moves = Moves::parse(&text).map_err(|e| format!("{}: {e}", file.display()))?;
                self.repeated(moves, period_s)
            }
            _ => {
                let reach = self.reach(axis)?;
                let moves = Moves::built_in(&self.moves, &reach).ok_or_else(|| {
                    format!("--moves {}: give one of {}, or a .json or .csv file", self.moves, BUILT_IN.join(", "))
                })?;
                self.repeated(moves, period_s)
            }
        }
    }

    /// The cycles of these moves, over and over.
    fn repeated(&self, mut moves: Moves, period_s: f64) -> std::result::Result<Vec<f64>, Box<dyn std::error::Error>> {
        let cycles = moves.duration_s() * f64::from(self.repeat) / period_s;
        if cycles > MOST_CYCLES {
            return Err(format!(
                "--moves {}: takes {cycles:.3e} servo cycles; at most {MOST_CYCLES:.0e} are simulated at once",
                self.moves
            )
            .into());
        }
        moves.moves = moves.moves.repeat(self.repeat as usize);
        Ok(moves.command(period_s))
    }

    fn reach(&self, axis: &Axis) -> std::result::Result<Reach, String> {
        let belief = axis.belief();
        let half_torque = 0.5 * belief.torque_limit / (belief.inertia * axis.drive.motor_per_load());
        let acceleration = self.acceleration_mm_s2.unwrap_or(half_torque.min(2000.0));
        let reach = Reach { start: self.start_mm, stroke: self.stroke_mm, speed: self.speed_mm_s, acceleration };
        let unit = axis.drive.load_unit();
        for (option, value, low, high, unit) in [
            ("--start-mm", reach.start, -1e6, 1e6, unit.to_owned()),
            ("--stroke-mm", reach.stroke, 1e-6, 1e6, unit.to_owned()),
            ("--speed-mm-s", reach.speed, 1e-6, 1e6, format!("{unit}/s")),
            ("--acceleration-mm-s2", reach.acceleration, 1e-6, 1e9, format!("{unit}/s²")),
        ] {
            if !(value >= low && value <= high) {
                let left_out = option == "--acceleration-mm-s2" && self.acceleration_mm_s2.is_none();
                let why = if left_out { ", which half the torque limit gives; give it" } else { "" };
                let value = if value == 0.0 { "0".to_owned() } else { format!("{value:e}") };
                return Err(format!("{option} is {value} {unit}{why}; write a number from {low:e} to {high:e}"));
            }
        }
        Ok(reach)
    }
}

/// The position command of a recording, at the servo's cycles.
fn trajectory(file: &Path, axis: &Axis, period_s: f64) -> std::result::Result<Vec<f64>, Box<dyn std::error::Error>> {
    let recording = Recording::open(file)?;
    let unit = if axis.drive.is_rotary() { Unit::Deg } else { Unit::Mm };
    let command = recording.need(&axis.name, Signal::PositionCommand, unit)?;
    let seconds = recording.time_s[recording.rows() - 1] - recording.time_s[0];
    let cycles = (seconds / period_s + 1e-6) as usize + 1;
    Ok(gib::plant::at_rows::command_of_cycles(&recording.time_s, &command, period_s, cycles).collect())
}

fn write_rows(out: &mut impl Write, axis: &Axis, trace: &Trace) -> io::Result<()> {
    let (name, drive) = (&axis.name, axis.drive);
    let (load, word, unit) = (drive.load_unit(), drive.torque_word(), drive.torque_unit());
    writeln!(
        out,
        "time_s,{name}.position_command_{load},{name}.position_{load},{name}.table_position_{load},{name}.{word}_{unit}"
    )?;
    let columns = trace.command.iter().zip(&trace.position).zip(trace.table_position.iter().zip(&trace.torque));
    for (time, ((command, position), (table, torque))) in trace.time_s.iter().zip(columns) {
        writeln!(out, "{time:.6},{command:.9},{position:.9},{table:.9},{torque:.6}")?;
    }
    Ok(())
}
