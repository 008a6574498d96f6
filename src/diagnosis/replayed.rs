//! The numbers of what is named, as the closed loop tells them too.
//!
//! The servo makes its torque of command and encoder, so that under the right machine the replayed position repeats the measured
//! one to a few steps of the encoder, at a torque that no sensor has to read: what the noise of the torque column hides, the
//! position often tells. Both say the same numbers, each with its own uncertainty, and where they agree the weighted mean of both
//! is better than either; where they do not, the loop is not the one that the machine file has, and the torque alone counts.
//!
//! With the torque's estimate θ₀ and covariance C = L·Lᵀ, the position error e and its derivatives J by θ, in the units
//! z = L⁻¹·(θ − θ₀): e(z) = e₀ − J·L·z. Along each eigenvector of (J·L)ᵀ·(J·L) the position says a ± √V, with V from a jackknife
//! over contiguous blocks, and the torque 0 ± 1: together a/(1 + V), with the variance V/(1 + V).

use super::belief;
use super::blocks;
use super::fit::{self, Bench, Fit};
use super::gain::HeldOut;
use super::judge::Judged;
use super::many::{add, dot};
use super::progress::{Stopped, Watch};
use super::select::LEAST_STRENGTH;
use super::uncertainty::{self, MOST_IN_A_BLOCK, SIMULATED, Sure, widening};
use crate::analysis::statistics;
use crate::machine::Axis;
use crate::plant::closed_loop::{Part, rows_of_the_beginning};
use crate::plant::linear::{decomposed, rms};
use crate::plant::observed::Observed;
use nalgebra::{DMatrix, DVector};

/// Contiguous blocks by which the position's word is judged.
const BLOCKS: usize = 24;
/// How much of a recording is replayed at most, s, and plant steps of that, of a rigid axis and of two masses, which take three times
/// as long for one.
const MOST_S: f64 = 40.0;
const MOST_STEPS: [usize; 2] = [640_000, 250_000];
/// What moved numbers change needs no finer plant steps than this many of the usual ones.
const COARSER: f64 = 8.0;
/// The beginning, of which nothing is said, is no larger part of what is replayed than one in so many.
const MOST_OF_ROWS: usize = 4;
/// Replays at most after those of the start and of the derivatives.
const MOST_TRIALS: usize = 5;
/// Share of the error that the first trial, and a further one, must promise to take off.
const WORTH: [f64; 2] = [0.005, 0.03];
/// How far the phase of a ripple may be off, rad, and what is a small turn of it.
const OPEN_PHASE: f64 = 0.3;
const SMALL_TURN: f64 = 0.01;
/// Deviations of a normal distribution beyond which torque and position contradict each other: more than chance makes even where
/// the deviations themselves are not well known.
const CONTRADICTS: f64 = 5.0;
const STAGE: &str = "replaying the closed loop";

/// A fit with numbers that position and torque tell together.
pub struct Replayed {
    /// With those numbers.
    pub fit: Fit,
    /// How sure they are.
    pub sure: Sure,
}

