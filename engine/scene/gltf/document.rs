//! The JSON of a glTF file as typed lists, each element read with its place known.
//!
//! No crate for glTF is used: the known ones panic on malformed files or follow references out of the folder.

use super::types::*;
use crate::{Error, Result, scene::Limits};
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

#[derive(Debug)]
pub struct Document {
    pub extensions_used: Vec<String>,
    pub extensions_required: Vec<String>,
    pub accessors: Vec<Accessor>,
    pub animations: Vec<Animation>,
    pub buffers: Vec<Buffer>,
    pub views: Vec<View>,
    pub cameras: Vec<Camera>,
    pub images: Vec<Image>,
    pub lights: Vec<Light>,
    pub materials: Vec<Material>,
    pub meshes: Vec<Mesh>,
    pub nodes: Vec<Node>,
    pub samplers: Vec<Sampler>,
    pub scene: Option<u32>,
    pub scenes: Vec<Scene>,
    pub skins: Vec<Skin>,
    pub textures: Vec<Texture>,
}

impl Document {
    /// Parses JSON text. Bounded: at most 127 levels deep (`serde_json`), and at most `limits.max_alloc` bytes of tree.
    pub fn parse(text: &str, limits: &Limits) -> Result<Self> {
        bound_tree(text, limits)?;
        let root: Value = serde_json::from_str(text).map_err(|error| {
            Error::input(format!("the JSON is malformed: {error}")).help("The file is damaged or no glTF file")
        })?;
        let Value::Object(mut root) = root else {
            return Err(Error::input("the JSON is not an object").help("The file is no glTF file"));
        };
        check_version(&root)?;
        let extensions_used = list(&mut root, "extensionsUsed")?;
        let extensions_required = list(&mut root, "extensionsRequired")?;
        let mut extensions: Map<String, Value> = single(&mut root, "extensions")?.unwrap_or_default();
        let lights = match extensions.remove("KHR_lights_punctual") {
            None => Vec::new(),
            Some(Value::Object(mut lights)) => {
                list(&mut lights, "lights").map_err(|error| error.at("extensions.KHR_lights_punctual"))?
            }
            Some(_) => return Err(Error::input("must be an object").at("extensions.KHR_lights_punctual")),
        };
        Ok(Self {
            extensions_used,
            extensions_required,
            accessors: list(&mut root, "accessors")?,
            animations: list(&mut root, "animations")?,
            buffers: list(&mut root, "buffers")?,
            views: list(&mut root, "bufferViews")?,
            cameras: list(&mut root, "cameras")?,
            images: list(&mut root, "images")?,
            lights,
            materials: list(&mut root, "materials")?,
            meshes: list(&mut root, "meshes")?,
            nodes: list(&mut root, "nodes")?,
            samplers: list(&mut root, "samplers")?,
            scene: single(&mut root, "scene")?,
            scenes: list(&mut root, "scenes")?,
            skins: list(&mut root, "skins")?,
            textures: list(&mut root, "textures")?,
        })
    }
}

/// Refuses text whose parsed tree would outgrow the limit: numbers of two bytes become nodes of dozens.
fn bound_tree(text: &str, limits: &Limits) -> Result<()> {
    let (mut values, mut objects) = (0u64, 0u64);
    let (mut in_string, mut escaped) = (false, false);
    for byte in text.bytes() {
        match byte {
            _ if escaped => escaped = false,
            b'\\' if in_string => escaped = true,
            b'"' => in_string = !in_string,
            _ if in_string => {}
            b',' | b'[' => values += 1,
            b'{' => objects += 1,
            _ => {}
        }
    }
    // Upper estimates for `serde_json::Value` on a 64-bit machine: an element or half-filled map slot, a map node.
    let bytes = values.saturating_mul(112).saturating_add(objects.saturating_mul(700));
    if bytes > limits.max_alloc {
        return Err(Error::input(format!(
            "the JSON has {objects} objects and {values} values, about {} MiB in memory; {} MiB are allowed",
            bytes >> 20,
            limits.max_alloc >> 20
        )));
    }
    Ok(())
}

fn check_version(root: &Map<String, Value>) -> Result<()> {
    let asset = root.get("asset").ok_or_else(|| {
        Error::input("is missing").at("asset").help("The file is no glTF 2.0 file, which must state its version there")
    })?;
    let read = |key: &str| -> Result<Option<(u32, u32)>> {
        let Some(value) = asset.get(key) else { return Ok(None) };
        let version = value.as_str().and_then(|text| {
            let (major, minor) = text.split_once('.')?;
            Some((major.parse().ok()?, minor.parse().ok()?))
        });
        version.map(Some).ok_or_else(|| Error::input(format!("{value} is no version")).at(key).at("asset"))
    };
    let help = "Convert the file to glTF 2.0";
    match (read("version")?, read("minVersion")?) {
        (None, _) => Err(Error::input("is missing").at("version").at("asset").help(help)),
        (_, Some((major, minor))) if (major, minor) > (2, 0) => {
            Err(Error::input(format!("glTF {major}.{minor} is needed, 2.0 is supported"))
                .at("minVersion")
                .at("asset")
                .help(help))
        }
        (Some((2, _)), _) => Ok(()),
        (Some((major, minor)), _) => Err(Error::input(format!("glTF {major}.{minor} is not supported, only 2.x"))
            .at("version")
            .at("asset")
            .help(help)),
    }
}

