//! Torque that somebody adds to the servo's own: a closed loop is to repeat the recording, pulses and all, and noise is no pulse.
//!
//! The recordings come from an axis of the test's own: Runge-Kutta of fourth order, friction as a steep curve, another servo.

#[path = "support/random.rs"]
mod random;

use gib::machine::{Axis, Machine};
use gib::plant::added::added;
use gib::plant::closed_loop::predict;
use gib::plant::observed::Observed;
use gib::plant::servo::CommandSpeed;
use random::Random;

const BELIEVED: &str = r#"{ "schema": "gib.machine/1", "name": "t", "axes": [ { "name": "x", "drive": "linear",
    "mass_kg": 95.0, "coulomb_friction_n": 20.0, "viscous_friction_n_s_m": 200.0, "force_limit_n": 400.0,
    "servo": { "period_s": 0.001, "position_gain_1_s": 120.0, "velocity_gain_n_s_m": 8000.0, INTEGRAL
               "velocity_feedforward": FEED, "torque_time_constant_s": LAG } } ] }"#;

const ROWS: usize = 9000;
const PULSES: usize = 10;

/// What happens to one recording.
#[derive(Clone, Copy)]
struct Case {
    /// Size of the pulses, N.
    pulse: f64,
    /// Whether the force column holds them.
    seen: bool,
    /// Whether the axis feels them.
    felt: bool,
    integral_s: f64,
    lag_s: f64,
    /// Noise of the force column, N.
    noise: f64,
    /// Rows by which the force column is early.
    early: usize,
    /// The true servo's speed gain over the believed one.
    gain: f64,
    /// Share of the command's speed that is fed forward, and what the servo takes for it.
    feed: (f64, CommandSpeed),
}

const PLAIN: Case = Case {
    pulse: 60.0,
    seen: true,
    felt: true,
    integral_s: 0.0,
    lag_s: 0.0,
    noise: 0.3,
    early: 0,
    gain: 1.0,
    feed: (0.0, CommandSpeed::Central),
};

fn believed(case: &Case) -> Axis {
    let integral = match case.integral_s {
        0.0 => String::new(),
        time => format!("\"velocity_integral_time_s\": {time},"),
    };
    let text = BELIEVED.replace("INTEGRAL", &integral).replace("LAG", &case.lag_s.to_string());
    Machine::parse(&text.replace("FEED", &case.feed.0.to_string())).unwrap().axes.remove(0)
}

/// Strokes of 80 mm under the servo, a pulse of 25 ms now and then while the axis moves: at rest the steep curve would creep where
/// dry friction holds.
fn recorded(case: &Case, seed: u64) -> Observed {
    let mut random = Random(seed);
    let (period, parts) = (1e-3, 20);
    let h = period / f64::from(parts);
    let command = |row: usize| 0.04 - 0.04 * (1.7 * row as f64 * period).cos();
    let begins: Vec<(usize, f64)> = (0..PULSES)
        .map(|k| {
            let sign = if random.next() < 0.5 { -1.0 } else { 1.0 };
            (300 + k * ROWS / PULSES + (random.next() * 200.0) as usize, sign * random.between(0.6, 1.0) * case.pulse)
        })
        .collect();
    let acceleration = |v: f64, force: f64| (force - 200.0 * v - 20.0 * (v / 2e-4).tanh()) / 95.0;
    let (mut x, mut v, mut sum, mut last) = (0.0_f64, 0.0_f64, 0.0_f64, 0.0);
    // The servo's own force and the pulse's, at the motor.
    let mut force = [0.0_f64; 2];
    let (mut position, mut column) = (Vec::new(), Vec::new());
    for row in 0..ROWS {
        let read = (x / 5e-8).round() * 5e-8;
        let pulse: f64 =
            begins.iter().filter(|(begin, _)| (*begin..begin + 25).contains(&row)).map(|(_, size)| size).sum();
        let (share, speed) = case.feed;
        let (from, to) = match speed {
            CommandSpeed::Central => (row.saturating_sub(1), row + 1),
            CommandSpeed::Backward => (row.saturating_sub(1), row),
            CommandSpeed::Forward => (row, row + 1),
        };
        let commanded = (command(to) - command(from)) / ((to - from).max(1) as f64 * period);
        let error = 120.0 * (command(row) - read) + share * commanded - (read - last) / period;
        let own = case.gain * 8000.0 * (error + sum);
        sum += if case.integral_s > 0.0 { error * period / case.integral_s } else { 0.0 };
        last = read;
        let asked = [own, pulse];
        position.push(1e3 * read);
        column.push(if case.seen { force[0] + force[1] } else { force[0] } + case.noise * random.normal());
        for _ in 0..parts {
            // The lag leaves so much of a difference after a part of a cycle, and so much in its mean.
            let (rest, mean) = match case.lag_s {
                0.0 => (0.0, 0.0),
                lag => ((-h / lag).exp(), lag / h * -(-h / lag).exp_m1()),
            };
            let felt = if case.felt { 2 } else { 1 };
            let push: f64 = (0..felt).map(|i| asked[i] + (force[i] - asked[i]) * mean).sum();
            force = std::array::from_fn(|i| asked[i] + (force[i] - asked[i]) * rest);
            let k1 = acceleration(v, push);
            let k2 = acceleration(v + 0.5 * h * k1, push);
            let k3 = acceleration(v + 0.5 * h * k2, push);
            let k4 = acceleration(v + h * k3, push);
            x += h * (v + h / 6.0 * (k1 + k2 + k3));
            v += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
        }
    }
    column.rotate_left(case.early);
    let time: Vec<f64> = (0..ROWS).map(|row| row as f64 * period).collect();
    let command = (0..ROWS).map(|row| 1e3 * command(row)).collect();
    Observed::from_columns(time, position, column, Some(command), None, vec![0..ROWS]).unwrap()
}

