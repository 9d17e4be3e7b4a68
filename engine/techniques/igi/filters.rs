//! What brings sparse irradiance back to every pixel: the discontinuity buffer, smoothing, and joint bilateral upsampling.

use super::Settings;
use crate::{
    graph::{Buffer, Format, Graph, Image},
    passes::gbuffer::GBuffer,
    shaders::igi::{discontinuity, guide, smooth, upsample},
};

/// Normals and depths of every [`Settings::downsample`]-th pixel, which all filters read.
pub fn guide(graph: &mut Graph, g: &GBuffer, settings: &Settings) -> Image {
    let extent = graph.extent(g.depth).div_ceil(settings.downsample);
    let guide = graph.image("igi.guide", Format::RGBA32F, extent);
    let push = guide::Push { factor: settings.downsample, scattered: settings.scattered.into() };
    let args = guide::Args { normal: g.normal, depth: g.depth, guide, push };
    graph.compute(args, extent);
    guide
}

/// Mean over the tile around each texel of `interleaved` (irradiance of every `downsample`-th pixel), over texels on the same surface
/// by [`Settings::discontinuity_depth`] and [`Settings::discontinuity_normal`].
pub fn join(graph: &mut Graph, guide: Image, interleaved: Image, settings: &Settings) -> Image {
    let extent = graph.extent(interleaved);
    let irradiance = graph.image("igi.joined", Format::RGBA32F, extent);
    let args = discontinuity::Args {
        guide,
        interleaved,
        irradiance,
        push: discontinuity::Push {
            tile: settings.interleave,
            nearness: settings.discontinuity_depth,
            likeness: settings.discontinuity_normal,
        },
    };
    graph.compute(args, extent);
    irradiance
}

/// `coarse` (irradiance of every `downsample`-th pixel) without bright specks, by [`Settings::despeckle`], smoothed in
/// [`Settings::smoothing`] turns, over texels with like normals in the same plane by [`Settings::upsample_normal`] and
/// [`Settings::upsample_range`].
pub fn smooth(graph: &mut Graph, g: &GBuffer, guide: Image, coarse: Image, settings: &Settings) -> Image {
    let extent = graph.extent(coarse);
    let limits = (settings.despeckle > 0.0).then_some((0, settings.despeckle));
    let mut smoothed = coarse;
    for (turn, limit) in limits.into_iter().chain((0..settings.smoothing).map(|turn| (turn, 0.0))) {
        let irradiance = graph.image("igi.smoothed", Format::RGBA32F, extent);
        let push = smooth::Push {
            factor: settings.downsample,
            scattered: settings.scattered.into(),
            stride: 1 << turn,
            sharpness: settings.upsample_normal,
            range: settings.upsample_range,
            limit,
        };
        graph.compute(smooth::Args { view: g.view, guide, coarse: smoothed, irradiance, push }, extent);
        smoothed = irradiance;
    }
    smoothed
}

/// Irradiance of every pixel from that of every `downsample`-th [IGI 2]: weights are a Gaussian of the distance in the picture,
/// the cosine between normals, and nearness to the pixel's plane where [`Settings::upsample_range`] is above 0. And a list of the pixels of which a share below
/// [`Settings::refine`] of the weight is on texels that match: their number, then x + 65,536 y of each, in any order.
pub fn upsample(graph: &mut Graph, g: &GBuffer, guide: Image, coarse: Image, settings: &Settings) -> (Image, Buffer) {
    let extent = graph.extent(g.depth);
    let irradiance = graph.image("igi.upsampled", Format::RGBA32F, extent);
    let room = if settings.refine > 0.0 { extent.pixels() } else { 0 };
    let unmatched = graph.buffer("igi.unmatched", 4 * (room + 1));
    graph.fill(unmatched, 0);
    let args = upsample::Args {
        view: g.view,
        normal: g.normal,
        depth: g.depth,
        guide,
        coarse,
        irradiance,
        unmatched,
        push: upsample::Push {
            factor: settings.downsample,
            sigma: settings.upsample_sigma,
            sharpness: settings.upsample_normal,
            range: settings.upsample_range,
            scattered: settings.scattered.into(),
            least: settings.refine,
        },
        // Until the Gaussian is a tenth.
        spec: upsample::Spec { reach: (2.2 * settings.upsample_sigma - 0.5).ceil().max(1.0) as u32 },
    };
    graph.compute(args, extent);
    (irradiance, unmatched)
}
