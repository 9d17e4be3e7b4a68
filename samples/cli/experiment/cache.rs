//! The cache of pictures: `runs/KEY.exr` and `runs/KEY.json` in the folder of a report. The key is a digest of all inputs of the picture.
//!
//! The text file is written after the picture. A picture without its text file does not count, so that an interrupted program leaves no incomplete
//! picture. The text file holds the digest of the picture's file, and its own digest. A damaged or foreign file is reported once and replaced.
//! Times are in the text file, so that the bytes of the picture depend on the inputs only.

use std::{
    collections::HashMap,
    path::{Path, PathBuf},
    sync::{Arc, Mutex, PoisonError},
};

use lucerna::{
    Error, ErrorKind, Result,
    gpu::Gpu,
    image::{self, Layers, WriteOptions},
    scene::Limits,
};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};

use super::{digest::Digest, kinds::Kind, kinds::Times, sealed};
use crate::program;

/// Digest of the source files that can change a picture or a measure, as they were when this program was built
/// ([`super::sources`]).
pub const SOURCES: &str = env!("LUCERNA_SOURCES");

/// The inputs of a picture, besides its kind and the sources.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Inputs {
    /// Fingerprint of its files.
    pub scene: String,
    pub view: Value,
    /// All settings, including those with default values.
    pub settings: Value,
    pub seed: u32,
    pub repeat: u32,
    /// Layers that the file keeps.
    pub layers: Vec<String>,
}

/// Device and driver, as text for keys.
pub fn device(gpu: &Gpu) -> String {
    let about = gpu.describe();
    format!("{}, {} {}", about.device, about.driver, about.driver_info)
}

/// The key of a picture, with its inputs as text.
#[derive(Clone, Debug)]
pub struct Key {
    pub name: String,
    text: Value,
}

impl Key {
    /// `needs`: version of the program that the kind needs.
    ///
    /// # Errors
    /// `Runtime` if it cannot be text.
    pub fn new(kind: &Kind, device: &str, needs: &str, inputs: &Inputs) -> Result<Self> {
        let text = json!({
            "kind": kind.name,
            "version": program::VERSION,
            "sources": SOURCES,
            "device": kind.on_device.then_some(device),
            "needs": needs,
            "what": crate::config::to_value(inputs)?,
        });
        Ok(Self { name: name_of(&text), text })
    }
}

fn name_of(text: &Value) -> String {
    Digest::of(text.to_string().as_bytes()).hex()
}

/// The contents of a picture's text file.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Record {
    key: Value,
    /// Digest of the picture's file.
    picture: String,
    times: Times,
}

/// The folder of a report.
#[derive(Clone, Debug)]
pub struct Cache {
    folder: PathBuf,
    /// Records by key, so that each file is read only once per run.
    seen: Arc<Mutex<HashMap<String, Option<Record>>>>,
}

impl Cache {
    /// Makes the folder if it does not exist.
    ///
    /// # Errors
    /// `Output` if it cannot be made.
    pub fn create(folder: &Path) -> Result<Self> {
        for part in ["runs", "measures"] {
            let path = folder.join(part);
            std::fs::create_dir_all(&path).map_err(|error| {
                Error::new(ErrorKind::Output, "the folder cannot be made").in_file(&path).caused_by(error)
            })?;
        }
        Ok(Self::open(folder))
    }

    /// Opens an existing folder.
    pub fn open(folder: &Path) -> Self {
        Self { folder: folder.to_path_buf(), seen: Arc::default() }
    }

    fn picture(&self, key: &str) -> PathBuf {
        self.folder.join("runs").join(format!("{key}.exr"))
    }

    fn text(&self, key: &str) -> PathBuf {
        self.folder.join("runs").join(format!("{key}.json"))
    }

    /// The record of a picture, if the picture exists and its digests are right.
    fn record(&self, key: &str) -> Option<Record> {
        let mut seen = self.seen.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = seen.get(key) {
            return known.clone();
        }
        let found = self.look(key).unwrap_or_else(|error| {
            does_not_count(&error);
            None
        });
        seen.insert(key.to_owned(), found.clone());
        found
    }