fn list<T: DeserializeOwned>(root: &mut Map<String, Value>, key: &str) -> Result<Vec<T>> {
    match root.remove(key) {
        None => Ok(Vec::new()),
        Some(Value::Array(values)) => values
            .into_iter()
            .enumerate()
            .map(|(i, value)| element(value).map_err(|error| error.at(format!("{key}[{i}]"))))
            .collect(),
        Some(other) => Err(Error::input(format!("must be an array, found {}", kind(&other))).at(key)),
    }
}

/// An element of a top-level list: an object, or a name. Without the check, objects would be read from arrays too.
fn element<T: DeserializeOwned>(value: Value) -> Result<T> {
    match value {
        Value::Object(_) | Value::String(_) => typed(value),
        other => Err(Error::input(format!("must be an object, found {}", kind(&other)))),
    }
}

fn single<T: DeserializeOwned>(root: &mut Map<String, Value>, key: &str) -> Result<Option<T>> {
    root.remove(key).map(typed).transpose().map_err(|error| error.at(key))
}

/// Reads `value` as a `T`. Integers may be written as `1.0` (glTF 2.0, section 3.2).
pub fn typed<T: DeserializeOwned>(mut value: Value) -> Result<T> {
    integers(&mut value);
    T::deserialize(value).map_err(|error| Error::input(error.to_string()))
}

fn integers(value: &mut Value) {
    match value {
        Value::Array(values) => values.iter_mut().for_each(integers),
        Value::Object(map) => map.values_mut().for_each(integers),
        Value::Number(number) if number.is_f64() => {
            if let Some(float) = number.as_f64()
                && float.fract() == 0.0
                && float.abs() < 9e15
            {
                *number = (float as i64).into();
            }
        }
        _ => {}
    }
}

fn kind(value: &Value) -> &'static str {
    match value {
        Value::Null => "null",
        Value::Bool(_) => "a boolean",
        Value::Number(_) => "a number",
        Value::String(_) => "a string",
        Value::Array(_) => "an array",
        Value::Object(_) => "an object",
    }
}

/// The extension `name` in `extensions`, typed.
pub fn extension<T: DeserializeOwned>(extensions: &Extensions, name: &str) -> Result<Option<T>> {
    match extensions.as_ref().and_then(|map| map.get(name)) {
        None => Ok(None),
        Some(value) => typed(value.clone()).map(Some).map_err(|error| error.at(format!("extensions.{name}"))),
    }
}

/// The element of a list that an index in the file points to.
pub fn item<'a, T>(list: &'a [T], name: &str, index: u32) -> Result<&'a T> {
    list.get(index as usize).ok_or_else(|| {
        Error::input(format!("refers to {name}[{index}], but the file has {} {name}", list.len()))
            .help("The file is not valid glTF; re-export it or run glTF-Validator")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Document> {
        Document::parse(text, &Limits::default())
    }

    #[test]
    fn integers_written_as_floats_are_read() {
        let document = parse(r#"{"asset":{"version":"2.0"},"scene":1.0,"scenes":[{},{"nodes":[3.0]}]}"#).unwrap();
        assert_eq!((document.scene, document.scenes[1].nodes.as_slice()), (Some(1), [3].as_slice()));
    }

    #[test]
    fn errors_name_the_element() {
        let error = parse(r#"{"asset":{"version":"2.0"},"cameras":[{"type":7}]}"#).unwrap_err();
        assert_eq!(error.place(), Some("cameras[0]"));
    }

    #[test]
    fn deep_and_wide_json_is_refused() {
        let deep = format!(r#"{{"asset":{{"version":"2.0"}},"x":{}{}}}"#, "[".repeat(100_000), "]".repeat(100_000));
        assert!(parse(&deep).unwrap_err().to_string().contains("recursion"));
        let limits = Limits { max_alloc: 1 << 20, ..Limits::default() };
        let wide = format!(r#"{{"asset":{{"version":"2.0"}},"x":[{}0]}}"#, "0,".repeat(100_000));
        assert!(Document::parse(&wide, &limits).unwrap_err().to_string().contains("MiB"));
    }
}