/// What is named with the numbers that position and torque tell together; `None` where no loop can be replayed, where the position
/// does not tell them, or where it contradicts the torque.
///
/// # Errors
/// [`Stopped`] when the watch's caller said so.
pub fn refined(bench: &Bench, held_out: &HeldOut, judged: &Judged, watch: &Watch) -> Result<Option<Replayed>, Stopped> {
    let fit = &judged.selection.fit;
    let recording = held_out.recording().filter(|_| !fit.parts.is_empty());
    let Some(((axis, (observed, servo)), known)) = recording.zip(judged.replay.as_ref()) else { return Ok(None) };
    let manner = &known.manner;
    let position = judged.gains.iter().find(|gain| gain.channel == "position");
    if position.is_none_or(|gain| gain.after <= statistics::white_noise(&observed.position).unwrap_or(0.0)) {
        return Ok(None);
    }
    let machine = |numbers: &Numbers| numbers.machine(axis, bench, fit);
    let Some(named) = machine(&Numbers::of(fit)) else { return Ok(None) };
    let rows = rows(&named, observed).min(known.error.len());
    // Nobody knows how the table lay in its clearance at first, nor what friction held.
    let begun = axis.servo.map_or(0, |servo| rows_of_the_beginning(&servo, observed)).min(rows / MOST_OF_ROWS);
    let error = |position: &[f64]| -> Vec<f64> {
        let rows = observed.position.iter().zip(position).skip(begun);
        rows.map(|(measured, replayed)| finite(measured - replayed)).collect()
    };
    let coarse = Part { rows, coarser: COARSER, ..Part::whole(observed) };
    let sure = uncertainty::of_unknowns(bench, fit);
    let stopped = stopped(fit, &sure);
    // The phases of ripples are the recording's own, and the torque's noise has turned them: they are open beside the unknowns.
    let small = small_steps(fit, &sure);
    let Some(open) = Open::new(&without(&sure.covariance, &stopped), &small, manner.ripples()) else { return Ok(None) };
    let replayed = |axis: &Axis, turned: &[f64]| manner.replayed(axis, (observed, servo), coarse, turned).ok()?;
    let replay = |z: &DVector<f64>| {
        let (by, turned) = open.unknowns_and_turns(z);
        replayed(&machine(&Numbers::moved(fit, &sure, &by))?, &turned)
    };

    let moves: Vec<Move> = [Move::Known, Move::None].into_iter().chain((0..open.count()).map(Move::Of)).collect();
    let sides = watch.each(&moves, (0.93, 0.97), STAGE, |&of| {
        let far = |of: usize, size: f64| DVector::from_fn(open.count(), |i, _| if i == of { size } else { 0.0 });
        let side = |of: usize, size: f64| Some((size, replay(&far(of, size))?));
        match of {
            Move::Known => Some((0.0, replayed(&known.axis, &[])?)),
            Move::None => side(0, 0.0),
            Move::Of(of) => side(of, open.small[of]).or_else(|| side(of, -open.small[of])),
        }
    })?;
    let Some(sides) = sides.into_iter().collect::<Option<Vec<_>>>() else { return Ok(None) };
    let [(_, known_coarse), (_, middle), sides @ ..] = sides.as_slice() else { return Ok(None) };
    // What finer steps change is that of the machine that was replayed with them.
    let finer = known.error.iter().zip(&observed.position).zip(known_coarse).map(|((e, x), coarse)| x - e - coarse);
    let start: Vec<f64> = finer.zip(middle).map(|(finer, middle)| middle + finer).collect();
    let mut least = error(&start);
    let difference = |(size, side): &(f64, Vec<f64>)| -> Vec<f64> {
        side.iter().zip(middle).skip(begun).map(|(side, middle)| finite((side - middle) / size)).collect()
    };
    let Some(says) = Says::of(&sides.iter().map(difference).collect::<Vec<_>>()) else { return Ok(None) };

    let missed = |replayed: &[f64]| -> Vec<f64> {
        let moved = replayed.iter().zip(middle).map(|(there, middle)| there - middle);
        error(&start.iter().zip(moved).map(|(start, moved)| start + moved).collect::<Vec<f64>>())
    };
    let (mut at, mut best) = (DVector::zeros(open.count()), None);
    let as_named = size(&least);
    for trial in 0..MOST_TRIALS {
        let Some(said) = says.together(&least, &at) else { break };
        if said.promised > (1.0 - WORTH[trial.min(1)]) * size(&least) {
            break;
        }
        let Some(there) = replay(&said.place) else { break };
        watch.at(0.97 + 0.01 * trial as f64, STAGE)?;
        let next = missed(&there);
        if size(&next) >= size(&least) {
            break;
        }
        let mut covariance = open.covariance(&said.covariance);
        // Of what a bound stops the position says nothing.
        stopped.iter().for_each(|&i| covariance[(i, i)] = sure.covariance[(i, i)]);
        best = Some((open.unknowns_and_turns(&said.place), covariance));
        (least, at) = (next, said.place);
    }
    let Some(((by, turned), covariance)) = best else { return Ok(None) };
    let mut numbers = Numbers::moved(fit, &sure, &by);
    if let Some(plainer) = with_usual_forms(fit, (&sure, &by), &covariance) {
        let plainer = Numbers::moved(fit, &sure, &plainer);
        let there = machine(&plainer).and_then(|machine| replayed(&machine, &turned));
        if there.is_some_and(|there| size(&missed(&there)) < as_named) {
            numbers = plainer;
        }
    }
    let Numbers { shapes, coefficients } = numbers;
    Ok(Some(Replayed { fit: bench.with_numbers(fit, &shapes, coefficients), sure: Sure { covariance, ..sure } }))
}

