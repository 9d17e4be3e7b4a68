//! Names of input and output pictures.

use std::path::{Path, PathBuf};

pub use crate::piped::{PIPE, STDIN};
use crate::{args::Frames, compare::split, piped};
use lucerna::{Error, Result};

/// One picture to be read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Input {
    /// As messages call it.
    pub name: String,
    /// `None`: standard input.
    pub path: Option<PathBuf>,
    pub layer: Option<String>,
    /// The file name without its extension, for output names.
    pub stem: String,
    /// The number in a sequence, else the position in the list of inputs.
    pub frame: u32,
    /// `Some` for a frame of a sequence; true for its first frame.
    pub sequence: Option<bool>,
    /// For a numbered sequence: its name, and the number of its first frame.
    pub pattern: Option<(String, u32)>,
}

/// A number between two texts: `%04d`, `####` or `{frame:04}` in a name.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Numbered {
    before: String,
    digits: usize,
    after: String,
}

impl Numbered {
    fn parse(text: &str) -> Option<Self> {
        let cut = |start: usize, end: usize, digits: usize| {
            Some(Self { before: text[..start].to_owned(), digits, after: text[end..].to_owned() })
        };
        if let Some(start) = text.find('#') {
            let count = text[start..].bytes().take_while(|&b| b == b'#').count();
            return cut(start, start + count, count);
        }
        if let Some(start) = text.find("{frame") {
            let end = start + text[start..].find('}')?;
            let width = match &text[start + 6..end] {
                "" => 1,
                width => width.strip_prefix(':')?.parse().ok()?,
            };
            return cut(start, end + 1, width).filter(|n| n.digits <= 9);
        }
        let start = text.find('%')?;
        let end = start + text[start..].find('d')?;
        let width = &text[start + 1..end];
        let width = if width.is_empty() { 1 } else { width.parse().ok()? };
        cut(start, end + 1, width).filter(|n| n.digits <= 9)
    }

    fn fill(&self, frame: u32) -> String {
        format!("{}{frame:0width$}{}", self.before, self.after, width = self.digits)
    }

    /// Numbers of the existing files, ascending.
    fn on_disk(&self) -> Result<Vec<u32>> {
        let (folder, start) = match self.before.rsplit_once('/') {
            Some(("", start)) => ("/", start),
            Some((folder, start)) => (folder, start),
            None => (".", self.before.as_str()),
        };
        let cannot = |error: std::io::Error| Error::input("the folder cannot be read").in_file(folder).caused_by(error);
        let mut numbers = Vec::new();
        for entry in std::fs::read_dir(folder).map_err(cannot)? {
            let name = entry.map_err(cannot)?.file_name();
            let number = name.to_str().and_then(|name| name.strip_prefix(start)?.strip_suffix(self.after.as_str()));
            let all_digits = |n: &&str| n.len() >= self.digits && n.bytes().all(|b| b.is_ascii_digit());
            if let Some(number) = number.filter(all_digits).and_then(|n| n.parse().ok())
                // Only the spelling of the pattern counts: of 7 and 0007 one is frame 7.
                && Path::new(&self.fill(number)).file_name() == Some(&name)
            {
                numbers.push(number);
            }
        }
        numbers.sort_unstable();
        Ok(numbers)
    }
}

