//! What a path says: tilt, its uncertainty, the axes it is about; and whether there is anything to do.
//!
//! Tilt about y shows as a slope along x, tilt about x as one along y; by the right hand, about_y = −atan gₓ and
//! about_x = atan gᵧ. Uncertainties are expanded (k = 2): scatter of the blocks, wear that could not be told apart, and
//! the uncertainty of the table's rows, which scales the slope.

use super::config::GIB_TILT_TEACH;
use super::fit::{FEWEST, Fit};
use super::plan::Plan;
use super::table::two_point;
use super::trace::{Block, Counts, Trace};
use crate::error::*;

/// Not decided yet.
pub const GIB_TILT_UNDECIDED: i32 = 0;
/// Within the band that is left alone.
pub const GIB_TILT_IN_BAND: i32 = 1;
/// Not larger than its uncertainty: nothing is done.
pub const GIB_TILT_NOT_SIGNIFICANT: i32 = 2;
/// A tilt that is to be compensated.
pub const GIB_TILT_SIGNIFICANT: i32 = 3;
/// A cut of known depth was read.
pub const GIB_TILT_TAUGHT: i32 = 4;
/// The operator took the compensation off at the warning.
pub const GIB_TILT_DECLINED: i32 = 5;

/// The workpiece is tilted about x (rotary axis A): the slope is along y.
pub const GIB_TILT_ABOUT_X: i32 = 1;
/// The workpiece is tilted about y (rotary axis B): the slope is along x.
pub const GIB_TILT_ABOUT_Y: i32 = 2;
/// The path was one oblique line, which cannot tell the two apart: cut in a second direction.
pub const GIB_TILT_ABOUT_EITHER: i32 = 4;

/// Uncertainty of an angle that the path cannot tell, °.
const UNKNOWN_DEG: f64 = 90.0;
/// Cosine within which a line is along an axis: 10°.
const ALONG_AXIS: f64 = 0.985;

/// Share by which the growth of the apparent depth may be another at another depth: the depth-load curve bends.
const WEAR_BY_DEPTH: f64 = 0.1;

/// What was found. Angles in °; uncertainties are expanded, k = 2.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct TiltReport {
    /// Angle between the workpiece's plane and the path's, 0 or above.
    pub tilt_deg: f64,
    /// Its uncertainty.
    pub uncertainty_deg: f64,
    /// Tilt about x by the right hand; the surface rises along +y.
    pub about_x_deg: f64,
    /// Its uncertainty; 90 where the path cannot tell.
    pub about_x_uncertainty_deg: f64,
    /// Tilt about y by the right hand; the surface falls along +x.
    pub about_y_deg: f64,
    /// Its uncertainty; 90 where the path cannot tell.
    pub about_y_uncertainty_deg: f64,
    /// Slope of the surface along x, mm/mm.
    pub slope_x_ratio: f64,
    /// Slope of the surface along y, mm/mm.
    pub slope_y_ratio: f64,
    /// Direction of the path, or of its longer side, from +x toward +y, -90 to 90.
    pub path_deg: f64,
    /// Depth at the middle of the path as the tool of its start would see it, mm; 0 when teaching.
    pub depth_mm: f64,
    /// Load at the middle of the first pass; when teaching, of the path at the start's wear: the row to be added.
    pub load: f64,
    /// Standard uncertainty of that load.
    pub load_std: f64,
    /// Wear: share by which the apparent depth grows in a metre of cut; 0 where not told apart from tilt.
    pub wear_ratio_m: f64,
    /// Its uncertainty.
    pub wear_uncertainty_ratio_m: f64,
    /// The published rule on the first pass, its start and the point farthest from it: depths, mm; 0 outside the table.
    pub two_point_depth_mm: [f64; 2],
    /// The published rule's tilt.
    pub two_point_deg: f64,
    /// Scatter of a block about the plane, in load.
    pub scatter_load: f64,
    /// Offsets x y z at the start of the path, mm; 0 unless the tilt is to be compensated.
    pub offset_mm: [f64; 3],
    /// Offsets a b c.
    pub offset_deg: [f64; 3],
    /// Slope that z follows along x and y, mm/mm: all of the tilt, or what no rotary axis reaches.
    pub z_slope_ratio: [f64; 2],
    /// `GIB_TILT_IN_BAND` and so on.
    pub decision: i32,
    /// Sum of `GIB_TILT_ABOUT_…`: the axes about which the tilt is beyond its uncertainty.
    pub axes: i32,
    /// Sum of `GIB_TILT_ABOUT_…`: the axes that the directions of the path can tell.
    pub axes_seen: i32,
    /// 1: wear was told from tilt by reversed or repeated passes. 0: its expected amount is in the uncertainty.
    pub wear_separated: i32,
    /// 1: cut under another condition than the table's.
    pub flagged: i32,
    /// `GIB_TILT_FIT` or `GIB_TILT_TWO_POINT`.
    pub method: i32,
    /// Status of the step that ended the run, or of the last one.
    pub status: i32,
    /// Blocks that were fitted.
    pub blocks: u32,
    /// Of these, without weight: entry, exit, chips.
    pub rejected: u32,
    /// Blocks left out: spindle speed or feed of another condition.
    pub off_condition: u32,
    /// Blocks left out: load outside the table.
    pub outside_table: u32,
    /// Blocks left out: samples on too few phases of the current.
    pub aliased: u32,
}

