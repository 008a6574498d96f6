//! Lost motion estimated from torque, on drives whose lost motion is known because this file makes them.
//!
//! The generator is quasi-static and shares nothing with the fit: a motor with friction of its own, a clearance, a spring, and
//! a table that sticks until the spring exceeds its break-away friction and then slides. The truth is read off the table:
//! the change of (motor − table) between sliding one way and the other.

use std::f64::consts::TAU;

use gib::analysis::lost_motion::Refusal;
use gib::analysis::lost_motion::from_torque::{MotorFriction, estimate};
use gib::recording::{Column, Recording};

/// SplitMix64 (Steele, Lea, Flood 2014).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }

    fn normal(&mut self) -> f64 {
        (-2.0 * (1.0 - self.next()).ln()).sqrt() * (TAU * self.next()).cos()
    }
}

/// A drive and a move; µm, N·m, s.
#[derive(Debug, Clone)]
struct Drive {
    clearance_um: f64,
    windup_um: f64,
    table_friction_nm: f64,
    motor_friction_nm: f64,
    break_away: f64,
    constant_nm: f64,
    noise_nm: f64,
    grid_um: f64,
    speed_um_s: f64,
    stroke_um: f64,
    reversals: usize,
    rate_hz: f64,
    /// Share of the wind-up released while the axis rests at a reversal.
    released: f64,
    /// True when the motor goes back and forth by a quarter of the lost motion after each reversal.
    probe: bool,
}

impl Drive {
    fn random(random: &mut Random) -> Self {
        let lost_um = random.between(10.0, 60.0);
        let clearance_share = random.between(0.25, 0.7);
        let friction_nm = random.between(0.5, 3.0);
        let motor_share = random.between(0.0, 0.4);
        Self {
            clearance_um: lost_um * clearance_share,
            windup_um: lost_um * (1.0 - clearance_share),
            table_friction_nm: friction_nm * (1.0 - motor_share),
            motor_friction_nm: friction_nm * motor_share,
            break_away: random.between(1.0, 1.15),
            constant_nm: random.between(-0.5, 0.5),
            noise_nm: friction_nm * random.between(0.01, 0.06),
            grid_um: random.between(0.05, 0.5),
            speed_um_s: lost_um * random.between(5.0, 20.0),
            stroke_um: lost_um * random.between(20.0, 60.0),
            reversals: 2 + (random.next() * 6.0) as usize,
            rate_hz: 1_000.0,
            released: random.between(0.0, 0.5),
            probe: false,
        }
    }

    /// Motor positions in time.
    fn path(&self) -> Vec<f64> {
        let step = self.speed_um_s / self.rate_hz;
        let lost = self.clearance_um + self.windup_um;
        let mut path = vec![0.0];
        let go = |path: &mut Vec<f64>, way: f64, step: f64| {
            let start = path[path.len() - 1];
            for i in 1..=(way.abs() / step) as usize {
                path.push(start + way.signum() * i as f64 * step);
            }
        };
        for sweep in 0..=self.reversals {
            let direction = if sweep % 2 == 0 { 1.0 } else { -1.0 };
            if self.probe && sweep > 0 {
                go(&mut path, direction * 3.0 * lost, step);
                go(&mut path, -direction * 0.25 * lost, 0.2 * step);
                go(&mut path, direction * 0.25 * lost, 0.2 * step);
            }
            go(&mut path, direction * self.stroke_um, step);
            // At rest the servo gives way to the spring.
            go(&mut path, -direction * 0.5 * self.windup_um * self.released, step);
            let rest = path[path.len() - 1];
            path.extend(std::iter::repeat_n(rest, 200));
        }
        path
    }

