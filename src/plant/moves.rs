//! Commanded motions: a list of moves, or the built-in test moves.
//!
//! A move runs to a position with a trapezoid of speed; where a jerk is given the trapezoid is averaged over
//! acceleration/jerk seconds, which limits the jerk to that value and lengthens the move by as much. A sweep is a sine
//! about the present position whose frequency rises exponentially. File: `{"schema": "gib.moves/1", "start_mm": 0,
//! "moves": [{"to_mm": 100, "speed_mm_s": 50, "acceleration_mm_s2": 1000, "jerk_mm_s3": 20000}, {"dwell_s": 0.5},
//! {"sweep_mm": 1, "from_hz": 1, "to_hz": 20, "duration_s": 10}]}`; on a rotary axis read mm as degrees.

use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::f64::consts::{PI, TAU};

/// One element of a motion. Load units.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(untagged, deny_unknown_fields)]
pub enum Move {
    /// Straight to a position.
    To {
        /// Where to.
        to_mm: f64,
        /// Top speed.
        speed_mm_s: f64,
        /// Acceleration and deceleration.
        acceleration_mm_s2: f64,
        /// Jerk; none means that acceleration steps.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        jerk_mm_s3: Option<f64>,
    },
    /// Standing still.
    Dwell {
        /// For how long.
        dwell_s: f64,
    },
    /// A sine of rising frequency about where the axis stands.
    Sweep {
        /// Amplitude at the first frequency; the amplitude of acceleration stays what it is there.
        sweep_mm: f64,
        /// First frequency.
        from_hz: f64,
        /// Last frequency.
        to_hz: f64,
        /// For how long.
        duration_s: f64,
    },
}

/// A motion: where it starts and what is done from there.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Moves {
    /// `gib.moves/1`.
    pub schema: String,
    /// The axis it is meant for, where said.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axis: Option<String>,
    /// Where the axis stands before the first move.
    pub start_mm: f64,
    /// What is done, in order.
    pub moves: Vec<Move>,
}

/// Name of the format.
pub const SCHEMA: &str = "gib.moves/1";
/// What a list of moves looks like, for who wrote another.
const FORM: &str =
    "a list of moves is {\"schema\": \"gib.moves/1\", \"start_mm\": 0, \"moves\": [{…}, …]}, see docs/diagnosis.md";
/// What a move looks like.
const MOVES: &str = "{to_mm, speed_mm_s, acceleration_mm_s2, perhaps jerk_mm_s3}, {dwell_s} and {sweep_mm, from_hz, to_hz, duration_s}, each a number; see docs/diagnosis.md";
/// Names of the built-in sets.
pub const BUILT_IN: [&str; 4] = ["test", "reversals", "strokes", "sweep"];

/// What a built-in set may use of the axis, load units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reach {
    /// Where the stroke begins.
    pub start: f64,
    /// Length of the stroke.
    pub stroke: f64,
    /// Top speed.
    pub speed: f64,
    /// Acceleration.
    pub acceleration: f64,
}

impl Moves {
    /// Reads a list of moves.
    ///
    /// # Errors
    /// Not JSON, another schema, or a value out of range, with the number of the move.
    pub fn parse(text: &str) -> Result<Moves, String> {
        let value: Value =
            serde_json::from_str(text.trim_start_matches('\u{feff}')).map_err(|e| format!("not JSON: {e}; {FORM}"))?;
        let Value::Object(mut object) = value else { return Err(format!("is no object {{…}}; {FORM}")) };
        match object.remove("schema") {
            Some(Value::String(schema)) if schema == SCHEMA => {}
            Some(other) => return Err(format!("schema {other} is not known; this gib reads \"{SCHEMA}\"")),
            None => return Err(format!("schema is missing; {FORM}")),
        }
        let Some(Value::Array(list)) = object.remove("moves") else {
            return Err(format!("moves is no list […]; {FORM}"));
        };
        let mut moves =
            Moves { schema: SCHEMA.into(), axis: None, start_mm: 0.0, moves: Vec::with_capacity(list.len()) };
        for (key, value) in object {
            match (key.as_str(), value) {
                ("axis", Value::Null) => {}
                ("axis", Value::String(axis)) => moves.axis = Some(axis),
                ("start_mm", Value::Number(start)) => moves.start_mm = start.as_f64().unwrap_or(f64::NAN),
                (key @ ("axis" | "start_mm"), value) => return Err(format!("{key} cannot be {value}; {FORM}")),
                (key, _) => return Err(format!("{key} has no meaning here; {FORM}")),
            }
        }
        if !(moves.start_mm.abs() <= 1e6) {
            return Err(format!("start_mm {} is out of range; give a number from -1000000 to 1000000", moves.start_mm));
        }
        for (i, value) in list.into_iter().enumerate() {
            let m = Move::deserialize(&value).map_err(|_| format!("moves[{i}]: {value} is none of {MOVES}"))?;
            m.check().map_err(|why| format!("moves[{i}]: {why}"))?;
            moves.moves.push(m);
        }
        Ok(moves)
    }

