//! What is not needed leaves a set of causes: what the others do without, what held-out contiguous blocks do not bear out (the
//! coefficients are fitted without a block and judged on it), and what is too small to be known.

use super::blocks;
use super::fit::{Bench, Fit, Part};
use super::form;
use super::grids;
use super::judge::{Excess, LITTLE_LEFT};
use super::progress::{Stopped, Watch};
use super::select::{LEAST_GAIN, LEAST_STRENGTH, once_only, price};
use super::uncertainty;
use crate::analysis::statistics;

/// Least mean over scatter of the blocks' gains, times √blocks. What only one block shows gives exactly 1 and may count: the
/// others predicted it, or the gain held out would not be there.
const LEAST_T: f64 = 0.9;

/// Share of what a cause explains that one block may hold.
const MOST_IN_A_BLOCK: f64 = 0.125;

/// Least share of the variance that causes explain where a cause acts: a thirtieth in amplitude. No law holds more exactly on a
/// machine.
const LEAST_SHARE: f64 = 0.001;

/// Size over its standard deviation from which on what was found at the best of many periods or places is there: of some 300 that hold
/// nothing the largest is that large once in a hundred times, √(2·ln(300/0.01)).
const LEAST_OF_MANY: f64 = 4.5;

/// Drops causes that the others do without as they are, weakest first: refined, the others would do without them all the more.
///
/// # Errors
/// [`Stopped`] when the watch's caller said so.
pub fn idle_left_out(bench: &Bench, mut fit: Fit, watch: &Watch) -> Result<Fit, Stopped> {
    loop {
        let each: Vec<usize> = (0..fit.parts.len()).collect();
        let without = watch.each(&each, (0.8, 0.8), "leaving out what is not needed", |&i| bench.without(&fit, i))?;
        let weakest = without.into_iter().min_by(|a, b| price(a).total_cmp(&price(b)));
        match weakest.filter(|less| price(less) - price(&fit) < LEAST_GAIN) {
            Some(less) => fit = less,
            None => return Ok(fit),
        }
    }
}

/// Drops causes that the others can do without, and those that held-out blocks do not bear out.
///
/// # Errors
/// [`Stopped`] when the watch's caller said so.
pub fn shrink(bench: &Bench, mut fit: Fit, watch: &Watch) -> Result<Fit, Stopped> {
    fit = bench.refine(fit, 0, 8);
    let all = 0..fit.parts.len();
    fit = form::settled(bench, fit, all, 8);
    while !fit.parts.is_empty() {
        let each: Vec<usize> = (0..fit.parts.len()).collect();
        let mut without = watch.each(&each, (0.8, 0.9), "leaving out what is not needed", |&i| {
            bench.refine(bench.without(&fit, i), 0, 4)
        })?;
        let Some(&weakest) = each.iter().min_by(|a, b| price(&without[**a]).total_cmp(&price(&without[**b]))) else {
            break;
        };
        let needed = price(&without[weakest]) - price(&fit) >= LEAST_GAIN && borne_out(bench, &without[weakest], &fit);
        let dropped = if needed {
            slight(bench, &without, &fit)
                .or_else(|| doubtful(bench, &without, &fit))
                .or_else(|| once_only(bench, &fit))
                .or_else(|| grids::imitated(bench, &without, &fit))
        } else {
            Some(weakest)
        };
        let Some(dropped) = dropped else { break };
        fit = without.swap_remove(dropped);
    }
    Ok(fit)
}

/// The part that is small, where it acts, against what is explained there and believed: it may well leave by being not quite
/// the law that the others follow. Where it acts, since a law errs where it acts itself; a friction that builds up in some µm
/// after each reversal is gone elsewhere, and large where it is.
fn slight(bench: &Bench, without: &[Fit], fit: &Fit) -> Option<usize> {
    // Mean square of what the part explains over that by which all that is explained may be off, each row by the square of the part.
    let share = |less: &Fit| {
        let rows = less.residual.iter().zip(&fit.residual).zip(bench.measured.iter().zip(&bench.doubt));
        let (own, off) = rows.fold((0.0, 0.0), |(own, off), ((less, left), (measured, doubt))| {
            let square = (less - left).powi(2);
            let off_here = LEAST_SHARE * (measured - left).powi(2) + doubt * doubt;
            (own + square * square, off + square * off_here)
        });
        if off > 0.0 { own / off } else { f64::INFINITY }
    };
    let shares: Vec<f64> = without.iter().map(share).collect();
    let weakest = (0..shares.len()).min_by(|&a, &b| shares[a].total_cmp(&shares[b]))?;
    (shares[weakest] < 1.0).then_some(weakest)
}

/// The part of which least is known that it is there at all. What halves the rest of a channel is there, however little is
/// known of its size: a law that is not quite the machine's leaves much, by which its size is uncertain.
fn doubtful(bench: &Bench, without: &[Fit], fit: &Fit) -> Option<usize> {
    // Where much is left a law that is not quite the machine's makes its size uncertain.
    let little_left = Excess::of(bench, fit, fit).largest() <= LITTLE_LEFT;
    let one_of_many = |part: &Part| little_left && part.law.cause.row().repeatable;
    let least = |part: &Part| if one_of_many(part) { LEAST_OF_MANY } else { LEAST_STRENGTH };
    let strengths = uncertainty::strengths(bench, fit);
    let strengths: Vec<f64> = strengths.iter().zip(&fit.parts).map(|(own, part)| own / least(part)).collect();
    let open = (0..strengths.len()).filter(|&i| !fit.halves(&without[i]));
    let weakest = open.min_by(|&a, &b| strengths[a].total_cmp(&strengths[b]))?;
    (strengths[weakest] < 1.0).then_some(weakest)
}

/// Whether held-out blocks bear out what `full` gains over `less`.
fn borne_out(bench: &Bench, less: &Fit, full: &Fit) -> bool {
    let gained: Vec<f64> = less.residual.iter().zip(&full.residual).map(|(less, full)| less - full).collect();
    // Nor may a block hold most of a cause that both have, as one rapid does in which the motor saturates: without it that cause is anything,
    // and what the sets leave there says nothing of what one of them has more.
    let traces: Vec<&[f64]> = less.basis().iter().chain([&gained]).map(Vec::as_slice).collect();
    let blocks = blocks::within(bench, &traces, MOST_IN_A_BLOCK);
    let (a, b) = (blocks::held_out(bench, less, &blocks), blocks::held_out(bench, full, &blocks));
    let gains: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a - b).collect();
    let mean = gains.iter().sum::<f64>() / gains.len() as f64;
    let in_sample = (less.squares() - full.squares()) / gains.len() as f64;
    mean > 0.5 * in_sample && statistics::strength(&gains) > LEAST_T
}