/// All pictures that the command line names, and notes about missing numbers.
///
/// # Errors
/// `Usage` for standard input named twice, `Input` for sequences without frames.
pub fn inputs(
    names: &[String],
    layer: Option<&str>,
    frames: Option<&Frames>,
    sequence: bool,
) -> Result<(Vec<Input>, Vec<String>)> {
    let (mut list, mut notes) = (Vec::new(), Vec::new());
    piped::once(names.iter().map(String::as_str))?;
    let mut numbered = false;
    for name in names {
        if name == PIPE {
            let frame = list.len() as u32;
            let stem = "stdin".to_owned();
            let layer = layer.map(str::to_owned);
            list.push(Input { name: STDIN.into(), path: None, layer, stem, frame, sequence: None, pattern: None });
            continue;
        }
        let (file, own) = split(name);
        let layer = own.or(layer).map(str::to_owned);
        let input = |path: PathBuf, frame: u32, sequence: Option<bool>| Input {
            name: path.display().to_string(),
            stem: path.file_stem().map_or_else(|| "picture".into(), |stem| stem.to_string_lossy().into_owned()),
            path: Some(path),
            layer: layer.clone(),
            frame,
            sequence,
            pattern: None,
        };
        match Numbered::parse(file).filter(|_| !Path::new(file).exists()) {
            None => {
                let frame = list.len() as u32;
                list.push(input(file.into(), frame, None));
            }
            Some(pattern) => {
                numbered = true;
                let numbers: Vec<u32> = match frames {
                    Some(frames) => frames.0.clone().collect(),
                    None => pattern.on_disk()?,
                };
                let (Some(first), Some(last)) = (numbers.first(), numbers.last()) else {
                    return Err(Error::input("no file has a name of this kind").in_file(file));
                };
                let missing = (last - first + 1) as usize - numbers.len();
                if missing > 0 {
                    notes.push(format!("{file}: {missing} numbers between {first} and {last} are missing"));
                }
                let each = numbers.iter().enumerate();
                let named = Some((file.to_owned(), *first));
                list.extend(
                    each.map(|(i, &n)| Input {
                        pattern: named.clone(),
                        ..input(pattern.fill(n).into(), n, Some(i == 0))
                    }),
                );
            }
        }
    }
    if frames.is_some() && !numbered {
        return Err(Error::usage("--frames is for numbered sequences; no input has #### or %04d in its name"));
    }
    if sequence {
        for (i, input) in list.iter_mut().enumerate() {
            (input.frame, input.sequence, input.pattern) = (i as u32, Some(i == 0), None);
        }
    }
    Ok((list, notes))
}

/// The frames of a numbered sequence from `first` to `last`, for making a picture again.
///
/// # Errors
/// `Input` if the first or the last frame does not exist.
pub fn frames(pattern: &str, layer: Option<&str>, first: u32, last: u32) -> Result<Vec<Input>> {
    let numbered = Numbered::parse(pattern).ok_or_else(|| {
        Error::input(format!("{pattern:?} has no ####, %04d or {{frame}} in its name")).at("sequence")
    })?;
    let there = numbered.on_disk()?;
    let path = |frame: u32| PathBuf::from(numbered.fill(frame));
    let list: Vec<Input> = there
        .into_iter()
        .filter(|frame| (first..=last).contains(frame))
        .enumerate()
        .map(|(i, frame)| Input {
            name: path(frame).display().to_string(),
            path: Some(path(frame)),
            layer: layer.map(str::to_owned),
            stem: String::new(),
            frame,
            sequence: Some(i == 0),
            pattern: Some((pattern.to_owned(), first)),
        })
        .collect();
    let ends = |input: Option<&Input>, frame: u32| input.is_some_and(|input| input.frame == frame);
    if !ends(list.first(), first) || !ends(list.last(), last) {
        return Err(
            Error::input(format!("frames {first} and {last} of the sequence are not both there")).in_file(pattern)
        );
    }
    Ok(list)
}

/// A name to write, with its placeholders.
#[derive(Clone, Debug)]
pub struct OutputName(String);

const ALLOWED: &str = "allowed are {name}, {frame:04} (or #### or %04d), {operator} and {mode}";

impl OutputName {
    /// A folder takes `{name}.png`.
    ///
    /// # Errors
    /// `Usage` for placeholders that are not known.
    pub fn parse(text: &str) -> Result<Self> {
        let name = if text != PIPE && (text.ends_with('/') || Path::new(text).is_dir()) {
            format!("{}/{{name}}.png", text.trim_end_matches('/'))
        } else {
            text.to_owned()
        };
        let parsed = Self(name);
        let (sequence, pattern) = (None, None);
        let input = Input { name: "x".into(), path: None, layer: None, stem: "x".into(), frame: 0, sequence, pattern };
        let filled = parsed.fill(&input, "x", "x");
        if filled.contains(['{', '}']) {
            return Err(Error::usage(format!("output '{text}': an unknown placeholder; {ALLOWED}")));
        }
        Ok(parsed)
    }

    /// As given, a folder completed.
    pub fn text(&self) -> &str {
        &self.0
    }

