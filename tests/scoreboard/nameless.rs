//! A law that has no name here is not put together from causes that have one.

use crate::board::outside::{Kind, Outside};
use crate::generated::{Rig, Truth, rig, said};

/// Wrong dry friction with a dip of another exponent leaves as little of it as the logarithm itself does, if the numbers of the belief may not be
/// off beside that.
#[test]
fn friction_by_the_logarithm_of_speed_is_unknown() {
    for (seed, from, magnitude, torque_noise) in [(102, 10.0, 0.08, 0.02), (120, 2.5, 0.5, 0.1)] {
        let kind = Kind::LogarithmicFriction { from, speed: 250.0 };
        let quiet = Rig { encoder_step: 2e-4, torque_noise, ..rig() };
        let hide = |truth: &mut Truth| truth.outside = Some(Outside { kind: kind.clone(), magnitude });
        let (verdict, findings) = said([&quiet, &quiet], seed, hide);
        assert_eq!((verdict.as_str(), findings.as_slice()), ("unknown_cause", &[][..]), "seed {seed}");
    }
}