/// By how much unknowns move where forms that are not surely others stay as usual; `None` where all are, or there is none.
fn with_usual_forms(fit: &Fit, (sure, by): (&Sure, &DVector<f64>), covariance: &DMatrix<f64>) -> Option<DVector<f64>> {
    let first = covariance.nrows() - sure.shapes.len();
    let (mut plainer, mut rest) = (by.clone(), covariance.clone());
    for (s, &(part, index)) in sure.shapes.iter().enumerate() {
        let (k, fit::Part { law, shape, .. }) = (first + s, &fit.parts[part]);
        let is_open = law.is_as_usual(index, shape[index]) && rest[(k, k)] > 0.0;
        if is_open && by[k].abs() < LEAST_STRENGTH * covariance[(k, k)].sqrt() {
            plainer -= rest.column(k) * (plainer[k] / rest[(k, k)]);
            plainer[k] = 0.0;
            rest = without(&rest, &[k]);
        }
    }
    (plainer != *by).then_some(plainer)
}

/// How many rows of a recording are replayed once more: all, or the first where that would take long.
#[must_use]
pub fn rows(axis: &Axis, observed: &Observed) -> usize {
    let masses = if matches!(axis.two_masses(), Ok(Some(_))) { 2 } else { 1 };
    Part::of_steps(axis, observed, MOST_STEPS[masses - 1], COARSER).rows.min((MOST_S / observed.period_s) as usize)
}

/// What is replayed: the machine that was before, what is named, and with one of its unknowns moved.
#[derive(Clone, Copy)]
enum Move {
    Known,
    None,
    Of(usize),
}

/// Of rows that are not known nothing is said.
fn finite(value: f64) -> f64 {
    if value.is_finite() { value } else { 0.0 }
}

fn size(error: &[f64]) -> f64 {
    rms(error.iter().copied())
}

/// Non-linear parameters and coefficients of a fit's parts.
struct Numbers {
    shapes: Vec<Vec<f64>>,
    coefficients: Vec<Vec<f64>>,
}

impl Numbers {
    fn of(fit: &Fit) -> Self {
        let shapes = fit.parts.iter().map(|part| part.shape.clone()).collect();
        Self { shapes, coefficients: fit.coefficients.clone() }
    }

    /// Those of a fit moved in its unknowns.
    fn moved(fit: &Fit, sure: &Sure, by: &DVector<f64>) -> Self {
        let mut numbers = Self::of(fit);
        let mut by = by.iter();
        numbers.coefficients.iter_mut().flatten().zip(by.by_ref()).for_each(|(c, by)| *c += by);
        for (&(part, index), by) in sure.shapes.iter().zip(by) {
            let value = &mut numbers.shapes[part][index];
            *value = fit.parts[part].law.scales[index].moved(*value, *by);
        }
        numbers
    }

    /// The machine that has them; `None` where one is beyond its physical bounds that was not.
    fn machine(&self, axis: &Axis, bench: &Bench, fit: &Fit) -> Option<Axis> {
        let parts = fit.parts.iter().zip(self.shapes.iter().zip(&self.coefficients));
        let effect = |(part, (shape, c)): (&fit::Part, (&Vec<f64>, &Vec<f64>))| part.law.effect(bench.frame, shape, c);
        let found: Vec<_> = parts.filter_map(effect).collect();
        let all = found.len() == fit.effects(bench.frame).count();
        all.then(|| belief::with_found(axis, bench.frame.axis, found))
    }
}

