//! Gathers samples of torque and speed into blocks, a few instructions a sample.
//!
//! The torque balance is multiplied by a weight ψ that vanishes at both ends of a block and integrated: by parts the
//! acceleration becomes ∫ψ·ω' = −∫ψ'·ω, so that nothing is differentiated (method of modulating functions; Shinbrot
//! 1957). With the parabola ψ = ((N²−1)/4 − u²)/2, u = i − (N−1)/2, the acceleration is exactly the slope of the
//! least-squares line through the speeds, and weighted means of torque and speed go with it:
//!
//! ```text
//! ω' = Σu·ω / (Σψ·Δt),   T̄ = Σψ·T / Σψ,   ω̄ = Σψ·ω / Σψ,   Σψ = Σu² = N(N²−1)/12
//! ```
//!
//! Before, a wild sample gives way to the median of itself and its neighbours: one that is sixteen times further from it
//! than usual (after Hampel; some 4.5 standard deviations of normal noise). Samples that say nothing about inertia
//! end a block without trace: standing still, take-up, field weakening, saturation.

/// Blocks that a measurement can hold.
pub const BLOCKS: usize = 512;

/// One equation of the torque balance.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Block {
    /// Weighted mean torque, N·m.
    pub torque: f64,
    /// Weighted mean speed, rad/s.
    pub speed: f64,
    /// Acceleration, rad/s².
    pub acceleration: f64,
}

/// Which samples count, in the units of the input.
#[derive(Debug, Clone, Copy)]
pub struct Gate {
    /// Lowest |speed|, rpm.
    pub standstill: f64,
    /// Highest |speed|, rpm.
    pub base: f64,
    /// Highest |torque|.
    pub saturation: f64,
    /// Samples left out after standing still or a torque that changed its sense.
    pub takeup: u32,
}

/// Samples on their way into blocks.
#[derive(Debug, Clone, Copy)]
pub struct Gather {
    gate: Gate,
    length: u32,
    left: u32,
    skip: u32,
    u: f64,
    first_u: f64,
    c: f64,
    torque: f64,
    speed: f64,
    slope: f64,
    speeds: Calm,
    torques: Calm,
    /// rad/s per rpm over Σψ; N·m per unit of the input over Σψ; and the same as the first, per second.
    scale: [f64; 3],
    last_torque: f64,
    used: usize,
    blocks: [Block; BLOCKS],
}

/// One signal on its way past the wild samples.
#[derive(Debug, Clone, Copy, Default)]
struct Calm {
    before: f64,
    middle: f64,
    /// Usual distance of a sample from the median of three: the median of these distances, followed by steps up and
    /// down, which a wild one moves no further than any other.
    usual: f64,
}

impl Calm {
    /// The sample before `next`, or the median in its place where it is wild.
    #[inline(always)]
    fn pass(&mut self, next: f64) -> f64 {
        const UP: f64 = 1.0 + 1.0 / 16.0;
        const DOWN: f64 = 1.0 / UP;
        const LEAST: f64 = 1e-6;
        const WILD: f64 = 16.0;
        let (a, b) = (self.before, self.middle);
        let (low, high) = if a < b { (a, b) } else { (b, a) };
        let below = if next < high { next } else { high };
        let median = if low > below { low } else { below };
        let away = (b - median).abs();
        let wild = away > WILD * self.usual;
        let followed = self.usual * if away > self.usual { UP } else { DOWN };
        self.usual = if followed > LEAST { followed } else { LEAST };
        self.before = b;
        self.middle = next;
        if wild { median } else { b }
    }
}

impl Default for Gather {
    fn default() -> Gather {
        Gather::new(Gate { standstill: 0.0, base: f64::MAX, saturation: f64::MAX, takeup: 0 }, 4, 1e-3, 1.0)
    }
}

impl Gather {
    /// Empty, for blocks of `length` samples (at least 4), one every `cycle_s`, `torque_nm` N·m per unit of the input.
    #[must_use]
    pub fn new(gate: Gate, length: u32, cycle_s: f64, torque_nm: f64) -> Gather {
        let length = length.max(4);
        let n = f64::from(length);
        let sum = n * (n * n - 1.0) / 12.0;
        let rad_s = crate::units::rad_s_from_rpm(1.0);
        Gather {
            gate,
            length,
            left: length,
            skip: gate.takeup.max(2), // the median is full after two samples
            u: 0.5 * (1.0 - n),
            first_u: 0.5 * (1.0 - n),
            c: (n * n - 1.0) / 4.0,
            torque: 0.0,
            speed: 0.0,
            slope: 0.0,
            speeds: Calm::default(),
            torques: Calm::default(),
            scale: [0.5 * rad_s / sum, 0.5 * torque_nm / sum, rad_s / (sum * cycle_s)],
            last_torque: 0.0,
            used: 0,
            blocks: [Block::default(); BLOCKS],
        }
    }

