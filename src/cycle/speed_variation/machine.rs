//! The speed command of a variation: continuous, whatever changes, and within the motor's torque and power.
//!
//! A triangle runs between its two corner speeds at a constant rate; a sine is a phasor turned a little in each cycle.
//! Either way the change of speed in a cycle is bounded by what the motor has left at that speed, so that a change of
//! amplitude, period, speed or load may ask for more but never gets it. What a change leads to is worked out over the next
//! cycles ([`super::setting`]); the load counts at once. Cycles in which none of that can matter are granted in advance and
//! cost little ([`quick`]).

mod late;
mod quick;
mod way_back;

use super::config::SpeedVariationLimits;
use super::io::*;
use super::limit::{Motor, Wave};
use super::plan::{MOST_CUTTING, Plan, code};
use super::setting::{Asked, Piece, Setting};
use crate::cycle::backlash::io::{GIB_INPUT_ABORT, GIB_INPUT_FAULT};
use crate::error::{
    Fault, GIB_BUSY, GIB_DONE, GIB_ERR_ABORTED, GIB_ERR_CONFIG, GIB_ERR_DRIVE_FAULT, GIB_ERR_NON_FINITE,
    GIB_ERR_SPEED_VARIATION_NONE, GIB_ERR_STATE, GIB_OK,
};
use crate::units::rpm_from_rad_s;

/// Where the variation is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// Nothing is varied; ends with a start.
    Idle,
    /// Waits for the first input, which says at what speed to stand until a variation is worked out; ends at once.
    Begin,
    /// The speed varies; ends with a stop, an abort or a fault. A rise ends at its corner, or after twice its time.
    Running,
    /// The speed goes back to its mean; ends when it is there, or after twice the time that takes the motor.
    Stopping,
    /// Ended as asked for; ends with a start.
    Done,
    /// Ended with an error; ends with a start.
    Failed,
}

/// Cycles in which a change is worked out, at most: it may come when the work for another has just begun.
pub const WORKED_OUT: u32 = 20;

/// Two values of an input, side by side: aligned, so that a processor compares both at once.
#[derive(Debug, Clone, Copy, Default)]
#[repr(align(16))]
struct Pair([f64; 2]);

/// What no input is the same as.
const NOTHING_SEEN: [Pair; 2] = [Pair([f64::NAN; 2]); 2];

