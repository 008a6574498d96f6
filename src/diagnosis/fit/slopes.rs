//! How a model changes with the non-linear parameters of its parts, by central differences, each in the step of its scale.

use super::{Bench, Fit, Part, add, projected};
use crate::diagnosis::causes::Scale;
use rayon::prelude::*;
use std::sync::Arc;

/// A small step of a logarithm.
const STEP_OF_LOG: f64 = 0.02;
/// How often the way to a bound is halved.
const HALVED: usize = 40;

/// The derivative of the model by one non-linear parameter.
#[derive(Debug, Clone)]
pub struct Slope {
    /// Index of the part.
    pub part: usize,
    /// Index of the parameter.
    pub index: usize,
    /// The derivative, stacked and scaled.
    pub column: Vec<f64>,
}

/// A part to either side of where it stands in one parameter.
#[derive(Debug, Clone)]
pub(super) struct Side {
    pub(super) index: usize,
    /// How far apart, in the units of the scale.
    pub(super) apart: f64,
    pub(super) up: Part,
    pub(super) down: Part,
}

impl Bench<'_, '_> {
    /// How the model's sum changes with each non-linear parameter (in the units of its scale).
    #[must_use]
    pub fn slopes(&self, fit: &Fit, first: usize) -> Vec<Slope> {
        self.slopes_of(fit, first, |_| true)
    }

    /// The same by each parameter of form that is as usual, and not fitted.
    #[must_use]
    pub fn slopes_of_usual_forms(&self, fit: &Fit) -> Vec<Slope> {
        let of_part = |(i, part): (usize, &Part)| {
            let slopes = |side: &Side| self.slope(i, &fit.coefficients[i], side);
            self.sides_of(part, 1.0, true).iter().filter_map(slopes).collect::<Vec<_>>()
        };
        fit.parts.iter().enumerate().flat_map(of_part).collect()
    }

    /// The same of those parameters that these rows are to tell.
    pub(super) fn open_slopes(&self, fit: &Fit, first: usize) -> Vec<Slope> {
        self.slopes_of(fit, first, |part| self.tells(part))
    }

    /// Whether these rows are to tell the non-linear parameters of a part.
    pub(super) fn tells(&self, part: &Part) -> bool {
        !part.law.manner.told_by_means || self.is_of_means()
    }

    fn slopes_of(&self, fit: &Fit, first: usize, open: impl Fn(&Part) -> bool) -> Vec<Slope> {
        let parts: Vec<(usize, &Part)> =
            fit.parts.iter().enumerate().skip(first).filter(|(_, part)| open(part)).collect();
        self.look_about(&parts);
        let sides = parts.into_iter().flat_map(|(i, part)| self.both_sides(part).iter().map(move |side| (i, side)));
        let found = sides.filter_map(|(i, side)| Some((side, self.slope(i, &fit.coefficients[i], side)?)));
        let (sides, mut slopes): (Vec<&Side>, Vec<Slope>) = found.unzip();
        if let Some(table) = fit.table().map(|at| &fit.parts[at]) {
            let turning =
                slopes.iter_mut().zip(sides).filter(|(slope, _)| fit.parts[slope.part].law.manner.turns_table);
            let turning: Vec<(&mut Slope, &Side)> = turning.collect();
            let beside = turning.iter().flat_map(|(slope, side)| [&side.up, &side.down].map(|part| (slope.part, part)));
            let ways = self.tables_beside(fit, &beside.collect::<Vec<_>>(), table);
            for ((slope, side), way) in turning.into_iter().zip(ways.chunks(2)) {
                if let [Some(up), Some(down)] = way {
                    add(&mut slope.column, 1.0 / side.apart, up);
                    add(&mut slope.column, -1.0 / side.apart, down);
                }
            }
        }
        slopes
    }

    /// The traces of a simulated table, each with another part in the place of one.
    fn tables_beside(&self, fit: &Fit, others: &[(usize, &Part)], table: &Part) -> Vec<Option<Arc<[f64]>>> {
        let resisting = |&(i, part): &(usize, &Part)| {
            let mut parts = fit.parts.clone();
            parts[i] = part.clone();
            self.resistance_by(&parts, &fit.coefficients)
        };
        let resistances: Vec<_> = others.iter().map(resisting).collect();
        let each: Vec<_> = resistances.iter().map(Arc::as_ref).collect();
        let terms = table.law.terms_under_each(self.frame, &each, &table.shape);
        terms.into_iter().map(|term| term.fixed.map(|trace| self.stack(&trace).into())).collect()
    }

