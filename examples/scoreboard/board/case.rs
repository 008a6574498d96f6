//! A case: a random rig, what is hidden in it, and the files that a diagnosis is given.
//!
//! The size of an effect is the root mean square of what it leaves unexplained in the noise-free torque when the belief is
//! given the true motion (or in table − encoder), over the noise floor of that channel (see `rig.rs`). Because a motion that
//! is faster than the encoder resolves could hide there, a case must also be visible: run with and without the effect,
//! the logged torque or position must differ by as much against what sensor noise and a shift of the encoder's grid make.

use super::effects::{self, Effect};
use super::moves::{self, Command};
use super::outside::{self, Outside};
use super::random::Random;
use super::record::{self, Recording};
use super::rig::{Rig, Scale};
use super::rough::Rough;
use super::truth::Truth;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Plant step of the recordings, and of the runs that only find a size, s.
pub const STEP: f64 = 1e-5;
const SIZING_STEP: f64 = 2.5e-5;
/// The least size that is asked for.
pub const LEAST: f64 = 1.3;
/// The most: beyond it nobody needs a diagnosis to see that something is wrong. A clearance is as wide as it is: its flanks
/// meet as hard in a narrow one.
const MOST: f64 = 100.0;
const MOST_OF_CLEARANCE: f64 = 400.0;

