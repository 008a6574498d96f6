//! Writes a recording that grows: CSV, or Parquet with the feature `parquet`, cut into files of a given length.
//!
//! What is written stays readable, whatever ends it: a full disk, a signal, a process that is killed (Parquet then lacks
//! its last file). The column `<machine>.lost_rows` says how many rows are missing right before a row.

mod csv;
#[cfg(feature = "parquet")]
mod parquet;
mod rotation;

use std::fs::File;
use std::io;
use std::path::Path;

pub use rotation::{Rotation, Written};

/// Rows as they come from a recorder.
#[derive(Debug, Clone, Copy)]
pub struct Rows<'a> {
    /// Time of the first row, s.
    pub first_s: f64,
    /// Seconds from row to row.
    pub row_s: f64,
    /// Rows missing before the first.
    pub lost: u64,
    /// The values, row by row.
    pub values: &'a [f64],
}

/// What stands in the header.
#[derive(Debug, Clone)]
pub struct Head {
    /// Name of the machine.
    pub machine: String,
    /// Names of the columns, without the time.
    pub columns: Vec<String>,
}

impl Head {
    /// All columns in their order: time, channels, lost rows.
    fn names(&self) -> impl Iterator<Item = String> {
        let lost = format!("{}.lost_rows", self.machine);
        std::iter::once("time_s".to_owned()).chain(self.columns.iter().cloned()).chain(std::iter::once(lost))
    }
}

/// One file of a recording.
enum Sink {
    Csv(csv::CsvSink),
    #[cfg(feature = "parquet")]
    Parquet(Box<parquet::ParquetSink>),
}

/// Whether a path asks for Parquet.
fn is_parquet(path: &Path) -> bool {
    path.extension().is_some_and(|ext| ext.eq_ignore_ascii_case("parquet"))
}

impl Sink {
    /// Begins a file, which must not be there yet.
    fn create(path: &Path, head: &Head) -> io::Result<Sink> {
        if is_parquet(path) {
            #[cfg(feature = "parquet")]
            return Ok(Sink::Parquet(Box::new(parquet::ParquetSink::create(File::create_new(path)?, head)?)));
            #[cfg(not(feature = "parquet"))]
            return Err(io::Error::new(
                io::ErrorKind::Unsupported,
                "this gib was built without Parquet; build it with `--features parquet`, or name a .csv file",
            ));
        }
        Ok(Sink::Csv(csv::CsvSink::create(File::create_new(path)?, head)?))
    }

    /// Adds rows. After an error the file holds what it held before, and can be read.
    fn write(&mut self, rows: &Rows) -> io::Result<()> {
        match self {
            Sink::Csv(sink) => sink.write(rows),
            #[cfg(feature = "parquet")]
            Sink::Parquet(sink) => sink.write(rows),
        }
    }

    /// Ends the file.
    fn finish(self) -> io::Result<()> {
        match self {
            Sink::Csv(sink) => sink.finish(),
            #[cfg(feature = "parquet")]
            Sink::Parquet(sink) => sink.finish(),
        }
    }
}
