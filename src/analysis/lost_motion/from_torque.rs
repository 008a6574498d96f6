//! Lost motion estimated from motor torque, where no scale on the table says it. It is not the reversal value of ISO 230-2.
//!
//! At each slow reversal the torque falls as the wind-up is released, stays level across the clearance, and rises as the
//! drive winds up the other way, until the table slides again:
//! `lost motion = clearance + 2·Ts/k` (see [`crate::cycle::backlash::fit`], which does the fit here as in the control). This
//! file finds the reversals in a recording, the sliding torque before and after each, and the torque against travel between.
//!
//! Friction on the motor's side turns its sign at the reversal but winds nothing up. It shows in two ways: as the level across
//! the clearance, and where the recording goes a few µm back and forth while the table sticks. Where neither is there, it is
//! taken as 20 ± 20 % of the friction, and the uncertainty says so.

pub use super::motor_friction::MotorFriction;
use super::motor_friction::{Friction, motor_friction};
use super::sweeps::Track;
use super::whole::{FEWEST_ROWS, SIGMAS, Usual, Whole};
use super::{Refusal, SPEED_RATIO, Value};
use crate::analysis::statistics::{Mean, deviation, grid, quantile, student_95};
use crate::cycle::backlash::curve::Curve;
use crate::cycle::backlash::fit::Fit;
use crate::cycle::backlash::fitted::{Fitted, Levels};
use crate::cycle::backlash::uncertainty::{Give, systematic};
use crate::cycle::backlash::verdict::check_reversal;
use crate::error::status_text;
use crate::machine::Axis;
use crate::recording::{Recording, RecordingError, Signal, Unit, file_row};

/// What the torque curve of one reversal gives. Lengths in mm or degrees, efforts in N·m or N.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// Lost motion between steady slow motion one way and the other.
    pub lost_motion: Value,
    /// Part of it that is clearance.
    pub clearance: f64,
    /// Part of it that is elastic wind-up.
    pub windup: f64,
    /// Stiffness of the drive at the motor, effort per mm or degree.
    pub stiffness: f64,
    /// Sliding friction, half the change of effort at the reversal.
    pub sliding: f64,
    /// Part of it on the motor's side.
    pub motor_friction: f64,
}

/// One reversal.
#[derive(Debug, Clone, PartialEq)]
pub struct Reversal {
    /// Row of the file in which the motor turns round (1 is the header).
    pub row: usize,
    /// Time of that row, s.
    pub time_s: f64,
    /// Motor position there.
    pub position: f64,
    /// Direction after the reversal: +1 or −1.
    pub direction: i8,
    /// What was found, or why nothing was.
    pub result: Result<Estimate, String>,
    /// Effort, positive in the new direction, against travel since the reversal.
    pub curve: Vec<(f64, f64)>,
}

/// The result for one axis.
#[derive(Debug, Clone, PartialEq)]
pub struct TorqueLostMotion {
    /// The axis.
    pub channel: String,
    /// `mm` or `deg`.
    pub unit: &'static str,
    /// `nm` or `n`.
    pub effort_unit: &'static str,
    /// Mean of the reversals, each sense counted alike.
    pub mean: Estimate,
    /// Standard deviation from reversal to reversal; `None` with fewer than two.
    pub spread: Option<f64>,
    /// Travel of the table itself before it slides, as the rounding of the curves shows it; it is taken off.
    pub presliding: f64,
    /// How friction on the motor's side was found.
    pub motor_friction: MotorFriction,
    /// False when the uncertainty is more than a third of the value: no compensation should be written from it.
    pub trustworthy: bool,
    /// Every reversal of the recording.
    pub reversals: Vec<Reversal>,
}

