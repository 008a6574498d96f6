//! Mean load over a short block of the path.
//!
//! A motor phase carries i = √2·I·|sin φ|, whose square swings at twice the electrical frequency f = p·n/60 (p: pole
//! pairs, n: speed in min⁻¹). Over whole periods the mean of i² is I², exactly; so a block of current ends where the
//! electrical angle has made whole turns, and the sample in which it does belongs to both blocks by its shares. A DC load
//! is a plain mean over the same time.

use super::io::TiltInput;
use super::plan::Plan;

/// Start of every sum of squares: keeps it out of the subnormal numbers when nothing flows.
const FLOOR: f64 = 1e-60;

/// The block under way.
#[derive(Debug, Clone, Copy, Default)]
pub struct Collector {
    /// Cycles in it, with the share of the first.
    cycles: f64,
    /// Turns of the electrical angle, or shares of the block's time for a DC load.
    turns: f64,
    /// Turns at which it ends.
    whole: f64,
    /// Cycles at which it is given up: the spindle stands.
    longest: f64,
    sum: f64,
    position: [f64; 2],
    speed: f64,
}

/// A finished block.
#[derive(Debug, Clone, Copy)]
pub struct Mean {
    /// True RMS or mean of the load.
    pub load: f64,
    /// Mean position x y, mm.
    pub position: [f64; 2],
    /// Mean spindle speed, min⁻¹.
    pub speed: f64,
    /// Length in cycles.
    pub cycles: f64,
    /// The samples fall on too few phases of the current for a mean of its square.
    pub aliased: bool,
}

impl Collector {
    /// An empty block that begins with the share `first` of a cycle with `input`.
    #[must_use]
    pub fn begin(plan: &Plan, input: &TiltInput, first: f64) -> Collector {
        let speed = input.speed_rpm.abs();
        let turns = speed * plan.turns_per_rpm + plan.turns_per_cycle;
        // Whole turns that take the block's time at the present speed; one at least.
        let whole = (plan.block_cycles * turns).ceil().max(1.0);
        let longest = 4.0 * plan.block_cycles;
        let mut block = Collector { whole, longest, sum: FLOOR, ..Collector::default() };
        block.add(plan, input, first);
        block
    }

    #[inline(always)]
    fn add(&mut self, plan: &Plan, input: &TiltInput, share: f64) {
        self.cycles += share;
        self.sum_up(plan, input, share);
    }

    #[inline(always)]
    fn sum_up(&mut self, plan: &Plan, input: &TiltInput, share: f64) {
        let speed = input.speed_rpm.abs();
        self.turns += share * (speed * plan.turns_per_rpm + plan.turns_per_cycle);
        self.sum += share * input.load * (plan.squared * input.load + plan.plain);
        self.position[0] += share * input.position_mm[0];
        self.position[1] += share * input.position_mm[1];
        self.speed += share * speed;
    }

    /// Adds a cycle when the block goes on after it; else changes nothing.
    pub fn quick(&mut self, plan: &Plan, input: &TiltInput) -> bool {
        let goes_on = self.cycles < self.longest && self.usual(plan, input);
        if goes_on {
            self.cycles += 1.0;
        }
        goes_on
    }

    /// The same for one of at most [`Collector::most_more`] cycles, which are to be counted afterwards.
    #[inline(always)]
    pub fn usual(&mut self, plan: &Plan, input: &TiltInput) -> bool {
        let turns = input.speed_rpm.abs() * plan.turns_per_rpm + plan.turns_per_cycle;
        let goes_on = self.turns + turns < self.whole;
        if goes_on {
            self.sum_up(plan, input, 1.0);
        }
        goes_on
    }

    /// Cycles that can follow before the block is given up.
    #[must_use]
    pub fn most_more(&self) -> u32 {
        (self.longest - self.cycles) as u32
    }

    /// Counts usual cycles.
    pub fn count(&mut self, cycles: u32) {
        self.cycles += f64::from(cycles);
    }

