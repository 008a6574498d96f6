use super::*;
use proptest::prelude::*;

const WINDOW: f64 = 0.6;
/// Way of a cycle, mm.
const STEP: f64 = 0.0005;

/// A clean touch: level, line with stiffness `k` from `corner` on, cut off at `limit`.
fn touch(level: f64, k: f64, corner: f64, limit: f64, noise: impl Fn(u32) -> f64) -> Trace {
    let mut trace = Trace::default();
    trace.start(1, 0.0, 1.0, 1.0);
    for i in 0..1500 {
        let way = STEP * f64::from(i);
        let torque = (level + k * (way - corner).max(0.0)).min(limit);
        trace.add(way, torque + noise(i));
        if torque >= limit {
            break;
        }
    }
    trace
}

fn evaluated(trace: &Trace, from: f64, threshold: f64) -> Fit {
    let mut fit = Fit::default();
    fit.start(from, WINDOW, threshold);
    let mut slices = 0;
    while !fit.slice(trace) {
        slices += 1;
        assert!(slices < Fit::slices_bound());
    }
    fit
}

fn fitted(trace: &Trace, threshold: f64) -> Option<Contact> {
    evaluated(trace, 0.1, threshold).found().ok()
}

proptest! {
    /// Without noise the corner is found whatever level, stiffness and limit are; refused is only a line of too few blocks.
    #[test]
    fn corner_of_a_clean_touch(level in -2.0..3.0f64, k in 20.0..300.0f64, corner in 0.2..0.4f64, limit in 4.5..9.0f64) {
        let threshold = 0.9 * limit;
        let used = (LINE_TO - LINE_FROM) * (threshold - level) / k / STEP;
        let contact = match evaluated(&touch(level, k, corner, limit, |_| 0.0), 0.1, threshold).found() {
            Ok(contact) => contact,
            Err(fault) => {
                prop_assert!(fault.field == "blocks\0" && used < FEWEST + 1.0, "{fault:?}: {used} blocks");
                return Ok(());
            }
        };
        prop_assert!(used > FEWEST - 1.0, "{used} blocks");
        prop_assert!((contact.way - corner).abs() < 2e-5, "{} of {corner}", contact.way);
        prop_assert!((contact.stiffness / k - 1.0).abs() < 1e-3 && (contact.level - level).abs() < 1e-4);
    }
}

fn noise(i: u32) -> f64 {
    f64::from(i.wrapping_mul(2_654_435_761).rotate_left(13).wrapping_mul(2_246_822_519) >> 16) / 65536.0 - 0.5
}

#[test]
fn no_stop_is_no_contact() {
    assert_eq!(fitted(&touch(2.0, 0.0, 0.3, 9.0, noise), 8.0), None);
    assert_eq!(fitted(&Trace::default(), 8.0), None);
}

#[test]
fn a_falling_line_is_no_contact() {
    assert_eq!(fitted(&touch(2.0, -60.0, 0.3, 9.0, |i| 1e-3 * f64::from(i % 3)), 8.0), None);
}

/// What the fit shall find, worked out plainly: every split is tried, and every sum taken anew about its mean.
mod plainly {
    use super::{super::*, WINDOW};
    use crate::cycle::level::inflation;

    type Block = (f64, f64);

    struct Line {
        n: f64,
        way: f64,
        torque: f64,
        slope: f64,
        ways: f64,
        torques: f64,
        about: f64,
        /// Squares about the slope from block to block.
        steps: f64,
    }

    fn line(blocks: &[Block]) -> Line {
        let n = blocks.len() as f64;
        let sum = |of: &dyn Fn(Block) -> f64| blocks.iter().map(|block| of(*block)).sum::<f64>();
        let (way, torque) = (sum(&|(x, _)| x) / n, sum(&|(_, t)| t) / n);
        let (ways, torques) = (sum(&|(x, _)| (x - way).powi(2)), sum(&|(_, t)| (t - torque).powi(2)));
        let slope = sum(&|(x, t)| (x - way) * (t - torque)) / ways;
        let about = sum(&|(x, t)| (t - torque - slope * (x - way)).powi(2));
        let steps = blocks.windows(2).map(|pair| pair[1].1 - pair[0].1 - slope * (pair[1].0 - pair[0].0));
        Line { n, way, torque, slope, ways, torques, about, steps: steps.map(|step| step * step).sum() }
    }

