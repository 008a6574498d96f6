//! The vibration correction against signals that are known in closed form: what it finds, how it fades, what it survives.
//!
//! `GIB_VIBRATION_CYCLES` sets the length of the long run (default 2 million cycles).

use gib::cycle::calibration::table::{CalibrationPoint, CalibrationTable};
use gib::cycle::vibration::config::*;
use gib::cycle::vibration::io::*;
use gib::cycle::vibration::machine::Vibration;
use gib::cycle::vibration::plan::Plan;
use gib::error::*;
use std::f64::consts::TAU;

const CYCLE: f64 = 0.0005;

fn config() -> VibrationConfig {
    VibrationConfig {
        struct_size: size_of::<VibrationConfig>() as u32,
        cycle_s: CYCLE,
        acceleration_range_m_s2: 20.0,
        ..VibrationConfig::default()
    }
}

/// Uniform noise of variance 1, from splitmix64.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 52) as f64 - 1.0) * 3f64.sqrt()
    }
}

/// Seat and bearing displacements Σ A·cos(kθ − φ), µm, at the reference speed; they grow with the speed squared.
const SEAT: &[(f64, f64, f64)] = &[(2.0, 4.0, 0.3), (4.0, 0.6, -1.0)];
const BEARING: &[(f64, f64, f64)] = &[(1.0, 0.8, 2.0), (2.0, -3.0, 0.4)];
/// rpm at which the amplitudes are those above.
const SPEED: f64 = 600.0;

/// A spindle whose speed may vary, and two points that swing with it.
struct Rig {
    gib: Vibration,
    input: VibrationInput,
    output: VibrationOutput,
    /// turns, and turns per s
    angle: f64,
    rate: f64,
    offset: [f64; 2],
    noise: f64,
    random: Noise,
}

impl Rig {
    fn new(config: &VibrationConfig, table: Option<&CalibrationTable>) -> Rig {
        let mut gib = Vibration::default();
        gib.start(Plan::new(config, table)).unwrap();
        let (input, output) = (VibrationInput { scale_mm: 7.0, ..Default::default() }, Default::default());
        Rig { gib, input, output, angle: 0.0, rate: SPEED / 60.0, offset: [0.4, -0.3], noise: 0.0, random: Noise(7) }
    }

    /// Displacement in µm and acceleration in m/s² of some harmonics.
    fn swing(&self, harmonics: &[(f64, f64, f64)]) -> [f64; 2] {
        let grows = (self.rate * 60.0 / SPEED).powi(2);
        harmonics.iter().fold([0.0; 2], |[x, a], (k, amplitude, phase)| {
            let now = grows * amplitude * (TAU * k * self.angle - phase).cos();
            [x + now, a - 1e-6 * now * (TAU * k * self.rate).powi(2)]
        })
    }

    /// One cycle; returns the error of the relative displacement, µm.
    fn cycle(&mut self, spoil: impl FnOnce(&mut VibrationInput)) -> f64 {
        self.angle += self.rate * CYCLE;
        let ([x1, a1], [x2, a2]) = (self.swing(SEAT), self.swing(BEARING));
        self.input.angle_deg = 360.0 * self.angle.fract();
        self.input.acceleration_m_s2 = [a1 + self.offset[0], a2 + self.offset[1]];
        for a in &mut self.input.acceleration_m_s2 {
            *a += self.noise * self.random.next();
        }
        let mut input = self.input;
        spoil(&mut input);
        self.gib.step(&input, &mut self.output);
        let output = &self.output;
        assert!(
            [output.position_mm, output.correction_um, output.relative_um, output.speed_rpm]
                .iter()
                .all(|x| x.is_finite())
        );
        output.relative_um - (x1 - x2)
    }

    /// Root mean square of the error over some cycles.
    fn error(&mut self, cycles: usize) -> f64 {
        ((0..cycles).map(|_| self.cycle(|_| ()).powi(2)).sum::<f64>() / cycles as f64).sqrt()
    }
}

