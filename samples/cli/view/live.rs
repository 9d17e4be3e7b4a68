//! A technique that renders for a window: any of them behind one interface.

use std::sync::Arc;

use glam::Vec2;
use lucerna::{
    Error, Result,
    gpu::Gpu,
    graph::{Graph, Report, Runner},
    image::Layers,
    scene::{Note, Pose, View},
    technique::{Bake, Mode, Readback, Ready, Settings, Shot, Technique},
    techniques::{self, Visitor, tonemap},
};
use serde_json::Value;

use crate::{
    config::SettingsArgs,
    effects::{self, Effects},
    exposure,
    last_stage::{self, LastStage, Staged},
    smooth::{Mean, Smooth},
    stage::Stage,
    view::wanted::{Shows, Wanted},
};

/// Time between frames for what adapts, seconds: that of `render`.
pub const STEP: f32 = 1.0 / 30.0;

/// A rendered picture in host memory.
#[derive(Debug)]
pub struct Made {
    pub layers: Layers,
    pub report: Report,
    pub notes: Vec<Note>,
    /// Names of the images of the graph.
    pub images: Vec<String>,
}

/// The choices for one picture besides those of the request.
pub struct Take<'a> {
    pub pose: &'a Pose,
    pub view: View,
    /// All layers are read, not the light alone.
    pub layers: bool,
    /// EV before the tone mapping of the settings.
    pub exposure: f64,
    /// False: what is prepared anew is not needed any more.
    pub go_on: &'a dyn Fn() -> bool,
}

/// A technique that renders pictures of one scene.
pub trait Live {
    /// Renders one picture.
    ///
    /// # Errors
    /// Any error of the technique; `Interrupted` if the device was asked to stop.
    fn single(&mut self, wanted: &Wanted, take: &Take<'_>) -> Result<Made>;

    /// Renders the mean of `wanted.pictures` pictures. `told` is called with the share that is done.
    ///
    /// # Errors
    /// As [`Live::single`].
    fn mean(&mut self, wanted: &Wanted, take: &Take<'_>, told: &mut dyn FnMut(f64)) -> Result<Made>;

    /// Whether the picture of the request is light, which exposures scale and curves develop.
    fn is_light(&self, wanted: &Wanted) -> bool;

    /// Exposure that suits the scene, if it is known.
    fn exposure(&self, stage: &Stage) -> Option<f64>;
}

/// Prepares a technique for the scene of a request. `told`: finished and whole number of units; false stops.
///
/// # Errors
/// `Usage` for an unknown technique; else as [`Ready::new`].
pub fn of(gpu: &Gpu, wanted: &Wanted, told: &mut dyn FnMut(u64, u64) -> bool) -> Result<Box<dyn Live>> {
    let making = Making { gpu, wanted, told };
    techniques::visit(wanted.technique, making)
        .unwrap_or_else(|| Err(Error::usage(format!("there is no technique {:?}", wanted.technique))))
}

struct Making<'a> {
    gpu: &'a Gpu,
    wanted: &'a Wanted,
    told: &'a mut dyn FnMut(u64, u64) -> bool,
}

impl Visitor for Making<'_> {
    type Output = Result<Box<dyn Live>>;

    fn visit<T: Technique + 'static>(self) -> Self::Output {
        let Self { gpu, wanted, told } = self;
        let settings = staged::<T>(&wanted.settings)?.technique;
        let baked = wanted.bake.as_deref().map(T::Baked::read).transpose()?;
        if baked.is_none() && T::Baked::NEEDED {
            let what = format!("{} needs the file of a bake", T::NAME);
            return Err(Error::usage(what).help(format!("`lucerna bake {} SCENE -o FILE` makes one", T::NAME)));
        }
        let ready = Ready::new(gpu, &wanted.stage.scene, &settings, baked.as_ref(), told)?;
        Ok(Box::new(Living::<T> {
            gpu: gpu.clone(),
            by: T::prepared_by(&settings),
            ready,
            baked,
            runner: Runner::new(gpu),
            effects: None,
            last: None,
        }))
    }
}

/// The settings of a request, checked.
fn staged<T: Technique>(settings: &Value) -> Result<Staged<T::Settings>> {
    Staged::recorded(settings, &T::Settings::default(), T::Settings::validate)
}

