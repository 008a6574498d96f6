//! Nothing waits for ever: a swing that is granted is swung, a rise ends, a way back ends at the mean speed where the motor can.

use super::config::*;
use super::io::*;
use super::machine::SpeedVariation;
use super::plan::Plan;
use crate::error::*;

fn config(inertia_kg_m2: f64, cutting_nm: f64, period_s: f64) -> SpeedVariationConfig {
    SpeedVariationConfig {
        struct_size: size_of::<SpeedVariationConfig>() as u32,
        cycle_s: 0.001,
        speed_rpm: 1000.0,
        period_s,
        inertia_kg_m2,
        power_w: 1e4,
        cutting_nm,
        ..SpeedVariationConfig::default()
    }
}

const ASKED: SpeedVariationInput = SpeedVariationInput {
    speed_rpm: 1000.0,
    amplitude_ratio: 0.0,
    period_s: 0.0,
    cutting_nm: 0.0,
    flags: 0,
    reserved: 0,
};
const STOP: SpeedVariationInput = SpeedVariationInput { flags: GIB_SPEED_VARIATION_STOP, ..ASKED };

/// Up to the limit itself, whatever share of the motor cutting takes (95.5 N·m is all of it at the mean speed): the corner is
/// reached, in its time.
#[test]
fn what_is_granted_is_swung() {
    let mut count = 0;
    for waveform in [GIB_SPEED_VARIATION_TRIANGLE, GIB_SPEED_VARIATION_SINE] {
        for inertia in [0.01, 0.04, 0.16, 0.64] {
            for cutting in [0.0, 60.0, 76.0, 84.0, 92.0, 95.0] {
                for period in [0.5, 2.05] {
                    for share in [0.9, 0.99, 1.0] {
                        let config = SpeedVariationConfig { waveform, ..config(inertia, cutting, period) };
                        let amplitude_ratio = share * Plan::new(&config).unwrap().limits().amplitude_ratio;
                        let mut machine = SpeedVariation::default();
                        machine.start(Plan::to_start(&SpeedVariationConfig { amplitude_ratio, ..config })).unwrap();
                        let half = (0.5 * period / 0.001) as u32;
                        let (mut low, mut high, mut turns) = (f64::MAX, 0.0f64, 0);
                        let (mut last, mut rose) = (1000.0, true);
                        for cycle in 0..12 * half {
                            let speed = machine.step(&ASKED).speed_command_rpm;
                            (low, high) = (low.min(speed), high.max(speed));
                            turns += u32::from(cycle > 2 * half && (speed > last) != rose);
                            (last, rose) = (speed, speed > last);
                        }
                        // A corner is met within the way of a cycle.
                        let (swing, cycle) = (1000.0 * amplitude_ratio, 4000.0 * amplitude_ratio * 0.001 / period);
                        let at = format!(
                            "{waveform} J {inertia} cutting {cutting} R {period} share {share}: {amplitude_ratio}"
                        );
                        assert!((high - 1000.0 - swing).abs() <= cycle + 1e-3 * swing, "{at}: {high}");
                        assert!((1000.0 - low - swing).abs() <= cycle + 1e-3 * swing, "{at}: {low}");
                        assert!((9..=10).contains(&turns), "{at}: {turns} turns in ten half periods");
                        assert_eq!((machine.output().status, machine.output().message), (GIB_BUSY, GIB_OK), "{at}");
                        count += 1;
                    }
                }
            }
        }
    }
    assert_eq!(count, 288);
}

/// A motor that has less than the setting was worked out for, so that the corner is out of its reach.
#[test]
fn a_corner_out_of_reach_is_moved_and_said() {
    let mut machine = SpeedVariation::default();
    let config = SpeedVariationConfig { amplitude_ratio: 0.13, ..config(0.01, 84.0, 2.0) };
    machine.start(Plan::to_start(&config)).unwrap();
    for _ in 0..100 {
        machine.step(&ASKED);
    }
    machine.lose(0.02);
    let (mut high, mut low) = (0.0f64, f64::MAX);
    for cycle in 0..12_000 {
        let speed = machine.step(&ASKED).speed_command_rpm;
        if cycle > 4000 {
            (low, high) = (low.min(speed), high.max(speed));
        }
    }
    let out = machine.output();
    assert_eq!((out.status, out.message), (GIB_BUSY, GIB_ERR_SPEED_VARIATION_NONE));
    assert!((low - 870.0).abs() < 1.0, "it turned: {low}");
    assert!((high / 1000.0 - 1.0 - out.amplitude_ratio).abs() < 1e-3 && out.amplitude_ratio < 0.13, "{high} {out:?}");
    machine.step(&STOP);
    assert!((0..1000).any(|_| machine.step(&STOP).status == GIB_DONE));
}

