//! The laws of the generator that hides effects, and a small scoreboard of the diagnosis: a fixed part, whose cases never
//! change, and a fresh part, whose seed is printed; and single rigs of the same generator on which a law of the diagnosis shows. The
//! whole board is `cargo run --release --example scoreboard`.

#[path = "../../examples/scoreboard/board/mod.rs"]
#[allow(dead_code)]
mod board;
mod by_loop;
mod coarse_encoder;
mod generated;
mod leaning;
mod nameless;
mod predicted;
mod quiet;
mod saturated;
mod worm;

use board::case::{Case, Kind, LEAST};
use board::effects::CAUSES;
use board::moves::Command;
use board::outside;
use board::random::Random;
use board::record;
use board::rig::{Rig, ServoGains};
use board::score::{self, Score};
use board::table::{Summary, summarise};
use board::truth::Truth;
use gib::machine::Machine;

/// A seed nobody has used; printed, so that a failure can be had again.
fn fresh_seed() -> u64 {
    let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
    let seed = now.map_or(1, |d| d.as_millis() as u64 % 1_000_000_000);
    println!("fresh seed {seed}");
    seed
}

#[test]
fn what_is_hidden_is_there_and_the_files_are_valid() {
    let seed = fresh_seed();
    let mut random = Random::new(seed, 0);
    let mut kinds: Vec<Kind> = (0..5).map(|_| Kind::One(random.pick(&CAUSES))).collect();
    kinds.extend([Kind::Nothing, Kind::Two, Kind::Outside(random.pick(&outside::NAMES))]);
    let folder = tempfile::tempdir().unwrap();
    for (index, kind) in kinds.into_iter().enumerate() {
        let case = Case::draw(seed, index, kind, 11.0, false);
        let about = format!("seed {seed}, case {index}, {kind:?}");
        if kind == Kind::Nothing {
            assert!(case.difference < LEAST, "{about}: clean differs by {}", case.difference);
        } else {
            assert!(case.sizes.iter().all(|s| *s >= LEAST) && case.difference >= LEAST, "{about}: {:?}", case.sizes);
        }
        let files = case.write(folder.path()).unwrap();
        for (file, effects) in [(&files.machine, 0), (&files.truth_machine, case.effects.len())] {
            let text = std::fs::read_to_string(file).unwrap();
            let machine = Machine::parse(&text).unwrap_or_else(|e| panic!("{about}: {e}\n{text}"));
            assert_eq!(machine.axes[0].effects.len(), effects, "{about}");
        }
        let rows = std::fs::read_to_string(&files.recording).unwrap().lines().count();
        assert_eq!(rows, case.recording.position.len() + 1, "{about}");
        assert!(case.recording.torque.iter().chain(&case.holdout.torque).all(|v| v.is_finite()), "{about}");
    }
}

#[test]
fn a_seed_gives_the_same_case_again() {
    let draw = || Case::draw(12, 3, Kind::One("cogging"), 11.0, false);
    let (a, b) = (draw(), draw());
    assert_eq!((&a.recording.torque, &a.holdout.position), (&b.recording.torque, &b.holdout.position));
    assert_ne!(a.recording.torque, a.holdout.torque);
}

/// The generator against a recording that others made: same machine, same command, nothing hidden.
#[test]
fn the_servo_and_machine_are_those_of_the_sample_recording() {
    let data = std::env::var_os("GIB_DATA").map_or_else(
        || std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data"),
        std::path::PathBuf::from,
    );
    let Ok(mut reader) = csv::Reader::from_path(data.join("rig-clean/recording.csv")) else {
        println!("no rig-clean under {}: nothing compared", data.display());
        return;
    };
    let rows: Vec<Vec<f64>> =
        (reader.records()).map(|r| r.unwrap().iter().map(|v| v.parse().unwrap()).collect()).collect();
    // rig-clean/machine.json, by hand.
    let like = generated::rig();
    let servo =
        ServoGains { position_gain: 40.0, velocity_gain: 0.5277875658030852, integral_time: Some(0.02), ..like.servo };
    let rig = Rig { servo, encoder_step: 1e-4, torque_noise: 0.0, ..like };
    let period = servo.period;
    let position: Vec<f64> = rows.iter().map(|r| r[1]).collect();
    let near = |i: usize| position[i.min(position.len() - 1)];
    let speed = (0..position.len()).map(|i| (near(i + 1) - near(i.saturating_sub(1))) / (2.0 * period)).collect();
    let run = record::run(&rig, &Truth::of(&rig), &Command { position, speed }, 1e-5, &mut Random::new(1, 1));
    let position: Vec<f64> = run.position.iter().zip(&rows).map(|(a, r)| a - r[2]).collect();
    let torque: Vec<f64> = run.clean_torque.iter().zip(&rows).map(|(a, r)| a - r[4]).collect();
    let (position, torque) = (record::rms(&position), record::rms(&torque));
    println!("apart: {:.3} µm, {torque:.4} N·m", position * 1e3);
    // A grid of 0.1 µm and a sensor noise that is near 0.03 N·m while the axis moves; less would be suspicious.
    assert!(position < 3e-4, "{position} mm");
    assert!((0.02..0.06).contains(&torque), "{torque} N·m");
}

