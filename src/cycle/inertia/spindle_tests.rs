//! Measurements on simulated spindles: error and coverage over random machines, and every way out.

use super::config::{GIB_INERTIA_LISTEN, InertiaConfig};
use super::io::*;
use super::machine::Inertia;
use super::plan::Plan;
use super::report::InertiaReport;
use crate::cycle::backlash::config::GIB_TORQUE_PERMILLE;
use crate::cycle::backlash::io::{GIB_INPUT_ABORT, GIB_INPUT_FAULT};
use crate::error::*;
use crate::units::{rad_s_from_rpm, rpm_from_rad_s};
use core::f64::consts::TAU;

/// Uniform and normal numbers (splitmix64).
struct Random(u64);

impl Random {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }

    fn normal(&mut self) -> f64 {
        (-2.0 * (1.0 - self.uniform()).ln()).sqrt() * (TAU * self.uniform()).cos()
    }
}

/// A spindle under a PI speed loop, integrated at ten steps a cycle, with the sensors of a drive.
#[derive(Clone)]
struct Spindle {
    inertia: f64,
    coulomb: f64,
    viscous: f64,
    /// Torque ripple: amplitude in N·m and periods in a revolution. The drive does not report it.
    ripple: [f64; 2],
    rated: f64,
    noise: f64,
    grid_rpm: f64,
    /// Encoder counts in a revolution, whose difference is the speed, and the last one; 0: a speed on `grid_rpm`.
    counts: [f64; 2],
    outliers: f64,
    /// Speed above which the motor delivers base/ω of what current × constant says, rad/s.
    base: f64,
    omega: f64,
    angle: f64,
    integral: f64,
    torque: f64,
}

const CYCLE: f64 = 1e-3;

impl Spindle {
    fn new(inertia: f64, rated: f64) -> Spindle {
        Spindle {
            inertia,
            coulomb: 0.2 * rated,
            viscous: 0.1 * rated / 200.0,
            ripple: [0.0, 6.0],
            rated,
            noise: 0.03 * rated,
            grid_rpm: 0.05,
            counts: [0.0; 2],
            outliers: 0.0,
            base: f64::MAX,
            omega: 0.0,
            angle: 0.0,
            integral: 0.0,
            torque: 0.0,
        }
    }

    /// Reads the sensors: speed in rpm and torque in N·m.
    fn sense(&mut self, random: &mut Random) -> (f64, f64) {
        let [counts, last] = self.counts;
        let speed = if counts > 0.0 {
            self.counts[1] = (self.angle / TAU * counts).floor();
            (self.counts[1] - last) * 60.0 / (counts * CYCLE)
        } else {
            let grid = self.grid_rpm;
            ((rpm_from_rad_s(self.omega) / grid + random.uniform()).floor()) * grid
        };
        let shown = self.torque * (self.omega.abs() / self.base).max(1.0);
        let wild = if random.uniform() < self.outliers { random.between(-5.0, 5.0) * self.rated } else { 0.0 };
        (speed, shown + self.noise * random.normal() + wild)
    }

    fn run(&mut self, command_rpm: f64) {
        let error = rad_s_from_rpm(command_rpm) - self.omega;
        let gain = 60.0 * self.inertia;
        let wanted = gain * (error + self.integral);
        let torque = wanted.clamp(-1.5 * self.rated, 1.5 * self.rated);
        if torque == wanted {
            self.integral += error * CYCLE / 0.05;
        }
        let dt = CYCLE / 10.0;
        for _ in 0..10 {
            self.torque += (torque - self.torque) * dt / 0.0005;
            let ripple = self.ripple[0] * (self.ripple[1] * self.angle).sin();
            let friction = self.coulomb * self.omega.signum() + self.viscous * self.omega;
            let drive = self.torque + ripple;
            let net = if self.omega == 0.0 && drive.abs() < self.coulomb { 0.0 } else { drive - friction };
            self.omega += net / self.inertia * dt;
            self.angle += self.omega * dt;
        }
    }
}

fn config(spindle: &Spindle, top: f64) -> InertiaConfig {
    // Half of the rated torque accelerates.
    let acceleration = rpm_from_rad_s(0.5 * spindle.rated / spindle.inertia);
    InertiaConfig {
        struct_size: size_of::<InertiaConfig>() as u32,
        cycle_s: CYCLE,
        speed_high_rpm: top,
        acceleration_rpm_s: acceleration.min(top / 0.5),
        ..InertiaConfig::default()
    }
}

