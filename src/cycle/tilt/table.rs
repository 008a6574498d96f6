//! The load table: depth of cut → spindle load under one machining condition, and its inverse.
//!
//! Rows come from cuts of known depth. The published rule interpolates depth from load along straight lines; with
//! depths d₁, d₂ at two positions p₁, p₂ of the path the tilt is θ = atan(|d₁ − d₂| ÷ |p₁ − p₂|). The curve bends
//! between rows, so the plane fit uses a cubic that passes through the rows and stays monotone (Fritsch and Butland 1984,
//! harmonic mean of the neighbouring slopes).

use crate::error::{Fault, GIB_ERR_TILT_RANGE, GIB_ERR_TILT_TABLE, in_range};

/// Rows that a table can hold.
pub const GIB_TILT_ROWS: usize = 32;

/// A machining condition. A table holds for one only.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct TiltCondition {
    /// Number of the tool, any.
    pub tool_id: u32,
    /// Number of the material, any.
    pub material_id: u32,
    /// Spindle speed, 1 to 1000000 min⁻¹.
    pub speed_rpm: f64,
    /// Feed along the path, 0.1 to 1000000 mm/min.
    pub feed_mm_min: f64,
}

/// Load by depth of cut under one condition, in the order of depth. Plain numbers: fill it by hand, by
/// `gib_tilt_table_add` or from a file.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TiltTable {
    /// Size of this struct as the caller knows it: `sizeof(gib_tilt_table)`. Required.
    pub struct_size: u32,
    /// Rows in use, up to `GIB_TILT_ROWS`; a measurement needs 2.
    pub rows: u32,
    /// The condition under which the rows were cut.
    pub condition: TiltCondition,
    /// `GIB_TILT_AC_CURRENT` or `GIB_TILT_DC_LOAD`: what the loads are.
    pub signal: i32,
    /// Zero.
    pub reserved: i32,
    /// Depth of cut of each row, mm, rising.
    pub depth_mm: [f64; GIB_TILT_ROWS],
    /// Load of each row, rising.
    pub load: [f64; GIB_TILT_ROWS],
    /// Standard uncertainty of each load; 0: not known, taken as exact.
    pub load_std: [f64; GIB_TILT_ROWS],
    /// Cuts that each row is the mean of.
    pub cuts: [u32; GIB_TILT_ROWS],
}

impl Default for TiltTable {
    fn default() -> TiltTable {
        TiltTable {
            struct_size: size_of::<TiltTable>() as u32,
            rows: 0,
            condition: TiltCondition::default(),
            signal: 0,
            reserved: 0,
            depth_mm: [0.0; GIB_TILT_ROWS],
            load: [0.0; GIB_TILT_ROWS],
            load_std: [0.0; GIB_TILT_ROWS],
            cuts: [0; GIB_TILT_ROWS],
        }
    }
}

/// Depths nearer to each other than this are the same row, mm.
const SAME_DEPTH_MM: f64 = 1e-6;

impl TiltCondition {
    /// Checks the ranges.
    ///
    /// # Errors
    /// `GIB_ERR_CONFIG` with the field.
    pub fn check(&self) -> Result<(), Fault> {
        in_range("condition.speed_rpm\0", self.speed_rpm, 1.0, 1e6)?;
        in_range("condition.feed_mm_min\0", self.feed_mm_min, 0.1, 1e6)?;
        Ok(())
    }

    /// What makes this another condition than `other`, which allows speed and feed to differ by a share.
    #[must_use]
    pub fn differs_from(&self, other: &TiltCondition, tolerance: f64) -> Option<Fault> {
        let fault = |field, value, low, high| {
            Some(Fault { code: crate::error::GIB_ERR_TILT_CONDITION, field, value, low, high })
        };
        let (tool, material) = (f64::from(other.tool_id), f64::from(other.material_id));
        if self.tool_id != other.tool_id {
            return fault("condition.tool_id\0", f64::from(self.tool_id), tool, tool);
        }
        if self.material_id != other.material_id {
            return fault("condition.material_id\0", f64::from(self.material_id), material, material);
        }
        for (field, own, their) in [
            ("condition.speed_rpm\0", self.speed_rpm, other.speed_rpm),
            ("condition.feed_mm_min\0", self.feed_mm_min, other.feed_mm_min),
        ] {
            if !((own - their).abs() <= tolerance * their) {
                return fault(field, own, their * (1.0 - tolerance), their * (1.0 + tolerance));
            }
        }
        None
    }
}

