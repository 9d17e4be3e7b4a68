//! Maps of important pixels that serve several frames ([`Settings::keep_map`]; thesis 6.3.2).

use super::{Mode, Settings, identify};
use crate::{
    Result,
    gpu::{Gpu, ImageDesc, OwnedImage, Region},
    graph::{Buffer, Extent, Format, Graph, Image},
};

/// The map of an earlier frame, without the mask of that frame.
#[derive(Debug, Default)]
pub struct Maps(Option<Kept>);

#[derive(Debug)]
struct Kept {
    map: OwnedImage,
    extent: Extent,
    /// Frames since the map was found.
    age: u32,
}

/// Where the map of a frame comes from.
#[derive(Clone, Copy, Debug)]
pub enum Map {
    /// Found in this frame.
    Found,
    /// Found in this frame, and kept in this image for the next frames.
    Kept(Image),
    /// Found in an earlier frame.
    Reused(Image),
}

/// Whether maps serve several frames. `dt`: seconds since the last frame; `None`: the picture stands for itself.
pub fn goes_on(settings: &Settings, dt: Option<f32>) -> bool {
    settings.keep_map > 1 && settings.mode() == Mode::Selective && dt.is_some_and(f32::is_finite)
}

impl Maps {
    /// The map of the next frame. A frame of another extent finds its own. A frame 0 seconds after the last one is the same frame again.
    ///
    /// # Errors
    /// `OutOfMemory`.
    pub fn next(
        &mut self,
        gpu: &Gpu,
        graph: &mut Graph,
        extent: Extent,
        dt: Option<f32>,
        settings: &Settings,
    ) -> Result<Map> {
        if !goes_on(settings, dt) {
            self.0 = None;
            return Ok(Map::Found);
        }
        let step = u32::from(dt.is_some_and(|dt| dt > 0.0));
        let kept = match self.0.take().filter(|kept| kept.extent == extent) {
            Some(kept) if kept.age + step < settings.keep_map => Kept { age: kept.age + step, ..kept },
            Some(kept) => Kept { age: 0, ..kept },
            None => Kept { map: image(gpu, extent)?, extent, age: 0 },
        };
        let map = graph.import_image(&kept.map);
        let of = if kept.age == 0 { Map::Kept(map) } else { Map::Reused(map) };
        self.0 = Some(kept);
        Ok(of)
    }
}

/// R32F, white: if the graph that finds the map never runs, all pixels are important, which is slower and not wrong.
fn image(gpu: &Gpu, extent: Extent) -> Result<OwnedImage> {
    let desc = ImageDesc::new(Format::R32F.to_vk(), extent.width, extent.height);
    let all = vec![1.0f32; extent.pixels() as usize];
    let bytes = bytemuck::cast_slice(&all);
    OwnedImage::with_contents(gpu, "tonemap.map", desc, &[Region { mip: 0, layer: 0, bytes }])
}

impl Map {
    /// The map of this frame, as [`identify::importance`].
    pub fn importance(
        self,
        graph: &mut Graph,
        luminance: Image,
        statistics: Buffer,
        mask: Option<Image>,
        settings: &Settings,
    ) -> Image {
        let map = match self {
            Self::Found => return identify::importance(graph, luminance, statistics, mask, settings),
            Self::Kept(kept) => {
                let found = identify::importance(graph, luminance, statistics, None, settings);
                graph.copy(found, kept);
                found
            }
            Self::Reused(kept) => kept,
        };
        match mask {
            Some(mask) => identify::masked(graph, map, mask),
            None => map,
        }
    }
}
