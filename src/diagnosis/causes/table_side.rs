//! The table behind a spring or a clearance, driven by the measured motion of the motor.
//!
//! J₂·ẍ₂ = c − φ·(Tc·Sign(ẋ₂) + Tv·ẋ₂) − T0, with c = k·(x₁ − x₂) + d·(ẋ₁ − ẋ₂) beyond the dead zone; the motor then needs
//! T = J₁·ẍ₁ + (1 − φ)·(Tc·sign(ẋ₁) + Tv·ẋ₁) + c. Tc and T0 are those of each row, see [`Resistance`]. Integrated by Moreau's
//! time stepping: friction is the impulse that brings the table towards rest, at most φ·Tc·h, so that a table at rest stays there
//! without chatter; where friction builds up over a way, it is what that makes of the table's own. Between rows the
//! motor goes along the cubic of its positions and speeds: a straight line would take (ω·h)²/12 off what swings at ω, which
//! looks like another inertia. The motion is as the encoder shows it: what smooths it takes the impacts off, and the table's
//! torque comes out too small.

mod bristles;
mod flanks;
mod lanes;
mod resistance;
mod spring;

pub use resistance::{Resistance, Shaking, at_once, built_up, level};

use super::*;
use crate::diagnosis::many::widest;
use crate::diagnosis::sampling::NUMEROV;
use crate::machine::TwoMasses;
use bristles::Bristles;
use lanes::{Lanes, Which};
use rayon::prelude::*;
use resistance::{Alike, Each, Resisted};
use spring::MOST_STEPS;
use std::cell::RefCell;
use std::f64::consts::TAU;
use std::ops::Range;

/// The traces in the torque (against the rigid axis) and in table − encoder, of each effect.
pub fn terms(frame: &Frame, resistance: &Resistance, effects: &[Option<Effect>]) -> Vec<Term> {
    terms_of(frame, resistance, &effects.iter().map(|effect| split(frame, *effect)).collect::<Vec<_>>())
}

/// The same of one effect under each of these resistances.
pub fn terms_under_each(frame: &Frame, resistances: &[&Resistance], effect: Option<Effect>) -> Vec<Term> {
    let Some(masses) = split(frame, effect) else { return vec![Term::default(); resistances.len()] };
    let together = |some: &[&Resistance]| match some {
        [one] => Tables::<1, _>::new(frame, Alike(one), &[masses]).terms(1),
        several => {
            let own: [&Resistance; FEW] = std::array::from_fn(|l| several[l.min(several.len() - 1)]);
            Tables::<FEW, _>::new(frame, Each(own), &[masses]).terms(several.len())
        }
    };
    resistances.par_chunks(FEW).flat_map_iter(together).collect()
}

/// Motor and table of an axis with an effect; `None` where it has none or it sets nothing apart.
pub fn split(frame: &Frame, effect: Option<Effect>) -> Option<TwoMasses> {
    frame.axis.with_effects(vec![effect?]).two_masses().ok().flatten()
}

/// The trace of what an axis is believed to have between motor and table; `None` where that is nothing.
pub fn believed(frame: &Frame, axis: &Axis, resistance: &Resistance) -> Option<Trace> {
    let masses = axis.two_masses().ok().flatten()?;
    terms_of(frame, resistance, &[Some(masses)]).swap_remove(0).fixed
}

/// How a table swings behind a spring, as the law of an elastic drive has it: its own frequency, Hz, the share of the inertia, the
/// share of the friction over that, and its own damping ratio.
pub fn swing_of(masses: &TwoMasses) -> Vec<f64> {
    let own = (masses.stiffness / masses.table_inertia).sqrt();
    let share = masses.table_inertia / (masses.table_inertia + masses.motor_inertia);
    let damping_ratio = 0.5 * masses.damping / (masses.table_inertia * own);
    vec![own / TAU, share, masses.table_friction_share / share, damping_ratio]
}

