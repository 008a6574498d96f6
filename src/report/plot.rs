//! Plots as SVG text, drawn by plotters: one or several panels below each other, many in two columns, each with title, units on
//! its axes, lines, points, bands and a legend. Colours are those of Okabe and Ito, which people with any colour vision tell apart.

use std::fmt;

use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// Colours of data, in the order in which to use them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Colour {
    /// The first thing to look at.
    Blue,
    /// The second, or what is opposed to it.
    Orange,
    /// A third.
    Green,
    /// A fourth.
    Purple,
    /// What is wrong, or beyond a limit.
    Red,
    /// What is in the background.
    Grey,
}

impl Colour {
    const fn rgb(self) -> RGBColor {
        match self {
            Colour::Blue => RGBColor(0, 114, 178),
            Colour::Orange => RGBColor(230, 126, 0),
            Colour::Green => RGBColor(0, 138, 100),
            Colour::Purple => RGBColor(170, 85, 140),
            Colour::Red => RGBColor(205, 60, 0),
            Colour::Grey => RGBColor(120, 120, 120),
        }
    }
}

/// Something drawn in a panel. Points are (x, y); those that are not finite break a line and are left out elsewhere.
#[derive(Debug, Clone, PartialEq)]
pub enum Mark {
    /// A line through the points.
    Line(Vec<(f64, f64)>),
    /// A dashed line through the points.
    Dashed(Vec<(f64, f64)>),
    /// A small dot at each point.
    Dots(Vec<(f64, f64)>),
    /// A point with a vertical bar: (x, y, half-height).
    Bars(Vec<(f64, f64, f64)>),
    /// A filled band: (x, low, high).
    Band(Vec<(f64, f64, f64)>),
    /// A filled column from zero to each point, so wide.
    Columns(Vec<(f64, f64)>, f64),
}

/// Marks of one colour under one name.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Name in the legend; empty for none.
    pub name: String,
    /// Colour of all its marks.
    pub colour: Colour,
    /// What is drawn, first below.
    pub marks: Vec<Mark>,
}

/// One plot.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Panel {
    /// What the plot shows, in bold above it.
    pub title: String,
    /// What it says, below the title.
    pub subtitle: String,
    /// Quantity and unit: `position / mm`.
    pub x_label: String,
    /// Whether x is the common logarithm of what the label names; the ticks then say the value itself.
    pub x_decades: bool,
    /// See `x_label`.
    pub y_label: String,
    /// The data, first below.
    pub series: Vec<Series>,
}

/// A picture could not be drawn.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PlotError(String);

impl fmt::Display for PlotError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the picture cannot be drawn: {}", self.0)
    }
}

impl std::error::Error for PlotError {}

/// Width and height of a panel that has the picture's width to itself, in pixels.
const WIDE: (u32, u32) = (960, 480);
/// The same of one of two beside each other, and from how many panels they are.
const NARROW: (u32, u32) = (720, 400);
const MANY: usize = 4;
const INK: RGBColor = RGBColor(40, 40, 40);
const RULE: RGBColor = RGBColor(225, 225, 225);
/// How much of its colour a band keeps.
const BAND: f64 = 0.18;
const FONT: &str = "Helvetica, Arial, sans-serif";

/// Draws the panels below each other; many of them row by row in two columns.
///
/// # Errors
/// A panel without a finite point.
pub fn svg(panels: &[Panel]) -> Result<String, PlotError> {
    let mut text = String::new();
    {
        let (columns, (width, height)) = if panels.len() < MANY { (1, WIDE) } else { (2, NARROW) };
        let rows = panels.len().div_ceil(columns).max(1);
        let size = (columns as u32 * width, u32::try_from(rows).unwrap_or(1) * height);
        let root = SVGBackend::with_string(&mut text, size).into_drawing_area();
        root.fill(&WHITE).map_err(failed)?;
        for (panel, area) in panels.iter().zip(root.split_evenly((rows, columns))) {
            draw(panel, &area)?;
        }
        root.present().map_err(failed)?;
    }
    Ok(text)
}

fn failed(why: impl fmt::Display) -> PlotError {
    PlotError(why.to_string())
}

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

