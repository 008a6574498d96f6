//! The laws of the generator that hides effects, and a small scoreboard of the diagnosis: a fixed part, whose cases never
//! change, and a fresh part, whose seed is printed. The whole board is `cargo run --release --example scoreboard`.

#[path = "../examples/scoreboard/board/mod.rs"]
#[allow(dead_code)]
mod board;

use board::case::{Case, Kind, LEAST};
use board::effects::CAUSES;
use board::outside;
use board::random::Random;
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
        let case = Case::draw(seed, index, kind, 11.0);
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
    let draw = || Case::draw(12, 3, Kind::One("cogging"), 11.0);
    let (a, b) = (draw(), draw());
    assert_eq!((&a.recording.torque, &a.holdout.position), (&b.recording.torque, &b.holdout.position));
    assert_ne!(a.recording.torque, a.holdout.torque);
}