/// The spring, as the law of an elastic drive has it, that flanks are which give more under the friction of the table, to either side,
/// than they are apart; `None` where they are farther. Flanks that meet are damped more than any spring, whose damping ratio is told.
pub fn as_spring(frame: &Frame, masses: &TwoMasses, damping_ratio: f64) -> Option<Vec<f64>> {
    let gives = 2.0 * masses.table_friction_share * frame.belief.coulomb / masses.stiffness;
    let mut shape = swing_of(masses);
    *shape.last_mut()? = damping_ratio;
    (gives > masses.clearance).then_some(shape)
}

/// Standard deviation of a spring's damping ratio by what nobody knows: viscous friction may act on the motor or on the table, where
/// it damps the table's swing as the spring's own damping does, and need not be shared as dry friction is.
pub fn open_damping(frame: &Frame, effect: &Effect) -> f64 {
    let Some(m) = split(frame, Some(*effect)) else { return 0.0 };
    // Any share of it on the table alike.
    let viscous = frame.belief.viscous * (1.0 / 12.0 + (m.table_friction_share - 0.5).powi(2)).sqrt();
    let swing = (m.stiffness * m.table_inertia).sqrt();
    // The own damping ratio of the table over that of the two masses is as their frequencies.
    let faster = ((m.motor_inertia + m.table_inertia) / m.motor_inertia).sqrt();
    0.5 * viscous / swing * faster
}

fn terms_of(frame: &Frame, resistance: &Resistance, splits: &[Option<TwoMasses>]) -> Vec<Term> {
    let sound: Vec<TwoMasses> = splits.iter().copied().flatten().collect();
    let together = |masses: &[TwoMasses]| match masses {
        [one] => Tables::<1, _>::new(frame, Alike(resistance), std::slice::from_ref(one)).terms(1),
        few if few.len() <= FEW => Tables::<FEW, _>::new(frame, Alike(resistance), few).terms(few.len()),
        several => Tables::<LANES, _>::new(frame, Alike(resistance), several).terms(several.len()),
    };
    // As many in each go, which may go at a time. Few are shared between cores that may have nothing else to do.
    let most = if sound.len() > LANES { LANES } else { FEW };
    let in_a_go = sound.len().div_ceil(sound.len().div_ceil(most).max(1)).max(1);
    let mut found = sound.par_chunks(in_a_go).flat_map_iter(together).collect::<Vec<_>>().into_iter();
    splits.iter().map(|split| split.and_then(|_| found.next()).unwrap_or_default()).collect()
}

/// Tables that are simulated side by side: each step waits for the one before it, so that several cost little more than one.
/// A table by itself is simulated by itself.
const LANES: usize = 8;
/// The same of few, and under resistances of their own, which a row has to fetch for each.
const FEW: usize = 4;
/// Radians of the fastest swing to a step: of a spring, whose swing is all that there is, and of flanks.
const STEP_RAD: [f64; 2] = [0.12, 0.35];
/// Time constants of a swing until it is gone, and for how long flanks that are no spring swing at most, s.
const SWINGS: f64 = 3.0;
const LONG_S: f64 = 0.04;
/// Radians of a table's swing on the bristles of its friction over which their torque may be taken from half way.
const MOST_BRISTLE_RAD: f64 = 0.7;

thread_local! {
    /// Torque and table − motor of every row and table, kept for the next simulation: handed back and asked for again each time, the
    /// memory would take as long as the simulation.
    static ROOM: RefCell<[Vec<f64>; 2]> = const { RefCell::new([Vec::new(), Vec::new()]) };
}

