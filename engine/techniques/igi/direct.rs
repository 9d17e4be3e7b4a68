//! Direct light of the visible surfaces.

use super::{Igi, Shared, filters};
use crate::{
    graph::{Extent, Format, Graph, Image},
    passes::gbuffer::GBuffer,
    resident::Handles,
    shaders::{self, igi::soft_add},
};

impl Igi {
    /// Direct and emitted radiance of the visible surfaces, W/(sr·m²). Light of emissive surfaces and of the sky passes through the filter
    /// ([`super::Settings::direct_filter`]).
    pub(super) fn direct(&self, graph: &mut Graph, handles: &Handles, g: &GBuffer, shared: &Shared) -> Image {
        let extent = graph.extent(g.depth);
        let direct = graph.image("igi.direct", Format::RGBA32F, extent);
        graph.clear(direct, [0.0; 4]);
        let apart = shared.direct_filter > 0;
        // A binding needs an image; without the filter the shader does not touch it.
        let soft = graph.image("igi.soft", Format::RGBA32F, if apart { extent } else { Extent::new(1, 1) });
        graph.clear(soft, [0.0; 4]);
        let args = traced_lit!(
            shaders::igi::direct::Args {
                view: g.view,
                albedo: g.albedo,
                normal: g.normal,
                depth: g.depth,
                specular: g.specular,
                emission: g.emission,
                direct,
                soft,
                spec: shaders::igi::direct::Spec { apart: apart.into() },
                push: shaders::igi::direct::Push::default(),
            },
            shared.rays,
            handles,
            shared,
            lamps
        );
        graph.compute_over(args, extent, self.items(shared.direct_rays, extent.pixels()));
        if apart {
            let light = filters::soft_light(graph, g, soft, shared.direct_filter, false);
            graph.compute(soft_add::Args { albedo: g.albedo, specular: g.specular, light, direct }, extent);
        }
        direct
    }
}
