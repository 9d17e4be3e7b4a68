//! The lightmap of a bake for a free camera: where each triangle of each instance has its texels, and the surface point of each texel.

use glam::Vec2;

use super::{
    Baking,
    atlas::{self, Atlas, Instance, MeshInput, Texel, texels, touched_by},
};
use crate::{
    Error, Result,
    scene::{Pose, Primitive, Scene},
    shaders::types,
};

/// Parts of a texel in which corners are stored.
const PARTS: f32 = 16.0;
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

/// Where the triangles of a scene are in a lightmap: their corners in sixteenths of a texel.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Corners {
    /// All triangles of instance 0, then of instance 1, and so on.
    pub fronts: Vec<[u16; 6]>,
    /// The numbers of the triangles whose backs have texels of their own, ascending, and the corners of their backs. The back of any other
    /// two-sided triangle takes the light of its front if there is no entry at all, and else no light.
    pub backs: Vec<(u32, [u16; 6])>,
}

/// The place of a back that has none.
const NOWHERE: [u16; 6] = [u16::MAX; 6];

impl Corners {
    pub fn is_empty(&self) -> bool {
        self.fronts.is_empty()
    }

    /// The corners of all fronts, and then of all backs if there are any, as the device reads them (`daylight/place.vert`).
    pub(super) fn listed(&self) -> Vec<[u16; 6]> {
        let mut all = self.fronts.clone();
        if !self.backs.is_empty() {
            all.resize(2 * self.fronts.len(), NOWHERE);
            for (triangle, corners) in &self.backs {
                all[self.fronts.len() + *triangle as usize] = *corners;
            }
        }
        all
    }

    /// The bytes in a file: six numbers of 16 bits for each front, and for each back the number of its triangle, 32 bits, before such numbers.
    pub(super) fn encode(&self) -> Vec<u8> {
        let mut out = Vec::with_capacity(Self::bytes(self.fronts.len() as u64, self.backs.len() as u64) as usize);
        self.fronts.iter().flatten().for_each(|number| out.extend(number.to_le_bytes()));
        for (triangle, corners) in &self.backs {
            out.extend(triangle.to_le_bytes());
            corners.iter().for_each(|number| out.extend(number.to_le_bytes()));
        }
        out
    }

    /// The number of those bytes.
    pub(super) fn bytes(fronts: u64, backs: u64) -> u64 {
        fronts.saturating_mul(12).saturating_add(backs.saturating_mul(16))
    }

    /// Reads those bytes. `fronts`: their number.
    ///
    /// # Errors
    /// A sentence that names the first number that is impossible.
    pub(super) fn decode(bytes: &[u8], fronts: u64) -> Result<Self, String> {
        let numbers = |bytes: &[u8]| std::array::from_fn(|i| u16::from_le_bytes([bytes[2 * i], bytes[2 * i + 1]]));
        let (of_fronts, of_backs) = bytes.split_at((12 * fronts as usize).min(bytes.len()));
        let back = |bytes: &[u8; 16]| {
            let [a, b, c, d, ..] = *bytes;
            (u32::from_le_bytes([a, b, c, d]), numbers(&bytes[4..]))
        };
        let out = Self {
            fronts: of_fronts.chunks_exact(12).map(numbers).collect(),
            backs: of_backs.as_chunks().0.iter().map(back).collect(),
        };
        out.check().map(|()| out)
    }

    /// Checks the numbers of triangles.
    ///
    /// # Errors
    /// A sentence that names the first one that is impossible.
    fn check(&self) -> Result<(), String> {
        let count = self.fronts.len() as u32;
        if let Some((triangle, _)) = self.backs.iter().find(|(triangle, _)| *triangle >= count) {
            return Err(format!("has a place for the back of triangle {triangle}, of {count}"));
        }
        match self.backs.windows(2).find(|pair| pair[0].0 >= pair[1].0) {
            Some(pair) => Err(format!("has the back of triangle {} after that of {}", pair[1].0, pair[0].0)),
            None => Ok(()),
        }
    }
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

/// Unwraps a scene at rest. `backs`: for each triangle whether its back gets texels of its own ([`Backs::lit`](super::Backs)); empty: no back does.
///
/// # Errors
/// `Input` if the scene has no triangles or positions that are not finite; `Usage` if the lightmap would be too large.
pub fn unwrap(scene: &Scene, settings: &Baking, backs: &[bool]) -> Result<Unwrapped> {
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
    debug_assert!(backs.is_empty() || backs.len() == count);
    if backs.contains(&true) {
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
    let built = atlas::build(&meshes, &instances, &wishes).map_err(Error::input)?;
    let mut fronts: Vec<[u16; 6]> = built.corners.iter().map(|corners| sixteenths(*corners)).collect();
    // Texels are those of the corners as they are stored.
    let rounded = Atlas { corners: fronts.iter().map(|c| position(*c)).collect(), ..built };
    let of_backs = fronts.split_off(count.min(fronts.len()));
    let backs = (0..).zip(of_backs).filter(|(_, corners)| *corners != NOWHERE).collect();
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

/// Corners as they are stored.
fn sixteenths([a, b, c]: [Vec2; 3]) -> [u16; 6] {
    if !a.is_finite() {
        return NOWHERE;
    }
    [a.x, a.y, b.x, b.y, c.x, c.y].map(|value| (value * PARTS).round().clamp(0.0, 65535.0) as u16)
}

/// Corners in texels; infinite for a back without texels.
pub fn position(corners: [u16; 6]) -> [Vec2; 3] {
    if corners == NOWHERE {
        return [Vec2::INFINITY; 3];
    }
    let at = |i: usize| Vec2::new(f32::from(corners[2 * i]), f32::from(corners[2 * i + 1])) / PARTS;
    [at(0), at(1), at(2)]
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_come_back_and_impossible_triangles_are_named() {
        let place = |at: u16| [at, 0, at + 16, 0, at, 16];
        let corners =
            Corners { fronts: vec![place(16), place(48), place(80)], backs: vec![(0, place(112)), (2, place(144))] };
        let bytes = corners.encode();
        assert_eq!(bytes.len() as u64, Corners::bytes(3, 2));
        assert_eq!(Corners::decode(&bytes, 3).as_ref(), Ok(&corners));
        assert_eq!(corners.listed()[3..], [place(112), NOWHERE, place(144)]);
        assert_eq!(Corners { backs: Vec::new(), ..corners.clone() }.listed().len(), 3);
        assert_eq!(Corners::decode(&[], 0), Ok(Corners::default()));
        let with = |backs| Corners { backs, ..corners.clone() }.encode();
        let error = Corners::decode(&with(vec![(3, place(112))]), 3).unwrap_err();
        assert!(error.contains("back of triangle 3, of 3"), "{error}");
        for wrong in [[2, 0], [1, 1]] {
            let error = Corners::decode(&with(wrong.map(|triangle| (triangle, place(112))).to_vec()), 3).unwrap_err();
            assert!(error.contains(&format!("triangle {} after that of {}", wrong[1], wrong[0])), "{error}");
        }
    }

    #[test]
    fn places_are_stored_in_sixteenths_of_a_texel() {
        let corners = [Vec2::new(4.0, 8.5), Vec2::new(4091.0, 8.5), Vec2::new(4.0, 9.0625)];
        assert_eq!(position(sixteenths(corners)), corners);
        assert_eq!(sixteenths([Vec2::INFINITY; 3]), NOWHERE);
        assert!(!position(NOWHERE)[0].is_finite());
    }
}
