//! What a side of the window shows, and what it has: the messages between the window and the thread that renders.

use std::{collections::BTreeMap, path::PathBuf, sync::Arc, time::Instant};

use lucerna::{
    Result,
    image::Layers,
    scene::{Pose, View},
    techniques::tonemap::Operator,
    tracer,
};
use serde_json::Value;

use crate::{
    args::Size,
    lamps::{self, Put},
    last_stage,
    placed::Placed,
    stage::Stage,
};

/// Name of the path tracer among the techniques; it makes a picture that grows.
pub const TRUTH: &str = <tracer::Reference as lucerna::technique::Technique>::NAME;

/// How the light of a picture is shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Look {
    /// As `render` writes it into a .png file, with this curve.
    Light(Option<Operator>),
    /// Luminance as colours, five decades.
    FalseColour,
}

/// A part of a frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Shows {
    /// The light of the technique.
    #[default]
    Picture,
    /// A layer of the file: albedo, normal, depth, …
    Layer(String),
    /// An image of the render graph.
    Image(String),
}

/// A picture of a file.
#[derive(Clone, Debug)]
pub struct FilePicture {
    pub path: PathBuf,
    pub layers: Arc<Layers>,
    /// The file holds codes of a screen, which have exposure and curve already.
    pub is_for_screens: bool,
}

/// A request for a picture.
#[derive(Clone, Debug)]
pub struct Wanted {
    pub stage: Arc<Stage>,
    /// One of [`lucerna::techniques::NAMES`].
    pub technique: &'static str,
    /// A picture in the place of one that is rendered.
    pub file: Option<FilePicture>,
    /// Name of the mode of the technique.
    pub mode: String,
    /// Of the technique, and of the tone mapping after it.
    pub settings: Arc<Value>,
    /// File of a bake.
    pub bake: Option<PathBuf>,
    pub camera: Placed,
    pub size: Size,
    /// Time of an animated scene, seconds.
    pub seconds: f64,
    /// Lamps that were moved or turned, by their nodes.
    pub moved: BTreeMap<usize, Put>,
    pub shows: Shows,
    /// Pictures of the mean of a still.
    pub pictures: u32,
    /// The light of one picture serves further places inside the pixels.
    pub edges: bool,
    /// Paths a pixel of the path tracer.
    pub samples: u64,
    /// The camera, a lamp or the time moves, so that a quick picture is better than a fine one.
    pub moving: bool,
    /// EV; `None`: the one that suits the picture.
    pub exposure: Option<f64>,
    pub look: Look,
}

impl Wanted {
    /// Whether another request is for the same light, shown in the same way or in another one.
    pub fn same_light(&self, other: &Self) -> bool {
        self.same_scene(other)
            && self.mode == other.mode
            && self.settings == other.settings
            && self.camera == other.camera
            && self.size == other.size
            && self.seconds == other.seconds
            && self.moved == other.moved
            && self.shows == other.shows
            && self.pictures == other.pictures
            && self.edges == other.edges
            && self.samples == other.samples
            && self.moving == other.moving
    }

    /// Whether another request is for the same technique in the same scene.
    pub fn same_scene(&self, other: &Self) -> bool {
        let same_file = match (&self.file, &other.file) {
            (None, None) => true,
            (Some(a), Some(b)) => Arc::ptr_eq(&a.layers, &b.layers),
            _ => false,
        };
        Arc::ptr_eq(&self.stage, &other.stage)
            && self.technique == other.technique
            && self.bake == other.bake
            && same_file
    }

    /// The settings map the light to a screen.
    pub fn is_developed(&self) -> bool {
        last_stage::is_developed(&self.settings)
    }

    /// The path tracer makes the picture.
    pub fn is_truth(&self) -> bool {
        self.technique == TRUTH && self.file.is_none()
    }

    /// The pose and the view, at a size of the picture.
    ///
    /// # Errors
    /// As [`Stage::at`].
    pub fn placed(&self, size: Size) -> Result<(Pose, View)> {
        let (mut pose, _) = self.stage.at(self.seconds, size)?;
        lamps::apply(&mut pose, &self.moved);
        let view = self.camera.view(&pose, size);
        Ok((pose, view))
    }
}

/// The time of a pass on the device.
#[derive(Clone, Debug, PartialEq)]
pub struct PassTime {
    pub name: String,
    pub milliseconds: f64,
}

/// A picture that a thread has made.
#[derive(Debug)]
pub struct Shown {
    /// Counts the pictures of a session.
    pub number: u64,
    pub size: Size,
    /// Red, green and blue codes of each pixel on the screen, row by row from the upper left corner.
    pub pixels: Vec<[u8; 3]>,
    /// The light, and the layers of a still.
    pub layers: Arc<Layers>,
    /// EV.
    pub exposure: f64,
    /// The light is new; otherwise known light is shown in another way.
    pub fresh: bool,
    /// It was rendered in the size that was asked for.
    pub whole: bool,
    /// The request.
    pub of: Wanted,
    /// Time from the request to the picture, on the clock of the host.
    pub milliseconds: f64,
    pub passes: Arc<Vec<PassTime>>,
    /// Names of the images of the render graph.
    pub images: Arc<Vec<String>>,
    pub notes: Vec<String>,
    /// Paths a pixel of the path tracer.
    pub samples: f64,
    /// Estimated relative mean squared error of the path tracer.
    pub noise: Option<f64>,
    /// When the picture was made.
    pub at: Instant,
}
