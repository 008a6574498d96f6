//! Runs the `gib` command on a case as a user would, and scores what it says against the truth.

use super::case::{Case, Files, Kind};
use super::effects::Effect;
use super::rig::Rig;
use serde_json::Value;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

/// Error and claimed uncertainty of one parameter of a rightly named cause.
#[derive(Clone, Debug, PartialEq)]
pub struct ParameterScore {
    pub cause: String,
    pub key: String,
    /// |value − true| / scale; `None`: the key is missing.
    pub error: Option<f64>,
    /// |value − true| / std.
    pub deviations: f64,
    /// Whether value ± 1.96 std holds the truth.
    pub covered: bool,
}

/// What a diagnosis said about one case.
#[derive(Clone, Debug, Default)]
pub struct Score {
    pub truth: Vec<String>,
    pub verdict: String,
    /// Causes in the order they are named.
    pub named: Vec<String>,
    pub first_right: bool,
    /// Each hidden cause: named anywhere.
    pub found: usize,
    /// Named causes that were not hidden.
    pub wrong: usize,
    /// The first name is wrong, but says that it cannot be told from the hidden one.
    pub tied: bool,
    pub parameters: Vec<ParameterScore>,
    /// Hold-out residual of the extended machine over that of the true one.
    pub against_truth: Option<f64>,
    /// Hold-out residual of the true machine over the noise floor: checks the prediction, not the diagnosis.
    pub truth_over_floor: Option<f64>,
    /// Hold-out residual of the belief over that of the true machine: what there was to gain.
    pub to_gain: Option<f64>,
    /// Verdict and names when the extended machine is believed: on the same recording, and on the hold-out.
    pub again: Vec<(String, Vec<String>)>,
    pub seconds: f64,
    pub failure: Option<String>,
}

/// Names that a hidden effect may rightly go by.
fn accepted(effect: &Effect, name: &str, rig: &Rig) -> bool {
    effect.cause == name
        // A cable whose force is zero elsewhere than at position zero is a slope and a constant.
        || (effect.cause == "cable_force" && name == "constant_torque" && effect.parameters(rig).iter().any(|p| p.key == "zero_mm" && p.value != 0.0))
}

fn text(v: &Value, key: &str) -> String {
    v.get(key).and_then(Value::as_str).unwrap_or_default().to_string()
}

fn findings(diagnosis: &Value) -> &[Value] {
    diagnosis.get("findings").and_then(Value::as_array).map_or(&[], Vec::as_slice)
}

fn numbers(v: &Value, key: &str) -> Option<(f64, f64)> {
    let p = v.get("parameters")?.get(key)?;
    Some((p.get("value")?.as_f64()?, p.get("std")?.as_f64()?))
}

/// Scores a diagnosis (the JSON of the contract) against the truth.
pub fn judge(case: &Case, diagnosis: &Value) -> Score {
    let findings = findings(diagnosis);
    let named: Vec<String> = findings.iter().map(|f| text(f, "cause")).collect();
    let is_hidden = |name: &String| case.effects.iter().any(|e| accepted(e, name, &case.rig));
    let first_right = named.first().is_some_and(|n| case.effects.iter().any(|e| e.cause == n));
    let tied = !first_right
        && findings.first().and_then(|f| f.get("indistinguishable_from")).and_then(Value::as_array).is_some_and(
            |list| list.iter().filter_map(Value::as_str).any(|n| case.effects.iter().any(|e| e.cause == n)),
        );
    let mut score = Score {
        truth: match case.kind {
            Kind::Outside(name) => vec![format!("outside: {name}")],
            _ => case.effects.iter().map(|e| e.cause.to_string()).collect(),
        },
        verdict: text(diagnosis, "verdict"),
        first_right,
        found: case.effects.iter().filter(|e| named.iter().any(|n| n == e.cause)).count(),
        wrong: named.iter().filter(|n| !is_hidden(n)).count(),
        tied,
        named,
        ..Score::default()
    };
    for effect in &case.effects {
        if let Some(f) = findings.iter().find(|f| text(f, "cause") == effect.cause) {
            for p in effect.parameters(&case.rig).into_iter().filter(|p| p.scored) {
                let said = numbers(f, &p.key);
                score.parameters.push(ParameterScore {
                    cause: effect.cause.to_string(),
                    error: said.map(|(value, _)| (value - p.value).abs() / p.scale),
                    deviations: said.map_or(f64::INFINITY, |(value, std)| (value - p.value).abs() / std),
                    covered: said.is_some_and(|(value, std)| (value - p.value).abs() <= 1.96 * std),
                    key: p.key,
                });
            }
        }
    }
    score
}

/// Root mean square of the column whose name holds `.residual_`, over the rows in which the axis moves: at rest friction
/// takes any value, so that no motion can tell the torque.
fn residual(path: &Path, moves: &[bool]) -> Option<f64> {
    let mut reader = csv::Reader::from_path(path).ok()?;
    let column = reader.headers().ok()?.iter().position(|h| h.contains(".residual_"))?;
    let (mut sum, mut count) = (0.0, 0);
    for (row, _) in reader.records().zip(moves).filter(|(_, moves)| **moves) {
        let v: f64 = row.ok()?.get(column)?.parse().ok()?;
        sum += v * v;
        count += 1;
    }
    (count > 0).then(|| (sum / f64::from(count)).sqrt())
}

fn predict(gib: &Path, machine: &Path, recording: &Path, out: &Path, moves: &[bool]) -> Option<f64> {
    let run = Command::new(gib)
        .arg("predict")
        .arg("--machine")
        .arg(machine)
        .arg("--recording")
        .arg(recording)
        .arg("--out")
        .arg(out)
        .output();
    run.ok().filter(|o| o.status.success())?;
    residual(out, moves)
}

