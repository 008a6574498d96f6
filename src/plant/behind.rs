//! The table behind a motor that moves as measured: simulated behind its spring or clearance.

use super::coupling::{CALM_BEHIND_MEASURED, Giving, LONGER, Leaning, longest_step_s, transmitted};
use super::friction::Friction;
use super::nearby::Nearby;
use super::observed::Observed;
use super::physics::Physics;
use crate::machine::TwoMasses;
use std::ops::Range;

/// Where the table is at each row, motor's coordinate, and the torque that it takes from a motor that moves as measured.
pub(super) fn table_motion<'o>(
    physics: &'o Physics,
    masses: TwoMasses,
    observed: &'o Observed,
    run: Range<usize>,
) -> impl Iterator<Item = (f64, f64)> + 'o {
    let mut table = Table::new(physics, masses, observed, run.start);
    // A row stands between the mean before it and the one after it.
    let mut before = None;
    let last = run.end - 1;
    run.map(move |i| {
        let here = table.now.place;
        let after = (i < last).then(|| table.mean_after(i));
        let torque = match (std::mem::replace(&mut before, after), after) {
            (Some(before), Some(after)) => 0.5 * (before + after),
            (one, other) => one.or(other).unwrap_or(0.0),
        };
        (here, torque)
    })
}

/// A table, motor's coordinate.
struct Table<'o> {
    physics: &'o Physics,
    masses: TwoMasses,
    observed: &'o Observed,
    near: Nearby,
    now: Now,
    /// Longest steps, s, and those while it goes with its motor.
    longest_s: [f64; 2],
    /// Whether it does.
    goes_along: bool,
}

/// What changes from step to step.
#[derive(Clone, Copy)]
struct Now {
    place: f64,
    speed: f64,
    friction: Friction,
    /// Of a motor that gives way to flanks between the rows.
    recoil: [f64; 3],
}

impl<'o> Table<'o> {
    fn new(physics: &'o Physics, masses: TwoMasses, observed: &'o Observed, row: usize) -> Self {
        let scale = physics.motor_per_load;
        let (motor, speed) = (observed.motion.position[row] * scale, observed.motion.velocity(row) * scale);
        // A table in motion is already pushed by its motor.
        let lag = if speed == 0.0 { 0.0 } else { (0.5 * masses.clearance).copysign(speed) };
        let friction = physics.bristle(masses.table_friction_share);
        let now = Now { place: motor - lag, speed, friction, recoil: [0.0; 3] };
        let body = (masses.table_inertia, masses.table_friction_share);
        let usual_s = longest_step_s(&masses, masses.table_inertia);
        let longest_s = [usual_s, physics.longest_step_of_bristles_s(&[body]).min(LONGER * usual_s)];
        Self { physics, masses, observed, near: Nearby::new(physics), now, longest_s, goes_along: false }
    }

    /// Goes on to the next row; the mean of the transmitted torque until there.
    fn mean_after(&mut self, row: usize) -> f64 {
        let span = self.observed.time_s[row + 1] - self.observed.time_s[row];
        let masses = self.masses;
        let [usual_s, calm_s] = self.longest_s;
        let steps = |step_s: f64| (span / step_s).ceil().clamp(1.0, 1000.0) as usize;
        let is_calm = |leaning: &Leaning| leaning.is_calm(CALM_BEHIND_MEASURED, &masses, masses.table_inertia);
        if self.goes_along {
            let before = self.now;
            let leaning = self.step_to_next(row, span, steps(calm_s));
            if is_calm(&leaning) {
                return leaning.mean();
            }
            self.now = before;
        }
        let leaning = self.step_to_next(row, span, steps(usual_s));
        self.goes_along = masses.clearance > 0.0 && is_calm(&leaning);
        leaning.mean()
    }

    #[inline(always)]
    fn motor_at(&self, row: usize) -> (f64, f64) {
        let (scale, motion) = (self.physics.motor_per_load, &self.observed.motion);
        (motion.position[row] * scale, motion.velocity(row) * scale)
    }

