//! Fullsphere irradiance vectors behind the interface of all techniques.

use std::path::{Path, PathBuf};

use super::{Fiv, Method, PictureSettings, Settings, Stored};
use crate::{
    Error, ErrorKind, Result,
    bake::Digest,
    graph::Graph,
    scene::Note,
    settings::{Described, Description, Difference},
    technique::{self, AllLight, Making, Moment, Picture, Technique},
};

/// Precomputed vectors, and the file from which they were read.
#[derive(Clone, Debug)]
pub struct Baked {
    pub stored: Stored,
    /// Errors and notes about the vectors name this file.
    pub file: Option<PathBuf>,
}

impl technique::Bake for Baked {
    const NEEDED: bool = false;

    fn read(file: &Path) -> Result<Self> {
        Ok(Self { stored: Stored::read(file)?, file: Some(file.to_owned()) })
    }

    /// The settings in the metadata of a picture are enough to compute the vectors again.
    fn source(&self) -> Option<(&Path, Digest)> {
        None
    }
}

impl Baked {
    /// Checks that settings agree with the settings that the vectors were computed with.
    ///
    /// # Errors
    /// `Usage`, naming the file, the key and both values.
    pub fn check(&self, settings: &Settings) -> Result<()> {
        let named = |error: Error| match &self.file {
            Some(file) => error.in_file(file),
            None => error,
        };
        if settings.method != Method::Vectors {
            let error = Error::usage("precomputed vectors are for fiv.method=vectors").at("fiv.method");
            return Err(named(error).help("Leave out the vectors or fiv.method"));
        }
        let has = self.stored.plan.settings(settings);
        let wrong = Settings::description().differences(settings, &has)?.into_iter().next();
        wrong.map_or(Ok(()), |Difference { key, first: asked, second: has }| {
            let error = Error::usage(format!("the settings ask for {asked}, the vectors were computed with {has}"));
            let error = named(error.at(format!("fiv.{}", key.name)));
            Err(error.help("Leave the key out, or compute the vectors again"))
        })
    }

    /// Adds the file to errors about the vectors.
    fn blamed(&self, error: Error) -> Error {
        match &self.file {
            Some(file) if error.kind() == ErrorKind::Input => error.in_file(file),
            _ => error,
        }
    }
}

impl technique::Settings for PictureSettings {
    fn paper() -> Option<Self> {
        None
    }

    fn validate(&self) -> Result<()> {
        self.validate()
    }
}

impl Technique for Fiv {
    const NAME: &'static str = "fiv";
    const LAMPS: bool = false;
    const ABOUT: &'static str = "shadows from fullsphere irradiance vectors, and by brute force; layer irradiance";
    const UNITS: &'static str = "samples";

    type Settings = PictureSettings;
    type Mode = AllLight;
    type Baked = Baked;

    fn description() -> &'static Description {
        Settings::description()
    }

    fn prepared_by(settings: &PictureSettings) -> PictureSettings {
        let Settings { trilinear, partial, overlap, self_shadow, .. } = Settings::default();
        let fiv = Settings { trilinear, partial, overlap, self_shadow, ..settings.fiv.clone() };
        PictureSettings { fiv, ..PictureSettings::default() }
    }

    fn is_cheap(PictureSettings { fiv, .. }: &PictureSettings) -> bool {
        matches!(fiv.method, Method::Vectors | Method::Unshadowed)
    }

    fn rays(PictureSettings { fiv, .. }: &PictureSettings) -> u64 {
        let numbers = [fiv.azimuths, fiv.polars, fiv.radii, fiv.turns, 6, fiv.size, fiv.size, fiv.split, fiv.split];
        numbers.iter().fold(1u64, |rays, &n| rays.saturating_mul(n.into()))
    }

    fn ready(making: Making<'_, Baked>, settings: &PictureSettings) -> Result<Self> {
        let Making { gpu, scene, resident, baked, told } = making;
        let Some(baked) = baked else { return Self::new(gpu, scene, resident, &settings.fiv, None, told) };
        baked.check(&settings.fiv)?;
        let mut fiv = Self::new(gpu, scene, resident, &settings.fiv, Some(&baked.stored), told)
            .map_err(|error| baked.blamed(error))?;
        if let Some(file) = &baked.file {
            let about_vectors = fiv.notes.iter_mut().filter(|note| note.place == "vectors");
            about_vectors.for_each(|note| note.place = format!("vectors {}", file.display()));
        }
        Ok(fiv)
    }

    fn frame(
        &mut self,
        graph: &mut Graph,
        moment: &Moment<'_, AllLight>,
        settings: &PictureSettings,
    ) -> Result<Picture> {
        let settings = PictureSettings { fiv: settings.fiv.after(moment.shot.seconds), ..settings.clone() };
        let made = self.picture(graph, moment.scene, moment.pose, moment.handles, &moment.view, &settings)?;
        let shown = Picture::new(made.outputs.total).color("irradiance", made.outputs.irradiance);
        let notes: Vec<Note> = [moment.notes, self.notes(), &made.notes].concat();
        let shown = match made.receivers {
            Some(receivers) => shown.drawn_with(receivers),
            None => shown,
        };
        Ok(shown.showing(made.gbuffer).noting(notes))
    }
}
