//! Mean of a noisy level with an honest standard error, in constant memory.
//!
//! Servo torque is autocorrelated (ripple, limit cycles of the loop), so the error of the mean is taken from the
//! scatter of batch means: std(mean) = std(batch means)/√(batches). With batches much longer than the
//! correlation this holds whatever the spectrum (method of batch means).

/// By how much the variance of a fit exceeds that of independent readings where neighbours move together: (1 + ρ)/(1 − ρ) with a
/// ρ of 0 to `most`. `ratio` is the sum of squares of the steps between neighbouring residuals over that of the residuals, 2·(1 − ρ)
/// (Durbin and Watson).
#[must_use]
pub fn inflation(ratio: f64, most: f64) -> f64 {
    let correlation = (1.0 - 0.5 * ratio).max(0.0).min(most);
    (1.0 + correlation) / (1.0 - correlation)
}

/// Running mean of one signal.
#[derive(Debug, Clone, Copy, Default)]
pub struct Level {
    batch_length: u32,
    in_batch: u32,
    batch_sum: f64,
    batches: u32,
    sum: f64,
    sum_of_squares: f64,
}

impl Level {
    /// An empty level whose batches hold `batch_length` samples (at least 1).
    #[must_use]
    pub fn new(batch_length: u32) -> Level {
        Level { batch_length: batch_length.max(1), ..Level::default() }
    }

    /// Adds a sample.
    #[inline(always)]
    pub fn add(&mut self, value: f64) {
        self.batch_sum += value;
        self.in_batch += 1;
        if self.in_batch == self.batch_length {
            self.sum += self.batch_sum;
            self.sum_of_squares += self.batch_sum * self.batch_sum;
            self.batches += 1;
            self.batch_sum = 0.0;
            self.in_batch = 0;
        }
    }

    /// Number of whole batches.
    #[must_use]
    pub fn batches(&self) -> u32 {
        self.batches
    }

    /// Mean over the whole batches; 0 when there is none.
    #[must_use]
    pub fn mean(&self) -> f64 {
        let n = f64::from(self.batches.max(1)) * f64::from(self.batch_length);
        self.sum / n
    }

    /// Variance of the mean; infinite with fewer than two batches.
    #[must_use]
    pub fn variance_of_mean(&self) -> f64 {
        if self.batches < 2 {
            return f64::INFINITY;
        }
        let (n, length) = (f64::from(self.batches), f64::from(self.batch_length));
        let scatter = (self.sum_of_squares - self.sum * self.sum / n).max(0.0) / (n - 1.0);
        scatter / (length * length * n)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn alternating_signal_has_its_mean_and_no_error() {
        let mut level = Level::new(2);
        (0..100).for_each(|i| level.add(3.0 + if i % 2 == 0 { 1.0 } else { -1.0 }));
        assert!((level.mean() - 3.0).abs() < 1e-12 && level.variance_of_mean() < 1e-24 && level.batches() == 50);
    }

    #[test]
    fn too_little_data_has_infinite_error() {
        let mut level = Level::new(4);
        (0..7).for_each(|_| level.add(1.0));
        assert!(level.variance_of_mean().is_infinite());
    }
}
