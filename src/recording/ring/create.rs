//! Makes the shared memory of a recorder: of the right size, with memory behind all of it, for one writer only.

use std::fs::File;
use std::os::unix::fs::MetadataExt;
use std::path::Path;

use rustix::fs::{FallocateFlags, FlockOperation, Mode, OFlags, fallocate, fchmod, flock, open, unlink};
use rustix::io::Errno;

use crate::cycle::recorder::layout::{COLUMNS_BYTES, MACHINE_BYTES, MAGIC, Shape};
use crate::error::{
    Fault, GIB_ERR_CONFIG, GIB_ERR_IO, GIB_ERR_MEMORY, GIB_ERR_RECORDER_COLUMN, GIB_ERR_RECORDER_FOREIGN,
    GIB_ERR_RECORDER_IN_USE,
};
use crate::recording::{Name, ring};

/// What a writer asks for.
#[derive(Debug, Clone, Copy)]
pub struct Wanted<'a> {
    /// The recorder's name.
    pub name: &'a str,
    /// The machine's name, for the readers: letters, digits, `-`, `_`.
    pub machine: &'a str,
    /// Names of the columns, separated by commas.
    pub columns: &'a str,
    /// Permissions of the shared memory, such as 0o600.
    pub mode: u32,
    /// Its numbers.
    pub shape: Shape,
}

/// Shared memory that this process alone may write; it stays so while `file` is open.
#[derive(Debug)]
pub struct Created {
    /// The shared memory, `shape.words()` words of 8 bytes, all zero.
    pub file: File,
}

/// Removes the name; who has it open, keeps it.
pub fn remove(name: &str) {
    let _ = unlink(ring::path(name));
}

/// Makes the shared memory, in place of one that a dead writer left.
///
/// # Errors
/// `GIB_ERR_CONFIG` for a name or mode, `GIB_ERR_RECORDER_COLUMN` with the number of the column, `GIB_ERR_RECORDER_IN_USE`
/// while another writer lives, `GIB_ERR_RECORDER_FOREIGN` when the name belongs to something else, `GIB_ERR_MEMORY`,
/// `GIB_ERR_IO`.
pub fn create(wanted: &Wanted) -> Result<Created, Fault> {
    check(wanted)?;
    // A reader that looks whether a writer lives holds the lock for a moment; hence more tries than one.
    let mut left = 20;
    let file = loop {
        match place(wanted) {
            Err(fault) if fault.code == GIB_ERR_RECORDER_IN_USE && left > 0 => left -= 1,
            result => break result?,
        }
        std::thread::sleep(std::time::Duration::from_millis(1));
    };
    Ok(Created { file })
}

fn check(wanted: &Wanted) -> Result<(), Fault> {
    let config = |field, value: usize, high: usize| Fault {
        code: GIB_ERR_CONFIG,
        field,
        value: value as f64,
        low: 1.0,
        high: high as f64,
    };
    // Of a text or number within its range the place of what is wrong, or the number itself, and no range.
    let spelled = |field, value: usize| Fault { field, value: value as f64, ..Fault::of(GIB_ERR_CONFIG) };
    let named = |field, name: &str, dots: &str| {
        let fit =
            |(at, c): (usize, char)| c.is_ascii_alphanumeric() || "-_".contains(c) || (at > 0 && dots.contains(c));
        match name.char_indices().find(|at| !fit(*at)) {
            Some((at, _)) if name.len() <= ring::NAME_MOST => spelled(field, at + 1),
            _ => config(field, name.len(), ring::NAME_MOST),
        }
    };
    if !ring::is_name(wanted.name) {
        return Err(named("name\0", wanted.name, "."));
    }
    let machine = wanted.machine;
    if !(ring::is_name(machine) && machine.len() < MACHINE_BYTES && !machine.contains('.')) {
        return Err(named("machine\0", machine, ""));
    }
    if wanted.mode & !0o666 != 0 || wanted.mode & 0o600 != 0o600 {
        let within = (0o600..=0o666).contains(&wanted.mode);
        let (value, low) = (wanted.mode as usize, f64::from(0o600));
        return Err(if within { spelled("mode\0", value) } else { Fault { low, ..config("mode\0", value, 0o666) } });
    }
    if wanted.columns.len() >= COLUMNS_BYTES {
        return Err(config("columns\0", wanted.columns.len(), COLUMNS_BYTES - 1));
    }
    columns(wanted.columns, wanted.shape.channels)
}

