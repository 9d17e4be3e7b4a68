//! Vectors of what an occluder hides, from many points at once, on the device.
//!
//! The mask of an occluder on the cube is made by rays through the middles of texels, which sets the same texels as rasterising its
//! triangles does. A far occluder of a hundred thousand triangles covers a handful of texels: rays cost by texels, not by triangles.
//! Measured on a CPU driver with the Stanford bunny (69,451 triangles): to rasterise one face of 32×32 takes 75 ms, a sample with all six
//! faces by rays 3.2 ms, the mean of the 63,360 of the set 64×33×30, under the same load.
//! What is cut out of surfaces is cut out of the mask.

use glam::{Mat3, Vec3};

use super::{light::Light, occluder::Occluder, parallel::Parallel, suns, surface::Place};
use crate::{
    Result,
    gpu::Gpu,
    graph::{Buffer, Graph, Runner},
    rays::{RayHandles, Rays},
    scene::{Pose, resident::Resident},
    shaders::{
        consts::{FIV_FLOATS, FIV_SUN_SIDE, TRACE_STEPS},
        fiv, types,
    },
};

/// Points of a dispatch at most: a guaranteed count of work groups.
const MOST_POINTS: u32 = 16_384;
/// Rays of a dispatch, about: some milliseconds on a GPU.
const MOST_RAYS: u64 = 1 << 22;
/// Turns of loops of one invocation where a driver ends loops early: two rays of the longest.
const TURNS_LIMITED: u64 = 2 * TRACE_STEPS as u64;
/// Tiles of one invocation otherwise: a face of 32×32.
const TILES: u64 = 16;
/// A point from which more than this part of the sphere is hidden lies inside; scans have holes.
const INSIDE: f32 = 0.95;

/// Tiles that an invocation can go through.
pub(super) fn tiles(gpu: &Gpu, rays: &Rays) -> Result<u64> {
    Ok(match gpu.loop_limit()? {
        Some(_) => (TURNS_LIMITED / rays.most_turns().max(1)).clamp(1, TILES),
        None => TILES,
    })
}

/// Radius of the sphere outside of which rays are not traced, metres: rounding must not lose what touches it.
pub(super) fn reach(radius: f32) -> f32 {
    radius * 1.0001
}

/// Solid angle from which on a point counts as inside, sr.
pub(super) fn inside() -> f32 {
    INSIDE * 4.0 * std::f32::consts::PI
}

/// An occluder on a device.
#[derive(Debug)]
pub struct Cover<'a> {
    occluder: &'a Occluder,
    resident: Resident,
    rays: Rays,
    pose: Pose,
    tiles: u64,
    geometry_from_world: Mat3,
    parallel: Option<Parallel>,
}

/// What is hidden from some points, in their order.
#[derive(Clone, Copy, Debug)]
pub struct Covered {
    /// Nine floats each: x.rgb, y.rgb, z.rgb, W/m²; `FIV_INSIDE` where the point lies inside.
    pub fivs: Buffer,
    /// Solid angle that is hidden, sr.
    pub coverage: Buffer,
}

impl<'a> Cover<'a> {
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`; `Runtime` if the occluder is larger than the device's limits.
    pub fn new(gpu: &Gpu, occluder: &'a Occluder) -> Result<Self> {
        let resident = Resident::new(gpu, &occluder.scene)?;
        let rays = Rays::new(gpu, &occluder.scene, &resident)?;
        let tiles = tiles(gpu, &rays)?;
        let pose = Pose::rest(&occluder.scene);
        let geometry_from_world = Mat3::IDENTITY;
        Ok(Self { occluder, resident, rays, pose, tiles, geometry_from_world, parallel: None })
    }

    /// From now on points are looked up in pictures along the rays (`parallel`), where that is possible: not if it is turned.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`.
    pub fn look_up(&mut self, gpu: &Gpu, size: u32, split: u32) -> Result<()> {
        self.parallel = Parallel::new(gpu, self.occluder, (&mut self.resident, &mut self.rays), (size, split))?;
        Ok(())
    }

    /// From now on as `matrix`, a rotation, turns it around its centre. Points, places and vectors are in world axes.
    pub fn turn(&mut self, matrix: Mat3) {
        self.geometry_from_world = matrix.transpose();
    }

    /// Its rays in a frame.
    pub(super) fn rays(&mut self, graph: &mut Graph) -> RayHandles {
        let handles = self.resident.frame_in(graph, &self.occluder.scene, &self.pose);
        self.rays.frame(graph, &handles)
    }

    /// Declares the passes for `points`, seen from the centre of the occluder, metres. `split`: rays along the edge of a texel.
    pub fn declare(&mut self, graph: &mut Graph, light: &Light, points: &[Vec3], split: u32) -> Covered {
        let places: Vec<Place> = points.iter().map(|p| Place { point: *p, normal: Vec3::ZERO }).collect();
        self.passes(graph, light, &places, split, false)
    }

    /// Declares the passes for places on the occluder: what is *seen* from there of the environment in front of their planes, with its
    /// solid angle. Where that is nothing, `FIV_INSIDE`: such a place lies inside of other parts.
    pub fn declare_own(&mut self, graph: &mut Graph, light: &Light, places: &[Place], split: u32) -> Covered {
        self.passes(graph, light, places, split, true)
    }

