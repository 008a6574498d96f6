//! Parquet that grows by row groups. The file can only be read once its end is written: room for that is set aside before
//! each row group, so that a full disk never costs what came before.

use std::fs::File;
use std::io;
use std::os::fd::AsFd;
use std::sync::Arc;

use ::parquet::data_type::DoubleType;
use ::parquet::errors::ParquetError;
use ::parquet::file::metadata::KeyValue;
use ::parquet::file::properties::WriterProperties;
use ::parquet::file::writer::SerializedFileWriter;
use ::parquet::schema::types::Type;
use rustix::fs::{FallocateFlags, fallocate};

use super::{Head, Rows};

/// Rows of a group.
const GROUP_ROWS: usize = 65_536;
/// Bytes that the end of the file takes: a description of every column of every group.
const END_BYTES_A_COLUMN: u64 = 1024;

/// A Parquet file being written.
pub(super) struct ParquetSink {
    file: File,
    writer: SerializedFileWriter<File>,
    /// The group that is being filled, column by column.
    group: Vec<Vec<f64>>,
    groups: u64,
}

impl ParquetSink {
    /// Begins the file.
    pub(super) fn create(file: File, head: &Head) -> io::Result<ParquetSink> {
        let double = |name: String| {
            Type::primitive_type_builder(&name, ::parquet::basic::Type::DOUBLE)
                .with_repetition(::parquet::basic::Repetition::REQUIRED)
                .build()
                .map(Arc::new)
        };
        let fields: Vec<_> = head.names().map(double).collect::<Result<_, _>>().map_err(other)?;
        let columns = fields.len();
        let schema = Type::group_type_builder("recording").with_fields(fields).build().map_err(other)?;
        let machine = KeyValue::new("machine".to_owned(), head.machine.clone());
        let properties = WriterProperties::builder()
            .set_key_value_metadata(Some(vec![machine]))
            .set_compression(::parquet::basic::Compression::SNAPPY)
            .build();
        let writer =
            SerializedFileWriter::new(file.try_clone()?, Arc::new(schema), Arc::new(properties)).map_err(other)?;
        Ok(ParquetSink { file, writer, group: vec![Vec::new(); columns], groups: 0 })
    }

    /// Adds rows.
    pub(super) fn write(&mut self, rows: &Rows) -> io::Result<()> {
        let channels = self.group.len().saturating_sub(2);
        let mut lost = rows.lost as f64;
        for (number, row) in rows.values.chunks_exact(channels).enumerate() {
            let time_s = rows.first_s + number as f64 * rows.row_s;
            let cells = std::iter::once(&time_s).chain(row).chain(std::iter::once(&lost));
            self.group.iter_mut().zip(cells).for_each(|(column, cell)| column.push(*cell));
            lost = 0.0;
        }
        if self.group.first().is_some_and(|column| column.len() >= GROUP_ROWS) { self.close_group() } else { Ok(()) }
    }

    fn close_group(&mut self) -> io::Result<()> {
        let (columns, rows) = (self.group.len() as u64, self.group.first().map_or(0, Vec::len) as u64);
        let written = self.file.metadata()?.len();
        // Uncompressed it is as large as it can get.
        let wanted = columns * (9 * rows + END_BYTES_A_COLUMN * (self.groups + 2));
        if let Err(why) = fallocate(self.file.as_fd(), FallocateFlags::KEEP_SIZE, written, wanted) {
            self.group.iter_mut().for_each(Vec::clear);
            return Err(why.into());
        }
        let mut group = self.writer.next_row_group().map_err(other)?;
        for values in &self.group {
            let Some(mut column) = group.next_column().map_err(other)? else { break };
            column.typed::<DoubleType>().write_batch(values, None, None).map_err(other)?;
            column.close().map_err(other)?;
        }
        group.close().map_err(other)?;
        self.group.iter_mut().for_each(Vec::clear);
        self.groups += 1;
        Ok(())
    }

    /// Writes the end.
    pub(super) fn finish(mut self) -> io::Result<()> {
        let last =
            if self.group.first().is_some_and(|column| !column.is_empty()) { self.close_group() } else { Ok(()) };
        self.writer.close().map_err(other)?;
        // What was set aside and not used goes back.
        self.file.set_len(self.file.metadata()?.len())?;
        self.file.sync_all()?;
        last
    }
}

fn other(why: ParquetError) -> io::Error {
    io::Error::other(why)
}
