//! From measured amplitudes to complex gains: least squares over experiments, and the published formula.
//!
//! ```text
//! minimise Σe |Xd − g1·X1 + g2·X2|²/s² + (|g1 − 1|² + |g2 − 1|²)/t²      t: tolerance of the sensors, s: noise of an experiment
//! ```
//!
//! Where the experiments cannot tell g1 from g2, the tolerance decides that part, and the uncertainty says so; what they do
//! tell, the relative displacement of a machine that swings as it did then, is right all the same.

use core::ops::{Add, Mul, Sub};

/// A complex number: real part, imaginary part.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Complex(pub f64, pub f64);

impl Add for Complex {
    type Output = Complex;
    fn add(self, other: Complex) -> Complex {
        Complex(self.0 + other.0, self.1 + other.1)
    }
}

impl Sub for Complex {
    type Output = Complex;
    fn sub(self, other: Complex) -> Complex {
        Complex(self.0 - other.0, self.1 - other.1)
    }
}

impl Mul for Complex {
    type Output = Complex;
    fn mul(self, other: Complex) -> Complex {
        Complex(self.0 * other.0 - self.1 * other.1, self.0 * other.1 + self.1 * other.0)
    }
}

impl Complex {
    /// With the imaginary part turned round.
    #[must_use]
    pub fn conjugate(self) -> Complex {
        Complex(self.0, -self.1)
    }

    /// Times a real number.
    #[must_use]
    pub fn scaled(self, factor: f64) -> Complex {
        Complex(self.0 * factor, self.1 * factor)
    }

    /// |z|².
    #[must_use]
    pub fn square(self) -> f64 {
        self.0 * self.0 + self.1 * self.1
    }

    /// |z|.
    #[must_use]
    pub fn size(self) -> f64 {
        self.square().sqrt()
    }

    /// Phase in rad, −π to π.
    #[must_use]
    pub fn phase(self) -> f64 {
        self.1.atan2(self.0)
    }
}

/// One experiment at one frequency, µm.
#[derive(Debug, Clone, Copy, Default)]
pub struct Experiment {
    /// Displacements of seat and bearing as the accelerometers tell them.
    pub seat: Complex,
    /// See `seat`.
    pub bearing: Complex,
    /// Relative displacement as the ball bar tells it.
    pub relative: Complex,
    /// Variance of the three, µm².
    pub variance: f64,
    /// Amplitude of the command, mm.
    pub amplitude: f64,
}

/// Complex gains, and how well they are known.
#[derive(Debug, Clone, Copy)]
pub struct Gains {
    /// Seat, bearing.
    pub gain: [Complex; 2],
    /// E|error|² of each.
    pub variance: [f64; 2],
    /// How much an error of the displacements is magnified in the gains.
    pub condition: f64,
    /// Root mean square of what is left of the relative displacement, µm.
    pub residual: f64,
}

/// A condition beyond any that matters, in place of infinity.
const WORST: f64 = 1e9;
/// Part of a relative displacement that a ball bar may be wrong by.
const BALL_BAR: f64 = 0.002;

fn residual(experiments: &[Experiment], gain: [Complex; 2]) -> f64 {
    let left = |e: &Experiment| (e.relative - gain[0] * e.seat + gain[1] * e.bearing).square();
    let sum: f64 = experiments.iter().map(left).sum();
    (sum / experiments.len().max(1) as f64).sqrt()
}

/// Least squares over all experiments at one frequency. `tolerance`: standard deviation of a gain beforehand.
#[must_use]
pub fn least_squares(experiments: &[Experiment], tolerance: f64) -> Gains {
    let prior = 1.0 / (tolerance * tolerance);
    let (mut a, mut c, mut b) = (0.0, 0.0, Complex::default());
    let (mut r1, mut r2) = (Complex(prior, 0.0), Complex(prior, 0.0));
    for e in experiments {
        let floor = BALL_BAR * BALL_BAR * (e.seat.square() + e.bearing.square());
        let weight = 1.0 / (e.variance + floor).max(1e-12);
        a += weight * e.seat.square();
        c += weight * e.bearing.square();
        b = b - (e.seat.conjugate() * e.bearing).scaled(weight);
        r1 = r1 + (e.seat.conjugate() * e.relative).scaled(weight);
        r2 = r2 - (e.bearing.conjugate() * e.relative).scaled(weight);
    }
    // Without the tolerance: ratio of the singular values of the columns, each brought to unit length.
    let alike = if a * c > 0.0 { (b.square() / (a * c)).sqrt() } else { 1.0 };
    let condition = if alike < 1.0 { ((1.0 + alike) / (1.0 - alike)).sqrt().min(WORST) } else { WORST };
    let (a, c) = (a + prior, c + prior);
    // Positive: a·c exceeds |b|² by the tolerance alone.
    let scale = 1.0 / (a * c - b.square()).max(prior * prior);
    let g1 = (r1.scaled(c) - b * r2).scaled(scale);
    let g2 = (r2.scaled(a) - b.conjugate() * r1).scaled(scale);
    Gains { gain: [g1, g2], variance: [c * scale, a * scale], condition, residual: residual(experiments, [g1, g2]) }
}

