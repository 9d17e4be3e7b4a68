//! Reinhard and Devlin 2005: statistics of the whole picture, and the passes of the operator.
//!
//! Nothing here adapts in time: means and range are those of the frame.

use super::{Settings, statistics::Rectangle};
use crate::{
    graph::{Buffer, Format, Graph, Image},
    shaders::{
        consts,
        tonemap::{receptor, receptor_range, receptor_sums},
        types::{TonemapReceptor, TonemapReceptorSettings},
    },
};
use std::mem::offset_of;

/// Bytes of a `types::TonemapReceptor`.
pub const BYTES: u64 = size_of::<TonemapReceptor>() as u64;

/// Buffers of the statistics of a picture.
#[derive(Clone, Copy, Debug)]
pub struct Known {
    /// Sums of [`super::statistics::luminance`] over the whole picture.
    pub sums: Buffer,
    /// One `types::TonemapReceptor`.
    pub receptor: Buffer,
    pub statistics: Buffer,
    /// Pixels of the whole picture.
    pub pixels: u64,
}

/// Sums of no pixels.
pub fn empty(graph: &mut Graph, receptor: Buffer) {
    let least = offset_of!(TonemapReceptor, least) as u64;
    graph.fill(receptor.range(0..least), 0);
    graph.fill(receptor.range(least..least + 4), u32::MAX);
    graph.fill(receptor.range(least + 4..BYTES), 0);
}

/// Adds the channels of the pixels of `part`.
pub fn sums(graph: &mut Graph, color: Image, part: Rectangle, known: &Known, settings: &Settings) {
    let Known { sums, receptor, .. } = *known;
    let push = receptor_sums::Push { first: part.first, last: part.last, exposure: settings.exposure.exp2() };
    let [width, height] = part.size();
    let args = receptor_sums::Args { color, sums, receptor, push };
    graph.compute(args, [width, height.div_ceil(consts::TONEMAP_ROWS)]);
}

/// Adds the responses of the pixels of `part` to the range. The sums are complete.
pub fn range(graph: &mut Graph, color: Image, part: Rectangle, known: &Known, settings: &Settings) {
    let Known { sums, receptor, statistics, pixels } = *known;
    let push = receptor_range::Push { settings: pushed(pixels, settings), first: part.first, last: part.last };
    let [width, height] = part.size();
    let args = receptor_range::Args { color, statistics, sums, receptor, push };
    graph.compute(args, [width, height.div_ceil(consts::TONEMAP_ROWS)]);
}

/// The result. The range is complete.
pub fn mapped(graph: &mut Graph, color: Image, known: &Known, settings: &Settings) -> Image {
    let Known { sums, receptor, statistics, pixels } = *known;
    let extent = graph.extent(color);
    let mapped = graph.image("tonemap.mapped", Format::RGBA32F, extent);
    let push = receptor::Push { settings: pushed(pixels, settings) };
    let args = receptor::Args { color, statistics, sums, receptor, mapped, push };
    graph.compute(args, [extent.width, extent.height.div_ceil(consts::TONEMAP_CURVE_ROWS)]);
    mapped
}

fn pushed(pixels: u64, settings: &Settings) -> TonemapReceptorSettings {
    TonemapReceptorSettings {
        exposure: settings.exposure.exp2(),
        intensity: (-settings.intensity).exp(),
        contrast: settings.receptor_contrast.unwrap_or(0.0),
        chromatic: settings.chromatic,
        local: settings.adaptation,
        pixels: pixels as f32,
    }
}
