//! A clearance is approached from afar. Where its flanks meet hard, a width that is a tenth off puts every impact at a wrong time,
//! and the sum of squares is so rugged that no start comes down to the right one. Summed over 50 ms it is the impulse of an
//! impact that counts: the sum of squares falls from half and from twice the width. So the start is chosen and moved on sums,
//! over shorter and shorter times. Over long ones widths that lie in different valleys may take off about as much: as long as they do
//! two of them are moved.

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
/// A width over another from which on they may lie in different valleys: starts are further apart than that.
const DISTINCT: f64 = 1.3;
/// Share of the squares which the best start takes off that another one must for it to be moved beside that.
const NEARLY: f64 = 0.8;

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

    /// Non-linear parameters that the best of these starts beside a set leads to; `None` where that shows nothing.
    #[must_use]
    pub fn from(&self, starts: &[Part], set: &Fit) -> Option<Vec<f64>> {
        let (first, _) = self.stages.first()?;
        // Starts lie so close that one of them takes off much of what a clearance makes.
        let mut parts = best_two(first, &first.again(set), starts.par_iter().cloned());
        let resistance = first.resistance_of(set);
        for (bench, stride) in &self.stages {
            let there = bench.again(set);
            let begun = |part: Part| bench.parts_under(part.law, vec![part.shape], &resistance);
            let begun: Vec<Part> = parts.into_iter().flat_map(begun).collect();
            let moved = begun.into_par_iter().map(|part| bench.approached(&there, part, *stride, MOVES));
            parts = best_two(bench, &there, moved);
        }
        parts.into_iter().next().map(|part| part.shape)
    }
}

/// The part that leaves least beside a set, and the best of those of another width where that leaves about as little; none where the
/// first shows nothing.
fn best_two(bench: &Bench, set: &Fit, parts: impl ParallelIterator<Item = Part>) -> Vec<Part> {
    let left = |part: &Part| bench.left_beside(set, part);
    let rated = parts.map(|part| {
        let left = left(&part);
        (dot(&left, &left), part)
    });
    let mut rated: Vec<(f64, Part)> = rated.filter(|(squares, _)| squares.is_finite()).collect();
    rated.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut rated = rated.into_iter();
    let Some((least, best)) = rated.next() else { return Vec::new() };
    if figure(&bench.channels(&left(&best))) > set.figure() - LEAST {
        return Vec::new();
    }
    let most = set.squares() - NEARLY * (set.squares() - least);
    let width = |part: &Part| part.shape.first().map_or(0.0, |width| width.ln());
    let apart = |part: &Part| (width(part) - width(&best)).abs() > DISTINCT.ln();
    let other = rated.take_while(|(squares, _)| *squares < most).map(|(_, part)| part).find(apart);
    std::iter::once(best).chain(other).collect()
}
