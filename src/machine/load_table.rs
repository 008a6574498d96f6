//! The tilt family's load table as a file, `gib.tilt_table/1`: depth → spindle load of one machining condition.
//!
//! ```json
//! { "schema": "gib.tilt_table/1", "signal": "dc_load",
//!   "condition": { "tool_id": 3, "material_id": 7, "speed_rpm": 2000.0, "feed_mm_min": 300.0 },
//!   "rows": [ { "depth_mm": 2.0, "load": 35.07572, "load_std": 0.0, "cuts": 1 } ] }
//! ```
//!
//! Off the cycle: it reads and writes files. `load_std` and `cuts` may be left out.

use crate::cycle::tilt::config::{GIB_TILT_AC_CURRENT, GIB_TILT_DC_LOAD};
use crate::cycle::tilt::table::{GIB_TILT_ROWS, TiltCondition, TiltTable};
use crate::error::{Fault, GIB_ERR_FORMAT, GIB_ERR_IO, GIB_ERR_TILT_TABLE};
use serde_json::{Value, json};
use std::path::Path;

const SCHEMA: &str = "gib.tilt_table/1";

/// Why a table cannot be read or written: in numbers, and as a sentence that names file and place.
#[derive(Debug, Clone, PartialEq)]
pub struct Error {
    /// Code, field, value and bounds; for text that is not JSON `field` is the line.
    pub fault: Fault,
    /// The sentence.
    pub message: String,
}

impl std::fmt::Display for Error {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Error {}

fn error(fault: Fault, message: impl Into<String>) -> Error {
    Error { fault, message: message.into() }
}

fn format_fault(field: &'static str, value: f64) -> Fault {
    Fault { code: GIB_ERR_FORMAT, field, value, low: f64::MIN, high: f64::MAX }
}

fn signal_name(signal: i32) -> &'static str {
    if signal == GIB_TILT_DC_LOAD { "dc_load" } else { "ac_current" }
}

/// Writes a table, whole or not at all.
///
/// # Errors
/// A table that [`TiltTable::check`] refuses; what the system says, with the file's name.
pub fn save(table: &TiltTable, file: &Path) -> Result<(), Error> {
    table.check().map_err(|fault| {
        let field = fault.field.trim_end_matches('\0');
        let row = table.load.iter().rposition(|load| field == "load" && *load == fault.value);
        let why = match row.filter(|row| *row > 0) {
            Some(row) => format!(
                "the load at {} mm, {:.4}, does not rise enough over the row before, as known: more than {:.4} is needed; \
                 cut these depths again, or leave one out",
                table.depth_mm[row], fault.value, fault.low
            ),
            None => format!("{field} is {}, allowed from {}", fault.value, fault.low),
        };
        error(fault, format!("{}: not written: {why}", file.display()))
    })?;
    let text = format!("{:#}\n", to_json(table));
    super::whole::replace(file, &text)
        .map_err(|e| error(Fault::of(GIB_ERR_IO), format!("{}: cannot write the load table: {e}", file.display())))
}

/// The table as JSON.
#[must_use]
pub fn to_json(table: &TiltTable) -> Value {
    let TiltCondition { tool_id, material_id, speed_rpm, feed_mm_min } = table.condition;
    let rows: Vec<Value> = (0..(table.rows as usize).min(GIB_TILT_ROWS))
        .map(|i| {
            json!({ "depth_mm": table.depth_mm[i], "load": table.load[i], "load_std": table.load_std[i],
                    "cuts": table.cuts[i] })
        })
        .collect();
    json!({ "schema": SCHEMA, "signal": signal_name(table.signal),
            "condition": { "tool_id": tool_id, "material_id": material_id,
                           "speed_rpm": speed_rpm, "feed_mm_min": feed_mm_min },
            "rows": rows })
}

