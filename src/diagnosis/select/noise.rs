//! What the encoder's noise makes of a simulated table.
//!
//! The motor moves as its encoder shows it, noise included: that noise drives the table behind it, and stands in the balance through the
//! inertia. The two go together, so that a little of any spring takes some of the noise off, wherever the axis moves. A spring that is
//! there makes torque where the axis changes its speed.

use crate::diagnosis::fit::{Bench, Fit, Part};

/// Share of its size up to which the trace of a start is suspected: starts differ from what is there by half of that, in mass or stiffness.
const LITTLE: f64 = 0.25;
/// How much more of the squares a table takes off in the fifth of the rows where the axis accelerates most than in the half where it does
/// least: they differ by three times in acceleration on any moves, and what a spring makes goes with that.
const MORE: f64 = 10.0;
/// Rows to either side that an acceleration is averaged over, lest its own noise say where it is large.
const BESIDE: usize = 4;

/// Whether a table at a start beside a set takes no more off than the encoder's noise that drives it.
#[must_use]
pub fn drives(bench: &Bench, set: &Fit, start: &Part) -> bool {
    let (size, left) = bench.left_joined(set, start);
    if size > LITTLE {
        return false;
    }
    let rows = bench.rows;
    let taken: Vec<f64> =
        set.residual[..rows].iter().zip(&left[..rows]).map(|(before, after)| before * before - after * after).collect();
    let mut order = by_acceleration(&bench.frame.acceleration);
    order.truncate(rows);
    let mean = |of: &[usize]| of.iter().map(|&row| taken[row]).sum::<f64>() / of.len().max(1) as f64;
    let (gentle, hard) = (mean(&order[..rows / 2]), mean(&order[rows - rows / 5..]));
    hard <= MORE * gentle.max(0.0)
}

/// Rows by the size of the acceleration about them, the least first.
fn by_acceleration(acceleration: &[f64]) -> Vec<usize> {
    let mut sums = vec![0.0; acceleration.len() + 1];
    acceleration.iter().enumerate().for_each(|(row, a)| sums[row + 1] = sums[row] + a);
    let size = |row: usize| {
        let (from, to) = (row.saturating_sub(BESIDE), (row + BESIDE + 1).min(acceleration.len()));
        ((sums[to] - sums[from]) / (to - from) as f64).abs()
    };
    let sizes: Vec<f64> = (0..acceleration.len()).map(size).collect();
    let mut order: Vec<usize> = (0..sizes.len()).collect();
    order.sort_by(|&a, &b| sizes[a].total_cmp(&sizes[b]));
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_ordered_by_the_acceleration_about_them_whatever_its_sign() {
        let at = |row: usize| if (20..40).contains(&row) { -3.0 } else { 0.5 };
        let mut strongest = by_acceleration(&(0..60).map(at).collect::<Vec<_>>()).split_off(60 - 12);
        strongest.sort_unstable();
        assert_eq!(strongest, (24..36).collect::<Vec<_>>());
    }
}
