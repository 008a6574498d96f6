//! Writes a file whole or not at all, so that what was there is not lost when the disk is full or the power fails.

use crate::error::{Fault, GIB_ERR_FORMAT, GIB_ERR_IO};
use std::fs::{self, File};
use std::io::{ErrorKind, Result, Write};
use std::path::Path;

/// Replaces a file by `text`: written beside it, brought to the disk, put in its place. A symbolic link is followed; a
/// device or a pipe, which cannot be replaced, is written to. Owner, mode and access list stay those of the file that was there.
///
/// # Errors
/// The system's; the file is then as it was, and nothing is left beside it.
pub fn replace(file: &Path, text: &str) -> Result<()> {
    let file = fs::canonicalize(file).unwrap_or_else(|_| file.to_owned());
    if fs::metadata(&file).is_ok_and(|there| !there.is_file()) {
        return fs::write(&file, text);
    }
    let mut name = file.file_name().unwrap_or_default().to_owned();
    name.push(format!(".{}.new", std::process::id()));
    let beside = file.with_file_name(name);
    let write = || {
        let mut new = File::create(&beside)?;
        match File::open(&file) {
            Ok(old) => crate::program::dressed(&old, &new)?,
            Err(error) if error.kind() == ErrorKind::NotFound => {}
            Err(error) => return Err(error),
        }
        new.write_all(text.as_bytes())?;
        new.sync_all()?;
        fs::rename(&beside, &file)
    };
    write().inspect_err(|_| _ = fs::remove_file(&beside))
}

/// The text of a JSON file.
///
/// # Errors
/// `GIB_ERR_IO`; `GIB_ERR_FORMAT` with `json` and the line of what is not UTF-8.
pub fn text(path: &Path) -> std::result::Result<String, Fault> {
    let bytes = fs::read(path).map_err(|_| Fault { field: "path\0", ..Fault::of(GIB_ERR_IO) })?;
    String::from_utf8(bytes).map_err(|wrong| {
        let (well, _) = wrong.as_bytes().split_at(wrong.utf8_error().valid_up_to());
        let line = well.iter().filter(|byte| **byte == b'\n').count() + 1;
        Fault { field: "json\0", value: line as f64, ..Fault::of(GIB_ERR_FORMAT) }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mode_stays() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("m.json");
        replace(&file, "old").unwrap();
        for mode in [0o604, 0o660] {
            fs::set_permissions(&file, fs::Permissions::from_mode(mode)).unwrap();
            replace(&file, "new").unwrap();
            assert_eq!(fs::metadata(&file).unwrap().permissions().mode() & 0o777, mode);
        }
    }

    #[test]
    fn the_old_or_the_new_is_there_and_nothing_beside_it() {
        let folder = tempfile::tempdir().unwrap();
        let (file, link) = (folder.path().join("m.json"), folder.path().join("link"));
        std::os::unix::fs::symlink(&file, &link).unwrap();
        replace(&file, "old").unwrap();
        replace(&link, "new").unwrap();
        assert_eq!(fs::read_to_string(&file).unwrap(), "new");
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert!(replace(&folder.path().join("none/m.json"), "x").is_err());
        assert!(replace(folder.path(), "x").is_err());
        replace(Path::new("/dev/null"), "x").unwrap();
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
    }
}
