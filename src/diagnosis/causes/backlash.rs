//! Dead zone between motor and table. While the motor crosses it, where the load of the link turns, it carries neither the
//! table's inertia nor its friction; then the flanks meet. In table − encoder it is a step of the full width there.
//!
//! Where the flanks meet hard, a width that is a fifth off puts the impact at the wrong time: the table is simulated behind
//! the measured motor (`table_side`).

use super::*;

/// Least width that is looked for, load units: a fine encoder tells less than a micrometre, and behind a worm less than a thousandth of a
/// degree.
const LEAST: f64 = 3e-4;
/// A width over the one looked for before it, at most.
const NEXT: f64 = 1.6;

/// Parameters: full width in µm, shares of inertia and friction on the table's side, how stiff the flanks meet
/// in Hz. The trace has no coefficient.
pub static LAW: Law = Law {
    cause: Cause::Backlash,
    scales: &[
        Scale::Log(0.1, 2000.0),
        Scale::Linear(0.05, 0.9, 0.01),
        Scale::Linear(0.02, 0.98, 0.01),
        Scale::Log(100.0, 2000.0),
    ],
    starts: |frame, _| {
        // A width that is a fifth off meets the flanks at the wrong time and explains little.
        let least = least_width(frame).max(LEAST) * 1e3;
        let most = (10.0 * least).max(300.0);
        let count = (most / least).ln() / NEXT.ln();
        let widths = log_spaced(least, most, count.ceil() as usize + 1);
        widths.flat_map(of_width).collect()
    },
    manner: Manner {
        approached: true,
        valleys: |shape| shape.first().map_or_else(Vec::new, |width| of_width(*width).collect()),
        ..PLAIN
    },
    terms: Terms::Simulated(|_, shape| effect(shape)),
    effect: |frame, shape, _| {
        effect(shape).filter(|_| shape.first().is_some_and(|width| *width > 1e3 * least_width(frame)))
    },
    confused_with: &[Cause::PreslidingFriction, Cause::DriveCompliance],
    sentence: |effect, axis| match effect {
        Effect::Backlash { width_um, .. } => format!(
            "At each reversal the motor turns through {} {} of clearance before the table follows: nut, coupling or gearing has play.",
            say(*width_um),
            micro(axis)
        ),
        _ => String::new(),
    },
};

/// Width within which nothing is told, load units: a turn within three steps of the encoder is no crossing; what a scale has either way
/// is the mean of many.
fn least_width(frame: &Frame) -> f64 {
    if frame.columns.table.is_some() { frame.grid } else { 3.0 * frame.grid }
}

/// Starts with a width.
fn of_width(width: f64) -> impl Iterator<Item = Vec<f64>> {
    let shares = [0.33, 0.52].into_iter().flat_map(|table| [0.3, 0.5, 0.67, 0.84].map(|friction| (table, friction)));
    shares.map(move |(table, friction)| vec![width, table, friction, 700.0])
}

fn effect(shape: &[f64]) -> Option<Effect> {
    Effect::from_values(Cause::Backlash, shape)
}
