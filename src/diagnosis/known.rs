//! What a belief makes at the judged rows, by the same laws by which it would be found: what was found leaves nothing when it
//! is believed.
//!
//! Base values are the balance itself. Clearance and spring are simulated together; every other effect is the trace of its law at
//! the believed parameters. The phase of a periodic one belongs to the recording: sine and cosine are fitted to what the others
//! leave, and their amplitude is the believed one.

use super::belief;
use super::causes::{Law, Resistance, Trace, law, table_side};
use super::frame::Frame;
use super::many::dot;
use crate::machine::{Axis, Cause, Effect};
use crate::plant::friction::Friction;
use crate::plant::physics::Physics;
use nalgebra::{Matrix3, Vector3};
use std::collections::VecDeque;
use std::sync::Arc;

/// How exactly a law holds on a machine, as a share of what it makes near by.
pub const LAW_HOLDS: f64 = 1.0 / 30.0;
/// The same of the torque of a clearance, and of the way that its table goes between the flanks: an impact comes some rows early or
/// late and is harder or softer than flanks without rebound make it.
/// On twelve random clearances that were found on one recording and believed on another the rows within [`NEAR_S`] of impacts were
/// off by a tenth to a fifth of the impact, all others by noise alone.
const IMPACT_HOLDS: f64 = 0.2;
/// How near, s: what comes a little early or late is off where the law makes nothing yet.
const NEAR_S: f64 = 0.025;

/// What a belief makes at the judged rows.
#[derive(Debug, Clone, PartialEq)]
pub struct Known {
    /// Torque and table − encoder that it expects.
    pub trace: Trace,
    /// By how much its effects may be off there, because no law holds exactly, and the torque that was read, because its grid is
    /// coarse: a standard deviation.
    pub doubt: Trace,
    /// What it has that resists the table.
    pub resistance: Arc<Resistance>,
}

impl Known {
    /// Of an axis.
    #[must_use]
    pub fn of(axis: &Axis, frame: &Frame) -> Known {
        let trace = Trace { torque: frame.believed(), table: vec![0.0; frame.table_error().len()] };
        let doubt = Trace { torque: frame.coarse_torque(), table: vec![0.0; trace.table.len()] };
        let resistance = Arc::new(Resistance::of(frame, axis));
        let mut known = Known { trace, doubt, resistance };
        let apart = table_side::believed(frame, axis, &known.resistance);
        if let Some(apart) = &apart {
            let flanks = axis.effects.iter().any(|e| e.cause() == Cause::Backlash);
            known.add(frame, &[(apart, 1.0)], [if flanks { IMPACT_HOLDS } else { LAW_HOLDS }, LAW_HOLDS]);
            if flanks {
                known.doubt_crossings(frame, &apart.table);
            }
        }
        let (steady, periodic): (Vec<&Effect>, Vec<&Effect>) = axis.effects.iter().partition(|e| !has_phase(e));
        for effect in steady {
            if let (Effect::PreslidingFriction { .. }, Ok(physics)) = (effect, Physics::of(axis)) {
                known.add(frame, &[(&build_up(frame, &physics), 1.0)], [LAW_HOLDS; 2]);
                continue;
            }
            let Some((shape, coefficients)) = by_its_law(frame, effect) else { continue };
            let regressors = known.regressors(frame, effect, shape);
            known.add(frame, &regressors.iter().zip(coefficients).collect::<Vec<_>>(), [LAW_HOLDS; 2]);
        }
        let mut shaking = Vec::new();
        for effect in periodic {
            let Some((shape, coefficients)) = by_its_law(frame, effect) else { continue };
            if let ([sine, cosine], [amplitude]) =
                (known.regressors(frame, effect, shape.clone()).as_slice(), coefficients.as_slice())
            {
                let (a, b) = phase(frame, &known.trace, sine, cosine);
                let amplitude = amplitude * belief::felt(axis, effect);
                known.add(frame, &[(sine, amplitude * a), (cosine, amplitude * b)], [LAW_HOLDS; 2]);
                if law(effect.cause()).is_shaking() {
                    shaking.push((law(effect.cause()), shape, [amplitude * a, amplitude * b]));
                }
            }
        }
        if let (Some(apart), false) = (&apart, shaking.is_empty()) {
            known.shake(frame, axis, apart, &shaking);
        }
        known
    }

    /// Takes it that causes with these numbers shake the table, of which this was the trace without them.
    fn shake(&mut self, frame: &Frame, axis: &Axis, apart: &Trace, shaking: &[(&Law, Vec<f64>, [f64; 2])]) {
        let shaken =
            |under: Resistance, (law, shape, c): &(&Law, Vec<f64>, [f64; 2])| under.shaken_by(frame, law, shape, c);
        let resistance = shaking.iter().fold((*self.resistance).clone(), shaken);
        if let Some(trace) = table_side::believed(frame, axis, &resistance) {
            for (sum, now, before) in [
                (&mut self.trace.torque, &trace.torque, &apart.torque),
                (&mut self.trace.table, &trace.table, &apart.table),
            ] {
                sum.iter_mut().zip(now.iter().zip(before)).for_each(|(sum, (now, before))| *sum += now - before);
            }
        }
        self.resistance = Arc::new(resistance);
    }

