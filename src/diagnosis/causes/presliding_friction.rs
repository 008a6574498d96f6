//! Friction builds up over a displacement after a reversal: with z from −1 to 1, dz/dx = (1 − z·sign(v))ⁿ/d, friction = Tc·z and
//! d = Coulomb force ÷ bristle stiffness at the load (Dahl 1968, n = 1), or by elements that slip one after the other. The bristle's
//! own damping adds τ·ż (LuGre, Canudas de Wit et al. 1995). Driven by the measured position, so no speed has to be known.

use super::*;
use crate::plant::friction::{Curve, Elements};

/// The law while causes are sought. Traces: z − sign(v), whose coefficient is the friction level that builds up, and ż, whose
/// coefficient is that times τ. Parameters: d in thousandths of the load's unit, n, and 0 for a bristle or 1 for elements.
pub static LAW: Law = with_exponent(&[DISPLACEMENT, Scale::Choice, Scale::Choice]);

/// The same with n refined: see `formulation`.
pub static OF_ANY_EXPONENT: Law = with_exponent(&[DISPLACEMENT, Scale::Linear(0.0, 2.5, 0.05), Scale::Choice]);

const DISPLACEMENT: Scale = Scale::Log(0.05, 2000.0);

/// What the search knows: n, and 0 for a bristle or 1 for elements.
pub const BRISTLE: [f64; 2] = [1.0, 0.0];
pub const ELEMENTS: [f64; 2] = [0.4, 1.0];

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
        manner: PLAIN,
        terms: |frame, shapes| {
            each(shapes, |shape| {
                let [state, rate] = build_up(frame, shape[0] * 1e-3, shape[1], is_of_elements(shape[2]));
                let less: Vec<f64> = state.iter().zip(&frame.direction).map(|(z, s)| z - s).collect();
                let regressors = [less, rate].map(|values| Trace::torque(frame.judged(&values))).into();
                Term { fixed: None, regressors }
            })
        },
        effect: |frame, shape, c| {
            let level = *c.first()?;
            let [displacement_um, exponent, maxwell_slip] = shape.try_into().ok()?;
            let sound = level > 0.4 * frame.belief.coulomb && level < 2.5 * frame.belief.coulomb;
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

fn is_of_elements(kind: f64) -> bool {
    kind > 0.5
}

/// The state −1…1 at every row, solved exactly over each step, and its change per second; unknown at the start and taken as zero.
fn build_up(frame: &Frame, displacement: f64, exponent: f64, of_elements: bool) -> [Vec<f64>; 2] {
    let x = &frame.columns.position;
    let (mut state, mut rate) = (vec![0.0; x.len()], vec![0.0; x.len()]);
    let mut curve = Curve::new(exponent);
    let at_rest = of_elements.then(|| Elements::new(exponent));
    for s in &frame.columns.stretches {
        let (mut z, mut elements) = (0.0, at_rest);
        for i in s.start + 1..s.end {
            let step = (x[i] - x[i - 1]) / displacement;
            if let Some(elements) = &mut elements {
                // Where all of them slip they go on slipping.
                let slip = z * step.signum() >= 1.0;
                z = if slip { z } else { elements.moved(step, 1.0) };
            } else if step != 0.0 {
                let end = step.signum();
                z = end * (1.0 - 2.0 * curve.left_after(0.5 - 0.5 * z * end, step.abs()));
            }
            state[i] = z;
        }
        for i in s.start + 1..s.end.saturating_sub(1) {
            rate[i] = (state[i + 1] - state[i - 1]) * (0.5 / frame.columns.period_s);
        }
    }
    [state, rate]
}
