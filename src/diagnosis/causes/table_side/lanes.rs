//! Numbers of tables side by side, two to a register (`wide`). Left to itself the compiler takes what is written lane by lane apart
//! into single numbers, with a branch for each choice, and takes several times as long.

use super::LANES;
use crate::diagnosis::many::decay;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};
use wide::f64x2;

const PAIRS: usize = LANES / 2;

/// A number of each of so many tables, eight at most. What of the registers is beyond them repeats the last or is left alone.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lanes<const N: usize>([f64x2; PAIRS]);

/// Which of so many tables.
#[derive(Clone, Copy, Debug)]
pub(super) struct Which<const N: usize>(Lanes<N>);

impl<const N: usize> Lanes<N> {
    /// The same of all.
    #[inline(always)]
    pub fn splat(value: f64) -> Self {
        Self::pairs(|_| f64x2::splat(value))
    }

    /// Of each what its place says.
    #[inline(always)]
    pub fn each(mut of: impl FnMut(usize) -> f64) -> Self {
        Self::pairs(|k| {
            let first = of(2 * k);
            f64x2::new([first, if 2 * k + 1 < N { of(2 * k + 1) } else { first }])
        })
    }

    /// Of each.
    #[inline(always)]
    pub fn to_array(self) -> [f64; N] {
        let mut array = [0.0; N];
        for (l, value) in array.iter_mut().enumerate() {
            *value = self.of(l);
        }
        array
    }

    /// That of one.
    #[inline(always)]
    pub fn of(self, l: usize) -> f64 {
        self.0[l / 2].to_array()[l % 2]
    }

    #[inline(always)]
    pub fn abs(self) -> Self {
        Self::pairs(|k| self.0[k].abs())
    }

    /// So large, with the sign of another.
    #[inline(always)]
    pub fn copysign(self, of: Self) -> Self {
        let sign = f64x2::splat(-0.0);
        Self::pairs(|k| self.0[k].abs() | of.0[k] & sign)
    }

    /// One with the sign of each.
    #[inline(always)]
    pub fn sign(self) -> Self {
        let (sign, one) = (f64x2::splat(-0.0), f64x2::splat(1.0));
        Self::pairs(|k| one | self.0[k] & sign)
    }

    /// The larger of two numbers; unlike the library's, which minds NaN, one instruction.
    #[inline(always)]
    pub fn larger(self, other: Self) -> Self {
        Self::pairs(|k| self.0[k].fast_max(other.0[k]))
    }

    /// The smaller of two numbers, likewise.
    #[inline(always)]
    pub fn smaller(self, other: Self) -> Self {
        Self::pairs(|k| self.0[k].fast_min(other.0[k]))
    }

    /// e^−x of each x from 0 on.
    #[inline(always)]
    pub fn decay(self) -> Self {
        Self::pairs(|k| decay(self.0[k]))
    }

    /// Which are above another.
    #[inline(always)]
    pub fn above(self, other: Self) -> Which<N> {
        Which(Self::pairs(|k| self.0[k].simd_gt(other.0[k])))
    }

    /// Which reach another.
    #[inline(always)]
    pub fn reach(self, other: Self) -> Which<N> {
        Which(Self::pairs(|k| self.0[k].simd_ge(other.0[k])))
    }

    /// Register by register, without a loop that would have to be unrolled.
    #[inline(always)]
    fn pairs(mut of: impl FnMut(usize) -> f64x2) -> Self {
        let mut pairs = [f64x2::ZERO; PAIRS];
        pairs[0] = of(0);
        if N > 2 {
            pairs[1] = of(1);
        }
        if N > 4 {
            pairs[2] = of(2);
        }
        if N > 6 {
            pairs[3] = of(3);
        }
        Self(pairs)
    }
}

impl<const N: usize> Which<N> {
    /// All or none.
    #[inline(always)]
    pub fn splat(all: bool) -> Self {
        Self(Lanes::splat(if all { f64::from_bits(u64::MAX) } else { 0.0 }))
    }

    /// Whether one is.
    #[inline(always)]
    pub fn of(self, l: usize) -> bool {
        self.bits() >> l & 1 == 1
    }

    #[inline(always)]
    pub fn all(self) -> bool {
        self.bits() == Self::EVERY
    }

    #[inline(always)]
    pub fn any(self) -> bool {
        self.bits() != 0
    }

    /// Of these a number, of the others another.
    #[inline(always)]
    pub fn choose(self, these: Lanes<N>, others: Lanes<N>) -> Lanes<N> {
        Lanes::pairs(|k| self.0.0[k].bitselect(these.0[k], others.0[k]))
    }