    fn regressors(&self, frame: &Frame, effect: &Effect, shape: Vec<f64>) -> Vec<Trace> {
        law(effect.cause()).terms(frame, &self.resistance, &[shape]).swap_remove(0).regressors
    }

    /// Adds an effect as traces with their factors; it holds so exactly in torque and table − encoder.
    fn add(&mut self, frame: &Frame, traces: &[(&Trace, f64)], [in_torque, in_table]: [f64; 2]) {
        let channel = |of: fn(&Trace) -> &Vec<f64>, holds: f64, sum: &mut [f64], doubt: &mut [f64]| {
            let mut own = vec![0.0; sum.len()];
            for (trace, factor) in traces {
                own.iter_mut().zip(of(trace)).for_each(|(own, value)| *own += factor * value);
            }
            sum.iter_mut().zip(&own).for_each(|(sum, own)| *sum += own);
            own.iter_mut().for_each(|own| *own = own.abs());
            let most = largest_near(&frame.kept, reach(frame), &own);
            doubt.iter_mut().zip(most).for_each(|(doubt, most)| *doubt = doubt.hypot(holds * most));
        };
        channel(|t| &t.torque, in_torque, &mut self.trace.torque, &mut self.doubt.torque);
        channel(|t| &t.table, in_table, &mut self.trace.table, &mut self.doubt.table);
    }

    /// Doubts where a table is between the flanks, by how far it goes near by and may be from either: how one that rests between them
    /// came there nobody knows.
    fn doubt_crossings(&mut self, frame: &Frame, table: &[f64]) {
        let back: Vec<f64> = table.iter().map(|x| -x).collect();
        let [most, least] = [table, &back].map(|values| largest_near(&frame.kept, reach(frame), values));
        let flank = table.iter().copied().fold(0.0, f64::max);
        let between = table.iter().map(|x| 2.0 * (flank - x.abs()));
        let ways = most.iter().zip(&least).zip(between).map(|((most, least), between)| between.max(most + least));
        self.doubt.table.iter_mut().zip(ways).for_each(|(doubt, way)| *doubt = doubt.hypot(IMPACT_HOLDS * way));
    }
}

/// [`NEAR_S`] in rows.
fn reach(frame: &Frame) -> usize {
    (NEAR_S / frame.columns.period_s) as usize
}

/// The largest among the judged rows that are no more than `reach` rows from each of them.
fn largest_near(kept: &[usize], reach: usize, values: &[f64]) -> Vec<f64> {
    // Places that may still hold the largest of some row ahead, in order: each is larger than all after it.
    let mut candidates: VecDeque<usize> = VecDeque::new();
    let mut end = 0;
    let near = |&row: &usize| {
        while end < values.len() && kept[end] <= row + reach {
            while candidates.back().is_some_and(|&last| values[last] <= values[end]) {
                candidates.pop_back();
            }
            if !values[end].is_nan() {
                candidates.push_back(end);
            }
            end += 1;
        }
        while candidates.front().is_some_and(|&first| kept[first] + reach < row) {
            candidates.pop_front();
        }
        candidates.front().map_or(0.0, |&first| values[first])
    };
    kept.iter().take(values.len()).map(near).collect()
}

/// What friction that builds up is short of friction that is there at once. By the simulation's law: all of its level builds up, with
/// what low speed, a place or the time adds to it.
fn build_up(frame: &Frame, physics: &Physics) -> Trace {
    let level = table_side::level(frame, physics, &frame.v);
    let damped = |friction: &mut Friction, i: usize| friction.damped(frame.v[i] * frame.unit, level[i]);
    let dry = table_side::built_up(frame, physics.bristle(1.0), &level, damped);
    let short: Vec<f64> = dry.iter().zip(table_side::at_once(frame, &level)).map(|(dry, all)| dry - all).collect();
    Trace::torque(frame.judged(&short))
}

/// Whether an effect is periodic: its phase is the recording's own.
#[must_use]
pub fn has_phase(effect: &Effect) -> bool {
    use Effect::*;
    matches!(effect, Cogging { .. } | ExternalVibration { .. } | ScrewPeriodicError { .. })
}

