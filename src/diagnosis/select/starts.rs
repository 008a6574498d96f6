//! Where a cause that may join a set is begun with.

use super::*;
use rayon::prelude::*;

/// Of the starts of a law that turns a table round in another way, which is simulated anew for each, one in so many is tried.
const EVERY: usize = 3;
/// Least share of what refining brings that a cause shows at its best start. Starts lie close enough for half.
const SHOWN_AT_START: f64 = 0.25;
/// Least gain at the best start for a cause to be refined.
const LEAST_AT_START: f64 = SHOWN_AT_START * LEAST_GAIN;
/// The same of a ripple of few periods, which explains some of anything that is slow along the stroke: a third of what is left.
const LEAST_OF_FEW: f64 = 0.4;
/// Gain of a start in another valley beside that of the best start, and on the ridge between them beside that, for the valley to be
/// looked into.
const NEARLY_AS_MUCH: f64 = 0.7;
const RIDGE: f64 = 0.5;

/// A cause at its best start beside a set.
pub struct Child<'s> {
    /// The set.
    pub set: &'s Fit,
    /// The cause there.
    pub part: Part,
    /// What the set would cost with it.
    pub price: f64,
    /// A start of the same cause in another valley, which may be deeper than it shows.
    elsewhere: Option<Part>,
    /// The set with it, refined, once somebody has asked.
    fit: OnceCell<Fit>,
}

impl<'s> Child<'s> {
    /// A cause beside a set, whose figure it brings to another.
    fn new(set: &'s Fit, part: &Part, figure: f64, elsewhere: Option<Part>) -> Self {
        Self { set, part: part.clone(), price: price(set) + figure - set.figure(), elsewhere, fit: OnceCell::new() }
    }

    /// The set with it, from its best start, and from one in another valley if that leaves much; see [`refined`] for the squares, of
    /// which who asks first says how many.
    #[must_use]
    pub fn refined(&self, bench: &Bench, squares: f64) -> Fit {
        if let Some(fit) = self.fit.get() {
            return fit.clone();
        }
        let from = |part: &Part| refined(bench, self.set, part.clone(), squares);
        let fit = from(&self.part);
        let other = self.elsewhere.as_ref().filter(|_| leaves_much(bench, &fit)).map(from);
        let fit = other.filter(|other| price(other) < price(&fit) && is_physical(bench, other)).unwrap_or(fit);
        _ = self.fit.set(fit.clone());
        fit
    }

    /// All causes of it.
    #[must_use]
    pub fn causes(&self) -> Vec<Cause> {
        let mut list = causes(self.set);
        list.push(self.part.law.cause);
        list.sort();
        list
    }

    /// The price that refining may reach beside sets of so many causes. In the place of a cause that has left, which leaves much, most
    /// starts gain something: those that lie close show half.
    #[must_use]
    pub fn within_reach(&self, causes: usize) -> f64 {
        let before = price(self.set);
        let shown = if self.set.parts.len() < causes { 2.0 * SHOWN_AT_START } else { SHOWN_AT_START };
        before - (before - self.price).max(LEAST_AT_START) / shown
    }
}

