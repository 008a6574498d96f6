//! What a belief makes at the judged rows, by the same laws by which it would be found: what was found leaves nothing when it
//! is believed.
//!
//! Base values are the balance itself. Clearance and spring are simulated together; every other effect is the trace of its law at
//! the believed parameters. The phase of a periodic one belongs to the recording: sine and cosine are fitted to what the others
//! leave, and their amplitude is the believed one.

use super::causes::{Trace, law, table_side};
use super::frame::Frame;
use super::many::dot;
use crate::machine::{Axis, Effect};
use nalgebra::{Matrix3, Vector3};

/// Torque and table − encoder that the belief expects at the judged rows.
#[must_use]
pub fn trace(axis: &Axis, frame: &Frame) -> Trace {
    let mut sum = Trace { torque: frame.believed(), table: vec![0.0; frame.table_error().len()] };
    if let Some(apart) = table_side::believed(frame, axis) {
        add(&mut sum, &apart, 1.0);
    }
    let (steady, periodic): (Vec<&Effect>, Vec<&Effect>) = axis.effects.iter().partition(|e| !has_phase(e));
    for effect in steady {
        let Some((shape, coefficients)) = by_its_law(frame, effect) else { continue };
        for (regressor, c) in regressors(frame, effect, shape).iter().zip(coefficients) {
            add(&mut sum, regressor, c);
        }
    }
    for effect in periodic {
        let Some((shape, coefficients)) = by_its_law(frame, effect) else { continue };
        if let ([sine, cosine], [amplitude]) = (regressors(frame, effect, shape).as_slice(), coefficients.as_slice()) {
            let (a, b) = phase(frame, &sum, sine, cosine);
            add(&mut sum, sine, amplitude * a);
            add(&mut sum, cosine, amplitude * b);
        }
    }
    sum
}

fn regressors(frame: &Frame, effect: &Effect, shape: Vec<f64>) -> Vec<Trace> {
    (law(effect.cause()).terms)(frame, &[shape]).swap_remove(0).regressors
}

fn add(sum: &mut Trace, trace: &Trace, factor: f64) {
    sum.torque.iter_mut().zip(&trace.torque).for_each(|(sum, t)| *sum += factor * t);
    sum.table.iter_mut().zip(&trace.table).for_each(|(sum, t)| *sum += factor * t);
}

fn has_phase(effect: &Effect) -> bool {
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
