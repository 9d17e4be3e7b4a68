//! One interface for all techniques, for programs that drive more than one: command line, experiments, viewers, bindings.
//!
//! [`Technique`] is the interface, at the edge only: inside, a technique is functions from handles to handles, which a program may call
//! directly. [`Ready`] holds a technique with the scene that it was prepared for, and declares frames. [`Picture`] is the result of a frame:
//! the total, named layers, sums and notes. [`crate::techniques::visit`] finds a technique by its name.

mod gbuffer_layers;
mod picture;
mod readback;

pub use picture::{Decode, Picture};
pub use readback::{Readback, raw};

use std::{convert::Infallible, fmt::Debug, path::Path};

use glam::Vec2;
use serde::{Serialize, de::DeserializeOwned};

use crate::{
    Error, Result,
    bake::Digest,
    gpu::Gpu,
    graph::{Extent, Graph},
    passes::{edges, matte, temporal},
    resident::{Handles, Resident},
    scene::{Note, Pose, Scene, View, chosen::Chosen},
    settings::Description,
};

/// The settings of a technique, with those of the passes before it.
pub trait Settings: Serialize + DeserializeOwned + Clone + Default + PartialEq + Debug {
    /// The paper's own settings; `None` if the technique has no such preset.
    fn paper() -> Option<Self>;

    /// Checks that all values are in their ranges.
    ///
    /// # Errors
    /// `Usage`, naming the key, the value found and the values allowed.
    fn validate(&self) -> Result<()>;
}

/// What the picture shows: all light, or a part of it.
pub trait Mode: Copy + Debug + Default + PartialEq + Send + Sync + 'static {
    /// All modes; the first is the default and shows all light.
    const ALL: &'static [Self];

    /// Name on the command line and in files.
    fn name(self) -> &'static str;

    /// One line for help texts.
    fn doc(self) -> &'static str;

    /// The picture is radiance, which an exposure scales. Otherwise its values are shown unscaled.
    fn is_radiance(self) -> bool {
        true
    }
}

/// For techniques whose pictures always show all light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AllLight;

impl Mode for AllLight {
    const ALL: &'static [Self] = &[Self];

    fn name(self) -> &'static str {
        "all"
    }

    fn doc(self) -> &'static str {
        "All light"
    }
}

/// Data from the file of a bake.
pub trait Bake: Sized {
    /// A picture cannot be made without the file.
    const NEEDED: bool;

    /// Reads a file.
    ///
    /// # Errors
    /// `Input`, naming the file and saying what is wrong.
    fn read(file: &Path) -> Result<Self>;

    /// The file and the digest of its contents, if a picture depends on them. `None`: the settings of a picture are enough to make it again.
    fn source(&self) -> Option<(&Path, Digest)>;
}

impl Bake for Infallible {
    const NEEDED: bool = false;

    fn read(file: &Path) -> Result<Self> {
        Err(Error::input("is named as the file of a bake, but this technique needs none").in_file(file))
    }

    fn source(&self) -> Option<(&Path, Digest)> {
        None
    }
}

/// The inputs of [`Technique::ready`]; `B` is [`Technique::Baked`].
pub struct Making<'a, B> {
    pub gpu: &'a Gpu,
    pub scene: &'a Scene,
    pub resident: &'a Resident,
    /// Data from the file of a bake.
    pub baked: Option<&'a B>,
    /// Called with the finished and the whole number of units of long work. Returns false to stop the work.
    pub told: &'a mut dyn FnMut(u64, u64) -> bool,
}

impl<B> Debug for Making<'_, B> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Making(baked: {})", self.baked.is_some())
    }
}

