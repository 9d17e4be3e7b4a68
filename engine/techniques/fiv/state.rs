//! What lives as long as a scene: its occluders with their vectors, and the environment on the device.

use super::{
    Light, Method, Occluder, Occluders, Plan, Settings, Sky, Specular, Stored,
    fill::fill,
    hash::Hash,
    light, negligible,
    online::Online,
    plan::Kind,
    prepared::PreparedSettings,
    sky_rotation::RotatingSky,
    specular::{self, Glossy},
    suns,
};
use crate::{
    Error, ErrorKind, Result,
    gpu::{DeviceKind, Gpu, OwnedBuffer},
    graph::Runner,
    rays::Rays,
    scene::{Environment, Material, Note, NoteKind, Pose, Scene, resident::Resident},
    shaders::consts::{FIV_FLOATS, TRACE_STEPS},
};

/// Turns of loops of one invocation where a driver ends loops early: two rays of the longest.
const TURNS_LIMITED: u64 = 2 * TRACE_STEPS as u64;
/// Occluders that the loops of a shader can go through.
const MOST_OCCLUDERS: usize = 16_384;
/// Pixels by which environments are progress from that of the vectors, at least, if they have so many.
const LOOKED_AT: usize = 1000;

/// A scene whose shadows come from vectors.
#[derive(Debug)]
pub struct Fiv {
    pub(super) light: Light,
    /// What it is of.
    sky: Sky,
    /// The environment for other turns.
    rotating_sky: RotatingSky,
    runner: Runner,
    /// The driver ends loops early.
    pub(super) limited: bool,
    /// The device is a CPU driver.
    pub(super) on_cpu: bool,
    /// The environment in it.
    lighting: Lighting,
    /// And that for which the vectors are.
    lighting_made_for: Lighting,
    /// Which environment `lit` is of, without its turn and factor.
    environment_now: u64,
    /// And the vectors: by some of its pixels, and by all.
    environment_made_for: [u64; 2],
    /// What pictures may choose.
    pub(super) prepared: PreparedSettings,
    gpu: Gpu,
    pub(super) occluders: Occluders,
    pub(super) plan: Plan,
    /// [`Plan::firsts`]: looked up for each occluder of each frame.
    pub(super) firsts: Vec<u64>,
    /// Vectors of all kinds, one after the other.
    pub(super) fivs: OwnedBuffer,
    /// How far all kinds reach ([`super::support_function`]), one after the other.
    pub(super) reaches: OwnedBuffer,
    /// What hides lights that are kept apart ([`super::suns`]).
    pub(super) maps: OwnedBuffer,
    /// How much of their bounding discs all kinds fill; empty where nothing asks for it.
    pub(super) fills: Vec<f32>,
    /// As everything stood when the vectors were computed.
    pub(super) at_rest: Pose,
    pub(super) notes: Vec<Note>,
    /// For brute force, with the rays of an invocation.
    pub(super) rays: Option<(Rays, u64)>,
    /// For vectors of each frame.
    pub(super) online: Option<Online>,
    /// For glossy reflection with shadows.
    pub(super) glossy: Option<Glossy>,
    /// What occluders can hide at most ([`negligible`]), with the light that this is for.
    matter: Option<(Lighting, OwnedBuffer)>,
}

/// How an environment is taken.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Lighting {
    /// Radians about +Y, with its own.
    turn: f32,
    /// Of radiance, with its own.
    factor: f32,
    /// Resampled pixel by pixel: it does not turn from picture to picture.
    still: bool,
}

impl Lighting {
    fn of(environment: &Environment, settings: &Settings) -> Self {
        let (turn, factor) = settings.light();
        let turn = environment.rotation + turn;
        // All methods have the same light, of which vectors are computed beforehand.
        let still = settings.method == Method::Vectors || settings.turning == 0.0 || turn == environment.rotation;
        Self { turn, factor: environment.scale * factor, still }
    }

    fn sky(self, rotating_sky: &mut RotatingSky, environment: &Environment) -> Result<Sky> {
        rotating_sky.sky(environment, (self.turn, self.factor), self.still)
    }
}

