//! From rows to servo cycles and back: the command of each cycle, and what a simulation gives at the rows of a recording.

use super::between::cubic_of;
use super::lateness::share_of_earlier;
use super::simulate::Rows;
use std::iter::Peekable;

/// Share of a cycle that is none: times are written rounded.
pub(super) const ROUNDED: f64 = 1e-3;

/// The command at the start of each servo cycle: between rows as smooth as an interpolator makes it, by Hermite's cubic, which stands still
/// where two rows are the same; the same over rows without one.
pub fn command_of_cycles(time_s: &[f64], command: &[f64], period: f64, cycles: usize) -> impl Iterator<Item = f64> {
    let known = time_s.iter().zip(command).filter(|(_, x)| x.is_finite());
    let mut rows = known.map(|(t, x)| (t - time_s[0], *x));
    let first = rows.next();
    let (mut before, mut now, mut next, mut after) = (None, first, rows.next(), rows.next());
    (0..cycles).map(move |cycle| {
        let t = cycle as f64 * period;
        while next.is_some_and(|row: Row| row.0 <= t + ROUNDED * period) {
            (before, now, next, after) = (now, next, after, rows.next());
        }
        let (Some((_, x_first)), Some(at)) = (first, now) else { return 0.0 };
        if (t - at.0).abs() <= ROUNDED * period {
            return at.1;
        }
        match next {
            Some(to) if t >= at.0 => between([before, Some(at), Some(to), after], t),
            Some(_) => x_first,
            None => at.1,
        }
    })
}

/// When a row was, s, and its command.
type Row = (f64, f64);

/// The command between the second and the third of four rows, of which the first and the last need not be there.
fn between([before, at, to, after]: [Option<Row>; 4], t: f64) -> f64 {
    let slope = |a: Option<Row>, b: Option<Row>| a.zip(b).map(|(a, b)| ((b.1 - a.1) / (b.0 - a.0), b.0 - a.0));
    let (Some((t0, x0)), Some((mean, long))) = (at, slope(at, to)) else { return 0.0 };
    // Of the parabola through three rows.
    let speed = |beside: Option<(f64, f64)>| match beside {
        Some((beside, its)) if beside != 0.0 && mean != 0.0 => (beside * long + mean * its) / (long + its),
        Some(_) => 0.0,
        None => mean,
    };
    let [from, into] = [speed(slope(before, at)), speed(slope(to, after))];
    let share = (t - t0) / long;
    let left = 1.0 - share;
    x0 + (t - t0) * (share * mean + left * (from + share * (2.0 * mean - from - into)))
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
        // Four cycles a row: between the rows a parabola, but for the ends, beyond which nothing is known.
        let fine: Vec<f64> = command_of_cycles(&time, &command, 0.25e-3, 397).collect();
        assert_eq!(fine.len(), 397);
        for (cycle, x) in fine.iter().enumerate() {
            let t = cycle as f64 * 0.25e-3;
            let least = if (4..392).contains(&cycle) { 1e-12 } else { 0.26e-6 };
            assert!((x - t * t).abs() < least, "{cycle}");
        }
    }

    #[test]
    fn a_command_that_stands_is_not_passed() {
        let time = [0.0, 1.0, 2.0, 3.0, 4.0];
        let fine: Vec<f64> = command_of_cycles(&time, &[0.0, 0.0, 2.0, 5.0, 5.0], 0.25, 17).collect();
        assert!(fine[..5].iter().all(|x| *x == 0.0) && fine[12..].iter().all(|x| *x == 5.0), "{fine:?}");
        assert!(fine.windows(2).all(|pair| pair[0] <= pair[1]), "{fine:?}");
    }

    #[test]
    fn a_row_without_a_command_is_bridged() {
        let time = [0.0, 1.0, 2.0, 3.0];
        let command = [f64::NAN, 1.0, f64::NAN, 3.0];
        assert!(command_of_cycles(&time, &command, 1.0, 4).eq([1.0, 1.0, 2.0, 3.0]));
    }
}
