//! Inertia and friction of a spindle from a recording of its torque and speed.
//!
//! The same blocks and fit as on the cycle (`cycle::inertia`), fed row by row. The block length follows from the
//! recording: short enough for the ramps in it, long enough that the acceleration stands out of the speed's noise.

use std::fmt;

use super::statistics::{grid, white_noise};
use crate::cycle::inertia::blocks::{BLOCKS, Block, Gate, Gather};
use crate::cycle::inertia::fit::Question;
use crate::cycle::inertia::report::InertiaReport;
use crate::error::{Fault, GIB_ERR_INERTIA_EXCITATION, status_text};
use crate::recording::{Column, Recording, RecordingError, Signal, Unit};

/// What is known beside the recording. `None` and 0: not known.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Channel of the spindle.
    pub channel: String,
    /// Torque constant, N·m/A: torque is current × constant in place of the torque column.
    pub torque_constant: Option<f64>,
    /// Torque at 100 % load, N·m: torque is load × this in place of the torque column.
    pub rated_torque_nm: Option<f64>,
    /// Speed above which the field is weakened, rpm.
    pub base_speed_rpm: Option<f64>,
    /// Torque above which the motor saturates, N·m.
    pub saturation_nm: Option<f64>,
    /// Time left out after standing still and after the torque changes its sense, s.
    pub takeup_s: f64,
    /// The machine's own inertia and its expanded uncertainty, kg·m².
    pub own: [f64; 2],
    /// Expanded uncertainty wanted, as a share of the inertia.
    pub target: f64,
    /// Process step that the value belongs to, 0: the whole program.
    pub process_step: i32,
}

impl Default for Options {
    fn default() -> Options {
        Options {
            channel: "spindle".into(),
            torque_constant: None,
            rated_torque_nm: None,
            base_speed_rpm: None,
            saturation_nm: None,
            takeup_s: 0.1,
            own: [0.0; 2],
            target: 0.05,
            process_step: 0,
        }
    }
}

/// What a recording says about the inertia.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// Values, uncertainties, the ramp that would do better.
    pub report: InertiaReport,
    /// Why the inertia cannot be used; `None` when it can.
    pub refused: Option<Refusal>,
    /// The equations that were fitted.
    pub blocks: Vec<Block>,
    /// Length of a block, s.
    pub block_s: f64,
    /// Header of the column that the torque is from.
    pub torque_column: String,
}

/// Why an inertia cannot be used.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Refusal(pub Fault);

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Fault { code, field, value, high, low } = self.0;
        write!(f, "{}", status_text(code).trim_end_matches('\0'))?;
        match field.trim_end_matches('\0') {
            "uncertainty_ratio" if value.is_finite() => {
                write!(
                    f,
                    ": its uncertainty is {:.0} % of it, at most {:.0} % make a value",
                    100.0 * value,
                    100.0 * high
                )
            }
            "acceleration_noise_ratio" => write!(f, ": the acceleration is lost in the noise of the speed"),
            "blocks" => write!(f, ": {value:.0} stretches can be used, {low:.0} are needed"),
            "torque_stuck_blocks" => {
                write!(f, ": the torque stays what it is while the spindle speeds up and slows down")
            }
            "torque_over_noise" => write!(f, ": the torque is nothing but noise"),
            "blocks_dropped_ratio" => {
                write!(
                    f,
                    ": {:.0} % of the stretches contradict the others, at most {:.0} % may",
                    100.0 * value,
                    100.0 * high
                )
            }
            "blocks_left_out_short_ratio" => write!(
                f,
                ": of the stretches left out as weakened or saturated {:.0} % show less torque than the others ask for, not more",
                100.0 * value
            ),
            "halves_apart_ratio" => {
                write!(f, ": the two halves of the recording differ by {:.0} % of the inertia", 100.0 * value)
            }
            "paces_apart_ratio" => write!(
                f,
                ": brisk and gentle ramps differ by {:.0} % of the inertia, as where a motor saturates; use gentler ones",
                100.0 * value
            ),
            "own_inertia_kg_m2" => write!(f, ": {high:.6} kg·m² in all, {value:.6} kg·m² given as its own"),
            _ => Ok(()),
        }
    }
}

