//! Lost motion of an axis from a recording.
//!
//! What a reversal loses is the change of (motor − table) between steady slow motion one way and the other. With a scale on
//! the table it is read off directly ([`from_positions`]); without one it is estimated from
//! the motor's torque ([`from_torque`]).

pub mod from_positions;
pub mod from_torque;
mod motor_friction;
mod pair;
mod sweeps;
mod time_skew;
mod whole;

use std::fmt;

use crate::recording::{Column, Recording, RecordingError};
use whole::FEWEST_ROWS;

/// Reversals up to this many times faster than the slowest are used: steady slow motion is what defines lost motion.
const SPEED_RATIO: f64 = 3.0;

/// A gap of more rows than this ends a piece: the axis may have turned round unseen.
const LONGEST_GAP_ROWS: f64 = 20.0;

/// Rows of unbroken pieces in which all of `columns` hold a number.
fn unbroken(recording: &Recording, columns: &[&Column]) -> Vec<Vec<usize>> {
    let longest_s = recording.sampling.gap_s.max(LONGEST_GAP_ROWS * recording.sampling.period_s);
    recording.pieces(columns, longest_s)
}

/// Lost motion with its expanded uncertainty (k = 2, about 95 %), both in the unit of the result.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Value {
    /// The lost motion.
    pub value: f64,
    /// Its expanded uncertainty.
    pub uncertainty: f64,
}

/// Why no value is given.
#[derive(Debug, Clone, PartialEq)]
pub enum Refusal {
    /// The recording lacks a column, or holds what cannot be used.
    Recording(RecordingError),
    /// The two positions are a length and an angle, or do not follow each other one to one.
    PositionsDiffer(String),
    /// The axis never turns round.
    NoReversal,
    /// Its effort is never steady in this direction.
    NotSteady {
        /// `positive` or `negative`.
        direction: &'static str,
    },
    /// Sliding takes the same effort both ways, as far as noise lets it see: in the negative direction, and in the positive.
    SameEffort([f64; 2]),
    /// The effort is higher in the negative direction than in the positive, as no friction makes it: both of them.
    SignTurned([f64; 2]),
    /// So it is too, but friction takes work on the whole: the axis brakes there.
    Braking([f64; 2]),
    /// It turns round, but after no reversal both positions move steadily over the same stretch.
    NoUsableReversal {
        /// Reversals seen.
        seen: usize,
        /// Of these, how many share too few rows in motion.
        few_rows: usize,
        /// Of these, how many are too short for the table to move steadily.
        short: usize,
        /// Of these, in how many the table does not follow the motor.
        still: usize,
    },
    /// It turns round, but at no reversal does the torque show a release and a wind-up: the row of each, and why.
    NoCurve(Vec<(usize, String)>),
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Refusal::Recording(why) => write!(f, "{why}"),
            Refusal::PositionsDiffer(why) => write!(f, "positions differ: {why}"),
            Refusal::NoReversal => write!(
                f,
                "no reversal: nowhere does the axis go one way and then, without a gap, a quarter of its stroke the other way; record \
                 slow motion one way and back over the same stretch"
            ),
            Refusal::NotSteady { direction } => write!(
                f,
                "not steady: in the {direction} direction no long way has {FEWEST_ROWS} rows at one speed in its last third; go \
                 further at constant speed, slower, or record more often"
            ),
            Refusal::SameEffort([negative, positive]) => write!(
                f,
                "no friction: sliding takes {negative:.4} in the negative direction and {positive:.4} in the positive, which noise \
                 alone may make; record the effort that the motor gives, over longer ways or more of them"
            ),
            Refusal::SignTurned([negative, positive]) => write!(
                f,
                "sign turned: sliding takes {negative:.4} in the negative direction and {positive:.4} in the positive, but friction \
                 acts against the motion; turn the sign of the effort round"
            ),
            Refusal::Braking([negative, positive]) => write!(
                f,
                "braking: toward the end of the long ways the effort is {negative:.4} in the negative direction and \
                 {positive:.4} in the positive, which stops the axis and is not friction; go slower, at constant speed up to \
                 the end, or give the machine file, so that what moves the masses is taken off"
            ),
            Refusal::NoUsableReversal { seen, few_rows, short, still } => write!(
                f,
                "no usable reversal: of {seen}, {few_rows} share fewer than 12 rows in motion before and after, {short} are \
                 too short for the table to move steadily, and in {still} the table does not follow the motor; move further \
                 (ten times the lost motion at least) and slower"
            ),
            Refusal::NoCurve(why) => write!(
                f,
                "no torque curve: at none of {} reversals does the torque show a release and a wind-up ({}); slide slowly one \
                 way, reverse without a pause, and slide on until the torque is steady",
                why.len(),
                counted(why)
            ),
        }
    }
}

/// The reasons by how many reversals have them, each with the row of the first.
fn counted(why: &[(usize, String)]) -> String {
    let mut reasons: Vec<(&str, usize, usize)> = Vec::new();
    for (row, reason) in why {
        match reasons.iter_mut().find(|(known, ..)| known == reason) {
            Some((_, count, _)) => *count += 1,
            None => reasons.push((reason, 1, *row)),
        }
    }
    reasons.sort_by_key(|(_, count, _)| std::cmp::Reverse(*count));
    let texts = reasons.iter().map(|(reason, count, row)| match count {
        1 => format!("row {row}: {reason}"),
        _ => format!("row {row} and {} more: {reason}", count - 1),
    });
    texts.collect::<Vec<String>>().join("; ")
}

impl std::error::Error for Refusal {}

impl From<RecordingError> for Refusal {
    fn from(why: RecordingError) -> Self {
        Refusal::Recording(why)
    }
}
