//! One axis of a recording in the units of the model, with its motion worked out once.
//!
//! Where few rows are lost the motion goes on, and so does what is simulated along it: such rows are put in between.

use super::bridges::{Bridges, Filled};
use super::motion::{FEWEST_ROWS, Motion};
use super::stamps::times_of_rows;
use crate::machine::{Axis, Servo};
use crate::recording::{Recording, RecordingError, Signal, Unit};
use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;

/// Share by which the period of rows may differ from that of cycles: no two periods of a control are closer, and no two clocks differ as much.
const SAME_PERIOD: f64 = 1e-3;

/// What a recording shows of one axis. All columns have one value a row.
#[derive(Debug, Clone, PartialEq)]
pub struct Observed {
    /// When the rows were taken, s: as recorded, or evenly where the motion says so ([`times_of_rows`]).
    pub time_s: Arc<Vec<f64>>,
    /// Mean time between rows, s.
    pub period_s: f64,
    /// Load units (mm; degree for rotary).
    pub position: Vec<f64>,
    /// Drive's own unit (N·m or N); NaN where the recording has none.
    pub torque: Vec<f64>,
    /// Load units.
    pub command: Option<Vec<f64>>,
    /// Load units.
    pub table_position: Option<Vec<f64>>,
    /// Stretches of rows without gap or jump in the position, long enough for a motion.
    pub runs: Vec<Range<usize>>,
    /// Motion of those stretches; NaN in rows outside them.
    pub motion: Motion,
    /// Rows whose position is filled in by those beside them, in order.
    pub filled: Vec<Filled>,
}

impl Observed {
    /// Whether there is one row a cycle of a servo, and no gap.
    #[must_use]
    pub fn is_a_row_a_cycle(&self, servo: &Servo) -> bool {
        (self.period_s / servo.period_s - 1.0).abs() < SAME_PERIOD && self.runs.first() == Some(&(0..self.time_s.len()))
    }

    /// The same rows of a motor that moves along other positions, known as far as the measured ones are; nothing else is known of it.
    #[must_use]
    pub fn moving_along(&self, position: &[f64]) -> Observed {
        Observed {
            time_s: self.time_s.clone(),
            period_s: self.period_s,
            position: Vec::new(),
            torque: Vec::new(),
            command: None,
            table_position: None,
            runs: self.runs.clone(),
            motion: self.motion.like_this(&self.time_s, position),
            filled: Vec::new(),
        }
    }

    /// The axis's columns of a recording.
    ///
    /// # Errors
    /// Position or torque (force) is missing or in a unit of another quantity; no stretch of rows is whole.
    pub fn of(recording: &Recording, axis: &Axis) -> Result<Observed, RecordingError> {
        Self::taken(&mut recording.clone(), axis)
    }

    /// The same, taken out of the recording: long ones have no room for a copy.
    ///
    /// # Errors
    /// As [`Observed::of`].
    pub fn taken(recording: &mut Recording, axis: &Axis) -> Result<Observed, RecordingError> {
        let load_unit = if axis.drive.is_rotary() { Unit::Deg } else { Unit::Mm };
        let (torque_signal, torque_unit) =
            if axis.drive.is_linear() { (Signal::Force, Unit::N) } else { (Signal::Torque, Unit::Nm) };
        let factor = |signal: Signal, unit: Unit| {
            let column = recording.column(&axis.name, signal)?;
            column.label.as_ref().and_then(|label| label.unit.factor_to(unit)).ok_or_else(|| {
                let drive = axis.drive.name();
                let message = format!(
                    "must be in {} or a unit that converts to it: the machine's drive is {drive}",
                    unit.suffix()
                );
                RecordingError::new(&recording.file, message).in_column(&column.name)
            })
        };
        let optional = |signal| recording.get(&axis.name, signal).map(|_| factor(signal, load_unit)).transpose();
        let (position, torque) = (factor(Signal::Position, load_unit)?, factor(torque_signal, torque_unit)?);
        let (command, table) = (optional(Signal::PositionCommand)?, optional(Signal::TablePosition)?);
        let encoder = recording.column(&axis.name, Signal::Position)?;
        let bridges = Bridges::over(recording, encoder);
        let mut take = |signal: Signal, factor: f64| {
            let mut values = recording.take(&axis.name, signal).map_or_else(Vec::new, |column| column.values);
            if factor != 1.0 {
                values.iter_mut().for_each(|value| *value *= factor);
            }
            bridges.make_room(&mut values);
            values
        };
        let (mut position, torque) = (take(Signal::Position, position), take(torque_signal, torque));
        let mut command = command.map(|factor| take(Signal::PositionCommand, factor));
        let mut table = table.map(|factor| take(Signal::TablePosition, factor));
        bridges.fill_in(&mut position, command.as_mut(), table.as_mut(), recording.sampling.period_s);
        let Bridges { runs, filled, time_s, .. } = bridges;
        let observed = Self::from_columns(time_s, position, torque, command, table, runs);
        let observed = observed.map(|observed| Self { filled, ..observed });
        observed.ok_or_else(|| {
            let message = format!(
                "axis {} has no {FEWEST_ROWS} rows in a row without gap, jump or empty cell in its position",
                axis.name
            );
            RecordingError::new(&recording.file, message)
        })
    }

    /// The same from columns in the units of the model; `None` when no run is long enough.
    #[must_use]
    pub fn from_columns(
        time_s: impl Into<Arc<Vec<f64>>>,
        position: Vec<f64>,
        torque: Vec<f64>,
        command: Option<Vec<f64>>,
        table_position: Option<Vec<f64>>,
        mut runs: Vec<Range<usize>>,
    ) -> Option<Observed> {
        let mut time_s = time_s.into();
        runs.retain(|run| run.len() >= FEWEST_ROWS && run.end <= position.len());
        for run in &runs {
            if let Cow::Owned(even) = times_of_rows(&time_s[run.clone()], &position[run.clone()]) {
                Arc::make_mut(&mut time_s)[run.clone()].copy_from_slice(&even);
            }
        }
        let longest = runs.iter().max_by_key(|run| run.len())?.clone();
        let period_s = (time_s[longest.end - 1] - time_s[longest.start]) / (longest.len() - 1) as f64;
        let motion = Motion::of_stretches(&time_s, &position, &runs)?;
        Some(Observed { time_s, period_s, position, torque, command, table_position, runs, motion, filled: Vec::new() })
    }

    /// The rows that stand in the recording, in order, and whether their position does.
    pub fn recorded(&self) -> impl Iterator<Item = (usize, bool)> {
        let mut filled = self.filled.iter().peekable();
        (0..self.position.len()).filter_map(move |row| {
            while filled.next_if(|filled| filled.rows.end <= row).is_some() {}
            match filled.peek().filter(|filled| filled.rows.contains(&row)) {
                Some(filled) => filled.recorded.then_some((row, false)),
                None => Some((row, true)),
            }
        })
    }
}
