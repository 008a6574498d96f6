//! The diagnosis on motions and torques written down as formulas (no simulation, no code of the product), and on measured
//! data where they are at hand.

use gib::diagnosis::{Diagnosis, Excerpt, Stopped, Verdict, diagnose};
use gib::machine::{Axis, Cause, Effect, Machine};
use gib::recording::{Column, Recording};
use std::f64::consts::TAU;
use std::path::PathBuf;

const MACHINE: &str = r#"{"schema":"gib.machine/1","name":"t","axes":[{"name":"x","drive":"ball_screw","lead_mm":10,
  "motor_pole_pairs":4,"inertia_kg_m2":0.003,"coulomb_friction_nm":0.9,"viscous_friction_nm_s":0.008,
  "constant_torque_nm":0.1}]}"#;

fn axis() -> Axis {
    Machine::parse(MACHINE).unwrap().axes.remove(0)
}

/// Uniform noise of unit variance; the seed is the argument.
fn noise(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5) * 12f64.sqrt()
    }
}

/// 30 s at 1 kHz: two sines of incommensurate periods, 0.01 µm grid, torque noise 0.03 N·m. `extra` adds to the believed
/// torque: of time (s), position (mm), speed (mm/s), acceleration (mm/s²).
fn recording(extra: impl Fn(f64, f64, f64, f64) -> f64) -> Recording {
    let (w1, w2) = (TAU * 0.21, TAU * 0.57);
    let unit = TAU / 10.0;
    let mut noise = noise(11);
    let mut columns = [Vec::new(), Vec::new(), Vec::new()];
    for i in 0..30_000 {
        let t = f64::from(i) * 1e-3;
        let x = 100.0 + 60.0 * (w1 * t).sin() + 12.0 * (w2 * t).sin();
        let v = 60.0 * w1 * (w1 * t).cos() + 12.0 * w2 * (w2 * t).cos();
        let a = -60.0 * w1 * w1 * (w1 * t).sin() - 12.0 * w2 * w2 * (w2 * t).sin();
        let believed = 0.003 * a * unit + 0.008 * v * unit + 0.9 * v.signum() + 0.1;
        columns[0].push(t);
        columns[1].push((x * 1e5).round() / 1e5);
        columns[2].push(believed + extra(t, x, v, a) + 0.03 * noise());
    }
    let [time, x, torque] = columns;
    Recording::from_columns("test", time, vec![Column::new("x.position_mm", x), Column::new("x.torque_nm", torque)])
        .unwrap()
}

fn judged(recording: &Recording) -> Diagnosis {
    judged_by(&axis(), recording)
}

fn judged_by(axis: &Axis, recording: &Recording) -> Diagnosis {
    diagnose(axis, &Excerpt::of(recording, axis), None, &|_, _| true).unwrap()
}

/// The cause is named alone, and each parameter is within `tolerance` of the truth, relative.
fn finds(cause: Cause, truth: &[f64], tolerance: f64, recording: &Recording) {
    let d = judged(recording);
    let named: Vec<Cause> = d.findings.iter().map(|f| f.effect.cause()).collect();
    assert_eq!(named, [cause], "{d:?}");
    for (found, truth) in d.findings[0].effect.values().iter().zip(truth) {
        assert!((found / truth - 1.0).abs() < tolerance, "{cause}: {found} for {truth}");
    }
    // The gain is real and not better than noise allows.
    let gain = &d.gains[0];
    assert!(gain.after < gain.before && gain.after > 0.2 * d.unexplained.torque.noise_rms, "{gain:?}");
}

#[test]
fn a_machine_as_believed_is_left_alone() {
    let d = judged(&recording(|_, _, _, _| 0.0));
    assert_eq!(d.verdict, Verdict::NoDiscrepancy, "{d:?}");
    assert!(d.findings.is_empty() && d.extended == axis());
}