impl TiltTable {
    /// Size of the struct in the first published ABI.
    pub const FIRST_SIZE: usize = 936;

    /// Adds a cut: its depth in mm, its mean load, and that mean's standard uncertainty. A further cut of a depth that is
    /// there joins its row. The order of depth is kept; whether the loads rise too is [`TiltTable::check`]'s to say.
    ///
    /// # Errors
    /// `GIB_ERR_CONFIG` for a number out of range, `GIB_ERR_TILT_TABLE` when all rows are used.
    pub fn add(&mut self, depth_mm: f64, load: f64, load_std: f64) -> Result<(), Fault> {
        in_range("depth_mm\0", depth_mm, 0.0, 1000.0)?;
        in_range("load\0", load, 0.0, 1e9)?;
        in_range("load_std\0", load_std, 0.0, 1e9)?;
        let rows = self.used()?;
        let place = self.depth_mm.iter().take(rows).position(|d| *d > depth_mm - SAME_DEPTH_MM).unwrap_or(rows);
        if place < rows && (self.depth_mm[place] - depth_mm).abs() < SAME_DEPTH_MM {
            let n = f64::from(self.cuts[place].max(1));
            let shift = (load - self.load[place]) / (n + 1.0);
            let joint = f64::hypot(n * self.load_std[place], load_std) / (n + 1.0);
            self.load[place] += shift;
            // Cuts that disagree by more than they claim to know are no more certain than their disagreement.
            self.load_std[place] = joint.max(shift.abs());
            self.cuts[place] = self.cuts[place].max(1).saturating_add(1);
            return Ok(());
        }
        if rows == GIB_TILT_ROWS {
            let high = GIB_TILT_ROWS as f64;
            return Err(Fault { code: GIB_ERR_TILT_TABLE, field: "rows\0", value: high + 1.0, low: 0.0, high });
        }
        for column in [&mut self.depth_mm, &mut self.load, &mut self.load_std] {
            column.copy_within(place..rows, place + 1);
        }
        self.cuts.copy_within(place..rows, place + 1);
        self.depth_mm[place] = depth_mm;
        self.load[place] = load;
        self.load_std[place] = load_std;
        self.cuts[place] = 1;
        self.rows += 1;
        Ok(())
    }

    fn used(&self) -> Result<usize, Fault> {
        in_range("rows\0", f64::from(self.rows), 0.0, GIB_TILT_ROWS as f64).map(|rows| rows as usize)
    }

    /// Checks that a measurement can use the table: two rows at least, depths and loads finite and strictly rising, and no
    /// two neighbouring loads that are the same within twice their uncertainties.
    ///
    /// # Errors
    /// `GIB_ERR_TILT_TABLE` with the column, the value at fault and what it must be above; `GIB_ERR_CONFIG`.
    pub fn check(&self) -> Result<(), Fault> {
        let rows = self.used()?;
        let fault = |field, value, low| Err(Fault { code: GIB_ERR_TILT_TABLE, field, value, low, high: f64::MAX });
        self.condition.check()?;
        in_range("signal\0", f64::from(self.signal), 0.0, 1.0)?;
        if rows < 2 {
            return Err(Fault {
                code: GIB_ERR_TILT_TABLE,
                field: "rows\0",
                value: rows as f64,
                low: 2.0,
                high: GIB_TILT_ROWS as f64,
            });
        }
        let (mut depth, mut load, mut std) = (-SAME_DEPTH_MM, -1e-300, 0.0);
        for row in 0..rows {
            let (d, l, s) = (self.depth_mm[row], self.load[row], self.load_std[row]);
            if !(d > depth && d <= 1000.0) {
                return fault("depth_mm\0", d, depth);
            }
            if !(s >= 0.0 && s <= 1e9) {
                return fault("load_std\0", s, 0.0);
            }
            let least = if row == 0 { load } else { load + 2.0 * f64::hypot(s, std) };
            if !(l > least && l <= 1e9) {
                return fault("load\0", l, least);
            }
            (depth, load, std) = (d, l, s);
        }
        Ok(())
    }
}