    /// A built-in set; `None` for a name that is none of [`BUILT_IN`].
    #[must_use]
    pub fn built_in(name: &str, reach: &Reach) -> Option<Moves> {
        let mut moves = vec![Move::Dwell { dwell_s: 0.5 }];
        match name {
            "test" => {
                reversals(reach, &mut moves);
                strokes(reach, &mut moves);
                sweep(reach, &mut moves);
            }
            "reversals" => reversals(reach, &mut moves),
            "strokes" => strokes(reach, &mut moves),
            "sweep" => sweep(reach, &mut moves),
            _ => return None,
        }
        Some(Moves { schema: SCHEMA.into(), axis: None, start_mm: reach.start, moves })
    }

    /// How long all of it takes, s.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        let mut at = self.start_mm;
        let seconds = self.moves.iter().map(|m| match *m {
            Move::To { to_mm, speed_mm_s, acceleration_mm_s2, jerk_mm_s3 } => {
                let travel = to_mm - std::mem::replace(&mut at, to_mm);
                let rounding = jerk_mm_s3.map_or(0.0, |jerk| acceleration_mm_s2 / jerk);
                Trapezoid::new(travel, speed_mm_s, acceleration_mm_s2).duration() + rounding
            }
            Move::Dwell { dwell_s } => dwell_s,
            Move::Sweep { duration_s, .. } => duration_s,
        });
        seconds.sum()
    }

    /// The commanded position of every servo cycle.
    #[must_use]
    pub fn command(&self, period_s: f64) -> Vec<f64> {
        let mut out = vec![self.start_mm];
        for m in &self.moves {
            let from = out.last().copied().unwrap_or(self.start_mm);
            m.append(from, period_s, &mut out);
        }
        out
    }
}

/// There and back between places inside the stroke, slow to fast, with a dwell after each pair.
fn reversals(reach: &Reach, moves: &mut Vec<Move>) {
    let middle = reach.start + 0.5 * reach.stroke;
    moves.push(go(middle, 0.5 * reach.speed, reach));
    for share in [0.002, 0.005, 0.01, 0.03, 0.1, 0.3, 1.0] {
        let speed = share * reach.speed;
        let travel = speed.min(0.45 * reach.stroke);
        for _ in 0..2 {
            moves.push(go(middle + travel, speed, reach));
            moves.push(go(middle - travel, speed, reach));
        }
        moves.push(go(middle, speed, reach));
        moves.push(Move::Dwell { dwell_s: 0.3 });
    }
}

/// The whole stroke at four speeds.
fn strokes(reach: &Reach, moves: &mut Vec<Move>) {
    for share in [0.1, 0.25, 0.5, 1.0] {
        for end in [reach.stroke, 0.0] {
            moves.push(go(reach.start + end, share * reach.speed, reach));
            moves.push(Move::Dwell { dwell_s: 0.2 });
        }
    }
}

/// From the middle of the stroke, 1 to 30 Hz.
fn sweep(reach: &Reach, moves: &mut Vec<Move>) {
    moves.push(go(reach.start + 0.5 * reach.stroke, 0.5 * reach.speed, reach));
    let by_speed = 0.5 * reach.speed / TAU;
    let by_acceleration = 0.5 * reach.acceleration / (TAU * TAU);
    let sweep_mm = by_speed.min(by_acceleration).min(0.4 * reach.stroke);
    moves.push(Move::Sweep { sweep_mm, from_hz: 1.0, to_hz: 30.0, duration_s: 8.0 });
    moves.push(Move::Dwell { dwell_s: 0.3 });
}

fn go(to_mm: f64, speed_mm_s: f64, reach: &Reach) -> Move {
    let jerk = 20.0 * reach.acceleration;
    Move::To { to_mm, speed_mm_s, acceleration_mm_s2: reach.acceleration, jerk_mm_s3: Some(jerk) }
}

