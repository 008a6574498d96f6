//! How sure the parameters are: a jackknife over contiguous blocks, which lets residuals be autocorrelated within a block
//! and as large in one place as they like, then the delta method from coefficients and non-linear parameters to those of
//! the file.
//!
//! Leaving block b out moves the estimate by δ_b = (N − M_b)⁻¹·X_bᵀ·r_b with N = XᵀX, M_b = X_bᵀ·X_b; the covariance is
//! (B − 1)/B·Σ δ_b·δ_bᵀ (Bell and McCaffrey 2002). What a few blocks tell is less sure than it seems: the deviation that is
//! stated is that of a normal distribution whose 95 % are as wide as those of Student's with as many degrees of freedom as
//! blocks effectively take part (Imbens and Kolesár 2016).

use super::blocks;
use super::causes::Trace;
use super::causes::table_side;
use super::causes::thermal_drift::SLOWEST;
use super::fit::{Bench, Fit, Part, Slope, pseudo_inverse};
use super::grids;
use super::many::{add, dot};
use crate::machine::{Cause, Effect};
use nalgebra::{DMatrix, DVector};
use std::ops::Range;

/// How exactly a law holds, as a share of its size: sampling, filter and the law itself are no better.
const LAW_HOLDS: f64 = 1e-3;

/// How much larger the errors of a simulated law are than what the jackknife sees: the simulation is driven by the encoder, whose
/// noise and grid pull the fit one way in every block, and the impacts of a clearance leave many minima side by side. With twice the
/// jackknife's deviation 78 of 100 random clearances lay within 95 %; with three times it 24 of 27 others, and 53 of 54
/// numbers of springs.
pub(super) const SIMULATED: f64 = 3.0;

/// Share of an unknown's column that one block may hold: leaving out a block that holds all of it would not move it.
pub(super) const MOST_IN_A_BLOCK: f64 = 0.5;

/// By how much, as a logarithm, a form that is taken to be as usual may be another one at most (a standard deviation): friction falls with
/// speed by exponents of 0.5 to 2 and more.
const ANOTHER_FORM: f64 = 0.7;

/// Unknowns of a fit, as columns of its equations: coefficients of all parts in order, then the non-linear parameters.
struct Unknowns<'s> {
    columns: Vec<&'s [f64]>,
    /// Where the coefficients of each part begin.
    coefficient_at: Vec<usize>,
    first_slope: usize,
}

impl<'s> Unknowns<'s> {
    fn of(fit: &'s Fit, slopes: &'s [Slope]) -> Self {
        let mut columns: Vec<&[f64]> = Vec::new();
        let mut coefficient_at = Vec::new();
        for (i, c) in fit.coefficients.iter().enumerate() {
            coefficient_at.push(columns.len());
            columns.extend(fit.columns(i).iter().take(c.len()).map(Vec::as_slice));
        }
        let first_slope = columns.len();
        columns.extend(slopes.iter().map(|s| s.column.as_slice()));
        Self { columns, coefficient_at, first_slope }
    }
}

