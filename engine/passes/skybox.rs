//! The background: the environment or a constant colour.

use crate::{
    graph::{Depth, Draw, Graph, Image, Load, Raster, Stencil, StencilLoad, Targets},
    passes::gbuffer::GBuffer,
    resident::Handles,
    shaders::passes::skybox as shader,
};
use glam::Vec3;

/// Draws the scene's environment plus `constant` (radiance, W/(sr·m²)) into the pixels of `target` where the G-buffer has
/// no surface. All other pixels keep their values.
pub fn draw(graph: &mut Graph, scene: &Handles, gbuffer: &GBuffer, constant: Vec3, target: Image) {
    let args = shader::Args {
        view: gbuffer.view,
        environment: scene.environment.repeat(),
        push: shader::Push {
            scale: [scene.moment.environment_scale; 3],
            rotation: scene.moment.environment_rotation,
            constant: constant.to_array(),
        },
    };
    let targets =
        Targets::new().color(target, Load::Keep).depth(gbuffer.hardware, Depth::ReadOnly).stencil(StencilLoad::Keep);
    let state = Raster::new().depth_write(false).stencil(Stencil::equals(0));
    graph.raster(targets, state, args, Draw::fullscreen());
}
