//! Whether a torque column is late. A servo answers the noise of its encoder, so that the torque and the acceleration that is read off the
//! same encoder share what is fast and none of the machine's, and the torque moved up or down a little goes better with it. What moves the
//! axis is slow, and late by the same time through a low-pass of four times the width, which leaves hardly anything of that noise.

use super::fit::{Bench, Fit};
use super::frame::Frame;
use super::known::Known;
use super::quiet::wider;
use super::uncertainty;
use crate::machine::{Axis, Cause};

/// Deviations between what the two say from which on they contradict each other.
const APART: f64 = 3.0;
/// Share of a delay below which the wider one does not bear it out.
const BORNE_OUT: f64 = 0.5;
/// Most steps of a fit, of the delay alone and of all that stays.
const STEPS: usize = 4;
/// Rows that the wider low-pass must keep: one in so many.
const FEWER_ROWS: usize = 16;

/// A set of causes without a delay that is none; `None` where there is no such. `kept` is what of the axis is believed.
#[must_use]
pub fn left_out(bench: &Bench, kept: &Axis, fit: &Fit) -> Option<Fit> {
    let at = fit.parts.iter().position(|part| part.law.cause == Cause::DeadTime).filter(|_| fit.table().is_none())?;
    let frame = bench.frame;
    let width = wider(frame);
    let wide = Frame::new(frame.axis, frame.columns, Some(2 * width + 1));
    if wide.kept.len() < frame.kept.len() / FEWER_ROWS {
        return None;
    }
    let on_wide = Bench::new(&wide, &Known::of(kept, &wide));
    let order = (0..fit.parts.len()).filter(|i| *i != at).chain([at]);
    let parts = order.flat_map(|i| on_wide.parts(fit.parts[i].law, vec![fit.parts[i].shape.clone()])).collect();
    let there = on_wide.refine(on_wide.fit(parts), fit.parts.len() - 1, STEPS);
    let delay = |bench: &Bench, fit: &Fit, at: usize| {
        let (effect, deviations) = uncertainty::effects(bench, fit, None).swap_remove(at)?;
        Some((*effect.values().first()?, *deviations.first()?))
    };
    let here = delay(bench, fit, at)?;
    let far = delay(&on_wide, &there, fit.parts.len() - 1)?;
    is_contradicted(here, far).then(|| bench.refine(bench.without(fit, at), 0, STEPS))
}

/// Whether a delay with its deviation is not that of the wider look.
fn is_contradicted((here, sure): (f64, f64), (far, unsure): (f64, f64)) -> bool {
    (here - far).abs() > APART * sure.hypot(unsure) && far / here < BORNE_OUT
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::belief::base_alone;
    use crate::diagnosis::causes::law;
    use crate::diagnosis::excerpt::Excerpt;
    use crate::machine::{Effect, Machine};
    use crate::plant::moves::{Moves, Reach};
    use crate::plant::simulate::{Sensors, Setup, simulate};
    use crate::recording::{Column, Recording};

    #[test]
    fn a_delay_is_borne_out_by_the_same_through_a_wider_low_pass() {
        assert!(is_contradicted((-1.08, 0.14), (0.07, 0.08)) && is_contradicted((-0.51, 0.14), (-0.03, 0.01)));
        assert!(!is_contradicted((-3.32, 0.15), (-2.88, 0.09)) && !is_contradicted((0.22, 0.003), (0.1, 0.11)));
    }

    #[test]
    fn a_delay_that_is_one_stays_beside_much_noise_of_the_encoder() {
        let belief = Machine::parse(include_str!("../../examples/machines/believed.json")).unwrap().axes.remove(0);
        let reach = Reach { start: 20.0, stroke: 200.0, speed: 250.0, acceleration: 2500.0 };
        let mut command = Moves::built_in("test", &reach).unwrap().command(1e-3);
        command.truncate(15_000);
        let sensors = Sensors { grid_um: 1.0, noise_um: 0.3, torque_noise: 0.01, ..Sensors::default() };
        for delay_ms in [-0.9, 0.4, 1.3] {
            let truth = belief.with_effects(vec![Effect::DeadTime { delay_ms }]);
            let trace = simulate(&truth, &command, &Setup { seed: 1, sensors, ..Setup::default() }).unwrap();
            let columns = vec![Column::new("x.position_mm", trace.position), Column::new("x.torque_nm", trace.torque)];
            let recording = Recording::from_columns("simulated", trace.time_s, columns).unwrap();
            let whole = Excerpt::of(&recording, &belief).columns.unwrap();
            let (base, thinned) = (base_alone(&belief), whole.thinned());
            let frame = Frame::new(&base, &thinned, None);
            let bench = Bench::new(&frame, &Known::of(&belief, &frame));
            let fit = bench.refine(bench.fit(bench.parts(law(Cause::DeadTime), vec![vec![delay_ms]])), 0, STEPS);
            assert!(left_out(&bench, &belief, &fit).is_none(), "{delay_ms} ms");
        }
    }
}
