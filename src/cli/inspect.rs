//! `gib inspect`: what a recording holds and what it suffices for.

use std::fmt::Write;
use std::path::PathBuf;

use clap::Args;
use gib::analysis::inspection::Inspection;
use gib::recording::Recording;

use super::table::Table;
use super::{Answer, Result};

/// Shows what a recording holds: channels, units, rate, ranges, noise, motion, and what it suffices for
#[derive(Args)]
pub struct Inspect {
    /// The recording, CSV
    recording: PathBuf,
    /// Answer as JSON
    #[arg(long)]
    json: bool,
}

impl Inspect {
    /// Looks into the recording.
    pub fn run(&self) -> Result {
        let inspection = Inspection::of(&Recording::open(&self.recording)?);
        if self.json {
            return Ok(Answer::good(serde_json::to_string_pretty(&inspection)? + "\n"));
        }
        Ok(Answer::good(text(&inspection)))
    }
}

fn text(inspection: &Inspection) -> String {
    let mut text = String::new();
    let rate = if inspection.period_s > 0.0 { 1.0 / inspection.period_s } else { 0.0 };
    let _ = writeln!(
        text,
        "{}\n  {} rows over {} s, one every {} ms ({} Hz), jitter {} ms RMS, {} ms at most, {} gaps",
        inspection.file,
        inspection.rows,
        number(inspection.duration_s),
        number(1e3 * inspection.period_s),
        number(rate),
        short(1e3 * inspection.jitter_s),
        short(1e3 * inspection.jitter_max_s),
        inspection.gaps
    );

    let mut table = Table::new(["column", "from", "to", "noise", "grid", "held rows", "missing"], 1);
    for column in &inspection.columns {
        let or_dash = |value: Option<f64>, show: fn(f64) -> String| value.map_or("-".into(), show);
        table.row([
            column.name.clone(),
            or_dash(column.min, number),
            or_dash(column.max, number),
            or_dash(column.noise, short),
            or_dash(column.grid, short),
            column.hold_rows.to_string(),
            column.missing.to_string(),
        ]);
    }
    text += "\nColumns, each in the unit of its name\n";
    text += &table.text();

    if !inspection.motions.is_empty() {
        let mut table = Table::new(["channel", "stroke", "top speed", "reversals", "moving"], 1);
        for channel in &inspection.motions {
            table.row([
                channel.channel.clone(),
                format!("{} {}", number(channel.motion.stroke), channel.unit),
                format!("{} {}/s", number(channel.motion.speed_max), channel.unit),
                channel.motion.reversals.to_string(),
                format!("{:.0} %", 100.0 * channel.motion.moving_share),
            ]);
        }
        text += "\nMotion\n";
        text += &table.text();
    }

    if !inspection.analyses.is_empty() {
        let mut table = Table::new(["channel", "analysis", "suffices"], 3);
        for analysis in &inspection.analyses {
            let verdict =
                if analysis.sufficient { "yes".into() } else { format!("no: needs {}", analysis.missing.join("; ")) };
            table.row([analysis.channel.clone(), analysis.analysis.to_owned(), verdict]);
        }
        text += "\nSuffices for\n";
        text += &table.text();
    }

    text += "\nIssues\n";
    for issue in &inspection.issues {
        let _ = writeln!(text, "  {issue}");
    }
    if inspection.issues.is_empty() {
        text += "  none\n";
    }
    text
}

/// Six significant digits, without trailing zeros.
fn number(value: f64) -> String {
    significant(value, 6)
}

/// Two significant digits: enough for noise.
fn short(value: f64) -> String {
    significant(value, 2)
}

fn significant(value: f64, digits: i32) -> String {
    if value == 0.0 {
        return "0".into();
    }
    if !value.is_finite() {
        return value.to_string();
    }
    let exponent = value.abs().log10().floor() as i32;
    if !(-7..9).contains(&exponent) {
        return format!("{value:.*e}", usize::try_from(digits - 1).unwrap_or(0));
    }
    let decimals = usize::try_from(digits - 1 - exponent).unwrap_or(0);
    let text = format!("{value:.decimals$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}
