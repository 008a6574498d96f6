//! Lost motion from a motor encoder and a scale on the table.
//!
//! Reversal by reversal, place by place: see `pair`. The value is the mean over the reversals, each sense counted alike, so
//! that a steady drift of one position against the other cancels. Its uncertainty joins
//!
//! - the scatter of the reversals, or, with few of them, of the places (autocorrelation respected), with Student's t;
//! - what the table may have been read late, times the speed (`time_skew`);
//! - what was not yet wound up (`pair::settle`), and the grid of both positions.

use super::pair::{Pair, Place, Unusable, by_place, compare, places};
use super::sweeps::{Sample, Sweep, Track};
use super::time_skew::{Skew, from_places, from_sweep};
use super::{Refusal, SPEED_RATIO, Value};
use crate::analysis::statistics::{correlated_mean, deviation, grid, student_95};
use crate::recording::{Recording, RecordingError, Signal, Unit, file_row};

/// One reversal.
#[derive(Debug, Clone, PartialEq)]
pub struct Reversal {
    /// Row of the file in which the motor turns round (1 is the header).
    pub row: usize,
    /// Time of that row, s.
    pub time_s: f64,
    /// Motor position there, in mm or degrees.
    pub position: f64,
    /// Direction after the reversal: +1 or −1.
    pub direction: i8,
    /// Mean speed before and after, per second, in mm or degrees.
    pub speed: f64,
    /// Lost motion; `None` when the reversal is not used.
    pub lost_motion: Option<Value>,
    /// Places at which both ways were compared, once steady.
    pub places: usize,
    /// Why the reversal is not used; `None` when it is.
    pub unused: Option<&'static str>,
}

/// Lost motion at one stretch of the stroke.
#[derive(Debug, Clone, PartialEq)]
pub struct Stretch {
    /// Where it begins and ends, mm or degrees.
    pub from: f64,
    /// See `from`.
    pub to: f64,
    /// Lost motion there.
    pub lost_motion: Value,
    /// Reversals that cover it.
    pub reversals: usize,
}

/// Motor minus table along one sweep, for a picture. Lengths in mm or degrees.
#[derive(Debug, Clone, PartialEq)]
pub struct Trace {
    /// +1 or −1.
    pub direction: i8,
    /// Motor positions, in order of time.
    pub position: Vec<f64>,
    /// Motor minus table there.
    pub difference: Vec<f64>,
}

/// The result for one axis. Every length is in mm, every angle in degrees, as `unit` says.
#[derive(Debug, Clone, PartialEq)]
pub struct LostMotion {
    /// The axis.
    pub channel: String,
    /// `mm` or `deg`.
    pub unit: &'static str,
    /// The mean over the reversals used.
    pub lost_motion: Value,
    /// Standard deviation from reversal to reversal; `None` with fewer than two.
    pub spread: Option<f64>,
    /// The largest mean over a stretch, with its place: what the worst place loses.
    pub largest: Option<Stretch>,
    /// The table's delay against the motor, s, with k = 2; corrected for.
    pub table_delay_s: Value,
    /// Part of the uncertainty that the delay makes.
    pub uncertainty_from_delay: f64,
    /// False when the lost motion is not larger than its uncertainty.
    pub significant: bool,
    /// Every reversal of the recording.
    pub reversals: Vec<Reversal>,
    /// The stroke in stretches.
    pub stretches: Vec<Stretch>,
    /// Motor minus table along every sweep.
    pub traces: Vec<Trace>,
}

/// Stretches the stroke is cut into for the table along it.
const STRETCHES: usize = 10;

