//! Smooth edges of one picture: further places inside each pixel have a G-buffer of their own and no light. Each place takes the light of the
//! pixels around that show its surface (subpixel reconstruction, M. Chajdas, M. McGuire, D. Luebke, *Subpixel Reconstruction Antialiasing for
//! Deferred Shading*, I3D 2011). The light is computed once, so the cost is that of the G-buffers.
//!
//! Edges between surfaces, and in their textures, become smooth. Edges of shadows, in mirrors, behind glass and in the picture of the environment
//! stay as they are, because the G-buffer does not have them, and a wire that no middle of a pixel meets stays away. Inside a surface
//! without texture and normal map the picture is the same as before.
//! `passes/edges.comp` states how this differs from the paper.

use super::gbuffer::{self, GBuffer};
use crate::{
    Error, Result,
    graph::{Format, Graph, Image},
    resident::Handles,
    scene::View,
    shaders::passes::edges as shader,
};
use glam::Vec2;

/// Places of each pixel. The first one is the middle, which has the light.
pub const PLACES: usize = 8;

/// Smooths the edges of `light`, linear radiance as `view` sees it. Returns an image of the same extent, RGBA32F. `g`: the G-buffer of `view`.
/// `places`: where the further G-buffers look, from the middles of the pixels to the right and down, pixels. The first place must be the middle.
///
/// # Errors
/// `Usage` if the radiance does not have the extent of the G-buffer.
pub fn smooth(
    graph: &mut Graph,
    handles: &Handles,
    (g, view): (&GBuffer, &View),
    light: Image,
    places: &[Vec2; PLACES],
) -> Result<Image> {
    let extent = graph.extent(g.depth);
    let given = graph.extent(light);
    if given != extent || extent != view.extent.into() {
        let what = format!("the picture has {given:?}, its G-buffer {extent:?}, and the view {:?}", view.extent);
        return Err(Error::usage(what).at("edges"));
    }
    Ok(graph.scope("edges", |graph| {
        let middle = view.shift();
        let mut sum = light;
        for (number, place) in places.iter().enumerate().skip(1) {
            let there = gbuffer::draw(graph, handles, &view.shifted(middle + *place), &g.settings);
            let after = graph.image("edges.sum", Format::RGBA32F, extent);
            let args = shader::Args {
                view: g.view,
                place_view: there.view,
                normal: g.normal,
                depth: g.depth,
                albedo: g.albedo,
                specular: g.specular,
                emission: g.emission,
                place_normal: there.normal,
                place_depth: there.depth,
                place_albedo: there.albedo,
                place_specular: there.specular,
                place_emission: there.emission,
                light,
                before: sum,
                after,
                push: shader::Push {
                    place: place.to_array(),
                    share: 1.0 / PLACES as f32,
                    first: u32::from(number == 1),
                },
            };
            graph.compute(args, extent);
            sum = after;
        }
        sum
    }))
}
