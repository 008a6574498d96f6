//! Dry friction without chatter: set-valued Coulomb friction, and the bristle of Dahl and LuGre.
//!
//! Coulomb friction is not a function of speed: at rest it is whatever holds the axis, up to its level L. One implicit
//! step of m·v′ = b − h·F, F ∈ L·Sign(v′), has one solution: v′ = soft(b, h·L)/m. It sticks exactly, at any step
//! (Moreau, *Unilateral contact and dry friction*, 1988). With a bristle of stiffness σ, dF/dq = σ·(1 − sign(q̇)·F/L)
//! (Dahl 1968; with a level that depends on speed: LuGre, Canudas de Wit et al. 1995; its micro-damping adds τ·Ḟ), stepped
//! implicitly as well. Or with elements that slip one after the other (generalized Maxwell slip, Lampaert et al. 2003).

use super::power::{PER, Power};

/// Share of its level from which on friction that builds up slips as if it were dry: what is missing is nothing beside any noise.
pub const SLIPS: f64 = 0.99999;

/// By what law friction builds up over a displacement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BristleLaw {
    /// How the stiffness falls on the way to the level, see [`Curve`] and [`Elements`].
    pub exponent: f64,
    /// Whether it is that of [`Elements`], not of a bristle.
    pub of_elements: bool,
    /// Damping of the bristle over its stiffness, s.
    pub micro_damping_s: f64,
}

impl Default for BristleLaw {
    fn default() -> Self {
        Self { exponent: 1.0, of_elements: false, micro_damping_s: 0.0 }
    }
}

/// Dry friction of one body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Friction {
    /// But for its elements.
    pub bristle: Bristle,
    /// In place of the bristle.
    pub elements: Option<Elements>,
}

/// Dry friction of one body, but for elements, which no register can hold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bristle {
    /// σ: torque per displacement of the bristle; zero for pure Coulomb friction.
    pub stiffness: f64,
    /// How that falls on the way to the level.
    curve: Curve,
    /// Damping of the bristle over its stiffness, s.
    pub micro_damping_s: f64,
    /// Torque of the bristle now, without its damping.
    pub force: f64,
    /// Whether it is strained as far as it goes, and slips like dry friction without one.
    pub slips: bool,
}

impl Bristle {
    /// [`Friction::step`] with the elements that there may be in place of the bristle.
    #[inline(always)]
    pub fn step(
        &mut self,
        elements: Option<&mut Elements>,
        mass: f64,
        impulse: f64,
        h: f64,
        v: f64,
        level: f64,
    ) -> f64 {
        if self.stiffness == 0.0 {
            let left = (impulse.abs() - h * level).max(0.0);
            // A mass is the same in most steps, and a product is ready before a quotient.
            return left.copysign(impulse) * (1.0 / mass);
        }
        if self.slips {
            let left = impulse.abs() - h * level - self.micro_damping_s * (level - self.force.abs());
            self.force = level.copysign(impulse);
            return left.max(0.0).copysign(impulse) / mass;
        }
        if level <= 0.0 {
            self.force = 0.0;
            return impulse / mass;
        }
        let next;
        let Self { stiffness, micro_damping_s, force, .. } = *self;
        let strained = Strained { stiffness, micro_damping_s, force };
        if let Some(elements) = elements {
            (self.force, next) = elements.stepped(strained, mass, impulse, h, level);
            return next;
        }
        if self.curve.exponent != 1.0 {
            (self.curve, self.force, next) = self.curve.stepped(strained, mass, impulse, h, level);
            return next;
        }
        // F′ = (F + σ·h·v′)·L/d, with the bristle slipping at the speed that is expected; its damping adds τ·(F′ − F)/h.
        let (d, late) = (level + self.stiffness * h * v.abs(), h + self.micro_damping_s);
        // Does not wait for the next speed, as the quotient of both would.
        let left = level / d;
        let impulse = impulse + self.micro_damping_s * self.force;
        next = (impulse * d - late * self.force * level) / (mass * d + self.stiffness * h * late * level);
        self.force = (self.force + self.stiffness * h * next) * left;
        next
    }
}

