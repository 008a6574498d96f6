//! Which causes: a beam of sets of causes grows by the cause that explains most, is refined jointly, and shrinks again by
//! what is not needed.
//!
//! Sets are compared by Σ ln(mean square) over the channels. Residuals are strongly autocorrelated, so a cause joins only
//! when its gain is a fair share of what is left, and stays where it is needed (`shrink`).

use super::approach::Approach;
use super::astray;
use super::causes::periods::{FEW, is_all_the_time, is_in_each_period, shows_along_stroke};
use super::causes::{Law, loose_spring};
use super::fit::{Bench, Fit, Part, figure};
use super::form;
use super::formulation;
use super::judge::{Excess, LITTLE_LEFT};
use super::many::add;
use super::means;
use super::play;
use super::progress::{Stopped, Watch};
use super::shrink::{idle_left_out, shrink};
use super::valleys;
use crate::machine::Cause;
use once_cell::sync::OnceCell;
use std::collections::{HashMap, HashSet};

mod leaning;
mod noise;
mod shelf;
mod starts;
mod waves;

use shelf::{Shelf, shelf};
use starts::{Child, at_best_starts, at_seldom_starts};

/// Sets that are carried on.
const BEAM: usize = 2;
/// Runners-up that are kept.
const RIVALS: usize = 4;
/// Causes refined for each set that grows.
const TRIED: usize = 6;
/// Most causes in a set.
const MOST: usize = 6;
/// Least gain of a cause in Σ ln(mean square): 8 % of what is left. A smaller one would not be worth a machinist's time,
/// and imperfect filters, grids and reversals make up to half of it on machines without any fault.
pub const LEAST_GAIN: f64 = 0.08;
/// What a further fitted number must gain where sets of causes compete.
pub const NUMBER_PRICE: f64 = 0.003;

/// Share of what the belief leaves above noise up to which a law that leaves little is no imitation of a table: such a one leaves a
/// tenth and more.
const NO_IMITATION: f64 = 0.05;
/// The same of a law that is confused with tables, over that: of 42 random machines with a spring or a clearance friction that builds up left
/// 0.08 at least, of 26 with that friction alone 0.04 and less but for two.
const CONFUSED: f64 = 0.5;

/// Squares of one fit over those of another with the same causes up to which the other is in the same place.
const AS_DEEP: f64 = 1.01;

/// Squares over those that a set must come down to at which it is not refined any more.
const FAR_OFF: f64 = 2.0;

/// What is said while sets are refined.
const FITTING: &str = "fitting causes";

/// Beats in a recording below which two vibrations are one that comes and goes.
const BEATS: f64 = 4.0;

/// Least size of a cause in its standard deviations: it must be known to be there at all.
pub const LEAST_STRENGTH: f64 = 2.5;

/// The set of causes that explains the recording best, and the runners-up for its first cause.
#[derive(Debug, Clone)]
pub struct Selection {
    /// The fit.
    pub fit: Fit,
    /// Other sets of as many causes, best first.
    pub rivals: Vec<Fit>,
    /// Other fits of the same causes that leave about as much.
    pub alike: Vec<Fit>,
}

/// The numbers of a belief that a search may leave open from the start: the balance is linear in them.
pub const BELIEF: [Cause; 4] =
    [Cause::InertiaMismatch, Cause::CoulombFrictionMismatch, Cause::ViscousFrictionMismatch, Cause::ConstantTorque];

/// What stays the same while sets of causes grow.
pub struct Search<'s, 'f, 'a> {
    bench: &'s Bench<'f, 'a>,
    approach: Approach<'f, 'a>,
    laws: &'s [&'static Law],
    shelf: Shelf,
    /// That of tables, which are simulated once somebody asks for them, and of their seldom starts.
    tables: OnceCell<Shelf>,
    seldom: OnceCell<Shelf>,
    watch: &'s Watch<'s>,
}