/// Runs a measurement to its end and returns what it says.
fn measure(
    spindle: &mut Spindle,
    config: &InertiaConfig,
    random: &mut Random,
) -> (InertiaReport, Result<(), Fault>, Inertia) {
    let mut inertia = Inertia::default();
    inertia.start(Plan::new(config)).unwrap();
    for _ in 0..2_000_000 {
        let (speed_rpm, torque) = spindle.sense(random);
        let output = *inertia.step(&InertiaInput { speed_rpm, torque, ..InertiaInput::default() });
        assert!(output.speed_command_rpm.is_finite());
        if output.status != GIB_BUSY {
            break;
        }
        spindle.run(output.speed_command_rpm);
    }
    let (report, verdict) = inertia.report().unwrap();
    (report, verdict, inertia)
}

/// J from 0.01 to 5 kg·m², friction up to half of the torque, 3 % noise, ripple: error at most 1 %, and intervals that
/// hold the truth in 90 to 98 of 100 cases, not fewer and not more.
#[test]
fn error_and_coverage_on_random_spindles() {
    const SEED: u64 = 20_240_611;
    const SPINDLES: usize = 400;
    println!("seed {SEED}");
    let mut random = Random(SEED);
    let (mut covered, mut worst) = ([0usize; 3], 0.0f64);
    for _ in 0..SPINDLES {
        let inertia = 0.01 * 500f64.powf(random.uniform());
        let top = random.between(1000.0, 4000.0);
        let rated = inertia * rad_s_from_rpm(top) / random.between(0.5, 3.0);
        let mut spindle = Spindle::new(inertia, rated);
        let friction = random.between(0.02, 0.5) * rated;
        let share = random.uniform();
        spindle.coulomb = share * friction;
        spindle.viscous = (1.0 - share) * friction / rad_s_from_rpm(top);
        spindle.ripple = [random.between(0.0, 0.03) * rated, f64::from(1 + (random.uniform() * 24.0) as i32)];
        spindle.omega = rad_s_from_rpm(random.between(0.0, 0.5) * top);
        let config = config(&spindle, top);
        let (report, verdict, _) = measure(&mut spindle, &config, &mut random);
        assert_eq!(verdict, Ok(()), "{report:?}");
        let holds = |value: f64, uncertainty: f64, truth: f64| usize::from((value - truth).abs() <= uncertainty);
        covered[0] += holds(report.total_kg_m2, report.total_uncertainty_kg_m2, inertia);
        covered[1] += holds(report.coulomb_nm, report.coulomb_uncertainty_nm, spindle.coulomb);
        covered[2] += holds(report.viscous_nm_s, report.viscous_uncertainty_nm_s, spindle.viscous);
        worst = worst.max((report.total_kg_m2 / inertia - 1.0).abs());
    }
    let percent = covered.map(|c| 100.0 * c as f64 / SPINDLES as f64);
    println!("{SPINDLES} spindles: worst error {:.2} %, intervals hold J, Tc, B in {percent:?} %", 100.0 * worst);
    assert!(worst <= 0.01, "{worst}");
    assert!((90.0..=98.0).contains(&percent[0]), "{percent:?}");
    assert!(percent[1..].iter().all(|p| (85.0..=99.5).contains(p)), "{percent:?}");
}

