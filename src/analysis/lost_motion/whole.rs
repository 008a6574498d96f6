//! Whole sweeps of an effort: from where the axis slides one way to where it slides the other.
//!
//! A motor that runs through a clearance rebounds from its far side; a servo hunts where friction changes its sign; a
//! measurement goes a few µm back and forth while the table sticks. Such a way back turns the motor round, but not the friction
//! of the table: the effort does not come near the level of sliding that way, and the sweep goes on.
//!
//! The rows of the ways back are left out: there the motor's own friction acts the other way. Before the axis has slid each way on
//! counts, since a blow on the far side swings about the curve of effort over travel; after it has slid a way on counts from
//! where the motor turned, where spring and friction hold again what they held (return-point memory).

use std::ops::Range;

use super::Refusal;
use super::sweeps::{Sample, Sweep, Track};
use crate::analysis::statistics::{Mean, correlated_mean, quantile};

/// Standard errors beyond which chance does not change an effort.
pub(super) const SIGMAS: f64 = 5.0;
/// The fewest rows that show a level of effort.
pub(super) const FEWEST_ROWS: usize = 20;
/// Share of the change of effort at a reversal within which an axis slides as it usually does: less than from the sliding level
/// to that of a motor that rubs alone, with 55 % of the friction.
const LIKE: f64 = 0.2;
/// Share of the way from which on an axis slides.
const LATE: f64 = 0.667;

/// The effort of sliding in the negative and the positive direction, as the longest ways of a recording show it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Usual([f64; 2]);

impl Usual {
    /// Over the longest ways of these tracks.
    ///
    /// # Errors
    /// The axis goes one way only, is never steady, or its effort is not that of friction.
    pub fn of<'a>(tracks: impl Iterator<Item = &'a Track>) -> Result<Usual, Refusal> {
        let with = |track: &'a Track| track.long_sweeps().into_iter().map(move |sweep| (track, sweep));
        let sweeps: Vec<(&Track, Sweep)> = tracks.flat_map(with).collect();
        let found = |direction: f64| {
            let sweeps = || sweeps.iter().filter(|(_, sweep)| sweep.direction == direction);
            let longest = sweeps().map(|(_, sweep)| sweep.way()).fold(0.0, f64::max);
            let long = sweeps().filter(|(_, sweep)| sweep.way() > 0.5 * longest);
            let mut levels: Vec<Mean> =
                long.filter_map(|(track, sweep)| level(track, &ahead(track, sweep), &sweep.moving)).collect();
            levels.sort_by(|a, b| a.value.total_cmp(&b.value));
            let not_steady = Refusal::NotSteady { direction: if direction > 0.0 { "positive" } else { "negative" } };
            let none = || if sweeps().next().is_none() { Refusal::NoReversal } else { not_steady };
            levels.get(levels.len() / 2).copied().ok_or_else(none)
        };
        let (negative, positive) = (found(-1.0)?, found(1.0)?);
        let (change, noise) = (positive.value - negative.value, SIGMAS * positive.error.hypot(negative.error));
        let levels = [negative.value, positive.value];
        match change {
            // From rest to rest friction takes work, whatever masses are moved between.
            _ if change < -noise && sweeps.iter().map(|(track, sweep)| work(track, sweep)).sum::<f64>() > 0.0 => {
                Err(Refusal::Braking(levels))
            }
            _ if change < -noise => Err(Refusal::SignTurned(levels)),
            _ if change <= noise => Err(Refusal::SameEffort(levels)),
            _ => Ok(Usual(levels)),
        }
    }

    /// From sliding one way to sliding the other.
    fn change(&self) -> f64 {
        self.0[1] - self.0[0]
    }

    fn level(&self, direction: f64) -> f64 {
        self.0[usize::from(direction > 0.0)]
    }

    /// The effort of sliding in a sweep, in the sense of its direction; `None` where the axis does not slide as it usually does:
    /// a short way in which the drive only winds up is steady too, but is no sliding.
    pub fn sliding(&self, sweep: &Whole) -> Option<Mean> {
        let mean = sweep.level?;
        let like = (mean.value - self.level(sweep.direction)).abs() <= LIKE * self.change();
        like.then_some(Mean { value: sweep.direction * mean.value, ..mean })
    }

    /// Whether the effort comes to sliding at the end of a way, however short that is and whatever it overshoots; at one speed, where
    /// it also brakes.
    fn slides(&self, sweep: &Sweep) -> bool {
        let efforts: Vec<f64> = late(&sweep.moving).map(|s| s.difference).collect();
        let mean = efforts.iter().sum::<f64>() / efforts.len() as f64;
        let comes = |effort: f64| sweep.direction * (effort - self.level(sweep.direction)) > -LIKE * self.change();
        comes(mean) || steady(&even(&sweep.moving)).is_some_and(|mean| comes(mean.value))
    }

    /// The sweeps of a track from one reversal of friction to the next.
    pub fn sweeps(&self, track: &Track) -> Vec<Whole> {
        let with = |sweep: Sweep| (self.slides(&sweep), sweep);
        let fine: Vec<(bool, Sweep)> = track.fine_sweeps().into_iter().map(with).collect();
        let sliding: Vec<&Sweep> = fine.iter().filter(|(slides, _)| *slides).map(|(_, sweep)| sweep).collect();
        let Some(first) = sliding.first() else { return Vec::new() };
        // The motor turns round where it is furthest between sliding one way and the other.
        let turn = |ends: &[&Sweep]| {
            let far = |row: &usize| ends[0].direction * track.motor[*row];
            let between = (ends[0].rows.start..ends[1].rows.end).rev();
            between.max_by(|a, b| far(a).total_cmp(&far(b))).filter(|_| ends[0].direction != ends[1].direction)
        };
        let mut cuts = vec![0];
        cuts.extend(sliding.windows(2).filter_map(turn));
        cuts.push(track.motor.len() - 1);
        let directions = [first.direction, -first.direction].into_iter().cycle();
        cuts.windows(2)
            .zip(directions)
            .map(|(ends, direction)| Whole::join(track, ends[0]..ends[1] + 1, direction, &fine))
            .collect()
    }
}

