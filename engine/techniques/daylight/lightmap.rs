//! The lightmap of a bake for a free camera: where each triangle of each instance has its texels, and the surface point of each texel.

use glam::Vec2;

pub use super::corners::{Corners, position};
use super::{
    Baking,
    atlas::{self, Atlas, Instance, MeshInput, Texel, texels, touched_by},
    corners::{NOWHERE, sixteenths},
};
use crate::{
    Error, Result,
    scene::{Pose, Primitive, Scene},
    shaders::types,
};

/// Side of the blocks of texels whose triangles are listed.
const BLOCK: u32 = 16;
/// Largest side of a lightmap: positions of corners have 16 bits.
pub const MOST_SIDE: u32 = 4092;

/// The lightmap of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Lightmap {
    /// Texels.
    pub extent: [u32; 2],
    pub corners: Corners,
}

/// A lightmap, with what only a bake needs.
#[derive(Clone, Debug)]
pub struct Unwrapped {
    pub lightmap: Lightmap,
    pub charts: u32,
    /// The covered texels in the order of rows, each with its surface point.
    pub receivers: Vec<(Texel, types::Hit)>,
    /// The number of the first triangle of each instance, and of all triangles.
    firsts: Vec<u32>,
    /// Meshes that took a fallback, in whole sentences.
    pub notes: Vec<String>,
}

/// A texel of a tile of a lightmap.
#[derive(Clone, Copy, Debug)]
pub struct Receiver {
    /// Its number in the tile.
    pub texel: u32,
    /// Its surface point: the centre, or the nearest point of its chart.
    pub hit: types::Hit,
    /// From the centre to that point, texels.
    pub offset: [f32; 2],
}

/// The texels of the tiles of a lightmap.
#[derive(Clone, Debug, Default)]
pub struct TileTexels {
    /// The texels of each tile in the order of its rows.
    pub tiles: Vec<Vec<Receiver>>,
    /// The triangles that may touch each block of [`BLOCK`] × [`BLOCK`] texels.
    triangles: Vec<Vec<u32>>,
    corners: Vec<[Vec2; 3]>,
    firsts: Vec<u32>,
    extent: [u32; 2],
    side: u32,
}

/// The primitives of a scene in the order of [`crate::resident::Moment::instances`], each with its node.
pub(super) fn placed(scene: &Scene) -> impl Iterator<Item = (usize, usize, usize, &Primitive)> {
    scene.nodes.iter().enumerate().filter_map(|(node, of)| Some((node, of.mesh? as usize))).flat_map(|(node, mesh)| {
        let primitives = scene.meshes.get(mesh).map_or(&[][..], |mesh| &mesh.primitives);
        let there = |(_, primitive): &(usize, &Primitive)| scene.materials.len() > primitive.material as usize;
        primitives.iter().enumerate().filter(there).map(move |(slot, primitive)| (node, mesh, slot, primitive))
    })
}

/// Number of triangles of each instance.
pub fn triangles(scene: &Scene) -> Vec<u32> {
    placed(scene).map(|(_, _, _, primitive)| primitive.indices.len() as u32 / 3).collect()
}

/// Unwraps a scene at rest. `backs`: for each triangle whether its back gets texels of its own ([`Backs::lit`](super::Backs)); `None`: backs show the
/// light of the fronts.
///
/// # Errors
/// `Input` if the scene has no triangles or positions that are not finite, if the lightmap would be too large, or if `backs` has another number of
/// triangles than the scene.
pub fn unwrap(scene: &Scene, settings: &Baking, backs: Option<&[bool]>) -> Result<Unwrapped> {
    let pose = Pose::rest(scene);
    let mut shapes: Vec<(usize, usize)> = Vec::new();
    let mut lists: Vec<Vec<[u32; 3]>> = Vec::new();
    let mut sources: Vec<&Primitive> = Vec::new();
    let mut instances = Vec::new();
    let mut firsts = vec![0u32];
    for (node, mesh, slot, primitive) in placed(scene) {
        let known = shapes.iter().position(|shape| *shape == (mesh, slot));
        let mesh = known.unwrap_or_else(|| {
            shapes.push((mesh, slot));
            lists.push(primitive.indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect());
            sources.push(primitive);
            shapes.len() - 1
        });
        instances.push(Instance { mesh, world_from_object: pose.world[node], wanted: None });
        firsts.push(firsts.last().copied().unwrap_or(0) + lists[mesh].len() as u32);
    }
    let count = firsts.last().copied().unwrap_or(0) as usize;
    let searched = backs.is_some();
    let backs = backs.unwrap_or_default();
    if searched && backs.len() != count {
        return Err(Error::input(format!("has {count} triangles, and the backs of {} were searched", backs.len())));
    }
    let has_backs = backs.contains(&true);
    if has_backs {
        let of_backs: Vec<_> = instances
            .iter()
            .zip(firsts.windows(2))
            .map(|(instance, of)| Instance { wanted: Some(&backs[of[0] as usize..of[1] as usize]), ..*instance })
            .collect();
        instances.extend(of_backs);
    }
    let meshes: Vec<MeshInput<'_>> = sources
        .iter()
        .zip(&lists)
        .map(|(primitive, triangles)| MeshInput {
            positions: &primitive.positions,
            triangles,
            uv2: primitive.uvs.get(1).map(Vec::as_slice),
        })
        .collect();
    let wishes = atlas::Settings {
        texels_per_metre: settings.density,
        max_size: settings.lightmap.min(MOST_SIDE),
        ..atlas::Settings::default()
    };
    let built = atlas::build(&meshes, &instances, &wishes).map_err(|what| {
        let error = Error::input(what);
        match has_backs {
            true => error.help("Or leave the backs of two-sided surfaces out: bake.backs=false"),
            false => error,
        }
    })?;
    let mut fronts: Vec<[u16; 6]> = built.corners.iter().map(|corners| sixteenths(*corners)).collect();
    // Texels are those of the corners as they are stored.
    let rounded = Atlas { corners: fronts.iter().map(|c| position(*c)).collect(), ..built };
    let of_backs = fronts.split_off(count.min(fronts.len()));
    let backs = searched.then(|| (0..).zip(of_backs).filter(|(_, corners)| *corners != NOWHERE).collect());
    let receivers =
        texels(&rounded).into_iter().map(|texel| (texel, hit_of(&firsts, texel.triangle, texel.barycentric))).collect();
    Ok(Unwrapped {
        lightmap: Lightmap { extent: [rounded.width, rounded.height], corners: Corners { fronts, backs } },
        charts: rounded.charts,
        receivers,
        firsts,
        notes: rounded.notes,
    })
}

