//! Where an axis rests, which way it slides, and which rows of a recording can be judged.

use super::frame::Columns;
use crate::analysis::motion::{from_turn_to_turn, turning_points};
use crate::plant::noise::Noise;
use std::ops::Range;

/// Most rows on which causes are compared; more cost time and gain nothing.
const MOST_KEPT: usize = 12_000;
/// Of how many and more one is taken unevenly.
const UNEVEN: usize = 3;
/// How far an axis goes back after a turn that the encoder shows, over the least way that it tells for sure.
const TURN: f64 = 3.0;

/// The way of an axis from turn to turn, load units: what the encoder wavers by is none.
pub fn way_of(columns: &Columns, resolution: f64) -> Vec<f64> {
    let mut way = columns.position.clone();
    for s in &columns.stretches {
        way[s.clone()].copy_from_slice(&from_turn_to_turn(&columns.position[s.clone()], TURN * resolution));
    }
    way
}

/// Rows at which the axis rests as far as the encoder can tell: no step for some rows, and no travel around them.
pub fn resting_rows(columns: &Columns, resolution: f64) -> Vec<bool> {
    let x = &columns.position;
    let mut resting = vec![false; x.len()];
    for s in &columns.stretches {
        let mut run = s.start;
        for i in s.start..s.end {
            let (a, b) = (i.saturating_sub(1).max(s.start), (i + 1).min(s.end - 1));
            let still = (x[b] - x[a]).abs() < 1.5 * resolution;
            let ends = !still || i + 1 == s.end;
            if ends {
                let end = if still { i + 1 } else { i };
                if end >= run + 3 {
                    // A slow way there and back ends where it began.
                    let stays = extent(&x[run..end]) < 3.0 * resolution;
                    for r in run..end {
                        let around = &x[r.saturating_sub(6).max(s.start)..(r + 7).min(s.end)];
                        resting[r] = stays || extent(around) < 3.0 * resolution;
                    }
                }
                run = i + 1;
            }
        }
    }
    resting
}

/// How far positions are apart.
fn extent(positions: &[f64]) -> f64 {
    let (low, high) = positions.iter().fold((f64::MAX, f64::MIN), |(low, high), x| (low.min(*x), high.max(*x)));
    high - low
}

/// Mean sign of the speed over each row. Through a fast reversal the crossing is found between rows from speed and
/// acceleration; in slow motion the direction is that of the last resolved step.
pub fn direction_of(columns: &Columns, v: &[f64], a: &[f64], resolution: f64) -> Vec<f64> {
    let (x, h) = (&columns.position, columns.period_s);
    let mut out = vec![0.0; x.len()];
    for s in &columns.stretches {
        for i in s.clone() {
            let (before, after) = (i.saturating_sub(1).max(s.start), (i + 1).min(s.end - 1));
            let step = x[after] - x[before];
            let half = (0.5 * h * a[i].abs()).max(0.1 * resolution / h);
            let smooth = (v[i] / half).clamp(-1.0, 1.0);
            // A step that the grid cannot fake decides; the smoothed speed only places the crossing.
            out[i] = if step.abs() > 2.5 * resolution && smooth * step < 0.0 { step.signum() } else { smooth };
        }
    }
    out
}

/// How far the direction of friction is open at each row, 0 to 1: at rest, and at a turn as long as the encoder shows no way
/// back, since the axis may stick there for a moment.
pub fn doubtful_rows(columns: &Columns, resting: Vec<bool>, resolution: f64) -> Vec<f64> {
    let x = &columns.position;
    let mut doubt: Vec<f64> = resting.into_iter().map(|r| f64::from(u8::from(r))).collect();
    for s in &columns.stretches {
        for turn in turning_points(&x[s.clone()], TURN * resolution) {
            let turn = s.start + turn;
            let near = |i: usize| (x[i] - x[turn]).abs() < 2.5 * resolution;
            let mut first = turn.saturating_sub(1).max(s.start);
            while first > s.start && near(first - 1) {
                first -= 1;
            }
            let mut last = (turn + 1).min(s.end - 1);
            while last + 1 < s.end && near(last + 1) {
                last += 1;
            }
            doubt[first..=last].fill(1.0);
        }
    }
    doubt
}