/// Estimates the lost motion of `channel` from position and torque (or force). Where the axis' model is given, its inertia and
/// viscous friction are taken off the torque, so that a reversal need not be quite slow.
///
/// # Errors
/// A missing column, no reversal, or none whose curve can be fitted.
pub fn estimate(recording: &Recording, channel: &str, model: Option<&Axis>) -> Result<TorqueLostMotion, Refusal> {
    let (pieces, unit, effort_unit) = pieces(recording, channel, model)?;
    let usual = Usual::of(pieces.iter().map(|piece| &piece.track))?;
    let mut turns: Vec<Turn> = pieces.iter().flat_map(|piece| piece.turns(&usual)).collect();
    if turns.is_empty() {
        return Err(Refusal::NoReversal);
    }
    leave_out_fast(&mut turns);
    let first: Vec<Fitted> = turns.iter().filter_map(|turn| turn.fit(0.0, 0.0).ok()).collect();
    let lost: Vec<f64> = first.iter().map(|fitted| fitted.lost_motion).collect();
    let Some(about) = quantile(&lost, 0.5) else {
        return Err(Refusal::NoCurve(turns.iter().map(Turn::why).collect()));
    };
    let (friction, source) = motor_friction(&pieces, &turns, about);
    let mut fits: Vec<Result<Fitted, String>> = turns.iter().map(|turn| turn.with(&friction)).collect();
    leave_out_unclear(&mut fits);
    let mut give = Give::default();
    fits.iter().flatten().for_each(|fitted| give.add(fitted));
    let resolution = pieces.iter().map(|piece| piece.resolution).fold(0.0, f64::max);
    let width = turns.iter().map(Turn::width).fold(0.0, f64::max);
    let grid = systematic(resolution, width, 0.0, 0.0);
    let told = give.told(grid);
    turns.iter_mut().zip(fits).for_each(|(turn, fitted)| turn.finish(fitted, &friction, told));
    // No presliding bends a curve the other way: by as much it is not the model's.
    let bent = give.untold(grid, told).max((0.5 * give.mean().min(0.0)).powi(2));
    let alike = |lost: f64| systematic(resolution, width, 0.0, lost) + bent;
    let mean =
        joined(&turns, &friction, alike).ok_or_else(|| Refusal::NoCurve(turns.iter().map(Turn::why).collect()))?;
    let values: Vec<f64> = turns.iter().filter_map(|t| t.result.as_ref().ok()).map(|e| e.lost_motion.value).collect();
    Ok(TorqueLostMotion {
        channel: channel.to_owned(),
        unit: unit.suffix(),
        effort_unit: effort_unit.suffix(),
        mean,
        spread: (values.len() > 1).then(|| deviation(&values)),
        presliding: if told { give.mean() } else { 0.0 },
        motor_friction: source,
        trustworthy: mean.lost_motion.uncertainty < 0.33 * mean.lost_motion.value,
        reversals: turns.into_iter().map(Turn::report).collect(),
    })
}

/// An unbroken piece of the recording, with the effort in the place of the difference.
pub(super) struct Piece {
    pub(super) track: Track,
    rows: Vec<usize>,
    resolution: f64,
}

fn pieces(recording: &Recording, channel: &str, model: Option<&Axis>) -> Result<(Vec<Piece>, Unit, Unit), Refusal> {
    let position = recording.column(channel, Signal::Position)?;
    let effort = match recording.get(channel, Signal::Force) {
        Some(force) => force,
        None => recording.column(channel, Signal::Torque)?,
    };
    let foreign = || Refusal::Recording(RecordingError::new(&recording.file, "holds a column without a unit"));
    let (positions, unit) = position.in_house().ok_or_else(foreign)?;
    let (efforts, effort_unit) = effort.in_house().ok_or_else(foreign)?;
    let piece = |rows: Vec<usize>| {
        let take = |values: &[f64]| -> Vec<f64> { rows.iter().map(|row| values[*row]).collect() };
        let motor = take(&positions);
        let resolution = grid(&motor).unwrap_or(0.0);
        let mut track = Track { time_s: take(&recording.time_s), motor, difference: take(&efforts) };
        if let Some(model) = model {
            let (belief, per_load) = (model.belief(), model.drive.motor_per_load());
            track.take_off_motion(per_load * belief.inertia, per_load * belief.viscous);
        }
        Piece { track, rows, resolution }
    };
    Ok((super::unbroken(recording, &[position, effort]).into_iter().map(piece).collect(), unit, effort_unit))
}

/// A reversal with what its fit needs.
pub(super) struct Turn {
    row: usize,
    time_s: f64,
    position: f64,
    direction: f64,
    /// Travel since the reversal and effort in the new sense, in order of time.
    samples: Vec<(f64, f64)>,
    pub(super) levels: Result<(Mean, Mean), String>,
    /// Speed after the reversal, 1/s.
    speed: f64,
    /// The shorter of the ways before and after.
    way: f64,
    resolution: f64,
    result: Result<Estimate, String>,
}

