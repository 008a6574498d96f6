//! Laws that have no name here, and that several causes together imitate: drag by the cube of speed, friction by the load, a
//! step along the stroke. Where such a law stands for most of what was found, the cause is unknown, and what is said is how it
//! goes.

mod laws;

use super::fit::{Bench, Fit, Part, pseudo_inverse};
use super::judge::{Excess, LITTLE_LEFT, MOST_OF_A_CURVE, is_coloured};
use super::known::LAW_HOLDS;
use super::progress::{Stopped, Watch};
use super::select::{BELIEF, LEAST_GAIN, NUMBER_PRICE, price};
use super::shrink::idle_left_out;
use crate::machine::Cause;
use laws::{Foreign, LAWS, PLACES};
use nalgebra::{DMatrix, DVector};

/// Share of what causes explain that a law without a name must stand for, for none of them to be named.
const MOST: f64 = 0.5;
/// Least share of it that such a law explains by itself, for it to be looked at.
const LEAST: f64 = 0.3;
/// What a law without a name must bring to take the place of as many causes; fewer it replaces where it is as good.
const FOR_AS_MANY: f64 = LEAST_GAIN;
/// Rows that show whether a law explains as much, and how much of that share a law shows there.
const GLIMPSE: usize = 3000;
const SHOWN_AT_A_GLIMPSE: f64 = 0.5;
/// How often the way between two places is halved.
const HALVED: i32 = 5;
/// Most causes that are compared with no law of any form where they leave little.
const FEW: usize = 2;

/// What is said while it is done.
const STAGE: &str = "comparing with laws without a name";

/// How what was found goes in truth, where a law without a name stands for most of it: where it makes causes needless that
/// explain more than half, and explains more than they do, or as much in place of two of them or more.
///
/// # Errors
/// [`Stopped`] when the watch's caller said so.
pub fn stands_for(bench: &Bench, empty: &Fit, found: &Fit, watch: &Watch) -> Result<Option<&'static str>, Stopped> {
    let explained = (empty.squares() - found.squares()).max(1e-300);
    let every = bench.rows.div_ceil(GLIMPSE).max(1);
    let frame = bench.frame.few(every);
    let few = bench.of_few(&frame, every);
    let explained_there = (empty.squares_of_few(every) - found.squares_of_few(every)).max(1e-300);
    let first_place = |law: &&'static Foreign| {
        let places = if law.somewhere { 1..PLACES } else { 0..1 };
        let alike = |place: f64| few.taken_by((law.regressors)(&frame, place)) / explained_there;
        let tried = places.map(|place| place as f64 / PLACES as f64).map(|place| (alike(place), *law, place));
        tried.max_by(|a, b| a.0.total_cmp(&b.0))
    };
    // A law of few numbers that does is what is there; one of any form is asked where something is left, or much was needed.
    let left = || Excess::of(bench, found, found).largest() > LITTLE_LEFT && !is_coloured(bench, found);
    let open = found.parts.len() > FEW || left();
    let mut laws: Vec<&'static Foreign> = LAWS.iter().filter(|law| open || !law.takes_any_form()).collect();
    // What takes longest is begun first.
    laws.sort_by_key(|law| !law.somewhere);
    let mut near: Vec<(f64, &'static Foreign, f64)> =
        watch.each(&laws, (0.9, 0.91), STAGE, first_place)?.into_iter().flatten().collect();
    near.retain(|(share, ..)| *share > SHOWN_AT_A_GLIMPSE * LEAST);
    let in_all_rows = |&(_, law, place): &(f64, &'static Foreign, f64)| {
        (bench.taken_by((law.regressors)(bench.frame, place)) / explained, law, place)
    };
    near = watch.each(&near, (0.91, 0.91), STAGE, in_all_rows)?;
    near.retain(|(share, ..)| *share > LEAST);
    near.sort_by(|a, b| a.1.takes_any_form().cmp(&b.1.takes_any_form()).then(b.0.total_cmp(&a.0)));
    // Where a law begins or lies is sought near the best of its places, beside causes.
    let placed = |law: &Foreign, place: f64, beside: &[Part]| -> Result<f64, Stopped> {
        let parts: Vec<Part> = beside.iter().map(|part| part.of_few(bench.rows, every)).collect();
        let squares = |place: &f64| few.beside((law.regressors)(&frame, *place)).fit(&parts).squares();
        let mut best = (place, squares(&place));
        for halved in 1..=if law.somewhere { HALVED } else { 0 } {
            let step = 0.5f64.powi(halved) / PLACES as f64;
            let sides = [best.0 - step, best.0 + step];
            let nearer = watch.each(&sides, (0.91, 0.91), STAGE, |place| (*place, squares(place)))?;
            best = nearer.into_iter().fold(best, |best, side| if side.1 < best.1 { side } else { best });
        }
        Ok(best.0)
    };
    for (_, law, place) in near {
        let there = placed(law, place, &found.parts)?;
        let with = bench.beside((law.regressors)(bench.frame, there));
        let fit = with.fit(&found.parts);
        let left = idle_left_out(&with.bench, fit, watch)?;
        let needless = found.parts.len() - left.parts.len();
        if needless == 0 {
            continue;
        }
        let stays = |part: &&Part| left.parts.iter().any(|l| l.law.cause == part.law.cause && l.shape == part.shape);
        let more = found.squares() - left.squares();
        // What the causes that are still needed explain by themselves.
        let needed: Vec<Part> = found.parts.iter().filter(stays).cloned().collect();
        let own = bench.fit(needed).squares() - found.squares();
        // Several numbers of the belief may well be wrong at once, and need no law without a name for that.
        let guesses = found.parts.iter().filter(|part| !stays(part) && !BELIEF.contains(&part.law.cause)).count();
        let enough = if needless > 1 && guesses > 0 { 0.0 } else { FOR_AS_MANY };
        // In place of one cause, any form also takes what that leaves by being not quite the law that the machine follows, and any law what
        // none holds to.
        let most = if law.takes_any_form() { MOST_OF_A_CURVE } else { LAW_HOLDS * LAW_HOLDS };
        let in_place = needless > 1 || more > most * explained;
        if !in_place || own <= MOST * explained {
            continue;
        }
        let better = |left: &Fit| price(found) - price(left) - NUMBER_PRICE * law.numbers as f64;
        // Beside such a law the numbers of the belief may still be a little off, as they may beside the causes: each that was left out may have
        // taken as much with it as a cause must gain.
        let beside_belief = || {
            let stays = |part: &&Part| stays(part) || BELIEF.contains(&part.law.cause);
            let believed: Vec<Part> = found.parts.iter().filter(stays).cloned().collect();
            let with = bench.beside((law.regressors)(bench.frame, placed(law, there, &believed)?));
            Ok(better(&with.fit(&believed)))
        };
        let (alone, regained) = (better(&left), LEAST_GAIN * needless as f64);
        if alone > enough || alone + regained > enough && !law.takes_any_form() && beside_belief()? > enough {
            return Ok(Some(law.goes));
        }
    }
    Ok(None)
}

