//! Random numbers that a printed seed repeats on every machine: SplitMix64 (Steele, Lea, Flood 2014, "Fast splittable
//! pseudorandom number generators"), with the few distributions that the generator draws from.

/// A stream of random numbers. Streams forked from one seed by number are independent of each other.
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64, stream: u64) -> Self {
        let mut r = Self(seed ^ stream.wrapping_mul(0xd134_2543_de82_ef95));
        r.next();
        Self(r.next())
    }

    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in [lo, hi).
    pub fn uniform(&mut self, lo: f64, hi: f64) -> f64 {
        lo + (hi - lo) * (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform in the logarithm: every decade is equally likely.
    pub fn log_uniform(&mut self, lo: f64, hi: f64) -> f64 {
        self.uniform(lo.ln(), hi.ln()).exp()
    }

    /// Standard normal (Box–Muller).
    pub fn normal(&mut self) -> f64 {
        let r = (-2.0 * (1.0 - self.uniform(0.0, 1.0)).ln()).sqrt();
        r * self.uniform(0.0, std::f64::consts::TAU).cos()
    }

    pub fn chance(&mut self, p: f64) -> bool {
        self.uniform(0.0, 1.0) < p
    }

    pub fn sign(&mut self) -> f64 {
        if self.chance(0.5) { 1.0 } else { -1.0 }
    }

    pub fn phase(&mut self) -> f64 {
        self.uniform(0.0, std::f64::consts::TAU)
    }

    pub fn pick<T: Copy>(&mut self, from: &[T]) -> T {
        from[(self.next() % from.len() as u64) as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_normal_deviate_has_mean_zero_and_unit_variance() {
        let mut r = Random::new(7, 0);
        let n = 100_000;
        let x: Vec<f64> = (0..n).map(|_| r.normal()).collect();
        let mean = x.iter().sum::<f64>() / n as f64;
        let variance = x.iter().map(|v| v * v).sum::<f64>() / n as f64;
        // Four standard errors of each.
        assert!(mean.abs() < 4.0 / (n as f64).sqrt(), "{mean}");
        assert!((variance - 1.0).abs() < 4.0 * (2.0 / n as f64).sqrt(), "{variance}");
        // A mean and variance alone would also suit a two-point law: a normal one exceeds 1.96 in 5 % of draws.
        let beyond = x.iter().filter(|v| v.abs() > 1.96).count() as f64 / n as f64;
        assert!((beyond - 0.05).abs() < 4.0 * (0.05f64 * 0.95 / n as f64).sqrt(), "{beyond}");
    }

    #[test]
    fn a_seed_repeats_and_streams_differ() {
        let draw =
            |seed, stream| (0..4).map(|_| 0).scan(Random::new(seed, stream), |r, _| Some(r.next())).collect::<Vec<_>>();
        assert_eq!(draw(1, 2), draw(1, 2));
        assert_ne!(draw(1, 2), draw(1, 3));
        assert_ne!(draw(1, 2), draw(2, 2));
    }
}
