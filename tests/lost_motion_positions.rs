//! Lost motion from two positions, on axes whose lost motion is known because this file makes them.
//!
//! The generator shares nothing with the analysis: the table follows the motor through a sum of play operators (Prandtl and
//! Ishlinskii), which loses exactly the weighted sum of their widths at every reversal; then come the scale error, the
//! periodic errors of both encoders, drift, a late reading, noise and the grids.

#[path = "support/random.rs"]
mod random;

use std::f64::consts::TAU;

use gib::analysis::lost_motion::Refusal;
use gib::analysis::lost_motion::from_positions::measure;
use gib::recording::{Column, Recording};
use random::Random;

/// An axis and a move, in µm and s.
#[derive(Debug, Clone)]
struct Case {
    lost_um: f64,
    /// Share of the lost motion that is lost over more travel than itself, as drive and friction wind up.
    soft_share: f64,
    soft_factor: f64,
    stroke_um: f64,
    speed_um_s: f64,
    ramp_s: f64,
    dwell_s: f64,
    reversals: usize,
    rate_hz: f64,
    noise_um: f64,
    motor_grid_um: f64,
    table_grid_um: f64,
    scale: f64,
    periodic_um: [f64; 2],
    period_um: [f64; 2],
    drift_um_s: f64,
    late_rows: f64,
}

impl Case {
    fn plain() -> Self {
        Self {
            lost_um: 20.0,
            soft_share: 0.3,
            soft_factor: 3.0,
            stroke_um: 5_000.0,
            speed_um_s: 2_000.0,
            ramp_s: 0.1,
            dwell_s: 0.2,
            reversals: 4,
            rate_hz: 500.0,
            noise_um: 0.2,
            motor_grid_um: 0.1,
            table_grid_um: 0.1,
            scale: 0.0,
            periodic_um: [0.0; 2],
            period_um: [1_000.0; 2],
            drift_um_s: 0.0,
            late_rows: 0.0,
        }
    }

    fn random(random: &mut Random) -> Self {
        let lost_um = random.scale(2.0, 80.0);
        let stroke_um = lost_um * random.scale(25.0, 2_000.0);
        let sweep_s = random.between(0.8, 5.0);
        let reversals = 1 + (random.next() * 9.0) as usize;
        Self {
            lost_um,
            soft_share: random.between(0.0, 0.6),
            soft_factor: random.between(1.5, 5.0),
            stroke_um,
            speed_um_s: stroke_um / sweep_s,
            ramp_s: random.between(0.02, 0.4) * sweep_s,
            dwell_s: random.between(0.0, 0.5),
            reversals,
            rate_hz: random.scale(100.0, 2_000.0),
            noise_um: lost_um * random.scale(0.003, 0.1),
            motor_grid_um: lost_um * random.scale(0.001, 0.2),
            table_grid_um: lost_um * random.scale(0.001, 0.2),
            scale: random.between(-1e-3, 1e-3),
            periodic_um: [lost_um * random.between(0.0, 0.5), lost_um * random.between(0.0, 0.5)],
            period_um: [stroke_um / random.between(0.3, 6.0), stroke_um / random.between(0.3, 6.0)]
                .map(|period| period.max(40.0 * lost_um)),
            // One sense alone cannot tell drift from lost motion.
            drift_um_s: if reversals > 2 { lost_um * random.between(-0.01, 0.01) } else { 0.0 },
            late_rows: random.normal(),
        }
    }

