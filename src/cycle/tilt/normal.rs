//! Normal equations of four unknowns, of which some may be without information: L·D·Lᵀ, with zero for a pivot that is lost.
//!
//! Unlike a Cholesky factor it goes on past such a pivot: its unknown comes out as 0, and the others as without it.

/// A symmetric matrix of four unknowns; the lower half is given.
pub type Square = [[f64; 4]; 4];

/// A factored matrix.
#[derive(Debug, Clone, Copy)]
pub struct Factors {
    lower: Square,
    /// What each unknown has of its own, which those before it do not explain; 0 without information.
    pub pivots: [f64; 4],
}

impl Factors {
    /// Factors a matrix; unknowns that are not `used` come out as 0.
    #[must_use]
    pub fn new(matrix: &Square, used: [bool; 4]) -> Factors {
        let (mut l, mut d) = ([[0.0; 4]; 4], [0.0; 4]);
        for j in 0..4 {
            let mut pivot = matrix[j][j];
            for k in 0..j {
                pivot -= l[j][k] * l[j][k] * d[k];
            }
            let sound = used[j] && pivot > 1e-12 * matrix[j][j] && pivot > 1e-200;
            d[j] = if sound { pivot } else { 0.0 };
            for i in j + 1..4 {
                let mut sum = matrix[i][j];
                for k in 0..j {
                    sum -= l[i][k] * l[j][k] * d[k];
                }
                l[i][j] = if sound { sum / pivot } else { 0.0 };
            }
        }
        Factors { lower: l, pivots: d }
    }

    /// The unknowns for a right side.
    #[must_use]
    pub fn solve(&self, right: &[f64; 4]) -> [f64; 4] {
        let (l, d) = (&self.lower, &self.pivots);
        let mut x = *right;
        for i in 0..4 {
            for k in 0..i {
                x[i] -= l[i][k] * x[k];
            }
        }
        for i in 0..4 {
            x[i] = if d[i] > 0.0 { x[i] / d[i] } else { 0.0 };
        }
        for i in (0..4).rev() {
            for k in i + 1..4 {
                x[i] -= l[k][i] * x[k];
            }
        }
        x
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solves_and_leaves_out_what_is_not_known() {
        let a = [[4.0, 0.0, 0.0, 0.0], [2.0, 5.0, 0.0, 0.0], [1.0, 1.0, 3.0, 0.0], [0.5, 0.2, 0.1, 2.0]];
        let x = [1.0, -2.0, 0.5, 3.0];
        let full = |i: usize, j: usize| if i >= j { a[i][j] } else { a[j][i] };
        let right = [0, 1, 2, 3].map(|i| (0..4).map(|j| full(i, j) * x[j]).sum());
        let found = Factors::new(&a, [true; 4]).solve(&right);
        assert!(found.iter().zip(x).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?}");
        // Without the third: the same as with a zero row and column, or when it is not to be used.
        let mut lost = a;
        (lost[2][0], lost[2][1], lost[2][2], lost[3][2]) = (0.0, 0.0, 0.0, 0.0);
        let right = [right[0], right[1], 0.0, right[3]];
        let (by_rank, by_choice) = (Factors::new(&lost, [true; 4]), Factors::new(&a, [true, true, false, true]));
        assert_eq!(by_rank.solve(&right)[2], 0.0);
        assert_eq!(by_choice.solve(&right)[2], 0.0);
        let [p, q] = [by_rank.solve(&right), by_choice.solve(&right)];
        assert!((0..4).all(|i| (p[i] - q[i]).abs() < 1e-12), "{p:?} {q:?}");
    }
}
