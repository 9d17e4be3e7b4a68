//! The results of an experiment: runs, their pictures and times, and measures between them.

use std::path::{Path, PathBuf};

use glam::Vec3;
use lucerna::{
    Error, Result,
    measure::{Measure, Options, Pair, Picture},
    scene::{Primitive, Scene},
};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};

use super::{
    cache::{self, Cache},
    digest::Digest,
    file::{self, Changes, Experiment, Narrowed, Role},
    kinds::Times,
};
use crate::{config, report};

/// The light sources of a scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shining {
    /// Number of point, spot and directional lights.
    pub lamps: u32,
    /// The scene has emissive surfaces.
    pub surfaces: bool,
    pub sky: bool,
}

impl Shining {
    pub fn of(scene: &Scene) -> Self {
        let emits = |primitive: &Primitive| {
            scene.materials.get(primitive.material as usize).is_some_and(|material| material.emissive != Vec3::ZERO)
        };
        let meshes = scene.nodes.iter().filter_map(|node| scene.meshes.get(node.mesh? as usize));
        Self {
            lamps: scene.nodes.iter().filter(|node| node.light.is_some()).count() as u32,
            surfaces: meshes.flat_map(|mesh| &mesh.primitives).any(emits),
            sky: scene.environment.as_ref().is_some_and(|sky| !sky.pixels.is_empty()),
        }
    }

    /// Shadow rays per point, with `samples` rays to emissive surfaces and as many to the environment, and `glossy` rays to its highlights.
    pub fn rays(self, samples: u32, glossy: u32) -> u32 {
        self.lamps + (u32::from(self.surfaces) + u32::from(self.sky)) * samples + u32::from(self.sky) * glossy
    }
}

/// A finished run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Done {
    pub scene: String,
    /// Group of the scene: `simple`, `complex`…
    pub group: String,
    pub triangles: usize,
    pub view: String,
    pub method: String,
    /// Values of the matrix.
    pub variant: Changes,
    /// Light sources of the scene; `None` in old results.
    #[serde(default)]
    pub shining: Option<Shining>,
    /// Name of its files.
    pub key: String,
    /// A fitting exposure, EV, if known.
    pub exposure: Option<f64>,
}

impl Done {
    /// `isr`, or with a matrix `isr, isr.samples = 24`.
    pub fn label(&self) -> String {
        label(&self.method, &self.variant)
    }

    /// Value of a key of the matrix, as text.
    pub fn value(&self, key: &str) -> Option<String> {
        self.variant.get(key).map(shown)
    }
}

/// `method`, or with values `method, samples = 24`; groups of keys are left out.
pub fn label(method: &str, variant: &Changes) -> String {
    let values =
        variant.iter().map(|(key, value)| format!(", {} = {}", key.rsplit('.').next().unwrap_or(key), shown(value)));
    format!("{method}{}", values.collect::<String>())
}

fn shown(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}

/// A layer of a picture: `""` is the picture itself, `direct`, `indirect`…
#[derive(Clone, Copy, Debug)]
pub struct Layer<'a>(pub &'a Done, pub &'a str);

/// The contents of `manifest.json`, from which the report can be made again.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Manifest {
    pub name: String,
    pub path: Option<PathBuf>,
    pub quick: bool,
    #[serde(default, skip_serializing_if = "Narrowed::is_empty")]
    pub narrowed: Narrowed,
    pub text: String,
    pub runs: Vec<Done>,
    pub skipped: Vec<(String, String)>,
    pub missing: usize,
    pub facts: Vec<(String, String)>,
}

/// All results of an experiment.
#[derive(Debug)]
pub struct Results {
    pub experiment: Experiment,
    /// In the order of the file: scene, view, method, variant.
    pub runs: Vec<Done>,
    /// Skipped scenes and methods, each with the reason.
    pub skipped: Vec<(String, String)>,
    /// Number of missing runs.
    pub missing: usize,
    /// Device, driver, versions, seed, command line.
    pub facts: Vec<(String, String)>,
    pub(super) cache: Cache,
}

/// Checks the name of a measure.
///
/// # Errors
/// `Input` if there is none of this name.
pub fn known_measure(name: &str) -> Result<Measure> {
    name.parse().map_err(|error: Error| Error::input(error.what().to_owned()))
}

impl Results {
    /// Reads the results in a folder.
    ///
    /// # Errors
    /// `Input` if the folder has no results.
    pub fn open(folder: &Path) -> Result<Self> {
        let manifest_path = folder.join("manifest.json");
        let fail = |error: Error| error.help("`lucerna reproduce` writes such a folder");
        let text = lucerna::image::read_file_checked(&manifest_path, 1 << 28).map_err(fail)?;
        let manifest: Manifest = serde_json::from_slice(&text)
            .map_err(|error| fail(Error::input(error.to_string()).in_file(&manifest_path)))?;
        let Manifest { name, path, quick, narrowed, text, runs, skipped, missing, facts } = manifest;
        // Keys are used as file names in this folder, so they are checked.
        if let Some(run) = runs.iter().find(|run| !Digest::is_hex(&run.key)) {
            return Err(fail(
                Error::input(format!("{:?} is no key of a picture", run.key)).at("runs").in_file(&manifest_path),
            ));
        }
        let experiment = file::parse(&name, path.as_deref(), &text, quick)?.narrow(&narrowed)?;
        Ok(Self { experiment, runs, skipped, missing, facts, cache: Cache::open(folder) })
    }

