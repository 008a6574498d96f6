//! Replaces a part program as a whole or not at all, keeps its owner and mode, and loses nobody's work.
//!
//! The new program is written beside the old one (`.NAME.gib`), brought to the disk, and renamed over it; the
//! directory is opened once and all names are taken from there. Killed at any moment, the program is the old or the
//! new one. The file beside is also the lock: whoever holds it (`flock`) and finds it under its name may write; the
//! lock ends with its process, so that what a killed writer left behind is cleared away by the next one. Writers that
//! know nothing of this lock (an editor) are noticed when the program is no longer the file that was read; then all
//! is done again from what they wrote.

use super::edit::Splice;
use super::error::Problem;
use rustix::fs::{self, AtFlags, FileType, FlockOperation, Gid, Mode, OFlags, Stat, Uid, XattrFlags};
use rustix::io::{Errno, Result as SysResult};
use std::ffi::{OsStr, OsString};
use std::fs::File;
use std::io::{ErrorKind, Read, Seek, SeekFrom, Write};
use std::os::fd::OwnedFd;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// How long another writer is waited for: some 500 MB programs on a slow disk.
const WAIT: Duration = Duration::from_secs(60);
const POLL: Duration = Duration::from_millis(5);
/// How often the work is begun again because somebody without the lock changed the program.
const ATTEMPTS: u32 = 5;

/// Opens a program for reading only; links are followed, devices and pipes are not waited for.
pub(super) fn open_to_read(path: &Path) -> Result<File, Problem> {
    let flags = OFlags::RDONLY | OFlags::NONBLOCK | OFlags::CLOEXEC;
    let file = File::from(fs::open(path, flags, Mode::empty()).map_err(failed("open the program"))?);
    let status = fs::fstat(&file).map_err(failed("look at the program"))?;
    if is_file(&status) { Ok(file) } else { Err(Problem::NotAFile) }
}

/// Replaces the program by what `plan` makes of it, and says whether there was anything to change.
///
/// `plan` reads the program from its start; it is asked again when somebody changed the program meanwhile.
pub(super) fn edit(
    path: &Path,
    mut plan: impl FnMut(&mut File) -> Result<Option<Splice>, Problem>,
) -> Result<bool, Problem> {
    let folder = Folder::of(path)?;
    folder.open_program()?; // what cannot be opened is said before anything is made beside it
    for _ in 0..ATTEMPTS {
        let mut side = folder.claim_side()?;
        let (mut program, status) = folder.open_program()?;
        let Some(splice) = plan(&mut program)? else { return Ok(false) };
        write_spliced(&mut program, &mut side.file, &splice)?;
        dress(&program, &status, &side.file)?;
        side.file.sync_all().map_err(io_failed("bring the new program to the disk"))?;
        if folder.is_unchanged(&status)? {
            side.rename()?;
            fs::fsync(&folder.directory).map_err(failed("bring the folder to the disk"))?;
            return Ok(true);
        }
    }
    Err(Problem::Changed)
}

/// The open directory of a program, and the names of the program and of the file beside it.
struct Folder {
    directory: OwnedFd,
    path: PathBuf,
    name: OsString,
    side: OsString,
}

impl Folder {
    fn of(path: &Path) -> Result<Folder, Problem> {
        // "a.nc/" names a directory, which `file_name` would hide.
        let name = path.file_name().filter(|name| path.as_os_str().as_bytes().ends_with(name.as_bytes()));
        let name = name.ok_or(Problem::NotAFile)?.to_owned();
        let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let flags = OFlags::RDONLY | OFlags::DIRECTORY | OFlags::CLOEXEC;
        let directory = fs::open(parent, flags, Mode::empty()).map_err(failed("open the program's folder"))?;
        let side = side_of(&name);
        Ok(Folder { directory, path: parent.to_owned(), name, side })
    }

    /// Opens the program itself, never what a link leads to.
    fn open_program(&self) -> Result<(File, Stat), Problem> {
        // Opened for writing though only read: a write-protected program must not be replaced behind its protection.
        let flags = OFlags::RDWR | OFlags::NOFOLLOW | OFlags::NONBLOCK | OFlags::CLOEXEC;
        let file = match fs::openat(&self.directory, &self.name, flags, Mode::empty()) {
            Ok(file) => File::from(file),
            Err(Errno::LOOP) => {
                let target =
                    fs::readlinkat(&self.directory, &self.name, Vec::new()).map_err(failed("read the link"))?;
                return Err(Problem::Link { target: OsStr::from_bytes(target.as_bytes()).into() });
            }
            Err(Errno::ISDIR | Errno::NXIO) => return Err(Problem::NotAFile),
            Err(error) => return Err(failed("open the program for writing")(error)),
        };
        let status = fs::fstat(&file).map_err(failed("look at the program"))?;
        if is_file(&status) { Ok((file, status)) } else { Err(Problem::NotAFile) }
    }

