//! Files in and out with nothing half done: bounded reads, atomic writes.

use std::{
    collections::HashSet,
    fs::{self, File, OpenOptions},
    io::{self, Read, Write},
    path::{Path, PathBuf},
    sync::{
        Mutex, MutexGuard, PoisonError,
        atomic::{AtomicU64, Ordering},
    },
    time::{Duration, SystemTime},
};

use crate::{Error, ErrorKind, Result};

/// Reads a whole regular file of at most `max_bytes` bytes.
///
/// Folders, devices and pipes are refused (`/dev/zero` never ends), and so is a file that grows past the limit while
/// it is read. Errors name the file.
pub fn read_file_checked(path: impl AsRef<Path>, max_bytes: u64) -> Result<Vec<u8>> {
    let path = path.as_ref();
    read_checked(path, max_bytes).map_err(|error| error.in_file(path))
}

fn read_checked(path: &Path, max_bytes: u64) -> Result<Vec<u8>> {
    let cannot = |error: io::Error| Error::input("cannot be read").caused_by(error);
    // Before opening, because opening a pipe blocks.
    regular(&fs::metadata(path).map_err(cannot)?)?;
    let file = File::open(path).map_err(cannot)?;
    let metadata = file.metadata().map_err(cannot)?;
    regular(&metadata)?;
    let too_large = |size: u64| Error::input(format!("{size} bytes, at most {max_bytes} are read"));
    if metadata.len() > max_bytes {
        return Err(too_large(metadata.len()));
    }
    let mut bytes = Vec::new();
    bytes
        .try_reserve_exact(usize::try_from(metadata.len()).unwrap_or(usize::MAX))
        .map_err(|error| Error::new(ErrorKind::OutOfMemory, "cannot be held in memory").caused_by(error))?;
    file.take(max_bytes.saturating_add(1)).read_to_end(&mut bytes).map_err(cannot)?;
    if bytes.len() as u64 > max_bytes {
        return Err(too_large(bytes.len() as u64));
    }
    Ok(bytes)
}

/// Reads a whole text file of at most `max_bytes` bytes, as [`read_file_checked`].
///
/// # Errors
/// As [`read_file_checked`]; `Input` if the text is not UTF-8.
pub fn read_text_checked(path: impl AsRef<Path>, max_bytes: u64) -> Result<String> {
    let path = path.as_ref();
    String::from_utf8(read_file_checked(path, max_bytes)?).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        Error::input(format!("byte {at} is not UTF-8, which text files are made of")).in_file(path)
    })
}

/// The first bytes of a regular file, at most `length`: what a large file says of itself. Folders, devices and pipes are refused as by
/// [`read_file_checked`]. Errors name the file.
pub fn read_head_checked(path: impl AsRef<Path>, length: u64) -> Result<Vec<u8>> {
    let path = path.as_ref();
    let cannot = |error: io::Error| Error::input("cannot be read").caused_by(error).in_file(path);
    regular(&fs::metadata(path).map_err(cannot)?).map_err(|error| error.in_file(path))?;
    let mut head = Vec::new();
    File::open(path).map_err(cannot)?.take(length).read_to_end(&mut head).map_err(cannot)?;
    Ok(head)
}

fn regular(metadata: &fs::Metadata) -> Result<()> {
    if metadata.is_dir() {
        Err(Error::input("is a folder, a file is needed"))
    } else if metadata.is_file() {
        Ok(())
    } else {
        Err(Error::input("is a device or a pipe, only regular files are read"))
    }
}

/// Writes a whole file or nothing: into a temporary file of the same folder, flushed to disk, then renamed.
///
/// Whenever the process dies, `path` is what it was or complete. An existing file is replaced only with `overwrite`
/// (a symbolic link stays, what it points at is replaced). Devices and pipes (`/dev/null`) are written directly. On
/// failure nothing is left behind; temporary files of killed processes are swept a day later by the next write into
/// that folder. The error has [`ErrorKind::Output`] and says how many bytes were needed.
pub fn write_atomic(path: &Path, bytes: &[u8], overwrite: bool) -> Result<()> {
    write_all_atomic(&[(path, bytes)], overwrite)
}