impl<'s, 'f, 'a> Search<'s, 'f, 'a> {
    /// A search among these laws on a bench.
    ///
    /// # Errors
    /// [`Stopped`] when the watch's caller said so.
    pub fn new(bench: &'s Bench<'f, 'a>, laws: &'s [&'static Law], watch: &'s Watch<'s>) -> Result<Self, Stopped> {
        let approach = Approach::new(bench);
        let empty = bench.fit(Vec::new());
        let by_rows = laws.iter().filter(|law| !law.is_simulated());
        let shelf = shelf(bench, &approach, by_rows.map(|law| (*law, bench.starts(law, &empty))), watch)?;
        Ok(Self { bench, laws, shelf, tables: OnceCell::new(), seldom: OnceCell::new(), approach, watch })
    }

    /// The causes that explain most beside the belief as it is.
    ///
    /// # Errors
    /// [`Stopped`] when the watch's caller said so.
    pub fn from_belief(&self) -> Result<Selection, Stopped> {
        search_from(self, self.bench.fit(Vec::new()))
    }

    /// The same with every number of the belief open from the start.
    ///
    /// # Errors
    /// [`Stopped`] when the watch's caller said so.
    pub fn from_open_belief(&self) -> Result<Selection, Stopped> {
        search_from(self, self.with_beliefs(&self.bench.fit(Vec::new())))
    }

    /// A set with every number of the belief open.
    fn with_beliefs(&self, set: &Fit) -> Fit {
        let missing = self.laws.iter().filter(|law| BELIEF.contains(&law.cause) && may_join(set, law));
        let mut parts = set.parts.clone();
        parts.extend(missing.flat_map(|law| self.bench.parts(law, vec![Vec::new()])));
        self.bench.fit(parts)
    }
}

fn search_from(search: &Search, from: Fit) -> Result<Selection, Stopped> {
    let mut beam = vec![from];
    let mut best: Vec<Fit> = beam.clone();
    let mut rivals: Vec<Fit> = Vec::new();
    let mut bottom: Option<Fit> = None;
    for depth in 0..MOST {
        if best.last().is_some_and(|fit| is_lost_in_steps(search.bench, fit)) {
            break;
        }
        // Most searches end after a cause or two, so that the first steps are most of the work.
        let share = |steps: usize| 0.8 - 0.65 * 0.4f64.powi(steps as i32);
        let mut grown = grow(search, &beam, (share(depth), share(depth + 1)))?;
        let Some(first) = grown.first() else { break };
        if let Some(last) = best.last().filter(|fit| !is_more(price(fit), first)) {
            // In the place of a cause another may do about as well.
            rivals.extend(grown.into_iter().filter(|fit| fit.parts.len() == last.parts.len()));
            break;
        }
        // A cause that takes no more off than going to the bottom with those that are there would only stand in for that.
        if let Some(last) = best.last_mut().filter(|last| !first.halves(last)) {
            let there = at_the_bottom(search, last)?;
            if price(&there) <= price(first) {
                *last = there;
                bottom = Some(last.clone());
                beam = vec![last.clone()];
                continue;
            }
        }
        let of_fewer = best.last().map_or(f64::INFINITY, price);
        best.push(first.clone());
        rivals = grown.iter().skip(1).take(RIVALS).cloned().collect();
        grown.truncate(if may_gain(search.bench, first) { BEAM } else { 1 });
        // What a set of fewer causes does as well has gone astray.
        grown.retain(|fit| price(fit) < of_fewer);
        beam = grown;
    }
    let start = best.pop().unwrap_or_else(|| search.bench.fit(Vec::new()));
    // What only several numbers of the belief together explain, others may have imitated one by one.
    let open = idle_left_out(search.bench, search.with_beliefs(&start), search.watch)?;
    let start = if price(&open) < price(&start) { open } else { start };
    let fit = shrink(search.bench, start, search.watch)?;
    let fit = waves::fewer(search, fit)?;
    let fit = valleys::settled(search.bench, search.laws, fit, search.watch)?;
    // At the bottom play has been looked for.
    let mut fit = match bottom.filter(|bottom| same_causes(bottom, &fit) && bottom.squares() <= AS_DEEP * fit.squares())
    {
        Some(_) => fit,
        None => play::added(search.bench, search.laws, fit, search.watch)?,
    };
    // What stood in for the play of a spring, or for the spring of a clearance, is not needed beside both.
    if fit.parts.iter().any(loose_spring::is) {
        fit = shrink(search.bench, fit, search.watch)?;
    }
    let fit = means::settled(search.bench, fit);
    rivals.retain(|r| r.parts.len() == fit.parts.len() && !same_causes(r, &fit));
    let plain = Selection { fit, rivals, alike: Vec::new() };
    let found = formulation::settled(search.bench, plain, search.watch)?;
    grown_on(search, found)
}

/// A set with a simulated table, which the search refines but roughly, as far down as it goes.
fn at_the_bottom(search: &Search, fit: &Fit) -> Result<Fit, Stopped> {
    if fit.table().is_none() {
        return Ok(fit.clone());
    }
    let refined = search.bench.refine(fit.clone(), 0, 8);
    let refined = valleys::settled(search.bench, search.laws, refined, search.watch)?;
    let refined = play::added(search.bench, search.laws, refined, search.watch)?;
    Ok(if is_physical(search.bench, &refined) { refined } else { fit.clone() })
}

/// A selection with what is needed beside friction of another formulation than the search knows: what stood in for that
/// formulation may have taken its place.
fn grown_on(search: &Search, found: Selection) -> Result<Selection, Stopped> {
    let mut fit = found.fit.clone();
    if !fit.parts.iter().any(formulation::is_another) {
        return Ok(found);
    }
    // What takes the place of friction that builds up makes a set no larger, and that friction may join it again: each must cost less.
    while fit.parts.len() < MOST {
        let next = grow(search, std::slice::from_ref(&fit), (0.9, 0.9))?.into_iter().next();
        let Some(next) = next.filter(|next| price(next) < price(&fit)) else { break };
        fit = next;
    }
    if fit.parts.len() == found.fit.parts.len() {
        return Ok(found);
    }
    let fit = shrink(search.bench, fit, search.watch)?;
    // Another formulation, as uncertain as before, is compared beside the same causes.
    Ok(if price(&fit) < price(&found.fit) { Selection { fit, alike: Vec::new(), ..found } } else { found })
}

/// Whether nothing is left beyond noise and what a coarse grid of the torque may make: what takes more off follows its steps.
fn is_lost_in_steps(bench: &Bench, fit: &Fit) -> bool {
    bench.frame.columns.torque_step > 0.0 && Excess::of(bench, fit, fit).largest() <= 0.0
}

/// Whether so much is left above noise that another set may be better by as much as a cause must gain.
fn may_gain(bench: &Bench, fit: &Fit) -> bool {
    Excess::of(bench, fit, fit).largest().ln_1p() > LEAST_GAIN
}

/// Whether a set is worth going on from where another price was reached.
fn is_more(before: f64, fit: &Fit) -> bool {
    price(fit) <= before - 0.5 * LEAST_GAIN
}

/// What a set of causes costs: its figure, and its numbers.
#[must_use]
pub fn price(fit: &Fit) -> f64 {
    fit.figure() + NUMBER_PRICE * fit.numbers() as f64
}

fn causes(fit: &Fit) -> Vec<Cause> {
    let mut list: Vec<Cause> = fit.parts.iter().map(|p| p.law.cause).collect();
    list.sort();
    list
}

fn same_causes(a: &Fit, b: &Fit) -> bool {
    causes(a) == causes(b)
}

/// The sets with each of the most promising causes added, refined jointly: those that are worth it, best first.
fn grow(search: &Search, beam: &[Fit], (from, to): (f64, f64)) -> Result<Vec<Fit>, Stopped> {
    let Search { bench, laws, watch, .. } = search;
    let open = beam.iter().flat_map(|set| laws.iter().filter(|law| may_join(set, law)).map(move |law| (set, *law)));
    // What turns a table round may have stood in for what is before the table.
    let stood_in: Vec<Fit> = beam.iter().take(1).filter_map(|set| without_stand_in(bench, set)).collect();
    let in_its_place = |set| laws.iter().filter(|law| law.is_simulated()).map(move |law| (set, *law));
    let open = open.chain(stood_in.iter().flat_map(in_its_place));
    // A set whose table leaves little, or that which imitates one and does so alone, leaves nothing for another table to tell.
    let settled = beam.first().is_some_and(|best| tells_of_tables(best) && !leaves_much(bench, best));
    let open = open.filter(|(_, law)| !(settled && law.is_simulated()));
    let (tables, by_rows): (Vec<_>, Vec<_>) = open.partition(|(_, law): &(&Fit, &Law)| law.is_simulated());
    let at = |share: f64| from + share * (to - from);
    let mut children = look(search, &by_rows, (from, at(0.25)))?;
    // Simulations take longest. Beside causes without one they are asked where no law that is worked out row by row is to be
    // carried on and halves what is left, or leaves little: beside one that is they are asked next, which shows what only
    // imitates them. Beside none they are asked unless such a law by itself cannot be an imitation.
    let first = beam.iter().all(|set| set.parts.is_empty());
    let asked_last = beam.iter().all(|set| !set.parts.is_empty() && set.table().is_none());
    let needless = tables.is_empty() || first && tells_by_itself(bench, &children);
    let both: Vec<_> = by_rows.iter().chain(&tables).copied().collect();
    let mut grown = if asked_last || needless {
        with_one_more(search, (&by_rows, children), &[], (at(0.25), at(0.5)))?
    } else {
        children.extend(look(search, &tables, (at(0.25), at(0.5)))?);
        with_one_more(search, (&both, children), &[], (at(0.5), to))?
    };
    let so_far = beam.iter().map(price).fold(f64::INFINITY, f64::min);
    let leaves_little = |fit: &Fit| Excess::of(bench, fit, fit).largest() < LITTLE_LEFT;
    let suffices = |fit: &Fit| is_more(so_far, fit) && (beam.iter().all(|set| fit.halves(set)) || leaves_little(fit));
    if asked_last && !needless && !grown.first().is_some_and(suffices) {
        let children = look(search, &tables, (at(0.5), at(0.75)))?;
        let more = with_one_more(search, (&tables, children), &grown, (at(0.75), to))?;
        grown.extend(more);
        sort_by_price(&mut grown);
    }
    // Of what form a law is matters of the sets that are carried on.
    let carried_on = grown.len().min(BEAM);
    let formed = watch.each(&grown[..carried_on], (to, to), FITTING, |fit| of_form(bench, fit))?;
    grown.splice(..carried_on, formed);
    sort_by_price(&mut grown);
    Ok(grown)
}

/// The set that costs least.
fn cheapest<'s>(sets: impl Iterator<Item = &'s Fit>) -> Option<&'s Fit> {
    sets.min_by(|a, b| price(a).total_cmp(&price(b)))
}

