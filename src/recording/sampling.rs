//! How the rows of a recording lie in time: period, jitter, and from which step on it counts as a gap.

/// Sampling of a recording, estimated from its time column.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sampling {
    /// Time of the first row, s.
    pub start_s: f64,
    /// Last time minus first, s.
    pub duration_s: f64,
    /// Mean time step of the rows that have no gap before them, s.
    pub period_s: f64,
    /// RMS deviation of those steps from the period, s.
    pub jitter_s: f64,
    /// Largest deviation of those steps from the period, s.
    pub jitter_max_s: f64,
    /// A step longer than this is a gap, s.
    pub gap_s: f64,
    /// Number of gaps.
    pub gaps: usize,
    /// True when no step departs from the period by more than 5 % beyond the resolution of the time column: the rows may be
    /// treated as equidistant between gaps.
    pub regular: bool,
}

/// Rows are missing here.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Hole {
    /// The first row after it.
    pub row: usize,
    /// How many rows are missing; 0 where that is no whole number of periods.
    pub missing: usize,
}

/// Most stamps on either side by which a lost row is told from jitter.
const STAMPS: usize = 8;
/// The deviations of their means by which a row must be gone before it is called lost.
const SURELY: f64 = 4.0;
/// A whole number of periods, to this share of one.
const WHOLE: f64 = 0.2;
/// Periods from which on a step may hide a lost row: two, less what the scatter of two stamps may take off.
const SUSPECT: f64 = 1.25;
/// Spans between stamps that a median is taken of.
const ENOUGH: usize = 100_000;

impl Sampling {
    /// Estimates the sampling of strictly increasing times, and finds where rows are missing; all zero for fewer than two.
    ///
    /// A step of more than `gap_s` is a gap. Stamps that scatter may hide one: where they scatter about an even grid, which
    /// later stamps keep to as well, a lost row shows in the mean of the stamps after it, which all come a period later.
    #[must_use]
    pub fn of(time_s: &[f64]) -> (Self, Vec<Hole>) {
        let (Some(&first), Some(&last)) = (time_s.first(), time_s.last()) else { return (Self::none(0.0), Vec::new()) };
        if time_s.len() < 2 {
            return (Self::none(first), Vec::new());
        }
        let mut steps: Vec<f64> = time_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let middle = steps.len() / 2;
        let median = *steps.select_nth_unstable_by(middle, f64::total_cmp).1;
        steps.iter_mut().for_each(|step| *step = (*step - median).abs());
        let scatter = *steps.select_nth_unstable_by(middle, f64::total_cmp).1;
        drop(steps);
        // Half a period missing is the least a lost row can leave in a regular recording; ten times the scatter keeps
        // honest irregular sampling (its steps spread about as widely as their median) from being called gaps.
        let mut gap_s = (1.5 * median).max(median + 10.0 * scatter);
        // What happens every few rows is the sampling itself, not a loss.
        let steps = time_s.len() - 1;
        if time_s.windows(2).filter(|pair| pair[1] - pair[0] > gap_s).count() > steps / 50 {
            gap_s = 5.0 * (last - first) / steps as f64;
        }
        let holes = match Grid::of(time_s, scatter) {
            Some(grid) => grid.holes(time_s, gap_s),
            None => {
                let gap = |row: &usize| time_s[*row] - time_s[*row - 1] > gap_s;
                (1..time_s.len()).filter(gap).map(|row| Hole { row, missing: 0 }).collect()
            }
        };

        let mut next = holes.iter().map(|hole| hole.row).peekable();
        let (mut count, mut sum, mut square) = (0usize, 0.0, 0.0);
        let (mut shortest, mut longest) = (f64::INFINITY, 0.0f64);
        for (row, pair) in time_s.windows(2).enumerate() {
            if next.next_if_eq(&(row + 1)).is_none() {
                let step = pair[1] - pair[0];
                count += 1;
                sum += step - median;
                square += (step - median).powi(2);
                (shortest, longest) = (shortest.min(step), longest.max(step));
            }
        }
        let mean = sum / count.max(1) as f64;
        let period_s = if count > 0 { median + mean } else { 0.0 };
        let jitter_max_s = if count > 0 { (period_s - shortest).max(longest - period_s).max(0.0) } else { 0.0 };
        let sampling = Self {
            start_s: first,
            duration_s: last - first,
            period_s,
            jitter_s: (square / count.max(1) as f64 - mean * mean).max(0.0).sqrt(),
            jitter_max_s,
            gap_s,
            gaps: holes.len(),
            regular: jitter_max_s <= 0.05 * period_s + resolution(time_s).min(0.25 * period_s),
        };
        (sampling, holes)
    }

