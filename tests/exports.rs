//! The shared library exports what the header declares, nothing else, and carries its soname. A bare name such as
//! `step` would meet another module's in a kernel that loads modules with global symbols.

mod support;
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use support::{command, functions, header, release, run};

/// Defined dynamic symbols of a shared library.
fn exported(library: &Path) -> BTreeSet<String> {
    let list = run(command("nm --dynamic --defined-only --format=posix").arg(library)).unwrap();
    list.lines().filter_map(|line| line.split_whitespace().next()).map(str::to_string).collect()
}

/// What is in one but not in the other, in words.
fn disagreement(exported: &BTreeSet<String>, declared: &BTreeSet<String>) -> Vec<String> {
    let unprefixed = exported.iter().filter(|n| !n.starts_with("gib_")).map(|n| format!("{n} has no gib_"));
    let undeclared = exported.difference(declared).map(|n| format!("{n} is exported but not in the header"));
    let missing = declared.difference(exported).map(|n| format!("{n} is in the header but not exported"));
    unprefixed.chain(undeclared).chain(missing).collect()
}

#[test]
fn library_and_header_agree() {
    let Some(folder) = release("exports") else { return };
    let library = folder.join("libgib.so");
    let declared = functions(&header()).into_keys().collect();
    assert_eq!(disagreement(&exported(&library), &declared), Vec::<String>::new());
    let dynamic = run(command("readelf --dynamic --wide").arg(&library)).unwrap();
    assert!(dynamic.contains("soname: [libgib.so.0]"), "{dynamic}");
}

#[test]
fn a_bare_name_and_a_missing_one_are_seen() {
    let folder = tempfile::tempdir().unwrap();
    let (source, library) = (folder.path().join("bad.c"), folder.path().join("bad.so"));
    fs::write(&source, "int gib_ok(void){return 0;} int step(void){return 1;}").unwrap();
    run(command("cc -shared -fPIC -o").arg(&library).arg(&source)).unwrap();
    let declared = BTreeSet::from(["gib_ok".to_string(), "gib_gone".to_string()]);
    assert_eq!(
        disagreement(&exported(&library), &declared),
        ["step has no gib_", "step is exported but not in the header", "gib_gone is in the header but not exported"]
    );
}
