//! Dry friction without chatter: set-valued Coulomb friction, and the bristle of Dahl and LuGre.
//!
//! Coulomb friction is not a function of speed: at rest it is whatever holds the axis, up to its level L. One implicit
//! step of m·v′ = b − h·F, F ∈ L·Sign(v′), has one solution: v′ = soft(b, h·L)/m. It sticks exactly, at any step
//! (Moreau, *Unilateral contact and dry friction*, 1988). With a bristle of stiffness σ, dF/dq = σ·(1 − sign(q̇)·F/L)
//! (Dahl 1968; with a level that depends on speed: LuGre without micro-damping, Canudas de Wit et al. 1995), stepped
//! implicitly as well.

/// Dry friction of one body.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Friction {
    /// σ: torque per displacement of the bristle; zero for pure Coulomb friction.
    pub stiffness: f64,
    /// Torque of the bristle now.
    pub force: f64,
}

impl Friction {
    /// Speed after a step of `h` seconds, from the speed `v` before it.
    ///
    /// `mass`·v′ = `impulse` − h·F with |F| up to `level`; mass and impulse hold all else that acts.
    #[inline(always)]
    pub fn step(&mut self, mass: f64, impulse: f64, h: f64, v: f64, level: f64) -> f64 {
        if self.stiffness == 0.0 {
            let left = (impulse.abs() - h * level).max(0.0);
            // A mass is the same in most steps, and a product is ready before a quotient.
            return left.copysign(impulse) * (1.0 / mass);
        }
        if level <= 0.0 {
            self.force = 0.0;
            return impulse / mass;
        }
        // F′ = (F + σ·h·v′)·L/d, with the bristle slipping at the speed before the step.
        let d = level + self.stiffness * h * v.abs();
        let next = (impulse * d - h * self.force * level) / (mass * d + self.stiffness * h * h * level);
        self.force = (self.force + self.stiffness * h * next) * level / d;
        next
    }

    /// Torque after the bristle was moved by `dq`, at a given level, exactly.
    pub fn moved(&mut self, dq: f64, level: f64) -> f64 {
        if level <= 0.0 {
            self.force = 0.0;
        } else {
            let end = level.copysign(dq);
            self.force = end + (self.force - end) * (-self.stiffness * dq.abs() / level).exp();
        }
        self.force
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A mass that slides to a stop: v₀²·m/(2L), whatever the step, and then rests exactly.
    #[test]
    fn coulomb_friction_stops_a_mass_where_energy_says() {
        for h in [1e-4, 1e-5] {
            let (mut friction, mut x, mut v) = (Friction::default(), 0.0, 2.0_f64);
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
        let mut friction = Friction::default();
        let h = 1e-4;
        assert_eq!(friction.step(1.0, h * 4.99, h, 0.0, 5.0), 0.0);
        assert!((friction.step(1.0, h * 5.5, h, 0.0, 5.0) - h * 0.5).abs() < 1e-15);
    }

    /// Dahl's curve from rest is L·(1 − exp(−σ·q/L)); the dynamic step follows the exact displacement law.
    #[test]
    fn the_bristle_follows_dahl() {
        let (h, level, stiffness) = (1e-6, 5.0, 400.0);
        let mut dynamic = Friction { stiffness, force: 0.0 };
        let mut exact = Friction { stiffness, force: 0.0 };
        // A heavy mass at nearly constant speed drags the bristle.
        let (mass, mut v, mut q) = (1e9, 0.05, 0.0);
        for step in 0..400_000 {
            let next = dynamic.step(mass, mass * v, h, v, level);
            q += h * next;
            v = next;
            if step % 1000 == 999 {
                let law = level * (1.0 - (-stiffness * q / level).exp());
                assert!((dynamic.force - law).abs() < 2e-3 * level, "{} {law}", dynamic.force);
            }
        }
        exact.moved(q, level);
        assert!((dynamic.force - exact.force).abs() < 2e-3 * level);
    }

    /// A body on a bristle never gains energy: dry friction only takes.
    #[test]
    fn friction_only_takes_energy() {
        for stiffness in [0.0, 400.0] {
            let mut friction = Friction { stiffness, force: 0.0 };
            let (h, mass, mut v) = (1e-5, 0.5, 1.0);
            let mut most = 0.5 * mass * v * v;
            for _ in 0..200_000 {
                v = friction.step(mass, mass * v, h, v, 5.0);
                let bristle = if stiffness > 0.0 { friction.force * friction.force / (2.0 * stiffness) } else { 0.0 };
                let energy = 0.5 * mass * v * v + bristle;
                assert!(energy <= most * (1.0 + 1e-9), "{energy} {most}");
                most = energy;
            }
        }
    }
}