/// Measures the lost motion of `channel`.
///
/// # Errors
/// A missing column, positions that cannot be compared, no reversal, or none that can be used; see [`Refusal`].
pub fn measure(recording: &Recording, channel: &str) -> Result<LostMotion, Refusal> {
    let tracks = tracks(recording, channel)?;
    let sweeps: Vec<Vec<Sweep>> = tracks.iter().map(|piece| piece.track.sweeps()).collect();
    if sweeps.iter().all(|piece| piece.len() < 2) {
        return Err(Refusal::NoReversal);
    }
    let all: Vec<&Sweep> = sweeps.iter().flatten().collect();
    let resolution = tracks.iter().map(|piece| piece.resolution).fold(0.0, f64::max);
    let skew = skew(&sweeps, recording.sampling.period_s, resolution);
    let mut found: Vec<Found> = Vec::new();
    for (piece, sweeps) in tracks.iter().zip(&sweeps) {
        for ends in sweeps.windows(2) {
            let pair = compare(&ends[0], &ends[1], |sample| skew.of(sample));
            found.push(Found::new(piece, &ends[0], &ends[1], pair));
        }
    }
    leave_out_fast(&mut found);
    let used: Vec<(&Found, &Pair)> = found.iter().filter_map(|f| Some((f, f.pair.as_ref().ok()?))).collect();
    if used.is_empty() {
        let count = |why| found.iter().filter(|f| f.pair.as_ref().is_err_and(|w| *w == why)).count();
        return Err(Refusal::NoUsableReversal {
            seen: found.len(),
            few_rows: count(Unusable::FewRows),
            short: count(Unusable::Short),
            still: count(Unusable::Still),
        });
    }
    let (lost_motion, delay_part) = joined(&used, &skew, resolution);
    let values: Vec<f64> = used.iter().map(|(_, pair)| pair.mean.value).collect();
    let stretches = stretches(&used, &skew);
    let unit = tracks[0].unit.suffix();
    let traces = all.iter().map(|sweep| trace(sweep, &skew)).collect();
    Ok(LostMotion {
        channel: channel.to_owned(),
        unit,
        lost_motion,
        spread: (values.len() > 1).then(|| deviation(&values)),
        largest: stretches.iter().max_by(|a, b| a.lost_motion.value.total_cmp(&b.lost_motion.value)).cloned(),
        table_delay_s: Value { value: skew.delay_s, uncertainty: 2.0 * skew.error_s },
        uncertainty_from_delay: delay_part,
        significant: lost_motion.value > lost_motion.uncertainty,
        reversals: found.iter().map(Found::report).collect(),
        stretches,
        traces,
    })
}

/// An unbroken piece of the recording.
struct Piece {
    track: Track,
    /// Row of the recording for each row of the track.
    rows: Vec<usize>,
    unit: Unit,
    resolution: f64,
}

fn tracks(recording: &Recording, channel: &str) -> Result<Vec<Piece>, Refusal> {
    let (motor, table) =
        (recording.column(channel, Signal::Position)?, recording.column(channel, Signal::TablePosition)?);
    let foreign = || Refusal::Recording(RecordingError::new(&recording.file, "holds a position without a unit"));
    let (motor_values, unit) = motor.in_house().ok_or_else(foreign)?;
    let Some(table_values) = table.to(unit) else {
        let message = format!("{} is a length, {} an angle, or the other way round", motor.name, table.name);
        return Err(Refusal::PositionsDiffer(message));
    };
    let mut tracks = Vec::new();
    for rows in super::unbroken(recording, &[motor, table]) {
        let take = |values: &[f64]| -> Vec<f64> { rows.iter().map(|row| values[*row]).collect() };
        let (motor, table) = (take(&motor_values), take(&table_values));
        same_scale(&motor, &table)?;
        let resolution = (grid(&motor).unwrap_or(0.0).powi(2) + grid(&table).unwrap_or(0.0).powi(2)).sqrt();
        let difference = motor.iter().zip(&table).map(|(a, b)| a - b).collect();
        tracks.push(Piece {
            track: Track { time_s: take(&recording.time_s), motor, difference },
            rows,
            unit,
            resolution,
        });
    }
    if tracks.is_empty() {
        let message =
            format!("{} and {} have no two neighbouring rows that both hold a number", motor.name, table.name);
        return Err(Refusal::Recording(RecordingError::new(&recording.file, message)));
    }
    Ok(tracks)
}

/// Both positions must be in load units: a table that runs the other way, or at another ratio, is a mistake in a header.
fn same_scale(motor: &[f64], table: &[f64]) -> Result<(), Refusal> {
    let n = motor.len() as f64;
    let mean = |values: &[f64]| values.iter().sum::<f64>() / n;
    let (a, b) = (mean(motor), mean(table));
    let covariance: f64 = motor.iter().zip(table).map(|(x, y)| (x - a) * (y - b)).sum();
    let variance: f64 = motor.iter().map(|x| (x - a).powi(2)).sum();
    if variance <= 0.0 {
        return Ok(());
    }
    let slope = covariance / variance;
    // Where the stroke is not much longer than the lost motion, the table makes a small part of the motor's way.
    if (-0.25..4.0).contains(&slope) {
        return Ok(());
    }
    Err(Refusal::PositionsDiffer(format!(
        "the table moves {slope:.3} for each unit of the motor; both must be in load units, counted the same way"
    )))
}