/// Fewest samples in a block: below, the median of three makes neighbours too alike.
const SHORTEST: usize = 8;

/// Measures inertia and friction.
///
/// # Errors
/// A column that is missing or of another quantity, options out of range.
pub fn measure(recording: &Recording, options: &Options) -> Result<Found, RecordingError> {
    check(recording, options)?;
    let channel = &options.channel;
    let speed_column = recording.column(channel, Signal::Speed)?;
    let (torque_column, unit, torque_nm) = torque_source(recording, options)?;
    let wrong = |name: &str| RecordingError::new(&recording.file, "has another quantity's unit").in_column(name);
    let speed = speed_column.to(Unit::Rpm).ok_or_else(|| wrong(&speed_column.name))?;
    let torque = torque_column.to(unit).ok_or_else(|| wrong(&torque_column.name))?;

    let period = recording.sampling.period_s;
    let gate = Gate {
        standstill: standstill(&speed),
        base: options.base_speed_rpm.unwrap_or(f64::MAX),
        saturation: options.saturation_nm.map_or(f64::MAX, |nm| nm / torque_nm),
        takeup: (options.takeup_s / period).round() as u32,
    };
    let runs = recording.runs(&[speed_column, torque_column]);
    let (target, own, process_step) = (options.target, options.own, options.process_step);
    let mut length = (recording.rows() * 5 / (BLOCKS * 4)).max(SHORTEST);
    loop {
        let mut gather = Gather::new(gate, length as u32, period, torque_nm, false);
        for run in &runs {
            gather.leave_out(2); // the median of three is full of the stretch before
            for (speed, torque) in uniform(recording, &speed, &torque, run.clone()) {
                gather.add(speed, torque);
            }
        }
        let (torque_step, speed_step) = (gather.torque_step(), gather.speed_step());
        let question = Question { sample_s: period, torque_step, speed_step, target, own, process_step };
        let (all, used, _) = gather.blocks();
        let blocks = all[..used].to_vec();
        let (report, verdict) = InertiaReport::of(&blocks, length as u32, &question);
        let refused = verdict.err().map(Refusal);
        // Lost in the noise of the speed: blocks of twice the length calm the acceleration by 2√2.
        let noisy = |fault: Fault| fault.code == GIB_ERR_INERTIA_EXCITATION && fault.field.starts_with("acceleration");
        if refused.is_some_and(|Refusal(fault)| noisy(fault)) && used > 40 {
            length *= 2;
            continue;
        }
        let block_s = length as f64 * period;
        return Ok(Found { report, refused, blocks, block_s, torque_column: torque_column.name.clone() });
    }
}

/// The column that torque is from, the unit to take it in, and N·m per unit of it: what the options say; else what the drive
/// delivered; else what it was asked for.
fn torque_source<'a>(recording: &'a Recording, options: &Options) -> Result<(&'a Column, Unit, f64), RecordingError> {
    let channel = &options.channel;
    if let Some(constant) = options.torque_constant {
        return Ok((recording.column(channel, Signal::Current)?, Unit::A, constant));
    }
    if let Some(rated) = options.rated_torque_nm {
        let load = recording.column(channel, Signal::Load)?;
        if !load.values.iter().any(|percent| *percent < 0.0) {
            let message = "is never below 0, so that braking cannot be told from driving: record the torque, or a load with a sign";
            return Err(RecordingError::new(&recording.file, message).in_column(&load.name));
        }
        return Ok((load, Unit::Percent, rated / 100.0));
    }
    let known = [Signal::Torque, Signal::TorqueCommand].into_iter().find_map(|signal| recording.get(channel, signal));
    if let Some(column) = known {
        return Ok((column, Unit::Nm, 1.0));
    }
    let there = |signal| recording.get(channel, signal).map(|column| column.name.as_str());
    let how = match (there(Signal::Current), there(Signal::Load)) {
        (Some(name), _) => format!("{name} will do with the torque constant (--torque-constant)"),
        (None, Some(name)) => format!("{name} will do with the torque at 100 % (--rated-torque)"),
        (None, None) => return recording.column(channel, Signal::Torque).map(|column| (column, Unit::Nm, 1.0)),
    };
    Err(RecordingError::new(&recording.file, format!("there is no column {channel}.torque_nm, and {how}")))
}