#[test]
fn known_harmonics_are_found_after_a_revolution_and_exact_after_many() {
    let mut rig = Rig::new(&config(), None);
    for i in 0..220 {
        rig.cycle(|_| ());
        let expected = if i < 180 { GIB_VIBRATION_NO_REVOLUTION } else { rig.output.reasons };
        assert!(i == 0 || rig.output.reasons & expected == expected, "{i}: {:#x}", rig.output.reasons);
        assert!(rig.output.position_mm == 7.0 || i >= 180);
    }
    let second = rig.error(400);
    let later = {
        rig.error(20_000);
        rig.error(2000)
    };
    println!("error: {second:.4} µm in revolutions 2 to 3, {later:.6} µm in the end, of 5.2 µm");
    assert!(second < 0.3 && later < 2e-3);
    assert!(rig.output.phase == GIB_VIBRATION_CORRECTING && rig.output.blend_ratio == 1.0);
    let report = rig.gib.report();
    assert!((report.amplitude_um[0] - 0.8).abs() < 0.01 && (report.amplitude_um[3] - 0.6).abs() < 0.01);
    assert!((report.offset_m_s2[0] - 0.4).abs() < 1e-3 && (report.speed_rpm - SPEED).abs() < 0.5);
}

#[test]
fn a_varying_speed_is_followed_both_ways_round() {
    for sense in [1.0, -1.0] {
        let mut rig = Rig::new(&config(), None);
        rig.rate *= sense;
        rig.error(4000);
        let (mut sum, n) = (0.0, 16_000);
        for i in 0..n {
            // ±10 % in two seconds, a triangle.
            let part = (f64::from(i) * CYCLE / 2.0).fract();
            rig.rate =
                sense * SPEED / 60.0 * (1.0 + 0.1 * (if part < 0.5 { 4.0 * part - 1.0 } else { 3.0 - 4.0 * part }));
            sum += rig.cycle(|_| ()).powi(2);
        }
        let error = (sum / f64::from(n)).sqrt();
        println!("speed varies by 10 %, sense {sense}: {error:.3} µm of 5.2");
        // What follows a resonance fast pays with a percent where there is none.
        assert!(error < 0.12);
    }
}

/// Far beyond the speed for which the harmonics stand, and back: what they say goes on without a jump where they are made
/// to stand for another, and is right all the time.
#[test]
fn a_speed_that_goes_far_is_followed_without_a_jump() {
    let mut rig = Rig::new(&config(), None);
    rig.noise = 0.002;
    rig.error(4000);
    let (mut worst, mut largest, mut before) = (0.0f64, 0.0f64, rig.output.correction_um);
    for i in 0..32_000 {
        // 600 to 1500 to 450 to 600 rpm in 16 s.
        let part = f64::from(i) / 32_000.0;
        let rpm = 600.0
            + 3600.0
                * if part < 0.25 {
                    part
                } else if part < 0.75 {
                    0.5 - part
                } else {
                    part - 1.0
                };
        rig.rate = rpm.clamp(450.0, 1500.0) / 60.0;
        let grown = (rig.rate * 60.0 / SPEED).powi(2);
        let error = rig.cycle(|_| ());
        worst = worst.max(error.abs() / grown);
        // What swings by 7 µm at twice the spindle's frequency, 0.8 at once and 0.6 at four times that, in a cycle.
        let steepest = grown * (2.0 * 7.0 + 0.8 + 4.0 * 0.6) * TAU * rig.rate * CYCLE;
        largest = largest.max((rig.output.correction_um - before).abs() / steepest);
        before = rig.output.correction_um;
        assert!(rig.output.reasons == 0 && rig.output.blend_ratio == 1.0, "{rpm} rpm: {:#x}", rig.output.reasons);
    }
    println!(
        "450 to 1500 rpm: error at most {worst:.3} µm at 600 rpm's size, of 7; steps {largest:.2} of the steepest"
    );
    assert!(worst < 0.6 && worst > 1e-3 && largest < 1.4 && largest > 0.5);
}

#[test]
fn the_published_method_closes_each_revolution() {
    let mut rig = Rig::new(&VibrationConfig { method: GIB_VIBRATION_INTEGRATE, ..config() }, None);
    rig.error(600);
    let error = rig.error(4000);
    println!("integrated: {error:.3} µm of 5.2");
    assert!(error > 1e-3 && error < 0.5);
}

