//! The welded triangle surface that every chart method works on.

use glam::{DMat3, DVec3, Vec3};

/// Marks an edge without a neighbour.
pub(super) const NONE: u32 = u32::MAX;

/// The cosine of 1 degree, the limit between coplanar and bent.
pub(super) const COS_1_DEGREE: f64 = 0.999_847_695_156_391_2;

/// A triangle is degenerate if its altitude is at most this fraction of the mesh diagonal.
const MIN_ALTITUDE: f64 = 1.0e-6;

/// A triangle mesh whose vertices with equal positions are one vertex.
pub(super) struct Surface {
    /// The vertex positions in metres, relative to the centre of the bounds.
    pub(super) points: Vec<DVec3>,
    /// The three welded vertices of every triangle.
    pub(super) triangles: Vec<[u32; 3]>,
    /// The unit normal of every triangle, zero for a degenerate triangle.
    pub(super) normals: Vec<DVec3>,
    /// The area of every triangle in square metres, zero for a degenerate triangle.
    pub(super) areas: Vec<f64>,
    /// The neighbour across every edge `(k, k + 1)`, or [`NONE`].
    pub(super) neighbours: Vec<[u32; 3]>,
}

impl Surface {
    /// Welds a mesh and applies the linear map `shape` to it.
    ///
    /// The caller checks the indices and the positions first.
    pub(super) fn new(positions: &[Vec3], triangles: &[[u32; 3]], shape: DMat3) -> Self {
        let (welded, first) = weld(positions);
        let mut points: Vec<DVec3> =
            first.iter().map(|&vertex| shape * positions[vertex as usize].as_dvec3()).collect();
        let triangles: Vec<[u32; 3]> = triangles.iter().map(|t| t.map(|v| welded[v as usize])).collect();
        let mut low = DVec3::INFINITY;
        let mut high = DVec3::NEG_INFINITY;
        for &vertex in triangles.iter().flatten() {
            low = low.min(points[vertex as usize]);
            high = high.max(points[vertex as usize]);
        }
        if triangles.is_empty() {
            (low, high) = (DVec3::ZERO, DVec3::ZERO);
        }
        let centre = (low + high) * 0.5;
        for point in &mut points {
            *point -= centre;
        }
        let min_altitude = (high - low).length() * MIN_ALTITUDE;
        let mut normals = Vec::with_capacity(triangles.len());
        let mut areas = Vec::with_capacity(triangles.len());
        for triangle in &triangles {
            let [a, b, c] = triangle.map(|v| points[v as usize]);
            let cross = (b - a).cross(c - a);
            let length = cross.length();
            let longest = (b - a).length().max((c - b).length()).max((a - c).length());
            if longest > 0.0 && length / longest > min_altitude {
                normals.push(cross / length);
                areas.push(length * 0.5);
            } else {
                normals.push(DVec3::ZERO);
                areas.push(0.0);
            }
        }
        let neighbours = connect(&triangles, &normals, &areas);
        Self { points, triangles, normals, areas, neighbours }
    }

    /// Tells whether a triangle has no usable area.
    pub(super) fn is_degenerate(&self, triangle: u32) -> bool {
        self.areas[triangle as usize] <= 0.0
    }

    /// Gives the three corner positions of a triangle in metres.
    pub(super) fn corners(&self, triangle: u32) -> [DVec3; 3] {
        self.triangles[triangle as usize].map(|v| self.points[v as usize])
    }
}

/// Gives the welded vertex of every vertex, and the first vertex of every welded vertex.
pub(super) fn weld(positions: &[Vec3]) -> (Vec<u32>, Vec<u32>) {
    // The sum with zero turns -0 into 0, so that both weld.
    let key = |vertex: u32| (positions[vertex as usize] + Vec3::ZERO).to_array().map(f32::to_bits);
    let mut order: Vec<u32> = (0..positions.len() as u32).collect();
    order.sort_unstable_by_key(|&vertex| (key(vertex), vertex));
    // The number of a welded vertex follows the first vertex, so that the order stays that of the mesh.
    let mut leader = vec![0; positions.len()];
    for run in order.chunk_by(|&a, &b| key(a) == key(b)) {
        for &vertex in run {
            leader[vertex as usize] = run[0];
        }
    }
    let mut first = Vec::new();
    let mut welded = vec![0; positions.len()];
    for vertex in 0..positions.len() {
        if leader[vertex] as usize == vertex {
            welded[vertex] = first.len() as u32;
            first.push(vertex as u32);
        } else {
            welded[vertex] = welded[leader[vertex] as usize];
        }
    }
    (welded, first)
}

/// One side of an edge: the edge with ascending vertices, the direction, the triangle, the corner.
type HalfEdge = (u32, u32, bool, u32, u8);

/// Finds the neighbours of every triangle.
///
/// Two triangles are neighbours if they pass their edge in opposite directions. If more than two triangles share the
/// edge, only a pair without a rival within 1 degree is joined.
fn connect(triangles: &[[u32; 3]], normals: &[DVec3], areas: &[f64]) -> Vec<[u32; 3]> {
    let mut edges: Vec<HalfEdge> = Vec::with_capacity(triangles.len() * 3);
    for (index, triangle) in triangles.iter().enumerate() {
        if areas[index] > 0.0 {
            for corner in 0..3 {
                let (a, b) = (triangle[corner], triangle[(corner + 1) % 3]);
                edges.push((a.min(b), a.max(b), a > b, index as u32, corner as u8));
            }
        }
    }
    edges.sort_unstable();
    let mut neighbours = vec![[NONE; 3]; triangles.len()];
    for group in edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        let (forward, backward) = group.split_at(group.partition_point(|edge| !edge.2));
        let coplanar = |a: &HalfEdge, b: &HalfEdge| normals[a.3 as usize].dot(normals[b.3 as usize]) >= COS_1_DEGREE;
        let simple = forward.len() == 1 && backward.len() == 1;
        for edge in forward {
            let mut partners = backward.iter().filter(|other| simple || coplanar(edge, other));
            let (Some(partner), None) = (partners.next(), partners.next()) else {
                continue;
            };
            if !simple && forward.iter().filter(|other| coplanar(other, partner)).count() != 1 {
                continue;
            }
            neighbours[edge.3 as usize][edge.4 as usize] = partner.3;
            neighbours[partner.3 as usize][partner.4 as usize] = edge.3;
        }
    }
    neighbours
}
