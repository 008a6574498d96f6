//! Synchronous detection: amplitude and phase of a signal at the frequency that the axis is driven with.
//!
//! ```text
//! Y = (2/n)·Σ y·e^(−jφ) − 2j·s/ω        φ: phase of the command, over whole periods; s: slope of the signal's drift, 1/s
//! ```
//!
//! A straight drift of slope s adds 2j·s/ω to the sum, whatever its length. Whole periods in whole cycles leave nothing of
//! an offset or of harmonics. The measurement is cut into blocks; their scatter is the uncertainty.

use super::plan::{BLOCKS, Tone};
use super::solve::Complex;

/// A complex amplitude and the variance of its mean.
#[derive(Debug, Clone, Copy, Default)]
pub struct Amplitude {
    /// In the signal's unit; y = Re(value·e^(jφ)).
    pub value: Complex,
    /// E|error|², in that unit squared.
    pub variance: f64,
}

/// One signal under detection.
#[derive(Debug, Clone, Copy, Default)]
pub struct Detector {
    /// Sums of the present block.
    sum: f64,
    cos: f64,
    sin: f64,
    /// First reading of a measurement: keeps the sums small.
    origin: f64,
    /// Sums over the blocks.
    value: Complex,
    squares: f64,
    first: f64,
    last: f64,
    /// Smallest and largest reading.
    low: f64,
    high: f64,
}

impl Detector {
    /// Begins anew with a first reading.
    pub fn begin(&mut self, reading: f64) {
        *self = Detector { origin: reading, low: reading, high: reading, ..Detector::default() };
    }

    /// A reading at a phase of the command.
    #[inline(always)]
    pub fn read(&mut self, reading: f64, cos: f64, sin: f64) {
        let y = reading - self.origin;
        self.sum += y;
        self.cos += y * cos;
        self.sin += y * sin;
        self.low = if reading < self.low { reading } else { self.low };
        self.high = if reading > self.high { reading } else { self.high };
    }

    /// A block ends; `n` is its cycles, `block` its number.
    pub fn close(&mut self, n: f64, block: u32) {
        let value = Complex(2.0 * self.cos / n, -2.0 * self.sin / n);
        self.value = self.value + value;
        self.squares += value.square();
        self.last = self.sum / n;
        if block == 0 {
            self.first = self.last;
        }
        (self.sum, self.cos, self.sin) = (0.0, 0.0, 0.0);
    }

    /// All blocks are there.
    #[must_use]
    pub fn amplitude(&self, tone: &Tone, cycle: f64) -> Amplitude {
        let blocks = f64::from(BLOCKS);
        let mean = self.value.scaled(1.0 / blocks);
        let scatter = (self.squares / blocks - mean.square()).max(0.0);
        let slope = (self.last - self.first) / ((blocks - 1.0) * f64::from(tone.cycles) * cycle);
        Amplitude { value: mean + Complex(0.0, -2.0 * slope / tone.omega()), variance: scatter / (blocks - 1.0) }
    }

    /// Largest |reading| so far.
    #[must_use]
    pub fn peak(&self) -> f64 {
        self.high.max(-self.low)
    }

    /// Whether every reading was the same.
    #[must_use]
    pub fn stuck(&self) -> bool {
        self.low == self.high
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn amplitude_and_phase_are_exact_beside_offset_drift_and_harmonics() {
        let tone = Tone { frequency: 10.0, periods: 5, cycles: 1000, ..Tone::default() };
        let (cycle, mut detector) = (0.0005, Detector::default());
        detector.begin(40.0);
        for i in 0..8000u32 {
            let phase = core::f64::consts::TAU * 5.0 * f64::from(i % 1000) / 1000.0;
            let y = 40.0 + 3.0 * f64::from(i) * cycle + 2.0 * (phase + 0.7).cos() + 5.0 * (3.0 * phase).sin();
            detector.read(y, phase.cos(), phase.sin());
            if i % 1000 == 999 {
                detector.close(1000.0, i / 1000);
            }
        }
        let found = detector.amplitude(&tone, cycle);
        // The sum stands for an integral: a drift is half a cycle's worth off, a part in 30 000 here.
        assert!((found.value.size() - 2.0).abs() < 3e-3 && (found.value.phase() - 0.7).abs() < 1e-3, "{found:?}");
        assert!(found.variance < 1e-12 && !detector.stuck() && detector.peak() > 50.0);
    }
}
