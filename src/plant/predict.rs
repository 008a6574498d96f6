//! The torque that a machine file says a measured motion needs.
//!
//! Uses the motion of the whole recording (zero-phase) and never its torque, except for the phase of periodic terms,
//! which is estimated from the first quarter of the rows, or of those in which the axis moves. Dry friction at rest is not a
//! function of the motion: it is carried over a standstill and turned round over a small travel, the one the machine says
//! (pre-sliding) or the smallest that the position can tell. Where a clearance or a spring stands between motor and table, the
//! table is simulated behind the measured motor; where its scale is fine for the clearance, or has it elsewhere in that, its
//! motion is that of the scale.
//!
//! Sampling: a row holds the torque at the end of a cycle, before the servo answers to that row. The servo held its command
//! for that cycle and the motor followed with time constant τ, so the row is later than the smooth torque of the motion:
//! see [`Lateness`].

use super::behind::table_motion;
use super::between::{cubic_at, shift};
use super::closed_loop::at_the_scales_zero;
use super::friction::Friction;
use super::lateness::Lateness;
use super::linear::{decomposed, rms};
use super::motion::{Motion, passed, smoothed};
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
    /// Ripples whose phase could not be had from the rows for phases: they are left out of the prediction.
    pub phases_unknown: usize,
}

/// Predicts the torque column of a recording.
///
/// # Errors
/// The effects contradict the inertia, as [`Axis::two_masses`].
pub fn predict_torque(axis: &Axis, observed: &Observed) -> Result<TorquePrediction, String> {
    let mut physics = Physics::of(axis)?;
    set_table_phases(&mut physics, observed);
    let mut unshaken = physics.clone();
    unshaken.vibration.clear();
    let mut torque = needed_in_all(&unshaken, observed);
    let shown = Shown::of(axis, &physics, observed);
    let phases_unknown = set_phases(&mut physics, observed, &torque, shown.by_rows);
    if shakes_a_table(&physics) {
        torque = needed_in_all(&physics, observed);
    }
    add_ripples(axis, &physics, observed, &mut torque);
    let at_start = torque.first().copied().unwrap_or(f64::NAN);
    shown.delay(observed, &mut torque);
    Ok(TorquePrediction { torque, at_start, physics, phases_unknown })
}

/// The torque column that the same rows would have if the motor had moved otherwise, with the phases that are known.
#[must_use]
pub(super) fn torque_of(axis: &Axis, physics: &Physics, observed: &Observed) -> Vec<f64> {
    let mut torque = needed_in_all(physics, observed);
    add_ripples(axis, physics, observed, &mut torque);
    Shown::of(axis, physics, observed).delay(observed, &mut torque);
    torque
}

/// Where the table is behind a motor that moves as measured, load units, by the zero of its scale; `None` without a scale. NaN where the
/// motion is not known. With a closed loop the replay says that, of a motor that moves as simulated.
#[must_use]
pub fn predict_table(physics: &Physics, observed: &Observed) -> Option<Vec<f64>> {
    observed.table_position.as_ref()?;
    let mut table = vec![f64::NAN; observed.time_s.len()];
    for run in &observed.runs {
        let places = &mut table[run.clone()];
        match physics.two_masses {
            Some(masses) => {
                let behind = table_motion(physics, masses, observed, run.clone());
                let per_scale = 1.0 / physics.motor_per_load;
                places
                    .iter_mut()
                    .zip(behind)
                    .for_each(|(table, (place, _))| *table = physics.table_of(place * per_scale));
            }
            None => {
                let motor = &observed.motion.position[run.clone()];
                places.iter_mut().zip(motor).for_each(|(table, motor)| *table = physics.table_of(*motor));
            }
        }
    }
    Some(at_the_scales_zero(table, observed))
}

/// How a torque column shows what the motor delivers.
struct Shown {
    /// Rows by which it is late.
    by_rows: f64,
    /// Second moment by which that flattens it, rows².
    flattened: f64,
}

impl Shown {
    fn of(axis: &Axis, physics: &Physics, observed: &Observed) -> Self {
        let lateness = Lateness::of(axis, observed.period_s);
        let late_s = lateness.of_delay(physics.delay_s);
        Self {
            by_rows: (lateness.by_sampling_s + late_s) / observed.period_s,
            flattened: lateness.flattened_s2(late_s) / observed.period_s.powi(2),
        }
    }

    fn delay(&self, observed: &Observed, torque: &mut [f64]) {
        if self.by_rows != 0.0 {
            observed.runs.iter().for_each(|run| shift(&mut torque[run.clone()], self.by_rows, self.flattened));
        }
    }
}

