//! The parts of a mesh that hang together.

use glam::Vec3;

use super::surface::weld;

/// Gives the part of every triangle; parts are numbered from 0 in the order of their first triangles.
///
/// Triangles with a common edge are of one part. An edge is common if the positions of its ends are equal. The caller checks the indices.
pub fn connected(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<u32> {
    let (welded, _) = weld(positions);
    let mut edges: Vec<(u32, u32, u32)> = Vec::with_capacity(3 * triangles.len());
    for (index, triangle) in triangles.iter().enumerate() {
        for corner in 0..3 {
            let [a, b] = [corner, (corner + 1) % 3].map(|corner| welded[triangle[corner] as usize]);
            edges.push((a.min(b), a.max(b), index as u32));
        }
    }
    edges.sort_unstable();
    // Each triangle points to one of its part with a smaller number, and the first one of a part to itself.
    let mut parent: Vec<u32> = (0..triangles.len() as u32).collect();
    for pair in edges.windows(2).filter(|pair| (pair[0].0, pair[0].1) == (pair[1].0, pair[1].1)) {
        let [a, b] = [pair[0].2, pair[1].2].map(|triangle| first_of(&mut parent, triangle));
        parent[a.max(b) as usize] = a.min(b);
    }
    let mut count = 0;
    let mut parts = vec![0; triangles.len()];
    for triangle in 0..triangles.len() {
        let first = first_of(&mut parent, triangle as u32) as usize;
        parts[triangle] = if first == triangle { count } else { parts[first] };
        count += u32::from(first == triangle);
    }
    parts
}

/// Gives the first triangle of the part of a triangle, and shortens the way to it.
fn first_of(parent: &mut [u32], triangle: u32) -> u32 {
    let mut at = triangle;
    while parent[at as usize] != at {
        parent[at as usize] = parent[parent[at as usize] as usize];
        at = parent[at as usize];
    }
    at
}

#[cfg(test)]
mod tests {
    use glam::vec3;

    use super::*;

    #[test]
    fn triangles_with_an_edge_at_equal_positions_are_of_one_part() {
        // Two squares that touch at a corner; the second one has vertices of its own for each triangle.
        let positions = [
            vec3(0.0, 0.0, 0.0),
            vec3(1.0, 0.0, 0.0),
            vec3(1.0, 1.0, 0.0),
            vec3(0.0, 1.0, 0.0),
            vec3(1.0, 1.0, 0.0),
            vec3(2.0, 1.0, 0.0),
            vec3(2.0, 2.0, -0.0),
            vec3(1.0, 1.0, 0.0),
            vec3(2.0, 2.0, 0.0),
            vec3(1.0, 2.0, 0.0),
        ];
        let triangles = [[0, 1, 2], [7, 8, 9], [0, 2, 3], [4, 5, 6], [3, 3, 3]];
        assert_eq!(connected(&positions, &triangles), [0, 1, 0, 1, 2]);
        assert_eq!(connected(&[], &[]), Vec::<u32>::new());
    }

    #[test]
    fn a_long_strip_is_one_part() {
        let count = 1000u32;
        let positions: Vec<Vec3> = (0..count + 2).map(|i| vec3((i / 2) as f32, (i % 2) as f32, 0.0)).collect();
        // From both ends to the middle, so that parts grow together late.
        let order = (0..count / 2).flat_map(|i| [i, count - 1 - i]);
        let triangles: Vec<[u32; 3]> = order.map(|i| [i, i + 1, i + 2]).collect();
        assert!(connected(&positions, &triangles).iter().all(|part| *part == 0));
    }
}
