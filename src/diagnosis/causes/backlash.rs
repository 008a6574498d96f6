//! Dead zone between motor and table. While the motor crosses it after a reversal it carries neither the table's inertia
//! nor its friction; then the flanks meet. In table − encoder it is a step of the full width at every reversal.
//!
//! Flanks are rigid here and meet without rebound: in contact the table moves with the motor and the link carries
//! J₂·ẍ + φ·(Tc·sign(ẋ) + Tv·ẋ) + T0; it opens when that would pull, the table then coasts under its own friction, and where
//! it is caught the link gives the impulse J₂·Δω. A stiff spring in its place would turn the encoder's grid into torque.

use super::*;
use crate::plant::motion::cubic_at;

/// Parameters: full width in µm, shares of inertia and friction on the table's side. The trace has no coefficient.
pub static LAW: Law = Law {
    cause: Cause::Backlash,
    scales: &[Scale::Log(0.1, 2000.0), Scale::Linear(0.05, 0.9, 0.02), Scale::Linear(0.02, 0.98, 0.02)],
    starts: |frame, _| {
        let least = (3.0 * frame.grid).max(1e-3) * 1e3;
        let widths = log_spaced(least, (10.0 * least).max(300.0), 12);
        widths.flat_map(|w| [vec![w, 0.45, 0.5], vec![w, 0.45, 0.8]]).collect()
    },
    starts_from_rest: false,
    terms: |frame, shapes| {
        each(shapes, |shape| {
            let (extra, lag) = crossing(frame, 1e-3 * shape[0], shape[1], shape[2]);
            let table = if frame.columns.table.is_some() { frame.judged_table(&lag) } else { Vec::new() };
            Term { fixed: Some(Trace { torque: frame.judged(&extra), table }), regressors: Vec::new() }
        })
    },
    effect: |_, shape, _| {
        let [width_um, table_inertia_share, table_friction_share] = shape.try_into().ok()?;
        Some(Effect::Backlash { width_um, table_inertia_share, table_friction_share })
    },
    confused_with: &[Cause::PreslidingFriction, Cause::DriveCompliance],
    sentence: |effect, axis| match effect {
        Effect::Backlash { width_um, .. } => format!(
            "At each reversal the motor turns through {} {} of clearance before the table follows: nut, coupling or gearing has play.",
            say(*width_um),
            micro(axis)
        ),
        _ => String::new(),
    },
};

/// Torque beyond that of the rigid axis, and table − motor in load units, every row.
fn crossing(frame: &Frame, width: f64, inertia_share: f64, share: f64) -> (Vec<f64>, Vec<f64>) {
    let b = &frame.belief;
    let h = frame.columns.period_s;
    let half = 0.5 * width;
    let inertia = inertia_share * b.inertia;
    let rub = share * b.coulomb;
    let mut extra = vec![0.0; frame.x.len()];
    let mut lag = vec![0.0; frame.x.len()];
    for s in &frame.columns.stretches {
        let mut free = true;
        let mut side = 0.0;
        let (mut x, mut v) = (frame.x[s.start], 0.0);
        for i in s.start..s.end.saturating_sub(1) {
            // Motor over this row, in steps fine enough to place release and contact.
            let (speed, next_speed) = (frame.v[i] * frame.unit, frame.v[i + 1] * frame.unit);
            let bend = (next_speed - speed) / h;
            let carried =
                |w: f64| inertia * bend + rub * direction(w, frame.direction[i]) + share * b.viscous * w + b.constant;
            // In contact, and pushed all through the row: the common case.
            if !free && side * carried(speed) > 0.0 && side * carried(next_speed) > 0.0 && speed * next_speed > 0.0 {
                lag[i] = -side * half;
                continue;
            }
            let mut missing = 0.0;
            for k in 0..STEPS {
                let at = (k as f64 + 0.5) / STEPS as f64;
                let w = speed + at * (next_speed - speed);
                let motor = cubic_at(&frame.x, i as f64 + at);
                let dt = h / STEPS as f64;
                if !free && side * carried(w) < 0.0 {
                    free = true;
                    (x, v) = (motor - side * half, w);
                }
                if free {
                    let pushed = v - dt * (b.constant + share * b.viscous * v) / inertia;
                    let most = dt * rub / inertia;
                    v = pushed - pushed.clamp(-most, most);
                    x += dt * v / frame.unit;
                    missing -= carried(w) / STEPS as f64;
                    let twist = motor - x;
                    if twist.abs() >= half {
                        side = twist.signum();
                        free = false;
                        missing += inertia * (w - v) / h;
                    }
                }
                if !free {
                    x = motor - side * half;
                }
                if k == STEPS / 2 {
                    lag[i] = x - motor;
                }
            }
            // What happened between two rows is shared by both.
            extra[i] += 0.5 * missing;
            extra[i + 1] += 0.5 * missing;
        }
    }
    (extra, lag)
}

/// Steps a row.
const STEPS: usize = 4;

/// The direction of sliding at a speed, as sharp as the row knows it.
fn direction(speed: f64, at_row: f64) -> f64 {
    if at_row.abs() > 0.99 {
        at_row
    } else if speed == 0.0 {
        0.0
    } else {
        speed.signum()
    }
}
