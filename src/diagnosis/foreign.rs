//! Laws that have no name here, and that several causes together imitate: drag by the cube of speed, friction by the load, a
//! step along the stroke. Where such a law stands for most of what was found, the cause is unknown, and what is said is how it
//! goes.

use super::causes::Trace;
use super::fit::{Bench, Fit};
use super::frame::Frame;
use super::many::dot;
use super::progress::{Stopped, Watch};
use super::select::{LEAST_GAIN, NUMBER_PRICE, idle_left_out, price};

/// Share of what causes explain that a law without a name must stand for, for none of them to be named.
const MOST: f64 = 0.5;
/// Least share of it that such a law explains by itself, for it to be looked at.
const LEAST: f64 = 0.3;
/// What a law without a name must bring to take the place of as many causes; fewer it replaces where it is as good.
const FOR_AS_MANY: f64 = LEAST_GAIN;
/// Places along the stroke and over the speed at which something may begin or lie, and how often the way between two of them is
/// halved.
const PLACES: usize = 24;
const HALVED: i32 = 5;
/// Pieces of the time or of the stroke, each with a level of its own.
const PIECES: usize = 24;

/// What is said while it is done.
const STAGE: &str = "comparing with laws without a name";

/// A law without a name.
struct Foreign {
    /// What the torque does, as said to a machinist.
    goes: &'static str,
    /// Numbers that it takes: its size, and where it begins or lies.
    numbers: usize,
    /// Whether it begins or lies somewhere.
    somewhere: bool,
    /// Regressors at a share of the stroke or of the top speed, drive's own unit or anything in proportion; if there are several,
    /// they do not overlap.
    regressors: fn(&Frame, f64) -> Vec<Vec<f64>>,
}

static LAWS: [Foreign; 10] = [
    Foreign {
        goes: "with the cube of speed",
        numbers: 1,
        somewhere: false,
        regressors: |frame, _| vec![frame.judged_by(|i| frame.v[i].powi(3))],
    },
    Foreign {
        goes: "as a friction that grows with acceleration",
        numbers: 1,
        somewhere: false,
        regressors: |frame, _| vec![frame.judged_by(|i| frame.direction[i] * frame.a[i].abs())],
    },
    Foreign {
        goes: "as a friction that grows with the load",
        numbers: 2,
        somewhere: false,
        // c·|T| of friction in T itself: a motor that drives needs 1/(1 − c) of the load, one that brakes 1/(1 + c).
        regressors: |frame, _| {
            let where_it = |drives: bool| {
                frame.judged_by(|i| {
                    let load = load(frame, i);
                    if (load * frame.direction[i] > 0.0) == drives { load } else { 0.0 }
                })
            };
            vec![where_it(true), where_it(false)]
        },
    },
    Foreign {
        goes: "as a step along the stroke",
        numbers: 3,
        somewhere: true,
        regressors: |frame, share| on_either_side(frame, share, |_| 1.0),
    },
    Foreign {
        goes: "as a step of friction along the stroke",
        numbers: 3,
        somewhere: true,
        regressors: |frame, share| on_either_side(frame, share, |i| frame.direction[i]),
    },
    Foreign {
        goes: "as a torque that wanders in time",
        numbers: PIECES,
        somewhere: false,
        regressors: |frame, _| by_pieces(frame, |i| frame.seconds(i), |_| 1.0),
    },
    Foreign {
        goes: "as a friction that wanders in time",
        numbers: PIECES,
        somewhere: false,
        regressors: |frame, _| by_pieces(frame, |i| frame.seconds(i), |i| frame.direction[i]),
    },
    Foreign {
        goes: "along the stroke, one way there and another way back",
        numbers: 2 * PIECES,
        somewhere: false,
        regressors: |frame, _| {
            let one_way = |way: f64| {
                by_pieces(frame, |i| frame.x[i], move |i| if frame.direction[i] * way > 0.0 { 1.0 } else { 0.0 })
            };
            [one_way(1.0), one_way(-1.0)].concat()
        },
    },
    Foreign {
        goes: "as a friction that is another about one speed",
        numbers: 3,
        somewhere: true,
        regressors: |frame, share| vec![about(frame, share, 1.5)],
    },
    Foreign {
        goes: "as a friction that is another about one speed",
        numbers: 3,
        somewhere: true,
        regressors: |frame, share| vec![about(frame, share, 4.0)],
    },
];

