//! Friction that builds up on the ways of several tables at once: a plain bristle is a few products in all lanes of a register, by the
//! law of [`Friction::moved`]; what builds up by another law goes table by table.

use super::{Lanes, Which};
use crate::plant::friction::{Friction, SLIPS};

/// How friction has built up on the way of each table.
#[derive(Clone, Copy)]
pub(super) enum Bristles<const N: usize> {
    /// Dahl's bristle of each: its torque and its stiffness.
    Plain {
        /// Torque.
        force: Lanes<N>,
        /// Stiffness.
        stiffness: Lanes<N>,
    },
    /// By any other law.
    Other([Friction; N]),
}

impl<const N: usize> Bristles<N> {
    /// At rest.
    pub(super) fn new(at_rest: [Friction; N]) -> Self {
        if at_rest.iter().all(Friction::is_plain_bristle) {
            Self::Plain { force: Lanes::splat(0.0), stiffness: Lanes::each(|l| at_rest[l].bristle.stiffness) }
        } else {
            Self::Other(at_rest)
        }
    }

    /// Torque after each was moved so far at its level.
    #[inline(always)]
    pub(super) fn moved(&mut self, way: Lanes<N>, level: Lanes<N>) -> Lanes<N> {
        match self {
            Self::Plain { force, stiffness } => {
                *force = built(*force, *stiffness, way, level);
                *force
            }
            Self::Other(frictions) => Lanes::each(|l| frictions[l].moved(way.of(l), level.of(l))),
        }
    }

    /// Torque of each as long as it goes on one way, where all have built up as far as they will: that of dry friction.
    #[inline(always)]
    pub(super) fn slipping(&self, speed: Lanes<N>, level: Lanes<N>) -> Option<Lanes<N>> {
        let force = match self {
            Self::Plain { force, .. } => *force,
            Self::Other(frictions) => Lanes::each(|l| frictions[l].bristle.force),
        };
        let slips = (force * speed.sign()).reach(level * SLIPS);
        slips.all().then(|| level.copysign(speed))
    }

    /// Torque after each was moved so far at its level, with the bristles left where they are.
    #[inline(always)]
    pub(super) fn after(&self, way: Lanes<N>, level: Lanes<N>) -> Lanes<N> {
        match self {
            Self::Plain { force, stiffness } => built(*force, *stiffness, way, level),
            Self::Other(frictions) => Lanes::each(|l| frictions[l].after(way.of(l), level.of(l))),
        }
    }

    /// Whether the torque of each is all that there is to know of how it has built up.
    pub(super) fn are_told_by_force(&self) -> bool {
        match self {
            Self::Plain { .. } => true,
            Self::Other(frictions) => frictions.iter().all(|friction| friction.elements.is_none()),
        }
    }

    /// Makes those of some tables, of which the torque tells all, hold so much.
    #[inline(always)]
    pub(super) fn hold(&mut self, these: Which<N>, held: Lanes<N>) {
        match self {
            Self::Plain { force, .. } => *force = these.choose(held, *force),
            Self::Other(frictions) => {
                (0..N).filter(|l| these.of(*l)).for_each(|l| frictions[l].bristle.force = held.of(l));
            }
        }
    }

    /// Others than plain ones, all moved alike, of which so many differ; the rest go as the first.
    #[inline(always)]
    pub(super) fn moved_together(&mut self, way: f64, level: Lanes<N>, distinct: usize) {
        let Self::Other(frictions) = self else { return };
        for l in 0..distinct {
            frictions[l].moved(way, level.of(l));
        }
        for l in distinct..N {
            frictions[l] = frictions[0];
        }
    }

    /// Makes those of some tables, which are no plain ones, what they are in others.
    #[inline(always)]
    pub(super) fn take(&mut self, these: Which<N>, from: &Self) {
        if let (Self::Other(frictions), Self::Other(others)) = (self, from) {
            (0..N).filter(|l| these.of(*l)).for_each(|l| frictions[l] = others[l]);
        }
    }
}

