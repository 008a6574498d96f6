//! What the extended machine is worth on rows it was not fitted to, by the prediction that `gib predict` makes.

use super::belief;
use super::fit::{Bench, Fit};
use super::frame::Frame;
use super::missed::{self, half_of};
use super::progress::{Stopped, Watch};
use super::replayed;
use super::whole::Whole;
use crate::analysis::statistics;
use crate::machine::{Axis, Cause};
use crate::plant::added::ByServo;
use crate::plant::closed_loop::{Manner, predict_by};
use crate::plant::motion::FEWEST_ROWS;
use crate::plant::observed::Observed;
use crate::plant::predict::{TorquePrediction, predict_table, predict_torque};
use std::borrow::Cow;
use std::ops::Range;

/// RMS before and after, on rows that were not fitted.
#[derive(Debug, Clone, PartialEq)]
pub struct Gain {
    /// `torque` or `force` (while the axis moves), `position`, `table_position`.
    pub channel: &'static str,
    /// RMS of the belief's residual.
    pub before: f64,
    /// RMS of the extended machine's.
    pub after: f64,
    /// 95 % interval of before over after.
    pub ci95: [f64; 2],
}

/// Errors of one machine on a recording.
#[derive(Debug, Clone)]
pub struct Errors {
    /// Torque, closed-loop position, table position (without a closed loop that behind the measured motor); NaN where not predicted, and
    /// for the torque where the axis stands, since friction then is not a function of the motion.
    channels: [Option<Vec<f64>>; 3],
    /// How the loop was replayed, where it was.
    pub replay: Option<Replay>,
}

/// A machine's closed loop, as it was replayed.
#[derive(Debug, Clone, PartialEq)]
pub struct Replay {
    /// The machine.
    pub axis: Axis,
    /// How.
    pub manner: Manner,
    /// Measured less replayed position of the first rows, as many as a diagnosis replays again.
    pub error: Vec<f64>,
}

/// How many times longer than usual the plant steps are: the position goes with it by two nanometres at most.
const COARSER: f64 = 4.0;
/// What short steps are for: a torque that changes with speed, way or time is taken as it was before a step.
const WANT_SHORT_STEPS: [Cause; 3] = [Cause::PreslidingFriction, Cause::StribeckFriction, Cause::ExternalVibration];

/// The errors of a machine on a recording; `None` where nothing can be predicted.
pub(super) fn errors(axis: &Axis, observed: &Observed, servo: &ByServo) -> Option<Errors> {
    let short = axis.effects.iter().any(|effect| WANT_SHORT_STEPS.contains(&effect.cause()));
    let prediction = predict_by(axis, observed, servo, if short { 1.0 } else { COARSER }).ok()?;
    let less =
        |measured: &[f64], model: &[f64]| -> Vec<f64> { measured.iter().zip(model).map(|(m, p)| m - p).collect() };
    let replayed = prediction.closed_loop.as_ref();
    let table = match replayed {
        Some(replayed) => replayed.table_position.as_deref().map(Cow::Borrowed),
        None => predict_table(&prediction.torque.physics, observed).map(Cow::Owned),
    };
    let channels = [
        Some(torque_errors(observed, &prediction.torque)),
        replayed.map(|r| less(&observed.position, &r.position)),
        observed.table_position.as_ref().zip(table).map(|(measured, table)| less(measured, &table)),
    ];
    let replay = prediction.manner().zip(channels[1].as_ref()).map(|(manner, error): (Manner, &Vec<f64>)| {
        let rows = replayed::rows(axis, observed);
        Replay { axis: axis.clone(), manner, error: error[..rows].to_vec() }
    });
    Some(Errors { channels, replay })
}

/// Errors of the torque; NaN where the axis stands.
fn torque_errors(observed: &Observed, prediction: &TorquePrediction) -> Vec<f64> {
    let standing = observed.motion.standing_speed();
    let rows = observed.torque.iter().zip(&prediction.torque).zip(observed.motion.velocities());
    rows.map(|((measured, predicted), v)| if v.abs() > standing { measured - predicted } else { f64::NAN }).collect()
}

