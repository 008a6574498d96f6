//! The torque curve after a reversal: torque against the motor's travel, averaged over short bins of travel.
//!
//! Travel `s` in mm counts from the reversal in the sense of the motion, torque `τ` is positive in that sense, so
//! that both directions give the same picture. The running sums over the bins let the fit weigh any stretch of
//! the curve in a handful of operations, whatever its length.

/// Bins a curve can hold; a longer scan takes wider bins.
pub const BINS: usize = 1024;

/// Bins that may be cleared in one cycle.
const GROWTH: usize = 32;

/// Torque against travel, as sums a bin.
#[derive(Debug, Clone)]
pub struct Curve {
    bins_per_mm: f64,
    used: usize,
    count: [f64; BINS],
    travel: [f64; BINS],
    torque: [f64; BINS],
}

impl Default for Curve {
    fn default() -> Curve {
        Curve { bins_per_mm: 1.0, used: 0, count: [0.0; BINS], travel: [0.0; BINS], torque: [0.0; BINS] }
    }
}

impl Curve {
    /// Starts a curve with bins of `width_mm`. Bins are cleared as they are reached, so this costs nothing.
    pub fn start(&mut self, width_mm: f64) {
        self.bins_per_mm = 1.0 / width_mm;
        self.used = 0;
    }

    /// Adds a sample. Travel behind the reversal or beyond the last bin is ignored.
    #[inline(always)]
    pub fn add(&mut self, travel: f64, torque: f64) {
        let place = travel * self.bins_per_mm;
        if !(0.0..BINS as f64).contains(&place) {
            return;
        }
        // `place` is below BINS already; `min` lets the compiler see that no index can panic.
        let bin = (place as usize).min(BINS - 1);
        if bin >= self.used {
            self.grow(bin + 1);
            if bin >= self.used {
                return; // an encoder that jumps further than `GROWTH` bins in a cycle; the next cycles catch up
            }
        }
        self.count[bin] += 1.0;
        self.travel[bin] += travel;
        self.torque[bin] += torque;
    }

    /// Clears the bins up to `wanted`, at most `GROWTH` of them, so that one cycle's work stays bounded.
    #[cold]
    fn grow(&mut self, wanted: usize) {
        let from = self.used.min(BINS);
        let to = wanted.min(from + GROWTH).min(BINS);
        self.count[from..to].fill(0.0);
        self.travel[from..to].fill(0.0);
        self.torque[from..to].fill(0.0);
        self.used = to;
    }

    /// Number of bins reached.
    #[must_use]
    pub fn used(&self) -> usize {
        self.used.min(BINS)
    }

    /// Width of a bin in mm.
    #[must_use]
    pub fn width_mm(&self) -> f64 {
        1.0 / self.bins_per_mm
    }

    /// Samples, mean travel (mm) and mean torque of a bin; `None` when it is empty or not there.
    #[must_use]
    #[inline(always)]
    pub fn point(&self, bin: usize) -> Option<(f64, f64, f64)> {
        if bin >= self.used.min(BINS) || self.count[bin] == 0.0 {
            return None;
        }
        let n = self.count[bin];
        Some((n, self.travel[bin] / n, self.torque[bin] / n))
    }
}

/// Weighted sums over a stretch of the curve; n counts the samples of a bin.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Moments {
    /// Σn.
    pub n: f64,
    /// Σn·s.
    pub s: f64,
    /// Σn·s².
    pub ss: f64,
    /// Σn·τ.
    pub t: f64,
    /// Σn·s·τ.
    pub st: f64,
    /// Σn·τ².
    pub tt: f64,
    /// Number of bins.
    pub bins: f64,
}

impl Moments {
    /// These sums with one more point of weight `n`.
    #[must_use]
    #[inline(always)]
    pub fn with(self, n: f64, s: f64, t: f64) -> Moments {
        Moments {
            n: self.n + n,
            s: self.s + n * s,
            ss: self.ss + n * s * s,
            t: self.t + n * t,
            st: self.st + n * s * t,
            tt: self.tt + n * t * t,
            bins: self.bins + 1.0,
        }
    }

    /// The sums over the stretch between `earlier` and these running sums.
    #[must_use]
    #[inline(always)]
    pub fn since(self, earlier: &Moments) -> Moments {
        Moments {
            n: self.n - earlier.n,
            s: self.s - earlier.s,
            ss: self.ss - earlier.ss,
            t: self.t - earlier.t,
            st: self.st - earlier.st,
            tt: self.tt - earlier.tt,
            bins: self.bins - earlier.bins,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bin_holds_means_and_an_untouched_one_nothing() {
        let mut curve = Curve::default();
        curve.start(0.001);
        curve.add(0.0104, 1.0);
        curve.add(0.0106, 3.0);
        curve.add(-1.0, 9.0);
        curve.add(f64::NAN, 9.0);
        curve.add(99.0, 9.0);
        assert_eq!(curve.used(), 11);
        assert_eq!(curve.point(5), None);
        let (n, s, t) = curve.point(10).unwrap();
        assert!((n, t) == (2.0, 2.0) && (s - 0.0105).abs() < 1e-15);
        curve.start(0.001);
        curve.add(0.0125, 7.0);
        assert_eq!(curve.point(10), None, "a new curve forgets the old one");
    }

    #[test]
    fn a_stretch_is_the_difference_of_running_sums() {
        let a = Moments::default().with(2.0, 1.0, 3.0);
        let b = a.with(1.0, 2.0, 5.0).with(4.0, 3.0, -1.0);
        assert_eq!(b.since(&a), Moments::default().with(1.0, 2.0, 5.0).with(4.0, 3.0, -1.0));
    }
}
