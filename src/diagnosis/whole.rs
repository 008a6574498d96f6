//! Every row of a recording, as gains and replayed loops take it: worked out once, when somebody asks.

use super::frame::Columns;
use crate::machine::Axis;
use crate::plant::added::ByServo;
use crate::plant::observed::Observed;
use once_cell::sync::OnceCell;

/// A recording of an axis.
pub struct Whole<'d> {
    /// Its columns.
    pub columns: &'d Columns,
    axis: &'d Axis,
    recording: OnceCell<Option<(Observed, ByServo)>>,
}

impl<'d> Whole<'d> {
    /// Of an axis with this drive and servo, whatever its effects.
    #[must_use]
    pub fn new(axis: &'d Axis, columns: &'d Columns) -> Self {
        Self { columns, axis, recording: OnceCell::new() }
    }

    /// What it shows of the axis, and of its servo; `None` where nothing can be predicted.
    #[must_use]
    pub fn recording(&self) -> Option<(&Observed, &ByServo)> {
        let work_out = || {
            let observed = self.columns.observed()?;
            let servo = ByServo::of(self.axis, &observed);
            Some((observed, servo))
        };
        self.recording.get_or_init(work_out).as_ref().map(|(observed, servo)| (observed, servo))
    }
}