#[test]
fn each_law_is_found_under_its_own_name() {
    let unit = TAU / 10.0;
    finds(Cause::InertiaMismatch, &[0.0036], 0.05, &recording(|_, _, _, a| 0.0006 * a * unit));
    finds(Cause::CoulombFrictionMismatch, &[1.0], 0.02, &recording(|_, _, v, _| 0.1 * v.signum()));
    finds(Cause::ViscousFrictionMismatch, &[0.010], 0.03, &recording(|_, _, v, _| 0.002 * v * unit));
    finds(Cause::ConstantTorque, &[0.2], 0.02, &recording(|_, _, _, _| 0.1));
    finds(Cause::DirectionDependentFriction, &[0.002], 0.05, &recording(|_, _, v, _| 0.002 * (v * unit).abs()));
    finds(
        Cause::StribeckFriction,
        &[0.2, 8.0],
        0.08,
        &recording(|_, _, v, _| 0.2 * v.signum() * (-(v / 8.0).powi(2)).exp()),
    );
    finds(Cause::Cogging, &[0.06, 2.5], 0.05, &recording(|_, x, _, _| 0.06 * (TAU * x / 2.5 + 0.7).sin()));
    finds(Cause::CableForce, &[0.003], 0.03, &recording(|_, x, _, _| 0.003 * x));
    finds(Cause::ExternalVibration, &[17.3, 0.06], 0.05, &recording(|t, _, _, _| 0.06 * (TAU * 17.3 * t + 1.0).sin()));
    finds(Cause::ThermalDrift, &[0.3, 7.0], 0.1, &recording(|t, _, v, _| 0.3 * (-t / 7.0).exp() * v.signum()));
    finds(
        Cause::PositionDependentFriction,
        &[120.0, 0.2, 9.0],
        0.1,
        &recording(|_, x, v, _| 0.2 * v.signum() * (-((x - 120.0) / 9.0).powi(2)).exp()),
    );
}

/// Friction and load take 1.0 N·m one way and 0.8 the other.
#[test]
fn a_motor_that_is_not_linear_within_its_friction_is_found() {
    let unit = TAU / 10.0;
    for limit in [1.05, 0.95] {
        let beyond = |_: f64, _: f64, v: f64, a: f64| {
            let delivered = 0.003 * a * unit + 0.008 * v * unit + 0.9 * v.signum() + 0.1;
            delivered.signum() * (delivered.abs() - limit).max(0.0) * (1.0 / 0.4 - 1.0)
        };
        finds(Cause::TorqueSaturation, &[limit, 0.4], 0.05, &recording(beyond));
    }
}

#[test]
fn a_drift_slower_than_the_recording_is_named_and_its_end_is_not_known() {
    for most in [0.2, 0.6] {
        let found = judged(&recording(|t, _, v, _| most * (1.0 - t / 30.0) * v.signum()));
        let [finding] = found.findings.as_slice() else { panic!("{:?}", found.findings) };
        let Effect::ThermalDrift { drop, time_constant_s, until_s } = finding.effect else { panic!("{finding:?}") };
        assert!((drop / most - 1.0).abs() < 0.05 && (until_s - 30.0).abs() < 0.1, "{finding:?}");
        // Any longer one would do as well.
        assert!(time_constant_s > 60.0 && finding.deviations[1] > 0.5 * time_constant_s, "{finding:?}");
        assert!(found.gains[0].after < 0.7 * found.gains[0].before, "{:?}", found.gains);
    }
}

#[test]
fn a_vibration_in_a_narrow_band_is_named_and_noise_of_any_colour_is_none() {
    // Through a resonance that forgets in so many seconds: a band of 1/(2π) of that width either side.
    let resonant = |hz: f64, seconds: f64, size: f64| {
        let (mut noise, mut rows) = (noise(5), Vec::with_capacity(30_000));
        let (kept, turn) = ((-1e-3 / seconds).exp(), TAU * hz * 1e-3);
        let (mut a, mut b) = (0.0, 0.0);
        for _ in 0..60_000 {
            (a, b) = (
                kept * (a * turn.cos() - b * turn.sin()) + noise(),
                kept * (a * turn.sin() + b * turn.cos()) + noise(),
            );
            rows.push(a * size * (1e-3 / seconds).sqrt());
        }
        rows.split_off(30_000)
    };
    let of = |rows: Vec<f64>| judged(&recording(|t, _, _, _| rows[(t * 1e3).round() as usize]));
    let confidence = [(6.2, 0.1), (17.3, 0.1), (17.3, 0.02)].map(|(hz, size)| {
        let found = of(resonant(hz, 8.0, size));
        let [finding] = found.findings.as_slice() else { panic!("{:?} {:?}", found.verdict, found.findings) };
        let Effect::ExternalVibration { frequency_hz, .. } = finding.effect else { panic!("{finding:?}") };
        assert!((frequency_hz - hz).abs() < 2.5 * finding.deviations[0] && finding.deviations[0] < 0.1, "{finding:?}");
        assert!(found.extended == axis() && found.notes.len() == 1, "{:?}", found.notes);
        finding.confidence
    });
    assert!(0.95 < confidence[2] && confidence[2] < confidence[1], "a weaker one is less sure: {confidence:?}");
    // Wide: a fortieth of a second.
    let found = of(resonant(12.0, 0.025, 0.1));
    assert!(found.findings.is_empty(), "{:?}", found.findings);
}

