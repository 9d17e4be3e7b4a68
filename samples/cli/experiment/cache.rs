//! Pictures by what decided them: `runs/KEY.exr` and `runs/KEY.json` in the folder of a report.
//!
//! The text file is written after the picture: a picture counts once its text is there, so that whenever the program is killed,
//! what is there is complete. Times stand in the text file; the picture's bytes depend on nothing but what the key names.

use std::path::{Path, PathBuf};

use lucerna::{
    Error, ErrorKind, Result,
    gpu::Gpu,
    image::{self, Layers, WriteOptions},
    scene::Limits,
};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::{digest::Digest, kinds::Kind, kinds::Times};
use crate::{config, program};

include!(concat!(env!("OUT_DIR"), "/sources.rs"));

/// Digest of the source files in these folders, as they were when this program was built.
fn sources(folders: &[&str]) -> String {
    let mut digest = Digest::default();
    for (file, hash) in SOURCES {
        if folders.iter().any(|folder| file.starts_with(folder) && file[folder.len()..].starts_with('/')) {
            digest.add(file.as_bytes());
            digest.add(&hash.to_le_bytes());
        }
    }
    digest.hex()
}

/// What decides a picture, as text.
pub struct Key {
    pub name: String,
    text: Value,
}

impl Key {
    /// `what`: scene, view, size, settings, seed.
    ///
    /// # Errors
    /// `Runtime` if it cannot be text.
    pub fn new(kind: &Kind, gpu: &Gpu, needs: &str, what: Value) -> Result<Self> {
        let about = gpu.describe();
        let device = kind.on_device.then(|| format!("{}, {} {}", about.device, about.driver, about.driver_info));
        let text = json!({
            "kind": kind.name,
            "version": program::VERSION,
            "sources": sources(kind.sources),
            "device": device,
            "needs": needs,
            "what": what,
        });
        let bytes = serde_json::to_vec(&text)
            .map_err(|error| Error::new(ErrorKind::Runtime, "a key cannot be text").caused_by(error))?;
        Ok(Self { name: Digest::of(&bytes).hex(), text })
    }
}

/// What stands beside a picture.
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
}

impl Cache {
    /// Makes the folder if it is not there.
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
        Ok(Self { folder: folder.to_path_buf() })
    }

    /// One that exists.
    pub fn open(folder: &Path) -> Self {
        Self { folder: folder.to_path_buf() }
    }

    fn picture(&self, key: &str) -> PathBuf {
        self.folder.join("runs").join(format!("{key}.exr"))
    }

    fn text(&self, key: &str) -> PathBuf {
        self.folder.join("runs").join(format!("{key}.json"))
    }

    fn record(&self, key: &str) -> Option<Record> {
        serde_json::from_str(&config::read_text(&self.text(key)).ok()?).ok()
    }

    /// Times of a picture that is there.
    pub fn times(&self, key: &str) -> Option<Times> {
        self.picture(key).is_file().then(|| self.record(key)).flatten().map(|record| record.times)
    }

    /// Digest of a picture that is there.
    pub fn content(&self, key: &str) -> Option<String> {
        self.record(key).map(|record| record.picture)
    }

    /// Keeps a picture.
    ///
    /// # Errors
    /// `Output` if it cannot be written.
    pub fn put(&self, key: &Key, layers: &Layers, times: &Times) -> Result<()> {
        let (bytes, _) = image::encode(image::Format::Exr, layers, &WriteOptions::default())?;
        image::write_atomic(&self.picture(&key.name), &bytes, true)?;
        let record = Record { key: key.text.clone(), picture: Digest::of(&bytes).hex(), times: times.clone() };
        let text = format!("{:#}\n", config::to_value(&record)?);
        image::write_atomic(&self.text(&key.name), text.as_bytes(), true)
    }

    /// Reads a picture.
    ///
    /// # Errors
    /// `Input` if it is gone or damaged.
    pub fn layers(&self, key: &str) -> Result<Layers> {
        image::read(self.picture(key), &Limits::default())
            .map_err(|error| error.help("Run the experiment again; what is missing is rendered anew"))
    }

    /// Measures of a pair, by their names.
    pub fn measures(&self, pair: &str) -> serde_json::Map<String, Value> {
        let path = self.folder.join("measures").join(format!("{pair}.json"));
        config::read_text(&path).ok().and_then(|text| serde_json::from_str(&text).ok()).unwrap_or_default()
    }

    /// Keeps them.
    ///
    /// # Errors
    /// `Output` if they cannot be written.
    pub fn put_measures(&self, pair: &str, values: &serde_json::Map<String, Value>) -> Result<()> {
        let path = self.folder.join("measures").join(format!("{pair}.json"));
        image::write_atomic(&path, format!("{:#}\n", Value::Object(values.clone())).as_bytes(), true)
    }

    /// The folder of what scenes share; it need not exist.
    pub fn shared(&self) -> PathBuf {
        self.folder.join("shared")
    }

    /// Digest of source files in these folders.
    pub fn sources_of(folders: &[&str]) -> String {
        sources(folders)
    }

    /// Version of the code that measures.
    pub fn measuring() -> String {
        sources(&["engine/measure"])
    }
}
