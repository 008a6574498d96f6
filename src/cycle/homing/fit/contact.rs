//! The contact point and how sure it is, from the sums of what is surely level and surely line.

use super::sums::{Steps, Sums};
use crate::cycle::level::inflation;
use crate::error::{Fault, GIB_ERR_HOMING_SHAPE};

/// Fewest blocks in a level or a line.
pub const FEWEST: f64 = 6.0;
/// Standard errors by which a slope must be above zero.
pub const SURE: f64 = 5.0;

/// What a touch shows. Ways in mm from the touch's start, torque in the unit of the input, variances of one value.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Contact {
    /// Way to the contact point.
    pub way: f64,
    /// Its variance, mm².
    pub variance: f64,
    /// Torque before contact.
    pub level: f64,
    /// Slope of the line: stiffness of drive and stop in series.
    pub stiffness: f64,
    /// Standard error of the slope.
    pub stiffness_error: f64,
    /// Standard deviation of a block about level and line.
    pub noise: f64,
    /// By how much later the line starts as its upper half has it than as its lower half has it, and the variance of that: a stop that
    /// stiffens with the force, or an impact that is over late, bends the line.
    pub bend: f64,
    /// See `bend`.
    pub bend_variance: f64,
    /// Way that a torque which swings before contact, as of an axis that sticks and slips, may hide.
    pub swing: f64,
    /// Way from contact to where the torque limit was reached.
    pub press: f64,
    /// Way at which the plain threshold was reached.
    pub threshold_way: f64,
}

/// The parts of a touch, and the steps within two of them.
#[derive(Debug, Clone, Copy, Default)]
pub struct Parts {
    pub level: Sums,
    pub level_steps: Steps,
    pub line: Sums,
    pub line_steps: Steps,
    /// Lower and upper half of the line.
    pub halves: [Sums; 2],
    /// Where what is looked at begins and ends.
    pub first: f64,
    pub last: f64,
    /// Where the ways of the sums count from.
    pub end: f64,
    pub threshold: f64,
}

/// Where a line of that slope through the middle of its blocks leaves the level, and the variance of that.
fn start_of(line: &Sums, level: f64, slope: f64, scatter: f64) -> (f64, f64) {
    let mean = line.x / line.n;
    let way = mean - (line.t / line.n - level) / slope;
    (way, scatter * (1.0 / line.n + (mean - way) * (mean - way) / line.spread().0) / (slope * slope))
}

impl Parts {
    /// By how much the line's variance exceeds that of independent blocks: an axis that swings or sticks and slips on the
    /// stop scatters about its line, but not from block to block.
    fn hanging_together(&self, slope: f64, about_line: f64) -> f64 {
        const MOST: f64 = 0.7;
        inflation(self.line_steps.about(slope) / about_line.max(f64::MIN_POSITIVE), MOST)
    }

    /// Peak of the torque's swing before contact: what the level scatters more than its noise from block to block, beyond chance.
    fn swing(&self) -> f64 {
        const PEAK: f64 = 1.5;
        let n = self.level.n;
        let noise = self.level_steps.about(0.0) / (2.0 * (n - 1.0));
        let beyond = self.level.scatter() / (n - 1.0) - (1.0 + 3.0 * (3.0 / n).sqrt()) * noise;
        PEAK * beyond.max(0.0).sqrt()
    }

    /// Where the two halves of the line start, one less the other, and what of its variance is chance: the noise from block to
    /// block. Nothing where a half is too short.
    fn bend(&self, level: f64, slope: f64) -> (f64, f64) {
        /// Of the whole line's slope; a half that is flatter, as by chance, starts nowhere.
        const FLATTEST: f64 = 0.2;
        let chance = 0.5 * self.line_steps.about(slope) / (self.line.n - 1.0);
        let [low, high] = self.halves.map(|half| {
            let own = half.line().0.max(FLATTEST * slope);
            start_of(&half, level, own, chance)
        });
        let bend = (high.0 - low.0, high.1 + low.1);
        if self.halves.iter().all(|half| half.n >= 3.0) && bend.1.is_finite() { bend } else { (0.0, 0.0) }
    }

    /// That the line does not start, `way` from the end, where it is looked for.
    pub fn outside(&self, way: f64) -> Fault {
        let last = self.last + self.end;
        Fault { high: last, ..lacks("contact_mm\0", way + self.end, self.first + self.end) }
    }

    /// Contact point and its variance, or why the curve is not a level and a line.
    pub fn solve(&self) -> Result<Contact, Fault> {
        let (level, line) = (&self.level, &self.line);
        let fewer = level.n.min(line.n);
        if fewer < FEWEST {
            return Err(lacks("blocks\0", fewer, FEWEST));
        }
        let torque = level.t / level.n;
        let (slope, about_line) = line.line();
        let (sxx, _) = line.spread();
        let scatter = (level.scatter() + about_line) / (level.n + line.n - 3.0);
        let slope_error = (about_line / (line.n - 2.0) / sxx).sqrt();
        // Not `<=`: a slope that is no number is no slope.
        if !(slope > SURE * slope_error) {
            let clear = slope / slope_error;
            return Err(lacks("line_clear_ratio\0", if clear.is_finite() { clear } else { 0.0 }, SURE));
        }
        let scatter_line = about_line / (line.n - 2.0) * self.hanging_together(slope, about_line);
        let (way, of_line) = start_of(line, torque, slope, scatter_line);
        let of_level = level.scatter() / (level.n - 1.0) / level.n / (slope * slope);
        let (bend, bend_variance) = self.bend(torque, slope);
        let contact = Contact {
            way: way + self.end,
            variance: of_level + of_line,
            level: torque,
            stiffness: slope,
            stiffness_error: slope_error,
            bend,
            bend_variance,
            noise: scatter.sqrt(),
            swing: self.swing() / slope,
            press: (self.threshold - torque) / slope,
            threshold_way: self.last + self.end,
        };
        let seen = way > self.first && way < self.last;
        if seen { Ok(contact) } else { Err(self.outside(way)) }
    }
}

/// What a level or a line has too little of.
pub fn lacks(field: &'static str, value: f64, low: f64) -> Fault {
    Fault { code: GIB_ERR_HOMING_SHAPE, field, value, low, high: f64::MAX }
}