    fn step_to_next(&mut self, row: usize, span: f64, steps: usize) -> Leaning {
        let (physics, masses) = (self.physics, self.masses);
        let (share, per_scale) = (masses.table_friction_share, 1.0 / physics.motor_per_load);
        let per_step = 1.0 / steps as f64;
        let h = span * per_step;
        let (per_span, mobility) = (1.0 / span, h / masses.motor_inertia);
        let ((q0, w0), (q1, w1)) = (self.motor_at(row), self.motor_at(row + 1));
        let begun = self.observed.time_s[row] - self.observed.time_s[0];
        let giving = Giving::new(span, h);
        let Now { mut place, mut speed, mut friction, mut recoil } = self.now;
        let mut leaning = Leaning::default();
        for step in 0..steps {
            let s = (step as f64 + 0.5) * per_step;
            let (motor, motor_speed) = hermite(q0, w0 * span, q1, w1 * span, s);
            let t = begun + s * span;
            let middle = place + 0.5 * h * speed;
            let (x, v) = (middle * per_scale, speed * per_scale);
            let [give, giving_speed, _] = recoil;
            let rate = (motor_speed * per_span + giving_speed) - speed;
            let through = transmitted(&masses, motor + give - middle, rate);
            if masses.clearance > 0.0 {
                recoil = giving.step(recoil, through, mobility);
            }
            let push = through - (self.near.load(physics, x, v, t) + share * physics.slope_friction(speed));
            let next = friction.step(
                masses.table_inertia,
                masses.table_inertia * speed + h * push,
                h,
                speed,
                share * self.near.friction_level(physics, x, v, t),
            );
            leaning.add(through, rate, [speed, next]);
            place = middle + 0.5 * h * next;
            speed = next;
        }
        self.now = Now { place, speed, friction, recoil };
        leaning
    }
}

/// Value and slope (per unit of `s`) of the cubic through two points with two slopes.
#[inline(always)]
fn hermite(a: f64, da: f64, b: f64, db: f64, s: f64) -> (f64, f64) {
    let (c2, c3) = (3.0 * (b - a) - 2.0 * da - db, 2.0 * (a - b) + da + db);
    (a + s * (da + s * (c2 + s * c3)), da + s * (2.0 * c2 + s * 3.0 * c3))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::{Effect, Machine};
    use crate::plant::moves::{Moves, Reach};
    use crate::plant::simulate::{Setup, simulate};
    use crate::recording::{Column, Recording};

    #[test]
    fn a_table_that_goes_with_its_motor_does_as_well_in_longer_steps() {
        let flanks = Effect::Backlash {
            width_um: 25.0,
            table_inertia_share: 0.4,
            table_friction_share: 0.6,
            contact_hz: 900.0,
            contact_damping_ratio: 0.3,
        };
        let builds_up = Effect::PreslidingFriction {
            displacement_um: 12.0,
            exponent: 0.7,
            maxwell_slip: 0.0,
            micro_damping_s: 0.0,
        };
        for effects in [vec![flanks], vec![flanks, builds_up]] {
            let (usual, longer, long) = apart_from_fine_steps(&effects);
            assert!(longer < 1.5 * usual && longer < 1e-2, "{longer} instead of {usual} of {effects:?}");
            assert!(long > 0.5, "{long} of the rows");
        }
    }

    /// By what share the torque is another than in steps a tenth as long, without longer ones and with them, and in what share of the rows
    /// these are made.
    fn apart_from_fine_steps(effects: &[Effect]) -> (f64, f64, f64) {
        let belief = Machine::parse(include_str!("../../examples/machines/believed.json")).unwrap().axes.remove(0);
        let axis = belief.with_effects(effects.to_vec());
        let reach = Reach { start: 20.0, stroke: 200.0, speed: 250.0, acceleration: 2500.0 };
        let mut command = Moves::built_in("test", &reach).unwrap().command(1e-3);
        command.truncate(15_000);
        let trace = simulate(&axis, &command, &Setup::default()).unwrap();
        // An encoder of a quarter of a micrometre, which trembles.
        let position = trace.position.iter().map(|x| (4e3 * x).round() / 4e3).collect();
        let columns = vec![Column::new("x.position_mm", position), Column::new("x.torque_nm", trace.torque.clone())];
        let recording = Recording::from_columns("simulated", trace.time_s, columns).unwrap();
        let observed = Observed::of(&recording, &axis).unwrap();
        let (physics, masses) = (Physics::of(&axis).unwrap(), axis.two_masses().unwrap().unwrap());
        let rows = observed.runs[0].clone();
        let by = |longer: bool, finer: f64| {
            let mut table = Table::new(&physics, masses, &observed, rows.start);
            table.longest_s[0] /= finer;
            let (mut torque, mut long) = (Vec::new(), 0);
            for row in rows.start..rows.end - 1 {
                table.goes_along &= longer;
                long += usize::from(table.goes_along);
                torque.push(table.mean_after(row));
            }
            (torque, long)
        };
        let ((fine, none), (usual, _), (longer, long)) = (by(false, 10.0), by(false, 1.0), by(true, 1.0));
        assert!(none == 0);
        let squares = |torque: &[f64]| torque.iter().map(|t| t * t).sum::<f64>();
        let apart = |torque: &[f64]| {
            let apart: Vec<f64> = torque.iter().zip(&fine).map(|(torque, fine)| torque - fine).collect();
            (squares(&apart) / squares(&fine)).sqrt()
        };
        (apart(&usual), apart(&longer), long as f64 / rows.len() as f64)
    }
}
