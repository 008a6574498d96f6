//! The usual cycle: in the cut within a block, or with all offsets but z's at rest and z following the path, or at rest.
//!
//! It does what any other cycle would do, without asking for all that can happen. After any other cycle that one says what
//! the next can be, and in the cut for how many more.

use super::*;

/// What a usual cycle is now, where z does not follow the path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Usual {
    /// There is none.
    None,
    /// In the cut.
    Cut,
    /// Not busy.
    Rest,
}

/// Beyond any machine; squares and sums of smaller numbers stay finite.
pub const HUGE: f64 = 1e12;

/// Whether every number of an input is finite and not huge. Comparisons with NaN are false.
#[inline(always)]
pub fn sound(input: &TiltInput) -> bool {
    let [x, y, z] = input.position_mm;
    let [a, b, c] = input.rotary_deg;
    let (load, speed) = (input.load, input.speed_rpm);
    // In pairs, which one instruction can square.
    let (even, odd) = ((x * x + z * z) + (b * b + load * load), (y * y + a * a) + (c * c + speed * speed));
    even + odd < HUGE * HUGE
}

/// Of all numbers of an input: no number where one of them is none.
#[inline(always)]
fn sum(input: &TiltInput) -> f64 {
    let ([x, y, z], [a, b, c]) = (input.position_mm, input.rotary_deg);
    let pairs = [[x, y], [z, a], [b, c], [input.load, input.speed_rpm]].map(f64x2::new);
    let [even, odd] = ((pairs[0] + pairs[1]) + (pairs[2] + pairs[3])).to_array();
    even + odd
}

impl Tilt {
    /// One servo cycle; returns the status.
    #[inline(always)]
    pub fn step(&mut self, input: &TiltInput, output: &mut TiltOutput) -> i32 {
        if self.quick(input) {
            *output = self.output;
            return output.status;
        }
        self.careful(input, output)
    }

    #[inline(never)]
    fn careful(&mut self, input: &TiltInput, output: &mut TiltOutput) -> i32 {
        // What usual cycles in the cut have put off.
        self.unfollow();
        let done = self.granted - self.alike;
        self.cut_left -= done;
        self.block.count(done);
        (self.alike, self.granted) = (0, 0);
        self.any(input);
        self.see_usual();
        *output = self.output;
        output.status
    }

    /// Ends the usual cycles in which z follows the path.
    pub(super) fn unfollow(&mut self) {
        if self.following {
            self.followers[2].meant();
            self.following = false;
        }
    }

    /// Says what the next cycles can be.
    fn see_usual(&mut self) {
        self.following = self.phase == Phase::Active && self.settled;
        if self.following {
            let z = &self.plan.linear;
            // So near the largest offset that braking within it may be due, other cycles see to that.
            let speed = z.speed.min(z.stops(0.25 * z.most));
            self.bounds = [[z.most - z.braking(speed), speed], [HUGE, z.acceleration]].map(f64x2::new);
        }
        self.usual = match self.phase {
            Phase::Measuring if self.cutting => {
                self.granted = self.block.most_more().min(self.cut_left);
                self.alike = self.granted;
                if self.granted > 0 { Usual::Cut } else { Usual::None }
            }
            Phase::Idle | Phase::Done | Phase::Failed => Usual::Rest,
            _ => Usual::None,
        };
    }

    /// Does this cycle if it is a usual one; else returns false with nothing changed.
    #[inline(always)]
    fn quick(&mut self, input: &TiltInput) -> bool {
        if self.following {
            return self.quick_z(input);
        }
        if self.usual != Usual::Cut {
            return self.usual == Usual::Rest;
        }
        if input.flags != GIB_TILT_INPUT_CUTTING || !sound(input) || !self.block.usual(&self.plan, input) {
            return false;
        }
        self.alike -= 1;
        if self.alike == 0 {
            self.usual = Usual::None;
        }
        true
    }

    /// Z steps onto the path's plane, with all other offsets at rest; false where it may not.
    #[inline(always)]
    fn quick_z(&mut self, input: &TiltInput) -> bool {
        let target = self.z_target(input);
        let [_, _, z, ..] = &mut self.followers;
        let [step, change] = z.onto(target);
        // Comparisons with what is no number are false.
        let [near, slow] = self.bounds;
        let near = f64x2::new([target, step]).abs().simd_le(near);
        let slow = f64x2::new([sum(input), change]).abs().simd_le(slow);
        let met = (near & slow).to_bitmask().wrapping_sub(3) | input.flags & !GIB_TILT_INPUT_CUTTING == 0;
        if met {
            z.land(target, step);
            self.output.offset_mm[2] = target;
        }
        met
    }
}
