//! Friction that builds up after a reversal, by formulations that are written down here and stepped finely along a formula's
//! motion: each is found under its name, and at its own stiffness.

use gib::diagnosis::{Excerpt, Verdict, diagnose};
use gib::machine::{Axis, Cause, Effect, Machine};
use gib::recording::{Column, Recording};
use std::f64::consts::{PI, TAU};

const MACHINE: &str = r#"{"schema":"gib.machine/1","name":"t","axes":[{"name":"x","drive":"linear","mass_kg":40,
  "coulomb_friction_n":30,"viscous_friction_n_s_m":60}]}"#;
/// Coulomb force, N, and that over the stiffness, mm.
const LEVEL: f64 = 30.0;
const DISPLACEMENT: f64 = 0.025;
/// Time of a step, s.
const STEP_S: f64 = 5e-6;

/// LuGre with micro-damping: ż = v − |v|·z/z₁, F = σ₀·z + σ₁·ż.
fn lugre(damping_s: f64) -> impl FnMut(f64) -> f64 {
    let mut z = 0.0;
    move |dx: f64| {
        let change = dx - dx.abs() * z / DISPLACEMENT;
        z += change;
        LEVEL / DISPLACEMENT * (z + damping_s * change / STEP_S)
    }
}

/// Maxwell slip: springs of equal stiffness that slip beyond displacements spread evenly.
fn maxwell(count: usize) -> impl FnMut(f64) -> f64 {
    let mut strained = vec![0.0f64; count];
    move |dx| {
        for (k, strained) in strained.iter_mut().enumerate() {
            let most = 2.0 * DISPLACEMENT * (k as f64 + 0.5) / count as f64;
            *strained = (*strained + dx).clamp(-most, most);
        }
        LEVEL / DISPLACEMENT * strained.iter().sum::<f64>() / count as f64
    }
}

/// Elasto-plastic (Dupont et al. 2002): elastic up to seven tenths of the level, and on every way back.
fn elasto_plastic() -> impl FnMut(f64) -> f64 {
    let mut z = 0.0f64;
    move |dx: f64| {
        let beyond = ((z.abs() / DISPLACEMENT - 0.7) / 0.3).clamp(0.0, 1.0);
        let slips = if z * dx > 0.0 { 0.5 - 0.5 * (PI * beyond).cos() } else { 0.0 };
        z += dx * (1.0 - slips * z.abs() / DISPLACEMENT);
        LEVEL / DISPLACEMENT * z
    }
}

/// Dahl's law with an exponent.
fn dahl(exponent: f64) -> impl FnMut(f64) -> f64 {
    let mut z = 0.0f64;
    move |dx: f64| {
        z += dx * (1.0 - z * dx.signum() / DISPLACEMENT).max(0.0).powf(exponent);
        LEVEL / DISPLACEMENT * z
    }
}

/// 30 s at 1 kHz, grid 0.1 µm, noise 0.4 N: two sines of incommensurate periods.
fn recording(mut friction: impl FnMut(f64) -> f64) -> Recording {
    let waves = [(60.0, TAU * 0.23), (12.0, TAU * 0.61)];
    let sum = |of: &dyn Fn(f64, f64) -> f64| waves.iter().map(|(size, w)| of(*size, *w)).sum::<f64>();
    let place = |t: f64| sum(&|size, w| size * (w * t).sin());
    let mut seed = 11u64;
    let mut noise = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5) * 12f64.sqrt()
    };
    let [mut time, mut position, mut force] = [Vec::new(), Vec::new(), Vec::new()];
    let (mut last, mut held) = (place(0.0), 0.0);
    for row in 0..30_000 {
        let t = f64::from(row) * 1e-3;
        let (v, a) = (sum(&|size, w| size * w * (w * t).cos()), sum(&|size, w| -size * w * w * (w * t).sin()));
        time.push(t);
        position.push((last * 1e4).round() * 1e-4);
        force.push(40.0 * a * 1e-3 + 60.0 * v * 1e-3 + held + 0.4 * noise());
        for k in 1..=200 {
            let x = place(t + f64::from(k) * STEP_S);
            held = friction(x - last);
            last = x;
        }
    }
    Recording::from_columns("t", time, vec![Column::new("x.position_mm", position), Column::new("x.force_n", force)])
        .unwrap()
}

/// The effect that is found, which is alone, holds the true displacement in its 95 % and is within `tolerance` of it.
fn found(tolerance: f64, friction: impl FnMut(f64) -> f64) -> Effect {
    let axis: Axis = Machine::parse(MACHINE).unwrap().axes.remove(0);
    let d = diagnose(&axis, &Excerpt::of(&recording(friction), &axis), None, &|_, _| true).unwrap();
    let named: Vec<Cause> = d.findings.iter().map(|f| f.effect.cause()).collect();
    assert_eq!((d.verdict, named.as_slice()), (Verdict::Explained, &[Cause::PreslidingFriction][..]), "{d:?}");
    let (value, deviation) = (d.findings[0].effect.values()[0] * 1e-3, d.findings[0].deviations[0] * 1e-3);
    assert!((value / DISPLACEMENT - 1.0).abs() < tolerance, "{value} mm");
    assert!((value - DISPLACEMENT).abs() < (2.5 * deviation).max(0.03 * DISPLACEMENT), "{value} ± {deviation} mm");
    assert!(d.gains[0].after < d.gains[0].before, "{:?}", d.gains[0]);
    d.findings[0].effect
}

#[test]
fn a_bristle_with_and_without_damping_keeps_its_stiffness() {
    for damping_s in [0.0, 0.002, 0.01] {
        let effect = found(0.03, lugre(damping_s));
        let Effect::PreslidingFriction { exponent, maxwell_slip, micro_damping_s, .. } = effect else { unreachable!() };
        assert_eq!((exponent, maxwell_slip), (1.0, 0.0));
        assert!((micro_damping_s - damping_s).abs() < 3e-4, "{micro_damping_s} s for {damping_s}");
    }
}

#[test]
fn elements_that_slip_are_told_by_the_stiffness_of_all() {
    for count in [4, 10, 40] {
        let effect = found(0.06, maxwell(count));
        let Effect::PreslidingFriction { exponent, maxwell_slip, .. } = effect else { unreachable!() };
        assert!((exponent - 0.5).abs() < 0.15 && maxwell_slip == 1.0, "{count} elements: {effect:?}");
    }
}

#[test]
fn bristles_of_another_exponent_keep_their_stiffness() {
    for (exponent, tolerance) in [(0.5, 0.05), (1.5, 0.05)] {
        let Effect::PreslidingFriction { exponent: is, maxwell_slip, .. } = found(tolerance, dahl(exponent)) else {
            unreachable!()
        };
        assert!((is - exponent).abs() < 0.1 && maxwell_slip == 0.0, "{is}");
    }
    found(0.15, elasto_plastic());
}
