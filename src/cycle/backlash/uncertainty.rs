//! What is not known of a lost motion, for the cycle and for recordings alike: scatter, what every reversal has alike, and
//! presliding of the table that is not told from the drive's spring.

use super::fitted::Fitted;
use super::rounding::UNTOLD;

/// Standard deviations beyond which chance does not explain a rounding, and within which it may hide one.
const SIGMAS: f64 = 2.0;

/// By how much straight fits read longer than rounded ones: what the table itself may have given way.
#[derive(Debug, Clone, Copy, Default)]
pub struct Give {
    count: f64,
    sum: f64,
    squares: f64,
    variances: f64,
}

impl Give {
    /// Adds a reversal.
    pub fn add(&mut self, fit: &Fitted) {
        if let Some(rounded) = fit.rounded {
            let give = fit.lost_motion - rounded.lost_motion;
            self.count += 1.0;
            self.sum += give;
            self.squares += give * give;
            self.variances += rounded.fit_variance;
        }
    }

    /// These reversals and others.
    #[must_use]
    pub fn with(&self, other: &Give) -> Give {
        Give {
            count: self.count + other.count,
            sum: self.sum + other.sum,
            squares: self.squares + other.squares,
            variances: self.variances + other.variances,
        }
    }

    /// Its mean, mm.
    #[must_use]
    pub fn mean(&self) -> f64 {
        self.sum / self.count.max(1.0)
    }

    /// Variance of its mean, mm²; `grid` is that of what encoder and bins do to every reversal alike.
    fn variance(&self, grid: f64) -> f64 {
        variance_of_mean(self.count, self.sum, self.squares, self.variances) + grid
    }

    /// Whether the table gives way beyond what chance shows, so that the rounded value is nearer to the truth.
    #[must_use]
    pub fn told(&self, grid: f64) -> bool {
        self.mean() > SIGMAS * self.variance(grid).sqrt()
    }

    /// Variance of what is not known of it, mm²: the shape of its bend where it is `told` and taken off, else all that chance may hide. A
    /// table gives way by 0 or more: what was found below 0 is chance, and leaves little room above.
    #[must_use]
    pub fn untold(&self, grid: f64, told: bool) -> f64 {
        let squared = self.mean() * self.mean();
        if told {
            (0.5 * UNTOLD).powi(2) * squared
        } else {
            let sigma = self.variance(grid).sqrt();
            let most = (1.0 + 0.5 * UNTOLD) * self.mean();
            (0.5 * (self.mean() + SIGMAS * sigma).max(sigma).max(most)).powi(2)
        }
    }
}

/// Variance of a mean over `n` values: the larger of what was expected of each and what they show.
#[must_use]
pub fn variance_of_mean(n: f64, sum: f64, squares: f64, variances: f64) -> f64 {
    let n = n.max(1.0);
    (variances / n).max(variance_of_one(n, sum, squares)) / n
}

/// Variance that `n` values show; 0 of fewer than two.
#[must_use]
pub fn variance_of_one(n: f64, sum: f64, squares: f64) -> f64 {
    if n > 1.0 { ((squares - sum * sum / n) / (n - 1.0)).max(0.0) } else { 0.0 }
}

/// Variance that no repetition takes away, mm²: each end of the lost motion lies somewhere on the encoder's grid q,
/// the same in every repeat (2·q²/12), a kink somewhere in its bin of the curve, and where the motor goes in steps one with friction
/// of its own sticks somewhere in its step when the torque is read (step²/12; else 0), and does so alike in every repeat. And a real curve
/// is not quite the model's: creep, damping and a servo that swings bend it by a share of `lost_motion` (mm).
#[must_use]
pub fn systematic(encoder: f64, bin: f64, step: f64, lost_motion: f64) -> f64 {
    /// Standard deviation of that: on random axes 95 of 100 intervals hold with it, and 88 without.
    const BENT: f64 = 0.005;
    let bent = BENT * lost_motion;
    encoder * encoder / 6.0 + bin * bin / 24.0 + step * step / 12.0 + bent * bent
}
