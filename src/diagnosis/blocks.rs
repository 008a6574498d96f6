//! Contiguous blocks, on which what is fitted without them is judged: neighbouring rows are not independent, blocks nearly so.

use super::fit::{Bench, Fit};
use std::ops::Range;

/// The frame's blocks, cut further where one holds more than a share `most` of one of these traces: what happens in one place,
/// as a single rapid in which the motor saturates, can only be told by one part of it from another.
#[must_use]
pub fn within<T: AsRef<[f64]>>(bench: &Bench, traces: &[T], most: f64) -> Vec<Range<usize>> {
    let stacked = |row: usize| [Some(row), (bench.measured.len() > bench.rows).then_some(row + bench.rows)];
    let square = |trace: &T, row: usize| stacked(row).iter().flatten().map(|&k| trace.as_ref()[k].powi(2)).sum();
    cut(bench.frame.blocks.windows(2).map(|block| block[0]..block[1]), traces, square, most)
}

/// Blocks of a column, all but the last of the same length, cut in the same way.
#[must_use]
pub fn of_column(column: &[f64], length: usize, most: f64) -> Vec<Range<usize>> {
    let even = (0..column.len()).step_by(length).map(|from| from..(from + length).min(column.len()));
    cut(even, &[column], |column, row| column[row] * column[row], most)
}

/// Blocks cut where one holds more than a share `most` of all squares of one of these traces.
fn cut<T>(
    blocks: impl Iterator<Item = Range<usize>> + Clone,
    traces: &[T],
    square: impl Fn(&T, usize) -> f64,
    most: f64,
) -> Vec<Range<usize>> {
    let all = |trace: &T| blocks.clone().flatten().map(|row| square(trace, row)).sum::<f64>();
    let full: Vec<f64> = traces.iter().map(|trace| most * all(trace)).collect();
    let mut parts = Vec::new();
    for block in blocks {
        let (mut begin, mut held) = (block.start, vec![0.0; traces.len()]);
        for row in block.clone() {
            held.iter_mut().zip(traces).for_each(|(held, trace)| *held += square(trace, row));
            if held.iter().zip(&full).any(|(held, full)| held > full) {
                parts.push(begin..row + 1);
                begin = row + 1;
                held.fill(0.0);
            }
        }
        if begin < block.end {
            parts.push(begin..block.end);
        }
    }
    parts
}

/// Sum of squares of each block, predicted by coefficients that were fitted without it.
#[must_use]
pub fn held_out(bench: &Bench, fit: &Fit, blocks: &[Range<usize>]) -> Vec<f64> {
    let basis = fit.basis();
    (blocks.iter())
        .map(|block| {
            let pieces = bench.pieces(block.clone());
            // With orthonormal columns U, the held-out residual is (1 − U_b·U_bᵀ)⁻¹·r_b: solved in the small space,
            // r_b + U_b·(1 − U_bᵀ·U_b)⁻¹·U_bᵀ·r_b.
            let k = basis.len();
            let (normal, right) = fit.outside(pieces.iter().cloned());
            // nalgebra's decompositions do not take an empty matrix.
            let solved = if k == 0 { None } else { normal.lu().solve(&right) };
            let weights = solved.unwrap_or_else(|| nalgebra::DVector::zeros(k));
            let mut sum = 0.0;
            for piece in pieces {
                for row in piece {
                    let fitted: f64 = (0..k).map(|i| basis[i][row] * weights[i]).sum();
                    sum += (fit.residual[row] + fitted).powi(2);
                }
            }
            sum
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A move of 800 rows in one of 24 blocks, and a spike: all rows are in one block each, none of which holds much more than its share.
    #[test]
    fn a_block_that_holds_most_is_cut_and_no_row_is_lost() {
        let column: Vec<f64> = (0..24_000).map(|i| if (4100..4900).contains(&i) { 1.0 } else { 0.0 }).collect();
        let blocks = of_column(&column, 1000, 0.5);
        assert_eq!((blocks[0].start, blocks[blocks.len() - 1].end, blocks.len()), (0, 24_000, 25));
        assert!(blocks.windows(2).all(|pair| pair[0].end == pair[1].start));
        assert!(blocks.iter().all(|rows| column[rows.clone()].iter().sum::<f64>() <= 401.0), "{blocks:?}");
        let mut spike = vec![0.0; 4800];
        spike[1000] = 1.0;
        assert_eq!(of_column(&spike, 200, 0.5).len(), 25);
    }
}
