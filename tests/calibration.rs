//! The calibration against a machine that is known in closed form: seat and bearing answer the command by complex factors.

use gib::cycle::calibration::config::*;
use gib::cycle::calibration::io::*;
use gib::cycle::calibration::machine::Calibration;
use gib::cycle::calibration::plan::Plan;
use gib::error::*;
use std::f64::consts::TAU;

const CYCLE: f64 = 0.0005;

fn config(frequencies: &[f64]) -> CalibrationConfig {
    let mut config = CalibrationConfig {
        struct_size: size_of::<CalibrationConfig>() as u32,
        frequencies: frequencies.len() as i32,
        cycle_s: CYCLE,
        stroke_mm: 2.0,
        torque_bound_nm: 10.0,
        acceleration_range_m_s2: 20.0,
        measure_s: 2.0,
        ..CalibrationConfig::default()
    };
    config.frequency_hz[..frequencies.len()].copy_from_slice(frequencies);
    config
}

/// µm of seat and bearing per m/s² of the slide, and its torque.
struct Machine {
    seat: f64,
    bearing: f64,
    /// Phase of the bearing against the seat, rad.
    alpha: f64,
    /// What the accelerometers make of the truth: gain, and delay in rad per Hz.
    gain: [f64; 2],
    late: [f64; 2],
    noise: f64,
    seed: u64,
}

impl Machine {
    fn new(bearing: f64) -> Machine {
        Machine { seat: 0.5, bearing, alpha: 3.0, gain: [0.95, 1.05], late: [0.001, -0.0005], noise: 0.005, seed: 3 }
    }

    fn noise(&mut self) -> f64 {
        self.seed = self.seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        self.noise * ((self.seed >> 11) as f64 / (1u64 << 52) as f64 - 1.0) * 3f64.sqrt()
    }

    /// The answer to the last command; the phase of the command is told by the output's position and speed.
    fn answer(&mut self, out: &CalibrationOutput) -> CalibrationInput {
        let omega = TAU * out.frequency_hz;
        let mut input = CalibrationInput { position_mm: out.target_position_mm, ..CalibrationInput::default() };
        if omega == 0.0 {
            return input;
        }
        let (sin, cos) = (out.target_position_mm, out.target_speed_mm_s / omega);
        let shaped = |size: f64, phase: f64| size * 1e-3 * omega * omega * (sin * phase.cos() + cos * phase.sin());
        let (seat, bearing) = (shaped(self.seat, 0.1), shaped(self.bearing, 0.1 + self.alpha));
        let read = |i: usize, size: f64, phase: f64| {
            -1e-6 * omega * omega * self.gain[i] * shaped(size, phase - self.late[i] * out.frequency_hz)
        };
        input.acceleration_m_s2 = [read(0, self.seat, 0.1) + 0.3, read(1, self.bearing, 0.1 + self.alpha) - 0.2];
        input.ball_bar_um = seat - bearing + 20.0;
        input.torque = 1.5 * cos.signum() - 1e-3 * sin * omega * omega * 1.2;
        for a in &mut input.acceleration_m_s2 {
            *a += self.noise();
        }
        input.ball_bar_um += 5.0 * self.noise();
        input
    }

    /// Runs to the end; `spoil` may change the input of a cycle.
    fn run(
        &mut self,
        gib: &mut Calibration,
        mut spoil: impl FnMut(usize, &CalibrationOutput, &mut CalibrationInput),
    ) -> usize {
        let mut cycles = 0;
        while gib.busy() {
            let mut input = self.answer(gib.output());
            spoil(cycles, gib.output(), &mut input);
            gib.step(&input);
            let out = gib.output();
            assert!(out.target_position_mm.is_finite() && out.target_position_mm.abs() <= 2.0001);
            cycles += 1;
            assert!(cycles < 1_000_000);
        }
        cycles
    }
}

fn calibrated(config: &CalibrationConfig, bearings: &[f64]) -> Calibration {
    let mut gib = Calibration::default();
    for (i, bearing) in bearings.iter().enumerate() {
        gib.start(Plan::new(&CalibrationConfig { add: i32::from(i > 0), ..*config })).unwrap();
        Machine::new(*bearing).run(&mut gib, |_, _, _| ());
        assert_eq!(gib.output().status, GIB_DONE, "{:?}", gib.fault());
    }
    gib
}