    /// The step of each non-linear parameter that takes most off the squares. What the rows do not tell stays where it is: they
    /// are weighed against a guess that no parameter moves farther than a step may go. One that would, or beyond its bounds,
    /// goes to there, and the others as is best with it.
    pub(super) fn steps(&self, fit: &Fit, slopes: &[Slope]) -> Vec<f64> {
        let columns: Vec<&[f64]> = slopes.iter().map(|s| s.column.as_slice()).collect();
        let (triangle, along) = projected(&columns, &fit.basis, &fit.residual);
        let (mut normal, mut right) = (triangle.tr_mul(&triangle), triangle.tr_mul(&along));
        let noise = fit.squares() / self.measured.len().max(1) as f64;
        let scale = |slope: &Slope| fit.parts[slope.part].law.scales[slope.index];
        for (i, slope) in slopes.iter().enumerate() {
            normal[(i, i)] += noise / scale(slope).farthest().powi(2);
        }
        let mut steps = vec![0.0; slopes.len()];
        let mut ends = vec![false; slopes.len()];
        for _ in slopes {
            let Some(solved) = normal.clone().cholesky() else { break };
            steps.copy_from_slice(solved.solve(&right).as_slice());
            let possible = |i: usize| {
                let at = fit.parts[slopes[i].part].shape[slopes[i].index];
                scale(&slopes[i]).distance(at, scale(&slopes[i]).moved(at, steps[i]))
            };
            let too_far = |&i: &usize| !ends[i] && steps[i].abs() > 1.001 * possible(i).abs();
            let farthest = |i: &usize| steps[*i].abs() / scale(&slopes[*i]).farthest();
            let Some(i) = (0..slopes.len()).filter(too_far).max_by(|a, b| farthest(a).total_cmp(&farthest(b))) else {
                break;
            };
            // From here on a number: its share moves to the right side.
            let end = possible(i);
            right.axpy(-end, &normal.column(i).clone_owned(), 1.0);
            normal.row_mut(i).fill(0.0);
            normal.column_mut(i).fill(0.0);
            (normal[(i, i)], right[i], ends[i]) = (1.0, end, true);
        }
        steps
    }

    /// Works out what [`Bench::both_sides`] will be asked for, on all cores at hand: outside of it, lest a thread that waits there take up
    /// work that waits for it.
    fn look_about(&self, parts: &[(usize, &Part)]) {
        let unseen: Vec<&Part> =
            parts.iter().map(|(_, part)| *part).filter(|part| part.sides.get().is_none()).collect();
        let sides: Vec<Vec<Side>> = unseen.par_iter().map(|part| self.sides(part, 1.0)).collect();
        for (part, sides) in unseen.into_iter().zip(sides) {
            // Where another thread was sooner its answer is the same.
            _ = part.sides.set(sides);
        }
    }

