//! Image-space radiosity behind the interface of all techniques.

use std::convert::Infallible;

use super::{Area, PictureSettings, Surroundings, mask::Masks, picture};
use crate::{
    Result,
    graph::Graph,
    passes::{
        ambient::Irradiance,
        direct::{self, Lights},
        gbuffer, shadow, skybox,
    },
    settings::{Described, Description, idle_notes},
    technique::{Making, Mode as Modes, Moment, Picture, Settings, Technique},
};

/// What the picture shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mode {
    #[default]
    Isr,
    Direct,
    Indirect,
    Occlusion,
}

impl Modes for Mode {
    const ALL: &'static [Self] = &[Self::Isr, Self::Direct, Self::Indirect, Self::Occlusion];

    fn name(self) -> &'static str {
        match self {
            Self::Isr => "isr",
            Self::Direct => "direct",
            Self::Indirect => "indirect",
            Self::Occlusion => "occlusion",
        }
    }

    fn doc(self) -> &'static str {
        match self {
            Self::Isr => "Direct and indirect light",
            Self::Direct => "Direct light only; no light is gathered",
            Self::Indirect => "Indirect light only",
            Self::Occlusion => "Ambient occlusion only: 1 open, 0 occluded",
        }
    }

    fn is_radiance(self) -> bool {
        self != Self::Occlusion
    }
}

impl Settings for PictureSettings {
    fn paper() -> Option<Self> {
        Some(Self::paper())
    }

    fn validate(&self) -> Result<()> {
        self.validate()
    }
}

/// Image-space radiosity, prepared for a scene.
#[derive(Debug)]
pub struct Isr {
    ambient: Irradiance,
    area: Option<Area>,
}

impl Technique for Isr {
    const NAME: &'static str = "isr";
    const ABOUT: &'static str = "image-space radiosity; layers direct, indirect, occlusion, albedo, normal, depth";

    type Settings = PictureSettings;
    type Mode = Mode;
    type Baked = Infallible;

    fn description() -> &'static Description {
        super::Settings::description()
    }

    fn prepared_by(settings: &PictureSettings) -> PictureSettings {
        // Only whether there are rays counts, because rays need acceleration structures.
        let unseen = f32::from(u8::from(settings.isr.fills()));
        let isr = super::Settings { area_lights: settings.isr.area_lights, unseen, ..Default::default() };
        PictureSettings { isr, ..PictureSettings::default() }
    }

    fn ready(making: Making<'_, Infallible>, settings: &PictureSettings) -> Result<Self> {
        let Making { gpu, scene, resident, .. } = making;
        // Before long work, and for pictures without indirect light too.
        let names: Vec<String> = scene.materials.iter().map(|material| material.name.clone()).collect();
        Masks::by_names(&names, &settings.isr.mask)?;
        let area = Area::new(gpu, scene, resident, &settings.isr)?;
        Ok(Self { ambient: scene.into(), area })
    }

    fn frame(&mut self, graph: &mut Graph, moment: &Moment<'_, Mode>, settings: &PictureSettings) -> Result<Picture> {
        let Moment { handles, view, .. } = moment;
        let (shown, gbuffer, shadows) = if moment.shot.mode == Mode::Direct {
            let gbuffer = gbuffer::draw(graph, handles, view, &settings.gbuffer);
            let shadows = shadow::draw(graph, handles, view, &settings.shadow);
            let lit = direct::light(graph, &gbuffer, Lights::from(&shadows), &settings.isr.direct());
            skybox::draw(graph, handles, &gbuffer, settings.background.into(), lit.direct);
            (Picture::new(lit.direct), gbuffer, shadows)
        } else {
            let area = self.area.as_mut().map(|area| area.frame(graph, moment.scene, moment.pose, handles));
            let surroundings = Surroundings { ambient: self.ambient.clone(), area };
            let made = picture(graph, handles, view, surroundings, settings)?;
            let out = made.outputs;
            let shown = match moment.shot.mode {
                Mode::Indirect => Picture::new(out.indirect),
                Mode::Occlusion => Picture::grey(out.occlusion),
                Mode::Isr | Mode::Direct => Picture::new(out.total),
            };
            let shown = shown.color("direct", out.direct).color("indirect", out.indirect);
            (shown.values("occlusion", &["Y"], out.occlusion), made.gbuffer, made.shadows)
        };
        let of_settings = match moment.shot.mode {
            Mode::Direct => Vec::new(),
            _ => idle_notes("isr", &settings.isr),
        };
        let of_shadows = idle_notes("shadow", &settings.shadow);
        Ok(shown.showing(gbuffer).noting([moment.notes, &shadows.notes, &of_settings, &of_shadows].concat()))
    }
}
