//! The table behind a spring or a clearance, driven by the measured motion of the motor.
//!
//! J₂·ẍ₂ = c − φ·(Tc·Sign(ẋ₂) + Tv·ẋ₂) − T0, with c = k·(x₁ − x₂) + d·(ẋ₁ − ẋ₂) beyond the dead zone; the motor then needs
//! T = J₁·ẍ₁ + (1 − φ)·(Tc·sign(ẋ₁) + Tv·ẋ₁) + c. Integrated by Moreau's time stepping: friction is the impulse that
//! brings the table towards rest, at most φ·Tc·h, so that a table at rest stays there without chatter. Between rows the
//! motor goes along the cubic of its positions and speeds: a straight line would take (ω·h)²/12 off what swings at ω, which
//! looks like another inertia. The motion is as the encoder shows it: what smooths it takes the impacts off, and the table's
//! torque comes out too small.
//! Before flanks that meet the motor gives way between its rows, as [`Giving`] says.
//!
//! While the link of a clearance is loaded one way, c = J₂·ẍ₁ + φ·(Tc·sign(ẋ₁) + Tv·ẋ₁) + T0 keeps one flank in contact, the
//! table moves with the motor, and nothing need be simulated.

use super::*;
use crate::diagnosis::many::widest;
use crate::diagnosis::sampling::NUMEROV;
use crate::machine::TwoMasses;
use crate::plant::coupling::Giving;
use std::cell::RefCell;
use std::ops::Range;

/// The traces in the torque (against the rigid axis) and in table − encoder, of each effect.
pub fn terms(frame: &Frame, effects: &[Option<Effect>]) -> Vec<Term> {
    let split = |e: &Option<Effect>| e.and_then(|e| frame.axis.with_effects(vec![e]).two_masses().ok().flatten());
    terms_of(frame, &effects.iter().map(split).collect::<Vec<_>>())
}

/// The trace of what an axis is believed to have between motor and table; `None` where that is nothing.
pub fn believed(frame: &Frame, axis: &Axis) -> Option<Trace> {
    let masses = axis.two_masses().ok().flatten()?;
    terms_of(frame, &[Some(masses)]).swap_remove(0).fixed
}

fn terms_of(frame: &Frame, splits: &[Option<TwoMasses>]) -> Vec<Term> {
    let sound: Vec<TwoMasses> = splits.iter().copied().flatten().collect();
    let together = |masses: &[TwoMasses]| Tables::new(frame, masses).terms(masses.len());
    let mut found = sound.chunks(LANES).flat_map(together).collect::<Vec<_>>().into_iter();
    splits.iter().map(|split| split.and_then(|_| found.next()).unwrap_or_default()).collect()
}

/// How long flanks swing after they have met, s: three time constants of their damping.
const SWING_S: f64 = 4e-3;
/// Tables that are simulated side by side: each step waits for the one before it, so that several cost little more than one.
const LANES: usize = 8;
/// Radians of the fastest swing to a step: of a spring, whose swing is all that there is, and of flanks.
const STEP_RAD: [f64; 2] = [0.12, 0.35];

type Lanes = [f64; LANES];

thread_local! {
    /// Torque and table − motor of every row, kept for the next simulation: handed back and asked for again each time, the
    /// memory would take as long as the simulation.
    static ROOM: RefCell<[Vec<Lanes>; 2]> = const { RefCell::new([Vec::new(), Vec::new()]) };
}

#[inline(always)]
fn lanes(value: impl Fn(usize) -> f64) -> Lanes {
    std::array::from_fn(value)
}

/// Tables behind one motor that moves as measured; motor's coordinate.
struct Tables<'a> {
    frame: &'a Frame<'a>,
    inertia: Lanes,
    /// How the motor gives way.
    giving: Giving,
    motor_mobility: Lanes,
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
    /// Wind-up of the real spring over that of the simulated one.
    wind: Lanes,
    /// Whether there is a dead zone: flanks push and never pull.
    flanks: bool,
}

/// Where the tables are.
struct State {
    position: Lanes,
    speed: Lanes,
    /// Rows since the flanks met last, while they stay together, and the way they push.
    together: [usize; LANES],
    side: Lanes,
    /// How the motor has given way.
    given: [Lanes; 3],
    /// Not known to move with the motor.
    loose: [bool; LANES],
}

