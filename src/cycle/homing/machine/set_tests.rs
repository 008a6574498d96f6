//! The position is set: whenever a kernel adds the shift, and whether or not it answers, the axis does not move by it.

use super::*;
use crate::cycle::homing::config::HomingConfig;

/// When a kernel adds the shift, and when it answers, in cycles from the request on; and what it does not do.
#[derive(Debug, Clone, Copy)]
struct Kernel {
    shifts: u32,
    answers: u32,
    limits: bool,
}

/// How a homing ended: its status, cycles from the request to set the position, and how far the axis went from where it stood then.
struct End {
    status: i32,
    cycles: u32,
    moved: f64,
}

/// Homes an axis that follows its command and stops at −9 mm, to coordinates that begin `set_position` from there.
fn homed(config: HomingConfig, kernel: Kernel) -> End {
    let mut homing = Homing::default();
    homing.start(Plan::new(&config)).unwrap();
    let (mut x, mut torque, mut limit, mut id, mut shift) = (0.0, 0.0, 7.0, 0, 0.0);
    let (mut asked, mut set, mut moved, mut random) = (0u32, None, 0.0f64, 1u32);
    for now in 0..100_000 {
        let out = *homing.output();
        if out.request_id != id {
            asked += 1;
            let places = out.requests & GIB_HOMING_REQUEST_SET_POSITION != 0;
            if places && set.is_none() {
                set = Some((now, x));
            }
            if places && asked > kernel.shifts {
                shift = out.shift_mm[0];
            }
            let place_of_limit = set.is_none() || kernel.limits;
            if asked > if places { kernel.answers } else { 3 } {
                (id, asked) = (out.request_id, 0);
                limit = if place_of_limit { out.torque_limit } else { limit };
            }
        }
        if out.owns_motion == 1 && out.stop_drive == 0 {
            let (stop, old, goal) = (-9.0, x, out.target_position_mm[0]);
            let most = stop - (limit - 0.5) / 40.0;
            x += 0.2 * (goal.max(most) - x);
            let sliding = if (x - old).abs() > 1e-7 { 0.5 * (x - old).signum() } else { 0.3 * f64::signum(torque) };
            torque = sliding + 40.0 * f64::min(x - stop, 0.0);
            if x < stop && goal < most {
                torque = -limit;
            }
        }
        random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let noise = 0.04 * (f64::from(random >> 9) / 8_388_608.0 - 0.5);
        let input = HomingInput {
            position_mm: [x + shift, 0.0],
            torque: [torque + noise, 0.0],
            torque_limit: limit,
            acknowledged_id: id,
            flags: 0,
        };
        if !homing.quick(&input) && !homing.quick_slow(&input) {
            homing.step(&input);
        }
        if let Some((_, stood)) = set {
            moved = moved.max((x - stood).abs());
        }
        if !homing.busy() {
            let cycles = now - set.map_or(now, |(since, _)| since);
            return End { status: homing.output().status, cycles, moved };
        }
    }
    panic!("no end");
}

#[test]
fn the_axis_stays_whenever_the_shift_is_added() {
    for (set_position_mm, zero_offset_mm) in [(0.0, 1.0), (500.0, 1.0), (-40.0, 0.0), (-9.0, 2.0)] {
        let config = HomingConfig {
            struct_size: size_of::<HomingConfig>() as u32,
            direction: -1,
            cycle_s: 1e-3,
            torque_limit_nm: 2.0,
            distance_max_mm: 12.0,
            set_position_mm,
            zero_offset_mm,
            ..HomingConfig::default()
        };
        let never = u32::MAX;
        for (shifts, answers, limits, status) in [
            (5, 5, true, GIB_DONE),
            (5, 6, true, GIB_DONE),
            (5, 300, true, GIB_DONE),
            (never, 5, true, GIB_DONE),
            (5, never, true, GIB_ERR_ACK_TIMEOUT),
            (5, 5, false, GIB_ERR_ACK_TIMEOUT),
            (5, 300, false, GIB_ERR_ACK_TIMEOUT),
            (1200, never, true, GIB_ERR_ACK_TIMEOUT),
        ] {
            let kernel = Kernel { shifts, answers, limits };
            let end = homed(config, kernel);
            assert_eq!(end.status, status, "{kernel:?} to {set_position_mm} mm");
            // Two answers are waited for, a second each.
            assert!(end.cycles < 3000, "{kernel:?} to {set_position_mm} mm: {} cycles", end.cycles);
            // Off the stop, by what it may have been wound up, where nobody answers.
            let away = if status == GIB_DONE { 0.01 } else { 0.41 };
            assert!(end.moved < away, "{kernel:?} to {set_position_mm} mm: {} mm", end.moved);
        }
    }
}