/// The gains of the second machine over the first in some of a recording's rows.
///
/// # Errors
/// [`Stopped`] when the watch's caller said so.
pub fn where_judged(
    machines: [&Axis; 2],
    (observed, servo): (&Observed, &ByServo),
    counts: &[bool],
    watch: &Watch,
) -> Result<Vec<Gain>, Stopped> {
    let mut both = watch.each(&machines, (0.995, 0.999), "measuring the gain", |axis| errors(axis, observed, servo))?;
    for error in both.iter_mut().flatten().flat_map(|errors| errors.channels.iter_mut().flatten()) {
        error.iter_mut().zip(counts).filter(|(_, counts)| !**counts).for_each(|(error, _)| *error = f64::NAN);
    }
    let [Some(before), Some(after)] = both.as_slice() else { return Ok(Vec::new()) };
    Ok(gains(machines[0], before, after, Over::All))
}

/// The gains of one machine over another on a recording by their errors, and those by which a law may be refuted
/// ([`in_judged_rows`]).
pub(super) fn of_both(axis: &Axis, [before, after]: [&Errors; 2], weight: &[f64]) -> [Vec<Gain>; 2] {
    let [b, a] = [before, after].map(|errors| in_judged_rows(errors, weight));
    [gains(axis, before, after, Over::All), gains(axis, &b, &a, Over::Most)]
}

/// Errors by which a law may be refuted: of the torque only in judged rows and as they count there. Where the axis sticks or
/// breaks away few rows hold more error than all others, and no law is answerable for it.
fn in_judged_rows(errors: &Errors, weight: &[f64]) -> Errors {
    let mut judged = errors.clone();
    let torque = judged.channels[0].iter_mut().flatten();
    torque.zip(weight).for_each(|(error, weight)| *error *= weight);
    judged
}

/// The fitted recording itself as rows that were not fitted: half of its blocks are predicted by a machine that was fitted to
/// the others.
pub struct HeldOut<'g, 'f, 'a> {
    axis: &'g Axis,
    /// What of the axis stays beside what is found.
    kept: &'g Axis,
    bench: &'g Bench<'f, 'a>,
    watch: &'g Watch<'g>,
    recording: Option<(&'g Observed, &'g ByServo)>,
    /// The half that each row belongs to, see [`half_of_rows`].
    half: Vec<usize>,
    /// What each row's torque says of a law, see [`weight_of_rows`].
    weight: Vec<f64>,
}

impl<'g, 'f, 'a> HeldOut<'g, 'f, 'a> {
    /// Of every row of the recording.
    #[must_use]
    pub fn new([axis, kept]: [&'g Axis; 2], whole: &'g Whole, bench: &'g Bench<'f, 'a>, watch: &'g Watch<'g>) -> Self {
        let recording = whole.recording();
        let observed = recording.map(|(observed, _)| observed);
        let half = observed.map_or_else(Vec::new, |observed| half_of_rows(bench, &observed.time_s));
        let weight = observed.map_or_else(Vec::new, |observed| weight_of_rows(bench.frame, &observed.time_s));
        Self { axis, kept, bench, watch, recording, half, weight }
    }

    /// What of the axis stays beside what is found.
    #[must_use]
    pub fn kept(&self) -> &Axis {
        self.kept
    }

    /// Errors of the belief alone; `None` where nothing can be predicted.
    #[must_use]
    pub fn believed(&self) -> Option<Errors> {
        let (observed, servo) = self.recording?;
        errors(self.axis, observed, servo)
    }

    /// Errors of the belief with a set of causes; `None` where nothing can be predicted.
    ///
    /// # Errors
    /// [`Stopped`] when the watch's caller said so.
    pub fn errors(&self, fit: &Fit) -> Result<Option<Errors>, Stopped> {
        let Some((observed, servo)) = self.recording else { return Ok(None) };
        let mut machines: Vec<Axis> = (0..2).map(|half| fitted_without(self.kept, self.bench, fit, half)).collect();
        // Without a coefficient both halves have the same one.
        machines.dedup();
        let of_half =
            self.watch.each(&machines, (0.92, 0.99), "measuring the gain", |axis| errors(axis, observed, servo))?;
        let (Some(Some(even)), Some(Some(odd))) = (of_half.first(), of_half.last()) else { return Ok(None) };
        let channels = std::array::from_fn(|channel| {
            let (even, odd) = (even.channels[channel].as_ref()?, odd.channels[channel].as_ref()?);
            Some(self.half.iter().enumerate().map(|(i, half)| [even[i], odd[i], f64::NAN][*half]).collect())
        });
        Ok(Some(Errors { channels, replay: even.replay.clone() }))
    }

    /// Times of all rows, measured less replayed position of a loop by its errors, and the measured one; `None` where none was replayed.
    #[must_use]
    pub fn misses<'e>(&'e self, errors: &'e Errors) -> Option<[&'e [f64]; 3]> {
        let (observed, _) = self.recording?;
        Some([&observed.time_s, errors.channels[1].as_ref()?, &observed.position])
    }

