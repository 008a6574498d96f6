//! A recording as the torque balance sees it: motion, direction of sliding, and the rows on which the balance can be judged.
//!
//! T = J·α + Tv·ω + Tc·s + T0 holds while the axis slides. At rest set-valued friction takes any value up to Tc and says
//! nothing; rows whose filter touches a rest that the encoder cannot resolve are left out. Everything is in the motor's
//! coordinate and the drive's own unit (N·m, rad; N, m), positions in load units (mm; degree).
//!
//! Timing: how late the torque column is by the servo's sampling alone is known from the machine file ([`Sampling`]) and
//! taken off before any dead time is looked for.

mod coarse;
mod colour;
mod floor;
mod swings;

use super::filter::{LowPass, convolve, norm, of_three};
use super::grids;
use super::many::{decay, to_the_power, weighted_sums, widest};
use super::rows::{Judged, beside_filled, direction_of, doubtful_rows, judged_rows, resting_rows, way_of};
use super::sampling::{NUMEROV, Sampling};
use crate::analysis::statistics;
use crate::machine::{Axis, Belief, Effect};
use crate::plant::between::{cubic_at, flattened_at};
use crate::plant::lateness::Lateness;
use std::ops::Range;

/// Plain columns of one axis: what a diagnosis needs of a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Columns {
    /// s, equidistant within each stretch.
    pub time_s: Vec<f64>,
    /// Motor encoder, load units.
    pub position: Vec<f64>,
    /// Drive's own unit.
    pub torque: Vec<f64>,
    /// Command, load units, where recorded.
    pub command: Option<Vec<f64>>,
    /// Load-side scale, load units, where recorded.
    pub table: Option<Vec<f64>>,
    /// Which rows are as recorded; the others are filled in by those beside them.
    pub known: Vec<bool>,
    /// Stretches of rows without gaps.
    pub stretches: Vec<Range<usize>>,
    /// The torque's grid where its noise does not carry it over the steps, so that a mean of rows is no finer than one; else 0.
    pub torque_step: f64,
    /// Grid of the encoder's readings as recorded, load units; 0 where they show none. Rounded as they are written, means of
    /// them lie on no grid that can be read off.
    pub position_grid: f64,
    /// The same of the scale.
    pub table_grid: f64,
    /// Row period, s.
    pub period_s: f64,
    /// Period of the rows as recorded, s.
    pub recorded_period_s: f64,
    /// Whole rows of the recording that are not among these, because it is longer than is worked on.
    pub left_out: usize,
}

/// Rows of less weight are not judged: nothing is known of their friction.
const LEAST_WEIGHT: f64 = 0.05;
/// Share of a judged row's noise up to which the torque that friction may take at rest is not missed.
const NOTHING_AT_REST: f64 = 0.1;
/// Share of the top speed at which an axis creeps: what dry friction does there depends on the formulation (a step, bristles,
/// a steep slope), and no feed is so slow.
const CREEPING: f64 = 1e-3;
/// Share of the stroke to which two position sensors can be compared at all: 4 nm on 400 mm. Numbers of a simulation may agree
/// to the last digit, scales do not.
const SCALES_HOLD: f64 = 1e-8;
/// Contiguous blocks for held-out judgement.
const BLOCKS: usize = 24;