/// Whether vibrations shake a table that is set apart from its motor: it swings under them as it slides, and rests as friction holds it.
fn shakes_a_table(physics: &Physics) -> bool {
    physics.two_masses.is_some() && physics.vibration.iter().any(|ripple| ripple.amplitude != 0.0)
}

/// Torque that the motor must deliver, without ripples but with what shakes a table that is set apart; NaN where the motion is not known.
fn needed_in_all(physics: &Physics, observed: &Observed) -> Vec<f64> {
    let mut physics = physics.clone();
    if !shakes_a_table(&physics) {
        physics.vibration.clear();
    }
    let mut torque = Vec::new();
    for run in &observed.runs {
        let needed = needed_torque(&physics, observed, run.clone());
        // That of all rows is taken as it is: long recordings have no room for a copy.
        if needed.len() == observed.time_s.len() {
            torque = needed;
        } else {
            torque.resize(observed.time_s.len(), f64::NAN);
            torque[run.clone()].copy_from_slice(&needed);
        }
    }
    torque
}

/// Puts ripples on what the motor must deliver, and what it cannot deliver off.
fn add_ripples(axis: &Axis, physics: &Physics, observed: &Observed, torque: &mut [f64]) {
    let motion = &observed.motion;
    // What shakes a table that is set apart is there already.
    let vibrations = if shakes_a_table(physics) { &[][..] } else { &physics.vibration };
    for i in observed.runs.iter().cloned().flatten() {
        let (x, v, t) = (motion.position[i], motion.velocity(i), observed.time_s[i] - observed.time_s[0]);
        let cogging = physics.cogging.iter().map(|ripple| seen(ripple, v, motion) * ripple.at(x));
        let vibration = vibrations.iter().map(|ripple| seen(ripple, 1.0, motion) * ripple.at(t));
        torque[i] += cogging.chain(vibration).sum::<f64>();
        torque[i] = physics.indicated(torque[i]).clamp(-axis.base.torque_limit, axis.base.torque_limit);
    }
}

/// The share of a ripple that is passed at a speed that the motor must deliver: above the cut-off of the motion the axis gives
/// way to it, which is not seen, and where rows are far apart would stand for a slow one.
fn seen(ripple: &Ripple, speed: f64, motion: &Motion) -> f64 {
    passed(ripple.wave * speed.abs() / TAU, motion.cutoff_hz)
}

/// The share of a vibration that the motor must deliver while its table slides, and by what angle that is late, rad.
fn held_by_motor(vibration: &Ripple, physics: &Physics, motion: &Motion) -> (f64, f64) {
    let through = |masses: TwoMasses| masses.passes(vibration.wave, physics.slope_at(0.0));
    let (passes, late) = physics.two_masses.map_or((1.0, 0.0), through);
    (seen(vibration, 1.0, motion) * passes, late)
}