impl Move {
    fn check(&self) -> Result<(), String> {
        let positive = |name: &str, value: f64, most: f64| {
            let fine = value > 0.0 && value <= most;
            if fine {
                Ok(())
            } else {
                Err(format!("{name} {value} is out of range; give a number above 0, at most {most}"))
            }
        };
        match *self {
            Move::To { to_mm, speed_mm_s, acceleration_mm_s2, jerk_mm_s3 } => {
                if !(to_mm.abs() <= 1e6) {
                    return Err(format!("to_mm {to_mm} is out of range; give a number from -1000000 to 1000000"));
                }
                positive("speed_mm_s", speed_mm_s, 1e6)?;
                positive("acceleration_mm_s2", acceleration_mm_s2, 1e9)?;
                positive("jerk_mm_s3", jerk_mm_s3.unwrap_or(1.0), 1e12)
            }
            Move::Dwell { dwell_s } => positive("dwell_s", dwell_s, 1e5),
            Move::Sweep { sweep_mm, from_hz, to_hz, duration_s } => {
                positive("sweep_mm", sweep_mm, 1e6)?;
                positive("from_hz", from_hz, 1e4)?;
                positive("to_hz", to_hz, 1e4)?;
                positive("duration_s", duration_s, 1e5)
            }
        }
    }

    /// Adds the cycles of this move, which starts at `from`.
    fn append(&self, from: f64, period_s: f64, out: &mut Vec<f64>) {
        let cycles = |time: f64| (time / period_s).ceil() as usize;
        match *self {
            Move::Dwell { dwell_s } => out.extend(std::iter::repeat_n(from, cycles(dwell_s))),
            Move::To { to_mm, speed_mm_s, acceleration_mm_s2, jerk_mm_s3 } => {
                let trapezoid = Trapezoid::new(to_mm - from, speed_mm_s, acceleration_mm_s2);
                let window = jerk_mm_s3.map_or(1, |jerk| cycles(acceleration_mm_s2 / jerk).max(1));
                let raw = |cycle: i64| trapezoid.at(cycle as f64 * period_s);
                let mut sum = 0.0;
                for cycle in 1..=(cycles(trapezoid.duration()) + window - 1) as i64 {
                    sum += raw(cycle) - raw(cycle - window as i64);
                    out.push(from + sum / window as f64);
                }
                out.push(to_mm);
            }
            Move::Sweep { sweep_mm, from_hz, to_hz, duration_s } => {
                let n = cycles(duration_s);
                let octaves = (to_hz / from_hz).ln();
                for cycle in 1..=n {
                    let t = cycle as f64 * period_s;
                    let growth = (octaves * t / duration_s).exp();
                    // ∫ f dt of an exponential sweep; its limit for one frequency.
                    let turns = if octaves.abs() > 1e-9 {
                        from_hz * duration_s * (growth - 1.0) / octaves
                    } else {
                        from_hz * t
                    };
                    // Grows and fades over a tenth of the time, so that nothing jumps.
                    let edge = (10.0 * t / duration_s).min(10.0 * (1.0 - t / duration_s)).clamp(0.0, 1.0);
                    let window = 0.5 - 0.5 * (PI * edge).cos();
                    out.push(from + sweep_mm * window / (growth * growth) * (TAU * turns).sin());
                }
            }
        }
    }
}

/// Rest to rest at an acceleration, a top speed if there is room for it, and a deceleration.
struct Trapezoid {
    travel: f64,
    acceleration: f64,
    ramp_s: f64,
    cruise_s: f64,
}

impl Trapezoid {
    fn new(travel: f64, speed: f64, acceleration: f64) -> Trapezoid {
        let top = speed.min((travel.abs() * acceleration).sqrt());
        let ramp_s = top / acceleration;
        let cruise_s = if top > 0.0 { travel.abs() / top - ramp_s } else { 0.0 };
        Trapezoid { travel, acceleration, ramp_s, cruise_s: cruise_s.max(0.0) }
    }

    fn duration(&self) -> f64 {
        2.0 * self.ramp_s + self.cruise_s
    }

