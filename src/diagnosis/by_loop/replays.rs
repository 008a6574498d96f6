//! The closed loop of a recording, replayed with one machine after the other, and how far each misses the measured position.

use super::STAGE;
use crate::analysis::statistics;
use crate::diagnosis::gain::Replay;
use crate::diagnosis::missed::{BLOCKS, Over, blocks_of, mean, mean_square, miss_of};
use crate::diagnosis::progress::Watch;
use crate::diagnosis::whole::Whole;
use crate::machine::Axis;
use crate::plant::added::ByServo;
use crate::plant::closed_loop::{Part, rows_of_the_beginning};
use crate::plant::observed::Observed;
use crate::plant::simulate::Sensors;
use once_cell::sync::OnceCell;
use std::ops::Range;

/// Most plant steps of a replay: 40 s at the usual ones. Longer steps are no help, they put impacts elsewhere.
const MOST_STEPS: usize = 1_600_000;
/// The same where causes are tried that may not be worth it.
const MOST_STEPS_TRIED: usize = 600_000;
/// How long an axis stands before that is a long rest, s.
const LONG_REST_S: f64 = 0.1;
/// Fewest rows of a block that are none.
const FEWEST_ROWS: f64 = 10.0;
/// The beginning, of which nobody knows how the servo stood, is no larger part of the rows than one in so many.
const MOST_OF_ROWS: usize = 4;

/// Noise of a sensor over its grid that readings at rest may hide.
const FLICKER: f64 = 0.2;
/// Noise over the grid that readings without any may seem to have: their fourth differences are whole steps, of which the median may be
/// four.
const OF_STEPS: f64 = 0.75;

/// By what a machine misses the measured position, and how far each block is missed whatever the machine.
type ErrorAndUnavoidable = (Vec<f64>, Vec<f64>);

/// What stays the same while machines are replayed.
pub struct Replays<'r> {
    /// What is replayed.
    pub whole: &'r Whole<'r>,
    /// The machine whose loop was replayed once.
    pub known: &'r Replay,
    /// What the recording shows.
    pub recording: (&'r Observed, &'r ByServo),
    part: Part,
    begun: usize,
    /// Rows but for long rests.
    heard: Vec<bool>,
    /// What the encoder itself is off by, and the whole way of the axis, load units.
    floor: f64,
    stroke: f64,
    /// What was worked out of the machine that was asked about first.
    of_one: OnceCell<(Axis, Option<ErrorAndUnavoidable>)>,
    watch: &'r Watch<'r>,
}

impl<'r> Replays<'r> {
    /// Of a recording whose loop was replayed once; `None` where that cannot be told from anything.
    #[must_use]
    pub fn new(whole: &'r Whole, known: Option<&'r Replay>, watch: &'r Watch<'r>) -> Option<Self> {
        let (known, recording) = known.zip(whole.recording())?;
        let observed = recording.0;
        let most = Part::of_steps(&known.axis, observed, MOST_STEPS, 1.0);
        let part = Part { rows: most.rows.min(known.error.len()), ..most };
        let rows = part.rows;
        let begun = rows_of_the_beginning(known.axis.servo.as_ref()?, observed).min(rows / MOST_OF_ROWS);
        let heard = rows_but_for_long_rests(observed, rows);
        let floor = statistics::reading_error(&observed.position);
        if !(floor > 0.0) || rows - begun < 10 * BLOCKS {
            return None;
        }
        let known_ones = observed.position.iter().copied().filter(|x| x.is_finite());
        let (low, high) = known_ones.fold((f64::MAX, f64::MIN), |(low, high), x| (x.min(low), x.max(high)));
        let (stroke, of_one) = (high - low, OnceCell::new());
        Some(Self { whole, known, recording, part, begun, heard, floor, stroke, of_one, watch })
    }