/// The surface point of a triangle of a lightmap, whose `triangle` is among all fronts and then all backs. `firsts`: the number of the first triangle
/// of each instance, and of all.
fn hit_of(firsts: &[u32], triangle: u32, barycentrics: [f32; 2]) -> types::Hit {
    let count = firsts.last().copied().unwrap_or(0);
    let (triangle, t) = if triangle < count { (triangle, 1.0) } else { (triangle - count, -1.0) };
    let instance = firsts.partition_point(|first| *first <= triangle) - 1;
    types::Hit { t, barycentrics, instance: instance as u32, triangle: triangle - firsts[instance] }
}

impl Unwrapped {
    /// Number of texels on backs.
    pub fn on_backs(&self) -> u64 {
        self.receivers.iter().filter(|(_, hit)| hit.t < 0.0).count() as u64
    }

    /// The texels by tile. `side`: of a tile, texels.
    pub fn by_tile(&self, side: u32) -> TileTexels {
        let extent = self.lightmap.extent;
        let [columns, rows] = extent.map(|texels| texels.div_ceil(side));
        let mut tiles = vec![Vec::new(); (columns * rows) as usize];
        for (Texel { x, y, offset, .. }, hit) in &self.receivers {
            let tile = y / side * columns + x / side;
            let width = side.min(extent[0] - x / side * side);
            let texel = y % side * width + x % side;
            tiles[tile as usize].push(Receiver { texel, hit: *hit, offset: *offset });
        }
        let corners: Vec<[Vec2; 3]> = self.lightmap.corners.listed().into_iter().map(position).collect();
        let [columns, rows] = extent.map(|texels| texels.div_ceil(BLOCK));
        let mut triangles = vec![Vec::new(); (columns * rows) as usize];
        for (triangle, corners) in corners.iter().enumerate().filter(|(_, corners)| corners[0].is_finite()) {
            let [across, down] = touched_by(corners);
            for row in down.0 / BLOCK..=(down.1 / BLOCK).min(rows - 1) {
                for column in across.0 / BLOCK..=(across.1 / BLOCK).min(columns - 1) {
                    triangles[(row * columns + column) as usize].push(triangle as u32);
                }
            }
        }
        TileTexels { tiles, triangles, corners, firsts: self.firsts.clone(), extent, side }
    }
}

impl TileTexels {
    /// Places of a texel of a tile where its light can be gathered, the nearest to its centre first.
    pub(super) fn places(&self, tile: u32, texel: u32) -> Vec<types::Hit> {
        let columns = self.extent[0].div_ceil(self.side);
        let first = [tile % columns * self.side, tile / columns * self.side];
        let width = self.side.min(self.extent[0] - first[0]);
        let at = [first[0] + texel % width, first[1] + texel / width];
        let block = at[1] / BLOCK * self.extent[0].div_ceil(BLOCK) + at[0] / BLOCK;
        let triangles = self.triangles.get(block as usize).map_or(&[][..], Vec::as_slice);
        let found = atlas::spread(&self.corners, triangles, at).into_iter();
        found.map(|(triangle, barycentrics)| hit_of(&self.firsts, triangle, barycentrics)).collect()
    }
}
