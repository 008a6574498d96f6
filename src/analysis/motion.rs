//! How an axis moved: turning points of a position.

use super::statistics::{grid, white_noise};

/// Rows at which the motion turns round, each a local extreme: between two of them the position runs at least `threshold`
/// one way. Standing still is no turn; neither are wiggles below `threshold`.
#[must_use]
pub fn turning_points(position: &[f64], threshold: f64) -> Vec<usize> {
    let mut turns = Vec::new();
    let (mut low, mut high) = (0, 0);
    let mut direction = 0.0;
    for (row, &x) in position.iter().enumerate() {
        if x > position[high] {
            high = row;
        }
        if x < position[low] {
            low = row;
        }
        if direction >= 0.0 && position[high] - x > threshold {
            if direction > 0.0 {
                turns.push(high);
            }
            direction = -1.0;
            low = row;
        } else if direction <= 0.0 && x - position[low] > threshold {
            if direction < 0.0 {
                turns.push(low);
            }
            direction = 1.0;
            high = row;
        }
        // While one way is going on, the extreme of the other starts afresh from here.
        if direction > 0.0 {
            low = high;
        } else if direction < 0.0 {
            high = low;
        }
    }
    turns
}

/// The same positions on their way from turn to turn ([`turning_points`]), which goes one way each: what a sensor wavers by is no way
/// there and back.
#[must_use]
pub fn from_turn_to_turn(position: &[f64], threshold: f64) -> Vec<f64> {
    let mut way = position.to_vec();
    let Some(end) = position.len().checked_sub(1) else { return way };
    let turns = turning_points(position, threshold);
    let from = std::iter::once(0).chain(turns.iter().copied());
    let to = turns.iter().copied().chain(std::iter::once(end));
    for (from, to) in from.zip(to) {
        // After the last turn the motion may end short of where it got.
        let up = match turns.as_slice() {
            [.., before, last] if from == *last => position[*last] < position[*before],
            [last] if from == *last => position[*last] < position[0],
            _ => position[to] > position[from],
        };
        for row in from + 1..=to {
            way[row] = if up { way[row].max(way[row - 1]) } else { way[row].min(way[row - 1]) };
        }
    }
    way
}

/// A travel that noise and grid of this position do not make by themselves, in its unit.
#[must_use]
pub fn smallest_travel(position: &[f64]) -> f64 {
    (10.0 * white_noise(position).unwrap_or(0.0)).max(5.0 * grid(position).unwrap_or(0.0))
}

/// What an axis did, in the position's unit.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Motion {
    /// Largest position minus smallest.
    pub stroke: f64,
    /// How often the motion turned round, wiggles below 0.1 % of the stroke left out.
    pub reversals: usize,
    /// Largest speed, per second.
    pub speed_max: f64,
    /// Share of the time in which the axis moved, 0 to 1.
    pub moving_share: f64,
}

impl Motion {
    /// Motion of a whole position column without NaN, with one time a row.
    #[must_use]
    pub fn of(time_s: &[f64], position: &[f64]) -> Self {
        let (low, high) = position.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
        let stroke = (high - low).max(0.0);
        let travel = smallest_travel(position);
        // Ten rows calm the noise of a difference by as much again as they blur a peak of acceleration.
        let span = 10.min(position.len().saturating_sub(1)).max(1);
        let ends = || position.iter().zip(position.iter().skip(span)).zip(time_s.iter().zip(time_s.iter().skip(span)));
        let speeds = ends().map(|((a, b), (t0, t1))| ((b - a) / (t1 - t0)).abs());
        let moving = ends().filter(|((a, b), _)| (*b - *a).abs() > travel).count();
        Self {
            stroke,
            reversals: if stroke > travel { turning_points(position, travel.max(1e-3 * stroke)).len() } else { 0 },
            speed_max: if stroke > travel { speeds.fold(0.0, f64::max) } else { 0.0 },
            moving_share: moving as f64 / ends().count().max(1) as f64,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_of_a_triangle_are_its_corners_whatever_the_noise() {
        let triangle = |i: i32| f64::from((i % 400 - 200).abs());
        for wiggle in [0.0, 0.4] {
            let position: Vec<f64> =
                (0..2000).map(|i| triangle(i) + wiggle * f64::from(i * 7919 % 13 - 6) / 6.0).collect();
            let turns = turning_points(&position, 5.0);
            assert_eq!(turns.len(), 9, "{turns:?}");
            for (k, turn) in turns.iter().enumerate() {
                assert!(turn.abs_diff(200 * (k + 1)) <= 1, "{turns:?}");
            }
        }
    }

    #[test]
    fn a_way_is_that_of_the_motion_whatever_the_noise() {
        let triangle = |i: i32| f64::from((i % 400 - 200).abs().min(150));
        let wiggle = |i: i32| 0.4 * f64::from(i * 7919 % 13 - 6) / 6.0;
        let noisy: Vec<f64> = (0..2000).map(|i| triangle(i) + wiggle(i)).collect();
        let length = |x: &[f64]| x.windows(2).map(|pair| (pair[1] - pair[0]).abs()).sum::<f64>();
        let way = from_turn_to_turn(&noisy, 1.0);
        assert!(way.iter().zip(&noisy).all(|(way, x)| (way - x).abs() < 0.81));
        let (exact, turns) = (1500.0, 9.0);
        assert!((length(&way) - exact).abs() < 0.8 * (turns + 1.0), "{}", length(&way));
        assert!(length(&noisy) > exact + 50.0);
    }

    #[test]
    fn one_way_and_standstill_have_no_turns() {
        let staircase: Vec<f64> = (0..1000).map(|i| f64::from(i / 100)).collect();
        assert_eq!(turning_points(&staircase, 0.5), Vec::<usize>::new());
        assert_eq!(turning_points(&[0.0; 50], 0.1), Vec::<usize>::new());
    }
}
