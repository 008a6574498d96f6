//! Whether a set of causes is to be named.
//!
//! The noise floor is read off the residual itself (second differences, in which slow structure is gone). What lies above it
//! is the excess. Causes are named only when together they remove most of the excess; a set of causes that leaves much of
//! it is an imitation of something that is not in the vocabulary, and is not named. Nor is one whose machine predicts rows
//! that were held out worse than the belief: laws that lean on each other, or on the noise of the encoder that they are
//! driven by, may explain what was measured and yet make a wrong machine.

use super::belief;
use super::contact;
use super::fit::{Bench, Fit};
use super::followed::{self, is_followed};
use super::foreign;
use super::formulation::by_position;
use super::frame::Frame;
use super::gain::{self, Errors, Gain, HeldOut, Replay};
use super::known::Known;
use super::progress::{Stopped, Watch};
use super::rivals;
use super::select::Selection;
use super::shared;
use super::show::{self, Coordinate};
use super::steady;
use super::verdict::Verdict;
use super::whole::Whole;
use crate::machine::{Axis, Cause, Effect};
use crate::plant::physics::LEAST_SLOPE;

/// Excess over the noise floor (in variance) below which a belief holds.
pub const TOLERABLE_EXCESS: f64 = 0.6;
/// The same of what is tied to no coordinate: noise of a current that was filtered over some rows is up to twice what second
/// differences see of it, and what no move calls up is no machine's doing before that.
const TOLERABLE_IF_UNTIED: f64 = 3.0;
/// Share of the excess that named causes must remove together.
const LEAST_EXPLAINED: f64 = 0.8;
/// The same where they leave little, and nothing of the curve that they follow: the floor does not see all that an encoder's grid makes.
const LEAST_EXPLAINED_OF_LITTLE: f64 = 0.6;
/// The same where what they leave may be noise.
const LEAST_EXPLAINED_OF_NOISE: f64 = 0.4;
/// The same for lost motion: rigid flanks that meet without rebound place a clearance well, but not each impact.
const LEAST_EXPLAINED_LOST_MOTION: f64 = 0.4;
/// Excess (in variance) that may be left for everything to count as explained.
pub const LITTLE_LEFT: f64 = 0.5;

/// Share of what is explained above which it is mostly a curve over one coordinate.
const MOSTLY: f64 = 2.0 / 3.0;
/// Share of what is explained (in variance) that may be left along that coordinate: a sixth in amplitude. Laws of the right form
/// leave a thirtieth of that, harmonics that are too weak to be named included, and real slides more; several of a wrong form
/// together imitate a curve, and leave more than that.
pub const MOST_OF_A_CURVE: f64 = 0.03;

/// Least ratio of what a machine errs by without causes over what it errs by with them for a channel to show them. In the balance
/// a cause must take 4 % off the amplitude of what is left; a row as it was measured holds more noise.
const LEAST_RATIO: f64 = 1.02;

/// What stays the same while sets of causes are judged.
pub struct Judge<'j, 'f, 'a> {
    bench: &'j Bench<'f, 'a>,
    watch: &'j Watch<'j>,
    held_out: HeldOut<'j, 'f, 'a>,
    /// The fit without a cause, and its errors on held-out blocks.
    empty: Fit,
    believed: Option<Errors>,
}

/// What may be said.
#[derive(Debug)]
pub struct Judged {
    /// In a word.
    pub verdict: Verdict,
    /// The causes that are named: none where the verdict names none.
    pub selection: Selection,
    /// What they are worth on held-out blocks.
    pub gains: Vec<Gain>,
    /// A closed loop of what is named, or of the belief, that was replayed there, where one was.
    pub replay: Option<Replay>,
    /// What explains the recording and is not named all the same.
    pub refutation: Option<String>,
    /// What explains some of it, where nothing explains enough.
    pub nearest: Option<String>,
    /// Whether the axis follows what is not explained, see [`is_followed`].
    pub followed: bool,
    /// Causes that a law without a name stands for.
    pub imitated: Vec<Cause>,
}

