//! Large polygons to triangles, in n log n steps for n corners.

use glam::DVec2;
use spade::{
    ConstrainedDelaunayTriangulation, HasPosition, Point2, Triangulation,
    handles::{FixedFaceHandle, InnerTag},
};
use std::collections::HashMap;

#[derive(Clone, Copy)]
struct Corner {
    at: Point2<f64>,
    number: usize,
}

impl HasPosition for Corner {
    type Scalar = f64;

    fn position(&self) -> Point2<f64> {
        self.at
    }
}

/// The triangles of a polygon that may be concave, counter-clockwise; `None` if its edges cross each other.
///
/// The Delaunay triangulation of the corners has the edges of the polygon in it; the triangles inside are those that an odd number of edges
/// parts from the outside. Edges that the outline takes there and back bound nothing.
pub fn triangulate(points: &[DVec2]) -> Option<Vec<[usize; 3]>> {
    let mut known: HashMap<[u64; 2], usize> = HashMap::new();
    let mut corners: Vec<Corner> = Vec::new();
    let mut place = |(number, point): (usize, &DVec2)| {
        // −0 and 0 are one place.
        *known.entry(point.to_array().map(|c| (c + 0.0).to_bits())).or_insert_with(|| {
            corners.push(Corner { at: Point2::new(point.x, point.y), number });
            corners.len() - 1
        })
    };
    let outline: Vec<usize> = points.iter().enumerate().map(&mut place).collect();
    let next = |i: usize| outline[(i + 1) % outline.len()];
    let mut edges: Vec<[usize; 2]> =
        outline.iter().enumerate().map(|(i, &from)| [from.min(next(i)), from.max(next(i))]).collect();
    edges.retain(|[from, to]| from != to);
    edges.sort_unstable();
    let edges = edges.chunk_by(|a, b| a == b).filter(|same| same.len() % 2 == 1).map(|same| same[0]).collect();
    let mut crossed = false;
    let mesh =
        ConstrainedDelaunayTriangulation::<Corner>::try_bulk_load_cdt(corners, edges, |_| crossed = true).ok()?;
    if crossed {
        return None;
    }
    let mut inside: HashMap<FixedFaceHandle<InnerTag>, bool> = HashMap::new();
    let mut todo: Vec<(FixedFaceHandle<InnerTag>, bool)> = Vec::new();
    for edge in mesh.convex_hull().flat_map(|edge| [edge, edge.rev()]) {
        todo.extend(edge.face().as_inner().map(|face| (face.fix(), edge.is_constraint_edge())));
    }
    while let Some((face, is_inside)) = todo.pop() {
        if inside.insert(face, is_inside).is_some() {
            continue;
        }
        for edge in mesh.face(face).adjacent_edges() {
            let beyond = edge.rev().face().as_inner().map(|face| face.fix()).filter(|face| !inside.contains_key(face));
            todo.extend(beyond.map(|face| (face, is_inside != edge.is_constraint_edge())));
        }
    }
    let faces = mesh.inner_faces().filter(|face| inside.get(&face.fix()) == Some(&true));
    Some(faces.map(|face| face.vertices().map(|corner| corner.data().number)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(points: &[DVec2]) -> Option<f64> {
        let triangles = triangulate(points)?;
        let areas = triangles.iter().map(|corners| {
            let [a, b, c] = corners.map(|i| points[i]);
            0.5 * (b - a).perp_dot(c - a)
        });
        Some(areas.inspect(|area| assert!(*area > 0.0)).sum())
    }

    #[test]
    fn combs_with_repeated_corners_and_slits_are_covered_once() {
        let teeth = 3000;
        let mut comb: Vec<DVec2> = Vec::new();
        for i in 0..teeth {
            let x = f64::from(i);
            comb.extend([(x, 0.0), (x + 0.25, 1000.0), (x + 0.5, 0.0)].map(DVec2::from));
        }
        let end = f64::from(teeth);
        comb.extend([(end, 0.0), (end, -1.0), (end, -1.0), (0.0, -1.0)].map(DVec2::from));
        assert_eq!(area(&comb), Some(f64::from(teeth) * 250.0 + end));
        // An outline that goes in along a slit and back.
        let slit =
            [(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 0.5), (2.0, 1.0), (2.0, 2.0), (0.0, 2.0)].map(DVec2::from);
        assert_eq!(area(&slit), Some(4.0));
        // A hole that a slit joins to the outline.
        let ring = [
            (0.0, 0.0),
            (3.0, 0.0),
            (3.0, 3.0),
            (0.0, 3.0),
            (0.0, 0.0),
            (1.0, 1.0),
            (1.0, 2.0),
            (2.0, 2.0),
            (2.0, 1.0),
            (1.0, 1.0),
        ];
        assert_eq!(area(&ring.map(DVec2::from)), Some(8.0));
    }

    #[test]
    fn outlines_that_cross_themselves_are_told() {
        let bow = [(0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0)].map(DVec2::from);
        assert_eq!(area(&bow), None);
        assert_eq!(area(&[DVec2::ZERO; 5]), Some(0.0));
    }
}