    /// How far each block of the position is missed, by what the encoder itself is off by, where a loop was replayed.
    #[must_use]
    pub fn missed(&self, errors: &Errors) -> Option<Vec<f64>> {
        let [_, error, position] = self.misses(errors)?;
        let floor = statistics::reading_error(position);
        (floor > 0.0).then(|| missed::misses(error, floor))
    }

    /// RMS of the torque while the axis moves, by machines with these sets of causes, in some stretches that all are compared in.
    ///
    /// # Errors
    /// [`Stopped`] when the watch's caller said so.
    pub fn torque_errors(&self, fits: &[Fit], stage: &'static str) -> Result<Vec<Option<f64>>, Stopped> {
        let Some((observed, _)) = self.recording else { return Ok(vec![None; fits.len()]) };
        let here = in_stretches(observed);
        let error = |fit: &Fit| {
            let prediction = predict_torque(&fitted_without(self.kept, self.bench, fit, NEITHER), &here).ok()?;
            let moving = torque_errors(&here, &prediction);
            let (sum, count) =
                moving.iter().filter(|e| e.is_finite()).fold((0.0, 0.0), |(s, n), e| (s + e * e, n + 1.0));
            (count > 0.0).then(|| f64::sqrt(sum / count))
        };
        self.watch.each(fits, (0.92, 0.92), stage, error)
    }

    /// What of the axis stays, and its recording, every row, with what that says of the servo.
    #[must_use]
    pub fn recording(&self) -> Option<(&Axis, (&Observed, &ByServo))> {
        self.recording.map(|recording| (self.kept, recording))
    }

    /// The gains by which a law may be refuted.
    #[must_use]
    pub fn judged_gains(&self, before: Option<&Errors>, after: Option<&Errors>) -> Vec<Gain> {
        let judged = |errors: &Errors| in_judged_rows(errors, &self.weight);
        let both = before.zip(after);
        both.map_or_else(Vec::new, |(before, after)| gains(self.axis, &judged(before), &judged(after), Over::Most))
    }

    /// The gains of one set of causes over another by their errors.
    #[must_use]
    pub fn gains(&self, before: Option<&Errors>, after: Option<&Errors>) -> Vec<Gain> {
        before.zip(after).map_or_else(Vec::new, |(before, after)| gains(self.axis, before, after, Over::All))
    }
}

/// The axis with effects whose coefficients are fitted without the blocks of one half.
fn fitted_without(axis: &Axis, bench: &Bench, fit: &Fit, half: usize) -> Axis {
    let coefficients = bench.coefficients_without(fit, |block| half_of(block) == half);
    let effect = |(i, part): (usize, &super::fit::Part)| {
        let of = |c: &[f64]| part.law.effect(bench.frame, &part.shape, c);
        of(&coefficients[i]).or_else(|| of(&fit.coefficients[i]))
    };
    let effects = fit.parts.iter().enumerate().filter_map(effect).collect();
    belief::with_found(axis, bench.frame.axis, effects)
}

/// Rows of neither half.
const NEITHER: usize = 2;

/// For each row the half its block belongs to, 2 for rows before the first and after the last block.
fn half_of_rows(bench: &Bench, time_s: &[f64]) -> Vec<usize> {
    let frame = bench.frame;
    let begin =
        |block: usize| frame.kept.get(frame.blocks[block]).map_or(f64::INFINITY, |&row| frame.columns.time_s[row]);
    let last = frame.kept.last().map_or(0.0, |&row| frame.columns.time_s[row]);
    let mut block = 0;
    let of = |&t: &f64| {
        while block + 2 < frame.blocks.len() && t >= begin(block + 1) {
            block += 1;
        }
        if t < begin(0) || t > last { NEITHER } else { half_of(block) }
    };
    time_s.iter().map(of).collect()
}

/// Stretches in which machines are compared, and rows of all of them.
const STRETCHES: usize = 16;
const ROWS_OF_STRETCHES: usize = 12_000;

