//! CSV that grows row by whole row. Numbers are as short as they can be and still read back the same.

use std::fs::File;
use std::io::{self, Seek, Write};

use super::{Head, Rows};

/// A CSV file being written.
pub(super) struct CsvSink {
    file: File,
    /// Bytes of the whole rows in the file.
    good: u64,
    columns: usize,
    text: Vec<u8>,
}

impl CsvSink {
    /// Writes the header.
    pub(super) fn create(file: File, head: &Head) -> io::Result<CsvSink> {
        let mut sink = CsvSink { file, good: 0, columns: head.columns.len(), text: Vec::new() };
        let names: Vec<String> = head.names().collect();
        sink.text.extend_from_slice(names.join(",").as_bytes());
        sink.text.push(b'\n');
        sink.put()?;
        Ok(sink)
    }

    /// Adds rows, all or none of them.
    pub(super) fn write(&mut self, rows: &Rows) -> io::Result<()> {
        self.text.clear();
        let mut lost = rows.lost;
        for (number, row) in rows.values.chunks_exact(self.columns).enumerate() {
            // Nanoseconds: a servo period has no finer parts.
            write!(self.text, "{:.9}", rows.first_s + number as f64 * rows.row_s)?;
            for value in row {
                self.text.push(b',');
                // What is no number is an empty cell, which every reader knows as missing.
                if value.is_finite() {
                    write!(self.text, "{value}")?;
                }
            }
            writeln!(self.text, ",{lost}")?;
            lost = 0;
        }
        self.put()
    }

    fn put(&mut self) -> io::Result<()> {
        let written = self.file.write_all(&self.text);
        if written.is_ok() {
            self.good += self.text.len() as u64;
        } else {
            // Part of a row would make the whole file unreadable.
            self.file.set_len(self.good)?;
            self.file.seek(io::SeekFrom::Start(self.good))?;
        }
        written
    }

    /// Brings it to the disk.
    pub(super) fn finish(self) -> io::Result<()> {
        self.file.sync_all()
    }
}
