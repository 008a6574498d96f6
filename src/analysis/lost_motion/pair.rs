//! Two sweeps on either side of a reversal, compared place by place.
//!
//! At one motor position x, both ways, D = motor − table differs by the lost motion alone:
//! `lost motion(x) = d·(D_before(x) − D_after(x))`, d = ±1 the direction before the reversal. What depends on the place
//! only (scale error, eccentricity, pitch) cancels. Just after a reversal the table has not moved yet and the difference is
//! too small, and it grows until drive and friction are wound up the other way: such places are left out.

use super::sweeps::{Sample, Sweep};
use crate::analysis::statistics::{Mean, correlated_mean, quantile, white_noise};

/// The lost motion at one place.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    /// Motor position.
    pub position: f64,
    /// Travel since the nearer of the two reversals that the sweeps began with.
    pub travel: f64,
    /// The lost motion here.
    pub lost_motion: f64,
    /// Motor minus table here, before and after the reversal.
    pub differences: [f64; 2],
    /// Sum of both speeds, 1/s.
    pub speed_sum: f64,
}

/// What a reversal shows.
pub(super) struct Pair {
    /// The places at which the table moves on, both ways, in the order of their distance from the reversal.
    pub moving: Vec<Place>,
    /// Of these, the ones used.
    pub settled: Vec<Place>,
    /// Mean over the settled places, with its error.
    pub mean: Mean,
    /// Travel from the reversal to the first place at which the table moves on.
    pub onset: f64,
    /// How much the mean moved when less settled places were dropped; 0 when none were.
    pub settling: f64,
}

/// Why a reversal cannot be used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Unusable {
    /// The two sweeps share too few rows in motion.
    FewRows,
    /// The sweeps are too short for the table to be moving steadily in both.
    Short,
    /// The table does not follow the motor: the stroke is shorter than what is lost.
    Still,
    /// It is much faster than the slowest reversal.
    Fast,
}

/// The fewest rows in motion that a sweep must have in the range both visit.
const FEWEST_ROWS: usize = 12;
/// The fewest settled places that make a mean.
const FEWEST_PLACES: usize = 4;
/// Places by which a range is cut at most.
const MOST_PLACES: usize = 100;

/// Compares the sweep before a reversal with the one after it. `correct` gives the part of D that is due to speed.
pub(super) fn compare(before: &Sweep, after: &Sweep, correct: impl Fn(&Sample) -> f64) -> Result<Pair, Unusable> {
    let places = places(before, after, correct)?;
    let lost: Vec<f64> = places.iter().map(|place| place.lost_motion).collect();
    let noise = white_noise(&lost).unwrap_or(0.0);
    let level = quantile(&lost, 0.75).unwrap_or(0.0);
    let reversed: Vec<f64> = lost.iter().rev().copied().collect();
    let start = unsettled(&places, level).max(rise(&lost, level, noise));
    let backward: Vec<Place> = places.iter().rev().copied().collect();
    let end = places.len().saturating_sub(unsettled(&backward, level).max(rise(&reversed, level, noise)));
    let region = places.get(start..end).unwrap_or_default();
    if region.len() < FEWEST_PLACES {
        return Err(Unusable::Short);
    }
    if !follows(region) {
        return Err(Unusable::Still);
    }
    let (settled, settling) = settle(region, noise);
    let values: Vec<f64> = settled.iter().map(|place| place.lost_motion).collect();
    let mean = correlated_mean(&values).ok_or(Unusable::Short)?;
    let onset = (region[0].position - places[0].position).abs();
    Ok(Pair { moving: region.to_vec(), settled, mean, onset, settling })
}

/// The lost motion at places of equal width over the range both sweeps visit, in the order of their distance from the
/// reversal; settled or not.
pub(super) fn places(before: &Sweep, after: &Sweep, correct: impl Fn(&Sample) -> f64) -> Result<Vec<Place>, Unusable> {
    let range = |sweep: &Sweep| {
        sweep.moving.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), s| (l.min(s.motor), h.max(s.motor)))
    };
    let ((low_a, high_a), (low_b, high_b)) = (range(before), range(after));
    let (low, high) = (low_a.max(low_b), high_a.min(high_b));
    let inside = |sweep: &Sweep| sweep.moving.iter().filter(|s| s.motor >= low && s.motor <= high).count();
    let rows = inside(before).min(inside(after));
    if rows < FEWEST_ROWS || high <= low {
        return Err(Unusable::FewRows);
    }
    let count = (rows / 5).clamp(FEWEST_PLACES, MOST_PLACES);
    let width = (high - low) / count as f64;
    let (a, b) = (bins(before, low, width, count, &correct), bins(after, low, width, count, &correct));
    let start_of = |sweep: &Sweep, x: f64| {
        let start = if sweep.direction > 0.0 { range(sweep).0 } else { range(sweep).1 };
        if sweep.first { f64::INFINITY } else { (x - start).abs() }
    };
    let place = |i: usize| {
        let ((da, va), (db, vb)) = (a[i]?, b[i]?);
        let position = low + (i as f64 + 0.5) * width;
        Some(Place {
            position,
            travel: start_of(before, position).min(start_of(after, position)),
            lost_motion: before.direction * (da - db),
            differences: [da, db],
            speed_sum: va.abs() + vb.abs(),
        })
    };
    let mut places: Vec<Place> = (0..count).filter_map(place).collect();
    // The reversal lies at the high end after motion upward.
    if before.direction > 0.0 {
        places.reverse();
    }
    if places.len() < FEWEST_PLACES { Err(Unusable::FewRows) } else { Ok(places) }
}