/// One name a channel, each of the recording's format or outside it, none twice.
fn columns(text: &str, channels: usize) -> Result<(), Fault> {
    let names: Vec<&str> = text.split(',').collect();
    let wrong = |at: usize| Fault { field: "columns\0", value: at as f64 + 1.0, ..Fault::of(GIB_ERR_RECORDER_COLUMN) };
    for (at, name) in names.iter().enumerate() {
        let fit = |c: char| c.is_ascii_alphanumeric() || "._-".contains(c);
        let spelled = !name.is_empty() && name.chars().all(fit);
        let twice = names.iter().take(at).any(|other| other == name);
        if !spelled || twice || *name == "time_s" || matches!(Name::parse(name), Name::WrongUnit { .. }) {
            return Err(wrong(at));
        }
    }
    let (value, wanted) = (names.len() as f64, channels as f64);
    let count = Fault { code: GIB_ERR_RECORDER_COLUMN, field: "columns\0", value, low: wanted, high: wanted };
    if names.len() == channels { Ok(()) } else { Err(count) }
}

const FLAGS: OFlags = OFlags::RDWR.union(OFlags::CLOEXEC).union(OFlags::NOFOLLOW);

fn place(wanted: &Wanted) -> Result<File, Fault> {
    let path = ring::path(wanted.name);
    clear_away(&path)?;
    let opened = open(&path, FLAGS | OFlags::CREATE | OFlags::EXCL, Mode::from_raw_mode(0o600));
    let file = File::from(opened.map_err(|why| system(why, GIB_ERR_RECORDER_IN_USE))?);
    let bytes = 8 * wanted.shape.words() as u64;
    let made = flock(&file, FlockOperation::NonBlockingLockExclusive)
        // With memory behind every page now, a page that is not to be had is an error here, not a signal in the cycle.
        .and_then(|()| fallocate(&file, FallocateFlags::empty(), 0, bytes))
        // The umask of a control program is no business of the operator's.
        .and_then(|()| fchmod(&file, Mode::from_raw_mode(wanted.mode)));
    if let Err(why) = made {
        let _ = unlink(&path);
        return Err(system(why, GIB_ERR_RECORDER_IN_USE));
    }
    Ok(file)
}

/// Removes what a dead writer left under this name.
fn clear_away(path: &Path) -> Result<(), Fault> {
    let file = match open(path, FLAGS, Mode::empty()) {
        Err(Errno::NOENT) => return Ok(()),
        opened => File::from(opened.map_err(|why| system(why, GIB_ERR_RECORDER_FOREIGN))?),
    };
    flock(&file, FlockOperation::NonBlockingLockExclusive).map_err(|why| system(why, GIB_ERR_RECORDER_IN_USE))?;
    let mut first = [0; 8];
    let empty = file.metadata().is_ok_and(|meta| meta.is_file() && meta.size() == 0);
    let ours = std::os::unix::fs::FileExt::read_exact_at(&file, &mut first, 0).is_ok()
        // Left by a writer that died before it wrote the header.
        && (u64::from_ne_bytes(first) == MAGIC || first == [0; 8]);
    if !(ours || empty) {
        return Err(Fault { field: "name\0", ..Fault::of(GIB_ERR_RECORDER_FOREIGN) });
    }
    unlink(path).map_err(|why| system(why, GIB_ERR_RECORDER_FOREIGN))
}

/// What the system refused; `taken` where it says that the name is somebody else's.
fn system(why: Errno, taken: i32) -> Fault {
    let code = match why {
        Errno::EXIST | Errno::AGAIN | Errno::ACCESS | Errno::PERM | Errno::LOOP | Errno::ISDIR => taken,
        Errno::NOSPC | Errno::NOMEM => GIB_ERR_MEMORY,
        _ => GIB_ERR_IO,
    };
    Fault { field: "name\0", value: f64::from(why.raw_os_error()), ..Fault::of(code) }
}
