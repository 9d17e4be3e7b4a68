//! Connected components of meshes: triangles that share corners. The light of one book on a shelf does not stand for that of its neighbour, although both are
//! of one mesh and one material.

use std::collections::HashMap;

use glam::Vec3;

/// The component of each triangle, numbered from 0 in the order of their first triangles, and the number of components. Corners at the same place are one, because
/// meshes repeat corners along hard edges. Corners that do not exist belong to no component.
pub(super) fn components(positions: &[Vec3], indices: &[u32]) -> (Vec<u32>, u32) {
    let mut places: HashMap<[u32; 3], u32> = HashMap::new();
    // Zero has two signs.
    let place = |at: &Vec3| (*at + Vec3::ZERO).to_array().map(f32::to_bits);
    let firsts: Vec<u32> = positions.iter().zip(0..).map(|(at, own)| *places.entry(place(at)).or_insert(own)).collect();
    let mut parents: Vec<u32> = (0..positions.len() as u32).collect();
    let corner = |index: u32| firsts.get(index as usize).copied();
    for triangle in indices.chunks_exact(3) {
        let mut known = triangle.iter().filter_map(|index| corner(*index));
        let Some(first) = known.next() else { continue };
        for other in known {
            let (a, b) = (root(&mut parents, first), root(&mut parents, other));
            parents[a.max(b) as usize] = a.min(b);
        }
    }
    let mut numbers: HashMap<Option<u32>, u32> = HashMap::new();
    let number = |triangle: &[u32]| {
        let of = triangle.iter().find_map(|index| corner(*index)).map(|corner| root(&mut parents, corner));
        let next = numbers.len() as u32;
        *numbers.entry(of).or_insert(next)
    };
    let found: Vec<u32> = indices.chunks_exact(3).map(number).collect();
    (found, numbers.len() as u32)
}

/// The first corner of a component. Halves the ways on its way.
fn root(parents: &mut [u32], mut corner: u32) -> u32 {
    while parents[corner as usize] != corner {
        let above = parents[parents[corner as usize] as usize];
        parents[corner as usize] = above;
        corner = above;
    }
    corner
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_with_a_common_place_are_of_one_component() {
        let at = |x: f32| [Vec3::new(x, 0.0, 0.0), Vec3::new(x + 1.0, 0.0, 0.0), Vec3::new(x, 1.0, 0.0)];
        // The second triangle repeats a corner of the first one, with the other sign of zero; the fourth one joins the third with the fifth.
        let positions = [at(0.0), [Vec3::new(1.0, -0.0, -0.0), Vec3::X * 2.0, Vec3::Y], at(10.0), at(11.0), at(12.0)];
        let positions = positions.concat();
        let indices: Vec<u32> = (0..15).collect();
        assert_eq!(components(&positions, &indices), (vec![0, 0, 1, 1, 1], 2));
        // Whatever the order of the triangles is.
        let turned: Vec<u32> = (0..15).rev().collect();
        assert_eq!(components(&positions, &turned), (vec![0, 0, 0, 1, 1], 2));
        assert_eq!(components(&positions, &[0, 1, 2, 6, 7, 8, 90, 91, 92]), (vec![0, 1, 2], 3));
        assert_eq!(components(&[], &[]), (vec![], 0));
    }
}
