//! The picture of a homing: torque against position at the stop, and where the line starts.

use super::plot::{Colour, Mark, Panel, PlotError, Series, svg};
use crate::analysis::homing::Found;

/// Draws, as SVG, the torque of every touch near the stop, level and line, the contact point and the plain threshold.
///
/// # Errors
/// When there is nothing to draw.
pub fn picture(found: &Found) -> Result<String, PlotError> {
    let mean = &found.mean;
    let (unit, fine) = if found.unit == "mm" { ("mm", "µm") } else { ("°", "°/1000") };
    let (word, effort) = if found.effort_unit == "nm" { ("Torque", "N·m") } else { ("Force", "N") };
    // Ways beyond the contact point, toward the stop.
    let beyond = |position: f64| 1e3 * found.direction * (position - mean.contact_mm);
    let press = mean.press_um;
    let shown = -3.0 * press..2.0 * press;
    let dots = |curve: &[(f64, f64)]| {
        Mark::Dots(curve.iter().map(|(x, t)| (beyond(*x), *t)).filter(|(x, _)| shown.contains(x)).collect())
    };
    let series = |name: &str, colour, marks| Series { name: name.into(), colour, marks };
    let top = mean.sliding_nm + 1e-3 * mean.stiffness_nm_mm * press;
    let upright = |x: f64| vec![Mark::Dashed(vec![(x, 0.0), (x, found.limit)])];
    let panel = Panel {
        title: format!("{word} at the stop, axis {}", found.channel.to_uppercase()),
        subtitle: format!(
            "contact at {:.4} {unit} ± {:.2} {fine} (k = 2) from {} touches; the plain threshold is {:.1} {fine} further",
            mean.contact_mm,
            mean.uncertainty_um,
            found.touches.iter().filter(|touch| touch.contact.is_ok()).count(),
            beyond(mean.threshold_mm),
        ),
        x_label: format!("way beyond the contact point / {fine}"),
        x_decades: false,
        y_label: format!("{} toward the stop / {effort}", word.to_lowercase()),
        series: vec![
            series("touches", Colour::Grey, found.touches.iter().map(|touch| dots(&touch.curve)).collect()),
            series(
                "level and line",
                Colour::Blue,
                vec![Mark::Line(vec![(shown.start, mean.sliding_nm), (0.0, mean.sliding_nm), (press, top)])],
            ),
            series("contact point", Colour::Green, upright(0.0)),
            series("plain threshold", Colour::Orange, upright(beyond(mean.threshold_mm))),
        ],
    };
    svg(&[panel])
}