/// Torque that the motor must deliver, without ripples, for one run of rows.
fn needed_torque(physics: &Physics, observed: &Observed, run: Range<usize>) -> Vec<f64> {
    let scale = physics.motor_per_load;
    let (motion, time) = (&observed.motion, &observed.time_s);
    // Three standard deviations of what the position leaves open: less would turn on noise, more turns late. Never nothing.
    let smallest = (3.0 * motion.resolution * scale).max(1e-9 * scale);
    let travel = physics.presliding.unwrap_or(0.0).max(smallest);
    let mut transmitted = physics.two_masses.map(|masses| -> TableTorque {
        let simulated = || table_motion(physics, masses, observed, run.clone());
        let per_scale = 1.0 / physics.motor_per_load;
        let told = |scale: &Motion| {
            masses.clearance * per_scale > FINE * scale.resolution
                || is_elsewhere(physics, &masses, simulated(), observed, run.start)
        };
        let scale = (masses.clearance > 0.0).then(|| scale_motion(observed, run.clone())).flatten();
        match scale.filter(told) {
            Some(scale) => Box::new(measured_table_torque(physics, masses, observed, run.clone(), scale)),
            None => Box::new(simulated().map(|(_, torque)| torque)),
        }
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
    let mut torque = Vec::with_capacity(run.len());
    for i in run.clone() {
        let (x, v, t) = (motion.position[i], motion.velocity(i), time[i] - time[0]);
        let level = share * physics.friction_level(x, v, t);
        let dry = friction.moved((x - before) * scale, level) + friction.damped(v * scale, level);
        before = x;
        let table = match &mut transmitted {
            Some(table) => table.next().unwrap_or(0.0),
            None => physics.load(x, v, t),
        };
        torque.push(share * physics.slope_friction(v * scale) + dry + table);
    }
    drop(transmitted);
    // Friction turns round and flanks meet in an instant, and the motor's acceleration answers it: the sum is smooth, but
    // the acceleration is only known up to the cut-off. So all of it is taken up to there.
    let mut torque = smoothed(torque, observed.period_s, motion.cutoff_hz);
    for (i, torque) in run.zip(&mut torque) {
        *torque += inertia * motion.acceleration(i) * scale;
    }
    torque
}

/// Clearance over what its scale does not tell of the table's motion from which on that is better than the simulated one: the noise of a
/// scale goes with the table's mass, a simulated impact comes a row early or late and is the harder the wider the clearance. On twenty
/// random clearances the torque was off by 0.3 to 0.95 of that by the scale where this was below 80, by 0.9 to 1.4 from 100 to 220 and by
/// 1.4 and more beyond.
const FINE: f64 = 100.0;
/// Share of its clearance by which a simulated table is elsewhere than its scale has it, for the scale to be believed (root mean square
/// about the mean): one that is anywhere in it, whatever the scale says, is a third, and the right machine was 0.02 to 0.14 on those.
const ELSEWHERE: f64 = 0.3;

/// Torque of the table at the rows of a run, one after the other.
type TableTorque<'o> = Box<dyn Iterator<Item = f64> + 'o>;

/// Motion of the table by its scale; `None` where there is none, or not in every row.
fn scale_motion(observed: &Observed, run: Range<usize>) -> Option<Motion> {
    let table = observed.table_position.as_ref()?.get(run.clone())?;
    if table.iter().any(|x| !x.is_finite()) {
        return None;
    }
    Motion::estimate(&observed.time_s[run], table)
}

/// Torque that the table takes by that motion.
fn measured_table_torque<'o>(
    physics: &'o Physics,
    masses: TwoMasses,
    observed: &'o Observed,
    run: Range<usize>,
    motion: Motion,
) -> impl Iterator<Item = f64> + 'o {
    let (scale, share) = (physics.motor_per_load, masses.table_friction_share);
    let travel = physics.presliding.unwrap_or(0.0).max(10.0 * motion.resolution * scale).max(1e-9 * scale);
    let level_at_rest = physics.friction_level(motion.position[0], 0.0, 0.0);
    let mut friction = Friction::bristle(share * level_at_rest / travel);
    let mut before = motion.position[0];
    let torque = move |i: usize| {
        let (x, v, t) = (motion.position[i], motion.velocity(i), observed.time_s[run.start + i] - observed.time_s[0]);
        let dry = friction.moved((x - before) * scale, share * physics.friction_level(x, v, t));
        before = x;
        let inertia = masses.table_inertia * motion.acceleration(i) * scale;
        inertia + share * physics.slope_friction(v * scale) + dry + physics.load(x, v, t)
    };
    (0..run.len()).map(torque)
}

/// Whether a table that is simulated goes elsewhere within its clearance than its scale has it.
fn is_elsewhere(
    physics: &Physics,
    masses: &TwoMasses,
    simulated: impl Iterator<Item = (f64, f64)>,
    observed: &Observed,
    first: usize,
) -> bool {
    let Some(table) = observed.table_position.as_ref().and_then(|table| table.get(first..)) else { return false };
    let per_scale = 1.0 / physics.motor_per_load;
    let apart = |((place, _), measured): ((f64, f64), &f64)| measured - physics.table_of(place * per_scale);
    let apart = simulated.zip(table).map(apart).filter(|apart| apart.is_finite());
    let sums = |[count, sum, squares]: [f64; 3], apart: f64| [count + 1.0, sum + apart, squares + apart * apart];
    let [count, sum, squares] = apart.fold([0.0; 3], sums);
    let spread = (squares / f64::max(count, 1.0) - (sum / f64::max(count, 1.0)).powi(2)).max(0.0).sqrt();
    spread > ELSEWHERE * masses.clearance * per_scale
}

/// Speed below which an axis stands, for the phases of what it passes.
pub(super) fn standing(motion: &Motion) -> f64 {
    0.01 * rms(motion.velocities().filter(|v| v.is_finite()))
}

/// Rows that phases are estimated from: the first quarter or, where the axis moves but later, as many as hold a quarter of those in
/// which it moves. Rows at rest tell no phase.
pub(super) fn rows_for_phases(motion: &Motion) -> usize {
    let standing = standing(motion);
    let moving = || motion.velocities().enumerate().filter(|(_, v)| v.abs() > standing);
    let quarter = moving().nth(moving().count() / 4).map_or(0, |(row, _)| row);
    quarter.max(motion.position.len() / 4)
}