/// A speed of one count in a cycle and less to some tens of them: either the interval holds the truth as often as it says, or the
/// value is refused as lost in the acceleration's noise. From a hundred rpm to a thousand, with 2 % torque noise.
#[test]
fn counts_of_a_slow_spindle_are_measured_within_the_interval_or_refused() {
    const SPINDLES: usize = 300;
    let mut random = Random(20_261_127);
    let (mut measured, mut held, mut far, mut doubted, mut errors) = (0, 0, 0, 0, [0.0; 2]);
    for _ in 0..SPINDLES {
        let top = 100.0 * 10f64.powf(random.uniform());
        let inertia = 0.01 * 500f64.powf(random.uniform());
        // As much of the ramp's torque as accelerates is friction at most; it takes 0.3 to 6 s.
        let seconds = 0.3 * 20f64.powf(random.uniform());
        let accelerates = inertia * rad_s_from_rpm(top) / seconds;
        let mut spindle =
            Spindle { noise: 0.02 * accelerates, counts: [4096.0, 0.0], ..Spindle::new(inertia, 2.0 * accelerates) };
        spindle.coulomb = accelerates * 0.01f64.powf(random.uniform());
        spindle.viscous = accelerates * random.between(0.0, 0.5) / rad_s_from_rpm(top);
        let config = InertiaConfig { acceleration_rpm_s: top / seconds, ..config(&spindle, top) };
        let (report, verdict, _) = measure(&mut spindle, &config, &mut random);
        if let Err(fault) = verdict {
            doubted += usize::from(fault.code != GIB_ERR_INERTIA_EXCITATION);
            assert_ne!(fault.field, "\0", "refused by name");
            continue;
        }
        let (error, uncertainty) = (report.total_kg_m2 - inertia, report.total_uncertainty_kg_m2);
        (measured, held) = (measured + 1, held + usize::from(error.abs() <= uncertainty));
        far += usize::from(error.abs() > 2.0 * uncertainty);
        errors = [errors[0] + error / uncertainty, errors[1].max((error / inertia).abs())];
    }
    let n = measured as f64;
    println!(
        "{measured} of {SPINDLES} measured, {held} held, {far} beyond twice, {doubted} doubted, mean {:.3}, worst {:.4}",
        errors[0] / n,
        errors[1]
    );
    // Four standard deviations of a count below 95 of 100; beyond twice the interval is 1 in 16 000.
    assert!(held as f64 >= 0.95 * n - 4.0 * (0.95 * 0.05 * n).sqrt(), "{held} of {measured}");
    assert!(far <= 1, "{far} of {measured}");
    assert!(measured >= SPINDLES / 2, "{measured}");
}

#[test]
fn torque_over_acceleration_alone_is_far_off_and_wild_samples_do_no_harm() {
    let mut random = Random(7);
    let mut spindle = Spindle { outliers: 0.02, ..Spindle::new(0.5, 60.0) };
    spindle.coulomb = 25.0;
    let config = config(&spindle, 2000.0);
    let (report, verdict, _) = measure(&mut spindle, &config, &mut random);
    assert_eq!(verdict, Ok(()));
    assert!((report.total_kg_m2 / 0.5 - 1.0).abs() < 0.01, "{report:?}");
    assert!(report.naive_kg_m2 > 0.7, "friction would count as inertia: {report:?}");
}

#[test]
fn own_inertia_is_taken_off_and_more_than_all_is_refused() {
    let mut random = Random(11);
    let mut spindle = Spindle::new(0.5, 60.0);
    let base = InertiaConfig { process_step: 3, ..config(&spindle, 2000.0) };
    let own = InertiaConfig { own_inertia_kg_m2: 0.1, own_uncertainty_kg_m2: 0.01, ..base };
    let (report, _, _) = measure(&mut spindle, &own, &mut random);
    assert!((report.workpiece_kg_m2 - 0.4).abs() < 0.01 && report.workpiece_uncertainty_kg_m2 >= 0.01);
    assert_eq!(report.process_step, 3);
    let more = InertiaConfig { own_inertia_kg_m2: 0.6, ..base };
    let (report, verdict, _) = measure(&mut spindle, &more, &mut random);
    assert_eq!((report.verdict, verdict.unwrap_err().code), (GIB_ERR_INERTIA_OWN, GIB_ERR_INERTIA_OWN));
}

