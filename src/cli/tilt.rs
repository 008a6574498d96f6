//! `gib tilt`: load tables from recordings of cuts, and the tilt of a workpiece from one.

use std::fmt::Write;
use std::path::PathBuf;

use clap::{Args, Subcommand};
use gib::analysis::tilt::{Options, measured, signal_of, taught};
use gib::cycle::tilt::config::{GIB_TILT_DC_LOAD, GIB_TILT_TWO_POINT};
use gib::cycle::tilt::table::{TiltCondition, TiltTable};
use gib::cycle::tilt::verdict::{
    GIB_TILT_ABOUT_EITHER, GIB_TILT_ABOUT_X, GIB_TILT_ABOUT_Y, GIB_TILT_SIGNIFICANT, TiltReport,
};
use gib::machine::load_table;
use gib::recording::Recording;
use serde_json::json;

use super::outputs::Outputs;
use super::table::Table;
use super::{Answer, Result};

/// Finds the tilt of a workpiece in the spindle's load, by a table of depth and load
///
/// A workpiece that is clamped out of true is cut deeper on one side. Record x.position_mm, y.position_mm, spindle.speed_rpm and
/// spindle.load_percent (or spindle.current_a) while cutting; a row is in the cut where the feed is that of the condition.
#[derive(Args)]
pub struct TiltCommand {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Teach(Teach),
    Show(Show),
    Measure(Measure),
}

impl TiltCommand {
    /// Does what was asked.
    pub fn run(&self) -> Result {
        match &self.command {
            Command::Teach(command) => command.run(),
            Command::Show(command) => command.run(),
            Command::Measure(command) => command.run(),
        }
    }
}

/// How to read a cut.
#[derive(Args)]
struct Cut {
    /// Pole pairs of the spindle motor times the ratio of its gear, where the load is a current
    #[arg(long, value_name = "N", default_value_t = 0)]
    pole_pairs: i32,
    /// Way left out at both ends of a pass, mm: best the tool's diameter
    #[arg(long, value_name = "MM", default_value_t = 0.0)]
    entry: f64,
    /// How far speed and feed may be from the condition's, in percent
    #[arg(long, value_name = "PERCENT", default_value_t = 5.0)]
    tolerance: f64,
}

impl Cut {
    fn options(&self, condition: TiltCondition, signal: i32, flag: bool) -> Options {
        let (pole_pairs, entry_mm, tolerance) = (self.pole_pairs, self.entry, self.tolerance / 100.0);
        Options { condition, signal, pole_pairs, entry_mm, tolerance, flag }
    }
}

/// Makes a load table from recordings of cuts of known depth on a workpiece that lies true
#[derive(Args)]
struct Teach {
    /// The table, JSON; written anew, or added to with --add
    table: PathBuf,
    /// Depth of a cut in mm and its recording; two at least, unless the table has some
    #[arg(required = true, value_name = "MM=RECORDING", value_parser = cut)]
    cuts: Vec<(f64, PathBuf)>,
    /// Number of the tool
    #[arg(long, value_name = "N", default_value_t = 0)]
    tool: u32,
    /// Number of the material
    #[arg(long, value_name = "N", default_value_t = 0)]
    material: u32,
    /// Spindle speed of the cuts, rpm; not with --add, which keeps the table's condition
    #[arg(long, value_name = "RPM", required_unless_present = "add")]
    speed: Option<f64>,
    /// Feed of the cuts, mm/min; not with --add
    #[arg(long, value_name = "MM_MIN", required_unless_present = "add")]
    feed: Option<f64>,
    /// Add to the table that is there
    #[arg(long, conflicts_with_all = ["tool", "material", "speed", "feed"])]
    add: bool,
    #[command(flatten)]
    cut: Cut,
}

fn cut(text: &str) -> std::result::Result<(f64, PathBuf), String> {
    let (depth, file) = text.split_once('=').ok_or("write it as DEPTH=RECORDING, for example 2.5=cut.csv")?;
    let depth: f64 = depth.trim().parse().map_err(|_| format!("\"{depth}\" is no depth in mm"))?;
    if !(0.0..=1000.0).contains(&depth) {
        return Err(format!("a depth of {depth} mm; allowed are 0 to 1000"));
    }
    Ok((depth, file.into()))
}