impl Fiv {
    /// Makes a scene ready for [`Fiv::picture`]. Vectors come from `stored` as far as it has them, with its choice of samples instead
    /// of that of `settings`; the others are computed. `progress` hears how many of the samples to compute are done, and says whether to go
    /// on; without vectors nothing is computed.
    ///
    /// # Errors
    /// `Usage` if a setting is out of its range, if the scene has no environment, or has lights of other kinds; `Input` if `stored` is
    /// for another environment; `Runtime` if progress to stop, or if the scene is larger than the device's limits; `OutOfMemory`,
    /// `DeviceLost`.
    pub fn new(
        gpu: &Gpu,
        scene: &Scene,
        resident: &Resident,
        settings: &Settings,
        stored: Option<&Stored>,
        mut progress: impl FnMut(u64, u64) -> bool,
    ) -> Result<Self> {
        settings.validate().map_err(|error| error.at("fiv"))?;
        let (given, stored) = (settings, stored.filter(|_| settings.method == Method::Vectors));
        let settings = stored.map_or_else(|| given.clone(), |stored| stored.plan.settings(given));
        settings.validate().map_err(|error| error.at("fiv"))?;
        if settings.method == Method::Vectors && settings.turning != 0.0 {
            let error = Error::usage("vectors are for an environment that stands still").at("fiv.turning");
            return Err(error.help("Use fiv.method=online"));
        }
        let environment = only_environment(scene)?;
        let lighting = Lighting::of(environment, &settings);
        let environment_made_for = [LOOKED_AT, usize::MAX].map(|pixels| fingerprint(environment, pixels));
        let mut rotating_sky = RotatingSky::new(settings.size);
        let sky = lighting.sky(&mut rotating_sky, environment)?.apart(settings.apart());
        let name = environment.name.as_str();
        let mut runner = Runner::new(gpu);
        let light = Light::with(&mut runner, &sky)?;
        let pose = Pose::rest(scene);
        let occluders = Occluders::of(scene, &pose, settings.flat, settings.largest);
        if occluders.placed.len() > MOST_OCCLUDERS {
            let what = format!("{} occluders, at most {MOST_OCCLUDERS} can be drawn", occluders.placed.len());
            return Err(Error::new(ErrorKind::Runtime, what).at("fiv").help("Join meshes into fewer nodes"));
        }
        // What a file has is kept for pictures that ask for it.
        let self_shadow = settings.self_shadow || stored.is_some_and(|stored| stored.plan.surface);
        let settings = Settings { self_shadow, ..settings };
        let mut plan = Plan::new(name, light.hash, &occluders.kinds, &settings);
        let mut notes = notes(scene, &occluders, sky.repaired, settings.specular);
        notes.extend(light::unfiltered(gpu));
        notes.extend(ignored_settings(&settings, &plan, &occluders.kinds));
        // Of one total: vectors, then what is hidden of reflections.
        let glossy = specular::needed(&settings);
        let missing = stored.map(|stored| missing(&plan, stored));
        let computed = missing.as_ref().map_or(!plan.occluders.is_empty(), Option::is_some);
        let (mut before, later) = (0, if glossy { specular::all(&plan) } else { 0 });
        if glossy {
            specular::fits(gpu, &plan, occluders.placed.len())?;
        }
        let fivs = match settings.method {
            Method::Vectors => {
                plan.fits(Some(gpu.caps().limits.storage_range))?;
                notes.extend(missing.flatten());
                notes.extend(stored.and_then(|stored| lacks_surface_samples(&settings, stored)));
                let progress = |done, all| {
                    before = all;
                    progress(done, all + later)
                };
                let mut fivs = vectors(gpu, &light, &occluders, (&mut plan, &settings), stored, progress)?;
                append_spacing(&plan, &mut fivs);
                fivs
            }
            Method::Online | Method::Unshadowed | Method::BruteForce => Vec::new(),
        };
        let glossy = match glossy {
            true => Some(Glossy::new(gpu, &sky, &plan, &occluders, |done, all| progress(before + done, before + all))?),
            false => None,
        };
        let online = match settings.method {
            Method::Online => Some(Online::new(gpu, scene, &occluders, &settings)?),
            _ => None,
        };
        let bytes = bytemuck::cast_slice::<f32, u8>(&fivs);
        let rays = match settings.method {
            Method::BruteForce => {
                let rays = Rays::new(gpu, scene, resident)?;
                let most = match gpu.loop_limit()? {
                    Some(_) => (TURNS_LIMITED / rays.most_turns().max(1)).max(1),
                    None => u64::MAX,
                };
                Some((rays, most))
            }
            _ => None,
        };
        Ok(Self {
            fivs: OwnedBuffer::with_contents(gpu, "fiv.stored", if bytes.is_empty() { &[0; 4] } else { bytes })?,
            notes,
            reaches: reaches(gpu, &occluders)?,
            fills: match settings.method {
                Method::Vectors | Method::Online => occluders.kinds.iter().map(fill).collect(),
                Method::Unshadowed | Method::BruteForce => Vec::new(),
            },
            maps: suns::maps(gpu, &light, &occluders.kinds)?,
            at_rest: pose,
            lighting,
            lighting_made_for: lighting,
            environment_now: environment_made_for[1],
            environment_made_for,
            prepared: PreparedSettings::new(given, &settings, computed),
            gpu: gpu.clone(),
            light,
            sky,
            rotating_sky,
            runner,
            limited: gpu.loop_limit()?.is_some(),
            on_cpu: gpu.caps().kind == DeviceKind::Cpu,
            occluders,
            firsts: plan.firsts(),
            plan,
            rays,
            online,
            glossy,
            matter: None,
        })
    }

