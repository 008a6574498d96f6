//! Least squares over a set of causes: y = Σ fixed + Σ coefficient·regressor, torque and table − encoder stacked, each over
//! its own noise floor, so that one sum of squares weighs both.
//!
//! Linear coefficients are projected out (orthonormal basis by modified Gram–Schmidt, twice); non-linear parameters are refined on
//! what is left (`refine`).

mod beside;
mod few;
mod given;
mod noise;
mod refine;
mod slopes;
mod smoothed;

pub use beside::Beside;
pub use slopes::Slope;

use super::causes::{Law, Resistance, Rest, Term, Trace};
use super::frame::Frame;
use super::known::Known;
use super::many::{add, dot};
use crate::machine::{Cause, Effect};
use crate::plant::linear::decomposed;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use slopes::Side;
use std::ops::Range;
use std::sync::{Arc, OnceLock};

/// How much larger than at a start the trace of a cause without coefficients is taken to become.
const MOST_SIZE: f64 = 2.0;

/// A recording as one system of equations.
#[derive(Debug)]
pub struct Bench<'f, 'a> {
    /// The recording.
    pub frame: &'f Frame<'a>,
    /// Measured less believed, stacked and scaled.
    pub measured: Vec<f64>,
    /// Noise floors of torque and table − encoder at the judged rows, first guess.
    pub floors: [f64; 2],
    /// What the belief's effects may be off by, stacked and scaled.
    pub doubt: Vec<f64>,
    /// Weight of each row beside its noise: less where what is believed there may be off, stacked.
    certain: Vec<f64>,
    /// Judged rows of the torque; those of the table follow.
    pub rows: usize,
    /// Orthonormal columns that are free in every fit: the zero of the table's scale.
    free: Vec<Vec<f64>>,
    /// What the belief has that resists the table.
    resistance: Arc<Resistance>,
    /// Judged rows that are summed to one; none where rows are as they are.
    windows: Vec<Range<usize>>,
}

/// A cause in a fit.
#[derive(Debug, Clone)]
pub struct Part {
    /// Which.
    pub law: &'static Law,
    /// Non-linear parameters.
    pub shape: Vec<f64>,
    // Shared: sets of causes are copied often, their columns never change.
    fixed: Option<Arc<[f64]>>,
    columns: Arc<[Vec<f64>]>,
    /// Under what a table was simulated.
    resistance: Arc<Resistance>,
    /// The part to either side of where it stands, once somebody has asked for it.
    sides: Arc<OnceLock<Vec<Side>>>,
}

/// A fitted set of causes.
#[derive(Debug, Clone)]
pub struct Fit {
    /// The causes.
    pub parts: Vec<Part>,
    /// Coefficients of each.
    pub coefficients: Vec<Vec<f64>>,
    /// What is left, stacked and scaled.
    pub residual: Vec<f64>,
    basis: Vec<Vec<f64>>,
    rows: usize,
    noise: OnceLock<[f64; 2]>,
}

impl<'f, 'a> Bench<'f, 'a> {
    /// Sets up the equations beside what is believed.
    #[must_use]
    pub fn new(frame: &'f Frame<'a>, known: &Known) -> Self {
        let less = |measured: Vec<f64>, expected: &[f64]| -> Vec<f64> {
            measured.iter().zip(expected).map(|(measured, expected)| measured - expected).collect()
        };
        let left = Trace {
            torque: less(frame.torque(0.0), &known.trace.torque),
            table: less(frame.table_error(), &known.trace.table),
        };
        let floor_of_table = if left.table.is_empty() { 1.0 } else { frame.floor(&left.table, false) };
        let floors = [frame.floor(&left.torque, true), floor_of_table];
        let rows = left.torque.len();
        let (doubt, measured, windows) = (Vec::new(), Vec::new(), Vec::new());
        let certain = vec![1.0; rows + left.table.len()];
        let (free, resistance) = (Vec::new(), known.resistance.clone());
        let mut bench = Self { frame, measured, floors, doubt, certain, rows, free, resistance, windows };
        let doubt = bench.stack(&known.doubt);
        // A row errs by its noise and by what is believed there (generalised least squares).
        bench.certain = doubt.iter().map(|doubt| doubt.hypot(1.0).recip()).collect();
        bench.doubt = doubt.iter().zip(&bench.certain).map(|(doubt, certain)| doubt * certain).collect();
        bench.measured = bench.stack(&left);
        if !left.table.is_empty() {
            let mut level = bench.certain.clone();
            level[..rows].fill(0.0);
            let length = dot(&level, &level).sqrt();
            level.iter_mut().for_each(|level| *level /= length);
            bench.free.push(level);
        }
        bench
    }