impl<'j, 'f, 'a> Judge<'j, 'f, 'a> {
    /// A judge of what is found on a bench about an axis, and beside what is kept of it; `whole` is the recording, every row.
    #[must_use]
    pub fn new(axes: [&'j Axis; 2], whole: &'j Whole, bench: &'j Bench<'f, 'a>, watch: &'j Watch<'j>) -> Self {
        let (held_out, empty) = (HeldOut::new(axes, whole, bench, watch), bench.fit(Vec::new()));
        let believed = held_out.believed();
        Self { bench, watch, held_out, empty, believed }
    }

    /// What the sets are judged on.
    #[must_use]
    pub fn held_out(&self) -> &HeldOut<'j, 'f, 'a> {
        &self.held_out
    }

    /// Judges a set of causes.
    ///
    /// # Errors
    /// [`Stopped`] when the watch's caller said so.
    pub fn judge(&self, mut found: Selection) -> Result<Judged, Stopped> {
        let kept = self.held_out.kept();
        if let Some(without) = shared::left_out(self.bench, kept, &found.fit) {
            (found.fit, found.alike) = (without, Vec::new());
        }
        let Some(mut verdict) = self.explains(&found.fit) else { return Ok(self.too_little(&found)) };
        let goes = || match foreign::bends_table(self.bench, &self.empty, &found.fit) {
            None => foreign::stands_for(self.bench, &self.empty, &found.fit, self.watch),
            bent => Ok(bent),
        };
        // Mostly no such law stands for it, and what comes next takes as long.
        let settled = || {
            let settled = contact::settled(self.bench, &self.held_out, found.clone(), self.watch)?;
            Ok((self.without_spring(&settled.fit), self.errors(&settled.fit)?, settled))
        };
        let (goes, (mut less, mut errors, settled)) = self.watch.both(goes, settled)?;
        if let Some(goes) = goes {
            let imitated = found.fit.parts.iter().map(|part| part.law.cause).collect();
            return Ok(Judged { refutation: Some(imitation(&found.fit, goes)), imitated, ..self.nothing(&found) });
        }
        found = settled;
        // Below the noise floor there is nothing but what the encoder makes, which drives the simulation too.
        if let Some(less) = less.take_if(|less| Excess::of(self.bench, less, &found.fit).largest() <= 0.0) {
            (found.fit, found.alike) = (less, Vec::new());
            let Some(still) = self.explains(&found.fit) else { return Ok(self.too_little(&found)) };
            (verdict, errors) = (still, self.errors(&found.fit)?);
        }
        if let Some(less) = less {
            let without = self.errors(&less)?;
            let mut gains = self.held_out.gains(without.as_ref(), errors.as_ref());
            gains.retain(|gain| gain.channel != "table_position");
            gains.extend(gain::of_stretch(without.as_ref(), errors.as_ref()));
            if is_idle(&gains) {
                (found.fit, found.alike, errors) = (less, Vec::new(), without);
                let Some(still) = self.explains(&found.fit) else { return Ok(self.too_little(&found)) };
                verdict = still;
            }
        }
        (found, errors) = rivals::settled(self.bench, &self.held_out, (found, errors), self.watch)?;
        if let Some(of_bristle) = &errors {
            let bristle = (&found.fit, of_bristle);
            if let Some((fit, its)) = by_position::told(self.bench, &self.held_out, bristle, self.watch)? {
                (found.fit, found.alike, errors) = (fit, Vec::new(), Some(its));
            }
        }
        let mut weighed = self.weighed(&found.fit, errors.as_ref(), verdict);
        if let (true, Some(unsteady)) = (weighed.fails, &errors) {
            if let Some((fit, its)) = steady::damped(self.bench, &self.held_out, (&found.fit, unsteady), self.watch)? {
                weighed = self.weighed(&fit, Some(&its), verdict);
                (found.fit, errors) = (fit, Some(its));
            }
        }
        let Weighed { gains, in_judged_rows, fails } = weighed;
        if !fails {
            // On a bound its numbers are as sure as torque and loop have them; beyond it nothing tells them.
            found.fit = self.bench.within_bounds(found.fit);
            let replay = errors.and_then(|errors| errors.replay);
            return Ok(Judged {
                verdict,
                selection: found,
                gains,
                replay,
                refutation: None,
                nearest: None,
                followed: false,
                imitated: Vec::new(),
            });
        }
        let causes = found.fit.parts.iter().map(|p| p.law.cause);
        let refutation = refutation(causes, &in_judged_rows, "rows that it was not fitted to");
        Ok(Judged { refutation: Some(refutation), ..self.nothing(&found) })
    }

