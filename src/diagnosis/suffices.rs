//! Whether the rows of a recording suffice for anything to be said of them.

use super::frame::Frame;

/// Judged time below which nothing is said, s, and judged rows.
const LEAST_SECONDS: f64 = 1.0;
const LEAST_ROWS: usize = 300;

/// What rows lack for anything to be said of them; nothing where they suffice.
#[must_use]
pub fn what_is_missing(frame: &Frame) -> Vec<String> {
    let mut missing = Vec::new();
    let (word, torque) = (frame.axis.drive.torque_word(), &frame.columns.torque);
    if let Some(first) = torque.first().filter(|first| torque.iter().all(|value| value == *first)) {
        missing.push(format!("{word}: the column is {first} in every row, as if nothing was connected; record what the drive says the motor delivers"));
        return missing;
    }
    let (rows, seconds) = (frame.kept.len(), frame.judged_seconds());
    if rows < LEAST_ROWS || seconds < LEAST_SECONDS {
        let (found, needed) = if seconds < LEAST_SECONDS {
            (format!("{seconds:.2} s"), format!("{LEAST_SECONDS} s"))
        } else {
            (format!("{rows} rows that are independent through the filter"), LEAST_ROWS.to_string())
        };
        missing.push(format!(
            "motion: only {found} of the recording are steady enough sliding to be judged, {needed} are needed; record several moves there and back"
        ));
        return missing;
    }
    let forward = frame.kept.iter().filter(|&&i| frame.v[i] > 0.0).count();
    let fewer = forward.min(frame.kept.len() - forward);
    if fewer * 50 < frame.kept.len() {
        missing.push("both directions: the axis moves one way only, so friction and weight cannot be told apart; record moves there and back".into());
    }
    missing
}
