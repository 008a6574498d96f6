//! The body of one axis: motor, table and what is between them, one plant step at a time.
//!
//! Positions drift half a step at the old speed, forces act at the middle, positions drift the other half at the new speed
//! (position Verlet: second order, keeps the energy of a spring); dry friction is solved implicitly within the kick and
//! viscous friction as the mean of old and new speed. The motor's torque follows the servo's exactly:
//! T(t + h) = u + (T − u)·e^(−h/τ), and a step feels its mean. Steps are as short as flanks need that swing; while they are
//! calm, they are as long as all else needs.

use super::coupling::{CALM, Leaning, transmitted};
use super::friction::{Bristle, Elements, Friction};
use super::nearby::Nearby;
use super::physics::Physics;
use crate::machine::TwoMasses;

/// An axis's body, in the motor's coordinate.
#[derive(Debug, Clone)]
pub struct Body {
    laws: Laws,
    time_constant_s: f64,
    pace: Pace,
    /// Longest step while flanks are calm, s; `None` where they are never told to be.
    calm_step_s: Option<f64>,
    /// Whether they were in the last steps.
    calm: bool,
    plain: bool,
    /// Of motor and table.
    held: [Held; 2],
    state: State,
}

/// What makes a body move, and stays the same.
#[derive(Debug, Clone)]
struct Laws {
    physics: Physics,
    load_per_motor: f64,
    viscous: f64,
}

/// A plant step.
#[derive(Debug, Clone, Copy)]
struct Pace {
    step_s: f64,
    /// Rest and mean over a step of a first-order lag.
    lag: (f64, f64),
}

impl Pace {
    fn new(step_s: f64, time_constant_s: f64) -> Self {
        let ratio = step_s / time_constant_s;
        let lag = if time_constant_s > 0.0 { ((-ratio).exp(), -(-ratio).exp_m1() / ratio) } else { (0.0, 0.0) };
        Self { step_s, lag }
    }
}

/// What no register can hold of a mass.
#[derive(Debug, Clone)]
struct Held {
    /// The torques near where it is.
    near: Nearby,
    /// What slips in place of its bristle.
    elements: Option<Elements>,
}

/// What changes from step to step; copied out of the body while it runs, so that it can stay in registers.
#[derive(Debug, Clone, Copy)]
struct State {
    /// Time since the start, s.
    time_s: f64,
    /// What the motor's current says.
    torque: f64,
    motor: Mass,
    /// Follows nothing on a rigid axis.
    table: Mass,
}

/// What the link carried in a step, as [`Leaning::add`] takes it.
struct Carried {
    torque: f64,
    rate: f64,
    speeds: [f64; 2],
}

/// One mass and its share of friction.
#[derive(Debug, Clone, Copy)]
struct Mass {
    inertia: f64,
    share: f64,
    position: f64,
    velocity: f64,
    bristle: Bristle,
}

impl Mass {
    /// Kick by `torque` at the middle of a step, implicit in friction, then the second half of the drift.
    #[inline(always)]
    fn kick(&mut self, elements: &mut Option<Elements>, h: f64, middle: f64, torque: f64, viscous: f64, level: f64) {
        let half = 0.5 * h * self.share * viscous;
        let impulse = (self.inertia - half) * self.velocity + h * torque;
        let (mass, level) = (self.inertia + half, self.share * level);
        self.velocity = self.bristle.step(elements.as_mut(), mass, impulse, h, self.velocity, level);
        self.position = middle + 0.5 * h * self.velocity;
    }

    /// Position after the first half of the drift.
    #[inline(always)]
    fn middle(&self, h: f64) -> f64 {
        self.position + 0.5 * h * self.velocity
    }
}

