//! Dead zone between motor and table. While the motor crosses it, where the load of the link turns, it carries neither the
//! table's inertia nor its friction; then the flanks meet. In table − encoder it is a step of the full width there.
//!
//! The table is simulated behind the measured motor as a prediction does it: J₂·ẍ₂ = c − φ·(Tc·Sign(ẋ₂) + Tv·ẋ₂) − T0, with
//! c the push of stiff flanks beyond the dead zone. While the link is loaded one way the table simply moves with the motor,
//! c = J₂·ẍ₁ + φ·(Tc·sign(ẋ₁) + Tv·ẋ₁) + T0, and nothing need be simulated.

use super::*;
use crate::machine::TwoMasses;
use crate::plant::motion::Motion;
use std::ops::Range;

/// Parameters: full width in µm, shares of inertia and friction on the table's side, how stiff the flanks meet
/// in Hz. The trace has no coefficient.
pub static LAW: Law = Law {
    cause: Cause::Backlash,
    scales: &[
        Scale::Log(0.1, 2000.0),
        Scale::Linear(0.05, 0.9, 0.01),
        Scale::Linear(0.02, 0.98, 0.01),
        Scale::Log(100.0, 2000.0),
    ],
    starts: |frame, _| {
        // A width that is a fifth off meets the flanks at the wrong time and explains little.
        let least = (3.0 * frame.grid).max(2e-3) * 1e3;
        let widths = log_spaced(least, (10.0 * least).max(300.0), 25);
        widths.flat_map(|w| [0.5, 0.67, 0.84].map(|share| vec![w, 0.45, share, 700.0])).collect()
    },
    starts_from_rest: false,
    terms: |frame, shapes| {
        let masses =
            |shape: &Vec<f64>| effect(shape).and_then(|e| frame.axis.with_effects(vec![e]).two_masses().ok().flatten());
        let (sound, motion) = (shapes.iter().map(masses).collect::<Option<Vec<_>>>(), frame.motion());
        let Some((sound, motion)) = sound.zip(motion) else { return vec![Term::default(); shapes.len()] };
        sound.chunks(LANES).flat_map(|masses| Tables::new(frame, motion, masses).terms(masses.len())).collect()
    },
    effect: |_, shape, _| effect(shape),
    confused_with: &[Cause::PreslidingFriction, Cause::DriveCompliance],
    sentence: |effect, axis| match effect {
        Effect::Backlash { width_um, .. } => format!(
            "At each reversal the motor turns through {} {} of clearance before the table follows: nut, coupling or gearing has play.",
            say(*width_um),
            micro(axis)
        ),
        _ => String::new(),
    },
};

fn effect(shape: &[f64]) -> Option<Effect> {
    let [width_um, table_inertia_share, table_friction_share, contact_hz] = shape.try_into().ok()?;
    Some(Effect::Backlash { width_um, table_inertia_share, table_friction_share, contact_hz })
}

/// How long flanks swing after they have met, s: three time constants of their damping.
const SWING_S: f64 = 4e-3;
/// Tables that are simulated side by side: each step waits for the one before it, so that several cost little more than one.
const LANES: usize = 8;
/// A step's share of a radian of the flanks' swing.
const STEP_RAD: f64 = 0.25;

type Lanes = [f64; LANES];

fn lanes(value: impl Fn(usize) -> f64) -> Lanes {
    std::array::from_fn(value)
}

/// Tables behind one motor that moves as measured; motor's coordinate.
struct Tables<'a> {
    frame: &'a Frame<'a>,
    motion: &'a Motion,
    inertia: Lanes,
    /// Share of friction, its dry level and its viscous slope.
    share: Lanes,
    level: Lanes,
    viscous: Lanes,
    /// Half the clearance.
    half: Lanes,
    stiffness: Lanes,
    damping: Lanes,
    /// Steps a row.
    steps: usize,
}

/// Where the tables are.
struct State {
    position: Lanes,
    speed: Lanes,
    /// Rows since the flanks met last, while they stay together, and the way they push.
    together: [usize; LANES],
    side: Lanes,
    /// Not known to move with the motor.
    loose: [bool; LANES],
}

impl<'a> Tables<'a> {
    fn new(frame: &'a Frame<'a>, motion: &'a Motion, masses: &[TwoMasses]) -> Self {
        let b = &frame.belief;
        // Lanes without a table of their own repeat the last.
        let of = |value: fn(&TwoMasses) -> f64| lanes(|l| masses.get(l).or(masses.last()).map_or(1.0, value));
        let share = of(|m| m.table_friction_share);
        let fastest = masses.iter().map(|m| (m.stiffness / m.table_inertia).sqrt().max(m.damping / m.table_inertia));
        let steps = (frame.columns.period_s * fastest.fold(0.0, f64::max) / STEP_RAD).ceil().clamp(1.0, 1000.0);
        Self {
            frame,
            motion,
            inertia: of(|m| m.table_inertia),
            share,
            level: share.map(|s| s * b.coulomb),
            viscous: share.map(|s| s * b.viscous),
            half: of(|m| 0.5 * m.clearance),
            stiffness: of(|m| m.stiffness),
            damping: of(|m| m.damping),
            steps: steps as usize,
        }
    }

