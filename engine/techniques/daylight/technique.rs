//! Baked daylight behind the interface of all techniques.

use std::{path::PathBuf, sync::Arc};

use glam::{Vec2, Vec3};

use super::{
    Added, Course, Group, Interpolation, Lit, NEXT_DAY, PictureSettings, Settings, Sky, Stored, added,
    cube::Around,
    lamps, lightmap,
    pictures::{coefficients, fits, packed},
    probes::{self, Field},
};
use crate::{
    Error, Result,
    gpu::{Gpu, OwnedBuffer, OwnedImage},
    graph::{Cull, Depth, Draw, DrawCall, Format, Graph, Image, Load, Raster, Targets},
    passes::{
        direct::{self, Direct, Lights},
        gbuffer::{self, GBuffer},
        shadow, skybox,
    },
    resident::{self, Handles, Resident},
    scene::{Environment, Note, NoteKind, Scene, View, environment::direction_from_uv},
    settings::{Described, Description, idle_notes},
    shaders::{
        consts,
        daylight::{decode, place},
        types,
    },
    technique::{self, Making, Moment, Picture, Technique},
};

/// Columns and rows of the picture of the sky behind the scene.
const SKY: [u32; 2] = [256, 128];

/// The light that the picture shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mode {
    #[default]
    Total,
    Direct,
    Indirect,
    Irradiance,
}

impl technique::Mode for Mode {
    const ALL: &'static [Self] = &[Self::Total, Self::Direct, Self::Indirect, Self::Irradiance];

    fn name(self) -> &'static str {
        match self {
            Self::Total => "total",
            Self::Direct => "direct",
            Self::Indirect => "indirect",
            Self::Irradiance => "irradiance",
        }
    }

    fn doc(self) -> &'static str {
        match self {
            Self::Total => "All light",
            Self::Direct => "Direct light of the sun only",
            Self::Indirect => "Baked light only: the sun's after scattering, and that of the sky",
            Self::Irradiance => "Irradiance of the baked light, without the surfaces' colours",
        }
    }
}

/// A bake, and the file from which it was read.
#[derive(Clone, Debug)]
pub struct Baked {
    pub stored: Arc<Stored>,
    /// Errors name this file.
    pub file: Option<PathBuf>,
}

impl Baked {
    /// Reads a file.
    ///
    /// # Errors
    /// As [`Stored::read`].
    pub fn read(file: impl Into<PathBuf>) -> Result<Self> {
        let file = file.into();
        Ok(Self { stored: Arc::new(Stored::read(&file)?), file: Some(file) })
    }

    fn blamed(&self, error: Error) -> Error {
        match &self.file {
            Some(file) => error.in_file(file),
            None => error,
        }
    }
}

/// Baked daylight, prepared for a scene.
#[derive(Debug)]
pub struct Daylight {
    gpu: Gpu,
    baked: Baked,
    /// One for each day of the bake.
    courses: Vec<Course>,
    tiles: OwnedBuffer,
    words: OwnedBuffer,
    places: Option<Places>,
    /// The first node of the objects that the bake does not know.
    added: Option<u32>,
    probes: Option<Field>,
    around: Option<Around>,
    /// The last sky, and the state that it shows.
    sky: Option<(OwnedImage, [f32; 7])>,
}

/// The lightmap on the device.
#[derive(Debug)]
struct Places {
    corners: OwnedBuffer,
    firsts: OwnedBuffer,
    draws: Vec<DrawCall>,
}

impl Places {
    fn new(gpu: &Gpu, scene: &Scene, baked: &Baked) -> Result<Option<Self>> {
        let corners = &baked.stored.corners;
        if corners.is_empty() {
            return Ok(None);
        }
        let triangles = lightmap::triangles(scene);
        let all: u64 = triangles.iter().map(|count| u64::from(*count)).sum();
        if all != corners.len() as u64 {
            let what = format!("has places for {} triangles, the scene has {all}", corners.len());
            return Err(baked.blamed(Error::input(what)));
        }
        let (mut firsts, mut draws, mut first) = (Vec::new(), Vec::new(), 0);
        for (number, count) in triangles.into_iter().enumerate() {
            firsts.push(first);
            draws.push(DrawCall {
                first_vertex: first,
                vertices: 3 * count,
                first_instance: number as u32,
                instances: 1,
            });
            first += 3 * count;
        }
        draws.retain(|draw| draw.vertices > 0);
        Ok(Some(Self {
            corners: OwnedBuffer::with_contents(gpu, "daylight.corners", bytemuck::cast_slice(corners))?,
            firsts: OwnedBuffer::with_contents(gpu, "daylight.firsts", bytemuck::cast_slice(&firsts))?,
            draws,
        }))
    }

