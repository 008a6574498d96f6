//! `gib speed-variation`: which spindle speed variation a motor can do, as table and chart.

use std::fmt::Write;
use std::path::PathBuf;

use clap::Args;
use gib::cycle::speed_variation::config::SpeedVariationConfig;
use gib::cycle::speed_variation::limit::Limit;
use gib::cycle::speed_variation::plan::Plan;
use gib::program::{self, Scope};
use gib::report::speed_variation::{picture, points};
use serde_json::json;

use super::outputs::Outputs;
use super::table::Table;
use super::{Answer, Result};

/// Shows which spindle speed variation the motor can do: amplitudes, periods, recommended values, the published limit
///
/// The inertia is given, or read as INA from the head of a part program. The exact limit keeps torque and power within the
/// motor's at every moment; the published one (CN103769945) holds at the mean speed only and is shown beside it.
#[derive(Args)]
pub struct SpeedVariationCommand {
    /// Mean spindle speed, rpm
    #[arg(long, value_name = "RPM")]
    speed: f64,
    /// Largest power of the motor, W
    #[arg(long, value_name = "W")]
    power: f64,
    /// Inertia of the workpiece, kg·m²
    #[arg(long, value_name = "KG_M2", required_unless_present = "program")]
    inertia: Option<f64>,
    /// Take the inertia from INA in the head of this part program
    #[arg(long, value_name = "FILE", conflicts_with = "inertia")]
    program: Option<PathBuf>,
    /// INA of this process step; 0 for the whole program's
    #[arg(long, value_name = "N", default_value = "0", value_parser = super::program::scope)]
    step: Scope,
    /// The machine's own inertia (spindle, rotor), kg·m²
    #[arg(long, value_name = "KG_M2", default_value_t = 0.0)]
    own: f64,
    /// Largest torque of the motor, N·m; not limited if not given
    #[arg(long, value_name = "NM", default_value_t = 0.0)]
    torque: f64,
    /// Highest speed allowed, rpm
    #[arg(long, value_name = "RPM", default_value_t = 0.0)]
    speed_max: f64,
    /// Coulomb friction of the spindle, N·m
    #[arg(long, value_name = "NM", default_value_t = 0.0)]
    coulomb: f64,
    /// Viscous friction of the spindle, N·m·s/rad
    #[arg(long, value_name = "NM_S", default_value_t = 0.0)]
    viscous: f64,
    /// Torque that cutting uses, N·m
    #[arg(long, value_name = "NM", default_value_t = 0.0)]
    cutting: f64,
    /// Vary as a sine; a triangle otherwise
    #[arg(long)]
    sine: bool,
    /// Frequency of the chatter, Hz, for the recommended values
    #[arg(long, value_name = "HZ", default_value_t = 0.0)]
    chatter: f64,
    /// Answer as JSON
    #[arg(long)]
    json: bool,
    /// Write the chart
    #[arg(long, value_name = "OUT.svg")]
    plot: Option<PathBuf>,
}

const PERIODS: [f64; 8] = [0.1, 0.2, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0];

impl SpeedVariationCommand {
    /// Computes and tells.
    pub fn run(&self) -> Result {
        let mut outputs = Outputs::beside(&[("--program", self.program.as_deref())]);
        outputs.add("--plot", self.plot.as_deref())?;
        let inertia = self.inertia()?;
        let plan = Plan::new(&SpeedVariationConfig {
            waveform: i32::from(self.sine),
            speed_rpm: self.speed,
            inertia_kg_m2: inertia,
            own_inertia_kg_m2: self.own,
            power_w: self.power,
            torque_nm: self.torque,
            speed_max_rpm: self.speed_max,
            coulomb_nm: self.coulomb,
            viscous_nm_s: self.viscous,
            cutting_nm: self.cutting,
            chatter_hz: self.chatter,
            ..SpeedVariationConfig::default()
        })
        .map_err(|fault| {
            let field = fault.field.trim_end_matches('\0');
            format!("{field} is {}; allowed is {} to {}", fault.value, fault.low, fault.high)
        })?;
        let motor = plan.motor_cutting(plan.cutting);
        let recommended = motor.recommended(plan.wave, plan.mean, plan.chatter_hz);
        if self.plot.is_some() {
            outputs.picture("--plot", &picture(&motor, plan.wave, plan.mean, recommended)?)?;
        }
        let points = points(&motor, plan.wave, plan.mean, &PERIODS);
        let possible = recommended.0 > 0.0;
        if self.json {
            let rows = points.iter().map(|p| {
                json!({ "period_s": p.period, "amplitude_ratio": p.exact.0, "limited_by": word(p.exact.1),
                        "published_amplitude_ratio": p.published, "published_power_ratio": p.drawn })
            });
            let answer = json!({
                "inertia_kg_m2": motor.inertia,
                "recommended": { "amplitude_ratio": recommended.0, "period_s": recommended.1 },
                "chart": rows.collect::<Vec<_>>(),
            });
            return Ok(Answer { text: serde_json::to_string_pretty(&answer)? + "\n", good: possible });
        }
        let mut table = Table::new(["period", "amplitude", "limited by", "published", "would draw"], 0);
        for p in &points {
            table.row([
                format!("{} s", p.period),
                format!("{:.1} %", 100.0 * p.exact.0),
                word(p.exact.1).to_owned(),
                format!("{:.1} %", 100.0 * p.published),
                format!("{:.2} of the power", p.drawn),
            ]);
        }
        let shape = if self.sine { "sine" } else { "triangle" };
        let mut text = format!("{} rpm, {} kg·m², {} W, {shape}\n", self.speed, motor.inertia, self.power);
        text += &table.text();
        let _ = if possible {
            writeln!(text, "\nRecommended: ±{:.1} % in {:.2} s", 100.0 * recommended.0, recommended.1)
        } else {
            writeln!(text, "\nFriction and cutting leave the motor nothing to vary the speed with.")
        };
        Ok(Answer { text, good: possible })
    }

    fn inertia(&self) -> std::result::Result<f64, Box<dyn std::error::Error>> {
        match (&self.program, self.inertia) {
            (_, Some(inertia)) => Ok(inertia),
            (Some(file), None) => match program::get(file, self.step)? {
                Some(entry) => Ok(entry.inertia_kg_m2),
                None => Err(format!("{}: no {} in its head; measure it first", file.display(), self.step).into()),
            },
            (None, None) => Err("give --inertia or --program".into()),
        }
    }
}

fn word(limit: Limit) -> &'static str {
    match limit {
        Limit::Power => "power",
        Limit::Torque => "torque",
        Limit::Speed => "speed",
        Limit::Nothing => "nothing left",
    }
}