    /// The traces of the first `count` tables: torque beyond that of the rigid axis, and table − motor in load units.
    fn terms(&self, count: usize) -> Vec<Term> {
        let rows = self.frame.x.len();
        let (mut extra, mut lag) = (vec![vec![0.0; rows]; count], vec![vec![0.0; rows]; count]);
        for s in &self.frame.columns.stretches {
            if self.motion.velocity.get(s.start).is_some_and(|v| v.is_finite()) {
                self.stretch(s.clone(), &mut extra, &mut lag);
            }
        }
        let with_table = self.frame.columns.table.is_some();
        let term = |(extra, lag): (Vec<f64>, Vec<f64>)| {
            let table = if with_table { self.frame.judged_table(&lag) } else { Vec::new() };
            Term { fixed: Some(Trace { torque: self.frame.judged(&extra), table }), regressors: Vec::new() }
        };
        extra.into_iter().zip(lag).map(term).collect()
    }

    /// Torque that the link of a rigid axis carries at a row.
    fn carried(&self, i: usize) -> Lanes {
        let (b, unit) = (&self.frame.belief, self.frame.unit);
        let acceleration = self.motion.acceleration[i] * unit;
        let friction = b.coulomb * self.frame.direction[i] + b.viscous * self.motion.velocity[i] * unit;
        lanes(|l| self.inertia[l] * acceleration + self.share[l] * friction + b.constant)
    }

    fn stretch(&self, rows: Range<usize>, extra: &mut [Vec<f64>], lag: &mut [Vec<f64>]) {
        let unit = self.frame.unit;
        let settled = (SWING_S / self.frame.columns.period_s).ceil() as usize;
        // Where the table of a rigid link is at a load.
        let behind = |l: usize, motor: f64, load: f64| motor - self.half[l].copysign(load) - load / self.stiffness[l];
        let mut load = self.carried(rows.start);
        let mut state = State {
            position: [0.0; LANES],
            speed: [0.0; LANES],
            together: [0; LANES],
            side: [0.0; LANES],
            loose: [false; LANES],
        };
        for i in rows.start..rows.end - 1 {
            let next = self.carried(i + 1);
            let motor = self.motion.position[i] * unit;
            let steady = i > rows.start && self.frame.direction[i] * self.frame.direction[i + 1] > 0.5;
            let mut any = false;
            for l in 0..LANES {
                // Near no load the flanks may part within the row.
                let least = 0.1 * self.level[l];
                let firm = steady && load[l].abs() > least && next[l].abs() > least && load[l] * next[l] > 0.0;
                let held = !state.loose[l] || state.together[l] >= settled && state.side[l] * load[l] > 0.0;
                if firm && held || !state.loose[l] {
                    state.position[l] = behind(l, motor, load[l]);
                    state.speed[l] = self.motion.velocity[i] * unit;
                    state.together[l] = 0;
                }
                state.loose[l] = !(firm && held);
                any |= state.loose[l];
            }
            for (l, lag) in lag.iter_mut().enumerate() {
                lag[i] = (state.position[l] - motor) / unit;
            }
            if any {
                let link = self.between(i, &mut state);
                for (l, extra) in extra.iter_mut().enumerate().filter(|(l, _)| state.loose[*l]) {
                    let beyond = 0.5 * (link[l] - 0.5 * (load[l] + next[l]));
                    // A row stands between the mean before it and the one after it.
                    extra[i] += beyond;
                    extra[i + 1] += beyond;
                }
            }
            load = next;
        }
    }

    /// Moves the tables on by one row; answers the mean of each link's torque over it.
    fn between(&self, i: usize, state: &mut State) -> Lanes {
        let (unit, span, constant) = (self.frame.unit, self.frame.columns.period_s, self.frame.belief.constant);
        let at = |i: usize| (self.motion.position[i] * unit, self.motion.velocity[i] * unit * span);
        let ((q0, d0), (q1, d1)) = (at(i), at(i + 1));
        let (c2, c3) = (3.0 * (q1 - q0) - 2.0 * d0 - d1, 2.0 * (q0 - q1) + d0 + d1);
        let h = span / self.steps as f64;
        let (mut x, mut v, mut sum) = (state.position, state.speed, [0.0; LANES]);
        let mut apart = [0.0f64; LANES];
        for step in 0..self.steps {
            let s = (step as f64 + 0.5) / self.steps as f64;
            let motor = q0 + s * (d0 + s * (c2 + s * c3));
            let speed = (d0 + s * (2.0 * c2 + s * 3.0 * c3)) / span;
            for l in 0..LANES {
                let middle = x[l] + 0.5 * h * v[l];
                // Flanks push and never pull.
                let wind = motor - middle;
                let beyond = wind.abs() - self.half[l];
                let outward = (speed - v[l]) * 1.0f64.copysign(wind);
                let touching = if beyond > 0.0 { 1.0 } else { 0.0 };
                let push = touching * (self.stiffness[l] * beyond + self.damping[l] * outward).max(0.0);
                apart[l] = apart[l].max(if push > 0.0 { 0.0 } else { 1.0 });
                let push = push.copysign(wind);
                sum[l] += push;
                // Dry friction takes what impulse it can, and never turns it.
                let impulse = self.inertia[l] * v[l] + h * (push - constant - self.viscous[l] * v[l]);
                v[l] = (impulse.abs() - h * self.level[l]).max(0.0).copysign(impulse) / self.inertia[l];
                x[l] = middle + 0.5 * h * v[l];
            }
        }
        (state.position, state.speed, state.side) = (x, v, sum);
        for l in 0..LANES {
            state.together[l] = if apart[l] == 0.0 { state.together[l] + 1 } else { 0 };
        }
        sum.map(|sum| sum / self.steps as f64)
    }
}
