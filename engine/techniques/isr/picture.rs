//! Everything from a scene on the device to the final picture.

use super::super::allowed::radiance;
use super::{Inputs, Outputs, Settings, Surroundings, frame, mask::Masks, senders};
use crate::{
    Result,
    graph::Graph,
    passes::{
        direct::Lights,
        gbuffer::{self, GBuffer, Normals},
        shadow::{self, ShadowMaps},
        skybox,
    },
    resident::Handles,
    scene::View,
};
use serde::{Deserialize, Serialize};

/// Settings of all stages.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PictureSettings {
    pub isr: Settings,
    pub gbuffer: gbuffer::Settings,
    pub shadow: shadow::Settings,
    /// Radiance behind everything in scenes without an environment, linear RGB.
    pub background: [f32; 3],
}

impl PictureSettings {
    /// The dissertation's: normals of eight bits, exponential shadow maps with c = 90.
    pub fn paper() -> Self {
        Self {
            isr: Settings::paper(),
            gbuffer: gbuffer::Settings { normals: Normals::Bytes, ..Default::default() },
            shadow: shadow::Settings::dissertation(),
            background: [0.0; 3],
        }
    }

    /// # Errors
    /// `Usage`, naming the key with its group, the value found and the values allowed.
    pub fn validate(&self) -> Result<()> {
        self.isr.validate().map_err(|error| error.at("isr"))?;
        self.shadow.validate()?;
        radiance("background", self.background)
    }
}

/// A picture and the stages before it.
#[derive(Clone, Debug)]
pub struct Picture {
    pub gbuffer: GBuffer,
    pub shadows: ShadowMaps,
    pub outputs: Outputs,
}

/// Declares G-buffer, shadow maps, [`frame`] and sky. `surroundings`: a scene or the irradiance of its environment, without rays; or with rays by
/// [`super::Area::frame`].
///
/// # Errors
/// `Usage` if a setting is out of its range, and if [`Settings::mask`] names a material that the scene has not.
pub fn picture(
    graph: &mut Graph,
    scene: &Handles,
    view: &View,
    surroundings: impl Into<Surroundings>,
    settings: &PictureSettings,
) -> Result<Picture> {
    settings.validate()?;
    let masked = Masks::by_names(&scene.material_names, &settings.isr.mask)?.applied(graph, scene);
    let scene = &*masked;
    let surroundings = surroundings.into();
    let gbuffer = gbuffer::draw(graph, scene, view, &settings.gbuffer);
    let shadows = shadow::draw(graph, scene, view, &settings.shadow);
    let lights = Lights::from(&shadows);
    let senders = graph.scope("isr.senders", |graph| {
        senders::draw(graph, scene, view, (lights, &surroundings), &settings.gbuffer, &settings.shadow, &settings.isr)
    });
    let inputs = Inputs { gbuffer, lights, surroundings, senders };
    let outputs = graph.scope("isr", |graph| frame(graph, &inputs, &settings.isr))?;
    skybox::draw(graph, scene, &gbuffer, settings.background.into(), outputs.total);
    Ok(Picture { gbuffer, shadows, outputs })
}