/// Tables behind one motor that moves as measured; motor's coordinate.
struct Tables<'a, const N: usize, R> {
    frame: &'a Frame<'a>,
    resistance: R,
    inertia: Lanes<N>,
    /// Share of friction.
    share: Lanes<N>,
    /// Half the clearance, and what the spring would carry over that.
    half: Lanes<N>,
    slack: Lanes<N>,
    /// The spring as the steps need it, and how much softer that is than the real one.
    stiffness: Lanes<N>,
    softer: Lanes<N>,
    damping: Lanes<N>,
    /// Pieces between two rows, steps of all of them, and the time of each step, s.
    pieces: usize,
    steps: usize,
    step_s: f64,
    /// What a step makes of a torque on the table, and on a motor that gives way to it, and of the speed there is.
    mobility: Lanes<N>,
    motor_mobility: Lanes<N>,
    kept: Lanes<N>,
    /// How friction builds up on the tables' own way, of a table with all of it, where a step is short beside that way.
    bristles: Option<Bristles<N>>,
    /// By what each is shaken of what its motor holds and of that a quarter of a period later, if any is. Flanks are not: what shakes their table is
    /// passed on while they push.
    shaken: [Vec<[f64; 2]>; N],
    is_shaken: bool,
    /// Whether there is a dead zone: flanks push and never pull.
    flanks: bool,
    /// Behind flanks that meet so softly that they swing for long: those never move as one with the motor.
    swings: Which<N>,
}

/// What resists tables at a row: the load of each and its largest dry friction, and that of a table with all of it.
struct Resisting<const N: usize> {
    load: Lanes<N>,
    friction: Lanes<N>,
    level: Lanes<N>,
}

/// The way of the motor from a row to the next: value and derivatives of the cubic by shares of the time between them.
#[derive(Clone, Copy)]
struct Way {
    at: f64,
    rate: f64,
    bend: f64,
    twist: f64,
}

impl Way {
    /// Position after a share of the time.
    #[inline(always)]
    fn position(&self, s: f64) -> f64 {
        self.at + s * (self.rate + s * (self.bend + s * self.twist))
    }

    /// Speed there, per time between rows.
    #[inline(always)]
    fn speed(&self, s: f64) -> f64 {
        self.rate + s * (2.0 * self.bend + s * 3.0 * self.twist)
    }
}

impl<'a, const N: usize, R: Resisted<N>> Tables<'a, N, R> {
    fn new(frame: &'a Frame<'a>, resistance: R, masses: &[TwoMasses]) -> Self {
        // Lanes without a table of their own repeat the last.
        let of = |value: fn(&TwoMasses) -> f64| Lanes::each(|l| masses.get(l).or(masses.last()).map_or(1.0, value));
        let share = of(|m| m.table_friction_share);
        let fastest = masses.iter().map(|m| (m.stiffness / m.table_inertia).sqrt().max(m.damping / m.table_inertia));
        let flanks = masses.iter().any(|m| m.clearance > 0.0);
        let radians = frame.columns.period_s * fastest.fold(0.0, f64::max);
        let constant_s = of(|m| 2.0 * m.table_inertia / m.damping.max(1e-300));
        let swings = (constant_s * SWINGS).above(Lanes::splat(LONG_S));
        let steps = (radians / STEP_RAD[usize::from(flanks)]).ceil().clamp(1.0, 1000.0);
        let pieces = if flanks { 1.0 } else { (steps / MOST_STEPS).ceil() };
        let steps = pieces * (steps / pieces).ceil();
        let step_s = frame.columns.period_s / steps;
        let inertia = of(|m| m.table_inertia);
        let mobility = Lanes::splat(step_s) / inertia;
        // In steps of h a spring swings at ω when it is softer by (sin(ωh/2)/(ωh/2))² (leapfrog integration).
        let swing = of(|m| (m.stiffness / m.table_inertia).sqrt());
        let softer = Lanes::each(|l| {
            let half = (0.5 * step_s * swing.of(l)).clamp(1e-9, 1.0);
            (half.sin() / half).powi(2)
        });
        let (stiffness, half) = (of(|m| m.stiffness) * softer, of(|m| 0.5 * m.clearance));
        // On a bristle that is stiffer than its steps can follow friction is there at once.
        let lightest =
            masses.iter().map(|m| m.table_inertia / m.table_friction_share.max(1e-9)).fold(f64::MAX, f64::min);
        let piece_s = if flanks { step_s } else { frame.columns.period_s / pieces };
        let swings_slower = |(_, stiffness): &(_, f64)| (stiffness / lightest).sqrt() * piece_s < MOST_BRISTLE_RAD;
        let viscous = resistance.each(|r| r.viscous);
        let of_lane = |l: usize| masses.get(l).or(masses.last()).filter(|_| !flanks);
        let shaken = |(l, masses): (usize, &TwoMasses)| {
            let waves = resistance.lane(l).shaking.iter();
            waves.map(|wave| wave.at_the_table(masses, viscous.of(l))).collect()
        };
        let shaken: [Vec<_>; N] =
            std::array::from_fn(|l| of_lane(l).map_or_else(Vec::new, |masses| shaken((l, masses))));
        Self {
            is_shaken: shaken.iter().any(|waves| !waves.is_empty()),
            shaken,
            frame,
            resistance,
            inertia,
            share,
            half,
            slack: stiffness * half,
            softer,
            stiffness,
            damping: of(|m| m.damping),
            pieces: pieces as usize,
            steps: steps as usize,
            step_s,
            mobility,
            // What swings slower than the rows come is in the motor's measured way.
            motor_mobility: (!swings).keep(Lanes::splat(step_s) / of(|m| m.motor_inertia)),
            kept: Lanes::splat(1.0) - mobility * share * viscous,
            bristles: resistance
                .bristles()
                .filter(|bristles| bristles.iter().all(swings_slower))
                .map(|bristles| Bristles::new(bristles.map(|(friction, _)| friction))),
            flanks,
            swings,
        }
    }

