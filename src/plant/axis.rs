//! The body of one axis: motor, table and what is between them, one plant step at a time.
//!
//! Positions drift half a step at the old speed, forces act at the middle, positions drift the other half at the new speed
//! (position Verlet: second order, keeps the energy of a spring); dry friction is solved implicitly within the kick and
//! viscous friction as the mean of old and new speed. The motor's torque follows the servo's exactly:
//! T(t + h) = u + (T − u)·e^(−h/τ), and a step feels its mean.

use super::coupling::transmitted;
use super::friction::Friction;
use super::physics::Physics;

/// State of an axis in the motor's coordinate.
#[derive(Debug, Clone)]
pub struct Body {
    physics: Physics,
    /// Plant step, s.
    step_s: f64,
    /// Time since the start, s.
    time_s: f64,
    load_per_motor: f64,
    /// Rest and mean over a step of a first-order lag.
    lag: (f64, f64),
    plain: bool,
    viscous: f64,
    /// What the motor's current says.
    torque: f64,
    motor: Mass,
    table: Option<Mass>,
}

/// One mass and its share of friction.
#[derive(Debug, Clone, Copy)]
struct Mass {
    inertia: f64,
    share: f64,
    position: f64,
    velocity: f64,
    friction: Friction,
}

impl Mass {
    /// Kick by `torque`, implicit in friction; returns the new speed.
    #[inline]
    fn kick(&mut self, h: f64, torque: f64, viscous: f64, level: f64) -> f64 {
        let half = 0.5 * h * self.share * viscous;
        let impulse = (self.inertia - half) * self.velocity + h * torque;
        self.friction.step(self.inertia + half, impulse, h, self.velocity, self.share * level)
    }
}

impl Body {
    /// A body at a position and speed (motor's coordinate), its motor's current at `torque`.
    #[must_use]
    pub fn new(physics: Physics, step_s: f64, time_constant_s: f64, position: f64, velocity: f64, torque: f64) -> Body {
        let stiffness = physics.bristle_stiffness().unwrap_or(0.0);
        let mass = |inertia: f64, share: f64| Mass {
            inertia,
            share,
            position,
            velocity,
            friction: Friction { stiffness: share * stiffness, force: 0.0 },
        };
        let (motor, table) = match &physics.two_masses {
            None => (mass(physics.inertia, 1.0), None),
            Some(masses) => {
                let share = masses.table_friction_share;
                let mut table = mass(masses.table_inertia, share);
                // A table in motion is already pushed by its motor.
                if velocity != 0.0 {
                    table.position -= (0.5 * masses.clearance).copysign(velocity);
                }
                (mass(masses.motor_inertia, 1.0 - share), Some(table))
            }
        };
        let lag = if time_constant_s > 0.0 {
            let ratio = step_s / time_constant_s;
            ((-ratio).exp(), -(-ratio).exp_m1() / ratio)
        } else {
            (0.0, 0.0)
        };
        let plain = physics.is_plain();
        let load_per_motor = 1.0 / physics.motor_per_load;
        let viscous = physics.slope_friction(1.0);
        Body { physics, step_s, time_s: 0.0, load_per_motor, lag, plain, viscous, torque, motor, table }
    }

    /// Advances by `steps` plant steps while the servo asks for `asked`.
    pub fn advance(&mut self, asked: f64, steps: usize) {
        match (self.plain, self.table.is_some()) {
            (true, false) => (0..steps).for_each(|_| self.rigid_step::<true>(asked)),
            (false, false) => (0..steps).for_each(|_| self.rigid_step::<false>(asked)),
            (true, true) => (0..steps).for_each(|_| self.two_mass_step::<true>(asked)),
            (false, true) => (0..steps).for_each(|_| self.two_mass_step::<false>(asked)),
        }
    }

    #[inline]
    fn motor_torque(&mut self, asked: f64) -> f64 {
        let excess = self.torque - asked;
        self.torque = asked + excess * self.lag.0;
        asked + excess * self.lag.1
    }

    #[inline]
    fn rigid_step<const PLAIN: bool>(&mut self, asked: f64) {
        let h = self.step_s;
        let mut torque = self.motor_torque(asked);
        let p = &self.physics;
        let m = &mut self.motor;
        let middle = m.position + 0.5 * h * m.velocity;
        let (level, viscous) = if PLAIN {
            torque -= p.constant_torque();
            (p.coulomb(), self.viscous)
        } else {
            let (x, v) = (middle * self.load_per_motor, m.velocity * self.load_per_motor);
            torque = p.delivered(torque) - p.load(x, v, self.time_s) - p.cogging_torque(x);
            (p.friction_level(x, v, self.time_s), p.slope_at(m.velocity))
        };
        let next = m.kick(h, torque, viscous, level);
        m.position = middle + 0.5 * h * next;
        m.velocity = next;
        self.time_s += h;
    }

    #[inline]
    fn two_mass_step<const PLAIN: bool>(&mut self, asked: f64) {
        let h = self.step_s;
        let mut torque = self.motor_torque(asked);
        let p = &self.physics;
        let (Some(table), Some(masses)) = (&mut self.table, &p.two_masses) else { return };
        let m = &mut self.motor;
        let motor_middle = m.position + 0.5 * h * m.velocity;
        let table_middle = table.position + 0.5 * h * table.velocity;
        let push = transmitted(masses, motor_middle - table_middle, m.velocity - table.velocity);
        let (motor_next, table_next) = if PLAIN {
            let level = p.coulomb();
            let load = p.constant_torque();
            (m.kick(h, torque - push, self.viscous, level), table.kick(h, push - load, self.viscous, level))
        } else {
            let t = self.time_s;
            let (x, v) = (motor_middle * self.load_per_motor, m.velocity * self.load_per_motor);
            torque = p.delivered(torque) - p.cogging_torque(x);
            let motor_next = m.kick(h, torque - push, p.slope_at(m.velocity), p.friction_level(x, v, t));
            let (x, v) = (table_middle * self.load_per_motor, table.velocity * self.load_per_motor);
            let load = p.load(x, v, t);
            let level = p.friction_level(x, v, t);
            (motor_next, table.kick(h, push - load, p.slope_at(table.velocity), level))
        };
        m.position = motor_middle + 0.5 * h * motor_next;
        m.velocity = motor_next;
        table.position = table_middle + 0.5 * h * table_next;
        table.velocity = table_next;
        self.time_s += h;
    }

    /// Motor position, motor's coordinate.
    #[must_use]
    pub fn motor_position(&self) -> f64 {
        self.motor.position
    }

    /// Table position before any error of the screw, in the motor's coordinate.
    #[must_use]
    pub fn table_position(&self) -> f64 {
        self.table.as_ref().unwrap_or(&self.motor).position
    }

    /// Motor speed, motor's coordinate per second.
    #[must_use]
    pub fn motor_velocity(&self) -> f64 {
        self.motor.velocity
    }

    /// What the motor's current says, drive's own unit.
    #[must_use]
    pub fn torque(&self) -> f64 {
        self.torque
    }
}
