//! The same equations beside columns that are free in every fit: what those explain is taken off the measurement and off every
//! trace, and what is left is fitted as if they were not there (Frisch and Waugh 1933, Lovell 1963).

use super::{Bench, Fit, Part, add, dot, orthonormal};
use std::sync::Arc;

/// Equations beside free columns of the torque.
pub struct Beside<'f, 'a> {
    /// With what the free columns explain taken off; for parts from [`Beside::parts`] alone.
    pub bench: Bench<'f, 'a>,
    /// Orthonormal, at the rows of the torque.
    directions: Vec<Vec<f64>>,
}

impl<'f, 'a> Bench<'f, 'a> {
    /// These equations beside regressors of the torque, in its own unit or anything in proportion.
    #[must_use]
    pub fn beside(&self, regressors: Vec<Vec<f64>>) -> Beside<'f, 'a> {
        let mut directions: Vec<Vec<f64>> = Vec::with_capacity(regressors.len());
        for mut column in regressors {
            column.iter_mut().zip(&self.frame.weights).for_each(|(c, weight)| *c *= weight);
            let (direction, weights) = orthonormal(&column, &directions, &[]);
            if weights[directions.len()] > 0.0 {
                directions.push(direction);
            }
        }
        let mut measured = self.measured.clone();
        clear(&mut measured, &directions);
        let (known, free, windows) = (self.known.clone(), self.free.clone(), self.windows.clone());
        Beside { bench: Self { measured, known, free, windows, ..*self }, directions }
    }
}

impl Beside<'_, '_> {
    /// Parts of other equations of the same rows in these.
    #[must_use]
    pub fn parts(&self, parts: &[Part]) -> Vec<Part> {
        let cleared = |column: &[f64]| {
            let mut column = column.to_vec();
            clear(&mut column, &self.directions);
            column
        };
        let part = |part: &Part| Part {
            fixed: part.fixed.as_deref().map(|fixed| cleared(fixed).into()),
            columns: part.columns.iter().map(|column| cleared(column)).collect(),
            sides: Arc::default(),
            ..part.clone()
        };
        parts.iter().map(part).collect()
    }

    /// The fit of parts of other equations of the same rows.
    #[must_use]
    pub fn fit(&self, parts: &[Part]) -> Fit {
        self.bench.fit(self.parts(parts))
    }
}

/// Takes what directions explain off the torque of a stacked column; twice, since taking off most of a column leaves rounding
/// errors along them.
fn clear(column: &mut [f64], directions: &[Vec<f64>]) {
    let rows = directions.first().map_or(0, Vec::len).min(column.len());
    let torque = &mut column[..rows];
    for _ in 0..2 {
        for direction in directions {
            let along = dot(direction, torque);
            add(torque, -along, direction);
        }
    }
}