impl<'a> Tables<'a> {
    fn new(frame: &'a Frame<'a>, masses: &[TwoMasses]) -> Self {
        let b = &frame.belief;
        // Lanes without a table of their own repeat the last.
        let of = |value: fn(&TwoMasses) -> f64| lanes(|l| masses.get(l).or(masses.last()).map_or(1.0, value));
        let share = of(|m| m.table_friction_share);
        let fastest = masses.iter().map(|m| (m.stiffness / m.table_inertia).sqrt().max(m.damping / m.table_inertia));
        let flanks = masses.iter().any(|m| m.clearance > 0.0);
        let radians = frame.columns.period_s * fastest.fold(0.0, f64::max);
        let steps = (radians / STEP_RAD[usize::from(flanks)]).ceil().clamp(1.0, 1000.0);
        let h = frame.columns.period_s / steps;
        // In steps of h a spring swings at ω when it is softer by (sin(ωh/2)/(ωh/2))² (leapfrog integration).
        let swing = of(|m| (m.stiffness / m.table_inertia).sqrt()).map(|omega| (0.5 * h * omega).clamp(1e-9, 1.0));
        let softer = swing.map(|half| (half.sin() / half).powi(2));
        let stiffness = of(|m| m.stiffness);
        Self {
            frame,
            inertia: of(|m| m.table_inertia),
            giving: Giving::new(frame.columns.period_s, h),
            motor_mobility: of(|m| m.motor_inertia).map(|j| h / j),
            share,
            level: share.map(|s| s * b.coulomb),
            viscous: share.map(|s| s * b.viscous),
            half: of(|m| 0.5 * m.clearance),
            stiffness: lanes(|l| stiffness[l] * softer[l]),
            wind: if flanks { [1.0; LANES] } else { softer },
            damping: of(|m| m.damping),
            steps: steps as usize,
            flanks,
        }
    }

    /// The traces of the first `count` tables: torque beyond that of the rigid axis, each row the mean under a triangle over one
    /// row to either side, and table − motor in load units.
    fn terms(&self, count: usize) -> Vec<Term> {
        ROOM.with_borrow_mut(|[extra, lag]| {
            let rows = self.frame.x.len();
            let lags = if self.frame.columns.table.is_some() { rows } else { 0 };
            for (column, rows) in [(&mut *extra, rows), (&mut *lag, lags)] {
                column.clear();
                column.resize(rows, [0.0; LANES]);
            }
            for s in &self.frame.columns.stretches {
                widest(
                    #[inline(always)]
                    || self.stretch(s.clone(), extra, lag),
                );
            }
            let torques = self.frame.low_passed_together(extra);
            let tables = if lags > 0 { self.frame.low_passed_together(lag) } else { Default::default() };
            let term = |(torque, table)| Term { fixed: Some(Trace { torque, table }), regressors: Vec::new() };
            torques.into_iter().zip(tables).take(count).map(term).collect()
        })
    }

    /// Torque that the link of a rigid axis carries at a row.
    #[inline(always)]
    fn carried(&self, i: usize) -> Lanes {
        let (b, unit) = (&self.frame.belief, self.frame.unit);
        let acceleration = self.frame.a[i] * unit;
        let friction = b.coulomb * self.frame.direction[i] + b.viscous * self.frame.v[i] * unit;
        lanes(|l| self.inertia[l] * acceleration + self.share[l] * friction + b.constant)
    }

