//! What comes from files and goes into them: scenes, bakes, cameras, pictures.

use std::{
    io::{Read, Seek},
    path::{Path, PathBuf},
    sync::{Arc, mpsc},
    time::Duration,
};

use egui::Context;
use lucerna::{Error, ErrorKind, Result, scene::Pose};

use super::{
    app::{Compare, Viewer},
    controls, file,
    fly::Fly,
    text,
    watch::Watch,
};
use crate::{
    args::Size,
    config, lamps,
    placed::Placed,
    programs::suited,
    record,
    stage::{Stage, StageArgs},
};

/// Whether a TOML file has passes; else it has cameras.
fn is_pipeline(file: &Path) -> bool {
    let table = config::read_text(file).ok().and_then(|text| text.parse::<toml::Table>().ok());
    table.is_some_and(|table| table.contains_key("pass"))
}

/// A scene that a thread reads.
pub(super) struct Reading {
    args: StageArgs,
    watch: Option<Watch>,
    receiver: mpsc::Receiver<Result<Stage>>,
}

/// The answer of a thread, if there is one; an error if the thread has ended without an answer.
pub(super) fn answered<T>(receiver: &mpsc::Receiver<Result<T>>) -> Option<Result<T>> {
    match receiver.try_recv() {
        Ok(answer) => Some(answer),
        Err(mpsc::TryRecvError::Empty) => None,
        Err(mpsc::TryRecvError::Disconnected) => {
            Some(Err(Error::new(ErrorKind::Runtime, "the file could not be read: its thread has ended")))
        }
    }
}

impl Viewer {
    /// The options of the scene that is read now, else of the scene that is shown.
    pub(super) fn newest_args(&self) -> StageArgs {
        self.reading.as_ref().map_or(&self.args, |reading| &reading.args).clone()
    }

    /// Reads a scene on a thread of its own. A scene that is being read is dropped.
    pub(super) fn read(&mut self, args: StageArgs) {
        // From before the reading, so that no change of the file is missed.
        let land = || args.scene.terrain.as_ref().map(|terrain| terrain.file().to_owned());
        let watch = args.scene.scene.clone().or_else(land).map(|file| Watch::start(file, self.wake.clone()));
        let of_thread = args.clone();
        let read = self.on_thread(move || Stage::open(&of_thread));
        self.reading = read.map(|receiver| Reading { args, watch, receiver });
    }

    /// Reads a picture on a thread of its own, for side B.
    pub(super) fn read_picture(&mut self, path: PathBuf) {
        self.reading_picture = self.on_thread(move || file::read(&path));
    }

