//! Learning on machines that are known in closed form: lags, resonances and disturbances that repeat each revolution.

use gib::cycle::learning::config::*;
use gib::cycle::learning::io::*;
use gib::cycle::learning::machine::Learning;
use gib::cycle::learning::plan::Plan;
use gib::error::*;
use proptest::prelude::*;
use std::f64::consts::TAU;

const CYCLE: f64 = 0.0005;

fn config() -> LearningConfig {
    LearningConfig {
        struct_size: size_of::<LearningConfig>() as u32,
        cycle_s: CYCLE,
        tolerance_um: 0.3,
        correction_max_um: 200.0,
        ..LearningConfig::default()
    }
}

/// What stands between command and detected position: a lag, a resonance, and something that repeats.
#[derive(Clone, Copy)]
struct Machine {
    lag_s: f64,
    /// Hz, damping, gain of a mode that the command excites; 0 Hz: none.
    mode: (f64, f64, f64),
    wrong_um: f64,
    noise_um: f64,
    rpm: f64,
}

struct Rig {
    machine: Machine,
    gib: Learning,
    output: LearningOutput,
    turns: f64,
    /// Position behind the lag; the mode and its speed, µm.
    lagged: f64,
    mode: [f64; 2],
    seed: u64,
}

impl Rig {
    fn new(machine: Machine, config: &LearningConfig) -> Rig {
        let mut gib = Learning::default();
        gib.start(Plan::new(config)).unwrap();
        Rig { machine, gib, output: LearningOutput::default(), turns: 0.0, lagged: 0.0, mode: [0.0; 2], seed: 5 }
    }

    fn noise(&mut self) -> f64 {
        self.seed = self.seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        self.machine.noise_um * ((self.seed >> 11) as f64 / (1u64 << 52) as f64 - 1.0)
    }

    /// One cycle; returns the deviation in µm.
    fn cycle(&mut self, spoil: impl FnOnce(&mut LearningInput)) -> f64 {
        let m = self.machine;
        self.turns += m.rpm / 60.0 * CYCLE;
        let wrong = m.wrong_um * ((TAU * 2.0 * self.turns).cos() + 0.3 * (TAU * 5.0 * self.turns + 1.0).sin());
        let target = 0.4 * (TAU * 2.0 * self.turns).cos();
        let noise = self.noise();
        let detected = target + 1e-3 * (self.lagged + self.mode[0] + wrong + noise);
        let mut input = LearningInput {
            target_mm: target,
            detected_mm: detected,
            angle_deg: 360.0 * self.turns,
            ..LearningInput::default()
        };
        spoil(&mut input);
        let before = self.output.correction_um;
        self.gib.step(&input, &mut self.output);
        let out = &self.output;
        assert!(out.command_mm.is_finite() && out.correction_um.abs() <= 200.0);
        assert!((out.correction_um - before).abs() <= 50.001, "{} to {}", before, out.correction_um);
        // The correction goes through lag and mode, ten small steps.
        for _ in 0..10 {
            let h = CYCLE / 10.0;
            self.lagged += h / m.lag_s.max(h) * (out.correction_um - self.lagged);
            let omega = TAU * m.mode.0;
            let pull =
                omega * omega * (m.mode.2 * out.correction_um - self.mode[0]) - 2.0 * m.mode.1 * omega * self.mode[1];
            self.mode[1] += h * pull;
            self.mode[0] += h * self.mode[1];
        }
        1e3 * (target - detected)
    }

    fn run(&mut self, cycles: usize) -> i32 {
        for _ in 0..cycles {
            self.cycle(|_| ());
            if !self.gib.busy() {
                break;
            }
        }
        self.output.status
    }

    fn pass(&mut self, cycles: usize) {
        for _ in 0..cycles {
            self.cycle(|_| ());
        }
    }

    fn rms(&mut self) -> f64 {
        let n = (2.0 * 60.0 / self.machine.rpm / CYCLE) as usize;
        ((0..n).map(|_| self.cycle(|_| ()).powi(2)).sum::<f64>() / n as f64).sqrt()
    }
}