    /// Blocks of ways from `from` on, and how many of them lie before the threshold, up to the first beyond it, and up to the second.
    fn limited(trace: &Trace, from: f64, threshold: f64) -> (Vec<Block>, [usize; 3]) {
        let held = (0..trace.len()).map(|i| trace.block(i));
        let blocks: Vec<Block> = held.filter(|block| block.0 >= from).collect();
        let limit = (1..blocks.len()).find(|i| blocks[*i].1.min(blocks[*i - 1].1) >= threshold);
        let ends = limit.map_or([blocks.len(); 3], |i| [i - 1, i, i + 1]);
        (blocks, ends)
    }

    /// Way, its variance, swing, bend and the variance of that; or what is missing.
    pub fn found(trace: &Trace, from: f64, threshold: f64) -> Result<[f64; 5], &'static str> {
        let (blocks, ends) = limited(trace, from, threshold);
        // The first block beyond the threshold still says how the line goes.
        let [before, line_to, last] = ends.map(|i| &blocks[..i]);
        let last = last.last().map_or(0.0, |block| block.0);
        let (mut least, mut corner) = (f64::INFINITY, f64::NAN);
        for (level, rest) in (6..(line_to.len() + 1).saturating_sub(6)).map(|i| line_to.split_at(i)) {
            let (level, rest) = (line(level), line(rest));
            if rest.slope > 0.0 && level.torques + rest.about < least {
                least = level.torques + rest.about;
                corner = rest.way - (rest.torque - level.torque) / rest.slope;
            }
        }
        let length = last - corner;
        if corner.is_nan() {
            return Err(if before.len() < 12 { "blocks\0" } else { "line_clear_ratio\0" });
        } else if length <= 0.0 {
            return Err("contact_mm\0");
        }
        let part = |low: f64, high: f64| -> Vec<Block> {
            let within = |block: &Block| block.0 >= corner + low * length && block.0 < corner + high * length;
            before.iter().copied().filter(within).collect()
        };
        let (level, whole) = (part(f64::NEG_INFINITY, -LEVEL_GAP), part(LINE_FROM, LINE_TO));
        if level.len().min(whole.len()) < 6 {
            return Err("blocks\0");
        }
        let level_steps: f64 = level.windows(2).map(|pair| (pair[1].1 - pair[0].1).powi(2)).sum();
        let (level, whole) = (line(&level), line(&whole));
        let k = whole.slope;
        if k <= SURE * (whole.about / (whole.n - 2.0) / whole.ways).sqrt() {
            return Err("line_clear_ratio\0");
        }
        let start = |line: &Line, k: f64, variance: f64| {
            let way = line.way - (line.torque - level.torque) / k;
            (way, variance * (1.0 / line.n + (line.way - way).powi(2) / line.ways) / (k * k))
        };
        let variance = whole.about / (whole.n - 2.0) * inflation(whole.steps / whole.about, 0.7);
        let (way, of_line) = start(&whole, k, variance);
        let of_level = level.torques / (level.n - 1.0) / level.n / (k * k);
        let excess = level.torques / (level.n - 1.0)
            - (1.0 + 3.0 * (3.0 / level.n).sqrt()) * level_steps / (2.0 * (level.n - 1.0));
        let middle = 0.5 * (LINE_FROM + LINE_TO);
        let halves = [part(LINE_FROM, middle), part(middle, LINE_TO)].map(|half| line(&half));
        let chance = 0.5 * whole.steps / (whole.n - 1.0);
        let [low, high] = halves.each_ref().map(|half| start(half, half.slope.max(0.2 * k), chance));
        let long = halves.iter().all(|half| half.n >= 3.0);
        let [bend, bend_variance] = if long { [high.0 - low.0, high.1 + low.1] } else { [0.0; 2] };
        if way <= before[0].0 || way >= last {
            return Err("contact_mm\0");
        }
        Ok([way, of_level + of_line, 1.5 * excess.max(0.0).sqrt() / k, bend, bend_variance])
    }

    /// Slope of the torque in the first quarter of the window, as far as it is before the threshold.
    pub fn early(trace: &Trace, from: f64, threshold: f64) -> f64 {
        let (blocks, [before, ..]) = limited(trace, from, threshold);
        let early: Vec<Block> =
            blocks[..before].iter().copied().filter(|block| block.0 < from + 0.25 * WINDOW).collect();
        line(&early).slope
    }
}

