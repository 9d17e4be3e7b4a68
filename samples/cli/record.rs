//! The record of the command that made a picture. The picture's metadata holds it, and `lucerna rerun` makes the picture again from it.

use std::path::{Path, PathBuf};

use lucerna::{Error, Result, bake::Digest, passes::temporal, technique::Bake, techniques::tonemap::Operator};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::{
    added::Added,
    args::{Frames, MAX_FRAMES, MAX_SIDE, RenderArgs, Size},
    camera::CameraFile,
    changed::Change,
    config::SettingsArgs,
    default_light::DefaultLight,
    effects,
    ground::{GroundArgs, GroundOptions},
    lamps::Lamp,
    lights::{Point, Sun},
    path::CameraPath,
    progress::ProgressMode,
    render::Again,
    screen::{self, ScreenArgs},
    smooth::{MOST, Smooth},
    source::{self, SceneArgs},
    stage::{Eye, Stage, StageArgs},
    terrain::Terrain,
};

/// The `config` of a picture's metadata.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Executable and verb: `isr render`.
    pub command: Vec<String>,
    pub scene: Source,
    /// Metres of one unit of the scene file, if it was given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<f64>,
    /// The options of `--ground`, if it was given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ground: Option<GroundOptions>,
    /// The added objects.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub add: Vec<Added>,
    /// The land around the scene.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub terrain: Option<Terrain>,
    /// The changed materials.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub set: Vec<Change>,
    /// Hash of the scene ([`crate::fingerprint::scene`]).
    pub fingerprint: String,
    pub width: u32,
    pub height: u32,
    pub camera: View,
    /// First frame of the run, because a frame may depend on the frames before it.
    pub first_frame: u32,
    pub frame: u32,
    /// Time of frame 0, seconds.
    pub time: f64,
    pub fps: f64,
    /// EV.
    pub exposure: f64,
    /// The curve of .png and .jpg files; `None`: they show the light as it is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub operator: Option<Operator>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub environment: Option<String>,
    /// Degrees by which the environment is turned.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub turn: Option<f64>,
    #[serde(default)]
    pub default_light: DefaultLight,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub light: Vec<Point>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sun: Option<Sun>,
    /// Lamps that were put elsewhere.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub put: Vec<Lamp>,
    pub seed: u32,
    #[serde(default, skip_serializing_if = "Smooth::is_none")]
    pub aa: Smooth,
    /// Layers that anti-aliasing leaves as they are at the middles of the pixels.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub exact: Vec<String>,
    /// The image of the render graph that was written instead of the result (`--view`).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub view: Option<String>,
    /// The value of `--mode`: all light, direct light, …
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mode: Option<String>,
    #[serde(default)]
    pub f32: bool,
    /// The file of a bake, without which the picture cannot be made.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bake: Option<BakeFile>,
    /// All settings of the technique, as `--print-config` prints them.
    pub settings: Value,
}

/// The file of a bake.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BakeFile {
    pub file: String,
    /// Of its contents.
    pub digest: Digest,
}

impl BakeFile {
    /// What the pictures of a bake say about it. `None`: they can be made without it.
    pub fn of(baked: &impl Bake) -> Option<Self> {
        let (file, digest) = baked.source()?;
        Some(Self { file: file.to_string_lossy().into_owned(), digest })
    }

    /// Reads the file.
    ///
    /// # Errors
    /// `Input`, naming the file, if it cannot be read or is another bake.
    pub fn read<B: Bake>(&self) -> Result<B> {
        let baked = B::read(Path::new(&self.file))?;
        match baked.source() {
            Some((_, digest)) if digest != self.digest => {
                let what =
                    format!("has the digest {digest}; the picture was made with a bake of digest {}", self.digest);
                let error = Error::input(what).in_file(&self.file);
                Err(error.help("Put the bake of the picture there, or bake it again with the same options"))
            }
            _ => Ok(baked),
        }
    }
}

/// The source of the scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Source {
    File(String),
    Builtin(String),
    /// Nothing but the terrain.
    Terrain,
}

/// The camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum View {
    /// Index into the scene's cameras.
    Scene(usize),
    File(CameraFile),
    /// A flight, with all its views.
    Path(CameraPath),
}