    /// The name for a picture. Names of inputs never add a folder.
    pub fn fill(&self, input: &Input, operator: &str, mode: &str) -> String {
        let numbered = Numbered::parse(&self.0).map_or_else(|| self.0.clone(), |pattern| pattern.fill(input.frame));
        // Other characters are kept, so that inputs with different names have different outputs.
        let stem = input.stem.replace(['/', '\\', '\0'], "-");
        numbered
            .replace("{operator}", operator)
            .replace("{mode}", mode)
            // The name is inserted last, because a file name may contain placeholders.
            .replace("{name}", &stem)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn strings(names: &[&str]) -> Vec<String> {
        names.iter().map(|&n| n.to_owned()).collect()
    }

    #[test]
    fn three_ways_to_write_a_number() {
        let expected = Numbered { before: "a/b-".into(), digits: 4, after: ".exr".into() };
        for text in ["a/b-####.exr", "a/b-%04d.exr", "a/b-{frame:04}.exr"] {
            assert_eq!(Numbered::parse(text), Some(expected.clone()), "{text}");
        }
        assert_eq!(expected.fill(12), "a/b-0012.exr");
        assert_eq!(Numbered::parse("x%d.hdr").unwrap().fill(12), "x12.hdr");
        for plain in ["a.exr", "100%.exr", "{name}.png", "%x04d.png"] {
            assert_eq!(Numbered::parse(plain), None, "{plain}");
        }
    }

    #[test]
    fn sequences_are_what_lies_in_the_folder() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["s-0010.exr", "s-0009.exr", "s-0012.exr", "s-7.exr", "s-abcd.exr", "t-0001.exr", "s-00011.exr"] {
            std::fs::write(folder.path().join(name), b"x").unwrap();
        }
        let pattern = folder.path().join("s-####.exr").display().to_string();
        let (list, notes) = inputs(std::slice::from_ref(&pattern), None, None, false).unwrap();
        let found: Vec<_> = list.iter().map(|i| (i.frame, i.stem.as_str(), i.sequence)).collect();
        assert_eq!(found, [(9, "s-0009", Some(true)), (10, "s-0010", Some(false)), (12, "s-0012", Some(false))]);
        assert!(notes.len() == 1 && notes[0].contains("1 numbers between 9 and 12"), "{notes:?}");
        let (list, _) = inputs(&[pattern], None, Some(&Frames(3..5)), false).unwrap();
        assert_eq!(list.iter().map(|i| i.frame).collect::<Vec<_>>(), [3, 4]);
        let none = folder.path().join("u-####.exr").display().to_string();
        assert_eq!(inputs(&[none], None, None, false).unwrap_err().exit_code(), 3);
        assert_eq!(inputs(&strings(&["a.exr"]), None, Some(&Frames(0..2)), false).unwrap_err().exit_code(), 2);
        assert_eq!(inputs(&strings(&["-", "-"]), None, None, false).unwrap_err().exit_code(), 2);
    }

    #[test]
    fn lists_stand_alone_unless_they_are_a_sequence() {
        let (list, _) = inputs(&strings(&["b.exr:direct", "a.hdr", "-"]), Some("albedo"), None, false).unwrap();
        let seen: Vec<_> = list.iter().map(|i| (i.stem.as_str(), i.layer.as_deref(), i.sequence)).collect();
        assert_eq!(seen, [("b", Some("direct"), None), ("a", Some("albedo"), None), ("stdin", Some("albedo"), None)]);
        let (list, _) = inputs(&strings(&["b.exr", "a.hdr"]), None, None, true).unwrap();
        assert_eq!(list.iter().map(|i| i.sequence).collect::<Vec<_>>(), [Some(true), Some(false)]);
    }

    #[test]
    fn output_names() {
        let (list, _) = inputs(&strings(&["x/church {mode}.hdr"]), None, None, false).unwrap();
        let fill = |text: &str| OutputName::parse(text).unwrap().fill(&list[0], "agx", "global");
        assert_eq!(fill("o/{name}-{operator}-{mode}-%03d.png"), "o/church {mode}-agx-global-000.png");
        assert_eq!(fill("out/"), "out/church {mode}.png");
        assert_eq!(fill("-"), "-");
        assert_eq!(OutputName::parse("{nmae}.png").unwrap_err().exit_code(), 2);
    }
}
