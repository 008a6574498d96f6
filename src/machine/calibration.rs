//! The calibration of a machine's accelerometers as a file: JSON, schema "gib.calibration/1".
//!
//! ```json
//! { "schema": "gib.calibration/1", "points": [ { "frequency_hz": 20.0, "seat": { "gain_ratio": 1.04, "phase_deg": 1.2,
//!     "gain_uncertainty_ratio": 0.01, "phase_uncertainty_deg": 0.5 }, "bearing": { … }, "condition_ratio": 4.6,
//!     "residual_um": 0.01, "amplitude_mm": 0.23, "experiments": 2.0 } ] }
//! ```
//!
//! A correction needs frequency, gain and phase; the rest may be left out.

use crate::cycle::calibration::table::{CalibrationPoint, CalibrationTable, GIB_CALIBRATION_POINTS};
use crate::error::{Fault, GIB_ERR_FORMAT, GIB_ERR_IO};
use serde_json::{Value, json};
use std::path::Path;

const SCHEMA: &str = "gib.calibration/1";

/// The text of a table.
#[must_use]
pub fn write(table: &CalibrationTable) -> String {
    let sensor = |p: &CalibrationPoint, i: usize| {
        json!({ "gain_ratio": p.gain_ratio[i], "phase_deg": p.phase_deg[i],
                "gain_uncertainty_ratio": p.gain_uncertainty_ratio[i], "phase_uncertainty_deg": p.phase_uncertainty_deg[i] })
    };
    let point = |p: &CalibrationPoint| {
        json!({ "frequency_hz": p.frequency_hz, "seat": sensor(p, 0), "bearing": sensor(p, 1),
                "condition_ratio": p.condition_ratio, "residual_um": p.residual_um, "amplitude_mm": p.amplitude_mm,
                "experiments": p.experiments })
    };
    let points: Vec<Value> = table.points().iter().map(point).collect();
    format!("{:#}\n", json!({ "schema": SCHEMA, "points": points }))
}

/// Reads a table's text.
///
/// # Errors
/// `GIB_ERR_FORMAT` with the key that is missing or of the wrong kind, or with `json` and the line; `GIB_ERR_CONFIG` with
/// the key that is out of range.
pub fn read(text: &str) -> Result<CalibrationTable, Fault> {
    let wrong = |field, value| Fault { code: GIB_ERR_FORMAT, field, value, ..Fault::NONE };
    let root: Value =
        serde_json::from_str(text.trim_start_matches('\u{feff}')).map_err(|e| wrong("json\0", e.line() as f64))?;
    if root["schema"] != SCHEMA {
        return Err(wrong("schema\0", 0.0));
    }
    let points = root["points"].as_array().ok_or(wrong("points\0", 0.0))?;
    if points.len() > GIB_CALIBRATION_POINTS {
        return Err(wrong("points\0", points.len() as f64));
    }
    let mut table = CalibrationTable { count: points.len() as u32, ..CalibrationTable::default() };
    for (i, (to, from)) in table.point.iter_mut().zip(points).enumerate() {
        let needed = |value: &Value, field| value.as_f64().ok_or(wrong(field, i as f64));
        let known = |value: &Value| value.as_f64().unwrap_or(0.0);
        to.frequency_hz = needed(&from["frequency_hz"], "frequency_hz\0")?;
        for (n, name) in ["seat", "bearing"].into_iter().enumerate() {
            let sensor = &from[name];
            to.gain_ratio[n] = needed(&sensor["gain_ratio"], "gain_ratio\0")?;
            to.phase_deg[n] = needed(&sensor["phase_deg"], "phase_deg\0")?;
            to.gain_uncertainty_ratio[n] = known(&sensor["gain_uncertainty_ratio"]);
            to.phase_uncertainty_deg[n] = known(&sensor["phase_uncertainty_deg"]);
        }
        to.condition_ratio = known(&from["condition_ratio"]);
        to.residual_um = known(&from["residual_um"]);
        to.amplitude_mm = known(&from["amplitude_mm"]);
        to.experiments = known(&from["experiments"]);
    }
    table.check()?;
    Ok(table)
}

/// Writes a table to a file, whole or not at all.
///
/// # Errors
/// `GIB_ERR_IO`.
pub fn save(table: &CalibrationTable, path: &Path) -> Result<(), Fault> {
    let written = super::whole::replace(path, &write(table));
    written.map_err(|_| Fault { code: GIB_ERR_IO, field: "path\0", ..Fault::NONE })
}

/// Reads a table from a file.
///
/// # Errors
/// `GIB_ERR_IO`, and those of [`read`].
pub fn load(path: &Path) -> Result<CalibrationTable, Fault> {
    read(&super::whole::text(path)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::GIB_ERR_CONFIG;

    fn table() -> CalibrationTable {
        let mut table = CalibrationTable { count: 2, ..CalibrationTable::default() };
        for (i, point) in table.point.iter_mut().take(2).enumerate() {
            *point = CalibrationPoint {
                frequency_hz: 10.1 * (i + 1) as f64,
                gain_ratio: [1.0 / 3.0 + 0.7, 0.97],
                phase_deg: [1.25, -0.1],
                gain_uncertainty_ratio: [0.01, 0.02],
                phase_uncertainty_deg: [0.5, 0.7],
                condition_ratio: 4.6,
                residual_um: 0.012,
                amplitude_mm: 0.9,
                experiments: 2.0,
            };
        }
        table
    }

    #[test]
    fn what_is_saved_is_loaded_to_the_last_digit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("calibration.json");
        save(&table(), &path).unwrap();
        assert_eq!(load(&path), Ok(table()));
        assert_eq!(load(&folder.path().join("none")).unwrap_err().code, GIB_ERR_IO);
        let foreign = folder.path().join("latin1.json");
        std::fs::write(&foreign, b"{\n \"schema\": \"\xb5\" }").unwrap();
        let refused = load(&foreign).unwrap_err();
        assert_eq!((refused.code, refused.field, refused.value), (GIB_ERR_FORMAT, "json\0", 2.0));
        assert_eq!(save(&table(), &folder.path().join("no/such")).unwrap_err().code, GIB_ERR_IO);
    }

    #[test]
    fn what_is_wrong_is_named() {
        let spoilt = |from: &str, to: &str| {
            let fault = read(&write(&table()).replacen(from, to, 1)).unwrap_err();
            (fault.code, fault.field)
        };
        assert_eq!(spoilt("calibration/1", "calibration/2"), (GIB_ERR_FORMAT, "schema\0"));
        assert_eq!(spoilt("{", "["), (GIB_ERR_FORMAT, "json\0"));
        assert_eq!(spoilt("frequency_hz", "frequency"), (GIB_ERR_FORMAT, "frequency_hz\0"));
        assert_eq!(spoilt("0.97", "\"much\""), (GIB_ERR_FORMAT, "gain_ratio\0"));
        assert_eq!(spoilt("0.97", "97"), (GIB_ERR_CONFIG, "gain_ratio\0"));
        assert_eq!(spoilt("10.1", "20.2"), (GIB_ERR_CONFIG, "frequency_hz\0"));
        assert_eq!(read("{\"schema\":\"gib.calibration/1\",\"points\":[]}").unwrap_err().field, "count\0");
    }
}