/// A recording of which only some stretches are known, spread over all of it.
fn in_stretches(observed: &Observed) -> Observed {
    let (rows, each) = (observed.time_s.len(), ROWS_OF_STRETCHES / STRETCHES);
    if rows <= ROWS_OF_STRETCHES {
        return observed.clone();
    }
    let begin = |i: usize| i * (rows - each) / (STRETCHES - 1);
    let within = |stretch: &Range<usize>| {
        let parts = observed.runs.iter().map(|run| run.start.max(stretch.start)..run.end.min(stretch.end));
        parts.filter(|part| part.len() >= FEWEST_ROWS).collect::<Vec<_>>()
    };
    let runs: Vec<Range<usize>> = (0..STRETCHES).map(|i| begin(i)..begin(i) + each).flat_map(|s| within(&s)).collect();
    if runs.is_empty() { observed.clone() } else { Observed { runs, ..observed.clone() } }
}

/// For each row the lesser weight of the two judged rows about it; NaN where rows between them are not judged.
pub(super) fn weight_of_rows(frame: &Frame, time_s: &[f64]) -> Vec<f64> {
    let mut after = 0;
    let of = |&t: &f64| {
        while after < frame.kept.len() && frame.columns.time_s[frame.kept[after]] < t {
            after += 1;
        }
        let before = after.max(1) - 1;
        let close = after < frame.kept.len() && frame.kept[after] - frame.kept[before] <= frame.apart[1];
        if close { frame.weights[before].min(frame.weights[after]) } else { f64::NAN }
    };
    time_s.iter().map(of).collect()
}

/// The gain in how far the table is from the motor, where both are recorded and simulated. In the simulated table's own place
/// the motor's following error is by far the most, with which what a spring does may happen to go.
#[must_use]
pub fn of_stretch(before: Option<&Errors>, after: Option<&Errors>) -> Option<Gain> {
    let stretch = |Errors { channels: [_, motor, table], .. }: &Errors| -> Option<Vec<f64>> {
        let Some(motor) = motor else { return table.clone() };
        Some(table.as_ref()?.iter().zip(motor).map(|(table, motor)| table - motor).collect())
    };
    gain("table_position - position", &stretch(before?)?, &stretch(after?)?, Over::All)
}

fn gains(axis: &Axis, before: &Errors, after: &Errors, over: Over) -> Vec<Gain> {
    let names = [axis.drive.torque_word(), "position", "table_position"];
    let pairs = names.into_iter().zip(before.channels.iter().zip(&after.channels));
    pairs.filter_map(|(name, (before, after))| gain(name, before.as_ref()?, after.as_ref()?, over)).collect()
}

/// Which contiguous blocks a gain is measured over.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Over {
    All,
    /// All but the [`FEW_BLOCKS`] in which most is lost. Where an axis that sticks breaks loose a cycle sooner or later its loop goes
    /// another way for a while, under the right machine as well: such moments hold more error than all else and say nothing about a
    /// law. A law that is wrong errs in more places.
    Most,
}

/// RMS before and after over rows where both are known, with the interval over contiguous blocks.
fn gain(channel: &'static str, before: &[f64], after: &[f64], over: Over) -> Option<Gain> {
    let pairs: Vec<(f64, f64)> =
        before.iter().zip(after).filter(|(b, a)| b.is_finite() && a.is_finite()).map(|(b, a)| (b * b, a * a)).collect();
    if pairs.len() < 10 * BLOCKS {
        return None;
    }
    let mut blocks: Vec<&[(f64, f64)]> = pairs.chunks(pairs.len().div_ceil(BLOCKS)).collect();
    if over == Over::Most && blocks.len() > 4 * FEW_BLOCKS {
        let lost = |block: &[(f64, f64)]| block.iter().map(|(before, after)| after - before).sum::<f64>();
        blocks.sort_by(|a, b| lost(a).total_cmp(&lost(b)));
        blocks.truncate(blocks.len() - FEW_BLOCKS);
    }
    let sum = |pick: fn(&(f64, f64)) -> f64| -> Vec<f64> { blocks.iter().map(|b| b.iter().map(pick).sum()).collect() };
    let sizes: Vec<f64> = blocks.iter().map(|b| b.len() as f64).collect();
    let (before, after, ci95) = ratio_of(&sum(|p| p.0), &sum(|p| p.1), &sizes);
    Some(Gain { channel, before, after, ci95 })
}

/// Contiguous blocks of a hold-out.
const BLOCKS: usize = 24;
/// Few of them.
const FEW_BLOCKS: usize = 3;