/// The delay. What is settled can be told only once the delay is corrected for, so the two are found in turns, beginning
/// with the middle of each range.
fn skew(sweeps: &[Vec<Sweep>], period_s: f64, resolution: f64) -> Skew {
    const TURNS: usize = 3;
    const EDGE: f64 = 0.1;
    let beforehand = Skew { delay_s: 0.0, error_s: period_s };
    let pairs = || sweeps.iter().flat_map(|piece| piece.windows(2));
    let sense = |ends: &[Sweep]| ends[1].direction as i8;
    let middle = |ends: &[Sweep]| {
        let places = places(&ends[0], &ends[1], |_| 0.0).ok()?;
        let edge = (EDGE * places.len() as f64).ceil() as usize;
        Some((sense(ends), places.get(edge..places.len().saturating_sub(edge))?.to_vec()))
    };
    let first = from_places(&pairs().filter_map(middle).collect::<Vec<_>>(), resolution);
    let mut skew = beforehand.and(first);
    for _ in 0..TURNS {
        let mut settled = Vec::new();
        let mut onset = 0.0f64;
        for ends in pairs() {
            let Ok(pair) = compare(&ends[0], &ends[1], |sample| skew.of(sample)) else { continue };
            onset = onset.max(pair.onset);
            let seen =
                |place: Place| Place { lost_motion: place.lost_motion + skew.delay_s * place.speed_sum, ..place };
            settled.push((sense(ends), pair.settled.into_iter().map(seen).collect()));
        }
        let along: Vec<Skew> =
            sweeps.iter().flatten().filter_map(|s| from_sweep(s.after(onset), s.speed_noise, resolution)).collect();
        let estimates: Vec<Skew> =
            [Skew::join(&along), from_places(&settled, resolution)].into_iter().flatten().collect();
        skew = beforehand.and(Skew::join(&estimates));
    }
    skew
}

/// A reversal with what came of it.
struct Found {
    report: Reversal,
    speed_sum: f64,
    pair: Result<Pair, Unusable>,
}

impl Found {
    fn new(piece: &Piece, before: &Sweep, after: &Sweep, pair: Result<Pair, Unusable>) -> Self {
        let turn = after.rows.start;
        let row = piece.rows[turn];
        let speeds: Vec<f64> = pair.as_ref().map_or_else(
            |_| vec![before.top_speed + after.top_speed],
            |pair| pair.settled.iter().map(|place| place.speed_sum).collect(),
        );
        let speed_sum = speeds.iter().sum::<f64>() / speeds.len().max(1) as f64;
        let report = Reversal {
            row: file_row(row),
            time_s: piece.track.time_s[turn],
            position: piece.track.motor[turn],
            direction: after.direction as i8,
            speed: 0.5 * speed_sum,
            lost_motion: None,
            places: 0,
            unused: None,
        };
        Self { report, speed_sum, pair }
    }

    fn report(&self) -> Reversal {
        let mut report = self.report.clone();
        match &self.pair {
            Ok(pair) => {
                let uncertainty = student_95(pair.mean.freedom) * pair.mean.error;
                report.lost_motion = Some(Value { value: pair.mean.value, uncertainty });
                report.places = pair.settled.len();
            }
            Err(Unusable::FewRows) => report.unused = Some("too few rows in motion over the same stretch"),
            Err(Unusable::Short) => report.unused = Some("too short for the table to move steadily"),
            Err(Unusable::Still) => report.unused = Some("the table does not follow the motor"),
            Err(Unusable::Fast) => report.unused = Some("much faster than the slowest reversal"),
        }
        report
    }
}

/// Sets aside reversals at much more than the slowest speed.
fn leave_out_fast(found: &mut [Found]) {
    let slowest = found.iter().filter(|f| f.pair.is_ok()).map(|f| f.speed_sum).fold(f64::INFINITY, f64::min);
    for one in found.iter_mut().filter(|f| f.pair.is_ok() && f.speed_sum > SPEED_RATIO * slowest) {
        one.pair = Err(Unusable::Fast);
    }
}

