//! What happens to the file of a part program when INA is written: whose it stays, what is beside it, how long it takes,
//! and that two writers lose nothing.
#![cfg(target_os = "linux")]

use gib::program::{self, Dialect, Problem, Scope};
use rustix::fs::{Mode, OFlags, XattrFlags};
use std::fs::{self, File, Permissions};
use std::io::{Error, Read, Seek, SeekFrom, Write};
use std::os::unix::fs::{MetadataExt, PermissionsExt, symlink};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::Barrier;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

const PROGRAM: &str = "%\nO1 (SHAFT)\nG21\nT1 M6\nM30\n%\n";

fn lay_down(text: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("shaft.nc");
    fs::write(&path, text).unwrap();
    (folder, path)
}

fn gib(arguments: &str, path: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_gib"));
    let (action, rest) = arguments.split_once(' ').unwrap_or((arguments, ""));
    command.args(["program", action]).arg(path).args(rest.split_whitespace());
    command
}

fn said(output: &Output) -> (Option<i32>, String, String) {
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

/// Only the program is in the folder, and it is as it was.
fn untouched(folder: &Path, path: &Path) {
    assert_eq!(fs::read_to_string(path).unwrap(), PROGRAM);
    assert_eq!(fs::read_dir(folder).unwrap().count(), 1, "something was left in {}", folder.display());
}

fn is_root() -> bool {
    // SAFETY: asks and changes nothing.
    unsafe { libc::geteuid() == 0 }
}

#[test]
fn the_command_reads_writes_and_removes() {
    let (_folder, path) = lay_down(PROGRAM);
    let ask = |arguments| said(&gib(arguments, &path).output().unwrap());
    assert_eq!(ask("get").0, Some(1), "none yet");
    assert_eq!(ask("set 0.5").0, Some(0));
    assert_eq!(ask("set 0.25 --step 2").0, Some(0));
    assert_eq!(fs::read_to_string(&path).unwrap(), PROGRAM.replace("T)\n", "T)\n(INA=0.5)\n(INA2=0.25)\n"));
    let (code, text, _) = ask("get");
    assert_eq!(code, Some(0));
    assert_eq!(text, "INA = 0.5 kg·m²  (line 3, iso)\nINA2 = 0.25 kg·m²  (line 4, iso)\n");
    assert_eq!(ask("get --step 3").0, Some(1));
    let json: serde_json::Value = serde_json::from_str(&ask("get --step 2 --json").1).unwrap();
    assert_eq!(json, serde_json::json!([{"step": 2, "inertia_kg_m2": 0.25, "line": 4, "dialect": "iso"}]));
    assert_eq!((ask("remove").0, ask("remove --step 2").0, ask("remove").0), (Some(0), Some(0), Some(0)));
    assert_eq!(fs::read_to_string(&path).unwrap(), PROGRAM);
    for (refused, why) in [
        ("set 0", "0 kg·m²"),
        ("set -1", "-1"),
        ("set NaN", "NaN"),
        ("set 0,5", "'0,5' for '<INERTIA_KG_M2>': a number with a decimal point"),
        ("set 1 --step 10000", "10000"),
    ] {
        let (code, _, text) = ask(refused);
        assert!(code == Some(2) && text.contains(why), "{refused}: {text}");
    }
}

#[test]
fn a_decimal_comma_country_reads_and_writes_a_point() {
    let (_folder, path) = lay_down(PROGRAM);
    let german = |arguments| said(&gib(arguments, &path).env("LC_ALL", "de_DE.UTF-8").output().unwrap());
    assert_eq!(german("set 0.5 --dialect okuma").0, Some(0));
    assert!(fs::read_to_string(&path).unwrap().contains("\nINA=0.5\n"));
    assert!(german("get").1.starts_with("INA = 0.5 kg·m²"));
}

/// LinuxCNC's own interpreter hands the values on to the analogue outputs 0 and 1.
#[test]
fn linuxcnc_takes_what_is_written() {
    let (folder, _) = lay_down(PROGRAM);
    let path = folder.path().join("shaft.ngc");
    fs::write(&path, "%\n(SHAFT)\nM68 E0 Q#<_ina>\nM68 E1 Q#<_ina2>\nM2\n%\n").unwrap();
    program::set(&path, Scope::Program, 0.5, None).unwrap();
    program::set(&path, Scope::Step(2), 0.42, None).unwrap();
    let Ok(output) = Command::new("rs274").arg("-g").arg(&path).current_dir(folder.path()).output() else {
        eprintln!("skipped: no rs274 here (package linuxcnc-uspace)");
        return;
    };
    let (_, text, _) = said(&output);
    assert!(
        text.contains("SET_AUX_OUTPUT_VALUE(0,0.500000)") && text.contains("SET_AUX_OUTPUT_VALUE(1,0.420000)"),
        "{text}"
    );
}

/// Names of up to 255 bytes, which leave the one beside no room for itself.
#[test]
fn a_name_may_have_any_length() {
    for length in [249, 250, 251, 254, 255] {
        let (folder, short) = lay_down(PROGRAM);
        let path = folder.path().join("x".repeat(length - 3) + ".nc");
        fs::rename(short, &path).unwrap();
        assert!(program::set(&path, Scope::Program, 0.5, None).unwrap(), "{length}");
        assert_eq!(program::get(&path, Scope::Program).unwrap().unwrap().inertia_kg_m2, 0.5);
        assert!(program::remove(&path, Scope::Program).unwrap());
        untouched(folder.path(), &path);
    }
}

#[test]
fn nothing_to_change_leaves_even_the_file_as_it_is() {
    let (_folder, path) = lay_down(PROGRAM);
    assert!(program::set(&path, Scope::Program, 0.5, None).unwrap());
    let before = fs::metadata(&path).unwrap();
    assert!(!program::set(&path, Scope::Program, 0.5, Some(Dialect::Okuma)).unwrap());
    assert!(!program::remove(&path, Scope::Step(4)).unwrap());
    let after = fs::metadata(&path).unwrap();
    assert_eq!((after.ino(), after.ctime(), after.ctime_nsec()), (before.ino(), before.ctime(), before.ctime_nsec()));
}

#[test]
fn owner_group_mode_and_attributes_are_kept() {
    for mode in [0o600, 0o640, 0o664, 0o755, 0o444] {
        let (_folder, path) = lay_down(PROGRAM);
        if is_root() {
            std::os::unix::fs::chown(&path, Some(1234), Some(2345)).unwrap();
        } else if mode & 0o200 == 0 {
            continue; // write-protected against us: refused, see below
        }
        fs::set_permissions(&path, Permissions::from_mode(mode)).unwrap();
        let before = fs::metadata(&path).unwrap();
        assert!(program::set(&path, Scope::Program, 0.5, None).unwrap());
        let after = fs::metadata(&path).unwrap();
        assert_ne!(after.ino(), before.ino(), "replaced, not overwritten");
        assert_eq!((after.uid(), after.gid(), after.mode()), (before.uid(), before.gid(), before.mode()));
    }
}

#[test]
fn the_access_list_is_kept() {
    // Version 2; owner rw, user 1234 r, group none, mask r, others none: each a tag, a permission and an id.
    let entries = [(1u16, 6u16, u32::MAX), (2, 4, 1234), (4, 0, u32::MAX), (16, 4, u32::MAX), (32, 0, u32::MAX)];
    let mut list = 2u32.to_le_bytes().to_vec();
    for (tag, permission, id) in entries {
        list.extend([tag.to_le_bytes(), permission.to_le_bytes()].concat());
        list.extend(id.to_le_bytes());
    }
    let (_folder, path) = lay_down(PROGRAM);
    for (name, value) in [("user.drawing", b"4711".to_vec()), ("system.posix_acl_access", list)] {
        if let Err(error) = rustix::fs::setxattr(&path, name, &value, XattrFlags::empty()) {
            eprintln!("{name} skipped, this file system has none: {error}");
            continue;
        }
        let mode = fs::metadata(&path).unwrap().mode();
        let inertia = fs::metadata(&path).unwrap().len() as f64;
        assert!(program::set(&path, Scope::Program, inertia, None).unwrap());
        let mut kept = vec![0; 1000];
        let length = rustix::fs::getxattr(&path, name, &mut kept[..]).unwrap();
        assert_eq!(kept[..length], value, "{name}");
        assert_eq!(fs::metadata(&path).unwrap().mode(), mode, "{name}");
    }
}

/// Runs the command as an ordinary user who owns nothing here; `None` when we cannot change users.
fn as_stranger(arguments: &str, path: &Path) -> Option<Output> {
    if !is_root() {
        eprintln!("skipped: only root can become another user");
        return None;
    }
    // Where the tests are built a stranger may not go.
    let tools = tempfile::tempdir().unwrap();
    fs::set_permissions(tools.path(), Permissions::from_mode(0o755)).unwrap();
    let copy = tools.path().join("gib");
    fs::copy(env!("CARGO_BIN_EXE_gib"), &copy).unwrap();
    let command = gib(arguments, path);
    Some(Command::new(&copy).args(command.get_args()).uid(65534).gid(65534).output().unwrap())
}

#[test]
fn what_a_stranger_may_not_do_is_refused_and_nothing_is_touched() {
    for (folder_mode, file_mode, why) in [
        (0o777, 0o666, "belongs to user"),          // could be replaced, but not as its owner's
        (0o777, 0o644, "open the program"),         // write-protected, although the folder is open to all
        (0o755, 0o666, "write beside the program"), // the folder is closed
    ] {
        let (folder, path) = lay_down(PROGRAM);
        fs::set_permissions(folder.path(), Permissions::from_mode(folder_mode)).unwrap();
        fs::set_permissions(&path, Permissions::from_mode(file_mode)).unwrap();
        let Some(output) = as_stranger("set 0.5", &path) else { return };
        let (code, _, text) = said(&output);
        assert!(code == Some(2) && text.contains(why), "{text}");
        untouched(folder.path(), &path);
    }
}

#[test]
fn a_link_is_read_through_but_never_written_through() {
    let (folder, path) = lay_down(PROGRAM);
    let elsewhere = tempfile::tempdir().unwrap();
    for link in [elsewhere.path().join("link.nc"), folder.path().join("link.nc")] {
        symlink(&path, &link).unwrap();
        let error = program::set(&link, Scope::Program, 0.5, None).unwrap_err();
        assert!(matches!(&error.problem, Problem::Link { target } if *target == path), "{error}");
        assert!(program::remove(&link, Scope::Program).is_err());
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(program::get(&link, Scope::Program).unwrap(), None);
        fs::remove_file(link).unwrap();
    }
    untouched(folder.path(), &path);
}

#[test]
fn what_is_planted_beside_the_program_is_not_written_to() {
    let (folder, path) = lay_down(PROGRAM);
    let elsewhere = tempfile::tempdir().unwrap();
    let victim = elsewhere.path().join("victim");
    fs::write(&victim, "dear").unwrap();
    let side = folder.path().join(".shaft.nc.gib");
    symlink(&victim, &side).unwrap();
    assert!(program::set(&path, Scope::Program, 0.5, None).is_err());
    fs::remove_file(&side).unwrap();
    untouched(folder.path(), &path);
    fs::hard_link(&victim, &side).unwrap();
    assert!(program::set(&path, Scope::Program, 0.5, None).unwrap());
    assert_eq!(fs::read_to_string(&victim).unwrap(), "dear");
}

#[test]
fn what_is_no_file_is_refused_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let pipe = folder.path().join("pipe");
    rustix::fs::mknodat(rustix::fs::CWD, &pipe, rustix::fs::FileType::Fifo, Mode::RWXU, 0).unwrap();
    for path in [&pipe, folder.path(), Path::new("/dev/null"), Path::new("/"), Path::new(""), &pipe.join("")] {
        assert!(program::get(path, Scope::Program).is_err(), "{}", path.display());
        assert!(program::set(path, Scope::Program, 0.5, None).is_err(), "{}", path.display());
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn bytes_that_are_no_text_are_refused_wherever_they_stand() {
    for bytes in [&b"%\nO1\n\0\nM30\n"[..], b"%\nO1\nM30\nX\0", b"\xff\xfeO\x001\x00\n\x00"] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.nc");
        fs::write(&path, bytes).unwrap();
        let error = program::set(&path, Scope::Program, 0.5, None).unwrap_err();
        assert!(matches!(error.problem, Problem::NotText { .. }), "{error}");
        assert_eq!(fs::read(&path).unwrap(), bytes);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}

#[test]
fn a_full_disk_leaves_the_old_program() {
    let text = PROGRAM.replace("M30", &"G1 X1\n".repeat(100_000));
    let (folder, path) = lay_down(&text);
    let mut command = gib("set 0.5", &path);
    // SAFETY: two plain system calls between fork and exec. The kernel then refuses to let a file grow further.
    unsafe {
        command.pre_exec(|| {
            let limit = libc::rlimit { rlim_cur: 300_000, rlim_max: 300_000 };
            libc::signal(libc::SIGXFSZ, libc::SIG_IGN);
            if libc::setrlimit(libc::RLIMIT_FSIZE, &limit) == 0 { Ok(()) } else { Err(Error::last_os_error()) }
        })
    };
    let (code, _, error) = said(&command.output().unwrap());
    assert!(code == Some(2) && error.contains("write the new program"), "{error}");
    assert!(fs::read_to_string(&path).unwrap() == text);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}

const WRITERS: u16 = 12;

/// A long program into which every writer puts the value of its own step, all at once, while a reader looks on; the
/// steps found in the end, and whether the reader saw anything but whole programs.
fn all_at_once(write: impl Fn(&Path, u16) + Sync) -> (Vec<(Scope, f64)>, bool) {
    let rest = format!("T1\n{}M30\n%\n", "G1 X1.5 Y2.5\n".repeat(20_000));
    let (folder, path) = lay_down(&format!("%\nO1\n{rest}"));
    let (writing, whole) = (AtomicBool::new(true), AtomicBool::new(true));
    std::thread::scope(|scope| {
        let look = || {
            while writing.load(Ordering::Relaxed) {
                let seen = fs::read_to_string(&path).unwrap();
                if !(seen.starts_with("%\nO1\n") && seen.ends_with(&rest)) {
                    whole.store(false, Ordering::Relaxed);
                }
            }
        };
        let reader = scope.spawn(look);
        let (path, write) = (&path, &write);
        let writers: Vec<_> = (1..=WRITERS).map(|step| scope.spawn(move || write(path, step))).collect();
        writers.into_iter().for_each(|writer| writer.join().unwrap());
        writing.store(false, Ordering::Relaxed);
        reader.join().unwrap();
    });
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    let found = program::list(&path).unwrap_or_default();
    (found.iter().map(|entry| (entry.scope, entry.inertia_kg_m2)).collect(), whole.into_inner())
}

#[test]
fn many_writers_lose_nothing_and_a_reader_always_sees_a_whole_program() {
    let expected: Vec<_> = (1..=WRITERS).map(|step| (Scope::Step(step), f64::from(step) + 0.5)).collect();
    for round in 0..3 {
        let (found, whole) = all_at_once(|path, step| {
            // Half of them processes, half threads of one process: the lock must hold between all of them.
            if step % 2 == 0 {
                assert!(gib(&format!("set {step}.5 --step {step}"), path).output().unwrap().status.success());
            } else {
                program::set(path, Scope::Step(step), f64::from(step) + 0.5, None).unwrap();
            }
        });
        assert_eq!(found, expected, "round {round}");
        assert!(whole, "round {round}");
    }
}

/// The gate itself: writers that all read before the first one writes, as they do without a lock, must be caught.
#[test]
fn writers_that_lose_work_are_caught() {
    let all_have_read = Barrier::new(WRITERS.into());
    let (found, _) = all_at_once(|path, step| {
        let text = fs::read_to_string(path).unwrap_or_default();
        all_have_read.wait();
        fs::write(path, text.replacen("O1\n", &format!("O1\n(INA{step}={step}.5)\n"), 1)).unwrap();
    });
    assert!(found.len() < usize::from(WRITERS), "{found:?}");
}

#[test]
fn half_a_gigabyte_takes_little_memory() {
    const SIZE: u64 = 500_000_000;
    const MEMORY: u64 = 64 << 20;
    let (folder, path) = lay_down(PROGRAM);
    let block = "N1234567 G1 X123.456 Y-78.901 Z2.345 F1500\r\n".repeat(20_000);
    let mut file = File::options().append(true).open(&path).unwrap();
    let mut size = PROGRAM.len() as u64;
    while size < SIZE {
        file.write_all(block.as_bytes()).unwrap();
        size += block.len() as u64;
    }
    drop(file);
    for arguments in ["set 0.5", "get", "set 0.25", "remove"] {
        let mut command = gib(arguments, &path);
        // SAFETY: one plain system call between fork and exec.
        unsafe {
            command.pre_exec(|| {
                let limit = libc::rlimit { rlim_cur: MEMORY, rlim_max: MEMORY };
                if libc::setrlimit(libc::RLIMIT_AS, &limit) == 0 { Ok(()) } else { Err(Error::last_os_error()) }
            })
        };
        let start = Instant::now();
        let output = command.output().unwrap();
        let seconds = start.elapsed().as_secs_f64();
        assert!(output.status.success(), "{:?}", said(&output));
        println!("{size} bytes, {arguments}: {seconds:.2} s, within {} MiB of address space", MEMORY >> 20);
    }
    assert_eq!(fs::metadata(&path).unwrap().len(), size);
    let mut file = File::from(rustix::fs::open(&path, OFlags::RDONLY, Mode::empty()).unwrap());
    let mut head = vec![0; PROGRAM.len()];
    file.read_exact(&mut head).unwrap();
    assert_eq!(head, PROGRAM.as_bytes());
    file.seek(SeekFrom::End(-(block.len() as i64))).unwrap();
    let mut tail = String::new();
    file.read_to_string(&mut tail).unwrap();
    assert!(tail == block);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}
