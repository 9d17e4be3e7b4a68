//! The window's state, and what it asks its sides for.

use std::{
    collections::BTreeMap,
    path::PathBuf,
    sync::{Arc, mpsc},
    time::{Duration, Instant},
};

use egui::Context;
use lucerna::{Result, gpu::GpuOptions, scene::Pose, techniques::tonemap::Operator};

use super::{
    ViewArgs, bars,
    cameras::Cameras,
    controls,
    files::Reading,
    fly::Fly,
    keys,
    measured::{Answer, MapOf, Measuring, Pictured, Question},
    panel::Descriptions,
    picture,
    session::Wake,
    side::Side,
    text::{self, Followed},
    wanted::{FilePicture, Look, Shown, Wanted},
    watch::Watch,
};
use crate::{
    args::Size,
    effects,
    lamps::{self, Put},
    placed::Placed,
    screen,
    stage::{Stage, StageArgs},
};

/// What the window shows of both sides.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Compare {
    /// Side A alone.
    #[default]
    One,
    /// A on the left of a line, B on the right.
    Split,
    /// A beside B, each whole.
    Beside,
    /// The difference of what both show.
    Difference,
    /// A map of a measure.
    Map(MapOf),
}

impl Compare {
    pub const ALL: [(Self, &'static str); 6] = [
        (Self::One, "A alone"),
        (Self::Split, "split"),
        (Self::Beside, "side by side"),
        (Self::Difference, "difference"),
        (Self::Map(MapOf::Flip), "FLIP map"),
        (Self::Map(MapOf::RelativeError), "relative error map"),
    ];
}

/// What the mouse holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Held {
    /// A lamp, by its node.
    Lamp(usize),
    /// The line between both sides.
    Line,
}

/// A picture that another process writes.
pub(super) struct Writing {
    pub file: PathBuf,
    pub child: std::process::Child,
    /// Its errors, in a file, because a pipe that nobody reads would stop it.
    pub said: std::fs::File,
    /// A sequence, which ends with the window.
    pub sequence: bool,
}

impl Drop for Writing {
    fn drop(&mut self) {
        if self.sequence {
            // A process that has ended already is no fault.
            let _ = self.child.kill();
            let _ = self.child.wait();
        }
    }
}

/// The viewer.
pub struct Viewer {
    pub(super) options: GpuOptions,
    pub(super) wake: Wake,
    pub(super) args: StageArgs,
    pub(super) stage: Option<Arc<Stage>>,
    pub(super) reading: Option<Reading>,
    pub(super) reading_picture: Option<mpsc::Receiver<Result<FilePicture>>>,
    /// The technique was named, so a new scene keeps it.
    pub(super) named: bool,
    pub(super) sides: [Side; 2],
    pub(super) compare: Compare,
    /// Place of the line between both sides, share of the width.
    pub(super) divider: f32,
    /// B is shown alone while a key is held.
    pub(super) flipped: bool,
    pub(super) measuring: Option<Measuring>,
    pub(super) descriptions: Descriptions,
    /// Of the scene, while `fly` is none.
    pub(super) camera: usize,
    pub(super) fly: Option<Fly>,
    /// The camera of a file or of numbers, from which the window began, and the words that name it.
    pub(super) named_camera: Option<(Placed, String)>,
    /// Device of the command line.
    pub(super) device: Option<String>,
    pub(super) cameras: Cameras,
    pub(super) seconds: f64,
    pub(super) playing: bool,
    /// Turn of the environment that the mouse holds, degrees.
    pub(super) turn: Option<f64>,
    pub(super) moved: BTreeMap<usize, Put>,
    /// The pose of the scene in this frame of the window, with moved lamps.
    pub(super) pose: Option<Pose>,
    pub(super) held: Option<Held>,
    /// The node of the lamp whose row in the panel the mouse is on.
    pub(super) pointed_lamp: Option<usize>,
    pub(super) exposure: Option<f64>,
    pub(super) curve: Option<Operator>,
    pub(super) false_colour: bool,
    /// Size of the picture on the screen, pixels.
    pub(super) size: Size,
    pub(super) panels: bool,
    pub(super) help: bool,
    /// Pixel under the mouse.
    pub(super) pixel: Option<[u32; 2]>,
    pub(super) message: Option<(String, Instant)>,
    pub(super) trouble: Option<String>,
    pub(super) writing: Option<Writing>,
    last_move: Option<Instant>,
    pub(super) watch: Option<Watch>,
    /// A pipeline that a thread compiles.
    pub(super) compiling: Option<text::Compiling>,
    /// A pipeline that follows a side.
    pub(super) followed: Option<Followed>,
    /// Number of the side that this pipeline follows.
    pub(super) followed_side: usize,
    times: bars::Times,
}

