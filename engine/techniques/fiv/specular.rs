//! Glossy reflection of the environment with shadows of occluders.
//!
//! The thesis proposes glossy reflection as future work (chapter 6): for a fixed view the half vectors of all light are
//! known, and vectors for the powers of their cosine with the normal would give Phong's lobe. A GGX lobe of roughness
//! 0.3 would need hundreds of powers for a single view. The method here works for any view and any roughness. It stores
//! for each cell of the environment (4×4 texels) the share of the cell's light that the occluder hides, one byte per
//! cell, for the same samples as the vectors. A pixel then reflects
//!
//!   unshadowed × (Σ cells reflected × Π (1 - share of each occluder)) / (Σ cells reflected),
//!
//! channel by channel. The sum over all texels, or the prefiltered environment, gives the unshadowed light. The cells
//! give the share of this light that is left. The result is never negative, it equals the unshadowed light without
//! occluders, and it is zero if an occluder hides all light. Cells behind the surface reflect nothing, so cut occluders
//! need no correction, and several occluders overlap cell by cell.
//!
//! The light of a texel or a cell is a lobe. The width of this lobe widens the distribution of normals, so that
//! surfaces smoother than the resolution of the environment show texels as areas and not as points. Brute force uses
//! the same lobes for texels.
//!
//! Shadows of an occluder on its own reflections and reflections of occluders are left out.

use glam::{DVec3, Mat3, Vec3};

use super::{
    Fiv, Occluders, Plan, Sky, Specular,
    cover::{self, Cover},
    occluder_rotation,
    settings::Settings,
    sky,
};
use crate::{
    Error, ErrorKind, Result,
    gpu::{Gpu, OwnedBuffer},
    graph::{Buffer, Format, Graph, Image, Items, Runner},
    passes::gbuffer::GBuffer,
    resident::Handles,
    scene::Pose,
    shaders::{consts::FIV_CELL, fiv, types},
};

/// Points of a run of the device.
const BATCH: usize = 4096;
/// Most loop iterations of one invocation.
const MOST_TURNS: u32 = 20_000;
/// Loop iterations for an occluder: eight samples of two rotation samples, and the rest.
const TURNS_EACH: u32 = 24;
/// Loop iterations for sixteen cells without occluders.
const TURNS_CELLS: u32 = 40;
/// Most rays of a dispatch, approximately.
const MOST_RAYS: u64 = 1 << 22;
/// Words of sixteen cells, which an invocation processes together.
const WORDS: u32 = 4;
/// Luminance of a linear Rec. 709 pixel.
const LUMINANCE: DVec3 = DVec3::new(0.2126, 0.7152, 0.0722);

/// Images and buffers that describe the occluders of a frame.
#[derive(Clone, Copy, Debug)]
pub struct Shadows {
    /// Number of the visible occluder of each pixel.
    pub identity: Image,
    pub occluders: Buffer,
    /// Vectors of all samples.
    pub fivs: Buffer,
    /// Occluders that may affect each tile of pixels, a bit each, and words per tile.
    pub near: (Buffer, u32),
    pub count: u32,
}

/// The cells of an environment: four cells of 4×4 texels for each tile of 8×8 texels. Tiles have the order of texels.
/// Within a tile the order is left top, right top, left bottom, right bottom.
#[derive(Clone, Debug)]
pub struct Cells {
    /// For each texel its share of the luminous power of its cell. In a black cell its share of the solid angle.
    pub weights: Vec<f32>,
    /// The light of each cell. Black cells fill the list up to a multiple of sixteen.
    pub lobes: Vec<types::FivLobe>,
}

impl Cells {
    /// Sums up the cells of an environment.
    ///
    /// # Panics
    /// Never for a sky that [`Sky::new`] made.
    pub fn of(sky: &Sky) -> Self {
        let count = 4 * words(sky.size) as usize;
        // Power, luminous power × direction, luminous power × solid angle, solid angle.
        let mut sums = vec![(DVec3::ZERO, DVec3::ZERO, 0.0, 0.0); count];
        for (i, radiance) in sky.radiance.iter().enumerate() {
            let (face, x, y) = sky::place(sky.size, i as u32);
            let angle = sky::solid_angle(sky.size, x, y);
            let power = radiance.as_dvec3() * angle;
            let sum = &mut sums[cell(sky.size, i as u32) as usize];
            sum.0 += power;
            sum.1 += sky::area(face, sky.size, x, y).normalize() * power.dot(LUMINANCE);
            sum.2 += angle * power.dot(LUMINANCE);
            sum.3 += angle;
        }
        let lobe = |(power, along, angle, _): &(DVec3, DVec3, f64, f64)| {
            let all = power.dot(LUMINANCE).max(1e-300);
            // The variance along each axis is the mean of 1 − cosine. Half vectors have half the angle.
            let apart = (1.0 - along.length() / all).clamp(0.0, 1.0);
            types::FivLobe {
                power: power.as_vec3().to_array(),
                spread: (0.5 * apart + angle / all / 24.0) as f32,
                direction: along.normalize_or_zero().as_vec3().to_array(),
                least: (0.25 * angle / all) as f32,
            }
        };
        let weight = |(i, radiance): (usize, &Vec3)| {
            let (_, x, y) = sky::place(sky.size, i as u32);
            let angle = sky::solid_angle(sky.size, x, y);
            let (power, .., angles) = sums[cell(sky.size, i as u32) as usize];
            let all = power.dot(LUMINANCE);
            let part = if all > 0.0 { radiance.as_dvec3().dot(LUMINANCE) * angle / all } else { angle / angles };
            part as f32
        };
        Self { weights: sky.radiance.iter().enumerate().map(weight).collect(), lobes: sums.iter().map(lobe).collect() }
    }
}