/// Difference at the middle of each bin, by a straight line through its rows, and their mean speed.
fn bins(
    sweep: &Sweep,
    low: f64,
    width: f64,
    count: usize,
    correct: impl Fn(&Sample) -> f64,
) -> Vec<Option<(f64, f64)>> {
    // Number, x, y, x², xy and speed, with x from the middle of the bin.
    let mut sums = vec![[0.0f64; 6]; count];
    for sample in &sweep.moving {
        let at = (sample.motor - low) / width;
        if at < 0.0 || at > count as f64 {
            continue;
        }
        let bin = (at as usize).min(count - 1);
        let x = sample.motor - low - (bin as f64 + 0.5) * width;
        let y = sample.difference - correct(sample);
        for (sum, term) in sums[bin].iter_mut().zip([1.0, x, y, x * x, x * y, sample.speed]) {
            *sum += term;
        }
    }
    let line = |[n, x, y, xx, xy, v]: &[f64; 6]| {
        let spread = n * xx - x * x;
        // Rows crowded at one spot show no slope; their mean must do.
        let slope = if *n >= 4.0 && spread > 0.01 * n * n * width * width { (n * xy - x * y) / spread } else { 0.0 };
        (*n >= 2.0).then(|| ((y - slope * x) / n, v / n))
    };
    sums.iter().map(line).collect()
}

/// Number of places at the start in which the table may stand still: the motor travels the lost motion itself before the table
/// moves at all. So it may be where a recording begins, too: nobody knows from which side the axis came.
fn unsettled(places: &[Place], level: f64) -> usize {
    let Some(first) = places.first() else { return 0 };
    places.iter().take_while(|place| (place.position - first.position).abs() <= 1.5 * level.abs()).count()
}

/// Number of places at the start of `lost` before it has risen to its level.
fn rise(lost: &[f64], level: f64, noise: f64) -> usize {
    const RISEN: f64 = 0.9;
    // Places averaged so that noise neither makes nor hides the rise.
    let wanted = (noise / (0.03 * level.abs()).max(f64::MIN_POSITIVE)).powi(2).ceil();
    let window = (wanted as usize).clamp(1, (lost.len() / 8).max(1));
    let risen = lost.windows(window).position(|w| w.iter().sum::<f64>() / window as f64 >= RISEN * level);
    match risen {
        None | Some(0) => 0,
        // The last tenth may take as long again as the first nine; but something must be left to measure.
        Some(places) => places + places.min((lost.len() - places) / 4),
    }
}

/// True when the table covers at least half the motor's way, both ways.
fn follows(region: &[Place]) -> bool {
    let (Some(first), Some(last)) = (region.first(), region.last()) else { return false };
    let way = last.position - first.position;
    (0..2).all(|i| ((last.differences[i] - first.differences[i]) / way).abs() < 0.5)
}

/// While the lost motion still grows with the travel since the reversal, keeps the half further from it: what is not wound
/// up yet always reads low. Gives the places and by how much the mean moved.
fn settle(region: &[Place], noise: f64) -> (Vec<Place>, f64) {
    const MOST_STEPS: usize = 2;
    const SIGMAS: f64 = 3.0;
    let mean = |places: &[Place]| places.iter().map(|p| p.lost_motion).sum::<f64>() / places.len().max(1) as f64;
    let mut kept = region.to_vec();
    let mut settling = 0.0;
    for _ in 0..MOST_STEPS {
        if kept.len() < 2 * FEWEST_PLACES {
            break;
        }
        let travels: Vec<f64> = kept.iter().map(|place| place.travel).collect();
        let middle = quantile(&travels, 0.5).unwrap_or(0.0);
        let (far, near): (Vec<Place>, Vec<Place>) = kept.iter().partition(|place| place.travel > middle);
        let growth = mean(&far) - mean(&near);
        let scatter = noise * (1.0 / far.len().max(1) as f64 + 1.0 / near.len().max(1) as f64).sqrt();
        if far.len() < FEWEST_PLACES || growth < SIGMAS * scatter || growth < 0.01 * mean(&far).abs() {
            break;
        }
        settling = mean(&far) - mean(region);
        kept = far;
    }
    (kept, settling)
}

/// Groups (position, value) into places of equal width in order of position; places without a value are left out.
pub(super) fn by_place(values: &[(f64, f64)]) -> Vec<Vec<f64>> {
    let (low, high) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), (x, _)| (l.min(*x), h.max(*x)));
    let width = ((high - low) / MOST_PLACES as f64).max(f64::MIN_POSITIVE);
    let mut places = vec![Vec::new(); MOST_PLACES];
    for (x, value) in values {
        places[(((x - low) / width) as usize).min(MOST_PLACES - 1)].push(*value);
    }
    places.retain(|values| !values.is_empty());
    places
}
