//! Refining: non-linear parameters go by Gauss–Newton with step halving on what the coefficients leave (variable projection, Golub
//! and Pereyra 1973).
//!
//! A table behind a spring or a clearance moves under all the friction and load that a set of causes has, so that its trace goes
//! with the numbers of the others. It is simulated anew wherever those have moved: a fit and its table are at one.

use super::{Bench, Fit, Part, Slope};
use crate::diagnosis::causes::Resistance;
use crate::machine::{Cause, Effect};
use rayon::prelude::*;
use std::sync::Arc;

/// Shares of a step that are tried.
const SHARES: [f64; 4] = [1.0, 0.3, 0.09, 0.027];
/// Share of what the step before took off that one by the same slopes must for another to be made by them.
const FAIR: f64 = 0.3;
/// How many times as much as the last step, in ln of the squares, each of those that are left may take off.
const AMPLE: f64 = 3.0;

impl Bench<'_, '_> {
    /// Refines the non-linear parameters of the parts from index `first` on, until a step brings nothing.
    #[must_use]
    pub fn refine(&self, fit: Fit, first: usize, most: usize) -> Fit {
        self.refine_while(fit, first, most, Until { gains: 1e-5, squares: f64::INFINITY })
    }

    /// The same until a step takes less than a thousandth off the squares: enough to compare sets of causes.
    #[must_use]
    pub fn refine_roughly(&self, fit: Fit, first: usize, most: usize) -> Fit {
        self.refine_towards(fit, first, most, f64::INFINITY)
    }

    /// The same as long as so few squares are within reach.
    #[must_use]
    pub fn refine_towards(&self, fit: Fit, first: usize, most: usize, squares: f64) -> Fit {
        self.refine_while(fit, first, most, Until { gains: 1e-3, squares })
    }

    fn refine_while(&self, fit: Fit, first: usize, most: usize, until: Until) -> Fit {
        let mut fit = self.at_one(fit);
        let mut steps = 0;
        while steps < most {
            let slopes = self.open_slopes(&fit, first);
            if slopes.is_empty() {
                break;
            }
            let Some(next) = self.stepped(&fit, &slopes, &SHARES) else { break };
            let gained = 1.0 - next.squares() / fit.squares();
            fit = self.at_one(next);
            steps += 1;
            if gained < until.gains || until.is_out_of_reach(&fit, gained, most - steps) {
                break;
            }
            // Slopes are most of the work, and at a new place not far from what they were: as long as a step by them takes off a fair
            // share of what the one before did, they do for another (chord method).
            let mut gained = gained;
            while steps < most {
                let Some(next) = self.stepped(&fit, &slopes, &SHARES[..1]) else { break };
                let more = 1.0 - next.squares() / fit.squares();
                if more < until.gains {
                    break;
                }
                fit = self.at_one(next);
                steps += 1;
                if more < FAIR * gained {
                    break;
                }
                gained = more;
            }
        }
        fit
    }

    /// A fit moved along slopes by the largest of these shares of a step that leaves less.
    fn stepped(&self, fit: &Fit, slopes: &[Slope], shares: &[f64]) -> Option<Fit> {
        let steps = self.steps(fit, slopes);
        let moved = |share: &f64| {
            let mut parts = fit.parts.clone();
            let mut moved: Vec<usize> = Vec::new();
            for (slope, step) in slopes.iter().zip(&steps) {
                let part = &mut parts[slope.part];
                let scale = part.law.scales[slope.index];
                part.shape[slope.index] = scale.moved(part.shape[slope.index], share * step);
                moved.push(slope.part);
            }
            moved.dedup();
            let resistance = if fit.goes_together() {
                self.resistance_by(&parts, &fit.coefficients)
            } else {
                self.resistance.clone()
            };
            for (i, part) in parts.iter_mut().enumerate() {
                if moved.contains(&i) || moves_otherwise(part, &resistance) {
                    *part = self.parts_under(part.law, vec![part.shape.clone()], &resistance).swap_remove(0);
                }
            }
            self.fit(parts)
        };
        // The first mostly leaves less; where it does not, none knows which of the others will.
        let (first, others) = shares.split_first()?;
        let less = |next: &Fit| next.squares() < fit.squares();
        Some(moved(first)).filter(less).or_else(|| others.par_iter().map(moved).find_first(less))
    }

