//! The residual against everything it may go with, before any cause is named: position, velocity, direction, acceleration,
//! time, distance since the last reversal, and frequency.
//!
//! The share of its variance that goes with a coordinate is that of the means over groups along it, less what as many
//! groups explain of pure chance (adjusted R²); for frequency, that of the strongest line less what noise has there.

use super::causes::periods;
use super::filter::LowPass;
use super::fit::{Bench, Fit};
use super::frame::Frame;

/// Groups along a coordinate.
const GROUPS: usize = 40;

/// The residual along one coordinate.
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    /// What it is shown against.
    pub coordinate: Coordinate,
    /// Share of the variance of the belief's residual that goes with it, 0 to 1.
    pub before: f64,
    /// The same of what is left in the end.
    pub after: f64,
    /// Along the coordinate: where, and the mean residual before and after; for frequency the amplitudes of lines.
    pub curve: Vec<(f64, f64, f64)>,
}

impl View {
    /// Its coordinate, and of frequency the strongest line of what is left.
    fn strongest_at(&self) -> String {
        let strongest = self.curve.iter().max_by(|a, b| a.2.total_cmp(&b.2));
        match (self.coordinate, strongest) {
            (Coordinate::Frequency, Some((hertz, ..))) => format!("frequency, at {hertz:.3} Hz"),
            (coordinate, _) => coordinate.name().to_owned(),
        }
    }
}

/// Share of its variance from which a residual is said to go with a coordinate.
const TIED: f64 = 0.05;
/// Variance above the noise floor, in units of the floor's, from which on it is said where a residual lives.
const LITTLE: f64 = 0.5;

/// Standard deviations of what chance puts there that are sure to be more, and a share that is never chance.
const SURE: f64 = 3.0;
const MOST_BY_CHANCE: f64 = 0.1;

/// How much wider than that of the balance the low-pass is that takes the encoder's noise off the acceleration; odd.
const SMOOTHER: usize = 5;

/// What a residual may go with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Coordinate {
    /// Load units.
    Position,
    /// Load units/s.
    Velocity,
    /// −1 or 1.
    Direction,
    /// Load units/s².
    Acceleration,
    /// s from the first row.
    Time,
    /// Load units of travel since the direction changed.
    SinceReversal,
    /// Hz.
    Frequency,
}

/// All of them.
pub const COORDINATES: [Coordinate; 7] = [
    Coordinate::Position,
    Coordinate::Velocity,
    Coordinate::Direction,
    Coordinate::Acceleration,
    Coordinate::Time,
    Coordinate::SinceReversal,
    Coordinate::Frequency,
];

impl Coordinate {
    /// Its name for people.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Coordinate::Position => "position",
            Coordinate::Velocity => "velocity",
            Coordinate::Direction => "direction",
            Coordinate::Acceleration => "acceleration",
            Coordinate::Time => "time",
            Coordinate::SinceReversal => "distance since reversal",
            Coordinate::Frequency => "frequency",
        }
    }
}

/// The torque residual of two fits against every coordinate, in the order of [`COORDINATES`].
#[must_use]
pub fn views(bench: &Bench, before: &Fit, after: &Fit) -> Vec<View> {
    let [before, _] = bench.rest(before);
    let [after, _] = bench.rest(after);
    against_all(bench.frame, &before, &after)
}

/// Two residuals of a channel at the judged rows against every coordinate.
#[must_use]
pub fn against_all(frame: &Frame, before: &[f64], after: &[f64]) -> Vec<View> {
    against(frame, before, after, after.len() as f64)
}

