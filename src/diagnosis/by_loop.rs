//! What only the closed loop tells.
//!
//! A servo answers all that its axis does, and the position shows it to a few steps of the encoder. A small clearance, friction that
//! builds up over some micrometres, or a motor that gives less at its peak act in few rows, which the low-pass of the torque smears. The
//! replayed loop then misses the measured position by many steps of the encoder. Where it does, each cause is tried in the loop itself:
//! with numbers that one half of the recording gives it must explain much of what is missed in the other half, and the torque must not
//! gainsay it. What acts in all rows the torque tells as well, and better: the loop is so keen that a thousandth of the friction shows,
//! which no law holds to. Such causes are tried as rivals alone. A servo that is another one than is believed is no cause of the
//! vocabulary, and none explains what it makes.

mod changed;
mod equations;
mod itself;
mod promising;
mod replays;
mod sharper;
mod trial;

pub(super) use itself::settled;
pub(super) use replays::Replays;
pub(super) use sharper::sharpened;

use super::belief;
use super::causes::{ABOUT_REVERSALS, LAWS, Law, law};
use super::excerpt::Excerpt;
use super::experiment;
use super::fit::Bench;
use super::frame::Frame;
use super::gain;
use super::holdout::Holdout;
use super::judge::{refuted, shows};
use super::known::Known;
use super::left::unexplained;
use super::missed::{GIVES, JUDGES, LEAST_EXPLAINED, NOTHING, Over, avoidable, is_much, mean, misses, strength};
use super::progress::{Stopped, Watch};
use super::select::LEAST_STRENGTH;
use super::show;
use super::verdict::{Diagnosis, Finding, Verdict, confidence};
use crate::analysis::statistics;
use crate::machine::{Axis, Cause, Effect};
use crate::plant::observed::Observed;
use itself::by_torque;
use promising::promising;
use trial::{Refined, Trial, starts};

/// [`LEAST_EXPLAINED`] where the torque is left with much that no cause explains; a clearance or a spring that explains less may lie in
/// another valley than that to which its start led.
const MOSTLY: f64 = 0.6;
/// Mean over scatter of what it gains in each block, times √blocks, as many as there are ([`strength`]).
const SURELY: f64 = 3.0;
/// Share of the best cause's gain from which on another one is not told from it, and may itself be the one.
const ALIKE: f64 = 0.8;
/// What a cause in the place of one that the torque names may leave missed of what it leaves beside that: fewer causes that do about as
/// well are the simpler answer.
const ALIKE_LEFT: f64 = 1.1;
/// Share of what is enough that some steps of refining must have taken off for more to be made.
const HOPE: f64 = 0.25;

const STAGE: &str = "asking the closed loop";

