//! What a command line means that names a file where a command is expected: `isr model.glb`, `lucerna model.glb`.

use std::{ffi::OsString, path::Path};

use clap::Command;
use lucerna::{Error, Result};
use lucerna_scenes as builtin;

use super::TECHNIQUES;
use crate::{
    config::nearest,
    listed::{PICTURES, has_ending},
};

/// Endings of scene files.
const SCENES: [&str; 4] = ["gltf", "glb", "obj", "zip"];

/// The words of a command line as they are meant, program first: with `render` where a scene or an option stands in the place of a command.
///
/// # Errors
/// `Usage` where something else stands there: a picture, a misspelt technique or the name of a built-in scene.
pub fn meant(program: &Command, mut words: Vec<OsString>) -> Result<Vec<OsString>> {
    let renders = program.find_subcommand("render").is_some();
    let Some(first) = words.get(1).filter(|_| renders) else { return Ok(words) };
    let text = first.to_string_lossy().into_owned();
    let is_command = text == "help" || program.find_subcommand(&text).is_some();
    if text == "render" && program.get_name() == "lucerna" {
        technique(words.get(2).and_then(|word| word.to_str()))?;
        return Ok(words);
    }
    if is_command || matches!(text.as_str(), "-h" | "--help" | "-V" | "--version") {
        return Ok(words);
    }
    if text.starts_with('-') || ending(&text, &SCENES) {
        words.insert(1, "render".into());
        return Ok(words);
    }
    if ending(&text, &PICTURES) {
        let error = Error::usage(format!("'{text}' is a picture, and {} renders scenes", program.get_name()));
        return Err(error.help("`lucerna info FILE` says what is in a picture, `lucerna tonemap FILE -o a.png` develops it, `lucerna rerun FILE` makes it again"));
    }
    if builtin::NAMES.contains(&text.as_str()) {
        return Err(built_in(program.get_name(), &text));
    }
    // A technique as the first word of `lucerna`: `lucerna isr model.glb`.
    if program.get_name() == "lucerna" && TECHNIQUES.contains(&text.as_str()) {
        words.insert(1, "render".into());
    }
    Ok(words)
}

fn built_in(program: &str, name: &str) -> Error {
    Error::usage(format!("'{name}' is a built-in scene, and no file"))
        .help(format!("{program} render --builtin {name}"))
}

/// Checks the word after `lucerna render`.
fn technique(word: Option<&str>) -> Result<()> {
    let Some(word) = word.filter(|word| !word.starts_with('-') && !TECHNIQUES.contains(word) && *word != "help") else {
        return Ok(());
    };
    if word.contains(['.', '/', '\\']) || Path::new(word).exists() {
        return match ending(word, &PICTURES) {
            true => {
                Err(Error::usage(format!("'{word}' is a picture, not a scene"))
                    .help("`lucerna tonemap` develops pictures"))
            }
            false => Ok(()),
        };
    }
    if builtin::NAMES.contains(&word) {
        return Err(built_in("lucerna", word));
    }
    // Two letters of a short name that changed places make it unlike itself for `nearest`.
    let swapped = || TECHNIQUES.into_iter().find(|name| strsim::osa_distance(word, name) <= 1);
    let hint =
        nearest(word, TECHNIQUES).or_else(swapped).map(|name| format!(" (did you mean '{name}'?)")).unwrap_or_default();
    let what = format!("'{word}' is neither a technique{hint} nor a scene file");
    Err(Error::usage(what)
        .help(format!("Techniques: {}. Scene files end in .gltf, .glb or .obj", TECHNIQUES.join(", "))))
}

fn ending(name: &str, known: &[&str]) -> bool {
    has_ending(Path::new(name), known)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn program(name: &'static str) -> Command {
        Command::new(name).subcommand(Command::new("render")).subcommand(Command::new("info"))
    }

    fn of(name: &'static str, words: &str) -> Result<String> {
        let words = [name].into_iter().chain(words.split_whitespace()).map(OsString::from).collect();
        Ok(meant(&program(name), words)?[1..].iter().map(|word| word.to_str().unwrap()).collect::<Vec<_>>().join(" "))
    }

    #[test]
    fn scenes_are_rendered_and_commands_stay() {
        for (name, words, meant) in [
            ("isr", "model.GLB -o a.png", "render model.GLB -o a.png"),
            ("isr", "--builtin office", "render --builtin office"),
            ("lucerna", "hall.obj", "render hall.obj"),
            ("lucerna", "isr hall.obj", "render isr hall.obj"),
            ("lucerna", "render isr hall.obj", "render isr hall.obj"),
            ("lucerna", "render folder/hall.h", "render folder/hall.h"),
            ("lucerna", "render --builtin office", "render --builtin office"),
            ("isr", "info a.png", "info a.png"),
            ("isr", "-h", "-h"),
            ("lucerna", "--version", "--version"),
            ("lucerna", "help", "help"),
            ("lucerna", "nonsense", "nonsense"),
            ("lucerna", "", ""),
        ] {
            assert_eq!(of(name, words).unwrap(), meant, "{name} {words}");
        }
    }

    #[test]
    fn other_words_get_the_right_command() {
        for (name, words, part) in [
            ("isr", "a.exr", "lucerna tonemap"),
            ("lucerna", "a.png", "lucerna info"),
            ("lucerna", "render a.png", "lucerna tonemap"),
            ("lucerna", "office", "--builtin office"),
            ("lucerna", "render office", "--builtin office"),
            ("isr", "office -o a.png", "isr render --builtin office"),
            ("lucerna", "render irs model.glb", "did you mean 'isr'"),
            ("lucerna", "render whatever", "Techniques: isr"),
        ] {
            let error = of(name, words).unwrap_err();
            assert!(error.exit_code() == 2 && error.to_string().contains(part), "{name} {words}: {error}");
        }
    }
}
