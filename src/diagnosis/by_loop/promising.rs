//! Which causes are worth refining in the loop.

use super::STAGE;
use super::replays::Replays;
use super::trial::Trial;
use crate::diagnosis::frame::Frame;
use crate::diagnosis::missed::{GIVES, mean};
use crate::diagnosis::progress::{Stopped, Watch};
use crate::machine::{Axis, Cause};

/// Share of the best start's gain from which on another cause is refined beside it.
const RIVAL: f64 = 0.25;
/// Causes that are refined.
const TRIED: usize = 4;
/// Share of the squares of what is missed that a trial which has nothing to do with it goes along with one time in ten, by as many blocks as give
/// a cause its numbers. Of some 40 machines with a clearance, a spring or friction that builds up the best start of that goes along with
/// 0.18 at least.
const BY_CHANCE: f64 = 0.07;

/// Of these the causes that take most off what a machine misses in the beginning of the recording, each where it takes most.
pub(super) fn promising(
    trials: Vec<Trial>,
    replays: &Replays,
    frame: &Frame,
    extended: &Axis,
    watch: &Watch,
) -> Result<Vec<Trial>, Stopped> {
    let Some(before) = replays.error(extended) else { return Ok(Vec::new()) };
    let missed = |error: &[f64]| mean(&replays.misses(error), GIVES);
    let without = mean(&replays.misses(&before), GIVES);
    let tried = |some: &[Trial]| {
        let tried = watch.each(some, (0.98, 0.985), STAGE, |trial| {
            let (trial, error) = trial.clone().sized(frame, extended, replays, &before, GIVES)?;
            let alike = if trial.acts_in_few_rows(frame) { replays.alike(&before, &error, GIVES) } else { 0.0 };
            Some((missed(&error), !trial.promises(), trial, alike))
        });
        tried.map(|tried| tried.into_iter().flatten().collect::<Vec<_>>())
    };
    // Mostly there is nothing to be told, and none of what may be goes the way that is missed: then its rivals need not be asked.
    let (first, others) = first_and_others(trials);
    let mut all = tried(&first)?;
    let goes_that_way = |(.., own, alike): &(f64, bool, Trial, f64)| {
        let nearer = |(missed, _, other, _): &(f64, bool, Trial, f64)| other.is_of_law(own) && *missed < without;
        *alike > BY_CHANCE && all.iter().any(nearer)
    };
    if !all.iter().any(goes_that_way) {
        return Ok(Vec::new());
    }
    all.extend(tried(&others)?);
    let mut sized: Vec<(f64, bool, Trial)> =
        all.into_iter().map(|(missed, shown, trial, _)| (missed, shown, trial)).collect();
    // What acts in proportion has only promised so far, and is asked to show it where that would be among the best.
    let mut near = loop {
        sized.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut near: Vec<usize> = Vec::new();
        for (at, (.., trial)) in sized.iter().enumerate() {
            // A clearance whose numbers are not yet right shows nothing, and may be all the same.
            let tried = near.len() < TRIED || trial.law.cause == Cause::Backlash;
            if tried && !near.iter().any(|other| sized[*other].2.is_of_law(trial)) {
                near.push(at);
            }
        }
        let promises: Vec<usize> = near.iter().copied().filter(|at| !sized[*at].1).collect();
        if promises.is_empty() {
            break near.into_iter().map(|at| (sized[at].0, sized[at].2.clone())).collect::<Vec<(f64, Trial)>>();
        }
        let shown = watch.each(&promises, (0.98, 0.985), STAGE, |&at| sized[at].2.error(frame, extended, replays))?;
        for (at, error) in promises.into_iter().zip(shown) {
            (sized[at].0, sized[at].1) = (error.map_or(f64::INFINITY, |error| missed(&error)), true);
        }
    };
    let siblings: Vec<Trial> = near.iter().flat_map(|(_, trial)| trial.siblings()).collect();
    let missed =
        watch.each(&siblings, (0.985, 0.99), STAGE, |trial| Some(missed(&trial.error(frame, extended, replays)?)))?;
    for (sibling, missed) in siblings.into_iter().zip(missed) {
        let own = near.iter_mut().find(|(_, own)| own.is_of_law(&sibling));
        if let Some((own, missed)) = own.zip(missed).filter(|(own, missed)| missed < &own.0) {
            *own = (missed, sibling);
        }
    }
    near.sort_by(|a, b| a.0.total_cmp(&b.0));
    let gain = |missed: f64| without - missed;
    // What gains little beside the best is no rival of it.
    let most = near.first().map_or(0.0, |(missed, _)| gain(*missed));
    Ok(near.into_iter().filter(|(missed, _)| gain(*missed) >= RIVAL * most).map(|(_, trial)| trial).collect())
}

/// The trials of what may be told, of what is simulated every other one, whose starts lie close; and all others.
fn first_and_others(trials: Vec<Trial>) -> (Vec<Trial>, Vec<Trial>) {
    let mut simulated = 0;
    trials.into_iter().partition(|trial| {
        let is_simulated = trial.law.is_simulated();
        simulated += usize::from(is_simulated);
        !trial.promises() && trial.has_a_name() && (!is_simulated || simulated % 2 == 0)
    })
}

#[cfg(test)]
mod tests {
    use super::super::tests::{clearance, found, recorded, rig};
    use super::super::trial::starts;
    use super::*;
    use crate::diagnosis::belief;
    use crate::diagnosis::causes::LAWS;
    use crate::diagnosis::whole::Whole;
    use crate::machine::Effect;

    /// How many causes are worth refining in the loop of the rig with what is hidden.
    fn promising_beside(hidden: Effect) -> usize {
        let excerpt = recorded(&[hidden], 0.05);
        let whole = excerpt.columns.as_ref().unwrap();
        let (axis, thinned) = (rig(), whole.clone().thinned());
        let base = belief::base_alone(&axis);
        let frame = Frame::new(&base, &thinned, None);
        let before = found(&[], &frame, whole);
        let (watch, whole) = (Watch::new(&|_, _| true), Whole::new(&axis, whole));
        let replays = Replays::new(&whole, before.replay.as_ref(), &watch).unwrap();
        let trials = LAWS.iter().flat_map(|law| starts(&frame, law)).collect();
        promising(trials, &replays.beginning(), &frame, &axis, &watch).unwrap().len()
    }

    #[test]
    fn causes_are_refined_only_where_one_goes_the_way_that_is_missed() {
        for rigid in [Effect::ViscousFrictionMismatch { slope: 0.01 }, Effect::ConstantTorque { torque: 0.05 }] {
            assert_eq!(promising_beside(rigid), 0, "{rigid:?}");
        }
        assert!(promising_beside(clearance(5.0)) > 0);
    }
}
