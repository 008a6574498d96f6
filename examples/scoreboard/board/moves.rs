//! Commanded motion: what an interpolator would ask of the axis in an identification run, drawn at random.
//!
//! A move is a trapezoid of speed (or a triangle, when the way is too short for the speed); a moving average over a fixed
//! time turns the trapezoids into S-curves of bounded jerk. Positions are in the load's unit (mm or deg), times in s.

use super::random::Random;

/// What the axis can do, in load units.
#[derive(Clone, Copy, Debug)]
pub struct Reach {
    pub low: f64,
    pub high: f64,
    /// Rapid speed, units/s.
    pub speed: f64,
    /// Acceleration, units/s².
    pub acceleration: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Segment {
    /// Go to a position at a speed with an acceleration.
    Move { to: f64, speed: f64, acceleration: f64 },
    /// Stand still for a time.
    Dwell { time: f64 },
    /// Whole cosine cycles about a point half an amplitude away: position = start + amplitude/2·(1 − cos 2πft).
    Wave { amplitude: f64, frequency: f64, cycles: usize },
}

/// What kind of run it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// Everything an identification wants.
    Mixed,
    /// The same on a third of the stroke and in a third of the time, three times over.
    Laps,
    /// Production: rapids between a few stations, and one slow reversal.
    Stations,
    /// Waves from slow to fast, after one way across the stroke.
    Sweep,
}

impl Style {
    /// Share of the machine's stroke that it goes: what is hidden elsewhere is not in the recording.
    pub fn share(self) -> f64 {
        if self == Style::Laps { 1.0 / 3.0 } else { 1.0 }
    }
}

/// Draws a run of that style.
pub fn draw_style(
    random: &mut Random,
    style: Style,
    reach: &Reach,
    duration: f64,
    slow_share: f64,
) -> (f64, Vec<Segment>) {
    match style {
        Style::Mixed => draw(random, reach, duration, slow_share),
        Style::Laps => {
            let (start, mut lap) = draw(random, reach, duration / 3.0, slow_share);
            lap.push(Segment::Move { to: start, speed: 0.5 * reach.speed, acceleration: 0.5 * reach.acceleration });
            (start, [lap.clone(), lap.clone(), lap].concat())
        }
        Style::Stations => stations(random, reach, duration),
        Style::Sweep => sweep(random, reach, duration),
    }
}

fn stations(random: &mut Random, reach: &Reach, duration: f64) -> (f64, Vec<Segment>) {
    let count = random.pick(&[2usize, 3, 4, 6]);
    let stroke = reach.high - reach.low;
    // Stations on a raster, so that no two are the same.
    let at: Vec<f64> =
        (0..count).map(|i| reach.low + stroke * (i as f64 + random.uniform(0.0, 0.6)) / (count as f64 - 0.4)).collect();
    let (mut here, mut time) = (0, 0.0);
    let mut segments = vec![Segment::Dwell { time: random.uniform(0.1, 0.4) }];
    let speeds: Vec<f64> = (0..3).map(|_| reach.speed * random.log_uniform(0.2, 1.0)).collect();
    // The slow reversal comes in the second quarter: it is a small part of the run.
    let mut slow = Some(duration * random.uniform(0.25, 0.5));
    while time < duration {
        if slow.is_some_and(|at| time > at) {
            slow = None;
            let speed = reach.speed * random.log_uniform(0.005, 0.05);
            let travel = (0.06 * duration * speed).min(0.3 * stroke);
            let way = if at[here] + travel > reach.high { -travel } else { travel };
            for to in [at[here] + way, at[here]] {
                segments.push(Segment::Move { to, speed, acceleration: 0.3 * reach.acceleration });
                time += travel / speed;
            }
        }
        let next = (here + 1 + random.uniform(0.0, (count - 1) as f64) as usize) % count;
        let go = Segment::Move {
            to: at[next],
            speed: random.pick(&speeds),
            acceleration: reach.acceleration * random.pick(&[0.5, 1.0]),
        };
        let stop = Segment::Dwell { time: random.uniform(0.05, 0.4) };
        time += length(at[here], &go) + length(at[next], &stop);
        segments.extend([go, stop]);
        here = next;
    }
    (at[0], segments)
}

