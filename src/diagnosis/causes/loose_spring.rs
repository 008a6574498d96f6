//! Clearance and elastic drive together: the table on a spring that has play. Each by itself turns the table late at a reversal, and
//! either leaves much of what both do: the one pulls from the first instant and ends in a swing, the other lets go and pulls at once.
//!
//! What is simulated is one thing, and what is said of it are two.

use super::drive_compliance::{self, DAMPING, MOST_DAMPING, OWN_HZ, RUBBING, swinging};
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
/// Share of the inertia on the table's side at a start.
const SHARE: f64 = 0.4;
/// How much faster the table swings at further starts, how much more is wound up at others, and the most of the friction that the table
/// carries.
const SWINGS: [f64; 4] = [0.6, 1.0, 1.4, 2.1];
const WOUND_UP: [f64; 4] = [0.4, 2.5, 6.0, 15.0];
const MOST_CARRIED: f64 = 0.9;

/// How much heavier the tables of other valleys are.
const MASSES: [f64; 8] = [0.7, 0.8, 0.88, 0.94, 1.06, 1.13, 1.25, 1.4];

const WIDTH_UM: Scale = Scale::Log(0.1, 2000.0);
const TABLE: Scale = Scale::Linear(0.04, 0.95, 0.01);
const DAMPED: Scale = Scale::Log(2e-3, MOST_DAMPING);

/// The two as they are simulated: a clearance whose flanks meet as softly as the spring is. Full width in µm, and the spring in the numbers
/// of its own law: the table moves by its own frequency and by its friction over its mass, and what the motor feels of that goes with
/// its mass.
pub static LAW: Law = Law {
    manner: Manner { valleys: other_masses, ..PLAIN },
    ..of_both(SCALES, Cause::Backlash, both, |frame, shape, _| {
        // Within three steps of the encoder a turn is no crossing.
        let crosses = *shape.first()? > 3e3 * frame.grid && half_hz(shape) < 0.95 * FASTEST_HZ;
        both(frame, shape).filter(|_| crosses && swinging(frame, &shape[1..], &[]).is_some())
    })
};

const SCALES: &[Scale] = &[WIDTH_UM, OWN_HZ, TABLE, RUBBING, DAMPED];

/// The same for sums over many swings, which tell how much is lost at a reversal: that in µm, the share of the play in it, shares of
/// inertia and friction on the table's side, damping ratio of the table's own swing.
pub static LOST: Law = of_both(
    &[WIDTH_UM, Scale::Linear(0.02, 0.995, 0.01), TABLE, Scale::Linear(0.02, 1.0, 0.01), DAMPED],
    Cause::Backlash,
    |frame, lost| both(frame, &swinging_at(frame, lost, 1.0)?),
    |_, _, _| None,
);

/// The clearance and the spring as they are said.
pub static SAID: [Law; 2] = [
    of_both(SCALES, Cause::Backlash, both, |_, shape, _| Effect::from_values(Cause::Backlash, shape.get(..1)?)),
    of_both(SCALES, Cause::DriveCompliance, both, |frame, shape, _| swinging(frame, shape.get(1..)?, &[])),
];

type Simulated = fn(&Frame, &[f64]) -> Option<Effect>;

const fn of_both(
    scales: &'static [Scale],
    cause: Cause,
    simulated: Simulated,
    effect: fn(&Frame, &[f64], &[f64]) -> Option<Effect>,
) -> Law {
    Law {
        cause,
        scales,
        starts: |_, _| Vec::new(),
        manner: PLAIN,
        terms: Terms::Simulated(simulated),
        effect,
        confused_with: &[Cause::PreslidingFriction],
        sentence: |_, _| String::new(),
    }
}

/// Lighter and heavier tables on the same spring with the same play, under the same friction: what is lost is theirs, too, and the impacts
/// make the sum of squares rugged over their mass.
fn other_masses(shape: &[f64]) -> Vec<Vec<f64>> {
    let &[width_um, own_hz, share, rubbing, damping] = shape else { return Vec::new() };
    let heavier = MASSES.into_iter().filter(|heavier| share * heavier < MOST_CARRIED);
    heavier
        .flat_map(|heavier: f64| {
            [damping, DAMPING]
                .map(|damped| vec![width_um, own_hz / heavier.sqrt(), share * heavier, rubbing / heavier, damped])
        })
        .collect()
}

/// The frequency of half of the inertia on the spring, Hz.
fn half_hz(shape: &[f64]) -> f64 {
    shape[1] * (shape[2] / 0.5).sqrt()
}

/// What stands between motor and table.
fn both(frame: &Frame, shape: &[f64]) -> Option<Effect> {
    let Effect::DriveCompliance { resonance_hz, table_inertia_share, table_friction_share, damping_ratio, .. } =
        drive_compliance::effect(frame, shape.get(1..)?)?
    else {
        return None;
    };
    Some(Effect::Backlash {
        width_um: *shape.first()?,
        table_inertia_share,
        table_friction_share,
        contact_hz: resonance_hz,
        contact_damping_ratio: damping_ratio,
    })
}

/// What is lost as the table's law has it, of a table that swings faster by its friction over its mass: as much is wound up.
fn swinging_at(frame: &Frame, lost: &[f64], faster: f64) -> Option<Vec<f64>> {
    let &[lost_um, play, share, friction_share, damping] = lost else { return None };
    let wound_up = lost_um * (1.0 - play) * frame.axis.drive.motor_per_um();
    let own = (2.0 * friction_share * frame.belief.coulomb / wound_up / (share * frame.belief.inertia)).sqrt();
    let rubbing = friction_share / share * faster * faster;
    let share = share.min(MOST_CARRIED / rubbing);
    (own > 0.0 && own.is_finite()).then(|| vec![lost_um * play, own / TAU * faster, share, rubbing, damping])
}