    fn passes(&mut self, graph: &mut Graph, light: &Light, places: &[Place], split: u32, own: bool) -> Covered {
        let rays = self.rays(graph);
        let texels = graph.import_buffer(&light.texels);
        let point = |place: &Place| types::FivPoint { at: place.point.to_array(), turn: 0 };
        let points: Vec<types::FivPoint> = places.iter().map(point).collect();
        let list = graph.buffer_from("fiv.points", &points);
        let normals: Vec<[f32; 3]> =
            places.iter().take(if own { places.len() } else { 1 }).map(|p| p.normal.to_array()).collect();
        let normals = graph.buffer_from("fiv.normals", &normals);
        let stands = types::FivTurn {
            geometry_from_world: self.geometry_from_world.to_cols_array_2d(),
            centre: [0.0; 3],
            radius: reach(self.occluder.radius),
        };
        let turns = graph.buffer_from("fiv.turns", &[stands]);
        let total = places.len() as u32;
        let covered = Covered {
            fivs: graph.buffer("fiv.vectors", u64::from(total) * u64::from(FIV_FLOATS) * 4),
            coverage: graph.buffer("fiv.coverage", u64::from(total) * 4),
        };
        let row = light.size * split / 8;
        let all = 6 * row * row;
        let as_it_is = !own && self.geometry_from_world == Mat3::IDENTITY;
        let parallel = self.parallel.as_ref().filter(|parallel| as_it_is && parallel.fits(light, split));
        let chunks = parallel.map_or(all.div_ceil(self.tiles as u32), Parallel::chunks);
        // A tenth of the sphere from each point, about; half of it from the surface.
        let part = if own { 2 } else { 10 };
        let each = (MOST_RAYS / (u64::from(all) * 64 / part).max(1)).clamp(1, MOST_POINTS.into()) as u32;
        let partials = graph.buffer("fiv.partials", u64::from(each.min(total)) * u64::from(chunks) * 40);
        for first in (0..total).step_by(each as usize) {
            let count = each.min(total - first);
            if let Some(parallel) = parallel {
                parallel.declare(graph, (texels, list, partials), (first, count));
            } else {
                let args = crate::rays::traced!(
                    fiv::cover::Args {
                        texels,
                        points: list,
                        partials,
                        turns,
                        normals,
                        push: fiv::cover::Push {
                            first,
                            size: light.size,
                            split,
                            tiles: self.tiles as u32,
                            own: own.into(),
                        },
                    },
                    rays
                );
                graph.compute(args, [64 * count, chunks, 1]);
            }
            let inside = if own { 0.0 } else { inside() };
            let push = fiv::gather::Push { first, count, chunks, inside, own: own.into() };
            let (fivs, coverage) = (covered.fivs, covered.coverage);
            graph.compute(fiv::gather::Args { partials, fivs, coverage, push }, count);
        }
        covered
    }

    /// The vectors and the hidden solid angles (sr) of `points`, as [`Self::declare`], at once.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`.
    pub fn run(
        &mut self,
        runner: &mut Runner,
        light: &Light,
        points: &[Vec3],
        split: u32,
    ) -> Result<(Vec<f32>, Vec<f32>)> {
        if points.is_empty() {
            return Ok(Default::default());
        }
        let mut graph = Graph::new("fiv vectors");
        let covered = self.declare(&mut graph, light, points, split);
        read(runner, graph, covered)
    }

    /// The vectors and the seen solid angles (sr) of `places`, as [`Self::declare_own`], at once.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`.
    pub fn run_own(
        &mut self,
        runner: &mut Runner,
        light: &Light,
        places: &[Place],
        split: u32,
    ) -> Result<(Vec<f32>, Vec<f32>)> {
        if places.is_empty() {
            return Ok(Default::default());
        }
        let mut graph = Graph::new("fiv own vectors");
        let covered = self.declare_own(&mut graph, light, places, split);
        read(runner, graph, covered)
    }

    /// How far the occluder reaches towards a light, metres from its centre, on a plane across it ([`super::suns`]). Unit vectors: to the
    /// light, the map's axes.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`.
    pub fn run_map(&mut self, runner: &mut Runner, [direction, right, up]: [Vec3; 3]) -> Result<Vec<f32>> {
        let mut graph = Graph::new("fiv sun");
        let handles = self.resident.frame_in(&mut graph, &self.occluder.scene, &self.pose);
        let rays = self.rays.frame(&mut graph, &handles);
        let depths = graph.buffer("fiv.depths", 4 * u64::from(suns::FLOATS));
        let push = fiv::sun_map::Push {
            direction: direction.to_array(),
            right: right.to_array(),
            up: up.to_array(),
            radius: self.occluder.radius,
        };
        graph.compute(crate::rays::traced!(fiv::sun_map::Args { depths, push }, rays), [FIV_SUN_SIDE, FIV_SUN_SIDE]);
        let token = graph.read_buffer(depths);
        Ok(runner.run(graph)?.buffer(token))
    }
}

fn read(runner: &mut Runner, mut graph: Graph, covered: Covered) -> Result<(Vec<f32>, Vec<f32>)> {
    let tokens = [covered.fivs, covered.coverage].map(|buffer| graph.read_buffer(buffer));
    let frame = runner.run(graph)?;
    Ok((frame.buffer(tokens[0]), frame.buffer(tokens[1])))
}