/// Reads a table.
///
/// # Errors
/// The file cannot be read, is not JSON (with its line), or holds what [`TiltTable::check`] refuses.
pub fn load(file: &Path) -> Result<TiltTable, Error> {
    let bytes = std::fs::read(file)
        .map_err(|e| error(Fault::of(GIB_ERR_IO), format!("{}: cannot read the load table: {e}", file.display())))?;
    let text = String::from_utf8(bytes).map_err(|e| {
        let good = e.as_bytes().iter().take(e.utf8_error().valid_up_to());
        let line = 1.0 + good.filter(|byte| **byte == b'\n').count() as f64;
        error(format_fault("line\0", line), format!("{}: line {line} is not UTF-8", file.display()))
    })?;
    parse(&text).map_err(|e| error(e.fault, format!("{}: {e}", file.display())))
}

/// Reads a table's text.
///
/// # Errors
/// As [`load`], without the file's name.
pub fn parse(text: &str) -> Result<TiltTable, Error> {
    let root: Value = serde_json::from_str(text.trim_start_matches('\u{feff}'))
        .map_err(|e| error(format_fault("line\0", e.line() as f64), format!("not JSON: {e}")))?;
    if root["schema"] != SCHEMA {
        let found = &root["schema"];
        return Err(error(format_fault("schema\0", 0.0), format!("schema is {found}, it must be \"{SCHEMA}\"")));
    }
    let signal = match root["signal"].as_str() {
        Some("ac_current") => GIB_TILT_AC_CURRENT,
        Some("dc_load") => GIB_TILT_DC_LOAD,
        _ => {
            let found = &root["signal"];
            let message = format!("signal is {found}, it must be \"ac_current\" or \"dc_load\"");
            return Err(error(format_fault("signal\0", 0.0), message));
        }
    };
    let condition = &root["condition"];
    let mut table = TiltTable {
        signal,
        condition: TiltCondition {
            tool_id: whole(condition, "condition", "tool_id\0")?,
            material_id: whole(condition, "condition", "material_id\0")?,
            speed_rpm: number(condition, "condition", "speed_rpm\0", None)?,
            feed_mm_min: number(condition, "condition", "feed_mm_min\0", None)?,
        },
        ..TiltTable::default()
    };
    let rows = root["rows"].as_array().ok_or_else(|| error(format_fault("rows\0", 0.0), "rows must be an array"))?;
    if rows.len() > GIB_TILT_ROWS {
        let (value, high) = (rows.len() as f64, GIB_TILT_ROWS as f64);
        let fault = Fault { code: GIB_ERR_TILT_TABLE, field: "rows\0", value, low: 2.0, high };
        return Err(error(fault, format!("{value} rows, at most {high} are allowed")));
    }
    for (i, row) in rows.iter().enumerate() {
        let place = format!("rows[{i}]");
        table.depth_mm[i] = number(row, &place, "depth_mm\0", None)?;
        table.load[i] = number(row, &place, "load\0", None)?;
        table.load_std[i] = number(row, &place, "load_std\0", Some(0.0))?;
        table.cuts[i] = number(row, &place, "cuts\0", Some(1.0))?.clamp(1.0, f64::from(u32::MAX)) as u32;
        table.rows += 1;
        // Checked row by row, so that the message can name the row at fault.
        if table.rows >= 2 {
            table.check().map_err(|fault| {
                let field = fault.field.trim_end_matches('\0');
                let (value, low) = (fault.value, fault.low);
                error(fault, format!("{place}: {field} is {value}; it must be above {low}: cut this depth again"))
            })?;
        }
    }
    table.check().map_err(|fault| {
        let field = fault.field.trim_end_matches('\0');
        error(fault, format!("{field} is {}; allowed from {} to {}", fault.value, fault.low, fault.high))
    })?;
    Ok(table)
}

/// A number of an object; `absent` where it may be left out.
fn number(object: &Value, place: &str, field: &'static str, absent: Option<f64>) -> Result<f64, Error> {
    let key = field.trim_end_matches('\0');
    let value = &object[key];
    if let (Value::Null, Some(absent)) = (value, absent) {
        return Ok(absent);
    }
    let found = value.as_f64().filter(|value| value.is_finite());
    found.ok_or_else(|| error(format_fault(field, 0.0), format!("{place}.{key} is {value}, it must be a number")))
}

