//! The picture of an inertia measurement: what accelerates the spindle, and what friction takes, as the blocks show them.

use super::plot::{Colour, Mark, Panel, PlotError, Series, svg};
use crate::analysis::inertia::Found;
use crate::cycle::inertia::blocks::Block;
use crate::units::{rad_s_from_rpm, rpm_from_rad_s};

/// Draws, as SVG, the torque without friction over the acceleration, whose slope is the inertia, and the torque without
/// inertia over the speed, which is friction.
///
/// # Errors
/// When there is nothing to draw.
pub fn picture(found: &Found) -> Result<String, PlotError> {
    let r = &found.report;
    let friction = |speed: f64| r.viscous_nm_s * speed + r.coulomb_nm * speed.signum() + r.constant_nm;
    let dots = |of: &dyn Fn(&Block) -> (f64, f64)| Mark::Dots(found.blocks.iter().map(of).collect());
    let series = |name: &str, colour, mark| Series { name: name.into(), colour, marks: vec![mark] };
    let (slowest, strongest) = range(found, |b| b.acceleration);
    let ends = [slowest.min(0.0), 0.0, strongest.max(0.0)];
    let rpm_s = rpm_from_rad_s;
    let [least, value, most] = [-1.0, 0.0, 1.0].map(|side| r.total_kg_m2 + side * r.total_uncertainty_kg_m2);
    let acceleration = Panel {
        title: format!("Inertia {} kg·m², ± {} (95 %)", short(value), short(r.total_uncertainty_kg_m2)),
        subtitle: "a dot: one stretch of the recording, its friction taken off; the slope is the inertia".into(),
        x_label: "acceleration / rpm/s".into(),
        x_decades: false,
        y_label: "torque that accelerates / N·m".into(),
        series: vec![
            series("interval", Colour::Blue, Mark::Band(ends.map(|a| (rpm_s(a), least * a, most * a)).to_vec())),
            series(
                "torque − friction",
                Colour::Orange,
                dots(&|b| (rpm_s(b.acceleration), b.torque - friction(b.speed))),
            ),
            series("inertia × acceleration", Colour::Blue, Mark::Line(ends.map(|a| (rpm_s(a), value * a)).to_vec())),
        ],
    };
    let (low, high) = range(found, |b| b.speed);
    let speeds: Vec<f64> = (0..=100).map(|i| low + (high - low) * f64::from(i) / 100.0).collect();
    // Coulomb friction changes its sense at standstill: the line is broken there.
    let line =
        speeds.iter().map(|s| (rpm_from_rad_s(*s), if crosses(low, high, *s) { f64::NAN } else { friction(*s) }));
    let speed = Panel {
        title: format!("Friction: {} N·m and {} N·m·s/rad", short(r.coulomb_nm), short(r.viscous_nm_s)),
        subtitle: "the same stretches, inertia × acceleration taken off".into(),
        x_label: "speed / rpm".into(),
        x_decades: false,
        y_label: "torque that friction takes / N·m".into(),
        series: vec![
            series(
                "torque − inertia",
                Colour::Orange,
                dots(&|b| (rpm_from_rad_s(b.speed), b.torque - value * b.acceleration)),
            ),
            series("Coulomb and viscous friction", Colour::Blue, Mark::Line(line.collect())),
        ],
    };
    svg(&[acceleration, speed])
}

/// Whether a speed is one around which a range that holds both senses changes from one to the other.
fn crosses(low: f64, high: f64, speed: f64) -> bool {
    low < 0.0 && high > 0.0 && speed.abs() < rad_s_from_rpm(1.0).max(0.01 * (high - low))
}

fn range(found: &Found, of: fn(&Block) -> f64) -> (f64, f64) {
    found.blocks.iter().map(of).fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)))
}

/// Three digits, with an exponent where a number is small.
fn short(value: f64) -> String {
    if value != 0.0 && value.abs() < 1e-3 { format!("{value:.2e}") } else { format!("{value:.4}") }
}
