//! Precomputed radiance transfer, and the path tracer under the same light.
//!
//! Both take the light of point and spot lights alone: a bake has no other. With `lamp` a single lamp takes the place of the scene's own lights.

mod baked;
mod cut;
mod truth;

use glam::Vec3;
use lucerna::{
    Error, Result,
    scene::{LightKind, Scene},
    technique::{Mode as _, Settings as _, Shot},
    techniques::prt::{Baking, Mode, PictureSettings},
    tracer,
};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use self::cut::Cut;
use super::{Job, MOST_SAMPLES, Rendered, Times, Warm, on_device, read};
use crate::{
    config,
    default_light::DefaultLight,
    experiment::file::Changes,
    lights::{self, Point},
};

/// Settings of a picture by precomputed transfer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct OfPicture {
    /// The only light, `X,Y,Z,INTENSITY`; empty: the point and spot lights of the scene.
    lamp: String,
    bake: Baking,
    /// Vectors of the bake that are used.
    cut: Cut,
    /// What the picture shows: a mode of `prt render`.
    show: String,
    picture: PictureSettings,
}

impl Default for OfPicture {
    fn default() -> Self {
        Self {
            lamp: String::new(),
            bake: Baking::default(),
            cut: Cut::default(),
            show: Mode::default().name().to_owned(),
            picture: PictureSettings::default(),
        }
    }
}

/// Settings of the path tracer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct OfTruth {
    /// As for a picture by precomputed transfer.
    lamp: String,
    /// Points on a sphere that stand for each light, as `prt.points`.
    points: u32,
    /// Radius of that sphere, metres.
    radius: f32,
    /// Paths a pixel.
    samples: u32,
    tracer: tracer::Settings,
}

impl Default for OfTruth {
    /// Diffuse surfaces, and so many scatterings that what is left out is below the noise.
    fn default() -> Self {
        let tracer = tracer::Settings {
            bounces: 32,
            diffuse_only: true,
            filter: tracer::Filter::Centre,
            sources: tracer::Sources::Punctual,
            ..tracer::Settings::default()
        };
        Self { lamp: String::new(), points: 1, radius: 0.0, samples: 64, tracer }
    }
}

impl OfTruth {
    /// The settings of precomputed transfer with these lights.
    fn lamps(&self) -> PictureSettings {
        let mut picture = PictureSettings::default();
        picture.prt.points = self.points;
        picture.prt.radius = self.radius;
        picture
    }
}

pub(super) fn picture_settings(paper: bool, changes: &Changes) -> Result<Value> {
    let mut base = OfPicture::default();
    if paper {
        base.bake = Baking::paper();
        base.picture = PictureSettings::paper().unwrap_or_default();
    }
    let settings: OfPicture = config::with(&base, changes)?;
    settings.bake.validate().map_err(|error| Error::usage(format!("bake: {error}")))?;
    settings.picture.validate()?;
    settings.cut.validate(&settings.bake)?;
    lamp_of(&settings.lamp)?;
    mode(&settings.show)?;
    config::to_value(&settings)
}

pub(super) fn truth_settings(paper: bool, changes: &Changes) -> Result<Value> {
    super::no_paper("prt-truth", paper)?;
    let settings: OfTruth = config::with(&OfTruth::default(), changes)?;
    settings.tracer.validate()?;
    settings.lamps().validate()?;
    lamp_of(&settings.lamp)?;
    match settings.samples {
        1..=MOST_SAMPLES => config::to_value(&settings),
        other => Err(Error::usage(format!("samples is {other}, allowed are 1 to {MOST_SAMPLES}"))),
    }
}

/// A picture by precomputed transfer. The bake stays in memory and in the folder of the report.
pub(super) fn picture(warm: &mut Warm<'_>, job: &Job<'_>) -> Result<Option<Rendered>> {
    let OfPicture { lamp, bake, cut, show, picture } = read(job.settings)?;
    let shot = Shot { mode: mode(&show)?, ..Shot::default() };
    let scene = lit(warm.scene, lamp_of(&lamp)?);
    let gpu = warm.gpu.clone();
    let Some(kept) = baked::of(warm, &bake)? else { return Ok(None) };
    kept.render(&gpu, (&scene, &cut), job, shot, &picture)
}