/// What is lost as much, in the numbers of the table's law: behind tables that swing otherwise, of which more or less is wound up, and
/// whose swing lasts. A table that bounces goes another way after each impact, one that is damped does not.
#[must_use]
pub fn losing(frame: &Frame, lost: &[f64]) -> Vec<Vec<f64>> {
    let by_swing = SWINGS.into_iter().map(|faster| (lost.to_vec(), faster));
    let with_play = |more: f64| {
        let mut lost = lost.to_vec();
        lost[1] = 1.0 - (1.0 - lost[1]) * more;
        (lost, 1.0)
    };
    let by_play = WOUND_UP.into_iter().map(with_play).filter(|(lost, _)| lost[1] > LITTLE_PLAY);
    let there = by_swing.chain(by_play).filter_map(|(lost, faster)| swinging_at(frame, &lost, faster));
    let soft = there.filter(|shape| half_hz(shape) < FASTEST_HZ);
    let damped =
        |shape: Vec<f64>| [DAMPING, shape[4]].map(|damping| shape[..4].iter().copied().chain([damping]).collect());
    soft.flat_map(damped).collect()
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

/// The two in the numbers of their law.
#[must_use]
pub fn shape_of(frame: &Frame, masses: &TwoMasses) -> Vec<f64> {
    let width_um = masses.clearance / frame.axis.drive.motor_per_um();
    std::iter::once(width_um).chain(table_side::swing_of(masses)).collect()
}

/// Starts of [`LOST`] by what was found of one of the two, in groups: that itself, and with its table or one of no particular mass
/// the stiffer springs the more of what is lost is play.
#[must_use]
pub fn starts(frame: &Frame, found: &TwoMasses) -> [Vec<Vec<f64>>; 3] {
    let (lost, friction) = (lost(frame, found), found.table_friction_share);
    let lost_um = lost / frame.axis.drive.motor_per_um();
    let by_spring_alone = (4.0 * friction * frame.belief.coulomb / lost / frame.belief.inertia).sqrt() / TAU;
    let count = ((FASTEST_HZ / by_spring_alone).ln() / STEP.ln()).clamp(1.0, MOST_STARTS) as i32;
    let of_table = |share: f64| {
        let with = |step: i32, loses: f64| {
            let play = 1.0 - (FIRST * STEP.powi(step)).powi(-2);
            vec![loses * lost_um, play, share, friction, DAMPING]
        };
        (0..count).flat_map(|step| LOSES.map(|loses| with(step, loses))).collect()
    };
    let &[_, share, _, damping] = table_side::swing_of(found).as_slice() else { return Default::default() };
    let itself = vec![lost_um, found.clearance / lost, share, friction, damping];
    [vec![itself], of_table(share), of_table(SHARE)]
}

/// A clearance as wide, whose flanks meet so hard, in the numbers of its own law.
#[must_use]
pub fn with_hard_flanks(shape: &[f64], hz: f64) -> Option<Vec<f64>> {
    let &[width_um, _, share, rubbing, _] = shape else { return None };
    Some(vec![width_um, share, rubbing * share, hz])
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
        vec![width_um, own_hz / softer.sqrt(), share, rubbing, damping]
    };
    Some([1.0 - LITTLE_PLAY, 1.0].map(with).into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::by_loop::tests::{recorded, rig};
    use crate::diagnosis::fit::Bench;
    use crate::diagnosis::known::Known;

    /// Also where a law says nothing of them, or only some: what is simulated is what they move.
    #[test]
    fn every_number_moves_what_is_simulated() {
        let (excerpt, axis) = (recorded(&[], 0.05), rig());
        let frame = Frame::new(&axis, excerpt.columns.as_ref().unwrap(), None);
        let bench = Bench::new(&frame, &Known::of(&axis, &frame));
        let spring = vec![12.0, 44.0, 0.45, 1.2, 0.1];
        for (law, shape) in
            [(&LAW, &spring), (&LOST, &vec![60.0, 0.3, 0.4, 0.5, 0.1]), (&SAID[0], &spring), (&SAID[1], &spring)]
        {
            let slopes = bench.slopes(&bench.fit(bench.parts(law, vec![shape.clone()])), 0);
            let moved = slopes.iter().filter(|slope| slope.column.iter().any(|value| *value != 0.0));
            let indices: Vec<usize> = moved.map(|slope| slope.index).collect();
            assert_eq!(indices, [0, 1, 2, 3, 4], "of {shape:?}");
        }
    }

    #[test]
    fn tables_of_other_masses_hang_on_the_same_spring_under_the_same_friction() {
        let (excerpt, axis) = (recorded(&[], 0.05), rig());
        let frame = Frame::new(&axis, excerpt.columns.as_ref().unwrap(), None);
        let shape = [12.0, 44.0, 0.45, 1.2, 0.1];
        let masses = |shape: &[f64]| table_side::split(&frame, both(&frame, shape)).unwrap();
        let (own, others) = (masses(&shape), other_masses(&shape));
        assert!(others.len() > 8);
        for other in others {
            let it = masses(&other);
            for (a, b) in [
                (it.stiffness, own.stiffness),
                (it.clearance, own.clearance),
                (it.table_friction_share, own.table_friction_share),
                (lost(&frame, &it), lost(&frame, &own)),
            ] {
                assert!((a / b - 1.0).abs() < 1e-9, "{other:?}: {a} {b}");
            }
            assert!((other[2] / shape[2] - 1.0).abs() > 0.05, "{other:?} is the same table");
        }
    }
}
