//! Angles in turns, and their cosine and sine at the same cost every time.
//!
//! A polynomial on a quarter turn, error below 1e-7: the mathematical library would take longer for some angles than for
//! others.

/// Adding and taking away this rounds a number below 2^51 to a whole one; `f64::round` would be a call.
const ROUNDING: f64 = 1.5 * (1u64 << 52) as f64;

/// Turns less whole turns: −0.5 to 0.5.
#[inline(always)]
#[must_use]
pub fn folded(turns: f64) -> f64 {
    turns - ((turns + ROUNDING) - ROUNDING)
}

/// Turns less whole turns: −0.5 to 0.5, without digits below 1e-16, which could become subnormal in products.
#[inline(always)]
#[must_use]
pub fn fold(turns: f64) -> f64 {
    (folded(turns) + 1.0) - 1.0
}

/// cos and sin of a number of turns, −0.5 to 0.5.
#[inline(always)]
#[must_use]
pub fn cos_sin(turns: f64) -> (f64, f64) {
    let size = turns.abs();
    let rise = if size > 0.25 { 0.5 - size } else { size };
    // cos 2πt = sin 2π(1/4 − |t|): both are sines of a quarter turn.
    let [cos, sin] = sine([0.25 - size, rise.copysign(turns)]);
    (cos, sin)
}

/// sin 2πu for −1/4 ≤ u ≤ 1/4: Taylor's series to the eleventh power.
#[inline(always)]
fn sine(turns: [f64; 2]) -> [f64; 2] {
    turns.map(|u| {
        let x = core::f64::consts::TAU * u;
        let y = x * x;
        x * (1.0
            + y * (-1.0 / 6.0
                + y * (1.0 / 120.0 + y * (-1.0 / 5040.0 + y * (1.0 / 362_880.0 + y * (-1.0 / 39_916_800.0))))))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cosine_and_sine_are_right_all_around() {
        for i in -5000..=5000 {
            let turns = f64::from(i) * 1e-4;
            let (angle, (cos, sin)) = (core::f64::consts::TAU * turns, cos_sin(turns));
            assert!((cos - angle.cos()).abs() < 1e-7 && (sin - angle.sin()).abs() < 1e-7, "{turns}");
        }
    }

    #[test]
    fn wrapped_anywhere_it_turns_the_same() {
        assert!((fold(179.75) + 0.25).abs() < 1e-12 && fold(-3.0) == 0.0 && fold(1e-300) == 0.0);
        assert!(fold(f64::NAN).is_nan() && fold(f64::INFINITY).is_nan());
    }
}
