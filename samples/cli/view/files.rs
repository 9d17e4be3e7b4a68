//! What comes from files and goes into them: scenes, bakes, cameras, pictures.

use std::{
    path::PathBuf,
    sync::{Arc, mpsc},
    time::Duration,
};

use egui::Context;
use lucerna::{Error, ErrorKind, scene::Pose};

use super::{
    app::{Compare, Viewer},
    controls,
    fly::Fly,
    side::FilePicture,
    watch::Watch,
};
use crate::{
    args::Size,
    placed::Placed,
    programs::suited,
    record,
    stage::{Stage, StageArgs},
};

impl Viewer {
    /// Reads a scene on a thread of its own.
    pub(super) fn read(&mut self, args: StageArgs) {
        let (sender, receiver) = mpsc::channel();
        let wake = self.wake.clone();
        let work = move || {
            let stage = Stage::open(&args);
            // The window may be closed.
            let _ = sender.send((args, stage));
            (wake.0)();
        };
        match std::thread::Builder::new().name("lucerna reads".into()).spawn(work) {
            Ok(_) => self.reading = Some(receiver),
            Err(error) => self.trouble = Some(format!("no thread could be started: {error}")),
        }
    }

    /// Takes a scene that was read.
    pub(super) fn take(&mut self) {
        let Some(reading) = &self.reading else { return };
        let (args, stage) = match reading.try_recv() {
            Ok(read) => read,
            Err(mpsc::TryRecvError::Empty) => return,
            Err(mpsc::TryRecvError::Disconnected) => {
                self.reading = None;
                return;
            }
        };
        self.reading = None;
        match stage {
            Ok(stage) => self.open(args, stage),
            // The scene before stays.
            Err(error) => self.trouble = Some(error.to_string()),
        }
    }

    fn open(&mut self, args: StageArgs, stage: Stage) {
        self.trouble = None;
        self.watch = match &stage.source {
            record::Source::File(file) => Some(Watch::start(file.into(), self.wake.clone())),
            record::Source::Builtin(_) => None,
        };
        if self.stage.as_ref().is_some_and(|before| before.source == stage.source) {
            // The same scene again: camera, time and technique stay.
            self.camera = self.camera.min(stage.scene.cameras.len().saturating_sub(1));
            self.moved.retain(|node, _| stage.scene.nodes.get(*node).is_some_and(|node| node.light.is_some()));
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
                let distance = view.position.distance(controls::middle(&stage));
                let fly = Fly::from_view(&view, placed.camera.projection, distance.max(0.05));
                self.named_camera = Some((fly.placed(), fly.numbers()));
            }
            record::View::Scene(index) => self.camera = *index,
            record::View::File(_) => {
                self.named_camera = Some((stage.placed.clone(), args.camera.clone().unwrap_or_default()));
            }
        }
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
            "gltf" | "glb" | "obj" | "bin" => {
                let mut args = StageArgs { camera: None, eye: None, ..self.args.clone() };
                (args.scene.scene, args.scene.builtin, args.scene.unit) = (Some(file), None, None);
                args.put = Vec::new();
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
            "toml" => match self.cameras.read(&file) {
                Ok(count) => self.say(format!("{count} cameras of {}", file.display())),
                Err(error) => self.trouble = Some(error.to_string()),
            },
            "hdr" if self.stage.is_some() => {
                let args = StageArgs { environment: Some(file), ..self.args.clone() };
                self.read(args);
            }
            "exr" | "png" | "pfm" | "jpg" | "jpeg" | "hdr" => {
                match lucerna::image::read(&file, &lucerna::scene::Limits::default()) {
                    Ok(layers) => {
                        self.files += 1;
                        self.say(format!("{} is side B", file.display()));
                        // Above the numbers of rendered pictures.
                        let number = (1 << 40) + self.files;
                        self.sides[1].file = Some(FilePicture { path: file, layers: Arc::new(layers), number });
                        if self.compare == Compare::One {
                            self.compare = Compare::Split;
                        }
                    }
                    Err(error) => self.trouble = Some(error.to_string()),
                }
            }
            _ => {
                let error = Error::new(ErrorKind::Input, "is no scene, bake, environment or picture that the viewer opens")
                    .in_file(&file)
                    .help("Scenes: .gltf, .glb, .obj; bakes: .day, .prt, .fiv; cameras: .toml; environments: .hdr; pictures: .exr, .png, .pfm, .jpg");
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
                self.trouble = Some(format!("the picture was not written: {status}; the terminal says why"));
                self.writing = None;
            }
            Err(error) => {
                self.trouble = Some(format!("the picture was not written: {error}"));
                self.writing = None;
            }
        }
    }
}