/// Without being told the base speed, what lies above it is found and left out; a clean spindle raises no alarm.
#[test]
fn field_weakening_is_found_and_left_out() {
    let mut random = Random(13);
    for base_rpm in [1500.0, 2500.0] {
        let mut spindle = Spindle { base: rad_s_from_rpm(base_rpm), ..Spindle::new(0.2, 40.0) };
        let config = config(&spindle, 4000.0);
        let (report, verdict, _) = measure(&mut spindle, &config, &mut random);
        assert_eq!(verdict, Ok(()));
        assert!((report.weakening_rpm / base_rpm - 1.0).abs() < 0.1, "{report:?}");
        assert!((report.total_kg_m2 / 0.2 - 1.0).abs() < 0.02, "{report:?}");
        let told = InertiaConfig { base_speed_rpm: base_rpm, ..config };
        let (report, ..) = measure(&mut spindle, &told, &mut random);
        assert!((report.total_kg_m2 / 0.2 - 1.0).abs() < 0.01 && report.weakening_rpm == 0.0, "{report:?}");
    }
    for _ in 0..20 {
        let mut spindle = Spindle::new(0.2, 40.0);
        let config = config(&spindle, 4000.0);
        let (report, ..) = measure(&mut spindle, &config, &mut random);
        assert!(report.weakening_rpm == 0.0 && report.saturation_nm == 0.0, "{report:?}");
    }
}

/// Listening to a motion that says too little is refused with the ramp that would do, and that ramp does.
#[test]
fn too_little_excitation_is_refused_and_the_ramp_proposed_suffices() {
    let mut random = Random(17);
    let mut spindle = Spindle::new(0.5, 60.0);
    let listen = InertiaConfig { mode: GIB_INERTIA_LISTEN, listen_s: 6.0, ..config(&spindle, 2000.0) };
    let mut inertia = Inertia::default();
    inertia.start(Plan::new(&listen)).unwrap();
    let mut time = 0.0;
    (0..4000).for_each(|_| spindle.run(1000.0));
    loop {
        let (speed_rpm, torque) = spindle.sense(&mut random);
        let input = InertiaInput { speed_rpm, torque, ..InertiaInput::default() };
        if inertia.step(&input).status != GIB_BUSY {
            break;
        }
        time += CYCLE;
        spindle.run(1000.0 + 0.1 * (3.0 * time).sin());
    }
    let (report, verdict) = inertia.report().unwrap();
    assert_eq!(verdict.unwrap_err().code, GIB_ERR_INERTIA_EXCITATION);
    assert!(report.ramp_acceleration_rpm_s > 0.0 && report.ramp_times >= 1, "{report:?}");
    let ramp = InertiaConfig {
        speed_low_rpm: report.ramp_low_rpm,
        speed_high_rpm: report.ramp_high_rpm,
        acceleration_rpm_s: report.ramp_acceleration_rpm_s,
        ramps: report.ramp_times.min(50),
        ..config(&spindle, 2000.0)
    };
    let (report, verdict, _) = measure(&mut spindle, &ramp, &mut random);
    assert_eq!((verdict, report.target_reached), (Ok(()), 1), "{report:?}");
}

#[test]
fn per_mille_and_the_other_sense_give_the_same_inertia() {
    let mut random = Random(19);
    let mut spindle = Spindle::new(0.5, 60.0);
    let permille =
        InertiaConfig { torque_unit: GIB_TORQUE_PERMILLE, rated_torque_nm: 60.0, ..config(&spindle, -2000.0) };
    let mut inertia = Inertia::default();
    inertia.start(Plan::new(&InertiaConfig { acceleration_rpm_s: 500.0, ..permille })).unwrap();
    loop {
        let (speed_rpm, torque) = spindle.sense(&mut random);
        let output = *inertia.step(&InertiaInput { speed_rpm, torque: torque / 0.06, ..InertiaInput::default() });
        if output.status != GIB_BUSY {
            break;
        }
        spindle.run(output.speed_command_rpm);
    }
    let (report, verdict) = inertia.report().unwrap();
    assert_eq!(verdict, Ok(()));
    assert!((report.total_kg_m2 / 0.5 - 1.0).abs() < 0.01 && report.coulomb_nm > 0.0, "{report:?}");
}

