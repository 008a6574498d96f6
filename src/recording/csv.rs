//! CSV: one header line, comma, UTF-8. The text streams through a fixed buffer; only the numbers are kept.

use std::io::{BufRead, BufReader, Read};

use super::{Column, RecordingError, file_row, is_ignored};

/// Bytes read at a time. Large enough that system calls do not count, small enough to stay in the cache.
const BUFFER_BYTES: usize = 256 * 1024;

/// Reads the time and all other columns, in file order.
pub(super) fn read(source: impl Read, file: &str, length: u64) -> Result<(Vec<f64>, Vec<Column>), RecordingError> {
    let mut source = BufReader::with_capacity(BUFFER_BYTES, source);
    begin_text(&mut source, file)?;
    let mut reader =
        ::csv::ReaderBuilder::new().has_headers(false).flexible(true).buffer_capacity(BUFFER_BYTES).from_reader(source);
    let mut record = ::csv::ByteRecord::new();

    let broken =
        |why: ::csv::Error, row: usize| RecordingError::new(file, format!("cannot be read: {why}")).at_row(row);
    if !reader.read_byte_record(&mut record).map_err(|why| broken(why, 1))? {
        return Err(RecordingError::new(
            file,
            "is empty; expected a header line such as time_s,x.position_mm,x.torque_nm",
        ));
    }
    let names = record.iter().map(|cell| String::from_utf8_lossy(cell).trim().to_owned()).collect();
    let names = header(names, file)?;

    let mut values: Vec<Vec<f64>> = vec![Vec::new(); names.len()];
    let mut row = 0;
    while reader.read_byte_record(&mut record).map_err(|why| broken(why, file_row(row)))? {
        if record.len() != names.len() {
            return Err(ragged(&record, &names, file, row));
        }
        if row == 0 {
            let bytes = record.as_slice().len() + record.len();
            let rows = usize::try_from(length).unwrap_or(0) / bytes.max(1);
            values.iter_mut().for_each(|column| column.reserve(rows));
        }
        for ((cell, column), name) in record.iter().zip(&mut values).zip(&names) {
            column.push(match number(cell) {
                Some(value) => value,
                None if is_ignored(name) => f64::NAN,
                None => return Err(not_a_number(cell, file, name, row)),
            });
        }
        row += 1;
    }

    let mut columns = names.iter().zip(values);
    let time_s = columns.next().map(|(_, time_s)| time_s).unwrap_or_default();
    Ok((time_s, columns.map(|(name, values)| Column::new(name, values)).collect()))
}

/// What often stands at the beginning of a file that is no plain text, and what to do with it.
const NO_TEXT: [(&[u8], &str); 6] = [
    (b"\x1F\x8B", "is compressed with gzip; unpack it first"),
    (b"\x28\xB5\x2F\xFD", "is compressed with zstd; unpack it first"),
    (b"PK\x03\x04", "is an archive or a spreadsheet; unpack it, or export it as CSV"),
    (b"\xFF\xFE", "is text in UTF-16; save it as UTF-8"),
    (b"\xFE\xFF", "is text in UTF-16; save it as UTF-8"),
    (b"PAR1", "is Parquet; name it .parquet"),
];

/// Programs on Windows write three bytes before the header that are no part of it.
fn begin_text(source: &mut impl BufRead, file: &str) -> Result<(), RecordingError> {
    let start = source.fill_buf().map_err(|why| RecordingError::new(file, format!("cannot be read: {why}")))?;
    if let Some((_, message)) = NO_TEXT.iter().find(|(bytes, _)| start.starts_with(bytes)) {
        return Err(RecordingError::new(file, *message));
    }
    if start.starts_with(b"\xEF\xBB\xBF") {
        source.consume(3);
    }
    Ok(())
}

/// Checks that the time comes first.
pub(super) fn header(names: Vec<String>, file: &str) -> Result<Vec<String>, RecordingError> {
    let first = names.first().map_or("", String::as_str);
    let wrong = |message: String| Err(RecordingError::new(file, message).at_row(1));
    if first == "time_s" {
        return Ok(names);
    }
    if first.starts_with("time_s") && first.contains([';', '\t']) {
        return wrong(
            "the header is separated by semicolons or tabs; expected commas, with a dot as decimal sign".into(),
        );
    }
    if first.parse::<f64>().is_ok() {
        return wrong(format!(
            "found the number {first} where the header line should be; expected time_s,<channel>.<signal>_<unit>,…"
        ));
    }
    if names.iter().any(|name| name == "time_s") {
        return wrong(format!("the first column is {first:?}; time_s must come first"));
    }
    wrong(format!("the first column is {first:?}; expected time_s, the time in seconds"))
}

/// A cell as a number: NaN when it is empty, `None` when it is not a number.
#[inline]
fn number(cell: &[u8]) -> Option<f64> {
    if let Ok(value) = fast_float2::parse::<f64, _>(cell) {
        return Some(value);
    }
    let text = cell.trim_ascii();
    if text.is_empty() { Some(f64::NAN) } else { fast_float2::parse(text).ok() }
}

