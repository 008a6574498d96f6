//! The normal equations of a fit with four parameters.

/// A symmetric positive definite system of four, factored.
#[derive(Debug)]
pub struct Cholesky([[f64; 4]; 4]);

impl Cholesky {
    /// Factors the matrix; `None` when it is singular.
    #[must_use]
    pub fn new(matrix: [[f64; 4]; 4]) -> Option<Cholesky> {
        const SINGULAR: f64 = 1e-10;
        let mut l = [[0.0; 4]; 4];
        for i in 0..4 {
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
    fn forward(&self, right: [f64; 4]) -> [f64; 4] {
        let l = &self.0;
        let mut y = right;
        for i in 0..4 {
            let dot: f64 = (0..i).map(|m| l[i][m] * y[m]).sum();
            y[i] = (y[i] - dot) / l[i][i];
        }
        y
    }

    /// g·A⁻¹·g, the variance of a sum weighted with g, as |L⁻¹·g|².
    #[must_use]
    pub fn inverse_form(&self, g: [f64; 4]) -> f64 {
        self.forward(g).iter().map(|y| y * y).sum()
    }

    /// A⁻¹·right.
    #[must_use]
    pub fn solve(&self, right: [f64; 4]) -> [f64; 4] {
        let l = &self.0;
        let mut y = self.forward(right);
        for i in (0..4).rev() {
            let dot: f64 = (i + 1..4).map(|m| l[m][i] * y[m]).sum();
            y[i] = (y[i] - dot) / l[i][i];
        }
        y
    }
}
