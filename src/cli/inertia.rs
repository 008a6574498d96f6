//! `gib inertia`: what a spindle and its load weigh against acceleration, from a recording.

use std::fmt::Write;
use std::path::PathBuf;

use clap::Args;
use gib::analysis::inertia::{Found, Options, measure};
use gib::cycle::inertia::report::InertiaReport;
use gib::program::{self, Scope};
use gib::recording::Recording;
use serde_json::json;

use super::outputs::Outputs;
use super::{Answer, Result};

/// Measures inertia and friction of a spindle from its torque and speed while it speeds up and slows down
///
/// Fits inertia, Coulomb and viscous friction together, T = J·ω' + B·ω + Tc·sign ω, and leaves out what is not the spindle's
/// motion: wild samples, take-up, field weakening, saturation. Record at least one ramp up and one down between the same speeds.
/// Uncertainties hold the truth in 95 of 100 cases.
///
/// Ends with 1 when the motion does not determine the inertia; the text then says which ramp would.
#[derive(Args)]
pub struct InertiaCommand {
    /// The recording: CSV with spindle.speed and spindle.torque, else spindle.torque_command (or spindle.current with
    /// --torque-constant, spindle.load with --rated-torque)
    recording: PathBuf,
    /// Draw what accelerates and what friction takes, as SVG
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
    /// Answer as JSON
    #[arg(long)]
    json: bool,
    /// Channel of the spindle
    #[arg(long, value_name = "NAME", default_value = "spindle")]
    channel: String,
    /// Take current × this constant as torque, N·m/A
    #[arg(long, value_name = "NM_A")]
    torque_constant: Option<f64>,
    /// Take load × this torque at 100 % as torque, N·m; the load must have a sign
    #[arg(long, value_name = "NM", conflicts_with = "torque_constant")]
    rated_torque: Option<f64>,
    /// Leave out what is faster: the field is weakened there (found by itself where it shows)
    #[arg(long, value_name = "RPM")]
    base_speed: Option<f64>,
    /// Leave out what is above this torque: the motor saturates there (found by itself where it shows)
    #[arg(long, value_name = "NM")]
    saturation: Option<f64>,
    /// Leave out this long after standing still and after the torque changes its sense
    #[arg(long, value_name = "S", default_value_t = 0.1)]
    takeup: f64,
    /// The machine's own inertia (spindle, rotor, chuck), taken off so that the value is the workpiece's, kg·m²
    #[arg(long, value_name = "KG_M2", default_value_t = 0.0)]
    own: f64,
    /// Uncertainty of the machine's own inertia, kg·m²
    #[arg(long, value_name = "KG_M2", default_value_t = 0.0)]
    own_uncertainty: f64,
    /// Uncertainty wanted, in percent of the inertia
    #[arg(long, value_name = "PERCENT", default_value_t = 5.0)]
    target: f64,
    /// Write the value as INA into the head of this part program; where it stands already, nothing is measured
    #[arg(long, value_name = "FILE")]
    program: Option<PathBuf>,
    /// For this process step only, 1 to 9999; 0 for the whole program
    #[arg(long, value_name = "N", default_value = "0", value_parser = super::program::scope)]
    step: Scope,
}

impl InertiaCommand {
    /// Measures and tells.
    pub fn run(&self) -> Result {
        let mut outputs =
            Outputs::beside(&[("<RECORDING>", Some(&*self.recording)), ("--program", self.program.as_deref())]);
        outputs.add("--plot", self.plot.as_deref())?;
        if let Some(file) = &self.program
            && let Some(entry) = program::get(file, self.step)?
        {
            let (scope, value, line) = (entry.scope, entry.inertia_kg_m2, entry.line);
            let name = file.display();
            return Ok(Answer::good(format!("{name}: {scope} = {value} kg·m² stands in line {line}; not measured\n")));
        }
        let found = measure(&Recording::open(&self.recording)?, &self.options())?;
        let mut text = if self.json { as_json(&found)? } else { self.text(&found) };
        if let (Some(path), false) = (&self.plot, found.blocks.is_empty()) {
            outputs.picture("--plot", &gib::report::inertia::picture(&found)?)?;
            if !self.json {
                let _ = writeln!(text, "\nPicture: {}", path.display());
            }
        }
        if let (Some(file), None) = (&self.program, &found.refused) {
            let value = rounded(&found.report);
            program::set(file, self.step, value, None)?;
            if !self.json {
                let _ = writeln!(text, "\n{}: {} = {value} kg·m² written", file.display(), self.step);
            }
        }
        Ok(Answer { text, good: found.refused.is_none() })
    }

    fn options(&self) -> Options {
        Options {
            channel: self.channel.clone(),
            torque_constant: self.torque_constant,
            rated_torque_nm: self.rated_torque,
            base_speed_rpm: self.base_speed,
            saturation_nm: self.saturation,
            takeup_s: self.takeup,
            own: [self.own, self.own_uncertainty],
            target: self.target / 100.0,
            process_step: match self.step {
                Scope::Program => 0,
                Scope::Step(step) => i32::from(step),
            },
        }
    }

