//! From single touches to a home position: do they agree, how sure is it, and what is reported.
//!
//! The variance of the mean is what the fits expect and what the touches show, added, since few touches show little; and
//! what all touches have in common: the axis does not take the stop's force the very moment it meets it, may have swung, and
//! slides under another friction than it stands under.

use super::fit::{Contact, Fit};
use super::plan::{LINE_S, Plan};
use crate::error::*;

/// What a homing found on one motor. Lengths in mm and µm, torque in N·m.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct HomingSide {
    /// Contact point, mean of the measured touches, in the coordinate of the start, mm.
    pub contact_mm: f64,
    /// Its expanded uncertainty, k = 2, µm; what it holds and what not is told in docs/homing.md.
    pub uncertainty_um: f64,
    /// Largest minus smallest contact point of the measured touches, µm.
    pub spread_um: f64,
    /// Where the plain threshold puts the stop, mean of the measured touches, mm.
    pub threshold_mm: f64,
    /// Way from the contact point to the torque limit, µm.
    pub press_um: f64,
    /// Stiffness of drive and stop in series, N·m/mm.
    pub stiffness_nm_mm: f64,
    /// Torque before contact, toward the stop, N·m.
    pub sliding_nm: f64,
    /// Standard deviation of the torque about level and line, N·m.
    pub noise_nm: f64,
    /// Add this to the encoder's position to have the machine coordinate, mm.
    pub shift_mm: f64,
}

/// What a homing found and what became of it.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct HomingReport {
    /// Motor 1, motor 2; the second is all zero without a gantry.
    pub side: [HomingSide; 2],
    /// Gantry: way to the stop of motor 1 minus that of motor 2, mm.
    pub skew_mm: f64,
    /// Torque limit in force when homing began, in the unit of the input.
    pub old_torque_limit: f64,
    /// `GIB_DONE`, `GIB_BUSY`, `GIB_OK` before a start, or the first error.
    pub status: i32,
    /// `GIB_HOMING_LINE` or `GIB_HOMING_THRESHOLD`.
    pub method: i32,
    /// Touches measured so far.
    pub touches: i32,
    /// Cycles since the start.
    pub cycles: i32,
    /// 1 while the kernel owes the restored torque limit.
    pub restore_owed: i32,
    /// Zero.
    pub reserved: i32,
}

/// All touches of one motor. Ways count from where homing began.
#[derive(Debug, Clone, Copy, Default)]
pub struct Touches {
    n: f64,
    sum: f64,
    squares: f64,
    variances: f64,
    least: f64,
    most: f64,
    first: f64,
    /// Whether the first touch gave a contact point.
    coarse: bool,
    first_level: f64,
    first_press: f64,
    /// Where it ended, mm.
    pub first_end: f64,
    /// Torque toward the stop while the axis slid back from it, once it did.
    slides_back: Option<f64>,
    threshold: f64,
    /// Gantry: way by which the beam makes the contact point seem too early at most; too late where negative.
    leans: f64,
    mean: Contact,
}

impl Touches {
    /// Checks a touch by itself, and keeps it. `offset` is the way from the start to where it began; the first touch
    /// only finds the stop.
    ///
    /// # Errors
    /// `GIB_ERR_HOMING_SHAPE`, `GIB_ERR_HOMING_SOFT_STOP`, `GIB_ERR_HOMING_NOISE`.
    pub fn add(&mut self, plan: &Plan, touch: u32, fit: &Fit, offset: f64) -> Result<(), Fault> {
        let shape = match fit.found() {
            Ok(contact) => return self.keep(plan, touch, contact, offset),
            Err(shape) => shape,
        };
        if let Some(rise) = fit.rises_early() {
            let [value, high] = rise.map(|slope| slope * plan.torque_nm);
            return Err(Fault { code: GIB_ERR_HOMING_SOFT_STOP, field: "early_rise_nm_mm\0", value, low: 0.0, high });
        }
        // A fast approach leaves too few points for a line; the measured touches are slower.
        if touch == 0 && plan.approach > plan.touch { Ok(()) } else { Err(shape) }
    }

    fn keep(&mut self, plan: &Plan, touch: u32, contact: Contact, offset: f64) -> Result<(), Fault> {
        let fault = |code, field, value, high| Err(Fault { code, field, value, low: 0.0, high });
        if contact.press > plan.press_max {
            return fault(GIB_ERR_HOMING_SOFT_STOP, "press_max_mm\0", contact.press, plan.press_max);
        }
        let way = contact.way + offset;
        if touch == 0 {
            self.first = way;
            self.coarse = true;
            self.first_level = contact.level;
            self.first_press = contact.press;
            return Ok(());
        }
        // Compared with the fit's own error in µm, as the configuration states the tolerance.
        if !(2.0 * contact.variance.sqrt() <= plan.tolerance) {
            let error = 2e3 * contact.variance.sqrt();
            return fault(GIB_ERR_HOMING_NOISE, "touch_tolerance_um\0", error, 1e3 * plan.tolerance);
        }
        if self.n == 0.0 {
            (self.least, self.most) = (way, way);
            self.first = if self.coarse { self.first } else { way };
        }
        self.n += 1.0;
        // About the first touch, so that the squares keep their digits.
        self.sum += way - self.first;
        self.squares += (way - self.first) * (way - self.first);
        self.variances += contact.variance;
        self.least = self.least.min(way);
        self.most = self.most.max(way);
        self.threshold += contact.threshold_way + offset;
        self.mean.way += contact.way;
        self.mean.press += contact.press;
        self.mean.stiffness += contact.stiffness;
        self.mean.level += contact.level;
        self.mean.noise += contact.noise;
        self.mean.swing += contact.swing;
        self.mean.bend += contact.bend;
        self.mean.bend_variance += contact.bend_variance;
        Ok(())
    }

