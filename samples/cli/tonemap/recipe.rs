//! The record of a tone mapped picture in its metadata, and making the same picture again.

use std::path::{Path, PathBuf};

use lucerna::{
    Error, Result,
    gpu::Gpu,
    image::{self, Format},
    scene::Limits,
    techniques::tonemap::Still,
};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::{
    Config, LIMITS, Making, Run,
    alpha::Alpha,
    args::{Gamma, Metering},
    names::{self, Input},
};
use crate::{args::DeviceArgs, config, console::Console, outputs::Fresh, program, signals::Interrupt};

/// The `config` of a picture's metadata. Values equal to their default are left out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Recipe {
    command: Vec<String>,
    /// The picture that was developed.
    input: String,
    gamma: Curve,
    settings: Value,
    /// As `--alpha` takes it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    alpha: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    sequence: Option<Sequence>,
    /// The metadata of the input picture.
    #[serde(default, skip_serializing_if = "Value::is_null")]
    source: Value,
    /// Layer of the input file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    layer: Option<String>,
    /// The mask file of important pixels (`--mask`).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    mask: Option<PathBuf>,
    #[serde(default = "usual_bits", skip_serializing_if = "is_usual_bits")]
    bits: u8,
    #[serde(default = "usual_quality", skip_serializing_if = "is_usual_quality")]
    quality: u8,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    f32: bool,
}

/// The encoding of .png and .jpg files: `srgb`, or a power.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
enum Curve {
    Power(f32),
    Named(String),
}

/// A frame of a sequence, whose adaptation depends on the frames before it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Sequence {
    frame: u32,
    fps: f64,
    /// The numbered name and the first frame; `None` if the sequence was a list of names.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pattern: Option<(String, u32)>,
}

fn usual_bits() -> u8 {
    8
}

fn is_usual_bits(bits: &u8) -> bool {
    *bits == usual_bits()
}

fn usual_quality() -> u8 {
    92
}

fn is_usual_quality(quality: &u8) -> bool {
    *quality == usual_quality()
}

/// Maximum of frames of a sequence without `--long`.
const FRAMES: usize = 1000;

impl Recipe {
    pub(super) fn new(making: &Making, settings: &Config, input: &Input, source: &Value) -> Result<Self> {
        let sequence =
            input.sequence.map(|_| Sequence { frame: input.frame, fps: making.fps, pattern: input.pattern.clone() });
        Ok(Self {
            command: vec!["tonemap".into()],
            input: input.name.clone(),
            gamma: making.gamma.0.map_or_else(|| Curve::Named("srgb".into()), Curve::Power),
            settings: config::to_value(settings)?,
            alpha: making.alpha.map(|alpha| alpha.to_string()),
            sequence,
            source: source.clone(),
            layer: input.layer.clone(),
            mask: making.mask.clone(),
            bits: making.png_bits,
            quality: making.jpeg_quality,
            f32: making.f32,
        })
    }

    /// The configuration of the run. A measured exposure is part of the settings.
    fn making(&self) -> Result<Making> {
        let wrong = |key: &str, found: String, allowed: &str| {
            Error::input(format!("{found} is not allowed; allowed: {allowed}")).at(key)
        };
        let gamma = match &self.gamma {
            Curve::Power(power) => power.to_string().parse::<Gamma>(),
            Curve::Named(name) => name.parse(),
        };
        let gamma = gamma.map_err(|what| Error::input(what).at("gamma"))?;
        let alpha = self.alpha.as_deref().map(str::parse::<Alpha>).transpose();
        let alpha = alpha.map_err(|what| Error::input(what).at("alpha"))?;
        if ![8, 16].contains(&self.bits) {
            return Err(wrong("bits", self.bits.to_string(), "8 and 16"));
        }
        if !(1..=100).contains(&self.quality) {
            return Err(wrong("quality", self.quality.to_string(), "1 to 100"));
        }
        let fps = self.sequence.as_ref().map_or(25.0, |sequence| sequence.fps);
        if !(fps.is_finite() && fps > 0.0) {
            return Err(wrong("sequence.fps", fps.to_string(), "numbers above 0"));
        }
        Ok(Making {
            metering: Metering::None,
            gamma,
            alpha,
            fps,
            mask: self.mask.clone(),
            png_bits: self.bits,
            jpeg_quality: self.quality,
            f32: self.f32,
            overwrite: false,
        })
    }

    /// The pictures to tone map. The last one is the picture that is made again.
    fn inputs(&self, long: bool) -> Result<Vec<Input>> {
        let layer = self.layer.as_deref();
        let Some(Sequence { frame, pattern, .. }) = &self.sequence else {
            let path = PathBuf::from(&self.input);
            if self.input == names::STDIN {
                return Err(Error::input("the input picture came from standard input").at("input"));
            }
            let (stem, layer, name) = (String::new(), self.layer.clone(), self.input.clone());
            return Ok(vec![Input { name, path: Some(path), layer, stem, frame: 0, sequence: None, pattern: None }]);
        };
        let Some((pattern, first)) = pattern else {
            return Err(Error::input(format!("frame {frame} of a list of names, which the picture does not hold"))
                .at("sequence")
                .help("Frames of numbered sequences (shot-####.exr) can be made again"));
        };
        let list = names::frames(pattern, layer, *first, *frame)?;
        if list.len() > FRAMES && !long {
            return Err(Error::input(format!(
                "needs {} frames; without --long at most {FRAMES} are allowed",
                list.len()
            ))
            .at("sequence")
            .help("Give --long if you trust the source of the picture and have enough time"));
        }
        Ok(list)
    }
}

