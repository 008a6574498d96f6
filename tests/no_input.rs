//! What a step without an input does to an axis that gib moves: it brakes, within the acceleration allowed, and the run ends by its
//! one door out.

use std::ffi::CStr;
use std::ptr::null;

use gib::abi::backlash::*;
use gib::abi::calibration::*;
use gib::abi::homing::*;
use gib::abi::learning::*;
use gib::abi::types::GibErrorDetail;
use gib::cycle::backlash::config::BacklashConfig;
use gib::cycle::backlash::io::{BacklashInput, BacklashOutput};
use gib::cycle::calibration::config::CalibrationConfig;
use gib::cycle::calibration::io::{CalibrationInput, CalibrationOutput};
use gib::cycle::homing::config::HomingConfig;
use gib::cycle::homing::io::{HomingInput, HomingOutput};
use gib::cycle::learning::config::LearningConfig;
use gib::cycle::learning::io::{LearningInput, LearningOutput};
use gib::error::*;

const CYCLE: f64 = 0.001;

/// What a step says.
struct Said {
    target: f64,
    owns: bool,
    status: i32,
}

/// Steps an axis that is where it was commanded last, without an input in `many` cycles from `missed` on. Returns the largest
/// acceleration of the command, mm/s², whether it moved in the cycle before, and what the last step said.
fn run(missed: usize, many: usize, cycles: usize, mut step: impl FnMut(Option<f64>) -> Said) -> (f64, bool, Said) {
    let (mut position, mut speed, mut hardest, mut moved) = (0.0, 0.0, 0f64, false);
    let mut said = Said { target: 0.0, owns: false, status: GIB_OK };
    for i in 0..cycles {
        let lost = (missed..missed + many).contains(&i);
        if i == missed {
            moved = said.owns && speed != 0.0;
        }
        said = step((!lost).then_some(position));
        assert!(!lost || said.status == GIB_ERR_NULL, "{i}: {}", said.status);
        let now = (said.target - position) / CYCLE;
        hardest = hardest.max((now - speed).abs() / CYCLE);
        (position, speed) = (said.target, now);
    }
    (hardest, moved, said)
}

/// The field of an instance's last error.
fn field(detail: &GibErrorDetail) -> &str {
    // SAFETY: static text.
    unsafe { CStr::from_ptr(detail.field) }.to_str().unwrap()
}

const NOTHING: GibErrorDetail =
    GibErrorDetail { code: 0, reserved: 0, field: c"".as_ptr(), value: 0.0, low: 0.0, high: 0.0 };

fn pointer<T>(input: &Option<T>) -> *const T {
    input.as_ref().map_or(null(), |input| input)
}

#[test]
fn a_calibration_without_an_input_brakes() {
    let mut config = CalibrationConfig {
        struct_size: size_of::<CalibrationConfig>() as u32,
        frequencies: 1,
        cycle_s: CYCLE,
        stroke_mm: 2.0,
        torque_bound_nm: 10.0,
        acceleration_range_m_s2: 50.0,
        lag_limit_mm: 5.0,
        speed_mm_s: 150.0,
        ..CalibrationConfig::default()
    };
    config.frequency_hz[0] = 8.0;
    let mut moving = 0;
    for many in [1, 3, 4000] {
        for missed in (1..2400).step_by(233) {
            let gib = gib_calibration_new();
            // SAFETY: a live instance and a whole configuration.
            assert_eq!(unsafe { gib_calibration_start(gib, &config) }, GIB_OK);
            let (mut out, mut n) = (CalibrationOutput::default(), 0.0);
            let (hardest, moved, said) = run(missed, many, missed + 5000, |position| {
                n += 1.0;
                let input = position.map(|position_mm| CalibrationInput {
                    position_mm,
                    acceleration_m_s2: [-0.1 * position_mm, 0.05 * position_mm + 1e-3 * f64::sin(n)],
                    ball_bar_um: 75.0 * position_mm,
                    ..CalibrationInput::default()
                });
                // SAFETY: a live instance, an input or none, an output.
                let status = unsafe { gib_calibration_step(gib, pointer(&input), &mut out) };
                Said { target: out.target_position_mm, owns: out.owns_motion == 1, status }
            });
            assert!(hardest < 5000.0, "{hardest:.0} mm/s² with none in {many} cycles from {missed} on");
            assert!(said.status == GIB_ERR_NULL && !said.owns && said.target == 0.0);
            let mut detail = NOTHING;
            // SAFETY: a live instance, which is freed after.
            unsafe { (gib_calibration_last_error(gib, &mut detail), gib_calibration_free(gib)) };
            assert_eq!((detail.code, field(&detail)), (GIB_ERR_NULL, "input"));
            moving += u32::from(moved);
        }
    }
    assert!(moving > 20, "{moving}");
}

