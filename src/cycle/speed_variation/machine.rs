//! The speed command of a variation: continuous, whatever changes, and within the motor's torque and power.
//!
//! A triangle runs between its two corner speeds at a constant rate; a sine is a phasor turned a little in each cycle.
//! Either way the change of speed in a cycle is bounded by what the motor has left at that speed, so that a change of
//! amplitude, period, speed or load may ask for more but never gets it.

use super::config::SpeedVariationLimits;
use super::io::*;
use super::limit::{Motor, Wave};
use super::plan::{Plan, code};
use crate::cycle::backlash::io::GIB_INPUT_FAULT;
use crate::error::{
    Fault, GIB_BUSY, GIB_DONE, GIB_ERR_ABORTED, GIB_ERR_DRIVE_FAULT, GIB_ERR_NON_FINITE, GIB_ERR_STATE, GIB_OK,
};
use crate::units::rpm_from_rad_s;
use core::f64::consts::TAU;

/// Where the variation is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// Nothing is varied; ends with a start.
    Idle,
    /// Waits for the first input, which says what is wanted; ends at once.
    Begin,
    /// The speed varies; ends with a stop, an abort or a fault.
    Running,
    /// The speed goes back to its mean; ends when it is there.
    Stopping,
    /// Ended as asked for; ends with a start.
    Done,
    /// Ended with an error; ends with a start.
    Failed,
}

/// A speed variation of one spindle: plain data, no pointers. Speeds in rad/s, positive in the sense of rotation.
#[derive(Debug, Clone, Copy)]
pub struct SpeedVariation {
    plan: Plan,
    phase: Phase,
    /// First fault of this run.
    fault: Fault,
    /// Inputs that the constants below are for.
    seen: SpeedVariationInput,
    speed: f64,
    mean: f64,
    /// Corner speeds and change in a cycle of a triangle.
    corners: [f64; 2],
    rate: f64,
    rising: bool,
    /// Phasor of a sine, its turn in a cycle, its swing now, its goal and its change in a cycle.
    phasor: [f64; 2],
    turn: [f64; 2],
    swing: f64,
    swing_goal: f64,
    swing_rate: f64,
    /// Motor that bounds the change in a cycle.
    motor: Motor,
    /// Friction that helps to brake, without cutting, which may end at any moment.
    brake_help: f64,
    /// Cycle time over inertia.
    per_nm: f64,
    /// N·m per change of speed in a cycle, in the sense of rotation; rpm per rad/s likewise.
    to_torque: f64,
    to_rpm: f64,
    output: SpeedVariationOutput,
}

impl Default for SpeedVariation {
    fn default() -> SpeedVariation {
        SpeedVariation {
            plan: Plan::REST,
            phase: Phase::Idle,
            fault: Fault::NONE,
            seen: SpeedVariationInput::default(),
            speed: 0.0,
            mean: 0.0,
            corners: [0.0; 2],
            rate: 0.0,
            rising: true,
            phasor: [1.0, 0.0],
            turn: [1.0, 0.0],
            swing: 0.0,
            swing_goal: 0.0,
            swing_rate: 0.0,
            motor: Plan::REST.motor,
            brake_help: 0.0,
            per_nm: 0.0,
            to_torque: 0.0,
            to_rpm: rpm_from_rad_s(1.0),
            output: SpeedVariationOutput::default(),
        }
    }
}

impl SpeedVariation {
    /// Arms a variation; it begins with the next step.
    ///
    /// # Errors
    /// `GIB_ERR_STATE` while busy; `GIB_ERR_CONFIG`; `GIB_ERR_SPEED_VARIATION_…` for what the motor cannot do.
    pub fn start(&mut self, plan: Result<Plan, Fault>) -> Result<(), Fault> {
        if self.busy() {
            return Err(Fault::of(GIB_ERR_STATE));
        }
        let plan = plan?;
        *self = SpeedVariation {
            plan,
            speed: plan.mean,
            mean: plan.mean,
            per_nm: plan.cycle_s / plan.motor.inertia,
            to_torque: plan.sense * plan.motor.inertia / plan.cycle_s,
            to_rpm: plan.sense * rpm_from_rad_s(1.0),
            output: SpeedVariationOutput { speed_command_rpm: self.output.speed_command_rpm, ..Default::default() },
            ..SpeedVariation::default()
        };
        self.enter(Phase::Begin);
        Ok(())
    }

    /// Ends a running variation with `GIB_ERR_ABORTED`, at the mean speed and without a jump. Nothing when not busy.
    pub fn abort(&mut self) {
        if self.busy() {
            self.leave(Fault::of(GIB_ERR_ABORTED));
        }
    }