/// RMS before, RMS after, and the 95 % interval of their ratio over blocks: jackknife of ln(ratio), blocks left out in turn.
#[must_use]
pub fn ratio_of(before: &[f64], after: &[f64], sizes: &[f64]) -> (f64, f64, [f64; 2]) {
    let total = |v: &[f64]| v.iter().sum::<f64>();
    let (b, a, n) = (total(before), total(after), total(sizes));
    let log = |b: f64, a: f64| 0.5 * (b.max(1e-300) / a.max(1e-300)).ln();
    let centre = log(b, a);
    let count = before.len() as f64;
    let left_out: Vec<f64> = before.iter().zip(after).map(|(x, y)| log(b - x, a - y)).collect();
    let mean = total(&left_out) / count;
    let variance = (count - 1.0) / count * left_out.iter().map(|l| (l - mean).powi(2)).sum::<f64>();
    let half = 2.07 * variance.sqrt();
    ((b / n).sqrt(), (a / n).sqrt(), [(centre - half).exp(), (centre + half).exp()])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::{Effect, Machine};
    use crate::plant::moves::{Moves, Reach};
    use crate::plant::simulate::{Setup, simulate};
    use crate::recording::{Column, Recording};

    #[test]
    fn machines_are_compared_in_stretches_of_all_of_a_long_recording() {
        let axis = Machine::parse(include_str!("../../examples/machines/believed.json")).unwrap().axes.remove(0);
        let reach = Reach { start: 20.0, stroke: 200.0, speed: 250.0, acceleration: 2500.0 };
        let command = Moves::built_in("test", &reach).unwrap().command(1e-3);
        let trace = simulate(&axis, &command, &Setup::default()).unwrap();
        let columns = vec![Column::new("x.position_mm", trace.position), Column::new("x.torque_nm", trace.torque)];
        let whole = Observed::of(&Recording::from_columns("simulated", trace.time_s, columns).unwrap(), &axis).unwrap();
        let rows = whole.time_s.len();
        assert!(rows > 2 * ROWS_OF_STRETCHES, "{rows}");
        // A gap of a second in the middle.
        let gap = rows / 2..rows / 2 + 1000;
        let broken = Observed { runs: vec![0..gap.start, gap.end..rows], ..whole.clone() };
        let few = in_stretches(&broken);
        let known: usize = few.runs.iter().map(Range::len).sum();
        assert!((ROWS_OF_STRETCHES - gap.len()..=ROWS_OF_STRETCHES).contains(&known), "{known}");
        assert!(few.runs.iter().all(|run| run.end <= gap.start || run.start >= gap.end));
        assert!(few.runs.first().unwrap().start == 0 && few.runs.last().unwrap().end == rows);
        // A short one is taken whole.
        let short =
            Observed { runs: vec![0..rows], time_s: whole.time_s[..ROWS_OF_STRETCHES].to_vec().into(), ..whole };
        assert_eq!(in_stretches(&short).runs, short.runs);
        let away = predict_torque(&axis, &few).unwrap();
        assert!(torque_errors(&few, &away).iter().filter(|error| error.is_finite()).count() > 1000);
    }

    #[test]
    fn without_a_servo_the_table_is_told_behind_the_measured_motor() {
        let mut believed =
            Machine::parse(include_str!("../../examples/machines/believed.json")).unwrap().axes.remove(0);
        let clearance = Effect::Backlash {
            width_um: 20.0,
            table_inertia_share: 0.4,
            table_friction_share: 0.6,
            contact_hz: 700.0,
            contact_damping_ratio: 0.3,
        };
        let reach = Reach { start: 20.0, stroke: 200.0, speed: 250.0, acceleration: 2500.0 };
        let mut command = Moves::built_in("test", &reach).unwrap().command(1e-3);
        command.truncate(15_000);
        let trace = simulate(&believed.with_effects(vec![clearance]), &command, &Setup::default()).unwrap();
        let columns = vec![
            Column::new("x.position_mm", trace.position),
            Column::new("x.table_position_mm", trace.table_position),
            Column::new("x.torque_nm", trace.torque),
        ];
        believed.servo = None;
        let recording = Recording::from_columns("simulated", trace.time_s, columns).unwrap();
        let observed = Observed::of(&recording, &believed).unwrap();
        let of = |axis: &Axis| errors(axis, &observed, &ByServo::of(axis, &observed)).unwrap();
        let [before, after] = [&believed, &believed.with_effects(vec![clearance])].map(of);
        let gains = gains(&believed, &before, &after, Over::All);
        let [torque, table] = gains.as_slice() else { panic!("{gains:?}") };
        assert!(torque.channel == "torque" && table.channel == "table_position", "{gains:?}");
        // Half of the clearance either way, which crosses it at a turn. Where in it the table lies at first nobody knows.
        assert!((0.008..0.012).contains(&table.before) && table.after < 0.3 * table.before, "{table:?}");
    }
}