    fn recording(&self, random: &mut Random) -> Recording {
        const FINE: usize = 4;
        let step_s = 1.0 / (self.rate_hz * FINE as f64);
        let motor = self.motor(step_s);
        let table = self.table(&motor);
        let at = |values: &[f64], index: f64| {
            let index = index.clamp(0.0, (values.len() - 1) as f64);
            let (low, share) = (index.floor() as usize, index.fract());
            values[low] + share * (values[(low + 1).min(values.len() - 1)] - values[low])
        };
        let grid = |value: f64, grid: f64| (value / grid).round() * grid;
        let (mut time, mut read_motor, mut read_table) = (Vec::new(), Vec::new(), Vec::new());
        let phase = [random.next(), random.next()];
        for row in 0..motor.len() / FINE {
            let t = row as f64 / self.rate_hz;
            let (m, q) = (at(&motor, (row * FINE) as f64), at(&table, (row as f64 - self.late_rows) * FINE as f64));
            let wave = |i: usize, x: f64| self.periodic_um[i] * (TAU * (x / self.period_um[i] + phase[i])).sin();
            time.push(t);
            read_motor.push(1e-3 * grid(m + wave(0, m) + self.noise_um * random.normal(), self.motor_grid_um));
            let table = q * (1.0 + self.scale) + wave(1, q) + self.drift_um_s * t + self.noise_um * random.normal();
            read_table.push(1e-3 * grid(table, self.table_grid_um));
        }
        let columns = vec![Column::new("x.position_mm", read_motor), Column::new("x.table_position_mm", read_table)];
        Recording::from_columns("made.csv", time, columns).unwrap()
    }

    /// Trapezoidal speed there and back, dwelling at each end.
    fn motor(&self, step_s: f64) -> Vec<f64> {
        let mut path = vec![0.0];
        let mut x = 0.0;
        let cruise_s = (self.stroke_um / self.speed_um_s - self.ramp_s).max(0.0);
        for sweep in 0..=self.reversals {
            let direction = if sweep % 2 == 0 { 1.0 } else { -1.0 };
            let mut t = 0.0;
            while t < 2.0 * self.ramp_s + cruise_s {
                let speed = (t / self.ramp_s).min((2.0 * self.ramp_s + cruise_s - t) / self.ramp_s).clamp(0.0, 1.0);
                x += direction * speed * self.speed_um_s * step_s;
                path.push(x);
                t += step_s;
            }
            path.extend(std::iter::repeat_n(x, (self.dwell_s / step_s) as usize));
        }
        path
    }

    fn table(&self, motor: &[f64]) -> Vec<f64> {
        // Widths and shares: one hard play, three that make a soft approach.
        let mut plays: Vec<(f64, f64, f64)> = vec![(self.lost_um, 1.0 - self.soft_share, 0.0)];
        for k in 1..=3 {
            plays.push((self.lost_um * (1.0 + (self.soft_factor - 1.0) * f64::from(k) / 3.0), 0.0, 0.0));
        }
        // Each play of width w and weight g loses g·w; the weights add up to the soft share of the lost motion.
        let softness: f64 = plays[1..].iter().map(|p| p.0).sum();
        for play in &mut plays[1..] {
            play.1 = self.soft_share * self.lost_um / softness;
        }
        let rigid = 1.0 - plays.iter().map(|p| p.1).sum::<f64>();
        motor
            .iter()
            .map(|&x| {
                let follow = plays.iter_mut().map(|(width, weight, state)| {
                    *state = state.clamp(x - *width / 2.0, x + *width / 2.0);
                    *weight * *state
                });
                rigid * x + follow.sum::<f64>()
            })
            .collect()
    }
}

/// What a set of cases gave: errors and uncertainties, both in shares of the lost motion.
struct Tally {
    results: Vec<(f64, f64)>,
    refused: usize,
}

impl Tally {
    fn of(name: &str, seed: u64, count: usize, make: impl Fn(&mut Random) -> Case) -> Self {
        let mut random = Random(seed);
        let mut tally = Tally { results: Vec::new(), refused: 0 };
        for number in 0..count {
            let case = make(&mut random);
            match measure(&case.recording(&mut random), "x") {
                Ok(found) => {
                    let (value, uncertainty) = (1e3 * found.lost_motion.value, 1e3 * found.lost_motion.uncertainty);
                    let error = value - case.lost_um;
                    tally.results.push((error / case.lost_um, uncertainty / case.lost_um));
                    if error.abs() > 2.0 * uncertainty {
                        println!("case {number}: {value:.3} ± {uncertainty:.3} µm for {case:?}");
                    }
                }
                Err(why) => {
                    tally.refused += 1;
                    println!("case {number}: {why} for {case:?}");
                }
            }
        }
        println!(
            "{name}, seed {seed}: {} measured, {} refused, covered {:.1} %, error median {:+.2} %, over uncertainty {:+.3}, \
             uncertainty median {:.2} %",
            tally.results.len(),
            tally.refused,
            100.0 * tally.coverage(),
            100.0 * tally.median(|r| r.0),
            tally.lean(),
            100.0 * tally.median(|r| r.1),
        );
        tally
    }

