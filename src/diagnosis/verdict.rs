//! What may be said: nothing wrong, these causes, something unknown, or not enough data.
//!
//! `judge` decides what is to be named; here the answer is put together.

use super::belief;
use super::by_loop::{self, Replays};
use super::causes::{LAWS, Law, law, loose_spring};
use super::excerpt::Excerpt;
use super::experiment;
use super::fit::{Bench, Fit};
use super::frame::Frame;
use super::gain::{Gain, Replay};
use super::holdout::Holdout;
use super::judge::{Judge, Judged, misleads, refutation, refuted, shows};
use super::known::Known;
use super::left::{Left, Unexplained, unexplained};
use super::looks;
use super::low_limit;
use super::narrow::{self, Band};
use super::progress::{Progress, Stopped, Watch, on_all_cores};
use super::reopened;
use super::replayed;
use super::rivals;
use super::select::{Search, Selection};
use super::show::{self, View};
use super::suffices::what_is_missing;
use super::twin;
use super::uncertainty::{self, Sure};
use super::whole::Whole;
use crate::analysis::statistics;
use crate::machine::{Axis, Cause, Effect};

/// The five answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// The belief holds.
    NoDiscrepancy,
    /// The causes explain the discrepancy down to the noise.
    Explained,
    /// The causes explain most of it.
    PartlyExplained,
    /// Something is there that no cause fits.
    UnknownCause,
    /// The recording does not suffice.
    InsufficientData,
}

/// One named cause.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// The cause with its parameters.
    pub effect: Effect,
    /// Standard deviation of each parameter.
    pub deviations: Vec<f64>,
    /// 0 to 1.
    pub confidence: f64,
    /// Share of the discrepancy's variance, 0 to 1.
    pub share: f64,
    /// One sentence for a machinist.
    pub evidence: String,
    /// Causes that this recording cannot tell from it.
    pub indistinguishable_from: Vec<Cause>,
    /// Moves (`gib.moves/1`) that would tell, and why.
    pub next_experiment: Option<(serde_json::Value, String)>,
}

impl Finding {
    /// Key, value and standard deviation of each parameter that was found; what a law has as usual was not.
    pub fn parameters(&self, linear: bool) -> impl Iterator<Item = (&'static str, f64, f64)> {
        let usual = self.effect.cause().row().parameters.iter().map(|parameter| parameter.default);
        let found = self.effect.keyed_values(linear).zip(&self.deviations).zip(usual);
        let found = found.filter(|(((_, value), std), usual)| **std > 0.0 || Some(*value) != *usual);
        found.map(|(((key, value), std), _)| (key, value, *std))
    }
}

/// The whole answer.
#[derive(Debug, Clone, PartialEq)]
pub struct Diagnosis {
    /// In a word.
    pub verdict: Verdict,
    /// Named causes, largest share first.
    pub findings: Vec<Finding>,
    /// What the extended machine is worth, a channel each.
    pub gains: Vec<Gain>,
    /// What is left.
    pub unexplained: Unexplained,
    /// The residual against everything it may go with, before and after.
    pub shown: Vec<View>,
    /// What is missing, where the data do not suffice.
    pub missing: Vec<String>,
    /// What a reader must know about how the answer was come by.
    pub notes: Vec<String>,
    /// The axis with its effects.
    pub extended: Axis,
    /// Whether the axis follows what is not explained.
    pub(super) followed: bool,
    /// Causes that a law without a name stands for.
    pub(super) imitated: Vec<Cause>,
    /// A closed loop of that or of its like, as it was replayed.
    pub(super) replay: Option<Replay>,
}

/// Diagnoses an axis on a recording; with a hold-out, the gain is measured there.
///
/// # Errors
/// [`Stopped`] when `progress` answers false.
pub fn diagnose(
    axis: &Axis,
    recording: &Excerpt,
    holdout: Option<&Excerpt>,
    progress: Progress,
) -> Result<Diagnosis, Stopped> {
    on_all_cores(|| answer_to(axis, recording, holdout, &Watch::new(progress)))
}

