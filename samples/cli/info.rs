//! `lucerna info`: the contents and the metadata of an image file.

use std::{fmt::Write, path::Path};

use lucerna::{
    Result,
    image::{self, Layer, Layers},
    scene::Limits,
};
use serde_json::{Value, json};

use crate::{
    console, listed,
    piped::{self, PIPE, STDIN},
};

/// Statistics of a channel.
struct Statistics {
    min: f32,
    max: f32,
    /// Mean of the finite values.
    mean: f64,
    not_finite: usize,
}

impl Statistics {
    fn of(values: impl Iterator<Item = f32>) -> Self {
        let mut this = Self { min: f32::INFINITY, max: f32::NEG_INFINITY, mean: 0.0, not_finite: 0 };
        let mut count = 0_usize;
        for value in values {
            if !value.is_finite() {
                this.not_finite += 1;
                continue;
            }
            count += 1;
            this.min = this.min.min(value);
            this.max = this.max.max(value);
            this.mean += f64::from(value);
        }
        this.mean /= count.max(1) as f64;
        this
    }
}

/// Prints what is in images. JSON: an object for one image, a list for a folder, a pattern or several images.
///
/// # Errors
/// `Input` if an image cannot be read.
pub fn run(names: &[String], json: bool) -> Result<()> {
    let files = listed::expanded(names)?;
    piped::once(files.iter().map(String::as_str))?;
    let one = matches!(names, [name] if files == [name.clone()]);
    let mut list = Vec::new();
    for file in &files {
        let path = Path::new(if file == PIPE { STDIN } else { file });
        let layers = if file == PIPE { from_standard_input()? } else { read(path)? };
        match json {
            true => list.push(self::json(&layers)),
            false => console::print(&text(path, &layers))?,
        }
    }
    match (json, one) {
        (false, _) => Ok(()),
        (true, true) => console::print_json(&list.swap_remove(0)),
        (true, false) => {
            let named = files.iter().zip(list).map(|(file, info)| json!({ "file": file, "info": info }));
            console::print_json(&named.collect())
        }
    }
}

fn channels(layer: &Layer) -> impl Iterator<Item = (&str, Statistics)> {
    let count = layer.channels.len();
    layer
        .channels
        .iter()
        .enumerate()
        .map(move |(i, name)| (name.as_str(), Statistics::of(layer.data.iter().skip(i).step_by(count.max(1)).copied())))
}

fn from_standard_input() -> Result<Layers> {
    let limits = Limits::default();
    let layers = piped::bytes(limits.max_file).and_then(|bytes| image::decode(&bytes, &limits));
    layers.map_err(|error| error.in_file(STDIN))
}

/// Reads an image of any format.
pub fn read(path: &Path) -> Result<Layers> {
    image::read(path, &Limits::default())
}

/// As JSON: size, layers with their statistics, metadata.
pub fn json(layers: &Layers) -> Value {
    let list: Vec<Value> = layers
        .layers
        .iter()
        .map(|layer| {
            let channels: serde_json::Map<String, Value> = channels(layer)
                .map(|(name, s)| {
                    let finite = s.min <= s.max;
                    let value = json!({
                        "min": finite.then_some(s.min), "max": finite.then_some(s.max), "mean": s.mean,
                        "not_finite": s.not_finite,
                    });
                    (name.to_owned(), value)
                })
                .collect();
            json!({ "name": layer.name, "channels": channels })
        })
        .collect();
    json!({ "width": layers.width, "height": layers.height, "layers": list, "metadata": layers.metadata, "warnings": layers.warnings })
}

/// As text for terminals.
pub fn text(path: &Path, layers: &Layers) -> String {
    let mut out = format!("{}\n  {}×{}", path.display(), layers.width, layers.height);
    for warning in &layers.warnings {
        let _ = write!(out, "\n  warning: {warning}");
    }
    for layer in &layers.layers {
        let name = if layer.name.is_empty() { "picture" } else { &layer.name };
        for (channel, s) in channels(layer) {
            let odd = if s.not_finite > 0 { format!(", {} not finite", s.not_finite) } else { String::new() };
            let range = if s.min <= s.max {
                format!("{:.6} to {:.6}, mean {:.6}", s.min, s.max, s.mean)
            } else {
                "nothing finite".into()
            };
            // Writing into a String cannot fail.
            let _ = write!(out, "\n  {name} {channel}: {range}{odd}");
        }
    }
    let metadata = &layers.metadata;
    if metadata.is_empty() {
        out.push_str("\n  no metadata");
        return out;
    }
    let singles = [
        ("made by", format!("{} {}", metadata.program, metadata.version)),
        ("revision", metadata.revision.clone().unwrap_or_default()),
        ("scene", metadata.scene.clone()),
        ("camera", metadata.camera.clone()),
        ("technique", metadata.technique.clone()),
        ("seed", metadata.seed.to_string()),
        ("device", metadata.device.clone()),
        ("driver", metadata.driver.clone()),
        ("shader compiler", metadata.shader_compiler.clone()),
        ("seconds", metadata.seconds.map(|s| format!("{s:.3}")).unwrap_or_default()),
    ];
    for (name, value) in singles.iter().filter(|(_, value)| !value.trim().is_empty()) {
        let _ = write!(out, "\n  {name}: {value}");
    }
    for (name, value) in &metadata.extra {
        let _ = write!(out, "\n  {name}: {value}");
    }
    if !metadata.config.is_null() {
        let _ = write!(out, "\n  parameters:");
        flat(&metadata.config, &mut String::new(), &mut out);
    }
    out
}

/// `a.b.c = value` lines.
fn flat(value: &Value, prefix: &mut String, out: &mut String) {
    if let Value::Object(table) = value {
        for (key, value) in table {
            let length = prefix.len();
            if length > 0 {
                prefix.push('.');
            }
            prefix.push_str(key);
            flat(value, prefix, out);
            prefix.truncate(length);
        }
    } else {
        let _ = write!(out, "\n    {prefix} = {value}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statistics_leave_out_what_is_not_finite() {
        let layers = Layers::rgb(2, 1, vec![0.0, 1.0, f32::NAN, 2.0, 3.0, f32::INFINITY]);
        let json = json(&layers);
        assert_eq!(
            json["layers"][0]["channels"]["R"],
            serde_json::json!({"min": 0.0, "max": 2.0, "mean": 1.0, "not_finite": 0})
        );
        assert_eq!(json["layers"][0]["channels"]["B"]["not_finite"], 2);
        let text = text(Path::new("a.exr"), &layers);
        assert!(text.contains("picture B: nothing finite, 2 not finite") && text.contains("no metadata"), "{text}");
    }
}