const PLAIN: Machine = Machine { lag_s: 0.001, mode: (0.0, 0.0, 0.0), wrong_um: 5.0, noise_um: 0.0, rpm: 600.0 };

#[test]
fn a_deviation_that_repeats_is_learnt_by_both_methods() {
    for method in [GIB_LEARNING_FILTERED, GIB_LEARNING_PUBLISHED] {
        let mut rig = Rig::new(PLAIN, &LearningConfig { method, points: 100, lag_s: 0.0012, ..config() });
        let first = rig.rms();
        assert_eq!(rig.run(200_000), GIB_DONE, "{:?}", rig.gib.report());
        let (report, left) = (rig.gib.report(), rig.rms());
        println!("method {method}: {first:.2} µm, {left:.3} µm after {} updates", report.updates);
        assert!(left < 0.4 && first > 3.0 && report.updates < 12 && report.best_um <= 0.3);
        // Kept on and on.
        rig.run(5000);
        assert!(rig.rms() < 0.4 && rig.output.status == GIB_DONE);
    }
}

/// A mode that nobody modelled, at harmonic 5: the published update grows and is taken back, the filtered one learns.
#[test]
fn an_unmodelled_mode_stops_the_published_update_and_not_the_filtered_one() {
    let machine = Machine { mode: (48.0, 0.02, 1.0), ..PLAIN };
    let mut rig = Rig::new(machine, &LearningConfig { method: GIB_LEARNING_PUBLISHED, points: 100, ..config() });
    let first = rig.rms();
    assert_eq!(rig.run(400_000), GIB_ERR_LEARNING_GROWS);
    rig.run(10_000);
    rig.pass(10_000);
    let after = rig.rms();
    println!("published: {first:.2} µm, rolled back to {after:.2} µm after {} updates", rig.gib.report().updates);
    assert!(after < 1.25 * rig.gib.report().best_um + 0.1 && after < 1.1 * first);
    let mut rig = Rig::new(machine, &LearningConfig { settle_revolutions: 4, ..config() });
    assert_eq!(rig.run(400_000), GIB_DONE, "{:?}", rig.gib.report());
    println!("filtered: {:.3} µm after {} updates", rig.rms(), rig.gib.report().updates);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]
    /// Random lags, modes below, among and beyond the harmonics learnt: what is left in the end is never more than at first.
    #[test]
    fn no_mode_makes_the_filtered_update_diverge(
        lag in 0.0f64..0.004, frequency in 5.0f64..200.0, damping in 0.01f64..0.2, gain in -2.0f64..2.0, noise in 0.0f64..0.3,
    ) {
        let machine = Machine { lag_s: lag, mode: (frequency, damping, gain), wrong_um: 5.0, noise_um: noise, rpm: 600.0 };
        let mut rig = Rig::new(machine, &LearningConfig { updates: 20, settle_revolutions: 4, ..config() });
        rig.run(2000);
        let first = rig.gib.report().first_um.max(rig.rms());
        let status = rig.run(60_000);
        rig.pass(20_000);
        let last = rig.rms();
        prop_assert!(status == GIB_DONE || status < 0 || rig.gib.busy());
        prop_assert!(last < 1.1 * first + 3.0 * noise, "{last} of {first} µm, {:?}", rig.gib.report());
    }
}

#[test]
fn what_is_learnt_is_taken_up_again() {
    let mut rig = Rig::new(PLAIN, &config());
    assert_eq!(rig.run(200_000), GIB_DONE);
    let points: Vec<LearningPoint> = (0..rig.gib.count()).map(|i| rig.gib.point(i)).collect();
    assert!(points.len() == 256 && points.iter().any(|p| (p.command_mm - p.target_mm).abs() > 0.003));
    assert!(points.iter().all(|p| (p.detected_mm - p.target_mm).abs() < 0.002));
    let mut next = Rig::new(PLAIN, &config());
    next.gib = Learning::default();
    next.gib.install(points.into_iter());
    let refused = next.gib.start(Plan::new(&LearningConfig { resume: 1, points: 128, ..config() })).unwrap_err();
    assert_eq!((refused.code, refused.field), (GIB_ERR_CONFIG, "points\0"));
    next.gib.start(Plan::new(&LearningConfig { resume: 1, ..config() })).unwrap();
    assert_eq!(next.run(20_000), GIB_DONE);
    assert_eq!(next.gib.report().updates, 0);
}