/// Diagnoses cases of these kinds, numbered from 0, as [`all_diagnosed`] does.
fn diagnosed(seed: u64, kinds: &[Kind], longest: f64, rough: bool) -> Vec<Score> {
    let cases: Vec<(u64, usize, Kind)> = kinds.iter().enumerate().map(|(index, kind)| (seed, index, *kind)).collect();
    all_diagnosed(&cases, longest, rough)
}

/// Diagnoses cases, each of a seed, a number and a kind, with the command as built, two at a time, and prints what was hidden and what
/// was said.
fn all_diagnosed(cases: &[(u64, usize, Kind)], longest: f64, rough: bool) -> Vec<Score> {
    let folder = tempfile::tempdir().unwrap();
    let one = |at: usize| {
        let (seed, index, kind) = cases[at];
        let case = Case::draw(seed, index, kind, longest, rough);
        let folder = folder.path().join(at.to_string());
        let files = case.write(&folder).unwrap();
        let score = score::diagnose(std::path::Path::new(env!("CARGO_BIN_EXE_gib")), &case, &files, &folder);
        println!("seed {seed}, case {index}, {kind:?} {:.1?}: {} {:?}", case.sizes, score.verdict, score.named);
        score
    };
    let half = |odd: usize| (0..cases.len()).filter(|i| i % 2 == odd).map(one).collect::<Vec<_>>();
    let mut scores = std::thread::scope(|scope| {
        let odd = scope.spawn(|| half(1));
        let mut even = half(0);
        even.extend(odd.join().unwrap());
        even
    });
    scores.sort_by(|a, b| a.truth.cmp(&b.truth));
    scores
}

#[test]
fn fixed_cases_are_named() {
    let kinds = [
        Kind::Nothing,
        Kind::One("coulomb_friction_mismatch"),
        Kind::One("stribeck_friction"),
        Kind::One("cogging"),
        Kind::One("dead_time"),
        Kind::One("presliding_friction"),
        Kind::One("screw_pitch_error"),
        Kind::Outside("pulsing_friction"),
    ];
    let summary = summarise(&diagnosed(1, &kinds, 12.0, false));
    assert_eq!(summary.failures, 0);
    assert_eq!(summary.first_right, (6, 6));
    assert_eq!(summary.false_alarms, (0, 1));
    assert_eq!(summary.unknown, (1, 1));
    // Good, and not better than noise allows.
    let error = summary.parameter_error.unwrap();
    assert!((1e-5..0.03).contains(&error), "median parameter error {error}");
}

/// A drive winds up, and a clearance is crossed, by all the friction and load that there is, not by that of the belief alone: where it is
/// that of the belief, tables go elsewhere, and the hold-out is half as far off again.
#[test]
fn springs_and_clearances_are_told_beside_what_resists_the_table() {
    let summary = summarise(&diagnosed(1, &[Kind::BeforeTable; 8], 12.0, false));
    assert_eq!((summary.failures, summary.first_right, summary.wrong_beside), (0, (8, 8), (0, 8)));
    assert!(summary.both_of_two.0 >= 7, "{:?}", summary.both_of_two);
    let residual = summary.against_truth.unwrap();
    assert!((0.9..1.1).contains(&residual), "{residual}");
}

/// A spring that has play is both, each with its own numbers: either by itself leaves many times as much.
#[test]
fn a_spring_with_play_is_two_causes() {
    let summary = summarise(&diagnosed(1, &[Kind::LooseSpring; 8], 12.0, false));
    assert_eq!((summary.failures, summary.wrong_beside.0), (0, 0));
    assert!(summary.both_of_two.0 >= 5, "{:?}", summary.both_of_two);
    let error = summary.parameter_error.unwrap();
    assert!((1e-5..0.02).contains(&error), "median parameter error {error}");
}