/// Torque of plain bristles: of the way from −L to L a share is left that falls as e^−σ·|q|/L.
#[inline(always)]
fn built<const N: usize>(force: Lanes<N>, stiffness: Lanes<N>, way: Lanes<N>, level: Lanes<N>) -> Lanes<N> {
    let (nothing, half, one) = (Lanes::splat(0.0), Lanes::splat(0.5), Lanes::splat(1.0));
    let per_level = level.above(nothing).keep(one / level);
    let side = way.sign();
    // A level that has fallen below the torque holds no more than itself.
    let left = (half - force * side * per_level * 0.5).larger(nothing);
    level * side * (one - left * (stiffness * way.abs() * per_level).decay() * 2.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::friction::BristleLaw;
    use crate::plant::noise::Noise;

    #[test]
    fn bristles_side_by_side_go_as_each_by_itself() {
        let of_elements = BristleLaw { exponent: 0.4, of_elements: true, micro_damping_s: 0.0 };
        let of_two = BristleLaw { exponent: 2.0, of_elements: false, micro_damping_s: 0.0 };
        for law in [BristleLaw::default(), of_two, of_elements] {
            let mut each: [Friction; 4] = lanes_of(|l| Friction::new(50.0 + 20.0 * l as f64, law));
            let mut together = Bristles::new(each);
            assert_eq!(matches!(together, Bristles::Plain { .. }), law == BristleLaw::default());
            let mut noise = Noise::new(5);
            for step in 0..2000 {
                let mut random = || noise.uniform() - 0.5;
                let way: Lanes<4> = Lanes::each(|_| 0.1 * random());
                // A level of nothing holds nothing.
                let level: Lanes<4> = Lanes::each(|_| if step % 97 == 0 { 0.0 } else { 1.0 + random() });
                let ahead = together.after(way, level).to_array();
                let moved = together.moved(way, level).to_array();
                assert_eq!(ahead, moved);
                for l in 0..4 {
                    let own = each[l].moved(way.of(l), level.of(l));
                    assert!((own - moved[l]).abs() < 1e-8, "{law:?}, step {step}: {own} is not {}", moved[l]);
                }
            }
        }
    }

    #[test]
    fn bristles_slip_where_all_have_built_up_and_go_on() {
        let of_elements = BristleLaw { exponent: 0.4, of_elements: true, micro_damping_s: 0.0 };
        for law in [BristleLaw::default(), BristleLaw { exponent: 1.4, ..BristleLaw::default() }, of_elements] {
            let each: [Friction; 4] = lanes_of(|l| Friction::new(50.0 + 20.0 * l as f64, law));
            let mut bristles = Bristles::new(each);
            let (level, forward, one_turns) = ([1.0, 2.0, 0.5, 1.0], [1.0; 4], [1.0, 1.0, -1.0, 1.0]);
            let of = Lanes::<4>::from;
            let slipping =
                |bristles: &Bristles<4>, speed, level| bristles.slipping(of(speed), of(level)).map(Lanes::to_array);
            assert_eq!(slipping(&bristles, forward, level), None, "{law:?}");
            for _ in 0..20_000 {
                bristles.moved(of([0.01; 4]), of(level));
            }
            assert_eq!(slipping(&bristles, forward, level), Some(level), "{law:?}");
            // What dry friction makes in place of the bristles, these would have made.
            let moved = bristles.after(of([0.01; 4]), of(level)).to_array();
            assert!(moved.iter().zip(level).all(|(moved, level)| (moved / level - 1.0).abs() < 2.0 * (1.0 - SLIPS)));
            assert_eq!(slipping(&bristles, one_turns, level), None, "{law:?}");
            // A level that has risen has yet to be reached.
            assert_eq!(slipping(&bristles, forward, [1.0, 2.0, 0.51, 1.0]), None, "{law:?}");
        }
    }

    fn lanes_of<const N: usize>(friction: impl Fn(usize) -> Friction) -> [Friction; N] {
        std::array::from_fn(friction)
    }
}
