//! Two views of a frame in one picture.

use super::{
    Mode,
    pixels::{Images, Shown},
};
use crate::{
    graph::{Draw, Extent, Graph, Image, Load, Raster, Targets},
    passes::gbuffer::GBuffer,
    shaders::prt::eye,
};

/// The left and the right view side by side. Without `layers`, only the image that `mode` shows is of both views; all others are of the left one.
pub fn side_by_side(graph: &mut Graph, [left, right]: [Shown; 2], mode: Mode, layers: bool) -> Shown {
    let mut join = |name: &str, of: &dyn Fn(&Shown) -> Image| {
        let views = [of(&left), of(&right)];
        if !layers && views[0] != left.images.of(mode) {
            return views[0];
        }
        let (one, format) = (graph.extent(views[0]), graph.desc(views[0]).format);
        let both = graph.image(name, format, Extent::new(2 * one.width, one.height));
        for (number, view) in views.into_iter().enumerate() {
            let first = number as u32 * one.width;
            let args = eye::Args { eye: view.nearest(), push: eye::Push { left: first as i32 } };
            let load = if number == 0 { Load::Clear([0.0; 4]) } else { Load::Keep };
            let targets = Targets::new().color(both, load).area(first, 0, one.width, one.height);
            graph.raster(targets, Raster::new(), args, Draw::fullscreen());
        }
        both
    };
    let images = Images {
        total: join("prt.eyes", &|view| view.images.total),
        direct: join("prt.eyes.direct", &|view| view.images.direct),
        indirect: join("prt.eyes.indirect", &|view| view.images.indirect),
        irradiance: join("prt.eyes.irradiance", &|view| view.images.irradiance),
        shadow: join("prt.eyes.shadow", &|view| view.images.shadow),
    };
    let gbuffer = GBuffer {
        albedo: join("prt.eyes.albedo", &|view| view.gbuffer.albedo),
        normal: join("prt.eyes.normal", &|view| view.gbuffer.normal),
        depth: join("prt.eyes.depth", &|view| view.gbuffer.depth),
        ..left.gbuffer
    };
    let counted = left.counted.zip(right.counted).map(|((name, left), (_, right))| (name, left + right));
    Shown { gbuffer, images, counted }
}