/// Time after a movement at which the still begins.
const REST: Duration = Duration::from_millis(180);

fn is_recent(change: Option<Instant>) -> bool {
    change.is_some_and(|at| at.elapsed() < REST)
}

/// Time for which a message stands.
const MESSAGE: Duration = Duration::from_secs(6);

impl Viewer {
    /// A viewer that reads the scene of a command line, if it names one.
    ///
    /// # Errors
    /// `Usage` for an unknown technique.
    pub fn new(mut args: ViewArgs, wake: Wake) -> Result<Self> {
        let pipeline = args.settings.effects.as_deref().map(effects::read).transpose()?;
        if let Some(pipeline) = &pipeline
            && args.technique.is_none()
        {
            args.technique.clone_from(&pipeline.technique);
        }
        let technique = args.technique.clone();
        let mut sides = [Side::new("A", technique.as_deref().unwrap_or("isr")), Side::new("B", super::wanted::TRUTH)];
        sides[0].bake.clone_from(&args.bake);
        sides.iter_mut().for_each(|side| side.samples = args.spp);
        if args.paper {
            sides[0].set_paper(true);
        }
        if let Some(settings) = args.settings(&sides[0])? {
            sides[0].settings = Arc::new(settings);
        }
        let mut viewer = Self {
            options: args.device.options()?,
            wake,
            named: technique.is_some(),
            sides,
            compare: args.compare.into(),
            divider: 0.5,
            flipped: false,
            measuring: None,
            descriptions: Descriptions::default(),
            stage: None,
            reading: None,
            reading_picture: None,
            camera: 0,
            fly: None,
            named_camera: None,
            device: args.device.device.clone(),
            cameras: Cameras::default(),
            seconds: args.stage.time,
            playing: false,
            turn: None,
            moved: BTreeMap::new(),
            pose: None,
            held: None,
            pointed_lamp: None,
            exposure: args.exposure,
            curve: Some(screen::USUAL),
            false_colour: false,
            size: Size { width: 0, height: 0 },
            panels: !args.bare,
            help: false,
            pixel: None,
            message: None,
            trouble: None,
            writing: None,
            last_move: None,
            watch: None,
            compiling: None,
            followed: None,
            followed_side: 0,
            times: bars::Times::default(),
            args: args.stage,
        };
        viewer.followed = pipeline.map(|pipeline| Followed::new(pipeline, &viewer.wake));
        if viewer.args.scene.is_named() {
            let args = viewer.args.clone();
            viewer.read(args);
        }
        if let Some(file) = args.against {
            viewer.read_picture(file);
        }
        Ok(viewer)
    }

    pub(super) fn is_reading(&self) -> bool {
        self.reading.is_some() || self.reading_picture.is_some()
    }

    /// Shows a text for some seconds.
    pub(super) fn say(&mut self, text: impl Into<String>) {
        self.message = Some((text.into(), Instant::now()));
    }

    /// Something moves: quick pictures for a moment.
    pub(super) fn moves(&mut self) {
        self.last_move = Some(Instant::now());
    }

    fn is_moving(&self) -> bool {
        self.playing || is_recent(self.last_move)
    }

    /// The camera in its place.
    pub(super) fn placed(&self) -> Option<Placed> {
        let stage = self.stage.as_ref()?;
        match (&self.fly, &self.named_camera) {
            (Some(fly), _) => Some(fly.placed()),
            (None, Some((placed, _))) => Some(placed.clone()),
            (None, None) => {
                (self.camera < stage.scene.cameras.len()).then(|| Placed::of_scene(&stage.scene, self.camera))
            }
        }
    }