    fn text(&self, found: &Found) -> String {
        let r = &found.report;
        let source = match (self.torque_constant, self.rated_torque, &found.torque_column) {
            (Some(constant), _, column) => format!("{column} × {constant} N·m/A"),
            (_, Some(rated), column) => format!("{column} of {rated} N·m"),
            (_, _, column) if column.contains(".torque_command_") => {
                format!("{column}: asked for, not delivered; a motor that gave less is not seen")
            }
            (_, _, column) => column.clone(),
        };
        let mut text = format!("{}, torque from {source}\n", self.recording.display());
        let blocks = format!("{} stretches of {} ms", r.blocks_used, number(1e3 * found.block_s, 3));
        let _ = writeln!(
            text,
            "  {blocks} fitted, {} dropped as outliers, {} left out; scatter {} N·m\n",
            r.blocks_dropped,
            r.blocks_left_out,
            number(r.scatter_nm, 2)
        );
        if r.blocks_used > 0 {
            values(&mut text, r, self.own > 0.0);
        }
        if r.weakening_rpm > 0.0 {
            let rpm = r.weakening_rpm;
            let _ =
                writeln!(text, "  above {rpm:.0} rpm torque and motion no longer agree (weakened field?): left out");
        }
        if r.saturation_nm > 0.0 {
            let nm = number(r.saturation_nm, 3);
            let _ = writeln!(text, "  above {nm} N·m torque and motion no longer agree (saturation?): left out");
        }
        if let Some(why) = &found.refused {
            let _ = writeln!(text, "\nNot usable: {why}.");
        } else if self.saturation.is_none() && r.saturation_nm == 0.0 && r.one_acceleration == 1 {
            text += "\n  warning: one acceleration only: saturation cannot be excluded; use two accelerations, one at most two thirds of the\n";
            text += "  other, or say from which torque on the motor saturates (--saturation)\n";
        }
        if r.target_reached == 0 && r.ramp_acceleration_rpm_s > 0.0 {
            text += &self.advice(r);
        }
        text
    }

    fn advice(&self, r: &InertiaReport) -> String {
        let only = if r.both_ways == 0 { "This motion does not both speed up and slow down. " } else { "" };
        let torque = match r.ramp_torque_nm {
            nm if nm > 0.0 => format!(" (takes about {} N·m)", number(nm, 2)),
            _ => String::new(),
        };
        format!(
            "\n{only}For ±{} %: from {:.0} to {:.0} rpm and back at {} rpm/s{torque}, {} times.\n",
            number(self.target, 3),
            r.ramp_low_rpm,
            r.ramp_high_rpm,
            number(r.ramp_acceleration_rpm_s, 2),
            r.ramp_times.max(1)
        )
    }
}

fn values(text: &mut String, r: &InertiaReport, own: bool) {
    let mut line = |name: &str, value: f64, uncertainty: f64, unit: &str| {
        let _ = writeln!(text, "  {name:<18} {:>10} ± {:<9} {unit}", number(value, 4), number(uncertainty, 2));
    };
    line("inertia", r.total_kg_m2, r.total_uncertainty_kg_m2, "kg·m²");
    if own {
        line("of it workpiece", r.workpiece_kg_m2, r.workpiece_uncertainty_kg_m2, "kg·m²");
    }
    line("Coulomb friction", r.coulomb_nm, r.coulomb_uncertainty_nm, "N·m");
    line("viscous friction", r.viscous_nm_s, r.viscous_uncertainty_nm_s, "N·m·s/rad");
    let naive = number(r.naive_kg_m2, 4);
    let _ = writeln!(text, "  (torque ÷ acceleration alone, friction counted as inertia: {naive} kg·m²)");
}

fn as_json(found: &Found) -> serde_json::Result<String> {
    let r = &found.report;
    let value = |value: f64, uncertainty: f64| json!({ "value": value, "uncertainty": uncertainty });
    let known = |value: f64| if value > 0.0 { json!(value) } else { json!(null) };
    let answer = json!({
        "usable": found.refused.is_none(),
        "reason": found.refused.as_ref().map(ToString::to_string),
        "inertia_kg_m2": value(r.total_kg_m2, r.total_uncertainty_kg_m2),
        "workpiece_kg_m2": value(r.workpiece_kg_m2, r.workpiece_uncertainty_kg_m2),
        "coulomb_friction_nm": value(r.coulomb_nm, r.coulomb_uncertainty_nm),
        "viscous_friction_nm_s": value(r.viscous_nm_s, r.viscous_uncertainty_nm_s),
        "torque_over_acceleration_kg_m2": r.naive_kg_m2,
        "torque_from": found.torque_column,
        "process_step": r.process_step,
        "target_reached": r.target_reached != 0,
        "speeds_up_and_slows_down": r.both_ways != 0,
        "weakening_rpm": known(r.weakening_rpm),
        "saturation_nm": known(r.saturation_nm),
        "one_acceleration": r.one_acceleration != 0,
        "stretches": { "used": r.blocks_used, "dropped": r.blocks_dropped, "left_out": r.blocks_left_out,
                       "length_s": found.block_s, "scatter_nm": r.scatter_nm },
        "ramp_for_target": { "low_rpm": r.ramp_low_rpm, "high_rpm": r.ramp_high_rpm,
                             "acceleration_rpm_s": r.ramp_acceleration_rpm_s, "times": r.ramp_times,
                             "torque_nm": known(r.ramp_torque_nm) },
    });
    Ok(serde_json::to_string_pretty(&answer)? + "\n")
}

/// The workpiece's inertia to the digits that its uncertainty leaves: what goes into a program.
fn rounded(r: &InertiaReport) -> f64 {
    let digit = r.workpiece_uncertainty_kg_m2.log10().floor() - 1.0;
    let text = format!("{:.*}", (-digit).clamp(0.0, 12.0) as usize, r.workpiece_kg_m2);
    text.parse().unwrap_or(r.workpiece_kg_m2)
}

/// A number to so many digits, with an exponent where it is far from 1.
fn number(value: f64, digits: i32) -> String {
    if value == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    let exponent = value.abs().log10().floor() as i32;
    if !(-3..7).contains(&exponent) {
        return format!("{value:.*e}", usize::try_from(digits - 1).unwrap_or(0));
    }
    format!("{value:.*}", usize::try_from(digits - 1 - exponent).unwrap_or(0))
}