/// Writes files that belong together, all or none: each as [`write_atomic`] does, and none gets its name before the bytes of all are on
/// the disk. They get their names in the order of the list, so that the one that names the rest comes last.
///
/// # Errors
/// `Output`, naming the file that could not be written. Files that were not there before are then not there; one that was there is what
/// it was, unless it got its new contents before a later one failed to get its name.
pub fn write_all_atomic(files: &[(&Path, &[u8])], overwrite: bool) -> Result<()> {
    let mut written = Vec::with_capacity(files.len());
    for (path, bytes) in files {
        let fail = |error: io::Error| cannot_write(path, bytes.len(), error);
        let target = inspect(path, overwrite)?;
        if target.device {
            let mut file = OpenOptions::new().write(true).open(&target.path).map_err(fail)?;
            file.write_all(bytes).and_then(|()| file.flush()).map_err(fail)?;
            continue;
        }
        sweep(&target.folder);
        let mut temporary = Temporary::create(&target.folder).map_err(fail)?;
        temporary.file.write_all(bytes).map_err(fail)?;
        if let Some(permissions) = &target.permissions {
            // A replaced file keeps who may read it; failing to is no reason to lose the picture.
            let _ = temporary.file.set_permissions(permissions.clone());
        }
        temporary.file.sync_all().map_err(fail)?;
        written.push((*path, bytes.len(), target, temporary));
    }
    publish(&written, overwrite)?;
    sync_folders(&written);
    Ok(())
}

/// As [`write_atomic`], for a file that is made piece by piece and need not fit in memory. `bytes`: its whole size, for messages.
///
/// # Errors
/// As [`write_atomic`], and the first error of a piece.
pub fn write_pieces_atomic(
    path: &Path,
    bytes: u64,
    pieces: impl Iterator<Item = Result<Vec<u8>>>,
    overwrite: bool,
) -> Result<()> {
    let bytes = usize::try_from(bytes).unwrap_or(usize::MAX);
    let fail = |error: io::Error| cannot_write(path, bytes, error);
    let target = inspect(path, overwrite)?;
    if target.device {
        let mut file = OpenOptions::new().write(true).open(&target.path).map_err(fail)?;
        for piece in pieces {
            file.write_all(&piece?).map_err(fail)?;
        }
        return file.flush().map_err(fail);
    }
    sweep(&target.folder);
    let mut temporary = Temporary::create(&target.folder).map_err(fail)?;
    for piece in pieces {
        temporary.file.write_all(&piece?).map_err(fail)?;
    }
    if let Some(permissions) = &target.permissions {
        // A replaced file keeps who may read it; failing to is no reason to lose the data.
        let _ = temporary.file.set_permissions(permissions.clone());
    }
    temporary.file.sync_all().map_err(fail)?;
    let written = [(path, bytes, target, temporary)];
    publish(&written, overwrite)?;
    sync_folders(&written);
    Ok(())
}

/// The rename itself reaches the disk with its folder; not every file system can do that.
fn sync_folders(written: &[(&Path, usize, Target, Temporary)]) {
    let folders: HashSet<&Path> = written.iter().map(|(_, _, target, _)| target.folder.as_path()).collect();
    for folder in folders {
        if let Ok(folder) = File::open(folder) {
            let _ = folder.sync_all();
        }
    }
}

/// Gives all files their names, or takes those away again that were not there before.
fn publish(written: &[(&Path, usize, Target, Temporary)], overwrite: bool) -> Result<()> {
    // Nobody leaves the process between two names.
    let _unfinished = unfinished();
    for (done, (path, bytes, target, temporary)) in written.iter().enumerate() {
        if let Err(error) = temporary.publish(&target.path, overwrite) {
            for (_, _, earlier, _) in written[..done].iter().filter(|(_, _, target, _)| target.permissions.is_none()) {
                let _ = fs::remove_file(&earlier.path);
            }
            return Err(match error.kind() {
                io::ErrorKind::AlreadyExists => exists(path),
                _ => cannot_write(path, *bytes, error),
            });
        }
    }
    Ok(())
}

