//! The rooms of the house: who imports whom, what the cycle room must not name, where `unsafe` may stand, and how long
//! a file may grow. Reads the sources as tokens, so that comments and strings are not code; code under
//! `#[cfg(test)]` is left out.

mod support;
use proc_macro2::{Delimiter, TokenStream, TokenTree};
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use support::{files, root};

/// The rooms from top to bottom; those on one line may not use each other. A room uses rooms above it, never below.
const ORDER: &[&[&str]] = &[
    &["error", "units"],
    &["cycle"],
    &["program"],
    &["recording"],
    &["machine"],
    &["plant"],
    &["analysis"],
    &["diagnosis"],
    &["report"],
    &["abi", "cli"],
];

/// Crates that the cycle room must not name: they allocate, do input and output, or read a clock.
const NO_CRATE_IN_CYCLE: &[&str] =
    &["std", "alloc", "libc", "clap", "csv", "once_cell", "parquet", "plotters", "realfft", "serde_json"];
/// Types that allocate.
const NO_TYPE_IN_CYCLE: &[&str] = &["Vec", "Box", "String", "Rc", "Arc", "DMatrix", "DVector"];
/// Macros that allocate, print or panic.
const NO_MACRO_IN_CYCLE: &[&str] = &[
    "format",
    "vec",
    "print",
    "println",
    "eprint",
    "eprintln",
    "write",
    "writeln",
    "dbg",
    "panic",
    "todo",
    "unimplemented",
    "unreachable",
    "assert",
    "assert_eq",
    "assert_ne",
    "thread_local",
];
/// Methods that panic or allocate.
const NO_METHOD_IN_CYCLE: &[&str] =
    &["unwrap", "expect", "unwrap_err", "expect_err", "to_vec", "to_string", "to_owned", "collect"];

/// A source file as a module: its path in the crate and the room it is in.
struct Module {
    path: Vec<String>,
    room: String,
}

/// The module of a file below `src`: `cycle/backlash/fit.rs` is `cycle::backlash::fit` in the room `cycle`.
fn module(relative: &Path) -> Module {
    let mut path: Vec<String> = relative.with_extension("").iter().map(|p| p.to_str().unwrap().to_string()).collect();
    if path.last().is_some_and(|name| name == "mod" || name == "lib" || name == "main") {
        path.pop();
    }
    let room = match relative.to_str() {
        Some("main.rs") => "cli".to_string(),
        _ => path.first().cloned().unwrap_or_default(),
    };
    Module { path, room }
}

fn rank(room: &str) -> Option<usize> {
    ORDER.iter().position(|row| row.contains(&room))
}

/// What is wrong with one source text; `relative` is its place below `src`.
fn faults(relative: &Path, text: &str) -> Vec<String> {
    let module = module(relative);
    let tokens: TokenStream = text.parse().unwrap_or_else(|e| panic!("{}: {e}", relative.display()));
    let mut found = BTreeSet::new();
    if !module.room.is_empty() && rank(&module.room).is_none() {
        found.insert(format!("{}: a room that tests/rooms.rs does not know", module.room));
    }
    walk(&module, &without_tests(tokens), &mut found);
    found.into_iter().map(|fault| format!("{}: {fault}", relative.display())).collect()
}

fn punct(token: Option<&TokenTree>, c: char) -> bool {
    matches!(token, Some(TokenTree::Punct(p)) if p.as_char() == c)
}

fn word(token: Option<&TokenTree>) -> Option<String> {
    match token {
        Some(TokenTree::Ident(ident)) => Some(ident.to_string()),
        _ => None,
    }
}

