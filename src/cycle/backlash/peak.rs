//! The published peak rule (CN103561904): a FIFO of four torques, T[n−2] ≥ T[n−3], T[n−1] ≥ T[n−2], T[n] < T[n−1];
//! the lost motion is the travel at n−1. Only a peak after the rise counts.
//!
//! Kept for comparison and for `method = peak`. It reads low: at standstill part of the wind-up is already
//! released, and noise makes the first rise–rise–fall come before the true peak.

use super::curve::Moments;

/// Rule in progress over one curve. The curve's bins are first joined to points one motor step apart.
#[derive(Debug, Clone, Copy, Default)]
pub struct Peak {
    step: f64,
    rise: f64,
    point: Moments,
    end: f64,
    torque: [f64; 4],
    travel: f64,
    points: u32,
    found: Option<f64>,
}

impl Peak {
    /// Starts the rule with points `step` mm apart; torques below `rise` are not yet the rise of the wind-up.
    #[must_use]
    pub fn new(rise: f64, step: f64) -> Peak {
        Peak { step, rise, end: step, ..Peak::default() }
    }

    /// Adds a bin of the curve: samples, travel (mm) and torque in the sense of the motion; travels rise.
    pub fn add(&mut self, n: f64, travel: f64, torque: f64) {
        if travel >= self.end && self.point.n > 0.0 {
            self.point(self.point.s / self.point.n, self.point.t / self.point.n);
            self.point = Moments::default();
            self.end = travel + self.step;
        }
        self.point = self.point.with(n, travel, torque);
    }

    fn point(&mut self, travel: f64, torque: f64) {
        if self.found.is_some() {
            return;
        }
        let [_, b, c, d] = self.torque;
        self.torque = [b, c, d, torque];
        self.points = self.points.saturating_add(1);
        let [t3, t2, t1, t0] = self.torque;
        if self.points >= 4 && t2 >= t3 && t1 >= t2 && t0 < t1 && t1 >= self.rise {
            self.found = Some(self.travel);
        }
        self.travel = travel;
    }

    /// Travel at the peak in mm.
    #[must_use]
    pub fn found(&self) -> Option<f64> {
        self.found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(torques: &[f64], rise: f64) -> Option<f64> {
        let mut peak = Peak::new(rise, 1.0);
        torques.iter().chain([&0.0]).enumerate().for_each(|(i, t)| peak.add(1.0, i as f64 + 0.5, *t));
        peak.found()
    }

    #[test]
    fn finds_the_point_before_the_fall() {
        assert_eq!(read(&[-1.0, 0.0, 1.0, 2.0, 3.0, 2.5, 2.5], 1.0), Some(4.5));
        assert_eq!(read(&[1.0, 1.0, 1.0, 0.9], 0.5), Some(2.5), "a level rise counts, as printed");
    }

    #[test]
    fn needs_two_rises_and_the_threshold() {
        assert_eq!(read(&[0.0, 0.5, 0.4, 0.5, 0.4], 0.0), None);
        assert_eq!(read(&[0.0, 0.1, 0.2, 0.1, 0.5, 0.6, 0.7, 0.6], 0.5), Some(6.5));
    }
}