    /// Runs some work on a thread of its own, which wakes the window at its end.
    pub(super) fn on_thread<T: Send + 'static>(
        &mut self,
        work: impl FnOnce() -> Result<T> + Send + 'static,
    ) -> Option<mpsc::Receiver<Result<T>>> {
        let (sender, receiver) = mpsc::channel();
        let wake = self.wake.clone();
        let work = move || {
            // The window may be closed.
            let _ = sender.send(work());
            (wake.0)();
        };
        match std::thread::Builder::new().name("lucerna reads".into()).spawn(work) {
            Ok(_) => Some(receiver),
            Err(error) => {
                self.trouble = Some(format!("no thread could be started: {error}"));
                None
            }
        }
    }

    /// Takes a scene and a picture that were read.
    pub(super) fn take(&mut self) {
        if let Some(stage) = self.reading.as_ref().and_then(|reading| answered(&reading.receiver))
            && let Some(Reading { args, watch, .. }) = self.reading.take()
        {
            self.watch = watch;
            match stage {
                Ok(stage) => self.open(args, stage),
                // The scene before stays.
                Err(error) => self.trouble = Some(error.to_string()),
            }
        }
        if let Some(picture) = self.reading_picture.as_ref().and_then(answered) {
            self.reading_picture = None;
            match picture {
                Ok(picture) => {
                    self.say(format!("{} is side B", picture.path.display()));
                    self.sides[1].file = Some(picture);
                    if self.compare == Compare::One {
                        self.compare = Compare::Split;
                    }
                }
                Err(error) => self.trouble = Some(error.to_string()),
            }
        }
    }

    fn open(&mut self, args: StageArgs, stage: Stage) {
        self.trouble = None;
        if let Some(before) = self.stage.clone().filter(|before| before.source == stage.source) {
            // The same scene again: camera, time and technique stay, and lamps that are the same ones.
            self.camera = self.camera.min(stage.scene.cameras.len().saturating_sub(1));
            let (old, new) = (&before.scene, &stage.scene);
            let nodes = lamps::nodes(new);
            let same = |node: usize| {
                nodes.contains(&node)
                    && lamps::name(old, node) == lamps::name(new, node)
                    && lamps::is_sun(old, node) == lamps::is_sun(new, node)
            };
            self.moved.retain(|node, _| same(*node));
            (self.args, self.stage) = (args, Some(Arc::new(stage)));
            self.say("the scene was read again");
            return;
        }
        if !self.named && !self.sides[0].about.baked {
            let (technique, why) = suited::by_name(&stage);
            self.sides[0].start_with(technique);
            self.say(format!("{technique}, because {why}"));
        }
        (self.fly, self.camera, self.named_camera) = (None, 0, None);
        match &stage.eye {
            record::View::Scene(index) if stage.added_camera => {
                // A camera that the program adds is fitted to the shape of a picture. This one stays as it is, whatever the window becomes.
                let placed = Placed::of_scene(&stage.scene, *index);
                let view = placed.view(&Pose::playing(&stage.scene, 0.0), Size { width: 4, height: 3 });
                let distance = controls::middle(&stage).distance(view.position);
                let fly = Fly::from_view(&view, placed.camera.projection, distance.max(0.05));
                self.named_camera = Some((fly.placed(), fly.numbers()));
            }
            record::View::Scene(index) => self.camera = *index,
            record::View::File(_) => {
                self.named_camera = Some((stage.placed.clone(), args.camera.clone().unwrap_or_default()));
            }
            record::View::Path(path) => {
                self.cameras.keep_path(path);
                // For R, in a scene that has no camera.
                let fly = Fly::from_file(&path.at(args.time));
                self.named_camera = Some((fly.placed(), fly.numbers()));
            }
        }
        self.cameras.land();
        self.moved.clear();
        self.held = None;
        self.seconds = args.time;
        self.args = args;
        self.stage = Some(Arc::new(stage));
    }

    /// Files that were dropped on the window.
    pub(super) fn dropped(&mut self, context: &Context) {
        let files: Vec<PathBuf> =
            context.input(|input| input.raw.dropped_files.iter().filter_map(|file| file.path.clone()).collect());
        for file in files {
            self.open_file(file);
        }
    }

    /// Opens a scene, a bake, an environment or a picture, by what the file is.
    pub(super) fn open_file(&mut self, file: PathBuf) {
        let extension = file.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
        match extension.as_str() {
            "gltf" | "glb" | "obj" | "zip" => {
                let mut args = StageArgs { camera: None, camera_path: None, eye: None, ..self.newest_args() };
                (args.scene.scene, args.scene.builtin, args.scene.unit) = (Some(file), None, None);
                args.put = Vec::new();
                args.scene.terrain = None;
                // An environment of the command line stays, and one that was dropped.
                args.turn = args.turn.filter(|_| args.environment.is_some());
                (args.scene.add, args.scene.set, args.light, args.sun) = (Vec::new(), Vec::new(), Vec::new(), None);
                self.read(args);
            }
            "day" | "prt" | "fiv" => {
                let technique = match extension.as_str() {
                    "day" => "daylight",
                    "prt" => "prt",
                    _ => "fiv",
                };
                self.sides[0].start_with(technique);
                self.sides[0].bake = Some(file);
                self.named = true;
            }
            "toml" if is_pipeline(&file) => text::follow(self, file),
            "toml" => match self.cameras.read(&file) {
                Ok(count) => self.say(format!("{count} cameras of {}", file.display())),
                Err(error) => self.trouble = Some(error.to_string()),
            },
            "hdr" if self.stage.is_some() || self.reading.is_some() => {
                let args = StageArgs { environment: Some(file), ..self.newest_args() };
                self.read(args);
            }
            "exr" | "png" | "pfm" | "jpg" | "jpeg" | "hdr" => self.read_picture(file),
            _ => {
                let error = Error::new(ErrorKind::Input, "is no scene, bake, environment or picture that the viewer opens")
                    .in_file(&file)
                    .help("Scenes: .gltf, .glb, .obj, .zip; bakes: .day, .prt, .fiv; cameras and pipelines: .toml; environments: .hdr; pictures: .exr, .png, .pfm, .jpg");
                self.trouble = Some(error.to_string());
            }
        }
    }

    /// Looks after a picture that another process writes.
    pub(super) fn written(&mut self, context: &Context) {
        let Some(writing) = &mut self.writing else { return };
        match writing.child.try_wait() {
            Ok(None) => context.request_repaint_after(Duration::from_millis(100)),
            Ok(Some(status)) if status.success() => {
                let text = format!("wrote {}", writing.file.display());
                self.writing = None;
                self.say(text);
            }
            Ok(Some(status)) => {
                let mut said = String::new();
                // Without an answer the status says enough.
                let _ = writing.said.rewind().and_then(|()| (&writing.said).take(1 << 16).read_to_string(&mut said));
                let why = said.lines().last().map_or_else(|| status.to_string(), str::to_owned);
                self.trouble = Some(format!("the picture was not written: {why}"));
                self.writing = None;
            }
            Err(error) => {
                self.trouble = Some(format!("the picture was not written: {error}"));
                self.writing = None;
            }
        }
    }
}
