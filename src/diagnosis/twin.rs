//! What a diagnosis finds in a recording that the machine without it would leave.
//!
//! A servo answers the grid and the noise of its encoder. At steady feeds the readings beat with the rows, and behind a coarse or noisy
//! encoder so much torque is made that chance looks like a law. The loop of the machine without a small finding is replayed through such an
//! encoder, with noise of that size on its torque, and diagnosed in the same way: what is named there, too, is made by the sensors.
//! (A parametric bootstrap, Efron 1979.)

use super::belief;
use super::by_loop::Replays;
use super::causes::LAWS;
use super::frame::{Columns, Frame};
use super::grids;
use super::judge::{left_by, squares_and_noise};
use super::looks::Look;
use super::progress::Stopped;
use super::verdict::{Diagnosis, Recorded, Verdict, answer};
use super::whole::Whole;
use crate::machine::{Axis, Cause, Effect};
use crate::plant::noise::Noise;

/// Variance that a finding explains over that which readings make through the inertia up to which sensors may have made it: what is there
/// explained 17 times that and more, what was not 0.7 to 1.7 times.
const SMALL: f64 = 4.0;
/// Share of the variance in a narrow band from which on what the sensors make above the noise may be that band at another frequency: a beat
/// goes with the last digit of a feed.
const ALIKE: f64 = 0.5;
/// What a scale shows the replayed motor does not.
const OF_SCALE: [Cause; 2] = [Cause::ScrewPitchError, Cause::ScrewPeriodicError];
/// Of the twin's noise.
const SEED: u64 = 1979;

/// The causes of what a look finds that its sensors would make without them.
///
/// # Errors
/// [`Stopped`] when the watch's caller said so.
pub fn made_by_sensors(
    recorded: &Recorded,
    (columns, first): (&Columns, &Frame),
    look: &Look,
) -> Result<Vec<Cause>, Stopped> {
    let (axis, found) = (recorded.axis, &look.found);
    if found.findings.is_empty() {
        return Ok(Vec::new());
    }
    let quieter = look.width != first.low_pass.width;
    let base = belief::base_alone(axis);
    let wide = quieter.then(|| Frame::new(&base, columns, Some(look.width)).after_first_swings(axis));
    let [variance, _] = left_by(axis, wide.as_ref().unwrap_or(first), squares_and_noise);
    let explains = |cause: Cause| {
        let findings = found.findings.iter().filter(|finding| finding.effect.cause() == cause);
        findings.map(|finding| finding.share).sum::<f64>() * variance
    };
    // A quieter look is one for much that the encoder makes.
    let most = if quieter { f64::INFINITY } else { SMALL * grids::made_of_readings(first) };
    let named = found.findings.iter().map(|finding| finding.effect.cause());
    let small: Vec<Cause> = named.filter(|cause| explains(*cause) < most && !OF_SCALE.contains(cause)).collect();
    if small.is_empty() {
        return Ok(small);
    }
    // A vibration in a narrow band is in no extended machine.
    let lines = found.extended.effects.iter().any(|effect| effect.cause() == Cause::ExternalVibration);
    let is_band = |cause: Cause| cause == Cause::ExternalVibration && !lines;
    let kept = found.findings.iter().map(|finding| finding.effect).filter(|effect| !small.contains(&effect.cause()));
    let without = belief::extended(axis, &kept.collect::<Vec<Effect>>());
    let replays = Replays::new(recorded.whole, found.replay.as_ref(), recorded.watch);
    let Some(replays) = replays else { return Ok(Vec::new()) };
    let base = belief::base_alone(&without);
    let [_, noise] = left_by(&found.extended, first, squares_and_noise);
    // A table that is not in question need not be simulated; but a quieter look counts all that is found.
    let tables = LAWS.iter().filter(|law| law.is_simulated() && !quieter).map(|law| law.cause);
    let except: Vec<Cause> =
        tables.filter(|table| !small.contains(table)).chain(recorded.except.iter().copied()).collect();
    let made_in = |motion: &[Vec<f64>; 2]| -> Result<Vec<Cause>, Stopped> {
        let columns = noisy(&without, recorded.whole.columns, motion.clone(), (first.low_pass.width, noise));
        let whole = Whole::new(&without, &columns);
        let twin =
            Recorded { axis: &without, belief: &without, whole: &whole, holdout: None, except: &except, ..*recorded };
        let thinned = columns.clone().thinned();
        let frame = |width| Frame::new(&base, &thinned, Some(width)).after_first_swings(&without);
        let look_at = |width| answer(&twin, &frame(width), Vec::new());
        let again = look_at(look.width)?;
        let doubts = |found: &Diagnosis| found.verdict != Verdict::NoDiscrepancy;
        let [squares, noise] = left_by(&without, &frame(look.width), squares_and_noise);
        let left = squares - noise;
        // A quieter look that doubts a machine by its own recording tells nothing small, nor one that only the next agrees with.
        let unsure = quieter && (doubts(&again) || doubts(&look_at(2 * look.width + 1)?));
        let named: Vec<Cause> = again.findings.iter().map(|finding| finding.effect.cause()).collect();
        let is_made = |cause: &Cause| {
            named.contains(cause)
                || unsure && explains(*cause) < SMALL * left
                || is_band(*cause) && explains(*cause) < left / ALIKE
        };
        Ok(small.iter().copied().filter(is_made).collect())
    };
    let motions: Vec<_> = replays.recordings_of(&without).collect();
    let mut made = Vec::new();
    for of_one in
        recorded.watch.each(&motions, (0.96, 0.97), "asking a recording of the machine without it", made_in)?
    {
        made.extend(of_one?);
    }
    made.sort();
    made.dedup();
    Ok(made)
}

/// What is said of causes that are not named because of it.
#[must_use]
pub fn says(made: &[Cause]) -> String {
    let names: Vec<&str> = made.iter().map(|cause| cause.name()).collect();
    let names = names.join(" and ");
    format!(
        "{names} would explain some, but so it would in a recording of this machine without it, behind an encoder of this grid and noise: it is not named"
    )
}

/// Columns of a motion, the torque with as much noise as makes `noise` (a mean square) through a low-pass of this width together with what the
/// encoder makes.
fn noisy(machine: &Axis, like: &Columns, [position, torque]: [Vec<f64>; 2], (width, noise): (usize, f64)) -> Columns {
    let base = belief::base_alone(machine);
    let mut columns = like.with_motion(position, torque);
    columns.command = like.command.as_ref().map(|command| command[..columns.position.len()].to_vec());
    let thinned = columns.clone().thinned();
    let frame = Frame::new(&base, &thinned, Some(width));
    let [_, own] = left_by(machine, &frame, squares_and_noise);
    let missing = (noise - own).max(0.0).sqrt() / frame.of_white_noise();
    let deviation = missing * (thinned.period_s / columns.period_s).sqrt();
    let mut random = Noise::new(SEED);
    columns.torque.iter_mut().for_each(|torque| *torque += random.normal(deviation));
    columns
}
