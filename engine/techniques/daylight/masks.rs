//! Sun masks: at which times of the day the sun is seen from both sides of the cells of all triangles (`shaders-glsl/daylight/masks.glsl`). With
//! them a vertex of a path reads a bit for each time instead of tracing a ray. The visibility of a side of a cell is that of one random point in it
//! that is not under a thing.

use std::mem::offset_of;

use glam::Vec3;

use super::{
    Baking, Plan, Transport,
    lightmap::placed,
    suns::{Paths, Share, times_of, words},
};
use crate::{
    Error, Result,
    gpu::{BufferDesc, Gpu, OwnedBuffer},
    graph::{Buffer, Graph},
    rays::{RayHandles, traced},
    resident,
    scene::{Pose, Scene},
    shaders::{
        daylight::{mask_points, sun_masks},
        types,
    },
};

/// Bytes of all bits, and of the cells of all triangles, at most: every device allows buffers of 128 MiB.
const MOST_BYTES: u64 = 128 << 20;
/// Largest distance of points, metres: that of the setting.
const WIDEST: f32 = 1000.0;
/// Columns and rows of a triangle at most.
const MOST_SIDE: f32 = 32_767.0;

/// The cells of a scene at rest.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cells {
    /// All triangles of instance 0, then of instance 1, and so on.
    pub triangles: Vec<types::DayCells>,
    /// The first triangle of each instance.
    pub firsts: Vec<u32>,
    /// Cells of all triangles; each has a mask for either side.
    pub count: u32,
}

impl Cells {
    /// The cells for a bake of `times` times; none if `settings` ask for exact shadow rays.
    ///
    /// # Errors
    /// `Usage` if there are too many, with a distance that is allowed.
    pub fn new(scene: &Scene, settings: &Baking, times: usize) -> Result<Self> {
        let spacing = settings.sun_masks;
        if spacing <= 0.0 || times == 0 {
            return Ok(Self::default());
        }
        let corners = Corners::of(scene);
        let most = MOST_BYTES / bytes_of_cell(times);
        let count = corners.cells(spacing);
        let triangles = corners.of_instances.iter().map(Vec::len).sum::<usize>() * size_of::<types::DayCells>();
        if triangles as u64 > MOST_BYTES {
            let [found, most] = [triangles as u64, MOST_BYTES].map(|bytes| bytes / size_of::<types::DayCells>() as u64);
            let what = format!("masks of {found} triangles; at most {most} are allowed");
            return Err(Error::usage(what).at("bake.sun_masks").help("0 asks for exact shadow rays"));
        }
        if count <= most {
            return Ok(corners.divided(spacing));
        }
        let what = format!("{spacing} m: {count} points for {times} times; at most {most} are allowed");
        let error = Error::usage(what).at("bake.sun_masks");
        let mut wider = spacing;
        while corners.cells(wider) > most && wider < WIDEST {
            wider *= 1.1;
        }
        Err(match wider < WIDEST {
            true => error.help(format!("Choose at least {} m, or 0 for exact shadow rays", up(wider))),
            false => error.help("The scene has too many triangles for masks; 0 asks for exact shadow rays"),
        })
    }

    /// Bytes of the masks.
    pub fn bytes(&self, times: usize) -> u64 {
        u64::from(self.count) * bytes_of_cell(times)
    }
}

/// A bit for each side and time, in whole words.
fn bytes_of_cell(times: usize) -> u64 {
    8 * u64::from(words(times))
}

/// Rounded up to two digits.
fn up(metres: f32) -> f32 {
    let unit = 10f32.powf(metres.log10().floor() - 1.0);
    ((metres / unit).ceil() * unit * 1e6).round() / 1e6
}

/// The corners of all triangles in the world, metres. Meshes that bend have the corners from before they bend. Only the size of their cells follows
/// from these.
struct Corners {
    of_instances: Vec<Vec<[Vec3; 3]>>,
}