/// The value with its uncertainty, and the part that the delay makes.
fn joined(used: &[(&Found, &Pair)], skew: &Skew, resolution: f64) -> (Value, f64) {
    let n = used.len() as f64;
    let sense = |direction: i8| -> Vec<f64> {
        used.iter().filter(|(f, _)| f.report.direction == direction).map(|(_, pair)| pair.mean.value).collect()
    };
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let (up, down) = (sense(1), sense(-1));
    let value = match (up.is_empty(), down.is_empty()) {
        (false, false) => 0.5 * (mean(&up) + mean(&down)),
        (true, _) => mean(&down),
        (_, true) => mean(&up),
    };
    let mut scatter = along_the_stroke(used, value, &up, &down);
    // Reversals in a row share a sweep, whose noise both see: the mean of many scatters by √2 more than if they did not.
    let shared = 1.0 + (n - 1.0) / n;
    // A common offset of the two senses, such as a drift, cancels in the mean and is no scatter of it.
    let about = |values: &[f64]| values.iter().map(|v| (v - mean(values)).powi(2)).sum::<f64>();
    let groups = f64::from(u8::from(!up.is_empty()) + u8::from(!down.is_empty()));
    if n > groups {
        let between = (about(&up) + about(&down)) / (n - groups) / n * shared;
        scatter = scatter.max(student_95(((n - groups) / shared).max(1.0)) * between.sqrt());
    }
    let speed = used.iter().map(|(f, _)| f.speed_sum).sum::<f64>() / n;
    let delay = 2.0 * speed * skew.error_s;
    // A bound of ± s is a standard deviation of s/√3.
    let settling = used.iter().map(|(_, pair)| pair.settling).sum::<f64>() / n * 2.0 / 3f64.sqrt();
    let stretch = used.iter().map(|(_, pair)| span(&pair.settled)).fold(0.0, f64::max);
    let grid = 2.0 * resolution / 12f64.sqrt() / (stretch / resolution.max(f64::MIN_POSITIVE)).max(1.0);
    let uncertainty = (scatter.powi(2) + delay.powi(2) + settling.powi(2) + grid.powi(2)).sqrt();
    (Value { value, uncertainty }, delay)
}

/// Half-width of the 95 % interval of the mean over places. What errs at a place errs there in every reversal, so places are
/// counted once however often they are visited; the offset between the two senses is none of theirs. Places that `pair::settle`
/// dropped still tell how much the lost motion varies.
fn along_the_stroke(used: &[(&Found, &Pair)], value: f64, up: &[f64], down: &[f64]) -> f64 {
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let values: Vec<(f64, f64)> = used
        .iter()
        .flat_map(|(found, pair)| {
            let level = if up.is_empty() || down.is_empty() {
                value
            } else {
                mean(if found.report.direction > 0 { up } else { down })
            };
            pair.moving.iter().map(move |place| (place.position, place.lost_motion - level))
        })
        .collect();
    let places: Vec<f64> = by_place(&values).iter().map(|values| mean(values)).collect();
    correlated_mean(&places).map_or(0.0, |mean| student_95(mean.freedom) * mean.error)
}

fn span(places: &[Place]) -> f64 {
    match (places.first(), places.last()) {
        (Some(a), Some(b)) => (a.position - b.position).abs(),
        _ => 0.0,
    }
}

/// The places of all reversals at which the table moves on, gathered into stretches of the stroke.
fn stretches(used: &[(&Found, &Pair)], skew: &Skew) -> Vec<Stretch> {
    let positions = || used.iter().flat_map(|(_, pair)| &pair.moving).map(|place| place.position);
    let (low, high) = positions().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
    let width = (high - low) / STRETCHES as f64;
    let one = |i: usize| {
        let from = low + i as f64 * width;
        let inside = |place: &&Place| place.position >= from && (place.position < from + width || i + 1 == STRETCHES);
        let mut means = Vec::new();
        let (mut error, mut speed) = (0.0, 0.0f64);
        for (_, pair) in used {
            let here: Vec<&Place> = pair.moving.iter().filter(inside).collect();
            if here.is_empty() {
                continue;
            }
            means.push(here.iter().map(|place| place.lost_motion).sum::<f64>() / here.len() as f64);
            // The error of all places, for the fewer here.
            error += pair.mean.error.powi(2) * (pair.settled.len() as f64 / here.len() as f64);
            speed = speed.max(here.iter().map(|place| place.speed_sum).fold(0.0, f64::max));
        }
        let n = means.len() as f64;
        if means.is_empty() {
            return None;
        }
        let within = error.sqrt() / n;
        let between = if means.len() > 1 { student_95(n - 1.0) * deviation(&means) / n.sqrt() } else { 0.0 };
        let uncertainty = ((2.0 * within).max(between).powi(2) + (2.0 * speed * skew.error_s).powi(2)).sqrt();
        let value = means.iter().sum::<f64>() / n;
        Some(Stretch { from, to: from + width, lost_motion: Value { value, uncertainty }, reversals: means.len() })
    };
    (0..STRETCHES).filter_map(one).collect()
}

/// At most this many points of a sweep go into a picture.
const TRACE_POINTS: usize = 400;

fn trace(sweep: &Sweep, skew: &Skew) -> Trace {
    let chunks = sweep.moving.chunks(sweep.moving.len().div_ceil(TRACE_POINTS).max(1));
    let mean = |chunk: &[Sample], of: &dyn Fn(&Sample) -> f64| chunk.iter().map(of).sum::<f64>() / chunk.len() as f64;
    let (position, difference) =
        chunks.map(|chunk| (mean(chunk, &|s| s.motor), mean(chunk, &|s| s.difference - skew.of(s)))).unzip();
    Trace { direction: sweep.direction as i8, position, difference }
}
