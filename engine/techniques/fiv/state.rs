//! State that outlives a frame: the occluders of a scene with their vectors, and the environment on the device.

use std::sync::Arc;

use super::{
    Light, Method, Occluder, Occluders, Plan, Settings, Sky, Specular, Stored,
    fill::fill,
    hash::Hash,
    light,
    lighting::Lighting,
    negligible,
    online::Online,
    plan::Kind,
    prepared::PreparedSettings,
    sky_rotation::RotatingSky,
    specular::{self, Glossy},
    suns,
};
use crate::{
    Error, ErrorKind, Result,
    gpu::{DeviceKind, Gpu, OwnedBuffer, OwnedImage},
    graph::Runner,
    rays::Rays,
    resident::Resident,
    scene::{Environment, Material, Note, NoteKind, Pose, Scene},
    settings::idle_notes,
    shaders::consts::FIV_FLOATS,
};

/// Most occluders that the loops of a shader can process.
const MOST_OCCLUDERS: usize = 16_384;
/// Least number of pixels that the quick fingerprint of an environment contains, if the environment has so many.
const LOOKED_AT: usize = 1000;

/// A scene with the vectors of its occluders.
#[derive(Debug)]
pub struct Fiv {
    pub(super) light: Light,
    /// The environment that `light` was made from.
    sky: Sky,
    /// Resampled environments for other rotations.
    rotating_sky: RotatingSky,
    /// Irradiance of the environment without rotation and scale, for one that rotates.
    unturned: Option<Arc<OwnedImage>>,
    runner: Runner,
    /// Whether the driver ends loops early.
    pub(super) limited: bool,
    /// Whether the device is a CPU driver.
    pub(super) on_cpu: bool,
    /// Rotation and scale of the environment in `light`.
    lighting: Lighting,
    /// Rotation and scale of the environment that the vectors were computed for.
    lighting_made_for: Lighting,
    /// Fingerprint of the environment in `light`, without its rotation and scale.
    environment_now: u64,
    /// Fingerprints of the environment that the vectors were computed for: of some pixels, and of all pixels.
    environment_made_for: [u64; 2],
    /// The settings that pictures may choose.
    pub(super) prepared: PreparedSettings,
    gpu: Gpu,
    pub(super) occluders: Occluders,
    pub(super) plan: Plan,
    /// [`Plan::firsts`], which each frame needs for each occluder.
    pub(super) firsts: Vec<u64>,
    /// Vectors of all kinds, one kind after the other.
    pub(super) fivs: OwnedBuffer,
    /// Support functions of all kinds ([`super::support_function`]), one kind after the other.
    pub(super) reaches: OwnedBuffer,
    /// Shadow maps of the separated texels ([`super::suns`]).
    pub(super) maps: OwnedBuffer,
    /// Filled shares of the bounding discs of all kinds ([`super::fill`]); empty for methods without vectors.
    pub(super) fills: Vec<f32>,
    /// The pose for which the vectors were computed.
    pub(super) at_rest: Pose,
    pub(super) notes: Vec<Note>,
    /// For brute force: the acceleration structure.
    pub(super) rays: Option<Rays>,
    /// For vectors that each frame computes.
    pub(super) online: Option<Online>,
    /// For glossy reflection with shadows of occluders.
    pub(super) glossy: Option<Glossy>,
    /// The table of [`negligible`] with the rotation and scale that the table was computed for.
    matter: Option<(Lighting, OwnedBuffer)>,
}

