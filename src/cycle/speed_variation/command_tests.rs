//! The speed command: period and amplitude kept, power and torque never exceeded, every way out.

use super::config::*;
use super::io::*;
use super::machine::{SpeedVariation, WORKED_OUT};
use super::plan::Plan;
use crate::cycle::backlash::io::GIB_INPUT_ABORT;
use crate::error::*;
use crate::units::rad_s_from_rpm;
use proptest::prelude::*;

fn config() -> SpeedVariationConfig {
    SpeedVariationConfig {
        struct_size: size_of::<SpeedVariationConfig>() as u32,
        cycle_s: 0.001,
        speed_rpm: 1000.0,
        amplitude_ratio: 0.3,
        period_s: 2.0,
        inertia_kg_m2: 0.5,
        power_w: 1e4,
        ..SpeedVariationConfig::default()
    }
}

fn asked(speed_rpm: f64) -> SpeedVariationInput {
    SpeedVariationInput { speed_rpm, ..SpeedVariationInput::default() }
}

fn started(config: &SpeedVariationConfig) -> SpeedVariation {
    let mut machine = SpeedVariation::default();
    machine.start(Plan::to_start(config)).unwrap();
    machine
}

/// Asks for as long as it takes to work out what is asked for.
fn worked_out(machine: &mut SpeedVariation, input: &SpeedVariationInput) {
    for _ in 0..WORKED_OUT {
        machine.step(input);
    }
}

/// A change is gone by within the cycles stated, also when another was being worked out; until then the old one goes on.
#[test]
fn a_change_goes_by_the_old_until_it_is_worked_out() {
    for waveform in [GIB_SPEED_VARIATION_TRIANGLE, GIB_SPEED_VARIATION_SINE] {
        let mut latest = 0;
        for between in 0..22 {
            let mut machine = started(&SpeedVariationConfig { waveform, ..config() });
            for _ in 0..100 {
                machine.step(&asked(1000.0));
            }
            let mut unchanged = machine;
            for _ in 0..between {
                let input = SpeedVariationInput { period_s: 3.0, ..asked(1000.0) };
                let out = *machine.step(&input);
                let old = *unchanged.step(&asked(1000.0));
                assert!(out.speed_command_rpm == old.speed_command_rpm || out.amplitude_limit_ratio > 0.7, "{out:?}");
            }
            let last = SpeedVariationInput { amplitude_ratio: 0.11, ..asked(1000.0) };
            let cycle = (1..).find(|_| machine.step(&last).amplitude_ratio == 0.11).unwrap();
            latest = latest.max(cycle);
        }
        assert_eq!(latest, if waveform == GIB_SPEED_VARIATION_SINE { WORKED_OUT } else { 10 });
    }
}

/// A speed that changes in every cycle, as an override on its ramp, is followed as far behind as a change takes.
#[test]
fn a_speed_that_never_rests_is_followed() {
    for waveform in [GIB_SPEED_VARIATION_TRIANGLE, GIB_SPEED_VARIATION_SINE] {
        let mut machine = started(&SpeedVariationConfig { waveform, amplitude_ratio: 0.05, ..config() });
        let latest = if waveform == GIB_SPEED_VARIATION_SINE { WORKED_OUT / 2 } else { 5 };
        let ramp = |cycle: usize| 1000.0 + 0.05 * cycle as f64;
        let (mut low, mut high) = (f64::MAX, f64::MIN);
        for cycle in 0..20_000 {
            let out = *machine.step(&asked(ramp(cycle)));
            assert_eq!(
                (out.status, out.amplitude_ratio),
                (GIB_BUSY, if cycle < latest as usize { 0.0 } else { 0.05 }),
                "{cycle}"
            );
            let share = out.speed_command_rpm / ramp(cycle) - 1.0;
            (low, high) = (low.min(share), high.max(share));
        }
        assert!(low > -0.052 && low < -0.045 && high < 0.052 && high > 0.045, "{waveform} {low} {high}");
    }
}

