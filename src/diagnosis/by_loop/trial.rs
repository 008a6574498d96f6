//! A cause as it is tried in the loop: a law with numbers of its own, of which some are moved.

use super::equations::Equations;
use super::replays::Replays;
use crate::diagnosis::belief;
use crate::diagnosis::causes::presliding_friction::{BRISTLE, OF_ANY_EXPONENT, WITHIN_STEPS};
use crate::diagnosis::causes::table_side::{as_spring, split, swing_of};
use crate::diagnosis::causes::{Law, Resistance, Rest, Scale, law};
use crate::diagnosis::frame::Frame;
use crate::diagnosis::known::LAW_HOLDS;
use crate::diagnosis::missed::{Over, mean};
use crate::machine::{Axis, Cause, Effect};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// Share of the believed dry friction that a cause makes where it is tried first.
const SMALL: f64 = 0.02;
/// The same of friction that rises where an axis creeps.
const STICKING: [f64; 3] = [0.1, 0.3, 0.8];
/// Small steps: of a logarithm, in steps of a linear scale, and as a share of a coefficient.
const STEP_OF_LOG: f64 = 0.04;
const STEPS_OF_LINEAR: f64 = 2.0;
const STEP_OF_COEFFICIENT: f64 = 0.05;
/// Shares of a step that are tried, side by side, and if none is better.
const SHARES: [&[f64]; 2] = [&[1.0, 0.5], &[0.2]];
/// Of the starts of a spring one in so many is tried.
const EVERY_SPRING: usize = 3;
/// Shares of inertia and friction behind a clearance or a spring, and how hard flanks meet, Hz, at which it is tried: what of it the loop
/// shows depends on them so much that no step leads from one to another.
const TABLE: [f64; 3] = [0.25, 0.45, 0.65];
const FRICTION: [f64; 3] = [0.35, 0.55, 0.75];
const CONTACT_HZ: [f64; 2] = [500.0, 800.0];
/// Numbers over those that were found, at which what was found is tried again.
const AGAIN: [f64; 11] = [0.6, 0.7, 0.8, 0.9, 0.95, 1.0, 1.06, 1.12, 1.25, 1.45, 1.7];
/// Damping ratio at which a spring is tried in place of flanks.
const SPRING_DAMPING: f64 = 0.03;
/// Steps of refining at most, and those after which it must be hopeful.
const STEPS: usize = 12;
const FEW: usize = 3;
/// What a step must take off the misses for another one.
const LITTLE: f64 = 3e-3;
/// Times its velocity up to which friction that rises at low speed acts, and the share of the judged rows that are few.
const TWICE: f64 = 2.0;
const FEW_ROWS: f64 = 0.1;
/// Steps of the encoder within which friction may build up and not be known to.
const WITHIN: [f64; 3] = [0.2, 0.5, 1.2];

/// A law with numbers.
#[derive(Debug, Clone)]
pub struct Trial {
    /// Which.
    pub law: &'static Law,
    shape: Vec<f64>,
    coefficients: Vec<f64>,
    /// Whether the first coefficient is open.
    open: bool,
    /// Whether the position goes with it in proportion.
    linear: bool,
}

/// A number that is moved.
#[derive(Clone, Copy)]
enum Number {
    Shape(usize),
    Coefficient,
}

