//! Coarse light brought to full resolution and added to direct light.

use super::{downsample::Coarse, gbuffer::GBuffer};
use crate::{
    graph::{Buffer, Format, Graph, Image},
    shaders::passes::compose,
};

/// Choices and constants of [`sum`].
#[derive(Clone, Copy, Debug)]
pub struct Compose {
    /// Pixels along the side of a coarse texel: 1 or 2.
    pub factor: u32,
    /// Weight by likeness of normals and distance from the pixel's plane, relative to its depth, instead of difference of
    /// depth / far.
    pub plane: bool,
    /// ε of [ISR 27].
    pub epsilon: f32,
    /// Multiply gathered light by the albedo.
    pub tint: bool,
    /// Occlusion darkens ambient light instead of direct light.
    pub occlude_ambient: bool,
    pub k_ssao: f32,
    pub k_isr: f32,
    /// Coarse light of the sky (rgb: the share of its irradiance that arrives, times alpha) and of emissive surfaces (radiance of a white receiver, W/(sr·m²)).
    /// `None`: the environment lights every surface, times accessibility.
    pub area: Option<[Image; 2]>,
}

/// What [`sum`] writes, at full resolution.
#[derive(Clone, Copy, Debug)]
pub struct Composed {
    /// RGBA16F; alpha 1 on geometry.
    pub total: Image,
    /// RGBA16F: gathered and ambient light as they enter the sum.
    pub indirect: Image,
    /// R32F: 1 open, 0 occluded.
    pub accessibility: Image,
}

/// Bilateral upsampling [ISR 27], [ISR 28] and the sum of all light [ISR 29]. `ambient`: of [`super::ambient::Irradiance::upload`]; `gathered`: rgb radiance, a accumulated occlusion, at the resolution of `coarse`.
#[allow(clippy::too_many_arguments)]
pub fn sum(
    graph: &mut Graph,
    g: &GBuffer,
    ambient: Buffer,
    direct: Image,
    gathered: Image,
    coarse: &Coarse,
    choices: &Compose,
) -> Composed {
    let extent = graph.extent(g.depth);
    let result = Composed {
        total: graph.image("total", Format::RGBA16F, extent),
        indirect: graph.image("indirect", Format::RGBA16F, extent),
        accessibility: graph.image("occlusion", Format::R32F, extent),
    };
    let args = compose::Args {
        view: g.view,
        ambient,
        albedo: g.albedo,
        normal: g.normal,
        depth: g.depth,
        emission: g.emission,
        specular: g.specular,
        direct,
        gathered,
        coarse_depth: coarse.depth,
        coarse_normal: coarse.normal,
        total: result.total,
        indirect: result.indirect,
        accessibility: result.accessibility,
        // Bindings need images; without light by rays the shader does not read them.
        sky: choices.area.map_or(gathered, |[sky, _]| sky),
        lamps: choices.area.map_or(gathered, |[_, lamps]| lamps),
        push: compose::Push { k_ssao: choices.k_ssao, k_isr: choices.k_isr, epsilon: choices.epsilon },
        spec: compose::Spec {
            factor: choices.factor,
            plane: choices.plane.into(),
            tint: choices.tint.into(),
            occlude_ambient: choices.occlude_ambient.into(),
            area: choices.area.is_some().into(),
        },
    };
    graph.compute(args, extent);
    result
}
