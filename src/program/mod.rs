//! INA in the head of a part program: the spindle's load inertia J in kg·m², read, written and removed.
//!
//! Source: CN103769945 (Okuma) keeps the measured inertia in the program's head, so that it is measured once:
//! a program that already holds it is not measured again. Without a number INA is for the whole program; `INA2`
//! is for process step 2, since cutting removes mass. Step numbers are the machinist's own (the `N2`, `NAT02` or
//! tool change that starts the step); gib never looks for them in the body.
//!
//! | dialect | whole program | process step 2 |
//! |---|---|---|
//! | LinuxCNC | `#<_ina>=0.5` | `#<_ina2>=0.4` |
//! | Okuma OSP | `INA=0.5` | `INA2=0.4` |
//! | Fanuc, ISO | `(INA=0.5)` | `(INA2=0.4)` |
//!
//! Every spelling is read in every program, also `; INA=0.5`. Nothing but the INA statement changes by one byte:
//! programs are bytes here, never text, because their encoding is whatever the control made of it.

mod dialect;
mod edit;
mod error;
mod head;
mod line;
mod replace;

pub use dialect::Dialect;
pub use error::{Error, Problem};
pub(crate) use replace::dressed;

use head::Head;
use std::fmt;
use std::path::Path;

/// Smallest and largest inertia that is written, kg·m²: a dental motor's rotor to a vertical lathe's table, with
/// room to spare on both sides. Reading takes any finite positive number.
pub const INERTIA_RANGE_KG_M2: (f64, f64) = (1e-9, 1e9);

/// What one INA value is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Scope {
    /// The whole program: `INA`.
    Program,
    /// One process step, 1 to [`Scope::LAST_STEP`]: `INA2` is for step 2.
    Step(u16),
}

impl Scope {
    /// The largest step number.
    pub const LAST_STEP: u16 = 9999;

    /// From a number where 0 means the whole program; `None` beyond [`Scope::LAST_STEP`].
    #[must_use]
    pub fn from_number(number: u32) -> Option<Scope> {
        match u16::try_from(number) {
            Ok(0) => Some(Scope::Program),
            Ok(step) if step <= Self::LAST_STEP => Some(Scope::Step(step)),
            _ => None,
        }
    }

    /// The step's number; 0 for the whole program.
    #[must_use]
    pub fn number(self) -> u16 {
        match self {
            Scope::Program => 0,
            Scope::Step(step) => step,
        }
    }
}

impl fmt::Display for Scope {
    /// The name as it stands in a program: `INA`, `INA2`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Scope::Program => f.write_str("INA"),
            Scope::Step(step) => write!(f, "INA{step}"),
        }
    }
}

/// One INA value found in a head.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Entry {
    /// What the value is for.
    pub scope: Scope,
    /// The inertia, kg·m²; finite and positive.
    pub inertia_kg_m2: f64,
    /// Its line, counted from 1.
    pub line: u64,
    /// The spelling it has; `; INA=0.5` counts as [`Dialect::Iso`].
    pub dialect: Dialect,
}

/// All INA values in the head of the program at `path`, in the order they stand.
///
/// Reads no further than the head. A symbolic link is followed: reading changes nothing.
///
/// # Errors
/// The file cannot be read or is not text; a value is not a finite positive number; one value stands twice.
pub fn list(path: &Path) -> Result<Vec<Entry>, Error> {
    let read = || Ok(Head::read(replace::open_to_read(path)?)?.entries());
    read().map_err(|problem| Error::new(path, problem))
}

/// The INA value for `scope`; `None` where the head holds none, so that it must be measured.
///
/// A step without a value of its own gives `None` even where the program has one: whether the whole program's
/// value will do for the step is the caller's decision.
///
/// # Errors
/// As [`list`].
pub fn get(path: &Path, scope: Scope) -> Result<Option<Entry>, Error> {
    Ok(list(path)?.into_iter().find(|entry| entry.scope == scope))
}

/// Writes `inertia_kg_m2` for `scope` into the program's head, and says whether the file had to change.
///
/// An existing value changes in place and keeps its spelling. A new one gets a line of its own after the tape mark
/// and the program number, in `dialect`; with `None` in the spelling of the head's other values, else as the
/// program's own dialect is recognised. The file is replaced whole or not at all, see `replace`.
///
/// # Errors
/// As [`list`]; the inertia is outside [`INERTIA_RANGE_KG_M2`]; the program is a symbolic link, cannot be replaced
/// with its owner and mode kept, holds a NUL byte, or is being written by somebody else all the time.
pub fn set(path: &Path, scope: Scope, inertia_kg_m2: f64, dialect: Option<Dialect>) -> Result<bool, Error> {
    let (low, high) = INERTIA_RANGE_KG_M2;
    if !(low..=high).contains(&inertia_kg_m2) {
        return Err(Error::new(path, Problem::Inertia(inertia_kg_m2)));
    }
    replace::edit(path, |file| {
        let head = Head::read(&mut *file)?;
        edit::set(&head, scope, inertia_kg_m2, |own| match dialect.or(own) {
            Some(dialect) => Ok(dialect),
            None => Dialect::detect(path, file),
        })
    })
    .map_err(|problem| Error::new(path, problem))
}

/// Removes the INA value for `scope` from the program's head, and says whether there was one.
///
/// The whole line goes when nothing else stands on it, else only the statement: `set` followed by `remove` restores
/// the file byte by byte.
///
/// # Errors
/// As [`set`], but for the inertia.
pub fn remove(path: &Path, scope: Scope) -> Result<bool, Error> {
    replace::edit(path, |file| Ok(edit::remove(&Head::read(file)?, scope))).map_err(|problem| Error::new(path, problem))
}
