//! `gib program get|set|remove`: INA in the head of a part program.

use std::fmt::Write;
use std::path::PathBuf;

use clap::{Args, Subcommand, ValueEnum};
use gib::program::{self, Dialect, Entry, Scope};
use serde_json::json;

use super::{Answer, Result};

/// Reads, writes or removes INA, the load inertia in kg·m², in the head of a part program
#[derive(Args)]
pub struct Program {
    #[command(subcommand)]
    action: Action,
}

#[derive(Subcommand)]
enum Action {
    Get(Get),
    Set(Set),
    Remove(Remove),
}

/// Shows the INA values in the head; exit code 1 when there is none, so that it must be measured
#[derive(Args)]
struct Get {
    /// The part program
    file: PathBuf,
    /// Only this process step's value; 0 for the whole program's
    #[arg(long, value_name = "N", value_parser = scope)]
    step: Option<Scope>,
    /// Answer as JSON
    #[arg(long)]
    json: bool,
}

/// Writes an INA value into the head; nothing else in the file changes
#[derive(Args)]
struct Set {
    /// The part program
    file: PathBuf,
    /// The inertia, kg·m², with a decimal point
    inertia_kg_m2: f64,
    /// For this process step only, 1 to 9999 (INA2 is for step 2); 0 for the whole program
    #[arg(long, value_name = "N", default_value = "0", value_parser = scope)]
    step: Scope,
    /// How a new value is spelled; recognised from the program if not given. A value that is there keeps its spelling
    #[arg(long)]
    dialect: Option<Spelling>,
}

/// Removes an INA value from the head, if it is there
#[derive(Args)]
struct Remove {
    /// The part program
    file: PathBuf,
    /// Of this process step; 0 for the whole program
    #[arg(long, value_name = "N", default_value = "0", value_parser = scope)]
    step: Scope,
}

#[derive(Clone, Copy, ValueEnum)]
enum Spelling {
    /// #<_ina>=0.5
    Linuxcnc,
    /// INA=0.5
    Okuma,
    /// (INA=0.5), a comment on every control
    Iso,
}

impl From<Spelling> for Dialect {
    fn from(spelling: Spelling) -> Dialect {
        match spelling {
            Spelling::Linuxcnc => Dialect::LinuxCnc,
            Spelling::Okuma => Dialect::Okuma,
            Spelling::Iso => Dialect::Iso,
        }
    }
}

pub(super) fn scope(text: &str) -> std::result::Result<Scope, String> {
    let number = text.parse().ok().and_then(Scope::from_number);
    number.ok_or_else(|| format!("a step is 1 to {}, or 0 for the whole program", Scope::LAST_STEP))
}

impl Program {
    /// Does what was asked.
    pub fn run(&self) -> Result {
        match &self.action {
            Action::Get(get) => get.run(),
            Action::Set(set) => set.run(),
            Action::Remove(remove) => remove.run(),
        }
    }
}

impl Get {
    fn run(&self) -> Result {
        let mut entries = program::list(&self.file)?;
        entries.retain(|entry| self.step.is_none_or(|step| step == entry.scope));
        let text = if self.json { json(&entries)? } else { self.text(&entries) };
        Ok(Answer { text, good: !entries.is_empty() })
    }

    fn text(&self, entries: &[Entry]) -> String {
        let mut text = String::new();
        for Entry { scope, inertia_kg_m2, line, dialect } in entries {
            let _ = writeln!(text, "{scope} = {inertia_kg_m2} kg·m²  (line {line}, {dialect})");
        }
        if entries.is_empty() {
            let name = self.step.unwrap_or(Scope::Program);
            let _ = writeln!(text, "no {name} in the head of {}: it must be measured", self.file.display());
        }
        text
    }
}

fn json(entries: &[Entry]) -> serde_json::Result<String> {
    let values = entries.iter().map(|entry| {
        let (step, dialect) = (entry.scope.number(), entry.dialect.to_string());
        json!({ "step": step, "inertia_kg_m2": entry.inertia_kg_m2, "line": entry.line, "dialect": dialect })
    });
    Ok(serde_json::to_string_pretty(&values.collect::<Vec<_>>())? + "\n")
}

impl Set {
    fn run(&self) -> Result {
        let (file, scope, inertia_kg_m2) = (self.file.display(), self.step, self.inertia_kg_m2);
        let changed = program::set(&self.file, scope, inertia_kg_m2, self.dialect.map(Dialect::from))?;
        let what = if changed { "written" } else { "was there already, nothing changed" };
        Ok(Answer::good(format!("{file}: {scope} = {inertia_kg_m2} kg·m² {what}\n")))
    }
}

impl Remove {
    fn run(&self) -> Result {
        let (file, scope) = (self.file.display(), self.step);
        let removed = program::remove(&self.file, scope)?;
        let what = if removed { "removed" } else { "is not in the head, nothing changed" };
        Ok(Answer::good(format!("{file}: {scope} {what}\n")))
    }
}
