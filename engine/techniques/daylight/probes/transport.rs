//! The light of probes for all times of the day, by the paths of [`Transport`].

use glam::Vec3;

use super::{
    DIRECTIONS, convolved,
    distance::{self, Distances, Map},
    harmonics::{directions, irradiance},
};
use crate::{
    Error, Result,
    gpu::{BufferDesc, OwnedBuffer},
    graph::{Graph, Items},
    rays::traced,
    shaders::{
        consts,
        daylight::{probe_lamps, probe_sky, probe_suns, probe_walk},
        types,
    },
    techniques::daylight::{
        Plan, Transport,
        light::Light,
        suns::{Paths, sun_items},
        transport::{LAMP_TURNS, lamp_table, settings},
    },
};

/// Paths of a probe in one batch at most.
const BATCH: u32 = 32;
/// Paths that find the place of a probe.
const SCOUTS: u32 = 64;
/// Steps of a probe that leaves a solid.
const STEPS: u32 = 3;
const TERMS: usize = consts::PROBE_TERMS as usize;

/// The light of a brick, before compression.
#[derive(Clone, Debug, PartialEq)]
pub struct Gathered {
    /// World positions, metres.
    pub(super) positions: Vec<Vec3>,
    pub(super) distances: Vec<Map>,
    pub light: Light,
}

/// Buffers of a brick on the device.
struct Buffers {
    starts: OwnedBuffer,
    vertices: OwnedBuffer,
    escapes: OwnedBuffer,
    counts: OwnedBuffer,
    sun: OwnedBuffer,
    sky: OwnedBuffer,
    lamps: OwnedBuffer,
}

impl Transport {
    /// The light of a brick of probes. Its bits do not depend on the other bricks.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`, `Interrupted`; `Runtime` if the plan has no such brick.
    pub fn brick(&mut self, plan: &Plan, brick: u32) -> Result<Gathered> {
        let grid = plan.probes.as_ref().filter(|grid| brick < grid.bricks());
        let Some(grid) = grid else {
            return Err(Error::new(crate::ErrorKind::Runtime, format!("the plan has no brick {brick} of probes")));
        };
        let places: Vec<Vec3> = grid.brick(brick).into_iter().map(|at| grid.position(at)).collect();
        // Random numbers of probes differ from those of texels.
        let first = 0x8000_0000 | (brick * consts::PROBE_BRICK.pow(3));
        let buffers = self.buffers(places.len() as u32, plan.dimensions())?;
        let spacing = Vec3::from(grid.spacing);
        let (margin, most) = (0.1 * spacing.min_element(), 0.45 * spacing);
        let mut offsets = vec![Vec3::ZERO; places.len()];
        let at = |offsets: &[Vec3]| -> Vec<Vec3> { places.iter().zip(offsets).map(|(p, o)| *p + *o).collect() };
        let mut scouts = plan.clone();
        scouts.settings.bounces = 1;
        for _ in 0..STEPS {
            let mut found = vec![Vec::new(); places.len()];
            for first_sample in (0..SCOUTS).step_by(BATCH as usize) {
                let starts = self.batch(&scouts, first, &at(&offsets), &buffers, [first_sample, BATCH], false)?;
                let of_probes = found.iter_mut().zip(starts.chunks_exact(BATCH as usize));
                of_probes.for_each(|(found, starts)| found.extend_from_slice(starts));
            }
            let before = offsets.clone();
            for (offset, starts) in offsets.iter_mut().zip(&found) {
                *offset = distance::moved(*offset, starts, margin, most);
            }
            if before == offsets {
                break;
            }
        }
        let positions = at(&offsets);
        let mut distances = vec![Distances::new(grid.reach()); places.len()];
        let samples = plan.settings.probe_samples;
        for first_sample in (0..samples).step_by(BATCH as usize) {
            let now = BATCH.min(samples - first_sample);
            let starts = self.batch(plan, first, &positions, &buffers, [first_sample, now], true)?;
            distances.iter_mut().zip(starts.chunks_exact(now as usize)).for_each(|(d, starts)| d.add(starts));
        }
        let valid: Vec<bool> = distances.iter().map(|distances| !distances.is_inside()).collect();
        let light = summed(self.sums(&buffers)?, &valid, plan.dimensions(), samples);
        Ok(Gathered { positions, distances: distances.iter().map(Distances::map).collect(), light })
    }

