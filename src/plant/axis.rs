//! The body of one axis: motor, table and what is between them, one plant step at a time.
//!
//! Positions drift half a step at the old speed, forces act at the middle, positions drift the other half at the new speed
//! (position Verlet: second order, keeps the energy of a spring); dry friction is solved implicitly within the kick and
//! viscous friction as the mean of old and new speed. The motor's torque follows the servo's exactly:
//! T(t + h) = u + (T − u)·e^(−h/τ), and a step feels its mean. Steps are as short as flanks need that swing and friction that turns
//! round; while neither happens, they may be longer.

use super::coupling::{CALM, Leaning, transmitted};
use super::friction::{Bristle, Elements, Friction, SLIPS};
use super::nearby::Nearby;
use super::pace::{Long, Pace};
use super::physics::Physics;
use crate::machine::TwoMasses;

/// Share of its speed by which a motion changes in a step that goes on.
const STEADY: f64 = 0.1;
/// Share of the way over which it builds up that a mass at rest goes in a step.
const RESTS: f64 = 3e-4;

/// An axis's body, in the motor's coordinate.
#[derive(Debug, Clone)]
pub struct Body {
    laws: Laws,
    time_constant_s: f64,
    pace: Pace,
    /// Longer steps, where there are any.
    long: Option<Long>,
    /// Whether flanks were calm in the last steps.
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

/// How friction acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Acts {
    /// It slips, or holds a mass where it is: where it turns round it jumps.
    Dry,
    /// Over a way.
    BuildsUp,
    /// It would build up, but hardly anything moves.
    Holds,
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
    /// Time since the start, and the last step, s.
    time_s: f64,
    step_s: f64,
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
    /// By how much the speed changed in the last step.
    change: f64,
    bristle: Bristle,
}

impl Mass {
    /// Kick by `torque` at the middle of a step, implicit in friction, then the second half of the drift.
    #[inline(always)]
    fn kick(&mut self, elements: &mut Option<Elements>, h: f64, middle: f64, torque: f64, viscous: f64, level: f64) {
        let half = 0.5 * h * self.share * viscous;
        let impulse = (self.inertia - half) * self.velocity + h * torque;
        let (mass, level) = (self.inertia + half, self.share * level);
        let expected = self.velocity + self.change;
        let velocity = self.bristle.step(elements.as_mut(), mass, impulse, h, expected, level);
        self.change = velocity - self.velocity;
        self.velocity = velocity;
        self.position = middle + 0.5 * h * velocity;
    }

    /// Goes a way that is so long per inertia, unless it rests.
    #[inline(always)]
    fn goes_further(&mut self, way: f64) {
        if self.velocity != 0.0 {
            self.position += way / self.inertia;
        }
    }

    /// Whether it stays at rest or slides on at about its speed.
    #[inline(always)]
    fn goes_on(&self) -> bool {
        self.change.abs() <= STEADY * self.velocity.abs().min((self.velocity - self.change).abs())
    }

    /// Speed at the middle of a step, if it changes as it did in the last one.
    #[inline(always)]
    fn middle_speed(&self) -> f64 {
        self.velocity + 0.5 * self.change
    }

    /// Position after the first half of the drift.
    #[inline(always)]
    fn middle(&self, h: f64) -> f64 {
        self.position + 0.5 * h * self.velocity
    }
}