    /// What resists the table of a fit, by the belief and its causes.
    #[must_use]
    pub fn resistance_of(&self, fit: &Fit) -> Arc<Resistance> {
        self.resistance_by(&fit.parts, &fit.coefficients)
    }

    /// The same by parts and coefficients.
    pub(super) fn resistance_by(&self, parts: &[Part], coefficients: &[Vec<f64>]) -> Arc<Resistance> {
        // All of the friction builds up, however much of that a wrong table has taken on itself.
        let all = [self.frame.belief.coulomb, 0.0];
        let effect = |(part, c): (&Part, &Vec<f64>)| {
            let c = if part.law.cause == Cause::PreslidingFriction { &all[..] } else { c };
            part.law.effect(self.frame, &part.shape, c)
        };
        let effects = parts.iter().zip(coefficients).filter(|(part, _)| !part.law.is_simulated()).filter_map(effect);
        let mut found: Vec<Effect> = effects.filter(Resistance::has_or_delivers).collect();
        // What shakes the table does so behind what was found.
        let shaking: Vec<_> = parts.iter().zip(coefficients).filter(|(part, _)| part.law.is_shaking()).collect();
        if !shaking.is_empty() {
            found.extend(parts.iter().zip(coefficients).filter(|(part, _)| part.law.is_simulated()).filter_map(effect));
        }
        if found.is_empty() {
            return self.resistance.clone();
        }
        let resistance = self.resistance.with(self.frame, found);
        let shaken =
            |under: Resistance, (part, c): (&Part, &Vec<f64>)| under.shaken_by(self.frame, part.law, &part.shape, c);
        Arc::new(shaking.into_iter().fold(resistance, shaken))
    }

    /// Starts of a clearance under this, where its load leans the table on another flank; `None` where they do as they are.
    #[must_use]
    pub fn leaned(&self, starts: &[Part], resistance: &Arc<Resistance>) -> Option<Vec<Part>> {
        let start = starts.first().filter(|start| start.resistance.leans_otherwise(resistance))?;
        let shapes = starts.iter().map(|part| part.shape.clone()).collect();
        Some(self.parts_under(start.law, shapes, resistance))
    }

    /// A fit whose table, where one is simulated, moves under what its other causes make of friction and load, and is shaken behind it;
    /// and whose torque column, where one is late, is moved as the motor delivers it.
    #[must_use]
    pub fn at_one(&self, fit: Fit) -> Fit {
        if !fit.goes_together() {
            return fit;
        }
        let resistance = self.resistance_of(&fit);
        if !fit.parts.iter().any(|part| moves_otherwise(part, &resistance)) {
            return fit;
        }
        let own = |part: Part| match moves_otherwise(&part, &resistance) {
            true => self.parts_under(part.law, vec![part.shape], &resistance).swap_remove(0),
            false => part,
        };
        self.fit(fit.parts.into_iter().map(own).collect())
    }
}

/// Until when a fit is refined.
#[derive(Clone, Copy)]
struct Until {
    /// Share of the squares that a step must take off for another to be made.
    gains: f64,
    /// What must be within reach.
    squares: f64,
}

impl Until {
    /// Whether a fit whose last step took off this share of its squares will hardly come so far down in as many more.
    fn is_out_of_reach(&self, fit: &Fit, gained: f64, more: usize) -> bool {
        let needed = (fit.squares() / self.squares).ln();
        needed > -AMPLE * more as f64 * (1.0 - gained).ln()
    }
}

/// Whether a table moves otherwise under this.
fn moves_otherwise(part: &Part, resistance: &Arc<Resistance>) -> bool {
    !Arc::ptr_eq(&part.resistance, resistance) && part.law.is_otherwise(&part.resistance, resistance)
}
