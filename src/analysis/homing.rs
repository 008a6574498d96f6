//! Contact points of touches on a dead stop, from a recording of motor position and torque.
//!
//! The same fit as in the control ([`crate::cycle::homing::fit`]): before contact the torque is a level, from contact on a
//! line. A touch ends where the filtered torque reaches the torque limit, and begins where the axis was furthest from the
//! stop since the touch before.

use std::fmt;

use super::statistics::{median, quantile};
use crate::cycle::homing::fit::Fit;
use crate::cycle::homing::plan::Plan;
use crate::cycle::homing::side::GAIN;
use crate::cycle::homing::trace::Trace;
use crate::cycle::homing::verdict::{HomingSide, Touches};
use crate::error::status_text;
use crate::recording::{Recording, RecordingError, Signal, Unit, file_row};

/// What is known beside the recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// The axis.
    pub channel: String,
    /// Toward the stop, +1 or −1; `None`: the sense of the largest torque.
    pub direction: Option<i8>,
    /// Torque limit, N·m or N; `None`: the torque that the axis presses with.
    pub limit: Option<f64>,
}

/// One touch.
#[derive(Debug, Clone, PartialEq)]
pub struct Touch {
    /// Row of the file in which the torque has reached the limit (1 is the header).
    pub row: usize,
    /// Time of that row, s.
    pub time_s: f64,
    /// Speed on the way to the stop, mm or degrees per second.
    pub speed: f64,
    /// Position at which the torque line starts, or why it cannot be told.
    pub contact: Result<f64, &'static str>,
    /// Position and torque toward the stop, row by row.
    pub curve: Vec<(f64, f64)>,
}

/// What a recording says about a stop.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// The axis.
    pub channel: String,
    /// `mm` or `deg`.
    pub unit: &'static str,
    /// `nm` or `n`.
    pub effort_unit: &'static str,
    /// Toward the stop, +1 or −1.
    pub direction: f64,
    /// Torque limit, given or seen.
    pub limit: f64,
    /// Mean of the touches: contact point, plain threshold, uncertainty, stiffness. Torque in the effort's unit.
    pub mean: HomingSide,
    /// Every touch.
    pub touches: Vec<Touch>,
}

/// Why a recording holds no contact point.
#[derive(Debug, Clone, PartialEq)]
pub enum Refusal {
    /// The recording cannot be used.
    Recording(RecordingError),
    /// The torque nowhere rises to a limit and stays there.
    NoTouch,
    /// No touch has the shape of a level and a line: why, for each.
    NoContact(Vec<&'static str>),
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Refusal::Recording(why) => write!(f, "{why}"),
            Refusal::NoTouch => write!(f, "no touch found: the torque nowhere rises to a limit (give it with --limit)"),
            Refusal::NoContact(why) => write!(f, "no touch shows where it began: {}", why.join("; ")),
        }
    }
}

impl std::error::Error for Refusal {}

impl From<RecordingError> for Refusal {
    fn from(why: RecordingError) -> Refusal {
        Refusal::Recording(why)
    }
}

/// Share of the limit from which on the torque is limiting, and below which a touch is over.
const LIMITING: f64 = 0.9;
const OVER: f64 = 0.5;
/// Share of a touch's way that is evaluated; what comes before takes up lost motion.
const WINDOW: f64 = 0.6;
/// Blocks that level and line shall take up in a trace.
const BLOCKS: usize = 1200;

