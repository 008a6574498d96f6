//! Up to which frequency a measured position tells the acceleration, by its spectrum.

use super::motion::FEWEST_ROWS;
use realfft::RealFftPlanner;
use std::f64::consts::{PI, TAU};

/// Power over that of the noise from which on it is taken for motion. Signal as large as the noise makes twice the noise; twice that again
/// is kept clear of noise that is not quite white. On a spectrum that falls as f⁻⁸ it moves the cut-off by a tenth.
const CLEAR: f64 = 4.0;
/// Lowest cut-off, in bins of the spectrum.
const LOWEST_BIN: usize = 4;

/// Cut-off up to which the acceleration errs least, over all pieces of a recording: what is passed errs by the noise there, what is not
/// by the motion. On a spectrum that falls into the position's white noise it is where they meet. What rises out of the noise again
/// beyond that is worth passing where it is more than all noise up to there, and more than rounding to a grid makes: at an even speed
/// that is no white noise, but tones.
#[must_use]
pub(super) fn noise_crossing_hz(pieces: &[&[f64]], period: f64) -> f64 {
    let longest = pieces.iter().map(|piece| piece.len()).max().unwrap_or(0);
    let length = (longest / 4).clamp(FEWEST_ROWS, 2048) & !1;
    let spectrum = position_spectrum(pieces, length);
    // A line in the noise is no motion: the middle one of the neighbours.
    let middle = |low: f64, high: f64| {
        let low = ((low * length as f64) as usize).min(spectrum.len() - 1);
        let high = ((high * length as f64).ceil() as usize).clamp(low + 1, spectrum.len());
        let mut band = spectrum[low..high].to_vec();
        let middle = band.len() / 2;
        *band.select_nth_unstable_by(middle, f64::total_cmp).1
    };
    let noise = middle(0.35, 0.49);
    let frequency = |bin: usize| bin as f64 / length as f64;
    let about = |bin: usize| middle(frequency(bin) / 1.12, frequency(bin) * 1.12);
    let powers: Vec<f64> = (LOWEST_BIN..=length / 4).map(about).collect();
    let meet = powers.iter().position(|power| *power <= CLEAR * noise).unwrap_or(powers.len());
    // Each bin but the first stands for two of the whole spectrum.
    let beyond: f64 = 2.0 * powers[meet..].iter().map(|power| (power - noise).max(0.0)).sum::<f64>() / length as f64;
    let worth = if beyond > least_step(pieces).powi(2) / 12.0 { powers.len() } else { meet };
    let (mut gained, mut most, mut best) = (0.0, 0.0, LOWEST_BIN);
    for (bin, power) in (LOWEST_BIN..).zip(&powers[..worth]) {
        gained += frequency(bin).powi(4) * (power - CLEAR * noise);
        if gained > most {
            (most, best) = (gained, bin);
        }
    }
    frequency(best) / period
}

/// The least step from a row to the next: that of the grid, where there is one.
fn least_step(pieces: &[&[f64]]) -> f64 {
    let steps = pieces.iter().flat_map(|piece| piece.windows(2).map(|pair| (pair[1] - pair[0]).abs()));
    steps.filter(|step| *step > 0.0).fold(f64::INFINITY, f64::min)
}

/// Power of the position per bin, from its second difference, in which neither stroke nor drift leaks: that of white noise is its
/// variance in all of them.
fn position_spectrum(pieces: &[&[f64]], length: usize) -> Vec<f64> {
    let rows: usize = pieces.iter().map(|piece| piece.len()).sum();
    let mut planner = RealFftPlanner::<f64>::new();
    let fft = planner.plan_fft_forward(length);
    let (mut input, mut output) = (fft.make_input_vec(), fft.make_output_vec());
    let mut power = vec![0.0; output.len()];
    let window: Vec<f64> = (0..length).map(|i| 0.5 * (1.0 - (TAU * i as f64 / length as f64).cos())).collect();
    let mut squares = 0.0;
    // Half overlapping, and no more than some hundred segments however long the recording is.
    let hop = (length / 2).max(rows / 256).max(1);
    for segment in pieces.iter().flat_map(|piece| piece.windows(length + 2).step_by(hop)) {
        for ((slot, x), window) in input.iter_mut().zip(segment.windows(3)).zip(&window) {
            *slot = (x[2] - 2.0 * x[1] + x[0]) * window;
        }
        if fft.process(&mut input, &mut output).is_ok() {
            power.iter_mut().zip(&output).for_each(|(sum, c)| *sum += c.norm_sqr());
            squares += window.iter().map(|w| w * w).sum::<f64>();
        }
    }
    for (i, value) in power.iter_mut().enumerate() {
        let gain = 2.0 * (PI * i as f64 / length as f64).sin();
        *value /= gain.powi(4).max(1e-18) * squares.max(1.0);
    }
    power
}