/// The inverse of a checked table, load → depth, with what a cycle needs worked out.
#[derive(Debug, Clone, Copy)]
pub struct Inverse {
    rows: usize,
    load: [f64; GIB_TILT_ROWS],
    depth: [f64; GIB_TILT_ROWS],
    /// Standard uncertainty of each row as a depth, mm.
    depth_std: [f64; GIB_TILT_ROWS],
    /// Slope at each row, mm per unit of load.
    slope: [f64; GIB_TILT_ROWS],
}

/// Share of the first and last interval by which a load may lie outside the table and still be read.
const MARGIN: f64 = 0.1;

impl Inverse {
    /// What holds before the first start.
    pub const REST: Inverse = Inverse {
        rows: 0,
        load: [0.0; GIB_TILT_ROWS],
        depth: [0.0; GIB_TILT_ROWS],
        depth_std: [0.0; GIB_TILT_ROWS],
        slope: [0.0; GIB_TILT_ROWS],
    };

    /// Checks a table and works out its inverse.
    ///
    /// # Errors
    /// As [`TiltTable::check`].
    pub fn new(table: &TiltTable) -> Result<Inverse, Fault> {
        table.check()?;
        let rows = (table.rows as usize).min(GIB_TILT_ROWS);
        let mut inverse = Inverse { rows, load: table.load, depth: table.depth_mm, ..Inverse::REST };
        let secant = |i: usize| {
            let (dl, dd) = (table.load[i + 1] - table.load[i], table.depth_mm[i + 1] - table.depth_mm[i]);
            (dd / dl, dl)
        };
        for i in 0..rows {
            inverse.slope[i] = match i {
                0 => secant(0).0,
                _ if i + 1 == rows => secant(i - 1).0,
                _ => {
                    let ((s, h), (t, k)) = (secant(i - 1), secant(i));
                    let share = (h + 2.0 * k) / (3.0 * (h + k));
                    s * t / (share * t + (1.0 - share) * s)
                }
            };
            inverse.depth_std[i] = table.load_std[i] * inverse.slope[i];
        }
        // The first and last slope from a parabola where that stays monotone: a straight end would bend the curve.
        if rows > 2 {
            let ends = [(0, secant(0), secant(1)), (rows - 1, secant(rows - 2), secant(rows - 3))];
            for (i, (s, h), (t, k)) in ends {
                let end = ((2.0 * h + k) * s - h * t) / (h + k);
                inverse.slope[i] = end.max(0.1 * s).min(3.0 * s);
            }
        }
        Ok(inverse)
    }

    /// Row at the lower end of the interval in which a load lies.
    fn interval(&self, load: f64) -> usize {
        let last = self.rows.saturating_sub(2);
        let mut low = 0;
        for row in 1..GIB_TILT_ROWS - 1 {
            if row <= last && load >= self.load[row] {
                low = row;
            }
        }
        low
    }

    /// Depth (mm) of a load along straight lines, as published. None outside the table.
    #[must_use]
    pub fn straight(&self, load: f64) -> Option<f64> {
        let i = self.interval(load).min(GIB_TILT_ROWS - 2);
        let share = (load - self.load[i]) / (self.load[i + 1] - self.load[i]);
        (share >= 0.0 && share <= 1.0).then(|| self.depth[i] + share * (self.depth[i + 1] - self.depth[i]))
    }

