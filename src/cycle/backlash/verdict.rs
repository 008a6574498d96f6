//! From single reversals to one value: means over repeats and senses, uncertainty, and whether to trust it.
//!
//! The variance of a mean over n reversals is the larger of what the fits expect and what the repeats show
//! (Birge's ratio), so that neither a lucky spread nor an optimistic fit makes the uncertainty too small.

use super::fitted::{Fitted, Levels};
use super::plan::Plan;
use super::rounding::Rounded;
use super::uncertainty::{Give, systematic, variance_of_mean, variance_of_one};
use crate::error::{
    Fault, GIB_ERR_BACKLASH_DIRECTIONS, GIB_ERR_BACKLASH_LIMIT, GIB_ERR_BACKLASH_MOTOR_FRICTION,
    GIB_ERR_BACKLASH_NOISE, GIB_ERR_BACKLASH_RESOLUTION, GIB_ERR_BACKLASH_SHAPE, GIB_ERR_STATE, in_range,
};

/// Lost motion of one sense, or the mean of both. Lost motion is estimated from torque: it is not the reversal
/// value of ISO 230-2. Lengths in µm; uncertainties are expanded, k = 2.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct BacklashEstimate {
    /// Lost motion between steady motion at `slide_speed_mm_s` one way and the other: clearance + 2·Ts/k, with the table's sliding torque Ts
    /// of that speed. Where friction goes by speed (viscous, Stribeck), set the speed that matters: at another the wind-up is another.
    pub lost_motion_um: f64,
    /// Its expanded uncertainty, k = 2. It holds what the table's presliding may be: where its bend shows, all that was taken
    /// off once more, since how it bends is not known; where none shows, what noise may hide. A table whose friction gives way along
    /// a straight line until it slides looks like the drive's spring: nothing here finds that. Nor does it hold cogging or another ripple of
    /// the motor's torque with a period of 0.03 to 0.1 mm and 5 % of the friction or more, which bends the slopes alike in every repeat.
    pub uncertainty_um: f64,
    /// Part of it that is clearance.
    pub clearance_um: f64,
    /// Part of it that is elastic wind-up, 2·Ts/k.
    pub windup_um: f64,
    /// Lost motion at standstill, clearance + (|TA+| + |TA-|)/k: what a laser at rest sees.
    pub standstill_um: f64,
    /// Standard deviation over the repeats; 0 with one repeat.
    pub spread_um: f64,
    /// What the published peak rule reads on the same curves; 0 where it found no peak.
    pub peak_um: f64,
    /// Stiffness of the drive at the motor, N·m/mm, and its standard uncertainty.
    pub stiffness_nm_mm: f64,
    /// Standard uncertainty of the stiffness, N·m/mm.
    pub stiffness_error_nm_mm: f64,
    /// Sliding friction, half the change of torque between the two senses, N·m.
    pub sliding_nm: f64,
    /// Part of it that acts on the motor's side and winds nothing up, N·m.
    pub motor_friction_nm: f64,
    /// Standard deviation of one torque sample about the fitted curve, N·m.
    pub noise_nm: f64,
    /// Reversals measured.
    pub reversals: i32,
    /// Reversals in which the peak rule found a peak.
    pub peaks: i32,
    /// Motor steps (points of the curve) taken in all.
    pub steps: i32,
    /// Reversals whose residuals show structure: the curve is not quite the model's.
    pub structured: i32,
}