/// Whatever goes wrong in whatever state: one fault, kept; the command stays finite, never jumps further than the
/// ramp allows, and ends at the speed at start.
#[test]
fn every_fault_in_every_state_ends_safely() {
    let seen = |flags, speed, torque| InertiaInput { speed_rpm: speed, torque, flags, reserved: 0 };
    let faults: [(InertiaInput, i32); 6] = [
        (seen(GIB_INPUT_ABORT, 0.0, 0.0), GIB_ERR_ABORTED),
        (seen(GIB_INPUT_FAULT, 0.0, 0.0), GIB_ERR_DRIVE_FAULT),
        (seen(0, f64::NAN, 0.0), GIB_ERR_NON_FINITE),
        (seen(0, 0.0, f64::INFINITY), GIB_ERR_NON_FINITE),
        (seen(0, 0.0, 1e4), GIB_ERR_TORQUE_BOUND),
        (seen(0, 4e3, 0.0), GIB_ERR_LAG),
    ];
    let spindle = Spindle::new(0.5, 60.0);
    let config = InertiaConfig { torque_bound_nm: 500.0, hold_s: 0.2, ramps: 1, ..config(&spindle, 2000.0) };
    let mut states = std::collections::BTreeSet::new();
    for (input, code) in faults {
        for at in (0..6000).step_by(97) {
            let mut inertia = Inertia::default();
            inertia.start(Plan::new(&config)).unwrap();
            let mut command = 300.0;
            let mut phase = 0;
            let mut cycles = 0;
            let status = loop {
                let healthy = seen(0, command, 1.0);
                let bad =
                    InertiaInput { speed_rpm: if input.speed_rpm == 0.0 { command } else { input.speed_rpm }, ..input };
                let output = *inertia.step(if cycles == at { &bad } else { &healthy });
                assert!(output.speed_command_rpm.is_finite());
                // Before the first good input nobody knows how fast the spindle turns.
                if code != GIB_ERR_LAG && cycles > 0 {
                    let step = (output.speed_command_rpm - command).abs();
                    assert!(step <= config.acceleration_rpm_s * CYCLE * 1.001, "{step} at {cycles}");
                }
                if cycles < at {
                    phase = output.phase;
                }
                if output.status != GIB_BUSY {
                    break output.status;
                }
                command = output.speed_command_rpm;
                cycles += 1;
                assert!(cycles < 200_000);
            };
            if at < 4000 && phase != GIB_INERTIA_RETURN && cycles >= at {
                states.insert(phase);
                if status != code {
                    // At the first cycle nothing is commanded yet, so nothing lags; later only DONE is legal.
                    assert!(status == GIB_DONE || at == 0, "{status} for {code} at {at} in {phase}");
                }
                if status == code {
                    assert_eq!(inertia.fault().code, code);
                    assert_eq!(inertia.step(&seen(0, 10.0, 0.0)).status, code, "kept");
                }
            }
        }
    }
    println!("states in which faults were put: {states:?}");
    assert!(states.len() >= 5);
}

/// Ended early, a measurement that listens says the same whatever time it was allowed.
#[test]
fn what_is_heard_does_not_depend_on_how_long_it_might_have_been() {
    let mut found: Vec<InertiaReport> = vec![];
    for listen_s in [15.0, 60.0, 300.0, 3600.0] {
        let config = InertiaConfig {
            struct_size: size_of::<InertiaConfig>() as u32,
            mode: GIB_INERTIA_LISTEN,
            cycle_s: CYCLE,
            listen_s,
            ..InertiaConfig::default()
        };
        let (mut machine, mut random, mut speed_rpm) = (Inertia::default(), Random(5), 300.0);
        machine.start(Plan::new(&config)).unwrap();
        for cycle in 0..=14_000 {
            let (t, pace) = (f64::from(cycle % 7000) * CYCLE, if cycle < 7000 { 900.0 } else { 540.0 });
            let rpm_s = if t < 3.0 {
                pace
            } else if (3.5..6.5).contains(&t) {
                -pace
            } else {
                0.0
            };
            let torque = rad_s_from_rpm(0.1 * rpm_s + 0.001 * speed_rpm) + 0.5 + 0.01 * random.normal();
            let flags = if cycle == 14_000 { GIB_INERTIA_FINISH } else { 0 };
            machine.step(&InertiaInput { speed_rpm, torque, flags, ..InertiaInput::default() });
            speed_rpm += rpm_s * CYCLE;
        }
        let (report, verdict) = machine.report().unwrap();
        assert_eq!(verdict, Ok(()), "{listen_s}");
        assert!((report.total_kg_m2 - 0.1).abs() < report.total_uncertainty_kg_m2.max(1e-5), "{listen_s} {report:?}");
        assert!((256..=512).contains(&report.blocks_used), "{report:?}");
        found.push(report);
    }
    assert!(found.iter().all(|report| *report == found[0]), "{found:?}");
}