/// The answer of [`diagnose`].
fn answer_to(axis: &Axis, recording: &Excerpt, holdout: Option<&Excerpt>, watch: &Watch) -> Result<Diagnosis, Stopped> {
    watch.at(0.0, "reading the motion")?;
    let (whole, notes) = match &recording.columns {
        Ok(columns) => (columns, recording.notes.clone()),
        Err(why) => return Ok(insufficient(axis, vec![why.to_string()])),
    };
    if let Err(why) = axis.two_masses() {
        return Ok(insufficient(axis, vec![format!("a machine file that holds together: {why}")]));
    }
    let mut columns = whole.clone().thinned();
    if !belief::parts_table(axis) {
        columns = columns.without_repeated_scale();
    }
    let base = belief::base_alone(axis);
    let first = Frame::new(&base, &columns, None).after_first_swings(axis);
    let missing = what_is_missing(&first);
    if !missing.is_empty() {
        return Ok(Diagnosis { notes, ..insufficient(axis, missing) });
    }
    watch.at(0.05, "reading the motion")?;
    let whole = &Whole::new(axis, whole);
    let recorded = Recorded { axis, belief: axis, whole, holdout, except: &[], watch };
    let mut look = looks::all(&recorded, (&columns, &first), notes.clone())?;
    if look.is_final {
        return watch.at(1.0, "done").map(|()| look.found);
    }
    let made = twin::made_by_sensors(&recorded, (&columns, &first), &look)?;
    if !made.is_empty() {
        let except = Recorded { except: &made, ..recorded };
        look = looks::all(&except, (&columns, &first), notes)?;
        look.found.notes.push(twin::says(&made));
    }
    let (by_first, mut found) = (look.width == first.low_pass.width, look.found);
    // What a quieter look has heard the first does not judge.
    let known = found.replay.clone();
    let replays = Replays::new(whole, known.as_ref(), watch);
    if let Some(replays) = replays.as_ref().filter(|_| by_first) {
        if let Some(sharper) = by_loop::sharpened(axis, (replays, holdout), &first, &found, watch)? {
            return watch.at(1.0, "done").map(|()| sharper);
        }
        found = by_loop::settled(found, replays, &first, holdout.is_some());
    }
    let found = by_loop::completed(axis, (replays.as_ref(), holdout), &first, found, watch)?;
    watch.at(1.0, "done").map(|()| found)
}

/// What an answer is about beside the equations.
#[derive(Clone, Copy)]
pub(super) struct Recorded<'d> {
    pub axis: &'d Axis,
    /// What of the axis is taken for granted.
    pub belief: &'d Axis,
    pub whole: &'d Whole<'d>,
    pub holdout: Option<&'d Excerpt>,
    /// What is not looked for.
    pub except: &'d [Cause],
    pub watch: &'d Watch<'d>,
}

impl Recorded<'_> {
    /// Whether a cause is looked for.
    #[must_use]
    pub fn may_be_found(&self, cause: Cause) -> bool {
        belief::may_be_found(self.belief, cause) && !self.except.contains(&cause)
    }
}

/// The answer on one system of equations; on aligned ones where the torque column turns out to be late by its sampling.
pub(super) fn answer(recorded: &Recorded, frame: &Frame, notes: Vec<String>) -> Result<Diagnosis, Stopped> {
    let bench = Bench::new(frame, &Known::of(recorded.belief, frame));
    let found = answer_on(recorded, &bench, None, notes.clone())?;
    let Recorded { axis, belief, .. } = recorded;
    if axis == belief && !axis.effects.is_empty() {
        let named: Vec<Effect> = found.findings.iter().map(|finding| finding.effect).collect();
        let misjudged = reopened::without_misjudged(axis, &bench, &found, recorded.watch)?;
        let to_leave_less = misjudged.is_some() && !named.is_empty();
        if let Some(belief) = &misjudged.or_else(|| reopened::without_found_again(axis, frame, &named)) {
            let again = answer(&Recorded { belief, ..*recorded }, frame, notes.clone())?;
            let more = to_leave_less && again.unexplained.torque.rms > found.unexplained.torque.rms;
            if !again.findings.is_empty() && !more {
                return Ok(again);
            }
        }
    }
    let open = matches!(found.verdict, Verdict::UnknownCause | Verdict::PartlyExplained)
        && recorded.may_be_found(Cause::ExternalVibration);
    if let Some(band) = open.then(|| narrow::band(&bench)).flatten() {
        let beside = bench.beside_lines(&band.columns);
        let again = answer_on(recorded, &beside, Some(&band), notes)?;
        let named = matches!(again.verdict, Verdict::Explained | Verdict::PartlyExplained);
        let [without_it, beside_it] = [&found, &again].map(|answer| answer.unexplained.torque.rms);
        if named && band.is_left_by_others(&bench, without_it, beside_it) {
            return Ok(again);
        }
    }
    Ok(found)
}

