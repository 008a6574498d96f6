//! `gib diagnose`: what the simulation gets wrong, why, and what knowing it is worth.

use std::error::Error;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::PathBuf;

use clap::Args;
use gib::diagnosis::gain::Gain;
use gib::diagnosis::{Diagnosis, Excerpt, Left, Verdict, axis_of, diagnose};
use gib::plant::plausible::plausible;
use gib::recording::{Recording, is_same_file};

use super::meter::Meter;
use super::outputs::Outputs;
use super::table::Table;
use super::{Answer, Result, machine_file};

/// Names what a simulation gets wrong about a machine, from a recording
#[derive(Args)]
#[command(after_help = "\
Exit codes:
  0  a verdict was reached (no_discrepancy, explained, partly_explained)
  1  the cause is unknown, or the data do not suffice (the text says what is missing)
  2  wrong usage, or a file that cannot be used")]
pub struct Diagnose {
    /// What the simulation believes, machine.json
    #[arg(long)]
    machine: PathBuf,
    /// The recording, CSV
    #[arg(long)]
    recording: PathBuf,
    /// A second recording, not used for fitting, on which the gain is measured
    #[arg(long)]
    holdout: Option<PathBuf>,
    /// The axis, where the machine has more than one
    #[arg(long)]
    axis: Option<String>,
    /// Write the diagnosis here as JSON
    #[arg(long)]
    json: Option<PathBuf>,
    /// Write the machine file here, extended by what was found
    #[arg(long)]
    machine_out: Option<PathBuf>,
    /// Draw the residual against everything it may go with into this folder, as residual_<axis>.svg
    #[arg(long, value_name = "DIR")]
    plot: Option<PathBuf>,
    /// Say on standard error how far the work is; on a terminal this is done anyway when it takes long
    #[arg(long)]
    progress: bool,
}

impl Diagnose {
    /// Diagnoses the recording.
    pub fn run(&self) -> Result {
        let holdout = self.holdout.as_deref();
        let inputs =
            [("--machine", Some(&*self.machine)), ("--recording", Some(&*self.recording)), ("--holdout", holdout)];
        let mut outputs = Outputs::beside(&inputs);
        if let Some(file) = holdout.filter(|file| is_same_file(file, &self.recording)) {
            let file = file.display();
            return Err(format!(
                "--holdout {file}: is the recording itself, on which a gain says nothing; leave it out"
            )
            .into());
        }
        outputs.add("--json", self.json.as_deref())?;
        outputs.add("--machine-out", self.machine_out.as_deref())?;
        let mut machine = machine_file::load(&self.machine)?;
        let mut recording = Recording::open(&self.recording)?;
        let chosen = axis_of(&machine, &recording, self.axis.as_deref())?;
        let axis = &mut machine.axes[chosen];
        if let Some(folder) = &self.plot {
            std::fs::create_dir_all(folder).map_err(|e| format!("--plot {}: {e}", folder.display()))?;
            outputs.add("--plot", Some(&folder.join(format!("residual_{}.svg", axis.name))))?;
        }
        plausible(&mut recording, axis)?;
        // One after the other, so that there is room for either.
        let excerpt = Excerpt::of(&recording, axis);
        drop(recording);
        let read = |file| -> std::result::Result<Excerpt, Box<dyn Error>> {
            let mut recording = Recording::open(file)?;
            plausible(&mut recording, axis)?;
            Ok(Excerpt::of(&recording, axis))
        };
        let holdout = holdout.map(read).transpose()?;
        if let Some(Err(why)) = holdout.as_ref().map(Excerpt::usable) {
            return Err(why.clone().into());
        }
        let meter = Meter::new(self.progress);
        let Ok(diagnosis) = diagnose(axis, &excerpt, holdout.as_ref(), &|share, stage| {
            meter.show(share, stage);
            true
        }) else {
            return Err("stopped".into());
        };
        drop(meter);
        outputs.write("--json", |out| writeln!(out, "{:#}", diagnosis.to_json()))?;
        if self.plot.is_some() {
            let picture = gib::report::residual::picture(&diagnosis)?;
            outputs.write("--plot", |out| out.write_all(picture.as_bytes()))?;
        }
        *axis = diagnosis.extended.clone();
        outputs.write("--machine-out", |out| writeln!(out, "{:#}", machine.to_json()))?;
        outputs.commit()?;
        let good = !matches!(diagnosis.verdict, Verdict::UnknownCause | Verdict::InsufficientData);
        Ok(Answer { text: text(&diagnosis), good })
    }
}