/// Refuses a path that cannot be trusted.
///
/// # Errors
/// `GIB_ERR_TILT_…` with the count at fault and the count allowed.
pub fn trusted(plan: &Plan, trace: &Trace, fit: &Fit) -> Result<(), Fault> {
    let rejected = fit.rejected;
    let Counts { off_condition, outside, aliased } = trace.counts;
    let used = trace.blocks().len() as u32;
    let at_most = |code, field, value: u32, high: u32| {
        let (value, high) = (f64::from(value), f64::from(high));
        if value > high { Err(Fault { code, field, value, low: 0.0, high }) } else { Ok(()) }
    };
    at_most(GIB_ERR_TILT_ALIAS, "speed_rpm\0", aliased, (used + aliased) / 3)?;
    if !plan.flag {
        at_most(GIB_ERR_TILT_CONDITION, "off_condition\0", off_condition, (used + off_condition) / 3)?;
    }
    at_most(GIB_ERR_TILT_RANGE, "load\0", outside, (used + outside) / 3)?;
    // A load that never changes is none, and one that rests at one value alone is stuck there, at its limit, or too coarse for this
    // plane. One on a grid may rest at several for long, and in a cut of one depth at one; the waves of a current do not come out the
    // same twice.
    let waves = plan.squared > 0.0;
    let one_depth = plan.purpose == GIB_TILT_TEACH && !waves;
    let resting = match trace.on_grid() || one_depth {
        false => used.max(FEWEST as u32) / 20,
        true if waves => used.max(FEWEST as u32) / 3,
        true => used.saturating_sub(2),
    };
    at_most(GIB_ERR_TILT_DATA, "load\0", trace.repeated(), resting)?;
    // One at its limit says the same wherever it is there; what is not is then thrown out, and the rest has no scatter.
    at_most(GIB_ERR_TILT_DATA, "load\0", if fit.exact() && !one_depth { rejected } else { 0 }, 0)?;
    at_most(GIB_ERR_TILT_DATA, "position_mm\0", trace.jumped(), 0)?;
    if trace.blocks().len() < FEWEST {
        let (value, low) = (f64::from(used), FEWEST as f64);
        return Err(Fault {
            code: GIB_ERR_TILT_DATA,
            field: "blocks\0",
            value,
            low,
            high: super::trace::BLOCKS as f64,
        });
    }
    at_most(GIB_ERR_TILT_SHAPE, "rejected\0", rejected, used * 2 / 5)?;
    // Entries and exits that are so many come in two rows at least: a longer one is a load that jumped, and stayed there.
    at_most(GIB_ERR_TILT_SHAPE, "rejected\0", fit.in_a_row, used / 5)
}

