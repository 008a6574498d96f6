//! One harmonic of the revolution: the correction that is tried, the best so far, and the machine's answer as measured.
//!
//! A harmonic Z stands for Re(Z·e^(jkθ)), µm. See [`super`] for why this does not diverge.

use crate::cycle::calibration::solve::Complex;

/// Answer below which the machine is taken to answer this much: bounds a trial.
const ANSWER_MIN: f64 = 0.25;
/// A trial that was worse is tried with this part of the step next time.
const SHORTER: f64 = 0.5;
/// Steps shorter than this are not dared; the best is measured once more instead.
const DARE_MIN: f64 = 0.2;
/// One that was better may be this much longer, up to the whole.
const LONGER: f64 = 1.4;

/// One harmonic.
#[derive(Debug, Clone, Copy, Default)]
pub struct Line {
    /// In force, µm.
    pub trial: Complex,
    /// Smallest deviation so far, and the correction that gave it.
    best: Complex,
    left: Complex,
    /// The machine's answer and its weight, µm²: what is believed beforehand counts as much as one trial of this size.
    answer: Complex,
    weight: f64,
    /// Part of the step that is dared.
    dare: f64,
}

impl Line {
    /// Begins from the correction in force with a deviation that was measured, and an answer that is only believed.
    pub fn begin(&mut self, left: Complex, answer: Complex, weight: f64) {
        *self = Line { best: self.trial, left, answer, weight, dare: 1.0, trial: self.trial };
    }

    /// What the trial left. Keeps it when it is better.
    pub fn measured(&mut self, left: Complex) {
        let (tried, gained) = (self.trial - self.best, self.left - left);
        let weight = tried.square();
        if weight > 0.0 {
            let sum = self.answer.scaled(self.weight) + tried.conjugate() * gained;
            self.weight += weight;
            self.answer = sum.scaled(1.0 / self.weight);
        }
        if weight == 0.0 {
            // The best was in force: its deviation anew, in place of one that noise or a machine not yet at rest made.
            (self.left, self.dare) = (left, 1.0);
        } else if left.square() < self.left.square() {
            (self.best, self.left) = (self.trial, left);
            self.dare = (self.dare * LONGER).min(1.0);
        } else {
            self.dare *= SHORTER;
        }
    }

    /// The next trial; with a gain of 0 the best.
    pub fn next(&mut self, gain: f64) {
        let size = self.answer.square().max(ANSWER_MIN * ANSWER_MIN);
        self.trial = self.best;
        if self.dare > DARE_MIN {
            self.trial = self.best + (self.left * self.answer.conjugate()).scaled(gain * self.dare / size);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A machine that answers one harmonic by `answer`, with noise on every measurement.
    fn run(answer: Complex, wrong: Complex, believed: Complex, noise: f64, trials: usize) -> (f64, f64) {
        let mut line = Line::default();
        let mut seed = 1u64;
        let mut random = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            noise * ((seed >> 11) as f64 / (1u64 << 52) as f64 - 1.0)
        };
        let mut left = |c: Complex| wrong - answer * c + Complex(random(), random());
        line.begin(left(line.trial), believed, 0.01);
        let mut worst_best = 0f64;
        for _ in 0..trials {
            line.next(0.7);
            line.measured(left(line.trial));
            worst_best = worst_best.max((wrong - answer * line.best).size());
        }
        ((wrong - answer * line.best).size(), worst_best)
    }

    proptest! {
        /// Whatever a machine answers, resonant, turned round or not at all: what is kept never leaves more than there was,
        /// beside the noise, and what answers at all is learnt.
        #[test]
        fn no_answer_of_a_machine_makes_it_diverge(
            size in 0.0f64..20.0, phase in -3.2f64..3.2, lead in -3.2f64..3.2, wrong in 0.1f64..50.0, noise in 0.0f64..0.05,
        ) {
            let answer = Complex(size * phase.cos(), size * phase.sin());
            let believed = Complex(lead.cos(), lead.sin());
            let (left, worst) = run(answer, Complex(wrong, 0.3 * wrong), believed, noise, 30);
            let first = wrong * 1.09f64.sqrt();
            prop_assert!(worst <= first + 3.0 * noise, "{worst} of {first}");
            if size > 0.3 {
                prop_assert!(left < 0.02 * first + 6.0 * noise, "{left} of {first}");
            }
        }
    }

    #[test]
    fn the_published_update_does_diverge_there() {
        // |1 − G| > 1 for a lag of more than 60°: c ← c + e grows.
        let (answer, mut c, mut e) = (Complex(0.0, -1.5), Complex::default(), Complex(1.0, 0.0));
        for _ in 0..10 {
            c = c + e;
            e = Complex(1.0, 0.0) - answer * c;
        }
        assert!(e.size() > 100.0);
        assert!(run(answer, Complex(1.0, 0.0), Complex(1.0, 0.0), 0.0, 10).0 < 0.01);
    }
}
