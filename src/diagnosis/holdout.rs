//! A recording on which nothing is fitted: what an answer is worth there, and what it leaves.

use super::belief;
use super::frame::{Columns, Frame};
use super::gain::{Gain, errors, of_both, weight_of_rows};
use super::judge::beyond_noise;
use super::progress::{Stopped, Watch};
use super::sampling::{Sampling, Timing};
use super::suffices::what_is_missing;
use super::verdict::Verdict;
use crate::machine::Axis;
use crate::plant::added::ByServo;
use crate::plant::observed::Observed;

/// Another recording than the one that is diagnosed.
pub struct Holdout {
    observed: Observed,
    /// The rows of the balance.
    thinned: Columns,
    /// What each row's torque says of a law, see [`weight_of_rows`].
    weight: Vec<f64>,
}

impl Holdout {
    /// Of every row; `None` where no stretch is long enough for a motion.
    #[must_use]
    pub fn new(axis: &Axis, columns: &Columns) -> Option<Self> {
        let (observed, base) = (columns.observed()?, belief::base_alone(axis));
        let thinned = columns.clone().thinned();
        let weight = weight_of_rows(&Frame::new(&base, &thinned, None), &observed.time_s);
        Some(Self { observed, thinned, weight })
    }

    /// The gains of an extended axis over another, and those by which a law may be refuted.
    ///
    /// # Errors
    /// [`Stopped`] when the watch's caller said so.
    pub fn gains(&self, axis: &Axis, extended: &Axis, watch: &Watch) -> Result<[Vec<Gain>; 2], Stopped> {
        let servo = ByServo::of(axis, &self.observed);
        let errors = |axis: &&Axis| errors(axis, &self.observed, &servo);
        let both = watch.each(&[axis, extended], (0.92, 0.99), "measuring the gain", errors)?;
        let [Some(before), Some(after)] = both.as_slice() else { return Ok([Vec::new(), Vec::new()]) };
        Ok(of_both(axis, [before, after], &self.weight))
    }

    /// An answer beside what its machine leaves here, and a note of it, where that is far above the noise. It is meant for a machine
    /// that takes nothing off what the belief leaves: something then acts here that does not act in the recording. By what the
    /// recording was found to be late by its sampling this one is, too.
    #[must_use]
    pub fn beside_more(&self, verdict: Verdict, extended: &Axis, sampling: Sampling) -> Option<(Verdict, String)> {
        let verdict = match verdict {
            Verdict::NoDiscrepancy => Verdict::UnknownCause,
            Verdict::Explained => Verdict::PartlyExplained,
            _ => return None,
        };
        let base = belief::base_alone(extended);
        let frame = Frame::new(&base, &self.thinned, None);
        let frame = if sampling.timing == Timing::Aligned { frame.aligned_by(sampling.shift_s) } else { frame };
        let frame = frame.after_first_swings(extended);
        if !what_is_missing(&frame).is_empty() {
            return None;
        }
        let note = |beyond: f64| {
            format!(
                "the hold-out leaves {:.1} times its noise, and nothing that the recording shows explains it: something acts there that does not act here; diagnose the hold-out by itself, too",
                (1.0 + beyond).sqrt()
            )
        };
        beyond_noise(extended, &frame).map(|beyond| (verdict, note(beyond)))
    }
}
