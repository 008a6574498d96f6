//! Recordings of a machine: one time column, then one column a signal, as CSV (or Parquet with the feature `parquet`).
//!
//! [`Recording::open`] reads the file once and checks it: what cannot be repaired is a [`RecordingError`] with file, row and
//! column; what can be worked around (gaps, repeats, NaN, counter wraps, irregular sampling) is listed in
//! [`Recording::issues`]. Nothing questionable reaches an analysis silently: [`Recording::need`] refuses a column that holds
//! NaN, and [`Recording::runs`] gives the stretches of rows that are whole.
//!
//! Values stay as recorded, in the unit of the column's name; [`Column::to`] and [`Column::in_house`] convert.

mod check;
mod csv;
mod error;
mod label;
#[cfg(feature = "parquet")]
mod parquet;
pub mod ring;
mod sampling;
pub mod sink;

use std::borrow::Cow;
use std::fs::File;
use std::ops::Range;
use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::sync::Arc;

pub use check::{Issue, IssueKind};
pub use error::RecordingError;
pub use label::{Label, Name, Signal, Unit};
pub use sampling::{Hole, Sampling};

/// One column: its header, what it means, and its values in the unit of its name.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// The header as it stands in the file.
    pub name: String,
    /// What the header says; `None` for a column outside the format, which is kept and ignored.
    pub label: Option<Label>,
    /// One value a row. NaN where the cell was empty, not finite or an outlier.
    pub values: Vec<f64>,
    /// Rows at which the value jumps by an amount that neither motion nor a counter wrap explains, ascending.
    pub(crate) breaks: Vec<usize>,
}

impl Column {
    /// A column by its header name.
    #[must_use]
    pub fn new(name: &str, values: Vec<f64>) -> Self {
        let label = match Name::parse(name) {
            Name::Known(label) => Some(label),
            _ => None,
        };
        Self { name: name.to_owned(), label, values, breaks: Vec::new() }
    }

    /// The values in `unit`, borrowed where they already are; `None` when the column measures another quantity.
    #[must_use]
    pub fn to(&self, unit: Unit) -> Option<Cow<'_, [f64]>> {
        let factor = self.label.as_ref()?.unit.factor_to(unit)?;
        if factor == 1.0 {
            return Some(Cow::Borrowed(&self.values));
        }
        Some(Cow::Owned(self.values.iter().map(|value| value * factor).collect()))
    }

    /// The values in the unit gib computes this quantity in ([`Unit::house`]); `None` for a column outside the format.
    #[must_use]
    pub fn in_house(&self) -> Option<(Cow<'_, [f64]>, Unit)> {
        let unit = self.label.as_ref()?.unit.house();
        Some((self.to(unit)?, unit))
    }
}

/// A whole recording in memory.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// The file as the user named it, for messages.
    pub file: String,
    /// Time of each row in seconds, strictly increasing, finite; long recordings have no room for a copy.
    pub time_s: Arc<Vec<f64>>,
    /// All columns but the time, in file order.
    pub columns: Vec<Column>,
    /// Of each row that repeated the time of the one before it and was left out, the row that it followed.
    pub repeats: Vec<usize>,
    /// How the rows lie in time.
    pub sampling: Sampling,
    /// Where rows are missing, in order.
    pub holes: Vec<Hole>,
    /// What was found and worked around.
    pub issues: Vec<Issue>,
}

impl Recording {
    /// Reads the file at `path`: Parquet by its extension, CSV otherwise.
    ///
    /// # Errors
    /// When the file cannot be read, or does not follow the format; the message names row and column.
    pub fn open(path: &Path) -> Result<Self, RecordingError> {
        let name = path.display().to_string();
        if path.extension().is_some_and(|ext| ext.eq_ignore_ascii_case("parquet")) {
            return Self::open_parquet(path, &name);
        }
        let file = File::open(path).map_err(|why| RecordingError::new(&name, format!("cannot be opened: {why}")))?;
        let length = file.metadata().map_or(0, |meta| meta.len());
        Self::read_csv(file, &name, length)
    }

