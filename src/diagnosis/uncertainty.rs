//! How sure the parameters are: a sandwich over contiguous blocks, which lets residuals be autocorrelated within a block
//! and as large in one place as they like (Liang and Zeger 1986), then the delta method from coefficients and non-linear
//! parameters to the parameters of the file.

use super::fit::{Bench, Fit, dot};
use crate::machine::Effect;
use nalgebra::{DMatrix, DVector};

/// Effects with the standard deviation of each parameter, in the order of the fit's parts. `None` where the parameters
/// left their physical bounds.
#[must_use]
pub fn effects(bench: &Bench, fit: &Fit) -> Vec<Option<(Effect, Vec<f64>)>> {
    // Unknowns: coefficients of all parts in order, then the non-linear parameters.
    let slopes = bench.slopes(fit, 0);
    let mut columns: Vec<&[f64]> = Vec::new();
    let mut coefficient_at = Vec::new();
    for (i, c) in fit.coefficients.iter().enumerate() {
        coefficient_at.push(columns.len());
        columns.extend(fit.columns(i).iter().take(c.len()).map(Vec::as_slice));
    }
    let first_slope = columns.len();
    columns.extend(slopes.iter().map(|s| s.column.as_slice()));
    let covariance = sandwich(bench, fit, &columns);
    fit.parts
        .iter()
        .enumerate()
        .map(|(i, part)| {
            let effect_of = |shape: &[f64], c: &[f64]| (part.law.effect)(bench.frame, shape, c);
            let effect = effect_of(&part.shape, &fit.coefficients[i])?;
            let values = effect.values();
            // Derivatives of the file's parameters by each unknown of this part.
            let mut gradient = DMatrix::<f64>::zeros(values.len(), columns.len());
            let mut differ = |unknown: usize, step: f64, moved: Option<Effect>| {
                if let Some(moved) = moved.filter(|_| step != 0.0) {
                    for (k, (a, b)) in moved.values().iter().zip(&values).enumerate() {
                        gradient[(k, unknown)] = (a - b) / step;
                    }
                }
            };
            let largest = fit.coefficients[i].iter().fold(0.0f64, |m, c| m.max(c.abs()));
            for k in 0..fit.coefficients[i].len() {
                let unknown = coefficient_at[i] + k;
                let mut c = fit.coefficients[i].clone();
                let step = 1e-4 * c[k].abs().max(1e-3 * largest);
                c[k] += step;
                differ(unknown, step, effect_of(&part.shape, &c));
            }
            for (s, slope) in slopes.iter().enumerate().filter(|(_, s)| s.part == i) {
                let mut shape = part.shape.clone();
                let scale = part.law.scales[slope.index];
                let step = 1e-4 * shape[slope.index].abs().max(1e-6);
                shape[slope.index] += step;
                let rate = scale.rate(part.shape[slope.index]);
                differ(first_slope + s, step / rate, effect_of(&shape, &fit.coefficients[i]));
            }
            let of_values = &gradient * &covariance * gradient.transpose();
            let deviations = (0..values.len()).map(|k| of_values[(k, k)].max(0.0).sqrt()).collect();
            Some((effect, deviations))
        })
        .collect()
}

/// Covariance of all unknowns: (XᵀX)⁻¹·(Σ_b s_b·s_bᵀ)·(XᵀX)⁻¹ with s_b = X_bᵀ·r_b, widened for the number of blocks.
fn sandwich(bench: &Bench, fit: &Fit, columns: &[&[f64]]) -> DMatrix<f64> {
    let k = columns.len();
    if k == 0 {
        return DMatrix::zeros(0, 0);
    }
    // What every fit leaves free is taken off the columns first.
    let free = fit.basis().len() - fit.coefficients.iter().map(Vec::len).sum::<usize>();
    let cleared: Vec<Vec<f64>> = columns
        .iter()
        .map(|column| {
            let mut c = column.to_vec();
            for direction in fit.basis().iter().take(free) {
                let along = dot(direction, &c);
                c.iter_mut().zip(direction).for_each(|(c, d)| *c -= along * d);
            }
            c
        })
        .collect();
    let scales: Vec<f64> = cleared.iter().map(|c| dot(c, c).sqrt().max(1e-300)).collect();
    let normal = DMatrix::from_fn(k, k, |i, j| dot(&cleared[i], &cleared[j]) / (scales[i] * scales[j]));
    let inverse = normal.pseudo_inverse(1e-10).unwrap_or_else(|_| DMatrix::identity(k, k));
    let blocks = &bench.frame.blocks;
    let count = blocks.len() - 1;
    let mut meat = DMatrix::<f64>::zeros(k, k);
    for b in 0..count {
        let range = blocks[b]..blocks[b + 1];
        let with_table = fit.residual.len() > bench.rows;
        let score = DVector::from_fn(k, |i, _| {
            let mut sum = dot(&cleared[i][range.clone()], &fit.residual[range.clone()]);
            if with_table {
                let range = range.start + bench.rows..range.end + bench.rows;
                sum += dot(&cleared[i][range.clone()], &fit.residual[range]);
            }
            sum / scales[i]
        });
        meat += &score * score.transpose();
    }
    // Few blocks: the usual widening, and Student's 1.05 at twenty-odd degrees of freedom.
    let blocks_over = count as f64 / (count as f64 - k as f64).max(1.0);
    let covariance = &inverse * meat * &inverse * (blocks_over * 1.1);
    DMatrix::from_fn(k, k, |i, j| covariance[(i, j)] / (scales[i] * scales[j]))
}
