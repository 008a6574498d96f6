//! How far a replayed loop misses the measured position, block by block.

use super::uncertainty::widening;
use crate::analysis::statistics;
use std::ops::Range;

/// Contiguous blocks of rows. Each counts alike: where an axis that sticks breaks loose a cycle sooner or later one of them holds more
/// error than all others.
pub const BLOCKS: usize = 48;
/// The miss of a block by no more than the encoder itself is off by.
pub const NOTHING: f64 = 0.35;
/// What is hardly missed, over what is missed most.
const HARDLY: f64 = 0.1;
/// A miss that the loop has something to say of: of more than twice what the encoder itself is off by.
const MUCH: f64 = 0.9;
/// And in how many blocks of either half: an axis that sticks may break loose another way in a moment or two.
const FEWEST: usize = 3;
/// Share of the misses beyond what the encoder itself is off by that a cause must explain in rows that gave none of its numbers.
pub const LEAST_EXPLAINED: f64 = 0.4;
/// The half that gives a cause its numbers.
pub const GIVES: Over = Over::Half(0);
/// The half that judges it.
pub const JUDGES: Over = Over::Half(1);

/// Which blocks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Over {
    /// One half, or the other.
    Half(usize),
    /// Both.
    All,
}

impl Over {
    /// Whether a block is one of them.
    #[must_use]
    pub fn has(self, block: usize) -> bool {
        self == Over::All || self == Over::Half(half_of(block))
    }
}

/// The half that a block belongs to, by the sequence of Thue and Morse: blocks that alternate might fall in step with moves
/// that repeat, and each half would lack what the other is judged on.
#[must_use]
pub fn half_of(block: usize) -> usize {
    block.count_ones() as usize % 2
}

/// Misses beyond those that are unavoidable, a block each.
#[must_use]
pub fn avoidable(misses: &[f64], unavoidable: &[f64]) -> Vec<f64> {
    misses.iter().zip(unavoidable).map(|(miss, by)| miss - by.max(NOTHING)).collect()
}

/// Mean over some blocks.
#[must_use]
pub fn mean(of_blocks: &[f64], over: Over) -> f64 {
    let blocks = || of_blocks.iter().enumerate().filter(|(block, _)| over.has(*block)).map(|(_, value)| value);
    blocks().sum::<f64>() / blocks().count().max(1) as f64
}

/// The same over that half of them which is missed most: an axis that rests or goes on evenly is where it is told to be by any machine.
#[must_use]
pub fn mean_of_worse_half(of_blocks: &[f64], over: Over) -> f64 {
    let blocks = of_blocks.iter().enumerate().filter(|(block, _)| over.has(*block));
    let mut missed: Vec<f64> = blocks.map(|(_, value)| *value).collect();
    missed.sort_by(|a, b| b.total_cmp(a));
    missed.truncate(missed.len().div_ceil(2));
    missed.iter().sum::<f64>() / missed.len().max(1) as f64
}

/// Mean over scatter, times √blocks, of the share that is gained of what is missed in each block, over that half of some blocks which was
/// missed most, but for those that were hardly missed beside the worst: an axis that rests gains nothing by any law. By fewer blocks the
/// scatter is known less, and it is less by as much as Student's distribution is wider.
#[must_use]
pub fn strength(gained: &[f64], misses: &[f64], over: Over) -> f64 {
    let mut judging: Vec<usize> = (0..BLOCKS).filter(|block| over.has(*block)).collect();
    judging.sort_by(|a, b| misses[*b].total_cmp(&misses[*a]));
    judging.truncate(judging.len().div_ceil(2));
    let beyond = |block: usize| misses[block] - NOTHING;
    let hardly = HARDLY * judging.first().map_or(0.0, |worst| beyond(*worst));
    judging.retain(|block| beyond(*block) >= hardly);
    let share = |&block: &usize| (gained[block] / beyond(block).max(NOTHING)).clamp(-1.0, 1.0);
    statistics::strength(&judging.iter().map(share).collect::<Vec<_>>()) / widening(judging.len() as f64 - 1.0)
}

/// The rows of each block.
pub fn blocks_of(rows: usize) -> impl Iterator<Item = Range<usize>> {
    (0..BLOCKS).map(move |block| block * rows / BLOCKS..(block + 1) * rows / BLOCKS)
}

/// Mean square of what is a number.
#[must_use]
pub fn mean_square(error: &[f64]) -> f64 {
    error.iter().map(|e| e * e).filter(|square| square.is_finite()).sum::<f64>() / error.len().max(1) as f64
}

/// How far each block of rows is missed: ½·ln(1 + mean square over that of what the encoder itself is off by).
#[must_use]
pub fn misses(error: &[f64], floor: f64) -> Vec<f64> {
    blocks_of(error.len()).map(|rows| miss_of(mean_square(&error[rows]) / floor.powi(2))).collect()
}

/// The miss of a block by its mean square over that of what the encoder itself is off by.
#[must_use]
pub fn miss_of(mean_square: f64) -> f64 {
    0.5 * mean_square.ln_1p()
}

/// Whether the loop has something to say, by how far each block is missed.
#[must_use]
pub fn is_much(misses: &[f64]) -> bool {
    let missed =
        |half: Over| misses.iter().enumerate().filter(|(block, miss)| half.has(*block) && **miss >= MUCH).count();
    missed(GIVES).min(missed(JUDGES)) >= FEWEST
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_loop_that_rests_most_of_the_time_is_asked_and_one_that_misses_in_moments_is_not() {
        let missed =
            |every: usize| (0..BLOCKS).map(|i| if i / 2 % every == 0 { 2.5 } else { NOTHING }).collect::<Vec<_>>();
        assert!(is_much(&missed(8)) && !is_much(&missed(12)) && !is_much(&[NOTHING; BLOCKS]));
    }
}
