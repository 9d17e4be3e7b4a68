//! What brings sparse irradiance back to every pixel: the discontinuity buffer and joint bilateral upsampling.

use super::Settings;
use crate::{
    graph::{Format, Graph, Image},
    passes::gbuffer::GBuffer,
    shaders::igi::{discontinuity, guide, upsample},
};

/// Normals and depths of every `downsample`-th pixel, which both filters read.
pub fn guide(graph: &mut Graph, g: &GBuffer, downsample: u32) -> Image {
    let extent = graph.extent(g.depth).div_ceil(downsample);
    let guide = graph.image("igi.guide", Format::RGBA32F, extent);
    let args = guide::Args { normal: g.normal, depth: g.depth, guide, push: guide::Push { factor: downsample } };
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

/// Irradiance of every pixel from that of every `downsample`-th (equation 2): weights are a Gaussian of the distance in the picture,
/// the cosine between normals, and nearness to the pixel's plane where [`Settings::upsample_range`] is above 0.
pub fn upsample(graph: &mut Graph, g: &GBuffer, guide: Image, coarse: Image, settings: &Settings) -> Image {
    let extent = graph.extent(g.depth);
    let irradiance = graph.image("igi.upsampled", Format::RGBA32F, extent);
    let args = upsample::Args {
        view: g.view,
        normal: g.normal,
        depth: g.depth,
        guide,
        coarse,
        irradiance,
        push: upsample::Push {
            factor: settings.downsample,
            sigma: settings.upsample_sigma,
            sharpness: settings.upsample_normal,
            range: settings.upsample_range,
        },
        // Until the Gaussian is a tenth.
        spec: upsample::Spec { reach: (2.2 * settings.upsample_sigma - 0.5).ceil().max(1.0) as u32 },
    };
    graph.compute(args, extent);
    irradiance
}
