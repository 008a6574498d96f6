//! A recorded axis cut into sweeps: stretches of motion one way, from one turning point to the next.

use std::ops::Range;

use crate::analysis::motion::{smallest_travel, turning_points};
use crate::analysis::statistics::{quantile, reading_error};

/// Motor and table of one axis over an unbroken piece of a recording; lengths in mm, or angles in degrees.
pub(super) struct Track {
    /// Time of each row, s.
    pub time_s: Vec<f64>,
    /// Motor position.
    pub motor: Vec<f64>,
    /// Motor minus table.
    pub difference: Vec<f64>,
}

/// One row of a sweep while the axis moves.
#[derive(Clone, Copy)]
pub(super) struct Sample {
    pub motor: f64,
    pub difference: f64,
    /// Velocity, 1/s, signed.
    pub speed: f64,
    /// Acceleration, 1/s².
    pub accel: f64,
}

/// Motion one way.
pub(super) struct Sweep {
    /// Rows of the track, with the standstill at its ends.
    pub rows: Range<usize>,
    /// +1 or −1.
    pub direction: f64,
    /// The rows in which the axis moves this way.
    pub moving: Vec<Sample>,
    /// Highest speed but for the fastest tenth of the rows, 1/s.
    pub top_speed: f64,
    /// Standard deviation of `speed` that noise and grid of the motor position make, 1/s.
    pub speed_noise: f64,
    /// True for the first sweep of a piece: nobody saw how the axis came to where it starts.
    pub first: bool,
}

impl Track {
    /// Cuts the track at its turning points; wiggles below 0.05 % of the stroke are none.
    pub fn sweeps(&self) -> Vec<Sweep> {
        let (low, high) = self.stroke();
        self.cut(smallest_travel(&self.motor).max(5e-4 * (high - low)))
    }

    /// Cuts the track at every turn that noise and grid do not make by themselves.
    pub fn fine_sweeps(&self) -> Vec<Sweep> {
        self.cut(smallest_travel(&self.motor))
    }

    /// Cuts the track at turns of more than a quarter of the stroke.
    pub fn long_sweeps(&self) -> Vec<Sweep> {
        let (low, high) = self.stroke();
        self.sweeps_beyond(0.25 * (high - low))
    }

    fn stroke(&self) -> (f64, f64) {
        self.motor.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)))
    }

    /// Cuts the track at turns of more than `travel`, and than noise and grid make by themselves.
    pub fn sweeps_beyond(&self, travel: f64) -> Vec<Sweep> {
        self.cut(smallest_travel(&self.motor).max(travel))
    }

    /// Takes `inertia`·acceleration and `viscous`·speed, in effort per 1/s² and 1/s, off an effort that stands for the
    /// difference.
    pub fn take_off_motion(&mut self, inertia: f64, viscous: f64) {
        let noise = reading_error(&self.motor);
        for sweep in self.fine_sweeps() {
            let half = self.half_window(&sweep.rows, noise);
            // The row of a turn ends one sweep and begins the next.
            for row in sweep.rows.start..sweep.rows.end - 1 {
                self.difference[row] -= inertia * self.accel(row, half) + viscous * self.speed(row, half);
            }
        }
    }

    fn cut(&self, travel: f64) -> Vec<Sweep> {
        let mut cuts = vec![0];
        cuts.extend(turning_points(&self.motor, travel));
        cuts.push(self.motor.len() - 1);
        let whole = |ends: &&[usize]| (self.motor[ends[1]] - self.motor[ends[0]]).abs() > travel;
        cuts.windows(2).filter(whole).enumerate().map(|(i, ends)| self.sweep(ends[0]..ends[1] + 1, i == 0)).collect()
    }

    fn sweep(&self, rows: Range<usize>, first: bool) -> Sweep {
        let motor = &self.motor[rows.clone()];
        let direction = (motor[motor.len() - 1] - motor[0]).signum();
        let noise = reading_error(motor);
        let half = self.half_window(&rows, noise);
        let speeds: Vec<f64> = rows.clone().map(|row| self.speed(row, half)).collect();
        let forward: Vec<f64> = speeds.iter().map(|v| v * direction).filter(|v| *v > 0.0).collect();
        let top_speed = quantile(&forward, 0.9).unwrap_or(0.0);
        // A twentieth of the top speed is standstill for a difference that settles while the axis rests.
        let moving = rows
            .clone()
            .zip(&speeds)
            .filter(|(_, speed)| **speed * direction > 0.05 * top_speed)
            .map(|(row, &speed)| Sample {
                motor: self.motor[row],
                difference: self.difference[row],
                speed,
                accel: self.accel(row, half),
            })
            .collect();
        let duration_s = self.time_s[rows.end - 1] - self.time_s[rows.start];
        let span_s = 2.0 * half as f64 * duration_s / (motor.len() - 1) as f64;
        Sweep { rows, direction, moving, top_speed, speed_noise: 2f64.sqrt() * noise / span_s, first }
    }

    /// Rows to either side for a velocity that noise and grid leave good to 1 %, or a fortieth of the sweep if that is less.
    fn half_window(&self, rows: &Range<usize>, noise: f64) -> usize {
        let motor = &self.motor[rows.clone()];
        let distance = (motor[motor.len() - 1] - motor[0]).abs();
        let needed = noise / 2f64.sqrt() / (0.01 * distance / motor.len() as f64).max(f64::MIN_POSITIVE);
        (needed.ceil() as usize).clamp(2, (motor.len() / 40).max(2))
    }

    /// Central difference. It leaves out the row itself, so its noise is not that of the row's own difference.
    fn speed(&self, row: usize, half: usize) -> f64 {
        let (a, b) = (row.saturating_sub(half), (row + half).min(self.motor.len() - 1));
        (self.motor[b] - self.motor[a]) / (self.time_s[b] - self.time_s[a])
    }

    fn accel(&self, row: usize, half: usize) -> f64 {
        let (a, b) = (row.saturating_sub(2 * half), (row + 2 * half).min(self.motor.len() - 1));
        (self.speed(b, half) - self.speed(a, half)) / (self.time_s[b] - self.time_s[a])
    }
}

impl Sweep {
    /// Distance from the first moving row to the last.
    pub fn way(&self) -> f64 {
        self.moving.first().zip(self.moving.last()).map_or(0.0, |(a, b)| (b.motor - a.motor).abs())
    }

    /// The moving rows from `travel` after the first on.
    pub fn after(&self, travel: f64) -> &[Sample] {
        let Some(first) = self.moving.first() else { return &[] };
        let on = self.moving.iter().position(|sample| (sample.motor - first.motor).abs() > travel);
        &self.moving[on.unwrap_or(self.moving.len())..]
    }
}
