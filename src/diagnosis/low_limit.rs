//! A motor that is no longer linear where it drives no more than friction and load.
//!
//! The trace of such a motor is made of the measured torque, and with other numbers of the belief it would explain any torque by
//! itself. It is looked for where nothing else explains the recording, beside a belief whose numbers are right.

use super::causes::Law;
use super::causes::torque_saturation::AT_ANY_LEVEL;
use super::fit::Bench;
use super::judge::{Judge, Judged};
use super::progress::{Stopped, Watch};
use super::select::{BELIEF, Search};
use super::verdict::Verdict;
use crate::machine::Cause;

/// Most causes in all: more together imitate much.
const MOST: usize = 2;
/// Share of what is there that such a motor must explain by itself, for causes beside it to be looked for.
const LEAST: f64 = 0.3;

/// What is judged, or where that is an unknown cause what is found with such a motor among the causes, where that is to be named.
///
/// # Errors
/// [`Stopped`] when the watch's caller said so.
pub fn or_else(
    judged: Judged,
    (judge, bench): (&Judge, &Bench),
    laws: &[&'static Law],
    watch: &Watch,
) -> Result<Judged, Stopped> {
    let is_motor = |law: &Law| law.cause == Cause::TorqueSaturation;
    if judged.verdict != Verdict::UnknownCause || !laws.iter().any(|law| is_motor(law)) {
        return Ok(judged);
    }
    let empty = bench.fit(Vec::new());
    let alone = bench.parts(&AT_ANY_LEVEL, bench.starts(&AT_ANY_LEVEL, &empty)).into_iter();
    let left = alone.map(|part| bench.fit(vec![part]).squares()).fold(f64::INFINITY, f64::min);
    if left > (1.0 - LEAST) * empty.squares() {
        return Ok(judged);
    }
    let others = laws.iter().filter(|law| !BELIEF.contains(&law.cause) && !is_motor(law)).copied();
    let laws: Vec<&'static Law> = others.chain([&AT_ANY_LEVEL]).collect();
    let found = Search::new(bench, &laws, watch)?.from_belief()?;
    if found.fit.parts.len() > MOST || !found.fit.parts.iter().any(|part| is_motor(part.law)) {
        return Ok(judged);
    }
    let with = judge.judge(found)?;
    Ok(if with.selection.fit.parts.is_empty() { judged } else { with })
}