    /// Depth (mm) of a load along the cubic, and the load that a mm of depth makes there. None outside the table by more
    /// than its margin.
    #[must_use]
    pub fn curved(&self, load: f64) -> Option<(f64, f64)> {
        let i = self.interval(load).min(GIB_TILT_ROWS - 2);
        let (width, rise) = (self.load[i + 1] - self.load[i], self.depth[i + 1] - self.depth[i]);
        let x = (load - self.load[i]) / width;
        if !(x >= -MARGIN && x <= 1.0 + MARGIN) {
            return None;
        }
        // Outside the table the curve goes on straight.
        let inside = x.clamp(0.0, 1.0);
        let (a, b) = (self.slope[i] * width, self.slope[i + 1] * width);
        let (c2, c3) = (3.0 * rise - 2.0 * a - b, a + b - 2.0 * rise);
        let slope = a + inside * (2.0 * c2 + inside * 3.0 * c3);
        let depth = self.depth[i] + inside * (a + inside * (c2 + inside * c3)) + slope * (x - inside);
        (slope > 0.0).then_some((depth, width / slope))
    }

    /// Relative standard uncertainty of a slope that was read between two depths (mm): what the uncertainties of the rows
    /// make of the scale of a tilt.
    ///
    /// A row that is wrong by ε bends the depths about it by ε·φ, φ its hat function; the slope through depths spread over
    /// [from, to] about their middle m then errs by ε·∫(d − m)·φ ÷ ∫(d − m)². Within one interval the cubic of
    /// [`Inverse::curved`] bends up to 1.375 times as much as straight lines.
    #[must_use]
    pub fn scale_std(&self, from: f64, to: f64) -> f64 {
        let last = self.rows.clamp(2, GIB_TILT_ROWS) - 1;
        let (first, end) = (self.depth[0], self.depth[last]);
        // A range too narrow to tell has the slope of the interval that it lies in.
        let middle = (0.5 * (from + to)).max(first).min(end);
        let half = (0.5 * (to - from)).max(1e-3 * (end - first));
        let (from, to) = (middle - half, middle + half);
        let (mut share, mut bend) = ([0.0; GIB_TILT_ROWS], 1.0f64);
        for i in 0..last {
            let (d, width) = (self.depth[i], self.depth[i + 1] - self.depth[i]);
            // The outer intervals go on straight beyond their rows.
            let low = if i == 0 { from } else { from.max(d) };
            let high = if i + 1 == last { to } else { to.min(d + width) };
            let mut part = |at: f64, weight: f64| {
                let t = (at - d) / width;
                share[i] += weight * (at - middle) * (1.0 - t);
                share[i + 1] += weight * (at - middle) * t;
            };
            // Simpson's rule, exact for the product of two straight lines.
            let h = (high - low).max(0.0) / 6.0;
            if low <= middle && middle <= high {
                bend = 1.0 + 0.375 * (0.5 * width / half).min(1.0);
            }
            part(low, h);
            part(0.5 * (low + high), 4.0 * h);
            part(high, h);
        }
        let whole = half * half * half * 2.0 / 3.0;
        let squares = share.iter().zip(self.depth_std).map(|(s, std)| (s * std) * (s * std));
        bend * squares.sum::<f64>().sqrt() / whole
    }
}

/// What the published rule makes of two points of a path.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct TiltTwoPointResult {
    /// Depth of cut at each point, mm.
    pub depth_mm: [f64; 2],
    /// atan(|difference of depth| ÷ |distance|), °.
    pub tilt_deg: f64,
    /// Difference of depth ÷ distance, signed along rising position, mm/mm.
    pub slope: f64,
}