#[test]
fn two_at_once_are_both_found() {
    let d = judged(&recording(|_, x, v, _| 0.1 * v.signum() + 0.06 * (TAU * x / 2.5).sin()));
    let mut named: Vec<Cause> = d.findings.iter().map(|f| f.effect.cause()).collect();
    named.sort();
    assert_eq!(named, [Cause::CoulombFrictionMismatch, Cause::Cogging], "{d:?}");
    assert!(d.findings.windows(2).all(|w| w[0].share >= w[1].share));
}

#[test]
fn a_ripple_of_few_periods_over_the_stroke_is_found_and_a_single_swing_is_none() {
    // The stroke is 144 mm: about two, three and five periods.
    for period in [70.0, 50.0, 28.0] {
        let ripple = recording(|_, x, _, _| 0.2 * (TAU * x / period + 0.7).sin());
        finds(Cause::Cogging, &[0.2, period], 0.01, &ripple);
    }
    let detent = |_: f64, x: f64, _: f64, _: f64| {
        let u = (x - 110.0) / 9.0;
        0.5 * u * (-u * u).exp()
    };
    let d = judged(&recording(detent));
    assert_eq!((d.verdict, d.findings.len()), (Verdict::UnknownCause, 0), "{d:?}");
    assert!(d.unexplained.torque.describes.contains("position"), "{}", d.unexplained.torque.describes);
}

#[test]
fn a_bump_or_a_step_of_friction_at_one_speed_is_no_sum_of_frictions() {
    let bump = |_: f64, _: f64, v: f64, _: f64| 0.4 * v.signum() * (-((v.abs() - 50.0) / 12.0).powi(2)).exp();
    let d = judged(&recording(bump));
    assert_eq!((d.verdict, d.findings.len()), (Verdict::UnknownCause, 0), "{d:?}");
    assert!(d.unexplained.torque.describes.contains("velocity"), "{}", d.unexplained.torque.describes);
    let step = |_: f64, _: f64, v: f64, _: f64| 0.1 * v.signum() * (1.0 + ((v.abs() - 40.0) / 3.0).tanh());
    let d = judged(&recording(step));
    assert_eq!((d.verdict, d.findings.len()), (Verdict::UnknownCause, 0), "{d:?}");
    // What goes back at speed and not to nothing is what it is.
    let both = |_: f64, _: f64, v: f64, _: f64| v.signum() * (0.1 - 0.3 * (-(v / 15.0).powi(2)).exp());
    let named: Vec<Cause> = judged(&recording(both)).findings.iter().map(|f| f.effect.cause()).collect();
    assert_eq!(named.len(), 2, "{named:?}");
    assert!([Cause::StribeckFriction, Cause::CoulombFrictionMismatch].iter().all(|c| named.contains(c)), "{named:?}");
}

