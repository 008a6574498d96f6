//! The `gib` command.
fn main() {}