/// What a measurement found and what became of it.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct BacklashReport {
    /// After motion in the first direction, then in the other; all zero where not measured.
    pub each: [BacklashEstimate; 2],
    /// Mean of both; the first alone with `one_direction`, and for as long as the other was not measured.
    pub mean: BacklashEstimate,
    /// Amount in force when the measurement began, µm.
    pub old_value_um: f64,
    /// Amount that gib asked the kernel to put in force, µm, not rounded to `compensation_resolution_um`; 0 when none was written.
    pub value_written_um: f64,
    /// Amount that the kernel reported in force at the last confirmed request, µm: within half a `compensation_resolution_um` of what was
    /// asked for.
    pub value_active_um: f64,
    /// `GIB_DONE`, `GIB_BUSY`, `GIB_OK` before a start, or the first error, also once an operator's wish was carried out since.
    pub status: i32,
    /// `GIB_BACKLASH_FIT` or `GIB_BACKLASH_PEAK`: which estimate is written.
    pub method: i32,
    /// `GIB_BACKLASH_SLOW_FEED` or `GIB_BACKLASH_STEP`.
    pub mode: i32,
    /// 1 when a new amount was written and confirmed.
    pub written: i32,
    /// 1 while a restore is owed that the kernel has not confirmed.
    pub restore_owed: i32,
    /// Travel of the table itself before it slides that showed in the rounding of the curves and was taken off the lost
    /// motion, in ‰ of the mean's lost motion; 0 where none shows beyond chance, and always with `GIB_BACKLASH_STEP`, where a table that
    /// creeps looks the same: there the uncertainty holds it.
    pub presliding_permille: i32,
}

/// The estimate beside a value measured otherwise.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct BacklashComparison {
    /// Estimate minus measured value, µm, moving: clearance + 2·Ts/k.
    pub difference_um: f64,
    /// Standstill estimate minus measured value, µm: what fits a measurement at rest.
    pub standstill_difference_um: f64,
    /// Expanded uncertainty of the difference, k = 2, µm.
    pub uncertainty_um: f64,
    /// |difference| ÷ its uncertainty (the En number): 1 or less means the two agree.
    pub en_ratio: f64,
}

impl BacklashReport {
    /// Compares the mean with a measured value and its expanded uncertainty, both in µm.
    ///
    /// # Errors
    /// `GIB_ERR_STATE` before a result, `GIB_ERR_CONFIG` for a value out of range.
    pub fn compare(&self, measured_um: f64, uncertainty_um: f64) -> Result<BacklashComparison, Fault> {
        if self.mean.reversals == 0 {
            return Err(Fault::of(GIB_ERR_STATE));
        }
        let measured = in_range("measured_um\0", measured_um, 0.0, 1e6)?;
        let other = in_range("uncertainty_um\0", uncertainty_um, 0.0, 1e6)?;
        let uncertainty = (self.mean.uncertainty_um * self.mean.uncertainty_um + other * other).sqrt();
        let difference = self.mean.lost_motion_um - measured;
        Ok(BacklashComparison {
            difference_um: difference,
            standstill_difference_um: self.mean.standstill_um - measured,
            uncertainty_um: uncertainty,
            en_ratio: difference.abs() / uncertainty.max(f64::MIN_POSITIVE),
        })
    }
}

/// Sums over reversals of what one way of fitting gives.
#[derive(Debug, Clone, Copy, Default)]
struct Values {
    sum: f64,
    squares: f64,
    variances: f64,
    clearance: f64,
    held: f64,
    stiffness: f64,
}

impl Values {
    /// Adds a reversal by one of its two curves, and the wind-up that was held at standstill.
    fn add(&mut self, curve: &Rounded, held: f64) {
        self.sum += curve.lost_motion;
        self.squares += curve.lost_motion * curve.lost_motion;
        self.variances += curve.variance;
        self.clearance += curve.clearance;
        self.held += held;
        self.stiffness += curve.stiffness;
    }
}

/// Everything measured so far in one sense.
#[derive(Debug, Clone, Copy, Default)]
pub struct Sense {
    reversals: f64,
    straight: Values,
    rounded: Values,
    give: Give,
    stiffness_variance: f64,
    sliding: f64,
    motor: f64,
    noise: f64,
    turn_error: f64,
    peaks: f64,
    peak_sum: f64,
    steps: f64,
    structured: f64,
}

impl Sense {
    /// Adds a reversal: its fit, its levels, the peak rule's reading (mm) if any, and the points of its curve.
    pub fn add(&mut self, fit: &Fitted, levels: &Levels, peak: Option<f64>, steps: f64) {
        self.reversals += 1.0;
        self.straight.add(&fit.straight(), fit.held);
        // Of the way to the clearance the table gives back what it took.
        let rounded = fit.curve(true);
        self.rounded.add(&rounded, fit.held * fit.stiffness / rounded.stiffness);
        self.give.add(fit);
        self.stiffness_variance += fit.stiffness_error * fit.stiffness_error;
        self.sliding += 0.5 * (levels.after - levels.before);
        self.motor += levels.motor;
        self.noise += fit.noise;
        self.turn_error += fit.turn_error;
        self.structured += f64::from(u8::from(fit.structured));
        self.steps += steps;
        if let Some(position) = peak {
            self.peaks += 1.0;
            self.peak_sum += position;
        }
    }

