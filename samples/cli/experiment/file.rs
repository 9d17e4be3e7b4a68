//! The file that describes an experiment.
//!
//! ```toml
//! title = "Image-space radiosity beside a path tracer"
//! analysis = "compare"           # the function that makes the report
//! size = "64x48"
//! measures = ["mae", "nrmse"]
//!
//! [[scene]]
//! name = "cornell"
//! builtin = "cornell"            # or file = "scenes/x.gltf", looked for beside this file and in the folder of assets
//! group = "simple"
//! cameras = ["0"]                # index, name, camera file, LIST.toml#NAME; with random = 20, seed = 1 drawn ones
//!
//! [[technique]]
//! name = "isr"
//! kind = "isr"
//! settings = { "isr.sender" = "lit" }
//! matrix = { "isr.samples" = [24, 48] }
//!
//! [[reference]]
//! name = "path"
//! kind = "path"
//! settings = { samples = 16, bounces = 1 }
//!
//! [quick]
//! size = "32x24"
//! ```

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
};

use lucerna::{Error, Result};
use serde::Deserialize;
use serde_json::Value;
use toml::Spanned;

use crate::{
    args::Size,
    config,
    framing::DefaultLight,
    lights::{Point, Sun},
};

/// The experiments that come with the program: name and text.
pub const BUILTIN: &[(&str, &str)] =
    &[("isr", include_str!("../../experiments/isr.toml")), ("smoke", include_str!("../../experiments/smoke.toml"))];

/// Settings that are changed, by their keys.
pub type Changes = BTreeMap<String, Value>;

/// An experiment, checked, with the overrides of quick mode applied where asked for.
#[derive(Clone, Debug)]
pub struct Experiment {
    pub name: String,
    /// The file, for errors and for what lies beside it; `None`: comes with the program.
    pub path: Option<PathBuf>,
    pub quick: bool,
    pub title: String,
    pub summary: String,
    pub analysis: String,
    /// For the analysis.
    pub parameters: serde_json::Map<String, Value>,
    pub size: Size,
    pub seed: u32,
    pub measures: Vec<String>,
    /// Views that the report shows as images.
    pub images: usize,
    pub scenes: Vec<Scene>,
    /// Techniques, then references.
    pub methods: Vec<Method>,
    /// The text, so that the report can be made again.
    pub text: String,
}

/// What to do about a file that is not there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum IfMissing {
    #[default]
    Fail,
    /// Go on without, and say so in the report.
    Skip,
}

/// A scene and its views.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    pub name: String,
    pub builtin: Option<String>,
    pub file: Option<String>,
    /// Metres of one unit of the file.
    pub unit: Option<f64>,
    /// For tables: `simple`, `complex`…
    #[serde(default)]
    pub group: String,
    #[serde(default)]
    pub if_missing: IfMissing,
    pub environment: Option<String>,
    /// Whether there is light from all around; `false` takes it away, and leaves the lights.
    #[serde(default = "yes")]
    pub sky: bool,
    #[serde(default)]
    pub light: Vec<Point>,
    pub sun: Option<Sun>,
    #[serde(default)]
    pub default_light: DefaultLight,
    /// Of images in the report, EV; default: what suits the scene.
    pub exposure: Option<f64>,
    /// Cameras by index, name, file, or view of a list (`LIST.toml#NAME`).
    #[serde(default)]
    pub cameras: Vec<String>,
    /// All views of this list.
    pub list: Option<String>,
    /// All cameras that stand in the scene.
    #[serde(default)]
    pub recorded: bool,
    /// Number of views drawn at random.
    #[serde(default)]
    pub random: usize,
    /// Seed of these.
    #[serde(default = "one")]
    pub seed: u64,
    /// Only so many views, spread evenly.
    pub most_views: Option<usize>,
    /// In the file; 0 is unknown.
    #[serde(skip)]
    pub line: usize,
}

fn yes() -> bool {
    true
}

fn one() -> u64 {
    1
}

/// Techniques are what is examined, references what they are held against.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Role {
    #[default]
    Technique,
    Reference,
}

