//! What resists a table's motion, row by row: friction and load as a set of causes has them. A spring winds up, and a clearance is
//! crossed, by all the friction that there is, not by that of the belief alone: behind a drive whose friction rises by a third the
//! table lags by a third more.

use super::{Lanes, Law, Trace};
use crate::diagnosis::belief;
use crate::diagnosis::frame::Frame;
use crate::diagnosis::many::{add, apart, decay, dot, to_the_power, widest};
use crate::machine::{Axis, Effect, TwoMasses};
use crate::plant::friction::Friction;
use crate::plant::physics::Physics;
use std::sync::OnceLock;

/// Change of dry friction and load, as a share of both (root mean square), that leaves a simulated table where it is.
const ALIKE: f64 = 3e-4;

/// Change of the load, as a share of the dry friction of all of the axis (root mean square), from which on it may lean a table on another
/// flank: tables carry a quarter of that friction and more.
const LEANS: f64 = 0.25;

/// Friction and load of an axis along a recording, drive's own unit; the table has its share of the friction and all of the load.
#[derive(Debug, Clone, PartialEq)]
pub struct Resistance {
    /// The axis that has it.
    axis: Axis,
    /// What that has between motor and table, where a scale shows it.
    link: Option<TwoMasses>,
    /// What shakes a table behind a spring.
    pub(super) shaking: Vec<Shaking>,
    /// What one that slides all the time makes of it, at the judged rows: simulated ones show what they make else.
    pub(super) sliding: Trace,
    /// Largest dry friction of the table at each row. At the speed that is measured, its own where it has a scale: one that is simulated
    /// behind a motor that moves as measured has no servo that answers, and friction which falls with its speed would set it swinging.
    pub(super) level: Vec<f64>,
    /// Dry friction of the measured motion at each row.
    pub(super) dry: Vec<f64>,
    /// What friction has beside that and the viscous slope at each row: another slope in each direction.
    pub(super) even: Vec<f64>,
    /// Load at each row.
    pub(super) load: Vec<f64>,
    /// Slope of viscous friction.
    pub(super) viscous: f64,
    /// What dry friction builds up by, at rest, of a table with all of it; `None` where it is there at once.
    pub(super) bristle: Option<(Friction, f64)>,
    /// What a bristle of such a table holds at each row as long as the table moves with its motor, once somebody has asked for it.
    held: OnceLock<Vec<f64>>,
}

/// What shakes a table, half way from each row to the next, drive's own unit: what a motor holds of it through a spring while the table
/// slides, and the same a quarter of a period later.
#[derive(Debug, Clone, PartialEq)]
pub struct Shaking {
    /// Angular frequency.
    pub omega: f64,
    /// As held.
    pub held: Vec<f64>,
    /// A quarter later.
    pub quarter: Vec<f64>,
}

impl Shaking {
    /// Of what is held, and of that a quarter later, what shakes a table that is behind this, by the slope of viscous friction.
    #[must_use]
    pub fn at_the_table(&self, masses: &TwoMasses, viscous: f64) -> [f64; 2] {
        let (passes, late) = masses.passes(self.omega, viscous);
        [late.cos() / passes, late.sin() / passes]
    }
}

impl Resistance {
    /// That of an axis, whatever it has between motor and table.
    #[must_use]
    pub fn of(frame: &Frame, axis: &Axis) -> Self {
        let link = frame.columns.table.as_ref().and_then(|_| axis.two_masses().ok()?);
        let resisting = axis.with_effects(axis.effects.iter().filter(|e| Self::has(e)).copied().collect());
        // What lies between motor and table is all that an axis may contradict itself in.
        match Physics::of(&resisting) {
            Ok(physics) => Self { link, ..Self::along(frame, axis, &physics) },
            Err(_) => Self { link, ..Self::none(frame, axis) },
        }
    }

    /// What the axis has between motor and table, where a scale shows it.
    #[must_use]
    pub fn link(&self) -> Option<&TwoMasses> {
        self.link.as_ref()
    }

    /// From where on the motor of the axis delivers less than its current says, and how much of what that adds.
    #[must_use]
    pub fn saturation(&self) -> Option<(f64, f64)> {
        self.axis.effects.iter().find_map(|effect| match *effect {
            Effect::TorqueSaturation { limit, slope_ratio } => Some((limit, slope_ratio)),
            _ => None,
        })
    }

    /// The same where a cause with these numbers shakes the table.
    #[must_use]
    pub fn shaken_by(mut self, frame: &Frame, law: &Law, shape: &[f64], coefficients: &[f64]) -> Self {
        let Some(shaking) = law.shakes(frame, shape, coefficients) else { return self };
        let term = law.terms(frame, &self, &[shape.to_vec()]).swap_remove(0);
        for (trace, c) in term.regressors.iter().zip(coefficients) {
            grown(&mut self.sliding.torque, &trace.torque, *c);
            grown(&mut self.sliding.table, &trace.table, *c);
        }
        self.shaking.push(shaking);
        self
    }

