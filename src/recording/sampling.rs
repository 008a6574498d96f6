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

impl Sampling {
    /// Estimates the sampling of strictly increasing times; all zero for fewer than two.
    #[must_use]
    pub fn of(time_s: &[f64]) -> Self {
        let (Some(&first), Some(&last)) = (time_s.first(), time_s.last()) else { return Self::none(0.0) };
        if time_s.len() < 2 {
            return Self::none(first);
        }
        let mut steps: Vec<f64> = time_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let middle = steps.len() / 2;
        let median = *steps.select_nth_unstable_by(middle, f64::total_cmp).1;
        let mut deviations: Vec<f64> = steps.iter().map(|step| (step - median).abs()).collect();
        let scatter = *deviations.select_nth_unstable_by(middle, f64::total_cmp).1;
        // Half a period missing is the least a lost row can leave in a regular recording; ten times the scatter keeps
        // honest irregular sampling (its steps spread about as widely as their median) from being called gaps.
        let mut gap_s = (1.5 * median).max(median + 10.0 * scatter);
        // What happens every few rows is the sampling itself, not a loss.
        if steps.iter().filter(|step| **step > gap_s).count() > steps.len() / 50 {
            gap_s = 5.0 * (last - first) / steps.len() as f64;
        }

        let whole = || steps.iter().copied().filter(|step| *step <= gap_s);
        let count = whole().count().max(1);
        let period_s = whole().sum::<f64>() / count as f64;
        let jitter_s = (whole().map(|step| (step - period_s).powi(2)).sum::<f64>() / count as f64).sqrt();
        let jitter_max_s = whole().map(|step| (step - period_s).abs()).fold(0.0, f64::max);
        Self {
            start_s: first,
            duration_s: last - first,
            period_s,
            jitter_s,
            jitter_max_s,
            gap_s,
            gaps: steps.len() - whole().count(),
            regular: jitter_max_s <= 0.05 * period_s + resolution(time_s).min(0.25 * period_s),
        }
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
        let sampling = Sampling::of(&time);
        assert!(sampling.regular && sampling.gaps == 0, "{sampling:?}");
        assert!((sampling.period_s - 1.0 / 1024.0).abs() < 1e-7, "{sampling:?}");
    }

    #[test]
    fn a_lost_row_is_a_gap_and_does_not_bend_the_period() {
        let time: Vec<f64> = (0..1000).filter(|i| *i != 400).map(|i| f64::from(i) * 0.001).collect();
        let sampling = Sampling::of(&time);
        assert_eq!(sampling.gaps, 1);
        assert!((sampling.period_s - 0.001).abs() < 1e-12 && sampling.regular);
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
        let sampling = Sampling::of(&time);
        assert!(!sampling.regular && sampling.gaps == 0, "{sampling:?}");
        assert!((sampling.jitter_s - 0.0002).abs() < 1e-6, "{sampling:?}");
    }
}