/// An answer with what only the loop tells beside it, where its machine was replayed; `frame` is what the torque is judged on.
///
/// # Errors
/// [`Stopped`] when the watch's caller said so.
pub fn completed(
    axis: &Axis,
    (replays, holdout): (Option<&Replays>, Option<&Excerpt>),
    frame: &Frame,
    found: Diagnosis,
    watch: &Watch,
) -> Result<Diagnosis, Stopped> {
    let about = |cause: &Cause| ABOUT_REVERSALS.contains(cause);
    let named: Vec<Cause> = found.findings.iter().map(|finding| finding.effect.cause()).filter(about).collect();
    let believed: Vec<&Effect> = axis.effects.iter().filter(|effect| about(&effect.cause())).collect();
    // Where more of these are there the loop misses by what their numbers are off by, for which another stands in.
    let Some(replays) = replays.filter(|_| believed.len() + named.len() <= 1) else { return Ok(found) };
    let floor = statistics::reading_error(&replays.whole.columns.position);
    if !is_much(&misses(&replays.known.error, floor)) {
        return Ok(found);
    }
    let Some(missed) = Missed::by(&found.extended, replays) else { return Ok(found) };
    if let [believed] = believed.as_slice() {
        return changed::corrected(axis, (replays, holdout), frame, (found, believed, &missed), watch);
    }
    let asked = |dropped: &[Cause]| -> Result<Option<(f64, Told)>, Stopped> {
        let without = belief::without(&found.extended, dropped);
        let base = belief::base_alone(&without);
        let machines = [&found.extended, &without];
        let frame = frame.believing(&base);
        let named = |law: &Law| without.effects.iter().any(|effect| effect.cause() == law.cause);
        let open = LAWS.iter().copied().filter(|law| belief::may_be_found(axis, law.cause) && !named(law));
        let trials = open.flat_map(|law| starts(&frame, law)).collect();
        let told = told(trials, replays, &frame, (&missed, machines), watch)?;
        Ok(told.filter(|(_, told)| !dropped.contains(&told.finding.effect.cause())))
    };
    // One that the torque names may stand in for another, and gives way to that. Friction that rises at low speed the torque shows in many
    // rows, so that it may be there beside another as well, and in its place only what may stand beside it is tried.
    let best = if named == [Cause::StribeckFriction] {
        match asked(&[])? {
            Some((beside, told)) => {
                let in_place = asked(&named)?.filter(|(missed, _)| *missed < ALIKE_LEFT * beside);
                Some(in_place.map_or((told, &[][..]), |(_, told)| (told, named.as_slice())))
            }
            None => None,
        }
    } else {
        asked(&named)?.map(|(_, told)| (told, named.as_slice()))
    };
    if let Some((told, dropped)) = best {
        let without = belief::without(&found.extended, dropped);
        let mut stays = found.clone();
        stays.findings.retain(|finding| !dropped.contains(&finding.effect.cause()));
        let rest = 1.0 - stays.findings.iter().map(|finding| finding.share).sum::<f64>().min(1.0);
        let told = Told { finding: Finding { share: rest * told.finding.share, ..told.finding }, ..told };
        let base = belief::base_alone(&without);
        let frame = &frame.believing(&base);
        if let Some(retold) = answered(axis, holdout, frame, (replays, &without), (stays, told), watch)? {
            return Ok(retold);
        }
    }
    let note = note_of_miss(axis, &found, replays.recording.0, &replays.says(&missed.error, axis));
    let notes = found.notes.iter().cloned().chain(note).collect();
    Ok(Diagnosis { notes, ..found })
}

/// What is said of a miss that no cause explains beside an answer that says nothing is left. Between rows that are further apart than
/// cycles the command may have gone any way.
fn note_of_miss(axis: &Axis, found: &Diagnosis, observed: &Observed, missed: &str) -> Option<String> {
    let nothing_left = matches!(found.verdict, Verdict::NoDiscrepancy | Verdict::Explained);
    let is_known = axis.servo.as_ref().is_some_and(|servo| observed.is_a_row_a_cycle(servo));
    (nothing_left && is_known).then(|| {
        format!("no cause explains by how much the closed loop of this machine, replayed, typically misses the measured position: {missed}. Its servo may be another than is believed, or something acts that the torque does not show")
    })
}

/// By how much the replayed loop of a machine misses the measured position where that is much, and more than the encoder makes it miss.
struct Missed {
    error: Vec<f64>,
    misses: Vec<f64>,
    unavoidable: Vec<f64>,
}

impl Missed {
    fn by(machine: &Axis, replays: &Replays) -> Option<Self> {
        let (error, unavoidable) = replays.error_and_unavoidable(machine)?;
        let misses = replays.misses(&error);
        let beyond: Vec<f64> = avoidable(&misses, &unavoidable).iter().map(|miss| miss + NOTHING).collect();
        (is_much(&misses) && is_much(&beyond)).then_some(Self { error, misses, unavoidable })
    }
}

