//! The motion of the true machine, integrated in steps of a few microseconds.
//!
//! Equation: Jᵢ·q̈ᵢ = τ (motor) ∓ coupling − smoothᵢ(t, q, q̇) − dryᵢ, for one mass, or for motor and table with
//! coupling = k·dz(q₁ − q₂) + c·(q̇₁ − q̇₂) in contact, never pulling across a clearance. SI units in motor coordinates.
//!
//! Dry friction without presliding is a hybrid automaton (Filippov; Karnopp 1985): each mass sticks or slides one way,
//! the sliding legs are integrated by the classical Runge–Kutta method of fourth order, and a mass whose speed changes
//! sign is caught at rest, from where it breaks away only when the rest of the forces exceeds the friction at rest.
//! Regularised, F·tanh(w/w₀), it is one force among the others.
//! With presliding it is Dahl's law solved in closed form over the displacement of a step, f = s·F − (s·F − f₀)·e^(−σ|Δq|/F),
//! σ = Tc/d, with LuGre's bristle damping σ₁·ż (Canudas de Wit et al. 1995), σ₁ fading with speed. The current loop's
//! first-order lag is exact.

use super::truth::{Coupling, Truth};

/// State of the machine: index 0 is the motor, 1 the table (rigid machine: unused).
#[derive(Clone, Copy, Debug)]
pub struct Motion {
    pub t: f64,
    pub q: [f64; 2],
    pub w: [f64; 2],
    /// Torque that the current says the motor delivers.
    pub torque: f64,
    /// Direction of sliding, 0 at rest (set-valued friction).
    direction: [f64; 2],
    /// Friction of the bristles (presliding), whole axis per unit share.
    bristle: [f64; 2],
}

/// The machine with the constants of one integration derived.
pub struct Machine<'a> {
    truth: &'a Truth,
    bodies: usize,
    inertia: [f64; 2],
    share: [f64; 2],
    coupling: Coupling,
    bristle_damping: f64,
    lag: f64,
    set_valued: bool,
}

impl<'a> Machine<'a> {
    pub fn new(truth: &'a Truth, lag: f64) -> Self {
        let none = Coupling { stiffness: 0.0, damping: 0.0, clearance: 0.0, inertia_share: 0.0, friction_share: 0.0 };
        let coupling = truth.coupling.unwrap_or(none);
        let bristle_damping = if truth.presliding > 0.0 {
            2.0 * truth.bristle_damping * (truth.coulomb / truth.presliding * truth.inertia).sqrt()
        } else {
            0.0
        };
        Self {
            truth,
            bodies: if truth.coupling.is_some() { 2 } else { 1 },
            inertia: [truth.inertia * (1.0 - coupling.inertia_share), truth.inertia * coupling.inertia_share],
            share: [1.0 - coupling.friction_share, coupling.friction_share],
            coupling,
            bristle_damping,
            lag,
            set_valued: truth.presliding == 0.0 && truth.regularised == 0.0,
        }
    }

    /// At rest at q, held by friction, in the middle of the clearance.
    pub fn at_rest(&self, q: f64) -> Motion {
        Motion { t: 0.0, q: [q; 2], w: [0.0; 2], torque: 0.0, direction: [0.0; 2], bristle: [0.0; 2] }
    }

    /// Position of the table in units of q.
    pub fn table(&self, m: &Motion) -> f64 {
        m.q[self.bodies - 1]
    }

    /// Torque from the motor to the table.
    pub fn coupling_torque(&self, q: &[f64; 2], w: &[f64; 2]) -> f64 {
        let c = &self.coupling;
        let twist = q[0] - q[1];
        let beyond = twist.abs() - 0.5 * c.clearance;
        if beyond <= 0.0 {
            return 0.0;
        }
        let side = twist.signum();
        let push = c.stiffness * beyond + side * c.damping * (w[0] - w[1]);
        // Flanks of a clearance push, they do not stick together; a drive without one pulls as well.
        side * if c.clearance > 0.0 { push.max(0.0) } else { push }
    }