fn sweep(random: &mut Random, reach: &Reach, duration: f64) -> (f64, Vec<Segment>) {
    let stroke = reach.high - reach.low;
    let speed = (reach.speed * random.uniform(0.1, 0.5)).max(8.0 * stroke / duration);
    let start = reach.low;
    let mut segments = vec![
        Segment::Dwell { time: random.uniform(0.1, 0.4) },
        Segment::Move { to: reach.high, speed, acceleration: reach.acceleration },
        Segment::Move { to: reach.low + 0.3 * stroke, speed, acceleration: reach.acceleration },
    ];
    let (steps, share) = (random.pick(&[6usize, 9, 12]), random.uniform(0.2, 0.9));
    let (slowest, fastest) = (random.uniform(0.2, 0.4), random.uniform(2.0, 8.0f64));
    let mut time = 2.0 * stroke / speed;
    let each = (duration - time) / steps as f64;
    for i in 0..steps {
        let frequency = slowest * (fastest / slowest).powf(i as f64 / (steps - 1) as f64);
        let omega = std::f64::consts::TAU * frequency;
        let limit = (reach.speed / omega).min(0.8 * reach.acceleration / (omega * omega)).min(0.6 * stroke);
        let cycles = ((each * frequency).floor() as usize).max(1);
        segments.push(Segment::Wave { amplitude: share * limit, frequency, cycles });
        time += cycles as f64 / frequency;
    }
    if time < duration {
        segments.push(Segment::Dwell { time: duration - time });
    }
    (start, segments)
}

/// Draws a run of about `duration` s. Every run holds a rapid across most of the stroke, a sweep each way at a middle speed,
/// slow reversals, a wave and a dwell, in random order; the rest is filled at random. The stroke must take a rapid no longer
/// than an eighth of the run. `slow_share` (0..1) asks for more slow reversals.
pub fn draw(random: &mut Random, reach: &Reach, duration: f64, slow_share: f64) -> (f64, Vec<Segment>) {
    let start = random.uniform(reach.low, reach.high);
    let mut at = start;
    let mut time = 0.0;
    let mut segments = Vec::new();
    let mut push = |s: Segment, at: &mut f64, time: &mut f64| {
        *time += length(*at, &s);
        if let Segment::Move { to, .. } = s {
            *at = to;
        }
        segments.push(s);
    };
    push(Segment::Dwell { time: random.uniform(0.1, 0.4) }, &mut at, &mut time);
    let mut wanted = vec![0, 1, 2, 2, 3, 4];
    for i in (1..wanted.len()).rev() {
        wanted.swap(i, random.uniform(0.0, (i + 1) as f64) as usize);
    }
    // The first leg goes far: the phase of what repeats along the stroke is read from the first quarter of a recording.
    if let Some(far) = wanted.iter().position(|kind| *kind < 2) {
        let last = wanted.len() - 1;
        wanted.swap(far, last);
    }
    while time < duration {
        let kind = wanted
            .pop()
            .unwrap_or_else(|| if random.chance(slow_share) { 2 } else { random.pick(&[0, 0, 1, 2, 3, 4]) });
        let stroke = reach.high - reach.low;
        let acceleration = reach.acceleration * random.uniform(0.5, 1.0);
        match kind {
            0 => {
                // Rapids to and fro, mostly long ones.
                let begin = time;
                for _ in 0..random.pick(&[1, 2, 3]) {
                    if time - begin > 0.1 * duration {
                        break;
                    }
                    let far = if at > 0.5 * (reach.low + reach.high) { reach.low } else { reach.high };
                    let to = at + (far - at) * random.uniform(0.5, 1.0);
                    let speed = reach.speed * random.uniform(0.5, 1.0);
                    push(Segment::Move { to, speed, acceleration }, &mut at, &mut time);
                    push(Segment::Dwell { time: random.uniform(0.05, 0.3) }, &mut at, &mut time);
                }
            }
            1 => {
                // A sweep there and back at a middle speed, each way in an eighth of the run at most.
                let speed = (reach.speed * random.log_uniform(0.04, 0.4)).max(8.0 * stroke / duration);
                let (first, second) =
                    if random.chance(0.5) { (reach.low, reach.high) } else { (reach.high, reach.low) };
                for end in [first, second] {
                    push(Segment::Move { to: end, speed, acceleration }, &mut at, &mut time);
                }
            }
            2 => {
                // A train of slow reversals about the present position, each long enough to be at constant speed.
                let speed = reach.speed * random.log_uniform(0.002, 0.05);
                let share = random.uniform(0.04, 0.12) * duration;
                let count = random.pick(&[2usize, 4, 6]);
                let travel = (speed * share / count as f64).min(0.4 * stroke);
                let way = if at + travel > reach.high { -1.0 } else { 1.0 };
                for i in 0..count {
                    let to = at + if i % 2 == 0 { way * travel } else { -way * travel };
                    push(Segment::Move { to, speed, acceleration: acceleration * 0.3 }, &mut at, &mut time);
                    if random.chance(0.3) {
                        push(Segment::Dwell { time: random.uniform(0.02, 0.2) }, &mut at, &mut time);
                    }
                }
            }
            3 => push(Segment::Dwell { time: random.uniform(0.1, 0.5) }, &mut at, &mut time),
            _ => {
                let cycles = random.pick(&[2usize, 3, 5]);
                let frequency = random.log_uniform(0.4, 3.0).max(8.0 * cycles as f64 / duration);
                let omega = std::f64::consts::TAU * frequency;
                let limit = (reach.speed / omega).min(0.8 * reach.acceleration / (omega * omega)).min(0.3 * stroke);
                let way = if at + limit > reach.high { -1.0 } else { 1.0 };
                let amplitude = way * limit * random.uniform(0.3, 1.0);
                push(Segment::Wave { amplitude, frequency, cycles }, &mut at, &mut time);
            }
        }
    }
    (start, segments)
}