/// One recording prepared for regression.
#[derive(Debug, Clone)]
pub struct Frame<'a> {
    /// The axis as believed.
    pub axis: &'a Axis,
    /// Base values of the belief.
    pub belief: Belief,
    /// The columns.
    pub columns: &'a Columns,
    /// Motor units per load unit.
    pub unit: f64,
    /// The filter.
    pub low_pass: LowPass,
    /// Position from turn to turn, load units: the way that friction is driven by.
    pub way: Vec<f64>,
    /// Smoothed position, load units.
    pub x: Vec<f64>,
    /// Smoothed speed, load units/s.
    pub v: Vec<f64>,
    /// Smoothed acceleration, load units/s².
    pub a: Vec<f64>,
    /// Speed as the encoder shows it, by central differences, load units/s.
    pub raw_speed: Vec<f64>,
    /// Smoothed speed of the table, load units/s; empty without a scale.
    pub table_v: Vec<f64>,
    /// Direction of sliding, mean over the row: −1 to 1.
    pub direction: Vec<f64>,
    /// The encoder's grid, load units.
    pub grid: f64,
    /// The least way that the encoder tells for sure, load units.
    pub resolution: f64,
    /// How the torque column was sampled.
    pub sampling: Sampling,
    /// Its timing by a delay.
    pub lateness: Lateness,
    /// By how much a delay is believed to make it later, s.
    pub believed_late_s: f64,
    /// Rows that are judged.
    pub kept: Vec<usize>,
    /// Rows from one to the next where all between them carry weight: in the mean, and at most.
    pub apart: [usize; 2],
    /// Weight of each judged row in the torque balance, mean square 1: less where friction may have been at rest.
    pub weights: Vec<f64>,
    /// First index into `kept` of each block, and the end.
    pub blocks: Vec<usize>,
    /// Acceleration, motor units, at the kept rows.
    pub acceleration: Vec<f64>,
    /// Speed, motor units, at the kept rows.
    pub speed: Vec<f64>,
    /// Filtered torque of every row, not aligned.
    pub torque: Vec<f64>,
    stroke: (f64, f64),
    /// What the encoder's grid makes in the balance beyond what [`Frame::floor`] sees in second differences, drive's own unit.
    pub unseen: f64,
    /// What the grids of encoder and scale make in table − encoder, load units.
    grids_in_table: f64,
    /// Weights of the whole filter of what is smooth between rows, of the measured torque, and of the low-pass alone; odd.
    kernel: Vec<f64>,
    instant_kernel: Vec<f64>,
    torque_kernel: Vec<f64>,
    low_pass_kernel: Vec<f64>,
}

impl<'a> Frame<'a> {
    /// Prepares columns for an axis; `width` of the filter is chosen from noise and grid unless given.
    #[must_use]
    pub fn new(axis: &'a Axis, columns: &'a Columns, width: Option<usize>) -> Self {
        Self::yielding_over(axis, columns, width, 0.0)
    }