/// Share of the stroke that an axis travels before it has forgotten where it stood: which flank the table touched, if any, and which
/// way friction was wound up when a stretch began, nobody knows.
const FORGOTTEN: f64 = 1e-3;
/// And time, s, until flanks that met on the way have come to rest.
const SETTLED_S: f64 = 0.01;

/// The first row of a stretch that depends on nothing before it.
fn first_known(columns: &Columns, stretch: &Range<usize>, stroke: f64) -> usize {
    let x = &columns.position;
    let away = stretch.clone().find(|&i| (x[i] - x[stretch.start]).abs() > FORGOTTEN * stroke).unwrap_or(stretch.end);
    away + (SETTLED_S / columns.period_s).ceil() as usize
}

/// Rows within so many of one that is not as recorded.
pub fn beside_filled(columns: &Columns, margin: usize) -> Vec<bool> {
    let mut beside = vec![false; columns.known.len()];
    for row in (0..columns.known.len()).filter(|row| !columns.known[*row]) {
        let end = (row + margin + 1).min(beside.len());
        beside[row.saturating_sub(margin)..end].fill(true);
    }
    beside
}

/// Rows that are judged.
#[derive(Debug, Clone)]
pub struct Judged {
    /// Which.
    pub rows: Vec<usize>,
    /// From one to the next where all between them carry weight: in the mean, and at most.
    pub apart: [usize; 2],
}

/// Rows away from the ends of their stretch, thinned to the filter's own density, that carry weight. Of a long recording one of several
/// such, each anywhere among them: a wave that is faster than the rows come is no slower one in uneven rows (Shapiro and Silverman 1960).
pub fn judged_rows(columns: &Columns, margin: usize, stride: usize, carries: impl Fn(usize) -> bool) -> Judged {
    let mut kept = Vec::new();
    let stroke = extent(&columns.position);
    for s in &columns.stretches {
        if s.len() > 4 * margin {
            let begin = first_known(columns, s, stroke);
            kept.extend((begin + margin..s.end - margin).step_by(stride).filter(|&row| carries(row)));
        }
    }
    let thin = kept.len().div_ceil(MOST_KEPT).max(1);
    if thin < UNEVEN {
        return Judged { rows: kept.into_iter().step_by(thin).collect(), apart: [thin * stride; 2] };
    }
    let mut any = Noise::new(0);
    let one = |several: &[usize]| several[(any.uniform() * several.len() as f64) as usize];
    Judged { rows: kept.chunks(thin).map(one).collect(), apart: [thin * stride, (2 * thin - 1) * stride] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_of_a_long_recording_are_one_of_several_and_show_fast_waves() {
        let rows = 200_000;
        let columns = Columns::every_millisecond((0..rows).map(|row| row as f64).collect(), vec![0.0; rows]);
        let Judged { rows: kept, apart } = judged_rows(&columns, 10, 2, |_| true);
        let gaps: Vec<usize> = kept.windows(2).map(|w| w[1] - w[0]).collect();
        assert!(kept.len() <= MOST_KEPT && apart == [18, 34], "{} {apart:?}", kept.len());
        assert!(gaps.iter().all(|gap| *gap <= apart[1] && gap % 2 == 0) && gaps.contains(&2));
        // A wave of 3.1 rows: one row in eighteen would take it for one of 93 rows, or see none of it at all.
        let mean = |period: f64| {
            let turns = kept.iter().map(|row| std::f64::consts::TAU * *row as f64 / period);
            let (sum, count) = turns.fold((0.0, 0.0), |(sum, count), turn| (sum + turn.cos(), count + 1.0));
            f64::abs(sum) / count
        };
        for period in [5.1, 18.0, 33.0, 92.6] {
            assert!(mean(period) < 0.04, "{period}: {}", mean(period));
        }
    }
}
