//! What a servo makes of a coarse encoder's noise hides what is slow: a quieter look finds it, and finds nothing where nothing is.

use crate::board::outside::{Kind, Outside};
use crate::board::random::Random;
use crate::generated::{Rig, Truth, rig, said};

/// Each is a thousandth of what the belief has, or of its friction: one look alone says that there is no discrepancy.
#[test]
fn what_the_encoders_noise_hides_is_found() {
    let alone = |seed, cause: &str, [believed, true_value]: [f64; 2], change: &dyn Fn(&mut Truth)| {
        let (verdict, findings) = said([&rig(), &rig()], seed, change);
        println!("seed {seed}: {verdict} {findings:?}");
        assert_eq!(verdict, "explained");
        let [(name, found)] = findings.as_slice() else { panic!("{findings:?}") };
        let off = (found - true_value).abs() / (true_value - believed).abs();
        assert!(name == cause && off < 0.2, "{name} {found}: off by {off}");
    };
    alone(1, "inertia_mismatch", [0.0028, 0.0028028], &|truth| truth.inertia = 0.0028028);
    alone(2, "coulomb_friction_mismatch", [0.9, 0.901], &|truth| truth.coulomb = 0.901);
    alone(3, "constant_torque", [0.0, 0.0012], &|truth| truth.constant = 0.0012);
}

#[test]
fn a_machine_as_believed_is_told_as_such_in_that_noise() {
    for seed in [11, 12] {
        let (verdict, findings) = said([&rig(), &rig()], seed, |_| ());
        assert_eq!((verdict.as_str(), findings.as_slice()), ("no_discrepancy", &[][..]), "seed {seed}");
    }
}

/// A vibration that sweeps through all frequencies is tied to nothing, and smaller than the noise of the torque sensor: that it is no noise
/// shows in that the axis follows it.
#[test]
fn what_is_tied_to_nothing_is_no_noise_where_the_axis_follows_it() {
    let fine = Rig { encoder_step: 2e-4, torque_noise: 0.05, ..rig() };
    for (seed, torque) in [(21, 0.06), (22, 0.09)] {
        let kind = Kind::SweepingVibration { f0: 5.0, f1: 60.0, time: 30.0 };
        let sweep = |truth: &mut Truth| truth.outside = Some(Outside { kind: kind.clone(), magnitude: torque });
        let (verdict, findings) = said([&fine, &fine], seed, sweep);
        assert_eq!((verdict.as_str(), findings.as_slice()), ("unknown_cause", &[][..]), "seed {seed}");
    }
}

/// What has no name and goes with time, far below what the servo makes of its encoder row by row, is seen through a wide low-pass: no recording
/// of the machine itself holds it.
#[test]
fn what_the_encoders_noise_hides_of_what_has_no_name_is_unknown() {
    for seed in [31, 32] {
        let mut random = Random::new(seed, 9);
        let values = (0..31).map(|_| random.uniform(-0.006, 0.006)).collect();
        let kind = Kind::WanderingTorque { step: 1.0, values };
        let wander = |truth: &mut Truth| truth.outside = Some(Outside { kind: kind.clone(), magnitude: 1.0 });
        let (verdict, findings) = said([&rig(), &rig()], seed, wander);
        assert_eq!((verdict.as_str(), findings.as_slice()), ("unknown_cause", &[][..]), "seed {seed}");
    }
}