impl Friction {
    /// A bristle at rest, or elements.
    #[must_use]
    pub fn new(stiffness: f64, law: BristleLaw) -> Self {
        let BristleLaw { exponent, of_elements, micro_damping_s } = law;
        let elements = of_elements.then(|| Elements::new(exponent));
        Self {
            bristle: Bristle { stiffness, curve: Curve::new(exponent), micro_damping_s, force: 0.0, slips: false },
            elements,
        }
    }

    /// A bristle at rest; with a stiffness of zero pure Coulomb friction.
    #[must_use]
    pub fn bristle(stiffness: f64) -> Self {
        Self::new(stiffness, BristleLaw::default())
    }

    /// Whether it is a bristle by Dahl's law.
    #[must_use]
    pub fn is_plain_bristle(&self) -> bool {
        self.elements.is_none() && self.bristle.curve.exponent == 1.0
    }

    /// Speed after a step of `h` seconds, of which `v` is about what is expected.
    ///
    /// `mass`·v′ = `impulse` − h·F with |F| up to `level`; mass and impulse hold all else that acts.
    #[inline(always)]
    pub fn step(&mut self, mass: f64, impulse: f64, h: f64, v: f64, level: f64) -> f64 {
        self.bristle.step(self.elements.as_mut(), mass, impulse, h, v, level)
    }

    /// dF/dq towards the side that `towards` says.
    fn slope(&mut self, towards: f64, level: f64) -> f64 {
        let bristle = &mut self.bristle;
        if let Some(elements) = &self.elements {
            return bristle.stiffness * elements.sticking(towards, level / bristle.stiffness);
        }
        let left = (0.5 - 0.5 * bristle.force * towards.signum() / level).min(1.0);
        if left < NOTHING { 0.0 } else { bristle.stiffness * 2.0 * left * bristle.curve.rate(left) }
    }

    /// Torque after the bristle was moved by `dq`, at a given level, exactly.
    pub fn moved(&mut self, dq: f64, level: f64) -> f64 {
        let bristle = &mut self.bristle;
        if level <= 0.0 {
            bristle.force = 0.0;
        } else if let Some(elements) = &mut self.elements {
            bristle.force = bristle.stiffness * elements.moved(dq, level / bristle.stiffness);
        } else {
            let end = level.copysign(dq);
            let left = bristle.curve.left_after(0.5 - 0.5 * bristle.force / end, bristle.stiffness * dq.abs() / level);
            bristle.force = end * (1.0 - 2.0 * left);
        }
        bristle.force
    }

    /// The torque that [`Friction::moved`] would give, with the bristle left where it is.
    #[must_use]
    #[inline]
    pub fn after(&self, dq: f64, level: f64) -> f64 {
        match self.elements {
            None => Self { elements: None, bristle: self.bristle }.moved(dq, level),
            Some(_) => { *self }.moved(dq, level),
        }
    }

    /// What its damping adds at speed `w`.
    #[must_use]
    pub fn damped(&mut self, w: f64, level: f64) -> f64 {
        let micro_damping_s = self.bristle.micro_damping_s;
        if micro_damping_s > 0.0 && level > 0.0 { micro_damping_s * w * self.slope(w, level) } else { 0.0 }
    }
}

/// How the stiffness of a bristle falls on the way to the level L: dF/dq = σ·(1 − F·sign(q̇)/L)ⁿ. Of the way between the levels it
/// has a share y left, and dy/dq = −y·r·σ/L with the rate r = 2ⁿ⁻¹·yⁿ⁻¹.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Curve {
    exponent: f64,
    /// 2ⁿ⁻¹.
    whole: f64,
    /// yⁿ⁻¹.
    power: Power,
}

