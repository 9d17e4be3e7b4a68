//! Tone mapping of pictures, and of frames that are rendered for it, on the device and by the CPU twin.

use std::time::Instant;

use lucerna::{
    Error, Result,
    gpu::{Gpu, ImageDesc, OwnedImage, Region},
    graph::{Format, Runner},
    image::{Layer, Layers, Precision},
    reference,
    technique::Picture,
    techniques::{
        isr::{Isr, PictureSettings},
        tonemap::{self, Tonemap},
    },
};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::{Job, Rendered, Times, Warm, no_paper, on_device, read, technique};
use crate::{config, experiment::file::Changes};

/// Settings of both kinds.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Settings {
    tonemap: tonemap::Settings,
}

pub(super) fn settings(paper: bool, changes: &Changes) -> Result<Value> {
    no_paper("tonemap", paper)?;
    // The operators as their papers define them.
    let base = Settings { tonemap: tonemap::Settings::paper() };
    let settings: Settings = config::with(&base, changes)?;
    settings.tonemap.validate()?;
    if !settings.tonemap.important.trim().is_empty() || settings.tonemap.keep_map > 1 {
        let what = "important and keep_map need a scene and a sequence, but this kind maps single pictures";
        return Err(Error::usage(what).at("tonemap").help("Leave them out"));
    }
    config::to_value(&settings)
}

/// A linear picture in host memory and on the device.
struct Source {
    /// The rendered view; null for a picture.
    of: Value,
    pixels: Vec<[f32; 4]>,
    image: OwnedImage,
}

/// The data of both kinds for a scene.
struct Kept {
    runner: Runner,
    source: Option<Source>,
}

/// The picture of a scene entry, or its frame from this view by image-space radiosity. `None`: interrupted.
fn source<'k>(warm: &'k mut Warm<'_>, job: &Job<'_>) -> Result<Option<&'k mut Kept>> {
    let of = if warm.image.is_some() { Value::Null } else { crate::experiment::place::view_key(job.view)? };
    let kept = warm.keep("tonemap", |gpu, _, _| Ok(Kept { runner: Runner::new(gpu), source: None }))?;
    if kept.source.as_ref().is_none_or(|source| source.of != of) {
        kept.source = None;
        let layers = match warm.image {
            Some(image) => image.clone(),
            None => {
                let settings = config::to_value(&PictureSettings::default())?;
                let frame = Job { settings: &settings, repeat: 1, ..*job };
                let Some(rendered) = technique::picture::<Isr>(warm, &frame)? else { return Ok(None) };
                rendered.layers
            }
        };
        let mut pixels = colours(&layers)?;
        tonemap::clean(layers.width, &mut pixels, tonemap::Settings::default().bad_values)?;
        let image = upload(warm.gpu, layers.width, layers.height, &pixels)?;
        let kept = warm.keep("tonemap", |gpu, _, _| Ok(Kept { runner: Runner::new(gpu), source: None }))?;
        kept.source = Some(Source { of, pixels, image });
    }
    warm.keep("tonemap", |gpu, _, _| Ok(Kept { runner: Runner::new(gpu), source: None })).map(Some)
}

/// Red, green, blue and 1.
fn colours(layers: &Layers) -> Result<Vec<[f32; 4]>> {
    let main = layers.main().and_then(Layer::rgb_pixels).ok_or_else(|| Error::input("the picture has no colours"))?;
    Ok(main.into_iter().map(|[r, g, b]| [r, g, b, 1.0]).collect())
}

fn upload(gpu: &Gpu, width: u32, height: u32, pixels: &[[f32; 4]]) -> Result<OwnedImage> {
    let desc = ImageDesc::new(Format::RGBA32F.to_vk(), width, height);
    let region = Region { mip: 0, layer: 0, bytes: bytemuck::cast_slice(pixels) };
    OwnedImage::with_contents(gpu, "tonemap.picture", desc, &[region])
}

pub(super) fn on_gpu(warm: &mut Warm<'_>, job: &Job<'_>) -> Result<Option<Rendered>> {
    let Settings { tonemap: settings } = read(job.settings)?;
    let mut tonemap = Tonemap::new(warm.gpu, &settings)?;
    let Some(Kept { runner, source: Some(source) }) = source(warm, job)? else { return Ok(None) };
    let rendered = on_device(runner, job, "tonemap", |graph| {
        let picture = graph.import_image(&source.image);
        let out = tonemap.frame(graph, picture, None)?;
        let shown = Picture::new(out.mapped).values("luminance", &["Y"], out.luminance);
        Ok(match out.important {
            Some(map) => shown.values("important", &["Y"], map),
            None => shown,
        })
    })?;
    Ok(rendered.map(|rendered| Rendered { layers: precise(rendered.layers), ..rendered }))
}

pub(super) fn on_cpu(warm: &mut Warm<'_>, job: &Job<'_>) -> Result<Option<Rendered>> {
    let Settings { tonemap: settings } = read(job.settings)?;
    let [width, height] = job.view.extent;
    let Some(Kept { source: Some(source), .. }) = source(warm, job)? else { return Ok(None) };
    let pixels: Vec<[f32; 3]> = source.pixels.iter().map(|[r, g, b, _]| [*r, *g, *b]).collect();
    let begun = Instant::now();
    let mapped = reference::tonemap::tonemap(width, height, &pixels, &settings);
    let times = Times { wall: vec![begun.elapsed().as_secs_f64() * 1e3], ..Times::default() };
    let layers = precise(Layers::new(width, height).with(Layer::rgb("", &mapped)));
    Ok(Some(Rendered { layers, times }))
}

/// Stores all layers in 32 bits, because the analysis needs differences of a hundredth of a percent.
fn precise(mut layers: Layers) -> Layers {
    layers.layers.iter_mut().for_each(|layer| layer.precision = Precision::Full);
    layers
}