/// A law where it explains most of what a set leaves, if that is worth refining; a ripple of few periods beside a fine one.
/// `much_left` says whether the best of the sets leaves much.
#[must_use]
pub fn at_best_starts<'s>(search: &Search, set: &'s Fit, law: &'static Law, much_left: bool) -> Vec<Child<'s>> {
    let Search { bench, approach, .. } = search;
    let shelved = || search.shelved(law);
    let fresh: Vec<Part>;
    let parts: &[Part] = if law.manner.approached {
        fresh = approach.from(shelved(), set).map_or_else(Vec::new, |shape| {
            let there = bench.parts(law, vec![shape]);
            bench.leaned(&there, &bench.resistance_of(set)).unwrap_or(there)
        });
        &fresh
    } else if law.manner.starts_from_rest {
        fresh = bench.parts(law, bench.starts(law, set));
        &fresh
    } else {
        shelved()
    };
    let figures: Vec<f64> = parts.par_iter().map(|part| figure(&bench.joined(set, part)) + numbers(part)).collect();
    // What resists a simulated table is another with a friction more, and only then shows what that friction is worth.
    let beside_table = set.table().is_some() || law.is_simulated() && !set.parts.is_empty();
    let at_one = |part: &Part| {
        let parts = set.parts.iter().chain([part]).cloned().collect();
        bench.at_one(bench.fit(parts)).figure() + numbers(part)
    };
    let best = |few: bool| {
        let alike = figures.iter().copied().zip(parts).filter(|(_, part)| few_periods(part) == few);
        let mut start = alike.min_by(|a, b| a.0.total_cmp(&b.0))?;
        let least = set.figure() - if few { LEAST_OF_FEW } else { LEAST_AT_START };
        if beside_table && law.manner.turns_table && much_left {
            let all = parts.iter().step_by(EVERY).map(|part| (at_one(part), part));
            start = all.chain([start]).min_by(|a, b| a.0.total_cmp(&b.0))?;
        } else if beside_table && start.0 < least {
            start.0 = start.0.min(at_one(start.1));
        }
        let (figure, part) = start;
        // Of a clearance the way from its start has been through all of them.
        let in_a_row = law.is_simulated() && !law.manner.approached;
        let other = if in_a_row { other_valley(&figures, set.figure()) } else { None };
        let elsewhere = other.map(|i| parts[i].clone());
        let by_noise = || law.is_simulated() && noise::drives(bench, set, part);
        (figure < least && !by_noise()).then(|| Child::new(set, part, figure, elsewhere))
    };
    // There is one ripple of few periods at most.
    let has_few = set.parts.iter().any(|part| part.law.cause == law.cause && few_periods(part));
    [best(false), if has_few { None } else { best(true) }].into_iter().flatten().collect()
}

/// What the numbers of a cause cost.
fn numbers(part: &Part) -> f64 {
    NUMBER_PRICE * part.free_parameters() as f64
}

/// The seldom starts of a law beside a set; none where it has none.
#[must_use]
pub fn seldom_starts(bench: &Bench, set: &Fit, law: &Law) -> Vec<Vec<f64>> {
    let Some(seldom) = law.manner.seldom else { return Vec::new() };
    bench.starts(law, set).iter().flat_map(|shape| seldom(shape)).collect()
}

/// A law at the best of its seldom starts beside a set, if that is worth refining.
#[must_use]
pub fn at_seldom_starts<'s>(search: &Search, set: &'s Fit, law: &'static Law) -> Option<Child<'s>> {
    let bench = search.bench;
    let laid_out = search.seldom.get().and_then(|shelf| shelf.get(&law.cause)).map_or(&[][..], Vec::as_slice);
    let mut missing = seldom_starts(bench, set, law);
    missing.retain(|shape| !laid_out.iter().any(|part| part.shape == *shape));
    let made = bench.parts(law, missing);
    let rated = laid_out.iter().chain(&made).map(|part| (figure(&bench.joined(set, part)) + numbers(part), part));
    let (figure, part) = rated.min_by(|a, b| a.0.total_cmp(&b.0))?;
    (figure < set.figure() - LEAST_AT_START).then(|| Child::new(set, part, figure, None))
}

/// The deepest of the valleys beside that of the best start, of starts in a row and what each would leave of a figure: one that shows
/// nearly as much, behind a ridge that shows little.
fn other_valley(figures: &[f64], without: f64) -> Option<usize> {
    let gains: Vec<f64> = figures.iter().map(|figure| without - figure).collect();
    let most = (0..gains.len()).max_by(|&a, &b| gains[a].total_cmp(&gains[b]))?;
    let ridge = |i: usize| gains[i.min(most)..=i.max(most)].iter().copied().fold(f64::INFINITY, f64::min);
    let apart = |&i: &usize| gains[i] >= NEARLY_AS_MUCH * gains[most] && ridge(i) < RIDGE * gains[i];
    (0..gains.len()).filter(apart).max_by(|&a, &b| gains[a].total_cmp(&gains[b]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_valley_is_as_deep_and_behind_a_ridge() {
        // What springs of 41 to 134 Hz would leave of a table that swings at 44 Hz with another mass, beside 3.32.
        let springs = [3.21, 3.13, 2.84, 2.93, 3.27, 3.32, 3.26, 3.06, 2.82, 2.95, 3.04];
        assert_eq!(other_valley(&springs, 3.32), Some(2));
        // No ridge; a valley that is not as deep; nothing that gains.
        assert_eq!(other_valley(&[3.2, 2.84, 2.9, 2.82, 3.0], 3.32), None);
        assert_eq!(other_valley(&[3.2, 3.1, 3.32, 2.82, 3.0], 3.32), None);
        assert_eq!(other_valley(&[], 3.32), None);
    }
}
