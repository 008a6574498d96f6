//! Elastic drive: motor and table are two masses on a spring, with the resonance ω² = k·(1/J₁ + 1/J₂). Seen from the motor,
//! the table's inertia weighs more towards the antiresonance √(k/J₂) and less above it; at a reversal the drive winds up.
//!
//! Behind a motor that moves as measured the table swings at its own frequency, the antiresonance, with a damping of its own and
//! under the friction on its own mass; what the motor feels of that grows with the table's mass. So these are what is fitted:
//! whatever is changed of one of them, the best of the others stays about where it is. By the resonance, which moves with every
//! mass, the way down is a bent valley.

use super::*;
use crate::diagnosis::many::dot;
use std::f64::consts::TAU;

/// Damping ratio up to which a spring is looked for. Drives have a tenth of one and less; a fit that stops at this bound has
/// found no swing, and imitates what else happens at reversals.
pub(super) const MOST_DAMPING: f64 = 0.3;

/// Share of the friction that the table has at most.
const MOST_FRICTION: f64 = 1.0;

/// Fastest resonance that is looked for, Hz.
const FASTEST_HZ: f64 = 2000.0;

/// Ratio of a start's frequency to the one before.
const STEP: f64 = 1.08;

/// Shares of inertia and friction on the table's side at a start.
const SHARE: f64 = 0.5;
const FRICTION_SHARE: f64 = 0.7;
/// The same of a light table that carries most of the friction, and of a heavy one that carries little.
const SELDOM: [[f64; 2]; 2] = [[0.25, 0.8], [0.8, 0.4]];
/// Damping ratio there.
pub(super) const DAMPING: f64 = 0.03;
/// The same where the rows do not tell it: drives have a tenth and less, and the more it is the less a simulated table is driven by
/// the encoder's grid.
const DAMPING_BY_MEANS: f64 = 0.1;

/// How the table's own frequency and its share of the friction over that of the inertia are searched.
pub(super) const OWN_HZ: Scale = Scale::Log(2.0, FASTEST_HZ);
pub(super) const RUBBING: Scale = Scale::Log(0.02, 25.0);

/// Parameters: the table's own frequency in Hz, share of the inertia on the table's side, share of the friction there over that,
/// damping ratio of the table's own swing.
pub static LAW: Law = Law {
    cause: Cause::DriveCompliance,
    scales: &[OWN_HZ, Scale::Linear(0.04, 0.95, 0.01), RUBBING, Scale::Log(2e-3, MOST_DAMPING)],
    starts: |frame, rest| {
        // Behind a motor that moves as measured the table swings at its own frequency √(k/J₂), within a band of twice the
        // damping ratio: starts farther apart than that would miss it.
        let (least, most) = (8.0, (0.25 / frame.columns.period_s).min(300.0));
        let count = ((most / least).ln() / STEP.ln()).ceil().max(2.0) as usize;
        let swinging = log_spaced(least, most, count);
        let own = swinging.chain(wound_up(frame, rest.table).filter(|own| *own > most));
        own.map(|own| vec![own, SHARE, FRICTION_SHARE / SHARE, DAMPING]).collect()
    },
    manner: Manner {
        // When the table rests and turns round depends on its friction for its mass. A light table that carries most of the friction is
        // hardly seen from a heavy one.
        seldom: Some(|shape| {
            let Some(&own) = shape.first() else { return Vec::new() };
            SELDOM.iter().map(|[share, friction]| vec![own, *share, friction / share, DAMPING]).collect()
        }),
        // How the table swings by itself is found sooner than what is whose: a fit that damps it until it hardly swings has found the one
        // and strayed in the other.
        restarts: |shape| {
            let Some(&own) = shape.first() else { return Vec::new() };
            let at = |share: f64| [0.5, 0.95].map(|friction| vec![own, share, friction / share, DAMPING]);
            [0.2, 0.45, 0.7, 0.85].into_iter().flat_map(at).collect()
        },
        // It winds up as far under less of the friction with less of the stiffness, whatever the table's mass.
        valleys: |shape| {
            let &[own, _, rubbing, _] = shape else { return Vec::new() };
            let less = [0.25, 0.35, 0.5, 0.7, 1.0, 1.4]
                .into_iter()
                .flat_map(|less: f64| [0.25, 0.5, 0.75].map(|share| (less, share)));
            let at = less.map(|(less, share)| vec![own * less.sqrt(), share, rubbing * less, DAMPING]);
            at.filter(|shape| shape[1] * shape[2] <= MOST_FRICTION).collect()
        },
        damped,
        ..PLAIN
    },
    terms: Terms::Simulated(effect),
    effect: swinging,
    confused_with: CONFUSED_WITH,
    sentence,
};

