//! Friction on the motor's side of the drive: it turns its sign at a reversal but winds nothing up.
//!
//! It shows where the recording goes a few µm back and forth while the table sticks (half the distance of the two lines of
//! effort over position), else as the level across the clearance.

use super::from_torque::{Piece, Turn};
use super::sweeps::{Sample, Sweep};
use crate::analysis::statistics::{deviation, student_95};

/// How friction on the motor's side was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MotorFriction {
    /// From going back and forth while the table sticks.
    Probe,
    /// From the level across the clearance.
    Clearance,
    /// Not seen: 20 ± 20 % of the friction is taken.
    Assumed,
}

/// Friction on the motor's side, and its standard error; with no evidence a share of the sliding friction.
pub(super) struct Friction {
    value: Option<(f64, f64)>,
}

impl Friction {
    /// For a reversal whose effort changes by `change`.
    pub(super) fn at(&self, change: f64) -> (f64, f64) {
        // Even over 0 to 40 % of half the change.
        self.value.unwrap_or((0.1 * change, 0.2 * change / 12f64.sqrt()))
    }
}

/// The fewest rows on each way of a probe, and across a clearance.
const FEWEST_ROWS: usize = 10;
/// The fewest bins that the clearance must span for its level to show the motor's friction.
const CLEARANCE_SHARE: f64 = 0.15;

pub(super) fn motor_friction(pieces: &[Piece], turns: &[Turn], about: f64) -> (Friction, MotorFriction) {
    let probes: Vec<f64> = pieces.iter().flat_map(|piece| probes(piece, about)).collect();
    if let Some(found) = mean_of(&probes) {
        return (Friction { value: Some(found) }, MotorFriction::Probe);
    }
    let level = |turn: &Turn| {
        let fitted = turn.fit(0.0, 0.0).ok()?;
        let (before, after) = turn.levels.as_ref().ok()?;
        let wide = fitted.clearance > CLEARANCE_SHARE * fitted.lost_motion && fitted.clearance > 4.0 * turn.width();
        let value = fitted.level - 0.5 * (before.value + after.value);
        let growth = turn.growth(&fitted, FEWEST_ROWS).filter(|_| wide)?;
        Some(Level { value, error: fitted.level_error, growth })
    };
    let levels: Vec<Level> = turns.iter().filter_map(level).collect();
    match Level::mean(&levels) {
        Some(found) => (Friction { value: Some(found) }, MotorFriction::Clearance),
        None => (Friction { value: None }, MotorFriction::Assumed),
    }
}

/// The effort across the clearance of one reversal.
struct Level {
    value: f64,
    /// Standard error of the fit.
    error: f64,
    /// How much it grows from the first half of the clearance to the second: a motor that jumps across is also accelerated.
    growth: f64,
}

impl Level {
    /// Mean and its standard error, at least 0.
    fn mean(levels: &[Level]) -> Option<(f64, f64)> {
        let n = levels.len() as f64;
        let mean = |of: fn(&Level) -> f64| levels.iter().map(of).sum::<f64>() / n;
        let values: Vec<f64> = levels.iter().map(|level| level.value).collect();
        let fits = (mean(|level| level.error.powi(2)) / n).sqrt();
        let scatter = mean_of(&values).map_or(0.0, |(_, error)| error);
        // Anywhere over twice the growth, and alike at every reversal.
        let common = mean(|level| level.growth) / 3f64.sqrt();
        (n > 0.0).then(|| (mean(|level| level.value).max(0.0), fits.max(scatter).hypot(common)))
    }
}

/// Mean and its standard error, at least 0; `None` for fewer than two values. Single ones may be below by chance.
fn mean_of(values: &[f64]) -> Option<(f64, f64)> {
    let n = values.len() as f64;
    (values.len() > 1)
        .then(|| ((values.iter().sum::<f64>() / n).max(0.0), student_95(n - 1.0) / 1.96 * deviation(values) / n.sqrt()))
}

/// The motor's friction from each short way back and forth: half the distance of two parallel lines of effort over position.
fn probes(piece: &Piece, about: f64) -> Vec<f64> {
    // A way forth ends before the place where the motor turned, and has begun when it moves fast enough to count.
    const SHARED: f64 = 0.6;
    // A wiggle as the motor comes to rest turns no friction round.
    const WIGGLE: f64 = 0.1;
    let one = |ways: &[Sweep]| {
        let [into, ends @ ..] = ways else { return None };
        // Only the first way back, from where the table slid, and the way forth again: then the table has not moved between.
        let short = ends[0].way() < 0.6 * about && into.way() > 1.5 * ends[0].way();
        if !short || ends[1].way() < SHARED * ends[0].way() {
            return None;
        }
        let back: Vec<&Sample> = ends[0].moving.iter().collect();
        let (low, high) =
            back.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), s| (l.min(s.motor), h.max(s.motor)));
        let edge = 0.25 * (high - low);
        let inside = |s: &&Sample| s.motor > low + edge && s.motor < high - edge;
        let back: Vec<&Sample> = back.into_iter().filter(inside).collect();
        let forth: Vec<&Sample> = ends[1].moving.iter().filter(inside).collect();
        if back.len() < FEWEST_ROWS || forth.len() < FEWEST_ROWS {
            return None;
        }
        Some(0.5 * ends[1].direction * apart(&back, &forth))
    };
    piece.track.sweeps_beyond(WIGGLE * about).windows(3).filter_map(one).collect()
}

/// How far the second line lies above the first, both with one slope.
fn apart(first: &[&Sample], second: &[&Sample]) -> f64 {
    let mean = |of: &[&Sample], value: fn(&Sample) -> f64| of.iter().map(|s| value(s)).sum::<f64>() / of.len() as f64;
    let centre = |of: &[&Sample]| (mean(of, |s| s.motor), mean(of, |s| s.difference));
    let (a, b) = (centre(first), centre(second));
    let sums = |of: &[&Sample], (x, y): (f64, f64)| {
        of.iter().fold((0.0, 0.0), |(xx, xy), s| (xx + (s.motor - x).powi(2), xy + (s.motor - x) * (s.difference - y)))
    };
    let ((xx, xy), (uu, uv)) = (sums(first, a), sums(second, b));
    let slope = (xy + uv) / (xx + uu).max(f64::MIN_POSITIVE);
    b.1 - a.1 - slope * (b.0 - a.0)
}