fn text(d: &Diagnosis) -> String {
    let unit = if d.extended.drive.is_linear() { "N" } else { "N·m" };
    let load = if d.extended.drive.is_rotary() { (1.0, "°") } else { (1e3, "µm") };
    let mut text = String::new();
    let _ = writeln!(
        text,
        "Axis {}: {}",
        d.extended.name,
        match d.verdict {
            Verdict::NoDiscrepancy => "no discrepancy: the machine does what the simulation believes.",
            Verdict::Explained => "the simulation is wrong, and this is why.",
            Verdict::PartlyExplained => "the simulation is wrong; this explains most of it.",
            Verdict::UnknownCause => "the simulation is wrong, and no known cause fits.",
            Verdict::InsufficientData => "the recording does not suffice.",
        }
    );
    for line in &d.missing {
        let _ = writeln!(text, "  missing: {line}");
    }
    for note in &d.notes {
        let _ = writeln!(text, "  note: {note}");
    }
    if !d.shown.is_empty() {
        text.push_str("\nShare of the residual's variance that goes with each coordinate:\n");
        let mut table = Table::new(["", "as believed", "in the end"], 1);
        let mut shown: Vec<_> = d.shown.iter().collect();
        shown.sort_by(|a, b| b.before.total_cmp(&a.before));
        for view in shown {
            let percent = |share: f64| format!("{:.0} %", 100.0 * share);
            table.row([view.coordinate.name().to_owned(), percent(view.before), percent(view.after)]);
        }
        text += &table.text();
    }
    for (i, finding) in d.findings.iter().enumerate() {
        let _ = writeln!(
            text,
            "\n{}. {}   ({:.0} % of the discrepancy, confidence {:.1} %)",
            i + 1,
            finding.effect.cause(),
            100.0 * finding.share,
            100.0 * finding.confidence
        );
        let _ = writeln!(text, "   {}", finding.evidence);
        let parameters: Vec<String> = finding
            .parameters(d.extended.drive.is_linear())
            .map(|(key, value, std)| format!("{key} {}", with_interval(value, 2.0 * std)))
            .collect();
        let _ = writeln!(text, "   {} (k = 2)", parameters.join(", "));
        for other in &finding.indistinguishable_from {
            let _ = writeln!(text, "   this recording cannot tell it from {other}");
        }
        if let Some((_, why)) = &finding.next_experiment {
            let _ = writeln!(text, "   next: {why} (the moves are in the JSON)");
        }
    }
    if !d.gains.is_empty() {
        text.push('\n');
    }
    for gain in &d.gains {
        let (factor, unit) = if gain.channel.ends_with("position") { load } else { (1.0, unit) };
        let (before, after) = (factor * gain.before, factor * gain.after);
        let _ = writeln!(
            text,
            "{} error{} on rows not fitted: {} → {} {unit} RMS, {}",
            gain.channel,
            if gain.channel.ends_with("position") { "" } else { " while moving," },
            beside(before, after),
            beside(after, before),
            times_better(gain)
        );
    }
    if d.verdict != Verdict::InsufficientData {
        let mut left = |of: &str, left: &Left, (factor, unit): (f64, &str)| {
            let (rms, noise) = (factor * left.rms, factor * left.noise_rms);
            let (said, of_noise) = (beside(rms, noise), beside(noise, rms));
            let _ = writeln!(text, "What is left of {of}: {said} {unit} RMS, noise {of_noise}; {}", left.describes);
        };
        left(d.extended.drive.torque_word(), &d.unexplained.torque, (1.0, unit));
        if let Some(table) = &d.unexplained.table {
            left("table − motor", table, load);
        }
    }
    text
}

/// Decimals by which a number has so many significant digits.
fn decimals(value: f64, digits: i32) -> usize {
    let value = value.abs();
    if value > 0.0 && value.is_finite() { (digits - 1 - value.log10().floor() as i32).clamp(0, 12) as usize } else { 0 }
}

/// A value to as many decimals as its interval has, which has two digits; five digits where there is none.
fn with_interval(value: f64, half: f64) -> String {
    let places = if half > 0.0 && half.is_finite() { decimals(half, 2) } else { decimals(value, 5) };
    format!("{value:.places$} ± {half:.places$}")
}

/// How much better a machine is than the belief, where it is another one, as far as that is a number that says something.
fn times_better(gain: &Gain) -> String {
    let ratio = gain.before / gain.after.max(1e-300);
    if gain.before == gain.after {
        "no change".to_owned()
    } else if ratio >= MOST_TIMES {
        format!("more than {MOST_TIMES} times better")
    } else {
        let [least, most] = gain.ci95;
        let most = if most < MOST_TIMES { format!("to {most:.2}") } else { "or more".to_owned() };
        format!("{ratio:.2} times better (95 %: {least:.2} {most})")
    }
}

/// Gain from which on only that it is more is said.
const MOST_TIMES: f64 = 1000.0;

/// A value to as many decimals as three digits of it or of its neighbour take, whichever has more.
fn beside(value: f64, neighbour: f64) -> String {
    let places = decimals(value, 3).max(decimals(neighbour, 3));
    format!("{value:.places$}")
}
