//! Values of a regular series between its rows.

/// Value of a regular series at a fractional index, by Catmull and Rom's cubic; held at the ends.
#[must_use]
pub fn cubic_at(values: &[f64], index: f64) -> f64 {
    cubic_of(values.len(), |k| values[k], index)
}

/// The same of so many values that a function gives.
#[inline]
pub(super) fn cubic_of(count: usize, value: impl Fn(usize) -> f64, index: f64) -> f64 {
    let last = count.saturating_sub(1);
    let index = index.clamp(0.0, last as f64);
    let i = (index as usize).min(last.saturating_sub(1));
    let at = |k: usize| if count > 0 { value(k.min(last)) } else { 0.0 };
    let (a, b, c, d) = (at(i.saturating_sub(1)), at(i), at(i + 1), at(i + 2));
    let t = index - i as f64;
    b + 0.5 * t * (c - a + t * (2.0 * a - 5.0 * b + 4.0 * c - d + t * (3.0 * (b - c) + d - a)))
}

/// The same with this share of the second difference there added: flattened where positive, raised where negative.
#[must_use]
pub fn flattened_at(values: &[f64], index: f64, share: f64) -> f64 {
    flattened_of(values.len(), |k| values[k], index, share)
}

#[inline]
fn flattened_of(count: usize, value: impl Fn(usize) -> f64, index: f64, share: f64) -> f64 {
    let at = |k: f64| cubic_of(count, &value, index + k);
    if share == 0.0 { at(0.0) } else { at(0.0) + share * (at(-1.0) - 2.0 * at(0.0) + at(1.0)) }
}

/// A regular series, so many rows later and [flattened](flattened_at), in its own place.
pub(super) fn shift(values: &mut [f64], rows: f64, share: f64) {
    // Beginning with the end that is not read again, so that of what was there only the last few rows are: a cubic, and the
    // second difference of cubics, reach three rows to either side.
    const KEPT: usize = 8;
    let mut kept = [0.0; KEPT];
    let n = values.len();
    for step in 0..n {
        let row = if rows > 0.0 { n - 1 - step } else { step };
        kept[row % KEPT] = values[row];
        let was = |k: usize| {
            let gone = if rows > 0.0 { k > row } else { k < row };
            if gone { kept[k % KEPT] } else { values[k] }
        };
        values[row] = flattened_of(n, was, row as f64 - rows, share);
    }
}

#[cfg(test)]
mod tests {
    use super::super::noise::uniform_noise as noise;
    use super::*;

    #[test]
    fn a_series_is_shifted_in_its_own_place_as_in_another() {
        let values = noise(60);
        for (rows, share) in [(0.3, 0.1), (1.0, 0.0), (2.7, 0.125), (13.4, 0.1), (80.0, 0.1), (0.0, 0.1)] {
            for rows in [rows, -rows] {
                let mut shifted = values.clone();
                shift(&mut shifted, rows, share);
                let apart: Vec<f64> = (0..60).map(|i| flattened_at(&values, i as f64 - rows, share)).collect();
                assert_eq!(shifted, apart, "{rows} {share}");
            }
        }
    }
}