    fn buffers(&self, probes: u32, [times, patches, groups]: [usize; 3]) -> Result<Buffers> {
        let buffer = |name, bytes: u64| OwnedBuffer::new(&self.gpu, name, BufferDesc::device(bytes.max(16)));
        let paths = u64::from(probes * BATCH);
        let terms = 12 * u64::from(probes) * TERMS as u64;
        Ok(Buffers {
            starts: buffer("daylight.starts", paths * size_of::<types::DayStart>() as u64)?,
            vertices: buffer(
                "daylight.vertices",
                paths * u64::from(consts::DAY_VERTICES) * size_of::<types::DayVertex>() as u64,
            )?,
            escapes: buffer("daylight.escapes", paths * size_of::<types::DayEscape>() as u64)?,
            counts: buffer("daylight.counts", paths * 4)?,
            sun: buffer("daylight.sun", 2 * terms * times as u64)?,
            sky: buffer("daylight.sky", terms * patches as u64)?,
            lamps: buffer("daylight.lamps", 2 * terms * groups as u64)?,
        })
    }

    /// Some paths of each probe, and their light if `lit`. Returns where the paths started, probe after probe.
    fn batch(
        &mut self,
        plan: &Plan,
        first: u32,
        positions: &[Vec3],
        buffers: &Buffers,
        [first_sample, now]: [u32; 2],
        lit: bool,
    ) -> Result<Vec<types::DayStart>> {
        let (count, times) = (positions.len() as u32, plan.times.len() as u32);
        let groups = plan.lamps.len();
        let mask_words = if lit { self.mask_words(plan)? } else { 0 };
        let mut graph = Graph::new("daylight.probes");
        let handles = self.resident.frame_in(&mut graph, &self.scene, &self.pose);
        let rays = self.rays.frame(&mut graph, &handles);
        let most_turns = self.rays.most_turns();
        let starts = graph.import_buffer(&buffers.starts);
        let vertices = graph.import_buffer(&buffers.vertices);
        let escapes = graph.import_buffer(&buffers.escapes);
        let counts = graph.import_buffer(&buffers.counts);
        let lights = handles.moment.lights.len() as u32;
        let positions: Vec<[f32; 3]> = positions.iter().map(|position| position.to_array()).collect();
        let probes = graph.buffer_from("daylight.probes", &positions);
        let paths = count * now;
        let masks =
            self.masks.frame(&mut graph, u64::from(paths) * u64::from(consts::DAY_VERTICES), mask_words, self.share);
        let settings = graph.uniform(&settings(plan, first, [count, now, first_sample], (lights, self.share, masks)));
        let args = traced!(
            probe_walk::Args {
                settings,
                probes,
                starts,
                vertices,
                escapes,
                counts,
                cells: masks.cells,
                cell_firsts: masks.cell_firsts,
                known: masks.known,
                wanted: masks.wanted,
                requests: masks.requests,
            },
            rays,
            handles
        );
        let bounces = u64::from(plan.settings.vertices());
        graph.compute(args, paths).rays(u64::from(paths) * bounces);
        if lit {
            let [sun, sky, lamps] =
                [&buffers.sun, &buffers.sky, &buffers.lamps].map(|buffer| graph.import_buffer(buffer));
            if first_sample == 0 {
                [sun, sky, lamps].into_iter().for_each(|sums| {
                    graph.fill(sums, 0);
                });
            }
            if times > 0 {
                let suns = graph.import_buffer(&self.suns);
                let all = Paths { settings, vertices, counts, receivers: count, samples: now, bounces };
                let bits = self.visibility(&mut graph, all, (suns, times), (&handles, rays), masks);
                let push = probe_suns::Push { first: 0, count: now };
                let args = probe_suns::Args { settings, suns, starts, vertices, counts, sums: sun, bits, push };
                let items = sun_items([count, times, now], bounces);
                graph.compute_over(args, [times, count], items);
            }
            graph.compute(probe_sky::Args { settings, starts, escapes, sums: sky }, count);
            let at = (&self.scene, &self.pose);
            let table = (groups > 0).then(|| lamp_table(&mut self.lamps, at, &handles.moment.lights));
            let table = table.filter(|table| table.tree);
            if let Some(table) = table {
                let tables = [
                    graph.buffer_from("daylight.light-columns", &table.columns),
                    graph.buffer_from("daylight.light-targets", &table.targets),
                    graph.buffer_from("daylight.instance-lights", &table.instances),
                    graph.buffer_from("daylight.light-nodes", &table.nodes),
                ];
                let [light_columns, light_targets, instance_lights, light_nodes] = tables;
                let args = traced!(
                    probe_lamps::Args {
                        settings,
                        probes,
                        vertices,
                        counts,
                        starts,
                        sums: lamps,
                        groups: graph.import_buffer(&self.groups),
                        lights: handles.lights,
                        light_columns,
                        light_targets,
                        instance_lights,
                        light_nodes,
                        push: probe_lamps::Push { first: 0, count: now },
                    },
                    rays,
                    handles
                );
                let turns = (bounces + 1) * (most_turns + LAMP_TURNS);
                let items = Items::new(now).rays(u64::from(count) * (bounces + 1)).turns(turns);
                graph.compute_over(args, count, items);
            }
        }
        let read = graph.read_buffer(starts);
        let mut starts: Vec<types::DayStart> = self.run(&graph)?.buffer(read);
        starts.truncate(paths as usize);
        Ok(starts)
    }

