//! The revolution in points: what was measured at each, and the corrections, one in force and one that comes.
//!
//! Point i of N, an even number, lies at i/N − 1/2 turns. Half a turn has two entries, the first and one behind the last;
//! where the points fill the tables these are one.

use super::config::GIB_LEARNING_POINTS;

/// Entries of a table: a power of two, so that an entry's number needs no check.
pub const ENTRIES: usize = GIB_LEARNING_POINTS.next_power_of_two();
/// Adding this rounds a number to a whole one, which then stands in the lowest bits.
const ROUNDING: f64 = 1.5 * (1u64 << 52) as f64;

/// What was measured at a point.
#[derive(Debug, Clone, Copy, Default)]
pub struct Bin {
    /// Deviations times their weights, mm.
    pub deviation: f64,
    /// Last target, mm.
    pub target: f64,
}

/// What the readings at a point weigh: as much as the turn that each stands for, in turns of a cycle.
#[derive(Debug, Clone, Copy, Default)]
pub struct Weight {
    /// Of readings at a speed that varies.
    pub sum: f32,
    /// Readings at a steady speed: each weighs 1.
    pub steady: u32,
}

impl Weight {
    /// Of all readings.
    #[must_use]
    pub fn whole(self) -> f64 {
        f64::from(self.sum) + f64::from(self.steady)
    }
}

/// A correction at a point, µm, and its slope, µm per point.
#[derive(Debug, Clone, Copy, Default)]
pub struct Cell {
    /// µm.
    pub value: f64,
    /// µm per point.
    pub slope: f64,
}

/// A whole correction.
pub type Table = [Cell; ENTRIES];

/// Where on the revolution an angle is.
#[derive(Debug, Clone, Copy)]
pub struct Place {
    /// Nearest entry; of an angle up to a turn beyond them, one beyond those that there are.
    pub entry: usize,
    /// How far beyond it, in points, −0.5 to 0.5.
    pub beyond: f64,
}

impl Place {
    /// Of an angle of −0.5 to 0.5 turns among some points.
    #[inline(always)]
    #[must_use]
    pub fn of(turns: f64, scale: f64) -> Place {
        Place::at((turns + 0.5) * scale)
    }

    /// A number of points behind the first, if that is no more than there are.
    #[inline(always)]
    #[must_use]
    pub fn at(points: f64) -> Place {
        let rounded = points + ROUNDING;
        Place { entry: rounded.to_bits() as usize & (2 * ENTRIES - 1), beyond: points - (rounded - ROUNDING) }
    }

    /// What a table says there.
    #[inline(always)]
    #[must_use]
    pub fn read(&self, table: &Table) -> f64 {
        let cell = &table[self.entry & (ENTRIES - 1)];
        cell.value + self.beyond * cell.slope
    }
}

/// The angle of a point in turns.
#[must_use]
pub fn angle(point: usize, points: usize) -> f64 {
    point as f64 / points as f64 - 0.5
}

/// Gives the entry behind the last what the first has: both are the same point.
pub fn close(table: &mut Table, points: usize) {
    table[points & (ENTRIES - 1)] = table[0];
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_angle_beyond_the_turn_is_no_entry() {
        for points in (16..=1024).step_by(2) {
            for beyond in [0.6, 2.0, 0.25 * points as f64] {
                assert!(Place::at(points as f64 + beyond).entry > points && Place::at(-beyond).entry > points);
            }
        }
    }

    #[test]
    fn every_angle_finds_its_point_and_half_a_turn_is_one() {
        for points in [16usize, 18, 254, 256, 1024] {
            let mut table = [Cell::default(); ENTRIES];
            let f = |turns: f64| (core::f64::consts::TAU * turns).cos();
            for (i, cell) in table.iter_mut().enumerate().take(points) {
                let t = angle(i, points);
                let slope = -(core::f64::consts::TAU * t).sin() * core::f64::consts::TAU / points as f64;
                *cell = Cell { value: f(t), slope };
            }
            close(&mut table, points);
            let step = core::f64::consts::TAU / points as f64;
            for i in -5000..=5000 {
                let turns = f64::from(i) * 1e-4;
                let place = Place::of(turns, points as f64);
                assert!(place.entry <= points && place.beyond.abs() <= 0.5);
                let found = place.read(&table);
                assert!((found - f(turns)).abs() < 0.13 * step * step + 1e-5, "{points} {turns}: {found}");
            }
        }
    }
}
