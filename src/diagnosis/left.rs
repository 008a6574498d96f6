//! What an answer leaves of each channel, and where that lives.

use super::fit::{Bench, Fit};
use super::judge::{Excess, rms};
use super::show::{self, View};

/// What is left of a channel.
#[derive(Debug, Clone, PartialEq)]
pub struct Left {
    /// RMS of the filtered residual.
    pub rms: f64,
    /// Its noise floor.
    pub noise_rms: f64,
    /// Where it lives, in words.
    pub describes: String,
}

/// What is left.
#[derive(Debug, Clone, PartialEq)]
pub struct Unexplained {
    /// Of the torque, drive's own unit.
    pub torque: Left,
    /// Of table − encoder, load units, where a table was recorded.
    pub table: Option<Left>,
}

/// What a fit leaves of each channel; `shown` is where that of the torque lives. A scale that repeats the encoder leaves nothing.
#[must_use]
pub fn unexplained(bench: &Bench, fit: &Fit, shown: &[View], with_scale: bool) -> Unexplained {
    let [torque, mut table] = bench.rest(fit);
    if with_scale {
        table.resize(torque.len(), 0.0);
    }
    let excess = Excess::of(bench, fit, fit);
    // Of nothing there is no noise.
    let coarse = rms(&bench.frame.coarse_torque());
    let noise = |rest: &[f64], torque| match (rms(rest) > 0.0, bench.frame.floor(rest, torque)) {
        (true, seen) if torque => seen.hypot(coarse).min(seen.max(rms(rest))),
        (true, seen) => seen,
        (false, _) => 0.0,
    };
    let above_noise = |rest: &[f64], torque| (rms(rest) / noise(rest, torque)).powi(2) - 1.0;
    let left = |rest: &[f64], channel: usize, views: &[View]| Left {
        rms: rms(rest),
        noise_rms: noise(rest, channel == 0),
        describes: show::describe(views, above_noise(rest, channel == 0), excess.of_channel(channel)),
    };
    let of_table = || left(&table, 1, &show::against_all(bench.frame, &table, &table));
    Unexplained { torque: left(&torque, 0, shown), table: (!table.is_empty()).then(of_table) }
}