    /// The blocks gathered.
    #[must_use]
    pub fn blocks(&self) -> &[Block] {
        self.blocks.get(..self.used).unwrap_or(&[])
    }

    /// Samples in a block.
    #[must_use]
    pub fn length(&self) -> u32 {
        self.length
    }

    /// Leaves the next `samples` out and begins a new block after them.
    #[inline]
    pub fn leave_out(&mut self, samples: u32) {
        self.skip = samples.max(1);
        self.restart();
    }

    /// Adds a sample; both are finite.
    #[inline(always)]
    pub fn add(&mut self, speed_rpm: f64, torque: f64) {
        let speed = self.speeds.pass(speed_rpm);
        let moment = self.torques.pass(torque);
        let size = speed.abs();
        if self.skip != 0 || size < self.gate.standstill || size > self.gate.base || moment.abs() > self.gate.saturation
        {
            self.refuse(size);
            return;
        }
        let weight = self.c - self.u * self.u;
        self.torque += weight * moment;
        self.speed += weight * speed;
        self.slope += self.u * speed;
        self.u += 1.0;
        self.left -= 1;
        if self.left == 0 {
            self.close();
        }
    }

    #[inline(never)]
    fn refuse(&mut self, size: f64) {
        let takeup = if size < self.gate.standstill { self.gate.takeup.max(1) } else { 0 };
        self.skip = self.skip.saturating_sub(1).max(takeup);
        self.restart();
    }

    fn restart(&mut self) {
        self.left = self.length;
        self.u = self.first_u;
        self.torque = 0.0;
        self.speed = 0.0;
        self.slope = 0.0;
    }

    #[inline(never)]
    fn close(&mut self) {
        let block = Block {
            torque: self.torque * self.scale[1],
            speed: self.speed * self.scale[0],
            acceleration: self.slope * self.scale[2],
        };
        let same_sense = block.torque * self.last_torque >= 0.0;
        self.last_torque = block.torque;
        self.restart();
        if !same_sense {
            // Belts and gears change flank: what follows accelerates less than the torque says.
            self.skip = self.gate.takeup;
            return;
        }
        if let Some(place) = self.blocks.get_mut(self.used) {
            *place = block;
            self.used += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::{rad_s_from_rpm, rpm_from_rad_s};

    fn gate() -> Gate {
        Gate { standstill: 1.0, base: 5000.0, saturation: 40.0, takeup: 10 }
    }

    #[test]
    fn a_ramp_is_its_slope_and_a_wild_sample_leaves_no_trace() {
        let mut gather = Gather::new(gate(), 20, 1e-3, 0.5);
        for i in 0..500 {
            let (speed, torque) = (100.0 + 30.0 * f64::from(i) * 1e-3, 8.0);
            let wild = i % 50 == 7;
            gather.add(if wild { 4000.0 } else { speed }, if wild { -39.0 } else { torque });
        }
        assert!(gather.blocks().len() >= 20);
        for block in gather.blocks() {
            assert!((block.acceleration - rad_s_from_rpm(30.0)).abs() < 0.05 * rad_s_from_rpm(30.0), "{block:?}");
            assert!((block.torque - 4.0).abs() < 1e-9);
        }
    }

    /// The weighted equation holds within a block whatever the motion: T = J·ω' + B·ω with any smooth ω.
    #[test]
    fn balance_holds_for_curved_motion() {
        let (j, b) = (0.006, 0.001);
        let mut gather = Gather::new(gate(), 60, 1e-3, 1.0);
        for i in 0..3000 {
            let t = f64::from(i) * 1e-3;
            let omega = 100.0 + 40.0 * (9.0 * t).sin();
            gather.add(rpm_from_rad_s(omega), 30.0 + j * 360.0 * (9.0 * t).cos() + b * omega);
        }
        for block in gather.blocks() {
            let expected = 30.0 + j * block.acceleration + b * block.speed;
            assert!((block.torque - expected).abs() < 1e-3, "{block:?} {expected}");
        }
        assert!(gather.blocks().len() > 40);
    }

    #[test]
    fn standstill_weakening_and_saturation_leave_nothing() {
        for (speed, torque) in [(0.5, 5.0), (6000.0, 5.0), (100.0, 45.0)] {
            let mut gather = Gather::new(gate(), 8, 1e-3, 1.0);
            (0..400).for_each(|_| gather.add(speed, torque));
            assert!(gather.blocks().is_empty(), "{speed} {torque}");
        }
    }

    #[test]
    fn take_up_after_a_change_of_flank_is_left_out() {
        let mut gather = Gather::new(gate(), 10, 1e-3, 1.0);
        for i in 0..200 {
            gather.add(1000.0, if i < 100 { 5.0 } else { -5.0 });
        }
        assert!(gather.blocks().iter().filter(|b| b.torque > 0.0).count() >= 8);
        let after = gather.blocks().iter().filter(|b| b.torque < 0.0).count();
        assert!((6..=8).contains(&after), "{after}");
    }
}