    /// Way to the contact point, mean of the measured touches. What the beam makes of it is anything up to its most: half of that is
    /// likeliest.
    #[must_use]
    pub fn contact(&self) -> f64 {
        self.first + self.sum / self.n.max(1.0) + 0.5 * self.leans
    }

    /// Takes note of a force of the beam, toward the stop where negative, that grows while one side of a gantry touches alone.
    pub fn lean(&mut self, force: f64) {
        self.leans = force / self.stiffness().max(f64::MIN_POSITIVE);
    }

    /// Way from where a touch begins to the contact point, mean of the measured touches.
    #[must_use]
    pub fn run_up(&self) -> f64 {
        self.mean.way / self.n.max(1.0)
    }

    /// By how much the torque before contact has changed since the first touch, where that gave a contact point.
    #[must_use]
    pub fn racked_by(&self) -> Option<f64> {
        self.coarse.then(|| self.level() - self.first_level)
    }

    /// Way to where the limit was reached.
    #[must_use]
    pub fn threshold(&self) -> f64 {
        self.threshold / self.n.max(1.0)
    }

    /// Way that a torque which swings before contact may hide, mean of the measured touches.
    fn swing(&self) -> f64 {
        self.mean.swing / self.n.max(1.0)
    }

    /// Half of what the torque changes by between the two ways, which gravity does not.
    #[must_use]
    pub fn friction(&self) -> f64 {
        self.slides_back.map_or(self.level().abs(), |back| 0.5 * (self.level() - back).abs())
    }

    /// Takes note of the torque toward the stop with which the axis slid back from a touch; of no number where it did not.
    pub fn slid_back(&mut self, torque: f64) {
        if torque.is_finite() {
            self.slides_back = Some(torque);
        }
    }

    /// By how much the line is bent, beyond chance, mean of the measured touches.
    fn bend(&self) -> f64 {
        let n = self.n.max(1.0);
        let chance = 4.0 * self.mean.bend_variance;
        (self.mean.bend * self.mean.bend - chance).max(0.0).sqrt() / n
    }

    /// Standard deviation of the mean.
    fn deviation(&self, plan: &Plan) -> f64 {
        /// Time in s, as a standard deviation, by which torque and position of an impact differ: current loop, instant of
        /// sampling, swinging. On random axes, most of 0.3 to 4 times the usual inertia, the intervals then hold 94 of 100.
        const IMPACT_S: f64 = 0.4e-3;
        /// The same for friction, as a share of it: on the stop the table comes to rest, where friction
        /// is not what it was under way (Stribeck). On random axes whose friction rises by up to 1.8 times toward rest, 0.03
        /// to 0.05 is most likely.
        const FRICTION: f64 = 0.04;
        /// The same for a bent line, as a share of where its halves start: of a ball or a pad, whose force rises with the way to the
        /// power of 1.5 or 2, the line starts late by 2.1 or 2.7 times that.
        const BENT: f64 = 1.4;
        let n = self.n.max(1.0);
        let expected = self.variances / n;
        let shown = (self.squares - self.sum * self.sum / n).max(0.0) / (n - 1.0).max(1.0);
        let impact = IMPACT_S * plan.touch * plan.cycles_per_s;
        let swing = self.swing();
        let friction = FRICTION * self.friction() / self.stiffness().max(f64::MIN_POSITIVE);
        // A line that takes less time than the impact swings is impact for the rest of it.
        let press = self.mean.press / n;
        let short = (press - press * press / (LINE_S * plan.cycles_per_s * plan.touch)).max(0.0);
        let bend = BENT * self.bend();
        // Even from nothing to the most.
        let beam = self.leans / 12f64.sqrt();
        let shared = [impact, swing, friction, short, bend, beam].iter().fold(0.0, |sum, part| sum + part * part);
        ((expected + shown) / n + shared).sqrt()
    }