/// Motion one way from one reversal of friction to the next.
pub(super) struct Whole {
    /// +1 or −1.
    pub direction: f64,
    /// The row in which the motor turns to it.
    pub start: usize,
    /// The rows in which the motor gets on.
    pub rows: Vec<usize>,
    /// Speed on the longest way, 1/s.
    pub speed: f64,
    /// Distance from one reversal to the other.
    pub way: f64,
    /// The effort as the axis slides.
    level: Option<Mean>,
}

impl Whole {
    /// The sweep over these rows, of `fine` ones each of which comes to sliding or not.
    fn join(track: &Track, rows: Range<usize>, direction: f64, fine: &[(bool, Sweep)]) -> Whole {
        let far = |row: &usize| direction * track.motor[*row];
        let inside = |sweep: &Sweep| {
            sweep.direction == direction && sweep.rows.start >= rows.start && sweep.rows.end <= rows.end
        };
        let mut whole = Whole { direction, start: rows.start, rows: Vec::new(), speed: 0.0, way: 0.0, level: None };
        let (mut sliding, mut moving) = (Vec::new(), Vec::new());
        let (mut slid_to, mut longest) = (f64::NEG_INFINITY, 0.0);
        for (slides, sweep) in fine.iter().filter(|(_, sweep)| inside(sweep)) {
            let on = sweep.rows.clone().filter(|row| far(row) > slid_to);
            whole.rows.extend(on.clone());
            let end = far(&(sweep.rows.end - 1));
            whole.way = whole.way.max(end - far(&rows.start));
            if sweep.way() > longest {
                (longest, whole.speed) = (sweep.way(), sweep.top_speed);
            }
            if *slides {
                sliding.extend(on);
                moving.extend(sweep.moving.iter().filter(|sample| direction * sample.motor > slid_to));
                slid_to = slid_to.max(end);
            }
        }
        whole.level = level(track, &sliding, &moving);
        whole
    }
}

