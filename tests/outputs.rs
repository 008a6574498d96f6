//! What a command writes: never over what it reads, whole or not at all, and refused before the work where it cannot be.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

const MACHINE: &str = r#"{ "schema": "gib.machine/1", "name": "rig", "axes": [ { "name": "x", "drive": "ball_screw",
    "lead_mm": 10.0, "inertia_kg_m2": 0.0028, "coulomb_friction_nm": 0.9, "torque_limit_nm": 16.0,
    "servo": { "period_s": 0.001, "position_gain_1_s": 40.0, "velocity_gain_nm_s": 0.528 } } ] }"#;

fn gib(folder: &Path, arguments: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_gib")).current_dir(folder).args(arguments.split(' ')).output().unwrap()
}

/// A machine and a recording of it.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("m.json"), MACHINE).unwrap();
    let made = gib(folder.path(), "simulate --machine m.json --moves reversals --out r.csv");
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    folder
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn an_output_that_would_lose_another_file_is_refused_before_the_work() {
    let folder = folder();
    let folder = folder.path();
    std::os::unix::fs::symlink("r.csv", folder.join("link")).unwrap();
    fs::write(folder.join("keep.json"), "kept").unwrap();
    let before = (fs::read(folder.join("r.csv")).unwrap(), names(folder));
    let diagnose = "diagnose --machine m.json --recording r.csv --json";
    for (arguments, told) in [
        ("predict --machine m.json --recording r.csv --out r.csv".to_owned(), "--recording"),
        ("predict --machine m.json --recording r.csv --out link".to_owned(), "--recording"),
        ("predict --machine m.json --recording r.csv --out ./m.json".to_owned(), "--machine"),
        ("simulate --machine m.json --moves r.csv --out r.csv".to_owned(), "--moves"),
        (format!("{diagnose} r.csv"), "--recording"),
        (format!("{diagnose} new.json --machine-out ./new.json"), "--json"),
        (format!("{diagnose} new.json --machine-out m.json"), "--machine"),
        (format!("{diagnose} keep.json --machine-out none/x.json"), "none/x.json"),
        ("simulate --machine m.json --moves test --stroke-mm 0 --out s.csv".to_owned(), "--stroke-mm is 0 mm"),
        ("lost-motion r.csv --plot link".to_owned(), "<RECORDING>"),
        ("diagnose --machine m.json --recording r.csv --holdout link".to_owned(), "--holdout"),
    ] {
        let said = gib(folder, &arguments);
        let why = String::from_utf8_lossy(&said.stderr);
        assert_eq!(said.status.code(), Some(2), "{arguments}: {why}");
        assert!(why.contains(told), "{arguments}: {why}");
        assert!((fs::read(folder.join("r.csv")).unwrap(), names(folder)) == before, "{arguments}: {why}");
    }
    assert_eq!(fs::read_to_string(folder.join("keep.json")).unwrap(), "kept");
    assert_eq!(fs::read_to_string(folder.join("m.json")).unwrap(), MACHINE);
}

#[test]
fn what_does_not_fit_leaves_the_old_file_and_nothing_beside_it() {
    let folder = folder();
    let folder = folder.path();
    let before = (fs::read(folder.join("r.csv")).unwrap(), names(folder));
    let limited = |arguments: &str| {
        let line = format!("ulimit -f 16; exec '{}' {arguments}", env!("CARGO_BIN_EXE_gib"));
        Command::new("sh").current_dir(folder).args(["-c", &line]).output().unwrap()
    };
    for arguments in [
        "simulate --machine m.json --moves reversals --seed 1 --torque-noise 0.1 --out r.csv",
        "predict --machine m.json --recording r.csv --out p.csv",
    ] {
        let said = limited(arguments);
        let why = String::from_utf8_lossy(&said.stderr);
        assert_eq!(said.status.code(), Some(2), "{arguments}: {why}");
        assert!(why.contains(".csv: File too large"), "{arguments}: {why}");
        assert!((fs::read(folder.join("r.csv")).unwrap(), names(folder)) == before, "{arguments}: {why}");
    }
}