/// Slopes along x and y with their covariance, whichever method.
struct Slope {
    at: [f64; 2],
    xx: f64,
    xy: f64,
    yy: f64,
}

/// Reads the result of a fit; the decision with it.
#[must_use]
pub fn report(plan: &Plan, trace: &Trace, fit: &Fit) -> TiltReport {
    let [near, far] = &fit.ends;
    let (dx, dy) = (far.x - near.x, far.y - near.y);
    let length = (dx * dx + dy * dy).sqrt();
    let points = two_point(&plan.inverse, [0.0, length], [near.load, far.load]).unwrap_or_default();
    let [c, s] = if plan.two_point && length > 0.0 { [dx / length, dy / length] } else { fit.along };
    let slope = if plan.two_point { by_points(fit, [c, s], points.slope, length) } else { by_fit(fit) };
    let deg = |slope: f64| slope.atan().to_degrees();
    // d atan g = dg/(1 + g²), doubled for k = 2.
    let wide = |variance: f64, g: f64| 2.0 * (variance.max(0.0).sqrt() / (1.0 + g * g)).to_degrees();
    let [gx, gy] = slope.at;
    let steep = (gx * gx + gy * gy).sqrt();
    let (p, q) = if steep > 0.0 { (gx / steep, gy / steep) } else { (c, s) };
    let along = p * p * slope.xx + 2.0 * p * q * slope.xy + q * q * slope.yy;
    let sideways = (q * q * slope.xx - 2.0 * p * q * slope.xy + p * p * slope.yy).max(0.0);
    // What the slope may have across makes it steeper by the Pythagorean rule: little beside a large one, in full where there is none.
    let steeper = 0.5 * ((steep * steep + 4.0 * sideways).sqrt() - steep);
    let reach = fit.extent().map(|[low, high]| high - low);
    let change = gx.abs() * reach[0] + gy.abs() * reach[1];
    let depth = fit.at(fit.centre[0], fit.centre[1]);
    let scale = plan.inverse.scale_std(depth - 0.5 * change, depth + 0.5 * change);
    let worn = WEAR_BY_DEPTH * fit.beta[3] * fit.centre[2];
    let scaled = |g: f64| (scale * scale + worn * worn) * g * g;
    let seen = if fit.planar && !plan.two_point { GIB_TILT_ABOUT_X | GIB_TILT_ABOUT_Y } else { across([c, s]) };
    let uncertainty = |variance: f64, g: f64, axis: i32| {
        if seen & axis != 0 { wide(variance + scaled(g), g) } else { UNKNOWN_DEG }
    };
    let gain = 0.5 * (near.gain + far.gain);
    let separated = fit.separable && !plan.two_point;
    let mut report = TiltReport {
        tilt_deg: deg(steep),
        uncertainty_deg: wide(along + steeper * steeper + scaled(steep), steep),
        about_x_deg: deg(gy),
        about_x_uncertainty_deg: uncertainty(slope.yy, gy, GIB_TILT_ABOUT_X),
        about_y_deg: -deg(gx),
        about_y_uncertainty_deg: uncertainty(slope.xx, gx, GIB_TILT_ABOUT_Y),
        slope_x_ratio: gx,
        slope_y_ratio: gy,
        path_deg: (s / c).atan().to_degrees(),
        depth_mm: depth,
        load: 0.5 * (near.load + far.load),
        load_std: fit.covariance[0][0].max(0.0).sqrt() * gain,
        wear_ratio_m: if separated { fit.beta[3] } else { 0.0 },
        wear_uncertainty_ratio_m: 2.0 * fit.covariance[3][3].max(0.0).sqrt(),
        two_point_depth_mm: points.depth_mm,
        two_point_deg: points.tilt_deg,
        scatter_load: fit.deviation,
        axes_seen: seen,
        wear_separated: i32::from(separated),
        flagged: i32::from(plan.differs || trace.counts.off_condition > 0 && plan.flag),
        method: i32::from(plan.two_point),
        ..counted(trace, fit)
    };
    for (axis, value, uncertainty) in [
        (GIB_TILT_ABOUT_X, report.about_x_deg, report.about_x_uncertainty_deg),
        (GIB_TILT_ABOUT_Y, report.about_y_deg, report.about_y_uncertainty_deg),
        (GIB_TILT_ABOUT_EITHER, report.tilt_deg, report.uncertainty_deg),
    ] {
        let told = seen & axis != 0 && value.abs() > uncertainty;
        report.axes |= if told { axis } else { 0 };
    }
    report.decision = if report.tilt_deg <= plan.band_deg || gain * change <= plan.band_load {
        GIB_TILT_IN_BAND
    } else if report.tilt_deg <= report.uncertainty_deg {
        GIB_TILT_NOT_SIGNIFICANT
    } else {
        GIB_TILT_SIGNIFICANT
    };
    report
}

