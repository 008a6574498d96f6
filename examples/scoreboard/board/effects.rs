//! The causes of the vocabulary as the generator hides them: random parameters within what real machines show, how each
//! changes the true machine, and the parameters under the keys of the files, against which a diagnosis is scored.

use super::random::Random;
use super::rig::{Drive, Rig};
use super::truth::{Coupling, Sine, Truth};
use serde_json::{Value, json};
use std::f64::consts::TAU;

pub const CAUSES: [&str; 19] = [
    "inertia_mismatch",
    "coulomb_friction_mismatch",
    "viscous_friction_mismatch",
    "constant_torque",
    "direction_dependent_friction",
    "stribeck_friction",
    "presliding_friction",
    "backlash",
    "drive_compliance",
    "cogging",
    "position_dependent_friction",
    "cable_force",
    "quadratic_drag",
    "thermal_drift",
    "dead_time",
    "external_vibration",
    "torque_saturation",
    "screw_pitch_error",
    "screw_periodic_error",
];

/// Those that are a wrong number of the belief.
pub const BELIEFS: [&str; 4] =
    ["inertia_mismatch", "coulomb_friction_mismatch", "viscous_friction_mismatch", "constant_torque"];

/// Resonance of the stiff flanks of a clearance, Hz: far above what a servo sees, so that only the clearance shows.
const FLANK_HZ: f64 = 900.0;

/// A hidden effect: `amount` is the one number that makes it larger or smaller, `form` what else describes it.
#[derive(Clone, Debug)]
pub struct Effect {
    pub cause: &'static str,
    /// In the truth's units, always positive.
    pub amount: f64,
    pub low: f64,
    pub high: f64,
    /// About how its trace grows with the amount: trace ∝ amount^power.
    pub power: f64,
    pub sign: f64,
    pub form: [f64; 3],
}

/// One parameter as the files have it.
pub struct Parameter {
    pub key: String,
    pub value: f64,
    /// What an error is measured against.
    pub scale: f64,
    /// Whether the contract asks a diagnosis for it, or it only completes the machine file.
    pub scored: bool,
}

/// Whether a cause lies between motor and table.
pub fn before_table(cause: &str) -> bool {
    ["backlash", "drive_compliance"].contains(&cause)
}

/// Whether a table winds its drive up, or crosses a clearance, otherwise with a cause: friction, or a load.
pub fn resists(cause: &str) -> bool {
    cause.contains("friction") || ["constant_torque", "thermal_drift"].contains(&cause)
}

/// Whether a cause can be on such a rig at all.
pub fn possible(cause: &str, rig: &Rig) -> bool {
    match cause {
        "backlash" => rig.drive != Drive::Linear && rig.gearing > 1.0,
        "drive_compliance" => rig.drive != Drive::Rotary,
        "quadratic_drag" | "screw_pitch_error" => rig.drive != Drive::Rotary,
        "screw_periodic_error" => rig.drive == Drive::BallScrew,
        _ => true,
    }
}

/// Whether a cause shows only between table and encoder.
pub fn on_table_only(cause: &str) -> bool {
    cause.starts_with("screw_")
}

/// Whether two causes may be hidden together: not two of those that all act within the lost motion of one reversal, and not
/// a cable beside a constant torque, which is the same cable whose force is zero elsewhere.
pub fn separable(a: &str, b: &str) -> bool {
    let lost_motion = |c: &str| before_table(c) || c == "presliding_friction";
    let level = |c: &str| ["constant_torque", "cable_force"].contains(&c);
    a != b && !(lost_motion(a) && lost_motion(b)) && !(level(a) && level(b))
}