#[test]
fn faults_take_the_correction_out_and_waiting_has_an_end() {
    type Spoil = fn(&mut LearningInput);
    let faults: [(Spoil, i32); 5] = [
        (|i| i.flags = 0x80, GIB_ERR_CONFIG),
        (|i| i.flags = 1, GIB_ERR_DRIVE_FAULT),
        (|i| i.flags = 2, GIB_ERR_ABORTED),
        (|i| i.target_mm = f64::NAN, GIB_ERR_NON_FINITE),
        (|i| i.detected_mm += 2.0, GIB_ERR_LEARNING_DEVIATION),
    ];
    for (spoil, code) in faults {
        for after in [10, 900, 3000, 60_000] {
            let mut rig = Rig::new(PLAIN, &config());
            rig.pass(after);
            rig.cycle(spoil);
            rig.pass(400);
            let fault = rig.gib.fault();
            assert!(rig.output.status == fault.code && rig.output.correction_um == 0.0, "{after}: {:?}", rig.output);
            assert!(
                fault.code == code
                    || (code == GIB_ERR_DRIVE_FAULT && fault.code == GIB_ERR_ABORTED)
                    || code == GIB_ERR_ABORTED
            );
        }
    }
    for (spoil, reason) in [
        ((|i| i.detected_mm = f64::NAN) as Spoil, GIB_LEARNING_NOT_DETECTED),
        (|i| i.angle_deg = f64::INFINITY, GIB_LEARNING_BAD_ANGLE),
        (|i| i.angle_deg = 17.0, GIB_LEARNING_NO_ROTATION),
    ] {
        let mut rig = Rig::new(PLAIN, &LearningConfig { wait_s: 1.0, ..config() });
        rig.run(3000);
        let mut cycles = 0;
        while rig.gib.busy() {
            rig.cycle(spoil);
            assert!(
                cycles < 200
                    || rig.output.reasons & reason != 0
                    || !rig.gib.busy()
                    || rig.output.phase == GIB_LEARNING_STOPPING
            );
            cycles += 1;
            assert!(cycles < 3000, "{reason}");
        }
        assert_eq!((rig.output.status, rig.output.correction_um), (GIB_ERR_DEADLINE, 0.0));
    }
}

/// The tolerance is met, the spindle stops, turns the other way, and comes back: nothing is lost and nothing jumps.
#[test]
fn the_correction_goes_and_comes_with_the_spindle() {
    let mut rig = Rig::new(PLAIN, &config());
    assert_eq!(rig.run(200_000), GIB_DONE);
    for rpm in [0.0, -600.0, 0.0, 600.0] {
        rig.machine.rpm = rpm;
        rig.pass(4000);
        assert!(rpm != 0.0 || rig.output.correction_um == 0.0);
    }
    assert!(rig.rms() < 0.4);
}

/// A correction that is kept is right near the speed at which it was learnt: elsewhere that is told, and where it would do harm it is
/// out; with the speed it comes back.
#[test]
fn a_correction_that_is_kept_is_not_put_on_another_speed() {
    for (rpm, reason, out) in [
        (600.0, false, false),
        (606.0, false, false),
        (630.0, true, false),
        (450.0, true, false),
        (250.0, true, true),
        (1000.0, true, true),
        (-600.0, true, true),
    ] {
        let mut rig = Rig::new(PLAIN, &config());
        assert_eq!(rig.run(200_000), GIB_DONE);
        rig.machine.rpm = rpm;
        rig.pass(8000);
        let mut most = 0f64;
        for _ in 0..2000 {
            rig.cycle(|_| ());
            most = most.max(rig.output.correction_um.abs());
            assert_eq!((rig.output.status, rig.output.phase), (GIB_DONE, GIB_LEARNING_DONE));
            assert_eq!(rig.output.reasons, if reason { GIB_LEARNING_SPEED_CHANGED } else { 0 }, "{rpm}");
        }
        assert_eq!(most == 0.0, out, "{rpm}: {most} µm");
        rig.machine.rpm = 600.0;
        rig.pass(4000);
        assert!(rig.rms() < 0.4 && rig.output.reasons == 0, "{rpm}");
    }
    // An encoder of 200 counts, at two cycles a count and at twenty, is no speed that changes.
    for rpm in [600.0, 60.0] {
        let mut rig = Rig::new(Machine { rpm, ..PLAIN }, &LearningConfig { tolerance_um: 1.0, ..config() });
        let coarse = |i: &mut LearningInput| i.angle_deg = (i.angle_deg / 1.8).floor() * 1.8;
        for _ in 0..400_000 {
            rig.cycle(coarse);
            if !rig.gib.busy() {
                break;
            }
        }
        assert_eq!(rig.output.status, GIB_DONE, "{:?}", rig.gib.report());
        for _ in 0..10_000 {
            rig.cycle(coarse);
            assert_eq!(rig.output.reasons, 0, "{rpm}");
        }
    }
}