/// The answer on these equations, beside a vibration that they leave free.
fn answer_on(
    recorded: &Recorded,
    bench: &Bench,
    vibration: Option<&Band>,
    mut notes: Vec<String>,
) -> Result<Diagnosis, Stopped> {
    let &Recorded { axis, belief, whole, holdout, watch, .. } = recorded;
    let frame = bench.frame;
    let empty = bench.fit(Vec::new());
    let laws: Vec<&'static Law> = LAWS.iter().copied().filter(|law| recorded.may_be_found(law.cause)).collect();
    let judge = || Ok(Judge::new([axis, belief], whole, bench, watch));
    let (judge, search) = watch.both(judge, || Search::new(bench, &laws, watch))?;
    let found = search.from_belief()?;
    if let Some(late_s) = uncertainty::late_by_sampling(bench, &found.fit) {
        return aligned(recorded, frame, late_s, notes);
    }
    let mut judged = judge.judge(found)?;
    if judged.verdict == Verdict::UnknownCause {
        // Of several numbers of the belief that are wrong together none shows the way by itself.
        let found = search.from_open_belief()?;
        if let Some(late_s) = uncertainty::late_by_sampling(bench, &found.fit) {
            return aligned(recorded, frame, late_s, notes);
        }
        let again = judge.judge(found)?;
        if again.verdict == Verdict::UnknownCause {
            judged.refutation = judged.refutation.or(again.refutation);
        } else {
            judged = again;
        }
    }
    judged = low_limit::or_else(judged, (&judge, bench), &laws, watch)?;
    notes.extend(judged.refutation.take().or(judged.nearest.take()));
    let replayed = replayed::refined(bench, judge.held_out(), &judged, watch)?;
    let sure = replayed.map(|replayed| {
        judged.selection.fit = replayed.fit;
        replayed.sure
    });
    let mut findings = findings(belief, bench, &judged.selection, sure.as_ref(), &empty);
    let mut extended = extended_by(belief, &findings);
    if let Some(holdout) = holdout {
        match holdout.columns.as_ref().map(|columns| Holdout::new(axis, columns)) {
            Ok(Some(rows)) => {
                notes.extend(holdout.notes.iter().map(|note| format!("hold-out: {note}")));
                let [gains, in_judged_rows] = rows.gains(axis, &extended, watch)?;
                judged.gains = gains;
                let effects: Vec<Effect> = findings.iter().map(|f| f.effect).collect();
                let fails = misleads(judged.verdict, &in_judged_rows) || refuted(&in_judged_rows, &effects);
                if shows(&in_judged_rows) && fails {
                    let causes = findings.iter().map(|f| f.effect.cause());
                    notes.push(refutation(causes, &in_judged_rows, "the hold-out"));
                    judged = judge.nothing(&judged.selection);
                    (findings, extended) = (Vec::new(), axis.clone());
                    [judged.gains, _] = rows.gains(axis, axis, watch)?;
                } else if !shows(&in_judged_rows) {
                    if let Some((verdict, note)) = rows.beside_more(judged.verdict, &extended, frame.sampling) {
                        judged.verdict = verdict;
                        notes.push(note);
                    }
                }
            }
            why => {
                let why = why.err().map_or_else(|| "no stretch of it is whole".to_owned(), |e| e.to_string());
                notes.push(format!(
                    "the hold-out cannot be used ({why}); the gain is measured on held-out blocks instead"
                ));
            }
        }
    }
    let Judged { mut verdict, selection: Selection { fit, .. }, gains, replay, followed, imitated, .. } = judged;
    notes.extend(nameless(frame, &fit));
    if let Some(band) = vibration {
        verdict = band.beside(bench, verdict, &fit);
        notes.push(join(band, bench, &mut findings, axis, &fit));
    }
    let shown = show::views(bench, vibration.map_or(&empty, |band| &band.before), &fit);
    let unexplained = unexplained(bench, &fit, &shown, whole.columns.table.is_some());
    Ok(Diagnosis {
        verdict,
        findings,
        gains,
        unexplained,
        shown,
        missing: Vec::new(),
        notes,
        extended,
        followed,
        imitated,
        replay,
    })
}

