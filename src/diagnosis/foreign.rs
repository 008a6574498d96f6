//! Laws that have no name here, and that several causes together imitate: drag by the cube of speed, friction by the load, a
//! step along the stroke. Where such a law stands for most of what was found, the cause is unknown, and what is said is how it
//! goes.

use super::causes::Trace;
use super::fit::{Bench, Fit};
use super::frame::Frame;
use super::progress::{Stopped, Watch};
use super::select::{LEAST_GAIN, idle_left_out};

/// Share of what causes explain that a law without a name must stand for, for none of them to be named.
const MOST: f64 = 0.5;
/// Places along the stroke and over the speed at which something may begin or lie.
const PLACES: usize = 24;

/// A law without a name.
struct Foreign {
    /// What the torque does, as said to a machinist.
    goes: &'static str,
    /// The regressor, drive's own unit or anything in proportion.
    trace: Vec<f64>,
}

/// How what was found goes in truth, where a law without a name stands for most of it.
///
/// # Errors
/// [`Stopped`] when the watch's caller said so.
pub fn stands_for(bench: &Bench, empty: &Fit, found: &Fit, watch: &Watch) -> Result<Option<&'static str>, Stopped> {
    let laws = laws(bench.frame);
    let beside = watch.each(&laws, (0.9, 0.91), "comparing with laws without a name", |law| {
        let with = bench.beside(&Trace::torque(law.trace.clone()));
        let fit = with.fit(found.parts.clone());
        (fit.figure(), with)
    })?;
    let best = laws.iter().zip(beside).min_by(|a, b| a.1.0.total_cmp(&b.1.0));
    let Some((law, (_, with))) = best.filter(|(_, (figure, _))| *figure < found.figure() - LEAST_GAIN) else {
        return Ok(None);
    };
    let left = idle_left_out(&with, with.fit(found.parts.clone()), watch)?;
    // What the causes that are left would explain by themselves.
    let own = bench.fit(left.parts);
    let (explained, lost) = (empty.squares() - found.squares(), own.squares() - found.squares());
    Ok((lost > MOST * explained).then_some(law.goes))
}

fn laws(frame: &Frame) -> Vec<Foreign> {
    let (low, high) = frame.stroke();
    let law = |goes, trace| Foreign { goes, trace };
    let friction = |of: &dyn Fn(usize) -> f64| frame.judged_by(|i| frame.direction[i] * of(i));
    let b = &frame.belief;
    let load = |i: usize| {
        let motion = b.inertia * frame.a[i] * frame.unit + b.viscous * frame.v[i] * frame.unit;
        motion + b.coulomb * frame.direction[i] + b.constant
    };
    let mut laws = vec![
        law("with the cube of speed", frame.judged_by(|i| frame.v[i].powi(3))),
        law("as a friction that grows with acceleration", friction(&|i| frame.a[i].abs())),
        law("as a friction that grows with the load", friction(&|i| load(i).abs())),
    ];
    for place in 1..PLACES {
        let share = place as f64 / PLACES as f64;
        let (x, v) = (low + share * (high - low), share * frame.top_speed());
        let beyond = |i: usize| f64::from(u8::from(frame.x[i] > x));
        laws.push(law("as a step along the stroke", frame.judged_by(beyond)));
        laws.push(law("as a step of friction along the stroke", friction(&beyond)));
        for width in [1.5, 4.0] {
            let width = width * frame.top_speed() / PLACES as f64;
            let trace = frame.fading(|i| ((frame.v[i].abs() - v) / width).powi(2));
            laws.push(law("as a friction that is another about one speed", trace));
        }
    }
    laws
}