#[test]
fn amplitude_and_period_are_kept_over_a_hundred_periods() {
    for waveform in [GIB_SPEED_VARIATION_TRIANGLE, GIB_SPEED_VARIATION_SINE] {
        for period_s in [0.7313, 2.0] {
            let mut machine = started(&SpeedVariationConfig { waveform, period_s, amplitude_ratio: 0.2, ..config() });
            let (mut low, mut high, mut crossings) = (f64::MAX, 0.0f64, vec![]);
            let mut last = 1000.0;
            for cycle in 0..(102.0 * period_s / 0.001) as usize {
                let speed = machine.step(&asked(1000.0)).speed_command_rpm;
                if cycle as f64 * 0.001 > 2.0 * period_s {
                    (low, high) = (low.min(speed), high.max(speed));
                    if last < 1000.0 && speed >= 1000.0 {
                        crossings.push(cycle as f64 + (1000.0 - last) / (speed - last));
                    }
                }
                last = speed;
            }
            let period = (crossings[crossings.len() - 1] - crossings[0]) / (crossings.len() - 1) as f64 * 0.001;
            assert!((period / period_s - 1.0).abs() < 1e-4, "{waveform} {period}");
            assert!((low - 800.0).abs() < 2.0 && (high - 1200.0).abs() < 2.0, "{waveform} {low} {high}");
            assert!(low >= 800.0 - 1e-6 && high <= 1200.0 + 1e-6);
        }
    }
}

/// What cutting takes while the speed goes back to its mean, and in the very input that ends the variation, is left to it.
#[test]
fn the_way_back_leaves_cutting_its_share() {
    for (waveform, period_s) in [(GIB_SPEED_VARIATION_TRIANGLE, 2.0), (GIB_SPEED_VARIATION_SINE, 2.5)] {
        for end in [asked(1000.0), asked(f64::NAN)] {
            for cutting_at in [0, 30] {
                let mut machine =
                    started(&SpeedVariationConfig { waveform, period_s, amplitude_ratio: 0.4, ..config() });
                while machine.step(&asked(1000.0)).speed_command_rpm > 650.0 {}
                let (mut last, mut rose, mut cycle) = (machine.output().speed_command_rpm, 0, 0);
                loop {
                    let cutting_nm = if cycle >= cutting_at { 80.0 } else { 0.0 };
                    let out =
                        *machine.step(&SpeedVariationInput { flags: GIB_SPEED_VARIATION_STOP, cutting_nm, ..end });
                    let (before, now) = (rad_s_from_rpm(last), rad_s_from_rpm(out.speed_command_rpm));
                    if now > before {
                        rose += 1;
                        let power = (0.5 * (now - before) / 0.001 + cutting_nm) * now;
                        assert!(power <= 1e4, "{waveform} {cutting_at}: {power} W in cycle {cycle}");
                    }
                    last = out.speed_command_rpm;
                    cycle += 1;
                    if out.status != GIB_BUSY {
                        break;
                    }
                }
                assert!(rose > 50 && (last - 1000.0).abs() < 1e-6, "{rose} {last}");
            }
        }
    }
}

/// A corner that is met exactly turns the slope, though the change of that cycle is still the old one.
#[test]
fn corners_met_exactly_turn_the_slope() {
    let mut met = 0;
    for amplitude_ratio in [0.125, 0.25, 0.3, 0.5] {
        for period_s in [1.024, 2.0, 2.048, 4.0] {
            let mut machine = started(&SpeedVariationConfig { period_s, amplitude_ratio, power_w: 1e5, ..config() });
            let (low, high) = (1000.0 * (1.0 - amplitude_ratio), 1000.0 * (1.0 + amplitude_ratio));
            for _ in 0..20_000 {
                let speed = machine.step(&asked(1000.0)).speed_command_rpm;
                assert!(speed >= low - 1e-6 && speed <= high + 1e-6, "{amplitude_ratio} {period_s}: {speed}");
                met += u32::from((speed - high).abs() < 1e-9);
            }
        }
    }
    assert!(met > 50, "the corners were met {met} times");
}