    #[cfg(feature = "parquet")]
    fn open_parquet(path: &Path, name: &str) -> Result<Self, RecordingError> {
        let (time_s, columns) = parquet::read(path, name)?;
        Self::from_columns(name, time_s, columns)
    }

    #[cfg(not(feature = "parquet"))]
    fn open_parquet(_: &Path, name: &str) -> Result<Self, RecordingError> {
        Err(RecordingError::new(
            name,
            "this gib was built without Parquet; build it with `--features parquet`, or give the recording as CSV",
        ))
    }

    /// Reads CSV from anything; `name` stands in messages, `length` is the expected number of bytes (0 when unknown).
    ///
    /// # Errors
    /// As [`Recording::open`].
    pub fn read_csv(source: impl std::io::Read, name: &str, length: u64) -> Result<Self, RecordingError> {
        let (time_s, columns) = csv::read(source, name, length)?;
        Self::from_columns(name, time_s, columns)
    }

    /// A recording from columns in memory, checked like a file.
    ///
    /// # Errors
    /// Columns of unequal length, two columns of one name or meaning, time that is not finite or runs backward, fewer than
    /// two rows.
    pub fn from_columns(file: &str, time_s: Vec<f64>, columns: Vec<Column>) -> Result<Self, RecordingError> {
        check::checked(file, time_s, columns)
    }