/// Sensors that read 5 % low and 4° late, and the table that says so.
#[test]
fn gain_and_phase_of_the_calibration_are_put_right() {
    let mut table = CalibrationTable { count: 1, ..CalibrationTable::default() };
    table.point[0] = CalibrationPoint {
        frequency_hz: 20.0,
        gain_ratio: [1.0 / 0.95; 2],
        phase_deg: [4.0; 2],
        ..CalibrationPoint::default()
    };
    for (method, most) in [(GIB_VIBRATION_HARMONIC, 0.02), (GIB_VIBRATION_INTEGRATE, 0.6)] {
        let mut errors = [0.0; 2];
        for (i, table) in [None, Some(&table)].into_iter().enumerate() {
            let mut rig = Rig::new(&VibrationConfig { method, main_harmonic: 2, ..config() }, table);
            // What the sensors would read: each harmonic 0.95 as large and 4° late, whatever its frequency.
            let mut sum = 0.0;
            for n in 0..6000 {
                let late = [SEAT, BEARING]
                    .map(|h| h.iter().map(|(k, a, p)| (*k, 0.95 * a, p + 4f64.to_radians())).collect::<Vec<_>>());
                rig.angle += rig.rate * CYCLE;
                let measured = [rig.swing(&late[0])[1], rig.swing(&late[1])[1]];
                rig.angle -= rig.rate * CYCLE;
                let error = rig.cycle(|input| input.acceleration_m_s2 = measured);
                sum += if n >= 4000 { error * error / 2000.0 } else { 0.0 };
            }
            errors[i] = f64::sqrt(sum);
        }
        println!("method {method}: {:.3} µm without, {:.3} µm with calibration", errors[0], errors[1]);
        assert!(errors[0] > 0.2 && errors[1] < most && errors[1] < errors[0]);
    }
}

#[test]
fn noise_alone_gives_next_to_no_correction() {
    let mut rig = Rig::new(&config(), None);
    rig.noise = 0.01;
    let (mut sum, mut plain) = (0.0, 0.0);
    for i in 0..40_000 {
        let noise = [rig.random.next(), rig.random.next()].map(|n| 0.01 * n);
        rig.cycle(|input| input.acceleration_m_s2 = noise);
        if i > 2000 {
            sum += rig.output.relative_um.powi(2);
            plain += 1.0;
        }
    }
    let rms = f64::sqrt(sum / plain);
    println!("0.01 m/s² of noise and no vibration: {rms:.4} µm");
    // What the noise would leave unweighted is about ten times this.
    assert!(rms < 0.12 && rms > 0.0);
}

/// Each fault fades to the plain scale without a jump, is named, and is forgotten after a good revolution.
#[test]
fn a_bad_sensor_is_named_and_faded_out() {
    type Spoil = fn(&mut VibrationInput);
    let faults: [(Spoil, u32, i32); 7] = [
        (|i| i.acceleration_m_s2[0] = f64::NAN, GIB_VIBRATION_NOT_A_NUMBER, GIB_ERR_VIBRATION_NOT_A_NUMBER),
        (|i| i.acceleration_m_s2[1] = f64::INFINITY, GIB_VIBRATION_NOT_A_NUMBER << 8, GIB_ERR_VIBRATION_NOT_A_NUMBER),
        (|i| i.acceleration_m_s2[0] = 0.123, GIB_VIBRATION_STUCK, GIB_ERR_VIBRATION_STUCK),
        (|i| i.acceleration_m_s2[1] = 0.0, GIB_VIBRATION_STUCK << 8, GIB_ERR_VIBRATION_STUCK),
        (|i| i.acceleration_m_s2[1] = -20.0, GIB_VIBRATION_SATURATED << 8, GIB_ERR_VIBRATION_SATURATED),
        (|i| i.angle_deg = f64::NAN, GIB_VIBRATION_BAD_ANGLE, GIB_ERR_VIBRATION_ANGLE),
        (|i| i.acceleration_m_s2[0] *= 40.0, GIB_VIBRATION_IMPLAUSIBLE, GIB_ERR_VIBRATION_IMPLAUSIBLE),
    ];
    for method in [GIB_VIBRATION_HARMONIC, GIB_VIBRATION_INTEGRATE] {
        for (fault, (spoil, reason, message)) in faults.into_iter().enumerate() {
            let mut rig = Rig::new(&VibrationConfig { method, ..config() }, None);
            rig.offset = [0.0; 2];
            rig.error(4000);
            assert_eq!(rig.output.phase, GIB_VIBRATION_CORRECTING);
            let (mut seen, mut last) = (false, rig.output.position_mm);
            for _ in 0..2000 {
                rig.cycle(spoil);
                seen |= rig.output.reasons & reason != 0 && rig.output.message == message;
                let jump = 1e3 * (rig.output.position_mm - last).abs();
                // What is implausible may go on to the bound, 100 µm, before it is seen. Integrated, what is stuck at
                // 0.123 m/s² goes on for a quarter turn, 25 ms: 3.1 mm/s or 1.6 µm a cycle beside what swings.
                let stuck = reason == GIB_VIBRATION_STUCK && method == GIB_VIBRATION_INTEGRATE;
                let most = if reason == GIB_VIBRATION_IMPLAUSIBLE {
                    20.0
                } else if stuck {
                    2.6
                } else {
                    1.0
                };
                assert!(jump < most, "method {method}, fault {fault}: {jump} µm");
                last = rig.output.position_mm;
            }
            assert!(
                seen,
                "method {method}, fault {fault}: {:#x} {}",
                rig.gib.report().reasons_seen,
                rig.output.message
            );
            assert!(rig.output.correction_um.abs() < 2.0, "fault {fault}: {}", rig.output.correction_um);
            rig.error(4000);
            assert!(rig.error(2000) < 0.5 && rig.output.reasons == 0, "fault {fault}: {:#x}", rig.output.reasons);
        }
    }
}