    /// Travel after `t` seconds.
    fn at(&self, t: f64) -> f64 {
        let left = self.duration() - t;
        if t <= 0.0 {
            return 0.0;
        }
        if left <= 0.0 {
            return self.travel;
        }
        let way = if t < self.ramp_s {
            0.5 * self.acceleration * t * t
        } else if left < self.ramp_s {
            self.travel.abs() - 0.5 * self.acceleration * left * left
        } else {
            self.acceleration * self.ramp_s * (t - 0.5 * self.ramp_s)
        };
        way.copysign(self.travel)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const REACH: Reach = Reach { start: 20.0, stroke: 300.0, speed: 200.0, acceleration: 2000.0 };

    /// Largest n-th difference quotient.
    fn most(command: &[f64], order: u32, period: f64) -> f64 {
        let mut values = command.to_vec();
        for _ in 0..order {
            values = values.windows(2).map(|w| (w[1] - w[0]) / period).collect();
        }
        values.iter().fold(0.0, |most, v| most.max(v.abs()))
    }

    #[test]
    fn a_move_keeps_its_limits_reaches_its_goal_and_uses_what_it_may() {
        let m = Move::To { to_mm: 80.0, speed_mm_s: 150.0, acceleration_mm_s2: 1000.0, jerk_mm_s3: Some(2e4) };
        let moves = Moves { schema: SCHEMA.into(), axis: None, start_mm: -20.0, moves: vec![m] };
        let command = moves.command(1e-3);
        assert_eq!((command[0], command[command.len() - 1]), (-20.0, 80.0));
        for (order, limit) in [(1, 150.0), (2, 1000.0), (3, 2e4)] {
            let reached = most(&command, order, 1e-3);
            assert!(reached <= limit * 1.001 && reached > 0.95 * limit, "derivative {order}: {reached} of {limit}");
        }
        // Duration: travel/speed + speed/acceleration + acceleration/jerk.
        let seconds = (command.len() - 1) as f64 * 1e-3;
        assert!((seconds - (100.0 / 150.0 + 0.15 + 0.05)).abs() < 3e-3, "{seconds}");
    }

    #[test]
    fn built_in_sets_stay_in_reach_and_use_it() {
        for name in BUILT_IN {
            let command = Moves::built_in(name, &REACH).unwrap().command(1e-3);
            let (low, high) = command.iter().fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(*x), h.max(*x)));
            assert!(low >= 20.0 - 1e-9 && high <= 320.0 + 1e-9, "{name}: {low} to {high}");
            assert!(most(&command, 1, 1e-3) <= 200.0 * 1.01, "{name}");
            assert!(most(&command, 2, 1e-3) <= 2000.0 * 1.1, "{name}: {}", most(&command, 2, 1e-3));
        }
        let moves = Moves::built_in("test", &REACH).unwrap();
        let command = moves.command(1e-3);
        let seconds = (command.len() - 1) as f64 * 1e-3;
        // A move takes a whole number of cycles, and one more to settle.
        assert!((seconds - moves.duration_s()).abs() < 3e-3 * moves.moves.len() as f64, "{seconds}");
        assert!(most(&command, 1, 1e-3) > 199.0 && most(&command, 2, 1e-3) > 1900.0);
        assert!(Moves::built_in("nothing", &REACH).is_none());
    }

    #[test]
    fn lists_are_read_as_written_and_refused_with_the_move_s_number() {
        let moves = Moves::built_in("test", &REACH).unwrap();
        assert_eq!(Moves::parse(&serde_json::to_string(&moves).unwrap()).unwrap(), moves);
        let refused = |text: &str| Moves::parse(text).unwrap_err();
        assert!(
            refused(r#"{"schema":"gib.moves/1","moves":[{"dwell_s":1},{"dwell_s":-1}]}"#)
                .contains("moves[1]: dwell_s -1")
        );
        assert!(refused(r#"{"schema":"gib.moves/1","moves":[{"jump_mm":1}]}"#).contains("sweep_mm"));
        assert!(refused(r#"{"schema":"gib.moves/2","moves":[]}"#).contains("gib.moves/1"));
        for text in [
            "[]",
            "3",
            "{",
            "{}",
            r#"{"schema":"gib.moves/1","moves":3}"#,
            r#"{"schema":"gib.moves/1","moves":[],"strat_mm":1}"#,
        ] {
            let why = refused(text);
            assert!(why.contains("\"gib.moves/1\"") && why.contains("docs/diagnosis.md"), "{why}");
        }
        assert!(refused(r#"{"schema":"gib.moves/1","start_mm":1e300,"moves":[]}"#).contains("start_mm"));
    }
}