impl Record {
    /// A record of the options `args`, for one picture without settings. The caller fills in the other fields.
    pub fn new(command: &[&str], args: &StageArgs, stage: &Stage) -> Self {
        Self {
            command: command.iter().map(|&word| word.to_owned()).collect(),
            scene: stage.source.clone(),
            unit: args.scene.unit,
            ground: args.scene.ground.ground.then(|| args.scene.ground.options.clone()),
            add: args.scene.add.clone(),
            terrain: args.scene.terrain.clone(),
            set: args.scene.set.clone(),
            fingerprint: stage.fingerprint.clone(),
            width: args.size.width,
            height: args.size.height,
            camera: stage.eye.clone(),
            first_frame: 0,
            frame: 0,
            time: args.time,
            fps: 30.0,
            exposure: 0.0,
            operator: None,
            environment: args.environment.as_ref().map(|path| path.to_string_lossy().into_owned()),
            turn: args.turn,
            default_light: args.default_light,
            light: args.light.clone(),
            sun: args.sun,
            put: args.put.clone(),
            seed: 0,
            aa: Smooth::default(),
            exact: Vec::new(),
            view: None,
            mode: None,
            f32: false,
            bake: None,
            settings: Value::Null,
        }
    }

    /// From the metadata of a picture.
    ///
    /// # Errors
    /// `Input` if the picture was not written by `render`.
    pub fn from_config(config: &Value) -> Result<Self> {
        let missing = || Error::input("does not say how it was made").help("Pictures written by `render` do");
        if config.is_null() {
            return Err(missing());
        }
        serde_json::from_value(config.clone()).map_err(|error| missing().caused_by(error))
    }

    /// The options for scene and camera. `camera`: name of the camera, if the scene has no name for it.
    ///
    /// # Errors
    /// `Input` for numbers that the command line would reject as well.
    pub fn stage_args(&self, camera: &str) -> Result<StageArgs> {
        let wrong = |key: &str, found: String, allowed: &str| {
            Err(Error::input(format!("{found} is not allowed; allowed: {allowed}")).at(key))
        };
        for (key, value) in [("width", self.width), ("height", self.height)] {
            if !(1..=MAX_SIDE).contains(&value) {
                return wrong(key, value.to_string(), &format!("1 to {MAX_SIDE}"));
            }
        }
        for (key, value) in [("unit", self.unit), ("fps", Some(self.fps))] {
            if let Some(value) = value.filter(|value| !(value.is_finite() && *value > 0.0)) {
                return wrong(key, value.to_string(), "numbers above 0");
            }
        }
        if !(1..=MOST).contains(&self.aa.count) {
            return wrong("aa.count", self.aa.count.to_string(), &format!("1 to {MOST}"));
        }
        if let Some(frames) =
            self.aa.temporal.filter(|frames| self.aa.count > 1 || !(1..=temporal::MOST).contains(frames))
        {
            let allowed = format!("1 to {}, with one picture a frame", temporal::MOST);
            return wrong("aa.temporal", frames.to_string(), &allowed);
        }
        if self.aa.edges && (self.aa.count > 1 || self.aa.temporal.is_some()) {
            return wrong("aa.edges", "true".into(), "true with one picture a frame that is not averaged over time");
        }
        for (key, value) in [("time", self.time), ("exposure", self.exposure)] {
            if !value.is_finite() {
                return wrong(key, value.to_string(), "finite numbers");
            }
        }
        if let View::File(camera) = &self.camera {
            camera.check().map_err(|what| Error::input(what).at("camera"))?;
        }
        if let View::Path(path) = &self.camera {
            path.check().map_err(|what| Error::input(what).at("camera"))?;
        }
        let (scene, builtin) = match &self.scene {
            Source::File(path) => (Some(PathBuf::from(path)), None),
            Source::Builtin(name) => (None, Some(name.clone())),
            Source::Terrain => (None, None),
        };
        let ground = GroundArgs { ground: self.ground.is_some(), options: self.ground.clone().unwrap_or_default() };
        Ok(StageArgs {
            scene: SceneArgs {
                scene,
                builtin,
                unit: self.unit,
                add: self.add.clone(),
                set: self.set.clone(),
                terrain: self.terrain.clone(),
                ground,
            },
            size: Size { width: self.width, height: self.height },
            camera: None,
            camera_path: None,
            time: self.time,
            environment: self.environment.as_ref().map(PathBuf::from),
            turn: self.turn,
            light: self.light.clone(),
            sun: self.sun,
            put: self.put.clone(),
            default_light: self.default_light,
            eye: Some(Eye { view: self.camera.clone(), name: camera.to_owned() }),
        })
    }

