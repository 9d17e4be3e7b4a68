//! Everything from a scene on the device to the final picture.

use super::{Igi, Outputs, Settings, filters};
use crate::{
    Error, Result,
    graph::{Format, Graph},
    passes::{
        gbuffer::{self, GBuffer},
        skybox,
    },
    scene::{Pose, Scene, View, resident::Handles},
    shaders,
};
use serde::{Deserialize, Serialize};

/// Settings of all stages.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PictureSettings {
    pub igi: Settings,
    pub gbuffer: gbuffer::Settings,
    /// Radiance behind everything in scenes without an environment, linear RGB.
    pub background: [f32; 3],
}

impl PictureSettings {
    /// The paper's: [`Settings::paper`].
    pub fn paper() -> Self {
        Self { igi: Settings::paper(), ..Self::default() }
    }
}

/// A picture and the stages before it.
#[derive(Clone, Copy, Debug)]
pub struct Picture {
    pub gbuffer: GBuffer,
    pub outputs: Outputs,
}

impl Igi {
    /// Declares a frame: G-buffer, paths of light, direct and indirect light, sum and sky. `handles` are of this graph, for `pose`.
    /// `graph.seed` is the seed of the paths; with 0 they are the paper's Halton points as they are.
    ///
    /// # Errors
    /// `Usage` if a setting is out of its range, or asks for boxes that [`Igi::new`] was not told of.
    pub fn picture(
        &mut self,
        graph: &mut Graph,
        scene: &Scene,
        pose: &Pose,
        handles: &Handles,
        view: &View,
        settings: &PictureSettings,
    ) -> Result<Picture> {
        let igi = &settings.igi;
        igi.validate().map_err(|error| error.at("igi"))?;
        if igi.imperfect && !self.in_compute && self.boxes.is_none() {
            let what = "there are no boxes: the scene was prepared for exact ray queries";
            return Err(Error::usage(what).at("igi.imperfect").help("Give Igi::new the same settings"));
        }
        let gbuffer = gbuffer::draw(graph, handles, view, &settings.gbuffer);
        let outputs = graph.scope("igi", |graph| {
            let shared = self.shared(graph, scene, pose, handles, igi);
            let vpls = igi.indirect.then(|| self.shoot(graph, handles, &shared, igi));
            let vpls = match vpls {
                Some(all) if igi.candidates > 1 => Some(self.choose(graph, &gbuffer, &shared, all, igi)),
                _ => vpls,
            };
            let direct = self.direct(graph, handles, &gbuffer, &shared);
            let gathered = self.gather(graph, &gbuffer, &shared, vpls, igi);
            let (joins, upsamples) =
                (igi.interleave > 1 && !igi.fused, igi.downsample > 1 || (igi.fused && igi.interleave > 1));
            let mut irradiance = gathered;
            if joins || upsamples {
                let guide = filters::guide(graph, &gbuffer, igi.downsample);
                if joins {
                    irradiance = filters::join(graph, guide, irradiance, igi);
                }
                if upsamples {
                    irradiance = filters::upsample(graph, &gbuffer, guide, irradiance, igi);
                }
            }
            let sharp = (self.sharp && igi.specular)
                .then(|| self.trees(graph, handles, &gbuffer, &shared, (vpls, settings.background), igi));
            let extent = graph.extent(gbuffer.depth);
            let total = graph.image("igi.total", Format::RGBA32F, extent);
            let indirect = graph.image("igi.indirect", Format::RGBA32F, extent);
            let args = shaders::igi::compose::Args {
                albedo: gbuffer.albedo,
                depth: gbuffer.depth,
                direct,
                irradiance,
                sharp: sharp.unwrap_or(gathered),
                total,
                indirect,
                spec: shaders::igi::compose::Spec { sharp: sharp.is_some().into() },
            };
            graph.compute(args, extent);
            Outputs { total, direct, indirect, sharp, irradiance, gathered, vpls }
        });
        skybox::draw(graph, handles, &gbuffer, settings.background.into(), outputs.total);
        Ok(Picture { gbuffer, outputs })
    }
}
