//! The light of a tile for all times of the day, by paths that all times share (`shaders-glsl/daylight`).
//!
//! A path starts at a texel and ends in the sky or after some scatterings. Its vertices do not depend on the time, so each vertex sends one
//! shadow ray to each position of the sun, or reads its visibility from a mask ([`super::masks`]). A day costs one set of paths and many
//! shadow rays, instead of a set of paths for each time. Russian roulette decides whether the shadow rays of late vertices, and of surfaces
//! that the sun grazes, are sent. Where the triangle that hid the sun at one time hides it at the next time too, no ray is sent.
//! Light is linear in the sun, so the sun is white and has an irradiance of 1 W/m² at normal incidence.

use super::{
    Baking, Group, Kind, Plan,
    adaptive::{Adaptive, SPARSE_PATHS, Sparse},
    beam::SUN_ANGULAR_RADIUS,
    buried::Shut,
    gathered::Spot,
    light::{Light, summed},
    lightmap::TileTexels,
    masks::{self, Masks},
    suns::{Paths, Share, sun_items, suns_of, words},
};
use glam::Vec3;

use crate::{
    Result,
    gpu::{BufferDesc, Gpu, OwnedBuffer},
    graph::{Frame, Graph, Items, Runner},
    rays::{Rays, traced},
    resident::Resident,
    scene::{Pose, Scene, View},
    shaders::{
        consts,
        daylight::{lamps, see, sky, suns, walk},
        types,
    },
    tracer::{
        Sources as Lit,
        tables::{self, LightTable},
    },
};

/// A path of a texel of a lightmap that meets a surface within this share of the texel's side begins under an object that lies on the texel.
/// The side is that of `bake.density`; charts of a file's own coordinates may have other sides.
const TOUCHING: f32 = 0.25;
/// Maximum of that distance, metres: a surface farther away does not lie on the texel.
const MOST_TOUCHING: f32 = 0.02;
/// Paths of a texel in one batch at most.
const BATCH: u32 = 16;
/// Maximum of loop iterations that choosing one lamp takes: a descent of the light tree.
pub(super) const LAMP_TURNS: u64 = 64;
/// Texels of [`Transport::sparse`], about.
const SPARSE: usize = 2048;
/// Vertices of a batch at most: 117 MB, because every device allows buffers of 128 MiB.
const MOST_VERTICES: u64 = 1 << 21;
/// Words of all vertices of a batch, with a bit for each time, at most: 128 MiB.
const MOST_WORDS: u64 = 1 << 25;

/// The scene of a bake on a device.
#[derive(Debug)]
pub struct Transport {
    pub(super) gpu: Gpu,
    pub(super) runner: Runner,
    pub(super) scene: Scene,
    pub(super) pose: Pose,
    pub(super) resident: Resident,
    pub(super) rays: Rays,
    pub(super) suns: OwnedBuffer,
    pub(super) masks: Masks,
    pub(super) share: Share,
    /// The lamps that are sampled, made for the first tile.
    pub(super) lamps: Option<LightTable>,
    /// The group of each light, and of each material.
    pub(super) groups: OwnedBuffer,
    pub(super) sources: Sources,
}

/// The texels of a bake.
#[derive(Clone, Debug)]
pub enum Sources {
    /// The pixels of a camera.
    View(Box<View>),
    /// The faces of a camera that turns in place ([`super::cube::views`]).
    Cube(Box<[View; 6]>),
    /// The texels of a lightmap ([`super::lightmap::Unwrapped::by_tile`]).
    Lightmap(Box<TileTexels>),
}

impl Transport {
    /// Uploads the scene without its own suns and sky.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`; `Runtime` if the scene is larger than the device's limits.
    pub fn new(gpu: &Gpu, scene: &Scene, plan: &Plan, sources: Sources) -> Result<Self> {
        let (scene, groups) = with_lamps(scene, &plan.lamps);
        let pose = Pose::rest(&scene);
        let resident = Resident::for_rays(gpu, &scene)?;
        let groups = OwnedBuffer::with_contents(gpu, "daylight.groups", bytemuck::cast_slice(&groups))?;
        let rays = Rays::new(gpu, &scene, &resident)?;
        let suns = suns_of(gpu, plan)?;
        let masks = Masks::none(gpu)?;
        let share = Share::of(gpu)?;
        Ok(Self {
            gpu: gpu.clone(),
            runner: Runner::new(gpu),
            scene,
            pose,
            resident,
            rays,
            suns,
            masks,
            share,
            lamps: None,
            groups,
            sources,
        })
    }