impl Teach {
    fn run(&self) -> Result {
        let cuts: Vec<_> = self.cuts.iter().map(|(_, file)| ("<CUTS>", Some(&**file))).collect();
        Outputs::beside(&cuts).add("<TABLE>", Some(&self.table))?;
        let mut table = if self.add { load_table::load(&self.table)? } else { TiltTable::default() };
        if let (Some(speed_rpm), Some(feed_mm_min)) = (self.speed, self.feed) {
            table.condition = TiltCondition { tool_id: self.tool, material_id: self.material, speed_rpm, feed_mm_min };
        }
        for (i, (depth, file)) in self.cuts.iter().enumerate() {
            let name = file.display();
            let recording = Recording::open(file)?;
            let signal = if i == 0 && !self.add { signal_of(&recording)? } else { table.signal };
            table.signal = signal;
            let found = taught(&recording, &self.cut.options(table.condition, signal, false))
                .map_err(|why| format!("{name}: {why}"))?;
            table
                .add(*depth, found.load, found.load_std)
                .map_err(|fault| format!("{name}: {} is {}", fault.field.trim_end_matches('\0'), fault.value))?;
        }
        load_table::save(&table, &self.table)?;
        Ok(Answer::good(format!("{}\n{}", self.table.display(), rows(&table))))
    }
}

/// Shows a load table, and whether it can be measured with
#[derive(Args)]
struct Show {
    /// The table, JSON
    table: PathBuf,
}

impl Show {
    fn run(&self) -> Result {
        let table = load_table::load(&self.table)?;
        Ok(Answer::good(format!("{}\n{}", self.table.display(), rows(&table))))
    }
}

fn rows(table: &TiltTable) -> String {
    let TiltCondition { tool_id, material_id, speed_rpm, feed_mm_min } = table.condition;
    let unit = if table.signal == GIB_TILT_DC_LOAD { "%" } else { "A" };
    let mut lines = Table::new(["depth, mm", &format!("load, {unit}"), "std", "cuts", "per mm"], 0);
    let used = table.rows as usize;
    for i in 0..used {
        let to_next = |of: &[f64]| of.get(i + 1).filter(|_| i + 1 < used).map_or(f64::NAN, |next| next - of[i]);
        let slope = to_next(&table.load) / to_next(&table.depth_mm);
        let slope = if slope.is_finite() { format!("{slope:.3}") } else { String::new() };
        let [depth, load, std] = [table.depth_mm[i], table.load[i], table.load_std[i]];
        lines.row([format!("{depth:.3}"), format!("{load:.4}"), format!("{std:.4}"), table.cuts[i].to_string(), slope]);
    }
    let condition = format!("  tool {tool_id}, material {material_id}, {speed_rpm} rpm, {feed_mm_min} mm/min\n");
    format!("{condition}\n{}", lines.text())
}

/// Measures the tilt of a workpiece from the recording of a cut
///
/// Ends with 1 when a tilt is there (it is larger than its uncertainty), and 0 when none is.
#[derive(Args)]
struct Measure {
    /// The load table, JSON
    table: PathBuf,
    /// The recording: CSV with x.position and y.position (one of them for a line), spindle.speed, spindle.load or .current
    recording: PathBuf,
    /// Number of the tool, where it is to be checked against the table's
    #[arg(long, value_name = "N")]
    tool: Option<u32>,
    /// Number of the material, where it is to be checked against the table's
    #[arg(long, value_name = "N")]
    material: Option<u32>,
    /// Go on under another condition than the table's, and say so
    #[arg(long)]
    flag: bool,
    /// Answer as JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    cut: Cut,
}

impl Measure {
    fn run(&self) -> Result {
        let table = load_table::load(&self.table)?;
        let recording = Recording::open(&self.recording)?;
        let mut condition = table.condition;
        condition.tool_id = self.tool.unwrap_or(condition.tool_id);
        condition.material_id = self.material.unwrap_or(condition.material_id);
        let options = self.cut.options(condition, signal_of(&recording)?, self.flag);
        let found =
            measured(&recording, &options, &table).map_err(|why| format!("{}: {why}", self.recording.display()))?;
        let text = if self.json { as_json(&found)? } else { self.text(&found) };
        Ok(Answer { text, good: found.decision != GIB_TILT_SIGNIFICANT })
    }

