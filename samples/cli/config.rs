//! Settings of a technique from its defaults, a TOML file and `-D key=value`, in this order of precedence.
//!
//! Works for any serde struct: a key exists if the effective settings, written out again, contain it.

use std::path::{Path, PathBuf};

use lucerna::{Error, ErrorKind, Result, image, settings::Description, techniques::descriptions};
use serde::{Serialize, de::DeserializeOwned};
use serde_json::Value;

/// The options that change settings.
#[derive(clap::Args, Clone, Debug, Default)]
pub struct SettingsArgs {
    /// Set one setting (`--print-config` shows all)
    #[arg(short = 'D', value_name = "KEY=VALUE", help_heading = "Settings")]
    pub define: Vec<String>,

    /// Read settings from a TOML file; -D wins over it
    #[arg(long = "settings", value_name = "FILE.toml", help_heading = "Settings")]
    pub file: Option<PathBuf>,

    /// Post-processing pipeline after the technique: a TOML file with shaders beside it (docs/effects.md). Its
    /// constants are settings: -D effects.NAME=VALUE
    #[arg(long, value_name = "FILE.toml", help_heading = "Settings")]
    pub effects: Option<PathBuf>,

    /// Print the settings in effect as TOML, then stop
    #[arg(long, help_heading = "Settings")]
    pub print_config: bool,
}

impl SettingsArgs {
    /// The settings in effect over `base`.
    ///
    /// # Errors
    /// `Usage` or `Input`, naming the key.
    pub fn effective<S: Serialize + DeserializeOwned>(&self, base: &S) -> Result<S> {
        if self.effects.is_some() {
            let what = "a post-processing pipeline follows a technique of `lucerna render`, `run` and `view`; this command has none";
            return Err(Error::usage(what).at("--effects"));
        }
        self.with_effects(base)
    }

    /// As [`Self::effective`], for settings with a post-processing pipeline.
    ///
    /// # Errors
    /// As [`Self::effective`].
    pub fn with_effects<S: Serialize + DeserializeOwned>(&self, base: &S) -> Result<S> {
        effective(base, self.file.as_deref(), &self.define)
    }

    /// The result of checking the settings, with an error that names the settings file if the file is the cause. `checked`: result for
    /// the settings in effect. `of_file`: the same check for the settings without `-D`.
    ///
    /// # Errors
    /// The error of `checked`; of kind `Input` and with the file's name if `of_file` fails as well.
    pub fn blamed(&self, checked: Result<()>, of_file: impl FnOnce() -> Result<()>) -> Result<()> {
        checked.map_err(|error| {
            let Some(path) = &self.file else { return error };
            match of_file() {
                Err(own) if own.to_string() == error.to_string() => error.of_kind(ErrorKind::Input).in_file(path),
                _ => error,
            }
        })
    }

    /// These options without `-D`.
    pub fn file_alone(&self) -> Self {
        Self { define: Vec::new(), ..self.clone() }
    }
}

/// Maximum size of a settings file, bytes.
const MAX_FILE: u64 = 1 << 20;

/// The settings in effect. `defines` are `dotted.key=value`, the value in TOML or a bare word.
pub fn effective<S: Serialize + DeserializeOwned>(base: &S, file: Option<&Path>, defines: &[String]) -> Result<S> {
    let mut tree = to_value(base)?;
    if let Some(path) = file {
        let text = read_text(path)?;
        let table: toml::Table =
            toml::from_str(&text).map_err(|error| Error::input(first_lines(&error.to_string())).in_file(path))?;
        let overrides = serde_json::to_value(&table).map_err(|error| Error::input(error.to_string()).in_file(path))?;
        apply_all::<S>(&mut tree, &mut Vec::new(), &overrides)
            .map_err(|what| Error::input(what.0).at(what.1).in_file(path))?;
    }
    for define in defines {
        let Some((key, text)) = define.split_once('=') else {
            return Err(Error::usage(format!("-D {define}: expected key=value")));
        };
        let path = full_path(&tree, key.trim());
        apply::<S>(&mut tree, &path, scalar(text.trim()))
            .map_err(|what| Error::usage(format!("-D {define}: {}", what.0)))?;
    }
    serde_json::from_value(tree).map_err(|error| Error::usage(format!("settings: {error}")))
}