/// The answer that stays with what the loop tells beside its machine; `None` where a hold-out refutes that.
fn answered(
    axis: &Axis,
    holdout: Option<&Excerpt>,
    frame: &Frame,
    (replays, without): (&Replays, &Axis),
    (mut stays, told): (Diagnosis, Told),
    watch: &Watch,
) -> Result<Option<Diagnosis>, Stopped> {
    let extended = belief::extended(without, &[told.finding.effect]);
    let elsewhere = holdout.and_then(|holdout| Holdout::new(axis, holdout.columns.as_ref().ok()?));
    let gains = match elsewhere {
        Some(rows) => {
            let [gains, in_judged_rows] = rows.gains(axis, &extended, watch)?;
            if shows(&in_judged_rows) && refuted(&in_judged_rows, &extended.effects) {
                return Ok(None);
            }
            gains
        }
        None => gain::where_judged([axis, &told.by_half], replays.recording, &replays.lies_in(JUDGES), watch)?,
    };
    let base = belief::base_alone(&extended);
    let frame = &frame.believing(&base);
    let bench = Bench::new(frame, &Known::of(&extended, frame));
    let left = bench.fit(Vec::new());
    let with_scale = replays.recording.0.table_position.is_some();
    let unexplained = unexplained(&bench, &left, &show::views(&bench, &left, &left), with_scale);
    stays.notes.push(told.note);
    stays.findings.push(told.finding);
    stays.findings.sort_by(|a, b| b.share.total_cmp(&a.share));
    Ok(Some(Diagnosis { verdict: told.verdict, gains, unexplained, extended, ..stays }))
}

/// What the loop tells.
struct Told {
    verdict: Verdict,
    finding: Finding,
    /// What a reader is told of how it was found.
    note: String,
    /// The machine with it by numbers from one half of the recording.
    by_half: Axis,
}