/// Number of the cell that contains a texel.
pub fn cell(size: u32, texel: u32) -> u32 {
    let (face, x, y) = sky::place(size, texel);
    let (tile, row) = (2 * FIV_CELL, size / (2 * FIV_CELL));
    4 * ((face * row + y / tile) * row + x / tile) + 2 * (y / FIV_CELL % 2) + x / FIV_CELL % 2
}

/// Words per sample, with four cells each.
pub fn words(size: u32) -> u32 {
    (6 * (size / (2 * FIV_CELL)).pow(2)).next_multiple_of(WORDS)
}

/// Data on the device for glossy reflection.
#[derive(Debug)]
pub struct Glossy {
    lobes: OwnedBuffer,
    /// [`words`] for each sample around the occluders: all rotation samples of the first kind, all of the second kind …
    shares: OwnedBuffer,
}

impl Glossy {
    /// Uploads the cells and computes the hidden share of each cell for all samples. `progress` receives the number of
    /// samples that are done and the number of all samples, and returns whether to go on.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`; `Runtime` if `progress` returns false.
    pub fn new(
        gpu: &Gpu,
        sky: &Sky,
        plan: &Plan,
        occluders: &Occluders,
        progress: impl FnMut(u64, u64) -> bool,
    ) -> Result<Self> {
        let cells = Cells::of(sky);
        let mut all = shares(gpu, sky.size, &cells, plan, occluders, progress)?;
        all.resize(all.len().max(1), 0);
        Ok(Self {
            lobes: OwnedBuffer::with_contents(gpu, "fiv.lobes", bytemuck::cast_slice(&cells.lobes))?,
            shares: OwnedBuffer::with_contents(gpu, "fiv.shares", bytemuck::cast_slice(&all))?,
        })
    }

    /// Bytes on the device.
    pub fn bytes(&self) -> u64 {
        self.lobes.size() + self.shares.size()
    }
}

/// Samples around one rotation sample of an occluder.
fn samples(plan: &Plan) -> u64 {
    plan.grid.count().into()
}

/// Number of samples whose shares are computed.
pub(super) fn all(plan: &Plan) -> u64 {
    samples(plan) * u64::from(plan.turns) * plan.occluders.len() as u64
}

/// Checks that reflections with `placed` occluders can be drawn, before anything is computed.
///
/// # Errors
/// `Runtime` if there is more than the device's limits allow.
pub(super) fn fits(gpu: &Gpu, plan: &Plan, placed: usize) -> Result<()> {
    turns(u32::try_from(placed).unwrap_or(u32::MAX))?;
    let (bytes, limit) = (4 * u64::from(words(plan.size)) * all(plan), gpu.caps().limits.storage_range);
    if bytes > limit {
        let what =
            format!("the shares that occluders hide of reflections have {bytes} bytes; the device allows {limit}");
        return Err(Error::new(ErrorKind::Runtime, what)
            .at("fiv.specular")
            .help("Take fewer samples (fiv.azimuths, fiv.polars, fiv.radii)"));
    }
    Ok(())
}

/// Loop iterations over `count` occluders for a step of the cells.
///
/// # Errors
/// `Runtime` with more than a shader can go through.
fn turns(count: u32) -> Result<u32> {
    let all = |count: u32| {
        let [words, count] = [count.div_ceil(32).max(1), count].map(u64::from);
        words + u64::from(TURNS_CELLS) + count * u64::from(TURNS_EACH)
    };
    let fits = |count: u32| u32::try_from(all(count)).ok().filter(|turns| *turns <= MOST_TURNS);
    fits(count).ok_or_else(|| {
        let most = (0..count).take_while(|count| fits(*count).is_some()).last().unwrap_or(0);
        let what = format!("{count} occluders; fiv.specular allows at most {most}");
        Error::new(ErrorKind::Runtime, what).at("fiv.specular").help("Join meshes into fewer nodes")
    })
}

