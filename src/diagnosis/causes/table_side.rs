//! The table behind a spring, driven by the measured motion of the motor.
//!
//! J₂·ẍ₂ = c − φ·(Tc·sign(ẋ₂) + Tv·ẋ₂) − T0, with c = k·(x₁ − x₂) + d·(ẋ₁ − ẋ₂); the motor then needs
//! T = J₁·ẍ₁ + (1 − φ)·(Tc·sign(ẋ₁) + Tv·ẋ₁) + c. Integrated by Moreau's time stepping: friction is the impulse that
//! brings the table towards rest, at most φ·Tc·h, so that a table at rest stays there without chatter.
//!
//! Each step waits for the one before it. Several springs are therefore stepped side by side, which costs little more
//! time than one.

use super::*;
use crate::machine::TwoMasses;

/// Springs that are stepped together.
const LANES: usize = 8;

/// The traces in the torque (against the rigid axis) and in table − encoder, of each effect.
pub fn terms(frame: &Frame, effects: &[Option<Effect>]) -> Vec<Term> {
    let splits: Vec<Option<TwoMasses>> =
        effects.iter().map(|e| e.and_then(|e| frame.axis.with_effects(vec![e]).two_masses().ok().flatten())).collect();
    let sound: Vec<TwoMasses> = splits.iter().copied().flatten().collect();
    let mut found = sound.chunks(LANES).flat_map(|chunk| together(frame, chunk)).collect::<Vec<_>>().into_iter();
    splits.iter().map(|split| split.and_then(|_| found.next()).unwrap_or_default()).collect()
}

type Lanes = [f64; LANES];

/// The traces of up to [`LANES`] springs.
fn together(frame: &Frame, splits: &[TwoMasses]) -> Vec<Term> {
    let b = &frame.belief;
    let h = frame.columns.period_s;
    let fastest = splits.iter().map(|s| (s.stiffness / s.table_inertia).sqrt().max(s.damping / s.table_inertia));
    let steps = ((h * fastest.fold(0.0, f64::max) / 0.5).ceil() as usize).clamp(2, 64);
    let dt = h / steps as f64;
    // Lanes without a spring repeat the last.
    let lanes = |of: &dyn Fn(&TwoMasses) -> f64| -> Lanes {
        std::array::from_fn(|l| splits.get(l).or(splits.last()).map_or(1.0, of))
    };
    let (stiffness, damping) = (lanes(&|s| s.stiffness), lanes(&|s| s.damping));
    let per_inertia = lanes(&|s| dt / s.table_inertia);
    let inertia = lanes(&|s| s.table_inertia);
    let coulomb = lanes(&|s| s.table_friction_share * b.coulomb);
    let viscous = lanes(&|s| s.table_friction_share * b.viscous);
    let rub = lanes(&|s| dt * s.table_friction_share * b.coulomb / s.table_inertia);
    let position = &frame.columns.position;
    let with_table = frame.columns.table.is_some();
    let mut extra = vec![vec![0.0; position.len()]; splits.len()];
    let mut twist_of = vec![vec![0.0; if with_table { position.len() } else { 0 }]; splits.len()];
    for s in &frame.columns.stretches {
        let origin = position[s.start];
        let motor = |i: usize| (position[i] - origin) * frame.unit;
        let (mut x, mut v): (Lanes, Lanes) = ([0.0; LANES], [0.0; LANES]);
        for i in s.clone() {
            let (now, next) = (motor(i), motor((i + 1).min(s.end - 1)));
            let previous = motor(i.saturating_sub(1).max(s.start));
            let rate = (next - previous) / (2.0 * h);
            let a = (next - 2.0 * now + previous) / (h * h);
            let direction = frame.direction[i];
            let mut row: Lanes = [0.0; LANES];
            for l in 0..LANES {
                let link = stiffness[l] * (now - x[l]) + damping[l] * (rate - v[l]);
                row[l] = link - b.constant - inertia[l] * a - coulomb[l] * direction - viscous[l] * rate;
            }
            for (lane, value) in extra.iter_mut().zip(row) {
                lane[i] = value;
            }
            for (lane, x) in twist_of.iter_mut().zip(x).filter(|_| with_table) {
                lane[i] = (x - now) / frame.unit;
            }
            // Both sides of the link at the same instant: half a step between them would be a false viscous force.
            let w = (next - now) / h;
            for k in 0..steps {
                let m = now + k as f64 / steps as f64 * (next - now);
                for l in 0..LANES {
                    let link = stiffness[l] * (m - x[l]) + damping[l] * (w - v[l]);
                    let free = v[l] + per_inertia[l] * (link - b.constant - viscous[l] * v[l]);
                    v[l] = free - free.max(-rub[l]).min(rub[l]);
                    x[l] += dt * v[l];
                }
            }
        }
    }
    let term = |(extra, twist): (Vec<f64>, Vec<f64>)| {
        let table = if with_table { frame.judged_table(&twist) } else { Vec::new() };
        Term { fixed: Some(Trace { torque: frame.judged(&extra), table }), regressors: Vec::new() }
    };
    extra.into_iter().zip(twist_of).map(term).collect()
}