/// Each of these cases, a seed and a number, of one cause is named by itself, and as right on the hold-out as by the true model.
fn named_alone(cause: &'static str, cases: &[(u64, usize)]) -> Summary {
    let cases: Vec<(u64, usize, Kind)> = cases.iter().map(|&(seed, index)| (seed, index, Kind::One(cause))).collect();
    let summary = summarise(&all_diagnosed(&cases, 40.0, false));
    let all = cases.len();
    assert_eq!((summary.failures, summary.first_right, summary.wrong_beside), (0, (all, all), (0, all)));
    let residual = summary.against_truth.unwrap();
    assert!((0.9..1.1).contains(&residual), "{residual}");
    summary
}

/// The same, and its numbers are right: good to this share in the median, and not better than noise allows.
fn named_with_numbers(cause: &'static str, cases: &[(u64, usize)], most: f64) {
    let error = named_alone(cause, cases).parameter_error.unwrap();
    assert!((1e-5..most).contains(&error), "median parameter error {error}");
}

/// A torque in coarse steps is off by as much all along a stroke at one speed, which a step along the stroke takes as well as the load.
#[test]
fn a_load_behind_a_coarse_torque_is_no_step_along_the_stroke() {
    named_alone("constant_torque", &[(20261128, 5)]);
}

/// Right but for a thousandth of its displacement, a bristle is missed by many steps of a fine encoder; elements, by a few less.
#[test]
fn a_bristle_behind_a_fine_encoder_keeps_its_displacement() {
    named_with_numbers("presliding_friction", &[(20261128, 41)], 0.02);
}

/// The torque does not tell the exponent by which this friction falls with speed; the closed loop does, and with the usual one for it torque
/// and speed are off by a seventh and more.
#[test]
fn the_loop_tells_the_exponent_that_the_torque_leaves_open() {
    named_with_numbers("stribeck_friction", &[(20261128, 40), (777001, 72)], 0.05);
}

/// A table that seems to have all of the friction has less, and its spring is another one.
#[test]
fn a_table_that_seems_to_have_all_of_the_friction_has_less() {
    named_with_numbers("drive_compliance", &[(20261128, 77)], 0.01);
}

/// A light table that carries most of the friction, begun with as a heavy one, is a clearance; the swing of a table is no vibration beside
/// its spring; and where an axis rests its spring is wound up by what the motor gives, not by its weight.
#[test]
fn springs_are_named_whatever_the_table_and_however_it_began() {
    named_alone("drive_compliance", &[(992, 46), (991, 74), (995, 25)]);
}

/// A simulated table behind a coarse encoder swings by its grid: the rows tell a spring that is damped as none is. Means over some swings
/// tell the real one.
#[test]
fn a_spring_whose_table_the_grid_drives_is_named() {
    named_alone("drive_compliance", &[(994, 60)]);
}

/// Friction that builds up over a few steps of the encoder shows only where the axis seems to rest.
#[test]
fn friction_that_yields_over_a_micrometre_is_seen_where_the_axis_creeps() {
    named_alone("presliding_friction", &[(8118, 22), (8118, 32), (8118, 33)]);
}

/// A clearance that the low-pass of the torque smears is told by the closed loop alone: without it nothing is found here.
#[test]
fn a_clearance_that_only_the_loop_shows_is_named() {
    let summary = summarise(&all_diagnosed(&[(7711, 16, Kind::One("backlash"))], 12.0, true));
    assert_eq!((summary.failures, summary.first_right, summary.wrong_beside), (0, (1, 1), (0, 1)));
}

/// Encoder noise, friction of other formulations and pulses on the torque are no faults, and hide none.
#[test]
fn rough_rigs_raise_no_alarm() {
    let nothing = [Kind::Nothing; 4];
    let kinds = [&nothing[..], &[Kind::One("coulomb_friction_mismatch"), Kind::One("inertia_mismatch")]].concat();
    let summary = summarise(&diagnosed(5, &kinds, 12.0, true));
    assert_eq!((summary.failures, summary.false_alarms), (0, (0, 4)));
    assert_eq!((summary.first_right, summary.wrong_beside), ((2, 2), (0, 2)));
}

/// Cases nobody has seen. Right in 19 of 20, four of six is missed once in 450 runs: a failure here is worth a look.
#[test]
fn fresh_cases_are_mostly_named() {
    let seed = fresh_seed();
    let mut random = Random::new(seed, 1);
    let kinds: Vec<Kind> = (0..6).map(|_| Kind::One(random.pick(&CAUSES))).collect();
    let summary = summarise(&diagnosed(seed, &kinds, 12.0, false));
    assert_eq!(summary.failures, 0, "seed {seed}");
    assert!(summary.first_right.0 >= 4, "seed {seed}: {:?} right", summary.first_right);
}