/// The same recording with rows in between that were lost and filled in.
fn with_lost_rows(whole: &Observed) -> Observed {
    let mut some = whole.clone();
    for row in (400..ROWS - 400).step_by(617) {
        some.position[row] = 0.5 * (some.position[row - 1] + some.position[row + 1]);
        some.torque[row] = f64::NAN;
    }
    some
}

/// RMS of the closed loop's error, µm.
fn position_error(axis: &Axis, observed: &Observed) -> f64 {
    let replayed = predict(axis, observed).unwrap().closed_loop.unwrap().position;
    let square: f64 = replayed.iter().zip(&observed.position).map(|(a, b)| (1e3 * (a - b)).powi(2)).sum();
    (square / ROWS as f64).sqrt()
}

/// Whatever servo: with and without integral, with and without lag, noisy and not, the column early by a row.
#[test]
fn pulses_are_found_and_the_closed_loop_repeats_them() {
    let cases = [
        PLAIN,
        Case { noise: 0.0, ..PLAIN },
        Case { noise: 3.0, ..PLAIN },
        Case { early: 1, ..PLAIN },
        Case { integral_s: 0.03, ..PLAIN },
        Case { lag_s: 0.0007, noise: 1.0, ..PLAIN },
        Case { integral_s: 0.03, lag_s: 0.002, ..PLAIN },
    ];
    for (k, case) in cases.iter().enumerate() {
        for seed in 0..4 {
            let (axis, observed) = (believed(case), recorded(case, seed));
            let found = added(&axis, &observed, case.feed.1).unwrap();
            let quiet = position_error(&axis, &recorded(&Case { pulse: 0.0, ..*case }, seed));
            let repeated = position_error(&axis, &observed);
            println!(
                "case {k}, seed {seed}: {} pulses, {:.2} N; {quiet:.3}, {repeated:.3} µm",
                found.pulses.count, found.pulses.largest
            );
            // The error of a clean recording, and what the column's noise within the pulses moves.
            assert!(repeated < 1.5 * quiet + 0.05 + 0.03 * case.noise, "case {k}, seed {seed}: {quiet} {repeated}");
            let size = found.pulses.largest;
            assert!(size < 60.0 + 4.0 * case.noise + 0.01 && size > 50.0, "case {k}, seed {seed}: {size} N");
            // A tail of a lag may fall in two when noise hides a row of it.
            let count = found.pulses.count;
            assert!(count >= PULSES && count < 2 * PULSES, "case {k}, seed {seed}: {count}");
        }
    }
}