impl Effect {
    /// Draws one; `peak` is the largest torque of the belief's own run.
    pub fn draw(cause: &'static str, rig: &Rig, peak: f64, r: &mut Random) -> Self {
        let tc = rig.coulomb;
        let stroke = rig.reach.high - rig.reach.low;
        let mut sign = r.sign();
        let mut form = [0.0; 3];
        let (low, high, power) = match cause {
            "inertia_mismatch" => (0.03 * rig.inertia, 0.5 * rig.inertia, 1.0),
            "coulomb_friction_mismatch" => (0.03 * tc, 0.6 * tc, 1.0),
            "viscous_friction_mismatch" => (0.05 * rig.viscous, 0.8 * rig.viscous, 1.0),
            "constant_torque" => {
                // In one of three the Coulomb levels of the two directions differ, which slides like a constant torque.
                form[0] = f64::from(r.chance(0.3));
                (0.03 * tc, if form[0] > 0.0 { 0.5 } else { 1.0 } * tc, 1.0)
            }
            "direction_dependent_friction" => (0.05 * rig.viscous, 0.6 * rig.viscous, 1.0),
            "stribeck_friction" => {
                // In one of three the exponent that a tribometer would have found.
                let exponent = if r.chance(0.3) { r.uniform(0.6, 1.4) } else { 2.0 };
                form = [rig.reach.speed * r.log_uniform(0.005, 0.06), exponent, 0.0];
                (0.1 * tc, 0.6 * tc, 1.0)
            }
            "presliding_friction" => {
                form[0] = if r.chance(0.6) { 0.0 } else { r.uniform(0.05, 0.4) };
                (1e-3, 0.15, 0.5)
            }
            "backlash" => {
                form = [r.uniform(0.3, 0.6), r.uniform(0.5, 0.9), 0.0];
                (3e-3, 0.06, 0.5)
            }
            "drive_compliance" => {
                form = [r.uniform(0.2, 0.8), r.uniform(0.5, 0.9), r.uniform(0.01, 0.08)];
                let fastest = (0.12 / rig.servo.period).min(150.0);
                (1.0 / fastest.powi(2), 1.0 / 15f64.powi(2), 1.0)
            }
            "cogging" => {
                // In one of four few periods: a screw, a gear or a table that runs out of true.
                let few = r.chance(0.25);
                form = [
                    match rig.drive {
                        _ if few => stroke / r.uniform(1.8, 5.0),
                        Drive::BallScrew => {
                            let n = r.pick(&[1, rig.pole_pairs, 2 * rig.pole_pairs, 6 * rig.pole_pairs]);
                            (rig.gearing / f64::from(n)).max(0.4)
                        }
                        Drive::Linear => r.pick(&[12.0, 16.0, 20.0, 24.0, 30.0, 32.0]),
                        Drive::Rotary => (360.0 / rig.gearing).min(360.0 / f64::from(2 * rig.pole_pairs)),
                    },
                    r.phase(),
                    0.0,
                ];
                (0.02 * tc, 0.6 * tc, 1.0)
            }
            "position_dependent_friction" => {
                sign = if r.chance(0.85) { 1.0 } else { -1.0 };
                form = [rig.reach.low + stroke * r.uniform(0.15, 0.85), stroke * r.log_uniform(0.04, 0.15), 2.0];
                if r.chance(0.25) {
                    form[2] = r.log_uniform(2.5, 20.0);
                } else if r.chance(0.2) {
                    // A guideway that is another from somewhere on.
                    form = [rig.reach.high, stroke * r.uniform(0.3, 0.7), r.log_uniform(8.0, 40.0)];
                }
                (0.1 * tc, if sign > 0.0 { 1.5 } else { 0.7 } * tc, 1.0)
            }
            "cable_force" => {
                form[0] = if r.chance(0.5) { 0.0 } else { 0.5 * (rig.reach.low + rig.reach.high) };
                (0.05 * tc / stroke, 1.5 * tc / stroke, 1.0)
            }
            "quadratic_drag" => {
                sign = 1.0;
                let v = rig.reach.speed * 1e-3;
                (0.05 * tc / (v * v), 2.0 * tc / (v * v), 1.0)
            }
            "thermal_drift" => {
                sign = 1.0;
                form[0] = rig.duration * r.uniform(0.12, 0.5);
                (0.06 * tc, 0.8 * tc, 1.0)
            }
            // Up to three cycles.
            "dead_time" => (1e-4, f64::max(4e-3, 3.0 * rig.servo.period), 1.0),
            "external_vibration" => {
                form = [r.log_uniform(4.0, (0.1 / rig.servo.period).min(80.0)), r.phase(), 0.0];
                (0.02 * tc, 0.6 * tc, 1.0)
            }
            "torque_saturation" => {
                form[0] = r.pick(&[0.0, 0.0, 0.3, 0.5, 0.7]);
                (0.05 * peak, 0.5 * peak, 1.3)
            }
            "screw_pitch_error" => (5e-6, 5e-4, 1.0),
            "screw_periodic_error" => {
                form = [rig.gearing / r.pick(&[1.0, 1.0, 2.0]), r.phase(), 0.0];
                (3e-4, 2e-2, 1.0)
            }
            _ => unreachable!("{cause} is not in the vocabulary"),
        };
        if cause == "torque_saturation" {
            form[1] = peak;
        }
        Self { cause, amount: r.log_uniform(low, high), low, high, power, sign, form }
    }