    /// Reversals added.
    #[must_use]
    pub fn reversals(&self) -> f64 {
        self.reversals
    }

    fn values(&self, told: bool) -> &Values {
        if told { &self.rounded } else { &self.straight }
    }

    /// Variance of the mean lost motion, mm², from scatter and fits.
    fn variance_of_mean(&self, told: bool) -> f64 {
        let values = self.values(told);
        variance_of_mean(self.reversals, values.sum, values.squares, values.variances)
    }

    /// The estimate for this sense; `other` supplies the wind-up held on the far side at standstill. `told`: the table's
    /// presliding is taken off; `common` is the variance of what all reversals have alike.
    fn estimate(&self, plan: &Plan, told: bool, common: f64, other: &Sense) -> BacklashEstimate {
        let n = self.reversals.max(1.0);
        let values = self.values(told);
        let far = if other.reversals > 0.0 { other.values(told).held / other.reversals } else { values.held / n };
        let clearance = values.clearance / n;
        let um = 1e3;
        let nm = plan.torque_nm;
        BacklashEstimate {
            lost_motion_um: values.sum / n * um,
            uncertainty_um: 2.0 * (self.variance_of_mean(told) + common).sqrt() * um,
            clearance_um: clearance * um,
            windup_um: (values.sum - values.clearance) / n * um,
            standstill_um: (clearance + values.held / n + far) * um,
            spread_um: variance_of_one(n, values.sum, values.squares).sqrt() * um,
            peak_um: if self.peaks > 0.0 { self.peak_sum / self.peaks * um } else { 0.0 },
            stiffness_nm_mm: values.stiffness / n * nm,
            stiffness_error_nm_mm: self.stiffness_variance.sqrt() / n * nm,
            sliding_nm: self.sliding / n * nm,
            motor_friction_nm: self.motor / n * nm,
            noise_nm: self.noise / n * nm,
            reversals: self.reversals as i32,
            peaks: self.peaks as i32,
            steps: self.steps as i32,
            structured: self.structured as i32,
        }
    }
}

/// What all reversals so far say.
#[derive(Debug, Clone, Copy, Default)]
pub struct Estimates {
    /// A sense that was not measured is all zero.
    pub each: [BacklashEstimate; 2],
    /// Mean of both, or the one that was measured.
    pub mean: BacklashEstimate,
    /// The table's presliding that was taken off, in ‰ of the mean's lost motion; 0 where none shows.
    pub presliding_permille: i32,
}

