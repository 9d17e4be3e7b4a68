//! The picture of one view from the light of the samples.

use glam::Vec3;

use super::{
    Mode, PictureSettings,
    on_device::{Lit, OnDevice},
    spread::Spreading,
};
use crate::{
    graph::{Buffer, Format, Graph, Image},
    passes::{
        direct::{self, Direct, Lights},
        gbuffer::{self, GBuffer},
        shadow::ShadowMaps,
        skybox,
    },
    resident::Handles,
    scene::View,
    shaders::{consts, prt::pixels},
};

/// Images of a view, or of two views side by side.
#[derive(Clone, Copy, Debug)]
pub struct Images {
    pub total: Image,
    pub direct: Image,
    pub indirect: Image,
    pub irradiance: Image,
    pub shadow: Image,
}

impl Images {
    /// The image that a mode shows.
    pub fn of(&self, mode: Mode) -> Image {
        match mode {
            Mode::Total | Mode::Samples | Mode::Clusters | Mode::Transfer => self.total,
            Mode::Direct => self.direct,
            Mode::Indirect => self.indirect,
            Mode::Irradiance => self.irradiance,
            Mode::Shadow => self.shadow,
        }
    }
}

/// Surfaces and light of a view, or of two views side by side.
#[derive(Clone, Debug)]
pub struct Shown {
    pub gbuffer: GBuffer,
    pub images: Images,
    /// The name of the items that the way to the pixels draws, and their number.
    pub counted: Option<(&'static str, u32)>,
}

/// The light and the settings that all views of a frame share.
#[derive(Clone, Debug)]
pub struct Drawing<'a> {
    pub light: &'a OnDevice,
    pub lit: &'a Lit,
    /// Directional coefficients of the samples; `None`: glossy surfaces reflect transferred light evenly.
    pub directions: Option<Buffer>,
    pub spread: Spreading<'a>,
    pub handles: &'a Handles,
    pub settings: &'a PictureSettings,
    pub mode: Mode,
    /// Shadow maps of all lights; `None`: the visibility of the samples decides.
    pub maps: Option<&'a ShadowMaps>,
}

impl Drawing<'_> {
    /// Draws a view.
    pub fn draw(&self, graph: &mut Graph, view: &View) -> Shown {
        let gbuffer = gbuffer::draw(graph, self.handles, view, &self.settings.gbuffer);
        self.shade(graph, view, gbuffer)
    }

    /// Draws the views of two eyes.
    pub fn draw_eyes(&self, graph: &mut Graph, views: [&View; 2], multiview: bool) -> [Shown; 2] {
        let [left, right] = gbuffer::draw_eyes(graph, self.handles, views, &self.settings.gbuffer, multiview);
        [(views[0], left), (views[1], right)].map(|(view, gbuffer)| self.shade(graph, view, gbuffer))
    }

    /// The light of the surfaces of a view.
    fn shade(&self, graph: &mut Graph, view: &View, gbuffer: GBuffer) -> Shown {
        let (handles, of_prt) = (self.handles, &self.settings.prt);
        let show = match self.mode {
            Mode::Samples => consts::PRT_SHOW_SAMPLES,
            Mode::Clusters => consts::PRT_SHOW_CLUSTERS,
            Mode::Transfer => consts::PRT_SHOW_TRANSFER,
            _ => consts::PRT_SHOW_LIGHT,
        };
        let mapped = self.maps.filter(|_| show == consts::PRT_SHOW_LIGHT).map(|maps| {
            let choices =
                Direct { specular: of_prt.gloss, suns: false, strength: of_prt.strength, ..Direct::default() };
            direct::light(graph, &gbuffer, Lights::from(maps), &choices).direct
        });
        let image = |graph: &mut Graph, name: &str| graph.image(name, Format::RGBA16F, view.extent);
        let [total, direct, indirect, irradiance, shadow] =
            ["prt", "prt.direct-light", "prt.indirect", "prt.irradiance", "prt.shadow"].map(|name| image(graph, name));
        // Each pass after the first one adds the light of its lamps.
        graph.clear(direct, [0.0; 4]);
        // Pictures of single samples find these by themselves.
        let single = matches!(self.mode, Mode::Samples | Mode::Clusters);
        let spread = if single { None } else { self.spread.of_view(graph, view, of_prt) };
        let passes = self.spread.passes();
        for pass in 0..passes {
            if let Some(spread) = &spread {
                spread.draw(graph, handles, (view, &gbuffer, &self.settings.gbuffer), pass);
            }
            let unused = gbuffer.emission;
            let args = pixels::Args {
                view: gbuffer.view,
                albedo: gbuffer.albedo,
                normal: gbuffer.normal,
                depth: gbuffer.depth,
                specular: gbuffer.specular,
                emission: gbuffer.emission,
                mapped: mapped.unwrap_or(unused),
                samples: graph.import_buffer(&self.light.samples),
                grid: graph.uniform(&self.light.grid.grid),
                starts: graph.import_buffer(&self.light.starts),
                order: graph.import_buffer(&self.light.order),
                irradiances: self.lit.irradiances,
                visible: self.lit.visible,
                clusters: graph.import_buffer(&self.light.clusters),
                lights: handles.lights,
                total,
                direct,
                indirect,
                irradiance,
                shadow,
                spread_light: spread.as_ref().map_or(unused, |spread| spread.sums.light),
                spread_visible: spread.as_ref().map_or(unused, |spread| spread.sums.visible),
                terms: self.directions.unwrap_or(self.lit.irradiances),
                push: pixels::Push {
                    count: self.light.count,
                    splat: of_prt.splat,
                    strength: of_prt.strength,
                    first_light: self.spread.lights(pass)[0],
                    last: u32::from(pass + 1 == passes),
                },
                spec: pixels::Spec {
                    show,
                    gloss: of_prt.gloss.into(),
                    mapped: mapped.is_some().into(),
                    spread: spread.is_some().into(),
                    directions: self.directions.is_some().into(),
                },
            };
            graph.compute(args, view.extent);
        }
        if show == consts::PRT_SHOW_LIGHT {
            skybox::draw(graph, handles, &gbuffer, Vec3::ZERO, total);
            skybox::draw(graph, handles, &gbuffer, Vec3::ZERO, direct);
        }
        let images = Images { total, direct, indirect, irradiance, shadow };
        Shown { gbuffer, images, counted: spread.map(|spread| spread.count()) }
    }
}
