//! Vertex and index streams: every primitive once, and a range of its own for each instance that is deformed.

use crate::{
    Error, ErrorKind, Result,
    scene::{Aabb, Primitive, Scene},
};

/// "Not there" in the shaders (`NONE` in `lib/scene.glsl`).
pub(super) const NONE: u32 = u32::MAX;

/// Where the data of a primitive lie in the streams.
#[derive(Clone, Copy, Debug)]
pub(super) struct Range {
    pub first_vertex: u32,
    pub vertices: u32,
    pub uv_first: [u32; 4],
    pub color_first: u32,
    pub first_index: u32,
    pub indices: u32,
    pub material: u32,
    /// Local to the mesh, undeformed.
    pub bounds: Aabb,
}

/// The streams of a scene on the host.
#[derive(Debug, Default)]
pub(super) struct Streams {
    pub positions: Vec<[f32; 3]>,
    pub normals: Vec<[f32; 3]>,
    pub tangents: Vec<[f32; 4]>,
    pub uvs: Vec<[f32; 2]>,
    pub colors: Vec<[f32; 4]>,
    pub indices: Vec<u32>,
    /// For each mesh, for each primitive.
    pub ranges: Vec<Vec<Range>>,
}

impl Streams {
    /// # Errors
    /// `Runtime` if there are more vertices or indices than 32-bit numbers can count.
    pub fn new(scene: &Scene) -> Result<Self> {
        let mut streams = Self::default();
        for mesh in &scene.meshes {
            let ranges = mesh.primitives.iter().map(|p| streams.add(p)).collect::<Result<Vec<_>>>()?;
            streams.ranges.push(ranges);
        }
        Ok(streams)
    }

    fn add(&mut self, primitive: &Primitive) -> Result<Range> {
        let vertices = primitive.positions.len();
        let first_vertex = offset(self.positions.len(), vertices)?;
        self.positions.extend(primitive.positions.iter().map(|p| p.to_array()));
        self.normals.extend(primitive.normals.iter().map(|n| n.to_array()));
        self.tangents.extend(primitive.tangents.iter().map(|t| t.to_array()));
        // A scene that was not validated must not shift the streams against each other.
        self.normals.resize(self.positions.len(), [0.0, 0.0, 1.0]);
        self.tangents.resize(self.positions.len(), [0.0; 4]);
        let mut uv_first = [NONE; 4];
        for (set, first) in primitive.uvs.iter().zip(&mut uv_first).filter(|(set, _)| set.len() == vertices) {
            *first = offset(self.uvs.len(), vertices)?;
            self.uvs.extend(set.iter().map(|uv| uv.to_array()));
        }
        let mut color_first = NONE;
        if primitive.colors.len() == vertices && vertices > 0 {
            color_first = offset(self.colors.len(), vertices)?;
            self.colors.extend(primitive.colors.iter().map(|c| c.to_array()));
        }
        let first_index = offset(self.indices.len(), primitive.indices.len())?;
        self.indices.extend_from_slice(&primitive.indices);
        Ok(Range {
            first_vertex,
            vertices: vertices as u32,
            uv_first,
            color_first,
            first_index,
            indices: primitive.indices.len() as u32,
            material: primitive.material,
            bounds: Aabb::of(primitive.positions.iter().copied()),
        })
    }

    /// Room for a morphed copy of one set of texture coordinates: its first element.
    ///
    /// # Errors
    /// As [`Streams::new`].
    pub fn reserve_uvs(&mut self, first: u32, vertices: u32) -> Result<u32> {
        let copy = offset(self.uvs.len(), vertices as usize)?;
        self.uvs.extend_from_within(first as usize..(first + vertices) as usize);
        Ok(copy)
    }

    /// As [`Streams::reserve_uvs`], for colours.
    ///
    /// # Errors
    /// As [`Streams::new`].
    pub fn reserve_colors(&mut self, first: u32, vertices: u32) -> Result<u32> {
        let copy = offset(self.colors.len(), vertices as usize)?;
        self.colors.extend_from_within(first as usize..(first + vertices) as usize);
        Ok(copy)
    }

    /// Room for a deformed copy of `range`: its first vertex.
    ///
    /// # Errors
    /// As [`Streams::new`].
    pub fn reserve(&mut self, range: &Range) -> Result<u32> {
        let first = offset(self.positions.len(), range.vertices as usize)?;
        let from = range.first_vertex as usize..(range.first_vertex + range.vertices) as usize;
        self.positions.extend_from_within(from.clone());
        self.normals.extend_from_within(from.clone());
        self.tangents.extend_from_within(from);
        Ok(first)
    }
}

/// `at` as a 32-bit offset of `count` elements.
fn offset(at: usize, count: usize) -> Result<u32> {
    match u32::try_from(at) {
        // Byte offsets inside shaders are 32-bit as well.
        Ok(first) if (at + count) as u64 * 16 <= u64::from(u32::MAX) => Ok(first),
        _ => Err(Error::new(
            ErrorKind::Runtime,
            format!("the scene has more vertices or indices than fit into a buffer of 4 GiB ({})", at + count),
        )
        .help("Split the scene, or use one with fewer triangles")),
    }
}