    /// A trace as a column: torque and table − encoder stacked, each over its noise floor.
    #[must_use]
    pub fn stack(&self, trace: &Trace) -> Vec<f64> {
        let rows = self.frame.kept.len();
        let mut column = vec![0.0; if self.frame.columns.table.is_some() { 2 * rows } else { rows }];
        let weighted = trace.torque.iter().zip(&self.frame.weights);
        column.iter_mut().zip(weighted).for_each(|(c, (t, w))| *c = w * t / self.floors[0]);
        column.iter_mut().skip(rows).zip(&trace.table).for_each(|(c, t)| *c = t / self.floors[1]);
        column.iter_mut().zip(&self.certain).for_each(|(c, certain)| *c *= certain);
        smoothed::summed(column, rows, &self.windows)
    }

    /// A cause at given non-linear parameters, once for each set of them.
    #[must_use]
    pub fn parts(&self, law: &'static Law, shapes: Vec<Vec<f64>>) -> Vec<Part> {
        self.parts_under(law, shapes, &self.resistance)
    }

    /// A part at other non-linear parameters, once for each set of them.
    #[must_use]
    pub fn parts_like(&self, part: &Part, shapes: Vec<Vec<f64>>) -> Vec<Part> {
        self.parts_under(part.law, shapes, &part.resistance)
    }

    /// A cause under what resists a table.
    #[must_use]
    pub fn parts_under(&self, law: &'static Law, shapes: Vec<Vec<f64>>, resistance: &Arc<Resistance>) -> Vec<Part> {
        let terms = law.terms(self.frame, resistance, &shapes);
        let part = |(shape, Term { fixed, regressors }): (Vec<f64>, Term)| {
            let fixed = fixed.map(|trace| self.stack(&trace).into());
            let columns = regressors.iter().map(|trace| self.stack(trace)).collect();
            Part { law, shape, fixed, columns, resistance: resistance.clone(), sides: Arc::default() }
        };
        shapes.into_par_iter().zip(terms).map(part).collect()
    }

    /// What is left, channel by channel, in their own units; rows of the torque by their weight.
    #[must_use]
    pub fn rest(&self, fit: &Fit) -> [Vec<f64>; 2] {
        let left: Vec<f64> = fit.residual.iter().zip(&self.certain).map(|(left, certain)| left / certain).collect();
        let (torque, table) = left.split_at(self.rows);
        [torque.iter().map(|r| r * self.floors[0]).collect(), table.iter().map(|r| r * self.floors[1]).collect()]
    }

    /// Root mean square of what is left of each channel, in their own units, as far as what is believed holds exactly.
    #[must_use]
    pub fn certain_rms(&self, fit: &Fit) -> [f64; 2] {
        let (torque, table) = fit.residual.split_at(self.rows);
        [(torque, self.floors[0]), (table, self.floors[1])]
            .map(|(left, floor)| floor * (dot(left, left) / left.len().max(1) as f64).sqrt())
    }

    /// Starts of a law on what is left.
    #[must_use]
    pub fn starts(&self, law: &Law, fit: &Fit) -> Vec<Vec<f64>> {
        let [torque, table] = self.rest(fit);
        (law.starts)(self.frame, &Rest { torque: &torque, table: &table })
    }

