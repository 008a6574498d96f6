//! A random axis as its builder believes it to be: drive, inertia, friction, servo gains and sensors, drawn so that the
//! result is a machine that a control could run (stable loops, enough torque, an encoder fit for the rate).
//!
//! Motor coordinates throughout: angle q in rad and torque in N·m (ball screw, rotary), or travel in m and force in N
//! (linear). `unit` load units (mm; deg for rotary) are one unit of q.

use super::moves::{Reach, Style};
use super::random::Random;
use super::rough::Rough;
use serde_json::{Value, json};
use std::f64::consts::TAU;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Drive {
    BallScrew,
    Linear,
    Rotary,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ServoGains {
    /// s
    pub period: f64,
    /// 1/s
    pub position_gain: f64,
    /// Torque per motor speed.
    pub velocity_gain: f64,
    /// s
    pub integral_time: Option<f64>,
    pub feedforward: f64,
    /// First-order lag of the current loop, s; 0: none.
    pub lag: f64,
    pub two_sample_mean: bool,
}

/// The scale on the table, load units.
#[derive(Clone, Copy, Debug)]
pub struct Scale {
    pub step: f64,
    /// Standard deviation.
    pub noise: f64,
    /// Where it stands when the encoder says zero: the two are not homed to the last micrometre.
    pub zero: f64,
}

impl Scale {
    pub fn draw(random: &mut Random) -> Self {
        let (step, noise) = (random.pick(&[1e-4, 5e-4, 1e-3]), random.log_uniform(5e-5, 5e-4));
        Self { step, noise, zero: if random.chance(0.5) { 0.0 } else { random.uniform(-0.02, 0.02) } }
    }
}

#[derive(Clone, Debug)]
pub struct Rig {
    pub drive: Drive,
    /// Lead in mm (ball screw), gear ratio (rotary), 1 (linear).
    pub gearing: f64,
    pub pole_pairs: u32,
    /// Load units for one unit of q.
    pub unit: f64,
    pub inertia: f64,
    pub coulomb: f64,
    pub viscous: f64,
    pub constant: f64,
    pub limit: f64,
    pub servo: ServoGains,
    /// Encoder grid, load units.
    pub encoder_step: f64,
    /// Standard deviation of the logged torque's noise.
    pub torque_noise: f64,
    /// Grid of the logged torque; 0: none.
    pub torque_step: f64,
    pub table: Option<Scale>,
    /// Unit of the position columns, how many of it are a load unit, and the decimals that are written.
    pub column: (&'static str, f64, usize),
    pub reach: Reach,
    /// Moving average of the command, s.
    pub smoothing: f64,
    pub duration: f64,
    pub style: Style,
    /// The recorder keeps one servo cycle in so many.
    pub every: usize,
    pub rough: Rough,
}

impl Rig {
    /// Draws one whose recordings last 10 s to `longest` s.
    pub fn draw(random: &mut Random, longest: f64) -> Self {
        let drive = random.pick(&[Drive::BallScrew, Drive::BallScrew, Drive::Linear, Drive::Rotary]);
        let (gearing, unit) = match drive {
            Drive::BallScrew => {
                let lead = random.pick(&[2.0, 5.0, 10.0, 10.0, 12.0, 16.0, 20.0, 25.0, 40.0]);
                (lead, lead / TAU)
            }
            Drive::Linear => (1.0, 1000.0),
            Drive::Rotary => {
                let ratio = random.pick(&[1.0, 1.0, 5.0, 36.0, 60.0, 90.0, 120.0, 180.0]);
                (ratio, 360.0 / TAU / ratio)
            }
        };
        let (speed, acceleration, stroke, inertia) = match drive {
            Drive::BallScrew => (
                random.log_uniform(100.0, 500.0),
                random.log_uniform(1000.0, 5000.0),
                random.log_uniform(60.0, 1500.0),
                random.log_uniform(5e-5, 5e-2),
            ),
            Drive::Linear => (
                random.log_uniform(200.0, 1000.0),
                random.log_uniform(1500.0, 10_000.0),
                random.log_uniform(60.0, 2500.0),
                random.log_uniform(2.0, 3000.0),
            ),
            Drive::Rotary => (
                random.log_uniform(30.0, 180.0),
                random.log_uniform(100.0, 600.0),
                random.log_uniform(60.0, 360.0),
                if gearing == 1.0 { random.log_uniform(0.02, 20.0) } else { random.log_uniform(1e-4, 2e-2) },
            ),
        };
        let duration = random.log_uniform(10.0, longest);
        // A short run uses what part of the stroke it can cross.
        let stroke = f64::min(stroke, 0.12 * duration * speed);
        let accelerating = inertia * acceleration / unit;
        let coulomb = accelerating * random.log_uniform(0.06, 0.4);
        let viscous = coulomb * random.log_uniform(0.15, 1.5) / (speed / unit);
        let constant = if random.chance(0.5) { 0.0 } else { coulomb * random.uniform(-0.6, 0.6) };
        let limit = random.uniform(1.6, 3.0) * (accelerating + coulomb + viscous * speed / unit + constant.abs());

        let rate = random.pick(&[250.0, 500.0, 800.0, 1000.0, 1000.0, 1000.0, 2000.0, 2000.0, 4000.0, 8000.0]);
        let period = 1.0 / rate;
        let every = if rate >= 1000.0 && random.chance(0.2) { random.pick(&[2, 4]) } else { 1 };
        let lag = if random.chance(0.2) { 0.0 } else { random.log_uniform(2e-4, 1e-3) };
        let two_sample_mean = random.chance(0.25);
        // Half a period of hold, half of the difference (a whole of the mean), and the lag: the velocity loop keeps 60° of phase.
        let delay = period * if two_sample_mean { 1.5 } else { 1.0 } + lag;
        let bandwidth = TAU * random.log_uniform(15.0, 60.0);
        let bandwidth = bandwidth.min(0.35 / delay);
        let servo = ServoGains {
            period,
            position_gain: bandwidth * random.log_uniform(0.1, 0.3),
            velocity_gain: inertia * bandwidth,
            integral_time: if random.chance(0.75) { Some(random.uniform(3.5, 10.0) / bandwidth) } else { None },
            feedforward: random.pick(&[0.0, 1.0, 1.0, 1.0, 0.8]),
            lag,
            two_sample_mean,
        };
        let torque_noise = coulomb * random.log_uniform(0.01, 0.08);
        // The grid must not make the servo louder than the sensor noise: Kv·√2·step/√12/period ≤ noise.
        let loudest = torque_noise / servo.velocity_gain * unit * period * 6f64.sqrt();
        let grids = [1e-8, 2e-8, 5e-8, 1e-7, 2e-7, 5e-7, 1e-6, 2e-6, 5e-6, 1e-5, 2e-5, 5e-5, 1e-4, 2e-4, 5e-4];
        let fit: Vec<f64> = grids.iter().copied().filter(|g| *g <= loudest).collect();
        let encoder_step = if fit.is_empty() { grids[0] } else { random.pick(&fit[fit.len().saturating_sub(4)..]) };
        let torque_step = if random.chance(0.6) { 0.0 } else { torque_noise * random.log_uniform(0.2, 4.0) };
        let table = random.chance(0.4).then(|| Scale::draw(random));
        let column = if drive == Drive::Rotary {
            random.pick(&[("deg", 1.0, 8), ("deg", 1.0, 8), ("rad", TAU / 360.0, 10)])
        } else {
            random.pick(&[("mm", 1.0, 8), ("mm", 1.0, 8), ("mm", 1.0, 8), ("um", 1e3, 5), ("m", 1e-3, 11)])
        };
        let low = random.uniform(-0.5, 0.5) * stroke;
        let pole_pairs = random.pick(&[3, 4, 5]);
        let smoothing = if random.chance(0.5) { 0.0 } else { random.uniform(0.005, 0.04) };
        let style = random.pick(&[Style::Mixed, Style::Mixed, Style::Laps, Style::Stations, Style::Sweep]);
        Self {
            drive,
            gearing,
            pole_pairs,
            unit,
            inertia,
            coulomb,
            viscous,
            constant,
            limit,
            servo,
            encoder_step,
            torque_noise,
            torque_step,
            table,
            column,
            reach: Reach { low, high: low + style.share() * stroke, speed, acceleration },
            smoothing,
            duration,
            style,
            every,
            rough: Rough::NONE,
        }
    }

    /// Torque noise, the grid it is logged on, and what the encoder adds through the velocity loop: two errors of noise and grid.
    pub fn torque_floor(&self) -> f64 {
        let quantum = self.encoder_floor() * 2f64.sqrt() / self.servo.period / self.unit;
        let logged = self.torque_noise.hypot(self.torque_step / 12f64.sqrt());
        logged.hypot(self.servo.velocity_gain * quantum / if self.servo.two_sample_mean { 2.0 } else { 1.0 })
    }

    /// Noise of table − encoder, load units: both grids and the scale's own noise.
    pub fn table_floor(&self) -> f64 {
        let scale = self.table.map_or(0.0, |s| s.noise * s.noise + s.step * s.step / 12.0);
        scale.sqrt().hypot(self.encoder_floor())
    }

    /// Noise of the encoder with its grid, load units.
    pub fn encoder_floor(&self) -> f64 {
        self.rough.encoder_noise.hypot(self.encoder_step / 12f64.sqrt())
    }

    pub fn linear(&self) -> bool {
        self.drive == Drive::Linear
    }

    /// A key of the files in this drive's unit: torque keys say `_n` where the others say `_nm`.
    pub fn key(&self, key: &str) -> String {
        match (self.linear(), key) {
            (true, "inertia_kg_m2") => "mass_kg".into(),
            (true, _) => key.replace("_nm", "_n"),
            (false, _) => key.into(),
        }
    }

    /// The machine file of the belief, extended by `effects` (empty: the base file).
    pub fn machine_file(&self, name: &str, effects: Vec<Value>) -> Value {
        let s = &self.servo;
        let mut servo = json!({ "period_s": s.period, "position_gain_1_s": s.position_gain,
            "velocity_feedforward": s.feedforward });
        let velocity_gain = if self.linear() { "velocity_gain_n_s_m" } else { "velocity_gain_nm_s" };
        servo[velocity_gain] = json!(s.velocity_gain);
        if let Some(ti) = s.integral_time {
            servo["velocity_integral_time_s"] = json!(ti);
        }
        if s.lag > 0.0 {
            servo["torque_time_constant_s"] = json!(s.lag);
        }
        if s.two_sample_mean {
            servo["velocity_estimate"] = json!("two_sample_mean");
        }
        let mut axis = json!({ "name": "x" });
        match self.drive {
            Drive::BallScrew => {
                axis["drive"] = json!("ball_screw");
                axis["lead_mm"] = json!(self.gearing);
                axis["motor_pole_pairs"] = json!(self.pole_pairs);
            }
            Drive::Linear => axis["drive"] = json!("linear"),
            Drive::Rotary => {
                axis["drive"] = json!("rotary");
                axis["ratio"] = json!(self.gearing);
            }
        }
        let keys = if self.linear() {
            ["mass_kg", "coulomb_friction_n", "viscous_friction_n_s_m", "constant_force_n", "force_limit_n"]
        } else {
            ["inertia_kg_m2", "coulomb_friction_nm", "viscous_friction_nm_s", "constant_torque_nm", "torque_limit_nm"]
        };
        for (key, value) in keys.into_iter().zip([self.inertia, self.coulomb, self.viscous, self.constant, self.limit])
        {
            axis[key] = json!(value);
        }
        axis["servo"] = servo;
        if !effects.is_empty() {
            axis["effects"] = Value::Array(effects);
        }
        json!({ "schema": "gib.machine/1", "name": name, "axes": [axis] })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drawn_rigs_are_machines_that_can_run() {
        for stream in 0..500 {
            let r = Rig::draw(&mut Random::new(3, stream), 60.0);
            let loop_gain = r.servo.velocity_gain / r.inertia * (r.servo.period + r.servo.lag);
            assert!(loop_gain < 0.4, "stream {stream}: velocity loop {loop_gain}");
            assert!(r.servo.position_gain < 0.35 * r.servo.velocity_gain / r.inertia);
            let need = r.inertia * r.reach.acceleration / r.unit + r.coulomb + r.viscous * r.reach.speed / r.unit;
            assert!(need + r.constant.abs() < 0.7 * r.limit, "stream {stream}: {need} of {}", r.limit);
            let logged = r.torque_noise.hypot(r.torque_step / 12f64.sqrt());
            assert!(r.torque_floor() < 1.5 * logged, "stream {stream}: the grid is louder than the sensor");
        }
    }

    #[test]
    fn one_motor_turn_of_a_ball_screw_is_its_lead() {
        let rig =
            (0..99).map(|s| Rig::draw(&mut Random::new(1, s), 60.0)).find(|r| r.drive == Drive::BallScrew).unwrap();
        assert!((rig.unit * TAU - rig.gearing).abs() < 1e-12);
    }
}
