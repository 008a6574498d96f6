//! The normal equations of a fit with a few parameters.

/// A symmetric positive definite system, factored.
#[derive(Debug)]
pub struct Cholesky<const N: usize>([[f64; N]; N]);

impl<const N: usize> Cholesky<N> {
    /// Factors the matrix; `None` when it is singular.
    #[must_use]
    pub fn new(matrix: [[f64; N]; N]) -> Option<Cholesky<N>> {
        const SINGULAR: f64 = 1e-10;
        let mut l = [[0.0; N]; N];
        for i in 0..N {
            for j in 0..=i {
                let dot: f64 = (0..j).map(|m| l[i][m] * l[j][m]).sum();
                let rest = matrix[i][j] - dot;
                if i == j {
                    if rest <= SINGULAR * matrix[i][i] {
                        return None;
                    }
                    l[i][i] = rest.sqrt();
                } else {
                    l[i][j] = rest / l[j][j];
                }
            }
        }
        Some(Cholesky(l))
    }

    /// L⁻¹·right.
    fn forward(&self, right: [f64; N]) -> [f64; N] {
        let l = &self.0;
        let mut y = right;
        for i in 0..N {
            let dot: f64 = (0..i).map(|m| l[i][m] * y[m]).sum();
            y[i] = (y[i] - dot) / l[i][i];
        }
        y
    }

    /// g·A⁻¹·g, the variance of a sum weighted with g, as |L⁻¹·g|².
    #[must_use]
    pub fn inverse_form(&self, g: [f64; N]) -> f64 {
        self.forward(g).iter().map(|y| y * y).sum()
    }

    /// A⁻¹·right.
    #[must_use]
    pub fn solve(&self, right: [f64; N]) -> [f64; N] {
        let l = &self.0;
        let mut y = self.forward(right);
        for i in (0..N).rev() {
            let dot: f64 = (i + 1..N).map(|m| l[m][i] * y[m]).sum();
            y[i] = (y[i] - dot) / l[i][i];
        }
        y
    }
}