fn draw(panel: &Panel, area: &Area) -> Result<(), PlotError> {
    let (x, y) = panel.ranges().ok_or_else(|| PlotError(format!("{} has no finite point", panel.title)))?;
    let left = Pos::new(HPos::Left, VPos::Top);
    let title = (FONT, 20).into_font().style(FontStyle::Bold).color(&INK).pos(left);
    area.draw_text(&panel.title, &title, (76, 14)).map_err(failed)?;
    let subtitle = (FONT, 15).into_font().color(&Colour::Grey.rgb()).pos(left);
    area.draw_text(&panel.subtitle, &subtitle, (76, 40)).map_err(failed)?;

    let mut chart = ChartBuilder::on(area)
        .margin_top(68)
        .margin_right(24)
        .margin_bottom(8)
        .margin_left(8)
        .x_label_area_size(48)
        .y_label_area_size(68)
        .build_cartesian_2d(x.0..x.1, y.0..y.1)
        .map_err(failed)?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(RULE)
        .axis_style(INK.stroke_width(1))
        .x_desc(panel.x_label.as_str())
        .y_desc(panel.y_label.as_str())
        .axis_desc_style((FONT, 15).into_font().color(&INK))
        .label_style((FONT, 14).into_font().color(&INK))
        .x_labels(8)
        .y_labels(7)
        .x_label_formatter(&|value| if panel.x_decades { of_decade(*value) } else { tick(*value, x.1 - x.0) })
        .y_label_formatter(&|value| tick(*value, y.1 - y.0))
        .draw()
        .map_err(failed)?;
    for series in &panel.series {
        add(&mut chart, series)?;
    }
    if panel.series.iter().any(|series| !series.name.is_empty()) {
        chart
            .configure_series_labels()
            .position(panel.emptiest_corner(x, y))
            .background_style(WHITE.mix(0.85))
            .border_style(RULE)
            .label_font((FONT, 14).into_font().color(&INK))
            .legend_area_size(26)
            .margin(8)
            .draw()
            .map_err(failed)?;
    }
    Ok(())
}

fn add(chart: &mut Chart, series: &Series) -> Result<(), PlotError> {
    let colour = series.colour.rgb();
    let last = series.marks.len().saturating_sub(1);
    for (i, mark) in series.marks.iter().enumerate() {
        let annotation = match mark {
            Mark::Line(points) => {
                let mut drawn = None;
                for piece in points.split(|p| !(p.0.is_finite() && p.1.is_finite())).filter(|piece| piece.len() > 1) {
                    drawn = Some(
                        chart.draw_series(LineSeries::new(piece.to_vec(), colour.stroke_width(2))).map_err(failed)?,
                    );
                }
                drawn
            }
            Mark::Dashed(points) => {
                let finite = points.iter().copied().filter(|p| p.0.is_finite() && p.1.is_finite());
                Some(chart.draw_series(DashedLineSeries::new(finite, 7, 5, colour.stroke_width(2))).map_err(failed)?)
            }
            Mark::Dots(points) => {
                let finite = points.iter().copied().filter(|p| p.0.is_finite() && p.1.is_finite());
                let dots = finite.map(|p| Circle::new(p, 2, colour.mix(0.6).filled()));
                Some(chart.draw_series(dots).map_err(failed)?)
            }
            Mark::Bars(points) => {
                let finite: Vec<_> = points.iter().copied().filter(|p| (p.0 + p.1 + p.2).is_finite()).collect();
                let bar = |p: &(f64, f64, f64)| {
                    PathElement::new(vec![(p.0, p.1 - p.2), (p.0, p.1 + p.2)], colour.stroke_width(2))
                };
                chart.draw_series(finite.iter().map(bar)).map_err(failed)?;
                Some(
                    chart
                        .draw_series(finite.iter().map(|p| Circle::new((p.0, p.1), 4, colour.filled())))
                        .map_err(failed)?,
                )
            }
            Mark::Band(points) => {
                let finite = || points.iter().filter(|p| (p.0 + p.1 + p.2).is_finite());
                let outline: Vec<(f64, f64)> =
                    finite().map(|p| (p.0, p.1)).chain(finite().rev().map(|p| (p.0, p.2))).collect();
                Some(chart.draw_series(std::iter::once(Polygon::new(outline, colour.mix(BAND)))).map_err(failed)?)
            }
            Mark::Columns(points, wide) => {
                let finite = points.iter().filter(|p| p.0.is_finite() && p.1.is_finite());
                let column = |p: &(f64, f64)| {
                    Rectangle::new([(p.0 - 0.5 * wide, 0.0), (p.0 + 0.5 * wide, p.1)], colour.filled())
                };
                Some(chart.draw_series(finite.map(column)).map_err(failed)?)
            }
        };
        if let (Some(annotation), true) = (annotation, i == last && !series.name.is_empty()) {
            let shade = if matches!(mark, Mark::Band(_)) { BAND } else { 1.0 };
            let key =
                move |(x, y): (i32, i32)| Rectangle::new([(x + 2, y - 2), (x + 22, y + 2)], colour.mix(shade).filled());
            // plotters guesses a text's width, and too small where a font is wide: two spaces give the legend room.
            annotation.label(format!("{}\u{a0}\u{a0}", series.name)).legend(key);
        }
    }
    Ok(())
}

