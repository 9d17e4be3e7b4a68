//! The samples of a room: particles, their thinned hits, and the surroundings of the samples.

use std::ops::Range;

use glam::Vec3;

use super::{
    Bakery, Baking, Plan, clusters, plan,
    samples::{self, Thinning, Triangles},
    settings::too_many_vectors,
};
use crate::{
    Error, Result, Stop,
    bake::Digest,
    graph::{Graph, Items},
    rays::traced,
    shaders::{
        consts::{PRT_DENSITY, PRT_FIRST_HIT, PRT_HITS},
        prt::{clearances, openness, particles},
        types::PrtPoint,
    },
};

/// Most particles that are followed at once.
pub(super) const MOST_PARTICLES: u32 = 1 << 16;
/// Fewest particles that are followed at once: their hits also tell which triangles particles reach.
const LEAST_PARTICLES: u32 = 1 << 14;
/// Most rounds of [`MOST_PARTICLES`].
const MOST_ROUNDS: u32 = 96;
/// Least share of the particles that are still in the scene when their hits begin to count. A cube with one side open keeps about a quarter (0.8⁵ · 5/6).
const LEAST_INSIDE: f64 = 0.05;
/// Share by which the number of samples may differ from the one that is asked for.
const FAR_FROM_ASKED: f32 = 0.1;
/// Corrections of the distance of samples for their number.
const MOST_CORRECTIONS: u32 = 3;
/// Rays that tell how open the surroundings of a sample are.
const OPEN_RAYS: u32 = 64;
/// Least share of the hemisphere that counts as free. A sample in a hole is not without any weight, because nothing else may be there.
const LEAST_OPEN: f32 = 0.1;
/// Samples from which the area that light reaches is estimated.
const PILOT: f32 = 3000.0;

/// The samples of a scene.
#[derive(Clone, Debug)]
pub struct Sampled {
    pub plan: Plan,
    /// Cluster after cluster.
    pub samples: Vec<PrtPoint>,
    /// Places in the free space, evenly distributed: one for each example light, metres.
    pub examples: Vec<[f32; 3]>,
}

/// Thinned hits of particles.
struct Thinned {
    samples: Vec<PrtPoint>,
    /// In the free space, metres.
    places: Vec<[f32; 3]>,
    /// Share of scattered particles that left the scene.
    escaped: f64,
    /// Share of all particles that were still in the scene when their hits began to count.
    stayed: f64,
}

/// The hits of a round of particles.
pub(super) struct Round {
    /// With the path of each particle apart.
    pub hits: Vec<Vec<PrtPoint>>,
    /// Scattered particles that left the scene, and all of them.
    pub escaped: [u64; 2],
}