    /// Draws the place in the lightmap of each pixel.
    fn draw(&self, graph: &mut Graph, handles: &Handles, view: &View, gbuffer: &GBuffer) -> Image {
        let places = graph.image("daylight.places", Format::RG32F, view.extent);
        let depth = graph.image("daylight.places.depth", Format::D32F, view.extent);
        let args = place::Args {
            view: gbuffer.view,
            instances: handles.instances,
            indices: handles.indices,
            positions: handles.positions,
            corners: graph.import_buffer(&self.corners),
            firsts: graph.import_buffer(&self.firsts),
            depth: gbuffer.depth,
        };
        let targets = Targets::new().color(places, Load::Clear([-1.0; 4])).depth(depth, Depth::Clear(0.0));
        // Sides that the G-buffer does not show are at another depth.
        graph.raster(targets, Raster::new().cull(Cull::None), args, Draw::calls(self.draws.clone()));
        places
    }
}

impl Daylight {
    /// The bake.
    pub fn stored(&self) -> &Stored {
        &self.baked.stored
    }

    /// Number of the day of the pictures.
    fn day(&self, settings: &Settings) -> Result<usize> {
        let calendar = &self.baked.stored.plan.calendar;
        if settings.date.is_empty() {
            return Ok(0);
        }
        let found = calendar.dates().position(|date| date == settings.date);
        found.filter(|_| calendar.path.is_none()).ok_or_else(|| {
            let there = match calendar.path {
                Some(_) => "a path of the sun without a date".to_owned(),
                None => calendar.dates().collect::<Vec<_>>().join(", "),
            };
            let what = format!("the date is {}, the bake has {there}", settings.date);
            self.baked.blamed(Error::usage(what)).at("daylight.date")
        })
    }

    /// Seconds of the day at a frame.
    fn seconds(&self, course: &Course, settings: &Settings, frame: u32) -> Result<f64> {
        let time = course.parse_time(&settings.time).map_err(|what| Error::usage(what).at("daylight.time"))?;
        let seconds = (time + f64::from(frame) * 60.0 * settings.minutes).rem_euclid(course.length());
        if let Some([from, until]) = self.baked.stored.plan.calendar.span
            && !(from..=until).contains(&seconds)
        {
            let [at, from, until] = [seconds, from, until].map(|seconds| course.label(seconds));
            let what = format!("frame {frame} is at {at}, the bake has light from {from} until {until}");
            return Err(self.baked.blamed(Error::usage(what)).help("Choose other times, or bake the whole day"));
        }
        Ok(seconds)
    }

    /// The weights of the baked times around a moment of a day (equations 1 to 3; x there has the offset on the wrong side).
    fn weights(&self, day: usize, seconds: f64, how: Interpolation) -> Vec<(usize, f32)> {
        let plan = &self.baked.stored.plan;
        let of_day = plan.of_day(day);
        let first = of_day.start;
        let weights = weights(&plan.times[of_day], seconds + NEXT_DAY * day as f64, how);
        weights.into_iter().map(|(time, weight)| (first + time, weight)).collect()
    }

    /// Handles of the scene under this sun and sky instead of its own.
    fn relit(
        &mut self,
        graph: &mut Graph,
        moment: &Moment<'_, Mode>,
        sun: Vec3,
        light: [f32; 3],
        sky: &Sky,
        strength: f32,
    ) -> Result<Handles> {
        let mut here = (*moment.handles.moment).clone();
        here.lights.clear();
        if light.iter().any(|light| *light > 0.0) {
            here.lights.push(self.baked.stored.plan.calendar.light(sun, light, &moment.handles.bounds()));
        }
        here.environment_scale = strength;
        here.environment_rotation = 0.0;
        let state = [sun.x, sun.y, sun.z, light[0], light[1], light[2], sky.radiance([0.0, 1.0, 0.0])[2]];
        if self.sky.as_ref().is_none_or(|(_, shown)| *shown != state) {
            let image = resident::environment(&self.gpu, Some(&picture_of(sky)), SKY[0])?;
            self.sky = Some((image, state));
        }
        let Some((image, _)) = &self.sky else { return Ok(moment.handles.clone()) };
        Ok(Handles {
            lights: graph.buffer_from("daylight.lights", &resident::lights_bytes(&here.lights)),
            environment: graph.import_image(image).repeat(),
            moment: Arc::new(here),
            ..moment.handles.clone()
        })
    }
}