    /// Adds the cycle that ends the block; gives the block and begins the next with what is left of the cycle. None for a
    /// block that was given up.
    pub fn close(&mut self, plan: &Plan, input: &TiltInput) -> Option<Mean> {
        let turns = input.speed_rpm.abs() * plan.turns_per_rpm + plan.turns_per_cycle;
        let share = if turns > 0.0 { ((self.whole - self.turns) / turns).clamp(0.0, 1.0) } else { 1.0 };
        let given_up = self.cycles >= self.longest;
        self.add(plan, input, share);
        let done = *self;
        *self = Collector::begin(plan, input, 1.0 - share);
        if given_up {
            return None;
        }
        let mean = done.sum / done.cycles;
        let load = if plan.squared > 0.0 { mean.sqrt() } else { mean };
        // |sin| has twice the frequency; sampled, it looks like the distance to the nearest whole number of turns.
        let beat = 2.0 * done.turns / done.cycles;
        let aliased = plan.squared > 0.0 && (beat - (beat + 0.5).floor()).abs() * done.cycles < 1.0;
        let position = done.position.map(|sum| sum / done.cycles);
        Some(Mean { load, position, speed: done.speed / done.cycles, cycles: done.cycles, aliased })
    }
}

#[cfg(test)]
mod tests {
    use super::super::plan::tests::valid;
    use super::*;

    fn blocks(signal: i32, rpm: impl Fn(u32) -> f64, load: impl Fn(u32, f64) -> f64) -> Vec<Mean> {
        let plan = Plan::new(&super::super::config::TiltConfig { signal, ..valid() }).unwrap();
        let (mut angle, mut found, mut block) = (0.3, Vec::new(), None::<Collector>);
        for i in 0..5000 {
            angle += core::f64::consts::TAU * rpm(i) / 60.0 * f64::from(valid().pole_pairs) * valid().cycle_s;
            let input = TiltInput { load: load(i, angle), speed_rpm: rpm(i), ..TiltInput::default() };
            match &mut block {
                None => block = Some(Collector::begin(&plan, &input, 1.0)),
                Some(block) => {
                    if !block.quick(&plan, &input) {
                        found.extend(block.close(&plan, &input));
                    }
                }
            }
        }
        found
    }

    #[test]
    fn true_rms_over_whole_periods_at_any_speed() {
        for rpm in [200.0, 997.0, 1733.0, 6000.0] {
            let found = blocks(0, |_| rpm, |_, angle| 8.0 * 2f64.sqrt() * angle.sin().abs());
            assert!(found.len() >= 10);
            for block in &found {
                assert!((block.load - 8.0).abs() < 0.04 && !block.aliased, "{rpm}: {block:?}");
                assert!((block.speed - rpm).abs() < 1e-9);
            }
            let mean = found.iter().map(|b| b.load).sum::<f64>() / found.len() as f64;
            assert!((mean - 8.0).abs() < 0.004, "{rpm}: {mean}");
        }
    }

    #[test]
    fn a_speed_that_varies_does_not_matter() {
        let rpm = |i: u32| 900.0 + 90.0 * (f64::from(i) * 0.003).sin();
        for block in blocks(0, rpm, |_, angle| -8.0 * 2f64.sqrt() * angle.sin()) {
            assert!((block.load - 8.0).abs() < 0.04, "{block:?}");
        }
    }

    /// At 15000 min⁻¹ and two pole pairs the current has 500 Hz: a servo of 1 kHz sees one phase of its square.
    #[test]
    fn samples_that_see_one_phase_are_known() {
        assert!(blocks(0, |_| 15000.0, |_, angle| angle.sin()).iter().all(|block| block.aliased));
        assert!(blocks(1, |_| 15000.0, |_, _| 40.0).iter().all(|block| !block.aliased));
    }

    #[test]
    fn a_dc_load_is_a_plain_mean_and_a_spindle_at_rest_gives_no_current() {
        let found = blocks(1, |_| 0.0, |i, _| 40.0 + f64::from(i % 2));
        assert!(found.len() >= 48 && found.iter().all(|block| (block.load - 40.5).abs() < 0.01));
        assert!(blocks(0, |_| 0.0, |_, _| 3.0).is_empty());
    }
}
