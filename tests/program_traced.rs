//! A writer of a part program that is killed at any system call leaves the old program or the new one, whole.
//!
//! Each run traces `gib program …` with ptrace, which stops it before and after every system call, and kills it at one
//! of these stops; run after run, at every stop there is. Two more laws are tested on the same trace: the new program
//! is on the disk before it gets its name, and the name before the command says done; and what an editor saves while
//! gib is at work is not lost.
#![cfg(target_os = "linux")]

use std::fs;
use std::io::Error;
use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// A stop of the traced process: before or after one of its system calls.
struct Stop {
    pid: libc::pid_t,
    entry: bool,
    call: libc::c_long,
    /// First argument: the file descriptor for write and fsync.
    first: u64,
}

impl Stop {
    /// The file behind the call's first argument.
    fn file(&self) -> PathBuf {
        fs::read_link(format!("/proc/{}/fd/{}", self.pid, self.first)).unwrap_or_default()
    }
}

#[allow(clippy::zombie_processes)] // waitpid has reaped what ran to its end
/// Runs a command under ptrace; `go_on` sees every stop and kills the command by saying no. True if it ran to its end.
fn traced(command: &mut Command, mut go_on: impl FnMut(&Stop) -> bool) -> bool {
    // SAFETY: ptrace is a plain system call, as is allowed between fork and exec.
    unsafe {
        command.pre_exec(|| if libc::ptrace(libc::PTRACE_TRACEME) == 0 { Ok(()) } else { Err(Error::last_os_error()) })
    };
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let pid = child.id() as libc::pid_t;
    let mut status = 0;
    // SAFETY: `pid` is our own child, not yet waited for; `status` and `info` outlive the calls.
    unsafe {
        assert_eq!(libc::waitpid(pid, &mut status, 0), pid);
        let options = libc::PTRACE_O_TRACESYSGOOD | libc::PTRACE_O_EXITKILL;
        assert_eq!(libc::ptrace(libc::PTRACE_SETOPTIONS, pid, 0, options), 0, "{}", Error::last_os_error());
        loop {
            assert_eq!(libc::ptrace(libc::PTRACE_SYSCALL, pid, 0, 0), 0, "{}", Error::last_os_error());
            assert_eq!(libc::waitpid(pid, &mut status, 0), pid);
            if !libc::WIFSTOPPED(status) {
                return libc::WIFEXITED(status);
            }
            if libc::WSTOPSIG(status) != libc::SIGTRAP | 0x80 {
                continue;
            }
            let mut info: libc::ptrace_syscall_info = std::mem::zeroed();
            let size = size_of_val(&info);
            assert!(
                libc::ptrace(libc::PTRACE_GET_SYSCALL_INFO, pid, size, &mut info) > 0,
                "{}",
                Error::last_os_error()
            );
            let entry = info.op == libc::PTRACE_SYSCALL_INFO_ENTRY;
            let (call, first) = if entry { (info.u.entry.nr as libc::c_long, info.u.entry.args[0]) } else { (-1, 0) };
            if !go_on(&Stop { pid, entry, call, first }) {
                child.kill().unwrap();
                child.wait().unwrap();
                return false;
            }
        }
    }
}

/// What is tested: how the program looks before, the command that changes it, and how it looks afterwards.
struct Case<'a> {
    old: &'a [u8],
    new: &'a [u8],
    /// Left beside the program by an earlier victim.
    leavings: bool,
    command: &'a dyn Fn(&Path) -> Command,
}

fn gib(words: &str, program: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_gib"));
    let (action, rest) = words.split_once(' ').unwrap_or((words, ""));
    command.args(["program", action]).arg(program).args(rest.split_whitespace());
    command
}

