//! All stages of a picture: G-buffer, virtual lights, direct and indirect light, sum and sky.

use super::super::allowed::radiance;
use super::{Igi, Outputs, Settings, Shared, Visibility, Vpls, filters, light_tree, raster};
use crate::{
    Error, Result,
    graph::{Format, Graph, Image},
    passes::{
        gbuffer::{self, GBuffer},
        skybox,
    },
    resident::Handles,
    scene::{Pose, Scene, View},
    shaders,
};
use serde::{Deserialize, Serialize};

/// Settings of all stages.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PictureSettings {
    pub igi: Settings,
    pub gbuffer: gbuffer::Settings,
    /// Background radiance, W/(sr·m²), linear RGB, not below 0. The camera and mirrors see it, added to the environment's radiance;
    /// it lights no surface.
    pub background: [f32; 3],
}

impl PictureSettings {
    /// The paper's settings ([`Settings::paper`]).
    pub fn paper() -> Self {
        Self { igi: Settings::paper(), ..Self::default() }
    }

    /// # Errors
    /// `Usage`, naming the key with its group, the value found and the values allowed.
    pub fn validate(&self) -> Result<()> {
        self.igi.validate().map_err(|error| error.at("igi"))?;
        radiance("background", self.background)
    }
}

/// A picture and the stages before it.
#[derive(Clone, Copy, Debug)]
pub struct Picture {
    pub gbuffer: GBuffer,
    pub outputs: Outputs,
}

impl Igi {
    /// The candidates that the light paths leave, and the virtual lights drawn among them.
    fn virtual_lights(
        &self,
        graph: &mut Graph,
        handles: &Handles,
        gbuffer: &GBuffer,
        shared: &Shared,
        settings: &Settings,
    ) -> (Vpls, Vpls) {
        let all = self.shoot(graph, handles, shared, settings);
        let chosen = if settings.candidates > 1 { self.choose(graph, gbuffer, shared, all, settings) } else { all };
        (all, chosen)
    }