fn cannot_write(path: &Path, bytes: usize, error: io::Error) -> Error {
    failed(path, &format!("cannot write {bytes} bytes"), error)
}

/// Temporary files of this process.
static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

fn unfinished() -> MutexGuard<'static, Vec<PathBuf>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// For a process that ends at once: removes what is being written in other threads. Each file is then what it was or complete, and
/// nothing else lies in its folder. From now on no thread can write.
pub fn leave_nothing_unfinished() {
    let mut unfinished = unfinished();
    for path in unfinished.drain(..) {
        let _ = fs::remove_file(path);
    }
    std::mem::forget(unfinished);
}

/// Checks before work starts that [`write_atomic`] has a chance: the folder takes new files, `path` is no folder, and is free unless `overwrite`. Makes
/// the folder if it is missing, with those above it. Creates and removes an empty temporary file.
///
/// # Errors
/// `Output`, naming the path.
pub fn probe_output(path: &Path, overwrite: bool) -> Result<()> {
    if let Some(folder) = path.parent().filter(|folder| !folder.as_os_str().is_empty() && !folder.exists()) {
        let what = format!("the folder {} cannot be made", folder.display());
        fs::create_dir_all(folder).map_err(|error| failed(path, &what, error).help("Name another"))?;
    }
    let target = inspect(path, overwrite)?;
    if target.device {
        return Ok(());
    }
    sweep(&target.folder);
    Temporary::create(&target.folder).map(drop).map_err(|error| failed(path, "cannot be written", error))
}

struct Target {
    /// Where the bytes go: `path` with a final symbolic link followed.
    path: PathBuf,
    folder: PathBuf,
    device: bool,
    permissions: Option<fs::Permissions>,
}

fn inspect(path: &Path, overwrite: bool) -> Result<Target> {
    let mut resolved = path.to_path_buf();
    let existing = match fs::metadata(path) {
        Ok(metadata) => {
            resolved = fs::canonicalize(path).map_err(|error| failed(path, "cannot be resolved", error))?;
            Some(metadata)
        }
        Err(error) if error.kind() == io::ErrorKind::NotFound => None,
        Err(error) => return Err(failed(path, "cannot be written", error)),
    };
    if let Some(metadata) = &existing {
        if metadata.is_dir() {
            return Err(Error::new(ErrorKind::Output, "is a folder, a file name is needed").in_file(path));
        }
        if metadata.is_file() && !overwrite {
            return Err(exists(path));
        }
    }
    if path.file_name().is_none() {
        return Err(Error::new(ErrorKind::Output, "is not a file name").in_file(path));
    }
    let folder = match resolved.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder.to_path_buf(),
        _ => PathBuf::from("."),
    };
    match fs::metadata(&folder) {
        Ok(metadata) if metadata.is_dir() => {}
        Ok(_) => {
            let what = format!("{} is not a folder", folder.display());
            return Err(Error::new(ErrorKind::Output, what).in_file(path));
        }
        Err(error) => {
            let what = format!("the folder {} cannot be used", folder.display());
            return Err(failed(path, &what, error).help("Create it, or name another"));
        }
    }
    let device = existing.as_ref().is_some_and(|metadata| !metadata.is_file());
    Ok(Target { path: resolved, folder, device, permissions: existing.filter(|_| !device).map(|m| m.permissions()) })
}

fn failed(path: &Path, what: &str, error: io::Error) -> Error {
    Error::new(ErrorKind::Output, what).in_file(path).caused_by(error)
}

fn exists(path: &Path) -> Error {
    Error::new(ErrorKind::Output, "exists already")
        .in_file(path)
        .help("Name another file, or allow it to be overwritten")
}

/// Whether a file of this name is one that is being written, or was when its process was killed.
pub fn is_temporary(name: &std::ffi::OsStr) -> bool {
    name.to_str().is_some_and(|name| name.starts_with(PREFIX) && name.ends_with(SUFFIX))
}

const PREFIX: &str = ".lucerna-";
const SUFFIX: &str = ".tmp";

/// An unpublished file; removed when dropped.
struct Temporary {
    path: PathBuf,
    file: File,
}