    /// Fits the coefficients of these parts.
    #[must_use]
    pub fn fit(&self, parts: Vec<Part>) -> Fit {
        let mut basis = self.free.clone();
        let mut residual = self.measured.clone();
        for part in &parts {
            if let Some(fixed) = &part.fixed {
                residual.iter_mut().zip(fixed.iter()).for_each(|(r, f)| *r -= f);
            }
        }
        let free = basis.len();
        // R of the decomposition, for the coefficients.
        let mut triangle: Vec<Vec<f64>> = Vec::new();
        for column in parts.iter().flat_map(|part| part.columns.iter()) {
            let (direction, weights) = orthonormal(column, &basis, &[]);
            basis.push(direction);
            triangle.push(weights);
        }
        let mut target: Vec<f64> = Vec::with_capacity(basis.len());
        for direction in &basis {
            let along = dot(direction, &residual);
            add(&mut residual, -along, direction);
            target.push(along);
        }
        let count = triangle.len();
        let mut solution = vec![0.0; count];
        for i in (0..count).rev() {
            let above: f64 = (i + 1..count).map(|j| triangle[j][free + i] * solution[j]).sum();
            let diagonal = triangle[i][free + i];
            solution[i] = if diagonal > 0.0 { (target[free + i] - above) / diagonal } else { 0.0 };
        }
        let mut next = solution.into_iter();
        let coefficients = parts.iter().map(|p| next.by_ref().take(p.columns.len()).collect()).collect();
        Fit { parts, coefficients, residual, basis, rows: self.rows, noise: OnceLock::new() }
    }

    /// The others of a set, fitted without one of its parts; their non-linear parameters stay.
    #[must_use]
    pub fn without(&self, fit: &Fit, part: usize) -> Fit {
        let mut parts = fit.parts.clone();
        parts.remove(part);
        self.fit(parts)
    }

    /// Sum of squares per channel if this part joined a fit whose other parts keep their non-linear parameters.
    #[must_use]
    pub fn joined(&self, fit: &Fit, part: &Part) -> Vec<f64> {
        channel_squares(&self.left_joined(fit, part).1, self.rows)
    }

    /// What would be left, and the share of its size at which the part's own trace would leave that.
    #[must_use]
    pub fn left_joined(&self, fit: &Fit, part: &Part) -> (f64, Vec<f64>) {
        let mut residual = fit.residual.clone();
        let mut own: Vec<Vec<f64>> = Vec::new();
        let clear = |column: &[f64], own: &[Vec<f64>]| {
            let mut c = column.to_vec();
            for direction in fit.basis.iter().chain(own) {
                let along = dot(direction, &c);
                // Levels of different channels have nothing in common.
                if along != 0.0 {
                    add(&mut c, -along, direction);
                }
            }
            c
        };
        let mut size = 1.0;
        if let Some(fixed) = &part.fixed {
            let fixed = clear(fixed, &[]);
            // A start is not yet as large as it will be: without coefficients its trace counts by its form.
            let along = dot(&fixed, &residual) / dot(&fixed, &fixed).max(1e-300);
            size = if part.columns.is_empty() { along.clamp(0.0, MOST_SIZE) } else { 1.0 };
            add(&mut residual, -size, &fixed);
        }
        for column in part.columns.iter() {
            let mut c = clear(column, &own);
            let length = dot(&c, &c);
            if length > 1e-9 * dot(column, column) {
                let scale = length.sqrt().recip();
                c.iter_mut().for_each(|c| *c *= scale);
                let along = dot(&c, &residual);
                add(&mut residual, -along, &c);
                own.push(c);
            }
        }
        (size, residual)
    }

    /// The coefficients that the rows outside some blocks give, at the same non-linear parameters.
    #[must_use]
    pub fn coefficients_without(&self, fit: &Fit, left_out: impl Fn(usize) -> bool) -> Vec<Vec<f64>> {
        let basis = &fit.basis;
        let (k, free) = (basis.len(), self.free.len());
        let columns: Vec<&Vec<f64>> = fit.parts.iter().flat_map(|part| part.columns.iter()).collect();
        if columns.is_empty() {
            return fit.coefficients.clone();
        }
        // On an orthonormal basis U the rest of the rows gives t − (1 − U_bᵀ·U_b)⁻¹·U_bᵀ·r_b in place of t = Uᵀ·y.
        let blocks = self.frame.blocks.windows(2).enumerate().filter(|(block, _)| left_out(*block));
        let (normal, right) = fit.outside(blocks.flat_map(|(_, ends)| self.pieces(ends[0]..ends[1])));
        // A direction of which the other rows know nothing stays as it was.
        let change = pseudo_inverse(normal, 1e-3).unwrap_or_else(|| DMatrix::zeros(k, k)) * right;
        let triangle = DMatrix::from_fn(columns.len(), columns.len(), |i, j| dot(&basis[free + i], columns[j]));
        let change = DVector::from_fn(columns.len(), |i, _| change[free + i]);
        let change =
            pseudo_inverse(triangle, 1e-12).map_or_else(|| DVector::zeros(columns.len()), |inverse| inverse * change);
        let mut change = change.iter();
        fit.coefficients.iter().map(|own| own.iter().map(|c| c - change.next().unwrap_or(&0.0)).collect()).collect()
    }

