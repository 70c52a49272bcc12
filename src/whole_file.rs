//! Files that are written whole or not at all: a full disk or a kill leaves the old one.
//!
//! ```text
//! content ─► .NAME.new, beside NAME ─► flushed to disk ─► renamed to NAME
//! ```

use std::ffi::OsString;
use std::fs::{self, File, TryLockError};
use std::io::{self, BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};

/// Replaces the file at `path`, or makes it, by what `write` writes. A link stays, and what it
/// leads to is replaced; what is no file, such as a pipe, is written to.
pub(crate) fn replace(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    let old = fs::metadata(path).ok();
    if old.as_ref().is_some_and(|old| !old.is_file()) {
        let mut file = File::options().write(true).open(path)?;
        return write(&mut file);
    }
    let permissions = old.map(|old| old.permissions());
    if permissions.as_ref().is_some_and(fs::Permissions::readonly) {
        return Err(io::Error::new(ErrorKind::PermissionDenied, "it is read-only"));
    }
    let path = if path.is_symlink() { &*fs::canonicalize(path)? } else { path };
    let (new, file) = create_beside(path)?;
    let written = fill(file, permissions, write).and_then(|()| fs::rename(&new, path));
    if written.is_err() {
        // The error before it says more.
        _ = fs::remove_file(&new);
    }
    written
}

/// A new file in the folder of `path`.
fn create_beside(path: &Path) -> io::Result<(PathBuf, File)> {
    let of_number = |number: u32| {
        let mut name = OsString::from(".");
        name.push(path.file_name().unwrap_or_default());
        name.push(".new");
        if number > 0 {
            name.push(number.to_string());
        }
        path.with_file_name(name)
    };
    // Another program may be writing the same one: it holds a lock. What one that was killed has
    // left is used again.
    let mut number = 0;
    loop {
        let new = of_number(number);
        let file = File::options().write(true).create(true).truncate(false).open(&new)?;
        let is_locked = match file.try_lock() {
            Ok(()) => false,
            Err(TryLockError::WouldBlock) => true,
            // A file system without locks: what is there may be written just now.
            Err(TryLockError::Error(_)) => file.metadata()?.len() > 0,
        };
        if is_locked && number < 1000 {
            number += 1;
        } else if is_locked {
            return Err(io::Error::new(ErrorKind::ResourceBusy, "1000 programs write it"));
        } else if is_at(&file, &new)? {
            file.set_len(0)?;
            return Ok((new, file));
        }
    }
}

/// Whether `file` is at `path` still: until it was locked, another program may have renamed it.
fn is_at(file: &File, path: &Path) -> io::Result<bool> {
    let (Ok(at), own) = (fs::metadata(path), file.metadata()?) else { return Ok(false) };
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        Ok((at.dev(), at.ino()) == (own.dev(), own.ino()))
    }
    #[cfg(not(unix))]
    Ok(at.len() == own.len())
}

/// Writes a new file, and waits until the disk has it.
fn fill(
    file: File,
    permissions: Option<fs::Permissions>,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    if let Some(permissions) = permissions {
        file.set_permissions(permissions)?;
    }
    let mut file = BufWriter::new(file);
    write(&mut file)?;
    file.into_inner().map_err(io::IntoInnerError::into_error)?.sync_all()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<OsString> {
        let mut names: Vec<_> =
            fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_file_is_replaced_whole_or_not_at_all() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.ply");
        replace(&path, |out| out.write_all(b"old")).unwrap();
        let full = |out: &mut dyn Write| {
            out.write_all(&[b'x'; 100_000])?;
            // What is there until then is the old one.
            assert_eq!(fs::read(&path).unwrap(), b"old");
            Err(io::Error::from(ErrorKind::StorageFull))
        };
        assert_eq!(replace(&path, full).unwrap_err().kind(), ErrorKind::StorageFull);
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(names(folder.path()), ["a.ply"]);
        // What a killed program left is used again; what another one writes is not.
        let left = folder.path().join(".a.ply.new");
        fs::write(&left, "half of another file").unwrap();
        replace(&path, |out| out.write_all(b"new")).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert_eq!(names(folder.path()), ["a.ply"]);
        fs::write(&left, "half").unwrap();
        let other = File::options().write(true).open(&left).unwrap();
        other.lock().unwrap();
        replace(&path, |out| out.write_all(b"newer")).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"newer");
        assert_eq!(fs::read(&left).unwrap(), b"half");
    }

    #[test]
    fn read_only_files_and_folders_are_kept() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.ply");
        fs::write(&path, "old").unwrap();
        let mut permissions = fs::metadata(&path).unwrap().permissions();
        permissions.set_readonly(true);
        fs::set_permissions(&path, permissions).unwrap();
        let refused = replace(&path, |out| out.write_all(b"new")).unwrap_err();
        assert_eq!(refused.kind(), ErrorKind::PermissionDenied);
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert!(replace(folder.path(), |out| out.write_all(b"new")).is_err());
        assert!(replace(&folder.path().join("none/a"), |out| out.write_all(b"new")).is_err());
        assert_eq!(names(folder.path()), ["a.ply"]);
    }

    #[cfg(unix)]
    #[test]
    fn links_devices_and_permissions_stay() {
        use std::os::unix::fs::{PermissionsExt, symlink};

        let folder = tempfile::tempdir().unwrap();
        let [file, link] = ["file", "link"].map(|name| folder.path().join(name));
        fs::write(&file, "old").unwrap();
        fs::set_permissions(&file, fs::Permissions::from_mode(0o640)).unwrap();
        symlink(&file, &link).unwrap();
        replace(&link, |out| out.write_all(b"new")).unwrap();
        assert!(link.is_symlink());
        assert_eq!(fs::read(&file).unwrap(), b"new");
        assert_eq!(fs::metadata(&file).unwrap().permissions().mode() & 0o777, 0o640);
        replace(Path::new("/dev/null"), |out| out.write_all(b"new")).unwrap();
        assert!(!Path::new("/dev/null").is_file());
    }
}