/// A share of the way that is nothing but a rounding, as in most rows of a recording.
const NOTHING: f64 = 1e-14;
/// Up to here five terms of a series are as exact as numbers are.
const CLOSE: f64 = 4e-3;

impl Curve {
    /// The curve of an exponent; 1 is Dahl's.
    #[must_use]
    pub fn new(exponent: f64) -> Self {
        Self { exponent, whole: 2f64.powf(exponent - 1.0), power: Power::default() }
    }

    /// Share of the way that is left after a displacement in units of level over stiffness.
    #[inline]
    #[must_use]
    pub fn left_after(&mut self, left: f64, by: f64) -> f64 {
        if left < NOTHING {
            return 0.0;
        }
        if self.exponent == 1.0 {
            return left * (-by).exp();
        }
        let rate = self.rate(left);
        self.after(left, by * rate)
    }

    #[inline(always)]
    fn rate(&mut self, left: f64) -> f64 {
        self.whole * self.power.at(left, self.exponent - 1.0)
    }

    /// What is left of `left` after a displacement times the rate there.
    #[inline(always)]
    fn after(&self, left: f64, by: f64) -> f64 {
        let n = self.exponent;
        if by < CLOSE {
            // Of y′ = −yⁿ from 1 on.
            let term = |k: usize| by * PER[k] * (k as f64 * (n - 1.0) + 2.0 - n);
            return left * (1.0 - term(1) * (1.0 - term(2) * (1.0 - term(3) * (1.0 - term(4) * (1.0 - term(5))))));
        }
        let rest = 1.0 - (1.0 - n) * by;
        if rest > 0.0 { left * rest.powf(1.0 / (1.0 - n)) } else { 0.0 }
    }

    /// The bristle's torque and the speed of a mass after a step of [`Friction::step`]: the slope is that before the step, and the
    /// step is then taken exactly. By value, so that bristles can stay in registers.
    #[inline(never)]
    fn stepped(mut self, strained: Strained, mass: f64, impulse: f64, h: f64, level: f64) -> (Self, f64, f64) {
        let Strained { stiffness, micro_damping_s, force } = strained;
        let free = impulse - h * force;
        let end = level.copysign(free);
        // The level does not wait for the force, as a quotient of both would.
        let per_level = 1.0 / level;
        let left = (0.5 - 0.5 * force * per_level.copysign(free)).min(1.0);
        if left < NOTHING {
            return (self, end, free / mass);
        }
        let rate = self.rate(left);
        let next = free / (mass + h * (h + micro_damping_s) * stiffness * 2.0 * left * rate);
        let left = self.after(left, stiffness * (h * next).abs() * per_level * rate);
        (self, end * (1.0 - 2.0 * left), next)
    }
}

/// What a bristle or elements are beside how they yield.
#[derive(Clone, Copy)]
struct Strained {
    stiffness: f64,
    micro_damping_s: f64,
    force: f64,
}

/// Elements side by side, each a spring that slips beyond its own displacement (generalized Maxwell slip): how far each is
/// strained, where it breaks away, and its share of the stiffness. The stiffness of those that stick falls as the power n of the
/// share of the level that is left: n = ½ where they break away evenly spread, 0 where all do at once, 1 where they are ever fewer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Elements {
    strained: [f64; ELEMENTS],
    /// In units of the mean.
    break_away: [f64; ELEMENTS],
    share: [f64; ELEMENTS],
}

/// Elements: of an exponent n the force is within n/N² of the level of that of any number.
const ELEMENTS: usize = 16;