/// The tokens without the items that `#[cfg(test)]` or `#[test]` stands before.
fn without_tests(tokens: TokenStream) -> Vec<TokenTree> {
    let tokens: Vec<TokenTree> = tokens.into_iter().collect();
    let mut kept = Vec::new();
    let mut i = 0;
    while i < tokens.len() {
        let attribute = match tokens.get(i + 1) {
            Some(TokenTree::Group(g)) if punct(tokens.get(i), '#') => g.stream().to_string().replace(' ', ""),
            _ => String::new(),
        };
        if attribute == "cfg(test)" || attribute == "test" {
            // The item ends with its body, or with a semicolon.
            let ends = |t: &TokenTree| {
                matches!(t, TokenTree::Group(g) if g.delimiter() == Delimiter::Brace) || punct(Some(t), ';')
            };
            i += 2 + tokens[i + 2..].iter().position(ends).map_or(0, |n| n + 1);
        } else {
            kept.push(tokens[i].clone());
            i += 1;
        }
    }
    kept
}

/// Looks at every token of a module, and of the modules written inside it.
fn walk(module: &Module, tokens: &[TokenTree], found: &mut BTreeSet<String>) {
    for (i, token) in tokens.iter().enumerate() {
        match token {
            TokenTree::Group(group) => {
                let inner = without_tests(group.stream());
                match (i > 1).then(|| (word(tokens.get(i - 2)), word(tokens.get(i - 1)))) {
                    Some((Some(keyword), Some(name))) if keyword == "mod" => {
                        let mut path = module.path.clone();
                        path.push(name);
                        walk(&Module { path, room: module.room.clone() }, &inner, found);
                    }
                    _ => walk(module, &inner, found),
                }
            }
            TokenTree::Ident(ident) => check_word(module, &ident.to_string(), tokens, i, found),
            _ => {}
        }
    }
}

/// Checks one identifier with what stands around it.
fn check_word(module: &Module, name: &str, tokens: &[TokenTree], i: usize, found: &mut BTreeSet<String>) {
    let starts_path = !(i > 1 && punct(tokens.get(i - 1), ':') && punct(tokens.get(i - 2), ':'));
    let is_macro = punct(tokens.get(i + 1), '!') && !punct(tokens.get(i + 2), '=');
    let is_method = i > 0 && punct(tokens.get(i - 1), '.');
    // `gib::` is the library seen from the command; `main.rs` and `cli` are a crate of their own.
    let heads: &[&str] = if module.room == "cli" { &["gib"] } else { &["crate", "super", "self"] };
    if starts_path && heads.contains(&name) {
        check_path(module, name, tokens, i, found);
    }
    if name == "unsafe" && module.room != "abi" {
        found.insert("unsafe outside the room abi".to_string());
    }
    let is_crate = (punct(tokens.get(i + 1), ':') && punct(tokens.get(i + 2), ':')) || in_use(tokens, i);
    let refused = (is_crate && NO_CRATE_IN_CYCLE.contains(&name))
        || NO_TYPE_IN_CYCLE.contains(&name)
        || (is_macro && NO_MACRO_IN_CYCLE.contains(&name))
        || (is_method && NO_METHOD_IN_CYCLE.contains(&name));
    if module.room == "cycle" && refused {
        found.insert(format!("{name} in the cycle room"));
    }
}

/// Whether the word stands right behind `use` or `extern crate`.
fn in_use(tokens: &[TokenTree], i: usize) -> bool {
    i > 0 && matches!(word(tokens.get(i - 1)).as_deref(), Some("use" | "crate"))
}

