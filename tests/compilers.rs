//! The header compiles alone, without a warning, in every language standard and compiler that a kernel may use.

mod support;
use std::fs;
use std::path::Path;
use support::{command, root, run};

const COMPILERS: &[(&str, &str, &[&str])] = &[
    ("gcc", "c", &["c90", "c99", "c11", "c17"]),
    ("clang", "c", &["c90", "c99", "c11", "c17"]),
    ("g++", "c++", &["c++11", "c++20"]),
    ("clang++", "c++", &["c++11", "c++20"]),
];

/// Compiles a program that includes the header first, and uses it, with all warnings as errors.
fn compile(compiler: &str, language: &str, standard: &str, include: &Path) -> Result<String, String> {
    let folder = tempfile::tempdir().unwrap();
    let source = folder.path().join("alone.c");
    let text = "#include <gib.h>\n#include <gib.h>\nint main(void) { return gib_api(GIB_ABI_VERSION) == NULL; }\n";
    fs::write(&source, text).unwrap();
    let flags = format!("{compiler} -std={standard} -Wall -Wextra -Wpedantic -Werror -x {language} -fsyntax-only");
    // Not as a system header: the compiler would keep its warnings to itself.
    run(command(&flags).arg("-I").arg(include).arg(&source))
}

#[test]
fn header_compiles_alone() {
    for (compiler, language, standards) in COMPILERS {
        if command(compiler).arg("--version").output().is_err() {
            eprintln!("compilers: {compiler} skipped, not installed (tools/deps installs it)");
            continue;
        }
        for standard in *standards {
            compile(compiler, language, standard, &root().join("include")).unwrap_or_else(|e| panic!("{e}"));
        }
    }
}

#[test]
fn a_flaw_in_the_header_is_seen() {
    let folder = tempfile::tempdir().unwrap();
    let header = support::header();
    let flaws = [
        header.replace("#include <stdint.h>\n", ""), // leans on what others include
        header.replace("#ifndef GIB_H", "#ifndef GIB_OTHER_H"), // guard without effect
        header.replace("typedef struct gib_api_table", "struct x { int a[0]; }; typedef struct gib_api_table"),
    ];
    for flaw in flaws {
        assert_ne!(flaw, header, "the flaw was not seeded");
        fs::write(folder.path().join("gib.h"), flaw).unwrap();
        compile("gcc", "c", "c99", folder.path()).expect_err("a seeded flaw went unseen");
    }
}