impl Corners {
    fn of(scene: &Scene) -> Self {
        let pose = Pose::rest(scene);
        let of_instance = |(node, _, _, primitive): (usize, usize, usize, &crate::scene::Primitive)| {
            let world = pose.world[node];
            let at = |index: u32| {
                let position = primitive.positions.get(index as usize).copied().unwrap_or_default();
                world.transform_point3(position)
            };
            primitive.indices.chunks_exact(3).map(|t| [at(t[0]), at(t[1]), at(t[2])]).collect()
        };
        Self { of_instances: placed(scene).map(of_instance).collect() }
    }

    fn cells(&self, spacing: f32) -> u64 {
        let cells = |corners: &[Vec3; 3]| {
            let Grid { columns, rows, .. } = Grid::new(corners, spacing);
            u64::from(columns) * u64::from(rows)
        };
        self.of_instances.iter().flatten().map(cells).sum()
    }

    fn divided(&self, spacing: f32) -> Cells {
        let mut out = Cells::default();
        for triangles in &self.of_instances {
            out.firsts.push(out.triangles.len() as u32);
            for corners in triangles {
                let Grid { base, columns, rows, foot } = Grid::new(corners, spacing);
                out.triangles.push(types::DayCells { first: out.count, size: columns | rows << 15 | base << 30, foot });
                out.count += columns * rows;
            }
        }
        out
    }
}

/// The cells of a triangle.
struct Grid {
    /// The corner at which the longest side begins.
    base: u32,
    columns: u32,
    rows: u32,
    /// Of the height on the longest side, as a share of that side.
    foot: f32,
}

impl Grid {
    fn new(corners: &[Vec3; 3], spacing: f32) -> Self {
        let side = |base: usize| corners[(base + 1) % 3] - corners[base];
        let longest = (0..3).max_by(|a, b| side(*a).length_squared().total_cmp(&side(*b).length_squared()));
        let base = longest.unwrap_or(0);
        let (along, to_apex) = (side(base), corners[(base + 2) % 3] - corners[base]);
        let length = along.length();
        let foot = (to_apex.dot(along) / along.length_squared()).clamp(0.0, 1.0);
        // A triangle without an area, or with corners that are not finite, has one cell.
        let foot = if foot.is_finite() { foot } else { 0.0 };
        let height = (to_apex - foot * along).length();
        // Corners that are not finite count as one step.
        let steps = |metres: f32| if metres > spacing { (metres / spacing).ceil().min(MOST_SIDE) as u32 } else { 1 };
        Self { base: base as u32, columns: steps(length), rows: steps(height), foot }
    }
}

/// The masks of a bake on its device. A mask is computed when the first path requests for it, so that a bake of few texels computes few.
#[derive(Debug)]
pub(super) struct Masks {
    cells: OwnedBuffer,
    firsts: OwnedBuffer,
    bits: OwnedBuffer,
    /// A bit for each side of a cell: whether its mask is there.
    known: OwnedBuffer,
    count: u32,
    triangles: u32,
    instances: u32,
    /// Metres.
    spacing: f32,
    /// Of 32 times each.
    words: u32,
    /// Whether `bits` and `known` have to be cleared.
    pub dirty: bool,
}

/// The buffers of masks in a graph.
#[derive(Clone, Copy, Debug)]
pub(super) struct Handles {
    pub cells: Buffer,
    pub cell_firsts: Buffer,
    pub bits: Buffer,
    pub known: Buffer,
    pub wanted: Buffer,
    pub requests: Buffer,
    /// Masks that may be requested.
    most: u64,
    /// 0: no masks are wanted.
    words: u32,
}

impl Handles {
    /// Whether masks say from where the sun is seen.
    pub fn wanted(self) -> bool {
        self.words > 0
    }
}

impl Masks {
    /// For exact shadow rays: the passes of both ways have the same buffers.
    pub fn none(gpu: &Gpu) -> Result<Self> {
        Self::of(gpu, Cells::default(), (0.0, 0))
    }

    /// Masks of which none is computed.
    pub fn new(gpu: &Gpu, scene: &Scene, plan: &Plan) -> Result<Self> {
        let times = plan.times.len();
        Self::of(gpu, Cells::new(scene, &plan.settings, times)?, (plan.settings.sun_masks, times))
    }