/// Which of these causes the loop tells beside the second machine, and better than the first does, which misses by so much; and what is
/// missed still, by numbers from one half of the blocks in the other.
fn told(
    trials: Vec<Trial>,
    replays: &Replays,
    frame: &Frame,
    (Missed { error: before, misses, unavoidable }, [named, extended]): (&Missed, [&Axis; 2]),
    watch: &Watch,
) -> Result<Option<(f64, Told)>, Stopped> {
    let best = promising(trials, &replays.beginning(), frame, extended, watch)?;
    let avoidable = avoidable(misses, unavoidable);
    let enough = |over| LEAST_EXPLAINED * mean(&avoidable, over);
    let hopeful = mean(misses, GIVES) - HOPE * enough(GIVES);
    let refine = |trial: Trial| {
        let refined = trial.refined(frame, extended, replays, GIVES, hopeful)?;
        let gained = replays.gained(misses, &refined.error);
        Some((mean(&gained, JUDGES), gained, refined))
    };
    let refine_all = |some: &[Trial]| -> Result<Vec<(f64, Vec<f64>, Refined)>, Stopped> {
        let refined = watch.each(some, (0.99, 0.995), STAGE, |trial| refine(trial.clone()))?;
        Ok(refined.into_iter().flatten().collect())
    };
    // What acts in proportion is a rival alone: it need not be refined beside nothing that may be told.
    let (rivals, candidates): (Vec<Trial>, Vec<Trial>) = best.into_iter().partition(Trial::promises);
    let mut refined = refine_all(&candidates)?;
    let may_be_told = |(gain, gained, there): &(f64, Vec<f64>, Refined)| {
        let may_gain = *gain >= enough(JUDGES) || there.trial.law.is_simulated();
        may_gain && strength(gained, misses, JUDGES) > SURELY
    };
    if !refined.iter().any(may_be_told) {
        return Ok(None);
    }
    refined.extend(refine_all(&rivals)?);
    refined.sort_by(|a, b| b.0.total_cmp(&a.0));
    // A clearance may be found where a spring was meant, whose starts end below what rows show.
    let spring = refined.first().and_then(|(gain, _, best)| Some((*gain, best.trial.as_spring(frame, extended)?)));
    if let Some((gain, spring)) = spring.and_then(|(gain, spring)| Some((gain, refine(spring)?))) {
        refined.retain(|(.., other)| other.trial.law.cause != Cause::DriveCompliance || spring.0 < ALIKE * gain);
        refined.insert(usize::from(spring.0 < ALIKE * gain), spring);
    }
    if let Some((gain, gained, half)) = refined.first_mut() {
        let leaves_much = *gain < MOSTLY * mean(&avoidable, JUDGES);
        if leaves_much && half.trial.law.is_simulated() && strength(gained, misses, JUDGES) > SURELY {
            let deepest =
                sharper::in_the_deepest_valley(half.trial.clone(), frame, extended, (replays, unavoidable), watch)?;
            if let Some((deepest, _)) = deepest {
                *gained = replays.gained(misses, &deepest.error);
                (*gain, *half) = (mean(gained, JUDGES), deepest);
            }
        }
    }
    let Some((gain, gained, half)) = refined.first() else { return Ok(None) };
    let may_be_named =
        refined.iter().take_while(|other| other.0 > ALIKE * gain).all(|other| other.2.trial.has_a_name());
    let explains = may_be_named
        && *gain >= enough(JUDGES)
        && strength(gained, misses, JUDGES) > SURELY
        && half.trial.acts_in_few_rows(frame)
        && !half.trial.is_stopped();
    let Some(by_half) = half.trial.on(frame, extended).filter(|_| explains) else { return Ok(None) };
    let verdict = match by_torque(frame, replays, [named, &by_half]) {
        Some(Verdict::PartlyExplained) if *gain < MOSTLY * mean(&avoidable, JUDGES) => return Ok(None),
        Some(verdict) => verdict,
        None => return Ok(None),
    };
    let alike = refined[1..].iter().filter(|other| other.0 > ALIKE * gain);
    let alike: Vec<Cause> = alike.map(|other| other.2.trial.law.cause).collect();
    let Some(whole) = half.trial.clone().refined(frame, extended, replays, Over::All, f64::INFINITY) else {
        return Ok(None);
    };
    let Some((effect, deviations)) = whole.effect(frame, extended) else { return Ok(None) };
    if effect.values()[0].abs() < LEAST_STRENGTH * deviations[0] {
        return Ok(None);
    }
    let cause = effect.cause();
    let finding = Finding {
        effect,
        deviations,
        confidence: confidence(strength(gained, misses, JUDGES)),
        share: 1.0 - (-2.0 * gain).exp(),
        evidence: (law(cause).sentence)(&effect, frame.axis),
        next_experiment: alike.first().map(|other| experiment::telling(frame, cause, *other)),
        indistinguishable_from: alike,
    };
    let [missed, left] = [before, &whole.error].map(|error| replays.says(error, frame.axis));
    let [so, without, with] = if named.effects.iter().any(|effect| effect.cause() == cause) {
        ["is not as it is believed to be, which is", "as it is believed to be", "as it was found"]
    } else {
        ["is", "without it", "with it"]
    };
    let note = format!(
        "{} {so} told by the closed loop, not by the torque: replayed {without} the loop typically misses the measured position by {missed}, {with} by {left}",
        cause.name()
    );
    Ok(Some((mean(misses, JUDGES) - gain, Told { verdict, finding, note, by_half })))
}

#[cfg(test)]
pub(in crate::diagnosis) mod tests {
    use super::*;
    use crate::diagnosis::frame::Columns;
    use crate::diagnosis::gain::HeldOut;
    use crate::diagnosis::left::{Left, Unexplained};
    use crate::diagnosis::missed::BLOCKS;
    use crate::diagnosis::whole::Whole;
    use crate::machine::Machine;
    use crate::plant::moves::{Moves, Reach};
    use crate::plant::simulate::{Sensors, Setup, simulate};
    use crate::recording::{Column, Recording};

    /// The rig of the demonstration.
    pub(in crate::diagnosis) fn rig() -> Axis {
        Machine::parse(include_str!("../../examples/machines/believed.json")).unwrap().axes.remove(0)
    }