/// By how many of its standard deviations each part is there at all: its coefficients together (Wald's test), or where it has
/// none its first parameter, by which it is small or large.
#[must_use]
pub fn strengths(bench: &Bench, fit: &Fit) -> Vec<f64> {
    let slopes = bench.slopes(fit, 0);
    let Unknowns { columns, coefficient_at, first_slope } = Unknowns::of(fit, &slopes);
    let spread = Spread::of(bench, fit, &columns, &[]);
    let misfit = misfit(bench, fit);
    let alone = |unknown: usize| DVector::from_fn(columns.len(), |i, _| f64::from(u8::from(i == unknown)));
    let of_first = |i: usize, part: &Part| {
        let Some(at) = slopes.iter().position(|s| s.part == i && s.index == 0) else { return f64::INFINITY };
        let size = part.shape[0].abs() / part.law.scales[0].rate(part.shape[0]);
        size / spread.deviation(&alone(first_slope + at)).max(1e-300)
    };
    let of_coefficients = |first: usize, c: &[f64]| {
        // In units of each coefficient, so that the inverse is well scaled: √(1ᵀ·C⁻¹·1).
        let unit = |k: usize| 1.0 / c[k].abs().max(1e-300).copysign(c[k]);
        let covariance =
            DMatrix::from_fn(c.len(), c.len(), |i, j| spread.covariance(first + i, first + j) * unit(i) * unit(j));
        let one = DVector::from_element(c.len(), 1.0);
        let square = pseudo_inverse(covariance, 1e-300).map_or(0.0, |inverse| one.dot(&(inverse * &one)));
        let widening = (0..c.len()).map(|k| spread.widening(&alone(first + k)));
        square.max(0.0).sqrt() / widening.fold(1.0, f64::max)
    };
    let strength = |(i, part): (usize, &Part)| {
        let c = &fit.coefficients[i];
        let strength = if c.is_empty() { of_first(i, part) } else { of_coefficients(coefficient_at[i], c) };
        if part.law.is_simulated() { strength / misfit } else { strength }
    };
    fit.parts.iter().enumerate().map(strength).collect()
}

/// The unknowns of a fit and how sure they are.
#[derive(Debug, Clone)]
pub struct Sure {
    /// Part and index of each non-linear parameter, forms that are as usual last; in the order of the unknowns they come after the
    /// coefficients of all parts.
    pub shapes: Vec<(usize, usize)>,
    /// Covariance of all unknowns, non-linear parameters in the units of their scales; as exactly as laws hold.
    pub covariance: DMatrix<f64>,
}

/// What the blocks say of each unknown of a fit, and of each form that is taken to be as usual.
#[must_use]
pub fn of_unknowns(bench: &Bench, fit: &Fit) -> Sure {
    let (slopes, forms) = (bench.slopes(fit, 0), bench.slopes_of_usual_forms(fit));
    let Unknowns { columns, first_slope, .. } = Unknowns::of(fit, &slopes);
    let spread = Spread::of(bench, fit, &columns, &forms);
    let simulated = SIMULATED * misfit(bench, fit);
    let mut widened = Vec::with_capacity(columns.len());
    let mut open = Vec::with_capacity(columns.len());
    for (part, own) in fit.parts.iter().zip(&fit.coefficients) {
        let widening = if part.law.is_simulated() { simulated } else { 1.0 };
        widened.extend(own.iter().map(|_| widening));
        open.extend(own.iter().map(|c| (LAW_HOLDS * c).powi(2)));
    }
    for Slope { part, index, .. } in &slopes {
        let (part, alone) = (&fit.parts[*part], fit.coefficients[*part].is_empty());
        let (scale, at) = (part.law.scales[*index], part.shape[*index]);
        widened.push(if part.law.is_simulated() { simulated } else { 1.0 });
        let holds = if alone { LAW_HOLDS * at.abs() / scale.rate(at) } else { 0.0 };
        open.push(holds.hypot(scale.stopped_between(at).map_or(0.0, |range| range / 1.96)).powi(2));
    }
    let alone = |unknown: usize| DVector::from_fn(columns.len(), |i, _| f64::from(u8::from(i == unknown)));
    widened.iter_mut().enumerate().for_each(|(i, widened)| *widened *= spread.widening(&alone(i)));
    let mut covariance =
        DMatrix::from_fn(columns.len(), columns.len(), |i, j| widened[i] * widened[j] * spread.covariance(i, j));
    open.iter().enumerate().for_each(|(i, open)| covariance[(i, i)] += open);
    debug_assert_eq!(first_slope + slopes.len(), columns.len());
    let shapes = slopes.iter().chain(&forms).map(|slope| (slope.part, slope.index)).collect();
    // What stands in for a form goes back as that becomes another one.
    let known = columns.len();
    let mut covariance = covariance.resize(known + forms.len(), known + forms.len(), 0.0);
    for (form, ByForm { stand_in, deviation }) in spread.by_form.iter().enumerate() {
        let together = stand_in.clone().push(-1.0) * *deviation;
        let at = |k: usize| if k < known { k } else { known + form };
        for i in 0..=known {
            for j in 0..=known {
                covariance[(at(i), at(j))] += together[i] * together[j];
            }
        }
    }
    Sure { shapes, covariance }
}