impl Panel {
    fn points(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        let of_mark = |mark: &Mark| -> Vec<(f64, f64)> {
            match mark {
                Mark::Line(points) | Mark::Dashed(points) | Mark::Dots(points) => points.clone(),
                Mark::Bars(points) => points.iter().flat_map(|p| [(p.0, p.1 - p.2), (p.0, p.1 + p.2)]).collect(),
                Mark::Band(points) => points.iter().flat_map(|p| [(p.0, p.1), (p.0, p.2)]).collect(),
                Mark::Columns(points, wide) => {
                    points.iter().flat_map(|p| [(p.0 - wide, 0.0), (p.0 + wide, p.1)]).collect()
                }
            }
        };
        let marks = self.series.iter().flat_map(|series| &series.marks);
        marks.flat_map(of_mark).filter(|(x, y)| x.is_finite() && y.is_finite())
    }

    /// Ranges of the axes, with some air; `None` without a finite point.
    fn ranges(&self) -> Option<((f64, f64), (f64, f64))> {
        let over = |of: fn((f64, f64)) -> f64, air: f64| {
            let (low, high) = self
                .points()
                .map(of)
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
            let width = high - low;
            let margin = if width > 0.0 { air * width } else { 0.5 * high.abs().max(1e-3) };
            (low <= high).then_some((low - margin, high + margin))
        };
        Some((over(|p| p.0, 0.02)?, over(|p| p.1, 0.08)?))
    }

    /// The corner with the fewest points, where a legend hides least.
    fn emptiest_corner(&self, x: (f64, f64), y: (f64, f64)) -> SeriesLabelPosition {
        let share = |value: f64, range: (f64, f64)| (value - range.0) / (range.1 - range.0);
        let count = |right: bool, upper: bool| {
            let inside = |&(px, py): &(f64, f64)| {
                let (u, v) = (share(px, x), share(py, y));
                (if right { u > 0.65 } else { u < 0.35 }) && (if upper { v > 0.7 } else { v < 0.3 })
            };
            self.points().filter(inside).count()
        };
        [
            (count(true, true), SeriesLabelPosition::UpperRight),
            (count(false, true), SeriesLabelPosition::UpperLeft),
            (count(true, false), SeriesLabelPosition::LowerRight),
            (count(false, false), SeriesLabelPosition::LowerLeft),
        ]
        .into_iter()
        .min_by_key(|(points, _)| *points)
        .map_or(SeriesLabelPosition::UpperRight, |(_, corner)| corner)
    }
}

/// A tick of a logarithmic axis: two digits of the value.
fn of_decade(exponent: f64) -> String {
    let decimals = (1.0 - exponent.floor()).clamp(0.0, 9.0) as usize;
    let text = format!("{:.decimals$}", 10f64.powf(exponent));
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// A tick's number with as many decimals as the range needs, and a true minus.
fn tick(value: f64, range: f64) -> String {
    let decimals = (1.0 - (range / 5.0).log10()).floor().clamp(0.0, 9.0) as usize;
    let text = format!("{value:.decimals$}");
    // A tick that rounds to zero has no sign.
    if value.abs() < 0.5 * 10f64.powi(-(decimals as i32)) { text.replace('-', "") } else { text.replace('-', "−") }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn panel(points: Vec<(f64, f64)>) -> Panel {
        Panel {
            title: "A & B".into(),
            x_label: "position / mm".into(),
            y_label: "difference / µm".into(),
            series: vec![Series { name: "forward".into(), colour: Colour::Blue, marks: vec![Mark::Line(points)] }],
            ..Panel::default()
        }
    }

    #[test]
    fn says_what_it_shows() {
        let text = svg(&[panel(vec![(0.0, 1.0), (f64::NAN, 2.0), (1.0, 3.0), (2.0, 1.0)])]).unwrap();
        for part in ["A &amp; B", "position / mm", "difference / µm", "forward", "</svg>"] {
            assert!(text.contains(part), "{part}");
        }
        assert!(!text.contains("NaN"));
    }

    #[test]
    fn nothing_to_draw_is_an_error_and_one_point_is_not() {
        assert!(svg(&[panel(vec![(f64::NAN, 1.0)])]).unwrap_err().to_string().contains("A & B"));
        assert!(svg(&[panel(vec![(1.0, 1.0)])]).is_ok());
    }

    #[test]
    fn ticks_have_the_decimals_they_need() {
        assert_eq!(tick(-0.05, 0.3), "−0.05");
        assert_eq!(tick(150.0, 400.0), "150");
        assert_eq!(tick(-0.0, 4.0), "0.0");
        assert_eq!([-2.0, -0.5, 0.0, 0.5, 2.0].map(of_decade), ["0.01", "0.32", "1", "3.2", "100"]);
    }
}