/// The trials of a law, each from another start; none of a law that is not tried in the loop.
#[must_use]
pub fn starts(frame: &Frame, law: &'static Law) -> Vec<Trial> {
    use Cause::*;
    let torque = vec![0.0; frame.kept.len()];
    let all = || (law.starts)(frame, &Rest { torque: &torque, table: &[] });
    let trial =
        |shape: Vec<f64>, coefficients: Vec<f64>, open, linear| Trial { law, shape, coefficients, open, linear };
    let in_proportion = |shapes: Vec<Vec<f64>>| -> Vec<Trial> {
        let resistance = Resistance::of(frame, frame.axis);
        let terms = law.terms(frame, &resistance, &shapes);
        let sized = shapes.into_iter().zip(terms).filter_map(|(shape, term)| {
            let [trace] = term.regressors.as_slice() else { return None };
            let square = trace.torque.iter().map(|t| t * t).sum::<f64>() / trace.torque.len().max(1) as f64;
            (square > 0.0).then(|| trial(shape, vec![SMALL * frame.belief.coulomb / square.sqrt()], true, true))
        });
        sized.collect()
    };
    match law.cause {
        InertiaMismatch
        | CoulombFrictionMismatch
        | ViscousFrictionMismatch
        | ConstantTorque
        | DirectionDependentFriction
        | QuadraticDrag
        | CableForce => in_proportion(all()),
        ThermalDrift => in_proportion(all().into_iter().step_by(3).collect()),
        StribeckFriction => {
            // An axis that creeps sticks by it, and what its loop then does goes with no number in proportion.
            let sizes = |shape: Vec<f64>| {
                STICKING.map(|size| trial(shape.clone(), vec![size * frame.belief.coulomb], true, false))
            };
            let sticking = all().into_iter().step_by(2).flat_map(sizes).filter(|trial| trial.acts_in_few_rows(frame));
            sticking.chain(in_proportion(all().into_iter().step_by(3).collect())).collect()
        }
        PreslidingFriction => {
            let bristles = all().into_iter().filter(|shape| shape[1..] == BRISTLE).step_by(2);
            let trial =
                |shape| Trial { law: &OF_ANY_EXPONENT, ..trial(shape, vec![frame.belief.coulomb, 0.0], false, false) };
            let level = [frame.belief.coulomb, 0.0];
            let within = WITHIN.map(|steps| [&[steps * 1e3 * frame.grid][..], &BRISTLE].concat());
            let within = within.into_iter().filter(|shape| shape[0] > 0.0);
            let unseen =
                |shape| Trial { law: &WITHIN_STEPS, shape, coefficients: level.to_vec(), open: false, linear: false };
            bristles.map(trial).chain(within.map(unseen)).collect()
        }
        Backlash => {
            let mut shapes = all();
            shapes.dedup_by(|a, b| a[0] == b[0]);
            let usual = [TABLE[1], FRICTION[1], CONTACT_HZ[1]];
            shapes.into_iter().map(|shape| trial([&shape[..1], &usual].concat(), vec![], false, false)).collect()
        }
        DriveCompliance => {
            let starts = all().into_iter().step_by(EVERY_SPRING);
            starts.map(|shape| trial(shape, vec![], false, false)).collect()
        }
        TorqueSaturation => all().into_iter().step_by(2).map(|shape| trial(shape, vec![0.7], true, false)).collect(),
        _ => Vec::new(),
    }
}

impl Trial {
    /// A clearance or a spring that was found; `None` of another cause.
    #[must_use]
    pub fn of(frame: &Frame, effect: &Effect) -> Option<Self> {
        let law = law(effect.cause());
        let shape = match law.cause {
            Cause::Backlash => effect.values().into_iter().take(law.scales.len()).collect(),
            Cause::DriveCompliance => swing_of(&split(frame, Some(*effect))?),
            _ => return None,
        };
        Some(Self { law, shape, coefficients: vec![], open: false, linear: false })
    }

    /// The same in the valleys about it. The table of a clearance may be lighter or heavier, and slow down as fast, and its flanks be as far
    /// apart as its impact then asks, and meet as hard as they do or as they mostly do. A spring may be stiffer or softer under the same
    /// friction, or under as much more, or carry more or less.
    #[must_use]
    pub fn about(&self) -> Vec<Self> {
        let ways = |by: f64| match (self.law.cause, self.shape.as_slice()) {
            (Cause::Backlash, &[width, table, friction, own_hz]) => {
                let contacts = [own_hz, CONTACT_HZ[0], CONTACT_HZ[1]];
                contacts.map(|hz| vec![width / by, table * by, friction * by, hz]).into()
            }
            (_, &[own_hz, table, friction, damping]) => vec![
                vec![own_hz * by, table, friction, damping],
                vec![own_hz * by, table, friction * by * by, damping],
                vec![own_hz, table * by, friction, damping],
            ],
            _ => Vec::new(),
        };
        let inside = |(scale, value): (&Scale, &f64)| (scale.moved(*value, 0.0) - value).abs() <= 1e-9 * value.abs();
        let is_inside = |shape: &Vec<f64>| self.law.scales.iter().zip(shape).all(inside);
        let with = |shape: Vec<f64>| Self { shape, ..self.clone() };
        let mut places: Vec<Self> = Vec::new();
        for place in AGAIN.into_iter().flat_map(ways).filter(is_inside).map(with) {
            // Several ways lead nowhere from where it stands.
            if !places.iter().any(|other| other.is_at(&place)) {
                places.push(place);
            }
        }
        places
    }

