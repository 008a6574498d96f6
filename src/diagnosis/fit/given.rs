//! A fit with numbers that were not fitted to these rows alone.

use super::{Bench, Fit, Part, add, dot};

impl Bench<'_, '_> {
    /// The same causes with given numbers, whatever they leave.
    #[must_use]
    pub fn with_numbers(&self, fit: &Fit, shapes: &[Vec<f64>], coefficients: Vec<Vec<f64>>) -> Fit {
        let pairs = fit.parts.iter().zip(shapes);
        let moved = |(part, shape): (&Part, &Vec<f64>)| {
            if *shape == part.shape { part.clone() } else { self.parts_like(part, vec![shape.clone()]).swap_remove(0) }
        };
        let mut own = self.fit(pairs.map(moved).collect());
        let given = coefficients.iter().flatten().zip(own.coefficients.iter().flatten());
        let columns = own.parts.iter().flat_map(|part| part.columns.iter());
        let mut changed = vec![0.0; own.residual.len()];
        columns.zip(given).for_each(|(column, (given, best))| add(&mut changed, best - given, column));
        for direction in own.basis.iter().take(self.free.len()) {
            let along = dot(direction, &changed);
            add(&mut changed, -along, direction);
        }
        add(&mut own.residual, 1.0, &changed);
        Fit { coefficients, ..own }
    }
}
