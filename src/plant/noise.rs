//! Random numbers that a seed repeats on every machine: SplitMix64 (Steele, Lea, Flood 2014), normal by Box and Muller.

use std::f64::consts::TAU;

/// A stream of random numbers.
#[derive(Debug, Clone)]
pub struct Noise {
    state: u64,
}

impl Noise {
    /// The stream of a seed.
    #[must_use]
    pub fn new(seed: u64) -> Noise {
        Noise { state: seed }
    }

    /// Uniform in [0, 1).
    pub fn uniform(&mut self) -> f64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Normal of this standard deviation; nothing is drawn for zero.
    pub fn normal(&mut self, deviation: f64) -> f64 {
        if deviation == 0.0 {
            return 0.0;
        }
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        deviation * radius * (TAU * self.uniform()).cos()
    }
}

/// Uniform noise of unit variance, for tests.
#[cfg(test)]
pub(super) fn uniform_noise(n: usize) -> Vec<f64> {
    let mut noise = Noise::new(1);
    (0..n).map(|_| (noise.uniform() - 0.5) * 12f64.sqrt()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seed_repeats_and_the_moments_are_normal_s() {
        let draw = |seed| {
            let mut noise = Noise::new(seed);
            (0..100_000).map(|_| noise.normal(2.0)).collect::<Vec<f64>>()
        };
        let values = draw(7);
        assert_eq!(values, draw(7));
        assert_ne!(values, draw(8));
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let moment = |power| values.iter().map(|v| ((v - mean) / 2.0).powi(power)).sum::<f64>() / n;
        assert!(mean.abs() < 0.03 && (moment(2) - 1.0).abs() < 0.02 && (moment(4) - 3.0).abs() < 0.1);
    }
}
