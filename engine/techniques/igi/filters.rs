//! Filters that compute the irradiance of every pixel from coarse or interleaved irradiance: the discontinuity buffer, edge-avoiding
//! smoothing, and joint bilateral upsampling. One more filter removes the noise of direct and of compensated light.

use super::Settings;
use crate::{
    graph::{Buffer, Format, Graph, Image},
    passes::gbuffer::GBuffer,
    shaders::igi::{discontinuity, guide, smooth, soft_filter, soft_noise, upsample},
};

/// Exponent of the cosine between normals in the weights of [`soft_light`].
const SOFT_SHARPNESS: f32 = 16.0;
/// Distance from the pixels' planes, relative to their depth, at which its weight falls to 0.6.
const SOFT_RANGE: f32 = 0.01;
/// Standard deviations by which the light of two pixels may differ with weight 0.37.
const SOFT_CONTRAST: f32 = 2.0;

/// Guide image for all filters, one texel for every [`Settings::downsample`]-th pixel: rgb unit normal, a linear depth / far.
pub fn guide(graph: &mut Graph, g: &GBuffer, settings: &Settings) -> Image {
    guide_of(graph, g, settings.downsample, settings.scattered)
}

fn guide_of(graph: &mut Graph, g: &GBuffer, factor: u32, scattered: bool) -> Image {
    let extent = graph.extent(g.depth).div_ceil(factor);
    let guide = graph.image("igi.guide", Format::RGBA32F, extent);
    let push = guide::Push { factor, scattered: scattered.into() };
    let args = guide::Args { normal: g.normal, depth: g.depth, guide, push };
    graph.compute(args, extent);
    guide
}

/// The discontinuity buffer (section 4.3): each texel's mean of `interleaved` over the tile around it. `interleaved` is the irradiance
/// of every [`Settings::downsample`]-th pixel, W/m². Only texels on the same surface count, by [`Settings::discontinuity_depth`] and
/// [`Settings::discontinuity_normal`].
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

/// Dims specks in `coarse` by [`Settings::despeckle`], then smooths it in [`Settings::smoothing`] iterations (Dammertz et al. 2010).
/// `coarse` is the irradiance of every [`Settings::downsample`]-th pixel, W/m². Weights follow normals and planes by
/// [`Settings::upsample_normal`] and [`Settings::upsample_range`].
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

/// Irradiance of every pixel, W/m², from `coarse`, the irradiance of every [`Settings::downsample`]-th pixel [IGI 2]. The weights
/// are a Gaussian of the distance in the picture, a power of the cosine between normals, and, if [`Settings::upsample_range`] is above
/// 0, a Gaussian of the distance from the pixel's plane.
///
/// The buffer lists the pixels for which less than [`Settings::refine`] of the weight falls on matching texels: their number, then
/// x + 65,536 y for each, in any order.
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
        // At this distance the Gaussian has fallen to about a tenth.
        spec: upsample::Spec { reach: (2.2 * settings.upsample_sigma - 0.5).ceil().max(1.0) as u32 },
    };
    graph.compute(args, extent);
    (irradiance, unmatched)
}

/// `soft` without most of its noise; alpha: variance of its luminance, -1 where there is no lit surface. `soft`: direct light of emissive surfaces and
/// of the sky, as radiance divided by the surfaces' colours, or compensated irradiance, W/m²; alpha: the difference between the luminances of both
/// halves of the samples. `rare`: some pixels have a rare bright sample, which stands alone among neighbours with little noise. The sum over all
/// pixels does not change (Schied et al. 2017, with exchanges that keep the light; `igi/soft_filter.comp`).
pub fn soft_light(graph: &mut Graph, g: &GBuffer, soft: Image, iterations: u32, rare: bool) -> Image {
    let extent = graph.extent(g.depth);
    let guide = guide_of(graph, g, 1, false);
    let mut light = graph.image("igi.soft_noise", Format::RGBA32F, extent);
    let push = soft_noise::Push { sharpness: SOFT_SHARPNESS, range: SOFT_RANGE, rare: rare.into() };
    graph.compute(soft_noise::Args { view: g.view, guide, soft, albedo: g.albedo, light, push }, extent);
    for turn in 0..iterations {
        let filtered = graph.image("igi.soft_filtered", Format::RGBA32F, extent);
        let push = soft_filter::Push {
            stride: 1 << turn,
            sharpness: SOFT_SHARPNESS,
            range: SOFT_RANGE,
            contrast: SOFT_CONTRAST,
        };
        graph.compute(soft_filter::Args { view: g.view, guide, light, filtered, push }, extent);
        light = filtered;
    }
    light
}