#[test]
fn two_experiments_yield_gain_and_phase_within_their_uncertainty() {
    let gib = calibrated(&config(&[10.0, 20.0, 40.0]), &[0.4, 0.15]);
    let table = gib.table().unwrap();
    assert_eq!((table.count, table.check()), (3, Ok(())));
    for point in table.points() {
        println!("{point:?}");
        for (i, (gain, late)) in [(0.95, 0.001), (1.05, -0.0005)].into_iter().enumerate() {
            let phase = f64::to_degrees(late * point.frequency_hz);
            assert!((point.gain_ratio[i] - 1.0 / gain).abs() < 0.04);
            assert!((point.gain_ratio[i] - 1.0 / gain).abs() < 1.5 * point.gain_uncertainty_ratio[i] + 1e-4);
            assert!((point.phase_deg[i] - phase).abs() < 1.5 * point.phase_uncertainty_deg[i] + 0.01);
            assert!(point.gain_uncertainty_ratio[i] < 0.08 && point.experiments == 2.0);
        }
        assert!(point.condition_ratio > 2.0 && point.condition_ratio < 100.0);
    }
}

#[test]
fn the_amplitude_is_the_largest_that_stroke_and_torque_allow() {
    let mut gib = Calibration::default();
    gib.start(Plan::new(&config(&[5.0, 10.0, 20.0]))).unwrap();
    let (mut torque, mut plain) = ([0f64; 3], Machine::new(0.4));
    plain.run(&mut gib, |_, out, input| {
        if out.phase == GIB_CALIBRATION_MEASURE {
            torque[out.point as usize] = torque[out.point as usize].max(input.torque.abs());
        }
    });
    let amplitudes: Vec<f64> = gib.table().unwrap().points().iter().map(|p| p.amplitude_mm).collect();
    println!("amplitudes {amplitudes:?}, torques {torque:?}");
    // 5 Hz: the stroke; 20 Hz: six tenths of 10 N·m, short of it by what a last small step was not worth.
    assert_eq!(amplitudes[0], 2.0);
    assert!(torque[2] > 4.5 && torque[2] < 6.1 && torque[0] < 6.1);
}

/// One experiment with opposite phases: the published formula is refused, least squares says how little it knows.
#[test]
fn opposite_phase_is_quantified() {
    let mut gib = Calibration::default();
    gib.start(Plan::new(&CalibrationConfig { method: GIB_CALIBRATION_PUBLISHED, ..config(&[20.0]) })).unwrap();
    Machine { alpha: 3.137, ..Machine::new(0.4) }.run(&mut gib, |_, _, _| ());
    assert_eq!((gib.output().status, gib.fault().code), (GIB_ERR_CALIBRATION_CONDITION, GIB_ERR_CALIBRATION_CONDITION));
    assert!(gib.fault().value > 10.0);
    let gib = calibrated(&config(&[20.0]), &[0.4]);
    let point = gib.table().unwrap().points()[0];
    assert!(
        point.condition_ratio > 1e6 && point.gain_uncertainty_ratio[0] > 0.05 && point.residual_um < 0.2,
        "{point:?}"
    );
}

#[test]
fn an_experiment_is_added_only_to_its_like() {
    let mut gib = Calibration::default();
    let refused = |gib: &mut Calibration, config: &CalibrationConfig| gib.start(Plan::new(config)).unwrap_err().code;
    let one = config(&[20.0]);
    assert_eq!(refused(&mut gib, &CalibrationConfig { add: 1, ..one }), GIB_ERR_CALIBRATION_ADD);
    let mut gib = calibrated(&one, &[0.4]);
    assert_eq!(refused(&mut gib, &CalibrationConfig { add: 1, ..config(&[21.0]) }), GIB_ERR_CALIBRATION_ADD);
    gib.start(Plan::new(&CalibrationConfig { add: 1, ..one })).unwrap();
    assert_eq!(refused(&mut gib, &one), GIB_ERR_STATE);
}

