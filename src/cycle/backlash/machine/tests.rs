//! Whole measurements on an axis without inertia whose table sticks, slips and gets ahead of the motor when a test says so.

use super::*;
use crate::cycle::backlash::config::BacklashConfig;

const STIFFNESS: f64 = 200.0;
const FRICTION: f64 = 2.0;
const CLEARANCE: f64 = 0.04;

/// A motor that is where the command is, but for `ahead`; a clearance, a spring, and a table that slides at `FRICTION`.
struct Axis {
    ahead: f64,
    motor: f64,
    table: f64,
    /// Cycles in the present phase of the output.
    since: u32,
    phase: i32,
    random: u32,
}

impl Axis {
    fn torque(&mut self) -> f64 {
        let spring = |stretch: f64| STIFFNESS * (stretch - stretch.clamp(-0.5 * CLEARANCE, 0.5 * CLEARANCE));
        let torque = spring(self.motor - self.table);
        if torque.abs() > FRICTION {
            self.table += (torque.abs() - FRICTION).copysign(torque) / STIFFNESS;
        }
        self.random = self.random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        torque.clamp(-FRICTION, FRICTION) + 0.02 * (f64::from(self.random) / f64::from(u32::MAX) - 0.5)
    }
}

fn config() -> BacklashConfig {
    BacklashConfig {
        struct_size: size_of::<BacklashConfig>() as u32,
        cycle_s: 0.001,
        travel_min_mm: -20.0,
        travel_max_mm: 20.0,
        torque_bound_nm: 10.0,
        encoder_um: 0.01,
        ..BacklashConfig::default()
    }
}

/// Runs a measurement, see `measured_as`.
fn measured(happens: impl Fn(&mut Axis, f64)) -> (Backlash, f64) {
    measured_as(config(), happens)
}

/// Runs a measurement; `happens` may move motor and table in every cycle. Also returns the lost motion that is true, µm. The command keeps its acceleration.
fn measured_as(config: BacklashConfig, happens: impl Fn(&mut Axis, f64)) -> (Backlash, f64) {
    let mut gib = Box::<Backlash>::default();
    gib.start(Plan::new(&config)).expect("a good configuration");
    let mut axis = Axis { ahead: 0.0, motor: 0.0, table: 0.0, since: 0, phase: 0, random: 1 };
    let mut out = *gib.output();
    for _ in 0..200_000 {
        let torque = axis.torque();
        let input = BacklashInput {
            position_mm: axis.motor,
            torque,
            compensation_um: out.compensation_um,
            acknowledged_id: out.request_id,
            flags: 0,
        };
        if !gib.quick(&input) {
            gib.step(&input);
        }
        let change = (gib.output().target_speed_mm_s - out.target_speed_mm_s).abs();
        let most = 1.5 * gib.plan.acceleration * gib.plan.cycles_per_s;
        assert!(change <= most + 1e-9, "{change} of {most} mm/s in a cycle, {} to {}", out.phase, gib.output().phase);
        out = *gib.output();
        axis.since = if out.phase == axis.phase { axis.since + 1 } else { 0 };
        axis.phase = out.phase;
        // The sense in which the axis came to the reversal.
        happens(&mut axis, -gib.sense);
        if out.owns_motion == 1 {
            axis.motor = out.target_position_mm + axis.ahead;
        }
        if !gib.busy() {
            break;
        }
    }
    (*gib, 1e3 * (CLEARANCE + 2.0 * FRICTION / STIFFNESS))
}

/// Checks that a measurement has come to its end with the truth in its interval.
fn holds(gib: &Backlash, truth: f64) {
    let mean = gib.report().mean;
    assert_eq!(gib.output().status, GIB_DONE, "{:?}", gib.fault());
    let off = (mean.lost_motion_um - truth).abs();
    assert!(off <= mean.uncertainty_um, "{} ± {} and not {truth} µm", mean.lost_motion_um, mean.uncertainty_um);
}

