//! How an image came to be, carried inside the image.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::{Error, Result};

/// Everything needed to make an image again. Written into EXR, PNG and .hdr files as one JSON text.
///
/// The same command on the same device and driver writes identical bytes, so nothing that varies between two runs
/// belongs here unless it was asked for (`seconds`).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Metadata {
    /// The executable and its command.
    pub program: String,
    pub version: String,
    /// Git revision, if known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub revision: Option<String>,
    pub scene: String,
    /// Changes when the scene changes.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub scene_hash: String,
    pub camera: String,
    pub technique: String,
    pub seed: u64,
    /// Names of the Vulkan device and its driver with version.
    pub device: String,
    pub driver: String,
    /// The compiler of the shaders. Compilers round constants and order sums otherwise.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub shader_compiler: String,
    /// Rendering time. Varies between runs: `None` unless the user asked for it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seconds: Option<f64>,
    /// All parameters.
    #[serde(skip_serializing_if = "serde_json::Value::is_null")]
    pub config: serde_json::Value,
    /// Anything else; for images of other programs what their headers say.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub extra: BTreeMap<String, String>,
    /// Column-major `camera_from_world` (camera looks down −Z); EXR also has it as `worldToCamera`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub world_to_camera: Option<[f32; 16]>,
    /// Column-major `clip_from_world`; EXR also has it as `worldToNDC`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub world_to_ndc: Option<[f32; 16]>,
}

impl Metadata {
    /// Whether there is nothing in it.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// One line of ASCII JSON (other characters escaped), so that any header of any format can hold it.
    pub fn to_json(&self) -> Result<String> {
        let json = serde_json::to_string(self)
            .map_err(|error| Error::new(crate::ErrorKind::Runtime, "metadata cannot be written").caused_by(error))?;
        let mut ascii = String::with_capacity(json.len());
        for c in json.chars() {
            if c.is_ascii() {
                ascii.push(c);
            } else {
                let mut units = [0; 2];
                for unit in c.encode_utf16(&mut units) {
                    ascii.push_str(&format!("\\u{unit:04x}"));
                }
            }
        }
        Ok(ascii)
    }

    /// The inverse of [`Metadata::to_json`]; fields that this version does not know are dropped.
    pub fn from_json(json: &str) -> Result<Self> {
        serde_json::from_str(json).map_err(|error| Error::input("metadata is not what lucerna writes").caused_by(error))
    }

    /// The readable singles that stand beside the JSON, by name; empty ones left out.
    pub(crate) fn singles(&self) -> Vec<(&'static str, String)> {
        let all = [
            ("program", self.program.clone()),
            ("version", self.version.clone()),
            ("revision", self.revision.clone().unwrap_or_default()),
            ("scene", self.scene.clone()),
            ("sceneHash", self.scene_hash.clone()),
            ("camera", self.camera.clone()),
            ("technique", self.technique.clone()),
            ("seed", self.seed.to_string()),
            ("device", self.device.clone()),
            ("driver", self.driver.clone()),
            ("shaderCompiler", self.shader_compiler.clone()),
            ("seconds", self.seconds.map(|s| s.to_string()).unwrap_or_default()),
        ];
        all.into_iter().filter(|(_, value)| !value.is_empty()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn json_is_one_line_of_ascii_and_comes_back() {
        let metadata = Metadata {
            scene: "Zürich\n\"hall\" 🏛".into(),
            seed: u64::MAX,
            config: serde_json::json!({"b": 1.5, "a": [true, null]}),
            extra: [("k".to_owned(), "→".to_owned())].into(),
            world_to_ndc: Some(std::array::from_fn(|i| 0.1 * i as f32)),
            ..Metadata::default()
        };
        let json = metadata.to_json().unwrap();
        assert!(json.is_ascii() && !json.contains('\n'));
        assert_eq!(Metadata::from_json(&json).unwrap(), metadata);
        assert!(!json.contains("seconds"));
    }
}