/// The source's example: exactly the motor's power at the top, and the print's 1.88 times it.
#[test]
fn power_at_the_top_is_all_of_the_motor_and_no_more() {
    let peak = |config: &SpeedVariationConfig| {
        let mut machine = started(config);
        let step = |machine: &mut SpeedVariation| {
            let out = machine.step(&asked(1000.0));
            out.torque_nm * rad_s_from_rpm(out.speed_command_rpm)
        };
        (0..8000).map(|_| step(&mut machine)).fold(0.0, f64::max)
    };
    let possible = Plan::new(&config()).unwrap().limits().amplitude_ratio;
    let ours = peak(&SpeedVariationConfig { amplitude_ratio: possible, ..config() });
    let formula = GIB_SPEED_VARIATION_PUBLISHED;
    let published = peak(&SpeedVariationConfig { amplitude_ratio: 0.9, formula, ..config() });
    println!("power at the top: ours {:.4} P, published {:.3} P", ours / 1e4, published / 1e4);
    assert!(ours <= 1e4 && ours >= 0.97e4, "{ours}");
    assert!((published / 1e4 - 1.88).abs() < 0.01, "{published}");
}

#[test]
fn a_stop_ends_at_the_mean_speed_and_an_abort_likewise() {
    for (flags, status) in [(GIB_SPEED_VARIATION_STOP, GIB_DONE), (GIB_INPUT_ABORT, GIB_ERR_ABORTED)] {
        for waveform in [0, 1] {
            let mut machine = started(&SpeedVariationConfig { waveform, ..config() });
            for _ in 0..1234 {
                machine.step(&asked(1000.0));
            }
            machine.step(&SpeedVariationInput { flags, ..asked(1000.0) });
            let cycles = (0..3000).find(|_| machine.step(&asked(1000.0)).status != GIB_BUSY).unwrap();
            assert_eq!(machine.output().status, status);
            assert!((machine.output().speed_command_rpm - 1000.0).abs() < 1e-6, "{cycles}");
        }
    }
}

/// Granted cycles go as far as those that are looked at: a stop that is asked for in every second cycle lets none be granted.
#[test]
fn the_way_back_is_the_same_granted_or_not() {
    for waveform in [GIB_SPEED_VARIATION_TRIANGLE, GIB_SPEED_VARIATION_SINE] {
        for from in [200, 700, 1234, 1800] {
            let mut granted = started(&SpeedVariationConfig { waveform, coulomb_nm: 4.0, ..config() });
            for _ in 0..from {
                granted.step(&asked(1000.0));
            }
            let (mut looked, mut cycles) = (granted, 0);
            let stop = SpeedVariationInput { flags: GIB_SPEED_VARIATION_STOP, ..asked(1000.0) };
            loop {
                let one = *granted.step(&stop);
                let flags = if cycles % 2 == 0 { stop.flags } else { 0 };
                let other = *looked.step(&SpeedVariationInput { flags, ..stop });
                assert!((one.speed_command_rpm - other.speed_command_rpm).abs() < 1e-9, "{cycles} {one:?} {other:?}");
                assert!(
                    (one.torque_nm - other.torque_nm).abs() < 1e-9 && one.status == other.status,
                    "{one:?} {other:?}"
                );
                cycles += 1;
                if one.status != GIB_BUSY {
                    break;
                }
            }
            assert!(cycles < 2000 && granted.output().status == GIB_DONE, "{cycles}");
        }
    }
}

