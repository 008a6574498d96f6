//! What is read while the axis moves: the torque of the scan as it grows, and the probe of the motor's friction.

use crate::cycle::backlash::curve::Moments;
use crate::cycle::backlash::plan::Plan;
use crate::error::{Fault, GIB_ERR_BACKLASH_MOTOR_FRICTION};

/// Share of sliding at which the wind-up has certainly begun where nothing but friction loads the table, and how far up
/// the one is that scales the probe.
const RISE_LOW: f64 = 0.5;
const RISE_HIGH: f64 = 0.15;
/// Most that a constant load moves them up.
const MOST_LEAN: f64 = 0.35;
/// Growth of the smoothed torque, as a share of sliding, that is worth a look.
const LEAST_NEWS: f64 = 0.03;
/// Points of the curve, and share of the way, without growth after which the table is sliding.
const STALL_POINTS: f64 = 15.0;
const STALL_SHARE: f64 = 0.4;

/// Reading of the scan while it runs: the smoothed torque as a share of sliding, −1 before, +1 after.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Watch {
    pub(super) middle: f64,
    pub(super) per_half: f64,
    pub(super) smooth: f64,
    pub(super) gain: f64,
    /// Growth beyond this is news: the highest reading so far and what chance may add.
    pub(super) news: f64,
    pub(super) margin: f64,
    pub(super) highest: f64,
    /// Travel at which the highest reading was: from there on the table slides, if it does.
    pub(super) highest_at: f64,
    /// Reading at which the wind-up has certainly begun, and one further up.
    pub(super) low: f64,
    high: f64,
    /// Travel at which the reading passed `high`; 0 before.
    pub(super) high_at: f64,
    /// Travel at which the scan ends unless there is news.
    pub(super) end: f64,
}

/// Torque against way back from `turn`, both ways, over the middle of the probe's depth.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Probe {
    pub(super) turn: f64,
    pub(super) depth: f64,
    /// Where the way forth ends, and between which places torques count, mm back from `turn`.
    pub(super) near: f64,
    pub(super) from: f64,
    pub(super) to: f64,
    pub(super) deepest: f64,
    pub(super) back: Moments,
    pub(super) forth: Moments,
}

impl Watch {
    /// Begins a scan between the sliding levels that ends at `limit` (mm). `noise` is the standard deviation of one
    /// sample, `gain` the share of a new sample in the smoothed one.
    pub(super) fn new(before: f64, after: f64, noise: f64, gain: f64, limit: f64) -> Watch {
        let per_half = 2.0 / (after - before);
        // White noise of std σ has σ·√(gain/2) left after the smoothing; twice that is growth, not chance.
        let margin = LEAST_NEWS + 2.0 * noise * per_half * (0.5 * gain).sqrt();
        let middle = 0.5 * (before + after);
        // Across a clearance the motor has its own friction to overcome, and no load that leans on the table: where that
        // helps the motion, the clearance reads higher by its share. One that no friction holds leaves no clearance to cross.
        let lean = -middle * per_half;
        let low = RISE_LOW + if lean > 1.0 { 0.0 } else { lean.clamp(0.0, MOST_LEAN) };
        let high = low + RISE_HIGH;
        Watch {
            middle,
            per_half,
            smooth: -1.0,
            gain,
            news: -1.0,
            margin,
            highest: -1.0,
            highest_at: 0.0,
            low,
            high,
            high_at: 0.0,
            end: limit,
        }
    }

    /// Begins anew, where the table has slipped.
    pub(super) fn again(&mut self, limit: f64) {
        *self = Watch { smooth: -1.0, news: -1.0, highest: -1.0, highest_at: 0.0, high_at: 0.0, end: limit, ..*self };
    }

    /// The smoothed torque once this sample is in.
    #[inline(always)]
    pub(super) fn next(&self, torque: f64) -> f64 {
        self.smooth + self.gain * ((torque - self.middle) * self.per_half - self.smooth)
    }