    /// All torques on mass i except set-valued friction. `start` is the state at the step's begin (for the bristles).
    fn applied(&self, i: usize, t: f64, q: &[f64; 2], w: &[f64; 2], torque: f64, start: &Motion) -> f64 {
        let p = self.truth;
        let mut sum = -self.share[i] * p.slope(w[i]);
        if i == 0 {
            sum += p.delivered(torque) - p.at_motor(q[0]);
        }
        if self.bodies == 2 {
            let c = self.coupling_torque(q, w);
            sum += if i == 0 { -c } else { c };
        }
        if i + 1 == self.bodies {
            sum -= p.at_table(t, q[i], w[i]);
        }
        if p.presliding > 0.0 {
            sum -= self.share[i] * self.bristle(i, t, q[i], w[i], start);
        }
        sum
    }

    /// Dahl's friction after the displacement since the step's begin, plus the bristles' damping.
    fn bristle(&self, i: usize, t: f64, q: f64, w: f64, start: &Motion) -> f64 {
        let way = q - start.q[i];
        let s = if way == 0.0 { w.signum() } else { way.signum() };
        let level = self.truth.dry(t, q, w, s);
        let f = self.stretched(start.bristle[i], way, s, level);
        // Constant damping would make a fast reversal harder than the friction itself: it fades above a fifth of it.
        let fade = (-(self.bristle_damping * w / (0.2 * self.truth.coulomb)).powi(2)).exp();
        f + self.bristle_damping * fade * w * (1.0 - w.signum() * f / level)
    }

    /// Dahl's friction `f` after a further displacement `way` in direction `s`, sliding at `level`.
    fn stretched(&self, f: f64, way: f64, s: f64, level: f64) -> f64 {
        let end = s * level;
        end - (end - f) * (-way.abs() / self.truth.presliding * self.truth.coulomb / level).exp()
    }

    fn level(&self, i: usize, t: f64, q: f64, w: f64, direction: f64) -> f64 {
        self.share[i] * self.truth.dry(t, q, w, direction)
    }

    fn accelerations(&self, t: f64, q: &[f64; 2], w: &[f64; 2], torque: f64, start: &Motion) -> [f64; 2] {
        let mut a = [0.0; 2];
        for i in 0..self.bodies {
            let mut sum = self.applied(i, t, q, w, torque, start);
            if self.set_valued {
                let direction = start.direction[i];
                if direction == 0.0 {
                    continue;
                }
                sum -= direction * self.level(i, t, q[i], w[i], direction);
            } else if self.truth.presliding == 0.0 {
                sum -= (w[i] / self.truth.regularised).tanh() * self.level(i, t, q[i], w[i], w[i].signum());
            }
            a[i] = sum / self.inertia[i];
        }
        a
    }

    /// The motor's acceleration in this state.
    pub fn motor_acceleration(&self, m: &Motion) -> f64 {
        let mut m = *m;
        if self.set_valued {
            let torque = m.torque;
            self.break_away(&mut m, torque);
        }
        self.accelerations(m.t, &m.q, &m.w, m.torque, &m)[0]
    }

    /// Lets go of every mass at rest on which more than the friction at rest pushes.
    fn break_away(&self, m: &mut Motion, torque: f64) {
        for i in 0..self.bodies {
            if m.direction[i] == 0.0 {
                let push = self.applied(i, m.t, &m.q, &m.w, torque, m);
                if push.abs() > self.level(i, m.t, m.q[i], 0.0, push.signum()) {
                    m.direction[i] = push.signum();
                }
            }
        }
    }