/// Puts a vibration among what was found beside it, largest share first, and says what a machine file cannot have of it.
fn join(band: &Band, bench: &Bench, findings: &mut Vec<Finding>, axis: &Axis, fit: &Fit) -> String {
    let all = band.before.squares();
    let rest = band.after.squares() / all;
    findings.iter_mut().for_each(|finding| finding.share *= rest);
    findings.push(Finding {
        effect: band.effect,
        deviations: band.deviations.clone(),
        confidence: confidence(block_t(bench, &band.before, &band.after)),
        share: (1.0 - fit.squares() / all - findings.iter().map(|f| f.share).sum::<f64>()).clamp(0.0, 1.0),
        evidence: (law(Cause::ExternalVibration).sentence)(&band.effect, axis),
        indistinguishable_from: Vec::new(),
        next_experiment: None,
    });
    findings.sort_by(|a, b| b.share.total_cmp(&a.share));
    "the vibration comes and goes with a phase of its own, which no machine file repeats: it is not in the extended machine".to_owned()
}

/// The answer with the torque column moved up by what its sampling may have made it late.
fn aligned(recorded: &Recorded, frame: &Frame, late_s: f64, mut notes: Vec<String>) -> Result<Diagnosis, Stopped> {
    notes.push(format!(
        "the torque column is {:.3} ms {} against the position column, and was moved: without a servo block nobody knows how its rows are sampled, and half a row may be that",
        1e3 * late_s.abs(),
        if late_s > 0.0 { "late" } else { "early" }
    ));
    answer(recorded, &frame.aligned_by(late_s), notes)
}

fn extended_by(axis: &Axis, findings: &[Finding]) -> Axis {
    let effects: Vec<Effect> = findings.iter().map(|f| f.effect).collect();
    belief::extended(axis, &effects)
}

fn insufficient(axis: &Axis, missing: Vec<String>) -> Diagnosis {
    Diagnosis {
        verdict: Verdict::InsufficientData,
        findings: Vec::new(),
        gains: Vec::new(),
        unexplained: Unexplained {
            torque: Left { rms: 0.0, noise_rms: 0.0, describes: "not judged".into() },
            table: None,
        },
        shown: Vec::new(),
        missing,
        notes: Vec::new(),
        extended: axis.clone(),
        followed: false,
        imitated: Vec::new(),
        replay: None,
    }
}

