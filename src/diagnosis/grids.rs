//! What the grids of encoder and scale make of themselves.
//!
//! A reading on a grid g is off by e(x) = Σ g/(π·k)·sin(2π·k·x/g), k = 1, 2, …, and its offset is anybody's. Rows taken at one
//! speed meet that sawtooth at nearly the same place of each step: it beats, and what is far finer than a row seems to repeat
//! every some millimetres, or to grow along the stroke. How much of it falls on a trace c is the trace's sum over the rows as
//! they were passed, |Σ c·e^(2πi·k·x/g)|: little where they fall evenly on the grid, all of g/π where they beat with the trace.
//! Noise σ on the reading takes e^(−2π²·k²·σ²/g²) off it (Widrow and Kollár 2008).

use super::filter::{LowPass, convolve, norm};
use super::fit::{Bench, Fit, orthonormal};
use super::frame::{Columns, Frame};
use super::many::{add, dot, sines_and_cosines};
use crate::analysis::statistics;
use crate::machine::Cause;
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::PI;
use std::ops::Range;

/// Terms of the sawtooth.
const TERMS: usize = 3;
/// Over how many widths of the filter a place on the grid is smoothed; odd.
const WIDE: usize = 9;
/// Where a grid may lie, in steps: its offset is anybody's.
const OFFSETS: [f64; 4] = [0.07, 0.31, 0.53, 0.84];
/// How much larger than what the grids make a cause must be. Places on the grid are known to a fifth of a step or so, which
/// takes up to half off the sums.
const SURELY: f64 = 2.0;

/// Rows before one that its answer is read off with it: the speeds of three rows, over which a servo's filters may spread it, each by a row
/// before, and second differences of those.
const ROWS_OF_ANSWER: usize = 5;

/// What the encoder's grid makes in the torque balance through the inertia, RMS over the judged rows, drive's own unit, beyond
/// what the second differences of a noise floor see of it: a speed at which rows meet the grid at nearly the same place makes a
/// tone below the filter, and looks like a torque.
#[must_use]
pub fn unseen_by_floor(frame: &Frame) -> f64 {
    let made = through_inertia(frame);
    (mean_square(&made) - frame.floor(&made, true).powi(2)).max(0.0).sqrt()
}

/// What the encoder's grid makes in the torque balance through the inertia, at the judged rows as they count; nothing without a
/// grid.
fn through_inertia(frame: &Frame) -> Vec<f64> {
    let columns = frame.columns;
    let encoder = Sensor::encoder(columns);
    if encoder.grid <= 0.0 {
        return Vec::new();
    }
    let error = Place::of(frame, &columns.position).error_of(&encoder, 0.0);
    let per = frame.belief.inertia * frame.unit / columns.period_s.powi(2);
    let bend = |i: usize| match error.get(i.wrapping_sub(1)..i + 2) {
        Some(&[before, at, after]) => per * (after - 2.0 * at + before),
        _ => 0.0,
    };
    let mut made = frame.low_passed(&(0..error.len()).map(bend).collect::<Vec<_>>());
    made.iter_mut().zip(&frame.weights).for_each(|(made, weight)| *made *= weight);
    made
}

/// Mean square of what readings that are off each by itself make there.
fn of_readings_through_inertia(frame: &Frame) -> f64 {
    let per = frame.belief.inertia * frame.unit / frame.columns.period_s.powi(2);
    let bends = convolve(&frame.low_pass.kernel(), &[1.0, -2.0, 1.0]);
    (per * statistics::reading_error(&frame.columns.position) * norm(&bends)).powi(2)
}

/// Mean square of what the encoder makes in the torque balance through the inertia: by its grid as rows beat with it, or by what a reading is
/// off by from row to row, whichever makes more.
#[must_use]
pub fn made_of_readings(frame: &Frame) -> f64 {
    mean_square(&through_inertia(frame)).max(of_readings_through_inertia(frame))
}