/// `base` with changed settings. The keys are as with `-D`, or name groups of settings.
///
/// # Errors
/// `Usage`, naming the key.
pub fn with<'a, S: Serialize + DeserializeOwned>(
    base: &S,
    changes: impl IntoIterator<Item = (&'a String, &'a Value)>,
) -> Result<S> {
    let mut tree = to_value(base)?;
    for (key, value) in changes {
        let path = full_path(&tree, key);
        let nested = path.iter().rev().fold(value.clone(), |value, key| serde_json::json!({ key: value }));
        apply_all::<S>(&mut tree, &mut Vec::new(), &nested).map_err(|what| Error::usage(what.0).at(what.1))?;
    }
    serde_json::from_value(tree).map_err(|error| Error::usage(format!("settings: {error}")))
}

/// The settings as TOML, for `--print-config`; reading it back gives the same settings.
pub fn to_toml<S: Serialize>(settings: &S) -> Result<String> {
    toml::to_string(settings).map_err(|error| Error::new(ErrorKind::Runtime, "settings are not TOML").caused_by(error))
}

/// The settings as JSON with the shortest numbers that read back as the same f32.
pub fn to_value<S: Serialize>(settings: &S) -> Result<Value> {
    serde_json::to_string(settings)
        .and_then(|text| serde_json::from_str(&text))
        .map_err(|error| Error::new(ErrorKind::Runtime, "settings are not JSON").caused_by(error))
}

/// Reads a small text file. It must be a regular file of at most 1 MiB; the limit also holds if the file grows while it is read.
pub(crate) fn read_text(path: &Path) -> Result<String> {
    image::read_text_checked(path, MAX_FILE)
}

/// An error message, and the key to which it refers.
struct Wrong(String, String);

fn apply_all<S: Serialize + DeserializeOwned>(
    tree: &mut Value,
    path: &mut Vec<String>,
    overrides: &Value,
) -> Result<(), Wrong> {
    let Value::Object(entries) = overrides else { return Ok(()) };
    for (key, value) in entries {
        path.push(key.clone());
        // A table is merged into a table of the settings. If the settings have no table there, it is a value: an enum variant with fields.
        if value.is_object() && get(tree, path).is_some_and(Value::is_object) {
            let mut trial = tree.clone();
            let as_group = apply_all::<S>(&mut trial, path, value);
            match as_group {
                Ok(()) => *tree = trial,
                Err(wrong) => apply::<S>(tree, path, value.clone()).map_err(|_| wrong)?,
            }
        } else {
            apply::<S>(tree, path, value.clone())?;
        }
        path.pop();
    }
    Ok(())
}

/// The full path of `key`. The groups may be omitted if only one setting ends with the key: `samples` for `isr.samples`.
fn full_path(tree: &Value, key: &str) -> Vec<String> {
    let split = |key: &str| key.split('.').map(str::to_owned).collect::<Vec<_>>();
    let asked = split(key);
    if get(tree, &asked[..1]).is_some() {
        return asked;
    }
    let mut keys = Vec::new();
    leaves(tree, &mut String::new(), &mut keys);
    let ending = format!(".{key}");
    match keys.iter().filter(|full| full.ends_with(&ending)).collect::<Vec<_>>()[..] {
        [only] => split(only),
        _ => asked,
    }
}

/// Sets one key. Fails if the settings have no such key or reject the value.
fn apply<S: Serialize + DeserializeOwned>(tree: &mut Value, path: &[String], value: Value) -> Result<(), Wrong> {
    let dotted = path.join(".");
    let mut trial = tree.clone();
    if !set(&mut trial, path, value) {
        return Err(Wrong(unknown(tree, path), dotted));
    }
    let settings: S = match serde_json::from_value(trial) {
        Ok(settings) => settings,
        Err(_) if get(tree, path).is_none() => return Err(Wrong(unknown(tree, path), dotted)),
        Err(error) => return Err(Wrong(error.to_string(), dotted)),
    };
    let result = to_value(&settings).map_err(|error| Wrong(error.to_string(), dotted.clone()))?;
    if get(&result, path).is_none() {
        return Err(Wrong(unknown(tree, path), dotted));
    }
    *tree = result;
    Ok(())
}