    fn look(&self, key: &str) -> Result<Option<Record>> {
        let (picture, text) = (self.picture(key), self.text(key));
        let Some(record) = sealed::read::<Record>(&text)? else { return Ok(None) };
        if name_of(&record.key) != key {
            return Err(Error::input("is the text of another picture").in_file(&text));
        }
        let bytes = image::read_file_checked(&picture, Limits::default().max_file)?;
        if Digest::of(&bytes).hex() != record.picture {
            return Err(Error::input("is damaged, or is not the stored picture").in_file(&picture));
        }
        Ok(Some(record))
    }

    /// Times of an existing picture.
    pub fn times(&self, key: &str) -> Option<Times> {
        self.record(key).map(|record| record.times)
    }

    /// Digest of an existing picture.
    pub fn content(&self, key: &str) -> Option<String> {
        self.record(key).map(|record| record.picture)
    }

    /// Stores a picture.
    ///
    /// # Errors
    /// `Output` if it cannot be written.
    pub fn put(&self, key: &Key, layers: &Layers, times: &Times) -> Result<()> {
        let (bytes, _) = image::encode(image::Format::Exr, layers, &WriteOptions::default())?;
        sealed::write_bytes(&self.picture(&key.name), &bytes)?;
        let record = Record { key: key.text.clone(), picture: Digest::of(&bytes).hex(), times: times.clone() };
        sealed::write(&self.text(&key.name), &record)?;
        self.seen.lock().unwrap_or_else(PoisonError::into_inner).insert(key.name.clone(), Some(record));
        Ok(())
    }

    /// Reads a picture.
    ///
    /// # Errors
    /// `Input` if it is gone or damaged.
    pub fn layers(&self, key: &str) -> Result<Layers> {
        let help = "Run the experiment again; missing pictures are rendered again";
        if self.record(key).is_none() {
            return Err(Error::input("is missing or damaged").in_file(self.picture(key)).help(help));
        }
        image::read(self.picture(key), &Limits::default()).map_err(|error| error.help(help))
    }

    fn values(&self, pair: &str) -> PathBuf {
        self.folder.join("measures").join(format!("{pair}.json"))
    }

    /// The stored measures of a pair of pictures, by their names.
    pub fn measures(&self, pair: &str) -> Map<String, Value> {
        let path = self.values(pair);
        let mut known: Map<String, Value> = match sealed::read(&path) {
            Ok(known) => known.unwrap_or_default(),
            Err(error) => {
                does_not_count(&error);
                Map::new()
            }
        };
        known.retain(|name, value| {
            let good = number(value).is_some();
            if !good {
                does_not_count(&Error::input(format!("{value} is no number")).at(name).in_file(&path));
            }
            good
        });
        known
    }

    /// Stores the measures of a pair.
    ///
    /// # Errors
    /// `Output` if they cannot be written.
    pub fn put_measures(&self, pair: &str, values: &Map<String, Value>) -> Result<()> {
        sealed::write(&self.values(pair), values)
    }

    /// The folder for data that scenes share. It may not exist yet.
    pub fn shared(&self) -> PathBuf {
        self.folder.join("shared")
    }
}

/// Logs why a file is ignored.
pub fn does_not_count(error: &Error) {
    log::warn!("{error}; the file is ignored and made again");
}

/// A measure as JSON. JSON has no infinity, so infinite values are stored as text.
pub fn to_json(value: f64) -> Value {
    if value.is_finite() { json!(value) } else { json!(value.to_string()) }
}

/// The inverse of [`to_json`].
pub fn number(value: &Value) -> Option<f64> {
    match value {
        Value::String(text) => text.parse().ok().filter(|value: &f64| !value.is_finite() && value.to_string() == *text),
        value => value.as_f64(),
    }
}

#[cfg(test)]
#[path = "cache_tests.rs"]
mod tests;