/// The same of a table that the encoder's grid drives at its own frequency: by the rows it would be damped as none is, and weigh nothing
/// lest it swing. Means over some swings tell its frequency and its friction; its mass and its damping are taken for granted.
pub static BY_MEANS: Law = Law {
    cause: Cause::DriveCompliance,
    scales: &[OWN_HZ, Scale::Choice, RUBBING, Scale::Choice],
    starts: |_, _| Vec::new(),
    manner: Manner {
        restarts: |shape| {
            let Some(&own) = shape.first() else { return Vec::new() };
            [0.3, 0.5, 0.7, 0.9].map(|friction| vec![own, SHARE, friction / SHARE, DAMPING_BY_MEANS]).into()
        },
        damped,
        told_by_means: true,
        // 95 %: a share from a tenth to nine tenths, a damping from nothing to twice what is taken.
        taken: &[(1, 0.2), (3, 0.5 * DAMPING_BY_MEANS)],
        ..PLAIN
    },
    terms: Terms::Simulated(effect),
    effect: swinging,
    confused_with: CONFUSED_WITH,
    sentence,
};

const CONFUSED_WITH: &[Cause] = &[Cause::InertiaMismatch, Cause::Backlash, Cause::PreslidingFriction];

/// The effect, if it is one of a drive that swings.
pub(super) fn swinging(frame: &Frame, shape: &[f64], _: &[f64]) -> Option<Effect> {
    let swings = |found: &Effect| matches!(found, Effect::DriveCompliance { damping_ratio, .. } if *damping_ratio < 0.9 * MOST_DAMPING);
    effect(frame, shape).filter(swings)
}

/// The same spring, its swing damped more.
fn damped(shape: &[f64], more: f64) -> Option<Vec<f64>> {
    let &[own, share, rubbing, damping] = shape else { return None };
    Some(vec![own, share, rubbing, damping * more])
}

fn sentence(effect: &Effect, axis: &Axis) -> String {
    match effect {
        Effect::DriveCompliance { resonance_hz, stiffness_n_um, .. } => format!(
            "The drive is elastic: motor and table swing against each other at {} Hz ({} N/{}), so coupling, screw or bearing gives.",
            say(*resonance_hz),
            say(*stiffness_n_um),
            if axis.drive.is_rotary() { "0.001°" } else { "µm" }
        ),
        _ => String::new(),
    }
}

/// The effect of a table with its own frequency, share of the inertia, share of the friction over that, and own damping ratio.
pub(super) fn effect(frame: &Frame, shape: &[f64]) -> Option<Effect> {
    let [own_hz, table_inertia_share, rubbing, own_damping]: [f64; 4] = shape.try_into().ok()?;
    let faster = (1.0 - table_inertia_share).sqrt().recip();
    let (resonance_hz, damping_ratio) = (own_hz * faster, own_damping * faster);
    let table_friction_share = (rubbing * table_inertia_share).min(MOST_FRICTION);
    let omega: f64 = TAU * resonance_hz;
    let stiffness = omega * omega * frame.belief.inertia * table_inertia_share * (1.0 - table_inertia_share);
    let stiffness_n_um = stiffness / frame.axis.drive.motor_stiffness(1.0);
    Some(Effect::DriveCompliance {
        resonance_hz,
        stiffness_n_um,
        table_inertia_share,
        table_friction_share,
        damping_ratio,
    })
}

/// The table's own frequency √(k/J₂), Hz, by how far the drive winds up under what it carries: of a spring too fast to be seen
/// swinging, but soft enough for a scale on the table. `None` without one, or where the table does not lag.
fn wound_up(frame: &Frame, table: &[f64]) -> Option<f64> {
    let (b, unit) = (&frame.belief, frame.unit);
    let inertia = SHARE * b.inertia;
    let carried = frame.judged_by(|i| {
        inertia * frame.a[i] * unit + FRICTION_SHARE * (b.coulomb * frame.direction[i] + b.viscous * frame.v[i] * unit)
    });
    let per_torque = -unit * dot(&carried, table) / dot(&carried, &carried).max(1e-300);
    let own = (1.0 / (per_torque * inertia)).sqrt() / TAU;
    (own.is_finite() && own < FASTEST_HZ * (1.0 - SHARE).sqrt()).then_some(own)
}
