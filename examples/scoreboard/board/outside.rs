//! Effects that have no name in the vocabulary of causes: a diagnosis must say "unknown" and not press one into a name.

use super::random::Random;
use super::rig::Rig;

/// How an effect outside the vocabulary acts. Torques are for a magnitude of 1 and are scaled by it.
#[derive(Clone, Debug)]
pub enum Kind {
    /// Friction jumps between levels at random times: chips on the way, a lubricator that works now and then.
    SteppedFriction { at: Vec<(f64, f64)> },
    /// A disturbance torque that wanders at random (first-order Gauss–Markov), on a time grid in s.
    WanderingTorque { step: f64, values: Vec<f64> },
    /// A constant torque that flips between two values at random times.
    BistableOffset { at: Vec<(f64, f64)> },
    /// Short stick events at random times: (begin, length) in s.
    StickEvents { at: Vec<(f64, f64)> },
    /// A vibration whose frequency sweeps from f0 to f1 (Hz) in `time` s.
    SweepingVibration { f0: f64, f1: f64, time: f64 },
    /// Friction that is larger around one speed: (speed, width) in load units/s, as a resonant seal or a belt has.
    SpeedBump { speed: f64, width: f64 },
    /// Friction that swings slowly in time (period in s), as with an oil supply.
    PulsingFriction { period: f64, phase: f64 },
    /// A conservative bump of torque at a place of the stroke: latch, detent, magnet (centre, width in load units).
    Detent { centre: f64, width: f64 },
    /// Drag by the cube of speed (load units/s at which it is 1).
    CubicDrag { speed: f64 },
    /// Drag of a brake by eddy currents: largest, and 1, at one speed (load units/s).
    EddyDrag { speed: f64 },
    /// Friction by the logarithm of speed, as of a film that never parts: speed (load units/s) above which it grows so, and where it
    /// is 1.
    LogarithmicFriction { from: f64, speed: f64 },
    /// Drag by the square of speed one way (±1) alone: a cover that folds one way and drags the other. 1 at that speed.
    OneWayDrag { way: f64, speed: f64 },
    /// A torque that begins at a place of the stroke: a wiper that only touches from there on.
    ForceStep { at: f64 },
}

pub const NAMES: [&str; 13] = [
    "stepped_friction",
    "wandering_torque",
    "bistable_offset",
    "stick_events",
    "sweeping_vibration",
    "speed_bump",
    "pulsing_friction",
    "detent",
    "cubic_drag",
    "force_step",
    "eddy_drag",
    "logarithmic_friction",
    "one_way_drag",
];

#[derive(Clone, Debug)]
pub struct Outside {
    pub kind: Kind,
    pub magnitude: f64,
}

/// Times at random intervals, each with a value.
fn events(random: &mut Random, duration: f64, every: f64, value: impl Fn(&mut Random) -> f64) -> Vec<(f64, f64)> {
    let mut at = Vec::new();
    let mut t = random.uniform(0.0, every);
    while t < duration {
        at.push((t, value(random)));
        t += every * random.uniform(0.4, 1.6);
    }
    at
}

/// The value of the last event before t, 0 before the first.
fn held(at: &[(f64, f64)], t: f64) -> f64 {
    match at.partition_point(|e| e.0 <= t) {
        0 => 0.0,
        i => at[i - 1].1,
    }
}