    /// One step of `h` s with the servo's output held at `u`.
    pub fn step(&self, m: &mut Motion, u: f64, h: f64) {
        let (decay_half, decay) =
            if self.lag > 0.0 { ((-0.5 * h / self.lag).exp(), (-h / self.lag).exp()) } else { (0.0, 0.0) };
        let torque = if self.lag > 0.0 {
            [m.torque, u + (m.torque - u) * decay_half, u + (m.torque - u) * decay]
        } else {
            [u; 3]
        };
        if self.set_valued {
            self.break_away(m, torque[0]);
        }
        let ahead = |v: &[f64; 2], d: &[f64; 2], by: f64| [v[0] + by * d[0], v[1] + by * d[1]];
        let (t, q, w) = (m.t, m.q, m.w);
        let a1 = self.accelerations(t, &q, &w, torque[0], m);
        let w2 = ahead(&w, &a1, 0.5 * h);
        let a2 = self.accelerations(t + 0.5 * h, &ahead(&q, &w, 0.5 * h), &w2, torque[1], m);
        let w3 = ahead(&w, &a2, 0.5 * h);
        let a3 = self.accelerations(t + 0.5 * h, &ahead(&q, &w2, 0.5 * h), &w3, torque[1], m);
        let w4 = ahead(&w, &a3, h);
        let a4 = self.accelerations(t + h, &ahead(&q, &w3, h), &w4, torque[2], m);
        let mut next = *m;
        next.t = t + h;
        next.torque = torque[2];
        for i in 0..self.bodies {
            next.q[i] = q[i] + h / 6.0 * (w[i] + 2.0 * w2[i] + 2.0 * w3[i] + w4[i]);
            next.w[i] = w[i] + h / 6.0 * (a1[i] + 2.0 * a2[i] + 2.0 * a3[i] + a4[i]);
            if self.set_valued {
                if m.direction[i] != 0.0 && next.w[i] * m.direction[i] <= 0.0 {
                    next.w[i] = 0.0;
                    next.direction[i] = 0.0;
                }
            } else if self.truth.presliding > 0.0 {
                // The bristles alone: their damping is not stored.
                let way = next.q[i] - q[i];
                let s = way.signum();
                let level = self.truth.dry(t, next.q[i], next.w[i], s);
                next.bristle[i] = self.stretched(m.bristle[i], way, s, level);
            }
        }
        *m = next;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::random::Random;
    use crate::board::rig::Rig;

    /// A plain machine: 2 kg·m², no friction, nothing hidden.
    fn bare() -> Truth {
        let rig = Rig::draw(&mut Random::new(1, 1), 10.0);
        Truth { inertia: 2.0, coulomb: 0.0, viscous: 0.0, constant: 0.0, ..Truth::of(&rig) }
    }

    fn moving(machine: &Machine, w: f64) -> Motion {
        Motion { w: [w; 2], direction: [w.signum(); 2], ..machine.at_rest(0.0) }
    }

    #[test]
    fn a_coasting_mass_stops_after_its_kinetic_energy_is_rubbed_away_and_stays() {
        let truth = Truth { coulomb: 0.5, ..bare() };
        let machine = Machine::new(&truth, 0.0);
        let mut m = moving(&machine, 3.0);
        for _ in 0..2_000_000 {
            machine.step(&mut m, 0.0, 1e-5);
        }
        // J·w²/2 = Tc·way; the stop is located to one step.
        assert!((m.q[0] - 2.0 * 9.0 / 2.0 / 0.5).abs() < 3.0 * 1e-5, "{}", m.q[0]);
        assert_eq!(m.w[0], 0.0);
        // Held by any torque below the friction, let go by any above it.
        let at = m.q[0];
        for _ in 0..1000 {
            machine.step(&mut m, -0.499, 1e-5);
        }
        assert_eq!(m.q[0], at);
        machine.step(&mut m, -0.501, 1e-5);
        assert!(m.q[0] < at);
    }

    #[test]
    fn power_of_the_motor_goes_into_motion_friction_and_drag_to_the_last_joule() {
        let truth = Truth { coulomb: 0.5, viscous: 0.3, drag: 2e4, cable: (0.02, 5.0), unit: 1.5, ..bare() };
        let machine = Machine::new(&truth, 0.002);
        let mut m = machine.at_rest(0.0);
        let (mut work, mut lost, h) = (0.0, 0.0, 1e-5);
        for i in 0..500_000 {
            let u = 6.0 * (i as f64 * 1e-5 * 3.0).sin();
            let before = m;
            machine.step(&mut m, u, h);
            let way = m.q[0] - before.q[0];
            let w = 0.5 * (m.w[0] + before.w[0]);
            work += 0.5 * (m.torque + before.torque) * way;
            let v = w * truth.unit * 1e-3;
            lost += way.abs() * truth.coulomb + way * (truth.viscous * w + truth.drag * v * v.abs());
        }
        let x = m.q[0] * truth.unit;
        let stored = 0.5 * truth.inertia * m.w[0].powi(2)
            + truth.cable.0 * ((x - truth.cable.1).powi(2) - truth.cable.1.powi(2)) / 2.0 / truth.unit;
        assert!(work > 3.0, "only {work} J went in");
        assert!((work - lost - stored).abs() < 2e-5 * work, "{work} in, {lost} lost, {stored} stored");
    }

    #[test]
    fn two_masses_swing_at_the_resonance_of_the_formula_and_keep_their_energy() {
        let (k, share) = (800.0, 0.3);
        let coupling =
            Coupling { stiffness: k, damping: 0.0, clearance: 0.0, inertia_share: share, friction_share: 0.5 };
        let truth = Truth { coupling: Some(coupling), ..bare() };
        let machine = Machine::new(&truth, 0.0);
        let (j1, j2) = (2.0 * (1.0 - share), 2.0 * share);
        let mut m = Motion { q: [0.01, 0.0], ..machine.at_rest(0.0) };
        let energy = |m: &Motion| 0.5 * (j1 * m.w[0].powi(2) + j2 * m.w[1].powi(2) + k * (m.q[0] - m.q[1]).powi(2));
        let start = energy(&m);
        let (mut crossings, mut last) = (Vec::new(), m);
        for _ in 0..1_000_000 {
            machine.step(&mut m, 0.0, 1e-5);
            let (a, b) = (last.q[0] - last.q[1], m.q[0] - m.q[1]);
            if a < 0.0 && b >= 0.0 {
                crossings.push(last.t + 1e-5 * a / (a - b));
            }
            // What is lost is the catching at rest of a mass that turns, one part in a million each time.
            assert!((energy(&m) / start - 1.0).abs() < 1e-3);
            last = m;
        }
        let period = (crossings[crossings.len() - 1] - crossings[0]) / (crossings.len() - 1) as f64;
        let expected = std::f64::consts::TAU / (k * (1.0 / j1 + 1.0 / j2)).sqrt();
        assert!((period / expected - 1.0).abs() < 1e-4, "{period} s for {expected} s");
    }

    #[test]
    fn a_clearance_transmits_nothing_inside_and_never_pulls() {
        let coupling =
            Coupling { stiffness: 1e3, damping: 50.0, clearance: 0.02, inertia_share: 0.5, friction_share: 0.5 };
        let truth = Truth { coupling: Some(coupling), ..bare() };
        let machine = Machine::new(&truth, 0.0);
        assert_eq!(machine.coupling_torque(&[0.0099, 0.0], &[5.0, 0.0]), 0.0);
        assert!((machine.coupling_torque(&[0.012, 0.0], &[0.0, 0.0]) - 2.0).abs() < 1e-9);
        // Parting fast: damping alone would pull.
        assert_eq!(machine.coupling_torque(&[0.012, 0.0], &[-5.0, 0.0]), 0.0);
        assert!((machine.coupling_torque(&[-0.012, 0.0], &[0.0, 0.0]) + 2.0).abs() < 1e-9);
    }

    #[test]
    fn bristles_start_as_a_spring_and_end_at_the_coulomb_level() {
        let truth = Truth { coulomb: 0.5, presliding: 1e-3, inertia: 1e-4, viscous: 0.1, ..bare() };
        let machine = Machine::new(&truth, 0.0);
        // Pushed slowly with less than the friction: the spring holds, q = −d·ln(1 − T/Tc).
        let mut m = machine.at_rest(0.0);
        for i in 0..400_000 {
            machine.step(&mut m, 0.3 * (i as f64 / 200_000.0).min(1.0), 1e-5);
        }
        let expected = -1e-3 * (1.0f64 - 0.3 / 0.5).ln();
        assert!((m.q[0] / expected - 1.0).abs() < 1e-3, "{} for {expected}", m.q[0]);
        // Pushed with more: steady sliding at (T − Tc)/Tv.
        for _ in 0..100_000 {
            machine.step(&mut m, 0.9, 1e-5);
        }
        assert!((m.w[0] - 4.0).abs() < 1e-6, "{}", m.w[0]);
    }

    #[test]
    fn the_current_loop_lags_by_its_time_constant() {
        let truth = bare();
        let machine = Machine::new(&truth, 0.0007);
        let mut m = machine.at_rest(0.0);
        for _ in 0..70 {
            machine.step(&mut m, 1.0, 1e-5);
        }
        assert!((m.torque - (1.0 - (-1.0f64).exp())).abs() < 1e-12);
    }
}
