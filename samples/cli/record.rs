//! What a picture remembers of the command that made it, enough to make it again.

use std::{ffi::OsString, path::Path};

use lucerna::{Error, Result};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::{
    args::Size,
    camera::CameraFile,
    config,
    framing::DefaultLight,
    ground::GroundOptions,
    lights::{Point, Sun},
    stage::{Stage, StageArgs},
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
    /// What the scene stands on, if it was put there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ground: Option<GroundOptions>,
    /// Changes when the scene changes.
    pub fingerprint: String,
    pub width: u32,
    pub height: u32,
    pub camera: View,
    /// First frame of the run: frames may depend on the ones before.
    pub first_frame: u32,
    pub frame: u32,
    /// Time of frame 0, seconds.
    pub time: f64,
    pub fps: f64,
    /// EV.
    pub exposure: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub environment: Option<String>,
    #[serde(default)]
    pub default_light: DefaultLight,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub light: Vec<Point>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sun: Option<Sun>,
    pub seed: u32,
    /// The image of the render graph that is shown instead of the result.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub view: Option<String>,
    /// What the picture consists of: everything, direct light, …
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mode: Option<String>,
    #[serde(default)]
    pub f32: bool,
    /// All settings of the technique, as `--print-config` prints them.
    pub settings: Value,
}

/// Where the scene came from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Source {
    File(String),
    Builtin(String),
}

/// The camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum View {
    /// Index into the scene's cameras.
    Scene(usize),
    File(CameraFile),
}

impl Record {
    /// What `args` decided, for one picture without settings; the rest is the caller's.
    pub fn new(command: &[&str], args: &StageArgs, stage: &Stage) -> Self {
        Self {
            command: command.iter().map(|&word| word.to_owned()).collect(),
            scene: stage.source.clone(),
            unit: args.scene.unit,
            ground: args.scene.ground.ground.then(|| args.scene.ground.options.clone()),
            fingerprint: stage.fingerprint.clone(),
            width: args.size.width,
            height: args.size.height,
            camera: stage.eye.clone(),
            first_frame: 0,
            frame: 0,
            time: args.time,
            fps: 30.0,
            exposure: 0.0,
            environment: args.environment.as_ref().map(|path| path.to_string_lossy().into_owned()),
            default_light: args.default_light,
            light: args.light.clone(),
            sun: args.sun,
            seed: 0,
            view: None,
            mode: None,
            f32: false,
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

    /// The command line that makes the picture again, without device and output. Files go into `folder`.
    pub fn arguments(&self, folder: &Path) -> Result<Vec<OsString>> {
        let settings = folder.join("settings.toml");
        write(&settings, &config::to_toml(&without_nulls(&self.settings))?)?;
        let mut list: Vec<OsString> = self.command.iter().skip(1).map(OsString::from).collect();
        let mut add = |words: &[&str]| list.extend(words.iter().map(OsString::from));
        match &self.scene {
            // A file name may begin with a dash.
            Source::File(path) if path.starts_with('-') => add(&[&format!("./{path}")]),
            Source::File(path) => add(&[path]),
            Source::Builtin(name) => add(&["--builtin", name]),
        }
        add(&["--size", &Size { width: self.width, height: self.height }.to_string()]);
        match &self.camera {
            View::Scene(index) => add(&["--camera", &index.to_string()]),
            View::File(camera) => {
                let path = folder.join("camera.toml");
                write(&path, &config::to_toml(camera)?)?;
                add(&["--camera", &path.to_string_lossy()]);
            }
        }
        self.light.iter().for_each(|light| add(&[&format!("--light={light}")]));
        if let Some(sun) = self.sun {
            add(&[&format!("--sun={sun}")]);
        }
        if let Some(unit) = self.unit {
            add(&[&format!("--unit={unit}")]);
        }
        if let Some(ground) = &self.ground {
            add(&["--ground"]);
            ground.arguments().iter().for_each(|option| add(&[option]));
        }
        // A reference is one picture in full precision.
        let single = self.command.get(1).is_some_and(|verb| verb == "reference");
        if !single {
            add(&["--frames", &format!("{}..={}", self.first_frame, self.frame), &format!("--fps={}", self.fps)]);
        }
        add(&[&format!("--time={}", self.time)]);
        add(&[&format!("--exposure={}", self.exposure), &format!("--seed={}", self.seed)]);
        match self.default_light {
            DefaultLight::Auto => {}
            DefaultLight::Always => add(&["--default-light=always"]),
            DefaultLight::Never => add(&["--default-light=never"]),
        }
        for (option, value) in [("environment", &self.environment), ("view", &self.view), ("mode", &self.mode)] {
            if let Some(value) = value {
                add(&[&format!("--{option}={value}")]);
            }
        }
        if self.f32 && !single {
            add(&["--f32"]);
        }
        add(&["--settings", &settings.to_string_lossy()]);
        Ok(list)
    }
}

/// TOML has no null: what is not set is left out.
fn without_nulls(value: &Value) -> Value {
    match value {
        Value::Object(table) => {
            let kept = table.iter().filter(|(_, value)| !value.is_null());
            Value::Object(kept.map(|(key, value)| (key.clone(), without_nulls(value))).collect())
        }
        other => other.clone(),
    }
}

fn write(path: &Path, text: &str) -> Result<()> {
    lucerna::image::write_atomic(path, text.as_bytes(), true)
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn comes_back_from_json_and_becomes_a_command() {
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
            fingerprint: "0".into(),
            width: 64,
            height: 48,
            camera: View::File(camera.clone()),
            first_frame: 2,
            frame: 5,
            time: -0.1,
            fps: 24.0,
            exposure: 1.5,
            environment: None,
            default_light: DefaultLight::Never,
            light: vec!["1,2,-3,4".parse().unwrap()],
            sun: Some("-10,20".parse().unwrap()),
            seed: u32::MAX,
            view: None,
            mode: Some("direct".into()),
            f32: true,
            settings: serde_json::json!({"samples": 24, "strength": 0.1, "limit": null}),
        };
        let again = Record::from_config(&serde_json::to_value(&record).unwrap()).unwrap();
        assert_eq!(again, record);
        let folder = tempfile::tempdir().unwrap();
        let list: Vec<String> =
            again.arguments(folder.path()).unwrap().into_iter().map(|a| a.into_string().unwrap()).collect();
        let all = list.join(" ");
        for part in [
            "render ./-odd.obj --size 64x48",
            "--frames 2..=5",
            "--time=-0.1",
            "--unit=0.01",
            "--ground --copies=3 --sunk=-0.2",
            "--light=1,2,-3,4",
            "--sun=-10,20,2",
            "--mode=direct",
            "--f32",
            "--default-light=never",
        ] {
            assert!(all.contains(part), "{part} is not in {all}");
        }
        assert_eq!(CameraFile::read(&folder.path().join("camera.toml")).unwrap(), camera);
        assert!(std::fs::read_to_string(folder.path().join("settings.toml")).unwrap().contains("strength = 0.1"));
    }

    #[test]
    fn a_picture_of_another_program_is_refused() {
        for config in [Value::Null, serde_json::json!({"samples": 3})] {
            assert_eq!(Record::from_config(&config).unwrap_err().exit_code(), 3);
        }
    }
}