pub(super) fn truth(warm: &mut Warm<'_>, job: &Job<'_>) -> Result<Option<Rendered>> {
    truth::picture(warm, job, &read(job.settings)?)
}

/// The lamp of a setting; `None` if it is empty.
///
/// # Errors
/// `Usage` if it is no lamp.
fn lamp_of(text: &str) -> Result<Option<Point>> {
    if text.is_empty() {
        return Ok(None);
    }
    if text.split(',').count() > 4 {
        return Err(Error::usage(format!("lamp is '{text}', expected X,Y,Z,INTENSITY: pictures have no time")));
    }
    text.parse().map(Some).map_err(|what| Error::usage(format!("lamp is '{text}': {what}")))
}

fn mode(name: &str) -> Result<Mode> {
    Mode::ALL.iter().copied().find(|mode| mode.name() == name).ok_or_else(|| {
        let names: Vec<&str> = Mode::ALL.iter().map(|mode| mode.name()).collect();
        Error::usage(format!("show is '{name}', allowed are {}", names.join(", ")))
    })
}

/// The scene by the light of its point and spot lights, or by a lamp in their place.
fn lit(scene: &Scene, lamp: Option<Point>) -> Scene {
    let mut scene = Scene { environment: None, ..scene.clone() };
    scene.materials.iter_mut().for_each(|material| material.emissive = Vec3::ZERO);
    let local: Vec<bool> = scene.lights.iter().map(|light| light.kind != LightKind::Directional).collect();
    for node in &mut scene.nodes {
        node.light = node.light.filter(|light| lamp.is_none() && local.get(*light as usize) == Some(&true));
    }
    lights::light(&mut scene, lamp.as_slice(), None, DefaultLight::Never);
    scene
}

#[cfg(test)]
mod tests {
    use lucerna_scenes as builtin;
    use serde_json::json;

    use super::*;

    #[test]
    fn a_lamp_takes_the_place_of_all_lights() {
        let parlour = builtin::load("parlour").unwrap();
        let count = |scene: &Scene| scene.nodes.iter().filter(|node| node.light.is_some()).count();
        assert_eq!([count(&parlour), count(&lit(&parlour, None))], [1, 1]);
        let other = lit(&parlour, lamp_of("1,2,0.5,3").unwrap());
        assert_eq!(count(&other), 1);
        let node = other.nodes.iter().find(|node| node.light.is_some()).unwrap();
        assert_eq!(node.local.matrix().w_axis.truncate(), Vec3::new(1.0, 2.0, 0.5));
        assert_eq!(other.lights[node.light.unwrap() as usize].intensity, 3.0);
        assert!(other.materials.iter().all(|material| material.emissive == Vec3::ZERO));
    }

    #[test]
    fn wrong_settings_are_named() {
        let wrong = |settings: fn(bool, &Changes) -> Result<Value>, key: &str, value: Value, part: &str| {
            let error = settings(false, &Changes::from([(key.into(), value)])).unwrap_err().to_string();
            assert!(error.contains(part), "{error}");
        };
        wrong(picture_settings, "lamp", json!("1,2,3"), "lamp is '1,2,3'");
        wrong(picture_settings, "lamp", json!("1,2,3,4,5,6,7,8"), "no time");
        wrong(picture_settings, "show", json!("photons"), "show is 'photons', allowed are total");
        wrong(picture_settings, "bake.samples", json!(3), "samples");
        wrong(picture_settings, "cut.visibility", json!(51), "cut.visibility is 51, allowed are 0 to 50");
        wrong(picture_settings, "picture.prt.splat", json!(9), "splat");
        wrong(truth_settings, "samples", json!(0), "samples is 0");
        wrong(truth_settings, "radius", json!(-1), "radius");
        assert!(truth_settings(true, &Changes::new()).is_err());
        let paper = picture_settings(true, &Changes::new()).unwrap();
        assert_eq!((&paper["bake"]["centred"], &paper["bake"]["light"]), (&json!(true), &json!(10)));
    }
}