    /// Cuts long passes into dispatches of about so many rays ([`Runner::dispatch_rays`]). The light stays the same but for rounding.
    #[must_use]
    pub fn dispatch_rays(self, rays: u64) -> Self {
        Self { runner: self.runner.dispatch_rays(rays), ..self }
    }

    /// The light of a tile. Its bits do not depend on the other tiles.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`, `Interrupted`.
    pub fn tile(&mut self, plan: &Plan, tile: u32) -> Result<Light> {
        let [column, row, columns, rows] = plan.tile(tile);
        let words = (columns * rows).div_ceil(32) as usize;
        let mut mask = vec![0u32; words];
        let hits: Vec<types::Hit> = match &self.sources {
            Sources::View(_) | Sources::Cube(_) => {
                let pixels: Vec<[u32; 2]> =
                    (row..row + rows).flat_map(|y| (column..column + columns).map(move |x| [x, y])).collect();
                let seen = self.seen(&pixels)?;
                // Hits of nothing have the number NONE (lib/scene.glsl) for their instance.
                let there = seen.iter().enumerate().filter(|(_, hit)| hit.instance != u32::MAX);
                there
                    .map(|(texel, hit)| {
                        mask[texel / 32] |= 1 << (texel % 32);
                        *hit
                    })
                    .collect()
            }
            Sources::Lightmap(_) => return self.lightmap_tile(plan, tile, mask),
        };
        let (light, _) = self.gather(plan, plan.first_receiver(tile), &hits)?;
        Ok(Light { mask, ..light })
    }

    /// The light of some texels that lie evenly over the bake, by few paths: what the choice of the steps needs. It is the same for all shards.
    ///
    /// # Errors
    /// As [`Self::tile`].
    pub fn sparse(&mut self, plan: &Plan) -> Result<Sparse> {
        let [width, height] = plan.extent;
        let (hits, mask, extent) = match &self.sources {
            Sources::Lightmap(texels) => {
                let tiles = &texels.tiles;
                let every = tiles.iter().map(Vec::len).sum::<usize>().div_ceil(SPARSE).max(1);
                let hits: Vec<_> = tiles.iter().flatten().step_by(every).map(|receiver| receiver.hit).collect();
                (hits, Vec::new(), None)
            }
            Sources::View(_) | Sources::Cube(_) => {
                let step = (f64::from(width) * f64::from(height) / SPARSE as f64).sqrt().ceil().max(1.0) as u32;
                let extent = [width.div_ceil(step), height.div_ceil(step)];
                let middle = |at: u32, most: u32| (at * step + step / 2).min(most - 1);
                let texels: Vec<[u32; 2]> = (0..extent[1])
                    .flat_map(|y| (0..extent[0]).map(move |x| [middle(x, width), middle(y, height)]))
                    .collect();
                let mut mask = vec![0u32; texels.len().div_ceil(32)];
                let mut hits = Vec::new();
                for (texel, hit) in self.seen(&texels)?.into_iter().enumerate() {
                    if hit.instance != u32::MAX {
                        mask[texel / 32] |= 1 << (texel % 32);
                        hits.push(hit);
                    }
                }
                (hits, mask, Some(extent))
            }
        };
        // So few paths send fewer shadow rays than masks need.
        let samples = plan.settings.samples.min(SPARSE_PATHS);
        let settings = Baking { samples, sun_masks: 0.0, ..plan.settings.clone() };
        let (light, _) = self.gather(&Plan { settings, lamps: Vec::new(), ..plan.clone() }, 0, &hits)?;
        Ok(Sparse { light: Light { mask, ..light }, extent })
    }