fn shares(
    gpu: &Gpu,
    size: u32,
    cells: &Cells,
    plan: &Plan,
    occluders: &Occluders,
    mut progress: impl FnMut(u64, u64) -> bool,
) -> Result<Vec<u32>> {
    let words = words(size);
    let all = all(plan);
    let mut out: Vec<u32> = Vec::with_capacity((all * u64::from(words)) as usize);
    let mut runner = Runner::new(gpu);
    for (occluder, kind) in occluders.kinds.iter().zip(&plan.occluders) {
        let mut cover = Cover::new(gpu, occluder)?;
        for turn in 0..plan.turns {
            let matrix = occluder_rotation::matrix(turn, plan.turns, plan.turn_axis).as_mat3();
            let points: Vec<Vec3> =
                (0..plan.grid.count()).map(|sample| -kind.offset(&plan.grid, sample).as_vec3()).collect();
            for points in points.chunks(BATCH) {
                out.extend(masks(&mut cover, &mut runner, &cells.weights, size, points, (matrix, occluder.radius))?);
                if !progress(out.len() as u64 / u64::from(words), all) {
                    return Err(Error::new(ErrorKind::Runtime, "stopped while computing vectors").at("fiv"));
                }
            }
        }
    }
    Ok(out)
}

/// Shares of all cells that an occluder hides from `points` (relative to its centre, metres): [`words`] for each.
/// `matrix` rotates the occluder.
///
/// # Errors
/// `OutOfMemory`, `DeviceLost`.
pub fn masks(
    cover: &mut Cover<'_>,
    runner: &mut Runner,
    weights: &[f32],
    size: u32,
    points: &[Vec3],
    (matrix, radius): (Mat3, f32),
) -> Result<Vec<u32>> {
    let mut graph = Graph::new("fiv masks");
    let rays = cover.rays(&mut graph);
    let words = words(size);
    let tiles = 6 * (size / (2 * FIV_CELL)).pow(2);
    let list: Vec<types::FivPoint> = points.iter().map(|p| types::FivPoint { at: p.to_array(), turn: 0 }).collect();
    let stands = types::FivTurn {
        geometry_from_world: matrix.transpose().to_cols_array_2d(),
        centre: [0.0; 3],
        radius: cover::reach(radius),
    };
    let (weights, turns) = (graph.buffer_from("fiv.weights", weights), graph.buffer_from("fiv.turns", &[stands]));
    let list = graph.buffer_from("fiv.points", &list);
    // Estimate of the rays that reach the bounding sphere: a tenth of the directions.
    let each = (MOST_RAYS / u64::from(tiles * 64 / 10).max(1)).clamp(1, BATCH as u64) as usize;
    let mut tokens = Vec::new();
    for (number, some) in points.chunks(each).enumerate() {
        let shares = graph.buffer("fiv.shares", 4 * u64::from(words) * some.len() as u64);
        graph.fill(shares, 0);
        let push = fiv::specular_mask::Push { first: (number * each) as u32, size, words };
        let args = crate::rays::traced!(fiv::specular_mask::Args { weights, points: list, turns, shares, push }, rays);
        graph.compute(args, [64 * some.len() as u32, tiles, 1]);
        tokens.push(graph.read_buffer(shares));
    }
    let frame = runner.run(graph)?;
    Ok(tokens.into_iter().flat_map(|token| frame.buffer::<u32>(token)).collect())
}

impl Fiv {
    /// Adds glossily reflected light to `total`. Returns this light alone, W/(sr·m²).
    ///
    /// # Errors
    /// `Runtime` with more occluders than a shader can go through.
    pub(super) fn specular(
        &mut self,
        graph: &mut Graph,
        (pose, handles): (&Pose, &Handles),
        gbuffer: &GBuffer,
        settings: &Settings,
        shadows: Option<&Shadows>,
        total: Image,
    ) -> Result<Image> {
        let extent = graph.extent(gbuffer.depth);
        let reflected = graph.image("fiv.specular", Format::RGBA32F, extent);
        graph.clear(reflected, [0.0; 4]);
        if self.rays.is_some() && settings.method == super::Method::BruteForce {
            self.specular_truth(graph, handles, gbuffer, reflected);
        } else {
            self.specular_sum(graph, gbuffer, reflected);
        }
        let shadows = shadows.filter(|shadows| shadows.count > 0);
        let shared = match (shadows, &self.glossy) {
            (Some(shadows), Some(glossy)) => {
                Some(self.specular_share(graph, glossy, (pose, gbuffer), settings, shadows)?)
            }
            _ => None,
        };
        let (whole, left) = shared.unwrap_or((gbuffer.emission, gbuffer.emission));
        let (albedo, depth) = (gbuffer.albedo, gbuffer.depth);
        let spec = fiv::specular_add::Spec { shared: shared.is_some().into() };
        graph.compute(fiv::specular_add::Args { albedo, depth, whole, left, reflected, total, spec }, extent);
        Ok(reflected)
    }