    /// Whether it has the numbers of another trial of its law, but for its size.
    #[must_use]
    pub fn is_at(&self, other: &Self) -> bool {
        self.shape == other.shape
    }

    /// Whether it is of the law of another trial.
    #[must_use]
    pub fn is_of_law(&self, other: &Self) -> bool {
        std::ptr::eq(self.law, other.law)
    }

    /// The effect that it stands for; `None` beyond physical bounds.
    #[must_use]
    pub fn effect(&self, frame: &Frame) -> Option<Effect> {
        self.law.effect(frame, &self.shape, &self.coefficients)
    }

    /// An axis with it.
    #[must_use]
    pub fn on(&self, frame: &Frame, axis: &Axis) -> Option<Axis> {
        Some(belief::extended(axis, &[belief::together(axis, self.effect(frame)?)]))
    }

    /// What may be the same cause with other numbers that no step leads to.
    #[must_use]
    pub fn siblings(&self) -> Vec<Self> {
        let with = |shape: Vec<f64>| Self { shape, ..self.clone() };
        let shares = || TABLE.into_iter().flat_map(|table| FRICTION.map(|friction| (table, friction)));
        match (self.law.cause, self.shape.as_slice()) {
            (Cause::Backlash, &[width, ..]) => {
                let flanks = |(table, friction)| CONTACT_HZ.map(|hz| with(vec![width, table, friction, hz]));
                shares().flat_map(flanks).collect()
            }
            (Cause::DriveCompliance, &[own, _, _, damping]) => {
                shares().map(|(table, friction)| with(vec![own, table, friction / table, damping])).collect()
            }
            _ => Vec::new(),
        }
    }

    /// Whether it may be named: what builds up within the steps of the encoder may not.
    #[must_use]
    pub fn has_a_name(&self) -> bool {
        !std::ptr::eq(self.law, &WITHIN_STEPS)
    }

    /// Whether it acts in few rows, so that the low-pass of the torque hides it. What acts in proportion to a number does so in all, but for
    /// friction that rises where the axis creeps; that must be more than a law of friction holds to, and none that falls: towards a rest friction
    /// without a jump does so, and that is another formulation.
    #[must_use]
    pub fn acts_in_few_rows(&self, frame: &Frame) -> bool {
        let (Cause::StribeckFriction, [velocity, _], [torque]) =
            (self.law.cause, self.shape.as_slice(), self.coefficients.as_slice())
        else {
            return !self.linear;
        };
        let slow = frame.kept.iter().filter(|&&row| frame.v[row].abs() < TWICE * velocity).count();
        *torque > LAW_HOLDS * frame.belief.coulomb && (slow as f64) < FEW_ROWS * frame.kept.len() as f64
    }

    /// The spring that a clearance may be ([`as_spring`]): one may be as good, and then is the simpler cause.
    #[must_use]
    pub fn as_spring(&self, frame: &Frame, axis: &Axis) -> Option<Self> {
        let masses = self.on(frame, axis)?.two_masses().ok()??;
        let shape = as_spring(frame, &masses, SPRING_DAMPING).filter(|_| self.law.cause == Cause::Backlash)?;
        Some(Self { law: law(Cause::DriveCompliance), shape, ..self.clone() })
    }

    /// Whether a number has gone as far as its law lets it: what asks for more is no such cause.
    #[must_use]
    pub fn is_stopped(&self) -> bool {
        let pairs = self.law.scales.iter().zip(&self.shape);
        pairs.filter(|(scale, _)| matches!(scale, Scale::Linear(..))).any(|(scale, value)| {
            let room = |by: f64| (scale.moved(*value, by) - value).abs() < 0.5 * scale.small();
            room(scale.small()) || room(-scale.small())
        })
    }

    fn numbers(&self) -> Vec<Number> {
        let moved = |&index: &usize| {
            let (scale, value) = (self.law.scales[index], self.shape[index]);
            scale.small() > 0.0 && !self.law.is_as_usual(index, value)
        };
        let shapes = (0..self.shape.len()).filter(moved).map(Number::Shape);
        shapes.chain(self.open.then_some(Number::Coefficient)).collect()
    }

