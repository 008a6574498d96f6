//! A disturbance periodic in time, not in position: amplitude·sin(2π·f·t + phase); pumps, fans, neighbours.
//!
//! It shakes the table. Behind a spring the motor holds that through it, and as far as the spring gives the table swings against the motor:
//! while it slides, as the regressors have it. What friction makes of that at rest and about reversals is simulated with the spring.

use super::*;
use crate::diagnosis::many::sines_and_cosines;
use std::f64::consts::TAU;

/// Parameter: periods over the recording. Coefficients: sine and cosine of what the motor holds.
pub static LAW: Law = Law {
    cause: Cause::ExternalVibration,
    scales: &[Scale::Linear(3.0, 1e9, 0.02)],
    starts: |frame, rest| periods::along_time(frame, rest.torque),
    manner: Manner { starts_from_rest: true, ..PLAIN },
    terms: Terms::Shaking(
        |frame, link, shapes| {
            each(shapes, |shape| {
                let per_second = shape[0] / duration(frame);
                let (sine, cosine) = waves(frame, per_second, 0.0);
                let swings = link.map(|link| swings(frame, link, TAU * per_second, [&sine, &cosine]));
                let held = [sine, cosine].map(|wave| frame.judged_instants(&wave));
                let trace = |(torque, table)| Trace { torque, table };
                Term { fixed: None, regressors: held.into_iter().zip(swings.unwrap_or_default()).map(trace).collect() }
            })
        },
        |frame, shape, coefficients| {
            let &[sine, cosine] = coefficients else { return None };
            let per_second = shape.first()? / duration(frame);
            let (sines, cosines) = waves(frame, per_second, 0.5 * frame.columns.period_s);
            let sum = |a: f64, b: f64| sines.iter().zip(&cosines).map(|(s, c)| a * s + b * c).collect();
            Some(Shaking { omega: TAU * per_second, held: sum(sine, cosine), quarter: sum(-cosine, sine) })
        },
    ),
    effect: |frame, shape, c| {
        let [sine, cosine] = c.try_into().ok()?;
        let frequency_hz = shape.first()? / duration(frame);
        Some(Effect::ExternalVibration { frequency_hz, amplitude: f64::hypot(sine, cosine) })
    },
    confused_with: &[Cause::Cogging, Cause::DriveCompliance],
    sentence: |effect, axis| match effect {
        Effect::ExternalVibration { frequency_hz, amplitude } => format!(
            "A disturbance of ±{} {} beats at {} Hz whatever the axis does: look for a pump, a fan or a neighbouring machine.",
            say(*amplitude),
            unit(axis),
            say(*frequency_hz)
        ),
        _ => String::new(),
    },
};

/// Sine and cosine at so many periods a second, some seconds after each row.
fn waves(frame: &Frame, per_second: f64, after_s: f64) -> (Vec<f64>, Vec<f64>) {
    let turns: Vec<f64> = (0..frame.x.len()).map(|i| per_second * (frame.seconds(i) + after_s)).collect();
    sines_and_cosines(&turns)
}

/// How the table swings against the motor, load units, at the judged rows, where the motor holds a sine and a cosine of angular frequency ω
/// through a spring: −1/(k + iωd) of them.
fn swings(frame: &Frame, link: &TwoMasses, omega: f64, [sine, cosine]: [&[f64]; 2]) -> [Vec<f64>; 2] {
    let (elastic, damped) = (link.stiffness, link.damping * omega);
    let per = -1.0 / (frame.unit * (elastic * elastic + damped * damped));
    let mixed = |a: &[f64], by: f64, b: &[f64]| -> Vec<f64> {
        frame.low_passed(&a.iter().zip(b).map(|(a, b)| per * (elastic * a + by * b)).collect::<Vec<_>>())
    };
    [mixed(sine, -damped, cosine), mixed(cosine, damped, sine)]
}

fn duration(frame: &Frame) -> f64 {
    frame.columns.time_s.last().map_or(1.0, |end| end - frame.columns.time_s[0])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::frame::Columns;
    use crate::machine::Machine;

    /// While a table slides one way the simulation of it makes of a vibration what the regressors say, in torque and in place; one that is
    /// held by its friction is not moved by it.
    #[test]
    fn a_sliding_table_swings_as_the_regressors_have_it_and_a_resting_one_does_not() {
        let axis = Machine::parse(include_str!("../../../examples/machines/believed.json")).unwrap().axes.remove(0);
        let spring = Effect::DriveCompliance {
            resonance_hz: 55.0,
            stiffness_n_um: 30.0,
            table_inertia_share: 0.3,
            table_friction_share: 0.7,
            damping_ratio: 0.05,
        };
        let behind = axis.with_effects(vec![spring]);
        let still = 4.0;
        let position: Vec<f64> = (0..8000).map(|i| 20.0 + 30.0 * (f64::from(i) * 1e-3).min(still)).collect();
        let torque = vec![0.0; position.len()];
        let columns = Columns { table: Some(position.clone()), ..Columns::every_millisecond(position, torque) };
        let mut frame = Frame::new(&axis, &columns, Some(3));
        // All rows, at rest as well.
        frame.kept = (100..7900).collect();
        let (shape, held) = (vec![30.0 * duration(&frame)], [0.06, -0.08]);
        let unshaken = Resistance::of(&frame, &behind);
        let shaken = unshaken.clone().shaken_by(&frame, &LAW, &shape, &held);
        let term = |law: &Law, under: &Resistance, shape: Vec<f64>| law.terms(&frame, under, &[shape]).swap_remove(0);
        let made = |under: &Resistance| table_side::terms(&frame, under, &[Some(spring)]).swap_remove(0).fixed.unwrap();
        let ([with, without], waves) = ([&shaken, &unshaken].map(made), term(&LAW, &unshaken, shape).regressors);
        type Channel = fn(&Trace) -> &[f64];
        for channel in [(|t| &t.torque) as Channel, |t| &t.table] {
            let wave = |k: usize| held[0] * channel(&waves[0])[k] + held[1] * channel(&waves[1])[k];
            // What the simulation shows beside the regressors.
            let beside = |k: usize| channel(&with)[k] - channel(&without)[k];
            let rms = |of: &dyn Fn(usize) -> f64, rows: std::ops::Range<usize>| {
                (rows.clone().map(|k| of(k).powi(2)).sum::<f64>() / rows.len() as f64).sqrt()
            };
            let (sliding, resting) = (1500..3800, 6000..7700);
            let all = rms(&wave, sliding.clone());
            assert!(all > 0.0 && rms(&beside, sliding.clone()) < 0.02 * all, "{} of {all}", rms(&beside, sliding));
            // There it takes off all that the regressors have, up to where the table came to rest.
            let whole = |k: usize| beside(k) + wave(k);
            let change = |k: usize| whole(k) - whole(k - 1);
            assert!(rms(&change, resting.clone()) < 1e-3 * all, "{} of {all}", rms(&change, resting));
        }
    }
}