/// The mode of a request; the first for an unknown name.
pub(super) fn mode<M: Mode>(name: &str) -> M {
    M::ALL.iter().copied().find(|mode| mode.name() == name).unwrap_or_default()
}

struct Living<T: Technique> {
    gpu: Gpu,
    ready: Ready<T>,
    /// The settings on which `ready` depends.
    by: T::Settings,
    baked: Option<T::Baked>,
    runner: Runner,
    /// The post-processing pipeline, with the settings that it is for.
    effects: Option<(effects::Settings, Effects)>,
    /// Tone mapping, with the settings and the exposure that it is for.
    last: Option<(Value, f64, LastStage)>,
}

impl<T: Technique> Living<T> {
    /// The settings of the request; what depends on them is prepared again.
    fn prepare(&mut self, wanted: &Wanted, take: &Take<'_>) -> Result<T::Settings> {
        let Staged { technique: settings, effects, tonemap } = staged::<T>(&wanted.settings)?;
        // Each picture stands for itself, and has its own map of important pixels.
        let tonemap = tonemap.map(|tonemap| tonemap::Settings { keep_map: 1, ..tonemap });
        let by = T::prepared_by(&settings);
        if by != self.by {
            let stage: &Arc<Stage> = &wanted.stage;
            self.ready =
                Ready::new(&self.gpu, &stage.scene, &settings, self.baked.as_ref(), &mut |_, _| (take.go_on)())?;
            self.by = by;
        }
        if self.effects.as_ref().map(|(by, _)| by) != effects.as_ref() {
            self.effects = effects.map(|by| Ok((by.clone(), Effects::new(&by)?))).transpose()?;
        }
        self.ready.choose(last_stage::important(&wanted.stage.scene, tonemap.as_ref())?);
        let exposure = take.exposure;
        let shown = wanted.settings.get("tonemap").cloned().unwrap_or_default();
        if self.last.as_ref().is_none_or(|(by, ev, _)| *by != shown || *ev != exposure) {
            self.last = Some((shown, exposure, LastStage::new(&self.gpu, tonemap.as_ref(), exposure)?));
        }
        Ok(settings)
    }

    fn rendered(
        &mut self,
        wanted: &Wanted,
        take: &Take<'_>,
        settings: &T::Settings,
        (place, number, develop): (Vec2, u32, bool),
    ) -> Result<Made> {
        let mut graph = Graph::new(T::NAME);
        // As `render` numbers them: noise of other random numbers is averaged, too.
        graph.seed = number.wrapping_mul(0x9e37_79b9);
        let scene = (&wanted.stage.scene, take.pose);
        // All images of the graph are in the list of the window, so it is the same graph when one of them is shown.
        let edges = wanted.edges;
        let shot = Shot {
            seconds: wanted.seconds,
            frames: 1,
            mode: mode::<T::Mode>(&wanted.mode),
            layers: take.layers,
            temporal: None,
            edges: Smooth { edges, ..Smooth::default() }.edges(),
        };
        let mut picture = self.ready.frame(&mut graph, scene, &take.view.shifted(place), shot, settings)?;
        if let Some((_, effects)) = &self.effects {
            effects.follow(&mut graph, &mut picture, wanted.seconds)?;
        }
        if develop && let Some((_, _, last)) = &mut self.last {
            last.frame(&mut graph, &mut picture, STEP)?;
        }
        let mut notes = std::mem::take(&mut picture.notes);
        let images = graph.image_names().into_iter().map(str::to_owned).collect();
        let reading = match &wanted.shows {
            Shows::Image(name) => Readback::view(&mut graph, name)?,
            Shows::Picture | Shows::Layer(_) => {
                // The mean of several pictures is developed afterwards, with the matte.
                let matte = !develop && picture.matte.is_some();
                let picture = if matte && !take.layers { picture.only(&[last_stage::MATTE]) } else { picture };
                picture.read(&mut graph, take.layers || matte, false)
            }
        };
        let frame = self.runner.run_with_progress(&graph, number > 0, &mut |_| {})?;
        notes.extend(reading.notes(&frame));
        Ok(Made { layers: reading.layers(&frame), report: frame.report.clone(), notes, images })
    }
}