    /// Mean square of what is left in each channel.
    #[must_use]
    pub fn channels(&self, left: &[f64]) -> Vec<f64> {
        channel_squares(left, self.rows)
    }

    /// The stacked rows of a block: those of the torque and, with a table scale, those of table − encoder.
    #[must_use]
    pub fn pieces(&self, block: Range<usize>) -> Vec<Range<usize>> {
        let table = block.start + self.rows..block.end + self.rows;
        if self.measured.len() > self.rows { vec![block, table] } else { vec![block] }
    }
}

impl Part {
    /// The same on other equations of the same rows, by what these make of a column.
    fn on_others(&self, of: impl Fn(&[f64]) -> Vec<f64>) -> Self {
        Self {
            fixed: self.fixed.as_deref().map(|fixed| of(fixed).into()),
            columns: self.columns.iter().map(|column| of(column)).collect(),
            sides: Arc::default(),
            ..self.clone()
        }
    }

    /// Its non-linear parameters with one of them at another value.
    fn shape_with(&self, index: usize, value: f64) -> Vec<f64> {
        let mut shape = self.shape.clone();
        shape[index] = value;
        shape
    }

    /// Number of its non-linear parameters that are fitted.
    #[must_use]
    pub fn free_parameters(&self) -> usize {
        self.shape.iter().enumerate().filter(|(i, value)| !self.law.is_as_usual(*i, **value)).count()
    }
}

impl Fit {
    /// Weighted sum of squares.
    #[must_use]
    pub fn squares(&self) -> f64 {
        dot(&self.residual, &self.residual)
    }

    /// Sum of squares of each channel, per row: 1 is the first guess of the noise floor.
    #[must_use]
    pub fn channels(&self) -> Vec<f64> {
        channel_squares(&self.residual, self.rows)
    }

    /// Whether it leaves less than half of what another set leaves of a channel, in amplitude.
    #[must_use]
    pub fn halves(&self, other: &Fit) -> bool {
        other.channels().iter().zip(self.channels()).any(|(other, own)| *other > 4.0 * own)
    }

    /// The figure by which sets of causes are compared: Σ ln of the mean square of each channel.
    #[must_use]
    pub fn figure(&self) -> f64 {
        figure(&self.channels())
    }

    /// The effects that the parts stand for; none for a part beyond its physical bounds.
    pub fn effects(&self, frame: &Frame) -> impl Iterator<Item = Effect> {
        let pairs = self.parts.iter().zip(&self.coefficients);
        pairs.filter_map(|(part, c)| part.law.effect(frame, &part.shape, c))
    }

    /// Which part simulates the table behind a spring or a clearance; there is one at most.
    #[must_use]
    pub fn table(&self) -> Option<usize> {
        self.parts.iter().position(|part| part.law.is_simulated())
    }

    /// Whether the trace of one part goes with the numbers of others.
    #[must_use]
    pub fn goes_together(&self) -> bool {
        let any = |is: fn(&Law) -> bool| self.parts.iter().any(|part| is(part.law));
        self.table().is_some() || any(Law::is_delivered) && any(|law| law.cause == Cause::TorqueSaturation)
    }

    /// Number of fitted numbers.
    #[must_use]
    pub fn numbers(&self) -> usize {
        self.parts.iter().map(|p| p.columns.len() + p.free_parameters()).sum()
    }

    /// Orthonormal columns of the fit, free ones first.
    #[must_use]
    pub fn basis(&self) -> &[Vec<f64>] {
        &self.basis
    }

    /// The regressors of a part, stacked and scaled.
    #[must_use]
    pub fn columns(&self, part: usize) -> &[Vec<f64>] {
        &self.parts[part].columns
    }

    /// What the rows outside some pieces know: 1 − U_bᵀ·U_b, and U_bᵀ·r_b, with the orthonormal columns U and the residual r.
    #[must_use]
    pub fn outside(&self, pieces: impl IntoIterator<Item = Range<usize>>) -> (DMatrix<f64>, DVector<f64>) {
        let k = self.basis.len();
        let (mut normal, mut right) = (DMatrix::identity(k, k), DVector::zeros(k));
        for piece in pieces {
            let own: Vec<&[f64]> = self.basis.iter().map(|column| &column[piece.clone()]).collect();
            for i in 0..k {
                right[i] += dot(own[i], &self.residual[piece.clone()]);
                for j in 0..k {
                    normal[(i, j)] -= dot(own[i], own[j]);
                }
            }
        }
        (normal, right)
    }

