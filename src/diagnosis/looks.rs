//! The looks at one recording: the first, one that judges rows where friction yields, and quieter ones.

use super::belief;
use super::creep;
use super::frame::{Columns, Frame};
use super::progress::Stopped;
use super::quiet;
use super::suffices::what_is_missing;
use super::verdict::{Diagnosis, Recorded, Verdict, answer};
use crate::machine::Cause;

/// What the looks together say.
pub struct Look {
    /// The answer.
    pub found: Diagnosis,
    /// Width of the low-pass of the look that it is of: where that is the first, what the closed loop tells is judged by it.
    pub width: usize,
    /// Whether the closed loop has no more to say to it.
    pub is_final: bool,
}

/// Looks at a recording of these columns, of which this is the first frame.
///
/// # Errors
/// [`Stopped`] when the watch's caller said so.
pub fn all(recorded: &Recorded, (columns, first): (&Columns, &Frame), notes: Vec<String>) -> Result<Look, Stopped> {
    let axis = recorded.axis;
    let base = belief::base_alone(axis);
    let mut found = answer(recorded, first, notes.clone())?;
    // Between a motor that winds up its drive and one that drags bristles these rows do not tell.
    const YIELDING: [Cause; 3] = [Cause::PreslidingFriction, Cause::DriveCompliance, Cause::Backlash];
    let told = found.findings.iter().any(|finding| YIELDING.contains(&finding.effect.cause()));
    let yields = !told && recorded.may_be_found(Cause::PreslidingFriction);
    let look_wider = |look: &Frame| Frame::new(&base, columns, Some(quiet::wider(look))).after_first_swings(axis);
    let (way, mut wider) = rayon::join(
        || yields.then(|| creep::way(first)).flatten(),
        || quiet::may_hide_more(&found).then(|| look_wider(first)),
    );
    if let Some(way) = way {
        let yielding = Frame::yielding_over(&base, columns, None, way).after_first_swings(axis);
        if creep::promises(&yielding, way, &found) {
            let again = answer(recorded, &yielding, notes.clone())?;
            if creep::is_over(way, again.findings.iter().map(|finding| finding.effect)) {
                return Ok(Look { found: again, width: yielding.low_pass.width, is_final: true });
            }
        }
    }
    let (mut look, mut heard, mut width) = (first.clone(), None, first.low_pass.width);
    for _ in 0..quiet::MOST {
        if !quiet::may_hide_more(&found) {
            break;
        }
        let wide = wider.take().unwrap_or_else(|| look_wider(&look));
        // What was heard once is asked again whether that is quieter or not.
        if !what_is_missing(&wide).is_empty() || heard.is_none() && !quiet::promises(&wide, &look, &found) {
            break;
        }
        let again = answer(recorded, &wide, notes.clone())?;
        if quiet::finds_more(axis, &again, &found) {
            (found, width) = (again, wide.low_pass.width);
        } else if found.verdict == Verdict::NoDiscrepancy {
            match heard.take().filter(|(before, _)| quiet::agree(axis, before, &again)) {
                Some(before) => (found, width) = before,
                None => heard = Some((again, wide.low_pass.width)),
            }
        }
        look = wide;
    }
    Ok(Look { found, width, is_final: false })
}