fn get<'a>(tree: &'a Value, path: &[String]) -> Option<&'a Value> {
    path.iter().try_fold(tree, |value, key| value.as_object()?.get(key))
}

/// Returns false if the path leads through a value that is not a table.
fn set(tree: &mut Value, path: &[String], value: Value) -> bool {
    let Some((last, way)) = path.split_last() else { return false };
    let mut at = tree;
    for key in way {
        match at.as_object_mut().and_then(|table| table.get_mut(key)) {
            Some(next) => at = next,
            None => return false,
        }
    }
    match at.as_object_mut() {
        Some(table) => {
            table.insert(last.clone(), value);
            true
        }
        None => false,
    }
}

/// A TOML value, or else a bare word.
fn scalar(text: &str) -> Value {
    toml::from_str::<toml::Table>(&format!("value = {text}"))
        .ok()
        .filter(|table| table.len() == 1)
        .and_then(|mut table| table.remove("value"))
        .and_then(|value| serde_json::to_value(value).ok())
        .unwrap_or_else(|| Value::String(text.to_owned()))
}

fn unknown(tree: &Value, path: &[String]) -> String {
    let mut keys = Vec::new();
    leaves(tree, &mut String::new(), &mut keys);
    let asked = path.join(".");
    let (own, others): (Vec<_>, Vec<_>) = descriptions().into_iter().partition(|(name, _)| tree.get(*name).is_some());
    // The settings of a technique are in a group of its name.
    let of = own.first().map(|(name, _)| format!(" of {name}")).unwrap_or_default();
    let hint = nearest(&asked, keys.iter().map(String::as_str)).map(|k| format!(" (did you mean '{k}'?)"));
    let has = |(name, description): &(&'static str, &Description)| {
        let key = asked.strip_prefix(&format!("{name}.")).unwrap_or(&asked);
        description.key(key).is_some().then_some(*name)
    };
    let elsewhere: Vec<&str> = others.iter().filter_map(has).collect();
    let elsewhere = match &elsewhere[..] {
        [] => String::new(),
        names => format!("; it is a setting of {}", names.join(" and ")),
    };
    format!("unknown setting '{asked}'{of}{}{elsewhere}; allowed: {}", hint.unwrap_or_default(), keys.join(", "))
}

fn leaves(tree: &Value, prefix: &mut String, keys: &mut Vec<String>) {
    match tree {
        Value::Object(table) if !table.is_empty() => {
            for (key, value) in table {
                let length = prefix.len();
                if length > 0 {
                    prefix.push('.');
                }
                prefix.push_str(key);
                leaves(value, prefix, keys);
                prefix.truncate(length);
            }
        }
        _ => keys.push(prefix.clone()),
    }
}

/// The name most similar to `asked`, if one is similar enough.
pub fn nearest<'a>(asked: &str, names: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    names
        .into_iter()
        .map(|name| (likeness(asked, name).max(likeness(asked, name.rsplit('.').next().unwrap_or(name))), name))
        .filter(|(likeness, _)| *likeness > 0.75)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, name)| name)
}

fn likeness(a: &str, b: &str) -> f64 {
    strsim::jaro_winkler(&a.to_lowercase(), &b.to_lowercase())
}

