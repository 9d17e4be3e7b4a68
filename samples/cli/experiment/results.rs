//! What an experiment gave: runs, their pictures and times, and measures between them.

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
    file::{self, Changes, Experiment, Role},
    kinds::Times,
};
use crate::{config, report};

/// What lights a scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shining {
    /// Point, spot and directional lights that nodes carry.
    pub lamps: u32,
    /// Some surface emits light.
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

    /// Shadow rays of a point that takes `samples` of emissive surfaces and as many of the sky.
    pub fn rays(self, samples: u32) -> u32 {
        self.lamps + (u32::from(self.surfaces) + u32::from(self.sky)) * samples
    }
}

/// A picture that is there.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Done {
    pub scene: String,
    /// Of the scene: `simple`, `complex`…
    pub group: String,
    pub triangles: usize,
    pub view: String,
    pub method: String,
    /// Values of the matrix.
    pub variant: Changes,
    /// What lights the scene; not known of old results.
    #[serde(default)]
    pub shining: Option<Shining>,
    /// Name of its files.
    pub key: String,
    /// EV that suits the scene, if known.
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

/// What `manifest.json` holds: enough to make the report again.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Manifest {
    pub name: String,
    pub path: Option<PathBuf>,
    pub quick: bool,
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
    /// Scenes and methods that were left out, and why.
    pub skipped: Vec<(String, String)>,
    /// Runs that were not done yet.
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
    /// Reads what an experiment left in a folder.
    ///
    /// # Errors
    /// `Input` if there is nothing.
    pub fn open(folder: &Path) -> Result<Self> {
        let manifest_path = folder.join("manifest.json");
        let fail = |error: Error| error.help("`lucerna reproduce` writes such a folder");
        let text = lucerna::image::read_file_checked(&manifest_path, 1 << 28).map_err(fail)?;
        let manifest: Manifest = serde_json::from_slice(&text)
            .map_err(|error| fail(Error::input(error.to_string()).in_file(&manifest_path)))?;
        let Manifest { name, path, quick, text, runs, skipped, missing, facts } = manifest;
        // Keys become names of files in this folder.
        if let Some(run) = runs.iter().find(|run| !Digest::is_hex(&run.key)) {
            return Err(fail(
                Error::input(format!("{:?} is no key of a picture", run.key)).at("runs").in_file(&manifest_path),
            ));
        }
        let experiment = file::parse(&name, path.as_deref(), &text, quick)?;
        Ok(Self { experiment, runs, skipped, missing, facts, cache: Cache::open(folder) })
    }

    pub(super) fn write_manifest(&self, folder: &Path) -> Result<()> {
        let manifest = Manifest {
            name: self.experiment.name.clone(),
            path: self.experiment.path.clone(),
            quick: self.experiment.quick,
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

    /// The run of another method on the same view; of several variants the first.
    pub fn beside(&self, run: &Done, method: &str) -> Option<&Done> {
        self.runs.iter().find(|other| other.method == method && other.scene == run.scene && other.view == run.view)
    }

    /// Scene and view of everything that was rendered, in order.
    pub fn views(&self) -> Vec<(&str, &str)> {
        let mut views: Vec<(&str, &str)> = Vec::new();
        for run in &self.runs {
            let view = (run.scene.as_str(), run.view.as_str());
            // Runs of a view lie together.
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

    /// What a run cost.
    ///
    /// # Errors
    /// `Input` if its files are gone.
    pub fn times(&self, run: &Done) -> Result<Times> {
        self.cache.times(&run.key).ok_or_else(|| {
            let what = format!("the files of {}/{} {} are gone", run.scene, run.view, run.label());
            Error::input(what).help("Run the experiment again; what is missing is rendered anew")
        })
    }

    /// Pixels of a layer.
    ///
    /// # Errors
    /// `Input` if the file is gone or has no such layer.
    pub fn picture(&self, Layer(run, layer): Layer<'_>) -> Result<Picture> {
        let named = |error: Error| error.at(format!("{}/{} {}", run.scene, run.view, run.label()));
        Picture::from_layers(&self.cache.layers(&run.key)?, Some(layer)).map_err(named)
    }

    /// A measure, computed once and kept. `baseline`: for measures of three images.
    ///
    /// # Errors
    /// `Input` if a picture is gone or holds values that are not finite.
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

    /// Times 2^EV a picture is bright enough to be seen.
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
