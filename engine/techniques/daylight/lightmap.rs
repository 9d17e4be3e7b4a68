//! The lightmap of a bake for a free camera: where each triangle of each instance has its texels, and the surface point of each texel.

use glam::Vec2;

use super::{
    Baking,
    atlas::{self, Atlas, Instance, MeshInput, texels},
};
use crate::{
    Error, Result,
    scene::{Pose, Primitive, Scene},
    shaders::types,
};

/// Parts of a texel in which corners are stored.
const PARTS: f32 = 16.0;
/// Largest side of a lightmap: positions of corners have 16 bits.
pub const MOST_SIDE: u32 = 4092;

/// The lightmap of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Lightmap {
    /// Texels.
    pub extent: [u32; 2],
    /// The corners of each triangle in sixteenths of a texel: all triangles of instance 0, then of instance 1, and so on.
    pub corners: Vec<[u16; 6]>,
}

/// A lightmap, with what only a bake needs.
#[derive(Clone, Debug)]
pub struct Unwrapped {
    pub lightmap: Lightmap,
    pub charts: u32,
    /// The surface point of each covered texel, in the order of rows: its column and row, and the point.
    pub receivers: Vec<([u32; 2], types::Hit)>,
    /// Meshes that took a fallback, in whole sentences.
    pub notes: Vec<String>,
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

/// Unwraps a scene at rest.
///
/// # Errors
/// `Input` if the scene has no triangles or positions that are not finite; `Usage` if the lightmap would be too large.
pub fn unwrap(scene: &Scene, settings: &Baking) -> Result<Unwrapped> {
    let pose = Pose::rest(scene);
    let mut shapes: Vec<(usize, usize)> = Vec::new();
    let mut lists: Vec<Vec<[u32; 3]>> = Vec::new();
    let mut sources: Vec<&Primitive> = Vec::new();
    let mut instances = Vec::new();
    for (node, mesh, slot, primitive) in placed(scene) {
        let known = shapes.iter().position(|shape| *shape == (mesh, slot));
        let mesh = known.unwrap_or_else(|| {
            shapes.push((mesh, slot));
            lists.push(primitive.indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect());
            sources.push(primitive);
            shapes.len() - 1
        });
        instances.push(Instance { mesh, world_from_object: pose.world[node] });
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
    let built = atlas::build(&meshes, &instances, &wishes).map_err(Error::input)?;
    let corners: Vec<[u16; 6]> = built
        .corners
        .iter()
        .map(|corners| {
            let part = |value: f32| (value * PARTS).round().clamp(0.0, 65535.0) as u16;
            let [a, b, c] = corners;
            [a.x, a.y, b.x, b.y, c.x, c.y].map(part)
        })
        .collect();
    // Texels are those of the corners as they are stored.
    let rounded = Atlas { corners: corners.iter().map(|c| position(*c)).collect(), ..built };
    let counts: Vec<u32> = instances.iter().map(|instance| lists[instance.mesh].len() as u32).collect();
    let mut firsts = vec![0u32];
    for count in counts {
        firsts.push(firsts.last().copied().unwrap_or(0) + count);
    }
    let receivers = texels(&rounded)
        .into_iter()
        .map(|texel| {
            let instance = firsts.partition_point(|first| *first <= texel.triangle) - 1;
            let hit = types::Hit {
                t: 1.0,
                barycentrics: texel.barycentric,
                instance: instance as u32,
                triangle: texel.triangle - firsts[instance],
            };
            ([texel.x, texel.y], hit)
        })
        .collect();
    Ok(Unwrapped {
        lightmap: Lightmap { extent: [rounded.width, rounded.height], corners },
        charts: rounded.charts,
        receivers,
        notes: rounded.notes,
    })
}

/// Corners in texels.
pub fn position(corners: [u16; 6]) -> [Vec2; 3] {
    let at = |i: usize| Vec2::new(f32::from(corners[2 * i]), f32::from(corners[2 * i + 1])) / PARTS;
    [at(0), at(1), at(2)]
}

impl Unwrapped {
    /// The texels of each tile in the order of its rows: their numbers in the tile, and their surface points.
    pub fn by_tile(&self, side: u32) -> Vec<Vec<(u32, types::Hit)>> {
        let [columns, rows] = self.lightmap.extent.map(|texels| texels.div_ceil(side));
        let mut tiles = vec![Vec::new(); (columns * rows) as usize];
        for ([x, y], hit) in &self.receivers {
            let tile = y / side * columns + x / side;
            let width = side.min(self.lightmap.extent[0] - x / side * side);
            tiles[tile as usize].push((y % side * width + x % side, *hit));
        }
        tiles
    }
}