    /// Phases belong to a recording (the encoder's zero and the clock start anew), not to the machine.
    pub fn new_phase(&mut self, r: &mut Random) {
        if ["cogging", "external_vibration", "screw_periodic_error"].contains(&self.cause) {
            self.form[1] = r.phase();
        }
    }

    fn coupling(&self, rig: &Rig) -> Coupling {
        let share = self.form[0];
        let reduced = rig.inertia * share * (1.0 - share);
        let (hz, damping_ratio, clearance) = if self.cause == "backlash" {
            (FLANK_HZ, 0.2, self.amount / rig.unit)
        } else {
            (self.amount.powf(-0.5), self.form[2], 0.0)
        };
        let stiffness = reduced * (TAU * hz).powi(2);
        let damping = 2.0 * damping_ratio * (stiffness * reduced).sqrt();
        Coupling { stiffness, damping, clearance, inertia_share: share, friction_share: self.form[1] }
    }

    /// How late the torque column is, s. Where the current loop is much faster than the cycle the torque stands still for
    /// most of it, and a part of a cycle leaves no trace: only whole cycles are hidden there.
    fn delay(&self, rig: &Rig) -> f64 {
        let period = rig.servo.period;
        let whole = rig.servo.lag < 0.4 * period;
        self.sign * if whole { (self.amount / period).round().max(1.0) * period } else { self.amount }
    }

    /// Puts the effect into the true machine.
    pub fn apply(&self, rig: &Rig, truth: &mut Truth) {
        let (size, form) = (self.sign * self.amount, &self.form);
        match self.cause {
            "inertia_mismatch" => truth.inertia += size,
            "coulomb_friction_mismatch" => truth.coulomb += size,
            "viscous_friction_mismatch" => truth.viscous += size,
            "constant_torque" if form[0] > 0.0 => truth.coulomb_by_direction = size,
            "constant_torque" => truth.constant += size,
            "direction_dependent_friction" => truth.asymmetry = size,
            "stribeck_friction" => truth.stribeck = (size, form[0], form[1]),
            "presliding_friction" => {
                truth.presliding = self.amount / rig.unit;
                truth.bristle_damping = form[0];
            }
            "backlash" | "drive_compliance" => {
                let own = self.coupling(rig);
                let with_play = truth.coupling.map(|spring| Coupling { clearance: own.clearance, ..spring });
                truth.coupling = Some(with_play.unwrap_or(own));
            }
            "cogging" => truth.cogging = Sine { amplitude: self.amount, period: form[0], phase: form[1] },
            "position_dependent_friction" => truth.spot = (form[0], size, form[1], form[2]),
            "cable_force" => truth.cable = (size, form[0]),
            "quadratic_drag" => truth.drag = size,
            "thermal_drift" => truth.drift = (size, form[0]),
            "dead_time" => truth.delay = self.delay(rig),
            "external_vibration" => {
                truth.vibration = Sine { amplitude: self.amount, period: 1.0 / form[0], phase: form[1] }
            }
            "torque_saturation" => truth.saturation = Some((form[1] - self.amount, form[0])),
            "screw_pitch_error" => truth.pitch = size,
            "screw_periodic_error" => {
                truth.pitch_wave = Sine { amplitude: self.amount, period: form[0], phase: form[1] }
            }
            _ => unreachable!(),
        }
    }

