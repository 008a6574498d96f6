//! The way back to the mean speed, on which every variation ends: as asked for, or by a fault; and what follows it.

use super::*;
use crate::cycle::profile::{higher, lower};
use crate::units::rad_s_from_rpm;

impl SpeedVariation {
    /// One cycle back toward the mean, with what cutting leaves now, whatever else is wrong with the input.
    pub(super) fn go_back(&mut self, input: &SpeedVariationInput) {
        if self.count_cutting(input) | self.aim(input.speed_rpm) {
            self.give_time();
        }
        // What was granted and has not gone by is left, too.
        self.patience = (self.patience + self.quiet as u32).saturating_sub(1);
        let (mean, before) = (self.mean(), self.speed);
        self.go(lower(higher(mean - before, -self.back), self.back));
        let missing = mean - self.speed;
        let there = missing.abs() <= 1e-9 * mean;
        self.grant_back(missing, self.speed - before);
        if !there && self.patience == 0 && self.fault == Fault::NONE {
            self.fault = Fault::of(GIB_ERR_SPEED_VARIATION_NONE);
            self.output.message = GIB_ERR_SPEED_VARIATION_NONE;
        }
        if there || self.patience == 0 {
            // The mean may not be what is asked for: a spindle stop, the other sense.
            self.going = !((self.output.speed_command_rpm - input.speed_rpm).abs() <= 1e-6 * input.speed_rpm.abs());
            self.enter(if self.fault == Fault::NONE { Phase::Done } else { Phase::Failed });
        }
    }

    /// Counts with the cutting torque of an input from now on, where it is one; true where it has changed.
    fn count_cutting(&mut self, input: &SpeedVariationInput) -> bool {
        let cutting = input.cutting_nm;
        let changed = cutting != self.asked[3] && (0.0..=MOST_CUTTING).contains(&cutting);
        if changed {
            self.asked[3] = cutting;
            self.load(cutting);
        }
        changed
    }

    /// Leads the way back to the mean speed that is asked for now; true where that is another one. What is too slow, or turns the
    /// other way, is asked for by who wants the spindle to stop: it leads to the lowest speed. What is too fast, or no number, leads
    /// nowhere else.
    fn aim(&mut self, speed_rpm: f64) -> bool {
        let speed = rad_s_from_rpm(speed_rpm * self.plan.sense);
        if speed == self.mean() {
            return false;
        }
        let lowest = self.plan.motor.speeds[0].max(rad_s_from_rpm(1e-3));
        let mean = match self.plan.speed(speed_rpm) {
            Ok(mean) => mean,
            Err(_) if speed.is_finite() && speed < lowest => lowest,
            Err(_) => return false,
        };
        let change = (mean - self.mean()).abs();
        if change > 0.0 {
            self.asked[0] = mean;
            self.way += change;
            self.back = higher(self.back, self.own_pace());
        }
        change > 0.0
    }

    /// Change of speed in a cycle by which a speed asked for is met that no variation has to do with: what the motor can do at the
    /// mean speed of the configuration. At low speed its power alone would allow a jump.
    fn own_pace(&self) -> f64 {
        let Motor { power, torque, .. } = self.plan.motor;
        lower(power / self.plan.mean, torque) * self.plan.change_per_nm()
    }

    /// Where nothing is varied the command is the speed asked for, or the last one where that is no number or too fast.
    pub(super) fn rest(&mut self, input: &SpeedVariationInput) {
        const ROUNDING: f64 = 1.0 + 1e-12;
        self.output.torque_nm = 0.0;
        // A drive without power is to be told at once what is wanted of it.
        self.going &= input.flags & GIB_INPUT_FAULT == 0;
        let most = if self.phase == Phase::Idle { f64::MAX } else { self.plan.motor.speeds[1] * self.to_rpm.abs() };
        if !(input.speed_rpm.abs() <= lower(most * ROUNDING, f64::MAX)) {
            return;
        }
        if self.going {
            self.go_to(input);
        } else {
            self.output.speed_command_rpm = input.speed_rpm;
        }
    }

    /// One cycle toward the speed asked for, through 0 where it turns the other way.
    fn go_to(&mut self, input: &SpeedVariationInput) {
        self.count_cutting(input);
        let wanted = |to_rpm: f64| input.speed_rpm / to_rpm;
        if wanted(self.to_rpm) < 0.0 && self.speed <= 0.0 {
            (self.to_rpm, self.to_torque, self.speed) = (-self.to_rpm, -self.to_torque, 0.0);
        }
        let (wanted, pace) = (wanted(self.to_rpm), self.own_pace());
        self.go(lower(higher(higher(wanted, 0.0) - self.speed, -pace), pace));
        if (wanted - self.speed).abs() <= 1e-9 * wanted {
            self.going = false;
            self.output.speed_command_rpm = input.speed_rpm;
        }
    }

    /// Grants the cycles that are like this one, in which the speed went by `change` and after which that much is missing.
    fn grant_back(&mut self, missing: f64, change: f64) {
        let steady = (change.abs() - self.back).abs() <= 1e-9 * self.back && missing.abs() > 2.0 * self.back;
        let fastest = higher(self.speed, self.mean());
        // What the motor has left shrinks with speed: enough at the fastest is enough all the way.
        let cycles = if steady && self.has(change, fastest) { (missing.abs() / self.back) as u32 - 1 } else { 0 };
        let cycles = cycles.min(self.patience.saturating_sub(1)).min(i32::MAX as u32);
        self.patience -= cycles;
        (self.quiet, self.steady) = (cycles as i32, change);
    }

    /// Sets out for the mean, at the variation's own rate but not slower than a tenth of it in a second.
    pub(super) fn set_out(&mut self) {
        const SLOWEST_1_S: f64 = 0.1;
        self.back = self.now.rate.max(SLOWEST_1_S * self.mean() * self.plan.cycle_s);
        self.way = (self.mean() - self.speed).abs();
        self.deadline = self.time_for_the_way();
        self.patience = self.deadline;
        self.slope = true;
        self.enter(Phase::Stopping);
    }

    /// The one door out: keeps the first fault and goes back to the mean speed; with a faulted drive it just ends.
    #[cold]
    pub(super) fn leave(&mut self, fault: Fault) {
        if self.fault == Fault::NONE {
            self.fault = fault;
            self.output.message = fault.code;
        }
        // An input that is wrong is looked at in every cycle: its load may change meanwhile, and change back.
        self.seen = NOTHING_SEEN;
        match self.phase {
            Phase::Running if fault.code != GIB_ERR_DRIVE_FAULT => self.set_out(),
            Phase::Stopping if fault.code != GIB_ERR_DRIVE_FAULT => {} // on the way already
            _ => {
                self.output.torque_nm = 0.0;
                self.enter(Phase::Failed);
            }
        }
    }
}
