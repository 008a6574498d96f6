//! What a diagnosis takes of a recording: the rows that it works on. The recording, which may be large, is not needed afterwards.

use super::columns::PIECES;
use super::frame::Columns;
use crate::machine::Axis;
use crate::recording::{IssueKind, Recording, RecordingError, Signal};

/// The rows of a recording that a diagnosis of an axis works on, 480 000 at most, and what must be known of the others.
#[derive(Debug, Clone)]
pub struct Excerpt {
    pub(super) columns: Result<Columns, RecordingError>,
    pub(super) notes: Vec<String>,
}

impl Excerpt {
    /// Of an axis. A recording that has not its columns makes an excerpt, too: see [`Excerpt::usable`].
    #[must_use]
    pub fn of(recording: &Recording, axis: &Axis) -> Self {
        let columns = Columns::of(recording, axis);
        let notes = columns.as_ref().map_or_else(|_| Vec::new(), |columns| notes(columns, recording, axis));
        Self { columns, notes }
    }

    /// Whether the recording has the columns that a diagnosis of this axis needs.
    ///
    /// # Errors
    /// Position or torque (force) is missing or in a wrong unit.
    pub fn usable(&self) -> Result<(), &RecordingError> {
        self.columns.as_ref().map(|_| ())
    }
}

/// What a reader must know of the rows of a recording that are not among these, or not as they were recorded.
fn notes(columns: &Columns, recording: &Recording, axis: &Axis) -> Vec<String> {
    let (used, all) = (columns.time_s.len(), columns.time_s.len() + columns.left_out);
    let text = || {
        format!(
            "{all} rows are more than are worked on: {used} of them were, in {PIECES} evenly spread stretches; the gain in position, for which the loop is replayed without a break, takes a shorter recording"
        )
    };
    let mut notes: Vec<String> = if columns.left_out > 0 { vec![text()] } else { Vec::new() };
    notes.extend(amiss(recording, axis));
    notes
}

/// What is amiss with the rows of an axis's columns, what became of them, and what to do.
fn amiss<'r>(recording: &'r Recording, axis: &'r Axis) -> impl Iterator<Item = String> + 'r {
    let read = |name: &str| {
        let label = recording.columns.iter().find(|c| c.name == name).and_then(|c| c.label.as_ref());
        use Signal::{Force, Position, PositionCommand, TablePosition, Torque};
        let signals = [Position, PositionCommand, TablePosition, Torque, Force];
        name == "time_s" || label.is_some_and(|l| l.channel == axis.name && signals.contains(&l.signal))
    };
    let concerned = recording.issues.iter().filter(move |issue| issue.column.as_deref().is_none_or(read));
    concerned.filter_map(|issue| {
        let what_to_do = match issue.kind {
            IssueKind::RepeatedTime => "write times with more decimals",
            IssueKind::Gap => "what lies between gaps is judged; record every row if much is missing",
            IssueKind::IrregularSampling => "rows are taken as even where the motion is smoother so, else interpolated to even steps; record one a servo cycle",
            IssueKind::NotFinite => "the rows around them are judged; record again if they are many",
            IssueKind::Jump | IssueKind::Outlier => "look at encoder and cable if it happens again",
            IssueKind::Implausible => "look at how the column comes into the file if it happens again",
            IssueKind::Wrap => "nothing need be done",
            IssueKind::WrongUnit | IssueKind::UnknownColumn => return None,
        };
        Some(format!("{issue}: {what_to_do}"))
    })
}