/// There and back at 100 mm/s, where rows are 400 steps of the scale's grid apart and a little more: its error beats every
/// 20 mm. What is finer than either grid is no runout, however well it repeats; what is there is found.
#[test]
fn grids_that_beat_are_no_error_of_the_screw() {
    let (grid, finer) = (2.5e-4, 5e-5);
    let speed = 1e3 * 400.005 * grid;
    // A scale has a zero of its own.
    let zero = 38.217;
    let recording = |period: f64, swing: f64| {
        let mut noise = noise(17);
        let mut columns = [Vec::new(), Vec::new(), Vec::new(), Vec::new()];
        // 1.5 s one way, 0.4 s to turn, and the same back.
        let way = |i: u32| match i % 3800 {
            i @ ..1500 => (1.0, f64::from(u8::from(i == 0)) * 0.5),
            i @ ..1900 => (1.0 - f64::from(i - 1500) / 200.0, if i == 1500 { -0.5 } else { -1.0 }),
            i @ ..3400 => (-1.0, f64::from(u8::from(i == 1900)) * -0.5),
            i => (f64::from(i - 3400) / 200.0 - 1.0, if i == 3400 { 0.5 } else { 1.0 }),
        };
        let (mut x, unit) = (0.0, TAU / 10.0);
        for i in 0..30_000 {
            let (v, a) = (speed * way(i).0, speed / 0.2 * way(i).1);
            let table = zero + x + swing * (TAU * x / period).sin();
            columns[0].push(1e-3 * f64::from(i));
            columns[1].push((x / finer).round() * finer);
            columns[2].push((table / grid).round() * grid);
            columns[3].push(0.003 * a * unit + 0.008 * v * unit + 0.9 * sign(v) + 0.1 + 0.03 * noise());
            x += 0.5e-3 * (v + speed * way(i + 1).0);
        }
        let [time, x, table, torque] = columns;
        let columns = [("x.position_mm", x), ("x.table_position_mm", table), ("x.torque_nm", torque)];
        let columns = columns.map(|(name, values)| Column::new(name, values)).into();
        Recording::from_columns("grids", time, columns).unwrap()
    };
    let d = judged(&recording(20.0, 0.0));
    assert_eq!((d.verdict, d.findings.len()), (Verdict::NoDiscrepancy, 0), "{:?}", d.findings);
    let d = judged(&recording(10.0, 3e-4));
    let found = d.findings.first().map(|f| f.effect.values()).unwrap_or_default();
    assert!(
        d.findings.len() == 1 && (found[0] - 0.3).abs() < 0.015 && (found[1] - 10.0).abs() < 0.01,
        "{:?}",
        d.findings
    );
}

fn sign(v: f64) -> f64 {
    if v == 0.0 { 0.0 } else { v.signum() }
}

/// Rows that are not used are told, with their number, the first of them, and what to do; so is a column that holds nothing.
#[test]
fn rows_that_are_not_used_are_told() {
    let whole = recording(|_, _, v, _| 0.3 * v.signum());
    let with = |change: fn(&mut Vec<f64>, &mut Vec<f64>, &mut Vec<f64>)| {
        let (mut time, mut x) = (whole.time_s.to_vec(), whole.columns[0].values.clone());
        let mut torque = whole.columns[1].values.clone();
        change(&mut time, &mut x, &mut torque);
        let columns = vec![Column::new("x.position_mm", x), Column::new("x.torque_nm", torque)];
        judged(&Recording::from_columns("rows", time, columns).unwrap())
    };
    let told = |d: &Diagnosis, words: &[&str]| d.notes.iter().any(|n| words.iter().all(|word| n.contains(word)));
    let d = with(|_, _, torque| torque[700..703].fill(f64::NAN));
    assert!(told(&d, &["x.torque_nm", "3 times", "row 702", "left out"]), "{:?}", d.notes);
    assert!(d.verdict == Verdict::Explained && d.to_json().to_string().contains("row 702"));
    let d = with(|time, _, _| time[9000..].iter_mut().for_each(|t| *t += 0.5));
    assert!(told(&d, &["rows are missing", "row 9002"]), "{:?}", d.notes);
    let d = with(|time, _, _| time[500] = time[499]);
    assert!(told(&d, &["repeats", "row 502"]), "{:?}", d.notes);
    let d = with(|_, _, torque| torque.fill(0.0));
    assert!(d.verdict == Verdict::InsufficientData && d.missing[0].contains("every row"), "{:?}", d.missing);
    assert!(judged(&whole).notes.is_empty());
    // A unit that is none of the format's is named, with those that are.
    let columns = vec![whole.columns[0].clone(), Column::new("x.torque_kn", whole.columns[1].values.clone())];
    let d = judged(&Recording::from_columns("unit", whole.time_s.to_vec(), columns).unwrap());
    assert!(["x.torque_kn", "\"kn\"", "nm"].iter().all(|word| d.missing[0].contains(word)), "{:?}", d.missing);
}