    pub(super) fn write_manifest(&self, folder: &Path) -> Result<()> {
        let manifest = Manifest {
            name: self.experiment.name.clone(),
            path: self.experiment.path.clone(),
            quick: self.experiment.quick,
            narrowed: self.experiment.narrowed.clone(),
            text: self.experiment.text.clone(),
            runs: self.runs.clone(),
            skipped: self.skipped.clone(),
            missing: self.missing,
            facts: self.facts.clone(),
        };
        let text = format!("{:#}\n", config::to_value(&manifest)?);
        report::write_own(&folder.join("manifest.json"), text.as_bytes())
    }

    /// Runs of a technique or reference.
    pub fn of(&self, method: &str) -> impl Iterator<Item = &Done> {
        self.runs.iter().filter(move |run| run.method == method)
    }

    /// Runs of all techniques, or of all references.
    pub fn with_role(&self, role: Role) -> impl Iterator<Item = &Done> {
        let methods = &self.experiment.methods;
        self.runs.iter().filter(move |run| methods.iter().any(|m| m.role == role && m.name == run.method))
    }

    /// The run of another method for the same view; the first one, if there are several variants.
    pub fn beside(&self, run: &Done, method: &str) -> Option<&Done> {
        self.runs.iter().find(|other| other.method == method && other.scene == run.scene && other.view == run.view)
    }

    /// All pairs of scene and view, in order.
    pub fn views(&self) -> Vec<(&str, &str)> {
        let mut views: Vec<(&str, &str)> = Vec::new();
        for run in &self.runs {
            let view = (run.scene.as_str(), run.view.as_str());
            // The runs of a view are consecutive.
            if views.last() != Some(&view) {
                views.push(view);
            }
        }
        views
    }

    /// Runs of one view.
    pub fn at<'a>(&'a self, (scene, view): (&'a str, &'a str)) -> impl Iterator<Item = &'a Done> {
        self.runs.iter().filter(move |run| run.scene == scene && run.view == view)
    }

    /// The times of a run.
    ///
    /// # Errors
    /// `Input` if its files are missing.
    pub fn times(&self, run: &Done) -> Result<Times> {
        self.cache.times(&run.key).ok_or_else(|| {
            let what = format!("the files of {}/{} {} are missing", run.scene, run.view, run.label());
            Error::input(what).help("Run the experiment again; missing pictures are rendered again")
        })
    }

    /// Pixels of a layer.
    ///
    /// # Errors
    /// `Input` if the file is missing or has no such layer.
    pub fn picture(&self, Layer(run, layer): Layer<'_>) -> Result<Picture> {
        let named = |error: Error| error.at(format!("{}/{} {}", run.scene, run.view, run.label()));
        Picture::from_layers(&self.cache.layers(&run.key)?, Some(layer)).map_err(named)
    }

    /// A measure. It is computed once and stored. `baseline`: the third image, for measures that need one.
    ///
    /// # Errors
    /// `Input` if a picture is missing or holds values that are not finite.
    pub fn measure(
        &self,
        measure: Measure,
        reference: Layer<'_>,
        test: Layer<'_>,
        baseline: Option<Layer<'_>>,
    ) -> Result<f64> {
        self.measures(&[measure], reference, test, baseline).map(|values| values.first().copied().unwrap_or(f64::NAN))
    }

    /// Several measures of the same pictures, which are read once. NaN where a measure is not defined for them.
    ///
    /// # Errors
    /// As [`measure`](Self::measure).
    pub fn measures(
        &self,
        measures: &[Measure],
        reference: Layer<'_>,
        test: Layer<'_>,
        baseline: Option<Layer<'_>>,
    ) -> Result<Vec<f64>> {
        self.measures_as(&Options::default(), measures, reference, test, baseline)
    }

    /// As [`measures`](Self::measures), with other options than the defaults.
    ///
    /// # Errors
    /// The same.
    pub fn measures_as(
        &self,
        options: &Options,
        measures: &[Measure],
        reference: Layer<'_>,
        test: Layer<'_>,
        baseline: Option<Layer<'_>>,
    ) -> Result<Vec<f64>> {
        let name = |Layer(run, layer): Layer<'_>| {
            let content = self.cache.content(&run.key).unwrap_or_else(|| run.key.clone());
            json!([content, layer])
        };
        let mut which = json!([name(reference), name(test), baseline.map(name), cache::SOURCES]);
        if let Some(list) = which.as_array_mut().filter(|_| *options != Options::default()) {
            list.push(json!(format!("{options:?}")));
        }
        let which = Digest::of(which.to_string().as_bytes()).hex();
        let mut known: Map<String, Value> = self.cache.measures(&which);
        let unknown: Vec<Measure> = measures.iter().copied().filter(|m| !known.contains_key(m.name())).collect();
        if !unknown.is_empty() {
            let (truth, image) = (self.picture(reference)?, self.picture(test)?);
            let base = baseline.map(|layer| self.picture(layer)).transpose()?;
            let Layer(run, _) = test;
            let named = |error: Error| error.at(format!("{}/{} {}", run.scene, run.view, run.label()));
            let mut pair = Pair::new(&truth, &image).map_err(named)?;
            if let Some(base) = &base {
                pair = pair.with_baseline(base).map_err(named)?;
            }
            for measure in unknown {
                let value = measure.of(&pair, options).map_err(named)?.value;
                known.insert(measure.name().into(), cache::to_json(value));
            }
            self.cache.put_measures(&which, &known)?;
        }
        let value = |measure: &Measure| known.get(measure.name()).and_then(cache::number).unwrap_or(f64::NAN);
        Ok(measures.iter().map(value).collect())
    }

    /// The exposure, EV, at which a picture fits a screen's range.
    ///
    /// # Errors
    /// As [`picture`](Self::picture).
    pub fn exposure(&self, run: &Done) -> Result<f64> {
        match run.exposure {
            Some(exposure) => Ok(exposure),
            None => Ok(crate::exposure::fitting(&self.cache.layers(&run.key)?)),
        }
    }
}