impl Fiv {
    /// Prepares a scene for [`Fiv::picture`]. Vectors that `stored` contains are taken from there. The number and
    /// spacing of samples in `stored` replace the choices of `settings`. All other vectors are computed. `progress`
    /// receives the number of samples that are done and the number of all samples to compute. It returns whether to go
    /// on. Methods other than vectors compute nothing here.
    ///
    /// # Errors
    /// `Usage` if a setting is out of its range, if the scene has no environment, or has lights of other kinds; `Input` if `stored` is
    /// for another environment; `Runtime` if `progress` returns false, or if the scene is larger than the device's limits; `OutOfMemory`,
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
            let error = Error::usage("precomputed vectors need an environment that does not rotate").at("fiv.turning");
            return Err(error.help("Use fiv.method=online"));
        }
        let environment = only_environment(scene)?;
        let lighting = Lighting::of(environment, &settings);
        let environment_made_for = [LOOKED_AT, usize::MAX].map(|pixels| fingerprint(environment, pixels));
        let mut rotating_sky = RotatingSky::new(settings.size);
        let name = environment.name.as_str();
        let (mut runner, mut unturned) = (Runner::new(gpu), None);
        let apart = settings.apart();
        let (sky, light) = lighting.light(&mut runner, environment, (&mut rotating_sky, &mut unturned), apart)?;
        let pose = Pose::rest(scene);
        let occluders = Occluders::of(scene, &pose, settings.flat, settings.largest);
        if occluders.placed.len() > MOST_OCCLUDERS {
            let what = format!("{} occluders, at most {MOST_OCCLUDERS} can be drawn", occluders.placed.len());
            return Err(Error::new(ErrorKind::Runtime, what).at("fiv").help("Join meshes into fewer nodes"));
        }
        // Samples on surfaces that a file contains are kept for pictures that use them.
        let self_shadow = settings.self_shadow || stored.is_some_and(|stored| stored.plan.surface);
        let settings = Settings { self_shadow, ..settings };
        let mut plan = Plan::new(name, light.hash, &occluders.kinds, &settings);
        let mut notes = notes(scene, &occluders, sky.repaired, settings.specular);
        notes.extend(light::unfiltered(gpu));
        notes.extend(ignored_settings(&settings, &plan, &occluders.kinds));
        // Progress has one total: first the samples of vectors, then the samples of glossy reflection.
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
            Method::BruteForce => Some(Rays::new(gpu, scene, resident)?),
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
            unturned,
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

    /// Filled share of the bounding disc of a kind.
    pub(super) fn fill(&self, kind: u32) -> f32 {
        self.fills.get(kind as usize).copied().unwrap_or(1.0)
    }

    /// Notes on approximations and ignored settings.
    pub fn notes(&self) -> &[Note] {
        &self.notes
    }

    /// The plan of the vectors that were computed or read.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// The environment on the device.
    pub fn light(&self) -> &Light {
        &self.light
    }

    /// The occluders of the scene.
    pub fn occluders(&self) -> &Occluders {
        &self.occluders
    }

    /// Updates the environment on the device to the rotation and scale of `settings` and to the pixels that the scene
    /// has now.
    ///
    /// # Errors
    /// `Usage` if the vectors were computed for another environment, rotation or scale, or as [`Fiv::new`]; `OutOfMemory`, `DeviceLost`.
    pub(super) fn follow(&mut self, scene: &Scene, settings: &Settings) -> Result<()> {
        let environment = only_environment(scene)?;
        let by = match settings.method {
            // A frame may take a millisecond, which is too short to read all pixels of the environment.
            Method::Vectors if fingerprint(environment, LOOKED_AT) == self.environment_made_for[0] => {
                self.environment_made_for[1]
            }
            Method::Vectors => {
                let name = &environment.name;
                let error = Error::usage(format!("`{name}` is not the environment that the scene was prepared with"));
                return Err(error.at("fiv").help("Prepare the scene again (Fiv::new), or use fiv.method=online"));
            }
            _ => fingerprint(environment, usize::MAX),
        };
        let wanted = Lighting::of(environment, settings);
        if settings.method == Method::Vectors && wanted != self.lighting_made_for {
            let error = Error::usage("the vectors were computed for another rotation or scale of the environment");
            return Err(error.at("fiv").help("Prepare the scene again (Fiv::new), or use fiv.method=online"));
        }
        if by != self.environment_now {
            self.rotating_sky.forget();
            (self.matter, self.unturned) = (None, None);
        } else if wanted == self.lighting {
            return Ok(());
        }
        let kept = (&mut self.rotating_sky, &mut self.unturned);
        (self.sky, self.light) = wanted.light(&mut self.runner, environment, kept, settings.apart())?;
        (self.lighting, self.environment_now) = (wanted, by);
        Ok(())
    }

    /// The table of [`negligible`] on the device, if some occluders are to be left out.
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

    /// Bytes on the device of the vectors and of the data for glossy reflection.
    pub fn bytes(&self) -> u64 {
        self.fivs.size() + self.glossy.as_ref().map_or(0, Glossy::bytes)
    }
}

/// Appends the spacing tables of all kinds to the vectors.
fn append_spacing(plan: &Plan, fivs: &mut Vec<f32>) {
    plan.occluders.iter().for_each(|kind| fivs.extend(kind.spacing.table(&plan.grid, &kind.shells)));
}

