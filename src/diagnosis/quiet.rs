//! A quieter look at the same rows.
//!
//! A servo answers the noise of its encoder, and what it makes of that is true torque, which the axis follows by less than the encoder
//! shows: torque and acceleration differ by much that is fast and cancels out within some rows. A low-pass of twice the width takes half
//! of the rows and leaves a third of such noise or less, while of white noise it leaves 0.7. What is slow, as a wrong mass, a ripple or
//! a drift, then shows that was lost in it; what is fast no longer does, and is looked for first.

use super::belief;
use super::causes::ABOUT_REVERSALS;
use super::fit::Bench;
use super::frame::Frame;
use super::known::Known;
use super::select::{LEAST_GAIN, LEAST_STRENGTH};
use super::verdict::{Diagnosis, Verdict};
use crate::machine::{Axis, Cause};

/// Share of the noise that a low-pass of twice the width leaves at most for it to be worth it.
const QUIETER: f64 = 0.5;
/// How often the width is doubled at most.
pub const MOST: usize = 3;

/// Whether a quieter look is worth it after such an answer.
#[must_use]
pub fn may_hide_more(found: &Diagnosis) -> bool {
    matches!(found.verdict, Verdict::NoDiscrepancy | Verdict::Explained | Verdict::UnknownCause)
}

/// The width of a low-pass that is twice as wide.
#[must_use]
pub fn wider(frame: &Frame) -> usize {
    2 * frame.low_pass.width + 1
}

/// Whether a wider frame promises more than an answer so far: its noise is quieter by more than white noise would be, and it holds more
/// than that beside what was found.
#[must_use]
pub fn promises(wide: &Frame, frame: &Frame, found: &Diagnosis) -> bool {
    let base = belief::base_alone(&found.extended);
    let [wide, frame] = [wide, frame].map(|frame| frame.believing(&base));
    let [quiet, usual] = [&wide, &frame].map(|frame| Bench::new(frame, &Known::of(&found.extended, frame)));
    let left = quiet.channels(&quiet.measured)[0];
    quiet.floors[0] < QUIETER * usual.floors[0] && (found.verdict == Verdict::UnknownCause || left > 1.0 + LEAST_GAIN)
}

/// What acts about reversals only, or in instants: the low-pass smears it as it does the balance itself.
fn is_fast(cause: Cause) -> bool {
    ABOUT_REVERSALS.contains(&cause) || cause == Cause::DeadTime
}

/// Whether something that is fast is believed.
fn believes_fast(axis: &Axis) -> bool {
    axis.effects.iter().any(|effect| is_fast(effect.cause()))
}

/// Whether a quieter look has found what the look before has not: causes that explain all where none fitted, or more of them than it
/// had, or something that no cause fits and that the axis follows where there seemed to be nothing. Causes that a law without a name stands
/// for by the look before it does not bring back. What is fast it does not add: there it stands in for what the low-pass smears. Nor does it doubt a belief that has something fast:
/// what a low-pass smears of that is no cause.
#[must_use]
pub fn finds_more(axis: &Axis, again: &Diagnosis, before: &Diagnosis) -> bool {
    let (found, known) = (causes(again), causes(before));
    let mut more = found.iter().filter(|cause| !known.contains(cause)).peekable();
    let slow = more.peek().is_some() && more.all(|cause| !is_fast(*cause));
    if again.followed && again.verdict == Verdict::UnknownCause {
        return before.verdict == Verdict::NoDiscrepancy;
    }
    let doubts = before.verdict == Verdict::NoDiscrepancy && believes_fast(axis);
    let imitated = found.iter().all(|cause| before.imitated.contains(cause));
    again.verdict == Verdict::Explained
        && is_sure(again)
        && !doubts
        && !imitated
        && (before.verdict == Verdict::UnknownCause || slow && known.iter().all(|cause| found.contains(cause)))
}

/// Whether a look that explains all and a quieter one that may leave a little find the same causes: together they are believed what is
/// fast as well, unless something of the kind is believed: what a low-pass smears of that looks like other numbers of it.
#[must_use]
pub fn agree(axis: &Axis, one: &Diagnosis, other: &Diagnosis) -> bool {
    let sorted = |diagnosis: &Diagnosis| {
        let mut list = causes(diagnosis);
        list.sort();
        list
    };
    let named = matches!(other.verdict, Verdict::Explained | Verdict::PartlyExplained);
    !believes_fast(axis) && one.verdict == Verdict::Explained && named && is_sure(one) && sorted(one) == sorted(other)
}

/// Whether a delay that is named is known to be one, with all that its interval holds: what a servo makes of the grid of its encoder, and
/// the sampling that nobody knows.
fn is_sure(diagnosis: &Diagnosis) -> bool {
    let delays = diagnosis.findings.iter().filter(|finding| finding.effect.cause() == Cause::DeadTime);
    delays
        .flat_map(|delay| delay.effect.values().into_iter().zip(&delay.deviations))
        .all(|(value, deviation)| value.abs() > LEAST_STRENGTH * deviation)
}

fn causes(diagnosis: &Diagnosis) -> Vec<Cause> {
    diagnosis.findings.iter().map(|finding| finding.effect.cause()).collect()
}