/// The first lines of a TOML error. The rest only repeats the source line.
fn first_lines(text: &str) -> String {
    let mut lines = text.lines().filter(|l| !l.trim_start().starts_with('|') && !l.contains(" | "));
    let first = lines.next().unwrap_or_default().trim();
    match lines.next_back() {
        Some(last) => format!("{first}: {}", last.trim()),
        None => first.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use serde::Deserialize;

    use super::*;

    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(rename_all = "kebab-case")]
    enum Shadow {
        Plain,
        Esm { c: f32 },
    }

    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(default)]
    struct Blur {
        radius: u32,
        sigma: f32,
    }
    impl Default for Blur {
        fn default() -> Self {
            Self { radius: 4, sigma: 0.1 }
        }
    }

    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(default)]
    struct Settings {
        samples: u32,
        strength: f32,
        limit: Option<f32>,
        shadow: Shadow,
        blur: Blur,
    }
    impl Default for Settings {
        fn default() -> Self {
            Self { samples: 48, strength: 0.5, limit: None, shadow: Shadow::Esm { c: 90.0 }, blur: Blur::default() }
        }
    }

    fn with(file: Option<&str>, defines: &[&str]) -> Result<Settings> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("s.toml");
        if let Some(text) = file {
            std::fs::write(&path, text).unwrap();
        }
        let defines: Vec<String> = defines.iter().map(|&d| d.to_owned()).collect();
        effective(&Settings::default(), file.map(|_| path.as_path()), &defines)
    }

    #[test]
    fn defaults_then_file_then_command_line() {
        let settings =
            with(Some("samples = 24\nstrength = 1\n[blur]\nradius = 7"), &["samples=80", "limit=2"]).unwrap();
        let expected = Settings {
            samples: 80,
            strength: 1.0,
            limit: Some(2.0),
            blur: Blur { radius: 7, sigma: 0.1 },
            ..Settings::default()
        };
        assert_eq!(settings, expected);
    }

    #[test]
    fn an_enum_can_change_its_variant() {
        assert_eq!(with(None, &["shadow=plain"]).unwrap().shadow, Shadow::Plain);
        assert_eq!(with(None, &["shadow.esm.c=20"]).unwrap().shadow, Shadow::Esm { c: 20.0 });
        assert_eq!(with(Some("shadow = 'plain'"), &[]).unwrap().shadow, Shadow::Plain);
        assert_eq!(with(Some("[shadow.esm]\nc = 30.0"), &[]).unwrap().shadow, Shadow::Esm { c: 30.0 });
    }

    #[test]
    fn groups_may_be_left_out_where_it_is_clear() {
        assert_eq!(with(None, &["radius=9"]).unwrap().blur.radius, 9);
        assert_eq!(with(None, &["blur.radius=8"]).unwrap().blur.radius, 8);
        assert!(with(None, &["adius=9"]).is_err());
    }

    #[test]
    fn an_unknown_key_names_the_nearest_and_all() {
        let text = with(None, &["sampels=3"]).unwrap_err().to_string();
        assert!(text.contains("did you mean 'samples'") && text.contains("blur.radius"), "{text}");
        let text = with(Some("[blur]\nradios = 3"), &[]).unwrap_err().to_string();
        assert!(text.contains("s.toml") && text.contains("did you mean 'blur.radius'"), "{text}");
        for bad in ["blur.radius.x=3", "blur.sigmaa=1", "x.y=1", "=1", "samples"] {
            assert_eq!(with(None, &[bad]).unwrap_err().exit_code(), 2, "{bad}");
        }
    }

    #[test]
    fn a_wrong_type_says_what_is_expected() {
        let text = with(None, &["samples=many"]).unwrap_err().to_string();
        assert!(text.contains("samples=many") && text.contains("u32"), "{text}");
        let text = with(None, &["shadow=soft"]).unwrap_err().to_string();
        assert!(text.contains("plain"), "{text}");
        assert_eq!(with(Some("samples = -1"), &[]).unwrap_err().exit_code(), 3);
        assert_eq!(with(Some("samples = = 1"), &[]).unwrap_err().exit_code(), 3);
    }

    #[cfg(unix)]
    #[test]
    fn only_regular_files_of_some_length_are_read() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe.toml");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        for path in [Path::new("/dev/zero"), &pipe] {
            let error = effective(&Settings::default(), Some(path), &[]).unwrap_err();
            let text = error.to_string();
            assert!(error.exit_code() == 3 && text.contains("a device or a pipe"), "{text}");
            assert!(text.contains(&path.display().to_string()), "{text}");
        }
        let path = folder.path().join("s.toml");
        std::fs::write(&path, vec![b'#'; 1 << 20]).unwrap();
        read_text(&path).unwrap();
        std::fs::write(&path, vec![b'#'; (1 << 20) + 1]).unwrap();
        assert!(read_text(&path).unwrap_err().to_string().contains("at most 1048576"));
        std::fs::write(&path, b"a = \"\xff\"").unwrap();
        assert!(read_text(&path).unwrap_err().to_string().contains("byte 5 is not UTF-8"));
    }

    #[test]
    fn printed_settings_read_back_the_same() {
        let settings = with(None, &["strength=0.1", "samples=24"]).unwrap();
        let text = to_toml(&settings).unwrap();
        assert!(text.contains("strength = 0.1\n"), "{text}");
        assert_eq!(with(Some(&text), &[]).unwrap(), settings);
    }
}
