//! Separable Gaussian.

use crate::{
    graph::{Format, Graph, Image},
    shaders::passes::blur,
};

/// Horizontal then vertical, `radius` texels to each side, standard deviation `radius` / 2. Beyond the border the border
/// repeats. The result is RGBA16F.
pub fn gaussian(graph: &mut Graph, image: Image, radius: u32) -> Image {
    let extent = graph.extent(image);
    let mut result = image;
    for (name, direction) in [("blur.x", [1, 0]), ("blur.y", [0, 1])] {
        let blurred = graph.image(name, Format::RGBA16F, extent);
        let push = blur::Push { direction, radius: radius as i32, sigma: radius as f32 / 2.0 };
        graph.compute(blur::Args { color: result, blurred, push }, extent).named(format!("passes.{name}"));
        result = blurred;
    }
    result
}
