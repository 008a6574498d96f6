//! Powers of numbers that follow each other closely: they are dear, and a series about a place where one is known does for many steps.

/// Share of a number up to which the series of its power is as exact.
const CLOSE: f64 = 0.02;
/// 1/k; a product is ready before a quotient.
pub(super) const PER: [f64; 8] = [f64::INFINITY, 1.0, 1.0 / 2.0, 1.0 / 3.0, 1.0 / 4.0, 1.0 / 5.0, 1.0 / 6.0, 1.0 / 7.0];

/// A power of a number near where it is known.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Power {
    /// One over where it is known, and the power there.
    per_place: f64,
    value: f64,
}

impl Power {
    /// The power of a number; all of them are of one exponent.
    #[inline(always)]
    pub fn at(&mut self, x: f64, n: f64) -> f64 {
        if n == 1.0 {
            return x;
        }
        let d = x * self.per_place - 1.0;
        if !(d.abs() < CLOSE) {
            return self.looked_up(x, n);
        }
        let term = |k: usize| d * PER[k] * (n + 1.0 - k as f64);
        let last = 1.0 + term(5) * (1.0 + term(6) * (1.0 + term(7)));
        self.value * (1.0 + term(1) * (1.0 + term(2) * (1.0 + term(3) * (1.0 + term(4) * last))))
    }

    #[cold]
    fn looked_up(&mut self, x: f64, n: f64) -> f64 {
        self.per_place = 1.0 / x;
        self.value = x.powf(n);
        self.value
    }
}
