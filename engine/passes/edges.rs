//! Smooth edges of one picture: further places inside each pixel have a G-buffer of their own and no light. Each place takes the light of the
//! pixels around that show its surface (subpixel reconstruction, M. Chajdas, M. McGuire, D. Luebke, *Subpixel Reconstruction Antialiasing for
//! Deferred Shading*, I3D 2011). The light is computed once, so the cost is that of the G-buffers. The weights of the pixels around depend on
//! surfaces alone, so all images of light have the same ones, and parts of the light add up to the picture.
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
    shaders::passes::{edges as shader, edges_gather as gather},
};
use glam::Vec2;

/// Places of each pixel. The first one is the middle, which has the light.
pub const PLACES: usize = 8;

/// The shares of the eight neighbours of each pixel in its light, 0 to 1; the pixel itself has the rest. Two images in RGBA32F, in the order
/// of `passes/edges.glsl`.
#[derive(Clone, Copy, Debug)]
pub struct Weights {
    before: Image,
    after: Image,
}

/// Finds the weights of smooth edges. `g`: the G-buffer of `view`. `places`: where the further G-buffers look, from the middles of the pixels
/// to the right and down, pixels. The first place must be the middle.
///
/// # Errors
/// `Usage` if the G-buffer does not have the extent of the view.
pub fn weights(
    graph: &mut Graph,
    handles: &Handles,
    (g, view): (&GBuffer, &View),
    places: &[Vec2; PLACES],
) -> Result<Weights> {
    let extent = graph.extent(g.depth);
    if extent != view.extent.into() {
        let what = format!("the G-buffer has {extent:?}, its view {:?}", view.extent);
        return Err(Error::usage(what).at("edges"));
    }
    Ok(graph.scope("edges", |graph| {
        let [before, after] = ["edges.before", "edges.after"].map(|name| graph.image(name, Format::RGBA32F, extent));
        for image in [before, after] {
            graph.clear(image, [0.0; 4]);
        }
        let middle = view.shift();
        for place in &places[1..] {
            let there = gbuffer::draw(graph, handles, &view.shifted(middle + *place), &g.settings);
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
                weights_before: before,
                weights_after: after,
                push: shader::Push { place: place.to_array(), share: 1.0 / PLACES as f32 },
            };
            graph.compute(args, extent);
        }
        Weights { before, after }
    }))
}

impl Weights {
    /// Smooths the edges of `light`, which is linear in radiance. Returns an image of the same extent, RGBA32F.
    ///
    /// # Errors
    /// `Usage` if the light does not have the extent of the G-buffer.
    pub fn smooth(&self, graph: &mut Graph, light: Image) -> Result<Image> {
        let extent = graph.extent(self.before);
        let given = graph.extent(light);
        if given != extent {
            let what = format!("the picture has {given:?}, its G-buffer {extent:?}");
            return Err(Error::usage(what).at("edges"));
        }
        Ok(graph.scope("edges", |graph| {
            let smoothed = graph.image("edges.smoothed", Format::RGBA32F, extent);
            let args = gather::Args { weights_before: self.before, weights_after: self.after, light, smoothed };
            graph.compute(args, extent);
            smoothed
        }))
    }
}