impl Bakery {
    /// Puts samples on the surfaces that particles from `starts` reach, and clusters them. The same on every shard.
    ///
    /// # Errors
    /// `Input` if there is no surface or if nearly all particles leave the scene; `OutOfMemory`, `DeviceLost`, `Interrupted`.
    pub fn sample(&mut self, baking: &Baking, starts: &[Vec3], stop: &Stop) -> Result<Sampled> {
        baking.validate()?;
        let mut triangles = Triangles::new(&self.scene);
        let whole = samples::area(&triangles.list) as f32;
        if !(whole > 0.0 && whole.is_finite()) {
            return Err(Error::input("the scene has no surface that light reaches"));
        }
        let pilot = (PRT_DENSITY * whole / PILOT).sqrt();
        let Thinned { samples: mut found, escaped, stayed, .. } =
            self.thinned(baking, starts, (Thinning::new(pilot, 1.0), 2), &mut triangles, stop)?;
        if found.len() < 16 {
            let what = format!("nearly all particles meet no surface (points from which they start: {})", starts.len());
            return Err(Error::input(what).help("Name a point inside the room with --inside X,Y,Z"));
        }
        if escaped > 0.7 {
            return Err(open(format!("{:.0} % of all scattered particles leave it", 100.0 * escaped)));
        }
        if stayed < LEAST_INSIDE {
            return Err(open(format!("{:.0} % of all particles leave it at once", 100.0 * (1.0 - stayed))));
        }
        samples::weigh(&mut found, &triangles, pilot, &[]);
        // How narrow a gap is for the samples to come depends on their least distance, which is not known yet.
        let [low, high] = samples::bounds(&triangles.list);
        let far = low.distance(high);
        let clear = self.clearances(&found, far, baking.seed)?;
        let parts: Vec<[f32; 2]> = found.iter().zip(&clear).map(|(sample, clear)| [sample.area, *clear]).collect();
        let gaps = baking.gaps as f32;
        let radius = samples::radius_for(&parts, baking.samples, gaps);
        let (radius, thinned) = self.near_number(baking, starts, radius, &mut triangles, stop)?;
        let Thinned { samples: mut found, places, escaped, .. } = thinned;
        if found.len() > plan::MOST_SAMPLES {
            let what = format!("{} samples, at most {} are possible", found.len(), plan::MOST_SAMPLES);
            return Err(Error::usage(what).at("room.samples"));
        }
        // A few particles slip through edges into closed furniture.
        let usual = triangles.usual();
        found.retain(|hit| !triangles.is_stray(hit, usual));
        let shares: Vec<f32> = found.iter().map(|hit| samples::share_in_gap(hit.area, radius, gaps)).collect();
        samples::weigh(&mut found, &triangles, radius, &shares);
        // A sample that stands for no surface is of no use.
        found.retain(|sample| sample.area > 0.0);
        let open = self.openness(&found, radius, baking.seed)?;
        found.iter_mut().zip(open).for_each(|(sample, open)| sample.open = open);
        let (sorted, clusters) = clusters::cluster(found, baking);
        let plan = Plan {
            scene: self.scene.name.clone(),
            parts: plan::parts(&self.scene),
            settings: baking.clone(),
            starts: starts.iter().map(|start| start.to_array()).collect(),
            radius,
            far,
            clusters,
            samples: Digest::of(bytemuck::cast_slice(&sorted)),
            escaped,
        };
        if plan.all_vectors() > plan::MOST_VECTORS {
            let what = format!("{} vectors of light, at most {} are possible", plan.all_vectors(), plan::MOST_VECTORS);
            return Err(too_many_vectors(what));
        }
        Ok(Sampled { plan, samples: sorted, examples: places })
    }

    /// Thins the hits of particles so that about as many samples stay as are asked for, with their least distance. `radius`: an estimate of it, metres.
    fn near_number(
        &mut self,
        baking: &Baking,
        starts: &[Vec3],
        mut radius: f32,
        triangles: &mut Triangles,
        stop: &Stop,
    ) -> Result<(f32, Thinned)> {
        let thin = |of: &mut Self, triangles: &mut Triangles, radius: f32| {
            // The same particles come each time.
            triangles.forget();
            of.thinned(baking, starts, (Thinning::new(radius, baking.gaps as f32), MOST_ROUNDS), triangles, stop)
        };
        let share = |found: &Thinned| found.samples.len() as f32 / baking.samples as f32;
        let apart = |share: f32| share.max(0.01).ln().abs();
        let mut found = thin(self, triangles, radius)?;
        // Steps and curved surfaces have samples that the estimate does not know of.
        let mut power = 0.5;
        for _ in 0..MOST_CORRECTIONS {
            let before = share(&found);
            if before <= 0.0 || (before - 1.0).abs() <= FAR_FROM_ASKED {
                break;
            }
            let other = radius * before.clamp(0.25, 4.0).powf(power);
            let again = thin(self, triangles, other)?;
            let after = share(&again);
            // Slits come and go with the distance, so the number may jump away.
            if apart(after) >= apart(before) {
                break;
            }
            power = ((other / radius).ln() / (before / after).ln()).clamp(0.3, 2.0);
            (radius, found) = (other, again);
        }
        Ok((radius, found))
    }