    /// Bytes of the device's memory for the light of a tile with so many texels on surfaces, about, besides the scene.
    pub fn bytes_of_tile(plan: &Plan, texels: u64) -> u64 {
        let adaptive = plan.settings.adaptive != Adaptive::Off;
        let texels = texels.max(if adaptive { SPARSE as u64 } else { 1 });
        let vertices = u64::from(consts::DAY_VERTICES);
        // The choice of the steps has no masks.
        let masks = plan.settings.sun_masks > 0.0;
        let words = if masks && !adaptive { 0 } else { words(plan.times.len()) };
        let paths = batch(texels, words) * texels;
        let of_path = vertices * size_of::<types::DayVertex>() as u64 + size_of::<types::DayEscape>() as u64 + 4;
        // Sums are on the device and in the buffer that the host reads.
        let sums: u64 = plan.dimensions().iter().map(|count| 2 * 24 * *count as u64).sum();
        let of_masks = if masks { vertices * (4 + size_of::<types::DayMaskPoint>() as u64) } else { 0 };
        paths * (of_path + of_masks + 4 * vertices * u64::from(words))
            + texels
                * (sums
                    + size_of::<types::Hit>() as u64
                    + size_of::<types::DaySpot>() as u64
                    + 2 * size_of::<Shut>() as u64)
    }

    /// Goes on with the times of another plan with the same lamps.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`.
    pub fn follow(&mut self, plan: &Plan) -> Result<()> {
        self.suns = suns_of(&self.gpu, plan)?;
        self.masks = Masks::none(&self.gpu)?;
        Ok(())
    }

    /// The surfaces at the centres of texels of a view or of the faces of a cube.
    fn seen(&mut self, texels: &[[u32; 2]]) -> Result<Vec<types::Hit>> {
        let views = match &self.sources {
            Sources::View(view) => {
                let view = **view;
                return self.seen_by(&view, texels);
            }
            Sources::Cube(views) => views.clone(),
            Sources::Lightmap(_) => return Ok(Vec::new()),
        };
        let side = views[0].extent[0];
        let mut seen = vec![types::Hit { instance: u32::MAX, ..types::Hit::default() }; texels.len()];
        for (face, view) in views.iter().enumerate() {
            let of_face: Vec<usize> = (0..texels.len()).filter(|i| (texels[*i][0] / side) as usize == face).collect();
            if !of_face.is_empty() {
                let pixels: Vec<[u32; 2]> = of_face.iter().map(|i| [texels[*i][0] % side, texels[*i][1]]).collect();
                let hits = self.seen_by(view, &pixels)?;
                of_face.into_iter().zip(hits).for_each(|(i, hit)| seen[i] = hit);
            }
        }
        Ok(seen)
    }

    /// The surfaces at the centres of pixels.
    fn seen_by(&mut self, view: &View, pixels: &[[u32; 2]]) -> Result<Vec<types::Hit>> {
        let count = pixels.len() as u32;
        let mut graph = Graph::new("daylight.see");
        let handles = self.resident.frame_in(&mut graph, &self.scene, &self.pose);
        let rays = self.rays.frame(&mut graph, &handles);
        let receivers = graph.buffer("daylight.receivers", u64::from(count) * size_of::<types::Hit>() as u64);
        let args = traced!(
            see::Args {
                view: graph.uniform(&view.fit_far(&handles.bounds()).uniform()),
                pixels: graph.buffer_from("daylight.pixels", pixels),
                receivers,
                push: see::Push { count, extent: view.extent },
            },
            rays,
            handles
        );
        graph.compute(args, count).rays(count.into());
        let read = graph.read_buffer(receivers);
        Ok(self.runner.run(&graph)?.buffer(read))
    }

    /// Runs passes that may compute masks.
    pub(super) fn run(&mut self, graph: &Graph) -> Result<Frame> {
        let done = self.runner.run(graph);
        // After a run that ended early, masks are known that were not computed.
        self.masks.dirty = done.is_err();
        done
    }