#[test]
fn a_law_without_a_name_is_not_imitated_by_several_that_have_one() {
    /// Torque of time, position, speed and acceleration.
    type Extra = fn(f64, f64, f64, f64) -> f64;
    let laws: [(&str, Extra); 8] = [
        ("cube of speed", |_, _, v, _| 0.15 * (v / 60.0).powi(3)),
        ("step along the stroke", |_, x, _, _| if x > 104.0 { 0.1 } else { -0.1 }),
        ("grows with acceleration", |_, _, v, a| 0.2 * v.signum() * (a / 150.0).abs()),
        ("power of acceleration", |_, _, _, a| 0.3 * (a / 150.0).powi(3)),
        ("square of the way from one place", |_, x, _, _| 0.2 * ((x - 100.0) / 60.0).powi(2)),
        ("drag that changes evenly along the stroke", |_, x, v, _| 0.15 * (v / 60.0) * (x - 100.0) / 60.0),
        ("friction that is another from one moment on", |t, _, v, _| if t > 17.0 { 0.2 * v.signum() } else { 0.0 }),
        ("push changes evenly in time", |t, _, v, a| 0.004 * t * (0.0019 * a + 0.005 * v + 0.9 * v.signum() + 0.1)),
    ];
    for (goes, law) in laws {
        let d = judged(&recording(law));
        assert_eq!((d.verdict, d.findings.len()), (Verdict::UnknownCause, 0), "{goes}: {d:?}");
        assert!(d.notes.iter().any(|note| note.contains(goes)), "{goes}: {:?}", d.notes);
    }
}

#[test]
fn what_fits_nothing_is_called_unknown() {
    // A torque that jumps between levels at irregular times.
    let level = |t: f64| if ((t * 0.37).sin() + (t * 0.83).sin()) > 0.2 { 0.25 } else { -0.25 };
    let d = judged(&recording(|t, _, _, _| level(t)));
    assert_eq!(d.verdict, Verdict::UnknownCause, "{:?}", d.findings);
    let describes = &d.unexplained.torque.describes;
    assert!(d.findings.is_empty() && describes.contains("lives in"), "{describes}");
}

/// A current that was filtered over some rows makes noise that second differences see too little of; what wanders over seconds is
/// of the same size, and no noise.
#[test]
fn noise_of_a_filtered_current_is_no_discrepancy_and_a_wandering_one_is() {
    let mut noise = noise(29);
    let mut lagged = |kept: f64| -> Recording {
        let size = 0.06 * (1.0f64 - kept * kept).sqrt();
        let mut value = 0.0;
        let follow = |_| {
            value = kept * value + size * noise();
            value
        };
        let values: Vec<f64> = (0..30_000).map(follow).collect();
        recording(|t, _, _, _| values[(1e3 * t).round() as usize])
    };
    for kept in [0.7, 0.85] {
        assert_eq!(judged(&lagged(kept)).verdict, Verdict::NoDiscrepancy, "{kept}");
    }
    assert_eq!(judged(&lagged(0.9995)).verdict, Verdict::UnknownCause);
}

#[test]
fn what_the_hold_out_contradicts_is_not_named() {
    let (more, as_believed) = (recording(|_, _, v, _| 0.3 * v.signum()), recording(|_, _, _, _| 0.0));
    let excerpt = |recording| Excerpt::of(recording, &axis());
    let with = |holdout| diagnose(&axis(), &excerpt(&more), Some(&excerpt(holdout)), &|_, _| true).unwrap();
    assert_eq!(with(&more).verdict, Verdict::Explained);
    let d = with(&as_believed);
    assert_eq!((d.verdict, d.findings.len(), d.extended), (Verdict::UnknownCause, 0, axis()));
    let said = |note: &String| note.contains("coulomb_friction_mismatch") && note.contains("hold-out");
    assert!(d.notes.iter().any(said), "{:?}", d.notes);
}

/// Without a servo block nobody knows that the torque column is half a row late, in either recording.
#[test]
fn what_the_sampling_makes_late_is_late_on_the_hold_out_too() {
    let heavy = Machine::parse(&MACHINE.replace("0.003", "0.3")).unwrap().axes.remove(0);
    let (w1, w2) = (TAU * 0.21, TAU * 0.57);
    let acceleration = |t: f64| -60.0 * w1 * w1 * (w1 * t).sin() - 12.0 * w2 * w2 * (w2 * t).sin();
    let late = recording(|t, _, _, a| (0.3 * acceleration(t - 0.5e-3) - 0.003 * a) * TAU / 10.0);
    let excerpt = Excerpt::of(&late, &heavy);
    let d = diagnose(&heavy, &excerpt, Some(&excerpt), &|_, _| true).unwrap();
    assert_eq!(d.verdict, Verdict::NoDiscrepancy, "{:?}", d.notes);
    assert!(d.notes.iter().any(|note| note.contains("late against the position column")), "{:?}", d.notes);
}

