//! The torque that a machine file says a measured motion needs.
//!
//! Uses the motion of the whole recording (zero-phase) and never its torque, except for the phase of periodic terms,
//! which is estimated from the first quarter of the rows. Dry friction at rest is not a function of the motion: it is
//! carried over a standstill and turned round over a small travel, the one the machine says (pre-sliding) or the smallest
//! that the position can tell. Where clearance or spring stand between motor and table, the table's motion is that of its
//! scale; without a scale the table is simulated behind the measured motor.
//!
//! Sampling: a row holds the torque at the end of a cycle, before the servo answers to that row. The servo held its command
//! for that cycle and the motor followed with time constant τ, so the row is later than the smooth torque of the motion:
//! see [`Lateness`].

use super::coupling::{Giving, longest_step_s, transmitted};
use super::friction::Friction;
use super::lateness::Lateness;
use super::linear::{decomposed, rms};
use super::motion::{Motion, cubic_at, flattened_at, passed, smoothed};
use super::nearby::Nearby;
use super::observed::Observed;
use super::physics::{Physics, Ripple};
use crate::machine::{Axis, TwoMasses};
use nalgebra::{DMatrix, DVector};
use std::f64::consts::TAU;
use std::ops::Range;

/// A predicted torque and what it took to predict it.
#[derive(Debug, Clone, PartialEq)]
pub struct TorquePrediction {
    /// Drive's own unit, one value a row; NaN where the motion is not known.
    pub torque: Vec<f64>,
    /// The torque in the first row's own instant, whatever the column's delay; NaN where the motion is not known.
    pub at_start: f64,
    /// The axis's numbers, with the phases that were estimated.
    pub physics: Physics,
    /// Ripples whose phase could not be had from the first quarter: they are left out of the prediction.
    pub phases_unknown: usize,
}

/// Predicts the torque column of a recording.
///
/// # Errors
/// The effects contradict the inertia, as [`Axis::two_masses`].
pub fn predict_torque(axis: &Axis, observed: &Observed) -> Result<TorquePrediction, String> {
    let mut physics = Physics::of(axis)?;
    let ripples = (std::mem::take(&mut physics.cogging), std::mem::take(&mut physics.vibration));
    let lateness = Lateness::of(axis, observed.period_s);
    let late_s = lateness.of_delay(physics.delay_s);
    let shift = (lateness.by_sampling_s + late_s) / observed.period_s;
    let flattened = lateness.flattened_s2(late_s) / observed.period_s.powi(2);

    let nothing = || vec![f64::NAN; observed.time_s.len()];
    let mut delivered = nothing();
    for run in &observed.runs {
        needed_torque(&physics, observed, run.clone(), &mut delivered);
    }
    (physics.cogging, physics.vibration) = ripples;
    let phases_unknown = set_phases(&mut physics, observed, &delivered, shift);
    set_table_phases(&mut physics, observed);

    let mut torque = nothing();
    for run in &observed.runs {
        for i in run.clone() {
            let motion = &observed.motion;
            let (x, v, t) = (motion.position[i], motion.velocity[i], observed.time_s[i] - observed.time_s[0]);
            let cogging = physics.cogging.iter().map(|ripple| seen(ripple, v, motion) * ripple.at(x));
            let vibration = physics.vibration.iter().map(|ripple| seen(ripple, 1.0, motion) * ripple.at(t));
            delivered[i] += cogging.chain(vibration).sum::<f64>();
            delivered[i] = physics.indicated(delivered[i]).clamp(-axis.base.torque_limit, axis.base.torque_limit);
        }
        let part = &delivered[run.clone()];
        for i in 0..part.len() {
            torque[run.start + i] =
                if shift == 0.0 { part[i] } else { flattened_at(part, i as f64 - shift, flattened) };
        }
    }
    let at_start = delivered.first().copied().unwrap_or(f64::NAN);
    Ok(TorquePrediction { torque, at_start, physics, phases_unknown })
}

/// The share of a ripple that is passed at a speed that the motor must deliver: above the cut-off of the motion the axis gives
/// way to it, which is not seen, and where rows are far apart would stand for a slow one.
fn seen(ripple: &Ripple, speed: f64, motion: &Motion) -> f64 {
    passed(ripple.wave * speed.abs() / TAU, motion.cutoff_hz)
}

