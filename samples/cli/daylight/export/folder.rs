//! The folder of an export: its files, their sizes, and the text of its table.

use std::{fs, path::Path};

use lucerna::{Error, ErrorKind, Result, image};
use serde_json::json;

use crate::console::{self, Console};

/// Name of the file that names the others. It is written last: where it is, the export is whole.
pub const TABLE: &str = "daylight.json";

/// Files of one folder, and their sizes.
pub struct Folder<'a> {
    pub path: &'a Path,
    pub overwrite: bool,
    pub written: Vec<(String, usize)>,
}

impl Folder<'_> {
    /// Writes a file.
    ///
    /// # Errors
    /// `Output` if it cannot be written, or if it is there and must not be replaced.
    pub fn write(&mut self, name: String, bytes: &[u8]) -> Result<()> {
        image::write_atomic(&self.path.join(&name), bytes, self.overwrite)?;
        self.written.push((name, bytes.len()));
        Ok(())
    }
}

/// Makes the folder, or checks that it may be written into.
///
/// # Errors
/// `Output`, naming the folder.
pub fn prepare(folder: &Path, overwrite: bool) -> Result<()> {
    let failed = |error: std::io::Error| {
        Error::new(ErrorKind::Output, "cannot be used as a folder").in_file(folder).caused_by(error)
    };
    if !folder.exists() {
        return fs::create_dir_all(folder).map_err(failed);
    }
    let mut entries = fs::read_dir(folder).map_err(failed)?;
    if entries.next().is_some() && !overwrite {
        let error = Error::new(ErrorKind::Output, "exists already and has files in it").in_file(folder);
        return Err(error.help("Name another folder, or allow to write into this one with --overwrite"));
    }
    // While files are replaced there is no whole export.
    let table = folder.join(TABLE);
    if table.exists() { fs::remove_file(&table).map_err(failed) } else { Ok(()) }
}

/// Lists of numbers on one line each.
pub fn compact(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut lines = text.lines().peekable();
    while let Some(line) = lines.next() {
        let number = |line: &str| {
            let line = line.trim().trim_end_matches(',');
            !line.is_empty() && line.bytes().all(|b| b.is_ascii_digit() || b"+-.eE".contains(&b))
        };
        out.push_str(if number(line) { line.trim_start() } else { line });
        let next = lines.peek().copied().unwrap_or_default();
        let closes = number(line) && next.trim_start().starts_with(']');
        if !(number(next) || closes) {
            out.push('\n');
        } else if number(line) && !closes {
            out.push(' ');
        }
        if closes && let Some(next) = lines.next() {
            out.push_str(next.trim_start());
            out.push('\n');
        }
    }
    out
}

/// Says what was written.
///
/// # Errors
/// `Output` if standard output is closed.
pub fn say(folder: &Folder<'_>, console: Console, json: bool) -> Result<()> {
    let all: usize = folder.written.iter().map(|(_, bytes)| bytes).sum();
    // Pages and the lightmaps of all times are many; their sums are enough.
    let mut sums: Vec<(String, usize, usize)> = Vec::new();
    for (name, bytes) in &folder.written {
        let kind = kind_of(name);
        match sums.iter_mut().find(|(known, _, _)| *known == kind) {
            Some((_, count, sum)) => (*count, *sum) = (*count + 1, *sum + bytes),
            None => sums.push((kind, 1, *bytes)),
        }
    }
    for (kind, count, bytes) in sums {
        let count = if count == 1 { String::new() } else { format!(", {count} files") };
        console.info(&format!("{kind:<20} {bytes:>12} bytes{count}"));
    }
    console.info(&format!("wrote {}: {all} bytes in {} files", folder.path.display(), folder.written.len()));
    if json {
        let files: Vec<_> =
            folder.written.iter().map(|(name, bytes)| json!({ "name": name, "bytes": bytes })).collect();
        console::print_json(&json!({ "folder": folder.path, "bytes": all, "files": files }))?;
    }
    Ok(())
}

/// `sun-03.ktx2` and `sun-04.ktx2` are of one kind, `sun-*.ktx2`.
fn kind_of(name: &str) -> String {
    match name.split_once('-').and_then(|(begin, rest)| Some((begin, rest.split_once('.')?))) {
        Some((begin, (number, ending))) if number.starts_with(|c: char| c.is_ascii_digit()) => {
            format!("{begin}-*.{ending}")
        }
        _ => name.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_of_numbers_are_on_one_line_and_mean_the_same() {
        let value =
            json!({ "a": [1, 2.5, -3e-7], "b": [], "c": { "d": [[1, 2], [3, 4]], "e": "x" }, "f": 4, "g": [7] });
        let text = compact(&serde_json::to_string_pretty(&value).unwrap());
        assert_eq!(serde_json::from_str::<serde_json::Value>(&text).unwrap(), value);
        assert!(text.contains("[1, 2.5, -3e-7],") && text.contains("[1, 2],") && text.contains("[7]"), "{text}");
    }
}
