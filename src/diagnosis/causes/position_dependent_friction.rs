//! A tight spot, or a stretch of the stroke on which friction is another: peak·exp(−|(x − centre)/width|ⁿ)·sign(v), the same
//! resistance both ways. A bell (n = 2) unless the recording says otherwise.

use super::*;

/// Exponent of a bell, of a stretch whose ends are plainly seen, and the largest: a sixtieth of the width from within to without.
const BELL: f64 = 2.0;
const STRETCH: f64 = 6.0;
const STEEPEST: f64 = 60.0;

/// Mean of the form over the stroke from which on it is friction everywhere, with a place where there is less.
const MOST_OF_STROKE: f64 = 0.75;

/// Parameters: centre and width as shares of the stroke, and n. The coefficient is the peak.
pub static LAW: Law = Law {
    cause: Cause::PositionDependentFriction,
    // The bound of the width lets a stretch begin anywhere and reach beyond the stroke.
    scales: &[Scale::Linear(-0.1, 1.1, 5e-3), Scale::Log(0.01, 1.0), Scale::Form(1.0, STEEPEST, BELL)],
    starts: |_, _| {
        let spread = |width: f64, steepness: f64, count: u32| {
            (0..count).map(move |i| vec![(f64::from(i) + 0.5) / f64::from(count), width, steepness])
        };
        let bells = [(0.03, 24), (0.07, 14), (0.15, 8)].into_iter().flat_map(|(w, count)| spread(w, BELL, count));
        // A change that lasts to the end of the stroke.
        let lasting = (1..10).flat_map(|i| [0.0, 1.0].map(|end| vec![end, 0.1 * f64::from(i), STRETCH]));
        bells.chain(lasting).collect()
    },
    manner: PLAIN,
    terms: Terms::ByRows(|frame, shapes| {
        each(shapes, |shape| {
            let (centre, width) = place(frame, shape);
            let per = 1.0 / width;
            Term::torque(frame.fading_by(&frame.x, shape[2], move |x| (x - centre) * per))
        })
    }),
    effect: |frame, shape, c| {
        let (centre_mm, width_mm) = place(frame, shape);
        let peak = *c.first()?;
        let found = Effect::PositionDependentFriction { centre_mm, peak, width_mm, steepness: shape[2] };
        (peak > -1.2 * frame.belief.coulomb && mean(shape) < MOST_OF_STROKE).then_some(found)
    },
    confused_with: &[Cause::Cogging, Cause::CoulombFrictionMismatch, Cause::CableForce],
    sentence: |effect, axis| match effect {
        Effect::PositionDependentFriction { centre_mm, peak, width_mm, steepness } => {
            let place = if *steepness < STRETCH {
                format!("Around {} {} (±{})", say(*centre_mm), load(axis), say(*width_mm))
            } else {
                format!("From {} to {} {}", say(centre_mm - width_mm), say(centre_mm + width_mm), load(axis))
            };
            let more = if *peak > 0.0 { "higher" } else { "lower" };
            let by = format!("{} {}", say(peak.abs()), unit(axis));
            format!("{place} friction is {by} {more} in both directions: look at the guideway there.")
        }
        _ => String::new(),
    },
};

fn place(frame: &Frame, shape: &[f64]) -> (f64, f64) {
    let (low, high) = frame.stroke();
    (low + shape[0] * (high - low), shape[1] * (high - low))
}

/// Mean over the stroke of a spot of size 1.
fn mean(shape: &[f64]) -> f64 {
    const PLACES: u32 = 64;
    let distance = |i: u32| ((f64::from(i) + 0.5) / f64::from(PLACES) - shape[0]).abs() / shape[1];
    (0..PLACES).map(|i| (-distance(i).powf(shape[2])).exp()).sum::<f64>() / f64::from(PLACES)
}