/// By how much the torque column may seem early by what the encoder is off by, s. The servo answers to that error e with −Kv·ė,
/// whose slope goes with the J·ë that the balance has of it: Kv/J·mean (J·ë)² over mean Ṫ², where e is the grid's as rows beat with
/// it, or what a reading is off by from row to row, whichever makes more. A servo that nobody knows shows its Kv by its answer.
#[must_use]
pub fn delay_s(frame: &Frame) -> f64 {
    let velocity_gain = frame.axis.servo.as_ref().map_or_else(|| answer(frame), |servo| servo.velocity_gain);
    let half = 0.5 * frame.columns.period_s;
    let (after, before) = (frame.torque(half), frame.torque(-half));
    let sides = after.iter().zip(&before).zip(&frame.weights);
    let slope: Vec<f64> = sides.map(|((after, before), weight)| weight * (after - before) / (2.0 * half)).collect();
    let made = made_of_readings(frame);
    velocity_gain / frame.belief.inertia * made / mean_square(&slope).max(1e-300)
}

/// How much of the torque answers to a speed that the encoder reads, by what is so fast that the axis does not follow it: second differences of
/// both, over the rows in which a servo may have filtered it. As a velocity gain, positive; 0 where there is no such answer.
fn answer(frame: &Frame) -> f64 {
    let columns = frame.columns;
    let per = frame.unit / columns.period_s;
    let fast = |values: &[f64], row: usize| values[row] - 2.0 * values[row - 1] + values[row - 2];
    let speed = |row: usize| per * (fast(&columns.position, row) - fast(&columns.position, row - 1));
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    let before = |row: usize| frame.kept.partition_point(|kept| *kept < row);
    let whole = |s: &Range<usize>| before((s.start + ROWS_OF_ANSWER).min(s.end))..before(s.end);
    for &row in columns.stretches.iter().flat_map(|s| &frame.kept[whole(s)]) {
        let read = Vector3::from_fn(|late, _| speed(row - late));
        normal += read * read.transpose();
        right += read * fast(&columns.torque, row);
    }
    normal.try_inverse().map_or(0.0, |inverse| -(inverse * right).sum()).max(0.0)
}

/// What the grids of encoder and scale make in table − encoder, RMS over the judged rows, load units; 0 without a scale. It
/// averages out where many steps pass within the filter, and stands where rows beat with the grid or the axis creeps: as far as
/// a row's own step that is taken for granted, since the place is not known to a part of a step there.
#[must_use]
pub fn in_table(frame: &Frame) -> f64 {
    let columns = frame.columns;
    let (Some(table), Some(scale)) = (&columns.table, Sensor::scale(columns)) else { return 0.0 };
    let encoder = Sensor::encoder(columns);
    // The finer sensor knows the place better.
    let place = Place::of(frame, if scale.grid < encoder.grid { table } else { &columns.position });
    let made = |sensor: &Sensor| {
        let errors = OFFSETS.map(|offset| place.error_of(sensor, offset));
        let rows: Vec<[f64; OFFSETS.len()]> = (0..table.len()).map(|i| errors.each_ref().map(|e| e[i])).collect();
        let filtered = frame.low_passed_together(&rows);
        filtered.iter().map(|made| mean_square(made)).sum::<f64>() / OFFSETS.len() as f64
    };
    let creeping = encoder.grid.hypot(scale.grid) / (12f64.sqrt() * columns.rows_in_one());
    (made(&encoder) + made(&scale)).sqrt().max(creeping)
}

fn mean_square(values: &[f64]) -> f64 {
    dot(values, values) / values.len().max(1) as f64
}

/// Where an axis is, smoothed over many steps of a grid, so that the place does not hold the error that is asked for.
struct Place {
    /// Load units, and per row.
    rows: Vec<(f64, f64)>,
    /// Of how many recorded rows one is the mean.
    many: f64,
}

impl Place {
    fn of(frame: &Frame, readings: &[f64]) -> Self {
        let columns = frame.columns;
        let place = LowPass { width: WIDE * frame.low_pass.width }.run(readings, &columns.stretches);
        let slope = |i: usize| match place.get(i.wrapping_sub(1)..i + 2) {
            Some(&[before, _, after]) => 0.5 * (after - before),
            _ => 0.0,
        };
        Self { rows: place.iter().enumerate().map(|(i, x)| (*x, slope(i))).collect(), many: columns.rows_in_one() }
    }

    /// The error of a sensor by its grid that lies so many steps beside the place's zero, every row, load units.
    fn error_of(&self, sensor: &Sensor, offset: f64) -> Vec<f64> {
        if sensor.grid <= 0.0 {
            return vec![0.0; self.rows.len()];
        }
        let size = sensor.grid / self.many * sensor.left_of_term(1.0);
        let at = |&(x, slope): &(f64, f64)| -> f64 {
            let turns = |part: usize| (x + slope * ((part as f64 + 0.5) / self.many - 0.5)) / sensor.grid + offset;
            (0..self.many as usize).map(turns).map(|turns| size * (turns - turns.round())).sum()
        };
        self.rows.iter().map(at).collect()
    }
}