/// Estimates of both senses and their mean; a sense that was not measured is all zero.
#[must_use]
pub fn estimates(plan: &Plan, encoder: f64, senses: &[Sense; 2]) -> Estimates {
    let give = senses[0].give.with(&senses[1].give);
    let reversals = (senses[0].reversals + senses[1].reversals).max(1.0);
    let straight = (senses[0].straight.sum + senses[1].straight.sum) / reversals;
    let step = if plan.slow_feed { 0.0 } else { plan.step };
    let turn_error = (senses[0].turn_error + senses[1].turn_error) / reversals;
    let grid = systematic(encoder, plan.bin, step, 0.0);
    // While the motor stands between steps the table creeps, which bends the curve as presliding does.
    let told = plan.slow_feed && give.told(grid);
    let common = systematic(encoder, plan.bin, step, straight) + give.untold(grid, told) + turn_error * turn_error;
    let permille =
        if told { (1e3 * give.mean() / (straight - give.mean()).max(f64::MIN_POSITIVE)).min(1e6) } else { 0.0 };
    let presliding_permille = (permille + 0.5) as i32;
    let first = senses[0].estimate(plan, told, common, &senses[1]);
    if senses[1].reversals == 0.0 {
        return Estimates { each: [first, BacklashEstimate::default()], mean: first, presliding_permille };
    }
    let second = senses[1].estimate(plan, told, common, &senses[0]);
    let half = |a: f64, b: f64| 0.5 * (a + b);
    let root = |a: f64, b: f64| 0.5 * (a * a + b * b).sqrt();
    let scatter = 0.25 * (senses[0].variance_of_mean(told) + senses[1].variance_of_mean(told));
    let mean = BacklashEstimate {
        lost_motion_um: half(first.lost_motion_um, second.lost_motion_um),
        uncertainty_um: 2.0e3 * (scatter + common).sqrt(),
        clearance_um: half(first.clearance_um, second.clearance_um),
        windup_um: half(first.windup_um, second.windup_um),
        standstill_um: half(first.standstill_um, second.standstill_um),
        spread_um: half(first.spread_um * first.spread_um, second.spread_um * second.spread_um).sqrt(),
        peak_um: match (first.peaks, second.peaks) {
            (0, _) => second.peak_um,
            (_, 0) => first.peak_um,
            _ => half(first.peak_um, second.peak_um),
        },
        stiffness_nm_mm: half(first.stiffness_nm_mm, second.stiffness_nm_mm),
        stiffness_error_nm_mm: root(first.stiffness_error_nm_mm, second.stiffness_error_nm_mm),
        sliding_nm: half(first.sliding_nm, second.sliding_nm),
        motor_friction_nm: half(first.motor_friction_nm, second.motor_friction_nm),
        noise_nm: half(first.noise_nm, second.noise_nm),
        reversals: first.reversals + second.reversals,
        peaks: first.peaks + second.peaks,
        steps: first.steps + second.steps,
        structured: first.structured + second.structured,
    };
    Estimates { each: [first, second], mean, presliding_permille }
}

/// Largest expanded uncertainty, as a share of the value, at which a compensation is still an improvement worth
/// writing: beyond it the remaining error may be a third of the lost motion.
const WORST_UNCERTAINTY: f64 = 0.33;
/// Disagreement of the senses, in standard uncertainties of their difference, that chance does not explain
/// (3 in 10 000).
const DISAGREEMENT: f64 = 3.6;

/// Says whether one reversal can be used; `torque_nm` is N·m in the unit of its torque.
///
/// # Errors
/// `GIB_ERR_BACKLASH_SHAPE`, `GIB_ERR_BACKLASH_NOISE`.
pub fn check_reversal(fit: Option<&Fitted>, torque_nm: f64) -> Result<Fitted, Fault> {
    // A curve whose bend cannot be told does not tell what the table gives way either.
    let Some(fit) = fit.filter(|fit| fit.rounded.is_some()) else { return Err(Fault::of(GIB_ERR_BACKLASH_SHAPE)) };
    // A slope that is not at least five standard errors from none cannot carry the wind-up.
    const SLOPE: f64 = 5.0;
    if fit.stiffness < SLOPE * fit.stiffness_error {
        return Err(Fault {
            code: GIB_ERR_BACKLASH_NOISE,
            field: "stiffness_nm_mm\0",
            value: fit.stiffness * torque_nm,
            low: SLOPE * fit.stiffness_error * torque_nm,
            high: f64::MAX,
        });
    }
    Ok(*fit)
}