    /// True from `start` until Done or Failed.
    #[must_use]
    pub fn busy(&self) -> bool {
        matches!(self.phase, Phase::Begin | Phase::Running | Phase::Stopping)
    }

    /// What the last step put out.
    #[must_use]
    pub fn output(&self) -> &SpeedVariationOutput {
        &self.output
    }

    /// First fault of the present run.
    #[must_use]
    pub fn fault(&self) -> Fault {
        self.fault
    }

    /// What is possible and recommended for the variation started last.
    ///
    /// # Errors
    /// `GIB_ERR_STATE` before the first start.
    pub fn limits(&self) -> Result<SpeedVariationLimits, Fault> {
        if self.phase == Phase::Idle { Err(Fault::of(GIB_ERR_STATE)) } else { Ok(self.plan.limits()) }
    }

    /// One servo cycle.
    #[inline]
    pub fn step(&mut self, input: &SpeedVariationInput) -> &SpeedVariationOutput {
        let seen = &self.seen;
        let same = input.speed_rpm == seen.speed_rpm
            && input.amplitude_ratio == seen.amplitude_ratio
            && input.period_s == seen.period_s
            && input.cutting_nm == seen.cutting_nm
            && input.flags == 0
            && self.phase == Phase::Running;
        if !same {
            self.turn(input);
            return &self.output;
        }
        self.advance();
        &self.output
    }

    #[inline(always)]
    fn advance(&mut self) {
        let wanted = match self.plan.wave {
            Wave::Triangle => self.triangle(),
            Wave::Sine => self.sine(),
        };
        self.go(wanted);
    }

    /// Goes by `wanted`, or as much of it as the motor has torque and power for at the speed that this leads to.
    #[inline(always)]
    fn go(&mut self, wanted: f64) {
        let higher = self.speed + wanted;
        let faster = if higher > self.speed { higher } else { self.speed };
        let left = self.motor.left(faster);
        let brake = left + self.brake_help;
        let up = if left > 0.0 { left * self.per_nm } else { 0.0 };
        let down = -brake * self.per_nm;
        let change = if wanted > up { up } else { wanted };
        let change = if change < down { down } else { change };
        self.speed += change;
        self.output.speed_command_rpm = self.speed * self.to_rpm;
        self.output.torque_nm = change * self.to_torque;
    }

    /// Change toward the next corner, turned back at it as light is by a mirror, so that the period is kept exactly.
    /// From beyond a corner that was moved it comes back at the motor's own pace.
    #[inline(always)]
    fn triangle(&mut self) -> f64 {
        let [low, high] = self.corners;
        let (speed, rate) = (self.speed, self.rate);
        if self.rising {
            let over = speed + rate - high;
            if over < 0.0 {
                return if speed < low { low - speed } else { rate };
            }
            self.rising = false;
            if over > rate { high - speed } else { rate - 2.0 * over }
        } else {
            let over = low - (speed - rate);
            if over < 0.0 {
                return if speed > high { high - speed } else { -rate };
            }
            self.rising = true;
            if over > rate { low - speed } else { 2.0 * over - rate }
        }
    }

    /// Change toward the sine of this cycle.
    #[inline(always)]
    fn sine(&mut self) -> f64 {
        let ([cos, sin], [turn_cos, turn_sin]) = (self.phasor, self.turn);
        let (c, s) = (cos * turn_cos - sin * turn_sin, sin * turn_cos + cos * turn_sin);
        // One Newton step keeps its length at 1.
        let length = 1.5 - 0.5 * (c * c + s * s);
        self.phasor = [c * length, s * length];
        let missing = self.swing_goal - self.swing;
        self.swing += if missing > self.swing_rate { self.swing_rate } else { missing };
        self.mean + self.swing * self.phasor[1] - self.speed
    }

    /// Every cycle that is not one like the last: at rest, on the way back, something changed, something is wrong.
    #[inline(never)]
    fn turn(&mut self, input: &SpeedVariationInput) {
        match self.phase {
            Phase::Idle | Phase::Done | Phase::Failed => {
                if input.speed_rpm.is_finite() {
                    self.output.speed_command_rpm = input.speed_rpm;
                }
            }
            Phase::Stopping if input.flags & GIB_INPUT_FAULT != 0 => self.leave(Fault::of(GIB_ERR_DRIVE_FAULT)),
            Phase::Stopping => self.go_back(),
            Phase::Begin | Phase::Running => {
                let moving = self.phase == Phase::Running;
                match self.change(input) {
                    Ok(()) if input.flags & GIB_SPEED_VARIATION_STOP != 0 => self.enter(Phase::Stopping),
                    Ok(()) if moving => self.advance(),
                    Ok(()) => {}
                    Err(fault) => self.leave(fault),
                }
                self.seen = SpeedVariationInput { flags: 0, ..*input };
            }
        }
    }