    /// Thins the hits of particles.
    fn thinned(
        &mut self,
        baking: &Baking,
        starts: &[Vec3],
        (mut thinning, rounds): (Thinning, u32),
        triangles: &mut Triangles,
        stop: &Stop,
    ) -> Result<Thinned> {
        let mut places = Vec::new();
        let mut escaped = [0u64; 2];
        let mut stayed = [0usize; 2];
        // A bake with smaller rounds may have more of them.
        let (at_once, smaller) = (at_once(baking), MOST_PARTICLES / at_once(baking));
        for round in 0..rounds * smaller {
            stop.check()?;
            let number = round * at_once..(round + 1) * at_once;
            let found = self.particles((baking.seed, starts), number, thinning.most_clear())?;
            escaped.iter_mut().zip(found.escaped).for_each(|(sum, more)| *sum += more);
            stayed[0] += found.hits.iter().filter(|hits| !hits.is_empty()).count();
            stayed[1] += found.hits.len();
            if round == 0 {
                places = free_places(&found.hits, baking.examples);
            }
            found.hits.iter().flatten().for_each(|hit| triangles.count(hit));
            let mut kept = 0;
            // Hits of one particle depend on each other, so those of all particles come in turns.
            for turn in 0..PRT_HITS as usize {
                let hits = found.hits.iter().filter_map(|hits| hits.get(turn));
                kept += hits.filter(|hit| thinning.offer(hit, triangles.component(hit))).count();
            }
            // Thinning ends when a round of MOST_PARTICLES would add less than 1 %.
            let added = kept * smaller as usize;
            if thinning.samples.len() > plan::MOST_SAMPLES || added * 100 < thinning.samples.len() {
                break;
            }
        }
        let escaped = escaped[0] as f64 / escaped[1].max(1) as f64;
        let stayed = stayed[0] as f64 / stayed[1].max(1) as f64;
        Ok(Thinned { samples: thinning.samples, places, escaped, stayed })
    }

    /// Places in the free space that are not those of the examples of a bake, evenly distributed, metres.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`.
    pub fn places(&mut self, plan: &Plan, count: u32) -> Result<Vec<[f32; 3]>> {
        let starts: Vec<Vec3> = plan.starts.iter().map(|start| Vec3::from(*start)).collect();
        // Particles after all those of a bake.
        let first = MOST_ROUNDS * MOST_PARTICLES;
        let found = self.particles((plan.settings.seed, &starts), first..first + MOST_PARTICLES, 0.0)?;
        Ok(free_places(&found.hits, count))
    }

    /// The hits of the particles with these numbers. `most`: largest of the free distances above hits, metres; 0: they are not measured.
    pub(super) fn particles(
        &mut self,
        (seed, starts): (u32, &[Vec3]),
        numbers: Range<u32>,
        most: f32,
    ) -> Result<Round> {
        let particles = numbers.end - numbers.start;
        let mut graph = Graph::new("prt.particles");
        let handles = self.resident.frame_in(&mut graph, &self.scene, &self.pose);
        let rays = self.rays.frame(&mut graph, &handles);
        let size = u64::from(particles) * u64::from(PRT_HITS) * size_of::<PrtPoint>() as u64;
        let points = graph.buffer("prt.points", size);
        let counts = graph.buffer("prt.counts", 4 * u64::from(particles));
        let places: Vec<[f32; 3]> = starts.iter().map(|start| start.to_array()).collect();
        let args = traced!(
            particles::Args {
                starts: graph.buffer_from("prt.starts", &places),
                points,
                counts,
                push: particles::Push { particles, first: numbers.start, starts_of: places.len() as u32, seed, most },
            },
            rays,
            handles
        );
        let hits = PRT_FIRST_HIT + 2 * PRT_HITS;
        graph.compute(args, particles).rays(u64::from(particles) * u64::from(hits));
        let (points, counts) = (graph.read_buffer(points), graph.read_buffer(counts));
        let frame = self.runner.run(&graph)?;
        let (points, counts): (Vec<PrtPoint>, Vec<u32>) = (frame.buffer(points), frame.buffer(counts));
        let of = |(points, count): (&[PrtPoint], &u32)| points[..(*count).min(PRT_HITS) as usize].to_vec();
        let hits: Vec<_> = points.chunks_exact(PRT_HITS as usize).zip(&counts).map(of).collect();
        let after = counts.iter().filter(|count| **count > 0);
        let left = after.clone().filter(|count| **count < PRT_HITS).count() as u64;
        let scattered = after.map(|count| u64::from(*count.min(&(PRT_HITS - 1)))).sum();
        Ok(Round { hits, escaped: [left, scattered] })
    }