/// Effects with the standard deviation of each parameter, in the order of the fit's parts; `None` where the parameters
/// left their physical bounds. How sure the unknowns are is what the blocks say, unless it is given.
#[must_use]
pub fn effects(bench: &Bench, fit: &Fit, sure: Option<&Sure>) -> Vec<Option<(Effect, Vec<f64>)>> {
    let slopes = if sure.is_some() { Vec::new() } else { bench.slopes(fit, 0) };
    let Unknowns { columns, coefficient_at, first_slope } = Unknowns::of(fit, &slopes);
    let by_blocks = sure.is_none().then(|| {
        let forms = bench.slopes_of_usual_forms(fit);
        (Spread::of(bench, fit, &columns, &forms), misfit(bench, fit))
    });
    let shapes: Vec<(usize, usize)> =
        sure.map_or_else(|| slopes.iter().map(|slope| (slope.part, slope.index)).collect(), |sure| sure.shapes.clone());
    let unknowns = first_slope + shapes.len();
    let deviation_of = |part: &Part, gradient: &DVector<f64>| match (&by_blocks, sure) {
        (Some((spread, misfit)), _) => {
            let widened = if part.law.is_simulated() { SIMULATED * misfit } else { 1.0 };
            let by_sampling = (widened * spread.deviation(gradient)).hypot(gradient.dot(&spread.by_sampling));
            spread.by_form.iter().fold(by_sampling, |all, by| all.hypot(gradient.dot(&by.stand_in) * by.deviation))
        }
        (None, Some(sure)) => gradient.dot(&(&sure.covariance * gradient)).max(0.0).sqrt(),
        (None, None) => 0.0,
    };
    fit.parts
        .iter()
        .enumerate()
        .map(|(i, part)| {
            let effect_of = |shape: &[f64], c: &[f64]| part.law.effect(bench.frame, shape, c);
            let effect = effect_of(&part.shape, &fit.coefficients[i])?;
            let values = effect.values();
            // Derivatives of the file's parameters by each unknown of this part.
            let mut gradient = DMatrix::<f64>::zeros(values.len(), unknowns);
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
            let own_shapes = || shapes.iter().enumerate().filter(|(_, of)| of.0 == i).map(|(s, of)| (s, of.1));
            for (s, index) in own_shapes() {
                let mut shape = part.shape.clone();
                let scale = part.law.scales[index];
                let step = 1e-4 * shape[index].abs().max(1e-6);
                shape[index] += step;
                let rate = scale.rate(part.shape[index]);
                differ(first_slope + s, step / rate, effect_of(&shape, &fit.coefficients[i]));
            }
            // A number that stopped at its bound may be anything within them: blocks that agree on the bound know no better.
            let ends: Vec<(usize, f64)> = own_shapes()
                .filter_map(|(s, index)| {
                    let range = part.law.scales[index].stopped_between(part.shape[index])?;
                    Some((first_slope + s, range / 1.96))
                })
                .collect();
            let own = coefficient_at[i]..coefficient_at[i] + fit.coefficients[i].len();
            let deviation = |k: usize| {
                let by_coefficients =
                    own.clone().zip(&fit.coefficients[i]).map(|(u, c)| (gradient[(k, u)] * c).powi(2)).sum::<f64>();
                // What no unknown moves was not found.
                let moves = gradient.row(k).iter().any(|by| *by != 0.0);
                let alone = if moves { values[k].abs() } else { 0.0 };
                let size = if own.is_empty() { alone } else { by_coefficients.sqrt() };
                let found = deviation_of(part, &gradient.row(k).transpose()).hypot(LAW_HOLDS * size);
                ends.iter().fold(found, |all, (unknown, range)| all.hypot(gradient[(k, *unknown)] * range))
            };
            let mut deviations: Vec<f64> = (0..values.len()).map(deviation).collect();
            // A form that stays as usual was not found: others are less sure for it, but it is not said.
            for (s, _) in own_shapes().filter(|(_, index)| part.law.is_as_usual(*index, part.shape[*index])) {
                let its = (0..values.len()).filter(|k| gradient[(*k, first_slope + s)] != 0.0);
                its.for_each(|k| deviations[k] = 0.0);
            }
            for &(index, off) in part.law.manner.taken {
                let ends = [off, -off].map(|off| {
                    let mut shape = part.shape.clone();
                    shape[index] += off;
                    effect_of(&shape, &fit.coefficients[i]).map_or_else(|| values.clone(), |moved| moved.values())
                });
                let apart = ends[0].iter().zip(&ends[1]).map(|(above, below)| 0.5 * (above - below));
                deviations.iter_mut().zip(apart).for_each(|(deviation, off)| *deviation = deviation.hypot(off));
            }
            match (effect, deviations.as_mut_slice()) {
                (Effect::DeadTime { .. }, [deviation]) => {
                    *deviation = deviation.hypot(1e3 * grids::delay_s(bench.frame));
                }
                // Where it begins to saturate is a corner, which the low-pass rounds.
                (Effect::TorqueSaturation { limit, .. }, [deviation, ..]) => {
                    *deviation = deviation.hypot(LAW_HOLDS * limit);
                }
                (Effect::DriveCompliance { .. }, [.., deviation]) => {
                    *deviation = deviation.hypot(table_side::open_damping(bench.frame, &effect));
                }
                _ => {}
            }
            // At its bound a time constant may be any longer one.
            if let (Effect::ThermalDrift { time_constant_s, .. }, [_, deviation, _]) =
                (effect, deviations.as_mut_slice())
                && part.shape[0] >= 0.999 * SLOWEST
            {
                *deviation = time_constant_s;
            }
            Some((effect, deviations))
        })
        .collect()
}