/// What to hide.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    Nothing,
    One(&'static str),
    Two,
    /// Two to four numbers of the belief are wrong, and in half of the cases there is something else as well.
    Beliefs,
    /// A spring or a clearance, beside a friction or a load under which it winds up or is crossed: small or large.
    BeforeTable,
    /// A spring with play: an elastic drive and a clearance.
    LooseSpring,
    Outside(&'static str),
}

impl Kind {
    /// The kind of case `index` of a run: a cycle of thirty-two with every cause once, so that short runs are balanced.
    pub fn of(seed: u64, index: usize) -> Self {
        let place = index % 32;
        let round = index / 32;
        match place {
            1 | 11 | 21 | 31 => Self::Nothing,
            4 | 14 | 24 => Self::Two,
            29 => Self::Beliefs,
            7 | 12 | 17 | 22 | 27 => {
                let nth = [7, 12, 17, 22, 27].iter().position(|p| *p == place).unwrap_or(0) + 5 * round + seed as usize;
                Self::Outside(outside::NAMES[nth % outside::NAMES.len()])
            }
            _ => {
                let nth = (0..place).filter(|p| ![1, 11, 21, 31, 4, 14, 24, 29, 7, 12, 17, 22, 27].contains(p)).count();
                Self::One(effects::CAUSES[nth % effects::CAUSES.len()])
            }
        }
    }

    /// The kind of that name, as `--cause` has it.
    pub fn named(name: &str) -> Option<Self> {
        match name {
            "none" => Some(Self::Nothing),
            "two" => Some(Self::Two),
            "beliefs" => Some(Self::Beliefs),
            "before_table" => Some(Self::BeforeTable),
            "loose_spring" => Some(Self::LooseSpring),
            _ => (effects::CAUSES.iter().find(|c| **c == name).map(|c| Self::One(c)))
                .or_else(|| outside::NAMES.iter().find(|c| **c == name).map(|c| Self::Outside(c))),
        }
    }
}

pub struct Case {
    pub kind: Kind,
    pub rig: Rig,
    pub effects: Vec<Effect>,
    /// Size of each effect alone, in multiples of the noise floor.
    pub sizes: Vec<f64>,
    /// Closed-loop difference that hiding makes in the logged torque or position, over its floor; the larger of the two.
    pub difference: f64,
    pub recording: Recording,
    pub holdout: Recording,
    /// How many rigs had to be drawn until one could show the effect.
    pub draws: usize,
}

/// Files of a case on disk.
pub struct Files {
    pub machine: PathBuf,
    pub truth_machine: PathBuf,
    pub recording: PathBuf,
    pub holdout: PathBuf,
}

/// One rig with its command, before anything is hidden.
struct Bench {
    rig: Rig,
    command: Command,
    peak: f64,
    belief: Recording,
    /// Root mean square of what a shift of the encoder's grid changes in torque and position.
    jitter: (f64, f64),
}

/// Root mean square of a[i] − b[i] − offset.
fn apart(a: &[f64], b: &[f64], offset: f64) -> f64 {
    record::rms(&a.iter().zip(b).map(|(a, b)| a - b - offset).collect::<Vec<_>>())
}

impl Bench {
    fn draw(kind: Kind, longest: f64, rough: bool, random: &mut Random) -> Option<Self> {
        let mut rig = Rig::draw(random, longest);
        if rough {
            rig.rough = Rough::draw(&rig, random);
        }
        if let Kind::One(cause) = kind {
            if !effects::possible(cause, &rig) {
                return None;
            }
            if effects::on_table_only(cause) && rig.table.is_none() {
                rig.table = Some(Scale::draw(random));
            }
        }
        let slow = random.uniform(0.1, 0.4);
        let command = draw_command(&rig, rig.duration, slow, random);
        let belief = record::run(&rig, &Truth::of(&rig), &command, SIZING_STEP, &mut Random::new(0, 0));
        let peak = belief.clean_torque.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        if !runs_well(&rig, &belief) {
            return None;
        }
        let shift = 0.37 * rig.encoder_step;
        let moved =
            Command { position: command.position.iter().map(|c| c + shift).collect(), speed: command.speed.clone() };
        let twin = record::run(&rig, &Truth::of(&rig), &moved, SIZING_STEP, &mut Random::new(0, 0));
        let jitter = (
            apart(&twin.clean_torque, &belief.clean_torque, 0.0),
            apart(&twin.true_position, &belief.true_position, shift),
        );
        Some(Self { rig, command, peak, belief, jitter })
    }

    /// How much a recording of the same command differs from the belief's, over what noise and grid make of it.
    fn difference(&self, r: &Recording) -> f64 {
        let torque =
            apart(&r.clean_torque, &self.belief.clean_torque, 0.0) / self.rig.torque_floor().hypot(self.jitter.0);
        let grid = self.rig.encoder_floor();
        let position = apart(&r.true_position, &self.belief.true_position, 0.0) / grid.hypot(self.jitter.1);
        let table = if r.table.is_some() { record::spread(&r.table_error) / self.rig.table_floor() } else { 0.0 };
        torque.max(position).max(table)
    }

    /// Root mean square of what a recording leaves unexplained, beyond what the belief's own run does, over the floor.
    fn size_of(&self, r: &Recording, cause: &str) -> f64 {
        let (all, own) = (record::rms(&r.unexplained), record::rms(&self.belief.unexplained));
        let torque = (all * all - own * own).max(0.0).sqrt() / self.rig.torque_floor();
        let table = if r.table.is_some() { record::spread(&r.table_error) / self.rig.table_floor() } else { 0.0 };
        if effects::on_table_only(cause) { table } else { torque.max(table) }
    }

    /// Size of one effect alone.
    fn size(&self, effect: &Effect) -> Option<f64> {
        let mut truth = Truth::of(&self.rig);
        effect.apply(&self.rig, &mut truth);
        let r = record::run(&self.rig, &truth, &self.command, SIZING_STEP, &mut Random::new(0, 0));
        // What noise hides is not there: such a size counts as none.
        let size = self.size_of(&r, effect.cause);
        runs_well(&self.rig, &r).then_some(if self.difference(&r) < LEAST { size.min(0.99 * LEAST) } else { size })
    }

    /// Brings an effect to a size: first through the sensor's noise where that may move, then through its amount.
    fn fit(&mut self, effect: &mut Effect, target: f64, noise_may_move: bool) -> Option<f64> {
        let mut size = self.size(effect)?;
        if noise_may_move && !effects::on_table_only(effect.cause) && size > 0.0 {
            let wanted = self.rig.torque_noise * size / target;
            self.rig.torque_noise = wanted.clamp(0.008 * self.rig.coulomb, 0.08 * self.rig.coulomb);
            size = self.size(effect)?;
        }
        let most = if effect.cause == "backlash" { MOST_OF_CLEARANCE } else { MOST };
        for _ in 0..if effect.cause == "backlash" { 0 } else { 4 } {
            if (size / target - 1.0).abs() < 0.1 || size <= 0.0 {
                break;
            }
            let amount = (effect.amount * (target / size).powf(1.0 / effect.power)).clamp(effect.low, effect.high);
            if amount == effect.amount {
                break;
            }
            effect.amount = amount;
            size = self.size(effect)?;
        }
        (LEAST..=most).contains(&size).then_some(size)
    }
}

fn draw_command(rig: &Rig, duration: f64, slow: f64, random: &mut Random) -> Command {
    let (start, segments) = moves::draw_style(random, rig.style, &rig.reach, duration, slow);
    let mut command = moves::sample(start, &segments, rig.servo.period, duration, rig.smoothing);
    // The servo gets what the recording says, to the last digit.
    command.position.iter_mut().for_each(|c| *c = (*c * 1e7).round() / 1e7);
    command
}

/// A loop that swings, a motor that is always at its limit or an axis that does not follow is no identification run.
fn runs_well(rig: &Rig, r: &Recording) -> bool {
    let worst = r.command.iter().zip(&r.true_position).fold(0.0f64, |m, (c, x)| m.max((c - x).abs()));
    let lag = rig.reach.speed * ((1.0 - rig.servo.feedforward) / rig.servo.position_gain + 4.0 * rig.servo.period);
    let dynamic = 0.3 * rig.reach.speed / rig.servo.position_gain;
    r.limited < r.command.len() / 50 && worst < 1.5 * lag + 2.0 * dynamic
}

/// Causes that are hidden together; `None` where they may not be.
fn together(kind: Kind, rig: &Rig, random: &mut Random) -> Option<Vec<&'static str>> {
    let possible = |c: &&&str| effects::possible(c, rig) && (rig.table.is_some() || !effects::on_table_only(c));
    let causes: Vec<&str> = effects::CAUSES.iter().filter(possible).copied().collect();
    let (beliefs, others): (Vec<&str>, Vec<&str>) = causes.iter().partition(|c| effects::BELIEFS.contains(c));
    let list = if kind == Kind::LooseSpring {
        // The spring comes first: play is put into it.
        let both = vec!["drive_compliance", "backlash"];
        return both.iter().all(|cause| causes.contains(cause)).then_some(both);
    } else if kind == Kind::Two {
        vec![random.pick(&causes), random.pick(&causes)]
    } else if kind == Kind::BeforeTable {
        let of = |is: fn(&str) -> bool| causes.iter().copied().filter(|c| is(c)).collect::<Vec<&str>>();
        let (before, resisting) = (of(effects::before_table), of(effects::resists));
        if before.is_empty() {
            return None;
        }
        return Some(vec![random.pick(&before), random.pick(&resisting)]);
    } else {
        let left_out = random.uniform(0.0, 2.0 * beliefs.len() as f64) as usize;
        let mut list: Vec<&str> = (0..beliefs.len()).filter(|i| *i != left_out).map(|i| beliefs[i]).collect();
        list.truncate(random.pick(&[2, 3, 4]));
        if random.chance(0.5) {
            list.push(random.pick(&others));
        }
        list
    };
    let fit = (0..list.len()).all(|i| (0..i).all(|j| effects::separable(list[i], list[j])));
    fit.then_some(list)
}