    /// A small step of a number, in its own unit, and away from a bound that it has reached.
    fn small(&self, number: Number) -> f64 {
        match number {
            Number::Shape(index) => {
                let (scale, value) = (self.law.scales[index], self.shape[index]);
                let small = if let Scale::Linear(_, _, unit) = scale { STEPS_OF_LINEAR * unit } else { STEP_OF_LOG };
                if scale.moved(value, small) == value { -small } else { small }
            }
            Number::Coefficient => STEP_OF_COEFFICIENT * self.coefficients[0].abs().max(1e-12),
        }
    }

    fn moved(&self, numbers: &[Number], by: &[f64]) -> Self {
        let mut moved = self.clone();
        for (number, by) in numbers.iter().zip(by) {
            match *number {
                Number::Shape(index) => moved.shape[index] = self.law.scales[index].moved(self.shape[index], *by),
                Number::Coefficient => moved.coefficients[0] += by,
            }
        }
        moved
    }

    /// The best of its size beside a machine that misses by `before`, and the error there; of what acts in proportion to a number that is
    /// only as it would be if the position went with it as well.
    #[must_use]
    pub fn sized(
        self,
        frame: &Frame,
        axis: &Axis,
        replays: &Replays,
        before: &[f64],
        over: Over,
    ) -> Option<(Self, Vec<f64>)> {
        let there = self.error(frame, axis, replays)?;
        if !self.linear {
            return Some((self, there));
        }
        let (mut along, mut square) = (0.0, 0.0);
        for (rows, weight) in replays.weighed(before, over) {
            for (before, there) in before[rows.clone()].iter().zip(&there[rows]) {
                let slope = before - there;
                along += weight * before * slope;
                square += weight * slope * slope;
            }
        }
        let size = if square > 0.0 { along / square } else { return None };
        let trial = Self { coefficients: vec![size * self.coefficients[0]], ..self };
        if !trial.promises() {
            let error = trial.error(frame, axis, replays)?;
            return Some((trial, error));
        }
        trial.effect(frame)?;
        let promised = before.iter().zip(&there).map(|(before, there)| before - size * (before - there)).collect();
        Some((trial, promised))
    }

    /// Whether [`Trial::sized`] tells no more than what it would be in proportion. An axis that creeps is not so easily foretold.
    #[must_use]
    pub fn promises(&self) -> bool {
        self.linear && self.law.cause != Cause::StribeckFriction
    }

    /// By what an axis with it misses the measured position.
    #[must_use]
    pub fn error(&self, frame: &Frame, axis: &Axis, replays: &Replays) -> Option<Vec<f64>> {
        replays.error(&self.on(frame, axis)?)
    }

    /// Moves its numbers to where some blocks are missed least (Gauss–Newton, each block by its own weight). Some steps must have brought the
    /// misses below `hopeful`, or it is left where it is.
    #[must_use]
    pub fn refined(self, frame: &Frame, axis: &Axis, replays: &Replays, over: Over, hopeful: f64) -> Option<Refined> {
        let error = |trial: &Self| trial.error(frame, axis, replays);
        let miss = |error: &[f64]| mean(&replays.misses(error), over);
        let mut left = error(&self)?;
        let mut trial = self;
        let mut covariance = DMatrix::zeros(0, 0);
        for step in 0..=STEPS {
            let numbers = trial.numbers();
            let side = |&number: &Number| {
                let small = trial.small(number);
                let of = |by: f64| Some((by, error(&trial.moved(&[number], &[by]))?));
                let (by, there) = of(small).or_else(|| of(-small))?;
                Some(left.iter().zip(&there).map(|(here, there)| (here - there) / by).collect::<Vec<f64>>())
            };
            let slopes: Vec<Vec<f64>> = numbers.par_iter().map(side).collect::<Option<Vec<_>>>()?;
            let blocks = Equations::of(replays, &slopes, &left, over);
            let by = blocks.solved()?;
            covariance = blocks.covariance(&by)?;
            if step == STEPS || step >= FEW && miss(&left) > hopeful {
                break;
            }
            let gone = |share: &f64| {
                let moved = trial.moved(&numbers, (&by * *share).as_slice());
                let error = error(&moved)?;
                Some((miss(&error), moved, error))
            };
            let before = miss(&left);
            let least = |shares: &&[f64]| shares.par_iter().filter_map(gone).min_by(|a, b| a.0.total_cmp(&b.0));
            let better = SHARES.iter().filter_map(least).find(|(missed, ..)| *missed < before);
            let Some((missed, moved, error)) = better else { break };
            (trial, left) = (moved, error);
            if before - missed < LITTLE {
                break;
            }
        }
        Some(Refined { trial, error: left, covariance })
    }
}