/// The published rule: depths by straight interpolation at two positions (mm) along the path, and the angle between.
///
/// # Errors
/// `GIB_ERR_TILT_RANGE` for a load outside the table, `GIB_ERR_CONFIG` for positions nearer than 1 µm.
pub fn two_point(inverse: &Inverse, position_mm: [f64; 2], load: [f64; 2]) -> Result<TiltTwoPointResult, Fault> {
    let distance = position_mm[1] - position_mm[0];
    in_range("position_mm\0", distance.abs(), 1e-3, 1e7)?;
    let mut depth_mm = [0.0; 2];
    for (depth, load) in depth_mm.iter_mut().zip(load) {
        let (low, high) = (inverse.load[0], inverse.load[inverse.rows.clamp(1, GIB_TILT_ROWS) - 1]);
        let outside = Fault { code: GIB_ERR_TILT_RANGE, field: "load\0", value: load, low, high };
        *depth = inverse.straight(load).ok_or(outside)?;
    }
    let slope = (depth_mm[1] - depth_mm[0]) / distance;
    Ok(TiltTwoPointResult { depth_mm, tilt_deg: slope.abs().atan().to_degrees(), slope })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(rows: &[(f64, f64)]) -> TiltTable {
        let condition = TiltCondition { tool_id: 1, material_id: 2, speed_rpm: 1000.0, feed_mm_min: 300.0 };
        let mut table = TiltTable { condition, ..TiltTable::default() };
        rows.iter().for_each(|(depth, load)| table.add(*depth, *load, 0.0).unwrap());
        table
    }

    fn published() -> TiltTable {
        table(&[(2.0, 35.07572), (3.0, 35.42784), (4.0, 35.59341)])
    }

    #[test]
    fn size_is_the_published_one() {
        assert_eq!(size_of::<TiltTable>(), TiltTable::FIRST_SIZE);
    }

    #[test]
    fn the_published_example_comes_out_exactly() {
        let inverse = Inverse::new(&published()).unwrap();
        let found = two_point(&inverse, [-19.333, -60.733], [35.56424, 35.36833]).unwrap();
        assert!((found.depth_mm[0] - 3.823_821).abs() < 5e-7, "{found:?}");
        assert!((found.depth_mm[1] - 2.830_995).abs() < 5e-7, "{found:?}");
        assert!((found.tilt_deg - 1.373_764).abs() < 5e-7, "{found:?}");
        assert!(found.slope > 0.0);
    }

    /// The print has 0.828321 for the fraction of the first depth, and 0.0174 for the tangent of 1°.
    #[test]
    fn where_the_print_is_wrong_the_difference_shows() {
        let fraction: f64 = (35.56424 - 35.42784) / (35.59341 - 35.42784);
        assert!((fraction - 0.823_821).abs() < 5e-7 && (fraction - 0.828_321).abs() > 0.004);
        let misprinted = ((3.828_321 - 2.830_995f64) / (60.733 - 19.333)).atan().to_degrees();
        assert!((misprinted - 1.373_764).abs() > 0.006, "{misprinted}");
        let tangent = 1.0f64.to_radians().tan();
        assert!((tangent - 0.017_455).abs() < 5e-7);
        // Over 100 mm of path the print's constant leaves 5.5 µm.
        assert!(((tangent - 0.0174) * 100.0 - 0.0055).abs() < 1e-4);
    }

    #[test]
    fn rows_are_kept_in_order_and_cuts_of_one_depth_join() {
        let mut t = table(&[(3.0, 30.0), (1.0, 10.0)]);
        t.add(2.0, 20.0, 0.4).unwrap();
        t.add(2.0, 20.2, 0.4).unwrap();
        assert_eq!((t.rows, &t.depth_mm[..3], &t.cuts[..3]), (3, &[1.0, 2.0, 3.0][..], &[1, 2, 1][..]));
        assert!((t.load[1] - 20.1).abs() < 1e-12 && (t.load_std[1] - 0.4 / 2f64.sqrt()).abs() < 1e-12);
        t.add(2.0, 26.0, 0.0).unwrap();
        assert!(t.load_std[1] > 1.9, "cuts that disagree are not certain: {}", t.load_std[1]);
    }

    #[test]
    fn what_is_not_monotone_is_refused_by_name() {
        for (t, field) in [
            (table(&[(1.0, 10.0)]), "rows\0"),
            (table(&[(1.0, 10.0), (2.0, 10.0)]), "load\0"),
            (table(&[(1.0, 10.0), (2.0, 12.0), (3.0, 11.0)]), "load\0"),
            (TiltTable { depth_mm: [2.0; GIB_TILT_ROWS], ..published() }, "depth_mm\0"),
            (TiltTable { load: [f64::NAN; GIB_TILT_ROWS], ..published() }, "load\0"),
            (TiltTable { load_std: [0.1; GIB_TILT_ROWS], ..published() }, "load\0"),
            (TiltTable { load_std: [f64::NAN; GIB_TILT_ROWS], ..published() }, "load_std\0"),
            (TiltTable { rows: 33, ..published() }, "rows\0"),
        ] {
            assert_eq!(t.check().unwrap_err().field, field);
        }
        let mut full = TiltTable::default();
        (0..GIB_TILT_ROWS).for_each(|i| full.add(i as f64, i as f64, 0.0).unwrap());
        assert_eq!(full.add(99.0, 99.0, 0.0).unwrap_err().field, "rows\0");
    }

    /// Within an interval both rows count against its width; over many rows their errors average out. Checked against
    /// slopes through rows shifted one by one.
    #[test]
    fn what_uncertain_rows_make_of_a_slope() {
        let rows: Vec<(f64, f64)> = (0..9).map(|i| (1.0 + 0.5 * f64::from(i), 10.0 + 5.0 * f64::from(i))).collect();
        let mut t = table(&rows);
        t.load_std = [0.1; GIB_TILT_ROWS];
        let inverse = Inverse::new(&t).unwrap();
        // 0.1 of load are 0.01 mm.
        assert!((inverse.scale_std(3.1, 3.2) - 1.375 * 0.01 * 2f64.sqrt() / 0.5).abs() < 1e-9);
        assert!((inverse.scale_std(3.15, 3.15) - 1.375 * 0.01 * 2f64.sqrt() / 0.5).abs() < 1e-9);
        for (from, to) in [(2.8, 3.3), (1.2, 4.9), (2.0, 3.0)] {
            let mut squares = 0.0;
            for row in 0..9 {
                let mut shifted = t;
                shifted.depth_mm[row] += 0.01;
                let shifted = Inverse::new(&shifted).unwrap();
                let (mut sum, mut whole) = (0.0, 0.0);
                for i in 0..=2000 {
                    let d = from + (to - from) * f64::from(i) / 2000.0;
                    let away = d - 0.5 * (from + to);
                    sum += away * (shifted.straight(10.0 * d).unwrap() - d);
                    whole += away * away;
                }
                squares += (sum / whole) * (sum / whole);
            }
            let bend = 1.0 + 0.375 * (0.5 / (to - from)).min(1.0);
            let (found, wanted) = (inverse.scale_std(from, to), bend * squares.sqrt());
            assert!((found - wanted).abs() < 0.01 * wanted, "{found} {wanted}");
        }
        assert!(inverse.scale_std(1.2, 4.9) < 0.2 * inverse.scale_std(3.1, 3.2));
    }

    #[test]
    fn the_cubic_is_monotone_passes_the_rows_and_beats_straight_lines() {
        let law = |d: f64| 12.0 + 9.0 * d.powf(0.8);
        let rows: Vec<(f64, f64)> = (1..9).map(|i| (0.5 * f64::from(i), law(0.5 * f64::from(i)))).collect();
        let inverse = Inverse::new(&table(&rows)).unwrap();
        let (mut worst, mut worst_straight, mut before) = (0.0f64, 0.0f64, 0.0);
        for i in 0..=700 {
            let d = 0.5 + 0.005 * f64::from(i);
            let (depth, gain) = inverse.curved(law(d)).unwrap();
            assert!(depth > before && gain > 0.0);
            before = depth;
            worst = worst.max((depth - d).abs());
            worst_straight = worst_straight.max((inverse.straight(law(d)).unwrap_or(d) - d).abs());
        }
        assert!(worst < 0.2 * worst_straight, "{worst} against {worst_straight}");
        for (depth, load) in rows {
            assert!((inverse.curved(load).unwrap().0 - depth).abs() < 1e-12);
        }
        assert!(inverse.curved(law(0.3)).is_none() && inverse.curved(1e3).is_none());
        assert!(inverse.curved(f64::NAN).is_none() && inverse.straight(f64::NAN).is_none());
    }
}