    /// That of the same axis with what was found beside what it is believed to have.
    #[must_use]
    pub fn with(&self, frame: &Frame, found: Vec<Effect>) -> Self {
        let (shaking, sliding) = (self.shaking.clone(), self.sliding.clone());
        Self { shaking, sliding, ..Self::of(frame, &belief::with_found(&self.axis, frame.axis, found)) }
    }

    /// Whether an effect is any of it, or what the motor makes of its current.
    #[must_use]
    pub fn has_or_delivers(effect: &Effect) -> bool {
        Self::has(effect) || matches!(effect, Effect::TorqueSaturation { .. })
    }

    /// Whether an effect is any of it.
    #[must_use]
    pub fn has(effect: &Effect) -> bool {
        use Effect::*;
        matches!(
            effect,
            CoulombFrictionMismatch { .. }
                | ViscousFrictionMismatch { .. }
                | ConstantTorque { .. }
                | DirectionDependentFriction { .. }
                | StribeckFriction { .. }
                | PreslidingFriction { .. }
                | PositionDependentFriction { .. }
                | CableForce { .. }
                | QuadraticDrag { .. }
                | ThermalDrift { .. }
        )
    }

    fn none(frame: &Frame, axis: &Axis) -> Self {
        let none = vec![0.0; frame.x.len()];
        let (level, dry, even) = (none.clone(), none.clone(), none.clone());
        Self {
            axis: axis.clone(),
            link: None,
            shaking: Vec::new(),
            sliding: Trace::default(),
            level,
            dry,
            even,
            load: none,
            viscous: 0.0,
            bristle: None,
            held: OnceLock::new(),
        }
    }

    fn along(frame: &Frame, axis: &Axis, physics: &Physics) -> Self {
        let (v, scale) = (&frame.v, frame.unit);
        let [backward, forward] = [-1.0, 1.0].map(|way| physics.slope_at(way));
        let rows = 0..v.len();
        let of_motor = level(frame, physics, v);
        let bristle = physics.bristle_stiffness().map(|stiffness| (physics.bristle(1.0), stiffness));
        Self {
            axis: axis.clone(),
            link: None,
            shaking: Vec::new(),
            sliding: Trace::default(),
            dry: match bristle {
                Some((at_rest, _)) => built_up(frame, at_rest, &of_motor, |_, _| 0.0),
                None => at_once(frame, &of_motor).collect(),
            },
            level: if frame.table_v.is_empty() { of_motor } else { level(frame, physics, &frame.table_v) },
            held: OnceLock::new(),
            even: v.iter().map(|v| 0.5 * (forward - backward) * (v * scale).abs()).collect(),
            load: rows.map(|i| physics.load(frame.x[i], v[i], frame.seconds(i))).collect(),
            viscous: 0.5 * (forward + backward),
            bristle,
        }
    }

    /// What a bristle of a table with all of the friction holds at each row as long as the table moves with its motor.
    pub(super) fn held(&self, frame: &Frame) -> &[f64] {
        self.held.get_or_init(|| {
            let Some((at_rest, _)) = self.bristle else { return Vec::new() };
            let mut held = built_up_along(frame, &frame.columns.position, at_rest, &self.level, |_, _| 0.0);
            frame.columns.stretches.iter().for_each(|rows| held[rows.start] = 0.0);
            held
        })
    }

    /// Whether the load may lean a table on another flank than that of another does: flanks that friction parts at each turn a larger load
    /// keeps together.
    #[must_use]
    pub fn leans_otherwise(&self, other: &Self) -> bool {
        apart(&self.load, &other.load) > LEANS * LEANS * dot(&self.level, &self.level)
    }

    /// Whether its load alone may lean a table on one flank: how long flanks are apart then goes with the shares of the table as well.
    #[must_use]
    pub fn leans(&self) -> bool {
        dot(&self.load, &self.load) > LEANS * LEANS * dot(&self.level, &self.level)
    }

    /// Whether a table moves under this as under another.
    #[must_use]
    pub fn is_like(&self, other: &Self) -> bool {
        let all = dot(&self.dry, &self.dry) + dot(&self.load, &self.load);
        (self.viscous - other.viscous).abs() <= ALIKE * self.viscous.abs()
            && self.bristle.is_some() == other.bristle.is_some()
            && self.shaking.len() == other.shaking.len()
            && self.shaking.iter().zip(&other.shaking).map(|(own, other)| apart(&own.held, &other.held)).sum::<f64>()
                + apart(&self.dry, &other.dry)
                + apart(&self.load, &other.load)
                <= ALIKE * ALIKE * all
    }
}