/// The same where so many of the rows are independent.
fn against(frame: &Frame, before: &[f64], after: &[f64], independent: f64) -> Vec<View> {
    let grouped = |coordinate: Coordinate| {
        let places = places(frame, coordinate);
        let (a, b) = (Groups::of(&places, before), Groups::of(&places, after));
        let [a_share, b_share] = [(&a, before), (&b, after)].map(|(groups, values)| match coordinate {
            Coordinate::Acceleration => groups.share(independent).min(share_along_smooth(frame, values, independent)),
            _ => groups.share(independent),
        });
        let value = |at: f64| if coordinate == Coordinate::SinceReversal { at.exp() } else { at };
        let curve = a.means().zip(b.means()).map(|((at, a), (_, b))| (value(at), a, b)).collect();
        View { coordinate, before: a_share, after: b_share, curve }
    };
    COORDINATES
        .into_iter()
        .map(|coordinate| match coordinate {
            Coordinate::Frequency => {
                let (a, b) = (periods::spectrum(frame, before), periods::spectrum(frame, after));
                let curve = a.iter().zip(&b).map(|(a, b)| (a.0, a.1, b.1)).collect();
                View { coordinate, before: lines(&a, before, independent), after: lines(&b, after, independent), curve }
            }
            _ => grouped(coordinate),
        })
        .collect()
}

/// Share of the variance of a fit's torque residual that goes with a coordinate other than frequency, 0 to 1.
#[must_use]
pub fn share_along(bench: &Bench, fit: &Fit, coordinate: Coordinate) -> f64 {
    let [rest, _] = bench.rest(fit);
    share_of(bench.frame, &rest, coordinate, rest.len() as f64)
}

/// The same of values at the judged rows, of which so many are independent.
#[must_use]
pub fn share_of(frame: &Frame, values: &[f64], coordinate: Coordinate, independent: f64) -> f64 {
    Groups::of(&places(frame, coordinate), values).share(independent)
}

/// Standard deviation of a share of values that go with nothing, of so many rows.
#[must_use]
pub fn chance(rows: f64) -> f64 {
    (2.0 * (GROUPS - 1) as f64).sqrt() / rows
}

/// Share that goes with the acceleration as far as the encoder's noise is not in that: the balance has the noise as acceleration, with
/// which the residual goes of itself.
fn share_along_smooth(frame: &Frame, values: &[f64], independent: f64) -> f64 {
    let smooth = LowPass { width: SMOOTHER * frame.low_pass.width }.run(&frame.a, &frame.columns.stretches);
    Groups::of(&frame.kept.iter().map(|&row| smooth[row]).collect::<Vec<f64>>(), values).share(independent)
}

/// Where the judged rows are along a coordinate: distance since reversal by its logarithm, frequency nowhere.
fn places(frame: &Frame, coordinate: Coordinate) -> Vec<f64> {
    let at = |value: &dyn Fn(usize) -> f64| frame.kept.iter().map(|&row| value(row)).collect();
    match coordinate {
        Coordinate::Position => at(&|row| frame.x[row]),
        Coordinate::Velocity => at(&|row| frame.v[row]),
        Coordinate::Direction => at(&|row| frame.v[row].signum()),
        Coordinate::Acceleration => at(&|row| frame.a[row]),
        Coordinate::Time => at(&|row| frame.seconds(row)),
        Coordinate::SinceReversal => {
            let since = since_reversal(frame);
            at(&|row| since[row].max(1e-9).ln())
        }
        Coordinate::Frequency => Vec::new(),
    }
}

/// Whether the torque residual of a fit goes with a coordinate at all, as far as so many independent rows tell.
#[must_use]
pub fn is_tied(bench: &Bench, fit: &Fit, independent: f64) -> bool {
    let [rest, _] = bench.rest(fit);
    let least = TIED.max((SURE * chance(independent)).min(MOST_BY_CHANCE));
    against(bench.frame, &rest, &rest, independent).iter().any(|view| view.after > least)
}

/// What is left, in a few words; `above` is the variance above the noise floor, in units of the floor's, and `excess` what of it
/// is more than what is believed may be off by.
#[must_use]
pub fn describe(views: &[View], above: f64, excess: f64) -> String {
    let mut list: Vec<&View> = views.iter().filter(|view| view.after > TIED).collect();
    list.sort_by(|a, b| b.after.total_cmp(&a.after));
    let strong: Vec<String> = list
        .iter()
        .take(3)
        .map(|view| format!("{} ({:.0} % of its variance)", view.strongest_at(), 100.0 * view.after))
        .collect();
    match (excess > LITTLE, strong.is_empty()) {
        (false, _) if above > LITTLE => "no more than what is believed may be off by".to_owned(),
        (false, _) => "white".to_owned(),
        (true, true) => "above the noise floor, but tied to no coordinate".to_owned(),
        (true, false) => format!("lives in {}", strong.join(", ")),
    }
}

