//! Folders and patterns in lists of pictures: `out/`, `'out/*.exr'`.

use std::path::Path;

use lucerna::{Error, ErrorKind, Result};

/// Endings of pictures.
pub const PICTURES: [&str; 6] = ["exr", "hdr", "pfm", "png", "jpg", "jpeg"];

/// Whether the name of a file has one of these endings, in any case.
pub fn has_ending(name: &Path, known: &[&str]) -> bool {
    let ending = name.extension().and_then(|ending| ending.to_str()).map(str::to_ascii_lowercase);
    ending.is_some_and(|ending| known.contains(&ending.as_str()))
}

/// The names of a list, with the pictures of a folder in the place of the folder and the files of a pattern with `*`, `?` or `[…]` in its place, by name.
///
/// # Errors
/// `Input` for folders without pictures, and for patterns that no file matches.
pub fn expanded(names: &[String]) -> Result<Vec<String>> {
    let mut list = Vec::new();
    for name in names {
        let path = Path::new(name);
        if path.is_dir() {
            list.extend(in_folder(path)?);
        } else if name.contains(['*', '?', '[']) && !path.exists() && !name.contains("{layer}") {
            list.extend(of_pattern(name)?);
        } else {
            list.push(name.clone());
        }
    }
    Ok(list)
}

fn in_folder(folder: &Path) -> Result<Vec<String>> {
    let unreadable = |error| Error::input("the folder cannot be read").in_file(folder).caused_by(error);
    let mut list = Vec::new();
    for entry in folder.read_dir().map_err(unreadable)? {
        let path = entry.map_err(unreadable)?.path();
        if path.is_file() && has_ending(&path, &PICTURES) {
            list.push(path.to_string_lossy().into_owned());
        }
    }
    list.sort();
    if list.is_empty() {
        let error = Error::input("is a folder without pictures").in_file(folder);
        return Err(error.help(format!("Pictures end in .{}", PICTURES.join(", ."))));
    }
    Ok(list)
}

fn of_pattern(pattern: &str) -> Result<Vec<String>> {
    let wrong = |error: glob::PatternError| Error::new(ErrorKind::Input, error.msg).in_file(pattern);
    // Files in folders that cannot be read do not match.
    let mut list: Vec<String> =
        glob::glob(pattern).map_err(wrong)?.flatten().map(|path| path.to_string_lossy().into_owned()).collect();
    list.sort();
    if list.is_empty() {
        return Err(Error::input("no file has a name like this").in_file(pattern));
    }
    Ok(list)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_and_patterns_become_their_pictures() {
        let folder = tempfile::tempdir().unwrap();
        let named = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
        for name in ["b.exr", "a.PNG", "note.txt", "c.exr"] {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        let of = |name: String| expanded(&[name, "-".into(), "x.exr".into()]).unwrap();
        assert_eq!(of(named("")), [named("a.PNG"), named("b.exr"), named("c.exr"), "-".into(), "x.exr".into()]);
        assert_eq!(of(named("*.exr"))[..2], [named("b.exr"), named("c.exr")]);
        std::fs::create_dir(folder.path().join("empty")).unwrap();
        for wrong in [named("empty"), named("*.hdr"), named("[.exr")] {
            assert_eq!(expanded(std::slice::from_ref(&wrong)).unwrap_err().exit_code(), 3, "{wrong}");
        }
    }
}
