//! A clearance is approached from afar. Where its flanks meet hard, a width that is a tenth off puts every impact at a wrong time,
//! and the sum of squares is so rugged that no start comes down to the right one. Summed over 50 ms it is the impulse of an
//! impact that counts: the sum of squares falls from half and from twice the width. So the start is chosen and moved on sums,
//! over shorter and shorter times.

use super::causes::Law;
use super::fit::{Bench, Fit, Part, figure};
use super::many::dot;
use rayon::prelude::*;

/// Times over which rows are summed, s, and how far apart the points of a slope are, in steps of each scale.
const STAGES: [(f64, f64); 3] = [(0.05, 12.0), (0.02, 8.0), (0.006, 4.0)];
/// Most moves in a stage.
const MOVES: usize = 6;
/// Least that a clearance takes off ln of the mean square of the sums for it to be moved on.
const LEAST: f64 = 0.02;

/// The stages of an approach.
#[derive(Debug)]
pub struct Approach<'f, 'a> {
    stages: Vec<(Bench<'f, 'a>, f64)>,
}

impl<'f, 'a> Approach<'f, 'a> {
    /// Of these equations.
    #[must_use]
    pub fn new(bench: &Bench<'f, 'a>) -> Self {
        Self { stages: STAGES.map(|(seconds, stride)| (bench.smoothed(seconds), stride)).into() }
    }

    /// The law at these starts on the sums, for [`Approach::from`].
    #[must_use]
    pub fn starts(&self, law: &'static Law, shapes: Vec<Vec<f64>>) -> Vec<Part> {
        self.stages.first().map_or_else(Vec::new, |(bench, _)| bench.parts(law, shapes))
    }

    /// Non-linear parameters that the best start beside a set leads to; `None` where that shows nothing.
    #[must_use]
    pub fn from(&self, starts: &[Part], set: &Fit) -> Option<Vec<f64>> {
        let ((first, stride), finer) = self.stages.split_first()?;
        let there = first.again(set);
        let resistance = first.resistance_of(set);
        let leaned = first.leaned(starts, &resistance);
        let starts = leaned.as_deref().unwrap_or(starts);
        let left = |part: &Part| first.left_beside(&there, part);
        let squares = |part: &Part| {
            let left = left(part);
            dot(&left, &left)
        };
        let rated = starts.par_iter().map(|part| (squares(part), part));
        let (_, nearest) = rated.min_by(|a, b| a.0.total_cmp(&b.0))?;
        // Starts lie so close that one of them takes off much of what a clearance makes; but where a load leans on it, how long flanks are
        // apart goes with the shares as well, and a start may be worse than none in a fine scale.
        if !resistance.leans() && figure(&first.channels(&left(nearest))) > there.figure() - LEAST {
            return None;
        }
        let start = first.parts_under(nearest.law, vec![nearest.shape.clone()], &resistance).pop()?;
        let mut part = first.approached(&there, start, *stride, MOVES);
        let shows = |bench: &Bench, set: &Fit, part: &Part| {
            figure(&bench.channels(&bench.left_beside(set, part))) < set.figure() - LEAST
        };
        if !shows(first, &there, &part) {
            return None;
        }
        for (bench, stride) in finer {
            let (there, start) = (bench.again(set), bench.parts_like(&part, vec![part.shape.clone()]).pop()?);
            part = bench.approached(&there, start, *stride, MOVES);
            if !shows(bench, &there, &part) {
                return None;
            }
        }
        Some(part.shape)
    }
}