impl Elements {
    /// Elements at rest that break away so that the exponent comes about.
    #[must_use]
    pub fn new(exponent: f64) -> Self {
        // At n = 1 the powers below become a logarithm, which a thousandth off they are.
        let n = if (exponent - 1.0).abs() < 1e-3 { 0.999 } else { exponent.max(1e-3) };
        // With the share s of all stiffness left, the displacement is (1 − s^((1 − n)/n))/(1 − n). Each element breaks away at the mean
        // of its share: where all before it have, and none after it, the force is right. Between, it is off by as much anywhere if
        // s = (k/N)²ⁿ.
        let to_go = |k: usize| 1.0 - k as f64 / ELEMENTS as f64;
        let share: [f64; ELEMENTS] = std::array::from_fn(|k| to_go(k).powf(2.0 * n) - to_go(k + 1).powf(2.0 * n));
        let break_away =
            std::array::from_fn(|k| (1.0 - n * (to_go(k).powi(2) - to_go(k + 1).powi(2)) / share[k]) / (1.0 - n));
        Self { strained: [0.0; ELEMENTS], break_away, share }
    }

    /// Mean strain after a displacement, with that mean of the displacements at which they break away.
    #[inline(always)]
    pub fn moved(&mut self, by: f64, mean: f64) -> f64 {
        for (strained, at) in self.strained.iter_mut().zip(&self.break_away) {
            let (moved, end) = (*strained + by, at * mean);
            let below = if moved < end { moved } else { end };
            *strained = if below > -end { below } else { -end };
        }
        self.mean_of(self.strained)
    }

    /// Share of the stiffness that does not slip when moved towards that side.
    #[inline]
    fn sticking(&self, towards: f64, mean: f64) -> f64 {
        let side = towards.signum();
        let mut stick = [0.0; ELEMENTS];
        for (stick, (strained, at)) in stick.iter_mut().zip(self.strained.iter().zip(&self.break_away)) {
            *stick = if strained * side < at * mean { 1.0 } else { 0.0 };
        }
        self.mean_of(stick)
    }

    /// The mean by shares of the stiffness, by sums that need not wait for each other.
    #[inline(always)]
    fn mean_of(&self, mut of: [f64; ELEMENTS]) -> f64 {
        of.iter_mut().zip(&self.share).for_each(|(of, share)| *of *= share);
        let mut half = ELEMENTS / 2;
        while half > 0 {
            for k in 0..half {
                of[k] += of[k + half];
            }
            half /= 2;
        }
        of[0]
    }