/// Says whether the curve begins with the release. A table that has slipped before the turn leaves the drive slack, and what the motor
/// crossed of the clearance is on no curve. `returned` (mm): the motor's way back before the curve; `bin` (mm): of the curve.
///
/// # Errors
/// `GIB_ERR_BACKLASH_SHAPE` with the release that the curve shows, `_NOISE` where noise may hide it.
pub fn check_release(fit: &Fitted, levels: &Levels, returned: f64, slipped: bool, bin: f64) -> Result<(), Fault> {
    /// Bins of release without which the first kink may be anywhere before them, and share of what was wound that is one.
    const SHORT: f64 = 5.5;
    const SHARE: f64 = 0.4;
    // Where the release is known to lie before the curve, the way was counted from the turn.
    let counted = fit.turn_error > 0.0;
    let Some(wound) = fit.wound(levels, bin).filter(|_| !counted) else { return Ok(()) };
    // Without a clearance its place is chance: the release ends no lower on the line than where the drive is slack.
    let slack = levels.motor + 0.5 * (levels.before + levels.after).min(0.0);
    let below = (slack - fit.level).max(0.0) / fit.stiffness;
    let (found, wound) = (fit.held + below, wound + below);
    let share = if slipped { f64::INFINITY } else { SHARE * (wound - returned) };
    let least = share.min(SHORT * bin);
    if found < least {
        let hidden = fit.variance.sqrt() > found;
        let (code, field) = (if hidden { GIB_ERR_BACKLASH_NOISE } else { GIB_ERR_BACKLASH_SHAPE }, "release_um\0");
        return Err(Fault { code, field, value: 1e3 * found, low: 1e3 * least, high: f64::MAX });
    }
    Ok(())
}

/// Says whether curve and probe found the same friction on the motor's side: across a clearance the motor has nothing else to
/// overcome, but for the zero of the torque reading, which the middle of the sliding levels bounds. `torque_nm` is N·m in the
/// unit of their torque.
///
/// # Errors
/// `GIB_ERR_BACKLASH_MOTOR_FRICTION` with how far the two are apart.
pub fn check_motor(fit: &Fitted, levels: &Levels, torque_nm: f64) -> Result<(), Fault> {
    /// Share of the wind-up from which a clearance shows a level of its own, and share of sliding that is the same.
    const CLEAR: f64 = 0.25;
    const SAME: f64 = 0.1;
    let (middle, change) = (0.5 * (levels.after + levels.before).abs(), levels.after - levels.before);
    let level = if fit.clearance > CLEAR * fit.windup {
        Some((fit.level, fit.level_error))
    } else if middle < 0.5 * levels.spring_change() {
        // A shorter one may be a bend of the table's, but for what the rounded curve has of it.
        fit.rounded.and_then(|rounded| rounded.level)
    } else {
        // A load that no friction holds leaves no clearance to cross.
        None
    };
    let Some((level, error)) = level else { return Ok(()) };
    let (apart, same) = ((level - levels.motor).abs(), SAME * 0.5 * change);
    // The variance is that of twice the motor's friction, mostly.
    let chance = (error * error + 0.25 * levels.variance).sqrt();
    let allowed = same + middle.min(same) + DISAGREEMENT * chance;
    if apart > allowed {
        let (code, field) = (GIB_ERR_BACKLASH_MOTOR_FRICTION, "motor_friction_difference_nm\0");
        return Err(Fault { code, field, value: apart * torque_nm, low: 0.0, high: allowed * torque_nm });
    }
    Ok(())
}

/// Says whether one direction alone can be trusted: under a load of half to all of what the table's friction holds, the table may
/// creep through the clearance while the motor turns, in one sense only. Both directions then disagree.
///
/// # Errors
/// `GIB_ERR_BACKLASH_SHAPE` with the load as a share of that friction.
pub fn check_load(plan: &Plan, levels: &Levels) -> Result<(), Fault> {
    const HELD: f64 = 0.5;
    const FALLS: f64 = 1.1;
    let load = (levels.after + levels.before).abs() / levels.spring_change();
    if plan.senses == 1 && load > HELD && load < FALLS {
        let (code, field) = (GIB_ERR_BACKLASH_SHAPE, "load_ratio\0");
        return Err(Fault { code, field, value: load, low: 0.0, high: HELD });
    }
    Ok(())
}