    /// What held-out rows say of a set of causes by its errors there.
    fn weighed(&self, fit: &Fit, errors: Option<&Errors>, verdict: Verdict) -> Weighed {
        let gains = self.held_out.gains(self.believed.as_ref(), errors);
        let in_judged_rows = self.held_out.judged_gains(self.believed.as_ref(), errors);
        let effects: Vec<Effect> = fit.effects(self.bench.frame).collect();
        let fails = misleads(verdict, &in_judged_rows) || refuted(&in_judged_rows, &effects);
        Weighed { gains, in_judged_rows, fails }
    }

    /// Errors of a set on held-out blocks.
    fn errors(&self, fit: &Fit) -> Result<Option<Errors>, Stopped> {
        if fit.parts.is_empty() { Ok(self.believed.clone()) } else { self.held_out.errors(fit) }
    }

    /// A set without what is simulated behind the measured motion (a spring, a clearance), where that may gain by taking off what
    /// the encoder's noise makes alone: half of a channel's rest is never that.
    fn without_spring(&self, fit: &Fit) -> Option<Fit> {
        let less = self.bench.refine(self.bench.without(fit, fit.table()?), 0, 4);
        (!fit.halves(&less)).then_some(less)
    }

    /// What is to be said when none of the causes that were found is to be named.
    #[must_use]
    pub fn nothing(&self, found: &Selection) -> Judged {
        let before = Excess::of(self.bench, &self.empty, &found.fit);
        let above = before.largest() > TOLERABLE_EXCESS;
        let untied = above && may_be_noise(self.bench, &self.empty, &before);
        let followed = above && self.is_followed();
        let unknown = above && (followed || !untied);
        Judged {
            verdict: if unknown { Verdict::UnknownCause } else { Verdict::NoDiscrepancy },
            selection: Selection { fit: self.empty.clone(), rivals: Vec::new(), alike: Vec::new() },
            gains: self.held_out.gains(self.believed.as_ref(), self.believed.as_ref()),
            replay: self.believed.as_ref().and_then(|errors| errors.replay.clone()),
            refutation: None,
            nearest: (followed && untied).then(|| followed::SAYS.to_owned()),
            followed,
            imitated: Vec::new(),
        }
    }

    /// Whether the axis follows what the belief leaves of the torque.
    fn is_followed(&self) -> bool {
        let misses = self.believed.as_ref().and_then(|errors| self.held_out.misses(errors));
        misses.is_some_and(|[time_s, error, position]| is_followed(self.bench, &self.empty, time_s, error, position))
    }

    /// The same where they do not explain enough: that is said of an unknown cause.
    fn too_little(&self, found: &Selection) -> Judged {
        let nothing = self.nothing(found);
        let after = Excess::of(self.bench, &found.fit, &found.fit);
        let share = Excess::of(self.bench, &self.empty, &found.fit).explained_by(&after);
        let says = nothing.verdict == Verdict::UnknownCause && !found.fit.parts.is_empty();
        let nearest = says.then(|| too_little(&found.fit, share)).or(nothing.nearest);
        Judged { nearest, ..nothing }
    }