    /// What a part adds, stacked and scaled.
    #[must_use]
    pub fn contribution(&self, part: usize) -> Vec<f64> {
        let p = &self.parts[part];
        let mut sum = p.fixed.as_ref().map_or_else(|| vec![0.0; self.residual.len()], |f| f.to_vec());
        for (column, c) in p.columns.iter().zip(&self.coefficients[part]) {
            sum.iter_mut().zip(column).for_each(|(s, v)| *s += c * v);
        }
        sum
    }
}

/// Σ ln(mean square + 0.1) over channels: what is gained well below the noise floor counts little.
#[must_use]
pub fn figure(channels: &[f64]) -> f64 {
    channels.iter().map(|c| (c + 0.1).ln()).sum()
}

fn channel_squares(residual: &[f64], rows: usize) -> Vec<f64> {
    let (torque, table) = residual.split_at(rows.min(residual.len()));
    let mean = |part: &[f64]| dot(part, part) / part.len() as f64;
    if table.is_empty() { vec![mean(torque)] } else { vec![mean(torque), mean(table)] }
}

/// The inverse of what a matrix does above `least`; `None` where it is not finite.
#[must_use]
pub fn pseudo_inverse(matrix: DMatrix<f64>, least: f64) -> Option<DMatrix<f64>> {
    decomposed(matrix)?.pseudo_inverse(least).ok()
}

/// The part of a column that stands on a basis of two pieces, with unit length, and its weights on basis and itself. A column that
/// the basis already spans gives a zero column.
pub(super) fn orthonormal(column: &[f64], basis: &[Vec<f64>], more: &[Vec<f64>]) -> (Vec<f64>, Vec<f64>) {
    let mut c = column.to_vec();
    let count = basis.len() + more.len();
    let mut weights = vec![0.0; count + 1];
    let (whole, mut length) = (dot(column, column).sqrt(), f64::INFINITY);
    // Taking off most of a column leaves rounding errors along the basis, which a second time takes off (Parlett 1980).
    for _ in 0..2 {
        for (direction, weight) in basis.iter().chain(more).zip(&mut weights) {
            let along = dot(direction, &c);
            // Levels of different pieces have nothing in common.
            if along != 0.0 {
                add(&mut c, -along, direction);
                *weight += along;
            }
        }
        length = dot(&c, &c).sqrt();
        if length > 0.7 * whole {
            break;
        }
    }
    if length > 1e-6 * whole && length > 0.0 {
        c.iter_mut().for_each(|c| *c /= length);
        weights[count] = length;
    } else {
        c.fill(0.0);
    }
    (c, weights)
}

/// What a basis leaves of columns, as R of their decomposition, and a target along its directions.
fn projected(columns: &[&[f64]], basis: &[Vec<f64>], target: &[f64]) -> (DMatrix<f64>, DVector<f64>) {
    let mut own: Vec<Vec<f64>> = Vec::with_capacity(columns.len());
    let mut triangle = DMatrix::zeros(columns.len(), columns.len());
    for (j, column) in columns.iter().enumerate() {
        let (direction, weights) = orthonormal(column, basis, &own);
        own.push(direction);
        weights.iter().skip(basis.len()).enumerate().for_each(|(i, weight)| triangle[(i, j)] = *weight);
    }
    let along = own.iter().map(|direction| dot(direction, target));
    (triangle, DVector::from_iterator(columns.len(), along))
}

/// Least-squares coefficients of columns on what a basis leaves of them; 0 of a column of which nothing is left.
fn project(columns: &[&[f64]], basis: &[Vec<f64>], target: &[f64]) -> Vec<f64> {
    let (triangle, along) = projected(columns, basis, target);
    let mut solution = vec![0.0; columns.len()];
    for i in (0..columns.len()).rev() {
        let above: f64 = (i + 1..columns.len()).map(|j| triangle[(i, j)] * solution[j]).sum();
        solution[i] = if triangle[(i, i)] > 0.0 { (along[i] - above) / triangle[(i, i)] } else { 0.0 };
    }
    solution
}
