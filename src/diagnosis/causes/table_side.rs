//! The table behind a spring, driven by the measured motion of the motor.
//!
//! J₂·ẍ₂ = c − φ·(Tc·sign(ẋ₂) + Tv·ẋ₂) − T0, with c = k·(x₁ − x₂) + d·(ẋ₁ − ẋ₂); the motor then needs
//! T = J₁·ẍ₁ + (1 − φ)·(Tc·sign(ẋ₁) + Tv·ẋ₁) + c. Integrated by Moreau's time stepping: friction is the impulse that
//! brings the table towards rest, at most φ·Tc·h, so that a table at rest stays there without chatter.

use super::*;

/// The trace in the torque (against the rigid axis) and in table − encoder.
pub fn term(frame: &Frame, effect: Effect) -> Term {
    let axis = frame.axis.with_effects(vec![effect]);
    let Ok(Some(split)) = axis.two_masses() else { return Term::default() };
    let b = &frame.belief;
    let h = frame.columns.period_s;
    let share = split.table_friction_share;
    let (coulomb, viscous) = (share * b.coulomb, share * b.viscous);
    let fastest = (split.stiffness / split.table_inertia).sqrt().max(split.damping / split.table_inertia);
    let steps = ((h * fastest / 0.5).ceil() as usize).clamp(2, 64);
    let dt = h / steps as f64;
    let contact = |twist: f64, rate: f64| split.stiffness * twist + split.damping * rate;
    let position = &frame.columns.position;
    let mut extra = vec![0.0; position.len()];
    let mut twist_of = vec![0.0; position.len()];
    for s in &frame.columns.stretches {
        let origin = position[s.start];
        let motor = |i: usize| (position[i] - origin) * frame.unit;
        let (mut x, mut v) = (0.0, 0.0);
        for i in s.clone() {
            let (now, next) = (motor(i), motor((i + 1).min(s.end - 1)));
            let previous = motor(i.saturating_sub(1).max(s.start));
            let rate = (next - previous) / (2.0 * h);
            let a = (next - 2.0 * now + previous) / (h * h);
            let link = contact(now - x, rate - v);
            extra[i] = link - b.constant - split.table_inertia * a - coulomb * frame.direction[i] - viscous * rate;
            twist_of[i] = (x - now) / frame.unit;
            // Both sides of the link at the same instant: half a step between them would be a false viscous force.
            for k in 0..steps {
                let m = now + k as f64 / steps as f64 * (next - now);
                let w = (next - now) / h;
                let link = contact(m - x, w - v);
                let free = v + dt * (link - b.constant - viscous * v) / split.table_inertia;
                let rub = dt * coulomb / split.table_inertia;
                v = free - free.clamp(-rub, rub);
                x += dt * v;
            }
        }
    }
    let table = if frame.columns.table.is_some() { frame.judged_table(&twist_of) } else { Vec::new() };
    Term { fixed: Some(Trace { torque: frame.judged(&extra), table }), regressors: Vec::new() }
}