impl Piece {
    fn turns(&self, usual: &Usual) -> Vec<Turn> {
        let sweeps = usual.sweeps(&self.track);
        (1..sweeps.len()).map(|i| self.turn(&sweeps[..=i], usual)).collect()
    }

    /// The reversal before the last of these sweeps.
    fn turn(&self, sweeps: &[Whole], usual: &Usual) -> Turn {
        let (before, after) = (&sweeps[sweeps.len() - 2], &sweeps[sweeps.len() - 1]);
        let (row, direction) = (after.start, after.direction);
        let position = self.track.motor[row];
        let sample =
            |row: &usize| (direction * (self.track.motor[*row] - position), direction * self.track.difference[*row]);
        let samples = after.rows.iter().map(sample).collect();
        // A scan that ends soon after the table slides holds too little sliding of its own; the sweep before last went the
        // same way.
        let own = usual.sliding(after);
        let earlier = sweeps.iter().rev().nth(2).and_then(|sweep| usual.sliding(sweep));
        let after_level = match (own, earlier) {
            (Some(own), Some(earlier)) if earlier.error < own.error && similar(&own, &earlier) => Some(earlier),
            (None, earlier) => earlier,
            (own, _) => own,
        };
        let levels = match (usual.sliding(before).map(|mean| Mean { value: -mean.value, ..mean }), after_level) {
            (Some(before), Some(after)) => Ok((before, after)),
            (None, _) => Err("the axis does not slide steadily before it".to_owned()),
            (_, None) => Err("the axis does not slide steadily after it".to_owned()),
        };
        Turn {
            row: file_row(self.rows[row]),
            time_s: self.track.time_s[row],
            position,
            direction,
            samples,
            levels,
            speed: after.speed,
            way: before.way.min(after.way),
            resolution: self.resolution,
            result: Err(String::new()),
        }
    }
}

fn similar(a: &Mean, b: &Mean) -> bool {
    (a.value - b.value).abs() < 4.0 * a.error.hypot(b.error) + 0.1 * a.value.abs()
}

/// Bins over the way to sliding. The fit leaves out the first two, in which the motor's own friction turns round.
const BINS: f64 = 120.0;
/// Share of the way to the first kink in which it turns round at most, where these bins are fine.
const TURNED: f64 = 0.3;

/// Sets aside reversals at much more than the slowest speed at which one shows lost motion: there the torque also moves masses.
fn leave_out_fast(turns: &mut [Turn]) {
    let slowest =
        turns.iter().filter(|turn| turn.fit(0.0, 0.0).is_ok()).map(|turn| turn.speed).fold(f64::INFINITY, f64::min);
    for turn in turns.iter_mut().filter(|turn| turn.speed > SPEED_RATIO * slowest) {
        turn.levels = Err("much faster than the slowest reversal".into());
    }
}

/// Sets aside reversals that say little beside the clearest one, of the lost motion or of the table's presliding: a mean that counts all
/// alike would be theirs.
fn leave_out_unclear(fits: &mut [Result<Fitted, String>]) {
    const TIMES: f64 = 4.0;
    const SHARE: f64 = 0.03;
    let error =
        |fit: &Fitted| fit.rounded.map_or(fit.variance, |rounded| rounded.fit_variance.max(fit.variance)).sqrt();
    let clearest = fits.iter().flatten().map(error).fold(f64::INFINITY, f64::min);
    let unclear = |fit: &Fitted| error(fit) > (TIMES * clearest).max(SHARE * fit.lost_motion);
    for fit in fits.iter_mut().filter(|fit| fit.as_ref().is_ok_and(unclear)) {
        *fit = Err("says much less than the clearest reversal".into());
    }
}

