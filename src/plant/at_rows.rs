//! From rows to servo cycles and back: the command of each cycle, and what a simulation gives at the rows of a recording.

use super::between::cubic_of;
use super::lateness::share_of_earlier;
use super::simulate::Rows;
use std::iter::Peekable;

/// Share of a cycle that is none: times are written rounded.
pub(super) const ROUNDED: f64 = 1e-3;

/// The command at the start of each servo cycle: interpolated between rows, held over rows without one.
pub fn command_of_cycles(time_s: &[f64], command: &[f64], period: f64, cycles: usize) -> impl Iterator<Item = f64> {
    let known = time_s.iter().zip(command).filter(|(_, x)| x.is_finite());
    let mut rows = known.map(|(t, x)| (t - time_s[0], *x));
    let first = rows.next();
    let (mut now, mut next) = (first, rows.next());
    (0..cycles).map(move |cycle| {
        let t = cycle as f64 * period;
        while let Some(row) = next.filter(|row| row.0 <= t + ROUNDED * period) {
            (now, next) = (Some(row), rows.next());
        }
        let (Some((_, x_first)), Some((t0, x0))) = (first, now) else { return 0.0 };
        if (t - t0).abs() <= ROUNDED * period {
            return x0;
        }
        match next {
            Some((t1, x1)) if t >= t0 => x0 + (x1 - x0) * (t - t0) / (t1 - t0),
            Some(_) => x_first,
            None => x0,
        }
    })
}

/// What a simulation gives, at the rows of a recording.
pub(super) struct AtRows<M: Iterator<Item = f64>, T: Iterator<Item = f64>> {
    pub motor: Reader<M>,
    pub table: Option<Reader<M>>,
    pub torque: Reader<T>,
}

impl<M: Iterator<Item = f64>, T: Iterator<Item = f64>> Rows for AtRows<M, T> {
    fn positions(&mut self, motor: f64, table: f64) {
        self.motor.add(motor);
        if let Some(reader) = &mut self.table {
            reader.add(table);
        }
    }

    fn torque(&mut self, torque: f64) {
        self.torque.add(torque);
    }
}

/// How a series goes from cycle to cycle.
#[derive(Debug, Clone, Copy)]
pub(super) enum Between {
    /// Smoothly.
    Smooth,
    /// As a torque that follows its steps: Ts/τ.
    Lagging(f64),
}

/// Reads a series of so many cycles, which comes one after the other, at places between them that rise.
pub(super) struct Reader<P: Iterator<Item = f64>> {
    cycles: usize,
    places: Peekable<P>,
    between: Between,
    came: usize,
    /// The last cycles, each at its remainder: a cubic takes four.
    last: [f64; 4],
    pub values: Vec<f64>,
}

impl<P: Iterator<Item = f64>> Reader<P> {
    pub fn new(cycles: usize, count: usize, places: P, between: Between) -> Self {
        let values = Vec::with_capacity(count);
        Self { cycles, places: places.peekable(), between, came: 0, last: [0.0; 4], values }
    }

    pub fn add(&mut self, value: f64) {
        self.last[self.came % 4] = value;
        self.came += 1;
        while let Some(place) = self.places.next_if(|place| self.came >= self.cycles.min(*place as usize + 3)) {
            self.values.push(self.at(place));
        }
    }

    fn at(&self, place: f64) -> f64 {
        match self.between {
            Between::Smooth => cubic_of(self.cycles, |k| self.last[k % 4], place),
            Between::Lagging(rate) => {
                let (cycle, part) = (place as usize, place.fract());
                let next = (cycle + 1).min(self.cycles.saturating_sub(1));
                let earlier = share_of_earlier(rate, 1.0 - part);
                earlier * self.last[cycle % 4] + (1.0 - earlier) * self.last[next % 4]
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_of_a_cycle_is_that_of_its_row() {
        let time: Vec<f64> = (0..100).map(|i| f64::from(i) * 1e-3).collect();
        let command: Vec<f64> = time.iter().map(|t| t * t).collect();
        assert!(command_of_cycles(&time, &command, 1e-3, 100).eq(command.iter().copied()));
        // Four cycles a row: between the rows a straight line.
        let fine: Vec<f64> = command_of_cycles(&time, &command, 0.25e-3, 397).collect();
        assert_eq!(fine.len(), 397);
        for (cycle, x) in fine.iter().enumerate() {
            let t = cycle as f64 * 0.25e-3;
            assert!((x - t * t).abs() < 0.26e-6, "{cycle}");
        }
    }

    #[test]
    fn a_row_without_a_command_is_bridged() {
        let time = [0.0, 1.0, 2.0, 3.0];
        let command = [f64::NAN, 1.0, f64::NAN, 3.0];
        assert!(command_of_cycles(&time, &command, 1.0, 4).eq([1.0, 1.0, 2.0, 3.0]));
    }
}
