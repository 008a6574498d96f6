//! Lost motion estimated from torque, on drives whose lost motion is known because this file makes them.
//!
//! The generator is quasi-static and shares nothing with the fit: a motor with friction of its own, a clearance, a spring, and
//! a table that sticks until the spring exceeds its break-away friction and then slides. The truth is read off the table:
//! the change of (motor − table) between sliding one way and the other.

#[path = "support/random.rs"]
mod random;

use std::f64::consts::TAU;
use std::process::Command;

use gib::analysis::lost_motion::Refusal;
use gib::analysis::lost_motion::from_torque::{MotorFriction, estimate};
use gib::machine::Machine;
use gib::recording::{Column, Recording};
use random::Random;

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
    /// Torque of the motor's oil and bearings at 1 mm/s: it winds nothing up.
    viscous_nm_s_mm: f64,
    /// True when the motor goes back and forth by a quarter of the lost motion after each reversal.
    probe: bool,
    /// True when the motor rebounds twice from the far side of the clearance.
    rebounds: bool,
    /// True when the motor is fifty times slower until the table slides.
    runs_off: bool,
    /// True when the motor gets on by fits and starts.
    hunts: bool,
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
            viscous_nm_s_mm: 0.0,
            probe: false,
            rebounds: false,
            runs_off: false,
            hunts: false,
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
                // Twenty rows from one stop to the next, or none.
                let lag = if self.hunts { 20.0 / TAU * (TAU * i as f64 / 20.0).sin() } else { 0.0 };
                path.push(start + way.signum() * (i as f64 - lag) * step);
            }
        };
        for sweep in 0..=self.reversals {
            let direction = if sweep % 2 == 0 { 1.0 } else { -1.0 };
            if self.rebounds && sweep > 0 {
                go(&mut path, direction * (0.6 * self.windup_um + self.clearance_um), step);
                for share in [0.5, 0.3] {
                    go(&mut path, -direction * share * self.clearance_um, 2.0 * step);
                    go(&mut path, direction * share * self.clearance_um, 2.0 * step);
                }
            }
            if self.runs_off && sweep > 0 {
                go(&mut path, direction * (lost - 0.5 * self.windup_um * self.released), 0.02 * step);
            }
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
            let speed_mm_s = 1e-3 * (motor - last) * self.rate_hz;
            last = motor;
            let motor_side = self.motor_friction_nm * sense + self.viscous_nm_s_mm * speed_mm_s;
            let reading = spring(motor - table) + motor_side + self.constant_nm;
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
    tally_against(name, seed, count, source, change, |_, truth| truth)
}