/// The rows in the last third of the way.
fn late(moving: &[Sample]) -> impl Iterator<Item = &Sample> {
    let ends = moving.first().zip(moving.last()).map_or((0.0, 0.0), |(first, last)| (first.motor, last.motor));
    let way = (ends.1 - ends.0).abs();
    moving.iter().filter(move |s| (s.motor - ends.0).abs() > LATE * way)
}

/// The rows of the last third of the way that are at one speed.
fn even(moving: &[Sample]) -> Vec<&Sample> {
    let speeds: Vec<f64> = late(moving).map(|s| s.speed.abs()).collect();
    let usual = quantile(&speeds, 0.5).unwrap_or(0.0);
    late(moving).filter(|s| (s.speed.abs() - usual).abs() < 0.2 * usual).collect()
}

/// The effort at one speed. `None` where there is too little of it to tell.
fn steady(even: &[&Sample]) -> Option<Mean> {
    let efforts: Vec<f64> = even.iter().map(|s| s.difference).collect();
    if efforts.len() < FEWEST_ROWS { None } else { correlated_mean(&efforts) }
}

/// The effort of sliding on the way over these rows, in which the motor gets on; `moving` are those in motion.
fn level(track: &Track, rows: &[usize], moving: &[Sample]) -> Option<Mean> {
    let even = even(moving);
    let (from, to) = (even.first()?.motor, even.last()?.motor);
    let within = |row: &&usize| (from.min(to)..=from.max(to)).contains(&track.motor[**row]);
    let stretch: Vec<usize> = rows.iter().filter(within).copied().collect();
    // An axis that only brakes is at one speed until then.
    let sticks = 2 * even.len() < stretch.len();
    uneven(track, &stretch).filter(|_| sticks || even.len() < FEWEST_ROWS).or_else(|| steady(&even))
}

/// The effort of an axis that sticks and slips. Over time and over travel it is not the same; either may be meant, so that the
/// middle is taken, and their distance for what is not known.
fn uneven(track: &Track, stretch: &[usize]) -> Option<Mean> {
    if stretch.len() < FEWEST_ROWS {
        return None;
    }
    let efforts: Vec<f64> = stretch.iter().map(|row| track.difference[*row]).collect();
    let over_time = correlated_mean(&efforts)?;
    let (sum, travel) = stretch.windows(2).fold((0.0, 0.0), |(sum, travel), ends| {
        let step = track.motor[ends[1]] - track.motor[ends[0]];
        (sum + 0.5 * step * (track.difference[ends[0]] + track.difference[ends[1]]), travel + step)
    });
    let apart = sum / travel - over_time.value;
    Some(Mean { value: over_time.value + 0.5 * apart, error: over_time.error.hypot(apart / 12f64.sqrt()), ..over_time })
}

/// What the effort does on the way of a sweep: effort times travel.
fn work(track: &Track, sweep: &Sweep) -> f64 {
    let step = |row: usize| track.motor[row + 1] - track.motor[row];
    let mean = |row: usize| 0.5 * (track.difference[row] + track.difference[row + 1]);
    (sweep.rows.start..sweep.rows.end - 1).map(|row| mean(row) * step(row)).sum()
}

/// The rows of a sweep in which the motor is further than it has been.
fn ahead(track: &Track, sweep: &Sweep) -> Vec<usize> {
    let mut furthest = f64::NEG_INFINITY;
    let on = |row: &usize| {
        let far = sweep.direction * track.motor[*row];
        let on = far >= furthest;
        furthest = furthest.max(far);
        on
    };
    sweep.rows.clone().filter(on).collect()
}