/// Unknowns that a bound stops within half a deviation: they cannot go where the position may ask them to.
fn stopped(fit: &Fit, sure: &Sure) -> Vec<usize> {
    let first = sure.covariance.nrows() - sure.shapes.len();
    let stops = |(s, &(part, index)): (usize, &(usize, usize))| {
        let (scale, at) = (fit.parts[part].law.scales[index], fit.parts[part].shape[index]);
        let half = (0.5 * sure.covariance[(first + s, first + s)].sqrt()).min(scale.small());
        let short = |by: f64| scale.distance(at, scale.moved(at, by)).abs() < 0.9 * by.abs();
        (short(half) || short(-half)).then_some(first + s)
    };
    sure.shapes.iter().enumerate().filter_map(stops).collect()
}

/// How far each unknown goes in a step that is small, where it has bounds.
fn small_steps(fit: &Fit, sure: &Sure) -> Vec<f64> {
    let coefficients = vec![f64::INFINITY; sure.covariance.nrows() - sure.shapes.len()];
    let of_shapes = sure.shapes.iter().map(|&(part, index)| fit.parts[part].law.scales[index].small());
    coefficients.into_iter().chain(of_shapes).collect()
}

/// A covariance where some unknowns are known.
fn without(covariance: &DMatrix<f64>, known: &[usize]) -> DMatrix<f64> {
    let mut rest = covariance.clone();
    for &k in known {
        let (column, variance) = (rest.column(k).into_owned(), rest[(k, k)]);
        rest -= &column * column.transpose() / variance;
        rest.row_mut(k).fill(0.0);
        rest.column_mut(k).fill(0.0);
        // So little that it does not move, and the root exists.
        rest[(k, k)] = 1e-12 * variance;
    }
    rest
}

/// What is open: the unknowns of the fit and the turns of ripples, in deviations of what is known of them.
struct Open {
    /// L, lower triangular.
    root: DMatrix<f64>,
    unknowns: usize,
    /// Of each the step over which the loop is straight enough: a deviation, or what is small for an unknown that goes with it, and
    /// of a phase, of which less is known, a part of one.
    small: Vec<f64>,
}

impl Open {
    fn new(covariance: &DMatrix<f64>, small: &[f64], ripples: usize) -> Option<Self> {
        let (unknowns, own) = (covariance.nrows(), covariance.clone().cholesky()?.l());
        let of = |i: usize, j: usize| match (i < unknowns, j < unknowns) {
            (true, true) => own[(i, j)],
            _ => f64::from(u8::from(i == j)) * OPEN_PHASE,
        };
        let root = DMatrix::from_fn(unknowns + ripples, unknowns + ripples, of);
        let step = |of: usize| match of < unknowns {
            true => small.iter().zip(root.column(of).iter()).map(|(most, by)| most / by.abs()).fold(1.0, f64::min),
            false => SMALL_TURN / OPEN_PHASE,
        };
        Some(Self { small: (0..root.nrows()).map(step).collect(), root, unknowns })
    }

    fn count(&self) -> usize {
        self.root.nrows()
    }

    fn unknowns_and_turns(&self, z: &DVector<f64>) -> (DVector<f64>, Vec<f64>) {
        let by = &self.root * z;
        (by.rows(0, self.unknowns).into_owned(), by.iter().skip(self.unknowns).copied().collect())
    }

    /// That of the unknowns from that of deviations.
    fn covariance(&self, of_deviations: &DMatrix<f64>) -> DMatrix<f64> {
        let all = &self.root * of_deviations * self.root.transpose();
        all.view((0, 0), (self.unknowns, self.unknowns)).into_owned()
    }
}

/// What the position can say of what is open.
struct Says {
    /// Along which it says something of its own, as columns.
    directions: DMatrix<f64>,
    /// How the position goes along each.
    along: Vec<Vec<f64>>,
    /// Sum of the squares of that.
    squares: Vec<f64>,
}

/// What torque and position say together.
struct Said {
    place: DVector<f64>,
    covariance: DMatrix<f64>,
    /// RMS of the position error there, if the loop is straight.
    promised: f64,
}

impl Says {
    /// By how the position goes with each that is open; `None` where nothing is, or a replay ran away.
    fn of(columns: &[Vec<f64>]) -> Option<Self> {
        let rows = columns.first()?.len();
        let normal = DMatrix::from_fn(columns.len(), columns.len(), |i, j| dot(&columns[i], &columns[j]));
        let directions = decomposed(normal)?.u?;
        let go = |direction: usize| {
            let mut sum = vec![0.0; rows];
            columns.iter().zip(directions.column(direction).iter()).for_each(|(c, d)| add(&mut sum, *d, c));
            sum
        };
        let along: Vec<Vec<f64>> = (0..columns.len()).map(go).collect();
        Some(Self { squares: along.iter().map(|a| dot(a, a)).collect(), along, directions })
    }

