//! The picture of lost motion: motor minus table along the stroke, both ways, and what each reversal loses.

use super::plot::{Colour, Mark, Panel, PlotError, Series, svg};
use crate::analysis::lost_motion::from_positions::{LostMotion, Trace};
use crate::analysis::lost_motion::from_torque::TorqueLostMotion;

/// Draws a result as SVG. Lengths in mm and µm, angles in degrees.
///
/// # Errors
/// When the result holds nothing to draw.
pub fn picture(found: &LostMotion) -> Result<String, PlotError> {
    let display = Display::new(found.unit, found.lost_motion.uncertainty);
    svg(&[differences(found, &display), along_the_stroke(found, &display)])
}

/// How lost motion is shown for a position unit.
pub struct Display {
    /// Factor from the unit of the result.
    pub factor: f64,
    /// Unit of the lost motion.
    pub unit: &'static str,
    /// Decimals of the lost motion.
    pub decimals: usize,
}

impl Display {
    /// µm for lengths, degrees for angles; two digits of the uncertainty. `unit` is `mm` or `deg`, as the uncertainty.
    #[must_use]
    pub fn new(unit: &str, uncertainty: f64) -> Self {
        let (factor, unit, most) = if unit == "mm" { (1e3, "µm", 3) } else { (1.0, "°", 6) };
        let digit = (factor * uncertainty).log10().floor();
        let decimals =
            if digit.is_finite() { (1.0 - digit).clamp(0.0, f64::from(most)) as usize } else { most as usize };
        Display { factor, unit, decimals }
    }

    /// A lost motion in that unit.
    #[must_use]
    pub fn number(&self, value: f64) -> String {
        // Adding zero turns a negative zero into zero.
        let step = 10f64.powi(self.decimals as i32);
        format!("{:.*}", self.decimals, (self.factor * value * step).round() / step + 0.0)
    }
}

fn differences(found: &LostMotion, display: &Display) -> Panel {
    let line = |trace: &Trace| {
        Mark::Line(trace.position.iter().zip(&trace.difference).map(|(x, d)| (*x, display.factor * d)).collect())
    };
    let way = |direction: i8, name: &str, colour| Series {
        name: name.into(),
        colour,
        marks: found.traces.iter().filter(|trace| trace.direction == direction).map(line).collect(),
    };
    Panel {
        title: format!("Motor minus table, axis {}", found.channel.to_uppercase()),
        subtitle: format!(
            "lost motion {} ± {} {} (k = 2) from {} of {} reversals",
            display.number(found.lost_motion.value),
            display.number(found.lost_motion.uncertainty),
            display.unit,
            found.reversals.iter().filter(|reversal| reversal.lost_motion.is_some()).count(),
            found.reversals.len()
        ),
        x_label: format!("motor position / {}", found.unit),
        x_decades: false,
        y_label: format!("motor − table / {}", display.unit),
        series: vec![way(1, "positive direction", Colour::Blue), way(-1, "negative direction", Colour::Orange)],
    }
}

fn along_the_stroke(found: &LostMotion, display: &Display) -> Panel {
    let scaled = |value: f64| display.factor * value;
    let (low, high) = found
        .stretches
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), s| (low.min(s.from), high.max(s.to)));
    let (value, uncertainty) = (scaled(found.lost_motion.value), scaled(found.lost_motion.uncertainty));
    let points = found
        .stretches
        .iter()
        .map(|s| (0.5 * (s.from + s.to), scaled(s.lost_motion.value), scaled(s.lost_motion.uncertainty)));
    Panel {
        title: "Lost motion along the stroke".into(),
        subtitle: "each stretch with its uncertainty, and the mean with its band (k = 2)".into(),
        x_label: format!("motor position / {}", found.unit),
        x_decades: false,
        y_label: format!("lost motion / {}", display.unit),
        series: vec![
            Series {
                name: "mean of the reversals".into(),
                colour: Colour::Green,
                marks: vec![
                    Mark::Band([low, high].map(|x| (x, value - uncertainty, value + uncertainty)).to_vec()),
                    Mark::Line([low, high].map(|x| (x, value)).to_vec()),
                ],
            },
            Series {
                name: "stretch of the stroke".into(),
                colour: Colour::Blue,
                marks: vec![Mark::Bars(points.collect())],
            },
        ],
    }
}

/// Draws torque against travel since each reversal, with what the fit made of it, as SVG.
///
/// # Errors
/// When the result holds nothing to draw.
pub fn torque_picture(found: &TorqueLostMotion) -> Result<String, PlotError> {
    let mean = &found.mean;
    let display = Display::new(found.unit, mean.lost_motion.uncertainty);
    let (word, quantity, unit) =
        if found.effort_unit == "nm" { ("Torque", "torque", "N·m") } else { ("Force", "force", "N") };
    let way = |direction: i8, name: &str, colour| {
        let curves = found.reversals.iter().filter(|r| r.direction == direction && r.result.is_ok());
        let scaled = |curve: &[(f64, f64)]| curve.iter().map(|(s, t)| (display.factor * s, *t)).collect();
        Series { name: name.into(), colour, marks: curves.map(|r| Mark::Line(scaled(&r.curve))).collect() }
    };
    let panel = Panel {
        title: format!("{word} after a reversal, axis {}", found.channel.to_uppercase()),
        subtitle: format!(
            "lost motion estimated from torque {} ± {} {u} (k = 2) = clearance {} {u} + wind-up {} {u}",
            display.number(mean.lost_motion.value),
            display.number(mean.lost_motion.uncertainty),
            display.number(mean.clearance),
            display.number(mean.windup),
            u = display.unit
        ),
        x_label: format!("motor travel since the reversal / {}", display.unit),
        x_decades: false,
        y_label: format!("{quantity} in the new direction / {unit}"),
        series: vec![way(1, "turning to positive", Colour::Blue), way(-1, "turning to negative", Colour::Orange)],
    };
    svg(&[panel])
}