    const fn none(start_s: f64) -> Self {
        Self {
            start_s,
            duration_s: 0.0,
            period_s: 0.0,
            jitter_s: 0.0,
            jitter_max_s: 0.0,
            gap_s: f64::INFINITY,
            gaps: 0,
            regular: false,
        }
    }
}

/// An even grid about which stamps scatter, each for itself.
struct Grid {
    period_s: f64,
    /// As many stamps as tell a lost row from their scatter; more would take another hole among them for this one.
    stamps: usize,
}

impl Grid {
    /// The grid of times whose steps have this median deviation from their own median, where there is one. Over more rows the
    /// spans between stamps on a grid scatter as single steps do; steps that are each another length add up.
    fn of(time_s: &[f64], scatter_s: f64) -> Option<Self> {
        let hop = (time_s.len() / ENOUGH).max(1);
        let mut spans: Vec<f64> = time_s.windows(STAMPS + 1).step_by(hop).map(|t| t[STAMPS] - t[0]).collect();
        let middle = spans.len() / 2;
        if spans.len() < STAMPS {
            return None;
        }
        let span = *spans.select_nth_unstable_by(middle, f64::total_cmp).1;
        spans.iter_mut().for_each(|s| *s = (*s - span).abs());
        let spread = *spans.select_nth_unstable_by(middle, f64::total_cmp).1;
        let period_s = span / STAMPS as f64;
        // Between 1 and the root of the number of rows, in the geometric mean; what clocks are rounded to is no scatter.
        let even = spread <= (STAMPS as f64).powf(0.25) * scatter_s.max(1e-3 * period_s);
        // Half a period must be sure by the median of as many stamps after a row and the mean of those before it.
        let scatter = 1.4826 / 2f64.sqrt() * scatter_s.max(spread) / period_s;
        let of_means = |stamps: f64| ((1.0 + 0.5 * std::f64::consts::PI) / stamps).sqrt() * scatter;
        let stamps = (SURELY * of_means(1.0) / WHOLE).powi(2).ceil().clamp(1.0, STAMPS as f64) as usize;
        (even && SURELY * of_means(STAMPS as f64) < 0.5).then_some(Self { period_s, stamps })
    }

    /// Where rows are missing, and how many.
    fn holes(&self, time_s: &[f64], gap_s: f64) -> Vec<Hole> {
        let mut holes = Vec::new();
        let mut start = 0;
        for row in 1..time_s.len() {
            let step = time_s[row] - time_s[row - 1];
            if step <= SUSPECT * self.period_s {
                continue;
            }
            let late = self.late(time_s, start, row);
            let missing = late.round();
            if step > gap_s || missing >= 1.0 {
                let whole = missing >= 1.0 && (late - missing).abs() < WHOLE;
                holes.push(Hole { row, missing: if whole { missing as usize } else { 0 } });
                start = row;
            }
        }
        holes
    }

    /// By how many periods the stamps from a row on come later than those since `start` foretell.
    fn late(&self, time_s: &[f64], start: usize, row: usize) -> f64 {
        let place = |i: usize| (time_s[i] - time_s[row - 1]) / self.period_s - (i as f64 - (row - 1) as f64);
        let before = start.max(row.saturating_sub(self.stamps))..row;
        let foretold = before.clone().map(place).sum::<f64>() / before.len() as f64;
        let mut after: Vec<f64> = (row..(row + self.stamps).min(time_s.len())).map(place).collect();
        after.sort_unstable_by(f64::total_cmp);
        // The row itself must have come late as well: it is the first one after the hole.
        let middle = 0.5 * (after[(after.len() - 1) / 2] + after[after.len() / 2]);
        if place(row) - foretold > 0.5 { middle - foretold } else { 0.0 }
    }
}

