//! Friction builds up over a displacement after a reversal: with z from −1 to 1, dz/dx = (1 − z·sign(v))ⁿ/d, friction = Tc·z and
//! d = Coulomb force ÷ bristle stiffness at the load (Dahl 1968, n = 1), or by elements that slip one after the other. The bristle's
//! own damping adds τ·ż (LuGre, Canudas de Wit et al. 1995). Driven by the measured position, so no speed has to be known.

use super::*;
use crate::diagnosis::many::{decay, widest};
use crate::plant::friction::{Curve, Elements};

/// The law while causes are sought. Traces: z − sign(v), whose coefficient is the friction level that builds up, and ż, whose
/// coefficient is that times τ. Parameters: d in thousandths of the load's unit, n, and 0 for a bristle or 1 for elements.
pub static LAW: Law = with_exponent(&[DISPLACEMENT, Scale::Choice, Scale::Choice]);

/// The same over less than an encoder tells: in the loop it is a rival of what is found there, and never named.
pub static WITHIN_STEPS: Law = Law {
    effect: |_, shape, _| {
        let [displacement_um, exponent, maxwell_slip] = shape.try_into().ok()?;
        Some(Effect::PreslidingFriction { displacement_um, exponent, maxwell_slip, micro_damping_s: 0.0 })
    },
    ..with_exponent(&[DISPLACEMENT, Scale::Choice, Scale::Choice])
};

/// The same with n refined: see `formulation`.
pub static OF_ANY_EXPONENT: Law = with_exponent(&[DISPLACEMENT, Scale::Linear(0.0, 2.5, 0.05), Scale::Choice]);

const DISPLACEMENT: Scale = Scale::Log(0.05, 2000.0);

/// What the search knows: n, and 0 for a bristle or 1 for elements.
pub const BRISTLE: [f64; 2] = [1.0, 0.0];
pub const ELEMENTS: [f64; 2] = [0.4, 1.0];
/// Elements that go as a bristle of twice their displacement once all have slipped.
pub const ELEMENTS_AS_BRISTLE: [f64; 2] = [1.0, 1.0];

const fn with_exponent(scales: &'static [Scale]) -> Law {
    Law {
        cause: Cause::PreslidingFriction,
        scales,
        starts: |frame, _| {
            let least = (3.0 * frame.grid).max(3e-4) * 1e3;
            let widths = log_spaced(least, (least * 10.0).max(500.0), 14);
            let of = |[n, kind]: [f64; 2]| widths.clone().map(move |d| vec![d, n, kind]);
            of(BRISTLE).chain(of(ELEMENTS).step_by(2)).collect()
        },
        manner: Manner { turns_table: true, ..PLAIN },
        terms: Terms::ByRows(|frame, shapes| {
            each(shapes, |shape| {
                let [mut less, rate] = build_up(frame, shape[0] * 1e-3, shape[1], is_of_elements(shape[2]));
                less.iter_mut().zip(&frame.direction).for_each(|(z, direction)| *z -= direction);
                let regressors = [less, rate].map(|values| Trace::torque(frame.judged(&values))).into();
                Term { fixed: None, regressors }
            })
        }),
        effect: |frame, shape, c| {
            let level = *c.first()?;
            let [displacement_um, exponent, maxwell_slip] = shape.try_into().ok()?;
            let as_friction = level > 0.4 * frame.belief.coulomb && level < 2.5 * frame.belief.coulomb;
            // What builds up within a step or two that the encoder tells for sure is as if it were there at once.
            let sound = as_friction && displacement_um * 1e-3 >= 2.0 * frame.resolution;
            // Less than no damping is noise.
            let micro_damping_s = c.get(1).map_or(0.0, |c| (c / level).max(0.0));
            sound.then_some(Effect::PreslidingFriction { displacement_um, exponent, maxwell_slip, micro_damping_s })
        },
        confused_with: &[Cause::Backlash, Cause::DriveCompliance, Cause::StribeckFriction],
        sentence: |effect, axis| match effect {
            Effect::PreslidingFriction { displacement_um, .. } => format!(
                "After each reversal friction builds up over about {} {} instead of at once, as preloaded guides and seals do.",
                say(*displacement_um),
                micro(axis)
            ),
            _ => String::new(),
        },
    }
}

/// What counts as all of the level.
const ALL: f64 = 1.0 - 1e-12;

fn is_of_elements(kind: f64) -> bool {
    kind > 0.5
}

/// The state −1…1 of a bristle at every row that yields over so many load units.
#[must_use]
pub fn bristle_over(frame: &Frame, displacement: f64) -> Vec<f64> {
    let [state, _] = build_up(frame, displacement, BRISTLE[0], false);
    state
}

/// The state −1…1 at every row, solved exactly over each step, and its change per second; unknown at the start and taken as zero.
fn build_up(frame: &Frame, displacement: f64, exponent: f64, of_elements: bool) -> [Vec<f64>; 2] {
    let x = &frame.way;
    let (mut state, mut rate) = (vec![0.0; x.len()], vec![0.0; x.len()]);
    let per_displacement = displacement.recip();
    let mut curve = Curve::new(exponent);
    let at_rest = of_elements.then(|| Elements::new(exponent));
    for s in &frame.columns.stretches {
        let (rows, passed) = (&x[s.clone()], &mut state[s.clone()]);
        let steps = rows.windows(2).map(|pair| (pair[1] - pair[0]) * per_displacement);
        let states = passed.iter_mut().skip(1).zip(steps);
        match at_rest {
            Some(elements) => widest(
                #[inline(always)]
                || {
                    let (mut z, mut elements) = (0.0, elements);
                    for (state, step) in states {
                        // Where all of them slip they go on slipping.
                        z = if z * step.signum() >= ALL { z } else { elements.moved(step, 1.0) };
                        *state = z;
                    }
                },
            ),
            None if exponent == 1.0 => {
                // What is left of the way after a step waits for no other step.
                widest(
                    #[inline(always)]
                    || states.for_each(|(state, step)| *state = decay(step.abs())),
                );
                let mut z = 0.0;
                for (state, pair) in passed.iter_mut().skip(1).zip(rows.windows(2)) {
                    let end = if pair[1] > pair[0] { 1.0 } else { -1.0 };
                    z = end + (z - end) * *state;
                    *state = z;
                }
            }
            None => {
                let mut z = 0.0;
                for (state, step) in states {
                    if step != 0.0 {
                        let end = step.signum();
                        z = end * (1.0 - 2.0 * curve.left_after(0.5 - 0.5 * z * end, step.abs()));
                    }
                    *state = z;
                }
            }
        }
        for i in s.start + 1..s.end.saturating_sub(1) {
            rate[i] = (state[i + 1] - state[i - 1]) * (0.5 / frame.columns.period_s);
        }
    }
    [state, rate]
}
