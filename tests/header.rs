//! `include/gib.h` is generated from the Rust sources and committed: this test fails when it is stale.
//! With `GIB_BLESS=1` (`make header`) it writes the header instead.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::PathBuf;

mod support;
use support::{code, files, functions, header, plain, root};

/// The files that C sees: the status numbers, the cycle room's structs that cross as they are, then the C surface
/// with its table last.
fn sources() -> Vec<PathBuf> {
    let mut sources = vec![root().join("src/error.rs")];
    let crosses = |path: &PathBuf| fs::read_to_string(path).unwrap().contains("\n#[repr(C)]");
    sources.extend(files(&root().join("src/cycle"), &["rs"]).into_iter().filter(crosses));
    let mut surface = files(&root().join("src/abi"), &["rs"]);
    surface.sort_by_key(|path| (!path.ends_with("mod.rs"), path.ends_with("api.rs")));
    sources.extend(surface);
    sources
}

/// `GibBacklash` is `gib_backlash` in C, and a cycle type `BacklashInput` is `gib_backlash_input`.
fn c_name(rust_name: &str) -> String {
    let mut name = String::from("gib");
    for c in rust_name.strip_prefix("Gib").unwrap_or(rust_name).chars() {
        if c.is_ascii_uppercase() {
            name.push('_');
        }
        name.push(c.to_ascii_lowercase());
    }
    name
}

/// The header that the given Rust texts make.
///
/// cbindgen follows `mod` to a file beside the one it reads; the texts are read from numbered copies, so that each is
/// read once and in this order.
fn generate(texts: &[String]) -> String {
    let mut config = cbindgen::Config::from_file(root().join("cbindgen.toml")).unwrap();
    let mut types = BTreeSet::new();
    for line in texts.iter().flat_map(|text| text.lines()) {
        let after = |keyword: &str| {
            let name = line.strip_prefix(keyword)?.split(|c: char| !c.is_alphanumeric() && c != '_').next()?;
            Some(name.to_string())
        };
        if let Some(name) = after("pub struct ").or_else(|| after("pub type ")) {
            assert!(types.insert(c_name(&name)), "{name}: two types would have this name in C");
            config.export.rename.insert(name.clone(), c_name(&name));
        }
        // A constant for Rust callers only, such as a bound of the cycle room.
        if let Some(name) = after("pub const ").filter(|name| !name.starts_with("GIB_")) {
            config.export.exclude.push(name);
        }
    }
    let folder = tempfile::tempdir().unwrap();
    let mut builder = cbindgen::Builder::new().with_config(config);
    for (number, text) in texts.iter().enumerate() {
        let copy = folder.path().join(format!("source{number:03}.rs"));
        fs::write(&copy, text).unwrap();
        builder = builder.with_src(copy);
    }
    let mut header = Vec::new();
    builder.generate().expect("cbindgen reads the sources").write(&mut header);
    let header = String::from_utf8(header).unwrap();
    // A negative number is one operand, whatever stands beside it; a compiler of C90 knows no comment to the end of a line.
    let plain = |line: &str| match (line.rsplit_once(" -"), line.split_once(" // ")) {
        (Some((name, digits)), _) if line.starts_with("#define ") => format!("{name} (-{digits})\n"),
        (_, Some((code, comment))) if code.starts_with(['#', '}']) => format!("{} /* {comment} */\n", code.trim_end()),
        _ => format!("{line}\n"),
    };
    header.lines().map(plain).collect()
}

fn texts() -> Vec<String> {
    sources().iter().map(|path| fs::read_to_string(path).unwrap()).collect()
}

/// The members of the table that are function pointers, in the same form as `functions`.
fn table(header: &str) -> BTreeMap<String, String> {
    let body = header.split_once("typedef struct gib_api_table {").unwrap().1.split_once("} gib_api_table;").unwrap().0;
    let mut members = BTreeMap::new();
    for member in code(body).split(';') {
        let Some((returns, rest)) = member.split_once("(*") else { continue };
        let (name, parameters) = rest.split_once(')').unwrap();
        members.insert(name.to_string(), plain(&format!("{returns} {parameters}")));
    }
    members
}

#[test]
fn committed_header_is_fresh() {
    let path = root().join("include/gib.h");
    let fresh = generate(&texts());
    if std::env::var_os("GIB_BLESS").is_some() {
        fs::write(&path, &fresh).unwrap();
        return;
    }
    let committed = fs::read_to_string(&path).unwrap_or_default();
    if let Some(number) = fresh.lines().zip(committed.lines()).position(|(a, b)| a != b) {
        panic!("include/gib.h is stale from line {}: run `make header`", number + 1);
    }
    assert!(fresh == committed, "include/gib.h is stale at its end: run `make header`");
}

#[test]
fn a_changed_comment_makes_the_header_stale() {
    let mut texts = texts();
    texts[0] = texts[0].replacen("A required pointer is NULL.", "A required pointer is missing.", 1);
    assert!(generate(&texts) != header());
}

/// The table's member for a function is the function's name without `gib_`.
fn missing_from_table(header: &str) -> Vec<String> {
    let (functions, table) = (functions(header), table(header));
    let mut wrong = Vec::new();
    for (name, signature) in &functions {
        let member = name.strip_prefix("gib_").unwrap_or(name);
        if member != "api" && table.get(member) != Some(signature) {
            wrong.push(format!("{name}: {signature} is not the table's {:?}", table.get(member)));
        }
    }
    wrong.extend(
        table.keys().filter(|m| !functions.contains_key(&format!("gib_{m}"))).map(|m| format!("{m}: no such function")),
    );
    wrong
}

#[test]
fn table_has_every_function_with_its_signature() {
    let header = header();
    assert!(functions(&header).len() >= 4, "{:?}", functions(&header));
    assert_eq!(missing_from_table(&header), Vec::<String>::new(), "add them to src/abi/api.rs");
    for fault in [
        header.replace("(*status_text)(int32_t", "(*status_text)(int64_t"),
        header.replace("(*status_text)", "(*text)"),
    ] {
        assert!(!missing_from_table(&fault).is_empty(), "a seeded fault went unseen");
    }
}
