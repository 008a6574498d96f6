//! What a run says without a stretch of it.
//!
//! A torque that is dead, of another scale or a load's for a time can look like another inertia with another friction, of which
//! the scatter about the fit tells little: least squares share what is wrong out among all terms. So each stretch of time, up to
//! half of the run, is left out in turn. By chance the rest differs from the whole by the difference of their variances
//! (Hausman 1978); where it differs by clearly more, that much of the value rests on this stretch alone, and is not known.

use super::robust::{Regression, Rows, Sums, Terms};

/// Stretches that a run is cut into, of which neighbours are left out together.
const STRETCHES: usize = 16;
/// Standard deviations beyond which a difference is not chance.
const CLEAR: f64 = 4.0;
/// A rest whose variance is so many times that of the whole tells nothing of a term.
const WORSE: f64 = 100.0;
/// Least share of its variance that a stretch is taken to add to a term.
const LEAST: f64 = 0.01;

/// By how much each term changes without the stretch on which it rests most, where that is clear; else 0.
#[must_use]
pub fn rests_on_one(rows: &Rows, found: &Regression) -> Terms {
    let mut most = Terms::zeros();
    let Some(stretches) = rows.in_stretches::<STRETCHES>() else { return most };
    // What hangs together varies more than what scatters for itself.
    let scatter = found.scatter.powi(2) * found.inverse;
    let together = found.variance.zip_map(&scatter, |all, alone| if alone > 0.0 { all / alone } else { 1.0 });
    for first in 0..STRETCHES {
        for end in first + 1..=STRETCHES.min(first + STRETCHES / 2) {
            let kept = |i: &usize| !(first..end).contains(i);
            let rest = (0..STRETCHES)
                .filter(kept)
                .filter_map(|i| stretches.get(i))
                .fold(Sums::default(), |sum, one| sum.and(one));
            let Some((terms, inverse, variance)) = rest.plain(rows.noise) else { continue };
            for i in 0..most.len() {
                let change = (terms[i] - found.terms[i]).abs();
                let more = (inverse[i] - found.inverse[i]).max(LEAST * found.inverse[i]);
                let chance = variance * together[i] * more;
                let known = inverse[i] <= WORSE * found.inverse[i];
                if known && change * change > CLEAR * CLEAR * chance && change > most[i] {
                    most[i] = change;
                }
            }
        }
    }
    most
}

#[cfg(test)]
mod tests {
    use super::super::blocks::Block;
    use super::super::fit::{Question, fit};

    const TRUTH: f64 = 0.3;

    /// Inertia and its uncertainty from five ramps up and down, every second gentler, with Tc 4; `torque` is what the sensor makes of
    /// it in block i of 200.
    fn told(torque: impl Fn(usize, f64) -> f64) -> (f64, f64) {
        let block = |i: usize| {
            let pace = if (i / 40).is_multiple_of(2) { 1.0 } else { 0.6 };
            let acceleration = pace * [60.0, 0.0, -60.0, 0.0][i / 10 % 4];
            let truth = TRUTH * acceleration + 4.0 + 0.3 * ((i * i) as f64 * 2.7).sin();
            Block { torque: torque(i, truth), speed: 60.0 + (i % 10) as f64, acceleration }
        };
        let blocks: Vec<Block> = (0..200).map(block).collect();
        let (balance, verdict) = fit(&blocks, 20, &Question::PLAIN);
        assert_eq!(verdict, Ok(()));
        (balance.inertia.value, balance.inertia.uncertainty)
    }

    #[test]
    fn sound_stretches_widen_nothing() {
        let (value, uncertainty) = told(|_, truth| truth);
        assert!((value - TRUTH).abs() < uncertainty && uncertainty < 0.005 * TRUTH, "{value} {uncertainty}");
    }

    /// Each moves the value by more than scatter alone would say.
    #[test]
    fn a_load_or_another_scale_for_a_time_is_in_the_uncertainty() {
        let load = |i: usize, truth: f64| if i < 10 { truth + 0.8 } else { truth };
        let scaled = |i: usize, truth: f64| if (60..140).contains(&i) { 0.96 * truth } else { truth };
        for (name, (value, uncertainty)) in [("load", told(load)), ("scale", told(scaled))] {
            let off = (value - TRUTH).abs();
            assert!(
                off > 0.007 * TRUTH && off < uncertainty && uncertainty < 3.0 * off,
                "{name} {value} {uncertainty}"
            );
        }
    }
}
