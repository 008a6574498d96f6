//! What a measurement found, as it crosses the boundary.

use super::blocks::Block;
use super::fit::{Balance, Question, fit};
use crate::error::{Fault, GIB_ERR_INERTIA_OWN, GIB_OK};
use crate::units::rpm_from_rad_s;

/// Inertia and friction of a spindle. Uncertainties are expanded: the interval holds the truth in 95 of 100 cases.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct InertiaReport {
    /// All that turns, kg·m².
    pub total_kg_m2: f64,
    /// Its expanded uncertainty, kg·m².
    pub total_uncertainty_kg_m2: f64,
    /// Total minus the machine's own: the workpiece's, what `INA` holds. Equal to the total where no own one is given.
    pub workpiece_kg_m2: f64,
    /// Its expanded uncertainty, kg·m².
    pub workpiece_uncertainty_kg_m2: f64,
    /// Coulomb friction, N·m. Holds a constant torque too where the spindle turned one way only.
    pub coulomb_nm: f64,
    /// Its expanded uncertainty, N·m.
    pub coulomb_uncertainty_nm: f64,
    /// Viscous friction, N·m·s/rad.
    pub viscous_nm_s: f64,
    /// Its expanded uncertainty, N·m·s/rad.
    pub viscous_uncertainty_nm_s: f64,
    /// Constant torque, N·m; 0 where the spindle turned one way only.
    pub constant_nm: f64,
    /// What torque over acceleration alone would say, kg·m²: friction counted as inertia.
    pub naive_kg_m2: f64,
    /// Standard deviation of a block's torque about the fit, N·m.
    pub scatter_nm: f64,
    /// Speed above which torque and motion no longer agree (field weakening), rpm; 0: none found.
    pub weakening_rpm: f64,
    /// Torque above which torque and motion no longer agree (saturation), N·m; 0: none found.
    pub saturation_nm: f64,
    /// The ramp that would reach the uncertainty wanted: its lower speed, rpm.
    pub ramp_low_rpm: f64,
    /// Its upper speed, rpm.
    pub ramp_high_rpm: f64,
    /// Its acceleration, rpm/s.
    pub ramp_acceleration_rpm_s: f64,
    /// Torque that it takes at its upper speed, N·m; 0: not known.
    pub ramp_torque_nm: f64,
    /// How often it goes up and down.
    pub ramp_times: i32,
    /// `GIB_OK`, or why the inertia cannot be used: `GIB_ERR_INERTIA_…`.
    pub verdict: i32,
    /// 1 when the uncertainty wanted was reached.
    pub target_reached: i32,
    /// 1 when the spindle both sped up and slowed down: only then is inertia independent of friction.
    pub both_ways: i32,
    /// Blocks that the result rests on.
    pub blocks_used: i32,
    /// Blocks dropped as outliers.
    pub blocks_dropped: i32,
    /// Blocks left out as weakened or saturated.
    pub blocks_left_out: i32,
    /// Process step that the value belongs to, as configured.
    pub process_step: i32,
    /// 1 when all ramps have one acceleration: a motor that saturates, and reports more torque than it delivers, then cannot be told
    /// from another inertia. Say `saturation_nm`, or ramp at two accelerations, one at most two thirds of the other, as
    /// `GIB_INERTIA_RAMP` does from two ramps on.
    pub one_acceleration: i32,
    /// Zero.
    pub reserved: i32,
}

impl InertiaReport {
    /// Fits blocks of `length` samples and takes the machine's own inertia off. Off the cycle: 10 to 150 ms.
    ///
    /// # Errors
    /// In the second place why the value cannot be used; the report then holds what is known all the same.
    pub fn of(blocks: &[Block], length: u32, question: &Question) -> (InertiaReport, Result<(), Fault>) {
        let (balance, verdict) = fit(blocks, length, question);
        let (own, total) = (question.own[0], balance.inertia.value);
        let fault =
            Fault { code: GIB_ERR_INERTIA_OWN, field: "own_inertia_kg_m2\0", value: own, low: 0.0, high: total };
        let verdict = verdict.and(if own < total { Ok(()) } else { Err(fault) });
        (InertiaReport::new(question, &balance, verdict), verdict)
    }

    fn new(question: &Question, balance: &Balance, verdict: Result<(), Fault>) -> InertiaReport {
        let Balance { inertia, coulomb, viscous, constant, ramp, .. } = balance;
        let Question { target, own: [own, own_uncertainty], process_step, .. } = *question;
        let reached = verdict.is_ok() && inertia.uncertainty <= target * inertia.value;
        InertiaReport {
            total_kg_m2: inertia.value,
            total_uncertainty_kg_m2: inertia.uncertainty,
            workpiece_kg_m2: inertia.value - own,
            workpiece_uncertainty_kg_m2: inertia.uncertainty.hypot(own_uncertainty),
            coulomb_nm: coulomb.value,
            coulomb_uncertainty_nm: coulomb.uncertainty,
            viscous_nm_s: viscous.value,
            viscous_uncertainty_nm_s: viscous.uncertainty,
            constant_nm: constant.value,
            naive_kg_m2: balance.naive,
            scatter_nm: balance.scatter,
            weakening_rpm: rpm_from_rad_s(balance.weakening),
            saturation_nm: balance.saturation,
            ramp_low_rpm: rpm_from_rad_s(ramp.speeds[0]),
            ramp_high_rpm: rpm_from_rad_s(ramp.speeds[1]),
            ramp_acceleration_rpm_s: rpm_from_rad_s(ramp.acceleration),
            ramp_torque_nm: ramp.torque,
            ramp_times: ramp.times as i32,
            verdict: verdict.err().map_or(GIB_OK, |fault| fault.code),
            target_reached: i32::from(reached),
            both_ways: i32::from(balance.both_ways),
            blocks_used: balance.used as i32,
            blocks_dropped: balance.dropped as i32,
            blocks_left_out: balance.left_out as i32,
            process_step,
            one_acceleration: i32::from(balance.one_acceleration),
            reserved: 0,
        }
    }
}
