//! The offsets of x y z a b c that undo a tilt.
//!
//! The workpiece's surface is the plane z = gₓ·x + gᵧ·y (mm/mm) with the normal n = (−gₓ, −gᵧ, 1). Rotary axes that turn
//! the workpiece turn n toward the tool, those that turn the tool turn the tool toward n; Newton's method finds the two
//! angles for which the two fall together, in the machine's coordinates:
//!
//! ```text
//! rotation = R(u₁, δ₁) · R(u₂, δ₂)      u₁ the first axis, u₂ the second as the first has turned it
//! ```
//!
//! Whatever slope no rotary axis reaches stays z's: z += g·(x, y), which for three axes is all of it (tan 1° = 0.017455 a
//! mm; the print has 0.0174). A point p of the workpiece moves by (R − 1)(p − pivot) when the workpiece turns, and x y z
//! follow it; the tip of a tool that turns moves likewise, and x y z take that back. A kernel that keeps the tool at the
//! workpiece itself needs neither: x y z stay unchanged, as published.

use super::config::{GIB_TILT_AXIS_NONE, TiltRotary};

/// A vector in machine coordinates.
pub type Vector = [f64; 3];

/// Steps of Newton's method; the last changes nothing at any angle that is allowed.
pub const ITERATIONS: u32 = 6;
/// An axis that moves the normal by less than this a radian does not reach it.
const REACH: f64 = 0.2;

/// Search for the angles of the rotary axes; plain data, one iteration a step.
#[derive(Debug, Clone, Copy)]
pub struct Search {
    axes: [Axis; 2],
    normal: Vector,
    /// Angles found, rad, by the right hand about each axis.
    angles: [f64; 2],
}

/// One rotary axis at the angles of the measurement.
#[derive(Debug, Clone, Copy, Default)]
struct Axis {
    present: bool,
    turns_tool: bool,
    direction: Vector,
    pivot: Vector,
    sense: f64,
    letter: usize,
}

/// What undoes the tilt: constants for x y a b c, a plane for z.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Offsets {
    /// x y z, mm; to z comes the slope.
    pub linear: Vector,
    /// a b c, °.
    pub angular: Vector,
    /// What is left to z, mm/mm along x and y.
    pub slope: [f64; 2],
}