#[test]
fn more_than_possible_on_the_run_is_cut_and_said() {
    let mut machine = started(&config());
    worked_out(&mut machine, &asked(1000.0));
    assert_eq!(machine.output().message, 0);
    worked_out(&mut machine, &SpeedVariationInput { amplitude_ratio: 0.9, ..asked(1000.0) });
    let out = *machine.output();
    assert_eq!((out.status, out.message), (GIB_BUSY, GIB_ERR_SPEED_VARIATION_POWER));
    assert!((out.amplitude_ratio - 0.578).abs() < 1e-3 && out.amplitude_limit_ratio == out.amplitude_ratio);
    assert!((out.period_limit_s / (2.0 * 0.9 * 1.9 / (0.578 * 1.578)) - 1.0).abs() < 0.01, "{out:?}");
    let fault = machine.step(&asked(-1000.0)).message;
    assert_eq!(fault, GIB_ERR_SPEED_VARIATION_SPEED, "the other sense is refused");
}

#[test]
fn bad_inputs_end_at_the_mean_speed() {
    for bad in [
        asked(f64::NAN),
        SpeedVariationInput { amplitude_ratio: f64::INFINITY, ..asked(1000.0) },
        SpeedVariationInput { period_s: -1.0, ..asked(1000.0) },
        SpeedVariationInput { cutting_nm: f64::NAN, ..asked(1000.0) },
    ] {
        let mut machine = started(&config());
        for _ in 0..300 {
            machine.step(&asked(1000.0));
        }
        machine.step(&bad);
        for _ in 0..3000 {
            assert!(machine.step(&bad).speed_command_rpm.is_finite());
        }
        assert!(machine.output().status < 0 && machine.fault().code == machine.output().status);
        let speed = machine.output().speed_command_rpm;
        assert!((speed - if bad.speed_rpm.is_nan() { 1000.0 } else { bad.speed_rpm }).abs() < 1e-6);
    }
}

/// Follows the commands from a cycle that asks for `input` on until there are `cycles` more that ask for it too: none changes by more
/// than the motor can at the mean speed, and the feed-forward is what each takes.
fn without_a_jump(machine: &mut SpeedVariation, input: &SpeedVariationInput, cycles: usize) -> SpeedVariationOutput {
    for _ in 0..cycles {
        let before = machine.output().speed_command_rpm;
        let out = *machine.step(input);
        let (from, to) = (rad_s_from_rpm(before), rad_s_from_rpm(out.speed_command_rpm));
        let change = to - from;
        assert!((0.5 * change / 0.001 * from.abs().max(to.abs())).abs() <= 1e4, "{before} {out:?}");
        assert!(change.abs() <= 1e4 / rad_s_from_rpm(1000.0) / 0.5 * 0.001, "{before} {out:?}");
        assert!((out.torque_nm - 0.5 * change / 0.001).abs() < 1e-6, "{before} {out:?}");
    }
    *machine.output()
}

/// An override, a spindle stop, a reversal after a stop or a fault, and a wrong input: the command goes to what is asked for.
#[test]
fn what_is_asked_for_on_the_way_back_and_after_it_is_met_without_a_jump() {
    for waveform in [GIB_SPEED_VARIATION_TRIANGLE, GIB_SPEED_VARIATION_SINE] {
        for sense in [1.0, -1.0] {
            for (speed, end) in [(700.0, GIB_DONE), (1300.0, GIB_DONE), (0.0, GIB_DONE), (-1000.0, GIB_DONE)] {
                for after in [0, 5, 300] {
                    let config = SpeedVariationConfig { waveform, speed_rpm: sense * 1000.0, ..config() };
                    let mut machine = started(&config);
                    machine.step(&asked(sense * 1000.0));
                    without_a_jump(&mut machine, &asked(sense * 1000.0), 1400);
                    let stop =
                        |speed: f64| SpeedVariationInput { flags: GIB_SPEED_VARIATION_STOP, ..asked(sense * speed) };
                    without_a_jump(&mut machine, &stop(1000.0), after + 1);
                    let out = without_a_jump(&mut machine, &stop(speed), 1400);
                    assert_eq!((out.status, out.speed_command_rpm), (end, sense * speed), "{after} {out:?}");
                    // What is met is passed through; what is no number or too fast is not.
                    for (input, passed) in
                        [(500.0, 500.0), (f64::NAN, 500.0), (2.1e5, 500.0), (-1e9, 500.0), (0.0, 0.0)]
                    {
                        let out = machine.step(&asked(input));
                        assert_eq!((out.speed_command_rpm, out.torque_nm), (passed, 0.0));
                    }
                }
            }
            for speed in [-1000.0, 0.0] {
                let config =
                    SpeedVariationConfig { waveform, speed_rpm: sense * 1000.0, speed_min_rpm: 200.0, ..config() };
                let mut machine = started(&config);
                machine.step(&asked(sense * 1000.0));
                without_a_jump(&mut machine, &asked(sense * 1000.0), 1400);
                let out = without_a_jump(&mut machine, &asked(sense * speed), 2500);
                assert_eq!((out.status, out.speed_command_rpm), (GIB_ERR_SPEED_VARIATION_SPEED, sense * speed));
            }
        }
    }
}