impl Body {
    /// A body at a position and speed (motor's coordinate), its motor's current at `torque`. Its steps are of `step_s`; where
    /// flanks are calm they are no longer than `usual_s`, where nothing is sudden no longer than `longest_s`.
    #[must_use]
    pub fn new(
        physics: Physics,
        [step_s, usual_s, longest_s]: [f64; 3],
        time_constant_s: f64,
        [position, velocity]: [f64; 2],
        torque: f64,
    ) -> Body {
        let mass = |inertia: f64, share: f64| {
            let Friction { bristle, .. } = physics.bristle(share);
            Mass { inertia, share, position, velocity, change: 0.0, bristle }
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
        let pace = Pace::new(step_s, time_constant_s);
        let bodies = [&motor, &table].map(|mass| (mass.inertia, mass.share));
        let long = Long::new(&physics, [usual_s, longest_s], &bodies, pace);
        let plain = physics.is_plain();
        let load_per_motor = 1.0 / physics.motor_per_load;
        let viscous = physics.slope_at(1.0);
        let held = [(); 2].map(|()| Held { near: Nearby::new(&physics), elements: physics.bristle(1.0).elements });
        let state = State { time_s: 0.0, step_s, torque, motor, table };
        let laws = Laws { physics, load_per_motor, viscous };
        let calm = laws.flanks().is_none();
        Body { laws, time_constant_s, pace, long, calm, plain, held, state }
    }

    /// Advances by `steps` plant steps while the servo asks for `asked`.
    pub fn advance(&mut self, asked: f64, steps: usize) {
        if steps == 0 {
            return;
        }
        if self.long.is_none() {
            self.step::<false, false>(asked, steps, self.pace);
            return;
        }
        let friction = self.friction();
        if let Some((few, pace)) = self.longer(asked, steps, friction) {
            // What slips or stays where it is is none of the elements' doing.
            let elements = (friction != Acts::Dry).then(|| [0, 1].map(|of| self.held[of].elements));
            let before = self.state;
            self.slips(friction == Acts::Dry);
            let goes_on = self.step::<true, true>(asked, few, pace);
            self.slips(false);
            let as_smooth = match friction {
                Acts::Dry => goes_on,
                Acts::BuildsUp => true,
                Acts::Holds => self.friction() == Acts::Holds,
            };
            if self.calm && as_smooth {
                return;
            }
            self.state = before;
            self.held.iter_mut().zip(elements.into_iter().flatten()).for_each(|(held, before)| held.elements = before);
        }
        self.step::<true, false>(asked, steps, self.pace);
    }

    /// How friction acts on the masses.
    fn friction(&mut self) -> Acts {
        let Body { laws: Laws { physics: p, load_per_motor, .. }, held, state, long, .. } = self;
        let long_s = long.map_or(0.0, |long| long.longest_s());
        let (mut builds_up, mut holds) = (false, true);
        for (mass, held) in [&state.motor, &state.table].into_iter().zip(held) {
            let stiffness = mass.bristle.stiffness;
            if stiffness == 0.0 {
                holds &= mass.share == 0.0;
                continue;
            }
            let (x, v) = (mass.position * *load_per_motor, mass.velocity * *load_per_motor);
            let level = mass.share * held.near.friction_level(p, x, v, state.time_s);
            let rests = long_s * mass.velocity.abs() * stiffness <= RESTS * level;
            // It follows a level that goes with the speed a way later.
            builds_up |= mass.bristle.force.abs() < SLIPS * level || p.bends(v, f64::INFINITY);
            holds &= rests;
        }
        if holds {
            Acts::Holds
        } else if builds_up {
            Acts::BuildsUp
        } else {
            Acts::Dry
        }
    }

    /// Lets bristles slip, or no longer.
    fn slips(&mut self, slips: bool) {
        self.state.motor.bristle.slips = slips;
        self.state.table.bristle.slips = slips;
    }

    /// In how many longer steps the same may be done, and their pace.
    fn longer(&mut self, asked: f64, steps: usize, friction: Acts) -> Option<(usize, Pace)> {
        let long = self.long.as_mut().filter(|_| self.calm)?;
        let (span_s, physics) = (steps as f64 * self.pace.step_s, &self.laws.physics);
        let few = long.fewest(span_s, self.state.motor.velocity, friction == Acts::BuildsUp);
        let alike = physics.saturates(asked) == physics.saturates(self.state.torque);
        (few < steps && alike).then(|| (few, long.pace(span_s / few as f64, self.time_constant_s)))
    }

    /// Steps at a pace. `WATCHED`: whether flanks are calm is to be known. `LONG`: they are longer than usual, and it is told whether all
    /// masses went on as they did.
    fn step<const WATCHED: bool, const LONG: bool>(&mut self, asked: f64, steps: usize, pace: Pace) -> bool {
        let mut state = self.state;
        let by = pace.step_s / state.step_s;
        state.motor.change *= by;
        state.table.change *= by;
        state.step_s = pace.step_s;
        let (laws, own) = (&self.laws, &mut self.held);
        let (mut leaning, mut goes_on) = (Leaning::default(), true);
        let mut seen = |carried: Carried, state: &State| {
            if WATCHED {
                leaning.add(carried.torque, carried.rate, carried.speeds);
            }
            goes_on &= !LONG || state.motor.goes_on() && state.table.goes_on();
        };
        match (&laws.physics.two_masses, self.plain) {
            (None, true) => (0..steps).for_each(|_| {
                laws.rigid_step::<true, LONG>(pace, own, &mut state, asked);
                goes_on &= !LONG || state.motor.goes_on();
            }),
            (None, false) => (0..steps).for_each(|_| {
                laws.rigid_step::<false, LONG>(pace, own, &mut state, asked);
                goes_on &= !LONG || state.motor.goes_on();
            }),
            (Some(m), true) => {
                (0..steps)
                    .for_each(|_| seen(laws.two_mass_step::<true, LONG>(m, pace, own, &mut state, asked), &state));
            }
            (Some(m), false) => {
                (0..steps)
                    .for_each(|_| seen(laws.two_mass_step::<false, LONG>(m, pace, own, &mut state, asked), &state));
            }
        }
        self.state = state;
        if let Some(masses) = self.laws.flanks().filter(|_| WATCHED && steps > 0) {
            let both = masses.motor_inertia + masses.table_inertia;
            self.calm = leaning.is_calm(CALM, masses, masses.motor_inertia * masses.table_inertia / both);
        }
        goes_on
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
    /// What is between motor and table, where that is a clearance.
    fn flanks(&self) -> Option<&TwoMasses> {
        self.physics.two_masses.as_ref().filter(|masses| masses.clearance > 0.0)
    }

    #[inline(always)]
    fn rigid_step<const PLAIN: bool, const LONG: bool>(
        &self,
        pace: Pace,
        [own, _]: &mut [Held; 2],
        state: &mut State,
        asked: f64,
    ) {
        let (h, p) = (pace.step_s, &self.physics);
        let [torque, further] = pace.follow(&mut state.torque, asked);
        let (m, middle_s) = (&mut state.motor, state.time_s + 0.5 * h);
        let middle = m.middle(h);
        if PLAIN {
            m.kick(&mut own.elements, h, middle, torque - p.constant_torque(), self.viscous, p.coulomb());
        } else {
            let torque = p.delivered(torque) - own.near.cogging_torque(middle * self.load_per_motor);
            self.resisted::<LONG, true>(m, own, [h, middle_s], middle, torque);
        }
        if LONG {
            m.goes_further(further);
        }
        state.time_s += h;
    }

    #[inline(always)]
    fn two_mass_step<const PLAIN: bool, const LONG: bool>(
        &self,
        masses: &TwoMasses,
        pace: Pace,
        [at_motor, at_table]: &mut [Held; 2],
        state: &mut State,
        asked: f64,
    ) -> Carried {
        let (h, p) = (pace.step_s, &self.physics);
        let [torque, further] = pace.follow(&mut state.torque, asked);
        let (motor, table) = (&mut state.motor, &mut state.table);
        let (motor_middle, table_middle) = (motor.middle(h), table.middle(h));
        let (rate, speed) = (motor.velocity - table.velocity, table.velocity);
        // A spring goes on as it did; flanks may just have met.
        let changes = if masses.clearance == 0.0 { 0.5 * (motor.change - table.change) } else { 0.0 };
        let push = transmitted(masses, motor_middle - table_middle, rate + changes);
        if PLAIN {
            let level = p.coulomb();
            motor.kick(&mut at_motor.elements, h, motor_middle, torque - push, self.viscous, level);
            table.kick(&mut at_table.elements, h, table_middle, push - p.constant_torque(), self.viscous, level);
        } else {
            let times = [h, state.time_s + 0.5 * h];
            let torque = p.delivered(torque) - at_motor.near.cogging_torque(motor_middle * self.load_per_motor);
            self.resisted::<LONG, false>(motor, at_motor, times, motor_middle, torque - push);
            self.resisted::<LONG, true>(table, at_table, times, table_middle, push);
        }
        if LONG {
            motor.goes_further(further);
        }
        state.time_s += h;
        Carried { torque: push, rate, speeds: [speed, table.velocity] }
    }

    /// Kicks a mass against what resists it at the middle of a step; `LOADED` where the load acts on it.
    #[inline(always)]
    fn resisted<const LONG: bool, const LOADED: bool>(
        &self,
        mass: &mut Mass,
        own: &mut Held,
        [h, middle_s]: [f64; 2],
        middle: f64,
        torque: f64,
    ) {
        let (p, x, slope) = (&self.physics, middle * self.load_per_motor, self.physics.slope_at(mass.velocity));
        let mut v = mass.middle_speed() * self.load_per_motor;
        if LONG && p.bends(v, mass.change * self.load_per_motor) {
            let torque = if LOADED { torque - own.near.load(p, x, v, middle_s) } else { torque };
            let mut there = *mass;
            there.kick(&mut None, h, middle, torque, slope, own.near.friction_level(p, x, v, middle_s));
            v = 0.5 * (mass.velocity + there.velocity) * self.load_per_motor;
        }
        let torque = if LOADED { torque - own.near.load(p, x, v, middle_s) } else { torque };
        let level = own.near.friction_level(p, x, v, middle_s);
        mass.kick(&mut own.elements, h, middle, torque, slope, level);
    }
}