/// Widens the deviations by how far fits of the same causes that leave about as much lie apart.
pub fn widen(bench: &Bench, effects: &mut [Option<(Effect, Vec<f64>)>], alike: &[Fit]) {
    for (i, (effect, deviations)) in effects.iter_mut().enumerate().filter_map(|(i, e)| Some((i, e.as_mut()?))) {
        let values = effect.values();
        let others: Vec<Vec<f64>> = (alike.iter().filter_map(|fit| {
            let part = fit.parts.get(i)?;
            Some(part.law.effect(bench.frame, &part.shape, &fit.coefficients[i])?.values())
        }))
        .collect();
        for (k, deviation) in deviations.iter_mut().enumerate() {
            let apart: f64 = others.iter().map(|other| (other[k] - values[k]).powi(2)).sum();
            *deviation = deviation.hypot((apart / others.len().max(1) as f64).sqrt());
        }
    }
}

/// By how much a fit has the torque column late, s, where nobody knows how its rows were sampled and that may well be all of it:
/// the 95 % of a dead time hold zero.
#[must_use]
pub fn late_by_sampling(bench: &Bench, fit: &Fit) -> Option<f64> {
    let open_s = bench.frame.sampling.deviation_s();
    let part = fit.parts.iter().position(|part| part.law.cause == Cause::DeadTime).filter(|_| open_s > 0.0)?;
    let (_, deviations) = effects(bench, fit, None).swap_remove(part)?;
    let late_ms = *fit.parts[part].shape.first()?;
    (late_ms.abs() < 2.0 * deviations.first()?).then_some(1e-3 * late_ms)
}