impl Body {
    /// A body at a position and speed (motor's coordinate), its motor's current at `torque`. Its steps are of `step_s`, and no longer
    /// than `longest_s` where nothing swings.
    #[must_use]
    pub fn new(
        physics: Physics,
        [step_s, longest_s]: [f64; 2],
        time_constant_s: f64,
        [position, velocity]: [f64; 2],
        torque: f64,
    ) -> Body {
        let mass = |inertia: f64, share: f64| {
            let Friction { bristle, .. } = physics.bristle(share);
            Mass { inertia, share, position, velocity, bristle }
        };
        let (motor, table) = match &physics.two_masses {
            None => (mass(physics.inertia, 1.0), mass(physics.inertia, 0.0)),
            Some(masses) => {
                let share = masses.table_friction_share;
                let mut table = mass(masses.table_inertia, share);
                // A table in motion is already pushed by its motor.
                if velocity != 0.0 {
                    table.position -= (0.5 * masses.clearance).copysign(velocity);
                }
                (mass(masses.motor_inertia, 1.0 - share), table)
            }
        };
        let flanks = physics.two_masses.filter(|masses| masses.clearance > 0.0);
        let bodies = [&motor, &table].map(|mass| (mass.inertia, mass.share));
        let calm_step_s = flanks.map(|masses| longest_s.min(physics.longest_calm_step_s(&masses, &bodies)));
        let plain = physics.is_plain();
        let load_per_motor = 1.0 / physics.motor_per_load;
        let viscous = physics.slope_at(1.0);
        let held = [(); 2].map(|()| Held { near: Nearby::new(&physics), elements: physics.bristle(1.0).elements });
        let state = State { time_s: 0.0, torque, motor, table };
        let pace = Pace::new(step_s, time_constant_s);
        let calm_step_s = calm_step_s.filter(|calm| *calm > step_s);
        let laws = Laws { physics, load_per_motor, viscous };
        Body { laws, time_constant_s, pace, calm_step_s, calm: false, plain, held, state }
    }

    /// Advances by `steps` plant steps while the servo asks for `asked`.
    pub fn advance(&mut self, asked: f64, steps: usize) {
        let Some(calm_step_s) = self.calm_step_s else { return self.step::<false>(asked, steps, self.pace) };
        let span = steps as f64 * self.pace.step_s;
        let few = (span / calm_step_s).ceil() as usize;
        if self.calm && few < steps {
            let (before, elements) = (self.state, [0, 1].map(|of| self.held[of].elements));
            self.step::<true>(asked, few, Pace::new(span / few as f64, self.time_constant_s));
            if self.calm {
                return;
            }
            self.state = before;
            self.held.iter_mut().zip(elements).for_each(|(held, before)| held.elements = before);
        }
        self.step::<true>(asked, steps, self.pace);
    }

    /// Steps at a pace; `FLANKS` says whether it is to be known if they are calm.
    fn step<const FLANKS: bool>(&mut self, asked: f64, steps: usize, pace: Pace) {
        let mut state = self.state;
        let (laws, own) = (&self.laws, &mut self.held);
        let mut leaning = Leaning::default();
        match (&laws.physics.two_masses, self.plain) {
            (None, true) => (0..steps).for_each(|_| laws.rigid_step::<true>(pace, own, &mut state, asked)),
            (None, false) => (0..steps).for_each(|_| laws.rigid_step::<false>(pace, own, &mut state, asked)),
            (Some(m), true) => (0..steps).for_each(|_| {
                let carried = laws.two_mass_step::<true>(m, pace, own, &mut state, asked);
                if FLANKS {
                    leaning.add(carried.torque, carried.rate, carried.speeds);
                }
            }),
            (Some(m), false) => (0..steps).for_each(|_| {
                let carried = laws.two_mass_step::<false>(m, pace, own, &mut state, asked);
                if FLANKS {
                    leaning.add(carried.torque, carried.rate, carried.speeds);
                }
            }),
        }
        self.state = state;
        if let Some(masses) = self.laws.physics.two_masses.filter(|_| FLANKS && steps > 0) {
            let both = masses.motor_inertia + masses.table_inertia;
            self.calm = leaning.is_calm(CALM, &masses, masses.motor_inertia * masses.table_inertia / both);
        }
    }