impl Temporary {
    fn create(folder: &Path) -> io::Result<Self> {
        static COUNTER: AtomicU64 = AtomicU64::new(0);
        // Another machine may write to the same network folder under the same process id: try on.
        for _ in 0..1000 {
            let number = COUNTER.fetch_add(1, Ordering::Relaxed);
            let path = folder.join(format!("{PREFIX}{}-{number}{SUFFIX}", std::process::id()));
            // Nobody leaves the process between making the file and remembering it.
            let mut unfinished = unfinished();
            match OpenOptions::new().write(true).create_new(true).open(&path) {
                Ok(file) => {
                    unfinished.push(path.clone());
                    return Ok(Self { path, file });
                }
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(error) => return Err(error),
            }
        }
        Err(io::Error::other("no free name for a temporary file"))
    }

    fn publish(&self, path: &Path, overwrite: bool) -> io::Result<()> {
        if !overwrite {
            // A link fails when the name is taken meanwhile; a rename would replace it.
            match fs::hard_link(&self.path, path) {
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => return Err(error),
                Ok(()) => return Ok(()),
                // File systems without hard links.
                Err(_) if path.exists() => return Err(io::ErrorKind::AlreadyExists.into()),
                Err(_) => {}
            }
        }
        fs::rename(&self.path, path)
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        // After a rename there is nothing to remove.
        let _ = fs::remove_file(&self.path);
        unfinished().retain(|path| *path != self.path);
    }
}

/// Removes temporary files older than a day, once a folder and process.
fn sweep(folder: &Path) {
    static SWEPT: Mutex<Option<HashSet<PathBuf>>> = Mutex::new(None);
    if let Ok(mut swept) = SWEPT.lock()
        && !swept.get_or_insert_default().insert(folder.to_path_buf())
    {
        return;
    }
    sweep_older_than(folder, Duration::from_secs(24 * 3600));
}

fn sweep_older_than(folder: &Path, age: Duration) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let ours = is_temporary(&entry.file_name());
        let old = || {
            let modified = entry.metadata().ok().filter(fs::Metadata::is_file)?.modified().ok()?;
            SystemTime::now().duration_since(modified).ok().filter(|passed| *passed > age)
        };
        if ours && old().is_some() {
            let _ = fs::remove_file(entry.path());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_old_temporary_files_of_ours_are_swept() {
        let folder = tempfile::tempdir().unwrap();
        let name = |name: &str| folder.path().join(name);
        for file in [".lucerna-1-0.tmp", ".lucerna-2-0.tmp", "picture.tmp", ".lucerna-notes"] {
            fs::write(name(file), b"x").unwrap();
        }
        let old = SystemTime::now() - Duration::from_secs(25 * 3600);
        for file in [".lucerna-1-0.tmp", "picture.tmp", ".lucerna-notes"] {
            File::options().write(true).open(name(file)).unwrap().set_modified(old).unwrap();
        }
        sweep(folder.path());
        assert!(!name(".lucerna-1-0.tmp").exists());
        assert!([".lucerna-2-0.tmp", "picture.tmp", ".lucerna-notes"].iter().all(|file| name(file).exists()));
    }

    #[test]
    fn a_file_that_is_too_large_or_no_file_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("five.bin");
        fs::write(&path, b"12345").unwrap();
        assert_eq!(read_file_checked(&path, 5).unwrap(), b"12345");
        let error = read_file_checked(&path, 4).unwrap_err().to_string();
        assert!(error.contains("five.bin: 5 bytes, at most 4"), "{error}");
        assert!(read_file_checked(folder.path(), 4).unwrap_err().to_string().contains("is a folder"));
        assert_eq!(super::read_head_checked(&path, 3).unwrap(), b"123");
        assert!(super::read_head_checked(folder.path(), 3).unwrap_err().to_string().contains("is a folder"));
        let error = read_file_checked(folder.path().join("none"), 4).unwrap_err();
        assert!(error.to_string().contains("none: cannot be read"), "{error}");
        assert_eq!(error.kind(), ErrorKind::Input);
    }
}