    /// How much of its bounding disc a kind fills.
    pub(super) fn fill(&self, kind: u32) -> f32 {
        self.fills.get(kind as usize).copied().unwrap_or(1.0)
    }

    /// What the user should know about how the scene is drawn.
    pub fn notes(&self) -> &[Note] {
        &self.notes
    }

    /// What was computed or read.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// The environment on the device.
    pub fn light(&self) -> &Light {
        &self.light
    }

    /// What casts shadows.
    pub fn occluders(&self) -> &Occluders {
        &self.occluders
    }

    /// Takes the environment as `settings` have it turned and scaled, and as the scene has it now.
    ///
    /// # Errors
    /// `Usage` if the vectors were computed for another environment, turn or factor, or as [`Fiv::new`]; `OutOfMemory`, `DeviceLost`.
    pub(super) fn follow(&mut self, scene: &Scene, settings: &Settings) -> Result<()> {
        let environment = only_environment(scene)?;
        let by = match settings.method {
            // Of a frame that takes a millisecond the environment cannot be gone through.
            Method::Vectors if fingerprint(environment, LOOKED_AT) == self.environment_made_for[0] => {
                self.environment_made_for[1]
            }
            Method::Vectors => {
                let name = &environment.name;
                let error = Error::usage(format!("`{name}` is another environment than the scene was made ready with"));
                return Err(error.at("fiv").help("Make the scene ready again (Fiv::new), or use fiv.method=online"));
            }
            _ => fingerprint(environment, usize::MAX),
        };
        let wanted = Lighting::of(environment, settings);
        if settings.method == Method::Vectors && wanted != self.lighting_made_for {
            let error = Error::usage("the vectors were computed for another turn or scale of the environment");
            return Err(error.at("fiv").help("Make the scene ready again, or use fiv.method=online"));
        }
        if by != self.environment_now {
            self.rotating_sky.forget();
            self.matter = None;
        } else if wanted == self.lighting {
            return Ok(());
        }
        self.sky = wanted.sky(&mut self.rotating_sky, environment)?.apart(settings.apart());
        self.light = Light::with(&mut self.runner, &self.sky)?;
        (self.lighting, self.environment_now) = (wanted, by);
        Ok(())
    }

