//! Vectors of the light that an occluder hides, from many points at once, on the device.
//!
//! Rays through the middles of texels make the mask of an occluder on the cube map. They set the same texels as
//! rasterisation of the triangles. A distant occluder of a hundred thousand triangles covers a few texels. The cost of
//! rays depends on the number of texels, the cost of rasterisation on the number of triangles. On a CPU driver with the
//! Stanford bunny (69,451 triangles), one face of 32×32 texels took 75 ms by rasterisation, and a sample of six faces
//! took 3.2 ms by rays under the same load (mean of the 63,360 samples of the set 64×33×30). Rays respect cutouts of
//! surfaces.

use glam::{Mat3, Vec3};

use super::{light::Light, occluder::Occluder, parallel::Parallel, suns, surface::Place};
use crate::{
    Result,
    gpu::Gpu,
    graph::{Buffer, Graph, Runner},
    rays::{RayHandles, Rays},
    resident::Resident,
    scene::Pose,
    shaders::{
        consts::{FIV_FLOATS, FIV_SUN_SIDE, TRACE_STEPS},
        fiv, types,
    },
};

/// Most points of a dispatch, below the number of workgroups that Vulkan guarantees.
const MOST_POINTS: u32 = 16_384;
/// Rays of a dispatch, approximately, for some milliseconds on a GPU.
const MOST_RAYS: u64 = 1 << 22;
/// Most loop iterations of one invocation on drivers that end loops early: two rays of the longest traversal.
const TURNS_LIMITED: u64 = 2 * TRACE_STEPS as u64;
/// Tiles of one invocation on other drivers: a face of 32×32 texels.
const TILES: u64 = 16;
/// A point that sees an occluder in more than this share of the sphere lies inside the occluder. The share is below 1
/// because scanned meshes have holes.
const INSIDE: f32 = 0.95;

/// Most tiles that an invocation can process.
pub(super) fn tiles(gpu: &Gpu, rays: &Rays) -> Result<u64> {
    Ok(match gpu.loop_limit()? {
        Some(_) => (TURNS_LIMITED / rays.most_turns().max(1)).clamp(1, TILES),
        None => TILES,
    })
}

/// Radius of the sphere outside which no rays are traced, metres. Rounding must not lose surfaces that touch the
/// bounding sphere.
pub(super) fn reach(radius: f32) -> f32 {
    radius * 1.0001
}

/// Least hidden solid angle of a point inside an occluder, sr.
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

/// Results for a list of points, in their order.
#[derive(Clone, Copy, Debug)]
pub struct Covered {
    /// Nine floats per point: x.rgb, y.rgb, z.rgb, W/m²; `FIV_INSIDE` for points inside the occluder.
    pub fivs: Buffer,
    /// Hidden solid angle, sr.
    pub coverage: Buffer,
}

impl<'a> Cover<'a> {
    /// Uploads an occluder.
    ///
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

    /// Renders depth images along the rays (`parallel`). From now on masks come from these images where possible, which
    /// is not the case for rotated occluders.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`.
    pub fn look_up(&mut self, gpu: &Gpu, size: u32, split: u32) -> Result<()> {
        self.parallel = Parallel::new(gpu, self.occluder, (&mut self.resident, &mut self.rays), (size, split))?;
        Ok(())
    }

    /// Rotates the occluder about its centre by `matrix`. Points, samples and vectors stay in world axes.
    pub fn turn(&mut self, matrix: Mat3) {
        self.geometry_from_world = matrix.transpose();
    }

    /// The acceleration structure in a frame.
    pub(super) fn rays(&mut self, graph: &mut Graph) -> RayHandles {
        let handles = self.resident.frame_in(graph, &self.occluder.scene, &self.pose);
        self.rays.frame(graph, &handles)
    }

    /// Declares the passes that compute the vectors for `points`, relative to the centre of the occluder, metres.
    /// `split`: rays along the edge of a texel.
    pub fn declare(&mut self, graph: &mut Graph, light: &Light, points: &[Vec3], split: u32) -> Covered {
        let places: Vec<Place> = points.iter().map(|p| Place { point: *p, normal: Vec3::ZERO }).collect();
        self.passes(graph, light, &places, split, false)
    }

    /// Declares the passes for samples on the surface. They compute the vector of the light that is *visible* in front
    /// of the plane of each sample, with the visible solid angle. A sample that sees no light lies inside other parts
    /// and gets `FIV_INSIDE`.
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
        // Estimate of the rays that reach the bounding sphere: a tenth of the directions from each point, a half from
        // the surface.
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

    /// Computes the vectors and the hidden solid angles (sr) of `points`, as [`Self::declare`], and waits for them.
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

    /// Computes the vectors and the visible solid angles (sr) of `places`, as [`Self::declare_own`], and waits for
    /// them.
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

    /// Renders the shadow map of a separated texel ([`super::suns`]): the extent of the occluder towards the light,
    /// metres from its centre, on a plane across the light's direction. The argument has unit vectors: to the light,
    /// and the two axes of the map.
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