    /// Declares the passes of a frame: G-buffer, light paths, direct and indirect light, sum and sky. `handles` must belong to
    /// `graph` and `pose`. `graph.seed` is the seed of the light paths; with seed 0 they use the paper's Halton points without a
    /// rotation. [`Settings::history`] needs `graph.frame` to grow by one from frame to frame, and one `Runner` for all frames;
    /// `Runner::forget_history` starts a new sequence.
    ///
    /// # Errors
    /// `Usage` if a setting is out of its range, if the settings need acceleration structures that [`Igi::new`] did not build, or
    /// if the frame would need too many passes or draws.
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
        settings.validate()?;
        if igi.visibility.in_compute(self.queries)? != self.in_compute {
            let how = if self.in_compute { "in compute" } else { "by ray queries" };
            let what = format!("Igi::new prepared the scene for rays that are traced {how}");
            return Err(Error::usage(what).at("igi.visibility").help("Give Igi::new the same settings"));
        }
        if igi.imperfect && !self.in_compute && self.boxes.is_none() {
            let what = "there are no boxes: Igi::new prepared the scene for exact ray queries";
            return Err(Error::usage(what).at("igi.imperfect").help("Give Igi::new the same settings"));
        }
        if igi.indirect && igi.visibility == Visibility::Raster {
            raster::affordable(handles, igi).map_err(|error| error.at("igi"))?;
        }
        let gbuffer = gbuffer::draw(graph, handles, view, &settings.gbuffer);
        let outputs = graph.scope("igi", |graph| -> Result<Outputs> {
            let shared = self.shared(graph, scene, pose, handles, igi);
            self.few_passes(graph.extent(gbuffer.depth), igi)?;
            // With a history each frame uses other random numbers.
            let frame = if igi.history > 0 { graph.frame } else { 0 };
            let own = Self::numbered(graph, &shared, igi, frame);
            let shot = igi.indirect.then(|| self.virtual_lights(graph, handles, &gbuffer, &own, igi));
            let vpls = shot.map(|(_, chosen)| light_tree::with_light_tree(graph, chosen, igi));
            let direct = self.direct(graph, handles, &gbuffer, &shared);
            let seen = if igi.indirect { receivers(graph, &gbuffer, igi) } else { gbuffer };
            let gathered = match vpls {
                Some(vpls) if igi.visibility == Visibility::Raster => {
                    self.gather_raster(graph, handles, &seen, &own, vpls, igi)
                }
                _ => self.gather(graph, &seen, &own, vpls, igi),
            };
            if let Some(vpls) = vpls.filter(|_| igi.compensates()) {
                self.compensate(graph, handles, &seen, &own, vpls, igi, gathered);
            }
            let mut irradiance = self.filtered(graph, handles, &seen, &own, (vpls, gathered), igi);
            if let Some((all, chosen)) = shot.filter(|_| igi.history > 1) {
                let light = (all, chosen, irradiance);
                irradiance = self.accumulate(graph, handles, (&seen, view), &shared, light, igi);
            }
            let trees = (self.sharp && igi.specular).then(|| {
                // Light in mirrors has no history. It uses the same random numbers in every frame, because other numbers would make it
                // flicker.
                let steady = match shot {
                    Some(_) if frame > 0 => {
                        let (_, chosen) = self.virtual_lights(graph, handles, &gbuffer, &shared, igi);
                        Some(light_tree::with_light_tree(graph, chosen, igi))
                    }
                    _ => vpls,
                };
                self.trees(graph, handles, &gbuffer, &shared, (steady, settings.background), igi)
            });
            let (sharp, cache) = (trees.map(|t| t.sharp), trees.and_then(|t| t.cache));
            let (total, indirect) = composed(graph, &gbuffer, direct, irradiance, sharp);
            Ok(Outputs { total, direct, indirect, sharp, irradiance, gathered, vpls, cache })
        })?;
        skybox::draw(graph, handles, &gbuffer, settings.background.into(), outputs.total);
        Ok(Picture { gbuffer, outputs })
    }

    /// Irradiance of every pixel, computed by the filters from the coarse or interleaved irradiance `gathered`.
    fn filtered(
        &self,
        graph: &mut Graph,
        handles: &Handles,
        g: &GBuffer,
        shared: &Shared,
        (vpls, gathered): (Option<Vpls>, Image),
        settings: &Settings,
    ) -> Image {
        let mut irradiance = gathered;
        if !(settings.joins() || settings.upsamples() || settings.smooths()) {
            return irradiance;
        }
        let guide = filters::guide(graph, g, settings);
        if settings.joins() {
            irradiance = filters::join(graph, guide, irradiance, settings);
        }
        if settings.smooths() {
            irradiance = filters::smooth(graph, g, guide, irradiance, settings);
        }
        if settings.upsamples() {
            let (upsampled, unmatched) = filters::upsample(graph, g, guide, irradiance, settings);
            irradiance = upsampled;
            if let Some(vpls) = vpls.filter(|_| settings.refine > 0.0) {
                self.refine(graph, g, shared, vpls, settings, (irradiance, unmatched));
                if settings.compensates() {
                    self.compensate_listed(graph, handles, g, shared, (vpls, settings), (irradiance, unmatched));
                }
            }
        }
        irradiance
    }
}

/// The G-buffer without the surfaces that reflect no diffuse light (unlit and black surfaces, mirrors): its depth marks them as
/// background. If a filter runs, they stay, because their neighbours read the irradiance of their texels.
fn receivers(graph: &mut Graph, g: &GBuffer, settings: &Settings) -> GBuffer {
    let extent = graph.extent(g.depth);
    let received = graph.image("igi.received", Format::R32F, extent);
    let shared = settings.joins() || settings.upsamples() || settings.smooths() || settings.history > 1;
    let push = shaders::igi::receivers::Push { all: shared.into() };
    graph.compute(shaders::igi::receivers::Args { albedo: g.albedo, depth: g.depth, received, push }, extent);
    GBuffer { depth: received, ..*g }
}

/// The sum of all light, and the indirect light in it. Multiplies `direct` by the share of the surface that is not mirror or glass.
fn composed(graph: &mut Graph, g: &GBuffer, direct: Image, irradiance: Image, sharp: Option<Image>) -> (Image, Image) {
    let extent = graph.extent(g.depth);
    let total = graph.image("igi.total", Format::RGBA32F, extent);
    let indirect = graph.image("igi.indirect", Format::RGBA32F, extent);
    let args = shaders::igi::compose::Args {
        albedo: g.albedo,
        depth: g.depth,
        direct,
        irradiance,
        // A binding needs an image; without mirrors the shader does not read it.
        sharp: sharp.unwrap_or(irradiance),
        total,
        indirect,
        spec: shaders::igi::compose::Spec { sharp: sharp.is_some().into() },
    };
    graph.compute(args, extent);
    (total, indirect)
}