impl Score {
    /// Everything that was hidden is named and nothing else.
    pub fn is_right(&self, case: &Case) -> bool {
        match case.kind {
            Kind::Nothing => self.verdict == "no_discrepancy" && self.named.is_empty(),
            Kind::Outside(_) => self.verdict == "unknown_cause" && self.named.is_empty(),
            _ => self.first_right && self.wrong == 0 && self.found == case.effects.len(),
        }
    }
}

/// Diagnoses a recording against a machine; what was said, or why nothing was.
fn said_of(gib: &Path, machine: &Path, recording: &Path, json: &Path, more: &[&Path]) -> Result<Value, String> {
    let mut command = Command::new(gib);
    command.arg("diagnose").arg("--machine").arg(machine).arg("--recording").arg(recording).arg("--json").arg(json);
    for (option, path) in ["--holdout", "--machine-out"].into_iter().zip(more) {
        command.arg(option).arg(path);
    }
    let run = command.output();
    let parsed = std::fs::read_to_string(json).ok().and_then(|t| serde_json::from_str::<Value>(&t).ok());
    parsed.ok_or_else(|| match run {
        Ok(o) => {
            format!("{}: {}", o.status, String::from_utf8_lossy(&o.stderr).lines().next().unwrap_or("no message"))
        }
        Err(e) => format!("{}: {e}", gib.display()),
    })
}

/// Diagnoses the extended machine on the recording it comes from and on the other of the same rig.
pub fn again(gib: &Path, files: &Files, folder: &Path) -> Vec<(String, Vec<String>)> {
    let extended = folder.join("extended.json");
    let one = |(recording, name): (&Path, &str)| match said_of(gib, &extended, recording, &folder.join(name), &[]) {
        Ok(diagnosis) => (text(&diagnosis, "verdict"), findings(&diagnosis).iter().map(|f| text(f, "cause")).collect()),
        Err(why) => (why, Vec::new()),
    };
    [(files.recording.as_path(), "again.json"), (files.holdout.as_path(), "again_holdout.json")].map(one).into()
}

/// Diagnoses a case with the `gib` command and scores it.
pub fn diagnose(gib: &Path, case: &Case, files: &Files, folder: &Path) -> Score {
    let (json, extended) = (folder.join("diagnosis.json"), folder.join("extended.json"));
    let begin = Instant::now();
    let said = said_of(gib, &files.machine, &files.recording, &json, &[&files.holdout, &extended]);
    let seconds = begin.elapsed().as_secs_f64();
    let diagnosis = match said {
        Ok(diagnosis) => diagnosis,
        Err(why) => return Score { failure: Some(why), seconds, ..judge(case, &Value::Null) },
    };
    let mut score = Score { seconds, ..judge(case, &diagnosis) };
    // Only what the files can say is compared with what is true: outside effects have no true machine file.
    if !matches!(case.kind, Kind::Outside(_)) {
        let moves = case.holdout.moves(2e-3 * case.rig.reach.speed);
        let residual_of =
            |machine: &Path, name: &str| predict(gib, machine, &files.holdout, &folder.join(name), &moves);
        let truth = residual_of(&files.truth_machine, "predicted_truth.csv");
        let believed = residual_of(&files.machine, "predicted_belief.csv");
        let after = if extended.exists() { residual_of(&extended, "predicted_extended.csv") } else { believed };
        let over = |a: Option<f64>, b: Option<f64>| Some(a? / b?);
        score.against_truth = over(after, truth);
        score.to_gain = over(believed, truth);
        score.truth_over_floor = truth.map(|t| t / case.rig.torque_floor());
    }
    score
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    /// Says the truth, with every parameter off by `off` and a standard error of `std`, both relative.
    fn said(case: &Case, off: f64, std: f64) -> Value {
        let finding = |e: &Effect| {
            let parameters: serde_json::Map<String, Value> = (e.parameters(&case.rig).into_iter())
                .map(|p| (p.key, json!({ "value": p.value + off * p.scale, "std": std * p.scale })))
                .collect();
            json!({ "cause": e.cause, "parameters": parameters, "indistinguishable_from": [] })
        };
        json!({ "verdict": "explained", "findings": case.effects.iter().map(finding).collect::<Vec<_>>() })
    }

    #[test]
    fn an_oracle_scores_full_marks_and_a_liar_none() {
        let case = Case::draw(3, 0, Kind::One("stribeck_friction"), 11.0, false);
        let right = judge(&case, &said(&case, 0.01, 0.006));
        assert!(right.first_right && right.found == 1 && right.wrong == 0 && !right.tied);
        assert_eq!(right.parameters.len(), 2);
        assert!(right.parameters.iter().all(|p| p.covered && (p.error.unwrap() - 0.01).abs() < 1e-9));
        // Too sure of itself.
        assert!(judge(&case, &said(&case, 0.01, 0.005)).parameters.iter().all(|p| !p.covered));

        let other = json!({ "verdict": "explained", "findings": [
            { "cause": "backlash", "parameters": {}, "indistinguishable_from": ["stribeck_friction"] },
            { "cause": "stribeck_friction", "parameters": {}, "indistinguishable_from": [] } ] });
        let wrong = judge(&case, &other);
        assert!(!wrong.first_right && wrong.tied && wrong.found == 1 && wrong.wrong == 1);
        assert!(wrong.parameters.iter().all(|p| p.error.is_none() && !p.covered), "missing keys are errors");
        let silent = judge(&case, &json!({ "verdict": "no_discrepancy", "findings": [] }));
        assert!(!silent.first_right && silent.found == 0 && silent.verdict == "no_discrepancy");
    }
}
