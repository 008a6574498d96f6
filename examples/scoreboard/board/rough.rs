//! What a rig may have that neither belief nor vocabulary speaks of, and that is no fault: an encoder with noise on its grid,
//! dry friction in another formulation, pulses that somebody adds to the servo's output.
//!
//! Dry friction regularised, F·tanh(w/w₀), or of very stiff bristles (LuGre with a displacement below the encoder's
//! grid), slides like the set-valued one as soon as the encoder sees a motion. Pulses are in the logged torque as well.

use super::random::Random;
use super::rig::Rig;
use super::truth::Truth;

/// How dry friction is when nothing is hidden.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Friction {
    SetValued,
    /// w₀ in units of q a second.
    Regularised(f64),
    /// Displacement in units of q, damping ratio.
    Bristles(f64, f64),
}

/// Torque that is added to the servo's output for a while.
#[derive(Clone, Copy, Debug)]
pub struct Pulse {
    /// s
    begin: f64,
    end: f64,
    torque: f64,
}

#[derive(Clone, Debug)]
pub struct Rough {
    /// Standard deviation before the grid, load units.
    pub encoder_noise: f64,
    pub friction: Friction,
    pub pulses: Vec<Pulse>,
}

impl Rough {
    /// A rig without anything of the kind.
    pub const NONE: Self = Self { encoder_noise: 0.0, friction: Friction::SetValued, pulses: Vec::new() };

    pub fn draw(rig: &Rig, random: &mut Random) -> Self {
        // As the grid, noise must not make the servo louder than the torque's own.
        let loudest = rig.torque_noise / rig.servo.velocity_gain * rig.unit * rig.servo.period / 2f64.sqrt();
        let encoder_noise = if random.chance(0.5) { loudest * random.log_uniform(0.05, 0.5) } else { 0.0 };
        let friction = match random.next() % 3 {
            0 => Friction::SetValued,
            1 => Friction::Regularised(rig.reach.speed / rig.unit * random.log_uniform(1e-4, 1e-3)),
            _ => {
                // Bristles that a step of integration still follows.
                let least = 4e-9 * rig.coulomb / rig.inertia;
                let displacement = rig.encoder_step / rig.unit * random.log_uniform(0.2, 1.0);
                Friction::Bristles(displacement.max(least), random.uniform(0.0, 0.4))
            }
        };
        let mut pulses = Vec::new();
        if random.chance(0.5) {
            let mut time = random.uniform(0.0, 1.0);
            while time < rig.duration {
                let end = time + random.log_uniform(0.005, 0.1);
                let torque = rig.coulomb * random.sign() * random.uniform(0.1, 0.6);
                pulses.push(Pulse { begin: time, end, torque });
                time = end + random.log_uniform(0.1, 2.0);
            }
        }
        Self { encoder_noise, friction, pulses }
    }

    /// Torque of the pulses at a time, s.
    pub fn pulse(&self, t: f64) -> f64 {
        self.pulses.iter().filter(|p| (p.begin..p.end).contains(&t)).map(|p| p.torque).sum()
    }

    /// Puts the friction's formulation into a true machine.
    pub fn apply(&self, truth: &mut Truth) {
        match self.friction {
            Friction::SetValued => {}
            Friction::Regularised(speed) => truth.regularised = speed,
            Friction::Bristles(displacement, damping) => {
                (truth.presliding, truth.bristle_damping) = (displacement, damping);
            }
        }
    }
}
