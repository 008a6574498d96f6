//! The torque curve after a reversal: torque against the motor's travel, averaged over short bins of travel.
//!
//! Travel `s` in mm counts from the reversal in the sense of the motion, torque `τ` is positive in that sense, so
//! that both directions give the same picture. The running sums over the bins let the fit weigh any stretch of
//! the curve in a handful of operations, whatever its length.

/// Bins a curve can hold; a longer scan takes wider bins.
pub const BINS: usize = 1024;

/// Bins emptied in one cycle.
pub const CLEAR_BINS: usize = 16;
/// Slices of `Curve::clear`.
pub const CLEAR_SLICES: u32 = (BINS / CLEAR_BINS) as u32;

/// Sums of one bin: samples, travel, torque.
#[derive(Debug, Clone, Copy)]
struct Bin {
    n: f64,
    travel: f64,
    torque: f64,
}

const EMPTY: Bin = Bin { n: 0.0, travel: 0.0, torque: 0.0 };

/// Torque against travel, as sums a bin.
#[derive(Debug, Clone)]
pub struct Curve {
    bins_per_mm: f64,
    used: usize,
    bins: [Bin; BINS],
}

impl Default for Curve {
    fn default() -> Curve {
        Curve { bins_per_mm: 1.0, used: 0, bins: [EMPTY; BINS] }
    }
}

impl Curve {
    /// Starts a curve with bins of `width_mm`; `clear` must empty the bins before samples come.
    pub fn start(&mut self, width_mm: f64) {
        self.bins_per_mm = 1.0 / width_mm;
        self.used = 0;
    }

    /// Empties slice number `slice` of `CLEAR_SLICES`, so that one cycle's work stays bounded.
    pub fn clear(&mut self, slice: u32) {
        if let Some(bins) = self.bins.chunks_exact_mut(CLEAR_BINS).nth(slice as usize) {
            bins.fill(EMPTY);
        }
    }

    /// Adds a sample. Travel behind the reversal or beyond the last bin is ignored.
    #[inline(always)]
    pub fn add(&mut self, travel: f64, torque: f64) {
        // Adding 2^52 leaves the nearest whole number in the low bits, in two instructions where a checked
        // conversion takes ten. What is negative, beyond or no number gives a place beyond the bins.
        const WHOLE: f64 = 4_503_599_627_370_496.0;
        let place = ((travel * self.bins_per_mm + WHOLE).to_bits() & 0xffff_ffff) as usize;
        if let Some(bin) = self.bins.get_mut(place) {
            bin.n += 1.0;
            bin.travel += travel;
            bin.torque += torque;
            if place >= self.used {
                self.used = place + 1;
            }
        }
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

    /// Bins in a millimetre; bin i is centred at i ÷ this.
    #[must_use]
    pub fn bins_per_mm(&self) -> f64 {
        self.bins_per_mm
    }

    /// Samples, mean travel (mm) and mean torque of a bin; `None` when it is empty or not there.
    #[must_use]
    #[inline(always)]
    pub fn point(&self, bin: usize) -> Option<(f64, f64, f64)> {
        let sums = self.bins.get(..self.used)?.get(bin)?;
        (sums.n > 0.0).then(|| (sums.n, sums.travel / sums.n, sums.torque / sums.n))
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
        curve.add(0.0099, 1.0);
        curve.add(0.0101, 3.0);
        curve.add(-1.0, 9.0);
        curve.add(f64::NAN, 9.0);
        curve.add(99.0, 9.0);
        assert_eq!(curve.used(), 11);
        assert_eq!(curve.point(5), None);
        let (n, s, t) = curve.point(10).unwrap();
        assert!((n, t) == (2.0, 2.0) && (s - 0.01).abs() < 1e-15);
        curve.start(0.001);
        (0..CLEAR_SLICES).for_each(|slice| curve.clear(slice));
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