/// What is left over its noise floor, 1 or more. Where a simulation is fitted, what is left is its own error, alike in every
/// block, of which a jackknife knows nothing (Birge 1932: errors grow with the root of the reduced χ²).
fn misfit(bench: &Bench, fit: &Fit) -> f64 {
    let rest = bench.rest(fit);
    let over = |(c, rest): (usize, &Vec<f64>)| {
        let square = dot(rest, rest) / rest.len().max(1) as f64;
        square.sqrt() / bench.frame.floor(rest, c == 0).max(1e-300)
    };
    rest.iter().enumerate().filter(|(_, rest)| !rest.is_empty()).map(over).fold(1.0, f64::max)
}

/// What the blocks say about all unknowns.
struct Spread {
    /// By how much each block moves the unknowns when it is left out.
    moves: Vec<DVector<f64>>,
    /// N⁻¹·M_b·N⁻¹: the share of each block in what is known.
    shares: Vec<DMatrix<f64>>,
    /// By how much what nobody knows of the sampling of the torque moves the unknowns: alike in all blocks, which say nothing of it,
    /// and in proportion to what is there, so that it makes nothing of nothing.
    by_sampling: DVector<f64>,
    /// What is made of each form that is taken to be as usual.
    by_form: Vec<ByForm>,
}

/// A form that may be another one.
struct ByForm {
    /// By how much the unknowns stand in for it, each per unit of its logarithm.
    stand_in: DVector<f64>,
    /// By how much it may be another one (a standard deviation).
    deviation: f64,
}

impl Spread {
    fn of(bench: &Bench, fit: &Fit, columns: &[&[f64]], forms: &[Slope]) -> Spread {
        let k = columns.len();
        if k == 0 {
            let by_sampling = DVector::zeros(0);
            return Spread { moves: Vec::new(), shares: Vec::new(), by_sampling, by_form: Vec::new() };
        }
        // What every fit leaves free is taken off the columns first.
        let free = fit.basis().len() - fit.coefficients.iter().map(Vec::len).sum::<usize>();
        let clear = |mut column: Vec<f64>| {
            for direction in fit.basis().iter().take(free) {
                let along = dot(direction, &column);
                add(&mut column, -along, direction);
            }
            column
        };
        let cleared: Vec<Vec<f64>> = columns.iter().map(|column| clear(column.to_vec())).collect();
        // A column of nothing keeps its zeros.
        let scales: Vec<f64> = (cleared.iter().map(|c| dot(c, c).sqrt()))
            .map(|length| if length > 1e-140 { length } else { 1.0 })
            .collect();
        let normal = DMatrix::from_fn(k, k, |i, j| dot(&cleared[i], &cleared[j]) / (scales[i] * scales[j]));
        let pseudo = |m: &DMatrix<f64>| pseudo_inverse(m.clone(), 1e-10).unwrap_or_else(|| DMatrix::identity(k, k));
        let inverse = pseudo(&normal);
        let in_units = |moved: &DVector<f64>| DVector::from_fn(k, |i, _| moved[i] / scales[i]);
        // By how much the unknowns take a column on themselves, each in the unit of its own.
        let taken_on = |column: &[f64]| {
            let along = DVector::from_fn(k, |i, _| dot(&cleared[i], column) / scales[i]);
            &inverse * along
        };
        let by_sampling =
            slope_by_sampling(bench).map_or_else(|| DVector::zeros(k), |slope| in_units(&taken_on(&clear(slope))));
        let by_form = |Slope { column, .. }: &Slope| {
            let mut own = clear(column.clone());
            let taken = taken_on(&own);
            cleared.iter().enumerate().for_each(|(i, column)| add(&mut own, -taken[i] / scales[i], column));
            let square = dot(&own, &own).max(1e-300);
            // As far as it may be another one: by what is left of the fit, block by block, and by how much that asks for another.
            let along = |piece: Range<usize>| dot(&own[piece.clone()], &fit.residual[piece]);
            let blocks = bench.frame.blocks.windows(2).map(|ends| bench.pieces(ends[0]..ends[1]));
            let by_block: Vec<f64> = blocks.map(|pieces| pieces.into_iter().map(along).sum::<f64>() / square).collect();
            let (off, spread) = (by_block.iter().sum::<f64>(), by_block.iter().map(|by| by * by).sum::<f64>().sqrt());
            ByForm { stand_in: in_units(&taken), deviation: off.hypot(spread).min(ANOTHER_FORM) }
        };
        let by_form = forms.iter().map(by_form).collect();
        let (mut moves, mut shares) = (Vec::new(), Vec::new());
        for block in blocks::within(bench, &cleared, MOST_IN_A_BLOCK) {
            let pieces = bench.pieces(block);
            let over = |a: &[f64], b: &[f64]| pieces.iter().map(|p| dot(&a[p.clone()], &b[p.clone()])).sum::<f64>();
            let own = DMatrix::from_fn(k, k, |i, j| over(&cleared[i], &cleared[j]) / (scales[i] * scales[j]));
            let score = DVector::from_fn(k, |i, _| over(&cleared[i], &fit.residual) / scales[i]);
            // A block that alone knows of something cannot be left out; a twentieth of it stays.
            let moved = pseudo(&(&normal - &own * 0.95)) * score;
            moves.push(in_units(&moved));
            let share = &inverse * own * &inverse;
            shares.push(DMatrix::from_fn(k, k, |i, j| share[(i, j)] / (scales[i] * scales[j])));
        }
        Spread { moves, shares, by_sampling, by_form }
    }