/// The published formula with its signs put right, from one experiment. The condition is 1/|sin α|.
#[must_use]
pub fn published(e: &Experiment) -> Gains {
    let alpha = e.bearing.phase() - e.seat.phase();
    let beta = e.relative.phase() - e.seat.phase();
    let (size, sine) = (e.relative.size(), alpha.sin());
    let sine = if sine.abs() > 1.0 / WORST { sine } else { (1.0 / WORST).copysign(sine) };
    let (a, b) = (size * (alpha - beta).sin() / sine, -size * beta.sin() / sine);
    let (seat, bearing) = (e.seat.size().max(1e-9), e.bearing.size().max(1e-9));
    let gain = [Complex(a / seat, 0.0), Complex(b / bearing, 0.0)];
    let variance = [seat, bearing].map(|x| e.variance / (x * x * sine * sine));
    Gains { gain, variance, condition: 1.0 / sine.abs(), residual: residual(&[*e], gain) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn polar(size: f64, degrees: f64) -> Complex {
        let (sin, cos) = degrees.to_radians().sin_cos();
        Complex(size * cos, size * sin)
    }

    fn experiment(seat: Complex, bearing: Complex, g: [Complex; 2]) -> Experiment {
        let relative = g[0] * seat - g[1] * bearing;
        Experiment { seat, bearing, relative, variance: 1e-8, amplitude: 1.0 }
    }

    /// Real gains, where the published formula is exact; with the print's signs both come out negative.
    #[test]
    fn the_published_formula_needs_its_signs_turned() {
        let g = [Complex(1.05, 0.0), Complex(0.95, 0.0)];
        for alpha in [20.0, 90.0, 140.0, -60.0] {
            let e = experiment(polar(4.0, 10.0), polar(3.0, 10.0 + alpha), g);
            let found = published(&e);
            assert!((found.gain[0].0 - 1.05).abs() < 1e-9 && (found.gain[1].0 - 0.95).abs() < 1e-9, "{alpha}");
            // As printed: A = −D·sin(α−β)/sin α, B = D·sin β/sin α. What they give back is the opposite displacement.
            let (al, be) = (e.bearing.phase() - e.seat.phase(), e.relative.phase() - e.seat.phase());
            let print = [-(al - be).sin() / al.sin(), be.sin() / al.sin()].map(|x| x * e.relative.size());
            let gains = [Complex(print[0] / 4.0, 0.0), Complex(print[1] / 3.0, 0.0)];
            let wrong = residual(&[e], gains);
            assert!(gains[0].0 < 0.0 && gains[1].0 < 0.0 && (wrong - 2.0 * e.relative.size()).abs() < 1e-9);
            assert!(found.residual < 1e-9);
        }
    }

    /// Near α = π the published formula turns a phase error of 1° into gains that are nonsense, and says so; least squares
    /// over two experiments does not.
    #[test]
    fn opposite_phases_are_told() {
        let g = [polar(1.04, 1.0), polar(0.97, -1.0)];
        let near = experiment(polar(4.0, 0.0), polar(3.0, 179.0), g);
        let other = experiment(polar(4.0, 0.0), polar(1.5, 178.0), g);
        let bad = published(&near);
        assert!(bad.condition > 50.0 && (bad.gain[0].0 - 1.04).abs() > 0.2, "{bad:?}");
        let good = least_squares(&[near, other], 0.1);
        assert!((good.gain[0] - g[0]).size() < 5e-3 && (good.gain[1] - g[1]).size() < 5e-3, "{good:?}");
        assert!(good.condition < 20.0 && good.condition > 2.0);
        // One experiment alone: which of the two is wrong is unknown, the relative displacement is right.
        let one = least_squares(&[near], 0.1);
        assert!(one.condition > 1e6 && one.residual < 0.02 * near.relative.size(), "{one:?}");
        assert!(one.variance[0].sqrt() > 0.03 && good.variance[0].sqrt() < 0.01);
    }

    /// The uncertainty covers the error in about as many cases as it claims: with noise on everything, 2000 fits.
    #[test]
    fn the_uncertainty_is_neither_too_small_nor_too_large() {
        let mut seed = 5u64;
        let mut noise = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((seed >> 11) as f64 / (1u64 << 52) as f64 - 1.0) * 3f64.sqrt() * 0.05
        };
        let g = [polar(1.03, 2.0), polar(0.96, -1.0)];
        let (mut inside, mut n) = (0, 0);
        for _ in 0..2000 {
            let mut both =
                [experiment(polar(4.0, 0.0), polar(3.0, 175.0), g), experiment(polar(4.0, 0.0), polar(1.2, 170.0), g)];
            for e in &mut both {
                e.relative = e.relative + Complex(noise(), noise());
                e.variance = 2.0 * 0.05 * 0.05;
            }
            let found = least_squares(&both, 1.0);
            for i in 0..2 {
                inside += i32::from((found.gain[i] - g[i]).0.abs() < 2.0 * (found.variance[i] / 2.0).sqrt());
                n += 1;
            }
        }
        let share = f64::from(inside) / f64::from(n);
        assert!(share > 0.93 && share < 0.985, "{share}");
    }
}