    /// The true parameters under the keys of the files.
    pub fn parameters(&self, rig: &Rig) -> Vec<Parameter> {
        let (size, form) = (self.sign * self.amount, &self.form);
        let stroke = rig.reach.high - rig.reach.low;
        let scored = |key: &str, value: f64| Parameter { key: rig.key(key), value, scale: value.abs(), scored: true };
        let extra = |key: &str, value: f64| Parameter { key: rig.key(key), value, scale: value.abs(), scored: false };
        match self.cause {
            "inertia_mismatch" => vec![scored("inertia_kg_m2", rig.inertia + size)],
            "coulomb_friction_mismatch" => vec![scored("coulomb_friction_nm", rig.coulomb + size)],
            "viscous_friction_mismatch" => vec![scored("viscous_friction_nm_s", rig.viscous + size)],
            "constant_torque" => {
                vec![Parameter { scale: size.abs(), ..scored("constant_torque_nm", rig.constant + size) }]
            }
            "direction_dependent_friction" => vec![scored("asymmetry_nm_s", size)],
            "stribeck_friction" => vec![
                scored("stribeck_torque_nm", size),
                scored("stribeck_velocity_mm_s", form[0]),
                extra("stribeck_exponent", form[1]),
            ],
            "presliding_friction" => vec![scored("presliding_um", self.amount * 1e3)],
            "backlash" => vec![
                scored("backlash_um", self.amount * 1e3),
                extra("table_inertia_share", form[0]),
                extra("table_friction_share", form[1]),
            ],
            "drive_compliance" => {
                let c = self.coupling(rig);
                // Stiffness at the motor over (mm per unit of q)²: 1 N·m/mm² = 10⁶ N/m = 1 N/µm.
                let newton_per_um = c.stiffness / (rig.unit * rig.unit);
                vec![
                    scored("resonance_hz", self.amount.powf(-0.5)),
                    scored("stiffness_n_um", newton_per_um),
                    extra("table_inertia_share", form[0]),
                    extra("table_friction_share", form[1]),
                    extra("damping_ratio", form[2]),
                ]
            }
            "cogging" => vec![scored("amplitude_nm", self.amount), scored("period_mm", form[0])],
            "position_dependent_friction" => vec![
                // Where the middle of what lasts to the end of the stroke lies is nowhere to be seen.
                Parameter { scale: 0.1 * stroke, scored: form[0] < rig.reach.high, ..scored("centre_mm", form[0]) },
                scored("peak_nm", size),
                extra("width_mm", form[1]),
                extra("steepness", form[2]),
            ],
            "cable_force" => vec![scored("slope_nm_mm", size), extra("zero_mm", form[0])],
            "quadratic_drag" => vec![scored("drag_nm_s2_m2", size)],
            "thermal_drift" => vec![scored("drop_nm", size), scored("time_constant_s", form[0])],
            "dead_time" => vec![scored("delay_ms", self.delay(rig) * 1e3)],
            "external_vibration" => vec![scored("frequency_hz", form[0]), scored("amplitude_nm", self.amount)],
            "torque_saturation" => vec![scored("limit_nm", form[1] - self.amount), extra("slope_ratio", form[0])],
            "screw_pitch_error" => vec![scored("scale_um_m", size * 1e6)],
            "screw_periodic_error" => vec![scored("amplitude_um", self.amount * 1e3), scored("period_mm", form[0])],
            _ => unreachable!(),
        }
    }