/// A part that may well be the grids': one in table − encoder, a ripple of the torque, or its delay; `without` are the fits without each
/// part.
#[must_use]
pub fn imitated(bench: &Bench, without: &[Fit], fit: &Fit) -> Option<usize> {
    imitated_torque(bench, fit).or_else(|| imitated_delay(bench, fit)).or_else(|| imitated_table(bench, without, fit))
}

/// A ripple of the torque that is no larger than what the encoder's grid makes through the inertia.
fn imitated_torque(bench: &Bench, fit: &Fit) -> Option<usize> {
    let ripple = |i: &usize| [Cause::Cogging, Cause::ExternalVibration].contains(&fit.parts[*i].law.cause);
    let least = SURELY * bench.frame.unseen / bench.floors[0];
    (0..fit.parts.len()).filter(ripple).find(|&i| {
        let own = &fit.contribution(i)[..bench.rows];
        dot(own, own) < bench.rows as f64 * least * least
    })
}

/// A delay that is no longer than what the encoder makes of itself under the servo, which goes with the square of that error. The torque then
/// seems early: late it is in spite of that.
fn imitated_delay(bench: &Bench, fit: &Fit) -> Option<usize> {
    let part = fit.parts.iter().position(|part| part.law.cause == Cause::DeadTime)?;
    let (late_s, early_s) = (1e-3 * fit.parts[part].shape[0], delay_s(bench.frame));
    (-SURELY * SURELY * early_s..early_s).contains(&late_s).then_some(part)
}

fn imitated_table(bench: &Bench, without: &[Fit], fit: &Fit) -> Option<usize> {
    let screw = |i: &usize| [Cause::ScrewPitchError, Cause::ScrewPeriodicError].contains(&fit.parts[*i].law.cause);
    (0..fit.parts.len()).filter(screw).find(|&i| {
        let less = &without[i];
        let sawtooth = sawtooth(bench, less);
        let own = cleared(fit.columns(i), less.basis());
        let squares = |values: &[f64]| own.iter().map(|c| dot(c, values).powi(2)).sum::<f64>();
        // Whatever the offset of the grid, its waves are no larger than sine and cosine together.
        let made: f64 = sawtooth.iter().map(|[sine, cosine]| (squares(sine) + squares(cosine)).sqrt()).sum();
        squares(&less.residual).sqrt() < SURELY * made || is_within_a_step(bench, fit, i)
    })
}

/// Whether a pitch error does not come to a step over the whole stroke: neither sensor has seen it.
fn is_within_a_step(bench: &Bench, fit: &Fit, part: usize) -> bool {
    let (low, high) = bench.frame.stroke();
    let along = |scale_um_m: &f64| 1e-6 * scale_um_m.abs() * (high - low);
    let steps = sensors(bench).map_or(0.0, |both| both.iter().map(|s| 0.5 * s.grid * s.left_of_term(1.0)).sum());
    fit.parts[part].law.cause == Cause::ScrewPitchError && fit.coefficients[part].first().map(along) < Some(steps)
}

