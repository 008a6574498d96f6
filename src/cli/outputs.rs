//! The files that a command writes: never one of those it reads, each whole or as it was, all of them or none.
//!
//! What is asked for is checked before the work: no output is an input or another output, by whatever name or link, and its folder
//! can be written. Each is then written beside its place and put there when all are whole. Ctrl-C and a file-size limit are errors
//! while something is written, so that nothing is left beside it; before that there is nothing to leave. What cannot be
//! replaced (a pipe, a device, standard output) is written to as it is.

use std::fs::{self, File, Metadata, OpenOptions, Permissions};
use std::io::{self, BufWriter, Write};
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};
use std::result::Result;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use tempfile::NamedTempFile;

/// Of a command's files those that are not to be lost, and those that it writes.
pub struct Outputs {
    inputs: Vec<(&'static str, Identity)>,
    files: Vec<Output>,
    /// Set by Ctrl-C once something is being written.
    stop: Option<Arc<AtomicBool>>,
}

/// What a file is filled through.
pub type Sink<'a> = BufWriter<Box<dyn Write + 'a>>;

struct Output {
    option: &'static str,
    given: PathBuf,
    place: Place,
}

enum Place {
    /// Where the answer goes, too: through the same door, so that neither writes over the other.
    StandardOutput,
    /// A pipe or a device.
    AsItIs,
    File {
        target: PathBuf,
        permissions: Permissions,
        written: Option<NamedTempFile>,
    },
}

/// What makes two names one file.
#[derive(PartialEq)]
enum Identity {
    /// Device and inode.
    There(u64, u64),
    /// Where it is going to be.
    Planned(PathBuf),
}

impl Identity {
    /// `None` for what holds nothing that could be lost.
    fn of(path: &Path) -> Option<Self> {
        // What a pipe's link says is no name of a file, so that it is asked for itself.
        match fs::metadata(path) {
            Ok(there) if there.is_file() => Some(Self::There(there.dev(), there.ino())),
            Ok(_) => None,
            Err(_) => Some(Self::Planned(target_of(path))),
        }
    }
}

impl Outputs {
    /// Of a command that reads these files, each by the option that names it.
    pub fn beside(inputs: &[(&'static str, Option<&Path>)]) -> Self {
        let of = |&(option, path): &(&'static str, Option<&Path>)| Some((option, Identity::of(path?)?));
        Self { inputs: inputs.iter().filter_map(of).collect(), files: Vec::new(), stop: None }
    }

    /// A file that an option asks for, if it does.
    ///
    /// # Errors
    /// It is an input or another output, or cannot be written.
    pub fn add(&mut self, option: &'static str, path: Option<&Path>) -> Result<(), String> {
        let Some(given) = path else { return Ok(()) };
        let said = |why: &str| format!("{option} {}: {why}", given.display());
        if let Some(identity) = Identity::of(given) {
            if let Some((input, _)) = self.inputs.iter().find(|(_, other)| *other == identity) {
                return Err(said(&format!("is the file that {input} reads; it would be lost; give another name")));
            }
            let same = |other: &&Output| match &other.place {
                Place::File { target, .. } => Identity::of(target).as_ref() == Some(&identity),
                _ => false,
            };
            if let Some(other) = self.files.iter().find(same) {
                return Err(said(&format!("is the file that {} writes; one of the two would be lost", other.option)));
            }
        }
        let place = Place::of(given).map_err(|why| said(&format!("cannot be written: {why}")))?;
        self.files.push(Output { option, given: given.to_owned(), place });
        Ok(())
    }

    /// Writes what an option asked for, if it did; beside its place at first.
    ///
    /// # Errors
    /// The system's, or somebody stopped it; all files are then as they were.
    pub fn write(&mut self, option: &str, fill: impl FnOnce(&mut Sink) -> io::Result<()>) -> Result<(), String> {
        let Some(output) = self.files.iter_mut().find(|output| output.option == option) else { return Ok(()) };
        let stop = match &self.stop {
            Some(stop) => stop,
            None => self.stop.insert(heard().map_err(|why| why.to_string())?),
        };
        output.write(stop, fill).map_err(|why| format!("{}: {why}", output.given.display()))
    }

    /// The same of a picture that is all that is asked for, and puts it in its place.
    ///
    /// # Errors
    /// The system's, or somebody stopped it; the file is then as it was.
    pub fn picture(mut self, option: &str, picture: &str) -> Result<(), String> {
        self.write(option, |out| out.write_all(picture.as_bytes()))?;
        self.commit()
    }

    /// Puts everything in its place.
    ///
    /// # Errors
    /// The system's.
    pub fn commit(self) -> Result<(), String> {
        if self.stop.is_some_and(|stop| stop.load(Ordering::Relaxed)) {
            return Err(STOPPED.into());
        }
        for output in &self.files {
            if let Place::File { written: Some(file), .. } = &output.place {
                file.as_file().sync_all().map_err(|why| format!("{}: {why}", output.given.display()))?;
            }
        }
        for output in self.files {
            if let Place::File { target, written: Some(file), .. } = output.place {
                file.persist(target).map_err(|why| format!("{}: {}", output.given.display(), why.error))?;
            }
        }
        Ok(())
    }
}

impl Place {
    fn of(given: &Path) -> io::Result<Self> {
        // What a process has open already is written to, whatever it is.
        let open_already = ["/dev/fd", "/dev/stderr", "/proc"].iter().any(|folder| given.starts_with(folder));
        let there = fs::metadata(given).ok();
        let target = target_of(given);
        match &there {
            Some(there) if is_standard_output(there) => return Ok(Self::StandardOutput),
            Some(there) if there.is_dir() => return Err(io::ErrorKind::IsADirectory.into()),
            Some(there) if open_already || !there.is_file() => return Ok(Self::AsItIs),
            // One that is write-protected is not replaced behind its protection.
            Some(_) => _ = OpenOptions::new().append(true).open(&target)?,
            None => {}
        }
        let folder = target.parent().unwrap_or(Path::new("/"));
        if target.file_name().is_none() || given.as_os_str().as_encoded_bytes().ends_with(b"/") {
            return Err(io::ErrorKind::IsADirectory.into());
        }
        tempfile::tempfile_in(folder).map_err(|why| io::Error::new(why.kind(), format!("in its folder: {why}")))?;
        let permissions = there.map_or(Permissions::from_mode(0o666), |there| there.permissions());
        Ok(Self::File { target, permissions, written: None })
    }
}

impl Output {
    fn write(&mut self, stop: &AtomicBool, fill: impl FnOnce(&mut Sink) -> io::Result<()>) -> io::Result<()> {
        let fill_all = |to: Box<dyn Write + '_>| {
            let mut sink = BufWriter::with_capacity(64 * 1024, to);
            let filled = fill(&mut sink).and_then(|()| sink.flush());
            // What is left is not tried again.
            filled.inspect_err(|_| _ = sink.into_parts())
        };
        match &mut self.place {
            Place::StandardOutput => fill_all(Box::new(io::stdout())),
            Place::AsItIs => fill_all(Box::new(OpenOptions::new().write(true).truncate(true).open(&self.given)?)),
            Place::File { target, permissions, written } => {
                let folder = target.parent().unwrap_or(Path::new("/"));
                let beside =
                    tempfile::Builder::new().prefix(".gib-").permissions(permissions.clone()).tempfile_in(folder)?;
                // A file that was there keeps its mode; a new one has what the user's mask leaves.
                if target.exists() {
                    beside.as_file().set_permissions(permissions.clone())?;
                }
                fill_all(Box::new(Stoppable { file: beside.as_file(), stop }))?;
                *written = Some(beside);
                Ok(())
            }
        }
    }
}

const STOPPED: &str = "stopped; nothing was written";

/// Set by Ctrl-C, which ends the program no longer from now on. Nor does a file that grows too large, which is an error of the write.
fn heard() -> io::Result<Arc<AtomicBool>> {
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM, SIGHUP] {
        signal_hook::flag::register(signal, Arc::clone(&stop))?;
    }
    signal_hook::flag::register(rustix::process::Signal::XFSZ.as_raw(), Arc::default())?;
    Ok(stop)
}

/// A file to which nothing more is written after Ctrl-C.
struct Stoppable<'a> {
    file: &'a File,
    stop: &'a AtomicBool,
}

impl Write for Stoppable<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.flush()?;
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        if self.stop.load(Ordering::Relaxed) { Err(io::Error::other(STOPPED)) } else { Ok(()) }
    }
}