/// What a control takes for its command's speed is told by command, encoder and torque, whatever the machine is believed to be.
#[test]
fn the_speed_of_the_command_is_the_one_that_the_torque_shows() {
    let feed = |speed| Case { feed: (1.0, speed), integral_s: 0.03, ..PLAIN };
    for speed in CommandSpeed::ALL {
        let cases = [
            feed(speed),
            Case { noise: 3.0, ..feed(speed) },
            Case { pulse: 0.0, lag_s: 0.0007, early: 1, ..feed(speed) },
        ];
        for (k, case) in cases.iter().enumerate() {
            let observed = recorded(case, k as u64);
            let mut axis = believed(case);
            let predicted = predict(&axis, &observed).unwrap();
            assert_eq!(predicted.command_speed, speed, "case {k}");
            // As exact as where the difference is the one that is taken for granted; half a cycle of 1 m/s² is 0.5 µm and more.
            let error = position_error(&axis, &observed);
            let granted = Case { feed: (1.0, CommandSpeed::Central), ..*case };
            let usual = position_error(&axis, &recorded(&granted, k as u64));
            println!("{}, case {k}: {error:.3} µm, {usual:.3}", speed.name());
            assert!(error < 1.3 * usual + 0.05, "{}, case {k}: {error} µm, {usual}", speed.name());
            // Nor does it need every row.
            let some = with_lost_rows(&observed);
            let predicted = predict(&axis, &some).unwrap();
            assert_eq!(
                (predicted.command_speed, predicted.added.is_some()),
                (speed, case.pulse > 0.0),
                "case {k}, lost rows"
            );
            let (all, some) = (position_error(&axis, &observed), position_error(&axis, &some));
            assert!(some < 1.1 * all + 0.05, "{}, case {k}: {some} µm, without lost rows {all}", speed.name());
            axis.base.inertia *= 1.5;
            assert_eq!(predict(&axis, &observed).unwrap().command_speed, speed, "case {k}, another machine");
        }
    }
    // Nothing is fed forward: nothing can be told, and nothing is.
    assert_eq!(predict(&believed(&PLAIN), &recorded(&PLAIN, 1)).unwrap().command_speed, CommandSpeed::Central);
}

/// No pulse, one that the drive does not see, and a servo that is not the machine file's: nothing is added.
#[test]
fn neither_noise_nor_a_wrong_servo_nor_an_outside_force_is_added_torque() {
    let cases = [
        Case { pulse: 0.0, ..PLAIN },
        Case { pulse: 0.0, noise: 5.0, ..PLAIN },
        Case { pulse: 0.0, integral_s: 0.03, lag_s: 0.0007, ..PLAIN },
        Case { seen: false, ..PLAIN },
        Case { gain: 1.15, ..PLAIN },
        Case { gain: 1.15, pulse: 0.0, noise: 0.01, ..PLAIN },
    ];
    for (k, case) in cases.iter().enumerate() {
        for seed in 0..4 {
            let found = added(&believed(case), &recorded(case, seed), case.feed.1);
            assert!(found.is_none(), "case {k}, seed {seed}: {} pulses", found.unwrap().pulses.count);
        }
    }
}

/// Pulses that the torque sensor makes alone: the closed loop is better off without them.
#[test]
fn what_the_axis_does_not_feel_is_not_added() {
    let case = Case { felt: false, ..PLAIN };
    for seed in 0..4 {
        let (axis, observed) = (believed(&case), recorded(&case, seed));
        assert!(
            added(&axis, &observed, case.feed.1).is_some() && predict(&axis, &observed).unwrap().added.is_none(),
            "seed {seed}"
        );
    }
}

/// The predicted torque never knows the measured one, pulses or not.
#[test]
fn the_predicted_torque_does_not_use_the_torque_column() {
    let (axis, observed) = (believed(&PLAIN), recorded(&PLAIN, 1));
    let other =
        Observed { torque: observed.torque.iter().map(|force| 0.5 * force.cos()).collect(), ..observed.clone() };
    let torque = |observed| predict(&axis, observed).unwrap().torque.torque;
    assert_eq!(torque(&observed), torque(&other));
}