/// Torque that the motor must deliver, without ripples, for one run of rows.
fn needed_torque(physics: &Physics, observed: &Observed, run: Range<usize>, torque: &mut [f64]) {
    let scale = physics.motor_per_load;
    let (motion, time) = (&observed.motion, &observed.time_s);
    // Three standard deviations of what the position leaves open: less would turn on noise, more turns late. Never nothing.
    let smallest = (3.0 * motion.resolution * scale).max(1e-9 * scale);
    let travel = physics.presliding.unwrap_or(0.0).max(smallest);
    let transmitted = physics.two_masses.map(|masses| {
        measured_table_torque(physics, &masses, observed, run.clone())
            .unwrap_or_else(|| table_torque(physics, &masses, observed, run.clone()))
    });
    let (inertia, share) = match &physics.two_masses {
        Some(masses) => (masses.motor_inertia, 1.0 - masses.table_friction_share),
        None => (physics.inertia, 1.0),
    };
    let level_at_rest = physics.friction_level(motion.position[run.start], 0.0, 0.0);
    let mut friction = if physics.presliding.is_some_and(|travel| travel > smallest) {
        physics.bristle(share)
    } else {
        Friction::bristle(share * level_at_rest / travel)
    };
    let mut before = motion.position[run.start];
    for i in run.clone() {
        let (x, v, t) = (motion.position[i], motion.velocity[i], time[i] - time[0]);
        let level = share * physics.friction_level(x, v, t);
        let dry = friction.moved((x - before) * scale, level) + friction.damped(v * scale, level);
        before = x;
        let table = match &transmitted {
            Some(table) => table[i - run.start],
            None => physics.load(x, v, t),
        };
        torque[i] = share * physics.slope_friction(v * scale) + dry + table;
    }
    // Friction turns round and flanks meet in an instant, and the motor's acceleration answers it: the sum is smooth, but
    // the acceleration is only known up to the cut-off. So all of it is taken up to there.
    let known = smoothed(&torque[run.clone()], observed.period_s, motion.cutoff_hz);
    for (i, known) in run.zip(known) {
        torque[i] = known + inertia * motion.acceleration[i] * scale;
    }
}

/// Torque that the table takes, from its own scale; `None` where there is none, or not in every row.
fn measured_table_torque(
    physics: &Physics,
    masses: &TwoMasses,
    observed: &Observed,
    run: Range<usize>,
) -> Option<Vec<f64>> {
    let table = observed.table_position.as_ref()?.get(run.clone())?;
    if table.iter().any(|x| !x.is_finite()) {
        return None;
    }
    let motion = Motion::estimate(&observed.time_s[run.clone()], table)?;
    let (scale, share) = (physics.motor_per_load, masses.table_friction_share);
    let travel = physics.presliding.unwrap_or(0.0).max(10.0 * motion.resolution * scale).max(1e-9 * scale);
    let level_at_rest = physics.friction_level(motion.position[0], 0.0, 0.0);
    let mut friction = Friction::bristle(share * level_at_rest / travel);
    let mut before = motion.position[0];
    let torque = |i: usize| {
        let (x, v, t) = (motion.position[i], motion.velocity[i], observed.time_s[run.start + i] - observed.time_s[0]);
        let dry = friction.moved((x - before) * scale, share * physics.friction_level(x, v, t));
        before = x;
        let inertia = masses.table_inertia * motion.acceleration[i] * scale;
        inertia + share * physics.slope_friction(v * scale) + dry + physics.load(x, v, t)
    };
    Some((0..table.len()).map(torque).collect())
}