    /// The camera as one that flies: the scene's camera becomes one.
    pub(super) fn flying(&mut self) -> Option<&mut Fly> {
        // A person takes the camera.
        self.cameras.land();
        if self.fly.is_none() {
            self.fly = self.as_flying();
        }
        self.fly.as_mut()
    }

    /// The camera as one that flies would see.
    pub(super) fn as_flying(&self) -> Option<Fly> {
        if let Some(fly) = &self.fly {
            return Some(fly.clone());
        }
        let (stage, pose) = (self.stage.as_ref()?, self.pose.as_ref()?);
        let placed = self.placed()?;
        let view = placed.view(pose, Size { width: 4, height: 3 });
        // The surface in the middle of the picture, else the middle of the scene.
        let size = self.size_of_side();
        let depth = self.depth_at([size.width / 2, size.height / 2]);
        let distance = depth.unwrap_or_else(|| controls::middle(stage).distance(view.position));
        Some(Fly::from_view(&view, placed.camera.projection, distance.max(0.05)))
    }

    /// The pose of the scene with moved lamps.
    fn posed(&self) -> Option<Pose> {
        let (mut pose, _) = self.stage.as_ref()?.at(self.seconds, Size { width: 4, height: 3 }).ok()?;
        lamps::apply(&mut pose, &self.moved);
        Some(pose)
    }

    /// Distance along the line of sight at a pixel, metres, if the picture has it.
    pub(super) fn depth_at(&self, [x, y]: [u32; 2]) -> Option<f32> {
        let shown = self.sides[0].shown()?;
        let layer = shown.layers.layer("depth")?;
        // A quick picture has fewer pixels than the space that it fills.
        let Size { width, height } = shown.of.size;
        let (x, y) = (x * shown.size.width / width.max(1), y * shown.size.height / height.max(1));
        let at = (y.min(shown.size.height - 1) * shown.size.width + x.min(shown.size.width - 1)) as usize;
        layer.data.get(at).copied().filter(|depth| *depth < 1e9)
    }

    pub(super) fn look(&self) -> Look {
        if self.false_colour { Look::FalseColour } else { Look::Light(self.curve) }
    }

    /// The exposure that is shown: that of the user, or the one that suits A.
    pub(super) fn ev(&self) -> f64 {
        self.exposure.or_else(|| self.sides[0].shown().map(|shown| shown.exposure)).unwrap_or(0.0)
    }

    pub(super) fn shows_both(&self) -> bool {
        self.compare != Compare::One || self.flipped
    }

    /// The size of a side's picture.
    pub(super) fn size_of_side(&self) -> Size {
        match self.compare {
            Compare::Beside => Size { width: (self.size.width / 2).max(1), height: self.size.height },
            _ => self.size,
        }
    }

    /// Asks the sides for what they are to show.
    fn ask(&mut self) {
        let (Some(stage), Some(camera)) = (self.stage.clone(), self.placed()) else { return };
        let size = self.size_of_side();
        if size.width < 8 || size.height < 8 {
            return;
        }
        let all_move = self.is_moving();
        let (both, waits, look) = (self.shows_both(), self.waits(&stage), self.look());
        if !both {
            self.sides[1].rest();
        }
        // B has the exposure of A, so that both can be compared.
        let auto =
            self.sides[0].shown().filter(|shown| Arc::ptr_eq(&shown.of.stage, &stage) && self.sides[0].is_light());
        let auto = auto.map(|shown| shown.exposure);
        for (number, side) in self.sides.iter_mut().enumerate().take(if both { 2 } else { 1 }) {
            let exposure = self.exposure.or(auto.filter(|_| number == 1));
            if number == 1 && waits {
                continue;
            }
            let wanted = Wanted {
                stage: stage.clone(),
                technique: side.technique,
                file: side.file.clone(),
                mode: side.mode.clone(),
                settings: side.settings.clone(),
                bake: side.bake.clone(),
                camera: camera.clone(),
                size,
                seconds: self.seconds,
                moved: self.moved.clone(),
                shows: side.shows.clone(),
                pictures: side.pictures,
                edges: side.has_edges(),
                samples: side.samples,
                moving: all_move || is_recent(side.last_change),
                exposure,
                look,
            };
            if let Err(error) = side.ask(wanted, &self.options, &self.wake) {
                self.trouble = Some(error.to_string());
            }
        }
    }