/// Share of what a straight line leaves of table − motor that a bent one must take off it for the scale to be bent at all.
const BENT: f64 = 0.1;
/// What a bent line may leave over what the causes leave, to be as good as several of them; and by how much less to be better than one.
const AS_GOOD: f64 = 1.02;
const BETTER: f64 = 0.77;

/// How table − motor goes in truth, where a parabola along the stroke (a way that is bent, or rolls under a scale that lies beside it) stands
/// for an error of pitch and ripples.
#[must_use]
pub fn bends_table(bench: &Bench, empty: &Fit, found: &Fit) -> Option<&'static str> {
    let of_screw = |part: &&Part| matches!(part.law.cause, Cause::ScrewPitchError | Cause::ScrewPeriodicError);
    let count = found.parts.iter().filter(of_screw).count();
    let [[_, rest], [_, left]] = [bench.rest(empty), bench.rest(found)];
    if count == 0 || rest.is_empty() {
        return None;
    }
    let (frame, (low, high)) = (bench.frame, bench.frame.stroke());
    let place = |row: usize| (2.0 * frame.x[row] - low - high) / (high - low).max(1e-300);
    let along = |power: i32| frame.kept.iter().map(|&row| place(row).powi(power)).collect::<Vec<f64>>();
    let left_by = |most: i32| {
        let powers =
            DMatrix::from_columns(&(0..=most).map(|power| DVector::from_vec(along(power))).collect::<Vec<_>>());
        let rest = DVector::from_column_slice(&rest);
        let normal = pseudo_inverse(powers.transpose() * &powers, 1e-12)?;
        Some((&rest - &powers * (normal * (powers.transpose() * &rest))).norm_squared())
    };
    let (straight, bent) = (left_by(1)?, left_by(2)?);
    let by_causes = left.iter().map(|left| left * left).sum::<f64>();
    let stands = bent < if count > 1 { AS_GOOD } else { BETTER } * by_causes;
    (bent < (1.0 - BENT) * straight && stands).then_some("in table − motor with the square of the way from one place")
}