/// A technique or a reference with its settings.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Method {
    pub name: String,
    /// How it is rendered ([`super::kinds`]).
    pub kind: String,
    /// Starts from the paper's settings.
    #[serde(default)]
    pub paper: bool,
    #[serde(default)]
    pub settings: Changes,
    /// Every combination of these values is a variant.
    #[serde(default)]
    pub matrix: BTreeMap<String, Vec<Value>>,
    /// How often a frame is rendered, for its time.
    #[serde(default = "once")]
    pub repeat: u32,
    /// Layers that are kept beside the picture; default: direct and indirect.
    #[serde(default = "kept_layers")]
    pub layers: Vec<String>,
    /// Only these scenes.
    pub scenes: Option<Vec<String>>,
    /// Only so many views of each scene, spread evenly.
    pub most_views: Option<usize>,
    /// Where the program that it needs is not installed.
    #[serde(default)]
    pub if_missing: IfMissing,
    #[serde(skip)]
    pub role: Role,
    #[serde(skip)]
    pub line: usize,
}

fn once() -> u32 {
    1
}

fn kept_layers() -> Vec<String> {
    vec!["direct".into(), "indirect".into()]
}

impl Method {
    /// Every combination of the matrix, the last key changing fastest; one without entries if there is no matrix.
    pub fn variants(&self) -> Vec<Changes> {
        self.matrix.iter().fold(vec![Changes::new()], |variants, (key, values)| {
            let extended = |variant: &Changes| {
                values
                    .iter()
                    .map(|value| {
                        variant
                            .iter()
                            .map(|(k, v)| (k.clone(), v.clone()))
                            .chain([(key.clone(), value.clone())])
                            .collect()
                    })
                    .collect::<Vec<Changes>>()
            };
            variants.iter().flat_map(extended).collect()
        })
    }

