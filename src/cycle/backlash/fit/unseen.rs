//! A release that is not on the curve.
//!
//! A servo that overshoots its stop comes back from it, by R, before the scan begins. Where a load leaves little wind-up, it releases all of that
//! and runs into the clearance: the curve begins there, and its first kink lies before it. Then the way is counted from where the
//! motor turned. The table has stood since, and the drive was wound as in sliding: with c the torque at which the spring is
//! slack,
//!
//! ```text
//!   lost motion = R + s2 + (after − c)/k,     wound at the turn: w = (c − before − 2·motor)/k,     s1 = w − R
//! ```
//!
//! that is, from the turn to where the straight rise meets sliding. It cannot be less than the wind-up D/k alone.

use super::super::curve::Curve;
use super::super::fitted::Fitted;
use super::super::rounding::Line;
use super::{FEWEST_BINS, Fit, SKIP, Stage};
use crate::cycle::backlash::cholesky::Cholesky;

/// The friction that holds the table at the turn is that of sliding, but for this share: break-away above it; below it the torque that brakes
/// the table, and creep.
const HOLDS: f64 = 0.2;

/// What is known of the release besides the curve.
#[derive(Debug, Clone, Copy)]
pub(super) struct Unseen {
    /// The motor's way from the turn to the begin of the curve, mm.
    pub(super) returned: f64,
    /// Wind-up at the turn, mm.
    wound: f64,
    /// Half of the wind-up, mm: sliding friction over the stiffness.
    friction: f64,
}

impl Fit {
    /// Whether the first kink lies where no fit can see it: with too few bins before it.
    pub(super) fn find_unseen(&self, curve: &Curve) -> Option<Unseen> {
        let (returned, fitted) = (self.returned?, self.chosen?);
        // A load that no friction holds leaves no clearance to cross.
        let wound = fitted.wound(&self.levels, curve.width_mm())?;
        let unseen = Unseen { returned, wound, friction: 0.5 * fitted.windup };
        (wound - returned < (SKIP + FEWEST_BINS) * curve.width_mm()).then_some(unseen)
    }

    /// Fits again, without a first kink and without what may be left of the release.
    pub(super) fn begin_unseen(&mut self, curve: &Curve, unseen: Unseen) -> Stage {
        let left = unseen.wound + HOLDS * unseen.friction - unseen.returned;
        self.first = (left.max(0.0) * curve.bins_per_mm() + 2.0).max(SKIP) as usize;
        self.unseen = Some(unseen);
        self.chosen = None;
        self.line = Line::default();
        self.next_share(curve, 0)
    }

    /// Lost motion from the turn to where the rise meets sliding. `scale`: variance of a sample as neighbours have it together.
    pub(super) fn derive_unseen(
        &self,
        curve: &Curve,
        scale: f64,
        unseen: Unseen,
        structured: bool,
        noise: f64,
    ) -> Option<Fitted> {
        let (t, levels) = (self.best, &self.levels);
        let (_, after, all) = self.parts(curve, t.s1, t.s2);
        // Without bins before the second kink the rise is one line, from which any point will do.
        let line = all.bins - after.bins < FEWEST_BINS;
        let (mut matrix, _) = self.normal(curve, &t);
        let kink = if line { 0.0 } else { 1.0 };
        if line {
            matrix[3] = [0.0, 0.0, 0.0, 1.0];
            matrix.iter_mut().take(3).for_each(|row| row[3] = 0.0);
        }
        let system = Cholesky::new(matrix)?;
        let rise = (levels.after - t.c) / t.k;
        let fit_variance = scale * system.inverse_form([-1.0 / t.k, -rise / t.k, 0.0, kink]);
        let k_variance = scale * system.inverse_form([0.0, 1.0, 0.0, 0.0]);
        let level_variance = scale * system.inverse_form([1.0, 0.0, 0.0, 0.0]);
        let windup = levels.spring_change() / t.k;
        let lost_motion = (unseen.returned + t.s2 + rise).max(windup);
        let variance = fit_variance + levels.variance / (t.k * t.k);
        (variance.is_finite() && variance >= 0.0).then_some(Fitted {
            lost_motion,
            variance,
            clearance: lost_motion - windup,
            windup,
            held: (unseen.wound - unseen.returned).max(0.0),
            stiffness: t.k,
            stiffness_error: k_variance.max(0.0).sqrt(),
            level: t.c,
            level_error: if line { f64::INFINITY } else { level_variance.max(0.0).sqrt() },
            noise: noise.sqrt(),
            share: super::SHARES[self.share.min(super::SHARES.len() - 1)],
            turn_error: HOLDS / 3f64.sqrt() * unseen.friction,
            structured,
            rounded: None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cycle::backlash::fitted::Levels;

    const STIFFNESS: f64 = 50.0;
    const LOAD: f64 = 0.06;
    const LEVELS: Levels = Levels { before: -0.2 + LOAD, after: 0.2 + LOAD, motor: 0.0, variance: 1e-8 };

    /// Lost motion (µm) of an axis with 20 µm of clearance whose motor came back by `returned` (mm) before the curve begins.
    fn found(returned: f64, told: bool) -> f64 {
        let mut curve = Curve::default();
        curve.start(0.0005);
        let s1 = -LEVELS.before / STIFFNESS - returned;
        for i in 0..2400_u32 {
            let s = f64::from(i) * 2e-5;
            let noise = 1e-3 * (f64::from(i * 7919 % 101) / 50.0 - 1.0);
            let torque = STIFFNESS * ((s - s1).min(0.0) + (s - s1 - 0.02).max(0.0));
            curve.add(s, torque.min(LEVELS.after) + noise);
        }
        let mut fit = Box::<Fit>::default();
        fit.start(LEVELS, 0.0, told.then_some(returned));
        while !fit.advance(&curve) {}
        1e3 * fit.result().expect("a release, a clearance and a rise").lost_motion
    }

    #[test]
    fn a_servo_that_came_back_into_the_clearance_shortens_nothing() {
        let truth = 1e3 * (0.02 + LEVELS.spring_change() / STIFFNESS);
        for returned in [0.0, 0.0005, 0.0015, 0.0025, 0.004, 0.008, 0.015] {
            let found = found(returned, true);
            assert!((found - truth).abs() < 0.01 * truth, "back by {returned} mm: {found} and not {truth} µm");
        }
        // What the test is about: the curve alone does not tell.
        assert!(found(0.008, false) < 0.9 * truth);
    }
}