/// Follows `crate::a`, `super::super::a`, `crate::{a, b::c}` to the rooms it names.
fn check_path(module: &Module, head: &str, tokens: &[TokenTree], start: usize, found: &mut BTreeSet<String>) {
    let mut at = start + 1;
    // None: the path does not reach the root of the crate, and stays inside the room.
    let mut depth = match head {
        "super" => module.path.len() - 1.min(module.path.len()),
        "self" => module.path.len(),
        _ => 0,
    };
    while punct(tokens.get(at), ':') && punct(tokens.get(at + 1), ':') {
        match tokens.get(at + 2) {
            Some(TokenTree::Ident(ident)) if ident == "super" => {
                depth = depth.saturating_sub(1);
                at += 3;
            }
            Some(TokenTree::Ident(ident)) => {
                return if depth == 0 {
                    check_room(module, &ident.to_string(), found)
                };
            }
            Some(TokenTree::Group(group)) => {
                // Each element of the list goes on from here, as if written out.
                let inner: Vec<TokenTree> = group.stream().into_iter().collect();
                for element in inner.split(|t| punct(Some(t), ',')) {
                    let mut written: Vec<TokenTree> = tokens[start..at + 2].to_vec();
                    written.extend_from_slice(element);
                    check_path(module, head, &written, 0, found);
                }
                return;
            }
            Some(TokenTree::Punct(star)) if star.as_char() == '*' && depth == 0 => {
                found.insert("imports everything from the root of the crate".to_string());
                return;
            }
            _ => return,
        }
    }
    if depth == 0 && word(tokens.get(at)).as_deref() == Some("as") {
        found.insert("gives the root of the crate another name".to_string());
    }
}

/// A room may use itself and the rooms above it.
fn check_room(module: &Module, used: &str, found: &mut BTreeSet<String>) {
    if module.room.is_empty() || module.room == used {
        return; // lib.rs is the map and names them all
    }
    match (rank(&module.room), rank(used)) {
        (Some(own), Some(other)) if other < own => {}
        (Some(_), Some(_)) => drop(found.insert(format!("{} must not use {used}", module.room))),
        _ => drop(found.insert(format!("{used} is no room, yet {} uses it", module.room))),
    }
}

/// Whether the file is a module that its parent declares for tests only.
fn only_for_tests(source: &Path, relative: &Path) -> bool {
    let Some((name, parent)) = module(relative).path.split_last().map(|(n, p)| (n.clone(), p.join("/"))) else {
        return false;
    };
    let parents = [format!("{parent}.rs"), format!("{parent}/mod.rs"), "lib.rs".to_string(), "main.rs".to_string()];
    let declaration = format!("#[cfg(test)]mod{name};");
    let declares = |p: &String| {
        fs::read_to_string(source.join(p))
            .is_ok_and(|t| t.split_whitespace().collect::<String>().contains(&declaration))
    };
    parents.iter().any(declares)
}

