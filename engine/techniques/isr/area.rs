//! Light of the sky and of glowing surfaces, by rays: the part that image space cannot know, because walls and lamps outside of the picture count.
//!
//! Each texel of the coarse buffers sends some rays to the sky and as many to emissive triangles. The blur of the technique averages them. Light of the
//! sky is stored as its unshadowed share, so that surfaces under the open sky have no noise and keep the exact irradiance of
//! [`crate::passes::ambient`]. Surfaces in the picture send this light on.

use super::{AreaLights as Choice, Settings};
use crate::{
    Result,
    gpu::Gpu,
    graph::{Buffer, Format, Graph, Image},
    passes::{
        ambient::Irradiance,
        downsample::{self, Coarse},
        gbuffer::GBuffer,
    },
    rays::{RayHandles, Rays, traced},
    resident::{Handles, Resident},
    scene::{Pose, Scene},
    shaders::{
        isr::{area, area_sender},
        types,
    },
    tracer::tables::{AreaHandles, AreaLights},
};

/// The data that rays to the sky, to glowing surfaces and to unseen surfaces of a scene need.
#[derive(Debug)]
pub struct Area {
    rays: Rays,
    lights: AreaLights,
}

impl Area {
    /// Builds acceleration structures and tables. `None` if the settings need no rays: those of [`super::AreaLights::Rays`] do in scenes with an
    /// environment or emissive surfaces, and in all scenes for [`Settings::unseen`].
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`; `Runtime` if the scene is larger than the device's limits.
    pub fn new(gpu: &Gpu, scene: &Scene, resident: &Resident, settings: &Settings) -> Result<Option<Self>> {
        if settings.area_lights != Choice::Rays || !(AreaLights::any(scene) || settings.fills()) {
            return Ok(None);
        }
        Ok(Some(Self { rays: Rays::new(gpu, scene, resident)?, lights: AreaLights::new(gpu, scene)? }))
    }

    /// Imports the data into a graph. `handles` belong to the graph and to the pose.
    pub fn frame(&mut self, graph: &mut Graph, scene: &Scene, pose: &Pose, handles: &Handles) -> AreaFrame {
        let lights = self.lights.frame(graph, scene, pose);
        AreaFrame { rays: self.rays.frame(graph, handles), lights, surfaces: Surfaces::of(handles) }
    }
}

/// [`Area`] in a graph.
#[derive(Clone, Copy, Debug)]
pub struct AreaFrame {
    rays: RayHandles,
    lights: AreaHandles,
    surfaces: Surfaces,
}

/// The buffers of `lib/hit_surface.glsl`.
#[derive(Clone, Copy, Debug)]
struct Surfaces {
    instances: Buffer,
    indices: Buffer,
    positions: Buffer,
    normals: Buffer,
    tangents: Buffer,
    uvs: Buffer,
    colors: Buffer,
}

impl Surfaces {
    fn of(handles: &Handles) -> Self {
        let Handles { instances, indices, positions, normals, tangents, uvs, colors, .. } = *handles;
        Self { instances, indices, positions, normals, tangents, uvs, colors }
    }
}

/// Light that rays found, at the resolution of the coarse buffers.
#[derive(Clone, Copy, Debug)]
pub(super) struct AreaLight {
    /// RGBA16F: the share of the sky's irradiance that arrives, times alpha.
    pub sky: Image,
    /// RGBA16F: radiance of a white receiver by emissive triangles, W/(sr·m²).
    pub lamps: Image,
}

impl AreaLight {
    /// The same light with each image replaced.
    pub(super) fn map(self, mut by: impl FnMut(Image) -> Image) -> Self {
        Self { sky: by(self.sky), lamps: by(self.lamps) }
    }
}

impl AreaFrame {
    /// The scene has a sky or glowing surfaces.
    pub(super) fn has_lights(&self) -> bool {
        self.lights.sky || self.lights.tree
    }

    /// Declares the rays. `coarse`: the coarse buffers of `g`. `ambient`: of [`Irradiance::upload`].
    pub(super) fn light(
        &self,
        graph: &mut Graph,
        g: &GBuffer,
        coarse: &Coarse,
        ambient: Buffer,
        settings: &Settings,
    ) -> AreaLight {
        let extent = graph.extent(coarse.depth);
        let lit = AreaLight {
            sky: graph.image("isr.sky", Format::RGBA16F, extent),
            lamps: graph.image("isr.lamps", Format::RGBA16F, extent),
        };
        let (rays, tree) = (settings.area_rays, self.lights.tree);
        let sky = self.lights.sky && settings.environment;
        let settings =
            graph.uniform(&types::IsrAreaSettings { environment: self.lights.map, seed: graph.seed, rays, two: 2 });
        let spec = area::Spec { sky: sky.into(), tree: tree.into() };
        let args = traced!(
            area::Args {
                view: g.view,
                normal: g.normal,
                depth: g.depth,
                coarse_depth: coarse.depth,
                settings,
                ambient,
                sky: lit.sky,
                lamps: lit.lamps,
                environment_radiance_map: self.lights.environment,
                environment_edges: self.lights.environment_edges,
                light_columns: self.lights.light_columns,
                light_targets: self.lights.light_targets,
                instance_lights: self.lights.instance_lights,
                light_nodes: self.lights.light_nodes,
                spec,
            },
            self.rays,
            self.surfaces
        );
        let count = u64::from(rays) * (u64::from(sky) + u64::from(tree));
        graph.compute(args, extent).rays(extent.pixels() * count);
        lit
    }
    /// The radiance `lit` of a picture, and what its surfaces reflect of this light, which is not filtered.
    pub(super) fn added(
        &self,
        graph: &mut Graph,
        lit: Image,
        g: &GBuffer,
        ambient: Buffer,
        settings: &Settings,
    ) -> Image {
        let coarse = downsample::gbuffer(graph, g, 1, false);
        let light = self.light(graph, g, &coarse, ambient, settings);
        Self::sent(graph, lit, &coarse, light, ambient)
    }

    /// The radiance `sender`, and what the surfaces reflect of this light. `coarse`, `ambient`: as in [`Self::light`].
    pub(super) fn sent(graph: &mut Graph, sender: Image, coarse: &Coarse, light: AreaLight, ambient: Buffer) -> Image {
        let extent = graph.extent(coarse.depth);
        let sent = graph.image("isr.area.sent", Format::RGBA16F, extent);
        let args = area_sender::Args {
            sender,
            albedo: coarse.albedo,
            normal: coarse.normal,
            sky: light.sky,
            lamps: light.lamps,
            ambient,
            sent,
        };
        graph.compute(args, extent);
        sent
    }
}

/// Light of the surroundings of a frame.
#[derive(Clone, Debug, Default)]
pub struct Surroundings {
    /// Irradiance of the environment without shadows.
    pub ambient: Irradiance,
    /// For [`super::AreaLights::Rays`]. `None`: no rays.
    pub area: Option<AreaFrame>,
}

impl From<Irradiance> for Surroundings {
    fn from(ambient: Irradiance) -> Self {
        Self { ambient, area: None }
    }
}

impl From<&Scene> for Surroundings {
    fn from(scene: &Scene) -> Self {
        Irradiance::from(scene).into()
    }
}