    fn of(gpu: &Gpu, cells: Cells, (spacing, times): (f32, usize)) -> Result<Self> {
        let Cells { mut triangles, mut firsts, count } = cells;
        let (of_all, instances) = (triangles.len() as u32, firsts.len() as u32);
        triangles.push(types::DayCells::default());
        firsts.push(of_all);
        let words = if count == 0 { 0 } else { words(times) };
        let zeros = |name, words: u64| OwnedBuffer::new(gpu, name, BufferDesc::device((4 * words).max(16)));
        Ok(Self {
            cells: OwnedBuffer::with_contents(gpu, "daylight.cells", bytemuck::cast_slice(&triangles))?,
            firsts: OwnedBuffer::with_contents(gpu, "daylight.cell-firsts", bytemuck::cast_slice(&firsts))?,
            bits: zeros("daylight.sun-masks", 2 * u64::from(count) * u64::from(words))?,
            known: zeros("daylight.known-masks", (2 * u64::from(count)).div_ceil(32))?,
            count,
            triangles: of_all,
            instances,
            spacing,
            words,
            dirty: true,
        })
    }

    /// The buffers for a graph whose paths have at most `vertices` vertices. `words`: [`Transport::mask_words`].
    pub fn frame(&self, graph: &mut Graph, vertices: u64, words: u32, share: Share) -> Handles {
        let [cells, cell_firsts, bits, known] =
            [&self.cells, &self.firsts, &self.bits, &self.known].map(|buffer| graph.import_buffer(buffer));
        if self.dirty {
            graph.fill(bits, 0);
            graph.fill(known, 0);
        }
        let most = vertices.min(2 * u64::from(self.count)).max(1);
        let wanted = graph.buffer("daylight.wanted-masks", 4 * most);
        let requests = types::DayRequests { point_groups: [0, 1, 1], ray_groups: [0, share.rows(words), 1], count: 0 };
        let requests = graph.buffer_from("daylight.requests", &[requests]);
        Handles { cells, cell_firsts, bits, known, wanted, requests, most, words }
    }

    /// The passes that compute the masks that the paths of the pass before requested.
    pub fn compute(
        &self,
        graph: &mut Graph,
        paths: Paths,
        (suns, times): (Buffer, u32),
        (handles, rays): (&resident::Handles, RayHandles),
        masks: Handles,
        most_turns: u64,
    ) {
        let Handles { cells, cell_firsts, bits, wanted, requests, most, .. } = masks;
        let settings = paths.settings;
        // About half of all vertices are there.
        let points = (u64::from(paths.count()) * paths.bounces.div_ceil(2)).min(most);
        let mask_points = graph.buffer("daylight.mask-points", most * size_of::<types::DayMaskPoint>() as u64);
        let (triangles, instances) = (self.triangles, self.instances);
        let push = mask_points::Push { triangles, instances, spacing: self.spacing };
        let args = traced!(
            mask_points::Args { settings, wanted, requests, mask_points, cells, cell_firsts, push },
            rays,
            handles
        );
        graph.compute_indirect(args, requests, offset_of!(types::DayRequests, point_groups) as u64).rays(points);
        let push = sun_masks::Push { first: 0, count: times };
        let args = traced!(sun_masks::Args { settings, suns, mask_points, requests, bits, push }, rays, handles);
        let items = times_of(times, points, 1, most_turns);
        graph.compute_indirect_over(args, (requests, offset_of!(types::DayRequests, ray_groups) as u64), items);
    }
}

impl Transport {
    /// Words of a side of a cell of the masks, which are made the first time; 0: the plan wants exact shadow rays.
    pub(super) fn mask_words(&mut self, plan: &Plan) -> Result<u32> {
        if plan.settings.sun_masks <= 0.0 {
            return Ok(0);
        }
        if self.masks.words == 0 {
            self.masks = Masks::new(&self.gpu, &self.scene, plan)?;
        }
        Ok(self.masks.words)
    }
}

#[cfg(test)]
mod tests;