    /// Reflected light without occluders.
    fn specular_sum(&self, graph: &mut Graph, gbuffer: &GBuffer, reflected: Image) {
        let extent = graph.extent(reflected);
        let (texels, lit) = self.light.import(graph);
        let args = fiv::specular_sum::Args {
            view: gbuffer.view,
            normal: gbuffer.normal,
            depth: gbuffer.depth,
            surface: gbuffer.specular,
            texels,
            lit,
            reflected,
            push: fiv::specular_sum::Push::default(),
        };
        // Sixteen texels take about as long as a ray.
        let texels = Items::new(self.light.lit.len() as u32).rays(extent.pixels() / 16);
        graph.compute_over(args, extent, texels);
    }

    /// Reflected light by one shadow ray to every texel that is not black.
    fn specular_truth(&mut self, graph: &mut Graph, handles: &Handles, gbuffer: &GBuffer, reflected: Image) {
        let extent = graph.extent(reflected);
        let Some(rays) = &mut self.rays else { return };
        if self.light.lit.is_empty() {
            return;
        }
        let turns = rays.most_turns();
        let rays = rays.frame(graph, handles);
        let (texels, lit) = self.light.import(graph);
        let args = crate::rays::traced!(
            fiv::specular_truth::Args {
                view: gbuffer.view,
                normal: gbuffer.normal,
                depth: gbuffer.depth,
                surface: gbuffer.specular,
                texels,
                lit,
                reflected,
                push: fiv::specular_truth::Push { size: self.light.size, seed: graph.seed, ..Default::default() },
            },
            rays
        );
        let texels = Items::new(self.light.lit.len() as u32).rays(extent.pixels()).turns(turns);
        graph.compute_over(args, extent, texels);
    }

    /// Reflected light of the cells, and the part of it that occluders leave visible.
    fn specular_share(
        &self,
        graph: &mut Graph,
        glossy: &Glossy,
        (pose, gbuffer): (&Pose, &GBuffer),
        settings: &Settings,
        shadows: &Shadows,
    ) -> Result<(Image, Image)> {
        let extent = graph.extent(gbuffer.depth);
        let [whole, left] =
            ["fiv.specular.whole", "fiv.specular.left"].map(|name| graph.image(name, Format::RGBA32F, extent));
        for image in [whole, left] {
            graph.clear(image, [0.0; 4]);
        }
        let turns = turns(shadows.count)?;
        let all = words(self.light.size);
        let (lobes, shares) = (graph.import_buffer(&glossy.lobes), graph.import_buffer(&glossy.shares));
        let places = graph.buffer_from("fiv.places", &self.share_places(pose, all));
        let args = fiv::specular_share::Args {
            view: gbuffer.view,
            normal: gbuffer.normal,
            depth: gbuffer.depth,
            surface: gbuffer.specular,
            identity: shadows.identity,
            occluders: shadows.occluders,
            fivs: shadows.fivs,
            lobes,
            shares,
            places,
            near: shadows.near.0,
            whole,
            left,
            push: fiv::specular_share::Push { all, words: shadows.near.1, ..Default::default() },
            spec: fiv::specular_share::Spec { trilinear: settings.trilinear.into() },
        };
        // Sixteen cells and eight occluders take about as long as a ray.
        let rays = extent.pixels() * u64::from(1 + shadows.count / 8);
        graph.compute_over(args, extent, Items::new(all / WORDS).rays(rays).turns(turns.into()));
        Ok((whole, left))
    }

    /// First word of each occluder and of its next rotation sample, with `words` words per sample.
    fn share_places(&self, pose: &Pose, words: u32) -> Vec<[u32; 2]> {
        let (turns, samples) = (self.plan.turns, self.plan.grid.count());
        let place = |placed: &super::Placed| {
            let (first, second, _) = occluder_rotation::between(self.angle(pose, placed.node).unwrap_or(0.0), turns);
            [first, second].map(|turn| (placed.kind * turns + turn) * samples * words)
        };
        self.occluders.placed.iter().map(place).collect()
    }
}

/// Whether these settings need the hidden shares of cells.
pub fn needed(settings: &Settings) -> bool {
    settings.specular != Specular::Off && settings.method == super::Method::Vectors
}