/// Finds the contact point of every touch and their mean.
///
/// # Errors
/// A missing column or one with holes, no touch, none with a contact point.
pub fn contacts(recording: &Recording, options: &Options) -> Result<Found, Refusal> {
    let channel = options.channel.as_str();
    let (positions, unit) = whole(recording, channel, Signal::Position)?;
    let effort = if recording.get(channel, Signal::Force).is_some() { Signal::Force } else { Signal::Torque };
    let (torques, effort_unit) = whole(recording, channel, effort)?;
    let sense = options.direction.map_or_else(|| strongest(&torques), f64::from);
    let toward: Vec<f64> = torques.iter().map(|t| sense * t).collect();
    let ways: Vec<f64> = positions.iter().map(|x| sense * x).collect();
    let limit = options.limit.unwrap_or_else(|| pressed(&toward));
    let rows = touches(&ways, &toward, LIMITING * limit);
    let shortest = rows.iter().map(|t| t.way(&ways)).fold(f64::INFINITY, f64::min);
    if rows.is_empty() || !(limit > 0.0 && shortest > 0.0) {
        return Err(Refusal::NoTouch);
    }
    // In the middle of the way: before, the axis may have stood, at its end the stop brakes it.
    let speed = |t: &Rows| {
        let [begin, end] = [WINDOW, 0.5 * WINDOW].map(|share| t.begin(&ways, share * shortest));
        if end > begin { (ways[end] - ways[begin]) / (recording.time_s[end] - recording.time_s[begin]) } else { 0.0 }
    };
    let plan = Plan {
        sense,
        threshold: LIMITING * limit,
        // Whether the touches agree is for whoever reads them: nothing is refused for its size.
        press_max: f64::INFINITY,
        tolerance: f64::INFINITY,
        touch: rows.iter().map(speed).sum::<f64>() / rows.len() as f64 * recording.sampling.period_s,
        cycles_per_s: 1.0 / recording.sampling.period_s,
        ..Plan::REST
    };
    let mut all = Touches::default();
    let found: Vec<Touch> = rows
        .iter()
        .map(|touch| {
            let fit = fitted(&ways, &toward, touch, WINDOW * shortest, &plan);
            let kept = all.add(&plan, 1, &fit, ways[touch.from] - ways[0]);
            let contact = kept.map(|()| sense * (ways[touch.from] + fit.found().map_or(f64::NAN, |c| c.way)));
            Touch {
                row: file_row(touch.end),
                time_s: recording.time_s[touch.end],
                speed: speed(touch),
                contact: contact.map_err(|fault| status_text(fault.code).trim_end_matches('\0')),
                curve: (touch.from..=touch.end).map(|i| (positions[i], toward[i])).collect(),
            }
        })
        .collect();
    if all.count() == 0 {
        return Err(Refusal::NoContact(found.iter().filter_map(|touch| touch.contact.err()).collect()));
    }
    Ok(Found {
        channel: channel.to_owned(),
        unit,
        effort_unit,
        direction: sense,
        limit,
        mean: all.report(&plan, positions[0], 0.0),
        touches: found,
    })
}

/// A column without holes, in mm or degrees, N·m or N, with that unit's name.
fn whole(recording: &Recording, channel: &str, signal: Signal) -> Result<(Vec<f64>, &'static str), Refusal> {
    let column = recording.column(channel, signal)?;
    let unit = column.label.as_ref().map_or(Unit::Mm, |label| label.unit.house());
    Ok((recording.need(channel, signal, unit)?.into_owned(), unit.suffix()))
}

/// Sense of the largest torque.
fn strongest(torques: &[f64]) -> f64 {
    torques.iter().fold(0.0, |most: f64, t| if t.abs() > most.abs() { *t } else { most }).signum()
}

/// The torque that the axis presses with: the median of what is near the largest. Some rows in a hundred are, as an axis stands
/// at the limit for a while.
fn pressed(toward: &[f64]) -> f64 {
    let near = LIMITING * quantile(toward, 0.99).unwrap_or(0.0);
    let high: Vec<f64> = toward.iter().copied().filter(|torque| *torque >= near).collect();
    median(&high).unwrap_or(0.0)
}

/// First and last row of a touch.
struct Rows {
    from: usize,
    end: usize,
}

impl Rows {
    /// Way gone toward the stop.
    fn way(&self, ways: &[f64]) -> f64 {
        ways[self.end] - ways[self.from]
    }

    /// The row from which the last `window` of the way begins.
    fn begin(&self, ways: &[f64], window: f64) -> usize {
        (self.from..self.end).find(|row| ways[*row] >= ways[self.end] - window).unwrap_or(self.from)
    }
}

/// The touches but those much shorter than the others: there the torque only dipped.
fn touches(ways: &[f64], toward: &[f64], threshold: f64) -> Vec<Rows> {
    const DIP: f64 = 0.3;
    let mut found = Vec::new();
    let mut filtered = toward.first().copied().unwrap_or(0.0);
    // How an axis came to a stop that it stands on from the first row is not in the recording.
    let (mut pressing, mut furthest) = (filtered >= threshold, 0);
    for (i, (way, torque)) in ways.iter().zip(toward).enumerate() {
        filtered += GAIN * (torque - filtered);
        if *way < ways[furthest] {
            furthest = i;
        }
        if !pressing && filtered >= threshold {
            found.push(Rows { from: furthest, end: i });
            pressing = true;
        }
        if filtered < OVER * threshold && pressing {
            pressing = false;
            furthest = i;
        }
    }
    let usual = median(&found.iter().map(|touch: &Rows| touch.way(ways)).collect::<Vec<f64>>()).unwrap_or(0.0);
    found.retain(|touch| touch.way(ways) > DIP * usual);
    found
}