    /// The options of `render` for the frames up to this one. They do not write any file.
    ///
    /// # Errors
    /// As [`Self::stage_args`]; `Input` if the frame is before the first one.
    pub fn render_args(&self, asked: &Again<'_>) -> Result<RenderArgs> {
        let (first, last) = (self.first_frame, self.frame);
        let end = last.checked_add(1).filter(|end| first <= last && end - first <= MAX_FRAMES).ok_or_else(|| {
            let allowed = format!("A to B with A <= B < {}, and at most {MAX_FRAMES}", u32::MAX);
            Error::input(format!("frames {first} to {last} are not allowed; allowed: {allowed}")).at("frame")
        })?;
        Ok(RenderArgs {
            stage: self.stage_args(asked.camera)?,
            output: Vec::new(),
            overwrite: false,
            f32: self.f32,
            view: self.view.clone(),
            dump: None,
            timings: None,
            repeat: 1,
            list_passes: false,
            json: false,
            frames: Some(Frames(first..end)),
            fps: self.fps,
            time_limit: None,
            exposure: Some(self.exposure),
            screen: self.screen_args()?,
            smooth: self.aa.args(),
            seed: self.seed,
            settings: SettingsArgs::default(),
            paper: false,
            device: asked.device.clone(),
            talk: asked.talk.clone(),
            progress: ProgressMode::default(),
        })
    }

    /// The options for files for screens.
    ///
    /// # Errors
    /// `Input` for operators that are no curves.
    pub fn screen_args(&self) -> Result<ScreenArgs> {
        let operator = self.operator.unwrap_or(Operator::Linear);
        if screen::named(operator.name()).is_none() {
            return Err(Error::input(format!("{} is no curve", operator.name())).at("operator"));
        }
        Ok(ScreenArgs { operator: Some(operator) })
    }