    /// Compares the light of both sides.
    fn measure(&mut self) -> Result<()> {
        let (Some(a), Some(b)) = (self.sides[0].shown(), self.sides[1].shown()) else { return Ok(()) };
        let changes = self.sides.iter().any(|side| is_recent(side.last_change));
        if a.size != b.size || self.is_moving() || changes {
            return Ok(());
        }
        // A picture that has exposure and curve already is compared with pictures as the screen shows them.
        let is_for_screens = |side: &Side| side.file.as_ref().is_some_and(|file| file.is_for_screens);
        let screen = self.sides.iter().any(is_for_screens);
        let of = [a.number, b.number];
        let pictured = |shown: Arc<Shown>| match screen {
            true => Pictured::Screen(shown),
            false => Pictured::Light(shown.layers.clone()),
        };
        let map = if let Compare::Map(map) = self.compare { Some(map) } else { None };
        let exposure = if screen { 0.0 } else { self.ev() };
        let measuring = match &self.measuring {
            Some(measuring) => measuring,
            None => self.measuring.insert(Measuring::start(self.wake.clone())?),
        };
        measuring.ask(Question { a: pictured(a), b: pictured(b), of, map, exposure });
        Ok(())
    }

    /// The newest numbers.
    pub(super) fn answer(&self) -> (Option<Arc<Answer>>, Option<String>) {
        self.measuring.as_ref().map(Measuring::answer).unwrap_or_default()
    }

    /// B waits for the exposure of A.
    fn waits(&self, stage: &Arc<Stage>) -> bool {
        let a = &self.sides[0];
        let failed = a.session().is_some_and(|session| session.status().1.is_some());
        let there = a.shown().is_some_and(|shown| Arc::ptr_eq(&shown.of.stage, stage));
        self.exposure.is_none() && !failed && !there
    }

    fn advance(&mut self, context: &Context) {
        let step = context.input(|input| f64::from(input.stable_dt)).min(0.25);
        if let Some(camera) = self.cameras.fly_on(step) {
            self.fly = Some(Fly::from_file(&camera));
            self.moves();
            context.request_repaint();
        }
        if self.playing {
            let end = self.stage.as_ref().map_or(0.0, |stage| controls::duration(stage));
            if end > 0.0 {
                self.seconds = (self.seconds + step) % end;
                context.request_repaint();
            } else {
                self.playing = false;
                self.say("the scene has no animation");
            }
        }
        for last in [&mut self.last_move].into_iter().chain(self.sides.iter_mut().map(|side| &mut side.last_change)) {
            match last.map(|at| REST.checked_sub(at.elapsed())) {
                Some(Some(left)) => context.request_repaint_after(left + Duration::from_millis(5)),
                Some(None) => *last = None,
                None => (),
            }
        }
        if let Some((_, at)) = &self.message {
            match MESSAGE.checked_sub(at.elapsed()) {
                Some(left) => context.request_repaint_after(left),
                None => self.message = None,
            }
        }
    }

    /// Builds the user interface of a frame.
    pub fn frame(&mut self, context: &Context) {
        self.pointed_lamp = None;
        if self.reading.is_none() && self.watch.as_ref().is_some_and(Watch::changed) {
            let args = self.newest_args();
            self.read(args);
        }
        self.take();
        self.dropped(context);
        text::keep(self);
        self.pose = self.posed();
        keys::pressed(self, context);
        self.advance(context);
        self.times.pictures(self.sides[0].shown().as_deref());
        if self.panels {
            bars::show(self, context);
            controls::panel(self, context);
        }
        picture::area(self, context);
        keys::help(self, context);
        self.written(context);
        self.ask();
        if self.shows_both()
            && let Err(error) = self.measure()
        {
            self.trouble = Some(error.to_string());
        }
    }

    pub(super) fn times(&self) -> &bars::Times {
        &self.times
    }
}