/// Asks for the lost motion of random drives; `truth_of` may put another truth in the place of the table's.
fn tally_against(
    name: &str,
    seed: u64,
    count: usize,
    source: MotorFriction,
    change: impl Fn(&mut Drive),
    truth_of: impl Fn(&Drive, f64) -> f64,
) -> Tally {
    let mut random = Random(seed);
    let mut tally = Tally { errors: Vec::new(), covered: 0, refused: 0, seen: 0 };
    for number in 0..count {
        let mut drive = Drive::random(&mut random);
        change(&mut drive);
        let (recording, truth) = drive.record(&mut random);
        let truth = truth_of(&drive, truth);
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
    /// What is wrong; empty when all is well.
    fn faults(&self, coverage: std::ops::RangeInclusive<f64>, bias: f64) -> Vec<&'static str> {
        let n = self.errors.len() as f64;
        let all = [
            ("coverage", !coverage.contains(&(self.covered as f64 / n))),
            ("bias", (self.errors.iter().sum::<f64>() / n).abs() >= bias),
            ("refused", self.refused * 20 > self.errors.len()),
            ("motor friction found otherwise", self.seen * 10 < self.errors.len() * 9),
        ];
        all.into_iter().filter_map(|(what, wrong)| wrong.then_some(what)).collect()
    }

    fn check(&self, coverage: std::ops::RangeInclusive<f64>, bias: f64) {
        assert_eq!(self.faults(coverage, bias), Vec::<&str>::new());
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

/// A way back that turns no friction round does not end a sweep: neither one from the far side of the clearance nor a probe.
#[test]
fn rebounds_do_not_cut_a_sweep() {
    for probe in [false, true] {
        let source = if probe { MotorFriction::Probe } else { MotorFriction::Clearance };
        let tally = tally("rebounds", 46, 150, source, |drive| {
            drive.rebounds = true;
            drive.probe = probe;
        });
        tally.check(0.90..=1.0, 0.02);
    }
}

/// Hardly any rows are at one speed then.
#[test]
fn an_axis_that_moves_by_fits_and_starts_slides() {
    tally("hunts", 47, 150, MotorFriction::Clearance, |drive| {
        let lost_um = drive.clearance_um + drive.windup_um;
        (drive.stroke_um, drive.speed_um_s, drive.rate_hz) = (8.0 * lost_um, 10.0 * lost_um, 400.0);
        drive.hunts = true;
    })
    .check(0.90..=1.0, 0.03);
}

/// One pass each way has no scatter to learn from.
#[test]
fn one_reversal_is_enough() {
    tally("one reversal", 48, 150, MotorFriction::Clearance, |drive| drive.reversals = 1).check(0.90..=1.0, 0.02);
}

/// A weak servo winds the drive up slowly and catches up once the table slides: what calms the noise must not reach far into
/// that. Where hardly a row is left of the last bend some curves seem to bend early; what that takes off is in the uncertainty.
#[test]
fn a_motor_may_run_off_once_the_table_slides() {
    tally("runs off", 49, 150, MotorFriction::Clearance, |drive| {
        drive.speed_um_s = 50.0 * (drive.clearance_um + drive.windup_um);
        (drive.rate_hz, drive.runs_off) = (250.0, true);
    })
    .check(0.90..=1.0, 0.2);
}

/// The gate itself: a generator whose motor friction winds the drive up as well (the truth that a fit blind to it would
/// give) must be caught by bias and by coverage.
#[test]
fn a_truth_that_takes_motor_friction_for_windup_is_caught() {
    let blind = |drive: &Drive, truth: f64| truth + drive.windup_um * drive.motor_friction_nm / drive.table_friction_nm;
    let tally = tally_against("seeded fault", 41, 60, MotorFriction::Clearance, |_| (), blind);
    assert_eq!(tally.faults(0.90..=1.0, 0.02), ["coverage", "bias"]);
}

/// Viscous torque of the motor is in the sliding levels and winds nothing up. A machine file that knows it takes it off;
/// one that is wrong about it, by as much, spoils the result.
#[test]
fn a_machine_file_takes_viscous_friction_off() {
    const SEED: u64 = 44;
    println!("seed {SEED}");
    let mut random = Random(SEED);
    let (mut with, mut without, mut covered) = (Vec::new(), Vec::new(), 0);
    for _ in 0..40 {
        let mut drive = Drive::random(&mut random);
        // A tenth of the table's friction at the speed of the sweeps.
        drive.viscous_nm_s_mm = 0.1 * drive.table_friction_nm / (1e-3 * drive.speed_um_s);
        let (recording, truth) = drive.record(&mut random);
        // 10 mm of lead: 1 mm/s is 2π/10 rad/s.
        let viscous = drive.viscous_nm_s_mm * 10.0 / TAU;
        let machine = Machine::parse(&format!(
            r#"{{"schema": "gib.machine/1", "name": "made", "axes": [{{"name": "x", "drive": "ball_screw", "lead_mm": 10.0,
                "inertia_kg_m2": 1e-9, "coulomb_friction_nm": {}, "viscous_friction_nm_s": {viscous}}}]}}"#,
            drive.table_friction_nm
        ))
        .unwrap();
        let Ok(known) = estimate(&recording, "x", machine.axis("x")) else { continue };
        let value = known.mean.lost_motion;
        with.push((1e3 * value.value / truth - 1.0).abs());
        covered += usize::from((1e3 * value.value - truth).abs() <= 1e3 * value.uncertainty);
        if let Ok(unknown) = estimate(&recording, "x", None) {
            without.push((1e3 * unknown.mean.lost_motion.value / truth - 1.0).abs());
        }
    }
    let median = |errors: &mut Vec<f64>| {
        errors.sort_by(f64::total_cmp);
        errors[errors.len() / 2]
    };
    println!("{} estimated, {covered} covered", with.len());
    let (with, without) = (median(&mut with), median(&mut without));
    println!("median error {:.2} % with the machine file, {:.2} % without", 100.0 * with, 100.0 * without);
    assert!(covered >= 34 && with < 0.02 && without > 2.0 * with);
}