/// Whether a set leaves much. Where the best leaves little no other comes before it by much, and tables need not be turned round for
/// that.
fn leaves_much(bench: &Bench, set: &Fit) -> bool {
    Excess::of(bench, set, set).largest() > LITTLE_LEFT
}

/// Whether a set has a table, or nothing but what turns one round: beside other causes that may have stood in for one.
fn tells_of_tables(set: &Fit) -> bool {
    set.table().is_some() || matches!(set.parts.as_slice(), [part] if part.law.manner.turns_table)
}

/// A set without what turns a table round, where it has that and no table.
fn without_stand_in(bench: &Bench, set: &Fit) -> Option<Fit> {
    let at = set.parts.iter().position(|part| part.law.manner.turns_table)?;
    (set.table().is_none() && set.parts.len() > 1).then(|| bench.without(set, at))
}

/// Whether the best of laws that are worked out row by row explains so much by itself that it is no imitation of a table.
fn tells_by_itself(bench: &Bench, children: &[Child]) -> bool {
    let Some(best) = children.iter().min_by(|a, b| a.price.total_cmp(&b.price)) else { return false };
    let of_tables = best.part.law.confused_with.iter().any(|cause| super::causes::law(*cause).is_simulated());
    let least = NO_IMITATION * if of_tables { CONFUSED } else { 1.0 };
    let before = Excess::of(bench, best.set, best.set).largest();
    let fit = best.refined(bench, best.set.squares());
    let left = Excess::of(bench, &fit, &fit).largest();
    is_physical(bench, &fit) && left < LITTLE_LEFT && left < least * before
}

