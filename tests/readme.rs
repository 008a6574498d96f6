//! The README's C example compiles, runs, and measures; its table of functions names every function there is.

mod support;
use std::fs;
use support::{command, functions, header, release, root, run};

/// The C block of the README.
fn example() -> String {
    let readme = fs::read_to_string(root().join("README.md")).unwrap();
    let (_, rest) = readme.split_once("```c\n").expect("a C example");
    rest.split_once("```").unwrap().0.to_string()
}

/// The example inside a program whose axis is the harness's plant.
fn program(example: &str) -> String {
    format!(
        "#include \"kernel.h\"\nstatic plant axis;\nstatic kernel k;\n\
         static gib_backlash_input axis_cycle(const gib_backlash_output *out) {{ k.out = *out; return kernel_sense(&k); }}\n\
         static int refused(const gib_backlash *gib, int32_t status) {{ return !gib || status; }}\n\
         int main(void) {{\nplant_config c = plant_default();\nplant_init(&axis, &c);\nkernel_init(&k, &axis);\n{example}\n\
         gib_backlash_free(gib);\n\
         return status == GIB_DONE && report.mean.lost_motion_um > 52.0 && report.mean.lost_motion_um < 54.0 ? 0 : 1;\n}}\n"
    )
}

#[test]
fn the_example_compiles_runs_and_measures() {
    let Some(release) = release("readme") else { return };
    let folder = tempfile::tempdir().unwrap();
    let (source, binary) = (folder.path().join("example.c"), folder.path().join("example"));
    fs::write(&source, program(&example())).unwrap();
    run(command("gcc -std=c11 -O1 -Wall -Wextra -Werror")
        .arg(format!("-I{}", root().join("include").display()))
        .arg(format!("-I{}", root().join("c-harness").display()))
        .arg("-o")
        .arg(&binary)
        .arg(&source)
        .arg(root().join("c-harness/plant.c"))
        .arg(release.join("libgib.a"))
        .args(["-lm", "-lpthread", "-ldl"]))
    .unwrap();
    run(&mut command(binary.to_str().unwrap())).unwrap();
}

#[test]
fn the_table_names_every_function() {
    let readme = fs::read_to_string(root().join("README.md")).unwrap();
    // A row is a family and its verbs: "| `family` | `_verb _verb` | ...".
    let named = |row: &str, name: &str| {
        let mut cells = row.split('`').skip(1).step_by(2);
        let (Some(family), Some(verbs)) = (cells.next(), cells.next()) else { return false };
        let verb = name.strip_prefix("gib_").and_then(|rest| rest.strip_prefix(family));
        verb.is_some_and(|verb| verbs.split_whitespace().any(|known| known == verb))
    };
    let missing: Vec<String> = functions(&header())
        .into_keys()
        .filter(|name| !readme.contains(name.as_str()) && !readme.lines().any(|row| named(row, name)))
        .collect();
    assert_eq!(missing, Vec::<String>::new(), "add them to the README's table of functions");
}