/// How long a segment takes, s.
fn length(from: f64, s: &Segment) -> f64 {
    match *s {
        Segment::Dwell { time } => time,
        Segment::Wave { frequency, cycles, .. } => cycles as f64 / frequency,
        Segment::Move { to, speed, acceleration } => {
            let way = (to - from).abs();
            let peak = speed.min((way * acceleration).sqrt());
            if peak > 0.0 { way / peak + peak / acceleration } else { 0.0 }
        }
    }
}

/// Position on a segment `t` s after its start.
fn position(from: f64, s: &Segment, t: f64) -> f64 {
    match *s {
        Segment::Dwell { .. } => from,
        Segment::Wave { amplitude, frequency, .. } => {
            from + 0.5 * amplitude * (1.0 - (std::f64::consts::TAU * frequency * t).cos())
        }
        Segment::Move { to, speed, acceleration } => {
            let way = (to - from).abs();
            let peak = speed.min((way * acceleration).sqrt());
            let total = length(from, s);
            let ramp = peak / acceleration;
            let travelled = if t < ramp {
                0.5 * acceleration * t * t
            } else if t < total - ramp {
                peak * (t - 0.5 * ramp)
            } else {
                let left = (total - t).max(0.0);
                way - 0.5 * acceleration * left * left
            };
            from + (to - from).signum() * travelled
        }
    }
}

/// What the interpolator gives the servo every cycle: position, and its own speed at that instant (load units, 1/s).
pub struct Command {
    pub position: Vec<f64>,
    pub speed: Vec<f64>,
}

/// Samples a run at `period` s for `duration` s; `smoothing` s of moving average make S-curves (0: trapezoids).
pub fn sample(start: f64, segments: &[Segment], period: f64, duration: f64, smoothing: f64) -> Command {
    let rows = (duration / period).round() as usize;
    let (mut position_raw, mut speed_raw) = (Vec::with_capacity(rows), Vec::with_capacity(rows));
    let (mut at, mut begin) = (start, 0.0);
    let mut rest = segments.iter();
    let mut current = rest.next();
    // Speed by differences over a thousandth of a cycle; only a corner of a trapezoid inside that span is rounded.
    let span = 1e-3 * period;
    for i in 0..rows {
        let t = i as f64 * period;
        while let Some(s) = current {
            let end = begin + length(at, s);
            if t < end {
                break;
            }
            if let Segment::Move { to, .. } = *s {
                at = to;
            }
            begin = end;
            current = rest.next();
        }
        let on = |t: f64| current.map_or(at, |s| position(at, s, (t - begin).max(0.0)));
        position_raw.push(on(t));
        speed_raw.push((on(t + span) - on(t)) / span);
    }
    let width = ((smoothing / period).round() as usize).max(1);
    Command { position: averaged(&position_raw, start, width), speed: averaged(&speed_raw, 0.0, width) }
}

