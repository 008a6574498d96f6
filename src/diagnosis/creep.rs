//! Friction that yields while the axis seems to rest.
//!
//! Set-valued friction takes any value at rest, so rows at which an axis rests or creeps say nothing about it and are not judged. Where
//! friction builds up over a way of a few steps of the encoder it says most at just those rows: the torque goes with the little that the
//! axis yields. Whether it does is seen from these rows alone.

use super::belief;
use super::causes::law;
use super::causes::presliding_friction::{BRISTLE, ELEMENTS, bristle_over};
use super::fit::{Bench, figure};
use super::frame::Frame;
use super::known::Known;
use super::select::LEAST_GAIN;
use super::verdict::Diagnosis;
use crate::machine::{Cause, Effect};

/// Ways that are tried, in steps that the encoder tells for sure, and their ratio.
const WAYS: [f64; 2] = [1.0, 300.0];
const RATIO: f64 = 1.5;
/// State up to which a bristle has not yielded all.
const PARTLY: f64 = 0.9;
/// Fewest rows in a run of them, and runs.
const FEWEST_IN_RUN: f64 = 4.0;
const FEWEST_TURNS: usize = 6;
/// Ways after which a bristle has forgotten how it stood.
const FORGOTTEN: f64 = 5.0;
/// Least share of the variance of the torque at these rows that goes with the state, on rows that the level was not taken from.
const LEAST_SHARE: f64 = 0.8;
/// Ratio of ways that are about the same.
const ABOUT: f64 = 3.0;
/// Ways beside it at which it is tried.
const ABOUT_IT: [f64; 3] = [0.5, 1.0, 2.0];
/// The level that builds up over that of Coulomb friction.
const LEVELS: [f64; 2] = [0.6, 1.6];

/// The way over which friction seems to yield where the axis creeps, load units; `None` where it does not.
#[must_use]
pub fn way(frame: &Frame) -> Option<f64> {
    let (belief, unit) = (&frame.belief, frame.unit);
    let moving = |i: usize| (belief.inertia * frame.a[i] + belief.viscous * frame.v[i]) * unit + belief.constant;
    let friction: Vec<f64> = frame.torque.iter().enumerate().map(|(i, torque)| torque - moving(i)).collect();
    let mut judged = vec![false; friction.len()];
    frame.kept.iter().for_each(|&row| judged[row] = true);
    let count = ((WAYS[1] / WAYS[0]).ln() / RATIO.ln()).ceil() as i32;
    let ways: Vec<f64> = (0..=count).map(|k| frame.resolution * WAYS[0] * RATIO.powi(k)).collect();
    let shares = ways.iter().map(|way| share(frame, *way, &friction, &judged).unwrap_or(0.0));
    let (at, share) = shares.enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
    // At the longest way nothing says that a longer one would not do as well.
    (share > LEAST_SHARE && at + 1 < ways.len()).then(|| ways[at])
}

/// Whether friction that yields over about a way takes some off what an answer leaves, on a frame that judges the rows where it yields.
#[must_use]
pub fn promises(yielding: &Frame, way: f64, found: &Diagnosis) -> bool {
    let base = belief::base_alone(&found.extended);
    let yielding = yielding.believing(&base);
    let bench = Bench::new(&yielding, &Known::of(&found.extended, &yielding));
    let set = bench.fit(Vec::new());
    let over = |ratio: f64| [BRISTLE, ELEMENTS].map(|[exponent, kind]| vec![1e3 * way * ratio, exponent, kind]);
    let starts = ABOUT_IT.into_iter().flat_map(over).collect();
    let joined =
        bench.parts(law(Cause::PreslidingFriction), starts).into_iter().map(|part| figure(&bench.joined(&set, &part)));
    joined.fold(f64::INFINITY, f64::min) < set.figure() - LEAST_GAIN
}

/// Whether among effects friction builds up over about that way: elements over half of it go as a bristle.
#[must_use]
pub fn is_over(way: f64, mut effects: impl Iterator<Item = Effect>) -> bool {
    effects.any(|effect| match effect {
        Effect::PreslidingFriction { displacement_um, .. } => {
            (1.0 / ABOUT..ABOUT).contains(&(displacement_um * 1e-3 / way))
        }
        _ => false,
    })
}

/// Sums over rows of friction f and state z: their number, and Σz, Σf, Σz², Σzf, Σf².
type Sums = [f64; 6];

/// The sums about the means of the run.
fn within(run: &Sums) -> Sums {
    let [n, z, f, zz, zf, ff] = *run;
    [n, 0.0, 0.0, zz - z * z / n, zf - z * f / n, ff - f * f / n]
}

/// Share of the variance of friction within runs of rows that are not judged, where a bristle over a way has not yielded all, that goes
/// with the bristle: by the level of every other run. `None` where there are too few, or the level is not that of the friction.
fn share(frame: &Frame, way: f64, friction: &[f64], judged: &[bool]) -> Option<f64> {
    let state = bristle_over(frame, way);
    let smooth = frame.low_pass.run(&state, &frame.columns.stretches);
    let (mut halves, mut runs) = ([Sums::default(); 2], 0);
    let mut close = |run: &mut Sums| {
        if run[0] >= FEWEST_IN_RUN {
            let half = &mut halves[runs % 2];
            half.iter_mut().zip(within(run)).for_each(|(sum, value)| *sum += value);
            runs += 1;
        }
        *run = Sums::default();
    };
    for rows in &frame.columns.stretches {
        let x = &frame.columns.position;
        let mut run = Sums::default();
        // How the bristle stood when rows began is forgotten after some ways.
        let mut gone = 0.0;
        for i in rows.start + 1..rows.end {
            gone += (x[i] - x[i - 1]).abs();
            if gone > FORGOTTEN * way && state[i].abs() < PARTLY && !judged[i] && frame.columns.known[i] {
                let (z, f) = (smooth[i], friction[i]);
                run.iter_mut().zip([1.0, z, f, z * z, z * f, f * f]).for_each(|(sum, value)| *sum += value);
            } else {
                close(&mut run);
            }
        }
        close(&mut run);
    }
    let [even, odd] = halves;
    let levels = [even[4] / even[3], odd[4] / odd[3]];
    let left = |half: Sums, level: f64| half[5] - 2.0 * level * half[4] + level * level * half[3];
    let (left, all) = (left(even, levels[1]) + left(odd, levels[0]), even[5] + odd[5]);
    let sound = levels.iter().all(|level| (LEVELS[0]..LEVELS[1]).contains(&(level / frame.belief.coulomb)));
    (runs >= FEWEST_TURNS && sound && all > 0.0).then(|| 1.0 - left / all)
}