    /// Their torque and the speed of a mass after a step of [`Friction::step`]: those that stick before the step are the slope.
    #[inline(never)]
    fn stepped(&mut self, strained: Strained, mass: f64, impulse: f64, h: f64, level: f64) -> (f64, f64) {
        let Strained { stiffness, micro_damping_s, force } = strained;
        let (free, mean) = (impulse - h * force, level / stiffness);
        let slope = stiffness * self.sticking(free, mean);
        let next = free / (mass + h * (h + micro_damping_s) * slope);
        (stiffness * self.moved(h * next, mean), next)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A mass that slides to a stop: v₀²·m/(2L), whatever the step, and then rests exactly.
    #[test]
    fn coulomb_friction_stops_a_mass_where_energy_says() {
        for h in [1e-4, 1e-5] {
            let (mut friction, mut x, mut v) = (Friction::bristle(0.0), 0.0, 2.0_f64);
            let mut steps = 0;
            while v != 0.0 && steps < 1_000_000 {
                let next = friction.step(3.0, 3.0 * v, h, v, 5.0);
                x += 0.5 * h * (v + next);
                v = next;
                steps += 1;
            }
            assert_eq!(v, 0.0);
            assert!((x - 3.0 * 4.0 / 10.0).abs() < 2.0 * h, "{x}");
        }
    }

    #[test]
    fn it_holds_below_the_level_and_slips_above() {
        let mut friction = Friction::bristle(0.0);
        let h = 1e-4;
        assert_eq!(friction.step(1.0, h * 4.99, h, 0.0, 5.0), 0.0);
        assert!((friction.step(1.0, h * 5.5, h, 0.0, 5.0) - h * 0.5).abs() < 1e-15);
    }

    /// Dahl's curve from rest is L·(1 − exp(−σ·q/L)); the dynamic step follows the exact displacement law.
    #[test]
    fn the_bristle_follows_dahl() {
        let (h, level, stiffness) = (1e-6, 5.0, 400.0);
        let mut dynamic = Friction::bristle(stiffness);
        let mut exact = dynamic;
        // A heavy mass at nearly constant speed drags the bristle.
        let (mass, mut v, mut q) = (1e9, 0.05, 0.0);
        for step in 0..400_000 {
            let next = dynamic.step(mass, mass * v, h, v, level);
            q += h * next;
            v = next;
            if step % 1000 == 999 {
                let law = level * (1.0 - (-stiffness * q / level).exp());
                assert!((dynamic.bristle.force - law).abs() < 2e-3 * level, "{} {law}", dynamic.bristle.force);
            }
        }
        exact.moved(q, level);
        assert!((dynamic.bristle.force - exact.bristle.force).abs() < 2e-3 * level);
    }

    /// Elements from a reversal on follow the curve of their exponent (Masing's rule), and a small way back and forth leaves them
    /// as they were.
    #[test]
    fn elements_follow_their_exponent_and_remember() {
        for exponent in [0.2, 0.5, 0.7, 0.9, 1.3] {
            let (level, stiffness) = (5.0, 400.0);
            let law = BristleLaw { exponent, of_elements: true, micro_damping_s: 0.0 };
            let mut friction = Friction::new(stiffness, law);
            friction.moved(-1.0, level);
            assert!((friction.bristle.force + level).abs() < 1e-12);
            let (mut q, power) = (0.0, 1.0 - exponent);
            let off = 1.01 * exponent / (ELEMENTS * ELEMENTS) as f64 * level;
            for _ in 0..100 {
                q += 0.0007;
                let force = friction.moved(0.0007, level);
                let left = (1.0 - power * 0.5 * stiffness * q / level).max(0.0).powf(1.0 / power);
                assert!((force - level * (1.0 - 2.0 * left)).abs() < off, "{exponent}: {force} {left}");
                friction.moved(-0.0003, level);
                assert!((friction.moved(0.0003, level) - force).abs() < 1e-9 * level);
            }
        }
    }

    /// The step of forces and the law over a displacement are one, of any exponent.
    #[test]
    fn a_heavy_mass_drags_bristles_and_elements_along_their_curves() {
        for (exponent, of_elements) in [(0.5, false), (1.5, false), (0.5, true)] {
            let (h, level, mass) = (1e-5, 5.0, 1e9);
            let mut dragged = Friction::new(400.0, BristleLaw { exponent, of_elements, micro_damping_s: 0.0 });
            let mut exact = dragged;
            let mut v = 0.5;
            for step in 0..80_000 {
                if step == 40_000 {
                    v = -v;
                }
                v = dragged.step(mass, mass * v, h, v, level);
                exact.moved(h * v, level);
                assert!((dragged.bristle.force - exact.bristle.force).abs() < 1e-6 * level, "{exponent}");
            }
            assert!((dragged.bristle.force / -level - 1.0).abs() < 0.02, "{}", dragged.bristle.force);
        }
    }

    /// A body on a bristle never gains energy: dry friction only takes.
    #[test]
    fn friction_only_takes_energy() {
        for stiffness in [0.0, 400.0] {
            let mut friction = Friction::bristle(stiffness);
            let (h, mass, mut v) = (1e-5, 0.5, 1.0);
            let mut most = 0.5 * mass * v * v;
            for _ in 0..200_000 {
                v = friction.step(mass, mass * v, h, v, 5.0);
                let bristle = if stiffness > 0.0 {
                    friction.bristle.force * friction.bristle.force / (2.0 * stiffness)
                } else {
                    0.0
                };
                let energy = 0.5 * mass * v * v + bristle;
                assert!(energy <= most * (1.0 + 1e-9), "{energy} {most}");
                most = energy;
            }
        }
    }
}
