//! A disturbance in a narrow band of frequencies: a pump, a fan, a floor never beat as evenly as a sine. Amplitude and phase
//! wander over some seconds, so that one line explains but part of it; lines whose size goes along straight pieces of time explain
//! all. What is left beside them is judged as if they were not there.

use super::causes::Trace;
use super::causes::periods::{strongest_band, there_alike};
use super::fit::{Bench, Fit};
use super::judge::{Excess, LITTLE_LEFT, rms};
use super::select::{LEAST_GAIN, NUMBER_PRICE};
use super::show::{self, Coordinate};
use super::uncertainty::widening;
use super::verdict::Verdict;
use crate::machine::Effect;
use std::f64::consts::{PI, TAU};

/// Pieces of time that the size of a line may be laid out over.
const PIECES: [usize; 4] = [4, 8, 16, 32];
/// Periods in the shortest piece: what wanders faster has no frequency.
const LEAST_PERIODS: f64 = 8.0;
/// How much more of the squares a band must hold than bands of that width beside it. Of noise, of whatever colour, as many numbers
/// explain hardly more here than there: five times as much once in a billion, the strongest of all bands at most.
const STANDS_OUT: f64 = 10.0;
/// Share of its variance with which what a band holds may go with where or how fast the axis moves: it gives way to a vibration,
/// and while it creeps its speed goes with that.
const TIED: f64 = 0.25;
/// Share of the excess that may be left beside a vibration alone.
const MOST_LEFT: f64 = 0.2;
/// Share of the squares that a band holds which causes found without it must leave of it. Where the spring of a swinging table was among
/// them, less than a thousandth was left of the swing.
const LEAST_LEFT: f64 = 0.1;
/// Groups of speed and of position in each of which it must be there.
const GROUPS: usize = 4;

/// A band and what it takes to leave it free in every fit.
pub struct Band {
    /// The vibration in the middle of the band.
    pub effect: Effect,
    /// Standard deviation of each of its parameters.
    pub deviations: Vec<f64>,
    /// Stacked columns.
    pub columns: Vec<Vec<f64>>,
    /// What is left without it, and beside nothing else with it.
    pub before: Fit,
    pub after: Fit,
}

impl Band {
    /// Whether causes that were found without this vibration leave it, by the root mean square of what they leave and of what those found
    /// beside it do: what they take off as well is none.
    #[must_use]
    pub fn is_left_by_others(&self, bench: &Bench, without_it: f64, beside_it: f64) -> bool {
        let [before, after] = [&self.before, &self.after].map(|fit| rms(&bench.rest(fit)[0]).powi(2));
        without_it.powi(2) - beside_it.powi(2) > LEAST_LEFT * (before - after)
    }

    /// What is to be said of this vibration and what was found beside it, by what is said of the latter alone.
    #[must_use]
    pub fn beside(&self, bench: &Bench, verdict: Verdict, found: &Fit) -> Verdict {
        let [before, left] = [&self.before, found].map(|fit| Excess::of(bench, fit, found).of_channel(0));
        match verdict {
            Verdict::NoDiscrepancy if left > LITTLE_LEFT && left > MOST_LEFT * before => Verdict::UnknownCause,
            Verdict::NoDiscrepancy | Verdict::Explained if left <= LITTLE_LEFT => Verdict::Explained,
            Verdict::NoDiscrepancy => Verdict::PartlyExplained,
            other => other,
        }
    }
}

/// Lines of one frequency whose size goes along straight pieces of time.
struct Lines {
    hz: f64,
    columns: Vec<Vec<f64>>,
    fit: Fit,
}

impl Lines {
    fn new(bench: &Bench, hz: f64, pieces: usize) -> Self {
        let frame = bench.frame;
        let wave = |turn: f64| -> Vec<f64> {
            let at = |row: usize| (TAU * (hz * frame.seconds(row) + turn)).sin();
            frame.judged_instants(&(0..frame.x.len()).map(at).collect::<Vec<_>>())
        };
        let waves = [wave(0.0), wave(0.25)];
        let seconds = frame.seconds(frame.x.len() - 1);
        let place = |row: usize| frame.seconds(row) / seconds * pieces as f64;
        let size =
            |knot: usize, row: usize| if pieces == 0 { 1.0 } else { (1.0 - (place(row) - knot as f64).abs()).max(0.0) };
        let column = |(knot, wave): (usize, &Vec<f64>)| {
            let rows = frame.kept.iter().zip(wave);
            bench.stack(&Trace::torque(rows.map(|(&row, wave)| size(knot, row) * wave).collect()))
        };
        let columns: Vec<Vec<f64>> =
            (0..=pieces).flat_map(|knot| waves.iter().map(move |wave| (knot, wave))).map(column).collect();
        let fit = bench.beside_lines(&columns).fit(Vec::new());
        Self { hz, columns, fit }
    }