fn check(recording: &Recording, options: &Options) -> Result<(), RecordingError> {
    let positive = |name: &str, value: Option<f64>| match value {
        Some(value) if !(value > 0.0 && value.is_finite()) => {
            Err(RecordingError::new(&recording.file, format!("{name} is {value}; it must be a number above 0")))
        }
        _ => Ok(()),
    };
    let not_negative = |name: &str, value: f64| match value {
        value if value >= 0.0 && value.is_finite() => Ok(()),
        _ => Err(RecordingError::new(&recording.file, format!("{name} is {value}; it must be 0 or more"))),
    };
    positive("the torque constant", options.torque_constant)?;
    positive("the rated torque", options.rated_torque_nm)?;
    positive("the base speed", options.base_speed_rpm)?;
    positive("the saturation torque", options.saturation_nm)?;
    positive("the uncertainty wanted", Some(options.target))?;
    not_negative("the take-up time", options.takeup_s)?;
    not_negative("the machine's own inertia", options.own[0])?;
    not_negative("its uncertainty", options.own[1])
}

/// Speed in rpm below which grid and noise could be all there is.
fn standstill(speed: &[f64]) -> f64 {
    let noise = white_noise(speed).unwrap_or(0.0);
    (5.0 * noise).max(2.0 * grid(speed).unwrap_or(0.0)).max(1.0)
}