    /// The same of fewer rows, for what is to be quick.
    #[must_use]
    pub fn beginning(&self) -> Self {
        let short = Part::of_steps(&self.known.axis, self.recording.0, MOST_STEPS_TRIED, 1.0);
        let rows = short.rows.max(self.begun + 10 * BLOCKS).min(self.part.rows);
        Self { part: Part { rows, ..short }, heard: self.heard[..rows].to_vec(), of_one: OnceCell::new(), ..*self }
    }

    /// Measured less replayed position of a machine with the ripples of the known one after the beginning; rows that are not known miss
    /// nothing. `None` where the replay runs away, and when the watch's caller said stop: replays are most of the work.
    #[must_use]
    pub fn error(&self, axis: &Axis) -> Option<Vec<f64>> {
        self.error_of(&self.replayed(axis)?)
    }

    /// The same, and how far each block of that machine is missed as it is replayed, since its servo follows what the encoder is off by: what
    /// no cause explains.
    #[must_use]
    pub fn error_and_unavoidable(&self, axis: &Axis) -> Option<ErrorAndUnavoidable> {
        // Who comes later often asks of the same machine.
        if let Some((_, known)) = self.of_one.get().filter(|(of_one, _)| of_one == axis) {
            return known.clone();
        }
        let found = self.and_unavoidable(axis);
        _ = self.of_one.set((axis.clone(), found.clone()));
        found
    }

    fn and_unavoidable(&self, axis: &Axis) -> Option<ErrorAndUnavoidable> {
        let sensed = || self.through(self.sensors().pop()?, axis);
        let (replayed, sensed) = rayon::join(|| self.replayed(axis), sensed);
        let (replayed, [sensed, _]) = replayed.zip(sensed)?;
        let rows = sensed.iter().zip(&replayed).skip(self.begun);
        let by_sensors: Vec<f64> = rows.map(|(sensed, ideal)| sensed - ideal).collect();
        Some((self.error_of(&replayed)?, self.misses(&by_sensors)))
    }

    fn replayed(&self, axis: &Axis) -> Option<Vec<f64>> {
        self.watch.at(0.98, STAGE).ok()?;
        self.known.manner.replayed(axis, self.recording, self.part, &[]).ok()?
    }

    fn error_of(&self, replayed: &[f64]) -> Option<Vec<f64>> {
        let rows = self.recording.0.position.iter().zip(replayed).skip(self.begun);
        let finite = |error: f64| if error.is_finite() { error } else { 0.0 };
        let error: Vec<f64> = rows.map(|(measured, replayed)| finite(measured - replayed)).collect();
        error.iter().all(|error| error.abs() < self.stroke).then_some(error)
    }

    /// Position and torque that recordings of a machine would show through such an encoder, the torque exactly.
    pub fn recordings_of(&self, axis: &Axis) -> impl Iterator<Item = [Vec<f64>; 2]> {
        self.sensors().into_iter().filter_map(move |sensors| self.through(sensors, axis))
    }

    /// The sensors that this recording may be made by. Where readings rest they hide noise that is small beside their grid, and where there
    /// is none an axis swings about one step; readings that jump to and fro between two steps seem to have noise and need have none.
    fn sensors(&self) -> Vec<Sensors> {
        let grid = statistics::grid(&self.recording.0.position).unwrap_or(0.0);
        let noise = (self.floor.powi(2) - grid * grid / 12.0).max(0.0).sqrt();
        let of = |noise: f64| Sensors { grid_um: 1e3 * grid, noise_um: 1e3 * noise, ..Sensors::default() };
        if noise < OF_STEPS * grid { vec![of(0.0), of(noise.max(FLICKER * grid))] } else { vec![of(noise)] }
    }

    fn through(&self, sensors: Sensors, axis: &Axis) -> Option<[Vec<f64>; 2]> {
        self.watch.at(0.98, STAGE).ok()?;
        let part = Part { sensors, ..self.part };
        self.known.manner.recorded(axis, self.recording, part, &[], &[0..part.rows]).ok()?
    }

    /// The rows of each block after the beginning.
    #[must_use]
    pub fn blocks(&self) -> Vec<Range<usize>> {
        blocks_of(self.part.rows - self.begun).collect()
    }