    /// Whether it is run on a scene.
    pub fn takes(&self, scene: &str) -> bool {
        self.scenes.as_ref().is_none_or(|scenes| scenes.iter().any(|name| name == scene))
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Raw {
    title: String,
    #[serde(default)]
    summary: String,
    #[serde(default = "generic")]
    analysis: Spanned<String>,
    #[serde(default)]
    parameters: serde_json::Map<String, Value>,
    size: Spanned<String>,
    #[serde(default)]
    seed: u32,
    #[serde(default)]
    measures: Vec<Spanned<String>>,
    #[serde(default = "few")]
    images: usize,
    #[serde(default)]
    scene: Vec<Spanned<Scene>>,
    #[serde(default)]
    technique: Vec<Spanned<Method>>,
    #[serde(default)]
    reference: Vec<Spanned<Method>>,
    quick: Option<Spanned<Quick>>,
}

fn generic() -> Spanned<String> {
    Spanned::new(0..0, "compare".into())
}

fn few() -> usize {
    6
}

/// What quick mode changes.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct Quick {
    size: Option<Spanned<String>>,
    images: Option<usize>,
    /// Of each scene.
    most_views: Option<usize>,
    /// Only these.
    scenes: Option<Vec<Spanned<String>>>,
    #[serde(default)]
    scene: BTreeMap<Spanned<String>, QuickScene>,
    #[serde(default)]
    technique: BTreeMap<Spanned<String>, QuickMethod>,
    #[serde(default)]
    reference: BTreeMap<Spanned<String>, QuickMethod>,
    #[serde(default)]
    parameters: serde_json::Map<String, Value>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct QuickScene {
    random: Option<usize>,
    most_views: Option<usize>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct QuickMethod {
    #[serde(default)]
    skip: bool,
    #[serde(default)]
    settings: Changes,
    matrix: Option<BTreeMap<String, Vec<Value>>>,
    repeat: Option<u32>,
    most_views: Option<usize>,
    scenes: Option<Vec<String>>,
}

/// Finds an experiment by the name of one that comes with the program, or by its file.
///
/// # Errors
/// `Usage` if there is no such name, `Input` if the file has a mistake; the message names the line.
pub fn open(asked: &str, quick: bool) -> Result<Experiment> {
    if let Some((name, text)) = BUILTIN.iter().find(|(name, _)| *name == asked) {
        return parse(name, None, text, quick);
    }
    let path = Path::new(asked);
    if path.extension().is_some_and(|e| e == "toml") || path.is_file() {
        let name = path.file_stem().map_or("experiment".into(), |stem| stem.to_string_lossy());
        return parse(&name, Some(path), &config::read_text(path)?, quick);
    }
    let names: Vec<&str> = BUILTIN.iter().map(|(name, _)| *name).collect();
    let hint = config::nearest(asked, names.iter().copied()).map(|name| format!(" (did you mean '{name}'?)"));
    Err(Error::usage(format!("no experiment '{asked}'{}; there are {}", hint.unwrap_or_default(), names.join(", ")))
        .help("Name one of these, or a .toml file"))
}

/// Line of a byte, counted from 1.
fn line_at(text: &str, offset: usize) -> usize {
    text.as_bytes().iter().take(offset).filter(|byte| **byte == b'\n').count() + 1
}

/// Reads and checks the text of an experiment.
///
/// # Errors
/// `Input`; the message names the line.
pub fn parse(name: &str, path: Option<&Path>, text: &str, quick: bool) -> Result<Experiment> {
    let shown = path.map_or_else(|| PathBuf::from(format!("{name}.toml")), Path::to_path_buf);
    let wrong = |line: usize, error: Error| error.at(format!("line {line}")).in_file(&shown);
    let at = |span: std::ops::Range<usize>, what: String| wrong(line_at(text, span.start), Error::input(what));
    let raw: Raw = toml::from_str(text).map_err(|error| {
        at(error.span().unwrap_or(0..0), error.message().lines().next().unwrap_or_default().to_owned())
    })?;
    let size = |size: &Spanned<String>| {
        size.get_ref().parse().map_err(|what: String| at(size.span(), format!("size: {what}")))
    };
    let mut experiment = Experiment {
        name: name.to_owned(),
        path: path.map(Path::to_path_buf),
        quick,
        title: raw.title,
        summary: raw.summary,
        size: size(&raw.size)?,
        seed: raw.seed,
        parameters: raw.parameters,
        images: raw.images,
        text: text.to_owned(),
        analysis: raw.analysis.get_ref().clone(),
        measures: raw.measures.iter().map(|name| name.get_ref().clone()).collect(),
        scenes: Vec::new(),
        methods: Vec::new(),
    };
    super::analysis::find(raw.analysis.get_ref())
        .map_err(|error| wrong(line_at(text, raw.analysis.span().start), error))?;
    for measure in &raw.measures {
        super::results::known_measure(measure.get_ref())
            .map_err(|error| wrong(line_at(text, measure.span().start), error))?;
    }
    for entry in raw.scene {
        let line = line_at(text, entry.span().start);
        let scene = Scene { line, ..entry.into_inner() };
        if scene.builtin.is_some() == scene.file.is_some() {
            return Err(wrong(line, Error::input(format!("scene '{}' needs either builtin or file", scene.name))));
        }
        if scene.cameras.is_empty() && scene.list.is_none() && scene.random == 0 && !scene.recorded {
            let what = format!("scene '{}' has no views", scene.name);
            return Err(wrong(line, Error::input(what).help("Give it cameras, list, recorded = true or random")));
        }
        experiment.scenes.push(scene);
    }
    let roles = [(Role::Technique, raw.technique), (Role::Reference, raw.reference)];
    for (role, entry) in roles.into_iter().flat_map(|(role, list)| list.into_iter().map(move |entry| (role, entry))) {
        let line = line_at(text, entry.span().start);
        experiment.methods.push(Method { role, line, ..entry.into_inner() });
    }
    if let Some(changes) = raw.quick.filter(|_| quick) {
        let line = line_at(text, changes.span().start);
        let changes = changes.into_inner();
        if let Some(asked) = &changes.size {
            experiment.size = size(asked)?;
        }
        apply_quick(&mut experiment, changes, &|span, what| at(span.unwrap_or(0..0), what), line)?;
    }
    check(&experiment, &wrong, &|error, place| error.at(place).in_file(&shown))?;
    Ok(experiment)
}

fn apply_quick(
    experiment: &mut Experiment,
    quick: Quick,
    at: &dyn Fn(Option<std::ops::Range<usize>>, String) -> Error,
    _line: usize,
) -> Result<()> {
    experiment.images = quick.images.unwrap_or(experiment.images);
    experiment.parameters.extend(quick.parameters);
    if let Some(wanted) = &quick.scenes {
        for name in wanted {
            if !experiment.scenes.iter().any(|scene| scene.name == *name.get_ref()) {
                return Err(at(Some(name.span()), format!("quick.scenes: no scene '{}'", name.get_ref())));
            }
        }
        experiment.scenes.retain(|scene| wanted.iter().any(|name| *name.get_ref() == scene.name));
    }
    for scene in &mut experiment.scenes {
        scene.most_views = quick.most_views.or(scene.most_views);
    }
    for (name, changes) in quick.scene {
        let Some(scene) = experiment.scenes.iter_mut().find(|scene| scene.name == *name.get_ref()) else {
            return Err(at(Some(name.span()), format!("quick.scene: no scene '{}'", name.get_ref())));
        };
        scene.random = changes.random.unwrap_or(scene.random);
        scene.most_views = changes.most_views.or(scene.most_views);
    }
    let changes = quick.technique.into_iter().map(|entry| (Role::Technique, entry));
    let changes = changes.chain(quick.reference.into_iter().map(|entry| (Role::Reference, entry)));
    for (role, (name, changes)) in changes {
        let found = experiment.methods.iter().position(|method| method.role == role && method.name == *name.get_ref());
        let Some(index) = found else {
            return Err(at(Some(name.span()), format!("quick: there is no '{}' of this kind", name.get_ref())));
        };
        if changes.skip {
            experiment.methods.remove(index);
            continue;
        }
        let method = &mut experiment.methods[index];
        method.settings.extend(changes.settings);
        method.matrix = changes.matrix.unwrap_or_else(|| std::mem::take(&mut method.matrix));
        method.repeat = changes.repeat.unwrap_or(method.repeat);
        method.most_views = changes.most_views.or(method.most_views);
        method.scenes = changes.scenes.or(method.scenes.take());
    }
    Ok(())
}

/// What can only be said once everything is read.
fn check(
    experiment: &Experiment,
    wrong: &dyn Fn(usize, Error) -> Error,
    place_in: &dyn Fn(Error, &str) -> Error,
) -> Result<()> {
    let mut names = BTreeSet::new();
    for scene in &experiment.scenes {
        if !names.insert(&scene.name) {
            return Err(wrong(scene.line, Error::input(format!("there are two scenes named '{}'", scene.name))));
        }
    }
    if experiment.scenes.is_empty() {
        return Err(wrong(1, Error::input("there is no [[scene]]")));
    }
    if experiment.methods.is_empty() {
        return Err(wrong(1, Error::input("there is no [[technique]] and no [[reference]]")));
    }
    let mut methods = BTreeSet::new();
    for method in &experiment.methods {
        let place = format!("line {}: '{}'", method.line, method.name);
        let fail = |error: Error| place_in(error, &place);
        if !methods.insert(&method.name) {
            return Err(fail(Error::input("there are two techniques or references of this name")));
        }
        if method.repeat == 0 || method.repeat > 1000 {
            return Err(fail(Error::input(format!("repeat is {}, allowed are 1 to 1000", method.repeat))));
        }
        if let Some((key, _)) = method.matrix.iter().find(|(_, values)| values.is_empty()) {
            return Err(fail(Error::input(format!("matrix: '{key}' has no values"))));
        }
        let kind = super::kinds::find(&method.kind).map_err(fail)?;
        for variant in method.variants() {
            kind.effective(method, &variant).map_err(|error| fail(Error::input(error.to_string())))?;
        }
        for name in method.scenes.iter().flatten() {
            if !names.contains(name) && !experiment.quick {
                return Err(fail(Error::input(format!("scenes: no scene '{name}'"))));
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn variants_are_all_combinations_in_order() {
        let text = "name = 'a'\nkind = 'isr'\nmatrix = { y = [1, 2], x = ['p', 'q'] }";
        let method: Method = toml::from_str(text).unwrap();
        let variants: Vec<_> = method.variants().iter().map(|v| (v["x"].clone(), v["y"].clone())).collect();
        assert_eq!(variants, [("p", 1), ("p", 2), ("q", 1), ("q", 2)].map(|(x, y)| (json!(x), json!(y))));
    }
}