fn whole(object: &Value, place: &str, field: &'static str) -> Result<u32, Error> {
    let key = field.trim_end_matches('\0');
    let found = object[key].as_u64().and_then(|value| u32::try_from(value).ok());
    let message = || format!("{place}.{key} is {}, it must be a whole number from 0 to {}", object[key], u32::MAX);
    found.ok_or_else(|| error(format_fault(field, 0.0), message()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> TiltTable {
        let condition = TiltCondition { tool_id: 3, material_id: 7, speed_rpm: 2000.0, feed_mm_min: 300.0 };
        let mut table = TiltTable { condition, signal: GIB_TILT_DC_LOAD, ..TiltTable::default() };
        for (depth, load) in [(2.0, 35.07572), (3.0, 35.42784), (4.0, 35.59341)] {
            table.add(depth, load, 1e-3 / 3.0).unwrap();
        }
        table
    }

    #[test]
    fn what_is_saved_is_what_is_loaded() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("table.json");
        save(&table(), &file).unwrap();
        save(&table(), &file).unwrap();
        assert_eq!(load(&file).unwrap(), table());
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "nothing else is left there");
        assert_eq!(load(&folder.path().join("gone.json")).unwrap_err().fault.code, GIB_ERR_IO);
        assert_eq!(save(&table(), &folder.path().join("gone/table.json")).unwrap_err().fault.code, GIB_ERR_IO);
        let falling = TiltTable { load: [1.0; GIB_TILT_ROWS], ..table() };
        assert_eq!(save(&falling, &file).unwrap_err().fault.field, "load\0");
        assert_eq!(load(&file).unwrap(), table(), "a refused table leaves the old file");
    }

    #[test]
    fn text_that_is_not_utf_8_is_named_with_its_line() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("table.json");
        std::fs::write(&file, b"{\n \"a\": \"\xfc\"\n}\n").unwrap();
        let fault = load(&file).unwrap_err().fault;
        assert_eq!((fault.code, fault.field, fault.value), (GIB_ERR_FORMAT, "line\0", 2.0));
    }

    #[test]
    fn what_is_wrong_is_named_with_its_place() {
        let good = to_json(&table()).to_string();
        for (from, to, code, said) in [
            ("\"schema\"", "schema", GIB_ERR_FORMAT, "not JSON"),
            ("tilt_table/1", "tilt_table/2", GIB_ERR_FORMAT, "schema"),
            ("dc_load", "load", GIB_ERR_FORMAT, "signal"),
            ("35.42784", "34.0", GIB_ERR_TILT_TABLE, "rows[1]: load is 34"),
            ("35.42784", "\"much\"", GIB_ERR_FORMAT, "rows[1].load is \"much\""),
            ("\"tool_id\":3", "\"tool_id\":-3", GIB_ERR_FORMAT, "condition.tool_id is -3"),
            ("\"speed_rpm\":2000.0", "\"speed_rpm\":0.0", crate::error::GIB_ERR_CONFIG, "speed_rpm is 0"),
            ("\"depth_mm\":3.0", "\"depth_mm\":1.0", GIB_ERR_TILT_TABLE, "rows[1]: depth_mm is 1"),
        ] {
            assert!(good.contains(from), "{from} in {good}");
            let refused = parse(&good.replacen(from, to, 1)).unwrap_err();
            assert!(refused.fault.code == code && refused.message.contains(said), "{refused:?}");
        }
        let one = json!({ "schema": SCHEMA, "signal": "dc_load", "condition": to_json(&table())["condition"],
                          "rows": [{ "depth_mm": 1, "load": 2 }] });
        assert_eq!(parse(&one.to_string()).unwrap_err().fault.field, "rows\0");
    }
}
