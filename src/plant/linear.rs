//! Linear algebra that always ends, and the size of a column.

use nalgebra::{DMatrix, Dyn, SVD};

/// Most iterations of a decomposition; sound matrices need some ten for each column.
const MOST: usize = 1000;

/// Singular values and vectors of a matrix; `None` where it holds what is not finite, on which the library would never end.
#[must_use]
pub fn decomposed(matrix: DMatrix<f64>) -> Option<SVD<f64, Dyn, Dyn>> {
    let finite = matrix.iter().all(|value| value.is_finite());
    finite.then(|| SVD::try_new(matrix, true, true, 5.0 * f64::EPSILON, MOST))?
}

/// Root of the mean square; 0 of nothing.
#[must_use]
pub fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, n) = values.fold((0.0, 0_u64), |(sum, n), v| (sum + v * v, n + 1));
    (sum / n.max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_answers_what_is_finite_and_nothing_else() {
        let singular =
            |m: DMatrix<f64>| decomposed(m).map(|svd| svd.singular_values.iter().copied().collect::<Vec<f64>>());
        assert_eq!(singular(DMatrix::zeros(3, 3)), Some(vec![0.0; 3]));
        let found = singular(DMatrix::from_diagonal_element(2, 2, -3.0)).unwrap();
        assert!(found.iter().all(|value| (value - 3.0).abs() < 1e-12), "{found:?}");
        for odd in [f64::NAN, f64::INFINITY] {
            assert_eq!(singular(DMatrix::from_element(2, 2, odd)), None);
        }
    }
}
