//! Loads a machine file for a command, and says on standard error which of its keys have no meaning.

use std::path::Path;

use gib::machine::{Error, Machine};

/// The machine; a key that is ignored may be a slip, so that it is named.
pub fn load(file: &Path) -> Result<Machine, Error> {
    let machine = Machine::load(file)?;
    for key in &machine.ignored_keys {
        eprintln!("gib: {}: {key} has no meaning here and is ignored", file.display());
    }
    Ok(machine)
}
