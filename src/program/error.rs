//! What can go wrong with INA in a part program, in sentences for the person at the machine.

use super::{INERTIA_RANGE_KG_M2, Scope};
use crate::error::{
    Fault, GIB_ERR_CONFIG, GIB_ERR_FORMAT, GIB_ERR_IO, GIB_ERR_PROGRAM_BUSY, GIB_ERR_PROGRAM_CHANGED,
    GIB_ERR_PROGRAM_DUPLICATE, GIB_ERR_PROGRAM_LINK, GIB_ERR_PROGRAM_NOT_A_FILE, GIB_ERR_PROGRAM_OWNER,
    GIB_ERR_PROGRAM_VALUE,
};
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

/// A problem and the program it was met in.
#[derive(Debug)]
pub struct Error {
    /// The program as the caller named it.
    pub path: PathBuf,
    /// What went wrong.
    pub problem: Problem,
}

/// What went wrong. A line is counted from 1; its text is shortened and printable.
#[derive(Debug)]
pub enum Problem {
    /// The operating system refused; `doing` says what was tried.
    Io {
        /// What was tried, as "open the program".
        doing: &'static str,
        /// The system's answer.
        source: io::Error,
    },
    /// The path names a directory, a device or a pipe.
    NotAFile,
    /// The path is a symbolic link, and replacing it would leave its target behind.
    Link {
        /// Where the link points.
        target: PathBuf,
    },
    /// The file is not a text of bytes: NUL bytes or UTF-16.
    NotText {
        /// What was found.
        found: &'static str,
    },
    /// An INA statement that gib cannot take for a value.
    Statement {
        /// Its line.
        line: u64,
        /// The line.
        text: String,
        /// What is wrong with it.
        reason: &'static str,
    },
    /// One INA value stands twice in the head.
    Duplicate {
        /// Which value.
        scope: Scope,
        /// Line and text of the first.
        first: (u64, String),
        /// Line and text of the second.
        second: (u64, String),
    },
    /// The inertia to be written is not a finite positive number within range; kg·m².
    Inertia(f64),
    /// OSP allows four characters in a variable's name, so its steps end at 9.
    OkumaStep(Scope),
    /// Somebody else is writing the program and did not finish in time.
    Busy {
        /// How long was waited, s.
        waited_s: u64,
        /// The file that the other one holds.
        side: PathBuf,
    },
    /// The program changed under gib each time it was about to be replaced.
    Changed,
    /// The new file could not be given the program's owner.
    Owner {
        /// User and group of the program.
        uid: u32,
        /// See `uid`.
        gid: u32,
        /// The system's answer.
        source: io::Error,
    },
}

impl Error {
    pub(super) fn new(path: &Path, problem: Problem) -> Error {
        Error { path: path.to_owned(), problem }
    }

    /// The status number with the value and bounds behind it, for callers that cannot read sentences.
    ///
    /// Field `line` has the line as value; for a value that stands twice `low` and `high` are the two lines.
    #[must_use]
    pub fn fault(&self) -> Fault {
        let of = |code, field, value, low, high| Fault { code, field, value, low, high };
        let line = |number: &u64| *number as f64;
        match &self.problem {
            Problem::Io { .. } => Fault::of(GIB_ERR_IO),
            Problem::NotAFile => Fault::of(GIB_ERR_PROGRAM_NOT_A_FILE),
            Problem::Link { .. } => Fault::of(GIB_ERR_PROGRAM_LINK),
            Problem::NotText { .. } => Fault::of(GIB_ERR_FORMAT),
            Problem::Statement { line: at, .. } => of(GIB_ERR_PROGRAM_VALUE, "line\0", line(at), line(at), line(at)),
            Problem::Duplicate { first, second, .. } => {
                of(GIB_ERR_PROGRAM_DUPLICATE, "line\0", line(&first.0), line(&first.0), line(&second.0))
            }
            Problem::Inertia(value) => {
                let (low, high) = INERTIA_RANGE_KG_M2;
                of(GIB_ERR_CONFIG, "inertia_kg_m2\0", *value, low, high)
            }
            Problem::OkumaStep(scope) => of(GIB_ERR_CONFIG, "step\0", f64::from(scope.number()), 0.0, 9.0),
            Problem::Busy { .. } => Fault::of(GIB_ERR_PROGRAM_BUSY),
            Problem::Changed => Fault::of(GIB_ERR_PROGRAM_CHANGED),
            Problem::Owner { .. } => Fault::of(GIB_ERR_PROGRAM_OWNER),
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.path.display(), self.problem)
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Problem::Io { doing, source } => write!(f, "could not {doing}: {source}"),
            Problem::NotAFile => f.write_str("not a file; give the path of one part program"),
            Problem::Link { target } => write!(
                f,
                "a symbolic link to {}; gib replaces no file through a link, give that path itself",
                target.display()
            ),
            Problem::NotText { found } => {
                write!(f, "holds {found}, so it is no part program in plain bytes; nothing was changed")
            }
            Problem::Statement { line, text, reason } => write!(
                f,
                "line {line}: `{text}`: {reason}; correct or delete this line. \
                 INA is the inertia in kg·m², a positive number with a decimal point, as INA=0.5"
            ),
            Problem::Duplicate { scope, first, second } => write!(
                f,
                "line {}: `{}` and line {}: `{}`: {scope} stands twice in the head; delete one of them",
                first.0, first.1, second.0, second.1
            ),
            Problem::Inertia(value) => {
                let (low, high) = INERTIA_RANGE_KG_M2;
                write!(f, "an inertia of {value} kg·m² cannot be written; {low:e} to {high:e} kg·m² is allowed")
            }
            Problem::OkumaStep(scope) => write!(
                f,
                "{scope} is no OSP variable, whose names have four characters at most; \
                 use steps 1 to 9, or the comment form (dialect iso)"
            ),
            Problem::Busy { waited_s, side } => write!(
                f,
                "another program has been writing it for {waited_s} s and holds {}; try again when it has ended",
                side.display()
            ),
            Problem::Changed => f.write_str("is changed by another program all the time; nothing was written"),
            Problem::Owner { uid, gid, source } => write!(
                f,
                "belongs to user {uid}, group {gid}, and a new file could not be given to them ({source}); \
                 nothing was changed. Run as that user"
            ),
        }
    }
}

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match &self.problem {
            Problem::Io { source, .. } | Problem::Owner { source, .. } => Some(source),
            _ => None,
        }
    }
}

/// A line for a message: printable, whatever its encoding, and short.
pub(super) fn quoted(line: &[u8]) -> String {
    const SHOWN: usize = 80;
    let shown = line.get(..SHOWN).unwrap_or(line);
    let more = if shown.len() < line.len() { "…" } else { "" };
    let text: String = String::from_utf8_lossy(shown).chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    format!("{}{more}", text.trim())
}