    /// The files that are read to make the picture again, as text for messages.
    pub fn files(&self) -> Vec<String> {
        let mut list = Vec::new();
        if let Source::File(path) = &self.scene {
            list.push(format!("{path:?}, and the files in its folder that it refers to"));
        }
        list.extend(
            self.ground
                .iter()
                .flat_map(GroundOptions::files)
                .map(|path| format!("{path:?}, and the files in its folder that it refers to")),
        );
        list.extend(
            self.add
                .iter()
                .filter_map(Added::file)
                .map(|path| format!("{path:?}, and the files in its folder that it refers to")),
        );
        list.extend(self.terrain.iter().map(|terrain| format!("{:?}", terrain.file())));
        let pipeline = self.settings.get(effects::GROUP).and_then(|group| group.get("pipeline")?.as_str());
        list.extend(pipeline.map(|path| format!("{path:?}, and the shaders in its folder that it refers to")));
        let environment = self.environment.as_deref().map(Path::new);
        list.extend(self.bake.iter().map(|bake| format!("{:?}", bake.file)));
        list.extend(environment.filter(|path| !source::is_built_in_environment(path)).map(|path| format!("{path:?}")));
        list
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use lucerna::image::Format;

    use super::*;
    use crate::{
        args::{DeviceArgs, TalkArgs},
        signals::Interrupt,
        smooth::{Aa, Filter},
    };

    #[test]
    fn comes_back_from_json_and_becomes_options() {
        let camera = CameraFile {
            position: Vec3::new(0.1, 1.6, 4.0),
            target: Vec3::ZERO,
            up: Vec3::Y,
            yfov_degrees: 45.0,
            znear: 0.05,
            zfar: None,
        };
        let record = Record {
            command: vec!["isr".into(), "render".into()],
            scene: Source::File("-odd.obj".into()),
            unit: Some(0.01),
            ground: Some(GroundOptions { copies: Some(3), sunk: Some(-0.2), ..GroundOptions::default() }),
            add: vec!["pot.glb@0,1,2".parse().unwrap()],
            terrain: Some("hills.png@20,3".parse().unwrap()),
            set: vec!["wall.albedo=0.5,0.25,1".parse().unwrap()],
            turn: Some(-30.5),
            put: vec!["0=1,2,3".parse().unwrap()],
            fingerprint: "0".into(),
            width: 64,
            height: 48,
            camera: View::File(camera.clone()),
            first_frame: 2,
            frame: 5,
            time: -0.1,
            fps: 24.0,
            exposure: 1.5,
            operator: Some(Operator::Neutral),
            environment: None,
            default_light: DefaultLight::Never,
            light: vec!["1,2,-3,4".parse().unwrap()],
            sun: Some("-10,20".parse().unwrap()),
            seed: u32::MAX,
            aa: Smooth { count: 4, ..Smooth::default() },
            exact: vec!["depth".into()],
            view: None,
            mode: Some("direct".into()),
            f32: true,
            bake: Some(BakeFile { file: "-odd.day".into(), digest: Digest::of(b"odd") }),
            settings: serde_json::json!({"samples": 24, "strength": 0.1, "limit": null}),
        };
        let again = Record::from_config(&serde_json::to_value(&record).unwrap()).unwrap();
        assert_eq!(again, record);
        let asked = Again {
            record: &again,
            camera: "left",
            format: Format::Png,
            device: &DeviceArgs::default(),
            talk: &TalkArgs::default(),
            long: false,
            interrupt: &Interrupt::default(),
        };
        let args = again.render_args(&asked).unwrap();
        assert_eq!(args.stage.scene.scene, Some("-odd.obj".into()));
        assert_eq!((args.stage.size.to_string(), args.frames), ("64x48".into(), Some(Frames(2..6))));
        assert_eq!((args.stage.scene.unit, args.stage.time, args.fps, args.f32), (Some(0.01), -0.1, 24.0, true));
        assert_eq!(args.stage.scene.ground.options, again.ground.clone().unwrap());
        assert!(args.stage.scene.ground.ground && args.stage.light == again.light && args.stage.sun == again.sun);
        assert_eq!((args.smooth.aa, args.smooth.filter), (Some(Aa::Mean(4)), Filter::Box));
        assert_eq!((args.exposure, args.seed, args.stage.default_light), (Some(1.5), u32::MAX, DefaultLight::Never));
        // No option may write a file, or read a file that the record does not name.
        assert!(args.output.is_empty() && args.dump.is_none() && args.timings.is_none() && args.stage.camera.is_none());
        assert!(args.settings.file.is_none() && !args.overwrite && !args.json);
        let with_folder = |name: &str| format!("{name:?}, and the files in its folder that it refers to");
        assert_eq!(
            again.files(),
            [with_folder("-odd.obj"), with_folder("pot.glb"), "\"hills.png\"".to_owned(), "\"-odd.day\"".to_owned()]
        );
        assert_eq!(args.stage.scene.terrain, again.terrain);
        assert_eq!((args.stage.scene.add, args.stage.scene.set), (again.add.clone(), again.set.clone()));
        for (odd, place) in [
            (Record { width: 0, ..record.clone() }, "width"),
            (Record { height: MAX_SIDE + 1, ..record.clone() }, "height"),
            (Record { fps: 0.0, ..record.clone() }, "fps"),
            (Record { aa: Smooth { count: 0, ..Smooth::default() }, ..record.clone() }, "aa.count"),
            (Record { aa: Smooth { temporal: Some(8), ..record.aa }, ..record.clone() }, "aa.temporal"),
            (Record { aa: Smooth { temporal: Some(0), ..Smooth::default() }, ..record.clone() }, "aa.temporal"),
            (Record { aa: Smooth { edges: true, ..record.aa }, ..record.clone() }, "aa.edges"),
            (Record { unit: Some(-1.0), ..record.clone() }, "unit"),
            (Record { frame: 1, ..record.clone() }, "frame"),
            (Record { frame: u32::MAX, ..record.clone() }, "frame"),
            (Record { camera: View::File(CameraFile { target: camera.position, ..camera }), ..record }, "camera"),
        ] {
            let error = odd.render_args(&asked).unwrap_err();
            assert_eq!((error.exit_code(), error.place()), (3, Some(place)));
        }
    }

    #[test]
    fn a_picture_of_another_program_is_refused() {
        for config in [Value::Null, serde_json::json!({"samples": 3})] {
            assert_eq!(Record::from_config(&config).unwrap_err().exit_code(), 3);
        }
    }
}
