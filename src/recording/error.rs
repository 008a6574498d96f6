//! What is wrong with a recording, said so that the reader of the message can repair it: file, row, column, what was
//! found, what is allowed.

use std::fmt;

/// Why a recording cannot be read, or cannot serve an analysis.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RecordingError {
    /// The file as the user named it.
    pub file: String,
    /// Row in the file, 1 for the header; `None` where no single row is at fault.
    pub row: Option<usize>,
    /// Name of the column at fault; `None` where no single one is.
    pub column: Option<String>,
    /// What was found, what is allowed, what to do: one sentence.
    pub message: String,
}

impl RecordingError {
    /// An error of the whole file.
    pub fn new(file: &str, message: impl Into<String>) -> Self {
        Self { file: file.to_owned(), row: None, column: None, message: message.into() }
    }

    /// The same error, at this row (1 is the header).
    #[must_use]
    pub fn at_row(mut self, row: usize) -> Self {
        self.row = Some(row);
        self
    }

    /// The same error, in this column.
    #[must_use]
    pub fn in_column(mut self, column: &str) -> Self {
        self.column = Some(column.to_owned());
        self
    }
}

impl fmt::Display for RecordingError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.file)?;
        match (self.row, &self.column) {
            (Some(row), Some(column)) => write!(f, ", row {row}, column {column}")?,
            (Some(row), None) => write!(f, ", row {row}")?,
            (None, Some(column)) => write!(f, ", column {column}")?,
            (None, None) => {}
        }
        write!(f, ": {}", self.message)
    }
}

impl std::error::Error for RecordingError {}
