//! One side of the window: what it shows, and the thread that renders it.

use std::{path::PathBuf, sync::Arc, time::Instant};

use egui::{ColorImage, Context, TextureHandle, TextureOptions};
use lucerna::{Result, gpu::GpuOptions};
use serde_json::Value;

use super::{
    live::{self, About},
    session::{Session, Wake},
    wanted::{FilePicture, Shown, Shows, TRUTH, Wanted},
};
use crate::{args::Size, smooth};

/// Paths a pixel after which the path tracer rests.
pub const SAMPLES: u64 = 1024;

/// A side of the window.
pub struct Side {
    name: &'static str,
    pub technique: &'static str,
    pub about: About,
    pub mode: String,
    pub settings: Arc<Value>,
    /// The settings with which this technique begins.
    pub defaults: Arc<Value>,
    pub bake: Option<PathBuf>,
    pub pictures: u32,
    /// A single picture has smooth edges.
    pub edges: bool,
    pub samples: u64,
    pub shows: Shows,
    /// Shown in the place of a technique.
    pub file: Option<FilePicture>,
    /// When a person last dragged one of its settings: quick pictures for a moment.
    pub last_change: Option<Instant>,
    session: Option<Session>,
    asked: Option<Wanted>,
    texture: Option<(u64, TextureHandle)>,
}

impl std::fmt::Debug for Side {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Side {} ({})", self.name, self.technique)
    }
}

impl Side {
    /// A side that shows a technique; the path tracer for an unknown name.
    pub fn new(name: &'static str, technique: &str) -> Self {
        let known = lucerna::techniques::NAMES.iter().copied().find(|known| *known == technique).unwrap_or(TRUTH);
        let about = live::about(known).unwrap_or_else(|| About {
            about: "",
            modes: Vec::new(),
            settings: Value::Null,
            paper: None,
            baked: false,
            cheap: true,
        });
        let mut side = Self {
            name,
            technique: known,
            mode: String::new(),
            settings: Arc::default(),
            defaults: Arc::default(),
            about,
            bake: None,
            pictures: 1,
            edges: true,
            samples: SAMPLES,
            shows: Shows::Picture,
            file: None,
            last_change: None,
            session: None,
            asked: None,
            texture: None,
        };
        side.start_with(known);
        side
    }

    /// Shows another technique, with its defaults.
    pub fn start_with(&mut self, technique: &'static str) {
        let Some(about) = live::about(technique) else { return };
        self.technique = technique;
        self.mode = about.modes.first().map(|mode| mode.name.to_owned()).unwrap_or_default();
        self.bake = None;
        self.file = None;
        self.defaults = Arc::new(preview(technique, &about));
        self.settings = self.defaults.clone();
        // `render` takes the mean of several pictures where one takes about a second on a CPU driver.
        self.pictures = if about.cheap { smooth::STILL } else { 1 };
        self.shows = Shows::Picture;
        self.about = about;
    }

    /// The light of one picture serves further places inside the pixels, as `--aa edges` asks `render`.
    pub fn has_edges(&self) -> bool {
        let mode = self.about.modes.iter().find(|mode| mode.name == self.mode);
        let is_light = self.technique != TRUTH && mode.is_none_or(|mode| mode.is_light);
        // The two pictures of `prt` for two eyes are side by side, and have no view in common.
        let eyes = self.settings.pointer("/prt/eyes").and_then(Value::as_f64).is_some_and(|apart| apart > 0.0);
        self.edges && self.pictures == 1 && is_light && !eyes
    }

    /// The settings of the paper, or the defaults.
    pub fn set_paper(&mut self, paper: bool) {
        let settings = self.about.paper.clone().filter(|_| paper);
        self.settings = settings.map_or_else(|| self.defaults.clone(), Arc::new);
    }

    /// Asks for a picture, unless it was asked for already.
    ///
    /// # Errors
    /// As [`Session::start`].
    pub fn ask(&mut self, wanted: Wanted, options: &GpuOptions, wake: &Wake) -> Result<()> {
        let known = |before: &Wanted| {
            before.same_light(&wanted) && before.exposure == wanted.exposure && before.look == wanted.look
        };
        if self.asked.as_ref().is_some_and(known) {
            return Ok(());
        }
        let session = match &self.session {
            Some(session) => session,
            None => self.session.insert(Session::start(self.name, options.clone(), wake.clone())?),
        };
        session.ask(wanted.clone());
        self.asked = Some(wanted);
        Ok(())
    }

    /// The picture of the mode is light, which has an exposure.
    pub fn is_light(&self) -> bool {
        if let Some(file) = &self.file {
            return !file.is_for_screens;
        }
        let mode = self.about.modes.iter().find(|mode| mode.name == self.mode);
        self.shows == Shows::Picture && mode.is_none_or(|mode| mode.is_light)
    }

    /// Stops the work for this side; the next request goes on.
    pub fn rest(&mut self) {
        if let Some(session) = self.session.as_ref().filter(|_| self.asked.is_some()) {
            session.rest();
            self.asked = None;
        }
    }

    pub fn session(&self) -> Option<&Session> {
        self.session.as_ref()
    }

    /// The newest picture.
    pub fn shown(&self) -> Option<Arc<Shown>> {
        self.session.as_ref()?.shown()
    }

    /// The newest picture as a texture, and whether its pixels are those of the screen.
    pub fn texture(&mut self, context: &Context) -> Option<(TextureHandle, bool)> {
        let shown = self.shown()?;
        let fresh = self.texture.as_ref().is_some_and(|(of, _)| *of == shown.number);
        if !fresh {
            let image = image_of(shown.size, &shown.pixels);
            let options = if shown.whole { TextureOptions::NEAREST } else { TextureOptions::LINEAR };
            match &mut self.texture {
                Some((of, texture)) => {
                    texture.set(image, options);
                    *of = shown.number;
                }
                none => *none = Some((shown.number, context.load_texture(self.name, image, options))),
            }
        }
        self.texture.as_ref().map(|(_, texture)| (texture.clone(), shown.whole))
    }
}

/// A texture's image of codes.
pub fn image_of(size: Size, codes: &[[u8; 3]]) -> ColorImage {
    let pixels = codes.iter().map(|[r, g, b]| egui::Color32::from_rgb(*r, *g, *b)).collect();
    ColorImage::new([size.width as usize, size.height as usize], pixels)
}

/// The settings with which a technique begins: its defaults, and for `fiv` those of a picture in seconds.
fn preview(technique: &str, about: &About) -> Value {
    use lucerna::techniques::fiv::{Fiv, Method, PictureSettings, Settings};
    if technique != <Fiv as lucerna::technique::Technique>::NAME {
        return about.settings.clone();
    }
    let quick = Settings { method: Method::Online, size: 8, ..Settings::preview() };
    let staged = crate::last_stage::Staged {
        technique: PictureSettings { fiv: quick, ..PictureSettings::default() },
        effects: None,
        tonemap: None,
    };
    crate::config::to_value(&staged).unwrap_or_else(|_| about.settings.clone())
}
