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
//! builtin = "cornell"            # or file = "scenes/x.gltf", looked for beside this file and in the folder of assets;
//!                                # or image = "x.exr", a picture that is only tone mapped
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

mod narrow;
mod read;

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

pub use narrow::Narrowed;
pub use read::parse;

use lucerna::{Error, Result};
use serde::Deserialize;
use serde_json::Value;

use crate::{
    args::Size,
    config,
    default_light::DefaultLight,
    ground::GroundOptions,
    lights::{Point, Sun},
    source,
};

/// The built-in experiments: name and text.
pub const BUILTIN: &[(&str, &str)] = &[
    ("daylight", include_str!("../../../experiments/daylight.toml")),
    ("daylight-foreign", include_str!("../../../experiments/daylight-foreign.toml")),
    ("daylight-kinds", include_str!("../../../experiments/daylight-kinds.toml")),
    ("fiv", include_str!("../../../experiments/fiv.toml")),
    ("igi", include_str!("../../../experiments/igi.toml")),
    ("isr", include_str!("../../../experiments/isr.toml")),
    ("isr-pair", include_str!("../../../experiments/isr-pair.toml")),
    ("prt", include_str!("../../../experiments/prt.toml")),
    ("smoke", include_str!("../../../experiments/smoke.toml")),
    ("tonemap", include_str!("../../../experiments/tonemap.toml")),
    ("yardstick", include_str!("../../../experiments/yardstick.toml")),
];

/// Changed settings, by their keys.
pub type Changes = BTreeMap<String, Value>;

/// A checked experiment. In quick mode its overrides are applied.
#[derive(Clone, Debug)]
pub struct Experiment {
    pub name: String,
    /// The file, for error messages and for files next to it; `None` for a built-in experiment.
    pub path: Option<PathBuf>,
    pub quick: bool,
    /// The part of it that was asked for.
    pub narrowed: Narrowed,
    pub title: String,
    pub summary: String,
    pub analysis: String,
    /// Parameters for the analysis.
    pub parameters: serde_json::Map<String, Value>,
    pub size: Size,
    pub seed: u32,
    pub measures: Vec<String>,
    /// Number of views that the report shows as images.
    pub images: usize,
    pub scenes: Vec<Scene>,
    /// Techniques, then references.
    pub methods: Vec<Method>,
    /// The text, so that the report can be made again.
    pub text: String,
}

/// What to do if a file does not exist.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum IfMissing {
    #[default]
    Fail,
    /// Continue without it; the report mentions this.
    Skip,
}

/// A scene and its views.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    pub name: String,
    pub builtin: Option<String>,
    pub file: Option<String>,
    /// A picture instead of a scene, for techniques that work on pictures.
    pub image: Option<String>,
    /// Length of one unit of the file, metres.
    pub unit: Option<f64>,
    /// Group in tables: `simple`, `complex`…
    #[serde(default)]
    pub group: String,
    #[serde(default)]
    pub if_missing: IfMissing,
    /// A file, or the name of a built-in environment.
    pub environment: Option<String>,
    /// Puts the scene on a ground.
    pub ground: Option<GroundOptions>,
    /// `false` removes the environment and keeps the lights.
    #[serde(default = "yes")]
    pub sky: bool,
    /// `false` removes the scene's own lights, before `light` and `sun` add others.
    #[serde(default = "yes")]
    pub lights: bool,
    /// `false` makes emissive surfaces dark.
    #[serde(default = "yes")]
    pub emission: bool,
    /// `true`: drawn views may show surfaces without direct light.
    #[serde(default)]
    pub dark_views: bool,
    #[serde(default)]
    pub light: Vec<Point>,
    pub sun: Option<Sun>,
    #[serde(default)]
    pub default_light: DefaultLight,
    /// Exposure of images in the report, EV; default: chosen by the picture.
    pub exposure: Option<f64>,
    /// Cameras by index, name, file, or view of a list (`LIST.toml#NAME`).
    #[serde(default)]
    pub cameras: Vec<String>,
    /// All views of this list.
    pub list: Option<String>,
    /// All cameras of the scene.
    #[serde(default)]
    pub recorded: bool,
    /// Number of random views.
    #[serde(default)]
    pub random: usize,
    /// Seed of the random views.
    #[serde(default = "one")]
    pub seed: u64,
    /// Each view is rendered at each of these sizes, instead of the experiment's size.
    #[serde(default)]
    pub sizes: Vec<String>,
    /// Maximum of views, evenly spread over all views.
    pub most_views: Option<usize>,
    /// Line in the file; 0 if unknown.
    #[serde(skip)]
    pub line: usize,
}

fn yes() -> bool {
    true
}

fn one() -> u64 {
    1
}

impl Scene {
    /// The files that the scene needs.
    pub fn files(&self) -> impl Iterator<Item = String> {
        let environment = self.environment.iter().filter(|name| !source::is_built_in_environment(Path::new(name)));
        let files = [&self.file, &self.image, &self.list].into_iter().flatten().chain(environment);
        let files = files.chain(self.cameras.iter().filter(|camera| camera.ends_with(".toml"))).cloned();
        let beside = self.ground.iter().flat_map(GroundOptions::files).map(|path| path.to_string_lossy().into_owned());
        files.chain(beside)
    }
}

/// Techniques are examined; references are the pictures with which they are compared.
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
    /// The kind that renders it ([`super::kinds`]).
    pub kind: String,
    /// Uses the paper's settings as defaults.
    #[serde(default)]
    pub paper: bool,
    #[serde(default)]
    pub settings: Changes,
    /// Every combination of these values is a variant.
    #[serde(default)]
    pub matrix: BTreeMap<String, Vec<Value>>,
    /// Number of repetitions of a frame, for time measurements.
    #[serde(default = "once")]
    pub repeat: u32,
    /// Layers that are stored besides the picture; default: direct and indirect.
    #[serde(default = "kept_layers")]
    pub layers: Vec<String>,
    /// Only these scenes.
    pub scenes: Option<Vec<String>>,
    /// Maximum of views per scene, evenly spread over all views.
    pub most_views: Option<usize>,
    /// What to do if a program that it needs is not installed.
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
    /// All combinations of the matrix; the last key changes fastest. Without a matrix, one empty combination.
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

    /// Number of combinations of the matrix.
    pub fn variant_count(&self) -> usize {
        self.matrix.values().fold(1, |count, values| count.saturating_mul(values.len()))
    }

    /// Whether the method renders a scene.
    pub fn takes(&self, scene: &str) -> bool {
        self.scenes.as_ref().is_none_or(|scenes| scenes.iter().any(|name| name == scene))
    }
}

/// Finds an experiment by the name of a built-in experiment, or by its file.
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