#[test]
fn what_is_wrong_is_told_by_its_value() {
    let refused = |config: &LearningConfig| Learning::default().start(Plan::new(config)).unwrap_err();
    let odd = refused(&LearningConfig { points: 255, ..config() });
    assert_eq!((odd.field, odd.value, odd.low, odd.high), ("points\0", 255.0, 0.0, 0.0));
    let none = refused(&LearningConfig { resume: 1, ..config() });
    assert_eq!((none.field, none.value, none.low, none.high), ("resume\0", 1.0, 0.0, 0.0));
    let mut rig = Rig::new(PLAIN, &config());
    rig.pass(100);
    rig.cycle(|i| i.target_mm = f64::NAN);
    assert!(rig.gib.fault().value.is_nan() && rig.gib.fault().field == "target_mm\0");
    rig = Rig::new(PLAIN, &config());
    rig.pass(100);
    rig.cycle(|i| i.target_mm = f64::NEG_INFINITY);
    assert_eq!(rig.gib.fault().value, f64::NEG_INFINITY);
}

/// The sum of harmonics in single precision may be a little more than their sizes.
#[test]
fn what_is_reported_keeps_to_its_bound() {
    for i in 0..40 {
        let most = 0.5 + 0.07 * f64::from(i);
        let learning = LearningConfig { correction_max_um: most, harmonics: 8 - i % 8, updates: 6, ..config() };
        let mut rig = Rig::new(Machine { rpm: 500.0 + f64::from(i), ..PLAIN }, &learning);
        for _ in 0..60_000 {
            rig.cycle(|_| ());
            assert!(rig.gib.report().correction_um <= most && rig.output.correction_um.abs() <= most, "{i}");
            if !rig.gib.busy() {
                break;
            }
        }
        assert!(
            (0..rig.gib.count())
                .all(|p| 1e3 * (rig.gib.point(p).command_mm - rig.gib.point(p).target_mm).abs() <= most + 1e-9)
        );
    }
}

/// An abort amid an evaluation, and the correction taken up again: between its points it keeps to the bound, too.
#[test]
fn a_correction_that_is_taken_up_again_keeps_to_its_bound() {
    for cut in [1, 40, 130, 250, 300, 400] {
        let learning =
            LearningConfig { correction_max_um: 2.0, points: 16, harmonics: 4, tolerance_um: 0.001, ..config() };
        let mut rig = Rig::new(Machine { rpm: 120.0, ..PLAIN }, &learning);
        let mut evaluated = 0;
        while evaluated < 60 + cut % 40 && rig.gib.busy() {
            rig.cycle(|_| ());
            evaluated += u32::from(rig.output.phase == GIB_LEARNING_EVALUATE);
        }
        rig.gib.abort();
        rig.pass(2000);
        rig.gib.start(Plan::new(&LearningConfig { resume: 1, ..learning })).unwrap();
        for _ in 0..20_000 {
            rig.cycle(|_| ());
            assert!(rig.output.correction_um.abs() <= 2.0, "{cut}: {}", rig.output.correction_um);
        }
    }
}