impl Case<'_> {
    fn lay_down(&self, folder: &Path) -> PathBuf {
        let program = folder.join("shaft.nc");
        fs::write(&program, self.old).unwrap();
        fs::set_permissions(&program, fs::Permissions::from_mode(0o640)).unwrap();
        if self.leavings {
            fs::write(folder.join(".shaft.nc.gib"), b"%\nO1\nhalf a prog").unwrap();
        }
        program
    }

    /// Kills at every stop: how often the old and the new program were found. An error names the first torn one.
    fn kill_everywhere(&self) -> Result<(usize, usize), String> {
        let (mut old, mut new) = (0, 0);
        for last in 0.. {
            let folder = tempfile::tempdir().unwrap();
            let program = self.lay_down(folder.path());
            let mut stops = 0;
            let ended = traced(&mut (self.command)(&program), |_| {
                stops += 1;
                stops <= last
            });
            let found = fs::read(&program).unwrap();
            match (found == self.old, found == self.new) {
                (true, _) => old += 1,
                (_, true) => new += 1,
                _ => return Err(format!("torn at stop {last}: {} bytes", found.len())),
            }
            if ended {
                assert_eq!(found, self.new, "the command did not do its work");
                return Ok((old, new));
            }
            // The next writer finishes the work and leaves nothing else behind.
            let again = (self.command)(&program).output().unwrap();
            assert!(again.status.success(), "after stop {last}: {again:?}");
            assert_eq!(fs::read(&program).unwrap(), self.new, "after stop {last}");
            assert_eq!(fs::metadata(&program).unwrap().permissions().mode() & 0o7777, 0o640, "after stop {last}");
            assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "after stop {last}");
        }
        unreachable!("a command ends")
    }
}

/// Large enough for several reads and writes.
fn program(head: &str) -> Vec<u8> {
    let body: String = (0..30_000).map(|block| format!("N{block} G1 X{}.5\n", block % 700)).collect();
    format!("%\nO1 (SHAFT)\n{head}{body}M30\n%\n").into_bytes()
}

fn both_seen(case: &Case, name: &str) {
    let (old, new) = case.kill_everywhere().unwrap();
    println!("{name}: killed at {} stops, program old {old} times, new {new} times, torn never", old + new - 1);
    assert!(old > 20 && new > 2, "{name}: old {old}, new {new}");
}

#[test]
fn a_killed_set_leaves_the_old_or_the_new_program() {
    let (old, new) = (program(""), program("(INA=0.7)\n"));
    let command = |program: &Path| gib("set 0.7", program);
    both_seen(&Case { old: &old, new: &new, leavings: false, command: &command }, "set");
}

#[test]
fn a_killed_change_among_leavings_leaves_the_old_or_the_new_program() {
    let (old, new) = (program("(INA=0.25)\n"), program("(INA=0.7)\n"));
    let command = |program: &Path| gib("set 0.7", program);
    both_seen(&Case { old: &old, new: &new, leavings: true, command: &command }, "change among leavings");
}

#[test]
fn a_killed_remove_leaves_the_old_or_the_new_program() {
    let (old, new) = (program("(INA=0.25)\n(INA2=0.2)\n"), program("(INA=0.25)\n"));
    let command = |program: &Path| gib("remove --step 2", program);
    both_seen(&Case { old: &old, new: &new, leavings: false, command: &command }, "remove");
}

/// The gate itself: a writer that overwrites in place must be caught.
#[test]
fn a_writer_that_tears_is_caught() {
    let (old, new) = (program(""), program("(INA=0.7)\n"));
    let folder = tempfile::tempdir().unwrap();
    let source = folder.path().join("new.nc");
    fs::write(&source, &new).unwrap();
    let command = |program: &Path| {
        let mut command = Command::new("cp");
        command.arg("--no-preserve=mode").arg(&source).arg(program);
        command
    };
    let torn = Case { old: &old, new: &new, leavings: false, command: &command }.kill_everywhere();
    assert!(torn.is_err(), "{torn:?}");
}

/// What reaches the disk, in order: `w` the new program written, `s` it is on the disk, `r` renamed, `d` the folder is.
fn order(command: &mut Command, program: &Path) -> String {
    let mut order = String::new();
    let folder = program.parent().unwrap().canonicalize().unwrap();
    let ended = traced(command, |stop| {
        let file = if stop.entry { stop.file() } else { PathBuf::new() };
        order += match stop.call {
            libc::SYS_write if file.starts_with(&folder) => "w",
            libc::SYS_fsync if file == folder => "d",
            libc::SYS_fsync if file.starts_with(&folder) => "s",
            libc::SYS_rename | libc::SYS_renameat | libc::SYS_renameat2 => "r",
            _ => "",
        };
        true
    });
    assert!(ended);
    order
}