/// Test moves are slow and fast. In the fast ones the torque also moves masses: they are set aside, also where the model takes
/// most of that off. The truth is what the simulated table lost.
#[test]
fn fast_reversals_beside_slow_ones_do_not_spoil_them() {
    let folder = tempfile::tempdir().unwrap();
    let [machine, recording] = ["m.json", "r.csv"].map(|name| folder.path().join(name));
    std::fs::write(
        &machine,
        r#"{"schema": "gib.machine/1", "name": "made", "axes": [{"name": "x", "drive": "ball_screw", "lead_mm": 10.0,
            "inertia_kg_m2": 0.0028, "coulomb_friction_nm": 0.9, "viscous_friction_nm_s": 0.008, "torque_limit_nm": 16.0,
            "servo": {"period_s": 0.001, "position_gain_1_s": 40.0, "velocity_gain_nm_s": 0.528,
                      "velocity_integral_time_s": 0.02, "velocity_feedforward": 1.0, "torque_time_constant_s": 0.0005},
            "effects": [{"cause": "backlash", "parameters": {"backlash_um": 20.0}},
                        {"cause": "drive_compliance", "parameters": {"resonance_hz": 120.0, "stiffness_n_um": 90.0}}]}]}"#,
    )
    .unwrap();
    let gib = |words: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_gib"));
        let command = command.current_dir(folder.path()).args(words.split(' '));
        let output = command.output().unwrap();
        assert!(output.status.success(), "{words}: {}", String::from_utf8_lossy(&output.stderr));
        output.stdout
    };
    gib("simulate --machine m.json --moves test --torque-noise 0.02 --out r.csv");
    let lost = |from: &str| {
        let words = format!("lost-motion r.csv --machine m.json --method {from} --json");
        let answer: serde_json::Value = serde_json::from_slice(&gib(&words)).unwrap();
        ["lost_motion_um", "uncertainty_um"].map(|key| answer[key].as_f64().unwrap())
    };
    assert!(recording.exists());
    let ([truth, _], [value, uncertainty]) = (lost("positions"), lost("torque"));
    println!("the table lost {truth:.2} µm; from torque {value:.2} ± {uncertainty:.2} µm");
    assert!((value - truth).abs() < uncertainty && uncertainty < 0.08 * truth);
}

#[test]
fn refuses_by_name() {
    let mut random = Random(7);
    let drive = Drive::random(&mut random);
    let (one_way, _) = Drive { reversals: 0, released: 0.0, ..drive.clone() }.record(&mut random);
    assert_eq!(estimate(&one_way, "x", None), Err(Refusal::NoReversal));
    let (noise, _) = Drive { noise_nm: 30.0 * drive.table_friction_nm, ..drive }.record(&mut random);
    let refused = estimate(&noise, "x", None).unwrap_err();
    assert!(matches!(refused, Refusal::SameEffort(_)), "{refused}");

    let (whole, _) = Drive { released: 0.0, reversals: 4, ..Drive::random(&mut random) }.record(&mut random);
    let [position, torque] = ["position", "torque"].map(|signal| {
        let found = whole.columns.iter().find(|column| column.name.contains(signal)).unwrap();
        found.values.clone()
    });
    let refused = |position: &[f64], torque: &[f64], every: usize| {
        let of = |values: &[f64]| values.iter().copied().step_by(every).collect::<Vec<f64>>();
        let columns = vec![Column::new("x.position_mm", of(position)), Column::new("x.torque_nm", of(torque))];
        let made = Recording::from_columns("made.csv", of(&whole.time_s), columns).unwrap();
        estimate(&made, "x", None).unwrap_err()
    };
    let turned: Vec<f64> = torque.iter().map(|t| -t).collect();
    assert!(matches!(refused(&position, &turned, 1), Refusal::SignTurned(_)));
    assert!(matches!(refused(&position, &vec![1.0; torque.len()], 1), Refusal::SameEffort(_)));
    assert!(matches!(refused(&position, &torque, 200), Refusal::NotSteady { .. }));
    // To and fro without rest: toward each end the effort stops the mass, and is no friction of the wrong sign.
    let swings = |of: fn(f64) -> f64| (0..whole.time_s.len()).map(|i| of(i as f64 / 500.0)).collect::<Vec<f64>>();
    let (position, torque) = (swings(|t| -t.cos()), swings(|t| 0.2 * t.sin().signum() + t.cos()));
    assert!(matches!(refused(&position, &torque, 1), Refusal::Braking(_)));
}

/// Rows that are missing one by one, or without a number, do not cut a recording: a reversal cannot hide in them.
#[test]
fn single_rows_may_be_missing() {
    const SEED: u64 = 50;
    println!("seed {SEED}");
    let mut random = Random(SEED);
    let (mut recording, truth) = Drive::random(&mut random).record(&mut random);
    let whole = estimate(&recording, "x", None).unwrap();
    for column in &mut recording.columns {
        column.values.iter_mut().filter(|_| random.next() < 0.02).for_each(|value| *value = f64::NAN);
    }
    let holed = estimate(&recording, "x", None).unwrap();
    let value = |found: &gib::analysis::lost_motion::from_torque::TorqueLostMotion| found.mean.lost_motion;
    assert_eq!(whole.reversals.len(), holed.reversals.len());
    assert!((1e3 * value(&holed).value - truth).abs() < 1e3 * value(&holed).uncertainty);
    assert!((value(&holed).value - value(&whole).value).abs() < value(&whole).uncertainty);
}