#[test]
fn a_lost_motion_measurement_without_an_input_brakes() {
    let config = BacklashConfig {
        struct_size: size_of::<BacklashConfig>() as u32,
        cycle_s: CYCLE,
        travel_min_mm: -50.0,
        travel_max_mm: 50.0,
        torque_bound_nm: 10.0,
        ..BacklashConfig::default()
    };
    let mut moving = 0;
    for many in [1, 3, 4000] {
        for missed in (1..1200).step_by(57) {
            let gib = gib_backlash_new();
            // SAFETY: a live instance and a whole configuration.
            assert_eq!(unsafe { gib_backlash_start(gib, &config) }, GIB_OK);
            let mut out = BacklashOutput { compensation_um: 7.0, ..BacklashOutput::default() };
            let (hardest, moved, said) = run(missed, many, missed + 5000, |position| {
                let input = position.map(|position_mm| BacklashInput {
                    position_mm,
                    compensation_um: if out.request_id == 0 { 7.0 } else { out.compensation_um },
                    acknowledged_id: out.request_id,
                    ..BacklashInput::default()
                });
                // SAFETY: a live instance, an input or none, an output.
                let status = unsafe { gib_backlash_step(gib, pointer(&input), &mut out) };
                Said { target: out.target_position_mm, owns: out.owns_motion == 1, status }
            });
            assert!(hardest < 76.0, "{hardest:.0} mm/s² with none in {many} cycles from {missed} on");
            assert!(
                said.status == GIB_ERR_NULL && !said.owns && out.compensation_um == 7.0 * f64::from(out.request_id > 0)
            );
            let mut detail = NOTHING;
            // SAFETY: a live instance, which is freed after.
            unsafe { (gib_backlash_last_error(gib, &mut detail), gib_backlash_free(gib)) };
            assert_eq!((detail.code, field(&detail)), (GIB_ERR_NULL, "input"));
            moving += u32::from(moved);
        }
    }
    assert!(moving > 20, "{moving}");
}

#[test]
fn a_homing_without_an_input_brakes() {
    for motors in [1, 2] {
        let config = HomingConfig {
            struct_size: size_of::<HomingConfig>() as u32,
            direction: -1,
            motors,
            cycle_s: CYCLE,
            torque_limit_nm: 5.0,
            distance_max_mm: 100.0,
            ..HomingConfig::default()
        };
        let mut moving = 0;
        for many in [1, 3, 4000] {
            for missed in (1..1200).step_by(57) {
                let gib = gib_homing_new();
                // SAFETY: a live instance and a whole configuration.
                assert_eq!(unsafe { gib_homing_start(gib, &config) }, GIB_OK);
                let (mut out, mut commanded) = (HomingOutput::default(), 0.0);
                let (hardest, moved, said) = run(missed, many, missed + 5000, |position| {
                    let input = position.map(|position| HomingInput {
                        position_mm: [position; 2],
                        torque_limit: if out.request_id == 0 { 20.0 } else { out.torque_limit },
                        acknowledged_id: out.request_id,
                        ..HomingInput::default()
                    });
                    // SAFETY: a live instance, an input or none, an output.
                    let status = unsafe { gib_homing_step(gib, pointer(&input), &mut out) };
                    // A drive that is stopped is braked where it is.
                    commanded = if out.stop_drive == 0 { out.target_position_mm[0] } else { commanded };
                    Said { target: commanded, owns: out.owns_motion == 1, status }
                });
                assert!(hardest < 76.0, "{hardest:.0} mm/s² with none in {many} cycles from {missed} on");
                assert!(said.status == GIB_ERR_NULL && !said.owns, "{} {missed} {many}", said.status);
                assert!(out.request_id == 0 || out.torque_limit == 20.0);
                assert!(out.stop_drive == 0 || many == 4000, "{missed} {many}");
                let mut detail = NOTHING;
                // SAFETY: a live instance, which is freed after.
                unsafe { (gib_homing_last_error(gib, &mut detail), gib_homing_free(gib)) };
                assert_eq!((detail.code, field(&detail)), (GIB_ERR_NULL, "input"));
                moving += u32::from(moved);
            }
        }
        assert!(moving > 20, "{moving}");
    }
}

/// Learning moves nothing by itself: without an input the last command is repeated, with the correction that is in it.
#[test]
fn learning_without_an_input_repeats_its_command() {
    let config = LearningConfig {
        struct_size: size_of::<LearningConfig>() as u32,
        cycle_s: CYCLE,
        tolerance_um: 0.5,
        correction_max_um: 50.0,
        ..LearningConfig::default()
    };
    let gib = gib_learning_new();
    // SAFETY: a live instance and a whole configuration.
    assert_eq!(unsafe { gib_learning_start(gib, &config) }, GIB_OK);
    let mut out = LearningOutput::default();
    for i in 0..500 {
        let target_mm = f64::from(i).sin();
        let input = LearningInput { target_mm, detected_mm: target_mm, ..LearningInput::default() };
        // SAFETY: a live instance, an input or none, an output.
        unsafe {
            assert_eq!(gib_learning_step(gib, &input, &mut out), GIB_BUSY);
            let before = out.command_mm;
            assert_eq!(gib_learning_step(gib, null(), &mut out), GIB_ERR_NULL);
            assert_eq!(out.command_mm, before);
        }
    }
    // SAFETY: a live instance.
    unsafe { gib_learning_free(gib) };
}
