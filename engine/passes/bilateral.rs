//! Separable Gaussian that stops at depth steps and creases.

use super::downsample::Coarse;
use crate::{
    graph::{Format, Graph, Image, Uniform},
    shaders::{passes::bilateral, types},
};

/// Horizontal then vertical, `radius` texels to each side, standard deviation `radius` / 2. `range`: distance from a texel's
/// plane relative to its depth at which another's weight falls to exp(−1/2). Texels cover `factor`² pixels of the view.
pub fn blur(
    graph: &mut Graph,
    image: Image,
    coarse: &Coarse,
    view: Uniform<types::View>,
    factor: u32,
    radius: u32,
    range: f32,
) -> Image {
    let extent = graph.extent(image);
    let mut result = image;
    for (name, direction) in [("bilateral.x", [1, 0]), ("bilateral.y", [0, 1])] {
        let blurred = graph.image(name, Format::RGBA16F, extent);
        let push = bilateral::Push {
            direction,
            radius: radius as i32,
            sigma: radius as f32 / 2.0,
            range,
            factor: factor as f32,
        };
        let args = bilateral::Args { view, color: result, normal: coarse.normal, depth: coarse.depth, blurred, push };
        graph.compute(args, extent).named(format!("passes.{name}"));
        result = blurred;
    }
    result
}
