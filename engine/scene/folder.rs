//! Which files a scene may read: those in its own folder and below, or in its archive, and no others.
//!
//! A scene file is data from elsewhere. It names its buffers and textures by relative reference, and a reference that
//! leaves the folder (`../../etc/passwd`, `/dev/zero`, `file:///…`, a symbolic link) is refused instead of followed.

use crate::{Error, ErrorKind, Result};
use std::{
    fs::File,
    io::Read,
    path::{Path, PathBuf},
    rc::Rc,
};

use super::archive::Archive;

const REMEDY: &str = "A scene may only refer to files in its own folder or below it; put the file there";

/// The folder of a scene file, resolved to its real place in the file system.
#[derive(Clone, Debug)]
pub struct Folder {
    root: PathBuf,
    /// The archive in which the folder lies.
    archive: Option<Rc<Archive>>,
}

impl Folder {
    /// The folder that `scene_file` lies in.
    pub fn of(scene_file: &Path) -> Result<Self> {
        let parent = match scene_file.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
        };
        let root = parent
            .canonicalize()
            .map_err(|error| Error::input("the folder cannot be opened").caused_by(error).in_file(parent))?;
        Ok(Self { root, archive: None })
    }

    /// The folder of a scene file in an archive.
    pub fn in_archive(archive: Rc<Archive>, scene_file: &Path) -> Self {
        Self { root: scene_file.parent().unwrap_or(Path::new("")).to_owned(), archive: Some(archive) }
    }

    /// Reads a file that this folder has resolved, at most `limit` bytes.
    pub fn read(&self, path: &Path, limit: u64) -> Result<Vec<u8>> {
        match &self.archive {
            Some(archive) => archive.read(path, limit),
            None => read_named(path, limit),
        }
    }

    /// The real path of a file named by a URI reference (percent-encoded, as in glTF).
    pub fn resolve_uri(&self, uri: &str) -> Result<PathBuf> {
        self.resolve(&path_of_uri(uri)?)
    }

    /// The real path of a file named by a plain path (as in MTL files, which use either slash).
    pub fn resolve_path(&self, path: &str) -> Result<PathBuf> {
        self.resolve(&checked_path(&path.replace('\\', "/"))?)
    }

    fn resolve(&self, relative: &Path) -> Result<PathBuf> {
        let joined = self.root.join(relative);
        if let Some(archive) = &self.archive {
            return match archive.has(&joined) {
                true => Ok(joined),
                false => Err(Error::input(format!("{relative:?} is not in the archive"))),
            };
        }
        let real = joined
            .canonicalize()
            .map_err(|error| Error::input(format!("{relative:?} cannot be opened")).caused_by(error))?;
        // Canonical paths have no links left: what still starts with the root is inside it.
        if !real.starts_with(&self.root) {
            return Err(Error::input(format!("{relative:?} leads out of the scene's folder")).help(REMEDY));
        }
        Ok(real)
    }
}

/// Reads a regular file of at most `limit` bytes. Devices, pipes and folders are refused before they are opened. Errors
/// call the file `name`.
pub fn read_file(path: &Path, name: &str, limit: u64) -> Result<Vec<u8>> {
    let cannot = |error| Error::input(format!("{name} cannot be read")).caused_by(error);
    let metadata = path.metadata().map_err(cannot)?;
    if !metadata.is_file() {
        let what = if metadata.is_dir() { "is a folder" } else { "is not a regular file" };
        return Err(Error::input(format!("{name} {what}")));
    }
    let too_large = |size: u64| Err(Error::input(format!("{name} has {size} bytes or more, {limit} are allowed")));
    if metadata.len() > limit {
        return too_large(metadata.len());
    }
    let mut bytes = Vec::new();
    bytes.try_reserve_exact(metadata.len() as usize).map_err(|error| {
        Error::new(ErrorKind::OutOfMemory, format!("no memory for the {} bytes of {name}", metadata.len()))
            .caused_by(error)
    })?;
    // The file may grow while it is read.
    File::open(path).map_err(cannot)?.take(limit.saturating_add(1)).read_to_end(&mut bytes).map_err(cannot)?;
    if bytes.len() as u64 > limit {
        return too_large(bytes.len() as u64);
    }
    Ok(bytes)
}

/// The first bytes of a regular file, up to `length`, by which its format is told before it is read as a whole.
pub fn read_head(path: &Path, length: u64) -> Result<Vec<u8>> {
    let cannot = |error| Error::input("the file cannot be read").caused_by(error);
    if !path.metadata().map_err(cannot)?.is_file() {
        return Err(Error::input("is not a regular file"));
    }
    let mut head = Vec::new();
    File::open(path).map_err(cannot)?.take(length).read_to_end(&mut head).map_err(cannot)?;
    Ok(head)
}

/// As [`read_file`], for a file that a scene names.
fn read_named(path: &Path, limit: u64) -> Result<Vec<u8>> {
    let name = path.file_name().unwrap_or_default();
    read_file(path, &format!("{name:?}"), limit)
}

