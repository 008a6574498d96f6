//! Where a rest repeats: along the stroke or in time, by matched filters over all periods at once (a Fourier transform).

use super::*;
use crate::diagnosis::many::sines_and_cosines;
use crate::machine::Drive;
use realfft::RealFftPlanner;

/// Bins along the stroke, eight to the shortest period looked for: as many as there are rows, within these bounds. Coupled to a
/// fine screw, slots and poles repeat some thousand times over a stroke.
const STROKE_BINS: [usize; 2] = [1 << 14, 1 << 17];
/// Starts handed on from each octave.
const MOST: usize = 2;
/// Steps in time that a recording with long gaps may be laid out on in any case.
const MOST_STEPS: usize = 1 << 22;
/// Least share of the rest's squares that a peak explains by its height. A cause needs eight times as much to be named, and
/// the raster of bins and frequencies costs a peak a quarter at most.
const LEAST_SHARE: f64 = 0.01;

/// Fewest periods over the stroke from which a ripple is looked for.
const LEAST_PERIODS: f64 = 1.5;
/// Fewest at which it is found: of less than a whole period nobody knows that it repeats.
const WHOLE: f64 = 1.1;
/// Periods below which they are few: each of them is looked at, and there is one such ripple at most, since two and a slope are
/// a Fourier series that imitates anything along the stroke.
pub const FEW: f64 = 6.0;

/// Sine and cosine with this many periods over the stroke, every row.
pub fn waves(frame: &Frame, periods: f64) -> (Vec<f64>, Vec<f64>) {
    let (low, high) = frame.stroke();
    let k = periods / (high - low);
    // Faster than nearly half a period a row the wave would alias, at a steady speed into a constant.
    let fastest = 0.45 / (k * frame.columns.period_s);
    let turns: Vec<f64> = frame.x.iter().map(|x| k * (x - low)).collect();
    let (mut sines, mut cosines) = sines_and_cosines(&turns);
    for (i, _) in frame.v.iter().enumerate().filter(|(_, v)| v.abs() > fastest) {
        (sines[i], cosines[i]) = (0.0, 0.0);
    }
    (sines, cosines)
}

/// Numbers of periods over the stroke at which the rest repeats most, and those that the drive suggests.
pub fn along_stroke(frame: &Frame, rest: &[f64]) -> Vec<Vec<f64>> {
    let (low, high) = frame.stroke();
    let stroke = high - low;
    if !(stroke > 0.0) || rest.is_empty() {
        return Vec::new();
    }
    let count = frame.x.len().next_power_of_two().clamp(STROKE_BINS[0], STROKE_BINS[1]);
    let mut bins = vec![0.0; 2 * count];
    for (&row, value) in frame.kept.iter().zip(rest) {
        let at = ((frame.x[row] - low) / stroke * (count - 1) as f64) as usize;
        if let Some(bin) = bins.get_mut(at) {
            *bin += value;
        }
    }
    // Two transform lengths over the stroke: half periods are resolved. Periods below eight bins or eight encoder steps,
    // and fewer than LEAST_PERIODS over the stroke, are not looked for.
    let most = (count / 8).min((stroke / (8.0 * frame.grid.max(1e-9))) as usize);
    let mut starts = peaks(&mut bins, ((2.0 * LEAST_PERIODS) as usize, 2 * most), 0.5, least_power(rest));
    let (turns, table) = match frame.axis.drive {
        Drive::BallScrew { lead_mm } => (stroke / lead_mm, 0.0),
        Drive::Rotary { ratio } => (stroke / 360.0 * ratio, stroke / 360.0),
        Drive::Linear => (0.0, 0.0),
    };
    let poles = f64::from(frame.axis.motor_pole_pairs.unwrap_or(4));
    let likely = [1.0, 2.0, poles, 2.0 * poles, 6.0 * poles].map(|n| n * turns);
    let likely = likely.into_iter().chain([table]).filter(|n| *n >= LEAST_PERIODS && *n < most as f64);
    starts.extend(likely.map(|n| vec![n]));
    starts
}

/// Amplitude and period (load units) of waves with this many periods over the stroke; `None` where they are no whole period.
pub fn ripple(frame: &Frame, periods: f64, [sine, cosine]: [f64; 2]) -> Option<(f64, f64)> {
    let (low, high) = frame.stroke();
    (periods > WHOLE).then(|| (f64::hypot(sine, cosine), (high - low) / periods))
}

/// Whether a ripple of few periods over the stroke is there in each of them (in each half of the stroke at least). What happens
/// once, as a detent, is explained by a wave of few periods as well, and is not there elsewhere.
pub fn is_in_each_period(frame: &Frame, periods: f64, ripple: &[f64], left: &[f64]) -> bool {
    let count = periods.floor().clamp(2.0, FEW);
    let (low, high) = frame.stroke();
    is_in_each(count, |row| (frame.x[row] - low) / (high - low), frame, ripple, left)
}