/// Share by which a base value may be wrong where a phase is estimated; of viscous friction also what that share of the dry one is at full
/// speed.
const WRONG: f64 = 0.3;

/// Estimates the phases of cogging and vibration from the rows for phases in which the axis moves; a ripple of which these show
/// less than half a period is silenced. Returns how many.
fn set_phases(physics: &mut Physics, observed: &Observed, delivered: &[f64], by_rows: f64) -> usize {
    let cogging = physics.cogging.len();
    let count = cogging + physics.vibration.len();
    if count == 0 {
        return 0;
    }
    let (motion, time) = (&observed.motion, &observed.time_s);
    let (standing, last) = (standing(motion), rows_for_phases(motion));
    // Beside a row without torque the one between rows is not known either.
    let left = |i: usize| physics.delivered(cubic_at(&observed.torque, i as f64 + by_rows)) - delivered[i];
    let rows = || {
        (0..last)
            .filter(|&i| motion.velocity(i).abs() > standing && motion.acceleration(i).is_finite())
            .map(|i| (i, left(i)))
            .filter(|(_, left)| left.is_finite())
    };
    let along = |k: usize, i: usize| if k < cogging { motion.position[i] } else { time[i] - time[0] };
    let mut reach = vec![(f64::INFINITY, f64::NEG_INFINITY); count];
    for (i, _) in rows() {
        for (k, (low, high)) in reach.iter_mut().enumerate() {
            (*low, *high) = (low.min(along(k, i)), high.max(along(k, i)));
        }
    }
    let ripples: Vec<Ripple> = physics.cogging.iter().chain(&physics.vibration).copied().collect();
    let shown = |k: &usize| (reach[*k].1 - reach[*k].0) * ripples[*k].wave >= std::f64::consts::PI;
    let shown: Vec<usize> = (0..count).filter(shown).collect();
    let held: Vec<(f64, f64)> = physics.vibration.iter().map(|ripple| held_by_motor(ripple, physics, motion)).collect();
    // A wrong base value must not turn the phase: it is let free beside the ripples, as far as one may be wrong. At a steady speed what
    // moves is the ripple's own answer, and the servo's to the encoder's noise, by which any base value would do.
    let mut balance = Balance::of(4 + 2 * shown.len());
    for (i, left) in rows() {
        let v = motion.velocity(i);
        let nuisance = [1.0, v, v.signum(), motion.acceleration(i)];
        let waves = shown.iter().flat_map(|&k| {
            let (share, late) = if k < cogging { (seen(&ripples[k], v, motion), 0.0) } else { held[k - cogging] };
            let angle = ripples[k].wave * along(k, i) - late;
            [share * angle.sin(), share * angle.cos()]
        });
        balance.add(nuisance.into_iter().chain(waves), left);
    }
    let fastest = motion.velocities().filter(|v| v.is_finite()).fold(0.0, |most: f64, v| most.max(v.abs()));
    let (scale, coulomb) = (physics.motor_per_load, physics.coulomb());
    let bounds = [
        coulomb + physics.constant_torque().abs(),
        WRONG * (scale * physics.slope_at(0.0) + coulomb / fastest.max(standing)),
        WRONG * coulomb,
        WRONG * scale * physics.inertia,
    ];
    let weights = balance.weights_within(&bounds);
    for (k, ripple) in physics.cogging.iter_mut().chain(&mut physics.vibration).enumerate() {
        match (shown.iter().position(|shown| *shown == k), &weights) {
            (None, _) => ripple.amplitude = 0.0,
            (Some(at), Some(weights)) => ripple.phase = weights[5 + 2 * at].atan2(weights[4 + 2 * at]),
            (Some(_), None) => {}
        }
    }
    count - shown.len()
}

/// Estimates the phases of the screw's periodic errors, and where the scale stands at the encoder's zero, from the rows for phases;
/// without a scale nothing is known of either.
fn set_table_phases(physics: &mut Physics, observed: &Observed) {
    let Some(table) = &observed.table_position else { return };
    let motion = &observed.motion;
    let mut balance = Balance::of(2 + 2 * physics.table_error.len());
    for (i, table) in table.iter().enumerate().take(rows_for_phases(motion)) {
        let x = motion.position[i];
        if !(table - x).is_finite() {
            continue;
        }
        let waves = physics.table_error.iter().flat_map(|ripple| [(ripple.wave * x).sin(), (ripple.wave * x).cos()]);
        // Lost motion turns with the direction; it must not turn the phase.
        let level_and_way = [1.0, motion.velocity(i).signum()];
        balance.add(level_and_way.into_iter().chain(waves), table - x * (1.0 + physics.table_scale));
    }
    let Some(weights) = balance.weights() else { return };
    physics.table_zero = weights[0];
    for (ripple, pair) in physics.table_error.iter_mut().zip(weights[2..].chunks_exact(2)) {
        ripple.phase = pair[1].atan2(pair[0]);
    }
}