#[test]
fn without_rotation_it_is_the_plain_scale() {
    let mut rig = Rig::new(&config(), None);
    rig.error(4000);
    rig.rate = 0.0;
    rig.error(4000);
    assert!(rig.output.reasons & GIB_VIBRATION_NO_ROTATION != 0 && rig.output.position_mm == 7.0);
    assert!(rig.output.phase == GIB_VIBRATION_WAITING && rig.output.message == 0);
}

#[test]
fn a_second_slide_moves_the_seat_and_is_told_apart() {
    let mut rig = Rig::new(&VibrationConfig { second_slide: 1, ..config() }, None);
    let mut worst = 0.0f64;
    for i in 0..8000 {
        let angle = TAU * 2.0 * (rig.angle + rig.rate * CYCLE);
        let (way, omega) = (0.050 * angle.sin(), TAU * 2.0 * rig.rate);
        let error = rig.cycle(|input| {
            input.second_slide_mm = 3.0 + way;
            input.acceleration_m_s2[0] -= 1e-3 * way * omega * omega;
        });
        if i > 6000 {
            worst = worst.max(error.abs());
            assert!((rig.output.position_mm - 10.0 - way - 1e-3 * rig.output.relative_um).abs() < 1e-9);
        }
    }
    assert!(worst < 0.1, "{worst}");
}

#[test]
fn it_fades_out_when_aborted_and_fails_on_a_scale_that_is_no_number() {
    let mut rig = Rig::new(&config(), None);
    rig.error(4000);
    rig.gib.abort();
    let mut cycles = 0;
    while rig.gib.busy() {
        rig.cycle(|_| ());
        cycles += 1;
        assert!(cycles <= 202);
    }
    assert!(rig.output.status == GIB_ERR_ABORTED && rig.output.position_mm == 7.0 && cycles > 150);
    rig.gib.start(Plan::new(&config(), None)).unwrap();
    rig.error(4000);
    let before = rig.output.position_mm;
    rig.cycle(|input| input.scale_mm = f64::NAN);
    assert!(rig.output.status == GIB_ERR_NON_FINITE && rig.output.position_mm == before);
    // The correction goes from the position as after any fault, in the fade's 200 cycles, of which that was one.
    let mut last = before;
    for i in 1..=199 {
        rig.cycle(|_| ());
        assert!(rig.output.status == GIB_ERR_NON_FINITE && rig.output.phase == GIB_VIBRATION_FAILED);
        assert!((rig.output.position_mm - last).abs() < 1e-4 && (i == 199) == (rig.output.position_mm == 7.0), "{i}");
        last = rig.output.position_mm;
    }
    assert_eq!(rig.gib.fault().field, "scale_mm\0");
}

/// Drifting offsets, noise and a spindle that stops now and then: the error at the end is what it was at the start.
#[test]
fn nothing_drifts_in_a_long_run() {
    let cycles: u64 =
        std::env::var("GIB_VIBRATION_CYCLES").map_or(2_000_000, |n| n.parse().expect("a number of cycles"));
    let mut rig = Rig::new(&config(), None);
    rig.noise = 0.01;
    rig.error(20_000);
    // Averaging over 8 revolutions of 200 cycles leaves 250 independent errors in each of these.
    let early = rig.error(400_000);
    for i in 0..cycles {
        rig.offset = [0.4 + 1e-7 * (i % 1_000_000) as f64, -0.3];
        rig.cycle(|_| ());
    }
    rig.rate = 0.0;
    rig.error(5000);
    rig.rate = SPEED / 60.0;
    rig.error(20_000);
    let late = rig.error(400_000);
    println!("error {early:.4} µm at the start, {late:.4} µm after {cycles} cycles");
    assert!(late < 1.2 * early && late > 0.8 * early && early < 0.3);
}