    /// The entry of `effects` that describes it.
    pub fn entry(&self, rig: &Rig) -> Value {
        let parameters: serde_json::Map<String, Value> =
            self.parameters(rig).into_iter().map(|p| (p.key, json!(p.value))).collect();
        json!({ "cause": self.cause, "parameters": parameters })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::rig::Scale;
    use crate::board::{moves, record};

    /// A rig of each drive, with a smooth servo and a scale, and a run of it.
    fn bench(drive: Drive) -> (Rig, moves::Command) {
        let fits =
            |r: &Rig| r.drive == drive && r.gearing != 36.0 && (1e-3..3e-3).contains(&r.servo.period) && r.every == 1;
        let mut rig = (0..999).map(|s| Rig::draw(&mut Random::new(11, s), 10.0)).find(fits).unwrap();
        rig.table = Some(Scale { step: 1e-6, noise: 0.0, zero: 0.0 });
        let (start, segments) = moves::draw(&mut Random::new(5, 5), &rig.reach, rig.duration, 0.3);
        let command = moves::sample(start, &segments, rig.servo.period, rig.duration, 0.02);
        (rig, command)
    }

    /// What the documentation of the files says each cause adds to the torque, from the true motion alone.
    fn promised(effect: &Effect, rig: &Rig, t: f64, x: f64, v: f64, a: f64) -> Option<f64> {
        let value = |key: &str| {
            effect.parameters(rig).iter().find(|p| p.key == rig.key(key)).map(|p| p.value).unwrap_or(f64::NAN)
        };
        let (w, alpha, way) = (v / rig.unit, a / rig.unit, v.signum());
        Some(match effect.cause {
            "inertia_mismatch" => (value("inertia_kg_m2") - rig.inertia) * alpha,
            "coulomb_friction_mismatch" => (value("coulomb_friction_nm") - rig.coulomb) * way,
            "viscous_friction_mismatch" => (value("viscous_friction_nm_s") - rig.viscous) * w,
            "constant_torque" => value("constant_torque_nm") - rig.constant,
            "direction_dependent_friction" => value("asymmetry_nm_s") * w.abs(),
            "stribeck_friction" => {
                way * value("stribeck_torque_nm")
                    * (-(v / value("stribeck_velocity_mm_s")).abs().powf(value("stribeck_exponent"))).exp()
            }
            "cogging" => value("amplitude_nm") * (TAU * x / value("period_mm") + effect.form[1]).sin(),
            "position_dependent_friction" => {
                way * value("peak_nm")
                    * (-((x - value("centre_mm")) / value("width_mm")).abs().powf(value("steepness"))).exp()
            }
            "cable_force" => value("slope_nm_mm") * (x - value("zero_mm")),
            "quadratic_drag" => value("drag_nm_s2_m2") * v * v.abs() * 1e-6,
            "thermal_drift" => way * value("drop_nm") * (-t / value("time_constant_s")).exp(),
            "external_vibration" => value("amplitude_nm") * (TAU * value("frequency_hz") * t + effect.form[1]).sin(),
            _ => return None,
        })
    }

    #[test]
    fn each_torque_is_in_the_recording_as_the_files_describe_it() {
        let mut checked = 0;
        for drive in [Drive::BallScrew, Drive::Linear, Drive::Rotary] {
            let (rig, command) = bench(drive);
            for cause in CAUSES.into_iter().filter(|c| possible(c, &rig)) {
                let mut effect = Effect::draw(cause, &rig, 1.0, &mut Random::new(2, checked as u64));
                effect.amount = (effect.low * effect.high).sqrt();
                let mut truth = Truth::of(&rig);
                effect.apply(&rig, &mut truth);
                let r = record::run(&rig, &truth, &command, 2e-5, &mut Random::new(1, 1));
                let (h, x) = (rig.servo.period, &r.true_position);
                let (mut apart, mut scale) = (Vec::new(), Vec::new());
                for i in 2..x.len() - 2 {
                    let v = (x[i + 1] - x[i - 1]) / (2.0 * h);
                    let a = (x[i + 1] - 2.0 * x[i] + x[i - 1]) / (h * h);
                    // Away from reversals, where the sign of the motion is plain and differences are good.
                    let slow = (i - 2..=i + 2)
                        .any(|j| (x[j] - x[i]).abs() > 0.0 && (x[j] - x[i]) * (j as f64 - i as f64) * v < 0.0);
                    if v.abs() < 1e-3 * rig.reach.speed || slow {
                        continue;
                    }
                    let Some(expected) = promised(&effect, &rig, i as f64 * h, x[i], v, a) else { continue };
                    apart.push(r.unexplained[i] - expected);
                    scale.push(expected);
                }
                if scale.is_empty() {
                    continue;
                }
                let (error, size) = (record::rms(&apart), record::rms(&scale));
                // Accelerations from differences over a cycle in which the torque jumps are the coarse ones.
                let allowed = if cause == "inertia_mismatch" { 0.2 } else { 0.02 };
                assert!(error < allowed * size, "{drive:?} {cause}: {error} of {size}");
                checked += 1;
            }
        }
        assert!(checked >= 33, "only {checked} checked");
    }

    #[test]
    fn a_clearance_is_lost_at_a_reversal_as_wide_as_it_says() {
        let (mut rig, _) = bench(Drive::BallScrew);
        rig.table = Some(Scale { step: 1e-6, noise: 0.0, zero: 0.0 });
        let effect = Effect { amount: 0.04, ..Effect::draw("backlash", &rig, 1.0, &mut Random::new(2, 2)) };
        let mut truth = Truth::of(&rig);
        effect.apply(&rig, &mut truth);
        let speed = 0.02 * rig.reach.speed;
        let travel = 2.0 * speed;
        let there = [
            moves::Segment::Move { to: 20.0 + travel, speed, acceleration: 0.2 * rig.reach.acceleration },
            moves::Segment::Move { to: 20.0, speed, acceleration: 0.2 * rig.reach.acceleration },
        ];
        let command = moves::sample(20.0, &there, rig.servo.period, 4.0, 0.0);
        let r = record::run(&rig, &truth, &command, 1e-5, &mut Random::new(1, 1));
        let at = |t: f64| r.table_error[(t / rig.servo.period) as usize];
        // Sliding one way the table lags by half the clearance, the other way it leads; wind-up of the flanks is far less.
        let lost = at(3.0) - at(1.5);
        assert!((lost - 0.04).abs() < 0.001, "{lost}");
    }

    #[test]
    fn stiffness_and_resonance_belong_together() {
        let (rig, _) = bench(Drive::BallScrew);
        let effect =
            Effect { amount: 1.0 / 2500.0, ..Effect::draw("drive_compliance", &rig, 1.0, &mut Random::new(3, 3)) };
        let p = effect.parameters(&rig);
        assert!((p[0].value - 50.0).abs() < 1e-9, "{} Hz", p[0].value);
        // Masses at the table: J/(lead/2π)²; f = √(k(1/m₁ + 1/m₂))/2π.
        let radius = rig.gearing * 1e-3 / TAU;
        let (m1, m2) =
            (rig.inertia * (1.0 - effect.form[0]) / radius.powi(2), rig.inertia * effect.form[0] / radius.powi(2));
        let hz = (p[1].value * 1e6 * (1.0 / m1 + 1.0 / m2)).sqrt() / TAU;
        assert!((hz - 50.0).abs() < 1e-9, "{hz} Hz from {} N/µm", p[1].value);
    }

    #[test]
    fn what_is_beyond_saturation_is_in_the_current_and_not_in_the_motion() {
        let (rig, command) = bench(Drive::Linear);
        let plain = record::run(&rig, &Truth::of(&rig), &command, 2e-5, &mut Random::new(1, 1));
        let peak = plain.clean_torque.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        let mut effect = Effect::draw("torque_saturation", &rig, peak, &mut Random::new(1, 1));
        effect.amount = 0.3 * peak;
        effect.form[0] = 0.5;
        let mut truth = Truth::of(&rig);
        effect.apply(&rig, &mut truth);
        let r = record::run(&rig, &truth, &command, 2e-5, &mut Random::new(1, 1));
        let mut beyond = 0;
        for (torque, left) in r.clean_torque.iter().zip(&r.unexplained) {
            let excess = 0.5 * (torque.abs() - 0.7 * peak).max(0.0) * torque.signum();
            assert!((left - excess).abs() < 1e-6 * peak, "{left} for {excess}");
            beyond += usize::from(excess != 0.0);
        }
        assert!(beyond > 20, "{beyond} rows");
    }
}