/// The support functions of all kinds on the device.
fn reaches(gpu: &Gpu, occluders: &Occluders) -> Result<OwnedBuffer> {
    let mut all: Vec<f32> = occluders.kinds.iter().flat_map(|kind| kind.support_function().0).collect();
    all.resize(all.len().max(1), 0.0);
    OwnedBuffer::with_contents(gpu, "fiv.reaches", bytemuck::cast_slice(&all))
}

/// A hash of an environment's size and of at least `pixels` evenly spaced pixels, without its rotation and scale.
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
        let what = format!("light `{}` ({kind}) cannot be used: fiv takes light from the environment only", light.name);
        return Err(Error::usage(what).at("fiv").help("Remove it, or use another technique"));
    }
    scene.environment.as_ref().filter(|e| !e.pixels.is_empty()).ok_or_else(|| {
        let what = "the scene has no environment, and fiv takes light from the environment only";
        Error::usage(what).at("fiv").help("Name one with --environment")
    })
}

/// The vectors of all kinds: those in `stored`, and computed ones for all other kinds.
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
                "the vectors were computed for environment `{theirs}`, the scene has `{ours}` with different radiance"
            );
            return Err(Error::input(what).help("Compute them again with `fiv precompute`"));
        }
        if !stored.is_complete() {
            let (range, all) = (&stored.range, stored.plan.samples());
            let what = format!("the file contains only samples {} to {} of {all}", range.start, range.end);
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

/// Names the kinds of a scene that a file does not contain.
fn missing(plan: &Plan, stored: &Stored) -> Option<Note> {
    let known =
        |kind: &&Kind| !stored.plan.occluders.iter().any(|k| (&k.hash, k.surface) == (&kind.hash, kind.surface));
    let named: Vec<_> = plan.occluders.iter().filter(known).map(|k| format!("`{}` ({})", k.name, k.hash)).collect();
    let text = format!("the file does not contain these occluders, whose vectors were computed: {}", named.join(", "));
    (!named.is_empty()).then(|| Note { kind: NoteKind::Approximated, place: "vectors".into(), text })
}

/// Says that a file has no samples on surfaces although the settings need them.
fn lacks_surface_samples(settings: &Settings, stored: &Stored) -> Option<Note> {
    let lacks = settings.self_shadow && !stored.plan.surface && !stored.plan.occluders.is_empty();
    let text = "the file has no samples on surfaces: shadows of occluders on themselves come from the samples around them \
                (fiv.self_samples=spheres), which makes these shadows blotchy; for better shadows compute the file again \
                with fiv.self_shadow=true and fiv.self_samples=surface";
    lacks.then(|| Note { kind: NoteKind::Approximated, place: "vectors".into(), text: text.into() })
}

fn emissive(material: &Material) -> bool {
    material.emissive != glam::Vec3::ZERO && !material.unlit
}

/// Notes on settings that have no effect, and on masks that rays compute although `masks` is parallel.
fn ignored_settings(settings: &Settings, plan: &Plan, kinds: &[Occluder]) -> Vec<Note> {
    let note = |place: String, text: String| Note { kind: NoteKind::Ignored, place, text };
    let mut notes = idle_notes("fiv", settings);
    if settings.method == Method::Vectors {
        notes.extend(plan.by_rays(kinds).map(|what| note("fiv.masks".into(), what)));
    }
    notes
}

fn notes(scene: &Scene, occluders: &Occluders, repaired: u64, specular: Specular) -> Vec<Note> {
    let mut notes = Vec::new();
    let mut note = |kind, place: &str, text: String| notes.push(Note { kind, place: place.into(), text });
    if repaired > 0 {
        let text = format!(
            "{repaired} pixels of the environment are not valid radiance; they are replaced by black or by 65504"
        );
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
        let text =
            format!("{} meshes have no size at rest and cast no shadow in any pose: {}", names.len(), names.join(", "));
        note(NoteKind::Approximated, "fiv", text);
    }
    for (what, which) in [
        (
            "are visible but illuminate nothing: fiv takes light from the environment only",
            emissive as fn(&Material) -> bool,
        ),
        ("transmit no light", |m| !m.unlit && m.transmission > 0.0),
        ("reflect diffusely (fiv.specular=summed adds their glossy reflection)", |m| !m.unlit && m.metallic > 0.0),
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