fn findings(axis: &Axis, bench: &Bench, selection: &Selection, sure: Option<&Sure>, empty: &Fit) -> Vec<Finding> {
    let fit = &selection.fit;
    let mut effects = uncertainty::effects(bench, fit, sure);
    uncertainty::widen(bench, &mut effects, &selection.alike);
    let found =
        effects.into_iter().enumerate().filter_map(|(i, found)| found.map(|(effect, std)| (i, 1.0, effect, std)));
    let mut found: Vec<(usize, f64, Effect, Vec<f64>)> = found.collect();
    // A clearance with a spring is one part, and two causes.
    if let Some(at) = found.iter().position(|(i, ..)| loose_spring::is(&fit.parts[*i])) {
        let (i, ..) = found.swap_remove(at);
        let play = loose_spring::share_of_play(bench.frame, &fit.parts[i].shape);
        for (law, share) in loose_spring::SAID.iter().zip([play, 1.0 - play]) {
            let said = uncertainty::effects(bench, &loose_spring::said_as(fit, i, law), sure).swap_remove(i);
            found.extend(said.map(|(effect, std)| (i, share, effect, std)));
        }
    }
    belief::reconcile_sure(bench.frame.axis, found.iter_mut().map(|(.., effect, std)| (effect, std)));
    let whole = belief::extended(axis, &found.iter().map(|(.., effect, _)| *effect).collect::<Vec<_>>());
    found.iter_mut().for_each(|(.., effect, deviations)| belief::at_the_table(&whole, effect, deviations));
    let total = 1.0 - (fit.squares() / empty.squares()).min(1.0);
    let drops: Vec<f64> =
        (0..fit.parts.len()).map(|i| (bench.without(fit, i).squares() - fit.squares()).max(0.0)).collect();
    let sum = drops.iter().sum::<f64>().max(1e-300);
    let mut list: Vec<Finding> = Vec::new();
    for (i, share, effect, deviations) in found {
        let law: &Law = law(effect.cause());
        let ties = ties(bench, selection, i);
        list.push(Finding {
            evidence: (law.sentence)(&belief::together(axis, effect), bench.frame.axis),
            confidence: confidence(block_t(bench, &bench.without(fit, i), fit)),
            share: (share * drops[i] / sum * total).clamp(0.0, 1.0),
            next_experiment: ties.first().map(|other| experiment::telling(bench.frame, effect.cause(), *other)),
            indistinguishable_from: ties,
            effect: belief::together(axis, effect),
            deviations,
        });
    }
    list.sort_by(|a, b| b.share.total_cmp(&a.share));
    list
}

/// What is to be said of parts whose parameters no machine has: others were found beside them, and would not have been without.
fn nameless(frame: &Frame, fit: &Fit) -> Option<String> {
    let pairs = fit.parts.iter().zip(&fit.coefficients);
    let beyond = pairs.filter(|(part, c)| part.law.effect(frame, &part.shape, c).is_none());
    let causes: Vec<&str> = beyond.map(|(part, _)| part.law.cause.name()).collect();
    (!causes.is_empty()).then(|| {
        format!(
            "beside what is named something looks like {}, but with parameters that no machine has: it is not named, and not in the extended machine",
            causes.join(" and ")
        )
    })
}

/// Probability that a cause's gain is not chance: its Student's t over blocks, as a normal's tail.
#[must_use]
pub fn confidence(t: f64) -> f64 {
    // Logistic approximation of the normal distribution.
    (1.0 / (1.0 + (-1.702 * t).exp())).clamp(0.0, 0.9999)
}

/// Mean over scatter of the blocks' gains, times √blocks.
#[must_use]
pub fn block_t(bench: &Bench, less: &Fit, full: &Fit) -> f64 {
    let blocks = &bench.frame.blocks;
    let gains: Vec<f64> = blocks
        .windows(2)
        .map(|w| {
            let square = |fit: &Fit| {
                let torque: f64 = fit.residual[w[0]..w[1]].iter().map(|r| r * r).sum();
                let table = fit.residual.get(w[0] + bench.rows..w[1] + bench.rows).unwrap_or(&[]);
                torque + table.iter().map(|r| r * r).sum::<f64>()
            };
            square(less) - square(full)
        })
        .collect();
    statistics::strength(&gains)
}

/// Causes that take the place of a part without a difference that the blocks bear out.
fn ties(bench: &Bench, selection: &Selection, part: usize) -> Vec<Cause> {
    let fit = &selection.fit;
    let own = fit.parts[part].law.cause;
    let others: Vec<Cause> = fit.parts.iter().flat_map(loose_spring::causes).collect();
    let mut list = Vec::new();
    for rival in selection.rivals.iter().filter(|rival| rivals::is_alike(bench, rival, fit)) {
        let strange: Vec<Cause> = rival.parts.iter().map(|p| p.law.cause).filter(|c| !others.contains(c)).collect();
        let lacks_own = !rival.parts.iter().any(|p| p.law.cause == own);
        match strange.as_slice() {
            [other] if lacks_own && !list.contains(other) => list.push(*other),
            _ => (),
        }
    }
    list
}
