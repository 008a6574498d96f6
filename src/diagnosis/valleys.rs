//! What lies between motor and table has several valleys. A drive winds up as far under half of the friction with half of the
//! stiffness, and flanks that are soft and have hardly any play are a spring: a fit goes down to the bottom of the valley in which
//! it began. Once the other causes are known the next ones are looked into.

use super::causes::{Law, loose_spring, table_side};
use super::fit::{Bench, Fit};
use super::judge::{Excess, LITTLE_LEFT};
use super::progress::{Stopped, Watch};
use super::select::{NUMBER_PRICE, is_physical, price};
use crate::machine::{Cause, Effect};

/// Most steps of a fit by itself, and with all the others.
const STEPS: [usize; 2] = [6, 4];
/// Of the starts of a spring in place of a clearance one in so many is tried, where nothing shakes it.
const EVERY: usize = 3;
/// Damping ratios at which a spring is begun with in place of flanks, which are damped more.
const DAMPED: [f64; 2] = [0.03, 0.15];

/// The fit, or the same causes in a better valley of what is simulated.
///
/// # Errors
/// [`Stopped`] when the watch's caller said so.
pub fn settled(bench: &Bench, laws: &[&'static Law], fit: Fit, watch: &Watch) -> Result<Fit, Stopped> {
    let Some(at) = fit.table() else { return Ok(fit) };
    if Excess::of(bench, &fit, &fit).largest() <= LITTLE_LEFT {
        return Ok(without_hair_of_play(bench, laws, fit, at));
    }
    let part = &fit.parts[at];
    let beside = bench.without(&fit, at);
    let others = &beside.parts;
    // A table that is shaken near its own frequency seems to have another, or flanks, as long as nobody knows that it is.
    let shaken = others.iter().any(|part| part.law.is_shaking());
    let imitated = part.law.cause == Cause::Backlash || shaken && part.law.cause == Cause::DriveCompliance;
    let spring = laws.iter().filter(|law| law.cause == Cause::DriveCompliance && imitated);
    let every = if shaken { 1 } else { EVERY };
    let as_spring = spring.map(|&law| (law, bench.starts(law, &beside).into_iter().step_by(every).collect()));
    let tried: Vec<(&'static Law, Vec<Vec<f64>>)> =
        as_spring.chain([(part.law, (part.law.manner.valleys)(&part.shape))]).collect();
    let found = watch.each(&tried, (0.9, 0.9), "looking into other valleys", |(law, shapes)| {
        in_its_place(bench, &fit, &beside, law, shapes.clone())
    })?;
    Ok(found.into_iter().flatten().chain([fit]).min_by(|a, b| price(a).total_cmp(&price(b))).unwrap_or(beside))
}

/// A set with a law in place of its table, from the best of these starts; `None` beyond physical bounds. `beside` is the set without the
/// table.
fn in_its_place(bench: &Bench, set: &Fit, beside: &Fit, law: &'static Law, starts: Vec<Vec<f64>>) -> Option<Fit> {
    let with = |own| bench.fit(beside.parts.iter().cloned().chain([own]).collect());
    let starts = bench.parts_under(law, starts, &bench.resistance_of(set)).into_iter().map(with);
    let start = starts.min_by(|a, b| price(a).total_cmp(&price(b)))?;
    let there = bench.refine_roughly(start, beside.parts.len(), STEPS[0]);
    Some(bench.refine(there, 0, STEPS[1])).filter(|fit| is_physical(bench, fit))
}

/// The fit with a spring in place of flanks that give more than they are apart, where that leaves no more than play may cost: then the
/// simpler cause is what there is.
fn without_hair_of_play(bench: &Bench, laws: &[&'static Law], fit: Fit, at: usize) -> Fit {
    let (part, frame) = (&fit.parts[at], bench.frame);
    let spring = laws.iter().find(|law| law.cause == Cause::DriveCompliance);
    let Some(spring) = spring.filter(|_| part.law.cause == Cause::Backlash && !loose_spring::is(part)) else {
        return fit;
    };
    // Rows may show less play than they can tell.
    let masses = table_side::split(frame, Effect::from_values(Cause::Backlash, &part.shape));
    let starts = DAMPED.iter().filter_map(|damping| table_side::as_spring(frame, masses.as_ref()?, *damping)).collect();
    let there = in_its_place(bench, &fit, &bench.without(&fit, at), spring, starts);
    there.filter(|there| price(there) < price(&fit) + NUMBER_PRICE).unwrap_or(fit)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::by_loop::tests::{clearance, recorded_over, rig};
    use crate::diagnosis::causes::{LAWS, law};
    use crate::diagnosis::frame::Frame;
    use crate::diagnosis::known::Known;

    /// A set of one law that begins there, refined, and what becomes of it where these are hidden under this noise of the torque, N·m.
    fn settled_from(hidden: &[Effect], noise: f64, law: &'static Law, shape: &[f64]) -> [(Cause, Vec<f64>); 2] {
        let excerpt = recorded_over("test", hidden, [0.05, noise]);
        let (columns, axis) = (excerpt.columns.as_ref().unwrap().clone().thinned(), rig());
        let frame = Frame::new(&axis, &columns, None);
        let bench = Bench::new(&frame, &Known::of(&axis, &frame));
        let begun = bench.fit(bench.parts(law, vec![shape.to_vec()]));
        let found = bench.refine(begun, 0, 8);
        let watch = Watch::new(&|_, _| true);
        let there = settled(&bench, LAWS, found.clone(), &watch).unwrap();
        [found, there].map(|fit| (fit.parts[0].law.cause, fit.parts[0].shape.clone()))
    }

    /// A spring at a frequency, of a table with this share of the mass.
    fn spring(resonance_hz: f64, share: f64) -> Effect {
        let omega = std::f64::consts::TAU * resonance_hz;
        Effect::DriveCompliance {
            resonance_hz,
            stiffness_n_um: omega * omega * rig().base.inertia * share * (1.0 - share)
                / rig().drive.motor_stiffness(1.0),
            table_inertia_share: share,
            table_friction_share: 0.5,
            damping_ratio: 0.06,
        }
    }

    #[test]
    fn flanks_with_a_hair_of_play_are_a_spring_and_a_clearance_stays_one() {
        let becomes = |hidden, shape: [f64; 4]| settled_from(&[hidden], 0.3, law(Cause::Backlash), &shape)[1].0;
        for hair_um in [0.1, 0.3] {
            assert_eq!(becomes(spring(100.0, 0.5), [hair_um, 0.5, 0.5, 100.0]), Cause::DriveCompliance, "{hair_um} µm");
        }
        assert_eq!(becomes(clearance(12.0), [12.0, 0.4, 0.6, 600.0]), Cause::Backlash);
    }

    #[test]
    fn the_mass_behind_a_spring_with_play_is_found_from_the_valley_of_another() {
        const SHARE: f64 = 0.45;
        let own_hz = 60.0 * (1.0 - SHARE).sqrt();
        for heavier in [0.6f64, 1.6, 1.8] {
            let begun = [20.0, own_hz / heavier.sqrt(), heavier * SHARE, 0.5 / SHARE / heavier, 0.08];
            let [refined, there] =
                settled_from(&[spring(60.0, SHARE), clearance(20.0)], 0.03, &loose_spring::LAW, &begun);
            let off = |(_, shape): &(Cause, Vec<f64>)| (shape[2] / SHARE - 1.0).abs();
            assert!(off(&refined) > 0.05, "{heavier}: {refined:?} is no other valley");
            assert!(off(&there) < 0.05, "{heavier}: {there:?}");
        }
    }
}