#[test]
fn the_new_program_is_on_the_disk_before_its_name_and_the_name_before_the_end() {
    let folder = tempfile::tempdir().unwrap();
    let (old, new) = (program(""), program("(INA=0.7)\n"));
    let shaft = folder.path().join("shaft.nc");
    fs::write(&shaft, &old).unwrap();
    let order_of_gib = order(&mut gib("set 0.7", &shaft), &shaft);
    assert!(order_of_gib.starts_with("ww") && order_of_gib.trim_start_matches('w') == "srd", "{order_of_gib}");
    assert_eq!(fs::read(&shaft).unwrap(), new);
    assert_eq!(order(&mut gib("set 0.7", &shaft), &shaft), "", "nothing to change, nothing written");

    // The gate itself: a rename without these is seen.
    let side = folder.path().join("side");
    fs::write(&side, &old).unwrap();
    let order_of_mv = order(Command::new("mv").arg(&side).arg(&shaft), &shaft);
    assert!(order_of_mv.contains('r') && !order_of_mv.contains('s') && !order_of_mv.contains('d'), "{order_of_mv}");
}

/// Runs `gib program set` while an editor, which knows no lock, saves the program whenever gib has just written its own.
fn set_while_edited(program: &Path, mut save: impl FnMut(u32)) -> u32 {
    let mut saved = 0;
    let ended = traced(&mut gib("set 0.7", program), |stop| {
        if stop.entry && stop.call == libc::SYS_fsync && stop.file().is_file() {
            saved += 1;
            save(saved);
        }
        true
    });
    assert!(ended);
    saved
}

#[test]
fn what_an_editor_saves_meanwhile_is_not_lost() {
    let folder = tempfile::tempdir().unwrap();
    let shaft = folder.path().join("shaft.nc");
    let (edited, edited_and_set) = (program("(EDITED)\n"), program("(INA=0.7)\n(EDITED)\n"));
    let replaced = |_: &Path| {
        let save = folder.path().join("save");
        fs::write(&save, &edited).unwrap();
        fs::rename(&save, &shaft).unwrap();
    };
    let in_place = |_: &Path| fs::write(&shaft, &edited).unwrap();
    for save in [&replaced as &dyn Fn(&Path), &in_place] {
        fs::write(&shaft, program("")).unwrap();
        let rounds = set_while_edited(&shaft, |round| {
            if round == 1 {
                save(&shaft)
            }
        });
        assert_eq!(rounds, 2, "once for nothing, once with what the editor saved");
        assert!(fs::read(&shaft).unwrap() == edited_and_set);
    }
}

#[test]
fn a_program_that_changes_all_the_time_is_given_up_unharmed() {
    let folder = tempfile::tempdir().unwrap();
    let shaft = folder.path().join("shaft.nc");
    fs::write(&shaft, program("")).unwrap();
    let rounds = set_while_edited(&shaft, |round| fs::write(&shaft, format!("({round})\nM30\n")).unwrap());
    assert_eq!(fs::read_to_string(&shaft).unwrap(), format!("({rounds})\nM30\n"));
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "nothing left beside it");
}

/// The narrow moment of the lock: between opening the file beside and locking it, another writer has made it the
/// program, and a third has begun anew under its name.
#[test]
fn a_lock_on_what_no_longer_bears_the_name_is_no_lock() {
    let folder = tempfile::tempdir().unwrap();
    let (shaft, side) = (folder.path().join("shaft.nc"), folder.path().join(".shaft.nc.gib"));
    fs::write(&shaft, program("")).unwrap();
    fs::write(&side, program("(INA2=0.2)\n")).unwrap();
    let (mut third, mut waits) = (None, 0);
    let ended = traced(&mut gib("set 0.7", &shaft), |stop| {
        if stop.entry && stop.call == libc::SYS_flock && waits == 0 && third.is_none() {
            fs::rename(&side, &shaft).unwrap();
            fs::write(&side, program("(INA2=0.2)\n(INA3=0.3)\n")).unwrap();
            let file = fs::File::open(&side).unwrap();
            rustix::fs::flock(&file, rustix::fs::FlockOperation::LockExclusive).unwrap();
            third = Some(file);
        }
        if stop.entry && stop.call == libc::SYS_clock_nanosleep {
            waits += 1;
            if waits == 3 {
                fs::rename(&side, &shaft).unwrap();
                third = None;
            }
        }
        true
    });
    assert!(ended && waits >= 3, "waited {waits} times");
    assert!(fs::read(&shaft).unwrap() == program("(INA=0.7)\n(INA2=0.2)\n(INA3=0.3)\n"));
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}