    /// The same where friction builds up over a way (load units): an axis that seems to rest has the friction of where it is, as far as
    /// the encoder tells that.
    #[must_use]
    pub fn yielding_over(axis: &'a Axis, columns: &'a Columns, width: Option<usize>, way: f64) -> Self {
        let belief = axis.belief();
        let unit = axis.drive.motor_per_load();
        let stretches = &columns.stretches;
        let h = columns.period_s;
        let grid = columns.position_grid / columns.rows_in_one();
        let scatter = statistics::white_noise(&columns.position).unwrap_or(0.0);
        let position_noise = (grid / 12f64.sqrt()).max(scatter);
        // Torque on a coarse grid may stand still for most rows, and seems to have no noise at all.
        let torque_grid = statistics::grid(&columns.torque).unwrap_or(0.0).max(columns.torque_step);
        let scatter_of_torque = statistics::white_noise(&columns.torque).unwrap_or(0.0);
        let torque_noise = scatter_of_torque.max(torque_grid / 12f64.sqrt());
        let bend_noise = position_noise * unit * belief.inertia / (h * h);
        let low_pass = width.map_or_else(|| LowPass::fitting(bend_noise, torque_noise), |width| LowPass { width });
        let speed = |x: &[f64], i: usize| (x[i + 1] - x[i - 1]) / (2.0 * h);
        let central = map_rows(columns, &columns.position, speed);
        let bend = map_rows(columns, &columns.position, |x, i| (x[i + 1] - 2.0 * x[i] + x[i - 1]) / (h * h));
        let x = low_pass.run(&columns.position, stretches);
        let v = low_pass.run(&central, stretches);
        let a = low_pass.run(&bend, stretches);
        let table_v = columns.table.as_ref().map(|table| low_pass.run(&map_rows(columns, table, speed), stretches));
        let resolution = grid.max(3.0 * scatter).max(1e-12);
        let gone = way_of(columns, resolution);
        let resting = resting_rows(columns, resolution);
        let direction = direction_of(columns, &v, &a, resolution);
        let sampling = Sampling::of(axis, columns);
        let lateness = Lateness::of(axis, columns.recorded_period_s);
        let torque = low_pass.run(&of_three(&columns.torque, sampling.weights, stretches), stretches);
        let low_pass_kernel = low_pass.kernel();
        let kernel = convolve(&low_pass_kernel, &NUMEROV);
        let instant_kernel = convolve(&kernel, &mean_of_rows(columns.period_s / columns.recorded_period_s));
        let torque_kernel = convolve(&low_pass_kernel, &sampling.weights);
        let mut doubt = doubtful_rows(columns, resting, resolution);
        let creeping = CREEPING * v.iter().fold(0.0f64, |m, v| m.max(v.abs())).max(1e-300);
        doubt.iter_mut().zip(&v).for_each(|(doubt, v)| *doubt = doubt.max((-(v / creeping).powi(2)).exp()));
        let unseen = if way > 0.0 { (resolution / way).min(1.0) } else { 1.0 };
        doubt.iter_mut().for_each(|doubt| *doubt = doubt.min(unseen));
        let doubt = low_pass.run(&doubt, stretches);
        let level = belief.coulomb.max(1e-3 * typical(&columns.torque)) / torque_noise.max(1e-300);
        let kernel_norm = norm(&low_pass_kernel);
        // What torque and acceleration do between rows is not known: a straight line is off by a twelfth of the second
        // difference. Flanks that meet are nothing but that.
        let sharp = 1.0 / (12.0 * (torque_noise * kernel_norm).max(1e-300));
        let bends = [beyond_noise(&torque), beyond_noise(&a)];
        let weight_of = |row: usize| {
            let open = sharp * bends[0][row].hypot(belief.inertia * unit * bends[1][row]);
            (1.0 + (level * doubt[row] / kernel_norm).powi(2) + open.powi(2)).sqrt().recip()
        };
        // Room for the filter and for reading between rows.
        let margin = low_pass.reach() + 5;
        let filled = beside_filled(columns, margin);
        // A rest goes on for many rows, all off by the same: no weight makes them as many that say something.
        let rests = |row: usize| level > NOTHING_AT_REST * kernel_norm && doubt[row] > 0.5;
        let carries = |row: usize| !filled[row] && weight_of(row) > LEAST_WEIGHT && !rests(row);
        let Judged { rows: kept, apart } = judged_rows(columns, margin, low_pass.width / 2 + 1, carries);
        let mut weights: Vec<f64> = kept.iter().map(|&row| weight_of(row)).collect();
        let mean = (weights.iter().map(|w| w * w).sum::<f64>() / weights.len().max(1) as f64).sqrt();
        weights.iter_mut().for_each(|w| *w /= mean.max(LEAST_WEIGHT));
        let blocks = (0..=BLOCKS).map(|b| b * kept.len() / BLOCKS).collect();
        let acceleration = kept.iter().map(|&i| a[i] * unit).collect();
        let speed = kept.iter().map(|&i| v[i] * unit).collect();
        let mut frame = Self {
            axis,
            belief,
            columns,
            unit,
            low_pass,
            way: gone,
            x,
            v,
            a,
            raw_speed: central,
            table_v: table_v.unwrap_or_default(),
            direction,
            grid,
            sampling,
            lateness,
            believed_late_s: lateness.of_delay(believed_delay(axis)),
            kept,
            apart,
            weights,
            blocks,
            acceleration,
            speed,
            torque,
            stroke: columns.position.iter().fold((f64::MAX, f64::MIN), |(lo, hi), x| (x.min(lo), x.max(hi))),
            resolution,
            unseen: 0.0,
            grids_in_table: 0.0,
            kernel,
            instant_kernel,
            torque_kernel,
            low_pass_kernel,
        };
        (frame.unseen, frame.grids_in_table) =
            rayon::join(|| grids::unseen_by_floor(&frame), || grids::in_table(&frame));
        frame
    }