    /// Number of rows.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.time_s.len()
    }

    /// The channels in file order: `x`, `spindle`, `base` …
    #[must_use]
    pub fn channels(&self) -> Vec<&str> {
        let mut channels: Vec<&str> = Vec::new();
        for label in self.columns.iter().filter_map(|column| column.label.as_ref()) {
            if !channels.contains(&label.channel.as_str()) {
                channels.push(&label.channel);
            }
        }
        channels
    }

    /// The column of this channel and signal, where there is one.
    #[must_use]
    pub fn get(&self, channel: &str, signal: Signal) -> Option<&Column> {
        self.columns.iter().find(|column| {
            column.label.as_ref().is_some_and(|label| label.channel == channel && label.signal == signal)
        })
    }

    /// The column of this channel and signal, taken out of the recording.
    pub fn take(&mut self, channel: &str, signal: Signal) -> Option<Column> {
        let wanted = |label: &Label| label.channel == channel && label.signal == signal;
        let at = self.columns.iter().position(|column| column.label.as_ref().is_some_and(wanted))?;
        Some(self.columns.remove(at))
    }

    /// The column of this channel and signal.
    ///
    /// # Errors
    /// Names the missing column, the units it may come in, and the columns that are there.
    pub fn column(&self, channel: &str, signal: Signal) -> Result<&Column, RecordingError> {
        self.get(channel, signal).ok_or_else(|| {
            let unit = |column: &'_ Column| match Name::parse(&column.name) {
                Name::WrongUnit { signal: found, unit } if found == signal => {
                    column.name.starts_with(&format!("{channel}.")).then_some((column.name.clone(), unit))
                }
                _ => None,
            };
            let units: Vec<&str> = signal.units().iter().map(|unit| unit.suffix()).collect();
            let wanted = format!("{channel}.{}_{}", signal.name(), units.first().copied().unwrap_or_default());
            if let Some((name, unit)) = self.columns.iter().find_map(unit) {
                let found = if unit.is_empty() {
                    "no unit".to_owned()
                } else {
                    format!("the unit {unit:?}, which is not known")
                };
                let message = format!(
                    "has {found}; {} comes in {}: convert the values and call the column {wanted}",
                    signal.name(),
                    units.join(", ")
                );
                return RecordingError::new(&self.file, message).at_row(1).in_column(&name);
            }
            let have: Vec<&str> = self.columns.iter().map(|column| column.name.as_str()).collect();
            let also = if units.len() > 1 { format!(" (or in {})", units[1..].join(", ")) } else { String::new() };
            RecordingError::new(
                &self.file,
                format!("needs a column {wanted}{also}, which is missing; columns found: {}", have.join(", ")),
            )
        })
    }

    /// The values of a column in `unit`, whole: no NaN among them.
    ///
    /// # Errors
    /// The column is missing, measures another quantity, or holds NaN (the first such row is named).
    pub fn need(&self, channel: &str, signal: Signal, unit: Unit) -> Result<Cow<'_, [f64]>, RecordingError> {
        let column = self.column(channel, signal)?;
        let values = column.to(unit).ok_or_else(|| {
            RecordingError::new(&self.file, format!("is needed in {} or a unit that converts to it", unit.suffix()))
                .in_column(&column.name)
        })?;
        match values.iter().position(|value| !value.is_finite()) {
            None => Ok(values),
            Some(row) => Err(RecordingError::new(
                &self.file,
                "is empty or not a finite number, and this analysis needs every row; remove such rows or repair the column",
            )
            .at_row(file_row(row))
            .in_column(&column.name)),
        }
    }

    /// The stretches of rows in which every one of `columns` is finite and nothing breaks: no gap in time, no jump. In order,
    /// disjoint, each at least two rows.
    #[must_use]
    pub fn runs(&self, columns: &[&Column]) -> Vec<Range<usize>> {
        let mut runs = Vec::new();
        let mut start = 0;
        let mut close = |start: usize, end: usize| {
            if end >= start + 2 {
                runs.push(start..end);
            }
        };
        let mut next = self.holes.iter().map(|hole| hole.row).peekable();
        for row in 0..self.rows() {
            let finite = finite(columns, row);
            let hole = next.next_if_eq(&row).is_some();
            if !finite || hole || columns.iter().any(|column| column.breaks.binary_search(&row).is_ok()) {
                close(start, row);
                start = if finite { row } else { row + 1 };
            }
        }
        close(start, self.rows());
        runs
    }

    /// The rows in which every one of `columns` is finite, split only at jumps and where more than `longest_s` is missing:
    /// for analyses that bear uneven steps. Each piece has at least two rows.
    #[must_use]
    pub fn pieces(&self, columns: &[&Column], longest_s: f64) -> Vec<Vec<usize>> {
        let mut pieces: Vec<Vec<usize>> = vec![Vec::new()];
        let mut last_s = f64::NEG_INFINITY;
        for row in 0..self.rows() {
            let jumps = columns.iter().any(|column| column.breaks.binary_search(&row).is_ok());
            if jumps || (finite(columns, row) && self.time_s[row] - last_s > longest_s) {
                pieces.push(Vec::new());
            }
            if finite(columns, row) {
                last_s = self.time_s[row];
                if let Some(piece) = pieces.last_mut() {
                    piece.push(row);
                }
            }
        }
        pieces.retain(|piece| piece.len() >= 2);
        pieces
    }
}

fn finite(columns: &[&Column], row: usize) -> bool {
    columns.iter().all(|column| column.values.get(row).is_some_and(|value| value.is_finite()))
}

/// Whether two paths lead to one file, by whatever name or link.
#[must_use]
pub fn is_same_file(one: &Path, other: &Path) -> bool {
    let file = |path: &Path| path.metadata().ok().filter(|meta| meta.is_file()).map(|meta| (meta.dev(), meta.ino()));
    file(one).is_some_and(|one| file(other) == Some(one))
}

/// Whether a column of this name is left alone, whatever stands in it: nobody asks for it.
fn is_ignored(name: &str) -> bool {
    name != "time_s" && !matches!(Name::parse(name), Name::Known(_))
}

/// The row of the file in which data row `index` (from 0) stands: the header is row 1.
#[must_use]
pub const fn file_row(index: usize) -> usize {
    index + 2
}