    /// The light of some surface points, and how many paths of each are shut in; `first`: number of the first in the whole bake.
    pub(super) fn gather(&mut self, plan: &Plan, first: u32, hits: &[types::Hit]) -> Result<(Light, Vec<Shut>)> {
        let count = hits.len() as u32;
        if count == 0 {
            return Ok((Light::default(), Vec::new()));
        }
        let times = plan.times.len() as u32;
        let mask_words = self.mask_words(plan)?;
        let visibility_words = if mask_words == 0 { words(plan.times.len()) } else { 0 };
        let batch = batch(count.into(), visibility_words) as u32;
        let buffer = |name, bytes: u64| OwnedBuffer::new(&self.gpu, name, BufferDesc::device(bytes.max(16)));
        let paths = u64::from(count * batch);
        let receivers = OwnedBuffer::with_contents(&self.gpu, "daylight.receivers", bytemuck::cast_slice(hits))?;
        let of_vertices = buffer(
            "daylight.vertices",
            paths * u64::from(consts::DAY_VERTICES) * size_of::<types::DayVertex>() as u64,
        )?;
        let escapes = buffer("daylight.escapes", paths * size_of::<types::DayEscape>() as u64)?;
        let counts = buffer("daylight.counts", paths * 4)?;
        let shut = buffer("daylight.shut", u64::from(count) * size_of::<Shut>() as u64)?;
        let sun_sums = buffer("daylight.sun", u64::from(count) * u64::from(times) * 24)?;
        let groups = plan.lamps.len() as u32;
        let lamp_sums = buffer("daylight.lamps", u64::from(count) * u64::from(groups) * 24)?;
        let sky_sums = buffer("daylight.sky", u64::from(count) * u64::from(consts::SKY_PATCHES) * 24)?;
        let samples = plan.settings.samples;
        let mut first_sample = 0;
        loop {
            let now = batch.min(samples - first_sample);
            let mut graph = Graph::new("daylight.bake");
            let handles = self.resident.frame_in(&mut graph, &self.scene, &self.pose);
            let rays = self.rays.frame(&mut graph, &handles);
            let most_turns = self.rays.most_turns();
            let receivers = graph.import_buffer(&receivers);
            let vertices = graph.import_buffer(&of_vertices);
            let escapes = graph.import_buffer(&escapes);
            let counts = graph.import_buffer(&counts);
            let shut = graph.import_buffer(&shut);
            let sun_sums = graph.import_buffer(&sun_sums);
            let sky_sums = graph.import_buffer(&sky_sums);
            let lamp_sums = graph.import_buffer(&lamp_sums);
            let masks = self.masks.frame(&mut graph, paths * u64::from(consts::DAY_VERTICES), mask_words, self.share);
            if first_sample == 0 {
                graph.fill(sun_sums, 0);
                graph.fill(sky_sums, 0);
                graph.fill(lamp_sums, 0);
                graph.fill(shut, 0);
            }
            let spots = graph.buffer("daylight.spots", u64::from(count) * size_of::<types::DaySpot>() as u64);
            let of_lights = handles.moment.lights.len() as u32;
            let settings =
                graph.uniform(&settings(plan, first, [count, now, first_sample], (of_lights, self.share, masks)));
            let args = traced!(
                walk::Args {
                    settings,
                    receivers,
                    vertices,
                    escapes,
                    counts,
                    cells: masks.cells,
                    cell_firsts: masks.cell_firsts,
                    known: masks.known,
                    wanted: masks.wanted,
                    requests: masks.requests,
                    spots,
                    shut,
                },
                rays,
                handles
            );
            let bounces = u64::from(plan.settings.vertices());
            let paths = count * now;
            graph.compute(args, paths).rays(u64::from(paths) * bounces);
            if times > 0 {
                let suns = graph.import_buffer(&self.suns);
                let all = Paths { settings, vertices, counts, receivers: count, samples: now, bounces };
                let bits = self.visibility(&mut graph, all, (suns, times), (&handles, rays), masks);
                let push = suns::Push { first: 0, count: now };
                let args = suns::Args { settings, suns, vertices, counts, sums: sun_sums, bits, push };
                let items = sun_items([count, times, now], bounces);
                graph.compute_over(args, [times, count], items);
            }
            if groups > 0 {
                let table = lamp_table(&mut self.lamps, (&self.scene, &self.pose), &handles.moment.lights);
                if table.tree {
                    let args = traced!(
                        lamps::Args {
                            settings,
                            vertices,
                            counts,
                            spots,
                            sums: lamp_sums,
                            groups: graph.import_buffer(&self.groups),
                            lights: handles.lights,
                            light_columns: graph.buffer_from("daylight.light-columns", &table.columns),
                            light_targets: graph.buffer_from("daylight.light-targets", &table.targets),
                            instance_lights: graph.buffer_from("daylight.instance-lights", &table.instances),
                            light_nodes: graph.buffer_from("daylight.light-nodes", &table.nodes),
                            push: lamps::Push { first: 0, count: now },
                        },
                        rays,
                        handles
                    );
                    let turns = (bounces + 1) * (most_turns + LAMP_TURNS);
                    let items = Items::new(now).rays(u64::from(count) * (bounces + 1)).turns(turns);
                    graph.compute_over(args, count, items);
                }
            }
            let args = sky::Args { settings, escapes, sums: sky_sums, push: sky::Push { first: 0, count: now } };
            graph.compute(args, count);
            first_sample += now;
            if first_sample < samples {
                self.run(&graph)?;
                continue;
            }
            let [sun, sky, lamps, spots, shut] =
                [sun_sums, sky_sums, lamp_sums, spots, shut].map(|buffer| graph.read_buffer(buffer));
            let frame = self.run(&graph)?;
            let spot = |spot: types::DaySpot| Spot { position: spot.position, normal: spot.normal, offset: [0.0; 2] };
            let spots = frame.buffer(spots).into_iter().map(spot).collect();
            let mut light = Light { spots, ..Light::default() };
            [light.sun, light.noise] = summed(&frame.buffer(sun), [count, times, samples]);
            [light.sky, light.sky_noise] = summed(&frame.buffer(sky), [count, consts::SKY_PATCHES, samples]);
            [light.lamps, light.lamps_noise] = summed(&frame.buffer(lamps), [count, groups, samples]);
            let mut shut = frame.buffer::<Shut>(shut);
            shut.truncate(hits.len());
            return Ok((light, shut));
        }
    }
}