    fn text(&self, r: &TiltReport) -> String {
        let mut text = format!("{}\n", self.recording.display());
        let _ = writeln!(text, "  tilt     {:>8.4}° ± {:.4}°", r.tilt_deg, r.uncertainty_deg);
        for (name, axis, value, uncertainty) in [
            ("about x", GIB_TILT_ABOUT_X, r.about_x_deg, r.about_x_uncertainty_deg),
            ("about y", GIB_TILT_ABOUT_Y, r.about_y_deg, r.about_y_uncertainty_deg),
        ] {
            if r.axes_seen & axis != 0 {
                let _ = writeln!(text, "  {name}  {value:>8.4}° ± {uncertainty:.4}°");
            } else {
                let _ = writeln!(text, "  {name}   not to be told from this path: cut along the other direction too");
            }
        }
        let _ = writeln!(text, "  two points, as published: {:.4}°", r.two_point_deg);
        if r.wear_separated != 0 {
            let (wear, uncertainty) = (100.0 * r.wear_ratio_m, 100.0 * r.wear_uncertainty_ratio_m);
            let _ = writeln!(text, "  wear: the depth seems to grow {wear:.1} % ± {uncertainty:.1} % a metre");
        } else {
            text += "  wear cannot be told from tilt in this path: cut it back again\n";
        }
        let _ = writeln!(
            text,
            "  {} blocks, {} without weight; left out: {} of another speed or feed, {} outside the table",
            r.blocks, r.rejected, r.off_condition, r.outside_table
        );
        if r.flagged != 0 {
            text += "  FLAGGED: cut under another condition than the table's\n";
        }
        let verdict = match r.decision {
            GIB_TILT_SIGNIFICANT => "the workpiece is tilted",
            _ => "no tilt beyond the uncertainty",
        };
        let about = match r.axes {
            GIB_TILT_ABOUT_X => " about x",
            GIB_TILT_ABOUT_Y => " about y",
            GIB_TILT_ABOUT_EITHER => " about x, y or both",
            0 => "",
            _ => " about x and y",
        };
        let _ = writeln!(text, "\n{verdict}{}", if r.decision == GIB_TILT_SIGNIFICANT { about } else { "" });
        text
    }
}

fn as_json(r: &TiltReport) -> std::result::Result<String, serde_json::Error> {
    let value = |value: f64, uncertainty: f64| json!({ "value": value, "uncertainty": uncertainty });
    let seen = |axis: i32, shown| if r.axes_seen & axis != 0 { shown } else { json!(null) };
    let told = |axis: i32| r.axes & axis != 0;
    let text = serde_json::to_string_pretty(&json!({
        "tilt_deg": value(r.tilt_deg, r.uncertainty_deg),
        "about_x_deg": seen(GIB_TILT_ABOUT_X, value(r.about_x_deg, r.about_x_uncertainty_deg)),
        "about_y_deg": seen(GIB_TILT_ABOUT_Y, value(r.about_y_deg, r.about_y_uncertainty_deg)),
        "tilted_about": { "x": told(GIB_TILT_ABOUT_X), "y": told(GIB_TILT_ABOUT_Y), "either": told(GIB_TILT_ABOUT_EITHER) },
        "significant": r.decision == GIB_TILT_SIGNIFICANT,
        "two_point_deg": r.two_point_deg,
        "wear_ratio_m": (r.wear_separated != 0).then(|| value(r.wear_ratio_m, r.wear_uncertainty_ratio_m)),
        "depth_mm": r.depth_mm,
        "blocks": r.blocks, "rejected": r.rejected, "off_condition": r.off_condition, "outside_table": r.outside_table,
        "flagged": r.flagged != 0,
        "method": if r.method == GIB_TILT_TWO_POINT { "two_point" } else { "fit" },
    }))?;
    Ok(text + "\n")
}