/// The decimal step the times are printed on, s: the coarsest power of ten that all of a sample of them are multiples of.
fn resolution(time_s: &[f64]) -> f64 {
    let stride = (time_s.len() / 1000).max(1);
    (0..9)
        .map(|digits| 10f64.powi(-digits))
        .find(|step| {
            time_s.iter().step_by(stride).all(|t| {
                let ticks = t / step;
                (ticks - ticks.round()).abs() <= 1e-3
            })
        })
        .unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_regular_recording_on_a_decimal_grid_is_regular() {
        let time: Vec<f64> = (0..5000).map(|i| (f64::from(i) / 1024.0 * 1e4).round() / 1e4).collect();
        let sampling = Sampling::of(&time).0;
        assert!(sampling.regular && sampling.gaps == 0, "{sampling:?}");
        assert!((sampling.period_s - 1.0 / 1024.0).abs() < 1e-7, "{sampling:?}");
    }

    #[test]
    fn a_lost_row_is_a_gap_and_does_not_bend_the_period() {
        let time: Vec<f64> = (0..1000).filter(|i| *i != 400).map(|i| f64::from(i) * 0.001).collect();
        let sampling = Sampling::of(&time).0;
        assert_eq!(sampling.gaps, 1);
        assert!((sampling.period_s - 0.001).abs() < 1e-12 && sampling.regular);
    }

    /// Evenly taken rows whose stamps scatter, some of them lost.
    fn scattered(share: f64, lost: &[usize]) -> Vec<f64> {
        let noise = |i: usize| -> f64 {
            (0..6)
                .map(|k| ((i * 6 + k) as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15).wrapping_shr(11) as f64)
                .map(|r| r / (1u64 << 53) as f64 - 0.5)
                .sum::<f64>()
                / 0.5f64.sqrt()
        };
        (0..20_000)
            .filter(|i| !lost.contains(i))
            .map(|i| 1e-3 * (i as f64 + share * noise(i).clamp(-3.4, 3.4)))
            .collect()
    }

    #[test]
    fn a_row_that_is_lost_while_stamps_scatter_is_found() {
        let lost = [70, 1500, 1501, 4000, 4020, 9000, 15_000];
        for share in [0.0, 0.02, 0.1, 0.13] {
            let (sampling, holes) = Sampling::of(&scattered(share, &lost));
            let found: Vec<(usize, usize)> = holes.iter().map(|hole| (hole.row, hole.missing)).collect();
            assert_eq!(found, [(70, 1), (1499, 2), (3997, 1), (4016, 1), (8995, 1), (14_994, 1)], "{share}");
            assert!((sampling.period_s / 1e-3 - 1.0).abs() < 1e-4, "{sampling:?}");
            assert!(Sampling::of(&scattered(share, &[])).1.is_empty());
        }
    }

    #[test]
    fn rows_lost_close_together_are_each_in_their_place() {
        let lost = [3000, 3002, 3003, 5000, 5005, 5007];
        for share in [0.0, 0.01] {
            let (_, holes) = Sampling::of(&scattered(share, &lost));
            let found: Vec<(usize, usize)> = holes.iter().map(|hole| (hole.row, hole.missing)).collect();
            assert_eq!(found, [(3000, 1), (3001, 2), (4997, 1), (5001, 1), (5002, 1)], "{share}");
        }
    }

    #[test]
    fn steps_that_are_each_another_length_lose_no_row() {
        let mut t = 0.0;
        let stamps = scattered(0.13, &[]);
        let time: Vec<f64> = (0..20_000)
            .map(|i| {
                t += 1e-3 + (stamps[i] - 1e-3 * i as f64);
                t
            })
            .collect();
        assert_eq!(Sampling::of(&time).1, []);
    }

    #[test]
    fn jitter_is_measured_not_called_a_gap() {
        // Steps alternate 0.8 and 1.2 ms.
        let mut t = 0.0;
        let time: Vec<f64> = (0..1000)
            .map(|i| {
                t += if i % 2 == 0 { 0.0008 } else { 0.0012 };
                t
            })
            .collect();
        let sampling = Sampling::of(&time).0;
        assert!(!sampling.regular && sampling.gaps == 0, "{sampling:?}");
        assert!((sampling.jitter_s - 0.0002).abs() < 1e-6, "{sampling:?}");
    }
}