    fn coverage(&self) -> f64 {
        self.results.iter().filter(|(error, uncertainty)| error.abs() <= *uncertainty).count() as f64
            / self.results.len() as f64
    }

    fn median(&self, of: impl Fn(&(f64, f64)) -> f64) -> f64 {
        let mut values: Vec<f64> = self.results.iter().map(of).collect();
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    }

    /// Mean of error over uncertainty: how far the values lean to one side.
    fn lean(&self) -> f64 {
        self.results.iter().map(|(error, uncertainty)| error / uncertainty).sum::<f64>() / self.results.len() as f64
    }
}

#[test]
fn slow_motion_is_measured_well() {
    let tally = Tally::of("slow motion", 20_260_917, 150, |random| {
        let mut case = Case::random(random);
        // A fiftieth of the lost motion in a row: a delay of a row does little.
        case.speed_um_s = 0.02 * case.lost_um * case.rate_hz;
        case.stroke_um = case.lost_um * random.scale(25.0, 60.0);
        case.ramp_s = random.between(0.02, 0.4) * case.stroke_um / case.speed_um_s;
        case.drift_um_s = 0.0;
        case
    });
    assert!((0.90..=0.99).contains(&tally.coverage()));
    assert!(tally.median(|r| r.0).abs() < 0.02 && tally.lean().abs() < 0.2);
    assert!((0.003..0.1).contains(&tally.median(|r| r.1)));
    assert_eq!(tally.refused, 0);
}

#[test]
fn fast_motion_read_late_is_measured_honestly() {
    let tally = Tally::of("fast motion read late", 20_260_918, 150, Case::random);
    assert!((0.90..=0.99).contains(&tally.coverage()));
    assert!(tally.median(|r| r.0).abs() < 0.03 && tally.lean().abs() < 0.2);
    assert!(tally.median(|r| r.1) < 0.6);
    assert!(tally.refused <= 6);
}

#[test]
fn nothing_lost_is_measured_as_nothing() {
    let mut random = Random(5);
    let case = Case { lost_um: 1e-6, ..Case::plain() };
    let found = measure(&case.recording(&mut random), "x").unwrap();
    assert!(found.lost_motion.value.abs() <= found.lost_motion.uncertainty, "{:?}", found.lost_motion);
    assert!(!found.significant);
}

#[test]
fn refuses_by_name() {
    let mut random = Random(6);
    let one_way = Case { reversals: 0, ..Case::plain() };
    assert_eq!(measure(&one_way.recording(&mut random), "x"), Err(Refusal::NoReversal));
    // The stroke is shorter than what is lost: the table never moves, and that must not read as nothing lost.
    let short = Case { stroke_um: 15.0, speed_um_s: 5.0, soft_share: 0.0, noise_um: 0.01, ..Case::plain() };
    let refused = measure(&short.recording(&mut random), "x").unwrap_err();
    assert!(matches!(refused, Refusal::NoUsableReversal { .. }), "{refused}");
}

/// A real rotary axis, stepper against a scale on the load, one reversal before and one after a collision. Its owners put the
/// lost motion at about 0.010° and 0.031°; along the stroke it differs by more than 0.002°, so the third digit is open.
#[test]
fn a_real_axis_before_and_after_a_collision() {
    let data =
        std::env::var("GIB_DATA").unwrap_or_else(|_| concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data").into());
    let folder = std::path::Path::new(&data).join("bifrost");
    if !folder.is_dir() {
        println!("no data in {}: skipped", folder.display());
        return;
    }
    for (file, published) in [("before_collision_forward.csv", 0.010), ("after_collision_0deg_forward.csv", 0.031)] {
        let found = measure(&Recording::open(&folder.join(file)).unwrap(), "b").unwrap().lost_motion;
        println!("{file}: {:.4} ± {:.4}°", found.value, found.uncertainty);
        assert!((found.value - published).abs() < 0.002, "{file}: {found:?}");
        assert!((0.000_5..0.004).contains(&found.uncertainty), "{file}: {found:?}");
    }
}
