//! The picture of a diagnosis: the residual before and after against everything it may go with.

use super::plot::{Colour, Mark, Panel, PlotError, Series, svg};
use crate::diagnosis::{Coordinate, Diagnosis, View};

/// Draws the residual against every coordinate as SVG, one panel each, first those that most of it goes with.
///
/// # Errors
/// The diagnosis shows nothing: the recording did not suffice.
pub fn picture(diagnosis: &Diagnosis) -> Result<String, PlotError> {
    let mut views: Vec<&View> = diagnosis.shown.iter().collect();
    views.sort_by(|a, b| b.before.total_cmp(&a.before));
    let panels: Vec<Panel> = views.into_iter().map(|view| panel(diagnosis, view)).collect();
    svg(&panels)
}

fn panel(diagnosis: &Diagnosis, view: &View) -> Panel {
    let drive = diagnosis.extended.drive;
    let unit = if drive.is_linear() { "N" } else { "N·m" };
    let load = if drive.is_rotary() { "°" } else { "mm" };
    let spectrum = view.coordinate == Coordinate::Frequency;
    let named = !diagnosis.findings.is_empty();
    let share = |share: f64| format!("{:.0} %", 100.0 * share);
    let goes = if named {
        format!("{} of the variance as believed, {} of what is left", share(view.before), share(view.after))
    } else {
        format!("{} of the variance", share(view.before))
    };
    let x_label = match view.coordinate {
        Coordinate::Position => format!("position / {load}"),
        Coordinate::Velocity => format!("velocity / {load}/s"),
        Coordinate::Direction => "direction".to_owned(),
        Coordinate::Acceleration => format!("acceleration / {load}/s²"),
        Coordinate::Time => "time / s".to_owned(),
        Coordinate::SinceReversal => format!("travel since the reversal / {load}"),
        Coordinate::Frequency => "frequency / Hz".to_owned(),
    };
    let x_decades = spectrum || view.coordinate == Coordinate::SinceReversal;
    let at = |x: f64| if x_decades { x.log10() } else { x };
    // A direction is one of two: a column up to its mean for each, side by side.
    let line = |name: &str, colour, aside: f64, pick: fn(&(f64, f64, f64)) -> f64| {
        let points = view.curve.iter().map(|p| (at(p.0), pick(p)));
        let marks = if view.coordinate == Coordinate::Direction {
            vec![Mark::Columns(points.map(|(x, y)| (x + aside, y)).collect(), 0.1)]
        } else {
            vec![Mark::Line(points.collect())]
        };
        Series { name: name.into(), colour, marks }
    };
    let mut series = vec![line("as believed", Colour::Orange, if named { -0.06 } else { 0.0 }, |p| p.1)];
    if named {
        series.push(line("with the causes named", Colour::Blue, 0.06, |p| p.2));
    }
    Panel {
        title: format!(
            "Residual {} by {}, axis {}",
            drive.torque_word(),
            view.coordinate.name(),
            diagnosis.extended.name.to_uppercase()
        ),
        subtitle: format!("goes with it: {goes}"),
        x_label,
        x_decades,
        y_label: format!("{} / {unit}", if spectrum { "amplitude" } else { "mean residual" }),
        series,
    }
}
