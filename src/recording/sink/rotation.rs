//! A recording cut into files: `run.csv` alone, or `run-0001.csv`, `run-0002.csv` and so on, each readable by itself.

use std::collections::VecDeque;
use std::io;
use std::path::{Path, PathBuf};

use super::{Head, Rows, Sink};

/// What has been written.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Written {
    /// Files begun.
    pub files: u32,
    /// Files removed again, the oldest first.
    pub removed: u32,
    /// Rows.
    pub rows: u64,
    /// Rows that were lost.
    pub lost: u64,
    /// Places at which rows were lost.
    pub gaps: u64,
}

/// Writes rows into one file after the other.
pub struct Rotation {
    path: PathBuf,
    head: Head,
    /// Rows of a file; 0 for one file without end.
    rows_a_file: u64,
    /// Files that are kept; 0 for all.
    keep: usize,
    sink: Option<Sink>,
    /// Rows in the present file.
    rows: u64,
    names: VecDeque<PathBuf>,
    /// What has been written so far.
    pub written: Written,
}

impl Rotation {
    /// Begins the first file. `rows_a_file` 0: only one; `keep` 0: none is removed.
    ///
    /// # Errors
    /// It is there already, or cannot be made.
    pub fn create(path: &Path, head: Head, rows_a_file: u64, keep: usize) -> io::Result<Rotation> {
        let path = path.to_owned();
        let (names, written) = (VecDeque::new(), Written::default());
        let mut rotation = Rotation { path, head, rows_a_file, keep, sink: None, rows: 0, names, written };
        rotation.begin()?;
        Ok(rotation)
    }

    /// The file that is being written.
    #[must_use]
    pub fn file(&self) -> &Path {
        self.names.back().unwrap_or(&self.path)
    }

    fn begin(&mut self) -> io::Result<()> {
        if let Some(sink) = self.sink.take() {
            sink.finish()?;
        }
        let name = if self.rows_a_file == 0 { self.path.clone() } else { numbered(&self.path, self.written.files + 1) };
        self.names.push_back(name);
        self.sink = Some(Sink::create(self.file(), &self.head)?);
        self.rows = 0;
        self.written.files += 1;
        while self.keep > 0 && self.names.len() > self.keep {
            if let Some(oldest) = self.names.pop_front() {
                std::fs::remove_file(oldest)?;
                self.written.removed += 1;
            }
        }
        Ok(())
    }

    /// Adds rows. After an error the files hold what they held before, and can be read.
    ///
    /// # Errors
    /// The disk is full, or the file cannot be written.
    pub fn write(&mut self, rows: &Rows) -> io::Result<()> {
        let columns = self.head.columns.len().max(1);
        let mut rest = *rows;
        while !rest.values.is_empty() {
            if self.rows_a_file > 0 && self.rows >= self.rows_a_file {
                self.begin()?;
            }
            let room = if self.rows_a_file == 0 { u64::MAX } else { self.rows_a_file - self.rows };
            let count = (rest.values.len() / columns).min(usize::try_from(room).unwrap_or(usize::MAX));
            let (now, later) = rest.values.split_at(count * columns);
            if let Some(sink) = &mut self.sink {
                sink.write(&Rows { values: now, ..rest })?;
            }
            self.rows += count as u64;
            self.written.rows += count as u64;
            self.written.lost += rest.lost;
            self.written.gaps += u64::from(rest.lost > 0);
            rest = Rows { first_s: rest.first_s + count as f64 * rest.row_s, lost: 0, values: later, ..rest };
        }
        Ok(())
    }

    /// Ends the present file and with it the recording.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn finish(&mut self) -> io::Result<()> {
        self.sink.take().map_or(Ok(()), Sink::finish)
    }
}

/// `run.csv` as `run-0001.csv`.
fn numbered(path: &Path, number: u32) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let ext = path.extension().map(|ext| format!(".{}", ext.to_string_lossy())).unwrap_or_default();
    path.with_file_name(format!("{stem}-{number:04}{ext}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::Recording;

    fn head() -> Head {
        Head { machine: "rig".into(), columns: vec!["x.position_mm".into(), "x.torque_nm".into()] }
    }

    #[test]
    fn pieces_read_back_and_say_what_was_lost() {
        let folder = tempfile::tempdir().unwrap();
        let mut rotation = Rotation::create(&folder.path().join("run.csv"), head(), 4, 2).unwrap();
        for start in 0..5_u32 {
            let values: Vec<f64> = (0..6).map(|i| f64::from(10 * start + i) / 3.0).collect();
            let rows =
                Rows { first_s: 0.003 * f64::from(start), row_s: 0.001, lost: u64::from(start == 3), values: &values };
            rotation.write(&rows).unwrap();
        }
        rotation.finish().unwrap();
        assert_eq!(rotation.written, Written { files: 4, removed: 2, rows: 15, lost: 1, gaps: 1 });
        assert!(!folder.path().join("run-0002.csv").exists());
        let read = Recording::open(&folder.path().join("run-0003.csv")).unwrap();
        assert_eq!(*read.time_s, [0.008, 0.009, 0.010, 0.011]);
        assert_eq!(read.columns[0].values[1], 10.0);
        assert_eq!(read.columns[1].values[3], 35.0 / 3.0);
        assert_eq!(
            (read.columns[2].name.as_str(), &read.columns[2].values[..]),
            ("rig.lost_rows", &[0.0, 1.0, 0.0, 0.0][..])
        );
        assert!(read.columns[2].label.is_none());
        // What is there is never written over.
        let taken = Rotation::create(&folder.path().join("run-0003.csv"), head(), 0, 0);
        assert_eq!(taken.err().unwrap().kind(), io::ErrorKind::AlreadyExists);
    }

    #[test]
    fn what_is_no_number_is_an_empty_cell() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.csv");
        let mut rotation = Rotation::create(&path, head(), 0, 0).unwrap();
        let values = [1.5, f64::NAN, f64::INFINITY, -2e-12];
        rotation.write(&Rows { first_s: 0.0, row_s: 0.001, lost: 0, values: &values }).unwrap();
        rotation.finish().unwrap();
        let text = std::fs::read_to_string(path).unwrap();
        assert_eq!(text.lines().nth(1), Some("0.000000000,1.5,,0"));
        assert_eq!(text.lines().nth(2), Some("0.001000000,,-0.000000000002,0"));
    }
}