    /// The sums of the sun, of the sky and of lamps.
    fn sums(&mut self, buffers: &Buffers) -> Result<[Vec<[f32; 3]>; 3]> {
        let mut graph = Graph::new("daylight.probes");
        let sums = [&buffers.sun, &buffers.sky, &buffers.lamps].map(|buffer| graph.import_buffer(buffer));
        let reads = sums.map(|buffer| graph.read_buffer(buffer));
        let frame = self.runner.run(&graph)?;
        Ok(reads.map(|read| frame.buffer(read)))
    }
}

/// For each normal the irradiance of the harmonics of a sum.
fn of_normals(sums: &[[f32; 3]], at: usize, channel: usize) -> [f64; DIRECTIONS] {
    let terms = sums[TERMS * at..TERMS * (at + 1)].iter().map(|term| f64::from(term[channel]));
    let mut radiance = [0.0; TERMS];
    radiance.iter_mut().zip(terms).for_each(|(out, term)| *out = term);
    let terms = convolved(radiance);
    directions().map(|normal| irradiance(&terms, normal))
}

/// Rows of irradiance for all normals of the valid probes, from sums of harmonics in the order of the device.
fn summed(
    [sun, sky, lamps]: [Vec<[f32; 3]>; 3],
    valid: &[bool],
    [times, patches, groups]: [usize; 3],
    samples: u32,
) -> Light {
    let mut light = Light { mask: vec![0; (valid.len() * DIRECTIONS).div_ceil(32)], ..Light::default() };
    for (probe, _) in valid.iter().enumerate().filter(|(_, valid)| **valid) {
        for texel in probe * DIRECTIONS..(probe + 1) * DIRECTIONS {
            light.mask[texel / 32] |= 1 << (texel % 32);
        }
        halves(&sun, probe, times, samples, [&mut light.sun, &mut light.noise]);
        halves(&lamps, probe, groups, samples, [&mut light.lamps, &mut light.lamps_noise]);
        let begin = light.sky.len();
        light.sky.resize(begin + 3 * DIRECTIONS * patches, 0.0);
        for channel in 0..3 {
            for patch in 0..patches {
                let values = of_normals(&sky, probe * patches + patch, channel);
                for (direction, value) in values.into_iter().enumerate() {
                    light.sky[begin + (3 * direction + channel) * patches + patch] =
                        (value / f64::from(samples)) as f32;
                }
            }
        }
    }
    light
}

/// Appends the rows of a probe, of means and of noise, from the sums of even and of odd samples of each dimension.
fn halves(sums: &[[f32; 3]], probe: usize, dimensions: usize, samples: u32, [means, noises]: [&mut Vec<f32>; 2]) {
    let (even_count, odd_count) = (f64::from(samples.div_ceil(2)), f64::from(samples / 2));
    let begin = means.len();
    means.resize(begin + 3 * DIRECTIONS * dimensions, 0.0);
    noises.resize(begin + 3 * DIRECTIONS * dimensions, 0.0);
    for channel in 0..3 {
        for dimension in 0..dimensions {
            let at = 2 * (probe * dimensions + dimension);
            let (even, odd) = (of_normals(sums, at, channel), of_normals(sums, at + 1, channel));
            for direction in 0..DIRECTIONS {
                let out = begin + (3 * direction + channel) * dimensions + dimension;
                let [even, odd] = [even[direction], odd[direction]];
                means[out] = ((even + odd) / f64::from(samples)) as f32;
                noises[out] = (0.5 * (odd / odd_count.max(1.0) - even / even_count)) as f32;
            }
        }
    }
}