/// Torque that the table takes from a motor that moves as measured: the table is simulated behind its spring or clearance.
fn table_torque(physics: &Physics, masses: &TwoMasses, observed: &Observed, run: Range<usize>) -> Vec<f64> {
    let scale = physics.motor_per_load;
    let motion = &observed.motion;
    let share = masses.table_friction_share;
    let mut friction = physics.bristle(share);
    let at = |i: usize| (motion.position[i] * scale, motion.velocity[i] * scale);
    let mut near = Nearby::new(physics);
    let per_scale = 1.0 / scale;
    let mut recoil = [0.0; 3];
    let (mut q, mut w) = at(run.start);
    // A table in motion is already pushed by its motor.
    q -= if w == 0.0 { 0.0 } else { (0.5 * masses.clearance).copysign(w) };
    // Mean of the torque between each row and the next.
    let mut means = Vec::with_capacity(run.len());
    for i in run.start..run.end - 1 {
        let span = observed.time_s[i + 1] - observed.time_s[i];
        let steps = (span / longest_step_s(masses, masses.table_inertia)).ceil().clamp(1.0, 1000.0);
        let h = span / steps;
        let (per_span, per_step, mobility) = (1.0 / span, 1.0 / steps, h / masses.motor_inertia);
        let ((q0, w0), (q1, w1)) = (at(i), at(i + 1));
        let mut sum = 0.0;
        let giving = Giving::new(span, h);
        for step in 0..steps as usize {
            let s = (step as f64 + 0.5) * per_step;
            let (motor, speed) = hermite(q0, w0 * span, q1, w1 * span, s);
            let t = observed.time_s[i] - observed.time_s[0] + s * span;
            let middle = q + 0.5 * h * w;
            let (x, v) = (middle * per_scale, w * per_scale);
            let [give, giving_speed, _] = recoil;
            let through = transmitted(masses, motor + give - middle, (speed * per_span + giving_speed) - w);
            sum += through;
            if masses.clearance > 0.0 {
                recoil = giving.step(recoil, through, mobility);
            }
            let push = through - (near.load(physics, x, v, t) + share * physics.slope_friction(w));
            let next = friction.step(
                masses.table_inertia,
                masses.table_inertia * w + h * push,
                h,
                w,
                share * near.friction_level(physics, x, v, t),
            );
            q = middle + 0.5 * h * next;
            w = next;
        }
        means.push(sum / steps);
    }
    // A row stands between the mean before it and the one after it.
    let mean = |i: usize| means.get(i).copied();
    (0..run.len())
        .map(|i| match (i.checked_sub(1).and_then(mean), mean(i)) {
            (Some(before), Some(after)) => 0.5 * (before + after),
            (one, other) => one.or(other).unwrap_or(0.0),
        })
        .collect()
}

/// Value and slope (per unit of `s`) of the cubic through two points with two slopes.
fn hermite(a: f64, da: f64, b: f64, db: f64, s: f64) -> (f64, f64) {
    let (c2, c3) = (3.0 * (b - a) - 2.0 * da - db, 2.0 * (a - b) + da + db);
    (a + s * (da + s * (c2 + s * c3)), da + s * (2.0 * c2 + s * 3.0 * c3))
}

/// Estimates the phases of cogging and vibration from the first quarter of the rows, where the axis moves; a ripple of
/// which that quarter shows less than half a period is silenced. Returns how many.
fn set_phases(physics: &mut Physics, observed: &Observed, delivered: &[f64], shift: f64) -> usize {
    let (motion, time) = (&observed.motion, &observed.time_s);
    let quarter = time.len() / 4;
    let place = |i: usize| (motion.position[i], time[i] - time[0]);
    let standing = 0.01 * rms(motion.velocity.iter().copied().filter(|v| v.is_finite()));
    // Beside a row without torque the one between rows is not known either.
    let left = |i: usize| physics.delivered(cubic_at(&observed.torque, i as f64 + shift)) - delivered[i];
    let (rows, residual): (Vec<usize>, Vec<f64>) = (0..quarter)
        .filter(|&i| motion.velocity[i].abs() > standing && motion.acceleration[i].is_finite())
        .map(|i| (i, left(i)))
        .filter(|(_, left)| left.is_finite())
        .unzip();
    let cogging = physics.cogging.len();
    let mut ripples: Vec<&mut Ripple> = physics.cogging.iter_mut().chain(&mut physics.vibration).collect();
    if ripples.is_empty() {
        return 0;
    }
    let along = |k: usize, i: usize| if k < cogging { place(i).0 } else { place(i).1 };
    // A wrong base value must not turn the phase: it is let free beside the ripples.
    let nuisance = |i: usize| [1.0, motion.velocity[i], motion.velocity[i].signum(), motion.acceleration[i]];
    let mut basis: Vec<Vec<f64>> = (0..4).map(|c| rows.iter().map(|&i| nuisance(i)[c]).collect()).collect();
    let mut silenced = 0;
    let mut column = Vec::with_capacity(ripples.len());
    for (k, ripple) in ripples.iter_mut().enumerate() {
        let (low, high) = rows
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &i| (low.min(along(k, i)), high.max(along(k, i))));
        if !((high - low) * ripple.wave >= std::f64::consts::PI) {
            ripple.amplitude = 0.0;
            silenced += 1;
            column.push(None);
            continue;
        }
        column.push(Some(basis.len()));
        let share = |i: usize| seen(ripple, if k < cogging { motion.velocity[i] } else { 1.0 }, motion);
        basis.push(rows.iter().map(|&i| share(i) * (ripple.wave * along(k, i)).sin()).collect());
        basis.push(rows.iter().map(|&i| share(i) * (ripple.wave * along(k, i)).cos()).collect());
    }
    let weights = least_squares(&basis, &residual);
    for (ripple, column) in ripples.into_iter().zip(column) {
        if let (Some(column), Some(weights)) = (column, &weights) {
            ripple.phase = weights[column + 1].atan2(weights[column]);
        }
    }
    silenced
}

