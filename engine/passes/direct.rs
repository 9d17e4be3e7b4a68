//! Direct light of all punctual lights.

use super::{bilateral, downsample, gbuffer::GBuffer, shadow::ShadowMaps};
use crate::{
    graph::{Buffer, Format, Graph, Image},
    shaders::{
        consts::SHADOW_SCREENED,
        passes::{direct, shadow_screen},
    },
};

/// The lights of the scene and their shadow maps.
#[derive(Clone, Copy, Debug)]
pub struct Lights {
    /// `lib/lights.glsl`
    pub lights: Buffer,
    /// `lib/shadow.glsl`
    pub shadows: Buffer,
    /// All shadow maps, an array image.
    pub shadow_maps: Image,
    /// The number of lights, and the reach of the filter of their shadows over the picture, pixels; with a reach of 0 there is no filter.
    pub screen_blur: (u32, u32),
}

impl From<&ShadowMaps> for Lights {
    fn from(maps: &ShadowMaps) -> Self {
        let ShadowMaps { lights, shadows, maps: shadow_maps, screen_blur, .. } = *maps;
        Self { lights, shadows, shadow_maps, screen_blur }
    }
}

/// Choices of [`light`].
#[derive(Clone, Copy, Debug)]
pub struct Direct {
    /// The dissertation's attenuation [ISR 16] instead of radiometry.
    pub paper_law: bool,
    /// GGX microfacets over the diffuse base (`lib/brdf.glsl`); the paper's law adds them to the base. If off, surfaces are Lambertian.
    pub specular: bool,
    /// Paper law: radius of lights without a range, metres; 0: the far distance of the camera.
    pub light_radius: f32,
    /// Paper law: power of the brightest light.
    pub light_power: f32,
    /// Directional lights light, too.
    pub suns: bool,
    /// Factor on the light of all lights.
    pub strength: f32,
    /// [`Lit::diffuse`] contains emission.
    pub glow: bool,
}

impl Default for Direct {
    /// Radiometry of all lights, with microfacets.
    fn default() -> Self {
        Self {
            paper_law: false,
            specular: true,
            light_radius: 0.0,
            light_power: 1.0,
            suns: true,
            strength: 1.0,
            glow: true,
        }
    }
}

/// What [`light`] writes, RGBA16F, at the resolution of the G-buffer.
#[derive(Clone, Copy, Debug)]
pub struct Lit {
    /// Radiance towards the camera, with emission.
    pub direct: Image,
    /// Radiance that is equal in all directions: the diffuse reflection and, if [`Direct::glow`] is on, the emission.
    pub diffuse: Image,
}

/// Adds up the light of every light at every pixel.
pub fn light(graph: &mut Graph, g: &GBuffer, lights: Lights, choices: &Direct) -> Lit {
    let extent = graph.extent(g.depth);
    let lit = Lit {
        direct: graph.image("direct", Format::RGBA16F, extent),
        diffuse: graph.image("direct.diffuse", Format::RGBA16F, extent),
    };
    let (screened, filtered) = screened(graph, g, lights);
    let args = direct::Args {
        view: g.view,
        albedo: g.albedo,
        normal: g.normal,
        depth: g.depth,
        specular: g.specular,
        emission: g.emission,
        direct: lit.direct,
        diffuse: lit.diffuse,
        lights: lights.lights,
        shadows: lights.shadows,
        shadow_maps: lights.shadow_maps,
        screened: filtered,
        push: direct::Push {
            light_radius: choices.light_radius,
            light_power: choices.light_power,
            suns: choices.suns.into(),
            strength: choices.strength,
            glow: choices.glow.into(),
        },
        spec: direct::Spec { paper_law: choices.paper_law.into(), specular: choices.specular.into(), screened },
    };
    graph.compute(args, extent);
    lit
}

/// Distance from a pixel's plane, relative to its depth, at which the weight of another pixel's shadow falls to exp(−1/2).
const SHADOW_RANGE: f32 = 0.01;

/// Filtered shadows of the first lights ([`super::shadow::Settings::screen_blur`]): their number, and images with a channel for each.
fn screened(graph: &mut Graph, g: &GBuffer, lights: Lights) -> (u32, [Image; 4]) {
    let (count, reach) = lights.screen_blur;
    let count = if reach == 0 { 0 } else { count.min(SHADOW_SCREENED) };
    let mut images = [g.depth; 4];
    if count == 0 {
        return (0, images);
    }
    graph.scope("shadow.screen", |graph| {
        let decoded = downsample::gbuffer(graph, g, 1, false);
        for (image, first) in images.iter_mut().zip((0..count).step_by(4)) {
            let extent = graph.extent(g.depth);
            let shadow = graph.image("shadow.screen", Format::RGBA16F, extent);
            let args = shadow_screen::Args {
                view: g.view,
                normal: g.normal,
                depth: g.depth,
                shadow,
                lights: lights.lights,
                shadows: lights.shadows,
                shadow_maps: lights.shadow_maps,
                push: shadow_screen::Push { first },
            };
            graph.compute(args, extent);
            *image = bilateral::blur(graph, shadow, &decoded, g.view, 1, reach, SHADOW_RANGE);
        }
    });
    (count, images)
}