impl<T: Technique> Live for Living<T> {
    fn single(&mut self, wanted: &Wanted, take: &Take<'_>) -> Result<Made> {
        let settings = self.prepare(wanted, take)?;
        // Each picture stands for itself, as the first frame of `render`.
        self.runner.forget_history();
        self.rendered(wanted, take, &settings, (Vec2::ZERO, 0, true))
    }

    fn mean(&mut self, wanted: &Wanted, take: &Take<'_>, told: &mut dyn FnMut(f64)) -> Result<Made> {
        let settings = self.prepare(wanted, take)?;
        self.runner.forget_history();
        let places = Smooth { count: wanted.pictures, ..Smooth::default() }.places();
        let (mut mean, all) = (Mean::default(), places.len() as f64);
        let mut first = None;
        for (number, place) in places.into_iter().enumerate().rev() {
            told(1.0 - (number as f64 + 1.0) / all);
            let made = self.rendered(wanted, take, &settings, (place, number as u32, false))?;
            mean.add(made.layers, number == 0);
            first = Some((made.report, made.notes, made.images));
        }
        let (Some((mut layers, _)), Some((report, notes, images))) = (mean.finish(), first) else {
            return Err(Error::usage("a mean of no pictures").at("pictures"));
        };
        if let Some((_, _, last)) = &mut self.last {
            last.mean(&mut layers, STEP)?;
        }
        Ok(Made { layers, report, notes, images })
    }

    fn is_light(&self, wanted: &Wanted) -> bool {
        mode::<T::Mode>(&wanted.mode).is_radiance() && wanted.shows == Shows::Picture
    }

    fn exposure(&self, stage: &Stage) -> Option<f64> {
        if T::OWN_LIGHT { None } else { exposure::of_source(&stage.source) }
    }
}

/// A mode of a technique.
#[derive(Clone, Copy, Debug)]
pub struct AboutMode {
    pub name: &'static str,
    pub doc: &'static str,
    /// The picture is radiance.
    pub is_light: bool,
}

/// What programs know of a technique without a scene.
#[derive(Clone, Debug)]
pub struct About {
    pub about: &'static str,
    pub modes: Vec<AboutMode>,
    /// The default settings.
    pub settings: Value,
    pub paper: Option<Value>,
    /// It needs the file of a bake.
    pub baked: bool,
    /// A usual picture takes about a second on a CPU driver.
    pub cheap: bool,
}

impl AboutMode {
    fn of<M: Mode>(mode: &M) -> Self {
        Self { name: mode.name(), doc: mode.doc(), is_light: mode.is_radiance() }
    }
}

/// What is known of a technique; `None` for an unknown name.
pub fn about(name: &str) -> Option<About> {
    struct Asking;
    impl Visitor for Asking {
        type Output = About;

        fn visit<T: Technique + 'static>(self) -> About {
            let plain = |settings: T::Settings| {
                crate::config::to_value(&Staged { technique: settings, effects: None, tonemap: None })
                    .unwrap_or_default()
            };
            About {
                about: T::ABOUT,
                modes: T::Mode::ALL.iter().map(AboutMode::of).collect(),
                settings: plain(T::Settings::default()),
                paper: T::Settings::paper().map(plain),
                baked: T::Baked::NEEDED,
                cheap: T::is_cheap(&T::Settings::default()),
            }
        }
    }
    techniques::visit(name, Asking)
}

/// Settings of a technique with those of a command line over them.
///
/// # Errors
/// As [`Staged::effective`].
pub fn with(name: &str, settings: &Value, args: &SettingsArgs) -> Result<Value> {
    struct Over<'a>(&'a Value, &'a SettingsArgs);
    impl Visitor for Over<'_> {
        type Output = Result<Value>;

        fn visit<T: Technique + 'static>(self) -> Result<Value> {
            let base = staged::<T>(self.0)?.technique;
            crate::config::to_value(&Staged::effective(self.1, &base, false, T::Settings::validate)?)
        }
    }
    techniques::visit(name, Over(settings, args))
        .unwrap_or_else(|| Err(Error::usage(format!("there is no technique {name:?}"))))
}
