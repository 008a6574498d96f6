//! The revolution in points: what was measured at each, and the corrections, one in force and one that comes.
//!
//! Point i of N, an even number, lies at i/N − 1/2 turns. Half a turn has two entries, the first and one behind the last.

use super::config::GIB_LEARNING_POINTS;

/// Entries of a table.
pub const ENTRIES: usize = GIB_LEARNING_POINTS + 1;
/// Adding this rounds a number to a whole one, which then stands in the lowest bits.
const ROUNDING: f64 = 1.5 * (1u64 << 52) as f64;
/// Of those bits, as many as an entry's number has.
const LOWEST: usize = 2 * GIB_LEARNING_POINTS - 1;

/// What was measured at a point: sums weighted by the turn that each reading stands for, in points.
#[derive(Debug, Clone, Copy, Default)]
pub struct Bin {
    /// Points turned.
    pub weight: f32,
    /// Points × µm.
    pub deviation: f32,
    /// Last target, mm.
    pub target: f64,
}

impl Bin {
    /// Adds a deviation, µm, that stands for a turn by `part` points.
    #[inline(always)]
    pub fn add(&mut self, part: f32, deviation: f32, target: f64) {
        self.weight += part;
        self.deviation += part * deviation;
        self.target = target;
    }
}

/// A correction at a point, µm, and its slope, µm per point.
#[derive(Debug, Clone, Copy, Default)]
pub struct Cell {
    /// µm.
    pub value: f32,
    /// µm per point.
    pub slope: f32,
}

/// A whole correction.
pub type Table = [Cell; ENTRIES];

/// Where on the revolution an angle is.
#[derive(Debug, Clone, Copy)]
pub struct Place {
    /// Nearest entry.
    pub entry: usize,
    /// How far beyond it, in points, −0.5 to 0.5.
    pub beyond: f32,
}

impl Place {
    /// Of an angle of −0.5 to 0.5 turns among some points.
    #[inline(always)]
    #[must_use]
    pub fn of(turns: f64, points: usize, scale: f64) -> Place {
        let at = Place::at(turns * scale);
        Place { entry: at.entry.wrapping_add(points >> 1) & LOWEST, ..at }
    }

    /// A number of points behind the first, if that is no more than there are.
    #[inline(always)]
    #[must_use]
    pub fn at(points: f64) -> Place {
        let rounded = points + ROUNDING;
        Place { entry: rounded.to_bits() as u32 as usize, beyond: (points - (rounded - ROUNDING)) as f32 }
    }

    /// What a table says there.
    #[inline(always)]
    #[must_use]
    pub fn read(&self, table: &Table) -> f32 {
        match table.get(self.entry) {
            Some(cell) => cell.value + self.beyond * cell.slope,
            None => 0.0,
        }
    }
}

/// The angle of a point in turns.
#[must_use]
pub fn angle(point: usize, points: usize) -> f64 {
    point as f64 / points as f64 - 0.5
}

/// Gives the entry behind the last what the first has: both are the same point.
pub fn close(table: &mut Table, points: usize) {
    let first = table[0];
    if let Some(last) = table.get_mut(points) {
        *last = first;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_angle_finds_its_point_and_half_a_turn_is_one() {
        for points in [16usize, 18, 254, 256, 1024] {
            let mut table = [Cell::default(); ENTRIES];
            let f = |turns: f64| (core::f64::consts::TAU * turns).cos();
            for (i, cell) in table.iter_mut().enumerate().take(points) {
                let t = angle(i, points);
                let slope = -(core::f64::consts::TAU * t).sin() * core::f64::consts::TAU / points as f64;
                *cell = Cell { value: f(t) as f32, slope: slope as f32 };
            }
            close(&mut table, points);
            let step = core::f64::consts::TAU / points as f64;
            for i in -5000..=5000 {
                let turns = f64::from(i) * 1e-4;
                let place = Place::of(turns, points, points as f64);
                assert!(place.entry <= points && place.beyond.abs() <= 0.5);
                let found = f64::from(place.read(&table));
                assert!((found - f(turns)).abs() < 0.13 * step * step + 1e-5, "{points} {turns}: {found}");
            }
        }
    }
}