    /// What a recorder sees of the rig with effects, behind an encoder of this grid.
    pub(in crate::diagnosis) fn recorded(effects: &[Effect], grid_um: f64) -> Excerpt {
        recorded_over("test", effects, [grid_um, 0.3])
    }

    /// The same of other moves, with this grid, µm, and this noise of the torque, N·m.
    pub(in crate::diagnosis) fn recorded_over(moves: &str, effects: &[Effect], sensors: [f64; 2]) -> Excerpt {
        let reach = Reach { start: 20.0, stroke: 200.0, speed: 250.0, acceleration: 2500.0 };
        let mut command = Moves::built_in(moves, &reach).unwrap().command(1e-3);
        command.truncate(20_000);
        let sensors = Sensors { grid_um: sensors[0], torque_noise: sensors[1], ..Sensors::default() };
        let truth = rig().with_effects(effects.to_vec());
        let trace = simulate(&truth, &command, &Setup { seed: 1, sensors, ..Setup::default() }).unwrap();
        let columns = vec![
            Column::new("x.position_command_mm", trace.command),
            Column::new("x.position_mm", trace.position),
            Column::new("x.torque_nm", trace.torque),
        ];
        Excerpt::of(&Recording::from_columns("simulated", trace.time_s, columns).unwrap(), &rig())
    }

    /// An answer that has found these effects of the rig, before the loop is asked.
    pub(super) fn found(effects: &[Effect], frame: &Frame, whole: &Columns) -> Diagnosis {
        let extended = rig().with_effects(effects.to_vec());
        let bench = Bench::new(frame, &Known::of(&extended, frame));
        let watch = Watch::new(&|_, _| true);
        let errors = HeldOut::new([&extended, &extended], &Whole::new(&extended, whole), &bench, &watch).believed();
        let named = |&effect: &Effect| Finding {
            effect,
            deviations: vec![0.0; effect.values().len()],
            confidence: 0.99,
            share: 1.0 / effects.len() as f64,
            evidence: String::new(),
            indistinguishable_from: Vec::new(),
            next_experiment: None,
        };
        Diagnosis {
            verdict: if effects.is_empty() { Verdict::NoDiscrepancy } else { Verdict::Explained },
            findings: effects.iter().map(named).collect(),
            gains: Vec::new(),
            unexplained: Unexplained {
                torque: Left { rms: 0.0, noise_rms: 0.0, describes: String::new() },
                table: None,
            },
            shown: Vec::new(),
            missing: Vec::new(),
            notes: Vec::new(),
            extended,
            followed: false,
            imitated: Vec::new(),
            replay: errors.unwrap().replay,
        }
    }

    /// What the loop adds to an answer that found nothing.
    fn told(effects: &[Effect]) -> Vec<Effect> {
        told_beside(&[], &recorded(effects, 0.05))
    }

    /// What it makes of an answer that found these.
    fn told_beside(named: &[Effect], excerpt: &Excerpt) -> Vec<Effect> {
        answer_beside(&rig(), named, excerpt).findings.iter().map(|finding| finding.effect).collect()
    }

    /// The same by a belief that has effects itself.
    pub(super) fn answer_beside(belief: &Axis, named: &[Effect], excerpt: &Excerpt) -> Diagnosis {
        let whole = excerpt.columns.as_ref().unwrap();
        let (base, thinned) = (belief::base_alone(belief), whole.clone().thinned());
        let frame = Frame::new(&base, &thinned, None);
        let mut silent = found(&[&belief.effects, named].concat(), &frame, whole);
        silent.findings.retain(|finding| named.contains(&finding.effect));
        let (watch, replay, whole) = (Watch::new(&|_, _| true), silent.replay.clone(), Whole::new(belief, whole));
        let replays = Replays::new(&whole, replay.as_ref(), &watch);
        completed(belief, (replays.as_ref(), None), &frame, silent, &watch).unwrap()
    }