    /// Adds a sample.
    pub(super) fn add(&mut self, travel: f64, torque: f64, plan: &Plan) {
        self.smooth = self.next(torque);
        if self.smooth > self.news {
            self.grow(travel, plan);
        }
    }

    /// The reading has grown: the scan goes on for as long as growth may be hidden by noise or by a clearance.
    fn grow(&mut self, travel: f64, plan: &Plan) {
        self.highest = self.smooth;
        self.highest_at = travel;
        self.news = self.smooth + self.margin;
        if self.high_at == 0.0 && self.smooth > self.high {
            self.high_at = travel;
        }
        if self.smooth > self.low {
            self.go_on(travel, plan);
        }
    }

    fn go_on(&mut self, travel: f64, plan: &Plan) {
        let stall = (STALL_POINTS * plan.step).max(STALL_SHARE * travel);
        // The table must move within the limit; that it does is seen beyond.
        self.end = if travel < plan.limit { travel + stall } else { travel };
    }

    /// Whether the table slides, where the scan has come to its end. A reading that has fallen was the motor's run into a
    /// clearance: the scan goes on.
    pub(super) fn slides(&mut self, travel: f64, plan: &Plan) -> bool {
        if self.smooth < self.low && travel < plan.limit {
            self.go_on(travel, plan);
            return false;
        }
        true
    }
}

impl Probe {
    /// Begins a probe that goes back by `depth` mm and must not go further than `deepest`, where the table slips.
    pub(super) fn new(depth: f64, deepest: f64) -> Probe {
        let (near, from, to) = (0.1 * depth, 0.25 * depth, 0.75 * depth);
        Probe { depth, near, from, to, deepest, ..Probe::default() }
    }

    /// Whether the way has ended: back at its depth, or forth before the place where it turned.
    #[inline(always)]
    pub(super) fn ended(&self, back: f64, forth: bool) -> bool {
        if forth { back <= self.near } else { back >= self.depth }
    }

    /// Adds a torque, `back` mm from the turn. The first and last quarter, where the motor turns, are left out.
    #[inline(always)]
    pub(super) fn add(&mut self, back: f64, forth: bool, torque: f64) {
        if back > self.from && back < self.to {
            let way = if forth { &mut self.forth } else { &mut self.back };
            *way = way.with(1.0, back, torque);
        }
    }

    /// Says whether the probe tells the motor's friction where sliding takes `before` one way and `after` the other: more than half
    /// of the friction on the motor's side leaves too little wind-up to see; and a probe that cannot say is no probe; nor is
    /// one whose torque is the same all the way, there and back: it is stuck; nor one whose torque is beyond what sliding takes
    /// either way, for the table sticks: it is not the drive's.
    ///
    /// # Errors
    /// `GIB_ERR_BACKLASH_MOTOR_FRICTION` with the readings of a way, or with what it found as a share of the change between the two.
    pub(super) fn check(&self, twice: f64, variance: f64, [before, after]: [f64; 2]) -> Result<(), Fault> {
        const LARGEST_SHARE: f64 = 0.55;
        const WORST_ERROR: f64 = 0.1;
        const STUCK: f64 = 1e-7;
        const FEWEST: f64 = 2.0;
        const SIGMAS: f64 = 3.0;
        let change = after - before;
        let fault =
            |field, value, low, high| Err(Fault { code: GIB_ERR_BACKLASH_MOTOR_FRICTION, field, value, low, high });
        let readings = self.back.n.min(self.forth.n);
        if readings < FEWEST {
            return fault("probe_readings\0", readings, FEWEST, f64::MAX);
        }
        // Readings all at one place leave the error open.
        let error = Some(variance.sqrt() / change).filter(|error| error.is_finite()).unwrap_or(f64::MAX);
        let share = twice.max(0.0) / change;
        if error > WORST_ERROR {
            return fault("motor_friction_error_ratio\0", error, 0.0, WORST_ERROR);
        }
        if share > LARGEST_SHARE {
            return fault("motor_friction_ratio\0", share, 0.0, LARGEST_SHARE);
        }
        let alive = (twice / change).abs().max(error);
        if alive <= STUCK {
            return fault("probe_torque_ratio\0", alive, STUCK, f64::MAX);
        }
        // The probe's own noise is no more than that of the difference.
        let (low, high) = (-SIGMAS * error, 1.0 + SIGMAS * error);
        for way in [&self.back, &self.forth] {
            let level = (way.t / way.n - before) / change;
            if !(level >= low && level <= high) {
                return fault("probe_level_ratio\0", level, low, high);
            }
        }
        Ok(())
    }