/// Whether a ripple along the stroke shows in a quarter of the places at least that were passed: one that the axis passes too fast to tell
/// but near its turns repeats nowhere.
pub fn shows_along_stroke(frame: &Frame, ripple: &[f64]) -> bool {
    const PLACES: usize = 16;
    const LEAST: f64 = 0.1;
    let (low, high) = frame.stroke();
    let mut places = [(0.0, 0.0); PLACES];
    for (&row, ripple) in frame.kept.iter().zip(ripple) {
        let place = (frame.x[row] - low) / (high - low) * PLACES as f64;
        let (squares, rows) = &mut places[(place as usize).min(PLACES - 1)];
        (*squares, *rows) = (*squares + ripple * ripple, *rows + 1.0);
    }
    let passed: Vec<f64> =
        places.iter().filter(|(_, rows)| *rows > 0.0).map(|(squares, rows)| squares / rows).collect();
    let mean = passed.iter().sum::<f64>() / passed.len().max(1) as f64;
    4 * passed.iter().filter(|square| **square > LEAST * mean).count() >= passed.len()
}

/// Whether a vibration is there in each eighth of the recording. What a single feed makes, as the encoder's grid does, ends
/// with it.
pub fn is_all_the_time(frame: &Frame, ripple: &[f64], left: &[f64]) -> bool {
    let all = frame.seconds(frame.x.len() - 1);
    is_in_each(8.0, |row| frame.seconds(row) / all, frame, ripple, left)
}

/// Whether a ripple is there in each of so many pieces of a way: at least half as large as on the whole, and half as much again at
/// most. `ripple` and `left` are what it explains and what is left, at the judged rows.
fn is_in_each(pieces: f64, along: impl Fn(usize) -> f64, frame: &Frame, ripple: &[f64], left: &[f64]) -> bool {
    let mut sums = vec![[0.0f64; 3]; pieces as usize];
    let last = sums.len() - 1;
    for ((&row, ripple), left) in frame.kept.iter().zip(ripple).zip(left) {
        let [own, with, noise] = &mut sums[((pieces * along(row)) as usize).min(last)];
        *own += ripple * ripple;
        *with += ripple * left;
        *noise += (ripple * left).powi(2);
    }
    let whole: f64 = sums.iter().map(|s| s[0]).sum();
    sums.iter().filter(|s| s[0] > 0.02 * whole).all(|[own, with, noise]| {
        // Neighbouring rows are not independent: three deviations of independent ones.
        with.abs() < 0.5 * own + 3.0 * noise.sqrt()
    })
}

/// Whether a ripple is there alike in groups of as many rows each along a coordinate.
pub fn there_alike(frame: &Frame, along: impl Fn(usize) -> f64, groups: usize, ripple: &[f64], left: &[f64]) -> bool {
    let mut order: Vec<f64> = frame.kept.iter().map(|&row| along(row)).collect();
    order.sort_unstable_by(f64::total_cmp);
    let rank = |row: usize| order.partition_point(|other| *other < along(row)) as f64 / order.len() as f64;
    is_in_each(groups as f64, rank, frame, ripple, left)
}

/// The frequency, Hz, about which most of the rest's power lies within so many periods over the recording to either side.
pub fn strongest_band(frame: &Frame, rest: &[f64], reach: f64) -> Option<f64> {
    let (mut bins, stride) = rows_in_time(frame, rest)?;
    let length = bins.len() as f64;
    let cycles = frame.seconds(frame.x.len() - 1) / (stride as f64 * frame.columns.period_s) / length;
    let reach = (reach / cycles).ceil() as usize;
    let (from, to) = ((10.0 / cycles) as usize + reach, (length * visible(frame, stride)) as usize);
    let power = power(&mut bins);
    let mut sums = vec![0.0; power.len() + 1];
    power.iter().enumerate().for_each(|(i, power)| sums[i + 1] = sums[i] + power);
    let within = |at: usize| sums[at + reach + 1] - sums[at - reach];
    let places = from..to.min(power.len().saturating_sub(reach + 1));
    let strongest = places.max_by(|a, b| within(*a).total_cmp(&within(*b)))?;
    let near = strongest - reach..=strongest + reach;
    let middle = near.map(|i| i as f64 * power[i]).sum::<f64>() / within(strongest).max(1e-300);
    Some(middle / (length * stride as f64 * frame.columns.period_s))
}

/// Numbers of periods over the recording at which the rest repeats most.
pub fn along_time(frame: &Frame, rest: &[f64]) -> Vec<Vec<f64>> {
    let Some((mut bins, stride)) = rows_in_time(frame, rest) else { return Vec::new() };
    let length = bins.len() as f64;
    let cycles = frame.seconds(frame.x.len() - 1) / (stride as f64 * frame.columns.period_s) / length;
    // Ten periods at least.
    let range = ((10.0 / cycles) as usize, (length * visible(frame, stride)) as usize);
    peaks(&mut bins, range, cycles, least_power(rest))
}