/// Values by groups of equal width along a coordinate.
struct Groups {
    /// Sum of places, sum of values, count.
    sums: Vec<(f64, f64, f64)>,
    /// Of all values: sum, sum of squares, count.
    total: (f64, f64, f64),
}

impl Groups {
    fn of(places: &[f64], values: &[f64]) -> Groups {
        let low = places.iter().copied().fold(f64::MAX, f64::min);
        let high = places.iter().copied().fold(f64::MIN, f64::max);
        let mut sums = vec![(0.0, 0.0, 0.0); GROUPS];
        let per = if high > low { GROUPS as f64 / (high - low) } else { 0.0 };
        for (at, value) in places.iter().zip(values) {
            let group = &mut sums[(((at - low) * per) as usize).min(GROUPS - 1)];
            *group = (group.0 + at, group.1 + value, group.2 + 1.0);
        }
        let total = values.iter().fold((0.0, 0.0, 0.0), |t, v| (t.0 + v, t.1 + v * v, t.2 + 1.0));
        Groups { sums, total }
    }

    /// Mean place and mean value of the groups; NaN for a group of nothing.
    fn means(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.sums.iter().map(|&(at, value, count)| (at / count, value / count))
    }

    /// Share of the variance that goes with the groups, less what chance puts there where so many values are independent.
    fn share(&self, independent: f64) -> f64 {
        let (sum, squares, n) = self.total;
        let mean = sum / n;
        let around = (squares - sum * mean).max(1e-300);
        let filled = || self.sums.iter().filter(|group| group.2 > 0.0);
        let between: f64 = filled().map(|&(_, value, count)| count * (value / count - mean).powi(2)).sum();
        let used = filled().count() as f64;
        let n = independent;
        (1.0 - (1.0 - between / around) * (n - 1.0) / (n - used).max(1.0)).clamp(0.0, 1.0)
    }
}

/// Share of the variance in the strongest line, less what noise would put there.
fn lines(spectrum: &[(f64, f64)], rest: &[f64], independent: f64) -> f64 {
    let n = rest.len() as f64;
    let power = rest.iter().map(|r| r * r).sum::<f64>() / n;
    let strongest = spectrum.iter().map(|(_, amplitude)| 0.5 * amplitude * amplitude).fold(0.0, f64::max);
    (strongest / power.max(1e-300) - 2.0 * n.ln() / independent).clamp(0.0, 1.0)
}

/// Travel since the last change of direction, every row.
fn since_reversal(frame: &Frame) -> Vec<f64> {
    let mut out = vec![0.0; frame.x.len()];
    for s in &frame.columns.stretches {
        let mut from = frame.x[s.start];
        let mut way = 0.0;
        for i in s.clone() {
            let direction = frame.direction[i].round();
            if direction != 0.0 && direction != way {
                (way, from) = (direction, frame.x[i]);
            }
            out[i] = (frame.x[i] - from).abs();
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_share_of_groups_is_that_of_the_law_and_chance_has_none() {
        let places: Vec<f64> = (0..4000).map(|i| f64::from(i * 7919 % 4000)).collect();
        let law: Vec<f64> = places.iter().map(|x| (x / 700.0).sin()).collect();
        assert!(Groups::of(&places, &law).share(4e3) > 0.98);
        let chance: Vec<f64> = (0..4000_u32).map(|i| f64::from(i.wrapping_mul(2_654_435_761) >> 16)).collect();
        assert!(Groups::of(&places, &chance).share(4e3) < 0.02);
        // All at one place: nothing goes with it.
        assert_eq!(Groups::of(&vec![1.0; 4000], &law).share(4e3), 0.0);
    }
}
