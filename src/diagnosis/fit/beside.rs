//! The same equations beside columns that are free in every fit: what those explain is taken off the measurement and off every
//! trace, and what is left is fitted as if they were not there (Frisch and Waugh 1933, Lovell 1963).

use super::{Bench, Fit, Part, add, dot, orthonormal, project};

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
        for column in regressors {
            let (direction, weights) = orthonormal(&self.weighted(column), &directions, &[]);
            if weights[directions.len()] > 0.0 {
                directions.push(direction);
            }
        }
        let mut measured = self.measured.clone();
        clear(&mut measured, &directions);
        let (doubt, certain, windows) = (self.doubt.clone(), self.certain.clone(), self.windows.clone());
        let resistance = self.resistance.clone();
        let mut free = self.free.clone();
        free.iter_mut().for_each(|column| clear(column, &directions));
        let free = orthonormalised(free);
        Beside { bench: Self { measured, doubt, certain, free, resistance, windows, ..*self }, directions }
    }
}

impl Bench<'_, '_> {
    /// A regressor of the torque with the weights of the rows.
    fn weighted(&self, mut regressor: Vec<f64>) -> Vec<f64> {
        let weights = self.frame.weights.iter().zip(&self.certain);
        regressor.iter_mut().zip(weights).for_each(|(r, (weight, certain))| *r *= weight * certain);
        regressor
    }

    /// What such regressors take off the squares of a fit without a cause.
    #[must_use]
    pub fn taken_by(&self, regressors: Vec<Vec<f64>>) -> f64 {
        let (mut directions, mut taken) = (self.free.clone(), 0.0);
        for column in regressors {
            let mut column = self.weighted(column);
            column.resize(self.measured.len(), 0.0);
            let (direction, _) = orthonormal(&column, &directions, &[]);
            taken += dot(&direction, &self.measured).powi(2);
            directions.push(direction);
        }
        taken
    }

    /// These equations with stacked columns that are free in every fit.
    #[must_use]
    pub fn beside_lines(&self, columns: &[Vec<f64>]) -> Self {
        let free = orthonormalised(self.free.iter().chain(columns).cloned().collect());
        let (doubt, certain, windows) = (self.doubt.clone(), self.certain.clone(), self.windows.clone());
        let resistance = self.resistance.clone();
        Self { measured: self.measured.clone(), doubt, certain, free, resistance, windows, ..*self }
    }

    /// What these columns together take of the measurement.
    #[must_use]
    pub fn sizes_of(&self, columns: &[Vec<f64>]) -> Vec<f64> {
        project(&columns.iter().map(Vec::as_slice).collect::<Vec<_>>(), &self.free, &self.measured)
    }
}

/// Columns made to stand on each other, of unit length; a single one is so already.
pub(super) fn orthonormalised(columns: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    if columns.len() < 2 {
        return columns;
    }
    let mut out: Vec<Vec<f64>> = Vec::with_capacity(columns.len());
    for column in &columns {
        let (direction, weights) = orthonormal(column, &out, &[]);
        if weights[out.len()] > 0.0 {
            out.push(direction);
        }
    }
    out
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
        parts.iter().map(|part| part.on_others(cleared)).collect()
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