/// Moves the motor `jump` (mm) further in the old sense within ten cycles, from cycle `at` of `phase` on, and back to the command
/// by `back` (mm) a cycle.
fn jumps(axis: &mut Axis, before: f64, phase: i32, at: u32, jump: f64, back: f64) {
    if axis.phase == phase && (at..at + 10).contains(&axis.since) {
        axis.ahead += before * 0.1 * jump;
    } else {
        axis.ahead -= axis.ahead.clamp(-back, back);
    }
}

#[test]
fn an_axis_without_troubles_is_measured() {
    let (gib, truth) = measured(|_, _| ());
    holds(&gib, truth);
}

#[test]
fn the_command_keeps_its_acceleration_also_behind_the_probe() {
    let (gib, truth) = measured_as(BacklashConfig { acceleration_mm_s2: 1.0, ..config() }, |_, _| ());
    holds(&gib, truth);
}

#[test]
fn a_table_that_breaks_away_after_the_turn_shortens_nothing() {
    for jump in [0.005, 0.015, 0.04] {
        let (gib, truth) = measured(|axis, before| jumps(axis, before, GIB_BACKLASH_SCAN, 20, jump, 4e-5));
        holds(&gib, truth);
        assert!(gib.slipped);
    }
}

#[test]
fn a_table_that_breaks_away_long_after_the_turn_is_refused() {
    let (gib, _) = measured(|axis, before| jumps(axis, before, GIB_BACKLASH_SCAN, 200, 0.04, 4e-5));
    let fault = gib.fault();
    assert_eq!((fault.code, fault.field), (GIB_ERR_BACKLASH_SHAPE, "travel_before_slip_um\0"));
}

#[test]
fn a_motor_that_came_back_while_it_crept_shortens_nothing() {
    // Into the clearance before the scan begins: of its furthest point only the creep tells.
    let (gib, truth) = measured(|axis, before| jumps(axis, before, GIB_BACKLASH_SLIDE_IN, 2550, 0.06, 2e-4));
    holds(&gib, truth);
}

#[test]
fn a_table_that_leaves_the_drive_slack_before_the_turn_is_refused() {
    let (gib, _) = measured(|axis, before| {
        if axis.phase == GIB_BACKLASH_SETTLE && axis.since == 20 {
            axis.table = axis.motor + before * 0.2 * CLEARANCE;
        }
    });
    let fault = gib.fault();
    assert_eq!((fault.code, fault.field), (GIB_ERR_BACKLASH_SHAPE, "release_um\0"));
}

#[test]
fn a_kernel_that_answers_and_leaves_another_amount_in_force_owes_the_restore() {
    let mut gib = Box::<Backlash>::default();
    gib.start(Plan::new(&config())).expect("a good configuration");
    let old = BacklashInput { compensation_um: 1.0, ..BacklashInput::default() };
    let answered = |gib: &Backlash, compensation_um: f64| BacklashInput {
        compensation_um,
        acknowledged_id: gib.output().request_id,
        ..BacklashInput::default()
    };
    gib.step(&old);
    gib.step(&answered(&gib, 0.0));
    gib.abort();
    // The old amount is one resolution; what is in force is none.
    while gib.busy() {
        gib.step(&answered(&gib, 0.0));
    }
    assert_eq!((gib.output().message, gib.report().restore_owed), (GIB_ERR_RESTORE_UNCONFIRMED, 1));
    // Rounding is no fault.
    gib.step(&answered(&gib, 0.5));
    assert_eq!(gib.report().restore_owed, 0);
}

#[test]
fn unknown_flags_are_named_and_a_faulted_drive_is_one_with_them_too() {
    for (flags, code) in [(1 << 7, GIB_ERR_CONFIG), (GIB_INPUT_FAULT | 1 << 7, GIB_ERR_DRIVE_FAULT)] {
        let mut gib = Box::<Backlash>::default();
        gib.start(Plan::new(&config())).expect("a good configuration");
        gib.step(&BacklashInput { flags, ..BacklashInput::default() });
        assert_eq!(gib.fault().code, code);
    }
}