    /// Takes over what this cycle's input wants, as far as the motor can.
    fn change(&mut self, input: &SpeedVariationInput) -> Result<(), Fault> {
        let fields = [
            ("speed_rpm\0", input.speed_rpm),
            ("amplitude_ratio\0", input.amplitude_ratio),
            ("period_s\0", input.period_s),
            ("cutting_nm\0", input.cutting_nm),
        ];
        for (field, value) in fields {
            if !value.is_finite() {
                return Err(Fault { code: GIB_ERR_NON_FINITE, field, value, low: f64::MIN, high: f64::MAX });
            }
        }
        match input.flags & !GIB_SPEED_VARIATION_STOP {
            0 => {}
            flags if flags & GIB_INPUT_FAULT != 0 => return Err(Fault::of(GIB_ERR_DRIVE_FAULT)),
            _ => return Err(Fault::of(GIB_ERR_ABORTED)),
        }
        let plan = self.plan;
        let [mean, amplitude, period, cutting] =
            plan.wanted(input.speed_rpm, input.amplitude_ratio, input.period_s, input.cutting_nm)?;
        let motor = plan.motor_cutting(cutting);
        let (possible, limit) = plan.possible(&motor, mean, period);
        let granted = amplitude.min(possible);
        self.output.amplitude_ratio = granted;
        self.output.amplitude_limit_ratio = possible;
        self.output.period_limit_s = plan.shortest(&motor, mean, amplitude);
        self.output.message = if granted < amplitude * (1.0 - 1e-9) { code(limit) } else { GIB_OK };
        // The last trifle is the speed loop's, which follows the command with a little overshoot.
        const FOLLOWED: f64 = 0.998;
        self.motor = Motor { power: FOLLOWED * motor.power, torque: FOLLOWED * motor.torque, ..motor };
        if plan.published {
            // The print knows no limit at the top of the swing, and is shown without one.
            (self.motor.power, self.motor.torque) = (f64::MAX, f64::MAX);
        }
        self.brake_help = motor.used + plan.motor.used;
        if self.phase == Phase::Begin {
            self.speed = mean;
            self.output.speed_command_rpm = mean * self.to_rpm;
            self.enter(Phase::Running);
        }
        self.mean = mean;
        self.corners = [mean * (1.0 - granted), mean * (1.0 + granted)];
        self.rate = 4.0 * granted * mean * plan.cycle_s / period;
        let angle = TAU * plan.cycle_s / period;
        self.turn = [angle.cos(), angle.sin()];
        self.swing_goal = granted * mean;
        // Less is granted at once; the speed follows at the motor's own pace.
        self.swing = self.swing.min(self.swing_goal);
        self.swing_rate = self.swing_goal * plan.cycle_s / period;
        Ok(())
    }

    /// One cycle back toward the mean, at the variation's own rate or faster where the motor can.
    fn go_back(&mut self) {
        let missing = self.mean - self.speed;
        let most = self.rate.max(1e-6 * self.mean);
        self.go(missing.max(-most).min(most));
        if (self.mean - self.speed).abs() <= 1e-9 * self.mean {
            self.output.torque_nm = 0.0;
            self.enter(if self.fault == Fault::NONE { Phase::Done } else { Phase::Failed });
        }
    }

    /// The one door out: keeps the first fault and goes back to the mean speed; with a faulted drive it just ends.
    #[cold]
    fn leave(&mut self, fault: Fault) {
        if self.fault == Fault::NONE {
            self.fault = fault;
            self.output.message = fault.code;
        }
        let running = matches!(self.phase, Phase::Running | Phase::Stopping);
        if running && fault.code != GIB_ERR_DRIVE_FAULT {
            self.enter(Phase::Stopping);
        } else {
            self.output.torque_nm = 0.0;
            self.enter(Phase::Failed);
        }
    }

    fn enter(&mut self, phase: Phase) {
        self.phase = phase;
        self.output.status = match phase {
            Phase::Idle => GIB_OK,
            Phase::Begin | Phase::Running | Phase::Stopping => GIB_BUSY,
            Phase::Done => GIB_DONE,
            Phase::Failed => self.fault.code,
        };
        self.output.phase = match phase {
            Phase::Idle => GIB_SPEED_VARIATION_IDLE,
            Phase::Begin | Phase::Running => GIB_SPEED_VARIATION_RUNNING,
            Phase::Stopping => GIB_SPEED_VARIATION_STOPPING,
            Phase::Done => GIB_SPEED_VARIATION_DONE,
            Phase::Failed => GIB_SPEED_VARIATION_FAILED,
        };
    }
}