/// A touch at `pace` mm a block, whose trace holds `before` blocks more, of an axis whose torque may swing.
#[derive(Debug, Clone)]
struct Case {
    level: f64,
    k: f64,
    corner: f64,
    limit: f64,
    pace: f64,
    before: u32,
    noise: f64,
    swing: f64,
    /// By how much the torque jumps at a way, as where something catches.
    jump: [f64; 2],
    origin: f64,
    senses: [bool; 2],
    seed: u32,
}

fn case() -> impl Strategy<Value = Case> {
    let curve = (-2.0..3.0f64, prop_oneof![20.0..400.0f64, Just(0.0)], 0.1..0.58f64, 4.5..9.0f64);
    let taken = (3e-4..4e-3f64, 0..2500u32, 1e-3..0.6f64, prop_oneof![Just(0.0), 0.0..0.3f64]);
    let jump = prop_oneof![Just([0.0; 2]), [0.0..4.0f64, 0.0..0.6f64]];
    (curve, taken, jump, -500.0..500.0f64, any::<[bool; 2]>(), any::<u32>()).prop_map(
        |((level, k, corner, limit), (pace, before, noise, swing), jump, origin, senses, seed)| Case {
            level,
            k,
            corner,
            limit,
            pace,
            before,
            noise,
            swing,
            jump,
            origin,
            senses,
            seed,
        },
    )
}

impl Case {
    fn trace(&self) -> Trace {
        let [sense, torque_sense] = self.senses.map(|up| if up { 1.0 } else { -1.0 });
        let mut trace = Trace::default();
        trace.start(1, self.origin, sense, torque_sense);
        for i in 0..self.before + (0.8 / self.pace) as u32 {
            let way = self.pace * (f64::from(i) - f64::from(self.before));
            let jump = if way >= self.jump[1] { self.jump[0] } else { 0.0 };
            let clean = (self.level + jump + self.k * (way - self.corner).max(0.0)).min(self.limit);
            let torque = clean + self.swing * (way * 70.0).sin() + self.noise * noise(self.seed.wrapping_add(i));
            trace.add(self.origin + sense * way, torque_sense * torque);
            if clean >= self.limit {
                break;
            }
        }
        trace
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// Sums by groups, of which most are passed over, give what trying everything gives.
    #[test]
    fn finds_what_a_plain_search_finds(case in case()) {
        let trace = case.trace();
        // Between two blocks, so that rounding decides nothing.
        let from = trace.last_way() - WINDOW + 0.5 * case.pace;
        let fit = evaluated(&trace, from, 0.9 * case.limit);
        let of = |c: Contact| [c.way, c.variance, c.swing, c.bend, c.bend_variance];
        match (fit.found(), plainly::found(&trace, from, 0.9 * case.limit)) {
            (Ok(contact), Ok(plain)) => {
                for (one, other) in of(contact).into_iter().zip(plain) {
                    prop_assert!((one - other).abs() < 1e-8 * (1.0 + other.abs()), "{one} or {other}: {contact:?}, {plain:?}");
                }
            }
            (found, plain) => {
                prop_assert_eq!(found.as_ref().err().map(|fault| fault.field), plain.err());
                if let Some([slope, _]) = fit.rises_early() {
                    let plain = plainly::early(&trace, from, 0.9 * case.limit);
                    prop_assert!((slope - plain).abs() < 1e-7 * (1.0 + plain.abs()), "{slope} or {plain}");
                }
            }
        }
    }
}

/// The work of a usual touch is done in a few cycles; in the others the axis rests.
#[test]
fn a_usual_touch_is_evaluated_in_a_few_cycles() {
    let trace = touch(1.5, 100.0, 0.4, 5.0, |i| 0.1 * noise(i));
    let mut fit = Fit::default();
    fit.start(0.0, WINDOW, 4.5);
    let at_work = (0..).take_while(|_| !fit.slice(&trace) && fit.stage != Stage::Ready).count();
    assert!(at_work < 80, "{at_work}");
    assert!((fit.found().unwrap().way - 0.4).abs() < 1e-3);
}