/// The fit of one touch over the last `window` of its way.
fn fitted(ways: &[f64], toward: &[f64], touch: &Rows, window: f64, plan: &Plan) -> Fit {
    let (origin, begin) = (ways[touch.from], touch.begin(ways, window));
    let rows = begin..=touch.end;
    let mut trace = Trace::default();
    trace.start(rows.clone().count().div_ceil(BLOCKS) as u32, origin, 1.0, 1.0);
    rows.for_each(|row| {
        trace.add(ways[row], toward[row]);
    });
    let mut fit = Fit::default();
    fit.start(ways[begin] - origin, window, plan.threshold);
    while !fit.slice(&trace) {}
    fit
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::Column;

    /// Three touches in the sense `sense`, with a level of 1.5, 100 N·m/mm from 6 mm on and a limit of 5.
    fn recording(sense: f64, noise: f64) -> Recording {
        let mut state = 3u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        let (mut x, mut t) = (Vec::new(), Vec::new());
        let mut row = |at: f64, torque: f64| {
            x.push(sense * at);
            t.push(sense * torque + noise * random());
        };
        for _ in 0..3 {
            (0..1035).for_each(|i| {
                let at = 5.0 + 0.001 * f64::from(i);
                row(at, (1.5 + 100.0 * (at - 6.0).max(0.0)).min(5.0));
            });
            (0..100).for_each(|_| row(6.035, 5.0));
            (0..1035).for_each(|i| row(6.035 - 0.001 * f64::from(i), -1.5));
        }
        let time: Vec<f64> = (0..x.len()).map(|i| 0.001 * i as f64).collect();
        let columns = vec![Column::new("x.position_mm", x), Column::new("x.torque_nm", t)];
        Recording::from_columns("r.csv", time, columns).unwrap()
    }

    fn options() -> Options {
        Options { channel: "x".into(), direction: None, limit: None }
    }

    #[test]
    fn every_touch_and_its_contact_is_found_either_way() {
        for sense in [1.0, -1.0] {
            let found = contacts(&recording(sense, 0.2), &options()).unwrap();
            assert_eq!((found.touches.len(), found.direction, found.unit), (3, sense, "mm"));
            let mean = found.mean;
            let error = 1e3 * (mean.contact_mm - 6.0 * sense);
            assert!(
                error.abs() < mean.uncertainty_um && mean.uncertainty_um < 2.0,
                "{error} of {}",
                mean.uncertainty_um
            );
            assert!(
                found.touches.iter().all(|touch| (touch.speed - 1.0).abs() < 0.02) && (found.limit - 5.0).abs() < 0.05
            );
            assert!((mean.stiffness_nm_mm - 100.0).abs() < 3.0 && (mean.sliding_nm - 1.5).abs() < 0.05);
            assert!(sense * (mean.threshold_mm - mean.contact_mm) > 0.025);
        }
    }

    #[test]
    fn a_recording_that_begins_on_the_stop_still_shows_the_other_touches() {
        let whole = recording(1.0, 0.2);
        let from = 1050; // amid the first press
        let columns = whole.columns.iter().map(|c| Column::new(&c.name, c.values[from..].to_vec())).collect();
        let recording = Recording::from_columns("r.csv", whole.time_s[from..].to_vec(), columns).unwrap();
        let found = contacts(&recording, &options()).unwrap();
        assert_eq!(found.touches.len(), 2);
        assert!(1e3 * (found.mean.contact_mm - 6.0).abs() < found.mean.uncertainty_um);
    }

    #[test]
    fn a_recording_without_a_stop_is_refused() {
        let x: Vec<f64> = (0..3000).map(|i| 0.001 * f64::from(i)).collect();
        let t: Vec<f64> = (0..3000).map(|i| 1.5 + 0.05 * (f64::from(i) * 2.7).sin()).collect();
        let time: Vec<f64> = x.clone();
        let columns = vec![Column::new("x.position_mm", x), Column::new("x.torque_nm", t)];
        let recording = Recording::from_columns("r.csv", time, columns).unwrap();
        assert!(contacts(&recording, &options()).is_err());
        let limit = Options { limit: Some(5.0), ..options() };
        assert_eq!(contacts(&recording, &limit), Err(Refusal::NoTouch));
        let missing = Options { channel: "y".into(), ..options() };
        assert!(matches!(contacts(&recording, &missing), Err(Refusal::Recording(_))));
    }
}