    pub(in crate::diagnosis) fn clearance(width_um: f64) -> Effect {
        Effect::Backlash {
            width_um,
            table_inertia_share: 0.4,
            table_friction_share: 0.6,
            contact_hz: 600.0,
            contact_damping_ratio: 0.3,
        }
    }

    #[test]
    fn a_clearance_that_the_torque_does_not_show_is_told() {
        let told = told(&[clearance(5.0)]);
        let [Effect::Backlash { width_um, .. }] = told.as_slice() else { panic!("{told:?}") };
        assert!((width_um / 5.0 - 1.0).abs() < 0.1, "{width_um}");
    }

    #[test]
    fn a_clearance_beside_friction_that_rises_at_low_speed_is_told() {
        let slow = Effect::StribeckFriction { torque: 0.2, velocity_mm_s: 12.0, exponent: 2.0 };
        let told = told_beside(&[slow], &recorded(&[slow, clearance(4.0)], 0.05));
        let [stays, Effect::Backlash { width_um, .. }] = told.as_slice() else { panic!("{told:?}") };
        assert_eq!(*stays, slow);
        assert!((width_um / 4.0 - 1.0).abs() < 0.1, "{width_um}");
        assert_eq!(told_beside(&[slow], &recorded(&[slow], 0.05)), [slow]);
    }

    #[test]
    fn friction_that_rises_only_where_the_axis_creeps_is_told() {
        let hidden = Effect::StribeckFriction { torque: 0.5, velocity_mm_s: 1.0, exponent: 2.0 };
        let told = told_beside(&[], &recorded_over("sweep", &[hidden], [0.05, 0.3]));
        let [Effect::StribeckFriction { torque, velocity_mm_s, .. }] = told.as_slice() else { panic!("{told:?}") };
        assert!((torque / 0.5 - 1.0).abs() < 0.1 && (velocity_mm_s - 1.0).abs() < 0.1, "{told:?}");
    }

    #[test]
    fn friction_that_builds_up_is_told() {
        let hidden =
            Effect::PreslidingFriction { displacement_um: 4.0, exponent: 1.0, maxwell_slip: 0.0, micro_damping_s: 0.0 };
        let told = told(&[hidden]);
        let [Effect::PreslidingFriction { displacement_um, .. }] = told.as_slice() else { panic!("{told:?}") };
        assert!((displacement_um / 4.0 - 1.0).abs() < 0.1, "{displacement_um}");
    }

    /// A move in each of four blocks, and rests between: what such an axis shows it shows there.
    #[test]
    fn blocks_in_which_an_axis_rests_speak_against_no_cause() {
        let moves: Vec<usize> = (0..BLOCKS).filter(|block| JUDGES.has(*block)).step_by(6).collect();
        let of_blocks = |there: &[f64], else_: f64| {
            let of = |block| moves.iter().position(|at| *at == block).map_or(else_, |at| there[at]);
            (0..BLOCKS).map(of).collect::<Vec<f64>>()
        };
        let misses = of_blocks(&[2.9, 2.5, 2.6, 2.2], NOTHING);
        assert!(strength(&of_blocks(&[2.4, 2.0, 1.7, 1.8], 0.0), &misses, JUDGES) > SURELY);
        assert!(strength(&of_blocks(&[2.4, 2.0, 0.1, -1.8], 0.0), &misses, JUDGES) < 1.0);
    }

    #[test]
    fn what_acts_in_all_rows_is_the_torques_to_tell() {
        assert_eq!(told(&[]), []);
        assert_eq!(told(&[Effect::CoulombFrictionMismatch { torque: 0.95 }]), []);
        assert_eq!(told(&[Effect::StribeckFriction { torque: 0.5, velocity_mm_s: 60.0, exponent: 2.0 }]), []);
        // Of a thirtieth of the friction nobody knows where it goes.
        assert_eq!(told(&[Effect::StribeckFriction { torque: 0.02, velocity_mm_s: 1.0, exponent: 2.0 }]), []);
    }
}
