//! Gain and phase of both accelerometers over frequency: what a calibration yields and a correction needs.
//!
//! A measured displacement X of frequency f is corrected to g(f)·X with g = gain·e^(j·phase): a positive phase advances it.
//! Between two frequencies g goes along a straight line in the complex plane; beyond the outermost ones it stays.

use crate::error::{Fault, in_range};

/// Most frequencies in a calibration.
pub const GIB_CALIBRATION_POINTS: usize = 32;

/// Both accelerometers at one frequency; arrays: seat, bearing.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct CalibrationPoint {
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// True displacement over the one from the accelerometer, 0.1 to 10.
    pub gain_ratio: [f64; 2],
    /// Phase of the true displacement ahead of the one from the accelerometer, -180 to 180 degrees.
    pub phase_deg: [f64; 2],
    /// Expanded uncertainty of the gain, k = 2.
    pub gain_uncertainty_ratio: [f64; 2],
    /// Expanded uncertainty of the phase, k = 2, degrees. As far as it rests on `tolerance_ratio` it holds for a sensor that
    /// comes no later than that allows.
    pub phase_uncertainty_deg: [f64; 2],
    /// How much an error of the measured displacements is magnified in the gains: 1 is best; beyond 100 the two cannot be
    /// told apart and only their difference is known.
    pub condition_ratio: f64,
    /// What gains and phases leave of the measured relative displacement, root mean square, µm.
    pub residual_um: f64,
    /// Amplitude of the command in the last experiment, mm.
    pub amplitude_mm: f64,
    /// Experiments that the point rests on.
    pub experiments: f64,
}

/// A calibration: what to give to `gib_vibration_start`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CalibrationTable {
    /// Size of this struct as the caller knows it: `sizeof(gib_calibration_table)`.
    pub struct_size: u32,
    /// Points that hold something, in order of rising frequency, 1 to 32.
    pub count: u32,
    /// The points.
    pub point: [CalibrationPoint; GIB_CALIBRATION_POINTS],
}

impl Default for CalibrationTable {
    fn default() -> CalibrationTable {
        let point = [CalibrationPoint::default(); GIB_CALIBRATION_POINTS];
        CalibrationTable { struct_size: size_of::<CalibrationTable>() as u32, count: 0, point }
    }
}

impl CalibrationTable {
    /// Size of the struct in the first published ABI.
    pub const FIRST_SIZE: usize = 3336;

    /// The points that hold something.
    #[must_use]
    pub fn points(&self) -> &[CalibrationPoint] {
        self.point.get(..self.count as usize).unwrap_or(&self.point)
    }

    /// Checks every number that a correction uses.
    ///
    /// # Errors
    /// `GIB_ERR_CONFIG` with the field, its value and the range allowed.
    pub fn check(&self) -> Result<(), Fault> {
        in_range("count\0", f64::from(self.count), 1.0, GIB_CALIBRATION_POINTS as f64)?;
        let mut low = 0.01;
        for point in self.points() {
            in_range("frequency_hz\0", point.frequency_hz, low, 1e5)?;
            low = point.frequency_hz * (1.0 + 1e-9);
            for i in 0..2 {
                in_range("gain_ratio\0", point.gain_ratio[i], 0.1, 10.0)?;
                in_range("phase_deg\0", point.phase_deg[i], -180.0, 180.0)?;
            }
        }
        Ok(())
    }

    /// Complex gains of seat and bearing at a frequency, Hz: real part, imaginary part. 1 where nothing is known.
    #[must_use]
    pub fn gains(&self, frequency: f64) -> [[f64; 2]; 2] {
        let points = self.points();
        let above = points.iter().position(|point| point.frequency_hz > frequency);
        let (low, high) = match above {
            Some(i) => (points.get(i.saturating_sub(1)), points.get(i)),
            None => (points.last(), points.last()),
        };
        let (Some(low), Some(high)) = (low, high) else { return [[1.0, 0.0]; 2] };
        let way = high.frequency_hz - low.frequency_hz;
        let part = if way > 0.0 { ((frequency - low.frequency_hz) / way).clamp(0.0, 1.0) } else { 0.0 };
        [0, 1].map(|i| {
            let (from, to) = (low.gain(i), high.gain(i));
            [from[0] + part * (to[0] - from[0]), from[1] + part * (to[1] - from[1])]
        })
    }
}

impl CalibrationPoint {
    fn gain(&self, i: usize) -> [f64; 2] {
        let (sin, cos) = self.phase_deg[i & 1].to_radians().sin_cos();
        [self.gain_ratio[i & 1] * cos, self.gain_ratio[i & 1] * sin]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> CalibrationTable {
        let mut table = CalibrationTable { count: 2, ..CalibrationTable::default() };
        for (i, (f, gain, phase)) in [(10.0, 1.1, 4.0), (50.0, 0.9, -8.0)].into_iter().enumerate() {
            table.point[i] = CalibrationPoint {
                frequency_hz: f,
                gain_ratio: [gain, 1.0],
                phase_deg: [phase, 0.0],
                ..CalibrationPoint::default()
            };
        }
        table
    }

    #[test]
    fn size_is_the_published_one() {
        assert_eq!(size_of::<CalibrationTable>(), CalibrationTable::FIRST_SIZE);
    }

    #[test]
    fn gains_go_from_point_to_point_and_stay_beyond() {
        let table = table();
        let polar = |f: f64| {
            let [re, im] = table.gains(f)[0];
            (re.hypot(im), im.atan2(re).to_degrees())
        };
        for (f, gain, phase) in [(1.0, 1.1, 4.0), (10.0, 1.1, 4.0), (50.0, 0.9, -8.0), (900.0, 0.9, -8.0)] {
            assert!((polar(f).0 - gain).abs() < 1e-12 && (polar(f).1 - phase).abs() < 1e-9, "{f}");
        }
        assert!((polar(30.0).0 - 1.0).abs() < 0.01 && polar(30.0).1 > -8.0 && polar(30.0).1 < 4.0);
        assert_eq!(CalibrationTable::default().gains(10.0), [[1.0, 0.0]; 2]);
    }

    #[test]
    fn what_is_wrong_is_named() {
        assert_eq!(table().check(), Ok(()));
        let spoilt = |f: &dyn Fn(&mut CalibrationTable)| {
            let mut table = table();
            f(&mut table);
            table.check().unwrap_err().field
        };
        assert_eq!(spoilt(&|t| t.count = 0), "count\0");
        assert_eq!(spoilt(&|t| t.count = 33), "count\0");
        assert_eq!(spoilt(&|t| t.point[1].frequency_hz = 10.0), "frequency_hz\0");
        assert_eq!(spoilt(&|t| t.point[1].gain_ratio[1] = f64::NAN), "gain_ratio\0");
        assert_eq!(spoilt(&|t| t.point[0].phase_deg[0] = 181.0), "phase_deg\0");
    }
}
