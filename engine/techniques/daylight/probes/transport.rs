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
        daylight::{probe_sky, probe_suns, probe_walk},
        types,
    },
    techniques::daylight::{
        Plan, Transport,
        transport::{Light, settings},
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
        let buffers = self.buffers(places.len() as u32, plan.times.len() as u32)?;
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
        let [sun, sky] = self.sums(&buffers)?;
        let light = summed(&sun, &sky, &valid, plan.times.len(), samples);
        Ok(Gathered { positions, distances: distances.iter().map(Distances::map).collect(), light })
    }

    fn buffers(&self, probes: u32, times: u32) -> Result<Buffers> {
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
            sun: buffer("daylight.sun", 2 * terms * u64::from(times))?,
            sky: buffer("daylight.sky", terms * u64::from(consts::SKY_PATCHES))?,
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
        let mut graph = Graph::new("daylight.probes");
        let handles = self.resident.frame_in(&mut graph, &self.scene, &self.pose);
        let rays = self.rays.frame(&mut graph, &handles);
        let most_turns = self.rays.most_turns();
        let starts = graph.import_buffer(&buffers.starts);
        let vertices = graph.import_buffer(&buffers.vertices);
        let escapes = graph.import_buffer(&buffers.escapes);
        let counts = graph.import_buffer(&buffers.counts);
        let settings = graph.uniform(&settings(plan, first, [count, now, first_sample], 0));
        let positions: Vec<[f32; 3]> = positions.iter().map(|position| position.to_array()).collect();
        let probes = graph.buffer_from("daylight.probes", &positions);
        let args = traced!(probe_walk::Args { settings, probes, starts, vertices, escapes, counts }, rays, handles);
        let (paths, bounces) = (count * now, u64::from(plan.settings.vertices()));
        graph.compute(args, paths).rays(u64::from(paths) * bounces);
        if lit {
            let [sun, sky] = [&buffers.sun, &buffers.sky].map(|buffer| graph.import_buffer(buffer));
            if first_sample == 0 {
                graph.fill(sun, 0);
                graph.fill(sky, 0);
            }
            if times > 0 {
                let args = traced!(
                    probe_suns::Args {
                        settings,
                        suns: graph.import_buffer(&self.suns),
                        starts,
                        vertices,
                        counts,
                        sums: sun,
                        push: probe_suns::Push { first: 0, count: now },
                    },
                    rays
                );
                let shadow_rays = u64::from(count) * u64::from(times) * bounces.div_ceil(4);
                let items = Items::new(now).rays(shadow_rays).turns(bounces * most_turns);
                graph.compute_over(args, [times, count], items);
            }
            graph.compute(probe_sky::Args { settings, starts, escapes, sums: sky }, count);
        }
        let read = graph.read_buffer(starts);
        let mut starts: Vec<types::DayStart> = self.runner.run(&graph)?.buffer(read);
        starts.truncate(paths as usize);
        Ok(starts)
    }

    fn sums(&mut self, buffers: &Buffers) -> Result<[Vec<[f32; 3]>; 2]> {
        let mut graph = Graph::new("daylight.probes");
        let sums = [&buffers.sun, &buffers.sky].map(|buffer| graph.import_buffer(buffer));
        let [sun, sky] = sums.map(|buffer| graph.read_buffer(buffer));
        let frame = self.runner.run(&graph)?;
        Ok([frame.buffer(sun), frame.buffer(sky)])
    }
}

/// Rows of irradiance for all normals of the valid probes, from sums of harmonics in the order of the device.
fn summed(sun: &[[f32; 3]], sky: &[[f32; 3]], valid: &[bool], times: usize, samples: u32) -> Light {
    let patches = consts::SKY_PATCHES as usize;
    let directions = directions();
    // For each normal the irradiance of each sum.
    let of = |sums: &[[f32; 3]], at: usize, channel: usize| -> [f64; DIRECTIONS] {
        let terms = sums[TERMS * at..TERMS * (at + 1)].iter().map(|term| f64::from(term[channel]));
        let mut radiance = [0.0; TERMS];
        radiance.iter_mut().zip(terms).for_each(|(out, term)| *out = term);
        let terms = convolved(radiance);
        directions.map(|normal| irradiance(&terms, normal))
    };
    let (even_count, odd_count) = (f64::from(samples.div_ceil(2)), f64::from(samples / 2));
    let mut light = Light { mask: vec![0; (valid.len() * DIRECTIONS).div_ceil(32)], ..Light::default() };
    for (probe, _) in valid.iter().enumerate().filter(|(_, valid)| **valid) {
        for texel in probe * DIRECTIONS..(probe + 1) * DIRECTIONS {
            light.mask[texel / 32] |= 1 << (texel % 32);
        }
        let begin = [light.sun.len(), light.sky.len()];
        light.sun.resize(begin[0] + 3 * DIRECTIONS * times, 0.0);
        light.noise.resize(begin[0] + 3 * DIRECTIONS * times, 0.0);
        light.sky.resize(begin[1] + 3 * DIRECTIONS * patches, 0.0);
        for channel in 0..3 {
            for time in 0..times {
                let at = 2 * (probe * times + time);
                let (even, odd) = (of(sun, at, channel), of(sun, at + 1, channel));
                for direction in 0..DIRECTIONS {
                    let out = begin[0] + (3 * direction + channel) * times + time;
                    let [even, odd] = [even[direction], odd[direction]];
                    light.sun[out] = ((even + odd) / f64::from(samples)) as f32;
                    light.noise[out] = (0.5 * (odd / odd_count.max(1.0) - even / even_count)) as f32;
                }
            }
            for patch in 0..patches {
                let values = of(sky, probe * patches + patch, channel);
                for (direction, value) in values.into_iter().enumerate() {
                    light.sky[begin[1] + (3 * direction + channel) * patches + patch] =
                        (value / f64::from(samples)) as f32;
                }
            }
        }
    }
    light
}