#[cfg(test)]
mod tests {
    use super::super::linear::rms;
    use super::super::motion::Motion;
    use super::super::noise::uniform_noise as noise;
    use super::*;

    /// Rows of a swing, taken or only written at scattered times: told by the motion, however it scatters.
    #[test]
    fn the_cutoff_found_is_near_the_best() {
        let n = 20_000;
        let time: Vec<f64> = (0..n).map(|i| f64::from(i) * 1e-3).collect();
        // Reversals with jerk steps: x⃛ is a square wave, so the spectrum falls as f⁻⁸.
        let (mut x, mut v, mut a) = (0.0, 0.0, 0.0);
        let (mut clean, mut truth) = (Vec::new(), Vec::new());
        for i in 0..n {
            let phase = i % 1000;
            let jerk = if (250..750).contains(&phase) { -2e4 } else { 2e4 };
            clean.push(x);
            truth.push(a);
            let h = 1e-3;
            x += h * v + h * h / 2.0 * a + h * h * h / 6.0 * jerk;
            v += h * a + h * h / 2.0 * jerk;
            a += h * jerk;
        }
        for sigma in [1e-5, 1e-3, 1e-1] {
            let noisy: Vec<f64> = clean.iter().zip(noise(20_000)).map(|(x, e)| x + sigma * e).collect();
            assert_near_the_best(&time, &noisy, &truth, &format!("noise {sigma}"));
        }
    }

    /// The acceleration by the cut-off that is found errs little more than by the best.
    fn assert_near_the_best(time: &[f64], position: &[f64], truth: &[f64], case: &str) {
        let error = |cutoff| {
            let motion = Motion::with_cutoff(time, position, cutoff).unwrap();
            rms((1000..19_000).map(|i| motion.acceleration(i) - truth[i]))
        };
        let best = (0..40).map(|k| error(Some(2.0 * 1.13_f64.powi(k)))).fold(f64::INFINITY, f64::min);
        let found = error(None);
        assert!(found < 1.3 * best, "{case}: {found} against {best}");
    }

    /// At an even speed that sways a little rounding to a grid makes a tone that wanders: as far above the noise elsewhere as a motion.
    #[test]
    fn the_tones_of_a_grid_are_no_motion() {
        let (n, h, grid) = (20_000, 1e-3, 1e-3);
        let time: Vec<f64> = (0..n).map(|i| f64::from(i) * h).collect();
        let (mut x, mut v) = (0.0, 100.15);
        let (mut rounded, mut truth) = (Vec::new(), Vec::new());
        for (i, t) in time.iter().enumerate() {
            // There and back in two seconds each, turning round in a tenth; 3 µm to and fro at 1.3 Hz make the tone wander.
            let turning = if i % 2000 < 1900 { 0.0 } else { -2003.0 };
            let a = if i / 2000 % 2 == 0 { turning } else { -turning };
            let (sway, w) = (3e-3, TAU * 1.3);
            rounded.push(((x + sway * (w * t).sin()) / grid).round() * grid);
            truth.push(a - sway * w * w * (w * t).sin());
            x += h * v + 0.5 * h * h * a;
            v += h * a;
        }
        assert_near_the_best(&time, &rounded, &truth, "grid");
    }
}