fn not_a_number(cell: &[u8], file: &str, column: &str, row: usize) -> RecordingError {
    let text = String::from_utf8_lossy(cell);
    let shown: String = text.chars().take(40).collect();
    RecordingError::new(
        file,
        format!("found {shown:?}; expected a number such as -12.345, or nothing where there is none"),
    )
    .at_row(file_row(row))
    .in_column(column)
}

fn ragged(record: &::csv::ByteRecord, names: &[String], file: &str, row: usize) -> RecordingError {
    let (found, expected) = (record.len(), names.len());
    let message = if found < expected {
        format!(
            "has {found} values; expected {expected}, one for each column of the header ({} is missing)",
            names[found]
        )
    } else {
        format!(
            "has {found} values; expected {expected}, one for each column of the header (is a comma used as decimal sign?)"
        )
    };
    RecordingError::new(file, message).at_row(file_row(row))
}

#[cfg(test)]
mod tests {
    use crate::recording::Recording;

    fn error(text: &str) -> String {
        Recording::read_csv(text.as_bytes(), "r.csv", 0).expect_err("must be refused").to_string()
    }

    #[test]
    fn numbers_in_every_spelling() {
        let text = "\u{feff}time_s, x.position_mm ,x.torque_nm\r\n0,1e-3,+2\r\n 1 ,-4.5E2, \r\n2,NaN,-inf\r\n";
        let recording = Recording::read_csv(text.as_bytes(), "r.csv", 0).unwrap();
        assert_eq!(*recording.time_s, [0.0, 1.0, 2.0]);
        assert_eq!(recording.columns[0].name, "x.position_mm");
        assert_eq!(recording.columns[0].values[..2], [1e-3, -450.0]);
        assert!(recording.columns[0].values[2].is_nan());
        assert_eq!(recording.columns[1].values[0], 2.0);
        assert!(recording.columns[1].values[1].is_nan() && recording.columns[1].values[2].is_nan());
    }

    #[test]
    fn what_stands_in_a_column_that_nobody_asks_for_is_ignored() {
        let text = "time_s,operator,x.position_mm,x.torque_lbft\n0,Ann,1,a\n1,Bob,2,b\n2,7,3,c\n";
        let recording = Recording::read_csv(text.as_bytes(), "r.csv", 0).unwrap();
        assert_eq!(recording.columns[1].values, [1.0, 2.0, 3.0]);
        let issues: Vec<_> = recording.issues.iter().map(|issue| issue.column.as_deref().unwrap()).collect();
        assert_eq!(issues, ["operator", "x.torque_lbft"], "{:?}", recording.issues);
        assert!(error(&text.replace("2,7,3,c", "2,7,late,c")).contains("\"late\""));
        assert!(error(&text.replace("2,7,3,c", "late,7,3,c")).contains("\"late\""));
    }

    #[test]
    fn what_is_no_text_is_said_to_be_none() {
        let utf16: Vec<u8> = "\u{feff}time_s".encode_utf16().flat_map(u16::to_le_bytes).collect();
        for (bytes, told) in
            [(utf16.as_slice(), "UTF-8"), (b"\x1F\x8B\x08", "gzip"), (b"PK\x03\x04", "export it as CSV")]
        {
            let error = Recording::read_csv(bytes, "r.csv", 0).expect_err("must be refused").to_string();
            assert!(error.contains(told), "{error}");
        }
    }

    #[test]
    fn errors_name_file_row_column_and_what_to_do() {
        let h = "time_s,x.position_mm\n";
        assert_eq!(
            error(&format!("{h}0,1\n1,abc\n")),
            "r.csv, row 3, column x.position_mm: found \"abc\"; expected a number such as -12.345, or nothing where there is none"
        );
        for (text, parts) in [
            (format!("{h}0,1\n1\n"), vec!["row 3", "has 1 values; expected 2", "x.position_mm is missing"]),
            (format!("{h}0,1\n1,2,3\n"), vec!["row 3", "has 3 values", "decimal sign"]),
            (String::new(), vec!["is empty", "header"]),
            (h.to_owned(), vec!["no rows"]),
            (format!("{h}0,1\n"), vec!["one row"]),
            (format!("{h}0,1\n0,1\n0,1\n"), vec!["same time in all"]),
            ("time_s;x.position_mm\n0;1\n".into(), vec!["row 1", "semicolons"]),
            ("0,1\n1,2\n".into(), vec!["row 1", "header line"]),
            ("x.position_mm,time_s\n0,1\n".into(), vec!["row 1", "time_s must come first"]),
            ("t,x.position_mm\n0,1\n".into(), vec!["row 1", "expected time_s"]),
            (format!("{h}0,1\n1,2\n0.5,3\n"), vec!["row 4", "time_s", "backward"]),
            (format!("{h}0,1\n,2\n"), vec!["row 3", "time_s", "finite"]),
            ("time_s,x.position_mm,x.position_mm\n0,1,1\n1,1,1\n".into(), vec!["x.position_mm", "twice"]),
            ("time_s,x.position_mm,x.position_um\n0,1,1\n1,1,1\n".into(), vec!["x.position_um", "x.position_mm"]),
        ] {
            let message = error(&text);
            for part in parts {
                assert!(message.contains(part), "{message:?} does not say {part:?}");
            }
        }
    }
}