/// Says whether the whole result can be written.
///
/// # Errors
/// `GIB_ERR_BACKLASH_NOISE`, `_RESOLUTION`, `_DIRECTIONS`, `_LIMIT`, each with what was found and allowed.
pub fn check_result(
    plan: &Plan,
    encoder: f64,
    each: &[BacklashEstimate; 2],
    mean: &BacklashEstimate,
    amount_um: f64,
) -> Result<(), Fault> {
    let value = mean.lost_motion_um;
    let fault = |code, field, value, low, high| Err(Fault { code, field, value, low, high });
    let finest = (2.0e3 * encoder).max(mean.uncertainty_um);
    if value < finest {
        return fault(GIB_ERR_BACKLASH_RESOLUTION, "lost_motion_um\0", value, finest, f64::MAX);
    }
    let worst = WORST_UNCERTAINTY * value;
    if mean.uncertainty_um > worst {
        return fault(GIB_ERR_BACKLASH_NOISE, "uncertainty_um\0", mean.uncertainty_um, 0.0, worst);
    }
    if plan.senses == 2 {
        let apart = (each[0].lost_motion_um - each[1].lost_motion_um).abs();
        let allowed = 0.5 * DISAGREEMENT * (each[0].uncertainty_um.powi(2) + each[1].uncertainty_um.powi(2)).sqrt();
        if apart > allowed {
            return fault(GIB_ERR_BACKLASH_DIRECTIONS, "lost_motion_difference_um\0", apart, 0.0, allowed);
        }
    }
    if !(amount_um > 0.0 && amount_um <= plan.compensation_max_um) {
        return fault(GIB_ERR_BACKLASH_LIMIT, "amount_um\0", amount_um, 0.0, plan.compensation_max_um);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sense_that_was_not_measured_yet_halves_nothing() {
        let fit = Fitted { lost_motion: 0.04, variance: 1e-8, clearance: 0.03, stiffness: 700.0, ..Fitted::default() };
        let levels = Levels { before: -4.0, after: 4.0, motor: 0.0, variance: 1e-6 };
        let mut senses = [Sense::default(); 2];
        senses[0].add(&fit, &levels, None, 10.0);
        let both = Plan { senses: 2, ..Plan::REST };
        let Estimates { each, mean, .. } = estimates(&both, 0.0, &senses);
        assert_eq!((each[1], mean), (BacklashEstimate::default(), each[0]));
        assert!((mean.lost_motion_um - 40.0).abs() < 1e-9, "{} µm", mean.lost_motion_um);
        senses[1].add(&Fitted { lost_motion: 0.06, ..fit }, &levels, None, 10.0);
        assert!((estimates(&both, 0.0, &senses).mean.lost_motion_um - 50.0).abs() < 1e-9);
    }

    #[test]
    fn a_release_is_told_from_a_kink_that_is_chance() {
        let levels = Levels { before: -4.0, after: 4.0, motor: 0.0, variance: 1e-6 };
        let fit = Fitted { stiffness: 700.0, clearance: 0.002, held: 0.001, level: -1.5, ..Fitted::default() };
        let said = |fit: &Fitted| check_release(fit, &levels, 0.0, false, 0.0005).map_err(|fault| fault.code);
        // A line without a clearance, of which the table had released a part.
        assert_eq!(said(&fit), Ok(()));
        assert_eq!(said(&Fitted { held: 0.002, level: 0.0, ..fit }), Err(GIB_ERR_BACKLASH_SHAPE));
        assert_eq!(said(&Fitted { held: 0.002, level: 0.0, variance: 1e-4, ..fit }), Err(GIB_ERR_BACKLASH_NOISE));
    }

    #[test]
    fn the_probe_is_held_against_a_short_clearance_that_shows() {
        let levels = Levels { before: -1.4, after: 1.4, motor: 0.25, variance: 1e-6 };
        let across = |level| Fitted {
            clearance: 0.005,
            windup: 0.055,
            level: 0.5,
            rounded: Some(Rounded { level, ..Rounded::default() }),
            ..Fitted::default()
        };
        let code = |fit: &Fitted, levels: &Levels| check_motor(fit, levels, 1.0).map_err(|fault| fault.code);
        assert_eq!(code(&across(Some((0.5, 0.01))), &levels), Err(GIB_ERR_BACKLASH_MOTOR_FRICTION));
        assert_eq!(code(&across(Some((0.3, 0.01))), &levels), Ok(()));
        // It may be a bend of the table's.
        assert_eq!(code(&across(None), &levels), Ok(()));
        // A load hangs on the table, and the drive is never slack.
        let hangs = Levels { before: 1.0, after: 3.8, ..levels };
        assert_eq!(code(&across(Some((2.4, 0.01))), &hangs), Ok(()));
    }
}