/// Sine and cosine of each term of the sawtooths of encoder and scale, as large as they are, stacked and scaled, if a fit is
/// right.
fn sawtooth(bench: &Bench, fit: &Fit) -> Vec<[Vec<f64>; 2]> {
    let (frame, columns) = (bench.frame, bench.frame.columns);
    let (Some(readings), Some([encoder, scale])) = (&columns.table, sensors(bench)) else { return Vec::new() };
    let many = columns.rows_in_one();
    // A reading holds its own error, and seems to stand on its grid wherever the axis is: the place is told by the other
    // sensor, unless that is the coarser one by far.
    let (seen, apart) = (frame.low_pass.run(readings, &columns.stretches), table_beyond_encoder(bench, fit));
    let moved = |place: &[f64], way: f64| -> Vec<f64> { place.iter().zip(&apart).map(|(x, d)| x + way * d).collect() };
    let of_encoder = if scale.grid < 1.5 * encoder.grid { moved(&seen, -1.0) } else { frame.x.clone() };
    let of_scale = if encoder.grid < 1.5 * scale.grid { moved(&frame.x, 1.0) } else { seen };
    let stack = |values: Vec<f64>| -> Vec<f64> {
        let filtered = frame.low_passed(&values).into_iter().map(|v| v / bench.floors[1]);
        std::iter::repeat_n(0.0, bench.rows).chain(filtered).collect()
    };
    let mut out = Vec::new();
    for (sensor, place) in [(encoder, of_encoder), (scale, of_scale)] {
        for k in (1..=TERMS).map(|k| k as f64).take_while(|_| sensor.grid > 0.0) {
            let size = sensor.grid / (PI * k) * sensor.left_of_term(k);
            let mut waves = [vec![0.0; place.len()], vec![0.0; place.len()]];
            for part in 0..many as usize {
                let after = columns.period_s * ((part as f64 + 0.5) / many - 0.5);
                let turns = place.iter().zip(&frame.v).map(|(x, v)| k * (x + v * after) / sensor.grid);
                let (sines, cosines) = sines_and_cosines(&turns.collect::<Vec<f64>>());
                add(&mut waves[0], size / many, &sines);
                add(&mut waves[1], size / many, &cosines);
            }
            out.push(waves.map(stack));
        }
    }
    out
}

/// Encoder and scale.
fn sensors(bench: &Bench) -> Option<[Sensor; 2]> {
    let columns = bench.frame.columns;
    Some([Sensor::encoder(columns), Sensor::scale(columns)?])
}

/// A position sensor.
struct Sensor {
    /// Its grid, load units; 0 where it shows none.
    grid: f64,
    /// Noise over its steps.
    scatter: f64,
}

impl Sensor {
    fn encoder(columns: &Columns) -> Self {
        Self::of(&columns.position, columns.position_grid, columns.rows_in_one())
    }

    fn scale(columns: &Columns) -> Option<Self> {
        Some(Self::of(columns.table.as_ref()?, columns.table_grid, columns.rows_in_one()))
    }

    /// By its readings, each the mean of so many: they lie on as many parts of the grid, with so much less noise.
    fn of(readings: &[f64], grid: f64, many: f64) -> Self {
        let grid = if grid > 0.0 { many * sharpened(grid / many, readings) } else { 0.0 };
        // What the grid itself makes is no noise on it. From row to row that may swing to and fro, and look like more: noise looks
        // alike at every spacing.
        let at_spacing = |rows: usize| -> Option<f64> {
            statistics::white_noise(&readings.iter().copied().step_by(rows).collect::<Vec<f64>>())
        };
        let least = (1..=4).filter_map(at_spacing).fold(f64::INFINITY, f64::min);
        let noise = many.sqrt() * if least.is_finite() { least } else { 0.0 };
        let scatter = (noise * noise - grid * grid / 12.0).max(0.0).sqrt();
        Self { grid, scatter: if grid > 0.0 { scatter / grid } else { 0.0 } }
    }

    /// What noise leaves of a term of the sawtooth.
    fn left_of_term(&self, k: f64) -> f64 {
        (-2.0 * (PI * k * self.scatter).powi(2)).exp()
    }
}

/// How far a fit has the table beyond the encoder at every row, load units.
fn table_beyond_encoder(bench: &Bench, fit: &Fit) -> Vec<f64> {
    let (kept, mut apart) = (&bench.frame.kept, vec![0.0; bench.frame.x.len()]);
    for part in 0..fit.parts.len() {
        let traced = &fit.contribution(part)[bench.rows..];
        for (rows, ends) in kept.windows(2).zip(traced.windows(2)) {
            let slope = (ends[1] - ends[0]) / (rows[1] - rows[0]) as f64;
            for (i, apart) in apart[rows[0]..rows[1]].iter_mut().enumerate() {
                *apart += bench.floors[1] * (ends[0] + slope * i as f64);
            }
        }
    }
    apart
}

/// A grid to the digits that count the steps over the whole stroke: by how many of them readings are apart, over farther and
/// farther readings.
fn sharpened(mut grid: f64, readings: &[f64]) -> f64 {
    let Some(&first) = readings.first() else { return grid };
    let farthest = readings.iter().fold(0.0f64, |far, x| far.max((x - first).abs()));
    let mut reach = 100.0 * grid;
    while reach < 10.0 * farthest {
        let near = readings.iter().map(|x| x - first).filter(|x| x.abs() < reach);
        let (with, own) = near.fold((0.0, 0.0), |(with, own), x| {
            let steps = (x / grid).round();
            (with + x * steps, own + steps * steps)
        });
        if own > 0.0 {
            grid = with / own;
        }
        reach *= 10.0;
    }
    grid
}