/// A servo answers what its encoder is off by from row to row, and what it then asks for seems early.
#[test]
fn what_a_servo_makes_of_its_encoders_noise_is_no_delay() {
    const VELOCITY_GAIN: f64 = 0.4;
    let servo =
        r#""constant_torque_nm":0.1,"servo":{"period_s":0.001,"position_gain_1_s":40,"velocity_gain_nm_s":0.4}"#;
    let axis = Machine::parse(&MACHINE.replace(r#""constant_torque_nm":0.1"#, servo)).unwrap().axes.remove(0);
    let mut noisy = recording(|_, _, _, _| 0.0);
    let mut noise = noise(1);
    let mut before = 0.0;
    let [position, torque] = noisy.columns.as_mut_slice() else { panic!() };
    for (x, torque) in position.values.iter_mut().zip(&mut torque.values) {
        let off = 1e-3 * noise();
        *x = ((*x + off) * 1e5).round() / 1e5;
        *torque -= VELOCITY_GAIN * (off - before) / 1e-3 * TAU / 10.0;
        before = off;
    }
    let named: Vec<Cause> = judged_by(&axis, &noisy).findings.iter().map(|finding| finding.effect.cause()).collect();
    assert!(!named.contains(&Cause::DeadTime), "{named:?}");
}

/// A vibration of which nobody knows within half a row when its torque was read is known no better than that, however quiet the rows are.
#[test]
fn an_amplitude_is_no_surer_than_the_sampling_of_its_torque() {
    let shakes = |late_s: f64| {
        // The motor holds a part of what disturbs the axis, which gives way to the rest.
        let omega = TAU * 60.0;
        let swing_mm = 0.1 / (0.003 * omega * omega) / (TAU / 10.0);
        let mut shaken = recording(|t, _, _, _| 0.2 * (omega * (t - late_s)).sin());
        for (t, x) in shaken.time_s.iter().zip(&mut shaken.columns[0].values) {
            *x += swing_mm * (omega * t + 0.9).sin();
        }
        judged(&shaken)
    };
    let told = [0.0, 0.4e-3].map(|late_s| {
        let d = shakes(late_s);
        let [finding] = d.findings.as_slice() else { panic!("{d:?}") };
        assert_eq!(finding.effect.cause(), Cause::ExternalVibration);
        (finding.effect.values()[1], finding.deviations[1])
    });
    let [(one, std), (other, _)] = told;
    assert!((one - other).abs() > 0.005 && (one - other).abs() < 2.0 * std && std < 0.02, "{told:?}");
}

#[test]
fn what_acts_on_the_hold_out_alone_is_unknown_there() {
    let clean = recording(|_, _, _, _| 0.0);
    let excerpt = |recording: &Recording| Excerpt::of(recording, &axis());
    let with = |friction: f64| {
        let holdout = recording(|_, _, v, _| friction * v.signum());
        diagnose(&axis(), &excerpt(&clean), Some(&excerpt(&holdout)), &|_, _| true).unwrap()
    };
    assert_eq!(with(0.0).verdict, Verdict::NoDiscrepancy);
    let d = with(0.3);
    assert_eq!((d.verdict, d.findings.len()), (Verdict::UnknownCause, 0));
    assert!(d.notes.iter().any(|note| note.contains("diagnose the hold-out by itself")), "{:?}", d.notes);
    // Too few rows to be judged say nothing.
    let whole = recording(|_, _, v, _| 0.3 * v.signum());
    let first = |values: &[f64]| values[..600].to_vec();
    let columns = whole.columns.iter().map(|column| Column::new(&column.name, first(&column.values))).collect();
    let short = Recording::from_columns("short", first(&whole.time_s), columns).unwrap();
    let d = diagnose(&axis(), &excerpt(&clean), Some(&excerpt(&short)), &|_, _| true).unwrap();
    assert_eq!(d.verdict, Verdict::NoDiscrepancy, "{:?}", d.notes);
}

#[test]
fn too_little_data_is_said_with_what_is_missing() {
    let whole = recording(|_, _, _, _| 0.0);
    let cut = |rows: std::ops::Range<usize>| {
        let columns = whole.columns.iter().map(|c| Column::new(&c.name, c.values[rows.clone()].to_vec())).collect();
        Recording::from_columns("cut", whole.time_s[rows.clone()].to_vec(), columns).unwrap()
    };
    let short = judged(&cut(0..400));
    assert!(short.verdict == Verdict::InsufficientData && short.missing[0].contains("record"), "{short:?}");
    let no_torque = Recording::from_columns("t", whole.time_s.to_vec(), vec![whole.columns[0].clone()]).unwrap();
    let blind = judged(&no_torque);
    assert!(blind.verdict == Verdict::InsufficientData && blind.missing[0].contains("x.torque_nm"), "{blind:?}");
}

#[test]
fn it_stops_when_told_to() {
    let excerpt = Excerpt::of(&recording(|_, _, v, _| 0.1 * v.signum()), &axis());
    let stopped = diagnose(&axis(), &excerpt, None, &|_, _| false);
    assert_eq!(stopped.err(), Some(Stopped));
}

#[test]
fn an_extended_machine_survives_its_file_and_answers_no_discrepancy() {
    let r = recording(|_, _, v, _| 0.1 * v.signum());
    let d = judged(&r);
    let mut machine = Machine::parse(MACHINE).unwrap();
    machine.axes[0] = d.extended;
    let again = Machine::parse(&machine.to_json().to_string()).unwrap();
    assert_eq!(judged_by(&again.axes[0], &r).verdict, Verdict::NoDiscrepancy);
}

/// A table that stands while the motor turns (a coupling has slipped) is no pitch of a screw: no file may hold that scale.
#[test]
fn what_no_machine_file_may_hold_is_not_named() {
    let mut r = recording(|_, _, v, _| 0.1 * v.signum());
    r.columns.push(Column::new("x.table_position_mm", vec![100.0; 30_000]));
    let d = judged(&r);
    assert_eq!((d.verdict, d.findings.len()), (Verdict::UnknownCause, 0), "{d:?}");
    let mut machine = Machine::parse(MACHINE).unwrap();
    machine.axes[0] = d.extended;
    Machine::parse(&machine.to_json().to_string()).unwrap();
}

fn data(path: &str) -> Option<PathBuf> {
    let beside = || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/data");
    let root = std::env::var_os("GIB_DATA").map_or_else(beside, PathBuf::from);
    let file = root.join(path);
    if file.exists() {
        return Some(file);
    }
    println!("skipped: {} is not at hand", file.display());
    None
}

#[test]
fn the_clean_rig_is_clean() {
    let (Some(machine), Some(recording)) = (data("rig-clean/machine.json"), data("rig-clean/recording.csv")) else {
        return;
    };
    let axis = Machine::load(&machine).unwrap().axes.remove(0);
    let d = judged_by(&axis, &Recording::open(&recording).unwrap());
    assert_eq!(d.verdict, Verdict::NoDiscrepancy, "{:?}", d.findings);
}

#[test]
fn emps_shows_timing_direction_dip_and_ripple_and_not_what_it_has_not() {
    let (Some(machine), Some(recording)) = (data("emps/machine.json"), data("emps/emps.csv")) else { return };
    let axis = Machine::load(&machine).unwrap().axes.remove(0);
    let d = judged_by(&axis, &Recording::open(&recording).unwrap());
    let of = |cause: Cause| d.findings.iter().find(|f| f.effect.cause() == cause).map(|f| f.effect.values());
    let delay = of(Cause::DeadTime).unwrap()[0];
    assert!((-1.6..-0.3).contains(&delay), "{delay}");
    assert!(of(Cause::DirectionDependentFriction).unwrap()[0] < -20.0);
    let dip = of(Cause::StribeckFriction).unwrap();
    assert!((-12.0..-4.0).contains(&dip[0]) && (5.0..25.0).contains(&dip[1]), "{dip:?}");
    let ripple = of(Cause::Cogging).unwrap();
    assert!((2.45..2.55).contains(&ripple[1]), "{ripple:?}");
    for absent in [Cause::ThermalDrift, Cause::QuadraticDrag, Cause::InertiaMismatch] {
        assert!(of(absent).is_none(), "{absent}");
    }
    assert!((0.5..1.2).contains(&d.gains[0].after), "{:?}", d.gains);
}
