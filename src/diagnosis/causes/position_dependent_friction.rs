//! A tight spot, or a stretch of the stroke on which friction is another: peak·exp(−|(x − centre)/width|ⁿ)·sign(v), the same
//! resistance both ways. A bell (n = 2) unless the recording says otherwise.

use super::*;

/// Exponent of a bell, of a stretch whose ends are plainly seen, and the largest: a sixtieth of the width from within to without.
const BELL: f64 = 2.0;
const STRETCH: f64 = 6.0;
const STEEPEST: f64 = 60.0;

/// Mean of the form over the stroke from which on it is friction everywhere, with a place where there is less.
const MOST_OF_STROKE: f64 = 0.75;

/// Correlation of the forms of two spots from which on they are in one place: bells that lie 0.46 widths apart, or of which one is twice
/// as wide as the other, correlate by 0.9.
const SAME_PLACE: f64 = 0.9;

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

/// A spot of size 1 at a share of the stroke.
fn form(shape: &[f64], at: f64) -> f64 {
    (-((at - shape[0]).abs() / shape[1]).powf(shape[2])).exp()
}

/// Mean over the stroke of a spot of size 1.
fn mean(shape: &[f64]) -> f64 {
    const PLACES: u32 = 64;
    (0..PLACES).map(|i| form(shape, (f64::from(i) + 0.5) / f64::from(PLACES))).sum::<f64>() / f64::from(PLACES)
}

/// Whether spots are the same but for their size: their forms go together.
#[must_use]
pub fn is_same_place(one: &[f64], other: &[f64]) -> bool {
    const PLACES: i32 = 400;
    let products = |a: &[f64], b: &[f64]| -> f64 {
        // The stroke, and as much beyond each end as a spot may be wide.
        (-PLACES..=2 * PLACES).map(|i| f64::from(i) / f64::from(PLACES)).map(|at| form(a, at) * form(b, at)).sum()
    };
    products(one, other) > SAME_PLACE * (products(one, one) * products(other, other)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bells of one width correlate by exp(−d²/2), d widths apart; in one place by √(2r/(1 + r²)), one r times as wide.
    #[test]
    fn spots_in_one_place_are_told_from_others() {
        let bell = [0.4, 0.1, BELL];
        for (beside, same) in [(0.0, true), (0.4, true), (0.52, false), (-0.52, false), (3.0, false)] {
            assert_eq!(is_same_place(&bell, &[0.4 + 0.1 * beside, 0.1, BELL]), same, "{beside} widths beside");
        }
        for (wider, same) in [(1.8, true), (2.15, false), (0.55, true), (0.45, false)] {
            assert_eq!(is_same_place(&bell, &[0.4, 0.1 * wider, BELL]), same, "{wider} times as wide");
        }
    }
}
