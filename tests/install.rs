//! `make install` gives a program outside the tree all it needs, shared and static, and `make uninstall` takes all of it
//! away again. The static library shows no global name but `gib_*`, and a panic still ends at the boundary.

mod support;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use support::{command, release, root, run};

/// A kernel's program: it has a `step` of its own, which must not meet one of the library's.
const PROGRAM: &str = r#"
#include <gib.h>
#include <stdio.h>
int step(void) { return 7; }
int main(void)
{
    const gib_api_table *api = gib_api(GIB_ABI_VERSION);
    if (api == NULL || api->abi_version() != gib_abi_version()) return 1;
    printf("%s %s %d\n", gib_version(), gib_status_text(GIB_ERR_NULL), step());
    return 0;
}
"#;

fn make(target: &str, destination: &Path, prefix: &Path) {
    let mut make = command(&format!("make --silent {target}"));
    make.env_remove("MAKEFLAGS").env_remove("MAKELEVEL").current_dir(root());
    let variable = |name: &str, value: &Path| format!("{name}={}", value.display());
    run(make.args([variable("DESTDIR", destination), variable("PREFIX", prefix)])).unwrap();
}

fn pkg_config(options: &str, environment: &[(&str, PathBuf)]) -> Vec<String> {
    let mut pkg_config = command(&format!("pkg-config {options} gib"));
    pkg_config.envs(environment.iter().map(|(name, value)| (name, value)));
    run(&mut pkg_config).unwrap().split_whitespace().map(str::to_string).collect()
}

/// Compiles the program outside the tree.
fn compile(folder: &Path, name: &str, first: &str, flags: &[String]) -> PathBuf {
    let (source, program) = (folder.join("program.c"), folder.join(name));
    fs::write(&source, PROGRAM).unwrap();
    let mut cc = command(&format!("cc -std=c99 -Wall -Wextra -Werror {first} -o"));
    run(cc.arg(&program).arg(&source).args(flags)).unwrap();
    program
}

fn check(program: &mut Command) {
    let said = run(program).unwrap();
    assert_eq!(said.trim(), format!("{} a required pointer is NULL 7", env!("CARGO_PKG_VERSION")));
}

/// Everything below a folder that is no folder.
fn left(folder: &Path) -> String {
    run(command("find").arg(folder).args(["!", "-type", "d"])).unwrap()
}

fn needs(program: &Path) -> String {
    run(command("readelf --dynamic --wide").arg(program)).unwrap()
}

#[test]
fn program_outside_the_tree_links_and_runs() {
    if release("install").is_none() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let (prefix, nowhere) = (folder.path().join("usr"), Path::new(""));
    make("install", nowhere, &prefix);
    let libraries = prefix.join("lib");
    let environment = [("PKG_CONFIG_PATH", libraries.join("pkgconfig"))];

    let program = compile(folder.path(), "shared", "", &pkg_config("--cflags --libs", &environment));
    assert!(needs(&program).contains("Shared library: [libgib.so.0]"));
    check(Command::new(&program).env("LD_LIBRARY_PATH", &libraries));

    let program = compile(folder.path(), "static", "-static", &pkg_config("--static --cflags --libs", &environment));
    assert!(!needs(&program).contains("NEEDED"));
    check(&mut Command::new(&program));

    // A kernel's module: gib inside, the C library outside, everything that is not used dropped.
    let mut flags = pkg_config("--static --cflags --libs", &environment);
    flags.iter_mut().filter(|flag| *flag == "-lgib").for_each(|flag| *flag = "-l:libgib.a".to_string());
    let program = compile(folder.path(), "inside", "-Wl,--gc-sections", &flags);
    assert!(!needs(&program).contains("libgib"));
    check(&mut Command::new(&program));

    assert_eq!(foreign_names(&libraries.join("libgib.a")), Vec::<String>::new());
    let said = run(Command::new(prefix.join("bin/gib")).arg("--version")).unwrap();
    assert!(said.contains(env!("CARGO_PKG_VERSION")), "{said}");

    assert!(!left(&prefix).is_empty());
    make("uninstall", nowhere, &prefix);
    assert_eq!(left(&prefix), "", "uninstall left these");
}