    /// How well a set of causes explains the excess; `None` where it does not, or none of them can be named.
    fn explains(&self, fit: &Fit) -> Option<Verdict> {
        let before = Excess::of(self.bench, &self.empty, fit);
        let after = Excess::of(self.bench, fit, fit);
        let lost_motion = fit.parts.iter().any(|p| p.law.cause == Cause::Backlash);
        let much_left = after.largest() > LITTLE_LEFT;
        let another_curve = is_another_curve(self.bench, &self.empty, fit);
        let noise = may_be_noise(self.bench, fit, &after);
        let least = if lost_motion {
            LEAST_EXPLAINED_LOST_MOTION
        } else if noise {
            LEAST_EXPLAINED_OF_NOISE
        } else if !much_left && !another_curve {
            LEAST_EXPLAINED_OF_LITTLE
        } else {
            LEAST_EXPLAINED
        };
        let too_little = before.largest() > TOLERABLE_EXCESS && before.explained_by(&after) < least;
        let nameless = fit.effects(self.bench.frame).next().is_none();
        if nameless || too_little || much_left && another_curve {
            None
        } else if much_left && !(noise && is_coloured(self.bench, fit)) {
            Some(Verdict::PartlyExplained)
        } else {
            Some(Verdict::Explained)
        }
    }
}

/// Whether what a fit leaves above the noise floor may be noise that the floor does not see.
fn may_be_noise(bench: &Bench, fit: &Fit, left: &Excess) -> bool {
    let rows = bench.rows as f64;
    let untied = || left.of_channel(0) <= TOLERABLE_IF_UNTIED && !show::is_tied(bench, fit, rows);
    left.of_channel(1) <= TOLERABLE_EXCESS && (untied() || is_coloured(bench, fit))
}

/// Whether what a fit leaves of the torque is noise of the first order, and goes with nothing.
#[must_use]
pub fn is_coloured(bench: &Bench, fit: &Fit) -> bool {
    let [rest, _] = bench.rest(fit);
    bench.frame.independent_rows(&rest).is_some_and(|rows| !show::is_tied(bench, fit, rows))
}

/// Asks something of what a machine leaves of a frame.
pub fn left_by<R>(axis: &Axis, frame: &Frame, ask: impl FnOnce(&Bench, &Fit) -> R) -> R {
    let base = belief::base_alone(axis);
    let frame = frame.believing(&base);
    let bench = Bench::new(&frame, &Known::of(axis, &frame));
    ask(&bench, &bench.fit(Vec::new()))
}

/// By how much a machine leaves more than noise of a frame; `None` where all may be noise.
#[must_use]
pub fn beyond_noise(axis: &Axis, frame: &Frame) -> Option<f64> {
    left_by(axis, frame, |bench, left| {
        let excess = Excess::of(bench, left, left);
        let noise = excess.largest() <= TOLERABLE_IF_UNTIED || may_be_noise(bench, left, &excess);
        (!noise).then(|| excess.largest())
    })
}

/// Mean square of what a fit leaves of the torque, and that of its noise.
#[must_use]
pub fn squares_and_noise(bench: &Bench, fit: &Fit) -> [f64; 2] {
    [bench.certain_rms(fit)[0], bench.noise_left(fit)[0]].map(|rms| rms * rms)
}

/// Whether what is explained is mostly a curve over speed, or along the stroke, and is not that curve: too much of it is left.
fn is_another_curve(bench: &Bench, empty: &Fit, fit: &Fit) -> bool {
    use Cause::*;
    let speed =
        [CoulombFrictionMismatch, ViscousFrictionMismatch, StribeckFriction, QuadraticDrag, DirectionDependentFriction];
    let curves: [(Coordinate, &[Cause]); 2] =
        [(Coordinate::Velocity, &speed), (Coordinate::Position, &[Cogging, CableForce, PositionDependentFriction])];
    let squares = |fit: &Fit| fit.residual[..bench.rows].iter().map(|r| r * r).sum::<f64>();
    let (left, explained) = (squares(fit), squares(empty) - squares(fit));
    explained > 0.0
        && curves.into_iter().any(|(coordinate, causes)| {
            let laws = (0..fit.parts.len()).filter(|&i| causes.contains(&fit.parts[i].law.cause));
            let mut curve = vec![0.0; bench.rows];
            laws.for_each(|i| curve.iter_mut().zip(fit.contribution(i)).for_each(|(sum, c)| *sum += c));
            curve.iter().map(|c| c * c).sum::<f64>() > MOSTLY * explained
                && show::share_along(bench, fit, coordinate) * left > MOST_OF_A_CURVE * explained
        })
}

