//! Everything from a scene on the device to the final picture.

use super::super::allowed::radiance;
use super::{Igi, Outputs, Settings, Shared, Visibility, Vpls, filters, light_tree, raster};
use crate::{
    Error, Result,
    graph::{Format, Graph, Image},
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
    /// Radiance behind everything, added to that of an environment, linear RGB, not below 0. Seen directly and in mirrors; it lights
    /// nothing.
    pub background: [f32; 3],
}

impl PictureSettings {
    /// The paper's: [`Settings::paper`].
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
    /// What paths leave, and what of it becomes virtual lights.
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

    /// Declares a frame: G-buffer, paths of light, direct and indirect light, sum and sky. `handles` are of this graph, for `pose`.
    /// `graph.seed` is the seed of the paths; with 0 they are the paper's Halton points as they are. For [`Settings::history`] count
    /// `graph.frame` up by one from frame to frame and run all frames with one `Runner`; `Runner::forget_history` starts anew.
    ///
    /// # Errors
    /// `Usage` if a setting is out of its range, or asks for rays or boxes that [`Igi::new`] was not told of.
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
            let what = format!("the scene was prepared for rays that are traced {how}");
            return Err(Error::usage(what).at("igi.visibility").help("Give Igi::new the same settings"));
        }
        if igi.imperfect && !self.in_compute && self.boxes.is_none() {
            let what = "there are no boxes: the scene was prepared for exact ray queries";
            return Err(Error::usage(what).at("igi.imperfect").help("Give Igi::new the same settings"));
        }
        if igi.indirect && igi.visibility == Visibility::Raster {
            raster::affordable(handles, igi).map_err(|error| error.at("igi"))?;
        }
        let gbuffer = gbuffer::draw(graph, handles, view, &settings.gbuffer);
        let outputs = graph.scope("igi", |graph| -> Result<Outputs> {
            let shared = self.shared(graph, scene, pose, handles, igi);
            self.few_enough(graph.extent(gbuffer.depth), handles, &shared, igi)?;
            // With a history every frame takes numbers of its own.
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
                // What mirrors show has no history: it takes the same numbers in each frame, lest it flickers.
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
    /// Irradiance of every pixel from what was gathered for some of them, or from some of the virtual lights.
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

/// The G-buffer as indirect light is gathered for it: surfaces that can show none (unlit and black ones, mirrors) are background, but where
/// others take light from their texels.
fn receivers(graph: &mut Graph, g: &GBuffer, settings: &Settings) -> GBuffer {
    let extent = graph.extent(g.depth);
    let received = graph.image("igi.received", Format::R32F, extent);
    let shared = settings.joins() || settings.upsamples() || settings.smooths() || settings.history > 1;
    let push = shaders::igi::receivers::Push { all: shared.into() };
    graph.compute(shaders::igi::receivers::Args { albedo: g.albedo, depth: g.depth, received, push }, extent);
    GBuffer { depth: received, ..*g }
}

/// The sum of all light, and what of it is indirect. `direct` becomes what of it enters the sum.
fn composed(graph: &mut Graph, g: &GBuffer, direct: Image, irradiance: Image, sharp: Option<Image>) -> (Image, Image) {
    let extent = graph.extent(g.depth);
    let total = graph.image("igi.total", Format::RGBA32F, extent);
    let indirect = graph.image("igi.indirect", Format::RGBA32F, extent);
    let args = shaders::igi::compose::Args {
        albedo: g.albedo,
        depth: g.depth,
        direct,
        irradiance,
        // Not read where there is none.
        sharp: sharp.unwrap_or(irradiance),
        total,
        indirect,
        spec: shaders::igi::compose::Spec { sharp: sharp.is_some().into() },
    };
    graph.compute(args, extent);
    (total, indirect)
}