fn is_standard_output(there: &Metadata) -> bool {
    rustix::fs::fstat(io::stdout()).is_ok_and(|out| (out.st_dev, out.st_ino) == (there.dev(), there.ino()))
}

/// The file itself, whatever links lead to it, also where it is yet to be made.
fn target_of(path: &Path) -> PathBuf {
    let mut path = path.to_owned();
    for _ in 0..40 {
        if let Ok(target) = fs::canonicalize(&path) {
            return target;
        }
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        match fs::read_link(&path) {
            Ok(link) => path = folder.join(link),
            Err(_) => {
                let folder = fs::canonicalize(folder).unwrap_or_else(|_| folder.to_owned());
                return path.file_name().map_or(folder.clone(), |name| folder.join(name));
            }
        }
    }
    path
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::symlink;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> =
            fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn no_output_is_an_input_or_another_output_by_whatever_name() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::write(at("r.csv"), "kept").unwrap();
        symlink(at("r.csv"), at("link")).unwrap();
        symlink(at("new"), at("dangling")).unwrap();
        fs::hard_link(at("r.csv"), at("hard")).unwrap();
        let mut outputs = Outputs::beside(&[("--recording", Some(&at("r.csv"))), ("--holdout", None)]);
        let around = at("..").join(folder.path().file_name().unwrap()).join("r.csv");
        for path in [at("r.csv"), at("link"), at("hard"), around] {
            let why = outputs.add("--json", Some(&path)).unwrap_err();
            assert!(why.contains("--json") && why.contains("--recording"), "{why}");
        }
        outputs.add("--json", Some(&at("dangling"))).unwrap();
        let why = outputs.add("--machine-out", Some(&at("new"))).unwrap_err();
        assert!(why.contains("--json writes"), "{why}");
        for _ in 0..2 {
            outputs.add("--plot", Some(Path::new("/dev/null"))).unwrap();
        }
        for path in [at("none/x.json"), at("sub/"), folder.path().to_owned()] {
            let why = outputs.add("--plot", Some(&path)).unwrap_err();
            assert!(why.contains("cannot be written"), "{why}");
        }
        assert_eq!(names(folder.path()), ["dangling", "hard", "link", "r.csv"]);
    }

    #[test]
    fn all_are_replaced_when_all_are_whole_and_none_before() {
        let folder = tempfile::tempdir().unwrap();
        let (one, two, link) = (folder.path().join("one"), folder.path().join("two"), folder.path().join("link"));
        fs::write(&one, "old").unwrap();
        fs::set_permissions(&one, Permissions::from_mode(0o640)).unwrap();
        symlink(&one, &link).unwrap();
        let asked = || {
            let mut outputs = Outputs::beside(&[]);
            outputs.add("--json", Some(&link)).unwrap();
            outputs.add("--out", Some(&two)).unwrap();
            outputs.write("--json", |out| out.write_all(b"new")).unwrap();
            outputs
        };
        let mut outputs = asked();
        let why = outputs.write("--out", |out| {
            out.write_all(&[b'x'; 100_000])?;
            Err(io::ErrorKind::StorageFull.into())
        });
        assert!(why.unwrap_err().contains("two"));
        assert_eq!(fs::read_to_string(&one).unwrap(), "old");
        drop(outputs);
        assert_eq!(names(folder.path()), ["link", "one"]);

        let mut outputs = asked();
        outputs.write("--out", |out| out.write_all(b"two")).unwrap();
        outputs.write("--nobody-asked", |_| unreachable!()).unwrap();
        assert_eq!(fs::read_to_string(&one).unwrap(), "old");
        outputs.commit().unwrap();
        assert_eq!(
            (fs::read_to_string(&one).unwrap(), fs::read_to_string(&two).unwrap()),
            ("new".into(), "two".into())
        );
        assert_eq!(fs::metadata(&one).unwrap().mode() & 0o777, 0o640);
        assert_eq!(names(folder.path()), ["link", "one", "two"]);
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());

        let mut outputs = asked();
        let why = outputs.write("--out", |out| {
            signal_hook::low_level::raise(SIGINT)?;
            out.write_all(b"not to be seen")
        });
        assert!(why.unwrap_err().contains(STOPPED));
        assert_eq!(outputs.commit(), Err(STOPPED.into()));
        assert_eq!(fs::read_to_string(&two).unwrap(), "two");
        assert_eq!(names(folder.path()), ["link", "one", "two"]);
    }
}
