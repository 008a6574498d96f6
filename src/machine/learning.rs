//! A learnt command as a file: JSON, schema "gib.learning/1".
//!
//! ```json
//! { "schema": "gib.learning/1", "speed_rpm": 600.0, "angle_deg": [ -180.0, -178.6, … ], "target_mm": [ … ],
//!     "command_mm": [ … ], "detected_mm": [ … ] }
//! ```
//!
//! The points, an even number of them, divide the revolution evenly; `angle_deg` and `detected_mm` may be left out.

use crate::cycle::learning::config::GIB_LEARNING_POINTS;
use crate::cycle::learning::io::LearningPoint;
use crate::error::{Fault, GIB_ERR_FORMAT, GIB_ERR_IO};
use serde_json::{Value, json};
use std::path::Path;

const SCHEMA: &str = "gib.learning/1";
/// Fewest points of a revolution.
const FEWEST: usize = 16;

/// The text of a learnt command.
#[must_use]
pub fn write(points: &[LearningPoint], speed_rpm: f64) -> String {
    let column = |of: fn(&LearningPoint) -> f64| Value::from(points.iter().map(of).collect::<Vec<f64>>());
    let root = json!({ "schema": SCHEMA, "speed_rpm": speed_rpm, "angle_deg": column(|p| p.angle_deg),
        "target_mm": column(|p| p.target_mm), "command_mm": column(|p| p.command_mm),
        "detected_mm": column(|p| p.detected_mm) });
    format!("{root:#}\n")
}

/// Reads its text.
///
/// # Errors
/// `GIB_ERR_FORMAT` with the key that is missing, of the wrong kind or length, or no plain number, and the point as `value`;
/// or with `json` and the line.
pub fn read(text: &str) -> Result<Vec<LearningPoint>, Fault> {
    let wrong = |field, value| Fault { code: GIB_ERR_FORMAT, field, value, ..Fault::NONE };
    let root: Value =
        serde_json::from_str(text.trim_start_matches('\u{feff}')).map_err(|e| wrong("json\0", e.line() as f64))?;
    if root["schema"] != SCHEMA {
        return Err(wrong("schema\0", 0.0));
    }
    let column = |key: &str, field: &'static str| -> Result<Vec<f64>, Fault> {
        let values = root[key].as_array().ok_or(wrong(field, 0.0))?;
        let number =
            |(i, value): (usize, &Value)| value.as_f64().filter(|x| x.abs() <= 1e6).ok_or(wrong(field, i as f64));
        values.iter().enumerate().map(number).collect()
    };
    let target = column("target_mm", "target_mm\0")?;
    let command = column("command_mm", "command_mm\0")?;
    if !(FEWEST..=GIB_LEARNING_POINTS).contains(&target.len()) || target.len() % 2 != 0 {
        return Err(wrong("target_mm\0", target.len() as f64));
    }
    let detected = if root["detected_mm"].is_null() { target.clone() } else { column("detected_mm", "detected_mm\0")? };
    for (field, values) in [("command_mm\0", &command), ("detected_mm\0", &detected)] {
        if values.len() != target.len() {
            return Err(wrong(field, values.len() as f64));
        }
    }
    let columns = target.iter().zip(&command).zip(&detected);
    let point = |((target, command), detected): ((&f64, &f64), &f64)| LearningPoint {
        angle_deg: 0.0,
        target_mm: *target,
        command_mm: *command,
        detected_mm: *detected,
    };
    Ok(columns.map(point).collect())
}

/// Writes a learnt command to a file: beside it first, then in its place.
///
/// # Errors
/// `GIB_ERR_IO`.
pub fn save(points: &[LearningPoint], speed_rpm: f64, path: &Path) -> Result<(), Fault> {
    let written = super::whole::replace(path, &write(points, speed_rpm));
    written.map_err(|_| Fault { code: GIB_ERR_IO, field: "path\0", ..Fault::NONE })
}

/// Reads a learnt command from a file.
///
/// # Errors
/// `GIB_ERR_IO`, and those of [`read`].
pub fn load(path: &Path) -> Result<Vec<LearningPoint>, Fault> {
    read(&super::whole::text(path)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points() -> Vec<LearningPoint> {
        let point = |i: i32| LearningPoint {
            angle_deg: 0.0,
            target_mm: f64::from(i).sqrt(),
            command_mm: f64::from(i).sqrt() + 0.001 / f64::from(i + 1),
            detected_mm: f64::from(i) / 3.0,
        };
        (0..16).map(point).collect()
    }

    #[test]
    fn what_is_saved_is_loaded_to_the_last_digit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("learnt.json");
        save(&points(), 600.0, &path).unwrap();
        assert_eq!(load(&path), Ok(points()));
        assert_eq!(load(&folder.path().join("none")).unwrap_err().code, GIB_ERR_IO);
        let foreign = folder.path().join("latin1.json");
        std::fs::write(&foreign, b"{\n \"schema\": \"\xb5\" }").unwrap();
        let refused = load(&foreign).unwrap_err();
        assert_eq!((refused.code, refused.field, refused.value), (GIB_ERR_FORMAT, "json\0", 2.0));
        assert_eq!(save(&points(), 600.0, &folder.path().join("no/such")).unwrap_err().code, GIB_ERR_IO);
    }

    #[test]
    fn what_is_wrong_is_named() {
        let spoilt = |from: &str, to: &str| {
            let text = write(&points(), 600.0).replacen(from, to, 1);
            let fault = read(&text).unwrap_err();
            (fault.code, fault.field)
        };
        assert_eq!(spoilt("learning/1", "learning/2"), (GIB_ERR_FORMAT, "schema\0"));
        assert_eq!(spoilt("{", "["), (GIB_ERR_FORMAT, "json\0"));
        assert_eq!(spoilt("target_mm", "aim_mm"), (GIB_ERR_FORMAT, "target_mm\0"));
        assert_eq!(spoilt("command_mm\": [", "command_mm\": [ 1.0,"), (GIB_ERR_FORMAT, "command_mm\0"));
        assert_eq!(spoilt("detected_mm\": [", "detected_mm\": [ \"much\","), (GIB_ERR_FORMAT, "detected_mm\0"));
        let few: Vec<LearningPoint> = points().into_iter().take(15).collect();
        assert_eq!(read(&write(&few, 0.0)).unwrap_err().field, "target_mm\0");
    }
}