    /// Of these a number, of the others nothing.
    #[inline(always)]
    pub fn keep(self, these: Lanes<N>) -> Lanes<N> {
        Lanes::pairs(|k| self.0.0[k] & these.0[k])
    }

    const EVERY: u32 = (1 << N) - 1;

    #[inline(always)]
    fn bits(self) -> u32 {
        let of = |k: usize| if N > 2 * k { self.0.0[k].to_bitmask() << (2 * k) } else { 0 };
        (of(0) | of(1) | of(2) | of(3)) & Self::EVERY
    }
}

macro_rules! operation {
    ($($name:ident $of:ident),*) => { $(
        impl<const N: usize> $name for Lanes<N> {
            type Output = Self;

            #[inline(always)]
            fn $of(self, other: Self) -> Self {
                Self::pairs(|k| self.0[k].$of(other.0[k]))
            }
        }
    )* };
}

operation!(Add add, Sub sub, Mul mul, Div div);

impl<const N: usize> Mul<f64> for Lanes<N> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, by: f64) -> Self {
        self * Self::splat(by)
    }
}

impl<const N: usize> Div<f64> for Lanes<N> {
    type Output = Self;

    #[inline(always)]
    fn div(self, by: f64) -> Self {
        self / Self::splat(by)
    }
}

impl<const N: usize> From<[f64; N]> for Lanes<N> {
    #[inline(always)]
    fn from(array: [f64; N]) -> Self {
        Self::each(|l| array[l])
    }
}

impl<const N: usize> Neg for Lanes<N> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        let sign = f64x2::splat(-0.0);
        Self::pairs(|k| self.0[k] ^ sign)
    }
}

impl<const N: usize> BitAnd for Which<N> {
    type Output = Self;

    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self(self.keep(other.0))
    }
}

impl<const N: usize> BitOr for Which<N> {
    type Output = Self;

    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self(Lanes::pairs(|k| self.0.0[k] | other.0.0[k]))
    }
}

impl<const N: usize> Not for Which<N> {
    type Output = Self;

    #[inline(always)]
    fn not(self) -> Self {
        Self(Lanes::pairs(|k| !self.0.0[k]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers of every kind in lanes of any count come out as one by one.
    #[test]
    fn lanes_are_as_one_by_one() {
        of_count::<1>();
        of_count::<4>();
        of_count::<8>();
    }

    fn of_count<const N: usize>() {
        let numbers = [0.0, -0.0, 1.5, -2.25, 3e-7, -4e9, 0.75, -1.0, 17.0, -0.5, 2.0];
        for shift in 0..numbers.len() {
            let (x, y) = (|l: usize| numbers[(l + shift) % 11], |l: usize| numbers[(5 * l + 3) % 11]);
            let (a, b) = (Lanes::<N>::each(x), Lanes::<N>::each(y));
            let is = |lanes: Lanes<N>, of: fn(f64, f64) -> f64| {
                for (l, value) in lanes.to_array().into_iter().enumerate() {
                    let own = of(x(l), y(l));
                    assert!(value == own || value.is_nan() && own.is_nan(), "{value} is not {own}");
                }
            };
            is(a + b, |x, y| x + y);
            is(a - b, |x, y| x - y);
            is(a * b, |x, y| x * y);
            is(a / b, |x, y| x / y);
            is(a * 3.0, |x, _| x * 3.0);
            is(a / 3.0, |x, _| x / 3.0);
            is(Lanes::from(a.to_array()), |x, _| x);
            is(-a, |x, _| -x);
            is(a.abs(), |x, _| x.abs());
            is(a.copysign(b), f64::copysign);
            is(b.sign(), |_, y| 1.0f64.copysign(y));
            is(a.larger(b), |x, y| if x > y { x } else { y });
            is(a.smaller(b), |x, y| if x < y { x } else { y });
            is(a.above(b).choose(a, b), |x, y| if x > y { x } else { y });
            is(a.reach(b).keep(a), |x, y| if x >= y { x } else { 0.0 });
            let above: Vec<bool> = (0..N).map(|l| x(l) > y(l)).collect();
            for which in [a.above(b), !!a.above(b), a.above(b) & Which::splat(true)] {
                assert!((0..N).all(|l| which.of(l) == above[l]));
                assert_eq!([which.all(), which.any()], [above.iter().all(|is| *is), above.contains(&true)]);
            }
            assert!((a.above(b) | !a.above(b)).all() && !(a.above(b) & Which::splat(false)).any());
        }
    }
}
