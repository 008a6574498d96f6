//! Contiguous blocks, on which what is fitted without them is judged: neighbouring rows are not independent, blocks nearly so.

use super::fit::{Bench, Fit};
use super::many::dot;
use std::ops::Range;

/// The frame's blocks, cut further where one holds more than a share `most` of one of these traces: what happens in one place,
/// as a single rapid in which the motor saturates, can only be told by one part of it from another.
#[must_use]
pub fn within(bench: &Bench, traces: &[Vec<f64>], most: f64) -> Vec<Range<usize>> {
    let full: Vec<f64> = traces.iter().map(|trace| most * dot(trace, trace)).collect();
    let mut blocks = Vec::new();
    for block in bench.frame.blocks.windows(2) {
        let (mut begin, mut held) = (block[0], vec![0.0; traces.len()]);
        for row in block[0]..block[1] {
            let stacked = [Some(row), (bench.measured.len() > bench.rows).then_some(row + bench.rows)];
            let square = |trace: &Vec<f64>| stacked.iter().flatten().map(|&k| trace[k] * trace[k]).sum::<f64>();
            held.iter_mut().zip(traces).for_each(|(held, trace)| *held += square(trace));
            if held.iter().zip(&full).any(|(held, full)| held > full) {
                blocks.push(begin..row + 1);
                begin = row + 1;
                held.fill(0.0);
            }
        }
        if begin < block[1] {
            blocks.push(begin..block[1]);
        }
    }
    blocks
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