/// A drive that has tripped on the way is told at once what is wanted of it.
#[test]
fn a_drive_fault_after_the_end_lets_go() {
    let mut machine = started(&config());
    machine.step(&asked(1000.0));
    without_a_jump(&mut machine, &asked(1000.0), 700);
    without_a_jump(&mut machine, &asked(-1000.0), 1000);
    assert!(machine.output().status < 0 && machine.output().speed_command_rpm > -900.0);
    let out = machine.step(&SpeedVariationInput { flags: crate::cycle::backlash::io::GIB_INPUT_FAULT, ..asked(0.0) });
    assert_eq!((out.speed_command_rpm, out.torque_nm), (0.0, 0.0));
}

/// A mean speed that never rests on the way back ends in time.
#[test]
fn a_mean_speed_that_never_rests_ends_in_time() {
    let mut machine = started(&config());
    for cycle in 0..2_000_000 {
        let flags = if cycle < 1400 { 0 } else { GIB_SPEED_VARIATION_STOP };
        let speed = if cycle % 2 == 0 || cycle < 1400 { 1000.0 } else { 500.0 };
        if machine.step(&SpeedVariationInput { flags, ..asked(speed) }).status != GIB_BUSY {
            break;
        }
    }
    assert_eq!(machine.output().status, GIB_ERR_SPEED_VARIATION_NONE);
}

/// Torque and power of a cycle in which the speed changes (both rad/s): within those of `config` with that much cutting, less
/// the trifle of what accelerates that is the speed loop's.
fn within_the_motor(
    config: &SpeedVariationConfig,
    omega: f64,
    change: f64,
    cutting_nm: f64,
) -> Result<(), TestCaseError> {
    let friction = config.coulomb_nm + config.viscous_nm_s * omega;
    let accelerates = config.inertia_kg_m2 * change / config.cycle_s;
    let (rise, brake) = (accelerates / 0.9955 + friction + cutting_nm, accelerates / 0.9955 + friction);
    let [torque, power] = [config.torque_nm, config.power_w];
    if change > 1e-12 {
        prop_assert!(rise <= torque + 1e-6 && rise * omega <= power * (1.0 + 1e-9), "{} {}", rise, omega);
    }
    if change < -1e-12 {
        prop_assert!(brake >= -torque - 1e-6 && brake * omega >= -power * (1.0 + 1e-3), "{} {}", brake, omega);
    }
    Ok(())
}