/// Columns at right angles to a basis and each other, of unit length; those that the basis spans are left out.
fn cleared(columns: &[Vec<f64>], basis: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let mut all = basis.to_vec();
    for column in columns {
        let (own, weights) = orthonormal(column, &all, &[]);
        if weights[all.len()] > 0.0 {
            all.push(own);
        }
    }
    all.split_off(basis.len())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::causes::law;
    use crate::diagnosis::causes::periods::{shows_along_stroke, waves};
    use crate::diagnosis::excerpt::Excerpt;
    use crate::diagnosis::known::Known;
    use crate::machine::{Axis, Machine};
    use crate::plant::moves::Moves;
    use crate::plant::simulate::{Sensors, Setup, simulate};
    use crate::recording::{Column, Recording};

    /// Strokes over 200 mm at one speed, behind an encoder of this noise, as the machine is believed.
    fn strokes(speed: f64, noise_um: f64, asks: impl Fn(&Frame, &Frame)) {
        let rig = include_str!("../../examples/machines/believed.json");
        let known: Axis = Machine::parse(rig).unwrap().axes.remove(0);
        let stroke =
            |to: f64| format!(r#"{{"to_mm":{to},"speed_mm_s":{speed},"acceleration_mm_s2":2000}},{{"dwell_s":0.2}}"#);
        let list = (0..12).map(|k| stroke(if k % 2 == 0 { 200.0 } else { 0.0 })).collect::<Vec<_>>().join(",");
        let moves = Moves::parse(&format!(r#"{{"schema":"gib.moves/1","moves":[{{"dwell_s":0.5}},{list}]}}"#)).unwrap();
        let sensors = Sensors { grid_um: 0.02, noise_um, torque_noise: 0.01, ..Sensors::default() };
        let trace = simulate(&known, &moves.command(1e-3), &Setup { seed: 1, sensors, ..Setup::default() }).unwrap();
        let columns = vec![Column::new("x.position_mm", trace.position), Column::new("x.torque_nm", trace.torque)];
        let recording = Recording::from_columns("strokes", trace.time_s, columns).unwrap();
        let columns = Excerpt::of(&recording, &known).columns.unwrap();
        let unknown = Axis { servo: None, ..known.clone() };
        asks(&Frame::new(&known, &columns, None), &Frame::new(&unknown, &columns, None));
    }

    #[test]
    fn a_servo_that_nobody_knows_shows_its_gain_where_it_answers_noise() {
        strokes(150.0, 0.3, |known, unknown| {
            let gain = known.axis.servo.as_ref().unwrap().velocity_gain;
            // Its torque loop has not caught up within a cycle.
            assert!((0.75..1.05).contains(&(answer(unknown) / gain)), "{} of {gain}", answer(unknown));
            assert!((0.7..1.1).contains(&(delay_s(unknown) / delay_s(known))));
        });
        strokes(150.0, 0.0, |_, unknown| assert!(delay_s(unknown) < 1e-4, "{}", delay_s(unknown)));
    }

    /// The torque of a servo that answers noise seems early, never late.
    #[test]
    fn a_late_torque_is_no_answer_to_noise() {
        strokes(150.0, 0.3, |known, _| {
            let bench = Bench::new(known, &Known::of(known.axis, known));
            let is_imitated = |times: f64| {
                let delay = bench.parts(law(Cause::DeadTime), vec![vec![times * 1e3 * delay_s(known)]]);
                imitated_delay(&bench, &bench.fit(delay)).is_some()
            };
            assert_eq!([-4.5, -3.5, 0.7, 1.5].map(is_imitated), [false, true, true, false]);
        });
    }

    #[test]
    fn a_ripple_that_is_passed_too_fast_but_at_the_turns_shows_along_no_stroke() {
        strokes(187.0, 0.0, |frame, _| {
            let ripple = |period_mm: f64| frame.judged_instants(&waves(frame, 200.0 / period_mm).0);
            assert!(shows_along_stroke(frame, &ripple(2.5)) && shows_along_stroke(frame, &ripple(1.0)));
            assert!(!shows_along_stroke(frame, &ripple(0.17)));
        });
    }
}
