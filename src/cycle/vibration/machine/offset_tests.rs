//! A sensor whose offset becomes another, in any revolution: the correction does not jump.

use super::*;
use crate::cycle::vibration::config::VibrationConfig;

/// Largest change of the correction in a cycle, µm, of a spindle at `rpm` whose seat shakes by `shakes` m/s² twice a turn, with an offset
/// that becomes another by `steps` m/s² after so many turns.
fn largest_change(rpm: f64, shakes: f64, steps: f64, turns: f64) -> f64 {
    let config = VibrationConfig {
        struct_size: size_of::<VibrationConfig>() as u32,
        cycle_s: 1e-3,
        acceleration_range_m_s2: 50.0,
        ..VibrationConfig::default()
    };
    let mut vibration = Vibration::default();
    vibration.start(Plan::new(&config, None)).unwrap();
    let (mut last, mut largest, mut random) = (0.0, 0.0f64, 1u32);
    let mut noise = || {
        random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        0.02 * (f64::from(random >> 9) / 8_388_608.0 - 0.5)
    };
    for cycle in 0..(30.0 * 60_000.0 / rpm) as u32 {
        let gone = f64::from(cycle) * 1e-3 * rpm / 60.0;
        let wave = shakes * (2.0 * core::f64::consts::TAU * gone).cos();
        let offset = if gone > turns { steps } else { 0.0 };
        let input = VibrationInput {
            scale_mm: 1.0,
            angle_deg: 360.0 * gone.fract(),
            acceleration_m_s2: [wave + offset + noise(), noise() - 0.5 * wave],
            ..VibrationInput::default()
        };
        let mut output = VibrationOutput::default();
        _ = vibration.step(&input, &mut output);
        largest = largest.max((output.correction_um - last).abs());
        last = output.correction_um;
    }
    largest
}

#[test]
fn another_offset_in_any_revolution_is_no_jump() {
    for (rpm, shakes) in [(278.0, 0.02), (600.0, 0.1)] {
        let undisturbed = largest_change(rpm, shakes, 0.0, 0.0);
        for steps in [0.1, 2.0, 5.0] {
            for turn in 0..60 {
                let turns = 1.05 + 0.19 * f64::from(turn);
                let change = largest_change(rpm, shakes, steps, turns);
                // The largest correction, 200 µm, fades by 2 µm in a cycle, and so much may come of either sensor.
                assert!(
                    change < 3.0 * undisturbed + 6.0,
                    "{rpm} rpm, {steps} m/s² after {turns:.2} turns: {change:.1} µm"
                );
            }
        }
    }
}

#[test]
fn cycles_that_are_missing_make_no_other_vibration() {
    let config = VibrationConfig {
        struct_size: size_of::<VibrationConfig>() as u32,
        cycle_s: 1e-3,
        acceleration_range_m_s2: 50.0,
        ..VibrationConfig::default()
    };
    let (rpm, shakes) = (900.0, 0.2);
    let amplitude_um = 1e6 * shakes / (2.0 * core::f64::consts::TAU * rpm / 60.0f64).powi(2);
    for missing in [10u32, 50, 53, 54, 56, 58, 300, 500, 800, 1000] {
        for phase in 0..12 {
            let mut vibration = Vibration::default();
            vibration.start(Plan::new(&config, None)).unwrap();
            let begins = 2700 + 5 * phase;
            let mut largest = 0.0f64;
            for cycle in (0..6000).filter(|cycle| !(begins..begins + missing).contains(cycle)) {
                let gone = f64::from(cycle) * 1e-3 * rpm / 60.0;
                let wave = shakes * (2.0 * core::f64::consts::TAU * gone).cos();
                let input = VibrationInput {
                    scale_mm: 1.0,
                    angle_deg: 360.0 * gone.fract(),
                    acceleration_m_s2: [wave + 1e-6 * f64::from(cycle % 7), 1e-6 * f64::from(cycle % 5)],
                    ..VibrationInput::default()
                };
                let mut output = VibrationOutput::default();
                _ = vibration.step(&input, &mut output);
                largest = largest.max(output.correction_um.abs());
            }
            assert!(largest < 1.25 * amplitude_um, "{missing} cycles: {largest:.1} of {amplitude_um:.1} µm");
        }
    }
}

#[test]
fn a_second_slide_that_goes_round_leaves_nothing_of_its_mean() {
    let config = VibrationConfig {
        struct_size: size_of::<VibrationConfig>() as u32,
        method: crate::cycle::vibration::config::GIB_VIBRATION_INTEGRATE,
        second_slide: 1,
        cycle_s: 1e-3,
        acceleration_range_m_s2: 50.0,
        ..VibrationConfig::default()
    };
    let turns_per_s = 10.0;
    for place in 0..8 {
        let mut vibration = Vibration::default();
        vibration.start(Plan::new(&config, None)).unwrap();
        let (mut sum, mut count) = (0.0, 0.0);
        for cycle in 0..6000 {
            let gone = f64::from(cycle) * 1e-3 * turns_per_s;
            // The slide carries the seat: 50 µm once a turn, beside a place of its own.
            let angle = core::f64::consts::TAU * (gone + f64::from(place) / 8.0);
            let slide_um = 50.0 * angle.cos();
            let omega = core::f64::consts::TAU * turns_per_s;
            let input = VibrationInput {
                scale_mm: 1.0,
                second_slide_mm: 3.0 + 1e-3 * slide_um,
                angle_deg: 360.0 * gone.fract(),
                acceleration_m_s2: [-1e-6 * slide_um * omega * omega, 1e-6 * f64::from(cycle % 5)],
                ..VibrationInput::default()
            };
            let mut output = VibrationOutput::default();
            _ = vibration.step(&input, &mut output);
            if cycle >= 2000 {
                assert_eq!(output.reasons, 0);
                (sum, count) = (sum + output.correction_um, count + 1.0);
            }
        }
        let mean: f64 = sum / count;
        assert!(mean.abs() < 1.0, "from {place}/8 of a turn: {mean:.2} µm");
    }
}