/// The relative path that a URI reference names, or an error if it names anything but a file below the scene's folder.
///
/// The result has at least one component and only normal ones: no root, no prefix, no `..`.
pub fn path_of_uri(uri: &str) -> Result<PathBuf> {
    // A colon before the first slash makes a scheme (RFC 3986, 4.2); one letter would be a Windows drive.
    let first = uri.split(['/', '?', '#']).next().unwrap_or_default();
    if let Some((scheme, _)) = first.split_once(':') {
        return Err(Error::input(format!("URI scheme {scheme:?} is not supported, only data: and relative files are"))
            .help(REMEDY));
    }
    let decoded = percent_decode(uri.as_bytes());
    let text = String::from_utf8(decoded)
        .map_err(|_| Error::input(format!("URI {:?} is not UTF-8 after percent-decoding", shorten(uri))))?;
    if text.contains('\\') {
        return Err(Error::input(format!("URI {:?} has a backslash", shorten(uri))).help(REMEDY));
    }
    checked_path(&text)
}

/// `text` as a path of normal components only.
pub fn checked_path(text: &str) -> Result<PathBuf> {
    let refuse = |why: &str| Err(Error::input(format!("file name {:?} {why}", shorten(text))).help(REMEDY));
    if text.is_empty() {
        return refuse("is empty");
    }
    if text.len() > 4096 {
        return refuse("is longer than 4096 bytes");
    }
    if text.contains('\0') {
        return refuse("has a NUL character");
    }
    if text.starts_with('/') {
        return refuse("is absolute");
    }
    let mut path = PathBuf::new();
    for part in text.split('/') {
        match part {
            "" | "." => continue,
            ".." => return refuse("leads out of the folder with \"..\""),
            // A drive letter or an alternate data stream on Windows; the same file must be refused everywhere alike.
            part if part.contains(':') => return refuse("has a colon"),
            part => path.push(part),
        }
    }
    if path.as_os_str().is_empty() {
        return refuse("names no file");
    }
    Ok(path)
}

/// Replaces `%41` by `A`; what is not two hexadecimal digits after a percent sign stays.
pub fn percent_decode(text: &[u8]) -> Vec<u8> {
    let digit = |byte: Option<&u8>| byte.and_then(|&b| (b as char).to_digit(16));
    let mut out = Vec::with_capacity(text.len());
    let mut at = 0;
    while let Some(&byte) = text.get(at) {
        if let (b'%', Some(high), Some(low)) = (byte, digit(text.get(at + 1)), digit(text.get(at + 2))) {
            out.push((high * 16 + low) as u8);
            at += 3;
        } else {
            out.push(byte);
            at += 1;
        }
    }
    out
}

/// The beginning of a long name, for messages.
pub fn shorten(text: &str) -> String {
    match text.char_indices().nth(60) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn relative_names_are_decoded_and_kept() {
        assert_eq!(path_of_uri("a/b.bin").unwrap(), Path::new("a/b.bin"));
        assert_eq!(path_of_uri("./a%20b%2Ec").unwrap(), Path::new("a b.c"));
        assert_eq!(path_of_uri("Unicode%20%E2%9D%A4.bin").unwrap(), Path::new("Unicode ❤.bin"));
        assert_eq!(path_of_uri("50%.png").unwrap(), Path::new("50%.png"));
    }

    #[test]
    fn what_may_leave_the_folder_is_refused() {
        for uri in [
            "",
            ".",
            "/etc/passwd",
            "//host/share",
            "../secret",
            "a/../../secret",
            "%2e%2e/secret",
            "%2fetc/passwd",
            "file:///etc/passwd",
            "http://example.org/a.bin",
            "c:/windows",
            "a/c:stream",
            "..\\secret",
            "a%5C..%5Cb",
            "a%00b",
            "%ff",
        ] {
            assert!(path_of_uri(uri).is_err(), "{uri:?} was accepted");
        }
    }

    #[cfg(unix)]
    #[test]
    fn links_out_of_the_folder_are_refused() {
        let outside = tempfile::tempdir().unwrap();
        std::fs::write(outside.path().join("secret.bin"), b"secret").unwrap();
        let inside = tempfile::tempdir().unwrap();
        std::fs::write(inside.path().join("own.bin"), b"own").unwrap();
        std::os::unix::fs::symlink(outside.path().join("secret.bin"), inside.path().join("file.bin")).unwrap();
        std::os::unix::fs::symlink(outside.path(), inside.path().join("folder")).unwrap();
        std::os::unix::fs::symlink(inside.path().join("own.bin"), inside.path().join("alias.bin")).unwrap();
        let folder = Folder::of(&inside.path().join("scene.gltf")).unwrap();
        assert!(folder.resolve_uri("own.bin").is_ok());
        assert!(folder.resolve_uri("alias.bin").is_ok(), "a link that stays inside is fine");
        assert!(folder.resolve_uri("file.bin").unwrap_err().to_string().contains("out of the scene's folder"));
        assert!(folder.resolve_uri("folder/secret.bin").unwrap_err().to_string().contains("out of the scene's folder"));
    }
}
