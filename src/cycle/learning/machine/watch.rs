//! A correction that is kept is right for the speed at which it was learnt, and for its sense: what a machine lags behind and answers
//! depends on both. Of a machine with a lag the deviation grows with the speed; a correction learnt at v leaves |v′/v − 1| of its
//! deviation at v′, nothing v′/v. So it still helps at other speeds, less and less, and does harm below half of v and the other way
//! round. Above, where no more is known of the machine, it is trusted as far.
//!
//! Speeds are means, over as much as eight measurements take, or one where the speed is another already, since a speed may swing; and
//! over an eighth of a turn for what is far off.

use super::*;

/// Relative change of speed beyond which a correction is out.
const FAR: f64 = 0.5;
/// Measurements over which a speed that is as it was is compared again: what ends usual cycles costs. They end by themselves where a
/// speed differs by a tenth.
pub const KEPT: f64 = 8.0;
/// Turns over which what is far off is looked at: an encoder's grid of a few degrees must not look like a speed.
const WINDOW: f64 = 0.125;

/// How the present speed differs from that at which the correction was learnt.
#[derive(Debug, Clone, Copy)]
pub struct Watch {
    /// By more than its tolerance.
    strayed: bool,
    /// So much, or the other way round, that the correction is to be out.
    pub far: bool,
    /// Turn and cycles of the present window.
    turned: f64,
    cycles: f64,
}

impl Watch {
    /// It does not, as far as is known.
    pub const NEAR: Watch = Watch { strayed: false, far: false, turned: 0.0, cycles: 0.0 };
}

impl Learning {
    /// A cycle with a correction that is kept. What spindle or angle do has reasons of its own.
    pub(super) fn watch(&mut self, turned: f64) {
        let watch = &mut self.watch;
        if self.reasons & (GIB_LEARNING_NO_ROTATION | GIB_LEARNING_BAD_ANGLE) != 0 {
            (self.progress, self.cycles) = (0.0, 0);
            (watch.turned, watch.cycles) = (0.0, 0.0);
            return;
        }
        watch.turned += turned;
        watch.cycles += 1.0;
        // No longer than twice what the window takes at the speed known: a slow spindle is told in time, too.
        if watch.turned.abs() >= WINDOW || watch.cycles * self.speed.abs() >= 2.0 * WINDOW {
            watch.far = (watch.turned - watch.cycles * self.speed).abs() > FAR * watch.cycles * self.speed.abs();
            (watch.turned, watch.cycles) = (0.0, 0.0);
        }
        self.progress += turned.abs();
        self.cycles += 1;
        if watch.far {
            watch.strayed = true;
            (self.progress, self.cycles) = (0.0, 0);
        } else if self.progress >= if watch.strayed { self.plan.measure } else { KEPT * self.plan.measure } {
            let mean = (self.progress / self.cycles as f64).copysign(self.rate);
            watch.strayed = (mean - self.speed).abs() > self.plan.speed_tolerance * self.speed.abs();
            (self.progress, self.cycles) = (0.0, 0);
        }
        if watch.strayed {
            self.reasons |= GIB_LEARNING_SPEED_CHANGED;
        }
    }
}
