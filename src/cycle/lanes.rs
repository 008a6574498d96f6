//! Four single-precision numbers that one instruction handles (`wide`): SSE on x86-64, Neon on ARM.
//!
//! Left to itself the compiler takes such sums apart into single numbers again, at four times the instructions.

pub use wide::f32x4 as Lanes;

/// Adding and taking away a number leaves nothing below a 2^-24th of it, long before it could be subnormal.
#[inline(always)]
#[must_use]
pub fn flushed(lanes: Lanes, by: f32) -> Lanes {
    let by = Lanes::splat(by);
    (lanes + by) - by
}

/// The first with the second lane, the third with the fourth exchanged.
#[inline(always)]
#[must_use]
pub fn swapped(lanes: Lanes) -> Lanes {
    let [a, b, c, d] = lanes.to_array();
    Lanes::new([b, a, d, c])
}

/// Of each pair the sum, in both of its lanes.
#[inline(always)]
#[must_use]
pub fn paired(lanes: Lanes) -> Lanes {
    lanes + swapped(lanes)
}

/// The sums over the lanes of two and two.
#[inline(always)]
#[must_use]
pub fn sums([a, b]: [Lanes; 2], [c, d]: [Lanes; 2]) -> Lanes {
    let (left, right) = (a.unpack_lo(b) + a.unpack_hi(b), c.unpack_lo(d) + c.unpack_hi(d));
    let ([a0, b0, a1, b1], [c0, d0, c1, d1]) = (left.to_array(), right.to_array());
    Lanes::new([a0, b0, c0, d0]) + Lanes::new([a1, b1, c1, d1])
}

/// Whether every lane is below its bound; what is no number is not.
#[inline(always)]
#[must_use]
pub fn within(lanes: Lanes, bounds: Lanes) -> bool {
    bounds.simd_gt(lanes).to_bitmask() == 15
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lanes_go_where_they_belong() {
        let [a, b] = [Lanes::new([1.0, 2.0, 3.0, 4.0]), Lanes::new([5.0, 6.0, 7.0, 8.0])];
        assert_eq!(swapped(a).to_array(), [2.0, 1.0, 4.0, 3.0]);
        assert_eq!(paired(a).to_array(), [3.0, 3.0, 7.0, 7.0]);
        assert_eq!(sums([a, b], [a + a, b + b]).to_array(), [10.0, 26.0, 20.0, 52.0]);
        assert!(within(a, b) && !within(b, a) && !within(a, Lanes::new([9.0, 9.0, 9.0, 4.0])));
        assert!(!within(Lanes::new([0.0, 0.0, f32::NAN, 0.0]), b));
        assert_eq!(flushed(Lanes::splat(1e-30), 1e-10).to_array(), [0.0; 4]);
    }
}
