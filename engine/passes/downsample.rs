//! The G-buffer at half width and height.

use super::gbuffer::GBuffer;
use crate::{
    graph::{Format, Graph, Image},
    shaders::passes::{downsample, downsample_color},
};

/// Relative difference in depth within which texels count as one surface.
const TOLERANCE: f32 = 0.05;

/// The coarse G-buffer, which image-space gathering reads.
#[derive(Clone, Copy, Debug)]
pub struct Coarse {
    /// Linear albedo; alpha is the radiation mask.
    pub albedo: Image,
    /// World normal, decoded, not normalised.
    pub normal: Image,
    /// Linear depth / far; background is exactly 1.
    pub depth: Image,
}

/// Albedo, normal and depth at 1/`factor` (1 or 2) of width and height, rounded up. `depth_aware`: the mean of the texels on the
/// nearest surface instead of all four.
pub fn gbuffer(graph: &mut Graph, g: &GBuffer, factor: u32, depth_aware: bool) -> Coarse {
    let extent = graph.extent(g.depth).div_ceil(factor);
    let coarse = Coarse {
        albedo: graph.image("coarse.albedo", Format::RGBA16F, extent),
        normal: graph.image("coarse.normal", Format::RGBA16F, extent),
        depth: graph.image("coarse.depth", Format::R32F, extent),
    };
    let args = downsample::Args {
        albedo: g.albedo,
        normal: g.normal,
        depth: g.depth,
        coarse_albedo: coarse.albedo,
        coarse_normal: coarse.normal,
        coarse_depth: coarse.depth,
        push: downsample::Push { tolerance: TOLERANCE },
        spec: downsample::Spec { factor, depth_aware: depth_aware.into() },
    };
    graph.compute(args, extent);
    coarse
}

/// Downsamples the radiance `color` like [`gbuffer`]. Alpha is the radiation mask times the share of the coarse texel that the chosen texels
/// cover.
pub fn color(graph: &mut Graph, color: Image, g: &GBuffer, factor: u32, depth_aware: bool) -> Image {
    let extent = graph.extent(g.depth).div_ceil(factor);
    let coarse = graph.image("coarse.color", Format::RGBA16F, extent);
    let args = downsample_color::Args {
        color,
        depth: g.depth,
        albedo: g.albedo,
        coarse,
        push: downsample_color::Push { tolerance: TOLERANCE },
        spec: downsample_color::Spec { factor, depth_aware: depth_aware.into() },
    };
    graph.compute(args, extent);
    coarse
}