/// A heavy spindle with little torque: a tenth of the mean speed in a second is 22 rad/s², and it has 0.95.
fn heavy() -> SpeedVariationConfig {
    SpeedVariationConfig {
        cycle_s: 0.0005,
        speed_rpm: 2120.26,
        amplitude_ratio: 0.0075,
        power_w: 5151.11,
        torque_nm: 4.34184,
        coulomb_nm: 1.01261,
        ..config(3.50485, 0.0, 7.0486)
    }
}

#[test]
fn a_stop_of_a_healthy_spindle_is_done_at_any_moment() {
    for (waveform, amplitude_ratio) in [(GIB_SPEED_VARIATION_TRIANGLE, 0.0075), (GIB_SPEED_VARIATION_SINE, 0.0047)] {
        let mut machine = SpeedVariation::default();
        machine.start(Plan::to_start(&SpeedVariationConfig { waveform, amplitude_ratio, ..heavy() })).unwrap();
        let asked = SpeedVariationInput { speed_rpm: heavy().speed_rpm, ..ASKED };
        for cycle in 0..30_000 {
            machine.step(&asked);
            if cycle % 200 == 0 {
                let mut stopped = machine;
                let way = (stopped.output().speed_command_rpm - asked.speed_rpm).abs() / 9.5493;
                let flags = GIB_SPEED_VARIATION_STOP;
                let end = (1..).find(|_| stopped.step(&SpeedVariationInput { flags, ..asked }).status != GIB_BUSY);
                let out = stopped.output();
                assert_eq!((out.status, out.message), (GIB_DONE, GIB_OK), "{waveform} {cycle} {out:?}");
                // 3.33 N·m are left on 3.5 kg·m²; the speed loop's share is kept back.
                let takes = way / (3.32923 / 3.50485 * 0.9955) / 0.0005;
                assert!(f64::from(end.unwrap()) <= takes + 3.0, "{waveform} {cycle}: {end:?} cycles for {takes:.1}");
            }
        }
    }
}

/// On the way back cutting takes more and more of the motor: given up where it takes all, and in time even where it never rests.
#[test]
fn a_way_back_is_given_up_only_where_the_motor_cannot() {
    let speed_rpm = heavy().speed_rpm;
    // N·m of cutting in one second and in the next two, for ever, with the end and the seconds within which it comes: the way is 1.66 rad/s.
    for (cutting, status, least, most) in [
        ([0.0, 0.0, 0.0], GIB_DONE, 0.0, 1.77),
        ([2.7, 2.7, 2.7], GIB_DONE, 1.0, 9.4),
        ([2.7, 1e3, 1e3], GIB_ERR_SPEED_VARIATION_NONE, 19.0, 20.0),
        ([3.2, 1e3, 1e3], GIB_ERR_SPEED_VARIATION_NONE, 1.0, 2.0 * 1.67 / (0.129 / 3.51) + 1.0),
        ([1e3, 1e3, 1e3], GIB_ERR_SPEED_VARIATION_NONE, 1.0, 1.2),
        ([1e3, 0.0, 0.0], GIB_DONE, 1.0, 2.8),
    ] {
        let mut machine = SpeedVariation::default();
        machine.start(Plan::to_start(&heavy())).unwrap();
        let asked = SpeedVariationInput { speed_rpm, ..ASKED };
        while machine.step(&asked).speed_command_rpm > speed_rpm * (1.0 - 0.00748) {}
        let end = (0..400_000).find(|cycle| {
            let cutting_nm = cutting[(cycle / 2000) % 3];
            machine.step(&SpeedVariationInput { cutting_nm, flags: GIB_SPEED_VARIATION_STOP, ..asked }).status
                != GIB_BUSY
        });
        let seconds = end.map_or(f64::INFINITY, |cycles| cycles as f64 * 0.0005);
        assert_eq!(machine.output().status, status, "{cutting:?} after {seconds} s");
        assert!((least..=most).contains(&seconds), "{cutting:?}: {seconds} s");
    }
}