/// The choices for one frame besides pose, view and settings.
#[derive(Clone, Copy, Debug)]
pub struct Shot<M> {
    /// Time of the frame, seconds.
    pub seconds: f64,
    /// Number of frames of the run.
    pub frames: u32,
    pub mode: M,
    /// The program needs all layers or the list of passes, not only the total.
    pub layers: bool,
    /// Temporal anti-aliasing: the total is the average over the frames. The caller shifts each frame's view ([`temporal::place`]), and all
    /// frames have one `Runner`. The other layers are those of the frame.
    pub temporal: Option<temporal::Settings>,
    /// Smooth edges of the total and of all layers of colours by further places inside each pixel, which have no light of their own
    /// ([`edges`]). The other layers are those of the middles.
    pub edges: Option<[Vec2; edges::PLACES]>,
}

impl<M: Mode> Default for Shot<M> {
    /// One frame at second 0 with all layers.
    fn default() -> Self {
        Self { seconds: 0.0, frames: 1, mode: M::default(), layers: true, temporal: None, edges: None }
    }
}

/// The inputs of [`Technique::frame`]. `graph.frame` and `graph.seed` are the number of the frame and the seed of its random numbers.
#[derive(Clone, Debug)]
pub struct Moment<'a, M> {
    pub scene: &'a Scene,
    /// The pose at the time of the frame.
    pub pose: &'a Pose,
    /// The scene's buffers and images in this graph and pose.
    pub handles: &'a Handles,
    /// The camera, with the far plane fitted to the scene.
    pub view: View,
    pub shot: Shot<M>,
    /// Notes of the scene's upload.
    pub notes: &'a [Note],
}

/// A technique that is prepared for a scene.
pub trait Technique: Sized {
    /// Name of the technique in commands, settings, file names and metadata, for example `isr`.
    const NAME: &'static str;
    /// One line for lists.
    const ABOUT: &'static str;
    /// The units of long work in [`Self::ready`], for progress.
    const UNITS: &'static str = "units";
    /// The technique brings its own light, so an exposure that suits the scene's lights does not suit its pictures.
    const OWN_LIGHT: bool = false;
    /// The scene's lights light its pictures, not the environment alone.
    const LAMPS: bool = true;

    type Settings: Settings;
    type Mode: Mode;
    /// Data from the file of a bake. [`Infallible`] for techniques without bakes.
    type Baked: Bake;

    /// The technique's own settings, without those of the passes before it.
    fn description() -> &'static Description;

    /// The settings on which [`Self::ready`] depends. All other keys have the same values for all settings, so two settings can share what
    /// is ready if these are equal.
    fn prepared_by(settings: &Self::Settings) -> Self::Settings;

    /// A usual picture takes about a second on a CPU driver, so that programs may render several for a still, whose mean has smooth edges.
    fn is_cheap(_: &Self::Settings) -> bool {
        true
    }

    /// Number of rays that [`Self::ready`] traces for each object, for limits on the work that untrusted settings may cause.
    fn rays(_: &Self::Settings) -> u64 {
        0
    }

    /// Uploads the scene for this technique.
    ///
    /// # Errors
    /// As [`Resident::new`].
    fn upload(gpu: &Gpu, scene: &Scene) -> Result<Resident> {
        Resident::new(gpu, scene)
    }

    /// Prepares the technique for a scene. May run graphs.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`, `Interrupted` if `told` stopped it; `Usage` or `Input` if the technique does not support the settings or
    /// the scene, or if the bake is for another scene or for other settings.
    fn ready(making: Making<'_, Self::Baked>, settings: &Self::Settings) -> Result<Self>;

    /// Declares the passes of one frame. Writes no file.
    ///
    /// # Errors
    /// `Usage` or `Input` for settings or scenes that the technique does not support.
    fn frame(
        &mut self,
        graph: &mut Graph,
        moment: &Moment<'_, Self::Mode>,
        settings: &Self::Settings,
    ) -> Result<Picture>;
}

/// A technique with the scene that it is prepared for, in device memory.
#[derive(Debug)]
pub struct Ready<T> {
    resident: Resident,
    technique: T,
    /// The objects whose matte each frame has.
    chosen: Option<Chosen>,
}

impl<T: Technique> Ready<T> {
    /// Uploads the scene and prepares the technique. `told`: as [`Making::told`].
    ///
    /// # Errors
    /// As [`Technique::ready`].
    pub fn new(
        gpu: &Gpu,
        scene: &Scene,
        settings: &T::Settings,
        baked: Option<&T::Baked>,
        told: &mut dyn FnMut(u64, u64) -> bool,
    ) -> Result<Self> {
        let resident = T::upload(gpu, scene)?;
        let technique = T::ready(Making { gpu, scene, resident: &resident, baked, told }, settings)?;
        Ok(Self { resident, technique, chosen: None })
    }

