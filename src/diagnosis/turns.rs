//! Where what lies between motor and table shows: about the turns. Where it is looked for from afar, on sums, the way between them
//! and more turns than enough need not be simulated.

use super::frame::Frame;
use super::rows;
use std::ops::Range;

/// Most turns that are looked at.
const MOST: usize = 24;
/// What is looked at before a turn, where the table still goes along, and after it, until a slow motor has crossed a clearance and a
/// table has swung, s.
const BEFORE_S: f64 = 0.3;
const AFTER_S: f64 = 1.0;
/// Share of the stroke that lies between turns of which there are enough: an axis that hunts where it stands, or that something shakes, turns
/// more often than it goes anywhere.
const FAR: f64 = 1e-3;
/// The golden ratio less one, of which multiples fall in step with nothing.
const GOLDEN: f64 = 0.618_033_988_749_895;
/// Fewest judged rows about them; where fewer are, all rows are looked at.
const FEWEST_JUDGED: usize = 1000;

/// Stretches about turns that are spread evenly over a recording.
#[derive(Debug)]
pub struct AboutTurns {
    /// Rows, in order, each once.
    pub stretches: Vec<Range<usize>>,
    /// Share of all rows that are about a turn, looked at or not; 1 where there is none.
    pub share: f64,
}

impl AboutTurns {
    /// Of a recording; all of it where it has no turns, or next to nothing is judged about them.
    #[must_use]
    pub fn of(frame: &Frame) -> Self {
        let whole = || Self { stretches: frame.columns.stretches.clone(), share: 1.0 };
        let (low, high) = frame.stroke();
        let far = rows::turns(frame.columns, frame.resolution, FAR * (high - low));
        let turns = if far.len() < MOST { rows::turns(frame.columns, frame.resolution, 0.0) } else { far };
        if turns.is_empty() {
            return whole();
        }
        let all = joined(frame, &turns);
        let share = length(&all) as f64 / length(&frame.columns.stretches).max(1) as f64;
        let stretches = joined(frame, &some(&turns));
        let judged: usize = stretches.iter().map(|stretch| frame.kept_within(stretch).len()).sum();
        if judged < FEWEST_JUDGED { whole() } else { Self { stretches, share } }
    }
}

/// As many of these turns as are looked at, one of every so many: not the same of each, lest they all be those of one end of a way.
fn some(turns: &[Range<usize>]) -> Vec<Range<usize>> {
    if turns.len() <= MOST {
        return turns.to_vec();
    }
    let each = turns.len() as f64 / MOST as f64;
    let at = |i: usize| ((i as f64 + (i as f64 * GOLDEN).fract()) * each) as usize;
    (0..MOST).map(|i| turns[at(i).min(turns.len() - 1)].clone()).collect()
}

/// What is about these turns, within the stretches of a recording.
fn joined(frame: &Frame, turns: &[Range<usize>]) -> Vec<Range<usize>> {
    let rows = |seconds: f64| (seconds / frame.columns.period_s) as usize;
    let mut out: Vec<Range<usize>> = Vec::new();
    for stretch in &frame.columns.stretches {
        let begun = out.len();
        for turn in turns.iter().filter(|turn| stretch.contains(&turn.start)) {
            let from = turn.start.saturating_sub(rows(BEFORE_S)).max(stretch.start);
            let about = from..(turn.end + rows(AFTER_S)).min(stretch.end);
            match out.get_mut(begun..).and_then(|own| own.last_mut()) {
                Some(last) if about.start <= last.end => last.end = about.end.max(last.end),
                _ => out.push(about),
            }
        }
    }
    out
}

fn length(stretches: &[Range<usize>]) -> usize {
    stretches.iter().map(ExactSizeIterator::len).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::frame::Columns;
    use crate::machine::Machine;
    use crate::plant::noise::Noise;

    /// Of an axis that goes along these places, with a gap in the middle.
    fn of(rows: usize, place: impl Fn(usize) -> f64) -> (Columns, AboutTurns) {
        let axis = Machine::parse(include_str!("../../examples/machines/believed.json")).unwrap().axes.remove(0);
        let mut noise = Noise::new(1);
        let torque = (0..rows).map(|_| noise.normal(0.1)).collect();
        let columns = Columns {
            stretches: vec![0..rows / 2, rows / 2..rows],
            ..Columns::every_millisecond((0..rows).map(place).collect(), torque)
        };
        let found = AboutTurns::of(&Frame::new(&axis, &columns, Some(3)));
        (columns, found)
    }

    /// There and back at 20 mm/s, turning each so many rows.
    fn about_turns(rows: usize, each: usize) -> (Columns, AboutTurns) {
        of(rows, |i| 0.02 * (each as f64 - ((i % (2 * each)) as f64 - each as f64).abs()))
    }

    #[test]
    fn what_is_about_few_turns_is_looked_at_whole() {
        let (columns, found) = about_turns(40_000, 3000);
        for turn in (3000..39_000).step_by(3000) {
            let stretch = columns.stretches.iter().find(|s| s.contains(&turn)).unwrap();
            let about = (turn - 250).max(stretch.start)..(turn + 950).min(stretch.end);
            assert!(found.stretches.iter().any(|s| s.start <= about.start && about.end <= s.end), "{turn}: {found:?}");
        }
        assert!(found.stretches.windows(2).all(|pair| pair[0].end <= pair[1].start), "{found:?}");
        assert!((0.4..0.5).contains(&found.share), "{found:?}");
        assert!((length(&found.stretches) as f64 / 40_000.0 - found.share).abs() < 1e-9);
    }

    #[test]
    fn of_many_turns_some_all_over_the_recording_are() {
        let (_, found) = about_turns(200_000, 2000);
        assert!(found.stretches.len() > MOST - 3 && length(&found.stretches) < MOST * 1400, "{found:?}");
        assert!(found.stretches[0].start < 8000 && found.stretches.last().unwrap().end > 190_000, "{found:?}");
        assert!((0.6..0.7).contains(&found.share), "{}", found.share);
    }

    #[test]
    fn turns_at_both_ends_of_a_way_are() {
        let turns: Vec<Range<usize>> = (0..2 * MOST).map(|i| 100 * i..100 * i + 1).collect();
        let at_one_end = some(&turns).iter().filter(|turn| turn.start / 100 % 2 == 0).count();
        assert!((MOST / 3..=2 * MOST / 3).contains(&at_one_end), "{at_one_end} of {MOST}");
    }

    #[test]
    fn turns_of_an_axis_that_hunts_where_it_stands_are_not() {
        // To and fro by 5 µm for two seconds after each way.
        let place = |i: usize| {
            let (way, since) = (i / 3000, i % 3000);
            let gone = 0.02 * since.min(1000) as f64;
            let hunting = if since > 1000 { 0.005 * (since as f64 * 0.06).sin() } else { 0.0 };
            hunting + if way % 2 == 0 { gone } else { 20.0 - gone }
        };
        let (_, found) = of(150_000, place);
        let ends = (1..50).map(|way| 3000 * way);
        let seen = ends.filter(|end| found.stretches.iter().any(|s| s.start < *end && end + 900 < s.end)).count();
        assert!(seen >= MOST - 2, "{seen} of 49: {found:?}");
    }

    #[test]
    fn without_turns_all_rows_are() {
        let (columns, found) = about_turns(9000, 10_000);
        assert_eq!((found.stretches, found.share), (columns.stretches, 1.0));
    }
}
