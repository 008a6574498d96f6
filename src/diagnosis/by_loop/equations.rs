//! Normal equations of what the loop misses: the step that misses least, and how certain its numbers are.

use super::replays::Replays;
use crate::diagnosis::fit::pseudo_inverse;
use crate::diagnosis::missed::Over;
use crate::diagnosis::uncertainty::{SIMULATED, widening};
use nalgebra::{DMatrix, DVector};

/// Share of a block that stays where it alone knows of something.
const MOST_LEFT_OUT: f64 = 0.95;

/// Of each block.
pub struct Equations {
    blocks: Vec<(DMatrix<f64>, DVector<f64>)>,
}

impl Equations {
    /// Of slopes and of what is left, over these blocks.
    pub fn of(replays: &Replays, slopes: &[Vec<f64>], left: &[f64], over: Over) -> Self {
        let count = slopes.len();
        let of_block = |(rows, weight): (std::ops::Range<usize>, f64)| {
            let product = |a: &[f64], b: &[f64]| -> f64 {
                weight * a[rows.clone()].iter().zip(&b[rows.clone()]).map(|(a, b)| a * b).sum::<f64>()
            };
            let normal = DMatrix::from_fn(count, count, |i, j| product(&slopes[i], &slopes[j]));
            (normal, DVector::from_fn(count, |i, _| product(&slopes[i], left)))
        };
        Self { blocks: replays.weighed(left, over).map(of_block).collect() }
    }

    /// Over all blocks.
    fn sums(&self) -> (DMatrix<f64>, DVector<f64>) {
        let count = self.blocks.first().map_or(0, |(normal, _)| normal.nrows());
        let none = (DMatrix::zeros(count, count), DVector::zeros(count));
        self.blocks.iter().fold(none, |(normal, right), (n, r)| (normal + n, right + r))
    }

    /// The step that leaves least, numbers that nothing tells left where they are.
    pub fn solved(&self) -> Option<DVector<f64>> {
        let (normal, right) = self.sums();
        Some(inverse(normal)? * right)
    }

    /// Covariance of the numbers by a jackknife over blocks, beside a step.
    pub fn covariance(&self, by: &DVector<f64>) -> Option<DMatrix<f64>> {
        let (normal, _) = self.sums();
        let inverse = inverse(normal)?;
        let count = self.blocks.len() as f64;
        let mut sum = DMatrix::zeros(by.len(), by.len());
        for (own, right) in &self.blocks {
            let rest = DMatrix::identity(by.len(), by.len()) - MOST_LEFT_OUT * &inverse * own;
            let change = pseudo_inverse(rest, 1e-3)? * (&inverse * (right - own * by));
            sum += &change * change.transpose();
        }
        // A replay is a simulation, whose own errors are alike in all blocks.
        Some(sum * ((count - 1.0) / count * (SIMULATED * widening(count - by.len() as f64)).powi(2)))
    }
}

/// The inverse of normal equations, each number in its own unit.
fn inverse(normal: DMatrix<f64>) -> Option<DMatrix<f64>> {
    let unit = normal.diagonal().map(|square| if square > 0.0 { square.sqrt().recip() } else { 0.0 });
    let units = DMatrix::from_diagonal(&unit);
    Some(&units * pseudo_inverse(&units * normal * &units, 1e-6)? * &units)
}