    fn price(&self) -> f64 {
        self.fit.figure() + NUMBER_PRICE * self.columns.len() as f64
    }
}

/// The band that holds most of what the belief leaves, where one does that stands out of its neighbourhood, is there whatever the
/// axis does, and is more than a line.
#[must_use]
pub fn band(bench: &Bench) -> Option<Band> {
    let (frame, before) = (bench.frame, bench.fit(Vec::new()));
    let [rest, _] = bench.rest(&before);
    let seconds = frame.seconds(frame.x.len() - 1);
    let hz = strongest_band(frame, &rest, PIECES[1] as f64)?;
    let slow = |pieces: &usize| hz * seconds / *pieces as f64 >= LEAST_PERIODS;
    let of = |hz: f64| {
        let tried = PIECES.into_iter().filter(slow).map(|pieces| (pieces, Lines::new(bench, hz, pieces)));
        tried.min_by(|a, b| a.1.price().total_cmp(&b.1.price()))
    };
    let (pieces, wide) = of(hz)?;
    let span = seconds / pieces as f64;
    let lines = Lines::new(bench, hz + spread(bench, &wide, span).0, pieces);
    if lines.price() > Lines::new(bench, lines.hz, 0).price() - LEAST_GAIN {
        return None;
    }
    let explained = |lines: &Lines| before.squares() - lines.fit.squares();
    let beside = [-5.0, -3.0, 3.0, 5.0]
        .map(|widths| lines.hz + widths / span)
        .into_iter()
        .filter(|hz| *hz * span >= LEAST_PERIODS);
    let beside: Vec<f64> = beside.map(|hz| explained(&Lines::new(bench, hz, pieces))).collect();
    let mean = beside.iter().sum::<f64>() / beside.len().max(1) as f64;
    if beside.is_empty() || explained(&lines) < STANDS_OUT * mean || is_tied(bench, &before, &lines.fit) {
        return None;
    }
    let (off, width, amplitude) = spread(bench, &lines, span);
    // So many independent stretches of a band that wide.
    let stretches = (2.0 * PI.sqrt() * width * seconds).max(2.0);
    let effect = Effect::ExternalVibration { frequency_hz: lines.hz + off, amplitude };
    let deviations = vec![widening(stretches) * width / stretches.sqrt(), 0.5 * amplitude / stretches.sqrt()];
    Some(Band { effect, deviations, columns: lines.columns, before, after: lines.fit })
}

/// How far the middle of a band is from its frequency, Hz, how wide it is, and its amplitude, by how its size turns from knot to knot.
fn spread(bench: &Bench, lines: &Lines, span: f64) -> (f64, f64, f64) {
    let sizes = bench.sizes_of(&lines.columns);
    let knots: Vec<(f64, f64)> = sizes.chunks_exact(2).map(|pair| (pair[0], pair[1])).collect();
    let square = knots.iter().map(|(s, c)| s * s + c * c).sum::<f64>() / knots.len() as f64;
    // s·sin + c·cos goes ahead by the angle that turns (s, c) backward.
    let pairs = || knots.windows(2).map(|pair| (pair[0], pair[1]));
    let (along, across) =
        pairs().fold((0.0, 0.0), |(along, across), ((s, c), (t, d))| (along + s * t + c * d, across + s * d - c * t));
    let off = across.atan2(along) / (TAU * span);
    let turn = TAU * off * span;
    let step = |((s, c), (t, d)): ((f64, f64), (f64, f64))| {
        let (s, c) = (s * turn.cos() - c * turn.sin(), s * turn.sin() + c * turn.cos());
        (t - s).powi(2) + (d - c).powi(2)
    };
    let steps = pairs().map(step).sum::<f64>() / (knots.len() - 1) as f64;
    (off, (steps / square.max(1e-300)).sqrt() / (TAU * span), square.sqrt())
}

/// Whether what a band holds goes with where or how fast the axis moves, or is not there at some speeds or places.
fn is_tied(bench: &Bench, before: &Fit, after: &Fit) -> bool {
    let rows = 0..bench.rows;
    let held: Vec<f64> =
        before.residual[rows.clone()].iter().zip(&after.residual[rows.clone()]).map(|(b, a)| b - a).collect();
    let goes = |coordinate: Coordinate| show::share_of(bench.frame, &held, coordinate, held.len() as f64) > TIED;
    let frame = bench.frame;
    let speed = |row: usize| frame.v[row].abs();
    let place = |row: usize| frame.x[row];
    let left = &after.residual[rows];
    [Coordinate::Velocity, Coordinate::Direction, Coordinate::Position, Coordinate::SinceReversal].into_iter().any(goes)
        || !there_alike(frame, speed, GROUPS, &held, left)
        || !there_alike(frame, place, GROUPS, &held, left)
}