impl Case {
    /// Draws case `index` of a seed, with recordings of 10 s to `longest` s. On rough rigs (see `rough.rs`)
    /// if wished. The same seed and index give the same files on every machine.
    pub fn draw(seed: u64, index: usize, kind: Kind, longest: f64, rough: bool) -> Self {
        for draws in 1.. {
            let mut random = Random::new(seed, (index as u64) << 20 | draws);
            if let Some(case) = Self::attempt(kind, longest, rough, &mut random, draws as usize) {
                return case;
            }
            assert!(draws < 400, "seed {seed}, case {index}: no rig shows {kind:?}");
        }
        unreachable!()
    }

    fn attempt(kind: Kind, longest: f64, rough: bool, random: &mut Random, draws: usize) -> Option<Self> {
        let mut bench = Bench::draw(kind, longest, rough, random)?;
        let mut hidden = Vec::new();
        let mut sizes = Vec::new();
        let mut outside = None;
        match kind {
            Kind::Nothing => {}
            Kind::One(cause) => {
                let mut effect = Effect::draw(cause, &bench.rig, bench.peak, random);
                // One in six is large.
                let target = if random.chance(1.0 / 6.0) {
                    random.log_uniform(10.0, 0.9 * MOST)
                } else {
                    random.log_uniform(LEAST, 10.0)
                };
                let noise_may_move = random.chance(0.5) || effect.power != 1.0;
                sizes.push(bench.fit(&mut effect, target, noise_may_move)?);
                hidden.push(effect);
            }
            Kind::Two | Kind::Beliefs | Kind::BeforeTable | Kind::LooseSpring => {
                let largest = if kind == Kind::Two || kind == Kind::Beliefs { 8.0 } else { 40.0 };
                for cause in together(kind, &bench.rig, random)? {
                    let mut effect = Effect::draw(cause, &bench.rig, bench.peak, random);
                    let target = random.log_uniform(1.5, largest);
                    sizes.push(bench.fit(&mut effect, target, false)?);
                    hidden.push(effect);
                }
            }
            Kind::Outside(name) => {
                let (form, course) = (random.next(), random.next());
                let draw = |magnitude| {
                    Outside::draw(name, &bench.rig, &mut Random::new(form, 0), &mut Random::new(course, 0), magnitude)
                };
                let target = random.log_uniform(LEAST, 8.0);
                let mut magnitude = 0.2 * bench.rig.coulomb;
                for _ in 0..4 {
                    let truth = Truth { outside: draw(magnitude), ..Truth::of(&bench.rig) };
                    let r = record::run(&bench.rig, &truth, &bench.command, SIZING_STEP, &mut Random::new(0, 0));
                    let size = bench.size_of(&r, name);
                    sizes = vec![size];
                    if !runs_well(&bench.rig, &r) || size <= 0.0 {
                        return None;
                    }
                    if (size / target - 1.0).abs() < 0.1 {
                        break;
                    }
                    magnitude = (magnitude * target / size).min(0.8 * bench.rig.coulomb);
                }
                if sizes[0] < LEAST {
                    return None;
                }
                outside = Some((form, magnitude));
            }
        }
        Self::record(kind, bench, hidden, sizes, outside, random, draws)
    }

