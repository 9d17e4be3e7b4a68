//! Reading and checking the text of an experiment.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
};

use lucerna::{Error, Result};
use serde::Deserialize;
use serde_json::Value;
use toml::Spanned;

use super::{Changes, Experiment, Method, Narrowed, Role, Scene};
use crate::{
    args::Size,
    experiment::{analysis, kinds, results},
};

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

/// The changes of quick mode.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct Quick {
    size: Option<Spanned<String>>,
    images: Option<usize>,
    /// Maximum of views per scene.
    most_views: Option<usize>,
    /// Renders only these scenes.
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
    sizes: Option<Vec<String>>,
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
        narrowed: Narrowed::default(),
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
    analysis::find(raw.analysis.get_ref()).map_err(|error| wrong(line_at(text, raw.analysis.span().start), error))?;
    for measure in &raw.measures {
        results::known_measure(measure.get_ref()).map_err(|error| wrong(line_at(text, measure.span().start), error))?;
    }
    for entry in raw.scene {
        let line = line_at(text, entry.span().start);
        let scene = Scene { line, ..entry.into_inner() };
        what_it_is(&scene).map_err(|error| wrong(line, error))?;
        if scene.image.is_none()
            && scene.cameras.is_empty()
            && scene.list.is_none()
            && scene.random == 0
            && !scene.recorded
        {
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
    // Checked before quick mode removes techniques.
    analysis::check(&experiment).map_err(|error| error.in_file(&shown))?;
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

/// Checks that a scene has exactly one source, and only the keys that this source allows.
fn what_it_is(scene: &Scene) -> Result<()> {
    let name = &scene.name;
    if [&scene.builtin, &scene.file, &scene.image].iter().filter(|source| source.is_some()).count() != 1 {
        return Err(Error::input(format!("scene '{name}' needs one of builtin, file and image")));
    }
    let views = !scene.cameras.is_empty() || scene.list.is_some() || scene.random > 0 || scene.recorded;
    let lights = !scene.light.is_empty()
        || !scene.lights
        || !scene.emission
        || scene.sun.is_some()
        || scene.environment.is_some();
    let changed = scene.unit.is_some() || scene.ground.is_some() || !scene.sizes.is_empty();
    if scene.image.is_some() && (views || lights || changed) {
        let what = format!("scene '{name}' is an image, which has its own light, view and size");
        return Err(Error::input(what).help(
            "Leave out unit, ground, cameras, list, recorded, random, lights, emission, light, sun, environment, sizes",
        ));
    }
    if scene.dark_views && scene.random == 0 {
        let what = format!("scene '{name}': dark_views is about drawn views, and random is 0");
        return Err(Error::input(what).help("Set random, or leave out dark_views"));
    }
    if scene.random > MOST_DRAWN {
        let what = format!("scene '{name}': random is {}, at most {MOST_DRAWN} views are drawn", scene.random);
        return Err(Error::input(what));
    }
    for size in &scene.sizes {
        size.parse::<Size>().map_err(|what| Error::input(format!("scene '{name}': sizes: {what}")))?;
    }
    Ok(())
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
        scene.sizes = changes.sizes.unwrap_or_else(|| std::mem::take(&mut scene.sizes));
        what_it_is(scene).map_err(|error| at(Some(name.span()), error.to_string()))?;
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

/// Maximum of variants per technique.
const MOST_VARIANTS: usize = 10_000;
/// Maximum of random views per scene, as for `lucerna views`.
const MOST_DRAWN: usize = 10_000;

/// Checks that need the whole experiment.
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
        let kind = kinds::find(&method.kind).map_err(fail)?;
        let count = method.variant_count();
        if count > MOST_VARIANTS {
            let what = format!("matrix: {count} combinations of its values, at most {MOST_VARIANTS} are made");
            return Err(fail(Error::input(what)));
        }
        for variant in method.variants() {
            kind.effective(method, &variant).map_err(|error| fail(Error::input(error.to_string())))?;
        }
        if let Some(image) =
            experiment.scenes.iter().find(|s| s.image.is_some() && method.takes(&s.name) && !kind.of_images)
        {
            let what = format!("'{}' renders scenes, and '{}' is an image", method.kind, image.name);
            return Err(fail(Error::input(what).help("Name the scenes that it renders with scenes = [...]")));
        }
        for name in method.scenes.iter().flatten() {
            if !names.contains(name) && !experiment.quick {
                return Err(fail(Error::input(format!("scenes: no scene '{name}'"))));
            }
        }
    }
    Ok(())
}