    /// Whether the touches agree: a chip, a tight spot or a slipping encoder does not repeat.
    ///
    /// # Errors
    /// `GIB_ERR_HOMING_TOUCHES` with the difference in µm; `GIB_ERR_HOMING_NOISE` with what a swinging torque may hide.
    pub fn agree(&self, plan: &Plan) -> Result<(), Fault> {
        // A single touch may be off by three of its standard deviations, two of them in opposite senses.
        let own = 3.0 * (2.0 * self.variances / self.n.max(1.0)).sqrt();
        let allowed = plan.tolerance + own;
        // The first touch came at another speed, whose impact it carries; and the first touch of a gantry squares it.
        let square = if plan.motors == 2 { plan.square } else { 0.0 };
        let square = if self.coarse { square } else { f64::INFINITY };
        let from_first = ((self.contact() - self.first).abs() - square) * (plan.touch / plan.approach);
        let difference = (self.most - self.least).max(from_first);
        let field = "touch_tolerance_um\0";
        if !(difference <= allowed) {
            let (code, value) = (GIB_ERR_HOMING_TOUCHES, 1e3 * difference);
            return Err(Fault { code, field, value, low: 0.0, high: 1e3 * allowed });
        }
        let swing = 2.0 * self.swing();
        if !(swing <= plan.tolerance) {
            let (code, value, high) = (GIB_ERR_HOMING_NOISE, 1e3 * swing, 1e3 * plan.tolerance);
            return Err(Fault { code, field, value, low: 0.0, high });
        }
        Ok(())
    }

    /// Torque before contact, mean of the measured touches, in the unit of the input.
    #[must_use]
    pub fn level(&self) -> f64 {
        if self.n > 0.0 { self.mean.level / self.n } else { self.first_level }
    }

    /// Way from contact to the torque limit in the first touch, mm; 0 where it gave no contact point.
    #[must_use]
    pub fn first_press(&self) -> f64 {
        self.first_press
    }

    /// The same of all touches so far; the largest allowed where none gave a contact point.
    #[must_use]
    pub fn press(&self, plan: &Plan) -> f64 {
        match () {
            () if self.n > 0.0 => self.mean.press / self.n,
            () if self.coarse => self.first_press,
            () => plan.press_max,
        }
    }

    /// Stiffness of drive and stop in series, mean of the measured touches, in the unit of the input per mm.
    #[must_use]
    pub fn stiffness(&self) -> f64 {
        self.mean.stiffness / self.n.max(1.0)
    }

    /// Measured touches.
    #[must_use]
    pub fn count(&self) -> i32 {
        self.n as i32
    }

    /// What is reported. `start` is where homing began, mm.
    #[must_use]
    pub fn report(&self, plan: &Plan, start: f64, shift: f64) -> HomingSide {
        if self.n == 0.0 {
            return HomingSide::default();
        }
        let (n, nm) = (self.n, plan.torque_nm);
        HomingSide {
            contact_mm: start + plan.sense * self.contact(),
            uncertainty_um: 2e3 * self.deviation(plan),
            spread_um: 1e3 * (self.most - self.least),
            threshold_mm: start + plan.sense * self.threshold(),
            press_um: 1e3 * self.mean.press / n,
            stiffness_nm_mm: nm * self.mean.stiffness / n,
            sliding_nm: nm * self.mean.level / n,
            noise_nm: nm * self.mean.noise / n,
            shift_mm: shift,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan() -> Plan {
        Plan { approach: 1e-3, touch: 1e-3, ..Plan::REST }
    }

    fn contact(way: f64) -> Contact {
        Contact { way, variance: 1e-8, press: 0.05, ..Contact::default() }
    }

    #[test]
    fn touches_that_agree_give_their_mean_and_an_honest_spread() {
        let mut touches = Touches::default();
        for (i, way) in [10.0, 10.001, 9.999, 10.003].into_iter().enumerate() {
            touches.keep(&plan(), i as u32, contact(way), 0.0).unwrap();
        }
        touches.agree(&plan()).unwrap();
        let report = touches.report(&plan(), 5.0, 0.0);
        assert!((report.contact_mm - 15.001).abs() < 1e-12 && (report.spread_um - 4.0).abs() < 1e-6);
        // Standard deviation 2 µm of the touches and 0.1 µm of a fit, over √3, and 0.4 µm that they share at 1 mm/s; twice.
        let wanted = 2.0 * ((4.0 + 0.01) / 3.0 + 0.16f64).sqrt();
        assert!((report.uncertainty_um - wanted).abs() < 1e-6, "{} of {wanted}", report.uncertainty_um);
    }

    #[test]
    fn touches_that_disagree_are_refused() {
        for ways in [[10.0, 10.02, 10.02], [10.0, 10.0, 10.007]] {
            let mut touches = Touches::default();
            for (i, way) in ways.into_iter().enumerate() {
                touches.keep(&plan(), i as u32, contact(way), 0.0).unwrap();
            }
            assert_eq!(touches.agree(&plan()).unwrap_err().code, GIB_ERR_HOMING_TOUCHES, "{ways:?}");
        }
    }

    #[test]
    fn a_soft_stop_and_a_noisy_one_are_refused() {
        let code = |found| Touches::default().keep(&plan(), 1, found, 0.0).unwrap_err().code;
        assert_eq!(code(Contact { press: 0.5, ..contact(1.0) }), GIB_ERR_HOMING_SOFT_STOP);
        assert_eq!(code(Contact { variance: 1e-5, ..contact(1.0) }), GIB_ERR_HOMING_NOISE);
        assert_eq!(code(Contact { variance: f64::NAN, ..contact(1.0) }), GIB_ERR_HOMING_NOISE);
    }
}
