//! What the tests of the house share: where things are, and running the tools of the system.
#![allow(dead_code)] // each test file is a program of its own and uses a part

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The folder of `Cargo.toml`.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The committed header.
pub fn header() -> String {
    fs::read_to_string(root().join("include/gib.h")).unwrap()
}

/// Every file below `folder` with one of these endings, in the order of its path; none where there is no folder.
pub fn files(folder: &Path, endings: &[&str]) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).into_iter().flatten() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(files(&path, endings));
        } else if path.extension().and_then(|e| e.to_str()).is_some_and(|e| endings.contains(&e)) {
            found.push(path);
        }
    }
    found.sort();
    found
}

/// The folder of the release build, which `make test` makes and names in `GIB_RELEASE`. Without it a line is printed
/// and the caller passes: a plain `cargo test` does not build the library a second time.
pub fn release(test: &str) -> Option<PathBuf> {
    let Some(folder) = std::env::var_os("GIB_RELEASE") else {
        eprintln!("{test}: skipped, needs the release build that `make test` makes");
        return None;
    };
    let folder = root().join(folder);
    assert!(folder.join("libgib.so").exists(), "no libgib.so in {}", folder.display());
    Some(folder)
}

/// Runs a program to its end: its output, or what it said when it failed.
pub fn run(command: &mut Command) -> Result<String, String> {
    let output = command.output().map_err(|e| format!("{command:?}: {e}"))?;
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    if output.status.success() {
        Ok(text(&output.stdout))
    } else {
        Err(format!("{command:?}: {}\n{}{}", output.status, text(&output.stdout), text(&output.stderr)))
    }
}

/// A program of the system with its arguments, as one would type it.
pub fn command(line: &str) -> Command {
    let mut words = line.split_whitespace();
    let mut command = Command::new(words.next().unwrap());
    command.args(words);
    command
}

/// Code of a header: no comments, no preprocessor lines.
pub fn code(header: &str) -> String {
    let mut text = String::new();
    let mut rest = header;
    while let Some((before, after)) = rest.split_once("/*") {
        text += before;
        rest = after.split_once("*/").map_or("", |(_, after)| after);
    }
    text += rest;
    let kept = text.lines().filter(|line| !line.starts_with('#')).map(|line| line.split("//").next().unwrap());
    kept.collect::<Vec<_>>().join("\n").replace("extern \"C\" {", "")
}

/// The functions that a header declares: name -> "returns (parameters)".
pub fn functions(header: &str) -> BTreeMap<String, String> {
    let mut functions = BTreeMap::new();
    for statement in code(header).split(';') {
        // A function pointer's first parenthesis is followed by a star: a typedef or a struct member, not a function.
        let Some((head, parameters)) = statement.split_once('(').filter(|(_, p)| !p.starts_with('*')) else { continue };
        let Some((returns, name)) = head.rsplit_once([' ', '*', '\n']) else { continue };
        let star = if head[..head.len() - name.len()].ends_with('*') { "*" } else { "" };
        functions.insert(name.to_string(), plain(&format!("{returns}{star} ({parameters}")));
    }
    functions
}

/// A piece of a declaration, its blanks made alike.
pub fn plain(code: &str) -> String {
    code.split_whitespace().collect::<Vec<_>>().join(" ").replace("* ", "*").replace(" *", "*")
}