/// How what was found goes in truth, where a law without a name stands for most of it: where it makes causes needless that
/// explain more than half, and explains more than they do, or as much in place of two of them or more.
///
/// # Errors
/// [`Stopped`] when the watch's caller said so.
pub fn stands_for(bench: &Bench, empty: &Fit, found: &Fit, watch: &Watch) -> Result<Option<&'static str>, Stopped> {
    let explained = empty.squares() - found.squares();
    // What a law explains at a place by itself, over what was found explains.
    let alike = |law: &Foreign, place: f64| {
        let columns = (law.regressors)(bench.frame, place).into_iter().map(|c| bench.stack(&Trace::torque(c)));
        let squares = |column: Vec<f64>| dot(&column, &empty.residual).powi(2) / dot(&column, &column).max(1e-300);
        columns.map(squares).sum::<f64>() / explained.max(1e-300)
    };
    let first_place = |law: &&'static Foreign| {
        let places = if law.somewhere { 1..PLACES } else { 0..1 };
        let tried = places.map(|place| place as f64 / PLACES as f64).map(|place| (alike(law, place), *law, place));
        tried.max_by(|a, b| a.0.total_cmp(&b.0))
    };
    // Levels of many pieces take any form: a law of few numbers that does is what is there, and so is one cause.
    let many = |law: &Foreign| law.numbers >= PIECES;
    let laws: Vec<&'static Foreign> = LAWS.iter().filter(|law| found.parts.len() > 1 || !many(law)).collect();
    let mut near: Vec<(f64, &'static Foreign, f64)> =
        watch.each(&laws, (0.9, 0.91), STAGE, first_place)?.into_iter().flatten().collect();
    near.retain(|(share, ..)| *share > LEAST);
    near.sort_by(|a, b| many(a.1).cmp(&many(b.1)).then(b.0.total_cmp(&a.0)));
    for (_, law, place) in near {
        let beside = |place: f64| {
            let with = bench.beside((law.regressors)(bench.frame, place).into_iter().map(Trace::torque));
            let fit = with.fit(found.parts.clone());
            (with, fit)
        };
        let (mut at, (mut with, mut fit)) = (place, beside(place));
        for halved in 1..=if law.somewhere { HALVED } else { 0 } {
            let step = 0.5f64.powi(halved) / PLACES as f64;
            let sides = watch.each(&[at - step, at + step], (0.91, 0.91), STAGE, |place| (*place, beside(*place)))?;
            for (place, (there, nearer)) in sides {
                if nearer.squares() < fit.squares() {
                    (at, with, fit) = (place, there, nearer);
                }
            }
        }
        let left = idle_left_out(&with, fit, watch)?;
        let needless = found.parts.len() - left.parts.len();
        let better = price(found) - price(&left) - NUMBER_PRICE * law.numbers as f64;
        // What the causes that are still needed explain by themselves.
        let own = bench.fit(left.parts).squares() - found.squares();
        let least = if needless > 1 { 0.0 } else { FOR_AS_MANY };
        if needless > usize::from(many(law)) && better > least && own > MOST * explained {
            return Ok(Some(law.goes));
        }
    }
    Ok(None)
}

/// Torque that moves the axis as believed.
fn load(frame: &Frame, i: usize) -> f64 {
    let b = &frame.belief;
    (b.inertia * frame.a[i] + b.viscous * frame.v[i]) * frame.unit + b.coulomb * frame.direction[i] + b.constant
}

/// What a function of the row is below a place and beyond it.
fn on_either_side(frame: &Frame, share: f64, of: impl Fn(usize) -> f64) -> Vec<Vec<f64>> {
    let (low, high) = frame.stroke();
    let place = low + share * (high - low);
    [false, true].map(|beyond| frame.judged_by(|i| if (frame.x[i] > place) == beyond { of(i) } else { 0.0 })).into()
}

/// What a function of the row is in each piece of the way that another one goes.
fn by_pieces(frame: &Frame, along: impl Fn(usize) -> f64, of: impl Fn(usize) -> f64) -> Vec<Vec<f64>> {
    let at: Vec<f64> = (0..frame.x.len()).map(along).collect();
    let (low, high) = at.iter().fold((f64::MAX, f64::MIN), |(low, high), a| (a.min(low), a.max(high)));
    let per = PIECES as f64 / (high - low).max(1e-300);
    let piece: Vec<usize> = at.iter().map(|a| (((a - low) * per) as usize).min(PIECES - 1)).collect();
    (0..PIECES).map(|wanted| frame.judged_by(|i| if piece[i] == wanted { of(i) } else { 0.0 })).collect()
}

/// Friction about one speed, over so many of the ways between two places.
fn about(frame: &Frame, share: f64, ways: f64) -> Vec<f64> {
    let top = frame.top_speed();
    frame.fading(|i| ((frame.v[i].abs() / top - share) * PLACES as f64 / ways).powi(2))
}