/// The request besides the recipe.
#[derive(Debug)]
pub struct Again<'a> {
    /// Width and height of the picture, which are those of its input.
    pub extent: [u32; 2],
    /// Format of the file.
    pub format: Format,
    pub device: &'a DeviceArgs,
    pub console: Console,
    /// The user allows work that takes hours.
    pub long: bool,
    pub interrupt: &'a Interrupt,
}

/// Makes a picture again, in memory; `None`: interrupted. Reads only the files that `config` names as input and as mask.
///
/// # Errors
/// `Input` for wrong values in `config` and for its files; any error of tone mapping.
pub fn again(config: &Value, asked: &Again<'_>) -> Result<Option<Fresh>> {
    let recipe: Recipe = serde_json::from_value(config.clone())
        .map_err(|error| Error::input("does not say how it was developed").caused_by(error))?;
    let settings: Config = serde_json::from_value(recipe.settings.clone())
        .map_err(|error| Error::input(error.to_string()).at("settings"))?;
    settings.tonemap.validate().map_err(|error| error.at("settings.tonemap"))?;
    let making = recipe.making()?;
    let inputs = recipe.inputs(asked.long)?;
    let [width, height] = asked.extent.map(u64::from);
    let limits = Limits { max_image_pixels: width * height, ..LIMITS };
    let read = |path: &Path| {
        asked.console.info(&format!("reads {path:?}"));
        image::read(path, &limits)
    };
    let mask = making.mask.as_deref().map(read).transpose()?;
    let mut run = Run {
        making,
        console: asked.console,
        config: settings,
        outputs: Vec::new(),
        mask,
        metered: None,
        before: None,
    };
    // Errors of reading are reported before the device is opened.
    let mut first = inputs.first().and_then(|input| input.path.as_deref()).map(read).transpose()?;
    let gpu = Gpu::new(asked.device.options()?)?;
    let about = gpu.describe().clone();
    asked.console.info(&format!("lucerna {}, {about}", program::VERSION));
    let mut still = Still::new(&gpu, &run.config.tonemap)?;
    let mut fresh = None;
    for input in &inputs {
        if asked.interrupt.requested() {
            return Ok(None);
        }
        let Some(path) = &input.path else { continue };
        let picture = first.take().map_or_else(|| read(path), Ok)?;
        let (_, unwritten) = run.develop(&mut still, &about, input, picture).map_err(|error| error.in_file(path))?;
        let (layers, options) = unwritten.into_layers();
        fresh = Some((layers, options));
    }
    fresh.map(|(layers, options)| Fresh::new(asked.format, &layers, &options).map(|(fresh, _)| fresh)).transpose()
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn recipe(changes: Value) -> Recipe {
        let mut config = json!({ "command": ["tonemap"], "input": "a.exr", "gamma": "srgb", "settings": {} });
        changes.as_object().unwrap().iter().for_each(|(key, value)| config[key] = value.clone());
        serde_json::from_value(config).unwrap()
    }

    #[test]
    fn what_is_usual_is_not_written() {
        let plain = recipe(json!({}));
        assert_eq!(
            serde_json::to_value(&plain).unwrap(),
            json!({ "command": ["tonemap"], "input": "a.exr", "gamma": "srgb", "settings": {} })
        );
        let sixteen = recipe(json!({ "bits": 16, "gamma": 2.2, "layer": "direct" }));
        let text = serde_json::to_value(&sixteen).unwrap();
        assert!(text["bits"] == 16 && text["layer"] == "direct" && text.get("quality").is_none(), "{text}");
        assert_eq!(sixteen.making().unwrap().gamma, Gamma(Some(2.2)));
    }

    #[test]
    fn odd_recipes_are_refused_before_anything_is_read() {
        for (changes, place) in [
            (json!({ "gamma": "rec709" }), "gamma"),
            (json!({ "gamma": 1e30 }), "gamma"),
            (json!({ "bits": 12 }), "bits"),
            (json!({ "alpha": "over:blu" }), "alpha"),
            (json!({ "quality": 0 }), "quality"),
            (json!({ "sequence": { "frame": 0, "fps": 0.0 } }), "sequence.fps"),
        ] {
            let error = recipe(changes).making().unwrap_err();
            assert_eq!((error.exit_code(), error.place()), (3, Some(place)));
        }
        for (changes, place) in [
            (json!({ "input": "standard input" }), "input"),
            (json!({ "sequence": { "frame": 2, "fps": 25.0 } }), "sequence"),
            (json!({ "sequence": { "frame": 2, "fps": 25.0, "pattern": ["a.exr", 0] } }), "sequence"),
        ] {
            let error = recipe(changes).inputs(false).unwrap_err();
            assert_eq!((error.exit_code(), error.place()), (3, Some(place)));
        }
    }
}