    /// The traces of the first `count` tables: torque beyond that of the rigid axis, each row the mean under a triangle over one
    /// row to either side, and table − motor in load units.
    fn terms(&self, count: usize) -> Vec<Term> {
        ROOM.with_borrow_mut(|[extra, lag]| {
            let rows = self.frame.x.len();
            let lags = if self.frame.columns.table.is_some() { rows } else { 0 };
            // What was there before is written over, row by row.
            extra.resize(N * rows, 0.0);
            lag.resize(N * lags, 0.0);
            let [extra, lag] = [extra, lag].map(|column| column.as_chunks_mut::<N>().0);
            let sliding = if self.flanks { None } else { Some(self.sliding()) };
            for s in self.frame.columns.stretches.iter().cloned() {
                // Each by itself: what else may be done is in the way of the registers.
                match &sliding {
                    Some(sliding) => widest(
                        #[inline(always)]
                        || self.behind_springs(sliding, s, extra, lag),
                    ),
                    None if self.bristles.is_some() => widest(
                        #[inline(always)]
                        || self.behind_flanks::<true>(s, extra, lag),
                    ),
                    None => widest(
                        #[inline(always)]
                        || self.behind_flanks::<false>(s, extra, lag),
                    ),
                }
            }
            let torques = self.frame.low_passed_together(extra);
            let tables =
                if lags > 0 { self.frame.low_passed_together(lag) } else { std::array::from_fn(|_| Vec::new()) };
            let term = |(lane, (mut torque, mut table)): (usize, (Vec<f64>, Vec<f64>))| {
                if !self.shaken[lane].is_empty() {
                    let Trace { torque: held, table: swinging } = &self.resistance.lane(lane).sliding;
                    torque.iter_mut().zip(held).for_each(|(torque, held)| *torque -= held);
                    table.iter_mut().zip(swinging).for_each(|(table, swinging)| *table -= swinging);
                }
                Term { fixed: Some(Trace { torque, table }), regressors: Vec::new() }
            };
            torques.into_iter().zip(tables).take(count).enumerate().map(term).collect()
        })
    }