/// Weights of some of `times`, in order, around a moment.
fn weights(times: &[Lit], seconds: f64, how: Interpolation) -> Vec<(usize, f32)> {
    let Some(last) = times.len().checked_sub(1) else { return Vec::new() };
    let next = times.partition_point(|time| time.seconds <= seconds);
    let [Some(before), Some(after)] = [next.checked_sub(1), (next <= last).then_some(next)] else {
        // Before the first and after the last baked time the sun is at the horizon.
        return vec![(next.min(last), 1.0)];
    };
    let step = times[after].seconds - times[before].seconds;
    let alpha = ((seconds - times[before].seconds) / step) as f32;
    match how {
        Interpolation::Nearest => vec![(if alpha < 0.5 { before } else { after }, 1.0)],
        Interpolation::CatmullRom if before > 0 && after < last => {
            let (a, a2, a3) = (alpha, alpha * alpha, alpha * alpha * alpha);
            vec![
                (before - 1, 0.5 * (-a + 2.0 * a2 - a3)),
                (before, 0.5 * (2.0 - 5.0 * a2 + 3.0 * a3)),
                (after, 0.5 * (a + 4.0 * a2 - 3.0 * a3)),
                (after + 1, 0.5 * (a3 - a2)),
            ]
        }
        Interpolation::Linear | Interpolation::CatmullRom => vec![(before, 1.0 - alpha), (after, alpha)],
    }
}

/// The sky as a picture.
fn picture_of(sky: &Sky) -> Environment {
    let [width, height] = SKY;
    let texel = |x: u32, y: u32| {
        let uv = Vec2::new((x as f32 + 0.5) / width as f32, (y as f32 + 0.5) / height as f32);
        Vec3::from(sky.radiance(direction_from_uv(uv).to_array()))
    };
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| texel(x, y))).collect();
    Environment { name: "sky".into(), width, height, pixels, rotation: 0.0, scale: 1.0 }
}

/// Materials whose lamps burn as bright as their groups do. Emissive materials in no group stay as they are.
fn switched(materials: &[types::Material], groups: &[Group], burning: &[f32]) -> Vec<types::Material> {
    let mut out = materials.to_vec();
    for (group, share) in groups.iter().zip(burning) {
        for number in &group.materials {
            if let Some(material) = out.get_mut(*number as usize) {
                material.emissive = material.emissive.map(|channel| channel * share);
            }
        }
    }
    out
}

/// Light that a scene has and that is not in a bake. `added`: there are objects that the bake does not know.
fn left_out(scene: &Scene, groups: &[Group], added: bool) -> Vec<Note> {
    let note = |place: &str, text: &str| Note { kind: NoteKind::Ignored, place: place.into(), text: text.into() };
    let mut notes = Vec::new();
    if added {
        notes.push(note("--add", "the added objects block no indirect light and reflect none to the scene"));
    }
    let off = |(number, light): (usize, &crate::scene::Light)| {
        light.intensity > 0.0 && !groups.iter().any(|group| group.lights.contains(&(number as u32)))
    };
    let off = scene.lights.iter().enumerate().filter(|light| off(*light)).count();
    if off > 0 {
        notes.push(note(
            "lights",
            &format!("{off} of the scene's own lights are off: suns, and lamps that were not baked"),
        ));
    }
    if scene.environment.is_some() {
        notes.push(note("environment", "the scene's own environment is replaced by the sky of the time"));
    }
    let idle = |(number, material): (usize, &crate::scene::Material)| {
        material.emissive != Vec3::ZERO && !groups.iter().any(|group| group.materials.contains(&(number as u32)))
    };
    if scene.materials.iter().enumerate().any(idle) {
        notes.push(note(
            "materials",
            "some emissive surfaces are shown, but they were not baked as lamps and light nothing",
        ));
    }
    notes
}