    /// The technique.
    pub fn technique(&self) -> &T {
        &self.technique
    }

    /// From the next frame on, pictures have the matte of these objects ([`Picture::matte`]) and the layer `chosen`. `None`: no matte.
    pub fn choose(&mut self, chosen: Option<Chosen>) {
        self.chosen = chosen;
    }

    /// Declares one frame of the scene. The far plane of `view` is fitted to the scene in `pose`.
    ///
    /// # Errors
    /// As [`Technique::frame`]; `Usage` for anti-aliasing of a picture that is not radiance or has no G-buffer, and for a matte of a
    /// picture without G-buffer or of two eyes.
    pub fn frame(
        &mut self,
        graph: &mut Graph,
        (scene, pose): (&Scene, &Pose),
        view: &View,
        shot: Shot<T::Mode>,
        settings: &T::Settings,
    ) -> Result<Picture> {
        let handles = self.resident.frame_in(graph, scene, pose);
        let view = view.fit_far(&handles.bounds());
        let moment = Moment { scene, pose, handles: &handles, view, shot, notes: self.resident.notes() };
        let mut picture = self.technique.frame(graph, &moment, settings)?;
        if let Some(gbuffer) = &picture.gbuffer {
            gbuffer_layers::add(&mut picture.layers, gbuffer, &view);
        }
        let mut shown = view;
        let radiance = picture.gbuffer.filter(|_| shot.mode.is_radiance());
        let without = |at| {
            let what = format!("{} has no radiance with a G-buffer in mode {}", T::NAME, shot.mode.name());
            Error::usage(what).at(at).help("Leave this anti-aliasing out")
        };
        if let Some(places) = &shot.edges {
            let gbuffer = radiance.ok_or_else(|| without("edges"))?;
            let drawn = picture.drawn.take();
            let drawn = drawn.as_ref().unwrap_or(&handles);
            let weights = edges::weights(graph, drawn, (&gbuffer, &view), places)?;
            let middles = picture.total;
            picture.total = weights.smooth(graph, middles)?;
            // Without a reader the layers must cost nothing.
            for layer in picture.layers.iter_mut().filter(|layer| shot.layers && layer.is_color()) {
                let same = layer.image == middles;
                layer.image = if same { picture.total } else { weights.smooth(graph, layer.image)? };
            }
        }
        if let Some(settings) = shot.temporal {
            let gbuffer = radiance.ok_or_else(|| without("temporal"))?;
            picture.total = temporal::accumulate(graph, &handles, (&gbuffer, &view), picture.total, settings)?;
            // The average stands at the middles of the pixels.
            shown = view.shifted(Vec2::ZERO);
        }
        if let Some(chosen) = &self.chosen {
            let of_view = |image| graph.extent(image) == Extent::from(view.extent);
            let gbuffer = picture.gbuffer.filter(|g| of_view(g.depth) && of_view(picture.total));
            let Some(gbuffer) = gbuffer else {
                let mode = shot.mode.name();
                let what = format!(
                    "the pixels of named objects are not known: mode {mode} of {} has no G-buffer, or shows two eyes",
                    T::NAME
                );
                return Err(Error::usage(what).help("Name no objects, or render one eye with all light"));
            };
            let matte = matte::draw(graph, &handles, &gbuffer, &view, chosen);
            picture = picture.values("chosen", &["Y"], matte);
            picture.matte = Some(matte);
        }
        picture.gbuffer = None;
        picture.view = Some(shown);
        Ok(picture)
    }
}