/// A speed variation of one spindle: plain data, no pointers. Speeds in rad/s, positive in the sense of rotation.
#[derive(Debug, Clone, Copy)]
pub struct SpeedVariation {
    plan: Plan,
    phase: Phase,
    /// First fault of this run.
    fault: Fault,
    /// Values of the input last seen, and what they ask for.
    seen: [Pair; 2],
    /// Its flags, on the way back; a stop may be asked for until it ends.
    flags: u32,
    asked: Asked,
    /// What the cycles go by, and what is being worked out to follow it.
    now: Setting,
    next: Setting,
    piece: Piece,
    /// Change of speed on the way back, and the way when it began.
    back: f64,
    way: f64,
    /// Cycles that it may take, and those left beside the ones granted.
    deadline: u32,
    patience: u32,
    /// It has ended, and the command is still on its way to the speed asked for.
    going: bool,
    speed: f64,
    /// Of a triangle: its sense, and how far the motor has left it behind since its last corner.
    rising: bool,
    behind: f64,
    /// Phasor of a sine: cosine half a cycle ago and sine now; twice the sine of half its turn in a cycle; its swing now.
    phasor: [f64; 2],
    turn: f64,
    swing: f64,
    /// Cycles left that need only the quick look, or would but for what is being worked out, and the change in one of them: of
    /// the speed on a slope, of a sine's swing.
    quiet: i32,
    meanwhile: i32,
    steady: f64,
    /// The speed goes along a slope: of a triangle, or back.
    slope: bool,
    /// Motor that bounds the change in a cycle.
    motor: Motor,
    /// Friction that helps to brake, without cutting, which may end at any moment.
    brake_help: f64,
    /// Change of speed in a cycle per N·m left to accelerate with.
    per_nm: f64,
    /// The motor's power and torque, torque used and viscous friction, each as the change of speed in a cycle that it makes.
    in_changes: [f64; 4],
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
            seen: NOTHING_SEEN,
            flags: 0,
            asked: Setting::still(0.0).asked,
            now: Setting::still(0.0),
            next: Setting::still(0.0),
            piece: Piece::Nothing,
            back: 0.0,
            way: 0.0,
            deadline: 0,
            patience: 0,
            going: false,
            speed: 0.0,
            rising: true,
            behind: 0.0,
            phasor: [1.0, 0.0],
            turn: 0.0,
            swing: 0.0,
            quiet: 0,
            meanwhile: 0,
            steady: 0.0,
            slope: true,
            motor: Plan::REST.motor,
            brake_help: 0.0,
            per_nm: 0.0,
            in_changes: [0.0; 4],
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
        let (last, to_rpm) = (self.output.speed_command_rpm, plan.sense * rpm_from_rad_s(1.0));
        // The first input may say no speed: then the spindle must not be stopped by an instance that has never commanded one.
        let speed_command_rpm = if plan.speed(last).is_ok() { last } else { plan.mean * to_rpm };
        *self = SpeedVariation {
            plan,
            speed: plan.mean,
            asked: Setting::still(plan.mean).asked,
            now: Setting::still(plan.mean),
            slope: plan.wave == Wave::Triangle,
            motor: plan.driving(plan.motor),
            per_nm: plan.change_per_nm(),
            to_torque: plan.sense * plan.motor.inertia / plan.cycle_s,
            to_rpm,
            output: SpeedVariationOutput { speed_command_rpm, ..Default::default() },
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

    /// Mean speed asked for last, rad/s.
    #[inline(always)]
    fn mean(&self) -> f64 {
        self.asked[0]
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
        if !self.quick(input) {
            self.turn(input);
        }
        &self.output
    }

    /// One cycle of the variation.
    #[inline(always)]
    fn advance(&mut self) {
        let (before, wanted) = match self.plan.wave {
            Wave::Triangle => (self.speed, self.triangle()),
            Wave::Sine => (self.speed, self.sine()),
        };
        self.go(wanted);
        let change = self.speed - before;
        self.grant(change);
        if self.slope && change < wanted {
            self.stay_behind(wanted - change);
        }
    }

    /// Goes by `wanted`, or as much of it as the motor has torque and power for at the speed that this leads to.
    #[inline(always)]
    fn go(&mut self, wanted: f64) {
        let higher = self.speed + wanted;
        let faster = if higher > self.speed { higher } else { self.speed };
        let left = self.motor.left(faster);
        let brake = left + self.brake_help;
        let up = if left > 0.0 { left * self.per_nm } else { 0.0 };
        let down = if brake > 0.0 { -brake * self.per_nm } else { 0.0 };
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
        let [low, high] = self.now.corners;
        let (speed, rate) = (self.speed, self.now.rate);
        if self.rising {
            let over = speed + rate - high;
            if over < 0.0 {
                return if speed < low { low - speed } else { rate };
            }
            (self.rising, self.behind) = (false, 0.0);
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

    /// The phasor a cycle on. Its sine is exactly one, its cosine half a cycle late; the length of neither drifts.
    #[inline(always)]
    fn turned(&self) -> [f64; 2] {
        let [cos, sin] = self.phasor;
        let cos = cos - self.turn * sin;
        [cos, sin + self.turn * cos]
    }

    /// Change toward the sine of this cycle.
    fn sine(&mut self) -> f64 {
        self.phasor = self.turned();
        let missing = self.now.swing - self.swing;
        self.swing += if missing > self.now.swing_rate { self.now.swing_rate } else { missing };
        self.now.asked[0] + self.swing * self.phasor[1] - self.speed
    }

    /// A cycle that `quick` declined: at rest, at a corner, on the way back, something changed or wrong.
    #[inline(never)]
    pub fn turn(&mut self, input: &SpeedVariationInput) {
        self.quiet += 1;
        if self.phase != Phase::Running || !self.same(input) {
            self.turn_unlike(input);
        } else if self.piece == Piece::Nothing {
            self.advance();
        } else {
            self.work();
            self.go_on();
        }
    }

    /// One cycle of what the cycles go by, with or without a look.
    #[inline(always)]
    fn go_on(&mut self) {
        if self.meanwhile > 0 && self.steadily() {
            self.meanwhile -= 1;
        } else {
            self.advance_beside();
        }
    }

    /// A cycle whose input asks for something else, or in which nothing varies.
    #[inline(never)]
    fn turn_unlike(&mut self, input: &SpeedVariationInput) {
        match self.phase {
            Phase::Idle | Phase::Done | Phase::Failed => self.rest(input),
            Phase::Stopping => match danger(input) {
                Some(fault) => self.leave(fault),
                None => (self.seen, self.flags) = (pairs(input), input.flags),
            },
            Phase::Begin | Phase::Running => {
                self.work();
                self.take(input);
            }
        }
        match self.phase {
            Phase::Running => self.go_on(),
            Phase::Stopping => self.go_back(input),
            _ => {}
        }
    }

    /// [`advance`](Self::advance) where there is more to do, so that the cycle with nothing else saves no registers.
    #[inline(never)]
    fn advance_beside(&mut self) {
        self.advance();
    }

    /// Takes over what this cycle's input asks for, to be worked out; or ends the variation.
    fn take(&mut self, input: &SpeedVariationInput) {
        self.seen = pairs(input);
        let begins = self.phase == Phase::Begin;
        let asked = match danger(input) {
            Some(fault) => Err(fault),
            None => self.plan.wanted(input.speed_rpm, input.amplitude_ratio, input.period_s, input.cutting_nm),
        };
        let before = self.asked[3];
        match asked {
            Ok(asked) => self.asked = asked,
            Err(fault) => {
                if begins {
                    self.rest(input);
                }
                return self.leave(fault);
            }
        }
        if begins {
            self.speed = self.asked[0];
            self.now = Setting::still(self.speed);
            self.output.speed_command_rpm = self.speed * self.to_rpm;
            self.enter(Phase::Running);
        }
        if self.piece == Piece::Nothing {
            self.begin_work();
        }
        if begins || self.asked[3] != before {
            self.load(self.asked[3]);
            self.look_anew();
        }
        // With the load of before the cycles go on as they were granted.
        (self.quiet, self.meanwhile) = (0, self.meanwhile.max(self.quiet));
        if input.flags & GIB_SPEED_VARIATION_STOP != 0 {
            self.set_out();
        }
    }

    /// Takes back what was granted.
    fn look_anew(&mut self) {
        (self.quiet, self.meanwhile) = (0, 0);
    }

    /// Counts with this cutting torque (N·m) from now on.
    fn load(&mut self, cutting: f64) {
        let used = self.plan.motor_cutting(cutting).used;
        self.motor.used = used;
        self.brake_help = self.plan.brake_help(used);
        let Motor { power, torque, viscous, .. } = self.motor;
        self.in_changes = [power, torque, used, viscous].map(|nm| nm * self.per_nm);
    }

    /// Begins to work out what is asked for, unless the cycles go by it already.
    fn begin_work(&mut self) {
        if self.asked != self.now.asked {
            self.piece = self.next.begin(&self.plan, self.asked);
        }
    }

    /// One piece of that. What is asked for meanwhile comes next.
    #[inline(never)]
    fn work(&mut self) {
        if self.piece != Piece::Nothing {
            if self.piece == Piece::Whole {
                self.go_by_next();
            }
            self.piece = self.next.work(&self.plan, self.piece);
            if self.piece == Piece::Nothing {
                self.begin_work();
            }
        }
    }

    /// From now on the cycles go by what was worked out. Less is granted at once; the speed follows at the motor's own pace.
    fn go_by_next(&mut self) {
        let next = self.next;
        self.output.amplitude_ratio = next.granted;
        self.output.amplitude_limit_ratio = next.possible;
        self.output.period_limit_s = next.shortest;
        let less = next.granted < next.asked[1] * (1.0 - 1e-9);
        self.output.message = if less { code(next.limit) } else { GIB_OK };
        // The phasor's cosine is half a cycle late, and the cycle's angle is another now.
        let ([cos, sin], [half_cos, half_sin]) = (self.phasor, self.now.half);
        let cos = (cos - sin * half_sin) / half_cos;
        let length = (cos * cos + sin * sin).sqrt();
        let (cos, sin) = if length > 0.5 { (cos / length, sin / length) } else { (1.0, 0.0) };
        self.phasor = [cos * next.half[0] + sin * next.half[1], sin];
        self.turn = 2.0 * next.half[1];
        self.swing = self.swing.min(next.swing);
        // What has stood begins upward.
        self.rising |= self.now.rate == 0.0;
        (self.now, self.behind) = (next, 0.0);
        self.look_anew();
    }

    fn enter(&mut self, phase: Phase) {
        self.phase = phase;
        self.look_anew();
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

/// The values of an input, for comparison.
#[inline(always)]
fn pairs(input: &SpeedVariationInput) -> [Pair; 2] {
    [Pair([input.speed_rpm, input.amplitude_ratio]), Pair([input.period_s, input.cutting_nm])]
}

/// Anything in this cycle's input that must end a variation.
#[inline(always)]
fn danger(input: &SpeedVariationInput) -> Option<Fault> {
    // What is no number makes the sum none; one so large that it overflows is looked at by name, too.
    let sum = (input.speed_rpm + input.amplitude_ratio) + (input.period_s + input.cutting_nm);
    let fine = sum.is_finite() && input.flags & !GIB_SPEED_VARIATION_STOP == 0;
    if fine { None } else { named(input) }
}

/// The name of what is wrong with an input.
#[cold]
fn named(input: &SpeedVariationInput) -> Option<Fault> {
    match input.flags & !GIB_SPEED_VARIATION_STOP {
        0 => {}
        flags if flags & GIB_INPUT_FAULT != 0 => return Some(Fault::of(GIB_ERR_DRIVE_FAULT)),
        flags if flags & GIB_INPUT_ABORT != 0 => return Some(Fault::of(GIB_ERR_ABORTED)),
        flags => {
            let (value, high) = (f64::from(flags), f64::from(GIB_SPEED_VARIATION_STOP));
            return Some(Fault { code: GIB_ERR_CONFIG, field: "flags\0", value, low: 0.0, high });
        }
    }
    let fields = [
        ("speed_rpm\0", input.speed_rpm),
        ("amplitude_ratio\0", input.amplitude_ratio),
        ("period_s\0", input.period_s),
        ("cutting_nm\0", input.cutting_nm),
    ];
    let (field, value) = fields.into_iter().find(|(_, value)| !value.is_finite())?;
    Some(Fault { code: GIB_ERR_NON_FINITE, field, value, low: f64::MIN, high: f64::MAX })
}