    /// The same recording with the torque column taken to be later by `late_s`, by whatever way its rows were sampled.
    #[must_use]
    pub fn aligned_by(&self, late_s: f64) -> Self {
        Self { sampling: self.sampling.aligned(late_s), ..self.clone() }
    }

    /// The same rows, as they count here, with the base values and the timing of another axis.
    #[must_use]
    pub fn believing(&self, axis: &'a Axis) -> Self {
        let believed_late_s = self.lateness.of_delay(believed_delay(axis));
        Self { axis, belief: axis.belief(), believed_late_s, ..self.clone() }
    }

    /// One judged row in so many, as it is: for what is smooth over the filter.
    #[must_use]
    pub fn few(&self, every: usize) -> Self {
        fn of<T: Copy>(all: &[T], every: usize) -> Vec<T> {
            all.iter().step_by(every).copied().collect()
        }
        let (kept, weights) = (of(&self.kept, every), of(&self.weights, every));
        let (acceleration, speed) = (of(&self.acceleration, every), of(&self.speed, every));
        let blocks = (0..=BLOCKS).map(|b| b * kept.len() / BLOCKS).collect();
        Self { kept, weights, acceleration, speed, blocks, kernel: vec![1.0], ..self.clone() }
    }

    /// A regressor of every row, filtered like the torque, at the judged rows.
    #[must_use]
    pub fn judged(&self, values: &[f64]) -> Vec<f64> {
        self.weighed(values, &self.kernel, 0)
    }

    /// The same of what is known at the instant of each row, where a row is the mean of several that were recorded.
    #[must_use]
    pub fn judged_instants(&self, values: &[f64]) -> Vec<f64> {
        self.weighed(values, &self.instant_kernel, 0)
    }

    /// A column of table − encoder, or of means that are already triangular ones over a row to either side, filtered, at the
    /// judged rows.
    #[must_use]
    pub fn low_passed(&self, values: &[f64]) -> Vec<f64> {
        self.weighed(values, &self.low_pass_kernel, 0)
    }

    /// The same of several columns side by side.
    #[must_use]
    pub fn low_passed_together<const N: usize>(&self, values: &[[f64; N]]) -> [Vec<f64>; N] {
        let kernel = &self.low_pass_kernel;
        let mut columns: [Vec<f64>; N] = std::array::from_fn(|_| Vec::with_capacity(self.kept.len()));
        widest(
            #[inline(always)]
            || {
                for &row in &self.kept {
                    let window =
                        row.checked_sub(kernel.len() / 2).and_then(|from| values.get(from..from + kernel.len()));
                    let mut sums = [0.0; N];
                    for (value, weight) in window.unwrap_or_default().iter().zip(kernel) {
                        for (sum, value) in sums.iter_mut().zip(value) {
                            *sum += weight * value;
                        }
                    }
                    columns.iter_mut().zip(sums).for_each(|(column, sum)| column.push(sum));
                }
            },
        );
        columns
    }

    /// Weighted sum of the rows about each judged row, `offset` rows later. The rows that are not judged are not worked out.
    fn weighed(&self, values: &[f64], kernel: &[f64], offset: isize) -> Vec<f64> {
        let first = offset - (kernel.len() / 2) as isize;
        weighted_sums(values, kernel, self.kept.iter().map(|row| row.saturating_add_signed(first)))
    }