    /// Makes the two recordings of a rig with everything in it.
    fn record(
        kind: Kind,
        bench: Bench,
        hidden: Vec<Effect>,
        sizes: Vec<f64>,
        outside: Option<(u64, f64)>,
        random: &mut Random,
        draws: usize,
    ) -> Option<Self> {
        let rig = bench.rig.clone();
        let run = |command: &Command, renewed: bool, random: &mut Random| {
            let mut truth = Truth::of(&rig);
            for effect in &hidden {
                let mut effect = effect.clone();
                if renewed {
                    effect.new_phase(random);
                }
                effect.apply(&rig, &mut truth);
            }
            if let (Some((form, magnitude)), Kind::Outside(name)) = (outside, kind) {
                truth.outside =
                    Outside::draw(name, &rig, &mut Random::new(form, 0), &mut Random::new(random.next(), 0), magnitude);
            }
            let r = record::run(&rig, &truth, command, STEP, random);
            runs_well(&rig, &r).then_some(r)
        };
        let recording = run(&bench.command, false, random)?;
        let holdout_command = draw_command(&rig, (0.6 * rig.duration).max(10.0), 0.25, random);
        let holdout = run(&holdout_command, true, random)?;
        let difference = bench.difference(&recording);
        // Two effects may cancel, an outside one may sit where the loop hides it, and a rig on the edge of sticking may show
        // the step of integration: such a case says nothing about a diagnosis.
        if (kind == Kind::Nothing) != (difference < LEAST) {
            return None;
        }
        Some(Self { kind, rig, effects: hidden, sizes, difference, recording, holdout, draws })
    }

    /// Writes what a user would have (belief and recordings), and beside it the truth.
    pub fn write(&self, folder: &Path) -> std::io::Result<Files> {
        std::fs::create_dir_all(folder)?;
        let at = |name: &str| folder.join(name);
        let files = Files {
            machine: at("machine.json"),
            truth_machine: at("truth_machine.json"),
            recording: at("recording.csv"),
            holdout: at("holdout.csv"),
        };
        self.recording.write(&self.rig, &files.recording)?;
        self.holdout.write(&self.rig, &files.holdout)?;
        let entries: Vec<Value> = self.effects.iter().map(|e| e.entry(&self.rig)).collect();
        let pretty = |v: &Value| format!("{v:#}\n");
        std::fs::write(&files.machine, pretty(&self.rig.machine_file("rig", vec![])))?;
        std::fs::write(&files.truth_machine, pretty(&self.rig.machine_file("rig", entries.clone())))?;
        let truth = json!({ "hidden": format!("{:?}", self.kind), "effects": entries, "sizes": self.sizes,
            "closed_loop_difference": self.difference, "torque_noise": self.rig.torque_noise,
            "torque_floor": self.rig.torque_floor(), "encoder_step": self.rig.encoder_step, "draws": self.draws,
            "forms": self.effects.iter().map(|e| e.form).collect::<Vec<_>>() });
        std::fs::write(at("truth.json"), pretty(&truth))?;
        Ok(files)
    }
}
