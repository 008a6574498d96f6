//! The laws without a name: what machines do now and then, and what nobody has to be told a cause of before somebody has looked.
//! Some have a form and few numbers; others take any form along one coordinate, by levels at places between which they go
//! along straight lines.

use crate::diagnosis::frame::Frame;
use crate::diagnosis::many::to_the_power;

/// Places along the stroke, over the speed or among the lengths and times at which something may begin or lie.
pub const PLACES: usize = 24;
/// Levels of a law that takes any form.
const LEVELS: usize = 24;

/// A law without a name.
pub struct Foreign {
    /// What the torque does, as said to a machinist.
    pub goes: &'static str,
    /// Numbers that it takes: its sizes, and where it begins or lies.
    pub numbers: usize,
    /// Whether it begins or lies somewhere, or has an exponent, a length or a time of its own.
    pub somewhere: bool,
    /// Regressors at a share, 0 to 1, of where that may be; drive's own unit or anything in proportion.
    pub regressors: fn(&Frame, f64) -> Vec<Vec<f64>>,
}

impl Foreign {
    /// Whether it takes any form along a coordinate.
    pub fn takes_any_form(&self) -> bool {
        self.numbers >= LEVELS
    }
}

pub static LAWS: [Foreign; 39] = [
    Foreign {
        goes: "with the cube of speed",
        numbers: 1,
        somewhere: false,
        regressors: |frame, _| vec![frame.judged_by(|i| frame.v[i].powi(3))],
    },
    Foreign {
        goes: "with a root of speed",
        numbers: 2,
        somewhere: true,
        regressors: |frame, exponent| {
            let per = 1.0 / frame.top_speed();
            let mut roots: Vec<f64> = frame.v.iter().map(|v| v.abs() * per).collect();
            to_the_power(&mut roots, LARGEST_EXPONENT * exponent);
            vec![frame.judged_by(|i| frame.direction[i] * roots[i])]
        },
    },
    Foreign {
        goes: "with the logarithm of speed",
        numbers: 2,
        somewhere: true,
        regressors: |frame, share| {
            let per = SHORTEST.powf(share - 1.0) / frame.top_speed();
            vec![frame.judged_by(|i| frame.direction[i] * (frame.v[i].abs() * per).ln_1p())]
        },
    },
    Foreign {
        goes: "with the square of speed, one way there and another way back",
        numbers: 2,
        somewhere: false,
        regressors: |frame, _| {
            let drag = |i: usize| frame.v[i].powi(2);
            vec![frame.judged_by(drag), frame.judged_by(|i| frame.direction[i] * drag(i))]
        },
    },
    Foreign {
        goes: "as a drag that is largest at one speed, as that of a brake by eddy currents",
        numbers: 2,
        somewhere: true,
        regressors: |frame, share| {
            let per = 1.0 / (share * frame.top_speed()).max(1e-300);
            vec![frame.judged_by(|i| frame.v[i] * per / (1.0 + (frame.v[i] * per).powi(2)))]
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
    Foreign {
        goes: "as a friction that is another from one speed on",
        numbers: 2,
        somewhere: true,
        regressors: |frame, share| vec![from_speed(frame, share, 0.02)],
    },
    Foreign {
        goes: "as a friction that is another from one speed on",
        numbers: 2,
        somewhere: true,
        regressors: |frame, share| vec![from_speed(frame, share, 0.25)],
    },
    Foreign {
        goes: "as a friction that grows with acceleration",
        numbers: 1,
        somewhere: false,
        regressors: |frame, _| vec![frame.judged_by(|i| frame.direction[i] * frame.a[i].abs())],
    },
    Foreign {
        goes: "with a power of acceleration",
        numbers: 2,
        somewhere: true,
        regressors: |frame, share| {
            let largest = frame.a.iter().fold(1e-300f64, |largest, a| largest.max(a.abs()));
            let mut powers: Vec<f64> = frame.a.iter().map(|a| a.abs() / largest).collect();
            to_the_power(&mut powers, LEAST_POWER + (LARGEST_POWER - LEAST_POWER) * share);
            vec![frame.judged_by(|i| powers[i].copysign(frame.a[i]))]
        },
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
        goes: "as a motor that pushes harder one way than the other",
        numbers: 1,
        somewhere: false,
        regressors: |frame, _| vec![frame.judged_by(|i| load(frame, i).abs())],
    },
    Foreign {
        goes: "as a friction that is another after a rest",
        numbers: 2,
        somewhere: true,
        regressors: |frame, share| {
            let (low, high) = frame.stroke();
            let length = (high - low) * SHORTEST.powf(1.0 - share);
            let way = way_since_rest(frame);
            vec![frame.judged_by(|i| frame.direction[i] * (-way[i] / length).exp())]
        },
    },
    Foreign {
        goes: "as a drag that comes late",
        numbers: 2,
        somewhere: true,
        regressors: |frame, share| {
            let late = late_speed(frame, LATEST_S * SHORTEST.powf(1.0 - share));
            vec![frame.judged_by(|i| late[i])]
        },
    },
    Foreign {
        goes: "as a step along the stroke",
        numbers: 3,
        somewhere: true,
        regressors: |frame, share| on_either_side(frame, share, |_| 1.0),
    },
    Foreign {
        goes: "with the square of the way from one place",
        numbers: 2,
        somewhere: true,
        regressors: |frame, share| {
            let place = between(frame, share, |i| frame.x[i]);
            vec![frame.judged_by(|i| (frame.x[i] - place).powi(2))]
        },
    },
    Foreign {
        goes: "as a torque that is another from one moment on",
        numbers: 2,
        somewhere: true,
        regressors: |frame, share| vec![from_moment(frame, share, |_| 1.0)],
    },
    Foreign {
        goes: "as a friction that is another from one moment on",
        numbers: 2,
        somewhere: true,
        regressors: |frame, share| vec![from_moment(frame, share, |i| frame.direction[i])],
    },
    Foreign {
        goes: "as a drag that is another from one moment on",
        numbers: 2,
        somewhere: true,
        regressors: |frame, share| vec![from_moment(frame, share, |i| frame.v[i])],
    },
    Foreign {
        goes: "as an inertia that is another from one moment on",
        numbers: 2,
        somewhere: true,
        regressors: |frame, share| vec![from_moment(frame, share, |i| frame.a[i])],
    },
    Foreign {
        goes: "as a motor that pushes harder or less from one moment on",
        numbers: 2,
        somewhere: true,
        regressors: |frame, share| vec![from_moment(frame, share, |i| load(frame, i))],
    },
    Foreign {
        goes: "as a torque that changes evenly in time",
        numbers: 2,
        somewhere: true,
        regressors: |frame, share| evenly(frame, share, |i| frame.seconds(i), |_| 1.0),
    },
    Foreign {
        goes: "as a drag that changes evenly in time",
        numbers: 2,
        somewhere: true,
        regressors: |frame, share| evenly(frame, share, |i| frame.seconds(i), |i| frame.v[i]),
    },
    Foreign {
        goes: "as an inertia that changes evenly in time",
        numbers: 2,
        somewhere: true,
        regressors: |frame, share| evenly(frame, share, |i| frame.seconds(i), |i| frame.a[i]),
    },
    Foreign {
        goes: "as a motor whose push changes evenly in time",
        numbers: 2,
        somewhere: true,
        regressors: |frame, share| evenly(frame, share, |i| frame.seconds(i), |i| load(frame, i)),
    },
    Foreign {
        goes: "as an inertia that changes evenly along the stroke",
        numbers: 2,
        somewhere: true,
        regressors: |frame, share| evenly(frame, share, |i| frame.x[i], |i| frame.a[i]),
    },
    Foreign {
        goes: "as a drag that changes evenly along the stroke",
        numbers: 2,
        somewhere: true,
        regressors: |frame, share| evenly(frame, share, |i| frame.x[i], |i| frame.v[i]),
    },
    Foreign {
        goes: "as a torque that wanders in time",
        numbers: LEVELS,
        somewhere: false,
        regressors: |frame, _| any_form(frame, |i| frame.seconds(i), |_| 1.0),
    },
    Foreign {
        goes: "as a friction that wanders in time",
        numbers: LEVELS,
        somewhere: false,
        regressors: |frame, _| any_form(frame, |i| frame.seconds(i), |i| frame.direction[i]),
    },
    Foreign {
        goes: "as a drag that wanders in time",
        numbers: LEVELS,
        somewhere: false,
        regressors: |frame, _| any_form(frame, |i| frame.seconds(i), |i| frame.v[i]),
    },
    Foreign {
        goes: "as an inertia that changes in time",
        numbers: LEVELS,
        somewhere: false,
        regressors: |frame, _| any_form(frame, |i| frame.seconds(i), |i| frame.a[i]),
    },
    Foreign {
        goes: "as an inertia that changes along the stroke",
        numbers: LEVELS,
        somewhere: false,
        regressors: |frame, _| any_form(frame, |i| frame.x[i], |i| frame.a[i]),
    },
    Foreign {
        goes: "as a drag that changes along the stroke",
        numbers: LEVELS,
        somewhere: false,
        regressors: |frame, _| any_form(frame, |i| frame.x[i], |i| frame.v[i]),
    },
    Foreign {
        goes: "as a motor that pushes harder at one time than at another",
        numbers: LEVELS,
        somewhere: false,
        regressors: |frame, _| any_form(frame, |i| frame.seconds(i), |i| load(frame, i)),
    },
    Foreign {
        goes: "along the stroke, one way there and another way back",
        numbers: 2 * LEVELS,
        somewhere: false,
        regressors: |frame, _| {
            let one_way = |way: f64| {
                any_form(frame, |i| frame.x[i], move |i| if frame.direction[i] * way > 0.0 { 1.0 } else { 0.0 })
            };
            [one_way(1.0), one_way(-1.0)].concat()
        },
    },
    Foreign {
        goes: "as a friction that goes another way with speed",
        numbers: LEVELS,
        somewhere: false,
        regressors: |frame, _| any_form(frame, |i| frame.v[i].abs(), |i| frame.direction[i]),
    },
    Foreign {
        goes: "as a friction that goes with acceleration",
        numbers: LEVELS,
        somewhere: false,
        regressors: |frame, _| any_form(frame, |i| frame.a[i] * frame.direction[i], |i| frame.direction[i]),
    },
    Foreign {
        goes: "as a motor whose torque is no straight line of its current",
        numbers: LEVELS,
        somewhere: false,
        regressors: |frame, _| any_form(frame, |i| load(frame, i), |_| 1.0),
    },
];

/// Largest exponent of a root: with more it is hardly another law than viscous friction.
const LARGEST_EXPONENT: f64 = 0.75;
/// Exponents of acceleration: with less it is hardly another law than inertia.
const LEAST_POWER: f64 = 1.5;
const LARGEST_POWER: f64 = 5.0;
/// The shortest length, as a share of the stroke, the shortest time, of the longest, and the lowest speed, of the top speed.
const SHORTEST: f64 = 0.003;
/// The longest time by which something comes late, s.
const LATEST_S: f64 = 3.0;
/// Share of the top speed below which an axis rests.
const RESTS: f64 = 1e-3;

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

/// What a function of the row is from one moment on.
fn from_moment(frame: &Frame, share: f64, of: impl Fn(usize) -> f64) -> Vec<f64> {
    let moment = between(frame, share, |i| frame.seconds(i));
    frame.judged_by(|i| if frame.seconds(i) > moment { of(i) } else { 0.0 })
}

/// What a function of the row is by how far along a coordinate it lies from where all is as believed.
fn evenly(frame: &Frame, share: f64, along: impl Fn(usize) -> f64, of: impl Fn(usize) -> f64) -> Vec<Vec<f64>> {
    let as_believed = between(frame, share, &along);
    vec![frame.judged_by(|i| (along(i) - as_believed) * of(i))]
}

/// A share of the way along a coordinate over the judged rows.
fn between(frame: &Frame, share: f64, along: impl Fn(usize) -> f64) -> f64 {
    let (low, high) = judged_range(frame, along);
    low + share * (high - low)
}

/// The least and the greatest of a coordinate over the judged rows.
fn judged_range(frame: &Frame, along: impl Fn(usize) -> f64) -> (f64, f64) {
    let judged = frame.kept.iter().map(|&i| along(i));
    judged.fold((f64::MAX, f64::MIN), |(low, high), a| (a.min(low), a.max(high)))
}

/// What a function of the row is at each level along a coordinate; between two levels it belongs to both.
fn any_form(frame: &Frame, along: impl Fn(usize) -> f64, of: impl Fn(usize) -> f64) -> Vec<Vec<f64>> {
    let (low, high) = judged_range(frame, &along);
    let per = (LEVELS - 1) as f64 / (high - low).max(1e-300);
    let rows = 0..frame.x.len();
    let at = |i: usize| ((along(i) - low) * per).clamp(0.0, (LEVELS - 1) as f64);
    frame.judged_by_levels(LEVELS, &rows.map(|i| (at(i), of(i))).collect::<Vec<_>>())
}

/// Friction about one speed, over so many of the ways between two places.
fn about(frame: &Frame, share: f64, ways: f64) -> Vec<f64> {
    let (per, at) = (PLACES as f64 / (ways * frame.top_speed()), share * PLACES as f64 / ways);
    frame.fading(&frame.v, move |v| (v.abs() * per - at).powi(2))
}

/// Friction from one speed on, at a share of the top speed; it comes over a part of that speed.
fn from_speed(frame: &Frame, share: f64, part: f64) -> Vec<f64> {
    let (per, from) = (1.0 / (part * share * frame.top_speed()), (1.0 - 0.5 * part) / part);
    frame.judged_by(|i| frame.direction[i] * (frame.v[i].abs() * per - from).clamp(0.0, 1.0))
}

/// Way since the axis rested or turned last, load units, every row.
fn way_since_rest(frame: &Frame) -> Vec<f64> {
    let slow = RESTS * frame.top_speed();
    let mut way = vec![0.0; frame.x.len()];
    for stretch in &frame.columns.stretches {
        let mut direction = 0.0;
        for i in stretch.clone().skip(1) {
            let rests = frame.v[i].abs() < slow || frame.v[i].signum() != direction;
            direction = frame.v[i].signum();
            way[i] = if rests { 0.0 } else { way[i - 1] + (frame.x[i] - frame.x[i - 1]).abs() };
        }
    }
    way
}

/// The speed through a lag of a time constant, load units/s, every row.
fn late_speed(frame: &Frame, time_constant_s: f64) -> Vec<f64> {
    let step = -(-frame.columns.period_s / time_constant_s).exp_m1();
    let mut late = vec![0.0; frame.x.len()];
    for stretch in &frame.columns.stretches {
        for i in stretch.clone().skip(1) {
            late[i] = late[i - 1] + step * (frame.v[i] - late[i - 1]);
        }
    }
    late
}