#[test]
fn what_cannot_be_replaced_is_written_to() {
    let folder = folder();
    let folder = folder.path();
    let predict = "predict --machine m.json --recording r.csv --out";
    assert!(gib(folder, &format!("{predict} /dev/null")).status.success());
    let piped = String::from_utf8(gib(folder, &format!("{predict} /dev/stdout")).stdout).unwrap();
    assert!(piped.starts_with("time_s,x.torque_nm") && piped.contains("rows written to /dev/stdout"));
    // The same where standard output is a file: neither rows nor answer write over the other.
    let line = format!("'{}' {predict} /dev/stdout > all.txt", env!("CARGO_BIN_EXE_gib"));
    assert!(Command::new("sh").current_dir(folder).args(["-c", &line]).status().unwrap().success());
    assert_eq!(fs::read_to_string(folder.join("all.txt")).unwrap(), piped);
}

/// What a command says on standard error where that is a terminal.
fn on_a_terminal(folder: &Path, arguments: &str) -> String {
    use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
    let ours = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
    grantpt(&ours).unwrap();
    unlockpt(&ours).unwrap();
    let name = ptsname(&ours, Vec::new()).unwrap().into_string().unwrap();
    let theirs = fs::OpenOptions::new().read(true).write(true).open(name).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_gib"));
    command.current_dir(folder).args(arguments.split(' ')).stdout(std::process::Stdio::null()).stderr(theirs);
    let mut child = command.spawn().unwrap();
    drop(command);
    let mut said = Vec::new();
    // Ends with an error when nobody has the other side any more.
    let _ = std::io::Read::read_to_end(&mut fs::File::from(ours), &mut said);
    assert!(child.wait().unwrap().success());
    String::from_utf8(said).unwrap()
}

#[test]
fn work_that_takes_longer_than_a_second_shows_progress() {
    let folder = folder();
    let folder = folder.path();
    let simulate = "simulate --machine m.json --moves reversals --out s.csv";
    let shown = on_a_terminal(folder, &format!("{simulate} --step-us 0.1"));
    assert!(shown.contains(" % simulating") && shown.ends_with("\r\x1b[K"), "{shown:?}");

    let cogging = |i| format!(r#"{{"cause":"cogging","parameters":{{"amplitude_nm":0.001,"period_mm":{}}}}}"#, 1 + i);
    let effects: Vec<String> = (0..400).map(cogging).collect();
    let many = MACHINE.replace("\"servo\"", &format!("\"effects\":[{}],\"servo\"", effects.join(",")));
    fs::write(folder.join("many.json"), many).unwrap();
    let shown = on_a_terminal(folder, "predict --machine many.json --recording r.csv --out p.csv");
    assert!(shown.contains(" s predicting axis x") && shown.ends_with("\r\x1b[K"), "{shown:?}");
}

#[test]
fn a_prediction_has_a_row_for_each_that_was_read_and_says_what_it_left_out() {
    let folder = folder();
    let folder = folder.path();
    let text = fs::read_to_string(folder.join("r.csv")).unwrap();
    let mut lines: Vec<String> = text.lines().take(5000).map(str::to_owned).collect();
    // A spoilt torque in row 4001, and row 3000 three times.
    let (kept, _) = lines[4000].rsplit_once(',').unwrap();
    lines[4000] = format!("{kept},5000");
    let repeated = lines[2999].clone();
    lines.splice(3000..3000, [repeated.clone(), repeated.clone()]);
    fs::write(folder.join("spoilt.csv"), lines.join("\n")).unwrap();
    let said = gib(folder, "predict --machine m.json --recording spoilt.csv --out p.csv");
    let text = String::from_utf8_lossy(&said.stdout);
    for told in ["2 rows repeat the time", "5001 rows written", "x.torque_nm: is 5000"] {
        assert!(text.contains(told), "{text}");
    }
    let predicted = fs::read_to_string(folder.join("p.csv")).unwrap();
    let predicted: Vec<Vec<&str>> = predicted.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(predicted.len(), lines.len());
    for (row, (given, predicted)) in lines.iter().zip(&predicted).enumerate().skip(1) {
        let time = |cell: &str| cell.parse::<f64>().unwrap();
        assert_eq!(time(given.split(',').next().unwrap()), time(predicted[0]), "row {}", row + 1);
        assert_eq!(predicted.len(), 6, "row {}", row + 1);
        let empty = predicted[1..].iter().all(|cell| cell.is_empty());
        assert_eq!(empty, row == 3000 || row == 3001, "row {}", row + 1);
    }
}
