//! Clearance and elastic drive together: the table on a spring that has play. Each by itself turns the table late at a reversal, and
//! either leaves much of what both do: the one pulls from the first instant and ends in a swing, the other lets go and pulls at once.
//!
//! What is simulated is one thing, and what is said of it are two.

use super::drive_compliance::{self, DAMPING, MOST_DAMPING, swinging};
use super::*;
use crate::diagnosis::fit::{Fit, Part};
use crate::machine::TwoMasses;
use std::f64::consts::TAU;

/// Ratio of a start's frequency to the one before, and of the first to that at which the spring by itself loses all of that.
const STEP: f64 = 1.25;
const FIRST: f64 = 1.06;
/// By how much what the table loses may be more or less than the one of them that was found makes it.
const LOSES: [f64; 3] = [0.9, 1.0, 1.1];
/// Fastest swing of half of the inertia that is looked for, Hz: flanks meet harder than that, and what stops here is theirs.
const FASTEST_HZ: f64 = 300.0;
/// Share of play in what is lost that is little.
const LITTLE_PLAY: f64 = 0.04;
/// Most frequencies that are begun with.
const MOST_STARTS: f64 = 30.0;
/// Share of the inertia on the table's side at a start, and those that are tried once the others are about right.
const SHARE: f64 = 0.4;
const SHARES: [f64; 4] = [0.15, 0.3, 0.5, 0.75];

/// Full width in µm; frequency of half of the inertia on the spring, Hz, which is its stiffness; shares of inertia and friction on the
/// table's side, damping ratio of the table's own swing. How far the drive winds up tells stiffness and friction whatever the table's
/// mass.
const SCALES: &[Scale] = &[
    Scale::Log(0.1, 2000.0),
    Scale::Log(2.0, FASTEST_HZ),
    Scale::Linear(0.04, 0.95, 0.01),
    Scale::Linear(0.02, 1.0, 0.01),
    Scale::Log(2e-3, MOST_DAMPING),
];

/// The spring in the numbers of the law of one without play.
fn spring(shape: &[f64]) -> Option<[f64; 4]> {
    let &[_, half_hz, share, friction_share, damping] = shape else { return None };
    Some([half_hz * (0.5 / share).sqrt(), share, friction_share / share, damping])
}

/// The two as they are simulated: a clearance whose flanks meet as softly as the spring is.
pub static LAW: Law = of_both(Cause::Backlash, |frame, shape, _| {
    let &[width_um, half_hz, ..] = shape else { return None };
    // Within three steps of the encoder a turn is no crossing.
    let crosses = width_um > 3e3 * frame.grid && half_hz < 0.95 * FASTEST_HZ;
    both(frame, shape)
        .filter(|_| crosses && spring(shape).is_some_and(|spring| swinging(frame, &spring, &[]).is_some()))
});

/// The clearance and the spring as they are said.
pub static SAID: [Law; 2] = [
    of_both(Cause::Backlash, |_, shape, _| Effect::from_values(Cause::Backlash, shape.get(..1)?)),
    of_both(Cause::DriveCompliance, |frame, shape, _| swinging(frame, &spring(shape)?, &[])),
];

const fn of_both(cause: Cause, effect: fn(&Frame, &[f64], &[f64]) -> Option<Effect>) -> Law {
    Law {
        cause,
        scales: SCALES,
        starts: |_, _| Vec::new(),
        manner: PLAIN,
        terms: Terms::Simulated(both),
        effect,
        confused_with: &[Cause::PreslidingFriction],
        sentence: |_, _| String::new(),
    }
}

/// What stands between motor and table.
fn both(frame: &Frame, shape: &[f64]) -> Option<Effect> {
    let &[width_um, _, table_inertia_share, table_friction_share, _] = shape else { return None };
    let Effect::DriveCompliance { resonance_hz, damping_ratio, .. } = drive_compliance::effect(frame, &spring(shape)?)?
    else {
        return None;
    };
    Some(Effect::Backlash {
        width_um,
        table_inertia_share,
        table_friction_share,
        contact_hz: resonance_hz,
        contact_damping_ratio: damping_ratio,
    })
}