    #[inline(always)]
    fn stretch(&self, rows: Range<usize>, extra: &mut [Lanes], lag: &mut [Lanes]) {
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
            given: [[0.0; LANES]; 3],
            loose: [false; LANES],
        };
        for i in rows.start..rows.end - 1 {
            let next = self.carried(i + 1);
            let motor = self.frame.columns.position[i] * unit;
            let steady = i > rows.start && self.frame.direction[i] * self.frame.direction[i + 1] > 0.5;
            let mut any = false;
            for l in 0..LANES {
                // Near no load the flanks may part within the row.
                let least = 0.1 * self.level[l];
                let firm =
                    self.flanks && steady && load[l].abs() > least && next[l].abs() > least && load[l] * next[l] > 0.0;
                let held = !state.loose[l] || state.together[l] >= settled && state.side[l] * load[l] > 0.0;
                if firm && held || !state.loose[l] {
                    state.position[l] = behind(l, motor, load[l]);
                    state.speed[l] = self.frame.raw_speed[i] * unit;
                    state.together[l] = 0;
                    (state.given[0][l], state.given[1][l], state.given[2][l]) = (0.0, 0.0, load[l]);
                }
                state.loose[l] = !(firm && held);
                any |= state.loose[l];
            }
            if let Some(lag) = lag.get_mut(i) {
                *lag = lanes(|l| self.wind[l] * (state.position[l] - motor) / unit);
            }
            if any {
                let [near, far] = self.between(i, &mut state);
                let rigid = self.rigid(i);
                for l in (0..LANES).filter(|l| state.loose[*l]) {
                    extra[i][l] += near[l] - rigid[0][l];
                    extra[i + 1][l] += far[l] - rigid[1][l];
                }
            }
            load = next;
        }
    }

    /// What the link of a rigid axis carries between a row and the next, shared between them as [`Tables::between`] does: the
    /// triangular mean of the acceleration is a second difference, that of friction is taken as the base takes it.
    #[inline(always)]
    fn rigid(&self, i: usize) -> [Lanes; 2] {
        let (b, unit, span) = (&self.frame.belief, self.frame.unit, self.frame.columns.period_s);
        let step = self.frame.columns.position[i + 1] - self.frame.columns.position[i];
        let speed = |i: usize| self.frame.raw_speed[i];
        let friction = |i: usize| b.coulomb * self.frame.direction[i] + b.viscous * speed(i) * unit;
        let [side, middle] = [NUMEROV[0], 0.5 * NUMEROV[1]];
        let share = |acceleration: f64, friction: f64| {
            lanes(|l| self.inertia[l] * acceleration * unit + self.share[l] * friction + 0.5 * b.constant)
        };
        [
            share((step - span * speed(i)) / (span * span), middle * friction(i) + side * friction(i + 1)),
            share((span * speed(i + 1) - step) / (span * span), side * friction(i) + middle * friction(i + 1)),
        ]
    }

    /// Moves the tables on by one row; answers the share of each link's torque that belongs to the row and to the next one, by
    /// how near it acts.
    #[inline(always)]
    fn between(&self, i: usize, state: &mut State) -> [Lanes; 2] {
        if self.flanks { self.steps_of::<true>(i, state) } else { self.steps_of::<false>(i, state) }
    }

    #[inline(always)]
    fn steps_of<const FLANKS: bool>(&self, i: usize, state: &mut State) -> [Lanes; 2] {
        let (unit, span) = (self.frame.unit, self.frame.columns.period_s);
        let at = |i: usize| (self.frame.columns.position[i] * unit, self.frame.raw_speed[i] * unit * span);
        let ((q0, d0), (q1, d1)) = (at(i), at(i + 1));
        let (c2, c3) = (3.0 * (q1 - q0) - 2.0 * d0 - d1, 2.0 * (q0 - q1) + d0 + d1);
        let (per_step, per_span) = (1.0 / self.steps as f64, 1.0 / span);
        let half_step = 0.5 * span * per_step;
        // What a step makes of a torque, of the speed there is, and what speed dry friction takes at most.
        let mobility = self.inertia.map(|j| span * per_step / j);
        let kept = lanes(|l| 1.0 - mobility[l] * self.viscous[l]);
        let dry = lanes(|l| mobility[l] * self.level[l]);
        let (mut x, mut v) = (state.position, state.speed);
        let [mut give, mut giving, mut answered] = state.given;
        let (mut sum, mut far, mut least) = ([0.0; LANES], [0.0; LANES], [f64::INFINITY; LANES]);
        for step in 0..self.steps {
            let s = (step as f64 + 0.5) * per_step;
            let motor = q0 + s * (d0 + s * (c2 + s * c3));
            let speed = (d0 + s * (2.0 * c2 + s * 3.0 * c3)) * per_span;
            for l in 0..LANES {
                let middle = x[l] + half_step * v[l];
                let wind = motor - middle + if FLANKS { give[l] } else { 0.0 };
                let push = if FLANKS {
                    // Flanks push and never pull.
                    let outward = (speed + giving[l] - v[l]) * 1.0f64.copysign(wind);
                    let beyond = wind.abs() - self.half[l];
                    let spring = larger(self.stiffness[l] * beyond + self.damping[l] * outward, 0.0);
                    let push = if beyond > 0.0 { spring } else { 0.0 };
                    least[l] = smaller(push, least[l]);
                    push.copysign(wind)
                } else {
                    self.stiffness[l] * wind + self.damping[l] * (speed - v[l])
                };
                if FLANKS {
                    [give[l], giving[l], answered[l]] =
                        self.giving.step([give[l], giving[l], answered[l]], push, self.motor_mobility[l]);
                }
                sum[l] += push;
                far[l] += s * push;
                // Dry friction takes what speed it can, and never turns it.
                let free = kept[l] * v[l] + mobility[l] * (push - self.frame.belief.constant);
                v[l] = free - larger(smaller(free, dry[l]), -dry[l]);
                x[l] = middle + half_step * v[l];
            }
        }
        (state.position, state.speed, state.side) = (x, v, sum);
        state.given = [give, giving, answered];
        for l in 0..LANES {
            state.together[l] = if least[l] > 0.0 { state.together[l] + 1 } else { 0 };
        }
        [lanes(|l| (sum[l] - far[l]) * per_step), far.map(|far| far * per_step)]
    }
}

/// The larger of two numbers; unlike the library's, which minds NaN, one instruction.
#[inline(always)]
fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// The smaller of two numbers, likewise.
#[inline(always)]
fn smaller(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}
