//! How a spring is damped the torque hardly tells: it sees no more of it than how fast a swing dies away. The servo does. Behind a spring
//! that is damped a little less a loop that was steady when it was recorded swings up, and the position that it is replayed with is
//! far off. So of the damping ratios that the torque does not tell from the best one it is that with which the loop is steady.

use super::fit::{Bench, Fit};
use super::gain::{Errors, HeldOut};
use super::progress::{Stopped, Watch};
use super::select::{LEAST_GAIN, is_physical, price};

/// How much more a spring is damped.
const MORE: [f64; 5] = [1.1, 1.25, 1.5, 2.0, 3.0];
/// What the balance may lose: what a cause that gains no more would not join for.
const MOST_LOST: f64 = 0.5 * LEAST_GAIN;

/// A fit with its spring damped more, and what it errs by, where the loop is steadier with it and the torque no other; `None` where none
/// is.
///
/// # Errors
/// [`Stopped`] when the watch's caller said so.
pub fn damped(
    bench: &Bench,
    held_out: &HeldOut,
    (fit, errors): (&Fit, &Errors),
    watch: &Watch,
) -> Result<Option<(Fit, Errors)>, Stopped> {
    let Some(at) = fit.table() else { return Ok(None) };
    let mut steadiest: Option<(Fit, Errors)> = None;
    for more in MORE {
        watch.at(0.92, "seeking a steady loop")?;
        let part = &fit.parts[at];
        let Some(shape) = (part.law.manner.damped)(&part.shape, more) else { break };
        let mut parts = fit.parts.clone();
        parts[at] = bench.parts_like(part, vec![shape]).swap_remove(0);
        let next = bench.fit(parts);
        if price(&next) > price(fit) + MOST_LOST || !is_physical(bench, &next) {
            break;
        }
        let Some(its) = held_out.errors(&next)? else { break };
        let so_far = steadiest.as_ref().map_or(errors, |(_, errors)| errors);
        let gains = held_out.gains(Some(so_far), Some(&its));
        if gains.iter().any(|gain| gain.channel == "position" && gain.after < gain.before) {
            steadiest = Some((next, its));
        }
    }
    Ok(steadiest)
}
