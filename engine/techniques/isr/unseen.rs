//! Light of surfaces that the picture does not show: they are as bright as a share of those that it shows to the receiver (`isr/unseen.comp`).
//!
//! The light that a receiver gathers is divided by the share of the hemisphere from which it comes, and multiplied by the share in which rays meet
//! surfaces. Further scatterings follow as in a closed room of even light, where n of them have 1 − kⁿ of all light.

use super::area::AreaLight;
use crate::{
    graph::{Format, Graph, Image, ImageDesc},
    passes::downsample::Coarse,
    shaders::isr::{unseen, unseen_terms},
};

/// What is known about surfaces outside of the picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Unseen {
    lamps: Image,
    light: Image,
    kept: Image,
    /// Coarse; alpha is the radiation mask.
    albedo: Image,
    /// Materials have masks ([`super::Settings::mask`]).
    masked: bool,
}

impl Unseen {
    /// `sender`: the radiance that surfaces send without each other's light, and their mask. `masked`: materials have masks.
    pub fn new(graph: &mut Graph, sender: Image, coarse: &Coarse, light: AreaLight, masked: bool) -> Self {
        let extent = graph.extent(sender);
        let desc = ImageDesc::new(Format::RGBA16F, extent).all_mips();
        let [sum, kept] = ["isr.unseen.light", "isr.unseen.kept"].map(|name| graph.image_with(name, desc));
        let args = unseen_terms::Args {
            sender,
            albedo: coarse.albedo,
            lamps: light.lamps,
            light: sum.mip(0),
            kept: kept.mip(0),
            push: unseen_terms::Push { masked: masked.into() },
        };
        graph.compute(args, extent);
        for image in [sum, kept] {
            graph.mips(image);
        }
        Self { lamps: light.lamps, light: sum, kept, albedo: coarse.albedo, masked }
    }

    /// Gathered light (rgb for a white receiver) with that of all surfaces around. `seen`: r is the sum of the form factors of the senders. `share`: brightness of
    /// the surfaces that the picture does not show. `scatterings`: number of those that the light has; all further ones are added. 0: none is added.
    pub fn filled(&self, graph: &mut Graph, gathered: Image, seen: Image, share: f32, scatterings: u32) -> Image {
        let extent = graph.extent(gathered);
        let filled = graph.image("isr.unseen.filled", Format::RGBA16F, extent);
        let Self { lamps, light, kept, albedo, masked } = *self;
        let push = unseen::Push { scatterings, share, masked: masked.into() };
        graph.compute(unseen::Args { gathered, seen, lamps, light, kept, filled, albedo, push }, extent);
        filled
    }
}