#[test]
fn rooms_use_only_the_rooms_above() {
    let source = root().join("src");
    let mut found = Vec::new();
    for path in files(&source, &["rs"]) {
        let relative = path.strip_prefix(&source).unwrap();
        if !only_for_tests(&source, relative) {
            found.extend(faults(relative, &fs::read_to_string(&path).unwrap()));
        }
    }
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn forbidden_imports_are_seen() {
    let bad = [
        ("machine/read.rs", "use crate::diagnosis::Cause;", "machine must not use diagnosis"),
        ("cycle/mod.rs", "fn f() { crate::abi::guard::g() }", "cycle must not use abi"),
        ("cycle/backlash/fit.rs", "use super::super::super::plant::P;", "cycle must not use plant"),
        ("cycle/backlash/fit.rs", "mod deep { use super::super::super::super::plant::P; }", "cycle must not use plant"),
        ("units.rs", "use crate::{error::Fault};", "units must not use error"),
        (
            "program/mod.rs",
            "use crate::{error::{Fault, in_range}, units, recording::csv};",
            "program must not use recording",
        ),
        ("plant/mod.rs", "use crate::{cycle, report::{svg, html}};", "plant must not use report"),
        ("plant/mod.rs", "fn f() { println!(\"{}\", crate::report::x()) }", "plant must not use report"),
        ("abi/mod.rs", "use crate::cli;", "abi must not use cli"),
        ("cli/inspect.rs", "use gib::abi::guard;", "cli must not use abi"),
        ("machine/mod.rs", "use crate::Fault;", "Fault is no room"),
        ("machine/mod.rs", "use crate as root; use root::abi;", "another name"),
        ("machine/mod.rs", "use super::*;", "everything from the root"),
        ("attic/mod.rs", "", "does not know"),
        ("plant/mod.rs", "fn f() { unsafe { g() } }", "unsafe outside"),
        ("cycle/a.rs", "use std::io::Read;", "std in the cycle room"),
        ("cycle/a.rs", "fn f() { let t = std::time::Instant::now(); }", "std in the cycle room"),
        ("cycle/a.rs", "use ::std::fs;", "std in the cycle room"),
        ("cycle/a.rs", "extern crate alloc;", "alloc in the cycle room"),
        ("cycle/a.rs", "fn f(v: &mut Vec<f64>) { v.push(1.0) }", "Vec in the cycle room"),
        ("cycle/a.rs", "fn f() -> Box<f64> { Box::new(1.0) }", "Box in the cycle room"),
        ("cycle/a.rs", "fn f(s: String) {}", "String in the cycle room"),
        ("cycle/a.rs", "fn f() { let s = format!(\"a\"); }", "format in the cycle room"),
        ("cycle/a.rs", "fn f() { println!(); }", "println in the cycle room"),
        ("cycle/a.rs", "fn f(o: Option<f64>) -> f64 { o.unwrap() }", "unwrap in the cycle room"),
        ("cycle/a.rs", "fn f(o: Option<f64>) -> f64 { o.expect(\"a\") }", "expect in the cycle room"),
        ("cycle/a.rs", "fn f() { panic!() }", "panic in the cycle room"),
        ("cycle/a.rs", "fn f() { g!({ vec![0.0; 3] }) }", "vec in the cycle room"),
    ];
    for (place, text, wanted) in bad {
        let found = faults(Path::new(place), text);
        assert!(found.iter().any(|f| f.contains(wanted)), "{place}: `{text}` gave {found:?}");
    }
}

#[test]
fn allowed_imports_pass() {
    let good = [
        ("lib.rs", "pub mod error; pub mod abi; pub use crate::error::Fault;"),
        ("cycle/backlash/fit.rs", "use super::super::level::Level; use crate::{error::Fault, units}; use super::Plan;"),
        (
            "cycle/a.rs",
            "// std::io, .unwrap(), Vec\nfn f(o: Option<f64>) -> f64 { o.unwrap_or(core::f64::consts::PI) }",
        ),
        ("cycle/a.rs", "const T: &str = \"crate::abi, format!()\"; fn f() { debug_assert!(true); }"),
        ("cycle/a.rs", "fn f() {} #[cfg(test)] mod tests { use crate::plant::P; fn g() { None.unwrap() } }"),
        ("abi/api.rs", "use super::backlash; use crate::diagnosis; fn f() { unsafe { g() } }"),
        ("cli/inspect.rs", "use crate::cli::table; use super::table; use gib::recording;"),
        ("main.rs", "mod cli; use gib::diagnosis;"),
    ];
    for (place, text) in good {
        assert_eq!(faults(Path::new(place), text), Vec::<String>::new(), "{place}: `{text}`");
    }
}

/// Files that people write, with more lines than one can hold in mind.
fn too_long(lines: &[(String, usize)]) -> Vec<String> {
    const MOST: usize = 500;
    lines.iter().filter(|(_, n)| *n > MOST).map(|(path, n)| format!("{path}: {n} lines, {MOST} at most")).collect()
}

#[test]
fn files_stay_short() {
    let mut lines = Vec::new();
    for folder in ["src", "tests", "benches", "examples", "fuzz", "c-harness", "linuxcnc", "tools"] {
        for path in files(&root().join(folder), &["rs", "c", "h", "py", "sh", "comp", "hal"]) {
            lines.push((path.display().to_string(), fs::read_to_string(&path).unwrap().lines().count()));
        }
    }
    assert!(lines.len() > 10, "the folders were not found");
    assert_eq!(too_long(&lines), Vec::<String>::new());
    assert_eq!(too_long(&[("a.rs".into(), 500), ("b.rs".into(), 501)]), ["b.rs: 501 lines, 500 at most"]);
}
