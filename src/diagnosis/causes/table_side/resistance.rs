//! What resists a table's motion, row by row: friction and load as a set of causes has them. A spring winds up, and a clearance is
//! crossed, by all the friction that there is, not by that of the belief alone: behind a drive whose friction rises by a third the
//! table lags by a third more.

use crate::diagnosis::belief;
use crate::diagnosis::frame::Frame;
use crate::machine::{Axis, Effect};
use crate::plant::friction::Friction;
use crate::plant::physics::Physics;

/// Change of dry friction and load, as a share of both (root mean square), that leaves a simulated table where it is.
const ALIKE: f64 = 3e-4;

/// Friction and load of an axis along a recording, drive's own unit; the table has its share of the friction and all of the load.
#[derive(Debug, Clone, PartialEq)]
pub struct Resistance {
    /// The axis that has it.
    axis: Axis,
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
}

impl Resistance {
    /// That of an axis, whatever it has between motor and table.
    #[must_use]
    pub fn of(frame: &Frame, axis: &Axis) -> Self {
        let resisting = axis.with_effects(axis.effects.iter().filter(|e| Self::has(e)).copied().collect());
        // What lies between motor and table is all that an axis may contradict itself in.
        match Physics::of(&resisting) {
            Ok(physics) => Self::along(frame, axis, &physics),
            Err(_) => Self::none(frame, axis),
        }
    }

    /// That of the same axis with what was found beside what it is believed to have.
    #[must_use]
    pub fn with(&self, frame: &Frame, found: Vec<Effect>) -> Self {
        Self::of(frame, &belief::with_found(&self.axis, frame.axis, found))
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
        Self { axis: axis.clone(), level, dry, even, load: none, viscous: 0.0, bristle: None }
    }

    fn along(frame: &Frame, axis: &Axis, physics: &Physics) -> Self {
        let (v, scale) = (&frame.v, frame.unit);
        let [backward, forward] = [-1.0, 1.0].map(|way| physics.slope_at(way));
        let rows = 0..v.len();
        let of_motor = level(frame, physics, v);
        let bristle = physics.bristle_stiffness().map(|stiffness| (physics.bristle(1.0), stiffness));
        Self {
            axis: axis.clone(),
            dry: match bristle {
                Some((at_rest, _)) => built_up(frame, at_rest, &of_motor, |_, _| 0.0),
                None => at_once(frame, &of_motor).collect(),
            },
            level: if frame.table_v.is_empty() { of_motor } else { level(frame, physics, &frame.table_v) },
            even: v.iter().map(|v| 0.5 * (forward - backward) * (v * scale).abs()).collect(),
            load: rows.map(|i| physics.load(frame.x[i], v[i], frame.seconds(i))).collect(),
            viscous: 0.5 * (forward + backward),
            bristle,
        }
    }

    /// Whether a table moves under this as under another.
    #[must_use]
    pub fn is_like(&self, other: &Self) -> bool {
        let apart = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
        let size = |a: &[f64]| a.iter().map(|a| a * a).sum::<f64>();
        let all = size(&self.dry) + size(&self.load);
        apart(&self.dry, &other.dry) + apart(&self.load, &other.load) <= ALIKE * ALIKE * all
            && (self.viscous - other.viscous).abs() <= ALIKE * self.viscous.abs()
            && self.bristle.is_some() == other.bristle.is_some()
    }
}

/// Largest dry friction at each row, at speeds in load units/s.
pub fn level(frame: &Frame, physics: &Physics, v: &[f64]) -> Vec<f64> {
    (0..v.len()).map(|i| physics.friction_level(frame.x[i], v[i], frame.seconds(i))).collect()
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
    let x = &frame.columns.position;
    let mut dry: Vec<f64> = at_once(frame, level).collect();
    for stretch in &frame.columns.stretches {
        let mut friction = at_rest;
        for i in stretch.clone().skip(1) {
            dry[i] = friction.moved((x[i] - x[i - 1]) * frame.unit, level[i]) + more(&mut friction, i);
        }
    }
    dry
}