impl Turn {
    /// Travel at which the effort has first come near the sliding level after the reversal.
    fn rise(&self) -> Option<f64> {
        const NEAR: f64 = 0.95;
        let (before, after) = self.levels.as_ref().ok()?;
        let goal = before.value + NEAR * (after.value - before.value);
        let near = |rows: i32| {
            let mut smooth = before.value;
            self.samples.iter().find_map(|(travel, effort)| {
                smooth += (effort - smooth) / f64::from(rows);
                (smooth > goal).then_some(*travel)
            })
        };
        // Sixteen rows calm the noise; fewer where the delay they bring makes the curve much longer: a motor may run off once the
        // table slides.
        const LONGER: f64 = 1.25;
        let found = [16, 8, 4, 2, 1].map(near);
        let much_longer =
            |ends: &&[Option<f64>]| ends[0].zip(ends[1]).is_none_or(|(slow, quick)| slow > LONGER * quick);
        let halved = found.windows(2).take_while(much_longer).count();
        found[halved]
    }

    pub(super) fn width(&self) -> f64 {
        (1.5 * self.rise().unwrap_or(0.0) / BINS).max(self.resolution)
    }

    /// How much more the effort is in the second half of the clearance than in the first; `None` with few rows in it.
    pub(super) fn growth(&self, fitted: &Fitted, fewest_rows: usize) -> Option<f64> {
        let half = |from: f64| -> Vec<f64> {
            let half = from..from + 0.5 * fitted.clearance;
            self.samples.iter().filter(|(travel, _)| half.contains(travel)).map(|(_, effort)| *effort).collect()
        };
        let (first, second) = (half(fitted.held), half(fitted.held + 0.5 * fitted.clearance));
        let mean = |of: &[f64]| of.iter().sum::<f64>() / of.len().max(1) as f64;
        (first.len() + second.len() >= fewest_rows).then(|| mean(&second) - mean(&first))
    }

    pub(super) fn fit(&self, motor: f64, motor_error: f64) -> Result<Fitted, String> {
        let (before, after) = self.levels.as_ref().map_err(Clone::clone)?;
        let change = after.value - before.value;
        if change <= SIGMAS * before.error.hypot(after.error) {
            return Err("the effort does not change at it by more than its noise".into());
        }
        let Some(rise) = self.rise().filter(|rise| *rise > 0.0) else {
            return Err("the effort does not rise to the sliding level after it".into());
        };
        let mut curve = Box::new(Curve::default());
        curve.start(self.width());
        for (travel, effort) in self.samples.iter().filter(|(travel, _)| *travel < 1.5 * rise) {
            curve.add(*travel, *effort);
        }
        let variance = before.error.powi(2) + after.error.powi(2) + (2.0 * motor_error).powi(2);
        let mut fit = Box::new(Fit::default());
        fit.start(Levels { before: before.value, after: after.value, motor, variance }, TURNED, None);
        for _ in 0..=Fit::slices_bound() {
            if fit.advance(&curve) {
                break;
            }
        }
        let fitted = check_reversal(fit.result(), 1.0).map_err(|fault| {
            self.too_coarse(rise).unwrap_or_else(|| status_text(fault.code).trim_end_matches('\0').to_owned())
        })?;
        if self.way < 1.2 * fitted.lost_motion {
            return Err("the way before or after it is too short for the table to slide".into());
        }
        Ok(fitted)
    }

    /// What is too coarse for the curve, if something is: rows in time, or the encoder.
    fn too_coarse(&self, rise: f64) -> Option<String> {
        // The middle of the change, which noise does not mistake for sliding.
        let (before, after) = self.levels.as_ref().ok()?;
        let turning = |effort: f64| (0.1..0.9).contains(&((effort - before.value) / (after.value - before.value)));
        let turning: Vec<f64> =
            self.samples.iter().filter(|(travel, effort)| *travel < rise && turning(*effort)).map(|s| s.0).collect();
        let (low, high) = turning.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
        if turning.len() < FEWEST_ROWS {
            return Some(format!(
                "fewer than {FEWEST_ROWS} rows while the effort turns round: go slower, or record more often"
            ));
        }
        (high - low < FEWEST_ROWS as f64 * self.resolution).then(|| {
            format!("fewer than {FEWEST_ROWS} encoder steps while the effort turns round: use a finer encoder or scale")
        })
    }

    fn change(&self) -> f64 {
        self.levels.as_ref().map_or(0.0, |(before, after)| after.value - before.value)
    }

    fn with(&self, friction: &Friction) -> Result<Fitted, String> {
        let (motor, error) = friction.at(self.change());
        self.fit(motor, error)
    }

