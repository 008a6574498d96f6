//! What torque and acceleration only share. A servo answers the noise of its encoder, so that the torque and the acceleration that is
//! read off the same encoder hold what is fast and none of the machine's. The torque moved up or down a little then goes better with it,
//! and so does another inertia. What moves the axis is slow, and late by the same time and as heavy through a low-pass of four times the
//! width, which leaves hardly anything of that noise.

use super::fit::{Bench, Fit};
use super::frame::Frame;
use super::known::Known;
use super::quiet::wider;
use super::uncertainty;
use crate::machine::{Axis, Cause, Effect};

/// What may be nothing else.
const SHARED: [Cause; 2] = [Cause::DeadTime, Cause::InertiaMismatch];
/// Deviations between what the two say from which on they contradict each other.
const APART: f64 = 3.0;
/// Share of a number below which the wider one does not bear it out.
const BORNE_OUT: f64 = 0.5;
/// Most steps of a fit, of the number alone and of all that stays.
const STEPS: usize = 4;
/// Rows that the wider low-pass must keep: one in so many.
const FEWER_ROWS: usize = 16;

/// A set of causes without a delay or an inertia that is none; `None` where there is no such. `kept` is what of the axis is believed.
#[must_use]
pub fn left_out(bench: &Bench, kept: &Axis, fit: &Fit) -> Option<Fit> {
    if fit.table().is_some() || !fit.parts.iter().any(|part| SHARED.contains(&part.law.cause)) {
        return None;
    }
    let frame = bench.frame;
    let wide = Frame::new(frame.axis, frame.columns, Some(2 * wider(frame) + 1));
    if wide.kept.len() < frame.kept.len() / FEWER_ROWS {
        return None;
    }
    let on_wide = Bench::new(&wide, &Known::of(kept, &wide));
    let mut stays: Option<Fit> = None;
    for cause in SHARED {
        let fit = stays.as_ref().unwrap_or(fit);
        let Some(at) = fit.parts.iter().position(|part| part.law.cause == cause) else { continue };
        let order = (0..fit.parts.len()).filter(|i| *i != at).chain([at]);
        let parts = order.flat_map(|i| on_wide.parts(fit.parts[i].law, vec![fit.parts[i].shape.clone()])).collect();
        let there = on_wide.refine(on_wide.fit(parts), fit.parts.len() - 1, STEPS);
        let (here, far) = (number(bench, fit, at), number(&on_wide, &there, fit.parts.len() - 1));
        if here.zip(far).is_some_and(|(here, far)| is_contradicted(here, far)) {
            stays = Some(bench.refine(bench.without(fit, at), 0, STEPS));
        }
    }
    stays
}

/// How late the torque is, or by how much the inertia is another, of a part that is one of these; and its deviation.
fn number(bench: &Bench, fit: &Fit, at: usize) -> Option<(f64, f64)> {
    let (effect, deviations) = uncertainty::effects(bench, fit, None).swap_remove(at)?;
    let value = match effect {
        Effect::InertiaMismatch { inertia } => inertia - bench.frame.belief.inertia,
        other => *other.values().first()?,
    };
    Some((value, *deviations.first()?))
}

/// Whether a number with its deviation is not that of the wider look.
fn is_contradicted((here, sure): (f64, f64), (far, unsure): (f64, f64)) -> bool {
    (here - far).abs() > APART * sure.hypot(unsure) && far / here < BORNE_OUT
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::belief::base_alone;
    use crate::diagnosis::causes::law;
    use crate::diagnosis::excerpt::Excerpt;
    use crate::machine::Machine;
    use crate::plant::moves::{Moves, Reach};
    use crate::plant::simulate::{Sensors, Setup, simulate};
    use crate::recording::{Column, Recording};

    /// The rig of the demonstration with a motor that has no lag.
    fn belief() -> Axis {
        let rig = include_str!("../../examples/machines/believed.json");
        let mut axis = Machine::parse(rig).unwrap().axes.remove(0);
        axis.servo.as_mut().unwrap().torque_time_constant_s = 0.0;
        axis
    }

    /// What is found of a cause that starts there, and what is left of it, by a recording of the rig with an effect.
    fn found(hidden: Effect, start: Vec<f64>, acceleration: f64, sensors: Sensors) -> ((f64, f64), bool) {
        let belief = belief();
        let reach = Reach { start: 20.0, stroke: 200.0, speed: 250.0, acceleration };
        let mut command = Moves::built_in("test", &reach).unwrap().command(1e-3);
        command.truncate(20_000);
        let truth = belief.with_effects(vec![hidden]);
        let trace = simulate(&truth, &command, &Setup { seed: 1, sensors, ..Setup::default() }).unwrap();
        let columns = vec![Column::new("x.position_mm", trace.position), Column::new("x.torque_nm", trace.torque)];
        let recording = Recording::from_columns("simulated", trace.time_s, columns).unwrap();
        let whole = Excerpt::of(&recording, &belief).columns.unwrap();
        let (base, thinned) = (base_alone(&belief), whole.thinned());
        let frame = Frame::new(&base, &thinned, None);
        let bench = Bench::new(&frame, &Known::of(&belief, &frame));
        let fit = bench.refine(bench.fit(bench.parts(law(hidden.cause()), vec![start])), 0, STEPS);
        (number(&bench, &fit, 0).unwrap(), left_out(&bench, &belief, &fit).is_none())
    }

    #[test]
    fn a_number_is_borne_out_by_the_same_through_a_wider_low_pass() {
        assert!(is_contradicted((-1.08, 0.14), (0.07, 0.08)) && is_contradicted((-0.51, 0.14), (-0.03, 0.01)));
        assert!(!is_contradicted((-3.32, 0.15), (-2.88, 0.09)) && !is_contradicted((0.22, 0.003), (0.1, 0.11)));
    }

    #[test]
    fn a_delay_that_is_one_stays_beside_much_noise_of_the_encoder() {
        let sensors = Sensors { grid_um: 1.0, noise_um: 0.3, torque_noise: 0.01, ..Sensors::default() };
        for delay_ms in [-0.9, 0.4, 1.3] {
            let (_, stays) = found(Effect::DeadTime { delay_ms }, vec![delay_ms], 2500.0, sensors);
            assert!(stays, "{delay_ms} ms");
        }
    }

    #[test]
    fn a_mass_stays_and_what_is_only_shared_of_the_encoder_does_not() {
        let believed = belief().belief().inertia;
        let of = |inertia: f64, acceleration: f64, noise_um: f64| {
            let sensors = Sensors { grid_um: 1.2, noise_um, torque_noise: 0.01, ..Sensors::default() };
            found(Effect::InertiaMismatch { inertia }, vec![], acceleration, sensors)
        };
        // A motor without a lag answers that noise at once, and its table hardly speeds up.
        let ((lighter, deviation), stays) = of(believed, 250.0, 0.6);
        assert!(lighter < -0.3 * believed && lighter < -4.0 * deviation, "{lighter} ± {deviation}");
        assert!(!stays);
        for share in [0.8, 1.15] {
            assert!(of(share * believed, 2500.0, 0.0).1, "{share}");
        }
    }
}