impl Outside {
    /// Draws one by name; `shape` seeds what is the machine's own and stays the same in every recording, `random` the rest.
    pub fn draw(name: &str, rig: &Rig, shape: &mut Random, random: &mut Random, magnitude: f64) -> Option<Self> {
        let duration = rig.duration + 1.0;
        let stroke = rig.reach.high - rig.reach.low;
        let kind = match name {
            "stepped_friction" => {
                Kind::SteppedFriction { at: events(random, duration, duration / 8.0, |r| r.uniform(-1.0, 1.0)) }
            }
            "wandering_torque" => {
                let (step, time) = (0.01, shape.log_uniform(0.1, 1.0));
                let keep = (-step / time).exp();
                let mut level = random.normal();
                let values = (0..(duration / step) as usize + 2).map(|_| {
                    level = keep * level + (1.0 - keep * keep).sqrt() * random.normal();
                    level
                });
                Kind::WanderingTorque { step, values: values.collect() }
            }
            "bistable_offset" => {
                let mut sign = random.sign();
                let mut at = events(random, duration, duration / 9.0, |_| 1.0);
                at.iter_mut().for_each(|e| {
                    sign = -sign;
                    e.1 = sign;
                });
                Kind::BistableOffset { at }
            }
            "stick_events" => Kind::StickEvents { at: events(random, duration, 0.6, |r| r.uniform(0.05, 0.2)) },
            "sweeping_vibration" => {
                let f0 = shape.log_uniform(4.0, 12.0);
                Kind::SweepingVibration { f0, f1: f0 * shape.uniform(2.5, 4.0), time: duration }
            }
            "speed_bump" => {
                let speed = rig.reach.speed * shape.uniform(0.25, 0.5);
                Kind::SpeedBump { speed, width: speed * shape.uniform(0.15, 0.3) }
            }
            "pulsing_friction" => {
                Kind::PulsingFriction { period: duration / shape.uniform(3.0, 7.0), phase: random.phase() }
            }
            "detent" => Kind::Detent {
                centre: rig.reach.low + stroke * shape.uniform(0.3, 0.7),
                width: stroke * shape.uniform(0.04, 0.1),
            },
            "cubic_drag" => Kind::CubicDrag { speed: 0.7 * rig.reach.speed },
            "force_step" => Kind::ForceStep { at: rig.reach.low + stroke * shape.uniform(0.4, 0.6) },
            "eddy_drag" => Kind::EddyDrag { speed: rig.reach.speed * shape.uniform(0.1, 0.35) },
            "logarithmic_friction" => {
                let speed = rig.reach.speed;
                Kind::LogarithmicFriction { from: speed * shape.log_uniform(0.01, 0.1), speed }
            }
            "one_way_drag" => Kind::OneWayDrag { way: shape.sign(), speed: 0.7 * rig.reach.speed },
            _ => return None,
        };
        Some(Self { kind, magnitude })
    }

    /// What it adds to the level of dry friction; v in load units/s.
    pub fn dry(&self, t: f64, v: f64) -> f64 {
        self.magnitude
            * match &self.kind {
                Kind::SteppedFriction { at } => held(at, t),
                Kind::StickEvents { at } => match at.partition_point(|e| e.0 <= t) {
                    0 => 0.0,
                    i => f64::from(t - at[i - 1].0 < at[i - 1].1),
                },
                Kind::SpeedBump { speed, width } => (-((v.abs() - speed) / width).powi(2)).exp(),
                Kind::LogarithmicFriction { from, speed } => (v.abs() / from).ln_1p() / (speed / from).ln_1p(),
                Kind::PulsingFriction { period, phase } => (std::f64::consts::TAU * t / period + phase).sin(),
                _ => 0.0,
            }
    }

    /// What it adds to the torque at the table; x and v in load units and load units/s.
    pub fn torque(&self, t: f64, x: f64, v: f64) -> f64 {
        self.magnitude
            * match &self.kind {
                Kind::WanderingTorque { step, values } => {
                    let at = t / step;
                    let i = (at as usize).min(values.len() - 2);
                    values[i] + (values[i + 1] - values[i]) * (at - i as f64)
                }
                Kind::BistableOffset { at } => held(at, t),
                Kind::SweepingVibration { f0, f1, time } => {
                    (std::f64::consts::TAU * (f0 * t + 0.5 * (f1 - f0) * t * t / time)).sin()
                }
                Kind::CubicDrag { speed } => (v / speed).powi(3),
                Kind::EddyDrag { speed } => 2.0 * (v / speed) / (1.0 + (v / speed).powi(2)),
                Kind::OneWayDrag { way, speed } => way * (way * v / speed).max(0.0).powi(2),
                Kind::ForceStep { at } => 0.5f64.copysign(x - at),
                Kind::Detent { centre, width } => {
                    // The slope of a potential well: pulls towards the centre from both sides.
                    let u = (x - centre) / width;
                    2.33 * u * (-u * u).exp()
                }
                _ => 0.0,
            }
    }
}
