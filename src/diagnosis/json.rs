//! A diagnosis as `diagnosis.json` (schema gib.diagnosis/1).

use super::show::View;
use super::verdict::{Diagnosis, Verdict};
use serde_json::{Map, Value, json};

impl Verdict {
    /// The verdict's word in the file.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Verdict::NoDiscrepancy => "no_discrepancy",
            Verdict::Explained => "explained",
            Verdict::PartlyExplained => "partly_explained",
            Verdict::UnknownCause => "unknown_cause",
            Verdict::InsufficientData => "insufficient_data",
        }
    }
}

impl Diagnosis {
    /// The diagnosis as the file's JSON.
    #[must_use]
    pub fn to_json(&self) -> Value {
        let linear = self.extended.drive.is_linear();
        let findings: Vec<Value> = self
            .findings
            .iter()
            .map(|f| {
                let parameter =
                    |(key, value, std): (&str, _, _)| (key.to_owned(), json!({ "value": value, "std": std }));
                let parameters: Map<String, Value> = f.parameters(linear).map(parameter).collect();
                let ties: Vec<&str> = f.indistinguishable_from.iter().map(|c| c.name()).collect();
                json!({ "cause": f.effect.cause().name(), "confidence": f.confidence, "share": f.share,
                    "parameters": parameters, "evidence": f.evidence, "indistinguishable_from": ties,
                    "next_experiment": f.next_experiment.as_ref().map(|(moves, _)| moves),
                    "next_experiment_reason": f.next_experiment.as_ref().map(|(_, why)| why) })
            })
            .collect();
        let gain: Map<String, Value> = self
            .gains
            .iter()
            .map(|g| {
                let ratio = g.before / g.after.max(1e-300);
                let value = json!({ "rms_before": g.before, "rms_after": g.after, "ratio": ratio, "ci95": g.ci95 });
                (g.channel.to_owned(), value)
            })
            .collect();
        let shares = |pick: fn(&View) -> f64| -> Map<String, Value> {
            self.shown.iter().map(|view| (view.coordinate.name().replace(' ', "_"), json!(pick(view)))).collect()
        };
        let u = &self.unexplained;
        let word = self.extended.drive.torque_word();
        let mut unexplained = Map::new();
        unexplained.insert(format!("{word}_rms"), json!(u.torque.rms));
        unexplained.insert(format!("{word}_noise_rms"), json!(u.torque.noise_rms));
        unexplained.insert("describes".into(), json!(u.torque.describes));
        if let Some(table) = &u.table {
            let value = json!({ "rms": table.rms, "noise_rms": table.noise_rms, "describes": table.describes });
            unexplained.insert("table_minus_motor".into(), value);
        }
        unexplained.insert("lives_in".into(), Value::Object(shares(|view| view.after)));
        unexplained.insert("before_naming".into(), Value::Object(shares(|view| view.before)));
        if !self.missing.is_empty() {
            unexplained.insert("missing".into(), json!(self.missing));
        }
        if !self.notes.is_empty() {
            unexplained.insert("notes".into(), json!(self.notes));
        }
        json!({ "schema": "gib.diagnosis/1", "verdict": self.verdict.name(), "axis": self.extended.name,
            "findings": findings, "gain": gain, "unexplained": unexplained })
    }
}