    /// Motor position, motor's coordinate.
    #[must_use]
    pub fn motor_position(&self) -> f64 {
        self.state.motor.position
    }

    /// Table position before any error of the screw, in the motor's coordinate.
    #[must_use]
    pub fn table_position(&self) -> f64 {
        if self.laws.physics.two_masses.is_some() { self.state.table.position } else { self.state.motor.position }
    }

    /// Motor speed, motor's coordinate per second.
    #[must_use]
    pub fn motor_velocity(&self) -> f64 {
        self.state.motor.velocity
    }

    /// What the motor's current says, drive's own unit.
    #[must_use]
    pub fn torque(&self) -> f64 {
        self.state.torque
    }
}

impl Laws {
    /// Mean torque of the motor over a step.
    #[inline(always)]
    fn motor_torque(pace: Pace, state: &mut State, asked: f64) -> f64 {
        let excess = state.torque - asked;
        state.torque = asked + excess * pace.lag.0;
        asked + excess * pace.lag.1
    }

    #[inline(always)]
    fn rigid_step<const PLAIN: bool>(&self, pace: Pace, [own, _]: &mut [Held; 2], state: &mut State, asked: f64) {
        let (h, p) = (pace.step_s, &self.physics);
        let torque = Self::motor_torque(pace, state, asked);
        let m = &mut state.motor;
        let middle = m.middle(h);
        if PLAIN {
            m.kick(&mut own.elements, h, middle, torque - p.constant_torque(), self.viscous, p.coulomb());
        } else {
            let (x, v, t) = (middle * self.load_per_motor, m.velocity * self.load_per_motor, state.time_s);
            let torque = p.delivered(torque) - own.near.load(p, x, v, t) - own.near.cogging_torque(x);
            let level = own.near.friction_level(p, x, v, t);
            m.kick(&mut own.elements, h, middle, torque, p.slope_at(m.velocity), level);
        }
        state.time_s += h;
    }

    #[inline(always)]
    fn two_mass_step<const PLAIN: bool>(
        &self,
        masses: &TwoMasses,
        pace: Pace,
        [at_motor, at_table]: &mut [Held; 2],
        state: &mut State,
        asked: f64,
    ) -> Carried {
        let (h, p) = (pace.step_s, &self.physics);
        let torque = Self::motor_torque(pace, state, asked);
        let (motor, table) = (&mut state.motor, &mut state.table);
        let (motor_middle, table_middle) = (motor.middle(h), table.middle(h));
        let (rate, speed) = (motor.velocity - table.velocity, table.velocity);
        let push = transmitted(masses, motor_middle - table_middle, rate);
        if PLAIN {
            let level = p.coulomb();
            motor.kick(&mut at_motor.elements, h, motor_middle, torque - push, self.viscous, level);
            table.kick(&mut at_table.elements, h, table_middle, push - p.constant_torque(), self.viscous, level);
        } else {
            let t = state.time_s;
            let (x, v) = (motor_middle * self.load_per_motor, motor.velocity * self.load_per_motor);
            let torque = p.delivered(torque) - at_motor.near.cogging_torque(x);
            let level = at_motor.near.friction_level(p, x, v, t);
            motor.kick(&mut at_motor.elements, h, motor_middle, torque - push, p.slope_at(motor.velocity), level);
            let (x, v) = (table_middle * self.load_per_motor, table.velocity * self.load_per_motor);
            let (load, level) = (at_table.near.load(p, x, v, t), at_table.near.friction_level(p, x, v, t));
            table.kick(&mut at_table.elements, h, table_middle, push - load, p.slope_at(table.velocity), level);
        }
        state.time_s += h;
        Carried { torque: push, rate, speeds: [speed, table.velocity] }
    }
}
