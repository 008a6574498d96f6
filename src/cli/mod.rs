//! The command line: what is asked, which file answers it, and with which exit code it ends.
//!
//! A command is a struct of arguments with `run(&self) -> cli::Result`. It returns its whole text; errors go to standard
//! error as one sentence.

mod diagnose;
mod homing;
mod inertia;
mod inspect;
mod lost_motion;
mod machine_file;
mod meter;
mod outputs;
mod predict;
mod program;
mod record;
mod simulate;
mod speed_variation;
mod table;
mod tilt;

use std::error::Error;
use std::io::{ErrorKind, Write};
use std::process::ExitCode;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use gib::recording::{IssueKind, Recording, Signal};

/// What a command has to say.
pub struct Answer {
    /// Goes to standard output.
    pub text: String,
    /// False when the question was understood and the answer is no: a value refused, a verdict that asks for action.
    pub good: bool,
}

impl Answer {
    /// A plain answer.
    pub fn good(text: String) -> Self {
        Self { text, good: true }
    }
}

/// What a command returns; an error ends with exit code 2.
pub type Result = std::result::Result<Answer, Box<dyn Error>>;

const EXIT_CODES: &str = "\
Exit codes:
  0  done
  1  the answer is no: a value was refused, or the verdict asks for action (the text says which)
  2  wrong usage, or a file that cannot be used (the message says where and why)";

/// The layer between an NC kernel and the metal.
///
/// Measures lost motion, shows what a simulation gets wrong, and looks into recordings of a machine. Recordings are CSV with
/// the columns time_s, then <channel>.<signal>_<unit>, for example x.position_mm.
#[derive(Parser)]
#[command(name = "gib", version, after_help = EXIT_CODES, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Diagnose(diagnose::Diagnose),
    Homing(homing::HomingCommand),
    Inertia(inertia::InertiaCommand),
    Inspect(inspect::Inspect),
    Predict(predict::Predict),
    Program(program::Program),
    Record(record::Record),
    LostMotion(lost_motion::LostMotionCommand),
    Simulate(simulate::Simulate),
    SpeedVariation(speed_variation::SpeedVariationCommand),
    Tilt(tilt::TiltCommand),
}

/// A number as a machinist may write it, `-0.5` too; whether it is allowed is said by who uses it, in its unit.
fn decimal(text: &str) -> std::result::Result<f64, String> {
    text.parse().map_err(|_| "a number with a decimal point, as 0.5, is wanted".to_owned())
}

/// The same for every number of a command and of those below it.
fn with_decimals(command: clap::Command) -> clap::Command {
    let numbers = |arg: clap::Arg| {
        let number = arg.get_value_parser().type_id() == std::any::TypeId::of::<f64>();
        if number { arg.value_parser(decimal).allow_negative_numbers(true) } else { arg }
    };
    command.mut_args(numbers).mut_subcommands(with_decimals)
}

/// Runs the command that was asked for.
pub fn run() -> ExitCode {
    let asked = with_decimals(Cli::command()).get_matches();
    let command = match Cli::from_arg_matches(&asked) {
        Ok(cli) => cli.command,
        Err(why) => why.exit(),
    };
    let result = match command {
        Command::Diagnose(command) => command.run(),
        Command::Homing(command) => command.run(),
        Command::Inertia(command) => command.run(),
        Command::Inspect(command) => command.run(),
        Command::Predict(command) => command.run(),
        Command::Program(command) => command.run(),
        Command::Record(command) => command.run(),
        Command::LostMotion(command) => command.run(),
        Command::Simulate(command) => command.run(),
        Command::SpeedVariation(command) => command.run(),
        Command::Tilt(command) => command.run(),
    };
    match result {
        Ok(answer) => {
            let mut out = std::io::stdout();
            match out.write_all(answer.text.as_bytes()).and_then(|()| out.flush()) {
                // A reader that has seen enough (`gib … | head`) is no error.
                Err(why) if why.kind() != ErrorKind::BrokenPipe => {
                    eprintln!("gib: standard output: {why}; the answer is not whole");
                    ExitCode::from(2)
                }
                _ => ExitCode::from(u8::from(!answer.good)),
            }
        }
        Err(why) => {
            eprintln!("gib: {why}");
            ExitCode::from(2)
        }
    }
}

/// The axis to look at: the one given, else the only one that has a position.
fn axis(recording: &Recording, given: Option<&str>) -> std::result::Result<String, String> {
    let axes: Vec<&str> =
        recording.channels().into_iter().filter(|c| recording.get(c, Signal::Position).is_some()).collect();
    match (given, axes.as_slice()) {
        (Some(axis), _) => Ok(axis.to_owned()),
        (None, [one]) => Ok((*one).to_owned()),
        (None, []) => Err(format!("{}: has no column <axis>.position_<unit>{}", recording.file, instead(recording))),
        (None, several) => {
            Err(format!("{}: has the axes {}; choose one with --axis", recording.file, several.join(", ")))
        }
    }
}

/// What a recording has in place of the column that is missing.
fn instead(recording: &Recording) -> String {
    let names: Vec<&str> = recording.columns.iter().map(|column| column.name.as_str()).collect();
    let issues = recording.issues.iter().filter(|issue| issue.kind == IssueKind::WrongUnit);
    let found = if names.is_empty() { "no columns but the time".to_owned() } else { names.join(", ") };
    issues.fold(format!("; it has {found}"), |text, issue| format!("{text}\n  {issue}"))
}
