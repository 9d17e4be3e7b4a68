//! Post-processing pipelines after a technique: `--effects sepia.toml`, and the group `effects` of the settings.
//!
//! The settings name the pipeline's file and the digest of the file and its shaders, so that a picture says by which shaders it was made.

use std::{
    collections::BTreeMap,
    path::Path,
    sync::{Arc, Mutex, PoisonError},
};

use lucerna::{
    Error, ErrorKind, Result,
    effects::{Pipeline, Values},
    graph::Graph,
    technique::Picture,
};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

/// The group of settings.
pub const GROUP: &str = "effects";

/// The pipeline of a picture, and the values of its constants.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// The file.
    pub pipeline: String,
    /// Of the file and its shaders.
    pub digest: String,
    #[serde(flatten)]
    pub values: Values,
}

impl Settings {
    /// A pipeline with its defaults.
    pub fn of(pipeline: &Pipeline) -> Self {
        Self {
            pipeline: pipeline.path.display().to_string(),
            digest: pipeline.digest().to_owned(),
            values: pipeline.defaults(),
        }
    }
}

/// Pipelines that were read, by their digests. One that is known stays as it was when its files change, so that a window can go on with it while a person
/// edits them.
static READ: Mutex<BTreeMap<String, Arc<Pipeline>>> = Mutex::new(BTreeMap::new());

/// Reads a pipeline, and keeps it for settings that name its digest.
///
/// # Errors
/// As [`Pipeline::read`].
pub fn read(file: &Path) -> Result<Arc<Pipeline>> {
    let pipeline = Arc::new(Pipeline::read(file)?);
    let mut known = READ.lock().unwrap_or_else(PoisonError::into_inner);
    known.insert(pipeline.digest().to_owned(), pipeline.clone());
    Ok(pipeline)
}

/// The pipeline of settings.
///
/// # Errors
/// As [`Pipeline::read`]; `Input` if a file has changed since.
pub fn pipeline(settings: &Settings) -> Result<Arc<Pipeline>> {
    let known = READ.lock().unwrap_or_else(PoisonError::into_inner).get(&settings.digest).cloned();
    if let Some(known) = known {
        return Ok(known);
    }
    let file = Path::new(&settings.pipeline);
    // A picture of others names files. They are compiled only if they are those by which it was made.
    if Pipeline::digest_of(file)? != settings.digest {
        let what = "the pipeline or one of its shaders has changed since the picture was made";
        return Err(Error::input(what).in_file(file).help("Take the files of that time, or render the picture anew"));
    }
    read(file)
}

/// The defaults of the pipeline that settings of a picture name; `None` if they name none.
///
/// # Errors
/// As [`pipeline`].
pub fn recorded(settings: &Map<String, Value>) -> Result<Option<Settings>> {
    let Some(found) = settings.get(GROUP).filter(|found| !found.is_null()) else { return Ok(None) };
    let text = |key: &str| match found.get(key).and_then(Value::as_str) {
        Some(text) => Ok(text.to_owned()),
        None => Err(Error::input("is missing").at(key).at(GROUP)),
    };
    let named = Settings { pipeline: text("pipeline")?, digest: text("digest")?, values: Values::new() };
    let pipeline = pipeline(&named)?;
    Ok(Some(Settings { values: pipeline.defaults(), ..named }))
}

/// The passes of a run.
#[derive(Debug)]
pub struct Effects {
    pipeline: Arc<Pipeline>,
    values: Values,
}

impl Effects {
    /// # Errors
    /// As [`pipeline`]; `Usage` for wrong values.
    pub fn new(settings: &Settings) -> Result<Self> {
        let made = Self { pipeline: pipeline(settings)?, values: settings.values.clone() };
        made.pipeline.check(&made.values).map_err(|error| error.at(GROUP))?;
        Ok(made)
    }

    /// Declares the passes after a picture. `seconds`: time of the frame.
    ///
    /// # Errors
    /// As [`Pipeline::frame`].
    pub fn follow(&self, graph: &mut Graph, picture: &mut Picture, seconds: f64) -> Result<()> {
        let Some(view) = picture.view else {
            return Err(Error::new(ErrorKind::Runtime, "a picture without a view"));
        };
        picture.follow(|total| self.pipeline.frame(graph, total, &view, seconds, &self.values))
    }
}
