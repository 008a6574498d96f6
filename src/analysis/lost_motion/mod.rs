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

use std::fmt;

use crate::recording::RecordingError;

/// Reversals up to this many times faster than the slowest are used: steady slow motion is what defines lost motion.
const SPEED_RATIO: f64 = 3.0;

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
    /// It turns round, but at no reversal does the torque show a release and a wind-up: why, for each.
    NoCurve(Vec<String>),
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Refusal::Recording(why) => write!(f, "{why}"),
            Refusal::PositionsDiffer(why) => write!(f, "positions differ: {why}"),
            Refusal::NoReversal => write!(
                f,
                "no reversal: the axis never turns round; record slow motion one way and back over the same stretch"
            ),
            Refusal::NoUsableReversal { seen, few_rows, short, still } => write!(
                f,
                "no usable reversal: of {seen}, {few_rows} share fewer than 12 rows in motion before and after, {short} are \
                 too short for the table to move steadily, and in {still} the table does not follow the motor; move further \
                 (ten times the lost motion at least) and slower"
            ),
            Refusal::NoCurve(why) => {
                let shown: Vec<&str> = why.iter().take(3).map(String::as_str).collect();
                write!(
                    f,
                    "no torque curve: at none of {} reversals does the torque show a release and a wind-up ({}{}); slide slowly \
                     one way, reverse without a pause, and slide on until the torque is steady",
                    why.len(),
                    shown.join("; "),
                    if why.len() > 3 { "; …" } else { "" }
                )
            }
        }
    }
}

impl std::error::Error for Refusal {}

impl From<RecordingError> for Refusal {
    fn from(why: RecordingError) -> Self {
        Refusal::Recording(why)
    }
}