    /// Covariance of two unknowns.
    fn covariance(&self, i: usize, j: usize) -> f64 {
        let blocks = self.moves.len() as f64;
        self.moves.iter().map(|m| m[i] * m[j]).sum::<f64>() * (blocks - 1.0) / blocks
    }

    /// Deviation of the parameter with this gradient by the unknowns.
    fn deviation(&self, gradient: &DVector<f64>) -> f64 {
        let blocks = self.moves.len() as f64;
        let variance: f64 = self.moves.iter().map(|m| gradient.dot(m).powi(2)).sum::<f64>() * (blocks - 1.0) / blocks;
        variance.max(0.0).sqrt() * self.widening(gradient)
    }

    /// By how much few blocks widen it.
    fn widening(&self, gradient: &DVector<f64>) -> f64 {
        let shares: Vec<f64> = self.shares.iter().map(|s| gradient.dot(&(s * gradient)).max(0.0)).collect();
        let (sum, squares) = shares.iter().fold((0.0, 0.0), |(sum, squares), s| (sum + s, squares + s * s));
        let taking_part = if squares > 0.0 { sum * sum / squares } else { 1.0 };
        widening(taking_part)
    }
}

/// What is measured the more, the later the torque column is by its sampling, per standard deviation of what nobody knows of that.
fn slope_by_sampling(bench: &Bench) -> Option<Vec<f64>> {
    let open_s = bench.frame.sampling.deviation_s();
    let [after, before] = [open_s, -open_s].map(|late_s| bench.frame.torque(late_s));
    let slope = || after.iter().zip(&before).map(|(after, before)| 0.5 * (after - before)).collect();
    (open_s > 0.0).then(|| bench.stack(&Trace::torque(slope())))
}

/// Half-width of Student's central 95 % over that of the normal distribution, by Fisher's expansion; fewer than two degrees
/// of freedom count as two.
#[must_use]
pub fn widening(freedom: f64) -> f64 {
    let v = freedom.max(2.0);
    1.0 + (2.372 + (2.823 + 2.555 / v) / v) / v / 1.96
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn student_s_quantiles() {
        for (freedom, quantile) in [(4.0, 2.776), (10.0, 2.228), (23.0, 2.069)] {
            assert!((1.96 * widening(freedom) / quantile - 1.0).abs() < 0.01, "{freedom}");
        }
    }
}