/// Mean of the last `width` values; before the first stands `before`.
fn averaged(raw: &[f64], before: f64, width: usize) -> Vec<f64> {
    let value = |i: isize| if i < 0 { before } else { raw[i as usize] };
    (0..raw.len() as isize).map(|i| (0..width as isize).map(|k| value(i - k)).sum::<f64>() / width as f64).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_of_every_style_keep_the_stroke_and_the_speed_and_go_across_it() {
        for seed in 0..40 {
            for style in [Style::Mixed, Style::Laps, Style::Stations, Style::Sweep] {
                let reach = Reach { high: REACH.low + style.share() * (REACH.high - REACH.low), ..REACH };
                let (start, segments) = draw_style(&mut Random::new(seed, 2), style, &reach, 15.0, 0.3);
                let Command { position: x, .. } = sample(start, &segments, 1e-3, 15.0, 0.0);
                let (low, high) = x.iter().fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(*x), h.max(*x)));
                assert!(low > reach.low - 1e-9 && high < reach.high + 1e-9, "seed {seed} {style:?}: {low} {high}");
                assert!(high - low > 0.15 * (reach.high - reach.low), "seed {seed} {style:?}: {low} {high}");
                let fastest = x.windows(2).map(|w| (w[1] - w[0]).abs() / 1e-3).fold(0.0, f64::max);
                assert!(
                    (0.2 * REACH.speed..1.0001 * REACH.speed).contains(&fastest),
                    "seed {seed} {style:?}: {fastest}"
                );
            }
        }
    }

    const REACH: Reach = Reach { low: 10.0, high: 310.0, speed: 300.0, acceleration: 2000.0 };

    #[test]
    fn a_trapezoid_takes_the_time_it_should_and_keeps_its_limits() {
        let s = Segment::Move { to: 100.0, speed: 50.0, acceleration: 500.0 };
        // way/speed + speed/acceleration
        assert!((length(0.0, &s) - (2.0 + 0.1)).abs() < 1e-12);
        assert!((position(0.0, &s, 0.1) - 2.5).abs() < 1e-12);
        assert!((position(0.0, &s, 2.1) - 100.0).abs() < 1e-12);
        // Too short for its speed: a triangle of 2·sqrt(way/acceleration).
        let s = Segment::Move { to: -2.0, speed: 50.0, acceleration: 500.0 };
        assert!((length(0.0, &s) - 2.0 * (2.0f64 / 500.0).sqrt()).abs() < 1e-12);
    }

    #[test]
    fn random_runs_keep_stroke_speed_and_acceleration() {
        for seed in 0..40 {
            let mut r = Random::new(seed, 1);
            let (start, segments) = draw(&mut r, &REACH, 15.0, 0.3);
            for smoothing in [0.0, 0.02] {
                let Command { position: x, speed } = sample(start, &segments, 1e-3, 15.0, smoothing);
                assert_eq!(x.len(), 15_000);
                let (mut fastest, mut slow) = (0.0f64, 0);
                for i in 1..x.len() - 1 {
                    // The speed is that of the instant: within half a cycle of acceleration of both differences.
                    let (before, after) = ((x[i] - x[i - 1]) / 1e-3, (x[i + 1] - x[i]) / 1e-3);
                    let slack = 1.1e-3 * REACH.acceleration;
                    assert!(
                        speed[i] > before.min(after) - slack && speed[i] < before.max(after) + slack,
                        "seed {seed}"
                    );
                }
                for w in x.windows(3) {
                    assert!(w[0] >= REACH.low - 1e-9 && w[0] <= REACH.high + 1e-9, "seed {seed}: {}", w[0]);
                    let v = (w[1] - w[0]) / 1e-3;
                    assert!(v.abs() <= REACH.speed * 1.0001, "seed {seed}: {v}");
                    // A reversal without dwell joins two ramps in one sample.
                    assert!(
                        ((w[2] - 2.0 * w[1] + w[0]) / 1e-6).abs() <= 2.0 * REACH.acceleration + 1e-3,
                        "seed {seed}"
                    );
                    fastest = fastest.max(v.abs());
                    slow += usize::from(v.abs() > 0.0 && v.abs() < 0.06 * REACH.speed);
                }
                // What every run must hold fits into it, in whatever order it is drawn.
                assert!(segments.iter().any(|s| matches!(s, Segment::Wave { .. })), "seed {seed}");
                // Diligence: runs are neither all slow nor all fast.
                assert!(fastest > 0.3 * REACH.speed, "seed {seed}: {fastest}");
                assert!(slow > 500, "seed {seed}: {slow}");
            }
        }
    }
}