/// Paths of a texel in one batch, of a tile with so many texels. `words`: the words with the bits of a vertex, 0 with masks.
fn batch(texels: u64, words: u32) -> u64 {
    let vertices = MOST_VERTICES.min(MOST_WORDS / u64::from(words.max(1)));
    (vertices / (texels * u64::from(consts::DAY_VERTICES))).clamp(1, BATCH.into())
}

/// The lamps as they are sampled, made once.
pub(super) fn lamp_table<'a>(
    known: &'a mut Option<LightTable>,
    (scene, pose): (&Scene, &Pose),
    lights: &[types::Light],
) -> &'a LightTable {
    known.get_or_insert_with(|| tables::lights(scene, pose, lights, Lit::All))
}

/// A scene in which only the lamps of these groups shine, and the group of each of its placed lights and then of each material (`u32::MAX`: none).
fn with_lamps(scene: &Scene, groups: &[Group]) -> (Scene, Vec<u32>) {
    let mut scene = Scene { environment: None, ..scene.clone() };
    let number = |of: &dyn Fn(&Group) -> bool| groups.iter().position(of).map_or(u32::MAX, |group| group as u32);
    let placed = super::lamps::placed(&scene, groups);
    let mut out: Vec<u32> = placed.map(|group| group.map_or(u32::MAX, |group| group as u32)).collect();
    for (index, light) in scene.lights.iter_mut().enumerate() {
        if number(&|group| group.lights.contains(&(index as u32))) == u32::MAX {
            light.intensity = 0.0;
        }
    }
    for (index, material) in scene.materials.iter_mut().enumerate() {
        let group = number(&|group| group.materials.contains(&(index as u32)));
        if group == u32::MAX {
            material.emissive = Vec3::ZERO;
        }
        out.push(group);
    }
    (scene, out)
}

pub(super) fn settings(
    plan: &Plan,
    first_receiver: u32,
    [receivers, samples, first_sample]: [u32; 3],
    (lights, share, masks): (u32, Share, masks::Handles),
) -> types::DaySettings {
    let baking = &plan.settings;
    let mut flags = 0;
    if let Kind::View { .. } | Kind::Cube { .. } = plan.receivers {
        flags |= consts::DAY_NORMAL_MAPS;
    }
    let touching = match plan.receivers {
        Kind::Lightmap { .. } => (TOUCHING / baking.density).min(MOST_TOUCHING),
        _ => 0.0,
    };
    if masks.wanted() {
        flags |= consts::DAY_SUN_MASKS;
    }
    if baking.diffuse_only {
        flags |= consts::DAY_DIFFUSE_ONLY;
    }
    types::DaySettings {
        receivers,
        first_receiver,
        samples,
        first_sample,
        bounces: baking.vertices(),
        roulette: baking.roulette,
        sharp: baking.specular_bounces,
        flags,
        seed: baking.seed,
        times: plan.times.len() as u32,
        lights,
        groups: plan.lamps.len() as u32,
        sun_radius: if baking.disc { SUN_ANGULAR_RADIUS.tan() as f32 } else { 0.0 },
        touching,
        places: share.places,
    }
}