impl Technique for Daylight {
    const NAME: &'static str = "daylight";
    const ABOUT: &'static str =
        "indirect light of every time of day from a bake; layers direct, indirect, irradiance, albedo, normal, depth";
    const UNITS: &'static str = "tiles";
    const OWN_LIGHT: bool = true;

    type Settings = PictureSettings;
    type Mode = Mode;
    type Baked = Baked;

    fn description() -> &'static Description {
        Settings::description()
    }

    fn prepared_by(_: &PictureSettings) -> PictureSettings {
        PictureSettings::default()
    }

    fn upload(gpu: &Gpu, scene: &Scene) -> Result<Resident> {
        // The sky of the time replaces it.
        Resident::new(gpu, &Scene { environment: None, ..scene.clone() })
    }

    fn ready(making: Making<'_, Baked>, _: &PictureSettings) -> Result<Self> {
        let Making { gpu, scene, baked, .. } = making;
        let Some(baked) = baked else {
            let error = Error::usage("there is no baked light").at("daylight");
            return Err(error.help("Bake it with `daylight bake SCENE -o FILE.day`, and name the file with --bake"));
        };
        let stored = &baked.stored;
        let base = scene.before_added();
        let mut added = scene.added.map(|counts| counts.nodes as u32);
        if let Some(parts) = stored.plan.difference(&base) {
            // The bake may have been made with the added objects.
            if added.take().is_none() || stored.plan.difference(scene).is_some() {
                let what = format!("is the light of `{}`, and this scene has other {parts}", stored.plan.scene);
                return Err(baked.blamed(Error::input(what).help("Name the scene that was baked, or bake this one")));
            }
        }
        let base = if added.is_some() { &*base } else { scene };
        let courses = stored.plan.calendar.courses().map_err(|what| baked.blamed(Error::input(what)))?;
        let columns = |index: usize| stored.plan.tile(index as u32)[2];
        let (tiles, words) = packed(stored.tiles.iter().enumerate().map(|(index, tile)| (tile, columns(index))));
        fits(gpu, &words).map_err(|error| baked.blamed(error.help("Bake fewer texels, or use another device")))?;
        Ok(Self {
            gpu: gpu.clone(),
            baked: baked.clone(),
            courses,
            tiles: OwnedBuffer::with_contents(gpu, "daylight.tiles", bytemuck::cast_slice(&tiles))?,
            words: OwnedBuffer::with_contents(gpu, "daylight.words", bytemuck::cast_slice(&words))?,
            places: Places::new(gpu, base, baked)?,
            added,
            probes: if added.is_some() { Field::new(gpu, stored).map_err(|error| baked.blamed(error))? } else { None },
            around: Around::new(gpu, base, &stored.plan)?,
            sky: None,
        })
    }

    fn frame(&mut self, graph: &mut Graph, moment: &Moment<'_, Mode>, settings: &PictureSettings) -> Result<Picture> {
        technique::Settings::validate(settings)?;
        let plan = &self.baked.stored.plan;
        plan.check_view(&moment.view).map_err(|error| self.baked.blamed(error))?;
        let [columns, _] = plan.tiles();
        let (side, texels) = (plan.settings.tile, plan.extent);
        let of_day = &settings.daylight;
        let day = self.day(of_day)?;
        let course = &self.courses[day];
        let seconds = self.seconds(course, of_day, graph.frame)?;
        let shine = course.sun(seconds);
        let sun = Vec3::from(shine.direction);
        let sky = Sky::new(of_day.weather()?, sun.as_dvec3().to_array()).map_err(Error::usage)?;
        let clear = 1.0 - of_day.overcast as f32;
        let light = shine.irradiance.map_or(sky.sun_irradiance(), |sun| sun.map(|channel| channel * clear));
        let light = light.map(|channel| channel * of_day.strength);
        let patches: Vec<[f32; 3]> =
            sky.patches().iter().map(|patch| patch.map(|channel| channel * of_day.strength)).collect();
        let weights = self.weights(day, seconds, of_day.interpolation);
        let elevation = f64::from(sun.y).clamp(-1.0, 1.0).asin().to_degrees();
        let burning = lamps::burning(of_day, &plan.lamps, course, seconds, elevation)?;
        let materials = switched(&moment.handles.material_table, &plan.lamps, &burning);
        let burning: Vec<[f32; 3]> = burning.into_iter().map(|share| [share; 3]).collect();
        let coefficients = coefficients(self.baked.stored.tiles.iter(), &weights, light, &patches, &burning);
        let left = left_out(moment.scene, &plan.lamps, self.added.is_some());
        let mut handles = self.relit(graph, moment, sun, light, &sky, of_day.strength)?;
        handles.materials = graph.buffer_from("daylight.materials", &materials);
        let view = &moment.view;
        let gbuffer = gbuffer::draw(graph, &handles, view, &settings.gbuffer);
        let shadows = shadow::draw(graph, &handles, view, &settings.shadow);
        let choices = Direct { paper_law: false, specular: true, light_radius: 0.0, light_power: 1.0 };
        let lit = direct::light(graph, &gbuffer, Lights::from(&shadows), &choices);
        let image = |graph: &mut Graph, name: &str| graph.image(name, Format::RGBA16F, view.extent);
        let [total, indirect, irradiance] =
            ["daylight", "daylight.indirect", "daylight.irradiance"].map(|name| image(graph, name));
        let of_probes = self.added.filter(|_| of_day.added == Added::Probes);
        if of_probes.is_some() && self.probes.is_none() {
            let error = Error::input("has no probes, which light the added objects");
            return Err(self.baked.blamed(error.help(
                "Bake with -D bake.probes=2, or take the light behind the objects with -D daylight.added=screen",
            )));
        }
        // The surfaces behind the added objects.
        let behind = self.added.filter(|_| of_day.added == Added::Screen && self.places.is_some()).map(|first| {
            graph.scope("behind", |graph| {
                gbuffer::draw(graph, &added::without(&handles, first), view, &settings.gbuffer)
            })
        });
        let under = behind.as_ref().unwrap_or(&gbuffer);
        let places = self.places.as_ref().map(|places| places.draw(graph, &handles, view, under));
        let args = decode::Args {
            places: places.unwrap_or(gbuffer.depth),
            spec: decode::Spec {
                texels_of: self.around.as_ref().map_or(places.is_some().into(), |_| consts::DAY_CUBE),
            },
            view: gbuffer.view,
            normal: gbuffer.normal,
            around: graph.import_buffer(self.around.as_ref().map_or(&self.tiles, Around::guide)),
            albedo: gbuffer.albedo,
            depth: gbuffer.depth,
            direct: lit.direct,
            specular: gbuffer.specular,
            total,
            indirect,
            irradiance,
            tiles: graph.import_buffer(&self.tiles),
            words: graph.import_buffer(&self.words),
            coefficients: graph.buffer_from("daylight.coefficients", &coefficients),
            push: decode::Push { side, columns, texels },
        };
        graph.compute(args, view.extent);
        if let (Some(first), Some(field)) = (of_probes, &self.probes) {
            let mask = added::mask(graph, &handles, view, &gbuffer, first);
            let moment = probes::Moment { weights: &weights, sun: light, patches: &patches };
            let tiles = self.baked.stored.probes.iter().map(|brick| &brick.light);
            let light = field.decode(graph, tiles, moment);
            let pixels = probes::Pixels { mask, direct: lit.direct, total, indirect, irradiance };
            field.shine(graph, &gbuffer, view, light, &pixels);
        }
        skybox::draw(graph, &handles, &gbuffer, Vec3::ZERO, total);
        skybox::draw(graph, &handles, &gbuffer, Vec3::ZERO, lit.direct);
        let shown = match moment.shot.mode {
            Mode::Total => total,
            Mode::Direct => lit.direct,
            Mode::Indirect => indirect,
            Mode::Irradiance => irradiance,
        };
        let of_shadows = idle_notes("shadow", &settings.shadow);
        let notes = [moment.notes, &shadows.notes, &left, &of_shadows].concat();
        let picture =
            Picture::new(shown).color("direct", lit.direct).color("indirect", indirect).color("irradiance", irradiance);
        Ok(picture.showing(gbuffer).noting(notes))
    }
}