/// Cosine and sine of the phase at which the wave fits best what `sum` leaves beside a constant; nothing where it leaves nothing.
fn phase(frame: &Frame, sum: &Trace, sine: &Trace, cosine: &Trace) -> (f64, f64) {
    let in_torque = !sine.torque.is_empty();
    let (measured, expected) =
        if in_torque { (frame.torque(0.0), &sum.torque) } else { (frame.table_error(), &sum.table) };
    let weight = |k: usize| if in_torque { frame.weights[k] } else { 1.0 };
    let weighted = |values: &[f64]| -> Vec<f64> { values.iter().enumerate().map(|(k, v)| weight(k) * v).collect() };
    let rest: Vec<f64> = measured.iter().zip(expected).map(|(m, e)| m - e).collect();
    let wave = |trace: &Trace| weighted(if in_torque { &trace.torque } else { &trace.table });
    let (rest, columns) = (weighted(&rest), [wave(sine), wave(cosine), weighted(&vec![1.0; rest.len()])]);
    let normal = Matrix3::from_fn(|i, j| dot(&columns[i], &columns[j]));
    let right = Vector3::from_fn(|i, _| dot(&columns[i], &rest));
    let Some(found) = normal.try_inverse().map(|inverse| inverse * right) else { return (0.0, 0.0) };
    let size = found[0].hypot(found[1]);
    if size > 0.0 && size.is_finite() { (found[0] / size, found[1] / size) } else { (0.0, 0.0) }
}

/// The law of a believed effect with its non-linear parameters; `None` for what the balance takes care of.
#[must_use]
pub fn numbers(axis: &Axis, frame: &Frame, effect: &Effect) -> Option<(&'static Law, Vec<f64>)> {
    let shape = match *effect {
        Effect::Backlash { width_um, table_inertia_share, table_friction_share, contact_hz, .. } => {
            vec![width_um, table_inertia_share, table_friction_share, contact_hz]
        }
        Effect::DriveCompliance { .. } => table_side::swing_of(&axis.two_masses().ok()??),
        _ => by_its_law(frame, effect)?.0,
    };
    Some((law(effect.cause()), shape))
}

/// Non-linear parameters and coefficients of the effect's law; of periodic ones the amplitude. `None` for what the balance or the
/// simulation of the table takes care of.
fn by_its_law(frame: &Frame, effect: &Effect) -> Option<(Vec<f64>, Vec<f64>)> {
    use Effect::*;
    let (low, high) = frame.stroke();
    let stroke = high - low;
    let seconds = frame.seconds(frame.x.len().checked_sub(1)?);
    let peak = || frame.columns.torque.iter().fold(0.0, |m: f64, t| m.max(t.abs()));
    Some(match *effect {
        DirectionDependentFriction { asymmetry } => (vec![], vec![asymmetry]),
        StribeckFriction { torque, velocity_mm_s, exponent } => (vec![velocity_mm_s, exponent], vec![torque]),
        PreslidingFriction { displacement_um, exponent, maxwell_slip, micro_damping_s } => (
            vec![displacement_um, exponent, maxwell_slip],
            vec![frame.belief.coulomb, frame.belief.coulomb * micro_damping_s],
        ),
        Cogging { amplitude, period_mm } => (vec![stroke / period_mm], vec![amplitude]),
        PositionDependentFriction { centre_mm, peak, width_mm, steepness } => {
            (vec![(centre_mm - low) / stroke, width_mm / stroke, steepness], vec![peak])
        }
        CableForce { slope, zero_mm } => (vec![1.0], vec![slope, -slope * zero_mm]),
        QuadraticDrag { drag } => (vec![], vec![drag]),
        ThermalDrift { drop, time_constant_s, until_s } => {
            (vec![time_constant_s / seconds, until_s / seconds], vec![drop])
        }
        ExternalVibration { frequency_hz, amplitude } => (vec![frequency_hz * seconds], vec![amplitude]),
        TorqueSaturation { limit, slope_ratio } => (vec![limit / peak()], vec![1.0 - slope_ratio]),
        ScrewPitchError { scale_um_m } => (vec![], vec![scale_um_m]),
        ScrewPeriodicError { amplitude_um, period_mm } => (vec![stroke / period_mm], vec![1e-3 * amplitude_um]),
        InertiaMismatch { .. }
        | CoulombFrictionMismatch { .. }
        | ViscousFrictionMismatch { .. }
        | ConstantTorque { .. }
        | DeadTime { .. }
        | Backlash { .. }
        | DriveCompliance { .. } => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_near_is_that_of_all_rows_near() {
        let mut noise = crate::plant::noise::Noise::new(3);
        for reach in [0, 1, 7, 25, 1000] {
            let mut kept = vec![0];
            // Rows in a row, and holes between them that are longer than the reach.
            (0..400).for_each(|k| kept.push(kept[k] + if noise.uniform() < 0.9 { 1 } else { 40 }));
            // Coarse, so that many are equal, and some are no numbers.
            let value = |_| (6.0 * noise.uniform() - 3.0).round() * if noise.uniform() < 0.05 { f64::NAN } else { 1.0 };
            let values: Vec<f64> = (0..kept.len() - 3).map(value).collect();
            let found = largest_near(&kept, reach, &values);
            assert_eq!(found.len(), values.len());
            for (row, found) in kept.iter().zip(found) {
                let near = kept.iter().zip(&values).filter(|(other, _)| other.abs_diff(*row) <= reach);
                let most = near.fold(f64::NEG_INFINITY, |most, (_, value)| most.max(*value));
                assert_eq!(if most.is_finite() { most } else { 0.0 }, found);
            }
        }
    }
}