/// Wherever in a period the load grows, the cycles that were granted under the load before are granted no more.
#[test]
fn a_load_that_grows_anywhere_on_a_slope_is_counted_at_once() {
    for waveform in [GIB_SPEED_VARIATION_TRIANGLE, GIB_SPEED_VARIATION_SINE] {
        let config =
            SpeedVariationConfig { waveform, amplitude_ratio: 0.25, period_s: 1.0, torque_nm: 120.0, ..config() };
        let mut machine = started(&config);
        let mut tightest = 0.0f64;
        for _ in 0..2000 {
            machine.step(&asked(1000.0));
            let mut loaded = machine;
            let mut last = rad_s_from_rpm(loaded.output().speed_command_rpm);
            for cycle in 0..2 * WORKED_OUT {
                let input = SpeedVariationInput { cutting_nm: 40.0, ..asked(1000.0) };
                let omega = rad_s_from_rpm(loaded.step(&input).speed_command_rpm);
                if cycle > 0 {
                    within_the_motor(&config, omega, omega - last, 40.0).unwrap();
                    tightest = tightest.max((0.5 * (omega - last) / 0.001 + 40.0) * omega);
                }
                last = omega;
            }
        }
        assert!(tightest > 0.9954e4, "the motor is nowhere asked for all it has: {tightest} W");
    }
}

/// On the way back from an infinite amplitude, which stays, a load that goes and comes again is counted at once.
#[test]
fn a_load_that_comes_back_beside_a_wrong_input_is_counted_at_once() {
    let config = SpeedVariationConfig { torque_nm: 120.0, ..config() };
    let mut machine = started(&config);
    for _ in 0..1800 {
        machine.step(&asked(1000.0));
    }
    let mut last = rad_s_from_rpm(machine.output().speed_command_rpm);
    assert!(last < rad_s_from_rpm(900.0), "the way back is upward");
    for cutting_nm in [[90.0; 5], [0.0; 5], [90.0; 5]].concat() {
        let input = SpeedVariationInput { amplitude_ratio: f64::INFINITY, cutting_nm, ..asked(1000.0) };
        let omega = rad_s_from_rpm(machine.step(&input).speed_command_rpm);
        within_the_motor(&config, omega, omega - last, cutting_nm).unwrap();
        last = omega;
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    /// Amplitude, period, speed and cutting torque change at random cycles: torque, power and speed stay within
    /// the motor's, and no cycle's change is more than they allow.
    #[test]
    fn never_beyond_the_limits_whatever_changes(
        changes in proptest::collection::vec((1..800usize, 300.0..2000.0f64, 0.0..0.9f64, 0.1..5.0f64, 0.0..30.0f64), 1..12),
        waveform in 0..2i32, coulomb in 0.0..10.0f64, viscous in 0.0..0.05f64, sense: bool,
    ) {
        let sign = if sense { 1.0 } else { -1.0 };
        let config = SpeedVariationConfig {
            waveform, coulomb_nm: coulomb, viscous_nm_s: viscous, torque_nm: 120.0, speed_max_rpm: 2500.0,
            speed_min_rpm: 100.0, amplitude_ratio: 0.01, speed_rpm: sign * 1000.0, ..config()
        };
        let mut machine = started(&config);
        let mut last = f64::NAN;
        for (cycles, speed, amplitude_ratio, period_s, cutting_nm) in changes {
            let input = SpeedVariationInput { amplitude_ratio, period_s, cutting_nm, ..asked(sign * speed) };
            for cycle in 0..cycles {
                let out = *machine.step(&input);
                prop_assert_eq!(out.status, GIB_BUSY);
                let omega = rad_s_from_rpm(out.speed_command_rpm * sign);
                // In the cycle of a change the load is that of before.
                if last.is_finite() && cycle > 0 {
                    let change = omega - last;
                    within_the_motor(&config, omega, change, cutting_nm)?;
                    prop_assert!((out.torque_nm * sign - 0.5 * change / 0.001).abs() < 1e-6);
                    let most = rad_s_from_rpm(2500.0);
                    prop_assert!(omega <= most * (1.0 + 1e-9) && omega >= rad_s_from_rpm(100.0) * (1.0 - 1e-9));
                }
                last = omega;
            }
        }
    }
}