    /// A part to either side of where it stands; worked out once, since copies of a part stand in many sets.
    pub(super) fn both_sides<'p>(&self, part: &'p Part) -> &'p [Side] {
        part.sides.get_or_init(|| self.sides(part, 1.0))
    }

    /// A part with each of its parameters up and down by so many steps, all worked out together.
    pub(super) fn sides(&self, part: &Part, steps: f64) -> Vec<Side> {
        self.sides_of(part, steps, false)
    }

    /// The same of the parameters that are fitted, or of those of form that are as usual.
    fn sides_of(&self, part: &Part, steps: f64, as_usual: bool) -> Vec<Side> {
        let mut shapes = Vec::new();
        let mut moves = Vec::new();
        for (index, scale) in part.law.scales.iter().enumerate() {
            let step = match *scale {
                Scale::Choice => continue,
                _ if part.law.is_as_usual(index, part.shape[index]) != as_usual => continue,
                Scale::Log(..) | Scale::Form(..) => STEP_OF_LOG * steps,
                Scale::Linear(_, _, step) => step * steps,
            };
            let at = part.shape[index];
            // Beyond where a table has all of the friction nothing changes any more: there the slope is that to one side.
            let [above, below] = [step, -step]
                .map(|step| scale.moved(at, step))
                .map(|value| if self.makes_another(part, index, value) { value } else { at });
            shapes.extend([above, below].map(|value| part.shape_with(index, value)));
            moves.push((index, scale.distance(below, above)));
        }
        if shapes.is_empty() {
            return Vec::new();
        }
        let mut parts = self.parts_like(part, shapes).into_iter();
        let side = |(index, apart): (usize, f64)| Some(Side { index, apart, up: parts.next()?, down: parts.next()? });
        moves.into_iter().map_while(side).collect()
    }

    /// Whether another thing is simulated of a part with one of its parameters at this value; what no simulation shows has.
    fn makes_another(&self, part: &Part, index: usize, value: f64) -> bool {
        let simulated = |shape: &[f64]| part.law.simulated(self.frame, shape);
        !part.law.is_simulated() || simulated(&part.shape_with(index, value)) != simulated(&part.shape)
    }

    /// The same fit where no parameter of a simulated table stands beyond where it changes something.
    #[must_use]
    pub fn within_bounds(&self, mut fit: Fit) -> Fit {
        let Some(part) = fit.table().map(|at| &mut fit.parts[at]) else { return fit };
        for (index, scale) in part.law.scales.iter().enumerate() {
            let at = part.shape[index];
            let (mut inside, mut beyond) = (scale.moved(at, -scale.farthest()), at);
            if self.makes_another(part, index, scale.moved(at, STEP_OF_LOG)) || !self.makes_another(part, index, inside)
            {
                continue;
            }
            for _ in 0..HALVED {
                let middle = scale.moved(inside, 0.5 * scale.distance(inside, beyond));
                let end = if self.makes_another(part, index, middle) { &mut inside } else { &mut beyond };
                *end = middle;
            }
            (part.shape[index], part.sides) = (beyond, Arc::default());
        }
        fit
    }

    /// The slope between two sides of part `i`; `None` where the bounds leave no room.
    pub(super) fn slope(
        &self,
        i: usize,
        coefficients: &[f64],
        Side { index, apart, up, down }: &Side,
    ) -> Option<Slope> {
        if *apart <= 0.0 {
            return None;
        }
        let per = 1.0 / apart;
        let mut column = vec![0.0; self.measured.len()];
        let mut add = |values: &[f64], factor: f64| {
            column.iter_mut().zip(values).for_each(|(c, v)| *c += factor * v);
        };
        if let (Some(up), Some(down)) = (&up.fixed, &down.fixed) {
            add(up, per);
            add(down, -per);
        }
        for ((up, down), c) in up.columns.iter().zip(down.columns.iter()).zip(coefficients) {
            add(up, c * per);
            add(down, -c * per);
        }
        Some(Slope { part: i, index: *index, column })
    }
}

impl Scale {
    /// The value moved by a step, within bounds.
    #[must_use]
    pub fn moved(self, at: f64, step: f64) -> f64 {
        match self {
            Scale::Choice => at,
            Scale::Log(low, high) | Scale::Form(low, high, _) => {
                (at * step.clamp(-self.farthest(), self.farthest()).exp()).clamp(low, high)
            }
            Scale::Linear(low, high, _) => (at + step.clamp(-self.farthest(), self.farthest())).clamp(low, high),
        }
    }

    /// The farthest that one step goes.
    fn farthest(self) -> f64 {
        match self {
            Scale::Choice => 0.0,
            // More than a doubling at once is no small step.
            Scale::Log(..) | Scale::Form(..) => 0.7,
            Scale::Linear(_, _, unit) => 40.0 * unit,
        }
    }

    /// A step over which what depends on the value goes straight enough.
    pub(in crate::diagnosis) fn small(self) -> f64 {
        0.1 * self.farthest()
    }

    /// How far apart the bounds are, in the units of the scale, where a value has come within a step of one; of what is large or
    /// small without bounds that mean anything nothing can be said.
    pub(in crate::diagnosis) fn stopped_between(self, value: f64) -> Option<f64> {
        match self {
            Scale::Linear(low, high, unit) if value <= low + unit || value >= high - unit => Some(high - low),
            _ => None,
        }
    }

    /// How far apart two values are.
    #[must_use]
    pub fn distance(self, from: f64, to: f64) -> f64 {
        match self {
            Scale::Choice => 0.0,
            Scale::Log(..) | Scale::Form(..) => (to / from).ln(),
            Scale::Linear(..) => to - from,
        }
    }

    /// Change of the value for a small step in the scale's own unit.
    #[must_use]
    pub fn rate(self, at: f64) -> f64 {
        match self {
            Scale::Choice => 0.0,
            Scale::Log(..) | Scale::Form(..) => at,
            Scale::Linear(..) => 1.0,
        }
    }
}
