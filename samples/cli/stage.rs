//! The scene and the camera of a run.

use std::path::{Path, PathBuf};

use glam::Mat4;
use lucerna::{
    Error, Result,
    scene::{
        Note, Pose, Scene, View,
        extent::{self, Extents},
    },
};

use crate::{
    args::{Size, finite},
    camera::{self, Choice},
    default_light::{self, DefaultLight},
    fingerprint, framing,
    lamps::{self, Lamp},
    lights::{self, Point, Sun},
    path::{self, CameraPath},
    placed::Placed,
    record::{self, Source},
    source::{self, SceneArgs},
};

/// The scene and the camera that are rendered.
#[derive(Debug)]
pub struct Stage {
    pub scene: Scene,
    pub source: Source,
    pub fingerprint: String,
    pub placed: Placed,
    pub eye: record::View,
    /// The scene has an environment of its own or of a file, which can be turned.
    pub turns: bool,
    /// The camera was added: it is fitted to the shape of the picture.
    pub added_camera: bool,
    /// Lamps that were put elsewhere: their nodes and their places in the world.
    put: Vec<(usize, Mat4)>,
    /// Default lights were added.
    pub default_light: bool,
    extents: Extents,
}

/// The options for the scene: its lights, camera, size and time.
#[derive(clap::Args, Clone, Debug)]
pub struct StageArgs {
    #[command(flatten)]
    pub scene: SceneArgs,

    /// Width and height in pixels
    #[arg(long, value_name = "WxH", default_value = "1024x768", help_heading = "Picture")]
    pub size: Size,

    /// Camera by name, by index, from a .toml file, from a list of views (LIST.toml#NAME), or at a place that looks at a point:
    /// X,Y,Z,X,Y,Z in metres, then, if wanted, the vertical angle of view in degrees and the near plane in metres; default: the scene's first camera
    #[arg(long, value_name = "NAME|INDEX|FILE|NUMBERS", allow_hyphen_values = true, help_heading = "Picture")]
    pub camera: Option<String>,

    /// Fly the camera through the views of a list (`lucerna views`, or kept in the window): from each to the next in SECONDS [default: 2]; time 0 is
    /// the first view. `render --frames` makes a sequence
    #[arg(long, value_name = "LIST.toml[,SECONDS]", conflicts_with = "camera", help_heading = "Picture")]
    pub camera_path: Option<path::Named>,

    /// Time of an animated scene, seconds; in a sequence the time of frame 0
    #[arg(long, value_name = "S", default_value_t = 0.0, value_parser = finite, allow_negative_numbers = true, help_heading = "Picture")]
    pub time: f64,

    /// Replace the scene's environment: .hdr, .exr, or a built-in environment (point, area, areas, grove, dome)
    #[arg(long, alias = "env", value_name = "FILE", help_heading = "Picture")]
    pub environment: Option<PathBuf>,

    /// Turn the environment about the vertical, degrees: positive is counter-clockwise as seen from above
    #[arg(long, value_name = "DEGREES", value_parser = finite, allow_negative_numbers = true, help_heading = "Picture")]
    pub turn: Option<f64>,

    /// Add a white point light: position in metres, intensity in W/sr; with ,X2,Y2,Z2,SECONDS it moves to the second position and back in
    /// this time; may be given more than once
    #[arg(long, value_name = "X,Y,Z,INTENSITY", allow_hyphen_values = true, help_heading = "Picture")]
    pub light: Vec<Point>,

    /// Add a white sun, and a sky if there is no environment: degrees (azimuth 0 is over +Z, 90 over +X), W/m² [default: 2]
    #[arg(long, value_name = "AZIMUTH,ELEVATION[,IRRADIANCE]", allow_hyphen_values = true, help_heading = "Picture")]
    pub sun: Option<Sun>,

    /// Move a lamp (its number or name) to X,Y,Z, metres, or turn a sun to AZIMUTH,ELEVATION, degrees (azimuth 0 is over +Z, 90 over +X). May be given
    /// more than once
    #[arg(
        long,
        value_name = "LAMP=X,Y,Z|LAMP=AZIMUTH,ELEVATION",
        allow_hyphen_values = true,
        help_heading = "Picture"
    )]
    pub put: Vec<Lamp>,

    /// When to add default lights
    #[arg(long, value_enum, default_value_t, value_name = "WHEN", help_heading = "Picture")]
    pub default_light: DefaultLight,

    /// The camera of a picture that is made again; replaces `camera`.
    #[arg(skip)]
    pub eye: Option<Eye>,
}

/// The camera from a picture's record.
#[derive(Clone, Debug)]
pub struct Eye {
    pub view: record::View,
    /// Name for files and metadata, if the scene has none.
    pub name: String,
}