    /// table − encoder at the judged rows, about its mean, since each sensor has a zero of its own; empty without a table scale.
    #[must_use]
    pub fn table_error(&self) -> Vec<f64> {
        self.columns.table.as_ref().map_or_else(Vec::new, |table| {
            let error: Vec<f64> = table.iter().zip(&self.columns.position).map(|(t, x)| t - x).collect();
            let mut error = self.low_passed(&error);
            let mean = error.iter().sum::<f64>() / error.len().max(1) as f64;
            error.iter_mut().for_each(|error| *error -= mean);
            error
        })
    }

    /// A function of the measured torque, filtered and aligned as the torque is if it is late by `late_s` beyond what is known.
    #[must_use]
    pub fn aligned(&self, values: &[f64], late_s: f64) -> Vec<f64> {
        let shift = (self.sampling.shift_s + self.believed_late_s + late_s) / self.columns.period_s;
        let (rows, between) = (shift.floor(), shift - shift.floor());
        // Catmull and Rom's weights at that place between rows −1, 0, 1 and 2, with a fifth that makes the kernel odd.
        let unit =
            |k: usize| cubic_at(&[0.0, 1.0, 2.0, 3.0].map(|i| f64::from(u8::from(i == k as f64))), 1.0 + between);
        let weights = [unit(0), unit(1), unit(2), unit(3)];
        let kernel = convolve(&self.torque_kernel, &[0.0, weights[0], weights[1], weights[2], weights[3]]);
        self.weighed(values, &kernel, rows as isize)
    }

    /// The regressor that a function of the row gives.
    #[must_use]
    pub fn judged_by(&self, value: impl Fn(usize) -> f64) -> Vec<f64> {
        // Few rows that are taken as they are need no others.
        if self.kernel.len() == 1 {
            return self.kept.iter().map(|&row| value(row)).collect();
        }
        self.judged(&(0..self.x.len()).map(value).collect::<Vec<_>>())
    }

    /// The regressors of so many levels by where each row lies among them and its value: what lies between two belongs to both, by
    /// how near it is.
    #[must_use]
    pub fn judged_by_levels(&self, levels: usize, rows: &[(f64, f64)]) -> Vec<Vec<f64>> {
        let mut columns = vec![vec![0.0; self.kept.len()]; levels];
        for (k, &row) in self.kept.iter().enumerate() {
            let window =
                row.checked_sub(self.kernel.len() / 2).and_then(|from| rows.get(from..from + self.kernel.len()));
            for ((at, value), weight) in window.unwrap_or_default().iter().zip(&self.kernel) {
                let level = (*at as usize).min(levels.saturating_sub(2));
                let (near, far) = (at - level as f64, value * weight);
                columns[level][k] += far * (1.0 - near);
                columns[level + 1][k] += far * near;
            }
        }
        columns
    }

    /// Dry friction that fades where a function of a column is large: direction·e^−function.
    #[must_use]
    pub fn fading(&self, column: &[f64], function: impl Fn(f64) -> f64) -> Vec<f64> {
        let mut friction: Vec<f64> = column.iter().map(|value| function(*value)).collect();
        widest(
            #[inline(always)]
            || friction.iter_mut().zip(&self.direction).for_each(|(f, direction)| *f = direction * decay(*f)),
        );
        self.judged(&friction)
    }

    /// [`Frame::fading`] with a power of a distance.
    #[must_use]
    pub fn fading_by(&self, column: &[f64], exponent: f64, distance: impl Fn(f64) -> f64) -> Vec<f64> {
        let square = |value: f64| distance(value).powi(2);
        if exponent == 2.0 {
            return self.fading(column, square);
        }
        let mut powers: Vec<f64> = column.iter().map(|value| square(*value)).collect();
        to_the_power(&mut powers, 0.5 * exponent);
        self.fading(&powers, |power| power)
    }

