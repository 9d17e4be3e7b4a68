//! Instant global illumination behind the interface of all techniques.

use std::convert::Infallible;

use super::{Igi, PictureSettings, Settings, Visibility, notes};
use crate::{
    Result,
    graph::Graph,
    settings::{Described, Description},
    technique::{self, Making, Mode as Modes, Moment, Picture, Technique},
};

/// Name of a sum of the picture: the number of shadow rays from visible surfaces to virtual lights.
pub const GATHERED: &str = "gathered rays";

/// What the picture shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mode {
    #[default]
    Igi,
    Direct,
    Indirect,
}

impl Modes for Mode {
    const ALL: &'static [Self] = &[Self::Igi, Self::Direct, Self::Indirect];

    fn name(self) -> &'static str {
        match self {
            Self::Igi => "igi",
            Self::Direct => "direct",
            Self::Indirect => "indirect",
        }
    }

    fn doc(self) -> &'static str {
        match self {
            Self::Igi => "Direct and indirect light",
            Self::Direct => "Direct light only",
            Self::Indirect => "Indirect light only",
        }
    }
}

impl technique::Settings for PictureSettings {
    fn paper() -> Option<Self> {
        Some(Self::paper())
    }

    fn validate(&self) -> Result<()> {
        self.validate()
    }
}

impl Technique for Igi {
    const NAME: &'static str = "igi";
    const ABOUT: &'static str = "instant global illumination; layers direct, indirect, specular, albedo, normal, depth";

    type Settings = PictureSettings;
    type Mode = Mode;
    type Baked = Infallible;

    fn description() -> &'static Description {
        Settings::description()
    }

    fn prepared_by(settings: &PictureSettings) -> PictureSettings {
        let Settings { visibility, imperfect, .. } = settings.igi;
        let igi = Settings { visibility, imperfect, ..Settings::default() };
        PictureSettings { igi, ..PictureSettings::default() }
    }

    fn is_cheap(_: &PictureSettings) -> bool {
        false
    }

    fn ready(making: Making<'_, Infallible>, settings: &PictureSettings) -> Result<Self> {
        Self::new(making.gpu, making.scene, making.resident, &settings.igi)
    }

    fn frame(&mut self, graph: &mut Graph, moment: &Moment<'_, Mode>, settings: &PictureSettings) -> Result<Picture> {
        // Indirect light is not computed if no output shows it.
        let direct = moment.shot.mode == Mode::Direct && !moment.shot.layers;
        let indirect = settings.igi.indirect && !direct;
        let served = PictureSettings { igi: Settings { indirect, ..settings.igi.clone() }, ..settings.clone() };
        let made = self.picture(graph, moment.scene, moment.pose, moment.handles, &moment.view, &served)?;
        let out = made.outputs;
        let mut shown = match moment.shot.mode {
            Mode::Igi => Picture::new(out.total),
            Mode::Direct => Picture::new(out.direct),
            Mode::Indirect => Picture::new(out.indirect),
        };
        shown = shown.color("direct", out.direct).color("indirect", out.indirect);
        if let Some(sharp) = out.sharp {
            // The light in mirrors and glass.
            shown = shown.color("specular", sharp);
        }
        if let Some(cache) = out.cache {
            shown = shown.remarking(cache.list.range(0..4), move |count| cache.note(count));
        }
        if indirect && settings.igi.visibility != Visibility::Raster {
            shown = shown.sum(GATHERED, out.gathered, 3);
        }
        let notes = notes(moment.scene, moment.notes, settings, moment.shot.frames);
        Ok(shown.showing(made.gbuffer).noting(notes))
    }
}
