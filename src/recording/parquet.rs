//! Parquet: the same columns as CSV, `time_s` first, any numeric type. Rows stream one by one; only the numbers are kept.

use std::fs::File;
use std::path::Path;

use ::parquet::file::reader::{FileReader, SerializedFileReader};
use ::parquet::record::Field;

use super::csv::header;
use super::{Column, RecordingError, file_row, is_ignored};

/// Reads the time and all other columns, in file order.
pub(super) fn read(path: &Path, file: &str) -> Result<(Vec<f64>, Vec<Column>), RecordingError> {
    let broken = |why: String| RecordingError::new(file, format!("cannot be read: {why}"));
    let source = File::open(path).map_err(|why| RecordingError::new(file, format!("cannot be opened: {why}")))?;
    let reader = SerializedFileReader::new(source).map_err(|why| broken(why.to_string()))?;
    let described = reader.metadata().file_metadata();
    let names = described.schema_descr().columns().iter().map(|column| column.path().string()).collect();
    let names: Vec<String> = header(names, file)?;
    let rows = usize::try_from(described.num_rows()).unwrap_or(0);

    let mut values: Vec<Vec<f64>> = names.iter().map(|_| Vec::with_capacity(rows)).collect();
    for (index, row) in reader.get_row_iter(None).map_err(|why| broken(why.to_string()))?.enumerate() {
        let row = row.map_err(|why| broken(why.to_string()).at_row(file_row(index)))?;
        for (((_, field), column), name) in row.get_column_iter().zip(&mut values).zip(&names) {
            column.push(match number(field) {
                Some(value) => value,
                None if is_ignored(name) => f64::NAN,
                None => {
                    let error = RecordingError::new(file, format!("holds {field}; expected a number"));
                    return Err(error.at_row(file_row(index)).in_column(name));
                }
            });
        }
    }
    let mut columns = names.iter().zip(values);
    let time_s = columns.next().map(|(_, time_s)| time_s).unwrap_or_default();
    Ok((time_s, columns.map(|(name, values)| Column::new(name, values)).collect()))
}

/// A field as a number: NaN when it is null, `None` when it is not a number.
fn number(field: &Field) -> Option<f64> {
    Some(match field {
        Field::Null => f64::NAN,
        Field::Byte(value) => f64::from(*value),
        Field::Short(value) => f64::from(*value),
        Field::Int(value) => f64::from(*value),
        Field::Long(value) => *value as f64,
        Field::UByte(value) => f64::from(*value),
        Field::UShort(value) => f64::from(*value),
        Field::UInt(value) => f64::from(*value),
        Field::ULong(value) => *value as f64,
        Field::Float(value) => f64::from(*value),
        Field::Double(value) => *value,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use ::parquet::data_type::{DoubleType, FloatType};
    use ::parquet::file::writer::SerializedFileWriter;
    use ::parquet::schema::parser::parse_message_type;

    use crate::recording::{Recording, Signal, Unit};

    #[test]
    fn reads_what_was_written_and_refuses_text() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("r.parquet");
        let schema = "message r { required double time_s; optional float `x.position_mm`; }".replace('`', "");
        let schema = Arc::new(parse_message_type(&schema).unwrap());
        let mut writer =
            SerializedFileWriter::new(std::fs::File::create(&path).unwrap(), schema, Arc::default()).unwrap();
        let mut group = writer.next_row_group().unwrap();
        let mut column = group.next_column().unwrap().unwrap();
        column.typed::<DoubleType>().write_batch(&[0.0, 0.5, 1.0], None, None).unwrap();
        column.close().unwrap();
        let mut column = group.next_column().unwrap().unwrap();
        column.typed::<FloatType>().write_batch(&[1.5, 2.5], Some(&[1, 0, 1]), None).unwrap();
        column.close().unwrap();
        group.close().unwrap();
        writer.close().unwrap();

        let recording = Recording::open(&path).unwrap();
        assert_eq!(*recording.time_s, [0.0, 0.5, 1.0]);
        let position = recording.column("x", Signal::Position).unwrap().to(Unit::Mm).unwrap();
        assert_eq!((position[0], position[2]), (1.5, 2.5));
        assert!(position[1].is_nan());

        std::fs::write(&path, "time_s,x.position_mm\n0,1\n1,2\n").unwrap();
        let refused = Recording::open(&path).unwrap_err().to_string();
        assert!(refused.contains("cannot be read"), "{refused}");
    }
}