/// Each of these laws at its best starts beside its set.
fn look<'s>(
    search: &Search,
    open: &[(&'s Fit, &'static Law)],
    (from, to): (f64, f64),
) -> Result<Vec<Child<'s>>, Stopped> {
    let Search { bench, watch, .. } = search;
    if open.iter().any(|(_, law)| law.is_simulated()) {
        search.lay_out_tables()?;
    }
    let much_left = cheapest(open.iter().map(|(set, _)| *set)).is_some_and(|best| leaves_much(bench, best));
    let at_start = |&(set, law): &(_, _)| at_best_starts(search, set, law, much_left);
    Ok(watch.each(open, (from, to), "looking for causes", at_start)?.into_iter().flatten().collect())
}

/// The sets with each of these laws added that may come among the best beside others: those that are worth it, best first.
fn with_one_more(
    search: &Search,
    (open, mut children): (&[(&Fit, &'static Law)], Vec<Child>),
    others: &[Fit],
    (from, to): (f64, f64),
) -> Result<Vec<Fit>, Stopped> {
    let Search { bench, watch, .. } = search;
    children.sort_by(|a, b| a.price.total_cmp(&b.price));
    // Two sets may grow into the same one, which is refined once, from where it costs less.
    let mut seen = HashSet::new();
    children.retain(|child| seen.insert((child.causes(), few_periods(&child.part))));
    // What cannot come among those that are carried on need not be refined.
    let mut prices: Vec<f64> = children.iter().map(|child| child.price).chain(others.iter().map(price)).collect();
    prices.sort_by(f64::total_cmp);
    let so_far = open.iter().map(|(set, _)| price(set)).fold(f64::INFINITY, f64::min);
    let carried_on = prices.get(BEAM - 1).map_or(so_far, |price| price.min(so_far));
    let most = open.iter().map(|(set, _)| set.parts.len()).max().unwrap_or(0);
    let mut tried: HashMap<Vec<Cause>, usize> = HashMap::new();
    children.retain(|child| {
        let count = tried.entry(causes(child.set)).or_default();
        *count += 1;
        *count <= TRIED && child.within_reach(most) < carried_on
    });
    children.sort_by_key(|child| !child.part.law.is_simulated());
    let mut fits = watch.each(&children, (from, to), FITTING, |child| child.refined(bench, child.set.squares()))?;
    let sound = fits.iter().filter(|fit| is_physical(bench, fit));
    let best = cheapest(sound.chain(others).chain(open.iter().map(|(set, _)| *set)));
    if let Some(best) = best.filter(|best| leaves_much(bench, best)) {
        let rare: Vec<_> = open.iter().filter(|(_, law)| law.manner.seldom.is_some()).collect();
        if !rare.is_empty() {
            search.lay_out_seldom()?;
        }
        let before = price(best);
        let begun = watch.each(&rare, (to, to), FITTING, |(set, law)| {
            let child = at_seldom_starts(search, set, law).filter(|child| child.within_reach(most) < before)?;
            Some((child.refined(bench, best.squares()), child))
        })?;
        let (more_fits, more): (Vec<_>, Vec<_>) = begun.into_iter().flatten().unzip();
        fits.extend(more_fits);
        children.extend(more);
    }
    let (within, strayed): (Vec<_>, Vec<_>) =
        fits.into_iter().zip(&children).partition(|(fit, _)| is_physical(bench, fit));
    let best = cheapest(within.iter().map(|(fit, _)| fit).chain(others));
    let right = watch.each(&strayed, (to, to), FITTING, |(fit, child)| {
        let right = if astray::matters(fit, best) { astray::put_right(bench, child.set, fit) } else { None };
        right.filter(|fit| is_physical(bench, fit))
    })?;
    let right = right.into_iter().zip(&strayed).filter_map(|(fit, (_, child))| Some((fit?, *child)));
    let worth = |(fit, child): &(Fit, &Child)| {
        price(fit) < price(child.set) - 0.5 * LEAST_GAIN && once_only(bench, fit).is_none()
    };
    let mut grown: Vec<Fit> = within.into_iter().chain(right).filter(worth).map(|(fit, _)| fit).collect();
    sort_by_price(&mut grown);
    Ok(grown)
}

fn sort_by_price(fits: &mut [Fit]) {
    fits.sort_by(|a, b| price(a).total_cmp(&price(b)));
}

/// A set with its last cause of the form that the rows show.
fn of_form(bench: &Bench, fit: &Fit) -> Fit {
    let last = fit.parts.len().saturating_sub(1);
    let formed = form::settled(bench, fit.clone(), last..fit.parts.len(), 6);
    if is_physical(bench, &formed) { formed } else { fit.clone() }
}

/// A set with a cause more, first fitted by itself, then with the others. One that will not come down to so many squares is left as
/// far as it came.
#[must_use]
pub fn refined(bench: &Bench, set: &Fit, part: Part, squares: f64) -> Fit {
    let mut parts = set.parts.clone();
    parts.push(part);
    let count = set.parts.len();
    let fit = leaning::table_anew(bench, bench.fit(parts));
    let fit = bench.refine_towards(fit, count, 6, squares);
    if fit.squares() > FAR_OFF * squares {
        return fit;
    }
    let fit = bench.refine_roughly(fit, 0, if count == 0 { 4 } else { 2 });
    means::told_again(bench, formulation::suited(bench, fit, 2))
}

fn may_join(set: &Fit, law: &Law) -> bool {
    let same = set.parts.iter().filter(|p| p.law.cause == law.cause).count();
    // What stands between motor and table is one thing: two simulations do not add up.
    if law.is_simulated() && set.table().is_some() {
        return false;
    }
    // A wave with a harmonic and one more, or one whose size swells and sinks (a line with one on either side). Two tight spots
    // side by side imitate anything along the stroke.
    same == 0 || law.cause.row().repeatable && same < 3 && law.cause != Cause::PositionDependentFriction
}

/// Whether every part lies within its bounds, and ripples of few periods are there once.
#[must_use]
pub fn is_physical(bench: &Bench, fit: &Fit) -> bool {
    let few = fit.parts.iter().filter(|p| few_periods(p)).map(|p| p.law.cause);
    let mut few: Vec<Cause> = few.collect();
    few.sort();
    let one_of_each = few.windows(2).all(|pair| pair[0] != pair[1]);
    one_of_each && (0..fit.parts.len()).all(|i| is_within_bounds(bench, fit, i))
}

/// Whether the numbers of a part are within the physical bounds of its law.
#[must_use]
pub fn is_within_bounds(bench: &Bench, fit: &Fit, part: usize) -> bool {
    let Part { law, shape, .. } = &fit.parts[part];
    law.effect(bench.frame, shape, &fit.coefficients[part]).is_some()
}

/// Whether a part is a ripple of few periods along the stroke.
fn few_periods(part: &Part) -> bool {
    let along_stroke = [Cause::Cogging, Cause::ScrewPeriodicError].contains(&part.law.cause);
    along_stroke && part.shape.first().is_some_and(|periods| *periods < FEW)
}

/// A ripple that shows at few places, or of few periods and not there in each of them, or a vibration that is not there all the time.
pub fn once_only(bench: &Bench, fit: &Fit) -> Option<usize> {
    (0..fit.parts.len()).find(|&i| {
        let Part { law, shape, .. } = &fit.parts[i];
        if law.cause == Cause::ExternalVibration {
            return !is_all_the_time(bench.frame, &fit.contribution(i), &without_neighbours(fit, i));
        }
        let channel = if law.cause == Cause::Cogging { 0..bench.rows } else { bench.rows..fit.residual.len() };
        let (ripple, left) = (&fit.contribution(i)[channel.clone()], &fit.residual[channel]);
        law.cause == Cause::Cogging && !shows_along_stroke(bench.frame, ripple)
            || few_periods(&fit.parts[i]) && !is_in_each_period(bench.frame, shape[0], ripple, left)
    })
}

/// What is left when vibrations go that a recording of this length does not tell from one: two that beat are there only while
/// they agree.
fn without_neighbours(fit: &Fit, part: usize) -> Vec<f64> {
    let mut left = fit.residual.clone();
    let near = |other: &Part| {
        let own = &fit.parts[part];
        other.law.cause == own.law.cause && (other.shape[0] - own.shape[0]).abs() < BEATS
    };
    for other in (0..fit.parts.len()).filter(|&other| other != part && near(&fit.parts[other])) {
        add(&mut left, 1.0, &fit.contribution(other));
    }
    left
}
