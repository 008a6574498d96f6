//! A clearance or a spring that the torque has found, with the numbers that the loop gives it.
//!
//! Behind a motor that is known to a step of its encoder the flanks of a simulated clearance meet a row too soon or too late, and a spring
//! swings by that step: the sum of squares of the torque is least at widths that are a fifth off and more. A replayed loop does not
//! follow the encoder. It has valleys as well: the table of a clearance slows down by its friction over its inertia, which are known well
//! together, and its impact goes as width times inertia. The loop is asked in each about the numbers that were found.

use super::itself::by_torque;
use super::trial::{Refined, Trial};
use super::{ABOUT_REVERSALS, Replays, STAGE, Told, answered};
use crate::analysis::statistics;
use crate::diagnosis::causes::law;
use crate::diagnosis::excerpt::Excerpt;
use crate::diagnosis::frame::Frame;
use crate::diagnosis::gain;
use crate::diagnosis::judge::refuted;
use crate::diagnosis::missed::{GIVES, JUDGES, NOTHING, Over, avoidable, mean, mean_of_worse_half, misses, strength};
use crate::diagnosis::progress::{Stopped, Watch};
use crate::diagnosis::verdict::{Diagnosis, Verdict};
use crate::diagnosis::{belief, verdict::Finding};
use crate::machine::{Axis, Cause, Effect};

/// Misses of the worse half of the blocks from which on the loop is asked: there the error is that of the encoder.
const ASKED: f64 = NOTHING;
/// Mean over scatter of what the loop's numbers gain in blocks that did not give them, times √blocks, from which on they are taken: either
/// are of the same cause, and the torque's are no more certain.
const LIKELY: f64 = 1.0;
/// Misses beyond what such an encoder makes the loop miss of the very machine, in the worse half of the blocks, from which on there is
/// something to win: of nine machines as they are it was −0.11 to 0.03, of twelve with numbers that were off 0.04 to 1.23.
const AVOIDABLE: f64 = 0.06;
/// Valleys that are gone into.
const VALLEYS: usize = 2;
/// What another round must take off the misses, and within what valleys are as deep.
const SHALLOW: f64 = 0.005;
/// How often valleys are looked for anew about the best.
const ROUNDS: usize = 4;

/// An answer whose clearance or spring has the numbers that the loop gives it, where those repeat the measured position better and neither torque nor
/// table gainsays them; `None` where it stays as it is. `frame` is what the torque is judged on.
///
/// # Errors
/// [`Stopped`] when the watch's caller said so.
pub fn sharpened(
    axis: &Axis,
    (replays, holdout): (&Replays, Option<&Excerpt>),
    frame: &Frame,
    found: &Diagnosis,
    watch: &Watch,
) -> Result<Option<Diagnosis>, Stopped> {
    // What is believed is not found again, and a spring with play is two.
    let believed = axis.effects.iter().any(|effect| ABOUT_REVERSALS.contains(&effect.cause()));
    let named = matches!(found.verdict, Verdict::Explained | Verdict::PartlyExplained);
    let parts_table = |finding: &&Finding| law(finding.effect.cause()).is_simulated();
    let parting: Vec<&Finding> = found.findings.iter().filter(parts_table).collect();
    let ([parting], true) = (parting.as_slice(), named && !believed) else {
        return Ok(None);
    };
    let cause = parting.effect.cause();
    // How a vibration reaches the motor goes with the spring, and the torque alone tells both.
    let shaken = found.extended.effects.iter().any(|effect| law(effect.cause()).is_shaking());
    if cause == Cause::DriveCompliance && shaken {
        return Ok(None);
    }
    let missed = misses(&replays.known.error, statistics::reading_error(&replays.whole.columns.position));
    if [GIVES, JUDGES].iter().any(|half| mean_of_worse_half(&missed, *half) < ASKED) {
        return Ok(None);
    }
    let without = belief::without(&found.extended, &[cause]);
    let base = belief::base_alone(&without);
    let frame = &frame.believing(&base);
    let told = told(replays, frame, [&found.extended, &without], (parting, found.verdict), watch)?;
    let Some(told) = told else { return Ok(None) };
    let mut stays = found.clone();
    stays.findings.retain(|finding| finding.effect.cause() != cause);
    answered(axis, holdout, frame, (replays, &without), (stays, told), watch)
}