    /// Takes the fit, or what its rounding makes of it where the table's presliding is `told`.
    fn finish(&mut self, fitted: Result<Fitted, String>, friction: &Friction, told: bool) {
        let change = self.change();
        self.result = fitted.map(|fitted| {
            let found = fitted.curve(told);
            Estimate {
                lost_motion: Value { value: found.lost_motion, uncertainty: 2.0 * found.variance.sqrt() },
                clearance: found.clearance,
                windup: found.lost_motion - found.clearance,
                stiffness: found.stiffness,
                sliding: 0.5 * change,
                motor_friction: friction.at(change).0,
            }
        });
    }

    fn why(&self) -> (usize, String) {
        let why = self.result.as_ref().err().filter(|why| !why.is_empty()).cloned();
        (self.row, why.or_else(|| self.fit(0.0, 0.0).err()).unwrap_or_default())
    }

    fn report(self) -> Reversal {
        let width = self.width().max(f64::MIN_POSITIVE);
        let end = 2.0 * self.rise().unwrap_or(0.0);
        let mut curve: Vec<(f64, f64, f64)> = Vec::new();
        for (travel, effort) in self.samples.iter().filter(|(travel, _)| *travel >= 0.0 && *travel < end) {
            let bin = (travel / width) as usize;
            if curve.len() <= bin {
                curve.resize(bin + 1, (0.0, 0.0, 0.0));
            }
            let sums = &mut curve[bin];
            *sums = (sums.0 + 1.0, sums.1 + travel, sums.2 + effort);
        }
        Reversal {
            row: self.row,
            time_s: self.time_s,
            position: self.position,
            direction: self.direction as i8,
            result: self.result,
            curve: curve.into_iter().filter(|sums| sums.0 > 0.0).map(|(n, s, t)| (s / n, t / n)).collect(),
        }
    }
}

/// Mean over the reversals, each sense counted alike. The variance is the larger of what the fits expect and what the
/// reversals show; what is `alike` in every one of them, a variance for their mean, does not average out.
fn joined(turns: &[Turn], friction: &Friction, alike: impl Fn(f64) -> f64) -> Option<Estimate> {
    let sense = |direction: f64| -> Vec<&Estimate> {
        turns.iter().filter(|t| t.direction == direction).filter_map(|t| t.result.as_ref().ok()).collect()
    };
    let senses: Vec<Vec<&Estimate>> = [1.0, -1.0].map(sense).into_iter().filter(|s| !s.is_empty()).collect();
    let count: usize = senses.iter().map(Vec::len).sum();
    if count == 0 {
        return None;
    }
    let mean = |of: fn(&Estimate) -> f64| mean_over(&senses, of);
    let n = count as f64;
    // The error of the motor's friction is the same in all of them and does not average out.
    let common = mean_over(&senses, |e| (2.0 * friction.at(2.0 * e.sliding).1 / e.stiffness).powi(2));
    let expected = (mean(|e| (0.5 * e.lost_motion.uncertainty).powi(2)) - common).max(0.0) / n;
    let free = n - senses.len() as f64;
    let values = |s: &Vec<&Estimate>| s.iter().map(|e| e.lost_motion.value).collect::<Vec<f64>>();
    let squares: f64 = senses.iter().map(|s| deviation(&values(s)).powi(2) * (s.len() - 1) as f64).sum();
    let seen = if free > 0.0 { (student_95(free) / 1.96).powi(2) * squares / free / n } else { 0.0 };
    let value = mean(|e| e.lost_motion.value);
    Some(Estimate {
        lost_motion: Value { value, uncertainty: 2.0 * (expected.max(seen) + common + alike(value)).sqrt() },
        clearance: mean(|e| e.clearance),
        windup: mean(|e| e.windup),
        stiffness: mean(|e| e.stiffness),
        sliding: mean(|e| e.sliding),
        motor_friction: mean(|e| e.motor_friction),
    })
}

/// Mean over the senses of the means over the reversals of each.
fn mean_over(senses: &[Vec<&Estimate>], of: impl Fn(&Estimate) -> f64) -> f64 {
    let each = senses.iter().map(|s| s.iter().map(|e| of(e)).sum::<f64>() / s.len() as f64);
    each.sum::<f64>() / senses.len() as f64
}