    /// The measured torque at the judged rows, if the column is late by `late_s` beyond what is known. What a delay has
    /// flattened is raised again.
    #[must_use]
    pub fn torque(&self, late_s: f64) -> Vec<f64> {
        let late_s = self.believed_late_s + late_s;
        let shift = (self.sampling.shift_s + late_s) / self.columns.period_s;
        let flattened = self.lateness.flattened_s2(late_s) / self.columns.period_s.powi(2);
        // Between the rows it is the same sum of neighbours everywhere; at the ends the series is held.
        let rows = shift.floor();
        let weight = |k: usize| {
            let mut one = [0.0; 8];
            one[k] = 1.0;
            flattened_at(&one, 3.0 + shift - rows, -flattened)
        };
        let weights: [f64; 6] = std::array::from_fn(|k| weight(k + 1));
        let at = |&row: &usize| {
            let window = row.checked_add_signed(rows as isize - 2).and_then(|begin| self.torque.get(begin..begin + 6));
            window.map_or_else(
                || flattened_at(&self.torque, row as f64 + shift, -flattened),
                |window| window.iter().zip(weights).map(|(torque, weight)| torque * weight).sum(),
            )
        };
        self.kept.iter().map(at).collect()
    }

    /// Time from the first row, s.
    #[must_use]
    pub fn seconds(&self, row: usize) -> f64 {
        self.columns.time_s[row] - self.columns.time_s[0]
    }

    /// Seconds that the judged rows stand for.
    #[must_use]
    pub fn judged_seconds(&self) -> f64 {
        self.kept.len() as f64 * self.columns.period_s * (self.low_pass.width / 2 + 1) as f64
    }

    /// Fastest speed, load units/s.
    #[must_use]
    pub fn top_speed(&self) -> f64 {
        self.kept.iter().fold(0.0, |m, &i| self.v[i].abs().max(m))
    }

    /// Smallest and largest position of the recording.
    #[must_use]
    pub fn stroke(&self) -> (f64, f64) {
        self.stroke
    }

    /// The belief's base torque at the judged rows.
    #[must_use]
    pub fn believed(&self) -> Vec<f64> {
        let b = &self.belief;
        let direction = self.judged(&self.direction);
        (0..self.kept.len())
            .map(|k| {
                b.inertia * self.acceleration[k] + b.viscous * self.speed[k] + b.coulomb * direction[k] + b.constant
            })
            .collect()
    }
}

/// The mean of so many recorded rows to one, of what is smooth: its second moment, (1 − 1/n²)/12 rows².
fn mean_of_rows(many: f64) -> [f64; 3] {
    let side = (1.0 - 1.0 / (many * many)) / 24.0;
    [side, 1.0 - 2.0 * side, side]
}

/// How sharply a column bends at each row (its second difference), beyond what its noise does: four deviations, by the median.
fn beyond_noise(values: &[f64]) -> Vec<f64> {
    let bend = |row: usize| match values.get(row.wrapping_sub(1)..row + 2) {
        Some(&[before, at, after]) => (after - 2.0 * at + before).abs(),
        _ => 0.0,
    };
    let bends: Vec<f64> = (0..values.len()).map(bend).collect();
    let noise = 4.0 * 1.4826 * statistics::median(&bends).unwrap_or(0.0);
    bends.into_iter().map(|bend| (bend - noise).max(0.0)).collect()
}

/// How late the torque column is believed to be beyond its sampling, s.
fn believed_delay(axis: &Axis) -> f64 {
    let delay = |effect: &Effect| match *effect {
        Effect::DeadTime { delay_ms } => Some(1e-3 * delay_ms),
        _ => None,
    };
    axis.effects.iter().filter_map(delay).sum()
}

/// Applies a three-point rule to a position inside each stretch; end rows repeat their neighbour.
fn map_rows(columns: &Columns, x: &[f64], rule: impl Fn(&[f64], usize) -> f64) -> Vec<f64> {
    let mut out = vec![0.0; x.len()];
    for s in &columns.stretches {
        if s.len() < 3 {
            continue;
        }
        for i in s.start + 1..s.end - 1 {
            out[i] = rule(x, i);
        }
        out[s.start] = out[s.start + 1];
        out[s.end - 1] = out[s.end - 2];
    }
    out
}

/// Root mean square.
fn typical(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64).sqrt()
}