/// Least squares of columns against a target, row by row: long recordings have no room for the columns.
struct Balance {
    /// Sums of the columns' products with each other and with the target.
    products: DMatrix<f64>,
    with_target: DVector<f64>,
    rows: usize,
    row: Vec<f64>,
}

impl Balance {
    fn of(columns: usize) -> Self {
        Self {
            products: DMatrix::zeros(columns, columns),
            with_target: DVector::zeros(columns),
            rows: 0,
            row: Vec::new(),
        }
    }

    fn add(&mut self, row: impl Iterator<Item = f64>, target: f64) {
        self.row.clear();
        self.row.extend(row);
        for (i, a) in self.row.iter().enumerate() {
            for (j, b) in self.row[..=i].iter().enumerate() {
                self.products[(i, j)] += a * b;
            }
            self.with_target[i] += a * target;
        }
        self.rows += 1;
    }

    /// The same with the first of them within bounds: the one that is farthest beyond its own is put there, until none is.
    fn weights_within(&self, bounds: &[f64]) -> Option<Vec<f64>> {
        let mut given: Vec<Option<f64>> = vec![None; self.with_target.len()];
        loop {
            let open: Vec<usize> = (0..given.len()).filter(|i| given[*i].is_none()).collect();
            let product = |i: usize, j: usize| self.products[(i.max(j), i.min(j))];
            let taken =
                |i: usize| given.iter().enumerate().filter_map(|(j, w)| Some(product(i, j) * (*w)?)).sum::<f64>();
            let rest = Self {
                products: DMatrix::from_fn(open.len(), open.len(), |i, j| product(open[i], open[j])),
                with_target: DVector::from_fn(open.len(), |i, _| self.with_target[open[i]] - taken(open[i])),
                rows: self.rows,
                row: Vec::new(),
            };
            let found = rest.weights()?;
            let beyond = |&(&i, w): &(&usize, &f64)| bounds.get(i).is_some_and(|bound| w.abs() > *bound);
            let ratio = |&(&i, w): &(&usize, &f64)| w.abs() / bounds[i].max(1e-300);
            match open.iter().zip(&found).filter(beyond).max_by(|a, b| ratio(a).total_cmp(&ratio(b))) {
                Some((&i, w)) => given[i] = Some(bounds[i].copysign(*w)),
                None => {
                    open.iter().zip(found).for_each(|(&i, w)| given[i] = Some(w));
                    return given.into_iter().collect();
                }
            }
        }
    }

    /// Weights of the columns that come closest to the target; columns are scaled first, and useless ones get nothing.
    fn weights(&self) -> Option<Vec<f64>> {
        let (n, rows) = (self.with_target.len(), self.rows as f64);
        let length = |i: usize| (self.products[(i, i)] / rows.max(1.0)).sqrt();
        let scales: Vec<f64> =
            (0..n).map(|i| Some(length(i)).filter(|length| *length > 1e-140).unwrap_or(1.0)).collect();
        let normal = DMatrix::from_fn(n, n, |i, j| self.products[(i.max(j), i.min(j))] / (scales[i] * scales[j]));
        let right = DVector::from_fn(n, |i, _| self.with_target[i] / scales[i]);
        let solved = decomposed(normal)?.solve(&right, 1e-9 * rows).ok()?;
        Some(solved.iter().zip(scales).map(|(w, s)| w / s).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_column_of_nothing_gets_nothing_and_what_is_not_finite_has_no_answer() {
        let mut balance = Balance::of(3);
        (0..8).map(f64::from).for_each(|i| balance.add([1.0, 0.0, i].into_iter(), 2.0 + 0.5 * i));
        let weights = balance.weights().unwrap();
        assert!(
            (weights[0] - 2.0).abs() < 1e-9 && weights[1].abs() < 1e-9 && (weights[2] - 0.5).abs() < 1e-9,
            "{weights:?}"
        );
        balance.add([f64::NAN, 0.0, 1.0].into_iter(), 1.0);
        assert!(balance.weights().is_none());
    }
}