fn dot(a: &Vector, b: &Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn minus(a: &Vector, b: &Vector) -> Vector {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn plus(a: &Vector, b: &Vector) -> Vector {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

fn cross(a: &Vector, b: &Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// `v` turned about the unit vector `u` by an angle in rad (Rodrigues). Never inlined: the sine is then called by its name,
/// which the proof of real time can follow.
#[inline(never)]
fn turned(v: &Vector, u: &Vector, angle: f64) -> Vector {
    let (sin, cos) = (angle.sin(), angle.cos());
    let (side, along) = (cross(u, v), dot(u, v) * (1.0 - cos));
    [
        v[0] * cos + side[0] * sin + u[0] * along,
        v[1] * cos + side[1] * sin + u[1] * along,
        v[2] * cos + side[2] * sin + u[2] * along,
    ]
}

impl Search {
    /// Nothing to search.
    pub const REST: Search = Search {
        axes: [Axis { present: false, turns_tool: false, direction: [0.0; 3], pivot: [0.0; 3], sense: 1.0, letter: 0 };
            2],
        normal: [0.0, 0.0, 1.0],
        angles: [0.0; 2],
    };

    /// A plane with slopes along x and y, under rotary axes that stand at `angles_deg` (a b c).
    #[must_use]
    pub fn new(rotary: &[TiltRotary; 2], angles_deg: &Vector, slope: [f64; 2]) -> Search {
        let length = (1.0 + slope[0] * slope[0] + slope[1] * slope[1]).sqrt();
        let mut search = Search { normal: [-slope[0] / length, -slope[1] / length, 1.0 / length], ..Search::REST };
        for (axis, given) in search.axes.iter_mut().zip(rotary) {
            let letter = (given.axis - 1).clamp(0, 2) as usize;
            let mut direction = [0.0; 3];
            direction[letter] = 1.0;
            let sense = f64::from(given.sense);
            let (present, turns_tool) = (given.axis != GIB_TILT_AXIS_NONE, given.turns_tool != 0);
            *axis = Axis { present, turns_tool, direction, pivot: given.pivot_mm, sense, letter };
        }
        let [first, second] = &mut search.axes;
        if first.present && first.turns_tool == second.turns_tool {
            let angle = first.sense * angles_deg[first.letter].to_radians();
            second.direction = turned(&second.direction, &first.direction, angle);
        }
        search
    }

    /// The axes with their angles. The second axis is carried by the first, so it turns first.
    fn inner_first(&self) -> [(&Axis, f64); 2] {
        let ([first, second], [by_first, by_second]) = (&self.axes, self.angles);
        [(second, by_second), (first, by_first)]
    }

    /// A vector that belongs to the workpiece or to the tool, turned by the axes that turn that side.
    fn turned(&self, v: &Vector, tool: bool) -> Vector {
        let mut v = *v;
        for (axis, angle) in self.inner_first() {
            if axis.present && axis.turns_tool == tool {
                v = turned(&v, &axis.direction, angle);
            }
        }
        v
    }

    /// How a point of that side moves, when x y z stand.
    fn moved(&self, point: &Vector, tool: bool) -> Vector {
        let mut p = *point;
        for (axis, angle) in self.inner_first() {
            if axis.present && axis.turns_tool == tool {
                p = plus(&axis.pivot, &turned(&minus(&p, &axis.pivot), &axis.direction, angle));
            }
        }
        minus(&p, point)
    }

    /// The second axis as the first has turned it.
    fn second_as_carried(&self) -> Axis {
        let [first, second] = self.axes;
        if !first.present || first.turns_tool != second.turns_tool {
            return second;
        }
        Axis { direction: turned(&second.direction, &first.direction, self.angles[0]), ..second }
    }

    /// One iteration.
    pub fn step(&mut self) {
        let (normal, tool) = (self.turned(&self.normal, false), self.turned(&[0.0, 0.0, 1.0], true));
        let left = minus(&tool, &normal);
        // A rad of an axis moves the normal by u × n, or the tool, whose motion counts the other way.
        let column = |axis: &Axis| {
            let by = if axis.turns_tool { cross(&tool, &axis.direction) } else { cross(&axis.direction, &normal) };
            if axis.present { [by[0], by[1]] } else { [0.0; 2] }
        };
        let [a, b] = [column(&self.axes[0]), column(&self.second_as_carried())];
        let along = |c: &[f64; 2]| (c[0] * left[0] + c[1] * left[1]) / (c[0] * c[0] + c[1] * c[1]).max(1e-12);
        let (aa, bb) = (a[0] * a[0] + a[1] * a[1], b[0] * b[0] + b[1] * b[1]);
        let both = a[0] * b[1] - a[1] * b[0];
        let mut by = [0.0; 2];
        if both * both > REACH * REACH {
            by = [(left[0] * b[1] - left[1] * b[0]) / both, (a[0] * left[1] - a[1] * left[0]) / both];
        } else if aa.max(bb) > REACH * REACH {
            by = if bb > aa { [0.0, along(&b)] } else { [along(&a), 0.0] };
        }
        self.angles[0] += by[0];
        self.angles[1] += by[1];
    }

    /// The offsets for the angles found. `point`: where on the surface, in machine coordinates, the offset of z is 0 but for
    /// the motion of the pivots.
    #[must_use]
    pub fn offsets(&self, point: &Vector, tool_centre_point: bool) -> Offsets {
        let mut offsets = Offsets::default();
        for (axis, angle) in self.inner_first() {
            if let Some(letter) = offsets.angular.get_mut(axis.letter).filter(|_| axis.present) {
                *letter += axis.sense * angle.to_degrees();
            }
        }
        let normal = self.turned(&self.normal, false);
        offsets.slope = [-normal[0] / normal[2].max(0.1), -normal[1] / normal[2].max(0.1)];
        if !tool_centre_point {
            offsets.linear = minus(&self.moved(point, false), &self.moved(&[0.0; 3], true));
        }
        offsets
    }
}

#[cfg(test)]
mod tests {
    use super::super::config::{GIB_TILT_AXIS_A, GIB_TILT_AXIS_B, GIB_TILT_AXIS_C};
    use super::*;
    use proptest::prelude::*;

    fn rotary(axis: i32, turns_tool: i32, sense: i32, pivot_mm: Vector) -> TiltRotary {
        TiltRotary { axis, turns_tool, sense, reserved: 0, pivot_mm }
    }

    const NONE: TiltRotary = TiltRotary { axis: 0, turns_tool: 0, sense: 1, reserved: 0, pivot_mm: [0.0; 3] };

    fn solved(axes: [TiltRotary; 2], angles: Vector, slope: [f64; 2]) -> Search {
        let mut search = Search::new(&axes, &angles, slope);
        (0..ITERATIONS).for_each(|_| search.step());
        search
    }

    #[test]
    fn three_axes_leave_all_to_z() {
        let offsets = solved([NONE; 2], [0.0; 3], [0.02, -0.01]).offsets(&[1.0, 2.0, 3.0], false);
        assert!((offsets.slope[0] - 0.02).abs() < 1e-15 && (offsets.slope[1] + 0.01).abs() < 1e-15);
        assert_eq!((offsets.linear, offsets.angular), ([0.0; 3], [0.0; 3]));
    }

    /// A slope along x is a turn about y: B by θ, and with the kernel's tool centre point x y z unchanged.
    #[test]
    fn the_published_case_turns_one_axis_by_theta() {
        let theta = 1.373_764f64;
        let axes = [rotary(GIB_TILT_AXIS_B, 0, 1, [0.0; 3]), NONE];
        let offsets = solved(axes, [0.0; 3], [theta.to_radians().tan(), 0.0]).offsets(&[50.0, 0.0, 0.0], true);
        assert!((offsets.angular[1] - theta).abs() < 1e-9, "{offsets:?}");
        assert_eq!(offsets.linear, [0.0; 3]);
        assert!(offsets.slope[0].abs() < 1e-12 && offsets.slope[1].abs() < 1e-12);
    }

    /// C above a level A: it spins about the tool and reaches nothing, so what A cannot do stays z's.
    #[test]
    fn what_no_axis_reaches_stays_with_z() {
        let axes = [rotary(GIB_TILT_AXIS_A, 0, 1, [0.0; 3]), rotary(GIB_TILT_AXIS_C, 0, 1, [0.0; 3])];
        let offsets = solved(axes, [0.0; 3], [0.02, 0.01]).offsets(&[0.0; 3], true);
        assert!((offsets.slope[0] - 0.02).abs() < 1e-5 && offsets.slope[1].abs() < 1e-9, "{offsets:?}");
        assert!((offsets.angular[0] + 0.01f64.atan().to_degrees()).abs() < 1e-4 && offsets.angular[2] == 0.0);
    }

    /// The same rotation written out with matrices, axis by axis, as a kinematic chain would have it.
    fn chain(axes: &[TiltRotary; 2], angles: Vector, offsets: &Offsets, v: Vector, tool: bool) -> Vector {
        let mut v = v;
        let side = |axis: &TiltRotary| axis.axis != 0 && (axis.turns_tool != 0) == tool;
        let about = |axis: &TiltRotary, degrees: f64, v: Vector| {
            let (s, c) = (f64::from(axis.sense) * degrees).to_radians().sin_cos();
            let [x, y, z] = v;
            match axis.axis {
                1 => [x, c * y - s * z, s * y + c * z],
                2 => [c * x + s * z, y, c * z - s * x],
                _ => [c * x - s * y, s * x + c * y, z],
            }
        };
        let letter = |axis: &TiltRotary| (axis.axis - 1) as usize;
        // Back to zero from the angles of the measurement, then out to the new ones.
        for axis in axes.iter().filter(|axis| side(axis)) {
            v = about(axis, -angles[letter(axis)], v);
        }
        for axis in axes.iter().rev().filter(|axis| side(axis)) {
            v = about(axis, angles[letter(axis)] + offsets.angular[letter(axis)], v);
        }
        v
    }

    proptest! {
        /// Any two axes, any order, any side, any angles: where both directions are reached, the turned normal and the
        /// turned tool fall together in the chain written out; where not, z's slope is that of the turned plane.
        #[test]
        fn normal_and_tool_fall_together(
            first in 1..4i32, other in 1..3i32, sides in 0..4i32, senses in 0..4i32,
            a in -100.0..100.0f64, b in -100.0..100.0f64, c in -100.0..100.0f64,
            gx in -0.035..0.035f64, gy in -0.035..0.035f64,
        ) {
            let sense = |bit: i32| if senses & bit != 0 { -1 } else { 1 };
            let second = (first - 1 + other) % 3 + 1;
            let axes = [rotary(first, sides & 1, sense(1), [0.0; 3]), rotary(second, sides >> 1, sense(2), [0.0; 3])];
            let angles = [a, b, c];
            let search = solved(axes, angles, [gx, gy]);
            let offsets = search.offsets(&[0.0; 3], true);
            let normal = chain(&axes, angles, &offsets, search.normal, false);
            let tool = chain(&axes, angles, &offsets, [0.0, 0.0, 1.0], true);
            let apart = (normal[0] - tool[0]).hypot(normal[1] - tool[1]);
            prop_assert!(apart <= gx.hypot(gy) * 1.02 + 1e-9, "worse than before: {apart}");
            prop_assert!((offsets.slope[0] + normal[0] / normal[2]).abs() < 1e-9);
            prop_assert!((offsets.slope[1] + normal[1] / normal[2]).abs() < 1e-9);
            let reach = |i: usize| search.axes[i].direction;
            let (u, v) = (reach(0), reach(1));
            if (u[0] * v[1] - u[1] * v[0]).abs() > 0.3 {
                prop_assert!(apart < 1e-14, "{apart} {offsets:?}");
                let mut once_more = search;
                once_more.step();
                prop_assert!((0..2).all(|i| (once_more.angles[i] - search.angles[i]).abs() < 1e-13));
            }
        }

        /// Without the kernel's help x y z follow the pivot: the point of the workpiece under the tool stays under it.
        #[test]
        fn the_point_stays_under_the_tool(
            px in -200.0..200.0f64, py in -200.0..200.0f64, pz in -200.0..200.0f64,
            gx in -0.03..0.03f64, gy in -0.03..0.03f64,
        ) {
            let pivot = [px, py, pz];
            let axes = [rotary(GIB_TILT_AXIS_A, 0, 1, pivot), rotary(GIB_TILT_AXIS_B, 0, -1, pivot)];
            let search = solved(axes, [0.0; 3], [gx, gy]);
            let point = [30.0, -20.0, 50.0];
            let offsets = search.offsets(&point, false);
            let turned = chain(&axes, [0.0; 3], &offsets, minus(&point, &pivot), false);
            let moved = minus(&plus(&pivot, &turned), &point);
            for i in 0..3 {
                prop_assert!((moved[i] - offsets.linear[i]).abs() < 1e-9);
            }
        }
    }

    /// A tool that turns about a pivot 200 mm above its tip swings the tip aside; x takes it back.
    #[test]
    fn the_tip_of_a_turned_tool_is_brought_back() {
        let axes = [rotary(GIB_TILT_AXIS_B, 1, 1, [0.0, 0.0, 200.0]), NONE];
        let offsets = solved(axes, [0.0; 3], [0.02, 0.0]).offsets(&[10.0, 0.0, 0.0], false);
        // The tool leans with the normal, toward −x: B turns by −θ, the tip swings to +x, x goes back.
        let theta = 0.02f64.atan();
        assert!((offsets.angular[1] + theta.to_degrees()).abs() < 1e-9, "{offsets:?}");
        assert!((offsets.linear[0] + 200.0 * theta.sin()).abs() < 1e-9, "{offsets:?}");
        // The surface is as it was: z follows it.
        assert!((offsets.slope[0] - 0.02).abs() < 1e-12);
    }
}
