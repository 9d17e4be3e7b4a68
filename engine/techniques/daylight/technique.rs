//! Baked daylight behind the interface of all techniques.

use std::sync::Arc;

use glam::{Vec2, Vec3};

use super::{
    Added, Baked, Course, Group, PictureSettings, Reflections, Sampling, Settings, Sky, SkyLight, Stored, added,
    cube::Around,
    lamps,
    on_device::OnDevice,
    pictures::{Sources, coefficients},
    places::Places,
    probes::{self, Field},
    steps::{Mixture, Steps},
};
use crate::{
    Error, Result,
    gpu::{DeviceKind, Gpu, OwnedImage},
    graph::{Format, Graph},
    passes::{
        direct::{self, Direct, Lights},
        gbuffer, shadow, skybox,
    },
    resident::{self, Handles, Resident},
    scene::{Environment, Note, NoteKind, Scene, environment::direction_from_uv},
    settings::{Described, Description, idle_notes},
    shaders::{consts, daylight::decode, types},
    technique::{self, Making, Moment, Picture, Technique},
};

/// Columns and rows of the picture of the sky behind the scene.
const SKY: [u32; 2] = [256, 128];

/// Numbers of pixels' fetches, summed up separately so that they do not overflow.
const FETCH_SUMS: u64 = 256;
/// Pictures whose steps are read ahead of time.
const LOOK_AHEAD: u32 = 256;

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
            Self::Direct => "Direct light of the sun only, and of point and spot lamps on added objects",
            Self::Indirect => "Baked light only: the sun's after scattering, and all light of the sky and of lamps",
            Self::Irradiance => "Irradiance of the baked light, without the surfaces' colours",
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
    /// The same.
    steps: Vec<Steps>,
    light: OnDevice,
    places: Option<Places>,
    /// The first node of the objects that the bake does not know.
    added: Option<u32>,
    probes: Option<Field>,
    around: Option<Around>,
    /// The last sky, and the state that it shows.
    sky: Option<(OwnedImage, [[f32; 3]; 4])>,
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

    /// Steps that the next pictures need, the nearest first.
    fn upcoming(&self, day: usize, settings: &Settings, frame: u32) -> impl Iterator<Item = usize> {
        let at = move |ahead| self.seconds(&self.courses[day], settings, frame.checked_add(ahead)?).ok();
        let moments = (1..=LOOK_AHEAD).filter_map(at);
        let times = moments.map(move |seconds| self.steps[day].mixture(seconds, settings.interpolation));
        times.flat_map(|mixture| mixture.times().collect::<Vec<_>>())
    }

    /// The radiance of the patches of the sky.
    fn patches(&self, day: usize, settings: &Settings, sky: &Sky, sun: Vec3) -> Result<Vec<[f32; 3]>> {
        let scaled = |sky: &Sky, factor: f32| sky.patches().iter().map(|patch| patch.map(|c| c * factor)).collect();
        match settings.sky {
            SkyLight::Patches => Ok(scaled(sky, settings.strength)),
            SkyLight::None => Ok(scaled(sky, 0.0)),
            SkyLight::Scaled => {
                let plan = &self.baked.stored.plan;
                let suns = plan.times[plan.of_day(day)].iter().map(|time| time.sun);
                let Some(highest) = suns.max_by(|a, b| a[1].total_cmp(&b[1])) else {
                    return Ok(scaled(sky, 0.0));
                };
                let noon = Sky::new(settings.weather()?, highest.map(f64::from)).map_err(Error::usage)?;
                Ok(scaled(&noon, settings.strength * sun.y.max(0.0) / highest[1].max(1e-6)))
            }
        }
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
        let [up, down] = [1.0, -1.0].map(|y| sky.radiance([0.0, y, 0.0]));
        let state = [sun.to_array(), light, up, down];
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

/// Whether blocks become textures.
///
/// # Errors
/// `Usage` if that is wanted and the device cannot sample blocks.
fn as_textures(gpu: &Gpu, sampling: Sampling) -> Result<bool> {
    let caps = gpu.caps();
    match sampling {
        Sampling::Auto => Ok(caps.compressed_bc && caps.kind != DeviceKind::Cpu),
        Sampling::Decoded => Ok(false),
        Sampling::Textures if caps.compressed_bc => Ok(true),
        Sampling::Textures => {
            let error = Error::usage("this device cannot sample blocks (textureCompressionBC)").at("daylight.blocks");
            Err(error.help("Choose `auto` or `decoded`"))
        }
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

/// Light that a scene has and that is not in a bake. `added`: the bake, if there are objects that it does not know.
fn left_out(scene: &Scene, groups: &[Group], added: Option<&Stored>) -> Vec<Note> {
    let note = |place: &str, text: &str| Note { kind: NoteKind::Ignored, place: place.into(), text: text.into() };
    let mut notes = Vec::new();
    if let Some(stored) = added {
        notes.push(note("--add", "the added objects block no indirect light and reflect none to the scene"));
        if !groups.is_empty() {
            notes.push(note("--add", "the added objects cast no shadows in the light of lamps"));
            let of_tiles = stored.tiles.iter().any(|tile| tile.lamps.images() > 0);
            if of_tiles
                && !stored.probes.is_empty()
                && stored.probes.iter().all(|brick| brick.light.lamps.images() == 0)
            {
                let text = "the probes of the bake have no light of lamps, as in files of older versions";
                notes.push(note("--add", text));
            }
        }
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

    fn prepared_by(settings: &PictureSettings) -> PictureSettings {
        let daylight = Settings { blocks: settings.daylight.blocks, ..Settings::default() };
        PictureSettings { daylight, ..PictureSettings::default() }
    }

    fn upload(gpu: &Gpu, scene: &Scene) -> Result<Resident> {
        // The sky of the time replaces it.
        Resident::new(gpu, &Scene { environment: None, ..scene.clone() })
    }

    fn ready(making: Making<'_, Baked>, settings: &PictureSettings) -> Result<Self> {
        let Making { gpu, scene, baked, .. } = making;
        let Some(given) = baked else {
            let error = Error::usage("there is no baked light").at("daylight");
            return Err(error.help("Bake it with `daylight bake SCENE -o FILE.day`, and name the file with --bake"));
        };
        let baked = match given.stored.has_blocks() && !as_textures(gpu, settings.daylight.blocks)? {
            true => &Baked { stored: Arc::new(given.stored.without_blocks()), ..given.clone() },
            false => given,
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
        let steps = courses.iter().enumerate().map(|(day, course)| Steps::new(&stored.plan, day, course)).collect();
        Ok(Self {
            gpu: gpu.clone(),
            baked: baked.clone(),
            courses,
            steps,
            light: OnDevice::new(gpu, baked)?,
            places: Places::new(gpu, base, baked)?,
            added,
            probes: Field::new(gpu, stored).map_err(|error| baked.blamed(error))?,
            around: Around::new(gpu, base, &stored.plan)?,
            sky: None,
        })
    }

    fn frame(&mut self, graph: &mut Graph, moment: &Moment<'_, Mode>, settings: &PictureSettings) -> Result<Picture> {
        technique::Settings::validate(settings)?;
        let plan = &self.baked.stored.plan;
        plan.check_view(&moment.view).map_err(|error| self.baked.blamed(error))?;
        let [columns, _] = plan.tiles();
        let (side, texels) = (plan.side(), plan.extent);
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
        let patches = self.patches(day, of_day, &sky, sun)?;
        let elevation = f64::from(sun.y).clamp(-1.0, 1.0).asin().to_degrees();
        let burning = lamps::burning(of_day, &plan.lamps, course, seconds, elevation)?;
        let materials = switched(&moment.handles.material_table, &plan.lamps, &burning);
        let burning: Vec<[f32; 3]> = burning.into_iter().map(|share| [share; 3]).collect();
        let left = left_out(moment.scene, &plan.lamps, self.added.map(|_| &*self.baked.stored));
        let mixture = self.steps[day].mixture(seconds, of_day.interpolation);
        let upcoming: Vec<usize> = match self.light.has_frames() {
            true => self.upcoming(day, of_day, graph.frame).collect(),
            false => Vec::new(),
        };
        let frames = self.light.frames(graph, &mixture, upcoming.into_iter())?;
        let (mixtures, weights, alpha) = match &mixture {
            Mixture::Sum(sum) => {
                let mut weights = [0.0; 4];
                weights.iter_mut().zip(sum).for_each(|(weight, of)| *weight = of.weight);
                (vec![sum.iter().map(|of| (of.time, of.weight)).collect()], weights, 0.0)
            }
            Mixture::Logarithms { times, alpha } => (times.map(|time| vec![(time, 1.0)]).to_vec(), [1.0; 4], *alpha),
        };
        let logarithms = mixtures.len() > 1;
        let tiles = &self.baked.stored.tiles;
        let lights = Sources { sun: light, patches: &patches, lamps: &burning };
        let coefficients = coefficients(tiles, &mixtures, &lights);
        let mut handles = self.relit(graph, moment, sun, light, &sky, of_day.strength)?;
        handles.materials = graph.buffer_from("daylight.materials", &materials);
        let view = &moment.view;
        let gbuffer = gbuffer::draw(graph, &handles, view, &settings.gbuffer);
        let shadows = shadow::draw(graph, &handles, view, &settings.shadow);
        let reflects = match (self.baked.stored.plan.settings.diffuse_only, of_day.gloss) {
            (true, _) => consts::REFLECT_DIFFUSE,
            (false, true) => consts::REFLECT_GLOSS,
            (false, false) => consts::REFLECT_COLOR,
        };
        let gloss = reflects == consts::REFLECT_GLOSS;
        let choices = Direct { specular: gloss, ..Direct::default() };
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
        let second = (coefficients.len() / mixtures.len()) as u32;
        let fetches = graph.buffer("daylight.fetches", 4 * FETCH_SUMS);
        graph.fill(fetches, 0);
        let [block_hdr, block_pairs, block_blues] = self.light.pages().images(graph, gbuffer.albedo);
        let args = decode::Args {
            places: places.unwrap_or(gbuffer.depth),
            spec: decode::Spec {
                texels_of: self.around.as_ref().map_or(places.is_some().into(), |_| consts::DAY_CUBE),
                frames: if self.light.has_frames() { mixture.times().count() as u32 + 1 } else { 0 },
                logarithms: logarithms.into(),
                blocks: self.light.pages().are_there().into(),
                reflects,
            },
            view: gbuffer.view,
            normal: gbuffer.normal,
            around: self.around.as_ref().map_or(self.light.tiles(graph), |around| graph.import_buffer(around.guide())),
            albedo: gbuffer.albedo,
            depth: gbuffer.depth,
            direct: lit.direct,
            specular: gbuffer.specular,
            total,
            indirect,
            irradiance,
            tiles: self.light.tiles(graph),
            words: self.light.words(graph),
            coefficients: graph.buffer_from("daylight.coefficients", &coefficients),
            frame0: frames.buffers[0],
            frame1: frames.buffers[1],
            frame2: frames.buffers[2],
            frame3: frames.buffers[3],
            fetches,
            block_hdr,
            block_pairs,
            block_blues,
            push: decode::Push { side, columns, texels, second, alpha, sun: light, weights },
        };
        graph.compute(args, view.extent);
        let mut of_lamps = Vec::new();
        let mask = of_probes.map(|first| added::mask(graph, &handles, view, &gbuffer, first));
        if let Some(mask) = mask {
            let groups = lamps::placed(moment.scene, &self.baked.stored.plan.lamps);
            let burn = added::burning(&moment.handles.moment.lights, groups, &burning);
            if !burn.is_empty() {
                of_lamps = added::shine(
                    graph,
                    &handles,
                    burn,
                    (view, &gbuffer),
                    [mask, lit.direct],
                    (&settings.shadow, gloss),
                );
            }
        }
        let directed = gloss && of_day.reflections == Reflections::Probes;
        if let Some(field) = self.probes.as_ref().filter(|_| directed || mask.is_some()) {
            let linear = mixture.linear();
            let moment = probes::Moment { weights: &linear, sun: light, patches: &patches, lamps: &burning };
            let tiles = self.baked.stored.probes.iter().map(|brick| &brick.light);
            let light = field.decode(graph, tiles, moment);
            let pixels = probes::Pixels { mask, direct: lit.direct, total, indirect, irradiance };
            field.shine(graph, &gbuffer, view, light, &pixels, (reflects, directed));
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
        let notes = [moment.notes, &shadows.notes, &of_lamps, &left, &of_shadows].concat();
        let picture =
            Picture::new(shown).color("direct", lit.direct).color("indirect", indirect).color("irradiance", irradiance);
        let picture = picture.counting("fetches", fetches);
        let picture = match self.light.has_frames() {
            true => picture
                .number("steps_uploaded", frames.uploaded as f64)
                .number("stream_wait_ms", 1e3 * frames.waited.as_secs_f64()),
            false => picture,
        };
        Ok(picture.showing(gbuffer).drawn_with(handles).noting(notes))
    }
}