/// Adds so much of some values to others, which may not be there yet.
fn grown(sum: &mut Vec<f64>, values: &[f64], factor: f64) {
    sum.resize(values.len(), 0.0);
    add(sum, factor, values);
}

/// What resists each of several tables.
pub(super) trait Resisted<const N: usize>: Copy {
    /// How many of them differ in it.
    const DISTINCT: usize;

    /// A number of each.
    fn each(self, of: impl Fn(&Resistance) -> f64) -> Lanes<N>;

    /// That of one.
    fn lane(&self, at: usize) -> &Resistance;

    /// How the friction of each builds up, where all does.
    fn bristles(self) -> Option<[(Friction, f64); N]>;
}

/// The same resists all of them.
#[derive(Clone, Copy)]
pub(super) struct Alike<'r>(pub &'r Resistance);

impl<const N: usize> Resisted<N> for Alike<'_> {
    const DISTINCT: usize = 1;

    #[inline(always)]
    fn each(self, of: impl Fn(&Resistance) -> f64) -> Lanes<N> {
        Lanes::splat(of(self.0))
    }

    fn lane(&self, _: usize) -> &Resistance {
        self.0
    }

    fn bristles(self) -> Option<[(Friction, f64); N]> {
        self.0.bristle.map(|bristle| [bristle; N])
    }
}

/// Each is resisted by what is its own.
#[derive(Clone, Copy)]
pub(super) struct Each<'r, const N: usize>(pub [&'r Resistance; N]);

impl<const N: usize> Resisted<N> for Each<'_, N> {
    const DISTINCT: usize = N;

    #[inline(always)]
    fn each(self, of: impl Fn(&Resistance) -> f64) -> Lanes<N> {
        Lanes::each(|l| of(self.0[l]))
    }

    fn lane(&self, at: usize) -> &Resistance {
        self.0[at]
    }

    fn bristles(self) -> Option<[(Friction, f64); N]> {
        let first = self.0[0].bristle?;
        let mut all = [first; N];
        for (own, resistance) in all.iter_mut().zip(self.0) {
            *own = resistance.bristle?;
        }
        Some(all)
    }
}

/// Largest dry friction at each row, at speeds in load units/s.
pub fn level(frame: &Frame, physics: &Physics, v: &[f64]) -> Vec<f64> {
    physics.friction_levels(
        &frame.x,
        v,
        |row| frame.seconds(row),
        |squares, n| {
            if n != 1.0 {
                to_the_power(squares, n);
            }
            widest(
                #[inline(always)]
                || squares.iter_mut().for_each(|square| *square = decay(*square)),
            );
        },
    )
}

/// Dry friction of the measured motion at each row, with its level there.
pub fn at_once<'f>(frame: &'f Frame, level: &'f [f64]) -> impl Iterator<Item = f64> + 'f {
    level.iter().zip(&frame.direction).map(|(level, direction)| level * direction)
}

/// The same as far as it has built up on the motor's way, and what `more` says that a bristle adds at a row.
pub fn built_up(
    frame: &Frame,
    at_rest: Friction,
    level: &[f64],
    more: impl Fn(&mut Friction, usize) -> f64,
) -> Vec<f64> {
    built_up_along(frame, &frame.way, at_rest, level, more)
}

/// The same on another way, load units.
fn built_up_along(
    frame: &Frame,
    x: &[f64],
    at_rest: Friction,
    level: &[f64],
    more: impl Fn(&mut Friction, usize) -> f64,
) -> Vec<f64> {
    let mut dry: Vec<f64> = at_once(frame, level).collect();
    if at_rest.is_plain_bristle() {
        // What a step leaves of the way to the level waits for no other step.
        let stiffness = at_rest.bristle.stiffness * frame.unit;
        let mut left = vec![1.0; x.len()];
        widest(
            #[inline(always)]
            || {
                for ((left, pair), level) in left.iter_mut().skip(1).zip(x.windows(2)).zip(level.iter().skip(1)) {
                    let by = stiffness * (pair[1] - pair[0]).abs();
                    *left = if *level > 0.0 { decay(by / level) } else { 0.0 };
                }
            },
        );
        for stretch in &frame.columns.stretches {
            let mut friction = at_rest;
            for i in stretch.clone().skip(1) {
                let end = level[i].copysign(x[i] - x[i - 1]);
                let side = 1.0f64.copysign(end);
                // A level that has fallen below the torque holds no more than itself.
                let to_go = ((end - friction.bristle.force) * side).max(0.0);
                friction.bristle.force = end - side * to_go * left[i];
                dry[i] = friction.bristle.force + more(&mut friction, i);
            }
        }
        return dry;
    }
    for stretch in &frame.columns.stretches {
        let mut friction = at_rest;
        for i in stretch.clone().skip(1) {
            dry[i] = friction.moved((x[i] - x[i - 1]) * frame.unit, level[i]) + more(&mut friction, i);
        }
    }
    dry
}