/// Whether a part is the two together.
#[must_use]
pub fn is(part: &Part) -> bool {
    std::ptr::eq(part.law, &raw const LAW)
}

/// The causes that a part stands for.
pub fn causes(part: &Part) -> impl Iterator<Item = Cause> {
    std::iter::once(part.law.cause).chain(is(part).then_some(Cause::DriveCompliance))
}

/// A fit whose clearance with a spring is as it is said: one of the two in the place of both.
#[must_use]
pub fn said_as(fit: &Fit, part: usize, law: &'static Law) -> Fit {
    let mut said = fit.clone();
    said.parts[part].law = law;
    said
}

/// Share of the play in what the table loses at a reversal.
#[must_use]
pub fn share_of_play(frame: &Frame, shape: &[f64]) -> f64 {
    let masses = table_side::split(frame, both(frame, shape));
    masses.map_or(0.5, |masses| masses.clearance / lost(frame, &masses).max(1e-300))
}

/// What the table loses at a reversal: the play, and what the friction that it carries winds up either way.
fn lost(frame: &Frame, masses: &TwoMasses) -> f64 {
    masses.clearance + 2.0 * masses.table_friction_share * frame.belief.coulomb / masses.stiffness
}

/// Starts by what was found of one of the two, with a table of no particular mass. The stiffer the spring the more of what is lost is
/// play.
#[must_use]
pub fn starts(frame: &Frame, found: &TwoMasses) -> Vec<Vec<f64>> {
    let half = 0.5 * frame.belief.inertia;
    let (friction, lost) = (found.table_friction_share * frame.belief.coulomb, lost(frame, found));
    let by_spring_alone = (2.0 * friction / lost / half).sqrt() / TAU;
    let count = ((FASTEST_HZ / by_spring_alone).ln() / STEP.ln()).clamp(1.0, MOST_STARTS) as i32;
    let with = |step: i32, loses: f64| {
        let faster = FIRST * STEP.powi(step);
        let width = loses * lost * (1.0 - faster.powi(-2));
        let width_um = width / frame.axis.drive.motor_per_um();
        vec![width_um, by_spring_alone * faster / loses.sqrt(), SHARE, found.table_friction_share, DAMPING]
    };
    (0..count).flat_map(|step| LOSES.map(|loses| with(step, loses))).collect()
}

/// A clearance as wide, whose flanks meet so hard, in the numbers of its own law.
#[must_use]
pub fn with_hard_flanks(shape: &[f64], hz: f64) -> Option<Vec<f64>> {
    let &[width_um, _, share, friction_share, _] = shape else { return None };
    Some(vec![width_um, share, friction_share, hz])
}

/// A spring with a little play in what it loses; `None` where there is play already.
#[must_use]
pub fn with_little_play(frame: &Frame, spring: &TwoMasses) -> Option<Vec<Vec<f64>>> {
    if spring.clearance > 0.0 {
        return None;
    }
    let &[own_hz, share, rubbing, damping] = table_side::swing_of(spring).as_slice() else { return None };
    // It loses as much, or it swings as fast.
    let with = |softer: f64| {
        let width_um = LITTLE_PLAY * lost(frame, spring) / frame.axis.drive.motor_per_um();
        vec![width_um, own_hz * (share / 0.5 / softer).sqrt(), share, rubbing * share, damping]
    };
    Some([1.0 - LITTLE_PLAY, 1.0].map(with).into())
}

/// The same with other masses of the table.
#[must_use]
pub fn of_any_mass(shape: &[f64]) -> Vec<Vec<f64>> {
    let with = |share: f64| {
        let mut shape = shape.to_vec();
        shape[2] = share;
        shape
    };
    SHARES.map(with).into()
}