    /// The recording, and the lost motion seen at the table, µm.
    fn record(&self, random: &mut Random) -> (Recording, f64) {
        let stiffness = 2.0 * self.table_friction_nm / self.windup_um;
        let half = 0.5 * self.clearance_um;
        let spring = |stretch: f64| stiffness * (stretch - stretch.clamp(-half, half));
        let (mut table, mut sliding) = (0.0, false);
        let (mut time, mut position, mut torque) = (Vec::new(), Vec::new(), Vec::new());
        let mut sense = 0.0;
        let mut stretched = [0.0f64; 2];
        let mut last = 0.0;
        for (i, motor) in self.path().into_iter().enumerate() {
            let limit = self.table_friction_nm * if sliding { 1.0 } else { self.break_away };
            let pull = spring(motor - table);
            sliding = pull.abs() > limit;
            if sliding {
                let stretch = pull.signum() * (half + self.table_friction_nm / stiffness);
                table = motor - stretch;
                stretched[usize::from(stretch > 0.0)] = stretch;
            } else if motor != last {
                // Once it slides it goes on as long as the motor does.
                sliding =
                    pull.abs() >= self.table_friction_nm * (1.0 - 1e-9) && (motor - last).signum() == pull.signum();
            }
            if motor != last {
                sense = (motor - last).signum();
            }
            last = motor;
            let reading = spring(motor - table) + self.motor_friction_nm * sense + self.constant_nm;
            time.push(i as f64 / self.rate_hz);
            position.push(1e-3 * (motor / self.grid_um).round() * self.grid_um);
            torque.push(reading + self.noise_nm * random.normal());
        }
        let columns = vec![Column::new("x.position_mm", position), Column::new("x.torque_nm", torque)];
        (Recording::from_columns("made.csv", time, columns).unwrap(), stretched[1] - stretched[0])
    }
}

struct Tally {
    errors: Vec<f64>,
    covered: usize,
    refused: usize,
    /// Cases in which the motor's friction was found as expected.
    seen: usize,
}

fn tally(name: &str, seed: u64, count: usize, source: MotorFriction, change: impl Fn(&mut Drive)) -> Tally {
    let mut random = Random(seed);
    let mut tally = Tally { errors: Vec::new(), covered: 0, refused: 0, seen: 0 };
    for number in 0..count {
        let mut drive = Drive::random(&mut random);
        change(&mut drive);
        let (recording, truth) = drive.record(&mut random);
        match estimate(&recording, "x", None) {
            Ok(found) => {
                tally.seen += usize::from(found.motor_friction == source);
                let value = found.mean.lost_motion;
                let error = 1e3 * value.value - truth;
                tally.errors.push(error / truth);
                tally.covered += usize::from(error.abs() <= 1e3 * value.uncertainty);
                if error.abs() > 2e3 * value.uncertainty {
                    println!(
                        "case {number}: {:.2} ± {:.2} for {truth:.2} µm: {drive:?}",
                        1e3 * value.value,
                        1e3 * value.uncertainty
                    );
                }
            }
            Err(why) => {
                tally.refused += 1;
                println!("case {number}: {why}: {drive:?}");
            }
        }
    }
    let n = tally.errors.len() as f64;
    println!(
        "{name}, seed {seed}: {n} estimated, {} refused, covered {:.1} %, bias {:+.2} %",
        tally.refused,
        100.0 * tally.covered as f64 / n,
        100.0 * tally.errors.iter().sum::<f64>() / n
    );
    tally
}

impl Tally {
    fn check(&self, coverage: std::ops::RangeInclusive<f64>, bias: f64) {
        let n = self.errors.len() as f64;
        assert!(coverage.contains(&(self.covered as f64 / n)));
        assert!((self.errors.iter().sum::<f64>() / n).abs() < bias);
        assert!(self.refused * 20 <= self.errors.len());
        assert!(self.seen * 10 >= self.errors.len() * 9, "motor friction found as expected in {}", self.seen);
    }
}

#[test]
fn a_clearance_shows_the_motor_friction() {
    tally("clearance", 41, 150, MotorFriction::Clearance, |_| ()).check(0.90..=1.0, 0.02);
}

#[test]
fn going_back_and_forth_shows_it_too() {
    tally("probe", 42, 150, MotorFriction::Probe, |drive| {
        drive.probe = true;
        drive.windup_um += 0.8 * drive.clearance_um;
        drive.clearance_um *= 0.2;
    })
    .check(0.90..=1.0, 0.02);
}

#[test]
fn without_either_the_uncertainty_says_so() {
    tally("neither", 43, 150, MotorFriction::Assumed, |drive| {
        drive.windup_um += 0.98 * drive.clearance_um;
        drive.clearance_um *= 0.02;
    })
    .check(0.90..=1.0, 0.05);
}

#[test]
fn refuses_by_name() {
    let mut random = Random(7);
    let drive = Drive::random(&mut random);
    let (one_way, _) = Drive { reversals: 0, released: 0.0, ..drive.clone() }.record(&mut random);
    assert_eq!(estimate(&one_way, "x", None), Err(Refusal::NoReversal));
    let (noise, _) = Drive { noise_nm: 30.0 * drive.table_friction_nm, ..drive }.record(&mut random);
    let refused = estimate(&noise, "x", None).unwrap_err();
    assert!(matches!(refused, Refusal::NoCurve(_)), "{refused}");
}