/// Whether a machine is no better than the belief: worse in torque and motor position together, and surely so in one of them
/// or surely better in none. The simulated table carries the motor's error along, with which what the table does may happen to
/// go; without a closed loop it goes behind the measured motor and counts as the motor would. A motor that delivers nothing beyond a level cannot say by its motion how far beyond it was driven: no better torque can
/// be asked of its machine.
#[must_use]
pub fn refuted(gains: &[Gain], causes: &[Effect]) -> bool {
    let silent =
        |cause: &Effect| matches!(cause, Effect::TorqueSaturation { slope_ratio, .. } if *slope_ratio < LEAST_SLOPE);
    let silent = causes.iter().any(silent);
    let moved = if gains.iter().any(|gain| gain.channel == "position") { "position" } else { "table_position" };
    let motor = || gains.iter().filter(|gain| gain.channel == moved || !silent && gain.channel != "table_position");
    let surely_better = silent || gains.iter().any(|gain| gain.ci95[0] > 1.0);
    let surely_worse = motor().any(|gain| gain.ci95[1] < 1.0);
    motor().map(|gain| (gain.before / gain.after).ln()).sum::<f64>() < 0.0 && (surely_worse || !surely_better)
}

/// Whether a machine that leaves much moves worse than the belief by rows that it was not fitted to.
#[must_use]
pub fn misleads(verdict: Verdict, gains: &[Gain]) -> bool {
    verdict == Verdict::PartlyExplained && moves_worse(gains)
}

/// Whether a machine surely moves worse than the belief under its servo, by what can be seen. What is right as far as it goes may leave
/// much, and moves no worse for it; what stands in for something else follows the torque and not what made it.
fn moves_worse(gains: &[Gain]) -> bool {
    let worse = |gain: &Gain| gain.ci95[1] < 1.0 && gain.after > LEAST_RATIO * gain.before;
    gains.iter().any(|gain| gain.channel == "position" && worse(gain))
}

/// Whether a hold-out shows in any channel what the causes change: one whose moves do not call them up says nothing of them.
#[must_use]
pub fn shows(gains: &[Gain]) -> bool {
    gains.iter().any(|gain| (gain.before / gain.after).ln().abs() > LEAST_RATIO.ln())
}

/// Whether the machine is worse with a cause, or moves worse, or is not known to be better in any channel by what can be seen: what such
/// a cause gains in the balance is none of the machine's.
fn is_idle(gains: &[Gain]) -> bool {
    let better = |gain: &Gain| gain.ci95[0] > 1.0 && gain.before > LEAST_RATIO * gain.after;
    !gains.is_empty() && !gains.iter().any(better) || moves_worse(gains) || refuted(gains, &[])
}

/// Says what imitates a law that has no name.
fn imitation(fit: &Fit, goes: &str) -> String {
    format!("{} would explain much, but what is there goes {goes}, for which gib has no name", with_each_other(fit))
}

/// Says what explains this share of what lies above the noise, and not enough of it or not by its own curve.
fn too_little(fit: &Fit, share: f64) -> String {
    let percent = (100.0 * share).clamp(0.0, 99.0);
    format!(
        "{} would explain {percent:.0} % of what lies above the noise and leave what the cause itself would not: it imitates something else and is not named",
        with_each_other(fit)
    )
}

fn with_each_other(fit: &Fit) -> String {
    fit.parts.iter().map(|part| part.law.cause.name()).collect::<Vec<_>>().join(" with ")
}