/// The same with the loop's numbers beside the second machine, where they are better than those that the first has.
fn told(
    replays: &Replays,
    frame: &Frame,
    [named, without]: [&Axis; 2],
    (found, verdict): (&Finding, Verdict),
    watch: &Watch,
) -> Result<Option<Told>, Stopped> {
    let Some(start) = Trial::of(frame, &found.effect) else { return Ok(None) };
    let Some((before, unavoidable)) = replays.error_and_unavoidable(named) else { return Ok(None) };
    let misses = replays.misses(&before);
    let avoidable = avoidable(&misses, &unavoidable);
    if mean_of_worse_half(&avoidable, Over::All) < AVOIDABLE {
        return Ok(None);
    }
    let deepest = in_the_deepest_valley(start, frame, without, (replays, &unavoidable), watch)?;
    let Some((half, alike)) = deepest else { return Ok(None) };
    let gained = replays.gained(&misses, &half.error);
    let better = mean(&gained, JUDGES) > 0.0 && strength(&gained, &misses, JUDGES) > LIKELY;
    let by_half = half.trial.on(frame, without).filter(|_| better && !half.trial.is_stopped());
    let Some(by_half) = by_half else { return Ok(None) };
    // Torque and table must not gainsay it by what is predicted of them: behind the measured motor they are the encoder's.
    let gains = gain::where_judged([named, &by_half], replays.recording, &replays.lies_in(JUDGES), watch)?;
    if refuted(&gains, &[]) || gains.iter().any(|gain| gain.channel == "table_position" && gain.ci95[1] < 1.0) {
        return Ok(None);
    }
    let verdict = by_torque(frame, replays, [named, &by_half]).unwrap_or(verdict);
    let Some(all) = half.trial.clone().refined(frame, without, replays, Over::All, f64::INFINITY) else {
        return Ok(None);
    };
    let Some((effect, own)) = all.effect(frame, without) else { return Ok(None) };
    let deviations = half.trial.effect(frame).map_or(own.clone(), |deepest| widened(own, &deepest, &alike));
    // A scale has seen the table itself.
    if frame.columns.table.is_some() && deviations.first() > found.deviations.first() {
        return Ok(None);
    }
    let [missed, left] = [&before, &all.error].map(|error| replays.says(error, frame.axis));
    let note = format!(
        "the numbers of the {} are the closed loop's: replayed with those that the torque gives it typically misses the measured position by {missed}, with these by {left}",
        effect.cause().name()
    );
    let finding = Finding { effect, deviations, ..found.clone() };
    Ok(Some(Told { verdict, finding, note, by_half }))
}

/// The same where one half of the blocks is missed least, of the valleys about where it was, and where that half is missed as little.
/// With the replays comes how far each block is missed whatever the machine: where no more is, no valley is deeper.
pub fn in_the_deepest_valley(
    start: Trial,
    frame: &Frame,
    without: &Axis,
    (replays, unavoidable): (&Replays, &[f64]),
    watch: &Watch,
) -> Result<Option<(Refined, Vec<Effect>)>, Stopped> {
    let missed = |replays: &Replays, error: &[f64]| mean(&replays.misses(error), GIVES);
    let is_deepest =
        |there: &Refined| mean_of_worse_half(&avoidable(&replays.misses(&there.error), unavoidable), GIVES) < AVOIDABLE;
    let into = |place: &Trial| {
        let refined = place.clone().refined(frame, without, replays, GIVES, f64::INFINITY)?;
        Some((missed(replays, &refined.error), refined))
    };
    // Mostly the torque has found the right one, and a few steps lead to its bottom.
    let as_found = into(&start);
    if let Some((_, there)) = as_found.as_ref().filter(|(_, there)| is_deepest(there)) {
        return Ok(Some((there.clone(), Vec::new())));
    }
    let short = replays.beginning();
    let mut bottoms: Vec<(f64, Refined)> = Vec::new();
    for round in 0..ROUNDS {
        let so_far = bottoms.first().map_or(f64::INFINITY, |(missed, _)| *missed);
        let centre = bottoms.first().map_or(&start, |(_, there)| &there.trial);
        let places = centre.about();
        let rated = watch.each(&places, (0.98, 0.985), STAGE, |place| {
            Some((missed(&short, &short.error(&place.on(frame, without)?)?), place.clone()))
        })?;
        let mut rated: Vec<(f64, Trial)> = rated.into_iter().flatten().collect();
        rated.sort_by(|a, b| a.0.total_cmp(&b.0));
        // About the bottom of the deepest valley no place is better as it stands: of 31 searches 30 found nothing more from there on,
        // and the other came deeper as long as one was.
        let of_centre = rated.iter().find(|(_, place)| place.is_at(centre)).map(|(missed, _)| *missed);
        let least = rated.first().map(|(missed, _)| *missed);
        if round > 0 && of_centre.zip(least).is_some_and(|(centre, least)| least >= centre - SHALLOW) {
            break;
        }
        rated.truncate(VALLEYS);
        let there = watch.each(&rated, (0.985, 0.99), STAGE, |(_, place)| {
            if place.is_at(&start) { as_found.clone() } else { into(place) }
        })?;
        bottoms.extend(there.into_iter().flatten());
        bottoms.sort_by(|a, b| a.0.total_cmp(&b.0));
        if bottoms.first().is_none_or(|(missed, there)| *missed >= so_far - SHALLOW || is_deepest(there)) {
            break;
        }
    }
    let least = bottoms.first().map_or(0.0, |(missed, _)| *missed);
    let mut alike = bottoms.into_iter().take_while(|(missed, _)| *missed < least + SHALLOW).map(|(_, there)| there);
    let Some(deepest) = alike.next() else { return Ok(None) };
    Ok(Some((deepest, alike.filter_map(|there| there.trial.effect(frame)).collect())))
}