/// Estimates the phases of the screw's periodic errors, and where the scale stands at the encoder's zero, from the first
/// quarter of the rows; without a scale nothing is known of either.
fn set_table_phases(physics: &mut Physics, observed: &Observed) {
    let Some(table) = &observed.table_position else { return };
    let quarter = table.len() / 4;
    let rows: Vec<usize> = (0..quarter).filter(|&i| (table[i] - observed.motion.position[i]).is_finite()).collect();
    let x = |i: usize| observed.motion.position[i];
    // Lost motion turns with the direction; it must not turn the phase.
    let (way, level) = (|i: usize| observed.motion.velocity[i].signum(), |_: usize| 1.0);
    let column = |value: &dyn Fn(usize) -> f64| rows.iter().map(|&i| value(i)).collect::<Vec<f64>>();
    let error: Vec<f64> = rows.iter().map(|&i| table[i] - x(i) * (1.0 + physics.table_scale)).collect();
    let mut basis = vec![column(&level), column(&way)];
    for ripple in &physics.table_error {
        basis.extend([column(&|i| (ripple.wave * x(i)).sin()), column(&|i| (ripple.wave * x(i)).cos())]);
    }
    let Some(weights) = least_squares(&basis, &error) else { return };
    physics.table_zero = weights[0];
    for (ripple, pair) in physics.table_error.iter_mut().zip(weights[2..].chunks_exact(2)) {
        ripple.phase = pair[1].atan2(pair[0]);
    }
}

/// Weights of the columns that come closest to the target; columns are scaled first, and useless ones get nothing.
fn least_squares(columns: &[Vec<f64>], target: &[f64]) -> Option<Vec<f64>> {
    let length = |c: &Vec<f64>| Some(rms(c.iter().copied())).filter(|length| *length > 1e-140).unwrap_or(1.0);
    let scales: Vec<f64> = columns.iter().map(length).collect();
    let n = columns.len();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let normal = DMatrix::from_fn(n, n, |i, j| dot(&columns[i], &columns[j]) / (scales[i] * scales[j]));
    let right = DVector::from_fn(n, |i, _| dot(&columns[i], target) / scales[i]);
    let solved = decomposed(normal)?.solve(&right, 1e-9 * target.len() as f64).ok()?;
    Some(solved.iter().zip(scales).map(|(w, s)| w / s).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_column_of_nothing_gets_nothing_and_what_is_not_finite_has_no_answer() {
        let columns = [vec![1.0; 8], vec![0.0; 8], (0..8).map(f64::from).collect()];
        let target: Vec<f64> = (0..8).map(|i| 2.0 + 0.5 * f64::from(i)).collect();
        let weights = least_squares(&columns, &target).unwrap();
        assert!(
            (weights[0] - 2.0).abs() < 1e-9 && weights[1].abs() < 1e-9 && (weights[2] - 0.5).abs() < 1e-9,
            "{weights:?}"
        );
        assert!(least_squares(&[vec![f64::NAN; 8]], &target).is_none());
    }
}