/// Amplitudes of lines over frequency, Hz: the largest within each of some hundred bands of equal ratio.
pub fn spectrum(frame: &Frame, rest: &[f64]) -> Vec<(f64, f64)> {
    let Some((mut bins, stride)) = rows_in_time(frame, rest) else { return Vec::new() };
    let hz = 1.0 / (bins.len() as f64 * stride as f64 * frame.columns.period_s);
    let most = (bins.len() as f64 * visible(frame, stride)) as usize;
    let power = power(&mut bins);
    let lowest = (1.0 / (hz * frame.seconds(frame.x.len() - 1))).ceil().max(1.0) as usize;
    let ratio = (most as f64 / lowest as f64).max(1.0).powf(1.0 / 160.0);
    let mut out = Vec::new();
    let mut low = lowest;
    while low < most.min(power.len()) {
        let high = ((low as f64 * ratio).ceil() as usize).max(low + 1).min(power.len());
        let (at, largest) = (low..high).map(|i| (i, power[i])).fold((low, 0.0), |m, p| if p.1 > m.1 { p } else { m });
        out.push((at as f64 * hz, 2.0 * largest.sqrt() / rest.len() as f64));
        low = high;
    }
    out
}

/// The rest on an even raster in time, padded to twice its length, and the rows of its step.
fn rows_in_time(frame: &Frame, rest: &[f64]) -> Option<(Vec<f64>, usize)> {
    let stride = frame.kept.windows(2).map(|w| w[1] - w[0]).min().unwrap_or(1).max(1);
    // By time: rows that are missing would turn the phase of all that comes after them.
    let per_second = 1.0 / (stride as f64 * frame.columns.period_s);
    let steps = (frame.seconds(frame.x.len().checked_sub(1)?) * per_second) as usize + 1;
    if steps < 64 || steps > MOST_STEPS.max(16 * frame.x.len()) {
        return None;
    }
    let mut bins = vec![0.0; (2 * steps).next_power_of_two()];
    for (&row, value) in frame.kept.iter().zip(rest) {
        if let Some(bin) = bins.get_mut((frame.seconds(row) * per_second + 1e-6) as usize) {
            *bin += value;
        }
    }
    Some((bins, stride))
}

/// Highest frequency that is looked at, in cycles a step: nothing that the filter takes away.
fn visible(frame: &Frame, stride: usize) -> f64 {
    (0.45_f64).min(0.6 * stride as f64 / frame.low_pass.width as f64)
}

/// Power of each bin of the Fourier transform; nothing where it fails.
fn power(values: &mut [f64]) -> Vec<f64> {
    let fft = RealFftPlanner::<f64>::new().plan_fft_forward(values.len());
    let mut spectrum = fft.make_output_vec();
    if fft.process(values, &mut spectrum).is_err() {
        return Vec::new();
    }
    spectrum.iter().map(|c| c.norm_sqr()).collect()
}

/// Power of a wave that explains the least share: sine and cosine take 2·|F|²/n off the sum of squares.
fn least_power(rest: &[f64]) -> f64 {
    0.5 * LEAST_SHARE * rest.len() as f64 * rest.iter().map(|r| r * r).sum::<f64>()
}

/// The largest local peaks of the power spectrum in each octave between two bins, as multiples of `unit`.
fn peaks(values: &mut [f64], (from, to): (usize, usize), unit: f64, least: f64) -> Vec<Vec<f64>> {
    let power = power(values);
    let to = to.min(power.len().saturating_sub(1));
    // By octaves: what is left of slower causes stands high at long periods and must not hide a fine ripple.
    let mut starts = Vec::new();
    let mut low = from.max(1);
    while low < to {
        let high = (2 * low).min(to);
        let mut found: Vec<usize> =
            (low..high).filter(|&i| power[i] > least.max(power[i - 1]) && power[i] >= power[i + 1]).collect();
        found.sort_by(|a, b| power[*b].total_cmp(&power[*a]));
        starts.extend(found.into_iter().take(MOST).map(|i| vec![i as f64 * unit]));
        low = high;
    }
    starts
}

/// Where a ripple of this period comes from.
pub fn origin(axis: &Axis, period_mm: f64) -> String {
    if let crate::machine::Drive::BallScrew { lead_mm } = axis.drive {
        let per_turn = lead_mm / period_mm;
        let whole = per_turn.round();
        if whole >= 1.0 && (per_turn - whole).abs() < 0.02 * whole {
            return format!("{whole} times a motor turn, so it comes from the motor or the screw");
        }
    }
    "magnets, slots or a gear repeat with it".to_owned()
}