#[test]
fn a_package_is_built_in_its_own_folder() {
    if release("install").is_none() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let (destination, prefix) = (folder.path().join("package"), Path::new("/usr"));
    make("install", &destination, prefix);
    let libraries = destination.join("usr/lib");
    let environment =
        [("PKG_CONFIG_PATH", libraries.join("pkgconfig")), ("PKG_CONFIG_SYSROOT_DIR", destination.clone())];
    assert_eq!(
        pkg_config("--variable=includedir", &environment),
        [destination.join("usr/include").display().to_string()]
    );
    // /usr/include and /usr/lib are the compiler's own places, so pkg-config leaves them out.
    let mut flags = pkg_config("--cflags --libs", &environment);
    flags.extend([format!("-I{}/usr/include", destination.display()), format!("-L{}", libraries.display())]);
    let program = compile(folder.path(), "shared", "", &flags);
    check(Command::new(&program).env("LD_LIBRARY_PATH", &libraries));

    // What another package put there stays.
    let other = libraries.join("libother.so.0");
    fs::write(&other, "").unwrap();
    make("uninstall", &destination, prefix);
    assert_eq!(left(&destination).trim(), other.display().to_string());
}

/// Global names of a static library that are not the library's own.
fn foreign_names(archive: &Path) -> Vec<String> {
    let names = run(command("nm --extern-only --defined-only --format=posix").arg(archive)).unwrap();
    let names: Vec<&str> = names.lines().filter_map(|line| line.split_once(' ').map(|(name, _)| name)).collect();
    assert!(names.contains(&"gib_api"), "{names:?}");
    names.iter().filter(|n| !n.starts_with("gib_") && !n.contains(".a[")).map(|n| n.to_string()).collect()
}

#[test]
fn a_bare_name_in_an_archive_is_seen() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::write(at("bad.c"), "int gib_api(void) { return 0; } int step(void) { return 1; }").unwrap();
    run(command("cc -c -o").arg(at("bad.o")).arg(at("bad.c"))).unwrap();
    run(command("ar rcs").arg(at("bad.a")).arg(at("bad.o"))).unwrap();
    assert_eq!(foreign_names(&at("bad.a")), ["step"]);
}

/// The way of making the static library, on one that panics, catches it, and has a bare name.
#[test]
fn static_library_hides_names_and_still_catches_panics() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let source = r#"
        #[unsafe(no_mangle)] pub extern "C" fn step() -> i32 { 3 }
        #[unsafe(no_mangle)] pub extern "C" fn gib_api(i: usize) -> i32 {
            std::panic::set_hook(Box::new(|_| {}));
            std::panic::catch_unwind(|| [step(), 2][std::hint::black_box(i)]).unwrap_or(-7)
        }
        #[unsafe(no_mangle)] pub extern "C" fn gib_unused() -> f64 { std::hint::black_box([2.5; 9000])[3] }
    "#;
    fs::write(at("seeded.rs"), source).unwrap();
    let rustc = option_env!("RUSTC").unwrap_or("rustc");
    let mut build =
        command(&format!("{rustc} --edition 2024 --crate-name gib --crate-type staticlib,cdylib -O --out-dir"));
    run(build.arg(folder.path()).arg(at("seeded.rs"))).unwrap();
    let mut tool = Command::new(root().join("tools/static-archive"));
    fs::create_dir(at("out")).unwrap();
    let archive = at("out/libgib.a");
    run(tool.args([at("libgib.a"), at("libgib.so")]).arg(&archive)).unwrap();
    assert_eq!(foreign_names(&archive), Vec::<String>::new());

    let program = "int gib_api(unsigned long); int step(void) { return 5; }\n\
                   int main(void) { return !(gib_api(0) == 3 && gib_api(9) == -7 && step() == 5); }\n";
    fs::write(at("program.c"), program).unwrap();
    for first in ["cc -static", "cc -Wl,--gc-sections"] {
        let mut cc = command(&format!("{first} -o"));
        run(cc.arg(at("program")).arg(at("program.c")).arg(&archive).args(["-lpthread", "-lm", "-ldl"])).unwrap();
        run(&mut Command::new(at("program"))).unwrap();
    }
    let kept = run(command("nm").arg(at("program"))).unwrap();
    assert!(kept.contains("gib_api") && !kept.contains("gib_unused"), "what is not used was not dropped");
}