    /// Makes the file beside the program, alone among all writers, new and empty.
    fn claim_side(&self) -> Result<Side<'_>, Problem> {
        let deadline = Instant::now() + WAIT;
        loop {
            if let Some(file) = self.try_claim().map_err(failed("write beside the program"))? {
                return Ok(Side { folder: self, file, renamed: false });
            }
            if Instant::now() >= deadline {
                return Err(Problem::Busy { waited_s: WAIT.as_secs(), side: self.path.join(&self.side) });
            }
            sleep(POLL);
        }
    }

    /// `None` while another writer is at work, or when its leavings were just cleared away.
    fn try_claim(&self) -> SysResult<Option<File>> {
        let flags = OFlags::RDWR | OFlags::NOFOLLOW | OFlags::NONBLOCK | OFlags::CLOEXEC;
        let mode = Mode::RUSR | Mode::WUSR;
        let (file, new) = match fs::openat(&self.directory, &self.side, flags | OFlags::CREATE | OFlags::EXCL, mode) {
            Ok(file) => (file, true),
            Err(Errno::EXIST) => match fs::openat(&self.directory, &self.side, flags, Mode::empty()) {
                Ok(file) => (file, false),
                Err(Errno::NOENT) => return Ok(None),
                Err(error) => return Err(error),
            },
            Err(error) => return Err(error),
        };
        match fs::flock(&file, FlockOperation::NonBlockingLockExclusive) {
            Ok(()) => {}
            Err(Errno::WOULDBLOCK) => return Ok(None),
            Err(error) => return Err(error),
        }
        // Between open and lock the name may have gone to another file: only the lock on what bears the name counts.
        if !self.names(&self.side, &fs::fstat(&file)?)? {
            return Ok(None);
        }
        if new {
            return Ok(Some(file.into()));
        }
        // Left by a killed writer. Made anew rather than reused: only a file of our own making is ever written.
        fs::unlinkat(&self.directory, &self.side, AtFlags::empty())?;
        Ok(None)
    }

    fn names(&self, name: &OsStr, file: &Stat) -> SysResult<bool> {
        match fs::statat(&self.directory, name, AtFlags::SYMLINK_NOFOLLOW) {
            Ok(found) => Ok((found.st_dev, found.st_ino) == (file.st_dev, file.st_ino)),
            Err(Errno::NOENT) => Ok(false),
            Err(error) => Err(error),
        }
    }

    /// The program is still the file that was read, and nobody wrote into it or changed its owner or mode.
    fn is_unchanged(&self, read: &Stat) -> Result<bool, Problem> {
        let now = match fs::statat(&self.directory, &self.name, AtFlags::SYMLINK_NOFOLLOW) {
            Err(Errno::NOENT) => return Ok(false),
            now => now.map_err(failed("look at the program"))?,
        };
        let version =
            |s: &Stat| (s.st_dev, s.st_ino, s.st_size, s.st_mtime, s.st_mtime_nsec, s.st_ctime, s.st_ctime_nsec);
        Ok(version(&now) == version(read))
    }
}

/// `.NAME.gib`; of a name that leaves no room for that as much as fits, and a number made of the whole (FNV-1a).
fn side_of(name: &OsStr) -> OsString {
    const LONGEST: usize = 255 - ".".len() - ".gib".len();
    let bytes = name.as_bytes();
    if bytes.len() <= LONGEST {
        return [OsStr::new("."), name, OsStr::new(".gib")].into_iter().collect();
    }
    let hash = bytes
        .iter()
        .fold(0xcbf2_9ce4_8422_2325u64, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3));
    let number = format!("{hash:016x}");
    let kept = bytes.get(..LONGEST - number.len()).unwrap_or_default();
    [b".", kept, number.as_bytes(), b".gib"].map(OsStr::from_bytes).into_iter().collect()
}

/// The locked file beside the program; it goes with its owner unless it has become the program.
struct Side<'a> {
    folder: &'a Folder,
    file: File,
    renamed: bool,
}

impl Side<'_> {
    fn rename(mut self) -> Result<(), Problem> {
        let directory = &self.folder.directory;
        fs::renameat(directory, &self.folder.side, directory, &self.folder.name)
            .map_err(failed("put the new program in its place"))?;
        self.renamed = true;
        Ok(())
    }
}