    /// How far each block is missed, see [`crate::diagnosis::missed::misses`], but for long rests; one that is nothing else by as much as
    /// the encoder is off by.
    #[must_use]
    pub fn misses(&self, error: &[f64]) -> Vec<f64> {
        let heard = &self.heard[self.begun..];
        let miss = |rows: Range<usize>| {
            let heard = error[rows.clone()].iter().zip(&heard[rows]).filter(|(_, heard)| **heard);
            let (sum, count) = heard.fold((0.0, 0.0), |(sum, count), (error, _)| (sum + error * error, count + 1.0));
            miss_of(if count < FEWEST_ROWS { 1.0 } else { sum / count / self.floor.powi(2) })
        };
        self.blocks().into_iter().map(miss).collect()
    }

    /// By how much less each block is missed by an error.
    #[must_use]
    pub fn gained(&self, misses: &[f64], error: &[f64]) -> Vec<f64> {
        misses.iter().zip(self.misses(error)).map(|(before, after)| before - after).collect()
    }

    /// What is said of an error: the geometric mean of blocks, above what the encoder itself is off by.
    #[must_use]
    pub fn says(&self, error: &[f64], axis: &Axis) -> String {
        let typical = 1e3 * self.floor * (2.0 * mean(&self.misses(error), Over::All)).exp_m1().sqrt();
        let unit = if axis.drive.is_rotary() { "thousandths of a degree" } else { "µm" };
        format!("{typical:.3} {unit}")
    }

    /// How much of what some blocks are missed by, beyond what the encoder itself is off by, would be gone if the loop went on the way from one
    /// error to another for as long as is best: a share of its squares, each block by its own weight. 0 where it would have to go back.
    #[must_use]
    pub fn alike(&self, before: &[f64], there: &[f64], over: Over) -> f64 {
        let (mut along, mut way, mut missed) = (0.0, 0.0, 0.0);
        for (rows, weight) in self.weighed(before, over) {
            let (before, there) = (&before[rows.clone()], &there[rows]);
            let steps = || before.iter().zip(there).map(|(before, there)| (before, before - there));
            along += weight * steps().map(|(before, step)| before * step).sum::<f64>();
            way += weight * steps().map(|(_, step)| step * step).sum::<f64>();
            let beyond = mean_square(before) - self.floor.powi(2);
            missed += weight * beyond.max(0.0) * before.len() as f64;
        }
        if along > 0.0 && way * missed > 0.0 { (along * along / (way * missed)).min(1.0) } else { 0.0 }
    }

    /// The rows of some blocks after the beginning, with the weight by which their squares count, so that all blocks count alike.
    pub fn weighed(&self, error: &[f64], over: Over) -> impl Iterator<Item = (Range<usize>, f64)> {
        let blocks = self.blocks().into_iter().enumerate().filter(move |(block, _)| over.has(*block));
        blocks.map(|(_, rows)| {
            let weight = (mean_square(&error[rows.clone()]) + self.floor.powi(2)).recip();
            (rows, weight)
        })
    }

    /// Which rows of the recording lie in blocks of one half or the other.
    #[must_use]
    pub fn lies_in(&self, over: Over) -> Vec<bool> {
        let mut lies = vec![false; self.recording.0.time_s.len()];
        for (_, rows) in self.blocks().into_iter().enumerate().filter(|(block, _)| over.has(*block)) {
            lies[rows.start + self.begun..rows.end + self.begun].fill(true);
        }
        lies
    }
}

/// Which rows are not of a long rest: where within its friction an axis came to rest is partly chance, and that is not to count over and
/// over.
fn rows_but_for_long_rests(observed: &Observed, rows: usize) -> Vec<bool> {
    let (motion, standing) = (&observed.motion, observed.motion.standing_speed());
    let mut since = 0;
    let is_heard = |row: usize| {
        since = if motion.velocity(row).abs() > standing { row } else { since };
        (row - since) as f64 * observed.period_s <= LONG_REST_S
    };
    (0..rows).map(is_heard).collect()
}