impl Stage {
    /// Reads the scene, adds a missing camera and missing lights, and chooses the camera.
    ///
    /// # Errors
    /// `Input` for files that cannot be read, `Usage` for names that do not exist.
    pub fn open(args: &StageArgs) -> Result<Self> {
        let (mut scene, source) = args.scene.open_alone()?;
        if scene.name.is_empty() {
            scene.name = "scene".into();
        }
        if let Some(path) = &args.environment {
            let (environment, notes) = source::environment(path)?;
            scene.environment = Some(environment);
            scene.notes.extend(notes);
        }
        let turns = scene.environment.is_some();
        if let Some(turn) = args.turn {
            let Some(environment) = &mut scene.environment else {
                let help = "--environment gives it one; the sky that --sun adds is the same on all sides";
                return Err(Error::usage("the scene has no environment that could be turned").at("--turn").help(help));
            };
            environment.rotation += turn.to_radians() as f32;
        }
        let mut fingerprint = fingerprint::scene(&scene);
        lights::add(&mut scene, &args.light, args.sun.as_ref());
        let named_file = || {
            args.camera.as_deref().is_some_and(|asked| {
                Path::new(asked).is_file()
                    || matches!(camera::in_numbers(asked), Ok(Some(_)))
                    || camera::in_list(asked).is_some_and(|(file, _)| Path::new(file).is_file())
            })
        };
        let from_file = match &args.eye {
            Some(eye) => matches!(eye.view, record::View::File(_) | record::View::Path(_)),
            None => args.camera_path.is_some() || named_file(),
        };
        let cameras = scene.cameras.len();
        if !from_file {
            framing::add_missing_camera(&mut scene, args.size.aspect());
        }
        let added_camera = scene.cameras.len() > cameras;
        let (placed, eye) = camera(args, &scene)?;
        let pose = Pose::playing(&scene, args.time as f32);
        let view = placed.at(args.time).view(&pose, args.size);
        let lights = scene.lights.len();
        default_light::add_missing_light(&mut scene, args.default_light, Some((&pose, &view)));
        let default_light = scene.lights.len() > lights;
        // After the default lights, which may be put elsewhere, too.
        let put = lamps::put(&mut scene, &args.put)?;
        // After lights and cameras, so that both are the same with and without the added objects.
        if !args.scene.add.is_empty() {
            args.scene.add(&mut scene)?;
            fingerprint = fingerprint::scene(&scene);
        }
        let extents = Extents::of(&scene);
        Ok(Self { scene, source, fingerprint, placed, eye, turns, added_camera, put, default_light, extents })
    }

    /// Puts an added sun into the environment, for the technique `name`, which takes light from the environment only.
    pub fn light_by_environment(&mut self, name: &str) {
        if self.default_light {
            default_light::put_into_environment(&mut self.scene, name);
        }
    }

    /// Notes about the scene for the user.
    pub fn notes(&self) -> &[Note] {
        &self.scene.notes
    }

    /// The pose and the camera's view at a time, seconds.
    ///
    /// # Errors
    /// `Input` if an object is too far away at this time.
    pub fn at(&self, seconds: f64, size: Size) -> Result<(Pose, View)> {
        let mut pose = Pose::playing(&self.scene, seconds as f32);
        for (node, world) in &self.put {
            pose.world[*node] = *world;
        }
        self.extents.check(&self.scene, &pose)?;
        let view = self.placed.at(seconds).view(&pose, size);
        extent::near(view.position.abs().max_element())
            .map_err(|error| error.at(format!("camera '{}'", self.placed.name)))?;
        Ok((pose, view))
    }
}

/// The camera in its place, and how a record names it.
fn camera(args: &StageArgs, scene: &Scene) -> Result<(Placed, record::View)> {
    let flight = |name: String, path: CameraPath| (Placed::on_path(name, path.clone()), record::View::Path(path));
    let names: Vec<&str> = scene.cameras.iter().map(|camera| camera.name.as_str()).collect();
    let choice = match (&args.eye, &args.camera, &args.camera_path) {
        (Some(Eye { view: record::View::File(file), .. }), ..) => Choice::File(file.clone()),
        (Some(Eye { view: record::View::Path(path), name }), ..) => return Ok(flight(name.clone(), path.clone())),
        // An index from a record must not be interpreted as a file name.
        (Some(Eye { view: record::View::Scene(index), .. }), ..) => camera::choose(&index.to_string(), &names)?,
        (None, Some(asked), _) => camera::choose(asked, &names)?,
        (None, None, Some(path)) => {
            let read = path.read().map_err(|error| error.at("--camera-path"))?;
            return Ok(flight(name_of(&path.list), read));
        }
        (None, None, None) => Choice::Scene(first_placed(scene)),
    };
    Ok(match choice {
        Choice::Scene(index) => (Placed::of_scene(scene, index), record::View::Scene(index)),
        Choice::File(file) => {
            let name = match &args.eye {
                Some(eye) => eye.name.clone(),
                None => name_of(args.camera.as_deref().unwrap_or_default()),
            };
            (Placed::from_file(name, &file), record::View::File(file))
        }
    })
}

/// The first camera that a node carries.
fn first_placed(scene: &Scene) -> usize {
    let placed = |index: usize| scene.nodes.iter().any(|node| node.camera == Some(index as u32));
    (0..scene.cameras.len()).find(|&index| placed(index)).unwrap_or(0)
}

/// `views/left.toml` → `left`, `office.toml#office-003` → `office-003`.
fn name_of(file: &str) -> String {
    if let Some((_, view)) = camera::in_list(file) {
        return view.to_owned();
    }
    if matches!(camera::in_numbers(file), Ok(Some(_))) {
        return "view".into();
    }
    Path::new(file).file_stem().map_or_else(|| "camera".into(), |stem| stem.to_string_lossy().into_owned())
}