/// Speed and torque of a stretch on equal steps: as recorded where the rows are regular, else interpolated.
fn uniform<'a>(
    recording: &'a Recording,
    speed: &'a [f64],
    torque: &'a [f64],
    run: std::ops::Range<usize>,
) -> Box<dyn Iterator<Item = (f64, f64)> + 'a> {
    if recording.sampling.regular {
        return Box::new(run.map(|row| (speed[row], torque[row])));
    }
    let time = &recording.time_s;
    let period = recording.sampling.period_s;
    let (first, last) = (time[run.start], time[run.end - 1]);
    let mut row = run.start;
    Box::new((0..).map(move |i| first + f64::from(i) * period).take_while(move |t| *t <= last).map(move |t| {
        while row + 2 < run.end && time[row + 1] < t {
            row += 1;
        }
        let share = (t - time[row]) / (time[row + 1] - time[row]);
        let between = |values: &[f64]| values[row] + share * (values[row + 1] - values[row]);
        (between(speed), between(torque))
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::rpm_from_rad_s;

    /// Trapezoids of speed at J 0.4, Tc 3, B 0.02, in the columns and units given.
    fn spindle(time: impl Fn(usize) -> f64, current: bool, sense: f64) -> Recording {
        let (j, tc, b, dt) = (0.4, 3.0, 0.02, 1e-3);
        let mut omega = 0.0f64;
        let (mut times, mut speeds, mut torques) = (vec![], vec![], vec![]);
        let mut at = 0.0;
        let mut state = 9u64;
        for i in 0..12_000 {
            let acceleration = match at % 6.0 {
                t if t < 2.0 => 60.0,
                t if (3.0..5.0).contains(&t) => -55.0,
                _ => 0.0,
            };
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let noise = (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
            let torque = if omega > 0.0 { j * acceleration + tc + b * omega } else { 0.0 };
            times.push(time(i));
            speeds.push(sense * rpm_from_rad_s(omega));
            torques.push(sense * (torque + 2.0 * noise) / if current { 1.5 } else { 1.0 });
            let next = if i + 1 < 12_000 { time(i + 1) } else { time(i) + dt };
            omega = (omega + acceleration * (next - time(i))).max(0.0);
            at = next;
        }
        let name = if current { "spindle.current_a" } else { "spindle.torque_nm" };
        let columns = vec![Column::new("spindle.speed_rpm", speeds), Column::new(name, torques)];
        Recording::from_columns("test", times, columns).unwrap()
    }

    #[test]
    fn torque_or_current_either_sense_regular_or_not() {
        let even = |i: usize| i as f64 * 1e-3;
        let uneven = |i: usize| i as f64 * 1e-3 + 4e-4 * (i as f64 * 1.7).sin();
        let current = Options { torque_constant: Some(1.5), ..Options::default() };
        for (recording, options) in [
            (spindle(even, false, 1.0), Options::default()),
            (spindle(even, true, -1.0), current),
            (spindle(uneven, false, 1.0), Options::default()),
        ] {
            let found = measure(&recording, &options).unwrap();
            assert_eq!(found.refused, None);
            let InertiaReport { total_kg_m2: j, coulomb_nm, viscous_nm_s, .. } = found.report;
            assert!((j / 0.4 - 1.0).abs() < 0.01, "{:?}", found.report);
            assert!((coulomb_nm - 3.0).abs() < 0.2 && (viscous_nm_s - 0.02).abs() < 0.003, "{:?}", found.report);
        }
    }

    #[test]
    fn a_missing_column_and_a_wrong_option_are_named() {
        let recording = spindle(|i| i as f64 * 1e-3, true, 1.0);
        let error = measure(&recording, &Options::default()).unwrap_err().to_string();
        assert!(error.contains("spindle.torque_nm"), "{error}");
        let options = Options { torque_constant: Some(-1.0), ..Options::default() };
        assert!(measure(&recording, &options).unwrap_err().to_string().contains("torque constant"));
    }

    /// The same torque as asked for, or in percent of 20 N·m; what was delivered goes before what was asked for.
    #[test]
    fn torque_asked_for_or_load_with_its_rated_torque() {
        let named = |name: &str, scale: f64| {
            let mut recording = spindle(|i| i as f64 * 1e-3, false, 1.0);
            let values = recording.columns[1].values.iter().map(|torque| scale * torque).collect();
            recording.columns[1] = Column::new(name, values);
            recording
        };
        let rated = Options { rated_torque_nm: Some(20.0), ..Options::default() };
        let (asked_for, load) = (named("spindle.torque_command_nm", 1.0), named("spindle.load_percent", 5.0));
        for (recording, options) in [(&asked_for, &Options::default()), (&load, &rated)] {
            let found = measure(recording, options).unwrap();
            assert!(found.refused.is_none() && (found.report.total_kg_m2 / 0.4 - 1.0).abs() < 0.01, "{found:?}");
            assert_eq!(found.torque_column, recording.columns[1].name);
        }
        let mut both = named("spindle.torque_nm", 1.0);
        both.columns.push(Column::new("spindle.torque_command_nm", vec![0.0; both.rows()]));
        assert_eq!(measure(&both, &Options::default()).unwrap().torque_column, "spindle.torque_nm");
        let refused = |recording: &Recording, options: &Options| measure(recording, options).unwrap_err().to_string();
        assert!(refused(&load, &Options::default()).contains("--rated-torque"));
        assert!(refused(&named("spindle.current_a", 1.0), &Options::default()).contains("--torque-constant"));
        assert!(refused(&asked_for, &rated).contains("spindle.load_percent"));
        let mut rectified = load.clone();
        rectified.columns[1].values.iter_mut().for_each(|percent| *percent = percent.abs());
        assert!(refused(&rectified, &rated).contains("never below 0"));
        let none = Options { rated_torque_nm: Some(0.0), ..Options::default() };
        assert!(refused(&load, &none).contains("rated torque"));
    }

    /// A motor that reports more torque than it delivers beyond 15 N·m reads as another inertia at one acceleration, and is said
    /// to be possible; a second acceleration finds it out.
    #[test]
    fn one_acceleration_cannot_exclude_saturation() {
        let saturated = |gentle: f64| {
            let (mut omega, mut columns) = (0.0f64, [vec![], vec![], vec![]]);
            for i in 0..24_000 {
                let t = f64::from(i) * 1e-3;
                let scale = if t < 12.0 { 1.0 } else { gentle };
                let acceleration = scale
                    * if t % 6.0 < 2.0 {
                        60.0
                    } else if (3.0..5.0).contains(&(t % 6.0)) {
                        -60.0
                    } else {
                        0.0
                    };
                let torque = if omega > 0.0 { 0.4 * acceleration + 3.0 + 0.02 * omega } else { 0.0 };
                let beyond = (torque.abs() - 15.0).max(0.0).copysign(torque);
                let noise = 0.3 * (f64::from(i) * 2.39).sin();
                let row = [t, rpm_from_rad_s(omega), torque + beyond + noise];
                columns.iter_mut().zip(row).for_each(|(column, value)| column.push(value));
                omega = (omega + acceleration * 1e-3).max(0.0);
            }
            let [times, speeds, torques] = columns;
            let columns = vec![Column::new("spindle.speed_rpm", speeds), Column::new("spindle.torque_nm", torques)];
            measure(&Recording::from_columns("test", times, columns).unwrap(), &Options::default()).unwrap()
        };
        let (one, two) = (saturated(1.0), saturated(0.4));
        println!("{:.3} of 0.4 at one acceleration, {:.3} at two", one.report.total_kg_m2, two.report.total_kg_m2);
        assert!(one.report.one_acceleration == 1 && two.report.one_acceleration == 0);
        assert!((one.report.total_kg_m2 / 0.4 - 1.0).abs() > 0.05, "{:?}", one.report);
        assert!(two.report.saturation_nm > 0.0 || two.refused.is_some(), "{:?}", two.report);
        assert!(two.refused.is_some() || (two.report.total_kg_m2 / 0.4 - 1.0).abs() < 0.02, "{:?}", two.report);
    }

    /// A sign that is turned round is told, not averaged away.
    #[test]
    fn torque_of_the_wrong_sign_is_refused() {
        let mut recording = spindle(|i| i as f64 * 1e-3, false, 1.0);
        recording.columns[1].values.iter_mut().for_each(|torque| *torque = -*torque);
        let found = measure(&recording, &Options::default()).unwrap();
        assert_eq!(found.refused.unwrap().0.code, crate::error::GIB_ERR_INERTIA_SIGN);
    }

    /// HSM150, a real servo motor: the published 1.2e-4 kg·m² lies in the interval, and T/ω' alone is far off.
    #[test]
    fn a_real_motor() {
        let data = std::env::var("GIB_DATA").unwrap_or(format!("{}/../shared/data", env!("CARGO_MANIFEST_DIR")));
        let path = std::path::Path::new(&data).join("hsm150/torque_step.csv");
        let Ok(recording) = Recording::open(&path) else {
            println!("{}: not here, skipped", path.display());
            return;
        };
        let found = measure(&recording, &Options::default()).unwrap();
        let report = found.report;
        println!(
            "J {:.3e} ± {:.1e} kg·m², T/ω' alone {:.3e}",
            report.total_kg_m2, report.total_uncertainty_kg_m2, report.naive_kg_m2
        );
        assert_eq!(found.refused, None, "{report:?}");
        assert!((report.total_kg_m2 - 1.2e-4).abs() <= report.total_uncertainty_kg_m2, "{report:?}");
        assert!((0.03..0.33).contains(&(report.total_uncertainty_kg_m2 / report.total_kg_m2)), "{report:?}");
        assert!(report.naive_kg_m2 > 3.0 * 1.2e-4, "{report:?}");
        assert!((report.viscous_nm_s - 7.03e-5).abs() < 2e-5, "{report:?}");
    }
}