    /// The free distance above each sample, at most `most`, metres.
    pub(super) fn clearances(&mut self, samples: &[PrtPoint], most: f32, seed: u32) -> Result<Vec<f32>> {
        let count = samples.len() as u32;
        let mut graph = Graph::new("prt.clearances");
        let handles = self.resident.frame_in(&mut graph, &self.scene, &self.pose);
        let rays = self.rays.frame(&mut graph, &handles);
        let clearances = graph.buffer("prt.clearances", 4 * u64::from(count));
        let args = traced!(
            clearances::Args {
                samples: graph.buffer_from("prt.samples", samples),
                clearances,
                push: clearances::Push { count, most, seed },
            },
            rays
        );
        graph.compute(args, count).rays(count.into());
        let read = graph.read_buffer(clearances);
        Ok(self.runner.run(&graph)?.buffer(read))
    }

    /// The share of the hemisphere above each sample, weighted by the cosine, in which nothing is nearer than `most`, metres; [`LEAST_OPEN`] at least.
    fn openness(&mut self, samples: &[PrtPoint], most: f32, seed: u32) -> Result<Vec<f32>> {
        let count = samples.len() as u32;
        let mut graph = Graph::new("prt.openness");
        let handles = self.resident.frame_in(&mut graph, &self.scene, &self.pose);
        let rays = self.rays.frame(&mut graph, &handles);
        let free = graph.buffer("prt.openness", 4 * u64::from(count));
        graph.fill(free, 0);
        let args = traced!(
            openness::Args {
                samples: graph.buffer_from("prt.samples", samples),
                free,
                push: openness::Push { first: 0, count: OPEN_RAYS, samples_all: count, most, seed },
            },
            rays
        );
        graph.compute_over(args, count, Items::new(OPEN_RAYS).rays(count.into()).turns(self.rays.most_turns()));
        let read = graph.read_buffer(free);
        let free: Vec<u32> = self.runner.run(&graph)?.buffer(read);
        Ok(free.into_iter().map(|free| (free as f32 / OPEN_RAYS as f32).max(LEAST_OPEN)).collect())
    }
}

/// The number of particles that a bake follows at once. A small bake needs fewer.
fn at_once(baking: &Baking) -> u32 {
    baking.samples.saturating_mul(3).div_ceil(2).clamp(LEAST_PARTICLES, MOST_PARTICLES).next_power_of_two()
}

/// The error for a scene that is no room.
fn open(what: String) -> Error {
    Error::input(format!("the scene is open: {what}")).help("Name a point inside a room with --inside X,Y,Z")
}

/// Places for the example lights. Particles that scatter diffusely fill a closed space evenly, so a random point along their paths is an even
/// point of the space.
fn free_places(hits: &[Vec<PrtPoint>], count: u32) -> Vec<[f32; 3]> {
    let segments =
        || hits.iter().flat_map(|hits| hits.windows(2)).map(|pair| [0, 1].map(|i| samples::position(&pair[i])));
    let whole: f64 = segments().map(|[a, b]| f64::from(a.distance(b))).sum();
    let each = whole / f64::from(count);
    let mut out = Vec::new();
    let mut sum = 0.0;
    for [a, b] in segments() {
        let length = f64::from(a.distance(b));
        while each > 0.0 && (out.len() as f64 + 0.5) * each < sum + length {
            let along = ((out.len() as f64 + 0.5) * each - sum) / length.max(1e-9);
            out.push(a.lerp(b, along as f32).to_array());
        }
        sum += length;
    }
    out.truncate(count as usize);
    out
}