/// Every fault in every state is named, and ends where the axis stood, or with the drive stopped.
#[test]
fn every_way_out_ends_at_rest() {
    type Spoil = fn(&mut CalibrationInput);
    let faults: [(Spoil, i32, bool); 12] = [
        (|i| i.flags = 0x80, GIB_ERR_CONFIG, false),
        (|i| i.flags = 2, GIB_ERR_ABORTED, false),
        (|i| i.torque = f64::NAN, GIB_ERR_NON_FINITE, false),
        (|i| i.ball_bar_um = f64::INFINITY, GIB_ERR_NON_FINITE, false),
        (|i| i.acceleration_m_s2[1] = f64::NAN, GIB_ERR_NON_FINITE, false),
        (|i| i.acceleration_m_s2[0] = -20.0, GIB_ERR_CALIBRATION_SATURATED, false),
        (|i| i.ball_bar_um = 1000.0, GIB_ERR_CALIBRATION_SATURATED, false),
        (|i| i.torque = 10.1, GIB_ERR_TORQUE_BOUND, false),
        (|i| i.flags = 1, GIB_ERR_DRIVE_FAULT, true),
        (|i| i.position_mm = f64::NAN, GIB_ERR_NON_FINITE, true),
        (|i| i.position_mm = 2.4, GIB_ERR_LAG, true),
        (|i| i.position_mm = 3.0, GIB_ERR_TRAVEL_BOUND, true),
    ];
    let phases = [GIB_CALIBRATION_RISE, GIB_CALIBRATION_PROBE, GIB_CALIBRATION_MEASURE, GIB_CALIBRATION_FALL];
    for (spoil, code, at_once) in faults {
        for phase in phases {
            let mut gib = Calibration::default();
            gib.start(Plan::new(&CalibrationConfig { lag_limit_mm: 0.3, ..config(&[10.0, 20.0]) })).unwrap();
            let (mut struck, mut before) = (0, 0.0);
            let cycles = Machine::new(0.4).run(&mut gib, |cycle, out, input| {
                let step = out.target_position_mm - before;
                before = out.target_position_mm;
                assert!(step.abs() < 0.06, "a jump of {step} mm");
                if struck == 0 && out.phase == phase && cycle > 300 {
                    struck = cycle;
                }
                if struck > 0 {
                    spoil(input);
                }
            });
            let named = if code == GIB_ERR_LAG || code == GIB_ERR_TRAVEL_BOUND {
                gib.fault().code == GIB_ERR_LAG || gib.fault().code == GIB_ERR_TRAVEL_BOUND
            } else {
                gib.fault().code == code
            };
            assert!(named && gib.output().status == gib.fault().code, "{code} in {phase}: {:?}", gib.fault());
            let out = gib.output();
            assert!(out.owns_motion == 0 && out.target_speed_mm_s == 0.0 && out.message == gib.fault().code);
            if at_once {
                assert!(cycles - struck <= 1 && (out.stop_drive == 1) == (code != GIB_ERR_DRIVE_FAULT));
            } else {
                assert!(cycles - struck < 1200 && out.target_position_mm == 0.0 && out.stop_drive == 0);
            }
        }
    }
}

#[test]
fn a_stuck_or_deaf_sensor_is_named() {
    let mut gib = Calibration::default();
    gib.start(Plan::new(&config(&[20.0]))).unwrap();
    Machine::new(0.4).run(&mut gib, |_, _, input| input.ball_bar_um = 3.0);
    assert_eq!(gib.output().status, GIB_ERR_CALIBRATION_STUCK);
    gib.start(Plan::new(&config(&[20.0]))).unwrap();
    Machine { gain: [0.0; 2], ..Machine::new(0.4) }.run(&mut gib, |_, _, _| ());
    assert_eq!(gib.output().status, GIB_ERR_CALIBRATION_SIGNAL);
    gib.start(Plan::new(&config(&[20.0]))).unwrap();
    Machine { gain: [-1.0, -1.0], ..Machine::new(0.4) }.run(&mut gib, |_, _, _| ());
    assert_eq!(gib.output().status, GIB_ERR_CALIBRATION_GAIN);
}

/// A gain that is none: which sensor's, and at which frequency.
#[test]
fn the_sensor_and_the_frequency_of_a_gain_are_named() {
    for (gain, field) in [([-1.0, 1.0], "gain_ratio[0]\0"), ([1.0, -1.0], "gain_ratio[1]\0")] {
        let mut gib = Calibration::default();
        for (add, bearing) in [(0, 0.4), (1, 0.15)] {
            gib.start(Plan::new(&CalibrationConfig { add, tolerance_ratio: 0.3, ..config(&[10.0, 20.0]) })).unwrap();
            let mut machine = Machine::new(bearing);
            let turned = Machine { gain, ..Machine::new(bearing) };
            let mut cycles = 0;
            while gib.busy() {
                // Only the second frequency meets the sensor that is turned round.
                machine.gain = if gib.output().point == 1 { turned.gain } else { [1.0; 2] };
                let input = machine.answer(gib.output());
                gib.step(&input);
                cycles += 1;
                assert!(cycles < 1_000_000);
            }
            if gib.output().status != GIB_DONE {
                break;
            }
        }
        assert_eq!((gib.output().status, gib.fault().field), (GIB_ERR_CALIBRATION_GAIN, field));
        assert_eq!(gib.output().point, 1);
        assert!((gib.output().frequency_hz - 20.0).abs() < 0.1);
    }
}