/// Deviations widened by how far valleys that are as deep lie apart.
fn widened(deviations: Vec<f64>, deepest: &Effect, alike: &[Effect]) -> Vec<f64> {
    let (centre, others) = (deepest.values(), alike.iter().map(Effect::values).collect::<Vec<_>>());
    let apart = |k: usize| others.iter().map(|other| (other[k] - centre[k]).powi(2)).sum::<f64>();
    let count = others.len().max(1) as f64;
    deviations.into_iter().enumerate().map(|(k, own)| own.hypot((apart(k) / count).sqrt())).collect()
}

#[cfg(test)]
mod tests {
    use super::super::tests::{found, recorded, rig};
    use super::*;
    use crate::diagnosis::whole::Whole;

    /// An answer's numbers as the loop has them, of the rig with what is hidden; `None` where they stay as they were.
    fn sharper(hidden: Effect, named: Effect, grid_um: f64) -> Option<Effect> {
        let excerpt = recorded(&[hidden], grid_um);
        let whole = excerpt.columns.as_ref().unwrap();
        let thinned = whole.clone().thinned();
        let base = belief::base_alone(&rig());
        let frame = Frame::new(&base, &thinned, None);
        let before = found(&[named], &frame, whole);
        let (watch, axis) = (Watch::new(&|_, _| true), rig());
        let whole = Whole::new(&axis, whole);
        let replays = Replays::new(&whole, before.replay.as_ref(), &watch)?;
        let after = sharpened(&axis, (&replays, None), &frame, &before, &watch).unwrap()?;
        assert!(after.findings.len() == 1 && after.extended.effects == [after.findings[0].effect]);
        println!("{:?} ± {:?}", after.findings[0].effect, after.findings[0].deviations);
        Some(after.findings[0].effect)
    }

    fn clearance(width_um: f64, table: f64, friction: f64) -> Effect {
        Effect::Backlash {
            width_um,
            table_inertia_share: table,
            table_friction_share: friction,
            contact_hz: 600.0,
            contact_damping_ratio: 0.3,
        }
    }

    #[test]
    fn a_clearance_in_another_valley_is_put_right() {
        let told = sharper(clearance(12.0, 0.45, 0.5), clearance(15.0, 0.36, 0.4), 0.25).unwrap();
        let Effect::Backlash { width_um, table_inertia_share, table_friction_share, .. } = told else { panic!() };
        assert!((width_um / 12.0 - 1.0).abs() < 0.05, "{width_um}");
        assert!((table_inertia_share - 0.45).abs() < 0.02 && (table_friction_share - 0.5).abs() < 0.02, "{told:?}");
    }

    #[test]
    fn a_spring_in_another_valley_is_put_right() {
        // The stiffness goes with the masses.
        let of_one = rig().drive.motor_stiffness(1.0);
        let spring = |resonance_hz: f64, table: f64| {
            let omega = std::f64::consts::TAU * resonance_hz;
            let stiffness_n_um = omega * omega * rig().base.inertia * table * (1.0 - table) / of_one;
            Effect::DriveCompliance {
                resonance_hz,
                stiffness_n_um,
                table_inertia_share: table,
                table_friction_share: 0.5,
                damping_ratio: 0.05,
            }
        };
        let told = sharper(spring(120.0, 0.5), spring(95.0, 0.4), 0.25);
        let Some(Effect::DriveCompliance { resonance_hz, table_inertia_share, .. }) = told else { panic!("{told:?}") };
        assert!((resonance_hz / 120.0 - 1.0).abs() < 0.03 && (table_inertia_share - 0.5).abs() < 0.03, "{told:?}");
    }

    #[test]
    fn numbers_that_are_right_stay() {
        let right = clearance(12.0, 0.45, 0.5);
        if let Some(Effect::Backlash { width_um, table_inertia_share, .. }) = sharper(right, right, 0.25) {
            assert!((width_um / 12.0 - 1.0).abs() < 0.05 && (table_inertia_share - 0.45).abs() < 0.02);
        }
    }
}