/// Says what causes are refuted, and by which rows.
#[must_use]
pub fn refutation(causes: impl Iterator<Item = Cause>, gains: &[Gain], rows: &str) -> String {
    let causes: Vec<&str> = causes.map(Cause::name).collect();
    let ratios: Vec<String> = gains.iter().map(|g| format!("{} {:.2}", g.channel, g.before / g.after)).collect();
    format!(
        "{} would explain the recording, but predicts {rows} worse than the belief does (error before over after: {}): it imitates something else and is not named",
        causes.join(" with "),
        ratios.join(", ")
    )
}

/// What held-out rows say of a set of causes.
struct Weighed {
    gains: Vec<Gain>,
    in_judged_rows: Vec<Gain>,
    /// Its machine is not to be taken.
    fails: bool,
}

/// Variance above the noise floor, a channel each, in units of the floor's variance.
pub struct Excess {
    channels: Vec<f64>,
}

impl Excess {
    /// The excess of a fit; the floor is that of the best fit. Where what is believed may be off, that much is no excess.
    #[must_use]
    pub fn of(bench: &Bench, fit: &Fit, best: &Fit) -> Excess {
        let channels = bench.certain_rms(fit).into_iter().zip(bench.noise_left(best)).filter(|(_, noise)| *noise > 0.0);
        Excess { channels: channels.map(|(rms, noise)| (rms / noise).powi(2) - 1.0).collect() }
    }

    /// What a machine leaves on a system of equations.
    #[must_use]
    pub fn of_machine(axis: &Axis, frame: &Frame) -> Excess {
        left_by(axis, frame, |bench, left| Excess::of(bench, left, left))
    }

    /// Of the worse channel.
    #[must_use]
    pub fn largest(&self) -> f64 {
        self.channels.iter().copied().fold(0.0, f64::max)
    }

    /// Of the torque, or of table − encoder.
    #[must_use]
    pub fn of_channel(&self, channel: usize) -> f64 {
        self.channels.get(channel).copied().unwrap_or(0.0)
    }

    /// Share of this excess that is gone in the other, over the channels that had any.
    fn explained_by(&self, after: &Excess) -> f64 {
        let pairs = self.channels.iter().zip(&after.channels).filter(|(a, _)| **a > TOLERABLE_EXCESS);
        let (before, left) = pairs.fold((0.0, 0.0), |(b, l), (x, y)| (b + x, l + y.max(0.0)));
        if before > 0.0 { 1.0 - left / before } else { 1.0 }
    }
}

/// Root of the mean square; 0 of nothing.
#[must_use]
pub fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_motor_that_delivers_nothing_beyond_its_limit_is_not_refuted_by_torque() {
        let gain =
            |channel, ratio: f64| Gain { channel, before: ratio, after: 1.0, ci95: [0.99 * ratio, 1.01 * ratio] };
        let saturation = |slope_ratio| [Effect::TorqueSaturation { limit: 4.0, slope_ratio }];
        let (worse, better) = (gain("torque", 0.9), gain("torque", 1.1));
        assert!(refuted(std::slice::from_ref(&worse), &saturation(0.3)) && !refuted(&[better], &saturation(0.3)));
        assert!(!refuted(std::slice::from_ref(&worse), &saturation(0.0)));
        assert!(refuted(&[worse, gain("position", 0.9)], &saturation(0.0)));
    }

    #[test]
    fn a_position_that_is_surely_worse_by_nothing_that_can_be_seen_refutes_nothing() {
        let position =
            |ratio: f64| Gain { channel: "position", before: ratio, after: 1.0, ci95: [0.999 * ratio, 1.001 * ratio] };
        assert!(moves_worse(&[position(0.95)]) && !moves_worse(&[position(0.995)]) && !moves_worse(&[position(1.1)]));
        assert!(!moves_worse(&[Gain { channel: "torque", ..position(0.5) }]));
    }

    #[test]
    fn a_hold_out_that_does_not_call_up_a_cause_says_nothing_of_it() {
        let gain = |ratio: f64| Gain { channel: "torque", before: ratio, after: 1.0, ci95: [ratio, ratio] };
        assert!(!shows(&[gain(0.9999), gain(1.01)]) && shows(&[gain(1.0), gain(0.9)]) && shows(&[gain(1.1)]));
    }
}