impl Drop for Side<'_> {
    fn drop(&mut self) {
        if !self.renamed {
            // If this fails, the next writer clears it away.
            let _ = fs::unlinkat(&self.folder.directory, &self.folder.side, AtFlags::empty());
        }
    }
}

fn is_file(status: &Stat) -> bool {
    FileType::from_raw_mode(status.st_mode) == FileType::RegularFile
}

/// Copies the program with its change, in bounded memory.
fn write_spliced(program: &mut File, side: &mut File, splice: &Splice) -> Result<(), Problem> {
    program.seek(SeekFrom::Start(0)).map_err(io_failed("read the program"))?;
    copy(&mut Read::by_ref(program).take(splice.at), side)?;
    side.write_all(&splice.insert).map_err(io_failed("write the new program"))?;
    program.seek(SeekFrom::Start(splice.at + splice.delete)).map_err(io_failed("read the program"))?;
    copy(program, side)
}

/// Copies to the end. A NUL byte is refused: the file is binary, or has a hole from a power cut.
fn copy(from: &mut impl Read, to: &mut File) -> Result<(), Problem> {
    let mut buffer = vec![0; 256 * 1024];
    loop {
        let read = match from.read(&mut buffer) {
            Ok(0) => return Ok(()),
            Ok(read) => buffer.get(..read).unwrap_or_default(),
            Err(error) if error.kind() == ErrorKind::Interrupted => continue,
            Err(error) => return Err(io_failed("read the program")(error)),
        };
        if read.contains(&0) {
            return Err(Problem::NotText { found: "a NUL byte" });
        }
        to.write_all(read).map_err(io_failed("write the new program"))?;
    }
}

/// Gives the new file the old one's owner, attributes and mode. In this order: a change of owner takes away set-id bits,
/// and an access list without its mode, or a mode without its list, would let in others.
fn dress(old: &File, status: &Stat, new: &File) -> Result<(), Problem> {
    let bare = fs::fstat(new).map_err(failed("look at the new program"))?;
    if (bare.st_uid, bare.st_gid) != (status.st_uid, status.st_gid) {
        let (uid, gid) = (status.st_uid, status.st_gid);
        fs::fchown(new, Some(Uid::from_raw(uid)), Some(Gid::from_raw(gid))).map_err(|error| Problem::Owner {
            uid,
            gid,
            source: error.into(),
        })?;
    }
    copy_attributes(old, new).map_err(failed("keep the program's access list and attributes"))?;
    let mode = Mode::from_raw_mode(status.st_mode);
    // A stick with a DOS file system has no modes to set.
    if Mode::from_raw_mode(bare.st_mode) != mode {
        fs::fchmod(new, mode).map_err(failed("keep the program's mode"))?;
    }
    Ok(())
}

/// The same for any file that is replaced by another.
///
/// # Errors
/// The system's, where one of them cannot be kept.
pub fn dressed(old: &File, new: &File) -> std::io::Result<()> {
    dress(old, &fs::fstat(old)?, new).map_err(|problem| match problem {
        Problem::Io { source, .. } | Problem::Owner { source, .. } => source,
        _ => ErrorKind::Other.into(),
    })
}

/// Copies what users see: the access list and `user.…`; the rest is the system's own to give.
fn copy_attributes(old: &File, new: &File) -> SysResult<()> {
    let names = match attribute(|buffer| fs::flistxattr(old, buffer)) {
        Err(Errno::NOTSUP | Errno::NOSYS) => return Ok(()),
        names => names?,
    };
    for name in names.split(|byte| *byte == 0) {
        if name.starts_with(b"user.") || name == b"system.posix_acl_access" {
            let value = attribute(|buffer| fs::fgetxattr(old, name, buffer))?;
            fs::fsetxattr(new, name, &value, XattrFlags::empty())?;
        }
    }
    Ok(())
}

/// Reads an attribute of any length; Linux has none beyond 64 KiB.
fn attribute(read: impl Fn(&mut [u8]) -> SysResult<usize>) -> SysResult<Vec<u8>> {
    let mut buffer = vec![0; 64 * 1024];
    let length = read(&mut buffer)?;
    buffer.truncate(length);
    Ok(buffer)
}

fn failed(doing: &'static str) -> impl Fn(Errno) -> Problem {
    move |error| Problem::Io { doing, source: error.into() }
}

fn io_failed(doing: &'static str) -> impl Fn(std::io::Error) -> Problem {
    move |source| Problem::Io { doing, source }
}