    /// By the error at a place; `None` where torque and position contradict each other.
    fn together(&self, error: &[f64], at: &DVector<f64>) -> Option<Said> {
        let count = self.along.len();
        let here = self.directions.tr_mul(at);
        let alone: Vec<f64> = (0..count).map(|i| self.projected(i, error)).collect();
        let mut left = error.to_vec();
        self.along.iter().zip(&alone).for_each(|(column, by)| add(&mut left, -by, column));
        let variances: Vec<f64> = (0..count).map(|i| self.variance(i, &left)).collect();
        let told = DVector::from_fn(count, |i, _| here[i] + alone[i]);
        let contradiction: f64 =
            told.iter().zip(&variances).map(|(told, variance)| told * told / (1.0 + variance)).sum();
        if contradiction > most_squares(count) {
            return None;
        }
        let to = DVector::from_fn(count, |i, _| told[i] / (1.0 + variances[i]));
        let mut rest = error.to_vec();
        self.along.iter().enumerate().for_each(|(i, column)| add(&mut rest, here[i] - to[i], column));
        let own = DVector::from_fn(count, |i, _| 1.0 - 1.0 / (1.0 + variances[i]));
        Some(Said {
            place: &self.directions * to,
            covariance: &self.directions * DMatrix::from_diagonal(&own) * self.directions.transpose(),
            promised: size(&rest),
        })
    }

    /// How far along a direction the error lies; what nothing tells stays where it is.
    fn projected(&self, i: usize, error: &[f64]) -> f64 {
        if self.squares[i] > LEAST { dot(&self.along[i], error) / self.squares[i] } else { 0.0 }
    }

    /// Variance of that by blocks, with what the position alone leaves. A replay is a simulation, whose own errors are alike in all
    /// blocks.
    fn variance(&self, i: usize, left: &[f64]) -> f64 {
        if self.squares[i] <= LEAST {
            return f64::INFINITY;
        }
        let length = left.len().div_ceil(BLOCKS).max(1);
        let (mut sum, mut sum_of_shares, mut blocks) = (0.0, 0.0, 0.0);
        for rows in blocks::of_column(&self.along[i], length, MOST_IN_A_BLOCK) {
            let (column, left) = (&self.along[i][rows.clone()], &left[rows]);
            let share = dot(column, column) / self.squares[i];
            // A block that alone knows of something cannot be left out; a twentieth of it stays.
            let moved = dot(column, left) / self.squares[i] / (1.0 - 0.95 * share);
            sum += moved * moved;
            sum_of_shares += share * share;
            blocks += 1.0;
        }
        (SIMULATED * widening(1.0 / sum_of_shares)).powi(2) * (blocks - 1.0) / blocks * sum
    }
}

/// Squares below which there is nothing, as where a cause does not move the motor at all.
const LEAST: f64 = 1e-300;

/// χ² of so many degrees of freedom beyond which there is as little as beyond [`CONTRADICTS`] deviations (Wilson and Hilferty 1931).
fn most_squares(freedom: usize) -> f64 {
    let n = freedom as f64;
    let part = 2.0 / (9.0 * n);
    n * (1.0 - part + CONTRADICTS * part.sqrt()).powi(3)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What one move in one block tells: its parts say another thing, and the law is as unsure as that, not sure to the last digit.
    #[test]
    fn what_one_block_tells_is_no_surer_than_its_parts_agree() {
        let column: Vec<f64> = (0..24_000).map(|i| if (4100..4900).contains(&i) { 1.0 } else { 0.0 }).collect();
        let says = Says::of(std::slice::from_ref(&column)).unwrap();
        let left: Vec<f64> = (0..24_000).map(|i| column[i] * if i < 4500 { 0.1 } else { -0.1 }).collect();
        let deviation = says.variance(0, &left).sqrt();
        assert!(deviation > 0.1, "{deviation}");
    }
}