    /// What occluders can hide at most, if some of them are to be left out: a table of [`negligible`].
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`.
    pub(super) fn matter(&mut self, settings: &Settings) -> Result<Option<&OwnedBuffer>> {
        if settings.negligible <= 0.0 {
            return Ok(None);
        }
        if self.matter.as_ref().is_none_or(|(made_for, _)| *made_for != self.lighting) {
            let table = negligible::table(&self.sky);
            let buffer = OwnedBuffer::with_contents(&self.gpu, "fiv.matter", bytemuck::cast_slice(&table))?;
            self.matter = Some((self.lighting, buffer));
        }
        Ok(self.matter.as_ref().map(|(_, buffer)| buffer))
    }

    /// Bytes of the vectors on the device, with what occluders hide of reflections.
    pub fn bytes(&self) -> u64 {
        self.fivs.size() + self.glossy.as_ref().map_or(0, Glossy::bytes)
    }
}

/// Appends how the samples of all kinds lie.
fn append_spacing(plan: &Plan, fivs: &mut Vec<f32>) {
    plan.occluders.iter().for_each(|kind| fivs.extend(kind.spacing.table(&plan.grid, &kind.shells)));
}

/// The tables of all kinds on the device.
fn reaches(gpu: &Gpu, occluders: &Occluders) -> Result<OwnedBuffer> {
    let mut all: Vec<f32> = occluders.kinds.iter().flat_map(|kind| kind.support_function().0).collect();
    all.resize(all.len().max(1), 0.0);
    OwnedBuffer::with_contents(gpu, "fiv.reaches", bytemuck::cast_slice(&all))
}

/// A number by which environments are progress apart, without their turns and factors: by their sizes and so many of their pixels, at least,
/// that lie evenly.
fn fingerprint(environment: &Environment, pixels: usize) -> u64 {
    let mut hash = Hash::new();
    hash.word(u64::from(environment.width) << 32 | u64::from(environment.height));
    let each = (environment.pixels.len() / pixels).max(1);
    if each == 1 {
        hash.bytes(bytemuck::cast_slice(&environment.pixels));
    } else {
        environment.pixels.iter().step_by(each).for_each(|pixel| hash.floats(&pixel.to_array()));
    }
    hash.finish()
}

/// The environment of a scene that has no other lights.
fn only_environment(scene: &Scene) -> Result<&Environment> {
    if let Some(light) = scene.nodes.iter().find_map(|node| scene.lights.get(node.light? as usize)) {
        let kind = match light.kind {
            crate::scene::LightKind::Directional => "directional",
            crate::scene::LightKind::Point { .. } => "point",
            crate::scene::LightKind::Spot { .. } => "spot",
        };
        let what = format!("light `{}` ({kind}) cannot be served: light comes from the environment alone", light.name);
        return Err(Error::usage(what).at("fiv").help("Remove it, or use another technique"));
    }
    scene.environment.as_ref().filter(|e| !e.pixels.is_empty()).ok_or_else(|| {
        let what = "there is no environment, and light comes from it alone";
        Error::usage(what).at("fiv").help("Name one with --environment")
    })
}

/// The vectors of all kinds: stored ones, and those that are missing.
fn vectors(
    gpu: &Gpu,
    light: &Light,
    occluders: &Occluders,
    (plan, settings): (&mut Plan, &Settings),
    stored: Option<&Stored>,
    mut progress: impl FnMut(u64, u64) -> bool,
) -> Result<Vec<f32>> {
    let floats = |firsts: &[u64], kind: usize| {
        let at = |kind: usize| firsts[kind] as usize * FIV_FLOATS as usize;
        at(kind)..at(kind + 1)
    };
    let ours = plan.firsts();
    let mut fivs = vec![0f32; plan.samples() as usize * FIV_FLOATS as usize];
    let mut missing: Vec<usize> = (0..plan.occluders.len()).collect();
    if let Some(stored) = stored {
        if stored.plan.environment_hash != plan.environment_hash {
            let (theirs, ours) = (&stored.plan.environment, &plan.environment);
            let what = format!(
                "the vectors were computed for environment `{theirs}`, the scene has `{ours}` with other light"
            );
            return Err(Error::input(what).help("Compute them again with `fiv precompute`"));
        }
        if !stored.is_complete() {
            let (range, all) = (&stored.range, stored.plan.samples());
            let what = format!("only samples {} to {} of {all} are there", range.start, range.end);
            return Err(Error::input(what).help("Join all parts with `fiv merge`"));
        }
        let theirs = stored.plan.firsts();
        missing.retain(|&kind| {
            let known = |k: &Kind| k.hash == plan.occluders[kind].hash && k.surface == plan.occluders[kind].surface;
            let Some(at) = stored.plan.occluders.iter().position(known) else { return true };
            fivs[floats(&ours, kind)].copy_from_slice(&stored.fivs[floats(&theirs, at)]);
            plan.occluders[kind].shells = stored.plan.occluders[at].shells;
            plan.occluders[kind].spacing = stored.plan.occluders[at].spacing.clone();
            false
        });
    }
    if missing.is_empty() {
        return Ok(fivs);
    }
    plan.adapt(gpu, light, &occluders.kinds, settings, |kind| missing.contains(&kind))?;
    let rest = Plan { occluders: missing.iter().map(|&k| plan.occluders[k].clone()).collect(), ..plan.clone() };
    let kinds: Vec<_> = missing.iter().map(|&k| occluders.kinds[k].clone()).collect();
    let all = rest.samples();
    let rests = rest.firsts();
    let mut computed = Vec::with_capacity(all as usize * FIV_FLOATS as usize);
    rest.compute(gpu, light, &kinds, 0..all, |done, new| {
        computed.extend_from_slice(new);
        Ok(progress(done, all))
    })?;
    if (computed.len() as u64) < all * u64::from(FIV_FLOATS) {
        return Err(Error::new(ErrorKind::Runtime, "stopped while computing vectors").at("fiv"));
    }
    for (number, &kind) in missing.iter().enumerate() {
        fivs[floats(&ours, kind)].copy_from_slice(&computed[floats(&rests, number)]);
    }
    Ok(fivs)
}

/// What of a scene is not in a file of vectors.
fn missing(plan: &Plan, stored: &Stored) -> Option<Note> {
    let known =
        |kind: &&Kind| !stored.plan.occluders.iter().any(|k| (&k.hash, k.surface) == (&kind.hash, kind.surface));
    let named: Vec<_> = plan.occluders.iter().filter(known).map(|k| format!("`{}` ({})", k.name, k.hash)).collect();
    let text = format!("not in the file, and computed: {}", named.join(", "));
    (!named.is_empty()).then(|| Note { kind: NoteKind::Approximated, place: "vectors".into(), text })
}

/// That a file has nothing of what is asked for on surfaces, and what is done.
fn lacks_surface_samples(settings: &Settings, stored: &Stored) -> Option<Note> {
    let lacks = settings.self_shadow && !stored.plan.surface && !stored.plan.occluders.is_empty();
    let text = "no samples on surfaces are in the file: shadows of occluders on themselves are those of the samples around them, which \
                blotch (fiv.self_samples=spheres); for better ones compute it again with fiv.self_shadow=true and \
                fiv.self_samples=surface";
    lacks.then(|| Note { kind: NoteKind::Approximated, place: "vectors".into(), text: text.into() })
}

fn emissive(material: &Material) -> bool {
    material.emissive != glam::Vec3::ZERO && !material.unlit
}

/// What was asked for and is done otherwise, or not at all.
fn ignored_settings(settings: &Settings, plan: &Plan, kinds: &[Occluder]) -> Vec<Note> {
    let note = |place: String, text: String| Note { kind: NoteKind::Ignored, place, text };
    let idle = settings.idle().into_iter();
    let mut notes: Vec<_> =
        idle.map(|(key, why)| note(format!("fiv.{key}"), format!("changes nothing, because {why}"))).collect();
    if settings.method == Method::Vectors {
        notes.extend(plan.by_rays(kinds).map(|what| note("fiv.masks".into(), what)));
    }
    notes
}

fn notes(scene: &Scene, occluders: &Occluders, repaired: u64, specular: Specular) -> Vec<Note> {
    let mut notes = Vec::new();
    let mut note = |kind, place: &str, text: String| notes.push(Note { kind, place: place.into(), text });
    if repaired > 0 {
        let text = format!("{repaired} pixels of the environment are no radiance and count as black or as 65504");
        note(NoteKind::Repaired, "environment", text);
    }
    if !occluders.receivers.is_empty() {
        let names: Vec<_> = occluders.receivers.iter().map(|&n| scene.nodes[n as usize].name.as_str()).collect();
        let (count, names) = (names.len(), names.join(", "));
        let text = format!("{count} flat or large meshes only receive shadows (fiv.flat, fiv.largest): {names}");
        note(NoteKind::Approximated, "fiv", text);
    }
    if !occluders.vanished.is_empty() {
        let names: Vec<_> = occluders.vanished.iter().map(|&n| scene.nodes[n as usize].name.as_str()).collect();
        let text = format!("{} meshes have no size at rest and never cast shadows: {}", names.len(), names.join(", "));
        note(NoteKind::Approximated, "fiv", text);
    }
    for (what, which) in [
        ("are shown and light nothing: light comes from the environment alone", emissive as fn(&Material) -> bool),
        ("pass no light on", |m| !m.unlit && m.transmission > 0.0),
        ("reflect as if they were matt (fiv.specular=summed shows their gloss)", |m| !m.unlit && m.metallic > 0.0),
    ]
    .into_iter()
    .take(if specular == Specular::Off { 3 } else { 2 })
    {
        let named: Vec<_> = scene.materials.iter().filter(|m| which(m)).map(|m| format!("`{}`", m.name)).collect();
        if !named.is_empty() {
            note(NoteKind::Approximated, "materials", format!("{} {what}", named.join(", ")));
        }
    }
    notes
}
