//! The chart of spindle speed variation: which amplitude the motor can do in which period, exact beside published.

use super::plot::{Colour, Mark, Panel, PlotError, Series, svg};
use crate::cycle::speed_variation::limit::{Limit, Motor, Wave};
use crate::units::rpm_from_rad_s;

/// One point of the chart; SI units, amplitudes as shares.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Period, s.
    pub period: f64,
    /// Largest amplitude, and what limits it.
    pub exact: (f64, Limit),
    /// Largest amplitude as published.
    pub published: f64,
    /// Power at the top of the published swing over the motor's.
    pub drawn: f64,
}

/// The chart at a mean speed (rad/s) for these periods (s).
#[must_use]
pub fn points(motor: &Motor, wave: Wave, mean: f64, periods: &[f64]) -> Vec<Point> {
    let point = |period: f64| {
        let published = motor.published_amplitude(mean, period).min(1.0);
        let drawn = motor.demand(wave, mean, published, period).1 / motor.power;
        Point { period, exact: motor.amplitude(wave, mean, period), published, drawn }
    };
    periods.iter().map(|period| point(*period)).collect()
}

/// Draws the chart as SVG: amplitude over period, and what the published amplitude would draw.
///
/// # Errors
/// When there is nothing to draw.
pub fn picture(motor: &Motor, wave: Wave, mean: f64, recommended: (f64, f64)) -> Result<String, PlotError> {
    const POINTS: i32 = 120;
    let periods: Vec<f64> = (1..=POINTS).map(|i| 4.0 * f64::from(i) / f64::from(POINTS)).collect();
    let points = points(motor, wave, mean, &periods);
    let line = |of: fn(&Point) -> f64| vec![Mark::Line(points.iter().map(|p| (p.period, of(p))).collect())];
    let series = |name: &str, colour, marks| Series { name: name.into(), colour, marks };
    let amplitude = Panel {
        title: format!("Speed variation at {:.0} rpm, {:.4} kg·m²", rpm_from_rad_s(mean), motor.inertia),
        subtitle: "largest amplitude of the motor; above the line its power, torque or speed does not suffice".into(),
        x_label: "period / s".into(),
        x_decades: false,
        y_label: "amplitude / %".into(),
        series: vec![
            series("published", Colour::Orange, line(|p| 100.0 * p.published)),
            series("exact", Colour::Blue, line(|p| 100.0 * p.exact.0)),
            series("recommended", Colour::Green, vec![Mark::Bars(vec![(recommended.1, 100.0 * recommended.0, 1.0)])]),
        ],
    };
    let power = Panel {
        title: "Power at the top of the swing".into(),
        subtitle: "over the motor's power, with friction and cutting".into(),
        x_label: "period / s".into(),
        x_decades: false,
        y_label: "power / motor's power".into(),
        series: vec![
            series("published", Colour::Orange, line(|p| p.drawn)),
            series("limit", Colour::Grey, line(|_| 1.0)),
        ],
    };
    svg(&[amplitude, power])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::rad_s_from_rpm;

    #[test]
    fn both_formulas_are_on_the_chart() {
        let motor = Motor { inertia: 0.5, power: 1e4, torque: 1e9, speeds: [0.0, 1e4], used: 0.0, viscous: 0.0 };
        let mean = rad_s_from_rpm(1000.0);
        let point = points(&motor, Wave::Triangle, mean, &[2.0])[0];
        assert!((point.exact.0 - 0.578).abs() < 1e-3 && (point.published - 0.9).abs() < 1e-9);
        assert!((point.drawn - 1.876).abs() < 1e-3);
        let svg = picture(&motor, Wave::Triangle, mean, (0.1, 0.2)).unwrap();
        assert!(svg.contains("published") && svg.contains("exact") && svg.contains("recommended"));
    }
}