/// A trial at the best of its numbers.
#[derive(Debug, Clone)]
pub struct Refined {
    /// There.
    pub trial: Trial,
    /// What it misses by.
    pub error: Vec<f64>,
    /// Of the numbers that were moved.
    covariance: DMatrix<f64>,
}

impl Refined {
    /// The effect, and the standard deviation of each of its parameters.
    #[must_use]
    pub fn effect(&self, frame: &Frame, axis: &Axis) -> Option<(Effect, Vec<f64>)> {
        let numbers = self.trial.numbers();
        let of = |trial: &Trial| trial.effect(frame).map(|effect| belief::together(axis, effect));
        let effect = of(&self.trial)?;
        let values = effect.values();
        let slope = |&number: &Number| -> Option<Vec<f64>> {
            let small = 0.1 * self.trial.small(number);
            let side = |by: f64| Some((by, of(&self.trial.moved(&[number], &[by]))?.values()));
            let (by, there) = side(small).or_else(|| side(-small))?;
            Some(there.iter().zip(&values).map(|(there, here)| (there - here) / by).collect())
        };
        let slopes: Vec<Vec<f64>> = numbers.iter().map(slope).collect::<Option<Vec<_>>>()?;
        let deviation = |value: usize| {
            let row = DVector::from_fn(slopes.len(), |number, _| slopes[number][value]);
            (row.transpose() * &self.covariance * &row)[(0, 0)].max(0.0).sqrt()
        };
        let deviations = (0..values.len()).map(deviation).collect();
        Some((effect, deviations))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::belief::base_alone;
    use crate::diagnosis::frame::Columns;
    use crate::machine::Machine;

    #[test]
    fn a_clearance_is_tried_again_along_its_ridge_and_within_its_bounds() {
        let shape = vec![10.0, 0.6, 0.5, 1200.0];
        let found = Trial { law: law(Cause::Backlash), shape, coefficients: vec![], open: false, linear: false };
        let tried = found.about();
        assert!(tried.len() > 20 && tried.iter().any(|trial| trial.shape == found.shape));
        for Trial { shape, .. } in &tried {
            assert!((shape[0] * shape[1] - 6.0).abs() < 1e-9 && (shape[2] / shape[1] - 0.5 / 0.6).abs() < 1e-9);
            assert!(shape[1] <= 0.9, "{shape:?}");
        }
    }

    #[test]
    fn soft_flanks_with_hardly_any_play_are_a_spring() {
        let axis = Machine::parse(include_str!("../../../examples/machines/believed.json")).unwrap().axes.remove(0);
        let rows: Vec<f64> = (0..2000).map(|i| (f64::from(i) * 1e-3 * 3.0).sin()).collect();
        let columns = Columns::every_millisecond(rows.clone(), rows);
        let base = base_alone(&axis);
        let frame = Frame::new(&base, &columns, None);
        let flanks = |width_um: f64, contact_hz: f64| Trial {
            law: law(Cause::Backlash),
            shape: vec![width_um, 0.55, 0.6, contact_hz],
            coefficients: Vec::new(),
            open: false,
            linear: false,
        };
        let spring = flanks(0.5, 150.0).as_spring(&frame, &axis).unwrap();
        let Some(Effect::DriveCompliance { resonance_hz, table_inertia_share, table_friction_share, .. }) =
            spring.effect(&frame)
        else {
            panic!()
        };
        assert!((resonance_hz - 150.0).abs() < 1.0, "{resonance_hz}");
        assert!((table_inertia_share - 0.55).abs() < 1e-6 && (table_friction_share - 0.6).abs() < 1e-6);
        assert!(flanks(20.0, 700.0).as_spring(&frame, &axis).is_none());
    }
}