    /// Twice the motor's friction and its variance: the distance of two parallel lines, torque against way, one for
    /// each sense. Parallel, since the drive's stiffness is the same both ways; lines, since the motor does not
    /// pass all places equally fast.
    pub(super) fn difference(&self) -> (f64, f64) {
        let (b, f) = (&self.back, &self.forth);
        let spread = |m: &Moments| m.ss - m.s * m.s / m.n;
        let with_way = |m: &Moments| m.st - m.s * m.t / m.n;
        let slope = (with_way(b) + with_way(f)) / (spread(b) + spread(f));
        let apart = f.s / f.n - b.s / b.n;
        let twice = f.t / f.n - b.t / b.n - slope * apart;
        let rest = |m: &Moments| m.tt - m.t * m.t / m.n - slope * with_way(m);
        let noise = (rest(b) + rest(f)).max(0.0) / (b.n + f.n - 3.0);
        (twice, noise * (1.0 / b.n + 1.0 / f.n + apart * apart / (spread(b) + spread(f))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a probe says of which the torque (N·m) at each µm back from the turn is `back` on its way back and `forth` on its way forth,
    /// where the table slides at 10 N·m and at 80.
    fn said(back: impl Fn(f64) -> f64, forth: impl Fn(f64) -> f64) -> Result<(), Fault> {
        let mut probe = Probe::new(0.01, 0.04);
        for i in 0..100 {
            let (way, noise) = (1e-4 * f64::from(i), if i % 2 == 0 { 0.5 } else { -0.5 });
            probe.add(way, false, back(1e3 * way) + noise);
            probe.add(way, true, forth(1e3 * way) + noise);
        }
        let (twice, variance) = probe.difference();
        probe.check(twice, variance, [10.0, 80.0])
    }

    #[test]
    fn a_torque_that_no_table_takes_is_no_probe() {
        assert_eq!(said(|way| 70.0 - way, |way| 80.0 - way), Ok(()));
        // A load hangs on the table, and the torque has gone dead: it shows no friction of the motor's.
        let fault = said(|_| 0.0, |_| 0.0).unwrap_err();
        assert_eq!((fault.code, fault.field), (GIB_ERR_BACKLASH_MOTOR_FRICTION, "probe_level_ratio\0"));
        assert!(fault.value < fault.low);
        // The torque's zero has gone off on the way forth.
        assert!(said(|way| 70.0 - way, |way| 95.0 - way).is_err());
    }

    #[test]
    fn that_a_table_moves_within_the_limit_may_be_seen_beyond() {
        let plan = Plan { limit: 0.03, step: 0.001, ..Plan::REST };
        let rises_to = |last: f64| {
            let mut watch = Watch::new(-1.0, 1.0, 0.0, 1.0, plan.limit);
            let mut travel = 0.0;
            while travel < watch.end {
                watch.add(travel, -1.0 + 2.0 * (travel / last).min(1.0), &plan);
                travel += 1e-4;
            }
            (watch.highest_at, travel)
        };
        let (moves, seen) = rises_to(0.025);
        assert!(moves < 0.026 && seen > 0.039 && seen < 0.042, "moves at {moves}, seen at {seen}");
        // What does not move within it is not waited for.
        let (moves, seen) = rises_to(0.032);
        assert!(moves >= plan.limit && seen < plan.limit + 0.002, "moves at {moves}, seen at {seen}");
    }
}