/// What a cut of known depth gives: its mean load.
#[must_use]
pub fn taught(trace: &Trace, fit: &Fit) -> TiltReport {
    TiltReport {
        load: fit.at(fit.centre[0], fit.centre[1]),
        load_std: fit.covariance[0][0].max(0.0).sqrt(),
        scatter_load: fit.deviation,
        decision: GIB_TILT_TAUGHT,
        ..counted(trace, fit)
    }
}

/// The counts of blocks.
#[must_use]
pub fn counted(trace: &Trace, fit: &Fit) -> TiltReport {
    let Counts { off_condition, outside, aliased } = trace.counts;
    TiltReport {
        blocks: trace.blocks().len() as u32,
        rejected: fit.rejected,
        off_condition,
        outside_table: outside,
        aliased,
        ..TiltReport::default()
    }
}

/// The axis that a line in this direction can tell: the one across it.
fn across([c, s]: [f64; 2]) -> i32 {
    if c.abs() > ALONG_AXIS {
        GIB_TILT_ABOUT_Y
    } else if s.abs() > ALONG_AXIS {
        GIB_TILT_ABOUT_X
    } else {
        GIB_TILT_ABOUT_EITHER
    }
}

fn by_fit(fit: &Fit) -> Slope {
    let [c, s] = fit.along;
    let [_, u, v, _] = fit.beta;
    let (uu, uv, vv) = (fit.covariance[1][1], fit.covariance[1][2], fit.covariance[2][2]);
    Slope {
        at: [c * u - s * v, s * u + c * v],
        xx: c * c * uu - 2.0 * c * s * uv + s * s * vv,
        xy: c * s * (uu - vv) + (c * c - s * s) * uv,
        yy: s * s * uu + 2.0 * c * s * uv + c * c * vv,
    }
}

/// Two readings, each with the scatter of a block, or with what it departs from the plane where that is more, as in a chip or
/// at an entry; and with the wear between them, which looks like a slope and which two points cannot tell.
fn by_points(fit: &Fit, [c, s]: [f64; 2], slope: f64, length: f64) -> Slope {
    let [near, far] = &fit.ends;
    let error = |end: &Block| fit.deviation.max(fit.residual(end).abs()) / end.gain.max(1e-300);
    let wear = fit.beta[3] * fit.beta[3] + fit.covariance[3][3].max(0.0);
    let (one, other, worn) = (error(near), error(far), fit.at(far.x, far.y) * (far.cut - near.cut));
    let variance = (one * one + other * other + wear * worn * worn) / (length * length).max(1e-6);
    Slope { at: [c * slope, s * slope], xx: c * c * variance, xy: c * s * variance, yy: s * s * variance }
}
