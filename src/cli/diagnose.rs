//! `gib diagnose`: what the simulation gets wrong, why, and what knowing it is worth.

use std::fmt::Write;
use std::io::IsTerminal;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

use clap::Args;
use gib::diagnosis::{Diagnosis, Verdict, axis_of, diagnose};
use gib::machine::Drive;
use gib::recording::Recording;

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
        let mut machine = machine_file::load(&self.machine)?;
        let recording = Recording::open(&self.recording)?;
        let holdout = self.holdout.as_deref().map(Recording::open).transpose()?;
        let chosen = axis_of(&machine, &recording, self.axis.as_deref())?;
        let axis = &mut machine.axes[chosen];
        if let Some(holdout) = &holdout {
            gib::diagnosis::usable(holdout, axis)?;
        }
        let meter = Meter::new(self.progress);
        let Ok(diagnosis) = diagnose(axis, &recording, holdout.as_ref(), &|share, stage| meter.show(share, stage))
        else {
            return Err("stopped".into());
        };
        meter.clear();
        if let Some(file) = &self.json {
            std::fs::write(file, format!("{:#}\n", diagnosis.to_json()))
                .map_err(|e| format!("{}: {e}", file.display()))?;
        }
        if let Some(folder) = &self.plot {
            let picture = gib::report::residual::picture(&diagnosis)?;
            let file = folder.join(format!("residual_{}.svg", axis.name));
            std::fs::create_dir_all(folder)
                .and_then(|()| std::fs::write(&file, picture))
                .map_err(|e| format!("{}: {e}", file.display()))?;
        }
        *axis = diagnosis.extended.clone();
        if let Some(file) = &self.machine_out {
            machine.save(file)?;
        }
        let good = !matches!(diagnosis.verdict, Verdict::UnknownCause | Verdict::InsufficientData);
        Ok(Answer { text: text(&diagnosis), good })
    }
}

fn text(d: &Diagnosis) -> String {
    let unit = if d.extended.drive.is_linear() { "N" } else { "N·m" };
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
            .effect
            .keyed_values(d.extended.drive.is_linear())
            .zip(&finding.deviations)
            .map(|((key, value), std)| format!("{key} {value:.5} ± {:.2}", Short(1.96 * std)))
            .collect();
        let _ = writeln!(text, "   {}", parameters.join(", "));
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
        let (factor, unit) = match (gain.channel.ends_with("position"), &d.extended.drive) {
            (false, _) => (1.0, unit),
            (true, Drive::Rotary { .. }) => (1.0, "°"),
            (true, _) => (1e3, "µm"),
        };
        let _ = writeln!(
            text,
            "{} error{} on rows not fitted: {:.4} → {:.4} {unit} RMS, {:.2} times better (95 %: {:.2} to {:.2})",
            gain.channel,
            if gain.channel.ends_with("position") { "" } else { " while moving," },
            factor * gain.before,
            factor * gain.after,
            gain.before / gain.after.max(1e-300),
            gain.ci95[0],
            gain.ci95[1]
        );
    }
    if d.verdict != Verdict::InsufficientData {
        let _ = writeln!(
            text,
            "What is left: {:.4} {unit} RMS, noise {:.4}; {}",
            d.unexplained.torque_rms, d.unexplained.noise_rms, d.unexplained.describes
        );
    }
    text
}

/// Says how far the work is, where it was asked for, or where someone sits at a terminal and it takes more than a second.
struct Meter {
    always: bool,
    terminal: bool,
    begin: Instant,
    /// Percent shown last.
    shown: AtomicU32,
}

impl Meter {
    fn new(always: bool) -> Self {
        let terminal = std::io::stderr().is_terminal();
        Self { always, terminal, begin: Instant::now(), shown: AtomicU32::new(u32::MAX) }
    }

    fn show(&self, share: f64, stage: &str) -> bool {
        let percent = (100.0 * share) as u32;
        let due = self.always || self.terminal && self.begin.elapsed() > Duration::from_secs(1);
        if due && self.shown.swap(percent, Ordering::Relaxed) != percent {
            if self.terminal {
                eprint!("\r\x1b[K{percent:3} % {stage}");
            } else {
                eprintln!("{percent:3} % {stage}");
            }
        }
        true
    }

    /// Leaves a clean line.
    fn clear(&self) {
        if self.terminal && self.shown.load(Ordering::Relaxed) != u32::MAX {
            eprint!("\r\x1b[K");
        }
    }
}

/// Two significant digits.
struct Short(f64);

impl std::fmt::Display for Short {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.0 == 0.0 || !self.0.is_finite() {
            return write!(f, "{}", self.0);
        }
        let decimals = (1 - self.0.abs().log10().floor() as i32).clamp(0, 9) as usize;
        write!(f, "{:.decimals$}", self.0)
    }
}