    /// What resists the motion of a rigid axis at a row, by a speed: friction of which the tables have their share, and load.
    #[inline(always)]
    fn resisting(&self, i: usize, speed: f64) -> [Lanes<N>; 2] {
        let speed = speed * self.frame.unit;
        [self.resistance.each(|r| r.dry[i] + r.viscous * speed + r.even[i]), self.resistance.each(|r| r.load[i])]
    }

    /// What resists the tables at a row.
    #[inline(always)]
    fn resisting_tables(&self, i: usize) -> Resisting<N> {
        let [even, load] = [self.resistance.each(|r| r.even[i]), self.resistance.each(|r| r.load[i])];
        let level = self.resistance.each(|r| r.level[i]);
        let shaking = |l: usize| {
            let waves = self.resistance.lane(l).shaking.iter().zip(&self.shaken[l]);
            waves.map(|(wave, [held, quarter])| held * wave.held[i] + quarter * wave.quarter[i]).sum::<f64>()
        };
        let load = if self.is_shaken { load + Lanes::each(shaking) } else { load };
        Resisting { load: load + self.share * even, friction: self.share * level, level }
    }

    /// Torque that the link of a rigid axis carries at a row.
    #[inline(always)]
    fn carried(&self, i: usize) -> Lanes<N> {
        let acceleration = self.frame.a[i] * self.frame.unit;
        let [friction, load] = self.resisting(i, self.frame.v[i]);
        self.inertia * acceleration + self.share * friction + load
    }

    /// Torque that the links carry where rows begin: that of a rigid axis, or, of an axis that rests there, what the motor gives as far
    /// as the friction of the resting table can hold it against the load. Friction that builds up has not yet, and holds nothing.
    fn carried_first(&self, rows: Range<usize>) -> Lanes<N> {
        let (first, frame) = (rows.start, self.frame);
        let resting = rows.take_while(|i| frame.direction[*i] == 0.0).map(|i| frame.columns.torque[i]);
        let (count, sum) = resting.fold((0.0, 0.0), |(count, sum), torque| (count + 1.0, sum + torque));
        if count == 0.0 || self.bristles.is_some() {
            return self.carried(first);
        }
        let Resisting { load, friction, .. } = self.resisting_tables(first);
        Lanes::splat(sum / count).smaller(load + friction).larger(load - friction)
    }

    /// What the link of a rigid axis carries between a row and the next, shared between them by how near it acts: the
    /// triangular mean of the acceleration is a second difference, that of friction is taken as the base takes it.
    #[inline(always)]
    fn rigid(&self, i: usize) -> [Lanes<N>; 2] {
        let (unit, span) = (self.frame.unit, self.frame.columns.period_s);
        let step = self.frame.columns.position[i + 1] - self.frame.columns.position[i];
        let speed = |i: usize| self.frame.raw_speed[i];
        let ([here, load], [next, next_load]) = (self.resisting(i, speed(i)), self.resisting(i + 1, speed(i + 1)));
        let [side, middle] = [NUMEROV[0], 0.5 * NUMEROV[1]];
        let share = |acceleration: f64, [of_here, of_next]: [f64; 2]| {
            let friction = here * of_here + next * of_next;
            let load = load * of_here + next_load * of_next;
            self.inertia * acceleration * unit + self.share * friction + load
        };
        [
            share((step - span * speed(i)) / (span * span), [middle, side]),
            share((span * speed(i + 1) - step) / (span * span), [side, middle]),
        ]
    }

    /// The motor's way from a row to the next.
    #[inline(always)]
    fn way(&self, i: usize) -> Way {
        let unit = self.frame.unit;
        let at = |i: usize| {
            (self.frame.columns.position[i] * unit, self.frame.raw_speed[i] * unit * self.frame.columns.period_s)
        };
        let ((q0, d0), (q1, d1)) = (at(i), at(i + 1));
        Way { at: q0, rate: d0, bend: 3.0 * (q1 - q0) - 2.0 * d0 - d1, twist: 2.0 * (q0 - q1) + d0 + d1 }
    }
}
